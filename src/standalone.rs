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
mod held_keys;
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

use crate::editor::connections::{Connections, DeviceChoice};
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
        tell!(
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
    let kept = devices::kept();
    let failed = quit::devices_that_failed();
    let usable = if failed.is_some() { DeviceChoice::default() } else { kept.clone() };
    let mut attempts = args.attempts(&usable);
    if has_window && !args.names_a_place() {
        attempts.push(Attempt::silent());
    }
    // Without this, the program would go on without sound after a panic on a backend's thread.
    let may_try_others = has_window && !args.names_a_place() && usable != DeviceChoice::default();
    std::panic::set_hook(Box::new(move |why| {
        tell!("chalumeau-standalone: {why}");
        if may_try_others && !devices::has_begun() {
            quit::start_without_devices(why.payload_as_str().unwrap_or("for a reason that it does not give"));
        }
        std::process::exit(1);
    }));
    let mut tried: Vec<(Attempt, String)> = Vec::new();
    for attempt in attempts {
        last_error.clear();
        let failed = failed.as_ref().map(|why| format!("The chosen devices do not play ({why})"));
        let problem = problem(&attempt, &tried).or(failed);
        if let Some(problem) = problem.as_ref().filter(|_| !has_window) {
            tell!("chalumeau-standalone: {problem}; other devices: --output-device, --input-device");
        }
        let problem = problem.map(|problem| format!("{problem}. Choose devices in the Instrument view."));
        LaunchOptions::connect(|now| {
            *now = Connections {
                chosen: args.in_window(&attempt, &kept),
                problem,
                devices: now.devices.clone(),
                ..args.connections(&attempt)
            };
        });
        options.microphone.store(args.hears_microphone(&attempt), Ordering::Relaxed);
        // Held while the framework plays.
        let keyboards = args.keyboards(&attempt).map(Keyboards::open);
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
            StandalonePlugin::end();
            // Windows lets only one program at a time open a MIDI input, and the next start wants it.
            drop(keyboards);
            return quit::end(options);
        }
        if options.window_failed.load(Ordering::Relaxed) {
            // It has played without a window, and the framework has logged why there was none.
            StandalonePlugin::end();
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
    tell!("{}", no_backend_message(&tried));
    ExitCode::FAILURE
}

/// What the user is told if this is not what the user has chosen.
fn problem(attempt: &Attempt, tried: &[(Attempt, String)]) -> Option<String> {
    let (wanted, _) = tried.iter().rev().find(|(one, _)| attempt.is_instead && !one.is_instead)?;
    let is_there = |one: &Attempt| (one.backend, &one.output) == (wanted.backend, &wanted.output);
    // The last attempt there says best why: it asks for the least.
    let (_, reason) = tried.iter().rev().find(|(one, _)| is_there(one))?;
    // The framework lists devices after its reason.
    let reason = reason.split(". Available devices are:").next().unwrap_or(reason);
    let name = match (&wanted.output, wanted.backend) {
        (Some(name), _) => name.as_str(),
        (None, Backend::Jack) => "JACK",
        (None, _) => "the system's output",
    };
    let now = match attempt.backend {
        Backend::Dummy => format!("No sound: {name} does not open"),
        _ if is_there(attempt) && (attempt.rate_hz, attempt.block) == (wanted.rate_hz, wanted.block) => {
            "The microphone does not open".to_owned()
        }
        _ if is_there(attempt) => {
            let (rate_hz, block) = (attempt.rate_hz, attempt.block);
            format!("Sound goes to {name} at {rate_hz} Hz in blocks of {block}: the chosen ones are refused")
        }
        Backend::Jack => format!("Sound goes to JACK: {name} does not open"),
        _ => format!("Sound goes to the system's output: {name} does not open"),
    };
    Some(format!("{now} ({reason})"))
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
    tell!("chalumeau-standalone: {asked}; available devices:\n{list}");
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
        let system = || attempt(arguments::SYSTEM);
        let wanted = Attempt {
            output: Some("Card".to_owned()),
            microphone: Some(("Mic".to_owned(), 1)),
            rate_hz: 96_000.0,
            is_instead: false,
            ..system()
        };
        assert_eq!(problem(&wanted, &[]), None);
        let no_mic = (wanted.clone(), "Unknown input device 'Mic'. Available devices are:\nOther".to_owned());
        let here = Attempt { microphone: None, is_instead: true, ..wanted.clone() };
        assert_eq!(
            problem(&here, std::slice::from_ref(&no_mic)).unwrap(),
            "The microphone does not open (Unknown input device 'Mic')"
        );
        let no_rate = (here.clone(), "no such rate".to_owned());
        let slower = Attempt { rate_hz: 48_000.0, ..here };
        assert_eq!(
            problem(&slower, &[no_mic.clone(), no_rate.clone()]).unwrap(),
            "Sound goes to Card at 48000 Hz in blocks of 256: the chosen ones are refused (no such rate)"
        );
        let no_card = (slower, "busy".to_owned());
        assert_eq!(
            problem(&system(), &[no_mic, no_rate, no_card]).unwrap(),
            "Sound goes to the system's output: Card does not open (busy)"
        );
        // Automatic has tried JACK before the sound card.
        let usual = |backend| Attempt { is_instead: false, ..attempt(backend) };
        let jack = (usual(Backend::Jack), "no server".to_owned());
        assert_eq!(problem(&usual(arguments::SYSTEM), std::slice::from_ref(&jack)), None);
        assert_eq!(
            problem(&Attempt::silent(), &[jack, (usual(arguments::SYSTEM), "no card".to_owned())]).unwrap(),
            "No sound: the system's output does not open (no card)"
        );
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
