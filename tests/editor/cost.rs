//! What a frame costs: the function and the tessellation, without a renderer. Printed, not judged: the machine that runs
//! the tests may be busy. `cargo test --features editor-tests --test editor -- cost --nocapture`.

use std::time::{Duration, Instant};

use chalumeau::editor::{Kept, State, Tab, draw};

use crate::c4;
use crate::support::Fake;

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
            let mut times = Vec::new();
            let mut shapes = 0;
            for frame in 0..120 {
                let input = egui::RawInput {
                    screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1100.0, 720.0))),
                    time: Some(f64::from(frame) / 60.0),
                    ..egui::RawInput::default()
                };
                ctx.set_pixels_per_point(scale);
                let before = spent(begun);
                let output = ctx.run_ui(input, |ui| {
                    draw(ui, &mut state, &host, &snapshot);
                });
                let drawn = ctx.tessellate(output.shapes, output.pixels_per_point);
                let took = spent(begun) - before;
                shapes = drawn.len();
                if frame >= 20 {
                    times.push(took);
                }
            }
            times.sort();
            let (median, most) = (times[times.len() / 2], times[times.len() - 1]);
            println!(
                "{:<11} {:3.0} %: {:5.2} ms, at most {:5.2} ms, {shapes} meshes",
                tab.name(),
                100.0 * scale,
                1e3 * median.as_secs_f64(),
                1e3 * most.as_secs_f64()
            );
            assert!(shapes > 0);
        }
    }
}
