//! The moving reed at the end of the bore, solved in closed form once a sample.
//!
//! The reed is a damped oscillator driven by the pressure difference, `e'' / w_r^2 + q e' / w_r + e = r p + F`, where
//! `e` is its closing in units of the reference rest opening, `r = k_ref / k` its compliance and `F` the tongue. Its
//! position is known when the flow is wanted, so flow and pressure follow from a quadratic (as Guillemain, Kergomard &
//! Voinier 2005 do): with `B` the opening and `X` the pressure difference at zero flow, `p + kappa zeta B sqrt(p) = X`.
//! The result is then corrected once by what the tables say there, so that sound and knob read
//! the same entries: `u = zeta (x_a[p] (B + r p) - r x_b[p])`, the table's quasi-static law plus inertia, which for exact tables
//! is `zeta B sqrt(p)`.
//!
//! The reed's motion makes flow, too. In the sample from speed `v` to `v'` it is that of the mean speed, `(v + v') / 2`. Then
//! the reed takes from the bore exactly what its motion gives to the bore, and without breath the energy of reed and bore
//! together can only fall: the mean speed times the spring's force telescopes to a change of `e e' / 2`, times the damping to
//! a loss. With the speed before the sample instead, a weak reed on a high note sang by itself. `v'` depends on the pressure
//! difference linearly, so that the quadratic stays one, with X and kappa divided by a constant.
//!
//! The lay rounds the closure: the opening is linear until `lay` before contact and then a parabola, zero at `lay`
//! beyond. The closing pressure p_M is therefore the *extrapolated* one. With `lay` 0 the corner is averaged over one
//! sample, which removes most of its aliasing and is the same parabola with half-width |v| T / 2.
//!
//! Pressures over the reference closing pressure P, flows over P / Zc, Zc of the instrument's nominal bore.

pub mod choir;

use crate::reed::law::{K_INIT, ReedLaw};
use crate::reed::lay::opening;
use crate::reed::tables::ReedTables;

/// A reed counts as shut below this opening (over the rest opening), in statistics and drawings. With a curved lay the last
/// of the gap closes only slowly, hence a thousandth. By judgement.
pub const SHUT: f64 = 1e-3;
/// Highest resonance of the reed over the sample rate: w_r T stays below 1, well inside the integrator's stability limit of 2.
pub(crate) const RESONANCE_TO_RATE: f64 = 0.15;
/// Largest opening, over the rest opening: a reed pushed away from the mouthpiece is stopped by the lip (by judgement).
const MAX_OPENING: f64 = 2.0;
/// Force of the tongue that holds the reed shut at any playing pressure, over P. By judgement.
pub const TONGUE_FORCE: f64 = 1.6;

/// A reed as a damped oscillator with a flow law.
///
/// ```
/// use chalumeau_core::reed::{MovingReed, ReedCoeffs, ReedLaw, ReedState, ReedTables};
///
/// let (law, swept_s) = (ReedLaw::default(), 2e-5);
/// let reed = MovingReed { law, zeta: 0.3, lay: 0.4, resonance_hz: 2_200.0, damping: 0.8, swept_s };
/// let coeffs = ReedCoeffs::new(reed, 96_000.0);
/// let mut state = ReedState::default();
/// // Blown at 0.4 of the closing pressure into a bore that sends nothing back: air flows into the bore.
/// let wave = state.tick(&coeffs, ReedTables::reference(), &coeffs.before(1.0), 0.4, 0.0, 0.0, 0.0);
/// assert!(state.flow > 0.0 && wave > 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingReed {
    /// Quasi-static flow law: rest opening H, stiffness k, amplitude A.
    pub law: ReedLaw,
    /// Embouchure parameter of the reference reed, dimensionless; the reference has 0.3.
    pub zeta: f64,
    /// Half-width of the parabola with which a curved lay rounds the closure, over the rest opening; 0 is a sharp corner.
    pub lay: f64,
    /// Resonance frequency, Hz; held to 0.15 of the sample rate, where the integration is stable.
    pub resonance_hz: f64,
    /// Damping q of the resonance, 1 / Q, dimensionless.
    pub damping: f64,
    /// Equivalent volume of the reference reed over (section of the nominal bore times speed of sound), s.
    pub swept_s: f64,
}

/// The coefficients of a reed during one control tick, at one sample rate.
#[derive(Clone, Copy, Debug)]
pub struct ReedCoeffs {
    /// Sample period, s.
    period: f64,
    /// Flow strength zeta A, over P / Zc.
    strength: f64,
    /// Closing displacement, 1 for the reference reed.
    closing: f64,
    /// Compliance over the reference, k_ref / k.
    compliance: f64,
    /// 1 / `closing`.
    per_closing: f64,
    /// Half-width of the closure's parabola, over the rest opening, never quite 0.
    lay: f64,
    /// The same, per speed, of the parabola that averages a sharp corner over one sample.
    averaged: f64,
    /// 1 / (1 + q w_r T).
    damp: f64,
    /// Speed gained in a sample per force: T w_r^2 / (1 + q w_r T).
    drive: f64,
    /// The same per pressure difference.
    yields: f64,
    /// Flow the reed's own motion makes, per sum of the speeds before and after the sample: V / (2 S c), s.
    swept: f64,
}

impl ReedCoeffs {
    /// Coefficients of a reed at the sample rate `rate_hz`. Real-time safe.
    pub fn new(reed: MovingReed, rate_hz: f64) -> Self {
        let MovingReed { law, zeta, lay, resonance_hz, damping, swept_s } = reed;
        let period = 1.0 / rate_hz;
        let closing = law.h() * K_INIT;
        let angular = std::f64::consts::TAU * resonance_hz.min(RESONANCE_TO_RATE * rate_hz);
        let damp = 1.0 / (1.0 + damping * angular * period);
        let drive = period * angular * angular * damp;
        let compliance = law.compliance();
        Self {
            period,
            strength: zeta * law.a(),
            closing,
            per_closing: 1.0 / closing,
            compliance,
            lay: lay.max(1e-9),
            averaged: 0.5 * period / closing,
            damp,
            drive,
            yields: drive * compliance,
            swept: 0.5 * swept_s,
        }
    }

    /// The reed before a bore; `kappa` is 1 over the admittance of its first cell. Real-time safe.
    #[inline(always)]
    pub fn before(&self, kappa: f64) -> ReedLoad {
        let share = 1.0 / (1.0 + kappa * self.swept * self.yields);
        let shared = share * kappa;
        ReedLoad {
            kappa,
            share,
            strength: shared * self.strength,
            half_strength: 0.5 * shared * self.strength,
        }
    }

    /// Flow through a reed that rests, over P / Zc: at a mouth pressure over P, under this force of the tongue (over P, positive shuts),
    /// with no pressure in the mouthpiece. Without the tables, within their error. Real-time safe.
    #[inline(always)]
    pub fn rest_flow(&self, p_mouth: f64, tongue: f64) -> f64 {
        let p = p_mouth.max(0.0);
        let gap = 1.0 - (self.compliance * p + tongue) * self.per_closing;
        let (opening, _) = opening(gap, self.lay);
        self.strength * self.closing * opening.min(MAX_OPENING) * p.sqrt()
    }

    /// Pressure that closes the reed, extrapolated where the lay is curved, over the reference closing pressure.
    pub fn closing_pressure(&self) -> f64 {
        self.closing / self.compliance
    }
}

/// What a reed and the bore before it make of each other: products that stay the same during one control tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReedLoad {
    /// 1 over the admittance of the first bore cell.
    kappa: f64,
    /// Share of the pressure difference that is left by the flow of the reed's own motion.
    share: f64,
    /// `kappa` with that share times the flow strength, and half of that.
    strength: f64,
    half_strength: f64,
}

impl ReedLoad {
    /// 1 over the admittance of the first bore cell.
    #[inline(always)]
    pub fn kappa(&self) -> f64 {
        self.kappa
    }
}

/// The reed's position and speed, and what last came through it.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReedState {
    /// Closing displacement over the reference rest opening: 0 at rest, 1 shut.
    pub closing: f64,
    /// Its speed, 1/s.
    pub speed: f64,
    /// Flow through the channel in the last sample, over P / Zc.
    pub flow: f64,
    /// Opening in the last sample, over the rest opening.
    pub opening: f64,
    /// Pressure in the mouthpiece in the last sample, over P.
    pub p_mouthpiece: f64,
}

impl ReedState {
    /// Energy of the reed's motion and spring, in the units of
    /// [`Lattice::stored_energy`](crate::bore::lattice::Lattice::stored_energy); `reed` is that of the last sample. Without
    /// breath, noise and tongue the sum of both falls in every sample. For tests.
    pub fn stored_energy(&self, reed: &ReedCoeffs) -> f64 {
        let Self { closing, speed, .. } = *self;
        let motion = (1.0 + reed.damp) / (2.0 * reed.drive) * speed * speed;
        // Closing times the closing one sample earlier.
        let spring = closing * (closing - reed.period * speed) / reed.period;
        reed.swept / reed.compliance * (motion + spring)
    }

    /// One sample: takes mouth pressure, the wave arriving from the bore and the tongue's force (positive shuts), all over P, and
    /// extra flow (noise) over P / Zc, and gives the wave leaving into the bore, over P. `load` is `reed` [before](ReedCoeffs::before) the bore.
    /// Real-time safe; `zeta kappa B` may be anything, the solution is unique. [audio thread]
    // Called in one place, once a sample: a struct for what comes from four sides would only be taken apart again.
    #[allow(clippy::too_many_arguments)]
    #[inline(always)]
    pub fn tick(
        &mut self,
        reed: &ReedCoeffs,
        tables: &ReedTables,
        load: &ReedLoad,
        p_mouth: f64,
        p_minus: f64,
        noise: f64,
        tongue: f64,
    ) -> f64 {
        let rest = reed.closing;
        let gap = 1.0 - self.closing * reed.per_closing;
        let averaged = reed.averaged * self.speed.abs();
        let half = if averaged > reed.lay { averaged } else { reed.lay };
        let opening = if gap >= half {
            gap.min(MAX_OPENING)
        } else {
            let knee = (gap + half).max(0.0);
            knee * knee / (4.0 * half)
        };
        let b = rest * opening;
        // The speed after this sample, but for what the pressure difference adds.
        let free = reed.damp * self.speed + reed.drive * (tongue - self.closing);
        let moved = reed.swept * (self.speed + free);
        let x = load.share * (p_mouth - 2.0 * p_minus - load.kappa * (moved + noise));
        let magnitude = x.abs();
        let half_load = load.half_strength * b;
        let whole = (half_load * half_load + magnitude).sqrt();
        let root = whole - half_load;
        let p = root * root;
        let (x_a, x_b) = tables.at(p);
        let r = reed.compliance;
        let sign = 1.0_f64.copysign(x);
        // Forward the quasi-static reed closes with p, backward it opens: hence the sign inside.
        // A shut reed passes nothing, not even the tables' interpolation error.
        let table_flow = if b > 0.0 { x_a * (b + sign * r * p) - sign * r * x_b } else { 0.0 };
        let slope = root / whole.max(f64::MIN_POSITIVE);
        let p = sign * (p - load.strength * (table_flow - b * root) * slope).max(0.0);
        self.p_mouthpiece = p_mouth - p;
        self.flow = sign * reed.strength * table_flow;
        self.opening = opening;
        self.speed = free + reed.yields * p;
        self.closing += reed.period * self.speed;
        self.p_mouthpiece - p_minus
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quasi_static(zeta: f64) -> ReedCoeffs {
        let law = ReedLaw::default();
        let reed = MovingReed { law, zeta, lay: 0.0, resonance_hz: 2_200.0, damping: 0.8, swept_s: 0.0 };
        ReedCoeffs::new(reed, 96_000.0)
    }

    /// The solve leaves p = X - kappa u to rounding, for any state and both corners.
    #[test]
    fn flow_and_pressure_agree_whatever_comes() {
        let tables = ReedTables::reference();
        let mut seed = 1_u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..1_000_000 {
            let reed = quasi_static(0.95 * random());
            let mut state = ReedState { closing: 3.0 * random() - 1.0, speed: 0.0, ..Default::default() };
            let (gamma, p_minus, closing) = (3.0 * random(), 2.0 * (2.0 * random() - 1.0), state.closing);
            let p_plus = state.tick(&reed, tables, &reed.before(1.0), gamma, p_minus, 0.0, 0.0);
            let p = gamma - (p_plus + p_minus);
            // Continuity at the tip: u = p_plus - p_minus, and u is the law at that pressure difference.
            let b = (1.0 - closing).clamp(0.0, MAX_OPENING);
            let exact = reed.strength * b * p.abs().sqrt().copysign(p);
            let residual = (p_plus - p_minus - exact).abs();
            // The tables' own interpolation error is all that is left.
            let bound =
                if p.abs() < 1.0 && b > 0.0 { reed.strength * (3.0e-4 * (b + p.abs()) + 7e-7) } else { 0.0 };
            assert!(residual <= bound + 1e-12, "{residual:e} at p {p}, b {b}");
        }
    }

    #[test]
    fn a_reed_that_has_come_to_rest_passes_the_flow_of_rest() {
        let tables = ReedTables::reference();
        let reed = ReedCoeffs { lay: 0.4, ..quasi_static(0.3) };
        for (p_mouth, tongue) in
            [(0.1, 0.0), (0.4, 0.0), (0.7, 0.0), (0.9, 0.0), (0.4, 0.3), (0.4, TONGUE_FORCE)]
        {
            let mut state = ReedState::default();
            for _ in 0..20_000 {
                // The bore sends back what leaves no pressure in the mouthpiece.
                let p_minus = -0.5 * state.flow;
                state.tick(&reed, tables, &reed.before(1.0), p_mouth, p_minus, 0.0, tongue);
            }
            let error = (state.flow - reed.rest_flow(p_mouth, tongue)).abs();
            assert!(error < 3e-4, "{error:e} at {p_mouth}, {tongue}");
        }
        assert_eq!(reed.rest_flow(-0.1, 0.0), 0.0);
    }

    #[test]
    fn closed_reed_passes_nothing_and_reflects_everything() {
        let mut state = ReedState { closing: 1.5, ..Default::default() };
        let (reed, tables) = (quasi_static(0.3), ReedTables::reference());
        let p_plus = state.tick(&reed, tables, &reed.before(1.0), 2.0, 0.25, 0.0, TONGUE_FORCE);
        assert_eq!((state.flow, state.opening), (0.0, 0.0));
        assert!((p_plus - 0.25).abs() < 1e-12);
    }

    #[test]
    fn curved_lay_keeps_rest_opening_and_slope() {
        for lay in [0.1, 0.4, 0.5] {
            let reed = ReedCoeffs { lay, ..quasi_static(0.3) };
            let opening = |closing: f64| {
                let mut state = ReedState { closing, ..Default::default() };
                state.tick(&reed, ReedTables::reference(), &reed.before(1.0), 0.5, 0.0, 0.0, 0.0);
                state.opening
            };
            assert_eq!(opening(0.0), 1.0);
            assert!((opening(0.1) - 0.9).abs() < 1e-12);
            assert!(
                (opening(1.0) - lay / 4.0).abs() < 1e-12,
                "not yet shut at the extrapolated closing pressure"
            );
            assert!(opening(1.0 + lay) < 1e-30);
        }
    }

    #[test]
    fn one_table_entry_is_heard_felt_and_exported() {
        let reference = ReedTables::reference();
        let mut bent = reference.clone();
        bent.x_a[1_800] *= 1.01;
        bent.x_b[1_800] *= 1.01;
        let sound = |tables: &ReedTables| {
            let mut state = ReedState { closing: 0.5, ..Default::default() };
            let reed = quasi_static(0.3);
            state.tick(&reed, tables, &reed.before(1.0), 0.5 + 0.3 * 0.5 * 0.5_f64.sqrt(), 0.0, 0.0, 0.0)
        };
        let law = ReedLaw::default();
        assert!((sound(&bent) - sound(reference)).abs() > 1e-4, "audio");
        assert!((law.flow(&bent, 0.5) - law.flow(reference, 0.5)).abs() > 1e-3, "torque law");
        let header = crate::reed::firmware_header::pressure_table_values;
        assert_ne!(header(&bent), header(reference), "header");
    }

    #[test]
    fn free_reed_rings_at_its_resonance() {
        let law = ReedLaw::default();
        let reed =
            MovingReed { law, zeta: 0.0, lay: 0.4, resonance_hz: 1_500.0, damping: 0.02, swept_s: 0.0 };
        let reed = ReedCoeffs::new(reed, 96_000.0);
        let mut state = ReedState { closing: 0.2, ..Default::default() };
        let (mut crossings, mut last) = (0, state.closing);
        for _ in 0..9_600 {
            state.tick(&reed, ReedTables::reference(), &reed.before(1.0), 0.0, 0.0, 0.0, 0.0);
            crossings += i32::from(last < 0.0 && state.closing >= 0.0);
            last = state.closing;
        }
        assert!((148..=151).contains(&crossings), "{crossings}");
    }
}
