//! The plugin as a program of its own: its window, JACK or the system's sound, MIDI in and out.
//!
//! The framework opens one backend and, asked for *auto*, quietly ends up with one that makes no sound. Here each is
//! tried by itself, and when none opens the user is told which ones, why, and what to do.

mod log;

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use clap::{Parser, ValueEnum};
use nice_plug::prelude::nice_export_standalone_with_args;

use super::Chalumeau;
use super::params::instrument::{Beginning, InstrumentChoice, begin_with};
use crate::identity;
use crate::plugin::window;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::prepare::A4_RANGE_HZ;

const HELP: &str = "\
Examples:
  chalumeau-standalone                                    JACK if a server runs, else the system's sound
  chalumeau-standalone --backend jack --connect-jack-midi-input \"system:midi_capture_1\"
  chalumeau-standalone --instrument bass --a4 442
  chalumeau-standalone --midi-input \"\"                    lists the MIDI inputs
  chalumeau-standalone --output-device \"\"                 lists the sound cards
  chalumeau-standalone --no-window                        MIDI and a knob play it
  chalumeau-standalone --backend dummy                    no sound: a look at the window

A MIDI keyboard, a wind controller, a knob or the keys of the window play it. Breath is CC2 or CC11; until one of them
moves, velocity makes it. Without a display it plays without a window. Closing the window ends it, and Ctrl-C.";

/// Plays Chalumeau, a clarinet made of physics, without a DAW.
#[derive(Parser, Debug)]
#[command(name = "chalumeau-standalone", version, after_help = HELP, max_term_width = 100)]
struct Args {
    /// Where sound and MIDI go.
    #[arg(short, long, default_value = "auto")]
    backend: Backend,
    /// Sample rate, 22050..384000 Hz; JACK has its own.
    #[arg(short = 'r', long, value_name = "HZ", default_value = "48000", value_parser = rate)]
    sample_rate: f32,
    /// Samples of a block, 16..8192; JACK has its own. Fewer are quicker to answer and easier to starve.
    #[arg(short, long, value_name = "SAMPLES", default_value = "256",
          value_parser = clap::value_parser!(u32).range(16..=8192))]
    period_size: u32,
    /// Sound card, by its name; an empty name lists them. Not for JACK.
    #[arg(short, long, value_name = "NAME")]
    output_device: Option<String>,
    /// MIDI input, by its name; an empty name lists them. Not for JACK.
    #[arg(short, long, value_name = "NAME")]
    midi_input: Option<String>,
    /// MIDI output for a knob's breath, by its name; an empty name lists them. Not for JACK.
    #[arg(long, value_name = "NAME")]
    midi_output: Option<String>,
    /// What is played: b-flat, a, e-flat, c, bass, or an instrument file.
    #[arg(short, long, value_name = "NAME|FILE", default_value = "b-flat", value_parser = instrument)]
    instrument: (InstrumentChoice, String),
    /// Pitch of A4, 415..466 Hz.
    #[arg(long, value_name = "HZ", default_value = "440", value_parser = a4)]
    a4: f32,
    /// Plays without a window.
    #[arg(long)]
    no_window: bool,
    /// JACK port that plays it.
    #[arg(long, value_name = "PORT")]
    connect_jack_midi_input: Option<String>,
    /// JACK port that a knob's breath goes to.
    #[arg(long, value_name = "PORT")]
    connect_jack_midi_output: Option<String>,
}

/// Where sound and MIDI go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Backend {
    /// JACK if a server runs, else the system's sound.
    Auto,
    /// A running JACK server, or PipeWire in its place.
    Jack,
    /// ALSA.
    #[cfg(all(unix, not(target_os = "macos")))]
    Alsa,
    /// Core Audio.
    #[cfg(target_os = "macos")]
    CoreAudio,
    /// WASAPI.
    #[cfg(windows)]
    Wasapi,
    /// No sound and no MIDI.
    Dummy,
}

/// The one of this system.
#[cfg(all(unix, not(target_os = "macos")))]
const SYSTEM: Backend = Backend::Alsa;
#[cfg(target_os = "macos")]
const SYSTEM: Backend = Backend::CoreAudio;
#[cfg(windows)]
const SYSTEM: Backend = Backend::Wasapi;

impl Backend {
    /// As the framework's own option has it.
    fn word(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What may help where it does not open.
    fn remedy(self) -> &'static str {
        match self {
            Self::Jack => "start a server (`jackd -d alsa`, or run this under `pw-jack`)",
            Self::Auto | Self::Dummy => "",
            #[allow(unreachable_patterns)]
            _ => {
                "plug in or switch on a sound card, name one with --output-device (\"\" lists them), \
                 or try another --sample-rate or --period-size"
            }
        }
    }
}

fn rate(text: &str) -> Result<f32, String> {
    let (low, high) = chalumeau_core::instrument::model::HOST_RATES_HZ;
    match text.parse::<f32>() {
        Ok(rate_hz) if (low..=high).contains(&f64::from(rate_hz)) => Ok(rate_hz),
        _ => Err(format!("a rate must lie in {low}..{high} Hz")),
    }
}

fn a4(text: &str) -> Result<f32, String> {
    let (low, high) = A4_RANGE_HZ;
    match text.parse::<f32>() {
        Ok(a4_hz) if (low..=high).contains(&f64::from(a4_hz)) => Ok(a4_hz),
        _ => Err(format!("A4 must lie in {low}..{high} Hz")),
    }
}

/// A file is read here already: later nobody could be told what is wrong with it in time.
fn instrument(text: &str) -> Result<(InstrumentChoice, String), String> {
    let named = Bundled::from_id(text).and_then(|bundled| {
        InstrumentChoice::ALL.into_iter().find(|choice| choice.bundled() == Some(bundled))
    });
    if let Some(choice) = named {
        return Ok((choice, String::new()));
    }
    let ids = Bundled::ALL.map(Bundled::id).join(", ");
    let found = std::fs::read_to_string(text).map_err(|reason| format!("{reason}; known names are {ids}"))?;
    InstrumentFile::parse(&found).map_err(|reason| reason.to_string())?;
    Ok((InstrumentChoice::User, text.to_owned()))
}

impl Args {
    /// What the framework is told.
    fn words(&self, backend: Backend) -> Vec<String> {
        let mut words = vec!["chalumeau-standalone".to_owned()];
        let mut say = |name: &str, value: String| words.push(format!("--{name}={value}"));
        say("backend", backend.word());
        say("sample-rate", self.sample_rate.to_string());
        say("period-size", self.period_size.to_string());
        for (name, value) in [
            ("output-device", &self.output_device),
            ("midi-input", &self.midi_input),
            ("midi-output", &self.midi_output),
            ("connect-jack-midi-input", &self.connect_jack_midi_input),
            ("connect-jack-midi-output", &self.connect_jack_midi_output),
        ] {
            if let Some(value) = value {
                say(name, value.clone());
            }
        }
        words
    }

    /// Backends in the order they are tried. Who names a sound card or a MIDI port of the system means the system.
    fn backends(&self) -> Vec<Backend> {
        let of_system = [&self.output_device, &self.midi_input, &self.midi_output];
        let of_jack = [&self.connect_jack_midi_input, &self.connect_jack_midi_output];
        match self.backend {
            Backend::Auto if of_system.iter().any(|name| name.is_some()) => vec![SYSTEM],
            Backend::Auto if of_jack.iter().any(|name| name.is_some()) => vec![Backend::Jack],
            Backend::Auto => vec![Backend::Jack, SYSTEM],
            one => vec![one],
        }
    }
}

/// Reads the arguments and plays until told to stop. 0: played; 1: nothing to play to; 2: a mistake in the arguments.
pub fn main() -> ExitCode {
    let args = Args::parse();
    let heard = log::listen();
    let (choice, file) = args.instrument.clone();
    begin_with(Beginning { choice, file, a4_hz: args.a4 });
    if args.no_window {
        window::no_window();
    } else if lacks_display() {
        eprintln!(
            "chalumeau-standalone: no display (DISPLAY is not set): plays without a window; Ctrl-C ends it"
        );
        window::no_window();
    }
    IS_PROGRAM.store(true, Ordering::Relaxed);
    // A panic on a backend's thread would leave the program waiting for nothing.
    std::panic::set_hook(Box::new(|why| {
        eprintln!("chalumeau-standalone: {why}");
        std::process::exit(1);
    }));
    let mut tried = Vec::new();
    for backend in args.backends() {
        heard.forget();
        if nice_export_standalone_with_args::<Chalumeau, _>(args.words(backend)) {
            return ExitCode::SUCCESS;
        }
        if window::found_no_display() {
            // It played on without; who wanted a window has read why there was none.
            return ExitCode::SUCCESS;
        }
        let reason = heard.last_error().unwrap_or_else(|| "it does not say why".to_owned());
        if let Some(code) = listed(&reason) {
            return code;
        }
        tried.push((backend, spoken(&reason)));
    }
    eprintln!("{}", complaint(&tried));
    ExitCode::FAILURE
}

/// This process is the program, and not a host that has loaded the plugin.
static IS_PROGRAM: AtomicBool = AtomicBool::new(false);
/// Ctrl-C came, or its like.
static TOLD_TO_END: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Whether the program was told to end; the window asks.
pub fn is_told_to_end() -> bool {
    TOLD_TO_END.load(Ordering::Relaxed)
}

/// Listens for Ctrl-C beside the framework, which waits for the window alone once there is one. Called when it opens:
/// what the framework does before would take the ear away.
pub fn listen_for_the_end() {
    #[cfg(unix)]
    if IS_PROGRAM.load(Ordering::Relaxed) {
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            // Without it the window's own button ends the program.
            let _ = signal_hook::flag::register(signal, TOLD_TO_END.clone());
        }
    }
}

/// Windows are X11's here.
fn lacks_display() -> bool {
    cfg!(all(unix, not(target_os = "macos")))
        && std::env::var_os("DISPLAY").is_none_or(|name| name.is_empty())
}

/// The framework lists what there is when a name is not known to it. Asked with an empty name that is an answer, not
/// an error.
fn listed(reason: &str) -> Option<ExitCode> {
    let (asked, list) = reason.split_once(". Available devices are:")?;
    let list = list.trim_matches('\n');
    let list = if list.is_empty() { "(none)" } else { list };
    if asked.ends_with("''") {
        println!("{list}");
        return Some(ExitCode::SUCCESS);
    }
    eprintln!("chalumeau-standalone: {asked}; there are:\n{list}");
    Some(ExitCode::from(2))
}

/// A reason in words, where the library has only names of bits.
fn spoken(reason: &str) -> String {
    if reason.contains("SERVER_FAILED") { "no JACK server is running".to_owned() } else { reason.to_owned() }
}

/// What was tried, why it failed, what to do.
fn complaint(tried: &[(Backend, String)]) -> String {
    let mut text = format!("chalumeau-standalone: {} has nothing to play to", identity::NAME);
    for (backend, reason) in tried {
        text += &format!("\n  tried {}: {reason}", backend.word());
        text += &format!("\n    {}", backend.remedy());
    }
    text + "\n  without sound: --backend dummy; to a file: chalumeau render"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(words: &[&str]) -> Args {
        Args::try_parse_from([&["chalumeau-standalone"], words].concat()).unwrap()
    }

    #[test]
    fn what_is_named_decides_what_is_tried() {
        assert_eq!(args(&[]).backends(), [Backend::Jack, SYSTEM]);
        assert_eq!(args(&["--midi-input", ""]).backends(), [SYSTEM]);
        assert_eq!(args(&["--connect-jack-midi-input", "a:b"]).backends(), [Backend::Jack]);
        assert_eq!(args(&["--backend", "dummy", "-m", "x"]).backends(), [Backend::Dummy]);
    }

    #[test]
    fn a_wrong_rate_is_refused_with_the_right_ones() {
        let refused = Args::try_parse_from(["x", "--sample-rate", "8000"]).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("22050..384000"), "{refused}");
    }

    #[test]
    fn instruments_have_the_names_of_the_command_line() {
        assert_eq!(args(&[]).instrument.0, InstrumentChoice::BFlat);
        assert_eq!(args(&["--instrument", "bass"]).instrument.0, InstrumentChoice::Bass);
        let refused = Args::try_parse_from(["x", "--instrument", "tuba"]).unwrap_err();
        assert!(refused.to_string().contains("e-flat"), "{refused}");
        assert!(Args::try_parse_from(["x", "--a4", "400"]).unwrap_err().to_string().contains("415..466"));
    }

    #[test]
    fn the_framework_is_told_what_the_user_said() {
        let words = args(&["-r", "44100", "-o", "", "-m", "Wind"]).words(SYSTEM);
        for word in ["--sample-rate=44100", "--output-device=", "--midi-input=Wind"] {
            assert!(words.iter().any(|said| said == word), "{words:?}");
        }
    }

    #[test]
    fn an_empty_name_asks_and_a_wrong_one_errs() {
        let said = |name: &str| format!("Unknown output device '{name}'. Available devices are:\nFront");
        assert_eq!(listed(&said("")), Some(ExitCode::SUCCESS));
        assert_eq!(listed(&said("Back")), Some(ExitCode::from(2)));
        assert_eq!(listed("No default audio output device available"), None);
    }

    #[test]
    fn a_complaint_says_what_was_tried_why_and_what_to_do() {
        let text = complaint(&[
            (Backend::Jack, spoken("client error, status is ClientStatus(FAILURE | SERVER_FAILED)")),
            (SYSTEM, "no card".to_owned()),
        ]);
        for word in ["tried jack: no JACK server is running", "no card", "--output-device", "--backend dummy"]
        {
            assert!(text.contains(word), "{text}");
        }
    }
}
