//! The bundled VST3 in a host that does what VST3 allows and friendly hosts do not: it flushes events without samples, gives no
//! input, asks for what is not there, and removes instances while they work. `cargo xtask bundle` first.
#![cfg(target_os = "linux")]

#[path = "support/raw_vst3.rs"]
mod raw_vst3;
#[path = "support/wind.rs"]
mod wind;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use chalumeau_test_host::screen::Screen;
use raw_vst3::{BLOCK, Block, CLARINET, MICROPHONE, Raw, note_off, note_on, volume};
use vst3::Steinberg::Vst::{Event, IEditControllerTrait};
use vst3::Steinberg::kInvalidArgument;
use wind::{SECOND, quiet, wind};

/// VST3 knows one main thread; the tests take turns at being it.
fn turn() -> MutexGuard<'static, ()> {
    static MAIN_THREAD: Mutex<()> = Mutex::new(());
    MAIN_THREAD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The loudest sample of what sounds for so long without an event.
fn peak(raw: &Raw, samples: usize) -> f32 {
    let blocks = (0..samples / BLOCK).flat_map(|_| raw.process(Block::default()));
    blocks.fold(0.0, |peak, sample| peak.max(sample.abs()))
}

#[test]
fn events_of_blocks_that_nothing_is_heard_of_are_heard_in_the_next() {
    let _turn = turn();
    for (samples, has_output) in [(0, true), (0, false), (BLOCK, false)] {
        let raw = Raw::load(CLARINET);
        let flush = |events: &[Event]| raw.process(Block { samples, has_output, events, ..Block::default() });
        let at = samples.saturating_sub(1);
        flush(&[note_on(at, 60, 1)]);
        assert!(peak(&raw, SECOND / 2) > 0.01, "{samples} samples, output: {has_output}");
        // Several such blocks may follow each other.
        flush(&[note_off(at, 60, 1)]);
        flush(&[]);
        peak(&raw, SECOND);
        let rest = peak(&raw, SECOND / 4);
        assert!(rest < 1e-6, "{rest} sounds on: {samples} samples, output: {has_output}");
    }
}

#[test]
fn a_microphone_that_is_not_connected_hears_silence_and_not_the_clarinet() {
    let _turn = turn();
    let sound = |is_on: bool| {
        let raw = Raw::load(MICROPHONE);
        let on = [(raw.parameter("Microphone"), f64::from(u8::from(is_on)))];
        let mut sound = raw.process(Block { changes: &on, events: &[note_on(0, 60, 1)], ..Block::default() });
        // Whatever is left in the host's buffers, were it wind.
        for left in [quiet(SECOND / 2), wind(SECOND)].concat().chunks(BLOCK) {
            sound.extend(raw.process(Block { samples: left.len(), left, ..Block::default() }));
        }
        sound
    };
    let (on, off) = (sound(true), sound(false));
    assert!(off.iter().any(|x| x.abs() > 0.01));
    assert!(on == off, "what was in the output blows");
}

#[test]
fn an_expression_is_of_the_latest_note_of_its_id() {
    let _turn = turn();
    let raw = Raw::load(CLARINET);
    let say = |events: &[Event]| raw.process(Block { events, ..Block::default() });
    // More notes than the wrapper remembers ids of.
    for round in 0..40 {
        say(&[note_on(0, 64, 1), note_on(1, 65, 2 + round)]);
        say(&[note_off(0, 64, 1), note_off(1, 65, 2 + round)]);
    }
    peak(&raw, SECOND / 2);
    say(&[note_on(0, 60, 1)]);
    let usual = peak(&raw, SECOND / 2);
    say(&[volume(0, 1, 0.0)]);
    peak(&raw, SECOND / 4);
    let silent = peak(&raw, SECOND / 4);
    assert!(usual > 0.01 && silent < 1e-3 * usual, "{usual}, then {silent}");
}

#[test]
fn no_parameter_is_behind_the_last() {
    let _turn = turn();
    for class in [CLARINET, *b"ChalumeauNotesOn"] {
        let raw = Raw::load(class);
        // SAFETY: the controller lives, and the structure is of plain numbers.
        unsafe {
            let count = raw.controller.getParameterCount();
            for index in [count, count + 1, i32::MAX, -1] {
                let mut info = std::mem::zeroed();
                assert_eq!(raw.controller.getParameterInfo(index, &raw mut info), kInvalidArgument);
            }
        }
    }
}

/// Moves a parameter all the time, and counts how often, until told to stop.
fn automate(raw: &Raw, moved: &AtomicUsize, stop: &AtomicBool) {
    let gain = raw.parameter("Gain");
    for step in (0..100).cycle() {
        raw.process(Block { samples: 16, changes: &[(gain, f64::from(step) / 100.0)], ..Block::default() });
        moved.fetch_add(1, Ordering::Relaxed);
        if stop.load(Ordering::Relaxed) {
            return;
        }
        // Another thread works off what follows from each change.
        std::thread::yield_now();
    }
}

/// Waits until it has moved a hundred times more.
fn go_on_moving(moved: &AtomicUsize) {
    let before = moved.load(Ordering::Relaxed);
    while moved.load(Ordering::Relaxed) < before + 100 {
        std::thread::yield_now();
    }
}

#[test]
fn an_instance_that_goes_while_its_values_are_told_takes_no_other_along() {
    let _turn = turn();
    let kept = Raw::load(CLARINET);
    for _ in 0..20 {
        let going = Raw::load(CLARINET);
        std::thread::scope(|threads| {
            threads.spawn(|| {
                let gain = going.parameter("Gain");
                // As many as the queue of what is to be told holds.
                for step in 0..400 {
                    let changes = [(gain, f64::from(step % 2))];
                    going.process(Block { samples: 1, changes: &changes, ..Block::default() });
                }
            });
        });
    }
    // The last one ends what all have shared, and finds it alive.
    drop(kept);
    assert!(peak(&Raw::load(CLARINET), BLOCK) < 1e-6, "the next instance works");
}

#[test]
#[ignore = "needs a display; `cargo xtask ci window`"]
fn parameters_move_while_the_window_opens_stays_and_closes() {
    let _turn = turn();
    let screen = Screen::open(None).unwrap();
    for _ in 0..3 {
        let raw = Raw::load(CLARINET);
        let (moved, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
        std::thread::scope(|threads| {
            threads.spawn(|| automate(&raw, &moved, &stop));
            let frame = screen.frame((0, 0), (1_200, 800)).unwrap();
            let view = raw.view();
            go_on_moving(&moved);
            view.open(frame);
            screen.inside(frame).unwrap();
            go_on_moving(&moved);
            view.close();
            stop.store(true, Ordering::Relaxed);
            screen.close(frame).unwrap();
        });
        // The last instance: what it ends must have lived.
        drop(raw);
    }
}
