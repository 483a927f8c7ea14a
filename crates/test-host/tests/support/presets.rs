//! A host's preset browser, as CLAP has it: it finds the provider, lists its presets, and has the plugin load each.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_void};

use clack_host::prelude::*;
use clap_sys::ext::preset_load::{
    CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT, clap_plugin_preset_load,
};
use clap_sys::factory::preset_discovery::*;
use clap_sys::timestamp::clap_timestamp;
use clap_sys::universal_plugin_id::clap_universal_plugin_id;
use clap_sys::version::CLAP_VERSION;

/// What the provider has told.
#[derive(Default)]
struct Told {
    /// Kinds of the places it has declared.
    places: Vec<clap_preset_discovery_location_kind>,
    /// Names and load keys.
    presets: Vec<(String, CString)>,
    /// Plugins that the presets are for.
    plugins: Vec<String>,
}

/// The text at a host's or plugin's pointer.
///
/// # Safety
/// `text` ends in NUL.
unsafe fn owned(text: *const c_char) -> CString {
    assert!(!text.is_null());
    // SAFETY: the caller's.
    unsafe { CStr::from_ptr(text) }.to_owned()
}

/// # Safety
/// `data` is the `Told` of the crawl.
unsafe fn told<'a>(data: *mut c_void) -> &'a RefCell<Told> {
    // SAFETY: the caller's.
    unsafe { &*data.cast::<RefCell<Told>>() }
}

unsafe extern "C" fn declare_filetype(
    _indexer: *const clap_preset_discovery_indexer,
    filetype: *const clap_preset_discovery_filetype,
) -> bool {
    // SAFETY: the provider's pointer holds for this call; so below.
    unsafe { owned((*filetype).file_extension).as_c_str() == c"toml" }
}

unsafe extern "C" fn declare_location(
    indexer: *const clap_preset_discovery_indexer,
    location: *const clap_preset_discovery_location,
) -> bool {
    // SAFETY: as above.
    unsafe { told((*indexer).indexer_data).borrow_mut().places.push((*location).kind) };
    true
}

unsafe extern "C" fn declare_soundpack(
    _indexer: *const clap_preset_discovery_indexer,
    _soundpack: *const clap_preset_discovery_soundpack,
) -> bool {
    true
}

unsafe extern "C" fn no_extension(
    _indexer: *const clap_preset_discovery_indexer,
    _id: *const c_char,
) -> *const c_void {
    std::ptr::null()
}

unsafe extern "C" fn on_error(
    _receiver: *const clap_preset_discovery_metadata_receiver,
    _os_error: i32,
    message: *const c_char,
) {
    // SAFETY: as above.
    println!("the provider says: {:?}", unsafe { owned(message) });
}

unsafe extern "C" fn begin_preset(
    receiver: *const clap_preset_discovery_metadata_receiver,
    name: *const c_char,
    load_key: *const c_char,
) -> bool {
    // SAFETY: as above.
    let (name, key) = unsafe { (owned(name).into_string().unwrap(), owned(load_key)) };
    // SAFETY: as above.
    unsafe { told((*receiver).receiver_data).borrow_mut().presets.push((name, key)) };
    true
}

unsafe extern "C" fn add_plugin_id(
    receiver: *const clap_preset_discovery_metadata_receiver,
    id: *const clap_universal_plugin_id,
) {
    // SAFETY: as above.
    let id = unsafe { format!("{:?} {:?}", owned((*id).abi), owned((*id).id)) };
    // SAFETY: as above.
    unsafe { told((*receiver).receiver_data).borrow_mut().plugins.push(id) };
}

unsafe extern "C" fn text(_receiver: *const clap_preset_discovery_metadata_receiver, text: *const c_char) {
    // SAFETY: as above.
    assert!(!unsafe { owned(text) }.is_empty());
}

unsafe extern "C" fn flags(_receiver: *const clap_preset_discovery_metadata_receiver, flags: u32) {
    assert_eq!(flags, CLAP_PRESET_DISCOVERY_IS_FACTORY_CONTENT);
}

unsafe extern "C" fn soundpack(
    _receiver: *const clap_preset_discovery_metadata_receiver,
    _id: *const c_char,
) {
}

unsafe extern "C" fn timestamps(
    _receiver: *const clap_preset_discovery_metadata_receiver,
    _creation: clap_timestamp,
    _modification: clap_timestamp,
) {
}

unsafe extern "C" fn extra_info(
    _receiver: *const clap_preset_discovery_metadata_receiver,
    _key: *const c_char,
    _value: *const c_char,
) {
}

/// Lists the factory presets of a library.
fn crawl(entry: &PluginEntry) -> Told {
    let get = entry.raw_entry().get_factory.expect("the library has factories");
    // SAFETY: the entry is initialised, and the names end with NUL.
    let [factory, old] = [CLAP_PRESET_DISCOVERY_FACTORY_ID, CLAP_PRESET_DISCOVERY_FACTORY_ID_COMPAT]
        .map(|name| unsafe { get(name.as_ptr()) });
    assert!(!factory.is_null() && factory == old, "under both names");
    let factory = factory.cast::<clap_preset_discovery_factory>();
    let told = RefCell::new(Told::default());
    let data = (&raw const told).cast_mut().cast::<c_void>();
    let indexer = clap_preset_discovery_indexer {
        clap_version: CLAP_VERSION,
        name: c"checks".as_ptr(),
        vendor: c"Chalumeau".as_ptr(),
        url: c"".as_ptr(),
        version: c"1".as_ptr(),
        indexer_data: data,
        declare_filetype: Some(declare_filetype),
        declare_location: Some(declare_location),
        declare_soundpack: Some(declare_soundpack),
        get_extension: Some(no_extension),
    };
    let receiver = clap_preset_discovery_metadata_receiver {
        receiver_data: data,
        on_error: Some(on_error),
        begin_preset: Some(begin_preset),
        add_plugin_id: Some(add_plugin_id),
        set_soundpack_id: Some(soundpack),
        set_flags: Some(flags),
        add_creator: Some(text),
        set_description: Some(text),
        set_timestamps: Some(timestamps),
        add_feature: Some(text),
        add_extra_info: Some(extra_info),
    };
    // SAFETY: factory, provider, indexer and receiver live until the end of this function.
    unsafe {
        let of = &*factory;
        assert_eq!(of.count.unwrap()(factory), 1);
        let descriptor = of.get_descriptor.unwrap()(factory, 0);
        assert!(of.get_descriptor.unwrap()(factory, 1).is_null());
        let id = owned((*descriptor).id);
        assert!(of.create.unwrap()(factory, &raw const indexer, c"another".as_ptr()).is_null());
        let provider = of.create.unwrap()(factory, &raw const indexer, id.as_ptr());
        let of = &*provider;
        assert_eq!(owned((*of.desc).id), id, "descriptor and provider agree");
        assert!(of.init.unwrap()(provider));
        let kind = CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN;
        assert_eq!(told.borrow().places.iter().filter(|&&place| place == kind).count(), 1);
        assert!(of.get_metadata.unwrap()(provider, kind, std::ptr::null(), &raw const receiver));
        let nowhere = CLAP_PRESET_DISCOVERY_LOCATION_FILE;
        assert!(!of.get_metadata.unwrap()(provider, nowhere, c"/no/such.toml".as_ptr(), &raw const receiver));
        of.destroy.unwrap()(provider);
    }
    told.into_inner()
}

/// Crawls, and has a plugin load each preset by its key, under both names of the extension.
pub fn crawl_and_load<H: HostHandlers>(entry: &PluginEntry, instance: &mut PluginInstance<H>) {
    let told = crawl(entry);
    println!("{} presets", told.presets.len());
    assert!(told.presets.len() >= 48, "{}", told.presets.len());
    assert_eq!(told.plugins.len(), told.presets.len());
    let raw = instance.raw_instance();
    let plugin: *const _ = raw;
    let extension = raw.get_extension.expect("the plugin has extensions");
    for name in [CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT] {
        // SAFETY: the plugin lives, and this is its main thread; texts end in NUL.
        let load = unsafe { extension(plugin, name.as_ptr()).cast::<clap_plugin_preset_load>().as_ref() };
        let from = load.expect("preset-load").from_location.unwrap();
        let put = |key: &CStr| {
            // SAFETY: as above.
            unsafe { from(plugin, CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN, std::ptr::null(), key.as_ptr()) }
        };
        for (name, key) in &told.presets {
            assert!(put(key), "{name}");
        }
        assert!(!put(c"no such preset"));
    }
}
