//! Rendering: what `chalumeau render` plays, into an array.

use crate::instrument::Instrument;
use crate::mistakes::{signals, watched, wrong};
use chalumeau::cli::offline::{self, Given, TimedNote};
use chalumeau_core::units::SoundingNote;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A note of a list: when it begins, s; how long it is held, s; its sounding MIDI number; its velocity.
type ListedNote = (f64, f64, u8, f32);

/// Plays what names and values say. `midi` or `notes` are played in place of a file that is named.
///
/// Returns the samples with their rate, what the user should know, and how often the calculation broke down.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: Option<&Instrument>,
    midi: Option<Vec<u8>>,
    notes: Option<Vec<ListedNote>>,
    channels: u16,
) -> PyResult<Bound<'py, PyDict>> {
    if !(1..=2).contains(&channels) {
        return Err(wrong(format_args!("channels must be 1 or 2, got {channels}")));
    }
    let file = instrument.map(|instrument| instrument.file.clone());
    let given = match (midi, notes) {
        (Some(bytes), _) => Some(Given::Midi(bytes)),
        (None, Some(notes)) => Some(Given::Notes(notes.into_iter().map(timed).collect::<PyResult<_>>()?)),
        (None, None) => None,
    };
    let played = py.detach(|| {
        let job = watched(|stop| offline::render_job(&pairs, file, given, Some(stop)))?;
        let mut warnings = job.warnings.clone();
        if channels == 1 && job.settings.room.amount > 0.0 {
            warnings.push("with channels=1 no room is heard; channels=2 has it".to_owned());
        }
        let mut samples = Vec::with_capacity(job.score.samples * usize::from(channels));
        let mut unheard = 0;
        let resets = job.play(channels, None, |sent, heard| {
            match heard {
                [mono] => samples.extend_from_slice(mono),
                [left, right] => samples.extend(left.iter().zip(*right).flat_map(|(l, r)| [*l, *r])),
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
        Ok::<_, PyErr>((samples, job.rate, warnings, resets))
    });
    let (samples, rate, warnings, resets) = played?;
    let count = samples.len() / usize::from(channels);
    let samples = PyArray1::from_vec(py, samples);
    let dict = PyDict::new(py);
    if channels == 2 {
        dict.set_item("samples", samples.reshape([count, 2])?)?;
    } else {
        dict.set_item("samples", samples)?;
    }
    dict.set_item("rate_hz", rate)?;
    dict.set_item("warnings", warnings)?;
    dict.set_item("resets", resets)?;
    Ok(dict)
}

/// What the user should know of a sounding note that is played with these settings: that it stays silent.
#[pyfunction]
pub fn silent(
    py: Python<'_>,
    pairs: Vec<(String, String)>,
    instrument: &Instrument,
    note: u8,
) -> PyResult<Vec<String>> {
    let given = Given::Notes(vec![timed((0.0, 0.1, note, 0.8))?]);
    let file = instrument.file.clone();
    py.detach(|| watched(|stop| offline::render_job(&pairs, Some(file), Some(given), Some(stop))))
        .map(|job| job.warnings)
}

fn timed((from_s, seconds, note, velocity): ListedNote) -> PyResult<TimedNote> {
    let fits = |seconds: f64| (0.0..=86_400.0).contains(&seconds);
    if !fits(from_s) || !fits(seconds) {
        return Err(wrong(format_args!(
            "a note must begin at 0..86400 s and last 0..86400 s, got {from_s} and {seconds}"
        )));
    }
    if note > 127 || !(0.0..=1.0).contains(&velocity) {
        return Err(wrong(format_args!(
            "a note must be 0..127 with a velocity in 0..1, got {note} with {velocity}"
        )));
    }
    Ok(TimedNote { from_s, seconds, note: SoundingNote(note), velocity })
}
