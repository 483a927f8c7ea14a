//! What the instrument that plays feels like.

use std::sync::Arc;

use crate::plugin::instrument::choice::Source;
use crate::plugin::instrument::{Placed, Shared, Stage};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::lattice::LatticeCoeffs;
use chalumeau_knob::touch::feel::Feels;

/// The feel of one instrument, kept while it plays.
#[derive(Default)]
pub struct Felt {
    of: Option<(Arc<LatticeCoeffs>, Arc<Feels>)>,
}

impl Felt {
    /// The feel of the instrument that plays. One that is not fitted yet feels like the one before. Allocates; takes a
    /// second for an instrument seen for the first time.
    pub fn of(&mut self, instruments: &Shared) -> Option<Arc<Feels>> {
        let placed = instruments.placed();
        match placed.filter(|placed| placed.stage > Stage::Rough) {
            Some(placed) if !is_built_in(&placed) => {
                // Tuning an instrument changes nothing that is felt.
                let known = self.of.as_ref().filter(|(of, _)| Arc::ptr_eq(of, &placed.model.coeffs));
                let feels = match known {
                    Some((_, feels)) => feels.clone(),
                    None => Arc::new(Feels::new(&placed.model)),
                };
                self.of = Some((placed.model.coeffs.clone(), feels.clone()));
                Some(feels)
            }
            Some(_) => {
                self.of = None;
                Feels::built_in().ok()
            }
            None => self.of.as_ref().map_or_else(|| Feels::built_in().ok(), |(_, feels)| Some(feels.clone())),
        }
    }
}

/// The built-in clarinet feels the same at every rate: it is worked out once for all.
fn is_built_in(placed: &Placed) -> bool {
    placed.order.source == Source::Bundled(Bundled::BFlat) && placed.model.scale == 1.0
}
