//! Instruments from tables, made cylinders, and what the readers do with thousands of broken files.

#[path = "../crates/core/tests/support/some.rs"]
#[expect(dead_code, reason = "cases are counted here")]
mod some;

use std::fs;
use std::panic;
use std::path::Path;
use std::thread;

use chalumeau_core::bore::cells::Cells;
use chalumeau_core::bore::check::Check;
use chalumeau_core::bore::cylinder::Cylinder;
use chalumeau_core::bore::instrument_file::ImportDetails;
use chalumeau_core::bore::instrument_file::ImportError;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::instrument_file::Sheet;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::units::Air;
use chalumeau_core::units::WrittenNote;

fn text(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

fn details(name: &str) -> ImportDetails {
    ImportDetails {
        name: name.to_owned(),
        source: String::new(),
        transposition: None,
        reed_volume_mm3: 1200.0,
        nominal_diameter_mm: None,
    }
}

#[test]
fn the_example_of_the_manual_is_an_instrument() {
    let manual = text("docs/instrument-file.md");
    let example = manual.split("```toml").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert_eq!(InstrumentFile::parse(example).unwrap().lowest().to_string(), "G3");
}

/// The tables the built-in clarinet was made from.
struct Tables {
    bore: String,
    holes: String,
    chart: String,
}

impl Tables {
    fn reference() -> Self {
        Self {
            bore: text("tests/reference/bore_tuned.csv"),
            holes: text("tests/reference/holes_tuned.csv"),
            chart: text("tests/reference/fingering_chart.csv"),
        }
    }

    fn read(&self, details: &ImportDetails) -> Result<InstrumentFile, ImportError> {
        InstrumentFile::from_csv(
            Sheet { name: "bore.csv", text: &self.bore },
            Sheet { name: "holes.csv", text: &self.holes },
            Sheet { name: "chart.csv", text: &self.chart },
            details,
        )
    }
}

#[test]
fn the_reference_tables_are_the_built_in_clarinet_bit_by_bit() {
    let built_in = InstrumentFile::built_in();
    let details = ImportDetails { source: built_in.source.clone(), ..details(&built_in.name) };
    let mut file = Tables::reference().read(&details).unwrap();
    for (hole, known) in file.holes.iter_mut().zip(&built_in.holes) {
        assert!(hole.description.starts_with(&known.description[..3]), "{hole:?}");
        hole.description.clone_from(&known.description);
    }
    // The tables are the maker's chart: three notes are played with other fingerings.
    for (fingering, known) in file.fingerings.iter_mut().zip(&built_in.fingerings) {
        if known.maker_open.as_ref() == Some(&fingering.open) {
            fingering.clone_from(known);
        }
    }
    assert_eq!(file, built_in);
}

#[test]
fn the_imported_example_is_what_the_command_makes() {
    let folder = "examples/instruments/alto-chalumeau";
    let tables = Tables {
        bore: text(&format!("{folder}/bore.csv")),
        holes: text(&format!("{folder}/holes.csv")),
        chart: text(&format!("{folder}/fingerings.csv")),
    };
    let kept = InstrumentFile::parse(&text("examples/instruments/alto-chalumeau.toml")).unwrap();
    let details = ImportDetails {
        source: kept.source.clone(),
        nominal_diameter_mm: Some(15.0),
        ..details("Alto chalumeau")
    };
    assert_eq!(tables.read(&details).unwrap(), kept);
    assert_eq!((kept.holes.len(), kept.fingerings.len(), kept.transposition), (10, 15, 1));
    // WIDesigner's frequencies for these fingerings, from the same file as the geometry: another program, another model.
    let widesigner = [
        246.76, 277.61, 308.45, 329.01, 352.51, 370.14, 394.82, 411.27, 438.68, 462.67, 493.52, 526.42,
        555.21, 616.90, 658.03,
    ];
    let check = Check::new(&kept, Air::default(), 440.0);
    assert!(check.is_usable());
    for (note, theirs) in check.notes.iter().zip(widesigner) {
        let off = chalumeau_core::units::cents(note.peak.unwrap().f_hz, theirs);
        println!("{}: {off:+.1} cents from WIDesigner", note.written);
        assert!(off.abs() < 12.0, "{}: {off}", note.written);
    }
}

#[test]
fn the_cylinder_example_is_what_the_command_makes_and_in_tune() {
    let kept = InstrumentFile::parse(&text("examples/instruments/cylinder.toml")).unwrap();
    let made = Cylinder {
        name: kept.name.clone(),
        notes: [50, 52, 53].map(WrittenNote).to_vec(),
        transposition: 0,
        a4_hz: 440.0,
        radius_m: 7.45e-3,
        hole_radius_m: 4e-3,
        chimney_m: 8e-3,
        vent_radius_m: None,
        reed_volume_m3: 1.2e-6,
    };
    assert_eq!(made.build(Air::default()).unwrap(), kept);
    for note in Check::new(&kept, Air::default(), 440.0).notes {
        assert!(note.cents.unwrap().abs() < 1.0, "{note:?}");
    }
}

/// Each fault, planted in the reference tables, is refused with file, line, column, value and remedy.
#[test]
fn messages_say_which_line_of_which_table() {
    type Pick = fn(&mut Tables) -> &mut String;
    const BORE: Pick = |tables| &mut tables.bore;
    const HOLES: Pick = |tables| &mut tables.holes;
    const CHART: Pick = |tables| &mut tables.chart;
    let cases: &[(Pick, &str, &str, &str)] = &[
        (
            BORE,
            "1,mouthpiece,0.039787",
            "1,mouthpiece,0.039",
            "bore.csv, line 5: bore segment 2 (mouthpiece): x_start_m is 0.039, overlapping the cone before it; it must be 0.039787",
        ),
        (BORE, "1,mouthpiece,0.039787", "1,mouthpiece,0.04", "leaving a gap after"),
        (
            BORE,
            "0.044787,0.0069000",
            "0.044787,6.9",
            "bore.csv, line 5: bore segment 2 (mouthpiece): r_start_m is 6.9; it must be 0.0005 to 0.1 m; this looks like millimetres: 6.9 mm = 0.0069 m",
        ),
        (BORE, "0.044787,0.0069000", "0.044787,0", "r_start_m is 0; it must be 0.0005 to 0.1 m"),
        (BORE, "0.044787,0.0069000", "0.044787,-0.007", "r_start_m is -0.007"),
        (BORE, "0.044787,0.0069000", "0.044787,nan", "line 5: r_start_m is \"nan\"; it must be a number"),
        (BORE, "0.044787,0.0069000", "0.044787,", "line 5: r_start_m is \"\"; it must be a number"),
        (
            BORE,
            "0.044787,0.0069000",
            "0.044787,\"0,0069\"",
            "line 5: r_start_m is \"0,0069\"; it must be a number; write it with a point for decimals",
        ),
        (BORE, "0.044787,0.0069000", "0.044787", "bore.csv, line 5: 5 fields; there must be 6"),
        (
            BORE,
            "0.039787,0.044787",
            "0.039787,0.039787",
            "x_end_m is 0.039787; it must be at least 0.00001 m beyond x_start_m",
        ),
        (
            BORE,
            "x_start_m,x_end_m",
            "x_start_m,x_stop_m",
            "bore.csv has no column x_end_m or x_end_mm; it has segment, part, x_start_m, x_stop_m",
        ),
        (
            BORE,
            "segment,part",
            "segment,colour",
            "bore.csv: column colour is unknown; columns may be segment, part",
        ),
        (
            BORE,
            "segment,part,x_start_m",
            "x_start_mm,part,x_start_m",
            "bore.csv has both x_start_m and x_start_mm",
        ),
        (
            HOLES,
            "0.155787",
            "0.855787",
            "holes.csv, line 4: hole 1 (REG): x_m is 0.855787; it must be inside the bore, which runs from 0 to 0.667587 m",
        ),
        (HOLES, "0.155787", "155.787", "this looks like millimetres: 155.787 mm = 0.155787 m"),
        (
            HOLES,
            "0.0015835",
            "0.015835",
            "hole_radius_m is 0.015835; it must be at most 0.0074683 m, the radius of the bore there",
        ),
        (
            HOLES,
            "0.0015835",
            "1.5835",
            "holes.csv, line 4: hole 1 (REG): hole_radius_m is 1.5835; it must be 0.0001 to 0.03 m; this looks like millimetres: 1.5835 mm = 0.0015835 m",
        ),
        (
            HOLES,
            "0.01260",
            "12.6",
            "chimney_height_m is 12.6; it must be 0.0002 to 0.1 m; this looks like millimetres",
        ),
        (HOLES, "0.0015835", "-1", "hole_radius_m is -1"),
        (HOLES, "key_nc", "lid", "holes.csv, line 4: kind is \"lid\"; it must be finger, key-closed"),
        (HOLES, "TRILL4_B,", "REG,", "holes.csv, line 5: hole 2 (REG): hole REG appears twice"),
        (
            HOLES,
            "TRILL4_B,",
            "TRILL 4,",
            "chart.csv: column TRILL4_B is unknown; columns may be written_note",
        ),
        (HOLES, "E_PAD,24", "LOW_E,24", "chart.csv: column E_PAD is unknown"),
        (CHART, ",E_PAD,fingers", ",_E_PAD,fingers", "chart.csv has no column E_PAD; it has written_note"),
        (
            CHART,
            "F3,53,D#3,51",
            "E3,52,D3,50",
            "chart.csv, line 5: fingering 2 (E3): written_note E3 appears twice",
        ),
        (
            CHART,
            "F3,53",
            "F3,54",
            "chart.csv, line 5: written_midi is \"54\"; it must be 53, the number of F3",
        ),
        (
            CHART,
            "F3,53,D#3,51",
            "F3,53,D3,50",
            "chart.csv, line 5: sounding_midi is \"50\"; it must be D#3 (51), 2 semitones below",
        ),
        (CHART, "F3,53", "H3,53", "chart.csv, line 5: written_note is \"H3\"; it must be a note like E3"),
        (
            CHART,
            "155.563,chalumeau",
            "155.563,low",
            "chart.csv, line 5: fingering 2 (F3): register is \"low\"; it must be one of chalumeau, throat",
        ),
        (
            CHART,
            "chalumeau,0,",
            "chalumeau,2,",
            "chart.csv, line 4: REG is \"2\"; it must be 1 for an open hole, 0",
        ),
    ];
    let mut missed = Vec::new();
    for (table, from, to, expected) in cases {
        let mut tables = Tables::reference();
        let picked = table(&mut tables);
        let changed = picked.replacen(from, to, 1);
        assert_ne!(&changed, picked, "{from} is not in the table");
        *picked = changed;
        match tables.read(&details("x")) {
            Ok(_) => missed.push(format!("{from} -> {to}: accepted")),
            Err(error) if error.to_string().contains(expected) => {}
            Err(error) => missed.push(format!("{from} -> {to}: {error}")),
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
    let mut tables = Tables::reference();
    let wrong = ImportDetails { transposition: Some(3), ..details("x") };
    assert!(
        tables
            .read(&wrong)
            .unwrap_err()
            .to_string()
            .contains("3 semitones below the written note as asked for")
    );
    tables.bore = "# nothing\n".to_owned();
    let message = tables.read(&details("x")).unwrap_err().to_string();
    assert!(message.contains("bore.csv has no line of data"), "{message}");
}

/// Tables in millimetres and diameters, in another order of columns and lines, are the same instrument.
#[test]
fn units_and_order_do_not_matter() {
    let tables = Tables {
        bore: "diameter_end_mm,diameter_start_mm,x_start_mm,x_end_mm,_note\n15,14.9,0,500,any\n".to_owned(),
        holes: "\u{feff}name,chimney_mm,x_m,diameter_mm\nb,8,0.4,7\na,8,0.3,7\n".to_owned(),
        chart: "written_midi,register,b,a,mode\n60,chalumeau,1,1,1\n55,chalumeau,0,0,1\n58,chalumeau,1,0,1\n"
            .to_owned(),
    };
    let file = tables.read(&ImportDetails { transposition: Some(2), ..details("tube") }).unwrap();
    assert_eq!((file.hole("a"), file.hole("b"), file.transposition), (Some(0), Some(1), 2));
    assert_eq!(file.fingering(WrittenNote(58)).unwrap().open, [false, true]);
    assert_eq!((file.bore[0].r_start_m, file.bore[0].r_end_m), (0.00745, 0.0075));
    assert_eq!(InstrumentFile::parse(&file.to_toml()).unwrap(), file);
}

/// A generator for the broken files: Knuth's MMIX, upper bits. Runs repeat.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// What a slip of the hand, a bad disk or an eager script makes of a file.
fn broken(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(3) {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        let numbers: Vec<(usize, usize)> = spans(&text, |c| c.is_ascii_digit() || c == '.' || c == '-');
        let tokens: Vec<(usize, usize)> = spans(&text, |c| c.is_alphanumeric() || "_.#-".contains(c));
        let mut next = text.clone();
        match random.below(12) {
            0 if !bytes.is_empty() => {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
                continue;
            }
            1 if !bytes.is_empty() => {
                let at = random.below(bytes.len());
                bytes[at] = random.pick(b"0123456789.-+eE,;#\"'[]{}= \n\r\t\0x_");
                continue;
            }
            2 | 3 if !numbers.is_empty() => {
                let (from, to) = random.pick(&numbers);
                let factor = random.pick(&[1e3, 1e-3, 10.0, 0.1, -1.0, 1e300, 0.0, 1.001, 0.999, 2.0, 0.5]);
                let number =
                    text[from..to].parse::<f64>().map_or("?".to_owned(), |x| format!("{:?}", x * factor));
                next.replace_range(from..to, &number);
            }
            4 if !numbers.is_empty() => {
                let (from, to) = random.pick(&numbers);
                let odd = [
                    "nan",
                    "inf",
                    "-inf",
                    "1e999",
                    "1e-999",
                    "0x1F",
                    "1_000",
                    "1,5",
                    "",
                    "-0.0",
                    "true",
                    "9223372036854775808",
                ];
                next.replace_range(from..to, random.pick(&odd));
            }
            5 if tokens.len() > 1 => {
                let (first, second) = (random.pick(&tokens), random.pick(&tokens));
                let (first, second) = (first.min(second), first.max(second));
                if first.1 <= second.0 {
                    let (one, other) =
                        (text[first.0..first.1].to_owned(), text[second.0..second.1].to_owned());
                    next.replace_range(second.0..second.1, &one);
                    next.replace_range(first.0..first.1, &other);
                }
            }
            6 if lines.len() > 1 => {
                let gone = random.below(lines.len());
                next = lines.iter().enumerate().filter(|(n, _)| *n != gone).map(|(_, line)| *line).collect();
            }
            7 if !lines.is_empty() => {
                let (line, at) = (random.pick(&lines), random.below(lines.len()));
                next = lines[..at].iter().chain(&[line]).chain(&lines[at..]).copied().collect();
            }
            8 if lines.len() > 1 => {
                let (a, b) = (random.below(lines.len()), random.below(lines.len()));
                let mut swapped = lines.clone();
                swapped.swap(a, b);
                next = swapped.concat();
            }
            9 => {
                let at = boundary(&text, random.below(text.len() + 1));
                let odd = [
                    "é",
                    "\u{1f3b7}",
                    "\u{feff}",
                    "\u{0}",
                    "\u{202e}",
                    "ﬀ",
                    "½",
                    "−",
                    "\u{a0}",
                    "'''",
                    "\"\"\"",
                ];
                next.insert_str(at, random.pick(&odd));
            }
            10 => {
                let (a, b) = (random.below(text.len() + 1), random.below(text.len() + 1));
                let near = (a.min(b) + 40).min(a.max(b));
                next.replace_range(boundary(&text, a.min(b))..boundary(&text, near), "");
            }
            11 if random.below(4) == 0 => next.truncate(boundary(&text, random.below(text.len() + 1))),
            _ => {}
        }
        bytes = next.into_bytes();
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn boundary(text: &str, mut at: usize) -> usize {
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// Longest pieces of such characters.
fn spans(text: &str, is_in: impl Fn(char) -> bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices().chain([(text.len(), '\n')]) {
        match (start, is_in(c)) {
            (None, true) => start = Some(at),
            (Some(from), false) => {
                found.push((from, at));
                start = None;
            }
            _ => {}
        }
    }
    found
}

/// All that must be true of an instrument, said once more and without the reader's help.
fn is_an_instrument(file: &InstrumentFile) -> Result<(), String> {
    let fail = |what: String| -> Result<(), String> { Err(what) };
    let mut end = 0.0;
    let mut radius_at: Vec<(f64, f64, f64, f64)> = Vec::new();
    for cone in &file.bore {
        let (from, to, r0, r1) = (cone.x_start_m, cone.x_end_m, cone.r_start_m, cone.r_end_m);
        if from != end || !(to > from && to <= 3.0) {
            return fail(format!("cones are not contiguous: {cone:?} after {end}"));
        }
        if ![r0, r1].iter().all(|r| (0.0005..=0.1).contains(r)) {
            return fail(format!("radius: {cone:?}"));
        }
        end = to;
        radius_at.push((from, to, r0, r1));
    }
    if file.bore.is_empty() || file.bore.len() > 256 || !(0.02..=3.0).contains(&end) {
        return fail(format!("bore of {end} m"));
    }
    if file.holes.len() > 40 || file.fingerings.is_empty() || file.fingerings.len() > 128 {
        return fail("counts".to_owned());
    }
    for (index, hole) in file.holes.iter().enumerate() {
        let Some(&(from, to, r0, r1)) = radius_at.iter().find(|cone| hole.x_m <= cone.1) else {
            return fail(format!("off the bore: {hole:?}"));
        };
        let bore = r0 + (r1 - r0) * (hole.x_m - from) / (to - from);
        let fits = hole.radius_m > 0.0 && hole.radius_m <= bore + 3e-9;
        if !(hole.x_m > 0.0 && hole.x_m < end && fits) {
            return fail(format!("{hole:?} on a bore of {bore}"));
        }
        if !(0.0002..=0.1).contains(&hole.chimney_m) {
            return fail(format!("chimney: {hole:?}"));
        }
        if hole.name.is_empty() || hole.name.chars().any(char::is_whitespace) {
            return fail(format!("name: {hole:?}"));
        }
        if file.holes[..index].iter().any(|other| other.name == hole.name || other.x_m > hole.x_m) {
            return fail(format!("twice or out of order: {hole:?}"));
        }
    }
    if file.name.trim().is_empty() || !(-12..=36).contains(&file.transposition) {
        return fail(format!("{:?} {}", file.name, file.transposition));
    }
    let volume = file.reed_volume_m3;
    if volume != 0.0 && !(2e-8..=2.0001e-5).contains(&volume)
        || !(0.0005..=0.1).contains(&file.nominal_radius_m)
    {
        return fail(format!("reed {volume} {}", file.nominal_radius_m));
    }
    for pair in file.fingerings.windows(2) {
        if pair[0].written >= pair[1].written {
            return fail(format!("{} twice", pair[1].written));
        }
    }
    for fingering in &file.fingerings {
        let known = ["chalumeau", "throat", "clarion", "altissimo"].contains(&fingering.register.as_str());
        let sounds = i16::from(fingering.written.0) - i16::from(file.transposition);
        if !known || !(1..=12).contains(&fingering.mode) || !(0..128).contains(&sounds) {
            return fail(format!("{fingering:?}"));
        }
        if fingering.open.len() != file.holes.len() {
            return fail(format!("{fingering:?}"));
        }
    }
    Ok(())
}

/// What was accepted is what stands in the text, key by key, read by nothing but the TOML crate.
fn says_what_was_read(text: &str, file: &InstrumentFile) -> Result<(), String> {
    let table: toml::Table = text.parse().map_err(|error| format!("accepted what is no TOML: {error}"))?;
    let list = |key: &str| table.get(key).and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let number = |entry: &toml::Value, key: &str| {
        let value = entry.get(key);
        value.and_then(|v| v.as_float().or(v.as_integer().map(|n| n as f64))).unwrap_or(f64::NAN)
    };
    let known = [
        "name",
        "source",
        "transposition_semitones",
        "reed_volume_mm3",
        "nominal_diameter_mm",
        "bore",
        "hole",
        "fingering",
    ];
    if let Some(key) = table.keys().find(|key| !known.contains(&key.as_str())) {
        return Err(format!("unknown key {key}"));
    }
    let (bore, holes, chart) = (list("bore"), list("hole"), list("fingering"));
    if (bore.len(), holes.len(), chart.len()) != (file.bore.len(), file.holes.len(), file.fingerings.len()) {
        return Err("entries were lost".to_owned());
    }
    for (entry, cone) in bore.iter().zip(&file.bore) {
        for (key, is, per) in [
            ("x_start_mm", cone.x_start_m, 1e3),
            ("x_end_mm", cone.x_end_m, 1e3),
            ("diameter_start_mm", cone.r_start_m, 2e3),
            ("diameter_end_mm", cone.r_end_m, 2e3),
        ] {
            // Cones within a micrometre are taken as touching.
            let off = (number(entry, key) / per - is).abs();
            if off.is_nan() || off > 1.1e-6 {
                return Err(format!("{key} of {entry} became {is}"));
            }
        }
    }
    for entry in &holes {
        let name = entry.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        let Some(hole) = file.holes.iter().find(|hole| hole.name == name) else {
            return Err(format!("lost {name}"));
        };
        for (key, is, per) in [
            ("x_mm", hole.x_m, 1e3),
            ("diameter_mm", hole.radius_m, 2e3),
            ("chimney_mm", hole.chimney_m, 1e3),
        ] {
            if number(entry, key) / per != is {
                return Err(format!("{key} of {name} became {is}"));
            }
        }
    }
    for entry in &chart {
        let open = entry.get("open").and_then(toml::Value::as_str).unwrap_or("?");
        let mut named: Vec<&str> = open.split_whitespace().collect();
        named.sort_unstable();
        let found = file.fingerings.iter().any(|fingering| {
            let mut names: Vec<&str> = (file.holes.iter().zip(&fingering.open))
                .filter_map(|(hole, open)| open.then_some(hole.name.as_str()))
                .collect();
            names.sort_unstable();
            names == named && fingering.mode as f64 == number(entry, "mode")
        });
        if !found {
            return Err(format!("no fingering opens {open:?}"));
        }
    }
    Ok(())
}

/// Cut for the lattice and answered in the frequency domain without panic or infinity.
fn can_be_worked_with(file: &InstrumentFile, rate_hz: f64) -> Result<(), String> {
    let air = Air::default();
    if let Ok(cells) = Cells::cut(file, &air, rate_hz)
        && !cells.cells.iter().all(|cell| cell.ticks > 0 && cell.radius_m.is_finite() && cell.radius_m > 0.0)
    {
        return Err(format!("{cells:?}"));
    }
    let matrix = TransferMatrix::new(file, air);
    for fingering in [&file.fingerings[0], &file.fingerings[file.fingerings.len() - 1]] {
        for f_hz in [50.0, 441.0, 3_000.0] {
            let z = matrix.impedance(f_hz, &fingering.open, file.reed_volume_m3);
            if !(z.re.is_finite() && z.im.is_finite() && z.re > 0.0) {
                return Err(format!("impedance {z} at {f_hz} Hz of {}", fingering.written));
            }
        }
    }
    Ok(())
}

/// The chart with a column of modes, which are otherwise looked up in the impedance: half a second a file.
fn with_modes(chart: &str) -> String {
    let file = InstrumentFile::built_in();
    let line = |line: &str| {
        let mode = match line.split(',').nth(1).and_then(|midi| midi.parse().ok()).map(WrittenNote) {
            _ if line.starts_with('#') => return line.to_owned(),
            Some(note) => file.fingering(note).unwrap().mode.to_string(),
            None => "mode".to_owned(),
        };
        format!("{mode},{line}")
    };
    chart.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Thousands of broken files: every one is refused with a message or is an instrument.
#[test]
fn broken_files_are_refused_or_are_instruments() {
    let files = if some::all_cases() { 10_000 } else { 5_000 };
    let tomls = [
        InstrumentFile::built_in_text().to_owned(),
        text("examples/instruments/cylinder.toml"),
        text("examples/instruments/alto-chalumeau.toml"),
        InstrumentFile::built_in().scaled(1.5).to_toml(),
    ];
    let folder = "examples/instruments/alto-chalumeau";
    let tables = [
        [
            text("tests/reference/bore_tuned.csv"),
            text("tests/reference/holes_tuned.csv"),
            with_modes(&text("tests/reference/fingering_chart.csv")),
        ],
        ["bore", "holes", "fingerings"].map(|name| text(&format!("{folder}/{name}.csv"))),
    ];
    let work = |part: usize| {
        let (mut accepted, mut refused, mut wrong) = ([0, 0], [0, 0], Vec::new());
        for case in (part..files).step_by(2) {
            let mut random = Random(case as u64 + 1);
            random.below(1);
            let is_toml = case % 5 < 3;
            let (source, read) = if is_toml {
                let source = broken(&tomls[random.below(tomls.len())], &mut random);
                let read =
                    panic::catch_unwind(|| InstrumentFile::parse(&source).map_err(|error| error.to_string()));
                (source, read)
            } else {
                let mut three = tables[random.below(tables.len())].clone();
                let one = random.below(3);
                three[one] = broken(&three[one], &mut random);
                let read = panic::catch_unwind(|| {
                    let [bore, holes, chart] = three.clone();
                    Tables { bore, holes, chart }.read(&details("x")).map_err(|error| error.to_string())
                });
                (three[one].clone(), read)
            };
            match read {
                Err(_) => wrong.push(format!("case {case}: the reader panicked")),
                Ok(Err(message)) => {
                    refused[usize::from(is_toml)] += 1;
                    if message.len() < 20 || message.len() > 4_000 {
                        wrong.push(format!("case {case}: {message:?} helps nobody"));
                    }
                }
                Ok(Ok(file)) => {
                    accepted[usize::from(is_toml)] += 1;
                    let rate_hz = [96_000.0, 88_200.0][case % 2];
                    let checked = panic::catch_unwind(|| {
                        is_an_instrument(&file)?;
                        if is_toml {
                            says_what_was_read(&source, &file)?;
                        }
                        can_be_worked_with(&file, rate_hz)?;
                        if case % 1_000 == 0 {
                            Check::new(&file, Air::default(), 440.0);
                        }
                        match InstrumentFile::parse(&file.to_toml()) {
                            Ok(again) if again.fingerings == file.fingerings => Ok(()),
                            Ok(_) => Err("written and read it is another".to_owned()),
                            Err(error) => Err(format!("written it cannot be read: {error}")),
                        }
                    });
                    match checked {
                        Err(_) => wrong.push(format!("case {case}: working with it panicked")),
                        Ok(Err(what)) => wrong.push(format!("case {case}: {what}")),
                        Ok(Ok(())) => {}
                    }
                }
            }
        }
        (accepted, refused, wrong)
    };
    let (one, other) = thread::scope(|scope| {
        let other = scope.spawn(|| work(1));
        (work(0), other.join().unwrap())
    });
    let sum = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1] + b[1]];
    let (accepted, refused) = (sum(one.0, other.0), sum(one.1, other.1));
    println!(
        "TOML: {} refused, {} accepted; CSV: {} refused, {} accepted",
        refused[1], accepted[1], refused[0], accepted[0]
    );
    let wrong: Vec<String> = one.2.into_iter().chain(other.2).collect();
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
    // The run means something only if both happen often.
    assert!(accepted.iter().chain(&refused).all(|&count| count > 500), "{accepted:?} {refused:?}");
}
