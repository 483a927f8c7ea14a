//! Input impedance behind a reflectance measured in the time domain.
//!
//! A lattice answers a unit impulse of forward wave at the tip with backward waves `r[n]`; their transform is the
//! reflectance `R`, and `Z = (1 + R) / (1 - R) / y_tip`. The tip's admittance and Z refer to the characteristic
//! admittance of the instrument's nominal bore. Sample 0 is the answer within the same sample. What this
//! leaves out: an answer cut off before it has died away rings around the peaks. Hz.
//!
//! | symbol | here |
//! |---|---|
//! | R(f) | [`reflectance`] |
//! | Z(f)/Zc | [`Impedance::at`] |
//! | d ln Z / df = 2 R' / (1 - R^2) | zero real part: a peak; imaginary part: its Q |

use crate::bore::transfer_matrix::Peak;
use crate::maths;
use chalumeau_fft as fft;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Points of the transform that finds the peaks: 0.18 Hz apart at 96 kHz.
const POINTS: usize = 1 << 19;
/// Where peaks are looked for, Hz.
const SEARCH_HZ: (f64, f64) = (60.0, 6000.0);

/// Grid on which a cut-off is looked for, Hz: that of the reference it is tested against. A finer one would stop at dips of
/// a few hertz.
const CUTOFF_STEP_HZ: u32 = 10;

/// Cut-off of a lattice of open tone holes: the first frequency at which the reflectance below its first open hole gives
/// back less than half of the power, up to 6 kHz. `None` where it never does.
pub fn cutoff_hz(reflectance: impl Fn(f64) -> Complex64) -> Option<f64> {
    // Below, a reflectance of less than one half is no lattice's.
    let grid = (100..6_000).step_by(CUTOFF_STEP_HZ as usize).map(f64::from);
    grid.into_iter().find(|&f_hz| reflectance(f_hz).norm_sqr() < 0.5)
}

/// Exact value at `f_hz` of the transform of `response`: `sum r[n] exp(-2 pi j f n / rate)`.
pub fn reflectance(response: &[f64], rate_hz: f64, f_hz: f64) -> Complex64 {
    with_slope(response, rate_hz, f_hz).0
}

/// The reflectance and its derivative by frequency, 1/Hz.
fn with_slope(response: &[f64], rate_hz: f64, f_hz: f64) -> (Complex64, Complex64) {
    let (mut turn, step) = (Complex64::from(1.0), maths::complex::cis(-2.0 * PI * f_hz / rate_hz));
    let (mut sum, mut moment) = (Complex64::default(), Complex64::default());
    for (n, r) in response.iter().enumerate() {
        let term = turn * r;
        sum += term;
        moment += term * n as f64;
        turn *= step;
    }
    (sum, moment * Complex64::new(0.0, -2.0 * PI / rate_hz))
}

/// Input impedance of what answered an impulse.
#[derive(Clone, Debug)]
pub struct Impedance {
    response: Vec<f64>,
    rate_hz: f64,
    y_tip: f64,
    /// Reflectance at multiples of `bin_hz`.
    bins: Vec<Complex64>,
    bin_hz: f64,
}

impl Impedance {
    /// From the impulse response of the reflectance at a tip of admittance `y_tip` (over that of the reference bore,
    /// above 0). Allocates.
    pub fn from_ir(response: &[f64], rate_hz: f64, y_tip: f64) -> Self {
        let size = POINTS.max(response.len().next_power_of_two());
        let bins = fft::forward(response, size);
        Self { response: response.to_vec(), rate_hz, y_tip, bins, bin_hz: rate_hz / size as f64 }
    }

    /// `Z(f) / Zc`, exact at any frequency from 0 to half the rate.
    pub fn at(&self, f_hz: f64) -> Complex64 {
        self.behind(reflectance(&self.response, self.rate_hz, f_hz))
    }

    /// Spacing of [`grid`](Self::grid), Hz.
    pub fn bin_hz(&self) -> f64 {
        self.bin_hz
    }

    /// `Z / Zc` at 0, `bin_hz`, 2 `bin_hz` .. half the rate, for plots.
    pub fn grid(&self) -> impl Iterator<Item = Complex64> {
        self.bins.iter().map(|&r| self.behind(r))
    }

    /// First `count` maxima of |Z| from 60 Hz to 6 kHz, lowest first, each placed exactly.
    pub fn peaks(&self, count: usize) -> Vec<Peak> {
        let first = (SEARCH_HZ.0 / self.bin_hz).ceil() as usize;
        let last = ((SEARCH_HZ.1 / self.bin_hz) as usize).min(self.bins.len().saturating_sub(2));
        let size = |bin: usize| self.behind(self.bins[bin]).norm_sqr();
        (first.max(1)..=last)
            .filter(|&bin| size(bin - 1) < size(bin) && size(bin) >= size(bin + 1))
            .take(count)
            .map(|bin| self.peak_between((bin - 1) as f64 * self.bin_hz, (bin + 1) as f64 * self.bin_hz))
            .collect()
    }

    /// Halves the interval until the slope of |Z| changes sign within a millionth of a hertz.
    fn peak_between(&self, mut low_hz: f64, mut high_hz: f64) -> Peak {
        while high_hz - low_hz > 1e-6 {
            let middle_hz = 0.5 * (low_hz + high_hz);
            if self.log_slope(middle_hz).re > 0.0 { low_hz = middle_hz } else { high_hz = middle_hz }
        }
        let f_hz = 0.5 * (low_hz + high_hz);
        Peak {
            f_hz,
            mag_over_zc: maths::complex::norm(self.at(f_hz)),
            q: -0.5 * f_hz * self.log_slope(f_hz).im,
        }
    }

    fn log_slope(&self, f_hz: f64) -> Complex64 {
        let (r, slope) = with_slope(&self.response, self.rate_hz, f_hz);
        2.0 * slope / (1.0 - r * r)
    }

    fn behind(&self, r: Complex64) -> Complex64 {
        (1.0 + r) / (1.0 - r) / self.y_tip
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 96_000.0;

    /// A pipe of 150 samples there and back that returns -0.95: `Z = (1 - g z^-D) / (1 + g z^-D)`.
    fn pipe() -> Vec<f64> {
        let mut response = vec![0.0; 400];
        response[150] = -0.95;
        response
    }

    #[test]
    fn reflectance_of_an_echo_is_a_turning_phasor() {
        for f_hz in [0.0, 60.0, 1234.5, 20_000.0] {
            let expected = -0.95 * Complex64::cis(-2.0 * PI * f_hz * 150.0 / RATE_HZ);
            assert!((reflectance(&pipe(), RATE_HZ, f_hz) - expected).norm() < 1e-11);
        }
    }

    #[test]
    fn cutoff_is_where_half_of_the_power_stays_away() {
        // |R|^2 = 1 / (1 + (f/fc)^8): one half at fc.
        let reflectance = |f_hz: f64| Complex64::from((1.0 + (f_hz / 1234.0).powi(8)).powf(-0.5));
        assert_eq!(cutoff_hz(reflectance), Some(1240.0));
        assert_eq!(cutoff_hz(|_| Complex64::ONE), None);
    }

    #[test]
    fn grid_and_direct_sum_agree() {
        let impedance = Impedance::from_ir(&pipe(), RATE_HZ, 0.7);
        for (bin, z) in impedance.grid().enumerate().skip(1).step_by(4001) {
            assert!((z - impedance.at(bin as f64 * impedance.bin_hz())).norm() < 1e-8 * z.norm());
        }
    }

    #[test]
    fn peaks_of_a_pipe_stand_at_its_odd_multiples() {
        let y_tip = 1.3;
        let peaks = Impedance::from_ir(&pipe(), RATE_HZ, y_tip).peaks(6);
        assert_eq!(peaks.len(), 6);
        for (peak, odd) in peaks.iter().zip([1.0, 3.0, 5.0, 7.0, 9.0, 11.0]) {
            let f_hz = odd * RATE_HZ / 300.0;
            assert!((peak.f_hz - f_hz).abs() < 1e-5, "{peak:?}, expected {f_hz}");
            let height = (1.0 + 0.95) / (1.0 - 0.95) / y_tip;
            assert!((peak.mag_over_zc / height - 1.0).abs() < 1e-9, "{peak:?}, expected {height}");
            // R = g there: d ln Z / df = -4 pi j D g / rate / (1 - g^2).
            let q = 2.0 * PI * f_hz * 150.0 / RATE_HZ * 0.95 / (1.0 - 0.95f64.powi(2));
            assert!((peak.q / q - 1.0).abs() < 1e-6, "{peak:?}, expected Q {q}");
        }
    }

    /// Peaks that fall between samples, with losses that grow with frequency: the general search agrees.
    #[test]
    fn peaks_agree_with_the_search_over_any_impedance() {
        // A windowed-sinc echo at 171.37 samples, smoothed by a three-point average.
        let echo = |n: f64| {
            let x = n - 171.37;
            let sinc = (PI * x).sin() / (PI * x);
            if x.abs() < 32.0 { sinc * (0.5 * PI * x / 32.0).cos().powi(2) } else { 0.0 }
        };
        let response: Vec<f64> = (0..300)
            .map(|n| {
                -0.96
                    * (0.2 * echo(f64::from(n) - 1.0)
                        + 0.6 * echo(f64::from(n))
                        + 0.2 * echo(f64::from(n) + 1.0))
            })
            .collect();
        let impedance = Impedance::from_ir(&response, RATE_HZ, 1.0);
        let peaks = impedance.peaks(7);
        let searched = crate::bore::transfer_matrix::find_peaks(|f_hz| impedance.at(f_hz), 7);
        assert_eq!(peaks.len(), searched.len());
        for (peak, searched) in peaks.iter().zip(searched) {
            assert!((peak.f_hz - searched.f_hz).abs() < 2e-3, "{peak:?} {searched:?}");
            assert!((peak.mag_over_zc / searched.mag_over_zc - 1.0).abs() < 1e-6, "{peak:?} {searched:?}");
            assert!((peak.q / searched.q - 1.0).abs() < 1e-3, "{peak:?} {searched:?}");
        }
    }
}
