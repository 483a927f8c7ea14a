//! An instrument seen from the side: bore and holes to scale, which of them are open, and the bore's width enlarged.

use crate::palette::Colour;
use crate::{Anchor, Axis, Figure, Line, Panel, Points, Polygon, Shape, Text};
use chalumeau_core::bore::instrument_file::{Fingering, HoleKind, InstrumentFile, ToneHole};
use std::cmp::Ordering;

/// Width of one letter of a hole's name and distance between lines of names, in parts of the stretch a panel shows: what
/// they are at nominal size (11 and 26 pixels of 1430).
const LETTER: f64 = 11.0 / 1430.0;
const LINE: f64 = 26.0 / 1430.0;
/// Most lines of names, and most attempts to set them on so many: some milliseconds.
const LINES_MAX: usize = 7;
const TRIES: u32 = 100_000;
/// Room between axis and edges of a panel, pixels: labels, ticks, legend.
const AROUND: f64 = 130.0;
/// Width of the axes at nominal size, pixels.
const ACROSS: f64 = 1_430.0;

/// `file` from the side, fingered if a fingering is given.
pub fn profile(file: &InstrumentFile, fingering: Option<&Fingering>) -> Figure {
    let title = match fingering {
        Some(fingering) => format!("{}, fingered for written {}", file.name, fingering.written),
        None => file.name.clone(),
    };
    let length_mm = 1e3 * file.length_m();
    let has_bell = file.bore.iter().any(|cone| cone.part.to_lowercase().contains("bell"));
    let end = if has_bell { "bell" } else { "bore" };
    let mut figure = Figure::new(title).note(format!(
        "{length_mm:.0} mm from the tip to the end of the {end}, {} holes, all shown on one side; bore, chimneys and \
         diameters to one scale",
        file.holes.len()
    ));
    if let Some(fingering) = fingering.filter(|fingering| !fingering.fingers.is_empty()) {
        figure = figure.note(format!("fingers: {}", fingering.fingers));
    }
    // Half the length a row: twice the scale, and the names of the holes have room.
    let half_mm = length_mm / 2.0;
    let mut height = 0.0;
    // The first of either kind stands in a legend, on whichever half it is.
    let mut unnamed = [fingering.is_some(); 2];
    for row in [0.0, 1.0] {
        let (panel, tall_mm) = side(file, fingering, (row * half_mm, (row + 1.0) * half_mm), &mut unnamed);
        let pixels = tall_mm / half_mm * ACROSS + AROUND;
        height += pixels;
        figure = figure.panel(panel.weight(pixels / AROUND));
    }
    let enlarged = 420.0;
    // Title, notes and margins take about a sixth of a page.
    let height = (height + enlarged + 260.0) as u32;
    figure.panel(widths(file).weight(enlarged / AROUND)).size(1_600, height)
}

/// Where a name stands over its place: on which line from the bottom, and on which side of its stem.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Name {
    x: f64,
    line: usize,
    anchor: Anchor,
    /// What it covers.
    from: f64,
    to: f64,
}

impl Name {
    fn at(x: f64, width: f64, line: usize, anchor: Anchor) -> Self {
        let (from, to) = match anchor {
            Anchor::Left => (x - width, x),
            Anchor::Right => (x, x + width),
            _ => (x - 0.5 * width, x + 0.5 * width),
        };
        Self { x, line, anchor, from, to }
    }

    /// Neither covers the other, nor does a stem go through a name.
    fn is_clear_of(&self, other: &Self) -> bool {
        let holds = |name: &Self, x: f64| name.from < x && x < name.to;
        match self.line.cmp(&other.line) {
            Ordering::Equal => self.to < other.from || other.to < self.from,
            Ordering::Greater => !holds(other, self.x),
            Ordering::Less => !holds(self, other.x),
        }
    }
}

/// Names for places along an axis, `(x, width)` in order of x, on as few lines as they need.
fn names(places: &[(f64, f64)]) -> Vec<Name> {
    for lines in 1..=LINES_MAX {
        let (mut set, mut tries) = (Vec::with_capacity(places.len()), TRIES);
        if settle(places, lines, &mut set, &mut tries) {
            return set;
        }
    }
    // Holes too close for words: they cover each other, but each stands over its own.
    places
        .iter()
        .enumerate()
        .map(|(index, &(x, width))| Name::at(x, width, index % LINES_MAX, Anchor::Centre))
        .collect()
}

/// Finds a place for the next name that leaves places for those after it.
fn settle(places: &[(f64, f64)], lines: usize, set: &mut Vec<Name>, tries: &mut u32) -> bool {
    let Some(&(x, width)) = places.get(set.len()) else { return true };
    for line in 0..lines {
        for side in [Anchor::Centre, Anchor::Right, Anchor::Left] {
            let name = Name::at(x, width, line, side);
            if *tries == 0 || !set.iter().all(|other| name.is_clear_of(other)) {
                continue;
            }
            *tries -= 1;
            set.push(name);
            if settle(places, lines, set, tries) {
                return true;
            }
            set.pop();
        }
    }
    false
}

fn outline(file: &InstrumentFile, (from_mm, to_mm): (f64, f64)) -> Vec<(f64, f64)> {
    let mut corners = Vec::new();
    for segment in &file.bore {
        let (x0, x1) = (1e3 * segment.x_start_m, 1e3 * segment.x_end_m);
        let (r0, r1) = (1e3 * segment.r_start_m, 1e3 * segment.r_end_m);
        let (first, last) = (x0.max(from_mm), x1.min(to_mm));
        if last > first {
            let r = |x: f64| r0 + (r1 - r0) * (x - x0) / (x1 - x0);
            corners.extend([(first, r(first)), (last, r(last))]);
        }
    }
    corners
}

/// A stretch of the instrument from the side, and how tall it is, mm. `unnamed`: whether closed and open holes have no place in
/// a legend yet.
fn side(
    file: &InstrumentFile,
    fingering: Option<&Fingering>,
    (from_mm, to_mm): (f64, f64),
    unnamed: &mut [bool; 2],
) -> (Panel, f64) {
    let holes: Vec<(usize, &ToneHole)> = file
        .holes
        .iter()
        .enumerate()
        .filter(|(_, hole)| (from_mm..to_mm).contains(&(1e3 * hole.x_m)))
        .collect();
    let upper = outline(file, (from_mm, to_mm));
    let widest = upper.iter().map(|&(_, r)| r).fold(0.0, f64::max);
    let highest = holes.iter().map(|(_, hole)| top_mm(file, hole)).fold(0.0, f64::max);
    let (letter, line_mm) = (LETTER * (to_mm - from_mm), LINE * (to_mm - from_mm));
    let width = |hole: &ToneHole| letter * (hole.name.chars().count() as f64 + 1.5);
    let places: Vec<(f64, f64)> = holes.iter().map(|(_, hole)| (1e3 * hole.x_m, width(hole))).collect();
    let names = names(&places);
    let name_mm = |line: usize| highest + line_mm * (line as f64 + 1.0);
    let names_mm = names.iter().map(|name| name_mm(name.line) + 0.8 * line_mm).fold(0.0, f64::max);
    let (low, high) = (-1.12 * widest, names_mm.max(1.12 * widest));
    let mut panel = Panel::new(
        "",
        Axis::linear("distance from the tip of the reed, mm").range(from_mm, to_mm),
        Axis::linear("mm from the axis").range(low, high),
    )
    .equal_aspect();
    let lower = upper.iter().rev().map(|&(x, r)| (x, -r));
    panel = panel.with(
        Polygon::filled("", upper.iter().copied().chain(lower), Colour::Pale, 0.45).stroke(Colour::Ink),
    );
    for ((index, hole), label) in holes.into_iter().zip(names) {
        let open = fingering.map(|fingering| fingering.open.get(index).copied().unwrap_or(false));
        let (x, half) = (1e3 * hole.x_m, 1e3 * hole.radius_m);
        let (r, top) = (1e3 * file.radius_at(hole.x_m), top_mm(file, hole));
        let corners = [(x - half, r), (x - half, top), (x + half, top), (x + half, r)];
        let (name, colour, opacity) = match open {
            Some(true) => ("open", Colour::Sky, 0.35),
            Some(false) => ("closed", Colour::Ink, 0.85),
            None => ("", Colour::Grey, 0.5),
        };
        let first = open.is_some_and(|open| std::mem::take(&mut unnamed[usize::from(open)]));
        let words = name_mm(label.line);
        // Up to the middle of words beside it, to the foot of words over it.
        let stem =
            if label.anchor == Anchor::Centre { words - 0.45 * line_mm } else { words + 0.3 * line_mm };
        panel = panel
            .with(
                Polygon::filled(if first { name } else { "" }, corners, colour, opacity).stroke(Colour::Ink),
            )
            .with(Line::new("", [(x, top), (x, stem)]).colour(Colour::Grey).width(0.8))
            .with(Text::new(x, words, &hole.name).anchor(label.anchor));
    }
    (panel, high - low)
}

/// Outer end of a chimney, mm from the axis.
fn top_mm(file: &InstrumentFile, hole: &ToneHole) -> f64 {
    1e3 * (file.radius_at(hole.x_m) + hole.chimney_m)
}

/// Diameters of bore and holes, enlarged.
fn widths(file: &InstrumentFile) -> Panel {
    let length_mm = 1e3 * file.length_m();
    let axis = Axis::linear("distance from the tip of the reed, mm").range(0.0, length_mm);
    let profile = outline(file, (0.0, length_mm)).into_iter().map(|(x, r)| (x, 2.0 * r));
    let mut panel = Panel::new("Diameters, enlarged", axis, Axis::linear("diameter, mm"))
        .with(Line::new("bore", profile).width(2.5));
    for (kind, name, shape, colour) in [
        (HoleKind::Finger, "finger holes", Shape::Ring, Colour::Vermilion),
        (HoleKind::PadOpen, "pads standing open", Shape::Disc, Colour::Vermilion),
        (HoleKind::KeyClosed, "keys at rest on their holes", Shape::Diamond, Colour::Green),
    ] {
        let holes = file.holes.iter().filter(|hole| hole.kind == kind);
        let points: Vec<_> = holes.map(|hole| (1e3 * hole.x_m, 2e3 * hole.radius_m)).collect();
        if !points.is_empty() {
            panel = panel.with(Points::new(name, points).shape(shape).colour(colour).size(5.0));
        }
    }
    panel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cover_neither_names_nor_stems() {
        let file = InstrumentFile::built_in();
        let places: Vec<(f64, f64)> =
            file.holes.iter().map(|hole| (1e3 * hole.x_m, 2.6 * (hole.name.len() as f64 + 1.5))).collect();
        let names = names(&places);
        for (a, name) in names.iter().enumerate() {
            for other in &names[..a] {
                assert!(name.is_clear_of(other), "{name:?} {other:?}");
            }
        }
        assert!(names.iter().all(|name| name.line < 5), "{names:?}");
    }

    #[test]
    fn both_halves_hold_the_whole_bore() {
        let file = InstrumentFile::built_in();
        let ends = |from, to| {
            let corners = outline(&file, (from, to));
            (corners[0], corners[corners.len() - 1])
        };
        let half = 500.0 * file.length_m();
        let ((x0, _), (x1, r1)) = ends(0.0, half);
        let ((x2, r2), (x3, r3)) = ends(half, 2.0 * half);
        assert!(x0 == 0.0 && x1 == half && x2 == half && (r1 - r2).abs() < 1e-9);
        assert!(
            (x3 - 2.0 * half).abs() < 1e-9 && (r3 - 1e3 * file.bore.last().unwrap().r_end_m).abs() < 1e-9
        );
    }
}
