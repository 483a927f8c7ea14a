//! The knob's firmware away from the knob: its claims on this machine, plainly and under sanitizers; the core compiled and
//! linked for a microcontroller without operating system; and what a turn of its loop costs.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use crate::machine;

const STRICT: &[&str] =
    &["-std=c++17", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-fno-exceptions", "-fno-rtti"];
/// A microcontroller core with single-precision floats, as the ESP32's: what it must not need shows here.
const CORTEX_M4F: &[&str] = &["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];
const FREESTANDING: &[&str] =
    &["-Os", "-ffreestanding", "-fno-threadsafe-statics", "-ffunction-sections", "-fdata-sections"];
/// What a freestanding program may ask of its compiler: moving bytes and dividing 64-bit integers. No heap, no
/// exceptions, no double.
const GIVEN: &[&str] = &["__aeabi_ldivmod", "__aeabi_uldivmod", "memcmp", "memcpy", "memmove", "memset"];

/// Two percent of 240 MHz at 2 kHz, at one instruction a cycle.
const MOST_PER_TICK: u64 = 2400;
/// To and fro over the whole law, so that the two runs differ by whole passes.
const TICKS: u64 = 7200;

/// `cargo xtask firmware`: all of it; with `--long` a hundred times the anarchy under the sanitizers, which takes minutes.
pub fn run(args: &[String]) -> Result<()> {
    match args {
        [] => all(),
        [flag] if flag == "--long" => everything(LONG_ANARCHY),
        _ => bail!("takes nothing or --long, got {args:?}"),
    }
}

/// Ticks of anarchy under the sanitizers, in `ci` and by command.
const SHORT_ANARCHY: u32 = 10_000_000;
const LONG_ANARCHY: u32 = 1_000_000_000;

/// The step of `ci`.
pub fn all() -> Result<()> {
    everything(SHORT_ANARCHY)
}

fn everything(anarchy: u32) -> Result<()> {
    let folder = machine::target().join("firmware");
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let built = |name: &str| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));

    let tests = built("tests");
    compile_tests(&tests, &["-O2"])?;
    machine::run(&mut Command::new(&tests))?;

    let sanitized = built("tests-sanitized");
    compile_tests(
        &sanitized,
        &[
            "-O1",
            "-g",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
            "-fno-omit-frame-pointer",
        ],
    )?;
    let anarchy = anarchy.to_string();
    machine::run(Command::new(&sanitized).args([
        "--fuzz",
        "3000000",
        "--trials",
        "10000",
        "--anarchy",
        &anarchy,
    ]))?;

    // The example against stand-ins of the Arduino names it uses: its types fit the core's.
    machine::run(Command::new("g++").args(STRICT).args([
        "-fsyntax-only",
        "-Ifirmware/include",
        "-Ifirmware/examples/stand_in",
        "firmware/examples/torquetuner_esp32/src/main.cpp",
    ]))?;

    arm(&folder.join("arm.o"), &folder.join("arm.elf"))?;
    cost(&built("tick"))
}

fn compile_tests(program: &PathBuf, options: &[&str]) -> Result<()> {
    let mut sources: Vec<_> = fs::read_dir("firmware/test")
        .context("cannot list firmware/test")?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_>>()?;
    sources.retain(|path| path.extension().is_some_and(|extension| extension == "cpp"));
    sources.sort();
    machine::run(Command::new("g++").args(STRICT).args(options).args(sources).arg("-o").arg(program))
}

fn arm(object: &PathBuf, linked: &PathBuf) -> Result<()> {
    let compiler = || {
        let mut command = Command::new("arm-none-eabi-g++");
        command.args(CORTEX_M4F);
        command
    };
    machine::run(
        compiler().args(STRICT).args(FREESTANDING).args(["-c", "firmware/cost/arm.cpp", "-o"]).arg(object),
    )?;
    let undefined =
        said(Command::new("arm-none-eabi-nm").args(["--undefined-only", "--just-symbols"]).arg(object))?;
    let asked: Vec<_> = undefined.split_whitespace().filter(|symbol| !GIVEN.contains(symbol)).collect();
    ensure!(asked.is_empty(), "the firmware core must stand alone but asks for {}", asked.join(", "));
    // Linking proves that what is given asks for nothing more, such as a heap.
    machine::run(
        compiler()
            .args(["-nostdlib", "-Wl,--gc-sections", "-Wl,-e,start"])
            .arg(object)
            .args(["-lc", "-lgcc", "-o"])
            .arg(linked),
    )?;
    print!("{}", said(Command::new("arm-none-eabi-size").arg(linked))?);
    Ok(())
}

/// Instructions of a tick, as the difference of two runs under callgrind.
fn cost(program: &PathBuf) -> Result<()> {
    machine::run(
        Command::new("g++").args(STRICT).args(["-O2", "firmware/cost/tick.cpp", "-o"]).arg(program),
    )?;
    machine::provide(&[&machine::VALGRIND])?;
    for mood in ["average", "busy"] {
        let collected = |ticks: u64| -> Result<u64> {
            let output = Command::new("valgrind")
                .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
                .arg(program)
                .args([mood, &ticks.to_string()])
                .stdin(Stdio::null())
                .output()
                .context("cannot start valgrind")?;
            let text = String::from_utf8_lossy(&output.stderr);
            ensure!(output.status.success(), "valgrind: {text}");
            let count = text.split("Collected : ").nth(1).and_then(|rest| rest.split_whitespace().next());
            count
                .with_context(|| format!("valgrind counted nothing: {text}"))?
                .parse()
                .context("valgrind's count")
        };
        let per_tick = (collected(2 * TICKS)? - collected(TICKS)?) / TICKS;
        let share = per_tick as f64 / MOST_PER_TICK as f64 * 2.0;
        println!("{mood}: {per_tick} instructions a tick; at one a cycle {share:.2} % of 240 MHz");
        if mood == "average" && per_tick > MOST_PER_TICK {
            bail!("a tick costs {per_tick} instructions, more than {MOST_PER_TICK}");
        }
    }
    Ok(())
}

fn said(command: &mut Command) -> Result<String> {
    let name = machine::described(command);
    let output = command.stdin(Stdio::null()).output().with_context(|| format!("cannot start `{name}`"))?;
    ensure!(output.status.success(), "`{name}` failed: {}", String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
