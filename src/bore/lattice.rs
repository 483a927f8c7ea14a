//! The bore in the time domain: travelling waves between junctions on a half-sample grid.
//!
//! Junctions stand at whole ticks of half a sample, so one way along a cell of `d` ticks takes `d / 2` samples. Only
//! the round trip, `d` samples, must be right: each cell gives `f` rows to the wave going down and `d - f` to the wave
//! coming back, `f` as near to `d / 2` as whole rows allow. The rounding is carried along the bore, so no junction is
//! more than half a sample off its true time and what the holes radiate may be summed row by row. Every filter runs at
//! the sample rate; positions resolve to half of it (1.8 mm at 96 kHz).
//!
//! All junctions are processed eight at a time from one ring of past rows, plain loops over arrays that the compiler
//! turns into vectors. The same source runs with SSE2 or AVX2 and gives the same bits: no fused multiply-add, sums in
//! fixed lanes. Holes go round robin into their chunks; two holes one tick apart then lie in different chunks, and the
//! chunk evaluated first passes its wave on within the row.
//!
//! After van Walstijn & Campbell 2003 (wave digital tone holes) and Kelly & Lochbaum 1962; the network of a hole is in
//! [`tone_hole`](crate::bore::tone_hole), losses in [`wall_loss`](crate::bore::wall_loss).
//!
//! Pressures over a reference pressure P, flows over P / Zc with Zc of a 7.45 mm bore.

use num_complex::Complex64;

use crate::bore::cells::Cells;
use crate::bore::tone_hole::{HoleCoeffs, HoleNetwork};
use crate::bore::wall_loss;
use crate::units::{Air, REFERENCE_RADIUS_M};

/// Junctions processed together.
const LANES: usize = 8;
/// Past rows the ring holds.
const ROWS: usize = 32;
/// Values of one row: 64 waves going down, 64 coming back.
const STRIDE: usize = 128;
const RING: usize = ROWS * STRIDE;
const MASK: u16 = RING as u16 - 1;
/// Where a lane's returning wave is kept in a row.
const BACK: usize = 64;
/// Slot of the wave leaving the reed (among those going down) and of the bell's reflection (among those returning).
const END_SLOT: usize = 63;
/// Slot of the wave that has passed the tuning delay.
const TUNED_SLOT: usize = BACK + 62;
/// Slot that nobody writes, for lanes without a junction.
const IDLE_SLOT: usize = 61;
/// Longest cell, ticks: half of it, and the tuning delay on top, must fit the ring.
pub const MAX_TICKS: u32 = 2 * (ROWS as u32) - 4;
/// Below this a state is nothing: flushed so that no denormal slows a held note.
const TINY: f64 = 1e-18;

/// What the lattice computes in: `f32` to play, `f64` to prove.
pub trait Real:
    Copy
    + Default
    + PartialOrd
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + std::ops::Neg<Output = Self>
    + From<u16>
{
    /// Rounds from f64.
    fn of(x: f64) -> Self;
    /// Widens to f64.
    fn wide(self) -> f64;
    /// Absolute value.
    fn magnitude(self) -> Self;
    /// Whole part of a number that is not negative.
    fn whole(self) -> u16;
}

macro_rules! real {
    ($t:ty) => {
        impl Real for $t {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn whole(self) -> u16 {
                self as u16
            }
        }
    };
}
real!(f32);
real!(f64);

/// What sits at the reed end: takes the arriving wave, gives the leaving one, hears what radiates.
///
/// Implementations mark both `#[inline(always)]` so that they are compiled with the lattice's vector features.
pub trait Tip<F> {
    /// Wave leaving into the bore, for the wave arriving from it.
    fn reflect(&mut self, p_minus: F) -> F;
    /// Total volume flow leaving through holes and bell in this sample.
    fn radiated(&mut self, flow: F);
}

/// Everything of a lattice that playing does not change.
#[derive(Clone, Debug)]
pub struct LatticeCoeffs {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    ticks: Vec<u32>,
    /// Admittance of each cell over the reference.
    admittance: Vec<f64>,
    /// Loss filter of each cell: amount A, coefficient q.
    loss: Vec<(f64, f64)>,
    holes: Vec<HoleCoeffs>,
    /// Jet resistance per flow of each hole at K = 1.
    jets: Vec<f64>,
    hole_junctions: Vec<usize>,
    /// Bell: radiation conductance and half-sample conductance of its mass.
    bell: (f64, f64),
}

impl LatticeCoeffs {
    /// From the cut bore, its holes' networks and the air. `p_ref_pa` is the pressure that everything is relative to.
    pub fn new(cells: &Cells, networks: &[HoleNetwork], p_ref_pa: f64, air: &Air) -> Self {
        let rate_hz = cells.rate_hz;
        let wall = wall_loss::wall_constant(air);
        let tick_m = air.c / (2.0 * rate_hz);
        let losses: Vec<f64> =
            cells.cells.iter().map(|cell| wall * f64::from(cell.ticks) * tick_m / cell.radius_m).collect();
        let amounts = wall_loss::deal(&losses, &cells.loss_strengths);
        let loss = amounts
            .into_iter()
            .enumerate()
            .map(|(cell, amount)| {
                (amount, wall_loss::pole_coefficient(cells.loss_poles_hz[cell % 3], rate_hz))
            })
            .collect();
        let radius = cells.end_radius_m;
        let z_end = air.z_c(radius) / air.z_c(REFERENCE_RADIUS_M);
        let end = crate::bore::tone_hole::END_CORRECTION;
        Self {
            rate_hz,
            ticks: cells.cells.iter().map(|cell| cell.ticks).collect(),
            admittance: cells.cells.iter().map(|cell| (cell.radius_m / REFERENCE_RADIUS_M).powi(2)).collect(),
            loss,
            holes: networks
                .iter()
                .map(|network| HoleCoeffs {
                    rs: network.coeffs(rate_hz, air).rs
                        * if network.register { cells.vent_resistance } else { 1.0 },
                    ..network.coeffs(rate_hz, air)
                })
                .collect(),
            jets: networks.iter().map(|network| network.jet(p_ref_pa, air)).collect(),
            hole_junctions: cells.hole_junctions.clone(),
            bell: (0.25 / (end * end) / z_end, air.c / (2.0 * rate_hz * end * radius * z_end)),
        }
    }

    /// Admittance of the first cell, over the reference: what the reed blows into.
    pub fn tip_admittance(&self) -> f64 {
        self.admittance[0]
    }

    /// Number of tone holes.
    pub fn holes(&self) -> usize {
        self.holes.len()
    }

    /// Reflectance at the tip, exactly what [`Lattice`] does with fixed openings and no jets, at `f_hz`.
    pub fn reflectance(&self, f_hz: f64, opening: &[f64], tuning_rows: f64) -> Complex64 {
        self.looking_down(0, f_hz, opening, tuning_rows)
    }

    /// Reflectance just above a hole of the hole and all that lies below it, for the wave arriving in the cell above.
    /// `|R|^2` falling to 1/2 is the cut-off of the tone-hole lattice when `hole` is the first open one.
    pub fn reflectance_below(&self, f_hz: f64, opening: &[f64], hole: usize) -> Complex64 {
        let junction = self.hole_junctions[hole];
        let z1 = Complex64::from_polar(1.0, -std::f64::consts::TAU * f_hz / self.rate_hz);
        let r = self.looking_down(junction + 1, f_hz, opening, 0.0);
        let below = self.admittance[junction + 1] * (1.0 - r) / (1.0 + r);
        let y = below + self.holes[hole].admittance(z1, opening[hole]);
        (self.admittance[junction] - y) / (self.admittance[junction] + y)
    }

    /// Reflectance at the upper end of cell `top` of all that lies below.
    fn looking_down(&self, top: usize, f_hz: f64, opening: &[f64], tuning_rows: f64) -> Complex64 {
        let z1 = Complex64::from_polar(1.0, -std::f64::consts::TAU * f_hz / self.rate_hz);
        let half = Complex64::from_polar(1.0, -std::f64::consts::PI * f_hz / self.rate_hz);
        let filters: [Complex64; 3] = std::array::from_fn(|pole| {
            let q = self.loss.get(pole).map_or(0.0, |loss| loss.1);
            q / (1.0 - (1.0 - q) * z1)
        });
        let last = self.ticks.len() - 1;
        let mut y = self.bell.0 + self.bell.1 * (1.0 + z1) / (1.0 - z1);
        let tuned = self.tuned_cell();
        let mut hole = self.holes.len();
        for cell in (top..=last).rev() {
            let own = self.admittance[cell];
            let low_pass = filters[cell % 3];
            let pass = 1.0 - self.loss[cell].0 * (1.0 - low_pass);
            let mut r = (own - y) / (own + y) * half.powu(2 * self.ticks[cell]) * pass * pass;
            if cell == tuned && tuning_rows != 0.0 {
                let whole = tuning_rows.floor();
                let part = tuning_rows - whole;
                r *= z1.powi(whole as i32) * (1.0 - part + part * z1);
            }
            if cell == top {
                return r;
            }
            y = own * (1.0 - r) / (1.0 + r);
            if hole > 0 && self.hole_junctions[hole - 1] == cell - 1 {
                hole -= 1;
                y += self.holes[hole].admittance(z1, opening[hole]);
            }
        }
        Complex64::default()
    }

    /// `Z_in / Zc` at the tip without reed volume, see [`reflectance`](Self::reflectance).
    pub fn impedance(&self, f_hz: f64, opening: &[f64]) -> Complex64 {
        let r = self.reflectance(f_hz, opening, 0.0);
        (1.0 + r) / (1.0 - r) / self.admittance[0]
    }

    /// The cell that holds the tuning delay: the longest between the first junction and the first hole.
    fn tuned_cell(&self) -> usize {
        let end = self.hole_junctions.first().copied().unwrap_or(self.ticks.len() - 1).max(1);
        (1..=end).max_by_key(|&cell| (self.ticks[cell], std::cmp::Reverse(cell))).unwrap_or(1)
    }

    /// Range of the tuning delay, rows of the round trip.
    pub fn tuning_range(&self) -> (f64, f64) {
        let back = f64::from(self.rows(self.tuned_cell()).1);
        (1.0 - back, (ROWS - 2) as f64 - back)
    }

    /// Rows a cell gives to the wave going down and to the one coming back.
    fn rows(&self, wanted: usize) -> (u32, u32) {
        self.all_rows().nth(wanted).unwrap_or_default()
    }

    fn all_rows(&self) -> impl Iterator<Item = (u32, u32)> {
        let mut off = 0.0;
        self.ticks.iter().enumerate().map(move |(cell, &ticks)| {
            let down = if ticks == 1 {
                // The chunk that is evaluated first passes its wave on within the row.
                u32::from(self.chunk_of(cell - 1) > self.chunk_of(cell))
            } else if ticks % 2 == 1 {
                if off > 0.0 { ticks / 2 } else { ticks / 2 + 1 }
            } else {
                ticks / 2
            };
            off += f64::from(down) - 0.5 * f64::from(ticks);
            (down, ticks - down)
        })
    }

    fn hole_chunks(&self) -> usize {
        self.holes
            .len()
            .div_ceil(LANES)
            .max(usize::from(self.holes.len() > 1) + usize::from(!self.holes.is_empty()))
    }

    fn step_chunks(&self) -> usize {
        (self.ticks.len() - 1 - self.holes.len()).div_ceil(LANES)
    }

    /// Chunk a junction is evaluated in; steps come first.
    fn chunk_of(&self, junction: usize) -> usize {
        self.lane_of(junction) / LANES
    }

    fn lane_of(&self, junction: usize) -> usize {
        let before = self.hole_junctions.partition_point(|&hole| hole < junction);
        if self.hole_junctions.get(before) == Some(&junction) {
            let chunks = self.hole_chunks();
            (self.step_chunks() + before % chunks) * LANES + before / chunks
        } else {
            junction - before
        }
    }
}

type Octet<F> = [F; LANES];

/// One-pole loss of both waves arriving at eight junctions, and where they come from: `y = x - m (x - s)` with
/// `m = A (1 - q)`, then `s += q (x - s)`.
#[derive(Clone)]
#[repr(C, align(64))]
struct Arrivals<F> {
    offset: [[u16; LANES]; 2],
    /// m, see above.
    taken: [Octet<F>; 2],
    q: [Octet<F>; 2],
    state: [Octet<F>; 2],
}

impl<F: Real> Arrivals<F> {
    fn idle(slot: usize) -> Self {
        let nothing = [Octet::default(); 2];
        Self { offset: [[slot as u16; LANES]; 2], taken: nothing, q: nothing, state: nothing }
    }

    /// Waves arriving at eight junctions on one side, after their cell's loss.
    #[inline(always)]
    fn gather<const SIDE: usize>(&mut self, ring: &[F; RING], base: u16) -> Octet<F> {
        let mut wave = Octet::<F>::default();
        for (wave, offset) in wave.iter_mut().zip(self.offset[SIDE]) {
            *wave = ring[(base.wrapping_add(offset) & MASK) as usize];
        }
        let (taken, q, state) = (&self.taken[SIDE], &self.q[SIDE], &mut self.state[SIDE]);
        for k in 0..LANES {
            let difference = wave[k] - state[k];
            state[k] = state[k] + q[k] * difference;
            wave[k] = wave[k] - taken[k] * difference;
        }
        wave
    }

    #[inline(always)]
    fn flush(&mut self) {
        self.state.iter_mut().flatten().for_each(flush);
    }
}

/// Written unconditionally: only so do loops over it become vectors.
#[inline(always)]
fn flush<F: Real>(x: &mut F) {
    *x = if x.magnitude() < F::of(TINY) { F::default() } else { *x };
}

/// Writes the waves leaving eight junctions, down the bore and back.
#[inline(always)]
fn leave<F: Real>(ring: &mut [F; RING], row: usize, down: &Octet<F>, back: &Octet<F>) {
    let row = row & (RING - 1) & !(LANES - 1);
    for (side, wave) in [(row, down), (row | BACK, back)] {
        if let Some(slots) = ring.get_mut(side..side + LANES) {
            slots.copy_from_slice(wave);
        }
    }
}

/// Eight changes of section.
#[derive(Clone)]
#[repr(C, align(64))]
struct Steps<F> {
    arrivals: Arrivals<F>,
    /// Weight of the left wave in the pressure, 2 Y_left / (Y_left + Y_right); 2 less this is that of the right one.
    weight: Octet<F>,
}

impl<F: Real> Steps<F> {
    #[inline(always)]
    fn tick(&mut self, ring: &mut [F; RING], base: u16, slot: usize) {
        let left = self.arrivals.gather::<0>(ring, base);
        let right = self.arrivals.gather::<1>(ring, base);
        let (mut down, mut back) = (Octet::<F>::default(), Octet::<F>::default());
        for k in 0..LANES {
            let difference = left[k] - right[k];
            down[k] = right[k] + self.weight[k] * difference;
            back[k] = down[k] - difference;
        }
        leave(ring, base as usize + slot, &down, &back);
    }
}

/// Eight tone holes.
#[derive(Clone)]
#[repr(C, align(64))]
struct Holes<F> {
    arrivals: Arrivals<F>,
    y_left: Octet<F>,
    y_right: Octet<F>,
    y_sum: Octet<F>,
    r1: Octet<F>,
    minus_r1: Octet<F>,
    gc: Octet<F>,
    minus_gc2: Octet<F>,
    gl2: Octet<F>,
    outside: Octet<F>,
    rs0: Octet<F>,
    /// Jet resistance per flow of the open hole, and as it stands.
    jet_open: Octet<F>,
    jet: Octet<F>,
    opening: Octet<F>,
    glide: Octet<F>,
    resistance: Octet<F>,
    outer: Octet<F>,
    compliance: Octet<F>,
    inner: Octet<F>,
}

impl<F: Real> Holes<F> {
    /// A hole opened by `a` passes its jet through `a^2` of its area (its mass, too, is 1 / a^2 of the open one's). Seen
    /// behind the transformer the loss is then 1 / a^2 of the open hole's: it is what quietens the air column when the
    /// fingers leave many holes at once. Held below a bound where no air passes anyway.
    ///
    /// True if a hole is on its way. Seldom called, hence not inlined: it would crowd the loop over samples.
    #[inline(never)]
    fn throttle(&mut self) -> bool {
        for k in 0..LANES {
            let area = self.opening[k] * self.opening[k];
            self.jet[k] = self.jet_open[k] / (area + F::of(0.02) * (F::of(1.0) - area));
        }
        self.glide != Octet::default()
    }

    #[inline(always)]
    fn glide(&mut self) {
        for k in 0..LANES {
            self.opening[k] = self.opening[k] + self.glide[k];
        }
    }

    /// The network of [`tone_hole`](crate::bore::tone_hole) at eight junctions, one sample; the flows leaving outside.
    #[inline(always)]
    fn tick(&mut self, ring: &mut [F; RING], base: u16, slot: usize) -> Octet<F> {
        let left = self.arrivals.gather::<0>(ring, base);
        let right = self.arrivals.gather::<1>(ring, base);
        let one = F::of(1.0);
        let (mut down, mut back, mut radiated) = (Octet::default(), Octet::default(), Octet::default());
        for k in 0..LANES {
            let a = self.opening[k];
            let rs = self.resistance[k];
            let k2 = one / (one + rs * self.outside[k]);
            let g2 = self.outside[k] * k2;
            let gp = self.gc[k] + a * a * g2;
            let w = one + gp * self.r1[k];

            let h2 = self.outer[k] * k2;
            let inner = self.inner[k];
            let source = self.compliance[k] + a * h2 - gp * inner;
            let arriving = self.y_left[k] * left[k] + self.y_right[k] * right[k];
            let p = (arriving * w - source) / (self.y_sum[k] * w + gp);
            // The flow into the hole is also arriving - y_sum p, but in single precision that difference is noise.
            let rise = self.minus_r1[k] / w * (gp * p + source);
            let node = p - inner + rise;
            let outside = a * node;
            let flow = g2 * outside + h2;
            self.outer[k] = self.outer[k] + self.gl2[k] * (outside - rs * flow);
            self.compliance[k] = self.minus_gc2[k] * node - self.compliance[k];
            self.inner[k] = rise + rise - inner;
            let leaving = a * flow;
            radiated[k] = leaving;
            self.resistance[k] = self.rs0[k] + self.jet[k] * leaving.magnitude();
            down[k] = p - right[k];
            back[k] = p - left[k];
        }
        leave(ring, base as usize + slot, &down, &back);
        radiated
    }
}

/// The playing lattice: state, and the coefficients that move with the fingers.
#[derive(Clone)]
pub struct Lattice<F> {
    ring: Box<[F; RING]>,
    steps: Box<[Steps<F>]>,
    holes: Box<[Holes<F>]>,
    hole_lanes: Box<[(usize, usize)]>,
    jets: Box<[f64]>,
    /// Where the present row begins in the ring.
    base: u16,
    tip: EndLoss<F>,
    end: EndLoss<F>,
    bell_y: F,
    bell_y2: F,
    bell_share: F,
    bell_g2: F,
    bell_state: F,
    tuned_source: u16,
    tuned_rows: u16,
    /// Rows the returning wave of the tuned cell takes, and their change per row.
    delay: F,
    delay_glide: F,
    /// Openings or jets have changed since they were last matched.
    moved: bool,
    avx2: bool,
}

#[derive(Clone, Copy)]
struct EndLoss<F> {
    offset: u16,
    taken: F,
    q: F,
    state: F,
}

impl<F: Real> EndLoss<F> {
    #[inline(always)]
    fn take(&mut self, ring: &[F; RING], base: u16) -> F {
        let wave = ring[(base.wrapping_add(self.offset) & MASK) as usize];
        let difference = wave - self.state;
        self.state = self.state + self.q * difference;
        wave - self.taken * difference
    }
}

fn back_rows(rows: u32, slot: usize) -> u16 {
    (slot as u16).wrapping_sub(rows as u16 * STRIDE as u16)
}

impl<F: Real> Lattice<F> {
    /// A silent lattice with all holes closed. Allocates.
    pub fn new(coeffs: &LatticeCoeffs) -> Self {
        let junctions = coeffs.ticks.len() - 1;
        let one = F::of(1.0);
        let ones = [one; LANES];
        let none = Octet::<F>::default();
        let mut steps =
            vec![Steps { arrivals: Arrivals::idle(IDLE_SLOT), weight: ones }; coeffs.step_chunks()];
        let idle = Holes {
            arrivals: Arrivals::idle(IDLE_SLOT),
            y_left: none,
            y_right: none,
            y_sum: ones,
            r1: none,
            minus_r1: none,
            gc: none,
            minus_gc2: none,
            gl2: none,
            outside: none,
            rs0: none,
            jet_open: none,
            jet: none,
            opening: none,
            glide: none,
            resistance: none,
            outer: none,
            compliance: none,
            inner: none,
        };
        let mut holes = vec![idle; coeffs.hole_chunks()];
        let tuned = coeffs.tuned_cell();
        for junction in 0..junctions {
            let lane = coeffs.lane_of(junction);
            let (chunk, k) = (lane / LANES, lane % LANES);
            let (left, right) = (junction, junction + 1);
            let down = coeffs.rows(left).0;
            let back = coeffs.rows(right).1;
            let from_left = if junction == 0 { END_SLOT } else { coeffs.lane_of(junction - 1) };
            let from_right =
                if right == junctions { BACK + END_SLOT } else { BACK + coeffs.lane_of(junction + 1) };
            let arrivals = match chunk.checked_sub(steps.len()) {
                None => {
                    let (y_left, y_right) = (coeffs.admittance[left], coeffs.admittance[right]);
                    steps[chunk].weight[k] = F::of(2.0 * y_left / (y_left + y_right));
                    &mut steps[chunk].arrivals
                }
                Some(chunk) => {
                    let index = coeffs.hole_junctions.partition_point(|&hole| hole < junction);
                    let (hole, lanes) = (coeffs.holes[index], &mut holes[chunk]);
                    lanes.y_left[k] = F::of(2.0 * coeffs.admittance[left]);
                    lanes.y_right[k] = F::of(2.0 * coeffs.admittance[right]);
                    lanes.y_sum[k] = F::of(coeffs.admittance[left] + coeffs.admittance[right]);
                    lanes.r1[k] = F::of(hole.r1);
                    lanes.minus_r1[k] = F::of(-hole.r1);
                    lanes.gc[k] = F::of(hole.gc);
                    lanes.minus_gc2[k] = F::of(-2.0 * hole.gc);
                    lanes.gl2[k] = F::of(2.0 * hole.gl);
                    lanes.outside[k] = F::of(hole.gl + hole.gp);
                    lanes.rs0[k] = F::of(hole.rs);
                    lanes.resistance[k] = F::of(hole.rs);
                    &mut lanes.arrivals
                }
            };
            arrivals.offset[0][k] = back_rows(down, from_left);
            arrivals.offset[1][k] =
                if right == tuned { TUNED_SLOT as u16 } else { back_rows(back, from_right) };
            for (side, cell) in [left, right].into_iter().enumerate() {
                let (amount, q) = coeffs.loss[cell];
                arrivals.taken[side][k] = F::of(amount * (1.0 - q));
                arrivals.q[side][k] = F::of(q);
            }
        }
        let end = |cell: usize, offset: u16| EndLoss {
            offset,
            taken: F::of(coeffs.loss[cell].0 * (1.0 - coeffs.loss[cell].1)),
            q: F::of(coeffs.loss[cell].1),
            state: F::default(),
        };
        let last_lane = coeffs.lane_of(junctions - 1);
        let bell_y = coeffs.admittance[junctions];
        let tuned_right = if tuned == junctions { END_SLOT } else { coeffs.lane_of(tuned) };
        Self {
            // PANIC: the vector has exactly RING elements.
            ring: vec![F::default(); RING].into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!()),
            steps: steps.into(),
            holes: holes.into(),
            hole_lanes: (0..coeffs.holes.len())
                .map(|hole| coeffs.lane_of(coeffs.hole_junctions[hole]))
                .map(|lane| (lane / LANES - coeffs.step_chunks(), lane % LANES))
                .collect(),
            jets: coeffs.jets.clone().into(),
            base: 0,
            tip: end(0, back_rows(coeffs.rows(0).1, BACK + coeffs.lane_of(0))),
            end: end(junctions, back_rows(coeffs.rows(junctions).0, last_lane)),
            bell_y: F::of(bell_y),
            bell_y2: F::of(2.0 * bell_y),
            bell_share: F::of(1.0 / (bell_y + coeffs.bell.0 + coeffs.bell.1)),
            bell_g2: F::of(2.0 * coeffs.bell.1),
            bell_state: F::default(),
            tuned_source: (BACK + tuned_right) as u16,
            tuned_rows: coeffs.rows(tuned).1 as u16,
            delay: F::of(f64::from(coeffs.rows(tuned).1)),
            delay_glide: F::default(),
            moved: true,
            avx2: has_avx2(),
        }
    }

    /// Silence; openings, delay and loss stay. Real-time safe.
    pub fn reset(&mut self) {
        self.ring.fill(F::default());
        self.steps.iter_mut().for_each(|steps| steps.arrivals.state = Default::default());
        for holes in &mut *self.holes {
            holes.arrivals.state = Default::default();
            holes.resistance = holes.rs0;
            for state in [&mut holes.outer, &mut holes.compliance, &mut holes.inner] {
                *state = Octet::default();
            }
        }
        self.tip.state = F::default();
        self.end.state = F::default();
        self.bell_state = F::default();
        self.base = 0;
    }

    /// Use the plain code path even where AVX2 is there (to prove that both give the same bits).
    pub fn without_avx2(mut self) -> Self {
        self.avx2 = false;
        self
    }

    /// Opening of a hole, 0 closed ..= 1 open, at once. Real-time safe.
    pub fn set_opening(&mut self, hole: usize, opening: f64) {
        let (chunk, lane) = self.hole_lanes[hole];
        self.holes[chunk].opening[lane] = F::of(opening.clamp(0.0, 1.0));
        self.holes[chunk].glide[lane] = F::default();
        self.moved = true;
    }

    /// Starts a hole towards an opening that it reaches after `samples`; set it there with
    /// [`set_opening`](Self::set_opening) then. Real-time safe.
    pub fn glide_opening(&mut self, hole: usize, opening: f64, samples: usize) {
        let (chunk, lane) = self.hole_lanes[hole];
        let from = self.holes[chunk].opening[lane].wide();
        self.holes[chunk].glide[lane] = F::of((opening.clamp(0.0, 1.0) - from) / samples as f64);
        self.moved = true;
    }

    /// Strength of the jet's loss in all holes: K, 0 (linear) ..= 4; 2 is physical for sharp edges. Real-time safe.
    pub fn set_jet_loss(&mut self, k: f64) {
        for (&(chunk, lane), jet) in self.hole_lanes.iter().zip(&*self.jets) {
            self.holes[chunk].jet_open[lane] = F::of(k * jet);
        }
        self.moved = true;
    }

    /// Tuning delay, rows of the round trip, clamped to what the cell can give; reached after `samples`, 0 for at once.
    /// Real-time safe.
    pub fn glide_delay(&mut self, rows: f64, samples: usize) {
        let rows = (rows + f64::from(self.tuned_rows)).clamp(1.0, (ROWS - 2) as f64);
        if samples == 0 {
            self.delay = F::of(rows);
            self.delay_glide = F::default();
        } else {
            self.delay_glide = F::of((rows - self.delay.wide()) / samples as f64);
        }
    }

    /// Runs `samples` samples (a control tick) with `tip` at the reed end; jets of moving holes are brought up to date
    /// once a call. Real-time safe. [audio thread]
    pub fn run<T: Tip<F>>(&mut self, samples: usize, tip: &mut T) {
        #[cfg(target_arch = "x86_64")]
        if self.avx2 {
            // The crate's one unsafe call of its own: the feature was checked when the lattice was built.
            #[allow(unsafe_code)]
            // SAFETY: `avx2` is only set where the processor has AVX2.
            unsafe {
                run_avx2(self, samples, tip)
            };
            return;
        }
        run_body(self, samples, tip);
    }

    /// Zeroes states too small to hear before they become denormal. Call every few hundred samples. Real-time safe.
    pub fn flush(&mut self) {
        self.ring.iter_mut().for_each(flush);
        self.steps.iter_mut().for_each(|steps| steps.arrivals.flush());
        for holes in &mut *self.holes {
            holes.arrivals.flush();
            for state in [&mut holes.outer, &mut holes.compliance, &mut holes.inner] {
                state.iter_mut().for_each(flush);
            }
        }
        flush(&mut self.tip.state);
        flush(&mut self.end.state);
        flush(&mut self.bell_state);
    }

    /// True when every state is finite.
    pub fn is_finite(&self) -> bool {
        self.ring.iter().all(|x| x.wide().is_finite())
            && self.holes.iter().all(|h| h.outer.iter().chain(&h.compliance).all(|x| x.wide().is_finite()))
    }

    /// Largest magnitude of any wave still travelling.
    pub fn peak(&self) -> f64 {
        self.ring.iter().map(|x| x.wide().abs()).fold(0.0, f64::max)
    }

    /// True if any state is subnormal.
    pub fn has_subnormal(&self) -> bool {
        let tiny = |x: &F| x.wide() != 0.0 && x.wide().abs() < f64::from(f32::MIN_POSITIVE);
        self.ring.iter().any(tiny)
            || self.holes.iter().any(|h| h.outer.iter().chain(&h.compliance).chain(&h.inner).any(tiny))
            || self.holes.iter().any(|h| h.arrivals.state.iter().flatten().any(tiny))
            || self.steps.iter().any(|s| s.arrivals.state.iter().flatten().any(tiny))
            || [self.tip.state, self.end.state, self.bell_state].iter().any(tiny)
    }

    /// Energy of everything in the bore, in units of a wave of pressure 1 passing the reference section for one sample;
    /// `coeffs` are those the lattice was made from. For proofs, not for the audio path.
    ///
    /// Waves in flight count with their cell's admittance, and the row that a fractional tuning delay has half read with
    /// the part still to come. A loss filter holds `Y A (1 - q) / q l^2`; a trapezoidal element of conductance G or
    /// resistance R with state s holds `s^2 / 4G`, `s^2 / 4R`. Without sources this never grows while the delay rests.
    pub fn stored_energy(&self, coeffs: &LatticeCoeffs) -> f64 {
        let last = coeffs.ticks.len() - 1;
        let tuned = coeffs.tuned_cell();
        let row = u32::from(self.base) / STRIDE as u32;
        let square = |slot: usize, age: u32| {
            let wave = self.ring[(row.wrapping_sub(age) as usize & (ROWS - 1)) * STRIDE + slot].wide();
            wave * wave
        };
        let mut energy = 0.0;
        for (cell, (down, back)) in coeffs.all_rows().enumerate() {
            let from_left = if cell == 0 { END_SLOT } else { coeffs.lane_of(cell - 1) };
            let from_right = BACK + if cell == last { END_SLOT } else { coeffs.lane_of(cell) };
            let mut waves: f64 = (0..down).map(|age| square(from_left, age)).sum();
            if cell == tuned {
                let rows = self.delay.wide();
                let whole = rows as u32;
                waves += (0..whole).map(|age| square(from_right, age)).sum::<f64>();
                waves += (rows - f64::from(whole)) * square(from_right, whole);
            } else {
                waves += (0..back).map(|age| square(from_right, age)).sum::<f64>();
            }
            let (amount, q) = coeffs.loss[cell];
            let at_right = if cell == last { self.end.state } else { self.arrivals(coeffs.lane_of(cell), 0) };
            let at_left = if cell == 0 { self.tip.state } else { self.arrivals(coeffs.lane_of(cell - 1), 1) };
            let filters = at_right.wide().powi(2) + at_left.wide().powi(2);
            energy += coeffs.admittance[cell] * (waves + amount * (1.0 - q) / q * filters);
        }
        for (hole, &(chunk, lane)) in coeffs.holes.iter().zip(&*self.hole_lanes) {
            let state = |of: &Octet<F>| of[lane].wide() * of[lane].wide() / 4.0;
            let lanes = &self.holes[chunk];
            energy += state(&lanes.outer) / hole.gl
                + state(&lanes.compliance) / hole.gc
                + state(&lanes.inner) / hole.r1;
        }
        energy + self.bell_state.wide().powi(2) / (4.0 * coeffs.bell.1)
    }

    /// State of the loss filter on one side of a junction.
    fn arrivals(&self, lane: usize, side: usize) -> F {
        let (chunk, lane) = (lane / LANES, lane % LANES);
        let arrivals = match chunk.checked_sub(self.steps.len()) {
            None => &self.steps[chunk].arrivals,
            Some(chunk) => &self.holes[chunk].arrivals,
        };
        arrivals.state[side][lane]
    }

    /// Fills every state with `value()`; for tests that start from anything.
    pub fn scatter(&mut self, mut value: impl FnMut() -> f64) {
        let mut next = || F::of(value());
        for chunk in 0..self.steps.len() + self.holes.len() {
            for row in 0..ROWS {
                for slot in [row * STRIDE + chunk * LANES, row * STRIDE + BACK + chunk * LANES] {
                    self.ring[slot..slot + LANES].iter_mut().for_each(|x| *x = next());
                }
            }
        }
        for row in 0..ROWS {
            self.ring[row * STRIDE + END_SLOT] = next();
            self.ring[row * STRIDE + BACK + END_SLOT] = next();
        }
        for holes in &mut *self.holes {
            for k in 0..LANES {
                (holes.outer[k], holes.compliance[k], holes.inner[k]) = (next(), next(), next());
            }
            holes.arrivals.state.iter_mut().flatten().for_each(|x| *x = next());
        }
        self.steps.iter_mut().for_each(|s| s.arrivals.state.iter_mut().flatten().for_each(|x| *x = next()));
        (self.tip.state, self.end.state, self.bell_state) = (next(), next(), next());
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

#[cfg(not(target_arch = "x86_64"))]
fn has_avx2() -> bool {
    false
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<F: Real, T: Tip<F>>(lattice: &mut Lattice<F>, samples: usize, tip: &mut T) {
    run_body(lattice, samples, tip);
}

#[inline(always)]
fn run_body<F: Real, T: Tip<F>>(lattice: &mut Lattice<F>, samples: usize, tip: &mut T) {
    let moving = lattice.moved;
    if moving {
        lattice.moved = lattice.holes.iter_mut().fold(false, |moving, holes| holes.throttle() | moving);
    }
    let ring = &mut *lattice.ring;
    for _ in 0..samples {
        let base = (lattice.base + STRIDE as u16) & (MASK + 1 - STRIDE as u16);
        lattice.base = base;
        if moving {
            lattice.holes.iter_mut().for_each(Holes::glide);
        }

        // The returning wave of the tuned cell, delayed by whole rows and a linear part between two.
        lattice.delay = lattice.delay + lattice.delay_glide;
        let whole = lattice.delay.whole();
        let part = lattice.delay - F::from(whole);
        let near = lattice.tuned_source.wrapping_add(base).wrapping_sub(whole.wrapping_mul(STRIDE as u16));
        let (near, far) = (near & MASK, near.wrapping_sub(STRIDE as u16) & MASK);
        let wave = ring[near as usize] + part * (ring[far as usize] - ring[near as usize]);
        ring[(base as usize + TUNED_SLOT) & (RING - 1)] = wave;

        let p_minus = lattice.tip.take(ring, base);
        ring[(base as usize + END_SLOT) & (RING - 1)] = tip.reflect(p_minus);

        // The open end: radiation conductance and mass in parallel.
        let arriving = lattice.end.take(ring, base);
        let p_end = (lattice.bell_y2 * arriving - lattice.bell_state) * lattice.bell_share;
        lattice.bell_state = lattice.bell_state + lattice.bell_g2 * p_end;
        let reflected = p_end - arriving;
        ring[(base as usize + BACK + END_SLOT) & (RING - 1)] = reflected;
        let mut flow = lattice.bell_y * (arriving - reflected);

        let mut slot = 0;
        for steps in &mut *lattice.steps {
            steps.tick(ring, base, slot);
            slot += LANES;
        }
        let mut lanes = Octet::<F>::default();
        for holes in &mut *lattice.holes {
            let radiated = holes.tick(ring, base, slot);
            slot += LANES;
            for k in 0..LANES {
                lanes[k] = lanes[k] + radiated[k];
            }
        }
        for lane in lanes {
            flow = flow + lane;
        }
        tip.radiated(flow);
    }
}
