//! A lattice whose holes change lanes against one whose holes stay where they were.

use super::super::{HoleFlows, LatticeCoeffs, Tip};
use super::*;
use crate::bore::cells::{Cells, networks};
use crate::bore::instrument_file::InstrumentFile;
use crate::units::Air;

/// Xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, count: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) % count
    }
}

/// A rigid end that keeps what it is told, and pushes now and then.
#[derive(Default)]
struct Ear<F> {
    push: F,
    arrived: Vec<F>,
    bell: Vec<F>,
    rows: Vec<HoleFlows<F>>,
    /// Flows of each hole in the samples of a run.
    holes: Vec<Vec<F>>,
}

impl<F: Real> Tip<F> for Ear<F> {
    fn reflect(&mut self, p_minus: F) -> F {
        self.arrived.push(p_minus);
        self.rows.push(HoleFlows::default());
        p_minus * F::of(0.9) + std::mem::take(&mut self.push)
    }

    fn holes(&mut self, before: usize) -> Option<&mut HoleFlows<F>> {
        let latest = self.rows.len() - 1;
        self.rows.get_mut(latest - before)
    }

    fn radiated(&mut self, bell: F) {
        self.bell.push(bell);
    }

    fn ended(&mut self, holes: &[(usize, usize)]) {
        self.holes
            .extend(self.rows.drain(..).map(|row| holes.iter().map(|&(chunk, k)| row[chunk][k]).collect()));
    }
}

impl<F: Real> Ear<F> {
    fn bits(&mut self) -> Vec<u64> {
        let all = self.arrived.iter().chain(&self.bell).chain(self.holes.iter().flatten());
        let bits = all.map(|x| x.wide().to_bits()).collect();
        self.arrived.clear();
        self.bell.clear();
        self.holes.clear();
        bits
    }
}

/// Random fingers, some that slide, with rests, pads that push air, jets and tuning; and now and then all as it was at first, as for
/// a choir. The lattice whose holes stay goes on sample by sample, never for two at once, and every other tick by [`Lattice::run_any`].
fn play<F: Real>(coeffs: &LatticeCoeffs, fingerings: &[Vec<bool>], samples: usize) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let [mut moving, mut staying] = [Lattice::<F>::new(coeffs), Lattice::new(coeffs)];
    let [mut heard, mut expected] = [Ear::default(), Ear::default()];
    let (mut shut, mut moved, mut ticks, mut rest) = (0, 0, 0_usize, 0_u64);
    let first = moving.hole_lanes.clone();
    while ticks * 16 < samples {
        let [push, fingering, way] = [64, fingerings.len() as u64, 400].map(|count| random.below(count));
        for (lattice, ear, run) in [(&mut moving, &mut heard, 16), (&mut staying, &mut expected, 1)] {
            if rest == 0 {
                for (hole, &open) in fingerings[fingering as usize].iter().enumerate() {
                    match way % 3 {
                        0 => lattice.set_opening(hole, f64::from(u8::from(open))),
                        1 => lattice.glide_opening(hole, f64::from(u8::from(open)), way as usize),
                        _ => lattice.glide_opening(hole, if open { 0.3 } else { 0.0 }, 20),
                    }
                }
                lattice.set_jet_loss(way as f64 / 100.0);
                lattice.glide_delay(push as f64 / 16.0, 64);
            }
            if push == 0 {
                lattice.push(way as usize % first.len(), 1e-3);
            }
            if push == 1 {
                ear.push = F::of(0.5);
            }
            (0..16 / run).for_each(|_| match run == 1 && ticks.is_multiple_of(2) {
                true => lattice.run_any(run, ear),
                false => lattice.run(run, ear),
            });
        }
        ticks += 1;
        rest = if rest == 0 { 50 + 4 * way } else { rest - 1 };
        if ticks.is_multiple_of(64) {
            moving.flush();
            staying.flush_states();
            assert!(staying.hole_lanes == first);
        }
        if push == 2 && way < 40 {
            moving.lay_as_at_first();
            assert!(moving.hole_lanes == first);
        }
        shut += moving.holes.iter().filter(|holes| holes.is_shut).count();
        moved += usize::from(moving.hole_lanes != first);
        assert!(heard.bits() == expected.bits(), "in tick {ticks}");
    }
    println!(
        "{} holes, {} hops, {ticks} ticks: {moved} with holes elsewhere, {shut} shut chunks",
        first.len(),
        moving.layout.hops.len()
    );
    assert!(shut > ticks / 4 && moved > ticks / 8);
}

#[test]
fn holes_sound_the_same_to_the_bit_wherever_they_are() {
    let (file, air) = (InstrumentFile::built_in(), Air::default());
    let open: Vec<Vec<bool>> = file.fingerings.iter().map(|fingering| fingering.open.clone()).collect();
    for rate_hz in [48_000.0, 88_200.0, 96_000.0, 192_000.0] {
        let cells = Cells::cut(&file, &air, rate_hz).unwrap();
        let coeffs = LatticeCoeffs::new(&cells, &networks(&file, &air, &cells), 1.0, &air);
        play::<f32>(&coeffs, &open, 1_000_000);
        play::<f64>(&coeffs, &open, 200_000);
    }
}

/// An arrangement of any open holes has a chunk of shut ones, and the chunks of holes one tick apart in their order.
#[test]
fn every_arrangement_keeps_the_order_of_hops() {
    let (file, air) = (InstrumentFile::built_in(), Air::default());
    let mut random = Random(0x1234_5678_9abc_def1);
    for rate_hz in [48_000.0, 88_200.0, 96_000.0, 192_000.0] {
        let cells = Cells::cut(&file, &air, rate_hz).unwrap();
        let coeffs = LatticeCoeffs::new(&cells, &networks(&file, &air, &cells), 1.0, &air);
        let layout = Layout::new(&coeffs);
        let mut found = 0;
        for _ in 0..20_000 {
            let most_open = 1 + random.below(24);
            let mut is_shut = [false; LAID_HOLES];
            is_shut.iter_mut().for_each(|is_shut| *is_shut = random.below(24) >= most_open);
            let Some(chunks) = layout.arrange(&is_shut, 0) else { continue };
            found += 1;
            for hop in &layout.hops {
                let [before, after] = hop.map(|hole| chunks[usize::from(hole)]);
                assert!(before < after, "{hop:?} in {chunks:?}");
            }
            let is_in = |hole: usize, chunk: usize| usize::from(chunks[hole]) == chunk;
            let holes = || 0..layout.first.len();
            assert!(
                (0..layout.chunks).all(|chunk| holes().filter(|&hole| is_in(hole, chunk)).count() <= LANES)
            );
            assert!((0..layout.chunks).any(|chunk| holes().all(|hole| is_shut[hole] || !is_in(hole, chunk))));
        }
        println!("{rate_hz} Hz: {found} of 20000 sets of open holes leave a chunk shut");
        assert!(found > 5_000);
    }
}
