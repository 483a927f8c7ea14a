//! Presets: named settings of the whole instrument, as text files.
//!
//! A preset holds the values that differ from the default, by the ids and texts of the one table of parameters
//! ([`crate::parameters`]). Choosing it puts every other parameter that belongs to presets to its default, so that a preset
//! sounds the same whatever was set before. What fits the instrument to a player's hands and devices changes only where a preset names it
//! ([`Parameter::is_players_own`]), and what a device's controllers do is as the chosen device needs it unless a preset names it
//! ([`Parameter::is_of_device`]). Out of presets stay what acts, arms or plays, and how finely a host renders ([`Parameter::is_in_presets`]).
//!
//! - `file`: the text of a preset, read and written
//! - `factory`: the presets that come with the program, in the order of MIDI programs
//! - `user_folder`: the user's own, in a folder of the system for data
//! - `shelf`: both in one list

pub mod factory;
mod file;
mod shelf;
pub mod user_folder;

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::PhysicalReed;

use crate::controllers::ControllerMap;
use crate::parameters::{self, PARAMETERS, Parameter, Sets, Value};
use user_folder::{UserFolder, UserPresets};

pub use file::{FORMAT, PresetError, TAGS_MOST, TEXT_MOST};
pub use shelf::PresetShelf;

/// Longest name, characters: it must fit into the window's header and into a file's name.
pub const NAME_MOST: usize = 40;

/// A preset.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Preset {
    /// Its name, by which it is found. No other preset of its folder has it.
    pub name: String,
    /// Words to find it by.
    pub tags: Vec<String>,
    /// Who made it; may be empty.
    pub author: String,
    /// One sentence: what it shows; may be empty.
    pub shows: String,
    /// What differs from the default, in the order of the table.
    values: Vec<(&'static Parameter, Value)>,
}

impl Preset {
    /// Reads the text of a preset. The error says the line, what is wrong there, and what would be right.
    pub fn parse(text: &str) -> Result<Self, PresetError> {
        file::parse(text)
    }

    /// The text of this preset, which [`parse`](Self::parse) reads back.
    pub fn to_text(&self) -> String {
        file::to_text(self)
    }

    /// A preset of the values that `look` gives for each parameter; what reads as without the preset is left out, for the player of
    /// a device.
    pub fn of(
        name: &str,
        device: Option<&'static ControllerMap>,
        look: impl Fn(&'static Parameter) -> Option<Value>,
    ) -> Self {
        let values = Self::parameters().filter_map(|parameter| {
            let value = look(parameter)?;
            let usual = Self::default().value_for(parameter, device);
            (parameter.text(value) != parameter.text(usual)).then_some((parameter, value))
        });
        Self { name: name.to_owned(), values: values.collect(), ..Self::default() }
    }

    /// The parameters that a preset sets.
    pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
        PARAMETERS.iter().filter(|parameter| parameter.is_in_presets())
    }

    /// What differs from the default.
    pub fn changes(&self) -> &[(&'static Parameter, Value)] {
        &self.values
    }

    /// The value of a parameter under this preset.
    pub fn value(&self, parameter: &Parameter) -> Value {
        let own = self.values.iter().find(|(other, _)| other.id == parameter.id);
        own.map_or_else(|| parameter.default_value(), |(_, value)| *value)
    }

    /// Every parameter that this preset sets for the player of a device, with its value; of the player's own only those that it names.
    pub fn all_values(
        &self,
        device: Option<&'static ControllerMap>,
    ) -> impl Iterator<Item = (&'static Parameter, Value)> {
        Self::parameters()
            .filter(move |parameter| !parameter.is_players_own() || self.names(parameter))
            .map(move |parameter| (parameter, self.value_for(parameter, device)))
    }

    fn names(&self, parameter: &Parameter) -> bool {
        self.values.iter().any(|(named, _)| named.id == parameter.id)
    }

    /// The value of a parameter under this preset for the player of a device.
    fn value_for(&self, parameter: &Parameter, device: Option<&ControllerMap>) -> Value {
        let of_device = device.filter(|_| parameter.is_of_device() && !self.names(parameter));
        of_device.and_then(|device| device.value(parameter)).unwrap_or_else(|| self.value(parameter))
    }

    /// The settings of the instrument, as the plugin has them under this preset before any controller moves.
    pub fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        let mut reed = PhysicalReed::reference();
        let (mut is_measured, mut is_driven) = (false, false);
        for &(parameter, value) in &self.values {
            parameter.set(&mut settings, value);
            match (parameter.sets, value) {
                (Some(Sets::Reed(field, unit)), Value::Number(number)) => {
                    *field(&mut reed) = f64::from(number) / unit;
                }
                (Some(Sets::ReedDescription), Value::Choice(description)) => is_measured = description == 1,
                // What a controller drives follows nothing else.
                (None, Value::Choice(source)) if parameter.id == "ksrc" => is_driven = source > 0,
                _ => {}
            }
        }
        if is_measured {
            settings = settings.with_physical_reed(&reed, &PhysicalReed::reference());
        }
        Settings { coupled: settings.coupled && !is_driven, ..settings }
    }

    /// The instrument, if it is one that comes with the program.
    pub fn bundled(&self) -> Option<Bundled> {
        match parameters::find("instr").map(|parameter| self.value(parameter)) {
            // The parameter has them in this order, and the user's own after them.
            Some(Value::Choice(index)) => Bundled::ALL.get(index).copied(),
            _ => Some(Bundled::BFlat),
        }
    }

    /// What the mod wheel does.
    pub fn wheel(&self) -> Wheel {
        match parameters::find("wheel").map(|parameter| self.value(parameter)) {
            Some(Value::Choice(index)) => Wheel::ALL.get(index).copied().unwrap_or_default(),
            _ => Wheel::default(),
        }
    }

    /// Which controller blows.
    pub fn breath_from(&self) -> BreathFrom {
        match parameters::find("bfrom").map(|parameter| self.value(parameter)) {
            Some(Value::Choice(index)) => BreathFrom::ALL.get(index).copied().unwrap_or_default(),
            _ => BreathFrom::default(),
        }
    }

    /// How far the wheel bends, semitones.
    pub fn bend_range(&self) -> u8 {
        match parameters::find("bendr").map(|parameter| self.value(parameter)) {
            Some(Value::Whole(semitones)) => semitones.clamp(0, 127) as u8,
            _ => 2,
        }
    }

    /// Whether it has this tag, in any case of its letters.
    pub fn has_tag(&self, tag: &str) -> bool {
        self.tags.iter().any(|own| own.eq_ignore_ascii_case(tag))
    }

    /// Whether each word of a search stands in its name, tags, author or sentence.
    pub fn is_found_by(&self, search: &str) -> bool {
        let all = format!("{}\n{}\n{}\n{}", self.name, self.tags.join("\n"), self.author, self.shows);
        let all = all.to_lowercase();
        search.to_lowercase().split_whitespace().all(|word| all.contains(word))
    }
}

/// The user's own presets; none where the system has no folder for them.
pub fn user() -> UserPresets {
    UserFolder::system().map_or_else(UserPresets::default, |folder| folder.read())
}

/// The preset of this name, in any case of its letters; the user's own first. The error names the nearest.
pub fn find<'a>(name: &str, user: &'a UserPresets) -> Result<&'a Preset, String> {
    let all = || user.presets.iter().chain(factory::all());
    let exact = all().find(|preset| preset.name == name.trim());
    let found = exact.or_else(|| all().find(|preset| preset.name.eq_ignore_ascii_case(name.trim())));
    found.ok_or_else(|| {
        if let Some(broken) = user.broken_called(name) {
            return format!("the preset {name:?} cannot be read: {broken}");
        }
        let near = parameters::spelling::nearest(name, all().map(|preset| preset.name.as_str()));
        let meant = near.map_or_else(String::new, |near| format!(" did you mean {near:?}?"));
        format!("there is no preset {name:?};{meant} `chalumeau presets list` lists them all")
    })
}

/// A name as presets have it: without white space at its ends; refused if it is empty, too long or holds a line break.
pub fn checked_name(name: &str) -> Result<String, String> {
    let name = name.trim();
    let long = name.chars().count();
    if name.is_empty() {
        return Err("a preset needs a name".to_owned());
    }
    if long > NAME_MOST {
        return Err(format!("a name has at most {NAME_MOST} characters, this one has {long}"));
    }
    if name.chars().any(char::is_control) {
        return Err("a name is one line of plain text".to_owned());
    }
    Ok(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controllers;

    #[test]
    fn a_preset_keeps_what_differs_and_nothing_else() {
        let preset = Preset::of("Mine", None, |parameter| match parameter.id {
            "lip" => parameter.read("0.9").ok(),
            // Its text is the default's.
            "stren" => Some(Value::Number(2.501)),
            "bendr" => Some(Value::Whole(12)),
            _ => Some(parameter.default_value()),
        });
        let ids: Vec<_> = preset.changes().iter().map(|(parameter, _)| parameter.id).collect();
        assert_eq!(ids, ["lip", "bendr"]);
        assert_eq!(preset.value(parameters::find("stren").unwrap()), Value::Number(2.5));
        assert_eq!(Preset::parse(&preset.to_text()).unwrap(), preset);
    }

    #[test]
    fn presets_leave_alone_what_acts_arms_or_plays() {
        let left: Vec<_> =
            PARAMETERS.iter().filter(|parameter| !parameter.is_in_presets()).map(|p| p.id).collect();
        for id in
            ["breath", "panic", "knob", "arm", "ceil", "rec", "replay", "study", "side", "qual", "istat"]
        {
            assert!(left.contains(&id), "{id}");
        }
        for id in ["instr", "lip", "gain", "law", "bendr", "heard", "a4"] {
            assert!(!left.contains(&id), "{id}");
        }
    }

    #[test]
    fn a_preset_leaves_the_players_own_unless_it_names_it() {
        let sets =
            |preset: &Preset, id: &str| preset.all_values(None).any(|(parameter, _)| parameter.id == id);
        let own: Vec<_> = PARAMETERS.iter().filter(|parameter| parameter.is_players_own()).collect();
        assert_eq!(own.len(), 6);
        assert!(own.iter().all(|parameter| parameter.is_in_presets()));
        for preset in factory::all() {
            assert!(own.iter().all(|parameter| !sets(preset, parameter.id)), "{}", preset.name);
            assert!(sets(preset, "lip") && sets(preset, "bendr"), "{}", preset.name);
        }
        let mine =
            Preset::parse("format = 1\nname = \"Mine\"\n\n[parameters]\ntransp = \"-2 st\"\n").unwrap();
        assert!(sets(&mine, "transp") && !sets(&mine, "bsoft"));
    }

    #[test]
    fn a_preset_leaves_controllers_to_the_device_unless_it_names_them() {
        let value = |preset: &str, device: Option<&str>, id: &str| {
            let device = device.map(|name| controllers::factory::find(name).unwrap());
            let preset = factory::find(preset).unwrap();
            let values: Vec<_> = preset.all_values(device).collect();
            values
                .into_iter()
                .find(|(parameter, _)| parameter.id == id)
                .map(|(p, value)| p.text(value))
                .unwrap()
        };
        let usual = parameters::find("wheel").unwrap().default_text();
        for (preset, device, id, wanted) in [
            ("Glass facing", None, "wheel", usual.as_str()),
            ("Glass facing", Some("EWI"), "wheel", "Nothing"),
            ("Glass facing", Some("WARBL"), "wheel", usual.as_str()),
            ("Glass facing", Some("MPE keyboard"), "hsrc", "CC74 (MPE y)"),
            ("Glass facing", Some("Keys only"), "vib", "0.0 %"),
            ("Flutter cabaret", Some("EWI"), "wheel", "Flutter"),
        ] {
            assert_eq!(value(preset, device, id), wanted, "{preset}, {device:?}, {id}");
        }
    }

    #[test]
    fn a_preset_of_a_devices_player_keeps_what_the_device_would_change() {
        let ewi = controllers::factory::find("EWI");
        let (wheel, hsrc) = (parameters::find("wheel").unwrap(), parameters::find("hsrc").unwrap());
        for (text, is_kept) in [("Nothing", false), ("Vibrato", true), ("Growl", true)] {
            let look = |parameter: &'static Parameter| match parameter.id {
                "wheel" => parameter.read(text).ok(),
                _ => Some(parameter.default_value()),
            };
            let mine = Preset::of("Mine", ewi, look);
            assert_eq!(mine.changes().iter().any(|(parameter, _)| *parameter == wheel), is_kept, "{text}");
            let read = Preset::parse(&mine.to_text()).unwrap();
            let values: Vec<_> = read.all_values(ewi).collect();
            assert!(values.contains(&(wheel, wheel.read(text).unwrap())), "{text}");
            assert!(values.contains(&(hsrc, hsrc.default_value())), "{text}");
        }
    }

    #[test]
    fn a_search_finds_words_wherever_they_stand() {
        let preset = Preset {
            name: "Night club".to_owned(),
            tags: vec!["jazz".to_owned()],
            shows: "A soft lip.".to_owned(),
            ..Preset::default()
        };
        for (search, found) in [("", true), ("NIGHT lip", true), ("jazz club", true), ("jazz bass", false)] {
            assert_eq!(preset.is_found_by(search), found, "{search}");
        }
    }

    #[test]
    fn names_are_one_line_of_text() {
        assert_eq!(checked_name("  Mine "), Ok("Mine".to_owned()));
        for (name, says) in [("  ", "needs a name"), ("a\nb", "one line"), (&"x".repeat(41), "at most 40")] {
            assert!(checked_name(name).unwrap_err().contains(says), "{name:?}");
        }
    }
}
