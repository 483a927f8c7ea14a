//! Draws the latest snapshot, and does what was done.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use nice_plug::context::gui::GuiContext;
use nice_plug_egui::baseview::{HandlerError, WindowSize};
use nice_plug_egui::{Frame, KeyCapture, NiceEguiApp};

use super::hands::HostControls;
use super::{Shared, kept};
use crate::editor::{self, Action, Controls, Kept, Snapshot, State};
use crate::plugin::Beside;
use crate::plugin::params::instrument::InstrumentChoice;
use chalumeau_core::event::Event;

/// What outlives a closed window.
pub struct Memory {
    pub(super) beside: Beside,
    controls: HostControls,
    state: State,
    /// What the window last wrote into the project.
    written: Kept,
    keys: rtrb::Producer<Event>,
    /// Pixels per point without zoom, of the screen it was last on.
    pub(super) scale: f64,
}

impl Memory {
    pub(super) fn new(beside: Beside, keys: rtrb::Producer<Event>) -> Self {
        let written = kept(&beside.params);
        Self {
            controls: HostControls::new(beside.params.clone()),
            state: State::new(written.clone()),
            written,
            beside,
            keys,
            scale: 1.0,
        }
    }

    fn act(&mut self, action: Action, shared: &Shared, gui: &GuiContext) {
        match action {
            // A full ring loses a key, not the window.
            Action::NoteOn { note, velocity } => {
                let _ = self.keys.push(Event::NoteOn { note, velocity });
            }
            Action::NoteOff { note } => {
                let _ = self.keys.push(Event::NoteOff { note });
            }
            Action::TryFingering(open) => {
                let bits = open.iter().enumerate().map(|(hole, &open)| u64::from(open) << hole).sum();
                let _ = self.keys.push(Event::TryHoles(Some(bits)));
                shared.try_holes(Some(open));
            }
            Action::EndTry => {
                let _ = self.keys.push(Event::TryHoles(None));
                shared.try_holes(None);
            }
            Action::ChooseInstrument(index) => self.choose("instr", index, InstrumentChoice::ALL.len(), gui),
            Action::OpenInstrument(path) => {
                if let Ok(mut file) = self.beside.params.instrument.file.write() {
                    *file = path.display().to_string();
                }
                let user = InstrumentChoice::ALL.len() - 1;
                self.choose("instr", user, InstrumentChoice::ALL.len(), gui);
            }
            #[cfg(feature = "devices")]
            Action::ChooseDevice(key) => {
                if let Some(kind) = super::devices::choose(&self.beside, &key) {
                    self.choose("knob", kind, super::devices::KINDS, gui);
                }
            }
            #[cfg(feature = "devices")]
            Action::FeelTest(feel) => self.beside.knob.test(feel),
            #[cfg(not(feature = "devices"))]
            Action::ChooseDevice(_) | Action::FeelTest(_) => {}
        }
    }

    /// Puts a choice among `count` on its `index`-th, as a hand would.
    fn choose(&self, id: &str, index: usize, count: usize, gui: &GuiContext) {
        let controls = self.controls.with(gui);
        controls.begin(id);
        controls.set(id, index as f32 / (count - 1) as f32);
        controls.end(id);
    }

    fn let_go(&mut self, shared: &Shared, gui: &GuiContext) {
        let actions = self.state.close(&self.controls.with(gui));
        for action in actions {
            self.act(action, shared, gui);
        }
    }
}

/// The open window; what it holds is let go of when it closes. [main thread]
pub struct App {
    shared: Arc<Shared>,
    memory: Arc<Mutex<Memory>>,
    gui: GuiContext,
    has_drawn: bool,
}

impl App {
    pub(super) fn open(shared: Arc<Shared>, memory: Arc<Mutex<Memory>>, gui: GuiContext) -> Self {
        shared.is_open.store(true, Ordering::Relaxed);
        Self { shared, memory, gui, has_drawn: false }
    }
}

impl Drop for App {
    fn drop(&mut self) {
        self.shared.is_open.store(false, Ordering::Relaxed);
        self.shared.set_drawn(None);
        self.memory.lock().unwrap_or_else(PoisonError::into_inner).let_go(&self.shared, &self.gui);
    }
}

impl NiceEguiApp for App {
    fn resized(&mut self, size: WindowSize) {
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        // The framework's factor has the zoom in it.
        memory.scale = size.scale_factor / f64::from(memory.state.kept.zoom);
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut Frame) {
        if !std::mem::replace(&mut self.has_drawn, true) {
            self.shared.set_drawn(Some(ui.ctx().clone()));
        }
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let memory = &mut *memory;
        let params = memory.beside.params.clone();
        let now = kept(&params);
        if now != memory.written {
            // A project was loaded while the window was open.
            let size = egui::vec2(now.size.0, now.size.1);
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::InnerSize(size));
            memory.state.kept = now;
        }
        let mut snapshot = Snapshot::clone(&self.shared.latest());
        // A handle under the mouse must follow in this very frame.
        snapshot.settings = params.settings();
        ui.ctx().set_zoom_factor(memory.state.kept.zoom);
        let actions = editor::draw(ui, &mut memory.state, &memory.controls.with(&self.gui), &snapshot);
        for action in actions {
            memory.act(action, &self.shared, &self.gui);
        }
        // The host's keys stay the host's unless text is typed here.
        frame.set_key_capture(if memory.state.wants_keyboard(ui.ctx()) {
            KeyCapture::CaptureAll
        } else {
            KeyCapture::IgnoreAll
        });
        let size = ui.ctx().content_rect().size();
        memory.state.kept.resized(size.x, size.y);
        let now = memory.state.kept.clone().mended();
        if memory.written != now
            && let Ok(mut kept) = params.window.write()
        {
            *kept = now.clone();
            memory.written = now;
        }
        #[cfg(feature = "standalone")]
        if crate::plugin::standalone::is_told_to_end() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    fn build(&mut self, _: egui::Context, _: GuiContext, _: &mut Frame) -> Result<(), HandlerError> {
        Ok(())
    }
}
