//! The names hosts and saved projects know this plugin by. None of the ids may ever change.

/// Name of the plugin, and of its bundles (`bundler.toml`).
pub const NAME: &str = "Chalumeau";
/// Who makes it.
pub const VENDOR: &str = "Chalumeau";
/// Where it lives: the `repository` field of Cargo.toml, empty until the project has a public address.
pub const URL: &str = env!("CARGO_PKG_REPOSITORY");
/// No mail address is given.
pub const EMAIL: &str = "";
/// Version shown to hosts.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// One line for plugin browsers.
pub const DESCRIPTION: &str = "A clarinet you play by touch";
/// CLAP plugin id.
pub const CLAP_ID: &str = "chalumeau.clarinet";
/// VST3 class id.
pub const VST3_CLASS_ID: [u8; 16] = *b"ChalumeauClarint";
