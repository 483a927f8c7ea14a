//! In which turns the junctions of a choir go on.
//!
//! A junction needs the waves of its neighbours, which take some samples on their way. So it can go on without them for some
//! samples, and further once they have gone on: for as many in a turn as a wave takes to a neighbour and back. Any order in
//! which every wave is there before it is wanted gives the same bits.

use std::cmp::Reverse;

use super::{LatticeCoeffs, TICK};

/// Who goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Node {
    /// The reed's end.
    Tip,
    /// The change of section of this number.
    Step(u16),
    /// The tone hole of this number.
    Hole(u16),
    /// The returning wave of the tuned cell.
    Tuned,
    /// The bell's end.
    Bell,
}

/// Somebody goes on for some samples of a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub(super) node: Node,
    /// First sample, and how many more.
    first: u8,
    more: u8,
    /// Where the waves of the first sample come from, from left and right, and where they go, down the bore and back.
    /// Not an array: it would be read in one piece and taken apart again, turn by turn.
    left: u16,
    right: u16,
    down: u16,
    back: u16,
}

impl Turn {
    fn new(node: Node, places: [u16; 4], first: u32, end: u32) -> Self {
        let [left, right, down, back] = places.map(|place| place + first as u16);
        Self { node, first: first as u8, more: (end - 1 - first) as u8, left, right, down, back }
    }

    /// Where the waves of the first sample come from, from left and right, and where they go, down the bore and back.
    #[inline(always)]
    pub(super) fn places(&self) -> [usize; 4] {
        [usize::from(self.left), usize::from(self.right), usize::from(self.down), usize::from(self.back)]
    }

    /// Where the first sample of the turn is, for the place of the tick's first sample.
    #[inline(always)]
    pub(super) fn place(&self, place: u16) -> usize {
        usize::from(place) + self.at(0)
    }

    /// How many samples: at most a tick.
    #[inline(always)]
    pub(super) fn samples(&self) -> usize {
        usize::from(self.more) % TICK + 1
    }

    /// The sample of the tick that is number `n` of the turn.
    #[inline(always)]
    pub(super) fn at(&self, n: usize) -> usize {
        (usize::from(self.first) + n) % TICK
    }
}

/// Turns that make up a tick: who is behind most goes on first, and as far as it can. `nodes` are the reed's end, the junctions
/// along the bore and the bell, with their places in the first sample of the tick; `delayed` is where the tuned wave goes.
pub(super) fn plan(coeffs: &LatticeCoeffs, nodes: &[(Node, [u16; 4])], delayed: u16) -> Vec<Turn> {
    let tuned = coeffs.tuned_cell();
    let mut rows: Vec<(u32, u32)> = coeffs.all_rows().collect();
    // The tuned cell's returning wave may take as little as one row.
    rows[tuned].1 = 1;
    let (tick, mut done) = (TICK as u32, vec![0; nodes.len()]);
    let mut turns = Vec::new();
    loop {
        let reach = |node: usize| {
            let left = node.checked_sub(1).map_or(tick, |left| done[left] + rows[left].0);
            let right = rows.get(node).map_or(tick, |rows| done[node + 1] + rows.1);
            tick.min(left).min(right)
        };
        let next = (0..nodes.len())
            .filter(|&node| reach(node) > done[node])
            .min_by_key(|&node| (done[node], Reverse(reach(node))));
        let Some(next) = next else { return turns };
        let (first, end) = (done[next], reach(next));
        if next == tuned {
            turns.push(Turn::new(Node::Tuned, [0, 0, delayed, 0], first, end));
        }
        let (node, places) = nodes[next];
        turns.push(Turn::new(node, places, first, end));
        done[next] = end;
    }
}
