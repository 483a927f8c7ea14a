//! Arguments several commands share, and how their text is read.

use crate::bore::instrument_file::{InstrumentError, InstrumentFile};
use crate::cli::Failure;
use crate::instrument::{Model, Wanted, prepare};
use crate::units::{Air, WrittenNote, midi_of_name};
use clap::Args;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

/// Which instrument.
#[derive(Args)]
pub struct InstrumentArg {
    /// Instrument file (TOML: bore, tone holes, fingerings) instead of the built-in B flat clarinet
    #[arg(long, value_name = "FILE")]
    instrument: Option<PathBuf>,
}

impl InstrumentArg {
    pub fn load(&self) -> Result<InstrumentFile, Failure> {
        let Some(path) = &self.instrument else { return Ok(InstrumentFile::built_in()) };
        InstrumentFile::load(path).map_err(|source| match source {
            InstrumentError::Read { path, error } => Failure::Read { path, source: error },
            source => Failure::InstrumentFile { path: path.clone(), source },
        })
    }

    /// The instrument ready to play at a host rate. An instrument file takes seconds: its bore is fitted to the lattice.
    pub fn model(&self, file: InstrumentFile, host_rate_hz: u32) -> Result<Arc<Model>, Failure> {
        let rate_hz = f64::from(host_rate_hz);
        let Some(path) = &self.instrument else { return Ok(Arc::new(Model::built_in(rate_hz)?)) };
        match prepare::fitted(&Wanted::new(file, rate_hz), &mut |_| ControlFlow::Continue(())) {
            Ok(model) => Ok(Arc::new(model)),
            Err(source) => Err(Failure::Instrument { path: path.clone(), source }),
        }
    }
}

/// Which air.
#[derive(Args)]
pub struct AirArg {
    /// Air temperature, Celsius, 10..40
    #[arg(long, value_name = "C", default_value = "25", value_parser = |s: &str| within(s, 10.0, 40.0))]
    temperature: f64,
}

impl AirArg {
    pub fn air(&self) -> Air {
        Air::at(self.temperature)
    }

    /// Whether it is the air the lattice is made for.
    pub fn is_reference(&self) -> bool {
        self.air() == Air::default()
    }
}

/// Which notes: the whole fingering chart or one of it.
#[derive(Args)]
#[group(id = "notes", multiple = false)]
pub struct NotesArg {
    /// Every note of the fingering chart (the default)
    #[arg(long)]
    all: bool,
    /// One written note: a MIDI number (65) or a name (F4)
    #[arg(long, value_name = "NOTE", value_parser = note)]
    written: Option<u8>,
}

impl NotesArg {
    /// The notes asked for, low to high.
    pub fn notes(&self, file: &InstrumentFile) -> Result<Vec<WrittenNote>, Failure> {
        match self.written.map(WrittenNote) {
            Some(written) => check_fingering(file, written).map(|()| vec![written]),
            None => Ok(file.fingerings.iter().map(|f| f.written).collect()),
        }
    }

    /// The one note asked for.
    pub fn one(&self) -> Option<WrittenNote> {
        self.written.map(WrittenNote)
    }
}

/// Refuses a note the instrument cannot finger.
pub fn check_fingering(file: &InstrumentFile, written: WrittenNote) -> Result<(), Failure> {
    if file.fingering(written).is_some() {
        return Ok(());
    }
    let (low, high) = (file.lowest(), file.highest());
    Err(Failure::Usage(format!(
        "written {} ({written}) has no fingering; this instrument has {} ({low}) to {} ({high})",
        written.0, low.0, high.0
    )))
}

/// A number inside a range, or what would be right.
pub fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (low..=high).contains(&x) => Ok(x),
        Ok(_) => Err(format!("must lie in {low}..{high}")),
        Err(_) => Err(format!("must be a number in {low}..{high}")),
    }
}

/// As [`within`], for what is stored in single precision.
pub fn within_f32(text: &str, low: f64, high: f64) -> Result<f32, String> {
    within(text, low, high).map(|x| x as f32)
}

/// A MIDI number or a note name.
pub fn note(text: &str) -> Result<u8, String> {
    let number = text.parse::<u8>().ok().filter(|&midi| midi < 128);
    number
        .or_else(|| midi_of_name(text))
        .ok_or_else(|| "must be a MIDI number in 0..127 or a name like E3, F#4 or Bb5".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_have_numbers_and_names() {
        for (text, midi) in
            [("60", 60), ("C4", 60), ("f#5", 78), ("Bb3", 58), ("b3", 59), ("C-1", 0), ("G9", 127)]
        {
            assert_eq!(note(text), Ok(midi), "{text}");
        }
        for text in ["", "H4", "C", "128", "-1", "C10", "G#9", "Cb-1", "C#", "Cé4", "é", "C+"] {
            assert!(note(text).is_err(), "{text}");
        }
    }

    #[test]
    fn ranges_refuse_what_is_no_number() {
        assert_eq!(within("0.5", 0.0, 3.0), Ok(0.5));
        assert_eq!(within("nan", 0.0, 3.0), Err("must lie in 0..3".to_owned()));
        assert_eq!(within("loud", 0.0, 3.0), Err("must be a number in 0..3".to_owned()));
    }
}
