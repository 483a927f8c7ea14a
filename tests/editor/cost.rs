//! What a frame costs: the function and the tessellation, without a renderer. `cargo test --no-default-features
//! --features editor-tests --test editor -- cost --nocapture` prints it.

use std::time::{Duration, Instant};

use chalumeau::editor::{EditorState, Tab, WindowState, draw};

use crate::c4;
use crate::support::Fake;

/// Frames before those that count, and those.
const WARM: u32 = 20;
const FRAMES: u32 = 200;
/// Most that a frame may cost, ms of one processor; a quarter of the time between two frames of a screen.
const MOST_MS: f64 = 4.0;

/// Time this thread has been on a processor, if the system tells; it is told every few milliseconds.
fn on_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

/// What each frame took by two clocks: the median on the wall, which a busy machine lengthens, and the mean on the
/// processor, which is coarse. Each is at least what was spent.
struct Cost {
    median_ms: f64,
    on_cpu_ms: f64,
    meshes: usize,
}

fn cost(tab: Tab, scale: f32) -> Cost {
    let (snapshot, host) = (c4(), Fake::default());
    let ctx = egui::Context::default();
    let mut state = EditorState::new(WindowState { tab, ..WindowState::default() });
    let (mut walls, mut meshes, mut begun) = (Vec::new(), 0, on_cpu());
    for frame in 0..WARM + FRAMES {
        if frame == WARM {
            (walls, begun) = (Vec::new(), on_cpu());
        }
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1100.0, 720.0))),
            time: Some(f64::from(frame) / 60.0),
            ..egui::RawInput::default()
        };
        ctx.set_pixels_per_point(scale);
        let at = Instant::now();
        let mut output = ctx.run_ui(input, |ui| {
            draw(ui, &mut state, &host, &snapshot);
        });
        meshes = ctx.tessellate(output.shapes, output.pixels_per_point).len();
        walls.push(at.elapsed());
        output.textures_delta.clear();
    }
    walls.sort();
    let median_ms = 1e3 * walls[walls.len() / 2].as_secs_f64();
    let spent = begun.zip(on_cpu()).map(|(begun, now)| 1e3 * (now - begun).as_secs_f64() / f64::from(FRAMES));
    Cost { median_ms, on_cpu_ms: spent.unwrap_or(median_ms), meshes }
}

#[test]
fn cost_of_a_frame() {
    for scale in [1.0, 2.0] {
        for tab in Tab::ALL {
            let Cost { median_ms, on_cpu_ms, meshes } = cost(tab, scale);
            println!(
                "{:<11} {:3.0} %: median {median_ms:5.2} ms, on the processor {on_cpu_ms:5.2} ms, {meshes} meshes",
                tab.name(),
                100.0 * scale
            );
            assert!(meshes > 0);
            assert!(median_ms.min(on_cpu_ms) <= MOST_MS, "{tab:?}: {median_ms} ms, {on_cpu_ms} ms");
        }
    }
}
