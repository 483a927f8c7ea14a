//! A delay line that is written and read in pieces: every piece lies in one run of memory, so that loops over it vectorise.

/// Most samples of a piece.
pub const PIECE: usize = 64;

/// A ring whose first [`PIECE`] samples are repeated behind its end.
#[derive(Clone, Debug)]
pub struct DelayLine {
    memory: Vec<f32>,
    /// Samples of the ring, a power of two, less one.
    mask: usize,
    /// Where the next piece begins.
    at: usize,
}

impl DelayLine {
    /// Silent, for delays up to `longest` samples. Allocates.
    pub fn new(longest: usize) -> Self {
        let samples = (longest + PIECE).next_power_of_two();
        Self { memory: vec![0.0; samples + PIECE], mask: samples - 1, at: 0 }
    }

    /// Writes the next piece.
    #[inline(always)]
    pub fn write(&mut self, piece: &[f32]) {
        let samples = self.mask + 1;
        let first = piece.len().min(samples - self.at);
        self.memory[self.at..self.at + first].copy_from_slice(&piece[..first]);
        self.memory[..piece.len() - first].copy_from_slice(&piece[first..]);
        if self.at < PIECE || first < piece.len() {
            self.memory.copy_within(..PIECE, samples);
        }
        self.at = (self.at + piece.len()) & self.mask;
    }

    /// `samples` that were to be heard `delay` after they were written, the first one now. Before the piece of now is written,
    /// `delay` must be at least `samples`.
    #[inline(always)]
    pub fn read(&self, delay: usize, samples: usize) -> &[f32] {
        let from = self.at.wrapping_sub(delay) & self.mask;
        &self.memory[from..from + samples]
    }

    /// As [`read`](Self::read), after the piece of now was written: `delay` may be 0.
    #[inline(always)]
    pub fn read_written(&self, delay: usize, samples: usize) -> &[f32] {
        self.read(delay + samples, samples)
    }

    /// Silence.
    pub fn clear(&mut self) {
        self.memory.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_after_its_delay_in_pieces_of_any_size() {
        let longest = 150;
        let mut line = DelayLine::new(longest);
        let (mut written, mut n) = (0, 0);
        while written < 3_000 {
            n = (n * 7 + 11) % PIECE + 1;
            let piece: Vec<f32> = (written..written + n).map(|t| t as f32 + 1.0).collect();
            let value = |t: usize, delay: usize| if t < delay { 0.0 } else { (t - delay) as f32 + 1.0 };
            for delay in [n, n + 3, longest] {
                let read: Vec<f32> = (0..n).map(|k| value(written + k, delay)).collect();
                assert_eq!(line.read(delay, n), read, "{delay} at {written}");
            }
            line.write(&piece);
            for delay in [0, 1, longest - 1] {
                let read: Vec<f32> = (0..n).map(|k| value(written + k, delay)).collect();
                assert_eq!(line.read_written(delay, n), read, "{delay} at {written}");
            }
            written += n;
        }
    }
}
