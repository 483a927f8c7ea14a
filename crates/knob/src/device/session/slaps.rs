//! Each slap once, though EVENT brings its speed and STATE its count, and either may be lost or come first.

/// A slap that STATE counts and of which no EVENT comes within this much is made up, us.
const PATIENCE_US: i64 = 20_000;

/// Peak speed of a slap of which only the count arrived, rad/s: an easy flick of the wrist. By judgement.
const UNKNOWN_RAD_S: f32 = 10.0;

/// See the module.
#[derive(Debug, Default)]
pub struct Slaps {
    counted: Option<u8>,
    /// EVENTs that STATE has not counted yet.
    ahead: u8,
    /// Slaps that STATE has counted without an EVENT, and since when.
    missing: u8,
    since_us: i64,
}

impl Slaps {
    /// EVENT slap, which is heard in any case.
    pub fn event(&mut self) {
        if self.missing > 0 {
            self.missing -= 1;
        } else {
            self.ahead = self.ahead.saturating_add(1);
        }
    }

    /// STATE with its count of slaps.
    pub fn state(&mut self, count: u8, now_us: i64) {
        let Some(counted) = self.counted.replace(count) else {
            self.ahead = 0;
            return;
        };
        let new = count.wrapping_sub(counted);
        // More than a hand makes between two STATE: the device began anew.
        if new > 8 {
            (self.ahead, self.missing) = (0, 0);
            return;
        }
        let unannounced = new.saturating_sub(self.ahead);
        self.ahead = self.ahead.saturating_sub(new);
        if unannounced > 0 {
            if self.missing == 0 {
                self.since_us = now_us;
            }
            self.missing = self.missing.saturating_add(unannounced);
        }
    }

    /// Peak speed of a slap whose EVENT did not come in time, rad/s.
    pub fn poll(&mut self, now_us: i64) -> Option<f32> {
        (self.missing > 0 && now_us - self.since_us > PATIENCE_US).then(|| {
            self.missing -= 1;
            UNKNOWN_RAD_S
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slap_sounds_once_whichever_word_of_it_arrives() {
        for (says_event_ms, says_state_ms) in
            [(Some(10), Some(12)), (Some(12), Some(10)), (Some(10), None), (None, Some(10))]
        {
            let mut slaps = Slaps::default();
            let mut heard = 0;
            for ms in 0..100 {
                if says_event_ms == Some(ms) {
                    slaps.event();
                    heard += 1;
                }
                // STATE counts on from 255, every 2 ms; one that is lost is made good by the next.
                let count = if says_state_ms.is_some_and(|at| ms >= at) { 0 } else { 255 };
                if ms % 2 == 0 {
                    slaps.state(count, ms * 1000);
                }
                heard += u32::from(slaps.poll(ms * 1000).is_some());
            }
            assert_eq!(heard, 1, "EVENT at {says_event_ms:?}, STATE from {says_state_ms:?}");
        }
    }

    #[test]
    fn more_slaps_without_a_word_than_can_be_counted_are_as_many_as_can() {
        let mut slaps = Slaps::default();
        for n in 0..64_u8 {
            slaps.state(n.wrapping_mul(8), 0);
        }
        let heard = (0..1_000).filter(|_| slaps.poll(1_000_000).is_some()).count();
        assert_eq!(heard, 255);
    }

    #[test]
    fn a_count_from_another_life_is_no_slap() {
        let mut slaps = Slaps::default();
        slaps.state(200, 0);
        slaps.state(0, 2000);
        assert_eq!(slaps.poll(1_000_000), None);
    }
}
