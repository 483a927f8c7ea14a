//! The host of one instance: its extensions, and the calls that any thread may make.

use std::ffi::{CStr, c_char};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use clap_sys::ext::context_menu::{
    CLAP_CONTEXT_MENU_TARGET_KIND_PARAM, CLAP_EXT_CONTEXT_MENU, CLAP_EXT_CONTEXT_MENU_COMPAT,
    clap_context_menu_target, clap_host_context_menu,
};
use clap_sys::ext::gui::CLAP_EXT_GUI;
use clap_sys::ext::note_name::{CLAP_EXT_NOTE_NAME, clap_host_note_name};
use clap_sys::ext::params::{CLAP_EXT_PARAMS, clap_host_params, clap_param_rescan_flags};
use clap_sys::ext::preset_load::{CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT, clap_host_preset_load};
use clap_sys::ext::state::{CLAP_EXT_STATE, clap_host_state};
use clap_sys::ext::tail::{CLAP_EXT_TAIL, clap_host_tail};
use clap_sys::host::clap_host;
use clap_sys::id::clap_id;

use crate::plugin::host_link::HostCalls;

/// The host.
pub struct Host {
    calls: Calls,
    /// A host may be asked for its extensions from `init` on.
    extensions: OnceLock<Extensions>,
}

/// The calls that CLAP allows from any thread.
#[derive(Clone)]
struct Calls {
    raw: *const clap_host,
    /// Between `activate` and `deactivate`: at another time, asking to process would make the host activate the plugin.
    is_active: Arc<AtomicBool>,
}

#[derive(Default)]
struct Extensions {
    has_gui: bool,
    params: Option<*const clap_host_params>,
    state: Option<*const clap_host_state>,
    tail: Option<*const clap_host_tail>,
    note_name: Option<*const clap_host_note_name>,
    menu: Option<*const clap_host_context_menu>,
    preset_load: Option<*const clap_host_preset_load>,
}

// SAFETY: the host's tables do not change, they live as long as the plugin, and each call below says from which threads CLAP
// allows it.
unsafe impl Send for Extensions {}
// SAFETY: as above.
unsafe impl Sync for Extensions {}
// SAFETY: as above. The plugin's threads that hold this end before the plugin is destroyed.
unsafe impl Send for Calls {}
// SAFETY: as above.
unsafe impl Sync for Calls {}

impl Host {
    /// # Safety
    /// `raw` outlives this.
    pub unsafe fn new(raw: *const clap_host) -> Self {
        Self { calls: Calls { raw, is_active: Arc::default() }, extensions: OnceLock::new() }
    }

    /// Looks for the host's extensions. [main thread, in `init`]
    pub fn query(&self) {
        let menu = self.extension(CLAP_EXT_CONTEXT_MENU);
        let preset_load = self.extension(CLAP_EXT_PRESET_LOAD);
        let _ = self.extensions.set(Extensions {
            has_gui: self.extension::<()>(CLAP_EXT_GUI).is_some(),
            params: self.extension(CLAP_EXT_PARAMS),
            state: self.extension(CLAP_EXT_STATE),
            tail: self.extension(CLAP_EXT_TAIL),
            note_name: self.extension(CLAP_EXT_NOTE_NAME),
            preset_load: preset_load.or_else(|| self.extension(CLAP_EXT_PRESET_LOAD_COMPAT)),
            menu: menu.or_else(|| self.extension(CLAP_EXT_CONTEXT_MENU_COMPAT)),
        });
    }

    fn extension<T>(&self, id: &CStr) -> Option<*const T> {
        // SAFETY: the host lives.
        let found = unsafe { ((*self.raw()).get_extension?)(self.raw(), id.as_ptr()) };
        (!found.is_null()).then_some(found.cast())
    }

    fn known(&self) -> Option<&Extensions> {
        self.extensions.get()
    }

    /// Whether the host opens plugin windows.
    pub fn has_gui(&self) -> bool {
        self.known().is_some_and(|known| known.has_gui)
    }

    /// Whether the host has menus for parameters.
    pub fn has_menu(&self) -> bool {
        self.known().is_some_and(|known| known.menu.is_some())
    }

    /// The plugin is active, or no longer.
    pub fn set_active(&self, is_active: bool) {
        self.calls.is_active.store(is_active, Ordering::Release);
    }

    /// Tells the host to read parameters again. [main thread]
    pub fn rescan_params(&self, flags: clap_param_rescan_flags) {
        if let Some(params) = self.known().and_then(|known| known.params) {
            // SAFETY: the host lives; the caller is on the main thread.
            unsafe { (*params).rescan.inspect(|rescan| rescan(self.raw(), flags)) };
        }
    }

    /// Tells the host that what would be saved has changed. [main thread]
    pub fn mark_dirty(&self) {
        if let Some(state) = self.known().and_then(|known| known.state) {
            // SAFETY: the host lives; the caller is on the main thread.
            unsafe { (*state).mark_dirty.inspect(|mark_dirty| mark_dirty(self.raw())) };
        }
    }

    /// Tells the host that the tail has changed. [audio thread]
    pub fn tail_changed(&self) {
        if let Some(tail) = self.known().and_then(|known| known.tail) {
            // SAFETY: the host lives; the caller is on the audio thread.
            unsafe { (*tail).changed.inspect(|changed| changed(self.raw())) };
        }
    }

    /// Tells the host that keys have other names. [main thread]
    pub fn note_names_changed(&self) {
        if let Some(names) = self.known().and_then(|known| known.note_name) {
            // SAFETY: the host lives; the caller is on the main thread.
            unsafe { (*names).changed.inspect(|changed| changed(self.raw())) };
        }
    }

    /// Opens the host's menu of a parameter at a place in the plugin's window. [main thread]
    pub fn popup(&self, id: clap_id, (x, y): (i32, i32)) {
        let Some(menu) = self.known().and_then(|known| known.menu) else { return };
        let target = clap_context_menu_target { kind: CLAP_CONTEXT_MENU_TARGET_KIND_PARAM, id };
        // SAFETY: the host lives; the caller is on the main thread.
        unsafe {
            if let (Some(can_popup), Some(popup)) = ((*menu).can_popup, (*menu).popup)
                && can_popup(self.raw())
            {
                popup(self.raw(), &raw const target, 0, x, y);
            }
        }
    }

    /// Tells the host that a preset is on the parameters. [main thread]
    pub fn preset_loaded(&self, kind: u32, location: *const c_char, key: *const c_char) {
        if let Some(presets) = self.known().and_then(|known| known.preset_load) {
            // SAFETY: the host lives and gave both texts; the caller is on the main thread.
            unsafe { (*presets).loaded.inspect(|loaded| loaded(self.raw(), kind, location, key)) };
        }
    }

    /// Tells the host why a preset is not. [main thread]
    pub fn preset_failed(&self, kind: u32, location: *const c_char, key: *const c_char, why: &CStr) {
        if let Some(presets) = self.known().and_then(|known| known.preset_load) {
            let why = why.as_ptr();
            // SAFETY: as above.
            unsafe { (*presets).on_error.inspect(|fail| fail(self.raw(), kind, location, key, 0, why)) };
        }
    }

    /// What the plugin's threads may ask at any time.
    pub fn calls(&self) -> impl HostCalls + 'static {
        self.calls.clone()
    }

    fn raw(&self) -> *const clap_host {
        self.calls.raw
    }
}

impl HostCalls for Calls {
    fn request_process(&self) {
        if self.is_active.load(Ordering::Acquire) {
            // SAFETY: the host lives, and allows the call from any thread.
            unsafe { (*self.raw).request_process.inspect(|request| request(self.raw)) };
        }
    }

    fn request_callback(&self) {
        // SAFETY: as above.
        unsafe { (*self.raw).request_callback.inspect(|request| request(self.raw)) };
    }
}
