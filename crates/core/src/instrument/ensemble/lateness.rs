//! How much later than the first one a player of a section begins and ends the notes that all play.
//!
//! Voices that begin at the same sample begin in the same phase: their sum is far louder than the notes that follow, and a
//! section sounds as one large clarinet with an accent. Players of small ensembles begin 30 to 50 ms apart, as a standard
//! deviation (Rasch, Synchronization in performed ensemble music, Acustica 43, 1979).

use std::collections::VecDeque;

use crate::dsp::white::White;
use crate::event::Event;

/// Events that can wait; more let the oldest through early.
const MOST: usize = 64;
/// Seed of the lone player, of which each makes its own.
const SEED: u64 = 0x0A5E_7060;
/// Range of [`White`], which is uniform, either way.
const WHITE: f64 = 1.732_050_807_568_877_2;

/// Events of a note that wait until this player gets to them, in their order.
#[derive(Clone, Debug)]
pub(super) struct Lateness {
    seed: u64,
    white: White,
    /// How late the latest note begins, 0..=1 of what is asked for. It ends as late, so that it keeps its length.
    share: f64,
    /// Samples until each is due, and the event.
    waiting: VecDeque<(u32, Event)>,
}

impl Lateness {
    /// Of the player with this seed. Allocates.
    pub fn new(seed: impl FnOnce(u64) -> u64) -> Self {
        let seed = seed(SEED);
        Self { seed, white: White::new(seed), share: 0.0, waiting: VecDeque::with_capacity(MOST) }
    }

    /// Takes an event that comes now, to be due at a time of its own up to `most` samples later and never before an earlier
    /// one; what no longer fits is due at once. Real-time safe.
    pub fn take(&mut self, event: Event, most: f64) -> Option<Event> {
        if !matches!(event, Event::NoteOff { .. }) {
            self.share = 0.5 + 0.5 * self.white.next() / WHITE;
        }
        let earliest = self.waiting.back().map_or(0, |&(samples, _)| samples);
        let samples = ((self.share * most) as u32).max(earliest);
        if samples == 0 && self.waiting.is_empty() {
            return Some(event);
        }
        let early = if self.waiting.len() == MOST { self.waiting.pop_front() } else { None };
        self.waiting.push_back((samples, event));
        early.map(|(_, event)| event)
    }

    /// The next event that is due, if one is.
    pub fn due(&mut self) -> Option<Event> {
        self.waiting.pop_front_if(|(samples, _)| *samples == 0).map(|(_, event)| event)
    }

    /// The next event, due or not.
    pub fn next(&mut self) -> Option<Event> {
        self.waiting.pop_front().map(|(_, event)| event)
    }

    /// Samples until the next event is due.
    pub fn reach(&self) -> usize {
        self.waiting.front().map_or(usize::MAX, |&(samples, _)| samples as usize)
    }

    /// So many samples have passed, [`reach`](Self::reach) at most.
    pub fn pass(&mut self, samples: usize) {
        self.waiting.iter_mut().for_each(|(left, _)| *left = left.saturating_sub(samples as u32));
    }

    /// Whether no event waits.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Forgets what waits.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }

    /// As after switching on, so that every render repeats.
    pub fn reset(&mut self) {
        self.forget();
        (self.white, self.share) = (White::new(self.seed), 0.0);
    }

    /// Goes on where another was. Real-time safe.
    pub fn carry_on(&mut self, from: &Self) {
        (self.white, self.share) = (from.white, from.share);
        self.waiting.clear();
        self.waiting.extend(from.waiting.iter().copied());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::SoundingNote;

    fn on(key: u8) -> Event {
        Event::NoteOn { note: SoundingNote(key), velocity: 0.5 }
    }

    /// When each of these events, struck `every` samples apart, is due, and which it is.
    fn heard(lateness: &mut Lateness, count: u8, every: usize, most: f64) -> Vec<(usize, Event)> {
        let mut heard = Vec::new();
        for at in 0..usize::from(count) * every + most as usize + 1 {
            if at % every == 0 && at / every < usize::from(count) {
                heard.extend(lateness.take(on((at / every) as u8), most).map(|event| (at, event)));
            }
            while let Some(event) = lateness.due() {
                heard.push((at, event));
            }
            lateness.pass(1);
        }
        assert!(lateness.is_empty());
        heard
    }

    #[test]
    fn events_keep_their_order_and_are_late_by_all_of_the_range() {
        const MOST_LATE: usize = 1_000;
        let mut lateness = Lateness::new(|lone| lone ^ 7);
        let far = heard(&mut lateness, 100, 2 * MOST_LATE, MOST_LATE as f64);
        let late: Vec<usize> = far.iter().zip(0..).map(|((at, _), nth)| at - nth * 2 * MOST_LATE).collect();
        assert!(late.iter().all(|&late| late <= MOST_LATE));
        let mean = late.iter().sum::<usize>() as f64 / 100.0;
        // 29 is the deviation of the mean of so many.
        assert!((mean - 500.0).abs() < 90.0, "{mean}");
        assert!(late.iter().min() < Some(&50) && late.iter().max() > Some(&950));
        let close = heard(&mut lateness, 60, 10, MOST_LATE as f64);
        let keys: Vec<Event> = close.iter().map(|&(_, event)| event).collect();
        assert_eq!(keys, (0..60).map(on).collect::<Vec<_>>());
    }

    #[test]
    fn nothing_waits_without_a_range_and_more_than_fit_let_the_oldest_through() {
        let mut lateness = Lateness::new(|lone| lone);
        assert_eq!((0..9).filter_map(|key| lateness.take(on(key), 0.0)).count(), 9);
        let early: Vec<Event> = (0..100).filter_map(|key| lateness.take(on(key), 1e6)).collect();
        assert_eq!(early, (0..36).map(on).collect::<Vec<_>>());
    }

    #[test]
    fn a_note_keeps_its_length() {
        let mut lateness = Lateness::new(|lone| lone ^ 7);
        for key in 0..50 {
            let mut begun = None;
            for at in 0..2_000 {
                let now = match at {
                    0 => lateness.take(on(key), 1_000.0),
                    300 => lateness.take(Event::NoteOff { note: SoundingNote(key) }, 1_000.0),
                    _ => None,
                };
                match now.or_else(|| lateness.due()) {
                    Some(Event::NoteOn { .. }) => begun = Some(at),
                    Some(_) => assert_eq!(begun.take(), Some(at - 300)),
                    None => {}
                }
                lateness.pass(1);
            }
            assert_eq!((begun, lateness.is_empty()), (None, true));
        }
    }

    #[test]
    fn a_reset_repeats_and_another_player_differs() {
        let mut lateness = Lateness::new(|lone| lone ^ 7);
        let first = heard(&mut lateness, 10, 2_000, 1_000.0);
        assert_ne!(heard(&mut lateness, 10, 2_000, 1_000.0), first);
        lateness.reset();
        assert_eq!(heard(&mut lateness, 10, 2_000, 1_000.0), first);
        assert_ne!(heard(&mut Lateness::new(|lone| lone ^ 8), 10, 2_000, 1_000.0), first);
    }
}
