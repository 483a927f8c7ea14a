//! Makes snapshots while the window is open.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use super::Shared;
use super::audio::Inside;
#[cfg(feature = "devices")]
use super::devices;
#[cfg(feature = "devices")]
use crate::editor::Tab;
use crate::editor::listener::{Heard, Listener, WINDOW};
#[cfg(feature = "devices")]
use crate::editor::snapshot::{Device, Knob};
use crate::editor::snapshot::{Level, Scope, Snapshot, Source, Status, Track};
use crate::plugin::Beside;
use crate::plugin::breaths::{Breaths, Way};
use crate::plugin::instrument::{Placed, Stage};
#[cfg(feature = "devices")]
use crate::plugin::knob;
use crate::plugin::params::instrument::InstrumentChoice;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::haptics::{FeelDesign, FeelTable, Requirement, TorqueLimits};
use chalumeau_core::instrument::{Model, Settings, felt};
use chalumeau_core::units::SoundingNote;
#[cfg(feature = "devices")]
use chalumeau_knob::device::Places;
use chalumeau_knob::touch::feel::Feels;

/// From one look to the next while something moves, and while nothing does: less than five a second.
const QUICK: Duration = Duration::from_millis(33);
const IDLE: Duration = Duration::from_millis(220);
/// Between two looks for devices.
#[cfg(feature = "devices")]
const DEVICES_EVERY: Duration = Duration::from_secs(2);
/// Length of the breath's history, s, and of its steps.
const HISTORY_S: f32 = 10.0;
const STEP_S: f32 = 0.05;
/// Mouth pressure that counts as none, kPa.
const NO_BREATH_KPA: f32 = 1e-3;

/// Everything the thread has.
pub struct Looker {
    shared: Arc<Shared>,
    beside: Beside,
    inside: triple_buffer::Output<Inside>,
    sound: rtrb::Consumer<f32>,
    heard: VecDeque<f32>,
    listener: Option<(f64, Listener)>,
    /// What is shown of what is not known; to make one takes an instrument file to be read.
    blank: Snapshot,
    history: VecDeque<f32>,
    stepped: Instant,
    known: Option<Known>,
    #[cfg(feature = "devices")]
    devices: (Vec<Device>, Option<Instant>),
    #[cfg(feature = "devices")]
    has_midi: bool,
}

/// What an instrument is asked once.
struct Known {
    model: Arc<Model>,
    file: Arc<InstrumentFile>,
    feels: Arc<Feels>,
    bore: TransferMatrix,
    /// With what it was worked out from.
    table: Option<(Settings, FeelDesign, Result<FeelTable, String>)>,
    standing: Option<Standing>,
}

/// A standing wave, and what it was worked out from.
struct Standing {
    fingering: usize,
    open: Vec<bool>,
    /// Place, m from the reed, and magnitude over that at the reed.
    wave: Vec<(f32, f32)>,
}

impl Looker {
    pub(super) fn new(
        shared: Arc<Shared>,
        beside: Beside,
        inside: triple_buffer::Output<Inside>,
        sound: rtrb::Consumer<f32>,
    ) -> Self {
        Self {
            shared,
            beside,
            inside,
            sound,
            heard: VecDeque::with_capacity(2 * WINDOW),
            listener: None,
            blank: Snapshot::default(),
            history: VecDeque::new(),
            stepped: Instant::now(),
            known: None,
            #[cfg(feature = "devices")]
            devices: (Vec::new(), None),
            #[cfg(feature = "devices")]
            has_midi: true,
        }
    }

    pub(super) fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            let began = Instant::now();
            let every = if self.shared.is_open.load(Ordering::Relaxed) { self.look() } else { IDLE };
            std::thread::park_timeout(every.saturating_sub(began.elapsed()));
        }
    }

    /// One snapshot; how long from its beginning to the next.
    fn look(&mut self) -> Duration {
        let inside = self.inside.read().clone();
        self.listen();
        let settings = self.beside.params.settings();
        let moving = inside.now.mouth_kpa > NO_BREATH_KPA || inside.now.sounding.is_some();
        self.remember(inside.now.mouth_kpa);
        let placed = self.beside.instruments.placed();
        self.know(placed.as_ref());
        let tried = self.shared.tried();
        let mut snapshot = Snapshot { settings, ..self.blank.clone() };
        snapshot.instruments = InstrumentChoice::ALL.iter().map(|choice| choice.title().to_owned()).collect();
        snapshot.chosen = Some(self.beside.params.instrument.choice.value() as usize);
        snapshot.sounding = inside.now.sounding;
        snapshot.mouth_kpa = inside.now.mouth_kpa;
        snapshot.sources = sources(&inside.breaths, inside.now.sounding.is_some());
        snapshot.latency_ms = (1e3 * f64::from(inside.latency_samples) / inside.host_rate_hz) as f32;
        snapshot.history = Track { step_s: STEP_S, kpa: self.history.iter().copied().collect() };
        snapshot.scope = Scope {
            rate_hz: inside.moments_hz as f32,
            mouthpiece_kpa: inside.moments.iter().map(|moment| moment.mouthpiece_kpa).collect(),
            opening: inside.moments.iter().map(|moment| moment.opening).collect(),
            flow_cm3s: inside.moments.iter().map(|moment| moment.flow_cm3s).collect(),
        };
        let design = self.design();
        if let Some(known) = &mut self.known {
            let file = known.file.clone();
            let fingering = inside.now.fingering.min(file.fingerings.len().saturating_sub(1));
            let open = tried
                .filter(|open| open.len() == file.holes.len())
                .unwrap_or_else(|| file.fingerings[fingering].open.clone());
            snapshot.fingering = fingering;
            snapshot.openings = open.iter().map(|&open| f32::from(u8::from(open))).collect();
            snapshot.requirement = known.requirement(fingering, &settings);
            snapshot.feel = known.feel(fingering, &settings, &design);
            snapshot.standing = known.standing(fingering, &open);
            snapshot.instrument = file;
        }
        snapshot.heard = self.hear(inside.host_rate_hz, inside.now.sounding, &settings);
        #[cfg(feature = "devices")]
        {
            let status = self.beside.knob.status();
            self.list(status.as_ref());
            snapshot.knob = status.map_or_else(Knob::default, |status| {
                let feel = snapshot.feel.as_ref().ok().map(|note| note.feel);
                knob_picture(&status, feel.as_ref())
            });
            snapshot.knob.devices = self.devices.0.clone();
        }
        snapshot.status = self.words(placed.as_ref(), &inside.breaths);
        *self.shared.latest.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(snapshot);
        self.shared.draw_again();
        if moving { QUICK } else { IDLE }
    }

    /// Looks for devices now and then while the list is in view.
    #[cfg(feature = "devices")]
    fn list(&mut self, status: Option<&chalumeau_knob::device::LinkStatus>) {
        let is_due = self.devices.1.is_none_or(|at| at.elapsed() > DEVICES_EVERY);
        if super::kept(&self.beside.params).tab == Tab::Knob && is_due {
            let kind = self.beside.params.knob.kind.value();
            let found = devices::list(&Places::default(), kind, status, &mut self.has_midi);
            self.devices = (found, Some(Instant::now()));
        }
    }

    fn listen(&mut self) {
        while let Ok(sample) = self.sound.pop() {
            if self.heard.len() == WINDOW {
                self.heard.pop_front();
            }
            self.heard.push_back(sample);
        }
    }

    fn remember(&mut self, kpa: f32) {
        let step = Duration::from_secs_f32(STEP_S);
        // After a pause the history begins anew rather than lie about time.
        if self.stepped.elapsed() > Duration::from_secs(2) {
            (self.stepped, self.history) = (Instant::now(), VecDeque::new());
        }
        while self.stepped.elapsed() >= step {
            self.stepped += step;
            self.history.push_back(kpa);
            if self.history.len() as f32 * STEP_S > HISTORY_S {
                self.history.pop_front();
            }
        }
    }

    /// Asks an instrument that is new. Takes a second, in which the window shows what was.
    fn know(&mut self, placed: Option<&Placed>) {
        let Some(placed) = placed else { return };
        if placed.stage == Stage::Rough
            || self.known.as_ref().is_some_and(|known| Arc::ptr_eq(&known.model, &placed.model))
        {
            return;
        }
        self.known = Some(Known {
            feels: Arc::new(Feels::new(&placed.model)),
            bore: TransferMatrix::new(&placed.model.file, placed.model.air),
            file: Arc::new(placed.model.file.clone()),
            model: placed.model.clone(),
            table: None,
            standing: None,
        });
    }

    fn design(&self) -> FeelDesign {
        #[cfg(feature = "devices")]
        return knob::design(&self.beside.params.knob);
        #[cfg(not(feature = "devices"))]
        FeelDesign::default()
    }

    fn hear(&mut self, rate_hz: f64, sounding: Option<SoundingNote>, settings: &Settings) -> Heard {
        if self.listener.as_ref().is_none_or(|(of, _)| *of != rate_hz) {
            self.listener = Some((rate_hz, Listener::new(rate_hz)));
        }
        let wanted = sounding.map(|note| note.frequency_hz(f64::from(settings.a4_hz)));
        let samples = self.heard.make_contiguous();
        self.listener.as_mut().map_or_else(Heard::default, |(_, listener)| listener.hear(samples, wanted))
    }

    fn words(&self, placed: Option<&Placed>, breaths: &Breaths) -> Vec<Status> {
        let mut status = Vec::new();
        let mut say = |level, text: String| status.push(Status { level, text });
        if let Ok(text) = self.beside.params.instrument_status.read()
            && placed.is_none_or(|placed| placed.stage < Stage::Tuned)
        {
            say(Level::Note, text.clone());
        }
        if let Ok(text) = self.beside.params.knob_status.read()
            && text.as_str() != "off"
        {
            say(Level::Good, text.clone());
        }
        // Whoever has just plugged in a breath controller sees that it arrives.
        if let Some(way) = Way::ALL.into_iter().find(|&way| way != Way::Keys && breaths.is_live(way)) {
            say(Level::Good, format!("breath: {}", way.title()));
        }
        status
    }
}

impl Known {
    fn requirement(&self, fingering: usize, settings: &Settings) -> Option<Requirement> {
        let reed = felt::played_reed(&self.model.file, settings);
        self.feels.requirements().note(fingering, &reed)
    }

    fn feel(
        &mut self,
        fingering: usize,
        settings: &Settings,
        design: &FeelDesign,
    ) -> Result<chalumeau_core::haptics::NoteFeel, String> {
        let same = self.table.as_ref().is_some_and(|(of, by, _)| (of, by) == (settings, design));
        if !same {
            let table = self.feels.table(settings, design, &TorqueLimits::default());
            self.table = Some((*settings, *design, table.map_err(|reason| reason.to_string())));
        }
        match self.table.as_ref().map(|(.., table)| table) {
            Some(Ok(table)) => Ok(*table.note(fingering).unwrap_or(table.reference())),
            Some(Err(reason)) => Err(reason.clone()),
            None => Err("not known yet".to_owned()),
        }
    }

    fn standing(&mut self, fingering: usize, open: &[bool]) -> Vec<(f32, f32)> {
        let same =
            self.standing.as_ref().is_some_and(|known| known.fingering == fingering && known.open == open);
        if !same {
            let f_hz = self.model.notes_hz[fingering];
            let wave = self.bore.standing_pressure(f_hz, open);
            let wave = wave.into_iter().map(|(x, p)| (x as f32, p as f32)).collect();
            self.standing = Some(Standing { fingering, open: open.to_vec(), wave });
        }
        self.standing.as_ref().map_or_else(Vec::new, |known| known.wave.clone())
    }
}

/// Where breath has come from, as the window shows it.
fn sources(breaths: &Breaths, held: bool) -> Vec<Source> {
    let source = |way: Way| {
        let said = breaths.said(way);
        // Velocity blows while a key is held.
        let value = said.filter(|_| way != Way::Keys || held).unwrap_or(0.0);
        Source { name: way.title().to_owned(), value, is_live: breaths.is_live(way), is_seen: said.is_some() }
    };
    Way::ALL.map(source).into()
}

/// The knob as the window shows it, without the list.
#[cfg(feature = "devices")]
fn knob_picture(
    status: &chalumeau_knob::device::LinkStatus,
    feel: Option<&chalumeau_knob::wire::message::Feel>,
) -> Knob {
    let stats = &status.stats;
    Knob {
        devices: Vec::new(),
        text: status.text.clone(),
        is_live: status.phase == chalumeau_knob::device::Phase::Live,
        is_armed: status.armed,
        ceiling_mnm: f32::from(status.ceiling_mnm),
        angle_deg: status.angle_deg,
        torque_mnm: status.angle_deg.zip(feel).map(|(angle_deg, feel)| {
            let tables = chalumeau_core::reed::ReedTables::seed();
            let torque_mnm = chalumeau_core::haptics::law::torque_mnm(feel, tables, f64::from(angle_deg));
            if status.armed { torque_mnm as f32 } else { 0.0 }
        }),
        notice: status.last_refusal.clone().or_else(|| status.notice.clone()),
        rate_hz: stats.rate_hz,
        jitter_us: (stats.jitter_p50_us, stats.jitter_p99_us),
        round_trip_us: stats.feel_round_trip_us,
        lost: stats.wire.lost,
        damaged: stats.wire.crc_errors + stats.wire.length_errors,
        losses: stats.losses,
    }
}
