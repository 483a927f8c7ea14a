//! The way from the plugin's threads to its host, between the host's calls.
//!
//! The plugin's threads say here what a host may want to know: that the plugin rests, that a status text has changed, that
//! the user asks for the host's own menu. The layer of a plugin format, [`clap`](crate::plugin::clap), passes it on. A VST3
//! host is told only that a project is no longer as it was saved; the standalone has no such layer.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::editor::controls::Mark;

/// What a host can be asked at any time. Neither call waits for the host.
pub trait HostCalls: Send + Sync {
    /// Asks the host to process, should it have stopped. [any thread]
    fn request_process(&self);
    /// Asks the host for a moment on its main thread, in which it is told what has changed. [any thread]
    fn request_callback(&self);
    /// Tells the host that something has changed that is saved and no parameter, where no callback does that.
    /// [any thread]
    fn mark_dirty(&self) {}
}

/// What the host has tied to a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tie {
    /// A controller.
    Mapping,
    /// Automation.
    Automation,
}

/// A request for the host's menu of one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MenuRequest {
    /// Id of the parameter.
    pub id: &'static str,
    /// Place in the plugin's window, pixels.
    pub at: (i32, i32),
}

/// The link of one plugin instance.
#[derive(Default)]
pub struct HostLink {
    calls: OnceLock<Box<dyn HostCalls>>,
    may_sleep: AtomicBool,
    /// How often a status text has changed.
    texts: AtomicU32,
    /// How often the plugin itself has moved parameters.
    values: AtomicU32,
    /// How often something has changed that is saved and no parameter.
    states: AtomicU32,
    has_menu: AtomicBool,
    menu: Mutex<Option<MenuRequest>>,
    marks: Mutex<BTreeMap<(&'static str, u8), Mark>>,
}

impl HostLink {
    /// Connects a format's layer. Only the first call has an effect.
    pub fn connect(&self, calls: Box<dyn HostCalls>) {
        let _ = self.calls.set(calls);
    }

    /// Something happened beside the host's events that must be heard.
    pub fn wake(&self) {
        if let Some(calls) = self.calls.get() {
            calls.request_process();
        }
    }

    /// The host is to be told what has changed.
    pub fn tell(&self) {
        if let Some(calls) = self.calls.get() {
            calls.request_callback();
        }
    }

    /// Whether the host may stop processing until the next event. [audio thread]
    pub fn set_may_sleep(&self, may_sleep: bool) {
        self.may_sleep.store(may_sleep, Ordering::Relaxed);
    }

    /// See [`set_may_sleep`](Self::set_may_sleep).
    pub fn may_sleep(&self) -> bool {
        self.may_sleep.load(Ordering::Relaxed)
    }

    /// A status text has changed.
    pub fn text_changed(&self) {
        self.texts.fetch_add(1, Ordering::Relaxed);
        self.tell();
    }

    /// How often a status text has changed; the number wraps around.
    pub fn texts(&self) -> u32 {
        self.texts.load(Ordering::Relaxed)
    }

    /// The plugin itself has moved parameters: a preset that no hand in the window chose.
    pub fn values_changed(&self) {
        self.values.fetch_add(1, Ordering::Relaxed);
        self.tell();
    }

    /// How often the plugin itself has moved parameters; the number wraps around.
    pub fn values(&self) -> u32 {
        self.values.load(Ordering::Relaxed)
    }

    /// Something has changed that is saved and no parameter: a project that was saved is no longer as it is.
    pub fn state_changed(&self) {
        self.states.fetch_add(1, Ordering::Relaxed);
        if let Some(calls) = self.calls.get() {
            calls.request_callback();
            calls.mark_dirty();
        }
    }

    /// How often that has happened; the number wraps around.
    pub fn states(&self) -> u32 {
        self.states.load(Ordering::Relaxed)
    }

    /// Whether the host opens menus of its own in the plugin's window.
    pub fn set_has_menu(&self, has_menu: bool) {
        self.has_menu.store(has_menu, Ordering::Relaxed);
    }

    /// See [`set_has_menu`](Self::set_has_menu).
    pub fn has_menu(&self) -> bool {
        self.has_menu.load(Ordering::Relaxed)
    }

    /// Asks for the host's menu. Nothing happens if the host has none.
    pub fn ask_menu(&self, request: MenuRequest) {
        if self.has_menu() {
            *self.menu.lock().unwrap_or_else(PoisonError::into_inner) = Some(request);
            self.tell();
        }
    }

    /// The latest request for the menu, once.
    pub fn take_menu(&self) -> Option<MenuRequest> {
        self.menu.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// The host has tied something to a parameter, or nothing any more.
    pub fn set_mark(&self, id: &'static str, tie: Tie, mark: Option<Mark>) {
        let mut marks = self.marks.lock().unwrap_or_else(PoisonError::into_inner);
        match mark {
            Some(mark) => marks.insert((id, tie as u8), mark),
            None => marks.remove(&(id, tie as u8)),
        };
    }

    /// What the host has tied to a parameter, controllers first.
    pub fn marks(&self, id: &str) -> Vec<Mark> {
        let marks = self.marks.lock().unwrap_or_else(PoisonError::into_inner);
        marks.iter().filter(|((of, _), _)| *of == id).map(|(_, mark)| mark.clone()).collect()
    }
}

impl std::fmt::Debug for HostLink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HostLink").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[derive(Default)]
    struct Asked([AtomicU32; 2]);

    impl HostCalls for Arc<Asked> {
        fn request_process(&self) {
            self.0[0].fetch_add(1, Ordering::Relaxed);
        }
        fn request_callback(&self) {
            self.0[1].fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn without_a_host_nothing_happens_and_with_one_it_is_asked() {
        let (link, asked) = (HostLink::default(), Arc::<Asked>::default());
        let request = MenuRequest { id: "gain", at: (3, 4) };
        link.wake();
        link.ask_menu(request);
        assert_eq!(link.take_menu(), None, "no menu");
        link.connect(Box::new(asked.clone()));
        link.set_has_menu(true);
        link.wake();
        link.text_changed();
        link.ask_menu(request);
        assert_eq!((link.take_menu(), link.take_menu()), (Some(request), None));
        assert_eq!(asked.0.each_ref().map(|count| count.load(Ordering::Relaxed)), [1, 2]);
        assert_eq!(link.texts(), 1);
    }

    #[test]
    fn marks_come_and_go() {
        let link = HostLink::default();
        let mark = |text: &str| Mark { colour: Some([1, 2, 3]), text: text.to_owned() };
        link.set_mark("gain", Tie::Automation, Some(mark("automated")));
        link.set_mark("gain", Tie::Mapping, Some(mark("knob 3")));
        assert_eq!(link.marks("gain"), [mark("knob 3"), mark("automated")]);
        assert!(link.marks("lip").is_empty());
        link.set_mark("gain", Tie::Mapping, None);
        assert_eq!(link.marks("gain"), [mark("automated")]);
    }
}
