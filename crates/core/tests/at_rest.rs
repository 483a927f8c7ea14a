//! What happens while nothing sounds is not heard.

use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Clarinet, Settings};
use chalumeau_core::units::SoundingNote;

const RATE_HZ: f64 = 48_000.0;
/// Below this nothing is heard: -120 dBFS.
const SILENT: f32 = 1e-6;

/// The greatest magnitude of the next so many samples.
fn peak(clarinet: &mut Clarinet, samples: usize) -> f32 {
    let mut out = vec![0.0; samples];
    clarinet.render(&mut out);
    out.iter().fold(0.0, |most, x| x.abs().max(most))
}

fn other_reeds() -> [Settings; 4] {
    let usual = Settings::default();
    [
        Settings { strength: usual.strength + 1.0, ..usual },
        Settings { strength: usual.strength - 1.0, ..usual },
        Settings { lip: 1.2 * usual.lip, ..usual },
        Settings { reed_h: 1.3 * usual.reed_h, ..usual },
    ]
}

#[test]
fn a_reed_that_changes_at_rest_makes_no_sound() {
    for settings in other_reeds() {
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        assert!(peak(&mut clarinet, 4_800) < SILENT, "nobody plays");
        clarinet.set_settings(&settings);
        assert!(peak(&mut clarinet, 24_000) < SILENT, "{settings:?}");
        clarinet.apply(Event::NoteOn { note: SoundingNote(58), velocity: 0.7 });
        assert!(peak(&mut clarinet, 24_000) > 0.01, "the note is heard");
        clarinet.apply(Event::Panic);
        // What the output filter still holds.
        peak(&mut clarinet, 480);
        assert!(peak(&mut clarinet, 24_000) < SILENT, "a silence: {settings:?}");
        clarinet.reset();
        assert!(peak(&mut clarinet, 24_000) < SILENT, "a new beginning: {settings:?}");
        // A new instrument of these settings.
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        clarinet.set_settings(&settings);
        assert!(peak(&mut clarinet, 24_000) < SILENT, "from the start: {settings:?}");
    }
}

#[test]
fn a_silence_keeps_the_breath_that_a_source_has_set() {
    let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
    clarinet.apply(Event::Breath(0.0));
    clarinet.apply(Event::Panic);
    clarinet.apply(Event::NoteOn { note: SoundingNote(58), velocity: 1.0 });
    // After the thump of keys and tongue.
    peak(&mut clarinet, 6_000);
    assert!(peak(&mut clarinet, 18_000) < 3e-5, "nobody blows");
    clarinet.apply(Event::BreathFromKeys);
    assert!(peak(&mut clarinet, 24_000) > 0.05, "and now the key does");
}

#[test]
fn pressure_on_the_keys_makes_a_note_louder_and_leaves_the_next_one() {
    let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
    let mut held = |events: &[Event]| {
        events.iter().for_each(|&event| clarinet.apply(event));
        peak(&mut clarinet, 24_000);
        peak(&mut clarinet, 9_600)
    };
    let key = SoundingNote(58);
    let usual = held(&[Event::NoteOn { note: key, velocity: 0.4 }]);
    assert!(held(&[Event::KeyPressure(1.0)]) > 1.5 * usual);
    let again = held(&[Event::KeyPressure(0.0)]);
    assert!((again / usual - 1.0).abs() < 0.3, "{again} {usual}");
    let next = held(&[Event::NoteOff { note: key }, Event::NoteOn { note: key, velocity: 0.4 }]);
    assert!((next / usual - 1.0).abs() < 0.3, "{next} {usual}");
}
