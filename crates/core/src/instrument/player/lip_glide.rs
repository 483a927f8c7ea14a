//! The lip goes from note to note: resonance and damping that it gives the reed, and the place of the note in the player's rule.
//!
//! Slurred, they move while the fingers do; a step of them is a step of the flow, which clicks. Behind the tongue they are in
//! place at once.

/// These count as arrived when each is this near to its target, as a share of it.
const ARRIVED: f64 = 1e-4;

/// Where the lip is for a note: resonance of the reed, Hz; its damping; the place of the note.
pub type NoteLip = [f64; 3];

/// The lip on its way.
#[derive(Clone, Copy, Debug, Default)]
pub struct LipGlide {
    now: Option<NoteLip>,
}

impl LipGlide {
    /// Moves towards a note by a `share` of the way, or is there `at_once`. Real-time safe.
    pub fn tick(&mut self, target: NoteLip, at_once: bool, share: f64) -> NoteLip {
        let now = match self.now {
            Some(now) if !at_once && now != target => {
                let mut next = now;
                let mut arrived = true;
                for (next, target) in next.iter_mut().zip(target) {
                    *next += (target - *next) * share;
                    arrived &= (target - *next).abs() <= ARRIVED * target.abs().max(1.0);
                }
                if arrived { target } else { next }
            }
            _ => target,
        };
        self.now = Some(now);
        now
    }
}
