//! Parameters of the knob: which one, what it shall feel like, takes and studies.
//!
//! None of them can be automated except those that are heard: what moves a motor is the user's to move. Switches that
//! act (*Arm*, *Take over*, *Rest here*, *Blow hard here*, *Record take*) are controls of the [`moment`](super::moment).

use std::sync::{Arc, RwLock};

use nice_plug::prelude::*;
use serde::{Deserialize, Serialize};

use super::entry::{choice, number, status, switch, whole};
use super::moment::{self, Moment, Moments};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::study::{StudySide, Trial, plan};

/// Which kind of device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum KnobKind {
    /// None.
    #[id = "off"]
    Off,
    /// TTLink over a serial port, real or simulated.
    #[id = "serial"]
    #[name = "Serial"]
    Serial,
    /// TTLink over the device's own MIDI port.
    #[id = "midi"]
    #[name = "MIDI port"]
    Midi,
    /// What unmodified firmware sends.
    #[id = "osc"]
    #[name = "OSC (stock firmware)"]
    Osc,
}

/// Torque law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum LawChoice {
    /// The seed's flow.
    #[id = "flow"]
    Flow,
    /// A spring with a step at the threshold.
    #[id = "press"]
    Pressure,
    /// None.
    #[id = "free"]
    Free,
}

/// What makes one note harder than another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum OrderChoice {
    /// What the bore asks.
    #[id = "phys"]
    #[name = "Physical"]
    Physical,
    /// The more holes are covered, the harder.
    #[id = "cover"]
    #[name = "Covered holes"]
    CoveredHoles,
    /// The more holes are covered, the easier.
    #[id = "open"]
    #[name = "Open holes"]
    OpenHoles,
}

/// What drives H or k, in sound and in the hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum ReedSource {
    /// The parameter alone.
    #[id = "param"]
    #[name = "Parameter"]
    Parameter,
    /// CC1.
    #[id = "cc1"]
    #[name = "CC1 (wheel)"]
    Wheel,
    /// CC16.
    #[id = "cc16"]
    #[name = "CC16"]
    Cc16,
    /// CC17.
    #[id = "cc17"]
    #[name = "CC17"]
    Cc17,
    /// CC74, the y of a Linnstrument.
    #[id = "cc74"]
    #[name = "CC74 (MPE y)"]
    Slide,
    /// Channel or key pressure, the z of a Linnstrument. It then no longer blows.
    #[id = "press"]
    #[name = "Pressure (MPE z)"]
    Pressure,
}

/// Where the hand rests and how far it turns, as a state keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedCalibration {
    /// Angle of the knob at rest, degrees.
    pub rest_deg: f64,
    /// Angle from rest that is a full blow: the reference reed's closure on the reference note, degrees.
    pub travel_deg: f64,
    /// How far from rest breath begins, degrees, and ends.
    pub dead_deg: (f64, f64),
}

impl SavedCalibration {
    /// The same inside its ranges.
    pub fn mended(self) -> Self {
        let fix = |x: f64, low: f64, high: f64, default: f64| {
            if x.is_finite() { x.clamp(low, high) } else { default }
        };
        let d = Self::default();
        let dead_on = fix(self.dead_deg.0, 0.1, 30.0, d.dead_deg.0);
        Self {
            rest_deg: fix(self.rest_deg, -36_000.0, 36_000.0, 0.0),
            travel_deg: fix(
                self.travel_deg,
                FeelDesign::TRAVEL_DEG.0,
                FeelDesign::TRAVEL_DEG.1,
                d.travel_deg,
            ),
            dead_deg: (dead_on, fix(self.dead_deg.1, 0.0, 0.9 * dead_on, 0.5 * dead_on)),
        }
    }

    /// As the knob's breath wants it.
    pub fn design(self, curve: f64) -> KnobDesign {
        let Self { rest_deg, travel_deg, dead_deg: (dead_on_deg, dead_off_deg) } = self.mended();
        KnobDesign { zero_deg: rest_deg, full_deg: rest_deg + travel_deg, curve, dead_on_deg, dead_off_deg }
    }

    /// What a design says, the other way round.
    pub fn of(design: &KnobDesign) -> Self {
        Self {
            rest_deg: design.zero_deg,
            travel_deg: design.full_deg - design.zero_deg,
            dead_deg: (design.dead_on_deg, design.dead_off_deg),
        }
        .mended()
    }
}

impl Default for SavedCalibration {
    fn default() -> Self {
        let design = KnobDesign::default();
        Self { rest_deg: 0.0, travel_deg: 360.0, dead_deg: (design.dead_on_deg, design.dead_off_deg) }
    }
}

/// Which knob, what it feels like, takes and studies.
#[derive(Params)]
pub struct KnobParams {
    /// Serial number of the device last used, hexadecimal, empty for none: never a path, which changes with the socket.
    #[persist = "serial"]
    pub serial: RwLock<String>,
    /// Name of the MIDI port last used, empty for the first that looks like a knob.
    #[persist = "midiport"]
    pub midi_port: RwLock<String>,
    /// Rest and full blow.
    #[persist = "calibration"]
    pub calibration: RwLock<SavedCalibration>,
    /// The take last recorded, or put here by the user's project: a file's path, empty for none.
    #[persist = "take"]
    pub take: RwLock<String>,
    /// Which kind of device. Default off.
    #[id = "knob"]
    pub kind: EnumParam<KnobKind>,
    /// Lets the knob make torque. Off in every state that is loaded, beside no connected knob, and after anything that
    /// disarms the knob: then it must be switched on again.
    #[id = "arm"]
    pub arm: BoolParam,
    /// Most torque the user allows, mNm, 10..=250. Default 100.
    #[id = "ceil"]
    pub ceiling: FloatParam,
    /// Takes the knob from the instance that has it: a command.
    #[id = "takeov"]
    pub take_over: BoolParam,
    /// The knob is at rest where it stands: a command.
    #[id = "rest"]
    pub rest: BoolParam,
    /// The knob stands where a full blow shall be: a command.
    #[id = "blow"]
    pub blow: BoolParam,
    /// Torque law. Default flow.
    #[id = "law"]
    pub law: EnumParam<LawChoice>,
    /// Exaggeration of the differences in torque between notes: 1 is physical. Default 3.
    #[id = "contr"]
    pub contrast: FloatParam,
    /// What makes a note harder. Default physical.
    #[id = "order"]
    pub order: EnumParam<OrderChoice>,
    /// Written note that is felt as it is at every contrast and place, MIDI number.
    #[id = "refnot"]
    pub reference: IntParam,
    /// Torque of the reference note per unit of flow, mNm. Default 55.
    #[id = "torque"]
    pub torque: FloatParam,
    /// Damping beside the knob's own, mNm s/rad.
    #[id = "kdamp"]
    pub damping: FloatParam,
    /// Friction, mNm.
    #[id = "kfric"]
    pub friction: FloatParam,
    /// Height of the step at the threshold, mNm; pressure law only. Default 6.
    #[id = "detent"]
    pub detent: FloatParam,
    /// Exponent of the way from rest to full blow, on knobs that do not feel. Default 1.
    #[id = "curve"]
    pub curve: FloatParam,
    /// UDP port for OSC.
    #[id = "oscprt"]
    pub osc_port: IntParam,
    /// Whether OSC may come from other machines.
    #[id = "oscany"]
    pub osc_any: BoolParam,
    /// UDP port on this machine that the feel is also sent to, as OSC; 0 for none.
    #[id = "oscfl"]
    pub feel_port: IntParam,
    /// Writes a take while on, which it can only be beside a knob.
    #[id = "rec"]
    pub record: BoolParam,
    /// Plays the take instead of a knob, from when it is switched on or the host starts again.
    #[id = "replay"]
    pub replay: BoolParam,
    /// H and k come from the trial of a study.
    #[id = "study"]
    pub study: BoolParam,
    /// Participant's number.
    #[id = "part"]
    pub participant: IntParam,
    /// Decides the order of trials.
    #[id = "seed"]
    pub seed: IntParam,
    /// Which trial.
    #[id = "trial"]
    pub trial: IntParam,
    /// Side A or B of the trial.
    #[id = "side"]
    pub side: BoolParam,
    /// What drives H.
    #[id = "hsrc"]
    pub h_source: EnumParam<ReedSource>,
    /// What drives k.
    #[id = "ksrc"]
    pub k_source: EnumParam<ReedSource>,
    /// Says how the link is; its value means nothing.
    #[id = "kstat"]
    pub status: BoolParam,
    /// Exaggeration of the differences in angle at which notes speak: 1 is physical. Default 1.
    #[id = "place"]
    pub place: FloatParam,
    /// Height of the mark at the threshold, mNm; flow law only. Default 9.
    #[id = "mark"]
    pub mark: FloatParam,
}

impl KnobParams {
    /// Defaults; the link to the knob writes its state to `link`, and switches that act tell `moments`.
    pub fn new(link: Arc<RwLock<String>>, moments: &Arc<Moments>) -> Self {
        Self {
            serial: RwLock::default(),
            midi_port: RwLock::default(),
            calibration: RwLock::default(),
            take: RwLock::default(),
            kind: choice("knob"),
            arm: moment::switch(Moment::Arm, moments),
            ceiling: number("ceil"),
            take_over: moment::switch(Moment::TakeOver, moments),
            rest: moment::switch(Moment::Rest, moments),
            blow: moment::switch(Moment::Blow, moments),
            law: choice("law"),
            contrast: number("contr"),
            order: choice("order"),
            reference: whole("refnot"),
            torque: number("torque"),
            damping: number("kdamp"),
            friction: number("kfric"),
            detent: number("detent"),
            curve: number("curve"),
            osc_port: whole("oscprt"),
            osc_any: switch("oscany"),
            feel_port: whole("oscfl"),
            record: moment::switch(Moment::Record, moments),
            replay: switch("replay"),
            study: switch("study"),
            participant: whole("part"),
            seed: whole("seed"),
            trial: whole("trial"),
            side: switch("side"),
            h_source: choice("hsrc"),
            k_source: choice("ksrc"),
            status: status("kstat", link),
            place: number("place"),
            mark: number("mark"),
        }
    }

    /// Participant, trial and side, while a study is on. Real-time safe.
    pub fn study(&self) -> Option<(u32, Trial, StudySide)> {
        if !self.study.value() {
            return None;
        }
        let whole = |param: &IntParam| u32::try_from(param.value()).unwrap_or(1);
        let participant = whole(&self.participant);
        let trials = plan(participant, whole(&self.seed));
        let trial = *trials.get(whole(&self.trial).saturating_sub(1) as usize)?;
        Some((participant, trial, if self.side.value() { StudySide::B } else { StudySide::A }))
    }
}
