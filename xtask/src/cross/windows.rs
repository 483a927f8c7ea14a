//! Everything for Windows, built by MinGW and run by Wine: command line with devices, plugin and standalone; their sound in
//! hosts, their windows, and a knob at a COM port.
//!
//! - `wine`: runs the programs; `pictures`: of what they show; `knob`: the simulated knob

mod knob;
mod pictures;
mod wine;

use anyhow::Result;
use chalumeau_test_host::artefacts;

use crate::cross::build::Cargo;
use crate::cross::folder;
use crate::debian::Packages;
use wine::Wine;

const CARGO: Cargo = Cargo {
    system: "windows",
    target: "x86_64-pc-windows-gnu",
    packages: Packages {
        purpose: "the compiler's library for Windows",
        processor: None,
        names: &[
            "rustc",
            "cargo",
            "rust-src",
            "gcc",
            "libc6-dev",
            "g++-mingw-w64-x86-64-posix",
            "wine",
            "wine64",
            "socat",
            // The window is drawn with OpenGL.
            "libegl1",
            "libgl1",
            "libgl1-mesa-dri",
            "libglx-mesa0",
        ],
    },
    builds_library: true,
    variables: &[],
};
/// One build of programs, plugin and hosts, so that they share all that is below them.
const OPTIONS: &[&str] = &[
    "-p",
    "chalumeau",
    "-p",
    "chalumeau-test-host",
    "-p",
    "chalumeau-web",
    "--no-default-features",
    "--features",
    "chalumeau/simulator,chalumeau/standalone",
    "--lib",
    "--bin",
    "chalumeau",
    "--bin",
    "chalumeau-standalone",
    "--test",
    "clap",
    "--test",
    "vst3",
    "--test",
    "window_on_windows",
    "--test",
    "scores",
];
/// Both formats are the same library; a VST3 lies in a folder.
const CLAP: &str = "Chalumeau.clap";
const VST3: &str = "Chalumeau.vst3";
const INSIDE_VST3: &str = "Chalumeau.vst3/Contents/x86_64-win/Chalumeau.vst3";

pub fn run() -> Result<()> {
    let built = CARGO.build(OPTIONS)?;
    let folder = folder(CARGO.system);
    built.keep(
        &folder,
        &[
            ("chalumeau", "chalumeau.exe"),
            ("chalumeau-standalone", "chalumeau-standalone.exe"),
            ("chalumeau.dll", CLAP),
            ("chalumeau.dll", INSIDE_VST3),
        ],
    )?;
    let wine = Wine::start(&built)?;
    wine.runner.files("chalumeau", &folder)?;
    wine.runner.scores(&folder)?;
    hosts(&wine)?;
    pictures::look(&wine)?;
    knob::play(&wine, &folder)
}

/// The tests of the plugin in hosts: the melody, among others, has the samples that the repository keeps.
fn hosts(wine: &Wine) -> Result<()> {
    wine.runner.test("clap", &[])?;
    wine.runner.test("vst3", &[])
}

/// Where the hosts find the plugins, as Windows' programs see it, and a folder for the instruments that they make.
fn places() -> Result<Vec<(String, String)>> {
    let folder = folder(CARGO.system);
    [(artefacts::CLAP, CLAP), (artefacts::VST3, VST3), (artefacts::CACHE, "cache")]
        .into_iter()
        .map(|(variable, name)| Ok((variable.to_owned(), wine::path(&folder.join(name))?)))
        .collect()
}
