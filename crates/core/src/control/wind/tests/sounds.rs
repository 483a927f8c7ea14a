//! What a microphone hears in the tests: a room, somebody who blows at it, somebody who speaks, and music. Full scale is 1.

use std::f64::consts::TAU;

pub const RATE_HZ: f64 = 48_000.0;
/// Level of the room.
const ROOM: f64 = 6e-4;

/// Uniform noise, -1..1: a linear congruential generator (Numerical Recipes).
pub struct Noise(u32);

impl Noise {
    pub fn new(seed: u32) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0) / f64::from(1_u32 << 31) - 1.0
    }
}

fn count(seconds: f64) -> usize {
    (seconds * RATE_HZ).round() as usize
}

/// A function of the sample's number.
pub fn sound(seconds: f64, f: impl FnMut(usize) -> f64) -> Vec<f32> {
    (0..count(seconds)).map(f).map(|x| x as f32).collect()
}

pub fn room(seconds: f64, seed: u32) -> Vec<f32> {
    let mut noise = Noise::new(seed);
    sound(seconds, |_| ROOM * noise.next())
}

/// Wind at a microphone: noise whose spectrum falls by 6 dB an octave above `corner_hz`, with a weak even part, that swells,
/// stays and ends.
pub fn blow(seconds: f64, corner_hz: f64, level: f64) -> Vec<f32> {
    let (mut noise, share) = (Noise::new(7), 1.0 - (-TAU * corner_hz / RATE_HZ).exp());
    // Brings the filtered noise back to the level of noise.
    let gain = ((2.0 - share) / share).sqrt();
    let (mut low, count) = (0.0, count(seconds));
    sound(seconds, |n| {
        let white = noise.next();
        low += share * (white - low);
        let (from, to) = (n as f64 / (0.08 * RATE_HZ), (count - n) as f64 / (0.1 * RATE_HZ));
        level * from.min(to).min(1.0) * (gain * low + 0.08 * white)
    })
}

/// A tone with so many partials, each softer than the one before, every `step`-th of them.
pub fn tone(seconds: f64, hz: f64, level: f64, partials: usize, step: usize) -> Vec<f32> {
    let all = (1..=partials).step_by(step);
    sound(seconds, |n| {
        all.clone().map(|k| level / k as f64 * (TAU * k as f64 * hz * n as f64 / RATE_HZ).sin()).sum()
    })
}

/// One after another, over the room's noise.
pub fn sequence(parts: &[&[f32]]) -> Vec<f32> {
    let mut noise = Noise::new(99);
    parts.iter().flat_map(|part| part.iter()).map(|x| x + (ROOM * noise.next()) as f32).collect()
}

/// A resonance of the mouth (two poles), with a gain of about 1 at its top.
struct Resonance {
    state: [f64; 2],
}

impl Resonance {
    fn tick(&mut self, hz: f64, width_hz: f64, x: f64) -> f64 {
        let r = (-std::f64::consts::PI * width_hz / RATE_HZ).exp();
        let w = TAU * hz / RATE_HZ;
        let y = (1.0 - r) * x + 2.0 * r * w.cos() * self.state[0] - r * r * self.state[1];
        self.state = [y, self.state[0]];
        y
    }
}

/// What a mouth does for a moment, with the formants of a vowel, Hz, where it has some.
#[derive(Clone, Copy)]
enum Sound {
    /// The voice sounds, through these formants.
    Vowel([f64; 3]),
    /// A vowel whose voice is breathy: half of it is noise.
    Breathy([f64; 3]),
    /// An h: noise through the formants.
    Aspirate([f64; 3]),
    /// An s: noise above this, Hz.
    Hiss(f64),
    /// A p or t: silence, then a puff of air.
    Plosive,
    Pause,
}

/// Somebody who speaks without a language: vowels, breathy ones, h, s, f, plosives and pauses in random order; the voice glides
/// around `voice_hz`. Formants of vowels are those of Peterson & Barney (1952), men.
pub fn speech(seconds: f64, voice_hz: f64, seed: u32) -> Vec<f32> {
    const VOWELS: [[f64; 3]; 5] = [
        [730.0, 1_090.0, 2_440.0],
        [530.0, 1_840.0, 2_480.0],
        [270.0, 2_290.0, 3_010.0],
        [570.0, 840.0, 2_410.0],
        [300.0, 870.0, 2_240.0],
    ];
    let (mut random, mut noise) = (Noise::new(seed), Noise::new(seed + 1));
    let mut formants = [[0.0; 2]; 3].map(|state| Resonance { state });
    let (mut puff, mut hiss, mut phase, mut glide) = (0.0, 0.0, 0.0, 0.0);
    let mut said = Vec::with_capacity(count(seconds));
    while said.len() < count(seconds) {
        let vowel = VOWELS[(2.5 * (random.next() + 1.0)) as usize % 5];
        let (sound, length_s) = match (5.0 * (random.next() + 1.0)) as usize {
            0..=3 => (Sound::Vowel(vowel), 0.18),
            4 => (Sound::Breathy(vowel), 0.15),
            5 => (Sound::Aspirate(vowel), 0.08),
            6 => (Sound::Hiss(4_000.0), 0.12),
            7 => (Sound::Hiss(1_500.0), 0.1),
            8 => (Sound::Plosive, 0.09),
            _ => (Sound::Pause, 0.15),
        };
        let length = count(length_s * (1.0 + 0.4 * random.next()));
        let target = voice_hz * (1.0 + 0.2 * random.next());
        glide = if glide > 0.0 { glide } else { target };
        for n in 0..length {
            let edge = (n.min(length - n) as f64 / (0.01 * RATE_HZ)).min(1.0);
            glide += (target - glide) * 3e-4;
            phase += glide * (1.0 + 0.01 * noise.next()) / RATE_HZ;
            let pulse = if phase >= 1.0 { 1.0 } else { 0.0 };
            phase -= pulse;
            let white = noise.next();
            let mut through = |formants_hz: [f64; 3], x: f64| -> f64 {
                let widths = [60.0, 90.0, 120.0];
                let all = formants.iter_mut().zip(formants_hz).zip(widths);
                all.map(|((formant, hz), width)| formant.tick(hz, width, x)).sum()
            };
            said.push(match sound {
                Sound::Vowel(hz) => edge * through(hz, 40.0 * pulse),
                Sound::Breathy(hz) => edge * (through(hz, 20.0 * pulse + 0.5 * white)),
                Sound::Aspirate(hz) => edge * 0.3 * through(hz, white),
                Sound::Hiss(hz) => {
                    hiss += (1.0 - (-TAU * hz / RATE_HZ).exp()) * (white - hiss);
                    edge * 0.15 * (white - hiss)
                }
                Sound::Plosive => {
                    puff += 0.03 * (white - puff);
                    let burst = 2 * n > length;
                    if burst { 3.0 * puff * (1.0 - n as f64 / length as f64) } else { 0.0 }
                }
                Sound::Pause => 0.0,
            });
        }
    }
    let most = said.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    said.iter().map(|x| (0.7 * x / most) as f32).collect()
}

/// A band: notes of a bass, chords of three and a melody, and a drum on each beat. 120 beats a minute.
pub fn music(seconds: f64, seed: u32) -> Vec<f32> {
    let (mut random, mut noise) = (Noise::new(seed), Noise::new(seed + 1));
    let beat = count(0.5);
    let hz = |semitones: f64| 220.0 * (semitones / 12.0).exp2();
    let (mut chord, mut melody) = ([0.0; 3], 0.0);
    let saw = |hz: f64, n: usize, partials: usize| -> f64 {
        (1..=partials).map(|k| (TAU * k as f64 * hz * n as f64 / RATE_HZ).sin() / k as f64).sum()
    };
    sound(seconds, |n| {
        let at = n % beat;
        if at == 0 {
            let root = (6.0 * random.next()).round();
            chord = [root, root + if random.next() > 0.0 { 4.0 } else { 3.0 }, root + 7.0];
            melody = root + 12.0 + chord[at % 3] - root;
        }
        let decay = (-(at as f64) / (0.2 * RATE_HZ)).exp();
        let drum = (-(at as f64) / (0.02 * RATE_HZ)).exp() * (0.2 * noise.next() + 0.3 * saw(60.0, at, 1));
        let bass = 0.15 * saw(hz(chord[0] - 12.0), n, 6);
        let chords: f64 = chord.iter().map(|&note| 0.05 * saw(hz(note), n, 5)).sum();
        decay * (bass + chords) + 0.1 * saw(hz(melody), n, 4) + drum
    })
}
