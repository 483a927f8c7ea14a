//! The end of the program: on Ctrl-C and its like, or to start again with other devices.

use std::process::{Command, ExitCode};
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;
use std::time::Duration;

use super::standalone_plugin::StandalonePlugin;
use crate::plugin::launch_options::LaunchOptions;

/// How long the program may take to end by itself. A sound system that has died may never answer, and the framework waits
/// for it.
const PATIENCE: Duration = Duration::from_millis(1_500);
/// How long the knob and the disk may take before that: a feel may be computed just now, a take written.
const KNOB_PATIENCE: Duration = Duration::from_secs(4);

/// Environment variable that tells the next start why the chosen devices have stopped this one.
const FAILED: &str = "CHALUMEAU_DEVICES_FAILED";

/// Makes Ctrl-C, and on Unix SIGTERM and SIGHUP, end the program.
///
/// The framework wants to catch the same signals. It comes second, and leaves them to this function.
pub fn listen(options: &'static LaunchOptions) {
    let heard = ctrlc::set_handler(move || {
        options.restart.store(false, Ordering::Relaxed);
        begin(options);
    });
    if let Err(reason) = heard {
        // The system then ends the program at once.
        tell!("chalumeau-standalone: cannot catch Ctrl-C: {reason}");
    }
}

/// Begins the end. A window closes, and the program ends with it; otherwise the program ends here. If it is still there
/// after [`KNOB_PATIENCE`] and [`PATIENCE`], it is ended without what it waits for. Only the first call counts.
pub fn begin(options: &'static LaunchOptions) {
    if options.quit.swap(true, Ordering::Relaxed) {
        return;
    }
    // First: torque waits for nothing.
    StandalonePlugin::interrupt();
    let (saved, is_saved) = channel();
    let _ = std::thread::Builder::new().name("QuitWatch".to_owned()).spawn(move || {
        if is_saved.recv_timeout(KNOB_PATIENCE).is_ok() {
            std::thread::sleep(PATIENCE);
            tell!("chalumeau-standalone: the sound system does not let go; ended without it");
        } else {
            tell!(
                "chalumeau-standalone: the knob, its take or the disk keeps it waiting; ended without them"
            );
        }
        end(options);
        std::process::exit(0);
    });
    // The sound system may never let the program come to the end, at which both are done, too. The session first, which only
    // the disk can hold up, and again with the take that has ended.
    StandalonePlugin::save();
    StandalonePlugin::leave_knob();
    StandalonePlugin::save();
    let _ = saved.send(());
    if !options.has_window || options.window_failed.load(Ordering::Relaxed) {
        StandalonePlugin::end();
        std::process::exit(0);
    }
}

/// Starts the program again if the user wants it, and nobody else has done it. It gets no arguments: the session and the choice of
/// devices are kept.
pub fn end(options: &LaunchOptions) -> ExitCode {
    if options.restart.swap(false, Ordering::Relaxed) { start_again(None) } else { ExitCode::SUCCESS }
}

/// Starts the program again with the usual devices: the chosen ones have stopped it, for the reason `why`.
pub fn start_without_devices(why: &str) {
    start_again(Some(why));
}

/// Why the chosen devices have stopped the program before this start, if they have.
pub fn devices_that_failed() -> Option<String> {
    std::env::var(FAILED).ok()
}

/// Returns only if it has started another process, or cannot start one.
fn start_again(devices_failed: Option<&str>) -> ExitCode {
    let path = match std::env::current_exe() {
        Ok(path) => path,
        Err(reason) => return cannot(&reason),
    };
    let mut program = Command::new(path);
    match devices_failed {
        Some(why) => program.env(FAILED, why.lines().next().unwrap_or_default()),
        None => program.env_remove(FAILED),
    };
    // The same process keeps its terminal.
    #[cfg(unix)]
    return cannot(&std::os::unix::process::CommandExt::exec(&mut program));
    #[cfg(not(unix))]
    match program.spawn() {
        Ok(_) => ExitCode::SUCCESS,
        Err(reason) => cannot(&reason),
    }
}

fn cannot(reason: &std::io::Error) -> ExitCode {
    tell!("chalumeau-standalone: cannot start again: {reason}. The next start uses the chosen devices");
    ExitCode::FAILURE
}
