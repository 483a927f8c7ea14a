//! The ladder of a register: which holes must be open for a pitch, if they open one after another from the bell up.
//!
//! The chart tells: a hole is reached at the pitch of the lowest of its fingerings whose highest open hole it is. Holes that the chart
//! does not have lie between their neighbours.

use super::Between;
use crate::instrument::model::Model;
use crate::instrument::player::fingers::TOGETHER;
use crate::units::cents;

/// Holes of a ladder: one bit each.
const MOST: usize = 64;

/// From some open holes to others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    from: u64,
    to: u64,
    /// Cents from the foot at which the holes that change are open, in the order in which they open.
    rungs: [f64; MOST],
    count: usize,
}

impl Ladder {
    /// From the holes `from`, at `foot_hz`, to the holes `to`, `height` cents above, in a register of the chart. Real-time safe.
    pub fn new(from: u64, to: u64, register: u8, (foot_hz, height): (f64, f64), model: &Model) -> Self {
        let mut rungs = [0.0; MOST];
        let mut count = 0;
        let (mut known, mut last) = (0, 0.0);
        for hole in (0..model.coeffs.holes().min(MOST)).rev().filter(|hole| (from ^ to) >> hole & 1 == 1) {
            let of_hole = |&fingering: &usize| {
                model.registers[fingering] == register && highest_open(fingering, model) == hole
            };
            let pitches =
                (0..model.notes_hz.len()).filter(of_hole).map(|f| cents(model.notes_hz[f], foot_hz));
            let pitch = pitches.fold(f64::INFINITY, f64::min);
            if pitch > last && pitch < height {
                spread(&mut rungs[known..=count], last, pitch);
                (known, last) = (count + 1, pitch);
            }
            count += 1;
        }
        spread(&mut rungs[known..count], last, height);
        Self { from, to, rungs, count }
    }

    /// Where the fingers are for a pitch so many cents above the foot.
    pub fn at(&self, pitch: f64) -> Between {
        let Self { from, to, rungs, count } = *self;
        let rungs = &rungs[..count];
        let next = rungs.partition_point(|&rung| rung <= pitch);
        let below = if next == 0 { 0.0 } else { rungs[next - 1] };
        let part = rungs.get(next).map_or(0.0, |above| ((pitch - below) / (above - below)).clamp(0.0, 1.0));
        // The last hole opens wholly.
        let part = if next + 1 == count { part * TOGETHER } else { part };
        // At the pitch of a rung its hole is half open and the next one begins: half open is most of the way, by pitch.
        let last = count as f64 - 1.0 + TOGETHER;
        let begun = if next == count { last } else { next as f64 + part };
        let way = begun / last;
        Between { from, to, way: way.clamp(0.0, 1.0), rises: true }
    }
}

/// Equal steps from above `from` up to `to`.
fn spread(rungs: &mut [f64], from: f64, to: f64) {
    let count = rungs.len() as f64;
    for (n, rung) in rungs.iter_mut().enumerate() {
        *rung = from + (to - from) * (n as f64 + 1.0) / count;
    }
}

/// The open hole of a fingering that is nearest to the reed, register holes left out; the number of holes if none is open.
pub fn highest_open(fingering: usize, model: &Model) -> usize {
    let holes = &model.file.holes;
    let open = &model.file.fingerings[fingering].open;
    (0..holes.len()).find(|&hole| open[hole] && !holes[hole].register).unwrap_or(holes.len())
}
