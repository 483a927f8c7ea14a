//! The reed without inertia: its position follows the pressure difference at once. It serves to compute thresholds and to
//! study a simpler model. As an instrument it squeaks, because nothing damps the upper resonances of the bore.
//!
//! The flow is the law of [`law`](crate::reed::law) read from the tables, scaled to zeta:
//! `u = zeta 2/(3 sqrt 3) A (H x_a[p] - x_b[p] / k)`. The bore's load line `p + kappa u(p) = X` meets it once while
//! `kappa zeta A sqrt(r e_c) < 1`, with `r = k_ref / k` and `e_c = H k_ref` (for the reference law: `kappa zeta < 1`); beyond that it finds one
//! of its roots. A closed-form root of the exact law starts a bracketed Newton iteration on the tables. The air
//! volume the reed displaces is a compliance at the tip, by the trapezoidal rule. What this leaves out: the reed's
//! resonance, the lay's curve, the tongue.
//!
//! Pressures over the reference closing pressure P, flows over P / Zc, Zc of the instrument's nominal bore.
//!
//! | symbol | here |
//! |---|---|
//! | p, the pressure difference over the reed | `p_delta` |
//! | X, the same at zero flow | `x` |
//! | kappa, 1 over the admittance the reed blows into | `kappa` |

use crate::maths;
use crate::reed::law::{K_INIT, ReedLaw};
use crate::reed::tables::{LAST, ReedTables};

/// From 1 upwards the load line of a unit admittance meets the law more than once.
const MAX_ZETA: f64 = 0.95;
/// Newton steps at most; a step that would leave its bracket halves it instead.
const STEPS: usize = 64;
/// Residual that is rounding.
const DONE: f64 = 1e-13;

/// A reed without inertia, at one sample rate.
#[derive(Clone, Copy, Debug)]
pub struct QuasiStaticReed {
    law: ReedLaw,
    /// Flow over P / Zc per flow of the law.
    scale: f64,
    /// Half-sample conductance of the reed's volume, 2 V / (S c T); over 1 / Zc.
    conductance: f64,
}

/// The state of a [`QuasiStaticReed`]: pressure, flow, and the flow into the reed's volume.
#[derive(Clone, Copy, Debug, Default)]
pub struct QuasiStaticState {
    /// Pressure in the mouthpiece in the last sample, over P.
    pub p_mouthpiece: f64,
    /// Flow through the channel in the last sample, over P / Zc.
    pub flow: f64,
    /// Flow into the reed's volume in the last sample, over P / Zc.
    stored: f64,
}

impl QuasiStaticReed {
    /// A law with `zeta` of the reference reed, held in 0..=0.95. `swept_s` is the reed's equivalent volume over (bore
    /// section times speed of sound), seconds; 0 for none.
    pub fn new(law: ReedLaw, zeta: f64, swept_s: f64, rate_hz: f64) -> Self {
        Self { law, scale: K_INIT * zeta.clamp(0.0, MAX_ZETA), conductance: 2.0 * rate_hz * swept_s }
    }

    /// Flow at a pressure difference, over P / Zc. Real-time safe.
    pub fn flow(&self, tables: &ReedTables, p_delta: f64) -> f64 {
        self.scale * self.law.flow(tables, p_delta)
    }

    /// The pressure difference where `p + kappa u(p) = x`. Real-time safe: the number of steps is bounded.
    pub fn solve(&self, tables: &ReedTables, kappa: f64, x: f64) -> f64 {
        let load = kappa * self.scale * self.law.a();
        let (opening, closing) = (load * self.law.h(), load / self.law.k());
        let backward = x < 0.0;
        let size = x.abs();
        if !backward && size >= self.law.closing() {
            return x;
        }
        // The flow takes pressure away from x, or adds nothing: the root lies between 0 and x.
        let (mut low, mut high) = (0.0, size);
        let mut p = if backward { resting(opening, size) } else { closing_root(opening, closing, size) }
            .clamp(low, high);
        for _ in 0..STEPS {
            let signed = if backward { -p } else { p };
            let error = p + (kappa * self.flow(tables, signed)).abs() - size;
            if error.abs() < DONE {
                break;
            }
            if error > 0.0 {
                high = p
            } else {
                low = p
            }
            let (slope_a, slope_b) = slopes(tables, p);
            let slope = 1.0 + opening * slope_a + if backward { closing } else { -closing } * slope_b;
            let step = p - error / slope;
            p = if step > low && step < high { step } else { 0.5 * (low + high) };
        }
        if backward { -p } else { p }
    }
}

impl QuasiStaticState {
    /// One sample: mouth pressure and the wave arriving from a bore of `admittance` (over 1 / Zc) give the wave leaving
    /// into it. Real-time safe. [audio thread]
    pub fn tick(
        &mut self,
        reed: &QuasiStaticReed,
        tables: &ReedTables,
        admittance: f64,
        p_mouth: f64,
        p_minus: f64,
    ) -> f64 {
        let kappa = 1.0 / (admittance + reed.conductance);
        let history = reed.conductance * self.p_mouthpiece + self.stored;
        let p_delta = reed.solve(tables, kappa, p_mouth - kappa * (2.0 * admittance * p_minus + history));
        self.p_mouthpiece = p_mouth - p_delta;
        self.flow = reed.flow(tables, p_delta);
        self.stored = reed.conductance * self.p_mouthpiece - history;
        self.p_mouthpiece - p_minus
    }
}

/// Root of `p + opening sqrt(p) = size`: the reed at rest.
fn resting(opening: f64, size: f64) -> f64 {
    let half = 0.5 * opening;
    ((half * half + size).sqrt() - half).powi(2)
}

/// Root of `s^2 + opening s - closing s^3 = size`, squared: the middle one of three, by cosines (Viete).
fn closing_root(opening: f64, closing: f64, size: f64) -> f64 {
    // The weaker the flow, the further off the cubic's other roots, and the less they help.
    if closing < 1e-3 {
        return resting(opening, size);
    }
    let shift = 1.0 / (3.0 * closing);
    let third = (opening / closing + 3.0 * shift * shift) / 3.0;
    let constant = size / closing - shift * (2.0 * shift * shift + opening / closing);
    let radius = third.sqrt();
    let angle = maths::acos((-0.5 * constant / (third * radius)).clamp(-1.0, 1.0)) / 3.0;
    let root = shift + 2.0 * radius * maths::cos(angle - std::f64::consts::TAU / 3.0);
    root * root
}

/// Slopes of `x_a` and `x_b` as [`ReedTables::at`] interpolates them.
fn slopes(tables: &ReedTables, p: f64) -> (f64, f64) {
    let position = p * LAST as f64;
    if (1.0..LAST as f64).contains(&position) {
        let i = (position as usize).min(LAST - 1);
        let rise = |x: &[f64; LAST + 1]| (x[i + 1] - x[i]) * LAST as f64;
        return (rise(&tables.x_a), rise(&tables.x_b));
    }
    let root = p.max(1e-300).sqrt();
    (0.5 / root, 1.5 * root)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random() -> impl FnMut(f64, f64) -> f64 {
        let mut seed = 1_u64;
        move |low, high| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn solve_leaves_nothing_for_any_wave_and_embouchure() {
        let (tables, mut random) = (ReedTables::reference(), random());
        let mut worst = 0.0_f64;
        for _ in 0..1_000_000 {
            let (gamma, wave, zeta) = (random(0.0, 3.0), random(-4.0, 4.0), random(0.0, 0.95));
            let reed = QuasiStaticReed::new(ReedLaw::default(), zeta, 0.0, 96_000.0);
            let p = gamma - reed.solve(tables, 1.0, gamma - wave);
            worst = worst.max((p - wave - reed.flow(tables, gamma - p)).abs());
        }
        // The corners: zero, the first cell, closure.
        for zeta in [0.0, 0.3, 0.95] {
            let reed = QuasiStaticReed::new(ReedLaw::default(), zeta, 0.0, 96_000.0);
            for corner in [0.0, 1.0] {
                for off in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 2.8e-4, 1e-3] {
                    for x in [corner - off, corner + off] {
                        let p = reed.solve(tables, 1.0, x);
                        worst = worst.max((p + reed.flow(tables, p) - x).abs());
                    }
                }
            }
        }
        println!("worst residual {worst:.1e}");
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn other_laws_and_bent_tables_are_solved_too() {
        let (mut tables, mut random) = (ReedTables::reference().clone(), random());
        for i in 1..=LAST {
            let bend = 1.0 + random(-1e-3, 1e-3);
            tables.x_a[i] *= bend;
            tables.x_b[i] *= bend;
        }
        for _ in 0..20_000 {
            let law = ReedLaw::free(random(1.0, 5.0), random(0.1, 2.0), random(0.0, 1.0)).unwrap();
            let reed = QuasiStaticReed::new(law, 0.4, 0.0, 96_000.0);
            let x = random(-3.0, 3.0);
            let p = reed.solve(&tables, 0.5, x);
            assert!((p + 0.5 * reed.flow(&tables, p) - x).abs() < 1e-9, "{law:?} at {x}");
        }
    }

    #[test]
    fn closed_form_is_the_exact_law() {
        for zeta in [0.01, 0.3, 0.95] {
            for n in 0..=100 {
                let s = f64::from(n) / 100.0;
                let found = closing_root(zeta, zeta, s * s + zeta * s * (1.0 - s * s));
                assert!((found - s * s).abs() < 1e-7, "zeta {zeta}, s {s}: {found}");
            }
        }
    }

    /// A rigid volume blown through the reed fills up to the mouth's pressure, at first by zeta sqrt(gamma) (1 - gamma).
    #[test]
    fn volume_fills_to_the_mouths_pressure() {
        let reed = QuasiStaticReed::new(ReedLaw::default(), 0.3, 1e-3, 96_000.0);
        let mut state = QuasiStaticState::default();
        let mut pressure = Vec::new();
        for _ in 0..2_000 {
            state.tick(&reed, ReedTables::reference(), 1e-12, 0.4, 0.0);
            pressure.push(state.p_mouthpiece);
        }
        let rise = (pressure[3] - pressure[2]) * 96_000.0 * 1e-3;
        let expected = 0.3 * 0.6 * 0.4_f64.sqrt();
        assert!((rise / expected - 1.0).abs() < 0.02, "{rise} against {expected}");
        let nearly = pressure.iter().position(|&p| p > 0.36).unwrap();
        assert!(pressure[..nearly].windows(2).all(|pair| pair[1] > pair[0]));
        assert!((pressure[1_999] - 0.4).abs() < 0.02, "{}", pressure[1_999]);
    }
}
