//! Pictures of the editor, as its tests and the guide show them, of a written C4 really played.
//!
//! `cargo run --example editor_pictures --features editor-tests -- FOLDER [guide] [SCALE..] [WIDTHxHEIGHT]` draws each view,
//! light and dark, at each scale (1 and 2 without one); with `guide` those the guide shows, once, and as small as they get.

use std::fs::File;
use std::path::{Path, PathBuf};

use chalumeau::editor::{SIZE, Tab, WindowState};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

#[path = "../tests/support/editor.rs"]
mod support;

/// View, dark or light.
const GUIDE: [(Tab, bool); 7] = [
    (Tab::Play, true),
    (Tab::Reed, true),
    (Tab::Clarinet, false),
    (Tab::Breath, true),
    (Tab::Sound, true),
    (Tab::Knob, true),
    (Tab::Instrument, false),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let folder = PathBuf::from(words.next().unwrap_or_else(|| "target/editor".into()));
    let (mut scales, mut size, mut is_guide) = (Vec::new(), SIZE, false);
    for word in words {
        match word.split_once('x') {
            _ if word == "guide" => is_guide = true,
            Some((width, height)) => size = (width.parse()?, height.parse()?),
            None => scales.push(word.parse()?),
        }
    }
    if is_guide {
        return guide(&folder, size);
    }
    if scales.is_empty() {
        scales = vec![1.0, 2.0];
    }
    support::pictures(&folder, size, &scales, &Tab::ALL);
    Ok(())
}

fn guide(folder: &Path, size: (f32, f32)) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let snapshot = support::c4();
    for (tab, is_dark) in GUIDE {
        let kept = WindowState { is_dark, tab, size, ..WindowState::default() };
        let theme = if is_dark { "dark" } else { "light" };
        let path = folder.join(format!("{}-{theme}.png", tab.name().to_lowercase()));
        let picture = support::picture(&kept, &support::Fake::linking(), &snapshot, 1.0);
        let picture = image::DynamicImage::ImageRgba8(picture).into_rgb8();
        let encoder =
            PngEncoder::new_with_quality(File::create(&path)?, CompressionType::Best, FilterType::Adaptive);
        picture.write_with_encoder(encoder)?;
        println!("{}", path.display());
    }
    Ok(())
}
