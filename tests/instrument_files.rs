//! Instruments from tables, made cylinders, and what the readers do with ten thousand broken files.

use std::fs;
use std::path::Path;

use chalumeau::bore::check::Check;
use chalumeau::bore::cylinder::Cylinder;
use chalumeau::bore::instrument_file::ImportDetails;
use chalumeau::bore::instrument_file::ImportError;
use chalumeau::bore::instrument_file::InstrumentFile;
use chalumeau::bore::instrument_file::Sheet;
use chalumeau::units::Air;
use chalumeau::units::WrittenNote;

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
        let off = chalumeau::units::cents(note.peak.unwrap().f_hz, theirs);
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
            "line 5: r_start_m is \"0,0069\"; it must be a number, with a point",
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
