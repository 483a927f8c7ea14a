//! Moving reeds side by side: a lane is a reed. Each does what [`ReedState::tick`] does, in the same order, and gives the same
//! bits; only the tables are read one reed after another.

use std::cmp::Ordering;

use super::{MAX_OPENING, ReedCoeffs, ReedLoad, ReedState};
use crate::reed::tables::{LAST, ReedTables};

/// Added to a number up to 2^51 and taken away again, it leaves the nearest whole number.
const WHOLE: f64 = (1_u64 << 52) as f64;

/// Up to `N` reeds with their coefficients, see [`ReedCoeffs`], [`ReedLoad`] and [`ReedState`].
#[derive(Clone, Debug)]
pub struct ReedChoir<const N: usize> {
    period: [f64; N],
    strength: [f64; N],
    closing: [f64; N],
    compliance: [f64; N],
    per_closing: [f64; N],
    lay: [f64; N],
    averaged: [f64; N],
    damp: [f64; N],
    drive: [f64; N],
    yields: [f64; N],
    swept: [f64; N],
    kappa: [f64; N],
    share: [f64; N],
    load_strength: [f64; N],
    half_strength: [f64; N],
    state: Lanes<N>,
}

#[derive(Clone, Debug)]
struct Lanes<const N: usize> {
    closing: [f64; N],
    speed: [f64; N],
    flow: [f64; N],
    opening: [f64; N],
    p_mouthpiece: [f64; N],
}

impl<const N: usize> Default for ReedChoir<N> {
    /// Reeds that nothing moves.
    fn default() -> Self {
        let (zero, one) = ([0.0; N], [1.0; N]);
        Self {
            period: zero,
            strength: zero,
            closing: one,
            compliance: one,
            per_closing: one,
            lay: one,
            averaged: zero,
            damp: zero,
            drive: zero,
            yields: zero,
            swept: zero,
            kappa: zero,
            share: one,
            load_strength: zero,
            half_strength: zero,
            state: Lanes { closing: zero, speed: zero, flow: zero, opening: zero, p_mouthpiece: zero },
        }
    }
}

impl<const N: usize> ReedChoir<N> {
    /// Puts a reed before its bore into a lane. Real-time safe.
    pub fn take(&mut self, lane: usize, reed: &ReedCoeffs, load: &ReedLoad, state: &ReedState) {
        self.period[lane] = reed.period;
        self.strength[lane] = reed.strength;
        self.closing[lane] = reed.closing;
        self.compliance[lane] = reed.compliance;
        self.per_closing[lane] = reed.per_closing;
        self.lay[lane] = reed.lay;
        self.averaged[lane] = reed.averaged;
        self.damp[lane] = reed.damp;
        self.drive[lane] = reed.drive;
        self.yields[lane] = reed.yields;
        self.swept[lane] = reed.swept;
        self.kappa[lane] = load.kappa;
        self.share[lane] = load.share;
        self.load_strength[lane] = load.strength;
        self.half_strength[lane] = load.half_strength;
        self.state.closing[lane] = state.closing;
        self.state.speed[lane] = state.speed;
        self.state.flow[lane] = state.flow;
        self.state.opening[lane] = state.opening;
        self.state.p_mouthpiece[lane] = state.p_mouthpiece;
    }

    /// The state of the reed in a lane.
    pub fn state(&self, lane: usize) -> ReedState {
        ReedState {
            closing: self.state.closing[lane],
            speed: self.state.speed[lane],
            flow: self.state.flow[lane],
            opening: self.state.opening[lane],
            p_mouthpiece: self.state.p_mouthpiece[lane],
        }
    }

    /// Flows through the channels in the last sample.
    #[inline(always)]
    pub fn flows(&self) -> &[f64; N] {
        &self.state.flow
    }

    /// Pressure in the mouthpiece in the last sample, to be corrected.
    #[inline(always)]
    pub fn p_mouthpiece_mut(&mut self, lane: usize) -> &mut f64 {
        &mut self.state.p_mouthpiece[lane]
    }

    /// See [`ReedState::tick`]. Real-time safe. [audio thread]
    #[inline(always)]
    pub fn tick(
        &mut self,
        tables: &ReedTables,
        p_mouth: &[f64; N],
        p_minus: &[f64; N],
        noise: &[f64; N],
        tongue: &[f64; N],
    ) -> [f64; N] {
        let none = [0.0; N];
        let [mut b, mut free, mut x, mut root, mut whole, mut square] = [none; 6];
        for k in 0..N {
            let (closing, speed) = (self.state.closing[k], self.state.speed[k]);
            let gap = 1.0 - closing * self.per_closing[k];
            let averaged = self.averaged[k] * speed.abs();
            let half = if averaged > self.lay[k] { averaged } else { self.lay[k] };
            let knee = if gap + half > 0.0 { gap + half } else { 0.0 };
            let bent = knee * knee / (4.0 * half);
            let straight = if gap < MAX_OPENING { gap } else { MAX_OPENING };
            let opening = if gap >= half { straight } else { bent };
            self.state.opening[k] = opening;
            b[k] = self.closing[k] * opening;
            free[k] = self.damp[k] * speed + self.drive[k] * (tongue[k] - closing);
            let moved = self.swept[k] * (speed + free[k]);
            x[k] = self.share[k] * (p_mouth[k] - 2.0 * p_minus[k] - self.kappa[k] * (moved + noise[k]));
            let half_load = self.half_strength[k] * b[k];
            whole[k] = (half_load * half_load + x[k].abs()).sqrt();
            root[k] = whole[k] - half_load;
            square[k] = root[k] * root[k];
        }
        let (x_a, x_b) = read(tables, &square);
        let mut p_plus = none;
        for k in 0..N {
            let r = self.compliance[k];
            let sign = 1.0_f64.copysign(x[k]);
            let law = x_a[k] * (b[k] + sign * r * square[k]) - sign * r * x_b[k];
            let table_flow = if b[k] > 0.0 { law } else { 0.0 };
            let divisor = if whole[k] > f64::MIN_POSITIVE { whole[k] } else { f64::MIN_POSITIVE };
            let slope = root[k] / divisor;
            let left = square[k] - self.load_strength[k] * (table_flow - b[k] * root[k]) * slope;
            let p = sign * if left > 0.0 { left } else { 0.0 };
            self.state.p_mouthpiece[k] = p_mouth[k] - p;
            self.state.flow[k] = sign * self.strength[k] * table_flow;
            let speed = free[k] + self.yields[k] * p;
            self.state.speed[k] = speed;
            self.state.closing[k] += self.period[k] * speed;
            p_plus[k] = self.state.p_mouthpiece[k] - p_minus[k];
        }
        p_plus
    }
}

/// [`ReedTables::at`] for all lanes.
#[inline(always)]
fn read<const N: usize>(tables: &ReedTables, p: &[f64; N]) -> ([f64; N], [f64; N]) {
    let none = [0.0; N];
    let (mut way, mut cell) = (none, [0_u64; N]);
    for k in 0..N {
        let position = p[k] * LAST as f64;
        let nearest = position + WHOLE - WHOLE;
        let below = if nearest > position { nearest - 1.0 } else { nearest };
        way[k] = position - below;
        // Beyond the table, or no number: a cell that is not there.
        cell[k] = (below + WHOLE).to_bits().wrapping_sub(WHOLE.to_bits());
    }
    let [mut a, mut a_next, mut b, mut b_next] = [none; 4];
    let mut beyond = false;
    for k in 0..N {
        let i = cell[k] as usize;
        let is_inside = cell[k].wrapping_sub(1) < LAST as u64 - 1;
        beyond |= !is_inside;
        let i = if is_inside { i } else { 1 };
        (a[k], a_next[k], b[k], b_next[k]) =
            (tables.x_a[i], tables.x_a[i + 1], tables.x_b[i], tables.x_b[i + 1]);
    }
    let (mut x_a, mut x_b) = (none, none);
    for k in 0..N {
        x_a[k] = a[k] + way[k] * (a_next[k] - a[k]);
        x_b[k] = b[k] + way[k] * (b_next[k] - b[k]);
    }
    if beyond {
        read_beyond(tables, p, &mut x_a, &mut x_b);
    }
    (x_a, x_b)
}

/// The lanes before the first cell and after the last one: a square root in place of the tables.
#[inline(always)]
fn read_beyond<const N: usize>(tables: &ReedTables, p: &[f64; N], x_a: &mut [f64; N], x_b: &mut [f64; N]) {
    let (first, last) = ((tables.x_a[1], tables.x_b[1]), (tables.x_a[LAST], tables.x_b[LAST]));
    for k in 0..N {
        let position = p[k] * LAST as f64;
        let is_before = !matches!(position.partial_cmp(&1.0), Some(Ordering::Greater | Ordering::Equal));
        let at = if is_before { if position > 0.0 { position } else { 0.0 } } else { p[k] };
        let (a, b) = if is_before { first } else { last };
        let root = at.sqrt();
        let is_beyond = is_before | (position >= LAST as f64);
        x_a[k] = if is_beyond { a * root } else { x_a[k] };
        x_b[k] = if is_beyond { b * at * root } else { x_b[k] };
    }
}
