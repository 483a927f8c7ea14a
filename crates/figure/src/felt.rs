//! Torque over angle, and felt thresholds beside sounding thresholds.
//!
//! Torque is positive against the breath. A disc stands at the felt threshold, a ring where the resting reed is shut.

use crate::breath::written_axis;
use crate::palette::Colour;
use crate::{Anchor, Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, SecondAxis, Shape, Text};
use chalumeau_core::haptics::torque_law::torque_mnm;
use chalumeau_core::haptics::{FeelTable, NoteFeel};
use chalumeau_core::reed::ReedTables;

/// Millinewton metres in a newton centimetre, as firmware counts.
const NCM: f64 = 0.1;
/// Where a curve begins, in the slap region, and how far behind the wall it ends, degrees.
const FROM_DEG: f64 = -150.0;
const BEHIND_WALL_DEG: f64 = 10.0;
/// Points along a curve.
const POINTS: usize = 400;

/// The torque of one note.
#[derive(Clone, Debug, PartialEq)]
pub struct Torque {
    /// Which note: "E3".
    pub name: String,
    /// Angle, degrees, and torque, mNm.
    pub curve: Vec<(f64, f64)>,
    /// Felt threshold.
    pub on: (f64, f64),
    /// The resting reed is shut.
    pub close: (f64, f64),
}

impl Torque {
    /// The torque of a note, as the firmware makes it.
    pub fn of(note: &NoteFeel) -> Self {
        let tables = ReedTables::reference();
        let at = |deg: f64| (deg, torque_mnm(&note.feel, tables, deg));
        let to_deg = f64::from(note.feel.wall_deg) + BEHIND_WALL_DEG;
        let along = |n: usize| FROM_DEG + (to_deg - FROM_DEG) * n as f64 / POINTS as f64;
        Self {
            name: note.written.to_string(),
            curve: (0..=POINTS).map(|n| at(along(n))).collect(),
            on: at(note.landmarks.a_on_deg),
            close: at(note.landmarks.a_close_deg),
        }
    }
}

/// Notes that stand for all of a table: the easiest, the lowest, the reference, the hardest.
pub fn few(table: &FeelTable) -> Vec<&NoteFeel> {
    let need = |note: &&NoteFeel| note.requirement.map_or(f64::NAN, |asked| asked.p_req_pa);
    let sounding = || table.notes().iter().filter(|note| note.requirement.is_some());
    let by = |a: &&NoteFeel, b: &&NoteFeel| need(a).total_cmp(&need(b));
    let all = [
        sounding().min_by(by),
        sounding().min_by_key(|note| note.written),
        Some(table.reference()),
        sounding().max_by(by),
    ];
    let mut few: Vec<&NoteFeel> = all.into_iter().flatten().collect();
    few.sort_by(by);
    few.dedup_by_key(|note| note.written);
    few
}

/// Several notes at one Contrast.
pub struct AtContrast {
    /// How much differences are exaggerated.
    pub contrast: f64,
    /// The notes, or the reason why a knob would refuse them.
    pub notes: Result<Vec<Torque>, String>,
}

/// Torque against angle under one law, a panel for each Contrast, all to one scale.
pub fn torques(law: &str, note: &str, ceiling_mnm: f64, all: &[AtContrast]) -> Figure {
    let drawn = || all.iter().filter_map(|at| at.notes.as_ref().ok()).flatten();
    let points = || drawn().flat_map(|torque| &torque.curve).copied();
    let (from, to) =
        points().fold((-20.0_f64, 60.0_f64), |(from, to), (deg, _)| (from.min(deg), to.max(deg)));
    let low = points().fold(0.0_f64, |low, (_, mnm)| low.min(mnm));
    let mut figure = Figure::new(format!("Torque against angle, {law} law")).note(note);
    for (index, at) in all.iter().enumerate() {
        let label = if index + 1 == all.len() { "angle of the knob from rest, degrees" } else { "" };
        let refused = if at.notes.is_err() { ": refused" } else { "" };
        let mut panel = Panel::new(
            format!("Contrast {}{refused}", at.contrast),
            Axis::linear(label).range(from, to),
            Axis::linear("torque, mNm").range(low * 1.1, 1.12 * ceiling_mnm),
        )
        .right(SecondAxis::times(NCM, "N cm"))
        .with(Mark::new(Direction::Y, ceiling_mnm, "ceiling").colour(Colour::Vermilion));
        match &at.notes {
            Ok(notes) => {
                for (index, torque) in notes.iter().enumerate() {
                    let colour = Colour::of_family(index, notes.len());
                    let dash = if index % 2 == 1 { Dash::Dashed } else { Dash::Solid };
                    let name =
                        format!("{}: {:.0} mNm at {:.0} degrees", torque.name, torque.on.1, torque.on.0);
                    panel = panel
                        .with(Line::new(name, torque.curve.iter().copied()).colour(colour).dash(dash))
                        .with(Points::new("", [torque.on]).colour(colour).size(7.0))
                        .with(Points::new("", [torque.close]).colour(colour).shape(Shape::Ring).size(7.0));
                }
            }
            Err(_) => {
                let middle = (0.5 * (from + to), 0.5 * ceiling_mnm);
                let said = Text::new(middle.0, middle.1, "a knob would refuse this; the page says why");
                panel = panel.with(said.anchor(Anchor::Centre).colour(Colour::Vermilion));
            }
        }
        figure = figure.panel(panel);
    }
    figure.size(1_600, 500 * all.len().max(1) as u32 + 100)
}

/// Thresholds under one law.
pub struct FeltThresholds {
    /// Name of the law.
    pub law: String,
    /// Mouth pressure at the mark of the torque (its top, or the middle of its step): written note (MIDI), kPa.
    pub at_kpa: Vec<(u8, f64)>,
    /// Place, and the felt threshold of each note, degrees.
    pub on_deg: Vec<(f64, Vec<(u8, f64)>)>,
}

/// The felt threshold of each note beside its sounding threshold.
pub fn thresholds(note: &str, sounds_kpa: &[(u8, f64)], laws: &[FeltThresholds]) -> Figure {
    let notes = || sounds_kpa.iter().map(|&(written, _)| written);
    let along = |values: &[(u8, f64)]| -> Vec<(f64, f64)> {
        values.iter().map(|&(written, value)| (f64::from(written), value)).collect()
    };
    let mut pressure = Panel::new(
        "Mouth pressure where the note sounds, and where the torque has its mark",
        written_axis(notes()),
        Axis::linear("mouth pressure, kPa"),
    )
    .weight(1.1)
    .with(Line::new("begins to sound", along(sounds_kpa)).colour(Colour::Green).width(5.0));
    // Rings first, so that discs stand in them.
    let looks = [(Colour::Purple, Shape::Disc, 5.0), (Colour::Ink, Shape::Ring, 9.0)];
    for (felt, (colour, shape, size)) in laws.iter().zip(looks).collect::<Vec<_>>().into_iter().rev() {
        let name = format!("is felt, {} law", felt.law);
        let points = Points::new(name, along(&felt.at_kpa));
        pressure = pressure.with(points.colour(colour).shape(shape).size(size));
    }
    let mut figure = Figure::new("Felt threshold and sounding threshold").note(note).panel(pressure);
    for felt in laws {
        let mut panel = Panel::new(
            format!("Where on the knob, {} law", felt.law),
            written_axis(notes()),
            Axis::linear("felt threshold, degrees from rest"),
        );
        for (index, (place, on_deg)) in felt.on_deg.iter().enumerate() {
            let colour = Colour::of_family(index, felt.on_deg.len());
            panel = panel
                .with(Line::new(format!("Place {place}"), along(on_deg)).colour(colour))
                .with(Points::new("", along(on_deg)).colour(colour).size(4.5));
        }
        figure = figure.panel(panel);
    }
    figure.size(1_600, 1_500)
}
