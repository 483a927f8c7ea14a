//! Parameters: whole numbers for stepped ones, flags, texts.
//!
//! Hosts get a stepped parameter as a whole number from 0 to its count of steps, and every other one on a scale from 0 to 1.
//! The framework computes both in single precision; here, whole numbers are made whole before they leave. A value is what
//! the host has set, without its modulation.

use std::ffi::{CStr, c_char};

use clap_sys::events::{clap_input_events, clap_output_events};
use clap_sys::ext::params::{
    CLAP_EXT_PARAMS, CLAP_PARAM_IS_ENUM, CLAP_PARAM_IS_HIDDEN, CLAP_PARAM_IS_MODULATABLE,
    CLAP_PARAM_IS_READONLY, CLAP_PARAM_REQUIRES_PROCESS, clap_param_info, clap_param_info_flags,
    clap_plugin_params,
};
use clap_sys::id::clap_id;
use clap_sys::plugin::clap_plugin;

use super::instance::{Entry, Instance};
use super::out_events::OutEvents;
use super::text;
use crate::parameters::{Kind, Parameter};
use crate::plugin::host_link::HostCalls;
use crate::plugin::params::ChalumeauParams;

pub static PARAMS: clap_plugin_params = clap_plugin_params {
    count: Some(count),
    get_info: Some(get_info),
    get_value: Some(get_value),
    value_to_text: Some(value_to_text),
    text_to_value: Some(text_to_value),
    flush: Some(flush),
};

impl Instance {
    fn framework(&self) -> Option<&clap_plugin_params> {
        // SAFETY: that is the extension's type.
        unsafe { self.inner_extension(CLAP_EXT_PARAMS) }
    }
}

impl Entry {
    /// A value of the framework, 0..=1, as hosts get it.
    fn for_host(&self, normalized: f32) -> f64 {
        self.steps.map_or(f64::from(normalized), |steps| (f64::from(normalized) * steps).round())
    }

    /// A host's value as the framework gets it, 0..=1.
    fn for_framework(&self, value: f64) -> f32 {
        match self.steps {
            Some(steps) => (value.round().clamp(0.0, steps) / steps) as f32,
            None => value.clamp(0.0, 1.0) as f32,
        }
    }

    fn text(&self, value: f64) -> String {
        // SAFETY: the instance keeps the parameters.
        unsafe { self.pointer.normalized_value_to_string(self.for_framework(value), true) }
    }

    fn read(&self, text: &str) -> Option<f64> {
        match self.parameter.kind {
            // The framework knows only whole names.
            Kind::Choice(choice) => choice.parse(text).map(|index| index as f64),
            Kind::Status(_) => Some(0.0),
            // SAFETY: as above.
            _ => unsafe { self.pointer.string_to_normalized_value(text) }
                .map(|normalized| self.for_host(normalized)),
        }
    }
}

/// Flags that the framework does not know.
fn flags(parameter: &Parameter, params: &ChalumeauParams) -> clap_param_info_flags {
    let mut flags = match parameter.kind {
        // Every value has a name of its own.
        Kind::Choice(_) => CLAP_PARAM_IS_ENUM,
        Kind::Switch(switch) if switch.on != "On" => CLAP_PARAM_IS_ENUM,
        Kind::Status(_) => CLAP_PARAM_IS_READONLY,
        _ => 0,
    };
    if !params.is_in_use(parameter.in_use) {
        flags |= CLAP_PARAM_IS_HIDDEN;
    }
    // They act by being moved, at their sample.
    if ["breath", "panic"].contains(&parameter.id) {
        flags |= CLAP_PARAM_REQUIRES_PROCESS;
    }
    flags
}

unsafe extern "C" fn count(plugin: *const clap_plugin) -> u32 {
    // SAFETY: the host's pointer is ours; so below.
    unsafe { Instance::of(plugin) }.map_or(0, |this| this.entries.len() as u32)
}

unsafe extern "C" fn get_info(plugin: *const clap_plugin, index: u32, info: *mut clap_param_info) -> bool {
    // SAFETY: as above. The framework's own check lets the index after the last one through.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    if info.is_null() || index as usize >= this.entries.len() {
        return false;
    }
    let Some(framework) = this.framework().and_then(|framework| framework.get_info) else { return false };
    // SAFETY: `info` has room for one.
    if !unsafe { framework(plugin, index, info) } {
        return false;
    }
    // SAFETY: the framework has filled it in.
    let info = unsafe { &mut *info };
    let Some(Entry { parameter, steps, .. }) = this.entries.get(&info.id) else { return false };
    info.flags |= flags(parameter, &this.introduced.params);
    if !parameter.is_restored {
        // A control of the moment has no value that could be offset.
        info.flags &= !CLAP_PARAM_IS_MODULATABLE;
    }
    if steps.is_some() {
        info.default_value = info.default_value.round();
    }
    true
}

unsafe extern "C" fn get_value(plugin: *const clap_plugin, id: clap_id, value: *mut f64) -> bool {
    // SAFETY: as above.
    let Some(entry) = (unsafe { Instance::of(plugin) }).and_then(|this| this.entries.get(&id)) else {
        return false;
    };
    if value.is_null() {
        return false;
    }
    // SAFETY: the instance keeps the parameters; `value` has room for one.
    unsafe { *value = entry.for_host(entry.pointer.unmodulated_normalized_value()) };
    true
}

unsafe extern "C" fn value_to_text(
    plugin: *const clap_plugin,
    id: clap_id,
    value: f64,
    room: *mut c_char,
    size: u32,
) -> bool {
    // SAFETY: as above.
    let Some(entry) = (unsafe { Instance::of(plugin) }).and_then(|this| this.entries.get(&id)) else {
        return false;
    };
    if room.is_null() || size == 0 || !value.is_finite() {
        return false;
    }
    // SAFETY: the host's array has `size` places.
    text::write(&entry.text(value), unsafe { std::slice::from_raw_parts_mut(room, size as usize) });
    true
}

unsafe extern "C" fn text_to_value(
    plugin: *const clap_plugin,
    id: clap_id,
    typed: *const c_char,
    value: *mut f64,
) -> bool {
    // SAFETY: as above.
    let Some(entry) = (unsafe { Instance::of(plugin) }).and_then(|this| this.entries.get(&id)) else {
        return false;
    };
    if typed.is_null() || value.is_null() {
        return false;
    }
    // SAFETY: a host's text ends in a null.
    let read = unsafe { CStr::from_ptr(typed) }.to_str().ok().and_then(|typed| entry.read(typed));
    // SAFETY: `value` has room for one.
    read.is_some_and(|read| unsafe {
        *value = read;
        true
    })
}

unsafe extern "C" fn flush(
    plugin: *const clap_plugin,
    in_: *const clap_input_events,
    out: *const clap_output_events,
) {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return };
    let params = &this.introduced.params;
    // SAFETY: the host's list is valid for this call.
    let mut out = unsafe { OutEvents::new(out, &this.entries, 0) };
    let list = out.as_host();
    // SAFETY: as above, and `out` outlives the call.
    this.framework()
        .and_then(|framework| framework.flush)
        .inspect(|flush| unsafe { flush(plugin, in_, list) });
    params.fall_back();
    out.push_off(params, 0);
    this.look_at_params();
    // What was moved may have to be heard.
    this.host.calls().request_process();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::PARAMETERS;
    use nice_plug::prelude::Params;

    fn entries(params: &ChalumeauParams) -> Vec<Entry> {
        let map = params.param_map();
        let entry = |parameter: &'static Parameter| {
            let (_, pointer, _) = map.iter().find(|(id, ..)| *id == parameter.id).unwrap();
            Entry { parameter, pointer: *pointer, steps: parameter.steps().map(|steps| steps as f64) }
        };
        PARAMETERS.iter().map(entry).collect()
    }

    #[test]
    fn every_step_is_whole_both_ways_and_through_its_text() {
        let params = ChalumeauParams::default();
        let (mut steps, mut texts) = (0, 0);
        for entry in entries(&params) {
            let Some(count) = entry.steps else { continue };
            let id = entry.parameter.id;
            for step in 0..=count as u32 {
                let step = f64::from(step);
                assert_eq!(entry.for_host(entry.for_framework(step)), step, "{id}");
                steps += 1;
                if matches!(entry.parameter.kind, Kind::Status(_)) {
                    continue;
                }
                let text = entry.text(step);
                assert_eq!(entry.read(&text), Some(step), "{id}: {text}");
                for near in [step - 0.3, step + 0.3, step - 1e-7, step + 1e-7] {
                    assert_eq!(entry.text(near), text, "{id}: {near}");
                }
                texts += 1;
            }
        }
        assert!(steps > 150_000 && texts > 150_000, "{steps} steps, {texts} texts");
    }

    #[test]
    fn hosts_read_what_users_type() {
        let params = ChalumeauParams::default();
        let entries = entries(&params);
        for (id, typed, shown) in [
            ("temp", "20 C", "20.0 \u{b0}C"),
            ("temp", "20\u{b0}", "20.0 \u{b0}C"),
            ("bendr", "12 semitones", "12 st"),
            ("bendr", "12", "12 st"),
            ("instr", "Bass", "Bass clarinet"),
            ("instr", "bb clarinet", "B flat clarinet"),
            ("instr", "b-flat", "B flat clarinet"),
            ("hsrc", "CC16", "CC16"),
            ("gain", "\u{2212}3 dB", "-3.0 dB"),
            ("gain", "-3,5db", "-3.5 dB"),
            ("noise", "12.5percent", "12.5 %"),
            ("reedc", "no", "Free"),
            ("oscprt", "99999", "65535"),
        ] {
            let entry = entries.iter().find(|entry| entry.parameter.id == id).unwrap();
            let value = entry.read(typed).unwrap_or_else(|| panic!("{id}: {typed}"));
            assert_eq!(entry.text(value), shown, "{id}: {typed}");
        }
        for (id, typed) in
            [("instr", "clarinet"), ("hsrc", "CC7"), ("bendr", "2.5"), ("temp", "\u{b0}"), ("gain", "-")]
        {
            let entry = entries.iter().find(|entry| entry.parameter.id == id).unwrap();
            assert_eq!(entry.read(typed), None, "{id}: {typed}");
        }
    }

    #[test]
    fn flags_say_what_a_parameter_is() {
        let params = ChalumeauParams::default();
        let of = |id: &str| flags(crate::parameters::find(id).unwrap(), &params);
        assert_eq!(
            [of("instr"), of("reedc"), of("panic")],
            [CLAP_PARAM_IS_ENUM, CLAP_PARAM_IS_ENUM, CLAP_PARAM_REQUIRES_PROCESS]
        );
        assert_eq!([of("kstat"), of("istat")], [CLAP_PARAM_IS_READONLY; 2]);
        assert_eq!([of("gain"), of("bendr"), of("replay")], [0; 3]);
        assert_eq!([of("arm"), of("oscprt"), of("trial")], [CLAP_PARAM_IS_HIDDEN; 3], "no knob, no study");
    }
}
