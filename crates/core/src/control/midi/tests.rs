//! Tests of the decoder as a whole: messages in, events out.

mod linked;

use super::links::Source;
use super::mix::MixControllers;
use super::*;

const NOTHING: [Event; 0] = [];

fn on(key: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: 1.0 }
}

fn off(key: u8) -> Event {
    Event::NoteOff { note: SoundingNote(key) }
}

fn choked(key: u8) -> Event {
    Event::Choke { note: SoundingNote(key) }
}

fn bend(cents: f32) -> Event {
    Event::Bend { cents }
}

fn breath(raw: u8) -> Event {
    Event::Breath(f32::from(raw) / 127.0)
}

fn note(id: i32, key: u8) -> Note {
    Note { id: Some(id), channel: 0, key }
}

fn id(id: i32) -> NoteAddress {
    NoteAddress { id: Some(id), ..NoteAddress::default() }
}

/// Links with one, to a number.
fn one_link(source: Source) -> [Option<Link>; links::MOST] {
    let target = links::Target::Number(crate::event::SettingNumber::Growl);
    let mut all = [None; links::MOST];
    all[0] = Some(Link { source, target, low: 0.0, high: 1.0, curve: 1.0, own: 0.2 });
    all
}

fn key(key: u8) -> NoteAddress {
    NoteAddress { key: Some(key), ..NoteAddress::default() }
}

/// With a key held, so that every change counts.
fn playing() -> MidiDecoder {
    let mut midi = MidiDecoder::new();
    midi.note_on(9, 40, 127);
    midi
}

#[test]
fn velocity_zero_is_note_off() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.note_on(0, 60, 127), [on(60)]);
    assert_eq!(midi.note_on(0, 60, 0), [off(60)]);
    assert_eq!(midi.note_off(0, 60), NOTHING, "it was up");
}

#[test]
fn a_source_at_rest_has_not_moved() {
    let mut midi = playing();
    assert_eq!(midi.controller(0, 2, 0), NOTHING);
    assert_eq!(midi.pressure(0, 0), NOTHING);
    assert_eq!(midi.controller(1, 11, 127), NOTHING, "what every sequencer sends");
    assert_eq!(midi.controller(0, 11, 1), [breath(1)]);
    assert_eq!(midi.controller(0, 2, 0), NOTHING, "CC2 has yet to move");
    assert_eq!(midi.controller(0, 11, 0), [breath(0)]);
    assert_eq!(midi.controller(0, 11, 127), [breath(127)], "now it plays");
}

#[test]
fn breath_is_exact_in_7_bits_and_in_14() {
    let mut midi = playing();
    assert_eq!(midi.controller(0, 2, 127), [Event::Breath(1.0)]);
    assert_eq!(midi.controller(0, 2, 64), [breath(64)]);
    assert_eq!(midi.controller(0, 34, 1), [Event::Breath(8193.0 / 16383.0)]);
    assert_eq!(midi.controller(1, 2, 64), [breath(64)], "fine part is per channel");
    midi.controller(0, 2, 127);
    assert_eq!(midi.controller(0, 34, 127), [Event::Breath(1.0)]);
    midi.reset();
    assert_eq!(midi.controller(0, 2, 127), NOTHING, "it has forgotten the key too");
}

#[test]
fn fine_breath_rises_with_every_step() {
    let mut midi = playing();
    let mut last = 0.0;
    for value in 1..16384u16 {
        midi.controller(0, 2, (value >> 7) as u8);
        let [Event::Breath(unit)] = *midi.controller(0, 34, (value & 127) as u8) else { panic!() };
        assert!(unit > last && unit <= 1.0);
        last = unit;
    }
    assert_eq!(last, 1.0);
}

#[test]
fn the_highest_source_that_has_moved_is_heard() {
    let mut midi = playing();
    assert_eq!(midi.pressure(0, 127), [Event::KeyPressure(1.0)]);
    assert_eq!(midi.controller(3, 11, 1), [breath(1)]);
    assert_eq!(midi.pressure(0, 100), NOTHING);
    assert_eq!(midi.controller(0, 2, 10), [breath(10)]);
    assert_eq!(midi.controller(3, 11, 80), NOTHING);
    assert_eq!(midi.controller(3, 43, 80), NOTHING);
    assert_eq!(midi.breath_origin(), Some(BreathOrigin::Controller(BreathController::Breath)));
}

#[test]
fn aftertouch_of_a_keyboard_adds_to_velocity_and_pressure_without_a_key_is_breath() {
    let pressed = |value: u8| Event::KeyPressure(f32::from(value) / 127.0);
    let mut midi = MidiDecoder::new();
    midi.note_on(0, 60, 127);
    assert_eq!(midi.pressure(0, 28), [pressed(28)]);
    assert_eq!(midi.pressure(0, 0), [pressed(0)]);
    midi.note_off(0, 60);
    // Some keyboards say so after the key has come up.
    assert_eq!(midi.pressure(0, 0), NOTHING);
    assert_eq!(midi.note_on(0, 62, 127), [on(62)], "no breath");
    assert_eq!(midi.breath_origin(), None);
    midi.note_off(0, 62);
    midi.pressure(0, 20);
    assert_eq!(midi.pressure(0, 30), [breath(30)], "a wind controller: nobody presses a key");
    midi.note_on(0, 64, 127);
    assert_eq!(midi.pressure(0, 31), [breath(31)]);
    let mut midi = MidiDecoder::new();
    midi.pressure(0, 1);
    assert_eq!(midi.pressure(0, 0), [breath(0)], "who has blown without a key does not blow");
    // Who has chosen pressure means breath.
    let mut midi = MidiDecoder::new();
    midi.set_breath_from(BreathFrom::Only(BreathController::Pressure));
    midi.note_on(0, 60, 127);
    assert_eq!(midi.pressure(0, 100), [breath(100)]);
}

#[test]
fn a_key_without_pressure_plays_by_velocity_beside_one_that_has_had_some() {
    let mut midi = MidiDecoder::new();
    midi.strike(note(1, 60), 127);
    let press = |unit| NoteExpression::Breath(unit);
    assert_eq!(midi.express(key(60), press(0.4)), [Event::Breath(0.4)]);
    assert_eq!(midi.strike(note(2, 64), 127)[0], Event::BreathFromKeys);
}

#[test]
fn breath_before_the_first_key_counts_when_the_key_is_struck_or_when_it_moves() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.controller(0, 11, 90), NOTHING);
    assert_eq!(midi.controller(5, 2, 64), NOTHING);
    assert_eq!(midi.controller(6, 2, 70), NOTHING);
    assert_eq!(midi.note_on(0, 60, 127), [breath(70), on(60)], "the strongest source, its last value");
    assert_eq!(midi.controller(0, 11, 80), NOTHING);

    let mut midi = MidiDecoder::new();
    assert_eq!(midi.controller(0, 2, 0), NOTHING);
    assert_eq!(midi.controller(0, 2, 3), [breath(3)], "a hand");
    assert_eq!(midi.note_on(0, 60, 127), [on(60)]);

    let mut midi = MidiDecoder::new();
    midi.controller(0, 2, 1);
    assert_eq!(midi.controller(0, 2, 0), [breath(0)], "back to rest is a movement");

    // A MIDI file's preparations: volume, pan, expression and reverb, once each.
    let mut midi = MidiDecoder::new();
    for (cc, value) in [(0, 0), (7, 127), (10, 64), (11, 127), (91, 40), (93, 0)] {
        assert_eq!(midi.controller(0, cc, value), NOTHING);
    }
    assert_eq!(midi.note_on(0, 60, 127), [on(60)]);
    assert_eq!(midi.controller(0, 11, 100), [breath(100)]);
}

/// All controllers of a channel, once each, in the order of a stride that has no factor in common with 128.
fn snapshot(midi: &mut MidiDecoder, channel: u8, stride: u32, value: impl Fn(u8) -> u8) -> Vec<Event> {
    (0..128)
        .map(|place: u32| (place * stride % 128) as u8)
        .flat_map(|cc| midi.controller(channel, cc, value(cc)).to_vec())
        .collect()
}

#[test]
fn a_snapshot_of_all_controllers_changes_nothing() {
    let values: [fn(u8) -> u8; 4] = [|_| 0, |_| 64, |_| 127, |cc| cc];
    for value in values {
        for stride in [1, 127, 37] {
            let mut midi = MidiDecoder::new();
            for round in 0..3_u8 {
                let mut events = Vec::new();
                for channel in 0..16 {
                    // The next round says something else.
                    events.extend(snapshot(&mut midi, channel, stride, |cc| value(cc) ^ round));
                    events.extend(midi.pressure(channel, value(1)).to_vec());
                }
                assert!(!events.iter().any(|event| matches!(event, Event::Breath(_))), "{stride} {round}");
            }
            assert_eq!(midi.breath_origin(), None);
            assert_eq!(midi.mix.controllers, MixControllers::default());
            assert_eq!(midi.note_on(0, 60, 127), [on(60)], "{stride}");
            assert_eq!(midi.note_off(0, 60), [off(60)], "no pedal");
            // Data entry selects nothing that the snapshot has left.
            assert_eq!(midi.controller(0, 6, 12), NOTHING);
            assert_eq!(midi.bend(0, 16383), [bend(200.0)]);
        }
    }
}

#[test]
fn a_snapshot_leaves_zones_and_bend_ranges_as_they_were_told() {
    for value in [0, 1, 64, 127] {
        let mut midi = MidiDecoder::new();
        // Nothing deselects the parameter afterwards.
        for (cc, told) in [(101, 0), (100, 6), (6, 7)] {
            midi.controller(0, cc, told);
        }
        for (cc, told) in [(101, 0), (100, 0), (6, 12)] {
            midi.controller(9, cc, told);
        }
        midi.note_on(1, 60, 90);
        midi.note_off(1, 60);
        snapshot(&mut midi, 0, 1, |_| value);
        snapshot(&mut midi, 9, 1, |_| value);
        midi.note_on(1, 60, 90);
        assert_eq!(midi.bend(1, 16383), [bend(4_800.0)], "{value}");
        midi.note_on(9, 62, 90);
        assert_eq!(midi.bend(9, 16383), [bend(1_200.0)], "{value}");
    }
}

#[test]
fn a_managers_wheel_bends_its_zone_alone() {
    let mut midi = MidiDecoder::new();
    for (cc, told) in [(101, 0), (100, 6), (6, 7)] {
        midi.controller(0, cc, told);
    }
    midi.note_on(9, 60, 90);
    assert_eq!(midi.bend(0, 16383), NOTHING);
    midi.note_on(2, 62, 90);
    assert_eq!(midi.bend(0, 0), [bend(-200.0)]);
    // Before the first note it is heard by whoever plays it.
    let mut midi = MidiDecoder::new().with_mpe();
    assert_eq!(midi.bend(0, 16383), [bend(200.0)]);
    assert_eq!(midi.note_on(1, 60, 127), [on(60)]);
}

#[test]
fn a_note_that_is_heard_again_has_its_own_velocity() {
    let mut midi = MidiDecoder::new();
    let note = |id| Note { id: Some(id), channel: 0, key: 60 };
    let struck =
        |velocity: u8| Event::NoteOn { note: SoundingNote(60), velocity: f32::from(velocity) / 127.0 };
    assert_eq!(midi.strike(note(1), 30), [struck(30)]);
    assert_eq!(midi.strike(note(2), 120), [off(60), struck(120)]);
    let address = NoteAddress { id: Some(2), ..NoteAddress::default() };
    assert_eq!(midi.choke(address).last(), Some(&struck(30)));
}

#[test]
fn breath_after_a_snapshot_is_breath() {
    let mut midi = MidiDecoder::new();
    snapshot(&mut midi, 0, 1, |_| 64);
    assert_eq!(midi.controller(0, 2, 5), NOTHING, "perhaps the next snapshot");
    assert_eq!(midi.controller(0, 2, 9), [breath(9)]);

    let mut midi = MidiDecoder::new();
    snapshot(&mut midi, 0, 1, |_| 64);
    midi.controller(0, 2, 80);
    assert_eq!(midi.note_on(0, 60, 127), [breath(80), on(60)], "a host that draws breath");

    let mut midi = MidiDecoder::new();
    snapshot(&mut midi, 0, 1, |_| 64);
    midi.note_on(0, 60, 127);
    assert_eq!(midi.controller(0, 2, 64), NOTHING, "no change");
    assert_eq!(midi.controller(0, 2, 65), [breath(65)]);
}

#[test]
fn bend_reaches_both_ends_and_follows_rpn_0() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.bend(0, 8192), [bend(0.0)]);
    assert_eq!(midi.bend(0, 16383), [bend(200.0)]);
    assert_eq!(midi.bend(0, 0), [bend(-200.0)]);
    assert_eq!(midi.controller(0, 6, 12), NOTHING, "no parameter selected");
    midi.controller(0, 101, 0);
    midi.controller(0, 100, 0);
    assert_eq!(midi.controller(0, 6, 12), [bend(-1200.0)]);
    assert_eq!(midi.controller(0, 38, 50), [bend(-1250.0)]);
    midi.controller(0, 101, 127);
    midi.controller(0, 100, 127);
    midi.controller(0, 6, 1);
    assert_eq!(midi.bend(0, 0), [bend(-1250.0)]);
    assert_eq!(midi.bend(1, 0), [bend(-200.0)], "range is per channel");
    assert_eq!(midi.controller(0, 121, 0), NOTHING, "another channel bends");
    assert_eq!(midi.controller(1, 121, 0), [bend(0.0)]);
}

#[test]
fn the_usual_bend_range_is_that_of_who_was_told_nothing() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.usual_bend_range(2), NOTHING, "as it is from the start");
    midi.bend(0, 0);
    assert_eq!(midi.usual_bend_range(12), [bend(-1_200.0)]);
    for (cc, value) in [(101, 0), (100, 0), (6, 7)] {
        midi.controller(0, cc, value);
    }
    assert_eq!(midi.usual_bend_range(24), NOTHING, "RPN 0 has spoken");
    assert_eq!(midi.bend(0, 0), [bend(-700.0)]);
}

#[test]
fn an_unregistered_parameter_is_not_the_bend_range() {
    let mut midi = MidiDecoder::new();
    for (cc, value) in [(101, 0), (100, 0), (99, 0), (6, 24)] {
        midi.controller(0, cc, value);
    }
    assert_eq!(midi.bend(0, 16383), [bend(200.0)]);
}

#[test]
fn no_input_is_wrong() {
    let mut midi = MidiDecoder::new();
    let check = |events: &[Event]| {
        for event in events {
            match *event {
                Event::Breath(x) => assert!((0.0..=1.0).contains(&x)),
                Event::Bend { cents } => assert!(cents.abs() <= 26_000.0),
                Event::NoteOn { velocity, .. } => assert!(velocity > 0.0 && velocity <= 1.0),
                Event::Volume { gain } => assert!((0.0..=4.0).contains(&gain)),
                Event::Pan { position } => assert!((-1.0..=1.0).contains(&position)),
                _ => {}
            }
        }
    };
    for a in 0..=255u8 {
        for b in 0..=255u8 {
            check(midi.note_on(a, b, b));
            check(midi.strike(Note { id: Some(i32::from(a)), channel: b, key: a }, b));
            check(midi.note_off(a, b));
            check(midi.controller(a, b, a ^ b));
            check(midi.pressure(a, b));
            check(midi.bend(a, u16::from(a) << 8 | u16::from(b)));
            let odd = [f32::NAN, f32::INFINITY, -1e30, f32::from(a) - f32::from(b)][usize::from(a % 4)];
            for expression in [
                NoteExpression::Tuning(if odd.abs() > 1e3 { f32::NAN } else { odd }),
                NoteExpression::Volume(odd),
                NoteExpression::Pan(odd),
                NoteExpression::Breath(odd),
            ] {
                check(midi.express(key(b), expression));
            }
            check(midi.choke(id(i32::from(b))));
        }
    }
    assert_eq!(midi.controller(0, 120, 0)[0], Event::Panic);
    midi.note_on(0, 60, 90);
    assert_eq!(midi.controller(0, 123, 0), [off(60)]);
}

#[test]
fn all_notes_off_ends_keys_and_what_the_pedal_holds_on_any_channel_and_cuts_nothing() {
    let mut midi = MidiDecoder::new();
    midi.controller(0, 64, 127);
    for note in [60, 64] {
        midi.note_on(0, note, 90);
    }
    assert_eq!(midi.controller(9, 123, 0), [off(60), off(64)]);
    midi.note_on(0, 67, 90);
    assert_eq!(midi.note_off(0, 67), NOTHING, "the pedal is down");
    assert_eq!(midi.controller(9, 123, 0), [off(67)]);
}

/// A player does not take keys that its instrument lacks, so that its list of held keys is not full when the decoder's is.
#[test]
fn a_key_that_the_seventeenth_pushes_out_comes_up_for_the_player() {
    let mut midi = MidiDecoder::new();
    for note in 40..56 {
        assert!(!midi.note_on(0, note, 127).iter().any(|event| matches!(event, Event::NoteOff { .. })));
    }
    assert_eq!(midi.note_on(0, 56, 127), [off(40), on(56)]);
    assert_eq!(midi.note_off(0, 40), NOTHING);
}

/// A member's full wheel, and a manager's.
const FULL: [f32; 2] = [4_800.0, 200.0];

#[test]
fn an_announced_zone_bends_by_48_semitones_and_its_manager_by_2() {
    let mut midi = MidiDecoder::new();
    for (cc, value) in [(101, 0), (100, 6), (6, 7)] {
        assert_eq!(midi.controller(0, cc, value), NOTHING);
    }
    midi.note_on(3, 60, 90);
    assert_eq!(midi.bend(3, 16383), [bend(FULL[0])]);
    assert_eq!(midi.bend(0, 0), [bend(FULL[0] - FULL[1])]);
    assert_eq!(midi.bend(4, 0), NOTHING, "another finger's wheel");
    assert_eq!(midi.bend(9, 0), NOTHING, "outside the zone");
    // The manager's reset is its members', too.
    assert_eq!(midi.controller(0, 121, 0)[0], bend(0.0));
    midi.bend(0, 0);
    // The range of one member is that of all.
    for (cc, value) in [(101, 0), (100, 0), (6, 24)] {
        midi.controller(5, cc, value);
    }
    assert_eq!(midi.bend(3, 16383), [bend(FULL[0] / 2.0 - FULL[1])]);
    // No members, no zone.
    for (cc, value) in [(101, 0), (100, 6), (6, 0)] {
        midi.controller(0, cc, value);
    }
    assert_eq!(midi.bend(3, 16383), [bend(200.0)]);
}

#[test]
fn a_zone_and_its_ranges_outlive_a_reset_of_the_host() {
    let mut midi = MidiDecoder::new();
    for (cc, value) in [(101, 0), (100, 6), (6, 15), (101, 127), (100, 127)] {
        midi.controller(0, cc, value);
    }
    midi.note_on(1, 60, 90);
    assert_eq!(midi.bend(1, 16383), [bend(4_800.0)]);
    midi.reset();
    midi.note_on(1, 60, 90);
    assert_eq!(midi.bend(1, 16383), [bend(4_800.0)], "but the wheel itself was at rest");
}

/// A remote control sends CC34 and CC43 as buttons.
#[test]
fn a_fine_part_without_its_coarse_part_is_no_breath() {
    for cc in [34, 43] {
        let mut midi = MidiDecoder::new();
        assert_eq!(midi.controller(0, cc, 100), NOTHING);
        assert_eq!(midi.note_on(0, 60, 127), [on(60)], "velocity blows");
        assert_eq!(midi.controller(0, cc, 127), NOTHING);
        assert_eq!(midi.controller(0, cc, 0), NOTHING);
        // Nor does it make something of a value at rest.
        let mut other = MidiDecoder::new();
        other.controller(0, cc, 100);
        other.controller(0, cc - 32, if cc == 34 { 0 } else { 127 });
        assert_eq!(other.note_on(0, 60, 127), [on(60)]);
        // What moves with its coarse part is breath.
        assert_eq!(midi.controller(0, cc - 32, 64), [Event::Breath(64.0 / 127.0)]);
    }
}

#[test]
fn the_upper_zone_counts_down_and_gives_way() {
    let mut midi = MidiDecoder::new().with_mpe();
    for (cc, value) in [(101, 0), (100, 6), (6, 5)] {
        midi.controller(15, cc, value);
    }
    midi.note_on(10, 60, 90);
    assert_eq!(midi.bend(10, 16383), [bend(FULL[0])]);
    assert_eq!(midi.bend(15, 16383), [bend(FULL[0] + FULL[1])]);
    assert_eq!(midi.bend(0, 16383), NOTHING, "the other zone's manager");
    midi.note_on(9, 62, 90);
    assert_eq!(midi.bend(9, 16383), [bend(FULL[0] + FULL[1])]);
}

#[test]
fn in_mpe_each_finger_blows_its_own_note() {
    let mut midi = MidiDecoder::new().with_mpe();
    midi.note_on(1, 60, 90);
    assert_eq!(midi.pressure(1, 80), [breath(80)]);
    // What a controller sends of a finger before its note is meant for that note.
    assert_eq!(midi.pressure(2, 20), NOTHING);
    assert_eq!(midi.note_on(2, 64, 127), [breath(20), on(64)]);
    assert_eq!(midi.pressure(1, 79), NOTHING, "the finger below presses on, unheard");
    assert_eq!(midi.pressure(2, 0), [breath(0)]);
    assert_eq!(midi.note_off(2, 64), [breath(79), off(64)], "and blows when its note is heard again");
    assert_eq!(midi.pressure(1, 78), [breath(78)]);
    // The manager blows all.
    assert_eq!(midi.pressure(0, 50), [breath(50)]);
    // A finger at rest is about to press: until it does, the breath goes on.
    midi.pressure(3, 0);
    assert_eq!(midi.note_on(3, 67, 127), [on(67)]);
}

#[test]
fn each_note_has_its_own_channels_bend() {
    let mut midi = MidiDecoder::new().with_mpe();
    midi.note_on(1, 60, 90);
    midi.bend(1, 16383);
    assert_eq!(midi.note_on(2, 62, 127), [bend(0.0), on(62)]);
    assert_eq!(midi.bend(1, 8192 + 4096), NOTHING, "the key below slides on, unheard");
    let [Event::Bend { cents }, Event::NoteOff { note }] = *midi.note_off(2, 62) else {
        panic!("back to the lower key")
    };
    assert!((cents - FULL[0] * 4096.0 / 8191.0).abs() < 1e-2 && note == SoundingNote(62));
    assert_eq!(midi.note_off(1, 60), [off(60)], "a fading note keeps its bend");
    assert_eq!(midi.bend(1, 8192), [bend(0.0)], "and follows its wheel");
}

#[test]
fn pressed_keys_are_eased_when_pressure_becomes_something_else() {
    let pressed = || {
        let mut midi = MidiDecoder::new();
        midi.note_on(0, 60, 127);
        assert_eq!(midi.pressure(0, 127), [Event::KeyPressure(1.0)]);
        midi
    };
    const EASED: Event = Event::KeyPressure(0.0);
    assert_eq!(pressed().set_breath_from(BreathFrom::Keys), [Event::BreathFromKeys, EASED]);
    assert_eq!(pressed().controller(0, 121, 0), [bend(0.0), EASED]);
    assert_eq!(pressed().other_pressure(0), [EASED]);
    assert_eq!(pressed().controller(0, 120, 0), [Event::Panic, EASED]);
    assert_eq!(pressed().controller(0, 123, 0), [off(60), EASED]);
    let mut linked = pressed();
    linked.set_links(&one_link(Source::Pressure));
    assert_eq!(linked.pressure(0, 0)[0], EASED);
}

#[test]
fn a_linked_breath_controller_takes_its_fine_part_along() {
    let mut midi = MidiDecoder::new();
    midi.set_links(&one_link(Source::Controller(2)));
    midi.note_on(0, 60, 127);
    assert_ne!(midi.controller(0, 2, 80), NOTHING);
    for fine in [17, 90] {
        assert_eq!(midi.controller(0, 34, fine), NOTHING);
    }
    assert_eq!(midi.controller(0, 11, 80), [breath(80)], "the other one is free");
}

#[test]
fn a_cut_note_leaves_neither_tuning_nor_volume() {
    let mut midi = MidiDecoder::new();
    midi.note_on(0, 60, 127);
    assert_eq!(midi.express(key(60), NoteExpression::Tuning(40.0)), [bend(40.0)]);
    assert_eq!(midi.silence(), [Event::Panic, bend(0.0)]);
}

#[test]
fn without_a_zone_the_wheel_of_a_channel_without_notes_is_for_all() {
    let mut midi = MidiDecoder::new();
    midi.note_on(4, 60, 90);
    assert_eq!(midi.bend(0, 16383), [bend(200.0)]);
    assert_eq!(midi.bend(4, 16383), [bend(400.0)]);
    // It plays now: its wheel is its own.
    assert_eq!(midi.note_on(0, 64, 90)[0], bend(200.0));
    assert_eq!(midi.bend(4, 0), NOTHING);
}

#[test]
fn a_key_two_channels_hold_comes_up_with_the_second() {
    let mut midi = MidiDecoder::new().with_mpe();
    midi.note_on(1, 60, 90);
    midi.bend(2, 16383);
    assert_eq!(midi.note_on(2, 60, 90)[0], bend(FULL[0]));
    assert_eq!(midi.note_off(2, 60), [bend(0.0)]);
    assert_eq!(midi.note_off(1, 60), [off(60)]);
    midi.note_on(3, 60, 90);
    midi.note_on(4, 60, 90);
    assert_eq!(midi.release(key(60)), [off(60)]);
}

#[test]
fn a_panic_lifts_the_pedal_and_the_controller_that_cuts_all_leaves_it() {
    for is_panic in [true, false] {
        let mut midi = MidiDecoder::new();
        midi.controller(0, 64, 127);
        midi.note_on(0, 60, 100);
        assert!(midi.note_off(0, 60).is_empty(), "the pedal holds it");
        if is_panic {
            midi.silence()
        } else {
            midi.controller(0, 120, 0)
        };
        midi.note_on(0, 62, 100);
        let ends = midi.note_off(0, 62).contains(&Event::NoteOff { note: SoundingNote(62) });
        assert_eq!(ends, is_panic);
    }
}

#[test]
fn a_panic_leaves_the_wheels_where_they_are() {
    let mut midi = MidiDecoder::new();
    midi.note_on(0, 60, 90);
    midi.bend(0, 16383);
    assert_eq!(midi.controller(0, 120, 0), [Event::Panic], "and the player keeps what they set");
    assert_eq!(midi.note_off(0, 60), NOTHING);
}

#[test]
fn an_id_names_one_note_and_no_other() {
    let mut midi = MidiDecoder::new();
    midi.strike(note(1, 60), 127);
    midi.strike(note(2, 64), 127);
    assert_eq!(
        midi.release(NoteAddress { id: Some(7), channel: Some(0), key: Some(64) }),
        NOTHING,
        "foreign"
    );
    assert_eq!(midi.release(NoteAddress { id: Some(2), key: Some(60), ..id(2) }), NOTHING, "another key");
    assert_eq!(midi.release(id(2)), [off(64)], "the id is enough");
    assert_eq!(midi.over(), [note(2, 64)]);
    assert_eq!(midi.release(NoteAddress { channel: Some(3), ..NoteAddress::default() }), NOTHING);
    assert_eq!(midi.release(NoteAddress::default()), [off(60)]);
    assert_eq!(midi.over(), [], "it fades");
    assert_eq!(midi.take_faded(), Some(note(1, 60)));
    assert_eq!(midi.take_faded(), None);
}

#[test]
fn two_notes_of_one_key_are_two_notes() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.strike(note(1, 60), 127), [on(60)]);
    assert_eq!(midi.strike(note(2, 60), 127), [off(60), on(60)], "tongued");
    assert_eq!(midi.release(id(1)), NOTHING, "the other goes on");
    assert_eq!(midi.over(), [note(1, 60)]);
    assert_eq!(midi.release(id(2)), [off(60)]);

    // Above others: the key is heard below them afterwards.
    for (id, key) in [(1, 60), (2, 64), (3, 60)] {
        midi.strike(note(id, key), 127);
    }
    assert_eq!(midi.release(id(3)), [on(64)], "slurred to the note before");
    assert_eq!(midi.release(id(2)), [off(64)], "and to the key that was held all the time");
    assert_eq!(midi.release(id(1)), [off(60)]);
}

/// Hosts whose notes have no ids, as those of VST3 may.
#[test]
fn a_key_that_is_struck_again_before_it_comes_up_has_both_notes() {
    let mut midi = MidiDecoder::new();
    midi.note_on(0, 60, 127);
    assert_eq!(midi.note_on(0, 60, 127), [off(60), on(60)], "tongued");
    assert_eq!(midi.note_off(0, 60), NOTHING, "the end of the first");
    assert_eq!(midi.note_off(0, 60), [off(60)]);
    assert_eq!(midi.note_off(0, 60), NOTHING);

    // Below another key.
    midi.note_on(0, 60, 127);
    midi.note_on(0, 64, 127);
    assert_eq!(midi.note_on(0, 60, 127), [on(60)], "slurred to");
    assert_eq!(midi.note_off(0, 60), NOTHING);
    assert_eq!(midi.note_off(0, 64), [off(64)]);
    assert_eq!(midi.note_off(0, 60), [off(60)]);

    // What ends everything, and a host that stops.
    for _ in 0..3 {
        midi.note_on(0, 60, 127);
    }
    assert_eq!(midi.controller(0, 123, 0), [off(60)]);
    for _ in 0..3 {
        midi.note_on(0, 60, 127);
    }
    midi.forget_repeats();
    assert_eq!(midi.note_off(0, 60), [off(60)]);

    // An address of all channels means every note of the key.
    midi.note_on(0, 60, 127);
    midi.note_on(0, 60, 127);
    midi.note_on(3, 60, 127);
    assert_eq!(midi.release(key(60)), [off(60)]);
}

#[test]
fn what_belongs_to_an_unheard_note_waits_for_it() {
    let mut midi = MidiDecoder::new();
    midi.strike(note(1, 60), 127);
    midi.strike(note(2, 64), 127);
    assert_eq!(midi.express(id(2), NoteExpression::Breath(0.6)), [Event::Breath(0.6)]);
    for (expression, event) in [
        (NoteExpression::Tuning(292.0), bend(292.0)),
        (NoteExpression::Breath(0.5), Event::Breath(0.5)),
        (NoteExpression::Volume(0.25), Event::Volume { gain: 0.25 }),
        (NoteExpression::Pan(-0.5), Event::Pan { position: -0.5 }),
    ] {
        assert_eq!(midi.express(id(1), expression), NOTHING, "{event:?}");
    }
    let heard_again = [
        bend(292.0),
        Event::Breath(0.5),
        Event::Volume { gain: 0.25 },
        Event::Pan { position: -0.5 },
        off(64),
    ];
    assert_eq!(midi.release(id(2)), heard_again);
    // A new note has none of it.
    let fresh =
        [bend(0.0), Event::BreathFromKeys, Event::Volume { gain: 1.0 }, Event::Pan { position: 0.0 }, on(65)];
    assert_eq!(midi.strike(note(3, 65), 127), fresh);
}

#[test]
fn a_choke_ends_a_note_whatever_the_pedal_does() {
    let mut midi = MidiDecoder::new();
    midi.strike(note(1, 60), 127);
    midi.strike(note(2, 64), 127);
    midi.controller(0, 64, 127);
    assert_eq!(midi.choke(id(1)), [off(60)], "unheard: it is only removed");
    assert_eq!(midi.choke(id(2)), [choked(64)]);
    assert_eq!(midi.over(), [note(2, 64)]);
    midi.controller(0, 64, 0);

    midi.strike(note(1, 60), 127);
    midi.strike(note(2, 60), 127);
    assert_eq!(midi.choke(id(2)), [choked(60), on(60)], "the other note of the key begins anew");
    midi.release(id(1));
    assert_eq!(midi.choke(id(1)), [choked(60)], "a note that fades is silenced too");
    assert_eq!(midi.over(), [note(1, 60)]);
    assert_eq!(midi.choke(id(1)), NOTHING);

    for (id, key) in [(1, 60), (2, 62), (3, 64)] {
        midi.strike(note(id, key), 127);
    }
    assert_eq!(midi.choke(NoteAddress::default()), [off(60), off(62), choked(64)]);
}

#[test]
fn the_pedal_holds_the_last_note_until_it_comes_up_or_another_is_struck() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.controller(0, 64, 64), NOTHING);
    midi.note_on(0, 60, 127);
    midi.note_on(0, 64, 127);
    assert_eq!(midi.note_off(0, 64), [off(64)], "another key holds the tone");
    assert_eq!(midi.note_off(0, 60), NOTHING);
    assert_eq!(midi.note_on(0, 62, 127), [on(62), off(60)], "slurred");
    assert_eq!(midi.note_off(0, 62), NOTHING);
    assert_eq!(midi.note_on(0, 62, 127), [off(62), on(62)], "the same key is tongued");
    assert_eq!(midi.release(NoteAddress::default()), NOTHING);
    assert_eq!(midi.controller(3, 64, 63), [off(62)], "the pedal of any channel");
    assert_eq!(midi.controller(0, 64, 127), NOTHING);
    midi.note_on(0, 62, 127);
    midi.note_off(0, 62);
    assert_eq!(midi.controller(0, 121, 0), [bend(0.0), off(62)], "reset of all controllers");
}

#[test]
fn notes_beyond_the_most_push_the_oldest_out() {
    let mut midi = MidiDecoder::new();
    for at in 0..40 {
        midi.strike(note(at, 40 + at as u8), 127);
        assert_eq!(midi.over().len(), usize::from(at >= 16), "{at}");
    }
    for at in (24..40).rev() {
        assert_eq!(midi.release(id(at)), [off(40 + at as u8)]);
    }
    assert_eq!(midi.release(NoteAddress::default()), NOTHING);
}

#[test]
fn volume_and_pan_follow_their_formulas() {
    let mut midi = MidiDecoder::new();
    assert_eq!(midi.controller(0, 7, 127), NOTHING, "as it is");
    let [Event::Volume { gain }] = *midi.controller(0, 7, 64) else { panic!() };
    assert!((20.0 * gain.log10() - 40.0 * (64.0_f32 / 127.0).log10()).abs() < 1e-4);
    assert_eq!(midi.controller(1, 7, 0), [Event::Volume { gain: 0.0 }], "any channel");
    assert_eq!(midi.controller(0, 10, 64), NOTHING, "the middle");
    assert_eq!(midi.controller(0, 10, 127), [Event::Pan { position: 1.0 }]);
    assert_eq!(midi.controller(0, 10, 1), [Event::Pan { position: -1.0 }]);
    assert_eq!(midi.controller(0, 10, 0), NOTHING);
    assert_eq!(midi.controller(0, 8, 0), NOTHING, "balance is for stereo");
    midi.strike(note(1, 60), 127);
    assert_eq!(midi.express(id(1), NoteExpression::Pan(1.0)), [Event::Pan { position: 0.0 }], "they add");
}

#[test]
fn only_the_chosen_controller_blows_and_keys_blow_again_when_none_may() {
    use super::breath::BreathFrom;
    let mut midi = MidiDecoder::new();
    let blown = |midi: &mut MidiDecoder, cc: u8, value: u8| {
        midi.controller(0, cc, value).iter().any(|event| matches!(event, Event::Breath(_)))
    };
    midi.note_on(0, 60, 127);
    assert!(blown(&mut midi, 11, 50) && blown(&mut midi, 2, 60));
    let only = BreathFrom::Only(BreathController::Expression);
    assert_eq!(midi.set_breath_from(only), [Event::BreathFromKeys]);
    assert_eq!(midi.set_breath_from(only), NOTHING, "the same again");
    assert!(!blown(&mut midi, 2, 70) && !blown(&mut midi, 2, 80), "the stronger one is not asked");
    assert!(blown(&mut midi, 11, 70));
    assert_eq!(midi.set_breath_from(BreathFrom::Keys), [Event::BreathFromKeys]);
    assert!(!blown(&mut midi, 11, 80) && !blown(&mut midi, 2, 90) && midi.pressure(0, 90).is_empty());
    assert_eq!(midi.breath_origin(), None);
    assert_eq!(midi.set_breath_from(BreathFrom::Any), [Event::BreathFromKeys]);
    assert!(blown(&mut midi, 2, 91));
}

#[test]
fn pressure_of_single_keys_blows_only_where_any_controller_or_pressure_may() {
    for (from, blows) in [
        (BreathFrom::Any, true),
        (BreathFrom::Only(BreathController::Pressure), true),
        (BreathFrom::Only(BreathController::Breath), false),
        (BreathFrom::Keys, false),
    ] {
        let mut midi = MidiDecoder::new();
        midi.set_breath_from(from);
        midi.note_on(0, 60, 100);
        let pressed = midi.express(NoteAddress::of_key(0, 60), NoteExpression::Breath(0.02));
        assert_eq!(pressed.contains(&Event::Breath(0.02)), blows, "{from:?}");
    }
}
