//! What a frame costs, in frames of plain widgets that are drawn on the same machine: the function and the tessellation, without a
//! renderer. `cargo test --no-default-features --features editor-tests --test editor -- cost --nocapture` prints it.

use std::time::{Duration, Instant};

use chalumeau::editor::{EditorState, Tab, WindowState, draw};

use crate::c4;
use crate::support::Fake;

/// Frames before those that count, and those.
const WARM: u32 = 10;
const FRAMES: u32 = 60;
/// Rows of the plain widgets: so many as a view has controls, labels and curves together, by judgement.
const ROWS: u32 = 100;
/// Most that a frame may cost, in frames of the plain widgets. Builds for tests leave our code without optimisation, but not egui's.
const MOST: f64 = 2.5;
/// How often a view is measured that seems to cost more. What other programs add passes; what a view costs does not.
const ATTEMPTS: u32 = 5;

/// Time this thread has been on a processor, if the system tells; it is told every few milliseconds.
fn on_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}

/// What a frame took by two clocks: the median on the wall, which a busy machine lengthens, and the mean on the
/// processor, which is coarse. Each is at least what was spent.
struct Cost {
    median_ms: f64,
    on_cpu_ms: f64,
    meshes: usize,
}

impl Cost {
    fn of(scale: f32, mut draw: impl FnMut(&mut egui::Ui)) -> Self {
        let ctx = egui::Context::default();
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
            let mut output = ctx.run_ui(input, |ui| draw(ui));
            meshes = ctx.tessellate(output.shapes, output.pixels_per_point).len();
            walls.push(at.elapsed());
            output.textures_delta.clear();
        }
        walls.sort();
        let median_ms = 1e3 * walls[walls.len() / 2].as_secs_f64();
        let spent =
            begun.zip(on_cpu()).map(|(begun, now)| 1e3 * (now - begun).as_secs_f64() / f64::from(FRAMES));
        Self { median_ms, on_cpu_ms: spent.unwrap_or(median_ms), meshes }
    }

    fn ms(&self) -> f64 {
        self.median_ms.min(self.on_cpu_ms)
    }
}

/// Labels and sliders of egui alone.
fn plain(ui: &mut egui::Ui) {
    for row in 0..ROWS {
        ui.horizontal(|ui| {
            ui.label(format!("Row {row}"));
            ui.add(egui::Slider::new(&mut 0.5, 0.0..=1.0));
        });
    }
}

#[test]
fn cost_of_a_frame() {
    let (snapshot, host) = (c4(), Fake::default());
    let mut dear = Vec::new();
    for scale in [1.0, 2.0] {
        for tab in Tab::ALL {
            let measured = || {
                let unit_ms = Cost::of(scale, plain).ms();
                let mut state = EditorState::new(WindowState { tab, ..WindowState::default() });
                let cost = Cost::of(scale, |ui| {
                    draw(ui, &mut state, &host, &snapshot);
                });
                let Cost { median_ms, on_cpu_ms, meshes } = cost;
                let ratio = cost.ms() / unit_ms;
                println!(
                    "{:<11} {:3.0} %: median {median_ms:5.2} ms, on the processor {on_cpu_ms:5.2} ms, {ratio:.2} of plain widgets \
                     ({unit_ms:.2} ms), {meshes} meshes",
                    tab.name(),
                    100.0 * scale
                );
                assert!(meshes > 0);
                ratio
            };
            if (0..ATTEMPTS).all(|_| measured() > MOST) {
                dear.push((tab.name(), scale));
            }
        }
    }
    assert!(dear.is_empty(), "more than {MOST} of plain widgets: {dear:?}");
}
