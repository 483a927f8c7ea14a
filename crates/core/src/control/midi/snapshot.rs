//! Tells a snapshot of all controllers, which some hosts send when a project starts, from playing.
//!
//! A snapshot sends each controller of a channel once; a hand moves one controller many times; a file or a host that
//! wants a sound sets a few. So many different controllers on one channel, one after another, none of them twice and no
//! note between them, are a snapshot. What it says is where the host believes the controllers to be, not what anybody
//! plays. The rule needs no clock, so a snapshot over a slow cable is known like one that comes within one sample.

/// Different controllers without a repeat and without a note that make a snapshot, by judgement: more than a file sets up for
/// a General MIDI device, and far fewer than the 120 or more that hosts send.
const SNAPSHOT: u32 = 32;
/// Channel pressure, as the number of a controller.
pub const PRESSURE: u8 = 128;

/// What a message is within its channel's run of controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The first of its controller.
    First,
    /// The second of its controller: something moves.
    Again,
    /// It shows that the run is a snapshot.
    Recognised,
    /// One more of a snapshot.
    Within,
}

/// The controllers that one channel has sent since the last note, none of them twice.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// A bit for each controller.
    seen: u128,
    has_pressed: bool,
    is_snapshot: bool,
}

impl Run {
    /// Whether nothing has come yet.
    pub fn is_empty(&self) -> bool {
        self.seen == 0 && !self.has_pressed
    }

    /// Whether the controllers were a snapshot, so far.
    pub fn is_snapshot(&self) -> bool {
        self.is_snapshot
    }

    /// Whether a controller, 0..=127 or [`PRESSURE`], has been sent.
    pub fn has(&self, controller: u8) -> bool {
        if controller == PRESSURE { self.has_pressed } else { self.seen >> (controller & 127) & 1 == 1 }
    }

    /// A message of a controller, 0..=127 or [`PRESSURE`]. A second one begins a new run.
    pub fn place(&mut self, controller: u8) -> Place {
        let before = *self;
        if before.has(controller) {
            *self = Self::default();
        }
        if controller == PRESSURE {
            self.has_pressed = true;
        } else {
            self.seen |= 1 << (controller & 127);
        }
        match (before.has(controller), before.is_snapshot) {
            // The next snapshot, or the first movement after one: its next message will tell.
            (true, true) => Place::First,
            (true, false) => Place::Again,
            (false, true) => Place::Within,
            (false, false) if self.seen.count_ones() >= SNAPSHOT => {
                self.is_snapshot = true;
                Place::Recognised
            }
            (false, false) => Place::First,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_controllers_in_any_order_are_a_snapshot_and_a_second_one_is_another() {
        for stride in [1, 127, 37, 51] {
            let mut run = Run::default();
            let order = || (0..128).map(|place: u32| (place * stride % 128) as u8);
            for round in 0..3 {
                let places: Vec<Place> = order().map(|controller| run.place(controller)).collect();
                assert_eq!(places.iter().filter(|&&place| place == Place::Recognised).count(), 1);
                assert!(!places.contains(&Place::Again), "{stride} {round}");
                assert!(run.is_snapshot());
            }
        }
    }

    #[test]
    fn what_moves_is_no_snapshot() {
        let mut run = Run::default();
        for controller in 0..31 {
            assert_eq!(run.place(controller), Place::First);
        }
        assert_eq!(run.place(2), Place::Again, "a hand");
        assert_eq!(run.place(PRESSURE), Place::First);
        assert_eq!(run.place(PRESSURE), Place::Again);
        assert!(!run.is_snapshot());
    }

    #[test]
    fn after_a_snapshot_the_second_message_of_a_hand_is_a_movement() {
        let mut run = Run::default();
        for controller in 0..128 {
            run.place(controller);
        }
        assert_eq!(run.place(2), Place::First);
        assert_eq!(run.place(2), Place::Again);
    }
}
