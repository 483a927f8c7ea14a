//! The sound outside against the transfer matrices, and its bits.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::*;
use crate::bore::lattice::{Lattice, Tip};
use crate::bore::transfer_matrix::TransferMatrix;
use crate::dsp::smooth::smooth_single;
use crate::event::Event;
use crate::instrument::{Channels, Clarinet, Model, Settings};
use crate::measure::radiated_bands::LINES;
use crate::units::SoundingNote;

/// An end that lets arriving waves out, after an impulse.
struct Impulse {
    outside: Outside<f64>,
    first: f64,
    y_tip: f64,
    at: usize,
    /// Flow into the bore, and what is heard of it.
    into: Vec<f64>,
    heard: [Vec<f64>; 2],
}

impl Tip<f64> for Impulse {
    fn reflect(&mut self, p_minus: f64) -> f64 {
        let leaving = std::mem::take(&mut self.first);
        self.into.push(self.y_tip * (leaving - p_minus));
        leaving
    }

    fn radiated(&mut self, bell: f64) {
        self.outside.bell(self.at, bell);
        self.at += 1;
    }

    fn holes(&mut self, before: usize) -> Option<&mut HoleFlows<f64>> {
        Some(self.outside.holes(self.at - 1 - before))
    }

    fn ended(&mut self, holes: &[(usize, usize)]) {
        self.at = 0;
        self.outside.radiate(holes);
        let (left, right) = self.outside.heard();
        for (heard, out) in self.heard.iter_mut().zip([left, right.unwrap_or(left)]) {
            heard.extend(out.map(f64::from));
        }
    }
}

fn transform(samples: &[f64], rate_hz: f64, f_hz: f64) -> Complex64 {
    let (mut turn, step) = (Complex64::ONE, Complex64::cis(-TAU * f_hz / rate_hz));
    samples.iter().fold(Complex64::ZERO, |sum, sample| {
        let term = turn * sample;
        turn *= step;
        sum + term
    })
}

/// What is heard of a flow of 1, as the flow of one point, at each of some frequencies.
fn heard(
    model: &Model,
    open: &[bool],
    listening: &Listening,
    stereo: bool,
    at_hz: &[f64],
) -> Vec<[Complex64; 2]> {
    let mut lattice = Lattice::<f64>::new(&model.coeffs);
    for (hole, &open) in open.iter().enumerate() {
        lattice.set_opening(hole, f64::from(u8::from(open)));
    }
    let sources = SoundSources::of(&model.file);
    let mut outside = Outside::new(&model.coeffs, sources, &model.air, 1.0);
    outside.listen(listening, stereo);
    outside.heed(true, |hole| open[hole]);
    let y_tip = model.coeffs.tip_admittance();
    let mut tip =
        Impulse { outside, first: 1.0, y_tip, at: 0, into: Vec::new(), heard: [Vec::new(), Vec::new()] };
    for _ in 0..600 {
        lattice.run(TICK, &mut tip);
    }
    let rate_hz = model.coeffs.rate_hz;
    at_hz
        .iter()
        .map(|&f_hz| {
            let change = 1.0 - Complex64::cis(-TAU * f_hz / rate_hz);
            let into = transform(&tip.into, rate_hz, f_hz) * change;
            [0, 1].map(|side: usize| transform(&tip.heard[side], rate_hz, f_hz) / into)
        })
        .collect()
}

/// The sound itself, from the lattice through the delays, against the transfer matrices: for every note of the chart up
/// to G#6, third octaves up to 5 kHz. Above, the lattice itself sends out more than the transfer matrices do (3 dB at
/// 6.3 kHz), however it is heard.
#[test]
fn everywhere_sounds_as_the_power_average_of_the_transfer_matrices() {
    let model = Model::built_in(48_000.0).unwrap();
    let matrix = TransferMatrix::new(&model.file, model.air);
    let sources = SoundSources::of(&model.file);
    let paths = Listening::everywhere(&sources, &model.air);
    let presence = Presence::of(&sources);
    let mut flows = vec![Complex64::ZERO; sources.places_m.len()];
    let centres: Vec<f64> = (-10..=7).map(|n| 1_000.0 * (f64::from(n) / 3.0).exp2()).collect();
    let lines = |centre_hz: f64| {
        let part = |line: u32| (f64::from(line) + 0.5) / f64::from(LINES) - 0.5;
        (0..LINES).map(move |line| centre_hz * (part(line) / 3.0).exp2())
    };
    let at_hz: Vec<f64> = centres.iter().flat_map(|&centre_hz| lines(centre_hz)).collect();
    let (mut offs, mut path_offs, mut point_offs) = (Vec::new(), Vec::new(), Vec::new());
    for (fingering, &note_hz) in model.file.fingerings.iter().zip(&model.notes_hz).take(41) {
        let modes = [Listening::default(), Listening::point()];
        let [everywhere, point] =
            modes.map(|listening| heard(&model, &fingering.open, &listening, false, &at_hz));
        for (band, &centre_hz) in centres.iter().enumerate().filter(|(_, f)| **f > 0.9 * note_hz) {
            let range = band * LINES as usize..(band + 1) * LINES as usize;
            let (mut average, mut along_paths) = (0.0, 0.0);
            for f_hz in lines(centre_hz) {
                matrix.outflows(f_hz, &fingering.open, &mut flows);
                average += sources.power_average(f_hz, &flows, &model.air);
                along_paths += paths.heard(f_hz, &flows).norm_sqr();
            }
            let power = |heard: &[[Complex64; 2]]| -> f64 {
                heard[range.clone()].iter().map(|[left, _]| left.norm_sqr()).sum()
            };
            // What presence adds is not of the average.
            let plain = |heard: &[[Complex64; 2]]| -> f64 {
                let gain = |f_hz: f64| 10.0_f64.powf(0.1 * presence.gain_db(f_hz));
                let lines = heard[range.clone()].iter().zip(lines(centre_hz));
                lines.map(|([left, _], f_hz)| left.norm_sqr() / gain(f_hz)).sum()
            };
            let off_db = |power: f64, from: f64| 10.0 * (power / from).log10();
            offs.push(off_db(plain(&everywhere), average));
            path_offs.push(off_db(plain(&everywhere), along_paths));
            point_offs.push(off_db(power(&point), average));
        }
    }
    let rms = |offs: &[f64]| (offs.iter().map(|x| x * x).sum::<f64>() / offs.len() as f64).sqrt();
    let worst = |offs: &[f64]| offs.iter().fold(0.0_f64, |worst, off| worst.max(off.abs()));
    for (name, offs) in
        [("everywhere", &offs), ("everywhere, from its paths", &path_offs), ("point", &point_offs)]
    {
        println!("{name}: {:.2} dB, at most {:.1}, {} bands", rms(offs), worst(offs), offs.len());
    }
    assert!(rms(&offs) < 1.4 && worst(&offs) < 5.5, "{} {}", rms(&offs), worst(&offs));
    // The lattice and whole samples of delay.
    assert!(rms(&path_offs) < 0.4, "{}", rms(&path_offs));
    assert!(rms(&point_offs) > 1.9 * rms(&offs), "{}", rms(&point_offs));
}

/// Each place against the sum of the transfer matrices' flows along the same paths.
#[test]
fn places_sound_as_their_paths_say() {
    let model = Model::built_in(48_000.0).unwrap();
    let matrix = TransferMatrix::new(&model.file, model.air);
    let sources = SoundSources::of(&model.file);
    let mut flows = vec![Complex64::ZERO; sources.places_m.len()];
    let listening = Listening { mode: ListeningMode::Position, distance_m: 0.4, ..Listening::default() };
    let paths = [-1.0, 1.0].map(|side| listening.position(side, &sources, &model.air));
    let at_hz = [200.0, 450.0, 800.0, 1_200.0, 2_200.0, 3_000.0];
    let mut offs = Vec::new();
    for midi in [52, 60, 69, 79] {
        let open = &model.file.fingering(crate::units::WrittenNote(midi)).unwrap().open;
        for (f_hz, sides) in at_hz.into_iter().zip(heard(&model, open, &listening, true, &at_hz)) {
            matrix.outflows(f_hz, open, &mut flows);
            for (side, paths) in sides.iter().zip(&paths) {
                let expected = paths.heard(f_hz, &flows);
                offs.push(20.0 * (side.norm() / expected.norm()).log10());
            }
        }
    }
    let mean = offs.iter().map(|off| off.abs()).sum::<f64>() / offs.len() as f64;
    println!("places: mean {mean:.2} dB off");
    assert!(mean < 0.6, "{offs:?}");
}

fn played(mode: ListeningMode, plain: bool, blocks: &[usize]) -> [Vec<f32>; 2] {
    let mut clarinet = Clarinet::built_in(44_100.0).unwrap();
    if plain {
        clarinet = clarinet.without_avx2();
    }
    let listening = Listening { mode, ..Listening::default() };
    clarinet.set_settings(&Settings { listening, ..Settings::default() });
    clarinet.apply(Event::Breath(0.7));
    clarinet.apply(Event::NoteOn { note: SoundingNote(65), velocity: 0.8 });
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for &samples in blocks.iter().cycle().take(40) {
        let (mut l, mut r) = (vec![0.0; samples], vec![0.0; samples]);
        clarinet.render_channels(Channels::two(&mut l, &mut r));
        left.extend(l);
        right.extend(r);
    }
    [left, right]
}

#[test]
fn every_way_of_listening_has_the_same_bits_in_any_block_with_and_without_avx2() {
    for mode in [ListeningMode::Everywhere, ListeningMode::Position, ListeningMode::Point] {
        let whole = played(mode, false, &[256]);
        assert!(whole[0].iter().any(|sample| sample.abs() > 0.01));
        assert_eq!(whole[0] == whole[1], mode != ListeningMode::Position);
        assert!(played(mode, true, &[256]) == whole, "{mode:?} without AVX2");
        assert!(played(mode, false, &[1, 511]) == whole, "{mode:?} in other blocks");
    }
}

#[test]
fn another_way_of_listening_fades_in_without_a_click() {
    let mut clarinet = Clarinet::built_in(48_000.0).unwrap();
    clarinet.apply(Event::Breath(0.7));
    clarinet.apply(Event::NoteOn { note: SoundingNote(65), velocity: 0.8 });
    let modes = [ListeningMode::Point, ListeningMode::Position, ListeningMode::Everywhere];
    let mut sounds = [Vec::new(), Vec::new()];
    for mode in modes.into_iter().cycle().take(8) {
        let listening = Listening { mode, ..Listening::default() };
        clarinet.set_settings(&Settings { listening, noise: 0.0, ..Settings::default() });
        let (mut left, mut right) = (vec![0.0; 9_600], vec![0.0; 9_600]);
        clarinet.render_channels(Channels::two(&mut left, &mut right));
        for (sound, part) in sounds.iter_mut().zip([left, right]) {
            sound.push(part);
        }
    }
    for sound in &sounds {
        // What a click has and a note has not: a large third difference.
        let sharpest = |samples: &[f32]| {
            let third = |w: &[f32]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
            samples.windows(4).map(third).fold(0.0, f32::max)
        };
        for parts in sound[2..].windows(2) {
            let [before, after] = [&parts[0], &parts[1]];
            let still = sharpest(&before[4_800..]).max(sharpest(&after[4_800..]));
            let change: Vec<f32> = before[9_590..].iter().chain(&after[..480]).copied().collect();
            assert!(sharpest(&change) < 1.1 * still, "{} over {still}", sharpest(&change));
        }
    }
}

/// Who begins to listen in one point hears at once what was heard there all along: the sum of all flows before was not kept.
#[test]
fn a_point_that_fades_in_begins_with_the_flows_of_the_tick_before() {
    let model = Model::built_in(48_000.0).unwrap();
    let open = &model.file.fingering(crate::units::WrittenNote(60)).unwrap().open;
    let everywhere = Listening { mode: ListeningMode::Everywhere, ..Listening::default() };
    let heard = |first: &Listening, then: &Listening| {
        let mut lattice = Lattice::<f64>::new(&model.coeffs);
        for (hole, &open) in open.iter().enumerate() {
            lattice.set_opening(hole, f64::from(u8::from(open)));
        }
        let sources = SoundSources::of(&model.file);
        let mut outside = Outside::new(&model.coeffs, sources, &model.air, 1.0);
        outside.silence();
        outside.listen(first, false);
        outside.heed(true, |hole| open[hole]);
        let y_tip = model.coeffs.tip_admittance();
        let mut tip =
            Impulse { outside, first: 1.0, y_tip, at: 0, into: Vec::new(), heard: [Vec::new(), Vec::new()] };
        (0..20).for_each(|_| lattice.run(TICK, &mut tip));
        tip.outside.listen(then, false);
        lattice.run(TICK, &mut tip);
        tip.outside.out[0]
    };
    let [old, new] = [everywhere, Listening::point()].map(|listening| heard(&listening, &listening));
    let faded = heard(&everywhere, &Listening::point());
    for n in 0..TICK {
        let way = (n + 1) as f32 / (FADE_TICKS as usize * TICK) as f32;
        assert_eq!(faded[n], old[n] + smooth_single(way) * (new[n] - old[n]), "sample {n}");
    }
    assert!(old.iter().zip(&new).any(|(old, new)| (old - new).abs() > 1e-6));
}
