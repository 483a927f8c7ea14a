//! The bore cut into cylinders for the lattice: the Design between an instrument file and a lattice.
//!
//! Junctions stand on a grid of half samples (ticks): the reed tip at 0, every tone hole, a few steps between the tip
//! and the first hole and between the last hole and the bell's end. Between two junctions lies a lossless cylinder that
//! keeps the volume and the inertance of the true profile; a hole's negative series mass is taken out of its neighbours.

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::tone_hole;
use crate::bore::wall_loss;
use crate::units::{Air, REFERENCE_RADIUS_M};

/// Cells between the tip and the first hole, and how much length counts beside flare when they are cut: little, so that
/// one long cell is left in the cylindrical part, which can give and take the tuning delay.
const TOP: (usize, f64) = (7, 0.1);
/// The same between the last hole and the end of the bell.
const BELL: (usize, f64) = (9, 0.6);

/// One cylinder.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cell {
    /// One-way delay, half samples, at least 1 (2 beside a step).
    pub ticks: u32,
    /// Radius of the cylinder, m.
    pub radius_m: f64,
}

/// A bore as the lattice wants it, at one rate.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cells {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Cylinders from the tip to the bell.
    pub cells: Vec<Cell>,
    /// Which junction each hole of the file stands at; junction j lies between cells j and j + 1.
    pub hole_junctions: Vec<usize>,
    /// Radius of the open end, m.
    pub end_radius_m: f64,
    /// Radius of the bore whose admittance all others are over, m, see [`InstrumentFile::nominal_radius_m`].
    #[serde(default = "nominal_radius_m")]
    pub nominal_radius_m: f64,
    /// Frequencies of the three loss poles, Hz, see [`wall_loss`].
    pub loss_poles_hz: [f64; 3],
    /// Their strengths, s^-1/2.
    pub loss_strengths: [f64; 3],
    /// Viscous resistance of register holes over that of [`HoleNetwork`](crate::bore::tone_hole::HoleNetwork), which is
    /// constant where the true one grows with the root of frequency.
    pub vent_resistance: f64,
    /// Share of each chimney's mass before its compliance: 1/3 would be right for closed holes, nearly 1/2 for open ones.
    pub chimney_split: f64,
}

/// What a kept bore refers to where it does not say.
fn nominal_radius_m() -> f64 {
    REFERENCE_RADIUS_M
}

/// Why a bore cannot be put on the grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CellsError {
    /// A piece of bore is too long for the lattice's delay lines.
    #[error("the bore between {from} and {to} is {ticks} half samples long; the lattice holds up to {limit}")]
    TooLong {
        /// Junction before.
        from: String,
        /// Junction after.
        to: String,
        /// Its length.
        ticks: u32,
        /// The most it may be.
        limit: u32,
    },
    /// Too many holes.
    #[error("{0} tone holes; the lattice holds up to 40")]
    Holes(usize),
}

/// Volume and inertance integrals (m3, 1/m) of the profile between two positions.
fn integrals(file: &InstrumentFile, from: f64, to: f64) -> (f64, f64) {
    let (mut volume, mut inertance) = (0.0, 0.0);
    for segment in &file.bore {
        let (low, high) = (segment.x_start_m.max(from), segment.x_end_m.min(to));
        let length = high - low;
        if length <= 1e-12 {
            continue;
        }
        let slope = (segment.r_end_m - segment.r_start_m) / (segment.x_end_m - segment.x_start_m);
        let r0 = segment.r_start_m + slope * (low - segment.x_start_m);
        let r1 = segment.r_start_m + slope * (high - segment.x_start_m);
        volume += std::f64::consts::PI * length * (r0 * r0 + r0 * r1 + r1 * r1) / 3.0;
        inertance += length / (std::f64::consts::PI * r0 * r1);
    }
    (volume, inertance)
}

/// Positions that cut `from..to` into `count` pieces, finer where the radius changes.
fn cuts(file: &InstrumentFile, from: f64, to: f64, (count, length_weight): (usize, f64)) -> Vec<f64> {
    const STEPS: usize = 2_000;
    let x = |n: usize| from + (to - from) * n as f64 / STEPS as f64;
    let mut measure = vec![0.0];
    for n in 1..=STEPS {
        let flare = (file.radius_at(x(n)) / file.radius_at(x(n - 1))).ln().abs();
        measure.push(measure[n - 1] + flare + length_weight / STEPS as f64);
    }
    let total = measure[STEPS];
    (1..count)
        .map(|piece| {
            let wanted = total * piece as f64 / count as f64;
            x(measure.partition_point(|&m| m < wanted).min(STEPS))
        })
        .collect()
}

/// Part of a tick to shift all holes by, so that rounding moves them least against each other: the fit can make up for the
/// shift itself in the mouthpiece, but not for holes that come closer or part.
fn grid_shift(holes: impl Iterator<Item = f64> + Clone) -> f64 {
    let moved = |shift: f64| holes.clone().map(|at| (at + shift - (at + shift).round()).powi(2)).sum::<f64>();
    (-10..=10).map(|n| 0.05 * f64::from(n)).min_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap_or(0.0)
}

impl Cells {
    /// Cuts a bore for the lattice at `rate_hz`, without any fit: the start of [`fit`](crate::bore::fit).
    pub fn cut(file: &InstrumentFile, air: &Air, rate_hz: f64) -> Result<Self, CellsError> {
        if file.holes.len() > 40 {
            return Err(CellsError::Holes(file.holes.len()));
        }
        let end = file.bore.last().map_or(0.0, |segment| segment.x_end_m);
        let first = file.holes.first().map_or(0.5 * end, |hole| hole.x_m);
        let last = file.holes.last().map_or(first, |hole| hole.x_m);
        let mut junctions: Vec<(f64, Option<usize>)> =
            cuts(file, 0.0, first, TOP).into_iter().map(|x| (x, None)).collect();
        junctions.extend(file.holes.iter().enumerate().map(|(index, hole)| (hole.x_m, Some(index))));
        if file.holes.is_empty() {
            junctions.push((first, None));
        }
        junctions.extend(cuts(file, last, end, BELL).into_iter().map(|x| (x, None)));

        let mut edges = vec![0.0];
        edges.extend(junctions.iter().map(|(x, _)| *x));
        edges.push(end);
        let mut pieces: Vec<(f64, f64)> =
            edges.windows(2).map(|pair| integrals(file, pair[0], pair[1])).collect();
        for (junction, (x, hole)) in junctions.iter().enumerate() {
            let Some(hole) = *hole else { continue };
            let radius = file.radius_at(*x);
            let mass = tone_hole::series_correction_m(file.holes[hole].radius_m, radius)
                / (std::f64::consts::PI * radius * radius);
            let (left, right) = (x - edges[junction], edges[junction + 2] - x);
            // A neighbour never gives more than half of its own inertance.
            for (piece, share) in [(junction, left / (left + right)), (junction + 1, right / (left + right))]
            {
                let inertance = &mut pieces[piece].1;
                *inertance = (*inertance + mass * share).max(0.5 * *inertance);
            }
        }
        let wall = wall_loss::wall_constant(air);
        // Exact position of each junction and of the end, ticks.
        let mut exact = 0.0;
        let (radii, positions): (Vec<f64>, Vec<f64>) = pieces
            .iter()
            .map(|(volume, inertance)| {
                let radius_m = ((volume / inertance).sqrt() / std::f64::consts::PI).sqrt();
                let length = (volume * inertance).sqrt();
                exact += length / air.c * (1.0 + wall * air.c * wall_loss::DELAY / radius_m) * 2.0 * rate_hz;
                (radius_m, exact)
            })
            .unzip();
        let shift = grid_shift(
            junctions.iter().zip(&positions).filter(|((_, hole), _)| hole.is_some()).map(|(_, &at)| at),
        );
        let mut cells = Vec::with_capacity(pieces.len());
        let mut placed = 0_i64;
        for (index, (radius_m, position)) in radii.into_iter().zip(positions).enumerate() {
            let beside_step = |junction: Option<usize>| {
                junction.is_none_or(|junction| junctions.get(junction).is_none_or(|(_, hole)| hole.is_none()))
            };
            let least = if beside_step(index.checked_sub(1)) || beside_step(Some(index)) { 2 } else { 1 };
            let ticks = ((position + shift).round() as i64 - placed).max(least);
            placed += ticks;
            cells.push(Cell { ticks: u32::try_from(ticks).unwrap_or(u32::MAX), radius_m });
        }
        let limit = crate::bore::lattice::MAX_TICKS;
        if let Some((index, cell)) = cells.iter().enumerate().find(|(_, cell)| cell.ticks > limit) {
            let name = |junction: Option<usize>| match junction.and_then(|junction| junctions.get(junction)) {
                Some((_, Some(hole))) => format!("hole {}", file.holes[*hole].name),
                Some((x, None)) => format!("{:.1} mm", 1e3 * x),
                None => "an end".to_owned(),
            };
            let (from, to) = (name(index.checked_sub(1)), name(Some(index)));
            return Err(CellsError::TooLong { from, to, ticks: cell.ticks, limit });
        }
        let hole_junctions =
            (0..junctions.len()).filter(|&junction| junctions[junction].1.is_some()).collect();
        let end_radius_m = file.bore.last().map_or(file.nominal_radius_m, |segment| segment.r_end_m);
        Ok(Self {
            rate_hz,
            cells,
            hole_junctions,
            end_radius_m,
            nominal_radius_m: file.nominal_radius_m,
            loss_poles_hz: wall_loss::POLES_HZ,
            loss_strengths: wall_loss::STRENGTHS,
            vent_resistance: 1.0,
            chimney_split: 0.4,
        })
    }
}
