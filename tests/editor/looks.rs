//! How every view looks, held to pictures in `tests/editor/looks/`.
//!
//! Pictures are kept and compared at a quarter of their size: a sixteenth of a pixel's worth of antialiasing, which
//! differs between renderers, disappears, and a control that moves by three points does not. `UPDATE_SNAPSHOTS=1` writes
//! them anew; what differs is put beside the target folder as `target/editor-looks/`.

use std::path::PathBuf;

use chalumeau::editor::{Kept, Tab};
use image::{RgbaImage, imageops};

use crate::c4;
use crate::support::{Fake, picture};

const SIZES: [(f32, f32); 3] = [(1100.0, 720.0), (700.0, 480.0), (1600.0, 1000.0)];
const REDUCED: u32 = 4;
/// A cell counts as different from here on, of 255 (by judgement: twice what blurring a picture by a third of a pixel
/// does), and this many may.
const FAR: i32 = 20;
const MAY_DIFFER: usize = 6;

fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn reduced(picture: &RgbaImage) -> RgbaImage {
    imageops::thumbnail(picture, picture.width() / REDUCED, picture.height() / REDUCED)
}

/// Cells that differ.
fn differences(a: &RgbaImage, b: &RgbaImage) -> usize {
    if a.dimensions() != b.dimensions() {
        return usize::MAX;
    }
    let far = |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        (0..3).any(|channel| (i32::from(a.0[channel]) - i32::from(b.0[channel])).abs() > FAR)
    };
    a.pixels().zip(b.pixels()).filter(far).count()
}

#[test]
fn every_view_looks_as_it_did() {
    let is_update = std::env::var_os("UPDATE_SNAPSHOTS").is_some();
    let (kept_in, failed_in) = (folder("tests/editor/looks"), folder("target/editor-looks"));
    let snapshot = c4();
    let mut wrong = Vec::new();
    for size in SIZES {
        for is_dark in [false, true] {
            for tab in Tab::ALL {
                let kept = Kept { size, is_dark, tab, ..Kept::default() };
                let whole = picture(&kept, &Fake::default(), &snapshot, 1.0);
                let small = reduced(&whole);
                let theme = if is_dark { "dark" } else { "light" };
                let name = format!("{}-{theme}-{}x{}.png", tab.name().to_lowercase(), size.0, size.1);
                let path = kept_in.join(&name);
                if is_update {
                    std::fs::create_dir_all(&kept_in).unwrap();
                    small.save(&path).unwrap();
                    continue;
                }
                let count = match image::open(&path) {
                    Ok(known) => differences(&small, &known.to_rgba8()),
                    Err(reason) => {
                        wrong.push(format!("{name}: {reason}; UPDATE_SNAPSHOTS=1 makes it"));
                        continue;
                    }
                };
                if count > MAY_DIFFER {
                    std::fs::create_dir_all(&failed_in).unwrap();
                    whole.save(failed_in.join(&name)).unwrap();
                    wrong.push(format!("{name}: {count} cells differ, see target/editor-looks"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn a_control_that_moves_or_vanishes_is_seen() {
    let kept = Kept { is_dark: false, ..Kept::default() };
    let whole = picture(&kept, &Fake::default(), &c4(), 1.0);
    let known = reduced(&whole);

    // Vanished: a host without the lip.
    let without = picture(&kept, &Fake::without("lay"), &c4(), 1.0);
    assert!(differences(&reduced(&without), &known) > 10 * MAY_DIFFER);

    // Moved: one slider, three points down. It is cut out with its name and value and put back lower.
    let mut moved = whole.clone();
    let (x, y, width, height) = (716, 126, 245, 38);
    let slider = imageops::crop_imm(&whole, x, y, width, height).to_image();
    imageops::replace(&mut moved, &slider, i64::from(x), i64::from(y) + 3);
    let count = differences(&reduced(&moved), &known);
    assert!(count > MAY_DIFFER, "{count}");

    // Turned: one slider a tenth of its way.
    let host = Fake::default();
    host.automate("lip", 0.6);
    let turned = picture(&kept, &host, &c4(), 1.0);
    let count = differences(&reduced(&turned), &known);
    assert!(count > MAY_DIFFER, "{count}");
}

#[test]
fn another_renderers_edges_are_not() {
    let kept = Kept { is_dark: true, ..Kept::default() };
    let whole = picture(&kept, &Fake::default(), &c4(), 1.0);
    // Edges softer than they were, and every colour off by two.
    let mut other = imageops::blur(&whole, 0.45);
    for (n, pixel) in other.pixels_mut().enumerate() {
        for channel in &mut pixel.0[..3] {
            *channel = if n % 2 == 0 { channel.saturating_add(2) } else { channel.saturating_sub(2) };
        }
    }
    let count = differences(&reduced(&other), &reduced(&whole));
    assert!(count <= MAY_DIFFER, "{count}");
}

/// Pictures for people, at full size: `EDITOR_PICTURES=FOLDER[,WIDTHxHEIGHT][,SCALE]..`.
#[test]
#[ignore = "writes pictures for people"]
fn pictures() {
    let text = std::env::var("EDITOR_PICTURES").unwrap_or_else(|_| "target/editor".into());
    let mut words = text.split(',');
    let folder = folder(words.next().unwrap());
    let (mut size, mut scales) = (chalumeau::editor::SIZE, Vec::new());
    for word in words {
        match word.split_once('x') {
            Some((width, height)) => size = (width.parse().unwrap(), height.parse().unwrap()),
            None => scales.push(word.parse().unwrap()),
        }
    }
    crate::support::pictures(&folder, size, if scales.is_empty() { &[1.0, 2.0] } else { &scales }, &Tab::ALL);
}
