//! The knob's slow work: feels, takes and their files.
//!
//! It has a thread of its own, so that the thread that carries out the user's switches waits for none of it. What it has to say
//! to the user goes out as texts.

use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};

use super::SharedKnob;
use super::feel_design::{feel_design, knob_design};
use super::feel_in_force::FeelInForce;
use super::feels_cache::FeelsCache;
use super::heard_sound::SoundListener;
use super::take_recorder::{TakeRecorder, load_take, marks};
use crate::feel_flags;
use crate::plugin::instrument_loading::SharedInstrument;
use crate::plugin::params::ChalumeauParams;
use crate::plugin::params::knob::KnobKind;
use crate::plugin::params::moment::Moment;
use chalumeau_core::haptics::{FeelDesign, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::device::LinkStatus;
use chalumeau_knob::touch::breath_from_angle::BreathMapping;
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR, PitchMaps};
use chalumeau_knob::touch::take::{Take, TakeEmbouchure, TakeHand, TakeHead, TakeRow};

/// What the slow work tells the user.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorkTexts {
    /// Rows of the take that is being recorded.
    pub rows: Option<u64>,
    /// Why the latest feel was refused.
    pub refused: Option<String>,
    /// A warning that full breath does not reach the closing pressure.
    pub short_breath: Option<String>,
    /// The latest message about a take.
    pub take: Option<String>,
}

/// What a feel depends on.
#[derive(Clone)]
struct FeelInputs {
    feels: Arc<InstrumentFeel>,
    settings: Settings,
    design: FeelDesign,
    limits: TorqueLimits,
    /// A motor makes torque.
    is_felt: bool,
    /// That of the take that is replayed.
    replayed: Option<FeelDesign>,
}

impl FeelInputs {
    fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.feels, &other.feels)
            && (self.settings, self.design, self.limits, self.is_felt, self.replayed)
                == (other.settings, other.design, other.limits, other.is_felt, other.replayed)
    }
}

/// The state of the thread.
pub struct SlowWork {
    params: Arc<ChalumeauParams>,
    shared: Arc<SharedKnob>,
    instrument: Arc<SharedInstrument>,
    feels_cache: FeelsCache,
    hand_in: triple_buffer::Input<BreathMapping>,
    hand: BreathMapping,
    /// What the angles of a take mean that says its feel.
    replay_maps: Option<PitchMaps>,
    take: triple_buffer::Input<Option<Arc<Take>>>,
    /// What the feel in force was computed from.
    feel_inputs: Option<FeelInputs>,
    /// Rows that the link's thread sends.
    rows: mpsc::Receiver<TakeRow>,
    recorder: TakeRecorder,
    /// Nothing could be written since *Record take* was switched on.
    has_failed: bool,
    /// The take that is replayed, and its path; empty for none.
    replayed: Option<Arc<Take>>,
    replay_path: String,
    texts: WorkTexts,
}

impl SlowWork {
    pub fn new(
        params: Arc<ChalumeauParams>,
        shared: Arc<SharedKnob>,
        instrument: Arc<SharedInstrument>,
        hand_in: triple_buffer::Input<BreathMapping>,
        take: triple_buffer::Input<Option<Arc<Take>>>,
        sound: SoundListener,
        rows: mpsc::Receiver<TakeRow>,
    ) -> Self {
        Self {
            params,
            shared,
            instrument,
            feels_cache: FeelsCache::default(),
            hand_in,
            hand: BreathMapping::default(),
            replay_maps: None,
            take,
            feel_inputs: None,
            rows,
            recorder: TakeRecorder::new(sound),
            has_failed: false,
            replayed: None,
            replay_path: String::new(),
            texts: WorkTexts::default(),
        }
    }

    /// Until the plugin's knob stops; then the take that is open is completed.
    pub fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            if self.shared.is_active.load(Ordering::Relaxed) {
                self.cycle();
            }
            std::thread::sleep(super::CYCLE);
        }
        self.record(false, None);
    }

    fn cycle(&mut self) {
        let params = self.params.clone();
        let knob = &params.knob;
        let has_knob = knob.kind.value() != KnobKind::Off;
        let status = self.shared.status();
        let is_new = self.update_replay();
        let mut has_changed = false;
        if has_knob || knob.replay.value() {
            has_changed = self.update_feel(&params, status.as_ref());
        }
        self.update_hand(status.as_ref(), has_changed);
        if is_new {
            // After its hand.
            self.take.write(self.replayed.clone());
        }
        self.record(knob.record.value() && has_knob, status.as_ref());
        self.texts.rows = self.recorder.rows();
        self.shared.tell(&self.texts);
    }

    /// Computes the feel again if one of its inputs has changed; then true.
    fn update_feel(&mut self, params: &ChalumeauParams, status: Option<&LinkStatus>) -> bool {
        let settings = params.settings().with_reed_factors(self.shared.reed_factors());
        let design = feel_design(&params.knob);
        let ceiling_mnm = params.knob.ceiling.value().round() as u16;
        let limits = match status.and_then(|status| status.info.as_ref()) {
            Some(info) => info.torque_limits(ceiling_mnm),
            None => TorqueLimits { ceiling_mnm: f64::from(ceiling_mnm), ..TorqueLimits::default() },
        };
        let Some(feels) = self.feels_cache.of(&self.instrument) else { return false };
        let is_felt = status.is_some_and(makes_torque);
        let replayed = self.replayed.as_deref().and_then(recorded_feel);
        let inputs = FeelInputs { feels, settings, design, limits, is_felt, replayed };
        if self.feel_inputs.as_ref().is_some_and(|before| before.is_same(&inputs)) {
            return false;
        }
        self.feel_inputs = Some(inputs.clone());
        self.texts.short_breath = short_breath(&settings);
        let feels = inputs.feels;
        let felt = |design: FeelDesign, table| FeelInForce::new(feels.clone(), design, table, &settings);
        // No torque is too much where none is made.
        let unfelt =
            |design| feels.table(&settings, &design, &NO_MOTOR).ok().map(|table| felt(design, table));
        self.replay_maps = replayed.and_then(unfelt).map(|force| force.maps());
        let blown = match feels.table(&settings, &design, &limits) {
            Ok(table) => {
                self.texts.refused = None;
                let in_force = Arc::new(felt(design, table));
                self.shared.set_feel(in_force.clone());
                Some(in_force)
            }
            Err(reason) => {
                self.texts.refused = Some(format!("feel unchanged: {reason}"));
                // A motor keeps its feel, whose angles keep their breath.
                self.shared.feel_in_force().filter(|_| is_felt).or_else(|| unfelt(design).map(Arc::new))
            }
        };
        if let Some(blown) = blown {
            self.shared.set_blown(blown);
        }
        true
    }

    /// How the angles blow of the knob that is there.
    fn hand_of(&self, status: Option<&LinkStatus>) -> TakeHand {
        let feels = status.is_none_or(|status| status.tier > 0);
        let design = knob_design(&self.params.knob);
        // A knob that feels counts from its own zero. The rest of another, which counts from where it was switched on, is none of
        // its own.
        let is_felt = status.is_some_and(|status| status.tier > 0);
        TakeHand { design: if is_felt { design.from_zero() } else { design }, feels }
    }

    fn update_hand(&mut self, status: Option<&LinkStatus>, has_changed: bool) {
        let usual = knob_design(&self.params.knob).from_zero();
        let TakeHand { design, feels } = match &self.replayed {
            Some(take) => take.hand(usual),
            None => self.hand_of(status),
        };
        if !has_changed && (self.hand.design, self.hand.feels) == (design, feels) {
            return;
        }
        let of_take = self.replay_maps.filter(|_| self.replayed.is_some());
        let maps = of_take.or_else(|| Some(self.shared.blown()?.maps())).unwrap_or(self.hand.maps);
        self.hand = BreathMapping { maps, design, feels };
        self.hand_in.write(self.hand);
    }

    /// Loads the take to replay, if that has changed; then true.
    fn update_replay(&mut self) -> bool {
        let knob = &self.params.knob;
        let path = match knob.take.read() {
            Ok(path) if knob.replay.value() => path.clone(),
            _ => String::new(),
        };
        if path == self.replay_path {
            return false;
        }
        self.replay_path.clone_from(&path);
        self.texts.take = None;
        let take = (!path.is_empty()).then(|| load_take(&path)).transpose();
        self.replayed = take.unwrap_or_else(|reason| {
            self.texts.take = Some(reason);
            None
        });
        true
    }

    /// Records the rows that have come while `wanted`; otherwise completes the take. *Record take* stays on only while it can
    /// record.
    fn record(&mut self, wanted: bool, status: Option<&LinkStatus>) {
        let rows: Vec<TakeRow> = self.rows.try_iter().collect();
        let (moments, has_knob) = (&self.params.moments, self.params.knob.kind.value() != KnobKind::Off);
        if moments.take(Moment::Record) && !has_knob {
            self.texts.take = Some("nothing to record: choose a knob first".to_owned());
        }
        self.has_failed &= wanted;
        let wanted = wanted && !self.has_failed;
        moments.set_possible(Moment::Record, has_knob && !self.has_failed);
        let settings = self.params.settings().with_reed_factors(self.shared.reed_factors());
        let is_new = wanted && self.recorder.rows().is_none();
        let info = status.and_then(|status| status.info.as_ref());
        if is_new && let Err(reason) = self.recorder.begin(&self.params, &self.head(&settings, status), info)
        {
            self.params.moments.set_possible(Moment::Record, false);
            self.has_failed = true;
            self.texts.take = Some(reason);
            return;
        }
        let mut marks = marks(&self.params, &settings);
        if self.texts.refused.is_some() || self.shared.tested().is_some() {
            // The feel does not follow the sound, so these rows do not belong to a study.
            marks.study = None;
        }
        self.shared.is_recording.store(wanted, Ordering::Relaxed);
        for moment in &rows {
            marks.sounds_from = moment.written.and_then(|written| self.sounds_from(WrittenNote(written)));
            self.recorder.take_in(moment, &marks);
        }
        self.recorder.write_known();
        if self.recorder.has_failed() {
            self.params.moments.set_possible(Moment::Record, false);
            self.has_failed = true;
        }
        if (!wanted || self.has_failed)
            && let Some(text) = self.recorder.end(&self.params)
        {
            self.texts.take = Some(text);
        }
    }

    /// What a take that begins now says of itself.
    fn head(&self, settings: &Settings, status: Option<&LinkStatus>) -> TakeHead {
        TakeHead {
            instrument: self.instrument.current().map(|current| current.model.file.name.clone()),
            feel: self.shared.blown().map(|blown| feel_flags::in_flags(blown.design())),
            hand: Some(self.hand_of(status)),
            embouchure: Some(TakeEmbouchure::of(settings)),
        }
    }

    /// Gamma at which a note begins to sound with the feel in force.
    fn sounds_from(&self, written: WrittenNote) -> Option<f64> {
        self.shared.blown()?.sounds_from(written)
    }
}

/// The feel with which a take was recorded, if it says so in words that are known.
pub(super) fn recorded_feel(take: &Take) -> Option<FeelDesign> {
    feel_flags::read(take.head().feel.as_ref()?).ok()
}

/// Whether the hand may feel a torque of the knob: its own motor's, or one by way of a bridge.
fn makes_torque(status: &LinkStatus) -> bool {
    status.info.is_some() || status.armed
}

/// A warning if full breath does not reach the closing pressure.
fn short_breath(settings: &Settings) -> Option<String> {
    let (full_kpa, closing_kpa) = (f64::from(settings.breath_full_kpa), 1e-3 * settings.closing_pa());
    // Full breath is in single precision, which makes 6 kPa a little less than 6 kPa.
    (full_kpa < 0.999 * closing_kpa).then(|| {
        format!("this reed closes at {closing_kpa:.1} kPa: raise Full breath ({full_kpa:.1} kPa) to reach it")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_knob::touch::angle::KnobDesign;
    use chalumeau_knob::touch::breath_from_angle::Blower;

    #[test]
    fn the_rest_of_another_knob_takes_nothing_from_one_that_feels() {
        let design = KnobDesign { zero_deg: 40.0, full_deg: 400.0, ..KnobDesign::default() };
        let feels = InstrumentFeel::built_in().unwrap();
        let table = feels.table(&Settings::default(), &FeelDesign::default(), &NO_MOTOR).unwrap();
        let breath = |design| {
            let hand = BreathMapping { maps: feels.maps(&table), design, feels: true };
            Blower::default().blow(&hand, 200.0, 6_000.0).unwrap()
        };
        let own = KnobDesign { zero_deg: 0.0, full_deg: 360.0, ..KnobDesign::default() };
        assert_eq!(breath(design.from_zero()), breath(own));
        assert_ne!(breath(design), breath(own));
    }
}
