//! What fingers and keys of a clarinet can do: `data/boehm_fingers.toml`.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use crate::bore::instrument_file::{HoleKind, InstrumentFile};

/// Fingers that a mechanism can have.
pub const MAX_FINGERS: usize = 10;

/// One combination of open holes, and how it is reached with the least effort.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grip {
    /// One bit a hole, set if it is open, in the order of the file from the lowest bit.
    pub open: u64,
    /// Position of each finger.
    pub positions: [u8; MAX_FINGERS],
    /// Sum of the fingers' efforts.
    pub effort: u8,
}

/// Fingers, and pads that rings move.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mechanism {
    ring: Vec<Ring>,
    finger: Vec<Finger>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ring {
    pad: String,
    closed_with: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Finger {
    #[expect(dead_code, reason = "for a reader of the file")]
    name: String,
    positions: Vec<Position>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Position {
    presses: String,
    #[serde(default)]
    closes: String,
    #[serde(default)]
    opens: String,
    #[serde(default)]
    effort: u8,
}

static BOEHM: LazyLock<Mechanism> = LazyLock::new(|| {
    let text = include_str!("../../../data/boehm_fingers.toml");
    // PANIC: the text is a constant of this program and a test reads it.
    toml::from_str(text).expect("the mechanism is valid")
});

impl Mechanism {
    /// That of a clarinet with the Boehm system.
    pub fn boehm() -> &'static Self {
        &BOEHM
    }

    /// All combinations of open holes that the fingers can make on an instrument, each once, in order of their bits.
    /// Allocates.
    pub fn grips(&self, file: &InstrumentFile) -> Vec<Grip> {
        let bits = |names: &str| {
            let holes = names.split_whitespace().filter_map(|name| file.hole(name));
            holes.fold(0_u64, |bits, hole| bits | 1 << hole)
        };
        let at_rest = file.holes.iter().enumerate().filter(|(_, hole)| hole.kind != HoleKind::KeyClosed);
        let at_rest = at_rest.fold(0_u64, |bits, (hole, _)| bits | 1 << hole);
        let rings: Vec<(u64, u64)> =
            self.ring.iter().map(|ring| (bits(&ring.pad), bits(&ring.closed_with))).collect();
        // Closed and opened holes and effort of each finger's positions.
        let fingers: Vec<Vec<(u64, u64, u8)>> = self
            .finger
            .iter()
            .take(MAX_FINGERS)
            .map(|finger| {
                finger.positions.iter().map(|p| (bits(&p.closes), bits(&p.opens), p.effort)).collect()
            })
            .collect();
        let mut grips: BTreeMap<u64, Grip> = BTreeMap::new();
        let mut positions = [0_u8; MAX_FINGERS];
        loop {
            let (mut closed, mut opened, mut effort) = (0, 0, 0);
            for (finger, &position) in fingers.iter().zip(&positions) {
                let (closes, opens, needs) = finger[usize::from(position)];
                (closed, opened, effort) = (closed | closes, opened | opens, effort + needs);
            }
            for &(pad, with) in &rings {
                if closed & with != 0 {
                    closed |= pad;
                }
            }
            let open = (at_rest | opened) & !closed;
            let grip = Grip { open, positions, effort };
            let known = grips.entry(open).or_insert(grip);
            if effort < known.effort {
                *known = grip;
            }
            // The next combination, as a counter with a wheel for each finger.
            let moved = fingers.iter().zip(&mut positions).any(|(finger, position)| {
                let last = usize::from(*position) + 1 == finger.len();
                *position = if last { 0 } else { *position + 1 };
                !last
            });
            if !moved {
                return grips.into_values().collect();
            }
        }
    }

    /// What the fingers press, for a reader.
    pub fn words(&self, grip: &Grip) -> String {
        let pressed = self.finger.iter().zip(&grip.positions).filter_map(|(finger, &position)| {
            let presses = finger.positions.get(usize::from(position))?.presses.as_str();
            (!presses.is_empty()).then_some(presses)
        });
        pressed.collect::<Vec<_>>().join(" ")
    }
}

impl Grip {
    /// Fingers that move on the way to another grip.
    pub fn moves(&self, to: &Self) -> usize {
        self.positions.iter().zip(&to.positions).filter(|(a, b)| a != b).count()
    }
}
