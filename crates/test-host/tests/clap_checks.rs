//! The checks of clap-validator 0.4.1 that `clap_rules.rs` leaves open, each under its name, with underscores.
//!
//! Four checks of its list have nothing to check here: the plugin has no 64-bit ports (process-audio-double-out-of-place,
//! -in-place), and its ports are fixed (layout-audio-ports-activation, layout-configurable-audio-ports). If it grows one of these,
//! `what_is_skipped` fails.

#[path = "support/presets.rs"]
mod presets;

use std::ffi::CString;
use std::time::{Duration, Instant};

use chalumeau_test_host::artefacts;
use clack_extensions::audio_ports::{AudioPortFlags, AudioPortInfoBuffer, PluginAudioPorts};
use clack_extensions::params::{ParamInfoBuffer, PluginParams};
use clack_host::events::event_types::*;
use clack_host::events::{EventFlags, EventHeader, Pckn};
use clack_host::prelude::*;
use clack_host::utils::ClapId;
use fastrand::Rng;

/// Samples of a block.
const BLOCK: usize = 2_048;

struct Shared;
struct Main;
struct Host;

impl SharedHandler<'_> for Shared {
    fn request_restart(&self) {}
    fn request_process(&self) {}
    fn request_callback(&self) {}
}

impl MainThreadHandler<'_> for Main {}

impl HostHandlers for Host {
    type Shared<'a> = Shared;
    type MainThread<'a> = Main;
    type AudioProcessor<'a> = ();
}

/// The bundled library. It is never unloaded; see `chalumeau_test_host::clap::Plugin::load`.
fn library() -> PluginEntry {
    // SAFETY: the file is the plugin this project has just built.
    let entry = unsafe { PluginEntry::load(artefacts::clap().unwrap()) }.unwrap();
    std::mem::forget(entry.clone());
    entry
}

fn instance(entry: &PluginEntry) -> PluginInstance<Host> {
    let factory = entry.get_plugin_factory().unwrap();
    let id: CString = factory.plugin_descriptors().next().unwrap().id().unwrap().to_owned();
    let info = HostInfo::new("checks", "Chalumeau", "", "1").unwrap();
    PluginInstance::new(|_| Shared, |_| Main, entry, &id, &info).unwrap()
}

/// Plays `blocks` blocks at a rate, with nothing at the side-chain: see [`play_with`].
#[track_caller]
fn play(rate_hz: f64, blocks: usize, transport: impl FnMut(&mut EventBuffer) -> Option<TransportEvent>) {
    play_with(&mut instance(&library()), rate_hz, blocks, None, transport);
}

/// Plays `blocks` blocks at a rate: a key is pressed in the second block and released before the last one. `heard` gives the samples
/// of the side-chain. `transport` is the transport of a block, and may say more of it. Asserts that every sample is a number, none
/// is subnormal, and that something sounds.
#[track_caller]
fn play_with(
    instance: &mut PluginInstance<Host>,
    rate_hz: f64,
    blocks: usize,
    mut heard: Option<&mut dyn FnMut() -> f32>,
    mut transport: impl FnMut(&mut EventBuffer) -> Option<TransportEvent>,
) {
    let config = PluginAudioConfiguration {
        sample_rate: rate_hz,
        min_frames_count: 1,
        max_frames_count: BLOCK as u32,
    };
    let stopped = instance.activate(|_, _| (), config);
    let stopped = stopped.unwrap_or_else(|reason| panic!("activate at {rate_hz} Hz: {reason}"));
    let Ok(mut processor) = stopped.start_processing() else {
        panic!("does not start processing at {rate_hz} Hz")
    };
    let mut peak = 0.0_f32;
    for block in 0..blocks {
        let mut said = EventBuffer::new();
        if block == 1 {
            said.push(&MidiEvent::new(7, 0, [0x90, 58, 100]));
        } else if block + 1 == blocks {
            said.push(&MidiEvent::new(0, 0, [0x80, 58, 0]));
        }
        let now = transport(&mut said);
        said.sort();
        let mut channels = [vec![0.0_f32; BLOCK], vec![0.0; BLOCK]];
        let mut ports = AudioPorts::with_capacity(2, 1);
        let mut out = ports.with_output_buffers([AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_output_only(channels.iter_mut().map(Vec::as_mut_slice)),
        }]);
        let mut answered = EventBuffer::new();
        let mut given = heard.as_mut().map(|heard| (0..BLOCK).map(|_| heard()).collect::<Vec<f32>>());
        let mut in_ports = AudioPorts::with_capacity(1, 1);
        let input = in_ports.with_input_buffers(given.iter_mut().map(|given| AudioPortBuffer {
            latency: 0,
            channels: AudioPortBufferType::f32_input_only([InputChannel::variable(given)].into_iter()),
        }));
        processor
            .process(
                &input,
                &mut out,
                &InputEvents::from_buffer(&said),
                &mut OutputEvents::from_buffer(&mut answered),
                Some((block * BLOCK) as u64),
                now.as_ref(),
            )
            .unwrap();
        for sample in channels.iter().flatten() {
            assert!(sample.is_finite() && !sample.is_subnormal(), "{sample} at {rate_hz} Hz");
            peak = peak.max(sample.abs());
        }
    }
    // A microphone at rest blows nothing: only the tongue is heard.
    let least = if heard.is_some() { 1e-5 } else { 1e-3 };
    assert!(peak > least, "something sounds at {rate_hz} Hz: {peak}");
    instance.deactivate(processor.stop_processing());
}

#[cfg(unix)]
#[test]
fn scan_rtld_now() {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: the file is the plugin this project has just built.
    let library = unsafe { Library::open(Some(artefacts::clap().unwrap()), RTLD_NOW | RTLD_LOCAL) }.unwrap();
    // SAFETY: the type is not used.
    assert!(unsafe { library.get::<*const ()>(b"clap_entry\0") }.is_ok());
    std::mem::forget(library);
}

#[test]
fn scan_time() {
    // Another test of this process may have loaded the library, so a copy is scanned.
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("Copy.clap");
    std::fs::copy(artefacts::clap().unwrap(), &copy).unwrap();
    let began = Instant::now();
    // SAFETY: the file is the plugin this project has just built.
    let entry = unsafe { PluginEntry::load(&copy) }.unwrap();
    let count = entry.get_plugin_factory().unwrap().plugin_descriptors().count();
    let took = began.elapsed();
    std::mem::forget(entry);
    assert_eq!(count, 1);
    assert!(took < Duration::from_millis(100), "{took:?}");
}

#[test]
fn what_is_skipped() {
    let entry = library();
    let mut instance = instance(&entry);
    let raw = instance.raw_instance();
    let extension = raw.get_extension.expect("the plugin has extensions");
    for (name, check) in [
        (c"clap.audio-ports-activation/2", "layout-audio-ports-activation"),
        (c"clap.configurable-audio-ports/1", "layout-configurable-audio-ports"),
    ] {
        // SAFETY: the plugin lives, and the name ends with NUL.
        assert!(unsafe { extension(raw, name.as_ptr()) }.is_null(), "check {check}");
    }
    let handle = instance.plugin_handle();
    let ports: PluginAudioPorts = handle.get_extension().unwrap();
    let mut buffer = AudioPortInfoBuffer::new();
    for is_input in [false, true] {
        let port = ports.get(&handle, 0, is_input, &mut buffer).unwrap();
        assert!(!port.flags.contains(AudioPortFlags::SUPPORTS_64BITS), "check process-audio-double-*");
    }
}

/// A microphone is no main input, and the output has the id that projects from before the side-chain have saved.
#[test]
fn the_side_chain_is_beside_the_output_that_was_there_before() {
    let entry = library();
    let mut instance = instance(&entry);
    let handle = instance.plugin_handle();
    let ports: PluginAudioPorts = handle.get_extension().unwrap();
    let mut buffer = AudioPortInfoBuffer::new();
    assert_eq!([true, false].map(|is_input| ports.count(&handle, is_input)), [1, 1]);
    let input = ports.get(&handle, 0, true, &mut buffer).unwrap();
    assert_eq!((input.name, input.channel_count), (&b"Microphone"[..], 1));
    assert!(!input.flags.contains(AudioPortFlags::IS_MAIN));
    let output = ports.get(&handle, 0, false, &mut buffer).unwrap();
    assert_eq!((output.id.get(), output.channel_count), (0, 2));
    assert!(output.flags.contains(AudioPortFlags::IS_MAIN));
}

/// As a host's browser does: the one provider, its one place of factory presets, and every preset in it, loaded by its key.
#[test]
fn preset_discovery_crawl_and_load() {
    let entry = library();
    presets::crawl_and_load(&entry, &mut instance(&entry));
}

#[test]
fn process_varying_sample_rates() {
    for rate_hz in [
        1_000.0, 8_000.0, 12_345.678, 16_000.0, 22_050.0, 44_100.0, 48_000.0, 88_200.5, 96_000.0, 176_400.0,
        192_000.0, 384_000.0, 705_600.0, 768_000.0,
    ] {
        // A low note takes 0.1 s to speak.
        let blocks = (0.3 * rate_hz / BLOCK as f64) as usize + 4;
        play(rate_hz, blocks, |_| None);
    }
}

/// With the microphone on, whose side-chain is full of subnormal numbers.
#[test]
fn process_audio_denormals() {
    let mut rng = Rng::with_seed(41);
    let mut subnormal = || f32::from_bits(rng.u32(1..0x0080_0000) | rng.u32(0..2) << 31);
    assert!(subnormal().is_subnormal());
    let mut instance = instance(&library());
    let (microphone, _) = param(&mut instance, "Microphone");
    let mut is_on = false;
    play_with(&mut instance, 48_000.0, 30, Some(&mut subnormal), |said| {
        if !std::mem::replace(&mut is_on, true) {
            said.push(&ParamValueEvent::new(0, microphone, Pckn::match_all(), 1.0));
        }
        None
    });
    assert_eq!(param(&mut instance, "Microphone").1, 1.0);
}

/// Plays one block of so many samples whose events are said as they are, and looks behind it: neither channel is longer.
fn play_events(instance: &mut PluginInstance<Host>, samples: usize, said: &EventBuffer) -> [Vec<f32>; 2] {
    /// What is behind the host's buffers.
    const BEHIND: f32 = 7.0;
    const ROOM: usize = 16_384;
    let config = PluginAudioConfiguration {
        sample_rate: 48_000.0,
        min_frames_count: 1,
        max_frames_count: BLOCK as u32,
    };
    let Ok(mut processor) = instance.activate(|_, _| (), config).unwrap().start_processing() else {
        panic!("does not start processing")
    };
    let mut channels = [vec![BEHIND; samples + ROOM], vec![BEHIND; samples + ROOM]];
    let mut ports = AudioPorts::with_capacity(2, 1);
    let mut out = ports.with_output_buffers([AudioPortBuffer {
        latency: 0,
        channels: AudioPortBufferType::f32_output_only(
            channels.iter_mut().map(|channel| &mut channel[..samples]),
        ),
    }]);
    let mut answered = EventBuffer::new();
    processor
        .process(
            &InputAudioBuffers::empty(),
            &mut out,
            &InputEvents::from_buffer(said),
            &mut OutputEvents::from_buffer(&mut answered),
            None,
            None,
        )
        .unwrap();
    instance.deactivate(processor.stop_processing());
    for channel in &mut channels {
        assert!(channel[samples..].iter().all(|x| *x == BEHIND), "something was written behind the block");
        channel.truncate(samples);
        assert!(channel.iter().all(|x| x.is_finite() && *x != BEHIND), "the whole block was written");
    }
    channels
}

/// The parameter of this name, and its value.
fn param(instance: &mut PluginInstance<Host>, name: &str) -> (ClapId, f64) {
    let handle = instance.plugin_handle();
    let params: PluginParams = handle.get_extension().unwrap();
    let mut named = (0..params.count(&handle)).filter_map(|at| {
        let mut buffer = ParamInfoBuffer::new();
        let info = params.get_info(&handle, at, &mut buffer)?;
        (info.name == name.as_bytes()).then_some(info.id)
    });
    let id = named.next().unwrap();
    (id, params.get_value(&handle, id).unwrap())
}

/// A host is wrong to say so; it must not be written over for that.
#[test]
fn events_that_a_block_has_no_sample_for_act_at_its_last() {
    const SAMPLES: usize = 512;
    let entry = library();
    for at in [511, 512, 600, 4_000, u32::MAX] {
        let mut instance = instance(&entry);
        let (gain, _) = param(&mut instance, "Gain");
        let mut said = EventBuffer::new();
        said.push(&random_transport(&mut Rng::with_seed(1), at));
        said.push(&ParamValueEvent::new(at, gain, Pckn::match_all(), 0.125));
        said.push(&MidiEvent::new(at, 0, [0x90, 58, 100]));
        play_events(&mut instance, SAMPLES, &said);
        assert_eq!(param(&mut instance, "Gain").1, 0.125, "at {at}");
    }
}

#[test]
fn events_in_disorder_act_in_the_order_they_come() {
    let entry = library();
    let sound = |times: [u32; 5]| {
        let mut instance = instance(&entry);
        let (gain, _) = param(&mut instance, "Gain");
        let set = |at, value| ParamValueEvent::new(at, gain, Pckn::match_all(), value);
        let [key, first, transport, second, bend] = times;
        let mut said = EventBuffer::new();
        said.push(&MidiEvent::new(key, 0, [0x90, 58, 100]));
        said.push(&set(first, 1.0));
        said.push(&random_transport(&mut Rng::with_seed(1), transport));
        said.push(&set(second, 0.25));
        said.push(&MidiEvent::new(bend, 0, [0xE0, 0, 0]));
        let sound = play_events(&mut instance, BLOCK, &said);
        assert_eq!(param(&mut instance, "Gain").1, 0.25, "{times:?}");
        sound
    };
    let in_order = sound([300, 300, 700, 700, 900]);
    assert!(in_order[0].iter().any(|x| x.abs() > 1e-4));
    assert!(sound([300, 100, 700, 0, 900]) == in_order);
    assert!(sound([300, 299, 700, 301, 900]) == in_order);
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
fn transport_fuzz() {
    let mut rng = Rng::with_seed(31);
    play(44_100.0, 50, |_| Some(random_transport(&mut rng, 0)));
}

#[test]
fn transport_fuzz_sample_accurate() {
    let mut rng = Rng::with_seed(37);
    for every in [1, 100, 1_000] {
        play(44_100.0, 10, |said| {
            for at in (0..BLOCK).step_by(every) {
                said.push(&random_transport(&mut rng, at as u32));
            }
            None
        });
    }
}
