//! The audio thread's end of the window.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::Shared;
use crate::plugin::breaths::Breaths;
use crate::plugin::instrument::Bench;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::watch::{MOMENTS, Moment, Now};

/// Samples of sound on their way to the looker: a second at 48 kHz.
const SOUND: usize = 65_536;
/// Keys of the window on their way to the audio thread.
const KEYS: usize = 256;
/// Keys taken in one block; more come with the next.
const KEYS_A_BLOCK: usize = 8;

/// The inside of the instrument at one moment.
#[derive(Clone)]
pub struct Inside {
    /// What the player is at.
    pub now: Now,
    /// Inside the mouthpiece, oldest first.
    pub moments: Box<[Moment; MOMENTS]>,
    /// Moments a second.
    pub moments_hz: f64,
    /// Samples a second of the sound.
    pub host_rate_hz: f64,
    /// Delay of the plugin.
    pub latency_samples: u32,
    /// Where breath has come from.
    pub breaths: Breaths,
}

impl Default for Inside {
    fn default() -> Self {
        Self {
            now: Now { sounding: None, fingering: 0, mouth_kpa: 0.0 },
            moments: Box::new([Moment::default(); MOMENTS]),
            moments_hz: 48_000.0,
            host_rate_hz: 48_000.0,
            latency_samples: 0,
            breaths: Breaths::default(),
        }
    }
}

/// The audio thread's end. [audio thread]
pub struct Audio {
    shared: Arc<Shared>,
    inside: triple_buffer::Input<Inside>,
    sound: rtrb::Producer<f32>,
    keys: rtrb::Consumer<Event>,
    /// Number of the last picture.
    shown: u64,
}

/// The other ends.
pub struct Ends {
    /// The inside, for the looker.
    pub inside: triple_buffer::Output<Inside>,
    /// What was heard, for the looker.
    pub sound: rtrb::Consumer<f32>,
    /// Keys pressed in the window.
    pub keys: rtrb::Producer<Event>,
}

impl Audio {
    /// Allocates.
    pub(super) fn new(shared: Arc<Shared>) -> (Self, Ends) {
        let (inside_in, inside) = triple_buffer::triple_buffer(&Inside::default());
        let (sound_in, sound) = rtrb::RingBuffer::new(SOUND);
        let (keys_in, keys) = rtrb::RingBuffer::new(KEYS);
        let audio = Self { shared, inside: inside_in, sound: sound_in, keys, shown: 0 };
        (audio, Ends { inside, sound, keys: keys_in })
    }

    /// Keys that were pressed in the window since the last block. Real-time safe.
    pub fn keys(&mut self) -> [Option<Timed<Event>>; KEYS_A_BLOCK] {
        std::array::from_fn(|_| self.keys.pop().ok().map(|event| Timed { at: 0, event }))
    }

    /// Leaves what was heard and what is inside, while the window is open. Real-time safe.
    pub fn show(&mut self, bench: &mut Bench, breaths: &Breaths, heard: &[f32]) {
        let is_open = self.shared.is_open.load(Ordering::Relaxed);
        bench.set_watched(is_open);
        if !is_open {
            return;
        }
        let room = self.sound.slots().min(heard.len());
        if let Ok(mut chunk) = self.sound.write_chunk(room) {
            let newest = &heard[heard.len() - room..];
            let (first, second) = chunk.as_mut_slices();
            let (a, b) = newest.split_at(first.len());
            first.copy_from_slice(a);
            second.copy_from_slice(b);
            chunk.commit_all();
        }
        let clarinet = bench.clarinet();
        let watch = clarinet.watch();
        let Some((number, moments)) = watch.picture().filter(|&(number, _)| number != self.shown) else {
            return;
        };
        self.shown = number;
        let inside = self.inside.input_buffer_mut();
        inside.now = clarinet.now();
        inside.moments.copy_from_slice(moments);
        inside.moments_hz = watch.rate_hz(clarinet.internal_rate_hz());
        inside.host_rate_hz = bench.rate_hz();
        inside.latency_samples = clarinet.latency_samples();
        inside.breaths = *breaths;
        self.inside.publish();
    }
}
