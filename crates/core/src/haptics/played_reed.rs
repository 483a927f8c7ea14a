//! The reed as it is played: its law, the embouchure, and the lip for every fingering.
//!
//! [`crate::instrument::feel_inputs::played_reed`] makes one from the settings of the instrument, with the player's rule for the
//! lip.

use crate::reed::law::{ReedError, ZETA_RANGE};
use crate::reed::physical::P_REF_PA;
use crate::reed::{Lip, ReedLaw};

/// The reed as it is played. Sound and feel use the same one.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayedReed {
    /// Rest opening H, stiffness k and amplitude A.
    pub law: ReedLaw,
    /// Embouchure parameter zeta of the reference reed, dimensionless; [`flow_strength`](Self::flow_strength) gives that of
    /// this reed.
    pub zeta: f64,
    /// Half-width of the range of pressure in which the reed rolls onto the lay, over the closing pressure; 0 for a sharp
    /// lay.
    pub lay: f64,
    /// Loss coefficient K of the jets in open holes; 0 without jets.
    pub jet_loss: f64,
    /// Lip for each fingering of the instrument file, in its order. A fingering without one gets a reed without inertia.
    pub lips: Vec<Lip>,
}

impl PlayedReed {
    /// The reference reed without inertia, on a bore without jets, with the embouchure `zeta`, 0.05..=0.9.
    ///
    /// # Errors
    /// [`ReedError::Zeta`] if it lies outside.
    pub fn quasi_static(zeta: f64) -> Result<Self, ReedError> {
        if (ZETA_RANGE.0..=ZETA_RANGE.1).contains(&zeta) {
            Ok(Self::of_zeta(zeta))
        } else {
            Err(ReedError::Zeta(zeta))
        }
    }

    /// The same with a zeta that is in its range.
    pub(super) fn of_zeta(zeta: f64) -> Self {
        Self { law: ReedLaw::default(), zeta, lay: 0.0, jet_loss: 0.0, lips: Vec::new() }
    }

    /// Closing pressure p_M, Pa: 6 kPa times H k.
    pub fn closing_pa(&self) -> f64 {
        P_REF_PA * self.law.closing()
    }

    /// Compliance relative to that of the reference reed.
    pub fn compliance(&self) -> f64 {
        self.law.compliance()
    }

    /// Embouchure parameter over this reed's own closing pressure, see [`ReedLaw::flow_strength`].
    pub fn flow_strength(&self) -> f64 {
        self.law.flow_strength(self.zeta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_flow_or_a_flow_backwards_is_no_reed() {
        assert!([0.05, 0.3, 0.9].into_iter().all(|zeta| PlayedReed::quasi_static(zeta).is_ok()));
        for zeta in [0.0, -1.0, 1.1, f64::NAN, f64::INFINITY] {
            let said = PlayedReed::quasi_static(zeta).unwrap_err().to_string();
            assert!(said.contains("zeta") && said.contains("0.05..0.9"), "{said}");
        }
    }

    #[test]
    fn reference_reed_has_the_strength_it_was_given() {
        assert!((PlayedReed::of_zeta(0.3).flow_strength() - 0.3).abs() < 1e-12);
        let wide = PlayedReed { law: ReedLaw::coupled(3.0, 1.0).unwrap(), ..PlayedReed::of_zeta(0.3) };
        let ratio = 3.0 / crate::reed::law::H_INIT;
        assert!((wide.flow_strength() - 0.3 * ratio * ratio).abs() < 1e-12);
        let loud = PlayedReed { law: ReedLaw::coupled(3.0, 2.0).unwrap(), ..wide.clone() };
        assert!((loud.flow_strength() - 2.0 * wide.flow_strength()).abs() < 1e-12);
    }
}
