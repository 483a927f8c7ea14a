//! The audio ports: the sound, and a microphone's side-chain. And what comes in there, made safe for the framework.

use clap_sys::audio_buffer::clap_audio_buffer;
use clap_sys::ext::audio_ports::{CLAP_EXT_AUDIO_PORTS, clap_audio_port_info, clap_plugin_audio_ports};
use clap_sys::plugin::clap_plugin;
use clap_sys::process::clap_process;

use super::instance::Instance;

pub static AUDIO_PORTS: clap_plugin_audio_ports =
    clap_plugin_audio_ports { count: Some(count), get: Some(get) };

/// Ids of the ports. Hosts saved that of the output when there was no input, and the framework would count the input first.
const OUTPUT: u32 = 0;
const INPUT: u32 = 1;

/// The framework's extension.
///
/// # Safety
/// `plugin` is null or the host's pointer to an instance.
unsafe fn inner<'a>(plugin: *const clap_plugin) -> Option<&'a clap_plugin_audio_ports> {
    // SAFETY: as above, and that is the extension's type.
    unsafe { Instance::of(plugin)?.inner_extension(CLAP_EXT_AUDIO_PORTS) }
}

unsafe extern "C" fn count(plugin: *const clap_plugin, is_input: bool) -> u32 {
    // SAFETY: the host's pointer is ours; the framework uses its `plugin_data`, which is its own.
    unsafe { inner(plugin).and_then(|ports| ports.count).map_or(0, |count| count(plugin, is_input)) }
}

unsafe extern "C" fn get(
    plugin: *const clap_plugin,
    index: u32,
    is_input: bool,
    info: *mut clap_audio_port_info,
) -> bool {
    // SAFETY: as above; `info` has room for one, or is null, which the framework refuses.
    unsafe {
        let Some(get) = inner(plugin).and_then(|ports| ports.get) else { return false };
        let is_there = get(plugin, index, is_input, info);
        if is_there {
            (*info).id = if is_input { INPUT } else { OUTPUT };
        }
        is_there
    }
}

/// What a host gives that connects nothing.
const NOTHING: clap_audio_buffer = clap_audio_buffer {
    data32: std::ptr::null_mut(),
    data64: std::ptr::null_mut(),
    channel_count: 0,
    latency: 0,
    constant_mask: 0,
};

/// The first input of a block, or one without samples: the framework reads it whether the host has counted it or not.
///
/// # Safety
/// `process` is the host's for this call.
pub unsafe fn input(process: &clap_process) -> clap_audio_buffer {
    if process.audio_inputs_count == 0 || process.audio_inputs.is_null() {
        return NOTHING;
    }
    // SAFETY: the host has counted it.
    let given = unsafe { *process.audio_inputs };
    // SAFETY: it has as many channels as it says, if any.
    let has_samples =
        !given.data32.is_null() && given.channel_count > 0 && unsafe { !(*given.data32).is_null() };
    if has_samples { given } else { NOTHING }
}
