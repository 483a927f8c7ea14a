//! Voicing: where the player puts the vocal tract's resonance, and how strong it is.
//!
//! Above the note the resonance is moderate and only flattens a little. On its way down to the note it grows strong, and from
//! there it takes the note along: a bend. Players do so with peaks of up to 60 MPa s/m3 (Chen, Smith & Wolfe 2009).

use super::known::Known;
use crate::dsp::smooth::smooth;
use crate::instrument::settings::Settings;
use crate::instrument::techniques::Tract;
use crate::instrument::vocal_tract::{TractCoeffs, TractResonance};
use crate::maths;

/// Time constant with which tongue and throat move, s.
pub const MOVE_S: f64 = 0.02;
/// A tract with less of its strength is open.
const OPEN: f64 = 1e-3;
/// Quality of the resonance: of 3, 5 and 8 the one whose bends are the steadiest (measured).
const QUALITY: f64 = 8.0;
/// Peak of the resonance over Zc, well above the note and from the note down: 9 and 59 MPa s/m3 on a B flat clarinet.
const PEAKS: (f64, f64) = (4.0, 25.0);
/// Interval above the note over which the peak grows, octaves: a fourth.
const NEAR_OCTAVES: f64 = 5.0 / 12.0;
/// Where the resonance must lie for a bend: interval of the resonance in semitones, and the bend that it makes, cents (mean of
/// written G5 and C6, measured).
const BENDS: [(f64, f64); 10] = [
    (7.0, -14.0),
    (3.6, -48.0),
    (2.6, -132.0),
    (1.5, -254.0),
    (0.4, -357.0),
    (-1.7, -490.0),
    (-3.8, -660.0),
    (-6.0, -826.0),
    (-8.1, -1_009.0),
    (-9.5, -1_130.0),
];

/// What a glissando asks of the vocal tract.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voiced {
    /// Pitch of the fingering that is bent, Hz on the clock of the bore.
    pub note_hz: f64,
    /// Interval of the resonance from it, octaves.
    pub octaves: f64,
    /// Strength, 0..=1.
    pub amount: f64,
    /// Quality of the resonance.
    pub quality: f64,
}

/// State of the vocal tract's muscles.
#[derive(Clone, Copy, Debug, Default)]
pub struct Voicing {
    /// Strength now, 0..=1.
    amount: f64,
    /// Interval of the resonance from the note now, octaves.
    octaves: f64,
    /// Its quality now.
    quality: f64,
    /// How near that is to the note, as of the last tick.
    near: f64,
    /// The interval as a ratio of frequencies, and how near it is.
    ratio: Known<f64, (f64, f64)>,
    /// The resonance at the rate of the bore.
    coeffs: Known<TractResonance, TractCoeffs>,
}

/// How near the resonance is to the note from above, 0..=1; 1 from the note down.
fn nearness(octaves: f64) -> f64 {
    smooth(1.0 - octaves / NEAR_OCTAVES)
}

/// Interval of the resonance, octaves, for a bend of so many cents; 0 and less.
pub fn octaves_for_bend(cents: f64) -> f64 {
    let right = BENDS[1..BENDS.len() - 1].partition_point(|&(_, bend)| bend > cents) + 1;
    let ((s0, c0), (s1, c1)) = (BENDS[right - 1], BENDS[right]);
    let way = ((cents - c0) / (c1 - c0)).clamp(0.0, 1.0);
    (s0 + way * (s1 - s0)) / 12.0
}

/// The bend, cents, that a resonance at an interval of so many octaves makes.
pub fn bend_for_octaves(octaves: f64) -> f64 {
    let semitones = 12.0 * octaves;
    let right = BENDS[1..BENDS.len() - 1].partition_point(|&(at, _)| at > semitones) + 1;
    let ((s0, c0), (s1, c1)) = (BENDS[right - 1], BENDS[right]);
    c0 + ((semitones - s0) / (s1 - s0)).clamp(0.0, 1.0) * (c1 - c0)
}

impl Voicing {
    /// How much the tract leads the reed, 0..=1.
    pub fn lead(&self) -> f64 {
        if self.amount == 0.0 { 0.0 } else { self.amount * self.near }
    }

    /// One tick, in which the tract goes a `share` of its way, for a note fingered at `note_hz` on the clock of the bore; `None`
    /// while the throat is open. `slides`: what a glissando asks; it goes before what is set. `rate_hz` never changes.
    pub fn tick(
        &mut self,
        settings: &Settings,
        note_hz: f64,
        slides: Option<Voiced>,
        share: f64,
        rate_hz: f64,
    ) -> Option<TractCoeffs> {
        let Tract { amount, interval_semitones } = settings.tract;
        let (amount, octaves) = match slides {
            Some(Voiced { octaves, amount, .. }) => (amount, octaves),
            None => (f64::from(amount), f64::from(interval_semitones) / 12.0),
        };
        let quality = slides.map_or(QUALITY, |voiced| voiced.quality);
        if self.amount < OPEN {
            // An open throat is anywhere at once.
            self.octaves = octaves;
            self.quality = quality;
            if amount == 0.0 {
                self.amount = 0.0;
                return None;
            }
        }
        self.amount += (amount - self.amount) * share;
        if slides.is_some() || amount > 0.0 {
            self.octaves += (octaves - self.octaves) * share;
        }
        self.quality += (quality - self.quality) * share;
        let (ratio, nearness) =
            self.ratio.of(self.octaves, |octaves| (maths::exp2(octaves), nearness(octaves)));
        self.near = nearness;
        let (far, near) = PEAKS;
        let peak = self.amount * (far + (near - far) * nearness);
        let hz = slides.map_or(note_hz, |voiced| voiced.note_hz) * ratio;
        let resonance = TractResonance { hz, q: self.quality, peak };
        Some(self.coeffs.of(resonance, |resonance| TractCoeffs::new(resonance, rate_hz)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instrument::player::step_towards;

    #[test]
    fn deeper_bends_need_a_lower_resonance_and_a_stronger_one() {
        let octaves: Vec<f64> = (0..120).map(|n| octaves_for_bend(f64::from(-10 * n))).collect();
        assert!(octaves.is_sorted_by(|above, below| above >= below), "{octaves:?}");
        assert!((octaves[0] - 7.0 / 12.0).abs() < 1e-9 && octaves[119] < -0.75);
        assert_eq!((nearness(0.5), nearness(0.0), nearness(-1.0)), (0.0, 1.0, 1.0));
        for bend in [-20.0, -300.0, -800.0, -1_100.0] {
            assert!((bend_for_octaves(octaves_for_bend(bend)) - bend).abs() < 1e-9);
        }
    }

    #[test]
    fn an_open_throat_is_no_tract() {
        let mut voicing = Voicing::default();
        let tuned =
            Settings { tract: Tract { amount: 1.0, interval_semitones: -5.0 }, ..Settings::default() };
        let share = step_towards(1.0 / 6_000.0, MOVE_S);
        let mut tick = |settings: &Settings| voicing.tick(settings, 440.0, None, share, 96_000.0);
        assert_eq!(tick(&Settings::default()), None);
        assert!((0..600).all(|_| tick(&tuned).is_some()));
        assert!((0..6_000).map(|_| tick(&Settings::default())).any(|tract| tract.is_none()));
    }
}
