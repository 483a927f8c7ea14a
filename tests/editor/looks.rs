//! How every view looks, held to pictures in `tests/editor/looks/`.
//!
//! Pictures are kept and compared at a quarter of their size: small files, in which edges that lie elsewhere by a part of a pixel have
//! nearly gone. Mesa's pictures of the same frames differ from ours by less than the limit, edges blurred by 0.45 pixels by 10 of 255. A
//! control that moves by four points, or goes, changes tens of cells by more. `UPDATE_SNAPSHOTS=1` writes the pictures anew; what
//! differs is put into `target/editor-looks/`.

use std::path::PathBuf;

use chalumeau::editor::{Snapshot, Tab, WindowState};
use egui::{Pos2, Rect};
use egui_kittest::kittest::Queryable;
use image::{RgbaImage, imageops};

use crate::c4;
use crate::fingerings::found;
use crate::some::{all_cases, some};
use crate::support::{Fake, picture, shot, things, window};

const SIZES: [(f32, f32); 3] = [(1100.0, 720.0), (700.0, 480.0), (1600.0, 1000.0)];
const REDUCED: u32 = 4;
/// A cell counts as different above this, of 255, and so many may.
const FAR: i32 = 10;
const MAY_DIFFER: usize = 2;

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

/// The browser of presets, in place of a view.
fn browser(kept: &WindowState, snapshot: &Snapshot) -> RgbaImage {
    let host = Fake::default();
    let mut window = window(kept, &host, snapshot, 1.0);
    window.state_mut().show_presets(true);
    window.run();
    shot(&window, 1.0)
}

/// The clarinet view while fingerings of its note are looked for.
fn search(kept: &WindowState, snapshot: &Snapshot) -> RgbaImage {
    let host = Fake::default();
    let snapshot = Snapshot { fingerings: found(60, None), ..snapshot.clone() };
    let mut window = window(kept, &host, &snapshot, 1.0);
    window.get_by_label("Find fingerings").click();
    window.run();
    shot(&window, 1.0)
}

#[test]
fn every_view_looks_as_it_did() {
    let is_update = std::env::var_os("UPDATE_SNAPSHOTS").is_some();
    let (kept_in, failed_in) = (folder("tests/editor/looks"), folder("target/editor-looks"));
    let snapshot = c4();
    let mut wrong = Vec::new();
    // The usual size in both themes, the smallest in one.
    let is_looked_at =
        |size, is_dark| is_update || all_cases() || size == SIZES[0] || (size == SIZES[1] && is_dark);
    for size in SIZES {
        for is_dark in [false, true].into_iter().filter(|is_dark| is_looked_at(size, *is_dark)) {
            let views = Tab::ALL.map(|tab| (tab, tab.name().to_lowercase()));
            let beside = [(Tab::Play, "presets"), (Tab::Clarinet, "fingerings")];
            for (tab, view) in views.into_iter().chain(beside.map(|(tab, name)| (tab, name.to_owned()))) {
                let kept = WindowState { size, is_dark, tab, ..WindowState::default() };
                let whole = match view.as_str() {
                    "presets" => browser(&kept, &snapshot),
                    "fingerings" => search(&kept, &snapshot),
                    _ => picture(&kept, &Fake::default(), &snapshot, 1.0),
                };
                let small = reduced(&whole);
                let theme = if is_dark { "dark" } else { "light" };
                let name = format!("{view}-{theme}-{}x{}.png", size.0, size.1);
                let path = kept_in.join(&name);
                if is_update {
                    std::fs::create_dir_all(&kept_in).unwrap();
                    small.save(&path).unwrap();
                    continue;
                }
                let count = match image::open(&path) {
                    Ok(known) => differences(&small, &known.to_rgba8()),
                    Err(_) => usize::MAX,
                };
                if count > MAY_DIFFER {
                    std::fs::create_dir_all(&failed_in).unwrap();
                    whole.save(failed_in.join(&name)).unwrap();
                    let told = if count == usize::MAX {
                        "is new or of another size".into()
                    } else {
                        format!("{count} cells differ")
                    };
                    wrong.push(format!(
                        "{name}: {told}, see target/editor-looks; UPDATE_SNAPSHOTS=1 keeps it"
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// The cells around a control, as they are, and with the control elsewhere by `by` or nowhere; `None` where it is not in
/// the picture.
fn changed(whole: &RgbaImage, rect: Rect, by: Option<(i64, i64)>) -> Option<(RgbaImage, RgbaImage)> {
    let inside = Rect::from_min_size(Pos2::ZERO, egui::vec2(whole.width() as f32, whole.height() as f32));
    if !inside.contains_rect(rect.expand(1.0)) {
        return None;
    }
    let cell = |points: f32| (points.max(0.0) as u32) / REDUCED * REDUCED;
    let around = rect.expand(2.5 * REDUCED as f32);
    let (left, top) = (cell(around.left()), cell(around.top()));
    let (right, bottom) =
        (cell(around.right()).min(whole.width()), cell(around.bottom()).min(whole.height()));
    let as_it_is = imageops::crop_imm(whole, left, top, right - left, bottom - top).to_image();
    let rect = rect.expand(1.0);
    let (x, y) = (rect.left() as u32 - left, rect.top() as u32 - top);
    let part = imageops::crop_imm(&as_it_is, x, y, rect.width() as u32, rect.height() as u32).to_image();
    // What is around it: the pixel of its corner.
    let behind = RgbaImage::from_pixel(part.width(), part.height(), *part.get_pixel(0, 0));
    let mut changed = as_it_is.clone();
    imageops::replace(&mut changed, &behind, x.into(), y.into());
    // Scrolled out of sight.
    if changed == as_it_is {
        return None;
    }
    if let Some((right, down)) = by {
        imageops::replace(&mut changed, &part, i64::from(x) + right, i64::from(y) + down);
    }
    Some((as_it_is, changed))
}

/// Each control of each view is moved by four points, and taken away: both fail the comparison of the pictures kept.
#[test]
fn every_control_that_moves_or_vanishes_is_seen() {
    let (snapshot, host) = (c4(), Fake::default());
    for is_dark in some(vec![true, false], 2) {
        for tab in Tab::ALL {
            let kept = WindowState { is_dark, tab, ..WindowState::default() };
            let window = window(&kept, &host, &snapshot, 1.0);
            let whole = shot(&window, 1.0);
            let (mut count, mut least) = (0, (usize::MAX, String::new()));
            for (name, rect) in things(&window) {
                for by in [None, Some((4, 0)), Some((0, 4))] {
                    let Some((as_it_is, changed)) = changed(&whole, rect, by) else { continue };
                    let seen = differences(&reduced(&changed), &reduced(&as_it_is));
                    assert!(seen > MAY_DIFFER, "{tab:?}, dark {is_dark}: {name} by {by:?}: {seen} cells");
                    least = least.min((seen, format!("{name} by {by:?}")));
                    count += usize::from(by.is_none());
                }
            }
            println!("{tab:?}, dark {is_dark}: {count} controls, least {} cells ({})", least.0, least.1);
            assert!(count > 12, "{tab:?}: {count} controls");
        }
    }
}

#[test]
fn a_control_that_the_host_lacks_or_turns_is_seen() {
    let kept = WindowState { is_dark: false, ..WindowState::default() };
    let known = reduced(&picture(&kept, &Fake::default(), &c4(), 1.0));

    // Vanished, and what was below it is higher.
    let without = picture(&kept, &Fake::without("lay"), &c4(), 1.0);
    assert!(differences(&reduced(&without), &known) > 10 * MAY_DIFFER);

    // Turned: one slider a tenth of its way.
    let host = Fake::default();
    host.automate("lip", 0.6);
    let turned = picture(&kept, &host, &c4(), 1.0);
    let count = differences(&reduced(&turned), &known);
    assert!(count > MAY_DIFFER, "{count}");
}

#[test]
fn softer_edges_are_not() {
    let kept = WindowState { is_dark: true, ..WindowState::default() };
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
