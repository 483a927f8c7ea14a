//! The bifurcation diagram of a note: its amplitude while the mouth pressure slowly rises and slowly falls.
//!
//! Gamma, mouth pressure over closing pressure, runs in a straight line from 0 to a maximum and back. Each point covers a
//! window of whole periods. It holds the rms of the pressure in the mouthpiece about its mean, over the closing pressure, and
//! the share of time in which the reed is shut, and how much of the sound is the note. The two ways differ where two states are stable. They also differ because a
//! moving ramp passes a threshold before the note has grown (Bergeot, Almeida, Vergez & Gazengel 2013); a slower ramp
//! passes it by less.

use crate::instrument::{BreathResponse, Clarinet, Model, Probe, Settings};
use crate::maths;
use crate::reed::motion::SHUT;
use crate::score::breath::BreathCurve;
use crate::score::{Score, play_probed};
use crate::units::SoundingNote;
use std::convert::Infallible;
use std::sync::Arc;

/// A note counts as sounding above this rms over the closing pressure: a hundredth of that of a loud note.
pub const SOUNDING_RMS: f64 = 0.01;
/// Silence before the ramp, s: the tongue leaves the reed, which then stands still.
const STILL_S: f64 = 0.1;
/// Shortest window, s.
const WINDOW_S: f64 = 0.02;
/// Below this share of power at the frequency of the note, another register sounds. A note has half and more, and six tenths of that
/// when it is a semitone off.
const OWN_SHARE: f64 = 0.05;
/// So many windows one after another are no beginning of a note, which has all frequencies.
const OTHER_WINDOWS: usize = 3;
/// The share is that of pieces of so many periods: longer ones would miss a note that is off, shorter ones hear another register.
const PIECE: f64 = 6.0;

/// One window of the ramp: a point of the diagram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RampPoint {
    /// Mean mouth pressure over closing pressure.
    pub gamma: f64,
    /// Rms of the pressure in the mouthpiece about its mean, over the closing pressure.
    pub rms: f64,
    /// Share of time in which the reed is shut, 0..=1.
    pub shut: f64,
    /// Share of the power of that pressure at the frequency of the note, 0..=1: near 0 where another register sounds.
    pub own: f64,
}

impl RampPoint {
    /// Whether the note sounds, and no other in its place.
    pub fn sounds(&self) -> bool {
        self.rms > SOUNDING_RMS && self.own > OWN_SHARE
    }
}

/// The amplitude of a note along both ways of the ramp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BifurcationDiagram {
    /// The way up: gamma rises.
    pub up: Vec<RampPoint>,
    /// The way down: gamma falls.
    pub down: Vec<RampPoint>,
}

/// Values of gamma at which the state of the note changes; `None` if it does not change within the ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transitions {
    /// Rising: the note begins.
    pub begins: Option<f64>,
    /// Rising: the reed begins to shut for a part of each period while the note sounds (beating).
    pub shuts: Option<f64>,
    /// Rising: the note chokes, because the reed stays shut, or gives way to another register.
    pub chokes: Option<f64>,
    /// Falling: a choked note sounds again.
    pub returns: Option<f64>,
    /// Falling: the reed no longer shuts.
    pub opens: Option<f64>,
    /// Falling: the note ends.
    pub ends: Option<f64>,
}

impl BifurcationDiagram {
    /// The values of gamma at which the note begins, the reed shuts, the note chokes, returns, opens and ends.
    pub fn transitions(&self) -> Transitions {
        let sounds = RampPoint::sounds;
        // What the tongue leaves behind fades; a note grows.
        let fading = self.up.windows(2).take_while(|pair| pair[1].rms < pair[0].rms).count();
        let begins = self.up.iter().skip(fading).position(sounds).map(|after| fading + after);
        let sounding = begins.map_or(&[][..], |begins| &self.up[begins..]);
        let shuts = sounding.iter().find(|point| point.shut > 0.0);
        // The first silent window after the last one that sounds.
        let chokes = sounding.iter().rposition(sounds).and_then(|last| sounding.get(last + 1));
        let returns = self.down.iter().position(sounds);
        let after = returns.map_or(&[][..], |returns| &self.down[returns..]);
        let opens = after.iter().rposition(|point| sounds(point) && point.shut > 0.0);
        let ends = after.iter().rposition(sounds).and_then(|last| after.get(last + 1));
        let gamma = |point: &RampPoint| point.gamma;
        Transitions {
            begins: sounding.first().map(gamma),
            shuts: shuts.map(gamma),
            chokes: chokes.map(gamma),
            // Only a choked note can return.
            returns: chokes.and(after.first()).map(gamma),
            opens: opens.and_then(|last| after.get(last + 1)).map(gamma),
            ends: ends.map(gamma),
        }
    }
}

impl BifurcationDiagram {
    /// Where another register sounds first: the direction of the ramp (1 or -1) and gamma; `None` if it never does for
    /// three windows one after another.
    pub fn other_register(&self) -> Option<(i8, f64)> {
        let is_other = |point: &RampPoint| point.rms > SOUNDING_RMS && !point.sounds();
        let first = |way: &[RampPoint]| {
            let found = way.windows(OTHER_WINDOWS).find(|points| points.iter().all(is_other))?;
            Some(found[0].gamma)
        };
        first(&self.up).map(|gamma| (1, gamma)).or_else(|| first(&self.down).map(|gamma| (-1, gamma)))
    }
}

/// Plays `note` while gamma goes from 0 to `gamma_max` and back, `seconds` each way, after a moment of silence. Allocates.
///
/// The breath is physical whatever `settings` say; they must let full breath reach `gamma_max` (`breath_full_kpa`). `rate` is the host's sample rate, Hz. `each` is
/// called after every block with its number of samples, to show progress.
pub fn measure(
    model: &Arc<Model>,
    settings: &Settings,
    note: SoundingNote,
    gamma_max: f32,
    seconds: f64,
    rate: u32,
    mut each: impl FnMut(usize),
) -> BifurcationDiagram {
    let mut clarinet = Clarinet::new(model.clone(), f64::from(rate));
    let settings = &Settings { breath_response: BreathResponse::Physical, ..*settings };
    clarinet.set_settings(settings);
    clarinet.reset();
    let swell = BreathCurve::swell(gamma_max, seconds).after(STILL_S);
    let score = Score::note(note, STILL_S + 2.0 * seconds, rate).blown(&swell, settings, rate);
    let inner_hz = clarinet.internal_rate_hz();
    let period = inner_hz / note.frequency_hz(f64::from(settings.a4_hz));
    let window = (period * (WINDOW_S * inner_hz / period).ceil()).round() as usize;
    let closing_pa = settings.closing_pa();
    let piece = Piece { samples: (PIECE * period).round() as usize, turn: std::f64::consts::TAU / period };
    let half = (seconds * inner_hz) as usize;
    let mut still = (STILL_S * inner_hz).round() as usize;
    let mut found = BifurcationDiagram::default();
    let (mut seen, mut inside) = (0_usize, Window::default());
    let mut probe = |probe: Probe| {
        if still > 0 {
            still -= 1;
            return;
        }
        inside.add(&probe, closing_pa, &piece);
        seen += 1;
        if inside.count == window {
            let point = std::mem::take(&mut inside).point();
            if seen <= half { found.up.push(point) } else { found.down.push(point) }
        }
    };
    let Ok(()) = play_probed(&mut clarinet, &score, 4096, &mut probe, |block| {
        each(block.len());
        Ok::<_, Infallible>(())
    });
    found
}

/// Sums over one window.
#[derive(Default)]
struct Window {
    count: usize,
    gamma: f64,
    sum: f64,
    squares: f64,
    shut: usize,
    /// Of the piece that has begun: samples, sum of the pressure, and sums of cosine and sine at the frequency of the note, alone and
    /// with the pressure.
    begun: usize,
    part: f64,
    wave: [f64; 2],
    at_note: [f64; 2],
    /// Of the pieces that are complete: power at the note, and how many they are.
    own: f64,
    pieces: usize,
}

/// A piece of a window: its samples, and the phase of the note from one to the next, radians.
struct Piece {
    samples: usize,
    turn: f64,
}

impl Window {
    fn add(&mut self, probe: &Probe, closing_pa: f64, piece: &Piece) {
        let p = probe.p_mouthpiece_pa / closing_pa;
        let phase = piece.turn * self.begun as f64;
        for (which, wave) in [maths::cos(phase), maths::sin(phase)].into_iter().enumerate() {
            self.wave[which] += wave;
            self.at_note[which] += p * wave;
        }
        self.part += p;
        self.begun += 1;
        if self.begun == piece.samples {
            self.complete();
        }
        self.count += 1;
        self.gamma += probe.gamma;
        self.sum += p;
        self.squares += p * p;
        self.shut += usize::from(probe.opening < SHUT);
    }

    /// Ends the piece that has begun.
    fn complete(&mut self) {
        let count = self.begun.max(1) as f64;
        let mean = self.part / count;
        let amplitude = |which: usize| 2.0 / count * (self.at_note[which] - mean * self.wave[which]);
        self.own += 0.5 * (amplitude(0).powi(2) + amplitude(1).powi(2));
        self.pieces += 1;
        (self.begun, self.part, self.wave, self.at_note) = (0, 0.0, [0.0; 2], [0.0; 2]);
    }

    fn point(mut self) -> RampPoint {
        let count = self.count.max(1) as f64;
        let mean = self.sum / count;
        let power = (self.squares / count - mean * mean).max(0.0);
        if self.pieces == 0 {
            // A low note: the window has fewer periods.
            self.complete();
        }
        let own = self.own / self.pieces as f64;
        RampPoint {
            gamma: self.gamma / count,
            rms: power.sqrt(),
            shut: self.shut as f64 / count,
            own: if power > 0.0 { (own / power).min(1.0) } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(gamma: f64, rms: f64, shut: f64) -> RampPoint {
        RampPoint { gamma, rms, shut, own: 0.8 }
    }

    #[test]
    fn changes_are_found_both_ways() {
        let found = BifurcationDiagram {
            up: vec![
                point(0.1, 0.0, 0.0),
                point(0.4, 0.2, 0.0),
                point(0.5, 0.3, 0.1),
                point(1.0, 0.5, 0.5),
                point(1.5, 0.0, 1.0),
            ],
            down: vec![
                point(1.4, 0.0, 1.0),
                point(1.0, 0.5, 0.5),
                point(0.45, 0.2, 0.0),
                point(0.35, 0.001, 0.0),
            ],
        };
        let changes = found.transitions();
        assert_eq!((changes.begins, changes.shuts, changes.chokes), (Some(0.4), Some(0.5), Some(1.5)));
        assert_eq!((changes.returns, changes.opens, changes.ends), (Some(1.0), Some(0.45), Some(0.35)));
        assert_eq!(BifurcationDiagram::default().transitions(), Transitions::default());
        // Another register in its place is not the note.
        let mut other = found.clone();
        other.up[3].own = 0.01;
        other.down[1].own = 0.01;
        let changes = other.transitions();
        assert_eq!((changes.chokes, changes.returns), (Some(1.0), Some(0.45)));
        assert_eq!(other.other_register(), None, "one window");
        other.up.iter_mut().for_each(|point| point.own = 0.01);
        assert_eq!(other.other_register(), Some((1, 0.4)));
        // The release of the tongue alone.
        let up = [0.04, 0.02, 0.005, 0.001].map(|rms| point(0.1, rms, 0.0)).to_vec();
        assert_eq!(BifurcationDiagram { up, down: Vec::new() }.transitions(), Transitions::default());
    }

    #[test]
    fn a_note_that_is_off_is_the_note_and_another_register_is_not() {
        // C7 at 96 kHz.
        let period = 96_000.0 / 1_864.66;
        let piece =
            Piece { samples: (PIECE * period).round() as usize, turn: std::f64::consts::TAU / period };
        let share = |ratio: f64| {
            let mut window = Window::default();
            for n in 0..1_956 {
                let p = 1.0 + 0.3 * maths::sin(ratio * piece.turn * f64::from(n));
                window.add(&Probe { p_mouthpiece_pa: p, ..Probe::default() }, 1.0, &piece);
            }
            window.point().own
        };
        assert!(share(1.0) > 0.99 && share(1.06) > 0.5 && share(0.966) > 0.8);
        for ratio in [1.0 / 3.0, 0.39, 0.6, 5.0 / 3.0] {
            assert!(share(ratio) < OWN_SHARE, "{ratio}: {}", share(ratio));
        }
    }

    #[test]
    fn a_low_note_begins_above_a_third_and_shuts_near_one_half_on_a_sharp_lay() {
        let model = Arc::new(Model::built_in(48_000.0).unwrap());
        let settings = Settings { breath_full_kpa: 20.0, lay: 0.0, ..Settings::physical() };
        let mut samples = 0;
        let found = measure(&model, &settings, SoundingNote(50), 0.8, 4.0, 48_000, |block| samples += block);
        assert_eq!(samples, 8 * 48_000 + 4_800);
        let first = found.up[0];
        // What is left is the bend of the breath where the ramp begins.
        assert!(first.rms < 1e-3 && first.shut == 0.0, "the tongue is not heard: {first:?}");
        let changes = found.transitions();
        let (begins, shuts, ends) = (changes.begins.unwrap(), changes.shuts.unwrap(), changes.ends.unwrap());
        assert!((1.0 / 3.0..0.5).contains(&begins), "{changes:?}");
        // Raman's string without losses: 1/2.
        assert!((0.44..0.52).contains(&shuts) && shuts > begins, "{changes:?}");
        assert!(ends < begins, "a ramp overtakes the threshold: {changes:?}");
        assert_eq!((changes.chokes, changes.returns), (None, None));
        let slow = measure(&model, &settings, SoundingNote(50), 0.8, 12.0, 48_000, |_| {}).transitions();
        assert!(
            slow.begins.unwrap() < begins && slow.ends.unwrap() > ends,
            "slower, less: {slow:?} {changes:?}"
        );
        let is_own = |point: &RampPoint| point.rms < 0.1 || point.own > 0.4;
        assert!(found.up.iter().chain(&found.down).all(is_own), "the fundamental is the strongest");
        let top = found.up.last().unwrap();
        assert!((0.7..=0.8).contains(&top.gamma) && top.rms > 0.4, "{top:?}");
    }
}
