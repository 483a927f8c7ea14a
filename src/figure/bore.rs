//! An instrument seen from the side: bore and holes to scale, which of them are open, and the bore's width enlarged.

use crate::bore::instrument_file::{Fingering, HoleKind, InstrumentFile, ToneHole};
use crate::figure::palette::Colour;
use crate::figure::{Anchor, Axis, Figure, Line, Panel, Points, Polygon, Shape, Text};

/// Levels at which names of holes stand, so that neighbours do not run into each other.
const LEVELS: usize = 4;

/// How the sound stands in the bore: distance from the tip, m, and magnitude of pressure over that at the tip.
pub struct Standing {
    /// Of which mode.
    pub name: String,
    /// From tip to bell.
    pub pressure: Vec<(f64, f64)>,
}

/// `file` from the side, fingered if a fingering is given.
pub fn profile(file: &InstrumentFile, fingering: Option<&Fingering>, standing: &[Standing]) -> Figure {
    let title = match fingering {
        Some(fingering) => format!("{}, fingered for written {}", file.name, fingering.written),
        None => file.name.clone(),
    };
    let length_mm = 1e3 * file.length_m();
    let mut figure = Figure::new(title).note(format!(
        "{length_mm:.0} mm from the tip to the end of the bell, {} holes, all shown on one side; bore, chimneys and \
         diameters to one scale",
        file.holes.len()
    ));
    if let Some(fingering) = fingering.filter(|fingering| !fingering.fingers.is_empty()) {
        figure = figure.note(format!("fingers: {}", fingering.fingers));
    }
    // Half the length a row: twice the scale, and the names of the holes have room.
    let (rows, row_mm) = (2usize, length_mm / 2.0);
    for row in 0..rows {
        let (from_mm, to_mm) = (row as f64 * row_mm, (row + 1) as f64 * row_mm);
        figure = figure.panel(side(file, fingering, (from_mm, to_mm), row == 0));
    }
    figure.panel(widths(file)).panel_if(pressures(standing, length_mm))
}

impl Figure {
    fn panel_if(self, panel: Option<Panel>) -> Self {
        match panel {
            Some(panel) => self.panel(panel),
            None => self,
        }
    }
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

/// A stretch of the instrument from the side.
fn side(
    file: &InstrumentFile,
    fingering: Option<&Fingering>,
    (from_mm, to_mm): (f64, f64),
    legend: bool,
) -> Panel {
    let upper = outline(file, (from_mm, to_mm));
    let mut panel = Panel::new("", Axis::linear("distance from the tip of the reed, mm").range(from_mm, to_mm), {
        let widest = upper.iter().map(|&(_, r)| r).fold(0.0, f64::max);
        let highest = file.holes.iter().map(|hole| top_mm(file, hole)).fold(widest, f64::max);
        // Names stand in LEVELS lines of 6 mm above the highest chimney.
        Axis::linear("mm from the axis").range(-1.1 * widest, highest + 6.0 * (LEVELS as f64 + 0.7))
    })
    .equal_aspect();
    let lower = upper.iter().rev().map(|&(x, r)| (x, -r));
    let body = Polygon::filled("", upper.iter().copied().chain(lower), Colour::Pale, 0.45).stroke(Colour::Ink);
    panel = panel.with(body);
    let highest = file.holes.iter().map(|hole| top_mm(file, hole)).fold(0.0, f64::max);
    let mut named = [false; 2];
    for (index, hole) in file.holes.iter().enumerate() {
        let x = 1e3 * hole.x_m;
        if !(from_mm..to_mm).contains(&x) {
            continue;
        }
        let open = fingering.map(|fingering| fingering.open.get(index).copied().unwrap_or(false));
        let (r, top) = (1e3 * file.radius_at(hole.x_m), top_mm(file, hole));
        let half = 1e3 * hole.radius_m;
        let corners = [(x - half, r), (x - half, top), (x + half, top), (x + half, r)];
        let (name, colour, opacity) = match open {
            Some(true) => ("open", Colour::Sky, 0.35),
            Some(false) => ("closed", Colour::Ink, 0.85),
            None => ("", Colour::Grey, 0.5),
        };
        let first = legend && open.is_some_and(|open| !std::mem::replace(&mut named[usize::from(open)], true));
        let shape = Polygon::filled(if first { name } else { "" }, corners, colour, opacity).stroke(Colour::Ink);
        panel = panel.with(shape);
        let level = highest + 6.0 * ((index % LEVELS) as f64 + 0.8);
        let stem = Line::new("", [(x, top), (x, level - 1.5)]).colour(Colour::Grey).width(0.8);
        panel = panel.with(stem).with(Text::new(x, level + 0.5, &hole.name).anchor(Anchor::Centre));
    }
    panel
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

fn pressures(standing: &[Standing], length_mm: f64) -> Option<Panel> {
    if standing.is_empty() {
        return None;
    }
    let axis = Axis::linear("distance from the tip of the reed, mm").range(0.0, length_mm);
    let mut panel = Panel::new("Sound pressure along the bore", axis, Axis::linear("over that at the tip"));
    for (index, mode) in standing.iter().enumerate() {
        let points = mode.pressure.iter().map(|&(x_m, p)| (1e3 * x_m, p));
        panel = panel.with(Line::new(&mode.name, points).colour(Colour::of_family(index, standing.len())));
    }
    Some(panel)
}
