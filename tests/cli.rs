//! The command line as a user and a script meet it: each kind of mistake, and the tables others read.

use chalumeau_core::units::WrittenNote;
use some::some;
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

#[path = "../examples/make_pieces/main.rs"]
mod make_pieces;
#[path = "../crates/core/tests/support/some.rs"]
mod some;
#[path = "cli/what_is_measured.rs"]
mod what_is_measured;

const EXAMPLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
const MELODY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/melody.mid");
const KING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/mountain-king.mid");

fn chalumeau<A: AsRef<OsStr>>(directory: &Path, args: impl IntoIterator<Item = A>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(directory)
        .env("CHALUMEAU_CACHE_DIR", env!("CARGO_TARGET_TMPDIR"))
        .args(args)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split_whitespace()
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs a command that must be refused: exit code 2, each of `says` in the message, no file written.
#[track_caller]
fn refused(directory: &TempDir, line: &str, says: &[&str]) {
    let before = names(directory.path());
    let output = chalumeau(directory.path(), words(line));
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    for say in says {
        assert!(message.contains(say), "{line}: expected {say:?} in {message:?}");
    }
    assert!(!message.contains("panicked"), "{line}: {message}");
    assert_eq!(names(directory.path()), before, "{line} left a file behind");
}

#[track_caller]
fn succeeds(directory: &Path, line: &str) -> String {
    let output = chalumeau(directory, words(line));
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn damaged_midi_is_refused_where_it_breaks() {
    let d = tempfile::tempdir().unwrap();
    let melody = fs::read(MELODY).unwrap();
    fs::write(d.path().join("cut.mid"), &melody[..melody.len() / 2]).unwrap();
    refused(&d, "render cut.mid --out x.wav", &["cut.mid", "ends at byte", "whole file"]);
    fs::write(d.path().join("text.mid"), "once upon a time").unwrap();
    refused(&d, "render text.mid --out x.wav", &["text.mid", "should begin with MThd", "\"once\""]);
    fs::write(d.path().join("empty.mid"), "").unwrap();
    refused(&d, "render empty.mid --out x.wav", &["it is empty"]);
    let mut broken = melody.clone();
    let notes = broken.windows(2).position(|w| w == [0xB0, 2]).unwrap();
    broken[notes] = 0xF5;
    fs::write(d.path().join("broken.mid"), broken).unwrap();
    refused(&d, "render broken.mid --out x.wav", &["track 2 is damaged", "at byte"]);
    let mut patterns = melody;
    patterns[9] = 2;
    fs::write(d.path().join("patterns.mid"), patterns).unwrap();
    refused(&d, "render patterns.mid --out x.wav", &["format 2", "save it as format 0 or 1"]);
}

#[test]
fn missing_files_are_named() {
    let d = tempfile::tempdir().unwrap();
    refused(&d, "render none.mid --out x.wav", &["cannot read none.mid"]);
    refused(&d, "render --written 60 --breath none.csv --out x.wav", &["cannot read none.csv"]);
    refused(&d, "impedance --all --peaks 8 --instrument none.toml", &["cannot read none.toml"]);
}

#[test]
fn files_in_another_encoding_are_named() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("latin1.toml"), b"name = \"Fl\xf6te\"\n").unwrap();
    for line in ["impedance --written C4 --instrument latin1.toml", "batch latin1.toml --into set"] {
        refused(&d, line, &["latin1.toml", "save it as UTF-8"]);
    }
}

#[test]
fn instrument_files_are_refused_by_field() {
    let d = tempfile::tempdir().unwrap();
    let good = include_str!("../crates/core/data/b_flat_clarinet.toml");
    for (wrong, says) in [
        (
            good.replacen("transposition_semitones = 2", "transposition_semitones = 99", 1),
            "transposition_semitones is 99",
        ),
        (good.replacen("reed_volume_mm3", "reed_volume", 1), "reed_volume"),
        (
            good.replacen("diameter_start_mm = 10.4", "diameter_start_mm = -10.4", 1),
            "diameter_start_mm is -10.4",
        ),
        ("name = ".to_owned(), "not an instrument file"),
    ] {
        fs::write(d.path().join("mine.toml"), wrong).unwrap();
        for command in [
            "impedance --all --peaks 1 --csv x",
            "threshold --csv x",
            "tune --csv x",
            "render --written 60 -o x",
        ] {
            refused(&d, &format!("{command} --instrument mine.toml"), &["mine.toml", says]);
        }
    }
}

#[test]
fn instruments_are_made_checked_and_shown() {
    let d = tempfile::tempdir().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/instruments/alto-chalumeau");
    for name in ["bore.csv", "holes.csv", "fingerings.csv"] {
        fs::copy(folder.join(name), d.path().join(name)).unwrap();
    }
    let tables = "--bore bore.csv --holes holes.csv --fingerings fingerings.csv";
    succeeds(
        d.path(),
        &format!("instrument import {tables} --nominal-diameter-mm 15 --name Alto --out alto.toml"),
    );
    let notes = succeeds(d.path(), "instrument check alto.toml");
    assert!(
        notes.starts_with("written,written_midi,register,mode,wanted_hz,peak_hz,cents,mag_over_zc,q\n# Alto")
    );
    assert_eq!(notes.lines().count(), 17);
    assert_eq!(succeeds(d.path(), "instrument show --instrument alto.toml").lines().count(), 3 + 1 + 10 + 15);
    refused(
        &d,
        &format!("instrument import {tables} --out alto.toml"),
        &["alto.toml exists already", "--force"],
    );
    refused(
        &d,
        &format!("instrument import {tables} --transposition 2 --out b.toml"),
        &["fingerings.csv, line 4: sounding_note", "A#3"],
    );
    let holes = fs::read_to_string(d.path().join("holes.csv")).unwrap();
    fs::write(d.path().join("holes.csv"), holes.replace("104.4", "0.1044")).unwrap();
    refused(
        &d,
        &format!("instrument import {tables} --out b.toml"),
        &["holes.csv, line 3: hole 1 (K1): x_mm is 0.1044", "0.1044 m = 104.4 mm"],
    );

    succeeds(d.path(), "instrument new --notes C4,E4 --diameter-mm 12 --out tube.toml");
    succeeds(d.path(), "instrument new --instrument tube.toml --scale 1.5 --transposition 7 --out low.toml");
    let low = fs::read_to_string(d.path().join("low.toml")).unwrap();
    assert!(
        low.contains("transposition_semitones = 7") && low.contains("nominal_diameter_mm = 18.0"),
        "{low}"
    );
    refused(&d, "instrument new --out x.toml", &["--notes", "--scale"]);
    refused(&d, "instrument new --notes E4,C4 --out x.toml", &["C4 comes after E4"]);
    refused(&d, "instrument new --notes C4,X4 --out x.toml", &["\"X4\" must be a MIDI number"]);
    refused(&d, "instrument new --scale 5 --out x.toml", &["reed_volume_mm3 is 150000"]);
    refused(&d, "instrument new --notes C-1 --out x.toml", &["an octave of C-1"]);
    refused(&d, "instrument check none.toml", &["cannot read none.toml"]);
    for line in
        ["instrument check --instrument tube.toml", "instrument check b-flat", "instrument show tube.toml"]
    {
        succeeds(d.path(), line);
    }
    refused(&d, "instrument check tube.toml --instrument tube.toml", &["cannot be used with"]);
    // The chart needs no registers; the bore it is compared with is told.
    let chart = fs::read_to_string(d.path().join("fingerings.csv")).unwrap();
    let without = chart.replace(",register,", ",_register,");
    assert_ne!(chart, without);
    fs::write(d.path().join("fingerings.csv"), without).unwrap();
    fs::copy(folder.join("holes.csv"), d.path().join("holes.csv")).unwrap();
    let plain = chalumeau(d.path(), words(&format!("instrument import {tables} --out plain.toml")));
    let message = String::from_utf8(plain.stderr).unwrap();
    assert!(
        plain.status.success() && message.contains("14.9 mm") && message.contains("15.0 mm"),
        "{message}"
    );
    assert!(fs::read_to_string(d.path().join("plain.toml")).unwrap().contains("\"chalumeau\""));
    // In tune for the pitch it was made for.
    let old = chalumeau(d.path(), words("instrument new --notes D3,E3,F3 --a4 415 --out old.toml"));
    let message = String::from_utf8(old.stderr).unwrap();
    assert!(old.status.success() && !message.contains("warning"), "{message}");
    // Its only note is to sound at a peak that a tube as short as this does not have.
    succeeds(d.path(), "instrument new --notes C6 --out high.toml");
    let high = fs::read_to_string(d.path().join("high.toml")).unwrap();
    fs::write(d.path().join("mute.toml"), high.replace("mode = 1", "mode = 12")).unwrap();
    refused(
        &d,
        "instrument check mute.toml",
        &["error: no note of the chart has a peak", "mute.toml: cannot be played"],
    );
}

/// A name may have anything in it but stays one field of a table, one line of a comment, and out of the picture's tags.
#[test]
fn names_do_not_break_tables_and_pictures() {
    let d = tempfile::tempdir().unwrap();
    succeeds(d.path(), "instrument new --notes D3,E3 --name tube --out tube.toml");
    let tube = fs::read_to_string(d.path().join("tube.toml")).unwrap();
    let odd = tube
        .replace("name = \"tube\"", "name = \"a\\nb\\u0007<i>\"")
        .replace("part = \"cylinder\"", "part = \"a,\\\"b\\\"\"")
        .replace("\"R3\"", "\"H,1\"");
    fs::write(d.path().join("odd.toml"), odd).unwrap();
    let bore = succeeds(d.path(), "bore --instrument odd.toml --csv - --plot odd.svg");
    let only_drawn = succeeds(d.path(), "bore --instrument odd.toml --plot only.svg");
    assert!(only_drawn.is_empty() && d.path().join("only.svg").exists(), "{only_drawn}");
    assert!(bore.lines().nth(1).unwrap().starts_with("# a b"), "{bore}");
    assert!(bore.contains("bore,\"a,\"\"b\"\"\",0,") && bore.contains("hole,\"H,1\","), "{bore}");
    let show = succeeds(d.path(), "instrument show odd.toml");
    // A reader that knows remarks does not take the rest of the line for one.
    succeeds(d.path(), "instrument new --notes D3,F#3 --out sharp.toml");
    for table in ["check", "show"] {
        let table = succeeds(d.path(), &format!("instrument {table} sharp.toml"));
        assert!(table.contains("\"F#3\","), "{table}");
    }
    assert!(show.contains("note,E3,,,,,\"chalumeau peak 1: H,1\""), "{show}");
    let picture = fs::read_to_string(d.path().join("odd.svg")).unwrap();
    assert!(!picture.contains('\u{7}') && !picture.contains("<i>") && picture.contains("&lt;i&gt;"));
}

#[test]
fn a_measured_reed_has_both_faces() {
    let d = tempfile::tempdir().unwrap();
    let value = |table: &str, quantity: &str| -> f64 {
        let line = table.lines().find(|line| line.starts_with(quantity)).unwrap();
        line.split(',').nth(2).unwrap().parse().unwrap()
    };
    let reference = succeeds(d.path(), "reed --physical");
    assert!((value(&reference, "closing pressure,p_M") - 6.0).abs() < 1e-6, "{reference}");
    let stiffness = value(&reference, "stiffness,K");
    let stiff = succeeds(d.path(), &format!("reed --physical --reed-stiffness {}", 2.0 * stiffness));
    assert!((value(&stiff, "stiffness,k") - 2.0 * value(&reference, "stiffness,k")).abs() < 1e-6, "{stiff}");
    assert!((value(&stiff, "closing pressure,p_M") - 12.0).abs() < 1e-5, "{stiff}");
    let free = format!("reed --physical --H 3 --k {} --zeta 0.4", value(&stiff, "stiffness,k"));
    assert!((value(&succeeds(d.path(), &free), "stiffness,K") - 2.0 * stiffness).abs() < 1e-4);
    refused(&d, "reed --physical --H 3 --reed-opening 0.6", &["--H", "--reed-opening"]);
    refused(&d, "reed --physical --A 0 --reed-width 12", &["--A 0"]);
    refused(&d, "render --written 60 --zeta 0.3 --reed-width 12 --out x.wav", &["--zeta", "--reed-width"]);
    refused(
        &d,
        "render --written 60 --reed-opening 2 --out x.wav",
        &["H = 10.392", "--reed-opening must lie in 0.20..0.96 mm"],
    );
}

#[test]
fn breath_files_are_refused_by_line() {
    let d = tempfile::tempdir().unwrap();
    for (text, says) in [
        ("t_s,gamma\n0,0.5\n1,loud\n", "line 3: gamma must be a number, got \"loud\""),
        ("# breath\n\n0,0.5\n0,0.6\n", "line 4: t_s must grow from line to line"),
        ("0;0.5\n", "line 1: expected two columns t_s,gamma, got \"0;0.5\""),
        ("0,0.5\n1,5\n", "line 2: gamma must lie in 0..3"),
        ("t_s,gamma\n", "no data"),
    ] {
        fs::write(d.path().join("breath.csv"), text).unwrap();
        refused(&d, "render --written 60 --breath breath.csv --out x.wav", &["breath.csv", says]);
    }
    for dynamic in ["pp", "mf", "p:ff"] {
        let says = format!("give --dynamic {dynamic}");
        refused(&d, &format!("render --written 60 --breath {dynamic} --out x.wav"), &[&says]);
    }
}

#[test]
fn numbers_out_of_range_say_what_would_be_right() {
    let d = tempfile::tempdir().unwrap();
    let note = "render --written 60 --out x.wav";
    for (option, says) in [
        ("--gamma 3.5", "must lie in 0..3"),
        ("--gamma nan", "must lie in 0..3"),
        ("--gamma soft", "must be a number in 0..3"),
        ("--rate 800", "must be a whole number of Hz in 1000..1536000"),
        ("--rate 44100.5", "must be a whole number of Hz"),
        ("--bits 20", "possible values: 16, 24, 32f"),
        ("--channels 3", "must be a whole number in 1..2"),
        ("--seconds 0", "must lie in 0.01..3600"),
        ("--transpose 2", "'--set transp=<VALUE>' sets Transpose"),
        ("--breath-noise 0", "'--noise' sets Breath noise"),
        ("--zeta 1", "must lie in 0.05..0.9"),
        ("--lay 1", "must lie in 0..0.5"),
        ("--strength 9", "must lie in 1.5..5"),
        ("--a4 414.9", "must lie in 415..466"),
        ("--temperature 50", "must lie in 10..40"),
        ("--gain-db -90", "must lie in -60..24"),
        ("--breath ramp:0:1", "ramp:FROM:TO:SECONDS"),
        ("--breath ramp:0:9:1", "gamma must lie in 0..3"),
        ("--crescendo 0.5", "FROM:TO"),
        ("--breath 9", "must lie in 0..3"),
        ("--dynamic fff", "or one of pp, p, mp, mf, f, ff"),
        ("--dynamic p --gamma 0.5", "cannot be used with"),
        ("--dynamic p --breath-response physical", "has no dynamics"),
        ("--gamma 0.5 --crescendo 0.4:0.5", "cannot be used with"),
        ("--gamma 2 --breath-full 6", "needs 12.0 kPa"),
        ("--gamma 2 --strength 5", "below gamma 1.34"),
        ("--probe x.wav", "give them different names"),
        ("--probe-every 0 --probe p.csv", "must be a whole number in 1..1000000"),
        ("--sounding 58", "cannot be used with"),
    ] {
        refused(&d, &format!("{note} {option}"), &[says]);
    }
    refused(&d, "render --out x.wav", &["--written", "--scale"]);
    refused(
        &d,
        "render --written 40 --out x.wav",
        &["written 40 (E2) has no fingering", "52 (E3) to 97 (C#7)"],
    );
    refused(&d, "render --written H4 --out x.wav", &["0..127", "E3"]);
    refused(&d, "render --scale 40:60 --out x.wav", &["written 40"]);
    refused(&d, "render --scale 60 --out x.wav", &["E3:C6"]);
    refused(&d, "render --written 60", &["--out"]);
    refused(&d, "render C4 --out x.wav", &["for one note give --written C4"]);
    refused(&d, "impedance --all", &["--peaks 8"]);
    refused(&d, "impedance --written 60 --from 100 --to 50 --csv x.csv", &["--to above --from"]);
    refused(&d, "impedance --written 60 --step 0.001 --from 1 --to 20000 --csv x.csv", &["points"]);
    refused(&d, "impedance", &["--peaks 8"]);
    refused(&d, "impedance --written 40 --peaks 8", &["written 40 (E2) has no fingering"]);
    refused(&d, "impedance --written 60 --open-holes REG", &["cannot be used with"]);
    refused(&d, "impedance --open-holes REK", &["no hole \"REK\"", "REG TRILL4_B"]);
    refused(&d, "impedance --written 60 --temperature 20", &["25 C", "--model tmm"]);
    refused(&d, "tune --dynamic mf --breath-response physical", &["has no dynamics"]);
    refused(&d, "tune --gamma 9", &["must lie in 0..3"]);
    refused(&d, "tune --written 40", &["written 40 (E2) has no fingering"]);
    refused(&d, "threshold --all --zeta 2", &["must lie in 0.05..0.9"]);
    refused(&d, "threshold C4", &["a note follows its flag: --written C4"]);
    refused(&d, "fingerings C4", &["a note follows its flag: --note C4"]);
    refused(&d, "reed", &["--table"]);
    refused(&d, "reed --law --H 99", &["must lie in 0.5..10"]);
    refused(&d, "hum", &["unrecognized subcommand 'hum'"]);
}

#[test]
fn places_that_cannot_be_written_are_refused() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("file"), "").unwrap();
    fs::create_dir(d.path().join("directory")).unwrap();
    refused(&d, "render --written 60 --out none/x.wav", &["directory none does not exist"]);
    refused(&d, "render --written 60 --out directory --force", &["directory is not a regular file"]);
    refused(&d, "render --written 60 --out -", &["cannot go to standard output"]);
    refused(&d, "render --written 60 --out C4.MP3", &["C4.MP3 would hold a WAV file", "--out C4.wav"]);
    refused(&d, "reed --table --csv none/x.csv", &["directory none does not exist"]);
    // Also true for root, to whom no directory is closed.
    refused(&d, "render --written 60 --out file/x.wav", &["cannot write file/x.wav"]);
    refused(
        &d,
        "render --written 60 --seconds 0.1 --out x.wav --probe file/x.csv",
        &["cannot write file/x.csv"],
    );
}

#[test]
fn existing_files_are_kept_unless_forced() {
    let d = tempfile::tempdir().unwrap();
    let path = d.path().join("x.wav");
    fs::write(&path, "old").unwrap();
    refused(&d, "render --written 60 --seconds 0.1 --out x.wav", &["x.wav exists already", "--force"]);
    fs::write(d.path().join("p.csv"), "old").unwrap();
    refused(&d, "reed --table --csv p.csv", &["p.csv exists already"]);
    refused(&d, "render --written 60 --seconds 0.1 --out y.wav --probe p.csv", &["p.csv exists already"]);
    assert_eq!(fs::read(&path).unwrap(), b"old");
    succeeds(d.path(), "render --written 60 --seconds 0.1 --out x.wav --force");
    assert!(fs::read(&path).unwrap().starts_with(b"RIFF"));
    assert_eq!(names(d.path()), ["p.csv", "x.wav"]);
}

#[test]
fn what_is_played_is_never_replaced() {
    let d = tempfile::tempdir().unwrap();
    fs::copy(MELODY, d.path().join("piece.mid")).unwrap();
    fs::write(d.path().join("breath.csv"), "0,0.5\n").unwrap();
    fs::copy(format!("{EXAMPLES}/instruments/cylinder.toml"), d.path().join("cylinder.toml")).unwrap();
    for line in [
        "render piece.mid --out piece.mid --force",
        "render piece.mid --out x.wav --probe ./piece.mid --force",
        "render --written C4 --breath breath.csv --probe breath.csv --out x.wav --force",
        "render --written C4 --instrument cylinder.toml --out cylinder.toml --force",
    ] {
        refused(&d, line, &["is what is played; give another name"]);
    }
    assert_eq!(fs::read(d.path().join("piece.mid")).unwrap(), fs::read(MELODY).unwrap());
}

/// Whatever a command reads stays, also where `--force` lets it replace files.
#[test]
fn what_is_read_is_never_replaced() {
    let d = tempfile::tempdir().unwrap();
    fs::copy(MELODY, d.path().join("piece.mid")).unwrap();
    fs::copy(MELODY, d.path().join("piece.html")).unwrap();
    fs::copy(MELODY, d.path().join("piece.wav")).unwrap();
    fs::copy(format!("{EXAMPLES}/instruments/cylinder.toml"), d.path().join("my.toml")).unwrap();
    fs::copy(d.path().join("my.toml"), d.path().join("my.png")).unwrap();
    fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/controllers/ewi.toml"), d.path().join("map.toml"))
        .unwrap();
    let before: Vec<_> =
        names(d.path()).into_iter().map(|name| (fs::read(d.path().join(&name)).unwrap(), name)).collect();
    for command in [
        "threshold",
        "bore",
        "impedance --written D3 --model tmm",
        "radiation",
        "haptic",
        "fingerings --note D3",
        "tune",
    ] {
        let line = format!("{command} --instrument my.toml --csv ./my.toml --force");
        refused(&d, &line, &["my.toml is read by this command; give another name"]);
    }
    for line in [
        "bifurcation --written D3 --instrument my.toml --csv my.toml --force",
        "realism --instrument my.toml --csv my.toml --force",
        "threshold --instrument my.png --plot my.png --force",
        "instrument check my.toml --csv my.toml --force",
        "instrument show --instrument my.toml --csv my.toml --force",
        "instrument new --scale 1.1 --instrument my.toml --out my.toml --force",
        "instrument import --bore my.toml --holes h --fingerings f --out my.toml --force",
        "report piece.html --out piece.html --force",
        "report piece.wav --wav piece.wav --out x.html --force",
    ] {
        refused(&d, line, &["is read by this command; give another name"]);
    }
    for line in [
        "render piece.mid --controllers map.toml --out map.toml --force",
        "render piece.mid --out x.wav --plot piece.mid --force",
    ] {
        refused(&d, line, &["is what is played; give another name"]);
    }
    for (bytes, name) in before {
        assert!(fs::read(d.path().join(&name)).unwrap() == bytes, "{name}");
    }
}

#[test]
fn two_results_never_go_to_one_file() {
    let d = tempfile::tempdir().unwrap();
    for line in [
        "render --written C4 --out d.wav --probe ./d.wav",
        "render --written C4 --out x.png --plot x.png",
        "bore --csv b.png --plot ./b.png",
    ] {
        refused(&d, line, &["give them different names"]);
    }
}

/// Each is refused before the first sample is computed, and a table on standard output has not begun.
#[test]
fn names_that_cannot_be_written_are_refused_first() {
    let d = tempfile::tempdir().unwrap();
    refused(&d, "render --written C4 --seconds 3600 --out none/", &["none/ is not a regular file"]);
    refused(&d, "report --written C4 --seconds 500 --out x.html/", &["is not a regular file"]);
    for command in ["threshold", "tune", "bifurcation --written E3", "realism"] {
        let output = chalumeau(d.path(), words(&format!("{command} --plot x.jpg")));
        assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(2), &b""[..]), "{command}");
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf8_are_refused_or_kept() {
    use std::os::unix::ffi::OsStrExt;
    let d = tempfile::tempdir().unwrap();
    let odd = OsStr::from_bytes(b"q\xff");
    let output = chalumeau(d.path(), [odd]);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    fs::write(d.path().join("plan.toml"), "[vary]\nwritten = [\"E3\"]\n").unwrap();
    let output =
        chalumeau(d.path(), ["batch", "plan.toml", "--into"].map(OsStr::new).into_iter().chain([odd]));
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("not in UTF-8"));
    assert_eq!(names(d.path()), ["plan.toml"]);
    let page = OsStr::from_bytes(b"q\xff.html");
    let line = ["report", "--written", "C4", "--seconds", "0.2", "--out"].map(OsStr::new);
    let output = chalumeau(d.path(), line.into_iter().chain([page]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(d.path().join(page).exists());
}

/// Runs a command whose standard output or error is a pipe that nobody reads.
#[cfg(unix)]
fn with_closed(directory: &Path, line: &str, is_stdout: bool) -> Option<i32> {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_chalumeau"));
    command.current_dir(directory).env("CHALUMEAU_CACHE_DIR", env!("CARGO_TARGET_TMPDIR"));
    command.args(words(line)).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let command = if is_stdout { command.stdout(writer) } else { command.stderr(writer) };
    command.status().unwrap().code()
}

#[cfg(unix)]
#[test]
fn a_reader_that_left_takes_no_other_result_along() {
    let d = tempfile::tempdir().unwrap();
    let out = |line: &str| assert_eq!(with_closed(d.path(), line, true), Some(0), "{line}");
    out("render --written C4 --seconds 0.2 --probe - --out probed.wav");
    out("bore --plot bore.svg");
    out("impedance --all --peaks 8 --model tmm --plot peaks.svg");
    let err = |line: &str| assert_eq!(with_closed(d.path(), line, false), Some(0), "{line}");
    err("render --written C4 --gamma 0.2 --seconds 0.2 --out soft.wav");
    fs::write(d.path().join("plan.toml"), "[vary]\nwritten = [\"E3\", \"C4\"]\n[same]\nseconds = 0.1\n")
        .unwrap();
    out("batch plan.toml --into set --dry-run");
    err("batch plan.toml --into set");
    assert_eq!(names(d.path()), ["bore.svg", "peaks.svg", "plan.toml", "probed.wav", "set", "soft.wav"]);
    assert_eq!(names(&d.path().join("set")), ["0001.wav", "0002.wav", "manifest.csv"]);
    assert_eq!(with_closed(d.path(), "render --written 1 --out x.wav", false), Some(2));
}

#[test]
fn a_batch_keeps_its_plan_and_what_its_journal_links_to() {
    let d = tempfile::tempdir().unwrap();
    let set = d.path().join("set");
    fs::create_dir(&set).unwrap();
    for name in ["manifest.csv", "manifest.part.csv"] {
        fs::write(set.join(name), "written,seconds\nE3,0.1\n").unwrap();
        refused(&d, &format!("batch set/{name} --into ./set --force"), &["is the plan", "give another name"]);
        fs::remove_file(set.join(name)).unwrap();
    }
    fs::write(d.path().join("plan.csv"), "written,seconds\nE3,0.1\n").unwrap();
    #[cfg(unix)]
    {
        fs::write(d.path().join("other.csv"), "other\n").unwrap();
        std::os::unix::fs::symlink("../other.csv", set.join("manifest.part.csv")).unwrap();
        succeeds(d.path(), "batch plan.csv --into set --force");
        assert_eq!(fs::read_to_string(d.path().join("other.csv")).unwrap(), "other\n");
        assert_eq!(names(&set), ["0001.wav", "manifest.csv"]);
    }
}

#[test]
fn a_limiter_that_worked_and_an_instrument_that_reaches_are_told() {
    let d = tempfile::tempdir().unwrap();
    let said = |line: &str| {
        let output = chalumeau(d.path(), words(&format!("render --seconds 0.4 --force --out x.wav {line}")));
        assert!(output.status.success(), "{line}");
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(
        said("--written G4 --dynamic ff --gain-db 12").contains("warning: the limiter turned peaks down")
    );
    assert!(!said("--written G4 --dynamic ff").contains("warning"));
    let soft = "warning: C4 begins to sound at gamma 0.37, and the breath reaches 0.2: only the tongue and air are heard";
    assert!(
        said("--written C4 --gamma 0.2").contains(soft) && said("--sounding Bb3 --gamma 0.2").contains(soft)
    );
    assert!(!said("--written C4 --breath ramp:0:0.4:1").contains("warning"));
    let output = chalumeau(d.path(), ["render", MELODY, "--gamma", "0.2", "--force", "--out", "x.wav"]);
    let late = String::from_utf8(output.stderr).unwrap();
    assert!(
        late.contains(" more) begins to sound at gamma 0.")
            && late.contains(": only the tongue and air are heard"),
        "{late}"
    );
    let output = chalumeau(d.path(), ["render", KING, "--force", "--out", "x.wav"]);
    let low = String::from_utf8(output.stderr).unwrap();
    assert!(low.contains("notes have no fingering") && low.contains("; --instrument bass has them"), "{low}");
}

#[test]
fn a_note_is_as_long_as_its_breath_and_breath_that_is_left_over_is_told() {
    let d = tempfile::tempdir().unwrap();
    let said = |line: &str| {
        let output = chalumeau(d.path(), words(&format!("render {line} --rate 8000 --force --out x.wav")));
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{text}");
        text
    };
    let seconds = || {
        let reader = hound::WavReader::open(d.path().join("x.wav")).unwrap();
        f64::from(reader.duration()) / f64::from(reader.spec().sample_rate)
    };
    for (line, expected_s) in [
        ("--written C4 --breath ramp:0.4:0.6:2.5", 2.5),
        ("--written C4 --breath ramp:0.4:0.6:0.5", 2.0),
        ("--written C4 --breath ramp:0.4:0.6:2.5 --seconds 0.3", 0.3),
    ] {
        let text = said(line);
        assert_eq!(seconds(), expected_s, "{line}");
        assert!(!text.contains("the breath ends"), "{line}: {text}");
    }
    let text = said("--scale C4:D4 --seconds 0.2 --breath ramp:0.4:0.6:2.5");
    let told = "the breath ends after 2.5 s, and the piece after 0.6 s: the rest of the breath is not played";
    assert!(text.contains(told), "{text}");
}

#[test]
fn a_table_of_pitches_names_its_tuning() {
    let d = tempfile::tempdir().unwrap();
    for (flags, tuning) in [
        ("", "natural"),
        ("--tempered", "tempered"),
        ("--dynamic mf", "tempered"),
        ("--tempered --untuned", "as built"),
    ] {
        let table = succeeds(d.path(), &format!("tune --written C4 {flags}"));
        let remark = format!("# B flat clarinet, Boehm system, {tuning}; ");
        assert!(table.lines().any(|line| line.starts_with(&remark)), "{flags}: {table}");
    }
}

#[test]
fn two_renders_are_identical() {
    let d = tempfile::tempdir().unwrap();
    let line = "--breath ramp:0:1:0.5 --seconds 1 --rate 44100 --bits 24 --probe-every 50";
    for name in ["a", "b"] {
        succeeds(d.path(), &format!("render --written 60 {line} --out {name}.wav --probe {name}.csv"));
    }
    for end in ["wav", "csv"] {
        let file = |name: &str| fs::read(d.path().join(format!("{name}.{end}"))).unwrap();
        assert!(file("a") == file("b"), "{end}");
    }
}

/// Softly, at mezzo-forte and loud, each from the softest to the loudest breath of its settings, also of a preset that a machine blows; and a swell.
#[test]
fn dynamics_are_as_loud_as_they_are_called() {
    let d = tempfile::tempdir().unwrap();
    let level_db = |options: &str, from: usize, to: usize| {
        let line = format!("render --written C4 --seconds 1 --rate 44100 {options} --force --out x.wav");
        // A name of two words is one argument.
        let output = chalumeau(d.path(), words(&line).map(|word| word.replace('~', " ")));
        assert!(output.status.success(), "{line}");
        let mut wav = hound::WavReader::open(d.path().join("x.wav")).unwrap();
        let heard: Vec<f32> = wav.samples::<f32>().map(Result::unwrap).collect();
        let power = heard[from..to].iter().map(|x| f64::from(x * x)).sum::<f64>() / (to - from) as f64;
        10.0 * power.log10()
    };
    for more in ["", "--breath-curve 2 --breath-softest 0.2", "--preset Blowing~machine --set room=0"] {
        let [pp, mf, ff] =
            ["pp", "mf", "ff"].map(|name| level_db(&format!("{more} --dynamic {name}"), 22_050, 44_100));
        println!("{more}: pp {pp:.1}, mf {mf:.1}, ff {ff:.1} dBFS");
        assert!(
            (12.0..20.0).contains(&(mf - pp)) && (7.0..14.0).contains(&(ff - mf)),
            "{more}: {pp} {mf} {ff}"
        );
    }
    let swell = [(4_000, 8_000), (40_000, 44_000)].map(|(from, to)| level_db("--dynamic pp:ff", from, to));
    assert!(swell[1] - swell[0] > 15.0, "{swell:?}");
    assert_eq!(level_db("--dynamic 0.6", 0, 44_100), level_db("--dynamic mf", 0, 44_100));
}

#[test]
fn a_wav_file_is_as_long_and_deep_as_asked() {
    let d = tempfile::tempdir().unwrap();
    for (bits, stored) in [("16", 16), ("24", 24), ("32f", 32)] {
        let line = "render --written 60 --gamma 0.5 --seconds 0.5 --no-noise --rate 44100 --channels 2";
        succeeds(d.path(), &format!("{line} --bits {bits} --out {bits}.wav"));
        let wav = hound::WavReader::open(d.path().join(format!("{bits}.wav"))).unwrap();
        assert_eq!((wav.spec().bits_per_sample, wav.spec().channels), (stored, 2));
        assert_eq!((wav.spec().sample_rate, wav.duration()), (44_100, 22_050));
    }
    // Without a number, what is heard differently on two channels has two.
    for (more, channels) in
        [("", 1), ("--room 0.3", 2), ("--set heard=place", 2), ("--room 0.3 --channels 1", 1)]
    {
        let line = format!("render --written 60 --gamma 0.5 --seconds 0.2 {more} --force --out wide.wav");
        succeeds(d.path(), &line);
        let wav = hound::WavReader::open(d.path().join("wide.wav")).unwrap();
        assert_eq!(wav.spec().channels, channels, "{more}");
    }
    succeeds(d.path(), "render --written 60 --gamma 1 --breath-full 6 --seconds 0.1 --out full.wav");
    succeeds(d.path(), "render --scale E3:G3 --seconds 0.1 --out scale.wav");
    assert_eq!(hound::WavReader::open(d.path().join("scale.wav")).unwrap().duration(), 19_200 + 48_000);
}

/// Header first, comments marked, every data line with as many numbers as the header has names.
#[track_caller]
/// Numbers of a table; the name of a note, where it has one, must be that of its number, and is left out.
fn table(text: &str, header: &str) -> Vec<Vec<f64>> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(header));
    let numbers = header.strip_prefix("written,").unwrap_or(header);
    lines
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let (name, line) = if numbers == header { (None, line) } else { name_and_rest(line) };
            let row: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            assert_eq!(row.len(), numbers.split(',').count(), "{line}");
            assert!(
                name.is_none_or(|name| name.trim_matches('"') == WrittenNote(row[0] as u8).to_string()),
                "{line}"
            );
            row
        })
        .collect()
}

fn name_and_rest(line: &str) -> (Option<&str>, &str) {
    let (name, rest) = line.split_once(',').unwrap();
    (Some(name), rest)
}

#[test]
fn tables_keep_their_contract() {
    let d = tempfile::tempdir().unwrap();
    let reed = table(&succeeds(d.path(), "reed --table --csv -"), "i,p,x_a,x_b,sgn");
    assert_eq!(reed.len(), 3601);
    for (i, row) in reed.iter().enumerate() {
        // Digits that read back to the same bits.
        let p = if i == 3600 { 1.0 } else { i as f64 * (1.0 / 3600.0) };
        assert_eq!(row[..3], [i as f64, p, p.sqrt()]);
        assert_eq!((row[3], row[4]), (p * p.sqrt(), f64::from(u8::from(i > 0))));
    }
    let peaks = succeeds(d.path(), "impedance --all --peaks 8 --model tmm --csv -");
    let peaks = table(&peaks, "written,written_midi,n,f_hz,mag_over_zc,q");
    assert_eq!(peaks.len(), 46 * 8);
    assert_eq!((peaks[0][0], peaks[0][1]), (52.0, 1.0));
    assert!((peaks[0][2] - 148.518).abs() < 0.1, "{:?}", peaks[0]);
    let curve =
        table(&succeeds(d.path(), "impedance --written 65 --csv -"), "f_hz,re_z_over_zc,im_z_over_zc");
    assert_eq!((curve[0][0], curve[3980][0], curve.len()), (20.0, 4000.0, 3981));
    let on =
        table(&succeeds(d.path(), "threshold --all --zeta 0.3 --csv -"), "written,written_midi,gamma_on");
    assert_eq!(on.len(), 46);
    assert!(on.iter().all(|row| row[1] > 1.0 / 3.0 && row[1] < 0.6), "{on:?}");
    let tune = "tune --written 60 --rate 48000 --gamma 0.5 --csv -";
    let tune = table(&succeeds(d.path(), tune), "written,written_midi,f_hz,cents,register_ok,as_built_cents");
    assert!((tune[0][1] - 233.08).abs() < 2.0 && tune[0][3] == 1.0, "{tune:?}");
}

#[test]
fn the_probe_has_units_and_time() {
    let d = tempfile::tempdir().unwrap();
    succeeds(d.path(), "render --written 60 --seconds 0.2 --out x.wav --probe p.csv --probe-every 96");
    let text = fs::read_to_string(d.path().join("p.csv")).unwrap();
    let rows = table(&text, "t_s,gamma,opening_unit,flow_m3s,p_mouthpiece_pa,p_radiated_pa");
    assert!(text.lines().nth(1).unwrap().contains("Pa at 1 m"));
    assert!(rows.len() >= 195);
    assert!(rows.iter().enumerate().all(|(i, row)| (row[0] - i as f64 * 0.001).abs() < 1e-6));
}

#[test]
fn a_table_goes_to_a_file_whole() {
    let d = tempfile::tempdir().unwrap();
    let printed = succeeds(d.path(), "threshold --written F4");
    succeeds(d.path(), "threshold --written F4 --csv x.csv");
    assert_eq!(fs::read_to_string(d.path().join("x.csv")).unwrap(), printed);
}

#[test]
fn a_closed_pipe_is_no_mistake() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .args(["reed", "--table"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_example_pieces_are_what_their_program_writes() {
    for (name, piece) in make_pieces::PIECES {
        let mut written = Vec::new();
        piece().write_std(&mut written).unwrap();
        let committed = fs::read(Path::new(EXAMPLES).join(name)).unwrap();
        assert!(
            written == committed,
            "{name}: run: cargo run --no-default-features --features cli --example make_pieces"
        );
    }
}

/// README's recordings, by the commands in CONTRIBUTING.
#[test]
fn the_recordings_are_of_a_good_length_and_level() {
    let d = tempfile::tempdir().unwrap();
    let contributing =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("CONTRIBUTING.md")).unwrap();
    let rows: Vec<&str> = contributing.lines().filter(|line| line.starts_with("| `docs/sound/")).collect();
    assert_eq!(rows.len(), make_pieces::PIECES.len());
    for row in rows {
        let (_, command) = row.split_once("`chalumeau ").unwrap();
        let (command, _) = command.split_once('`').unwrap();
        // Every second part stands between quotation marks, and is one word.
        let mut command_words = Vec::new();
        for (index, part) in command.split('"').enumerate() {
            let part = part.replace("examples/", &format!("{EXAMPLES}/"));
            if index % 2 == 0 {
                command_words.extend(words(&part).map(str::to_owned));
            } else {
                command_words.push(part);
            }
        }
        let output = chalumeau(d.path(), &command_words);
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && !message.contains("warning"), "{command}: {message}");
        let mut reader = hound::WavReader::open(d.path().join(command_words.last().unwrap())).unwrap();
        let seconds = f64::from(reader.duration()) / 48_000.0;
        assert!((20.0..35.0).contains(&seconds), "{command}: {seconds} s");
        let peak = reader.samples::<f32>().fold(0.0, |peak: f32, sample| peak.max(sample.unwrap().abs()));
        // Ogg Vorbis overshoots a little: at most -1 dBFS.
        assert!((0.3..0.89).contains(&peak), "{command}: peak {peak}");
    }
}

#[test]
fn a_note_takes_other_holes() {
    let d = tempfile::tempdir().unwrap();
    let render = "render --seconds 0.6 --no-noise --gamma 0.6 --force";
    let sound = |more: &str| {
        let line = format!("{render} --out n.wav");
        let output = chalumeau(d.path(), words(&line).chain(more.split('|')));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read(d.path().join("n.wav")).unwrap()
    };
    // The chart's own holes of C4, and those of E3, at which all are shut.
    let own = sound("--written|C4|--open-holes|R_VENT,R1 r2 R3 F_PAD E_PAD");
    assert_eq!(own, sound("--written|C4"));
    let shut = sound("--written|C4|--open-holes|");
    assert_ne!(shut, own);
    let hz = |wav: &[u8]| {
        let samples = hound::WavReader::new(wav).unwrap().into_samples::<f32>();
        let samples: Vec<f64> = samples.map(|sample| f64::from(sample.unwrap())).collect();
        chalumeau_core::analysis::pitch::fundamental_hz(&samples[samples.len() / 2..], 48_000.0).unwrap()
    };
    // It keeps the tuning of C4.
    let (found, e3) = (hz(&shut), 146.83);
    assert!((found / e3 - 1.0).abs() < 0.03, "{found} Hz");
    refused(&d, &format!("{render} --written C4 --open-holes R9 --out x.wav"), &["\"R9\"", "R_VENT"]);
}

#[test]
fn a_take_blows_and_a_damaged_one_is_refused_by_line() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("take.csv"), "t_us,angle_deg\n0,0\n100000,180\n900000,180\n").unwrap();
    let render = "render --written C4 --seconds 0.8 --rate 44100";
    succeeds(d.path(), &format!("{render} --replay take.csv --out a.wav"));
    succeeds(d.path(), &format!("{render} --replay take.csv --place 5 --out b.wav"));
    succeeds(d.path(), &format!("{render} --replay take.csv --contrast 5 --out c.wav"));
    let sound = |name: &str| fs::read(d.path().join(name)).unwrap();
    assert_ne!(sound("a.wav"), sound("b.wav"), "Place bends the angle's pressure");
    assert_eq!(sound("a.wav"), sound("c.wav"), "Contrast does not");
    // A take says which feel it was recorded with.
    let flags = "--law pressure --contrast 3 --place 1 --order physical --torque 40 --travel 360 --detent 6";
    let take =
        format!("# C4 (written 60) of B flat clarinet\n# feel {flags}\nt_us,angle_deg\n0,0\n900000,180\n");
    fs::write(d.path().join("rows.csv"), "t_us,angle_deg\n0,0\n900000,180\n").unwrap();
    succeeds(d.path(), &format!("{render} --replay rows.csv --law pressure --out v.wav"));
    fs::write(d.path().join("spring.csv"), take).unwrap();
    for (feel, is_same) in [
        ("", true),
        ("--law pressure --contrast 5 --torque 20", true),
        ("--law flow", false),
        ("--place 2", false),
    ] {
        let line = format!("{render} --replay spring.csv {feel} --force --out w.wav");
        let output = chalumeau(d.path(), words(&line));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.success() && said.contains("was recorded with --law pressure") != is_same,
            "{said}"
        );
        assert_eq!(sound("w.wav") == sound("v.wav"), is_same, "{feel}");
    }
    fs::write(d.path().join("odd.csv"), "# feel --loudness 3\nt_us,angle_deg\n0,0\n").unwrap();
    refused(&d, &format!("{render} --replay odd.csv --out x.wav"), &["# feel", "--loudness", "remove it"]);
    fs::write(d.path().join("bad.csv"), "t_us,angle_deg\n0,0\n5,far\n").unwrap();
    refused(&d, &format!("{render} --replay bad.csv --out x.wav"), &["bad.csv", "line 3", "`far`"]);
    refused(&d, &format!("{render} --replay none.csv --out x.wav"), &["none.csv"]);
}

/// Written pitch is the player's: C4 sounds A3 on the A clarinet and B flat 2 on the bass; a file is kept once it is tuned.
#[test]
fn instruments_are_played_by_name_and_files_are_tuned_once() {
    let d = tempfile::tempdir().unwrap();
    let cents_of = |instrument: &str| -> (f64, f64) {
        let line = format!("tune --written C4 --instrument {instrument}");
        let output = chalumeau(d.path(), words(&line));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let table = String::from_utf8(output.stdout).unwrap();
        let numbers: Vec<f64> =
            table.lines().last().unwrap().split(',').skip(1).map(|cell| cell.parse().unwrap()).collect();
        (numbers[1], numbers[2])
    };
    for (instrument, sounds_hz) in [("a", 220.0), ("bass", 116.54), ("c", 261.63), ("Bb", 233.08)] {
        let (hz, off) = cents_of(instrument);
        assert!(
            (hz / sounds_hz - 1.0).abs() < 0.001 && off.abs() < 0.5,
            "{instrument}: {hz} Hz, {off} cents"
        );
    }
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/instruments/cylinder.toml");
    let cache = tempfile::tempdir().unwrap();
    let tuned = || {
        let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
            .env("CHALUMEAU_CACHE_DIR", cache.path())
            .args(["tune", "--written", "E3", "--instrument", file])
            .output()
            .unwrap();
        (output.status.success(), String::from_utf8(output.stdout).unwrap())
    };
    let entries = || names(&cache.path().join("chalumeau"));
    let first = tuned();
    let kept = entries();
    // One as it is built and one that is tuned: the table has both.
    assert!(first.0 && kept.len() == 2, "{first:?} {kept:?}");
    assert_eq!((tuned(), entries()), (first, kept));
    refused(
        &d,
        "tune --written C4 --instrument violin",
        &["cannot read violin", "b-flat, a, e-flat, c, bass"],
    );
}

/// A folder of the user's presets with one good and one broken.
fn users_presets(root: &Path) {
    let folder = root.join("chalumeau/presets");
    fs::create_dir_all(&folder).unwrap();
    let text = "format = 1\nname = \"My jazz\"\ntags = [\"mine\"]\n\n[parameters]\nlip = \"0.900 x\"\n";
    fs::write(folder.join("mine.toml"), text).unwrap();
    fs::write(folder.join("bad.toml"), "format = 1\nname = \"Bad\"\n[parameters]\nlipp = 1\n").unwrap();
}

fn with_presets(directory: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(directory)
        .env("CHALUMEAU_DATA_DIR", directory)
        .args(args)
        .output()
        .unwrap();
    let [said, warned] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), said, warned)
}

#[test]
fn presets_are_listed_by_tag_and_shown_and_a_broken_one_is_named() {
    let d = tempfile::tempdir().unwrap();
    users_presets(d.path());
    let (code, list, warned) = with_presets(d.path(), &["presets", "list"]);
    assert_eq!(code, Some(0), "{warned}");
    assert!(list.starts_with("program,name,tags,author,shows\n0,B flat clarinet,"), "{list}");
    assert!(list.lines().count() > 48 && list.ends_with(",My jazz,mine,,\n"), "{list}");
    assert!(
        warned.contains("bad.toml: line 4: there is no parameter \"lipp\"; did you mean lip?"),
        "{warned}"
    );
    let (_, jazz, _) = with_presets(d.path(), &["presets", "list", "--tag", "jazz", "--tag", "soft"]);
    assert!(jazz.lines().skip(1).all(|line| line.contains("jazz") && line.contains("soft")));
    assert!(jazz.contains("Subtone ballad") && !jazz.contains("Swing section"), "{jazz}");
    let (code, _, said) = with_presets(d.path(), &["presets", "list", "--tag", "jaz"]);
    assert!(code == Some(2) && said.contains("did you mean jazz?"), "{said}");
    let (_, mine, _) = with_presets(d.path(), &["presets", "show", "my jazz"]);
    assert!(mine.contains("name = \"My jazz\"") && mine.contains("lip = \"0.900 x\""), "{mine}");
    let (code, _, said) = with_presets(d.path(), &["presets", "show", "Subtown ballad"]);
    assert!(code == Some(2) && said.contains("did you mean \"Subtone ballad\"?"), "{said}");
}

#[test]
fn a_preset_is_rendered_and_flags_change_it() {
    let d = tempfile::tempdir().unwrap();
    users_presets(d.path());
    let render = |out: &str, more: &[&str]| {
        let note = ["render", "--written", "G3", "--seconds", "0.3", "--out", out];
        let all: Vec<&str> = note.iter().chain(more).copied().collect();
        let (code, _, said) = with_presets(d.path(), &all);
        assert_eq!(code, Some(0), "{said}");
        fs::read(d.path().join(out)).unwrap()
    };
    let mine = render("mine.wav", &["--preset", "My jazz"]);
    let same = ["--breath-response", "played", "--tempered"];
    assert_eq!(mine, render("same.wav", &[&same[..], &["--set", "lip=0.9"]].concat()));
    assert_ne!(mine, render("usual.wav", &same));
    let over = render("over.wav", &["--preset", "My jazz", "--set", "lip=1"]);
    assert_eq!(over, render("again.wav", &[&same[..], &["--lip", "1"]].concat()));
    // The instrument is the preset's, unless another is chosen.
    let bass = render("bass.wav", &["--preset", "Bass pulse"]);
    assert_ne!(bass, render("small.wav", &["--preset", "Bass pulse", "--instrument", "e-flat"]));
    let (code, _, said) =
        with_presets(d.path(), &["render", MELODY, "--preset", "Klezmer", "--out", "no.wav"]);
    assert!(code == Some(2) && said.contains("did you mean \"Klezmer dance\"?"), "{said}");
    // tune and realism play it as render does.
    let tune = |more: &[&str]| {
        let all: Vec<&str> = ["tune", "--written", "G3"].iter().chain(more).copied().collect();
        let (code, table, said) = with_presets(d.path(), &all);
        assert_eq!(code, Some(0), "{said}");
        table.lines().last().unwrap().to_owned()
    };
    let mine = tune(&["--preset", "My jazz", "--set", "life=0"]);
    assert_eq!(mine, tune(&["--dynamic", "0.6", "--lip", "0.9", "--set", "life=0"]));
    assert_ne!(mine, tune(&["--dynamic", "0.6", "--set", "life=0"]));
    assert_ne!(mine, tune(&["--preset", "My jazz", "--set", "life=0", "--gamma", "0.6"]));
    let crescendo = ["render", MELODY, "--preset", "My jazz", "--crescendo", "0.4:1.2", "--out", "no.wav"];
    let (code, _, said) = with_presets(d.path(), &crescendo);
    assert!(code == Some(2) && said.contains("add --breath-response physical"), "{said}");
    assert!(!d.path().join("no.wav").exists());
}

/// A MIDI file of one track, with 96 ticks to the quarter note.
fn one_track(events: &[&[u8]]) -> Vec<u8> {
    let track = events.concat();
    let mut midi = b"MThd\0\0\0\x06\0\0\0\x01\0\x60MTrk".to_vec();
    midi.extend((track.len() as u32).to_be_bytes());
    midi.extend(track);
    midi
}

#[test]
fn linked_controllers_of_a_file_move_parameters() {
    let directory = TempDir::new().unwrap();
    // One note with breath; half way the controller 21 goes from 0 to 127.
    let events: [&[u8]; 6] = [
        &[0, 0xB0, 2, 90],
        &[0, 0x90, 60, 100],
        &[0, 0xB0, 21, 0],
        &[0x60, 0xB0, 21, 127],
        &[0x60, 0x80, 60, 0],
        &[0, 0xFF, 0x2F, 0],
    ];
    fs::write(directory.path().join("one.mid"), one_track(&events)).unwrap();
    let map = "format = 1\n\n[[link]]\ncontroller = 21\nparameter = \"growl\"\n";
    fs::write(directory.path().join("map.toml"), map).unwrap();
    succeeds(directory.path(), "render one.mid --out plain.wav");
    succeeds(directory.path(), "render one.mid --controllers map.toml --out linked.wav");
    let [plain, linked] =
        ["plain.wav", "linked.wav"].map(|name| fs::read(directory.path().join(name)).unwrap());
    assert_eq!(plain.len(), linked.len());
    let differs = plain.iter().zip(&linked).position(|(a, b)| a != b).unwrap();
    // A quarter note lasts half a second: nothing differs before the controller moves.
    let at = (differs - (plain.len() - 4 * 96_000)) as f64 / (4.0 * 48_000.0);
    assert!((0.5..0.56).contains(&at), "they differ from {at} s on");
    fs::write(directory.path().join("map.toml"), map.replace("growl", "growll")).unwrap();
    refused(
        &directory,
        "render one.mid --controllers map.toml --out bad.wav",
        &["map.toml", "line 5", "growll"],
    );
}

#[test]
fn a_device_sets_what_it_says_and_a_flag_wins() {
    let d = tempfile::tempdir().unwrap();
    let render = |line: &str| {
        let output =
            chalumeau(d.path(), words(&format!("render one.mid {line} --tail 0 --force --out x.wav")));
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{line}: {message}");
        (fs::read(d.path().join("x.wav")).unwrap(), message)
    };
    // A note with the mod wheel up.
    let events: [&[u8]; 5] = [
        &[0, 0xB0, 2, 90],
        &[0, 0xB0, 1, 127],
        &[0, 0x90, 60, 100],
        &[0x60, 0x80, 60, 0],
        &[0, 0xFF, 0x2F, 0],
    ];
    fs::write(d.path().join("one.mid"), one_track(&events)).unwrap();
    let map = |values: &str| {
        fs::write(d.path().join("map.toml"), format!("format = 1\n\n[parameters]\n{values}")).unwrap();
        render("--controllers map.toml").0
    };
    let plain = render("").0;
    let vibrato = map("wheel = \"Vibrato\"\n");
    assert_eq!(plain, vibrato, "what the wheel does where nothing is said");
    let [growl, nothing] = ["Growl", "Nothing"].map(|wheel| map(&format!("wheel = \"{wheel}\"\n")));
    assert!(growl != plain && nothing != plain && growl != nothing);
    assert_ne!(map("bfrom = \"Keys\"\n"), plain);
    // Under the flags.
    let lip = map("lip = \"0.9\"\n");
    assert_ne!(lip, plain);
    assert_eq!(render("--controllers map.toml --lip 1.1").0, render("--lip 1.1").0);
    assert_eq!(render("--controllers map.toml --set lip=1").0, plain);
    map("ksrc = \"CC17\"\n");
    let (as_it_was, message) = render("--controllers map.toml");
    assert!(
        as_it_was == plain && message.contains("ksrc") && message.contains("only the plugin"),
        "{message}"
    );
}

#[test]
fn a_report_is_of_one_player() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("two.mid"), two_tracks()).unwrap();
    for line in ["--written C4 --players 4", "two.mid --tracks", "--tour --players 2"] {
        refused(
            &d,
            &format!("report {line} --out a.html"),
            &["inside one instrument", "--players and --tracks"],
        );
    }
    for line in ["--written C4", "--tour"] {
        let refusal = ["--open-holes is for `render`"];
        refused(&d, &format!("report {line} --open-holes REG --out a.html"), &refusal);
    }
}

#[test]
fn a_scale_has_the_notes_of_the_chart() {
    let d = tempfile::tempdir().unwrap();
    succeeds(d.path(), "instrument new --notes D3,E3,F3 --out new.toml");
    let scale = |ends: &str| {
        let line = format!(
            "render --instrument new.toml --untuned --scale {ends} --seconds 0.1 --tail 0 --force --out x.wav"
        );
        let output = chalumeau(d.path(), words(&line));
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{message}");
        message
    };
    let message = scale("F3:D3");
    assert!(message.contains("does not have: D#3") && message.contains("0.300 s"), "{message}");
    assert!(!scale("E3:F3").contains("leaves"));
    refused(&d, "render --instrument new.toml --scale D3:F#3 --out y.wav", &["F#3", "no fingering"]);
}

/// Keys one after another for half a second each, but those below 50 for no time: a format 0 file.
fn one_after_another(keys: &[u8]) -> Vec<u8> {
    let mut track = Vec::new();
    for &key in keys {
        track.extend([0, 0x90, key, 90, if key < 50 { 0 } else { 0x60 }, 0x80, key, 0]);
    }
    track.extend([0, 0xff, 0x2f, 0]);
    one_track(&[&track])
}

/// Written E flat 4 (key 61) has an alternate, D4 (60) none.
#[test]
fn key_switches_of_a_file_choose_fingerings_and_make_no_sound() {
    let d = tempfile::tempdir().unwrap();
    let render = |keys: &[u8], flags: &str| {
        fs::write(d.path().join("keys.mid"), one_after_another(keys)).unwrap();
        let said = succeeds(d.path(), &format!("render keys.mid --force --out k.wav {flags}"));
        (fs::read(d.path().join("k.wav")).unwrap(), said)
    };
    let on = "--set keysw=c1";
    let plain = render(&[63, 61], "").0;
    assert!(render(&[63, 61], on).0 == plain, "the row alone changes nothing");
    assert!(render(&[63, 24, 61], on).0 == plain, "the chart's fingerings");
    let alternate = render(&[63, 25, 61], on).0;
    let differs = plain.iter().zip(&alternate).position(|(a, b)| a != b).unwrap();
    let at_s = (differs - (plain.len() - 4 * 96_000)) as f64 / (4.0 * 48_000.0);
    assert!((0.5..0.52).contains(&at_s), "from {at_s} s on, where the next note begins");
    assert!(render(&[63, 26, 61], on).0 != alternate, "the second one");
    assert!(render(&[63, 25, 60], on).0 == render(&[63, 60], "").0, "a note without alternates");
    assert!(render(&[63, 37, 61], "--set keysw=c2").0 == alternate, "the row at its other place");
    assert!(!render(&[63, 25, 61], on).1.contains("stay silent"));
    for beside in ["--written C4", "--sounding C4", "--scale E3:C4"] {
        for alone in ["--mpe", "--controllers EWI"] {
            refused(
                &d,
                &format!("render {beside} {alone} --out x.wav"),
                &[&alone[..5], "cannot be used with"],
            );
        }
    }
}

/// A chord of three keys, held for a second, as a MIDI file of 480 ticks a quarter.
fn chord(keys: [u8; 3]) -> Vec<u8> {
    let mut track = Vec::new();
    for key in keys {
        track.extend([0, 0x90, key, 90]);
    }
    // 960 ticks: a second at 120 quarters a minute.
    track.extend([0x87, 0x40, 0x80, keys[0], 0]);
    for key in &keys[1..] {
        track.extend([0, 0x80, *key, 0]);
    }
    track.extend([0, 0xff, 0x2f, 0]);
    let mut file = b"MThd\0\0\0\x06\0\0\0\x01\x01\xe0MTrk".to_vec();
    file.extend((track.len() as u32).to_be_bytes());
    file.extend(track);
    file
}

#[test]
fn several_players_play_a_chord_and_one_its_last_key() {
    let d = tempfile::tempdir().unwrap();
    let keys = [58, 62, 65];
    fs::write(d.path().join("chord.mid"), chord(keys)).unwrap();
    let power = |flags: &str| {
        succeeds(
            d.path(),
            &format!("render chord.mid --rate 48000 --channels 1 --force --no-noise --out c.wav {flags}"),
        );
        let sound: Vec<f64> = hound::WavReader::open(d.path().join("c.wav"))
            .unwrap()
            .into_samples::<f32>()
            .map(|sample| f64::from(sample.unwrap()))
            .collect();
        // By the discrete Fourier transform at the fundamental of each key, over half a second.
        keys.map(|key| {
            let turn = std::f64::consts::TAU * 440.0 * ((f64::from(key) - 69.0) / 12.0).exp2() / 48_000.0;
            let [mut re, mut im] = [0.0; 2];
            for (n, x) in sound[19_200..43_200].iter().enumerate() {
                let (sin, cos) = (turn * n as f64).sin_cos();
                (re, im) = (re + x * cos, im + x * sin);
            }
            10.0 * (re * re + im * im).log10()
        })
    };
    let [low, middle, high] = power("");
    assert!(high > low.max(middle) + 20.0, "one player plays the last key: {low} {middle} {high}");
    let three = power("--players 3 --spread 0 --set life=0");
    let (least, most) =
        (three.iter().copied().fold(f64::INFINITY, f64::min), three.iter().copied().fold(0.0, f64::max));
    assert!(most - least < 10.0, "three play all: {three:?}");
    let unison = power("--players 3 --unison --spread 0 --set life=0");
    assert!(unison[2] > unison[0].max(unison[1]) + 20.0, "all play the last key: {unison:?}");
    refused(&d, "render chord.mid --players 3 --probe p.csv --out x.wav", &["--players"]);
}

/// Two tracks of a note each, 58 and 65, on one channel; the second is panned to the right.
fn two_tracks() -> Vec<u8> {
    let track = |key: u8, first: &[u8]| {
        let mut track = first.to_vec();
        track.extend([0, 0x90, key, 90, 0x87, 0x40, 0x80, key, 0, 0, 0xff, 0x2f, 0]);
        [b"MTrk", &(track.len() as u32).to_be_bytes()[..], &track].concat()
    };
    let header = b"MThd\0\0\0\x06\0\x01\0\x02\x01\xe0";
    [&header[..], &track(58, &[]), &track(65, &[0, 0xb0, 10, 127])].concat()
}

#[test]
fn each_track_has_a_player_and_a_seat() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("duet.mid"), two_tracks()).unwrap();
    fs::write(d.path().join("chord.mid"), chord([58, 62, 65])).unwrap();
    // Energy at the fundamentals of both keys in each channel.
    let heard = |flags: &str| {
        succeeds(d.path(), &format!("render duet.mid --rate 48000 --force --no-noise --out d.wav {flags}"));
        let wav = hound::WavReader::open(d.path().join("d.wav")).unwrap();
        assert_eq!(wav.spec().channels, 2);
        let both: Vec<f64> = wav.into_samples::<f32>().map(|sample| f64::from(sample.unwrap())).collect();
        [0, 1].map(|side| {
            let sound: Vec<f64> = both.iter().skip(side).step_by(2).copied().collect();
            [58_u8, 65].map(|key| {
                let turn = std::f64::consts::TAU * 440.0 * ((f64::from(key) - 69.0) / 12.0).exp2() / 48_000.0;
                let [mut re, mut im] = [0.0; 2];
                for (n, x) in sound[19_200..43_200].iter().enumerate() {
                    let (sin, cos) = (turn * n as f64).sin_cos();
                    (re, im) = (re + x * cos, im + x * sin);
                }
                10.0 * (re * re + im * im + 1e-9).log10()
            })
        })
    };
    let [left, right] = heard("--tracks --spread 0 --set life=0 --set seats=0");
    assert!((left[0] - right[0]).abs() < 0.5, "the first track in the middle: {left:?} {right:?}");
    assert!(right[1] > left[1] + 20.0, "the second where its pan is: {left:?} {right:?}");
    let [left, right] = heard("--tracks --spread 0 --set life=0 --set seats=70");
    assert!(left[0] > right[0] + 3.0, "the first of two sits to the left: {left:?} {right:?}");
    assert!(right[1] > left[1] + 20.0, "the second to the right: {left:?} {right:?}");
    refused(&d, "render duet.mid --tracks --players 2 --out x.wav", &["--tracks", "players"]);
    refused(&d, "render --written C4 --tracks --out x.wav", &["--tracks needs a MIDI file"]);
    succeeds(d.path(), "render chord.mid --tracks --out one.wav");
}

#[test]
fn a_trim_moves_its_note_alone() {
    let d = tempfile::tempdir().unwrap();
    let hz = |note: &str, flags: &str| {
        let line =
            format!("render --written {note} --gamma 0.5 --no-noise --tempered --seconds 1 --rate 48000");
        succeeds(d.path(), &format!("{line} --force --out t.wav {flags}"));
        let wav = hound::WavReader::open(d.path().join("t.wav")).unwrap();
        let sound: Vec<f64> = wav.into_samples::<f32>().map(|sample| f64::from(sample.unwrap())).collect();
        let near = chalumeau_core::units::SoundingNote(58).frequency_hz(440.0);
        let near = if note == "C4" { near } else { near * 2.0_f64.powf(1.0 / 6.0) };
        chalumeau_core::analysis::pitch::refine_hz(&sound[19_200..], 48_000.0, near).unwrap()
    };
    let cents = |note: &str, flags: &str| 1_200.0 * (hz(note, flags) / hz(note, "")).log2();
    let moved = cents("C4", "--trim C4=-12.5,E4=3");
    assert!((moved + 12.5).abs() < 0.5, "{moved}");
    let beside = cents("D4", "--trim C4=-12.5");
    assert!(beside.abs() < 0.05, "{beside}");
    for (trim, says) in [
        ("C4", "E4=-12"),
        ("H4=3", "MIDI number"),
        ("C4=80", "-50..50"),
        ("C2=1", "no fingering"),
        ("C4=1,C4=2", "two values"),
    ] {
        refused(&d, &format!("render --written C4 --out x.wav --trim {trim}"), &[says]);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_rendering_leaves_nothing_behind() {
    use std::time::{Duration, Instant};

    let d = tempfile::tempdir().unwrap();
    let mut rendering = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(d.path())
        .env("CHALUMEAU_CACHE_DIR", env!("CARGO_TARGET_TMPDIR"))
        .args(words("render --written C4 --seconds 3000 --out long.wav"))
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while names(d.path()).is_empty() {
        assert!(rendering.try_wait().unwrap().is_none(), "it ended by itself");
        assert!(begun.elapsed() < Duration::from_secs(60), "it wrote nothing");
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(names(d.path())[0].ends_with(".part"), "{:?}", names(d.path()));
    let killed = Command::new("kill").args(["-INT", &rendering.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert_eq!(rendering.wait().unwrap().code(), Some(130));
    assert_eq!(names(d.path()), Vec::<String>::new());
}

const EXAMPLE_INSTRUMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/instruments");

#[test]
fn fingerings_of_the_chart_are_listed_and_holes_that_no_finger_moves_are_named() {
    let d = tempfile::tempdir().unwrap();
    succeeds(d.path(), "instrument new --notes D3,E3,F3,G3,A3,B3,C4,D4,E4 --out new.toml");
    for (line, unmoved, yes) in [
        ("--instrument alto-chalumeau.toml --note C4", Some("K1 K2"), 1),
        ("--instrument cylinder.toml --note E3", None, 1),
        ("--instrument new.toml --note E3", None, 1),
        ("--instrument alto-chalumeau.toml --multiphonic", Some("K1 K2"), 0),
        ("--instrument b-flat --note C4 --count 3", None, 1),
    ] {
        let line = line.replace("--instrument ", &format!("--instrument {EXAMPLE_INSTRUMENTS}/"));
        let line = line.replace(&format!("{EXAMPLE_INSTRUMENTS}/b-flat"), "b-flat");
        let line = line.replace(&format!("{EXAMPLE_INSTRUMENTS}/new.toml"), "new.toml");
        let output = chalumeau(d.path(), words(&format!("fingerings {line}")));
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{line}: {message}");
        match unmoved {
            Some(holes) => {
                assert!(message.contains(&format!("{holes} cannot be moved")), "{line}: {message}")
            }
            None => assert_eq!(message, "", "{line}"),
        }
        let rows = String::from_utf8(output.stdout).unwrap();
        assert_eq!(rows.lines().filter(|row| row.ends_with(",yes")).count(), yes, "{line}: {rows}");
    }
}

#[test]
fn silence_has_no_pitch() {
    let d = tempfile::tempdir().unwrap();
    for (n, blown) in ["--gamma 0", "--gamma 0.2 --no-noise"].iter().enumerate() {
        succeeds(d.path(), &format!("report --written C4 {blown} --seconds 1 --out {n}.html"));
        let page = fs::read_to_string(d.path().join(format!("{n}.html"))).unwrap();
        assert!(page.contains("No note has a pitch"), "{blown}");
    }
}

#[test]
fn options_that_would_do_nothing_are_refused() {
    let d = tempfile::tempdir().unwrap();
    fs::copy(MELODY, d.path().join("melody.mid")).unwrap();
    for (line, says) in [
        ("impedance --all", "add --peaks 8"),
        ("impedance --all --peaks 3 --from 1000", "--peaks finds peaks wherever they are"),
        ("radiation --written F4 --width 70", "add --heard position"),
        ("radiation --written F4 --heard point --distance 2", "add --heard position"),
        ("reed --law --gamma 0.5", "--gamma"),
        ("reed --table --zeta 0.2", "--zeta"),
        ("reed --figure unit --gamma 0.5 --out unit.svg", "--figure orbit"),
        ("reed --figure unit --instrument bass --out unit.svg", "--figure orbit"),
        ("reed --law --out z.png", "--law"),
        ("reed --law --instrument none", "--figure orbit"),
        ("reed --table --reed-stiffness 1500", "--law and --physical"),
        ("reed --table --quality high --untuned", "--figure orbit"),
        ("reed --figure unit --out u.png --format svg", "files in a directory"),
        ("instrument new --notes D3,E3 --instrument bass --out x.toml", "--scale in place of --notes"),
        ("render --written C4 --contrast 2 --out x.wav", "add --replay"),
        ("render --written C4 --law pressure --out x.wav", "add --replay"),
        ("render --written C4 --unison --out x.wav", "add --players"),
        ("render --written C4 --set split=unison --out x.wav", "--set split is for several players"),
        ("tune --written C4 --players 2", "--players does nothing here"),
        ("tune --written C4 --room 0.5", "--room does nothing here"),
        ("bifurcation --written C4 --set room=50", "--set room does nothing here"),
        ("tune --written C4 --set transp=-2", "--set transp does nothing here"),
        ("fingerings --note E3 --trill-to 52", "a trill needs two notes"),
        ("fingerings", "--multiphonic"),
        ("render melody.mid --slurred --out x.wav", "--slurred"),
        ("render --written C4 --slurred --out x.wav", "--slurred"),
    ] {
        refused(&d, line, &[says]);
    }
    succeeds(d.path(), "radiation --written F4 --heard position --width 70");
    succeeds(d.path(), "reed --physical --zeta 0.2");
    let output =
        chalumeau(d.path(), words("render --written C4 --seconds 0.1 --room 0.5 --channels 1 --out x.wav"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("with --channels 1 no room is heard"));
}

#[test]
fn a_parameter_of_the_measured_reed_is_the_plugins_on_every_instrument() {
    let d = tempfile::tempdir().unwrap();
    let rendered = |set: &str| {
        succeeds(
            d.path(),
            &format!("render --instrument bass --written C4 --seconds 0.2 --set {set} --force --out x.wav"),
        );
        fs::read(d.path().join("x.wav")).unwrap()
    };
    // What the parameter has by itself, as on a B flat clarinet.
    assert!(rendered("rface=measured") == rendered("ropen=0.5"));
}

#[test]
fn a_batch_tells_which_files_are_not_as_played() {
    let d = tempfile::tempdir().unwrap();
    let plan =
        "same = { seconds = 0.3, dynamic = \"ff\", gain-db = 24 }\nvary = { written = [\"E6\", \"C4\"] }\n";
    fs::write(d.path().join("plan.toml"), plan).unwrap();
    let output = chalumeau(d.path(), words("batch plan.toml --into set"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("2 files (0001.wav and others): the limiter turned peaks down"), "{said}");
}

#[cfg(feature = "simulator")]
#[test]
fn a_simulated_knob_does_not_write_over_the_hand_that_it_reads() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("hand.csv"), "kept").unwrap();
    refused(&d, "knob-sim --script hand.csv --log hand.csv", &["is read by this command"]);
    assert_eq!(fs::read_to_string(d.path().join("hand.csv")).unwrap(), "kept");
}

#[test]
fn silence_has_no_pitch_and_no_beginning() {
    let d = tempfile::tempdir().unwrap();
    for silent in ["--gamma 0", "--dynamic 0 --A 0", "--gamma 0 --gain-db 24"] {
        let rows = succeeds(d.path(), &format!("tune --written C5 {silent}"));
        assert_eq!(rows.lines().last(), Some("C5,72,nan,nan,0,nan"), "{silent}");
    }
    let soft = succeeds(d.path(), "tune --written E3 --dynamic pp --gain-db -60");
    assert!(soft.lines().last().unwrap().ends_with(|of: char| of.is_ascii_digit()), "{soft}");
    assert!(soft.lines().last().unwrap().contains(",1,"), "{soft}");
    let ramp = succeeds(d.path(), "bifurcation --written C5 --A 0 --seconds 0.5");
    assert!(ramp.contains("no linear threshold, does not begin up to gamma 2"), "{ramp}");
    let realism = succeeds(d.path(), "realism --gamma 0,0,0 --takes 1");
    assert!(!realism.contains("NaN") && realism.contains("median ratio none"), "{realism}");
}

#[test]
fn a_scale_that_leads_out_of_the_instrument_is_told() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("fifths.scl"), "fifths\n1\n3/2\n").unwrap();
    // Of these, middle C and its fifth are on the clarinet; the others are above it, and above MIDI.
    fs::write(d.path().join("keys.mid"), one_after_another(&[60, 61, 66, 90])).unwrap();
    let output = chalumeau(d.path(), words("render keys.mid --scl fifths.scl --out x.wav"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("1 note has no fingering and stays silent (F#7)"), "{message}");
    assert!(
        message.contains("gives 1 key no pitch within the range of MIDI, and it stays silent (F#6)"),
        "{message}"
    );
}

/// A MIDI file with these messages and their delta times.
fn with_messages(messages: &[u8]) -> Vec<u8> {
    one_track(&[messages, &[0, 0xFF, 0x2F, 0]])
}

#[test]
fn notes_without_length_and_a_tempo_without_time_are_told() {
    let d = tempfile::tempdir().unwrap();
    // A note of no length, and one that is heard.
    let notes = [0, 0x90, 60, 64, 0, 0x80, 60, 0, 96, 0x90, 62, 64, 96, 0x80, 62, 0];
    fs::write(d.path().join("brief.mid"), with_messages(&notes)).unwrap();
    let output = chalumeau(d.path(), words("render brief.mid --out x.wav"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("1 note is no more than a moment long: beginning and end lie at the same time"),
        "{message}"
    );
    // Two at once, too.
    let two =
        [0, 0x90, 60, 64, 0, 0x90, 62, 64, 0, 0x80, 60, 0, 0, 0x80, 62, 0, 96, 0x90, 64, 64, 96, 0x80, 64, 0];
    fs::write(d.path().join("two.mid"), with_messages(&two)).unwrap();
    let output = chalumeau(d.path(), words("render two.mid --out x.wav --force"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("2 notes are no more than a moment long"), "{message}");
    // Of a chord, the last is heard.
    let chord = [0, 0x90, 60, 64, 0, 0x90, 62, 64, 96, 0x80, 60, 0, 0, 0x80, 62, 0];
    fs::write(d.path().join("chord.mid"), with_messages(&chord)).unwrap();
    let output = chalumeau(d.path(), words("render chord.mid --out x.wav --force"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("1 note is never heard: another begins in the same moment"), "{message}");
    let stopped = [&[0, 0xFF, 0x51, 3, 0, 0, 0], &notes[..]].concat();
    fs::write(d.path().join("stopped.mid"), with_messages(&stopped)).unwrap();
    let output = chalumeau(d.path(), words("render stopped.mid --out y.wav"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("track 1 has a tempo of 0 us for a beat at tick 0"), "{message}");
    assert!(!output.status.success() && !d.path().join("y.wav").exists());
    let tracks = chalumeau(d.path(), words("render stopped.mid --tracks --out y.wav"));
    assert!(String::from_utf8(tracks.stderr).unwrap().contains("has a tempo of 0 us"));
}

#[test]
fn a_room_dies_away_before_the_file_ends() {
    let d = tempfile::tempdir().unwrap();
    let length = |more: &str| {
        let line = format!(
            "render --written C4 --seconds 0.2 --room 0.5 --room-decay 0.8 --out x.wav --force{more}"
        );
        let output = chalumeau(d.path(), words(&line));
        let message = String::from_utf8(output.stderr).unwrap();
        message.lines().find(|line| line.starts_with("x.wav: ")).expect(&message).to_owned()
    };
    assert!(length("").starts_with("x.wav: 1.000 s"), "{}", length(""));
    assert!(length(" --tail 0").starts_with("x.wav: 0.200 s"));
}

#[test]
fn a_report_warns_as_a_rendering_does() {
    let d = tempfile::tempdir().unwrap();
    let line = "report --written C4 --gamma 2.5 --seconds 0.7 --vibrato-rate 6 --out x.html";
    let output = chalumeau(d.path(), words(line));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("warning: no tone is heard"), "{message}");
    assert!(message.contains("--vibrato-rate has no effect"), "{message}");
    let page = fs::read_to_string(d.path().join("x.html")).unwrap();
    let row = page.split("C#7</").nth(1).expect("C#7 is in the table of pressures");
    assert!(row[..row.find("</tr>").unwrap()].contains("never"), "a silent key does not speak");
}

#[test]
fn help_names_what_the_command_has() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("same.toml"), "[same]\nset = [\"vent=2\"]\n[vary]\nwritten = [\"C4\"]\n")
        .unwrap();
    for (line, says) in [
        ("haptic --torque 400", "lower --torque to 69 mNm or less, lower --contrast, or raise --ceiling"),
        ("haptic --place 5 --law pressure --zeta 0.1", "--place, raise --zeta"),
        ("render --written C4 --breath= --out x.wav", "--breath is empty"),
        (
            "render --sounding 127 --out x.wav",
            "sounding 127 (G9) has no fingering; this instrument sounds 50 (D3) to 95 (B6)",
        ),
        (
            "render --sounding C9 --out x.wav",
            "sounding 120 (C9) has no fingering; this instrument sounds 50 (D3) to 95 (B6)",
        ),
        ("render --written C4 --breath ramp:0:1e300:1 --out x.wav", "gamma must lie in 0..3, got 1e300"),
        ("instrument new --notes A0 --out a0.toml", "A0 needs a bore 3015 mm long"),
        ("batch same.toml --into set", "set in [same] must be a number, a text in quotes, true or false"),
        ("realism --dynamic pp,mf,loud", "or one of pp, p, mp, mf, f, ff"),
    ] {
        refused(&d, line, &[says]);
    }
    // What is beside the page is beside it under any name.
    let wav = d.path().join("x.wav");
    let line = ["report", "--written", "C4", "--seconds", "0.2", "--out", "x.html", "--wav"].map(OsStr::new);
    let output = chalumeau(d.path(), line.into_iter().chain([wav.as_os_str()]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn negative_numbers_out_of_range_say_what_would_be_right() {
    let d = tempfile::tempdir().unwrap();
    for (line, says) in [
        ("render --written C4 --gamma -1 --out x.wav", "must lie in 0..3"),
        ("render --written C4 --zeta -0.1 --out x.wav", "must lie in 0.05..0.9"),
        ("render --written -5 --out x.wav", "must be a MIDI number"),
        ("threshold --temperature -10", "must lie in 10..40"),
        ("instrument new --scale -2 --out x.toml", "must lie in 0.2..5"),
    ] {
        refused(&d, line, &[says]);
    }
}

#[test]
fn a_scale_that_no_file_can_hold_says_which_one_it_can() {
    let d = tempfile::tempdir().unwrap();
    for scale in ["5", "2.56", "0.25", "0.2"] {
        let line = format!("instrument new --scale {scale} --out x.toml");
        let given = format!("--scale {scale} makes");
        let says = [given.as_str(), "reed_volume_mm3", "scaled by 0.26 to 2.55"];
        refused(&d, &line, &says);
    }
    succeeds(d.path(), "instrument new --scale 2.55 --out large.toml");
    succeeds(d.path(), "instrument new --scale 0.26 --out small.toml");
}

#[test]
fn a_note_that_stays_silent_is_told_where_it_is_rendered() {
    let d = tempfile::tempdir().unwrap();
    let output = chalumeau(d.path(), words("render --written C#7 --seconds 0.1 --out x.wav"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("does not speak in tune on this instrument"), "{message}");
    // The theory knows nothing of it.
    let rows = succeeds(d.path(), "haptic --written C#7");
    assert!(rows.lines().last().unwrap().starts_with("\"C#7\",97,0.4"), "{rows}");
}

#[test]
fn one_is_not_several() {
    let d = tempfile::tempdir().unwrap();
    let made = chalumeau(d.path(), words("instrument new --notes D3,E3 --transposition -3 --out one.toml"));
    let message = String::from_utf8(made.stderr).unwrap();
    assert!(message.contains("1 hole, 2 notes "), "{message}");
    let shown = succeeds(d.path(), "instrument show --instrument one.toml");
    assert!(shown.contains("sounds 3 semitones above what is written"), "{shown}");
    fs::write(d.path().join("low.mid"), one_after_another(&[40])).unwrap();
    let output = chalumeau(d.path(), words("render low.mid --out x.wav"));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("1 note has no fingering and stays silent"), "{message}");
    // The summary of a command is its first paragraph.
    let help = succeeds(d.path(), "instrument import -h");
    assert!(help.starts_with("Make an instrument file from three CSV tables\n\n"), "{help}");
}

#[test]
fn a_cache_that_cannot_be_written_is_told_once() {
    let d = tempfile::tempdir().unwrap();
    fs::write(d.path().join("in-the-way"), "a file").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_chalumeau"))
        .current_dir(d.path())
        .env("CHALUMEAU_CACHE_DIR", "in-the-way")
        .args(words("render --written E3 --seconds 0.05 --out x.wav --instrument"))
        .arg(Path::new(EXAMPLE_INSTRUMENTS).join("cylinder.toml"))
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{message}");
    assert!(message.contains("in-the-way"), "{message}");
    assert_eq!(message.matches("cannot be written").count(), 1, "{message}");
}
