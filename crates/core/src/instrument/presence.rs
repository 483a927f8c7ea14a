//! Presence: what recordings of clarinets have beyond the mean over directions.
//!
//! Bell and holes send their highs forward, and microphones stand in front. Recorded notes have, next to what the power average of
//! their flows gives, more above 2 kHz, and more around 1.5 kHz, where the tone holes cut off. Two filters that are the same for all notes
//! say so: a shelf of first order and a bell of second order. `cargo xtask fit-player` fits them together with the player's rule, and
//! `docs/tone.md` tells what they bought. Their frequencies go with the size of the instrument.

use std::f64::consts::TAU;

use crate::bore::sound_sources::SoundSources;
use crate::instrument::player::fitted;
use crate::maths;
use crate::units::REFERENCE_LENGTH_M;

/// A shelf and a bell.
///
/// ```
/// use chalumeau_core::instrument::presence::Presence;
///
/// let presence = Presence::FITTED;
/// assert!(presence.gain_db(50.0).abs() < 0.1);
/// assert!((presence.gain_db(20_000.0) - presence.shelf_db).abs() < 0.2);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presence {
    /// Where half of the shelf's gain is reached, Hz.
    pub shelf_hz: f64,
    /// Gain of the highs, dB.
    pub shelf_db: f64,
    /// Middle of the bell, Hz.
    pub bell_hz: f64,
    /// Gain there, dB.
    pub bell_db: f64,
    /// Quality of the bell: `bell_hz` over the width between the frequencies with half of its gain in dB.
    pub bell_quality: f64,
}

/// A filter `(b0 + b1 z + b2 z^2) / (1 - a1 z - a2 z^2)`, `z` a delay of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Biquad {
    /// `b0`, `b1`, `b2`.
    pub forward: [f64; 3],
    /// `a1`, `a2`.
    pub back: [f64; 2],
}

impl Presence {
    /// For a B flat clarinet.
    pub const FITTED: Self = fitted::PRESENCE;

    /// For an instrument of this size.
    pub fn of(sources: &SoundSources) -> Self {
        let size = sources.length_m() / REFERENCE_LENGTH_M;
        Self { shelf_hz: Self::FITTED.shelf_hz / size, bell_hz: Self::FITTED.bell_hz / size, ..Self::FITTED }
    }

    /// Gain at a frequency, dB.
    pub fn gain_db(&self, f_hz: f64) -> f64 {
        let db = |above: f64, below: f64| 10.0 * maths::log10(above / below);
        let (u, root) = (f_hz / self.shelf_hz, root_gain(self.shelf_db));
        let shelf_db = db(1.0 + (u * root).powi(2), 1.0 + (u / root).powi(2));
        let (u, root) = (f_hz / self.bell_hz, root_gain(self.bell_db));
        let (off, width) = ((1.0 - u * u).powi(2), u / self.bell_quality);
        shelf_db + db(off + (width * root).powi(2), off + (width / root).powi(2))
    }

    /// The shelf as times `b` and `a` in `(1 + b s) / (1 + a s)`, s.
    pub fn shelf_s(&self) -> (f64, f64) {
        let (root, middle_s) = (root_gain(self.shelf_db), 1.0 / (TAU * self.shelf_hz));
        (middle_s * root, middle_s / root)
    }

    /// The bell at a sample rate, Hz: that of Robert Bristow-Johnson, *Cookbook formulae for audio EQ biquad filter coefficients*.
    pub fn bell(&self, rate_hz: f64) -> Biquad {
        let turn = maths::tan(0.5 * TAU * (self.bell_hz / rate_hz).min(0.49)).recip();
        let (square, width, root) = (turn * turn, turn / self.bell_quality, root_gain(self.bell_db));
        let (wide, narrow) = (width * root, width / root);
        let scale = square + narrow + 1.0;
        Biquad {
            forward: [square + wide + 1.0, 2.0 - 2.0 * square, square - wide + 1.0].map(|b| b / scale),
            back: [(2.0 * square - 2.0) / scale, (narrow - square - 1.0) / scale],
        }
    }
}

/// The square root of a gain in dB, as a factor.
fn root_gain(gain_db: f64) -> f64 {
    maths::pow(10.0, gain_db / 40.0)
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::bore::instrument_file::InstrumentFile;

    #[test]
    fn shelf_and_bell_have_the_gain_that_is_asked() {
        let presence = Presence::FITTED;
        for rate_hz in [88_200.0, 96_000.0, 192_000.0] {
            let Biquad { forward: [b0, b1, b2], back: [a1, a2] } = presence.bell(rate_hz);
            for f_hz in [50.0, 300.0, 1_000.0, presence.bell_hz, 2_000.0, presence.shelf_hz, 4_000.0, 8_000.0]
            {
                let z = Complex64::cis(-TAU * f_hz / rate_hz);
                let bell = (b0 + (b1 + b2 * z) * z) / (1.0 - (a1 + a2 * z) * z);
                let ((b, a), s) = (presence.shelf_s(), Complex64::I * TAU * f_hz);
                let gain_db = 20.0 * (bell * (1.0 + b * s) / (1.0 + a * s)).norm().log10();
                let off_db = gain_db - presence.gain_db(f_hz);
                assert!(off_db.abs() < 0.1, "{rate_hz} Hz, {f_hz} Hz: {off_db:.3} dB");
            }
        }
    }

    #[test]
    fn the_b_flat_clarinet_is_what_it_was_fitted_to() {
        let of = Presence::of(&SoundSources::of(&InstrumentFile::built_in()));
        assert!((of.bell_hz / Presence::FITTED.bell_hz - 1.0).abs() < 1e-3, "{of:?}");
    }
}
