//! Rendering: what `chalumeau render` plays, into an array.

use crate::instrument::Instrument;
use crate::mistakes::{advised, signals, watched, wrong};
use chalumeau::cli::offline::{self, Given, TimedNote};
use chalumeau::wav::LevelMeter;
use chalumeau_core::units::SoundingNote;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A note of a list: when it begins, s; how long it is held, s; its sounding MIDI number; its velocity.
type ListedNote = (f64, f64, u8, f32);

/// The longest list of notes, s: as long as a MIDI file may be.
const LONGEST_S: f64 = 6.0 * 3_600.0;

/// Memory for so many samples, all 0 where it is `filled`; a `MemoryError` where there is not as much.
pub fn memory(samples: usize, filled: bool) -> PyResult<Vec<f32>> {
    let mut memory = Vec::new();
    memory.try_reserve_exact(samples).map_err(|_| {
        PyMemoryError::new_err(format!(
            "{samples} samples need {:.1} GB of memory, which there is not; render less at once, at a lower rate, or on one channel",
            4e-9 * samples as f64
        ))
    })?;
    if filled {
        memory.resize(samples, 0.0);
    }
    Ok(memory)
}

/// Plays what names and values say. `midi`, which was read from `path`, or `notes` are played in place of a file that is named.
/// Without `channels` there are as many as the command would write.
///
/// Returns the samples with their rate, the pitch that the longest note is to have (Hz, nan without a note), what the user should know,
/// and how often the calculation broke down.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: Option<&Instrument>,
    midi: Option<Vec<u8>>,
    path: Option<PathBuf>,
    notes: Option<Vec<ListedNote>>,
    channels: Option<i64>,
) -> PyResult<Bound<'py, PyDict>> {
    let asked = match channels {
        None => None,
        Some(1) => Some(1),
        Some(2) => Some(2),
        Some(other) => return Err(wrong(format_args!("channels must be 1 or 2, got {other}"))),
    };
    let file = instrument.map(|instrument| instrument.file.clone());
    let given = match (midi, notes) {
        (Some(bytes), _) => Some(Given::Midi { bytes, path }),
        (None, Some(notes)) => Some(Given::Notes(notes.into_iter().map(timed).collect::<PyResult<_>>()?)),
        (None, None) => None,
    };
    let played = py.detach(|| {
        let job = watched(|stop| offline::render_job(&pairs, file, given, Some(stop)))?;
        let mut warnings: Vec<_> = job.warnings.iter().chain(&job.idle).cloned().collect();
        let channels = asked.unwrap_or_else(|| job.usual_channels());
        if channels == 1 && job.settings.room.amount > 0.0 {
            warnings.push("with channels=1 no room is heard; channels=2 has it".to_owned());
        }
        let mut samples = memory(job.score.samples.saturating_mul(usize::from(channels)), false)?;
        let mut unheard = 0;
        let mut meter = LevelMeter::new(job.rate, channels);
        let resets = job.play(channels, None, |sent, heard| {
            match heard {
                [mono] => samples.extend(mono.iter().inspect(|sample| meter.hear(**sample))),
                [left, right] => {
                    let both = left.iter().zip(*right).flat_map(|(l, r)| [*l, *r]);
                    samples.extend(both.inspect(|sample| meter.hear(*sample)));
                }
                _ => {}
            }
            // Once for each second of sound: Ctrl-C ends a long rendering.
            unheard += sent.len();
            if unheard >= job.rate as usize {
                unheard = 0;
                return signals();
            }
            Ok(())
        })?;
        warnings.extend(offline::doubts(&job, meter.levels()).map(str::to_owned));
        let spans = job.score.note_spans(&job.settings.reach.key_notes(&job.model));
        let longest = spans.iter().max_by_key(|span| span.to - span.from);
        let wanted_hz =
            longest.map_or(f64::NAN, |span| span.note.frequency_hz(f64::from(job.settings.a4_hz)));
        Ok::<_, PyErr>((samples, channels, job.rate, wanted_hz, warnings, resets))
    });
    let (samples, channels, rate, wanted_hz, warnings, resets) = played?;
    let count = samples.len() / usize::from(channels);
    let samples = PyArray1::from_vec(py, samples);
    let dict = PyDict::new(py);
    if channels == 2 {
        dict.set_item("samples", samples.reshape([count, 2])?)?;
    } else {
        dict.set_item("samples", samples)?;
    }
    dict.set_item("rate_hz", rate)?;
    dict.set_item("wanted_hz", wanted_hz)?;
    let warnings: Vec<_> = warnings.iter().map(|said| advised(said)).collect();
    dict.set_item("warnings", warnings)?;
    dict.set_item("resets", resets)?;
    Ok(dict)
}

fn timed((from_s, seconds, note, velocity): ListedNote) -> PyResult<TimedNote> {
    let fits = |seconds: f64| (0.0..=LONGEST_S).contains(&seconds);
    if !fits(from_s) || !fits(seconds) {
        return Err(wrong(format_args!(
            "a note must begin at 0..{LONGEST_S} s and last 0..{LONGEST_S} s, got {from_s} and {seconds}"
        )));
    }
    if from_s + seconds > LONGEST_S {
        return Err(wrong(format_args!(
            "a note ends at {} s, and a list of notes may last {LONGEST_S} s, six hours; render it in parts",
            from_s + seconds
        )));
    }
    if note > 127 || !(0.0..=1.0).contains(&velocity) {
        return Err(wrong(format_args!(
            "a note must be 0..127 with a velocity in 0..1, got {note} with {velocity}"
        )));
    }
    Ok(TimedNote { from_s, seconds, note: SoundingNote(note), velocity })
}
