//! What is held down at a MIDI port, so that it can be let go when the port goes.

/// The sustain pedal.
const SUSTAIN: u8 = 64;

/// Keys and pedals that are down. Real-time safe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

    /// What is not down at another port, too.
    #[must_use]
    pub fn without(mut self, other: &Self) -> Self {
        self.keys.iter_mut().zip(other.keys).for_each(|(keys, others)| *keys &= !others);
        self.pedals &= !other.pedals;
        self
    }

    /// The messages that let all of it go, the pedals first.
    pub fn endings(self) -> Endings {
        Endings(self)
    }
}

/// See [`HeldKeys::endings`]. Real-time safe.
#[derive(Debug)]
pub struct Endings(HeldKeys);

impl Iterator for Endings {
    type Item = [u8; 3];

    fn next(&mut self) -> Option<[u8; 3]> {
        let Self(HeldKeys { keys, pedals }) = self;
        if *pedals != 0 {
            let channel = pedals.trailing_zeros();
            *pedals &= *pedals - 1;
            return Some([0xB0 | channel as u8, SUSTAIN, 0]);
        }
        let channel = keys.iter().position(|&keys| keys != 0)?;
        let key = keys[channel].trailing_zeros();
        keys[channel] &= keys[channel] - 1;
        Some([0x80 | channel as u8, key as u8, 0])
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

    fn endings(held: HeldKeys) -> Vec<[u8; 3]> {
        held.endings().collect()
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
        assert_eq!(endings(gone), [[0xB0, SUSTAIN, 0], [0x80, 60, 0], [0x80, 67, 0], [0x85, 64, 0]]);
        // Another keyboard holds one of the keys, and the pedal; a third has the key of another channel.
        let others = [after(&[[0x90, 60, 1], [0xB0, SUSTAIN, 127]]), after(&[[0x94, 64, 1]])];
        let rest = others.iter().fold(gone, HeldKeys::without);
        assert_eq!(endings(rest), [[0x80, 67, 0], [0x85, 64, 0]]);
        assert!(endings(HeldKeys::default().without(&others[0])).is_empty());
        // What has been let go is down no more.
        assert_eq!(
            endings(gone).iter().fold(gone, |mut held, bytes| {
                held.hear(bytes);
                held
            }),
            HeldKeys::default()
        );
    }
}
