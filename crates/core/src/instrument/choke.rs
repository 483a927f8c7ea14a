//! The end of a note that is cut off: a short fade, and then nothing of it is left in bore and reed.

use crate::instrument::channels::Channels;

/// Length of the fade, s: as long as a drum machine's choke needs not to click, and below the 5 ms in which it must be
/// silent, with room for the filter behind it.
const FADE_S: f64 = 0.003;

/// A fade in samples of the host. Real-time safe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choke {
    samples: u32,
    /// Samples until silence; 0 while nothing fades.
    left: u32,
}

impl Choke {
    /// Nothing fades.
    pub fn new(host_rate_hz: f64) -> Self {
        Self { samples: (FADE_S * host_rate_hz).round().max(1.0) as u32, left: 0 }
    }

    /// Begins a fade, unless one is under way.
    pub fn begin(&mut self) {
        if self.left == 0 {
            self.left = self.samples;
        }
    }

    /// Forgets the fade.
    pub fn reset(&mut self) {
        self.left = 0;
    }

    /// How many of the next `samples` go up to the end of the fade.
    pub fn reach(&self, samples: usize) -> usize {
        if self.left == 0 { samples } else { samples.min(self.left as usize) }
    }

    /// Fades samples, as many as [`reach`](Self::reach) allows. True at the end of the fade.
    pub fn fade(&mut self, mut out: Channels) -> bool {
        if self.left == 0 {
            return false;
        }
        out.each_moment(|| {
            self.left -= 1;
            self.left as f32 / self.samples as f32
        });
        self.left == 0
    }
}
