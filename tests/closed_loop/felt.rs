//! Where the hand met the threshold, from the torque that was on the knob as it passed.
//!
//! Torque is averaged by angle over the passage; at one slow speed friction and damping only add a constant. Two
//! measures, one of what the firmware commanded, one of what the motor made of it, which on a board of 208 counts to the
//! newton metre are stairs of 4.8 mNm. Neither knows where the threshold was meant to be:
//!
//! - *flow*, commanded and made: the place of a bump of the protocol's form, of any height, on any parabola, that leaves least
//!   over, about the highest torque commanded.
//! - *pressure*, commanded: the middle of the steepest rise. Made: the place of a step of the protocol's form, of any
//!   height, on any line, that leaves least over.

use crate::heard::least_squares;
use chalumeau_knob::simulator::knob::SimulatedKnob;

/// Width of a bin, degrees.
const BIN_DEG: f64 = 0.25;
/// A bin passed in less than this many periods is left out.
const LEAST_PERIODS: u32 = 100;
/// Half the width of bump and step, degrees (docs/protocol.md); a rise is the difference between the means of as much
/// behind and before.
const STEP_DEG: f64 = 6.0;
/// How far about the steepest rise or the top the mark is fitted, degrees: a few stairs on both sides.
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
    /// Where the motor's torque rises most steeply, stairs and all (pressure); middle of where it is highest (flow).
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

    /// The threshold of the flow law.
    pub fn bump(&self) -> Option<FeltThreshold> {
        let (commanded, made) = (self.commanded(), self.made());
        let top_deg = commanded.iter().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let most = made.iter().map(|x| x.1).fold(0.0, f64::max);
        let highest: Vec<f64> = made.iter().filter(|x| x.1 > most - 0.5).map(|x| x.0).collect();
        Some(FeltThreshold {
            commanded_deg: bump(&commanded, top_deg)?,
            made_deg: bump(&made, top_deg)?,
            plain_deg: highest.iter().sum::<f64>() / highest.len() as f64,
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

/// Place of the step that leaves least over on a line.
fn step(curve: &Curve, near_deg: f64) -> Option<f64> {
    fitted(curve, near_deg, |x, e| {
        let x = x.clamp(-1.0, 1.0);
        [1.0, e, 0.5 + x * (0.75 - 0.25 * x * x)]
    })
}

/// Place of the bump that leaves least over on a parabola.
fn bump(curve: &Curve, near_deg: f64) -> Option<f64> {
    fitted(curve, near_deg, |x, e| [1.0, e, e * e, (1.0 - x * x).max(0.0).powi(2)])
}

/// The place, in `form` of the distance from it in half widths and of the distance from `near_deg`, that leaves least over.
fn fitted<const N: usize>(curve: &Curve, near_deg: f64, form: impl Fn(f64, f64) -> [f64; N]) -> Option<f64> {
    let near: Curve = curve.iter().copied().filter(|x| (x.0 - near_deg).abs() < AROUND_DEG).collect();
    let torques: Vec<f64> = near.iter().map(|x| x.1).collect();
    let left_over = |at: f64| {
        let rows: Vec<[f64; N]> = near.iter().map(|x| form((x.0 - at) / STEP_DEG, x.0 - near_deg)).collect();
        least_squares(&rows, &torques).map_or(f64::INFINITY, |(_, rest)| rest)
    };
    let steps = (SEARCH_DEG / BIN_DEG) as i32;
    let grid = (-steps..=steps).map(|n| near_deg + BIN_DEG * f64::from(n));
    grid.map(|at| (at, left_over(at))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}
