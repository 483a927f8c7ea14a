//! What the microphone does, on its way from the audio thread to the snapshot thread. It goes beside the instrument's moments,
//! which rest while nothing sounds.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::editor::snapshot::MicrophoneState;

/// The latest state, in one number: its kind in the upper half, the bits of its own number in the lower half.
#[derive(Debug, Default)]
pub struct MicrophoneCell(AtomicU64);

impl MicrophoneCell {
    /// Real-time safe.
    pub fn store(&self, state: MicrophoneState) {
        let (kind, number) = match state {
            MicrophoneState::Off => (0_u64, 0.0_f32),
            MicrophoneState::Unconnected => (1, 0.0),
            MicrophoneState::Measuring { left_s } => (2, left_s),
            MicrophoneState::Listening { floor_dbfs } => (3, floor_dbfs),
        };
        self.0.store(kind << 32 | u64::from(number.to_bits()), Ordering::Relaxed);
    }

    /// The state that was stored last.
    pub fn load(&self) -> MicrophoneState {
        let bits = self.0.load(Ordering::Relaxed);
        let number = f32::from_bits(bits as u32);
        match bits >> 32 {
            1 => MicrophoneState::Unconnected,
            2 => MicrophoneState::Measuring { left_s: number },
            3 => MicrophoneState::Listening { floor_dbfs: number },
            _ => MicrophoneState::Off,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_arrives() {
        let cell = MicrophoneCell::default();
        for state in [
            MicrophoneState::Unconnected,
            MicrophoneState::Measuring { left_s: 1.5 },
            MicrophoneState::Listening { floor_dbfs: -42.0 },
            MicrophoneState::Off,
        ] {
            cell.store(state);
            assert_eq!(cell.load(), state);
        }
    }
}
