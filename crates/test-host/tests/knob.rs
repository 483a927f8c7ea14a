//! The bundled CLAP with the simulated knob, in a host, at the pace of a sound card. `cargo xtask bundle` first.
//!
//! Everything here is real but the metal and the hand: the firmware's own code, a serial line (pty) or UDP, the plugin's
//! link, its audio thread. Times are generous: a loaded machine makes these tests slower, not wrong.

#[path = "support/live.rs"]
mod live;

use std::time::Duration;

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::{Clarinet, Settings};
use chalumeau_core::units::{SoundingNote, cents};
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, BreathMapping};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::touch::take::Take;
use chalumeau_test_host::clap::{At, Say};
use chalumeau_test_host::knob_setup::{connect, edit, hear_of_zero, wait_until_live};
use chalumeau_test_host::simulator::{Simulator, serial_number};
use live::{BLOCK, E3, RATE, SECOND, breath, level_db, on, play_until, plugin};

fn knob(number: u64, hand: &[&str]) -> Simulator {
    Simulator::start(&[&["--serial-number", &format!("{number:016x}")], hand].concat()).unwrap()
}

#[test]
fn a_hand_on_the_knob_plays_the_plugin_over_a_serial_line() {
    let number = serial_number();
    let _knob = knob(number, &["--hold", "200"]);
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let (heard, sent) = plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            let [left, _] = session.play_live(&[At(0, on(E3))], 2 * SECOND, RATE).unwrap();
            // A machine that stalls loses the knob for a moment.
            play_until(session, "the knob's breath", |session| breath(session) > 0.0);
            (left, breath(session))
        })
        .unwrap();
    let hz = fundamental_hz(&to_f64(&heard[SECOND..]), RATE).expect("a pitch");
    let off = cents(hz, 146.832);
    println!("breath {sent:.3}, {hz:.2} Hz, {off:+.1} cents, {:.1} dBFS", level_db(&heard[SECOND..]));
    assert!(off.abs() < 20.0, "{hz} Hz");
    assert!((0.35..0.95).contains(&sent), "breath {sent}");
}

#[test]
fn offline_a_device_makes_no_difference() {
    let number = serial_number();
    let _knob = knob(number, &["--hold", "250"]);
    let mut plugin = plugin();
    let said = [At(0, on(60)), At(SECOND / 2, Say::Midi([0xB0, 2, 90])), At(SECOND, on(67))];
    plugin.set_offline(true).unwrap();
    let without = plugin.play(RATE, 512, &said, 2 * SECOND).unwrap();
    plugin.set_offline(false).unwrap();
    connect(&mut plugin, number).unwrap();
    plugin.session(RATE, BLOCK, |session| wait_until_live(session, RATE).unwrap()).unwrap();
    plugin.set_offline(true).unwrap();
    let (with, answers) = plugin
        .session(RATE, 512, |session| (session.play(&said, 2 * SECOND).unwrap(), session.answers().len()))
        .unwrap();
    assert!(level_db(&with[0]) > -60.0);
    assert!(with == without, "a live knob is heard in an offline render");
    assert_eq!(answers, 0);
}

#[test]
fn what_the_host_records_is_what_was_played() {
    let number = serial_number();
    let _knob = knob(number, &["--crescendo", "100:250:2", "--loop"]);
    let mut player = plugin();
    connect(&mut player, number).unwrap();
    let (heard, recorded) = player
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            session.reset();
            let first = session.played();
            let [left, _] = session.play_live(&[At(0, on(60))], 2 * SECOND, RATE).unwrap();
            let said = session.answers().iter().filter(|(at, _)| *at >= first);
            (left, said.map(|&(at, midi)| At(at - first, Say::Midi(midi))).collect::<Vec<_>>())
        })
        .unwrap();
    assert!(recorded.len() > 200, "{} messages", recorded.len());
    // The note first, as it was played; then what was recorded.
    let again = [vec![At(0, on(60))], recorded].concat();
    let [left, _] = plugin().play(RATE, BLOCK, &again, 2 * SECOND).unwrap();
    let apart = heard.iter().zip(&left).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    println!("{apart} of {} samples differ", heard.len());
    assert_eq!(apart, 0);
}

#[test]
fn a_pulled_cable_silences_and_a_new_one_is_found_disarmed() {
    let number = serial_number();
    let mut first = knob(number, &["--hold", "220"]);
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let arm = plugin.param("Arm knob").unwrap().id;
    plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            let said = [At(0, on(E3)), At(0, Say::Set(arm, 1.0))];
            let [left, _] = session.play_live(&said, SECOND, RATE).unwrap();
            assert!(level_db(&left[SECOND / 2..]) > -60.0);
            first.unplug().unwrap();
            session.play_live(&[], SECOND, RATE).unwrap();
            let [left, _] = session.play_live(&[], SECOND / 4, RATE).unwrap();
            assert!(level_db(&left) < -100.0, "{} dBFS after the cable was pulled", level_db(&left));
            assert_eq!(breath(session), 0.0);
            let _second = knob(number, &["--hold", "220"]);
            let took = play_until(session, "the knob's return", |session| breath(session) > 0.1);
            println!("back after {:.2} s", took.as_secs_f64());
            assert!(took < Duration::from_secs(4), "{took:?}");
        })
        .unwrap();
}

#[test]
fn a_project_remembers_its_knob_by_number_and_never_armed() {
    let number = serial_number();
    let _knob = knob(number, &["--hold", "0"]);
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let arm = plugin.param("Arm knob").unwrap().id;
    plugin
        .session(RATE, BLOCK, |session| {
            session.play_live(&[], 2 * SECOND, RATE).unwrap();
            session.play_live(&[At(0, Say::Set(arm, 1.0))], SECOND / 2, RATE).unwrap();
        })
        .unwrap();
    let state = plugin.save().unwrap();
    let text = String::from_utf8_lossy(&state[8..]).into_owned();
    assert!(text.contains(&format!("{number:016x}")), "{text}");
    assert!(!text.contains("/dev/"), "a path in the state");
    let mut again = live::plugin();
    again.restore(&state).unwrap();
    assert_eq!(again.value(arm).unwrap(), 0.0, "armed by loading");
}

#[test]
fn two_instances_share_a_knob_by_asking() {
    let number = serial_number();
    let _knob = knob(number, &["--hold", "200"]);
    let (mut first, mut second) = (plugin(), plugin());
    connect(&mut first, number).unwrap();
    connect(&mut second, number).unwrap();
    let take_over = second.param("Take over knob").unwrap().id;
    let status = second.param("Knob status").unwrap().id;
    let mut activated = first.activate(RATE, BLOCK).unwrap();
    wait_until_live(&mut activated, RATE).unwrap();
    let mut other = second.activate(RATE, BLOCK).unwrap();
    other.play_live(&[], SECOND, RATE).unwrap();
    assert!(other.answers().is_empty(), "two instances blow with one knob");
    let said = second.text(status, 0.0).unwrap();
    println!("the second says: {said}");
    assert!(said.to_lowercase().contains("chalumeau"), "{said}");
    other.play_live(&[At(0, Say::Set(take_over, 1.0))], SECOND / 10, RATE).unwrap();
    let took = play_until(&mut other, "the take-over", |session| !session.answers().is_empty());
    println!("taken over after {:.2} s", took.as_secs_f64());
    second.deactivate(other);
    first.deactivate(activated);
}

#[test]
fn stock_firmware_plays_over_osc() {
    let port = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let _knob = Simulator::start(&["--osc", &format!("127.0.0.1:{port}"), "--hold", "200"]).unwrap();
    let mut plugin = plugin();
    chalumeau_test_host::knob_setup::listen(&mut plugin, port).unwrap();
    // A ceiling that allows no feel: a knob without a motor makes no torque that could be too much.
    edit(&mut plugin, |state| state["params"]["ceil"] = serde_json::json!({ "f32": 10.0 })).unwrap();
    let heard = plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            let [left, _] = session.play_live(&[At(0, on(E3))], 2 * SECOND, RATE).unwrap();
            left
        })
        .unwrap();
    let hz = fundamental_hz(&to_f64(&heard[SECOND..]), RATE).expect("a pitch");
    assert!(cents(hz, 146.832).abs() < 20.0, "{hz} Hz");
}

#[test]
fn a_take_is_replayed_the_same_by_plugin_and_renderer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.csv");
    let rows: String = (0..1_000)
        .map(|n| format!("{},{:.2}\n", 5_000_000 + 2_000 * n, 150.0 + 60.0 * (0.01 * f64::from(n)).sin()))
        .collect();
    std::fs::write(&path, format!("# by hand\nt_us,angle_deg\n{rows}")).unwrap();
    let mut plugin = plugin();
    edit(&mut plugin, |state| {
        state["fields"]["take"] = serde_json::to_string(&path.display().to_string()).unwrap().into();
        state["params"]["replay"] = serde_json::json!({ "bool": true });
        // The rest of a knob that is not there, and a ceiling that allows no feel: the take has neither.
        let other = serde_json::json!({ "rest_deg": 40.0, "travel_deg": 360.0, "dead_deg": [1.0, 0.5] });
        state["fields"]["calibration"] = other.to_string().into();
        state["params"]["ceil"] = serde_json::json!({ "f32": 10.0 });
    })
    .unwrap();
    plugin.set_offline(true).unwrap();
    let said = [At(0, on(60)), At(SECOND, on(67))];
    let first = plugin.play(RATE, 512, &said, 2 * SECOND).unwrap();
    let second = plugin.play(RATE, 77, &said, 2 * SECOND).unwrap();
    assert!(first == second, "two bounces of a take differ");

    let feels = InstrumentFeel::built_in().unwrap();
    let table = feels.table(&Settings::default(), &FeelDesign::default(), &NO_MOTOR).unwrap();
    let hand = BreathMapping {
        maps: feels.maps_for(&table, &Settings::default()),
        design: KnobDesign::default(),
        feels: true,
    };
    let take = Take::read(std::fs::File::open(&path).unwrap()).unwrap();
    let note =
        |at, key| Timed { at, event: Event::NoteOn { note: SoundingNote(key), velocity: 100.0 / 127.0 } };
    let mut blower = Blower::default();
    let mut ignore = |_, _| {};
    let angle = |at: usize| Some(take.angle_deg(at as f64 / RATE));
    let notes = [note(0, 60), note(SECOND, 67)].into_iter();
    let events = BlownEvents::new(notes, &mut blower, &hand, 6_000.0, 2 * SECOND, angle, &mut ignore);
    let mut rendered = vec![0.0; 2 * SECOND];
    Clarinet::built_in(RATE).unwrap().render_events(events, &mut rendered);
    assert!(level_db(&rendered) > -60.0);
    let apart = rendered.iter().zip(&first[0]).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert_eq!(apart, 0, "of {} samples", rendered.len());
}

/// What a knob made of a switch that was on from the start, then off, then on for two seconds: angle, torque, armed.
fn knob_that_is_armed() -> Vec<[f64; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("knob.csv");
    let number = serial_number();
    let knob = knob(number, &["--hold", "110", "--log", &log.to_string_lossy()]);
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let arm = plugin.param("Arm knob").unwrap().id;
    plugin
        .session(RATE, BLOCK, |session| {
            // On from the start is no act of the user.
            session.play_live(&[At(0, Say::Set(arm, 1.0))], SECOND / 10, RATE).unwrap();
            wait_until_live(session, RATE).unwrap();
            session.play_live(&[At(0, on(E3))], SECOND, RATE).unwrap();
            session.play_live(&[At(0, Say::Set(arm, 0.0))], SECOND, RATE).unwrap();
            hear_of_zero(session, arm, RATE).unwrap();
            session.play_live(&[At(0, Say::Set(arm, 1.0))], 2 * SECOND, RATE).unwrap();
            session.play_live(&[At(0, Say::Set(arm, 0.0))], SECOND / 2, RATE).unwrap();
        })
        .unwrap();
    drop(plugin);
    drop(knob);
    let text = std::fs::read_to_string(&log).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.filter_map(|line| {
        let cells: Vec<f64> = line.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
        (cells.len() >= 6).then(|| [cells[1], cells[3], cells[5]])
    })
    .collect()
}

#[test]
fn only_the_user_arms_and_then_the_note_resists() {
    // A machine that stalls for 80 ms disarms the knob, as it must; it may have another try.
    for attempt in 1..=4 {
        let rows = knob_that_is_armed();
        let first = rows.iter().position(|row| row[2] > 0.5).unwrap_or(rows.len());
        // What the user does makes the knob probe its signs first, with 12 mNm for half a second at most.
        let (before, probe) = rows[..first].split_at(first.saturating_sub(250));
        assert!(before.iter().all(|row| row[1].abs() < 0.5), "torque before the user armed");
        assert!(probe.iter().all(|row| row[1].abs() <= 12.0), "more than the probe before the knob is armed");
        let armed: Vec<_> = rows[first..].iter().filter(|row| row[2] > 0.5).collect();
        let seconds = armed.len() as f64 / 500.0;
        let strongest = armed.iter().map(|row| -row[1]).fold(0.0, f64::max);
        println!("armed for {seconds:.2} s of 2, at most {strongest:.0} mNm against a hand at 110 degrees");
        assert!(seconds < 2.5, "armed for {seconds} s of 2");
        assert!(strongest <= 100.0, "{strongest} mNm is above the ceiling");
        if seconds > 1.5 && strongest > 20.0 {
            return;
        }
        println!("try {attempt}: the machine was too busy to keep the knob armed");
    }
    panic!("never armed for two seconds in four tries");
}

#[test]
fn a_slap_of_the_hand_is_a_slap_of_the_tongue() {
    let number = serial_number();
    let _knob = knob(number, &["--slap", "--loop"]);
    let mut plugin = plugin();
    connect(&mut plugin, number).unwrap();
    let heard = plugin
        .session(RATE, BLOCK, |session| {
            wait_until_live(session, RATE).unwrap();
            let [left, _] = session.play_live(&[], 4 * SECOND, RATE).unwrap();
            left
        })
        .unwrap();
    let peak = heard.iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
    println!("peak {peak:.3} without a key or breath");
    assert!(peak > 0.01, "{peak}");
}
