//! A hole that the page moves does to the pitch what the native code says, at once and when it is fitted.
//!
//! `web/tests/moved_holes.json` holds the question and the pitches, which the browser's tests compare. A change that is meant is
//! written by `UPDATE_GOLDEN=1 cargo test -p chalumeau-web --features workshop --test moved_holes`.
#![cfg(feature = "workshop")]

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::units::{WrittenNote, cents};
use chalumeau_web::playing::{MOST_FRAMES, Playing};
use chalumeau_web::workshop::answer;
use serde_json::{Value, json};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/moved_holes.json");
const RATE_HZ: f64 = 48_000.0;
/// Written G3 of the B flat clarinet sounds F3.
const WRITTEN: WrittenNote = WrittenNote(55);
const SOUNDING: u8 = 53;
/// The sound is measured in its second half, samples.
const SAMPLES: usize = 72_000;

fn ask(question: &Value) -> Value {
    let told: Value = serde_json::from_slice(&answer(question.to_string().as_bytes())).unwrap();
    assert_eq!(told["failed"], Value::Null);
    told
}

fn played_hz(file: &str, prepared: &str) -> f64 {
    let mut playing = Playing::prepared(RATE_HZ, file, prepared).unwrap();
    playing.midi(0x90, SOUNDING, 100);
    let mut sound = Vec::new();
    while sound.len() < SAMPLES {
        let frames = playing.process(MOST_FRAMES);
        sound.extend(playing.channel(0)[..frames].iter().map(|&sample| f64::from(sample)));
    }
    fundamental_hz(&sound[SAMPLES / 2..SAMPLES], RATE_HZ).unwrap()
}

#[test]
fn a_moved_hole_moves_the_pitch_as_the_page_is_told() {
    let clarinet = InstrumentFile::built_in();
    let note = clarinet.fingering(WRITTEN).unwrap();
    let first_open = note.open.iter().position(|&is_open| is_open).unwrap();
    let hole = &clarinet.holes[first_open];
    // In tenths of a millimetre, as the page's numbers are.
    let x_m = (1e4 * (hole.x_m - 4e-3)).round() / 1e4;
    let moved = json!([{ "name": hole.name, "x_m": x_m, "radius_m": hole.radius_m }]);
    let played = |moved: Value, fit: bool| {
        let question = json!({ "do": "move", "rate": RATE_HZ, "instrument": 0, "moved": moved, "fit": fit });
        let told = ask(&question);
        played_hz(told["file"].as_str().unwrap(), told["prepared"].as_str().unwrap())
    };
    let hz =
        [(json!([]), false), (moved.clone(), false), (moved.clone(), true)].map(|(m, fit)| played(m, fit));
    let [by_at_once, by_fitted] = [hz[1], hz[2]].map(|to_hz| cents(to_hz, hz[0]));
    assert!(by_fitted > 10.0 && (by_at_once - by_fitted).abs() < 10.0, "{by_at_once} {by_fitted} cents");
    let now = json!({ "hole": first_open, "built_mm": (1e4 * hole.x_m).round() / 10.0, "moved": moved, "note": SOUNDING, "built_hz": hz[0], "at_once_hz": hz[1], "fitted_hz": hz[2] });
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(FILE, format!("{now}\n")).unwrap();
    }
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(FILE).unwrap()).unwrap();
    assert_eq!(golden["hole"], now["hole"]);
    for name in ["built_hz", "at_once_hz", "fitted_hz"] {
        let off = cents(now[name].as_f64().unwrap(), golden[name].as_f64().unwrap());
        assert!(off.abs() < 0.1, "{name}: {off} cents from {}", golden[name]);
    }
}

#[test]
fn a_saved_instrument_is_known_again_and_nonsense_is_refused() {
    let name = InstrumentFile::built_in().holes[5].name.clone();
    let moved = json!([{ "name": name, "x_m": 0.3, "radius_m": 3e-3 }]);
    for instrument in [0, 4] {
        let question = json!({ "do": "move", "rate": RATE_HZ, "instrument": instrument, "moved": moved });
        let told = ask(&question);
        let opened = ask(&json!({ "do": "open", "rate": RATE_HZ, "text": told["file"] }));
        assert_eq!(opened["instrument"], instrument);
        let again =
            json!({ "do": "move", "rate": RATE_HZ, "instrument": instrument, "moved": opened["moved"] });
        let places = |told: &Value| -> Vec<f64> {
            let holes = told["holes"].as_array().unwrap();
            holes.iter().flat_map(|hole| [hole["x"].as_f64().unwrap(), hole["r"].as_f64().unwrap()]).collect()
        };
        let off =
            places(&ask(&again)).iter().zip(places(&told)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{off} m");
    }
    for question in
        ["", "{}", "[1]", r#"{"do":"open","rate":48000,"text":"bore"}"#, r#"{"do":"move","rate":1}"#]
    {
        let told: Value = serde_json::from_slice(&answer(question.as_bytes())).unwrap();
        assert!(told["failed"].is_string(), "{question}");
    }
    assert!(Playing::prepared(RATE_HZ, "", "").is_none());
}
