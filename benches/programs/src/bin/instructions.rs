//! Holds one note and prints a checksum of its samples, nothing else: the program to count instructions of.
//!
//! `cargo run --release -p chalumeau-benches --bin instructions -- SECONDS [RATE] [avx2|plain] [BEND] [watched] [point|places] [PLAYERS] [chord]`
//!
//! Written C4 at breath 0.5 of full scale; `plain` keeps off AVX2, a bend is in cents, and `watched` takes pictures of
//! the inside and copies pictures and sound away, as while the plugin's window is open. It is heard from everywhere, or from
//! one point, or from two places in two channels. Several players play it in unison, or each a note of its own. What comes after the
//! first 0.5 s is played by `hold_the_note`, which `benches/instructions.sh` has callgrind count alone. `benches/peers/run.sh` takes the
//! difference of two run lengths, so that building the instrument cancels, and the thread's CPU time, which is printed where Linux tells it.

use std::error::Error;
use std::hint::black_box;

use chalumeau_core::event::{Event, PartEvent, To};
use chalumeau_core::instrument::scope::{SCOPE_SAMPLES, ScopeSample};
use chalumeau_core::instrument::{
    Channels, Clarinet, Ensemble, Listening, ListeningMode, Players, Settings, Split, Techniques, Tract,
};
use chalumeau_core::units::WrittenNote;

/// Samples per call, as a host at a common setting would ask for.
const BLOCK: usize = 64;
/// What is not held yet, s.
const ATTACK_S: f64 = 0.5;

/// CPU time of this thread so far, ns; `None` where the kernel does not tell.
///
/// The kernel brings the figure up to date at its own ticks, or when the thread leaves the processor: hence the nap.
fn thread_cpu_ns() -> Option<f64> {
    std::thread::sleep(std::time::Duration::from_micros(100));
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok()
}

/// What a screen is told of a block.
struct Screen {
    heard: [f32; BLOCK],
    moments: [ScopeSample; SCOPE_SAMPLES],
    /// Number of the last picture.
    shown: u64,
}

impl Screen {
    fn see(&mut self, clarinet: &Clarinet, block: &[f32; BLOCK]) {
        self.heard.copy_from_slice(black_box(block));
        let picture = clarinet.scope().capture().filter(|&(number, _)| number != self.shown);
        if let Some((number, moments)) = picture {
            self.shown = number;
            self.moments.copy_from_slice(black_box(moments));
        }
    }
}

/// A lone player, without the others that an ensemble keeps ready, or several.
enum Who {
    One(Box<Clarinet>),
    Several(Box<Ensemble>),
}

impl Who {
    fn new(rate_hz: f64, count: i32, plain: bool) -> Result<Self, Box<dyn Error>> {
        if count > 1 {
            let ensemble = Ensemble::built_in(rate_hz)?;
            let ensemble = if plain { ensemble.without_avx2() } else { ensemble };
            return Ok(Self::Several(Box::new(ensemble)));
        }
        let clarinet = Clarinet::built_in(rate_hz)?;
        Ok(Self::One(Box::new(if plain { clarinet.without_avx2() } else { clarinet })))
    }

    fn set_settings(&mut self, settings: &Settings) {
        match self {
            Self::One(clarinet) => clarinet.set_settings(settings),
            Self::Several(ensemble) => ensemble.set_settings(settings),
        }
    }

    fn apply(&mut self, event: PartEvent) {
        match self {
            Self::One(clarinet) => clarinet.apply(event.event),
            Self::Several(ensemble) => ensemble.apply(event),
        }
    }

    fn set_scope_on(&mut self, on: bool) {
        match self {
            Self::One(clarinet) => clarinet.set_scope_on(on),
            Self::Several(ensemble) => ensemble.set_scope_on(on),
        }
    }

    fn render(&mut self, out: Channels) {
        match self {
            Self::One(clarinet) => clarinet.render_channels(out),
            Self::Several(ensemble) => ensemble.render_channels(out),
        }
    }

    fn first(&self) -> &Clarinet {
        match self {
            Self::One(clarinet) => clarinet,
            Self::Several(ensemble) => ensemble.first(),
        }
    }
}

/// Somebody plays and somebody listens.
struct Heard {
    who: Who,
    stereo: bool,
    screen: Option<Screen>,
    block: [f32; BLOCK],
    right: [f32; BLOCK],
    checksum: u32,
}

impl Heard {
    fn play(&mut self, blocks: usize) {
        let (block, right) = (&mut self.block, &mut self.right);
        for _ in 0..blocks {
            self.who.render(if self.stereo { Channels::two(block, right) } else { Channels::one(block) });
            if let Some(screen) = &mut self.screen {
                screen.see(self.who.first(), block);
            }
            self.checksum =
                block.iter().fold(self.checksum, |sum, sample| sum.rotate_left(5) ^ sample.to_bits());
        }
    }

    /// All but the attack. A function of its own, under a name of its own, so that callgrind can count it alone.
    #[inline(never)]
    fn hold_the_note(&mut self, blocks: usize) {
        self.play(blocks);
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let seconds: f64 = arguments
        .next()
        .ok_or("usage: instructions SECONDS [RATE] [avx2|plain] [BEND] [watched] [point|places] [PLAYERS] [chord|techniques]")?
        .parse()?;
    let rate_hz: f64 = arguments.next().as_deref().unwrap_or("48000").parse()?;
    let plain = arguments.next().is_some_and(|word| word == "plain");
    let bend_cents: f32 = arguments.next().as_deref().unwrap_or("0").parse()?;
    let watched = arguments.next().is_some_and(|word| word == "watched");
    let mode = match arguments.next().as_deref() {
        Some("point") => ListeningMode::Point,
        Some("places") => ListeningMode::Position,
        _ => ListeningMode::Everywhere,
    };
    let count: i32 = arguments.next().as_deref().unwrap_or("1").parse()?;
    let how = arguments.next();
    let chord = how.as_deref() == Some("chord");
    // A player who growls through a vocal tract that is half tuned to the note.
    let voicing = if how.as_deref() == Some("techniques") { 0.5 } else { 0.0 };
    let blocks = (seconds * rate_hz / BLOCK as f64).round() as usize;

    let listening = Listening { mode, ..Listening::default() };
    let split = if chord { Split::Chords } else { Split::Unison };
    let players = Players { count, split, ..Players::default() };
    let mut who = Who::new(rate_hz, count, plain)?;
    let techniques = Techniques { growl: voicing, ..Techniques::default() };
    let tract = Tract { amount: voicing, ..Tract::default() };
    who.set_settings(&Settings { listening, players, techniques, tract, ..Settings::default() });
    who.apply(Event::Bend { cents: bend_cents }.into());
    who.apply(Event::Breath(0.5).into());
    // In unison each event is for all of them: one note is enough.
    for player in 0..if chord { count as u8 } else { 1 } {
        let written = if chord { 55 + 3 * player } else { 60 };
        let note = WrittenNote(written).sounding(2).ok_or("no such note")?;
        who.apply(PartEvent { to: To::Player(player), event: Event::NoteOn { note, velocity: 0.8 } });
    }
    who.set_scope_on(watched);
    let screen = Screen { heard: [0.0; BLOCK], moments: [ScopeSample::default(); SCOPE_SAMPLES], shown: 0 };
    let mut heard = Heard {
        who,
        stereo: mode == ListeningMode::Position,
        screen: watched.then_some(screen),
        block: [0.0; BLOCK],
        right: [0.0; BLOCK],
        checksum: 0,
    };
    let start = thread_cpu_ns();
    let attack = blocks.min((ATTACK_S * rate_hz / BLOCK as f64).round() as usize);
    heard.play(attack);
    heard.hold_the_note(blocks - attack);
    let (end, checksum) = (thread_cpu_ns(), heard.checksum);

    let samples = blocks * BLOCK;
    print!("chalumeau samples {samples} checksum {checksum:08x}");
    match start.zip(end) {
        Some((start, end)) if samples > 0 => println!(" ns_per_sample {:.2}", (end - start) / samples as f64),
        _ => println!(),
    }
    Ok(())
}
