//! The knob as the audio thread sees it: its [`Poses`] behind a ring, which the link fills.
//!
//! All of [`KnobReader`] is real-time safe: no lock, no allocation, no system call (`Instant::now` reads the clock the
//! kernel maps into the process).

use crate::device::pose::Poses;
use rtrb::{Consumer, Producer, RingBuffer};
use std::time::Instant;

pub use crate::device::pose::{Pose, Sample};

/// Samples under way from link to audio: a second at 1 kHz; the reader drains them each block.
const RING: usize = 1024;

/// Slaps under way; a hand makes fewer than ten a second.
const SLAPS: usize = 16;

/// The link's end of the ring.
pub struct KnobWriter {
    samples: Producer<Sample>,
    slaps: Producer<f32>,
}

impl KnobWriter {
    /// Hands a sample to the audio thread; with nobody reading it is dropped.
    pub fn push(&mut self, sample: Sample) {
        let _ = self.samples.push(sample);
    }

    /// Hands over a slap with its peak speed, rad/s.
    pub fn slap(&mut self, speed_rad_s: f32) {
        let _ = self.slaps.push(speed_rad_s);
    }
}

/// The audio thread's end. See the module.
pub struct KnobReader {
    samples: Consumer<Sample>,
    slaps: Consumer<f32>,
    epoch: Instant,
    poses: Poses,
}

/// Both ends; host times count from `epoch`. Allocates.
pub fn ring(epoch: Instant) -> (KnobWriter, KnobReader) {
    let (sample_in, samples) = RingBuffer::new(RING);
    let (slap_in, slaps) = RingBuffer::new(SLAPS);
    let reader = KnobReader { samples, slaps, epoch, poses: Poses::default() };
    (KnobWriter { samples: sample_in, slaps: slap_in }, reader)
}

impl KnobReader {
    /// Begins a block of `block_samples` at `rate_hz`; call it once per block, before [`pose`](Self::pose).
    pub fn begin_block(&mut self, block_samples: usize, rate_hz: f64) {
        let now_us = self.epoch.elapsed().as_micros() as i64;
        self.begin_block_at(now_us, block_samples, rate_hz);
    }

    /// [`begin_block`](Self::begin_block) at a given host time, us since the epoch.
    pub fn begin_block_at(&mut self, now_us: i64, block_samples: usize, rate_hz: f64) {
        while let Ok(sample) = self.samples.pop() {
            self.poses.take(sample);
        }
        self.poses.begin_block_at(now_us, block_samples, rate_hz);
    }

    /// Host time at which the present block was due, on the audio thread's own timeline: us since the link's epoch, however late
    /// the host called.
    pub fn due_us(&self) -> i64 {
        self.poses.due_us()
    }

    /// Where the knob was, at the constant delay, for sample `offset` of the block; `None` with no live knob.
    pub fn pose(&self, offset: usize) -> Option<Pose> {
        self.poses.pose(offset)
    }

    /// Peak speed of the latest slap since the last call, rad/s. Call it in every block: a slap is of its moment.
    pub fn take_slap(&mut self) -> Option<f32> {
        std::iter::from_fn(|| self.slaps.pop().ok()).last()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::clock::DeviceClock;

    struct Dice(u64);

    impl Dice {
        fn roll(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// A knob that turns so that its angle in degrees is the true time in ms, over a jittery link into jittery callbacks;
    /// returns the deviations of the breath's delay from its mean, us, sorted by size.
    fn delays_us(block: usize, burst: u64, seconds: f64) -> (f64, Vec<f64>) {
        let (mut writer, mut reader) = ring(Instant::now());
        let mut clock = DeviceClock::default();
        let mut dice = Dice(0x2545_F491_4F6C_DD1D);
        let rate_hz = 48_000.0;
        let block_us = block as f64 / rate_hz * 1e6;
        let (mut next_state, mut in_flight) = (0u64, Vec::<(f64, u32, f32)>::new());
        let mut delays = Vec::new();
        for call in 0..(seconds * 1e6 / block_us) as u64 {
            // Callbacks come `burst` at a time, up to 1 ms late.
            let ideal_us = (call - call % burst + burst) as f64 * block_us;
            let now_us = ideal_us + 1000.0 * dice.roll() * dice.roll();
            while (next_state as f64) * 2000.0 < now_us {
                let true_us = next_state as f64 * 2000.0;
                let delay = 300.0 - 400.0 * dice.roll().max(1e-9).ln();
                let t_us = (true_us * (1.0 - 100e-6)) as u32;
                in_flight.push((true_us + delay, t_us, (true_us * 1e-3) as f32));
                next_state += 1;
            }
            in_flight.sort_by(|a, b| a.0.total_cmp(&b.0));
            while in_flight.first().is_some_and(|f| f.0 <= now_us) {
                let (seen_us, t_us, angle_deg) = in_flight.remove(0);
                clock.observe(t_us, seen_us as i64);
                writer.push(Sample {
                    host_us: clock.host_us(t_us).unwrap(),
                    angle_deg,
                    velocity_deg_s: 1000.0,
                    period_us: 2000,
                });
            }
            reader.begin_block_at(now_us as i64, block, rate_hz);
            if ideal_us < 2e6 {
                continue;
            }
            for offset in (0..block).step_by(16) {
                let heard_us = call as f64 * block_us + offset as f64 / rate_hz * 1e6;
                let pose = reader.pose(offset).expect("a live knob has a pose");
                delays.push(heard_us - f64::from(pose.angle_deg) * 1000.0);
            }
        }
        let mean = delays.iter().sum::<f64>() / delays.len() as f64;
        let mut off: Vec<f64> = delays.iter().map(|d| (d - mean).abs()).collect();
        off.sort_by(f64::total_cmp);
        (mean, off)
    }

    #[test]
    fn breath_jitter_stays_below_1_ms_whatever_the_callbacks_do() {
        for (block, burst) in [(64, 1), (128, 1), (128, 4), (512, 1)] {
            let (mean, off) = delays_us(block, burst, 30.0);
            let p99 = off[off.len() * 99 / 100];
            println!("blocks of {block} by {burst}: delay {mean:.0} us, p99 {p99:.0} us about it");
            assert!(p99 < 1000.0, "blocks of {block} by {burst}: p99 {p99} us about {mean} us");
        }
    }

    fn sample(host_us: i64, angle_deg: f32) -> Sample {
        Sample { host_us, angle_deg, velocity_deg_s: 100.0, period_us: 2000 }
    }

    #[test]
    fn a_silent_knob_is_gone_after_150_ms_and_bridged_for_10() {
        let (mut writer, mut reader) = ring(Instant::now());
        let mut heard = |ms: i64| {
            if ms == 1000 || ms == 1400 {
                writer.push(sample(ms * 1000, 10.0));
            }
            reader.begin_block_at(ms * 1000, 480, 48_000.0);
            reader.pose(0).map(|pose| pose.angle_deg)
        };
        for ms in (900..1500).step_by(10) {
            match (ms, heard(ms)) {
                (..1000 | 1160..1400, pose) => assert_eq!(pose, None, "{ms} ms"),
                // The delay is 10 + 2 + 1.5 ms.
                (1000..1020 | 1400..1420, pose) => assert!(pose.is_some(), "{ms} ms"),
                (1030..=1150, pose) => assert!((pose.unwrap() - 11.0).abs() < 1e-3, "{ms} ms: {pose:?}"),
                _ => {}
            }
        }
    }

    #[test]
    fn the_latest_slap_since_the_last_block_counts_once() {
        let (mut writer, mut reader) = ring(Instant::now());
        writer.slap(12.0);
        writer.slap(7.0);
        assert_eq!([reader.take_slap(), reader.take_slap()], [Some(7.0), None]);
        writer.slap(9.0);
        assert_eq!([reader.take_slap(), reader.take_slap()], [Some(9.0), None]);
    }
}
