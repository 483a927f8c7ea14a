//! The lattice once more, slowly: one clock of half samples, one history per cell and direction, no rows, no lanes.
//!
//! Every junction stands at its whole tick and computes at the samples' ticks if that is even, half a sample later if it
//! is odd; a wave needs exactly its cell's ticks. Coefficients are worked out here from the cells and the holes'
//! networks, none are taken from `LatticeCoeffs`. Holes keep their nonlinear loss. Scalar f64.

use chalumeau_core::bore::cells::Cells;
use chalumeau_core::bore::tone_hole::HoleNetwork;

use chalumeau_core::units::Air;

/// Ticks a wave is remembered.
const MEMORY: usize = 1024;

/// Waves that left one end of a cell, by tick.
struct History([f64; MEMORY]);

impl History {
    fn at(&self, tick: usize, ago: usize) -> f64 {
        self.0[(tick + MEMORY - ago) % MEMORY]
    }
}

/// One-pole wall loss of one direction of one cell.
#[derive(Clone, Copy)]
struct Loss {
    amount: f64,
    q: f64,
    low: f64,
}

impl Loss {
    fn pass(&mut self, x: f64) -> f64 {
        self.low += self.q * (x - self.low);
        x - self.amount * (x - self.low)
    }
}

struct Cell {
    ticks: usize,
    y: f64,
    down: History,
    back: History,
    loss_down: Loss,
    loss_back: Loss,
}

/// A tone hole: the elements of `HoleNetwork` under the trapezoidal rule.
struct Hole {
    r1: f64,
    gc: f64,
    gl: f64,
    gp: f64,
    rs0: f64,
    rs: f64,
    jet: f64,
    opening: f64,
    hl: f64,
    hc: f64,
    e1: f64,
}

impl Hole {
    /// Pressure at the junction and flow leaving outside.
    fn scatter(&mut self, (y_left, left): (f64, f64), (y_right, right): (f64, f64)) -> (f64, f64) {
        let a = self.opening;
        let k2 = 1.0 / (1.0 + self.rs * (self.gl + self.gp));
        let g2 = (self.gl + self.gp) * k2;
        let gp = self.gc + a * a * g2;
        let d = 1.0 / (1.0 + gp * self.r1);
        // The jet of a hole opened by `a` passes through `a^2` of its area; a leak of 2 % stays.
        let area = a * a + 0.02 * (1.0 - a * a);
        let g0 = gp * d;
        let h2 = self.hl * k2;
        let source = (self.hc + a * h2 - gp * self.e1) * d;
        let p = (2.0 * y_left * left + 2.0 * y_right * right - source) / (y_left + y_right + g0);
        let current = g0 * p + source;
        let inside = p - self.e1 - self.r1 * current;
        let outside = a * inside;
        let flow = g2 * outside + h2;
        self.hl += 2.0 * self.gl * (outside - self.rs * flow);
        self.hc = -(2.0 * self.gc * inside + self.hc);
        self.e1 = -(2.0 * self.r1 * current + self.e1);
        self.rs = self.rs0 + self.jet / area * (a * flow).abs();
        (p, a * flow)
    }
}

/// The open end: first-order reflection of an unflanged pipe.
struct Bell {
    reflection: [f64; 3],
    last_in: f64,
    last_out: f64,
}

/// The whole bore.
pub struct Oracle {
    cells: Vec<Cell>,
    /// Tick of each junction; the last entry is the bell.
    at: Vec<usize>,
    /// Hole at each junction.
    hole_at: Vec<Option<usize>>,
    holes: Vec<Hole>,
    bell: Bell,
    tuned: usize,
    tuning_ticks: f64,
    tick: usize,
    /// Flow that left through each hole and, last, the bell in this sample, at the tick of [`odd`](Self::odd).
    pub flows: Vec<f64>,
}

impl Oracle {
    /// A silent bore; `jet_loss` is K, `tuning_rows` the delay added to the round trip of the longest top cell, samples.
    pub fn new(
        design: &Cells,
        networks: &[HoleNetwork],
        p_ref_pa: f64,
        air: &Air,
        opening: &[f64],
        jet_loss: f64,
        tuning_rows: f64,
    ) -> Self {
        let rate = design.rate_hz;
        let section = |radius: f64| std::f64::consts::PI * radius * radius;
        let z_ref = air.rho * air.c / section(design.nominal_radius_m);
        let prandtl = air.mu * air.cp / air.kappa;
        let wall = 1.05 * (1.0 + (air.gamma - 1.0) / prandtl.sqrt()) * (air.mu / air.rho).sqrt() / air.c;

        // Loss up to each cell's upper end, and to its middle.
        let mut upper = vec![0.0];
        for cell in &design.cells {
            let length = f64::from(cell.ticks) * air.c / (2.0 * rate);
            upper.push(upper[upper.len() - 1] + wall * length / cell.radius_m);
        }
        let middle = |cell: usize| 0.5 * (upper[cell] + upper[cell + 1]);
        let count = design.cells.len();
        let loss = |cell: usize| {
            let from = if cell < 3 { 0.0 } else { 0.5 * (middle(cell - 3) + middle(cell)) };
            let to = if cell + 3 < count { 0.5 * (middle(cell) + middle(cell + 3)) } else { upper[count] };
            let amount = 1.0 - (-design.loss_strengths[cell % 3] * (to - from)).exp();
            let q = 1.0 - (-2.0 * std::f64::consts::PI * design.loss_poles_hz[cell % 3] / rate).exp();
            Loss { amount, q, low: 0.0 }
        };
        let cells: Vec<Cell> = (0..count)
            .map(|cell| Cell {
                ticks: design.cells[cell].ticks as usize,
                y: section(design.cells[cell].radius_m) / section(design.nominal_radius_m),
                down: History([0.0; MEMORY]),
                back: History([0.0; MEMORY]),
                loss_down: loss(cell),
                loss_back: loss(cell),
            })
            .collect();
        let at = cells.iter().scan(0, |tick, cell| {
            *tick += cell.ticks;
            Some(*tick)
        });
        let holes = networks.iter().zip(opening).map(|(network, &opening)| {
            let rs = network.r_s / z_ref * if network.register { design.vent_resistance } else { 1.0 };
            Hole {
                r1: 2.0 * rate * network.m1 / z_ref,
                gc: 2.0 * rate * network.c * z_ref,
                gl: z_ref / (2.0 * rate * network.m2),
                gp: z_ref / network.r_p,
                rs0: rs,
                rs,
                jet: jet_loss * air.rho * p_ref_pa / (2.0 * (z_ref * network.area_m2).powi(2)),
                opening,
                hl: 0.0,
                hc: 0.0,
                e1: 0.0,
            }
        });
        let (d, b) = (0.6133, 0.25);
        let ratio = cells[count - 1].y * section(design.nominal_radius_m) / section(design.end_radius_m);
        let k = 2.0 * rate * design.end_radius_m / air.c;
        let (num, den) = ((b / d - ratio * d) * k, (b / d + ratio * d) * k);
        let reflection = [-(1.0 + num) / (1.0 + den), -(1.0 - num) / (1.0 + den), (1.0 - den) / (1.0 + den)];
        let first_hole = design.hole_junctions[0];
        let longest = (1..=first_hole).map(|cell| cells[cell].ticks).max().unwrap();
        let junctions = 0..count - 1;
        Self {
            at: at.collect(),
            hole_at: junctions.map(|j| design.hole_junctions.iter().position(|&hole| hole == j)).collect(),
            holes: holes.collect(),
            bell: Bell { reflection, last_in: 0.0, last_out: 0.0 },
            tuned: (1..=first_hole).find(|&cell| cells[cell].ticks == longest).unwrap(),
            tuning_ticks: 2.0 * tuning_rows,
            tick: 0,
            flows: vec![0.0; networks.len() + 1],
            cells,
        }
    }

    /// Which of [`flows`](Self::flows) are half a sample later than the others.
    pub fn odd(&self) -> Vec<bool> {
        let holes = self.at.iter().zip(&self.hole_at).filter(|(_, hole)| hole.is_some());
        holes.map(|(at, _)| at % 2 == 1).chain([self.at[self.at.len() - 1] % 2 == 1]).collect()
    }

    /// One sample; `reed` gives the wave leaving into the bore for the one arriving from it.
    pub fn sample(&mut self, reed: impl FnOnce(f64) -> f64) {
        let wave = self.returning(0);
        self.cells[0].down.0[self.tick % MEMORY] = reed(wave);
        for parity in 0..2 {
            for junction in 0..self.hole_at.len() {
                if self.at[junction] % 2 == parity {
                    self.junction(junction);
                }
            }
            if self.at[self.hole_at.len()] % 2 == parity {
                self.open_end();
            }
            self.tick += 1;
        }
    }

    /// Wave arriving at the upper end of a cell.
    fn returning(&mut self, cell: usize) -> f64 {
        let (tick, tuned, tuning) = (self.tick, self.tuned, self.tuning_ticks);
        let cell_index = cell;
        let cell = &mut self.cells[cell];
        let mut wave = cell.back.at(tick, cell.ticks);
        if cell_index == tuned {
            let whole = (tuning / 2.0).floor();
            let part = tuning / 2.0 - whole;
            let ago = (cell.ticks as f64 + 2.0 * whole) as usize;
            wave = (1.0 - part) * cell.back.at(tick, ago) + part * cell.back.at(tick, ago + 2);
        }
        cell.loss_back.pass(wave)
    }

    fn junction(&mut self, junction: usize) {
        let (tick, now) = (self.tick, self.tick % MEMORY);
        let right = self.returning(junction + 1);
        let above = &mut self.cells[junction];
        let left = above.loss_down.pass(above.down.at(tick, above.ticks));
        let (y_left, y_right) = (self.cells[junction].y, self.cells[junction + 1].y);
        let p = match self.hole_at[junction] {
            None => 2.0 * (y_left * left + y_right * right) / (y_left + y_right),
            Some(hole) => {
                let (p, flow) = self.holes[hole].scatter((y_left, left), (y_right, right));
                self.flows[hole] = flow;
                p
            }
        };
        self.cells[junction].back.0[now] = p - left;
        self.cells[junction + 1].down.0[now] = p - right;
    }

    fn open_end(&mut self) {
        let (tick, now) = (self.tick, self.tick % MEMORY);
        let bell = &mut self.bell;
        let Some(cell) = self.cells.last_mut() else { return };
        let arriving = cell.loss_down.pass(cell.down.at(tick, cell.ticks));
        let [b0, b1, a1] = bell.reflection;
        let out = b0 * arriving + b1 * bell.last_in - a1 * bell.last_out;
        (bell.last_in, bell.last_out) = (arriving, out);
        cell.back.0[now] = out;
        if let Some(flow) = self.flows.last_mut() {
            *flow = cell.y * (arriving - out);
        }
    }
}
