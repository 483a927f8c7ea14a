//! The plugin's window: the [`editor`](crate::editor) in the host's frame, and what it is told.
//!
//! Three threads. The *audio* thread leaves, while the window is open, what is inside the instrument and the last of what
//! was heard, and takes the keys that were pressed in the window. A *looker* thread makes a [`Snapshot`] of all that, of
//! the instrument and of the knob; nothing that takes time is done where the window is drawn. The *main* thread draws the
//! latest snapshot. While nothing moves the window is drawn less than five times a second.

mod app;
mod audio;
#[cfg(feature = "devices")]
mod devices;
mod frame;
mod hands;
mod looker;
#[cfg(test)]
mod pinned;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::editor::{Kept, Snapshot};
use crate::plugin::Beside;
use crate::plugin::params::ChalumeauParams;
use app::Memory;
pub use audio::Audio;
use audio::Ends;
pub use frame::Frame;
#[cfg(feature = "standalone")]
pub use frame::{found_no_display, no_window};
use looker::Looker;

/// What the threads of the window share. The audio thread takes no lock of it.
struct Shared {
    is_open: AtomicBool,
    /// The window that has drawn its first frame and waits for the next, if one is open.
    drawn: Mutex<Option<egui::Context>>,
    latest: Mutex<Arc<Snapshot>>,
    /// Holes that are tried, if any: what the looker draws as open.
    tried: Mutex<Option<Vec<bool>>>,
    stop: AtomicBool,
}

impl Shared {
    fn latest(&self) -> Arc<Snapshot> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Has the window drawn again, once it has drawn at all: under X11 the window library loses a frame that is wanted
    /// before the window is shown, and waits for it ever after.
    fn draw_again(&self) {
        let drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(window) = drawn {
            // At once, and once; without a delay it would be drawn twice.
            window.request_repaint_after(Duration::from_micros(1));
        }
    }

    fn set_drawn(&self, window: Option<egui::Context>) {
        *self.drawn.lock().unwrap_or_else(PoisonError::into_inner) = window;
    }

    fn tried(&self) -> Option<Vec<bool>> {
        self.tried.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn try_holes(&self, open: Option<Vec<bool>>) {
        *self.tried.lock().unwrap_or_else(PoisonError::into_inner) = open;
    }
}

/// The window of one plugin instance, open or not; its looker ends with it.
pub struct Window {
    shared: Arc<Shared>,
    memory: Option<Memory>,
    looker: Option<JoinHandle<()>>,
}

impl Window {
    /// Starts the looker, which does nothing while the window is closed. Allocates.
    pub fn start(beside: &Beside) -> (Self, Audio) {
        let shared = Arc::new(Shared {
            is_open: AtomicBool::new(false),
            drawn: Mutex::default(),
            latest: Mutex::new(Arc::new(Snapshot::default())),
            tried: Mutex::default(),
            stop: AtomicBool::new(false),
        });
        let (audio, Ends { inside, sound, keys }) = Audio::new(shared.clone());
        let looker = Looker::new(shared.clone(), beside.clone(), inside, sound);
        let looker =
            std::thread::Builder::new().name("chalumeau looker".to_owned()).spawn(move || looker.run());
        let memory = Memory::new(beside.clone(), keys);
        // Without a thread the window shows parameters only.
        (Self { shared, memory: Some(memory), looker: looker.ok() }, audio)
    }

    /// The window for the host; there is one.
    pub fn frame(&mut self) -> Option<Frame> {
        Frame::new(self.shared.clone(), self.memory.take()?)
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(looker) = self.looker.take() {
            looker.thread().unpark();
            // A looker that has panicked has been reported already.
            let _ = looker.join();
        }
    }
}

/// What the state of the plugin keeps of the window.
fn kept(params: &ChalumeauParams) -> Kept {
    params.window.read().map_or_else(|_| Kept::default(), |kept| kept.clone()).mended()
}
