//! Checks of the library, its plugin's description, and what is skipped.

use std::ffi::{CStr, CString};
use std::time::{Duration, Instant};

use chalumeau_test_host::artefacts;
use clack_extensions::audio_ports::{AudioPortFlags, AudioPortInfoBuffer, PluginAudioPorts};
use clack_host::prelude::*;

use super::bench::{Bench, instance, library, plugin_id};

#[test]
fn query_nonexistent_factory() {
    let entry = library();
    let get = entry.raw_entry().get_factory.expect("the library has factories");
    // SAFETY: the entry is initialised, and the name ends with NUL.
    assert!(unsafe { get(c"chalumeau.no-such-factory".as_ptr()) }.is_null());
}

#[test]
fn create_id_with_trailing_garbage() {
    let entry = library();
    let id = plugin_id(&entry);
    let longer = CString::new([id.to_bytes(), b"x"].concat()).unwrap();
    assert!(instance(&entry, &longer).is_err());
    assert!(instance(&entry, &id).is_ok());
}

#[cfg(unix)]
#[test]
fn scan_rtld_now() {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: the file is the plugin this project has just built.
    let library = unsafe { Library::open(Some(artefacts::clap().unwrap()), RTLD_NOW | RTLD_LOCAL) }.unwrap();
    // SAFETY: the type is not used.
    assert!(unsafe { library.get::<*const ()>(b"clap_entry\0") }.is_ok());
    std::mem::forget(library);
}

#[test]
fn scan_time() {
    // Another test of this process may have loaded the library, so a copy is scanned.
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("Copy.clap");
    std::fs::copy(artefacts::clap().unwrap(), &copy).unwrap();
    let began = Instant::now();
    // SAFETY: the file is the plugin this project has just built.
    let entry = unsafe { PluginEntry::load(&copy) }.unwrap();
    let count = entry.get_plugin_factory().unwrap().plugin_descriptors().count();
    let took = began.elapsed();
    std::mem::forget(entry);
    assert_eq!(count, 1);
    assert!(took < Duration::from_millis(100), "{took:?}");
}

#[test]
fn what_is_skipped() {
    let entry = library();
    let get = entry.raw_entry().get_factory.expect("the library has factories");
    for factory in [c"clap.preset-discovery-factory/2", c"clap.preset-discovery-factory/draft-2"] {
        // SAFETY: the entry is initialised, and the name ends with NUL.
        assert!(unsafe { get(factory.as_ptr()) }.is_null(), "check preset-discovery-*");
    }
    let mut bench = Bench::new();
    let raw = bench.instance.raw_instance();
    let extension = raw.get_extension.expect("the plugin has extensions");
    for (name, check) in [
        (c"clap.audio-ports-activation/2", "layout-audio-ports-activation"),
        (c"clap.configurable-audio-ports/1", "layout-configurable-audio-ports"),
    ] {
        // SAFETY: the plugin lives, and the name ends with NUL.
        assert!(unsafe { extension(raw, name.as_ptr()) }.is_null(), "check {check}");
    }
    let handle = bench.instance.plugin_handle();
    let ports: PluginAudioPorts = handle.get_extension().unwrap();
    assert_eq!(ports.count(&handle, true), 0, "check process-audio-denormals");
    let mut buffer = AudioPortInfoBuffer::new();
    let out = ports.get(&handle, 0, false, &mut buffer).unwrap();
    assert!(!out.flags.contains(AudioPortFlags::SUPPORTS_64BITS), "check process-audio-double-*");
}

#[test]
fn descriptor_consistency() {
    let entry = library();
    let factory = entry.get_plugin_factory().unwrap();
    let listed = factory.plugin_descriptors().next().unwrap();
    let bench = Bench::new();
    // SAFETY: the descriptor lives as long as the library, which is never unloaded.
    let own = unsafe { &*bench.instance.raw_instance().desc };
    // SAFETY: the texts of a descriptor end with NUL, or are null.
    let text = |text: *const std::ffi::c_char| (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) });
    assert_eq!(text(own.id), listed.id());
    assert_eq!(text(own.name), listed.name());
    assert_eq!(text(own.vendor), listed.vendor());
    assert_eq!(text(own.version), listed.version());
    assert_eq!(text(own.description), listed.description());
}

fn features() -> Vec<CString> {
    let entry = library();
    let factory = entry.get_plugin_factory().unwrap();
    let features = factory.plugin_descriptors().next().unwrap().features().map(CStr::to_owned).collect();
    features
}

#[test]
fn features_categories() {
    let categories = [c"instrument", c"audio-effect", c"note-effect", c"note-detector", c"analyzer"];
    assert!(features().iter().any(|feature| categories.contains(&feature.as_c_str())));
}

#[test]
fn features_duplicates() {
    let mut all = features();
    let count = all.len();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), count);
}
