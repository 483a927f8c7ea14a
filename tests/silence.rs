//! What must end does end: however a slur is cut off, the instrument falls silent and says so.
//!
//! `CHALUMEAU_CASES=10000 cargo test --release --no-default-features --features cli --test silence` plays many more
//! cases than the default; `CHALUMEAU_SEED`, a number, plays others.

#[path = "silence/energy.rs"]
mod energy;
#[path = "support/parallel.rs"]
mod parallel;

use std::sync::{Arc, LazyLock};

use chalumeau::controllers;
use chalumeau::controllers::ParameterLink;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::control::midi::MidiDecoder;
use chalumeau_core::control::midi::links::Source;
use chalumeau_core::control::notes::{NoteAddress, NoteExpression};
use chalumeau_core::event::Event;
use chalumeau_core::instrument::prepare::{Preparation, Wanted};
use chalumeau_core::instrument::{
    Beyond, BreathResponse, Clarinet, Listening, ListeningMode, Model, Reach, Room, Settings, Tuning,
};
use chalumeau_core::reed::PhysicalReed;
use chalumeau_core::units::{SoundingNote, WrittenNote};

const HOST_HZ: f64 = 48_000.0;
/// Time that the instrument has to fall silent, s.
const TIME_S: f64 = 5.0;
/// Silence: -100 dBFS.
const SILENT: f32 = 1e-5;

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(HOST_HZ).unwrap()));

fn number_of(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{variable} must be a whole number, got {text:?}")))
}

fn cases(usual: usize) -> usize {
    number_of("CHALUMEAU_CASES").map_or(usual, |cases| cases as usize)
}

/// The numbers of one case of a test, which has a number of its own.
fn random_of(test: u64, case: usize) -> Random {
    Random(test ^ ((case as u64) << 32) ^ number_of("CHALUMEAU_SEED").unwrap_or(0).rotate_left(48))
}

/// Numbers that look random and are the same in every run (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(2).unwrap()
}

fn render(clarinet: &mut Clarinet, seconds: f64) -> f32 {
    let mut out = vec![0.0; (seconds * HOST_HZ).round() as usize];
    clarinet.render(&mut out);
    out.iter().fold(0.0, |peak, sample| peak.max(sample.abs()))
}

/// Every way to say that all sound must end.
fn ends(clarinet: &mut Clarinet, way: usize) {
    match way {
        0 => clarinet.apply(Event::Panic),
        // Upwards, so that no key is left that could be heard again.
        _ => (0..128).for_each(|key| clarinet.apply(Event::Choke { note: SoundingNote(key) })),
    }
}

fn assert_silent(clarinet: &mut Clarinet, what: &str) {
    render(clarinet, TIME_S);
    let peak = render(clarinet, 0.1);
    assert!(peak < SILENT, "{what}: {peak:e} after {TIME_S} s");
    assert!(clarinet.is_silent(), "{what}: the instrument does not say that it is silent");
    assert_eq!(clarinet.resets(), 0, "{what}");
}

#[test]
fn a_slur_cut_off_does_not_sing_by_itself() {
    let reference = PhysicalReed::reference();
    for stiffness_n_m in [4_930.0, 2_500.0, reference.stiffness_n_m] {
        for cut_ms in [0.5, 2.0, 6.2] {
            for way in 0..2 {
                let mut clarinet = Clarinet::new(MODEL.clone(), HOST_HZ);
                let reed = PhysicalReed { stiffness_n_m, ..reference };
                clarinet.set_settings(&Settings::physical().with_physical_reed(&reed, &reference));
                clarinet.apply(Event::NoteOn { note: sounding(57), velocity: 0.8 });
                render(&mut clarinet, 0.3);
                clarinet.apply(Event::NoteOn { note: sounding(65), velocity: 0.8 });
                render(&mut clarinet, 1e-3 * cut_ms);
                ends(&mut clarinet, way);
                assert_silent(&mut clarinet, &format!("{stiffness_n_m} N/m, cut after {cut_ms} ms, {way}"));
            }
        }
    }
}

/// Settings anywhere in their ranges: reeds, lays, lips, and all that a user may set.
/// Any MIDI message; of every channel, note, controller and value.
fn any_message(random: &mut Random, midi: &mut MidiDecoder, clarinet: &mut Clarinet) {
    let (channel, data) = (random.below(16) as u8, random.next());
    let (first, second) = (data as u8 & 127, (data >> 8) as u8 & 127);
    // Keys near the instrument's, so that most of them sound.
    let key = 40 + first % 60;
    let said = match random.below(20) {
        0..6 => midi.note_on(channel, key, second),
        6..11 => midi.note_off(channel, key),
        11..16 => midi.controller(channel, first, second),
        // What players move most.
        16 => midi.controller(channel, [1, 2, 11, 18, 19, 20, 64, 74][usize::from(first % 8)], second),
        17 => midi.pressure(channel, first),
        18 => midi.bend(channel, (data >> 16) as u16 & 16_383),
        _ => {
            midi.express(NoteAddress::of_key(channel, key), NoteExpression::Breath(f32::from(second) / 127.0))
        }
    };
    said.iter().for_each(|&event| clarinet.apply(event));
}

/// Every controller that a user may link, moved with all the others.
#[test]
fn a_million_messages_on_sixteen_channels_leave_no_stuck_note() {
    const MESSAGES: usize = 31_250;
    const SAMPLES: usize = 8;
    let linkable: Vec<_> = controllers::linkable().filter(|parameter| parameter.id != "gain").collect();
    let runs: Vec<usize> = (0..cases(32)).collect();
    parallel::each(&runs, |&case| {
        let mut random = random_of(7, case);
        let mut clarinet = Clarinet::new(MODEL.clone(), HOST_HZ);
        let links: Vec<_> = (0..8)
            .filter_map(|_| {
                let (cc, parameter) = (random.below(120) as u8, linkable[random.below(linkable.len())]);
                ParameterLink::whole(Source::Controller(cc), parameter)
            })
            .collect();
        let mut midi = MidiDecoder::new();
        midi.set_links(&controllers::as_links(&links, &Settings::default()));
        let mut sound = [0.0; SAMPLES];
        for message in 0..MESSAGES {
            any_message(&mut random, &mut midi, &mut clarinet);
            clarinet.render(&mut sound);
            assert!(sound.iter().all(|x| x.abs() <= 1.0), "case {case}, message {message}: {sound:?}");
        }
        // All sound off, all notes off.
        for &event in midi.controller(0, [120, 123][case % 2], 0) {
            clarinet.apply(event);
        }
        assert_silent(&mut clarinet, &format!("case {case}"));
    });
}

fn any_settings(random: &mut Random) -> Settings {
    Settings {
        breath_response: if random.below(2) == 0 { BreathResponse::Played } else { BreathResponse::Physical },
        breath_curve: random.between(0.5, 2.0),
        breath_softest: random.between(0.0, 0.5),
        breath_loudest: random.between(0.1, 1.0),
        breath_full_kpa: random.between(2.0, 20.0),
        noise: random.between(0.0, 1.0),
        tongue_ms: random.between(1.0, 20.0),
        legato_ms: random.between(5.0, 15.0),
        strength: random.between(1.5, 5.0),
        lip: random.between(0.6, 1.4),
        zeta: random.between(0.05, 0.9),
        damping: random.between(0.2, 2.0),
        lay: random.between(0.0, 0.5),
        reed_h: random.between(1.0, 5.0),
        reed_k: random.between(0.1, 2.0),
        coupled: random.below(2) == 0,
        reed_a: random.between(0.0, 2.0),
        a4_hz: random.between(415.0, 466.0),
        tuning: if random.below(2) == 0 { Tuning::Natural } else { Tuning::Tempered },
        temperature_c: random.between(10.0, 40.0),
        vent_loss: random.between(0.0, 4.0),
        gain_db: random.between(-20.0, 24.0),
        listening: Listening {
            mode: [ListeningMode::Everywhere, ListeningMode::Position, ListeningMode::Point][random.below(3)],
            distance_m: random.between(0.2, 10.0),
            angle_deg: random.between(-180.0, 180.0),
            height_m: random.between(-1.0, 2.0),
            width_deg: random.between(0.0, 180.0),
        },
        room: Room::default(),
        reach: Reach {
            transpose: random.below(49) as i32 - 24,
            beyond: if random.below(2) == 0 { Beyond::Silent } else { Beyond::Octave },
            ..Reach::default()
        },
        ..Settings::default()
    }
}

fn any_note(random: &mut Random) -> Event {
    let note = sounding(52 + random.below(46) as u8);
    Event::NoteOn { note, velocity: random.between(0.1, 1.0) }
}

/// Plays a few notes, most of them slurred, while anything else may happen, and cuts them off.
fn any_phrase_ends(case: usize) {
    let mut random = random_of(0x0051_1ece, case);
    let mut clarinet = Clarinet::new(MODEL.clone(), HOST_HZ);
    clarinet.set_settings(&any_settings(&mut random));
    for _ in 0..1 + random.below(5) {
        clarinet.apply(any_note(&mut random));
        match random.below(6) {
            0 => clarinet.apply(Event::Breath(random.between(0.0, 1.0))),
            1 => clarinet.apply(Event::Bend { cents: random.between(-2_400.0, 2_400.0) }),
            2 => clarinet.apply(Event::TryHoles(Some(random.next()))),
            3 => clarinet.apply(Event::TongueSlap { strength: random.between(0.0, 1.0) }),
            4 => {
                clarinet.apply(Event::Reed { h: random.between(0.2, 5.0), k: random.between(0.2, 5.0) });
            }
            _ => clarinet.set_settings(&any_settings(&mut random)),
        }
        let seconds = random.between(0.0, 0.15);
        render(&mut clarinet, f64::from(seconds));
    }
    clarinet.apply(any_note(&mut random));
    let seconds = random.between(0.0, 0.02);
    render(&mut clarinet, f64::from(seconds));
    ends(&mut clarinet, case % 2);
    assert_silent(&mut clarinet, &format!("case {case}"));
}

#[test]
fn whatever_is_cut_off_falls_silent() {
    let cases = cases(60);
    let numbers: Vec<usize> = (0..cases).collect();
    parallel::each(&numbers, |&case| any_phrase_ends(case));
    println!(
        "{cases} phrases cut off: below -100 dBFS after {TIME_S} s, and silent by the instrument's word"
    );
}

/// Written G6: the notes above it have a fault of their own, which the tail does not cover.
const HIGHEST: u8 = 91;

#[test]
fn the_tail_that_hosts_are_told_covers_every_note_up_to_g6() {
    let bass = Preparation::new(&Wanted::new(Bundled::Bass.file(), HOST_HZ), None).rough().unwrap();
    for (model, transposition) in [(MODEL.clone(), 2), (Arc::new(bass), 14)] {
        let mut longest = (0.0_f64, 0);
        for written in (model.file.lowest().0..=HIGHEST).step_by(3) {
            for gain_db in [0.0, 24.0] {
                let mut clarinet = Clarinet::new(model.clone(), HOST_HZ);
                clarinet.set_settings(&Settings {
                    gain_db,
                    vent_loss: 0.0,
                    damping: 0.2,
                    ..Settings::default()
                });
                let note = WrittenNote(written).sounding(transposition).unwrap();
                clarinet.apply(Event::NoteOn { note, velocity: 0.8 });
                render(&mut clarinet, 0.5);
                assert!(!clarinet.is_resting(), "written {written}");
                clarinet.apply(Event::NoteOff { note });
                while !clarinet.is_resting() {
                    render(&mut clarinet, 0.01);
                }
                let mut tail_s = 0.0;
                while !clarinet.is_silent() && tail_s < 2.0 * Clarinet::TAIL_S {
                    render(&mut clarinet, 0.01);
                    tail_s += 0.01;
                }
                assert!(tail_s < Clarinet::TAIL_S, "{}, written {written}: {tail_s:.2} s", model.file.name);
                if tail_s > longest.0 {
                    longest = (tail_s, written);
                }
            }
        }
        println!("{}: {:.2} s after written {}", model.file.name, longest.0, longest.1);
    }
}
