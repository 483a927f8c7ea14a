//! Peaks of an impedance, and the frequencies at which a reed without inertia plays.

use std::ops::ControlFlow;

use num_complex::Complex64;

use super::TransferMatrix;
use crate::maths;
use crate::parallel;

/// Where peaks are looked for, Hz, and the grid of the search: a third of the narrowest resonance of a clarinet.
const SEARCH_HZ: (f64, f64, f64) = (20.0, 6_000.0, 2.0);

/// A maximum of the magnitude of an impedance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Frequency, Hz.
    pub f_hz: f64,
    /// |Z| there, over Zc of the nominal bore.
    pub mag_over_zc: f64,
    /// Quality factor, `-(f/2) d arg Z / df` at the maximum.
    pub q: f64,
}

impl TransferMatrix {
    /// The first `count` impedance peaks of a fingering, see [`find_peaks`].
    pub fn peaks(&self, open: &[bool], reed_volume_m3: f64, count: usize) -> Vec<Peak> {
        let scan = |f_hz| self.impedance(f_hz, open, reed_volume_m3);
        maxima(scan, |f_hz| self.between(f_hz, open, reed_volume_m3), count)
    }

    /// Impedance between the frequencies of the scan, from those kept: a cubic through the four nearest admittances, which
    /// bend only over the distance of two modes: closer to the peaks than the search for them (see the test).
    fn between(&self, f_hz: f64, open: &[bool], reed_volume_m3: f64) -> Complex64 {
        let (lowest, _, step) = SEARCH_HZ;
        let at = (f_hz - lowest) / step;
        let (first, part) = ((at.floor() - 1.0).max(0.0), at - (at.floor() - 1.0).max(0.0));
        (0..4_u8)
            .map(f64::from)
            .map(|n| {
                let others = (0..4_u8).map(f64::from).filter(|&other| other != n);
                let weight: f64 = others.map(|other| (part - other) / (n - other)).product();
                weight / self.impedance(lowest + step * (first + n), open, reed_volume_m3)
            })
            .sum::<Complex64>()
            .inv()
    }

    /// Works out the losses at every frequency that [`peaks`](Self::peaks) may look at, on all cores; `on` hears the share
    /// done and may end it, then the answer is `None`. Afterwards peaks of any fingering cost little.
    pub fn prepare_peaks(&self, on: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Option<()> {
        let (lowest, highest, step) = SEARCH_HZ;
        let steps = ((highest - lowest) / step) as usize;
        const BATCH: usize = 64;
        let batch = |batch: usize| {
            let own = (batch * BATCH..=steps).take(BATCH);
            own.for_each(|k| drop(self.keep(lowest + step * k as f64)));
        };
        on(0.0).is_continue().then_some(())?;
        parallel::each(steps / BATCH + 1, batch, on).map(drop)
    }

    /// The frequency nearest `near_hz` (as an interval, within an octave) where the phase of the impedance falls through
    /// zero, Hz, and Re Z/Zc there: where a reed without inertia plays, and the height its threshold needs.
    pub fn playing_frequency(&self, open: &[bool], reed_volume_m3: f64, near_hz: f64) -> Option<(f64, f64)> {
        let (lowest, highest, step) = SEARCH_HZ;
        let from = (near_hz / 2.0).max(lowest / 2.0);
        let to = (near_hz * 2.0).min(2.0 * highest);
        // On whole steps, so that every fingering shares the frequencies kept.
        let grid = ((from / step).floor() as usize..=(to / step).ceil() as usize).map(|k| k as f64 * step);
        let mut best: Option<f64> = None;
        let mut before: Option<(f64, f64)> = None;
        for f_hz in grid {
            let im = self.impedance(f_hz, open, reed_volume_m3).im;
            if let Some((f_before, im_before)) = before
                && im_before > 0.0
                && im <= 0.0
            {
                let (mut low, mut high) = (f_before, f_hz);
                while high - low > 1e-6 {
                    let middle = 0.5 * (low + high);
                    if self.loaded(&self.at(middle), open, reed_volume_m3).im > 0.0 {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let found = 0.5 * (low + high);
                let distance = |f_hz: f64| maths::log2(f_hz / near_hz).abs();
                if best.is_none_or(|best| distance(found) < distance(best)) {
                    best = Some(found);
                }
            }
            before = Some((f_hz, im));
        }
        let f_hz = best.filter(|best| maths::log2(best / near_hz).abs() <= 1.0)?;
        Some((f_hz, self.loaded(&self.at(f_hz), open, reed_volume_m3).re))
    }
}

/// First `count` maxima of |Z| between 20 Hz and 6 kHz of any impedance function of frequency in Hz, lowest first.
///
/// A scan every 2 Hz, then golden section to 0.001 Hz; maxima closer than about 4 Hz are taken as one. `z` is expected in
/// units of Zc of the nominal bore, as [`TransferMatrix::impedance`] gives it.
pub fn find_peaks(z: impl Fn(f64) -> Complex64, count: usize) -> Vec<Peak> {
    maxima(&z, &z, count)
}

/// As [`find_peaks`], with one function for the scan and one for the refinement.
fn maxima(scan: impl Fn(f64) -> Complex64, fine: impl Fn(f64) -> Complex64, count: usize) -> Vec<Peak> {
    let (lowest, highest, step) = SEARCH_HZ;
    let steps = ((highest - lowest) / step) as usize;
    let mut peaks = Vec::new();
    let mut last_two = [f64::INFINITY; 2];
    for k in 0..=steps {
        if peaks.len() == count {
            break;
        }
        let f_hz = lowest + step * k as f64;
        let here = maths::complex::norm(scan(f_hz));
        let [before, middle] = last_two;
        if middle > before && middle >= here {
            let f_hz = golden(|f_hz| maths::complex::norm(fine(f_hz)), f_hz - 2.0 * step, f_hz);
            // Wide enough for the rounding of the phase, narrow against any resonance.
            let h = 0.01;
            let turn = maths::complex::arg(fine(f_hz + h) / fine(f_hz - h));
            peaks.push(Peak {
                f_hz,
                mag_over_zc: maths::complex::norm(fine(f_hz)),
                q: -0.5 * f_hz * turn / (2.0 * h),
            });
        }
        last_two = [middle, here];
    }
    peaks
}

/// Maximum of a function with one maximum between `low` and `high`, to 0.0005 (golden section).
fn golden(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const RATIO: f64 = 0.618_033_988_749_894_8;
    let (mut a, mut b) = (high - RATIO * (high - low), low + RATIO * (high - low));
    let (mut value_a, mut value_b) = (value(a), value(b));
    while high - low > 1e-3 {
        if value_a > value_b {
            (high, b, value_b) = (b, a, value_a);
            a = high - RATIO * (high - low);
            value_a = value(a);
        } else {
            (low, a, value_a) = (a, b, value_b);
            b = low + RATIO * (high - low);
            value_b = value(b);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::super::tests::tube;
    use super::*;
    use crate::bore::instrument_file::InstrumentFile;
    use crate::units::{Air, cents};

    /// Peaks between the frequencies of the scan are those of the matrices themselves, also of a tube as long as a file may
    /// have, whose modes lie closest.
    #[test]
    fn interpolated_peaks_are_the_exact_ones() {
        let file = InstrumentFile::built_in();
        for (file, open) in [
            (file.clone(), file.fingerings[0].open.clone()),
            (file.clone(), file.fingerings[32].open.clone()),
            (file.scaled(2.0), file.fingerings[19].open.clone()),
            (tube(3.0, 0.012), Vec::new()),
        ] {
            let model = TransferMatrix::new(&file, Air::default());
            let exact = find_peaks(|f_hz| model.loaded(&model.at(f_hz), &open, 0.0), 3);
            let found = model.peaks(&open, 0.0, 3);
            assert_eq!((found.len(), exact.len()), (3, 3));
            for (found, exact) in found.iter().zip(&exact) {
                let off = cents(found.f_hz, exact.f_hz).abs();
                let (height, q) = (found.mag_over_zc / exact.mag_over_zc - 1.0, found.q / exact.q - 1.0);
                // Golden section itself stops at a thousandth of a hertz.
                assert!(off < 0.05 && height.abs() < 5e-5 && q.abs() < 1e-3, "{found:?} {exact:?}");
            }
        }
    }

    /// A resonance whose height, frequency and Q are known in closed form.
    #[test]
    fn peaks_of_a_known_resonance_are_found() {
        let resonance = |f_hz: f64, at_hz: f64, height: f64, q: f64| {
            height / Complex64::new(1.0, q * (f_hz / at_hz - at_hz / f_hz))
        };
        let peaks = find_peaks(|f_hz| resonance(f_hz, 440.3, 30.0, 40.0), 9);
        let [Peak { f_hz, mag_over_zc, q }] = peaks[..] else { panic!("{peaks:?}") };
        assert!((f_hz - 440.3).abs() < 1e-3 && (mag_over_zc - 30.0).abs() < 1e-6 && (q - 40.0).abs() < 0.01);
        let two = |f_hz| resonance(f_hz, 440.3, 30.0, 40.0) + resonance(f_hz, 1320.7, 20.0, 50.0);
        assert_eq!([find_peaks(two, 9).len(), find_peaks(two, 1).len(), find_peaks(two, 0).len()], [2, 1, 0]);
        assert!(find_peaks(|_| Complex64::new(f64::NAN, 0.0), 3).is_empty());
    }
}
