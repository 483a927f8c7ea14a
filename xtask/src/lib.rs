//! Chores of the project, one file each; `cargo xtask` lists them.

pub mod bundle;
pub mod chroot;
pub mod ci;
#[cfg(target_os = "linux")]
pub mod cross;
pub mod debian;
pub mod demo;
pub mod dist;
pub mod firmware;
pub mod fit_player;
pub mod generated;
pub mod jack;
pub mod licences;
pub mod parameter_reference;
#[cfg(target_os = "linux")]
pub mod perf;
pub mod picture;
pub mod prepared;
pub mod programs;
pub mod simulator;
pub mod touch_demo;
pub mod validate;
pub mod web;
#[cfg(target_os = "linux")]
pub mod window;
pub mod wire_vectors;

pub use chalumeau_test_host::machine;

/// One chore.
pub struct Command {
    pub name: &'static str,
    pub about: &'static str,
    pub run: fn(&[String]) -> anyhow::Result<()>,
    /// Understands `--check`: compares instead of writing. `ci` runs all of these.
    pub checks: bool,
}

/// All of them, in the order of the help text.
pub const COMMANDS: &[Command] = &[
    Command {
        name: "demo",
        about: "build the plugin, play the example melody through it, write sound, picture and a table of cents",
        run: demo::run,
        checks: false,
    },
    Command {
        name: "ci",
        about: "everything that must pass before a change is kept; with words, only the steps they name",
        run: ci::run,
        checks: false,
    },
    Command {
        name: "bundle",
        about: "build Chalumeau.clap and Chalumeau.vst3 into target/bundled; takes cargo build's options",
        run: bundle::run,
        checks: false,
    },
    Command {
        name: "validate",
        about: "build the bundles, run Steinberg's tests, clap-validator and pluginval as far as they are there; --all needs all",
        run: validate::run,
        checks: false,
    },
    Command {
        name: "dist",
        about: "what is downloaded, into target/dist: archives, a Debian package; --check builds twice, --try installs in a fresh Debian",
        run: dist::run,
        checks: false,
    },
    Command {
        name: "licences",
        about: "list the licences of all crates in the binaries, in target/bundled; takes targets, all systems by default",
        run: licences::run,
        checks: false,
    },
    Command {
        name: "web",
        about: "build the clarinet for browsers into target/web; --serve [port] shows it on this machine",
        run: web::run,
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "cross",
        about: "build for Windows, macOS and ARM, and compare what they play with Linux; takes here, web, windows, macos, arm",
        run: cross::run,
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "perf",
        about: "measure how the cost of playing grows, a page in target/perf; --full plays a million blocks",
        run: perf::run,
        checks: false,
    },
    #[cfg(target_os = "linux")]
    Command {
        name: "screenshots",
        about: "pictures of plugin and standalone in their windows, every view, into target/screenshots",
        run: window::screenshots,
        checks: false,
    },
    Command {
        name: "simulator",
        about: "build `chalumeau knob-sim` into target/simulator, where demo and tests look for it",
        run: |_| simulator::build(),
        checks: false,
    },
    Command {
        name: "firmware-header",
        about: "write the reed tables as firmware/include/pressure_table_values.h",
        run: generated::firmware_header,
        checks: true,
    },
    Command {
        name: "firmware",
        about: "the knob's firmware: its claims on this machine, compiled for a microcontroller, cost of a tick",
        run: firmware::run,
        checks: false,
    },
    Command {
        name: "scale-bores",
        about: "write the bundled clarinets that are the B flat clarinet scaled",
        run: prepared::scale_bores,
        checks: true,
    },
    Command {
        name: "fit-bore",
        about: "fit the bundled bores' cells to their transfer matrices; takes names of instruments, live, high",
        run: prepared::fit_bore,
        checks: true,
    },
    Command {
        name: "tune",
        about: "play every note of the bundled instruments and find its delay trims; takes the same",
        run: prepared::tune,
        checks: true,
    },
    Command {
        name: "play-dynamics",
        about: "play every note of the bundled instruments at every dynamic and find what it asks of the player; takes the same",
        run: prepared::play_dynamics,
        checks: true,
    },
    Command {
        name: "fit-player",
        about: "fit the player's rule for breath and lip to recorded notes, and validate it on notes left out; with --bound say how near any smooth rule can come; takes minutes",
        run: fit_player::run,
        checks: false,
    },
    Command {
        name: "wire-vectors",
        about: "write the golden frames of the knob's protocol to firmware/golden",
        run: wire_vectors::wire_vectors,
        checks: true,
    },
    Command {
        name: "parameter-reference",
        about: "write docs/parameters.md and the editor tests' parameters from the table of parameters",
        run: parameter_reference::parameter_reference,
        checks: true,
    },
];
