//! Folders with a Debian of their own, and commands inside them: fresh systems without a virtual machine.
//!
//! A folder is entered with chroot, inside a mount namespace of its own, so that no mount outlives the command. All that needs
//! root.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::machine::{self, Package};

const DEBOOTSTRAP: Package = Package {
    name: "debootstrap",
    present: || machine::works("sh", &["-c", "command -v debootstrap"]),
    purpose: "a folder with Debian",
};

/// Whether this machine can make and enter such folders: it is a Debian, and we are root.
pub fn possible() -> bool {
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout.trim_ascii() == b"0");
    is_root && machine::works("apt-get", &["--version"])
}

/// Makes a folder with the smallest Debian of this suite, for example "sid"; what was in the folder is removed.
pub fn make(root: &Path, suite: &str) -> Result<()> {
    ensure!(possible(), "a folder with Debian's {suite} can only be made on Debian and as root");
    machine::provide(&[&DEBOOTSTRAP])?;
    let mirror = mirror()?;
    if root.exists() {
        // The rest of one that did not come to its end; nothing is mounted there.
        fs::remove_dir_all(root)?;
    }
    fs::create_dir_all(root)?;
    machine::run(Command::new("debootstrap").args(["--variant=minbase", suite]).arg(root).arg(mirror))?;
    // A mirror may be a snapshot.
    fs::write(root.join("etc/apt/apt.conf.d/99chalumeau"), "Acquire::Check-Valid-Until \"false\";\n")?;
    for file in ["etc/resolv.conf", "etc/hosts"] {
        fs::copy(Path::new("/").join(file), root.join(file))
            .with_context(|| format!("cannot copy /{file}"))?;
    }
    Ok(())
}

/// `apt-get` inside the folder, without questions; its words follow.
pub fn apt(root: &Path) -> Command {
    let mut command = enter(root, &[]);
    command.args(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q", "-y"]);
    command
}

/// A command inside the folder, which sees `binds` of the host; its words follow. The mounts end with the command.
pub fn enter(root: &Path, binds: &[(&Path, &str)]) -> Command {
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
    // The security archive has neither sid nor the beginning of a release.
    match main.map(str::trim).find(|site| !site.contains("security")) {
        Some(site) => Ok(site.to_owned()),
        None => bail!("apt knows no mirror of Debian; apt-get update may help"),
    }
}
