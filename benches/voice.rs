//! What a sample costs: the reed alone, the bore alone, both as a voice, and whole blocks at the host's rate.
//!
//! Throughput is read as samples per second: the first three at the internal 96 kHz, `block` at a host of 48 kHz, so
//! over 48 000 it is the number of voices one core plays.

use std::hint::black_box;

use chalumeau_core::bore::lattice::{HoleFlows, Lattice, Tip};
use chalumeau_core::event::Event;
use chalumeau_core::instrument::trial_note::TrialNote;
use chalumeau_core::instrument::voice::{Drive, TICK};
use chalumeau_core::instrument::{Clarinet, Model};
use chalumeau_core::reed::{ReedState, ReedTables};
use chalumeau_core::units::WrittenNote;
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const HOST_HZ: f64 = 48_000.0;
const GAMMA: f64 = 0.5;

fn held(model: &Model) -> TrialNote {
    let written = model.file.fingerings.iter().position(|fingering| fingering.written == WrittenNote(60));
    TrialNote::new(model, written.expect("the built-in clarinet has a C4"), GAMMA)
}

fn reed(criterion: &mut Criterion) {
    let model = Model::built_in(HOST_HZ).expect("built in");
    let (coeffs, tables) = (held(&model).reed(&model), ReedTables::reference());
    let load = coeffs.before(1.0);
    let mut state = ReedState::default();
    let mut p_minus = 0.0;
    let mut group = criterion.benchmark_group("reed");
    group.throughput(Throughput::Elements(1));
    group.bench_function("tick", |bencher| {
        bencher.iter(|| {
            // A closed tube half a period long would answer like this: the reed beats.
            p_minus = -0.9 * state.tick(&coeffs, tables, &load, black_box(GAMMA), p_minus, 0.0, 0.0);
            p_minus
        });
    });
    group.finish();
}

/// A stiff end that pushes a little: the bore without the reed.
struct Push {
    heard: f32,
    holes: HoleFlows<f32>,
}

impl Tip<f32> for Push {
    #[inline(always)]
    fn reflect(&mut self, p_minus: f32) -> f32 {
        0.1 + 0.9 * p_minus
    }

    #[inline(always)]
    fn radiated(&mut self, bell: f32) {
        self.heard += bell;
    }

    #[inline(always)]
    fn holes(&mut self, _before: usize) -> Option<&mut HoleFlows<f32>> {
        Some(&mut self.holes)
    }
}

fn bore(criterion: &mut Criterion) {
    let model = Model::built_in(HOST_HZ).expect("built in");
    let mut group = criterion.benchmark_group("bore");
    group.throughput(Throughput::Elements(TICK as u64));
    let bore = |plain: bool| {
        let mut lattice: Lattice<f32> = Lattice::new(&model.coeffs);
        for (hole, &open) in model.file.fingerings[held(&model).fingering].open.iter().enumerate() {
            lattice.set_opening(hole, f64::from(u8::from(open)));
        }
        lattice.set_jet_loss(2.0);
        if plain { lattice.without_avx2() } else { lattice }
    };
    for (name, plain) in [("as detected", false), ("plain", true)] {
        let (mut lattice, mut tip) = (bore(plain), Push { heard: 0.0, holes: HoleFlows::default() });
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                lattice.run(TICK, &mut tip);
                tip.heard
            });
        });
    }
    group.finish();
}

fn voice(criterion: &mut Criterion) {
    let model = Model::built_in(HOST_HZ).expect("built in");
    let note = held(&model);
    let drive = Drive { p_mouth: GAMMA, tongue: 0.0, noise: 0.3, reed: note.reed(&model) };
    let mut group = criterion.benchmark_group("voice");
    group.throughput(Throughput::Elements(TICK as u64));
    for (name, plain) in [("as detected", false), ("plain", true)] {
        let mut voice = note.voice::<f32>(&model);
        if plain {
            voice = voice.without_avx2();
        }
        group.bench_function(name, |bencher| bencher.iter(|| voice.tick(black_box(&drive))[0]));
    }
    group.finish();
}

fn block(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("block");
    for size in [16, 64, 512] {
        let mut clarinet = Clarinet::built_in(HOST_HZ).expect("built in");
        let note = WrittenNote(60).sounding(2).expect("in range");
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(Event::NoteOn { note, velocity: 0.8 });
        let mut out = vec![0.0; size];
        group.throughput(Throughput::Elements(size as u64));
        group.bench_function(BenchmarkId::from_parameter(size), |bencher| {
            bencher.iter(|| {
                clarinet.render(&mut out);
                out[0]
            });
        });
    }
    group.finish();
}

criterion_group!(benches, reed, bore, voice, block);
criterion_main!(benches);
