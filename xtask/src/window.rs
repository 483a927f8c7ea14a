//! The plugin's window: its tests in a host, on a display that nobody sees.

use anyhow::Result;

use crate::display::Display;
use crate::machine;

/// Starts a display and runs `xtask/tests/window.rs` on it.
pub fn test() -> Result<()> {
    let display = Display::start()?;
    let mut command = machine::cargo();
    command
        .args(["test", "-p", "xtask", "--test", "window", "--no-fail-fast", "--"])
        // One after another: they look at one display and move one pointer.
        .args(["--ignored", "--nocapture", "--test-threads=1"])
        .env("CHALUMEAU_CACHE_DIR", machine::target().join("cache"));
    machine::run(display.for_clients(&mut command))
}
