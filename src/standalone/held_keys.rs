//! What is held down at a MIDI port, so that it can be let go when the port goes.

/// The sustain pedal.
const SUSTAIN: u8 = 64;

/// Keys and pedals that are down.
#[derive(Clone, Copy, Debug, Default)]
pub struct HeldKeys {
    /// The keys of each channel, a bit each.
    keys: [u128; 16],
    /// The channels whose sustain pedal is down, a bit each.
    pedals: u16,
}

impl HeldKeys {
    /// Remembers what a message puts down or lets go.
    pub fn hear(&mut self, bytes: &[u8]) {
        let &[status, first, second] = bytes else { return };
        let (channel, key) = (usize::from(status & 15), 1 << (first & 127));
        match status & 0xF0 {
            0x90 if second > 0 => self.keys[channel] |= key,
            0x80 | 0x90 => self.keys[channel] &= !key,
            0xB0 if first == SUSTAIN && second >= 64 => self.pedals |= 1 << channel,
            0xB0 if first == SUSTAIN => self.pedals &= !(1 << channel),
            _ => {}
        }
    }

    /// The messages that let all of it go, but a pedal that is down at one of the others, too. A key that is down there stays down:
    /// the instrument counts how often each was struck.
    pub fn endings(&self, others: &[Self]) -> Vec<[u8; 3]> {
        let elsewhere = others.iter().fold(0, |pedals, other| pedals | other.pedals);
        let mut all = Vec::new();
        for channel in 0..16_u8 {
            if (self.pedals & !elsewhere) >> channel & 1 == 1 {
                all.push([0xB0 | channel, SUSTAIN, 0]);
            }
            let keys = self.keys[usize::from(channel)];
            all.extend((0..128_u8).filter(|key| keys >> key & 1 == 1).map(|key| [0x80 | channel, key, 0]));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is down after these messages.
    fn after(messages: &[[u8; 3]]) -> HeldKeys {
        let mut held = HeldKeys::default();
        messages.iter().for_each(|bytes| held.hear(bytes));
        held
    }

    #[test]
    fn a_port_that_goes_ends_its_own_notes_alone() {
        let gone = after(&[
            [0x90, 60, 100],
            [0x90, 62, 90],
            [0x90, 62, 0],
            [0x95, 64, 1],
            [0x85, 65, 0],
            [0x90, 67, 80],
            [0xB0, SUSTAIN, 64],
            [0xB5, SUSTAIN, 63],
            [0xB0, 1, 127],
        ]);
        let keys = [[0x80, 60, 0], [0x80, 67, 0], [0x85, 64, 0]];
        assert_eq!(gone.endings(&[]), [&[[0xB0, SUSTAIN, 0]], keys.as_slice()].concat());
        // Another keyboard holds the pedal, and one of the keys, which was struck twice then.
        let others = [after(&[[0x90, 60, 1], [0xB0, SUSTAIN, 127]]), after(&[[0x94, 64, 1]])];
        assert_eq!(gone.endings(&others), keys);
        assert!(HeldKeys::default().endings(&others).is_empty());
    }
}
