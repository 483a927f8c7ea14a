//! Builds the WebAssembly modules. The target's library comes from the installed compiler, from rustup, or, where neither has
//! it, from Debian's packages (`debian`), whose lld is then the linker.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::debian::{Debian, Packages};
use crate::machine;

const TARGET: &str = "wasm32-unknown-unknown";
/// Vectors of four numbers, which every browser has had since 2023.
const FLAGS: &str = "-C target-feature=+simd128";
const BUILD: [&str; 7] =
    ["build", "--release", "--locked", "--lib", "--package", "chalumeau-web", "--target"];
/// Debian's compiler, the library for the target, and the linker.
const PACKAGES: Packages = Packages {
    purpose: "the compiler's library for WebAssembly",
    processor: None,
    names: &["rustc", "cargo", "libstd-rust-dev-wasm32", "lld"],
};

/// The modules: their names in the page, and the feature that each is built with.
const MODULES: [(&str, &str); 2] = [("workshop.wasm", "workshop"), ("chalumeau.wasm", "workshop-packages")];

/// Builds the modules into `page` and returns their names.
pub fn build(page: &Path) -> Result<Vec<String>> {
    let mut names = Vec::new();
    for (name, feature) in MODULES {
        let built = build_module(feature)?;
        fs::copy(&built, page.join(name))
            .with_context(|| format!("cannot copy {} to {}", built.display(), page.display()))?;
        names.push(name.to_owned());
    }
    Ok(names)
}

fn build_module(feature: &str) -> Result<PathBuf> {
    let folder = machine::target().join("web-build");
    let words = BUILD.into_iter().chain([TARGET, "--features", feature]);
    if has_target() {
        let mut cargo = machine::cargo();
        cargo.args(words).env("RUSTFLAGS", FLAGS).env("CARGO_TARGET_DIR", &folder);
        machine::run(&mut cargo)?;
    } else {
        let debian =
            Debian::with(&PACKAGES).with_context(|| format!("`rustup target add {TARGET}` fails"))?;
        let linker = ("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", "wasm-ld");
        let mut cargo = debian.cargo(&folder, &[("RUSTFLAGS", FLAGS), linker])?;
        machine::run(cargo.args(words))?;
    }
    Ok(folder.join(TARGET).join("release/chalumeau_web.wasm"))
}

/// Whether the compiler has the target's library, which rustup may have to fetch.
fn has_target() -> bool {
    let installed = || {
        let found = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
        found.is_ok_and(|found| Path::new(String::from_utf8_lossy(&found.stdout).trim()).is_dir())
    };
    installed() || (machine::works("rustup", &["target", "add", TARGET]) && installed())
}
