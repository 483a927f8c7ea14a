//! The machine underneath: folders, programs, system packages.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

/// The workspace, whichever folder the command was called from.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."))
}

/// Makes the workspace the current folder.
pub fn enter_workspace() -> Result<()> {
    std::env::set_current_dir(root()).with_context(|| format!("cannot enter {}", root().display()))
}

/// Where cargo builds to.
pub fn target() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(folder) => root().join(folder),
        None => root().join("target"),
    }
}

/// The cargo that runs this.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // What is built here is built once: to be ready for the next change costs twice the work.
    if std::env::var_os("CARGO_INCREMENTAL").is_none() {
        command.env("CARGO_INCREMENTAL", "0");
    }
    command
}

/// Runs a command to its end; anything but success is an error that names it.
pub fn run(command: &mut Command) -> Result<()> {
    let name = described(command);
    let status = command.status().with_context(|| format!("cannot start `{name}`"))?;
    if status.success() { Ok(()) } else { bail!("`{name}` failed: {status}") }
}

/// How long a program that is asked to end may take.
const LAST_WORDS: Duration = Duration::from_secs(3);

/// Ends a program: asked first, where the system has a way of asking, and killed when it does not listen.
pub fn terminate(child: &mut Child) -> Result<()> {
    let asked =
        Command::new("sh").args(["-c", &format!("kill {}", child.id())]).stderr(Stdio::null()).status();
    let began = Instant::now();
    while asked.as_ref().is_ok_and(ExitStatus::success) && began.elapsed() < LAST_WORDS {
        if child.try_wait()?.is_some() {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill()?;
    child.wait()?;
    Ok(())
}

/// Program and arguments, as one would type them.
pub fn described(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

/// Whether a program can be started and says so itself.
pub fn works(program: &str, args: &[&str]) -> bool {
    Command::new(program)
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Whether the dynamic linker finds a library, asked through Python, which is needed for DawDreamer anyway.
fn loads(library: &str) -> bool {
    works("python3", &["-c", &format!("import ctypes; ctypes.CDLL('{library}')")])
}

/// A system package (Debian's name) and how to tell that it is there.
pub struct Package {
    pub name: &'static str,
    pub present: fn() -> bool,
    /// What it is for, said when it cannot be installed.
    pub purpose: &'static str,
}

/// For cargo itself: crates with C parts, and linking.
pub const CC: Package = Package { name: "gcc", present: || works("cc", &["--version"]), purpose: "linking" };
/// Counts instructions for the gates.
pub const VALGRIND: Package = Package {
    name: "valgrind",
    present: || works("valgrind", &["--version"]),
    purpose: "counting instructions",
};
/// For the knob's firmware, on this machine.
pub const CXX: Package =
    Package { name: "g++", present: || works("g++", &["--version"]), purpose: "the knob's firmware" };
/// For the knob's firmware as a microcontroller sees it.
pub const ARM_CXX: Package = Package {
    name: "gcc-arm-none-eabi",
    present: || works("arm-none-eabi-g++", &["--version"]),
    purpose: "the firmware's ARM check",
};
/// Its headers.
pub const ARM_LIBRARY: Package = Package {
    name: "libstdc++-arm-none-eabi-newlib",
    present: || works("arm-none-eabi-g++", &["-x", "c++", "-include", "new", "-E", "/dev/null"]),
    purpose: "the firmware's ARM check",
};
/// For the pip that fetches DawDreamer.
pub const VENV: Package = Package {
    name: "python3-venv",
    present: || works("python3", &["-c", "import ensurepip, venv"]),
    purpose: "the DawDreamer tests",
};
/// For DawDreamer.
pub const GL: Package =
    Package { name: "libgl1", present: || loads("libGL.so.1"), purpose: "the DawDreamer tests" };
/// For DawDreamer.
pub const GLIB: Package =
    Package { name: "libglib2.0-0", present: || loads("libglib-2.0.so.0"), purpose: "the DawDreamer tests" };
/// For MIDI devices and `chalumeau-standalone`.
pub const PKG_CONFIG: Package =
    Package { name: "pkg-config", present: || works("pkg-config", &["--version"]), purpose: "finding ALSA" };
/// For MIDI devices and `chalumeau-standalone`.
pub const ALSA: Package = Package {
    name: "libasound2-dev",
    present: || works("pkg-config", &["--exists", "alsa"]) || !cfg!(target_os = "linux"),
    purpose: "MIDI devices, and sound in chalumeau-standalone",
};

/// For `chalumeau-standalone`: its JACK binding asks pkg-config although it loads the library at run time.
pub const JACK: Package = Package {
    name: "libjack-jackd2-dev",
    present: || works("pkg-config", &["--exists", "jack"]),
    purpose: "JACK in chalumeau-standalone",
};
/// For MIDI without a sound card.
pub const JACKD: Package = Package {
    name: "jackd2",
    present: || works("jackd", &["--version"]),
    purpose: "the tests of MIDI over JACK",
};
/// For the VST3 test host.
pub const XCB: Package = Package {
    name: "libxcb1-dev",
    present: || works("pkg-config", &["--exists", "xcb"]),
    purpose: "linking the VST3 tests",
};

/// A display without a screen.
pub const XVFB: Package = Package {
    name: "xvfb",
    present: || works("sh", &["-c", "command -v Xvfb"]),
    purpose: "the tests of the window",
};
/// OpenGL without a graphics card.
pub const MESA: Package =
    Package { name: "libglx-mesa0", present: || loads("libGLX_mesa.so.0"), purpose: "drawing the window" };
/// The window asks for it at run time.
pub const EGL: Package =
    Package { name: "libegl1", present: || loads("libEGL.so.1"), purpose: "drawing the window" };
/// The window reads keys through it, at run time.
pub const XKB: Package = Package {
    name: "libxkbcommon-x11-0",
    present: || loads("libxkbcommon-x11.so.0"),
    purpose: "keys in the window",
};
/// The window speaks to the display through it, at run time.
pub const X11_XCB: Package =
    Package { name: "libx11-xcb1", present: || loads("libX11-xcb.so.1"), purpose: "opening the window" };
/// A host for the VST3's window.
pub const ARDOUR: Package = Package {
    name: "ardour",
    present: || works("sh", &["-c", "ls /usr/lib/ardour*/ardour-vst3-scanner"]),
    purpose: "the window in a host of musicians",
};

/// Installs what is missing with apt-get, or names it.
pub fn provide(packages: &[&Package]) -> Result<()> {
    let missing: Vec<_> = packages.iter().filter(|package| !(package.present)()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let names: Vec<_> = missing.iter().map(|package| package.name).collect();
    let purposes: Vec<_> =
        missing.iter().map(|package| format!("{} (for {})", package.name, package.purpose)).collect();
    let purposes = purposes.join(", ");
    if !works("apt-get", &["--version"]) {
        bail!("missing, and no apt-get to install it with: {purposes}; the names are Debian's");
    }
    println!("installing {purposes}");
    finish_interrupted()?;
    apt(&["update"])
        .and_then(|()| apt(&[&["install", "-y", "--no-install-recommends"], &names[..]].concat()))?;
    match missing.iter().find(|package| !(package.present)()) {
        Some(package) => bail!("{} was installed but does not work", package.name),
        None => Ok(()),
    }
}

/// What an interrupted run of this command left half installed: apt-get refuses to go on from there.
fn finish_interrupted() -> Result<()> {
    let audit = Command::new("dpkg").arg("--audit").output();
    if !audit.is_ok_and(|audit| !audit.stdout.is_empty()) {
        return Ok(());
    }
    println!("finishing an installation that was interrupted");
    // What it cannot configure, apt-get installs again. It removes nothing.
    let _ = run(as_root("dpkg").args(["--configure", "-a"]));
    apt(&["install", "-y", "--fix-broken", "--no-remove"])
}

fn apt(args: &[&str]) -> Result<()> {
    let mut command = as_root("apt-get");
    // Another apt may hold the lock for a while, and a mirror may fail now and then.
    command.args(["-q", "-o", "DPkg::Lock::Timeout=500", "-o", "Acquire::Retries=3"]).args(args);
    run(&mut command).context("install the packages named above by hand, then try again")
}

/// A command of Debian's packages, with sudo unless this is root; it asks nothing.
fn as_root(program: &str) -> Command {
    let root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout.trim_ascii() == b"0");
    let mut command = if root {
        Command::new(program)
    } else {
        let mut sudo = Command::new("sudo");
        sudo.arg(program);
        sudo
    };
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}
