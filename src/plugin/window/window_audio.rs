//! The audio thread's part of the window. [audio thread]

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::SharedWindow;
use crate::editor::snapshot::MicrophoneState;
use crate::plugin::breath_sources::BreathSources;
use crate::plugin::instrument_loading::InstrumentSwap;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::player::PlayerState;
use chalumeau_core::instrument::scope::{SCOPE_SAMPLES, ScopeSample};

/// Samples on their way to the snapshot thread: more than a second at 48 kHz.
const SOUND_SAMPLES: usize = 65_536;
/// Key events on their way from the window to the audio thread.
const KEY_EVENTS: usize = 256;
/// Key events that one block takes; the others wait for the next block.
const KEYS_PER_BLOCK: usize = 8;

/// The inside of the instrument at one moment, as the audio thread sends it.
#[derive(Clone)]
pub struct AudioSnapshot {
    /// What the player is doing.
    pub now: PlayerState,
    /// Others are heard on other notes.
    pub is_chord: bool,
    /// The latest moments inside the mouthpiece, oldest first.
    pub moments: Box<[ScopeSample; SCOPE_SAMPLES]>,
    /// Moments per second.
    pub moments_hz: f64,
    /// Sample rate of the sound, Hz.
    pub host_rate_hz: f64,
    /// Latency of the plugin, samples.
    pub latency_samples: u32,
    /// Which input the breath came from.
    pub breath_sources: BreathSources,
}

impl Default for AudioSnapshot {
    fn default() -> Self {
        Self {
            now: PlayerState {
                key: None,
                sounding: None,
                fingering: 0,
                mouth_kpa: 0.0,
                lip: None,
                dynamic: None,
                chosen: None,
            },
            is_chord: false,
            moments: Box::new([ScopeSample::default(); SCOPE_SAMPLES]),
            moments_hz: 48_000.0,
            host_rate_hz: 48_000.0,
            latency_samples: 0,
            breath_sources: BreathSources::default(),
        }
    }
}

/// The audio thread's part of the window.
pub struct WindowAudio {
    shared: Arc<SharedWindow>,
    inside: triple_buffer::Input<AudioSnapshot>,
    sound: rtrb::Producer<f32>,
    keys: rtrb::Consumer<Event>,
    /// Number of the picture that was sent last.
    shown: u64,
    /// The fingering that the window tries.
    tried: Option<u64>,
    /// The player has been reset, and has to be told of it again.
    is_to_retry: bool,
}

/// The other ends of its channels.
pub struct WindowChannels {
    /// The inside of the instrument, for the snapshot thread.
    pub inside: triple_buffer::Output<AudioSnapshot>,
    /// The sound, for the snapshot thread.
    pub sound: rtrb::Consumer<f32>,
    /// Key events from the window.
    pub keys: rtrb::Producer<Event>,
}

impl WindowAudio {
    /// Makes the channels. Allocates.
    pub(super) fn new(shared: Arc<SharedWindow>) -> (Self, WindowChannels) {
        let (inside_in, inside) = triple_buffer::triple_buffer(&AudioSnapshot::default());
        let (sound_in, sound) = rtrb::RingBuffer::new(SOUND_SAMPLES);
        let (keys_in, keys) = rtrb::RingBuffer::new(KEY_EVENTS);
        let audio = Self {
            shared,
            inside: inside_in,
            sound: sound_in,
            keys,
            shown: 0,
            tried: None,
            is_to_retry: false,
        };
        (audio, WindowChannels { inside, sound, keys: keys_in })
    }

    /// Whether the window is open. Real-time safe.
    pub fn is_open(&self) -> bool {
        self.shared.is_open.load(Ordering::Relaxed)
    }

    /// The key events of the window since the last block. Real-time safe.
    pub fn keys(&mut self) -> [Option<Event>; KEYS_PER_BLOCK] {
        let mut again = std::mem::take(&mut self.is_to_retry).then_some(Event::TryHoles(self.tried));
        std::array::from_fn(|_| again.take().or_else(|| self.next_key()))
    }

    /// Drops the key events that came while nothing played. A fingering that is tried stays: the window shows it. Real-time safe.
    pub fn forget_keys(&mut self) {
        while self.next_key().is_some() {}
        self.is_to_retry = self.tried.is_some();
    }

    fn next_key(&mut self) -> Option<Event> {
        let event = self.keys.pop().ok()?;
        if let Event::TryHoles(tried) = event {
            self.tried = tried;
        }
        Some(event)
    }

    /// Notes how loud the output is while the window is open. Real-time safe.
    pub fn send_output(&self, channels: [&[f32]; 2]) {
        if self.is_open() {
            // Magnitudes sort as their bits do, and whole numbers are compared many at a time.
            let bits = |sample: &f32| sample.abs().to_bits();
            let highest = channels.into_iter().flatten().map(bits).fold(0, u32::max);
            self.shared.output_peak.fetch_max(highest, Ordering::Relaxed);
        }
    }

    /// Says what the microphone does. Real-time safe.
    pub fn send_microphone(&self, state: MicrophoneState) {
        self.shared.microphone.store(state);
    }

    /// Sends the sound and the inside of the instrument while the window is open. Real-time safe.
    pub fn send(&mut self, instrument: &mut InstrumentSwap, breath_sources: &BreathSources, sound: &[f32]) {
        let is_open = self.is_open();
        instrument.set_scope_on(is_open);
        if !is_open {
            return;
        }
        let room = self.sound.slots().min(sound.len());
        if let Ok(mut chunk) = self.sound.write_chunk(room) {
            let newest = &sound[sound.len() - room..];
            let (first, second) = chunk.as_mut_slices();
            let (a, b) = newest.split_at(first.len());
            first.copy_from_slice(a);
            second.copy_from_slice(b);
            chunk.commit_all();
        }
        let clarinet = instrument.clarinet();
        let scope = clarinet.scope();
        let Some((number, moments)) = scope.capture().filter(|&(number, _)| number != self.shown) else {
            return;
        };
        self.shown = number;
        let inside = self.inside.input_buffer_mut();
        inside.now = clarinet.player_state();
        inside.is_chord = instrument.ensemble().plays_chord();
        inside.moments.copy_from_slice(moments);
        inside.moments_hz = scope.rate_hz(clarinet.internal_rate_hz());
        inside.host_rate_hz = instrument.rate_hz();
        inside.latency_samples = clarinet.latency_samples();
        inside.breath_sources = *breath_sources;
        self.inside.publish();
    }
}
