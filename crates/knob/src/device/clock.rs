//! One clock read by another, through a link that delays at random.
//!
//! Delay is never negative and now and then nearly its least, so the earliest arrivals tell how the clocks stand: over a
//! sliding window the line below all points `(remote time, arrival - remote time)` that comes closest to them is an edge
//! of their lower convex hull (Moon, Skelly and Towsley 1999 pose it as a linear program; the hull is its solution). What
//! it cannot know is the least delay itself, which stays in the offset as a constant.
//!
//! Times are microseconds. Fixed size, no allocation: the audio thread uses it for its own timeline. Real-time safe.

/// Length of one bucket, of which only the earliest arrival is kept, us. By judgement: over a hundred arrivals at 500 Hz.
const BUCKET_US: i64 = 250_000;

/// Buckets in the window: 8 s. At 100 ppm a clock walks 0.8 ms in that time, well above the noise of the minima, so the
/// slope is found; a change of the least delay is forgotten after it.
const BUCKETS: usize = 32;

/// No crystal is worse; a slope beyond it is noise, parts per million.
const MOST_PPM: f64 = 500.0;

/// Before this much has been seen the slope is taken as zero, us: noise of 0.1 ms over 1.5 s is 70 ppm.
const SLOPE_AFTER_US: i64 = 1_500_000;

#[derive(Clone, Copy, Debug, Default)]
struct Point {
    remote_us: i64,
    excess_us: i64,
}

/// Remote time to local time. See the module.
#[derive(Clone, Debug)]
pub struct ClockFit {
    /// Ring of the earliest arrival of each bucket; the newest stands at `newest`.
    points: [Point; BUCKETS],
    used: usize,
    newest: usize,
    bucket: i64,
    /// local = remote + base + slope (remote - origin)
    base_us: f64,
    slope: f64,
    origin_us: i64,
    /// Since when every arrival has been later than `slack_us` beyond the line.
    late_since_us: Option<i64>,
    slack_us: i64,
    patience_us: i64,
}

impl ClockFit {
    /// Arrivals that are all later than `slack_us` during `patience_us` mean that the clock itself was set: begin anew.
    pub fn new(slack_us: i64, patience_us: i64) -> Self {
        Self {
            points: [Point::default(); BUCKETS],
            used: 0,
            newest: 0,
            bucket: 0,
            base_us: 0.0,
            slope: 0.0,
            origin_us: 0,
            late_since_us: None,
            slack_us,
            patience_us,
        }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        *self = Self::new(self.slack_us, self.patience_us);
    }

    /// Takes in that remote time `remote_us` was seen at local time `local_us`.
    pub fn observe(&mut self, remote_us: i64, local_us: i64) {
        let excess_us = local_us - remote_us;
        if self.used == 0 {
            self.begin(remote_us, excess_us);
            return;
        }
        let late_us = excess_us as f64 - self.excess_at(remote_us);
        if late_us > self.slack_us as f64 {
            let since = *self.late_since_us.get_or_insert(local_us);
            if local_us - since > self.patience_us {
                self.begin(remote_us, excess_us);
                return;
            }
        } else {
            self.late_since_us = None;
        }
        let bucket = remote_us.div_euclid(BUCKET_US);
        let point = Point { remote_us, excess_us };
        if bucket != self.bucket {
            self.bucket = bucket;
            self.newest = (self.newest + 1) % BUCKETS;
            self.used = (self.used + 1).min(BUCKETS);
            self.points[self.newest] = point;
            self.fit();
        } else if excess_us < self.points[self.newest].excess_us {
            self.points[self.newest] = point;
            if late_us < 0.0 {
                self.fit();
            }
        }
    }

    /// Local time at which `remote_us` would have been seen with the least delay.
    pub fn local_us(&self, remote_us: i64) -> i64 {
        remote_us + self.excess_at(remote_us).round() as i64
    }

    /// How much faster the local clock runs, parts per million.
    pub fn skew_ppm(&self) -> f64 {
        self.slope * 1e6
    }

    fn begin(&mut self, remote_us: i64, excess_us: i64) {
        self.points[0] = Point { remote_us, excess_us };
        (self.used, self.newest) = (1, 0);
        self.bucket = remote_us.div_euclid(BUCKET_US);
        (self.base_us, self.slope, self.origin_us) = (excess_us as f64, 0.0, remote_us);
        self.late_since_us = None;
    }

    fn excess_at(&self, remote_us: i64) -> f64 {
        self.base_us + self.slope * (remote_us - self.origin_us) as f64
    }

    /// The newest is 0.
    fn point(&self, age: usize) -> Point {
        self.points[(self.newest + BUCKETS - age) % BUCKETS]
    }

    /// Lays the line below all points that is closest to them on average: the hull's edge over their mean time.
    fn fit(&mut self) {
        let (newest, oldest) = (self.point(0), self.point(self.used - 1));
        self.origin_us = newest.remote_us;
        let since = |p: Point| (p.remote_us - newest.remote_us) as f64;
        let mean = (0..self.used).map(|age| since(self.point(age))).sum::<f64>() / self.used as f64;
        let mut slope = 0.0;
        if newest.remote_us - oldest.remote_us >= SLOPE_AFTER_US {
            // How high a line of this slope can be raised below all points, seen at their mean. A minimum of straight
            // lines is concave, so ternary search finds its top within the slopes a crystal allows.
            let below = |slope: f64| {
                (0..self.used)
                    .map(|age| self.point(age))
                    .map(|p| p.excess_us as f64 + slope * (mean - since(p)))
                    .fold(f64::INFINITY, f64::min)
            };
            let (mut low, mut high) = (-MOST_PPM * 1e-6, MOST_PPM * 1e-6);
            for _ in 0..40 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                if below(a) < below(b) {
                    low = a;
                } else {
                    high = b;
                }
            }
            slope = (low + high) / 2.0;
        }
        self.slope = slope;
        self.base_us = (0..self.used)
            .map(|age| self.point(age))
            .map(|p| p.excess_us as f64 - slope * since(p))
            .fold(f64::INFINITY, f64::min);
    }
}

/// A device's 32 bit microseconds on the host's clock. Wraps are followed, a reboot is noticed.
#[derive(Clone, Debug)]
pub struct DeviceClock {
    fit: ClockFit,
    last: Option<(u32, i64)>,
}

/// Frames of one direction never overtake each other, yet a device may stamp before it queues: us.
const REORDER_US: i32 = 20_000;

/// How far a device may run ahead of the host between two frames before it counts as another clock, us.
const LEAP_US: i64 = 1_000_000;

impl Default for DeviceClock {
    fn default() -> Self {
        // By judgement: a link on which everything is 4 ms late for as long has another least delay now, or its device has
        // stood still; to go on with the old one would be to guess where the knob is.
        Self { fit: ClockFit::new(4_000, 400_000), last: None }
    }
}

impl DeviceClock {
    /// Takes in a stamp; true when it comes from another run of the device than the one before.
    pub fn observe(&mut self, t_us: u32, host_us: i64) -> bool {
        let Some((last_t, last_remote)) = self.last else {
            self.last = Some((t_us, i64::from(t_us)));
            self.fit.observe(i64::from(t_us), host_us);
            return false;
        };
        let step = t_us.wrapping_sub(last_t) as i32;
        let remote = last_remote + i64::from(step);
        let is_ahead = host_us - self.fit.local_us(remote) < -LEAP_US;
        if step < -REORDER_US || is_ahead {
            self.fit.reset();
            self.last = Some((t_us, i64::from(t_us)));
            self.fit.observe(i64::from(t_us), host_us);
            return true;
        }
        if step > 0 {
            self.last = Some((t_us, remote));
        }
        self.fit.observe(remote, host_us);
        false
    }

    /// Host time of a stamp near the last one observed; `None` before the first.
    pub fn host_us(&self, t_us: u32) -> Option<i64> {
        let (last_t, last_remote) = self.last?;
        Some(self.fit.local_us(last_remote + i64::from(t_us.wrapping_sub(last_t) as i32)))
    }

    /// How much faster the host's clock runs, parts per million.
    pub fn skew_ppm(&self) -> f64 {
        self.fit.skew_ppm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// xorshift, 0..1.
    struct Dice(u64);

    impl Dice {
        fn roll(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        /// Delay of a USB serial line in us: 300 at least, usually below a few ms, now and then 20 ms.
        fn delay_us(&mut self) -> f64 {
            let often = 300.0 - 800.0 * self.roll().max(1e-9).ln();
            if self.roll() < 0.005 { often + 20_000.0 } else { often }
        }
    }

    /// Worst error of the mapping once `settle_s` has passed, beyond the least delay, us.
    fn worst_error_us(ppm: f64, seconds: f64, settle_s: f64, first_t: u32) -> f64 {
        let mut clock = DeviceClock::default();
        let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
        let mut worst = 0.0f64;
        for n in 0..(seconds * 500.0) as u64 {
            let device_us = n as f64 * 2000.0;
            let true_us = 5e6 + device_us * (1.0 + ppm * 1e-6);
            let t_us = first_t.wrapping_add(device_us as u32);
            assert!(!clock.observe(t_us, (true_us + dice.delay_us()) as i64), "no reboot at {n}");
            if device_us > settle_s * 1e6 {
                let error = clock.host_us(t_us).unwrap() as f64 - (true_us + 300.0);
                worst = worst.max(error.abs());
            }
        }
        worst
    }

    #[test]
    fn stamps_are_placed_within_0_3_ms_under_jitter_and_skew() {
        for ppm in [-100.0, 0.0, 100.0] {
            let worst = worst_error_us(ppm, 60.0, 1.0, 0);
            println!("{ppm} ppm: at worst {worst:.0} us");
            assert!(worst < 300.0, "{ppm} ppm: {worst} us");
        }
    }

    #[test]
    fn a_wrap_of_the_device_clock_goes_unnoticed() {
        let worst = worst_error_us(100.0, 20.0, 1.0, u32::MAX - 10_000_000);
        assert!(worst < 300.0, "{worst} us");
    }

    #[test]
    fn a_reboot_is_noticed_and_followed() {
        let mut clock = DeviceClock::default();
        for n in 0..2000u32 {
            clock.observe(7_000_000 + n * 2000, i64::from(n) * 2000 + 400);
        }
        let mut noticed = 0;
        for n in 0..100u32 {
            noticed += u32::from(clock.observe(90_000 + n * 2000, 6_000_000 + i64::from(n) * 2000));
        }
        assert_eq!(noticed, 1);
        let error = clock.host_us(90_000).unwrap() - 6_000_000;
        assert!(error.abs() < 300, "{error} us");
    }

    #[test]
    fn a_stall_of_the_host_moves_nothing() {
        let mut clock = DeviceClock::default();
        for n in 0..2000i64 {
            // From 2 to 2.3 s nothing is read; then it all arrives at once.
            let (sent_us, stall) = (n * 2000, 2_000_000..2_300_000);
            let seen_us = if stall.contains(&sent_us) { stall.end } else { sent_us } + 500;
            assert!(!clock.observe(sent_us as u32, seen_us));
            let error = clock.host_us(sent_us as u32).unwrap() - (sent_us + 500);
            assert!(error.abs() < 300, "{error} us at {sent_us}");
        }
    }

    #[test]
    fn a_clock_set_back_for_good_is_believed_after_a_second() {
        let mut fit = ClockFit::new(50_000, 1_000_000);
        for n in 0..5000i64 {
            let late = if n >= 1000 { 700_000 } else { 0 };
            fit.observe(n * 2000, n * 2000 + late);
        }
        assert!((fit.local_us(10_000_000) - 10_700_000).abs() < 300);
    }
}
