//! Controllers that are linked to settings.

use super::*;
use crate::control::midi::links::{Link, MOST, Source, Target};
use crate::event::SettingNumber;

const GROWL: SettingNumber = SettingNumber::Growl;

fn decoder(source: Source, target: Target) -> MidiDecoder {
    let mut midi = MidiDecoder::new();
    let mut links = [None; MOST];
    links[0] = Some(Link { source, target, low: 0.0, high: 1.0, curve: 1.0, own: 0.2 });
    assert!(midi.set_links(&links) && !midi.set_links(&links));
    midi
}

#[test]
fn a_linked_controller_does_what_it_is_linked_to_and_nothing_else() {
    let mut midi = decoder(Source::Controller(11), Target::Number(GROWL));
    assert_eq!(midi.controller(3, 11, 127), [Event::Set(GROWL, 1.0)]);
    let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 1.0 };
    assert_eq!(midi.note_on(3, 60, 127), [note_on], "it does not blow");
    let mut midi = decoder(Source::Pressure, Target::Number(GROWL));
    assert_eq!(midi.pressure(0, 0), [Event::Set(GROWL, 0.0)]);
}

#[test]
fn any_controller_can_blow() {
    let mut midi = decoder(Source::Controller(74), Target::Breath);
    assert_eq!(midi.controller(0, 74, 64), NOTHING, "once may be anything");
    let blown = Event::Breath(64.0 / 127.0);
    assert_eq!(midi.note_on(0, 60, 127), [blown, on(60)], "a key shows that it is meant");
    assert_eq!(midi.controller(0, 74, 127), [Event::Breath(1.0)]);
    assert_eq!(midi.breath_origin(), Some(BreathOrigin::Link));
}

#[test]
fn a_snapshot_does_not_take_the_breath_from_the_keys() {
    let mut midi = decoder(Source::Controller(3), Target::Breath);
    for cc in 0..128 {
        let said = midi.controller(0, cc, 0);
        assert!(!said.iter().any(|event| matches!(event, Event::Breath(_))), "CC{cc}");
    }
    assert_eq!(midi.note_on(0, 60, 127), [on(60)], "velocity blows");
}

#[test]
fn a_snapshot_of_all_controllers_moves_no_linked_one() {
    let mut midi = decoder(Source::Controller(21), Target::Number(GROWL));
    let mut now = 0.2;
    for _ in 0..3 {
        for cc in 0..128 {
            for event in midi.controller(0, cc, 127) {
                if let Event::Set(_, value) = event {
                    now = *value;
                }
            }
        }
        assert_eq!(now, 0.2);
    }
    // A hand moves it: the second message tells it from another snapshot.
    midi.controller(0, 21, 100);
    assert_eq!(midi.controller(0, 21, 127), [Event::Set(GROWL, 1.0)]);
}
#[test]
fn a_single_zero_of_a_linked_breath_does_not_silence_the_keys() {
    let mut midi = decoder(Source::Controller(1), Target::Breath);
    midi.controller(0, 1, 0);
    assert_eq!(midi.note_on(0, 60, 127), [on(60)]);
    midi.note_off(0, 60);
    midi.controller(0, 1, 64);
    assert_eq!(midi.note_on(0, 60, 127)[1..], [on(60)], "a value above it is meant");
}
