//! What fingers and keys of a clarinet can do: `data/boehm_fingers.toml`.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use crate::bore::instrument_file::{HoleKind, InstrumentFile};

/// Fingers that a mechanism can have: those of a Boehm clarinet, and of holes that it does not have.
pub const MAX_FINGERS: usize = 18;

/// Most combinations of positions that are looked through with fingers beyond those of a Boehm clarinet, which has 144000: some seconds.
const MOST_POSITIONS: usize = 600_000;

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
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mechanism {
    ring: Vec<Ring>,
    finger: Vec<Finger>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ring {
    pad: String,
    closed_with: String,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Finger {
    #[expect(dead_code, reason = "for a reader of the file")]
    name: String,
    positions: Vec<Position>,
}

#[derive(Clone, Debug, Deserialize)]
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

    /// That of a clarinet with the Boehm system, with a further finger for each finger hole of this instrument that such a clarinet does not have, as
    /// long as the search stays within some seconds. Allocates.
    pub fn of(file: &InstrumentFile) -> Self {
        let mut all = BOEHM.clone();
        let is_here = |finger: &Vec<Held>| finger.iter().filter(|held| held.is_here).count();
        let mut positions: usize = BOEHM.on(file).fingers.iter().map(is_here).product();
        for name in BOEHM.unmoved(file) {
            let is_finger = file.hole(&name).is_some_and(|hole| file.holes[hole].kind == HoleKind::Finger);
            if !is_finger || all.finger.len() == MAX_FINGERS || 2 * positions > MOST_POSITIONS {
                continue;
            }
            positions *= 2;
            let open =
                Position { presses: String::new(), closes: String::new(), opens: String::new(), effort: 0 };
            let covered = Position { presses: name.clone(), closes: name.clone(), ..open.clone() };
            all.finger.push(Finger { name, positions: vec![open, covered] });
        }
        all
    }

    /// Holes whose kind contradicts what moves them, from the top: a key would open one that stands open at rest, or a finger or pad would close one
    /// that is closed. Such a hole never moves. With whether it stands open. Allocates.
    pub fn contrary(&self, file: &InstrumentFile) -> Vec<(String, bool)> {
        let on = self.on(file);
        let pads = on.rings.iter().fold(0, |bits, (pad, _)| bits | pad);
        let all = |of: fn(&Held) -> u64| on.fingers.iter().flatten().fold(0, |bits, held| bits | of(held));
        let (closes, opens) = (all(|held| held.closes) | pads, all(|held| held.opens));
        let never = (opens & !closes & on.at_rest) | (closes & !opens & !on.at_rest);
        let holes = file.holes.iter().enumerate().filter(|(hole, _)| never >> hole & 1 == 1);
        holes.map(|(hole, of)| (of.name.clone(), on.at_rest >> hole & 1 == 1)).collect()
    }

    /// All combinations of open holes that the fingers can make on an instrument, each once, in order of their bits.
    /// Allocates.
    pub fn grips(&self, file: &InstrumentFile) -> Vec<Grip> {
        let mut grips: BTreeMap<u64, Grip> = BTreeMap::new();
        self.on(file).each(
            |_| true,
            |grip| {
                let known = grips.entry(grip.open).or_insert(grip);
                if grip.effort < known.effort {
                    *known = grip;
                }
            },
        );
        grips.into_values().collect()
    }

    /// How the fingers open just these holes, one bit each, with the least effort; `None` if they cannot. Allocates.
    pub fn grip(&self, file: &InstrumentFile, open: u64) -> Option<Grip> {
        let mut found: Option<Grip> = None;
        let fits = |position: &Held| position.closes & open == 0 && position.opens & !open == 0;
        self.on(file).each(fits, |grip| {
            if grip.open == open && found.is_none_or(|found| grip.effort < found.effort) {
                found = Some(grip);
            }
        });
        found
    }

    /// Names of the holes of an instrument that no finger opens or closes, from the top. Allocates.
    pub fn unmoved(&self, file: &InstrumentFile) -> Vec<String> {
        let on = self.on(file);
        let pads = on.rings.iter().fold(0, |bits, (pad, _)| bits | pad);
        let moved = on.fingers.iter().flatten().fold(pads, |bits, held| bits | held.closes | held.opens);
        let unmoved = file.holes.iter().enumerate().filter(|(hole, _)| moved >> hole & 1 == 0);
        unmoved.map(|(_, hole)| hole.name.clone()).collect()
    }

    /// The mechanism on the holes of an instrument.
    fn on(&self, file: &InstrumentFile) -> OnInstrument {
        let bits = |names: &str| {
            let holes = names.split_whitespace().filter_map(|name| file.hole(name));
            holes.fold(0_u64, |bits, hole| bits | 1 << hole)
        };
        let at_rest = file.holes.iter().enumerate().filter(|(_, hole)| hole.kind != HoleKind::KeyClosed);
        let held = |p: &Position| {
            let own_hole = p.closes.split_whitespace().chain(p.opens.split_whitespace()).next();
            let is_here = own_hole.is_none_or(|name| file.hole(name).is_some());
            let bits = |names: &str| if is_here { bits(names) } else { 0 };
            Held { is_here, closes: bits(&p.closes), opens: bits(&p.opens), effort: p.effort }
        };
        OnInstrument {
            at_rest: at_rest.fold(0_u64, |bits, (hole, _)| bits | 1 << hole),
            rings: self.ring.iter().map(|ring| (bits(&ring.pad), bits(&ring.closed_with))).collect(),
            fingers: self
                .finger
                .iter()
                .take(MAX_FINGERS)
                .map(|finger| finger.positions.iter().map(held).collect())
                .collect(),
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

/// What a finger does in a position, holes one bit each.
struct Held {
    /// Whether the instrument has this key: the first hole that the position names.
    is_here: bool,
    closes: u64,
    opens: u64,
    effort: u8,
}

/// A mechanism on the holes of an instrument, one bit each.
struct OnInstrument {
    at_rest: u64,
    /// Pads, and the holes that close them.
    rings: Vec<(u64, u64)>,
    /// Positions of each finger.
    fingers: Vec<Vec<Held>>,
}

impl OnInstrument {
    /// Calls `found` with each combination of those positions that are `allowed`.
    fn each(&self, allowed: impl Fn(&Held) -> bool, mut found: impl FnMut(Grip)) {
        let allowed = |finger: &Vec<Held>| {
            let positions = finger.iter().enumerate().filter(|(_, held)| held.is_here && allowed(held));
            positions.map(|(position, _)| position as u8).collect()
        };
        let allowed: Vec<Vec<u8>> = self.fingers.iter().map(allowed).collect();
        if allowed.iter().any(Vec::is_empty) {
            return;
        }
        let mut wheels = [0_usize; MAX_FINGERS];
        loop {
            let mut positions = [0; MAX_FINGERS];
            let (mut closed, mut opened, mut effort) = (0, 0, 0);
            for (finger, held) in self.fingers.iter().enumerate() {
                positions[finger] = allowed[finger][wheels[finger]];
                let Held { closes, opens, effort: needs, .. } = held[usize::from(positions[finger])];
                (closed, opened, effort) = (closed | closes, opened | opens, effort + needs);
            }
            for &(pad, with) in &self.rings {
                if closed & with != 0 {
                    closed |= pad;
                }
            }
            found(Grip { open: (self.at_rest | opened) & !closed, positions, effort });
            // The next combination, as a counter with a wheel for each finger.
            let moved = allowed.iter().zip(&mut wheels).any(|(positions, wheel)| {
                let last = *wheel + 1 == positions.len();
                *wheel = if last { 0 } else { *wheel + 1 };
                !last
            });
            if !moved {
                return;
            }
        }
    }
}

impl Grip {
    /// Fingers that move on the way to another grip.
    pub fn moves(&self, to: &Self) -> usize {
        self.positions.iter().zip(&to.positions).filter(|(a, b)| a != b).count()
    }

    /// Whether each hole of the file is open.
    pub fn holes(&self, file: &InstrumentFile) -> Vec<bool> {
        (0..file.holes.len()).map(|hole| self.open >> hole & 1 == 1).collect()
    }

    /// Names of the open holes.
    pub fn open_names<'a>(&self, file: &'a InstrumentFile) -> impl Iterator<Item = &'a str> {
        let named = self.holes(file).into_iter().zip(&file.holes);
        named.filter_map(|(is_open, hole)| is_open.then_some(hole.name.as_str()))
    }
}
