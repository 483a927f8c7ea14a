//! What settings, fingering and bend amount to: reed, delay and clock of the note, and how fast they are reached.

use super::breath::{BREATH_END_S, BREATH_FOLLOW_S, BREATH_RISE_S};
use super::step_towards;
use crate::instrument::bend::{self, BendSplit};
use crate::instrument::lip::embouchure;
use crate::instrument::model::Model;
use crate::instrument::settings::Settings;
use crate::reed::{MovingReed, ReedCoeffs};
use crate::units::{Air, cents};

/// Targets of the note in the fingers. The player works them out when a setting, the fingering or the bend changes, not
/// at every tick.
#[derive(Clone, Copy, Debug)]
pub struct Posture {
    /// Closing pressure of the reed over the reference.
    pub closing: f64,
    /// The reed under the lip.
    pub reed: ReedCoeffs,
    /// Delay on top of the note's trim, rows of round trip.
    pub rows: f64,
    /// Share of the bend that the clock makes, cents.
    pub bore_cents: f64,
    /// How fast delay, clock and breath follow.
    pub lags: Lags,
}

/// Share of the way to the target that delay, clock and breath cover in one tick, 0..1.
#[derive(Clone, Copy, Debug)]
pub struct Lags {
    /// Delay and clock.
    pub tuning: f64,
    /// Breath that rises behind the tongue.
    pub breath_rise: f64,
    /// Breath that follows a breath source.
    pub breath_follow: f64,
    /// Breath that ends.
    pub breath_end: f64,
}

impl Lags {
    /// For ticks of `tick_s` seconds.
    pub fn new(settings: &Settings, tick_s: f64) -> Self {
        let step = |time_s: f64| step_towards(tick_s, time_s);
        Self {
            tuning: step(0.5e-3 * f64::from(settings.legato_ms)),
            breath_rise: step(BREATH_RISE_S),
            breath_follow: step(BREATH_FOLLOW_S),
            breath_end: step(BREATH_END_S),
        }
    }
}

impl Posture {
    /// For a fingering under a bend, with ticks of `tick_s` seconds.
    pub fn new(settings: &Settings, fingering: usize, bend_cents: f64, tick_s: f64, model: &Model) -> Self {
        let law = settings.reed_law();
        let lip = embouchure(model.notes_hz[fingering], model.lowest_hz);
        let reed = ReedCoeffs::new(
            MovingReed {
                law,
                zeta: f64::from(settings.zeta),
                lay: f64::from(settings.lay),
                resonance_hz: lip.resonance_hz,
                damping: lip.damping * f64::from(settings.damping),
                swept_s: model.swept_s,
            },
            model.coeffs.rate_hz,
        );
        let offset = bend_cents
            + cents(f64::from(settings.a4_hz), model.a4_hz)
            + cents(Air::at(f64::from(settings.temperature_c)).c, model.air.c);
        let sensitivity = model.tuning.notes.get(fingering).map_or(1.0, |note| note.sensitivity);
        let split = BendSplit::new(offset, bend::lip_limit_cents(model, fingering, offset));
        Self {
            closing: law.closing(),
            reed,
            rows: sensitivity * model.rows_for_cents(fingering, split.lip_cents),
            bore_cents: split.bore_cents,
            lags: Lags::new(settings, tick_s),
        }
    }
}
