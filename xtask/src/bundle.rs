//! Builds the plugin and puts it into the shapes hosts look for, with the licences of what is inside.

use std::path::PathBuf;

use anyhow::{Result, anyhow};

use crate::{licences, machine};

const PACKAGE: &str = "chalumeau";

/// `cargo xtask bundle [cargo build options]`; release unless a profile is named.
pub fn run(args: &[String]) -> Result<()> {
    let mut options: Vec<String> =
        ["--lib", "--no-default-features", "--features", "plugin,devices"].map(String::from).into();
    if !args.iter().any(|arg| arg == "--release" || arg.starts_with("--profile")) {
        options.push("--profile=plugin".to_owned());
    }
    options.extend_from_slice(args);
    nice_plug_xtask::build(&[PACKAGE.to_owned()], &options)?;
    nice_plug_xtask::bundle(&machine::target(), PACKAGE, &options, false)?;
    licences::beside_bundles(&options)
}

/// The bundled CLAP, as a host would load it: the file, or on macOS the binary inside the bundle.
pub fn clap() -> Result<PathBuf> {
    let path = machine::target().join("bundled/Chalumeau.clap");
    let inside = path.join("Contents/MacOS/Chalumeau");
    present(if inside.exists() { inside } else { path })
}

/// The bundled VST3, a folder.
pub fn vst3() -> Result<PathBuf> {
    present(machine::target().join("bundled/Chalumeau.vst3"))
}

fn present(path: PathBuf) -> Result<PathBuf> {
    if path.exists() {
        Ok(path)
    } else {
        Err(anyhow!("{} is not there; run `cargo xtask bundle`", path.display()))
    }
}

/// Where hosts look for plugins.
pub const HOMES: &str =
    "  Linux    cp target/bundled/Chalumeau.clap ~/.clap/; cp -r target/bundled/Chalumeau.vst3 ~/.vst3/
  macOS    ~/Library/Audio/Plug-Ins/CLAP and ~/Library/Audio/Plug-Ins/VST3
  Windows  %COMMONPROGRAMFILES%\\CLAP and %COMMONPROGRAMFILES%\\VST3";
