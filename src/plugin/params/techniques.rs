//! What a player does beside blowing a note: life, vibrato, glissando, growl, flutter tongue, subtone, the vocal tract.

use nice_plug::prelude::*;

use super::entry::{choice, switch};
use super::settled;
use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::instrument::Articulation;
use chalumeau_core::instrument::player::Attack;
use chalumeau_core::instrument::player::vibrato::Vibrato;
use chalumeau_core::instrument::techniques::{GrowlPitch, Techniques, Tract};

/// How notes begin, go on and lead into each other.
#[derive(Params)]
pub struct ExpressionParams {
    /// [`Settings::life`].
    #[id = "life"]
    pub life: FloatParam,
    /// [`Vibrato::depth`].
    #[id = "vib"]
    pub vibrato: FloatParam,
    /// [`Vibrato::rate_hz`].
    #[id = "vibhz"]
    pub vibrato_rate: FloatParam,
    /// [`Vibrato::onset_s`].
    #[id = "vibon"]
    pub vibrato_onset: FloatParam,
    /// [`Vibrato::unevenness`].
    #[id = "vibun"]
    pub vibrato_unevenness: FloatParam,
    /// [`Settings::attack`].
    #[id = "attack"]
    pub attack: EnumParam<AttackChoice>,
    /// [`Settings::glissando_s`].
    #[id = "gliss"]
    pub glissando: FloatParam,
    /// What the mod wheel does.
    #[id = "wheel"]
    pub wheel: EnumParam<WheelChoice>,
    /// [`Articulation::scoop_cents`].
    #[id = "scoop"]
    pub scoop: FloatParam,
    /// [`Articulation::scoop_s`].
    #[id = "scoops"]
    pub scoop_time: FloatParam,
    /// [`Articulation::fall_cents`].
    #[id = "fall"]
    pub fall: FloatParam,
    /// [`Articulation::fall_s`].
    #[id = "falls"]
    pub fall_time: FloatParam,
    /// [`Articulation::breath_in`].
    #[id = "bin"]
    pub breath_in: FloatParam,
    /// [`Articulation::key_sounds`].
    #[id = "ksound"]
    pub key_sounds: FloatParam,
    /// [`Articulation::slap`].
    #[id = "slap"]
    pub slap: FloatParam,
    /// [`Settings::alternates`].
    #[id = "altf"]
    pub alternates: BoolParam,
    /// [`Reach::key_switches`](chalumeau_core::instrument::Reach::key_switches).
    #[id = "keysw"]
    pub key_switches: EnumParam<KeySwitchesChoice>,
}

/// Extended techniques and the vocal tract.
#[derive(Params)]
pub struct TechniqueParams {
    /// [`Techniques::growl`].
    #[id = "growl"]
    pub growl: FloatParam,
    /// [`Techniques::growl_pitch`].
    #[id = "growlp"]
    pub growl_pitch: EnumParam<GrowlPitchChoice>,
    /// [`Techniques::growl_semitones`].
    #[id = "growli"]
    pub growl_interval: FloatParam,
    /// [`Techniques::growl_hz`].
    #[id = "growlf"]
    pub growl_frequency: FloatParam,
    /// [`Techniques::flutter`].
    #[id = "flut"]
    pub flutter: FloatParam,
    /// [`Techniques::flutter_hz`].
    #[id = "fluthz"]
    pub flutter_rate: FloatParam,
    /// [`Techniques::subtone`].
    #[id = "subt"]
    pub subtone: FloatParam,
    /// [`Tract::amount`].
    #[id = "tract"]
    pub tract: FloatParam,
    /// [`Tract::interval_semitones`].
    #[id = "tractp"]
    pub tract_interval: FloatParam,
}

/// [`Attack`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum AttackChoice {
    /// [`Attack::Soft`].
    #[id = "soft"]
    Soft,
    /// [`Attack::Normal`].
    #[id = "normal"]
    Normal,
    /// [`Attack::Hard`].
    #[id = "hard"]
    Hard,
}

impl From<AttackChoice> for Attack {
    fn from(choice: AttackChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

/// [`GrowlPitch`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum GrowlPitchChoice {
    /// [`GrowlPitch::Interval`].
    #[id = "int"]
    #[name = "Follows the note"]
    Interval,
    /// [`GrowlPitch::Fixed`].
    #[id = "fixed"]
    Fixed,
}

impl From<GrowlPitchChoice> for GrowlPitch {
    fn from(choice: GrowlPitchChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

/// [`Wheel`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum WheelChoice {
    /// [`Wheel::Vibrato`].
    #[id = "vib"]
    Vibrato,
    /// Growl.
    #[id = "growl"]
    Growl,
    /// Flutter tongue.
    #[id = "flut"]
    Flutter,
    /// Subtone.
    #[id = "subt"]
    Subtone,
    /// [`Wheel::Nothing`].
    #[id = "none"]
    Nothing,
}

/// [`KeySwitches`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum KeySwitchesChoice {
    /// [`KeySwitches::Off`].
    #[id = "off"]
    Off,
    /// [`KeySwitches::C1`].
    #[id = "c1"]
    #[name = "C1 to E1"]
    C1,
    /// [`KeySwitches::C2`].
    #[id = "c2"]
    #[name = "C2 to E2"]
    C2,
}

impl From<KeySwitchesChoice> for KeySwitches {
    fn from(choice: KeySwitchesChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

impl From<WheelChoice> for Wheel {
    fn from(choice: WheelChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

impl ExpressionParams {
    /// The table's parameters; `number` makes one from its id.
    pub(super) fn new(number: &dyn Fn(&str) -> FloatParam) -> Self {
        Self {
            life: number("life"),
            vibrato: number("vib"),
            vibrato_rate: number("vibhz"),
            vibrato_onset: number("vibon"),
            vibrato_unevenness: number("vibun"),
            attack: choice("attack"),
            glissando: number("gliss"),
            wheel: choice("wheel"),
            scoop: number("scoop"),
            scoop_time: number("scoops"),
            fall: number("fall"),
            fall_time: number("falls"),
            breath_in: number("bin"),
            key_sounds: number("ksound"),
            slap: number("slap"),
            alternates: switch("altf"),
            key_switches: choice("keysw"),
        }
    }

    /// As the instrument reads it. Real-time safe.
    pub(super) fn vibrato(&self) -> Vibrato {
        Vibrato {
            depth: settled(&self.vibrato),
            rate_hz: settled(&self.vibrato_rate),
            onset_s: settled(&self.vibrato_onset),
            unevenness: settled(&self.vibrato_unevenness),
        }
    }
}

impl ExpressionParams {
    /// As the instrument reads it. Real-time safe.
    pub(super) fn articulation(&self) -> Articulation {
        Articulation {
            scoop_cents: settled(&self.scoop),
            scoop_s: settled(&self.scoop_time),
            fall_cents: settled(&self.fall),
            fall_s: settled(&self.fall_time),
            breath_in: settled(&self.breath_in),
            key_sounds: settled(&self.key_sounds),
            slap: settled(&self.slap),
        }
    }
}

impl TechniqueParams {
    /// The table's parameters; `number` makes one from its id.
    pub(super) fn new(number: &dyn Fn(&str) -> FloatParam) -> Self {
        Self {
            growl: number("growl"),
            growl_pitch: choice("growlp"),
            growl_interval: number("growli"),
            growl_frequency: number("growlf"),
            flutter: number("flut"),
            flutter_rate: number("fluthz"),
            subtone: number("subt"),
            tract: number("tract"),
            tract_interval: number("tractp"),
        }
    }

    /// As the instrument reads them. Real-time safe.
    pub(super) fn techniques(&self) -> Techniques {
        Techniques {
            growl: settled(&self.growl),
            growl_pitch: self.growl_pitch.value().into(),
            growl_semitones: settled(&self.growl_interval),
            growl_hz: settled(&self.growl_frequency),
            flutter: settled(&self.flutter),
            flutter_hz: settled(&self.flutter_rate),
            subtone: settled(&self.subtone),
        }
    }

    /// As the instrument reads it. Real-time safe.
    pub(super) fn tract(&self) -> Tract {
        Tract { amount: settled(&self.tract), interval_semitones: settled(&self.tract_interval) }
    }
}
