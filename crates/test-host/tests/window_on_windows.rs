//! The plugin's window inside a window of Windows, while a note sounds. Each test waits until somebody closes its window:
//! `cargo xtask cross windows` runs them under Wine, looks at the windows and closes them. By hand:
//! `cargo test -p chalumeau-test-host --test window_on_windows -- --ignored --test-threads=1`.
#![cfg(windows)]

use std::time::{Duration, Instant};

use chalumeau_test_host::artefacts;
use chalumeau_test_host::clap::{At, Plugin, Say};
use chalumeau_test_host::frame::Frame;
use vst3_host::prelude::*;
use vst3_host::{AudioBuffers, MidiChannel, MidiEvent, WindowHandle};

const RATE: f64 = 48_000.0;
/// A hundredth of a second.
const BLOCK: usize = 480;
const KEY: u8 = 60;
/// How long somebody may look.
const PATIENCE: Duration = Duration::from_secs(300);

/// Calls `block` a hundred times a second until the window is to close; what it returns are samples. They must be heard.
fn until_closed(frame: &Frame, mut block: impl FnMut() -> Vec<f32>) {
    let began = Instant::now();
    let (mut blocks, mut loudest) = (0, 0.0_f32);
    while !frame.is_asked_to_close() {
        assert!(began.elapsed() < PATIENCE, "nobody has closed the window");
        frame.attend();
        loudest = block().iter().fold(loudest, |most, sample| most.max(sample.abs()));
        blocks += 1;
        std::thread::sleep((began + Duration::from_millis(10 * blocks)) - Instant::now());
    }
    println!("{blocks} blocks in {:.1} s, loudest sample {loudest:.3}", began.elapsed().as_secs_f64());
    assert!(loudest > 0.01, "the note is not heard: {loudest}");
}

#[test]
#[ignore = "waits until its window is closed"]
fn the_clap() {
    let mut plugin = Plugin::load(&artefacts::clap().unwrap()).unwrap();
    let frame = Frame::new("The CLAP", plugin.window_size().unwrap()).unwrap();
    let mut session = plugin.activate(RATE, BLOCK).unwrap();
    plugin.open_window(|_, _| Ok(frame.handle())).unwrap();
    let mut said = vec![At(0, Say::NoteOn(KEY.into(), 0.8))];
    until_closed(&frame, || {
        plugin.attend();
        let [left, _] = session.play(&std::mem::take(&mut said), BLOCK).unwrap();
        left
    });
    plugin.close_window().unwrap();
    plugin.deactivate(session);
}

#[test]
#[ignore = "waits until its window is closed"]
fn the_vst3() {
    let mut host = Vst3Host::builder().sample_rate(RATE).block_size(BLOCK).build().unwrap();
    let mut plugin = host.load_plugin(artefacts::vst3().unwrap()).unwrap();
    let (width, height) = plugin.get_editor_size().unwrap();
    let frame = Frame::new("The VST3", (width as u32, height as u32)).unwrap();
    plugin.start_processing().unwrap();
    // SAFETY: the window outlives the editor, which is closed below.
    plugin.open_editor(unsafe { WindowHandle::from_hwnd(frame.handle()) }).unwrap();
    let on = MidiEvent::NoteOn { channel: MidiChannel::Ch1, note: KEY, velocity: 100 };
    plugin.send_midi_event_at(on, 0).unwrap();
    until_closed(&frame, || {
        let mut buffers = AudioBuffers::new(0, 2, BLOCK, RATE);
        plugin.process_audio(&mut buffers).unwrap();
        buffers.outputs[0].clone()
    });
    plugin.close_editor().unwrap();
    plugin.stop_processing().unwrap();
    // The library stays loaded until the program ends: see `chalumeau_test_host::clap::Plugin::load`.
    std::mem::forget((plugin, host));
}
