//! Plays for `cargo xtask perf`, which counts the instructions of what this does and reads what it prints.
//!
//! `growth cost SECONDS [voices=8] [rate=48000] [holes=12] [length=1.5] [bend=100] [written=60]` holds a note at mezzo-forte: so many players in
//! unison, on an instrument with so many holes or so much larger, bent by so many cents. An altered instrument is cut, neither fitted
//! nor tuned: that changes what it sounds like, not what it costs.
//!
//! `growth blocks COUNT [voices=8] [rate=48000] [times=3]` plays random notes and automation in blocks of 64 frames, each under the
//! thread's own clock. It plays the same piece several times, and the least time of each block counts.
//!
//! `growth memory` tells how much memory a player takes.

use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::event::{Event, PartEvent, SettingNumber, To};
use chalumeau_core::instrument::player::dynamics::MEZZO_FORTE;
use chalumeau_core::instrument::{
    Channels, Clarinet, Ensemble, MOST_PLAYERS, Model, Players, Preparation, Settings, Split, Wanted,
};
use chalumeau_core::units::{SoundingNote, WrittenNote};

/// Samples per call, as a host at a common setting would ask for.
const BLOCK: usize = 64;
/// Most events of a block.
const EVENTS: usize = 4;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Words like `voices=8`.
struct Words(Vec<String>);

impl Words {
    fn number(&self, name: &str, usual: f64) -> Outcome<f64> {
        let value = self.0.iter().find_map(|word| word.strip_prefix(name)?.strip_prefix('='));
        Ok(value.map_or(Ok(usual), str::parse)?)
    }
}

/// CPU time of this thread so far, ns.
///
/// The kernel brings the figure up to date at its own ticks, or when the thread leaves the processor: hence the nap.
fn thread_cpu_ns() -> Outcome<f64> {
    std::thread::sleep(Duration::from_micros(50));
    let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
    Ok(text.split_whitespace().next().unwrap_or_default().parse()?)
}

/// Memory of this process that is in use, bytes.
fn resident_bytes() -> Outcome<f64> {
    let text = std::fs::read_to_string("/proc/self/status")?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    Ok(1_024.0 * line.trim().trim_end_matches(" kB").parse::<f64>()?)
}

/// The built-in clarinet with so many holes: the uppermost are left out, or more are bored where most room is.
fn with_holes(count: usize) -> InstrumentFile {
    let mut file = InstrumentFile::built_in();
    file.holes.drain(..file.holes.len().saturating_sub(count));
    while file.holes.len() < count {
        let room = |at: &usize| file.holes[at + 1].x_m - file.holes[*at].x_m;
        let widest = (0..file.holes.len() - 1).max_by(|a, b| room(a).total_cmp(&room(b))).unwrap_or_default();
        let mut hole = file.holes[widest].clone();
        hole.x_m += 0.5 * room(&widest);
        file.holes.insert(widest + 1, hole);
    }
    for fingering in &mut file.fingerings {
        fingering.open.resize(count, false);
        fingering.maker_open = None;
    }
    file
}

fn model(words: &Words, rate_hz: f64) -> Outcome<Arc<Model>> {
    let (holes, length) = (words.number("holes", 0.0)? as usize, words.number("length", 1.0)?);
    if holes == 0 && length == 1.0 {
        return Ok(Arc::new(Model::built_in(rate_hz)?));
    }
    let file = if holes == 0 { InstrumentFile::built_in() } else { with_holes(holes) };
    Ok(Arc::new(Preparation::new(&Wanted::new(file.scaled(length), rate_hz), None).rough()?))
}

fn cost(words: &Words) -> Outcome<()> {
    let seconds: f64 = words.0.get(1).ok_or("cost takes a number of seconds")?.parse()?;
    let (rate_hz, voices) = (words.number("rate", 48_000.0)?, words.number("voices", 1.0)? as i32);
    let bend = Event::Bend { cents: words.number("bend", 0.0)? as f32 };
    let model = model(words, rate_hz)?;
    let written = WrittenNote(words.number("written", 60.0)? as u8);
    let note = written.sounding(model.file.transposition).ok_or("no such note")?;
    let on = Event::NoteOn { note, velocity: 0.8 };
    let players = Players { count: voices, split: Split::Unison, ..Players::default() };
    let settings = Settings { players, ..Settings::default() };
    // A lone player without the others that an ensemble keeps ready.
    let mut alone = (voices == 1).then(|| Clarinet::new(model.clone(), rate_hz));
    let mut several = (voices > 1).then(|| Ensemble::new(model, rate_hz));
    for event in [bend, Event::Breath(MEZZO_FORTE as f32), on] {
        if let Some(clarinet) = &mut alone {
            clarinet.set_settings(&settings);
            clarinet.apply(event);
        }
        if let Some(ensemble) = &mut several {
            ensemble.set_settings(&settings);
            ensemble.apply(event.into());
        }
    }
    let mut block = [0.0; BLOCK];
    let blocks = (seconds * rate_hz / BLOCK as f64).round() as usize;
    let begin = thread_cpu_ns()?;
    for _ in 0..blocks {
        alone.iter_mut().for_each(|clarinet| clarinet.render(&mut block));
        several.iter_mut().for_each(|ensemble| ensemble.render(&mut block));
        black_box(&block);
    }
    let ns = thread_cpu_ns()? - begin;
    let samples = blocks * BLOCK;
    println!(
        "samples {samples} ns {:.2} level {:.5}",
        ns / samples as f64,
        block.iter().fold(0.0_f32, |a, x| a.max(x.abs()))
    );
    Ok(())
}

/// Random numbers in 0..1: the generator of the breath noise.
struct Chance(u64);

impl Chance {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// Something that a musician or a host's automation does.
    fn event(&mut self, voices: u8) -> PartEvent {
        let note = SoundingNote(50 + (38.0 * self.unit()) as u8);
        let event = match (12.0 * self.unit()) as u8 {
            0..=2 => Event::NoteOn { note, velocity: self.unit() },
            3..=4 => Event::NoteOff { note },
            5..=6 => Event::Breath(self.unit()),
            7 => Event::Bend { cents: 400.0 * self.unit() - 200.0 },
            8 => Event::Set(SettingNumber::Zeta, 0.15 + 0.3 * self.unit()),
            9 => Event::Set(SettingNumber::Lip, self.unit()),
            10 => Event::Set(SettingNumber::Noise, self.unit()),
            _ => Event::TongueSlap { strength: self.unit() },
        };
        PartEvent { to: To::Player((f32::from(voices) * self.unit()) as u8), event }
    }
}

/// Thread time of each block of a random piece, us. The piece is the same each time.
fn piece(count: usize, rate_hz: f64, voices: u8) -> Outcome<Vec<f64>> {
    let mut ensemble = Ensemble::built_in(rate_hz)?;
    let players = Players { count: i32::from(voices), split: Split::Chords, ..Players::default() };
    ensemble.set_settings(&Settings { players, ..Settings::default() });
    let (mut left, mut right) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut chance = Chance(1);
    let watch = |work: &mut dyn FnMut()| -> Outcome<f64> {
        let begin = thread_cpu_ns()?;
        work();
        Ok(1e-3 * (thread_cpu_ns()? - begin))
    };
    // What the clock itself costs: the least of many, since all else that interrupts only adds.
    let mut clock_us = f64::INFINITY;
    for _ in 0..1_000 {
        clock_us = clock_us.min(watch(&mut || ())?);
    }
    let mut times_us = Vec::with_capacity(count);
    for _ in 0..count {
        let events = (EVENTS as f32 * chance.unit() * chance.unit()) as usize;
        times_us.push(
            watch(&mut || {
                (0..events).for_each(|_| ensemble.apply(chance.event(voices)));
                ensemble.render_channels(Channels::two(&mut left, &mut right));
                black_box((&left, &right));
            })? - clock_us,
        );
    }
    Ok(times_us)
}

fn blocks(words: &Words) -> Outcome<()> {
    let count: usize = words.0.get(1).ok_or("blocks takes a number of blocks")?.parse()?;
    if count == 0 {
        return Err("blocks takes a number of blocks from 1, got 0".into());
    }
    let (rate_hz, voices) = (words.number("rate", 48_000.0)?, words.number("voices", 8.0)? as u8);
    let mut least_us = piece(count, rate_hz, voices)?;
    for _ in 1..words.number("times", 3.0)? as usize {
        // Other programs only add time, and seldom to the same block twice: the least of a block is what it takes itself.
        let again_us = piece(count, rate_hz, voices)?;
        least_us.iter_mut().zip(again_us).for_each(|(least, again)| *least = least.min(again));
    }
    least_us.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| least_us[((count - 1) as f64 * share) as usize];
    let deadline_us = 1e6 * BLOCK as f64 / rate_hz;
    println!(
        "blocks {count} deadline_us {deadline_us:.1} median_us {:.1} of_1000_us {:.1} worst_us {:.1}",
        at(0.5),
        at(0.999),
        at(1.0)
    );
    Ok(())
}

fn memory() -> Outcome<()> {
    let model = Arc::new(Model::built_in(48_000.0)?);
    // What all share is there before.
    let first = Ensemble::new(model.clone(), 48_000.0);
    let begin = resident_bytes()?;
    let more: Vec<Ensemble> = (0..8).map(|_| Ensemble::new(model.clone(), 48_000.0)).collect();
    let bytes = (resident_bytes()? - begin) / (more.len() * MOST_PLAYERS) as f64;
    println!("voice_bytes {bytes:.0}");
    drop((first, more));
    Ok(())
}

fn main() -> Outcome<()> {
    let words = Words(std::env::args().skip(1).collect());
    match words.0.first().map(String::as_str) {
        Some("cost") => cost(&words),
        Some("blocks") => blocks(&words),
        Some("memory") => memory(),
        _ => Err("usage: growth cost SECONDS [..] | blocks COUNT [..] | memory".into()),
    }
}
