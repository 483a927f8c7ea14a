//! The arguments of the standalone program.

use clap::{Parser, ValueEnum};

use std::ops::RangeInclusive;

use super::jack::JackPorts;
use crate::editor::connections::{Connections, DeviceChoice, OutputChoice};
use crate::plugin::InstrumentChoice;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::concert_pitch::A4_RANGE_HZ;
use chalumeau_core::instrument::internal_rate::HOST_RATES_HZ;

/// Time by which the framework delays a microphone, s, at least: input and output of a sound card come at different times. It takes
/// three periods where that is longer.
const LEAST_INPUT_LATENCY_S: f32 = 0.02;

/// Samples per block.
const BLOCKS: RangeInclusive<u32> = 16..=8192;

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

Play it with a MIDI keyboard, a wind controller, a knob, or the keys in the window. MIDI devices play as soon as you \
plug them in. CC2 or CC11 sets the breath. Until one of them moves, key velocity sets it. On the computer's keyboard, \
letters play: A S D F G H J K L are the white keys from middle C. The next start finds the settings of this one. The \
Instrument view lists sound outputs and MIDI inputs to choose from. With a microphone, hold keys and blow at it; keep \
quiet for the first two seconds, in which the program measures the room. Without a display, the program plays without \
a window. To quit, close the window or press Ctrl-C.";

/// Plays Chalumeau, a physical model of a clarinet, without a DAW.
#[derive(Parser, Debug)]
#[command(name = "chalumeau-standalone", version, after_help = HELP, max_term_width = 100)]
pub struct Args {
    /// Where sound and MIDI go.
    #[arg(short, long, default_value = "auto")]
    pub backend: Backend,
    /// Sample rate, 1000..1536000 Hz; JACK sets its own [default: 48000, or as chosen in the window].
    #[arg(short = 'r', long, value_name = "HZ", value_parser = rate)]
    sample_rate: Option<f32>,
    /// Samples per block, 16..8192; JACK sets its own. Small blocks respond faster, but the sound may drop out
    /// [default: 256, or as chosen in the window].
    #[arg(short, long, value_name = "SAMPLES",
          value_parser = clap::value_parser!(u32).range(i64::from(*BLOCKS.start())..=i64::from(*BLOCKS.end())))]
    period_size: Option<u32>,
    /// Name of the sound card; an empty name lists them. Without it, the output chosen in the window. Not for JACK.
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

/// One way to open sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    /// The backend.
    pub backend: Backend,
    /// Name of the sound card; `None` for the system's output.
    pub output: Option<String>,
    /// Name of the microphone's sound card, and how many of its channels to open.
    pub microphone: Option<(String, usize)>,
    /// Sample rate, Hz; JACK sets its own.
    pub rate_hz: f32,
    /// Samples per block; JACK sets its own.
    pub block: u32,
    /// Part of the name of the MIDI input; `None` for all.
    pub midi_input: Option<String>,
    /// Not what the user has chosen in the window: it is tried when that does not open.
    pub is_instead: bool,
}

impl Attempt {
    /// What remains if nothing opens: a window in which the user can choose.
    pub fn silent() -> Self {
        let DeviceChoice { rate_hz, block, .. } = DeviceChoice::default();
        Self {
            backend: Backend::Dummy,
            output: None,
            microphone: None,
            rate_hz: rate_hz as f32,
            block,
            midi_input: None,
            is_instead: true,
        }
    }
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
    /// Whether the user says in the arguments where sound and MIDI go, so that the choice in the window does not count.
    pub fn names_a_place(&self) -> bool {
        let names = [
            &self.output_device,
            &self.input_device,
            &self.midi_output,
            &self.connect_jack_input,
            &self.connect_jack_midi_input,
            &self.connect_jack_midi_output,
        ];
        let lists_midi = self.midi_input.as_deref() == Some("");
        self.backend != Backend::Auto || lists_midi || names.iter().any(|name| name.is_some())
    }

    /// The ways to open sound, in the order in which to try them. `kept` is the user's choice in the window.
    pub fn attempts(&self, kept: &DeviceChoice) -> Vec<Attempt> {
        let names_a_place = self.names_a_place();
        let chosen = if names_a_place { &DeviceChoice::default() } else { kept };
        let (backends, output) = match &chosen.output {
            _ if names_a_place => (self.backends(), self.output_device.clone()),
            OutputChoice::Auto => (self.backends(), None),
            // JACK has no MIDI input by a name of the system.
            OutputChoice::Jack if self.midi_input.is_some() => (self.backends(), None),
            OutputChoice::Jack => (vec![Backend::Jack], None),
            OutputChoice::System => (vec![SYSTEM], None),
            OutputChoice::Device(name) => (vec![SYSTEM], Some(name.clone())),
        };
        let microphone = self.input_device.as_ref().or(chosen.microphone.as_ref());
        let (low, high) = HOST_RATES_HZ;
        let kept_hz = f64::from(chosen.rate_hz).clamp(low, high) as f32;
        let rate_hz = self.sample_rate.unwrap_or(kept_hz);
        let block_at = |rate_hz: f32, chosen: u32| {
            // The period of WASAPI, which takes no other.
            let block = if cfg!(windows) { (rate_hz / 100.0) as u32 } else { chosen };
            self.period_size.unwrap_or(block.clamp(*BLOCKS.start(), *BLOCKS.end()))
        };
        let block = block_at(rate_hz, chosen.block);
        let midi_input = self.midi_input.clone().or_else(|| chosen.midi_input.clone());
        let plain = Attempt {
            backend: SYSTEM,
            output: None,
            microphone: None,
            rate_hz,
            block,
            midi_input,
            is_instead: false,
        };
        let mut attempts = Vec::new();
        for backend in backends {
            let of_system = Attempt { backend, output: output.clone(), ..plain.clone() };
            match microphone.filter(|_| !matches!(backend, Backend::Jack | Backend::Dummy)) {
                // Some devices have two channels only.
                Some(name) => attempts.extend([1, 2].map(|channels| Attempt {
                    microphone: Some((name.clone(), channels)),
                    ..of_system.clone()
                })),
                None => attempts.push(of_system),
            }
        }
        if !names_a_place {
            let usual = DeviceChoice::default();
            let rate_hz = usual.rate_hz as f32;
            let at_usual_rate = |attempt: &Attempt| Attempt {
                rate_hz,
                block: block_at(rate_hz, usual.block),
                ..attempt.clone()
            };
            // First without the microphone, then at another rate, then elsewhere.
            let here = Attempt { output, ..plain.clone() };
            let jack = Attempt { backend: Backend::Jack, ..plain.clone() };
            for instead in [here.clone(), at_usual_rate(&here), plain.clone(), at_usual_rate(&plain), jack] {
                if !attempts.contains(&instead) {
                    attempts.push(Attempt { is_instead: true, ..instead });
                }
            }
        }
        attempts
    }

    /// The choice that the lists of the window begin with: what is in use, or, if that is not what the user has chosen, the choice.
    pub fn in_window(&self, attempt: &Attempt, kept: &DeviceChoice) -> DeviceChoice {
        if attempt.is_instead {
            return kept.clone();
        }
        let in_use = DeviceChoice {
            rate_hz: attempt.rate_hz as u32,
            block: attempt.block,
            midi_input: attempt.midi_input.clone(),
            ..kept.clone()
        };
        if !self.names_a_place() {
            return in_use;
        }
        let output = match (&attempt.output, attempt.backend) {
            (Some(name), _) => OutputChoice::Device(name.clone()),
            (None, Backend::Jack) => OutputChoice::Jack,
            (None, SYSTEM) => OutputChoice::System,
            (None, _) => kept.output.clone(),
        };
        let microphone = attempt.microphone.as_ref().map(|(name, _)| name.clone());
        DeviceChoice { output, microphone, ..in_use }
    }

    /// The arguments for the framework. With JACK it runs the dummy backend at the server's rate.
    pub fn for_framework(&self, attempt: &Attempt) -> Vec<String> {
        let mut words = vec!["chalumeau-standalone".to_owned()];
        let mut add = |name: &str, value: String| words.push(format!("--{name}={value}"));
        let inputs = attempt.microphone.as_ref().map_or(0, |(_, channels)| *channels);
        add("backend", attempt.backend.name());
        add("sample-rate", attempt.rate_hz.to_string());
        add("period-size", attempt.block.to_string());
        // The plugin's layouts are numbered from 1, and have none, one and two.
        add("audio-layout", (inputs + 1).to_string());
        if let Some((name, _)) = &attempt.microphone {
            let latency_s = (3.0 * attempt.block as f32 / attempt.rate_hz).max(LEAST_INPUT_LATENCY_S);
            add("input-latency", latency_s.to_string());
            add("input-device", name.clone());
        }
        // The framework lists the MIDI inputs, and opens none.
        let listed = self.midi_input.clone().filter(String::is_empty);
        for (name, value) in
            [("output-device", &attempt.output), ("midi-input", &listed), ("midi-output", &self.midi_output)]
        {
            if let Some(value) = value {
                add(name, value.clone());
            }
        }
        words
    }

    /// Which MIDI inputs to open in this attempt: `None` for none of them, else part of their names, if the user has given it.
    pub fn keyboards(&self, attempt: &Attempt) -> Option<Option<String>> {
        let is_listed = self.midi_input.as_deref() == Some("");
        let has_own = matches!(attempt.backend, Backend::Jack | Backend::Dummy);
        (!is_listed && !has_own).then(|| attempt.midi_input.clone())
    }

    /// Where sound goes in this attempt, for the window. MIDI inputs come later.
    pub fn connections(&self, attempt: &Attempt) -> Connections {
        let (sound, how) = match attempt.backend {
            Backend::Dummy => ("none".to_owned(), ""),
            Backend::Auto | Backend::Jack => (
                "JACK".to_owned(),
                "A patchbay for JACK connects other outputs, MIDI devices and a microphone.",
            ),
            // Where the system has no other backend, the two above are all.
            #[allow(unreachable_patterns)]
            backend => {
                let output = attempt.output.as_deref().unwrap_or("the system's output");
                let (name, rate_hz, block) = (backend.name(), attempt.rate_hz, attempt.block);
                (format!("{output} ({name}), {rate_hz} Hz, blocks of {block}"), "")
            }
        };
        let no_midi = match (attempt.backend, &attempt.midi_input, &self.connect_jack_midi_input) {
            // Without a backend, no MIDI input is opened.
            (Backend::Dummy, ..) => "none".to_owned(),
            (Backend::Auto | Backend::Jack, _, Some(port)) => {
                format!("none; the JACK port {port} is not there")
            }
            (backend, Some(name), _) if backend != Backend::Jack => format!("none named {name}"),
            _ => "none; a keyboard plays as soon as you plug it in".to_owned(),
        };
        Connections { sound, no_midi, how: how.to_owned(), ..Connections::default() }
    }

    /// Whether this attempt opens a microphone that the user has named.
    pub fn hears_microphone(&self, attempt: &Attempt) -> bool {
        let has_port = attempt.backend == Backend::Jack && self.connect_jack_input.is_some();
        attempt.microphone.is_some() || has_port
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

    fn attempts(words: &[&str]) -> Vec<Attempt> {
        args(words).attempts(&DeviceChoice::default())
    }

    #[test]
    fn a_microphone_is_off_until_it_is_named() {
        assert!(attempts(&[]).iter().all(|attempt| attempt.microphone.is_none()));
        let first = &attempts(&[])[1];
        assert_eq!(first.backend, SYSTEM);
        assert!(!args(&[]).for_framework(first).iter().any(|word| word.contains("input-device")));
        let named = attempts(&["--input-device", "Mic"]);
        let channels = |attempt: &Attempt| attempt.microphone.as_ref().map(|(_, channels)| *channels);
        assert_eq!(named.iter().map(channels).collect::<Vec<_>>(), [Some(1), Some(2)]);
        assert!(attempts(&["--backend", "dummy", "--input-device", "Mic"])[0].microphone.is_none());
        let words = args(&["--input-device", "Mic"]).for_framework(&named[0]);
        for word in ["--input-device=Mic", "--audio-layout=2", "--input-latency=0.02"] {
            assert!(words.iter().any(|own| own == word), "no {word} in {words:?}");
        }
    }

    #[test]
    fn the_choice_in_the_window_counts_where_the_arguments_are_silent() {
        let kept = DeviceChoice {
            output: OutputChoice::Device("Card".to_owned()),
            rate_hz: 96_000,
            block: 128,
            microphone: Some("Mic".to_owned()),
            midi_input: Some("Wind".to_owned()),
        };
        let all = args(&[]).attempts(&kept);
        let wanted: Vec<_> = all.iter().filter(|attempt| !attempt.is_instead).collect();
        assert_eq!(wanted.len(), 2, "{all:?}");
        for (attempt, channels) in wanted.into_iter().zip([1, 2]) {
            assert_eq!((attempt.backend, attempt.output.as_deref()), (SYSTEM, Some("Card")));
            assert_eq!((attempt.rate_hz, attempt.block), (96_000.0, 128));
            assert_eq!(attempt.microphone, Some(("Mic".to_owned(), channels)));
            assert_eq!(args(&[]).keyboards(attempt), Some(Some("Wind".to_owned())));
        }
        // Without the microphone, at another rate, to the system's output, and then JACK.
        let instead: Vec<_> = all.iter().filter(|attempt| attempt.is_instead).collect();
        let places: Vec<_> =
            instead.iter().map(|one| (one.backend, one.output.as_deref(), one.rate_hz)).collect();
        let (card, here, there) = (Some("Card"), 96_000.0, 48_000.0);
        assert_eq!(
            places,
            [
                (SYSTEM, card, here),
                (SYSTEM, card, there),
                (SYSTEM, None, here),
                (SYSTEM, None, there),
                (Backend::Jack, None, here)
            ]
        );
        assert!(instead.iter().all(|one| one.microphone.is_none()));
        // What the arguments say goes first.
        let other = args(&["-o", "Other", "-r", "44100"]).attempts(&kept);
        assert_eq!(other.len(), 1, "{other:?}");
        let shown = args(&["-o", "Other", "-r", "44100"]).in_window(&other[0], &kept);
        assert_eq!((shown.output, shown.rate_hz), (OutputChoice::Device("Other".to_owned()), 44_100));
        assert_eq!(shown.microphone, None);
        assert_eq!(args(&[]).in_window(&all[0], &kept), kept);
        assert_eq!(args(&[]).in_window(&all[3], &kept), kept);
        assert_eq!(
            (other[0].output.as_deref(), other[0].rate_hz, other[0].block),
            (Some("Other"), 44_100.0, 256)
        );
        assert_eq!(args(&["--midi-input", "Keys"]).attempts(&kept)[0].midi_input.as_deref(), Some("Keys"));
        let on_jack = DeviceChoice { output: OutputChoice::Jack, ..kept.clone() };
        assert_eq!(args(&[]).attempts(&on_jack)[0].backend, Backend::Jack);
        let keys = &args(&["--midi-input", "Keys"]).attempts(&on_jack)[0];
        assert_eq!((keys.backend, keys.midi_input.as_deref()), (SYSTEM, Some("Keys")));
        assert!(
            args(&["--backend", "dummy"]).attempts(&kept).iter().all(|one| one.backend == Backend::Dummy)
        );
    }

    #[test]
    fn an_absurd_choice_is_brought_into_range() {
        let kept = DeviceChoice { rate_hz: 0, block: 1 << 30, ..DeviceChoice::default() };
        let first = &args(&[]).attempts(&kept)[0];
        assert_eq!((f64::from(first.rate_hz), first.block), (HOST_RATES_HZ.0, 8192));
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
        let words = args.for_framework(&args.attempts(&DeviceChoice::default())[0]);
        for word in ["--sample-rate=44100", "--output-device="] {
            assert!(words.iter().any(|said| said == word), "{words:?}");
        }
    }

    #[test]
    fn the_framework_lists_midi_inputs_and_the_program_opens_them() {
        let first = |args: &Args| args.attempts(&DeviceChoice::default()).swap_remove(0);
        let named = args(&["-b", SYSTEM.name().as_str(), "-m", "Wind"]);
        assert!(!named.for_framework(&first(&named)).join(" ").contains("midi-input"));
        assert_eq!(named.keyboards(&first(&named)), Some(Some("Wind".to_owned())));
        let asked = args(&["-m", ""]);
        assert!(asked.for_framework(&first(&asked)).join(" ").ends_with("--midi-input="));
        assert_eq!(asked.keyboards(&first(&asked)), None);
        for (backend, opens) in [(SYSTEM, Some(None)), (Backend::Jack, None), (Backend::Dummy, None)] {
            let unasked = args(&["-b", backend.name().as_str()]);
            assert_eq!(unasked.keyboards(&first(&unasked)), opens);
        }
    }
}
