//! The window as the host knows it. It is made anew each time it opens, in the size that the project keeps.

use std::error::Error;
use std::sync::atomic::Ordering;
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

use super::SharedWindow;
use super::editor_app::{EditorApp, WindowMemory};
use crate::editor::{LEAST_SIZE, ZOOM};
use crate::identity;
use crate::plugin::launch_options::LaunchOptions;

/// How often the window asks the framework's notifier: practically never. The snapshot thread asks for a repaint itself,
/// and the notifier's first answer is always yes, which would come before a slow host shows the window; see
/// [`HostWindow::spawn`].
const NOTIFIER_INTERVAL: Duration = Duration::from_secs(24 * 3_600);

/// The window, open or closed. The framework holds it as long as the plugin lives.
pub struct HostWindow {
    shared: Arc<SharedWindow>,
    memory: Arc<Mutex<WindowMemory>>,
}

impl HostWindow {
    /// `None` if the launch options exclude a window.
    pub(super) fn new(shared: Arc<SharedWindow>, memory: WindowMemory) -> Option<Self> {
        let window = Self { shared, memory: Arc::new(Mutex::new(memory)) };
        LaunchOptions::get().is_none_or(|options| options.has_window).then_some(window)
    }

    /// Size without zoom in points, zoom, pixels per point without zoom.
    fn measures(&self) -> (LogicalSize<f32>, f32, f64) {
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let ((width, height), zoom) = memory.measures();
        (LogicalSize::new(width, height), zoom, memory.scale)
    }
}

impl Editor for HostWindow {
    type Handle = EguiEditorHandle;

    fn spawn(
        &self,
        parent: Option<ParentWindowHandle>,
        wait_for_parent: bool,
        fallback_scale_factor: Option<f64>,
        gui: GuiContext,
        host: Option<HostMethods>,
    ) -> Result<SpawnedEditor<Self::Handle>, Box<dyn Error>> {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner).open_on_screen(fallback_scale_factor);
        let (size, zoom, _) = self.measures();
        // The framework's state of the window lasts from opening to closing; the project keeps the rest.
        let state = EguiEditorState::from_size(size, zoom);
        let settings = EguiNiceSettings::new()
            .with_tile(identity::NAME)
            .with_resize_hint(self.resize_hint())
            .with_repaint_poll_interval(NOTIFIER_INTERVAL);
        let app = EditorApp::open(self.shared.clone(), self.memory.clone(), gui.clone());
        let editor = create_egui_editor(state, RepaintNotifier::new(), settings, app)
            .ok_or("cannot create the window")?;
        let has_parent = parent.is_some();
        let spawned = editor.spawn(parent, wait_for_parent, fallback_scale_factor, gui, host);
        #[cfg(target_os = "linux")]
        super::graphics_libraries::keep_loaded();
        // Under X11, the window library loses a frame that is requested before the window is shown, and then waits
        // forever. Some hosts take their time before they show the window, so show it here.
        if let (true, Ok(spawned)) = (has_parent, &spawned) {
            let _ = spawned.handle.show(&spawned.window);
        }
        if let (Err(reason), Some(options)) = (&spawned, LaunchOptions::get()) {
            // The framework tells the reason when the program ends, if at all.
            tell!("chalumeau-standalone: the window does not open: {reason}");
            options.window_failed.store(true, Ordering::Relaxed);
        }
        spawned
    }

    fn size(&self) -> NativeSize<u32> {
        let (size, zoom, scale) = self.measures();
        let zoomed = LogicalSize::new(size.width * zoom, size.height * zoom);
        NativeSize::from_size(Size::from(zoomed), scale)
    }

    fn resize_hint(&self) -> ResizeHint {
        // At the least zoom: the system takes this number once, and the zoom may change while the window is open.
        let min_size = Some(LogicalSize::new(ZOOM.0 * LEAST_SIZE.0, ZOOM.0 * LEAST_SIZE.1));
        ResizeHint {
            size_constraints: SizeConstraints::Logical { min_size, max_size: None },
            ..ResizeHint::resizable()
        }
    }
}
