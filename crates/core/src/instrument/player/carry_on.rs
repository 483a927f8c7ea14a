//! A player goes on on another instrument.

use super::Player;
use crate::bore::lattice::Real;
use crate::instrument::model::Model;
use crate::instrument::voice::Voice;

impl Player {
    /// Takes over keys, breath, lip and bend from the player of another instrument, as if the player had always held
    /// this one; the note has yet to speak. Keys that this instrument does not have are released. Settings stay.
    /// Real-time safe.
    pub fn carry_on<F: Real>(&mut self, from: &Self, model: &Model, voice: &mut Voice<F>) {
        *self = Self {
            settings: self.settings,
            keys: from.keys,
            breath: from.breath.carried(),
            bend_cents: from.bend_cents,
            reed: from.reed,
            ..Self::default()
        };
        while let Some(last) = self.keys.last() {
            let Some(fingering) = model.fingering_for(last) else {
                self.keys.release(last);
                continue;
            };
            self.finger(fingering, false, model, voice);
            self.tongue.carry_on(&from.tongue);
            break;
        }
    }
}
