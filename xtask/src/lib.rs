//! Chores of the project, one file each; `cargo xtask` lists them. Those that need the clarinet itself are in a program of
//! their own, `xtask/instrument`.

pub mod bundle;
pub mod chroot;
pub mod ci;
#[cfg(target_os = "linux")]
pub mod cross;
pub mod debian;
pub mod demo;
pub mod dist;
pub mod firmware;
pub mod instrument;
pub mod jack;
pub mod licences;
pub mod programs;
pub mod simulator;
pub mod validate;
pub mod web;
#[cfg(target_os = "linux")]
pub mod window;

pub use chalumeau_test_host::machine;

/// One chore.
pub struct Command {
    pub name: &'static str,
    pub about: &'static str,
    run: Run,
    /// Understands `--check`: compares instead of writing. `ci` runs all of these.
    pub checks: bool,
}

/// Where a chore is.
enum Run {
    Here(fn(&[String]) -> anyhow::Result<()>),
    /// In [`instrument`], under the same name.
    Instrument,
}

impl Command {
    /// Does it.
    pub fn run(&self, args: &[String]) -> anyhow::Result<()> {
        match self.run {
            Run::Here(run) => run(args),
            Run::Instrument => instrument::run(self.name, args),
        }
    }
}

/// All of them, in the order of the help text.
pub const COMMANDS: &[Command] = &[
    Command {
        name: "demo",
        about: "build the plugin, play the example melody through it, write sound, picture and a table of cents",
        run: Run::Here(demo::run),
        checks: false,
    },
    Command {
        name: "ci",
        about: "everything that must pass before a change is kept; with words, only the steps they name",
        run: Run::Here(ci::run),
        checks: false,
    },
    Command {
        name: "bundle",
        about: "build Chalumeau.clap and Chalumeau.vst3 into target/bundled; takes cargo build's options",
        run: Run::Here(bundle::run),
        checks: false,
    },
    Command {
        name: "validate",
        about: "build the bundles, run Steinberg's tests, clap-validator and pluginval as far as they are there; --all needs all",
        run: Run::Here(validate::run),
        checks: false,
    },
    Command {
        name: "dist",
        about: "what is downloaded, into target/dist: archives, a Debian package; --check builds twice, --try installs in a fresh Debian",
        run: Run::Here(dist::run),
        checks: false,
    },
    Command {
        name: "licences",
        about: "list the licences of all crates in the binaries, in target/bundled; takes targets, all systems by default",
        run: Run::Here(licences::run),
        checks: false,
    },
    Command {
        name: "web",
        about: "build the clarinet for browsers into target/web; --serve [port] shows it on this machine",
        run: Run::Here(web::run),
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "cross",
        about: "build for Windows, macOS and ARM, and compare what they play with Linux; takes here, web, windows, macos, arm",
        run: Run::Here(cross::run),
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "perf",
        about: "measure how the cost of playing grows, a page in target/perf; --full plays a million blocks",
        run: Run::Instrument,
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "screenshots",
        about: "pictures of plugin and standalone in their windows, every view, into target/screenshots",
        run: Run::Here(window::screenshots),
        checks: false,
    },
    Command {
        name: "simulator",
        about: "build `chalumeau knob-sim` into target/simulator, where demo and tests look for it",
        run: Run::Here(|_| simulator::build()),
        checks: false,
    },
    Command {
        name: "firmware-header",
        about: "write the reed tables as firmware/include/pressure_table_values.h",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "firmware",
        about: "the knob's firmware: its claims on this machine, compiled for a microcontroller, cost of a tick",
        run: Run::Here(firmware::run),
        checks: false,
    },
    Command {
        name: "scale-bores",
        about: "write the bundled clarinets that are the B flat clarinet scaled",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "fit-bore",
        about: "fit the bundled bores' cells to their transfer matrices; takes names of instruments, live, high",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "tune",
        about: "play every note of the bundled instruments and find its delay trims; takes the same",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "play-dynamics",
        about: "play every note of the bundled instruments at every dynamic and find what it asks of the player; takes the same",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "fit-player",
        about: "fit the player's rule for breath and lip to recorded notes, and validate it on notes left out; with --bound say how near any smooth rule can come; takes minutes",
        run: Run::Instrument,
        checks: false,
    },
    Command {
        name: "wire-vectors",
        about: "write the golden frames of the knob's protocol to firmware/golden",
        run: Run::Instrument,
        checks: true,
    },
    Command {
        name: "parameter-reference",
        about: "write docs/parameters.md and the editor tests' parameters from the table of parameters",
        run: Run::Instrument,
        checks: true,
    },
];
