//! A host that is not there, and a moment of the instrument really played: what the editor's tests and pictures show.

#![allow(dead_code, reason = "each user takes what it needs")]

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use chalumeau::controllers::ControllerLinks;
use chalumeau::controllers::breath_input::BreathInput;
use chalumeau::controllers::source_curves::SourceCurves;
use chalumeau::editor::controls::{Controls, Look, Mark};
use chalumeau::editor::snapshot::{
    BreathSource, KnobDevice, KnobState, MouthpieceTraces, Severity, Snapshot, Status, Track,
};
use chalumeau::editor::sound_analysis::SoundAnalysis;
use chalumeau::editor::{EditorState, Tab, WindowState, draw};
use chalumeau::parameters::{self, PARAMETERS, Value};
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::event::Event;
use chalumeau_core::haptics::{FeelDesign, FeelTable, NoteFeel, PlayedReed, RequirementSolver, TorqueLimits};
use chalumeau_core::instrument::player::dynamics::MEZZO_FORTE;
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::{BreathResponse, Clarinet, Probe, Settings, feel_inputs};
use chalumeau_core::reed::PhysicalReed;
use chalumeau_core::units::WrittenNote;
use egui_kittest::Harness;

/// The plugin's parameters, as a test of the plugin holds them to its own.
const TABLE: &str = include_str!("parameters.tsv");

/// A parameter of the table. Numbers stand in the unit they are shown in.
enum Kind {
    Number { min: f32, max: f32, default: f32, digits: usize, unit: &'static str },
    Whole { min: i32, max: i32, default: f32, unit: &'static str },
    Choice { texts: Vec<&'static str>, default: f32 },
}

/// A number and what follows it.
fn number_and_unit(text: &'static str) -> (&'static str, &'static str) {
    let end = text.find(|c: char| !(c.is_ascii_digit() || "-.".contains(c))).unwrap_or(text.len());
    text.split_at(end)
}

/// Id, name and kind of each parameter, in the order of hosts.
fn table() -> Vec<(&'static str, &'static str, Kind)> {
    let of_line = |line: &'static str| {
        let [id, name, steps, default, texts]: [&str; 5] =
            line.split('\t').collect::<Vec<_>>().try_into().expect("five columns");
        let default: f32 = default.parse().expect("a normalised default");
        let kind = match texts.split_once("..") {
            None => Kind::Choice { texts: texts.split('|').collect(), default },
            Some((low, high)) => {
                let ((min, unit), (max, _)) = (number_and_unit(low), number_and_unit(high));
                if steps.is_empty() {
                    let digits = min.split_once('.').map_or(0, |(_, digits)| digits.len());
                    let [min, max] = [min, max].map(|text| text.parse().expect("a number"));
                    Kind::Number { min, max, default, digits, unit }
                } else {
                    let [min, max] = [min, max].map(|text| text.parse().expect("a whole number"));
                    Kind::Whole { min, max, default, unit }
                }
            }
        };
        (id, name, kind)
    };
    TABLE.lines().filter(|line| !line.starts_with('#')).map(of_line).collect()
}

/// What the editor told the host.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    Begin(String),
    Set(String, f32),
    End(String),
}

/// A host with plain numbers. Refuses what a host would complain of: a value outside a gesture.
pub struct Fake {
    table: Vec<(&'static str, &'static str, Kind)>,
    ids: Vec<&'static str>,
    values: RefCell<BTreeMap<String, f32>>,
    open: RefCell<Vec<String>>,
    told: RefCell<Vec<Told>>,
    marks: RefCell<BTreeMap<String, Mark>>,
    menus: RefCell<Vec<(String, (i32, i32))>>,
    /// The user's links, where this host lets controllers be linked.
    pub links: Option<ControllerLinks>,
    /// The own curves of sources of breath.
    pub curves: SourceCurves,
}

impl Default for Fake {
    fn default() -> Self {
        let table = table();
        let ids: Vec<_> = table.iter().map(|(id, ..)| *id).collect();
        let mut values: BTreeMap<_, _> =
            table.iter().map(|(id, _, kind)| ((*id).to_owned(), default(kind))).collect();
        // A knob by cable: what the pictures show.
        values.insert("knob".to_owned(), 1.0 / 3.0);
        Self {
            table,
            ids,
            values: RefCell::new(values),
            open: RefCell::default(),
            told: RefCell::default(),
            marks: RefCell::default(),
            menus: RefCell::default(),
            links: None,
            curves: SourceCurves::default(),
        }
    }
}

fn default(kind: &Kind) -> f32 {
    match kind {
        Kind::Number { default, .. } | Kind::Whole { default, .. } | Kind::Choice { default, .. } => *default,
    }
}

impl Fake {
    /// The same without one parameter.
    pub fn without(id: &str) -> Self {
        let mut host = Self::default();
        host.table.retain(|(known, ..)| *known != id);
        host.ids.retain(|known| *known != id);
        host
    }

    /// The same where controllers can be linked.
    pub fn linking() -> Self {
        Self { links: Some(ControllerLinks::default()), ..Self::default() }
    }

    fn kind(&self, id: &str) -> &Kind {
        &self.table.iter().find(|(known, ..)| *known == id).unwrap_or_else(|| panic!("no parameter {id}")).2
    }

    /// Normalised.
    pub fn value(&self, id: &str) -> f32 {
        self.values.borrow()[id]
    }

    /// In its own unit.
    pub fn plain(&self, id: &str) -> f32 {
        let value = self.value(id);
        let Some((.., kind)) = self.table.iter().find(|(known, ..)| *known == id) else { return 0.0 };
        match kind {
            Kind::Number { min, max, .. } => min + value * (max - min),
            Kind::Whole { min, max, .. } => (*min as f32 + value * (max - min) as f32).round(),
            Kind::Choice { texts, .. } => (value * (texts.len() - 1) as f32).round(),
        }
    }

    /// As a host's automation moves it.
    pub fn automate(&self, id: &str, value: f32) {
        self.values.borrow_mut().insert(id.to_owned(), value);
    }

    /// Ties something to a parameter.
    pub fn mark(&self, id: &str, mark: Mark) {
        self.marks.borrow_mut().insert(id.to_owned(), mark);
    }

    /// The menus that were asked for since this was last asked.
    pub fn menus(&self) -> Vec<(String, (i32, i32))> {
        std::mem::take(&mut self.menus.borrow_mut())
    }

    /// What was told since this was last asked.
    pub fn told(&self) -> Vec<Told> {
        std::mem::take(&mut self.told.borrow_mut())
    }

    /// The parameters as the instrument reads them.
    pub fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        for parameter in PARAMETERS {
            let plain = self.plain(parameter.id);
            let value = match parameter.kind {
                parameters::Kind::Number(number) => Value::Number(plain / number.scale),
                parameters::Kind::Whole(_) => Value::Whole(plain as i32),
                parameters::Kind::Choice(_) => Value::Choice(plain as usize),
                parameters::Kind::Switch(_) => Value::Switch(plain > 0.5),
                parameters::Kind::Status(_) => continue,
            };
            parameter.set(&mut settings, value);
        }
        if self.plain("rface") < 0.5 {
            return settings;
        }
        let reed = PhysicalReed {
            width_m: 1e-3 * f64::from(self.plain("rwidth")),
            area_m2: 1e-6 * f64::from(self.plain("rarea")),
            stiffness_n_m: f64::from(self.plain("rstiff")),
            tip_opening_m: 1e-3 * f64::from(self.plain("ropen")),
        };
        settings.with_physical_reed(&reed, &PhysicalReed::reference())
    }
}

impl Controls for Fake {
    fn ids(&self) -> &[&'static str] {
        &self.ids
    }

    fn marks(&self, id: &str) -> Vec<Mark> {
        self.marks.borrow().get(id).cloned().into_iter().collect()
    }

    fn links(&self) -> Option<&ControllerLinks> {
        self.links.as_ref()
    }

    fn curves(&self) -> Option<&SourceCurves> {
        Some(&self.curves)
    }

    fn has_menu(&self) -> bool {
        true
    }

    fn menu(&self, id: &str, at: (i32, i32)) {
        self.menus.borrow_mut().push((id.to_owned(), at));
    }

    fn look(&self, id: &str) -> Option<Look> {
        let (_, name, kind) = self.table.iter().find(|(known, ..)| *known == id)?;
        let steps = match kind {
            Kind::Number { .. } => None,
            Kind::Whole { min, max, .. } => Some((max - min) as usize),
            Kind::Choice { texts, .. } => Some(texts.len() - 1),
        };
        Some(Look { name: (*name).to_owned(), value: self.value(id), default: default(kind), steps })
    }

    fn text(&self, id: &str, value: f32) -> String {
        match self.kind(id) {
            Kind::Number { min, max, digits, unit, .. } => {
                format!("{:.*}{unit}", *digits, min + value * (max - min))
            }
            Kind::Whole { min, max, unit, .. } => {
                format!("{:.0}{unit}", *min as f32 + value * (max - min) as f32)
            }
            // What the plugin words at that moment.
            Kind::Choice { .. } if id == "istat" => "ready: B flat clarinet".to_owned(),
            Kind::Choice { texts, .. } => {
                texts[(value * (texts.len() - 1) as f32).round() as usize].to_owned()
            }
        }
    }

    fn parse(&self, id: &str, text: &str) -> Option<f32> {
        let number = |unit: &str| {
            text.trim().trim_end_matches(unit.trim()).trim().replace(',', ".").parse::<f32>().ok()
        };
        match self.kind(id) {
            Kind::Number { min, max, unit, .. } => {
                Some(((number(unit)? - min) / (max - min)).clamp(0.0, 1.0))
            }
            Kind::Whole { min, max, unit, .. } => {
                Some(((number(unit)? - *min as f32) / (max - min) as f32).clamp(0.0, 1.0))
            }
            Kind::Choice { texts, .. } => {
                Some(texts.iter().position(|known| *known == text)? as f32 / (texts.len() - 1) as f32)
            }
        }
    }

    fn begin(&self, id: &str) {
        assert!(!self.open.borrow().iter().any(|open| open == id), "{id} begins twice");
        self.open.borrow_mut().push(id.to_owned());
        self.told.borrow_mut().push(Told::Begin(id.to_owned()));
    }

    fn set(&self, id: &str, value: f32) {
        assert!(self.open.borrow().iter().any(|open| open == id), "{id} is set outside a gesture");
        assert!((0.0..=1.0).contains(&value), "{id} {value}");
        self.values.borrow_mut().insert(id.to_owned(), value);
        self.told.borrow_mut().push(Told::Set(id.to_owned(), value));
    }

    fn end(&self, id: &str) {
        let at = self
            .open
            .borrow()
            .iter()
            .position(|open| open == id)
            .unwrap_or_else(|| panic!("{id} ends without begin"));
        self.open.borrow_mut().remove(at);
        self.told.borrow_mut().push(Told::End(id.to_owned()));
    }
}

const RATE_HZ: f64 = 48_000.0;
/// Of the breath's history.
const STEP_S: f64 = 1.0 / 30.0;

/// What the list of instruments shows.
const INSTRUMENTS: [&str; 6] =
    ["B flat clarinet", "A clarinet", "E flat clarinet", "C clarinet", "Bass clarinet", "User file"];

/// Gamma at a time, s: rises above `gamma`, falls below it and settles.
fn swell(t: f64, gamma: f64) -> f64 {
    if t < 0.4 {
        0.0
    } else if t < 2.0 {
        (t - 0.4) / 1.6 * 1.25 * gamma
    } else if t < 3.4 {
        (1.25 - 0.6 * (t - 2.0) / 1.4) * gamma
    } else {
        (0.65 + 0.35 * ((t - 3.4) / 0.6).min(1.0)) * gamma
    }
}

/// Every source of breath; the knob is the one that blows.
fn breath_sources(knob: f32) -> Vec<BreathSource> {
    let source = |input, value, is_live, is_seen| BreathSource { input, value, is_live, is_seen };
    vec![
        source(BreathInput::Keys, 0.8, false, true),
        source(BreathInput::Parameter, 0.0, false, false),
        source(BreathInput::Breath, 0.0, false, false),
        source(BreathInput::Expression, 0.62, false, true),
        source(BreathInput::Pressure, 0.0, false, false),
        source(BreathInput::Note, 0.0, false, false),
        source(BreathInput::Knob, knob, true, true),
    ]
}

/// A knob by cable that is armed, and two other devices.
fn armed_knob(angle_deg: Option<f32>, torque_mnm: Option<f32>) -> KnobState {
    KnobState {
        devices: vec![
            KnobDevice {
                key: "5eed0001".into(),
                name: "Chalumeau sim 5eed0001".into(),
                state: "in use here, /dev/ttyACM0".into(),
                is_chosen: true,
                is_free: true,
                is_knob: true,
            },
            KnobDevice {
                key: "sim".into(),
                name: "Simulated knob 0001".into(),
                state: "ready".into(),
                is_chosen: false,
                is_free: true,
                is_knob: true,
            },
            KnobDevice {
                key: "ttyUSB0".into(),
                name: "/dev/ttyUSB0".into(),
                state: "no permission: add yourself to the group dialout".into(),
                is_chosen: false,
                is_free: false,
                is_knob: false,
            },
        ],
        text: "Chalumeau sim 5eed0001 (firmware 0.3.0) at /dev/pts/3".into(),
        is_live: true,
        is_armed: true,
        is_arming: false,
        ceiling_mnm: 100.0,
        angle_deg,
        torque_mnm,
        notice: None,
        rate_hz: 500.0,
        jitter_us: (140, 610),
        round_trip_us: Some(3_900),
        lost: 0,
        damaged: 0,
        losses: 0,
    }
}

/// The feel of a fingering with generous limits, or why there is none.
fn feel_of(bore: &RequirementSolver, reed: &PlayedReed, fingering: usize) -> Result<NoteFeel, String> {
    let limits = TorqueLimits { ceiling_mnm: 250.0, stiffness_nm_per_rad: 10.0, push_nm_per_rad: 10.0 };
    let table = FeelTable::new(bore, &FeelDesign::default(), reed, &limits);
    table
        .map_err(|refused| refused.to_string())
        .and_then(|table| table.note(fingering).copied().ok_or_else(|| "this note has no feel".to_owned()))
}

/// Root mean square, dB over full scale.
fn rms_db(samples: &[f32]) -> f32 {
    let power = samples.iter().map(|sample| sample * sample).sum::<f32>() / samples.len() as f32;
    10.0 * power.max(1e-12).log10()
}

/// Plays `written` for five seconds, a swell that settles at `gamma`, and looks at the end of it.
pub fn played(written: WrittenNote, gamma: f64, settings: &Settings) -> Snapshot {
    // Blown by pressure: the pictures show one.
    let settings = &Settings { breath_response: BreathResponse::Physical, ..*settings };
    let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
    clarinet.set_settings(settings);
    let model = clarinet.model().clone();
    let note = written.sounding(model.file.transposition).unwrap();
    let closing_kpa = 1e-3 * settings.closing_pa();
    let full_kpa = f64::from(settings.breath_full_kpa);
    let breath_at = |t: f64| swell(t, gamma) * closing_kpa / full_kpa;
    let block = 160;
    let blocks = (5.0 * RATE_HZ / block as f64) as usize;
    let (mut sound, mut probes): (Vec<f32>, Vec<Probe>) = (Vec::new(), Vec::new());
    clarinet.apply(Event::Breath(0.0));
    clarinet.apply(Event::NoteOn { note, velocity: 0.8 });
    for n in 0..blocks {
        let t = n as f64 * block as f64 / RATE_HZ;
        clarinet.apply(Event::Breath(breath_at(t) as f32));
        let mut out = vec![0.0; block];
        clarinet.render_probed(&mut out, &mut |probe| probes.push(probe));
        sound.extend(out);
    }
    let inner_hz = clarinet.internal_rate_hz();
    let every = (STEP_S * inner_hz) as usize;
    let kpa = |probe: &Probe| (probe.gamma * closing_kpa) as f32;
    let latest = &probes[probes.len() - (0.04 * inner_hz) as usize..];
    // Every second sample: the screen shows no more.
    let thin: Vec<&Probe> = latest.iter().step_by(2).collect();
    let mouth_kpa = kpa(probes.last().unwrap());
    let wanted_hz = note.frequency_hz(f64::from(settings.a4_hz));
    let heard = SoundAnalysis::of(&sound, RATE_HZ, Some(wanted_hz));

    let fingering = model.fingering_for(note).unwrap();
    let open = &model.file.fingerings[fingering].open;
    let bore = feel_inputs::requirements(&model);
    let reed = feel_inputs::played_reed(&model.file, model.a4_hz, settings);
    let feel = feel_of(&bore, &reed, fingering);
    let angle_deg = feel.as_ref().ok().map(|feel| feel.map.angle_deg(f64::from(mouth_kpa) * 1e3) as f32);
    let torque_mnm = feel.as_ref().ok().zip(angle_deg).map(|(feel, deg)| {
        chalumeau_core::haptics::torque_law::torque_mnm(
            &feel.feel,
            chalumeau_core::reed::ReedTables::reference(),
            f64::from(deg),
        ) as f32
    });
    let level_db: Vec<f32> = sound.chunks((STEP_S * RATE_HZ) as usize).map(rms_db).collect();
    let pitch = 69.0 + 12.0 * (heard.f0_hz.unwrap_or(440.0) / 440.0).log2();
    let standing = TransferMatrix::new(&model.file, model.air).standing_pressure(wanted_hz, open);
    let mut snapshot = Snapshot {
        instrument: Arc::new(model.file.clone()),
        silent: model.silent_notes(),
        instruments: INSTRUMENTS.map(String::from).to_vec(),
        chosen: Some(0),
        preset: "B flat clarinet".to_owned(),
        key: Some(note),
        sounding: Some(note),
        fingering,
        openings: open.iter().map(|&open| f32::from(open)).collect(),
        mouth_kpa,
        requirement: bore.note(fingering, &reed),
        settings: *settings,
        sources: breath_sources(breath_at(5.0) as f32),
        history: Track {
            step_s: STEP_S as f32,
            kpa: probes.iter().step_by(every).map(kpa).collect(),
            marks: Vec::new(),
            pitch: level_db.iter().map(|&db| Some(pitch).filter(|_| db > -50.0)).collect(),
            level_db,
        },
        scope: MouthpieceTraces {
            rate_hz: (0.5 * inner_hz) as f32,
            mouthpiece_kpa: thin.iter().map(|probe| (1e-3 * probe.p_mouthpiece_pa) as f32).collect(),
            opening: thin.iter().map(|probe| probe.opening as f32).collect(),
            flow_cm3s: thin.iter().map(|probe| (1e6 * probe.flow_m3s) as f32).collect(),
        },
        heard,
        output_peak: sound[sound.len() - 2_400..].iter().fold(0.0, |most, sample| sample.abs().max(most)),
        hears_midi: true,
        standing: standing.into_iter().map(|(x_m, magnitude)| (x_m as f32, magnitude as f32)).collect(),
        status: vec![
            Status {
                level: Severity::Good,
                text: "Chalumeau sim 5eed0001 at /dev/pts/3, armed at 100 mNm".into(),
            },
            Status { level: Severity::Note, text: "Breath from the knob; CC11 has moved before".into() },
        ],
        feel,
        knob: armed_knob(angle_deg, torque_mnm),
        // The plugin's delay at 48 kHz.
        latency_ms: 0.4,
        ..Snapshot::default()
    };
    snapshot.history.marks = vec![snapshot.marks(); snapshot.history.kpa.len()];
    snapshot
}

/// Written C4 at half the closing pressure on the reference clarinet.
pub fn c4() -> Snapshot {
    played(WrittenNote(60), 0.5, &Settings::default())
}

/// What a test's frame puts around a window, points.
const FRAME: f32 = 8.0;

/// A window to be drawn.
pub fn window<'a>(
    kept: &WindowState,
    controls: &'a Fake,
    snapshot: &'a Snapshot,
    scale: f32,
) -> Harness<'a, EditorState> {
    let size = egui::vec2(kept.size.0 + 2.0 * FRAME, kept.size.1 + 2.0 * FRAME);
    let mut harness = Harness::builder().with_size(size).with_pixels_per_point(scale).build_ui_state(
        |ui, state: &mut EditorState| {
            draw(ui, state, controls, snapshot);
        },
        EditorState::new(kept.clone()),
    );
    harness.run();
    harness
}

/// All of a window as a picture.
pub fn whole(harness: &Harness<'_, EditorState>) -> image::RgbaImage {
    let picture = chalumeau_raster::picture(&harness.ctx, harness.output());
    let [width, height] = picture.size.map(|side| side as u32);
    image::RgbaImage::from_raw(width, height, picture.as_raw().to_vec()).expect("four bytes for each pixel")
}

/// The window as a picture, without the frame.
pub fn shot(harness: &Harness<'_, EditorState>, scale: f32) -> image::RgbaImage {
    let whole = whole(harness);
    let size = harness.state().kept.size;
    let px = |points: f32| (points * scale).round() as u32;
    image::imageops::crop_imm(&whole, px(FRAME), px(FRAME), px(size.0), px(size.1)).to_image()
}

/// Leaves the knob away: a breath controller blows instead, as most players have.
fn blown_by_a_controller(snapshot: &mut Snapshot) {
    let breath = snapshot.sources.iter().find(|source| source.is_live).map_or(0.0, |source| source.value);
    for source in &mut snapshot.sources {
        match source.input {
            BreathInput::Breath => (source.value, source.is_live, source.is_seen) = (breath, true, true),
            BreathInput::Knob => (source.value, source.is_live, source.is_seen) = (0.0, false, false),
            _ => {}
        }
    }
    snapshot.status = vec![Status { level: Severity::Good, text: "breath: CC2 breath".into() }];
    snapshot.knob = KnobState::default();
}

/// Both at once. A knob is connected in the views that are about it; the views of the player show the note at mezzo-forte, as a player plays it.
pub fn picture(kept: &WindowState, controls: &Fake, snapshot: &Snapshot, scale: f32) -> image::RgbaImage {
    let mut snapshot = snapshot.clone();
    if !matches!(kept.tab, Tab::Reed | Tab::Knob) {
        blown_by_a_controller(&mut snapshot);
        snapshot.settings.breath_response = BreathResponse::Played;
        snapshot.dynamic = Some(MEZZO_FORTE as f32);
        let breath = breath_of_dynamic(MEZZO_FORTE, &snapshot.settings) as f32;
        snapshot.sources.iter_mut().filter(|source| source.is_live).for_each(|source| source.value = breath);
    }
    shot(&window(kept, controls, &snapshot, scale), scale)
}

/// Name and place in the picture of everything that can be moved, pressed or chosen.
pub fn things(harness: &Harness<'_, EditorState>) -> Vec<(String, egui::Rect)> {
    use egui::accesskit::Role;
    use egui_kittest::kittest::NodeT;
    let is_thing = |role| {
        matches!(
            role,
            Role::Slider | Role::Switch | Role::RadioButton | Role::Button | Role::ComboBox | Role::Tab
        )
    };
    let nodes = harness.root().children_recursive().filter(|node| is_thing(node.accesskit_node().role()));
    nodes
        .map(|node| {
            let name = node.accesskit_node().label().unwrap_or_default();
            (name, node.rect().translate(-egui::Vec2::splat(FRAME)))
        })
        .collect()
}

/// Every view, light and dark, as files in `folder`.
pub fn pictures(folder: &Path, size: (f32, f32), scales: &[f32], tabs: &[Tab]) {
    std::fs::create_dir_all(folder).unwrap();
    let snapshot = c4();
    for &scale in scales {
        for is_dark in [false, true] {
            for &tab in tabs {
                let kept = WindowState { is_dark, tab, size, ..WindowState::default() };
                let theme = if is_dark { "dark" } else { "light" };
                let name = format!("{}-{theme}-{:.0}.png", tab.name().to_lowercase(), 100.0 * scale);
                picture(&kept, &Fake::linking(), &snapshot, scale).save(folder.join(&name)).unwrap();
                println!("{}", folder.join(name).display());
            }
        }
    }
}
