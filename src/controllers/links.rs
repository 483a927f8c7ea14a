//! The user's links from controllers to parameters, shared without a lock between the audio thread, which follows and learns
//! them, and all others.

use std::sync::atomic::{AtomicU32, Ordering};

use super::factory;
use super::map::{ControllerMap, ParameterLink};
use crate::parameters::{PARAMETERS, Parameter};
use chalumeau_core::control::midi::links::{Link, MOST, Source};
use chalumeau_core::control::midi::snapshot;
use chalumeau_core::instrument::Settings;

/// Channel pressure, as the number of a controller; projects hold it.
const PRESSURE: u32 = snapshot::PRESSURE as u32;
/// No value was heard.
const UNHEARD: u32 = u32::MAX;

/// All links of one plugin instance.
#[derive(Debug, Default)]
pub struct ControllerLinks {
    places: [Place; MOST],
    /// One more than the index of the parameter that waits for a controller; 0 for none.
    learning: AtomicU32,
    /// One more than source and value of the controller that was heard first while learning; 0 for none.
    heard: AtomicU32,
    /// How often the user has changed a link.
    changes: AtomicU32,
    /// One more than the place in [`factory::all`] of the device that the user has chosen; 0 for none.
    device: AtomicU32,
}

/// A link, or none. Its numbers may be of two moments for as long as one is being written.
#[derive(Debug, Default)]
struct Place {
    /// 1, source and index of the parameter, eight bits each; 0 for no link.
    what: AtomicU32,
    low: AtomicU32,
    high: AtomicU32,
    curve: AtomicU32,
    /// The controller's last value, followed or not, or [`UNHEARD`].
    raw: AtomicU32,
}

impl Place {
    fn get(&self) -> Option<ParameterLink> {
        let what = self.what.load(Ordering::Acquire);
        let parameter = PARAMETERS.get((what & 0xff) as usize).filter(|_| what != 0)?;
        let [low, high, curve] =
            [&self.low, &self.high, &self.curve].map(|bits| f32::from_bits(bits.load(Ordering::Relaxed)));
        let source = source_of(what >> 8 & 0xff);
        Some(ParameterLink { source, parameter, low, high, curve }.mended())
    }

    fn put(&self, link: Option<&ParameterLink>) {
        self.what.store(0, Ordering::Release);
        self.raw.store(UNHEARD, Ordering::Relaxed);
        let Some(link) = link else { return };
        for (place, value) in [(&self.low, link.low), (&self.high, link.high), (&self.curve, link.curve)] {
            place.store(value.to_bits(), Ordering::Relaxed);
        }
        let what = 1 << 16 | number_of(link.source) << 8 | index_of(link.parameter);
        self.what.store(what, Ordering::Release);
    }
}

fn number_of(source: Source) -> u32 {
    match source {
        Source::Controller(cc) => u32::from(cc),
        Source::Pressure => PRESSURE,
    }
}

fn source_of(number: u32) -> Source {
    if number >= PRESSURE { Source::Pressure } else { Source::Controller(number as u8) }
}

fn index_of(parameter: &Parameter) -> u32 {
    PARAMETERS.iter().position(|other| other == parameter).unwrap_or(0) as u32
}

impl ControllerLinks {
    /// How often the user has changed a link; the number wraps around.
    pub fn changes(&self) -> u32 {
        self.changes.load(Ordering::Relaxed)
    }

    /// The links as the instrument takes them, with the parameters' own values. Real-time safe.
    pub fn links(&self, settings: &Settings) -> [Option<Link>; MOST] {
        std::array::from_fn(|at| self.places[at].get().and_then(|link| link.link(settings)))
    }

    /// All links, and the controllers' last values, 0..=127.
    pub fn all(&self) -> Vec<(ParameterLink, Option<u8>)> {
        let raw = |place: &Place| u8::try_from(place.raw.load(Ordering::Relaxed)).ok();
        self.places.iter().filter_map(|place| Some((place.get()?, raw(place)))).collect()
    }

    /// Replaces all links, as the user does; those beyond the most that fit are left out.
    pub fn replace(&self, links: &[ParameterLink]) {
        if self.take(links) {
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The device that the user has chosen.
    pub fn device(&self) -> Option<&'static ControllerMap> {
        factory::all().get(self.device.load(Ordering::Relaxed).checked_sub(1)? as usize)
    }

    /// Replaces all links by those of a device, which is remembered if it is one of [`factory::all`].
    pub fn choose(&self, map: &ControllerMap) {
        self.remember(map);
        self.take(&map.links);
        self.changes.fetch_add(1, Ordering::Relaxed);
    }

    /// Sets links and device as a text has them, as the user does.
    pub fn restore(&self, text: &str) {
        self.take_text(text);
        self.changes.fetch_add(1, Ordering::Relaxed);
    }

    fn remember(&self, map: &ControllerMap) {
        let place = factory::all().iter().position(|other| other.name == map.name);
        self.device.store(place.map_or(0, |place| 1 + place as u32), Ordering::Relaxed);
    }

    /// Replaces all links; whether any has changed.
    fn take(&self, links: &[ParameterLink]) -> bool {
        let mut has_changed = false;
        for (at, place) in self.places.iter().enumerate() {
            let link = links.get(at);
            if place.get().as_ref() != link {
                place.put(link);
                has_changed = true;
            }
        }
        has_changed
    }

    /// Whether a parameter can get a link: it has one, or there is room for another.
    pub fn can_learn(&self, parameter: &Parameter) -> bool {
        self.places.iter().any(|place| place.get().is_none_or(|link| link.parameter == parameter))
    }

    /// Waits for a controller that a hand moves, to link it to this parameter; `None` waits no more.
    pub fn learn(&self, parameter: Option<&Parameter>) {
        self.heard.store(0, Ordering::Relaxed);
        self.learning.store(parameter.map_or(0, |parameter| 1 + index_of(parameter)), Ordering::Release);
    }

    /// The parameter that waits for a controller.
    pub fn learning(&self) -> Option<&'static Parameter> {
        let learning = self.learning.load(Ordering::Acquire);
        PARAMETERS.get(learning.checked_sub(1)? as usize)
    }

    /// A source speaks, 0..=127: one that moves is linked to the parameter that waits, in place of what was. Real-time safe.
    pub fn hear(&self, source: Source, raw: u8) {
        for place in &self.places {
            let what = place.what.load(Ordering::Relaxed);
            if what != 0 && what >> 8 & 0xff == number_of(source) {
                place.raw.store(u32::from(raw), Ordering::Relaxed);
            }
        }
        let Some(parameter) = self.learning().filter(|_| source.is_free()) else { return };
        let now = 1 + (number_of(source) << 8 | u32::from(raw));
        let before = self.heard.swap(now, Ordering::Relaxed);
        let has_moved = before != 0 && (before - 1) >> 8 == (now - 1) >> 8 && before != now;
        if !has_moved {
            return;
        }
        self.learning.store(0, Ordering::Release);
        let is_its = |place: &&Place| place.get().is_some_and(|link| link.parameter == parameter);
        let free = || self.places.iter().find(|place| place.get().is_none());
        if let Some(place) = self.places.iter().find(is_its).or_else(free) {
            place.put(ParameterLink::whole(source, parameter).as_ref());
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The text of a [`ControllerMap`] with these links and the name of the chosen device; empty without either.
    pub fn to_text(&self) -> String {
        let links: Vec<ParameterLink> = self.all().into_iter().map(|(link, _)| link).collect();
        let device = self.device();
        let name = device.map_or("Links", |device| &device.name).to_owned();
        let map = ControllerMap { name, links, ..ControllerMap::default() };
        if map.links.is_empty() && device.is_none() { String::new() } else { map.to_text() }
    }

    /// Takes links and device of a saved text; none where it cannot be read.
    pub fn take_text(&self, text: &str) {
        let map = ControllerMap::parse(text).unwrap_or_default();
        self.remember(&map);
        self.take(&map.links);
    }
}

/// A saved text of links, or none where it cannot be read.
pub fn mended(text: String) -> String {
    if ControllerMap::parse(&text).is_ok() { text } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::find;

    #[test]
    fn the_controller_that_moves_is_learnt_and_a_snapshot_is_not() {
        let links = ControllerLinks::default();
        let growl = find("growl").unwrap();
        links.hear(Source::Controller(21), 1);
        links.hear(Source::Controller(21), 2);
        assert!(links.all().is_empty(), "nobody asked");
        links.learn(Some(growl));
        assert_eq!(links.learning(), Some(growl));
        for cc in 0..128 {
            links.hear(Source::Controller(cc), 0);
        }
        assert_eq!(links.learning(), Some(growl), "all at once is no hand");
        links.hear(Source::Controller(64), 0);
        links.hear(Source::Controller(64), 127);
        assert_eq!(links.learning(), Some(growl), "the pedal steers MIDI");
        links.hear(Source::Controller(21), 5);
        links.hear(Source::Controller(21), 5);
        assert!(links.all().is_empty(), "it stands still");
        links.hear(Source::Controller(21), 6);
        let whole = ParameterLink::whole(Source::Controller(21), growl).unwrap();
        assert_eq!((links.learning(), links.all()), (None, vec![(whole, None)]));
        links.hear(Source::Controller(21), 9);
        assert_eq!(links.all(), [(whole, Some(9))]);
        // Learnt again, it replaces the first.
        links.learn(Some(growl));
        links.hear(Source::Pressure, 5);
        links.hear(Source::Pressure, 6);
        assert_eq!(links.all(), [(ParameterLink { source: Source::Pressure, ..whole }, None)]);
    }

    #[test]
    fn a_project_keeps_its_links() {
        let links = ControllerLinks::default();
        assert_eq!(links.to_text(), "");
        let of = |cc, id: &str| ParameterLink::whole(Source::Controller(cc), find(id).unwrap()).unwrap();
        let all = [of(21, "growl"), ParameterLink { low: 60.0, high: 20.0, curve: 2.0, ..of(22, "vib") }];
        links.replace(&all.map(ParameterLink::mended));
        let text = links.to_text();
        let other = ControllerLinks::default();
        other.take_text(&text);
        assert_eq!((other.all(), mended(text.clone())), (links.all(), text));
        other.take_text("rubbish");
        assert!(other.all().is_empty() && mended("rubbish".to_owned()).is_empty());
    }

    #[test]
    fn a_project_keeps_its_device() {
        let (links, other) = (ControllerLinks::default(), ControllerLinks::default());
        for map in factory::all() {
            let before = links.changes();
            links.choose(map);
            assert_eq!((links.device(), links.changes()), (Some(map), before + 1));
            let text = links.to_text();
            assert_eq!(mended(text.clone()), text);
            other.take_text(&text);
            assert_eq!((other.device(), other.all()), (Some(map), links.all()));
        }
        links.choose(&ControllerMap { name: "Any".to_owned(), ..ControllerMap::default() });
        assert_eq!((links.device(), links.to_text().as_str()), (None, ""));
    }
}
