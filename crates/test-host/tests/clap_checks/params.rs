//! Checks of parameters.

use std::ffi::CString;

use clack_extensions::params::PluginParams;
use clack_host::events::event_types::*;
use fastrand::Rng;

use super::bench::{BLOCK, Bench, Param, RATE_HZ, nothing, random_value, random_values, set};
use super::keyboard::{Keyboard, Manners, play_notes};

/// The parameters after the same random values, flushed and processed.
fn flushed_and_processed(with_cookies: bool) -> [Vec<f64>; 2] {
    [false, true].map(|processed| {
        let mut bench = Bench::new();
        let mut params = bench.params();
        if !with_cookies {
            params.iter_mut().for_each(|param| param.cookie = clack_host::utils::Cookie::empty());
        }
        let said = random_values(&mut Rng::with_seed(3), &params, 0);
        if processed {
            bench.session(RATE_HZ, BLOCK, |session| drop(session.block(BLOCK, &said, None)));
        } else {
            bench.flush(&said);
        }
        bench.values()
    })
}

#[test]
fn param_set_events() {
    let [flushed, processed] = flushed_and_processed(true);
    assert_eq!(flushed, processed);
}

#[test]
fn param_set_no_cookies() {
    let [flushed, processed] = flushed_and_processed(false);
    assert_eq!(flushed, processed);
    assert_eq!(processed, flushed_and_processed(true)[1]);
}

#[test]
fn param_set_wrong_namespace() {
    let mut bench = Bench::new();
    let before = bench.values();
    let mut said = nothing();
    for param in bench.params() {
        let mut event = set(0, &param, random_value(&mut Rng::with_seed(5), &param));
        // SAFETY: size and type stay those of the event; who knows the space cannot know this one.
        unsafe { event.as_raw_mut() }.header.space_id = 0xB33F;
        said.push(&event);
    }
    bench.flush(&said);
    bench.session(RATE_HZ, BLOCK, |session| drop(session.block(BLOCK, &said, None)));
    assert_eq!(bench.values(), before);
}

/// Plays with 50 sets of values.
fn fuzz(value: impl Fn(&mut Rng, &Param) -> f64) {
    let mut bench = Bench::new();
    let params = bench.params();
    let mut rng = Rng::with_seed(13);
    bench.session(RATE_HZ, BLOCK, |session| {
        for _ in 0..50 {
            let mut said = nothing();
            for param in params.iter().filter(|param| param.is_automatable) {
                said.push(&set(0, param, value(&mut rng, param)));
            }
            session.block(BLOCK, &said, None);
            play_notes(session, Manners::Consistent, [BLOCK; 5]);
        }
    });
}

#[test]
fn param_fuzz_basic() {
    fuzz(random_value);
}

#[test]
fn param_fuzz_bounds() {
    fuzz(|rng, param| param.range[rng.usize(0..2)]);
}

#[test]
fn param_fuzz_sample_accurate() {
    let mut bench = Bench::new();
    let params: Vec<_> = bench.params().into_iter().filter(|param| param.is_automatable).collect();
    let mut rng = Rng::with_seed(17);
    for every in [10, 100, 1_000] {
        bench.session(RATE_HZ, 2_048, |session| {
            for _ in 0..10 {
                let mut said = nothing();
                for at in (0..2_048).step_by(every) {
                    let param = &params[rng.usize(0..params.len())];
                    said.push(&set(at as u32, param, random_value(&mut rng, param)));
                }
                session.block(2_048, &said, None);
            }
        });
    }
}

#[test]
fn param_fuzz_modulation() {
    let mut bench = Bench::new();
    let params = bench.params();
    let mut keyboard = Keyboard::new(Manners::Wildcard);
    let mut rng = Rng::with_seed(19);
    bench.session(RATE_HZ, BLOCK, |session| {
        for _ in 0..200 {
            let mut said = nothing();
            let mut at = 0;
            while at < BLOCK as u32 {
                let param = &params[rng.usize(0..params.len())];
                let of = keyboard.pckn((rng.u16(0..16), rng.u16(0..128), rng.u32(0..64)));
                if rng.bool() {
                    said.push(&ParamValueEvent::new(at, param.id, of, random_value(&mut rng, param)));
                } else {
                    said.push(&ParamModEvent::new(at, param.id, of, rng.f64() - 0.5));
                }
                at += rng.u32(1..300);
            }
            keyboard.play(BLOCK, &mut said);
            said.sort();
            session.block(BLOCK, &said, None);
        }
    });
}

#[test]
fn param_conversions() {
    let mut bench = Bench::new();
    let all = bench.params();
    let handle = bench.instance.plugin_handle();
    let params: PluginParams = handle.get_extension().unwrap();
    let text_of = |id, value| {
        let mut buffer = [0; 256];
        params.value_to_text(&handle, id, value, &mut buffer).map(|text| text.to_owned()).unwrap()
    };
    for param in &all {
        let [low, high] = param.range;
        for step in 0..=20 {
            let value = low + (high - low) * f64::from(step) / 20.0;
            let value = if param.is_stepped { value.round() } else { value };
            let text = text_of(param.id, value);
            let said = String::from_utf8_lossy(&text).into_owned();
            let name = &param.name;
            let read = params.text_to_value(&handle, param.id, &CString::new(text.clone()).unwrap());
            let read = read.unwrap_or_else(|| panic!("{name}: {said:?} is not read"));
            let again = text_of(param.id, read);
            assert_eq!(again, text, "{name}: {said:?} is read as {read}");
            let read_again = params.text_to_value(&handle, param.id, &CString::new(again).unwrap());
            assert_eq!(read_again, Some(read), "{name}: {said:?}");
        }
    }
}

#[test]
fn param_default_values() {
    let mut bench = Bench::new();
    let defaults: Vec<_> = bench.params().into_iter().map(|param| (param.name, param.default)).collect();
    let values = bench.values();
    for ((name, default), value) in defaults.into_iter().zip(values) {
        assert_eq!(value, default, "{name}");
    }
}
