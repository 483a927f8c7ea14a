//! When the bundled CLAP sleeps, how long it says that it sounds on, and what wakes it.

#[path = "support/rules.rs"]
mod rules;

use chalumeau_test_host::clap::{At, ProcessStatus, Say, Session, TailLength};
use rules::plugin;

const RATE: f64 = 48_000.0;
const SECOND: usize = 48_000;
const BLOCK: usize = 512;

/// Plays until the plugin sleeps, at most `seconds`; gives the time, s.
fn until_asleep(session: &mut Session, seconds: f64) -> f64 {
    let mut played = 0;
    while (played as f64) < seconds * RATE {
        session.play(&[], BLOCK).unwrap();
        played += BLOCK;
        if session.status() == ProcessStatus::Sleep {
            return played as f64 / RATE;
        }
    }
    panic!("awake after {seconds} s: {:?}", session.status());
}

fn peak(sound: &[Vec<f32>; 2]) -> f32 {
    sound.iter().flatten().fold(0.0, |peak, x| peak.max(x.abs()))
}

#[test]
fn silence_is_sleep_and_the_tail_is_finite_once_notes_are_over() {
    let mut plugin = plugin();
    plugin
        .session(RATE, BLOCK, |session| {
            let TailLength::Finite(tail) = session.tail() else { panic!("infinite before the first note") };
            assert!(tail > 0);
            until_asleep(session, 0.2);
            for key in [50, 62, 74, 86] {
                session.play(&[At(100, Say::NoteOn(key, 0.8))], SECOND / 2).unwrap();
                assert_eq!(
                    (session.status(), session.tail()),
                    (ProcessStatus::Continue, TailLength::Infinite)
                );
                // The breath ends within a fifth of a second, then the tail is known.
                session.play(&[At(0, Say::NoteOff(key))], SECOND / 5).unwrap();
                assert_eq!(session.tail(), TailLength::Finite(tail), "key {key}");
                let took = until_asleep(session, f64::from(tail) / RATE);
                println!("key {key}: asleep after {took:.2} s of a tail of {:.2} s", f64::from(tail) / RATE);
                let left = peak(&session.play(&[], SECOND).unwrap());
                assert!(left < 1e-6, "key {key}: {left} while asleep");
            }
        })
        .unwrap();
    let heard = plugin.heard();
    assert_eq!(heard.tails, 8, "told at the beginning and at the end of each note");
}

#[test]
fn breath_that_blows_keeps_awake_and_breath_that_ends_does_not() {
    plugin()
        .session(RATE, BLOCK, |session| {
            let blow = |value| At(0, Say::Midi([0xB0, 2, value]));
            session.play(&[blow(90), At(0, Say::NoteOn(60, 0.8))], SECOND / 2).unwrap();
            assert_eq!(session.status(), ProcessStatus::Continue);
            session.play(&[blow(0)], BLOCK).unwrap();
            // The key is still down.
            until_asleep(session, 2.0);
            session.play(&[blow(90)], SECOND / 4).unwrap();
            assert_eq!(session.status(), ProcessStatus::Continue, "awake with the next breath");
        })
        .unwrap();
}

#[test]
fn slurs_that_a_controller_or_panic_ends_are_asleep_soon() {
    let mut plugin = plugin();
    let panic = plugin.param("Panic").unwrap().id;
    plugin
        .session(RATE, BLOCK, |session| {
            for end in [Say::Midi([0xB0, 120, 0]), Say::Midi([0xB0, 123, 0]), Say::Set(panic, 1.0)] {
                let slur = [At(0, Say::NoteOn(55, 0.8)), At(9_600, Say::NoteOn(63, 0.8)), At(9_700, end)];
                session.play(&slur, SECOND / 4).unwrap();
                let took = until_asleep(session, 2.0);
                println!("{end:?}: asleep after {took:.2} s");
            }
        })
        .unwrap();
}

#[test]
fn what_is_moved_without_processing_wakes_the_host() {
    let mut plugin = plugin();
    let breath = plugin.param("Breath").unwrap().id;
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    session.play(&[At(0, Say::NoteOn(60, 0.8)), At(10, Say::Set(breath, 0.001))], BLOCK).unwrap();
    session.play(&[At(0, Say::Set(breath, 0.0))], BLOCK).unwrap();
    until_asleep(&mut session, 2.0);
    let _ = plugin.heard();
    session.flush(&[(breath, 0.6)]).unwrap();
    assert_eq!(plugin.heard().processes, 1);
    let sound = session.play(&[], SECOND / 2).unwrap();
    assert!(peak(&sound) > 1e-3, "the moved breath blows");
    plugin.deactivate(session);
    let _ = plugin.heard();
    plugin.set(breath, 0.0).unwrap();
    assert_eq!(plugin.heard().processes, 0, "an inactive plugin asks for nothing");
}

#[test]
fn a_knob_keeps_awake_because_it_blows_without_events() {
    let mut plugin = plugin();
    let knob = plugin.param("Knob").unwrap();
    let osc = plugin.read_text(knob.id, "OSC (stock firmware)").unwrap().unwrap();
    let port = plugin.param("OSC port").unwrap();
    // A port of its own, on which nothing is heard.
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let free = plugin.read_text(port.id, &free.to_string()).unwrap().unwrap();
    plugin.set_all(&[(port.id, free), (knob.id, osc)]).unwrap();
    plugin
        .session(RATE, BLOCK, |session| {
            session.play(&[], SECOND).unwrap();
            assert_eq!(session.status(), ProcessStatus::Continue);
            session.play(&[At(0, Say::Set(knob.id, 0.0))], BLOCK).unwrap();
            until_asleep(session, 0.5);
        })
        .unwrap();
}
