//! What a host can set: one documented parameter for each field of [`Settings`], and the two that act by moving,
//! *Breath* and *Panic*.
//!
//! Ids live in saved projects and automation lanes: they are only ever added. Every number has its unit and reads both
//! ways as text. Ranges are those of [`Settings::clamped`]; a test holds them together.

use std::sync::atomic::AtomicU32;
use std::sync::{Arc, RwLock};

use nice_plug::prelude::*;

use crate::editor::Kept;
use chalumeau_core::instrument::prepare::A4_RANGE_HZ;
use chalumeau_core::instrument::{Settings, Tuning};

pub mod instrument;
pub mod knob;
pub mod reed;

pub use instrument::InstrumentParams;
pub use knob::KnobParams;
use knob::{Calibration, ReedSource};
pub use reed::PhysicalReedParams;
use serde::{Serialize, de::DeserializeOwned};

/// Layout of the saved state. 1: ids and units as below. 2: the instrument and its file, the physical reed; a state of 1
/// is the B flat clarinet.
pub const SCHEMA: u32 = 2;
const SCHEMA_FIELD: &str = "schema";

/// All parameters, by group.
#[derive(Params)]
pub struct ChalumeauParams {
    /// Layout of a state as it was saved; see [`SCHEMA`].
    #[persist = "schema"]
    schema: AtomicU32,
    /// Breath and articulation.
    #[nested(group = "Breath")]
    pub breath: BreathParams,
    /// Lip and reed as a player names them.
    #[nested(group = "Embouchure")]
    pub embouchure: EmbouchureParams,
    /// The reed's law as the seed writes it.
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
    /// How far the instrument is, in words; written by whoever makes it.
    pub instrument_status: Arc<RwLock<String>>,
    /// Size, zoom, theme and view of the window.
    #[persist = "window"]
    pub window: RwLock<Kept>,
    /// How the link to the knob is, in words; written by the link.
    pub knob_status: Arc<RwLock<String>>,
}

/// Breath and articulation.
#[derive(Params)]
pub struct BreathParams {
    /// Breath, percent of *Full breath*. Moving it blows; left alone it leaves the breath to CC2, CC11, channel
    /// pressure or velocity. Default 0.
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

/// The reed's law as the seed writes it.
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
    /// Switched on, silences everything once.
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

impl From<Tuning> for TuningChoice {
    fn from(tuning: Tuning) -> Self {
        match tuning {
            Tuning::Natural => Self::Natural,
            Tuning::Tempered => Self::Tempered,
        }
    }
}

impl From<TuningChoice> for Tuning {
    fn from(choice: TuningChoice) -> Self {
        match choice {
            TuningChoice::Natural => Self::Natural,
            TuningChoice::Tempered => Self::Tempered,
        }
    }
}

impl Default for ChalumeauParams {
    fn default() -> Self {
        let d = Settings::default();
        let knob_status = Arc::new(RwLock::new("off".to_owned()));
        let instrument_status = Arc::new(RwLock::new("not playing".to_owned()));
        Self {
            instrument: InstrumentParams::new(instrument_status.clone()),
            instrument_status,
            physical: PhysicalReedParams::default(),
            knob: KnobParams::new(knob_status.clone()),
            knob_status,
            schema: AtomicU32::new(SCHEMA),
            window: RwLock::default(),
            breath: BreathParams {
                breath: percent("Breath", 0.0),
                full: number("Full breath", d.breath_full_kpa, 2.0, 20.0, 2, " kPa"),
                tongue: number("Tongue", d.tongue_ms, 1.0, 20.0, 1, " ms"),
                legato: number("Legato", d.legato_ms, 5.0, 15.0, 1, " ms"),
            },
            embouchure: EmbouchureParams {
                strength: number("Reed strength", d.strength, 1.5, 5.0, 2, ""),
                lip: number("Lip opening", d.lip, 0.6, 1.4, 3, " x"),
                zeta: number("Embouchure zeta", d.zeta, 0.05, 0.9, 3, ""),
                damping: number("Lip damping", d.damping, 0.2, 2.0, 2, " x"),
            },
            reed: ReedParams {
                h: number("Reed H", d.reed_h, 1.0, 5.0, 4, ""),
                k: number("Reed k", d.reed_k, 0.1, 2.0, 4, ""),
                coupled: BoolParam::new("Reed coupled", d.coupled)
                    .with_value_to_string(Arc::new(|on| if on { "Coupled" } else { "Free" }.to_owned()))
                    .with_string_to_value(Arc::new(|text| either(text, "coupled", "free"))),
                a: number("Reed A", d.reed_a, 0.0, 2.0, 3, ""),
                lay: number("Lay curve", d.lay, 0.0, 0.5, 3, ""),
            },
            tuning: TuningParams {
                a4: number(
                    "A4",
                    instrument::beginning().map_or(d.a4_hz, |first| first.a4_hz),
                    A4_RANGE_HZ.0 as f32,
                    A4_RANGE_HZ.1 as f32,
                    1,
                    " Hz",
                ),
                tuning: EnumParam::new("Tuning", d.tuning.into()),
                temperature: number("Temperature", d.temperature_c, 10.0, 40.0, 1, " °C"),
                vent_loss: number("Vent loss", d.vent_loss, 0.0, 4.0, 2, ""),
            },
            noise: NoiseParams { noise: percent("Breath noise", d.noise) },
            output: OutputParams {
                gain: number("Gain", d.gain_db, -60.0, 24.0, 1, " dB"),
                panic: BoolParam::new("Panic", false)
                    .with_string_to_value(Arc::new(|text| either(text, "on", "off"))),
            },
        }
    }
}

impl ChalumeauParams {
    /// The parameters as the instrument reads them. Real-time safe.
    pub fn settings(&self) -> Settings {
        let Self { breath, embouchure, reed, tuning, noise, output, .. } = self;
        let mut settings = Settings {
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
        };
        settings = self.physical.over(settings);
        if let Some((_, trial, side)) = self.knob.study() {
            settings.reed_h = trial.h as f32;
            settings.reed_k = trial.condition(side).k(trial.h) as f32;
            settings.coupled = false;
        } else if self.knob.k_source.value() != ReedSource::Parameter {
            // What a controller drives follows nothing else.
            settings.coupled = false;
        }
        settings
    }

    fn numbers(&self) -> [(&'static str, &FloatParam); 17] {
        let Self { breath, embouchure, reed, tuning, noise, output, .. } = self;
        [
            ("breath", &breath.breath),
            ("full", &breath.full),
            ("tongue", &breath.tongue),
            ("legato", &breath.legato),
            ("stren", &embouchure.strength),
            ("lip", &embouchure.lip),
            ("zeta", &embouchure.zeta),
            ("damp", &embouchure.damping),
            ("reedh", &reed.h),
            ("reedk", &reed.k),
            ("reeda", &reed.a),
            ("lay", &reed.lay),
            ("a4", &tuning.a4),
            ("temp", &tuning.temperature),
            ("vent", &tuning.vent_loss),
            ("noise", &noise.noise),
            ("gain", &output.gain),
        ]
    }
}

/// Makes a state fit to load, whoever wrote it: numbers inside their ranges, values of the wrong kind and unknown ids
/// dropped, and what the state does not mention set to its default, so that a state means the same in every session.
pub fn mend(state: &mut PluginState) {
    use nice_plug::plugin::ParamValue;
    let params = ChalumeauParams::default();
    let mut old = std::mem::take(&mut state.params);
    let mut keep = |id: &str, value: ParamValue| state.params.insert(id.to_owned(), value);
    let numbers = params.numbers().into_iter().chain(params.knob.numbers()).chain(params.physical.numbers());
    for (id, param) in numbers {
        let value = match old.remove(id) {
            Some(ParamValue::F32(value)) if value.is_finite() => {
                let (low, high) = (param.preview_plain(0.0), param.preview_plain(1.0));
                value.clamp(low, high)
            }
            _ => param.default_plain_value(),
        };
        keep(id, ParamValue::F32(value));
    }
    let bend = ("bendr", &params.instrument.bend_range);
    for (id, param) in params.knob.wholes().into_iter().chain([bend]) {
        let value = match old.remove(id) {
            Some(ParamValue::I32(value)) => value.clamp(param.preview_plain(0.0), param.preview_plain(1.0)),
            _ => param.default_plain_value(),
        };
        keep(id, ParamValue::I32(value));
    }
    let own = [
        ("reedc", &params.reed.coupled, true),
        ("panic", &params.output.panic, true),
        ("istat", &params.instrument.status, false),
    ];
    for (id, param, kept) in own.into_iter().chain(params.knob.switches()) {
        let value = match old.remove(id) {
            Some(ParamValue::Bool(value)) if kept => value,
            _ => param.default_plain_value(),
        };
        keep(id, ParamValue::Bool(value));
    }
    let tunings: (&str, &str, &[&str]) = ("tune", "nat", &["nat", "temp"]);
    let choices = [tunings].into_iter().chain(KnobParams::CHOICES);
    let choices = choices.chain(InstrumentParams::CHOICES).chain(PhysicalReedParams::CHOICES);
    for (id, default, all) in choices {
        let value = match old.remove(id) {
            Some(ParamValue::String(value)) if all.contains(&value.as_str()) => value,
            _ => default.to_owned(),
        };
        keep(id, ParamValue::String(value));
    }
    mend_field(
        state,
        "serial",
        |text: String| {
            if u64::from_str_radix(&text, 16).is_ok() { text } else { String::new() }
        },
    );
    mend_field(state, "midiport", |text: String| text.chars().take(256).collect());
    mend_field(state, "take", |text: String| text);
    mend_field(state, "instrumentfile", |text: String| text.chars().take(instrument::PATH_MOST).collect());
    mend_field(state, "calibration", Calibration::mended);
    mend_field(state, "window", Kept::mended);
    // An older schema lacks what it lacks; a newer one is read as far as its ids are known here.
    state.fields.insert(SCHEMA_FIELD.to_owned(), SCHEMA.to_string());
}

/// A field as it may be, or as it is by default.
fn mend_field<T: Default + Serialize + DeserializeOwned>(
    state: &mut PluginState,
    id: &str,
    mended: impl Fn(T) -> T,
) {
    let value = state.fields.get(id).and_then(|text| serde_json::from_str(text).ok());
    if let Ok(text) = serde_json::to_string(&mended(value.unwrap_or_default())) {
        state.fields.insert(id.to_owned(), text);
    }
}

/// A parameter's value. Hosts hand numbers through 0..=1 and back, which costs the last bit: the default survives.
fn settled(param: &FloatParam) -> f32 {
    let (value, default) = (param.value(), param.default_plain_value());
    let span = param.preview_plain(1.0) - param.preview_plain(0.0);
    if (value - default).abs() <= 1e-6 * span { default } else { value }
}

/// A parameter whose value means nothing and whose text says something.
fn said(name: &str, text: Arc<RwLock<String>>) -> BoolParam {
    BoolParam::new(name, false)
        .with_value_to_string(Arc::new(move |_| {
            text.read().map_or_else(|_| String::new(), |text| text.clone())
        }))
        .with_string_to_value(Arc::new(|_| Some(false)))
        .non_automatable()
}

/// A linear parameter shown with `digits` decimals.
fn number(name: &str, default: f32, min: f32, max: f32, digits: usize, unit: &'static str) -> FloatParam {
    FloatParam::new(name, default, FloatRange::Linear { min, max })
        .with_unit(unit)
        .with_value_to_string(formatters::v2s_f32_rounded(digits))
        .with_string_to_value(Arc::new(move |text| parse(text, unit)))
}

fn percent(name: &str, default: f32) -> FloatParam {
    FloatParam::new(name, default, FloatRange::Linear { min: 0.0, max: 1.0 })
        .with_unit(" %")
        .with_value_to_string(formatters::v2s_f32_percentage(1))
        .with_string_to_value(Arc::new(|text| parse(text, " %").map(|percent| percent / 100.0)))
}

/// A number, with or without its unit, a decimal comma allowed.
fn parse(text: &str, unit: &str) -> Option<f32> {
    let text = text.trim();
    let unit = unit.trim();
    let bare = text
        .len()
        .checked_sub(unit.len())
        .and_then(|at| text.split_at_checked(at))
        .filter(|(_, tail)| tail.eq_ignore_ascii_case(unit))
        .map_or(text, |(head, _)| head);
    bare.trim().replace(',', ".").parse().ok().filter(|value: &f32| value.is_finite())
}

fn either(text: &str, yes: &str, no: &str) -> Option<bool> {
    let is = |words: &[&str]| words.iter().any(|word| text.trim().eq_ignore_ascii_case(word));
    if is(&[yes, "on", "true", "1"]) {
        Some(true)
    } else if is(&[no, "off", "false", "0"]) {
        Some(false)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nice_plug::plugin::ParamValue;

    use super::*;

    /// Id, group and default as text, in the order hosts list them. Append only.
    const TABLE: &[(&str, &str, &str)] = &[
        ("breath", "Breath", "0.0 %"),
        ("full", "Breath", "6.00 kPa"),
        ("tongue", "Breath", "2.0 ms"),
        ("legato", "Breath", "8.0 ms"),
        ("stren", "Embouchure", "2.50"),
        ("lip", "Embouchure", "1.000 x"),
        ("zeta", "Embouchure", "0.300"),
        ("damp", "Embouchure", "1.00 x"),
        ("reedh", "Reed", "2.5981"),
        ("reedk", "Reed", "0.3849"),
        ("reedc", "Reed", "Coupled"),
        ("reeda", "Reed", "1.000"),
        ("lay", "Reed", "0.400"),
        ("a4", "Tuning", "440.0 Hz"),
        ("tune", "Tuning", "Natural"),
        ("temp", "Tuning", "25.0 °C"),
        ("vent", "Tuning", "2.00"),
        ("noise", "Noise", "30.0 %"),
        ("gain", "Output", "0.0 dB"),
        ("panic", "Output", "Off"),
        ("knob", "Knob", "Off"),
        ("arm", "Knob", "Off"),
        ("ceil", "Knob", "100 mNm"),
        ("takeov", "Knob", "Off"),
        ("rest", "Knob", "Off"),
        ("blow", "Knob", "Off"),
        ("law", "Knob", "Flow"),
        ("contr", "Knob", "3.00 x"),
        ("order", "Knob", "Physical"),
        ("refnot", "Knob", "72"),
        ("torque", "Knob", "60 mNm"),
        ("kdamp", "Knob", "1.00 mNm s"),
        ("kfric", "Knob", "1.0 mNm"),
        ("detent", "Knob", "6.0 mNm"),
        ("curve", "Knob", "1.00"),
        ("oscprt", "Knob", "8000"),
        ("oscany", "Knob", "Off"),
        ("oscfl", "Knob", "0"),
        ("rec", "Knob", "Off"),
        ("replay", "Knob", "Off"),
        ("study", "Knob", "Off"),
        ("part", "Knob", "1"),
        ("seed", "Knob", "1"),
        ("trial", "Knob", "1"),
        ("side", "Knob", "A"),
        ("hsrc", "Knob", "Parameter"),
        ("ksrc", "Knob", "Parameter"),
        ("kstat", "Knob", "off"),
        ("instr", "Instrument", "B flat clarinet"),
        ("qual", "Instrument", "Same as live"),
        ("bendr", "Instrument", "2 st"),
        ("istat", "Instrument", "not playing"),
        ("rface", "Reed, physical", "Dimensionless"),
        ("rstiff", "Reed, physical", "1218.1 N/m"),
        ("rarea", "Reed, physical", "101.50 mm²"),
        ("rwidth", "Reed, physical", "15.21 mm"),
        ("ropen", "Reed, physical", "0.500 mm"),
    ];

    fn texts(params: &ChalumeauParams) -> BTreeMap<&'static str, String> {
        let text =
            |param: &FloatParam| param.normalized_value_to_string(param.default_normalized_value(), true);
        let numbers = params.numbers().into_iter().chain(params.knob.numbers());
        let numbers = numbers.chain(params.physical.numbers());
        let mut all: BTreeMap<_, _> = numbers.map(|(id, param)| (id, text(param))).collect();
        all.extend(params.knob.wholes().map(|(id, param)| (id, param.to_string())));
        all.extend(params.knob.switches().map(|(id, param, _)| (id, param.to_string())));
        all.insert("instr", params.instrument.choice.to_string());
        all.insert("qual", params.instrument.quality.to_string());
        all.insert("bendr", params.instrument.bend_range.to_string());
        all.insert("istat", params.instrument.status.to_string());
        all.insert("rface", params.physical.face.to_string());
        all.insert("knob", params.knob.kind.to_string());
        all.insert("law", params.knob.law.to_string());
        all.insert("order", params.knob.order.to_string());
        all.insert("hsrc", params.knob.h_source.to_string());
        all.insert("ksrc", params.knob.k_source.to_string());
        all.insert("reedc", params.reed.coupled.to_string());
        all.insert("panic", params.output.panic.to_string());
        all.insert("tune", params.tuning.tuning.to_string());
        all
    }

    #[test]
    fn ids_order_groups_and_defaults_are_pinned() {
        let params = ChalumeauParams::default();
        let texts = texts(&params);
        let found = params.param_map();
        let found: Vec<_> = found
            .iter()
            .map(|(id, _, group)| (id.as_str(), group.as_str(), texts[id.as_str()].as_str()))
            .collect();
        assert_eq!(found, TABLE);
        assert!(TABLE.iter().all(|(id, ..)| id.len() <= 6));
    }

    #[test]
    fn default_parameters_are_the_reference_clarinet_bit_for_bit() {
        assert_eq!(ChalumeauParams::default().settings(), Settings::default());
    }

    #[test]
    fn defaults_survive_a_host_that_thinks_in_0_to_1() {
        for (id, param) in ChalumeauParams::default().numbers() {
            let back = param.preview_plain(param.default_normalized_value());
            let echo = FloatParam::new(id, param.default_plain_value(), param.range());
            let span = param.preview_plain(1.0) - param.preview_plain(0.0);
            assert!((back - echo.value()).abs() <= 1e-6 * span, "{id}: {back}");
        }
    }

    #[test]
    fn ranges_are_those_of_the_instrument() {
        let d = Settings::default();
        let wide = |x: f32| {
            Settings {
                breath_full_kpa: x,
                noise: x,
                tongue_ms: x,
                legato_ms: x,
                strength: x,
                lip: x,
                zeta: x,
                damping: x,
                lay: x,
                reed_h: x,
                reed_k: x,
                reed_a: x,
                a4_hz: x,
                temperature_c: x,
                vent_loss: x,
                gain_db: x,
                ..d
            }
            .clamped()
        };
        let params = ChalumeauParams::default();
        for (x, unit) in [(-1e9, 0.0), (1e9, 1.0)] {
            let s = wide(x);
            let ends: BTreeMap<_, _> =
                params.numbers().map(|(id, param)| (id, param.preview_plain(unit))).into();
            for (id, end) in [
                ("full", s.breath_full_kpa),
                ("noise", s.noise),
                ("tongue", s.tongue_ms),
                ("legato", s.legato_ms),
                ("stren", s.strength),
                ("lip", s.lip),
                ("zeta", s.zeta),
                ("damp", s.damping),
                ("lay", s.lay),
                ("reedh", s.reed_h),
                ("reedk", s.reed_k),
                ("reeda", s.reed_a),
                ("a4", s.a4_hz),
                ("temp", s.temperature_c),
                ("vent", s.vent_loss),
                ("gain", s.gain_db),
            ] {
                assert_eq!(ends[id], end, "{id}");
            }
        }
    }

    #[test]
    fn text_reads_both_ways() {
        for (id, param) in ChalumeauParams::default().numbers() {
            for step in 0..=200 {
                for unit in [true, false] {
                    let text = param.normalized_value_to_string(step as f32 / 200.0, unit);
                    let back =
                        param.string_to_normalized_value(&text).unwrap_or_else(|| panic!("{id}: {text}"));
                    assert!((back - step as f32 / 200.0).abs() < 0.006, "{id}: {text} read as {back}");
                    assert_eq!(param.normalized_value_to_string(back, unit), text, "{id}");
                }
            }
            for nonsense in ["", "loud", "1e99", "nan", "1.2.3", "°", "%%"] {
                assert_eq!(param.string_to_normalized_value(nonsense), None, "{id}: {nonsense}");
            }
        }
        assert_eq!(parse("6,5 KPA", " kPa"), Some(6.5));
        assert_eq!(parse(" -3 ", " dB"), Some(-3.0));
    }

    #[test]
    fn switches_read_both_ways() {
        let params = ChalumeauParams::default();
        for param in [&params.reed.coupled, &params.output.panic] {
            for value in [0.0, 1.0] {
                let text = param.normalized_value_to_string(value, true);
                assert_eq!(param.string_to_normalized_value(&text), Some(value), "{text}");
            }
            assert_eq!(param.string_to_normalized_value("perhaps"), None);
        }
        for value in [0.0, 1.0] {
            let text = params.tuning.tuning.normalized_value_to_string(value, true);
            assert_eq!(params.tuning.tuning.string_to_normalized_value(&text), Some(value), "{text}");
        }
    }

    #[test]
    fn any_state_is_mended() {
        let mut state = PluginState {
            version: String::new(),
            params: BTreeMap::from([
                ("full".to_owned(), ParamValue::F32(99.0)),
                ("zeta".to_owned(), ParamValue::F32(f32::NAN)),
                ("lip".to_owned(), ParamValue::Bool(true)),
                ("tune".to_owned(), ParamValue::String("just".to_owned())),
                ("reedc".to_owned(), ParamValue::Bool(false)),
                ("gone".to_owned(), ParamValue::I32(3)),
                ("arm".to_owned(), ParamValue::Bool(true)),
                ("rec".to_owned(), ParamValue::Bool(true)),
                ("knob".to_owned(), ParamValue::String("osc".to_owned())),
                ("law".to_owned(), ParamValue::String("strong".to_owned())),
                ("trial".to_owned(), ParamValue::I32(99)),
                ("ceil".to_owned(), ParamValue::F32(9e9)),
            ]),
            fields: BTreeMap::from([
                ("schema".to_owned(), "rubbish".to_owned()),
                ("serial".to_owned(), "\"/dev/ttyUSB0\"".to_owned()),
                (
                    "calibration".to_owned(),
                    "{\"rest_deg\":1e99,\"travel_deg\":1.0,\"dead_deg\":[1,5]}".to_owned(),
                ),
            ]),
        };
        mend(&mut state);
        assert_eq!(state.params.len(), TABLE.len());
        assert!(matches!(state.params["full"], ParamValue::F32(20.0)));
        assert!(matches!(state.params["zeta"], ParamValue::F32(0.3)));
        assert!(matches!(state.params["lip"], ParamValue::F32(1.0)));
        assert!(matches!(state.params["reedc"], ParamValue::Bool(false)));
        assert!(matches!(&state.params["tune"], ParamValue::String(id) if id == "nat"));
        assert_eq!(state.fields["schema"], SCHEMA.to_string());
        for id in ["arm", "rec"] {
            assert!(
                matches!(state.params[id], ParamValue::Bool(false)),
                "{id} is never on in a loaded state"
            );
        }
        assert!(matches!(&state.params["knob"], ParamValue::String(id) if id == "osc"));
        assert!(matches!(&state.params["law"], ParamValue::String(id) if id == "flow"));
        assert!(matches!(state.params["trial"], ParamValue::I32(16)));
        assert!(matches!(state.params["ceil"], ParamValue::F32(250.0)));
        assert_eq!(state.fields["serial"], "\"\"", "a path is no serial number");
        assert!(state.fields["calibration"].contains("120.0"), "{}", state.fields["calibration"]);
    }
}
