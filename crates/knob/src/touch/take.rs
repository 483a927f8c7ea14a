//! Takes: what a hand did on a knob, to be replayed and analysed. [`take_csv`](crate::touch::take_csv) reads and writes
//! them.

use crate::touch::angle::KnobDesign;
use crate::touch::breath_from_angle::BreathMapping;
use crate::touch::feel::PitchMaps;
use crate::touch::heard::Heard;
use crate::touch::study::{Condition, StudySide};
use chalumeau_core::instrument::Settings;

/// One row of a take: one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TakeRow {
    /// Time, microseconds.
    pub t_us: u64,
    /// Angle of the knob, degrees.
    pub angle_deg: f64,
    /// Its speed, degrees/s.
    pub velocity_deg_s: f64,
    /// Torque that the knob commands, mNm, if it says so.
    pub torque_mnm: Option<f64>,
    /// Written note that is fingered, if any.
    pub written: Option<u8>,
    /// Mouth pressure over closing pressure.
    pub gamma: f64,
    /// Feel in force.
    pub feel_id: u8,
    /// Whether the knob may make torque, if it says so.
    pub armed: Option<bool>,
}

/// What a row belongs to. Only analyses need it; a replay does not read it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TakeMarks {
    /// H and k of reed and feel, if known.
    pub reed: Option<(f64, f64)>,
    /// Participant, trial, side and condition, during a study.
    pub study: Option<(u32, u32, StudySide, Condition)>,
    /// Gamma at which the fingered note begins to sound on this reed: the felt threshold, if known.
    pub sounds_from: Option<f64>,
    /// What was heard at that moment.
    pub heard: Heard,
}

/// How the angles of a take blow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TakeHand {
    /// Rest, full blow, dead zone and curve.
    pub design: KnobDesign,
    /// True if the knob gave the feel, as in [`BreathMapping`].
    pub feels: bool,
}

/// What sets a reed besides H and k, as the settings have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TakeEmbouchure {
    /// Embouchure parameter.
    pub zeta: f32,
    /// Strength as on the box.
    pub strength: f32,
    /// Tip opening under the lip over the reference.
    pub lip: f32,
}

impl TakeEmbouchure {
    /// That of these settings.
    pub fn of(&Settings { zeta, strength, lip, .. }: &Settings) -> Self {
        Self { zeta, strength, lip }
    }
}

/// What a take says of itself above its columns; what it does not say is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TakeHead {
    /// Name of the instrument that was played.
    pub instrument: Option<String>,
    /// The feel, as flags of the command line.
    pub feel: Option<String>,
    /// How its angles blow.
    pub hand: Option<TakeHand>,
    /// The reed under the lip.
    pub embouchure: Option<TakeEmbouchure>,
}

/// A take in memory, never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Take {
    pub(super) rows: Vec<TakeRow>,
    pub(super) head: TakeHead,
    pub(super) reed: Option<(f64, f64)>,
    pub(super) has_one_reed: bool,
}

impl Take {
    /// All rows, in order of time; there is at least one.
    pub fn rows(&self) -> &[TakeRow] {
        &self.rows
    }

    /// H and k of the reed in its first row that tells them, and whether all that do tell the same.
    pub fn reed(&self) -> Option<((f64, f64), bool)> {
        self.reed.map(|reed| (reed, self.has_one_reed))
    }

    /// What it says of itself.
    pub fn head(&self) -> &TakeHead {
        &self.head
    }

    /// How its angles blow: as it says or, where it says nothing, with `usual` on a knob that gave the feel.
    pub fn hand(&self, usual: KnobDesign) -> TakeHand {
        self.head.hand.unwrap_or(TakeHand { design: usual, feels: true })
    }

    /// What its angles mean on an instrument with these maps; `usual` as in [`hand`](Self::hand).
    pub fn mapping(&self, maps: PitchMaps, usual: KnobDesign) -> BreathMapping {
        let TakeHand { design, feels } = self.hand(usual);
        BreathMapping { maps, design, feels }
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        1e-6 * (self.rows[self.rows.len() - 1].t_us - self.rows[0].t_us) as f64
    }

    /// The angle `t_s` seconds after the first row, linear between rows; before and after, that of the end.
    pub fn angle_deg(&self, t_s: f64) -> f64 {
        let t_us = self.rows[0].t_us as f64 + 1e6 * t_s;
        let next = self.rows.partition_point(|row| (row.t_us as f64) <= t_us);
        let Some(from) = next.checked_sub(1) else { return self.rows[0].angle_deg };
        let a = self.rows[from];
        let Some(b) = self.rows.get(next) else { return a.angle_deg };
        a.angle_deg + (b.angle_deg - a.angle_deg) * (t_us - a.t_us as f64) / (b.t_us - a.t_us) as f64
    }
}
