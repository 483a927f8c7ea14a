//! The ear: the player blows harder while the note is softer than it should be, and less while it is louder.
//!
//! Near its threshold a note grows and dies slowly: at the pressure that holds a soft clarion note, the note needs a second to
//! begin. Players push it and ease off as they hear it speak. Here the push is proportional to the distance, in
//! logarithms, of the amplitude in the mouthpiece from that of the steady note at the wanted dynamic, which was learnt
//! when the instrument was prepared. A steady note has no push. The ear also brings a note to its level on a reed or at a
//! bend for which nothing was learnt.

use super::dynamics::high;
use crate::maths;

/// Mouth over closing pressure for a distance of 1 neper. The amplitude grows by some 300 nepers a second and unit of mouth
/// pressure: a distance falls to 1/e in 25 ms.
const PUSH: f64 = 0.26;
/// A push raises the pressure up to here, over the closing pressure: above, notes speak at once by themselves, and
/// harder pushing would only be an accent.
const HARDEST: f64 = 0.60;
/// Both for a slur within a register: its note sounds already, and a harder push makes it louder on the way than either note. Measured.
const GENTLE: (f64, f64) = (0.16, 0.55);
/// Both for a note that begins as the breath rises out of nothing, where nothing asks for a quick beginning. Measured: with the push of a tongued
/// note, swells of written A4, A#4 and B5 began up to 8 dB louder than they went on; with this up to 4, and written B4 to E5 begin up to 60 ms
/// later. With 0.45 those began 0.2 s later.
const BREATHED: (f64, f64) = (0.12, 0.50);
/// Low notes grow more slowly, with fewer periods a second: between these places (written C4 and E3 of a B flat clarinet) the push grows by
/// this share, and the hardest by this much. Above, an eager push squeaks where the lip hardly damps the reed.
const LOW: (f64, f64) = (-0.6, -1.0);
/// See [`LOW`].
const LOW_PUSH: (f64, f64) = (1.2, 0.08);
/// The hardest for tongued notes, wholly from written E flat 6 on and not up to C6: their lower modes have lower thresholds, and a harder
/// push lets these in first. With 0.60 these are up to 2 dB louder.
const HIGH_HARDEST: f64 = 0.45;
/// Easing off takes away at most this share of the pressure: a note must not end.
const SOFTEST: f64 = 0.06;
/// Distances that count, nepers: much softer is only silence, much louder another note that has not yet ended.
const DISTANCES: (f64, f64) = (-1.0, 2.5);
/// Time over which the ear listens, periods of the lowest note.
const PERIODS: f64 = 1.5;
/// Amplitude below which there is nothing to hear, over the closing pressure.
const SILENCE: f64 = 1e-6;

/// How a note began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Begun {
    /// Behind the tongue.
    #[default]
    Tongued,
    /// With the tongue away, as the breath rose.
    Breathed,
    /// Slurred from another register.
    Slurred,
    /// Slurred within its register: it sounds already.
    SlurredWithin,
}

/// State of the ear.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ear {
    /// Mean square of the pressure in the mouthpiece, over the closing pressure squared.
    power: f64,
    /// How the note began.
    begun: Begun,
    /// The pressure that was heard last, over the closing pressure, and that before it.
    pressure: [f64; 2],
}

/// Share of the way that the ear goes in one tick of `tick_s` seconds on an instrument with this lowest note.
pub fn share(tick_s: f64, lowest_hz: f64) -> f64 {
    super::step_towards(tick_s, PERIODS / lowest_hz)
}

impl Ear {
    /// Hears the pressure in the mouthpiece at the end of a tick, over the closing pressure. `share` is that of
    /// [`share`].
    pub fn hear(&mut self, pressure: f64, share: f64) {
        self.power += (pressure * pressure - self.power) * share;
        self.pressure = [pressure, self.pressure[0]];
    }

    /// Amplitude now: root mean square over the closing pressure.
    pub fn amplitude(&self) -> f64 {
        self.power.sqrt()
    }

    /// Whether the pressure in the mouthpiece has just risen through zero.
    pub fn rises_through_zero(&self) -> bool {
        let [now, before] = self.pressure;
        before <= 0.0 && now > 0.0
    }

    /// A note begins.
    pub fn begin(&mut self, begun: Begun) {
        self.begun = begun;
    }

    /// Mouth over closing pressure with the push towards an amplitude, where `gamma` would hold it, for a
    /// note at this [place](super::dynamics::PlayerModel::place). Once a tick: a call would cost a voice an instruction a sample.
    #[inline]
    pub fn pushed(&self, gamma: f64, amplitude: f64, place: f64) -> f64 {
        let distance = 0.5
            * maths::ln((amplitude * amplitude).max(SILENCE * SILENCE) / self.power.max(SILENCE * SILENCE));
        let (push, hardest) = match self.begun {
            Begun::SlurredWithin => GENTLE,
            Begun::Breathed => BREATHED,
            Begun::Tongued | Begun::Slurred => (PUSH, HARDEST),
        };
        // Of the two halves of the compass one has low notes, the other high ones.
        let (push, hardest) = match self.begun {
            Begun::SlurredWithin => (push, hardest),
            Begun::Tongued | Begun::Breathed if place > 0.0 => {
                (push, hardest + (HIGH_HARDEST - hardest) * high(place))
            }
            _ => {
                let low = ((LOW.0 - place) / (LOW.0 - LOW.1)).clamp(0.0, 1.0);
                (push * (1.0 + LOW_PUSH.0 * low), hardest + LOW_PUSH.1 * low)
            }
        };
        let push = push * distance.clamp(DISTANCES.0, DISTANCES.1);
        (gamma + push).clamp((1.0 - SOFTEST) * gamma, gamma.max(hardest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_soft_note_is_pushed_a_loud_one_eased_a_right_one_left() {
        let hear = |amplitude: f64| {
            let mut ear = Ear::default();
            for n in 0..10_000 {
                ear.hear(amplitude * 2.0_f64.sqrt() * (0.3 * f64::from(n)).sin(), 0.02);
            }
            ear
        };
        let right = hear(0.1);
        assert!((right.amplitude() - 0.1).abs() < 2e-3);
        assert!((right.pushed(0.4, 0.1, 0.0) - 0.4).abs() < 3e-3);
        assert!((0.45..HARDEST).contains(&hear(0.05).pushed(0.4, 0.1, 0.0)));
        assert!((0.37..0.39).contains(&hear(0.2).pushed(0.4, 0.1, 0.0)));
        assert_eq!(Ear::default().pushed(0.4, 0.1, 0.0), HARDEST);
        assert_eq!(Ear::default().pushed(0.8, 0.5, 0.0), 0.8, "a loud note speaks by itself");
        assert_eq!(Ear::default().pushed(0.4, 0.1, 0.8), HIGH_HARDEST);
        let mut into_the_altissimo = Ear::default();
        into_the_altissimo.begin(Begun::Slurred);
        assert_eq!(into_the_altissimo.pushed(0.4, 0.1, 0.8), HARDEST);
        let mut slurred = hear(0.05);
        slurred.begin(Begun::SlurredWithin);
        assert!(slurred.pushed(0.4, 0.1, -1.0) < hear(0.05).pushed(0.4, 0.1, 0.0) - 0.05);
    }
}
