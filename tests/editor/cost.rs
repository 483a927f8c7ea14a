//! What a frame costs: the function and the tessellation, without a renderer. Printed, not judged: the machine that runs
//! the tests may be busy. `cargo test --features editor-tests --test editor -- cost --nocapture`.

use std::time::{Duration, Instant};

use chalumeau::editor::{Kept, State, Tab, draw};

use crate::c4;
use crate::support::Fake;

/// Frames before those that count, and those: the system's clock of a thread ticks every few milliseconds.
const WARM: u32 = 20;
const FRAMES: u32 = 200;

/// Time this thread has been on a processor; without such a clock, time on the wall.
fn spent(since: Instant) -> Duration {
    let on_cpu = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let on_cpu = on_cpu.and_then(|text| text.split(' ').next()?.parse().ok());
    on_cpu.map_or_else(|| since.elapsed(), Duration::from_nanos)
}

#[test]
fn cost_of_a_frame() {
    let begun = Instant::now();
    let (snapshot, host) = (c4(), Fake::default());
    for scale in [1.0, 2.0] {
        for tab in Tab::ALL {
            let ctx = egui::Context::default();
            let mut state = State::new(Kept { tab, ..Kept::default() });
            let (mut meshes, mut begin) = (0, Duration::ZERO);
            for frame in 0..WARM + FRAMES {
                if frame == WARM {
                    begin = spent(begun);
                }
                let input = egui::RawInput {
                    screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1100.0, 720.0))),
                    time: Some(f64::from(frame) / 60.0),
                    ..egui::RawInput::default()
                };
                ctx.set_pixels_per_point(scale);
                let mut output = ctx.run_ui(input, |ui| {
                    draw(ui, &mut state, &host, &snapshot);
                });
                let drawn = ctx.tessellate(output.shapes, output.pixels_per_point);
                output.textures_delta.clear();
                meshes = drawn.len();
            }
            let each_ms = 1e3 * (spent(begun) - begin).as_secs_f64() / f64::from(FRAMES);
            println!("{:<11} {:3.0} %: {each_ms:5.2} ms a frame, {meshes} meshes", tab.name(), 100.0 * scale);
            assert!(meshes > 0);
        }
    }
}
