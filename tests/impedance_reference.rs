//! The frequency-domain model against openwind 0.12.4, and the instrument file against broken text.
//!
//! `tests/reference/README.md` says where the reference comes from. Figures are printed (`--nocapture`) to be quoted.

#[path = "support/reference.rs"]
mod reference;

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::bore::transfer_matrix::threshold_gamma;
use chalumeau_core::units::Air;
use chalumeau_core::units::WrittenNote;
use chalumeau_core::units::cents;
use num_complex::Complex64;
use reference::{RANGE, Spread, midi, number, rows};

/// The holes that the reference opens: those of the maker's chart.
fn open(file: &InstrumentFile, midi: u8) -> &[bool] {
    file.fingering(WrittenNote(midi)).unwrap().of_maker()
}

fn clarinet() -> (InstrumentFile, TransferMatrix) {
    let file = InstrumentFile::built_in();
    let model = TransferMatrix::new(&file, Air::default());
    (file, model)
}

fn decibels(ratio: f64) -> f64 {
    20.0 * ratio.log10()
}

/// Q as the reference measures it: slope of a line through the phase at the five whole Hz about the peak.
fn q_on_whole_hertz(z: impl Fn(f64) -> Complex64, f_hz: f64) -> f64 {
    let middle = f_hz.round();
    let about = z(middle);
    let slope: f64 = (-2..=2).map(f64::from).map(|h| h * (z(middle + h) / about).arg()).sum::<f64>() / 10.0;
    -0.5 * f_hz * slope
}

#[test]
fn peaks_are_those_of_openwind() {
    let (file, model) = clarinet();
    let (mut pitch, mut height, mut q, mut q_local) =
        (Spread::default(), Spread::default(), Spread::default(), Spread::default());
    for midi_note in RANGE {
        let open = open(&file, midi_note);
        let peaks = model.peaks(open, 0.0, 3);
        for row in rows("resonances_tuned.csv")
            .iter()
            .filter(|row| midi(row) == midi_note && row["variant"] == "no_reed")
        {
            let n: usize = row["n"].parse().unwrap();
            if n > 3 {
                continue;
            }
            let peak = peaks[n - 1];
            let label = format!("{} peak {n} at {:.1} Hz", row["written_note"], peak.f_hz);
            pitch.add(cents(peak.f_hz, number(row, "f_hz")), label.clone());
            height.add(decibels(peak.mag_over_zc / number(row, "mag_over_Zc")), label.clone());
            let as_reference = q_on_whole_hertz(|f_hz| model.impedance(f_hz, open, 0.0), peak.f_hz);
            q.add(100.0 * (as_reference / number(row, "Q") - 1.0), label.clone());
            q_local.add(100.0 * (peak.q / number(row, "Q") - 1.0), label);
        }
    }
    pitch.print("peak frequency, cents");
    height.print("peak height, dB");
    q.print("Q measured as the reference does, %");
    q_local.print("Q by the local slope, % (the reference's five points flatten narrow peaks)");
    assert_eq!(pitch.count, 99);
    assert!(pitch.mean() <= 0.38 && pitch.max <= 1.55);
    assert!(height.max <= 0.23);
    assert!(q.max <= 2.5);
}

#[test]
fn impedance_curves_are_those_of_openwind() {
    let (file, model) = clarinet();
    for midi_note in [52, 65, 71, 84] {
        let (mut squares, mut count, mut max) = (0.0, 0, 0.0f64);
        for row in rows(&format!("Z_tuned_written{midi_note}.csv")) {
            let f_hz = number(&row, "f_hz");
            if f_hz > 4_000.0 {
                break;
            }
            let reference = Complex64::new(number(&row, "re_Z_over_Zc"), number(&row, "im_Z_over_Zc"));
            let error = decibels((model.impedance(f_hz, open(&file, midi_note), 0.0) / reference).norm());
            (squares, count, max) = (squares + error * error, count + 1, max.max(error.abs()));
        }
        let rms = (squares / f64::from(count)).sqrt();
        println!("|Z| of {}, 20 Hz to 4 kHz: rms {rms:.4} dB, max {max:.3} dB", WrittenNote(midi_note));
        assert!(rms <= 0.135 && count > 2_900);
    }
}

#[test]
fn playing_frequencies_and_thresholds_are_those_of_openwind() {
    let (file, model) = clarinet();
    let (mut pitch, mut threshold) = (Spread::default(), Spread::default());
    for (note, row) in rows("notes_tuned.csv").iter().zip(rows("thresholds_tuned.csv")) {
        assert_eq!(midi(note), midi(&row));
        let (near_hz, midi) = (number(note, "f_et440_hz"), midi(note));
        let found = model.playing_frequency(open(&file, midi), file.reed_volume_m3, near_hz);
        let (f_hz, z) = found.unwrap_or_else(|| panic!("{} does not play", note["written_note"]));
        pitch.add(cents(f_hz, number(note, "f_play_hz")), note["written_note"].clone());
        for zeta in ["0.2", "0.3", "0.4"] {
            let reference = number(&row, &format!("gamma_th_zeta{zeta}"));
            let error = 100.0 * (threshold_gamma(z, zeta.parse().unwrap()) / reference - 1.0);
            threshold.add(error, format!("{} at zeta {zeta}", row["written_note"]));
        }
    }
    pitch.print("playing frequency, cents");
    threshold.print("oscillation threshold, %");
    assert_eq!(threshold.count, 3 * 46);
    assert!(pitch.max <= 0.8);
    assert!(threshold.max <= 0.5);
}

/// The reflectance falls to one half at the same frequency as in the reference's own model, on the reference's grid of
/// 10 Hz: a finer one would find C#5 touching 0.498 for 5 Hz about 1276 Hz, long before it falls for good at 2 kHz.
#[test]
fn lattice_cutoff_is_that_of_the_reference() {
    let (file, model) = clarinet();
    let mut cutoff = Spread::default();
    for row in rows("notes_tuned.csv").iter().filter(|row| (55..=84).contains(&midi(row))) {
        if row["cutoff_reflectance_hz"].is_empty() {
            continue;
        }
        let open = open(&file, midi(row));
        let first = (0..open.len()).find(|&hole| open[hole] && !file.holes[hole].register).unwrap();
        let transmits = |f_hz: &f64| model.reflectance_below(*f_hz, open, first).norm_sqr() < 0.5;
        let f_hz = (300..4_000).step_by(10).map(f64::from).find(transmits).unwrap();
        cutoff.add(100.0 * (f_hz / number(row, "cutoff_reflectance_hz") - 1.0), row["written_note"].clone());
    }
    cutoff.print("lattice cut-off, %");
    assert!(cutoff.count >= 28 && cutoff.max < 0.01);
}

/// The file is the table it was made from, and mode numbers are the peaks that sound.
#[test]
fn built_in_file_holds_the_reference_geometry() {
    let file = InstrumentFile::built_in();
    for (segment, row) in file.bore.iter().zip(rows("bore_tuned.csv")) {
        let given = [segment.x_start_m, segment.x_end_m, segment.r_start_m, segment.r_end_m];
        for (given, column) in given.into_iter().zip(["x_start_m", "x_end_m", "r_start_m", "r_end_m"]) {
            assert!((given - number(&row, column)).abs() < 1e-12, "{row:?}");
        }
    }
    let holes = rows("holes_tuned.csv");
    for (hole, row) in file.holes.iter().zip(&holes) {
        assert_eq!(hole.name, row["hole"]);
        let given = [hole.x_m, hole.radius_m, hole.chimney_m];
        for (given, column) in given.into_iter().zip(["x_m", "hole_radius_m", "chimney_height_m"]) {
            assert!((given - number(row, column)).abs() < 1e-12, "{row:?}");
        }
        assert!((file.radius_at(hole.x_m) - number(row, "bore_radius_m")).abs() < 1e-7, "{row:?}");
    }
    let notes = rows("notes_tuned.csv");
    for ((fingering, row), note) in file.fingerings.iter().zip(rows("fingering_chart.csv")).zip(&notes) {
        assert_eq!((fingering.written.0, &fingering.register), (midi(&row), &row["register"]));
        // The reference is the maker's chart.
        if fingering.maker_open.is_none() {
            assert_eq!(
                (&fingering.fingers, &fingering.mode.to_string()),
                (&row["fingers"], &note["peak_index"])
            );
        }
        for (&open, hole) in fingering.of_maker().iter().zip(&holes) {
            assert_eq!(
                if open { "1" } else { "0" },
                row[&hole["hole"]],
                "{} {}",
                row["written_note"],
                hole["hole"]
            );
        }
    }
    let others = file.fingerings.iter().filter(|fingering| fingering.maker_open.is_some());
    assert_eq!(
        others.map(|fingering| fingering.written.to_string()).collect::<Vec<_>>(),
        ["A6", "A#6", "B6"]
    );
    assert_eq!((file.bore.len(), holes.len(), notes.len()), (63, 24, 46));
}

/// Two thousand files damaged in a few places each: bytes changed, cut, doubled, and numbers swapped for extreme ones.
/// Reading any of them ends in an instrument the model can use or in an error, never in a panic.
#[test]
fn damaged_files_are_read_or_refused() {
    const WORDS: [&str; 16] = [
        "nan",
        "-inf",
        "1e308",
        "-1",
        "0",
        "0.0001",
        "1e-320",
        "\"\"",
        "[",
        "]]",
        "{",
        "\n",
        "=",
        "E_PAD",
        "é",
        "99999999999999999999",
    ];
    let text = InstrumentFile::built_in_text();
    // xorshift64: the same damage every time.
    let mut seed = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = |below: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed % below.max(1) as u64) as usize
    };
    let numbers: Vec<(usize, usize)> = text
        .match_indices("= ")
        .map(|(at, _)| (at + 2, at + 2 + text[at + 2..].find([',', '\n', ' ']).unwrap_or(0)))
        .filter(|&(from, to)| text[from..to].parse::<f64>().is_ok())
        .collect();
    let (mut read, mut refused) = (0, 0);
    for round in 0..2_000 {
        let mut damaged = text.to_owned();
        if round % 2 == 0 {
            let (from, to) = numbers[random(numbers.len())];
            if random(2) == 0 {
                damaged.replace_range(from..to, WORDS[random(WORDS.len())]);
            } else {
                let value: f64 = text[from..to].parse().unwrap();
                damaged.replace_range(from..to, &format!("{}", value * (0.5 + random(1000) as f64 / 1000.0)));
            }
        } else {
            for _ in 0..=random(3) {
                let mut bytes = damaged.into_bytes();
                let (from, length) = (random(bytes.len()), random(12));
                let to = (from + length).min(bytes.len());
                match random(4) {
                    0 => bytes[from] = (random(128)) as u8,
                    1 => drop(bytes.drain(from..to)),
                    2 => bytes.extend_from_within(from..to),
                    _ => drop(bytes.splice(from..from, WORDS[random(WORDS.len())].bytes())),
                }
                damaged = String::from_utf8_lossy(&bytes).into_owned();
            }
        }
        match InstrumentFile::parse(&damaged) {
            Ok(file) => {
                read += 1;
                let model = TransferMatrix::new(&file, Air::default());
                assert!(model.impedance(440.0, &file.fingerings[0].open, file.reed_volume_m3).is_finite());
            }
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().is_empty());
            }
        }
    }
    println!("damaged files: {read} still instruments, {refused} refused");
    assert!(read > 0 && refused > 0);
}

/// All fingerings on 6,000 frequencies: the losses of a frequency are worked out once.
#[test]
fn whole_chart_takes_seconds() {
    let (file, model) = clarinet();
    let start = std::time::Instant::now();
    let mut sum = Complex64::ZERO;
    for fingering in &file.fingerings {
        for k in 0..6_000 {
            sum += model.impedance(20.0 + f64::from(k), &fingering.open, file.reed_volume_m3);
        }
    }
    let grid = start.elapsed();
    let peaks: usize =
        file.fingerings.iter().map(|fingering| model.peaks(&fingering.open, 0.0, 8).len()).sum();
    println!("46 x 6000 impedances: {grid:.2?}; {peaks} peaks: {:.2?}", start.elapsed() - grid);
    assert!(sum.is_finite() && peaks == 8 * 46);
}
