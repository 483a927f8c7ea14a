//! The plugin as a program of its own: its window, JACK or the system's sound, MIDI in and out.
//!
//! The framework opens one backend. Asked for *auto*, it may silently choose one that makes no sound. So this program
//! tries each backend by itself. If none opens, it prints which ones it tried, why they failed, and what to do.
//!
//! - `arguments`: the command line; `log`: what the framework logs; `quit`: the end on Ctrl-C
//! - `standalone_plugin`: the plugin as the framework runs it here; `session`: what it remembers from one start to the next
//! - `jack`: plays to a JACK server, and survives its death
//! - `keyboards`: opens the system's MIDI inputs where JACK does not play

mod arguments;
mod jack;
mod keyboards;
mod log;
mod quit;
mod session;
mod standalone_plugin;

use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Parser;
use nice_plug::prelude::nice_export_standalone_with_args;

use crate::plugin::launch_options::LaunchOptions;
use arguments::{Args, Backend};
use jack::{JackClient, JackLink};
use keyboards::Keyboards;
use standalone_plugin::StandalonePlugin;

/// Reads the arguments and plays until the user quits. Exit codes: 0, it has played; 1, no backend opened; 2, a mistake in
/// the arguments.
pub fn main() -> ExitCode {
    let args = Args::parse();
    let last_error = log::start();
    let lacks_display = !args.no_window && lacks_display();
    if lacks_display {
        eprintln!(
            "chalumeau-standalone: no display (DISPLAY is not set), so it plays without a window; press Ctrl-C to quit"
        );
    }
    let options = LaunchOptions {
        instrument: args.instrument.clone(),
        a4_hz: args.a4,
        microphone: args.has_microphone(),
        has_window: !args.no_window && !lacks_display,
        quit: AtomicBool::new(false),
        window_failed: AtomicBool::new(false),
        connections: Mutex::default(),
    }
    .set();
    quit::listen(options);
    if args.new_session {
        session::set_aside();
    }
    // Without this, the program would go on without sound after a panic on a backend's thread.
    std::panic::set_hook(Box::new(|why| {
        eprintln!("chalumeau-standalone: {why}");
        std::process::exit(1);
    }));
    let mut tried = Vec::new();
    let tries = args.backends().into_iter();
    for (backend, inputs) in tries.flat_map(|one| args.inputs(one).iter().map(move |&inputs| (one, inputs))) {
        last_error.clear();
        LaunchOptions::connect(|now| *now = args.connections(backend));
        // Held while the framework plays.
        let _keyboards = args.keyboards(backend).map(Keyboards::open);
        let words = match (backend == Backend::Jack).then(JackClient::open) {
            None => args.for_framework(backend, args.sample_rate, inputs),
            Some(Ok(client)) => {
                let words = args.for_framework(Backend::Dummy, client.rate_hz(), 0);
                LaunchOptions::connect(|now| now.sound = format!("JACK, {} Hz", client.rate_hz()));
                JackLink::offer(client, args.jack_ports());
                words
            }
            Some(Err(reason)) => {
                tried.push((backend, reason));
                continue;
            }
        };
        if nice_export_standalone_with_args::<StandalonePlugin, _>(words) {
            return ExitCode::SUCCESS;
        }
        if options.window_failed.load(Ordering::Relaxed) {
            // It has played without a window, and the framework has logged why there was none.
            return ExitCode::SUCCESS;
        }
        let reason = last_error.get().unwrap_or_else(|| "it gave no reason".to_owned());
        if let Some(code) = device_list_answer(&reason) {
            return code;
        }
        tried.push((backend, reason));
    }
    eprintln!("{}", no_backend_message(&tried));
    ExitCode::FAILURE
}

/// Whether windows need X11 here and it is missing.
fn lacks_display() -> bool {
    cfg!(all(unix, not(target_os = "macos")))
        && std::env::var_os("DISPLAY").is_none_or(|name| name.is_empty())
}

/// The framework answers an unknown device name with a list of all devices. An empty name asks for that list, so it is an
/// answer then, and an error otherwise. `None` if `reason` has no such list.
fn device_list_answer(reason: &str) -> Option<ExitCode> {
    let (asked, list) = reason.split_once(". Available devices are:")?;
    let list = list.trim_matches('\n');
    let list = if list.is_empty() { "(none)" } else { list };
    if asked.ends_with("''") {
        println!("{list}");
        return Some(ExitCode::SUCCESS);
    }
    eprintln!("chalumeau-standalone: {asked}; available devices:\n{list}");
    Some(ExitCode::from(2))
}

/// Which backends were tried, why they failed, what to do.
fn no_backend_message(tried: &[(Backend, String)]) -> String {
    let mut text = "chalumeau-standalone: no sound output opens".to_owned();
    for (backend, reason) in tried {
        text += &format!("\n  tried {}: {reason}", backend.name());
        text += &format!("\n    {}", backend.remedy());
    }
    text + "\n  without sound: --backend dummy; into a file: chalumeau render"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_name_asks_and_a_wrong_one_errs() {
        let said = |name: &str| format!("Unknown output device '{name}'. Available devices are:\nFront");
        assert_eq!(device_list_answer(&said("")), Some(ExitCode::SUCCESS));
        assert_eq!(device_list_answer(&said("Back")), Some(ExitCode::from(2)));
        assert_eq!(device_list_answer("No default audio output device available"), None);
    }

    #[test]
    fn the_message_says_what_was_tried_why_it_failed_and_what_to_do() {
        let text = no_backend_message(&[
            (Backend::Jack, "no JACK server is running".to_owned()),
            (arguments::SYSTEM, "no card".to_owned()),
        ]);
        for word in ["tried jack: no JACK server is running", "no card", "--output-device", "--backend dummy"]
        {
            assert!(text.contains(word), "{text}");
        }
    }
}
