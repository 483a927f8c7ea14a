//! A folder with Debian's sid, `target/debian`, whose compilers build for systems other than this one. It is made once.
//!
//! The workspace appears inside at [`SOURCE`]. The folder needs root, see [`chroot`].

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::{chroot, machine};

/// The workspace, inside the folder.
pub const SOURCE: &str = "/source";
/// Cargo's home, inside the folder.
const CARGO_HOME: &str = "/opt/chalumeau/cargo";
/// The host's certificates, inside the folder. The package ca-certificates overwrites its own.
const CERTIFICATES: &str = "/opt/chalumeau/certificates.crt";
/// Says that the folder has a system, and which packages were added to it.
const READY: &str = "opt/chalumeau/packages";

/// Debian's packages that one system needs.
pub struct Packages {
    /// What they are for, said where they cannot be had.
    pub purpose: &'static str,
    /// Debian's name of a second processor, if some of the packages are for it.
    pub processor: Option<&'static str>,
    pub names: &'static [&'static str],
}

/// The folder, with the packages that were asked for.
pub struct Debian {
    root: PathBuf,
    /// Folders of the host and where they appear inside.
    binds: Vec<(PathBuf, String)>,
}

impl Debian {
    /// Makes the folder unless it is there, and adds the packages that it does not have.
    pub fn with(packages: &Packages) -> Result<Self> {
        let root = machine::target().join("debian");
        let is_made = root.join(READY).exists();
        ensure!(
            chroot::possible(),
            "{} comes from a folder with Debian's packages, which this command makes on Debian, as root",
            packages.purpose
        );
        if !is_made {
            make(&root)?;
        }
        let mut debian = Self { root, binds: Vec::new() };
        debian.add(packages)?;
        debian.show_workspace()?;
        Ok(debian)
    }

    /// A command inside the folder, in the workspace, with these variables and no others of the host; its words follow.
    pub fn command(&self, variables: &[(&str, &str)], program: &str) -> Command {
        let binds: Vec<_> = self.binds.iter().map(|(from, to)| (from.as_path(), to.as_str())).collect();
        let mut command = chroot::enter(&self.root, &binds);
        command.args(["env", "-i", "-C", SOURCE, "PATH=/usr/bin:/bin", "HOME=/root"]);
        command.args(variables.iter().map(|(name, value)| format!("{name}={value}")));
        command.arg(program);
        command
    }

    /// Debian's cargo, which builds to a folder of the host's workspace.
    pub fn cargo(&self, target: &Path, variables: &[(&str, &str)]) -> Result<Command> {
        fs::create_dir_all(target)?;
        let target = inside(target)?;
        let own = [
            ("CARGO_HOME", CARGO_HOME),
            ("CARGO_HTTP_CAINFO", CERTIFICATES),
            ("CARGO_TARGET_DIR", &target),
            ("CARGO_INCREMENTAL", "0"),
        ];
        Ok(self.command(&[&own, variables].concat(), "cargo"))
    }

    fn add(&self, packages: &Packages) -> Result<()> {
        let list = self.root.join(READY);
        let mut installed = fs::read_to_string(&list)?;
        if packages.names.iter().all(|name| installed.lines().any(|line| line == *name)) {
            return Ok(());
        }
        println!("adding to {}: {}", self.root.display(), packages.names.join(" "));

        if let Some(processor) = packages.processor {
            machine::run(chroot::enter(&self.root, &[]).args(["dpkg", "--add-architecture", processor]))?;
        }
        machine::run(chroot::apt(&self.root).arg("update"))?;
        machine::run(
            chroot::apt(&self.root).args(["install", "--no-install-recommends"]).args(packages.names),
        )?;
        for name in packages.names {
            installed.push_str(name);
            installed.push('\n');
        }
        Ok(fs::write(list, installed)?)
    }

    /// Prepares what the folder's cargo and programs see of the host.
    fn show_workspace(&mut self) -> Result<()> {
        let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
        let home = home.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")));
        let home = home.context("cargo's home is not known; set CARGO_HOME")?;
        let inner_home = self.root.join(CARGO_HOME.trim_start_matches('/'));
        fs::create_dir_all(&inner_home)?;
        // How this machine reaches the registry; it stays below the target folder.
        for name in ["config.toml", "config"] {
            if home.join(name).exists() {
                fs::copy(home.join(name), inner_home.join(name))?;
            }
        }
        let registry = home.join("registry");
        fs::create_dir_all(&registry)?;
        self.binds = vec![
            (machine::root().to_owned(), SOURCE.to_owned()),
            (registry, format!("{CARGO_HOME}/registry")),
        ];
        for (_, to) in &self.binds {
            fs::create_dir_all(self.root.join(to.trim_start_matches('/')))?;
        }
        Ok(())
    }
}

/// The path inside the folder of a path in the workspace.
pub fn inside(path: &Path) -> Result<String> {
    let below = path.strip_prefix(machine::root()).context(
        "the target folder must lie in the workspace, because the compiler sees nothing else; unset CARGO_TARGET_DIR",
    )?;
    Ok(Path::new(SOURCE).join(below).display().to_string())
}

fn make(root: &Path) -> Result<()> {
    println!("making {} from Debian's sid, once", root.display());
    chroot::make(root, "sid")?;
    fs::create_dir_all(root.join("opt/chalumeau"))?;
    let certificates = std::env::var_os("SSL_CERT_FILE").map(PathBuf::from);
    let certificates = certificates.unwrap_or_else(|| "/etc/ssl/certs/ca-certificates.crt".into());
    fs::copy(&certificates, root.join(CERTIFICATES.trim_start_matches('/')))
        .with_context(|| format!("cannot copy {}", certificates.display()))?;
    Ok(fs::write(root.join(READY), "")?)
}
