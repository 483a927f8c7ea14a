//! Unmodified firmware made playable: 25 angles a second become a steady stream of predicted positions.
//!
//! Between datagrams the knob is taken to go on at its velocity, which the firmware sends; without it the velocity is that
//! of an alpha-beta filter. What a new angle corrects is not jumped to but faded in, so that the breath has no steps. The
//! prediction ends after `AHEAD_US`: a knob that stops between two datagrams is overrun by that much at most.
//!
//! The firmware counts from where the knob stood when it was switched on, without bounds, in both directions. Zero is
//! therefore set here. A jump that no hand can make is a restart: the new position becomes zero, so that it is silent.

use crate::device::osc::StockMessage;
use crate::device::session::StateSample;

/// What people are told about this firmware.
pub const LABEL: &str = "read-only, about 40 ms";

/// Time between two predicted positions, us.
const PERIOD_US: i64 = 4_000;

/// Time between two datagrams of the firmware, us.
const DATAGRAM_US: f64 = 40_000.0;

/// Longest prediction, us: two datagrams, so that one may be lost.
const AHEAD_US: i64 = 80_000;

/// The knob counts as gone when nothing has come for this long, us: five datagrams; Wi-Fi loses single ones.
const GONE_US: i64 = 200_000;

/// Part of a correction that is believed. The time of arrival is uncertain by some ms, the angle by 0.1 degrees. By
/// judgement.
const ALPHA: f64 = 0.8;

/// The same for the velocity where none is sent. By judgement, near critical damping for [`ALPHA`].
const BETA: f64 = 0.4;

/// Time in which a correction is faded in, us.
const FADE_US: f64 = 15_000.0;

/// A sent velocity older than this is not used, us.
const VELOCITY_US: i64 = 100_000;

/// Time in which the fastest turn of the last moments fades, us: a slap tells how fast it was within a tenth of a second.
const FASTEST_US: f64 = 50_000.0;

/// Fastest a hand turns a knob, degrees per second: the firmware's own range of 700 rpm.
const FASTEST_DEG_S: f64 = 4_200.0;

/// On top of what the fastest hand does, degrees, before a jump is a restart.
const JUMP_DEG: f64 = 120.0;

/// A counter of 16 bits that has run over, degrees.
const WRAP_DEG: f64 = 6_553.6;

/// rad/s of a full slap where nothing tells its speed. By judgement: a flick of the wrist.
const SLAP_RAD_S: f32 = 10.0;

/// See the module.
#[derive(Debug, Default)]
pub struct StockTracker {
    /// Angle as the firmware counts it with run-over undone, and when it came.
    raw_deg: f64,
    raw_us: Option<i64>,
    wraps_deg: f64,
    zero_deg: f64,
    velocity_deg_s: f64,
    sent_velocity_us: Option<i64>,
    /// What the last corrections still have to fade in, degrees, and since when.
    fading_deg: f64,
    fading_us: i64,
    next_us: i64,
    pluck: bool,
    slap_said: bool,
    /// The fastest of the last tenth of a second: it fades.
    fastest_deg_s: f64,
    faded_us: i64,
    button: Option<f64>,
    jumps: u32,
    last_jump_deg: f64,
}

impl StockTracker {
    /// The present position becomes zero.
    pub fn zero(&mut self) {
        self.zero_deg = self.raw_deg;
        self.fading_deg = 0.0;
    }

    /// When the last angle came, us.
    pub fn heard_us(&self) -> Option<i64> {
        self.raw_us
    }

    /// How often the knob jumped as no hand can, and by how many degrees last.
    pub fn jumps(&self) -> (u32, f64) {
        (self.jumps, self.last_jump_deg)
    }

    /// Takes in a word that came at `now_us`; the peak speed of a slap, rad/s, if it was one.
    pub fn hear(&mut self, word: StockMessage, now_us: i64) -> Option<f32> {
        match word {
            StockMessage::Angle(tenths) => self.hear_angle(0.1 * tenths, now_us),
            StockMessage::Velocity(rpm) => {
                self.velocity_deg_s = (6.0 * rpm).clamp(-FASTEST_DEG_S, FASTEST_DEG_S);
                self.sent_velocity_us = Some(now_us);
                self.fastest_deg_s = self.fastest_deg_s.max(self.velocity_deg_s.abs());
            }
            StockMessage::Pluck(pluck) => {
                let was_pluck = std::mem::replace(&mut self.pluck, pluck);
                if pluck && !was_pluck {
                    self.slap_said = true;
                    return Some(self.slap_speed(1.0));
                }
            }
            // Cleared in the tick in which the pluck ends: mostly it is not seen, or seen without the pluck.
            StockMessage::Slap(depth) if depth < 0.0 => {
                if !std::mem::replace(&mut self.slap_said, true) {
                    return Some(self.slap_speed(depth.max(-1.0).abs()));
                }
            }
            StockMessage::Slap(_) => self.slap_said = self.pluck,
            StockMessage::Button(count) => {
                if self.button.replace(count).is_some_and(|before| before != count) {
                    self.zero();
                }
            }
            StockMessage::Other => {}
        }
        None
    }

    /// The predicted positions due by `now_us`; none once the knob is gone.
    pub fn poll(&mut self, now_us: i64, tell: &mut dyn FnMut(StateSample)) {
        let Some(raw_us) = self.raw_us.filter(|at| now_us - at <= GONE_US) else { return };
        // After a pause, or a stall of this thread, only the present is of interest.
        self.next_us = self.next_us.max(now_us - 2 * PERIOD_US);
        while self.next_us <= now_us {
            let at_us = self.next_us;
            self.next_us += PERIOD_US;
            let is_ahead = at_us - raw_us < AHEAD_US;
            tell(StateSample {
                host_us: at_us,
                t_us: at_us as u32,
                angle_deg: (self.predicted(at_us) - self.fading(at_us) - self.zero_deg) as f32,
                velocity_deg_s: if is_ahead { self.velocity_deg_s as f32 } else { 0.0 },
                period_us: PERIOD_US as u32,
                ..StateSample::default()
            });
        }
        let since_us = (now_us - self.faded_us).max(0) as f64;
        self.fastest_deg_s *= (-since_us / FASTEST_US).exp();
        self.faded_us = now_us;
    }

    fn predicted(&self, at_us: i64) -> f64 {
        let ahead_us = (at_us - self.raw_us.unwrap_or(at_us)).clamp(0, AHEAD_US);
        self.raw_deg + self.velocity_deg_s * ahead_us as f64 * 1e-6
    }

    fn fading(&self, at_us: i64) -> f64 {
        self.fading_deg * (-((at_us - self.fading_us).max(0) as f64) / FADE_US).exp()
    }

    fn hear_angle(&mut self, counted_deg: f64, now_us: i64) {
        let Some(before_us) = self.raw_us else {
            // What it counts from is where it was switched on: as good a zero as any until somebody sets one.
            (self.raw_deg, self.raw_us, self.next_us) = (counted_deg, Some(now_us), now_us);
            return;
        };
        let elapsed_us = (now_us - before_us).max(1);
        let expected_deg = self.predicted(now_us);
        let shown_deg = expected_deg - self.fading(now_us);
        let mut measured_deg = counted_deg + self.wraps_deg;
        let possible_deg = FASTEST_DEG_S * elapsed_us.min(1_000_000) as f64 * 1e-6 + JUMP_DEG;
        let off = |deg: f64| (deg - self.raw_deg).abs();
        if off(measured_deg) > possible_deg {
            let wrapped =
                [WRAP_DEG, -WRAP_DEG].into_iter().find(|wrap| off(measured_deg + wrap) <= possible_deg);
            if let Some(wrap) = wrapped {
                self.wraps_deg += wrap;
                measured_deg += wrap;
            } else {
                self.jumps += 1;
                self.last_jump_deg = measured_deg - self.raw_deg;
                self.wraps_deg = 0.0;
                (self.raw_deg, self.raw_us, self.velocity_deg_s) = (counted_deg, Some(now_us), 0.0);
                self.zero();
                return;
            }
        }
        let residual_deg = measured_deg - expected_deg;
        if self.sent_velocity_us.is_none_or(|at| now_us - at > VELOCITY_US) {
            let period_us = (elapsed_us as f64).max(DATAGRAM_US / 4.0);
            let velocity = self.velocity_deg_s + BETA * residual_deg / (period_us * 1e-6);
            self.velocity_deg_s = velocity.clamp(-FASTEST_DEG_S, FASTEST_DEG_S);
        }
        // Beyond the prediction the filter knows nothing: the measurement is all there is.
        let alpha = if elapsed_us > AHEAD_US { 1.0 } else { ALPHA };
        (self.raw_deg, self.raw_us) = (expected_deg + alpha * residual_deg, Some(now_us));
        (self.fading_deg, self.fading_us) = (self.raw_deg - shown_deg, now_us);
    }

    fn slap_speed(&self, depth: f64) -> f32 {
        let turned = self.fastest_deg_s.to_radians() as f32;
        if turned > 1.0 { turned } else { SLAP_RAD_S * depth as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays `angle_deg(t)` as the firmware sends it, arrivals up to 10 ms late; returns (time s, shown degrees).
    fn played(
        seconds: f64,
        with_velocity: bool,
        angle_deg: impl Fn(f64) -> f64,
    ) -> (StockTracker, Vec<(f64, f64)>) {
        let mut tracker = StockTracker::default();
        let mut shown = Vec::new();
        let mut late = 1u64;
        let mut due = Vec::new();
        for n in 0..(seconds * 25.0) as i64 {
            late = late.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            due.push((n * 40_000 + (late >> 33) as i64 % 10_000, n as f64 * 0.04));
        }
        let mut due = due.into_iter().peekable();
        for now_us in (0..(seconds * 1e6) as i64).step_by(1000) {
            while let Some((_, t)) = due.next_if(|(at, _)| *at <= now_us) {
                if with_velocity {
                    let rpm = (angle_deg(t + 1e-3) - angle_deg(t)) * 1e3 / 6.0;
                    tracker.hear(StockMessage::Velocity(rpm), now_us);
                }
                tracker.hear(StockMessage::Angle((10.0 * angle_deg(t)).round()), now_us);
            }
            tracker.poll(now_us, &mut |s| shown.push((s.host_us as f64 * 1e-6, f64::from(s.angle_deg))));
        }
        (tracker, shown)
    }

    #[test]
    fn positions_are_steady_and_follow_a_playing_hand() {
        // Half a turn and back each second and a half.
        let hand = |t: f64| 90.0 - 90.0 * (t * 4.2).cos();
        for (with_velocity, allowed_deg) in [(true, 8.0), (false, 14.0)] {
            let (_, shown) = played(6.0, with_velocity, hand);
            assert!(
                shown.windows(2).all(|pair| ((pair[1].0 - pair[0].0) - 0.004).abs() < 1e-6),
                "every 4 ms"
            );
            let error = |(t, deg): &(f64, f64)| (deg - hand(*t)).abs();
            let worst = shown.iter().filter(|(t, _)| *t > 0.5).map(error).fold(0.0, f64::max);
            assert!(worst < allowed_deg, "velocity sent {with_velocity}: {worst} degrees off");
            let step = shown.windows(2).skip(125).map(|p| (p[1].1 - p[0].1).abs()).fold(0.0, f64::max);
            assert!(step < 4.0, "velocity sent {with_velocity}: a step of {step} degrees in 4 ms");
        }
    }

    #[test]
    fn turns_are_unbounded_both_ways_and_16_bits_may_run_over() {
        let far = |t: f64| -2000.0 * t;
        let (tracker, shown) = played(6.0, true, far);
        assert!((shown.last().unwrap().1 + 12_000.0).abs() < 60.0, "{:?}", shown.last());
        assert_eq!(tracker.jumps().0, 0);
        let (tracker, shown) = played(6.0, true, |t| (2000.0 * t + 3276.8) % WRAP_DEG - 3276.8);
        assert!((shown.last().unwrap().1 - 12_000.0).abs() < 60.0, "{:?}", shown.last());
        assert_eq!(tracker.jumps().0, 0);
    }

    #[test]
    fn a_restart_is_silence_not_a_blow() {
        let (tracker, shown) = played(2.0, true, |t| if t < 1.0 { 700.0 } else { 0.0 });
        assert_eq!(tracker.jumps().0, 1);
        assert!(shown.iter().filter(|(t, _)| *t > 1.02).all(|(_, deg)| deg.abs() < 1.0));
    }

    #[test]
    fn prediction_ends_and_a_silent_knob_is_gone() {
        let mut tracker = StockTracker::default();
        tracker.hear(StockMessage::Velocity(100.0), 0);
        tracker.hear(StockMessage::Angle(0.0), 0);
        let mut shown = Vec::new();
        for now_us in (0..1_000_000).step_by(1000) {
            tracker.poll(now_us, &mut |s| shown.push(s));
        }
        let last = shown.last().unwrap();
        assert!((last.angle_deg - 600.0 * 0.08).abs() < 0.1, "{last:?}");
        assert!((196_000..=200_000).contains(&last.host_us), "{last:?}");
    }

    #[test]
    fn zero_is_set_by_panel_and_button() {
        let mut tracker = StockTracker::default();
        let shown = |tracker: &mut StockTracker, now_us| {
            let mut last = 0.0;
            tracker.hear(StockMessage::Angle(-4321.0), now_us);
            tracker.poll(now_us, &mut |s| last = s.angle_deg);
            last
        };
        assert!((shown(&mut tracker, 0) + 432.1).abs() < 0.01);
        tracker.zero();
        assert!(shown(&mut tracker, 40_000).abs() < 0.01);
        let mut tracker = StockTracker::default();
        shown(&mut tracker, 0);
        tracker.hear(StockMessage::Button(5.0), 10_000);
        assert!((shown(&mut tracker, 40_000) + 432.1).abs() < 0.01, "the first count is no press");
        tracker.hear(StockMessage::Button(6.0), 50_000);
        assert!(shown(&mut tracker, 80_000).abs() < 0.01);
    }

    #[test]
    fn a_slap_is_one_slap_with_or_without_its_depth() {
        let mut tracker = StockTracker::default();
        let mut slaps = Vec::new();
        let words = [
            StockMessage::Velocity(-120.0),
            StockMessage::Pluck(true),
            StockMessage::Slap(-0.4),
            StockMessage::Pluck(true),
            StockMessage::Slap(-0.9),
            StockMessage::Pluck(false),
            StockMessage::Slap(0.0),
            // A quick one: only its depth is seen.
            StockMessage::Slap(-0.3),
            StockMessage::Slap(0.0),
        ];
        for (n, word) in words.into_iter().enumerate() {
            slaps.extend(tracker.hear(word, n as i64 * 10_000));
        }
        assert_eq!(slaps.len(), 2, "{slaps:?}");
        assert!((slaps[0] - 12.57).abs() < 0.01, "120 rpm: {slaps:?}");
    }
}
