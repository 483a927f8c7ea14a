//! Which controller the breath comes from.
//!
//! Breath comes from the controllers that wind controllers use: breath controller (CC2, fine part CC34), expression
//! (CC11, fine part CC43) and channel pressure. A wind controller often sends several at once, so they are ranked, CC2 over
//! CC11 over pressure: one is heard until a higher one counts, and from then on only the higher one.
//!
//! A controller counts as breath when
//! - it changes while a key is held, or
//! - it comes a second time, changed, before a key is struck, or
//! - it has come once when a key is struck,
//!
//! and never by its value in a [snapshot](super::snapshot), nor by a value at rest that comes once. At rest are 0 and, for
//! expression, 127: every sequencer sends that as *full*, and it would blow with closing pressure. Once a controller
//! counts, its 0 means that the player does not blow.
//!
//! Channel pressure is also what a keyboard sends of keys that are pressed on. A keyboard has none without a key, a wind controller has: its
//! player blows before a note begins. So while any controller may blow, pressure under a held key makes notes louder than their velocity
//! ([`Heard::Keys`]), and counts as breath once it comes without a key.

use super::snapshot::Place;

/// A controller that breath can come from, the weakest claim first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BreathController {
    /// Channel pressure.
    Pressure,
    /// Expression, CC11.
    Expression,
    /// Breath controller, CC2.
    Breath,
}

impl BreathController {
    const ALL: [Self; 3] = [Self::Pressure, Self::Expression, Self::Breath];

    /// Whether a value that has come once says nothing.
    fn is_rest(self, unit: f32) -> bool {
        unit <= 0.0 || (self == Self::Expression && unit >= 1.0)
    }
}

/// What a controller that moves means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard {
    /// Breath, 0..=1.
    Breath(f32),
    /// The keys are pressed on, 0..=1.
    Keys(f32),
}

/// Which controllers may blow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BreathFrom {
    /// Any, the strongest claim first.
    #[default]
    Any,
    /// This one.
    Only(BreathController),
    /// None: the velocity of keys blows.
    Keys,
}

impl BreathFrom {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Any,
        Self::Only(BreathController::Breath),
        Self::Only(BreathController::Expression),
        Self::Only(BreathController::Pressure),
        Self::Keys,
    ];

    fn allows(self, controller: BreathController) -> bool {
        match self {
            Self::Any => true,
            Self::Only(only) => only == controller,
            Self::Keys => false,
        }
    }
}

/// A part of a controller's value, 0..=127.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The one that every device sends.
    Coarse(u8),
    /// What some devices send beside it.
    Fine(u8),
}

/// A controller with a coarse and, on some devices, a fine part.
#[derive(Clone, Copy, Debug, Default)]
struct Fader {
    /// `None` until it comes: a fine part alone says nothing, and is often another device's button.
    coarse: Option<u8>,
    /// `None` until the device has shown that it sends one.
    fine: Option<u8>,
}

impl Fader {
    fn set(&mut self, part: Part) {
        match part {
            Part::Coarse(value) => self.coarse = Some(value),
            Part::Fine(value) => self.fine = Some(value),
        }
    }

    /// 0..=1: 127ths as long as only the coarse part is known, 16383rds afterwards. The fine part is kept when a coarse
    /// part follows (the specification would zero it), so that devices sending the fine part first end right too.
    fn unit(self) -> Option<f32> {
        let coarse = self.coarse?;
        Some(match self.fine {
            None => f32::from(coarse) / 127.0,
            Some(fine) => f32::from(u16::from(coarse) * 128 + u16::from(fine)) / 16383.0,
        })
    }
}

/// What one channel has sent of one controller.
#[derive(Clone, Copy, Debug, Default)]
struct Claim {
    fader: Fader,
    /// Its latest value, 0..=1.
    unit: Option<f32>,
    /// It will count when a key is struck.
    waits: bool,
    /// Number of the message, to find the latest.
    message: u64,
}

/// The controllers of all channels, and the one that is heard. The channels are one stream. Real-time safe.
#[derive(Clone, Debug, Default)]
pub struct BreathChoice {
    claims: [[Claim; BreathController::ALL.len()]; 16],
    heard: Option<BreathController>,
    messages: u64,
    from: BreathFrom,
}

impl BreathChoice {
    /// Whether breath that belongs to notes is heard.
    pub fn notes_may_blow(&self) -> bool {
        matches!(self.from, BreathFrom::Any | BreathFrom::Only(BreathController::Pressure))
    }

    /// Which controllers may blow from now on; none is heard until it moves. Whether that is another choice.
    pub fn set_from(&mut self, from: BreathFrom) -> bool {
        if self.from == from {
            return false;
        }
        *self = Self { from, ..Self::default() };
        true
    }

    /// The controller that is heard, if any has counted yet.
    pub fn heard(&self) -> Option<BreathController> {
        self.heard
    }

    /// The controller that is heard, and its latest value on a channel, 0..=1, if it has one there.
    pub fn of(&self, channel: usize) -> Option<(BreathController, f32)> {
        let controller = self.heard?;
        Some((controller, self.claims[channel][controller as usize].unit?))
    }

    /// A controller moves. `place` is its place among the channel's controllers; `is_held`: a key is;
    /// `may_be_of_keys`: a keyboard could send it as pressure on keys. Gives what is heard of it.
    pub fn hear(
        &mut self,
        controller: BreathController,
        channel: usize,
        part: Part,
        place: Place,
        is_held: bool,
        may_be_of_keys: bool,
    ) -> Option<Heard> {
        if !self.from.allows(controller) {
            return None;
        }
        self.messages += 1;
        let is_snapshot = matches!(place, Place::Recognised | Place::Within);
        let claim = &mut self.claims[channel][controller as usize];
        if claim.fader.coarse.is_none() && matches!(part, Part::Fine(_)) {
            // Without its coarse part it says nothing, now or later.
            return None;
        }
        if is_snapshot && matches!(part, Part::Fine(_)) && self.heard != Some(controller) {
            // It does not show that the device has a fine part.
            return None;
        }
        claim.fader.set(part);
        let unit = claim.fader.unit()?;
        claim.message = self.messages;
        let before = claim.unit.replace(unit);
        if self.heard >= Some(controller) {
            return (self.heard == Some(controller)).then_some(Heard::Breath(unit));
        }
        // What has begun without a key is a wind controller's, its 0 too.
        if may_be_of_keys && self.from == BreathFrom::Any && (is_held || !claim.waits) {
            claim.waits = false;
            return (!is_snapshot).then_some(Heard::Keys(unit));
        }
        let has_changed = before.is_some_and(|before| before != unit);
        let counts = match place {
            _ if is_snapshot => false,
            _ if is_held => has_changed || (before.is_none() && !controller.is_rest(unit)),
            Place::Again => has_changed,
            _ => false,
        };
        claim.waits = !counts && !is_snapshot;
        if counts {
            self.heard = Some(controller);
        }
        counts.then_some(Heard::Breath(unit))
    }

    /// What this channel has sent was a snapshot: nothing of it waits for a key, and it shows no fine part.
    pub fn forget_waiting(&mut self, channel: usize) {
        for (controller, claim) in BreathController::ALL.into_iter().zip(&mut self.claims[channel]) {
            claim.waits = false;
            if self.heard != Some(controller) {
                claim.fader.fine = None;
                claim.unit = claim.unit.and_then(|_| claim.fader.unit());
            }
        }
    }

    /// A key is struck: the strongest controller that waits counts now. Gives its
    /// breath, 0..=1.
    pub fn settle(&mut self) -> Option<(BreathController, f32)> {
        let mut best: Option<(BreathController, u64, f32)> = None;
        for claims in &mut self.claims {
            for (controller, claim) in BreathController::ALL.into_iter().zip(claims) {
                let unit = claim.unit.filter(|&unit| claim.waits && !controller.is_rest(unit));
                claim.waits = false;
                if let Some(unit) = unit.filter(|_| self.heard < Some(controller))
                    && best.is_none_or(|(other, message, _)| (other, message) < (controller, claim.message))
                {
                    best = Some((controller, claim.message, unit));
                }
            }
        }
        let (controller, _, unit) = best?;
        self.heard = Some(controller);
        Some((controller, unit))
    }
}
