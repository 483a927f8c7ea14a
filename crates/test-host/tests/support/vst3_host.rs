//! The bundled VST3 in vst3-host, for the files that play it.
#![allow(dead_code, reason = "each user takes what it needs")]

use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use vst3_host::prelude::*;
use vst3_host::{AudioBuffers, MidiChannel, MidiEvent};

use super::wind::RATE;

pub const CHANNEL: MidiChannel = MidiChannel::Ch1;

/// VST3 knows one main thread; the tests take turns at being it.
static MAIN_THREAD: Mutex<()> = Mutex::new(());

pub struct Loaded {
    pub plugin: Plugin,
    /// What comes in on both channels of a class that has an input.
    pub input: Vec<f32>,
    // Both outlive the plugin.
    _host: Vst3Host,
    _turn: Option<MutexGuard<'static, ()>>,
}

pub fn turn() -> MutexGuard<'static, ()> {
    MAIN_THREAD.lock().unwrap_or_else(PoisonError::into_inner)
}

pub fn load(block: usize) -> Loaded {
    let turn = turn();
    Loaded { _turn: Some(turn), ..load_beside(block) }
}

/// For a second plugin in the same test.
pub fn load_beside(block: usize) -> Loaded {
    load_class(block, None)
}

/// The class of this id, or the first one.
pub fn load_class(block: usize, id: Option<&str>) -> Loaded {
    let path = chalumeau_test_host::artefacts::vst3().unwrap();
    let load = || {
        let mut host = Vst3Host::builder().sample_rate(RATE).block_size(block).build().unwrap();
        let plugin = match id {
            Some(id) => host.load_plugin_class(&path, id),
            None => host.load_plugin(&path),
        };
        (plugin.unwrap(), host)
    };
    // One stays loaded for good, so that the library does: see `chalumeau_test_host::clap::Plugin::load`.
    static FIRST: Once = Once::new();
    FIRST.call_once(|| std::mem::forget(load()));
    let (plugin, host) = load();
    Loaded { plugin, input: Vec::new(), _host: host, _turn: None }
}

/// What is said at a sample position: MIDI, or a parameter's name and 0..=1.
#[derive(Clone, Copy, Debug)]
pub enum Word {
    Midi(MidiEvent),
    Set(&'static str, f64),
}

pub fn on(note: u8) -> Word {
    Word::Midi(MidiEvent::NoteOn { channel: CHANNEL, note, velocity: 100 })
}

pub fn off(note: u8) -> Word {
    Word::Midi(MidiEvent::NoteOff { channel: CHANNEL, note, velocity: 0 })
}

pub fn cc(controller: u8, value: u8) -> Word {
    Word::Midi(MidiEvent::ControlChange { channel: CHANNEL, controller, value })
}

pub fn bend(value: u16) -> Word {
    Word::Midi(MidiEvent::PitchBend { channel: CHANNEL, value })
}

pub fn pressure(pressure: u8) -> Word {
    Word::Midi(MidiEvent::ChannelAftertouch { channel: CHANNEL, pressure })
}

/// Plays on from where the last call ended.
pub fn play_on(loaded: &mut Loaded, block: usize, said: &[(usize, Word)], samples: usize) -> Vec<f32> {
    let mut heard = Vec::new();
    let mut said = said.iter().peekable();
    while heard.len() < samples {
        let start = heard.len();
        let length = block.min(samples - start);
        while let Some(&(at, word)) = said.next_if(|(at, _)| *at < start + length) {
            let at = (at - start) as i32;
            match word {
                Word::Midi(event) => loaded.plugin.send_midi_event_at(event, at).unwrap(),
                Word::Set(name, value) => {
                    let id = loaded.plugin.find_parameter(name).unwrap().id;
                    loaded.plugin.set_parameter_at(id, value, at).unwrap();
                }
            }
        }
        let mut buffers = AudioBuffers::new(loaded.input.len().min(2), 2, length, RATE);
        for channel in &mut buffers.inputs {
            channel.copy_from_slice(&loaded.input[start..start + length]);
        }
        loaded.plugin.process_audio(&mut buffers).unwrap();
        assert!(buffers.outputs[0] == buffers.outputs[1], "both channels carry the same voice");
        heard.extend_from_slice(&buffers.outputs[0][..length]);
    }
    heard
}

pub fn play(block: usize, said: &[(usize, Word)], samples: usize) -> Vec<f32> {
    let mut loaded = load(block);
    loaded.plugin.start_processing().unwrap();
    play_on(&mut loaded, block, said, samples)
}
