//! The arguments of the standalone program.

use clap::{Parser, ValueEnum};

use super::jack::JackPorts;
use crate::editor::snapshot::Connections;
use crate::plugin::InstrumentChoice;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::concert_pitch::A4_RANGE_HZ;
use chalumeau_core::instrument::internal_rate::HOST_RATES_HZ;

/// Time by which the framework delays a microphone, s, at least: input and output of a sound card come at different times. It takes
/// three periods where that is longer.
const LEAST_INPUT_LATENCY_S: f32 = 0.02;

const HELP: &str = "\
Examples:
  chalumeau-standalone                                    JACK if a server runs, else the system's sound
  chalumeau-standalone --backend jack --connect-jack-midi-input \"system:midi_capture_1\"
  chalumeau-standalone --instrument bass --a4 442
  chalumeau-standalone --midi-input \"\"                    lists the MIDI inputs
  chalumeau-standalone --output-device \"\"                 lists the sound cards
  chalumeau-standalone --input-device \"\"                  lists the microphones
  chalumeau-standalone --no-window                        plays from MIDI or a knob
  chalumeau-standalone --backend dummy                    shows the window, makes no sound

Play it with a MIDI keyboard, a wind controller, a knob, or the keys in the window. MIDI devices play as soon as you plug
them in. CC2 or CC11 sets the breath. Until one
of them moves, key velocity sets it. On the computer's keyboard, letters play: A S D F G H J K are the white keys from C.
The next start finds the settings of this one. With a microphone, hold keys and blow at it; keep quiet for the first two seconds,
in which the program measures the room. Without a display, the program plays without a window. To quit, close the window or
press Ctrl-C.";

/// Plays Chalumeau, a physical model of a clarinet, without a DAW.
#[derive(Parser, Debug)]
#[command(name = "chalumeau-standalone", version, after_help = HELP, max_term_width = 100)]
pub struct Args {
    /// Where sound and MIDI go.
    #[arg(short, long, default_value = "auto")]
    pub backend: Backend,
    /// Sample rate, 1000..1536000 Hz; JACK sets its own.
    #[arg(short = 'r', long, value_name = "HZ", default_value = "48000", value_parser = rate)]
    pub sample_rate: f32,
    /// Samples per block, 16..8192; JACK sets its own. Small blocks respond faster, but the sound may drop out.
    #[arg(short, long, value_name = "SAMPLES", default_value = "256",
          value_parser = clap::value_parser!(u32).range(16..=8192))]
    period_size: u32,
    /// Name of the sound card; an empty name lists them. Not for JACK.
    #[arg(short, long, value_name = "NAME")]
    output_device: Option<String>,
    /// Name of the sound card's input with a microphone that you blow at; an empty name lists them. Not for JACK.
    #[arg(long, value_name = "NAME")]
    input_device: Option<String>,
    /// Part of the name of the MIDI input; an empty name lists them. Without it, all play. Not for JACK.
    #[arg(short, long, value_name = "NAME")]
    midi_input: Option<String>,
    /// Name of the MIDI output for a knob's breath; an empty name lists them. Not for JACK.
    #[arg(long, value_name = "NAME")]
    midi_output: Option<String>,
    /// Instrument: b-flat, a, e-flat, c, bass, or an instrument file. Without it, that of the last session.
    #[arg(short, long, value_name = "NAME|FILE", value_parser = instrument)]
    pub instrument: Option<(InstrumentChoice, String)>,
    /// Pitch of A4, 415..466 Hz. Without it, that of the last session.
    #[arg(long, value_name = "HZ", value_parser = a4)]
    pub a4: Option<f32>,
    /// Begin with the default settings instead of those of the last session.
    #[arg(long)]
    pub new_session: bool,
    /// Play without a window.
    #[arg(long)]
    pub no_window: bool,
    /// JACK port of a microphone that you blow at.
    #[arg(long, value_name = "PORT")]
    connect_jack_input: Option<String>,
    /// JACK port whose MIDI plays the instrument. Without it, all MIDI devices play.
    #[arg(long, value_name = "PORT")]
    connect_jack_midi_input: Option<String>,
    /// JACK port that receives a knob's breath.
    #[arg(long, value_name = "PORT")]
    connect_jack_midi_output: Option<String>,
}

/// Where sound and MIDI go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Backend {
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

/// The backend of this system's own sound.
#[cfg(all(unix, not(target_os = "macos")))]
pub const SYSTEM: Backend = Backend::Alsa;
/// The backend of this system's own sound.
#[cfg(target_os = "macos")]
pub const SYSTEM: Backend = Backend::CoreAudio;
/// The backend of this system's own sound.
#[cfg(windows)]
pub const SYSTEM: Backend = Backend::Wasapi;

impl Backend {
    /// Its name, here and in the framework's own option.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What the user can do if it does not open.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Jack => "start a server (`jackd -d alsa`, or run this program under `pw-jack`)",
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
    let (low, high) = HOST_RATES_HZ;
    match text.parse::<f32>() {
        Ok(rate_hz) if (low..=high).contains(&f64::from(rate_hz)) => Ok(rate_hz),
        _ => Err(format!("the rate must lie in {low}..{high} Hz")),
    }
}

fn a4(text: &str) -> Result<f32, String> {
    let (low, high) = A4_RANGE_HZ;
    match text.parse::<f32>() {
        Ok(a4_hz) if (low..=high).contains(&f64::from(a4_hz)) => Ok(a4_hz),
        _ => Err(format!("A4 must lie in {low}..{high} Hz")),
    }
}

/// Checks an instrument file already here, while an error can still be reported as a mistake in the arguments.
fn instrument(text: &str) -> Result<(InstrumentChoice, String), String> {
    let named = Bundled::named(text).and_then(|bundled| {
        InstrumentChoice::ALL.into_iter().find(|choice| choice.bundled() == Some(bundled))
    });
    if let Some(choice) = named {
        return Ok((choice, String::new()));
    }
    let ids = Bundled::ALL.map(Bundled::id).join(", ");
    let found = crate::text_file::read(text)
        .map_err(|reason| format!("{reason}; instruments without a file are {ids}"))?;
    InstrumentFile::parse(&found).map_err(|reason| reason.to_string())?;
    // The session keeps it, and the next start may be from another folder.
    let path = std::path::absolute(text).map_err(|reason| format!("{text}: {reason}"))?;
    Ok((InstrumentChoice::User, path.display().to_string()))
}

impl Args {
    /// Whether the user has named a microphone.
    pub fn has_microphone(&self) -> bool {
        self.input_device.is_some() || self.connect_jack_input.is_some()
    }

    /// Channels of the microphone to try, in this order.
    pub fn inputs(&self, backend: Backend) -> &'static [usize] {
        match backend {
            Backend::Jack | Backend::Dummy => &[0],
            _ if self.input_device.is_none() => &[0],
            // Some devices have two only.
            _ => &[1, 2],
        }
    }

    /// The arguments for the framework. With JACK it runs the dummy backend at the server's rate, Hz. `inputs`: channels of the
    /// microphone.
    pub fn for_framework(&self, backend: Backend, rate_hz: f32, inputs: usize) -> Vec<String> {
        let mut words = vec!["chalumeau-standalone".to_owned()];
        let mut add = |name: &str, value: String| words.push(format!("--{name}={value}"));
        add("backend", backend.name());
        add("sample-rate", rate_hz.to_string());
        add("period-size", self.period_size.to_string());
        // The plugin's layouts are numbered from 1, and have none, one and two.
        add("audio-layout", (inputs + 1).to_string());
        if inputs > 0 {
            let latency_s = (3.0 * self.period_size as f32 / rate_hz).max(LEAST_INPUT_LATENCY_S);
            add("input-latency", latency_s.to_string());
            add("input-device", self.input_device.clone().unwrap_or_default());
        }
        // The framework lists the MIDI inputs, and opens none.
        let listed = self.midi_input.clone().filter(String::is_empty);
        for (name, value) in [
            ("output-device", &self.output_device),
            ("midi-input", &listed),
            ("midi-output", &self.midi_output),
        ] {
            if let Some(value) = value {
                add(name, value.clone());
            }
        }
        words
    }

    /// Which MIDI inputs to open beside this backend: `None` for none of them, else part of their names, if the user has given it.
    pub fn keyboards(&self, backend: Backend) -> Option<Option<String>> {
        let is_listed = self.midi_input.as_deref() == Some("");
        let has_own = matches!(backend, Backend::Jack | Backend::Dummy);
        (!is_listed && !has_own).then(|| self.midi_input.clone())
    }

    /// Where sound goes with this backend, and how to choose another place, for the window. MIDI inputs come later.
    pub fn connections(&self, backend: Backend) -> Connections {
        let (sound, how) = match backend {
            Backend::Dummy => ("none".to_owned(), "To hear it, start the program without --backend dummy."),
            Backend::Auto | Backend::Jack => (
                "JACK".to_owned(),
                "A patchbay for JACK connects other outputs and MIDI devices. For a sound card without JACK, start the program with \
                 --output-device \"NAME\".",
            ),
            // Where the system has no other backend, the two above are all.
            #[allow(unreachable_patterns)]
            _ => {
                let device = self.output_device.as_deref().unwrap_or("the system's output");
                let (name, rate_hz, frames) = (backend.name(), self.sample_rate, self.period_size);
                (
                    format!("{device} ({name}), {rate_hz} Hz, blocks of {frames}"),
                    "For another, start the program with --output-device \"NAME\" or --midi-input \"NAME\"; an empty name lists them.",
                )
            }
        };
        let no_midi = match (backend, &self.midi_input, &self.connect_jack_midi_input) {
            // Without a backend, no MIDI input is opened.
            (Backend::Dummy, ..) => "none".to_owned(),
            (_, Some(name), _) if !name.is_empty() => format!("none named {name}"),
            (Backend::Auto | Backend::Jack, _, Some(port)) => {
                format!("none; the JACK port {port} is not there")
            }
            _ => "none; a keyboard plays as soon as you plug it in".to_owned(),
        };
        Connections { sound, midi: Vec::new(), no_midi, how: how.to_owned() }
    }

    /// The JACK ports to connect to.
    pub fn jack_ports(&self) -> JackPorts {
        JackPorts {
            microphone: self.connect_jack_input.clone(),
            midi_input: self.connect_jack_midi_input.clone(),
            midi_output: self.connect_jack_midi_output.clone(),
        }
    }

    /// The backends to try, in this order. A user who names a sound card or a MIDI port of the system wants the system's
    /// backend.
    pub fn backends(&self) -> Vec<Backend> {
        let of_system = [&self.output_device, &self.input_device, &self.midi_input, &self.midi_output];
        let of_jack =
            [&self.connect_jack_input, &self.connect_jack_midi_input, &self.connect_jack_midi_output];
        match self.backend {
            Backend::Auto if of_system.iter().any(|name| name.is_some()) => vec![SYSTEM],
            Backend::Auto if of_jack.iter().any(|name| name.is_some()) => vec![Backend::Jack],
            Backend::Auto => vec![Backend::Jack, SYSTEM],
            one => vec![one],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(words: &[&str]) -> Args {
        Args::try_parse_from([&["chalumeau-standalone"], words].concat()).unwrap()
    }

    #[test]
    fn the_named_devices_decide_which_backends_are_tried() {
        assert_eq!(args(&[]).backends(), [Backend::Jack, SYSTEM]);
        assert_eq!(args(&["--midi-input", ""]).backends(), [SYSTEM]);
        assert_eq!(args(&["--connect-jack-midi-input", "a:b"]).backends(), [Backend::Jack]);
        assert_eq!(args(&["--backend", "dummy", "-m", "x"]).backends(), [Backend::Dummy]);
        assert_eq!(args(&["--input-device", "x"]).backends(), [SYSTEM]);
        assert_eq!(args(&["--connect-jack-input", "a:b"]).backends(), [Backend::Jack]);
    }

    #[test]
    fn a_microphone_is_off_until_it_is_named() {
        let none = args(&[]);
        assert!(!none.has_microphone());
        assert_eq!(none.inputs(SYSTEM), [0]);
        assert!(!none.for_framework(SYSTEM, 48_000.0, 0).iter().any(|word| word.contains("input-device")));
        let named = args(&["--input-device", "Mic"]);
        assert!(named.has_microphone() && args(&["--connect-jack-input", "a:b"]).has_microphone());
        assert_eq!((named.inputs(SYSTEM), named.inputs(Backend::Dummy)), (&[1, 2][..], &[0][..]));
        let words = named.for_framework(SYSTEM, 48_000.0, 1);
        for word in ["--input-device=Mic", "--audio-layout=2", "--input-latency=0.02"] {
            assert!(words.iter().any(|own| own == word), "no {word} in {words:?}");
        }
    }

    #[test]
    fn a_wrong_rate_is_refused_with_the_right_ones() {
        let refused = Args::try_parse_from(["x", "--sample-rate", "800"]).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("1000..1536000"), "{refused}");
    }

    #[test]
    fn instruments_have_the_names_of_the_command_line() {
        assert_eq!(args(&[]).instrument, None);
        assert_eq!(args(&["--instrument", "bass"]).instrument.unwrap().0, InstrumentChoice::Bass);
        let refused = Args::try_parse_from(["x", "--instrument", "tuba"]).unwrap_err();
        assert!(refused.to_string().contains("e-flat"), "{refused}");
        assert!(Args::try_parse_from(["x", "--a4", "400"]).unwrap_err().to_string().contains("415..466"));
    }

    #[test]
    fn the_framework_gets_the_arguments_of_the_user() {
        let args = args(&["-r", "44100", "-o", "", "-m", "Wind"]);
        let words = args.for_framework(SYSTEM, args.sample_rate, 0);
        for word in ["--sample-rate=44100", "--output-device="] {
            assert!(words.iter().any(|said| said == word), "{words:?}");
        }
    }

    #[test]
    fn the_framework_lists_midi_inputs_and_the_program_opens_them() {
        let frameworks = |args: &Args| args.for_framework(SYSTEM, 48_000.0, 0).join(" ");
        let named = args(&["-m", "Wind"]);
        assert!(!frameworks(&named).contains("midi-input"));
        assert_eq!(named.keyboards(SYSTEM), Some(Some("Wind".to_owned())));
        let asked = args(&["-m", ""]);
        assert!(frameworks(&asked).ends_with("--midi-input="));
        assert_eq!(asked.keyboards(SYSTEM), None);
        let unasked = args(&[]);
        assert_eq!(unasked.keyboards(SYSTEM), Some(None));
        assert_eq!([Backend::Jack, Backend::Dummy].map(|backend| unasked.keyboards(backend)), [None, None]);
    }
}
