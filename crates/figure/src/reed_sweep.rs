//! The reed's flow law for decreasing rest openings, as the frames of an animation.

use crate::palette::Colour;
use crate::reed::{FLOW, PRESSURE, curve, peak};
use crate::{Axis, Direction, Figure, Line, Mark, Panel, Points};
use chalumeau_core::reed::ReedLaw;
use chalumeau_core::reed::law::ReedError;

/// One figure per frame: rest opening H from 5 to 2 in even steps, with coupled stiffness k = 27 / (4 H^3).
pub fn reed_sweep(frames: usize) -> Result<Vec<Figure>, ReedError> {
    let last = frames.saturating_sub(1).max(1) as f64;
    (0..frames)
        .map(|frame| {
            let h = 5.0 - 3.0 * frame as f64 / last;
            let law = ReedLaw::coupled(h, 1.0)?;
            let panel =
                Panel::new("", Axis::linear(PRESSURE).range(-0.03, 1.0), Axis::linear(FLOW).range(-1.0, 1.2))
                    .with(Mark::new(Direction::Y, 1.0, "peak 1").colour(Colour::Ink))
                    .with(
                        Line::new(format!("H = {h:.2}, k = {:.3}", law.k()), curve(law, -0.03, 1.0))
                            .width(4.0),
                    )
                    .with(Points::new("", [peak(law)]).size(7.0));
            Ok(Figure::new("Flow through the reed, k = 27 / (4 H\u{00b3})").panel(panel).size(800, 560))
        })
        .collect()
}
