//! What the host has tied to parameters, for the window to show.

use std::ffi::c_char;

use clap_sys::color::clap_color;
use clap_sys::ext::param_indication::{
    CLAP_PARAM_INDICATION_AUTOMATION_OVERRIDING, CLAP_PARAM_INDICATION_AUTOMATION_PLAYING,
    CLAP_PARAM_INDICATION_AUTOMATION_PRESENT, CLAP_PARAM_INDICATION_AUTOMATION_RECORDING,
    clap_plugin_param_indication,
};
use clap_sys::id::clap_id;
use clap_sys::plugin::clap_plugin;

use super::instance::Instance;
use super::text;
use crate::editor::controls::Mark;
use crate::plugin::host_link::Tie;

pub static PARAM_INDICATION: clap_plugin_param_indication =
    clap_plugin_param_indication { set_mapping: Some(set_mapping), set_automation: Some(set_automation) };

/// # Safety
/// `plugin` is the host's pointer; `colour` is null or valid.
unsafe fn set(
    plugin: *const clap_plugin,
    id: clap_id,
    tie: Tie,
    text: Option<String>,
    colour: *const clap_color,
) {
    // SAFETY: as above.
    let (this, colour) = unsafe { (Instance::of(plugin), colour.as_ref()) };
    let Some(this) = this else { return };
    let Some(entry) = this.entries.get(&id) else { return };
    // What is wholly transparent is left to the plugin.
    let colour =
        colour.filter(|colour| colour.alpha > 0).map(|colour| [colour.red, colour.green, colour.blue]);
    let mark = text.map(|text| Mark { colour, text });
    this.introduced.params.host.set_mark(entry.parameter.id, tie, mark);
}

unsafe extern "C" fn set_mapping(
    plugin: *const clap_plugin,
    id: clap_id,
    has_mapping: bool,
    colour: *const clap_color,
    label: *const c_char,
    description: *const c_char,
) {
    // SAFETY: the host's texts are null or end in a null.
    let words = unsafe { [text::read(label), text::read(description)] };
    let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
    let said = if words.is_empty() { "a controller".to_owned() } else { words.join(", ") };
    // SAFETY: the host's pointers.
    unsafe { set(plugin, id, Tie::Mapping, has_mapping.then(|| format!("Mapped: {said}")), colour) };
}

unsafe extern "C" fn set_automation(
    plugin: *const clap_plugin,
    id: clap_id,
    state: u32,
    colour: *const clap_color,
) {
    let said = match state {
        CLAP_PARAM_INDICATION_AUTOMATION_PRESENT => Some("Automated"),
        CLAP_PARAM_INDICATION_AUTOMATION_PLAYING => Some("Automation plays"),
        CLAP_PARAM_INDICATION_AUTOMATION_RECORDING => Some("Automation is recorded"),
        CLAP_PARAM_INDICATION_AUTOMATION_OVERRIDING => Some("Automation is overridden"),
        _ => None,
    };
    // SAFETY: the host's pointers.
    unsafe { set(plugin, id, Tie::Automation, said.map(str::to_owned), colour) };
}
