//! The feel of the current instrument, computed once.

use std::sync::Arc;

use crate::plugin::instrument_loading::instrument_request::InstrumentSource;
use crate::plugin::instrument_loading::{CurrentInstrument, Readiness, SharedInstrument};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::lattice::LatticeCoeffs;
use chalumeau_knob::touch::feel::InstrumentFeel;

/// Keeps the feel of one instrument while it plays.
#[derive(Default)]
pub struct FeelsCache {
    latest: Option<(Arc<LatticeCoeffs>, Arc<InstrumentFeel>)>,
}

impl FeelsCache {
    /// The feel of the current instrument. While that is not fitted, the feel of the one before. Allocates; takes about
    /// a second for a new instrument.
    pub fn of(&mut self, instrument: &SharedInstrument) -> Option<Arc<InstrumentFeel>> {
        match instrument.current().filter(|current| current.readiness > Readiness::Rough) {
            Some(current) if !is_built_in(&current) => {
                // Tuning keeps the bore's coefficients, and the feel depends on nothing that it changes.
                let known = self.latest.as_ref().filter(|(of, _)| Arc::ptr_eq(of, &current.model.coeffs));
                let feels = match known {
                    Some((_, feels)) => feels.clone(),
                    None => Arc::new(InstrumentFeel::new(&current.model)),
                };
                self.latest = Some((current.model.coeffs.clone(), feels.clone()));
                Some(feels)
            }
            Some(_) => {
                self.latest = None;
                InstrumentFeel::built_in().ok()
            }
            None => self
                .latest
                .as_ref()
                .map_or_else(|| InstrumentFeel::built_in().ok(), |(_, feels)| Some(feels.clone())),
        }
    }
}

/// The built-in clarinet feels the same at every host rate, so its feel is computed once for all instances.
fn is_built_in(current: &CurrentInstrument) -> bool {
    current.request.source == InstrumentSource::Bundled(Bundled::BFlat) && current.model.scale == 1.0
}
