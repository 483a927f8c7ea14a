//! How much later than the first one a player of a section gets the notes that all play, and what belongs to them.
//!
//! Voices that begin at the same sample begin in the same phase: their sum is far louder than the notes that follow, and a
//! section sounds as one large clarinet with an accent. Players of small ensembles begin 30 to 50 ms apart, as a standard
//! deviation (Rasch, Synchronization in performed ensemble music, Acustica 43, 1979). Here all follow one hand on a keyboard, which must not
//! feel late; the setting's default is less, and enough against the accent.

use std::collections::VecDeque;

use crate::dsp::white::White;
use crate::event::Event;

/// Events that can wait; more let the oldest through early.
const MOST: usize = 64;
/// Seed of the lone player, of which each makes its own.
const SEED: u64 = 0x0A5E_7060;

/// Events that wait until this player gets to them, in their order.
#[derive(Debug)]
pub(super) struct Lateness {
    seed: u64,
    white: White,
    /// How late the next note is, 0..=1 of what is asked for, and what comes with it.
    share: f64,
    /// How late the latest note has become, samples. It ends as late, so that it keeps its length.
    late: u32,
    /// Samples until each is due, and the event.
    waiting: VecDeque<(u32, Event)>,
}

impl Lateness {
    /// Of the player with this seed. Allocates.
    pub fn new(seed: impl FnOnce(u64) -> u64) -> Self {
        let waiting = VecDeque::with_capacity(MOST);
        let mut new = Self { seed: seed(SEED), white: White::new(0), share: 0.0, late: 0, waiting };
        new.reset();
        new
    }

    /// Takes an event that comes now, to be due at a time of its own up to `most` samples later and never before an earlier
    /// one; what no longer fits is due at once. Real-time safe.
    pub fn take(&mut self, event: Event, most: f64) -> Option<Event> {
        let earliest = self.waiting.back().map_or(0, |&(samples, _)| samples);
        let wanted = match event {
            Event::NoteOff { .. } => self.late.min(most as u32),
            _ => (self.share * most) as u32,
        };
        let samples = wanted.max(earliest);
        if matches!(event, Event::NoteOn { .. }) {
            (self.late, self.share) = (samples, self.white.unit());
        }
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
        self.white = White::new(self.seed);
        (self.share, self.late) = (self.white.unit(), 0);
    }

    /// Goes on where another was. Real-time safe.
    pub fn carry_on(&mut self, from: &Self) {
        (self.white, self.share, self.late) = (from.white, from.share, from.late);
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
    fn notes_keep_their_length_however_close_they_are_and_what_comes_with_one_is_as_late() {
        let off = |key| Event::NoteOff { note: SoundingNote(key) };
        let bend = |key| Event::Bend { cents: f32::from(key) };
        let mut lateness = Lateness::new(|lone| lone ^ 7);
        let (mut due, mut at) = (Vec::new(), 0);
        for key in 0..100 {
            // Of 300 samples each, 20 apart: the next one often comes before the one before has ended.
            for (event, wait) in [(bend(key), 0), (on(key), 300), (off(key), 20)] {
                due.extend(lateness.take(event, 1_000.0).map(|event| (at, event)));
                for _ in 0..wait {
                    while let Some(event) = lateness.due() {
                        due.push((at, event));
                    }
                    lateness.pass(1);
                    at += 1;
                }
            }
        }
        for _ in 0..1_001 {
            while let Some(event) = lateness.due() {
                due.push((at, event));
            }
            lateness.pass(1);
            at += 1;
        }
        let begins = |wanted: Event| due.iter().find(|(_, event)| *event == wanted).unwrap().0;
        for key in 0..100 {
            assert_eq!(begins(on(key)), begins(bend(key)), "{key}");
            // Where the next note begins earlier it waits for this one's end.
            assert_eq!(begins(off(key)) - begins(on(key)), 300, "{key}");
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
