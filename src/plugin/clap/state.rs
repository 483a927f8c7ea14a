//! Saved states, without the controls of the moment.
//!
//! The framework writes eight bytes of length and then JSON. *Arm knob* and *Record take* may be on while a project is saved,
//! but no loaded state ever has them on: they are written as Off, so that a state that is loaded and saved is the same.
//! A checksum of the bytes stands among them: a state that was damaged on its way is refused as a whole, and the instrument stays as
//! it is. A state without one, written by hand or by an earlier version, is read as it stands.
//! A project, a duplicate and a preset of the host are one state: it has nothing that would belong to one of them alone.

use std::ffi::c_void;
use std::ops::Range;

use clap_sys::ext::state::{CLAP_EXT_STATE, clap_plugin_state};
use clap_sys::ext::state_context::{clap_plugin_state_context, clap_plugin_state_context_type};
use clap_sys::plugin::clap_plugin;
use clap_sys::stream::{clap_istream, clap_ostream};
use crc::{CRC_32_ISO_HDLC, Crc};
use nice_plug::prelude::{PluginState, nice_error};

use super::instance::Instance;
use crate::plugin::host_link::HostCalls;
use crate::plugin::params::without_moments;

pub static STATE: clap_plugin_state = clap_plugin_state { save: Some(save), load: Some(load) };
pub static STATE_CONTEXT: clap_plugin_state_context =
    clap_plugin_state_context { save: Some(save_for), load: Some(load_for) };

/// Bytes of the length that stands before the JSON.
const LENGTH_BYTES: usize = size_of::<u64>();
/// Field with the checksum of the JSON, in which these digits are zeros.
const CHECK: &str = "crc32";
/// What stands before its digits. Nothing else in the JSON reads so: quotes within strings are escaped.
const BEFORE_DIGITS: &[u8] = b"\"crc32\":\"";
const ZEROS: &str = "00000000";
const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
/// Longest state that is read, bytes: a scale and links fit many times.
const BYTES_MOST: usize = 16 << 20;

impl Instance {
    fn framework_state(&self) -> Option<&clap_plugin_state> {
        // SAFETY: that is the extension's type.
        unsafe { self.inner_extension(CLAP_EXT_STATE) }
    }

    /// What the framework saves, with the controls of the moment Off.
    fn saved(&self, plugin: *const clap_plugin) -> Option<Vec<u8>> {
        let mut bytes = Vec::<u8>::new();
        let stream = clap_ostream { ctx: (&raw mut bytes).cast::<c_void>(), write: Some(append) };
        // SAFETY: the stream is valid for this call.
        let is_saved = unsafe { self.framework_state()?.save?(plugin, &raw const stream) };
        let mut state: PluginState =
            serde_json::from_slice(bytes.get(LENGTH_BYTES..).filter(|_| is_saved)?).ok()?;
        without_moments(&mut state);
        state.fields.insert(CHECK.to_owned(), ZEROS.to_owned());
        let mut json = serde_json::to_vec(&state).ok()?;
        let digits = digits(&json)?;
        let check = format!("{:08x}", CRC.checksum(&json));
        json.get_mut(digits)?.copy_from_slice(check.as_bytes());
        Some([&(json.len() as u64).to_le_bytes()[..], &json].concat())
    }
}

/// Where the digits of the checksum stand in the JSON of a state.
fn digits(json: &[u8]) -> Option<Range<usize>> {
    let name = json.windows(BEFORE_DIGITS.len()).position(|bytes| bytes == BEFORE_DIGITS)?;
    let first = name + BEFORE_DIGITS.len();
    (first + ZEROS.len() <= json.len()).then_some(first..first + ZEROS.len())
}

/// Whether the bytes of a state are as they were written, as far as they tell.
fn is_whole(bytes: &[u8]) -> bool {
    let Some((length, json)) = bytes.split_first_chunk::<LENGTH_BYTES>() else { return false };
    // Some hosts hand on more than they were given.
    let Some(json) = usize::try_from(u64::from_le_bytes(*length)).ok().and_then(|length| json.get(..length))
    else {
        return false;
    };
    let Some(digits) = digits(json) else { return serde_json::from_slice::<PluginState>(json).is_ok() };
    let mut digest = CRC.digest();
    for part in [&json[..digits.start], ZEROS.as_bytes(), &json[digits.end..]] {
        digest.update(part);
    }
    json[digits] == *format!("{:08x}", digest.finalize()).as_bytes()
}

/// All that a host's stream has.
///
/// # Safety
/// The stream is valid for this call.
unsafe fn read_all(stream: *const clap_istream) -> Option<Vec<u8>> {
    // SAFETY: the caller's promise.
    let read = unsafe { stream.as_ref()?.read? };
    let (mut all, mut part) = (Vec::new(), [0_u8; 4_096]);
    while all.len() < BYTES_MOST {
        // SAFETY: the host writes at most as many bytes as the part has.
        let count = unsafe { read(stream, part.as_mut_ptr().cast(), part.len() as u64) };
        match usize::try_from(count) {
            Ok(0) => return Some(all),
            Ok(count) => all.extend_from_slice(part.get(..count)?),
            Err(_) => return None,
        }
    }
    None
}

unsafe extern "C" fn take(stream: *const clap_istream, into: *mut c_void, size: u64) -> i64 {
    // SAFETY: the stream is the one of `load`, whose bytes nothing else uses meanwhile.
    let Some(left) = (unsafe { (*stream).ctx.cast::<&[u8]>().as_mut() }) else { return -1 };
    let count = left.len().min(usize::try_from(size).unwrap_or(usize::MAX));
    let (taken, rest) = left.split_at(count);
    // SAFETY: the framework has room for `size` bytes.
    unsafe { std::ptr::copy_nonoverlapping(taken.as_ptr(), into.cast::<u8>(), count) };
    *left = rest;
    i64::try_from(count).unwrap_or(-1)
}

unsafe extern "C" fn append(stream: *const clap_ostream, bytes: *const c_void, size: u64) -> i64 {
    // SAFETY: the stream is the one of `saved`, whose bytes nothing else uses meanwhile.
    let Some(all) = (unsafe { (*stream).ctx.cast::<Vec<u8>>().as_mut() }) else { return -1 };
    let (Ok(count), Ok(written), false) = (usize::try_from(size), i64::try_from(size), bytes.is_null())
    else {
        return -1;
    };
    // SAFETY: the framework hands in `size` bytes.
    all.extend_from_slice(unsafe { std::slice::from_raw_parts(bytes.cast::<u8>(), count) });
    written
}

unsafe extern "C" fn save(plugin: *const clap_plugin, stream: *const clap_ostream) -> bool {
    // SAFETY: the host's pointers: the first is ours, the second valid for this call.
    let (Some(this), Some(write)) =
        (unsafe { (Instance::of(plugin), stream.as_ref().and_then(|stream| stream.write)) })
    else {
        return false;
    };
    let Some(bytes) = this.saved(plugin) else { return false };
    let mut left = &bytes[..];
    while !left.is_empty() {
        // SAFETY: as above. A host may take less than it is offered.
        let taken = unsafe { write(stream, left.as_ptr().cast(), left.len() as u64) };
        match usize::try_from(taken) {
            Ok(taken) if (1..=left.len()).contains(&taken) => left = &left[taken..],
            _ => return false,
        }
    }
    true
}

unsafe extern "C" fn load(plugin: *const clap_plugin, stream: *const clap_istream) -> bool {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    // SAFETY: the host's stream is valid for this call, or null.
    let Some(bytes) = (unsafe { read_all(stream) }).filter(|bytes| is_whole(bytes)) else {
        nice_error!("the saved state is damaged, so nothing of it was taken");
        return false;
    };
    let mut left = &bytes[..];
    let stream = clap_istream { ctx: (&raw mut left).cast::<c_void>(), read: Some(take) };
    // SAFETY: the stream is valid for this call.
    let is_loaded = this
        .framework_state()
        .and_then(|state| state.load)
        .is_some_and(|load| unsafe { load(plugin, &raw const stream) });
    // Other parameters may be in use; hosts load states on the main thread.
    this.look_at_params();
    this.tell_changes();
    this.host.calls().request_process();
    is_loaded
}

unsafe extern "C" fn save_for(
    plugin: *const clap_plugin,
    stream: *const clap_ostream,
    _context: clap_plugin_state_context_type,
) -> bool {
    // SAFETY: as above.
    unsafe { save(plugin, stream) }
}

unsafe extern "C" fn load_for(
    plugin: *const clap_plugin,
    stream: *const clap_istream,
    _context: clap_plugin_state_context_type,
) -> bool {
    // SAFETY: as above.
    unsafe { load(plugin, stream) }
}
