//! Where the user's files are: presets, instruments, takes.

use std::path::PathBuf;

/// Environment variable that names a directory to use instead of the system's own; for tests and unusual systems.
pub const VARIABLE: &str = "CHALUMEAU_DATA_DIR";

/// The folder `chalumeau` in the user's data directory, or in the directory that [`VARIABLE`] names; `None` if there is
/// neither.
pub fn folder() -> Option<PathBuf> {
    let chosen = std::env::var_os(VARIABLE).filter(|chosen| !chosen.is_empty()).map(PathBuf::from);
    chosen.or_else(dirs::data_dir).map(|root| root.join("chalumeau"))
}
