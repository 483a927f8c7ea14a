//! Axes: values to pixels, and what of lines and shapes lies between them.

use crate::draw::canvas::PixelPoint;

/// Values to pixels.
pub struct PlotArea {
    pub x: Extent,
    pub y: Extent,
}

/// One axis: values and the pixels they fall on.
pub struct Extent {
    pub low: f64,
    pub high: f64,
    pub from: f64,
    pub to: f64,
    pub log: bool,
}

impl Extent {
    pub fn at(&self, value: f64) -> f64 {
        let unit = if self.log {
            (value.max(1e-300) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        // Far outside is as good as just outside, and keeps pixels countable.
        self.from + unit.clamp(-1e3, 1e3) * (self.to - self.from)
    }

    pub fn holds(&self, value: f64) -> bool {
        let slack = 1e-9 * (self.high - self.low).abs();
        (self.low - slack..=self.high + slack).contains(&value)
    }
}

impl PlotArea {
    pub fn at(&self, [x, y]: [f64; 2]) -> PixelPoint {
        (self.x.at(x), self.y.at(y))
    }

    pub fn left(&self) -> f64 {
        self.x.from
    }

    pub fn right(&self) -> f64 {
        self.x.to
    }

    pub fn top(&self) -> f64 {
        self.y.to
    }

    pub fn bottom(&self) -> f64 {
        self.y.from
    }
}

/// The parts of a line inside the axes (Liang and Barsky, 1984).
pub fn clip_line(points: &[PixelPoint], frame: &PlotArea) -> Vec<Vec<PixelPoint>> {
    let (x0, x1, y0, y1) = (frame.left(), frame.right(), frame.top(), frame.bottom());
    let mut parts: Vec<Vec<PixelPoint>> = Vec::new();
    let mut open = false;
    for pair in points.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (step, room) in [(-dx, a.0 - x0), (dx, x1 - a.0), (-dy, a.1 - y0), (dy, y1 - a.1)] {
            if step == 0.0 {
                if room < 0.0 {
                    to = -1.0;
                }
            } else if step < 0.0 {
                from = from.max(room / step);
            } else {
                to = to.min(room / step);
            }
        }
        if from > to {
            open = false;
            continue;
        }
        let at = |part: f64| (a.0 + part * dx, a.1 + part * dy);
        match parts.last_mut() {
            Some(part) if open && from == 0.0 => part.push(at(to)),
            _ => parts.push(vec![at(from), at(to)]),
        }
        open = to == 1.0;
    }
    parts
}

/// The part of a shape inside the axes (Sutherland and Hodgman, 1974).
pub fn clip_polygon(mut corners: Vec<PixelPoint>, frame: &PlotArea) -> Vec<PixelPoint> {
    let (x0, x1, y0, y1) = (frame.left(), frame.right(), frame.top(), frame.bottom());
    let inside: [&dyn Fn(PixelPoint) -> f64; 4] =
        [&|p| p.0 - x0, &|p| x1 - p.0, &|p| p.1 - y0, &|p| y1 - p.1];
    for inside in inside {
        let mut kept = Vec::with_capacity(corners.len() + 4);
        for (index, &b) in corners.iter().enumerate() {
            let a = corners[(index + corners.len() - 1) % corners.len()];
            let (da, db) = (inside(a), inside(b));
            if (da < 0.0) != (db < 0.0) {
                let part = da / (da - db);
                kept.push((a.0 + part * (b.0 - a.0), a.1 + part * (b.1 - a.1)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        corners = kept;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> PlotArea {
        let extent = |from, to| Extent { low: 0.0, high: 10.0, from, to, log: false };
        PlotArea { x: extent(0.0, 100.0), y: extent(100.0, 0.0) }
    }

    #[test]
    fn lines_are_cut_at_the_axes() {
        let parts = clip_line(&[(-50.0, 50.0), (150.0, 50.0), (150.0, -20.0), (50.0, 20.0)], &frame());
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], [(0.0, 50.0), (100.0, 50.0)]);
        assert_eq!(parts[1].last(), Some(&(50.0, 20.0)));
        assert!(parts.iter().flatten().all(|p| (0.0..=100.0).contains(&p.0) && (0.0..=100.0).contains(&p.1)));
        assert!(clip_line(&[(-5.0, 0.0), (-5.0, 100.0)], &frame()).is_empty());
    }

    #[test]
    fn shapes_are_cut_at_the_axes() {
        let cut = clip_polygon(vec![(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)], &frame());
        let mut corners: Vec<(i32, i32)> = cut.iter().map(|p| (p.0 as i32, p.1 as i32)).collect();
        corners.sort_unstable();
        corners.dedup();
        assert_eq!(corners, [(0, 0), (0, 50), (50, 0), (50, 50)]);
    }
}
