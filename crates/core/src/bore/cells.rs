//! The bore cut into cylinders: the step between an instrument file and a lattice.
//!
//! Junctions stand on a grid of half samples (ticks): the reed tip at 0, every tone hole, a few steps between the tip
//! and the first hole and between the last hole and the bell's end, and in long stretches between holes. Between two junctions lies a lossless cylinder that
//! keeps the volume and the inertance of the true profile; a hole's negative series mass is taken out of its neighbours.

use crate::bore::instrument_file::{InstrumentFile, MAX_HOLES};
use crate::bore::lattice::{LANES, MAX_CHUNKS, MAX_TICKS, hole_chunks};
use crate::bore::tone_hole::{self, HoleNetwork};
use crate::bore::wall_loss;
use crate::maths;
use crate::units::{Air, REFERENCE_RADIUS_M};

/// How a stretch of bore between two holes, or above or below them all, is cut into cells.
struct Cutting {
    /// Cells of a cylinder: each of the three loss poles has one.
    least: usize,
    /// Cells at most.
    most: usize,
    /// Flare, as the logarithm of the radius, that deserves a cell of its own.
    flare: f64,
    /// How much length counts beside flare when the places are chosen.
    length_weight: f64,
}

/// Between the tip and the first hole: length counts little, so that one long cell is left in the cylindrical part, which
/// can give and take the tuning delay. 7 cells for a clarinet's mouthpiece and barrel.
const TOP: Cutting = Cutting { least: 3, most: 7, flare: 0.11, length_weight: 0.1 };
/// Between the last hole and the end of the bell; 9 cells for a clarinet.
const BELL: Cutting = Cutting { least: 3, most: 9, flare: 0.2, length_weight: 0.6 };
/// Between two holes.
const GAP: Cutting = Cutting { least: 1, most: 1, flare: 0.2, length_weight: 0.6 };
/// Longest cell as a share of the bore: wall losses sit in one place of each cell and one pole of three. A clarinet's
/// longest, between its register hole and the barrel, has 0.08.
const LONGEST_SHARE: f64 = 0.1;
/// How far a junction may be moved to find a place of its own, ticks: what the radii beside it can make up for.
pub(super) const MOVED_TICKS: f64 = 1.5;

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
    /// Viscous resistance of register holes over that of [`HoleNetwork`], which is
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
    /// Two junctions are closer than the grid can tell apart.
    #[error(
        "{place} cannot be placed at {rate_hz} Hz: half a sample is {tick_mm:.2} mm, and it would have to move by \
         {moved_mm:.2} mm to keep its distance from {above}; quality High, with twice the rate, has more room, and so has a larger instrument"
    )]
    Crowded {
        /// What is crowded.
        place: String,
        /// What lies above it.
        above: String,
        /// Rate of the grid, Hz.
        rate_hz: f64,
        /// Step of the grid, mm.
        tick_mm: f64,
        /// How far it would be off, mm.
        moved_mm: f64,
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

/// A piece of bore to be cut, and into how many cells.
struct Stretch {
    from_m: f64,
    to_m: f64,
    /// `STEPS + 1` values that grow from the start to the end, by flare and length.
    measure: Vec<f64>,
    count: usize,
}

impl Stretch {
    const STEPS: usize = 2_000;

    fn new(file: &InstrumentFile, from_m: f64, to_m: f64, cutting: &Cutting) -> Self {
        let at = |n: usize| from_m + (to_m - from_m) * n as f64 / Self::STEPS as f64;
        let (mut measure, mut flared) = (vec![0.0], 0.0);
        for n in 1..=Self::STEPS {
            let flare = maths::ln(file.radius_at(at(n)) / file.radius_at(at(n - 1))).abs();
            flared += flare;
            measure.push(measure[n - 1] + flare + cutting.length_weight / Self::STEPS as f64);
        }
        let by_flare = (cutting.least + (flared / cutting.flare).round() as usize).min(cutting.most);
        let by_length = ((to_m - from_m) / (LONGEST_SHARE * file.length_m())).ceil() as usize;
        Self { from_m, to_m, measure, count: by_flare.max(by_length) }
    }

    /// Positions that cut it into its pieces, finer where the radius changes, but none finer than a quarter of the mean: a
    /// step is all flare and no length.
    fn cuts(&self) -> impl Iterator<Item = f64> + '_ {
        let total = self.measure[Self::STEPS];
        let least = Self::STEPS / (4 * self.count);
        let mut before = 0;
        (1..self.count).map(move |piece| {
            let wanted = total * piece as f64 / self.count as f64;
            let n = self.measure.partition_point(|&m| m < wanted);
            before = n.clamp(before + least, Self::STEPS - (self.count - piece) * least);
            self.from_m + (self.to_m - self.from_m) * before as f64 / Self::STEPS as f64
        })
    }

    /// Length of a piece when there is one less of them, m: what losing one costs.
    fn coarser_m(&self) -> f64 {
        if self.count > 1 { (self.to_m - self.from_m) / (self.count - 1) as f64 } else { f64::INFINITY }
    }
}

/// The stretches above, between and below the holes, no more cells than the grid and the lanes have room for.
fn stretches(file: &InstrumentFile, tick_m: f64) -> Vec<Stretch> {
    let end = file.length_m();
    let mut edges = vec![0.0];
    edges.extend(file.holes.iter().map(|hole| hole.x_m));
    if file.holes.is_empty() {
        edges.push(0.5 * end);
    }
    edges.push(end);
    let last = edges.len() - 2;
    let mut stretches: Vec<Stretch> = edges
        .windows(2)
        .enumerate()
        .map(|(index, pair)| {
            let cutting = if index == 0 {
                &TOP
            } else if index == last {
                &BELL
            } else {
                &GAP
            };
            let mut stretch = Stretch::new(file, pair[0], pair[1], cutting);
            // Two ticks a cell beside steps, and one to spare for rounding.
            let room = ((pair[1] - pair[0]) / tick_m - 1.0) / 2.0;
            stretch.count = stretch.count.min(room.max(1.0) as usize);
            stretch
        })
        .collect();
    let lanes = LANES * (MAX_CHUNKS - hole_chunks(file.holes.len()));
    let without_holes = usize::from(file.holes.is_empty());
    while stretches.iter().map(|stretch| stretch.count - 1).sum::<usize>() + without_holes > lanes {
        let Some(cheapest) = stretches.iter_mut().min_by(|a, b| a.coarser_m().total_cmp(&b.coarser_m()))
        else {
            break;
        };
        cheapest.count -= 1;
    }
    stretches
}

/// Part of a tick to shift all holes by, so that rounding moves them least against each other: the fit can make up for the
/// shift itself in the mouthpiece, but not for holes that come closer or part.
fn grid_shift(holes: impl Iterator<Item = f64> + Clone) -> f64 {
    let moved = |shift: f64| holes.clone().map(|at| (at + shift - (at + shift).round()).powi(2)).sum::<f64>();
    (-10..=10).map(|n| 0.05 * f64::from(n)).min_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap_or(0.0)
}

/// A junction: its place, m from the tip, and the index of its hole; `None` for a change of section.
type Junction = (f64, Option<usize>);

/// Volume and inertance (m3, 1/m) of each piece between two edges, less the negative series mass of the holes beside it.
fn volumes_and_inertances(file: &InstrumentFile, junctions: &[Junction], edges: &[f64]) -> Vec<(f64, f64)> {
    let mut pieces: Vec<(f64, f64)> =
        edges.windows(2).map(|pair| integrals(file, pair[0], pair[1])).collect();
    for (junction, (x, hole)) in junctions.iter().enumerate() {
        let Some(hole) = *hole else { continue };
        let radius = file.radius_at(*x);
        let mass = tone_hole::series_correction_m(file.holes[hole].radius_m, radius)
            / (std::f64::consts::PI * radius * radius);
        let (left, right) = (x - edges[junction], edges[junction + 2] - x);
        // A neighbour never gives more than half of its own inertance.
        for (piece, share) in [(junction, left / (left + right)), (junction + 1, right / (left + right))] {
            let inertance = &mut pieces[piece].1;
            *inertance = (*inertance + mass * share).max(0.5 * *inertance);
        }
    }
    pieces
}

/// Radius of the cylinder that stands for each piece, m, and exact position of the piece's lower end, half samples.
fn radii_and_positions(
    file: &InstrumentFile,
    air: &Air,
    rate_hz: f64,
    pieces: &[(f64, f64)],
    edges: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let mut exact = 0.0;
    pieces
        .iter()
        .zip(edges)
        .map(|((volume, inertance), &from_m)| {
            if *volume <= 0.0 {
                // Two holes at one place: a cell of the shortest delay between them.
                return (file.radius_at(from_m), exact);
            }
            let radius_m = ((volume / inertance).sqrt() / std::f64::consts::PI).sqrt();
            let length = (volume * inertance).sqrt();
            exact += length / air.c * (1.0 + wall_loss::slowing(air, radius_m)) * 2.0 * rate_hz;
            (radius_m, exact)
        })
        .unzip()
}

impl Cells {
    /// Cuts a bore for the lattice at `rate_hz`, without any fit: the start of [`fit`](crate::bore::fit).
    pub fn cut(file: &InstrumentFile, air: &Air, rate_hz: f64) -> Result<Self, CellsError> {
        if file.holes.len() > MAX_HOLES {
            return Err(CellsError::Holes(file.holes.len()));
        }
        let end = file.length_m();
        let tick_m = air.c / (2.0 * rate_hz);
        let mut junctions: Vec<Junction> = Vec::new();
        for (above, stretch) in stretches(file, tick_m).iter().enumerate() {
            if above > 0 {
                junctions.push((stretch.from_m, (!file.holes.is_empty()).then_some(above - 1)));
            }
            junctions.extend(stretch.cuts().map(|x| (x, None)));
        }

        let mut edges = vec![0.0];
        edges.extend(junctions.iter().map(|(x, _)| *x));
        edges.push(end);
        let pieces = volumes_and_inertances(file, &junctions, &edges);
        let (radii, positions) = radii_and_positions(file, air, rate_hz, &pieces, &edges);
        let shift = grid_shift(
            junctions.iter().zip(&positions).filter(|((_, hole), _)| hole.is_some()).map(|(_, &at)| at),
        );
        let name = |junction: Option<usize>| match junction.map(|junction| junctions.get(junction)) {
            Some(Some((_, Some(hole)))) => format!("hole {}", file.holes[*hole].name),
            Some(Some((x, None))) => format!("{:.1} mm", 1e3 * x),
            Some(None) => "the end of the bell".to_owned(),
            None => "the tip".to_owned(),
        };
        let mut cells = Vec::with_capacity(pieces.len());
        let mut placed = 0_i64;
        for (index, (radius_m, position)) in radii.into_iter().zip(positions).enumerate() {
            let beside_step = |junction: Option<usize>| {
                junction.is_none_or(|junction| junctions.get(junction).is_none_or(|(_, hole)| hole.is_none()))
            };
            let least = if beside_step(index.checked_sub(1)) || beside_step(Some(index)) { 2 } else { 1 };
            let ticks = ((position + shift).round() as i64 - placed).max(least);
            placed += ticks;
            let moved = placed as f64 - position - shift;
            if moved > MOVED_TICKS {
                let (tick_mm, moved_mm) = (1e3 * tick_m, 1e3 * tick_m * moved);
                let (place, above) = (name(Some(index)), name(index.checked_sub(1)));
                return Err(CellsError::Crowded { place, above, rate_hz, tick_mm, moved_mm });
            }
            cells.push(Cell { ticks: u32::try_from(ticks).unwrap_or(u32::MAX), radius_m });
        }
        let limit = MAX_TICKS;
        if let Some((index, cell)) = cells.iter().enumerate().find(|(_, cell)| cell.ticks > limit) {
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

/// The networks of all holes of a file; viscous resistance taken at 2.4 times the lowest note (350 Hz on the B flat
/// clarinet).
pub fn networks(file: &InstrumentFile, air: &Air, cells: &Cells) -> Vec<HoleNetwork> {
    let size_hz = file.size_hz();
    file.holes
        .iter()
        .map(|hole| HoleNetwork::new(hole, file.radius_at(hole.x_m), cells.chimney_split, 2.4 * size_hz, air))
        .collect()
}
