//! The controllers that come with the program: what a device sends, and what it should do.

use std::sync::LazyLock;

use super::ControllerMap;
use crate::parameters::{PARAMETERS, Parameter, Value};

/// Reads the files of `controllers/` into the program.
macro_rules! texts {
    ($($file:literal),* $(,)?) => {
        &[$(($file, include_str!(concat!("../../controllers/", $file, ".toml")))),*]
    };
}

/// Names of the files, and their texts.
const TEXTS: &[(&str, &str)] = texts![
    "keys_only",
    "keys_and_wheel",
    "breath_controller",
    "ewi",
    "aerophone",
    "sylphyo",
    "warbl",
    "mpe_keyboard",
    "linnstrument",
    "torquetuner",
];

// PANIC: the texts are part of the program, and a test reads all of them.
static ALL: LazyLock<Vec<ControllerMap>> = LazyLock::new(|| {
    let read = |(file, text): &(&str, &str)| {
        ControllerMap::parse(text).unwrap_or_else(|error| panic!("controllers/{file}.toml: {error}"))
    };
    TEXTS.iter().map(read).collect()
});

/// All of them.
pub fn all() -> &'static [ControllerMap] {
    &ALL
}

/// The one of this name, in any case of its letters.
pub fn find(name: &str) -> Option<&'static ControllerMap> {
    ALL.iter().find(|map| map.name.eq_ignore_ascii_case(name))
}

/// Every parameter that one of them sets, as `map` has it: a device that is chosen takes back what another one set.
pub fn values(map: &ControllerMap) -> Vec<(&'static Parameter, Value)> {
    let is_set =
        |parameter: &&Parameter| all().iter().chain([map]).any(|other| other.value(parameter).is_some());
    let value = |parameter| (parameter, map.value(parameter).unwrap_or_else(|| parameter.default_value()));
    PARAMETERS.iter().filter(is_set).map(value).collect()
}

/// Whether the value that `is_now` recognises is one that the player has found: neither the default nor any device's.
pub fn is_players(parameter: &Parameter, is_now: impl Fn(Value) -> bool) -> bool {
    let of_devices = all().iter().filter_map(|map| map.value(parameter));
    parameter.is_players_own() && !of_devices.chain([parameter.default_value()]).any(is_now)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::control::midi::MidiDecoder;
    use chalumeau_core::event::Event;
    use chalumeau_core::instrument::Settings;

    #[test]
    fn each_survives_its_text_and_takes_back_what_another_set() {
        assert_eq!(all().len(), TEXTS.len());
        for map in all() {
            assert_eq!(ControllerMap::parse(&map.to_text()).as_ref(), Ok(map), "{}", map.name);
            assert!(!map.shows.is_empty() && find(&map.name.to_lowercase()) == Some(map));
            let values = values(map);
            assert!(
                all()
                    .iter()
                    .flat_map(|other| &other.values)
                    .all(|(set, _)| values.iter().any(|(p, _)| p == set))
            );
            assert!(map.values.iter().all(|value| values.contains(value)), "{}", map.name);
        }
    }

    /// What each device sends in its first notes, and how the breath or the first parameter answers.
    #[test]
    fn what_each_device_sends_blows_or_moves_what_its_text_says() {
        let blown = |name: &str, messages: &[[u8; 3]]| {
            let map = find(name).unwrap();
            let mut midi = MidiDecoder::new();
            midi.set_links(&super::super::as_links(&map.links, &Settings::default()));
            let mut said = Vec::new();
            for &[status, first, second] in messages {
                said.extend_from_slice(match status >> 4 {
                    0x9 => midi.note_on(status & 15, first, second),
                    0xB => midi.controller(status & 15, first, second),
                    _ => midi.pressure(status & 15, first),
                });
            }
            said
        };
        let breath = |raw: u8| Event::Breath(f32::from(raw) / 127.0);
        let note = [0x90, 60, 100];
        for name in ["Breath controller", "EWI", "Aerophone", "WARBL"] {
            assert!(blown(name, &[note, [0xB0, 2, 80]]).contains(&breath(80)), "{name}");
        }
        assert!(blown("Sylphyo", &[note, [0xB0, 11, 80]]).contains(&breath(80)));
        let glide = blown("EWI", &[[0xB0, 5, 127]]);
        assert!(matches!(glide[..], [Event::Set(_, 0.3)]), "{glide:?}");
        let touch = blown("Keys, wheel and aftertouch", &[note, [0xD0, 127, 0]]);
        assert!(matches!(touch[..], [Event::NoteOn { .. }, Event::Set(_, 0.6)]), "{touch:?}");
        for name in ["Keys only", "Linnstrument, y and z", "TorqueTuner", "MPE keyboard"] {
            assert!(matches!(blown(name, &[note])[..], [Event::NoteOn { .. }]), "{name}");
        }
    }
}
