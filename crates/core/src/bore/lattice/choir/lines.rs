//! The waves of a choir: a line for each, in which its samples lie one after another.

use super::super::{BACK, END_SLOT, SPACE, back_rows};
use super::{LatticeCoeffs, TICK};

/// Room in each line for what comes, samples: so much that moving the rest costs little, so little that all stays near.
const ROOM: usize = 4 * TICK;
/// Every 16-bit place and the samples of a turn from there on lie inside, so no access needs a check.
const WINDOW: usize = SPACE + 2 * TICK;

/// All waves, seen from the first sample of a tick on.
pub(super) type Waves<const N: usize> = [[f32; N]; WINDOW];

/// A wave along a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Where the wave is that arrives in the first sample of a tick.
    pub(super) begin: u16,
    /// Samples that it takes, or may take.
    rows: u16,
    /// Where it is kept in a lattice.
    slot: u16,
}

impl Line {
    /// Where the wave is that leaves in the first sample of a tick.
    pub(super) fn end(&self) -> u16 {
        self.begin + self.rows
    }

    /// Where the wave is that left so many rows before.
    #[inline(always)]
    pub(super) fn behind(&self, rows: u16) -> u16 {
        self.end().wrapping_sub(rows)
    }
}

/// The lines of all cells.
#[derive(Clone)]
pub(super) struct Lines<const N: usize> {
    waves: Box<[[f32; N]]>,
    /// Of the wave going down and of the one coming back in each cell.
    lines: Box<[[Line; 2]]>,
    /// Where the wave is that has passed the tuning delay.
    tuned: u16,
    /// Samples of the room that are used.
    used: usize,
}

impl<const N: usize> Lines<N> {
    /// Silent lines. Allocates.
    pub(super) fn new(coeffs: &LatticeCoeffs) -> Self {
        let (last, mut next) = (coeffs.ticks.len() - 1, 0);
        let mut line = |slot: usize, rows: u32| {
            let line = Line { begin: next, rows: rows as u16, slot: slot as u16 };
            next = line.end() + ROOM as u16;
            line
        };
        let lines = coeffs.all_rows().enumerate().map(|(cell, (down, back))| {
            let from_left = if cell == 0 { END_SLOT } else { coeffs.lane_of(cell - 1) };
            let from_right = BACK + if cell == last { END_SLOT } else { coeffs.lane_of(cell) };
            // The tuned cell's may become as long as the ring.
            let back = if cell == coeffs.tuned_cell() { coeffs.ring_rows() } else { back };
            [line(from_left, down), line(from_right, back)]
        });
        let lines = lines.collect();
        let tuned = line(0, 0).begin;
        // The system only promises fresh memory. Writing what is used makes sure that it is there before the audio thread reads it.
        let mut waves = vec![[0.0; N]; WINDOW + ROOM].into_boxed_slice();
        for value in [[1.0; N], [0.0; N]] {
            waves[..usize::from(tuned) + 2 * ROOM].fill(value);
            std::hint::black_box(&mut waves);
        }
        Self { waves, lines, tuned, used: 0 }
    }

    /// The wave going down in a cell.
    pub(super) fn down(&self, cell: usize) -> Line {
        self.lines[cell][0]
    }

    /// The wave coming back in a cell.
    pub(super) fn back(&self, cell: usize) -> Line {
        self.lines[cell][1]
    }

    /// Where the wave is that has passed the tuning delay.
    pub(super) fn tuned(&self) -> u16 {
        self.tuned
    }

    /// All waves, from the first sample of the next tick on.
    #[inline(always)]
    pub(super) fn waves(&self) -> &Waves<N> {
        let at = self.used.min(ROOM);
        // PANIC: there are more waves than that by the room.
        self.waves[at..].first_chunk().unwrap_or_else(|| unreachable!())
    }

    /// See [`waves`](Self::waves).
    #[inline(always)]
    pub(super) fn waves_mut(&mut self) -> &mut Waves<N> {
        let at = self.used.min(ROOM);
        // PANIC: there are more waves than that by the room.
        self.waves[at..].first_chunk_mut().unwrap_or_else(|| unreachable!())
    }

    /// A tick is done. Where the room is used up, what can still be heard moves to the beginning of the lines.
    #[inline(always)]
    pub(super) fn advance(&mut self) {
        self.used += TICK;
        if self.used < ROOM {
            return;
        }
        for line in self.lines.as_flattened() {
            let (begin, rows) = (usize::from(line.begin), usize::from(line.rows));
            self.waves.copy_within(begin + ROOM..begin + ROOM + rows, begin);
        }
        self.used = 0;
    }

    /// Each wave that can still be heard, and its place in a lattice from the present row on.
    pub(super) fn each_heard(&self, mut each: impl FnMut(u16, &[f32; N])) {
        let waves = self.waves();
        for line in self.lines.as_flattened() {
            for age in 0..line.rows {
                each(
                    back_rows(u32::from(age), usize::from(line.slot)),
                    &waves[usize::from(line.behind(age + 1))],
                );
            }
        }
    }

    /// See [`each_heard`](Self::each_heard).
    pub(super) fn each_heard_mut(&mut self, mut each: impl FnMut(u16, &mut [f32; N])) {
        let at = self.used;
        for line in self.lines.as_flattened() {
            for age in 0..line.rows {
                let wave = &mut self.waves[at + usize::from(line.behind(age + 1))];
                each(back_rows(u32::from(age), usize::from(line.slot)), wave);
            }
        }
    }
}
