//! What a link counts and times, for screens and for `chalumeau doctor`.

use crate::wire::WireStats;

/// Arrivals kept for the quantiles: about two seconds at 500 Hz.
const KEPT: usize = 1024;

/// Round trips kept for the quantiles.
const TRIPS: usize = 64;

/// A picture of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkStats {
    /// STATE or OSC angles received each second, over the last second.
    pub rate_hz: f32,
    /// Median lateness of an arrival against the steady clock, us.
    pub jitter_p50_us: u32,
    /// 99th percentile of the same, us.
    pub jitter_p99_us: u32,
    /// STATE received since the knob first answered, or since it has restarted; since the port was opened, if it never answers.
    pub states: u64,
    /// Frames, gaps, duplicates and damaged frames since the port was opened.
    pub wire: WireStats,
    /// HELLO to INFO, us; the latest.
    pub hello_round_trip_us: Option<u32>,
    /// FEEL to the STATE that echoes it, us; median of the latest.
    pub feel_round_trip_us: Option<u32>,
    /// How much faster the host's clock runs than the knob's, parts per million.
    pub skew_ppm: f32,
    /// OSC messages that were none of a knob's, and datagrams that were no OSC; 0 on other links.
    pub ignored: u64,
    /// Times the knob was lost since the link was made.
    pub losses: u32,
}

/// Collects what [`LinkStats`] shows.
#[derive(Clone, Debug)]
pub struct Meter {
    late_us: Vec<u32>,
    next_late: usize,
    trips_us: Vec<u32>,
    next_trip: usize,
    states: u64,
    states_at_second: u64,
    second_us: i64,
    rate_hz: f32,
    pub(super) hello_round_trip_us: Option<u32>,
}

impl Meter {
    /// Begins to count at `now_us`. Allocates; nothing after it does.
    pub fn new(now_us: i64) -> Self {
        Self {
            late_us: Vec::with_capacity(KEPT),
            next_late: 0,
            trips_us: Vec::with_capacity(TRIPS),
            next_trip: 0,
            states: 0,
            states_at_second: 0,
            second_us: now_us,
            rate_hz: 0.0,
            hello_round_trip_us: None,
        }
    }

    /// Counts positions anew from `now_us`.
    pub fn begin(&mut self, now_us: i64) {
        self.late_us.clear();
        self.next_late = 0;
        (self.states, self.states_at_second, self.second_us, self.rate_hz) = (0, 0, now_us, 0.0);
    }

    /// Counts an arrival that came `late_us` after its steady time.
    pub fn state(&mut self, late_us: i64) {
        self.states += 1;
        keep(&mut self.late_us, &mut self.next_late, KEPT, late_us);
    }

    /// Counts the way of a FEEL there and back.
    pub fn feel_echoed(&mut self, round_trip_us: i64) {
        keep(&mut self.trips_us, &mut self.next_trip, TRIPS, round_trip_us);
    }

    /// Lets time pass, so that the rate falls when nothing comes.
    pub fn tick(&mut self, now_us: i64) {
        let since_us = now_us - self.second_us;
        if since_us >= 1_000_000 {
            self.rate_hz = (self.states - self.states_at_second) as f32 * 1e6 / since_us as f32;
            (self.states_at_second, self.second_us) = (self.states, now_us);
        }
    }

    /// The picture, but for what only others know. Sorts: not for every loop.
    pub fn picture(&self) -> LinkStats {
        let mut late = self.late_us.clone();
        late.sort_unstable();
        let mut trips = self.trips_us.clone();
        trips.sort_unstable();
        LinkStats {
            rate_hz: self.rate_hz,
            jitter_p50_us: quantile(&late, 0.5).unwrap_or(0),
            jitter_p99_us: quantile(&late, 0.99).unwrap_or(0),
            states: self.states,
            hello_round_trip_us: self.hello_round_trip_us,
            feel_round_trip_us: quantile(&trips, 0.5),
            ..LinkStats::default()
        }
    }
}

fn keep(ring: &mut Vec<u32>, next: &mut usize, capacity: usize, value: i64) {
    let value = u32::try_from(value.max(0)).unwrap_or(u32::MAX);
    if ring.len() < capacity {
        ring.push(value);
    } else {
        ring[*next] = value;
        *next = (*next + 1) % capacity;
    }
}

/// The value below which `part` of `sorted` lies.
fn quantile(sorted: &[u32], part: f64) -> Option<u32> {
    sorted.get(((sorted.len() as f64 * part) as usize).min(sorted.len().saturating_sub(1))).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_the_latest_arrivals() {
        let mut meter = Meter::new(0);
        for _ in 0..KEPT {
            meter.state(90_000);
        }
        for late in 0..KEPT as i64 {
            meter.state(late);
        }
        let picture = meter.picture();
        assert_eq!((picture.jitter_p50_us, picture.jitter_p99_us), (512, 1013));
        assert_eq!(picture.states, 2 * KEPT as u64);
    }

    #[test]
    fn rate_falls_to_nothing_when_nothing_comes() {
        let mut meter = Meter::new(0);
        for n in 0..=500i64 {
            meter.state(0);
            meter.tick(n * 2000);
        }
        assert!((meter.picture().rate_hz - 501.0).abs() < 1.0);
        meter.tick(2_000_000);
        assert_eq!(meter.picture().rate_hz, 0.0);
    }
}
