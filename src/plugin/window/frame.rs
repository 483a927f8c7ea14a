//! The window as the host knows it: made anew each time it opens, of the size that the project kept.

use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use nice_plug::context::gui::GuiContext;
use nice_plug::editor::dpi::{LogicalSize, NativeSize, Size};
use nice_plug::editor::{
    Editor, EditorHandle, HostMethods, ParentWindowHandle, ResizeHint, SizeConstraints, SpawnedEditor,
};
use nice_plug_egui::{
    EguiEditorHandle, EguiEditorState, EguiNiceSettings, RepaintNotifier, create_egui_editor,
};

use super::app::{App, Memory};
use super::{Shared, kept};
use crate::editor::LEAST_SIZE;
use crate::identity;

/// See [`no_window`].
static NO_WINDOW: AtomicBool = AtomicBool::new(false);
/// See [`found_no_display`].
static NO_DISPLAY: AtomicBool = AtomicBool::new(false);

/// From now on no plugin of this process has a window. For a program that is told so.
#[cfg(feature = "standalone")]
pub fn no_window() {
    NO_WINDOW.store(true, Ordering::Relaxed);
}

/// Whether a window was wanted and did not open.
#[cfg(feature = "standalone")]
pub fn found_no_display() -> bool {
    NO_DISPLAY.load(Ordering::Relaxed)
}

/// How often the window asks the framework's notifier, which nobody uses: the looker tells it by itself. Its first answer
/// is always yes, and would come before a slow host shows the window; see [`Frame::spawn`].
const ASK: Duration = Duration::from_secs(24 * 3_600);

/// The window, open or not. The framework holds it as long as the plugin lives.
pub struct Frame {
    shared: Arc<Shared>,
    memory: Arc<Mutex<Memory>>,
}

impl Frame {
    pub(super) fn new(shared: Arc<Shared>, memory: Memory) -> Option<Self> {
        let frame = Self { shared, memory: Arc::new(Mutex::new(memory)) };
        (!NO_WINDOW.load(Ordering::Relaxed)).then_some(frame)
    }

    /// Size without zoom in points, zoom, pixels per point without zoom.
    fn measures(&self) -> (LogicalSize<f32>, f32, f64) {
        let memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = kept(&memory.beside.params);
        (LogicalSize::new(kept.size.0, kept.size.1), kept.zoom, memory.scale)
    }
}

impl Editor for Frame {
    type Handle = EguiEditorHandle;

    fn spawn(
        &self,
        parent: Option<ParentWindowHandle>,
        wait_for_parent: bool,
        fallback_scale_factor: Option<f64>,
        gui: GuiContext,
        host: Option<HostMethods>,
    ) -> Result<SpawnedEditor<Self::Handle>, Box<dyn Error>> {
        #[cfg(feature = "standalone")]
        crate::plugin::standalone::listen_for_the_end();
        let (size, zoom, _) = self.measures();
        // Opening and closing are the window's own life, so its state lasts as long.
        let state = EguiEditorState::from_size(size, zoom);
        let settings = EguiNiceSettings::new()
            .with_tile(identity::NAME)
            .with_resize_hint(self.resize_hint())
            .with_repaint_poll_interval(ASK);
        let app = App::open(self.shared.clone(), self.memory.clone(), gui.clone());
        let editor = create_egui_editor(state, RepaintNotifier::new(), settings, app)
            .ok_or("the window cannot be made")?;
        let has_parent = parent.is_some();
        let spawned = editor.spawn(parent, wait_for_parent, fallback_scale_factor, gui, host);
        // Under X11 the window library loses a frame that is wanted before the window is shown, and waits for it ever
        // after. A host may take its time between the two.
        if let (true, Ok(spawned)) = (has_parent, &spawned) {
            let _ = spawned.handle.show(&spawned.window);
        }
        if spawned.is_err() {
            NO_DISPLAY.store(true, Ordering::Relaxed);
        }
        spawned
    }

    fn size(&self) -> NativeSize<u32> {
        let (size, zoom, scale) = self.measures();
        let zoomed = LogicalSize::new(size.width * zoom, size.height * zoom);
        NativeSize::from_size(Size::from(zoomed), scale)
    }

    fn resize_hint(&self) -> ResizeHint {
        let min_size = Some(LogicalSize::new(LEAST_SIZE.0, LEAST_SIZE.1));
        ResizeHint {
            size_constraints: SizeConstraints::Logical { min_size, max_size: None },
            ..ResizeHint::resizable()
        }
    }
}
