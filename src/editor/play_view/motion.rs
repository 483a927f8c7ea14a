//! What moves in the picture: fingers and pads on their way, and the reed's tip, slowed down.

use std::sync::Arc;
use std::time::Duration;

use egui::Ui;

use crate::editor::chart;
use crate::editor::snapshot::Snapshot;
use chalumeau_core::bore::instrument_file::InstrumentFile;

/// Time constant with which a finger arrives on the screen, s: about the time a slur takes.
const FINGER_S: f32 = 0.03;
/// A finger this near its place is there, as a share of its way.
const THERE: f32 = 0.02;
/// From frame to frame while a finger moves.
const FRAME: Duration = Duration::from_millis(16);
/// Vibrations of the reed that the picture shows in a second, as a stroboscope would.
const SLOWED_HZ: f64 = 1.5;

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    instrument: Option<Arc<InstrumentFile>>,
    openings: Vec<f32>,
    /// Reed opening over the rest opening: 1 at rest, 0 closed.
    reed: f32,
}

impl Motion {
    /// Moves everything on to now.
    pub fn follow(&mut self, ui: &Ui, snapshot: &Snapshot, tried: Option<&[bool]>) {
        let (time_s, step_s) = ui.input(|input| (input.time, input.stable_dt));
        let wanted = |hole: usize| match tried.and_then(|tried| tried.get(hole)) {
            Some(&is_open) => f32::from(u8::from(is_open)),
            None => chart::share(snapshot.openings.get(hole).copied().unwrap_or(0.0)),
        };
        let holes = snapshot.instrument.holes.len();
        if self.instrument.as_ref() != Some(&snapshot.instrument) {
            self.instrument = Some(snapshot.instrument.clone());
            self.openings = (0..holes).map(wanted).collect();
        }
        let share = 1.0 - (-step_s.clamp(0.0, 0.1) / FINGER_S).exp();
        let mut is_moving = false;
        for (hole, opening) in self.openings.iter_mut().enumerate() {
            let left = wanted(hole) - *opening;
            if left.abs() <= THERE {
                *opening += left;
            } else {
                *opening += share * left;
                is_moving = true;
            }
        }
        if is_moving {
            ui.ctx().request_repaint_after(FRAME);
        }
        let scope = &snapshot.scope;
        let period =
            snapshot.heard.f0_hz.map(|f0_hz| scope.last_period(f0_hz)).filter(|period| !period.is_empty());
        self.reed = period.map_or(1.0, |period| {
            let phase = (time_s * SLOWED_HZ).fract();
            let index = period.start + (phase * period.len() as f64) as usize;
            chart::share(scope.opening[index.min(period.end - 1)])
        });
    }

    /// How far a hole is open on the screen, 0..=1.
    pub fn opening(&self, hole: usize) -> f32 {
        self.openings.get(hole).copied().unwrap_or(0.0)
    }

    /// Reed opening over the rest opening, 0..=1.
    pub fn reed(&self) -> f32 {
        self.reed
    }
}
