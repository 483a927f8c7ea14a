//! Checks of processing: notes, rates, blocks, sleep, transport.

use clack_extensions::audio_ports_config::{AudioPortsConfigBuffer, PluginAudioPortsConfig};
use clack_host::events::event_types::*;
use clack_host::events::{EventFlags, EventHeader};
use clack_host::process::ProcessStatus;
use fastrand::Rng;

use super::bench::{BLOCK, Bench, RATE_HZ, nothing};
use super::keyboard::{Keyboard, Manners, play_notes};

#[test]
fn process_audio_basic_out_of_place() {
    Bench::new().session(RATE_HZ, BLOCK, |session| {
        (0..20).for_each(|_| drop(session.block(BLOCK, &nothing(), None)));
    });
}

#[test]
fn process_audio_basic_in_place() {
    // Without an input nothing is in place: the same as above, with what the last block left in the buffer.
    let mut bench = Bench::new();
    let silent = bench.session(RATE_HZ, BLOCK, |session| session.block(BLOCK, &nothing(), None));
    assert!(silent.channels.iter().flatten().all(|sample| *sample == 0.0));
}

#[test]
fn process_sleep_constant_mask() {
    Bench::new().session(RATE_HZ, BLOCK, |session| {
        for block in 0..400 {
            let mut said = nothing();
            if block == 10 {
                said.push(&MidiEvent::new(0, 0, [0x90, 60, 100]));
            } else if block == 60 {
                said.push(&MidiEvent::new(0, 0, [0x80, 60, 0]));
            }
            let heard = session.block(BLOCK, &said, None);
            for (channel, samples) in heard.channels.iter().enumerate() {
                let is_said_constant = heard.constant_mask >> channel & 1 == 1;
                let is_constant = samples.iter().all(|sample| *sample == samples[0]);
                assert!(!is_said_constant || is_constant, "channel {channel} of block {block}");
            }
        }
    });
}

#[test]
fn process_sleep_process_status() {
    Bench::new().session(RATE_HZ, BLOCK, |session| {
        let mut is_asleep = false;
        for block in 0..400 {
            let mut said = nothing();
            if block == 10 {
                said.push(&MidiEvent::new(0, 0, [0x90, 60, 100]));
            } else if block == 60 {
                said.push(&MidiEvent::new(0, 0, [0x80, 60, 0]));
            }
            let is_woken = !said.is_empty();
            let heard = session.block(BLOCK, &said, None);
            let is_silent = heard.channels.iter().flatten().all(|sample| *sample == 0.0);
            assert!(!is_asleep || is_woken || is_silent, "block {block} sounds, but the plugin slept");
            is_asleep = heard.status == ProcessStatus::Sleep;
        }
    });
}

#[test]
fn process_note_out_of_place_basic() {
    let peak = Bench::new()
        .session(RATE_HZ, BLOCK, |session| play_notes(session, Manners::Consistent, [BLOCK; 200]));
    assert!(peak > 1e-3, "something sounds: {peak}");
}

#[test]
fn process_note_inconsistent() {
    Bench::new().session(RATE_HZ, BLOCK, |session| play_notes(session, Manners::Inconsistent, [BLOCK; 200]));
}

#[test]
fn process_note_wildcard() {
    Bench::new().session(RATE_HZ, BLOCK, |session| play_notes(session, Manners::Wildcard, [BLOCK; 200]));
}

#[test]
fn process_varying_sample_rates() {
    let mut bench = Bench::new();
    for rate_hz in [
        1_000.0, 8_000.0, 12_345.678, 16_000.0, 22_050.0, 44_100.0, 48_000.0, 88_200.5, 96_000.0, 176_400.0,
        192_000.0, 384_000.0, 705_600.0, 768_000.0,
    ] {
        bench.session(rate_hz, BLOCK, |session| play_notes(session, Manners::Consistent, [BLOCK; 20]));
    }
}

#[test]
fn process_varying_block_sizes() {
    let mut bench = Bench::new();
    for block in [1, 2, 7, 32, 127, 128, 441, 960, 1_024, 4_096, 8_192, 16_384] {
        let blocks = std::iter::repeat_n(block, (20_000 / block).clamp(5, 400));
        bench.session(RATE_HZ, block, |session| play_notes(session, Manners::Consistent, blocks));
    }
}

#[test]
fn process_random_block_sizes() {
    let mut rng = Rng::with_seed(11);
    let blocks: Vec<_> = (0..100).map(|_| rng.usize(1..=2_048)).collect();
    Bench::new().session(RATE_HZ, 2_048, |session| play_notes(session, Manners::Consistent, blocks));
}

#[test]
fn process_reset_reactivate() {
    let mut bench = Bench::new();
    for _ in 0..3 {
        bench.session(RATE_HZ, BLOCK, |session| {
            for _ in 0..3 {
                play_notes(session, Manners::Consistent, [BLOCK; 10]);
                session.processor.reset();
            }
        });
    }
}

#[test]
fn layout_audio_ports_config() {
    let mut bench = Bench::new();
    let handle = bench.instance.plugin_handle();
    let configs: Option<PluginAudioPortsConfig> = handle.get_extension();
    let Some(configs) = configs else { return };
    let count = configs.count(&handle);
    for index in 0..count {
        let mut buffer = AudioPortsConfigBuffer::new();
        let mut handle = bench.instance.inactive_plugin_handle().unwrap();
        let config = configs.get(&handle.as_main_thread(), index, &mut buffer).unwrap();
        configs.select(&mut handle, config.id).unwrap();
        bench.session(RATE_HZ, BLOCK, |session| play_notes(session, Manners::Consistent, [BLOCK; 10]));
    }
}

/// A transport that is somewhere.
fn random_transport(rng: &mut Rng, at: u32) -> TransportEvent {
    TransportEvent {
        header: EventHeader::new_core(at, EventFlags::empty()),
        flags: TransportFlags::from_bits_truncate(rng.u32(..)),
        song_pos_beats: (1_000.0 * rng.f64()).into(),
        song_pos_seconds: (1_000.0 * rng.f64()).into(),
        tempo: 1.0 + 500.0 * rng.f64(),
        tempo_inc: rng.f64() - 0.5,
        loop_start_beats: (100.0 * rng.f64()).into(),
        loop_end_beats: (100.0 * rng.f64()).into(),
        loop_start_seconds: (100.0 * rng.f64()).into(),
        loop_end_seconds: (100.0 * rng.f64()).into(),
        bar_start: (100.0 * rng.f64()).into(),
        bar_number: rng.i32(-10..1_000),
        time_signature_numerator: rng.u16(1..=16),
        time_signature_denominator: 1 << rng.u16(0..6),
    }
}

#[test]
fn transport_null() {
    Bench::new().session(RATE_HZ, BLOCK, |session| play_notes(session, Manners::Consistent, [BLOCK; 20]));
}

#[test]
fn transport_fuzz() {
    let mut rng = Rng::with_seed(31);
    let mut keyboard = Keyboard::new(Manners::Consistent);
    Bench::new().session(RATE_HZ, BLOCK, |session| {
        for _ in 0..100 {
            let mut said = nothing();
            keyboard.play(BLOCK, &mut said);
            session.block(BLOCK, &said, Some(&random_transport(&mut rng, 0)));
        }
    });
}

#[test]
fn transport_fuzz_sample_accurate() {
    let mut rng = Rng::with_seed(37);
    for every in [1, 100, 1_000] {
        let mut keyboard = Keyboard::new(Manners::Consistent);
        Bench::new().session(RATE_HZ, 2_048, |session| {
            for _ in 0..10 {
                let mut said = nothing();
                keyboard.play(2_048, &mut said);
                for at in (0..2_048).step_by(every) {
                    said.push(&random_transport(&mut rng, at));
                }
                said.sort();
                session.block(2_048, &said, None);
            }
        });
    }
}
