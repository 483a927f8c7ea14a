//! Pictures of every view of the editor, as the README and the guide show them.
//!
//! `cargo run --example editor_pictures --features editor-tests -- FOLDER [SCALE..] [WIDTHxHEIGHT]` draws each view, light
//! and dark, at each scale (1 and 2 without one), of a written C4 really played.

use std::path::PathBuf;

use chalumeau::editor::{SIZE, Tab};

#[path = "../tests/support/editor.rs"]
mod support;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let folder = PathBuf::from(words.next().unwrap_or_else(|| "target/editor".into()));
    let (mut scales, mut size) = (Vec::new(), SIZE);
    for word in words {
        match word.split_once('x') {
            Some((width, height)) => size = (width.parse()?, height.parse()?),
            None => scales.push(word.parse()?),
        }
    }
    if scales.is_empty() {
        scales = vec![1.0, 2.0];
    }
    support::pictures(&folder, size, &scales, &Tab::ALL);
    Ok(())
}
