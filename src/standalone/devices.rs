//! The devices for sound and MIDI: lists them for the window, keeps the user's choice, and watches whether the output still
//! asks for sound.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use cpal::traits::{DeviceTrait, HostTrait};
use midir::MidiInput;

use super::keyboards;
use super::quit;
use crate::data_folder;
use crate::editor::connections::{DeviceChoice, DeviceLists};
use crate::output;
use crate::plugin::launch_options::{DeviceTask, LaunchOptions};

const FILE: &str = "devices.json";

/// How often the thread looks whether sound is asked for.
const LOOK: Duration = Duration::from_millis(500);

/// An output that has asked for nothing during this time has stopped.
const STOPPED: Duration = Duration::from_secs(3);

/// Blocks that the output has asked for.
static BLOCKS: AtomicU32 = AtomicU32::new(0);

/// The output asks for a block. Real-time safe. [audio thread]
pub fn count_block() {
    BLOCKS.fetch_add(1, Ordering::Relaxed);
}

fn path() -> Option<PathBuf> {
    data_folder::folder().map(|folder| folder.join(FILE))
}

/// What the user has chosen in the window, in this or an earlier session.
pub fn kept() -> DeviceChoice {
    let Some(bytes) = path().and_then(|path| std::fs::read(path).ok()) else {
        return DeviceChoice::default();
    };
    serde_json::from_slice(&bytes).unwrap_or_else(|reason| {
        tell!("chalumeau-standalone: cannot read {FILE}: {reason}; sound goes to the default output");
        DeviceChoice::default()
    })
}

fn keep(choice: &DeviceChoice) -> Result<(), String> {
    let path = path().ok_or("this system has no folder for settings")?;
    let bytes = serde_json::to_vec_pretty(choice).map_err(|reason| reason.to_string())?;
    output::replace(&path, &bytes).map_err(|reason| reason.to_string())
}

/// Whether the output has asked for sound.
pub fn has_begun() -> bool {
    BLOCKS.load(Ordering::Relaxed) > 0
}

/// Does what the window asks for, until the program ends.
pub fn serve(options: &'static LaunchOptions) {
    let (tasks, asked) = channel();
    *options.device_tasks.lock().unwrap_or_else(PoisonError::into_inner) = Some(tasks);
    let serve = move || {
        let mut watch = Watch::new(Instant::now());
        let mut before = None;
        loop {
            match asked.recv_timeout(LOOK) {
                Ok(DeviceTask::Look) => look(),
                Ok(DeviceTask::Use(choice)) => match keep(&choice) {
                    Ok(()) => {
                        options.restart.store(true, Ordering::Relaxed);
                        quit::begin(options);
                    }
                    Err(reason) => {
                        LaunchOptions::connect(|now| {
                            now.problem = Some(format!("The choice of devices cannot be saved: {reason}"));
                        });
                    }
                },
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            match watch.look(BLOCKS.load(Ordering::Relaxed), Instant::now()) {
                Some(Change::Stopped) => {
                    let problem = "The sound output has stopped. Choose devices in the Instrument view.";
                    tell!("chalumeau-standalone: {problem}");
                    LaunchOptions::connect(|now| before = now.problem.replace(problem.to_owned()));
                }
                Some(Change::Resumed) => LaunchOptions::connect(|now| now.problem = before.take()),
                None => {}
            }
        }
    };
    // Without the thread, the lists stay empty.
    let _ = std::thread::Builder::new().name("devices".to_owned()).spawn(serve);
}

/// Looks on a thread of its own, one at a time: a sound system that has died may never answer.
fn look() {
    static IS_LOOKING: AtomicBool = AtomicBool::new(false);
    if IS_LOOKING.swap(true, Ordering::Relaxed) {
        return;
    }
    let look = || {
        let devices = Arc::new(lists());
        LaunchOptions::connect(|now| now.devices = devices);
        IS_LOOKING.store(false, Ordering::Relaxed);
    };
    if std::thread::Builder::new().name("device lists".to_owned()).spawn(look).is_err() {
        IS_LOOKING.store(false, Ordering::Relaxed);
    }
}

/// Notices that nobody asks for blocks any more.
struct Watch {
    blocks: u32,
    /// When the last one was asked for.
    at: Instant,
    has_stopped: bool,
}

/// What an output does that it did not do at the last look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    /// It asks for sound no more.
    Stopped,
    /// It asks for sound again.
    Resumed,
}

impl Watch {
    fn new(now: Instant) -> Self {
        Self { blocks: 0, at: now, has_stopped: false }
    }

    /// What has changed since the last look. An output that has not begun yet has not stopped.
    fn look(&mut self, blocks: u32, now: Instant) -> Option<Change> {
        if blocks != self.blocks || blocks == 0 {
            let resumed = self.has_stopped.then_some(Change::Resumed);
            *self = Self { blocks, at: now, has_stopped: false };
            return resumed;
        }
        let stops = now.duration_since(self.at) > STOPPED && !std::mem::replace(&mut self.has_stopped, true);
        stops.then_some(Change::Stopped)
    }
}

/// The devices that there are.
fn lists() -> DeviceLists {
    let host = cpal::default_host();
    let name = |device: cpal::Device| device.description().ok().map(|about| about.name().to_owned());
    // ALSA offers one that drops all sound, and brings none.
    let is_real = |name: &String| !name.starts_with("Discard all samples");
    let names = |all: &mut dyn Iterator<Item = cpal::Device>| all.filter_map(name).filter(is_real).collect();
    let outputs = host.output_devices().map(|mut all| names(&mut all)).unwrap_or_default();
    let inputs = host.input_devices().map(|mut all| names(&mut all)).unwrap_or_default();
    DeviceLists {
        outputs: without_doubles(outputs),
        inputs: without_doubles(inputs),
        midi_inputs: without_doubles(midi_inputs()),
    }
}

fn midi_inputs() -> Vec<String> {
    let Ok(list) = MidiInput::new(keyboards::CLIENT) else { return Vec::new() };
    let names = list.ports().into_iter().filter_map(|port| list.port_name(&port).ok());
    let names =
        names.filter(|name| keyboards::plays_unasked([name.as_str()]) && !name.contains(keyboards::CLIENT));
    names.map(|name| without_numbers(&name).to_owned()).collect()
}

/// ALSA's name of a port ends with numbers that change when it is plugged in again: `KeyStep:KeyStep MIDI 1 24:0`.
fn without_numbers(name: &str) -> &str {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let last = name.rsplit_once(' ').filter(|(_, last)| {
        last.split_once(':').is_some_and(|(client, port)| is_number(client) && is_number(port))
    });
    last.map_or(name, |(name, _)| name)
}

/// The framework opens the first device of a name.
fn without_doubles(names: Vec<String>) -> Vec<String> {
    let mut seen = std::collections::HashSet::new();
    names.into_iter().filter(|name| seen.insert(name.clone())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::editor::connections::OutputChoice;

    #[test]
    fn an_output_that_asks_no_more_has_stopped_once() {
        let began = Instant::now();
        let after = |s: u64| began + Duration::from_secs(s);
        let mut watch = Watch::new(began);
        assert_eq!(watch.look(0, after(60)), None, "it has not begun");
        assert_eq!(watch.look(1, after(61)), None);
        assert_eq!(watch.look(1, after(63)), None, "a busy machine");
        assert_eq!(watch.look(1, after(65)), Some(Change::Stopped));
        assert_eq!(watch.look(1, after(70)), None, "said already");
        assert_eq!(watch.look(2, after(71)), Some(Change::Resumed));
        assert_eq!(watch.look(3, after(72)), None);
        assert_eq!(watch.look(3, after(76)), Some(Change::Stopped));
    }

    #[test]
    fn a_keyboard_is_kept_without_the_numbers_that_change() {
        assert_eq!(without_numbers("KeyStep:KeyStep MIDI 1 24:0"), "KeyStep:KeyStep MIDI 1");
        assert_eq!(without_numbers("KeyStep 37"), "KeyStep 37");
        assert_eq!(without_numbers("24:0"), "24:0");
    }

    #[test]
    fn a_choice_of_an_earlier_version_is_read() {
        let choice: DeviceChoice = serde_json::from_str(r#"{"output": {"device": "Scarlett"}}"#).unwrap();
        assert_eq!(choice.output, OutputChoice::Device("Scarlett".to_owned()));
        assert_eq!((choice.rate_hz, choice.block), (48_000, 256));
        let again: DeviceChoice = serde_json::from_slice(&serde_json::to_vec(&choice).unwrap()).unwrap();
        assert_eq!(again, choice);
    }

    #[test]
    fn a_name_is_listed_once() {
        let names = ["HDMI", "Analog", "HDMI"].map(str::to_owned).to_vec();
        assert_eq!(without_doubles(names), ["HDMI", "Analog"]);
    }
}
