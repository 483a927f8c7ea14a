//! The outer shape of a clarinet, for its drawings. It is plausible: a file knows the bore and the depth of the holes, but not the
//! wood. Each view has a scale of its own.

use chalumeau_core::bore::instrument_file::InstrumentFile;

/// Thickness of the wood where no hole gives it, and at the rim of the bell, m.
const WALL_M: f64 = 7e-3;
const RIM_M: f64 = 2.5e-3;
/// Thinnest and thickest wood, m: the median of the holes may be far from any.
const WALLS_M: (f64, f64) = (4e-3, 9e-3);
/// Length of a mouthpiece's beak, m.
pub const BEAK_M: f64 = 0.055;
/// Thickness at the tip of the beak over that at its end.
const TIP: f64 = 0.12;

/// The measures that the shape is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyShape {
    /// Length of the bore, m.
    pub length_m: f64,
    /// Thickness of the wood above the last hole, m.
    pub wall_m: f64,
    /// Largest radius of the outside, m.
    pub widest_m: f64,
    last_hole_m: f64,
}

impl BodyShape {
    /// Of an instrument.
    pub fn new(file: &InstrumentFile) -> Self {
        let mut depths: Vec<f64> = file.holes.iter().map(|hole| hole.chimney_m).collect();
        depths.sort_by(f64::total_cmp);
        let wall_m = depths.get(depths.len() / 2).copied().unwrap_or(WALL_M).clamp(WALLS_M.0, WALLS_M.1);
        let widest_m = file.bore.iter().map(|s| s.r_start_m.max(s.r_end_m)).fold(0.0, f64::max) + RIM_M;
        let last_hole_m = file.holes.iter().map(|hole| hole.x_m).fold(0.0, f64::max);
        Self { length_m: file.length_m(), wall_m, widest_m, last_hole_m }
    }

    /// Radius of the outside at a place, m, of a body whose bore is seen in it: `bore_m` is its radius there.
    pub fn around_bore_m(&self, x_m: f64, bore_m: f64) -> f64 {
        bore_m + beak(x_m) * self.wood_m(x_m)
    }

    /// The same of a body that is seen from outside: its beak is pointed, whatever the bore.
    pub fn outside_m(&self, x_m: f64, bore_m: f64) -> f64 {
        beak(x_m) * (bore_m + self.wood_m(x_m))
    }

    /// Thickness of the wood, m, which thins out towards the rim of the bell.
    fn wood_m(&self, x_m: f64) -> f64 {
        let way = (x_m - self.last_hole_m) / (self.length_m - self.last_hole_m).max(1e-6);
        self.wall_m + (RIM_M - self.wall_m) * way.clamp(0.0, 1.0).sqrt()
    }
}

/// How far the beak has widened at a place, 0..=1.
fn beak(x_m: f64) -> f64 {
    (x_m / BEAK_M).clamp(TIP, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wood_is_around_the_bore_and_ends_in_beak_and_rim() {
        let file = InstrumentFile::built_in();
        let shape = BodyShape::new(&file);
        for n in 0..=100 {
            let x_m = 0.01 * f64::from(n) * (shape.length_m - 1e-9);
            let bore_m = file.radius_at(x_m);
            let (around, outside) = (shape.around_bore_m(x_m, bore_m), shape.outside_m(x_m, bore_m));
            assert!(around > bore_m && outside > 0.0, "{x_m}");
            assert!((around - outside).abs() < 1e-12 || x_m < BEAK_M, "one body beyond the beak: {x_m}");
            assert!(around <= shape.widest_m + shape.wall_m, "{x_m}");
        }
        let end_m = file.bore.last().unwrap().r_end_m;
        assert!((shape.around_bore_m(shape.length_m, end_m) - end_m - RIM_M).abs() < 1e-9);
    }
}
