//! What commands measure and say of it is what sounds.

use super::*;

/// The text of standard error of a command that succeeds.
#[track_caller]
fn told(directory: &Path, line: &str) -> String {
    let output = chalumeau(directory, words(line));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{line}: {said}");
    said
}

/// A reed that the lip hardly damps squeaks, and a loose lip lets a note fall by a twelfth.
#[test]
fn a_report_has_the_pitch_that_sounds() {
    let d = tempfile::tempdir().unwrap();
    for (note, blown, cents) in [
        ("G#3", "--damping 0.2 --gamma 0.9", 2_700.0..2_850.0),
        ("B5", "--zeta 0.9 --gamma 0.9", -1_960.0..-1_840.0),
    ] {
        let tuned = succeeds(d.path(), &format!("tune --written {note} {blown} --no-noise"));
        let off: f64 = tuned.lines().last().unwrap().split(',').nth(3).unwrap().parse().unwrap();
        assert!(cents.contains(&off), "{note}: {off}");
        let line = format!("report --written {note} {blown} --seconds 1.5 --no-noise --force --out x.html");
        succeeds(d.path(), &line);
        let page = fs::read_to_string(d.path().join("x.html")).unwrap();
        let said = page.split("1 sounds another note, ").nth(1).unwrap().split(' ').next().unwrap();
        let reported: f64 = said.parse().unwrap();
        assert!((reported - off).abs() < 10.0, "{note}: {reported}, tune {off}");
    }
}

/// A piece that was rendered is measured note by note, as it was written down.
#[test]
fn the_notes_of_a_recording_are_those_that_were_played() {
    let d = tempfile::tempdir().unwrap();
    let smf = fs::read(MELODY).unwrap();
    let smf = midly::Smf::parse(&smf).unwrap();
    let played: Vec<u8> = (smf.tracks.iter().flatten())
        .filter_map(|event| match event.kind {
            midly::TrackEventKind::Midi { message: midly::MidiMessage::NoteOn { key, vel }, .. }
                if vel > 0 =>
            {
                Some(key.as_int())
            }
            _ => None,
        })
        .collect();
    succeeds(d.path(), &format!("render {MELODY} --out melody.wav"));
    let table = succeeds(d.path(), "measure melody.wav --csv - --plot melody.svg");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| line.split(',').collect())
        .collect();
    let heard: Vec<u8> = rows.iter().map(|row| row[2].parse().unwrap()).collect();
    assert_eq!(heard, played);
    for row in &rows {
        assert!(row[5].parse::<f64>().unwrap().abs() < 5.0, "{row:?}");
        assert_eq!(row.len(), 21);
    }
    assert!(fs::read_to_string(d.path().join("melody.svg")).unwrap().contains("melody.wav"));

    let part = succeeds(d.path(), "measure melody.wav --from 16 --to 18");
    assert!(part.lines().nth(2).unwrap().starts_with("16."), "{part}");
    fs::write(d.path().join("song.mp3"), "ID3").unwrap();
    refused(&d, "measure song.mp3", &["song.mp3", "not a WAV file", "converted first"]);
    refused(&d, "measure none.wav", &["none.wav", "cannot be read"]);
    refused(&d, "measure melody.wav --channel 2", &["1 channel, and channel 2"]);
    refused(&d, "measure melody.wav --from 99", &["29.20 s", "nothing of it"]);
    refused(&d, "measure melody.wav --from 5 --to 4", &["--to 4 must lie after --from 5"]);
    refused(&d, "measure melody.wav --csv melody.wav --force", &["melody.wav is read by this command"]);
    let quiet = told(d.path(), "measure melody.wav --to 0.2 --csv none.csv");
    assert!(quiet.contains("no note was found"), "{quiet}");
}

/// Of C4 E4 G4 struck together only G4 is heard, or C4 after it if it lasts longer; of D4 and E4 a moment later both are.
#[test]
fn notes_that_chords_hide_are_told() {
    use midly::{Format, Header, MetaMessage, MidiMessage, Smf, Timing, TrackEvent, TrackEventKind};
    let d = tempfile::tempdir().unwrap();
    let on = |delta: u32, key: u8, vel: u8| TrackEvent {
        delta: delta.into(),
        kind: TrackEventKind::Midi {
            channel: 0.into(),
            message: MidiMessage::NoteOn { key: key.into(), vel: vel.into() },
        },
    };
    let end = TrackEvent { delta: 0.into(), kind: TrackEventKind::Meta(MetaMessage::EndOfTrack) };
    let write = |name: &str, chord: &[u8], longer: u32| {
        let mut track: Vec<_> = chord.iter().map(|&key| on(0, key, 80)).collect();
        track.push(on(96, chord[chord.len() - 1], 0));
        track.push(on(longer, chord[0], 0));
        track.extend(chord[1..].iter().map(|&key| on(0, key, 0)));
        track.extend([on(96, 62, 80), on(10, 64, 80), on(96, 62, 0), on(0, 64, 0), end]);
        let header = Header::new(Format::SingleTrack, Timing::Metrical(96.into()));
        Smf { header, tracks: vec![track] }.save(d.path().join(name)).unwrap();
    };
    write("chord.mid", &[60, 64, 67], 0);
    write("longer.mid", &[60, 64, 67], 96);
    write("two.mid", &[60, 64], 0);
    write("below.mid", &[60, 64], 96);
    write("note.mid", &[60], 0);
    let said = told(d.path(), "render chord.mid --out x.wav --force");
    assert!(said.contains("warning: 2 notes are never heard"), "{said}");
    for one in ["two", "longer"] {
        let said = told(d.path(), &format!("render {one}.mid --out x.wav --force"));
        assert!(said.contains("warning: 1 note is never heard"), "{one}: {said}");
    }
    for none in ["note", "below"] {
        let said = told(d.path(), &format!("render {none}.mid --out x.wav --force"));
        assert!(!said.contains("never heard"), "{none}: {said}");
    }
    refused(&d, "tune --written E3 --csv x.wav --force", &["x.wav", "would be a sound", ".csv"]);
    refused(&d, "parameters --csv x.png", &["x.png", "would be a picture", ".csv"]);
}

/// What a fingering's row says can be written into an instrument file.
#[test]
fn fingerings_count_resonances_as_instrument_files_do() {
    let d = tempfile::tempdir().unwrap();
    let shown = succeeds(d.path(), "instrument show");
    for note in some(["E3", "G4", "A#4", "B4", "C6", "C#6", "F6", "G6"].to_vec(), 2) {
        let peak = format!("note,{note},");
        let of_file = shown.lines().find(|line| line.replace('"', "").starts_with(&peak)).unwrap();
        let mode = of_file.split("peak ").nth(1).unwrap().split(':').next().unwrap();
        let rows = succeeds(d.path(), &format!("fingerings --note {note}"));
        let of_chart = rows.lines().find(|row| row.ends_with(",yes")).unwrap();
        // Fingers and open holes have no commas.
        assert_eq!(of_chart.split(',').nth(4), Some(mode), "{note}: {of_chart}");
    }
}

#[test]
fn the_facing_of_a_measured_reed_is_as_wide_as_its_own_opening_has_it() {
    let d = tempfile::tempdir().unwrap();
    let millimetres = |reed: &str| -> f64 {
        let table = succeeds(d.path(), &format!("reed --physical {reed}"));
        let line = table.lines().find(|line| line.contains(",lay,")).unwrap();
        line.split(',').nth(2).unwrap().parse().unwrap()
    };
    assert!((millimetres("--reed-opening 0.6") / millimetres("--reed-opening 0.4") - 1.5).abs() < 1e-6);
}

/// A table of zeros would look as if it had been measured.
#[test]
fn a_silent_key_has_no_bifurcation() {
    let d = tempfile::tempdir().unwrap();
    refused(
        &d,
        "bifurcation --written C#7 --seconds 0.5 --csv x.csv",
        &["the key of C#7 is silent on this instrument"],
    );
}

#[test]
fn settings_without_an_effect_are_told() {
    let d = tempfile::tempdir().unwrap();
    let note = "render --written C4 --seconds 0.05 --force --out x.wav";
    for (idle, why) in [
        ("--gamma 0.5 --breath-curve 2", "--breath-curve has no effect: it is for a breath that is played"),
        (
            "--dynamic mf --breath-full 8",
            "--breath-full has no effect: it is for a breath that is a pressure",
        ),
        ("--vibrato-rate 6", "--vibrato-rate has no effect: it is for a vibrato"),
        ("--growl-interval 7", "add --growl"),
        ("--set rsize=20", "--set rsize has no effect: it is for a room"),
        ("--set ldist=2", "add --set heard=position"),
        ("--seats 0.3", "add --players"),
    ] {
        let said = told(d.path(), &format!("{note} {idle}"));
        assert!(said.contains(why) && said.matches("warning").count() == 1, "{idle}: {said}");
    }
    for works in [
        "--dynamic mf --breath-curve 2",
        "--gamma 0.5 --breath-full 8",
        "--vibrato 0.5 --vibrato-rate 6",
        "--growl 0.5 --growl-interval 7",
        "--room 0.2 --set rsize=20",
        "--set heard=position --set ldist=2",
        "--players 2 --seats 0.3",
    ] {
        let said = told(d.path(), &format!("{note} {works}"));
        assert!(!said.contains("no effect"), "{works}: {said}");
    }
    // The wheel of a file may make the vibrato; no controller makes a room.
    fs::copy(MELODY, d.path().join("melody.mid")).unwrap();
    let said = told(d.path(), "render melody.mid --vibrato-rate 6 --set rsize=20 --out m.wav");
    assert!(!said.contains("vibrato") && said.contains("--set rsize has no effect"), "{said}");
    // In a batch once, and where it is so in every file.
    let plan = "same = { seconds = 0.02, written = \"C4\" }\nvary = { room = [0, 0.2], rsize = [8, 20], vibhz = [4, 5] }\n";
    fs::write(d.path().join("plan.toml"), plan).unwrap();
    let said = told(d.path(), "batch plan.toml --into set");
    assert!(said.matches("no effect").count() == 1 && said.contains("in every file, --set vibhz"), "{said}");
}

/// The same number means the same pressure in `render` and `tune`, whatever preset plays.
#[test]
fn gamma_is_a_pressure_with_every_preset() {
    let d = tempfile::tempdir().unwrap();
    users_presets(d.path());
    let render = |more: &[&str]| {
        let note = ["render", "--written", "G3", "--seconds", "0.3", "--force", "--out", "x.wav"];
        let (code, _, said) = with_presets(d.path(), &[&note[..], &["--preset", "My jazz"], more].concat());
        assert_eq!(code, Some(0), "{said}");
        fs::read(d.path().join("x.wav")).unwrap()
    };
    let blown = render(&["--gamma", "0.6"]);
    assert_eq!(blown, render(&["--gamma", "0.6", "--breath-response", "physical"]));
    let share = render(&["--gamma", "0.6", "--breath-response", "played"]);
    assert_eq!(share, render(&["--crescendo", "0.6:0.6"]));
    assert_ne!(blown, share);
    // More than closing pressure is a pressure, too.
    assert_ne!(blown, render(&["--gamma", "1.2"]));
}

#[test]
fn a_broken_preset_is_told_and_not_called_missing() {
    let d = tempfile::tempdir().unwrap();
    users_presets(d.path());
    let bad = ["render", "--written", "G3", "--preset", "Bad", "--out", "x.wav"];
    let (code, _, said) = with_presets(d.path(), &bad);
    assert!(
        code == Some(2) && said.contains("bad.toml: line 4") && !said.contains("there is no preset"),
        "{said}"
    );
}
