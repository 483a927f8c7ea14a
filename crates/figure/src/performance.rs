//! The figure of a rendering: waveform, spectrogram, pitch over the score, breath, and the reed in close-up.

use crate::palette::Colour;
use crate::pitch_line;
use crate::{Axis, ColourMap, Direction, Figure, Heat, Layer, Line, Mark, Panel, Polygon, SecondAxis};
use chalumeau_core::analysis::overview::{Envelope, HIGHEST_HZ, Overview};
use chalumeau_core::instrument::Probe;
use chalumeau_core::reed::motion::SHUT;
use chalumeau_core::units::SoundingNote;

/// Levels of the lightest and the darkest colour of the spectrogram, dB re a sine of full scale.
const FLOOR_DB: f64 = -110.0;
const CEILING_DB: f64 = -20.0;
/// Quieter than this there is no pitch to draw: -80 dB re full scale.
const QUIET: f64 = 1e-4;

/// A note of the score as it is heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    /// Which one.
    pub note: SoundingNote,
    /// From, s.
    pub from_s: f64,
    /// To, s.
    pub to_s: f64,
}

/// Internal signals of the instrument over a few periods.
#[derive(Clone, Debug, PartialEq)]
pub struct ReedCloseUp {
    /// When it begins, s.
    pub from_s: f64,
    /// From one probe to the next, s.
    pub step_s: f64,
    /// What was there.
    pub probes: Vec<Probe>,
}

/// Everything the figure shows.
pub struct PerformanceFigure<'a> {
    /// What is played.
    pub title: &'a str,
    /// Lines under the title.
    pub notes: Vec<String>,
    /// Sound.
    pub overview: &'a Overview,
    /// The score.
    pub score: &'a [Note],
    /// Pitch of A4, Hz.
    pub a4_hz: f64,
    /// Mouth pressure over closing pressure.
    pub gamma: &'a Envelope,
    /// Pressure that closes the reed, Pa.
    pub closing_pa: f64,
    /// The close-up, if there is one.
    pub moment: Option<&'a ReedCloseUp>,
}

/// All panels below each other.
pub fn performance(of: &PerformanceFigure<'_>) -> Figure {
    let mut figure = Figure::new(of.title);
    for note in &of.notes {
        figure = figure.note(note);
    }
    // Weights and height: what legible panels of this width came out as, looked at in full size.
    figure = figure
        .panel(outline(of.overview).weight(0.85))
        .panel(spectrogram(of.overview).weight(1.7))
        .panel(pitch(of.overview, of.score, of.a4_hz).weight(1.6))
        .panel(breath(of).weight(1.05));
    match of.moment.filter(|moment| !moment.probes.is_empty()) {
        Some(moment) => figure.panel(reed(moment, of.closing_pa).weight(1.25)).size(1_600, 2_100),
        None => figure.size(1_600, 1_700),
    }
}

/// Time has its label once, under the last of the panels that share it.
fn time(label: &str, overview: &Overview) -> Axis {
    Axis::linear(label).range(0.0, overview.seconds.max(1e-3))
}

/// The area between the lowest and the highest values.
fn band(name: &str, envelope: &Envelope, seconds: f64, colour: Colour, opacity: f64) -> Polygon {
    let x = |bin: usize| seconds * envelope.middle(bin);
    let high = envelope.bins().iter().enumerate().map(|(bin, &[_, high])| (x(bin), f64::from(high)));
    let low = envelope.bins().iter().enumerate().rev().map(|(bin, &[low, _])| (x(bin), f64::from(low)));
    Polygon::filled(name, high.chain(low), colour, opacity).stroke(colour)
}

/// The waveform's outline.
pub fn outline(overview: &Overview) -> Panel {
    let peak = overview.outline.range().map_or(0.0, |[low, high]| f64::from(high.max(-low)));
    // Silence has an axis too.
    let top = if peak > 0.0 { 1.08 * peak } else { 1.0 };
    // The largest of 1, 0.5, 0.2, 0.1 .. that it reaches.
    let decade = 10f64.powf(top.log10().floor());
    let round = [5.0, 2.0, 1.0].into_iter().map(|n| n * decade).find(|&x| x <= top).unwrap_or(decade);
    let ticks = [-round, 0.0, round].map(|at| (at, format!("{at}")));
    let axis = Axis::linear("of full scale").range(-top, top).ticks(ticks);
    Panel::new("Waveform", time("", overview), axis).with(band(
        "",
        &overview.outline,
        overview.seconds,
        Colour::Blue,
        0.8,
    ))
}

/// Levels over time and frequency.
pub fn spectrogram(overview: &Overview) -> Panel {
    let top_khz = 1e-3 * HIGHEST_HZ.min(overview.row_hz * (overview.rows as f64 - 0.5));
    let half_khz = 0.5e-3 * overview.row_hz;
    let heat = Heat {
        name: "dB of full scale".to_owned(),
        x: [0.0, overview.seconds.max(1e-3)],
        y: [-half_khz, 1e-3 * overview.row_hz * overview.rows as f64 - half_khz],
        columns: overview.columns,
        rows: overview.rows,
        levels: overview.levels_db.clone(),
        range: [FLOOR_DB, CEILING_DB],
        map: ColourMap::PaperToInk,
    };
    Panel::new("Spectrogram", time("", overview), Axis::linear("frequency, kHz").range(0.0, top_khz))
        .with(Layer::Heat(heat))
}

/// What is heard over what is written.
pub fn pitch(overview: &Overview, score: &[Note], a4_hz: f64) -> Panel {
    let key = |hz: f64| pitch_line::key(hz, a4_hz);
    let keys = score.iter().map(|note| f64::from(note.note.0));
    let (low, high) = keys.fold((f64::MAX, f64::MIN), |(low, high), key| (low.min(key), high.max(key)));
    let (low, high) = if low > high { (60.0, 72.0) } else { (low, high) };
    let axis = Axis::notes("sounding pitch").range(low - 1.5, high + 1.5);
    let title = "Pitch heard (line) over the notes of the score (bars of 100 cents)";
    let mut panel = Panel::new(title, time("", overview), axis);
    for note in score {
        let key = f64::from(note.note.0);
        let (from, to) = (note.from_s, note.to_s);
        let corners = [(from, key - 0.5), (from, key + 0.5), (to, key + 0.5), (to, key - 0.5)];
        panel = panel.with(Polygon::filled("", corners, Colour::Sky, 0.35));
    }
    let heard = overview.track.iter().map(|point| {
        let here = point.hz.filter(|_| point.rms > QUIET).map(key);
        // A squeak far above the notes is left to the spectrogram.
        (point.t_s, here.filter(|key| (low - 1.5..high + 1.5).contains(key)))
    });
    let line = pitch_line::points(heard);
    panel.with(Line::new("", line).colour(Colour::Vermilion).width(2.0))
}

fn breath(of: &PerformanceFigure<'_>) -> Panel {
    let top = of.gamma.range().map_or(1.0, |[_, high]| f64::from(high)).max(1.0);
    let axis = Axis::linear("gamma").range(0.0, 1.08 * top);
    let title =
        "Mouth pressure over the pressure that shuts the reed (dashed: 1/3, the threshold of an ideal reed)";
    Panel::new(title, time("time, s", of.overview), axis)
        .right(SecondAxis::times(1e-3 * of.closing_pa, "kPa"))
        .with(Mark::new(Direction::Y, 1.0 / 3.0, ""))
        .with(band("", of.gamma, of.overview.seconds, Colour::Blue, 0.8))
}

/// The reed and the pressure that moves it.
fn reed(moment: &ReedCloseUp, closing_pa: f64) -> Panel {
    let at = |index: usize| 1e3 * moment.step_s * index as f64;
    let series = |value: &dyn Fn(&Probe) -> f64| -> Vec<(f64, f64)> {
        moment.probes.iter().enumerate().map(|(index, probe)| (at(index), value(probe))).collect()
    };
    let opening = series(&|probe| probe.opening);
    let pressure = series(&|probe| probe.p_mouthpiece_pa / closing_pa);
    let shut = opening.iter().filter(|&&(_, opening)| opening < SHUT).count() as f64 / opening.len() as f64;
    let title =
        format!("The reed from near, from {:.3} s on: shut {:.0} % of the time", moment.from_s, 100.0 * shut);
    let axis = Axis::linear("time, ms").range(0.0, at(moment.probes.len().max(2) - 1));
    Panel::new(title, axis, Axis::linear("over rest; over closing"))
        .with(Mark::new(Direction::Y, 0.0, ""))
        .with(Polygon::area("", opening.iter().copied(), 0.0, Colour::Sky, 0.25))
        .with(Line::new("gap of the reed over that at rest", opening).colour(Colour::Blue))
        .with(
            Line::new("pressure in the mouthpiece over closing pressure", pressure)
                .colour(Colour::Vermilion)
                .width(1.8),
        )
}
