//! `cargo xtask perf`: how the cost of playing grows, as a page in `target/perf`. Too long for `ci`.
//!
//! All costs are ratios to one voice at 48 kHz in the same run: instructions, counted by callgrind as the difference of two run lengths,
//! and thread time. Peers are measured in the same way where they are installed. `crates/core/examples/growth.rs` plays.

use std::fmt::Write;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::parallel;
use chalumeau_figure::palette::Colour;
use chalumeau_figure::report::{Plate, Report, ReportTable, TableCell, write};
use chalumeau_figure::{Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, draw};
use chalumeau_test_host::artefacts;
use chalumeau_test_host::clap::{At, Plugin, Say};

use crate::machine;

/// Lengths whose difference is counted, s: the note is steady by the first.
const COUNTED_S: (f64, f64) = (0.3, 0.6);
/// Length of each note of the instrument, s. Its beginning counts too; what comes before it is counted once for all.
const NOTE_S: f64 = 0.3;
/// Length that is timed, s, and how often; the least time counts, since all that interrupts only adds.
const TIMED_S: f64 = 1.0;
const TIMES: usize = 5;
/// Blocks of random playing by default, and with `--full`.
const BLOCKS: (usize, usize) = (20_000, 1_000_000);
/// Wanted: dearest note over the median; share of the deadline; memory of a voice, MiB; time to load the plugin, ms.
const WANTED_NOTE: f64 = 1.3;
const WANTED_SHARE: f64 = 0.25;
const WANTED_VOICE_MIB: f64 = 1.0;
const WANTED_LOAD_MS: f64 = 100.0;
const MIB: f64 = 1_048_576.0;
const COST_AXIS: &str = "cost, one voice = 1";

/// What a sample of the host costs.
#[derive(Clone, Copy)]
struct Cost {
    instructions: f64,
    ns: f64,
}

/// One thing that grows.
struct Series {
    title: &'static str,
    axis: &'static str,
    /// What to see, under the figure.
    about: &'static str,
    /// Word of the playing program.
    word: &'static str,
    /// What is measured: by default, and besides with `--full`.
    values: (&'static [f64], &'static [f64]),
    /// A step of the axis in units of the playing program.
    unit: f64,
    kind: Kind,
}

#[derive(PartialEq)]
enum Kind {
    Growth,
    /// With a line for as many players who play alone.
    Players,
    /// Costs are for a second, not for a sample, and no line joins the points: nothing is measured between them.
    Rates,
}

const SERIES: [Series; 5] = [
    Series {
        title: "Players in unison",
        axis: "number of players",
        about: "Dashed: as many players, each computed alone. Where the processor has AVX2, five to eight players are computed at once, so that the sixth to eighth cost little.",
        word: "voices",
        values: (&[1.0, 2.0, 4.0, 5.0, 8.0, 9.0, 12.0, 13.0, 16.0], &[3.0, 6.0, 7.0, 10.0, 14.0]),
        unit: 1.0,
        kind: Kind::Players,
    },
    Series {
        title: "Tone holes",
        axis: "number of tone holes",
        about: "Eight holes are computed at once: the cost steps up behind each multiple of eight. The instrument is rebuilt with fewer or more holes, and not tuned.",
        word: "holes",
        values: (&[2.0, 8.0, 9.0, 16.0, 17.0, 24.0, 25.0, 26.0], &[4.0, 6.0, 10.0, 12.0, 14.0, 20.0]),
        unit: 1.0,
        kind: Kind::Growth,
    },
    Series {
        title: "Length of the bore",
        axis: "length of the bore over that of a B flat clarinet",
        about: "A longer bore has longer delays, and these cost the same at any length. The whole instrument is scaled, and not tuned.",
        word: "length",
        values: (&[0.6, 1.0, 1.5, 3.0], &[0.8, 1.2, 2.0]),
        unit: 1.0,
        kind: Kind::Growth,
    },
    Series {
        title: "The host's sample rate",
        axis: "sample rate of the host, kHz",
        about: "The cost of a second of sound. The instrument always computes at 88.2 or 96 kHz; only the filter to the host's rate grows.",
        word: "rate",
        values: (&[44.1, 48.0, 88.2, 96.0, 176.4, 192.0], &[]),
        unit: 1_000.0,
        kind: Kind::Rates,
    },
    Series {
        title: "Pitch bend",
        axis: "bend, cents",
        about: "The lip makes small bends (up to 40 cents, on some notes less), at no cost. Beyond these the bore changes its size: its clock runs faster or slower, so there is more or less to compute in a second, and the filter to the host's rate finds its weights anew for each sample.",
        word: "bend",
        values: (
            &[-1_200.0, -700.0, -200.0, -50.0, -30.0, 0.0, 30.0, 50.0, 200.0, 700.0, 1_200.0],
            &[-400.0, -20.0, 20.0, 400.0],
        ),
        unit: 1.0,
        kind: Kind::Growth,
    },
];

/// The number behind a word that a program printed.
fn printed(text: &str, word: &str) -> Result<f64> {
    let mut words = text.split_whitespace();
    words.find(|found| *found == word).with_context(|| format!("no {word} in {text:?}"))?;
    Ok(words.next().context("no number")?.parse()?)
}

fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| machine::described(command))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{}: {said}", machine::described(command));
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A program that plays for so many seconds: itself, and its other arguments.
struct Player {
    program: PathBuf,
    /// In place of `SECONDS` stands the length.
    arguments: Vec<String>,
    rate_hz: f64,
}

impl Player {
    fn command(&self, seconds: f64, tool: Option<&str>) -> Command {
        let mut command = Command::new(tool.map_or(self.program.as_path(), Path::new));
        if tool.is_some() {
            command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(&self.program);
        }
        command.args(self.arguments.iter().map(|word| word.replace("SECONDS", &seconds.to_string())));
        command
    }

    /// Instructions of the whole run.
    fn collected(&self, seconds: f64) -> Result<f64> {
        let mut command = self.command(seconds, Some("valgrind"));
        let output = command.output().context("valgrind: apt-get install valgrind")?;
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().find(|line| line.contains("Collected :"));
        let line = line.with_context(|| format!("{}: {said}", machine::described(&command)))?;
        Ok(line.rsplit(' ').next().unwrap_or_default().parse()?)
    }

    /// Instructions of a sample.
    fn instructions(&self, (short_s, long_s): (f64, f64)) -> Result<f64> {
        Ok((self.collected(long_s)? - self.collected(short_s)?) / ((long_s - short_s) * self.rate_hz))
    }

    /// Thread time of a sample, as the program says, ns.
    fn ns(&self, word: &str) -> Result<f64> {
        let runs = (0..TIMES).map(|_| printed(&output(&mut self.command(TIMED_S, None))?, word));
        Ok(runs.collect::<Result<Vec<_>>>()?.into_iter().fold(f64::INFINITY, f64::min))
    }
}

/// The core's playing program with these words.
fn ours(words: &[String]) -> Player {
    let rate = words.iter().find_map(|word| word.strip_prefix("rate=")?.parse().ok());
    let mut arguments = vec!["cost".to_owned(), "SECONDS".to_owned()];
    arguments.extend_from_slice(words);
    Player { program: program(), arguments, rate_hz: rate.unwrap_or(48_000.0) }
}

fn program() -> PathBuf {
    machine::target().join("plugin/examples").join(format!("growth{}", std::env::consts::EXE_SUFFIX))
}

fn measure(words: &[String]) -> Result<Cost> {
    let player = ours(words);
    Ok(Cost { instructions: player.instructions(COUNTED_S)?, ns: player.ns("ns")? })
}

/// Counts on all cores: counts, unlike times, do not suffer.
fn counted<T: Send>(count: usize, work: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
    let found = parallel::each(count, work, &mut |_| ControlFlow::Continue(()));
    found.context("nothing stops this")?.into_iter().collect()
}

/// Line and points of one colour.
fn curve(name: &str, points: &[(f64, f64)], colour: Colour) -> (Line, Points) {
    let points = points.iter().copied();
    (Line::new(name, points.clone()).colour(colour), Points::new("", points).colour(colour))
}

/// Costs over the first of all: one voice.
fn series(of: &Series, one: Cost, full: bool) -> Result<(Plate, ReportTable)> {
    let mut values = of.values.0.to_vec();
    values.extend(of.values.1.iter().filter(|_| full));
    values.sort_by(f64::total_cmp);
    let words = |value: f64| [format!("{}={}", of.word, of.unit * value)];
    let instructions = counted(values.len(), |at| ours(&words(values[at])).instructions(COUNTED_S))?;
    let (mut by_instructions, mut by_time) = (Vec::new(), Vec::new());
    for (&value, instructions) in values.iter().zip(instructions) {
        let per = if of.kind == Kind::Rates { value / 48.0 } else { 1.0 };
        by_instructions.push((value, per * instructions / one.instructions));
        by_time.push((value, per * ours(&words(value)).ns("ns")? / one.ns));
    }
    let pairs = by_instructions.iter().zip(&by_time);
    for ((value, instructions), (_, time)) in pairs.clone() {
        println!("{}, {} {value}: {instructions:.3} by instructions, {time:.3} by time", of.title, of.axis);
    }
    let mut most = pairs.clone().map(|(a, b)| a.1.max(b.1)).fold(1.0, f64::max);
    let mut alone = None;
    if of.kind == Kind::Players {
        most = values.iter().copied().fold(most, f64::max);
        let line = Line::new("each alone", values.iter().map(|&count| (count, count)));
        alone = Some(line.colour(Colour::Grey).dash(Dash::Dashed));
    }
    let mut panel = Panel::new("", Axis::linear(of.axis), Axis::linear(COST_AXIS).range(0.0, 1.1 * most));
    if let Some(line) = alone {
        panel = panel.with(line);
    }
    for (name, points, colour) in
        [("instructions", &by_instructions, Colour::Blue), ("thread time", &by_time, Colour::Orange)]
    {
        let (line, points) = curve(name, points, colour);
        panel = if of.kind == Kind::Rates {
            panel.with(Points { name: name.to_owned(), ..points })
        } else {
            panel.with(line).with(points)
        };
    }
    let figure = Figure::new(of.title).panel(panel).size(1_200, 600);
    let rows = pairs.map(|((value, instructions), (_, time))| {
        [value.to_string(), format!("{instructions:.2}"), format!("{time:.2}")].map(TableCell::Number).into()
    });
    let table = ReportTable {
        title: of.title.to_owned(),
        about: "1 is the cost of one voice of a B flat clarinet at 48 kHz.".to_owned(),
        head: [of.axis, "by instructions", "by thread time"].map(str::to_owned).into(),
        rows: rows.collect(),
    };
    let alternative = format!("{}: cost over {}. A table below has the numbers.", of.title, of.axis);
    Ok((Plate { figure, caption: of.about.to_owned(), alternative }, table))
}

/// A row of the last table: what, how much, what is wanted.
fn row(what: &str, is: String, wanted: &str) -> Vec<TableCell> {
    println!("{what}: {is} (wanted: {wanted})");
    vec![TableCell::Word(what.to_owned()), TableCell::Number(is), TableCell::Word(wanted.to_owned())]
}

/// Cost of each note over the median, and the dearest of them.
fn notes() -> Result<(Plate, Vec<TableCell>)> {
    let fingerings = InstrumentFile::built_in().fingerings;
    let note = |at: usize| ours(&[format!("written={}", fingerings[at].written.0)]);
    let before = note(0).collected(0.0)?;
    let costs = counted(fingerings.len(), |at| Ok(note(at).collected(NOTE_S)? - before))?;
    let mut sorted = costs.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let ratios = costs.iter().map(|cost| cost / median);
    let (worst, dearest) =
        ratios.clone().zip(&fingerings).max_by(|a, b| a.0.total_cmp(&b.0)).context("no notes")?;
    let points = fingerings.iter().map(|fingering| f64::from(fingering.written.0)).zip(ratios);
    let panel = Panel::new(
        "",
        Axis::notes("written note"),
        Axis::linear("instructions, median note = 1").range(0.0, 1.4),
    )
    .with(Points::new("", points).colour(Colour::Blue))
    .with(Mark::new(Direction::Y, WANTED_NOTE, "wanted: below"));
    let plate = Plate {
        figure: Figure::new("Each note of a B flat clarinet").panel(panel).size(1_200, 600),
        caption: format!(
            "The first {NOTE_S} s of each note at mezzo-forte. The dearest is written {}.",
            dearest.written
        ),
        alternative: format!("Cost of each note over the median: at most {worst:.3}."),
    };
    let what = format!("dearest note (written {}) over the median, by instructions", dearest.written);
    Ok((plate, row(&what, format!("{worst:.3}"), &format!("at most {WANTED_NOTE}"))))
}

/// The worst of many blocks of random playing.
fn blocks(count: usize) -> Result<Vec<Vec<TableCell>>> {
    let said = output(Command::new(program()).args(["blocks", &count.to_string()]))?;
    let of = |word| printed(&said, word);
    let deadline = of("deadline_us")?;
    let what =
        |which: &str| format!("{which} of {count} blocks of 64 frames, eight players: share of the deadline");
    let share = |us: f64| format!("{:.3}", us / deadline);
    Ok(vec![
        row(&what("median"), share(of("median_us")?), "-"),
        row(&what("the slowest thousandth"), share(of("of_1000_us")?), "-"),
        row(&what("worst"), share(of("worst_us")?), &format!("at most {WANTED_SHARE}, on a quiet machine")),
    ])
}

/// Memory of this process in use, MiB, and its threads.
fn own() -> Result<(f64, usize)> {
    let text = fs::read_to_string("/proc/self/status").context("Linux tells it in /proc/self/status")?;
    let kb = printed(&text, "VmRSS:")?;
    Ok((kb / 1_024.0, printed(&text, "Threads:")? as usize))
}

/// The plugin in a host: load time, memory, threads with one player and with sixteen.
fn plugin(path: &Path) -> Result<Vec<Vec<TableCell>>> {
    let (mut load_ms, mut threads) = (f64::INFINITY, [0; 2]);
    // The library itself, and what all instances share.
    let keeps_library = Plugin::load(path)?;
    let before = own()?;
    for (count, threads) in [1.0, 16.0].into_iter().zip(&mut threads) {
        for _ in 0..TIMES {
            let begin = Instant::now();
            let mut plugin = Plugin::load(path)?;
            let mut session = plugin.activate(48_000.0, 64)?;
            load_ms = load_ms.min(1e3 * begin.elapsed().as_secs_f64());
            let players = plugin.param("Players")?.id;
            let notes = (0..count as u8).map(|number| At(64, Say::Midi([0x90, 50 + 2 * number, 100])));
            let said: Vec<At> = [At(0, Say::Set(players, count))].into_iter().chain(notes).collect();
            session.play(&said, 9_600)?;
            *threads = own()?.1 - before.1;
            plugin.deactivate(session);
        }
    }
    let mut plugin = Plugin::load(path)?;
    let begin = own()?.0;
    let session = plugin.activate(48_000.0, 64)?;
    let mib = own()?.0 - begin;
    plugin.deactivate(session);
    drop(keeps_library);
    Ok(vec![
        row("plugin: load and activate, ms", format!("{load_ms:.1}"), &format!("at most {WANTED_LOAD_MS}")),
        row("plugin: memory that activation takes, MiB", format!("{mib:.1}"), "-"),
        row("plugin: threads with 1 player", threads[0].to_string(), "-"),
        row("plugin: threads with 16 players", threads[1].to_string(), "no more"),
    ])
}

/// Programs of others that play a note.
struct Peers {
    found: Vec<(String, Player)>,
    /// What is not installed.
    missing: Vec<String>,
}

fn peers(folder: &Path) -> Result<Peers> {
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let stk = folder.join("stk");
    let build = Command::new("c++")
        .args(["-std=c++17", "-O3", "benches/peers/stk.cpp", "-lstk", "-o"])
        .arg(&stk)
        .output();
    if build.is_ok_and(|build| build.status.success()) {
        for (name, title) in [("blowhole", "STK BlowHole"), ("clarinet", "STK Clarinet")] {
            let arguments = [name, "SECONDS", "48000"].map(str::to_owned).into();
            found.push((title.to_owned(), Player { program: stk.clone(), arguments, rate_hz: 48_000.0 }));
        }
    } else {
        missing.push("STK's BlowHole and Clarinet (Debian package libstk-dev)".to_owned());
    }
    if machine::works("csound", &["--version"]) {
        let score = folder.join("wgclar.csd");
        fs::write(&score, CSOUND)?;
        let mut arguments = ["-n", "-d", "-m0", "--smacro:LENGTH=SECONDS"].map(str::to_owned).to_vec();
        arguments.push(score.to_string_lossy().into_owned());
        let player = Player { program: "csound".into(), arguments, rate_hz: 48_000.0 };
        found.push(("Csound wgclar".to_owned(), player));
    } else {
        missing.push("Csound's wgclar (Debian package csound)".to_owned());
    }
    Ok(Peers { found, missing })
}

/// Sounding B flat 3, as the other peers play it; blocks of 64.
const CSOUND: &str = "\
<CsoundSynthesizer>
<CsInstruments>
sr = 48000
ksmps = 64
nchnls = 1
0dbfs = 1
instr 1
  asig wgclar 0.8, 233.08, -0.3, 0.02, 0.05, 0.1, 0, 0.1, -1, 100
  out asig
endin
</CsInstruments>
<CsScore>
i1 0 $LENGTH
</CsScore>
</CsoundSynthesizer>
";

fn peer_rows(folder: &Path, one: Cost) -> Result<(Vec<Vec<TableCell>>, Vec<String>)> {
    let Peers { found, missing } = peers(folder)?;
    let mut rows = Vec::new();
    for (name, player) in found {
        let ratio = player.instructions(COUNTED_S)? / one.instructions;
        println!("{name}: {ratio:.3} of the instructions of one voice here");
        rows.push(vec![TableCell::Word(name), TableCell::Number(format!("{ratio:.3}"))]);
    }
    Ok((rows, missing))
}

/// `cargo xtask perf [--full]`.
pub fn run(args: &[String]) -> Result<()> {
    let full = match args {
        [] => false,
        [word] if word == "--full" => true,
        _ => bail!("takes --full (more points, and a million blocks instead of {}), got {args:?}", BLOCKS.0),
    };
    machine::provide(&[&machine::VALGRIND])?;
    machine::run(machine::cargo().args([
        "build",
        "--profile=plugin",
        "--package=chalumeau-core",
        "--features=fit,threads",
        "--example=growth",
    ]))?;
    let folder = machine::target().join("perf");
    fs::create_dir_all(&folder)?;
    let one = measure(&[])?;
    println!("one voice: {:.0} instructions and {:.1} ns for a sample at 48 kHz", one.instructions, one.ns);
    let mut about = vec![format!(
        "One voice of a B flat clarinet takes {:.0} instructions and {:.1} ns for a sample at 48 kHz: one core computes it {:.0} times as fast as it sounds. All other costs are ratios to it, measured in the same run. Counts of instructions repeat on a busy machine; times do not.",
        one.instructions,
        one.ns,
        1e9 / 48_000.0 / one.ns
    )];
    let (note_plate, note_row) = notes()?;
    let mut limits = vec![note_row];
    limits.extend(blocks(if full { BLOCKS.1 } else { BLOCKS.0 })?);
    let voice = printed(&output(Command::new(program()).arg("memory"))?, "voice_bytes")? / MIB;
    limits.push(row(
        "memory of a player, MiB",
        format!("{voice:.3}"),
        &format!("at most {WANTED_VOICE_MIB}"),
    ));
    let mut missing = String::new();
    match artefacts::clap().and_then(|path| plugin(&path)) {
        Ok(rows) => limits.extend(rows),
        Err(error) => write!(missing, "The plugin is not measured: {error:#}. ")?,
    }
    let (peer_rows, absent) = peer_rows(&folder, one)?;
    for peer in absent {
        write!(missing, "Not installed, so not measured: {peer}. ")?;
    }
    if !missing.is_empty() {
        println!("{missing}");
        about.push(missing);
    }
    let mut tables = vec![ReportTable {
        title: "Limits".to_owned(),
        about: "Blocks: random notes and automation, played three times; the least time of each block counts, since other programs only add.".to_owned(),
        head: ["what", "measured", "wanted"].map(str::to_owned).into(),
        rows: limits,
    }];
    if !peer_rows.is_empty() {
        tables.push(ReportTable {
            title: "Other clarinets".to_owned(),
            about: "A held B flat 3 at 48 kHz. These models have a bore without tone holes, BlowHole one with two."
                .to_owned(),
            head: ["what", "instructions over one voice here"].map(str::to_owned).into(),
            rows: peer_rows,
        });
    }
    let mut plates = Vec::new();
    for of in &SERIES {
        let (plate, table) = series(of, one, full)?;
        plates.push(plate);
        tables.push(table);
    }
    plates.push(note_plate);
    for (plate, name) in plates.iter().zip(SERIES.iter().map(|of| of.word).chain(["notes"])) {
        fs::write(folder.join(format!("{name}.png")), draw::png(&plate.figure, None)?)?;
    }
    let report = Report {
        title: "How the cost of playing grows".to_owned(),
        about,
        sound: None,
        plates,
        chapters: Vec::new(),
        tables,
        made_by: if full { "cargo xtask perf --full" } else { "cargo xtask perf" }.to_owned(),
    };
    let page = folder.join("index.html");
    write(&report, &mut File::create(&page)?)?;
    println!("{}", page.display());
    Ok(())
}
