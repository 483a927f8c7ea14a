//! `clap.preset-discovery-factory` and `clap.preset-load`: a host lists the presets in its own browser, and loads them.
//!
//! Factory presets are in the plugin, and their name is the key to load them. The user's are files in one folder, if it
//! exists. Loading puts a preset on the parameters; the host is told to read them again.

use std::ffi::{CStr, CString, c_char, c_void};
use std::path::Path;

use clap_sys::ext::preset_load::clap_plugin_preset_load;
use clap_sys::factory::preset_discovery::{
    CLAP_PRESET_DISCOVERY_IS_FACTORY_CONTENT, CLAP_PRESET_DISCOVERY_IS_USER_CONTENT,
    CLAP_PRESET_DISCOVERY_LOCATION_FILE, CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN,
    clap_preset_discovery_factory, clap_preset_discovery_filetype, clap_preset_discovery_indexer,
    clap_preset_discovery_location, clap_preset_discovery_location_kind,
    clap_preset_discovery_metadata_receiver, clap_preset_discovery_provider,
    clap_preset_discovery_provider_descriptor,
};
use clap_sys::plugin::clap_plugin;
use clap_sys::universal_plugin_id::clap_universal_plugin_id;
use clap_sys::version::CLAP_VERSION;

use super::instance::Instance;
use crate::identity;
use crate::presets::user_folder::{self, UserFolder};
use crate::presets::{Preset, factory};

/// The factory of the one provider.
pub static DISCOVERY: clap_preset_discovery_factory = clap_preset_discovery_factory {
    count: Some(count),
    get_descriptor: Some(descriptor),
    create: Some(create),
};

/// Loads a preset that the provider has listed.
pub static PRESET_LOAD: clap_plugin_preset_load =
    clap_plugin_preset_load { from_location: Some(from_location) };

const PROVIDER_ID: &CStr = c"chalumeau.presets";

static DESCRIPTOR: clap_preset_discovery_provider_descriptor = clap_preset_discovery_provider_descriptor {
    clap_version: CLAP_VERSION,
    id: PROVIDER_ID.as_ptr(),
    name: c"Chalumeau presets".as_ptr(),
    vendor: c"Chalumeau".as_ptr(),
};

/// A provider as a host holds it. `raw` stays first: the host's pointer to it is a pointer to this.
#[repr(C)]
struct Provider {
    raw: clap_preset_discovery_provider,
    indexer: *const clap_preset_discovery_indexer,
}

unsafe extern "C" fn count(_factory: *const clap_preset_discovery_factory) -> u32 {
    1
}

unsafe extern "C" fn descriptor(
    _factory: *const clap_preset_discovery_factory,
    index: u32,
) -> *const clap_preset_discovery_provider_descriptor {
    if index == 0 { &raw const DESCRIPTOR } else { std::ptr::null() }
}

unsafe extern "C" fn create(
    _factory: *const clap_preset_discovery_factory,
    indexer: *const clap_preset_discovery_indexer,
    id: *const c_char,
) -> *const clap_preset_discovery_provider {
    // SAFETY: a host's id is null or ends in a null.
    if indexer.is_null() || id.is_null() || unsafe { CStr::from_ptr(id) } != PROVIDER_ID {
        return std::ptr::null();
    }
    let raw = clap_preset_discovery_provider {
        desc: &raw const DESCRIPTOR,
        provider_data: std::ptr::null_mut(),
        init: Some(init),
        destroy: Some(destroy),
        get_metadata: Some(get_metadata),
        get_extension: Some(get_extension),
    };
    Box::into_raw(Box::new(Provider { raw, indexer })).cast()
}

/// A text for the host; what is inside a preset holds no null.
fn text(text: &str) -> CString {
    CString::new(text).unwrap_or_default()
}

unsafe extern "C" fn init(provider: *const clap_preset_discovery_provider) -> bool {
    // SAFETY: the host's pointer is ours, and the indexer outlives the provider.
    let Some(indexer) =
        (unsafe { provider.cast::<Provider>().as_ref().and_then(|this| this.indexer.as_ref()) })
    else {
        return false;
    };
    let Some(declare) = indexer.declare_location else { return false };
    let of_plugin = clap_preset_discovery_location {
        flags: CLAP_PRESET_DISCOVERY_IS_FACTORY_CONTENT,
        name: c"Factory presets".as_ptr(),
        kind: CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN,
        location: std::ptr::null(),
    };
    // SAFETY: everything outlives the call; so below.
    if !unsafe { declare(indexer, &raw const of_plugin) } {
        return false;
    }
    let Some(folder) = UserFolder::system().filter(|folder| folder.path().is_dir()) else { return true };
    let Some(path) = folder.path().to_str().map(text) else { return true };
    let files = clap_preset_discovery_filetype {
        name: c"Chalumeau preset".as_ptr(),
        description: c"Chalumeau preset".as_ptr(),
        file_extension: c"toml".as_ptr(),
    };
    let of_user = clap_preset_discovery_location {
        flags: CLAP_PRESET_DISCOVERY_IS_USER_CONTENT,
        name: c"Your presets".as_ptr(),
        kind: CLAP_PRESET_DISCOVERY_LOCATION_FILE,
        location: path.as_ptr(),
    };
    if let Some(declare_files) = indexer.declare_filetype {
        // SAFETY: as above. A host that takes no files still lists the factory presets.
        let _ = unsafe { declare_files(indexer, &raw const files) && declare(indexer, &raw const of_user) };
    }
    true
}

unsafe extern "C" fn destroy(provider: *const clap_preset_discovery_provider) {
    if !provider.is_null() {
        // SAFETY: `create` boxed it, and the host does not use it any more.
        drop(unsafe { Box::from_raw(provider.cast::<Provider>().cast_mut()) });
    }
}

unsafe extern "C" fn get_extension(
    _provider: *const clap_preset_discovery_provider,
    _id: *const c_char,
) -> *const c_void {
    std::ptr::null()
}

unsafe extern "C" fn get_metadata(
    _provider: *const clap_preset_discovery_provider,
    kind: clap_preset_discovery_location_kind,
    location: *const c_char,
    receiver: *const clap_preset_discovery_metadata_receiver,
) -> bool {
    // SAFETY: the host's receiver is valid for this call.
    let Some(to) = (unsafe { receiver.as_ref() }) else { return false };
    if kind == CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN {
        // SAFETY: as above.
        return factory::all().iter().all(|preset| unsafe { tell(to, preset, true) });
    }
    // SAFETY: a host's location is null or ends in a null.
    match unsafe { file(kind, location) } {
        // SAFETY: as above.
        Ok(preset) => unsafe { tell(to, &preset, false) },
        Err(reason) => {
            let message = text(&reason);
            // SAFETY: as above; the message outlives the call.
            to.on_error.inspect(|on_error| unsafe { on_error(to, 0, message.as_ptr()) });
            false
        }
    }
}

/// The preset in a file of the user's.
///
/// # Safety
/// `location` is null or ends in a null.
unsafe fn file(kind: clap_preset_discovery_location_kind, location: *const c_char) -> Result<Preset, String> {
    if kind != CLAP_PRESET_DISCOVERY_LOCATION_FILE || location.is_null() {
        return Err("a preset is in the plugin or in a file".to_owned());
    }
    // SAFETY: the caller's.
    let path =
        unsafe { CStr::from_ptr(location) }.to_str().map_err(|_| "the path is not UTF-8".to_owned())?;
    user_folder::read_file(Path::new(path)).map_err(|reason| format!("{path}: {reason}"))
}

/// Hands one preset to a host; whether the host goes on.
///
/// # Safety
/// `to` is the host's receiver.
unsafe fn tell(to: &clap_preset_discovery_metadata_receiver, preset: &Preset, is_factory: bool) -> bool {
    let name = text(&preset.name);
    // A file holds one preset, which needs no key.
    let key = if is_factory { name.as_ptr() } else { std::ptr::null() };
    // SAFETY: the receiver is the caller's, and every text outlives its call; so below.
    if !to.begin_preset.is_some_and(|begin| unsafe { begin(to, name.as_ptr(), key) }) {
        return false;
    }
    let own_id = text(identity::CLAP_ID);
    let id = clap_universal_plugin_id { abi: c"clap".as_ptr(), id: own_id.as_ptr() };
    let flags = if is_factory {
        CLAP_PRESET_DISCOVERY_IS_FACTORY_CONTENT
    } else {
        CLAP_PRESET_DISCOVERY_IS_USER_CONTENT
    };
    let (author, shows) = (text(&preset.author), text(&preset.shows));
    // SAFETY: as above.
    unsafe {
        to.add_plugin_id.inspect(|add| add(to, &raw const id));
        to.set_flags.inspect(|set| set(to, flags));
        to.add_creator.inspect(|add| add(to, author.as_ptr()));
        to.set_description.inspect(|set| set(to, shows.as_ptr()));
        for tag in preset.tags.iter().map(|tag| text(tag)) {
            to.add_feature.inspect(|add| add(to, tag.as_ptr()));
        }
    }
    true
}

/// [main thread]
unsafe extern "C" fn from_location(
    plugin: *const clap_plugin,
    kind: clap_preset_discovery_location_kind,
    location: *const c_char,
    load_key: *const c_char,
) -> bool {
    // SAFETY: the host's pointer is ours.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    // SAFETY: a host's texts are null or end in a null.
    match unsafe { wanted(kind, location, load_key) } {
        Ok(preset) => {
            this.introduced.params.put(&preset);
            this.host.preset_loaded(kind, location, load_key);
            true
        }
        Err(reason) => {
            this.host.preset_failed(kind, location, load_key, &text(&reason));
            false
        }
    }
}

/// The preset that a host asks for.
///
/// # Safety
/// Both texts are null or end in a null.
unsafe fn wanted(
    kind: clap_preset_discovery_location_kind,
    location: *const c_char,
    load_key: *const c_char,
) -> Result<Preset, String> {
    if kind != CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN {
        // SAFETY: the caller's.
        return unsafe { file(kind, location) };
    }
    if load_key.is_null() {
        return Err("a preset of the plugin needs its name as the key".to_owned());
    }
    // SAFETY: the caller's.
    let name = unsafe { CStr::from_ptr(load_key) }.to_string_lossy();
    factory::find(&name).cloned().ok_or_else(|| format!("there is no factory preset {name:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a host was told.
    #[derive(Default)]
    struct Heard {
        locations: Vec<(u32, u32)>,
        names: Vec<String>,
        features: usize,
        errors: Vec<String>,
    }

    fn heard<'a>(data: *mut c_void) -> &'a mut Heard {
        // SAFETY: the tests' own.
        unsafe { &mut *data.cast::<Heard>() }
    }

    unsafe extern "C" fn declare_location(
        indexer: *const clap_preset_discovery_indexer,
        location: *const clap_preset_discovery_location,
    ) -> bool {
        // SAFETY: as above.
        let (indexer, location) = unsafe { (&*indexer, &*location) };
        heard(indexer.indexer_data).locations.push((location.kind, location.flags));
        true
    }

    unsafe extern "C" fn begin_preset(
        receiver: *const clap_preset_discovery_metadata_receiver,
        name: *const c_char,
        key: *const c_char,
    ) -> bool {
        // SAFETY: as above.
        let (to, name) = unsafe { (&*receiver, CStr::from_ptr(name)) };
        // SAFETY: as above.
        assert!(key.is_null() || unsafe { CStr::from_ptr(key) } == name);
        heard(to.receiver_data).names.push(name.to_string_lossy().into_owned());
        true
    }

    unsafe extern "C" fn add_feature(
        receiver: *const clap_preset_discovery_metadata_receiver,
        _feature: *const c_char,
    ) {
        // SAFETY: as above.
        heard(unsafe { (*receiver).receiver_data }).features += 1;
    }

    unsafe extern "C" fn on_error(
        receiver: *const clap_preset_discovery_metadata_receiver,
        _code: i32,
        message: *const c_char,
    ) {
        // SAFETY: as above.
        let (to, message) = unsafe { (&*receiver, CStr::from_ptr(message)) };
        heard(to.receiver_data).errors.push(message.to_string_lossy().into_owned());
    }

    #[test]
    fn a_host_lists_the_presets_and_is_told_of_a_broken_file() {
        let mut told = Heard::default();
        let data = (&raw mut told).cast::<c_void>();
        let indexer = clap_preset_discovery_indexer {
            clap_version: CLAP_VERSION,
            name: c"test".as_ptr(),
            vendor: std::ptr::null(),
            url: std::ptr::null(),
            version: std::ptr::null(),
            indexer_data: data,
            declare_filetype: None,
            declare_location: Some(declare_location),
            declare_soundpack: None,
            get_extension: None,
        };
        let receiver = clap_preset_discovery_metadata_receiver {
            receiver_data: data,
            on_error: Some(on_error),
            begin_preset: Some(begin_preset),
            add_plugin_id: None,
            set_soundpack_id: None,
            set_flags: None,
            add_creator: None,
            set_description: None,
            set_timestamps: None,
            add_feature: Some(add_feature),
            add_extra_info: None,
        };
        let folder = tempfile::tempdir().unwrap();
        let paths = [("good.toml", "format = 1\nname = \"Mine\"\n"), ("bad.toml", "format = 1\n")].map(
            |(name, content)| {
                let path = folder.path().join(name);
                std::fs::write(&path, content).unwrap();
                text(path.to_str().unwrap())
            },
        );
        // SAFETY: the functions above, called as a host calls them.
        unsafe {
            let made = create(&raw const DISCOVERY, &raw const indexer, c"another".as_ptr());
            assert!(made.is_null());
            let made =
                create(&raw const DISCOVERY, &raw const indexer, (*descriptor(&raw const DISCOVERY, 0)).id);
            assert!(init(made));
            let plugin = CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN;
            assert!(get_metadata(made, plugin, std::ptr::null(), &raw const receiver));
            let files = CLAP_PRESET_DISCOVERY_LOCATION_FILE;
            assert!(get_metadata(made, files, paths[0].as_ptr(), &raw const receiver));
            assert!(!get_metadata(made, files, paths[1].as_ptr(), &raw const receiver));
            destroy(made);
            // What was listed is loaded by its key or path, and nothing else is.
            let name = text(&factory::all()[5].name);
            assert_eq!(wanted(plugin, std::ptr::null(), name.as_ptr()).as_ref(), Ok(&factory::all()[5]));
            assert_eq!(wanted(files, paths[0].as_ptr(), std::ptr::null()).unwrap().name, "Mine");
            assert!(wanted(plugin, std::ptr::null(), c"no such".as_ptr()).unwrap_err().contains("no such"));
            assert!(wanted(plugin, std::ptr::null(), std::ptr::null()).is_err());
        }
        assert_eq!(told.locations[0], (1, CLAP_PRESET_DISCOVERY_IS_FACTORY_CONTENT));
        assert_eq!(told.names.len(), factory::all().len() + 1);
        assert_eq!(
            (told.names[0].as_str(), told.names.last().unwrap().as_str()),
            ("B flat clarinet", "Mine")
        );
        assert!(told.features >= factory::all().len());
        assert!(told.errors.len() == 1 && told.errors[0].contains("name is missing"), "{:?}", told.errors);
    }
}
