//! Renders stay the same to the bit: the example melody and 200 random scores blown with a physical breath, and the melody
//! and 20 of the scores as a player plays them, at three host rates.
//!
//! `tests/golden/renders.tsv` holds one SHA-256 prefix for each rendering. A change of sound that is meant is written by
//! `UPDATE_GOLDEN=1 cargo test --test render_hashes` and named in CHANGELOG.md.

use std::convert::Infallible;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::prepare::{Preparation, Wanted};
use chalumeau_core::instrument::{
    BreathResponse, Clarinet, Listening, ListeningMode, Quality, Settings, Tuning,
};
use chalumeau_core::score::Score;
use chalumeau_core::score::{midi_file, play, play_stereo};
use chalumeau_core::units::SoundingNote;
use sha2::{Digest, Sha256};

#[path = "support/parallel.rs"]
mod parallel;
#[path = "support/part.rs"]
mod part;

/// Host rates, Hz.
const RATES_HZ: [u32; 3] = [44_100, 48_000, 96_000];
/// Random scores.
const SCORES: u64 = 200;
/// Random scores that are heard in other ways than from one point.
const LISTENED_SCORES: u64 = 20;
/// Random scores that are also played with a player's breath.
const PLAYED_SCORES: u64 = 20;
/// Length of a random score, s.
const SECONDS: f64 = 0.8;
/// Hex digits kept of a hash: 64 bits.
const DIGITS: usize = 16;

/// SplitMix64 (Steele, Lea, Flood, 2014): the same numbers on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From `low` to `high`, in 2^24 steps.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * ((self.next() >> 40) as f32 / (1_u32 << 24) as f32)
    }

    fn below(&mut self, count: u64) -> u64 {
        self.next() % count
    }

    fn chance(&mut self, of: u64) -> bool {
        self.below(of) == 0
    }
}

fn settings(random: &mut Random) -> Settings {
    let default = Settings::physical();
    if random.chance(4) {
        return default;
    }
    Settings {
        breath_response: BreathResponse::Physical,
        breath_curve: 1.0,
        breath_full_kpa: random.within(4.0, 12.0),
        noise: random.within(0.0, 1.0),
        tongue_ms: random.within(1.0, 20.0),
        legato_ms: random.within(5.0, 15.0),
        strength: random.within(1.5, 4.0),
        lip: random.within(0.6, 1.4),
        zeta: random.within(0.1, 0.6),
        damping: random.within(0.2, 2.0),
        lay: random.within(0.0, 0.5),
        reed_h: random.within(1.5, 4.0),
        reed_k: random.within(0.1, 1.0),
        coupled: random.chance(2),
        reed_a: random.within(0.5, 1.5),
        a4_hz: random.within(430.0, 450.0),
        tuning: if random.chance(2) { Tuning::Natural } else { Tuning::Tempered },
        temperature_c: random.within(10.0, 40.0),
        vent_loss: random.within(0.0, 4.0),
        gain_db: random.within(-12.0, 6.0),
        ..default
    }
}

fn event(random: &mut Random, lowest: u8, last: &mut SoundingNote) -> Event {
    match random.below(16) {
        0..=5 => {
            *last = SoundingNote(lowest + random.below(42) as u8);
            Event::NoteOn { note: *last, velocity: random.within(0.1, 1.0) }
        }
        6 | 7 => Event::NoteOff { note: *last },
        8..=10 => Event::Breath(random.within(0.0, 1.0)),
        11 => Event::Bend { cents: random.within(-200.0, 200.0) },
        12 => Event::Bend { cents: random.within(-2400.0, 2400.0) },
        13 => Event::Reed { h: random.within(0.5, 2.0), k: random.within(0.5, 2.0) },
        14 => Event::TongueSlap { strength: random.within(0.0, 1.0) },
        _ if random.chance(3) => Event::Panic,
        _ => Event::TryHoles(random.chance(2).then(|| random.next() & 0xff_ffff)),
    }
}

/// A random score, its settings and its block size.
fn random_score(seed: u64, rate_hz: u32) -> (Bundled, Quality, Settings, Score, usize) {
    let mut random = Random(seed);
    let instrument = Bundled::ALL[random.below(5) as usize];
    let quality = if random.chance(20) { Quality::High } else { Quality::Live };
    let settings = settings(&mut random);
    let lowest = (52 - i16::from(instrument.file().transposition)) as u8;
    let samples = (SECONDS * f64::from(rate_hz)) as usize;
    let mut last = SoundingNote(lowest + 12);
    let mut events = vec![Timed { at: 0, event: Event::Breath(random.within(0.4, 0.8)) }];
    events.push(Timed { at: 0, event: Event::NoteOn { note: last, velocity: 0.8 } });
    for _ in 0..12 {
        // In parts of a second, so that a score is the same music at every rate.
        let at = (f64::from(random.within(0.0, 1.0)) * samples as f64) as usize;
        events.push(Timed { at, event: event(&mut random, lowest, &mut last) });
    }
    events.sort_by_key(|event| event.at);
    let block = 1 + random.below(700) as usize;
    (instrument, quality, settings, Score { events, samples }, block)
}

/// One point in mono, other ways of listening in stereo.
fn hash(clarinet: &mut Clarinet, listening: ListeningMode, score: &Score, block: usize) -> String {
    let mut hasher = Sha256::new();
    let mut take = |out: &[f32]| {
        out.iter().for_each(|sample| hasher.update(sample.to_le_bytes()));
        Ok::<_, Infallible>(())
    };
    if listening == ListeningMode::Point {
        play(clarinet, score, block, take).unwrap();
    } else {
        play_stereo(clarinet, score, block, &mut |_| (), |left, right| take(left).and_then(|()| take(right)))
            .unwrap();
    }
    let bytes = hasher.finalize();
    bytes.iter().take(DIGITS / 2).fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").unwrap();
        text
    })
}

fn clarinet(instrument: Bundled, quality: Quality, rate_hz: u32) -> Clarinet {
    let wanted = Wanted { quality, ..Wanted::new(instrument.file(), f64::from(rate_hz)) };
    let model = Preparation::new(&wanted, None).ready().unwrap().expect("bundled instruments are ready");
    Clarinet::new(Arc::new(model), f64::from(rate_hz))
}

/// What is rendered: the melody, or a random score.
#[derive(Clone, Copy)]
struct Rendering {
    seed: Option<u64>,
    response: BreathResponse,
    mode: ListeningMode,
}

impl Rendering {
    fn all() -> Vec<Self> {
        let of = |response, mode, count: u64| {
            std::iter::once(None).chain((1..=count).map(Some)).map(move |seed| Self { seed, response, mode })
        };
        of(BreathResponse::Physical, ListeningMode::Point, SCORES)
            .chain(of(BreathResponse::Physical, ListeningMode::Everywhere, LISTENED_SCORES))
            .chain(of(BreathResponse::Physical, ListeningMode::Position, LISTENED_SCORES))
            .chain(of(BreathResponse::Played, ListeningMode::Everywhere, PLAYED_SCORES))
            .collect()
    }

    fn name(self) -> String {
        let score = self.seed.map_or("melody".to_owned(), |seed| format!("random {seed}"));
        let how = match (self.response, self.mode) {
            (BreathResponse::Played, _) => " played",
            (BreathResponse::Physical, ListeningMode::Point) => "",
            (BreathResponse::Physical, ListeningMode::Everywhere) => " from everywhere",
            (BreathResponse::Physical, ListeningMode::Position) => " from two places",
        };
        score + how
    }

    fn hash(self, rate_hz: u32) -> String {
        let (instrument, quality, settings, score, block) = match self.seed {
            Some(seed) => random_score(seed, rate_hz),
            None => {
                let score = midi_file::read(include_bytes!("../examples/melody.mid"), rate_hz).unwrap();
                (Bundled::BFlat, Quality::Live, Settings::physical(), score, 512)
            }
        };
        // Played, the settings are those of a player who is told nothing, or that are random with a random curve.
        let settings = match self.response {
            BreathResponse::Physical => settings,
            BreathResponse::Played if settings == Settings::physical() => Settings::default(),
            BreathResponse::Played => Settings {
                breath_response: BreathResponse::Played,
                breath_curve: 0.5 + settings.noise,
                ..settings
            },
        };
        let listening = Listening { mode: self.mode, ..Listening::default() };
        let mut clarinet = clarinet(instrument, quality, rate_hz);
        clarinet.set_settings(&Settings { listening, ..settings });
        hash(&mut clarinet, self.mode, &score, block)
    }
}

/// Every rendering at one rate, then at the next, and at the last, so that the first third of a run has all renderings and all rates.
fn renderings_at_rates(count: usize) -> Vec<(usize, usize)> {
    (0..RATES_HZ.len())
        .flat_map(|turn| (0..count).map(move |number| (number, (number + turn) % RATES_HZ.len())))
        .collect()
}

#[test]
fn every_render_is_the_same_to_the_bit() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/renders.tsv");
    let all = Rendering::all();
    let cells = renderings_at_rates(all.len());
    let chosen = part::of(cells.len());
    let cells = &cells[chosen];
    let made = parallel::each(cells, |&(number, rate)| all[number].hash(RATES_HZ[rate]));
    let mut lines = vec![format!("score\t{}", RATES_HZ.map(|rate| rate.to_string()).join("\t"))];
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        let mut hashes = vec![[""; RATES_HZ.len()]; all.len()];
        for (&(number, rate), hash) in cells.iter().zip(&made) {
            hashes[number][rate] = hash;
        }
        lines.extend(
            all.iter().zip(hashes).map(|(one, hashes)| format!("{}\t{}", one.name(), hashes.join("\t"))),
        );
        std::fs::write(&file, lines.join("\n") + "\n").unwrap();
    }
    let kept = std::fs::read_to_string(&file).unwrap();
    let kept: Vec<Vec<&str>> = kept.lines().map(|line| line.split('\t').collect()).collect();
    assert!(
        kept.len() == all.len() + 1 && kept[0].join("\t") == lines[0],
        "{} is of other renderings or rates",
        file.display()
    );
    let mut different = Vec::new();
    for (&(number, rate), hash) in cells.iter().zip(&made) {
        let name = all[number].name();
        if kept[number + 1][0] != name || kept[number + 1][rate + 1] != hash {
            different.push(format!("{name} at {} Hz: {hash}", RATES_HZ[rate]));
        }
    }
    assert!(
        different.is_empty(),
        "{} of {} renderings changed: {different:#?}",
        different.len(),
        cells.len()
    );
}
