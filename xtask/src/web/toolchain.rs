//! Builds the WebAssembly module. The target's library comes from the installed compiler, from rustup, or, where neither has
//! it, from a folder with Debian's sid, `target/web-toolchain`, which is made once.
//!
//! Debian's packages of the compiler carry the library for the target, and its lld is the linker. Such a folder needs root.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{chroot, machine};

const TARGET: &str = "wasm32-unknown-unknown";
/// Vectors of four numbers, which every browser has had since 2023.
const FLAGS: &str = "-C target-feature=+simd128";
const BUILD: [&str; 7] =
    ["build", "--release", "--locked", "--lib", "--package", "chalumeau-web", "--target"];
/// Debian's compiler, the library for the target, and the linker.
const PACKAGES: [&str; 4] = ["rustc", "cargo", "libstd-rust-dev-wasm32", "lld"];
/// Inside the folder: the workspace, cargo's home, and the host's certificates. The package ca-certificates overwrites its own.
const SOURCE: &str = "/source";
const CARGO_HOME: &str = "/opt/chalumeau/cargo";
const CERTIFICATES: &str = "/opt/chalumeau/certificates.crt";
/// Says that the folder is complete.
const READY: &str = "opt/chalumeau/ready";

/// Builds the module and returns where it is.
pub fn build() -> Result<PathBuf> {
    let folder = machine::target().join("web-build");
    if has_target() {
        let mut cargo = machine::cargo();
        cargo.args(BUILD).arg(TARGET).env("RUSTFLAGS", FLAGS).env("CARGO_TARGET_DIR", &folder);
        machine::run(&mut cargo)?;
    } else {
        in_debian(&folder)?;
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

fn in_debian(target: &Path) -> Result<()> {
    let root = machine::target().join("web-toolchain");
    make(&root)?;
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
    let home = home.context("cargo's home is not known; set CARGO_HOME")?;
    let inner_home = root.join(CARGO_HOME.trim_start_matches('/'));
    for folder in
        [&root.join(SOURCE.trim_start_matches('/')), &inner_home.join("registry"), &home.join("registry")]
    {
        fs::create_dir_all(folder)?;
    }
    // How this machine reaches the registry; it stays below the target folder.
    for name in ["config.toml", "config"] {
        if home.join(name).exists() {
            fs::copy(home.join(name), inner_home.join(name))?;
        }
    }
    fs::create_dir_all(target)?;
    let inner_target = Path::new(SOURCE).join(target.strip_prefix(machine::root()).context(
        "the target folder must lie in the workspace, because the compiler sees nothing else; unset CARGO_TARGET_DIR",
    )?);
    let mut command = chroot::enter(
        &root,
        &[(machine::root(), SOURCE), (&home.join("registry"), &format!("{CARGO_HOME}/registry"))],
    );
    command
        .args(["env", "-i", "PATH=/usr/bin:/bin", "HOME=/root", &format!("CARGO_HOME={CARGO_HOME}")])
        .args([format!("CARGO_HTTP_CAINFO={CERTIFICATES}"), format!("RUSTFLAGS={FLAGS}")])
        .arg("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld")
        .arg(format!("CARGO_TARGET_DIR={}", inner_target.display()))
        .args(["cargo", BUILD[0], "--manifest-path", &format!("{SOURCE}/Cargo.toml")])
        .args(&BUILD[1..])
        .arg(TARGET);
    machine::run(&mut command)
}

/// Makes the folder with sid, unless it is there.
fn make(root: &Path) -> Result<()> {
    if root.join(READY).exists() {
        return Ok(());
    }
    ensure!(
        chroot::possible(),
        "the compiler has no library for {TARGET}. `rustup target add {TARGET}` fetches it; on Debian and as root, this \
         command makes a folder with Debian's own compiler"
    );
    println!("making {} from Debian's sid, once", root.display());
    chroot::make(root, "sid")?;
    machine::run(chroot::apt(root).args(["install", "--no-install-recommends"]).args(PACKAGES))?;
    fs::create_dir_all(root.join("opt/chalumeau"))?;
    let certificates = std::env::var_os("SSL_CERT_FILE").map(PathBuf::from);
    let certificates = certificates.unwrap_or_else(|| "/etc/ssl/certs/ca-certificates.crt".into());
    fs::copy(&certificates, root.join(CERTIFICATES.trim_start_matches('/')))
        .with_context(|| format!("cannot copy {}", certificates.display()))?;
    Ok(fs::write(root.join(READY), "")?)
}
