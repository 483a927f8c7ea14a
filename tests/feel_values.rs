//! `chalumeau haptic`: the feel of all notes against the reference table, and which note feels harder than which.

#[path = "support/reference.rs"]
mod reference;

use chalumeau_core::bore::instrument_file::InstrumentFile;
use std::collections::BTreeMap;
use std::process::Command;

const COLUMNS: [&str; 13] = [
    "written_midi",
    "gamma_on",
    "gamma_off",
    "p_req_pa",
    "a_on_deg",
    "a_off_deg",
    "a_close_deg",
    "scale_mnm",
    "h",
    "k",
    "gamma_sounding",
    "wall_deg",
    "most_mnm",
];
/// The reference note, which Contrast and Place do not change: C5.
const REFERENCE_NOTE: u8 = 72;

/// Largest deviation from the reference table, as docs/measured.md has it.
const DEVIATION_MAX: f64 = 0.005;

/// One note of the table, by column.
type Note = BTreeMap<&'static str, f64>;

/// The table that `chalumeau haptic` prints for all notes.
fn haptic(words: &str) -> BTreeMap<u8, Note> {
    let arguments = format!("haptic --all --csv - {words}");
    let output =
        Command::new(env!("CARGO_BIN_EXE_chalumeau")).args(arguments.split_whitespace()).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{words}: {error}");
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    assert_eq!(lines.next(), Some(format!("written,{}", COLUMNS.join(",")).as_str()));
    lines
        .map(|line| {
            let fields: Vec<f64> = line.split(',').skip(1).map(|field| field.parse().unwrap()).collect();
            assert_eq!(fields.len(), COLUMNS.len(), "{line}");
            let note: Note = COLUMNS.into_iter().zip(fields).collect();
            (note["written_midi"] as u8, note)
        })
        .collect()
}

/// A column of the reference, for the notes that are played as in the maker's chart, for which it was computed.
fn expected(column: &str) -> BTreeMap<u8, f64> {
    let mut expected = reference::by_written("thresholds_tuned.csv", column);
    let file = InstrumentFile::built_in();
    let others = file.fingerings.iter().filter(|fingering| fingering.maker_open.is_some());
    others.for_each(|fingering| {
        expected.remove(&fingering.written.0);
    });
    assert_eq!(expected.len(), 43);
    expected
}

/// A column, over its value for the reference note.
fn over_reference(notes: &BTreeMap<u8, Note>, column: &str) -> BTreeMap<u8, f64> {
    notes.iter().map(|(&written, note)| (written, note[column] / notes[&REFERENCE_NOTE][column])).collect()
}

fn spread(values: &BTreeMap<u8, f64>) -> f64 {
    values.values().copied().fold(0.0, f64::max) / values.values().copied().fold(f64::INFINITY, f64::min)
}

#[test]
fn physical_feel_is_the_reference_table_for_three_embouchures_under_both_laws() {
    let mut worst = 0.0_f64;
    for zeta in ["0.2", "0.3", "0.4"] {
        let expected = expected(&format!("gamma_th_zeta{zeta}"));
        let standard = expected[&REFERENCE_NOTE];
        for law in ["flow", "pressure"] {
            let notes = haptic(&format!("--zeta {zeta} --contrast 1 --law {law}"));
            assert_eq!(notes.len(), 46);
            let (angles, torques) = (over_reference(&notes, "a_on_deg"), over_reference(&notes, "scale_mnm"));
            for (written, note) in &notes {
                // The note's requirement, and what the hand feels: angle and torque are proportional to the pressure.
                for (what, found) in [
                    ("gamma_on", note["gamma_on"]),
                    ("p_req_pa", note["p_req_pa"] / 6_000.0),
                    ("a_on_deg", angles[written] * standard),
                    ("scale_mnm", torques[written] * standard),
                ] {
                    let Some(expected) = expected.get(written) else { continue };
                    let off = found / expected - 1.0;
                    assert!(off.abs() < DEVIATION_MAX, "zeta {zeta} {law} {written} {what}: {found}, {off}");
                    worst = worst.max(off.abs());
                }
                let (on, close, off) = (note["a_on_deg"], note["a_close_deg"], note["a_off_deg"]);
                assert!(0.0 < on && on < close && close <= off, "{written}: {on} {close} {off}");
                assert!((note["h"] * note["k"] - 1.0).abs() < 1e-4, "the reference reed closes at 1");
                if law == "flow" {
                    assert!((3.0 * on / close - 1.0).abs() < 1e-4, "the peak lies at a third of closure");
                }
            }
        }
    }
    println!("worst {:.2} %", 100.0 * worst);
}

#[test]
fn physical_order_is_that_of_the_pressures_and_contrast_and_place_widen_it() {
    let expected = expected("gamma_th_zeta0.3");
    let physical = over_reference(&haptic("--contrast 1"), "a_on_deg");
    for (a, hard) in &expected {
        for (b, easy) in &expected {
            // Two notes closer than this have no certain order: it is twice the largest deviation.
            if hard / easy > 1.01 {
                assert!(physical[a] > physical[b], "{a} is harder than {b}");
            }
        }
    }
    // Contrast is the exponent of the torque, Place that of the angle.
    for (contrast, place) in [(3, 1), (5, 1), (1, 3), (3, 5)] {
        let notes = haptic(&format!("--contrast {contrast} --place {place}"));
        for (column, exponent) in [("a_on_deg", place), ("scale_mnm", contrast)] {
            let wider = over_reference(&notes, column);
            for (written, ratio) in &physical {
                assert!((wider[written] / ratio.powi(exponent) - 1.0).abs() < 1e-3, "{written} {column}");
            }
        }
    }
}

/// With equal travel, every note speaks and closes at the angle that the reference reed has, whatever reed is played; its
/// pressures are those of the reed.
#[test]
fn equal_travel_is_that_of_the_reference_reed() {
    let standard = haptic("");
    for reed in ["--H 2 --k 0.3849", "--H 2", "--H 3.3 --k 0.3849", "--H 3.3"] {
        let (own, equal) =
            (haptic(&format!("{reed} --torque 30")), haptic(&format!("{reed} --torque 30 --equal-travel")));
        let mut farthest = 0.0_f64;
        for (written, note) in &equal {
            for column in ["a_on_deg", "a_close_deg"] {
                assert!(
                    (note[column] / standard[written][column] - 1.0).abs() < 1e-4,
                    "{reed} {written} {column}"
                );
            }
            for column in ["gamma_on", "p_req_pa", "gamma_sounding", "h", "k"] {
                assert_eq!(note[column], own[written][column], "{reed} {written} {column}");
            }
            farthest = farthest.max((own[written]["a_close_deg"] / note["a_close_deg"]).ln().abs());
        }
        assert!(farthest > 0.2, "{reed}: without it closure lies elsewhere");
    }
}

#[test]
fn covered_holes_are_harder_the_longer_the_tube_and_easier_when_reversed() {
    let file = InstrumentFile::built_in();
    // Length of tube down to the first open hole; register holes do not count.
    let lengths: BTreeMap<u8, f64> = file
        .fingerings
        .iter()
        .map(|fingering| {
            let open = file.holes.iter().zip(&fingering.open).find(|&(hole, &open)| open && !hole.register);
            (fingering.written.0, open.map_or(file.length_m(), |(hole, _)| hole.x_m))
        })
        .collect();
    let table = |order: &str| haptic(&format!("--contrast 1 --order {order}"));
    let [physical, covered, reversed] = ["physical", "covered-holes", "covered-holes-reversed"].map(table);
    let angle = |notes: &BTreeMap<u8, Note>, written: u8| notes[&written]["a_on_deg"];
    for (&a, long) in &lengths {
        for (&b, short) in &lengths {
            if long > short {
                assert!(angle(&covered, a) > angle(&covered, b), "{a} covers more than {b}");
                assert!(angle(&reversed, a) < angle(&reversed, b), "{a} covers more than {b}");
                assert!(covered[&a]["scale_mnm"] > covered[&b]["scale_mnm"]);
            }
        }
    }
    // The lowest note covers every hole, and the note a twelfth above has the same fingering but for the register key.
    assert_eq!(angle(&covered, 52), angle(&covered, 71));
    // Neither the spread nor the requirement of a note depends on the order.
    let spreads = [&physical, &covered, &reversed].map(|notes| spread(&over_reference(notes, "a_on_deg")));
    assert!(spreads.iter().all(|x| (x / spreads[0] - 1.0).abs() < 1e-4), "{spreads:?}");
    for (written, note) in &physical {
        for other in [&covered, &reversed] {
            assert_eq!(note["p_req_pa"], other[written]["p_req_pa"]);
        }
    }
}
