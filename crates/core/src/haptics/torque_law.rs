//! Torque as a function of angle, as the firmware of the knob computes it. The program uses it for previews and limits, and
//! tests compare the firmware with it.
//!
//! This is the static part. The firmware adds damping and friction, morphs from one note to the next, and applies the limits
//! of the device. Angles are in degrees from the knob's zero, torques in mNm. Positive torque *resists blowing*: the command
//! to the motor is its negative.
//!
//! - *flow*: `scale u(p)` with `p = (angle - offset) stretch / 360`. `u = H x_a - x_b / k` comes from [`ReedTables`], the
//!   tables of the sound, and is 0 from closure on. The slope of the square root is infinite at 0. Within [`ROUNDED_DEG`]
//!   of the origin it is therefore replaced by `sqrt(p0) (5/4 s - 1/4 s^3)`, `s = p / p0`, which has the same value and slope
//!   at `p0`.
//! - *pressure*: a spring that reaches `scale` at closure; the torque stays there beyond.
//! - The mark at the threshold is a bump (flow) or a step (pressure) of the height `detent`.
//! - Below -100 degrees there is the slap spring, of at most `scale`; beyond the wall there is the spring of the wall.
//! - *free*: none of these.

use crate::haptics::feel_parameters::{Feel, TorqueLaw};
use crate::reed::ReedTables;

/// Angle below which the slap spring acts, degrees. An offset below 0 moves it.
pub const SLAP_DEG: f64 = -100.0;
/// Travel over which the square root is rounded, degrees. It is at most a twelfth of the way to closure.
pub const ROUNDED_DEG: f64 = 6.0;
const ROUNDED_SHARE: f64 = 1.0 / 12.0;
/// Half-width of the mark at the threshold, degrees.
const MARK_DEG: f64 = 6.0;
/// Steepest slopes of the bump `(1 - x^2)^2` and of the step, per half-width.
const BUMP_SLOPE: f64 = 1.539_600_717_839_002;
const STEP_SLOPE: f64 = 0.75;

/// The fields of a feel in the units of the formulas.
struct Curve<'a> {
    feel: &'a Feel,
    tables: &'a ReedTables,
    h: f64,
    k: f64,
    scale: f64,
    offset: f64,
    /// Pressure difference over the reference closing pressure, per degree.
    p_per_deg: f64,
    /// End of the rounded part, in pressure.
    rounded: f64,
    mark_at: f64,
    mark: f64,
    wall_at: f64,
    wall: f64,
}

impl<'a> Curve<'a> {
    fn new(feel: &'a Feel, tables: &'a ReedTables) -> Self {
        let (h, k, offset) = (f64::from(feel.h), f64::from(feel.k), f64::from(feel.offset_deg));
        let p_per_deg = f64::from(feel.stretch) / 360.0;
        Self {
            feel,
            tables,
            h,
            k,
            scale: f64::from(feel.scale_mnm),
            offset,
            p_per_deg,
            rounded: (ROUNDED_DEG * p_per_deg).min(ROUNDED_SHARE * h * k),
            // A mark that would begin before the origin begins there.
            mark_at: f64::from(feel.a_on_deg).max(offset + MARK_DEG),
            mark: 0.1 * f64::from(feel.detent),
            wall_at: f64::from(feel.wall_deg),
            wall: f64::from(feel.wall_mnm_per_deg),
        }
    }

    fn closing(&self) -> f64 {
        self.h * self.k
    }

    fn closure_deg(&self) -> f64 {
        self.offset + self.closing() / self.p_per_deg
    }

    fn flow(&self, p: f64) -> f64 {
        if p >= self.closing() {
            return 0.0;
        }
        let (x_a, x_b) = self.tables.at(p);
        let x_a = if p < self.rounded {
            let s = p / self.rounded;
            self.rounded.sqrt() * s * (1.25 - 0.25 * s * s)
        } else {
            x_a
        };
        self.h * x_a - x_b / self.k
    }

    fn torque(&self, angle_deg: f64) -> f64 {
        if self.feel.law == TorqueLaw::Free {
            return 0.0;
        }
        let p = (angle_deg - self.offset) * self.p_per_deg;
        let x = (angle_deg - self.mark_at) / MARK_DEG;
        let mut torque = 0.0;
        if p > 0.0 {
            torque += if self.feel.law == TorqueLaw::Flow {
                let rest = (1.0 - x * x).max(0.0);
                self.scale * self.flow(p) + self.mark * rest * rest
            } else {
                let x = x.clamp(-1.0, 1.0);
                self.scale * (p / self.closing()).min(1.0) + self.mark * (0.5 + x * (0.75 - 0.25 * x * x))
            };
        }
        let slap_from = SLAP_DEG + self.offset.min(0.0);
        let slap = f64::from(self.feel.slap_mnm_per_deg) * (slap_from - angle_deg).max(0.0);
        torque - slap.min(self.scale) + self.wall * (angle_deg - self.wall_at).max(0.0)
    }

    /// Slope of the flow law without its mark, mNm per degree.
    fn slope(&self, angle_deg: f64) -> f64 {
        let p = (angle_deg - self.offset) * self.p_per_deg;
        let by_p = if p <= self.rounded {
            1.25 * self.h / self.rounded.sqrt()
        } else if p <= self.closing() {
            0.5 * self.h / p.sqrt() - 1.5 * p.sqrt() / self.k
        } else {
            0.0
        };
        self.scale * by_p * self.p_per_deg
    }

    /// Upper bound of the steepest restoring slope, mNm per degree. Where mark and law overlap, their steepest slopes add.
    fn stiffness(&self) -> f64 {
        let spring = self.scale / self.closing() * self.p_per_deg;
        let (law, mark, at_wall) = match self.feel.law {
            TorqueLaw::Free => return 0.0,
            TorqueLaw::Flow => {
                let mark = self.mark / MARK_DEG * BUMP_SLOPE;
                let beside = self.slope(self.mark_at - MARK_DEG).max(0.0) + mark;
                (self.slope(self.offset).max(beside), mark, self.slope(self.wall_at).max(0.0))
            }
            TorqueLaw::Pressure => {
                let mark = self.mark / MARK_DEG * STEP_SLOPE;
                (spring + mark, mark, if self.wall_at < self.closure_deg() { spring } else { 0.0 })
            }
        };
        let near_mark = if self.wall_at < self.mark_at + MARK_DEG { mark } else { 0.0 };
        law.max(self.wall + at_wall + near_mark).max(f64::from(self.feel.slap_mnm_per_deg))
    }

    /// Upper bound of the steepest slope that pushes the hand along, mNm per degree; 0 under the pressure law.
    fn push(&self) -> f64 {
        if self.feel.law != TorqueLaw::Flow {
            return 0.0;
        }
        let closure = self.closure_deg();
        // Just inside closure, where the falling branch is steepest.
        let fall = |angle: f64| (-self.slope(angle.min(closure * (1.0 - 1e-12)))).max(0.0);
        fall(closure).max(self.mark / MARK_DEG * BUMP_SLOPE + fall(self.mark_at + MARK_DEG))
    }

    /// Upper bound of the torque between origin and wall, mNm: the peak of the law plus the mark.
    fn most(&self) -> f64 {
        let law = match self.feel.law {
            TorqueLaw::Free => return 0.0,
            TorqueLaw::Flow => self.scale * (4.0 * self.h.powi(3) * self.k / 27.0).sqrt(),
            TorqueLaw::Pressure => self.scale,
        };
        law + self.mark
    }
}

/// Static torque at `angle_deg`, mNm; positive torque resists blowing. Real-time safe.
pub fn torque_mnm(feel: &Feel, tables: &ReedTables, angle_deg: f64) -> f64 {
    Curve::new(feel, tables).torque(angle_deg)
}

/// Angle at which the torque law closes, degrees from the knob's zero.
pub fn closure_deg(feel: &Feel) -> f64 {
    360.0 * f64::from(feel.h) * f64::from(feel.k) / f64::from(feel.stretch) + f64::from(feel.offset_deg)
}

/// Upper bounds of the static torque of a feel and of its slopes. A device that checks a feel finds no more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TorqueExtremes {
    /// Largest torque between rest and wall, mNm.
    pub torque_mnm: f64,
    /// Steepest restoring slope, N m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Steepest slope that pushes the hand in the direction of its movement, N m/rad.
    pub push_nm_per_rad: f64,
}

/// The bounds of a feel, from the formulas of its torque law. Real-time safe.
pub fn extremes(feel: &Feel) -> TorqueExtremes {
    let curve = Curve::new(feel, ReedTables::reference());
    let per_rad = 1e-3 * 1_f64.to_radians().recip();
    TorqueExtremes {
        torque_mnm: curve.most(),
        stiffness_nm_per_rad: per_rad * curve.stiffness(),
        push_nm_per_rad: per_rad * curve.push(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reed::law::{H_INIT, K_INIT};

    /// The setting of TorqueTuner, scale in mNm: one turn, no mark, no damping.
    fn torque_tuner(law: TorqueLaw, h: f64, k: f64) -> Feel {
        Feel {
            feel_id: 0,
            law,
            morph_ms: 20,
            h: h as f32,
            k: k as f32,
            scale_mnm: 90.0,
            stretch: 1.0,
            offset_deg: 0.0,
            a_on_deg: 120.0,
            a_off_deg: 700.0,
            a_beat_deg: 180.0,
            wall_deg: 36_000.0,
            wall_mnm_per_deg: 5.0,
            slap_mnm_per_deg: 0.5,
            damping_mnms: 0.0,
            friction: 0,
            detent: 0,
        }
    }

    #[test]
    fn flow_is_the_reference_formula_beyond_the_rounded_origin() {
        let tables = ReedTables::reference();
        for h in [1.0, 2.0, H_INIT, 4.0] {
            for k in [0.1, 0.25, K_INIT, 1.0] {
                let feel = torque_tuner(TorqueLaw::Flow, h, k);
                let (h, k) = (f64::from(feel.h), f64::from(feel.k));
                for index in 0..=3600 {
                    let p = tables.x[index];
                    let expected =
                        if p < h * k { h * tables.x_a[index] - tables.x_b[index] / k } else { 0.0 };
                    let torque = torque_mnm(&feel, tables, 0.1 * index as f64);
                    let rounded = 0.1 * (index as f64) < ROUNDED_DEG;
                    // The rounding lowers the root by at most a third of its value at the end.
                    let off = if rounded { 0.35 * 90.0 * h * (ROUNDED_DEG / 360.0).sqrt() } else { 1e-3 };
                    assert!(
                        (torque - 90.0 * expected).abs() <= off,
                        "H {h} k {k} index {index}: {torque}, {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn flow_peaks_at_a_third_of_closure_and_is_gone_beyond() {
        let (feel, tables) = (torque_tuner(TorqueLaw::Flow, H_INIT, K_INIT), ReedTables::reference());
        let steps = 0..4_000;
        let peak = steps
            .clone()
            .max_by(|&a, &b| {
                let torque = |step: i32| torque_mnm(&feel, tables, 0.1 * f64::from(step));
                torque(a).total_cmp(&torque(b))
            })
            .unwrap();
        assert!((peak - 1_200).abs() <= 1, "{peak}");
        assert_eq!(torque_mnm(&feel, tables, 361.0), 0.0);
        assert!((closure_deg(&feel) - 360.0).abs() < 1e-4);
    }

    #[test]
    fn pressure_never_falls_and_steps_up_at_the_threshold() {
        let feel = Feel { detent: 100, ..torque_tuner(TorqueLaw::Pressure, H_INIT, K_INIT) };
        let torque = |angle: f64| torque_mnm(&feel, ReedTables::reference(), angle);
        let mut before = torque(-300.0);
        for step in -3_000..8_000 {
            let here = torque(0.1 * f64::from(step));
            assert!(here >= before - 1e-12, "{step}");
            before = here;
        }
        assert!((torque(126.0) - torque(114.0) - 10.0 - 12.0 * 90.0 / 360.0).abs() < 1e-4);
        assert!((torque(1_000.0) - 100.0).abs() < 1e-4);
    }

    #[test]
    fn the_bounds_hold_what_the_curve_does() {
        let tables = ReedTables::reference();
        for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
            for (detent, wall_deg, offset_deg) in [(0, 414.0, 0.0), (80, 414.0, 0.0), (80, 200.0, 20.0)] {
                let feel = Feel { detent, wall_deg, offset_deg, ..torque_tuner(law, H_INIT, K_INIT) };
                let bounds = extremes(&feel);
                let (mut most, mut up, mut down) = (0.0_f64, 0.0_f64, 0.0_f64);
                let mut before = torque_mnm(&feel, tables, -130.0);
                for step in -13_000..50_000 {
                    let angle = 0.01 * f64::from(step);
                    let torque = torque_mnm(&feel, tables, angle);
                    let slope = 1e-3 * (torque - before) / 0.01_f64.to_radians();
                    // The tables are polygons and closure is a corner: hence the tolerances below.
                    (up, down) = (up.max(slope), down.max(-slope));
                    if angle < f64::from(wall_deg) {
                        most = most.max(torque);
                    }
                    before = torque;
                }
                assert!(most <= bounds.torque_mnm * 1.000_1, "{law:?}: {most}, {bounds:?}");
                assert!(up <= bounds.stiffness_nm_per_rad * 1.02, "{law:?}: {up}, {bounds:?}");
                assert!(down <= bounds.push_nm_per_rad * 1.02 + 1e-3, "{law:?}: {down}, {bounds:?}");
                assert!(up >= 0.5 * bounds.stiffness_nm_per_rad, "the bound is too wide: {up}, {bounds:?}");
            }
        }
    }

    #[test]
    fn a_free_knob_has_no_torque() {
        let feel = torque_tuner(TorqueLaw::Free, H_INIT, K_INIT);
        assert!(
            [-500.0, 0.0, 120.0, 40_000.0].map(|a| torque_mnm(&feel, ReedTables::reference(), a)) == [0.0; 4]
        );
        assert_eq!(extremes(&feel), TorqueExtremes::default());
    }
}
