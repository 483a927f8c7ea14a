//! The plugin's window: the [`editor`](crate::editor) inside the host's frame, and the data that it shows.
//!
//! Three threads take part.
//! - While the window is open, the *audio* thread sends the inside of the instrument and the latest sound. It receives the
//!   keys that the user presses in the window.
//! - The *snapshot* thread makes a [`Snapshot`] of this data, the instrument and the knob. All slow work happens there.
//! - The *main* thread draws the latest snapshot. While nothing moves, it draws less than five times a second.

mod breath_history;
#[cfg(feature = "devices")]
mod device_list;
mod editor_app;
mod file_tasks;
mod fingering_searcher;
#[cfg(target_os = "linux")]
mod graphics_libraries;
mod host_controls;
mod host_window;
mod instrument_analysis;
mod microphone_cell;
#[cfg(test)]
mod parameters_match_tests;
mod screen;
mod size_watch;
mod snapshot_thread;
mod window_audio;

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::editor::fingering_search::FingeringQuestion;
use crate::editor::{Snapshot, WindowState};
use crate::plugin::SharedHandles;
use crate::plugin::params::ChalumeauParams;
use editor_app::WindowMemory;
use file_tasks::FileTask;
pub use host_window::HostWindow;
use microphone_cell::MicrophoneCell;
use snapshot_thread::SnapshotThread;
pub use window_audio::WindowAudio;
use window_audio::WindowChannels;

/// What the threads share about the window. The audio thread takes none of its locks.
struct SharedWindow {
    is_open: AtomicBool,
    /// The open window, from its first frame on.
    drawn: Mutex<Option<egui::Context>>,
    latest: Mutex<Arc<Snapshot>>,
    /// The holes that the user tries, which the snapshot shows instead of the fingering.
    tried: Mutex<Option<Vec<bool>>>,
    /// What the user looks fingerings for.
    fingerings_for: Mutex<Option<FingeringQuestion>>,
    /// Files that the user asks for, until the snapshot thread has read them.
    file_tasks: Mutex<Vec<FileTask>>,
    stop: AtomicBool,
    /// Highest magnitude of the output since it was last read: the bits of a number that is not negative, which sort as it does.
    output_peak: AtomicU32,
    microphone: MicrophoneCell,
}

impl SharedWindow {
    fn latest(&self) -> Arc<Snapshot> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Asks the window to draw again, but only after its first frame: under X11, the window library loses a request from
    /// before the window is shown, and then waits forever.
    fn draw_again(&self) {
        let drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(window) = drawn {
            // Without a delay the window would draw twice.
            window.request_repaint_after(Duration::from_micros(1));
        }
    }

    fn set_drawn(&self, window: Option<egui::Context>) {
        *self.drawn.lock().unwrap_or_else(PoisonError::into_inner) = window;
    }

    fn ask_for_file(&self, task: FileTask) {
        self.file_tasks.lock().unwrap_or_else(PoisonError::into_inner).push(task);
    }

    fn take_file_tasks(&self) -> Vec<FileTask> {
        std::mem::take(&mut self.file_tasks.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn tried(&self) -> Option<Vec<bool>> {
        self.tried.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn fingerings_for(&self) -> Option<FingeringQuestion> {
        *self.fingerings_for.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find_fingerings(&self, question: Option<FingeringQuestion>) {
        *self.fingerings_for.lock().unwrap_or_else(PoisonError::into_inner) = question;
    }

    fn try_holes(&self, open: Option<Vec<bool>>) {
        *self.tried.lock().unwrap_or_else(PoisonError::into_inner) = open;
    }
}

/// The window of one plugin instance, open or closed. Dropping it ends the snapshot thread.
pub struct PluginWindow {
    shared: Arc<SharedWindow>,
    memory: Option<WindowMemory>,
    snapshots: Option<JoinHandle<()>>,
}

impl PluginWindow {
    /// Starts the snapshot thread, which does nothing while the window is closed. Allocates.
    pub fn start(handles: &SharedHandles) -> (Self, WindowAudio) {
        let shared = Arc::new(SharedWindow {
            is_open: AtomicBool::new(false),
            drawn: Mutex::default(),
            latest: Mutex::new(Arc::new(Snapshot::default())),
            tried: Mutex::default(),
            fingerings_for: Mutex::default(),
            file_tasks: Mutex::default(),
            stop: AtomicBool::new(false),
            output_peak: AtomicU32::new(0),
            microphone: MicrophoneCell::default(),
        });
        let (audio, WindowChannels { inside, sound, keys }) = WindowAudio::new(shared.clone());
        let snapshots = SnapshotThread::new(shared.clone(), handles.clone(), inside, sound);
        let snapshots =
            std::thread::Builder::new().name("SnapshotThread".to_owned()).spawn(move || snapshots.run());
        let memory = WindowMemory::new(handles.clone(), keys);
        // Without a thread the window shows only the parameters.
        (Self { shared, memory: Some(memory), snapshots: snapshots.ok() }, audio)
    }

    /// The window for the host, once.
    pub fn host_window(&mut self) -> Option<HostWindow> {
        HostWindow::new(self.shared.clone(), self.memory.take()?)
    }
}

impl Drop for PluginWindow {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(snapshots) = self.snapshots.take() {
            snapshots.thread().unpark();
            // The panic of a thread was reported when it happened.
            let _ = snapshots.join();
        }
    }
}

/// What the project keeps of the window.
fn kept(params: &ChalumeauParams) -> WindowState {
    params.window.read().map_or_else(|_| WindowState::default(), |kept| kept.clone()).mended()
}
