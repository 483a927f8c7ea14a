//! Vibrato, growl, flutter tongue and subtone from controllers: the mod wheel (CC1) does one of them, CC18 growls,
//! CC19 flutters, CC20 plays subtone.
//!
//! One instrument plays all channels, so the last value of any channel counts. Where wheel and controller do the same, the
//! larger one counts. CC18 to CC20 have no meaning of their own in MIDI 1.0.

use crate::event::{Event, Technique};

/// The mod wheel.
pub const WHEEL: u8 = 1;
/// The first controller of [`ORDER`].
const FIRST: u8 = 18;
/// What CC18, CC19 and CC20 do.
const ORDER: [Technique; 3] = [Technique::Growl, Technique::Flutter, Technique::Subtone];

/// What the mod wheel (CC1) does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wheel {
    /// Vibrato of breath and lip.
    #[default]
    Vibrato,
    /// One of the techniques.
    Technique(Technique),
    /// Nothing.
    Nothing,
}

impl Wheel {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 5] = [
        Self::Vibrato,
        Self::Technique(Technique::Growl),
        Self::Technique(Technique::Flutter),
        Self::Technique(Technique::Subtone),
        Self::Nothing,
    ];
}

/// Controller values, 0..=127.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TechniqueControllers {
    wheel: u8,
    /// CC18, CC19, CC20.
    own: [u8; ORDER.len()],
}

impl TechniqueControllers {
    /// Takes a controller; whether it is one of these.
    pub fn set(&mut self, cc: u8, value: u8) -> bool {
        let own = cc.checked_sub(FIRST).and_then(|at| self.own.get_mut(usize::from(at)));
        let place = if cc == WHEEL { Some(&mut self.wheel) } else { own };
        place.map(|place| *place = value).is_some()
    }
}

/// The controllers, and what was said last.
#[derive(Clone, Copy, Debug, Default)]
pub struct AskedTechniques {
    /// The controllers now.
    pub controllers: TechniqueControllers,
    /// What the wheel does.
    pub wheel: Wheel,
    vibrato: u8,
    said: [u8; ORDER.len()],
}

impl AskedTechniques {
    /// What has changed.
    pub fn changed(&mut self) -> [Option<Event>; 1 + ORDER.len()] {
        let TechniqueControllers { wheel, own } = self.controllers;
        let unit = |value: u8| f32::from(value) / 127.0;
        let vibrato = if self.wheel == Wheel::Vibrato { wheel } else { 0 };
        let mut events = [None; 1 + ORDER.len()];
        if std::mem::replace(&mut self.vibrato, vibrato) != vibrato {
            events[0] = Some(Event::Vibrato(unit(vibrato)));
        }
        for (at, which) in ORDER.into_iter().enumerate() {
            let by_wheel = if self.wheel == Wheel::Technique(which) { wheel } else { 0 };
            let value = own[at].max(by_wheel);
            if std::mem::replace(&mut self.said[at], value) != value {
                events[1 + at] = Some(Event::Technique { which, amount: unit(value) });
            }
        }
        events
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(techniques: &mut AskedTechniques) -> Vec<Event> {
        techniques.changed().into_iter().flatten().collect()
    }

    #[test]
    fn the_wheel_does_what_was_chosen_and_lets_go_of_what_it_did() {
        let mut techniques = AskedTechniques::default();
        assert!(techniques.controllers.set(1, 127) && !techniques.controllers.set(17, 9));
        assert!(!techniques.controllers.set(21, 9));
        assert_eq!(said(&mut techniques), [Event::Vibrato(1.0)]);
        assert_eq!(said(&mut techniques), [], "said once");
        techniques.wheel = Wheel::Technique(Technique::Flutter);
        let flutter = |amount| Event::Technique { which: Technique::Flutter, amount };
        assert_eq!(said(&mut techniques), [Event::Vibrato(0.0), flutter(1.0)]);
        techniques.wheel = Wheel::Nothing;
        assert_eq!(said(&mut techniques), [flutter(0.0)]);
    }

    #[test]
    fn the_larger_of_wheel_and_controller_counts() {
        let mut techniques =
            AskedTechniques { wheel: Wheel::Technique(Technique::Growl), ..AskedTechniques::default() };
        let growl = |amount| Event::Technique { which: Technique::Growl, amount };
        techniques.controllers.set(18, 127);
        assert_eq!(said(&mut techniques), [growl(1.0)]);
        techniques.controllers.set(1, 64);
        assert_eq!(said(&mut techniques), []);
        techniques.controllers.set(18, 0);
        assert_eq!(said(&mut techniques), [growl(64.0 / 127.0)]);
        techniques.controllers.set(20, 127);
        assert_eq!(said(&mut techniques), [Event::Technique { which: Technique::Subtone, amount: 1.0 }]);
    }
}
