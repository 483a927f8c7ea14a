//! Draws the latest snapshot and applies the user's actions.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use nice_plug::context::gui::GuiContext;
#[cfg(feature = "devices")]
use nice_plug::params::enums::Enum;
use nice_plug_egui::baseview::{HandlerError, WindowSize};
use nice_plug_egui::{Frame, KeyCapture, NiceEguiApp};

use super::file_tasks::FileTask;
use super::host_controls::HostControls;
use super::size_watch::{Seen, SizeWatch};
use super::{SharedWindow, kept, screen};
use crate::editor::{self, Action, Controls, EditorState, Snapshot, WindowState};
use crate::plugin::SharedHandles;
use crate::plugin::launch_options::{DeviceTask, LaunchOptions};
use crate::plugin::params::ChalumeauParams;
use crate::plugin::params::instrument::InstrumentChoice;
#[cfg(feature = "devices")]
use crate::plugin::params::knob::KnobKind;
use crate::plugin::params::scale::SavedScale;
use crate::plugin::preset_keeper::PresetTask;
use chalumeau_core::bore::fingering_finder;
use chalumeau_core::event::Event;

/// What the window keeps while it is closed.
pub struct WindowMemory {
    pub(super) handles: SharedHandles,
    controls: HostControls,
    state: EditorState,
    /// What the window has written into the project last.
    written: WindowState,
    /// How often links and curves had changed when the host was told last.
    links: u32,
    /// How often the host had loaded a state when the window looked last.
    loads: u32,
    keys: rtrb::Producer<Event>,
    /// Pixels per point without zoom, on the latest screen.
    pub(super) scale: f64,
    /// The largest window that the screen has room for, once the screen was asked.
    room: Option<Option<(f32, f32)>>,
    /// Size of the open window once it has come to rest, points.
    shown: Option<(f32, f32)>,
}

impl WindowMemory {
    pub(super) fn new(handles: SharedHandles, keys: rtrb::Producer<Event>) -> Self {
        let written = kept(&handles.params);
        let state = EditorState::new(written.clone());
        Self {
            controls: HostControls::new(handles.params.clone()),
            // A host has commands on its letters.
            state: if LaunchOptions::get().is_some() { state.with_letters() } else { state },
            written,
            links: changes(&handles.params),
            loads: handles.params.loads(),
            handles,
            keys,
            scale: 1.0,
            room: None,
            shown: None,
        }
    }

    /// Size without zoom in points and zoom, of the open window or of one that opens now.
    pub(super) fn measures(&mut self) -> ((f32, f32), f32) {
        let room = *self.room.get_or_insert_with(|| screen::room(None));
        let kept = kept(&self.handles.params);
        (self.shown.unwrap_or_else(|| kept.fitted_size(room)), kept.zoom)
    }

    /// Asks the screen before a window opens. A zoom from a larger screen, at which a window would not fit, becomes less.
    pub(super) fn open_on_screen(&mut self, fallback_scale: Option<f64>) {
        let room = screen::room(fallback_scale);
        (self.room, self.shown) = (Some(room), None);
        if let Ok(mut kept) = self.handles.params.window.write() {
            kept.zoom = kept.fitted_zoom(room);
        }
    }

    fn act(&mut self, action: Action, shared: &SharedWindow, gui: &GuiContext) {
        match action {
            // A full ring loses the key; the window goes on.
            Action::NoteOn { note, velocity } => {
                let _ = self.keys.push(Event::NoteOn { note, velocity });
            }
            Action::NoteOff { note } => {
                let _ = self.keys.push(Event::NoteOff { note });
            }
            Action::TryFingering(open) => {
                let _ = self.keys.push(try_holes(&open));
                shared.try_holes(Some(open));
            }
            Action::EndTry => {
                let _ = self.keys.push(Event::TryHoles(None));
                shared.try_holes(None);
            }
            Action::FindFingerings(question) => shared.find_fingerings(question),
            Action::ChooseInstrument(index) => self.choose("instr", index, InstrumentChoice::ALL.len(), gui),
            Action::NameInstrumentFile(path) => self.name_instrument_file(path),
            Action::OpenInstrument(path) => {
                self.name_instrument_file(path.display().to_string());
                let user = InstrumentChoice::ALL.len() - 1;
                self.choose("instr", user, InstrumentChoice::ALL.len(), gui);
            }
            Action::Alter(alterations) => {
                let params = &self.handles.params;
                params.alterations.put(params.instrument.key(), alterations);
                params.host.state_changed();
            }
            Action::SaveInstrument(file) => shared.ask_for_file(FileTask::SaveInstrument(file)),
            Action::OpenScale(path) => shared.ask_for_file(FileTask::OpenScale(path)),
            Action::ReadFolder(path) => shared.ask_for_file(FileTask::ReadFolder(path)),
            Action::EqualTemperament => {
                let scale = &self.handles.params.scale;
                scale.put(scale.saved().equal());
                self.handles.params.host.state_changed();
            }
            Action::TrimNotes(trims) => {
                let scale = &self.handles.params.scale;
                scale.put(SavedScale { trims, ..scale.saved() });
                self.handles.params.host.state_changed();
            }
            Action::FollowTuningProgram(follows) => {
                let scale = &self.handles.params.scale;
                scale.put(SavedScale { ignores_tuning_program: !follows, ..scale.saved() });
                self.handles.params.host.state_changed();
            }
            Action::ChosePreset(name) => self.handles.params.set_preset_name(&name),
            Action::LookForDevices => LaunchOptions::ask(DeviceTask::Look),
            Action::UseDevices(choice) => LaunchOptions::ask(DeviceTask::Use(choice)),
            Action::ReadPresets => self.handles.presets.send(PresetTask::Read),
            Action::SavePreset(preset) => self.handles.presets.send(PresetTask::Save(preset)),
            Action::RenamePreset { old, new } => {
                self.handles.presets.send(PresetTask::Rename { old, new });
            }
            Action::DeletePreset(name) => self.handles.presets.send(PresetTask::Delete(name)),
            Action::LikePreset { name, is_liked } => {
                self.handles.presets.send(PresetTask::Like { name, is_liked });
            }
            #[cfg(feature = "devices")]
            Action::ChooseDevice(key) => {
                let kind = super::device_list::choose(&self.handles, &key);
                self.choose("knob", kind.to_index(), KnobKind::variants().len(), gui);
            }
            #[cfg(feature = "devices")]
            Action::FeelTest(feel) => self.handles.knob.test(feel),
            #[cfg(feature = "devices")]
            Action::StopKnob => self.handles.knob.let_go(chalumeau_knob::device::Release::Stop),
            #[cfg(not(feature = "devices"))]
            Action::ChooseDevice(_) | Action::FeelTest(_) | Action::StopKnob => {}
        }
    }

    /// The file that *User file* stands for.
    fn name_instrument_file(&self, path: String) {
        if let Ok(mut file) = self.handles.params.instrument.file.write() {
            *file = path;
        }
        self.handles.params.host.state_changed();
    }

    /// Sets a choice parameter to value `index` of `count`, as the user would.
    fn choose(&self, id: &str, index: usize, count: usize, gui: &GuiContext) {
        let controls = self.controls.with(gui);
        controls.begin(id);
        controls.set(id, index as f32 / (count - 1) as f32);
        controls.end(id);
    }

    fn close(&mut self, shared: &SharedWindow, gui: &GuiContext) {
        let actions = self.state.close(&self.controls.with(gui));
        for action in actions {
            self.act(action, shared, gui);
        }
    }
}

/// How often links and curves have changed.
fn changes(params: &ChalumeauParams) -> u32 {
    params.links.changes().wrapping_add(params.curves.changes())
}

/// What the voice hears of a trial.
pub(super) fn try_holes(open: &[bool]) -> Event {
    Event::TryHoles(Some(fingering_finder::bits(open)))
}

/// The open window. It releases held keys and parameters when it closes. [main thread]
pub struct EditorApp {
    shared: Arc<SharedWindow>,
    memory: Arc<Mutex<WindowMemory>>,
    gui: GuiContext,
    has_drawn: bool,
    size: SizeWatch,
}

impl EditorApp {
    pub(super) fn open(shared: Arc<SharedWindow>, memory: Arc<Mutex<WindowMemory>>, gui: GuiContext) -> Self {
        shared.is_open.store(true, Ordering::Relaxed);
        // A host that sleeps would show an old picture, and hear no key of the window.
        memory.lock().unwrap_or_else(PoisonError::into_inner).handles.params.host.wake();
        Self { shared, memory, gui, has_drawn: false, size: SizeWatch::default() }
    }
}

impl Drop for EditorApp {
    fn drop(&mut self) {
        self.shared.is_open.store(false, Ordering::Relaxed);
        self.shared.set_drawn(None);
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        memory.shown = None;
        memory.close(&self.shared, &self.gui);
    }
}

impl NiceEguiApp for EditorApp {
    fn resized(&mut self, size: WindowSize) {
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        // The framework's factor includes the zoom.
        memory.scale = size.scale_factor / f64::from(memory.state.kept.zoom);
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut Frame) {
        if !std::mem::replace(&mut self.has_drawn, true) {
            self.shared.set_drawn(Some(ui.ctx().clone()));
        }
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let memory = &mut *memory;
        let params = memory.handles.params.clone();
        let room = memory.room.flatten();
        let resize = |ui: &egui::Ui, kept: &WindowState| {
            let (width, height) = kept.fitted_size(room);
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::InnerSize(egui::vec2(width, height)));
        };
        let now = kept(&params);
        if now != memory.written {
            // The host has loaded a project, while the window is open or before.
            resize(ui, &now);
            self.size.settle(Instant::now());
            memory.written = now.clone();
            memory.state.kept = now;
        }
        let loads = params.loads();
        if std::mem::replace(&mut memory.loads, loads) != loads {
            for action in memory.state.forget_settings() {
                memory.act(action, &self.shared, &self.gui);
            }
        }
        let mut snapshot = Snapshot::clone(&self.shared.latest());
        // What the mouse drags must follow in this frame.
        snapshot.settings = params.settings();
        snapshot.presets = memory.handles.presets.shelf();
        snapshot.preset = params.preset_name();
        snapshot.scale = params.scale.title();
        snapshot.trims = params.scale.trims();
        snapshot.follows_tuning_program = params.scale.follows_tuning_program();
        // While another instrument comes, the window still draws the old one, which cannot be altered any more.
        snapshot.can_alter = snapshot.instrument_key == params.instrument.key();
        snapshot.alterations = match snapshot.can_alter {
            true => params.alterations.of(&snapshot.instrument_key),
            false => Arc::default(),
        };
        snapshot.room = room;
        ui.ctx().set_zoom_factor(memory.state.kept.zoom);
        let actions = editor::draw(ui, &mut memory.state, &memory.controls.with(&self.gui), &snapshot);
        for action in actions {
            memory.act(action, &self.shared, &self.gui);
        }
        let links = changes(&params);
        if std::mem::replace(&mut memory.links, links) != links {
            params.host.state_changed();
        }
        // The host gets the keyboard, unless the user types text here.
        frame.set_key_capture(if memory.state.wants_keyboard(ui.ctx()) {
            KeyCapture::CaptureAll
        } else {
            KeyCapture::IgnoreAll
        });
        let size = ui.ctx().content_rect().size();
        let zoom = ui.ctx().zoom_factor();
        let asked = memory.state.kept.fitted_size(room);
        let seen = self.size.look(zoom, (size.x, size.y), asked, Instant::now());
        match seen {
            Seen::Zoomed => resize(ui, &memory.state.kept),
            Seen::Dragged => memory.state.kept.resized(size.x, size.y, room),
            Seen::Settling | Seen::Still => {}
        }
        let is_at_rest = seen == Seen::Still || seen == Seen::Dragged;
        memory.shown = (is_at_rest && zoom == memory.state.kept.zoom).then_some((size.x, size.y));
        let now = memory.state.kept.clone().mended();
        if memory.written != now
            && let Ok(mut kept) = params.window.write()
        {
            *kept = now.clone();
            memory.written = now;
        }
        if LaunchOptions::get().is_some_and(|options| options.quit.load(Ordering::Relaxed)) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn build(&mut self, _: egui::Context, _: GuiContext, _: &mut Frame) -> Result<(), HandlerError> {
        Ok(())
    }
}
