//! The names and ids by which hosts and saved projects know this plugin. The ids must never change.

/// Name of the plugin, and of its bundles (`bundler.toml`).
pub const NAME: &str = "Chalumeau";
/// Vendor of the plugin.
pub const VENDOR: &str = "Chalumeau";
/// Address of the project: the `repository` field of Cargo.toml, empty until there is a public one.
pub const URL: &str = env!("CARGO_PKG_REPOSITORY");
/// The manual, in the repository; none while there is no public one.
pub const MANUAL_URL: Option<&str> = if URL.is_empty() {
    None
} else {
    Some(concat!(env!("CARGO_PKG_REPOSITORY"), "/blob/main/docs/guide/README.md"))
};
/// Where to ask and to report, in the repository; none while there is no public one.
pub const SUPPORT_URL: Option<&str> =
    if URL.is_empty() { None } else { Some(concat!(env!("CARGO_PKG_REPOSITORY"), "/issues")) };
/// Mail address: none.
pub const EMAIL: &str = "";
/// Version shown to hosts.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Description in plugin browsers.
pub const DESCRIPTION: &str = "A clarinet whose sound is computed from physics";
/// CLAP plugin id.
pub const CLAP_ID: &str = "chalumeau.clarinet";
/// VST3 class id.
pub const VST3_CLASS_ID: [u8; 16] = *b"ChalumeauClarint";
/// Name of the VST3 without MIDI controllers.
pub const NOTES_ONLY_NAME: &str = "Chalumeau (notes only)";
/// VST3 class id of the plugin without MIDI controllers.
pub const NOTES_ONLY_VST3_CLASS_ID: [u8; 16] = *b"ChalumeauNotesOn";
/// Name of the VST3 on the track of a microphone.
pub const BLOWN_NAME: &str = "Chalumeau (microphone)";
/// VST3 class id of the plugin on the track of a microphone.
pub const BLOWN_VST3_CLASS_ID: [u8; 16] = *b"ChalumeauMicroph";
/// Name of the CLAP's side-chain.
pub const MICROPHONE_NAME: &str = "Microphone";
