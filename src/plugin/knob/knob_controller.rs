//! The knob controller: the thread that carries out the user's switches. It waits for nothing that takes long, see
//! [`slow_work`](super::slow_work), and gives a sign of life of its own: a knob is let go if it stands still.

use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use super::SharedKnob;
use super::calibrator::{Calibrator, Reading};
use super::knob_switches::{KnobSwitches, is_live};
use super::main_pulse::MainPulseAsker;
use crate::plugin::instrument_loading::SharedInstrument;
use crate::plugin::params::knob::{KnobKind, SavedCalibration};
use crate::plugin::params::{ChalumeauParams, KnobParams};
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::device::{
    Heartbeat, Hooks, KnobChoice, KnobLink, KnobReader, LinkStatus, StateSample, serial_number, serial_text,
};
use chalumeau_knob::touch::take::TakeRow;

/// Who carries out the switches, in "... has stood still".
const SWITCHES: &str = "the plugin's thread for the knob's switches";

/// How long the loading of a saved state may take, which sets one value after another: a change of the knob within that time before
/// or after it is part of it.
const LOADING: Duration = Duration::from_millis(300);

/// How often the rows of a take are counted for the user.
const COUNT_EVERY: Duration = Duration::from_secs(1);

/// The state of the controller's thread.
pub struct KnobController {
    params: Arc<ChalumeauParams>,
    shared: Arc<SharedKnob>,
    instrument: Arc<SharedInstrument>,
    main_thread: MainPulseAsker,
    readers: rtrb::Producer<KnobReader>,
    link: Option<(KnobLink, Heartbeat)>,
    choice: KnobChoice,
    /// The knob that was chosen last, whether or not it is still.
    last_choice: Option<KnobChoice>,
    /// How often a saved state has been loaded, and when that was noticed.
    loaded: (u32, Option<Instant>),
    /// When another knob was chosen whose rest is not known.
    another: Option<Instant>,
    /// The serial number that this instance has put into the project for *any knob*.
    remembered: Option<u64>,
    /// Where the link's thread sends rows of takes.
    rows: mpsc::Sender<TakeRow>,
    /// Angles that the link's thread sends.
    angles: (mpsc::Sender<Reading>, mpsc::Receiver<Reading>),
    switches: KnobSwitches,
    calibrator: Calibrator,
    /// What was logged last, and when rows of a take were counted last.
    logged: String,
    counted: Option<Instant>,
}

impl KnobController {
    pub(super) fn new(
        params: Arc<ChalumeauParams>,
        shared: Arc<SharedKnob>,
        instrument: Arc<SharedInstrument>,
        main_thread: MainPulseAsker,
        readers: rtrb::Producer<KnobReader>,
        rows: mpsc::Sender<TakeRow>,
    ) -> Self {
        Self {
            params,
            shared,
            instrument,
            main_thread,
            readers,
            link: None,
            choice: KnobChoice::Off,
            last_choice: None,
            loaded: (0, None),
            another: None,
            remembered: None,
            rows,
            angles: mpsc::channel(),
            switches: KnobSwitches::default(),
            calibrator: Calibrator::new(),
            logged: String::new(),
            counted: None,
        }
    }

    pub(super) fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            if self.shared.is_active.load(Ordering::Relaxed) {
                self.cycle();
            } else {
                KnobSwitches::without_knob(&self.params.moments);
            }
            std::thread::sleep(super::CYCLE);
        }
    }

    fn cycle(&mut self) {
        let params = self.params.clone();
        let knob = &params.knob;
        if params.loads() != self.loaded.0 {
            self.loaded = (params.loads(), Some(Instant::now()));
            self.another = None;
        }
        self.choose_device(knob);
        if self.another.take_if(|chosen| chosen.elapsed() >= LOADING).is_some() {
            self.forget_rest(knob);
        }
        let status = self.link.as_ref().map(|(link, _)| link.status());
        match (&status, &self.link) {
            (Some(status), Some((link, heart))) => {
                heart.beat();
                self.main_thread.cycle(&self.shared.main_pulse, link);
                self.switches.apply(&params.moments, knob, status, link, &mut self.calibrator);
            }
            _ => KnobSwitches::without_knob(&params.moments),
        }
        self.calibrate(knob, status.as_ref());
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
            let heart = link.heartbeat(SWITCHES);
            self.params.moments.set_arm_heart(heart.clone());
            self.link = Some((link, heart));
        }
        if let Some((link, _)) = &self.link {
            link.choose(wanted.clone());
        }
        if wanted != KnobChoice::Off {
            // A saved state has the rest of its own knob.
            let is_loaded = self.loaded.1.is_some_and(|at| at.elapsed() < LOADING);
            if !is_loaded && self.last_choice.as_ref().is_some_and(|last| is_another(last, &wanted)) {
                self.another = Some(Instant::now());
            }
            self.last_choice = Some(wanted.clone());
        }
        self.choice = wanted;
    }

    /// What the link's thread calls: it asks for the feel, and reports each state of the knob.
    fn hooks(&self) -> Hooks {
        let shared = self.shared.clone();
        let feel = move || shared.tested().or_else(|| Some(shared.feel_in_force()?.feel(shared.note())));
        let (shared, rows, angles) = (self.shared.clone(), self.rows.clone(), self.angles.0.clone());
        let instrument = self.instrument.clone();
        let on_state = move |state: &StateSample| {
            let (t_us, angle_deg) = (u64::try_from(state.host_us).unwrap_or(0), f64::from(state.angle_deg));
            let _ = angles.send((t_us, angle_deg));
            let _ = rows.send(TakeRow {
                t_us,
                angle_deg,
                velocity_deg_s: f64::from(state.velocity_deg_s),
                torque_mnm: state.torque_mnm.map(f64::from),
                written: shared
                    .note()
                    .and_then(|note| note.written(instrument.transposition()))
                    .map(|WrittenNote(written)| written),
                gamma: shared.blown().map_or(0.0, |feel| feel.gamma(shared.note(), shared.breath())),
                feel_id: state.feel_id,
                armed: state.armed(),
            });
        };
        Hooks { feel: Box::new(feel), on_state: Box::new(on_state) }
    }

    /// Where the hand rests belongs to the knob at which it was measured.
    fn forget_rest(&self, knob: &KnobParams) {
        if let Ok(mut calibration) = knob.calibration.write()
            && calibration.rest_deg != 0.0
        {
            *calibration = SavedCalibration { rest_deg: 0.0, ..*calibration };
            self.params.host.state_changed();
        }
    }

    fn calibrate(&mut self, knob: &KnobParams, status: Option<&LinkStatus>) {
        let link = self.link.as_ref().map(|(link, _)| link);
        let readings: Vec<Reading> = self.angles.1.try_iter().collect();
        // A calibration also counts the time in which the knob sends nothing.
        let silence = readings.is_empty().then_some(None);
        for reading in readings.into_iter().map(Some).chain(silence) {
            if let Some(text) = self.calibrator.tick(reading, knob, link, status) {
                self.params.host.state_changed();
                self.switches.set_hint(text);
            }
        }
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
    fn report(&mut self, status: Option<&LinkStatus>) {
        let mut words = vec![status.map_or_else(|| "off".to_owned(), |status| status.text.clone())];
        let work = self.shared.work_texts();
        let hint = self.switches.hint().cloned();
        words.extend([hint, work.refused, work.short_breath, work.take].into_iter().flatten());
        if let Some(status) = status {
            let texts = [&status.alarm, &status.restriction, &status.last_refusal, &status.notice];
            words.extend(texts.into_iter().flatten().cloned());
        }
        let news = words.join("; ");
        // Rows come a hundred times a second: they are told once a second, and are nothing for a log.
        if let Some(rows) = work.rows {
            words.insert(1, format!("recording, {rows} rows"));
        }
        let is_new = self.logged != news;
        if !is_new && self.counted.is_some_and(|at| at.elapsed() < COUNT_EVERY) {
            return;
        }
        self.counted = Some(Instant::now());
        if is_new {
            nice_plug::prelude::nice_log!("knob: {news}");
            self.logged = news;
        }
        let text = words.join("; ");
        if let Ok(mut shown) = self.params.knob_status.write()
            && *shown != text
        {
            *shown = text;
            drop(shown);
            self.params.host.text_changed();
        }
    }
}

/// Whether two choices mean different knobs. Which one answers *any* is not known.
fn is_another(last: &KnobChoice, now: &KnobChoice) -> bool {
    match (last, now) {
        (KnobChoice::Serial { serial: Some(last) }, KnobChoice::Serial { serial: Some(now) }) => last != now,
        (KnobChoice::Serial { .. }, KnobChoice::Serial { .. }) => false,
        (KnobChoice::Osc { .. }, KnobChoice::Osc { .. }) => false,
        _ => last != now,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_device_is_known_as_another_one() {
        let serial = |serial| KnobChoice::Serial { serial };
        let osc = |any_address| KnobChoice::Osc { port: 8_000, any_address };
        for (last, now, other) in [
            (serial(Some(1)), serial(Some(2)), true),
            (serial(Some(1)), serial(Some(1)), false),
            (serial(None), serial(Some(1)), false),
            (osc(false), osc(true), false),
            (osc(false), serial(None), true),
            (KnobChoice::Midi { name: None }, osc(false), true),
        ] {
            assert_eq!(is_another(&last, &now), other, "{last:?} {now:?}");
        }
    }
}
