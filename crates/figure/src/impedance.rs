//! What the bore answers to the reed: one fingering as a curve, or the peaks of all.

use crate::palette::{Colour, SERIES};
use crate::{
    Anchor, Axis, Dash, Direction, Figure, Line, Mark, Panel, Points, SecondAxis, Shape, Span, Text,
};
use chalumeau_core::bore::transfer_matrix::Peak;
use chalumeau_core::units::{WrittenNote, cents};
use num_complex::Complex64;

/// One model's answer.
pub struct Curve {
    /// Whose.
    pub name: String,
    /// Frequency, Hz, and Z/Zc.
    pub z: Vec<(f64, Complex64)>,
}

/// A fingering and what was found of it.
pub struct FingeringImpedance<'a> {
    /// The instrument.
    pub instrument: &'a str,
    /// Settings worth telling.
    pub notes: Vec<String>,
    /// Which fingering, as the title has it: `written F4`.
    pub fingering: String,
    /// Frequency whose multiples are marked, Hz, and what it is.
    pub sounding_hz: f64,
    /// What that frequency is: `the note`.
    pub pitch: &'a str,
    /// Models, the first one foremost.
    pub curves: Vec<Curve>,
    /// Modes of the first one.
    pub modes: Vec<Peak>,
    /// Where the open holes stop giving back what arrives, Hz.
    pub cutoff_hz: Option<f64>,
}

/// How far a mode stands from the nearest whole multiple of a note: the multiple, and cents.
pub fn from_harmonic(f_hz: f64, sounding_hz: f64) -> (u32, f64) {
    let harmonic = (f_hz / sounding_hz).round().max(1.0);
    (harmonic as u32, cents(f_hz, harmonic * sounding_hz))
}

fn db(z: Complex64) -> f64 {
    20.0 * z.norm().log10()
}

/// Magnitude with modes and cut-off, and phase, over frequency.
pub fn fingering(about: &FingeringImpedance<'_>) -> Figure {
    let mut figure = Figure::new(format!("Input impedance of {}", about.fingering)).note(about.instrument);
    for note in &about.notes {
        figure = figure.note(note);
    }
    let all = || about.curves.iter().flat_map(|curve| &curve.z);
    let last_hz = all().map(|&(f_hz, _)| f_hz).fold(0.0, f64::max);
    let first_hz = all().map(|&(f_hz, _)| f_hz).fold(last_hz, f64::min);
    let (low_db, high_db) = all()
        .map(|&(_, z)| db(z))
        .filter(|db| db.is_finite())
        .fold((0.0f64, 0.0f64), |(a, b), db| (a.min(db), b.max(db)));

    let axis = || Axis::linear("frequency, Hz").range(first_hz, last_hz.max(first_hz + 1.0));
    let harmonics = (1..)
        .map(|harmonic| (f64::from(harmonic) * about.sounding_hz, harmonic.to_string()))
        .skip_while(|&(f_hz, _)| f_hz < first_hz)
        .take_while(|&(f_hz, _)| f_hz <= last_hz);
    // Beyond thirty the numbers would run into each other.
    let every = 1 + harmonics.clone().count() / 30;
    let harmonics =
        harmonics.filter(|(_, text)| text.parse::<usize>().is_ok_and(|n| (n - 1).is_multiple_of(every)));
    let label = format!("whole multiples of {:.1} Hz, {}", about.sounding_hz, about.pitch);
    // Room above for the words of the modes.
    let magnitude = Axis::linear("|Z| / Zc, dB").range(low_db - 3.0, high_db + 16.0);
    let mut upper = Panel::new("", axis(), magnitude).weight(2.0);
    // A narrow range may have none.
    if harmonics.clone().next().is_some() {
        upper = upper.top(SecondAxis::named(label, harmonics));
    }
    let mut lower = Panel::new(
        "",
        axis(),
        Axis::linear("phase, degrees").range(-95.0, 95.0).ticks(
            [-90, -45, 0, 45, 90]
                .map(|degrees| (f64::from(degrees), degrees.to_string().replace('-', "\u{2212}"))),
        ),
    );
    for (index, curve) in about.curves.iter().enumerate() {
        let (colour, dash, width) = if index == 0 {
            (SERIES[0], Dash::Solid, 3.0)
        } else {
            (SERIES[index % SERIES.len()], Dash::Dashed, 1.8)
        };
        let styled = |name: &str, y: &dyn Fn(Complex64) -> f64| {
            let points = curve.z.iter().map(|&(f_hz, z)| (f_hz, y(z)));
            Line::new(name, points).colour(colour).dash(dash).width(width)
        };
        upper = upper.with(styled(&curve.name, &db));
        lower = lower.with(styled("", &|z| z.arg().to_degrees()));
    }
    if let Some(cutoff_hz) = about.cutoff_hz.filter(|hz| (first_hz..last_hz).contains(hz)) {
        let above = |name: String| Span {
            of: Direction::X,
            from: cutoff_hz,
            to: last_hz,
            name,
            colour: Colour::Grey,
        };
        upper = upper.with(above(format!("above the cut-off of the open holes, {cutoff_hz:.0} Hz")));
        lower = lower.with(above(String::new()));
    }
    upper = modes(upper, about, (first_hz, last_hz));
    figure.panel(upper).panel(lower).size(1_600, 1_150)
}

/// Cents are shown only for modes within this of a multiple of the note.
const NEAR_CENTS: f64 = 100.0;

/// Discs on the modes, with frequency and cents; words that would run into each other go up in steps.
fn modes(mut panel: Panel, about: &FingeringImpedance<'_>, (first_hz, last_hz): (f64, f64)) -> Panel {
    let shown: Vec<&Peak> =
        about.modes.iter().filter(|mode| (first_hz..=last_hz).contains(&mode.f_hz)).collect();
    let at = |mode: &Peak| (mode.f_hz, 20.0 * mode.mag_over_zc.log10());
    panel = panel.with(
        Points::new("modes: Hz, and cents from the nearest multiple", shown.iter().map(|mode| at(mode)))
            .colour(Colour::Ink)
            .size(4.5),
    );
    // Width of such words at nominal size, about a twelfth of the axis, and their height, dB on the axis.
    let (near_hz, step_db) = ((last_hz - first_hz) / 12.0, 5.0);
    let mut before: Option<(f64, f64)> = None;
    for mode in shown {
        let (f_hz, mut height_db) = at(mode);
        if let Some((hz, db)) = before
            && f_hz - hz < near_hz
            && height_db < db + step_db
            && height_db > db - step_db
        {
            height_db = db + step_db;
        }
        before = Some((f_hz, height_db));
        let (_, dot_db) = at(mode);
        if height_db > dot_db {
            // Whose words they are.
            let leader = Line::new("", [(f_hz, dot_db + 1.0), (f_hz, height_db + 1.0)]);
            panel = panel.with(leader.colour(Colour::Pale));
        }
        let (_, cents) = from_harmonic(f_hz, about.sounding_hz);
        // A mode between two multiples, or below the first, belongs to none.
        let text = if cents.abs() <= NEAR_CENTS {
            format!("{f_hz:.0} Hz {cents:+.0}")
        } else {
            format!("{f_hz:.0} Hz")
        };
        panel = panel.with(Text::new(f_hz, height_db + 1.0, text).anchor(Anchor::Above));
    }
    panel
}

/// The peaks of one note.
pub struct NotePeaks {
    /// The note.
    pub written: WrittenNote,
    /// Its pitch, Hz.
    pub sounding_hz: f64,
    /// Its first peaks, lowest first; the one that sounds among them.
    pub peaks: Vec<Peak>,
    /// How many of them are drawn, besides the one that sounds.
    pub shown: usize,
}

impl NotePeaks {
    /// The peak that sounds: the nearest to the note, by interval. Its number depends on how the peaks are calculated, where one is
    /// so low in one model that another does not have it.
    fn sounds(&self) -> Option<&Peak> {
        let apart = |peak: &Peak| cents(peak.f_hz, self.sounding_hz).abs();
        self.peaks.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

/// Most peaks that the legend of a chart names one by one; of more, it names the first and the last.
const MOST_NAMED: usize = 8;

/// Peaks of all notes: where they are, how far the one that sounds is from its note, and how high it is.
pub fn chart(instrument: &str, notes: Vec<String>, rows: &[NotePeaks]) -> Figure {
    let mut figure = Figure::new("Impedance peaks of every fingering").note(instrument);
    for note in notes {
        figure = figure.note(note);
    }
    // The label of the notes stands once, below all three.
    let axis = |label: &str| Axis::notes(label);
    let x = |row: &NotePeaks| f64::from(row.written.0);
    let highest_hz = highest_peak_hz(rows);
    let count = rows.iter().map(|row| row.peaks.len().min(row.shown)).max().unwrap_or(0);
    let mut places = Panel::new("Where they are", axis(""), frequencies(rows)).weight(2.4);
    for multiple in [1, 3, 5] {
        let line = rows.iter().map(|row| (x(row), f64::from(multiple) * row.sounding_hz));
        let line = line.filter(|&(_, hz)| hz <= highest_hz);
        let name = if multiple == 1 { "the note, 3 and 5 times it" } else { "" };
        places = places.with(Line::new(name, line).colour(Colour::Pale).width(2.0));
    }
    for mode in 0..count {
        let points = rows.iter().filter_map(|row| Some((x(row), row.peaks.get(mode)?.f_hz)));
        let is_named = count <= MOST_NAMED || mode == 0 || mode + 1 == count;
        let name = if is_named { format!("peak {}", mode + 1) } else { String::new() };
        places = places.with(Points::new(name, points).colour(Colour::of_family(mode, count)).size(3.5));
    }
    let sounding = rows.iter().filter_map(|row| Some((x(row), row.sounds()?.f_hz)));
    places = places.with(Points::new("sounds", sounding).colour(Colour::Ink).shape(Shape::Ring).size(6.5));

    let off = rows.iter().filter_map(|row| Some((x(row), cents(row.sounds()?.f_hz, row.sounding_hz))));
    let off = Panel::new("The peak that sounds, from its note", axis(""), Axis::linear("cents"))
        .with(Mark::new(Direction::Y, 0.0, ""))
        .with(Points::new("", off));
    let high = rows.iter().filter_map(|row| Some((x(row), 20.0 * row.sounds()?.mag_over_zc.log10())));
    let high = Panel::new("Its height", axis("written note"), Axis::linear("|Z| / Zc, dB"))
        .with(Points::new("", high));
    figure.panel(places).panel(off).panel(high).size(1_600, 1_500)
}

fn highest_peak_hz(rows: &[NotePeaks]) -> f64 {
    drawn(rows).map(|peak| peak.f_hz).fold(0.0, f64::max)
}

/// The peaks that a chart draws.
fn drawn(rows: &[NotePeaks]) -> impl Iterator<Item = &Peak> {
    rows.iter().flat_map(|row| row.peaks.iter().take(row.shown).chain(row.sounds()))
}

/// An axis for all peaks, with three ticks a factor of ten.
fn frequencies(rows: &[NotePeaks]) -> Axis {
    let high_hz = highest_peak_hz(rows);
    let low_hz = drawn(rows).map(|peak| peak.f_hz).fold(high_hz, f64::min);
    let axis = Axis::log("frequency, Hz");
    if low_hz <= 0.0 {
        return axis;
    }
    let ticks = [50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000].map(|hz| (f64::from(hz), hz.to_string()));
    axis.range(low_hz / 1.1, high_hz * 1.1).ticks(ticks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_belong_to_the_nearest_multiple() {
        assert_eq!(from_harmonic(440.0, 440.0), (1, 0.0));
        let (harmonic, cents) = from_harmonic(1310.0, 440.0);
        assert!(harmonic == 3 && (cents + 13.17).abs() < 0.1, "{cents}");
        // Below the note there is no multiple but the first.
        assert_eq!(from_harmonic(100.0, 440.0).0, 1);
    }
}
