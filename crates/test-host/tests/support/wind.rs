//! What a microphone hears: a quiet room, and somebody who blows at it, as in the core's own tests.
#![allow(dead_code, reason = "each user takes what it needs")]

pub const RATE: f64 = 48_000.0;
pub const SECOND: usize = 48_000;

/// Uniform noise, -1..1.
fn noise(random: &mut fastrand::Rng) -> f32 {
    2.0 * random.f32() - 1.0
}

/// So many samples of a room.
pub fn quiet(samples: usize) -> Vec<f32> {
    let mut random = fastrand::Rng::with_seed(1);
    (0..samples).map(|_| 6e-4 * noise(&mut random)).collect()
}

/// So many samples of wind: noise whose spectrum falls by 6 dB an octave above 150 Hz, which swells for 80 ms.
pub fn wind(samples: usize) -> Vec<f32> {
    let mut random = fastrand::Rng::with_seed(7);
    let share = 1.0 - (-std::f32::consts::TAU * 150.0 / RATE as f32).exp();
    // Brings the filtered noise back to the level of noise.
    let gain = ((2.0 - share) / share).sqrt();
    let mut low = 0.0;
    let mut sample = |at: usize| {
        low += share * (noise(&mut random) - low);
        0.25 * (at as f32 / 3_840.0).min(1.0) * gain * low
    };
    (0..samples).map(&mut sample).collect()
}
