//! How long it takes from the knob to the sound, measured: a simulated knob in a hand on a pseudo-terminal, the link, the
//! reader and the clarinet at the pace of a sound card with blocks of 128 frames.
//!
//! `cargo run --release --no-default-features --features simulator --example latency -- [seconds]`
//!
//! Two parts are measured and added. *Knob to breath*: for every point of the breath's grid, the time since the knob stood
//! at the angle that is blown there; the sample's time is that of its place in the sound, not when its block was asked for.
//! *Breath to sound*: two renders that are the same to the bit until a step of breath; where they first differ by -60 dB of
//! the note. The sound card's own buffer comes on top.

use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use chalumeau_core::event::{Event, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::{Clarinet, Settings};
use chalumeau_core::units::SoundingNote;
use chalumeau_firmware::Setup;
use chalumeau_knob::device::{Hooks, KnobChoice, KnobLink, Phase, RuntimeDir};
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::SimulatedKnob;
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::simulator::script::Script;
use chalumeau_knob::simulator::serve::{Port, Server};
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, BreathMapping, GRID};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};

const RATE_HZ: f64 = 48_000.0;
const BLOCK: usize = 128;
const NOTE: SoundingNote = SoundingNote(58);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seconds: f64 = std::env::args().nth(1).map_or(Ok(20.0), |text| text.parse())?;
    let folder = tempfile::tempdir()?;

    // The knob, in a thread of its own, with its angle at the time of this machine.
    let script = Script::parse_crescendo("60:220:0.6")?.repeated();
    let mut hand = SimulatedHand::new(HandDesign::default(), 1);
    hand.follow(script);
    let knob = SimulatedKnob::new(Setup::default(), PlantDesign::default(), hand, 1);
    let mut server = Server::new(knob, Port::Serial(Some(chalumeau_knob::simulator::pty::Pty::open()?)));
    let path = server.path().ok_or("the knob has no port")?.to_owned();
    let (tell, told) = channel();
    let end = Instant::now() + Duration::from_secs_f64(seconds + 3.0);
    let worker = std::thread::spawn(move || {
        server.run(|server| {
            let now = Instant::now();
            // A closed channel only means that nobody measures any more.
            let _ = tell.send((now, server.knob().angle_deg()));
            now < end
        })
    });

    let feels = InstrumentFeel::built_in()?;
    let settings = Settings::physical();
    let table = feels.table(&settings, &FeelDesign::default(), &NO_MOTOR)?;
    let hand = BreathMapping { maps: feels.maps(&table), design: KnobDesign::default(), feels: true };
    let feel = table.reference().feel;
    let hooks = Hooks { feel: Box::new(move || Some(feel)), ..Hooks::default() };
    let (link, mut reader) = KnobLink::spawn_in(RuntimeDir::within(folder.path()), "latency", hooks);
    link.choose(KnobChoice::Path(path));
    while link.status().phase != Phase::Live {
        std::thread::sleep(Duration::from_millis(10));
    }

    let mut clarinet = Clarinet::built_in(RATE_HZ)?;
    clarinet.set_settings(&settings);
    let (mut blower, mut out) = (Blower::default(), [0.0; BLOCK]);
    let mut first = Some(Timed { at: 0, event: Event::NoteOn { note: NOTE, velocity: 0.8 } });
    let mut blown: Vec<(Instant, f64)> = Vec::new();
    let (mut late, began) = (0_u32, Instant::now());
    let blocks = (seconds * RATE_HZ / BLOCK as f64) as u32;
    for block in 0..blocks {
        let due = began + Duration::from_secs_f64(f64::from(block) * BLOCK as f64 / RATE_HZ);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        late += u32::from(due.elapsed() > Duration::from_secs_f64(BLOCK as f64 / RATE_HZ));
        reader.begin_block(BLOCK, RATE_HZ);
        let angle = |at: usize| {
            let angle = f64::from(reader.pose(at)?.angle_deg);
            blown.push((due + Duration::from_secs_f64(at as f64 / RATE_HZ), angle));
            Some(angle)
        };
        let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
        let mut ignore = |_, _| {};
        let host = first.take().into_iter();
        clarinet.render_events(
            BlownEvents::new(host, &mut blower, &hand, full_pa, BLOCK, angle, &mut ignore),
            &mut out,
        );
        blower.advance(BLOCK);
    }
    let stats = link.status().stats;
    drop(link);
    let turned: Vec<(Instant, f64)> = told.iter().collect();
    worker.join().map_err(|_| "the knob panicked")??;

    let mut delays_ms = delays_ms(&turned, &blown);
    delays_ms.sort_by(f64::total_cmp);
    let at = |share: f64| {
        delays_ms.get((share * (delays_ms.len().max(1) - 1) as f64) as usize).copied().unwrap_or(f64::NAN)
    };
    println!(
        "{} points in {seconds} s, blocks of {BLOCK}, grid of {GRID}; {late} of {blocks} blocks began late",
        delays_ms.len()
    );
    println!("knob to breath   p1 {:.2} ms, p50 {:.2} ms, p99 {:.2} ms", at(0.01), at(0.5), at(0.99));
    let heard_ms = breath_to_sound_ms()?;
    println!("breath to sound  {heard_ms:.2} ms");
    println!("knob to sound    p50 {:.2} ms, p99 {:.2} ms", at(0.5) + heard_ms, at(0.99) + heard_ms);
    println!("link             {stats:?}");
    Ok(())
}

/// For each angle that was blown, the time since the knob stood there.
fn delays_ms(turned: &[(Instant, f64)], blown: &[(Instant, f64)]) -> Vec<f64> {
    let mut delays = Vec::new();
    for &(when, angle) in blown {
        // The latest crossing of that angle before, where the knob was moving fast enough to tell.
        let until = turned.partition_point(|&(t, _)| t <= when);
        let recent = &turned[until.saturating_sub(60)..until];
        let crossing = recent.windows(2).rev().find(|pair| {
            let (low, high) = (pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1));
            (low..=high).contains(&angle) && (high - low) > 0.05
        });
        if let Some([(t0, a0), (t1, a1)]) = crossing.map(|pair| [pair[0], pair[1]]) {
            let share = (angle - a0) / (a1 - a0);
            let then = t0 + (t1 - t0).mul_f64(share.clamp(0.0, 1.0));
            delays.push(1e3 * (when - then).as_secs_f64());
        }
    }
    delays
}

/// From a step of breath to the first sample that is another by -60 dB of the note's peak, ms.
fn breath_to_sound_ms() -> Result<f64, Box<dyn std::error::Error>> {
    let at = RATE_HZ as usize;
    let render = |step: Option<f32>| -> Result<Vec<f32>, Box<dyn std::error::Error>> {
        let mut clarinet = Clarinet::built_in(RATE_HZ)?;
        let mut out = vec![0.0; at + 4_800];
        let on = [Event::Breath(0.5), Event::NoteOn { note: NOTE, velocity: 0.8 }];
        let events = on.map(|event| Timed { at: 0, event }).into_iter();
        clarinet
            .render_events(events.chain(step.map(|unit| Timed { at, event: Event::Breath(unit) })), &mut out);
        Ok(out)
    };
    let (steady, stepped) = (render(None)?, render(Some(0.6))?);
    let peak = steady[at / 2..at].iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
    let first =
        (at..steady.len()).find(|&n| (steady[n] - stepped[n]).abs() > 1e-3 * peak).ok_or("no change")?;
    Ok(1e3 * (first - at) as f64 / RATE_HZ)
}
