//! The player's small corrections: a delay per note, found by playing the instrument itself.
//!
//! Linear theory cannot supply them (reed damping and saturation move every note by tens of cents), so each note is
//! played, heard, and its delay moved until it is right. *Natural* is the trim at gamma 0.5; *tempered* has four nodes
//! over gamma, because a real bore's modes are not harmonic and pitch sags as the reed begins to beat.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use crate::analysis::pitch;
use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::instrument::held::HeldNote;
use crate::instrument::model::Model;
use crate::instrument::settings::Tuning;
use crate::units::cents;

/// Mouth pressures over the closing pressure at which tempered trims are given.
///
/// Of all places for four straight-line nodes these leave the least between them: 1.9 cents at most.
pub const GAMMA_NODES: [f64; 4] = [0.45, 0.55, 0.725, 0.9];
/// Mouth pressure of the natural trim.
pub const NATURAL_GAMMA: f64 = 0.5;

/// How far a note is moved to see what a row of delay does to it, cents: down, where the delay always has room.
const PROBE_CENTS: f64 = -20.0;

/// Trims of one note, rows of round-trip delay.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NoteTuning {
    /// Written MIDI note.
    pub written: u8,
    /// Trim at [`NATURAL_GAMMA`].
    pub natural: f64,
    /// Trims at [`GAMMA_NODES`].
    pub tempered: [f64; 4],
    /// Rows that lower the note by one cent, over the quarter-wave estimate of [`Model::rows_for_cents`].
    pub sensitivity: f64,
}

/// Trims of all fingerings of an instrument at one internal rate.
#[derive(Clone, Debug, PartialEq)]
pub struct TuningTable {
    /// In the order of the file's fingerings.
    pub notes: Vec<NoteTuning>,
}

impl TuningTable {
    /// No trims.
    pub fn untuned(file: &InstrumentFile) -> Self {
        let note = |fingering: &Fingering| NoteTuning {
            written: fingering.written.0,
            sensitivity: 1.0,
            ..NoteTuning::default()
        };
        Self { notes: file.fingerings.iter().map(note).collect() }
    }

    /// Trim of a note at a mouth pressure, rows. Real-time safe.
    pub fn rows(&self, fingering: usize, tuning: Tuning, gamma: f64) -> f64 {
        let Some(note) = self.notes.get(fingering) else { return 0.0 };
        match tuning {
            Tuning::Natural => note.natural,
            Tuning::Tempered => {
                let gamma = gamma.clamp(GAMMA_NODES[0], GAMMA_NODES[3]);
                let right = GAMMA_NODES[1..3].partition_point(|&node| node < gamma) + 1;
                let (g0, g1) = (GAMMA_NODES[right - 1], GAMMA_NODES[right]);
                let way = (gamma - g0) / (g1 - g0);
                note.tempered[right - 1] + way * (note.tempered[right] - note.tempered[right - 1])
            }
        }
    }
}

/// How long a note is held before it is listened to, s, and until when: near threshold growth is slow.
fn listening_s(gamma: f64) -> (f64, f64) {
    if gamma < 0.5 { (1.0, 1.4) } else { (0.6, 1.0) }
}

/// Pitch of a held note, Hz, or `None` if it is more than 150 cents from `wanted_hz` or not a note.
pub fn heard_hz(model: &Model, note: &HeldNote, wanted_hz: f64) -> Option<f64> {
    let (from_s, to_s) = listening_s(note.gamma);
    let sound = note.radiated(model, from_s, to_s);
    let hz = pitch::fundamental_hz(&sound, model.coeffs.rate_hz)?;
    (cents(hz, wanted_hz).abs() < 150.0 && pitch::periodicity(&sound, model.coeffs.rate_hz, hz) > 0.9)
        .then_some(hz)
}

/// Finds the trim of one note at one mouth pressure from a first guess: secant steps on the played pitch.
/// Returns the trim; `None` if the note does not sound.
fn trim(model: &Model, fingering: usize, gamma: f64, guess: f64) -> Option<f64> {
    let wanted = model.notes_hz[fingering];
    let (low, high) = model.coeffs.tuning_range();
    let (mut rows, mut sensitivity) = (guess, 1.0);
    let mut before: Option<(f64, f64)> = None;
    let mut best: Option<(f64, f64)> = None;
    for _ in 0..6 {
        let note = HeldNote { rows, ..HeldNote::new(model, fingering, gamma) };
        let off = cents(heard_hz(model, &note, wanted)?, wanted);
        if best.is_none_or(|(_, least): (f64, f64)| off.abs() < least.abs()) {
            best = Some((rows, off));
        }
        if let Some((rows_before, off_before)) = before {
            let estimate = model.rows_for_cents(fingering, off) - model.rows_for_cents(fingering, off_before);
            if estimate.abs() > 0.02 {
                sensitivity = ((rows - rows_before) / estimate).clamp(0.5, 3.0);
            }
        }
        if off.abs() < 0.03 {
            break;
        }
        before = Some((rows, off));
        rows = (rows - sensitivity * model.rows_for_cents(fingering, off)).clamp(low, high);
    }
    best.map(|(rows, _)| rows)
}

/// Rows a cent costs at a trim, over [`Model::rows_for_cents`]; seen by moving the note, whatever the trim began from.
fn sensitivity(model: &Model, fingering: usize, rows: f64) -> Option<f64> {
    let heard = |rows: f64| {
        let note = HeldNote { rows, ..HeldNote::new(model, fingering, NATURAL_GAMMA) };
        heard_hz(model, &note, model.notes_hz[fingering])
    };
    let probe = model.rows_for_cents(fingering, PROBE_CENTS);
    let moved = cents(heard(rows + probe)?, heard(rows)?);
    Some((probe / model.rows_for_cents(fingering, moved)).clamp(0.5, 3.0))
}

/// The trims of one note, from the one it has. A trim that cannot be heard is left as it is.
fn tune_note(model: &Model, fingering: usize) -> NoteTuning {
    let before = model.tuning.notes[fingering];
    let mut note = NoteTuning { tempered: [before.natural; 4], sensitivity: 1.0, ..before };
    if let Some(rows) = trim(model, fingering, NATURAL_GAMMA, before.natural) {
        note.natural = rows;
        note.sensitivity = sensitivity(model, fingering, rows).unwrap_or(1.0);
    }
    note.tempered = [note.natural; 4];
    let mut guess = note.natural;
    for (node, gamma) in GAMMA_NODES.into_iter().enumerate() {
        if let Some(rows) = trim(model, fingering, gamma, guess) {
            note.tempered[node] = rows;
            guess = rows;
        }
    }
    note
}

/// Tunes every fingering of a model by playing it, on all cores. Takes up to a minute; `on` is told the share done and
/// may end it, for `None`. Notes do not know of each other, so the result does not depend on the cores.
pub fn tune(model: &Model, on: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Option<TuningTable> {
    let count = model.file.fingerings.len();
    let mut table = model.tuning.clone();
    each_note(
        count,
        |fingering| tune_note(model, fingering),
        |fingering, note, done| {
            table.notes[fingering] = note;
            on(done as f64 / count as f64)
        },
    )
    .then_some(table)
}

/// `work` for every fingering on all cores; `take` gets each result and how many there are now. False if it broke off.
fn each_note<T: Send>(
    count: usize,
    work: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T, usize) -> ControlFlow<()>,
) -> bool {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let workers = thread::available_parallelism().map_or(1, usize::from).min(count);
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..workers {
            let (sender, next, stop, work) = (sender.clone(), &next, &stop, &work);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    if at >= count || sender.send((at, work(at))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let mut done = 0;
        for (at, result) in results {
            done += 1;
            if take(at, result, done).is_break() {
                stop.store(true, Ordering::Relaxed);
                return false;
            }
        }
        done == count
    })
}
