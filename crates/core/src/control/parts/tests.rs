use super::*;
use crate::control::key_switches::ROW;
use crate::control::midi::links::Target;
use crate::dsp::white::White;
use crate::event::SettingNumber;
use crate::units::SoundingNote;

fn said(events: &[PartEvent]) -> Vec<(u8, Event)> {
    let of = |event: &PartEvent| match event.to {
        To::Player(part) => (part, event.event),
        To::All => panic!("{event:?}"),
    };
    events.iter().map(of).collect()
}

fn on(part: u8, key: u8) -> (u8, Event) {
    (part, Event::NoteOn { note: SoundingNote(key), velocity: 100.0 / 127.0 })
}

fn off(part: u8, key: u8) -> (u8, Event) {
    (part, Event::NoteOff { note: SoundingNote(key) })
}

/// Strikes keys on channel 0 and gives what is said of notes.
fn chord(parts: &mut Parts, keys: &[u8]) -> Vec<(u8, Event)> {
    keys.iter().flat_map(|&key| said(parts.note_on(0, key, 100))).collect()
}

fn lift(parts: &mut Parts, keys: &[u8]) -> Vec<(u8, Event)> {
    keys.iter().flat_map(|&key| said(parts.note_off(0, key))).collect()
}

/// Numbers below `most`, at random.
struct Dice(White);

impl Dice {
    fn roll(&mut self, most: u32) -> u8 {
        let unit = (self.0.next() / 3.0_f64.sqrt() * 0.5 + 0.5).clamp(0.0, 0.999_999);
        (unit * f64::from(most)) as u8
    }
}

#[test]
fn one_part_says_what_a_decoder_says() {
    let (mut parts, mut midi) = (Parts::new(1), MidiDecoder::new());
    let mut dice = Dice(White::new(4));
    for _ in 0..10_000 {
        let (what, channel, key, value) = (dice.roll(8), dice.roll(3), dice.roll(128), dice.roll(128));
        let address = NoteAddress::of_key(channel, key % 8 + 60);
        let (said, wanted) = match what {
            0 | 1 => {
                (parts.note_on(channel, key % 8 + 60, value), midi.note_on(channel, key % 8 + 60, value))
            }
            2 | 3 => (parts.release(address), midi.release(address)),
            4 => (parts.controller(channel, key, value), midi.controller(channel, key, value)),
            5 => (parts.pressure(channel, value), midi.pressure(channel, value)),
            6 => (parts.bend(channel, u16::from(value) << 7), midi.bend(channel, u16::from(value) << 7)),
            _ => (parts.choke(address), midi.choke(address)),
        };
        assert!(said.iter().map(|event| event.event).eq(wanted.iter().copied()));
        assert!(said.iter().all(|event| event.to == To::Player(0)));
        assert_eq!((parts.over(), parts.heard()), (midi.over(), midi.heard()));
        assert_eq!(parts.breath_origin(), midi.breath_origin());
    }
}

#[test]
fn overlapping_notes_are_a_chord_and_a_line_stays_with_one() {
    let mut parts = Parts::new(3);
    assert_eq!(chord(&mut parts, &[60]), [on(0, 60)]);
    assert_eq!(lift(&mut parts, &[60]), [off(0, 60)]);
    assert_eq!(chord(&mut parts, &[72]), [on(0, 72)], "who has played nothing comes last");
    assert_eq!(chord(&mut parts, &[60, 64]), [on(1, 60), on(2, 64)]);
    assert_eq!(lift(&mut parts, &[60, 72, 64]), [off(1, 60), off(0, 72), off(2, 64)]);
    // Each goes on where it is nearest, in whatever order.
    assert_eq!(chord(&mut parts, &[71, 62, 65]), [on(0, 71), on(1, 62), on(2, 65)]);
}

#[test]
fn where_all_are_busy_the_nearest_slurs_and_comes_back() {
    let mut parts = Parts::new(2);
    chord(&mut parts, &[60, 70]);
    assert_eq!(chord(&mut parts, &[67]), [on(1, 67)], "its own key is still down: a slur");
    assert_eq!(lift(&mut parts, &[67]), [off(1, 67)]);
    assert_eq!(lift(&mut parts, &[70, 60]), [off(1, 70), off(0, 60)]);
    // The same key again goes to who holds it.
    chord(&mut parts, &[60, 61]);
    assert_eq!(chord(&mut parts, &[61]), [off(1, 61), on(1, 61)]);
}

#[test]
fn a_note_that_the_pedal_holds_gives_way_before_a_held_one() {
    let mut parts = Parts::new(2);
    parts.controller(0, 64, 127);
    chord(&mut parts, &[60, 72]);
    assert_eq!(lift(&mut parts, &[72]), []);
    assert_eq!(chord(&mut parts, &[61]), [on(1, 61), off(1, 72)]);
    lift(&mut parts, &[60, 61]);
    assert_eq!(said(parts.controller(0, 64, 0)), [off(0, 60), off(1, 61)]);
}

#[test]
fn a_key_that_the_pedal_holds_is_struck_again_by_the_same_player_with_ids_and_without() {
    for ids in [[None; 3], [Some(1), Some(2), Some(3)]] {
        let mut parts = Parts::new(3);
        parts.controller(0, 64, 127);
        for id in ids {
            let note = Note { id, channel: 0, key: 60 };
            let told = said(parts.strike(note, 100));
            assert!(told.iter().all(|(part, _)| *part == 0), "{told:?}");
            assert_eq!(told.last(), Some(&on(0, 60)));
            parts.release(NoteAddress { id, channel: Some(0), key: Some(60) });
        }
        assert_eq!(said(parts.controller(0, 64, 0)), [off(0, 60)]);
    }
}

#[test]
fn bends_pressure_and_breath_of_a_member_channel_are_for_its_note() {
    let mut parts = Parts::of(MidiDecoder::new().with_mpe(), 3);
    parts.pressure(1, 40);
    let first = said(parts.note_on(1, 60, 100));
    assert_eq!(first, [(0, Event::Breath(40.0 / 127.0)), on(0, 60)], "what came before the note is its");
    assert_eq!(said(parts.note_on(2, 64, 100)), [on(1, 64)], "and no other's");
    assert_eq!(said(parts.pressure(2, 80)), [(1, Event::Breath(80.0 / 127.0))]);
    assert_eq!(said(parts.pressure(1, 50)), [(0, Event::Breath(50.0 / 127.0))]);
    assert_eq!(said(parts.bend(2, 16_383)), [(1, Event::Bend { cents: 4_800.0 })]);
    assert_eq!(said(parts.bend(3, 16_383)), [], "nobody plays there");
    let bent = [(0, 200.0), (1, 5_000.0), (2, 200.0)].map(|(part, cents)| (part, Event::Bend { cents }));
    assert_eq!(said(parts.bend(0, 16_383)), bent, "the manager's bends all notes");
    // The manager's breath is everybody's.
    let all = said(parts.controller(0, 2, 90));
    assert!(all.starts_with(&[(0, Event::Breath(90.0 / 127.0)), (1, Event::Breath(90.0 / 127.0))]));
}

/// Controller 74 opens the lip, controller 21 the room.
fn linked() -> [Option<Link>; MOST_LINKS] {
    let link = |cc, number| {
        let (source, target) = (Source::Controller(cc), Target::Number(number));
        Link { source, target, low: 0.0, high: 1.0, curve: 1.0, own: 0.5 }
    };
    let mut links = [None; MOST_LINKS];
    links[0] = Some(link(74, SettingNumber::Lip));
    links[1] = Some(link(21, SettingNumber::RoomAmount));
    links
}

#[test]
fn a_linked_controller_of_a_member_channel_is_for_its_note_unless_all_share_what_it_sets() {
    let mut parts = Parts::of(MidiDecoder::new().with_mpe(), 2);
    parts.set_links(&linked());
    assert_eq!(said(parts.controller(1, 74, 127)), [], "nobody plays there yet");
    let lip = |part, value| (part, Event::Set(SettingNumber::Lip, value));
    assert_eq!(said(parts.note_on(1, 60, 100)), [lip(0, 1.0), on(0, 60)], "what came before the note is its");
    assert_eq!(said(parts.note_on(2, 64, 100)), [on(1, 64)]);
    assert_eq!(said(parts.controller(2, 74, 0)), [lip(1, 0.0)]);
    assert_eq!(
        said(parts.controller(0, 74, 127)),
        [lip(0, 1.0), lip(1, 1.0)],
        "the manager's is everybody's"
    );
    let room = |part| (part, Event::Set(SettingNumber::RoomAmount, 1.0));
    assert_eq!(said(parts.controller(1, 21, 127)), [room(0), room(1)]);
    // Who takes the setting in hand takes it from the next note too.
    let mut by_hand = linked();
    by_hand[0].as_mut().unwrap().own = 0.2;
    assert!(parts.set_links(&by_hand));
    parts.note_off(1, 60);
    assert_eq!(said(parts.note_on(1, 60, 100)), [on(0, 60)]);
}

#[test]
fn without_mpe_breath_and_bend_are_everybodys() {
    let mut parts = Parts::new(2);
    assert_eq!(said(parts.controller(0, 2, 64)), [], "it waits for a key");
    let struck = chord(&mut parts, &[60]);
    assert_eq!(struck.len(), 3);
    assert!(struck.contains(&(1, Event::Breath(64.0 / 127.0))) && struck.contains(&on(0, 60)));
    chord(&mut parts, &[64]);
    let breath = Event::Breath(70.0 / 127.0);
    assert_eq!(said(parts.controller(0, 2, 70)), [(0, breath), (1, breath)]);
    let bent = Event::Bend { cents: -200.0 };
    assert_eq!(said(parts.bend(0, 0)), [(0, bent), (1, bent)]);
    assert_eq!(parts.breath_origin(), parts.decoders[1].breath_origin());
}

#[test]
fn a_note_on_its_own_channel_bends_alone() {
    let mut parts = Parts::new(2);
    parts.note_on(4, 60, 100);
    parts.note_on(5, 64, 100);
    assert_eq!(said(parts.bend(5, 16_383)), [(1, Event::Bend { cents: 200.0 })]);
    assert_eq!(said(parts.bend(4, 0)), [(0, Event::Bend { cents: -200.0 })]);
}

#[test]
fn expressions_chokes_and_ends_find_their_note() {
    let mut parts = Parts::new(2);
    let id = |id| NoteAddress { id: Some(id), ..NoteAddress::default() };
    for (number, key) in [(7, 60), (8, 64)] {
        parts.strike(Note { id: Some(number), channel: 0, key }, 100);
    }
    assert_eq!(said(parts.express(id(8), NoteExpression::Tuning(30.0))), [(1, Event::Bend { cents: 30.0 })]);
    assert_eq!(said(parts.express(id(7), NoteExpression::Breath(0.5))), [(0, Event::Breath(0.5))]);
    assert_eq!(said(parts.choke(id(7))), [(0, Event::Choke { note: SoundingNote(60) })]);
    assert_eq!(parts.over(), [Note { id: Some(7), channel: 0, key: 60 }]);
    assert_eq!(said(parts.release(id(8))), [off(1, 64)]);
    assert_eq!(parts.over(), []);
    assert_eq!(parts.take_faded(0), None);
    assert_eq!(parts.take_faded(1), Some(Note { id: Some(8), channel: 0, key: 64 }));
}

#[test]
fn all_notes_off_and_all_sound_off_are_for_all() {
    const KEYS: [u8; 4] = [60, 64, 67, 70];
    let playing = || {
        let mut parts = Parts::new(4);
        chord(&mut parts, &KEYS);
        parts
    };
    let mut parts = playing();
    assert_eq!(said(parts.controller(9, 120, 0)), [0, 1, 2, 3].map(|part| (part, Event::Panic)));
    assert_eq!(parts.over().len(), 4);
    let mut parts = playing();
    assert_eq!(said(parts.controller(9, 123, 0)), [0, 1, 2, 3].map(|part| off(part, KEYS[part as usize])));
    assert_eq!(parts.over(), [], "they fade");
}

#[test]
fn parts_that_come_know_the_controllers_and_parts_that_go_end_their_notes() {
    let mut parts = Parts::new(1);
    parts.controller(0, 2, 50);
    parts.controller(0, 2, 60);
    chord(&mut parts, &[60]);
    parts.set_count(3);
    let breath = Event::Breath(70.0 / 127.0);
    assert_eq!(said(parts.controller(0, 2, 70)), [0, 1, 2].map(|part| (part, breath)));
    assert_eq!(chord(&mut parts, &[64, 67]), [on(1, 64), on(2, 67)]);
    parts.set_count(2);
    assert_eq!(parts.over(), [Note { id: None, channel: 0, key: 67 }]);
    assert_eq!(lift(&mut parts, &[67, 64, 60]), [off(1, 64), off(0, 60)]);
}

/// Whatever happens, each note that was struck ends once, and nothing allocates more room than there was.
#[test]
fn every_note_ends_once() {
    let mut dice = Dice(White::new(9));
    let mut parts = Parts::new(5);
    let room = (parts.said.capacity(), parts.over.capacity());
    let (mut struck, mut over) = (Vec::new(), Vec::new());
    for number in 0..10_000 {
        let (channel, key, value) = (dice.roll(16), 48 + dice.roll(30), dice.roll(128));
        let one = NoteAddress { id: Some(number - i32::from(dice.roll(12))), ..NoteAddress::default() };
        match dice.roll(16) {
            0..=5 => {
                let note = Note { id: Some(number), channel, key };
                struck.push(note);
                parts.strike(note, value);
            }
            6..=9 => drop(parts.release(one).len()),
            10 => drop(parts.choke(one).len()),
            11 => drop(parts.release(NoteAddress::of_key(channel, key)).len()),
            12 => drop(parts.controller(channel, dice.roll(128), value).len()),
            13 => drop(parts.pressure(channel, value).len()),
            14 => drop(parts.express(one, NoteExpression::Breath(f32::from(value) / 127.0)).len()),
            _ => parts.set_count(usize::from(dice.roll(17))),
        }
        over.extend_from_slice(parts.over());
        if dice.roll(4) == 0 {
            over.extend((0..MOST).filter_map(|part| parts.take_faded(part)));
        }
    }
    parts.silence();
    over.extend_from_slice(parts.over());
    over.extend((0..MOST).filter_map(|part| parts.take_faded(part)));
    let id = |note: &Note| note.id;
    struck.sort_by_key(id);
    over.sort_by_key(id);
    assert_eq!(over.iter().zip(&struck).find(|(over, struck)| over != struck), None);
    assert_eq!(over.len(), struck.len());
    assert_eq!(room, (parts.said.capacity(), parts.over.capacity()));
}

#[test]
fn key_switches_choose_and_are_no_notes() {
    for count in [1, 3] {
        let mut parts = Parts::new(count);
        parts.set_key_switches(KeySwitches::C1);
        chord(&mut parts, &[60]);
        let before = (parts.heard().copied(), parts.decoders[0].held().len());
        for (key, chosen) in (24..).zip(ROW) {
            assert_eq!(parts.note_on(0, key, 127), [Event::Fingerings(chosen).into()], "for all, once");
            assert_eq!(parts.over(), [Note { id: None, channel: 0, key }], "a host waits for its end");
            assert_eq!((parts.heard().copied(), parts.decoders[0].held().len()), before, "the note goes on");
            let pressed = NoteExpression::Breath(0.9);
            assert_eq!(parts.express(NoteAddress::of_key(0, key), pressed), []);
            assert_eq!(parts.note_off(0, key), []);
        }
        let next = |part: u8| part.min(count as u8 - 1);
        assert_eq!(chord(&mut parts, &[64])[0], on(next(1), 64), "the row took no part");
        assert_eq!(chord(&mut parts, &[23])[0].1, on(0, 23).1, "below the row");
        assert_eq!(chord(&mut parts, &[29])[0].1, on(0, 29).1, "above it");
        parts.reset();
        assert_eq!(parts.note_on(0, 24, 127).len(), 1);
        assert!(parts.heard().is_none(), "the row stays");
        parts.set_key_switches(KeySwitches::Off);
        assert!(matches!(parts.note_on(0, 24, 127).last().unwrap().event, Event::NoteOn { .. }));
    }
}

#[test]
fn the_finger_on_a_key_switch_does_not_blow() {
    for count in [1, 2] {
        let mut parts = Parts::of(MidiDecoder::new().with_mpe(), count);
        parts.set_key_switches(KeySwitches::C2);
        let breath = |value: f32| vec![(0, Event::Breath(value / 127.0))];
        parts.note_on(1, 60, 127);
        assert_eq!(said(parts.pressure(1, 90)), breath(90.0));
        parts.note_on(2, 37, 127);
        assert_eq!(parts.pressure(2, 20), []);
        assert_eq!(parts.controller(2, 11, 20), []);
        assert_eq!(said(parts.pressure(1, 91)), breath(91.0), "the note's finger does");
        parts.note_off(2, 37);
        parts.note_on(2, 62, 127);
        assert!(!parts.pressure(2, 50).is_empty());
    }
}

#[test]
fn what_ends_all_notes_lifts_key_switches_too() {
    for cc in [120, 123] {
        let mut parts = Parts::of(MidiDecoder::new().with_mpe(), 2);
        parts.set_key_switches(KeySwitches::C2);
        parts.note_on(1, 60, 127);
        parts.note_on(2, 37, 127);
        assert_eq!(parts.pressure(2, 20), []);
        parts.controller(0, cc, 0);
        assert!(!parts.switches.is_down_on(2));
    }
}

#[test]
fn a_key_that_is_down_is_no_switch_any_more_where_the_row_has_moved() {
    let mut parts = Parts::of(MidiDecoder::new().with_mpe(), 1);
    parts.set_key_switches(KeySwitches::C2);
    parts.note_on(1, 60, 127);
    parts.note_on(2, 37, 127);
    parts.set_key_switches(KeySwitches::C2);
    assert_eq!(parts.pressure(2, 20), [], "the row is where it was");
    parts.set_key_switches(KeySwitches::C1);
    parts.note_off(2, 37);
    parts.note_on(2, 62, 127);
    let before = parts.decoders[0].clone();
    let said = said(parts.pressure(2, 20));
    let mut decoder = before;
    assert!(said.iter().map(|(_, event)| *event).eq(decoder.pressure(2, 20).iter().copied()));
    assert!(!said.is_empty());
}

#[test]
fn a_key_that_plays_nothing_takes_no_player_and_ends_nothing() {
    let mut parts = Parts::new(2);
    parts.set_playing_keys(!(1 << 40));
    assert_eq!(chord(&mut parts, &[40, 60, 64]), [on(0, 60), on(1, 64)]);
    assert_eq!(lift(&mut parts, &[40, 60, 64]), [off(0, 60), off(1, 64)]);
    assert!(parts.note_on(0, 40, 100).is_empty());
    assert_eq!(parts.over(), [Note { id: None, channel: 0, key: 40 }], "a host waits for its end");
    // The pedal goes on holding, and a note goes on blowing.
    let mut parts = Parts::new(1);
    parts.set_playing_keys(!(1 << 40));
    parts.controller(0, 64, 127);
    parts.note_on(0, 60, 100);
    parts.note_off(0, 60);
    assert!(chord(&mut parts, &[40]).is_empty());
    assert_eq!(said(parts.controller(0, 64, 0)), [off(0, 60)]);
    parts.note_on(0, 62, 100);
    parts.express(NoteAddress::of_key(0, 62), NoteExpression::Breath(0.5));
    assert!(chord(&mut parts, &[40]).is_empty());
}

#[test]
fn at_the_end_of_a_piece_pedal_and_keys_come_up() {
    let mut parts = Parts::new(2);
    parts.controller(0, 64, 127);
    chord(&mut parts, &[60, 64]);
    lift(&mut parts, &[60]);
    assert_eq!(said(parts.let_go()), [off(0, 60), off(1, 64)]);
    assert!(parts.let_go().is_empty());
}

#[test]
fn another_choice_of_what_may_blow_forgets_what_has_blown() {
    let mut parts = Parts::new(2);
    parts.set_breath_from(BreathFrom::Any);
    chord(&mut parts, &[60]);
    parts.controller(0, 2, 64);
    parts.controller(0, 2, 65);
    assert!(parts.breath_origin().is_some());
    parts.set_breath_from(BreathFrom::Keys);
    assert_eq!(parts.breath_origin(), None);
}
