//! What a lattice needs to know of its bore at one rate: delays, admittances, losses, holes, and who sits in which lane.
//! The same numbers give its response in the frequency domain, exactly.

use num_complex::Complex64;

use super::{LANES, ROWS};
use crate::bore::cells::Cells;
use crate::bore::radiation;
use crate::bore::tone_hole::{HoleCoeffs, HoleNetwork};
use crate::bore::wall_loss;
use crate::maths;
use crate::units::Air;

/// Chunks of eight lanes that so many tone holes take: two neighbours never share one, unless there is only one hole.
pub fn hole_chunks(holes: usize) -> usize {
    holes.div_ceil(LANES).max(usize::from(holes > 1) + usize::from(holes > 0))
}

/// Everything of a lattice that playing does not change.
#[derive(Clone, Debug)]
pub struct LatticeCoeffs {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Radius of the bore whose admittance all others are over, m.
    pub nominal_radius_m: f64,
    pub(super) ticks: Vec<u32>,
    /// Admittance of each cell over the reference.
    pub(super) admittance: Vec<f64>,
    /// Loss filter of each cell: amount A, coefficient q.
    pub(super) loss: Vec<(f64, f64)>,
    pub(super) holes: Vec<HoleCoeffs>,
    /// Jet resistance per flow of each hole at K = 1.
    pub(super) jets: Vec<f64>,
    /// Area of each hole, m2.
    hole_areas_m2: Vec<f64>,
    pub(super) hole_junctions: Vec<usize>,
    /// Bell: radiation conductance and half-sample conductance of its mass.
    pub(super) bell: (f64, f64),
    /// See [`tuning_range`](Self::tuning_range): players ask for it at each change of a setting.
    tuning_range: (f64, f64),
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
        let nominal_radius_m = cells.nominal_radius_m;
        let radius = cells.end_radius_m;
        let z_end = air.z_c(radius) / air.z_c(nominal_radius_m);
        let end = radiation::END_CORRECTION;
        let mut coeffs = Self {
            rate_hz,
            nominal_radius_m,
            ticks: cells.cells.iter().map(|cell| cell.ticks).collect(),
            admittance: cells.cells.iter().map(|cell| (cell.radius_m / nominal_radius_m).powi(2)).collect(),
            loss,
            holes: networks
                .iter()
                .map(|network| {
                    let coeffs = network.coeffs(rate_hz, nominal_radius_m, air);
                    let vent = if network.register { cells.vent_resistance } else { 1.0 };
                    HoleCoeffs { rs: coeffs.rs * vent, ..coeffs }
                })
                .collect(),
            jets: networks.iter().map(|network| network.jet(p_ref_pa, nominal_radius_m, air)).collect(),
            hole_areas_m2: networks.iter().map(|network| network.area_m2).collect(),
            hole_junctions: cells.hole_junctions.clone(),
            bell: (
                radiation::RESISTANCE / (end * end) / z_end,
                air.c / (2.0 * rate_hz * end * radius * z_end),
            ),
            tuning_range: (0.0, 0.0),
        };
        let back = f64::from(coeffs.rows(coeffs.tuned_cell()).1);
        coeffs.tuning_range = (1.0 - back, f64::from(coeffs.ring_rows() - 2) - back);
        coeffs
    }

    /// Admittance of the first cell, over the reference: what the reed blows into.
    pub fn tip_admittance(&self) -> f64 {
        self.admittance[0]
    }

    /// Number of tone holes.
    pub fn holes(&self) -> usize {
        self.holes.len()
    }

    /// Area of each tone hole, m2, in the order of the file.
    pub fn hole_areas_m2(&self) -> impl Iterator<Item = f64> + '_ {
        self.hole_areas_m2.iter().copied()
    }

    /// Whether the tone holes of another lattice are the same.
    pub fn same_holes(&self, other: &Self) -> bool {
        self.holes == other.holes
    }

    /// Reflectance at the tip, exactly what [`Lattice`](super::Lattice) does with fixed openings, 0..=1, and no jets, at `f_hz`.
    /// `tuning_rows`: tuning delay, rows of the round trip.
    pub fn reflectance(&self, f_hz: f64, opening: &[f64], tuning_rows: f64) -> Complex64 {
        self.looking_down(0, f_hz, opening, tuning_rows)
    }

    /// Reflectance just above a hole of the hole and all that lies below it, for the wave arriving in the cell above.
    /// `|R|^2` falling to 1/2 is the cut-off of the tone-hole lattice when `hole` is the first open one.
    pub fn reflectance_below(&self, f_hz: f64, opening: &[f64], hole: usize) -> Complex64 {
        let junction = self.hole_junctions[hole];
        let z1 = maths::complex::cis(-std::f64::consts::TAU * f_hz / self.rate_hz);
        let r = self.looking_down(junction + 1, f_hz, opening, 0.0);
        let below = self.admittance[junction + 1] * (1.0 - r) / (1.0 + r);
        let y = below + self.holes[hole].admittance(z1, opening[hole]);
        (self.admittance[junction] - y) / (self.admittance[junction] + y)
    }

    /// Reflectance at the upper end of cell `top` of all that lies below.
    fn looking_down(&self, top: usize, f_hz: f64, opening: &[f64], tuning_rows: f64) -> Complex64 {
        let z1 = maths::complex::cis(-std::f64::consts::TAU * f_hz / self.rate_hz);
        let half = maths::complex::cis(-std::f64::consts::PI * f_hz / self.rate_hz);
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

    /// How fast the susceptance at the tip, over the reference, rises at `f_hz` with the logarithm of the frequency. A susceptance of the
    /// reed's, over this, is how far it lowers a note there, as a share of its frequency.
    pub fn susceptance_slope(&self, f_hz: f64, opening: &[f64]) -> f64 {
        // 9 cents either way, well within the width of a resonance.
        const STEP: f64 = 0.005;
        let susceptance = |f_hz: f64| self.impedance(f_hz, opening).inv().im;
        (susceptance(f_hz * (1.0 + STEP)) - susceptance(f_hz * (1.0 - STEP))) / (2.0 * STEP)
    }

    /// The cell that holds the tuning delay: the longest between the first junction and the first hole.
    pub(super) fn tuned_cell(&self) -> usize {
        let end = self.hole_junctions.first().copied().unwrap_or(self.ticks.len() - 1).max(1);
        (1..=end).max_by_key(|&cell| (self.ticks[cell], std::cmp::Reverse(cell))).unwrap_or(1)
    }

    /// Range of the tuning delay, rows of the round trip: the tuned cell's returning wave may take from one row to at least
    /// twice as many as it does.
    pub fn tuning_range(&self) -> (f64, f64) {
        self.tuning_range
    }

    /// Rows the ring needs: for the longest cell, and for twice the tuned one's returning wave.
    pub(super) fn ring_rows(&self) -> u32 {
        let longest = self.all_rows().map(|(down, back)| down.max(back)).max().unwrap_or_default();
        let tuned = 2 * self.rows(self.tuned_cell()).1;
        (longest.max(tuned) + 3).next_power_of_two().clamp(ROWS.0, ROWS.1)
    }

    /// Rows a cell gives to the wave going down and to the one coming back.
    pub(super) fn rows(&self, wanted: usize) -> (u32, u32) {
        self.all_rows().nth(wanted).unwrap_or_default()
    }

    pub(super) fn all_rows(&self) -> impl Iterator<Item = (u32, u32)> {
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

    /// Chunks that the tone holes take.
    pub fn hole_chunks(&self) -> usize {
        hole_chunks(self.holes.len())
    }

    /// Chunk and lane of each hole in a new lattice, in the order of the file.
    pub fn hole_slots(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let lanes = self.hole_junctions.iter().map(|&junction| self.lane_of(junction));
        lanes.map(|lane| (lane / LANES - self.step_chunks(), lane % LANES))
    }

    pub(super) fn step_chunks(&self) -> usize {
        (self.ticks.len() - 1 - self.holes.len()).div_ceil(LANES)
    }

    /// Chunk a junction is evaluated in; steps come first.
    pub(super) fn chunk_of(&self, junction: usize) -> usize {
        self.lane_of(junction) / LANES
    }

    pub(super) fn lane_of(&self, junction: usize) -> usize {
        let before = self.hole_junctions.partition_point(|&hole| hole < junction);
        if self.hole_junctions.get(before) == Some(&junction) {
            let chunks = self.hole_chunks();
            (self.step_chunks() + before % chunks) * LANES + before / chunks
        } else {
            junction - before
        }
    }
}
