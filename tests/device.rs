//! The link to a knob as the plugin uses it, with the real firmware at the other end of a pseudo-terminal.
#![cfg(unix)]

#[path = "support/knob.rs"]
mod knob;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::{Clarinet, Settings};
use chalumeau_core::units::{SoundingNote, cents};
use chalumeau_firmware::Setup;
use chalumeau_knob::device::memory::{MemoryPort, pair};
use chalumeau_knob::device::session::{HostSession, SessionEvent, SessionOutput, SessionStatus};
use chalumeau_knob::device::transport::{Binding, Transport};
use chalumeau_knob::device::{Hooks, KnobChoice, KnobLink, Phase, Release, RuntimeDir, StateSample};
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::SimulatedKnob;
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::simulator::script::Aim;
use chalumeau_knob::simulator::serve::{Control, Port, Server};
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, Breath14, BreathMapping};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::wire::{Decoder, Feel, Message, TorqueLaw};
use knob::{FirmwareKnob, Obeying, PtyKnob, recorder, soon};
use rosc::{OscMessage, OscPacket, OscType, encoder};
use serialport::{SerialPort, TTYPort};
use std::io;
use std::io::{Read, Write};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

fn places() -> (TempDir, RuntimeDir) {
    let directory = tempfile::tempdir().unwrap();
    let places = RuntimeDir::within(directory.path());
    (directory, places)
}

/// A link to `choice` with nothing to feel.
fn linked(places: &RuntimeDir, label: &str, choice: KnobChoice) -> KnobLink {
    let (link, _reader) = KnobLink::spawn_in(places.clone(), label, Hooks::default());
    link.choose(choice);
    link
}

fn any_serial() -> KnobChoice {
    KnobChoice::Serial { serial: None }
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
    let feel = Arc::new(Mutex::new(Feel { law: TorqueLaw::Flow, scale_mnm: 50.0, ..Feel::default() }));
    let wanted = feel.clone();
    let (on_state, states) = recorder::<StateSample>();
    let hooks = Hooks { feel: Box::new(move || Some(*wanted.lock().unwrap())), on_state };
    let (link, mut reader) = KnobLink::spawn_in(places.clone(), "test", hooks);
    let obeying = Obeying::of(&link);
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
    // A knob that is being turned, as this one was, is not armed.
    soon("rest", || states.try_iter().last().is_some_and(|state| state.velocity_deg_s.abs() < 60.0));
    link.arm(900);
    soon("armed", || knob.is_armed() && link.status().armed);
    assert_eq!(link.status().ceiling_mnm, 250);
    link.disarm();
    soon("disarmed", || !knob.is_armed() && !link.status().armed);
    link.zero();
    soon("zero", || link.status().angle_deg.is_some_and(|angle| angle.abs() < 0.05));
    link.arm(80);
    soon("armed again", || knob.is_armed());
    // Nobody obeys the user any more.
    drop(obeying);
    soon("let go", || !knob.is_armed() && !link.status().armed);
    soon("told why", || link.status().notice.is_some_and(|why| why.contains("has stood still")));
    let _obeying = Obeying::of(&link);
    link.arm(80);
    soon("armed once more", || knob.is_armed());
    let hand = link.heartbeat("a hand");
    hand.let_go(Release::Stop);
    soon("stopped", || !knob.is_armed());
    soon("told", || link.status().notice.is_some_and(|why| why.contains("stop was pressed")));
    link.arm(80);
    soon("armed at last", || knob.is_armed());
    drop(link);
    soon("BYE", || said(&knob, |m| matches!(m, Message::Bye { .. })) > 0);
    soon("free", || !knob.is_armed());
    let heard = knob.heard();
    let alive = heard.iter().filter(|(_, m)| matches!(m, Message::Alive(_))).count() as f64;
    let seconds = (heard[heard.len() - 1].0 - heard[0].0).as_secs_f64();
    assert!(alive > 25.0 * seconds && alive < 60.0 * seconds + 2.0, "{alive} ALIVE in {seconds} s");
}

#[test]
fn the_audio_threads_end_allocates_nothing() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let (link, mut reader) = KnobLink::spawn_in(places, "test", Hooks::default());
    link.choose(any_serial());
    live(&link);
    knob.counts.store(300, Ordering::Relaxed);
    let mut heard = 0;
    soon("breath", || {
        assert_no_alloc(|| {
            reader.begin_block(64, 48_000.0);
            let breath =
                (0..64).filter_map(|offset| reader.pose(offset)).filter(|pose| pose.angle_deg > 29.0);
            heard += breath.count();
            heard += usize::from(reader.take_slap().is_some());
        });
        heard > 1000
    });
}

/// Note changes at odd moments; how long until the knob has the FEEL is printed, and bounded for a busy machine.
#[test]
fn a_new_feel_is_at_the_knob_within_milliseconds() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let feel = Arc::new(Mutex::new(Feel::default()));
    let wanted = feel.clone();
    let hooks = Hooks { feel: Box::new(move || Some(*wanted.lock().unwrap())), ..Hooks::default() };
    let (link, _reader) = KnobLink::spawn_in(places, "test", hooks);
    link.choose(any_serial());
    live(&link);
    let mut changes = Vec::new();
    for n in 0..200u64 {
        thread::sleep(Duration::from_micros(12_000 + n * 7919 % 5000));
        feel.lock().unwrap().a_on_deg = 1.0 + n as f32;
        changes.push(Instant::now());
    }
    soon("the last one", || said(&knob, |m| matches!(m, Message::Feel(f) if f.a_on_deg == 200.0)) > 0);
    let heard = knob.heard();
    let arrival = |n: usize| {
        heard.iter().find_map(|(at, m)| match m {
            Message::Feel(feel) if feel.a_on_deg == 1.0 + n as f32 => Some(*at),
            _ => None,
        })
    };
    let mut took: Vec<Duration> =
        changes.iter().enumerate().filter_map(|(n, at)| Some(arrival(n)? - *at)).collect();
    took.sort();
    let (p50, p99) = (took[took.len() / 2], took[took.len() * 99 / 100]);
    println!("FEEL at the knob after {p50:?} (p50), {p99:?} (p99), {} of 200", took.len());
    assert!(took.len() >= 190, "only those overtaken by the next may be missing: {}", took.len());
    assert!(p50 < Duration::from_millis(5), "{p50:?}");
}

#[test]
fn unplugged_and_plugged_in_again_the_knob_is_back_in_two_seconds_disarmed() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let (link, mut reader) = KnobLink::spawn_in(places.clone(), "test", Hooks::default());
    link.choose(any_serial());
    let _obeying = Obeying::of(&link);
    live(&link);
    link.arm(100);
    soon("armed", || link.status().armed);
    drop(knob);
    soon("noticed", || matches!(link.status().phase, Phase::Lost { .. }));
    assert!(!link.status().armed);
    thread::sleep(Duration::from_millis(200));
    reader.begin_block(128, 48_000.0);
    assert_eq!(reader.pose(0), None, "no breath without a knob");
    let again = PtyKnob::plug(Some(&places), &Setup::default());
    let took = live(&link);
    println!("back after {took:?}");
    assert!(took < Duration::from_secs(2), "{took:?}");
    thread::sleep(Duration::from_millis(500));
    assert!(!again.is_armed() && !link.status().armed);
    assert_eq!(said(&again, |m| matches!(m, Message::Arm(_))), 0);
    assert_eq!(link.status().stats.losses, 1);
}

#[test]
fn what_is_missing_or_busy_or_another_says_so_each_in_its_own_words() {
    let (_directory, places) = places();
    let link = linked(&places, "test", any_serial());
    soon("no knob", || link.status().phase == Phase::Searching);
    assert!(link.status().text.contains("plug one in"), "{}", link.status().text);
    link.arm(100);
    soon("refused", || link.status().last_refusal.is_some_and(|why| why.contains("no knob")));

    link.choose(KnobChoice::Path("/dev/not-there".into()));
    soon("missing", || link.status().text.contains("/dev/not-there is not there"));

    let knob = PtyKnob::plug(None, &Setup::default());
    let _monitor = serialport::new(knob.path.to_string_lossy(), 115_200).open().unwrap();
    link.choose(KnobChoice::Path(knob.path.clone()));
    soon("busy", || matches!(link.status().phase, Phase::Busy(text) if text.contains("another program")));

    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    link.choose(KnobChoice::Osc { port: taken.local_addr().unwrap().port(), any_address: false });
    soon("busy UDP", || matches!(link.status().phase, Phase::Busy(text) if text.contains("UDP port")));

    let other = PtyKnob::plug(Some(&places), &Setup { serial: 0xA, ..Setup::default() });
    link.choose(KnobChoice::Serial { serial: Some(0xB) });
    thread::sleep(Duration::from_millis(600));
    assert_eq!(link.status().phase, Phase::Searching, "a knob of another number is not taken");
    assert_eq!(said(&other, |_| true), 0, "nor even spoken to");
    link.choose(KnobChoice::Serial { serial: Some(0xA) });
    live(&link);
}

#[test]
fn of_two_instances_one_has_the_knob_and_the_other_knows_who_and_can_take_it() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let first = linked(&places, "Track 1", any_serial());
    let _obeying = Obeying::of(&first);
    live(&first);
    first.arm(100);
    soon("armed", || knob.is_armed());
    // By its number, and by its port.
    for choice in [any_serial(), KnobChoice::Path(knob.path.clone())] {
        let second = linked(&places, "Track 2", choice);
        soon("held", || matches!(second.status().phase, Phase::HeldBy(who) if who.contains("Track 1")));
        assert!(knob.is_armed(), "looking on disturbs nobody");
        second.take_over();
        live(&second);
        assert!(matches!(first.status().phase, Phase::HeldBy(who) if who.contains("Track 2")));
        soon("disarmed", || !knob.is_armed());
        assert!(!second.status().armed);
        drop(second);
        // Who has let go comes back by itself once the knob is free, disarmed.
        live(&first);
        assert!(!knob.is_armed());
        first.arm(100);
        soon("armed", || knob.is_armed());
    }
}

#[test]
fn a_link_ends_when_dropped_whatever_it_is_doing() {
    let (_directory, places) = places();
    let stalled = PtyKnob::plug(None, &Setup::default());
    stalled.faults.stalled.store(true, Ordering::Relaxed);
    let living = PtyKnob::plug(Some(&places), &Setup::default());
    let choices = [
        KnobChoice::Off,
        KnobChoice::Path(stalled.path.clone()),
        KnobChoice::Path("/dev/not-there".into()),
        KnobChoice::Osc { port: free_port(), any_address: false },
        KnobChoice::Midi { name: Some("no such port".into()) },
        any_serial(),
    ];
    for choice in choices {
        let link = linked(&places, "test", choice.clone());
        match choice {
            KnobChoice::Serial { .. } => drop(live(&link)),
            _ => thread::sleep(Duration::from_millis(150)),
        }
        let begun = Instant::now();
        drop(link);
        assert!(begun.elapsed() < Duration::from_secs(5), "{choice:?}: {:?}", begun.elapsed());
    }
    soon("BYE", || said(&living, |m| matches!(m, Message::Bye { .. })) > 0);
}

#[test]
fn noise_on_the_line_costs_frames_and_nothing_else() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    knob.faults.noisy.store(true, Ordering::Relaxed);
    let (on_state, states) = recorder::<StateSample>();
    let (link, _reader) = KnobLink::spawn_in(places, "test", Hooks { on_state, ..Hooks::default() });
    link.choose(any_serial());
    live(&link);
    soon("damage is counted", || link.status().stats.wire.skipped_bytes > 1000);
    knob.faults.noisy.store(false, Ordering::Relaxed);
    let mut after = 0;
    while states.try_recv().is_ok() {}
    soon("and over", || {
        after += states.try_iter().count();
        after > 100
    });
    assert_eq!(link.status().phase, Phase::Live);
}

#[test]
fn another_major_version_is_read_and_never_armed() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup { major: 2, ..Setup::default() });
    let link = linked(&places, "test", any_serial());
    soon("said", || link.status().phase == Phase::VersionMismatch);
    assert!(link.status().text.contains("speaks TTLink 2.1, this program 1.1"), "{}", link.status().text);
    link.arm(100);
    soon("refused", || link.status().last_refusal.is_some_and(|why| why.contains("another version")));
    knob.counts.store(500, Ordering::Relaxed);
    soon("read", || link.status().angle_deg.is_some_and(|angle| (angle - 50.0).abs() < 0.1));
    assert_eq!(said(&knob, |m| !matches!(m, Message::Hello { .. })), 0, "nothing but HELLO is said to it");
}

#[test]
fn a_knob_that_starts_anew_or_stalls_is_back_disarmed() {
    let (_directory, places) = places();
    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let link = linked(&places, "test", any_serial());
    let _obeying = Obeying::of(&link);
    live(&link);
    link.arm(100);
    soon("armed", || link.status().armed);
    // Long enough on for the clock to show that it began again.
    thread::sleep(Duration::from_millis(300));
    knob.faults.reboot.store(true, Ordering::Relaxed);
    soon("told", || link.status().notice.is_some_and(|notice| notice.contains("has restarted")));
    live(&link);
    assert!(!link.status().armed && !knob.is_armed());

    link.arm(100);
    soon("armed", || link.status().armed);
    knob.faults.stalled.store(true, Ordering::Relaxed);
    soon("lost", || matches!(link.status().phase, Phase::Lost { .. }));
    knob.faults.stalled.store(false, Ordering::Relaxed);
    live(&link);
    thread::sleep(Duration::from_millis(300));
    assert!(!link.status().armed && !knob.is_armed());
}

#[test]
fn unmodified_firmware_at_the_serial_port_is_recognised_and_explained() {
    let (_directory, places) = places();
    let (mut knob, slave) = TTYPort::pair().unwrap();
    let path = PathBuf::from(slave.name().unwrap());
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    let firmware = thread::spawn(move || {
        knob.set_timeout(Duration::from_millis(5)).unwrap();
        let mut heard = Vec::new();
        while !stopped.load(Ordering::Relaxed) {
            let mut buffer = [0; 256];
            let Ok(length) = knob.read(&mut buffer) else { continue };
            heard.extend_from_slice(&buffer[..length]);
            if heard.ends_with(b"\nwhatareyou\n") {
                knob.write_all(b"<<<TorqueTuner_001>>>\r\n").unwrap();
            }
        }
        heard
    });
    let link = linked(&places, "test", KnobChoice::Path(path));
    soon(
        "recognised",
        || matches!(link.status().phase, Phase::StockSerial(name) if name == "TorqueTuner_001"),
    );
    assert!(link.status().text.contains("choose OSC"), "{}", link.status().text);
    drop(link);
    stop.store(true, Ordering::Relaxed);
    let heard = firmware.join().unwrap();
    assert!(!heard.windows(10).any(|window| window == b"readconfig"));
    drop(slave);
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

fn osc(name: &str, value: OscType) -> Vec<u8> {
    let addr = format!("/TorqueTuner_001/instrument/{name}");
    encoder::encode(&OscPacket::Message(OscMessage { addr, args: vec![value] })).unwrap()
}

#[test]
fn the_stock_firmwares_stream_plays_through_a_flood() {
    let (_directory, places) = places();
    let port = free_port();
    let (link, mut reader) = KnobLink::spawn_in(places, "test", Hooks::default());
    link.choose(KnobChoice::Osc { port, any_address: false });
    soon("listening", || link.status().phase == Phase::Waiting);
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    // As fast as one thread can: garbage, giants, and messages that are none of a knob's.
    let flood = thread::spawn(move || {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let giant = vec![b'#'; 60_000];
        let other = osc("nothing", OscType::Int(1));
        let mut sent = 0u64;
        while !stopped.load(Ordering::Relaxed) {
            for n in 0..100 {
                let packet = match n {
                    0 => &giant[..],
                    1..50 => &other[..],
                    _ => b"#bundle\0\0\0\0\0\0\0\0\x01\xff\xff\xff\xff",
                };
                sent += u64::from(socket.send_to(packet, ("127.0.0.1", port)).is_ok());
            }
            // A pause, or the kernel has no room for what the knob sends.
            thread::sleep(Duration::from_micros(500));
        }
        sent
    });
    let knob = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut heard = 0;
    let begun = Instant::now();
    for n in 0..50 {
        let _ = knob.send_to(&osc("velocity", OscType::Float(0.0)), ("127.0.0.1", port));
        let _ = knob.send_to(&osc("angle_out", OscType::Int(-900)), ("127.0.0.1", port));
        if n > 30 {
            let _ = knob.send_to(&osc("pluck", OscType::Int(1)), ("127.0.0.1", port));
        }
        thread::sleep(Duration::from_millis(40));
        reader.begin_block(1920, 48_000.0);
        heard += u32::from(reader.pose(0).is_some_and(|pose| (pose.angle_deg + 90.0).abs() < 0.01));
    }
    let seconds = begun.elapsed().as_secs_f64();
    stop.store(true, Ordering::Relaxed);
    let rate = flood.join().unwrap() as f64 / seconds;
    println!("{heard} of 50 blocks with breath under {rate:.0} packets/s");
    assert!(heard > 25, "{heard} of 50 blocks had a pose");
    assert!(reader.take_slap().is_some() && reader.take_slap().is_none(), "held, it is one slap");
    let status = link.status();
    assert_eq!((status.phase, status.tier), (Phase::ReadOnly, 0));
    assert!(status.text.contains("read-only, about 40 ms"), "{}", status.text);
    assert!(status.stats.ignored > 1000);
    link.arm(100);
    soon("refused", || link.status().last_refusal.is_some_and(|why| why.contains("only be read")));
    link.zero();
    soon("zero", || {
        let _ = knob.send_to(&osc("angle_out", OscType::Int(-900)), ("127.0.0.1", port));
        link.status().angle_deg.is_some_and(|angle| angle.abs() < 0.1)
    });
}

#[test]
fn over_midi_the_same_firmware_is_played_and_felt() {
    let (_directory, places) = places();
    let (host, mut port) = pair(Binding::Midi, "TorqueTuner MIDI");
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    let knob = thread::spawn(move || {
        let mut device = FirmwareKnob::new(Setup { midi: true, ..Setup::default() });
        let (begun, mut sent) = (Instant::now(), Vec::new());
        let mut was_armed = false;
        while !stopped.load(Ordering::Relaxed) {
            let mut heard = Vec::new();
            if port.poll(Duration::from_millis(1), &mut |chunk| heard.push(chunk.to_vec())).is_err() {
                break;
            }
            for message in heard {
                device.firmware.receive_midi(&message);
                sent.push(Instant::now());
            }
            device.counts = 777;
            device.run_until(begun.elapsed().as_micros() as u64);
            was_armed |= device.firmware.is_armed();
            let mut out = [0; 2048];
            let length = device.firmware.transmit(&mut out);
            let _ = port.send(&out[..length]);
        }
        was_armed
    });
    let feel = Feel { law: TorqueLaw::Pressure, scale_mnm: 30.0, ..Feel::default() };
    let (on_state, states) = recorder::<StateSample>();
    let (link, _reader) =
        KnobLink::spawn_in(places, "test", Hooks { feel: Box::new(move || Some(feel)), on_state });
    link.attach(Box::new(host));
    let _obeying = Obeying::of(&link);
    live(&link);
    soon("its angle", || link.status().angle_deg.is_some());
    soon("the feel is echoed", || states.try_iter().last().is_some_and(|state| state.feel_id != 0));
    link.arm(60);
    soon("armed", || link.status().armed);
    // Longer than the watchdog that a knob over MIDI has.
    thread::sleep(Duration::from_millis(600));
    assert!(link.status().armed, "{:?}", link.status().notice);
    drop(link);
    stop.store(true, Ordering::Relaxed);
    assert!(knob.join().unwrap());
}

/// A MIDI device that sends control changes alone, and hears nothing.
struct ControllersOnly(MemoryPort);

impl Transport for ControllersOnly {
    fn binding(&self) -> Binding {
        self.0.binding()
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        self.0.poll(wait, &mut |message| {
            if message[0] == 0xB0 {
                sink(message);
            }
        })
    }

    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }

    fn describe(&self) -> String {
        self.0.describe()
    }
}

/// From the simulated hand to the sound, all in this program: the firmware's MIDI messages, the link, the reader at the
/// pace of a sound card, breath, clarinet.
#[test]
fn over_midi_a_hand_on_the_knob_is_heard_with_and_without_sysex() {
    const RATE_HZ: f64 = 48_000.0;
    const BLOCK: usize = 128;
    let feels = InstrumentFeel::built_in().unwrap();
    let table = feels.table(&Settings::physical(), &FeelDesign::default(), &NO_MOTOR).unwrap();
    for is_plain in [false, true] {
        let (_directory, places) = places();
        let (device, host) = pair(Binding::Midi, "TorqueTuner MIDI");
        let setup = Setup { midi: true, ..Setup::default() };
        let knob = SimulatedKnob::new(
            setup,
            PlantDesign::default(),
            SimulatedHand::new(HandDesign::default(), 1),
            1,
        );
        let running = Server::new(knob, Port::Wire(Box::new(device))).spawn().unwrap();
        running.tell(Control::Aim(Aim::Angle(200.0)));
        let (link, mut reader) = KnobLink::spawn_in(places, "test", Hooks::default());
        link.attach(if is_plain { Box::new(ControllersOnly(host)) } else { Box::new(host) });
        let phase = if is_plain { Phase::ReadOnly } else { Phase::Live };
        soon("there", || link.status().phase == phase);

        let hand =
            BreathMapping { maps: feels.maps(&table), design: KnobDesign::default(), feels: !is_plain };
        let (mut blower, mut clarinet) = (Blower::default(), Clarinet::built_in(RATE_HZ).unwrap());
        clarinet.set_settings(&Settings::physical());
        let full_pa = 1e3 * f64::from(Settings::physical().breath_full_kpa);
        // The lowest note, written E3.
        let note = Event::NoteOn { note: SoundingNote(50), velocity: 0.8 };
        let mut host = Some(Timed { at: 0, event: note });
        let (mut heard, begun) = (Vec::new(), Instant::now());
        let (mut breath, mut angle_deg) = (0.0, 0.0);
        // Half a second in tune where the hand stays, however long a busy machine takes to come to it.
        soon("the note", || {
            for _ in 0..(0.5 * RATE_HZ) as usize / BLOCK {
                let due = begun + Duration::from_secs_f64(heard.len() as f64 / RATE_HZ);
                thread::sleep(due.saturating_duration_since(Instant::now()));
                reader.begin_block(BLOCK, RATE_HZ);
                let angle = |at: usize| {
                    angle_deg = f64::from(reader.pose(at)?.angle_deg);
                    Some(angle_deg)
                };
                let mut blown = |_: usize, value: Breath14| breath = value.unit();
                let events = BlownEvents::new(
                    host.take().into_iter(),
                    &mut blower,
                    &hand,
                    full_pa,
                    BLOCK,
                    angle,
                    &mut blown,
                );
                let mut block = [0.0; BLOCK];
                clarinet.render_events(events, &mut block);
                blower.advance(BLOCK);
                heard.extend(block);
            }
            let hz = fundamental_hz(&to_f64(&heard[heard.len() - 20_000..]), RATE_HZ);
            (angle_deg - 200.0).abs() < 2.0 && hz.is_some_and(|hz| cents(hz, 146.832).abs() < 20.0)
        });
        println!("plain {is_plain}: {angle_deg:.1} degrees, breath {breath:.3} after {:?}", begun.elapsed());
        assert!((0.4..0.95).contains(&breath), "breath {breath}");
        drop(link);
        assert!(running.finish().is_ok());
    }
}

/// Firmware and session in simulated time, with a line between them that does what it is told.
struct Bench {
    session: HostSession,
    device: FirmwareKnob,
    now_us: i64,
    born_us: i64,
    is_midi: bool,
    decoder: Decoder,
    to_knob: Vec<(i64, Message)>,
    sent_at_us: Vec<i64>,
    states: usize,
    period_us: u32,
}

impl Bench {
    fn new(binding: Binding) -> Self {
        let setup = Setup { midi: binding == Binding::Midi, ..Setup::default() };
        Self {
            session: HostSession::new(binding, 0xABCD, 0),
            device: FirmwareKnob::new(setup),
            now_us: 0,
            born_us: 0,
            is_midi: binding == Binding::Midi,
            decoder: Decoder::new(),
            to_knob: Vec::new(),
            sent_at_us: Vec::new(),
            states: 0,
            period_us: 0,
        }
    }

    /// A millisecond, in which `line` may damage what either says.
    fn tick(&mut self, mut line: impl FnMut(&mut Vec<u8>)) {
        self.now_us += 1000;
        self.session.obeyed(self.now_us, "the test");
        let (mut said, mut slaps) = (Vec::new(), 0);
        let send = &mut |wish: SessionOutput| {
            if let SessionOutput::Send(bytes) = wish {
                said.extend_from_slice(bytes);
                self.sent_at_us.push(self.now_us);
            }
        };
        self.session.poll(self.now_us, send, &mut |_| slaps += 1);
        let messages = self.decoder.feed(&said).flatten().map(|(_, message)| (self.now_us, message));
        self.to_knob.extend(messages);
        line(&mut said);
        match self.is_midi {
            true => self.device.firmware.receive_midi(&said),
            false => self.device.firmware.receive(&said),
        }
        self.device.run_until((self.now_us - self.born_us) as u64);
        let mut answer = self.device.transmit();
        line(&mut answer);
        let (states, period_us) = (&mut self.states, &mut self.period_us);
        self.session.receive(self.now_us, &answer, &mut |what| {
            if let SessionEvent::State(state) = what {
                (*states, *period_us) = (*states + 1, state.period_us);
            }
        });
    }

    fn run(&mut self, ms: usize) {
        (0..ms).for_each(|_| self.tick(|_| {}));
    }

    fn count(&self, what: impl Fn(&Message) -> bool) -> usize {
        self.to_knob.iter().filter(|(_, message)| what(message)).count()
    }
}

#[test]
fn rates_are_those_of_the_protocol_in_simulated_time() {
    let mut bench = Bench::new(Binding::Serial);
    bench.session.want_feel(Feel::default());
    bench.run(10_000);
    assert_eq!(bench.session.status(bench.now_us), SessionStatus::Live);
    let hellos = bench.count(|m| matches!(m, Message::Hello { .. }));
    assert!((5..=6).contains(&hellos), "{hellos} HELLO in 10 s: one, and one in two seconds");
    let alive = bench.count(|m| matches!(m, Message::Alive(_)));
    assert!((499..=502).contains(&alive), "{alive} ALIVE in 10 s");
    let feels = bench.count(|m| matches!(m, Message::Feel(_)));
    assert!((10..=12).contains(&feels), "{feels} FEEL in 10 s without a change");
    assert!((4980..=5002).contains(&bench.states), "{} STATE in 10 s", bench.states);
    assert_eq!((bench.session.stats().wire.gaps, bench.period_us), (0, 2000));
    for ms in 0..1000 {
        bench.session.want_feel(Feel { a_on_deg: ms as f32, ..Feel::default() });
        bench.tick(|_| {});
    }
    let feels = bench.count(|m| matches!(m, Message::Feel(_))) - feels;
    assert!((99..=101).contains(&feels), "{feels} FEEL in 1 s of change");
    assert_eq!(bench.count(|m| matches!(m, Message::Arm(_) | Message::Free)), 0);
}

#[test]
fn a_refused_feel_is_explained_and_not_repeated() {
    let mut bench = Bench::new(Binding::Serial);
    bench.run(500);
    // A wall of 100 mNm per degree is 5.7 N m/rad: beyond 2 b / T of the simulated knob.
    let steep =
        Feel { law: TorqueLaw::Pressure, wall_mnm_per_deg: 100.0, scale_mnm: 20.0, ..Feel::default() };
    bench.session.want_feel(steep);
    bench.run(3000);
    let why = bench.session.refusal().expect("a reason");
    assert!(why.contains("stiff"), "{why}");
    assert_eq!(bench.count(|m| matches!(m, Message::Feel(_))), 1);
    bench.session.want_feel(Feel { wall_mnm_per_deg: f32::NAN, ..steep });
    assert!(bench.session.refusal().is_some_and(|why| why.contains("wall_mnm_per_deg")));
    bench.run(100);
    assert_eq!(bench.count(|m| matches!(m, Message::Feel(_))), 1, "what has no sense is not sent at all");
}

/// A knob that has been turned since its power-up.
fn turned() -> Bench {
    let mut bench = Bench::new(Binding::Serial);
    bench.device.counts = 500;
    bench.run(300);
    bench.device.counts = 700;
    bench.run(50);
    bench
}

#[test]
fn zero_is_not_moved_under_an_armed_hand() {
    let mut bench = turned();
    bench.session.zero();
    bench.run(100);
    assert_eq!(bench.session.state().unwrap().angle, 0);
    bench.session.arm(100, false, bench.now_us);
    bench.run(100);
    bench.device.counts = 705; // further in one tick would be too fast
    bench.run(10);
    bench.session.zero();
    bench.run(100);
    assert_eq!(bench.session.state().unwrap().angle, 50, "0.01 degrees");
    assert!(bench.session.is_armed());
    assert!(bench.session.refusal().is_some_and(|why| why.contains("disarm it first")));
    bench.session.disarm(bench.now_us);
    bench.session.zero();
    bench.run(50);
    assert_eq!(bench.session.state().unwrap().angle, 0, "one after the other, at once");
}

#[test]
fn zero_and_arm_in_one_breath_zero_first() {
    let mut bench = turned();
    bench.session.zero();
    bench.session.arm(100, false, bench.now_us);
    bench.run(200);
    assert_eq!(bench.session.state().unwrap().angle, 0);
    assert!(bench.session.is_armed(), "{:?}", bench.session.refusal());
    // A zero that waits for an armed knob to let go is not caught up with after it is armed again.
    bench.device.counts = 705;
    bench.run(10);
    bench.session.disarm(bench.now_us);
    bench.session.zero();
    bench.session.arm(100, false, bench.now_us);
    bench.run(200);
    assert_eq!(bench.session.state().unwrap().angle, 50);
}

/// A line that loses ZERO, so many times.
fn without_zero(mut left: usize) -> impl FnMut(&mut Vec<u8>) {
    move |bytes| {
        let is_zero = |(_, message): (_, Message)| matches!(message, Message::Zero(_));
        if left > 0 && Decoder::new().feed(bytes).flatten().any(is_zero) {
            bytes.clear();
            left -= 1;
        }
    }
}

#[test]
fn a_zero_that_the_line_loses_is_said_again_and_arm_waits_for_it() {
    let zeros = |bench: &Bench| bench.count(|m| matches!(m, Message::Zero(_)));
    let arms = |bench: &Bench| bench.count(|m| matches!(m, Message::Arm(_)));
    let mut bench = turned();
    bench.session.zero();
    bench.session.arm(100, false, bench.now_us);
    let mut line = without_zero(2);
    (0..100).for_each(|_| bench.tick(&mut line));
    assert_eq!((zeros(&bench), arms(&bench)), (2, 0));
    assert_eq!(bench.session.state().unwrap().angle, 6900, "hundredths of a degree: where it was");
    (0..300).for_each(|_| bench.tick(&mut line));
    assert_eq!((zeros(&bench), arms(&bench)), (3, 1));
    assert_eq!(bench.session.state().unwrap().angle, 0);
    assert!(bench.session.is_armed(), "{:?}", bench.session.refusal());

    // A knob that never takes it is not armed.
    let mut bench = turned();
    bench.session.zero();
    bench.session.arm(100, false, bench.now_us);
    let mut line = without_zero(usize::MAX);
    (0..1000).for_each(|_| bench.tick(&mut line));
    assert_eq!((zeros(&bench), arms(&bench)), (4, 0));
    assert!(!bench.session.is_armed());
    assert!(bench.session.refusal().is_some_and(|why| why.contains("has not taken its new zero")));
    bench.session.arm(100, false, bench.now_us);
    bench.run(300);
    assert!(bench.session.is_armed(), "the user has another go: {:?}", bench.session.refusal());
}

#[test]
fn alive_allows_no_torque_while_nobody_wants_any() {
    let mut bench = Bench::new(Binding::Serial);
    let allowing =
        |bench: &Bench| bench.count(|m| matches!(m, Message::Alive(alive) if alive.ceiling_mnm > 0));
    bench.run(500);
    assert!(bench.count(|m| matches!(m, Message::Alive(_))) > 10 && allowing(&bench) == 0);
    bench.session.arm(100, false, bench.now_us);
    bench.run(500);
    assert!(bench.session.is_armed() && allowing(&bench) > 10);
    bench.session.disarm(bench.now_us);
    let before = allowing(&bench);
    bench.run(500);
    assert_eq!(allowing(&bench), before);
    // Another act allows as much as it says.
    bench.session.arm(60, false, bench.now_us);
    bench.run(500);
    assert!(bench.session.is_armed() && bench.session.ceiling_mnm() == 60);
    assert!(bench.count(|m| matches!(m, Message::Alive(alive) if alive.ceiling_mnm == 60)) > 10);
}

/// 300 lives of a knob with a bad line, a host that stalls and a supply that fails: once disarmed, always disarmed.
#[test]
fn no_fault_ever_arms_a_knob() {
    let mut dice = 0x9E37_79B9_7F4A_7C15u64;
    let mut roll = move |sides: u64| {
        dice ^= dice << 13;
        dice ^= dice >> 7;
        dice ^= dice << 17;
        dice % sides
    };
    let (mut armed_lives, mut disarmed_lives) = (0, 0);
    for life in 0..300 {
        let mut bench = Bench::new(Binding::Serial);
        bench.session.want_feel(Feel { law: TorqueLaw::Flow, scale_mnm: 40.0, ..Feel::default() });
        bench.run(300);
        bench.session.arm(100, false, bench.now_us);
        bench.run(100);
        armed_lives += u32::from(bench.device.firmware.is_armed());
        let arms = bench.count(|m| matches!(m, Message::Arm(_)));
        let mut was_disarmed = false;
        for _ in 0..8 {
            let (fault, length) = (roll(6), 20 + roll(400));
            for ms in 0..length {
                match fault {
                    0 => bench.tick(|bytes| bytes.clear()),
                    1 => bench.tick(|bytes| bytes.iter_mut().for_each(|byte| *byte ^= (roll(8) == 0) as u8)),
                    2 => bench.tick(|bytes| drop(bytes.drain(..roll(bytes.len() as u64 + 1) as usize))),
                    3 => bench.tick(|bytes| bytes.extend_from_within(..)),
                    4 if ms == 0 => {
                        bench.device.reboot();
                        bench.born_us = bench.now_us;
                    }
                    5 => bench.now_us += 1000, // this program stalls; the knob lives on
                    _ => bench.run(1),
                }
                let is_armed = bench.device.firmware.is_armed();
                assert!(!(was_disarmed && is_armed), "life {life}: armed by fault {fault}");
                was_disarmed |= !is_armed;
            }
        }
        bench.run(1000);
        disarmed_lives += u32::from(was_disarmed);
        assert_eq!(bench.count(|m| matches!(m, Message::Arm(_))), arms, "life {life}");
        assert_eq!(bench.session.status(bench.now_us), SessionStatus::Live, "life {life} recovers");
        assert_eq!(bench.session.is_armed(), bench.device.firmware.is_armed(), "life {life}");
    }
    assert!(armed_lives == 300 && disarmed_lives > 200, "{armed_lives}, {disarmed_lives}");
}

#[test]
fn a_midi_knob_whose_answer_is_late_is_not_taken_for_a_plain_one() {
    let mut bench = Bench::new(Binding::Midi);
    for ms in 0..1000 {
        bench.device.counts += 1;
        // The first HELLO is lost, and controllers arrive alone.
        bench.tick(|line| {
            if ms < 100 && line.first() == Some(&0xF0) {
                line.clear();
            }
        });
        assert_ne!(bench.session.status(bench.now_us), SessionStatus::PlainMidi, "{ms} ms");
        assert!(ms != 100 || bench.states > 0, "its breath is heard all the same");
    }
    assert_eq!(bench.session.status(bench.now_us), SessionStatus::Live);
}

#[test]
fn over_midi_frames_leave_20_ms_between_them() {
    let mut bench = Bench::new(Binding::Midi);
    bench.run(10);
    for ms in 0..2000 {
        bench.session.want_feel(Feel { a_on_deg: ms as f32, ..Feel::default() });
        bench.tick(|_| {});
    }
    assert_eq!(bench.session.status(bench.now_us), SessionStatus::Live);
    let expected_us = 2_000_000 / bench.states as u32;
    assert!(bench.period_us.abs_diff(expected_us) <= 500, "{} us, {expected_us}", bench.period_us);
    bench.session.arm(100, false, bench.now_us);
    bench.run(100);
    assert!(bench.session.is_armed());
    bench.session.disarm(bench.now_us);
    bench.run(100);
    assert!(!bench.device.firmware.is_armed());
    let closest = bench.sent_at_us.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap();
    assert!(
        bench.sent_at_us.len() > 80 && closest >= 20_000,
        "{closest} us, {} frames",
        bench.sent_at_us.len()
    );
}

/// What `chalumeau doctor` prints, with what is told to it by the environment and its arguments.
fn doctor(directory: &TempDir, args: &[&str], code: i32) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .env("CHALUMEAU_RUNTIME_DIR", directory.path())
        .arg("doctor")
        .args(args)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn doctor_tells_what_answers_and_what_to_do_when_nothing_does() {
    let (directory, places) = places();
    let nothing = doctor(&directory, &["--seconds", "1"], 1);
    for say in ["Serial ports", "MIDI ports", "No knob answers", "chalumeau knob-sim", "docs/touch.md"] {
        assert!(nothing.contains(say), "{say:?} in {nothing}");
    }
    let missing = doctor(&directory, &["--path", "/dev/not-there"], 1);
    assert!(missing.contains("/dev/not-there is not there: is the knob plugged in?"), "{missing}");
    let silence = doctor(&directory, &["--osc", &free_port().to_string(), "--seconds", "1"], 1);
    assert!(silence.contains("nothing received") && silence.contains("192.168.4.2"), "{silence}");

    let knob = PtyKnob::plug(Some(&places), &Setup::default());
    let found = doctor(&directory, &["--seconds", "2"], 0);
    for say in [
        "simulated: test, 000000005eed0001",
        "Chalumeau sim",
        "tier 2",
        "firmware ",
        "jitter",
        "FEEL to its echo",
        "link: ",
    ] {
        assert!(found.contains(say), "{say:?} in {found}");
    }
    assert!(!found.contains("not seen") && !found.contains("No knob answers"), "{found}");
    assert_eq!(said(&knob, |m| matches!(m, Message::Arm(_))), 0);
    println!("{found}");
    let owner = linked(&places, "Track 1", any_serial());
    live(&owner);
    let held = doctor(&directory, &["--path", knob.path.to_str().unwrap()], 1);
    assert!(held.contains("in use by Track 1"), "{held}");
}
