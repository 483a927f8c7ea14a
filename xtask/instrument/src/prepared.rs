//! The bundled instruments' generated data: scaled geometry, fitted cells, trims. Made by playing, checked by playing.

use std::io::IsTerminal;
use std::ops::ControlFlow;

use anyhow::{Context, Result, bail, ensure};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::cells::Cells;
use chalumeau_core::instrument::internal_rate::INTERNAL_RATES_HZ;
use chalumeau_core::instrument::player::dynamics::NODES;
use chalumeau_core::instrument::prepare::auto_tune::{self, Accuracy};
use chalumeau_core::instrument::prepare::play_dynamics;
use chalumeau_core::instrument::prepare::{self, Preparation, PreparedInstrument, Progress};
use chalumeau_core::instrument::trial_note::TrialNote;
use chalumeau_core::instrument::tuning_table::{GAMMA_NODES, NATURAL_GAMMA};
use chalumeau_core::instrument::{Model, Quality, Wanted};
use chalumeau_core::parallel;
use chalumeau_core::units::{WrittenNote, cents, midi_of_name};

use crate::generated::{read, write};

/// A refit may differ by this share of a radius: rounding of another processor, not another bore.
const RADIUS_TOLERANCE: f64 = 2e-3;
/// How far a played note may be from its pitch when a committed trim is checked, cents.
const CENTS_TOLERANCE: f64 = 0.12;
/// Highest written note that is checked of the B flat clarinet, C7: C#7 above it does not speak. And of the others: above it,
/// notes do not sound at every pressure.
const HIGHEST_WRITTEN: (u8, u8) = (96, 92);
/// How far what is learnt of a note's dynamics may differ: mouth over closing pressure, and rows of delay.
const GAMMA_TOLERANCE: f64 = 1e-3;
const ROWS_TOLERANCE: f64 = 0.02;
/// Of all instruments but the first, every so manieth note is checked.
const CHECKED_NOTES: usize = 7;

/// What a command is asked to do: instruments, qualities, notes, whether to compare instead of write.
struct Asked {
    check: bool,
    instruments: Vec<Bundled>,
    qualities: Vec<Quality>,
    /// Written notes that are made again; none: all.
    notes: Vec<WrittenNote>,
}

impl Asked {
    fn parse(args: &[String]) -> Result<Self> {
        let mut asked =
            Self { check: false, instruments: Vec::new(), qualities: Vec::new(), notes: Vec::new() };
        for arg in args {
            match (arg.as_str(), Bundled::named(arg)) {
                ("--check", _) => asked.check = true,
                ("live", _) => asked.qualities.push(Quality::Live),
                ("high", _) => asked.qualities.push(Quality::High),
                (_, Some(instrument)) => asked.instruments.push(instrument),
                _ => match midi_of_name(arg) {
                    Some(written) => asked.notes.push(WrittenNote(written)),
                    None => bail!(
                        "takes --check, live, high, written notes and any of {}, got {arg:?}",
                        Bundled::ALL.map(Bundled::id).join(", ")
                    ),
                },
            }
        }
        ensure!(!asked.check || asked.notes.is_empty(), "--check chooses its notes itself");
        Ok(asked)
    }

    /// Fingerings of the notes that are made again; `None` for all.
    fn fingerings(&self, model: &Model) -> Result<Option<Vec<usize>>> {
        let of = |note: &WrittenNote| {
            let at = model.file.fingerings.iter().position(|fingering| fingering.written == *note);
            at.with_context(|| format!("{} has no fingering for {note}", model.file.name))
        };
        let found: Vec<usize> = self.notes.iter().map(of).collect::<Result<_>>()?;
        Ok((!found.is_empty()).then_some(found))
    }

    /// What is asked for, or else `instruments` at `qualities`; each at both families of rates.
    fn wanted(&self, instruments: &[Bundled], qualities: &[Quality]) -> Vec<(Bundled, Wanted)> {
        let given =
            |own: bool, qualities: &[Quality]| if own { self.qualities.clone() } else { qualities.to_vec() };
        let instruments = if self.instruments.is_empty() { instruments } else { &self.instruments };
        let qualities = given(!self.qualities.is_empty(), qualities);
        let mut all = Vec::new();
        for &instrument in instruments {
            for &quality in &qualities {
                for rate_hz in INTERNAL_RATES_HZ {
                    all.push((instrument, Wanted { quality, ..Wanted::new(instrument.file(), rate_hz) }));
                }
            }
        }
        all
    }
}

const QUALITIES: [Quality; 2] = [Quality::Live, Quality::High];

/// The generated file of an instrument.
fn path(instrument: Bundled) -> String {
    format!("crates/core/data/{}.prepared.toml", instrument.data_name())
}

fn kept(instrument: Bundled) -> Result<Vec<PreparedInstrument>> {
    Ok(prepare::parse_generated(&read(&path(instrument))?)?)
}

/// Puts an entry in its place in the generated file, low rates first.
fn keep(instrument: Bundled, new: PreparedInstrument) -> Result<()> {
    let mut all = kept(instrument).unwrap_or_default();
    all.retain(|prepared| prepared.cells.rate_hz != new.cells.rate_hz);
    all.push(new);
    all.sort_by(|a, b| a.cells.rate_hz.total_cmp(&b.cells.rate_hz));
    write(&path(instrument), &prepare::format_generated(all)?)
}

fn entry(instrument: Bundled, wanted: &Wanted) -> Result<PreparedInstrument> {
    let rate_hz = wanted.internal_rate_hz()?;
    let found = kept(instrument)?.into_iter().find(|prepared| prepared.cells.rate_hz == rate_hz);
    found.with_context(|| format!("{} has nothing for {rate_hz} Hz", path(instrument)))
}

/// A line that is written over and over on a terminal.
fn tell(what: &str, share: f64) {
    if std::io::stderr().is_terminal() {
        eprint!("\r{what}: {:3.0} %{}", 100.0 * share, if share < 1.0 { "" } else { "\n" });
    }
}

fn name(instrument: Bundled, wanted: &Wanted) -> Result<String> {
    Ok(format!("{}, {} Hz", instrument.id(), wanted.internal_rate_hz()?))
}

/// The scaled clarinets' measurements, from those of the B flat clarinet; checked byte by byte.
pub fn scale_bores(args: &[String]) -> Result<()> {
    let check = Asked::parse(args)?.check;
    for instrument in Bundled::ALL {
        let Some(text) = instrument.scaled_text() else { continue };
        let path = format!("crates/core/data/{}.toml", instrument.data_name());
        if check {
            ensure!(
                read(&path)? == text,
                "{path} is not the B flat clarinet scaled; run `cargo xtask scale-bores`"
            );
            println!("{path} is the B flat clarinet scaled");
        } else {
            write(&path, &text)?;
        }
    }
    Ok(())
}

/// Cells, still untuned; checked by fitting again.
pub fn fit_bore(args: &[String]) -> Result<()> {
    let asked = Asked::parse(args)?;
    ensure!(asked.notes.is_empty(), "a bore is fitted to all notes together");
    let (instruments, qualities) = if asked.check {
        ([Bundled::BFlat, Bundled::A].as_slice(), [Quality::Live].as_slice())
    } else {
        (Bundled::ALL.as_slice(), QUALITIES.as_slice())
    };
    for (instrument, wanted) in asked.wanted(instruments, qualities) {
        let name = name(instrument, &wanted)?;
        let fitted = Preparation::new(&wanted, None).fitted(&mut |progress| {
            if let Progress::Fitting(share) = progress {
                tell(&format!("{name}: fitting"), share);
            }
            ControlFlow::Continue(())
        })?;
        if asked.check {
            check_fit(&name, &entry(instrument, &wanted)?.cells, &fitted.cells)?;
        } else {
            keep(instrument, PreparedInstrument::of(&fitted))?;
        }
    }
    Ok(())
}

fn check_fit(name: &str, kept: &Cells, fitted: &Cells) -> Result<()> {
    let ticks = |cells: &Cells| cells.cells.iter().map(|cell| cell.ticks).collect::<Vec<_>>();
    ensure!(ticks(kept) == ticks(fitted), "{name}: the grid has moved; run `cargo xtask fit-bore`");
    let radii = kept.cells.iter().zip(&fitted.cells).map(|(a, b)| (a.radius_m, b.radius_m));
    let worst = radii
        .chain([(kept.end_radius_m, fitted.end_radius_m)])
        .map(|(a, b)| (a / b - 1.0).abs())
        .fold(0.0, f64::max);
    println!("{name}: a new fit differs by {worst:.1e} of a radius at most");
    ensure!(worst < RADIUS_TOLERANCE, "{name}: no longer fits; run `cargo xtask fit-bore`");
    Ok(())
}

/// Delay trims; checked by playing notes with their trims: of the first instrument all, of the others some.
pub fn tune(args: &[String]) -> Result<()> {
    let asked = Asked::parse(args)?;
    let qualities = if asked.check { [Quality::Live].as_slice() } else { QUALITIES.as_slice() };
    for (instrument, wanted) in asked.wanted(&Bundled::ALL, qualities) {
        let name = name(instrument, &wanted)?;
        let entry = entry(instrument, &wanted)?;
        let model = entry.model(&wanted.file).with_context(|| format!("{name}: kept for another chart"))?;
        if asked.check {
            let (every, highest) = match instrument {
                Bundled::BFlat => (1, HIGHEST_WRITTEN.0),
                _ => (CHECKED_NOTES, HIGHEST_WRITTEN.1),
            };
            check_tuning(&name, &model, every, highest)?;
            continue;
        }
        let mut on = |share| {
            tell(&format!("{name}: tuning"), share);
            ControlFlow::Continue(())
        };
        let again = asked.fingerings(&model)?;
        let tuning = match &again {
            Some(again) => auto_tune::tune_again(&model, again, Accuracy::FINE, &mut on),
            None => auto_tune::offsets(&model, &mut |_| ControlFlow::Continue(()))
                .and_then(|offsets| auto_tune::tune(&model, &offsets, Accuracy::FINE, &mut on)),
        };
        let tuning = tuning.context("not cancelled")?;
        learn_dynamics(instrument, &name, Model { tuning, ..model }, again)?;
    }
    Ok(())
}

/// What notes ask of the player; checked by learning some notes again.
pub fn play_dynamics(args: &[String]) -> Result<()> {
    let asked = Asked::parse(args)?;
    let (instruments, qualities) = if asked.check {
        ([Bundled::BFlat].as_slice(), [Quality::Live].as_slice())
    } else {
        (Bundled::ALL.as_slice(), QUALITIES.as_slice())
    };
    for (instrument, wanted) in asked.wanted(instruments, qualities) {
        let name = name(instrument, &wanted)?;
        let entry = entry(instrument, &wanted)?;
        let model = entry.model(&wanted.file).with_context(|| format!("{name}: kept for another chart"))?;
        if asked.check {
            check_dynamics(&name, &model)?;
        } else {
            let again = asked.fingerings(&model)?;
            learn_dynamics(instrument, &name, model, again)?;
        }
    }
    Ok(())
}

fn learn_dynamics(instrument: Bundled, name: &str, model: Model, again: Option<Vec<usize>>) -> Result<()> {
    let mut on = |share| {
        tell(&format!("{name}: playing dynamics"), share);
        ControlFlow::Continue(())
    };
    let tuning = match again {
        Some(again) => play_dynamics::learn_again(&model, &again, Accuracy::FINE, &mut on),
        None => play_dynamics::learn(&model, Accuracy::FINE, &mut on),
    };
    let tuning = tuning.context("not cancelled")?;
    keep(instrument, PreparedInstrument::of(&Model { tuning, ..model }))
}

fn check_dynamics(name: &str, model: &Model) -> Result<()> {
    let notes: Vec<usize> = (0..model.tuning.notes.len())
        .filter(|&note| model.file.fingerings[note].written.0 <= HIGHEST_WRITTEN.0)
        .step_by(CHECKED_NOTES)
        .collect();
    let worst_of = |at: usize| {
        let (kept, again) =
            (model.tuning.notes[notes[at]], play_dynamics::learn_note(model, notes[at], Accuracy::FINE)?);
        let off = |a: [f64; NODES], b: [f64; NODES]| {
            a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        Some((off(kept.played.gammas, again.gammas), off(kept.played.rows, again.rows)))
    };
    let found = parallel::each(notes.len(), worst_of, &mut |_| ControlFlow::Continue(()));
    let (mut gamma, mut rows) = (0.0_f64, 0.0_f64);
    for (note, found) in notes.iter().zip(found.context("not cancelled")?) {
        let (g, r) = found.with_context(|| {
            format!(
                "{name}: fingering {note} cannot be played at every dynamic; run `cargo xtask play-dynamics`"
            )
        })?;
        (gamma, rows) = (gamma.max(g), rows.max(r));
    }
    println!("{name}: learnt again, pressures differ by {gamma:.1e}, trims by {rows:.1e} rows at most");
    ensure!(
        gamma < GAMMA_TOLERANCE && rows < ROWS_TOLERANCE,
        "{name}: dynamics have changed; run `cargo xtask play-dynamics`"
    );
    Ok(())
}

fn check_tuning(name: &str, model: &Model, every: usize, highest: u8) -> Result<()> {
    let checked: Vec<usize> = (0..model.file.fingerings.len())
        .filter(|&note| model.file.fingerings[note].written.0 <= highest)
        .step_by(every)
        .collect();
    let worst_of = |at: usize| -> Option<(f64, String)> {
        let (fingering, note) = (checked[at], model.tuning.notes[checked[at]]);
        let trims = GAMMA_NODES.into_iter().zip(note.tempered).chain([(NATURAL_GAMMA, note.natural)]);
        let mut worst = (0.0_f64, String::new());
        for (gamma, rows) in trims {
            let held = TrialNote { rows, ..TrialNote::new(model, fingering, gamma) };
            let hz = auto_tune::heard_hz(model, &held, model.notes_hz[fingering])?;
            let off = cents(hz, model.notes_hz[fingering]);
            if off.abs() > worst.0.abs() {
                worst =
                    (off, format!("written {} at gamma {gamma}", model.file.fingerings[fingering].written));
            }
        }
        Some(worst)
    };
    let found = parallel::each(checked.len(), worst_of, &mut |_| ControlFlow::Continue(()));
    let mut worst = (0.0_f64, String::new());
    for (at, note) in found.context("not cancelled")?.into_iter().enumerate() {
        let written = model.file.fingerings[checked[at]].written;
        let note =
            note.with_context(|| format!("{name}: written {written} does not sound in its register"))?;
        if note.0.abs() > worst.0.abs() {
            worst = note;
        }
    }
    println!("{name}: {} notes, worst trim {:+.2} cents ({})", checked.len(), worst.0, worst.1);
    ensure!(worst.0.abs() < CENTS_TOLERANCE, "{name} is out of tune; run `cargo xtask tune`");
    Ok(())
}
