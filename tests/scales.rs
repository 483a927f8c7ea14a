//! Scala scales and keyboard mappings: every key sounds where its scale says, and damaged files are told.

#[path = "support/parallel.rs"]
mod parallel;

use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

use chalumeau::scale_file;
use chalumeau_core::analysis::{pitch, to_f64};
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Clarinet, KeyPitches, Model, Settings};
use chalumeau_core::units::{SoundingNote, cents};
use parallel::each;

const RATE_HZ: f64 = 48_000.0;
/// Middle C where A4 is 440 Hz.
const C4_HZ: f64 = 261.625_565_300_598_6;

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

/// A scale, what its pitches are (cents over middle C, or as ratios), and its period in keys.
struct Case {
    name: &'static str,
    scl: String,
    kbm: Option<&'static str>,
    /// Frequency of a key.
    hz: Box<dyn Fn(i32) -> Option<f64> + Sync + Send>,
}

/// Steps of a scale in cents, the last one being the period, from middle C.
fn by_cents(name: &'static str, steps: Vec<f64>) -> Case {
    let lines: Vec<_> = steps.iter().map(|step| format!(" {step:.5}")).collect();
    let scl = format!("! {name}.scl\n!\n{name}\n {}\n!\n{}\n", steps.len(), lines.join("\n"));
    let hz = move |key: i32| {
        let (period, degree) =
            ((key - 60).div_euclid(steps.len() as i32), (key - 60).rem_euclid(steps.len() as i32));
        let within = if degree == 0 { 0.0 } else { steps[degree as usize - 1] };
        Some(C4_HZ * ((within + f64::from(period) * steps[steps.len() - 1]) / 1_200.0).exp2())
    };
    Case { name, scl, kbm: None, hz: Box::new(hz) }
}

fn by_ratios(name: &'static str, ratios: &'static [(&'static str, f64)]) -> Case {
    let lines: Vec<_> = ratios.iter().map(|(text, _)| *text).collect();
    let scl = format!("{name}\n{}\n{}\n", ratios.len(), lines.join("\n"));
    let steps: Vec<f64> = ratios.iter().map(|(_, ratio)| 1_200.0 * ratio.log2()).collect();
    Case { scl, ..by_cents(name, steps) }
}

fn equal(name: &'static str, steps: usize, period: f64) -> Case {
    by_cents(name, (1..=steps).map(|step| period * step as f64 / steps as f64).collect())
}

fn cases() -> Vec<Case> {
    // Fifths of a quarter of a comma too narrow, from E flat to G sharp.
    let meantone = |places: &[i32]| {
        let fifth = 300.0 * 5.0_f64.log2();
        let mut steps: Vec<f64> =
            places.iter().map(|place| (f64::from(*place) * fifth).rem_euclid(1_200.0)).collect();
        steps.push(1_200.0);
        steps
    };
    let just: &[(&str, f64)] = &[
        ("16/15", 16.0 / 15.0),
        ("9/8 ! a comment after the pitch", 9.0 / 8.0),
        ("6/5", 1.2),
        ("5/4", 1.25),
        ("4/3", 4.0 / 3.0),
        ("45/32", 45.0 / 32.0),
        ("3/2", 1.5),
        ("8/5", 1.6),
        ("5/3", 5.0 / 3.0),
        ("9/5", 1.8),
        ("15/8", 15.0 / 8.0),
        ("2", 2.0),
    ];
    let bohlen_pierce: &[(&str, f64)] = &[
        ("27/25", 27.0 / 25.0),
        ("25/21", 25.0 / 21.0),
        ("9/7", 9.0 / 7.0),
        ("7/5", 1.4),
        ("75/49", 75.0 / 49.0),
        ("5/3", 5.0 / 3.0),
        ("9/5", 1.8),
        ("49/25", 1.96),
        ("15/7", 15.0 / 7.0),
        ("7/3", 7.0 / 3.0),
        ("63/25", 63.0 / 25.0),
        ("25/9", 25.0 / 9.0),
        ("3/1", 3.0),
    ];
    // White keys in seven equal steps of an octave from A at 432 Hz; black keys play nothing.
    let white = "! white.kbm\n12\n0\n127\n69\n69\n432.0\n7\n0\nx\n1\n2\nx\n3\nx\n4\n5\nx\n6\nx\n";
    let white_keys = Case {
        kbm: Some(white),
        hz: Box::new(|key| {
            let degrees =
                [Some(0), None, Some(1), Some(2), None, Some(3), None, Some(4), Some(5), None, Some(6), None];
            let (octave, place) = ((key - 69).div_euclid(12), (key - 69).rem_euclid(12));
            let degree = degrees[place as usize]? + 7 * octave;
            Some(432.0 * (f64::from(degree) / 7.0).exp2())
        }),
        ..equal("seven equal, white keys, A at 432", 7, 1_200.0)
    };
    // Scala's usual mapping: the map begins at middle C, and the reference key is A. A size of 0 is a map of all keys.
    let usual = "! usual.kbm\n12\n0\n127\n60\n69\n440.0\n12\n0\n1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n11\n";
    let far = "! far.kbm\n12\n0\n127\n84\n69\n440.0\n12\n0\n1\n2\n3\n4\n5\n6\n7\n8\n9\n10\n11\n";
    let all_keys = "0\n0\n127\n60\n69\n440.0\n12\n";
    let from_a = |name: &'static str, of: Case, kbm: &'static str| {
        let over_a = 440.0 / (of.hz)(69).unwrap();
        let hz = of.hz;
        Case { name, kbm: Some(kbm), hz: Box::new(move |key| Some(over_a * hz(key)?)), scl: of.scl }
    };
    vec![
        from_a("just, usual mapping", by_ratios("just", just), usual),
        from_a("just, all keys", by_ratios("just", just), all_keys),
        from_a("just, map far above its reference key", by_ratios("just", just), far),
        from_a("twelve equal, usual mapping", equal("twelve equal", 12, 1_200.0), usual),
        from_a("stretched octaves from A", equal("stretched octaves", 12, 1_210.0), usual),
        by_cents("quarter-comma meantone", meantone(&[7, 2, -3, 4, -1, 6, 1, 8, 3, -2, 5])),
        by_cents("Pythagorean", {
            let fifth = 1_200.0 * 1.5_f64.log2();
            let mut steps: Vec<f64> = [7, 2, -3, 4, -1, 6, 1, 8, 3, -2, 5]
                .map(|n| (f64::from(n) * fifth).rem_euclid(1_200.0))
                .to_vec();
            steps.push(1_200.0);
            steps
        }),
        by_ratios("just", just),
        by_ratios("Bohlen-Pierce", bohlen_pierce),
        equal("nineteen equal", 19, 1_200.0),
        equal("quarter tones", 24, 1_200.0),
        equal("five equal", 5, 1_200.0),
        equal("stretched octaves", 12, 1_210.0),
        // Steps that fall and rise again.
        by_cents("not in order", vec![300.0, 100.0, 701.955, 498.045, 1_200.0]),
        white_keys,
    ]
}

/// Reads a scale as a user's files have it.
fn read(scl: &[u8], kbm: Option<&str>) -> Result<KeyPitches, String> {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    let scl = put("x.scl", scl);
    let kbm = kbm.map(|text| put("x.kbm", text.as_bytes()));
    scale_file::read(&scl, kbm.as_deref())
        .map_err(|error| error.to_string().replace(&folder.path().display().to_string(), ""))
}

#[test]
fn every_key_sounds_where_its_scale_says() {
    let mut asked: Vec<(String, f64, Arc<Model>, u8)> = Vec::new();
    for case in cases() {
        let keys =
            read(case.scl.as_bytes(), case.kbm).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        for key in 0..128_u8 {
            let (found, wanted) = (keys.of(SoundingNote(key)), (case.hz)(i32::from(key)));
            let Some(hz) = wanted else {
                assert_eq!(found, None, "{} key {key}", case.name);
                continue;
            };
            let Some(found) = found else {
                assert!(!(8.0..12_900.0).contains(&hz), "{} key {key}", case.name);
                continue;
            };
            let off = cents(found.note.frequency_hz(440.0), hz) + found.cents;
            assert!(off.abs() < 2e-5, "{} key {key}: {off}", case.name);
        }
        let mut model = MODEL.clone();
        Arc::make_mut(&mut model).keys = keys;
        // Some keys of the range of chalumeau and clarion, heard.
        for key in (30..110).step_by(7) {
            let hz = (case.hz)(i32::from(key)).unwrap_or(0.0);
            if (150.0..900.0).contains(&hz) {
                asked.push((format!("{} key {key}", case.name), hz, model.clone(), key));
            }
        }
    }
    let heard = each(&asked, |(_, hz, model, key)| {
        let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
        clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(Event::NoteOn { note: SoundingNote(*key), velocity: 0.7 });
        let mut out = vec![0.0; RATE_HZ as usize];
        clarinet.render(&mut out);
        let sound = to_f64(&out[RATE_HZ as usize / 2..]);
        pitch::refine_hz(&sound, RATE_HZ, *hz).map_or(f64::NAN, |found| cents(found, *hz))
    });
    assert!(asked.len() > 40, "{}", asked.len());
    let mut worst: f64 = 0.0;
    for ((what, hz, ..), off) in asked.iter().zip(&heard) {
        assert!(off.abs() <= 0.5, "{what} ({hz:.2} Hz): {off:+.2} cents");
        worst = worst.max(off.abs());
    }
    println!("{} keys of fifteen scales within {worst:.2} cents", asked.len());
}

#[test]
fn damaged_files_are_told_with_their_line() {
    let kbm = "0\n0\n127\n60\n69\n440.0\n12\n";
    for (scl, kbm, says) in [
        ("", None, "it is empty"),
        ("name\n", None, "the number of notes"),
        ("name\ntwelve\n", None, "line 2 must be a whole number from 0 to 65535, got \"twelve\""),
        ("name\n2\n100.0\n", None, "not as many pitches"),
        ("name\n2\n100.0\n3/x\n", None, "line 4 must be a ratio"),
        ("name\n1\n1200.0.0\n", None, "line 3 must be cents"),
        ("name\n1\n2/1\n", Some("12\n0\n"), "it ends before the last key"),
        ("name\n1\n2/1\n", Some("-3\n0\n"), "line 1 must be a whole number: the size of the map from 0"),
        ("name\n1\n2/1\n", Some("12\n0\n127\n60\n69\nA4\n12\n"), "line 6 must be a frequency"),
        ("name\n1\n2/1\n", Some("2\n0\n127\n60\n69\n440.0\n12\n0\nQ\n"), "line 9 must be a degree"),
    ] {
        let said = read(scl.as_bytes(), kbm).expect_err(scl);
        assert!(said.contains(says), "{scl:?}: {said}");
    }
    // Pitches that would be silence.
    for pitch in
        ["0/1", "3/0", "0", "-2", "1e300", "1e300.0", "9999999999999.0", "-99999.5", "nan.", "2/1000000000"]
    {
        let scl = format!("! a comment\nname\n2\n100.0\n{pitch}\n");
        let said = read(scl.as_bytes(), None).expect_err(pitch);
        assert!(said.contains("line 5 must be") && said.contains(&format!("got {pitch:?}")), "{said}");
    }
    for hz in ["0", "-440", "nan", "inf", "1e300", "1e-300"] {
        let kbm = kbm.replace("440.0", hz);
        let said = read(b"name\n1\n2/1\n", Some(&kbm)).expect_err(hz);
        assert!(said.contains(&format!("line 6 must be a frequency in 1..20000 Hz, got {hz:?}")), "{said}");
    }
    for (mapping, says) in [
        (
            "0\n90\n40\n60\n69\n440.0\n12\n",
            "line 3 must be the last key, at or above the first, 90, got \"40\"",
        ),
        ("2\n0\n127\n60\n69\n440.0\n1\nx\nX\n", "line 9 is \"X\", as are all entries"),
        ("12\n0\n127\n60\n69\n440.0\n12\n", "no entries follow"),
        ("0\n-20\n-10\n60\n69\n440.0\n12\n", "no key has a pitch"),
        (
            "2\n0\n127\n60\n69\n440.0\n1\n0\nx\n",
            "line 5 is the reference key, 69, and the map gives that key no pitch",
        ),
    ] {
        let said = read(b"name\n1\n2/1\n", Some(mapping)).expect_err(mapping);
        assert!(said.contains(says), "{said}");
    }
    // Scala writes a description that is empty, and editors a mark of the encoding before the first comment.
    let plain = read(b"name\n2\n3/2\n2/1\n", Some(kbm)).unwrap();
    for scl in [
        "\n2\n3/2\n2/1\n",
        "! x.scl\r\n!\r\n  \r\n 2\r\n!\r\n 3/2\r\n 2/1\r\n",
        "\u{feff}! x.scl\n!\n\n2\n3/2\n2/1\n",
        "\u{feff}name\n2\n3/2\n2/1\n",
        // An empty line before the description was always left out.
        "\nname\n2\n3/2\n2/1\n",
    ] {
        let keys = read(scl.as_bytes(), Some(&format!("\u{feff}{kbm}")));
        assert!(keys.as_ref() == Ok(&plain), "{scl:?}: {:?}", keys.err());
    }
    // Lines are counted as they stand in the file.
    let said = read(b"! x\n\n2\n3/2\n2/x\n", None).expect_err("no ratio");
    assert!(said.contains("line 5 must be a ratio"), "{said}");
    // Latin-1 in a comment is no reason to refuse a scale.
    assert!(read(b"! M\xe9taton\nname\n1\n2/1\n", Some(kbm)).is_ok());
    let missing = scale_file::read("no/such.scl".as_ref(), None).expect_err("no file").to_string();
    assert!(missing.contains("cannot read no/such.scl"), "{missing}");
}
