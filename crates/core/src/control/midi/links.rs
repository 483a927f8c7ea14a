//! Controllers that a player has linked to settings: a hardware knob that turns *Growl*, a pedal that blows.
//!
//! A linked controller does what it is linked to and nothing else; one controller may do several things, and several the
//! same. Its 128 values go from one end of a range to the other, along a curve. Until it moves, the setting has its own
//! value, to which it goes back when that is changed or the link is taken away: whoever moved last is heard.

use crate::event::{Event, SettingNumber};
use crate::maths;

/// Links that one player can have.
pub const MOST: usize = 24;

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A controller of any channel, 0..=127.
    Controller(u8),
    /// Channel pressure (aftertouch).
    Pressure,
}

impl Source {
    /// Whether it can be linked: bank, data entry, parameter numbers, the pedal and channel mode messages cannot.
    pub fn is_free(self) -> bool {
        match self {
            Self::Controller(cc) => !matches!(cc, 0 | 6 | 32 | 38 | 64 | 96..=101 | 120..),
            Self::Pressure => true,
        }
    }
}

/// What is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// The breath, 0..=1.
    Breath,
    /// A number of the settings.
    Number(SettingNumber),
}

/// One controller, tied to one target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// What moves.
    pub source: Source,
    /// What is moved.
    pub target: Target,
    /// The target's value at the controller's 0, in its own unit.
    pub low: f32,
    /// The same at 127; it may lie below `low`.
    pub high: f32,
    /// Exponent of the way from low to high: 1 is straight, above 1 slow to begin.
    pub curve: f32,
    /// The target's value while the controller has not spoken.
    pub own: f32,
}

impl Link {
    /// The target's value at a controller's value, 0..=127.
    ///
    /// ```
    /// use chalumeau_core::control::midi::links::{Link, Source, Target};
    ///
    /// let source = Source::Controller(21);
    /// let link = Link { source, target: Target::Breath, low: 1.0, high: 0.5, curve: 1.0, own: 0.0 };
    /// assert_eq!((link.value(0), link.value(127)), (1.0, 0.5));
    /// ```
    pub fn value(&self, raw: u8) -> f32 {
        let unit = f32::from(raw.min(127)) / 127.0;
        let way = if self.curve == 1.0 { unit } else { maths::single::pow(unit, self.curve) };
        self.low + (self.high - self.low) * way
    }

    fn event(&self, value: f32) -> Event {
        match self.target {
            Target::Breath => Event::Breath(value),
            Target::Number(number) => Event::Set(number, value),
        }
    }
}

/// What the controllers of all links have said last, 0..=127.
pub type Raws = [Option<u8>; MOST];

/// All links, and what their controllers have said.
#[derive(Clone, Copy, Debug, Default)]
pub struct Links {
    all: [Option<Link>; MOST],
    raws: Raws,
}

impl Links {
    /// Whether a source is linked.
    pub fn has(&self, source: Source) -> bool {
        self.all.iter().flatten().any(|link| link.source == source)
    }

    /// Whether a source moves only what each of several players can have for itself; `None` if it is not linked.
    pub fn is_of_player(&self, source: Source) -> Option<bool> {
        let mut its = self.all.iter().flatten().filter(|link| link.source == source).peekable();
        its.peek()?;
        Some(its.all(|link| match link.target {
            Target::Breath => true,
            Target::Number(number) => number.is_of_player(),
        }))
    }

    /// A source speaks; the events that this makes.
    pub fn hear(&mut self, source: Source, raw: u8) -> impl Iterator<Item = Event> + '_ {
        self.all.iter().zip(&mut self.raws).filter_map(move |(link, place)| {
            let link = link.as_ref().filter(|link| link.source == source)?;
            *place = Some(raw);
            Some(link.event(link.value(raw)))
        })
    }

    /// What the controllers have said, to [go back](Self::go_back) to.
    pub fn raws(&self) -> Raws {
        self.raws
    }

    /// What was said since is taken back; the events that this makes.
    pub fn go_back(&mut self, raws: &Raws) -> impl Iterator<Item = Event> + '_ {
        let raws = *raws;
        self.all.iter().zip(&mut self.raws).zip(raws).filter_map(|((link, place), raw)| {
            let link = link.as_ref().filter(|_| *place != raw)?;
            *place = raw;
            Some(link.event(raw.map_or(link.own, |raw| link.value(raw))))
        })
    }

    /// Other links. One that has changed waits for its controller: so does one whose target was moved otherwise, which
    /// `own` tells. Whether any has changed.
    pub fn set(&mut self, all: &[Option<Link>; MOST]) -> bool {
        let mut has_changed = false;
        for ((link, raw), new) in self.all.iter_mut().zip(&mut self.raws).zip(all) {
            if link != new {
                (*link, *raw, has_changed) = (*new, None, true);
            }
        }
        has_changed
    }

    /// Numbers of the settings as the controllers have them.
    pub fn numbers(&self) -> impl Iterator<Item = (SettingNumber, f32)> + '_ {
        self.all.iter().zip(&self.raws).filter_map(|(link, raw)| match (link, raw) {
            (Some(link @ Link { target: Target::Number(number), .. }), Some(raw)) => {
                Some((*number, link.value(*raw)))
            }
            _ => None,
        })
    }

    /// What these links of one of several players say otherwise than those of the first, where each can have a value of its own: a
    /// controller that has spoken to the first alone leaves the setting its own value here.
    pub fn beside<'a>(&'a self, first: &'a Self) -> impl Iterator<Item = (SettingNumber, f32)> + 'a {
        let of_first = first.raws.iter().map(Option::is_some);
        let own = self.all.iter().zip(of_first).filter_map(|(link, spoken)| match link {
            Some(link @ Link { target: Target::Number(number), .. }) if spoken => Some((*number, link.own)),
            _ => None,
        });
        own.chain(self.numbers()).filter(|(number, _)| number.is_of_player())
    }

    /// All controllers count as if they had not spoken.
    pub fn forget(&mut self) {
        self.raws = [None; MOST];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROWL: SettingNumber = SettingNumber::Growl;
    const NOISE: SettingNumber = SettingNumber::Noise;

    fn link(source: Source, number: SettingNumber, low: f32, high: f32) -> Link {
        Link { source, target: Target::Number(number), low, high, curve: 1.0, own: 0.3 }
    }

    fn of(some: &[Link]) -> [Option<Link>; MOST] {
        std::array::from_fn(|at| some.get(at).copied())
    }

    #[test]
    fn one_controller_moves_several_numbers_and_several_the_same() {
        let [a, b] = [Source::Controller(21), Source::Pressure];
        let mut links = Links::default();
        assert!(links.set(&of(&[
            link(a, GROWL, 0.0, 1.0),
            link(a, NOISE, 1.0, 0.0),
            link(b, GROWL, 0.5, 1.0)
        ])));
        assert!(links.has(a) && links.has(b) && !links.has(Source::Controller(22)));
        let said: Vec<Event> = links.hear(a, 127).collect();
        assert_eq!(said, [Event::Set(GROWL, 1.0), Event::Set(NOISE, 0.0)]);
        assert_eq!(links.hear(b, 0).collect::<Vec<_>>(), [Event::Set(GROWL, 0.5)]);
        let numbers: Vec<f32> = links.numbers().map(|(_, value)| value).collect();
        assert_eq!(numbers, [1.0, 0.0, 0.5]);
    }

    #[test]
    fn who_is_beside_the_first_has_values_of_its_own() {
        let [a, b] = [Source::Controller(21), Source::Controller(22)];
        let all = of(&[link(a, GROWL, 0.0, 1.0), link(b, SettingNumber::RoomAmount, 0.0, 1.0)]);
        let [mut first, mut second] = [Links::default(); 2];
        first.set(&all);
        second.set(&all);
        assert_eq!((first.is_of_player(a), first.is_of_player(b)), (Some(true), Some(false)));
        assert_eq!(first.is_of_player(Source::Pressure), None);
        first.hear(a, 127).for_each(drop);
        for links in [&mut first, &mut second] {
            links.hear(b, 127).for_each(drop);
        }
        let last = |links: &Links| links.beside(&first).last();
        assert_eq!(last(&second), Some((GROWL, 0.3)), "not what the first was told; the room is the same");
        second.hear(a, 0).for_each(drop);
        assert_eq!(last(&second), Some((GROWL, 0.0)));
    }

    #[test]
    fn what_a_snapshot_said_is_taken_back() {
        let source = Source::Controller(21);
        let mut links = Links::default();
        links.set(&of(&[link(source, GROWL, 0.0, 1.0)]));
        let before = links.raws();
        links.hear(source, 127).for_each(drop);
        assert_eq!(links.go_back(&before).collect::<Vec<_>>(), [Event::Set(GROWL, 0.3)], "its own");
        assert_eq!(links.go_back(&before).count(), 0, "once");
        assert_eq!(links.numbers().count(), 0);
    }

    #[test]
    fn whoever_moved_last_is_heard() {
        let source = Source::Controller(21);
        let first = link(source, GROWL, 0.0, 1.0);
        let mut links = Links::default();
        links.set(&of(&[first]));
        links.hear(source, 64).for_each(drop);
        assert!(!links.set(&of(&[first])), "the same links");
        assert_eq!(links.numbers().count(), 1);
        assert!(links.set(&of(&[Link { own: 0.8, ..first }])), "the setting was moved by hand");
        assert_eq!(links.numbers().count(), 0);
    }

    #[test]
    fn what_steers_midi_itself_cannot_be_linked() {
        for cc in [0, 6, 32, 38, 64, 98, 99, 100, 101, 120, 121, 123, 127] {
            assert!(!Source::Controller(cc).is_free(), "{cc}");
        }
        assert!([1, 2, 7, 11, 18, 21, 74, 119].into_iter().all(|cc| Source::Controller(cc).is_free()));
    }
}
