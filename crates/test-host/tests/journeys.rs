//! The first minute with the plugin's window, timed. A musician: how long from opening it to a sound, to another preset, and to a
//! sound of one's own. A lab: to a note that a hand blows with the knob, and to torque. Run by `cargo xtask ci window`, which starts a display.
//!
//! The times are those of the program; a hand needs some seconds more for each step. They hold on a busy machine that draws without
//! a graphics card.
#![cfg(target_os = "linux")]

#[path = "support/live.rs"]
#[allow(dead_code, reason = "other tests play a knob with it")]
mod live;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use chalumeau_test_host::clap::{At, Plugin, Say, Session};
use chalumeau_test_host::knob_setup::connect;
use chalumeau_test_host::screen::Screen;
use chalumeau_test_host::simulator::{Simulator, serial_number};
use live::{BLOCK, E3, RATE, level_db, on, plugin};

/// What the program may take of the minute in which a musician shall have a sound: the rest is for looking, reading and trying.
const PROGRAM: Duration = Duration::from_secs(20);
/// Sound, and silence, dB over full scale.
const SOUNDS_DB: f64 = -45.0;
const SILENT_DB: f64 = -70.0;

/// What is said to the audio thread, and what it has heard.
#[derive(Default)]
struct Between {
    say: Mutex<Vec<Say>>,
    heard_db: Mutex<f64>,
    stop: AtomicBool,
}

impl Between {
    fn say(&self, say: Say) {
        self.say.lock().unwrap().push(say);
    }

    /// Waits until it is as loud, or as soft, as that; how long it took.
    #[track_caller]
    fn wait(&self, what: &str, holds: impl Fn(f64) -> bool) -> Duration {
        let began = Instant::now();
        while !holds(*self.heard_db.lock().unwrap()) {
            assert!(began.elapsed() < PROGRAM, "{what}: not after {PROGRAM:?}");
            std::thread::sleep(Duration::from_millis(2));
        }
        began.elapsed()
    }

    fn sounds(&self, what: &str) -> Duration {
        self.wait(what, |db| db > SOUNDS_DB)
    }

    fn falls_silent(&self, what: &str) -> Duration {
        self.wait(what, |db| db < SILENT_DB)
    }
}

/// Stops the player even when the test fails.
struct Stop<'a>(&'a Between);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.stop.store(true, Ordering::Relaxed);
    }
}

/// An open window and who plays beside it.
struct Desk<'a> {
    screen: &'a Screen,
    plugin: &'a mut Plugin,
    frame: u32,
    between: &'a Between,
    opened: Instant,
}

impl Desk<'_> {
    /// What a host's main thread does all the time.
    fn attend(&mut self) {
        if let Some(size) = self.plugin.attend() {
            self.screen.resize(self.frame, size).unwrap();
        }
    }

    fn click(&mut self, at: (i16, i16)) {
        self.screen.point(self.frame, at).unwrap();
        std::thread::sleep(Duration::from_millis(60));
        self.screen.press(true).unwrap();
        std::thread::sleep(Duration::from_millis(60));
        self.screen.press(false).unwrap();
        self.attend();
    }

    /// Name of the preset that the project would keep.
    fn preset(&mut self) -> String {
        self.attend();
        let state = self.plugin.save().unwrap();
        let all: serde_json::Value = serde_json::from_slice(&state[8..]).unwrap();
        serde_json::from_str(all["fields"]["preset"].as_str().unwrap()).unwrap()
    }

    /// Whether the preset becomes another one in this time.
    fn comes_to_another(&mut self, before: &str, time: Duration) -> bool {
        let began = Instant::now();
        while began.elapsed() < time {
            std::thread::sleep(Duration::from_millis(20));
            if self.preset() != before {
                return true;
            }
        }
        false
    }

    fn keep(&self, name: &str) {
        let path =
            chalumeau_test_host::machine::target().join("screenshots").join(format!("journey-{name}.png"));
        self.screen.picture(self.frame).unwrap().write(&path).unwrap();
    }

    fn step(&self, what: &str, took: Duration) {
        println!("{:6.2} s  {what}: {} ms", self.opened.elapsed().as_secs_f64(), took.as_millis());
    }
}

/// Opens the window of a new plugin that plays at the pace of a sound card, and walks.
fn journey(walk: impl FnOnce(&mut Desk)) {
    let screen = Screen::open(None).unwrap();
    let mut plugin = plugin();
    let session = plugin.activate(RATE, BLOCK).unwrap();
    let between = Between { heard_db: Mutex::new(f64::NEG_INFINITY), ..Between::default() };
    let session = std::thread::scope(|threads| {
        let audio = threads.spawn(|| play(session, &between));
        let stop = Stop(&between);
        let opened = Instant::now();
        let mut frame = 0;
        plugin
            .open_window(|width, height| {
                frame = screen.frame((0, 0), (width, height))?;
                Ok(frame)
            })
            .unwrap();
        let mut desk = Desk { screen: &screen, plugin: &mut plugin, frame, between: &between, opened };
        screen.drawn(frame).unwrap();
        desk.step("the window is drawn", opened.elapsed());
        walk(&mut desk);
        let all = desk.opened.elapsed();
        assert!(all < 3 * PROGRAM, "the journey took {all:?}");
        let _ = plugin.close_window();
        screen.close(frame).unwrap();
        drop(stop);
        audio.join().unwrap()
    });
    plugin.deactivate(session);
}

fn play(mut session: Session, between: &Between) -> Session {
    while !between.stop.load(Ordering::Relaxed) {
        let said: Vec<At> =
            std::mem::take(&mut *between.say.lock().unwrap()).into_iter().map(|say| At(0, say)).collect();
        let heard = session.play_live(&said, 8 * BLOCK, RATE).unwrap();
        *between.heard_db.lock().unwrap() = level_db(&heard[0]).max(level_db(&heard[1]));
    }
    session
}

/// Where a key of the keyboard along the lower edge is.
fn a_key(desk: &Desk) -> (i16, i16) {
    let (width, height) = desk.screen.size(desk.frame).unwrap();
    (i16::try_from(width / 2).unwrap(), i16::try_from(height - 16).unwrap())
}

#[test]
#[ignore = "needs a display"]
fn a_keyboard_player_has_a_sound_and_another_preset_in_the_first_minute() {
    journey(|desk| {
        let between = desk.between;
        let (x, y) = a_key(desk);
        desk.screen.point(desk.frame, (x, y)).unwrap();
        desk.screen.press(true).unwrap();
        let took = between.sounds("a key of the window");
        desk.step("a key of the window sounds", took);
        std::thread::sleep(Duration::from_millis(700));
        desk.keep("key");
        desk.screen.press(false).unwrap();
        between.falls_silent("the key is up");
        between.say(on(E3 + 12));
        let took = between.sounds("a key of the host");
        desk.step("a key of the host sounds", took);
        std::thread::sleep(Duration::from_millis(300));

        // A hand sees the arrow of the next preset; here the header is searched, from the right, under the held note.
        let (first, width) = (desk.preset(), desk.screen.size(desk.frame).unwrap().0);
        let search = Instant::now();
        let mut found = None;
        for x in (width / 2..2 * width / 3).rev().step_by(9) {
            let at = (i16::try_from(x).unwrap(), 26);
            let before = desk.preset();
            let clicked = Instant::now();
            desk.click(at);
            if desk.comes_to_another(&before, Duration::from_secs(1)) {
                found = Some((at, clicked.elapsed()));
                break;
            }
        }
        let searched = search.elapsed();
        let (at, took) = found.expect("no arrow in the header leads to another preset");
        let now = desk.preset();
        desk.step(&format!("from {first:?} to {now:?}, found at {at:?} after {searched:?}"), took);
        let took = between.sounds("the held note goes on in the other preset");
        desk.step("it sounds", took);
        std::thread::sleep(Duration::from_millis(700));
        desk.keep("preset");
        for _ in 0..3 {
            let before = desk.preset();
            desk.click(at);
            assert!(desk.comes_to_another(&before, PROGRAM), "the arrow has stopped");
            between.sounds("one preset after another");
        }
        let now = desk.preset();
        desk.step(&format!("three more, {now:?}"), Duration::ZERO);
        desk.keep("presets");
        // What the search took is the test's own.
        desk.opened += searched;
    });
}

#[test]
#[ignore = "needs a display"]
fn a_wind_player_blows_and_is_heard_without_any_setting() {
    journey(|desk| {
        let between = desk.between;
        between.say(Say::Midi([0xb0, 2, 1]));
        between.say(on(E3 + 7));
        desk.screen.point_away().unwrap();
        std::thread::sleep(Duration::from_millis(300));
        let dark = desk.screen.picture(desk.frame).unwrap();
        for value in 2..90_u8 {
            between.say(Say::Midi([0xb0, 2, value]));
            std::thread::sleep(Duration::from_millis(10));
        }
        let took = between.sounds("the breath of CC2");
        desk.step("the breath sounds", took);
        let began = Instant::now();
        let shows = || Ok((desk.screen.picture(desk.frame)?.differing(&dark) > 5_000).then_some(()));
        desk.screen.wait("the window shows the breath", shows).unwrap();
        desk.step("the window shows it", began.elapsed());
        std::thread::sleep(Duration::from_millis(500));
        desk.keep("breath");
        for value in (0..90_u8).rev() {
            between.say(Say::Midi([0xb0, 2, value]));
            std::thread::sleep(Duration::from_millis(5));
        }
        let took = between.falls_silent("no breath, with the key still down");
        desk.step("without breath it is silent", took);
    });
}

/// Milliseconds of a knob's log in which it was armed and turned the hand back with more than 20 mNm.
fn resisting_ms(log: &str) -> usize {
    let rows = log.lines().filter(|line| !line.starts_with('#')).skip(1);
    let resists = |line: &&str| {
        let cells: Vec<f64> = line.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
        cells.len() >= 6 && cells[3] < -20.0 && cells[5] > 0.5
    };
    // A row every 2 ms.
    2 * rows.filter(resists).count()
}

#[test]
#[ignore = "needs a display"]
fn a_lab_blows_with_the_knob_and_feels_it_when_it_is_armed() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("knob.csv");
    let (number, kept) = (serial_number(), log.to_string_lossy().into_owned());
    let name = format!("{number:016x}");
    // A hand that rests until the knob is armed, then turns it and lets it come back, again and again.
    let hand = ["--serial-number", &name, "--crescendo", "0:200:3", "--loop", "--wait-armed", "--log", &kept];
    let knob = Simulator::start(&hand).unwrap();
    journey(|desk| {
        let between = desk.between;
        between.say(on(E3));
        between.sounds("a key without breath");
        connect(desk.plugin, number).unwrap();
        let took = between.falls_silent("the knob rests, so that it blows nothing, with the key down");
        desk.step("the knob is found, and blows", took);
        // A switch that is on when the knob is found is no act of the user; a hand takes longer than that.
        std::thread::sleep(Duration::from_secs(1));
        // A machine that stalls for 80 ms disarms the knob, as it must; the user arms it again.
        let arm = desk.plugin.param("Arm knob").unwrap().id;
        let began = Instant::now();
        while *between.heard_db.lock().unwrap() < SOUNDS_DB {
            assert!(began.elapsed() < PROGRAM, "the armed knob is not heard");
            between.say(Say::Set(arm, 1.0));
            let armed = Instant::now();
            while *between.heard_db.lock().unwrap() < SOUNDS_DB && armed.elapsed() < Duration::from_secs(8) {
                desk.attend();
                std::thread::sleep(Duration::from_millis(20));
            }
            desk.step("the armed knob is turned and heard", began.elapsed());
            desk.keep("knob");
            std::thread::sleep(Duration::from_millis(500));
            between.say(Say::Set(arm, 0.0));
            std::thread::sleep(Duration::from_millis(200));
        }
    });
    drop(knob);
    let resisted = resisting_ms(&std::fs::read_to_string(&log).unwrap());
    println!("the knob resisted for {resisted} ms");
    assert!(resisted > 100, "{resisted} ms");
}
