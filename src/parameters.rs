//! The one table of parameters: ids, names, ranges, units, defaults, texts and help.
//!
//! Plugin, editor, command line, `docs/parameters.md` and the tests take theirs from here. The table is plain data and
//! knows no host. Its order is the order in which hosts list the parameters. Ids live in saved projects and in automation
//! lanes: entries are only ever added, at the end of their group, and an id never changes.

pub mod spelling;
mod table;
mod text;

use chalumeau_core::event::SettingNumber;
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::PhysicalReed;

pub use table::PARAMETERS;

/// One parameter.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Stable id, at most six characters.
    pub id: &'static str,
    /// Name of the group that hosts list it in.
    pub group: &'static str,
    /// Name, as hosts list it.
    pub name: &'static str,
    /// What values it takes.
    pub kind: Kind,
    /// The quantity in one phrase.
    pub meaning: &'static str,
    /// What it does to the sound, or in the program; empty if `meaning` says all.
    pub sound: &'static str,
    /// What the hand feels of it at the knob; empty if nothing.
    pub feel: &'static str,
    /// What it sets in the instrument; `None` for what belongs to the plugin alone.
    pub sets: Option<Sets>,
    /// Flag of the command line for the same quantity, with its dashes; empty if there is none.
    pub flag: &'static str,
    /// MIDI messages that do the same or drive it; empty if there are none.
    pub midi: &'static str,
    /// A host may automate it. What moves a motor is only the user's to move.
    pub is_automatable: bool,
    /// Undo and the A/B comparison carry it. They leave out what acts, arms or plays; A/B carries the instrument, too.
    pub is_undoable: bool,
    /// A saved state brings its value back. Otherwise a loaded state always has the default.
    pub is_restored: bool,
    /// When it has an effect. Hosts may leave the others out of their lists.
    pub in_use: InUse,
}

/// When a parameter has an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InUse {
    /// Always.
    Always,
    /// While *Knob* names a kind of knob.
    WithKnob,
    /// While *Knob* is OSC.
    WithOscKnob,
    /// While *Study* is on.
    InStudy,
}

/// What values a parameter takes, and its default.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A number on a linear scale.
    Number(Number),
    /// A whole number.
    Whole(Whole),
    /// One of several.
    Choice(Choice),
    /// On or off.
    Switch(Switch),
    /// Read-only: only its text is used. The text as it is at first.
    Status(&'static str),
}

/// A number on a linear scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// Least value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Default.
    pub default: f32,
    /// Decimals of its text.
    pub digits: usize,
    /// Unit with a leading space, as it follows the number; empty if there is none.
    pub unit: &'static str,
    /// What the text shows for a value of 1: 100 for a percentage.
    pub scale: f32,
}

/// A whole number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Whole {
    /// Least value.
    pub min: i32,
    /// Largest value.
    pub max: i32,
    /// Default.
    pub default: i32,
    /// Unit with a leading space; empty if there is none.
    pub unit: &'static str,
}

/// One of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Id in saved states, and text.
    pub all: &'static [(&'static str, &'static str)],
    /// Place of the default in the list.
    pub default: usize,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch {
    /// Default.
    pub default: bool,
    /// Text of on.
    pub on: &'static str,
    /// Text of off.
    pub off: &'static str,
}

/// What a parameter sets in the instrument.
#[derive(Clone, Copy, Debug)]
pub enum Sets {
    /// A number of [`Settings`].
    Number(SettingNumber),
    /// A switch of [`Settings`].
    Switch(fn(&mut Settings) -> &mut bool),
    /// A whole number of [`Settings`].
    Whole(fn(&mut Settings) -> &mut i32),
    /// A choice of [`Settings`], by its place in the list.
    Choice(fn(&mut Settings, usize)),
    /// A number of the reed as its maker measures it, and how many of the parameter's units make one SI unit.
    Reed(fn(&mut PhysicalReed) -> &mut f64, f64),
    /// Whether the measured reed is in use: a choice of dimensionless and physical.
    ReedDescription,
}

/// A value that a parameter can take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Of a [`Number`].
    Number(f32),
    /// Of a [`Whole`].
    Whole(i32),
    /// Of a [`Choice`]: its place in the list.
    Choice(usize),
    /// Of a [`Switch`].
    Switch(bool),
}

/// A text of the table without the asterisks around names of parameters.
pub fn plain(text: &str) -> String {
    text.replace('*', "")
}

/// The parameter with this id.
pub fn find(id: &str) -> Option<&'static Parameter> {
    PARAMETERS.iter().find(|parameter| parameter.id == id)
}

/// By its id.
impl PartialEq for Parameter {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl Parameter {
    /// Puts a value into settings. Does nothing if the parameter sets nothing there, or if the value is of another kind.
    pub fn set(&self, settings: &mut Settings, value: Value) {
        match (self.sets, value) {
            (Some(Sets::Number(which)), Value::Number(number)) => *settings.number(which) = number,
            (Some(Sets::Switch(field)), Value::Switch(on)) => *field(settings) = on,
            (Some(Sets::Whole(field)), Value::Whole(number)) => *field(settings) = number,
            (Some(Sets::Choice(choose)), Value::Choice(index)) => choose(settings, index),
            _ => {}
        }
    }

    /// Whether a preset sets it: what undo carries, and the instrument. Left out is what acts, arms or plays, and how finely
    /// a host renders.
    pub fn is_in_presets(&self) -> bool {
        let is_status = matches!(self.kind, Kind::Status(_));
        self.is_compared() && self.is_restored && !is_status && self.id != "qual"
    }

    /// Whether it fits the instrument to a player's hands and devices, and is no part of a sound: a preset that does not name it leaves it as
    /// it is.
    pub fn is_players_own(&self) -> bool {
        ["bsoft", "bloud", "bfrom", "bdead", "transp", "keysw"].contains(&self.id)
    }

    /// Whether it says what a device's controllers do: a preset that does not name it leaves it as the chosen device needs it.
    pub fn is_of_device(&self) -> bool {
        ["wheel", "hsrc", "ksrc"].contains(&self.id)
    }

    /// Whether the A/B comparison carries it: what undo carries, and the instrument.
    pub fn is_compared(&self) -> bool {
        self.is_undoable || self.id == "instr"
    }

    /// The default.
    pub fn default_value(&self) -> Value {
        match self.kind {
            Kind::Number(number) => Value::Number(number.default),
            Kind::Whole(whole) => Value::Whole(whole.default),
            Kind::Choice(choice) => Value::Choice(choice.default),
            Kind::Switch(switch) => Value::Switch(switch.default),
            Kind::Status(_) => Value::Switch(false),
        }
    }

    /// A value on a scale from 0 to 1; one of another kind is the default.
    pub fn normalized(&self, value: Value) -> f32 {
        match (self.kind, value) {
            (Kind::Number(number), Value::Number(value)) => (value - number.min) / (number.max - number.min),
            (Kind::Whole(whole), Value::Whole(value)) => {
                (value - whole.min) as f32 / (whole.max - whole.min) as f32
            }
            (Kind::Choice(choice), Value::Choice(index)) => index as f32 / (choice.all.len() - 1) as f32,
            (Kind::Switch(_), Value::Switch(on)) => f32::from(u8::from(on)),
            _ => self.default_normalized(),
        }
    }

    /// Steps from one end to the other: 1 for a switch; `None` for a continuous number.
    pub fn steps(&self) -> Option<usize> {
        match self.kind {
            Kind::Number(_) => None,
            Kind::Whole(whole) => usize::try_from(whole.max - whole.min).ok(),
            Kind::Choice(choice) => Some(choice.all.len() - 1),
            Kind::Switch(_) | Kind::Status(_) => Some(1),
        }
    }

    /// The default on a scale from 0 to 1.
    pub fn default_normalized(&self) -> f32 {
        match self.kind {
            Kind::Status(_) => 0.0,
            _ => self.normalized(self.default_value()),
        }
    }
}

#[cfg(test)]
mod tests;
