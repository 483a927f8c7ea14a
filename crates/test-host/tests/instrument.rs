//! The bundled CLAP on other instruments: exchanged while it sounds, from a file, rendered offline. CHALUMEAU_CLAP names
//! another library, CHALUMEAU_CACHE_DIR a folder for what is made.

use std::path::Path;
use std::time::{Duration, Instant};

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::moved_hole::MovedHole;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::units::{Air, WrittenNote};
use chalumeau_test_host::clap::{At, Plugin, Say, Session};

const RATE: f64 = 48_000.0;
const SECOND: usize = 48_000;
const BLOCK: usize = 480;
/// Fitting and tuning on two busy cores.
const PATIENCE: Duration = Duration::from_secs(300);
/// Numbers of *Instrument*'s choices.
const INSTRUMENTS: [(&str, f64); 5] =
    [("B flat", 0.0), ("A", 1.0), ("E flat", 2.0), ("C", 3.0), ("bass", 4.0)];

fn plugin() -> Plugin {
    let path = chalumeau_test_host::artefacts::clap().unwrap();
    Plugin::load(&path).unwrap()
}

fn on(key: u8) -> Say {
    Say::Midi([0x90, key, 100])
}

fn off(key: u8) -> Say {
    Say::Midi([0x80, key, 0])
}

fn breath(value: u8) -> Say {
    Say::Midi([0xB0, 2, value])
}

fn status(plugin: &mut Plugin) -> String {
    let id = plugin.param("Instrument status").unwrap().id;
    plugin.text(id, 0.0).unwrap()
}

/// Plays silence until the status begins so.
fn wait(plugin: &mut Plugin, session: &mut Session, word: &str) -> Vec<String> {
    let began = Instant::now();
    let mut seen: Vec<String> = Vec::new();
    loop {
        session.play_live(&[], BLOCK, RATE).unwrap();
        let now = status(plugin);
        if seen.last() != Some(&now) {
            seen.push(now);
        }
        if seen.last().is_some_and(|now| now.starts_with(word)) {
            return seen;
        }
        assert!(began.elapsed() < PATIENCE, "no {word:?}: {seen:?}");
    }
}

fn level_db(samples: &[f32]) -> f64 {
    let power: f64 = samples.iter().map(|&x| f64::from(x).powi(2)).sum();
    10.0 * (power / samples.len() as f64).max(1e-30).log10()
}

fn largest_step(samples: &[f32]) -> f32 {
    samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
}

/// Cents from a MIDI note at A4 = 440 Hz.
fn cents(samples: &[f32], note: f64) -> f64 {
    let hz = fundamental_hz(&to_f64(samples), RATE).unwrap();
    1200.0 * (hz / 440.0).log2() - 100.0 * (note - 69.0)
}

/// The framework writes eight bytes of length, then JSON.
fn state_of(json: &str) -> Vec<u8> {
    let mut bytes = (json.len() as u64).to_le_bytes().to_vec();
    bytes.extend(json.bytes());
    bytes
}

/// A state whose instrument is a file.
fn user_state(path: &Path) -> Vec<u8> {
    let path = serde_json::to_string(&path.display().to_string()).unwrap();
    let path = serde_json::to_string(&path).unwrap();
    state_of(&format!(
        r#"{{"version":"1","params":{{"instr":{{"string":"user"}}}},"fields":{{"instrumentfile":{path}}}}}"#
    ))
}

/// A state with this scale; equal temperament without a text.
fn scale_state(scl: &str) -> Vec<u8> {
    let scale = serde_json::json!({ "name": "quarter_tones.scl", "scl": scl }).to_string();
    let fields = serde_json::json!({ "scale": scale });
    state_of(&serde_json::json!({ "version": "1", "params": {}, "fields": fields }).to_string())
}

#[test]
fn a_project_keeps_its_scale_and_another_comes_while_a_note_sounds() {
    let quarter_tones = "quarter tones\n1\n50.0\n";
    let mut plugin = plugin();
    plugin.restore(&scale_state(quarter_tones)).unwrap();
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    let heard = session.play_live(&[At(0, breath(64)), At(0, on(65))], SECOND, RATE).unwrap()[0].clone();
    let off = cents(&heard[SECOND / 2..], 62.5);
    assert!(off.abs() < 2.0, "key 65 is five quarter tones above middle C: {off} cents");
    // Equal temperament again, under the same key.
    plugin.restore(&scale_state("")).unwrap();
    let heard = session.play_live(&[], SECOND, RATE).unwrap()[0].clone();
    for (at, window) in heard.chunks(SECOND / 50).enumerate() {
        assert!(level_db(window) > -40.0, "{} dB after {} ms", level_db(window), 20 * at);
    }
    let off = cents(&heard[SECOND / 2..], 65.0);
    assert!(off.abs() < 2.0, "{off} cents");
    // A damaged scale is none.
    plugin.restore(&scale_state("quarter tones\n7\n50.0\n")).unwrap();
    let heard = session.play_live(&[], SECOND, RATE).unwrap()[0].clone();
    assert!(cents(&heard[SECOND / 2..], 65.0).abs() < 2.0);
    plugin.deactivate(session);
}

/// The hole that written G3 opens first, moved towards the reed by 5 mm: G3 rises at once, and exactly as the transfer matrices
/// say when the bore is fitted; E3, which closes it, stays; the project keeps it.
#[test]
fn a_moved_hole_is_heard_at_once_and_kept() {
    let file = InstrumentFile::built_in();
    let note = file.fingering(WrittenNote(55)).unwrap();
    let hole = &file.holes[note.open.iter().position(|open| *open).unwrap()];
    let moved = MovedHole { name: hole.name.clone(), x_m: hole.x_m - 5e-3, radius_m: hole.radius_m };
    let peak_hz = |file: &InstrumentFile| {
        TransferMatrix::new(file, Air::default()).peaks(&note.open, file.reed_volume_m3, 1)[0].f_hz
    };
    let rise =
        1_200.0 * (peak_hz(&file.with_holes_moved(std::slice::from_ref(&moved))) / peak_hz(&file)).log2();
    assert!(rise > 10.0, "{rise}");

    let holes = serde_json::json!({ "instrument": "bflat", "moved": [moved] }).to_string();
    let fields = serde_json::json!({ "holes": holes });
    // Without life: how far a note has wandered when it is heard goes with how long the fit takes.
    let params = serde_json::json!({ "life": { "f32": 0.0 } });
    let still = |fields: serde_json::Value| {
        state_of(&serde_json::json!({ "version": "1", "params": params, "fields": fields }).to_string())
    };
    let state = still(fields);
    let mut plugin = plugin();
    plugin.restore(&still(serde_json::json!({}))).unwrap();
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    let mut played = |plugin: &mut Plugin, key: u8| {
        let heard =
            session.play_live(&[At(0, breath(80)), At(0, on(key))], 2 * SECOND, RATE).unwrap()[0].clone();
        session.play_live(&[At(0, off(key))], SECOND / 5, RATE).unwrap();
        (cents(&heard[SECOND / 2..], f64::from(key)), status(plugin))
    };
    // Sounding, two semitones below what is written.
    let (g3, e3) = (53, 50);
    let built = [played(&mut plugin, g3).0, played(&mut plugin, e3).0];
    assert!(built.iter().all(|off| off.abs() < 5.0), "{built:?}");
    plugin.restore(&state).unwrap();
    let at_once = played(&mut plugin, g3).0 - built[0];
    assert!((at_once - rise).abs() < 8.0, "{at_once} cents at once, {rise} wanted");
    let began = Instant::now();
    loop {
        let (_, told) = played(&mut plugin, g3);
        if told.starts_with("ready: ") {
            assert!(told.ends_with("altered"), "{told}");
            break;
        }
        assert!(began.elapsed() < PATIENCE, "{told}");
    }
    let fitted = [played(&mut plugin, g3).0 - built[0], played(&mut plugin, e3).0 - built[1]];
    println!(
        "{at_once:.2} cents at once, {:.2} fitted, {rise:.2} of the peak; E3 {:.2}",
        fitted[0], fitted[1]
    );
    // A blown note rises by 3.2 cents less than the peak; its breath noise moves what is measured by 0.1.
    assert!((fitted[0] - rise).abs() < 3.6, "{} cents, {rise} wanted", fitted[0]);
    assert!(fitted[1].abs() < 2.5, "{fitted:?}");
    let saved = String::from_utf8_lossy(&plugin.save().unwrap()).into_owned();
    assert!(saved.contains(&hole.name), "{saved}");
    plugin.deactivate(session);
}

/// A pipe of three notes: quickly fitted and tuned.
const PIPE: &str = include_str!("../../core/tests/data/pipe.toml");

#[test]
fn instruments_are_exchanged_while_a_note_sounds() {
    let mut plugin = plugin();
    let choice = plugin.param("Instrument").unwrap().id;
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    let mut heard = session.play_live(&[At(0, breath(64)), At(0, on(57))], SECOND, RATE).unwrap()[0].clone();
    let own = largest_step(&heard[SECOND / 2..]);
    let mut steps = own;
    for (name, number) in INSTRUMENTS.into_iter().skip(1).chain([INSTRUMENTS[0]]) {
        let from = heard.len();
        let now = session.play_live(&[At(0, Say::Set(choice, number))], SECOND, RATE).unwrap();
        heard.extend(&now[0]);
        let tail = &heard[heard.len() - SECOND / 4..];
        let off = cents(tail, 57.0);
        let text = status(&mut plugin);
        println!("{name}: {off:.2} cents, {text}");
        // What is fitted anew is rough for a while.
        assert!(!text.starts_with("ready") || off.abs() < 5.0, "{name}: {off} cents");
        steps = steps.max(largest_step(tail));
        let over = largest_step(&heard[from..]);
        assert!(over <= 1.5 * steps, "{name}: a step of {over}, {steps} elsewhere");
        for (at, window) in heard[from..].chunks(SECOND / 50).enumerate() {
            assert!(level_db(window) > -40.0, "{name}: {} dB after {} ms", level_db(window), 20 * at);
        }
    }
    assert!(heard.iter().all(|x| x.is_finite()));
    wait(&mut plugin, &mut session, "ready: ");
    let back = session.play_live(&[], SECOND, RATE).unwrap();
    let off_key = cents(&back[0][SECOND / 2..], 57.0);
    assert!(off_key.abs() < 1.0, "back on the first one: {off_key} cents");
    session.play(&[At(0, off(57)), At(0, breath(0))], SECOND).unwrap();
    let rest = session.play(&[], SECOND / 2).unwrap();
    assert!(level_db(&rest[0]) < -100.0, "{}", level_db(&rest[0]));
    plugin.deactivate(session);
}

#[test]
fn an_instrument_file_plays_at_once_and_in_tune_when_it_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe.toml");
    // A length of its own: no cache knows it.
    let unique = format!("{:.6}", 459.0 + f64::from(std::process::id() % 997) / 997.0);
    std::fs::write(&path, PIPE.replace("x_end_mm = 460.0", &format!("x_end_mm = {unique}"))).unwrap();
    let mut plugin = plugin();
    plugin.restore(&user_state(&path)).unwrap();
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    // Fitting takes longer than asking, however quick the machine.
    let first = status(&mut plugin);
    assert!(first != "ready: pipe", "nothing is ready yet");
    let heard = session.play_live(&[At(0, breath(64)), At(0, on(55))], SECOND / 2, RATE).unwrap();
    assert!(level_db(&heard[0][SECOND / 4..]) > -40.0, "rough, but it sounds");
    wait(&mut plugin, &mut session, "ready: pipe");
    let heard = session.play_live(&[], SECOND, RATE).unwrap();
    let off = cents(&heard[0][SECOND / 2..], 55.0);
    assert!(off.abs() < 3.0, "{off} cents");
    plugin.deactivate(session);
    // The next project has it from the cache, before its first sample.
    let mut again = self::plugin();
    again.restore(&plugin.save().unwrap()).unwrap();
    let saved = String::from_utf8_lossy(&again.save().unwrap()).into_owned();
    assert!(saved.contains("pipe.toml") && saved.contains("\"user\""), "{saved}");
    let began = Instant::now();
    let session = again.activate(RATE, BLOCK).unwrap();
    println!("activated in {:?}", began.elapsed());
    assert_eq!(status(&mut again), "ready: pipe");
    again.deactivate(session);
}

#[test]
fn a_file_that_is_none_is_said_and_the_instrument_before_plays_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.toml");
    std::fs::write(&path, "name = 7").unwrap();
    let mut plugin = plugin();
    let said = [At(0, breath(64)), At(0, on(57))];
    let reference = plugin.play(RATE, BLOCK, &said, SECOND / 2).unwrap();
    plugin.restore(&user_state(&path)).unwrap();
    let heard = plugin.play(RATE, BLOCK, &said, SECOND / 2).unwrap();
    assert!(heard == reference, "the built-in clarinet");
    let text = status(&mut plugin);
    assert!(text.contains("broken.toml") && text.contains("still "), "{text}");
    // Put right, it is taken without another word.
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    std::fs::write(&path, PIPE).unwrap();
    wait(&mut plugin, &mut session, "ready: pipe");
    // Chosen by hand while it is away.
    std::fs::remove_file(&path).unwrap();
    let seen = wait(&mut plugin, &mut session, "cannot read");
    assert!(seen.last().unwrap().ends_with("still playing pipe"), "{seen:?}");
    plugin.deactivate(session);
}

#[test]
fn an_offline_render_waits_for_its_instrument_and_repeats() {
    let said = |plugin: &mut Plugin| {
        let choice = plugin.param("Instrument").unwrap().id;
        let a4 = plugin.param("A4").unwrap();
        let low = a4.min + 0.1 * (a4.max - a4.min);
        vec![
            At(0, breath(64)),
            At(0, on(57)),
            At(10_007, Say::Set(choice, 1.0)),
            At(30_000, Say::Set(a4.id, low)),
            At(40_000, off(57)),
        ]
    };
    let render = |block: usize| {
        let mut plugin = plugin();
        plugin.set_offline(true).unwrap();
        let said = said(&mut plugin);
        plugin.play(RATE, block, &said, SECOND).unwrap()
    };
    let first = render(512);
    assert!(first == render(512), "two bounces are one");
    for block in [64, 4_096] {
        assert!(first == render(block), "blocks of {block}");
    }
    assert!(level_db(&first[0][SECOND / 2..SECOND / 2 + 4_800]) > -40.0);
}

#[test]
fn an_offline_render_begins_with_the_parameters_of_its_first_block() {
    let render = |before: bool| {
        let mut plugin = plugin();
        plugin.set_offline(true).unwrap();
        let a4 = plugin.param("A4").unwrap();
        let mut said = vec![At(0, breath(64)), At(0, on(57))];
        if before {
            plugin.set(a4.id, a4.max).unwrap();
        } else {
            said.insert(0, At(0, Say::Set(a4.id, a4.max)));
        }
        plugin.play(RATE, BLOCK, &said, SECOND).unwrap()
    };
    assert!(render(true) == render(false), "a clarinet of that size from the first sample on");
}

#[test]
fn a_project_begins_with_its_own_instrument() {
    let mut plugin = plugin();
    plugin.set_offline(true).unwrap();
    let choice = plugin.param("Instrument").unwrap().id;
    let said = [At(0, breath(64)), At(0, on(57))];
    let b_flat = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    plugin.set(choice, 1.0).unwrap();
    let a = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    assert!(a != b_flat);
    assert!(cents(&a[0][SECOND / 2..], 57.0).abs() < 3.0);
    let mut other = self::plugin();
    other.set_offline(true).unwrap();
    other.restore(&plugin.save().unwrap()).unwrap();
    assert!(other.play(RATE, BLOCK, &said, SECOND).unwrap() == a);
}

#[test]
fn a_state_from_before_instruments_is_the_b_flat_clarinet() {
    let mut plugin = plugin();
    let json =
        r#"{"version":"0.1.0","params":{"a4":{"f32":442.0},"zeta":{"f32":0.35}},"fields":{"schema":"1"}}"#;
    plugin.restore(&state_of(json)).unwrap();
    for (name, text) in [
        ("Instrument", "B flat clarinet"),
        ("Offline quality", "Same as live"),
        ("Bend range", "2 st"),
        ("Reed description", "Dimensionless"),
        ("A4", "442.0 Hz"),
    ] {
        let param = plugin.param(name).unwrap();
        let value = plugin.value(param.id).unwrap();
        assert_eq!(plugin.text(param.id, value).unwrap(), text, "{name}");
    }
}

#[test]
fn a_bounce_is_what_was_heard_unless_more_is_asked_for() {
    let mut plugin = plugin();
    let said = [At(0, breath(64)), At(0, on(57))];
    let live = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    plugin.set_offline(true).unwrap();
    let bounced = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    assert!(bounced == live, "by default");
    // A living note wanders by a cent and a half.
    let life = plugin.param("Life").unwrap().id;
    plugin.set(life, 0.0).unwrap();
    let live = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    let quality = plugin.param("Offline quality").unwrap().id;
    plugin.set(quality, 1.0).unwrap();
    let high = plugin.play(RATE, BLOCK, &said, SECOND).unwrap();
    assert!(high != live);
    let off = [&live, &high].map(|sound| cents(&sound[0][SECOND / 2..], 57.0));
    println!("live {:.3}, high {:.3} cents", off[0], off[1]);
    assert!(off.iter().all(|off| off.abs() < 0.5), "{off:?} cents");
    plugin.set_offline(false).unwrap();
    assert!(plugin.play(RATE, BLOCK, &said, SECOND).unwrap() == live, "live is live again");
}
