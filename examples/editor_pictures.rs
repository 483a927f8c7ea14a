//! Pictures of every view of the editor, as the README and the guide show them.
//!
//! `cargo run --example editor_pictures --features editor-tests -- FOLDER [SCALE...]` draws each view, light and dark, at
//! each scale (1 and 2 without one), of a written C4 really played.

use std::path::PathBuf;

use chalumeau::editor::{Kept, SIZE, State, Tab, draw};
use egui_kittest::Harness;

#[path = "../tests/support/editor.rs"]
mod support;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let folder = PathBuf::from(words.next().unwrap_or_else(|| "target/editor".into()));
    let mut scales: Vec<f32> = Vec::new();
    let mut size = SIZE;
    for word in words {
        match word.split_once('x') {
            Some((width, height)) => size = (width.parse()?, height.parse()?),
            None => scales.push(word.parse()?),
        }
    }
    if scales.is_empty() {
        scales = vec![1.0, 2.0];
    }
    std::fs::create_dir_all(&folder)?;
    let snapshot = support::c4();
    for scale in scales {
        for is_dark in [false, true] {
            for tab in Tab::ALL {
                let controls = support::Fake::default();
                let state = State::new(Kept { is_dark, tab, ..Kept::default() });
                let mut harness = Harness::builder().with_size(size).with_pixels_per_point(scale).build_ui_state(
                    |ui, state: &mut State| {
                        draw(ui, state, &controls, &snapshot);
                    },
                    state,
                );
                harness.run();
                let theme = if is_dark { "dark" } else { "light" };
                let name = format!("{}-{theme}-{:.0}.png", tab.name().to_lowercase(), 100.0 * scale);
                harness.render()?.save(folder.join(&name))?;
                println!("{}", folder.join(name).display());
            }
        }
    }
    Ok(())
}
