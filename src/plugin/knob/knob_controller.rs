//! The knob controller: the thread that follows the knob's parameters and does the slow work.

use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use super::SharedKnob;
use super::calibrator::Calibrator;
use super::feel_design::{feel_design, knob_design};
use super::feel_in_force::FeelInForce;
use super::feels_cache::FeelsCache;
use super::heard_sound::SoundListener;
use super::knob_switches::{KnobSwitches, is_live};
use super::main_pulse::MainPulseAsker;
use super::take_recorder::{TakeRecorder, load_take, marks};
use crate::plugin::instrument_loading::SharedInstrument;
use crate::plugin::params::knob::KnobKind;
use crate::plugin::params::moment::Moment;
use crate::plugin::params::{ChalumeauParams, KnobParams};
use chalumeau_core::haptics::{FeelDesign, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::device::{
    Hooks, KnobChoice, KnobLink, KnobReader, LinkStatus, StateSample, serial_number, serial_text,
};
use chalumeau_knob::touch::breath_from_angle::BreathMapping;
use chalumeau_knob::touch::feel::InstrumentFeel;
use chalumeau_knob::touch::take::{Take, TakeRow};

/// Time between two cycles of the thread.
const CYCLE: Duration = Duration::from_millis(10);

/// The controller's ends of what it shares with the audio thread.
pub struct AudioEnds {
    pub readers: rtrb::Producer<KnobReader>,
    pub hand: triple_buffer::Input<BreathMapping>,
    pub take: triple_buffer::Input<Option<Arc<Take>>>,
    pub sound: SoundListener,
}

/// The state of the controller's thread.
pub struct KnobController {
    params: Arc<ChalumeauParams>,
    shared: Arc<SharedKnob>,
    instrument: Arc<SharedInstrument>,
    main_thread: MainPulseAsker,
    feels_cache: FeelsCache,
    readers: rtrb::Producer<KnobReader>,
    hand_in: triple_buffer::Input<BreathMapping>,
    hand: BreathMapping,
    take: triple_buffer::Input<Option<Arc<Take>>>,
    /// What the feel in force was computed from.
    feel_inputs: Option<(Arc<InstrumentFeel>, Settings, FeelDesign, TorqueLimits)>,
    /// Why the latest feel was refused.
    refused: Option<String>,
    /// A warning that full breath does not reach the closing pressure.
    short_breath: Option<String>,
    link: Option<KnobLink>,
    choice: KnobChoice,
    /// The serial number that this instance has put into the project for *any knob*.
    remembered: Option<u64>,
    /// Rows that the link's thread sends.
    rows: (mpsc::Sender<TakeRow>, mpsc::Receiver<TakeRow>),
    recorder: TakeRecorder,
    /// The take that is replayed; empty for none.
    replay_path: String,
    /// The latest message about a take.
    take_message: Option<String>,
    switches: KnobSwitches,
    calibrator: Calibrator,
}

impl KnobController {
    pub(super) fn new(
        params: Arc<ChalumeauParams>,
        shared: Arc<SharedKnob>,
        instrument: Arc<SharedInstrument>,
        main_thread: MainPulseAsker,
        AudioEnds { readers, hand: hand_in, take, sound }: AudioEnds,
    ) -> Self {
        Self {
            params,
            shared,
            instrument,
            main_thread,
            feels_cache: FeelsCache::default(),
            readers,
            hand_in,
            hand: BreathMapping::default(),
            take,
            feel_inputs: None,
            refused: None,
            short_breath: None,
            link: None,
            choice: KnobChoice::Off,
            remembered: None,
            rows: mpsc::channel(),
            recorder: TakeRecorder::new(sound),
            replay_path: String::new(),
            take_message: None,
            switches: KnobSwitches::default(),
            calibrator: Calibrator::new(),
        }
    }

    pub(super) fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            if self.shared.is_active.load(Ordering::Relaxed) {
                self.cycle();
            } else {
                KnobSwitches::without_knob(&self.params.moments);
            }
            std::thread::sleep(CYCLE);
        }
        let rows = self.received();
        self.record(&rows, false);
    }

    fn cycle(&mut self) {
        let params = self.params.clone();
        let knob = &params.knob;
        self.choose_device(knob);
        if let Some(link) = &self.link {
            self.main_thread.cycle(&self.shared.main_pulse, link);
        }
        if self.choice != KnobChoice::Off || knob.replay.value() {
            let status = self.link.as_ref().map(KnobLink::status);
            self.update_feel(&params, status.as_ref());
        }
        self.update_replay(knob);
        let status = self.link.as_ref().map(KnobLink::status);
        self.update_hand(knob, status.as_ref().is_none_or(|status| status.tier > 0));
        match (&status, &self.link) {
            (Some(status), Some(link)) => {
                self.switches.apply(&params.moments, knob, status, link, &mut self.calibrator);
            }
            _ => KnobSwitches::without_knob(&params.moments),
        }
        let rows = self.received();
        self.calibrate(&rows, knob);
        self.record(&rows, knob.record.value() && self.choice != KnobChoice::Off);
        self.remember_serial(status.as_ref());
        self.report(status.as_ref());
        if let Ok(mut shown) = self.shared.status.lock() {
            *shown = status;
        }
    }

    /// Tells the link which device to use, if the choice has changed. Starts the link at the first choice.
    fn choose_device(&mut self, knob: &KnobParams) {
        let remembered = knob.serial.read().map_or(None, |text| serial_number(&text));
        let wanted = match knob.kind.value() {
            KnobKind::Off => KnobChoice::Off,
            KnobKind::Serial => KnobChoice::Serial { serial: remembered },
            KnobKind::Midi => {
                let name = knob.midi_port.read().map_or_else(|_| String::new(), |name| name.clone());
                KnobChoice::Midi { name: (!name.is_empty()).then_some(name) }
            }
            KnobKind::Osc => {
                let port = u16::try_from(knob.osc_port.value()).unwrap_or(8_000);
                KnobChoice::Osc { port, any_address: knob.osc_any.value() }
            }
        };
        let chosen_again = self.shared.device_chosen.swap(false, Ordering::Relaxed);
        // The serial number that the linked device has told is not a new choice.
        let same = match (&self.choice, &wanted) {
            (KnobChoice::Serial { serial: None }, KnobChoice::Serial { serial }) => {
                !chosen_again && (serial.is_none() || *serial == self.remembered)
            }
            (before, after) => before == after,
        };
        if same {
            return;
        }
        if wanted == KnobChoice::Off {
            // A user who switches off and on again asks for another device.
            if let Ok(mut serial) = knob.serial.write()
                && !serial.is_empty()
            {
                serial.clear();
                self.params.host.state_changed();
            }
        }
        if self.link.is_none() {
            let (link, reader) = KnobLink::spawn("Chalumeau", self.hooks());
            // The ring has room for one reader, and only one is ever made.
            let _ = self.readers.push(reader);
            let _ = self.shared.audio_heart.set(link.heartbeat("the host's audio thread"));
            self.link = Some(link);
        }
        if let Some(link) = &self.link {
            link.choose(wanted.clone());
        }
        self.choice = wanted;
    }

    /// What the link's thread calls: it asks for the feel, and reports each state of the knob.
    fn hooks(&self) -> Hooks {
        let shared = self.shared.clone();
        let feel = move || {
            if let Some(test) = shared.test.lock().ok().and_then(|test| *test) {
                return Some(test);
            }
            Some(shared.feel_in_force()?.feel(shared.note()))
        };
        let (shared, rows) = (self.shared.clone(), self.rows.0.clone());
        let instrument = self.instrument.clone();
        let on_state = move |state: &StateSample| {
            let _ = rows.send(TakeRow {
                t_us: u64::try_from(state.host_us).unwrap_or(0),
                angle_deg: f64::from(state.angle_deg),
                velocity_deg_s: f64::from(state.velocity_deg_s),
                torque_mnm: f64::from(state.torque_mnm),
                written: shared
                    .note()
                    .and_then(|note| note.written(instrument.transposition()))
                    .map(|WrittenNote(written)| written),
                gamma: shared.feel_in_force().map_or(0.0, |feel| feel.gamma(shared.note(), shared.breath())),
                feel_id: state.feel_id,
            });
        };
        Hooks { feel: Box::new(feel), on_state: Box::new(on_state) }
    }

    /// Computes the feel again if one of its inputs has changed.
    fn update_feel(&mut self, params: &ChalumeauParams, status: Option<&LinkStatus>) {
        let settings = params.settings().with_reed_factors(self.shared.reed_factors());
        let design = feel_design(&params.knob);
        let ceiling_mnm = params.knob.ceiling.value().round() as u16;
        let limits = match status.and_then(|status| status.info.as_ref()) {
            Some(info) => info.torque_limits(ceiling_mnm),
            None => TorqueLimits { ceiling_mnm: f64::from(ceiling_mnm), ..TorqueLimits::default() },
        };
        let Some(feels) = self.feels_cache.of(&self.instrument) else { return };
        let same = self.feel_inputs.as_ref().is_some_and(|(of, by, with, under)| {
            Arc::ptr_eq(of, &feels) && (*by, *with, *under) == (settings, design, limits)
        });
        if same {
            return;
        }
        self.feel_inputs = Some((feels.clone(), settings, design, limits));
        self.short_breath = short_breath(&settings);
        match feels.table(&settings, &design, &limits) {
            Ok(table) => {
                let in_force = FeelInForce::new(feels, table, &settings);
                self.hand.maps = in_force.maps();
                self.hand_in.write(self.hand);
                if let Ok(mut feel) = self.shared.feel.lock() {
                    *feel = Some(Arc::new(in_force));
                }
                self.refused = None;
            }
            // The old feel stays, and its angles keep their breath.
            Err(reason) => self.refused = Some(format!("feel unchanged: {reason}")),
        }
    }

    fn update_hand(&mut self, knob: &KnobParams, feels: bool) {
        let design = knob_design(knob);
        if (self.hand.design, self.hand.feels) != (design, feels) {
            (self.hand.design, self.hand.feels) = (design, feels);
            self.hand_in.write(self.hand);
        }
    }

    /// Loads the take to replay, if that has changed.
    fn update_replay(&mut self, knob: &KnobParams) {
        let path = match knob.take.read() {
            Ok(path) if knob.replay.value() => path.clone(),
            _ => String::new(),
        };
        if path == self.replay_path {
            return;
        }
        self.replay_path.clone_from(&path);
        self.take_message = None;
        let take = (!path.is_empty()).then(|| load_take(&path)).transpose();
        match take {
            Ok(take) => self.take.write(take),
            Err(reason) => {
                self.take_message = Some(reason);
                self.take.write(None);
            }
        }
    }

    /// The rows that have come since the last cycle.
    fn received(&self) -> Vec<TakeRow> {
        self.rows.1.try_iter().collect()
    }

    fn calibrate(&mut self, rows: &[TakeRow], knob: &KnobParams) {
        let readings = rows.iter().map(|moment| Some((moment.t_us, moment.angle_deg)));
        // A calibration also counts the time in which the knob sends nothing.
        let silence = rows.is_empty().then_some(None);
        for reading in readings.chain(silence) {
            if let Some(text) = self.calibrator.tick(reading, knob, self.link.as_ref(), self.hand.feels) {
                self.params.host.state_changed();
                self.switches.set_hint(text);
            }
        }
    }

    /// Records rows while `wanted`; otherwise completes the take. *Record take* stays on only while it can record.
    fn record(&mut self, rows: &[TakeRow], wanted: bool) {
        let (moments, has_knob) = (&self.params.moments, self.choice != KnobChoice::Off);
        if moments.take(Moment::Record) && !has_knob {
            self.take_message = Some("nothing to record: choose a knob first".to_owned());
        }
        moments.set_possible(Moment::Record, has_knob);
        if wanted && let Err(reason) = self.recorder.begin(&self.params) {
            self.params.moments.set_possible(Moment::Record, false);
            self.take_message = Some(reason);
            return;
        }
        let settings = self.params.settings().with_reed_factors(self.shared.reed_factors());
        let mut marks = marks(&self.params, &settings);
        if self.refused.is_some() {
            // The feel did not follow the sound, so these rows do not belong to a study.
            marks.study = None;
        }
        self.shared.is_recording.store(wanted, Ordering::Relaxed);
        for moment in rows {
            marks.sounds_from = moment.written.and_then(|written| self.sounds_from(WrittenNote(written)));
            self.recorder.take_in(moment, &marks);
        }
        self.recorder.write_known();
        if !wanted && let Some(text) = self.recorder.end(&self.params) {
            self.take_message = Some(text);
        }
    }

    /// Gamma at which a note begins to sound with the feel in force.
    fn sounds_from(&self, written: WrittenNote) -> Option<f64> {
        self.shared.feel_in_force()?.sounds_from(written)
    }

    /// Stores the serial number of a live device in the project.
    fn remember_serial(&mut self, status: Option<&LinkStatus>) {
        if let Some(status) = status
            && is_live(status)
            && let (KnobChoice::Serial { serial: chosen }, Some(serial)) = (&self.choice, status.serial)
            && chosen.is_none_or(|chosen| chosen == serial)
            && let Ok(mut text) = self.params.knob.serial.write()
        {
            // A project that has just been loaded names a knob of its own.
            let named = serial_number(&text);
            if named.is_none() || named == self.remembered {
                let told = serial_text(serial);
                if *text != told {
                    *text = told;
                    self.params.host.state_changed();
                }
                self.remembered = Some(serial);
            }
        }
    }

    /// Shows *Knob status*, and logs it if it is new.
    fn report(&self, status: Option<&LinkStatus>) {
        let mut words = vec![status.map_or_else(|| "off".to_owned(), |status| status.text.clone())];
        if let Some(rows) = self.recorder.rows() {
            words.push(format!("recording, {rows} rows"));
        }
        let own = [self.switches.hint(), self.refused.as_ref(), self.short_breath.as_ref()];
        words.extend(own.into_iter().chain([self.take_message.as_ref()]).flatten().cloned());
        if let Some(status) = status {
            let texts = [&status.alarm, &status.restriction, &status.last_refusal, &status.notice];
            words.extend(texts.into_iter().flatten().cloned());
        }
        let text = words.join("; ");
        if let Ok(mut shown) = self.params.knob_status.write()
            && *shown != text
        {
            nice_plug::prelude::nice_log!("knob: {text}");
            *shown = text;
            drop(shown);
            self.params.host.text_changed();
        }
    }
}

/// A warning if full breath does not reach the closing pressure.
fn short_breath(settings: &Settings) -> Option<String> {
    let (full_kpa, closing_kpa) = (f64::from(settings.breath_full_kpa), 1e-3 * settings.closing_pa());
    // Full breath is in single precision, which makes 6 kPa a little less than 6 kPa.
    (full_kpa < 0.999 * closing_kpa).then(|| {
        format!("this reed closes at {closing_kpa:.1} kPa: raise Full breath ({full_kpa:.1} kPa) to reach it")
    })
}
