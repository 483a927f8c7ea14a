//! How hard to blow before notes speak, beside what the reed's flow curve says about it.

use crate::palette::Colour;
use crate::{Axis, Direction, Figure, Line, Mark, Panel, Points, SecondAxis, Span};
use chalumeau_core::reed::{ReedLaw, ReedTables};

/// Thresholds of all notes for one embouchure.
pub struct Thresholds {
    /// Flow strength of the reed.
    pub zeta: f64,
    /// Written note (MIDI) and mouth pressure over closing pressure; not finite where no peak carries the note.
    pub gamma_on: Vec<(u8, f64)>,
}

/// A reed and its thresholds; stiffer with the same opening means less flow for the pressure, so zeta differs too.
pub struct Strength {
    /// As on the box.
    pub number: f64,
    /// Pressure that closes it, kPa.
    pub closing_kpa: f64,
    /// Its thresholds.
    pub thresholds: Thresholds,
}

/// Thresholds over notes for several embouchures, the curve of the flow, and thresholds in kPa for several reeds.
///
/// `chosen` indexes the embouchure that was asked for; the reeds are those of its lip.
pub fn figure(instrument: &str, embouchures: &[Thresholds], chosen: usize, reeds: &[Strength]) -> Figure {
    let own: &[(u8, f64)] = embouchures.get(chosen).map_or(&[], |thresholds| &thresholds.gamma_on);
    let zeta = embouchures.get(chosen).map_or(f64::NAN, |thresholds| thresholds.zeta);
    let at = |notes: &[(u8, f64)], unit: f64| -> Vec<(f64, f64)> {
        notes.iter().map(|&(written, gamma)| (f64::from(written), unit * gamma)).collect()
    };
    let written = || Axis::notes("written note");

    let mut notes = Panel::new(
        "Threshold of each note, for embouchures from firm to loose",
        written(),
        Axis::linear("mouth pressure over closing pressure, gamma"),
    )
    .weight(1.25)
    .with(Mark::new(Direction::Y, 1.0 / 3.0, "1/3: no losses").colour(Colour::Ink));
    for (index, thresholds) in embouchures.iter().enumerate() {
        let colour = Colour::of_family(index, embouchures.len());
        let width = if index == chosen { 4.0 } else { 2.0 };
        let points = at(&thresholds.gamma_on, 1.0);
        notes = notes
            .with(Line::new(format!("zeta {}", thresholds.zeta), points.clone()).colour(colour).width(width))
            .with(Points::new("", points).colour(colour).size(0.8 * width + 1.5));
    }

    let (law, tables) = (ReedLaw::default(), ReedTables::reference());
    let finite = own.iter().map(|&(_, gamma)| gamma).filter(|gamma| gamma.is_finite());
    let (low, high) = finite
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), gamma| (low.min(gamma), high.max(gamma)));
    let mut flow = Panel::new(
        "Flow of the reed at rest: above its maximum, less flows the harder one blows, and that feeds a note",
        Axis::linear("pressure difference over closing pressure").range(0.0, 1.2),
        Axis::linear("flow over its maximum").range(0.0, 1.1),
    )
    .weight(0.8);
    if low <= high {
        flow = flow.with(Span {
            of: Direction::X,
            from: low,
            to: high,
            name: format!("all thresholds at zeta {zeta}: {low:.3} to {high:.3}"),
            colour: Colour::Vermilion,
        });
    }
    let curve = (0..=600).map(|n| f64::from(n) / 500.0);
    flow = flow
        .with(Line::new("flow", curve.map(|p| (p, law.flow(tables, p) / law.peak_flow()))))
        .with(Mark::new(Direction::X, law.peak_at(), "1/3: maximum of the flow").colour(Colour::Ink))
        .with(Mark::new(Direction::X, law.closing(), "1: reed closed").colour(Colour::Ink));

    let mut pressure = Panel::new(
        format!(
            "In the mouth, for reeds by their strength under the lip that gives strength 2.5 a zeta of {zeta}"
        ),
        written(),
        Axis::linear("mouth pressure, kPa"),
    )
    .right(SecondAxis::times(10.197, "cm of water"));
    for (index, reed) in reeds.iter().enumerate() {
        let colour = Colour::of_family(index, reeds.len());
        let name = format!("{}: closes at {:.1} kPa", reed.number, reed.closing_kpa);
        let points = at(&reed.thresholds.gamma_on, reed.closing_kpa);
        pressure = pressure
            .with(Line::new(name, points.clone()).colour(colour))
            .with(Points::new("", points).colour(colour).size(4.0));
    }

    Figure::new(format!("Oscillation threshold: {instrument}"))
        .note("From the impedance peak each note plays on and the flow strength zeta (Wilson and Beavers 1974); reed without inertia.")
        .panel(notes)
        .panel(flow)
        .panel(pressure)
        .size(1_600, 1_500)
}
