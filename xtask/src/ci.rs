//! Everything that must pass before a change is kept, in one command. Steps go on after a failure, so that one run
//! tells all; the summary says which ones failed and how long each took.

mod beside;
mod tests;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rayon::iter::{ParallelBridge, ParallelIterator};

#[cfg(target_os = "linux")]
use chalumeau_test_host::ardour;
use chalumeau_test_host::artefacts;

use crate::machine::{
    self, ALSA, ARM_CXX, ARM_LIBRARY, CC, CXX, EGL, GL, GLIB, JACK, JACKD, MESA, PKG_CONFIG, Package,
    VALGRIND, VENV, X11_XCB, XCB, XKB, XVFB,
};
use crate::programs::{TESTS, programs};
use crate::{COMMANDS, bundle, firmware, validate, web};
#[cfg(target_os = "linux")]
use crate::{jack, window};

/// DawDreamer's version is pinned: a new one may host differently.
const DAWDREAMER_PACKAGES: &[&str] = &["dawdreamer==0.9.0", "numpy<3"];
/// What pedalboard's test needs, pinned likewise.
const PEDALBOARD_PACKAGES: &[&str] = &["pedalboard==0.9.26", "mido==1.3.3", "numpy<3"];
/// What the programs in `examples/` need, pinned for the same reason.
const EXAMPLE_PACKAGES: &[&str] =
    &["numpy==2.4.6", "matplotlib==3.11.2", "libmapper==2.6.1", "python-osc==1.10.2"];

/// What builds the Python package and what its tests need, pinned for the same reason.
const PACKAGE_PACKAGES: &[&str] = &[
    "maturin==1.16.0",
    "pytest==9.2.0",
    "mypy==2.4.1",
    "numpy==2.4.6",
    "pyarrow==26.0.1",
    "distributed==2026.8.0",
    "nbformat==5.11.1",
    "nbclient==0.11.0",
    "ipykernel==7.4.0",
    "matplotlib==3.11.2",
];

/// One thing that must pass.
struct Step {
    name: &'static str,
    run: fn() -> Result<()>,
    beside: Beside,
}

/// What may run at the same time as a step, as many as there are cores.
#[derive(Clone, Copy, PartialEq)]
enum Beside {
    Nothing,
    /// Steps that build and fetch, as this one does: one more than there are cores, for now and then one of them waits, for a
    /// server or for another's build. None of them follows a clock closely.
    Building,
    /// Steps that keep a core busy, as this one does. None of them follows a clock.
    Busy,
    /// Steps that follow a clock and leave half a core idle, as this one does.
    Waiting,
}

const fn alone(name: &'static str, run: fn() -> Result<()>) -> Step {
    Step { name, run, beside: Beside::Nothing }
}

const fn building(name: &'static str, run: fn() -> Result<()>) -> Step {
    Step { name, run, beside: Beside::Building }
}

const fn beside(name: &'static str, run: fn() -> Result<()>) -> Step {
    Step { name, run, beside: Beside::Busy }
}

const fn waiting(name: &'static str, run: fn() -> Result<()>) -> Step {
    Step { name, run, beside: Beside::Waiting }
}

/// Two builds serve all steps: one debug build of everything (`programs`), whose core the wheel has too, and the bundle.
/// Clippy and documentation only check. A step whose tool is missing fails: a gate that did not run is not green.
static STEPS: &[Step] = &[
    alone("system packages", packages),
    alone("format", || cargo("fmt --all --check")),
    building("clippy", || cargo("clippy --workspace --all-features --all-targets -- -D warnings")),
    building("Python environments", environments),
    building("firmware, host and ARM", firmware::all),
    building("clippy, core alone", || cargo("clippy -p chalumeau-core --all-targets -- -D warnings")),
    building("clippy, command line alone", || {
        cargo("clippy -p chalumeau --no-default-features --features cli --all-targets -- -D warnings")
    }),
    building("clippy, plugin alone", || {
        cargo("clippy -p chalumeau --no-default-features --features plugin -- -D warnings")
    }),
    // Before all that is linked to the library: the wheel builds it with fewer features into the same file, the plugin's, so that
    // afterwards everything would be built again.
    alone("Python package, wheel", python_wheel),
    alone("tests and programs build", || programs().map(drop)),
    alone("tests", tests::run),
    // The longest first.
    building("bundle", || bundle::run(&[])),
    building("web", web::test),
    building("Python examples", python_examples),
    building("Python package", python_package),
    building("instructions", || machine::run(&mut Command::new("benches/instructions.sh"))),
    building("documentation", documentation),
    building("examples in documentation", || cargo("test --workspace --all-features --doc")),
    building("generated files", generated),
    // The longest first.
    waiting("torque's ends in clack-host", torque_ends),
    waiting("knob's command", || tests::run_alone("knob_command")),
    #[cfg(target_os = "linux")]
    waiting("MIDI over JACK", jack::test),
    waiting("device", || tests::run_alone("device")),
    // Elsewhere there is neither a JACK nor a display that a test could start.
    #[cfg(target_os = "linux")]
    alone("window", window::test),
    #[cfg(target_os = "linux")]
    alone("VST3's window in Ardour", ardour::test),
    // After all that builds: these load the plugin, and each keeps one core busy. The longest first.
    beside("CLAP with allocation checks, rules", || clap_checked(CLAP_RULES)),
    beside("CLAP with allocation checks, playing", || clap_checked(CLAP_PLAYING)),
    beside("VST3 in vst3-host", || machine::run(&mut host_tests(&["vst3", "vst3_rules", "vst3_raw"]))),
    beside("validators", validate::installed),
    beside("VST3 in DawDreamer", dawdreamer),
    beside("VST3 in pedalboard", pedalboard),
    beside("CLAP in clack-host", clap),
    beside("standalone", standalone),
];

/// Before the whole name of a step, which then runs in this process.
const EXACTLY: &str = "--exactly";

/// What became of a step.
struct Done {
    step: &'static Step,
    passed: bool,
    took: Duration,
    /// Where it wrote, if it ran beside others.
    log: Option<PathBuf>,
}

/// `cargo xtask ci [word..]`: all steps, or those whose name contains one of the words.
pub fn run(words: &[String]) -> Result<()> {
    if let [flag, name] = words
        && flag == EXACTLY
    {
        let step = STEPS.iter().find(|step| step.name == *name);
        return (step.with_context(|| format!("no step is called {name:?}"))?.run)();
    }
    let chosen: Vec<_> = STEPS
        .iter()
        .filter(|step| words.is_empty() || words.iter().any(|word| step.name.contains(word)))
        .collect();
    if chosen.is_empty() {
        let names: Vec<_> = STEPS.iter().map(|step| step.name).collect();
        bail!("no step is called {words:?}; the steps are: {}", names.join("; "));
    }
    let began = Instant::now();
    let mut report = Vec::new();
    for steps in chosen.chunk_by(|a, b| a.beside == b.beside && a.beside != Beside::Nothing) {
        match steps {
            [step] => report.push(done(step)),
            _ => {
                let more = usize::from(steps[0].beside == Beside::Building);
                report.extend(at_once(steps, cores() + more, |step| beside::run(step))?);
            }
        }
    }
    // Once more: what follows a failure may be long.
    for Done { step, log, .. } in report.iter().filter(|done| !done.passed) {
        if let Some(log) = log {
            println!("\n=== {} FAILED, and wrote at its end:\n{}", step.name, beside::end_of(log));
        }
    }
    println!();
    for Done { step, passed, took, .. } in &report {
        println!("{:>10}  {}  {}", spoken(*took), if *passed { "passed" } else { "FAILED" }, step.name);
    }
    let failed = report.iter().filter(|done| !done.passed).count();
    let passed = report.len() - failed;
    println!("ci: {passed} steps passed, {failed} failed, {}", spoken(began.elapsed()));
    if failed > 0 { bail!("{failed} of {} steps failed", report.len()) } else { Ok(()) }
}

fn done(step: &'static Step) -> Done {
    println!("\n=== {}", step.name);
    let began = Instant::now();
    let result = (step.run)();
    if let Err(error) = &result {
        println!("FAILED: {error:#}");
    }
    let took = began.elapsed();
    println!("=== {}: {}", step.name, spoken(took));
    Done { step, passed: result.is_ok(), took, log: None }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What `work` says of each item, in their order: `count` at once, the first first.
fn at_once<I: Sync, T: Send>(items: &[I], count: usize, work: impl Fn(&I) -> T + Sync) -> Result<Vec<T>> {
    let threads = rayon::ThreadPoolBuilder::new().num_threads(count).build()?;
    // The bridge hands items out one by one; a slice would be parted in halves, which begin together.
    let all = || items.iter().enumerate().par_bridge().map(|(at, item)| (at, work(item))).collect();
    let mut done: Vec<_> = threads.install(all);
    done.sort_by_key(|(at, _)| *at);
    Ok(done.into_iter().map(|(_, done)| done).collect())
}

fn spoken(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    if seconds < 60.0 {
        format!("{seconds:.1} s")
    } else {
        format!("{} m {:02.0} s", (seconds / 60.0).floor(), (seconds % 60.0).floor())
    }
}

fn cargo(words: &str) -> Result<()> {
    machine::run(machine::cargo().args(words.split(' ')))
}

fn packages() -> Result<()> {
    let needed: &[&Package] = if cfg!(target_os = "linux") {
        &[
            &CC,
            &CXX,
            &ARM_CXX,
            &ARM_LIBRARY,
            &PKG_CONFIG,
            &ALSA,
            &JACK,
            &JACKD,
            &XCB,
            &VENV,
            &GL,
            &GLIB,
            &XVFB,
            &VALGRIND,
            &MESA,
            &EGL,
            &XKB,
            &X11_XCB,
        ]
    } else {
        &[]
    };
    machine::provide(needed)
}

fn documentation() -> Result<()> {
    machine::run(
        machine::cargo()
            .args(["doc", "--workspace", "--no-deps", "--all-features"])
            .env("RUSTDOCFLAGS", "-D warnings"),
    )
}

/// Every chore that can compare what it would write with what is there.
fn generated() -> Result<()> {
    // Chores that need the clarinet are in the build that is there: nothing is built again.
    programs()?;
    for command in COMMANDS.iter().filter(|command| command.checks) {
        println!("{} --check", command.name);
        command.run(&["--check".to_owned()]).with_context(|| command.name)?;
    }
    Ok(())
}

/// Tests of the plugin and the programs in hosts, with a cache of their own for the instruments they make.
fn host_tests(names: &[&str]) -> Command {
    let mut command = machine::cargo();
    command.args(TESTS).arg("--no-fail-fast");
    command.args(names.iter().flat_map(|name| ["--test", name]));
    command.env(artefacts::CACHE, machine::target().join("cache"));
    command
}

/// Test files that play the CLAP on a debug build, in two parts that take about as long.
const CLAP_RULES: &[&str] = &["clap", "clap_rules", "clap_sleep"];
const CLAP_PLAYING: &[&str] = &["note_ids", "keyboard", "instrument", "microphone", "knob", "mts_esp"];

/// The bundled CLAP: what it sounds like and takes, and what only a release build can tell, as its time to be scanned.
fn clap() -> Result<()> {
    let program = &programs()?.program;
    machine::run(host_tests(&["clap", "clap_checks"]).env(artefacts::PROGRAM, program))
}

/// How soon torque ends, of the bundled CLAP.
fn torque_ends() -> Result<()> {
    machine::run(host_tests(&["knob_stop"]).env(artefacts::PROGRAM, &programs()?.program))
}

/// All other rules on a debug build, where the framework aborts on any allocation while processing.
fn clap_checked(names: &[&str]) -> Result<()> {
    let programs = programs()?;
    let mut tests = host_tests(names);
    tests.env(artefacts::CLAP, &programs.plugin).env(artefacts::PROGRAM, &programs.program);
    machine::run(&mut tests)
}

/// The program of its own, without sound; the JACK step plays it to a server.
fn standalone() -> Result<()> {
    machine::run(host_tests(&["standalone"]).env(artefacts::STANDALONE, &programs()?.standalone))
}

/// Where no display is: JUCE would take :0 if none were named, and ends on one without a window manager.
const NO_DISPLAY: &str = ":9999";

fn dawdreamer() -> Result<()> {
    let python = dawdreamer_python()?;
    let script = machine::root().join("crates/test-host/tests/vst3_in_dawdreamer.py");
    machine::run(Command::new(&python).arg(script).arg(artefacts::vst3()?).env("DISPLAY", NO_DISPLAY))
}

fn pedalboard() -> Result<()> {
    let python = pedalboard_python()?;
    let script = machine::root().join("crates/test-host/tests/vst3_in_pedalboard.py");
    machine::run(Command::new(&python).arg(script).arg(artefacts::vst3()?).env("DISPLAY", NO_DISPLAY))
}

fn python_examples() -> Result<()> {
    let python = examples_python()?;
    let tests = machine::root().join("examples/tests/python_examples.py");
    // The study kit draws what the command line measures.
    machine::run(Command::new(&python).arg(tests).env(artefacts::PROGRAM, &programs()?.program))
}

/// Fetches what all steps with Python need, while others build.
fn environments() -> Result<()> {
    for made in [package_python, examples_python, dawdreamer_python, pedalboard_python] {
        made()?;
    }
    Ok(())
}

fn dawdreamer_python() -> Result<PathBuf> {
    python("venv", "dawdreamer, numpy", DAWDREAMER_PACKAGES)
}

fn pedalboard_python() -> Result<PathBuf> {
    python("venv-pedalboard", "pedalboard, mido, numpy", PEDALBOARD_PACKAGES)
}

fn examples_python() -> Result<PathBuf> {
    python("venv-examples", "numpy, matplotlib, libmapper, pythonosc", EXAMPLE_PACKAGES)
}

/// The Python with which the wheel is built and tested.
fn package_python() -> Result<PathBuf> {
    let modules =
        "maturin, pytest, mypy, numpy, pyarrow, distributed, nbformat, nbclient, ipykernel, matplotlib";
    python("venv-package", modules, PACKAGE_PACKAGES)
}

/// Builds the wheel from the sources. Users get that of the profile for releases, which takes longer to build.
fn python_wheel() -> Result<()> {
    let wheels = machine::target().join("wheels");
    // Another version's wheel would be installed beside the new one.
    let _ = fs::remove_dir_all(&wheels);
    let build = ["-m", "maturin", "build", "--profile", "dev", "--out"];
    let folder = machine::root().join("python");
    machine::run(Command::new(package_python()?).args(build).arg(&wheels).current_dir(folder))
}

/// The wheel of the step before, installed where nothing else is, and tested.
fn python_package() -> Result<()> {
    let python = package_python()?;
    let folder = machine::root().join("python");
    let wheels = machine::target().join("wheels");
    let mut built = fs::read_dir(&wheels).context("no wheel is built")?;
    let wheel = built.next().context("maturin left no wheel")??.path();
    let clean = machine::target().join("venv-clean");
    let system = if cfg!(windows) { "python" } else { "python3" };
    machine::run(Command::new(system).args(["-m", "venv", "--clear"]).arg(&clean))?;
    let alone = clean.join(if cfg!(windows) { "Scripts" } else { "bin" }).join("python");
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    machine::run(Command::new(&alone).args(install).arg(&wheel))?;
    let first = "import chalumeau; assert chalumeau.render(written='C4', seconds=0.1).shape == (4800,)";
    machine::run(Command::new(&alone).args(["-c", first]))?;
    machine::run(Command::new(&python).args(install).args(["--force-reinstall", "--no-deps"]).arg(&wheel))?;
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"]).current_dir(&folder);
    machine::run(tests.env(artefacts::PROGRAM, &programs()?.program))
}

/// The Python of a virtual environment in the target folder, which is made if it was not made with these packages or cannot import
/// `modules`.
fn python(folder: &str, modules: &str, packages: &[&str]) -> Result<PathBuf> {
    let venv = machine::target().join(folder);
    let bin = venv.join(if cfg!(windows) { "Scripts" } else { "bin" });
    let python = bin.join("python");
    let (pins, stamp) = (packages.join("\n"), venv.join("pins.txt"));
    if fs::read_to_string(&stamp).is_ok_and(|made_with| made_with == pins) && imports(&python, modules) {
        return Ok(python);
    }
    let system = if cfg!(windows) { "python" } else { "python3" };
    machine::run(Command::new(system).args(["-m", "venv"]).arg(&venv))?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    machine::run(Command::new(&python).args(pip).args(packages))?;
    fs::write(&stamp, pins).with_context(|| format!("cannot write {}", stamp.display()))?;
    Ok(python)
}

fn imports(python: &Path, modules: &str) -> bool {
    machine::works(&python.to_string_lossy(), &["-c", &format!("import {modules}")])
}
