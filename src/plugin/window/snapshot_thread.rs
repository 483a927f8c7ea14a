//! The snapshot thread: collects what the window shows while it is open.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::SharedWindow;
use super::breath_history::BreathHistory;
#[cfg(feature = "devices")]
use super::device_list;
use super::file_tasks::FilesRead;
use super::fingering_searcher::FingeringSearcher;
use super::instrument_analysis::{DrawnInstrument, InstrumentAnalysis};
use super::window_audio::AudioSnapshot;
use crate::controllers::breath_input::BreathInput;
#[cfg(feature = "devices")]
use crate::editor::Tab;
use crate::editor::fingering_search::FingeringSearch;
use crate::editor::snapshot::{BreathSource, MouthpieceTraces, Severity, Snapshot, Status};
#[cfg(feature = "devices")]
use crate::editor::snapshot::{KnobDevice, KnobState};
use crate::editor::sound_analysis::{FLOOR_DB, SoundAnalysis, WINDOW};
use crate::plugin::SharedHandles;
use crate::plugin::breath_sources::BreathSources;
use crate::plugin::instrument_loading::{CurrentInstrument, Readiness};
#[cfg(feature = "devices")]
use crate::plugin::knob;
use crate::plugin::launch_options::LaunchOptions;
use crate::plugin::params::instrument::InstrumentChoice;
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::instrument::{KeyPitches, Settings};
use chalumeau_core::units::Air;
#[cfg(feature = "devices")]
use chalumeau_knob::device::{LinkStatus, Phase, RuntimeDir};

/// Time from one snapshot to the next while something moves.
const MOVING: Duration = Duration::from_millis(33);
/// The same while nothing moves: less than five snapshots a second.
const IDLE: Duration = Duration::from_millis(220);
/// Time between two searches for devices.
#[cfg(feature = "devices")]
const DEVICES_EVERY: Duration = Duration::from_secs(2);
/// Length of sound whose level is shown, s: some periods of the lowest note.
const LEVEL_S: f64 = 0.05;
/// Time for which a message lights the lamp.
const MIDI_LIT: Duration = Duration::from_millis(150);
/// While the mouth pressure is above this, meters may move, kPa.
const STILL_KPA: f32 = 1e-3;

/// The state of the thread.
pub struct SnapshotThread {
    shared: Arc<SharedWindow>,
    handles: SharedHandles,
    inside: triple_buffer::Output<AudioSnapshot>,
    sound: rtrb::Consumer<f32>,
    heard: VecDeque<f32>,
    /// The values that a snapshot shows where nothing is known. Kept, because making them parses an instrument file.
    blank: Snapshot,
    history: BreathHistory,
    /// How many messages had arrived, and when there was a new one.
    midi: (u32, Option<Instant>),
    files: FilesRead,
    fingerings: FingeringSearcher,
    /// What is drawn before the first analysis.
    first: Option<DrawnInstrument>,
    analysis: Option<InstrumentAnalysis>,
    /// A thread that analyses a new instrument meanwhile.
    analysing: Option<JoinHandle<InstrumentAnalysis>>,
    /// The devices found, and when.
    #[cfg(feature = "devices")]
    devices: (Vec<KnobDevice>, Option<Instant>),
    #[cfg(feature = "devices")]
    has_midi: bool,
}

impl SnapshotThread {
    pub(super) fn new(
        shared: Arc<SharedWindow>,
        handles: SharedHandles,
        inside: triple_buffer::Output<AudioSnapshot>,
        sound: rtrb::Consumer<f32>,
    ) -> Self {
        Self {
            shared,
            handles,
            inside,
            sound,
            heard: VecDeque::with_capacity(2 * WINDOW),
            blank: Snapshot::default(),
            history: BreathHistory::new(),
            midi: (0, None),
            files: FilesRead::default(),
            fingerings: FingeringSearcher::default(),
            first: None,
            analysis: None,
            analysing: None,
            #[cfg(feature = "devices")]
            devices: (Vec::new(), None),
            #[cfg(feature = "devices")]
            has_midi: true,
        }
    }

    pub(super) fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            let began = Instant::now();
            self.act_on_files();
            let every = if self.shared.is_open.load(Ordering::Relaxed) { self.publish() } else { IDLE };
            std::thread::park_timeout(every.saturating_sub(began.elapsed()));
        }
        // What was asked for just before the end.
        self.act_on_files();
        // No thread may outlive the plugin's library.
        if let Some(analysing) = self.analysing.take() {
            let _ = analysing.join();
        }
    }

    /// Does what the window asks of files, also when it has closed since.
    fn act_on_files(&mut self) {
        for task in self.shared.take_file_tasks() {
            self.files.act(task, &self.handles.params);
        }
    }

    /// Makes one snapshot and asks the window to draw it. Returns the time from its beginning to the next one's.
    fn publish(&mut self) -> Duration {
        let inside = self.inside.read().clone();
        let current = self.handles.instrument.current();
        self.receive_sound();
        self.analyse(current.as_ref());
        let settings = self.handles.params.settings();
        let mut snapshot = Snapshot { settings, ..self.blank.clone() };
        snapshot.instruments = InstrumentChoice::ALL.iter().map(|choice| choice.title().to_owned()).collect();
        snapshot.key_pitches =
            current.as_ref().map_or_else(KeyPitches::default, |current| current.model.keys.clone());
        snapshot.silent = current.as_ref().map_or_else(Vec::new, |current| current.model.silent_notes());
        snapshot.chosen = Some(self.handles.params.instrument.choice.value() as usize);
        self.files.show(&mut snapshot);
        show_inside(&mut snapshot, &inside);
        self.show_instrument(&mut snapshot, current.as_ref(), inside.now.fingering);
        snapshot.heard = self.analyse_sound(&inside, &settings);
        snapshot.output_peak = f32::from_bits(self.shared.output_peak.swap(0, Ordering::Relaxed));
        snapshot.microphone = self.shared.microphone.load();
        snapshot.hears_midi = self.hears_midi(inside.breath_sources.messages());
        let level_db = self.level_db(inside.host_rate_hz);
        self.history.extend(inside.now.mouth_kpa, snapshot.marks(), level_db, snapshot.heard.f0_hz);
        snapshot.history = self.history.track();
        #[cfg(feature = "devices")]
        self.show_knob(&mut snapshot);
        let is_looking = matches!(snapshot.fingerings, FingeringSearch::Looking(_));
        snapshot.status = self.status(current.as_ref(), &inside);
        snapshot.connections = LaunchOptions::connections();
        if let Some(problem) = snapshot.connections.as_ref().and_then(|now| now.problem.clone()) {
            // After what concerns the knob's safety.
            let place = snapshot.status.iter().position(|one| one.level != Severity::Warn);
            let place = place.unwrap_or(snapshot.status.len());
            snapshot.status.insert(place, Status { level: Severity::Warn, text: problem });
        }
        *self.shared.latest.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(snapshot);
        self.shared.draw_again();
        let is_moving = is_looking
            || inside.now.mouth_kpa > STILL_KPA
            || inside.now.sounding.is_some()
            || self.midi.1.is_some_and(|at| at.elapsed() < MIDI_LIT);
        if is_moving { MOVING } else { IDLE }
    }

    /// Fills in the fingering, and what the analysis says of it.
    fn show_instrument(
        &mut self,
        snapshot: &mut Snapshot,
        current: Option<&CurrentInstrument>,
        fingering: usize,
    ) {
        let design = self.feel_design();
        // That of an instrument before its holes were moved serves until the new one is there; that of another instrument does not.
        let is_of_current =
            |drawn: &DrawnInstrument| current.is_none_or(|current| drawn.key == current.request.key);
        let analysed = self.analysis.as_ref().map(|analysis| analysis.drawn().clone()).filter(is_of_current);
        let is_analysed = analysed.is_some();
        let Some(DrawnInstrument { file, as_built, key, .. }) =
            analysed.or_else(|| self.drawn_at_first(current))
        else {
            return;
        };
        (snapshot.as_built, snapshot.instrument_key) = (as_built, key);
        if let Ok(path) = self.handles.params.instrument.file.read() {
            snapshot.instrument_file.clone_from(&path);
        }
        let fingering = fingering.min(file.fingerings.len().saturating_sub(1));
        let open = self
            .shared
            .tried()
            .filter(|open| open.len() == file.holes.len())
            .unwrap_or_else(|| file.fingerings[fingering].open.clone());
        snapshot.fingering = fingering;
        let (air, a4_hz) =
            current.map_or((Air::default(), A4_HZ), |current| (current.model.air, current.model.a4_hz));
        snapshot.fingerings = self.fingerings.look(self.shared.fingerings_for(), &file, air, a4_hz);
        snapshot.openings = open.iter().map(|&open| f32::from(u8::from(open))).collect();
        snapshot.instrument = file;
        let Some(analysis) = self.analysis.as_mut().filter(|_| is_analysed) else { return };
        snapshot.requirement = analysis.requirement(fingering, &snapshot.played());
        snapshot.feel = analysis.feel(fingering, &snapshot.settings, &design);
        snapshot.standing = analysis.standing_wave(fingering, &open);
    }

    /// The instrument that sounds while there is no analysis of it yet: an instrument of the user's own is fitted first, which takes up
    /// to a minute.
    fn drawn_at_first(&mut self, current: Option<&CurrentInstrument>) -> Option<DrawnInstrument> {
        let current = current?;
        let known = self.first.take().filter(|first| first.is_of(current));
        self.first = Some(known.unwrap_or_else(|| DrawnInstrument::new(current)));
        self.first.clone()
    }

    /// Fills in the knob and the list of devices.
    #[cfg(feature = "devices")]
    fn show_knob(&mut self, snapshot: &mut Snapshot) {
        let status = self.handles.knob.status();
        self.find_devices(status.as_ref());
        snapshot.knob = status.map_or_else(KnobState::default, |status| knob_view(&status));
        snapshot.knob.devices = self.devices.0.clone();
    }

    /// Searches for devices from time to time while the list is in view.
    #[cfg(feature = "devices")]
    fn find_devices(&mut self, status: Option<&LinkStatus>) {
        let is_due = self.devices.1.is_none_or(|at| at.elapsed() > DEVICES_EVERY);
        if super::kept(&self.handles.params).tab == Tab::Knob && is_due {
            let kind = self.handles.params.knob.kind.value();
            let found = device_list::list(&RuntimeDir::default(), kind, status, &mut self.has_midi);
            self.devices = (found, Some(Instant::now()));
        }
    }

    /// Whether messages have arrived just now, of which there have been so many.
    fn hears_midi(&mut self, messages: u32) -> bool {
        if std::mem::replace(&mut self.midi.0, messages) != messages {
            self.midi.1 = Some(Instant::now());
        }
        self.midi.1.is_some_and(|at| at.elapsed() < MIDI_LIT)
    }

    fn receive_sound(&mut self) {
        while let Ok(sample) = self.sound.pop() {
            if self.heard.len() == WINDOW {
                self.heard.pop_front();
            }
            self.heard.push_back(sample);
        }
    }

    /// Analyses a new instrument (about 1 s) on a thread of its own: a window that has just been opened shows from its first
    /// moment what is played.
    fn analyse(&mut self, current: Option<&CurrentInstrument>) {
        if let Some(done) = self.analysing.take_if(|analysing| analysing.is_finished()) {
            self.analysis = done.join().ok().or_else(|| self.analysis.take());
        }
        let Some(current) = current else { return };
        let known = self.analysis.as_mut().filter(|analysis| analysis.is_of(current));
        let is_known = known.is_some();
        if let Some(known) = known {
            known.follow(current);
        }
        if current.readiness > Readiness::Rough && !is_known && self.analysing.is_none() {
            let current = current.clone();
            let analysing = std::thread::Builder::new().name("InstrumentAnalysis".to_owned());
            self.analysing = analysing.spawn(move || InstrumentAnalysis::new(&current)).ok();
        }
    }

    fn feel_design(&self) -> FeelDesign {
        #[cfg(feature = "devices")]
        return knob::feel_design(&self.handles.params.knob);
        #[cfg(not(feature = "devices"))]
        FeelDesign::default()
    }

    /// Level of the latest sound, dB over full scale, root mean square.
    fn level_db(&mut self, rate_hz: f64) -> f32 {
        let count = ((LEVEL_S * rate_hz) as usize).clamp(1, WINDOW);
        let latest = self.heard.iter().rev().take(count);
        let power: f32 = latest.map(|sample| sample * sample).filter(|power| power.is_finite()).sum();
        (10.0 * (power / count as f32).max(1e-12).log10()).max(FLOOR_DB)
    }

    fn analyse_sound(&mut self, inside: &AudioSnapshot, settings: &Settings) -> SoundAnalysis {
        let wanted = inside.now.sounding.map(|note| note.frequency_hz(f64::from(settings.a4_hz)));
        let sound = self.heard.make_contiguous();
        match wanted {
            Some(wanted_hz) if inside.is_chord => {
                SoundAnalysis::of_chord(sound, inside.host_rate_hz, wanted_hz)
            }
            // The first player rests; the others are not shown.
            None if inside.is_chord => SoundAnalysis::without_pitch(sound, inside.host_rate_hz),
            wanted => SoundAnalysis::of(sound, inside.host_rate_hz, wanted),
        }
    }

    /// How much the knob's status concerns the user: an alarm, or a port that does not open, asks for something.
    fn knob_severity(&self) -> Severity {
        #[cfg(feature = "devices")]
        if let Some(status) = self.handles.knob.status() {
            let is_shut_out = matches!(status.phase, Phase::NoPermission(_) | Phase::Busy(_));
            return match status.phase {
                _ if is_shut_out || status.alarm.is_some() => Severity::Warn,
                Phase::Live | Phase::ReadOnly => Severity::Good,
                _ => Severity::Note,
            };
        }
        Severity::Good
    }

    /// The messages on the status line.
    fn status(&self, current: Option<&CurrentInstrument>, inside: &AudioSnapshot) -> Vec<Status> {
        let mut status = Vec::new();
        let mut add = |level, text: String| status.push(Status { level, text });
        if let Ok(text) = self.handles.params.instrument_status.read() {
            if self.handles.instrument.is_refused() {
                add(Severity::Warn, text.clone());
            } else if current.is_none_or(|current| current.readiness < Readiness::Tuned) {
                add(Severity::Note, text.clone());
            }
        }
        if let Ok(text) = self.handles.params.knob_status.read()
            && text.as_str() != "off"
        {
            add(self.knob_severity(), text.clone());
        }
        // A user who has just plugged in a breath controller sees that its messages arrive.
        let sources = &inside.breath_sources;
        let live = BreathInput::ALL.into_iter().find(|&input| sources.is_live(input));
        if let Some(input) = live.filter(|&input| input != BreathInput::Keys) {
            let (is_key_down, breath) = (inside.now.key.is_some(), sources.value(input).unwrap_or(0.0));
            if is_key_down && breath == 0.0 {
                // Else a key that is silent would puzzle who has forgotten a controller.
                add(
                    Severity::Note,
                    format!(
                        "{} is at 0, so the note is silent. Panic lets key velocity set the breath.",
                        input.title()
                    ),
                );
            } else {
                add(Severity::Good, format!("breath: {}", input.title()));
            }
        }
        status
    }
}

/// Fills in what the audio thread has sent.
fn show_inside(snapshot: &mut Snapshot, inside: &AudioSnapshot) {
    snapshot.key = inside.now.key;
    snapshot.sounding = inside.now.sounding;
    snapshot.mouth_kpa = inside.now.mouth_kpa;
    snapshot.lip = inside.now.lip;
    snapshot.dynamic = inside.now.dynamic;
    snapshot.switched_fingerings = inside.now.chosen;
    snapshot.sources = source_views(&inside.breath_sources, inside.now.sounding.is_some());
    snapshot.latency_ms = (1e3 * f64::from(inside.latency_samples) / inside.host_rate_hz) as f32;
    snapshot.scope = MouthpieceTraces {
        rate_hz: inside.moments_hz as f32,
        mouthpiece_kpa: inside.moments.iter().map(|moment| moment.mouthpiece_kpa).collect(),
        opening: inside.moments.iter().map(|moment| moment.opening).collect(),
        flow_cm3s: inside.moments.iter().map(|moment| moment.flow_cm3s).collect(),
    };
}

/// The breath inputs as the window shows them. `is_held`: a key is down.
fn source_views(sources: &BreathSources, is_held: bool) -> Vec<BreathSource> {
    let view = |input: BreathInput| {
        let latest = sources.value(input);
        // Velocity makes breath only while a key is down.
        let value = latest.filter(|_| input != BreathInput::Keys || is_held).unwrap_or(0.0);
        BreathSource { input, value, is_live: sources.is_live(input), is_seen: latest.is_some() }
    };
    BreathInput::ALL.map(view).into()
}

/// The knob as the window shows it, without the list of devices.
#[cfg(feature = "devices")]
fn knob_view(status: &LinkStatus) -> KnobState {
    let stats = &status.stats;
    KnobState {
        devices: Vec::new(),
        text: status.text.clone(),
        is_live: status.phase == Phase::Live,
        is_armed: status.armed,
        is_arming: status.arming,
        ceiling_mnm: f32::from(status.ceiling_mnm),
        angle_deg: status.angle_deg,
        torque_mnm: status.torque_mnm.map(|mnm| -mnm),
        notice: [&status.alarm, &status.last_refusal, &status.notice, &status.restriction]
            .into_iter()
            .find_map(Clone::clone),
        rate_hz: stats.rate_hz,
        jitter_us: (stats.jitter_p50_us, stats.jitter_p99_us),
        round_trip_us: stats.feel_round_trip_us,
        lost: stats.wire.lost,
        damaged: stats.wire.crc_errors + stats.wire.length_errors,
        losses: stats.losses,
    }
}
