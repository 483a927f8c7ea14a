//! Viscothermal losses at the bore's walls, as one first-order filter per cell and direction.
//!
//! In a wide tube the propagation constant is `s/c + K_v sqrt(s) / r` with
//! `K_v = (1 + (gamma - 1) / sqrt(Pr)) sqrt(mu / rho) / c` (Kirchhoff's asymptote), and a wall with tone holes loses
//! [`HOLED_WALL`] times as much. The root is approximated by three
//! high-passes and a delay, `sqrt(s) = sum c_k s / (s + p_k) + c_inf s`, within 5.9 % of |sqrt s| from 100 to 3000 Hz
//! (worst at 2.1 kHz); the loss itself, its real part, within 4.8 %. Each cell gets one pole, dealt in rotation along the
//! bore, and answers for the stretch between the midpoints to its neighbours of the same pole: a third of the work of
//! three poles everywhere, and within 0.1 dB of it.

use crate::maths;
use crate::units::Air;

/// Frequencies p_k of the three poles, Hz (fitted, see the test).
pub const POLES_HZ: [f64; 3] = [26.10, 322.7, 2_563.8];
/// Strengths c_k, s^-1/2.
pub const STRENGTHS: [f64; 3] = [16.48, 29.31, 100.6];
/// Weight c_inf of the extra delay, s^1/2.
const DELAY: f64 = 2.46e-3;
/// How much more than a smooth tube a wall with tone holes loses (fitted to the transfer matrices).
pub const HOLED_WALL: f64 = 1.05;

/// `K_v` of a wall with tone holes, s^1/2: the loss of a tube of radius r and length L is `K_v L sqrt(s) / r`.
pub fn wall_constant(air: &Air) -> f64 {
    let prandtl = air.mu * air.cp / air.kappa;
    HOLED_WALL * (1.0 + (air.gamma - 1.0) / prandtl.sqrt()) * (air.mu / air.rho).sqrt() / air.c
}

/// By what share of its time the walls slow a wave in a tube of this radius: the extra delay of the root.
pub fn slowing(air: &Air, radius_m: f64) -> f64 {
    wall_constant(air) * air.c * DELAY / radius_m
}

/// Deals losses to cells: `losses[cell]` is `K_v L / r`, the result `A` of the cell's filter, whose pole is
/// `POLES_HZ[cell % 3]`. Stretches of one pole cover the bore without gap or overlap.
pub fn deal(losses: &[f64], strengths: &[f64; 3]) -> Vec<f64> {
    let middles: Vec<f64> = losses
        .iter()
        .scan(0.0, |sum, loss| {
            *sum += loss;
            Some(*sum - 0.5 * loss)
        })
        .collect();
    let total: f64 = losses.iter().sum();
    (0..losses.len())
        .map(|cell| {
            let from = if cell >= 3 { 0.5 * (middles[cell - 3] + middles[cell]) } else { 0.0 };
            let to = if cell + 3 < losses.len() { 0.5 * (middles[cell] + middles[cell + 3]) } else { total };
            1.0 - maths::exp(-strengths[cell % 3] * (to - from))
        })
        .collect()
}

/// Coefficient q of the low-pass inside the filter of pole `p_hz` at `rate_hz`: `l += q (x - l)`.
pub fn pole_coefficient(p_hz: f64, rate_hz: f64) -> f64 {
    1.0 - maths::exp(-std::f64::consts::TAU * p_hz / rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    #[test]
    fn three_poles_follow_the_square_root_within_six_percent() {
        let (mut worst, mut worst_loss) = (0.0_f64, 0.0_f64);
        for n in 0..=2_000 {
            let f = 100.0 * 30.0_f64.powf(f64::from(n) / 2_000.0);
            let s = Complex64::new(0.0, std::f64::consts::TAU * f);
            let poles = POLES_HZ.iter().zip(STRENGTHS);
            let sum: Complex64 = poles.map(|(p, c)| c * s / (s + std::f64::consts::TAU * p)).sum();
            let error = (sum + DELAY * s - s.sqrt()) / s.norm().sqrt();
            worst = worst.max(error.norm());
            worst_loss = worst_loss.max(error.re.abs());
        }
        println!("sqrt(s) by three poles: {worst:.4}, its loss {worst_loss:.4}");
        assert!(worst < 0.059 && worst_loss < 0.048, "{worst} {worst_loss}");
    }

    #[test]
    fn every_pole_covers_the_whole_bore_once() {
        let losses: Vec<f64> = (1..=17).map(|n| f64::from(n) * 1e-4).collect();
        let a = deal(&losses, &STRENGTHS);
        for (pole, strength) in STRENGTHS.iter().enumerate() {
            let sum: f64 = a.iter().skip(pole).step_by(3).map(|a| -(1.0 - a).ln() / strength).sum();
            assert!((sum - losses.iter().sum::<f64>()).abs() < 1e-15);
        }
    }
}
