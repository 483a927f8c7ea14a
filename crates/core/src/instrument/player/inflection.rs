//! Scoop and fall: how the pitch comes to a tongued note from below, and leaves it when the last key comes up.
//!
//! Both are bends that the player makes by himself: the lip as far as it reaches, beyond it the clock. Behind the tongue the pitch
//! goes to where the note begins, and rises from when the breath lets the note speak. A fall keeps the breath, which fades with
//! the pitch; then the tongue ends the note. The pitch comes back when nothing is heard any more, or behind the next tongue.

use crate::dsp::smooth::smooth;
use crate::instrument::articulation::Articulation;
use crate::instrument::slap::BREATH_GAMMA;

/// Time in which the pitch goes where the note begins, behind the tongue, s: as quick as the fingers there.
const PREPARE_S: f64 = 0.005;
/// Time for which the pitch of a fall stays when the note has ended, s, and in which it then comes back: the air column has
/// rung out.
const STAY_S: f64 = 0.25;
const RETURN_S: f64 = 0.1;
/// Mouth over closing pressure below which a note that ends does not fall, and a fall ends: it has faded already. No note holds there.
const FADED_GAMMA: f64 = 0.2;

/// What the pitch does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Phase {
    /// It is the note's.
    #[default]
    Steady,
    /// The tongue holds the reed: it goes to where the note begins.
    Prepares,
    /// It rises to the note.
    Rises,
    /// It falls from the note, and the breath fades.
    Falls,
    /// The note that fell rings out.
    Stays,
    /// It comes back unheard.
    Returns,
}

/// What the player adds to the pitch of a note where it begins or ends.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inflection {
    phase: Phase,
    /// From where to where, cents, and the time of the way.
    from: f64,
    to: f64,
    length_s: f64,
    passed_s: f64,
}

impl Inflection {
    /// A note is tongued. Real-time safe.
    pub fn begin(&mut self, articulation: &Articulation) {
        if articulation.scoop_cents > 0.0 || self.phase != Phase::Steady {
            self.go(Phase::Prepares, -f64::from(articulation.scoop_cents), PREPARE_S);
        }
    }

    /// The last key has come up on a mouth over closing pressure of `gamma`; whether the note falls. Real-time safe.
    pub fn fall(&mut self, articulation: &Articulation, gamma: f64) -> bool {
        let falls = articulation.fall_cents > 0.0 && gamma > FADED_GAMMA;
        if falls {
            self.go(Phase::Falls, -f64::from(articulation.fall_cents), articulation.fall_s.into());
        }
        falls
    }

    /// A falling note has been cut off. Real-time safe.
    pub fn cut(&mut self) {
        if self.is_falling() {
            *self = Self::default();
        }
    }

    /// The same for a player on another instrument, who does not take over a note that ends.
    pub fn carried(&self) -> Self {
        match self.phase {
            Phase::Prepares | Phase::Rises => *self,
            _ => Self::default(),
        }
    }

    /// Whether a note falls, so that the breath goes on without a key.
    pub fn is_falling(&self) -> bool {
        self.phase == Phase::Falls
    }

    /// What the pitch has over that of the note, cents.
    pub fn cents(&self) -> f64 {
        if self.phase == Phase::Steady { 0.0 } else { self.from + (self.to - self.from) * self.way() }
    }

    /// Share of its dynamic that the breath keeps, 0..=1.
    pub fn fade(&self) -> f64 {
        if self.is_falling() { 1.0 - self.share() } else { 1.0 }
    }

    /// One tick; true when a fall has ended. Real-time safe.
    #[inline(always)] // most of the time the pitch is the note's
    pub fn tick(&mut self, tongue_holds: bool, gamma: f64, articulation: &Articulation, tick_s: f64) -> bool {
        self.phase != Phase::Steady && self.go_on(tongue_holds, gamma, articulation, tick_s)
    }

    #[inline(never)]
    fn go_on(&mut self, tongue_holds: bool, gamma: f64, articulation: &Articulation, tick_s: f64) -> bool {
        self.passed_s += tick_s;
        let arrived = self.passed_s >= self.length_s;
        match self.phase {
            Phase::Prepares if arrived && !tongue_holds && gamma > BREATH_GAMMA => {
                self.go(Phase::Rises, 0.0, articulation.scoop_s.into());
            }
            Phase::Rises | Phase::Returns if arrived => *self = Self::default(),
            // Without breath the note has ended; breath that came back would sound it without a key.
            Phase::Falls if arrived || gamma < FADED_GAMMA => {
                self.go(Phase::Stays, self.to, STAY_S);
                return true;
            }
            Phase::Stays if arrived => self.go(Phase::Returns, 0.0, RETURN_S),
            _ => {}
        }
        false
    }

    fn go(&mut self, phase: Phase, to: f64, length_s: f64) {
        *self = Self { phase, from: self.cents(), to, length_s, passed_s: 0.0 };
    }

    /// Share of the time that has passed, 0..=1.
    fn share(&self) -> f64 {
        (self.passed_s / self.length_s).min(1.0)
    }

    /// Share of the way that has been gone: without a kink at either end.
    fn way(&self) -> f64 {
        smooth(self.share())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 16.0 / 96_000.0;

    #[test]
    fn no_pitch_jumps_whatever_comes_after_what() {
        let asked = Articulation {
            scoop_cents: 300.0,
            scoop_s: 0.1,
            fall_cents: 1_200.0,
            fall_s: 0.3,
            ..Articulation::default()
        };
        let mut inflection = Inflection::default();
        let (mut before, mut steepest, mut ended) = (0.0_f64, 0.0_f64, Vec::<usize>::new());
        for n in 0..12_000_usize {
            match n {
                // A note, its fall, a note in the midst of the fall, a fall in the midst of its scoop, and a long rest.
                0 | 2_000 => inflection.begin(&asked),
                1_000 | 2_200 => assert!(inflection.fall(&asked, 0.5)),
                _ => {}
            }
            let holds = n < 48 || (2_000..2_048).contains(&n);
            if inflection.tick(holds, 0.5, &asked, TICK_S) {
                ended.push(n);
            }
            assert!((0.0..=1.0).contains(&inflection.fade()));
            steepest = steepest.max((inflection.cents() - before).abs());
            before = inflection.cents();
        }
        assert!(steepest > 1.0 && steepest < 60.0, "{steepest} cents a tick before the tuning's own lag");
        assert_eq!((inflection.phase, inflection.cents()), (Phase::Steady, 0.0));
        assert!(
            ended.len() == 1 && (3_998..4_003).contains(&ended[0]),
            "the first fall was cut off: {ended:?}"
        );
    }

    #[test]
    fn a_fall_ends_with_its_breath() {
        let asked = Articulation { fall_cents: 400.0, fall_s: 2.0, ..Articulation::default() };
        let mut inflection = Inflection::default();
        assert!(inflection.fall(&asked, 0.5) && !inflection.tick(false, 0.5, &asked, TICK_S));
        assert!(inflection.tick(false, 0.1, &asked, TICK_S) && !inflection.is_falling());
    }

    #[test]
    fn without_scoop_and_fall_nothing_is_prepared() {
        let none = Articulation::default();
        let mut inflection = Inflection::default();
        inflection.begin(&none);
        assert!(!inflection.fall(&none, 0.5));
        assert_eq!((inflection.phase, inflection.cents(), inflection.fade()), (Phase::Steady, 0.0, 1.0));
        let falls = Articulation { fall_cents: 100.0, ..none };
        assert!(!inflection.fall(&falls, 0.1), "a note that has faded does not fall");
    }
}
