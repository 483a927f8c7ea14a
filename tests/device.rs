//! The link to a knob as the plugin uses it, with the real firmware at the other end of a pseudo-terminal.
#![cfg(unix)]

#[path = "support/knob.rs"]
mod knob;

use chalumeau::device::{Choice, Hooks, KnobLink, Phase, Places, StateSample};
use chalumeau::wire::{Feel, Law, Message};
use chalumeau_firmware::Setup;
use knob::{PtyKnob, recorder, soon};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;
use tempfile::TempDir;

fn places() -> (TempDir, Places) {
    let directory = tempfile::tempdir().unwrap();
    let places = Places::within(directory.path());
    (directory, places)
}

/// A link to `choice` with nothing to feel.
fn linked(places: &Places, label: &str, choice: Choice) -> KnobLink {
    let (link, _reader) = KnobLink::spawn_in(places.clone(), label, Hooks::default());
    link.choose(choice);
    link
}

fn any_serial() -> Choice {
    Choice::Serial { serial: None }
}

#[track_caller]
fn live(link: &KnobLink) -> Duration {
    soon("live", || link.status().phase == Phase::Live)
}

fn said(knob: &PtyKnob, what: impl Fn(&Message) -> bool) -> usize {
    knob.heard().iter().filter(|(_, message)| what(message)).count()
}

#[test]
fn a_simulated_knob_is_found_played_armed_and_left_in_peace() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let feel = Arc::new(Mutex::new(Feel { law: Law::Flow, scale_mnm: 50.0, ..Feel::default() }));
    let wanted = feel.clone();
    let (on_state, states) = recorder::<StateSample>();
    let hooks = Hooks { feel: Box::new(move || Some(*wanted.lock().unwrap())), on_state };
    let (link, mut reader) = KnobLink::spawn_in(places.clone(), "test", hooks);
    assert_eq!(link.status().phase, Phase::Off);
    link.choose(any_serial());
    live(&link);
    let status = link.status();
    assert_eq!((status.tier, status.armed, status.serial), (2, false, Some(Setup::default().serial)));
    assert!(status.text.contains("Chalumeau sim 000000005eed0001"), "{}", status.text);

    knob.counts.store(1234, Ordering::Relaxed);
    soon("the angle at the audio thread", || {
        reader.begin_block(128, 48_000.0);
        thread::sleep(Duration::from_micros(2667));
        reader.pose(0).is_some_and(|pose| (pose.angle_deg - 123.4).abs() < 0.05)
    });
    soon("the feel is echoed", || states.try_iter().last().is_some_and(|state| state.feel_id != 0));
    feel.lock().unwrap().scale_mnm = 60.0;
    soon("a new feel", || said(&knob, |m| matches!(m, Message::Feel(feel) if feel.scale_mnm == 60.0)) > 0);
    soon("round trips", || link.status().stats.feel_round_trip_us.is_some());

    assert_eq!(said(&knob, |m| matches!(m, Message::Arm(_))), 0, "nobody has armed yet");
    link.arm(900);
    soon("armed", || knob.is_armed() && link.status().armed);
    assert_eq!(link.status().ceiling_mnm, 250);
    link.disarm();
    soon("disarmed", || !knob.is_armed() && !link.status().armed);
    link.zero();
    soon("zero", || link.status().angle_deg.is_some_and(|angle| angle.abs() < 0.05));
    link.arm(80);
    soon("armed again", || knob.is_armed());
    drop(link);
    soon("BYE", || said(&knob, |m| matches!(m, Message::Bye { .. })) > 0);
    soon("free", || !knob.is_armed());
    let heard = knob.heard();
    let alive = heard.iter().filter(|(_, m)| matches!(m, Message::Alive(_))).count() as f64;
    let seconds = (heard[heard.len() - 1].0 - heard[0].0).as_secs_f64();
    assert!(alive > 25.0 * seconds && alive < 60.0 * seconds + 2.0, "{alive} ALIVE in {seconds} s");
}
