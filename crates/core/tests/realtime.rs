//! Guarantees for a host: no allocation while playing, the same bits for any block size, real silence, a sound that
//! survives invalid numbers, and one instrument at every sample rate.

use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use chalumeau_core::analysis::{pitch, spectrum};
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::{
    BreathResponse, Clarinet, Listening, ListeningMode, Model, Settings, Tuning,
};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const HOSTS_HZ: [f64; 6] = [44_100.0, 48_000.0, 96_000.0, 192_000.0, 22_050.0, 384_000.0];

/// Building a model reads the instrument file: once per internal rate is enough.
static MODEL_96K: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(48_000.0).unwrap()));
static MODEL_88K: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(44_100.0).unwrap()));

fn clarinet(host_hz: f64) -> Clarinet {
    let family_of_44k = host_hz % 11_025.0 == 0.0;
    Clarinet::new(Arc::clone(if family_of_44k { &MODEL_88K } else { &MODEL_96K }), host_hz)
}

fn sounding(written: u8) -> SoundingNote {
    WrittenNote(written).sounding(2).unwrap()
}

fn note_on(written: u8) -> Event {
    Event::NoteOn { note: sounding(written), velocity: 0.8 }
}

fn note_off(written: u8) -> Event {
    Event::NoteOff { note: sounding(written) }
}

fn wide(samples: &[f32]) -> Vec<f64> {
    samples.iter().map(|&sample| f64::from(sample)).collect()
}

fn peak(samples: &[f32]) -> f32 {
    samples.iter().fold(0.0, |peak, sample| peak.max(sample.abs()))
}

fn rms(samples: &[f32]) -> f64 {
    (samples.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>() / samples.len() as f64).sqrt()
}

fn render(clarinet: &mut Clarinet, seconds: f64, host_hz: f64) -> Vec<f32> {
    let mut out = vec![0.0; (seconds * host_hz).round() as usize];
    clarinet.render(&mut out);
    out
}

/// xorshift64*, Vigna 2016.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, end: usize) -> usize {
        (self.unit() * end as f64) as usize
    }

    fn within(&mut self, low: f64, high: f64) -> f32 {
        (low + (high - low) * self.unit()) as f32
    }

    /// Mostly a number in the range, sometimes one that no host should send.
    fn wild(&mut self, low: f64, high: f64) -> f32 {
        match self.below(12) {
            0 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 1e-40][self.below(6)],
            _ => self.within(low, high),
        }
    }

    fn event(&mut self) -> Event {
        match self.below(18) {
            0..=5 => {
                Event::NoteOn { note: SoundingNote(40 + self.below(60) as u8), velocity: self.wild(0.0, 1.0) }
            }
            6..=8 => Event::NoteOff { note: SoundingNote(40 + self.below(60) as u8) },
            9..=13 => Event::Breath(self.wild(0.0, 1.0)),
            14 => Event::Bend { cents: self.wild(-1_500.0, 1_500.0) },
            15 => Event::TongueSlap { strength: self.wild(0.0, 1.0) },
            16 => Event::Reed { h: self.wild(0.6, 1.6), k: self.wild(0.6, 1.6) },
            _ => match self.below(8) {
                0 => Event::Panic,
                1 | 2 => Event::Choke { note: SoundingNote(40 + self.below(60) as u8) },
                3 => Event::Volume { gain: self.wild(0.0, 4.0) },
                _ => Event::Breath(0.6),
            },
        }
    }

    fn settings(&mut self) -> Settings {
        Settings {
            breath_response: if self.below(2) == 0 {
                BreathResponse::Played
            } else {
                BreathResponse::Physical
            },
            breath_curve: self.wild(0.5, 2.0),
            breath_full_kpa: self.wild(2.0, 20.0),
            noise: self.wild(0.0, 1.0),
            tongue_ms: self.wild(1.0, 20.0),
            legato_ms: self.wild(5.0, 15.0),
            strength: self.wild(1.5, 5.0),
            lip: self.wild(0.6, 1.4),
            zeta: self.wild(0.05, 0.9),
            damping: self.wild(0.2, 2.0),
            lay: self.wild(0.0, 0.5),
            reed_h: self.wild(1.0, 5.0),
            reed_k: self.wild(0.1, 2.0),
            coupled: self.below(2) == 0,
            reed_a: self.wild(0.0, 2.0),
            a4_hz: self.wild(415.0, 466.0),
            tuning: if self.below(2) == 0 { Tuning::Natural } else { Tuning::Tempered },
            temperature_c: self.wild(10.0, 40.0),
            vent_loss: self.wild(0.0, 4.0),
            gain_db: self.wild(-60.0, 24.0),
            listening: Listening {
                mode: [ListeningMode::Everywhere, ListeningMode::Position, ListeningMode::Point]
                    [self.below(3)],
                distance_m: self.wild(0.2, 10.0),
                angle_deg: self.wild(-180.0, 180.0),
                height_m: self.wild(-1.0, 2.0),
                width_deg: self.wild(0.0, 180.0),
            },
            ..Settings::default()
        }
    }

    /// A busy performance, `events` at random samples before `len`.
    fn performance(&mut self, events: usize, len: usize) -> Vec<Timed<Event>> {
        let mut score = vec![Timed { at: 0, event: Event::Breath(0.7) }, Timed { at: 0, event: note_on(60) }];
        score.extend((0..events).map(|_| Timed { at: self.below(len), event: self.event() }));
        score.sort_by_key(|timed| timed.at);
        score
    }
}

/// Plays a score whose blocks end where `block` says.
fn in_blocks(
    clarinet: &mut Clarinet,
    score: &[Timed<Event>],
    len: usize,
    mut block: impl FnMut() -> usize,
) -> Vec<f32> {
    let (mut out, mut done, mut next) = (vec![0.0; len], 0, 0);
    while done < len {
        let end = (done + block()).min(len);
        let from = next;
        while next < score.len() && score[next].at < end {
            next += 1;
        }
        let events = score[from..next].iter().map(|&Timed { at, event }| Timed { at: at - done, event });
        clarinet.render_events(events, &mut out[done..end]);
        done = end;
    }
    out
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|sample| sample.to_bits()).collect()
}

#[test]
fn playing_never_allocates() {
    let mut random = Random(1);
    let mut clarinets = HOSTS_HZ.map(clarinet);
    let mut block = [0.0; 333];
    assert_no_alloc(|| {
        for clarinet in &mut clarinets {
            for round in 0..400 {
                clarinet.apply(random.event());
                clarinet.render(&mut block[..random.below(333)]);
                if round % 10 == 0 {
                    clarinet.set_settings(&random.settings());
                }
                if round % 100 == 99 {
                    clarinet.reset();
                }
            }
        }
    });
}

#[test]
fn block_size_is_inaudible_at_every_host_rate() {
    for host_hz in HOSTS_HZ {
        let mut random = Random(host_hz as u64);
        let len = (0.4 * host_hz) as usize;
        let score = random.performance(60, len);
        let whole = bits(&in_blocks(&mut clarinet(host_hz), &score, len, || len));
        assert!(whole.iter().any(|&sample| f32::from_bits(sample).abs() > 1e-3), "{host_hz}: it sounds");
        for size in [1, 17, 64, 512, 4096] {
            let cut = in_blocks(&mut clarinet(host_hz), &score, len, || size);
            assert!(bits(&cut) == whole, "{host_hz} Hz in blocks of {size}");
        }
        let cut = in_blocks(&mut clarinet(host_hz), &score, len, || random.below(1000));
        assert!(bits(&cut) == whole, "{host_hz} Hz in random blocks");
    }
}

#[test]
fn two_renders_are_identical_and_reset_is_a_new_instrument() {
    for host_hz in HOSTS_HZ {
        let len = (0.5 * host_hz) as usize;
        let mut random = Random(3);
        let (score, other) = (random.performance(60, len), random.performance(60, len));
        // A changed gain glides in, so a new instrument would differ from one that has the gain already: keep the default.
        let settings = Settings { gain_db: Settings::default().gain_db, ..Random(9).settings() };
        let fresh = || {
            let mut clarinet = clarinet(host_hz);
            clarinet.set_settings(&settings);
            clarinet
        };
        let first = bits(&in_blocks(&mut fresh(), &score, len, || 64));
        assert!(bits(&in_blocks(&mut fresh(), &score, len, || 64)) == first, "{host_hz}: second render");
        let mut used = fresh();
        in_blocks(&mut used, &other, len, || 77);
        used.reset();
        assert!(bits(&in_blocks(&mut used, &score, len, || 64)) == first, "{host_hz}: after reset");
    }
}

#[test]
fn plain_code_path_gives_the_same_bits() {
    let len = 96_000;
    let score = Random(5).performance(150, len);
    let vector = in_blocks(&mut clarinet(48_000.0), &score, len, || 64);
    let plain = in_blocks(&mut clarinet(48_000.0).without_avx2(), &score, len, || 64);
    assert!(bits(&vector) == bits(&plain));
}

/// Rates that hosts and validators ask for, Hz.
const ALL_RATES_HZ: [f64; 20] = [
    1_000.0,
    2_000.0,
    4_000.0,
    8_000.0,
    11_025.0,
    16_000.0,
    22_050.0,
    24_000.0,
    32_000.0,
    44_100.0,
    47_999.0,
    48_000.0,
    88_200.0,
    96_000.0,
    176_400.0,
    192_000.0,
    384_000.0,
    705_600.0,
    768_000.0,
    1_536_000.0,
];

#[test]
fn the_lowest_note_is_in_tune_at_every_rate() {
    let wanted_hz = SoundingNote(50).frequency_hz(440.0);
    let mut worst = 0.0_f64;
    for host_hz in ALL_RATES_HZ {
        let mut clarinet = clarinet(host_hz);
        clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(note_on(52));
        render(&mut clarinet, 0.6, host_hz);
        let sound = wide(&render(&mut clarinet, 0.4, host_hz));
        let hz = pitch::fundamental_hz(&sound, host_hz).unwrap_or_else(|| panic!("silent at {host_hz} Hz"));
        let off = cents(hz, wanted_hz);
        worst = worst.max(off.abs());
        assert!(off.abs() < 2.0, "{host_hz} Hz: {off} cents");
        clarinet.apply(Event::Panic);
        render(&mut clarinet, 5.0, host_hz);
        assert!(clarinet.is_silent(), "{host_hz} Hz: not silent");
    }
    println!("{} rates from 1 kHz to 1.536 MHz: worst {worst:.3} cents", ALL_RATES_HZ.len());
}

#[test]
fn silence_is_silent_a_second_after_the_breath_or_the_key() {
    for host_hz in [44_100.0, 48_000.0] {
        for written in [52, 60, 71, 84] {
            let mut blown = clarinet(host_hz);
            blown.apply(Event::Breath(0.6));
            let mut keyed = clarinet(host_hz);
            for (clarinet, end) in [(&mut blown, Event::Breath(0.0)), (&mut keyed, note_off(written))] {
                clarinet.apply(note_on(written));
                assert!(peak(&render(clarinet, 1.0, host_hz)) > 1e-3, "written {written} sounds");
                clarinet.apply(end);
                render(clarinet, 1.0, host_hz);
                let left = peak(&render(clarinet, 0.5, host_hz));
                assert!(
                    left < 1e-6,
                    "written {written} at {host_hz} Hz after {end:?}: {left:e} of full scale"
                );
                assert!(clarinet.is_silent());
            }
        }
    }
}

#[test]
fn steady_note_has_no_constant_part() {
    for written in [52, 65, 79] {
        let mut clarinet = clarinet(48_000.0);
        clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(note_on(written));
        render(&mut clarinet, 1.0, 48_000.0);
        let sound = render(&mut clarinet, 1.0, 48_000.0);
        // A four-term Blackman-Harris window leaves at most -92 dB of components that are 100 bins away.
        let angle = |n: usize| std::f64::consts::TAU * (n as f64 + 0.5) / sound.len() as f64;
        let window = |n: usize| {
            0.358_75 - 0.488_29 * angle(n).cos() + 0.141_28 * (2.0 * angle(n)).cos()
                - 0.011_68 * (3.0 * angle(n)).cos()
        };
        let sum: f64 = sound.iter().enumerate().map(|(n, &x)| window(n) * f64::from(x)).sum();
        let mean = sum / (0.358_75 * sound.len() as f64);
        let relative_db = 20.0 * (mean.abs() / rms(&sound)).log10();
        println!("written {written}: constant part {relative_db:.1} dB");
        assert!(relative_db < -90.0, "written {written}: {relative_db} dB");
    }
}

fn largest_step(samples: &[f32]) -> f32 {
    samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
}

#[test]
fn moving_fingers_do_not_click() {
    let host_hz = 48_000.0;
    let settings = Settings { noise: 0.0, ..Settings::physical() };
    let steady: Vec<f32> = (52..=84)
        .map(|written| {
            let mut clarinet = clarinet(host_hz);
            clarinet.set_settings(&settings);
            clarinet.apply(Event::Breath(0.5));
            clarinet.apply(note_on(written));
            render(&mut clarinet, 0.8, host_hz);
            largest_step(&render(&mut clarinet, 0.1, host_hz))
        })
        .collect();
    let mut random = Random(11);
    let mut clarinet = clarinet(host_hz);
    clarinet.set_settings(&settings);
    clarinet.apply(Event::Breath(0.5));
    clarinet.apply(note_on(60));
    let settled = render(&mut clarinet, 0.5, host_hz);
    let (mut from, mut last, mut worst, mut over) = (60_u8, settled[settled.len() - 1], 0.0_f32, 0);
    for _ in 0..200 {
        let to = loop {
            let to = 52 + random.below(33) as u8;
            if to != from {
                break to;
            }
        };
        clarinet.apply(note_on(to));
        clarinet.apply(note_off(from));
        let sound = render(&mut clarinet, 0.030, host_hz);
        let step = largest_step(&sound).max((sound[0] - last).abs());
        let allowed = steady[usize::from(from - 52)].max(steady[usize::from(to - 52)]);
        worst = worst.max(step / allowed);
        if step > 1.5 * allowed {
            over += 1;
            println!("{from} -> {to}: {:.2} of the larger note's own largest step", step / allowed);
        }
        (from, last) = (to, sound[sound.len() - 1]);
    }
    println!("worst {worst:.2}, above 1.5: {over} of 200");
    assert!(over <= 2 && worst < 2.0);
}

#[test]
fn a_broken_state_is_reset_counted_and_the_sound_comes_back() {
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for bore in [false, true] {
            let mut clarinet = clarinet(48_000.0);
            clarinet.apply(Event::Breath(0.6));
            clarinet.apply(note_on(65));
            render(&mut clarinet, 0.6, 48_000.0);
            let before = rms(&render(&mut clarinet, 0.2, 48_000.0));
            assert_eq!(clarinet.resets(), 0);
            if bore {
                clarinet.voice_mut().lattice_mut().scatter(|| nonsense);
            } else {
                clarinet.voice_mut().reed_mut().closing = nonsense;
            }
            let after = render(&mut clarinet, 0.6, 48_000.0);
            assert!(after.iter().all(|x| x.abs() <= 1.0));
            assert!(clarinet.resets() >= 1, "{nonsense}, bore {bore}");
            let again = rms(&render(&mut clarinet, 0.2, 48_000.0));
            assert!(
                (again / before - 1.0).abs() < 0.05,
                "{nonsense}, bore {bore}: {before} before, {again} after"
            );
        }
    }
}

#[test]
fn a_minute_of_nonsense_stays_within_full_scale() {
    let host_hz = 48_000.0;
    let mut random = Random(17);
    let mut clarinet = clarinet(host_hz);
    let mut block = [0.0; 64];
    let blocks = (60.0 * host_hz / 64.0) as usize;
    let (mut worst, mut sounding) = (Duration::ZERO, 0);
    let began = Instant::now();
    for at in 0..blocks {
        if at % 20 == 0 {
            clarinet.apply(random.event());
        }
        if at % 100 == 0 {
            clarinet.set_settings(&random.settings());
        }
        let start = Instant::now();
        clarinet.render(&mut block);
        worst = worst.max(start.elapsed());
        assert!(block.iter().all(|x| x.abs() <= 1.0), "block {at}");
        sounding += usize::from(peak(&block) > 1e-4);
    }
    let mean = began.elapsed() / blocks as u32;
    println!("64 samples at 48 kHz: mean {mean:?}, worst {worst:?}, deadline 1.33 ms");
    assert!(sounding > blocks / 10, "it must sound: {sounding} of {blocks} blocks");
    assert_eq!(clarinet.resets(), 0, "settings within their ranges never break a state");
}

#[test]
fn overblowing_shuts_the_reed_and_letting_up_brings_the_note_back() {
    let host_hz = 48_000.0;
    for written in [52, 65, 79] {
        let mut clarinet = clarinet(host_hz);
        let soft = Settings { breath_full_kpa: 20.0, strength: 2.0, noise: 0.0, ..Settings::physical() };
        clarinet.set_settings(&soft);
        // Strength 2 closes at 5 kPa: full breath is gamma 4.
        let gamma = |gamma: f32| Event::Breath(gamma / 4.0);
        clarinet.apply(gamma(0.5));
        clarinet.apply(note_on(written));
        render(&mut clarinet, 0.8, host_hz);
        let before = pitch::fundamental_hz(&wide(&render(&mut clarinet, 0.5, host_hz)), host_hz).unwrap();
        for up in [true, false] {
            for step in 0..=200 {
                let way = if up { step } else { 200 - step } as f32 / 200.0;
                clarinet.apply(gamma(0.5 + 2.5 * way));
                let sound = render(&mut clarinet, 0.02, host_hz);
                assert!(peak(&sound) < 0.9, "written {written}: never near the limiter");
                if up && step == 200 {
                    let left = peak(&sound);
                    assert!(left < 1e-3, "written {written}: shut at gamma 3, {left}");
                }
            }
        }
        render(&mut clarinet, 0.5, host_hz);
        let sound = wide(&render(&mut clarinet, 0.5, host_hz));
        let off = cents(pitch::fundamental_hz(&sound, host_hz).unwrap(), before);
        assert!(off.abs() < 0.5, "written {written}: {off} cents after the excursion");
        assert_eq!(clarinet.resets(), 0);
    }
}

#[test]
fn held_note_with_closed_holes_leaves_nothing_subnormal() {
    let mut clarinet = clarinet(48_000.0);
    clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
    clarinet.apply(Event::Breath(0.5));
    clarinet.apply(note_on(60));
    render(&mut clarinet, 0.2, 48_000.0);
    clarinet.apply(note_on(52));
    for tenth in 0..100 {
        render(&mut clarinet, 0.1, 48_000.0);
        assert!(!clarinet.voice_mut().lattice().has_subnormal(), "after {tenth} tenths of a second");
    }
}

#[test]
fn every_host_rate_plays_the_same_instrument() {
    for written in [52, 60, 71, 84] {
        let heard: Vec<(f64, Vec<f64>)> = [44_100.0, 48_000.0, 96_000.0, 192_000.0]
            .into_iter()
            .map(|host_hz| {
                let mut clarinet = clarinet(host_hz);
                clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
                clarinet.apply(Event::Breath(0.5));
                clarinet.apply(note_on(written));
                render(&mut clarinet, 0.9, host_hz);
                let sound = wide(&render(&mut clarinet, 0.5, host_hz));
                let hz = pitch::fundamental_hz(&sound, host_hz).unwrap();
                let mut levels = spectrum::harmonic_levels_db(&sound, host_hz, hz);
                levels.truncate(5);
                (hz, levels)
            })
            .collect();
        // The two internal rates have cells fitted separately: harmonics below -30 dB differ a little more.
        let (mut cents_off, mut strong_db, mut weak_db) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (hz, levels) in &heard {
            cents_off = cents_off.max(cents(*hz, heard[1].0).abs());
            for (level, reference) in levels.iter().zip(&heard[1].1) {
                let most = if *reference > -30.0 { &mut strong_db } else { &mut weak_db };
                *most = most.max((level - reference).abs());
            }
        }
        println!("written {written}: {cents_off:.3} cents, {strong_db:.2} dB, below -30 dB {weak_db:.2} dB");
        assert!(cents_off < 1.0 && strong_db < 1.0 && weak_db < 1.5, "written {written}: {heard:?}");
    }
}

#[test]
fn slurs_across_the_register_key_speak_in_the_clarion() {
    let host_hz = 48_000.0;
    let mut right = Vec::new();
    for low in 52..64_u8 {
        let mut clarinet = clarinet(host_hz);
        clarinet.set_settings(&Settings { legato_ms: 15.0, noise: 0.0, ..Settings::physical() });
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(note_on(low));
        render(&mut clarinet, 0.6, host_hz);
        clarinet.apply(note_on(low + 19));
        render(&mut clarinet, 0.2, host_hz);
        let sound = wide(&render(&mut clarinet, 0.2, host_hz));
        let off = pitch::fundamental_hz(&sound, host_hz)
            .map(|hz| cents(hz, sounding(low + 19).frequency_hz(440.0)));
        println!("{low} -> {}: {off:?} cents", low + 19);
        right.extend(off.filter(|off| off.abs() < 80.0));
    }
    assert!(right.len() >= 11, "{} of 12 in the second register within 200 ms", right.len());
}
