//! The firm lip with which a player tongues the highest notes.
//!
//! There a lower mode of the fingering starts as easily as the note, and where the breath is soft it goes on beside it for a second. A firmer lip
//! damps the reed less (Wilson & Beavers 1974: only a reed that is damped little, near its resonance, favours an upper mode over a lower one),
//! so that the note outgrows the other one. A reed that is damped less also needs less pressure, so the player blows less, and the note is no
//! accent. Both ease off before the note is heard as held.

use super::lip_glide::{AT_DAMPING, NoteLip};
use crate::dsp::smooth::smooth;

/// Register from which notes are tongued so: the altissimo, written C#6 and up.
const REGISTER: u8 = 3;
/// [Places](super::dynamics::PlayerModel::place) between which the lip grows firm: written D6 and F#6 of a B flat clarinet. Measured: below, notes speak
/// without it, and D6 takes longer with it.
const PLACES: (f64, f64) = (0.65, 0.85);
/// Damping of the reed under the firm lip over that of the held note. Measured on the B flat, A and bass clarinet, written D6 to A6: from 0.7 to 0.8 all notes speak
/// at all of CC 4 to 124. With 0.85 F#6 on the bass is lost; with 0.5 a pianissimo begins 16 dB louder than it goes on.
const DAMPING: f64 = 0.75;
/// Mouth pressure over that which the held note would ask for. Measured: without it soft notes begin up to 7 dB louder than they go on, with it up to 3.5 (4.6 with the wider [opening](super::dynamics::PlayerModel::high)).
const BREATH: f64 = 0.9;
/// How long the lip is firm, and how long it takes to ease off, periods of the lowest note: 0.1 s each on a B flat clarinet. Measured: after 10 periods,
/// F#6 on the bass is lost at 48 kHz and CC 4.
const PERIODS: (f64, f64) = (15.0, 15.0);
/// A lip that is less firm is as it is on held notes.
const HELD: f64 = 1e-4;

/// How firm the lip is.
#[derive(Clone, Copy, Debug, Default)]
pub struct FirmLip {
    /// 0, as on held notes, to 1.
    firmness: f64,
}

/// How firm a lip is that plays a note at a place, so many periods of the lowest note after the tongue, 0..=1.
fn wanted(place: f64, periods: f64) -> f64 {
    let ((from, to), (firm, eases)) = (PLACES, PERIODS);
    smooth((place - from) / (to - from)) * (1.0 - smooth((periods - firm) / eases))
}

impl FirmLip {
    /// One tick for a note of this register at this place, so many periods of the lowest note after the tongue; `None` where nobody plays, or the
    /// fingers slide. The lip is there `at_once`, or goes a `share` of its way. Real-time safe.
    pub fn tick(&mut self, note: Option<(u8, f64)>, periods: f64, at_once: bool, share: f64) {
        let wanted = match note {
            Some((register, place)) if register >= REGISTER => wanted(place, periods),
            _ => 0.0,
        };
        let firmness = if at_once { wanted } else { self.firmness + (wanted - self.firmness) * share };
        self.firmness = if wanted == 0.0 && firmness < HELD { 0.0 } else { firmness };
    }

    /// Lets the lip damp the reed less.
    pub fn hold(&self, note_lip: &mut NoteLip) {
        note_lip[AT_DAMPING] *= 1.0 - (1.0 - DAMPING) * self.firmness;
    }

    /// Factor on the mouth pressure.
    pub fn breath(&self) -> f64 {
        1.0 - (1.0 - BREATH) * self.firmness
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIP: NoteLip = [1_500.0, 0.8, 0.9, -0.1, 0.0, -1.3, 0.1, 1.0, 0.03];

    #[test]
    fn only_the_highest_notes_take_it_and_only_while_they_begin() {
        let held = |note, periods| {
            let (mut lip, mut under) = (FirmLip::default(), LIP);
            lip.tick(note, periods, true, 0.02);
            lip.hold(&mut under);
            (under[AT_DAMPING] / LIP[AT_DAMPING], lip.breath())
        };
        let (damping, breath) = held(Some((3, 0.9)), 5.0);
        assert!((damping - DAMPING).abs() < 1e-12 && (breath - BREATH).abs() < 1e-12);
        let (damping, breath) = held(Some((3, 0.75)), 5.0);
        assert!(damping > DAMPING && damping < 1.0 && breath > BREATH && breath < 1.0);
        for (note, periods) in
            [(Some((2, 0.9)), 5.0), (Some((3, 0.64)), 5.0), (Some((3, 0.9)), 31.0), (None, 5.0)]
        {
            assert_eq!(held(note, periods), (1.0, 1.0), "{note:?}");
        }
    }

    #[test]
    fn it_eases_off_without_a_step_and_all_the_way() {
        let mut lip = FirmLip::default();
        lip.tick(Some((3, 0.9)), 0.0, true, 0.02);
        let mut last = lip.breath();
        for n in 1..=3_000 {
            // A slur down ends it after a few periods.
            let note = Some((if n < 120 { 3 } else { 2 }, 0.9));
            lip.tick(note, 0.025 * f64::from(n), false, 0.02);
            assert!((lip.breath() - last).abs() < 0.0025, "{n}");
            last = lip.breath();
        }
        assert_eq!(last, 1.0);
    }
}
