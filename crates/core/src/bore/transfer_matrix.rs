//! The instrument in the frequency domain: input impedance of any fingering, its peaks, and the frequencies and thresholds
//! at which a reed plays it.
//!
//! The bore is a chain of short lossy cylinders (plane waves; Zwikker & Kosten 1949, thermal and viscous boundary layers
//! with Bessel functions), tone holes are T junctions with the length corrections of Dubos et al. (1999) and a lossy
//! chimney, closed by a rigid wall or radiating as an unflanged pipe; the bell radiates likewise, and steps carry the
//! discontinuity mass attributed to Taillard. Equations are those of openwind 0.12.4's transfer-matrix method, which the
//! tests use as the oracle. Left out: pads above open holes, interaction of holes outside, curvature of the wave front in
//! the bell, nonlinear losses. This is the slow reference for the lattice in the time domain; SI units, 1 Hz to 20 kHz.
//!
//! | symbol | identifier |
//! |---|---|
//! | Gamma, propagation constant, 1/m | `gamma` |
//! | Zc, characteristic impedance with losses, Pa s/m3 | `z_c` |
//! | t_i, t_a, inner and series length correction of a hole, m | `inner_m`, `series_m` |
//! | b, a, h: radii of hole and bore, chimney height, m | `radius_m`, `bore_radius_m`, `chimney_m` |
//! | Z/Zc of the nominal bore | `over_zc` |

mod outflow;
mod peaks;
mod standing;
mod survey;

use crate::bore::bessel::bessel_ratio;
pub use peaks::{Peak, find_peaks};
pub use survey::Resonance;

use std::collections::HashMap;
use std::f64::consts::PI;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::PoisonError;

use num_complex::Complex64;

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::radiation;
use crate::bore::tone_hole::series_correction_m;
use crate::maths;
use crate::units::Air;

const J: Complex64 = Complex64::new(0.0, 1.0);
/// Longest cylinder a cone is cut into, m, and its largest change of radius, m. Halving both moves no peak of the
/// built-in clarinet by 0.1 cent (a test holds it to that).
const PIECE: (f64, f64) = (2.5e-3, 2e-4);
/// Frequencies kept; 8192 of them take about 25 MB for 24 holes.
const KEPT: usize = 8192;
/// One instrument in one air, in the frequency domain. Threads may share it.
///
/// ```
/// use chalumeau_core::bore::{instrument_file::InstrumentFile, transfer_matrix::TransferMatrix};
/// use chalumeau_core::units::Air;
///
/// let clarinet = InstrumentFile::built_in();
/// let matrix = TransferMatrix::new(&clarinet, Air::default());
/// let closed = vec![false; clarinet.holes.len()];
/// let z = matrix.impedance(440.0, &closed, clarinet.reed_volume_m3);
/// // A passive instrument: the real part of the impedance is positive.
/// assert!(z.re > 0.0);
/// ```
#[derive(Debug)]
pub struct TransferMatrix {
    air: Air,
    /// Distinct radii of bore pieces and chimneys, m; losses are worked out once for each.
    radii_m: Vec<f64>,
    /// Main bore above, between and below the holes: `[holes + 1][piece]`, reed to bell.
    spans: Vec<Vec<Piece>>,
    holes: Vec<Hole>,
    bell_radius_m: f64,
    /// Bore that impedances are over the Zc of, m.
    nominal_radius_m: f64,
    kept: Mutex<HashMap<u64, Arc<AtFrequency>>>,
}

#[derive(Clone, Copy, Debug)]
enum Piece {
    Cylinder {
        radius: usize,
        length_m: f64,
    },
    /// A jump in radius: acoustic mass, kg/m4.
    Step {
        mass: f64,
    },
}

#[derive(Clone, Copy, Debug)]
struct Hole {
    /// Index of the chimney's radius and, just upstream, the bore's.
    radius: usize,
    bore_radius: usize,
    chimney_m: f64,
    /// Mass under the chimney, kg/m4.
    shunt_mass: f64,
    /// Half the (negative) series mass of the junction, kg/m4.
    series_mass: f64,
}

/// Everything of the instrument that does not depend on the fingering, at one frequency.
#[derive(Debug)]
struct AtFrequency {
    omega: f64,
    /// One for each span, never empty; the series masses of the holes at its ends are included.
    spans: Box<[Matrix]>,
    /// Shunt admittance of each hole, `[closed, open]`, m3/(Pa s).
    shunts: Box<[[Complex64; 2]]>,
    /// Flow outside each open hole over that into its chimney.
    chimneys: Box<[Complex64]>,
    /// Lossy characteristic impedance of the bore at each hole, Pa s/m3.
    bore_z_c: Box<[Complex64]>,
    bell: Complex64,
}

/// Maps pressure and flow at the downstream end to those at the upstream end.
#[derive(Clone, Copy, Debug)]
struct Matrix {
    pp: Complex64,
    pu: Complex64,
    up: Complex64,
    uu: Complex64,
}

impl TransferMatrix {
    /// Cuts an instrument into elements. Holes on a step sit on its upstream side. Allocates.
    pub fn new(file: &InstrumentFile, air: Air) -> Self {
        Self::with_pieces(file, air, PIECE)
    }

    fn with_pieces(file: &InstrumentFile, air: Air, (longest_m, widest_m): (f64, f64)) -> Self {
        let mut radii_m = Vec::new();
        let mut radius_index = |radius_m: f64| {
            radii_m.iter().position(|&known| known == radius_m).unwrap_or_else(|| {
                radii_m.push(radius_m);
                radii_m.len() - 1
            })
        };
        let mut holes = Vec::with_capacity(file.holes.len());
        for hole in &file.holes {
            let (b, a) = (hole.radius_m, file.radius_at(hole.x_m));
            let (inner_m, series_m) = hole_corrections_m(a, b);
            holes.push(Hole {
                radius: radius_index(b),
                bore_radius: radius_index(a),
                chimney_m: hole.chimney_m,
                shunt_mass: air.rho * inner_m / (PI * b * b),
                series_mass: 0.5 * air.rho * series_m / (PI * a * a),
            });
        }
        let mut spans = vec![Vec::new()];
        let mut waiting = file.holes.iter().map(|hole| hole.x_m).peekable();
        let mut upstream_radius_m: Option<f64> = None;
        for segment in &file.bore {
            let radius_m = |x_m: f64| {
                let along = (x_m - segment.x_start_m) / (segment.x_end_m - segment.x_start_m);
                segment.r_start_m + (segment.r_end_m - segment.r_start_m) * along
            };
            if let Some(mass) = upstream_radius_m.and_then(|left| step_mass(left, segment.r_start_m, air.rho))
            {
                push(&mut spans, Piece::Step { mass });
            }
            upstream_radius_m = Some(segment.r_end_m);
            let mut from_m = segment.x_start_m;
            while from_m < segment.x_end_m {
                let hole_m = waiting.next_if(|&x_m| x_m <= segment.x_end_m);
                let to_m = hole_m.unwrap_or(segment.x_end_m).max(from_m);
                let (r_from, r_to) = (radius_m(from_m), radius_m(to_m));
                let pieces = if (r_to - r_from).abs() < 1e-9 {
                    1.0
                } else {
                    ((to_m - from_m) / longest_m).max((r_to - r_from).abs() / widest_m).ceil().max(1.0)
                };
                if to_m > from_m {
                    for piece in 0..pieces as usize {
                        let middle = (piece as f64 + 0.5) / pieces;
                        let radius = radius_index(r_from + (r_to - r_from) * middle);
                        push(&mut spans, Piece::Cylinder { radius, length_m: (to_m - from_m) / pieces });
                    }
                }
                if hole_m.is_some() {
                    spans.push(Vec::new());
                }
                from_m = to_m;
            }
            // Holes at the very end of the segment, on the upstream side of a step.
            while waiting.next_if(|&x_m| x_m <= segment.x_end_m).is_some() {
                spans.push(Vec::new());
            }
        }
        // A hole past the end, which `InstrumentFile::parse` refuses, sits at the bell.
        spans.resize_with(holes.len() + 1, Vec::new);
        let bell_radius_m = file.bore.last().map_or(file.nominal_radius_m, |segment| segment.r_end_m);
        let nominal_radius_m = file.nominal_radius_m;
        Self { air, radii_m, spans, holes, bell_radius_m, nominal_radius_m, kept: Mutex::default() }
    }

    /// Input impedance at the reed tip over Zc of the instrument's nominal bore.
    ///
    /// `f_hz` is taken into 0.1 Hz..100 kHz. `open[hole]` in the order of the file, missing ones closed. A reed volume
    /// above 0 (m3) is put in parallel at the tip. The first 8192 different frequencies are kept, so that a grid of
    /// frequencies costs its losses once for all fingerings.
    pub fn impedance(&self, f_hz: f64, open: &[bool], reed_volume_m3: f64) -> Complex64 {
        self.loaded(&self.keep(f_hz), open, reed_volume_m3)
    }

    /// Pressure reflectance at a plane just upstream of a hole of all that lies below: the reflected over the arriving
    /// wave in the bore of the radius there. `|R|^2` falling to 1/2 is the cut-off of the tone-hole lattice when
    /// `hole_index` is the first open one. An index beyond the last hole gives the bell at the end of the bore.
    pub fn reflectance_below(&self, f_hz: f64, open: &[bool], hole_index: usize) -> Complex64 {
        let at = self.keep(f_hz);
        let (pressure, flow) = at.above(open, hole_index);
        match (at.bore_z_c.get(hole_index), self.holes.get(hole_index)) {
            (Some(z_c), Some(hole)) => {
                let pressure = pressure + J * at.omega * hole.series_mass * flow;
                (pressure - z_c * flow) / (pressure + z_c * flow)
            }
            _ => {
                let z_c = losses(at.omega, self.bell_radius_m, &self.air).z_c;
                (at.bell - z_c) / (at.bell + z_c)
            }
        }
    }

    /// As [`impedance`](Self::impedance) without reed volume, with a resistance (Pa s/m3) in series with each open hole,
    /// as the jets of a large oscillation put there. `flows[hole]` becomes the flow into that hole per pascal at the tip.
    pub fn impedance_with_jets(
        &self,
        f_hz: f64,
        open: &[bool],
        resistances: &[f64],
        flows: &mut [Complex64],
    ) -> Complex64 {
        let at = self.keep(f_hz);
        let (mut pressure, mut flow) = (at.bell, Complex64::ONE);
        flows.fill(Complex64::ZERO);
        for hole in (0..at.shunts.len()).rev() {
            (pressure, flow) = at.spans[hole + 1].apply(pressure, flow);
            let is_open = open.get(hole).copied().unwrap_or(false);
            let mut shunt = at.shunts[hole][usize::from(is_open)];
            if is_open {
                shunt /= 1.0 + shunt * resistances.get(hole).copied().unwrap_or(0.0);
                if let Some(into) = flows.get_mut(hole) {
                    *into = pressure * shunt;
                }
            }
            flow += pressure * shunt;
        }
        (pressure, flow) = at.spans[0].apply(pressure, flow);
        flows.iter_mut().for_each(|into| *into /= pressure);
        pressure / flow / self.air.z_c(self.nominal_radius_m)
    }

    /// Z/Zc at the tip with the reed volume in parallel.
    fn loaded(&self, at: &AtFrequency, open: &[bool], reed_volume_m3: f64) -> Complex64 {
        let z_c = self.air.z_c(self.nominal_radius_m);
        let (pressure, flow) = at.above(open, 0);
        let (pressure, mut flow) = at.spans[0].apply(pressure, flow);
        if reed_volume_m3 > 0.0 {
            flow += pressure * J * at.omega * reed_volume_m3 / (self.air.rho * self.air.c * self.air.c);
        }
        pressure / flow / z_c
    }

    fn keep(&self, f_hz: f64) -> Arc<AtFrequency> {
        // A panic elsewhere leaves the map whole: entries are only ever inserted complete.
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().get(&f_hz.to_bits()) {
            return known.clone();
        }
        let fresh = Arc::new(self.at(f_hz));
        let mut kept = lock();
        if kept.len() < KEPT {
            kept.insert(f_hz.to_bits(), fresh.clone());
        }
        fresh
    }

    fn at(&self, f_hz: f64) -> AtFrequency {
        let omega = TAU * if f_hz > 0.1 { f_hz.min(1e5) } else { 0.1 };
        let losses: Vec<Losses> =
            self.radii_m.iter().map(|&radius_m| losses(omega, radius_m, &self.air)).collect();
        let series = |hole: Option<&Hole>| J * omega * hole.map_or(0.0, |hole| hole.series_mass);
        let spans = self.spans.iter().enumerate().map(|(index, pieces)| {
            let above = index.checked_sub(1).and_then(|hole| self.holes.get(hole));
            let chain = pieces.iter().fold(Matrix::series(series(above)), |chain, piece| {
                chain.then(match *piece {
                    Piece::Cylinder { radius, length_m } => losses[radius].cylinder(length_m),
                    Piece::Step { mass } => Matrix::series(J * omega * mass),
                })
            });
            chain.then(Matrix::series(series(self.holes.get(index))))
        });
        let shunts = self.holes.iter().map(|hole| {
            let Losses { gamma, z_c } = losses[hole.radius];
            let z_rad = radiation::impedance(omega, self.radii_m[hole.radius], &self.air);
            let tanh = tanh(gamma * hole.chimney_m);
            let under = J * omega * hole.shunt_mass;
            let chimney_open = z_c * (z_rad + z_c * tanh) / (z_c + z_rad * tanh);
            [(z_c / tanh + under).inv(), (chimney_open + under).inv()]
        });
        let chimneys = self.holes.iter().map(|hole| {
            let z_rad = radiation::impedance(omega, self.radii_m[hole.radius], &self.air);
            let chimney = losses[hole.radius].cylinder(hole.chimney_m);
            (chimney.up * z_rad + chimney.uu).inv()
        });
        AtFrequency {
            omega,
            spans: spans.collect(),
            shunts: shunts.collect(),
            chimneys: chimneys.collect(),
            bore_z_c: self.holes.iter().map(|hole| losses[hole.bore_radius].z_c).collect(),
            bell: radiation::impedance(omega, self.bell_radius_m, &self.air),
        }
    }
}

impl AtFrequency {
    /// Pressure and flow just upstream of the shunt of a hole (downstream of the upper half of its series mass), for a
    /// flow of 1 out of the bell; at the bell for an index beyond the last hole.
    fn above(&self, open: &[bool], hole_index: usize) -> (Complex64, Complex64) {
        let (mut pressure, mut flow) = (self.bell, Complex64::ONE);
        for hole in (hole_index..self.shunts.len()).rev() {
            (pressure, flow) = self.spans[hole + 1].apply(pressure, flow);
            let is_open = open.get(hole).copied().unwrap_or(false);
            flow += pressure * self.shunts[hole][usize::from(is_open)];
        }
        (pressure, flow)
    }
}

impl Matrix {
    fn series(impedance: Complex64) -> Self {
        Self { pp: Complex64::ONE, pu: impedance, up: Complex64::ZERO, uu: Complex64::ONE }
    }

    /// The chain of `self` upstream and `next` downstream.
    fn then(self, next: Self) -> Self {
        Self {
            pp: self.pp * next.pp + self.pu * next.up,
            pu: self.pp * next.pu + self.pu * next.uu,
            up: self.up * next.pp + self.uu * next.up,
            uu: self.up * next.pu + self.uu * next.uu,
        }
    }

    fn apply(self, pressure: Complex64, flow: Complex64) -> (Complex64, Complex64) {
        (self.pp * pressure + self.pu * flow, self.up * pressure + self.uu * flow)
    }
}

/// A tube with viscous and thermal losses, at one frequency.
#[derive(Clone, Copy, Debug)]
struct Losses {
    gamma: Complex64,
    z_c: Complex64,
}

impl Losses {
    fn cylinder(self, length_m: f64) -> Matrix {
        let grow = maths::complex::exp(self.gamma * length_m);
        let decay = grow.inv();
        let (cosh, sinh) = (0.5 * (grow + decay), 0.5 * (grow - decay));
        Matrix { pp: cosh, pu: self.z_c * sinh, up: sinh / self.z_c, uu: cosh }
    }
}

/// Zwikker & Kosten (1949): series impedance with the viscous, shunt admittance with the thermal boundary layer.
fn losses(omega: f64, radius_m: f64, air: &Air) -> Losses {
    let area = PI * radius_m * radius_m;
    // 2 J1(z) / (z J0(z)) at z = r sqrt(-j omega / diffusivity)
    let layer = |diffusivity: f64| {
        let z = Complex64::new(1.0, -1.0) * (radius_m * (0.5 * omega / diffusivity).sqrt());
        2.0 * bessel_ratio(z) / z
    };
    let viscous = layer(air.mu / air.rho);
    let thermal = layer(air.kappa / (air.rho * air.cp));
    let z_series = J * (omega * air.rho / area) / (1.0 - viscous);
    let y_shunt = J * (omega * area / (air.rho * air.c * air.c)) * (1.0 + (air.gamma - 1.0) * thermal);
    let gamma = maths::complex::sqrt(z_series * y_shunt);
    Losses { gamma, z_c: z_series / gamma }
}

/// Inner and series length corrections of a hole of radius `b` on a bore of radius `a`, m. Dubos et al. (1999).
fn hole_corrections_m(a: f64, b: f64) -> (f64, f64) {
    let delta = b / a;
    let inner_m = b * (0.82 + delta * (-0.193 + delta * (-1.09 + delta * (1.27 - 0.71 * delta))));
    (inner_m, series_correction_m(b, a))
}

/// Acoustic mass of a jump in radius, kg/m4, `None` where there is none. Polynomial as in openwind, after Taillard.
fn step_mass(left_m: f64, right_m: f64, rho: f64) -> Option<f64> {
    if (left_m - right_m).abs() <= 1e-9 {
        return None;
    }
    let (narrow_m, wide_m) = (left_m.min(right_m), left_m.max(right_m));
    let a = narrow_m / wide_m;
    let a3 = a * a * a;
    let shape = 0.26164 - 0.353 * a + a3 * (0.0809 + a * (0.03816 + a * (-0.12386 + a * 0.09616)));
    Some(shape * rho / narrow_m)
}

fn push(spans: &mut [Vec<Piece>], piece: Piece) {
    if let Some(last) = spans.last_mut() {
        last.push(piece);
    }
}

fn tanh(z: Complex64) -> Complex64 {
    let decay = maths::complex::exp(-2.0 * z);
    (1.0 - decay) / (1.0 + decay)
}

/// Mouth pressure over closing pressure at which a quasi-static reed starts to sound.
///
/// From `3 g - 1 = 2 sqrt(g) / (zeta Z1)`: the reed's slope against a mode of height `z_peak_over_zc` (Re Z at the playing
/// frequency over Zc of the nominal bore, above 0), with embouchure strength `zeta` in 0..1. Never below 1/3, the lossless bore.
pub fn threshold_gamma(z_peak_over_zc: f64, zeta: f64) -> f64 {
    let b = 1.0 / (zeta * z_peak_over_zc);
    let root = (b + (3.0 + b * b).sqrt()) / 3.0;
    root * root
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::instrument_file::BoreSegment;
    use crate::units::{REFERENCE_RADIUS_M, cents};

    pub(super) fn tube(length_m: f64, radius_m: f64) -> InstrumentFile {
        let (x_start_m, x_end_m, r_start_m, r_end_m) = (0.0, length_m, radius_m, radius_m);
        InstrumentFile {
            name: "tube".into(),
            source: String::new(),
            transposition: 0,
            reed_volume_m3: 0.0,
            nominal_radius_m: REFERENCE_RADIUS_M,
            extension_semitones: 0,
            bore: vec![BoreSegment { part: String::new(), x_start_m, x_end_m, r_start_m, r_end_m }],
            holes: Vec::new(),
            fingerings: Vec::new(),
        }
    }

    /// An open pipe without holes resonates at odd multiples of c / 4(L + 0.6133 r), a little flat with losses.
    #[test]
    fn open_cylinder_has_odd_quarter_waves() {
        let air = Air::default();
        let model = TransferMatrix::new(&tube(0.5, REFERENCE_RADIUS_M), air);
        for (mode, peak) in model.peaks(&[], 0.0, 5).iter().enumerate() {
            let lossless = (2 * mode + 1) as f64 * air.c / (4.0 * (0.5 + 0.6133 * REFERENCE_RADIUS_M));
            assert!((-30.0..-5.0).contains(&cents(peak.f_hz, lossless)), "{peak:?} {lossless}");
        }
        assert!(model.reflectance_below(10.0, &[], 0).norm() > 0.999);
    }

    /// Scaled by f, peaks lie at 1/f of the frequency but for wall losses, which go with the inverse root of the size: a
    /// larger bore is a few cents sharper than that, and its peaks are higher and narrower by about the root of f.
    #[test]
    fn scaled_instrument_has_scaled_peaks() {
        let file = InstrumentFile::built_in();
        let model = TransferMatrix::new(&file, Air::default());
        for factor in [0.8, 1.5, 2.0] {
            let large = TransferMatrix::new(&file.scaled(factor), Air::default());
            for index in [0, 13, 19, 32] {
                let open = &file.fingerings[index].open;
                let (before, after) = (model.peaks(open, 0.0, 2), large.peaks(open, 0.0, 2));
                assert_eq!(after.len(), 2);
                for (before, after) in before.iter().zip(&after) {
                    // Wall losses of quality Q lower a resonance by 1 / 2Q; other losses only make Q smaller.
                    let walls =
                        1_200.0 / std::f64::consts::LN_2 / (2.0 * before.q) * (1.0 - factor.powf(-0.5));
                    let off = cents(after.f_hz * factor, before.f_hz);
                    assert!(
                        (0.2..1.3).contains(&(off / walls)),
                        "{factor} {index}: {off} cents, walls {walls}"
                    );
                    let sharper = after.q / before.q / factor.sqrt();
                    assert!((0.7..1.3).contains(&sharper), "{factor} {index}: Q {} {}", before.q, after.q);
                    let higher = after.mag_over_zc / before.mag_over_zc / factor.sqrt();
                    assert!((0.7..1.3).contains(&higher), "{factor} {index}: {before:?} {after:?}");
                }
            }
        }
    }

    /// The pieces are fine enough: halving them moves no peak of the built-in clarinet by 0.1 cent.
    #[test]
    fn finer_pieces_move_no_peak() {
        let file = InstrumentFile::built_in();
        let open = file.fingerings[10].open.clone();
        let coarse = TransferMatrix::new(&file, Air::default()).peaks(&open, 0.0, 3);
        let fine = TransferMatrix::with_pieces(&file, Air::default(), (PIECE.0 / 2.0, PIECE.1 / 2.0));
        for (coarse, fine) in coarse.iter().zip(fine.peaks(&open, 0.0, 3)) {
            assert!(cents(coarse.f_hz, fine.f_hz).abs() < 0.1, "{coarse:?} {fine:?}");
            assert!((coarse.mag_over_zc / fine.mag_over_zc - 1.0).abs() < 0.002, "{coarse:?} {fine:?}");
        }
    }

    /// Re Z > 0 for every fingering, and nothing comes back louder than it went. With a complex Zc waves do not carry
    /// power independently, so |R| may pass 1 by a few parts in a million at the lowest frequencies.
    #[test]
    fn the_instrument_is_passive() {
        let file = InstrumentFile::built_in();
        let model = TransferMatrix::new(&file, Air::default());
        for fingering in &file.fingerings {
            for k in 0..60 {
                let f_hz = 20.0 * 1.12f64.powi(k);
                let z = model.impedance(f_hz, &fingering.open, file.reed_volume_m3);
                assert!(z.re > 0.0, "{} {f_hz}: {z}", fingering.written);
                for hole in 0..=24 {
                    let r = model.reflectance_below(f_hz, &fingering.open, hole).norm();
                    assert!(r < 1.0 + 1e-5, "{} {f_hz} {hole}: {r}", fingering.written);
                }
            }
        }
        assert!(
            model.impedance(f64::NAN, &[], 1.2e-6).is_finite() && model.impedance(1e9, &[], 0.0).is_finite()
        );
    }

    #[test]
    fn threshold_is_a_third_without_losses() {
        assert!((threshold_gamma(1e12, 0.3) - 1.0 / 3.0).abs() < 1e-9);
        assert!((threshold_gamma(33.67, 0.3) - 0.3737).abs() < 1e-4);
    }
}
