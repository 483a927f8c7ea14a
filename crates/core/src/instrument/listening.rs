//! Where the instrument is heard from, and the paths of sound from its sources to there.
//!
//! A source is a hole or the bell, see [`sound_sources`](crate::bore::sound_sources). A path gives its sound a delay and a
//! gain. Three ways to listen:
//!
//! - *Position*: what reaches a point in a room without walls. Delay and gain follow from the distance; the bell sounds
//!   as Levine & Schwinger (1948) found it for its angle. Two points make stereo.
//! - *Everywhere*: as many directions at once as give the power average. No sum of delayed sources is that average at every
//!   frequency, because it is one wave and the average is of powers. But delays that bend along the bore come close: where
//!   the sources act together, from 800 Hz up, their waves then meet in all phases, as they do on average over directions.
//!   [`EVERYWHERE`] was fitted to the average of transfer matrices over 41 fingerings (`docs/tone.md`; `chalumeau radiation`).
//! - *Point*: all flows in one point, as if the instrument were small against the wave.
//!
//! Left out: the shadow of the player and of the instrument, the floor and the walls.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::bore::instrument_file::MAX_HOLES;
use crate::bore::radiation::BELL_CORNER;
use crate::bore::sound_sources::SoundSources;
use crate::maths;
use crate::units::Air;

/// Most sources of an instrument: holes and bell.
pub const MAX_SOURCES: usize = MAX_HOLES + 1;
/// Delays of *Everywhere* over the time that sound takes along the bore: a polynomial without constant in the distance
/// from the end of the bell over the length, first to fourth power. Fitted by least squares to the power average in
/// decibels, 250 Hz to 7 kHz, of the fingerings of the built-in clarinet. Fitted to one half of them it is as good for the
/// other half.
pub const EVERYWHERE: [f64; 4] = [-2.14, 22.848, -53.436, 37.182];
/// Where the topmost hole was in that fit, over the length from the bell. Beyond, the polynomial says nothing.
const EVERYWHERE_ENDS: f64 = 0.767;
/// Angle between the instrument and the vertical, rad: 40 degrees, as teachers ask for.
const HELD_RAD: f64 = 0.698_131_7;
/// Nearest that a listener comes to a source, m: a microphone that does not touch it.
const NEAREST_M: f64 = 0.05;
/// The bell at angles from its axis, in steps of 30 degrees from 0 to 180: `1 + b s` over `1 + a s` with `s = j ka`, over a
/// point of the same flow. Fitted to the pattern of Levine & Schwinger times the power of [`bell_share`] up to `ka = 2.5`,
/// within 1.1 dB up to 60 degrees and 2.2 dB beyond.
///
/// [`bell_share`]: crate::bore::sound_sources::bell_share
const BELL: [(f64, f64); 7] =
    [(1.0, 0.453), (0.8, 0.463), (0.4, 0.538), (0.0, 0.779), (0.0, 1.059), (0.0, 1.007), (0.0, 0.712)];

/// Ways to listen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ListeningMode {
    /// The power average over all directions, as nearly as delays can.
    #[default]
    Everywhere,
    /// One or two places around the instrument.
    Position,
    /// All flows in one point.
    Point,
}

impl ListeningMode {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 3] = [Self::Everywhere, Self::Position, Self::Point];
}

/// Where the instrument is heard from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listening {
    /// How. Default [`ListeningMode::Everywhere`].
    pub mode: ListeningMode,
    /// Distance on the floor from the middle of the instrument, m, 0.2..=10. Default 1. The level is as at 1 m whatever the
    /// distance.
    pub distance_m: f32,
    /// Angle around the player, degrees, -180..=180: 0 in front, 90 at the player's right. Default 30.
    pub angle_deg: f32,
    /// Height above the middle of the instrument, m, -1..=2. Default 0.
    pub height_m: f32,
    /// Angle between the left and the right place as the player sees them, degrees, 0..=180. Default 60; without a
    /// right channel there is one place between the two.
    pub width_deg: f32,
}

/// One source on its way to one place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Path {
    /// Delay, s, 0 or more.
    pub delay_s: f64,
    /// Gain over that at 1 m, or at the distance of the middle.
    pub gain: f64,
}

/// All sources on their way to one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paths {
    /// Holes in the order of the file, then the bell; further ones are unused.
    pub paths: [Path; MAX_SOURCES],
    /// The bell's response, times `b` and `a` in `(1 + b s) / (1 + a s)`, s.
    pub bell_s: (f64, f64),
}

impl Default for Listening {
    fn default() -> Self {
        Self {
            mode: ListeningMode::Everywhere,
            distance_m: 1.0,
            angle_deg: 30.0,
            height_m: 0.0,
            width_deg: 60.0,
        }
    }
}

impl Listening {
    /// All flows in one point.
    pub fn point() -> Self {
        Self { mode: ListeningMode::Point, ..Self::default() }
    }

    /// The paths of *Point*: no delay at all. Real-time safe.
    pub fn in_one_point() -> Paths {
        Paths { paths: [Path { delay_s: 0.0, gain: 1.0 }; MAX_SOURCES], bell_s: (0.0, 0.0) }
    }

    /// The paths of *Everywhere*. Real-time safe.
    pub fn everywhere(sources: &SoundSources, air: &Air) -> Paths {
        let along_s = sources.length_m() / air.c;
        let mut paths = [Path::default(); MAX_SOURCES];
        for (path, from_bell_m) in paths.iter_mut().zip(sources.from_bell_m()) {
            let t = (from_bell_m / sources.length_m()).min(EVERYWHERE_ENDS);
            let delay = EVERYWHERE.iter().rev().fold(0.0, |sum, &factor| (sum + factor) * t);
            *path = Path { delay_s: delay * along_s, gain: 1.0 };
        }
        let count = sources.places_m.len();
        let earliest_s = paths.iter().take(count).map(|path| path.delay_s).fold(f64::INFINITY, f64::min);
        paths.iter_mut().take(count).for_each(|path| path.delay_s -= earliest_s);
        Paths { paths, bell_s: (0.0, sources.bell_radius_m / air.c / BELL_CORNER) }
    }

    /// The paths to the left (`side` -1), right (1) or only (0) place of *Position*. Real-time safe.
    pub fn position(&self, side: f64, sources: &SoundSources, air: &Air) -> Paths {
        let angle = (f64::from(self.angle_deg) + 0.5 * side * f64::from(self.width_deg)).to_radians();
        let distance_m = f64::from(self.distance_m);
        let ear = [distance_m * maths::cos(angle), distance_m * maths::sin(angle), f64::from(self.height_m)];
        // From the reed to the bell: forward and down.
        let axis = [maths::sin(HELD_RAD), 0.0, -maths::cos(HELD_RAD)];
        let length_m = sources.length_m();
        let to_ear = |place_m: f64| {
            let along = place_m - 0.5 * length_m;
            let way: [f64; 3] = std::array::from_fn(|n| ear[n] - along * axis[n]);
            let far_m = way.iter().map(|x| x * x).sum::<f64>().sqrt().max(NEAREST_M);
            let cosine = way.iter().zip(axis).map(|(x, a)| x * a).sum::<f64>() / far_m;
            (far_m, cosine.clamp(-1.0, 1.0))
        };
        let (middle_m, _) = to_ear(0.5 * length_m);
        let mut paths = [Path::default(); MAX_SOURCES];
        for (path, &place_m) in paths.iter_mut().zip(&sources.places_m) {
            let (far_m, _) = to_ear(place_m);
            // No source is further away than the middle by more than half the length, nor nearer.
            let delay_s = ((far_m - middle_m + 0.5 * length_m) / air.c).max(0.0);
            *path = Path { delay_s, gain: middle_m / far_m };
        }
        let (_, cosine) = to_ear(length_m);
        let (b, a) = bell(maths::acos(cosine));
        let unit_s = sources.bell_radius_m / air.c;
        Paths { paths, bell_s: (b * unit_s, a * unit_s) }
    }

    /// Longest delay that any way of listening may ask for, s.
    pub fn longest_s(sources: &SoundSources, air: &Air) -> f64 {
        let everywhere = Self::everywhere(sources, air);
        let used = everywhere.paths.iter().take(sources.places_m.len());
        used.map(|path| path.delay_s).fold(sources.length_m() / air.c, f64::max)
    }
}

impl Paths {
    /// What sources with these flows give at `f_hz`, as the flow of one point.
    pub fn heard(&self, f_hz: f64, flows: &[Complex64]) -> Complex64 {
        let s = Complex64::I * TAU * f_hz;
        let bell = (1.0 + self.bell_s.0 * s) / (1.0 + self.bell_s.1 * s);
        let last = flows.len() - 1;
        flows
            .iter()
            .zip(&self.paths)
            .enumerate()
            .map(|(source, (flow, path))| {
                let sent = if source == last { flow * bell } else { *flow };
                sent * path.gain * maths::complex::exp(-s * path.delay_s)
            })
            .sum()
    }
}

/// `b` and `a` of the bell at an angle from its axis, rad.
fn bell(angle_rad: f64) -> (f64, f64) {
    let at = (angle_rad.to_degrees() / 30.0).clamp(0.0, 6.0);
    let below = (at as usize).min(5);
    let part = at - below as f64;
    let ((b0, a0), (b1, a1)) = (BELL[below], BELL[below + 1]);
    (b0 + part * (b1 - b0), a0 + part * (a1 - a0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::instrument_file::InstrumentFile;
    use crate::bore::sound_sources::bell_share;

    fn built_in() -> (SoundSources, Air) {
        (SoundSources::of(&InstrumentFile::built_in()), Air::default())
    }

    const HERE: Listening = Listening {
        mode: ListeningMode::Position,
        distance_m: 1.0,
        angle_deg: 30.0,
        height_m: 0.0,
        width_deg: 60.0,
    };

    #[test]
    fn delays_are_those_of_the_distances() {
        let (sources, air) = built_in();
        // Straight in front of the bell's axis: the holes are as far behind the bell as they are along the bore.
        let distance_m = (5.0 * HELD_RAD.sin()) as f32;
        let height_m = (-5.0 * HELD_RAD.cos()) as f32;
        let on_axis = Listening { distance_m, height_m, angle_deg: 0.0, width_deg: 0.0, ..HERE };
        let paths = on_axis.position(0.0, &sources, &air).paths;
        let bell = paths[sources.places_m.len() - 1];
        for (path, from_bell_m) in paths.iter().zip(sources.from_bell_m()) {
            assert!(((path.delay_s - bell.delay_s) * air.c - from_bell_m).abs() < 1e-6);
        }
        // Half a length before the middle.
        let nearer = 5.0 - 0.5 * sources.length_m();
        assert!((bell.gain - 5.0 / nearer).abs() < 1e-6);
    }

    #[test]
    fn left_and_right_mirror_each_other_in_front_of_the_player() {
        let (sources, air) = built_in();
        let ahead = Listening { angle_deg: 0.0, ..HERE };
        let [left, right] = [-1.0, 1.0].map(|side| ahead.position(side, &sources, &air));
        for (left, right) in left.paths.iter().zip(&right.paths) {
            assert!((left.delay_s - right.delay_s).abs() < 1e-12 && (left.gain - right.gain).abs() < 1e-12);
        }
        let [left, right] = [-1.0, 1.0].map(|side| HERE.position(side, &sources, &air));
        assert!(left.paths[0].delay_s != right.paths[0].delay_s);
    }

    #[test]
    fn delays_stay_within_the_longest_wherever_one_listens() {
        let (sources, air) = built_in();
        let longest_s = Listening::longest_s(&sources, &air);
        for distance_m in [0.2, 0.5, 10.0] {
            for height_m in [-1.0, -0.3, 0.0, 2.0] {
                for angle_deg in [-180.0, -90.0, 0.0, 45.0] {
                    let here = Listening { distance_m, height_m, angle_deg, ..HERE };
                    let paths = here.position(1.0, &sources, &air).paths;
                    for path in &paths[..sources.places_m.len()] {
                        assert!((0.0..=longest_s).contains(&path.delay_s), "{path:?}");
                        assert!((0.01..=20.0).contains(&path.gain), "{path:?}");
                    }
                }
            }
        }
    }

    /// The mean over directions of the bell's power is what the bell gives in all.
    #[test]
    fn the_bells_directions_add_up_to_its_power() {
        for ka in [0.25, 0.5, 1.0, 1.5, 2.0] {
            let steps = 2_000;
            let mean: f64 = (0..steps)
                .map(|step| (1.0 - (2.0 * f64::from(step) + 1.0) / f64::from(steps)).acos())
                .map(|angle| {
                    let (b, a) = bell(angle);
                    (1.0 + (b * ka).powi(2)) / (1.0 + (a * ka).powi(2)) / f64::from(steps)
                })
                .sum();
            let off_db = 10.0 * (mean / bell_share(ka)).log10();
            assert!(off_db.abs() < 0.7, "ka {ka}: {off_db:.2} dB");
        }
    }
}
