//! The end of the program on Ctrl-C and its like.

use std::sync::atomic::Ordering;
use std::time::Duration;

use super::standalone_plugin::StandalonePlugin;
use crate::plugin::launch_options::LaunchOptions;

/// How long the program may take to end by itself. A sound system that has died may never answer, and the framework waits
/// for it.
const PATIENCE: Duration = Duration::from_millis(1_500);

/// Makes Ctrl-C, and on Unix SIGTERM and SIGHUP, end the program. A window closes, and the program ends with it; otherwise
/// the program ends here. If it is still there after [`PATIENCE`], it is ended without the sound system.
///
/// The framework wants to catch the same signals. It comes second, and leaves them to this function.
pub fn listen(options: &'static LaunchOptions) {
    let heard = ctrlc::set_handler(move || {
        // Only the first signal counts.
        if options.quit.swap(true, Ordering::Relaxed) {
            return;
        }
        let _ = std::thread::Builder::new().name("QuitWatch".to_owned()).spawn(|| {
            std::thread::sleep(PATIENCE);
            eprintln!("chalumeau-standalone: the sound system does not let go; ended without it");
            std::process::exit(0);
        });
        if !options.has_window || options.window_failed.load(Ordering::Relaxed) {
            StandalonePlugin::end();
            std::process::exit(0);
        }
    });
    if let Err(reason) = heard {
        // The system then ends the program at once.
        eprintln!("chalumeau-standalone: cannot catch Ctrl-C: {reason}");
    }
}
