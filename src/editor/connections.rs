//! Where sound and MIDI go and come from, in a program without a host; and what the user can choose for them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// Sample rates to choose from, Hz. Other rates need the command line.
pub const RATES_HZ: [u32; 4] = [44_100, 48_000, 88_200, 96_000];

/// Block lengths to choose from, samples. Other lengths need the command line.
pub const BLOCKS: [u32; 6] = [64, 128, 256, 512, 1024, 2048];

/// Where sound and MIDI go and come from, in a program without a host.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connections {
    /// The sound output.
    pub sound: String,
    /// The MIDI inputs that play, and what to say where there is none.
    pub midi: Vec<String>,
    /// See [`midi`](Self::midi).
    pub no_midi: String,
    /// How the user connects others, where the window cannot.
    pub how: String,
    /// What has gone wrong, and what to do.
    pub problem: Option<String>,
    /// What the user has chosen; it also counts for the next start.
    pub chosen: DeviceChoice,
    /// What there is to choose from.
    pub devices: Arc<DeviceLists>,
}

impl Connections {
    /// The MIDI inputs on one line.
    pub fn midi_line(&self) -> String {
        if self.midi.is_empty() { self.no_midi.clone() } else { self.midi.join(", ") }
    }
}

/// The devices of this system, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceLists {
    /// Sound outputs.
    pub outputs: Vec<String>,
    /// Sound inputs.
    pub inputs: Vec<String>,
    /// MIDI inputs.
    pub midi_inputs: Vec<String>,
}

/// The user's choice of devices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct DeviceChoice {
    /// Where sound goes.
    pub output: OutputChoice,
    /// Sample rate of the system's sound, Hz.
    pub rate_hz: u32,
    /// Length of its blocks, samples.
    pub block: u32,
    /// The sound input with a microphone that the user blows at.
    pub microphone: Option<String>,
    /// Part of the name of the MIDI input; `None` for all.
    pub midi_input: Option<String>,
}

impl Default for DeviceChoice {
    fn default() -> Self {
        Self { output: OutputChoice::Auto, rate_hz: 48_000, block: 256, microphone: None, midi_input: None }
    }
}

/// Where sound goes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputChoice {
    /// To JACK if a server runs, else to the system's output.
    #[default]
    Auto,
    /// To JACK.
    Jack,
    /// To the output that the system has chosen.
    System,
    /// To the output of this name.
    Device(String),
}

impl OutputChoice {
    /// Its name in a list.
    pub fn title(&self) -> &str {
        match self {
            Self::Auto => "Automatic",
            Self::Jack => "JACK",
            Self::System => "The system's output",
            Self::Device(name) => name,
        }
    }
}
