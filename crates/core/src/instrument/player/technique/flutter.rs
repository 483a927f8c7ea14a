//! Flutter tongue: the tip of the tongue rolls an R and nearly closes the breath's way, some 25 times a second.
//!
//! The tongue lies between lungs and reed. What it holds back gathers behind it and comes when it opens, so the mean stays (but for
//! a loud note, whose pressure ends at the closing pressure):
//! a soft note, whose growth follows the mean pressure, goes on.

use crate::maths;
use std::f64::consts::TAU;

use super::wrapped;

/// How far the mouth pressure swings about its mean at full flutter. At 0.7 soft low notes die (measured).
const DEPTH: f64 = 0.5;
/// How much harder a player blows behind a full flutter: about keeps the level of the note (measured).
const HARDER: f64 = 0.15;

/// State of the fluttering tongue.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flutter {
    /// Share of the period that has passed.
    phase: f64,
}

impl Flutter {
    /// A tongue that begins at a share of its period, 0..1.
    pub fn at(phase: f64) -> Self {
        Self { phase }
    }

    /// One tick of a tongue at `hz`.
    pub fn tick(&mut self, hz: f64, tick_s: f64) {
        self.phase = wrapped(self.phase + hz * tick_s);
    }

    /// What the tongue adds to the mouth pressure, over that pressure.
    pub fn swing(&self) -> f64 {
        HARDER - DEPTH * maths::sin(TAU * self.phase)
    }
}
