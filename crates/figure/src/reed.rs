//! Figures of the reed's flow law, as the reference notebook drew them.
//!
//! `p` is the pressure difference (mouth minus mouthpiece) over a closing pressure, `u` the dimensionless flow,
//! `u = A (H sqrt(p) - p^1.5 / k)`; see [`chalumeau_core::reed::law`]. The curves come from the
//! tables that sound and knob share. [`reed_sweep`](crate::reed_sweep) animates one of them, [`reed_orbit`](crate::reed_orbit)
//! draws a played note over the curve.

use crate::palette::Colour;
use crate::{Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, SecondAxis};
use chalumeau_core::reed::law::{H_INIT, K_INIT, ReedError};
use chalumeau_core::reed::{PhysicalReed, ReedLaw, ReedTables};
use chalumeau_core::units::Air;

/// The figures of one picture each, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawFigure {
    /// The law with everything 1.
    Unit,
    /// The same over a turn of the knob.
    Angle,
    /// Rest openings H, the same stiffness.
    FamilyH,
    /// Stiffnesses k, the same opening.
    FamilyK,
    /// Rest openings H, with the stiffness that keeps the peak at 1.
    Coupled,
    /// Amplitudes A.
    Amplitude,
    /// Flow and opening when the air flows back.
    Negative,
    /// Reeds in pascal and litres a second.
    Physical,
}

impl LawFigure {
    /// All of them, in the order of the notebook.
    pub const ALL: [Self; 8] = [
        Self::Unit,
        Self::Angle,
        Self::FamilyH,
        Self::FamilyK,
        Self::Coupled,
        Self::Amplitude,
        Self::Negative,
        Self::Physical,
    ];

    /// The figure.
    pub fn figure(self) -> Result<Figure, ReedError> {
        match self {
            Self::Unit => unit(),
            Self::Angle => angle(),
            Self::FamilyH => family_h(),
            Self::FamilyK => family_k(),
            Self::Coupled => coupled(),
            Self::Amplitude => amplitude(),
            Self::Negative => negative(),
            Self::Physical => Ok(physical(&Air::default())),
        }
    }
}

/// Openings of the families; the third is the reference, sqrt(27)/2.
const OPENINGS: [f64; 6] = [1.5, 2.0, H_INIT, 3.0, 3.5, 4.0];
/// Points of a curve.
const POINTS: usize = 550;

pub(crate) const PRESSURE: &str = "pressure difference p, over the reference closing pressure";
pub(crate) const FLOW: &str = "flow u";

/// Flow from `low` to `high`; closely spaced about 0, where it rises steeply.
pub(crate) fn curve(law: ReedLaw, low: f64, high: f64) -> Vec<(f64, f64)> {
    let tables = ReedTables::reference();
    let mut points: Vec<f64> = (0..=POINTS).map(|n| low + (high - low) * n as f64 / POINTS as f64).collect();
    points.extend((-30_i32..=30).map(|n| f64::from(n * n.abs()) * 2e-5).filter(|p| (low..=high).contains(p)));
    points.extend([law.peak_at(), law.closing()].into_iter().filter(|p| (low..=high).contains(p)));
    points.sort_by(f64::total_cmp);
    points.into_iter().map(|p| (p, law.flow(tables, p))).collect()
}

/// Pressure and flow at the maximum of the curve.
pub(crate) fn peak(law: ReedLaw) -> (f64, f64) {
    (law.peak_at(), law.peak_flow())
}

fn unit() -> Result<Figure, ReedError> {
    let law = ReedLaw::free(1.0, 1.0, 1.0)?;
    let panel = Panel::new(
        "",
        Axis::linear("pressure difference p, over the closing pressure").range(-0.1, 1.0),
        Axis::linear(FLOW),
    )
    .with(Mark::new(
        Direction::X,
        1.0 / 3.0,
        format!("1/3: peak of {:.4}, oscillation can begin", law.peak_flow()),
    ))
    .with(Mark::new(Direction::X, 1.0, "1: closed"))
    .with(Line::new("u = sqrt|p| (1 \u{2212} p) sgn(p)", curve(law, -0.1, 1.0)).width(3.5))
    .with(Points::new("", [peak(law)]).size(7.0));
    Ok(Figure::new("Flow through the reed, with opening, stiffness and closing pressure 1")
        .note("Bernoulli through a slit that pressure closes. Below 0 the air flows back and pushes the reed open.")
        .panel(panel))
}

fn angle() -> Result<Figure, ReedError> {
    let law = ReedLaw::free(1.0, 1.0, 1.0)?;
    let degrees = curve(law, 0.0, 1.0).into_iter().map(|(p, u)| (360.0 * p, u / law.peak_flow()));
    let ticks = (0..=12).map(|n| (30.0 * f64::from(n), (30 * n).to_string()));
    let panel = Panel::new(
        "",
        Axis::linear("angle of the knob, degrees").range(0.0, 360.0).ticks(ticks),
        Axis::linear("flow over its peak").range(0.0, 1.08),
    )
    .with(Mark::new(Direction::X, 120.0, "120: peak"))
    .with(Mark::new(Direction::X, 360.0, "360: closed"))
    .with(Line::new("flow, closing pressure laid over one turn", degrees).width(3.5))
    .with(Points::new("", [(120.0, 1.0)]).size(7.0));
    Ok(Figure::new("Flow through the reed over one turn of a knob, normalised")
        .note("The same law as over 0..1: its shape does not depend on where the reed closes.")
        .panel(panel))
}

fn families(laws: &[(String, ReedLaw)], emphasised: usize, low: f64, high: f64, panel: Panel) -> Panel {
    let count = laws.len();
    laws.iter().enumerate().fold(panel, |panel, (index, (name, law))| {
        let colour = Colour::of_family(index, count);
        let width = if index == emphasised { 4.0 } else { 2.5 };
        panel
            .with(Line::new(name, curve(*law, low, high.min(law.closing()))).colour(colour).width(width))
            .with(Points::new("", [peak(*law)]).colour(colour).size(6.0))
    })
}

fn family_h() -> Result<Figure, ReedError> {
    let laws = OPENINGS
        .iter()
        .map(|&h| Ok((format!("H = {}", short(h)), ReedLaw::free(h, K_INIT, 1.0)?)))
        .collect::<Result<Vec<_>, ReedError>>()?;
    let panel = Panel::new("", Axis::linear(PRESSURE).range(-0.1, 1.6), Axis::linear(FLOW));
    Ok(Figure::new("Rest opening H, the same stiffness: wider passes more and closes later")
        .note(format!(
            "k = {K_INIT:.4}, A = 1. Peaks (dots) at H k / 3 with sqrt(4 H\u{00b3} k / 27); closed from H k on."
        ))
        .panel(families(&laws, 2, -0.1, 1.6, panel)))
}

fn family_k() -> Result<Figure, ReedError> {
    let laws = [0.2, 0.3, K_INIT, 0.5, 0.6]
        .iter()
        .map(|&k| Ok((format!("k = {}", short(k)), ReedLaw::free(H_INIT, k, 1.0)?)))
        .collect::<Result<Vec<_>, ReedError>>()?;
    let panel = Panel::new("", Axis::linear(PRESSURE).range(-0.1, 1.6), Axis::linear(FLOW));
    Ok(Figure::new("Stiffness k, the same opening: stiffer passes more and closes later")
        .note(format!(
            "H = sqrt(27)/2 = {H_INIT:.4}, A = 1. All curves begin alike: at rest stiffness is not felt."
        ))
        .panel(families(&laws, 2, -0.1, 1.6, panel)))
}

fn coupled() -> Result<Figure, ReedError> {
    let laws = [1.8, 2.0, 2.25, H_INIT, 3.0, 3.5, 4.5]
        .iter()
        .map(|&h| Ok((format!("H = {}", short(h)), ReedLaw::coupled(h, 1.0)?)))
        .collect::<Result<Vec<_>, ReedError>>()?;
    let panel =
        Panel::new("", Axis::linear(PRESSURE).range(-0.1, 2.1), Axis::linear(FLOW).range(-1.75, 1.15))
            .with(Mark::new(Direction::Y, 1.0, "peak 1").colour(Colour::Ink));
    Ok(Figure::new("Opening and stiffness coupled, k = 27 / (4 H\u{00b3}): the peak stays 1")
        .note("A = 1. Where it peaks and closes moves: H is a stretch of the pressure axis. H = sqrt(27)/2 = 2.598 closes at 1.")
        .panel(families(&laws, 3, -0.1, 2.1, panel)))
}

fn amplitude() -> Result<Figure, ReedError> {
    let laws = [0.25, 0.5, 0.75, 1.0, 1.25, 1.5]
        .iter()
        .map(|&a| Ok((format!("A = {a}"), ReedLaw::coupled(H_INIT, a)?)))
        .collect::<Result<Vec<_>, ReedError>>()?;
    let panel = Panel::new("", Axis::linear(PRESSURE).range(-0.03, 1.05), Axis::linear(FLOW));
    Ok(Figure::new("Amplitude A scales the flow and moves nothing")
        .note("H = sqrt(27)/2, k = 27 / (4 H\u{00b3}). A stands for the width of the slit and the density of the air.")
        .panel(families(&laws, 3, -0.03, 1.05, panel)))
}

fn negative() -> Result<Figure, ReedError> {
    let law = ReedLaw::default();
    let notebook = |p: f64| {
        let size = p.abs();
        ((law.h() * size.sqrt() - size.powf(1.5) / law.k()) * p.signum()).clamp(-10.0, 10.0)
    };
    let places = (-1000..=1000).map(|n| f64::from(n) / 1000.0);
    let opening = |p: f64| (1.0 - p / law.closing()).max(0.0);
    let flow = Panel::new("", Axis::linear(PRESSURE).range(-1.0, 1.05), Axis::linear(FLOW).range(-5.4, 1.4))
        .weight(1.5)
        .with(Line::new("reed pushed open by what flows back", curve(law, -1.0, 1.05)).width(3.5))
        .with(
            Line::new("tables times sign: closes at \u{2212}1 too", places.map(|p| (p, notebook(p))))
                .colour(Colour::Vermilion)
                .dash(Dash::Dashed),
        );
    let gap = Panel::new(
        "",
        Axis::linear(PRESSURE).range(-1.0, 1.05),
        Axis::linear("opening over rest").range(0.0, 2.1),
    )
    .with(Line::new("opening", (-100..=105).map(|n| f64::from(n) / 100.0).map(|p| (p, opening(p)))))
    .with(
        Line::new(
            "opening the signed tables stand for",
            (-100..=100).map(|n| f64::from(n) / 100.0).map(|p| (p, 1.0 - p.abs())),
        )
        .colour(Colour::Vermilion)
        .dash(Dash::Dashed),
    );
    Ok(Figure::new("Negative pressure: what flows back opens the reed")
        .note("H = sqrt(27)/2, k = 0.3849, A = 1. Sucked at, or driven by the returning wave, the reed moves away from the lay.")
        .panel(flow)
        .panel(gap)
        .size(1_600, 1_200))
}

fn physical(air: &Air) -> Figure {
    let reference = PhysicalReed::reference();
    // Litres a second over Pa^0.5, and Pa.
    let flow = |reed: &PhysicalReed, pa: f64| {
        let gap = 1.0 - pa / reed.closing_pa();
        let flow = 1e3 * reed.beta(air) * pa.abs().sqrt();
        if pa < 0.0 { -flow * gap } else { flow * gap.max(0.0) }
    };
    let curve = |reed: &PhysicalReed, from: f64, to: f64| -> Vec<(f64, f64)> {
        let even = (0..=POINTS).map(|n| from + (to - from) * n as f64 / POINTS as f64);
        let mut places: Vec<f64> = even.chain((-20_i32..=20).map(|n| f64::from(n * n.abs()) * 0.5)).collect();
        places.push(reed.closing_pa());
        places.retain(|pa| (from..=to).contains(pa));
        places.sort_by(f64::total_cmp);
        places.into_iter().map(|pa| (1e-3 * pa, flow(reed, pa))).collect()
    };
    let (from, to) = (-500.0, 11_000.0);
    let panel = |title: &str| {
        Panel::new(
            title,
            Axis::linear("pressure difference, kPa").range(1e-3 * from, 1e-3 * to),
            Axis::linear("flow, l/s"),
        )
        .right(SecondAxis::times(1e-3, "flow, m\u{00b3}/s"))
    };
    let reeds = |panel: Panel, reeds: Vec<(String, PhysicalReed)>| {
        let count = reeds.len();
        reeds.into_iter().enumerate().fold(panel, |panel, (index, (name, reed))| {
            let colour = Colour::of_family(index, count);
            let peak = reed.closing_pa() / 3.0;
            let same = (reed.stiffness_n_m - reference.stiffness_n_m).abs() < 1e-9
                && (reed.tip_opening_m - reference.tip_opening_m).abs() < 1e-12;
            panel
                .with(Line::new(name, curve(&reed, from, reed.closing_pa())).colour(colour).width(if same {
                    4.0
                } else {
                    2.5
                }))
                .with(Points::new("", [(1e-3 * peak, flow(&reed, peak))]).colour(colour).size(6.0))
        })
    };
    let stiff = [0.6, 0.8, 1.0, 1.3, 1.7].map(|factor| {
        let reed = PhysicalReed { stiffness_n_m: factor * reference.stiffness_n_m, ..reference };
        (format!("{:.0} N/m", reed.stiffness_n_m), reed)
    });
    let open = [0.3, 0.4, 0.5, 0.6, 0.7]
        .map(|tip_mm| (format!("{tip_mm} mm"), PhysicalReed { tip_opening_m: 1e-3 * tip_mm, ..reference }));
    Figure::new("Flow through reeds in physical units")
        .note(format!(
            "u = w (H \u{2212} A p / K) sqrt(2 p / rho): w = {:.1} mm, A = {:.0} mm\u{00b2}, rho = {:.3} kg/m\u{00b3}; thick: H = {:.2} mm, K = {:.0} N/m, \
             closes at {:.1} kPa.",
            1e3 * reference.width_m,
            1e6 * reference.area_m2,
            air.rho,
            1e3 * reference.tip_opening_m,
            reference.stiffness_n_m,
            1e-3 * reference.closing_pa()
        ))
        .panel(reeds(panel("Stiffness K"), stiff.to_vec()))
        .panel(reeds(panel("Tip opening H at rest"), open.to_vec()))
        .size(1_600, 1_300)
}

/// A number with at most three decimals.
fn short(x: f64) -> String {
    let text = format!("{x:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;

    fn highest(line: &Line) -> f64 {
        line.pieces.iter().flatten().map(|point| point[1]).fold(f64::MIN, f64::max)
    }

    fn lines(figure: &Figure) -> Vec<&Line> {
        let layers = figure.panels.iter().flat_map(|panel| &panel.layers);
        layers.filter_map(|layer| if let Layer::Line(line) = layer { Some(line) } else { None }).collect()
    }

    #[test]
    fn coupled_curves_all_peak_at_one() {
        let figure = LawFigure::Coupled.figure().unwrap();
        assert_eq!(lines(&figure).len(), 7);
        for line in lines(&figure) {
            assert!((highest(line) - 1.0).abs() < 1e-4, "{}: {}", line.name, highest(line));
        }
    }

    #[test]
    fn free_curves_peak_where_the_notebook_derives_it() {
        for (kind, law) in [
            (
                LawFigure::FamilyH,
                &(|x| ReedLaw::free(x, K_INIT, 1.0)) as &dyn Fn(f64) -> Result<ReedLaw, ReedError>,
            ),
            (LawFigure::FamilyK, &|x| ReedLaw::free(H_INIT, x, 1.0)),
            (LawFigure::Amplitude, &|x| ReedLaw::coupled(H_INIT, x)),
        ] {
            for line in lines(&kind.figure().unwrap()) {
                let (_, value) = line.name.split_once("= ").unwrap();
                let law = law(value.parse().unwrap()).unwrap();
                assert!((highest(line) / law.peak_flow() - 1.0).abs() < 1e-3, "{kind:?} {}", line.name);
            }
        }
    }

    #[test]
    fn normalised_curve_peaks_at_a_third_of_a_turn() {
        let figure = LawFigure::Angle.figure().unwrap();
        let peak = lines(&figure)[0].pieces[0].iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert!((peak[0] - 120.0).abs() < 1.0 && (peak[1] - 1.0).abs() < 1e-4, "{peak:?}");
    }

    #[test]
    fn flow_back_opens_the_reed() {
        let figure = LawFigure::Negative.figure().unwrap();
        let first = |line: &Line| line.pieces[0][0];
        let lines = lines(&figure);
        assert_eq!(first(lines[0])[0], -1.0);
        assert!((first(lines[0])[1] + H_INIT + 1.0 / K_INIT).abs() < 1e-6, "twice as open");
        assert!(first(lines[1])[1].abs() < 1e-9, "the signed tables close");
    }

    #[test]
    fn physical_curves_end_at_their_closing_pressure() {
        for line in lines(&LawFigure::Physical.figure().unwrap()) {
            let shut = line.pieces[0].iter().find(|[p, u]| *p > 0.1 && *u <= 1e-12).unwrap()[0];
            let (value, unit) = line.name.split_once(' ').unwrap();
            let (value, reference) = (value.parse::<f64>().unwrap(), PhysicalReed::reference());
            let reed = match unit {
                "mm" => PhysicalReed { tip_opening_m: 1e-3 * value, ..reference },
                _ => PhysicalReed { stiffness_n_m: value, ..reference },
            };
            assert!((1e3 * shut / reed.closing_pa() - 1.0).abs() < 5e-3, "{}: {shut} kPa", line.name);
        }
    }
}
