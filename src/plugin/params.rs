//! What a host can set: the parameters of the table ([`crate::parameters`]) as the framework wants them.
//!
//! The structs say which Rust field is which id. Names, ranges, units, defaults and texts are the table's. *Breath* and
//! *Panic* are no [`Settings`]: they act by being moved.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, RwLock};

use nice_plug::params::InternalParamMut;
use nice_plug::params::persist::PersistentField;
use nice_plug::prelude::*;

use crate::controllers::ControllerLinks;
use crate::controllers::source_curves::{SavedCurves, SourceCurves};
use crate::editor::WindowState;
use crate::parameters::{InUse, Number, Value};
use crate::plugin::host_link::HostLink;
use crate::presets::Preset;
use chalumeau_core::control::midi::breath::{BreathController, BreathFrom};
use chalumeau_core::instrument::{Beyond, BreathResponse, Reach, Settings, Tuning};

pub mod alterations;
mod entry;
pub mod instrument;
pub mod knob;
pub mod listening;
pub mod microphone;
pub mod moment;
pub mod players;
pub mod reed;
pub mod room;
pub mod scale;
mod state;
pub mod techniques;

use alterations::AlterationsField;
use entry::{choice, number_from, status_text, switch, whole};
pub use instrument::InstrumentParams;
pub use knob::KnobParams;
use knob::{KnobKind, ReedSource};
pub use listening::ListeningParams;
pub use microphone::MicrophoneParams;
use microphone::RoomFloor;
use moment::{Moment, Moments};
pub use players::PlayersParams;
pub use reed::PhysicalReedParams;
pub use room::RoomParams;
use scale::ScaleField;
pub use state::{SCHEMA, mend, without_moments};
pub use techniques::{ExpressionParams, TechniqueParams};

/// All parameters, by group.
#[derive(Params)]
pub struct ChalumeauParams {
    /// Layout of a state as it was saved; see [`SCHEMA`].
    #[persist = "schema"]
    schema: LoadedSchema,
    /// Breath and articulation.
    #[nested(group = "Breath")]
    pub breath: BreathParams,
    /// Lip and reed as a player names them.
    #[nested(group = "Embouchure")]
    pub embouchure: EmbouchureParams,
    /// The reed's law as the reference writes it.
    #[nested(group = "Reed")]
    pub reed: ReedParams,
    /// Pitch, air and holes.
    #[nested(group = "Tuning")]
    pub tuning: TuningParams,
    /// Breath noise.
    #[nested(group = "Noise")]
    pub noise: NoiseParams,
    /// Level, and the way out of a stuck note.
    #[nested(group = "Output")]
    pub output: OutputParams,
    /// The knob and what it feels like.
    #[nested(group = "Knob")]
    pub knob: KnobParams,
    /// Which instrument.
    #[nested(group = "Instrument")]
    pub instrument: InstrumentParams,
    /// The reed in newtons and millimetres.
    #[nested(group = "Reed, physical")]
    pub physical: PhysicalReedParams,
    /// Where it is heard from.
    #[nested(group = "Listening")]
    pub listening: ListeningParams,
    /// The room around it.
    #[nested(group = "Room")]
    pub room: RoomParams,
    /// How notes begin, go on and lead into each other.
    #[nested(group = "Expression")]
    pub expression: ExpressionParams,
    /// Extended techniques and the vocal tract.
    #[nested(group = "Techniques")]
    pub techniques: TechniqueParams,
    /// How many players play.
    #[nested(group = "Players")]
    pub players: PlayersParams,
    /// The microphone at the audio input.
    #[nested(group = "Microphone")]
    pub microphone: MicrophoneParams,
    /// State of the instrument as text, written by whoever loads it.
    pub instrument_status: Arc<RwLock<String>>,
    /// Size, zoom, theme and view of the window.
    #[persist = "window"]
    pub window: RwLock<WindowState>,
    /// Controllers that the user has linked to parameters.
    #[persist = "links"]
    pub links: ControllerLinks,
    /// The own curves of sources of breath.
    #[persist = "curves"]
    pub curves: SourceCurves,
    /// What the keys play.
    #[persist = "scale"]
    pub scale: ScaleField,
    /// Holes that the user has moved and joints that the user has pulled.
    #[persist = "holes"]
    pub alterations: AlterationsField,
    /// Level of the room, as the microphone has measured it.
    #[persist = "roomlevel"]
    pub room_floor: RoomFloor,
    /// Name of the preset that was chosen last; empty if there is none.
    #[persist = "preset"]
    pub preset: RwLock<String>,
    /// State of the link to the knob as text, written by the link.
    pub knob_status: Arc<RwLock<String>>,
    /// What has happened to the controls of the moment.
    pub moments: Arc<Moments>,
    /// The way from the plugin's threads to the host.
    pub host: HostLink,
}

/// Breath and articulation.
#[derive(Params)]
pub struct BreathParams {
    /// Breath. Only moving it blows: until then the breath is that of CC2, CC11, channel pressure or velocity.
    #[id = "breath"]
    pub breath: FloatParam,
    /// [`Settings::breath_full_kpa`].
    #[id = "full"]
    pub full: FloatParam,
    /// [`Settings::tongue_ms`].
    #[id = "tongue"]
    pub tongue: FloatParam,
    /// [`Settings::legato_ms`].
    #[id = "legato"]
    pub legato: FloatParam,
    /// [`Settings::breath_response`].
    #[id = "resp"]
    pub response: EnumParam<ResponseChoice>,
    /// [`Settings::breath_curve`].
    #[id = "bcurve"]
    pub curve: FloatParam,
    /// [`Settings::breath_softest`].
    #[id = "bsoft"]
    pub softest: FloatParam,
    /// [`Settings::breath_loudest`].
    #[id = "bloud"]
    pub loudest: FloatParam,
    /// Which controller blows.
    #[id = "bfrom"]
    pub from: EnumParam<BreathFromChoice>,
    /// [`Settings::breath_deadband`].
    #[id = "bdead"]
    pub deadband: FloatParam,
}

/// Lip and reed as a player names them.
#[derive(Params)]
pub struct EmbouchureParams {
    /// [`Settings::strength`].
    #[id = "stren"]
    pub strength: FloatParam,
    /// [`Settings::lip`].
    #[id = "lip"]
    pub lip: FloatParam,
    /// [`Settings::zeta`].
    #[id = "zeta"]
    pub zeta: FloatParam,
    /// [`Settings::damping`].
    #[id = "damp"]
    pub damping: FloatParam,
}

/// The reed's law as the reference writes it.
#[derive(Params)]
pub struct ReedParams {
    /// [`Settings::reed_h`].
    #[id = "reedh"]
    pub h: FloatParam,
    /// [`Settings::reed_k`].
    #[id = "reedk"]
    pub k: FloatParam,
    /// [`Settings::coupled`].
    #[id = "reedc"]
    pub coupled: BoolParam,
    /// [`Settings::reed_a`].
    #[id = "reeda"]
    pub a: FloatParam,
    /// [`Settings::lay`].
    #[id = "lay"]
    pub lay: FloatParam,
}

/// Pitch, air and holes.
#[derive(Params)]
pub struct TuningParams {
    /// [`Settings::a4_hz`].
    #[id = "a4"]
    pub a4: FloatParam,
    /// [`Settings::tuning`].
    #[id = "tune"]
    pub tuning: EnumParam<TuningChoice>,
    /// [`Settings::temperature_c`].
    #[id = "temp"]
    pub temperature: FloatParam,
    /// [`Settings::vent_loss`].
    #[id = "vent"]
    pub vent_loss: FloatParam,
    /// [`Reach::transpose`].
    #[id = "transp"]
    pub transpose: IntParam,
    /// [`Reach::beyond`].
    #[id = "beyond"]
    pub beyond: EnumParam<BeyondChoice>,
}

/// Breath noise.
#[derive(Params)]
pub struct NoiseParams {
    /// [`Settings::noise`].
    #[id = "noise"]
    pub noise: FloatParam,
}

/// Level, and the way out of a stuck note.
#[derive(Params)]
pub struct OutputParams {
    /// [`Settings::gain_db`].
    #[id = "gain"]
    pub gain: FloatParam,
    /// Silences everything once, when it is switched on; see `moment`.
    #[id = "panic"]
    pub panic: BoolParam,
}

/// [`Tuning`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum TuningChoice {
    /// [`Tuning::Natural`].
    #[id = "nat"]
    Natural,
    /// [`Tuning::Tempered`].
    #[id = "temp"]
    Tempered,
}

impl From<TuningChoice> for Tuning {
    fn from(choice: TuningChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

/// [`Beyond`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum BeyondChoice {
    /// [`Beyond::Silent`].
    #[id = "silent"]
    Silent,
    /// [`Beyond::Octave`].
    #[id = "octave"]
    #[name = "Nearest octave"]
    Octave,
}

impl From<BeyondChoice> for Beyond {
    fn from(choice: BeyondChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

/// [`BreathResponse`] as hosts see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum ResponseChoice {
    /// [`BreathResponse::Played`].
    #[id = "play"]
    Played,
    /// [`BreathResponse::Physical`].
    #[id = "phys"]
    Physical,
}

impl From<ResponseChoice> for BreathResponse {
    fn from(choice: ResponseChoice) -> Self {
        Self::ALL[choice.to_index()]
    }
}

/// Which controller blows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum BreathFromChoice {
    /// [`BreathFrom::Any`].
    #[id = "any"]
    #[name = "Any"]
    Any,
    /// The breath controller.
    #[id = "cc2"]
    #[name = "CC2"]
    Breath,
    /// Expression.
    #[id = "cc11"]
    #[name = "CC11"]
    Expression,
    /// Channel pressure.
    #[id = "press"]
    #[name = "Pressure"]
    Pressure,
    /// [`BreathFrom::Keys`].
    #[id = "keys"]
    #[name = "Keys"]
    Keys,
}

impl From<BreathFromChoice> for BreathFrom {
    fn from(choice: BreathFromChoice) -> Self {
        match choice {
            BreathFromChoice::Any => Self::Any,
            BreathFromChoice::Breath => Self::Only(BreathController::Breath),
            BreathFromChoice::Expression => Self::Only(BreathController::Expression),
            BreathFromChoice::Pressure => Self::Only(BreathController::Pressure),
            BreathFromChoice::Keys => Self::Keys,
        }
    }
}

impl Default for ChalumeauParams {
    fn default() -> Self {
        Self::new(&state::starting)
    }
}

impl ChalumeauParams {
    /// The table's parameters; `start` gives the default of a number.
    fn new(start: &dyn Fn(&str, &Number) -> f32) -> Self {
        let number = |id: &str| number_from(id, |number| start(id, number));
        let (knob_status, instrument_status) = (status_text("kstat"), status_text("istat"));
        let moments = Arc::<Moments>::default();
        Self {
            instrument: InstrumentParams::new(instrument_status.clone()),
            instrument_status,
            physical: PhysicalReedParams::default(),
            knob: KnobParams::new(knob_status.clone(), &moments),
            listening: ListeningParams::new(&number),
            room: RoomParams::new(&number),
            expression: ExpressionParams::new(&number),
            techniques: TechniqueParams::new(&number),
            players: PlayersParams::new(&number),
            microphone: MicrophoneParams::new(&moments),
            knob_status,
            schema: LoadedSchema::default(),
            window: RwLock::default(),
            links: ControllerLinks::default(),
            curves: SourceCurves::default(),
            scale: ScaleField::default(),
            alterations: AlterationsField::default(),
            room_floor: RoomFloor::default(),
            preset: RwLock::new(state::first_preset()),
            breath: BreathParams {
                breath: number("breath"),
                full: number("full"),
                tongue: number("tongue"),
                legato: number("legato"),
                response: choice("resp"),
                curve: number("bcurve"),
                softest: number("bsoft"),
                loudest: number("bloud"),
                from: choice("bfrom"),
                deadband: number("bdead"),
            },
            embouchure: EmbouchureParams {
                strength: number("stren"),
                lip: number("lip"),
                zeta: number("zeta"),
                damping: number("damp"),
            },
            reed: ReedParams {
                h: number("reedh"),
                k: number("reedk"),
                coupled: switch("reedc"),
                a: number("reeda"),
                lay: number("lay"),
            },
            tuning: TuningParams {
                a4: number("a4"),
                tuning: choice("tune"),
                temperature: number("temp"),
                vent_loss: number("vent"),
                transpose: whole("transp"),
                beyond: choice("beyond"),
            },
            noise: NoiseParams { noise: number("noise") },
            output: OutputParams { gain: number("gain"), panic: moment::switch(Moment::Panic, &moments) },
            moments,
            host: HostLink::default(),
        }
    }

    /// Name of the preset that was chosen last; empty if there is none.
    pub fn preset_name(&self) -> String {
        self.preset.read().map_or_else(|_| String::new(), |name| name.clone())
    }

    /// Remembers which preset was chosen.
    pub fn set_preset_name(&self, name: &str) {
        if let Ok(mut preset) = self.preset.write()
            && *preset != name
        {
            name.clone_into(&mut preset);
            self.host.state_changed();
        }
    }

    /// How often a saved state has been loaded; the number wraps around.
    pub fn loads(&self) -> u32 {
        self.schema.loads.load(Ordering::Relaxed)
    }

    /// Puts a preset on the parameters, without the host's gestures: it is told that the values have changed. Not for the
    /// audio thread: allocates and locks.
    #[allow(unsafe_code)] // the framework's setter
    pub fn put(&self, preset: &Preset) {
        let pointers = self.param_map();
        for (parameter, value) in preset.all_values(self.links.device()) {
            if let Some((_, pointer, _)) = pointers.iter().find(|(id, ..)| id == parameter.id) {
                // SAFETY: the pointer leads into `self`, and the setter stores atomics. The framework keeps it for its
                // wrappers because a host would not be told; `values_changed` is how it is told.
                unsafe {
                    match (pointer, value) {
                        // On the way through 0..=1 a number would lose its last bit.
                        (ParamPtr::FloatParam(param), Value::Number(number)) => {
                            (**param)._internal_set_plain_value(number)
                        }
                        _ => pointer._internal_set_normalized_value(parameter.normalized(value)),
                    }
                };
            }
        }
        self.set_preset_name(&preset.name);
        self.host.values_changed();
    }

    /// Whether parameters of this kind have an effect now. Real-time safe.
    pub fn is_in_use(&self, in_use: InUse) -> bool {
        let Self { knob, .. } = self;
        match in_use {
            InUse::Always => true,
            // A take is replayed as a knob would play it.
            InUse::WithKnob => knob.kind.value() != KnobKind::Off || knob.replay.value(),
            InUse::WithOscKnob => knob.kind.value() == KnobKind::Osc,
            InUse::InStudy => knob.study.value(),
        }
    }

    /// The parameters as the instrument reads them. Written field by field, so that none is forgotten and the audio thread
    /// looks nothing up; a test holds it to the table. Real-time safe.
    pub fn settings(&self) -> Settings {
        let Self { breath, embouchure, reed, tuning, noise, output, .. } = self;
        let mut settings = Settings {
            breath_response: breath.response.value().into(),
            breath_curve: settled(&breath.curve),
            breath_softest: settled(&breath.softest),
            breath_loudest: settled(&breath.loudest),
            breath_deadband: settled(&breath.deadband),
            breath_full_kpa: settled(&breath.full),
            noise: settled(&noise.noise),
            tongue_ms: settled(&breath.tongue),
            legato_ms: settled(&breath.legato),
            strength: settled(&embouchure.strength),
            lip: settled(&embouchure.lip),
            zeta: settled(&embouchure.zeta),
            damping: settled(&embouchure.damping),
            lay: settled(&reed.lay),
            reed_h: settled(&reed.h),
            reed_k: settled(&reed.k),
            coupled: reed.coupled.value(),
            reed_a: settled(&reed.a),
            a4_hz: settled(&tuning.a4),
            tuning: tuning.tuning.value().into(),
            temperature_c: settled(&tuning.temperature),
            vent_loss: settled(&tuning.vent_loss),
            gain_db: settled(&output.gain),
            listening: self.listening.listening(),
            reach: Reach {
                transpose: tuning.transpose.value(),
                beyond: tuning.beyond.value().into(),
                key_switches: self.expression.key_switches.value().into(),
            },
            room: self.room.room(),
            life: settled(&self.expression.life),
            vibrato: self.expression.vibrato(),
            attack: self.expression.attack.value().into(),
            glissando_s: settled(&self.expression.glissando),
            articulation: self.expression.articulation(),
            alternates: self.expression.alternates.value(),
            techniques: self.techniques.techniques(),
            tract: self.techniques.tract(),
            players: self.players.players(),
        };
        settings = self.physical.over(settings);
        if let Some((_, trial, side)) = self.knob.study() {
            let with =
                |k: f64| Settings { reed_h: trial.h as f32, reed_k: k as f32, coupled: false, ..settings };
            let [own, other] = [side, side.other()].map(|side| with(trial.condition(side).k(trial.h)));
            // Full breath closes either reed, so that the knob can do the same on both.
            let full_kpa = 1e-3 * own.closing_pa().max(other.closing_pa());
            settings = Settings { breath_full_kpa: own.breath_full_kpa.max(full_kpa as f32), ..own };
        } else if self.knob.k_source.value() != ReedSource::Parameter {
            // What a controller drives follows nothing else.
            settings.coupled = false;
        }
        settings
    }
}

/// A parameter's value. Hosts hand numbers through 0..=1 and back, which costs the last bit: the default survives.
fn settled(param: &FloatParam) -> f32 {
    let (value, default) = (param.value(), param.default_plain_value());
    let span = param.preview_plain(1.0) - param.preview_plain(0.0);
    if (value - default).abs() <= 1e-6 * span { default } else { value }
}

#[cfg(test)]
mod tests;

/// The schema of a saved state, which is [`SCHEMA`] once it is loaded; counts how often a state was.
#[derive(Debug, Default)]
struct LoadedSchema {
    loads: AtomicU32,
}

impl PersistentField<'_, u32> for LoadedSchema {
    fn set(&self, _: u32) {
        self.loads.fetch_add(1, Ordering::Relaxed);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&u32) -> R,
    {
        f(&SCHEMA)
    }
}

impl PersistentField<'_, SavedCurves> for SourceCurves {
    fn set(&self, saved: SavedCurves) {
        self.take(&saved);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&SavedCurves) -> R,
    {
        f(&self.saved())
    }
}

/// A project saves its links as the text of a [`ControllerMap`](crate::controllers::ControllerMap).
impl PersistentField<'_, String> for ControllerLinks {
    fn set(&self, text: String) {
        self.take_text(&text);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&String) -> R,
    {
        f(&self.to_text())
    }
}
