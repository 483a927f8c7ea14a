//! One picture of a performance: spectrogram, pitch over the notes of the score, and breath with level.

use std::path::Path;

use anyhow::{Result, anyhow};
use chalumeau::analysis::pitch::pitch_track;
use chalumeau::analysis::spectrum::{moving_rms, power_spectrum_db};
use chalumeau::event::Event;
use chalumeau::render::heard::Sounding;
use chalumeau::render::score::Score;
use chalumeau::units::SoundingNote;
use plotters::prelude::*;

use crate::touch_demo::Performance;

const WIDTH: u32 = 1600;
const HEIGHT: u32 = 1150;
const TOUCH_HEIGHT: u32 = 1400;
const HIGHEST_HZ: f64 = 6_000.0;
/// Samples of a spectrogram column, 85 ms at 48 kHz: harmonics of the lowest note stand apart.
const COLUMN: usize = 4096;
const FLOOR_DB: f64 = -110.0;
const CEILING_DB: f64 = -20.0;
/// Closer to the score than this a pitch belongs to the note, cents.
const NEAR_CENTS: f64 = 60.0;

const INK: RGBColor = RGBColor(40, 44, 52);
const PITCH: RGBColor = RGBColor(200, 60, 30);
const NOTE: RGBColor = RGBColor(170, 200, 230);
const BREATH: RGBColor = RGBColor(40, 110, 190);

/// Draws `samples` and the score they come from.
pub fn write(
    path: &Path,
    samples: &[f64],
    rate_hz: f64,
    notes: &[Sounding],
    score: &Score,
    a4_hz: f64,
) -> Result<()> {
    register_font()?;
    let root = BitMapBackend::new(path, (WIDTH, HEIGHT)).into_drawing_area();
    root.fill(&WHITE)?;
    let (upper, rest) = root.split_vertically(480);
    let (middle, lower) = rest.split_vertically(440);
    let seconds = samples.len() as f64 / rate_hz;

    spectrogram(&upper, samples, rate_hz, seconds)?;
    pitches(&middle, samples, rate_hz, seconds, notes, a4_hz)?;
    breath(&lower, samples, rate_hz, seconds, score)?;
    root.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;

fn spectrogram(area: &Area<'_>, samples: &[f64], rate_hz: f64, seconds: f64) -> Result<()> {
    let mut chart = frame(area, "Spectrogram (white -110 dB, black -20 dB)")
        .build_cartesian_2d(0.0..seconds, 0.0..HIGHEST_HZ / 1000.0)?;
    let plot = chart.plotting_area().strip_coord_spec();
    let (width, height) = plot.dim_in_pixel();
    for x in 0..width {
        let centre = (f64::from(x) + 0.5) / f64::from(width) * samples.len() as f64;
        let start = (centre as usize).saturating_sub(COLUMN / 2).min(samples.len().saturating_sub(COLUMN));
        let column = &samples[start..(start + COLUMN).min(samples.len())];
        let spectrum = power_spectrum_db(column, rate_hz);
        for y in 0..height {
            let hz = HIGHEST_HZ * (1.0 - (f64::from(y) + 0.5) / f64::from(height));
            let place = hz / spectrum.bin_hz;
            let bin = place as usize;
            let level = |bin: usize| spectrum.level_db.get(bin).copied().unwrap_or(FLOOR_DB);
            let db = level(bin) + place.fract() * (level(bin + 1) - level(bin));
            plot.draw_pixel((x as i32, y as i32), &heat((db - FLOOR_DB) / (CEILING_DB - FLOOR_DB)))?;
        }
    }
    mesh(&mut chart, "frequency, kHz", 7, &|khz: &f64| format!("{khz:.0}"), false)
}

fn pitches(
    area: &Area<'_>,
    samples: &[f64],
    rate_hz: f64,
    seconds: f64,
    notes: &[Sounding],
    a4_hz: f64,
) -> Result<()> {
    let keys = notes.iter().map(|sounding| f64::from(sounding.note.0));
    let low = keys.clone().fold(127.0, f64::min) - 1.5;
    let high = keys.fold(0.0, f64::max) + 1.5;
    let mut chart = frame(area, "Pitch heard (line) over the notes of the score (bars of 100 cents)")
        .build_cartesian_2d(0.0..seconds, low..high)?;
    mesh(&mut chart, "sounding pitch", 9, &|key: &f64| SoundingNote(*key as u8).to_string(), true)?;
    chart.draw_series(notes.iter().map(|note| {
        let key = f64::from(note.note.0);
        let (from, to) = (note.from as f64 / rate_hz, note.to as f64 / rate_hz);
        Rectangle::new([(from, key - 0.5), (to, key + 0.5)], NOTE.filled())
    }))?;
    let track = pitch_track(samples, rate_hz, 0.005);
    let key = |hz: f64| 69.0 + 12.0 * (hz / a4_hz).log2();
    // A line breaks where there is no pitch, and where it jumps from note to note.
    let mut line: Vec<(f64, f64)> = Vec::new();
    for point in
        track.iter().chain([&chalumeau::analysis::pitch::TrackPoint { t_s: seconds, hz: None, rms: 0.0 }])
    {
        let here = point.hz.filter(|_| point.rms > 1e-4).map(|hz| (point.t_s, key(hz)));
        let joined =
            matches!((here, line.last()), (Some(a), Some(b)) if (a.1 - b.1).abs() < NEAR_CENTS / 100.0);
        if !joined && !line.is_empty() {
            chart.draw_series(LineSeries::new(line.drain(..), PITCH.stroke_width(2)))?;
        }
        line.extend(here);
    }
    Ok(())
}

fn breath(area: &Area<'_>, samples: &[f64], rate_hz: f64, seconds: f64, score: &Score) -> Result<()> {
    let mut chart =
        frame(area, "Breath (blue, of full breath) and level of the sound (grey, of its loudest)")
            .build_cartesian_2d(0.0..seconds, 0.0..1.05)?;
    mesh(&mut chart, "", 5, &|unit: &f64| format!("{unit:.1}"), true)?;
    let level = moving_rms(samples, rate_hz, 0.02);
    let loudest = level.iter().copied().fold(1e-9, f64::max);
    let step = (samples.len() / 3200).max(1);
    let curve = level.iter().step_by(step).enumerate();
    let curve = curve.map(|(index, rms)| ((index * step) as f64 / rate_hz, rms / loudest));
    chart.draw_series(AreaSeries::new(curve, 0.0, RGBColor(215, 217, 222).filled()))?;
    let mut now = 0.0;
    let mut steps = vec![(0.0, 0.0)];
    for event in &score.events {
        if let Event::Breath(unit) = event.event {
            let t = event.at as f64 / rate_hz;
            steps.extend([(t, now), (t, f64::from(unit))]);
            now = f64::from(unit);
        }
    }
    steps.push((seconds, now));
    chart.draw_series(LineSeries::new(steps, BREATH.stroke_width(2)))?;
    Ok(())
}

/// Draws what a hand did on the knob, and what came of it: angle, mouth pressure, torque, sound.
pub fn write_touch(path: &Path, performance: &Performance, rate_hz: f64) -> Result<()> {
    register_font()?;
    let root = BitMapBackend::new(path, (WIDTH, TOUCH_HEIGHT)).into_drawing_area();
    root.fill(&WHITE)?;
    let areas = root.split_evenly((4, 1));
    let seconds = performance.left.len() as f64 / rate_hz;
    let within = |t: f64| (0.0..=seconds).contains(&t);
    // A threshold holds from its note to the next.
    let threshold = |which: usize| {
        let mut line = Vec::new();
        for (index, row) in performance.threshold.iter().enumerate() {
            let until = performance.threshold.get(index + 1).map_or(seconds, |next| next[0]);
            line.extend([(row[0], row[which]), (until, row[which])]);
        }
        line
    };
    let knob = |which: usize| {
        let rows = performance.knob.iter().filter(|row| within(row[0]));
        rows.map(|row| (row[0], row[which])).collect::<Vec<_>>()
    };
    let mut held: Vec<(f64, f64)> = Vec::new();
    for &[t, gamma] in performance.gamma.iter().filter(|row| within(row[0])) {
        let before = held.last().map_or(0.0, |&(_, gamma)| gamma);
        held.extend([(t, before), (t, gamma)]);
    }
    let panels = [
        (
            "Angle of the knob (blue) and threshold of each note (red)",
            "angle, degrees",
            knob(1),
            threshold(1),
        ),
        ("Mouth pressure over closing pressure (blue) and threshold (red)", "gamma", held, threshold(2)),
        ("Torque of the motor, against the hand", "torque, mNm", knob(2), Vec::new()),
    ];
    for (area, (title, y, line, marks)) in areas.iter().zip(panels) {
        let values = || line.iter().chain(&marks).map(|&(_, y)| y);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(1e-3, f64::max));
        let room = 0.06 * (high - low);
        let mut chart = frame(area, title).build_cartesian_2d(0.0..seconds, low - room..high + room)?;
        mesh(
            &mut chart,
            y,
            6,
            &|value: &f64| if y == "gamma" { format!("{value:.1}") } else { format!("{value:.0}") },
            true,
        )?;
        chart.draw_series(LineSeries::new(marks, PITCH.stroke_width(2)))?;
        chart.draw_series(LineSeries::new(line, BREATH.stroke_width(2)))?;
    }
    let samples: Vec<f64> = performance.left.iter().map(|&x| f64::from(x)).collect();
    let mut chart =
        frame(&areas[3], "Sound: peak of each 10 ms").build_cartesian_2d(0.0..seconds, -0.0..1.0)?;
    let chunk = (0.01 * rate_hz) as usize;
    let peaks: Vec<f64> =
        samples.chunks(chunk).map(|chunk| chunk.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()))).collect();
    let loudest = peaks.iter().copied().fold(1e-9, f64::max);
    mesh(&mut chart, "of the loudest", 5, &|unit: &f64| format!("{unit:.1}"), true)?;
    let curve = peaks.iter().enumerate().map(|(index, peak)| (0.01 * index as f64, peak / loudest));
    chart.draw_series(AreaSeries::new(curve, 0.0, RGBColor(150, 155, 165).filled()))?;
    root.present()?;
    Ok(())
}

fn register_font() -> Result<()> {
    plotters::style::register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the embedded font cannot be read"))
}

fn frame<'a, 'b>(area: &'a Area<'b>, title: &str) -> ChartBuilder<'a, 'b, BitMapBackend<'b>> {
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(10)
        .margin_right(30)
        .caption(title, ("sans-serif", 26).into_font().color(&INK))
        .x_label_area_size(56)
        .y_label_area_size(80);
    builder
}

type Chart<'a, 'b> = ChartContext<
    'a,
    BitMapBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn mesh(
    chart: &mut Chart<'_, '_>,
    y: &str,
    labels: usize,
    text: &dyn Fn(&f64) -> String,
    lines: bool,
) -> Result<()> {
    let style = ("sans-serif", 20).into_font().color(&INK);
    let mut mesh = chart.configure_mesh();
    mesh.x_desc("time, s")
        .y_desc(y)
        .axis_desc_style(style.clone())
        .label_style(style)
        .x_labels(15)
        .y_labels(labels)
        .x_label_formatter(&|t| format!("{t:.0}"))
        .y_label_formatter(text)
        .axis_style(INK)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(225, 227, 230));
    if !lines {
        mesh.disable_mesh();
    }
    mesh.draw()?;
    Ok(())
}

/// White over orange and red to black: quiet is paper, loud is ink. `unit` 0..=1.
fn heat(unit: f64) -> RGBColor {
    const STOPS: [(f64, [f64; 3]); 6] = [
        (0.0, [255.0, 255.0, 255.0]),
        (0.25, [254.0, 224.0, 170.0]),
        (0.5, [245.0, 140.0, 70.0]),
        (0.7, [190.0, 50.0, 70.0]),
        (0.88, [90.0, 20.0, 90.0]),
        (1.0, [15.0, 5.0, 35.0]),
    ];
    let unit = unit.clamp(0.0, 1.0);
    let upper = STOPS.iter().position(|(at, _)| unit <= *at).unwrap_or(STOPS.len() - 1).max(1);
    let ((from, a), (to, b)) = (STOPS[upper - 1], STOPS[upper]);
    let part = (unit - from) / (to - from);
    let [r, g, b] = [0, 1, 2].map(|c| (a[c] + part * (b[c] - a[c])).round() as u8);
    RGBColor(r, g, b)
}
