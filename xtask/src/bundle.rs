//! Builds the plugin and puts it into the shapes hosts look for, with the licences of what is inside.

use anyhow::Result;

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

/// Where hosts look for plugins.
pub const HOMES: &str =
    "  Linux    cp target/bundled/Chalumeau.clap ~/.clap/; cp -r target/bundled/Chalumeau.vst3 ~/.vst3/
  macOS    ~/Library/Audio/Plug-Ins/CLAP and ~/Library/Audio/Plug-Ins/VST3
  Windows  %COMMONPROGRAMFILES%\\CLAP and %COMMONPROGRAMFILES%\\VST3";
