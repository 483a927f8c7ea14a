//! The pitch: the tuning delay follows the note's trim and the lip; the clock's speed follows the rest of a bend.

use super::TickContext;
use crate::bore::lattice::{Lattice, Real};
use crate::instrument::bend;
use crate::instrument::model::Model;
use crate::instrument::settings::Tuning;
use crate::instrument::voice::TICK;

/// The clock counts as arrived when it is this near to its target, cents.
const ARRIVED_CENTS: f64 = 0.01;

/// State of the tuning.
#[derive(Clone, Copy, Debug)]
pub struct PlayedTuning {
    /// Tuning delay, rows of round trip; none before the first note, whose delay is set at once.
    rows: Option<f64>,
    /// What the clock adds to the pitch, cents.
    bore_cents: f64,
    /// Speed of the clock that this takes; 1 is the model's rate.
    speed: f64,
}

impl Default for PlayedTuning {
    fn default() -> Self {
        Self { rows: None, bore_cents: 0.0, speed: 1.0 }
    }
}

impl PlayedTuning {
    /// Speed of the instrument's clock; 1 is the model's rate.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Moves delay and clock; whether the speed of the clock has changed. `gamma` is the mouth pressure over the closing
    /// pressure, `sway_cents` what the lip adds, `bend_cents` what the player adds to the bend of the posture.
    pub fn tick<F: Real>(
        &mut self,
        fingering: Option<usize>,
        gamma: f64,
        (sway_cents, bend_cents): (f64, f64),
        context: &TickContext<'_>,
        model: &Model,
        lattice: &mut Lattice<F>,
    ) -> bool {
        let posture = context.posture;
        let fingered = || model.tuning.rows(fingering.unwrap_or(0), context.settings.tuning, gamma);
        let trim = match context.settings.tuning {
            Tuning::Natural => fingered(),
            Tuning::Tempered => posture.played_rows().unwrap_or_else(fingered),
        };
        let (bent_rows, bore_cents) = posture.bent(bend_cents, model);
        let target = trim + bent_rows + sway_cents * posture.rows_per_cent;
        // The delay follows within the time the fingers take; the first note has it at once.
        let first = self.rows.is_none();
        match &mut self.rows {
            Some(rows) => {
                *rows += (target - *rows) * posture.lags.tuning;
                lattice.glide_delay(*rows, TICK);
            }
            None => {
                self.rows = fingering.map(|_| target);
                lattice.glide_delay(target, 0);
            }
        }
        if bore_cents == self.bore_cents {
            return false;
        }
        let away = bore_cents - self.bore_cents;
        self.bore_cents = if first || away.abs() < ARRIVED_CENTS {
            bore_cents
        } else {
            self.bore_cents + away * posture.lags.tuning
        };
        self.speed = bend::speed(self.bore_cents);
        true
    }
}
