//! The plugin as a program of its own: its window, JACK or the system's sound, MIDI in and out.
//!
//! The framework opens one backend. Asked for *auto*, it may silently choose one that makes no sound. So this program
//! tries each backend by itself. If none opens, it prints which ones it tried, why they failed, and what to do.
//!
//! - `arguments`: the command line; `log`: what the framework logs; `quit`: the end on Ctrl-C, and the next start
//! - `devices`: lists outputs and inputs for the window, and keeps what the user chooses there
//! - `standalone_plugin`: the plugin as the framework runs it here; `session`: what it remembers from one start to the next
//! - `jack`: plays to a JACK server, and survives its death
//! - `keyboards`: opens the system's MIDI inputs where JACK does not play

mod arguments;
mod devices;
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

use crate::editor::connections::Connections;
use crate::plugin::launch_options::LaunchOptions;
use arguments::{Args, Attempt, Backend};
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
    let has_window = !args.no_window && !lacks_display;
    let options = LaunchOptions {
        instrument: args.instrument.clone(),
        a4_hz: args.a4,
        microphone: AtomicBool::new(false),
        has_window,
        quit: AtomicBool::new(false),
        restart: AtomicBool::new(false),
        window_failed: AtomicBool::new(false),
        connections: Mutex::default(),
        device_tasks: Mutex::default(),
    }
    .set();
    quit::listen(options);
    devices::serve(options);
    if args.new_session {
        session::set_aside();
    }
    // Without this, the program would go on without sound after a panic on a backend's thread.
    std::panic::set_hook(Box::new(|why| {
        eprintln!("chalumeau-standalone: {why}");
        std::process::exit(1);
    }));
    let kept = devices::kept();
    let mut attempts = args.attempts(&kept);
    if has_window && !args.names_a_place() {
        attempts.push(Attempt::silent());
    }
    let mut tried: Vec<(Attempt, String)> = Vec::new();
    for attempt in attempts {
        last_error.clear();
        LaunchOptions::connect(|now| {
            *now = Connections {
                chosen: kept.clone(),
                problem: problem(&attempt, &tried),
                devices: now.devices.clone(),
                ..args.connections(&attempt)
            };
        });
        options.microphone.store(args.hears_microphone(&attempt), Ordering::Relaxed);
        // Held while the framework plays.
        let _keyboards = args.keyboards(&attempt).map(Keyboards::open);
        let words = match (attempt.backend == Backend::Jack).then(JackClient::open) {
            None => args.for_framework(&attempt),
            Some(Ok(client)) => {
                let rate_hz = client.rate_hz();
                LaunchOptions::connect(|now| now.sound = format!("JACK, {rate_hz} Hz"));
                JackLink::offer(client, args.jack_ports());
                args.for_framework(&Attempt { backend: Backend::Dummy, rate_hz, ..attempt.clone() })
            }
            Some(Err(reason)) => {
                tried.push((attempt, reason));
                continue;
            }
        };
        if nice_export_standalone_with_args::<StandalonePlugin, _>(words) {
            return quit::end(options);
        }
        if options.window_failed.load(Ordering::Relaxed) {
            // It has played without a window, and the framework has logged why there was none.
            return ExitCode::SUCCESS;
        }
        let reason = last_error.get().unwrap_or_else(|| "it gave no reason".to_owned());
        if args.names_a_place()
            && let Some(code) = device_list_answer(&reason)
        {
            return code;
        }
        tried.push((attempt, reason));
    }
    eprintln!("{}", no_backend_message(&tried));
    ExitCode::FAILURE
}

/// What the window says if this is not what the user has chosen.
fn problem(attempt: &Attempt, tried: &[(Attempt, String)]) -> Option<String> {
    let (first, reason) = tried.first().filter(|_| attempt.is_instead)?;
    // The framework lists devices after its reason.
    let reason = reason.split(". Available devices are:").next().unwrap_or(reason);
    let now = match attempt.backend {
        Backend::Dummy => "No sound",
        Backend::Jack => "Sound goes to JACK",
        _ => "Sound goes to the system's output",
    };
    let name = match (&first.output, first.backend) {
        (Some(name), _) => name.as_str(),
        (None, Backend::Jack) => "JACK",
        (None, _) => "the system's output",
    };
    Some(format!("{now}: {name} does not open ({reason}). Choose an output in the Instrument view."))
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
fn no_backend_message(tried: &[(Attempt, String)]) -> String {
    let mut text = "chalumeau-standalone: no sound output opens".to_owned();
    let mut said = Vec::new();
    for (Attempt { backend, .. }, reason) in tried {
        // Attempts at other rates fail for the same reason where there is no sound card.
        if !said.contains(&(backend, reason)) {
            said.push((backend, reason));
            text += &format!("\n  tried {}: {reason}\n    {}", backend.name(), backend.remedy());
        }
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

    fn attempt(backend: Backend) -> Attempt {
        Attempt { backend, ..Attempt::silent() }
    }

    #[test]
    fn the_window_says_what_does_not_open_and_where_sound_goes_instead() {
        let card =
            Attempt { output: Some("Card".to_owned()), is_instead: false, ..attempt(arguments::SYSTEM) };
        assert_eq!(problem(&card, &[]), None);
        let reason = "Unknown output device 'Card'. Available devices are:\nOther".to_owned();
        let said = problem(&attempt(arguments::SYSTEM), &[(card.clone(), reason)]).unwrap();
        assert_eq!(
            said,
            "Sound goes to the system's output: Card does not open (Unknown output device 'Card'). Choose an output in the \
             Instrument view."
        );
        // Automatic has tried one of its own.
        let jack = Attempt { is_instead: false, ..attempt(Backend::Jack) };
        assert_eq!(problem(&Attempt { output: None, ..card }, &[(jack, "no server".to_owned())]), None);
    }

    #[test]
    fn the_message_says_what_was_tried_why_it_failed_and_what_to_do() {
        let text = no_backend_message(&[
            (attempt(Backend::Jack), "no JACK server is running".to_owned()),
            (attempt(arguments::SYSTEM), "no card".to_owned()),
        ]);
        for word in ["tried jack: no JACK server is running", "no card", "--output-device", "--backend dummy"]
        {
            assert!(text.contains(word), "{text}");
        }
    }
}
