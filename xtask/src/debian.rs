//! A folder with Debian's sid, `target/debian`, whose compilers build for systems other than this one. It is made once.
//!
//! The folder is entered with chroot, inside a mount namespace of its own, so that no mount outlives the command. The
//! workspace appears inside at [`SOURCE`]. All that needs root.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::machine::{self, Package};

/// The workspace, inside the folder.
pub const SOURCE: &str = "/source";
/// Cargo's home, inside the folder.
const CARGO_HOME: &str = "/opt/chalumeau/cargo";
/// The host's certificates, inside the folder. The package ca-certificates overwrites its own.
const CERTIFICATES: &str = "/opt/chalumeau/certificates.crt";
/// Says that the folder has a system, and which packages were added to it.
const READY: &str = "opt/chalumeau/packages";

const DEBOOTSTRAP: Package = Package {
    name: "debootstrap",
    present: || machine::works("sh", &["-c", "command -v debootstrap"]),
    purpose: "a compiler for other systems",
};

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
        let is_root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout.trim_ascii() == b"0");
        ensure!(
            is_root && (is_made || machine::works("apt-get", &["--version"])),
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
        let mut command = enter(&self.root, &self.binds);
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
        let run = |words: &[&str]| machine::run(enter(&self.root, &[]).args(words));
        if let Some(processor) = packages.processor {
            run(&["dpkg", "--add-architecture", processor])?;
        }
        run(&["apt-get", "-q", "update"])?;
        let install = ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q", "install", "-y"];
        let mut words = [&install[..], packages.names].concat();
        words.push("--no-install-recommends");
        run(&words)?;
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
    machine::provide(&[&DEBOOTSTRAP])?;
    let mirror = mirror()?;
    println!("making {} from Debian's sid, once", root.display());
    if root.exists() {
        // The rest of one that did not come to its end; nothing is mounted there.
        fs::remove_dir_all(root)?;
    }
    fs::create_dir_all(root)?;
    machine::run(Command::new("debootstrap").args(["--variant=minbase", "sid"]).arg(root).arg(mirror))?;
    // A mirror may be a snapshot.
    fs::write(root.join("etc/apt/apt.conf.d/99chalumeau"), "Acquire::Check-Valid-Until \"false\";\n")?;
    for file in ["etc/resolv.conf", "etc/hosts"] {
        fs::copy(Path::new("/").join(file), root.join(file))
            .with_context(|| format!("cannot copy /{file}"))?;
    }
    fs::create_dir_all(root.join("opt/chalumeau"))?;
    let certificates = std::env::var_os("SSL_CERT_FILE").map(PathBuf::from);
    let certificates = certificates.unwrap_or_else(|| "/etc/ssl/certs/ca-certificates.crt".into());
    fs::copy(&certificates, root.join(CERTIFICATES.trim_start_matches('/')))
        .with_context(|| format!("cannot copy {}", certificates.display()))?;
    Ok(fs::write(root.join(READY), "")?)
}

/// A command inside the folder, which sees `binds` of the host; its words follow. The mounts end with the command.
fn enter(root: &Path, binds: &[(PathBuf, String)]) -> Command {
    let mut script =
        "set -e; root=$1; shift; mount --rbind /dev \"$root/dev\"; mount -t proc proc \"$root/proc\""
            .to_owned();
    for _ in binds {
        script += "; mount --bind \"$1\" \"$root$2\"; shift 2";
    }
    script += "; exec chroot \"$root\" \"$@\"";
    let mut command = Command::new("unshare");
    command.args(["--mount", "--propagation", "private", "sh", "-c", &script, "sh"]).arg(root);
    for (from, to) in binds {
        command.arg(from).arg(to);
    }
    command
}

/// The mirror of this machine's own Debian, from apt.
fn mirror() -> Result<String> {
    let found = Command::new("apt-get")
        .args(["indextargets", "--format", "$(SITE) $(ORIGIN) $(COMPONENT)", "Created-By: Packages"])
        .output()
        .context("cannot start apt-get")?;
    let found = String::from_utf8_lossy(&found.stdout).into_owned();
    let main = found.lines().filter_map(|line| line.strip_suffix(" Debian main"));
    // The security archive has no sid.
    match main.map(str::trim).find(|site| !site.contains("security")) {
        Some(site) => Ok(site.to_owned()),
        None => bail!(
            "apt knows no mirror of Debian, from which the compiler could come; apt-get update may help"
        ),
    }
}
