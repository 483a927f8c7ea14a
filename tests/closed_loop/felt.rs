//! Where the hand met the threshold, from the torque that was on the knob as it passed.
//!
//! Torque is averaged by angle over the passage; at one slow speed friction and damping only add a constant. Two
//! measures, one of what the firmware commanded, one of what the motor made of it, which on a board of 208 counts to the
//! newton metre are stairs of 4.8 mNm. Neither knows where the threshold was meant to be:
//!
//! - *flow*, commanded: the top of a cubic through the upper tenth. Made: the top is a landing of the stairs; the law
//!   `sqrt(x) (1 - x)` has the same torque at both its ends y and z, so that its top is at `(y + sqrt(y z) + z) / 3`.
//! - *pressure*, commanded: the middle of the steepest rise. Made: the place of a step of the protocol's form, of any
//!   height, on any line, that leaves least over.

use crate::heard::least_squares;
use chalumeau_knob::simulator::knob::SimulatedKnob;

/// Width of a bin, degrees.
const BIN_DEG: f64 = 0.25;
/// A bin passed in less than this many periods is left out.
const LEAST_PERIODS: u32 = 100;
/// Half the width of the step, degrees (docs/protocol.md); a rise is the difference between the means of as much behind
/// and before.
const STEP_DEG: f64 = 6.0;
/// How far about the steepest rise the step is fitted, degrees: a few stairs on both sides.
const AROUND_DEG: f64 = 40.0;
/// And how far its place is looked for, degrees.
const SEARCH_DEG: f64 = 10.0;

/// Torque against the breath, mNm, by angle, degrees.
type Curve = Vec<(f64, f64)>;

/// Fingers that remember.
#[derive(Default)]
pub struct Fingers {
    /// Sums of the torque commanded and made, mNm, and periods.
    bins: Vec<(f64, f64, u32)>,
}

/// A threshold, degrees, twice.
#[derive(Clone, Copy, Debug)]
pub struct FeltThreshold {
    /// In what the firmware commanded.
    pub commanded_deg: f64,
    /// In what the motor made.
    pub made_deg: f64,
    /// Where the motor's torque rises most steeply, stairs and all (pressure); middle of its highest landing (flow).
    pub plain_deg: f64,
}

impl Fingers {
    /// Feels the knob for one period.
    pub fn feel(&mut self, knob: &SimulatedKnob) {
        let at = (knob.angle_deg().max(0.0) / BIN_DEG) as usize;
        if at >= self.bins.len() {
            self.bins.resize(at + 1, (0.0, 0.0, 0));
        }
        let bin = &mut self.bins[at];
        *bin = (bin.0 - knob.command_mnm(), bin.1 - knob.motor_mnm(), bin.2 + 1);
    }

    fn curve(&self, sum: fn(&(f64, f64, u32)) -> f64) -> Curve {
        let passed = self.bins.iter().enumerate().filter(|(_, bin)| bin.2 >= LEAST_PERIODS);
        passed.map(|(at, bin)| ((at as f64 + 0.5) * BIN_DEG, sum(bin) / f64::from(bin.2))).collect()
    }

    /// Torque that was commanded.
    pub fn commanded(&self) -> Curve {
        self.curve(|bin| bin.0)
    }

    /// Torque that was made.
    pub fn made(&self) -> Curve {
        self.curve(|bin| bin.1)
    }

    /// The threshold of the flow law, on a motor with stairs of `stair_mnm`.
    pub fn peak(&self, stair_mnm: f64) -> Option<FeltThreshold> {
        let (commanded, made) = (self.commanded(), self.made());
        let most = commanded.iter().map(|x| x.1).fold(0.0, f64::max);
        // The highest riser that is clearly below the top.
        let riser = stair_mnm * ((0.97 * most / stair_mnm - 0.5).floor() + 0.5);
        let crosses = |w: &[(f64, f64)]| w[0].0 + (riser - w[0].1) / (w[1].1 - w[0].1) * (w[1].0 - w[0].0);
        let y = made.windows(2).find(|w| w[0].1 < riser && w[1].1 >= riser).map(crosses)?;
        let z = made.windows(2).rev().find(|w| w[0].1 >= riser && w[1].1 < riser).map(crosses)?;
        Some(FeltThreshold {
            commanded_deg: top(&commanded, 0.9 * most)?,
            made_deg: (y + (y * z).sqrt() + z) / 3.0,
            plain_deg: 0.5 * (y + z),
        })
    }

    /// The threshold of the pressure law.
    pub fn step(&self) -> Option<FeltThreshold> {
        let (commanded, made) = (self.commanded(), self.made());
        let commanded_deg = steepest(&commanded)?;
        Some(FeltThreshold {
            commanded_deg,
            made_deg: step(&made, commanded_deg)?,
            plain_deg: steepest(&made)?,
        })
    }
}

/// Top of a cubic through what is above `level`.
fn top(curve: &Curve, level: f64) -> Option<f64> {
    let above: Curve = curve.iter().copied().filter(|x| x.1 > level).collect();
    let middle = 0.5 * (above.first()?.0 + above.last()?.0);
    let rows: Vec<[f64; 4]> =
        above.iter().map(|x| x.0 / middle - 1.0).map(|e| [1.0, e, e * e, e * e * e]).collect();
    let torques: Vec<f64> = above.iter().map(|x| x.1).collect();
    let ([_, c1, c2, c3], _) = least_squares(&rows, &torques)?;
    // The root of the slope at which the slope falls.
    Some(middle * (1.0 + 2.0 * c1 / (-2.0 * c2 + (4.0 * c2 * c2 - 12.0 * c1 * c3).sqrt())))
}

fn mean_between(curve: &Curve, from_deg: f64, to_deg: f64) -> f64 {
    let within: Vec<f64> = curve.iter().filter(|x| x.0 > from_deg && x.0 < to_deg).map(|x| x.1).collect();
    within.iter().sum::<f64>() / within.len() as f64
}

fn steepest(curve: &Curve) -> Option<f64> {
    let (from, to) = (curve.first()?.0 + 2.0 * STEP_DEG, curve.last()?.0 - 2.0 * STEP_DEG);
    let rise = |at: f64| mean_between(curve, at, at + STEP_DEG) - mean_between(curve, at - STEP_DEG, at);
    let grid = (0..).map(|n| from + BIN_DEG * f64::from(n)).take_while(|&at| at < to);
    grid.map(|at| (at, rise(at))).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}

fn step(curve: &Curve, near_deg: f64) -> Option<f64> {
    let near: Curve = curve.iter().copied().filter(|x| (x.0 - near_deg).abs() < AROUND_DEG).collect();
    let torques: Vec<f64> = near.iter().map(|x| x.1).collect();
    let left_over = |at: f64| {
        let form = |angle: f64| {
            let x = ((angle - at) / STEP_DEG).clamp(-1.0, 1.0);
            0.5 + x * (0.75 - 0.25 * x * x)
        };
        let rows: Vec<[f64; 3]> = near.iter().map(|x| [1.0, x.0 - near_deg, form(x.0)]).collect();
        least_squares(&rows, &torques).map_or(f64::INFINITY, |(_, rest)| rest)
    };
    let steps = (SEARCH_DEG / BIN_DEG) as i32;
    let grid = (-steps..=steps).map(|n| near_deg + BIN_DEG * f64::from(n));
    grid.map(|at| (at, left_over(at))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}
