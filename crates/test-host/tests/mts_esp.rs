//! The bundled CLAP beside a tuning program that speaks MTS-ESP, played by a small library in C. CHALUMEAU_CLAP names another
//! plugin.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::process::Command;

use chalumeau_core::analysis::pitch::fundamental_hz;
use chalumeau_core::analysis::to_f64;
use chalumeau_test_host::clap::{At, Plugin, Say, Session};
use libloading::Library;

const RATE: f64 = 48_000.0;
const SECOND: usize = 48_000;

/// What a tuning program's library does, and how a test moves it.
const LIBRARY: &str = r#"
#include <stdbool.h>
#include <string.h>
static double table[128];
static char name[64] = "";
static bool has_master = false;
static int clients = 0;
void MTS_RegisterClient(void) { clients++; }
void MTS_DeregisterClient(void) { clients--; }
bool MTS_HasMaster(void) { return has_master; }
const double *MTS_GetTuningTable(void) { return table; }
const char *MTS_GetScaleName(void) { return name; }
void test_tune(const double *hz, const char *of) {
    memcpy(table, hz, sizeof table);
    strncpy(name, of, sizeof name - 1);
    has_master = true;
}
void test_leave(void) { has_master = false; }
int test_clients(void) { return clients; }
"#;

fn built(folder: &Path) -> PathBuf {
    let (source, library) = (folder.join("mts.c"), folder.join("libMTS.so"));
    std::fs::write(&source, LIBRARY).unwrap();
    let made =
        Command::new("cc").args(["-shared", "-fPIC", "-o"]).args([&library, &source]).status().unwrap();
    assert!(made.success());
    library
}

/// Plays a key for a second and returns the pitch of its second half, Hz.
fn played_hz(session: &mut Session, key: u8) -> f64 {
    let on = [At(0, Say::Midi([0xB0, 2, 90])), At(0, Say::Midi([0x90, key, 100]))];
    let [left, _] = session.play_live(&on, SECOND, RATE).unwrap();
    session.play_live(&[At(0, Say::Midi([0x80, key, 0]))], SECOND / 4, RATE).unwrap();
    fundamental_hz(&to_f64(&left[SECOND / 2..]), RATE).unwrap()
}

fn cents(hz: f64, wanted_hz: f64) -> f64 {
    1_200.0 * (hz / wanted_hz).log2()
}

#[test]
fn keys_follow_a_tuning_program_while_one_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = built(folder.path());
    // SAFETY: nothing else runs in this process yet.
    unsafe {
        std::env::set_var("CHALUMEAU_MTS_ESP", &path);
    }
    // SAFETY: the library above, whose functions have these types.
    let library = unsafe { Library::new(&path) }.unwrap();
    let tune = |name: &str, hz: [f64; 128]| unsafe {
        let name = CString::new(name).unwrap();
        let tune = library.get::<unsafe extern "C" fn(*const f64, *const std::ffi::c_char)>(b"test_tune\0");
        tune.unwrap()(hz.as_ptr(), name.as_ptr());
    };
    let clients = || unsafe { library.get::<unsafe extern "C" fn() -> i32>(b"test_clients\0").unwrap()() };
    // Just fifths over D4, key by key: key 69 sounds a just fifth over key 62, 293.66 Hz.
    let equal = |key: usize| 440.0 * ((key as f64 - 69.0) / 12.0).exp2();
    let just = std::array::from_fn(|key| if key == 69 { 1.5 * equal(62) } else { equal(key) });
    // A fifth of a tone lower than equal temperament.
    let low = std::array::from_fn(|key| equal(key) * (-40.0_f64 / 1_200.0).exp2());

    let mut plugin = Plugin::load(&chalumeau_test_host::artefacts::clap().unwrap()).unwrap();
    let mut session = plugin.activate(RATE, 480).unwrap();
    assert_eq!(clients(), 1, "it tells the tuning program that it is there");
    let alone = played_hz(&mut session, 69);
    assert!(cents(alone, equal(69)).abs() < 5.0, "{alone}");
    tune("just fifth", just);
    session.play_live(&[], SECOND / 2, RATE).unwrap();
    let fifth = played_hz(&mut session, 69);
    assert!((cents(fifth, alone) - cents(just[69], equal(69))).abs() < 0.5, "{alone} {fifth}");
    tune("low", low);
    session.play_live(&[], SECOND / 2, RATE).unwrap();
    let lower = played_hz(&mut session, 69);
    assert!((cents(lower, alone) + 40.0).abs() < 2.0, "{alone} {lower}");
    // SAFETY: as above.
    unsafe { library.get::<unsafe extern "C" fn()>(b"test_leave\0").unwrap()() };
    session.play_live(&[], SECOND / 2, RATE).unwrap();
    let again = played_hz(&mut session, 69);
    assert!(cents(again, alone).abs() < 0.5, "{alone} {again}");
    plugin.deactivate(session);
    drop(plugin);
    assert_eq!(clients(), 0, "and that it has left");
}
