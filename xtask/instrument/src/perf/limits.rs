//! What must stay below a limit: the dearest note, the worst block, memory, and what the plugin takes in a host.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_figure::palette::Colour;
use chalumeau_figure::report::{Plate, TableCell};
use chalumeau_figure::{Axis, Direction, Figure, Mark, Panel, Points};
use chalumeau_test_host::clap::{At, Plugin, Say};

use super::playing::{counted, ours, output, printed, program};

/// Length of each note of the instrument, s. Its beginning counts too; what comes before it is counted once for all.
const NOTE_S: f64 = 0.2;
/// How often the plugin is loaded; the least time counts.
const TIMES: usize = 5;
/// Wanted: dearest note over the median; share of the deadline; memory of a voice, MiB; time to load the plugin, ms.
const WANTED_NOTE: f64 = 1.3;
const WANTED_SHARE: f64 = 0.25;
const WANTED_VOICE_MIB: f64 = 1.0;
const WANTED_LOAD_MS: f64 = 100.0;
const MIB: f64 = 1_048_576.0;

/// A row of the last table: what, how much, what is wanted.
fn row(what: &str, is: String, wanted: &str) -> Vec<TableCell> {
    println!("{what}: {is} (wanted: {wanted})");
    vec![TableCell::Word(what.to_owned()), TableCell::Number(is), TableCell::Word(wanted.to_owned())]
}

/// Cost of each note over the median, and the dearest of them.
pub(super) fn notes() -> Result<(Plate, Vec<TableCell>)> {
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
    .with(Mark::new(Direction::Y, WANTED_NOTE, "limit"));
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
pub(super) fn blocks(count: usize) -> Result<Vec<Vec<TableCell>>> {
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
pub(super) fn plugin(path: &Path) -> Result<Vec<Vec<TableCell>>> {
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

/// Memory of a player.
pub(super) fn memory() -> Result<Vec<TableCell>> {
    let voice = printed(&output(Command::new(program()).arg("memory"))?, "voice_bytes")? / MIB;
    Ok(row("memory of a player, MiB", format!("{voice:.3}"), &format!("at most {WANTED_VOICE_MIB}")))
}
