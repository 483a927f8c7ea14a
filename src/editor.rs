//! The plugin's window, as a pure function of the parameters and a snapshot.
//! [`draw`] lays out one window: note, pitch and tools on top, the breath meter on the right and the keys below are always
//! in sight; one view is in the middle. The first view, *Play*, has a meter of its own. A musician sees the views that make music,
//! a laboratory all of them. It reads [`Snapshot`] and [`Controls`], changes parameters through [`Controls`], and
//! returns everything else that the user did as [`Action`]s. It knows no voice, no link to the knob and no host, it never
//! blocks. It asks for a repaint only while something moves by itself. The design size is 1100 by 720 points, the least usable size 700 by 480. The owner
//! of the window applies the zoom.

pub mod ab_comparison;
mod alteration_editor;
mod blind_comparison_view;
mod body_shape;
mod breath_meter;
mod breath_view;
mod chart;
mod clarinet_drawing;
mod clarinet_view;
pub mod connections;
mod connections_view;
pub mod controls;
mod dynamic_meter;
pub mod feel_test;
mod file_browser;
pub mod fingering_search;
mod header;
mod hole_names;
mod host_marks;
mod instrument_view;
mod key_steps;
mod keyboard;
mod knob_view;
mod lamps;
mod linked_controllers;
mod multiphonic_choices;
pub mod note_names;
mod pitch_needle;
mod play_view;
mod preset_bar;
mod preset_browser;
mod preset_values;
mod reed_view;
mod slider;
pub mod snapshot;
pub mod sound_analysis;
mod sound_view;
pub mod terms;
pub mod theme;
mod trial;
pub mod undo;
mod widgets;
pub mod window_state;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use egui::{CentralPanel, Frame, Margin, Panel, Theme, Ui};
use serde::{Deserialize, Serialize};

pub use ab_comparison::AbComparison;
use connections::DeviceChoice;
pub use controls::{Controls, Look};
pub use feel_test::FeelTest;
pub use note_names::note_name;
pub use snapshot::Snapshot;
pub use window_state::{LEAST_SIZE, SIZE, WindowState, ZOOM};

use chalumeau_core::bore::alterations::Alterations;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::BreathResponse;
use chalumeau_core::units::SoundingNote;
use chalumeau_knob::wire::message::Feel;
use controls::{Entry, Hands, Press};
use file_browser::FileBrowser;
use fingering_search::FingeringQuestion;
use keyboard::Keyboard;
use preset_browser::PresetBrowser;
use trial::Trial;
use undo::UndoHistory;

use crate::folder_listing::Place;
use crate::presets::Preset;

/// What the user did, other than changing a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A key goes down.
    NoteOn {
        /// Sounding pitch.
        note: SoundingNote,
        /// How hard, 0..=1.
        velocity: f32,
    },
    /// A key comes up.
    NoteOff {
        /// Sounding pitch.
        note: SoundingNote,
    },
    /// Use these holes (open or not, in the order of the instrument's file) instead of the played fingering, until
    /// [`Action::EndTry`].
    TryFingering(Vec<bool>),
    /// Back to the fingering of the note.
    EndTry,
    /// Look for fingerings for this; `None` looks no longer.
    FindFingerings(Option<FingeringQuestion>),
    /// A device of the list, by its key.
    ChooseDevice(String),
    /// Look which devices for sound and MIDI there are.
    LookForDevices,
    /// Start again with these devices for sound and MIDI.
    UseDevices(DeviceChoice),
    /// The user alters these holes and joints; all others are as built.
    Alter(Alterations),
    /// Save an altered instrument as a file of the user's.
    SaveInstrument(Arc<InstrumentFile>),
    /// The feel of a test, which replaces the feel of the notes; `None` ends the test.
    FeelTest(Option<Feel>),
    /// The knob must let go, now.
    StopKnob,
    /// An instrument of the list.
    ChooseInstrument(usize),
    /// An instrument file.
    OpenInstrument(PathBuf),
    /// The file that *User file* stands for, as undo brings it back; empty for the usual place.
    NameInstrumentFile(String),
    /// A scale or a keyboard mapping.
    OpenScale(PathBuf),
    /// Keys play equal temperament again.
    EqualTemperament,
    /// Notes, by sounding pitch, are moved by so many tenths of a cent.
    TrimNotes(BTreeMap<u8, i16>),
    /// Keys without a scale of their own follow a tuning program, or no longer.
    FollowTuningProgram(bool),
    /// Read a folder for the user to choose from.
    ReadFolder(Place),
    /// The preset of this name has been put on the controls.
    ChosePreset(String),
    /// Look again for the user's presets.
    ReadPresets,
    /// Save a preset, in place of one of the user's with the same name.
    SavePreset(Preset),
    /// Give one of the user's presets another name.
    RenamePreset {
        /// Its name now.
        old: String,
        /// Its new name.
        new: String,
    },
    /// Delete one of the user's presets.
    DeletePreset(String),
    /// The user likes a preset, or no longer.
    LikePreset {
        /// Its name.
        name: String,
        /// Whether it is liked from now on.
        is_liked: bool,
    },
}

/// The views.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tab {
    /// The clarinet as it is played, and the main controls.
    #[default]
    Play,
    /// Spectrum and waves.
    Sound,
    /// Breath and where it comes from.
    Breath,
    /// Bore, holes, fingerings.
    Clarinet,
    /// Which instrument, tuning, output.
    Instrument,
    /// Flow through the reed, and torque.
    Reed,
    /// Knob and feel.
    Knob,
}

impl Tab {
    /// In their order on the screen.
    pub const ALL: [Self; 7] =
        [Self::Play, Self::Sound, Self::Breath, Self::Clarinet, Self::Instrument, Self::Reed, Self::Knob];

    /// The text on the tab.
    pub fn name(self) -> &'static str {
        match self {
            Self::Play => "Play",
            Self::Reed => "Reed",
            Self::Clarinet => "Clarinet",
            Self::Breath => "Breath",
            Self::Sound => "Sound",
            Self::Knob => "Knob",
            Self::Instrument => "Instrument",
        }
    }

    /// The tool tip of the tab.
    fn about(self) -> &'static str {
        match self {
            Self::Play => "The clarinet as it is played, and the main controls",
            Self::Reed => "Reed: flow over pressure, and the torque you feel",
            Self::Clarinet => "Bore, tone holes and keys; try fingerings",
            Self::Breath => "Breath: its source, its curve, calibration",
            Self::Sound => "Spectrum, waves, pitch",
            Self::Knob => "Knob: device, arming, torque",
            Self::Instrument => "Which clarinet, tuning, articulation, output",
        }
    }
}

/// Everything the window remembers between frames.
#[derive(Clone, Debug, Default)]
pub struct EditorState {
    /// The part that is saved with a project.
    pub kept: WindowState,
    history: UndoHistory,
    compare: AbComparison,
    entry: Option<Entry>,
    held: Vec<&'static str>,
    presses: Vec<Press>,
    keyboard: Keyboard,
    presets: PresetBrowser,
    reed: reed_view::ReedView,
    clarinet: clarinet_view::ClarinetView,
    trial: Trial,
    breath: breath_view::BreathView,
    play: play_view::PlayView,
    knob: knob_view::KnobView,
    files: FileBrowser,
}

impl EditorState {
    /// With the saved state of a project.
    pub fn new(kept: WindowState) -> Self {
        Self { kept: kept.mended(), ..Self::default() }
    }

    /// For a window without a host: letters play.
    #[must_use]
    pub fn with_letters(mut self) -> Self {
        self.keyboard.take_letters();
        self
    }

    /// Opens or closes the browser of presets.
    pub fn show_presets(&mut self, is_open: bool) {
        self.presets.is_open = is_open;
    }

    /// A text field has the focus: only then do keys belong to the editor rather than to the host.
    pub fn wants_keyboard(&self, ctx: &egui::Context) -> bool {
        self.entry.is_some() || ctx.text_edit_focused()
    }

    /// Another project has been loaded: forgets what can be undone and what A and B are, and ends a feel test, all of which were of
    /// the settings before.
    pub fn forget_settings(&mut self) -> Vec<Action> {
        let mut actions = Vec::new();
        (self.history, self.compare) = Default::default();
        self.knob.end_test(&mut actions);
        actions
    }

    /// Lets go of everything that is held: before the window closes.
    pub fn close(&mut self, controls: &dyn Controls) -> Vec<Action> {
        let mut actions = Vec::new();
        let Self { history, entry, held, presses, .. } = self;
        let mut hands = Hands { controls, history, entry, held, presses };
        hands.end_presses(None);
        hands.let_go();
        linked_controllers::end_learning(&hands);
        self.keyboard.release(&mut actions);
        self.knob.end_test(&mut actions);
        self.trial.end(&mut actions);
        self.entry = None;
        actions
    }
}

/// Draws the window into `ui` and gives back what the user did. In less room than [`LEAST_SIZE`] (a large zoom in a window
/// that a host keeps small) all of it scrolls.
pub fn draw(
    ui: &mut Ui,
    state: &mut EditorState,
    controls: &dyn Controls,
    snapshot: &Snapshot,
) -> Vec<Action> {
    let (room, least) = (ui.available_size(), egui::vec2(LEAST_SIZE.0, LEAST_SIZE.1));
    // Rounding to pixels is no lack of room.
    if room.x >= least.x - 2.0 && room.y >= least.y - 2.0 {
        return whole(ui, state, controls, snapshot);
    }
    let area = egui::ScrollArea::both().id_salt("all").auto_shrink([false, false]);
    let shown = area.show(ui, |ui| {
        let (rect, _) = ui.allocate_exact_size(room.max(least), egui::Sense::hover());
        let inside = egui::UiBuilder::new().max_rect(rect);
        ui.scope_builder(inside, |ui| whole(ui, state, controls, snapshot)).inner
    });
    shown.inner
}

/// The window where there is room for it.
fn whole(ui: &mut Ui, state: &mut EditorState, controls: &dyn Controls, snapshot: &Snapshot) -> Vec<Action> {
    let mut actions = Vec::new();
    let EditorState {
        kept,
        history,
        compare,
        entry,
        held,
        presses,
        keyboard,
        presets,
        reed,
        clarinet,
        trial,
        breath,
        play,
        knob,
        files,
    } = state;
    theme::apply(ui, if kept.is_dark { Theme::Dark } else { Theme::Light });
    let c = theme::Colours::here(ui);
    let mut hands = Hands { controls, history, entry, held, presses };
    let (width, height) = (ui.available_width(), ui.available_height());
    let is_small = width < 900.0 || height < 560.0;
    let tab = kept.tab;
    let is_blind = compare.is_blind();

    // In every view, whatever has the focus.
    let wants_torque = snapshot.knob.is_armed || hands.step("arm") == 1;
    if wants_torque && ui.input(|input| input.key_pressed(egui::Key::Escape)) {
        knob_view::stop(&mut hands, &mut actions);
    }
    if ui.input(|input| input.key_pressed(egui::Key::Escape)) {
        linked_controllers::end_learning(&hands);
    }
    breath.look(&snapshot.sources, ui.input(|input| input.time));
    trial.keep_to(snapshot, &mut actions);
    if tab != Tab::Knob || is_blind || presets.is_open || files.is_open() {
        // The hand would go on feeling a test that no view shows.
        knob.end_test(&mut actions);
    }
    // A window that has grown past the screen hides the list of sizes.
    if keyboard.has_letters()
        && ui.input_mut(|input| input.consume_key(egui::Modifiers::COMMAND, egui::Key::Num0))
    {
        kept.zoom = 1.0;
    }
    // In a plugin, the keys of the computer are the host's.
    if keyboard.has_letters() && !is_blind && hands.entry.is_none() && !ui.ctx().text_edit_focused() {
        use egui::{Key, Modifiers};
        let redo = Modifiers::COMMAND | Modifiers::SHIFT;
        let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
        // Ctrl+Z would take Ctrl+Shift+Z, too.
        if pressed(redo, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            header::redo_step(&mut hands, snapshot, &mut actions);
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            header::undo_step(&mut hands, snapshot, &mut actions);
        }
    }
    let is_listed = snapshot.knob.devices.iter().any(|device| device.is_knob);
    let has_knob = snapshot.knob.is_live || is_listed || hands.step("knob") > 0;
    widgets::say_feel(ui, has_knob || kept.is_lab);

    let ground = |x: i8, y: i8| Frame::new().fill(c.ground).inner_margin(Margin::symmetric(x, y));
    let line = Panel::top("tools").exact_size(if is_small { 44.0 } else { 52.0 }).show_separator_line(false);
    line.frame(ground(10, 2)).show(ui, |ui| {
        header::tools(ui, kept, compare, presets, &mut hands, snapshot, &mut actions);
    });
    let line = Panel::top("tabs").exact_size(30.0).show_separator_line(true);
    line.frame(Frame::new().fill(c.ground).inner_margin(Margin { left: 2, right: 10, top: 0, bottom: 0 }))
        .show(ui, |ui| {
            if header::tabs(ui, kept, has_knob, is_blind, trial.is_on(), snapshot) {
                presets.is_open = false;
                files.close();
            }
        });
    // In a wide window they grow with the width, so that white keys stay longer than wide.
    let keys = (0.13 * height).clamp(52.0, 110.0f32.max(0.11 * width));
    let line = Panel::bottom("keys").exact_size(keys + 10.0).show_separator_line(false);
    let is_text = hands.entry.is_some() || ui.ctx().text_edit_focused();
    line.frame(ground(8, 5)).show(ui, |ui| keyboard.draw(ui, kept.names, snapshot, is_text, &mut actions));
    // A pressure would tell one setting from another.
    let has_meter = tab != Tab::Play && !is_blind;
    let line =
        Panel::right("meter").exact_size(if is_small { 96.0 } else { 112.0 }).show_separator_line(false);
    if has_meter {
        // Pressures are for a laboratory, and for who has chosen to blow them.
        let is_pressure = kept.is_lab || snapshot.settings.breath_response == BreathResponse::Physical;
        line.frame(ground(8, 8)).show(ui, |ui| {
            if is_pressure {
                breath_meter::column(ui, snapshot)
            } else {
                dynamic_meter::draw(ui, snapshot, 1.0)
            }
        });
    }
    CentralPanel::default().frame(ground(8, 8)).show(ui, |ui| {
        if is_blind {
            blind_comparison_view::draw(ui, compare, &mut hands, snapshot, &mut actions);
            return;
        }
        if presets.is_open {
            presets.has_keys = keyboard.has_letters();
            presets.draw(ui, &mut hands, snapshot, &mut actions);
            return;
        }
        if files.is_open() {
            files.draw(ui, &snapshot.folder, &mut actions);
            return;
        }
        match tab {
            Tab::Play => {
                let tried = clarinet.tried_name(kept.names, snapshot, trial);
                play.draw(ui, &mut hands, snapshot, (trial, tried), clarinet.alterations(), &mut actions);
            }
            Tab::Reed => reed.draw(ui, &mut hands, snapshot),
            Tab::Clarinet => clarinet.draw(ui, kept.names, snapshot, trial, &mut actions),
            Tab::Breath => breath.draw(ui, &mut hands, snapshot),
            Tab::Sound => sound_view::draw(ui, &mut hands, snapshot),
            Tab::Knob => knob.draw(ui, &mut hands, snapshot, &mut actions),
            Tab::Instrument => {
                instrument_view::draw(ui, &mut hands, snapshot, &mut kept.names, files, &mut actions)
            }
        }
    });
    for action in &actions {
        if let Action::OpenInstrument(path) = action {
            hands.record_instrument_file(path, snapshot);
        }
    }
    if let Some(moved) = clarinet.alterations().take_move() {
        hands.history.record_move(moved);
    }
    // A widget that disappears while it is held, with its view or in a blind comparison, cannot end its gesture.
    if !hands.held.is_empty() && !ui.input(|input| input.pointer.any_down() || input.pointer.any_released()) {
        hands.let_go();
    }
    if let Some(left_s) = hands.end_presses(Some(ui.input(|input| input.time))) {
        ui.ctx().request_repaint_after(Duration::from_secs_f64(left_s.max(0.0)));
    }
    actions
}

/// A picture on the left and a column of controls on the right, which scrolls where it is too long.
fn beside<A>(
    ui: &mut Ui,
    id: &'static str,
    with: &mut A,
    picture: impl FnOnce(&mut Ui, &mut A),
    column: impl FnOnce(&mut Ui, &mut A),
) {
    let width = (0.26 * ui.available_width()).clamp(186.0, 260.0);
    let c = theme::Colours::here(ui);
    let side = Panel::right(egui::Id::unique((id, "column"))).exact_size(width).show_separator_line(false);
    side.frame(theme::panel(c)).show(ui, |ui| {
        egui::ScrollArea::vertical().id_salt(id).auto_shrink([false, false]).show(ui, |ui| {
            // Room for the scroll bar.
            ui.set_width(ui.available_width() - 8.0);
            ui.spacing_mut().item_spacing.y = 4.0;
            column(ui, with);
        });
    });
    let rest = Frame::new().outer_margin(Margin { right: theme::GAP as i8, ..Margin::ZERO });
    CentralPanel::default().frame(rest).show(ui, |ui| picture(ui, with));
}
