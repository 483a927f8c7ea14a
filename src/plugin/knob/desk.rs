//! The desk: follows the parameters and does for the knob what takes time.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use super::felt::Felt;
use super::{Shared, takes};
use crate::plugin::instrument;
use crate::plugin::params::knob::{Calibration, KnobKind, LawChoice, OrderChoice};
use crate::plugin::params::{ChalumeauParams, KnobParams};
use chalumeau_core::control::knob::{self, KnobDesign, Taken};
use chalumeau_core::haptics::{FeelDesign, Order, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::device::{
    Choice, Hooks, KnobLink, KnobReader, LinkStatus, Phase, StateSample, serial_number, serial_text,
};
use chalumeau_knob::touch::blower::Hand;
use chalumeau_knob::touch::feel::Feels;
use chalumeau_knob::touch::take::{Moment, Take};
use chalumeau_knob::wire::Law;

/// How often the desk looks up.
const TURN: Duration = Duration::from_millis(10);
/// A switch must have been seen off for so long beside a live knob before on means on: what a project or a host sets
/// by itself while it loads is no act of the user.
const ARM_AFTER: Duration = Duration::from_millis(500);
/// Torque of the reference note in a study at most, mNm: with it both sides of every trial are allowed under the first
/// ceiling at the default contrast (a test below).
const STUDY_MNM: f64 = 50.0;

/// Everything the desk thread has.
pub struct Desk {
    params: Arc<ChalumeauParams>,
    shared: Arc<Shared>,
    instruments: Arc<instrument::Shared>,
    felt: Felt,
    readers: rtrb::Producer<KnobReader>,
    hand_in: triple_buffer::Input<Hand>,
    hand: Hand,
    take: triple_buffer::Input<Option<Arc<Take>>>,
    /// What the feel in force was worked out from.
    made_of: Option<(Arc<Feels>, Settings, FeelDesign, TorqueLimits)>,
    refused: Option<String>,
    /// Why the far end of the knob blows no harder, if it does not.
    short_breath: Option<String>,
    link: Option<KnobLink>,
    choice: Choice,
    rows: (mpsc::Sender<Moment>, mpsc::Receiver<Moment>),
    recording: Option<takes::Recording>,
    take_path: String,
    take_trouble: Option<String>,
    note_to_user: Option<String>,
    switches: Switches,
    quiet_since: Option<Instant>,
    was_armed: bool,
    calibration: knob::Calibration,
    began: Instant,
}

/// Switches as they were seen last.
#[derive(Default)]
struct Switches {
    arm: bool,
    take_over: bool,
    rest: bool,
    blow: bool,
    ceiling_mnm: u16,
    feel_port: u16,
}

impl Desk {
    pub(super) fn new(
        params: Arc<ChalumeauParams>,
        shared: Arc<Shared>,
        instruments: Arc<instrument::Shared>,
        readers: rtrb::Producer<KnobReader>,
        hand_in: triple_buffer::Input<Hand>,
        take: triple_buffer::Input<Option<Arc<Take>>>,
    ) -> Self {
        Self {
            params,
            shared,
            instruments,
            felt: Felt::default(),
            readers,
            hand_in,
            hand: Hand::default(),
            take,
            made_of: None,
            refused: None,
            short_breath: None,
            link: None,
            choice: Choice::Off,
            rows: mpsc::channel(),
            recording: None,
            take_path: String::new(),
            take_trouble: None,
            note_to_user: None,
            switches: Switches::default(),
            quiet_since: None,
            was_armed: false,
            calibration: knob::Calibration::default(),
            began: Instant::now(),
        }
    }

    pub(super) fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            if self.shared.plays.load(Ordering::Relaxed) {
                self.turn();
            }
            std::thread::sleep(TURN);
        }
        self.record(false);
    }

    /// Everything once.
    pub(super) fn turn(&mut self) {
        let params = self.params.clone();
        let knob = &params.knob;
        self.choose(knob);
        if self.choice != Choice::Off || knob.replay.value() {
            let status = self.link.as_ref().map(KnobLink::status);
            self.feel(&params, status.as_ref());
        }
        self.replay(knob);
        let status = self.link.as_ref().map(KnobLink::status);
        self.place_hand(knob, status.as_ref().is_none_or(|status| status.tier > 0));
        if let Some(status) = &status {
            self.act(knob, status);
        }
        self.record(knob.record.value() && self.choice != Choice::Off);
        self.say(status.as_ref());
        if let Ok(mut shown) = self.shared.status.lock() {
            *shown = status;
        }
    }

    fn choose(&mut self, knob: &KnobParams) {
        let remembered = knob.serial.read().map_or(None, |text| serial_number(&text));
        let wanted = match knob.kind.value() {
            KnobKind::Off => Choice::Off,
            KnobKind::Serial => Choice::Serial { serial: remembered },
            KnobKind::Midi => {
                let name = knob.midi_port.read().map_or_else(|_| String::new(), |name| name.clone());
                Choice::Midi { name: (!name.is_empty()).then_some(name) }
            }
            KnobKind::Osc => {
                let port = u16::try_from(knob.osc_port.value()).unwrap_or(8_000);
                Choice::Osc { port, any_address: knob.osc_any.value() }
            }
        };
        let is_chosen = self.shared.chosen.swap(false, Ordering::Relaxed);
        // A serial number learnt from the device in hand is no new choice.
        let same = match (&self.choice, &wanted) {
            (Choice::Serial { serial: None }, Choice::Serial { .. }) => !is_chosen,
            (before, after) => before == after,
        };
        if same {
            return;
        }
        if wanted == Choice::Off {
            // Off and on again is how a user asks for another device.
            if let Ok(mut serial) = knob.serial.write() {
                serial.clear();
            }
        }
        if self.link.is_none() {
            let (link, reader) = KnobLink::spawn("Chalumeau", self.hooks());
            // The ring holds one, and only one is ever made.
            let _ = self.readers.push(reader);
            self.link = Some(link);
        }
        if let Some(link) = &self.link {
            link.choose(wanted.clone());
        }
        self.choice = wanted;
    }

    fn hooks(&self) -> Hooks {
        let shared = self.shared.clone();
        let feel = move || {
            if let Some(test) = shared.test.lock().ok().and_then(|test| *test) {
                return Some(test);
            }
            let feel = shared.feel.lock().ok()?.clone()?;
            let (feels, table) = &*feel;
            let index = shared.note().and_then(|note| feels.fingering(note));
            Some(index.and_then(|index| table.note(index)).unwrap_or(table.reference()).feel)
        };
        let (shared, rows) = (self.shared.clone(), self.rows.0.clone());
        let instruments = self.instruments.clone();
        let on_state = move |state: &StateSample| {
            let _ = rows.send(Moment {
                t_us: u64::try_from(state.host_us).unwrap_or(0),
                angle_deg: f64::from(state.angle_deg),
                velocity_deg_s: f64::from(state.velocity_deg_s),
                torque_mnm: f64::from(state.torque_mnm),
                written: shared
                    .note()
                    .and_then(|note| note.written(instruments.transposition()))
                    .map(|WrittenNote(written)| written),
                gamma: f64::from(shared.gamma()),
                feel_id: state.feel_id,
            });
        };
        Hooks { feel: Box::new(feel), on_state: Box::new(on_state) }
    }

    /// Works the feel out anew when something it is made of has changed.
    fn feel(&mut self, params: &ChalumeauParams, status: Option<&LinkStatus>) {
        let settings = params.settings().with_reed_factors(self.shared.reed());
        let design = design(&params.knob);
        let ceiling_mnm = params.knob.ceiling.value().round() as u16;
        let limits = match status.and_then(|status| status.info.as_ref()) {
            Some(info) => info.torque_limits(ceiling_mnm),
            None => TorqueLimits { ceiling_mnm: f64::from(ceiling_mnm), ..TorqueLimits::default() },
        };
        let Some(feels) = self.felt.of(&self.instruments) else { return };
        let same = |(of, ..): &(Arc<Feels>, _, _, _)| Arc::ptr_eq(of, &feels);
        if self
            .made_of
            .as_ref()
            .is_some_and(|made| same(made) && (made.1, made.2, made.3) == (settings, design, limits))
        {
            return;
        }
        self.made_of = Some((feels.clone(), settings, design, limits));
        let (full_kpa, closing_kpa) = (f64::from(settings.breath_full_kpa), 1e-3 * settings.closing_pa());
        // Single precision makes 6 kPa a little less than 6 kPa.
        self.short_breath = (full_kpa < 0.999 * closing_kpa).then(|| {
            format!(
                "this reed shuts at {closing_kpa:.1} kPa: raise Full breath ({full_kpa:.1} kPa) to reach it"
            )
        });
        match feels.table(&settings, &design, &limits) {
            Ok(table) => {
                self.hand.maps = feels.maps(&table);
                self.hand_in.write(self.hand);
                if let Ok(mut feel) = self.shared.feel.lock() {
                    *feel = Some(Arc::new((feels, table)));
                }
                self.refused = None;
            }
            // The feel before stays, and so does what its angles blow.
            Err(reason) => self.refused = Some(format!("feel unchanged: {reason}")),
        }
    }

    fn place_hand(&mut self, knob: &KnobParams, feels: bool) {
        let design = calibrated(knob);
        if (self.hand.design, self.hand.feels) != (design, feels) {
            (self.hand.design, self.hand.feels) = (design, feels);
            self.hand_in.write(self.hand);
        }
    }

    fn replay(&mut self, knob: &KnobParams) {
        let path = match knob.take.read() {
            Ok(path) if knob.replay.value() => path.clone(),
            _ => String::new(),
        };
        if path == self.take_path {
            return;
        }
        self.take_path.clone_from(&path);
        self.take_trouble = None;
        let take = (!path.is_empty()).then(|| takes::load(&path)).transpose();
        match take {
            Ok(take) => self.take.write(take),
            Err(reason) => {
                self.take_trouble = Some(reason);
                self.take.write(None);
            }
        }
    }

    /// Switches that act when they are switched on.
    fn act(&mut self, knob: &KnobParams, status: &LinkStatus) {
        let Some(link) = &self.link else { return };
        let now = Switches {
            arm: knob.arm.value(),
            take_over: knob.take_over.value(),
            rest: knob.rest.value(),
            blow: knob.blow.value(),
            ceiling_mnm: knob.ceiling.value().round() as u16,
            feel_port: u16::try_from(knob.feel_port.value()).unwrap_or(0),
        };
        let before = &self.switches;
        if !is_live(status) {
            self.quiet_since = None;
        } else if !now.arm {
            self.quiet_since.get_or_insert_with(Instant::now);
        }
        if now.arm && !before.arm {
            if self.quiet_since.is_some_and(|since| since.elapsed() >= ARM_AFTER) {
                link.arm(now.ceiling_mnm);
                self.note_to_user = None;
            } else {
                self.note_to_user =
                    Some("not armed: switch Arm off, wait for the knob, and on again".to_owned());
            }
            self.quiet_since = None;
        } else if !now.arm && before.arm {
            link.disarm();
            self.note_to_user = None;
        } else if status.armed && now.ceiling_mnm < before.ceiling_mnm {
            link.lower_ceiling(now.ceiling_mnm);
        } else if status.armed && now.ceiling_mnm > before.ceiling_mnm {
            self.note_to_user = Some("more torque: switch Arm off and on again".to_owned());
        }
        if now.feel_port != before.feel_port {
            let port = now.feel_port;
            link.feel_osc((port > 0).then(|| SocketAddr::from((Ipv4Addr::LOCALHOST, port))));
        }
        if self.was_armed && !status.armed && now.arm {
            self.note_to_user = Some("disarmed: switch Arm off and on again".to_owned());
        }
        self.was_armed = status.armed;
        if now.take_over && !before.take_over {
            link.take_over();
        }
        if now.rest && !before.rest {
            if status.armed {
                self.note_to_user = Some("Rest here: switch Arm off first".to_owned());
            } else {
                self.calibration.rest();
            }
        }
        if now.blow && !before.blow {
            self.calibration.blow(&calibrated(knob));
        }
        self.switches = now;
    }

    /// One reading for a calibration that is under way.
    fn calibrate(&mut self, angle_deg: Option<f64>) {
        let t_s = self.began.elapsed().as_secs_f64();
        let knob = &self.params.knob;
        match self.calibration.tick(t_s, angle_deg) {
            None => {}
            Some(Err(reason)) => self.note_to_user = Some(reason.to_string()),
            Some(Ok(taken)) => {
                let mut design = taken.applied_to(calibrated(knob));
                if let (Taken::Rest { .. }, Some(link), true) = (taken, &self.link, self.hand.feels) {
                    // The law's angles are counted from the knob's own zero.
                    link.zero();
                    (design.zero_deg, design.full_deg) = (0.0, design.full_deg - design.zero_deg);
                }
                if let Ok(mut calibration) = knob.calibration.write() {
                    *calibration = Calibration::of(&design);
                }
                let Calibration { travel_deg, dead_deg, .. } = Calibration::of(&design);
                self.note_to_user = Some(match taken {
                    Taken::Rest { .. } => {
                        format!("at rest; breath begins {:.1} degrees from here", dead_deg.0)
                    }
                    Taken::Blow { .. } => format!("full blow is {travel_deg:.0} degrees from rest"),
                });
            }
        }
    }

    fn record(&mut self, wanted: bool) {
        if wanted && self.recording.is_none() {
            self.recording = match takes::begin(&self.params) {
                Ok(recording) => Some(recording),
                Err(reason) => {
                    self.take_trouble = Some(reason);
                    return;
                }
            };
        }
        let mut marks =
            takes::marks(&self.params, &self.params.settings().with_reed_factors(self.shared.reed()));
        if self.refused.is_some() {
            // The hand did not follow the sound: such rows are no part of a study.
            marks.study = None;
        }
        let mut heard = false;
        while let Ok(moment) = self.rows.1.try_recv() {
            heard = true;
            self.calibrate(Some(moment.angle_deg));
            let Some(recording) = &mut self.recording else { continue };
            match recording.writer.write(&moment, &marks) {
                Ok(()) => recording.rows += 1,
                Err(reason) => recording.trouble = Some(reason.to_string()),
            }
        }
        if !heard {
            self.calibrate(None);
        }
        if !wanted && let Some(takes::Recording { writer, path, rows, trouble }) = self.recording.take() {
            self.take_trouble = match (rows, trouble, writer) {
                (0, ..) => Some("nothing recorded: the knob sent nothing".to_owned()),
                (_, Some(reason), _) => Some(format!("take lost: {reason}")),
                (_, None, writer) => match writer.keep() {
                    Ok(()) => {
                        if let Ok(mut take) = self.params.knob.take.write() {
                            *take = path.display().to_string();
                        }
                        Some(format!("take {} has {rows} rows", path.display()))
                    }
                    Err(reason) => Some(format!("take lost: {reason}")),
                },
            };
        }
    }

    fn say(&self, status: Option<&LinkStatus>) {
        let knob = &self.params.knob;
        if let Some(status) = status
            && is_live(status)
            && let (Choice::Serial { .. }, Some(serial)) = (&self.choice, status.serial)
            && let Ok(mut remembered) = knob.serial.write()
        {
            *remembered = serial_text(serial);
        }
        let mut words = vec![status.map_or_else(|| "off".to_owned(), |status| status.text.clone())];
        if let Some(recording) = &self.recording {
            words.push(format!("recording, {} rows", recording.rows));
        }
        words.extend(
            [&self.note_to_user, &self.refused, &self.short_breath, &self.take_trouble]
                .into_iter()
                .flatten()
                .cloned(),
        );
        if let Some(status) = status {
            words.extend([&status.last_refusal, &status.notice].into_iter().flatten().cloned());
        }
        let text = words.join("; ");
        if let Ok(mut said) = self.params.knob_status.write()
            && *said != text
        {
            nice_plug::prelude::nice_log!("knob: {text}");
            *said = text;
        }
    }
}

/// The feel the parameters describe.
pub fn design(knob: &KnobParams) -> FeelDesign {
    let calibration = knob.calibration.read().map_or_else(|_| Calibration::default(), |c| c.mended());
    FeelDesign {
        law: match knob.law.value() {
            LawChoice::Flow => Law::Flow,
            LawChoice::Pressure => Law::Pressure,
            LawChoice::Free => Law::Free,
        },
        reference: u8::try_from(knob.reference.value()).ok().map(WrittenNote),
        contrast: f64::from(knob.contrast.value()),
        order: match knob.order.value() {
            OrderChoice::Physical => Order::Physical,
            OrderChoice::CoveredHoles => Order::CoveredHoles,
            OrderChoice::OpenHoles => Order::CoveredHolesReversed,
        },
        strength_mnm: match knob.study() {
            Some(_) => f64::from(knob.torque.value()).min(STUDY_MNM),
            None => f64::from(knob.torque.value()),
        },
        travel_deg: calibration.travel_deg,
        damping_mnms: f64::from(knob.damping.value()),
        friction_mnm: f64::from(knob.friction.value()),
        detent_mnm: (knob.law.value() == LawChoice::Pressure).then(|| f64::from(knob.detent.value())),
        ..FeelDesign::default()
    }
}

fn is_live(status: &LinkStatus) -> bool {
    matches!(status.phase, Phase::Live | Phase::ReadOnly)
}

/// Rest, full blow, dead zone and curve as the parameters have them.
pub fn calibrated(knob: &KnobParams) -> KnobDesign {
    let calibration = knob.calibration.read().map_or_else(|_| Calibration::default(), |c| *c);
    calibration.design(f64::from(knob.curve.value()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_knob::touch::study::{Condition, TRIALS, plan};

    #[test]
    fn both_sides_of_every_trial_can_be_felt_under_the_first_ceiling() {
        let feels = Feels::built_in().unwrap();
        for trial in plan(1, 1).iter().chain(&plan(2, 1)) {
            for condition in [Condition::Coupled, Condition::Free] {
                let settings = Settings {
                    reed_h: trial.h as f32,
                    reed_k: condition.k(trial.h) as f32,
                    coupled: false,
                    ..Settings::default()
                };
                let design = FeelDesign { strength_mnm: STUDY_MNM, ..FeelDesign::default() };
                let refused = feels.table(&settings, &design, &TorqueLimits::default()).err();
                assert_eq!(refused, None, "H {} {}", trial.h, condition.name());
            }
        }
        assert_eq!(plan(1, 1).len(), TRIALS);
    }
}
