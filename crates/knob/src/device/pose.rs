//! Where the knob is at each sample of sound: a steady delay behind it, whatever the link and the callbacks do.
//!
//! The link places each sample at the host time at which the knob measured it. The audio thread has a clock of its own,
//! the count of samples it has rendered; a second [`ClockFit`] maps it to host time, so that callbacks that come late or
//! in bursts do not shake the breath. Between the two stands a constant delay: one block, because the end of a block is
//! asked for before it has happened; one period of the knob's samples; and a margin for the link's jitter. Every sample
//! asked for then lies between two that have arrived, as a rule.
//!
//! Without clocks and threads: time goes in. Real-time safe.

use crate::device::clock::ClockFit;
use crate::device::session::StateSample;

/// Samples kept for interpolation: half a second at 500 Hz, above the delay at any block size below 0.4 s.
const KEPT: usize = 256;

/// On top of a block and a period, us. By judgement: the p99 of the jitter of a USB serial line with 1 ms frames.
const MARGIN_US: i64 = 1_500;

/// How long a knob that has fallen silent still counts as there, us. The firmware's own watchdog takes 80 + 50 ms.
const STALE_US: i64 = 150_000;

/// How far a late link is bridged by going on at the last velocity, us. At 2 rad/s that is half a degree too far at most.
const EXTRAPOLATE_US: i64 = 10_000;

/// Callbacks later than this for longer than [`AUDIO_PATIENCE_US`] mean that the host skipped samples, us.
const AUDIO_SLACK_US: i64 = 5_000;

/// See [`AUDIO_SLACK_US`]; by judgement longer than one burst of callbacks, shorter than a phrase.
const AUDIO_PATIENCE_US: i64 = 300_000;

/// A pause between callbacks after which the audio timeline begins anew, us.
const AUDIO_PAUSE_US: i64 = 500_000;

/// Where the knob was, on the host's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Host time of the measurement, us since the link's epoch.
    pub host_us: i64,
    /// Degrees since zero, positive is blowing.
    pub angle_deg: f32,
    /// Degrees per second.
    pub velocity_deg_s: f32,
    /// Time until the next sample as a rule, us.
    pub period_us: u32,
}

impl From<&StateSample> for Sample {
    fn from(state: &StateSample) -> Self {
        let &StateSample { host_us, angle_deg, velocity_deg_s, period_us, .. } = state;
        Self { host_us, angle_deg, velocity_deg_s, period_us }
    }
}

/// Where the knob is at one sample of sound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Degrees since zero, positive is blowing.
    pub angle_deg: f32,
    /// Degrees per second.
    pub velocity_deg_s: f32,
}

/// The latest positions of the knob, and the timeline of the sound that they are read for. See the module.
#[derive(Clone, Debug)]
pub struct Poses {
    /// Ring of the latest samples; `newest` is where the last one stands.
    kept: [Sample; KEPT],
    newest: usize,
    used: usize,
    timeline: ClockFit,
    rate_hz: f64,
    /// Samples rendered since the timeline began, in microseconds.
    rendered_us: f64,
    last_call_us: i64,
    /// Host time at which this block was due, on the audio thread's own timeline.
    due_us: i64,
    /// Host time that the first sample of this block stands for.
    block_us: i64,
    is_live: bool,
}

impl Default for Poses {
    fn default() -> Self {
        Self {
            kept: [Sample::default(); KEPT],
            newest: 0,
            used: 0,
            timeline: ClockFit::new(AUDIO_SLACK_US, AUDIO_PATIENCE_US),
            rate_hz: 0.0,
            rendered_us: 0.0,
            last_call_us: i64::MIN,
            due_us: 0,
            block_us: 0,
            is_live: false,
        }
    }
}

impl Poses {
    /// Takes in what the link has placed.
    pub fn take(&mut self, sample: Sample) {
        let newest = self.kept[self.newest];
        if self.used > 0 {
            let step_us = sample.host_us - newest.host_us;
            if !(-STALE_US..=STALE_US).contains(&step_us) {
                self.used = 0; // another knob, or the same after a while: nothing to interpolate from
            } else if step_us <= 0 {
                return; // the clock fit moved by less than a period
            }
        }
        self.newest = (self.newest + 1) % KEPT;
        self.kept[self.newest] = sample;
        self.used = (self.used + 1).min(KEPT);
    }

    /// Begins a block of `block_samples` at `rate_hz`, at a host time in us; call it once per block, before
    /// [`pose`](Self::pose).
    pub fn begin_block_at(&mut self, now_us: i64, block_samples: usize, rate_hz: f64) {
        let block = block_samples as f64 / rate_hz * 1e6;
        if rate_hz != self.rate_hz || now_us.saturating_sub(self.last_call_us) > AUDIO_PAUSE_US + block as i64
        {
            self.timeline.reset();
            self.rate_hz = rate_hz;
        }
        self.last_call_us = now_us;
        let start_us = self.rendered_us;
        self.timeline.observe(start_us as i64, now_us);
        self.rendered_us += block;
        let newest = self.kept[self.newest];
        self.is_live = self.used > 0 && now_us - newest.host_us <= STALE_US;
        let delay_us = block as i64 + i64::from(newest.period_us) + MARGIN_US;
        self.due_us = self.timeline.local_us(start_us as i64);
        self.block_us = self.due_us - delay_us;
    }

    /// Host time at which the present block was due, us since the link's epoch, however late the host called: the clock of the
    /// knob's states for what is heard.
    pub fn due_us(&self) -> i64 {
        self.due_us
    }

    /// Where the knob was, at the constant delay, for sample `offset` of the block; `None` with no live knob.
    pub fn pose(&self, offset: usize) -> Option<Pose> {
        if !self.is_live {
            return None;
        }
        let at_us = self.block_us + (offset as f64 / self.rate_hz * 1e6) as i64;
        Some(self.pose_at(at_us))
    }

    /// The newest is 0.
    fn sample(&self, age: usize) -> Sample {
        self.kept[(self.newest + KEPT - age) % KEPT]
    }

    /// Requires `used > 0`.
    fn pose_at(&self, at_us: i64) -> Pose {
        let newest = self.sample(0);
        if at_us >= newest.host_us {
            let ahead_s = (at_us - newest.host_us).min(EXTRAPOLATE_US) as f32 * 1e-6;
            return Pose {
                angle_deg: newest.angle_deg + newest.velocity_deg_s * ahead_s,
                velocity_deg_s: newest.velocity_deg_s,
            };
        }
        let mut after = newest;
        for age in 1..self.used {
            let before = self.sample(age);
            if before.host_us <= at_us {
                let span_us = (after.host_us - before.host_us) as f32;
                let part = (at_us - before.host_us) as f32 / span_us;
                let mix = |a: f32, b: f32| a + part * (b - a);
                return Pose {
                    angle_deg: mix(before.angle_deg, after.angle_deg),
                    velocity_deg_s: mix(before.velocity_deg_s, after.velocity_deg_s),
                };
            }
            after = before;
        }
        // Older than all that is kept: the knob has only just come.
        Pose { angle_deg: after.angle_deg, velocity_deg_s: after.velocity_deg_s }
    }
}
