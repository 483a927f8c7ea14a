//! One period of a played note over the curve of the reed at rest.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, SecondAxis, Span};
use chalumeau_core::reed::motion::SHUT;

/// The reed of a played note: its closing pressure, peak flow and lay, and one period of its motion.
pub struct ReedOrbit {
    /// What is played, for the title.
    pub title: String,
    /// By which settings.
    pub note: String,
    /// Pressure that closes the reed, extrapolated where the lay is curved, Pa.
    pub closing_pa: f64,
    /// Flow of the reed standing at its peak (sharp lay), m3/s.
    pub peak_m3s: f64,
    /// Half-width of the rounded closure, over the rest opening.
    pub lay: f64,
    /// Mouth pressure over closing pressure.
    pub gamma: f64,
    /// Time between samples, s.
    pub step_s: f64,
    /// One period: pressure difference Pa, flow m3/s, opening over rest.
    pub period: Vec<[f64; 3]>,
}

impl ReedOrbit {
    /// Part of the period in which the reed is shut, 0..=1.
    pub fn shut(&self) -> f64 {
        let shut = self.period.iter().filter(|[.., opening]| *opening < SHUT).count();
        shut as f64 / self.period.len().max(1) as f64
    }

    /// Flow of the reed without inertia at `p` over the closing pressure, over [`peak_m3s`](Self::peak_m3s).
    pub fn at_rest(&self, p: f64) -> f64 {
        let gap = 1.0 - p;
        let opening = match self.lay > 0.0 && gap < self.lay {
            true => (gap + self.lay).max(0.0).powi(2) / (4.0 * self.lay),
            false => gap.max(0.0),
        };
        let peak = 2.0 / 27.0_f64.sqrt();
        opening * p.abs().sqrt().copysign(p) / peak
    }

    /// Flow over pressure difference, and both over time.
    pub fn figure(&self) -> Figure {
        Figure::new(format!("Reed of a played note: {}", self.title))
            .note(self.note.clone())
            .panel(self.plane())
            .panel(self.over_time())
            .size(1_600, 1_400)
    }

    /// The period with its first moment again at the end.
    fn closed(&self) -> Vec<[f64; 3]> {
        self.period.iter().chain(self.period.first()).copied().collect()
    }

    /// Flow over pressure difference: the orbit, and the curve of the reed at rest.
    fn plane(&self) -> Panel {
        let kpa = 1e-3 * self.closing_pa;
        let litres = 1e3;
        let closed = self.closed();
        let orbit = closed.iter().map(|&[p, u, _]| (1e-3 * p, litres * u));
        let shut =
            closed.iter().map(
                |&[p, u, opening]| {
                    if opening < SHUT { (1e-3 * p, litres * u) } else { (f64::NAN, f64::NAN) }
                },
            );
        let pressures = self.period.iter().map(|[p, ..]| p / self.closing_pa);
        let (low, high) = pressures.fold((0.0_f64, 1.05_f64), |(low, high), p| (low.min(p), high.max(p)));
        let (low, high) = (low - 0.05, high.max(1.0 + self.lay) + 0.05);
        let rest = (0..=800).map(|n| {
            let p = low + (high - low) * f64::from(n) / 800.0;
            (kpa * p, litres * self.peak_m3s * self.at_rest(p))
        });
        let mut plane = Panel::new(
            "Flow against pressure difference",
            Axis::linear("pressure difference mouth \u{2212} mouthpiece, kPa").range(kpa * low, kpa * high),
            Axis::linear("flow through the reed, l/s"),
        )
        .weight(1.5)
        .top(SecondAxis::times(1.0 / kpa, "over the closing pressure"))
        .with(Mark::new(Direction::X, kpa / 3.0, "1/3: peak"))
        .with(
            Mark::new(Direction::X, kpa * self.gamma, format!("gamma {:.2}: mouth pressure", self.gamma))
                .colour(Colour::Green),
        );
        if self.lay > 0.0 {
            plane = plane.with(Span {
                of: Direction::X,
                from: kpa * (1.0 - self.lay),
                to: kpa * (1.0 + self.lay),
                name: "reed rolls onto the curved lay".to_owned(),
                colour: Colour::Grey,
            });
        }
        plane = plane
            .with(Mark::new(Direction::X, kpa, "1: closing pressure"))
            .with(Line::new("reed standing still", rest).colour(Colour::Grey).width(3.0))
            .with(Line::new("one period of the note", orbit).width(3.0));
        if self.shut() > 0.0 {
            plane = plane.with(
                Line::new(format!("reed shut, {:.0} % of the period", 100.0 * self.shut()), shut)
                    .colour(Colour::Vermilion)
                    .width(6.0),
            );
        }
        plane
    }

    /// Pressure difference, flow and opening over one period.
    fn over_time(&self) -> Panel {
        let closed = self.closed();
        let ms = |index: usize| 1e3 * self.step_s * index as f64;
        let over = |value: fn(&Self, [f64; 3]) -> f64| {
            closed
                .iter()
                .enumerate()
                .map(|(index, &moment)| (ms(index), value(self, moment)))
                .collect::<Vec<_>>()
        };
        Panel::new("One period", Axis::linear("time, ms"), Axis::linear("over closing, peak, rest"))
            .with(Line::new("pressure difference over closing pressure", over(|o, [p, ..]| p / o.closing_pa)))
            .with(
                Line::new("flow over peak flow", over(|o, [_, u, _]| u / o.peak_m3s))
                    .colour(Colour::Vermilion)
                    .dash(Dash::Dashed),
            )
            .with(
                Line::new("opening over rest", over(|_, [.., opening]| opening))
                    .colour(Colour::Green)
                    .dash(Dash::Dotted)
                    .width(3.0),
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    fn lines(figure: &Figure) -> Vec<&Line> {
        let layers = figure.panels.iter().flat_map(|panel| &panel.layers);
        layers.filter_map(|layer| if let Layer::Line(line) = layer { Some(line) } else { None }).collect()
    }

    #[test]
    fn an_orbit_of_a_standing_reed_lies_on_its_curve() {
        let mut orbit = ReedOrbit {
            title: String::new(),
            note: String::new(),
            closing_pa: 6_000.0,
            peak_m3s: 3e-4,
            lay: 0.0,
            gamma: 0.5,
            step_s: 1e-5,
            period: Vec::new(),
        };
        for n in 0..100 {
            let p = 0.5 + 0.55 * (std::f64::consts::TAU * f64::from(n) / 100.0).sin();
            orbit.period.push([6_000.0 * p, 3e-4 * orbit.at_rest(p), (1.0 - p).max(0.0)]);
        }
        assert!((orbit.at_rest(1.0 / 3.0) - 1.0).abs() < 1e-12 && orbit.at_rest(1.2) == 0.0);
        assert!(orbit.at_rest(-1.0) < -2.0 && orbit.shut() > 0.05 && orbit.shut() < 0.25);
        let figure = orbit.figure();
        let all = lines(&figure);
        let along = |name: &str| all.iter().find(|line| line.name.starts_with(name)).unwrap();
        let rest = &along("reed standing").pieces[0];
        for [p, u] in &along("one period").pieces[0] {
            let after = rest.partition_point(|[x, _]| x < p).clamp(1, rest.len() - 1);
            let nearest = 0.5 * (rest[after - 1][1] + rest[after][1]);
            assert!((u - nearest).abs() < 0.02, "{p} {u} {nearest}");
        }
    }
}
