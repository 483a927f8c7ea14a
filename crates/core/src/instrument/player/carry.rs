//! A player goes on on another instrument.

use super::{Player, Tongue};
use crate::bore::lattice::Real;
use crate::instrument::model::Model;
use crate::instrument::voice::Voice;

impl Player {
    /// Takes over keys, breath, lip and bend of a player of another instrument, as if the hands had always been on this
    /// one; the note has yet to speak. Keys that this instrument does not have come up. Settings stay. Real-time safe.
    pub fn carry_on<F: Real>(&mut self, from: &Self, model: &Model, voice: &mut Voice<F>) {
        *self = Self {
            settings: self.settings,
            keys: from.keys,
            velocity: from.velocity,
            breath_live: from.breath_live,
            breath: from.breath,
            bend_cents: from.bend_cents,
            reed: from.reed,
            reed_wanted: from.reed_wanted,
            ..Self::default()
        };
        while let Some(last) = self.keys.last() {
            let Some(fingering) = model.fingering_for(last) else {
                self.keys.release(last);
                continue;
            };
            self.finger(fingering, false, model, voice);
            // A tongue on its way goes on; none that was away comes back.
            self.tongue = match from.tongue {
                Tongue::Resting | Tongue::Stopping(_) => Tongue::Away,
                tongue => tongue,
            };
            if self.tongue == Tongue::Away {
                self.tongue_force = 0.0;
            }
            break;
        }
    }
}
