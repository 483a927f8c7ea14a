//! The sound on its way from the audio thread to the take, while one is recorded.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::SharedKnob;
use chalumeau_knob::touch::heard::{Heard, HeardTrack};

/// Samples under way: 0.3 s at 192 kHz. The slow work takes them every 10 ms.
const SAMPLES: usize = 65_536;
/// Blocks under way: as many as fit if each has 64 samples.
const BLOCKS: usize = SAMPLES / 64;

/// One block of sound.
#[derive(Clone, Copy)]
struct Block {
    /// When it was due, us since the link's epoch.
    due_us: i64,
    rate_hz: f64,
    samples: usize,
}

/// The audio thread's end. Real-time safe.
pub struct SoundSender {
    shared: Arc<SharedKnob>,
    sound: rtrb::Producer<f32>,
    blocks: rtrb::Producer<Block>,
}

/// The slow work's end.
pub struct SoundListener {
    sound: rtrb::Consumer<f32>,
    blocks: rtrb::Consumer<Block>,
    track: HeardTrack,
}

/// Both ends. Allocates.
pub fn sound_channel(shared: Arc<SharedKnob>) -> (SoundSender, SoundListener) {
    let (sound_in, sound) = rtrb::RingBuffer::new(SAMPLES);
    let (blocks_in, blocks) = rtrb::RingBuffer::new(BLOCKS);
    let listener = SoundListener { sound, blocks, track: HeardTrack::default() };
    (SoundSender { shared, sound: sound_in, blocks: blocks_in }, listener)
}

impl SoundSender {
    /// Sends a block that was due at `due_us`, if a take is recorded. A block without room is left out as a whole.
    pub fn send(&mut self, due_us: i64, rate_hz: f64, sound: &[f32]) {
        if !self.shared.is_recording.load(Ordering::Relaxed) || self.blocks.slots() == 0 {
            return;
        }
        let Ok(mut chunk) = self.sound.write_chunk(sound.len()) else { return };
        let (first, second) = chunk.as_mut_slices();
        let (a, b) = sound.split_at(first.len());
        first.copy_from_slice(a);
        second.copy_from_slice(b);
        chunk.commit_all();
        let _ = self.blocks.push(Block { due_us, rate_hz, samples: sound.len() });
    }
}

impl SoundListener {
    /// Takes in what has come. Allocates.
    pub fn listen(&mut self) {
        while let Ok(block) = self.blocks.pop() {
            let Ok(chunk) = self.sound.read_chunk(block.samples) else { return };
            let (first, second) = chunk.as_slices();
            self.track.hear(block.due_us, block.rate_hz, &[first, second].concat());
            chunk.commit_all();
        }
    }

    /// Time until which everything is known, us.
    pub fn known_until_us(&self) -> u64 {
        self.track.known_until_us().unwrap_or(0)
    }

    /// What was heard at a time, us.
    pub fn at(&self, t_us: u64) -> Heard {
        self.track.at(t_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sound_of_a_recording_arrives_with_its_time() {
        let shared = Arc::new(SharedKnob::new(Arc::default()));
        let (mut sender, mut listener) = sound_channel(shared.clone());
        let block: Vec<f32> =
            (0..480).map(|n| 0.1 * (std::f32::consts::TAU * n as f32 / 48.0).sin()).collect();
        let play = |sender: &mut SoundSender, listener: &mut SoundListener| {
            for n in 0..100 {
                sender.send(5_000_000 + 10_000 * n, 48_000.0, &block);
                if n % 7 == 0 {
                    listener.listen();
                }
            }
            listener.listen();
        };
        play(&mut sender, &mut listener);
        assert_eq!(listener.known_until_us(), 0, "nothing is sent while nothing is recorded");
        shared.is_recording.store(true, Ordering::Relaxed);
        play(&mut sender, &mut listener);
        assert!(listener.known_until_us() > 5_800_000);
        let heard = listener.at(5_500_000);
        assert!((heard.f0_hz.unwrap_or_default() - 1_000.0).abs() < 1.0, "{heard:?}");
        // Nobody takes the sound: blocks are left out, and what comes afterwards has its own time.
        for n in 0..1_000 {
            sender.send(10_000_000 + 10_000 * n, 48_000.0, &block);
        }
        listener.listen();
        sender.send(30_000_000, 48_000.0, &block);
        play(&mut sender, &mut listener);
        assert!(listener.at(5_500_000).f0_hz.is_some());
    }
}
