//! Round things lit from above: the body, rings, rods and pads, as meshes between two outlines.

use egui::{Color32, Mesh, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};

/// Light over a cylinder from its upper edge (-1) to its lower edge (1): 1 is the colour itself.
const LIGHT: [(f32, f32); 8] = [
    (-1.0, 0.62),
    (-0.8, 0.98),
    (-0.5, 1.32),
    (-0.3, 1.16),
    (0.0, 0.96),
    (0.4, 0.76),
    (0.8, 0.56),
    (1.0, 0.46),
];

/// A colour under a light: 1 is the colour itself, above it goes towards white, below towards black.
pub fn lit(colour: Color32, light: f32) -> Color32 {
    if light >= 1.0 {
        colour.lerp_to_gamma(Color32::WHITE, (light - 1.0).min(1.0))
    } else {
        Color32::BLACK.lerp_to_gamma(colour, light.max(0.0))
    }
}

/// A round body along the x axis: places from left to right with radius and colour.
pub fn turned(painter: &Painter, axis_y: f32, stations: &[(f32, f32, Color32)]) {
    let mut mesh = Mesh::default();
    let rows = LIGHT.len() as u32;
    for (index, &(x, radius, colour)) in stations.iter().enumerate() {
        for (height, light) in LIGHT {
            mesh.colored_vertex(pos2(x, axis_y + height * radius), lit(colour, light));
        }
        if index > 0 {
            let base = index as u32 * rows;
            for row in 1..rows {
                let (here, before) = (base + row, base + row - rows);
                mesh.add_triangle(before - 1, before, here - 1);
                mesh.add_triangle(before, here - 1, here);
            }
        }
    }
    painter.add(mesh);
    // A mesh ends in steps of whole pixels; lines do not.
    for part in stations.chunk_by(|one, next| one.2 == next.2) {
        for (side, light) in [(-1.0, LIGHT[0].1), (1.0, LIGHT[LIGHT.len() - 1].1)] {
            let edge: Vec<Pos2> =
                part.iter().map(|&(x, radius, _)| pos2(x, axis_y + side * radius)).collect();
            painter.add(Shape::line(edge, Stroke::new(1.0, lit(part[0].2, light))));
        }
    }
}

/// A short cylinder, such as a ring, of one radius.
pub fn band(painter: &Painter, axis_y: f32, x: std::ops::RangeInclusive<f32>, radius: f32, colour: Color32) {
    turned(painter, axis_y, &[(*x.start(), radius, colour), (*x.end(), radius, colour)]);
}

/// A round plate seen from above, with a light towards its upper left.
pub fn plate(painter: &Painter, centre: Pos2, radius: Vec2, colour: Color32, edge: Stroke) {
    painter.add(Shape::ellipse_filled(centre, radius, lit(colour, 0.72)));
    painter.add(Shape::ellipse_filled(centre - 0.10 * radius, 0.80 * radius, colour));
    painter.add(Shape::ellipse_filled(centre - 0.26 * radius, 0.42 * radius, lit(colour, 1.28)));
    painter.add(Shape::ellipse_stroke(centre, radius, edge));
}

/// A soft shadow under a body.
pub fn shadow(painter: &Painter, rect: Rect, strength: f32) {
    let mut mesh = Mesh::default();
    let (middle, half) = (rect.center(), 0.5 * rect.size());
    let dark = Color32::from_black_alpha((255.0 * strength) as u8);
    mesh.colored_vertex(middle, dark);
    let rim = 48;
    for n in 0..=rim {
        let turn = std::f32::consts::TAU * n as f32 / rim as f32;
        mesh.colored_vertex(middle + vec2(half.x * turn.cos(), half.y * turn.sin()), Color32::TRANSPARENT);
        if n > 0 {
            mesh.add_triangle(0, n, n + 1);
        }
    }
    painter.add(mesh);
}

/// A light that fades towards its rim.
pub fn glow(painter: &Painter, centre: Pos2, radius: f32, colour: Color32) {
    let mut mesh = Mesh::default();
    mesh.colored_vertex(centre, colour);
    let rim = 24;
    for n in 0..=rim {
        let turn = std::f32::consts::TAU * n as f32 / rim as f32;
        mesh.colored_vertex(centre + radius * Vec2::angled(turn), Color32::TRANSPARENT);
        if n > 0 {
            mesh.add_triangle(0, n, n + 1);
        }
    }
    painter.add(mesh);
}
