//! Where sound leaves an instrument, and what its sources give together to listeners all around.
//!
//! Every open hole and the bell is a point that sends out its flow `Q`. Far away and in all directions together they give
//! the power
//!
//! ```text
//! S = sum over i, j of Re(Q_i Q_j*) sin(k d_ij) / (k d_ij)
//! ```
//!
//! in units of what one point of flow 1 gives (`d_ij` their distance, `k` the wave number): sources close together add up
//! as pressures, sources far apart against the wavelength as powers. The bell is a point up to `ka = 1`; above it sends
//! less than a point would, by the share of [`bell_share`]. What this leaves out: the bodies of instrument and player,
//! the room, and that each source feels the pressure of the others.
//!
//! Places in m from the reed tip, flows in m3/s, frequencies in Hz.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::radiation::BELL_CORNER;
use crate::maths;
use crate::units::Air;

/// The sources of one instrument: its holes in the order of its file, then the bell.
#[derive(Clone, Debug, PartialEq)]
pub struct SoundSources {
    /// Places along the bore, m from the reed tip; the last is the end of the bell.
    pub places_m: Vec<f64>,
    /// Radius of the bell's end, m.
    pub bell_radius_m: f64,
}

impl SoundSources {
    /// Of an instrument. Allocates.
    pub fn of(file: &InstrumentFile) -> Self {
        let bell_radius_m = file.bore.last().map_or(file.nominal_radius_m, |segment| segment.r_end_m);
        let places_m = file.holes.iter().map(|hole| hole.x_m).chain([file.length_m()]).collect();
        Self { places_m, bell_radius_m }
    }

    /// From the tip to the end of the bell, m.
    pub fn length_m(&self) -> f64 {
        self.places_m.last().copied().unwrap_or_default()
    }

    /// Distance of each source from the end of the bell, m.
    pub fn from_bell_m(&self) -> impl Iterator<Item = f64> + '_ {
        self.places_m.iter().map(|place_m| self.length_m() - place_m)
    }

    /// What the sources with these flows (in their order) give at `f_hz` as the mean square over all directions: as one
    /// point whose flow has this square.
    pub fn power_average(&self, f_hz: f64, flows: &[Complex64], air: &Air) -> f64 {
        let k = TAU * f_hz / air.c;
        let bell = self.places_m.len() - 1;
        let share = bell_share(k * self.bell_radius_m).sqrt();
        let weight = |source: usize| if source == bell { share } else { 1.0 };
        let mut sum = 0.0;
        for (i, (a, place_a)) in flows.iter().zip(&self.places_m).enumerate() {
            sum += (weight(i) * a).norm_sqr();
            for (j, (b, place_b)) in flows.iter().zip(&self.places_m).enumerate().take(i) {
                let turns = k * (place_a - place_b).abs();
                let together = if turns < 1e-6 { 1.0 } else { maths::sin(turns) / turns };
                sum += 2.0 * weight(i) * weight(j) * (a * b.conj()).re * together;
            }
        }
        sum
    }
}

/// Power that an unflanged end gives over that of a point of the same flow, at `ka` (wave number times radius): the real
/// part of its radiation impedance over the limit at low frequencies.
pub fn bell_share(ka: f64) -> f64 {
    1.0 / (1.0 + (ka / BELL_CORNER).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(apart_m: f64) -> SoundSources {
        SoundSources { places_m: vec![0.0, apart_m], bell_radius_m: 1e-6 }
    }

    /// The formula against the mean over directions, done by brute force.
    #[test]
    fn the_power_average_is_the_mean_over_directions() {
        let air = Air::default();
        let sources = SoundSources { places_m: vec![0.1, 0.17, 0.3, 0.45, 0.6], bell_radius_m: 1e-6 };
        let flows: Vec<Complex64> =
            (0..5).map(|n| Complex64::from_polar(1.0 + 0.3 * f64::from(n), 1.7 * f64::from(n * n))).collect();
        for f_hz in [50.0, 700.0, 1_500.0, 4_000.0] {
            let k = TAU * f_hz / air.c;
            let steps = 20_000;
            let mean: f64 = (0..steps)
                .map(|step| -1.0 + (2.0 * f64::from(step) + 1.0) / f64::from(steps))
                .map(|cosine| {
                    let pressure: Complex64 = sources
                        .places_m
                        .iter()
                        .zip(&flows)
                        .map(|(place_m, flow)| flow * Complex64::cis(k * cosine * place_m))
                        .sum();
                    pressure.norm_sqr() / f64::from(steps)
                })
                .sum();
            let formula = sources.power_average(f_hz, &flows, &air);
            assert!((formula / mean - 1.0).abs() < 1e-6, "{f_hz} Hz: {formula} {mean}");
        }
    }

    #[test]
    fn close_sources_add_pressures_and_far_ones_powers() {
        let air = Air::default();
        let alike = [Complex64::ONE, Complex64::ONE];
        let opposed = [Complex64::ONE, -Complex64::ONE];
        assert!((two(0.001).power_average(100.0, &alike, &air) - 4.0).abs() < 1e-4);
        assert!(two(0.001).power_average(100.0, &opposed, &air) < 1e-4);
        for flows in [alike, opposed] {
            assert!((two(10.0).power_average(2_000.0, &flows, &air) - 2.0).abs() < 0.01);
        }
    }
}
