use super::*;
use crate::dsp::white::White;
use crate::instrument::{Articulation, Model, Settings};
use crate::units::SoundingNote;

const RATE_HZ: f64 = 48_000.0;
const SAMPLES: usize = 12_000;

fn model() -> Arc<Model> {
    Arc::new(Model::built_in(RATE_HZ).unwrap())
}

fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// What one of several plays: notes, breath and bends of its own at times of its own.
fn events(of: usize) -> Vec<Timed<Event>> {
    let mut white = White::new(of as u64 + 1);
    let mut unit = || white.next() / 3.0_f64.sqrt() * 0.5 + 0.5;
    let mut at = 0.0;
    let mut all = vec![Timed { at: 0, event: Event::NoteOn { note: SoundingNote(60), velocity: 0.9 } }];
    all.extend((0..20).map(|_| {
        at += 1_000.0 * unit();
        let event = match (4.0 * unit()) as u8 {
            0 => Event::Breath(unit() as f32),
            1 => Event::Bend { cents: (200.0 * unit() - 100.0) as f32 },
            _ => Event::NoteOn { note: SoundingNote(52 + (30.0 * unit()) as u8), velocity: unit() as f32 },
        };
        Timed { at: at as usize, event }
    }));
    all
}

/// One of several instruments, some of which have pads that are heard, and so leave their lanes again and again.
fn clarinet(models: &[Arc<Model>], of: usize) -> Clarinet {
    let mut clarinet = Clarinet::new(models[of % models.len()].clone(), RATE_HZ);
    let key_sounds = if of.is_multiple_of(3) { 0.7 } else { 0.0 };
    let articulation = Articulation { key_sounds, ..Articulation::default() };
    clarinet.set_settings(&Settings { articulation, zeta: 0.2 + 0.005 * of as f32, ..Settings::default() });
    clarinet.reset();
    clarinet
}

/// Plays of different lengths, in one or two channels.
fn beside(models: &[Arc<Model>], count: usize) -> Vec<[Vec<f32>; 2]> {
    let play = async |stand: &Stand, of: usize| {
        let clarinet = PlayedBeside::new(clarinet(models, of));
        let samples = SAMPLES - 500 * (of % 7);
        let mut out = [vec![0.0; samples], vec![0.0; samples]];
        let [left, right] = &mut out;
        let channels = if of.is_multiple_of(2) { Channels::one(left) } else { Channels::two(left, right) };
        clarinet.render_events_channels(stand, events(of), channels).await;
        assert_eq!(clarinet.resets(), 0);
        out
    };
    each(count, play, &mut go_on).unwrap()
}

fn alone_each(models: &[Arc<Model>], count: usize) -> Vec<[Vec<f32>; 2]> {
    (0..count)
        .map(|of| {
            let samples = SAMPLES - 500 * (of % 7);
            let mut out = [vec![0.0; samples], vec![0.0; samples]];
            let [left, right] = &mut out;
            let channels =
                if of.is_multiple_of(2) { Channels::one(left) } else { Channels::two(left, right) };
            clarinet(models, of).render_events_channels(events(of), channels);
            out
        })
        .collect()
}

#[test]
fn clarinets_beside_each_other_give_the_bits_they_give_alone() {
    let model = model();
    let own = Arc::new(Model { a4_hz: 442.0, ..Model::clone(&model) });
    let other = Arc::new(Model::built_in(44_100.0).unwrap());
    // Of one bore, though not of one model; and of two, of which neither fills all lanes.
    for (models, count) in [(vec![model.clone(), own], 41), (vec![model, other], 22)] {
        let (beside, alone) = (beside(&models, count), alone_each(&models, count));
        for (of, (beside, alone)) in beside.iter().zip(&alone).enumerate() {
            assert!(alone[0].iter().any(|x| x.abs() > 0.001), "{of} is silent");
            assert!(beside == alone, "{of} of {count}");
        }
    }
}

#[test]
fn a_break_drops_what_has_begun() {
    let model = model();
    let begun = std::sync::atomic::AtomicUsize::new(0);
    let play = async |stand: &Stand, of: usize| {
        begun.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let clarinet = PlayedBeside::new(clarinet(std::slice::from_ref(&model), 1));
        // All but the one that begins first play for an hour.
        let cells = if of == 0 { 1 } else { 3_600 * 48_000 / 64 };
        let mut out = [0.0; 64];
        for _ in 0..cells {
            clarinet.render_channels(stand, Channels::one(&mut out)).await;
        }
    };
    assert!(each(200, play, &mut |_| ControlFlow::Break(())).is_none());
    assert!(begun.into_inner() < 200);
}

#[cfg(feature = "fit")]
#[test]
fn a_held_note_beside_others_gives_the_bits_it_gives_alone() {
    use crate::bore::instrument_file::InstrumentFile;
    use crate::instrument::{Preparation, Wanted};
    let pipe = InstrumentFile::parse(include_str!("../../../tests/data/pipe.toml")).unwrap();
    let pipe = Preparation::new(&Wanted::new(pipe, RATE_HZ), None).rough().unwrap();
    for model in [Arc::unwrap_or_clone(model()), pipe] {
        held_notes_beside_each_other(&model);
    }
}

/// Notes of all kinds: from one point and from everywhere, and with a delay that glides and arrives within a tick.
#[cfg(feature = "fit")]
fn held_notes_beside_each_other(model: &Model) {
    use crate::instrument::trial_note::TrialNote;
    use crate::instrument::voice::TICK;
    let note = |of: usize| {
        let rows = 0.37 * of as f64 - 2.0;
        let fingering = 3 * of % model.tuning.notes.len();
        let gamma = 0.4 + 0.03 * of as f64;
        let held = TrialNote::played(model, fingering, 1.0 - 0.05 * of as f64, gamma);
        TrialNote {
            rows,
            ..if of.is_multiple_of(2) { held } else { TrialNote::new(model, fingering, gamma) }
        }
    };
    let drive = |of: usize, tick: usize| {
        let (note, reed) = (note(of), note(of).reed(model));
        let p_mouth = note.breath((tick + 1) as f64 * TICK as f64 / model.coeffs.rate_hz).0;
        Drive { p_mouth: p_mouth * reed.closing_pressure(), tongue: 0.0, noise: 0.0, reed }
    };
    // Where the delay sets out for another place, for some the shortest that there is, in how many samples.
    let least = model.coeffs.tuning_range().0;
    let rows = |of: usize| if of % 3 == 1 { least } else { 0.21 * of as f64 };
    let glide = |of: usize, tick: usize| (tick == 40 + of).then_some((rows(of), 300 + 7 * of));
    let beside = async |stand: &Stand, of: usize| {
        let voice = BlownBeside::new(model, note(of).voice(model), drive(of, 0));
        let mut all = Vec::new();
        for tick in 0..300 + 20 * of {
            if let Some((rows, samples)) = glide(of, tick) {
                voice.with(|voice| voice.lattice_mut().glide_delay(rows, samples));
            }
            voice.tick(stand, drive(of, tick)).await;
            all.push(voice.with(|voice| (*voice.heard().0, voice.p_mouthpiece())));
        }
        all
    };
    for (of, beside) in each(13, beside, &mut go_on).unwrap().iter().enumerate() {
        let mut voice: Voice<f32> = note(of).voice(model);
        for (tick, beside) in beside.iter().enumerate() {
            if let Some((rows, samples)) = glide(of, tick) {
                voice.lattice_mut().glide_delay(rows, samples);
            }
            let out = *voice.tick(&drive(of, tick));
            assert!((out, voice.p_mouthpiece()) == *beside, "{of}, tick {tick}");
        }
    }
    // Longer and longer ones: the last are alone.
    let to_s = |of: usize| 0.08 + 0.01 * of as f64;
    let play = async |stand: &Stand, of: usize| note(of).radiated_beside(stand, model, 0.05, to_s(of)).await;
    for (of, heard) in each(13, play, &mut go_on).unwrap().iter().enumerate() {
        assert!(*heard == note(of).radiated(model, 0.05, to_s(of)), "{of}");
        assert!(heard.iter().any(|x| *x != 0.0), "{of} is silent");
    }
}
