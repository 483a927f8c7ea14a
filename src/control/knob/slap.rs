//! Tongue slaps from a knob: that one happened, and how hard.
//!
//! A knob of ours says so twice: EVENT carries the peak speed, and the counter in STATE shows a slap whose EVENT was
//! lost. Unmodified firmware says it by OSC: `pluck` while the knob is in the slap region and `st`, how deep it went,
//! which is gone by the time `pluck` ends.

use crate::wire::{Event, EventKind, Flags, State};

/// Speed of the hardest slap, rad/s: what a knob may turn at before it is switched off.
const FULL_SPEED_RAD_S: f64 = 60.0;
/// Softest slap: below this nothing would be heard (by judgement).
const LEAST_STRENGTH: f32 = 0.05;
/// How long a slap that STATE has counted waits for its EVENT, microseconds of the device's clock.
const PATIENCE_US: u32 = 10_000;
/// `st` of unmodified firmware at the end of the slap region's slope: beyond, it says -1.
const STOCK_SLOPE_END: f32 = -1.0 / 3.0;
/// A slap over OSC of which no `st` came in time (by judgement).
const UNKNOWN_STRENGTH: f32 = 0.4;

/// Finds slaps in what a knob sends, each one once. Real-time safe.
#[derive(Clone, Copy, Debug, Default)]
pub struct SlapDetector {
    /// Counter of the last STATE.
    slaps: Option<u8>,
    /// Counter of the last EVENT.
    last_event: Option<u8>,
    /// Slaps heard from EVENT that STATE has not counted yet.
    ahead: u8,
    /// Slaps counted by STATE whose EVENT has not come, and since when.
    behind: u8,
    behind_since_us: u32,
    /// Greatest speed that STATE has shown in the slap region, rad/s.
    peak_rad_s: f64,
    plucked: bool,
    deepest: f32,
}

/// Strength of a peak speed.
fn strength(speed_rad_s: f64) -> f32 {
    let unit = (speed_rad_s.abs() / FULL_SPEED_RAD_S) as f32;
    if unit.is_finite() { unit.clamp(LEAST_STRENGTH, 1.0) } else { LEAST_STRENGTH }
}

impl SlapDetector {
    /// Forgets all counters: for a new session or a knob that came back.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes any EVENT; gives the strength, 0..=1, if it is a slap not yet heard of.
    pub fn event(&mut self, event: &Event) -> Option<f32> {
        let is_again = self.last_event.replace(event.counter) == Some(event.counter);
        if event.kind != EventKind::Slap || is_again {
            return None;
        }
        if self.behind > 0 {
            self.behind -= 1;
        } else {
            self.ahead = self.ahead.saturating_add(1);
        }
        self.peak_rad_s = 0.0;
        Some(strength(event.value.into()))
    }

    /// Takes every STATE; gives the strength, 0..=1, of a slap whose EVENT was lost.
    pub fn state(&mut self, state: &State) -> Option<f32> {
        if state.flags.has(Flags::SLAP) {
            self.peak_rad_s = self.peak_rad_s.max(state.velocity_rad_s().abs());
        }
        // What was counted before the first STATE is not news.
        let last = self.slaps.replace(state.slaps).unwrap_or(state.slaps);
        match state.slaps.wrapping_sub(last) {
            0 => {}
            // So many at once is a knob that started anew.
            128.. => (self.ahead, self.behind) = (0, 0),
            more => {
                let heard = more.min(self.ahead);
                self.ahead -= heard;
                if self.behind == 0 {
                    self.behind_since_us = state.t_us;
                }
                self.behind = self.behind.saturating_add(more - heard);
            }
        }
        if self.behind == 0 || state.t_us.wrapping_sub(self.behind_since_us) < PATIENCE_US {
            return None;
        }
        // Several slaps within the patience were one to the ear.
        self.behind = 0;
        let peak_rad_s = std::mem::take(&mut self.peak_rad_s);
        Some(strength(peak_rad_s))
    }

    /// Takes `st` of unmodified firmware: -1..=0, the deepest of the slap in progress.
    pub fn stock_st(&mut self, st: f32) {
        if st.is_finite() {
            self.deepest = self.deepest.min(st);
        }
    }

    /// Takes `pluck` of unmodified firmware; gives the strength, 0..=1, when it ends: when the tongue lets go.
    pub fn stock_pluck(&mut self, is_plucked: bool) -> Option<f32> {
        let was_plucked = std::mem::replace(&mut self.plucked, is_plucked);
        if is_plucked || !was_plucked {
            return None;
        }
        let deepest = std::mem::take(&mut self.deepest);
        Some(if deepest < 0.0 {
            (deepest / STOCK_SLOPE_END).clamp(LEAST_STRENGTH, 1.0)
        } else {
            UNKNOWN_STRENGTH
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slap(counter: u8, value: f32) -> Event {
        Event { kind: EventKind::Slap, counter, code: 0, feel_id: 0, t_us: 0, value }
    }

    fn state(t_us: u32, slaps: u8) -> State {
        State { t_us, slaps, ..State::default() }
    }

    #[test]
    fn event_and_counter_are_one_slap_in_either_order() {
        for event_first in [true, false] {
            let mut detector = SlapDetector::default();
            assert_eq!(detector.state(&state(0, 7)), None, "old slaps are not news");
            let mut heard = Vec::new();
            if event_first {
                heard.extend(detector.event(&slap(1, 30.0)));
            }
            heard.extend(detector.state(&state(2_000, 8)));
            if !event_first {
                heard.extend(detector.event(&slap(1, 30.0)));
            }
            heard.extend((2..100).filter_map(|i| detector.state(&state(2_000 * i, 8))));
            assert_eq!(heard, [0.5], "event first: {event_first}");
        }
    }

    #[test]
    fn lost_event_is_made_up_from_the_states() {
        let mut detector = SlapDetector::default();
        let slapping = |t_us, velocity| State { velocity, flags: Flags(Flags::SLAP), ..state(t_us, 255) };
        assert_eq!(detector.state(&slapping(0, -2_400)), None);
        assert_eq!(detector.state(&slapping(2_000, 2_292)), None);
        let heard: Vec<_> = (2..100)
            .filter_map(|i| detector.state(&state(2_000 * i, 0)).map(|strength| (i, strength)))
            .collect();
        // 240 rpm are 25.1 rad/s. The counter wraps from 255 to 0.
        assert_eq!(heard.len(), 1);
        assert_eq!(heard[0].0, 7, "10 ms after the counter");
        assert!((heard[0].1 - 0.4189).abs() < 1e-3, "{heard:?}");
    }

    #[test]
    fn repeated_and_other_events_are_no_slaps() {
        let mut detector = SlapDetector::default();
        assert_eq!(detector.event(&slap(4, 60.0)), Some(1.0));
        assert_eq!(detector.event(&slap(4, 60.0)), None);
        assert_eq!(detector.event(&Event { kind: EventKind::Button, ..slap(5, 60.0) }), None);
        assert_eq!(detector.event(&slap(6, 1e9)), Some(1.0));
        assert_eq!(detector.event(&slap(7, 0.0)), Some(LEAST_STRENGTH));
    }

    #[test]
    fn restarted_knob_slaps_only_when_slapped() {
        let mut detector = SlapDetector::default();
        detector.state(&state(5_000_000, 9));
        let heard = (0..100).filter_map(|i| detector.state(&state(2_000 * i, 0))).count();
        assert_eq!(heard, 0);
        assert_eq!(detector.event(&slap(1, 12.0)), Some(0.2));
    }

    #[test]
    fn stock_firmware_slaps_when_the_tongue_lets_go() {
        let mut detector = SlapDetector::default();
        assert_eq!(detector.stock_pluck(false), None);
        assert_eq!(detector.stock_pluck(true), None);
        detector.stock_st(-0.1);
        detector.stock_st(-0.2);
        detector.stock_st(0.0);
        let strength = detector.stock_pluck(false).unwrap();
        assert!((strength - 0.6).abs() < 1e-6, "{strength}");
        detector.stock_pluck(true);
        detector.stock_st(-1.0);
        assert_eq!(detector.stock_pluck(false), Some(1.0));
        detector.stock_pluck(true);
        assert_eq!(detector.stock_pluck(false), Some(UNKNOWN_STRENGTH), "`st` vanished before it was read");
    }
}
