//! Slurs: which ones the breath helps with a dip, and how deep.
//!
//! Nearly all slurs arrive by the fingers alone (all 1908 of up to an octave, written E3 to C6 at three dynamics, were tried). Two
//! kinds do not where the reed beats: from the low clarion down into the low chalumeau, where the air column goes on in the second
//! mode of the new note; and wide leaps down within the clarion. There the pressure dips, to just below what would keep the
//! old mode alive, and no deeper. Soft notes need no dip: they are near their threshold anyway.

/// Notes below this place of the compass (written F4 of a B flat clarinet) hold on to their second mode.
const LOW_PLACE: f64 = -0.39;
/// Slurs down over at least so many cents from clarion to low chalumeau; within the clarion.
const LEAPS_CENTS: (f64, f64) = (750.0, 950.0);
/// The least mouth over closing pressure at which a slur needs help.
const BEATING: f64 = 0.47;

/// A dip of the breath.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dip {
    /// Mouth over closing pressure that is not exceeded.
    pub gamma: f64,
    /// For how long, s.
    pub length_s: f64,
}

/// A slur: the way from note to note.
#[derive(Clone, Copy, Debug)]
pub struct Slur {
    /// Up if positive, cents.
    pub interval_cents: f64,
    /// Register from where, and to where.
    pub registers: (u8, u8),
    /// [Place](super::dynamics::PlayerModel::place) of the new note.
    pub place: f64,
}

impl Slur {
    /// The dip that a player gives this slur at a mouth over closing pressure; `None` where the fingers are enough.
    pub fn dip(&self, gamma: f64) -> Option<Dip> {
        let (to_low, in_clarion) = LEAPS_CENTS;
        match self.registers {
            _ if gamma < BEATING => None,
            (2, 1) if self.place < LOW_PLACE && -self.interval_cents > to_low => {
                Some(Dip { gamma: 0.2, length_s: 0.025 })
            }
            (2, 2) if -self.interval_cents > in_clarion => Some(Dip { gamma: 0.4, length_s: 0.012 }),
            _ => None,
        }
    }

    /// Share of the time of the slur that each finger takes. Where the register changes, the fingers move more one after another,
    /// so that the air column always has one clear length; within a register they overlap, which clicks less.
    pub fn finger_share(&self) -> f64 {
        if self.registers.0 == self.registers.1 { 0.8 } else { 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_loud_leaps_down_get_a_dip() {
        let slur = |semitones: f64, registers: (u8, u8), place: f64| Slur {
            interval_cents: 100.0 * semitones,
            registers,
            place,
        };
        assert!(slur(-12.0, (2, 1), -0.6).dip(0.6).is_some());
        assert_eq!(slur(-12.0, (2, 1), -0.6).dip(0.45), None, "soft");
        assert_eq!(slur(-12.0, (2, 1), -0.2).dip(0.6), None, "high");
        assert_eq!(slur(12.0, (1, 2), 0.1).dip(0.9), None, "up");
        assert_eq!(slur(-2.0, (2, 2), 0.1).dip(0.9), None, "a step");
        assert!(slur(-11.0, (2, 2), 0.0).dip(0.9).unwrap().gamma > 0.3);
    }
}
