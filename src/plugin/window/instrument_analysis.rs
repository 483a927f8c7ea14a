//! What the window shows of an instrument that does not change from moment to moment: requirement, feel, standing wave.

use std::sync::Arc;

use crate::plugin::instrument_loading::CurrentInstrument;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::haptics::{FeelDesign, FeelTable, NoteFeel, NoteRequirement, TorqueLimits};
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_knob::touch::feel::InstrumentFeel;

/// An instrument as the window draws it. It is there before the analysis.
#[derive(Clone)]
pub struct DrawnInstrument {
    /// What sounds.
    model: Arc<Model>,
    /// Its measurements.
    pub file: Arc<InstrumentFile>,
    /// The measurements before any alteration and before scaling.
    pub as_built: Arc<InstrumentFile>,
    /// What names it in a saved project.
    pub key: String,
}

impl DrawnInstrument {
    /// Reads the instrument's file.
    pub fn new(current: &CurrentInstrument) -> Self {
        Self {
            file: Arc::new(current.model.file.clone()),
            as_built: Arc::new(current.request.file().unwrap_or_else(|_| current.model.file.clone())),
            model: current.model.clone(),
            key: current.request.key.clone(),
        }
    }

    /// Whether it is that instrument.
    pub fn is_of(&self, current: &CurrentInstrument) -> bool {
        Arc::ptr_eq(&self.model, &current.model)
    }
}

/// An instrument, analysed once, with the latest results for a fingering.
pub struct InstrumentAnalysis {
    drawn: DrawnInstrument,
    feels: Arc<InstrumentFeel>,
    bore: TransferMatrix,
    /// The latest feel table, and what it was computed from.
    table: Option<(Settings, FeelDesign, Result<FeelTable, String>)>,
    standing_wave: Option<StandingWave>,
}

/// A standing wave, and what it was computed from.
struct StandingWave {
    fingering: usize,
    open: Vec<bool>,
    /// Distance from the reed, m, and magnitude over that at the reed.
    wave: Vec<(f32, f32)>,
}

impl InstrumentAnalysis {
    /// Analyses an instrument. Takes about a second.
    pub fn new(current: &CurrentInstrument) -> Self {
        Self {
            feels: Arc::new(InstrumentFeel::new(&current.model)),
            bore: TransferMatrix::new(&current.model.file, current.model.air),
            drawn: DrawnInstrument::new(current),
            table: None,
            standing_wave: None,
        }
    }

    /// Whether this is the analysis of that instrument, however it is tuned now. Tuning keeps the bore's coefficients, and what takes
    /// long here depends on nothing that it changes.
    pub fn is_of(&self, current: &CurrentInstrument) -> bool {
        Arc::ptr_eq(&self.drawn.model.coeffs, &current.model.coeffs)
    }

    /// Takes over how that instrument is tuned now.
    pub fn follow(&mut self, current: &CurrentInstrument) {
        if !self.drawn.is_of(current) {
            self.drawn = DrawnInstrument::new(current);
            self.standing_wave = None;
        }
    }

    /// The instrument.
    pub fn drawn(&self) -> &DrawnInstrument {
        &self.drawn
    }

    /// What a fingering requires of the breath with this reed; `None` if it does not sound.
    pub fn requirement(&self, fingering: usize, settings: &Settings) -> Option<NoteRequirement> {
        self.feels.requirements().note(fingering, &self.feels.reed(settings))
    }

    /// What the hand feels on a fingering, or why there is no feel.
    pub fn feel(
        &mut self,
        fingering: usize,
        settings: &Settings,
        design: &FeelDesign,
    ) -> Result<NoteFeel, String> {
        let same = self.table.as_ref().is_some_and(|(of, by, _)| (of, by) == (settings, design));
        if !same {
            let table = self.feels.table(settings, design, &TorqueLimits::default());
            self.table = Some((*settings, *design, table.map_err(|reason| reason.to_string())));
        }
        match self.table.as_ref().map(|(.., table)| table) {
            Some(Ok(table)) => Ok(*table.note(fingering).unwrap_or(table.reference())),
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("not known yet".to_owned()),
        }
    }

    /// The standing wave of a fingering with these holes open: distance from the reed, m, and magnitude over that at the
    /// reed.
    pub fn standing_wave(&mut self, fingering: usize, open: &[bool]) -> Vec<(f32, f32)> {
        let known = self.standing_wave.as_ref();
        if let Some(known) = known.filter(|known| known.fingering == fingering && known.open == open) {
            return known.wave.clone();
        }
        let wave = self.bore.standing_pressure(self.drawn.model.notes_hz[fingering], open);
        let wave: Vec<_> = wave.into_iter().map(|(x, p)| (x as f32, p as f32)).collect();
        self.standing_wave = Some(StandingWave { fingering, open: open.to_vec(), wave: wave.clone() });
        wave
    }
}
