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
    /// The tone hole of this number, with the one of the turn after this: sample by sample, first this, then that.
    Pair(u16),
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

    /// The turn's sample of number `n` alone.
    #[inline(always)]
    pub(super) fn sample(&self, n: usize) -> Self {
        let [left, right, down, back] =
            [self.left, self.right, self.down, self.back].map(|place| place.wrapping_add(n as u16));
        Self { first: self.at(n) as u8, more: 0, left, right, down, back, ..*self }
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
    // The sample up to which a node can go on where the others are.
    let reach = |done: &[u32], node: usize| {
        let left = node.checked_sub(1).map_or(tick, |left| done[left] + rows[left].0);
        let right = rows.get(node).map_or(tick, |rows| done[node + 1] + rows.1);
        tick.min(left).min(right)
    };
    let can_go = |done: &[u32], node: usize| reach(done, node) > done[node];
    let hole = |node: usize| match nodes.get(node)?.0 {
        Node::Hole(hole) => Some(hole),
        _ => None,
    };
    loop {
        let next = (0..nodes.len())
            .filter(|&node| can_go(&done, node))
            .min_by_key(|&node| (done[node], Reverse(reach(&done, node))));
        let Some(next) = next else { return turns };
        let (first, end) = (done[next], reach(&done, next));
        // Two holes that wait for each other in every sample go on together.
        if let Some(number) = hole(next).filter(|_| end - first == 1) {
            let neighbours = [next + 1, next.wrapping_sub(1)].into_iter();
            let pair = neighbours.filter(|&other| hole(other).is_some() && done[other] == first);
            let best = pair.map(|other| (together(&done, [next, other], can_go), other)).max();
            if let Some((count, other)) = best.filter(|&(count, _)| count > 1) {
                let end = first + count;
                turns.push(Turn::new(Node::Pair(number), nodes[next].1, first, end));
                turns.push(Turn::new(nodes[other].0, nodes[other].1, first, end));
                (done[next], done[other]) = (end, end);
                continue;
            }
        }
        if next == tuned {
            turns.push(Turn::new(Node::Tuned, [0, 0, delayed, 0], first, end));
        }
        let (node, places) = nodes[next];
        turns.push(Turn::new(node, places, first, end));
        done[next] = end;
    }
}

/// For how many samples two nodes can go on by turns.
fn together(done: &[u32], pair: [usize; 2], can_go: impl Fn(&[u32], usize) -> bool) -> u32 {
    let mut done = done.to_vec();
    for count in 0.. {
        for node in pair {
            if !can_go(&done, node) {
                return count;
            }
            done[node] += 1;
        }
    }
    0
}
