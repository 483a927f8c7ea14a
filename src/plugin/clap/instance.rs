//! One plugin instance as the host holds it: the framework's `clap_plugin` with some functions replaced.

use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};

use clap_sys::ext::audio_ports::CLAP_EXT_AUDIO_PORTS;
use clap_sys::ext::gui::CLAP_EXT_GUI;
use clap_sys::ext::note_name::CLAP_EXT_NOTE_NAME;
use clap_sys::ext::note_ports::CLAP_EXT_NOTE_PORTS;
use clap_sys::ext::param_indication::{CLAP_EXT_PARAM_INDICATION, CLAP_EXT_PARAM_INDICATION_COMPAT};
use clap_sys::ext::params::{
    CLAP_EXT_PARAMS, CLAP_PARAM_RESCAN_INFO, CLAP_PARAM_RESCAN_TEXT, CLAP_PARAM_RESCAN_VALUES,
};
use clap_sys::ext::preset_load::{CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT};
use clap_sys::ext::remote_controls::{CLAP_EXT_REMOTE_CONTROLS, CLAP_EXT_REMOTE_CONTROLS_COMPAT};
use clap_sys::ext::state::CLAP_EXT_STATE;
use clap_sys::ext::state_context::CLAP_EXT_STATE_CONTEXT;
use clap_sys::ext::tail::{CLAP_EXT_TAIL, clap_plugin_tail};
use clap_sys::host::clap_host;
use clap_sys::id::clap_id;
use clap_sys::plugin::clap_plugin;
use clap_sys::process::{
    CLAP_PROCESS_CONTINUE, CLAP_PROCESS_CONTINUE_IF_NOT_QUIET, CLAP_PROCESS_ERROR, CLAP_PROCESS_SLEEP,
    clap_process, clap_process_status,
};
use nice_plug::prelude::{ParamPtr, Params};
use nice_plug::wrapper::clap::Wrapper;

use super::host::Host;
use super::note_names::NoteNames;
use super::out_events::OutEvents;
use super::{
    Introduced, Introduction, audio_ports, indication, note_names, note_ports, params, presets, state,
};
use crate::parameters::{self, InUse, Parameter};
use crate::plugin::host_link::HostCalls;
use crate::plugin::params::BeyondChoice;
use crate::plugin::{Chalumeau, Task};
use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::instrument::Clarinet;

/// A parameter of the framework and what the table says of it.
pub struct Entry {
    /// As the table has it.
    pub parameter: &'static Parameter,
    /// The framework's. `introduced` keeps what it points to.
    pub pointer: ParamPtr,
    /// Steps from one end to the other, for a stepped one.
    pub steps: Option<f64>,
}

/// One instance. `plugin` stays first: the host's pointer to it is a pointer to this.
#[repr(C)]
pub struct Instance {
    plugin: clap_plugin,
    /// The framework's functions. They use nothing of the pointer they get but its `plugin_data`.
    pub inner: clap_plugin,
    pub host: Host,
    pub introduced: Introduced,
    /// All parameters, by the ids that hosts know.
    pub entries: HashMap<clap_id, Entry>,
    pub note_names: Mutex<NoteNames>,
    /// The tail, samples.
    tail: AtomicU32,
    /// What [`asked`](Self::asked) was when the host was last asked for a callback.
    asked: AtomicU32,
    /// The groups of parameters that were in use when the host was last told.
    told_in_use: AtomicU32,
    told_texts: AtomicU32,
    /// How often the plugin had moved parameters when the host was last told.
    told_values: AtomicU32,
    told_states: AtomicU32,
}

static TAIL: clap_plugin_tail = clap_plugin_tail { get: Some(tail) };

impl Instance {
    /// Makes the framework's instance, and one of ours around it. [main thread]
    ///
    /// # Safety
    /// `host` outlives the instance.
    pub unsafe fn create(host: *const clap_host) -> *const clap_plugin {
        // SAFETY: as above.
        let (wrapper, host) = unsafe { (Wrapper::<Chalumeau>::new(host), Host::new(host)) };
        let (tell, told) = mpsc::channel();
        (wrapper.task_executor.lock())(Task::Introduce(Introduction(tell)));
        let Ok(introduced) = told.try_recv() else { return std::ptr::null() };
        let map = introduced.params.param_map();
        let entries = map.iter().filter_map(|(id, pointer, _)| {
            let parameter = parameters::find(id)?;
            let steps = parameter.steps().map(|steps| steps as f64);
            let id = *wrapper.param_ptr_to_hash.get(pointer)?;
            Some((id, Entry { parameter, pointer: *pointer, steps }))
        });
        let entries = entries.collect();
        let inner = *wrapper.clap_plugin.borrow();
        // The framework's `destroy` takes this count back.
        let _ = Arc::into_raw(wrapper);
        let plugin = clap_plugin {
            init: Some(init),
            destroy: Some(destroy),
            activate: Some(activate),
            deactivate: Some(deactivate),
            process: Some(process),
            get_extension: Some(get_extension),
            on_main_thread: Some(on_main_thread),
            ..inner
        };
        let instance = Self {
            plugin,
            inner,
            host,
            introduced,
            entries,
            note_names: Mutex::default(),
            tail: AtomicU32::new(0),
            asked: AtomicU32::new(0),
            told_in_use: AtomicU32::new(0),
            told_texts: AtomicU32::new(0),
            told_values: AtomicU32::new(0),
            told_states: AtomicU32::new(0),
        };
        let (in_use, asked) = (instance.in_use(), instance.asked());
        instance.asked.store(asked, Ordering::Relaxed);
        instance.told_in_use.store(in_use, Ordering::Relaxed);
        Box::into_raw(Box::new(instance)).cast()
    }

    /// The instance behind a host's pointer.
    ///
    /// # Safety
    /// `plugin` is null or came from [`create`](Self::create) and is not destroyed.
    pub unsafe fn of<'a>(plugin: *const clap_plugin) -> Option<&'a Self> {
        // SAFETY: `plugin` is the first field.
        unsafe { plugin.cast::<Self>().as_ref() }
    }

    /// One of the framework's extensions.
    ///
    /// # Safety
    /// `T` is the type of the extension `id`.
    pub unsafe fn inner_extension<T>(&self, id: &CStr) -> Option<&T> {
        // SAFETY: the framework's instance lives as long as this one, and its tables with it.
        unsafe { self.inner.get_extension?(&raw const self.plugin, id.as_ptr()).cast::<T>().as_ref() }
    }

    /// The id by which hosts know a parameter.
    pub fn id_of(&self, parameter: &str) -> Option<clap_id> {
        self.entries.iter().find(|(_, entry)| entry.parameter.id == parameter).map(|(id, _)| *id)
    }

    /// The groups of parameters that have an effect now, a bit each. Real-time safe.
    fn in_use(&self) -> u32 {
        let all = [InUse::WithKnob, InUse::WithOscKnob, InUse::InStudy];
        all.iter()
            .enumerate()
            .map(|(at, group)| u32::from(self.introduced.params.is_in_use(*group)) << at)
            .sum()
    }

    /// Which parameters have an effect and which notes the keys play, as one number. Real-time safe.
    fn asked(&self) -> u32 {
        let tuning = &self.introduced.params.tuning;
        let beyond = u32::from(tuning.beyond.value() == BeyondChoice::Octave);
        let switches = KeySwitches::from(self.introduced.params.expression.key_switches.value()) as u32;
        (tuning.transpose.value() as u32) << 8 | beyond << 7 | switches << 5 | self.in_use()
    }

    /// After the host has moved parameters: asks for a callback if others are in use now, or if the keys play other notes.
    /// Real-time safe.
    pub fn look_at_params(&self) {
        let asked = self.asked();
        if self.asked.swap(asked, Ordering::Relaxed) != asked {
            self.host.calls().request_callback();
        }
    }

    /// Tells the host what has changed. [main thread]
    pub fn tell_changes(&self) {
        let link = &self.introduced.params.host;
        let (in_use, texts, values) = (self.in_use(), link.texts(), link.values());
        let mut changed = 0;
        if self.told_in_use.swap(in_use, Ordering::Relaxed) != in_use {
            changed |= CLAP_PARAM_RESCAN_INFO;
        }
        if self.told_texts.swap(texts, Ordering::Relaxed) != texts {
            changed |= CLAP_PARAM_RESCAN_TEXT;
        }
        if self.told_values.swap(values, Ordering::Relaxed) != values {
            changed |= CLAP_PARAM_RESCAN_VALUES;
        }
        if changed != 0 {
            self.host.rescan_params(changed);
        }
        let states = link.states();
        if self.told_states.swap(states, Ordering::Relaxed) != states {
            self.host.mark_dirty();
        }
        if self.note_names.lock().unwrap_or_else(PoisonError::into_inner).renew(&self.introduced) {
            self.host.note_names_changed();
        }
        if let Some(request) = link.take_menu()
            && let Some(id) = self.id_of(request.id)
        {
            self.host.popup(id, request.at);
        }
    }
}

unsafe extern "C" fn init(plugin: *const clap_plugin) -> bool {
    // SAFETY: the host's pointer is ours; so below.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    this.host.query();
    let link = &this.introduced.params.host;
    link.connect(Box::new(this.host.calls()));
    link.set_has_menu(this.host.has_menu());
    let _ = this.note_names.lock().unwrap_or_else(PoisonError::into_inner).renew(&this.introduced);
    // SAFETY: the framework uses the pointer's `plugin_data`, which is its own; so below.
    this.inner.init.is_some_and(|init| unsafe { init(plugin) })
}

unsafe extern "C" fn destroy(plugin: *const clap_plugin) {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return };
    // SAFETY: as above. This ends the plugin's threads.
    this.inner.destroy.inspect(|destroy| unsafe { destroy(plugin) });
    // SAFETY: `create` boxed it, and the host does not use it any more.
    drop(unsafe { Box::from_raw(plugin.cast::<Instance>().cast_mut()) });
}

unsafe extern "C" fn activate(plugin: *const clap_plugin, rate_hz: f64, least: u32, most: u32) -> bool {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    // SAFETY: as above.
    let is_active =
        this.inner.activate.is_some_and(|activate| unsafe { activate(plugin, rate_hz, least, most) });
    this.tail.store((Clarinet::TAIL_S * rate_hz) as u32, Ordering::Relaxed);
    this.host.set_active(is_active);
    is_active
}

unsafe extern "C" fn deactivate(plugin: *const clap_plugin) {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return };
    this.host.set_active(false);
    // SAFETY: as above.
    this.inner.deactivate.inspect(|deactivate| unsafe { deactivate(plugin) });
}

unsafe extern "C" fn process(
    plugin: *const clap_plugin,
    process: *const clap_process,
) -> clap_process_status {
    // SAFETY: as above; `process` is null or the host's for this call.
    let (Some(this), Some(asked)) = (unsafe { (Instance::of(plugin), process.as_ref()) }) else {
        return CLAP_PROCESS_ERROR;
    };
    let last = asked.frames_count.saturating_sub(1);
    // SAFETY: the host's list of events is valid for this call.
    let mut out = unsafe { OutEvents::new(asked.out_events, &this.entries, last) };
    // SAFETY: `asked` is the host's for this call.
    let input = unsafe { audio_ports::input(asked) };
    let asked = clap_process {
        out_events: out.as_host(),
        audio_inputs: &raw const input,
        audio_inputs_count: 1,
        ..*asked
    };
    // SAFETY: as above, and `out` and `input` outlive the call.
    let status =
        this.inner.process.map_or(CLAP_PROCESS_ERROR, |process| unsafe { process(plugin, &raw const asked) });
    out.push_off(&this.introduced.params, last);
    this.look_at_params();
    this.follow_tail(plugin);
    let may_sleep = this.introduced.params.host.may_sleep();
    match status {
        CLAP_PROCESS_CONTINUE | CLAP_PROCESS_CONTINUE_IF_NOT_QUIET if may_sleep => CLAP_PROCESS_SLEEP,
        status => status,
    }
}

impl Instance {
    /// Takes the tail of the last block from the framework. [audio thread]
    fn follow_tail(&self, plugin: *const clap_plugin) {
        // SAFETY: that is the extension's type.
        let inner = unsafe { self.inner_extension::<clap_plugin_tail>(CLAP_EXT_TAIL) };
        // SAFETY: as above.
        let Some(tail) = inner.and_then(|tail| tail.get).map(|get| unsafe { get(plugin) }) else { return };
        if self.tail.swap(tail, Ordering::Relaxed) != tail {
            self.host.tail_changed();
        }
    }
}

unsafe extern "C" fn tail(plugin: *const clap_plugin) -> u32 {
    // SAFETY: as above.
    unsafe { Instance::of(plugin) }.map_or(0, |this| this.tail.load(Ordering::Relaxed))
}

unsafe extern "C" fn on_main_thread(plugin: *const clap_plugin) {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return };
    // SAFETY: as above.
    this.inner.on_main_thread.inspect(|on_main_thread| unsafe { on_main_thread(plugin) });
    this.tell_changes();
}

unsafe extern "C" fn get_extension(plugin: *const clap_plugin, id: *const c_char) -> *const c_void {
    // SAFETY: as above.
    let (Some(this), false) = (unsafe { Instance::of(plugin) }, id.is_null()) else {
        return std::ptr::null();
    };
    let inner = |id: &CStr| {
        // SAFETY: as above.
        this.inner.get_extension.map_or(std::ptr::null(), |get| unsafe { get(plugin, id.as_ptr()) })
    };
    // SAFETY: a host's id ends in a null.
    let id = unsafe { CStr::from_ptr(id) };
    if id == CLAP_EXT_PARAMS {
        (&raw const params::PARAMS).cast()
    } else if id == CLAP_EXT_STATE {
        (&raw const state::STATE).cast()
    } else if id == CLAP_EXT_STATE_CONTEXT {
        (&raw const state::STATE_CONTEXT).cast()
    } else if id == CLAP_EXT_PRESET_LOAD || id == CLAP_EXT_PRESET_LOAD_COMPAT {
        (&raw const presets::PRESET_LOAD).cast()
    } else if id == CLAP_EXT_TAIL {
        (&raw const TAIL).cast()
    } else if id == CLAP_EXT_AUDIO_PORTS {
        (&raw const audio_ports::AUDIO_PORTS).cast()
    } else if id == CLAP_EXT_NOTE_PORTS {
        (&raw const note_ports::NOTE_PORTS).cast()
    } else if id == CLAP_EXT_NOTE_NAME {
        (&raw const note_names::NOTE_NAME).cast()
    } else if id == CLAP_EXT_PARAM_INDICATION || id == CLAP_EXT_PARAM_INDICATION_COMPAT {
        (&raw const indication::PARAM_INDICATION).cast()
    } else if id == CLAP_EXT_GUI && !this.host.has_gui() {
        // The framework asks the host's extension when a window opens, and aborts the host where there is none.
        std::ptr::null()
    } else if id == CLAP_EXT_REMOTE_CONTROLS_COMPAT {
        inner(CLAP_EXT_REMOTE_CONTROLS)
    } else {
        inner(id)
    }
}
