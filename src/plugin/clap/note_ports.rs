//! The ports of notes: one in, for notes of every dialect that the plugin understands, and one out, for a knob's breath.

use clap_sys::ext::note_ports::{
    CLAP_NOTE_DIALECT_CLAP, CLAP_NOTE_DIALECT_MIDI, CLAP_NOTE_DIALECT_MIDI_MPE, clap_note_dialect,
    clap_note_port_info, clap_plugin_note_ports,
};
use clap_sys::plugin::clap_plugin;

use super::text;

pub static NOTE_PORTS: clap_plugin_note_ports = clap_plugin_note_ports { count: Some(count), get: Some(get) };

/// MPE is MIDI in which each note has a channel of its own: the decoder makes zones from RPN 6.
const IN: clap_note_dialect = CLAP_NOTE_DIALECT_CLAP | CLAP_NOTE_DIALECT_MIDI | CLAP_NOTE_DIALECT_MIDI_MPE;

unsafe extern "C" fn count(_plugin: *const clap_plugin, _is_input: bool) -> u32 {
    1
}

unsafe extern "C" fn get(
    _plugin: *const clap_plugin,
    index: u32,
    is_input: bool,
    info: *mut clap_note_port_info,
) -> bool {
    if index != 0 || info.is_null() {
        return false;
    }
    // The ids and the input's preference are those of the framework, which hosts have saved. CC2 and CC34 are all that
    // leaves the plugin.
    let (supported_dialects, preferred_dialect, shown) = if is_input {
        (IN, CLAP_NOTE_DIALECT_CLAP, "Notes and breath")
    } else {
        (CLAP_NOTE_DIALECT_MIDI, CLAP_NOTE_DIALECT_MIDI, "Breath of the knob")
    };
    let mut name = [0; _];
    text::write(shown, &mut name);
    // SAFETY: `info` has room for one.
    unsafe { *info = clap_note_port_info { id: 0, supported_dialects, preferred_dialect, name } };
    true
}
