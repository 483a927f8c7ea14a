//! What is drawn against what geometry says.

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Color32, ColorImage, Pos2, Rect, Shape, pos2, vec2};

/// What a frame with these shapes looks like.
fn drawn(size: (f32, f32), scale: f32, clip: Option<Rect>, shapes: Vec<Shape>) -> ColorImage {
    let ctx = egui::Context::default();
    ctx.set_pixels_per_point(scale);
    let input = || egui::RawInput {
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, vec2(size.0, size.1))),
        ..egui::RawInput::default()
    };
    // The scale is that of the next frame.
    ctx.run_ui(input(), |_| {}).textures_delta.clear();
    let mut output = ctx.run_ui(input(), |ui| {
        let painter = ui.ctx().layer_painter(egui::LayerId::background());
        painter.with_clip_rect(clip.unwrap_or(Rect::EVERYTHING)).extend(shapes.clone());
    });
    output.textures_delta.clear();
    chalumeau_raster::picture(&ctx, &output)
}

fn triangles(colour: Color32, triangles: &[[(f32, f32); 3]]) -> Shape {
    let mut mesh = Mesh::default();
    for (x, y) in triangles.iter().flatten() {
        mesh.indices.push(mesh.vertices.len() as u32);
        mesh.vertices.push(Vertex { pos: pos2(*x, *y), uv: WHITE_UV, color: colour });
    }
    Shape::mesh(mesh)
}

/// Pixels of a fan of triangles around a point are covered once each, however its corners lie on the grid of pixels.
#[test]
fn a_pixel_on_an_edge_belongs_to_one_triangle() {
    let half = Color32::from_rgba_premultiplied(100, 100, 100, 100);
    for (x, y) in [(10.0, 10.0), (10.5, 10.5), (7.25, 12.5), (3.1, 15.7)] {
        let corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)];
        for turned in [false, true] {
            let fan: Vec<_> = (0..4)
                .map(|n| {
                    let (a, b) = (corners[n], corners[(n + 1) % 4]);
                    if turned { [(x, y), b, a] } else { [(x, y), a, b] }
                })
                .collect();
            let picture = drawn((20.0, 20.0), 1.0, None, vec![triangles(half, &fan)]);
            assert!(picture.pixels.iter().all(|pixel| *pixel == half), "around {x}, {y}");
        }
    }
}

/// A triangle covers as many pixels as its area says, and a pixel is in it that its centre is in.
#[test]
fn a_triangle_has_its_area_and_its_place() {
    let corners = [(3.0, 2.0), (90.0, 31.0), (20.0, 77.0)];
    let picture = drawn((100.0, 80.0), 1.0, None, vec![triangles(Color32::WHITE, &[corners])]);
    let covered = picture.pixels.iter().filter(|pixel| **pixel == Color32::WHITE).count() as f64;
    let [(ax, ay), (bx, by), (cx, cy)] = corners.map(|(x, y)| (f64::from(x), f64::from(y)));
    let area = 0.5 * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).abs();
    assert!((covered - area).abs() < 0.01 * area, "{covered} pixels, {area}");
    let side = |(px, py): (f64, f64), (qx, qy): (f64, f64), x: f64, y: f64| {
        (qx - px) * (y - py) - (qy - py) * (x - px)
    };
    for y in 0..80 {
        for x in 0..100 {
            let (cx_, cy_) = (x as f64 + 0.5, y as f64 + 0.5);
            let sides = [
                side((ax, ay), (bx, by), cx_, cy_),
                side((bx, by), (cx, cy), cx_, cy_),
                side((cx, cy), (ax, ay), cx_, cy_),
            ];
            if sides.iter().any(|side| side.abs() < 1e-6) {
                continue;
            }
            let inside = sides.iter().all(|side| *side > 0.0);
            assert_eq!(picture[(x, y)] == Color32::WHITE, inside, "pixel {x}, {y}");
        }
    }
}

/// A colour between corners is between theirs, and what is half transparent lets half through.
#[test]
fn colours_are_mixed_between_corners_and_over_each_other() {
    let mut mesh = Mesh::default();
    for (x, y, color) in [
        (0.0, 0.0, Color32::BLACK),
        (100.0, 0.0, Color32::WHITE),
        (100.0, 10.0, Color32::WHITE),
        (0.0, 10.0, Color32::BLACK),
    ] {
        mesh.vertices.push(Vertex { pos: pos2(x, y), uv: WHITE_UV, color });
    }
    mesh.indices = vec![0, 1, 2, 0, 2, 3];
    let veil = Color32::from_rgba_premultiplied(0, 0, 128, 128);
    let cover = Shape::rect_filled(Rect::from_min_max(pos2(50.0, -5.0), pos2(200.0, 20.0)), 0.0, veil);
    let picture = drawn((100.0, 10.0), 1.0, None, vec![Shape::mesh(mesh), cover]);
    for x in 0..100 {
        let expected = 255.0 * (x as f64 + 0.5) / 100.0;
        let [red, green, blue, alpha] = picture[(x, 5)].to_array().map(f64::from);
        assert_eq!(alpha, 255.0, "pixel {x}");
        let behind = if x < 50 {
            expected
        } else if x > 51 {
            expected * 127.0 / 255.0
        } else {
            continue;
        };
        assert!((red - behind).abs() <= 1.0 && red == green, "pixel {x}: {red}, {behind}");
        let blue_there = if x < 50 { behind } else { behind + 128.0 };
        assert!((blue - blue_there).abs() <= 1.0, "pixel {x}: {blue}, {blue_there}");
    }
}

#[test]
fn what_is_clipped_is_not_drawn_at_any_scale() {
    for scale in [1.0, 1.5, 2.0] {
        let clip = Rect::from_min_max(pos2(4.0, 2.0), pos2(12.0, 8.0));
        let all = Rect::from_min_size(Pos2::ZERO, vec2(20.0, 10.0));
        let shape = Shape::rect_filled(all.expand(3.0), 0.0, Color32::GREEN);
        let picture = drawn((20.0, 10.0), scale, Some(clip), vec![shape]);
        let pixel = |points: f32| (points * scale) as usize;
        assert_eq!(picture.size, [pixel(20.0), pixel(10.0)]);
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                let inside = (pixel(4.0)..pixel(12.0)).contains(&x) && (pixel(2.0)..pixel(8.0)).contains(&y);
                let expected = if inside { Color32::GREEN } else { Color32::TRANSPARENT };
                assert_eq!(picture[(x, y)], expected, "pixel {x}, {y} at {scale}");
            }
        }
    }
}
