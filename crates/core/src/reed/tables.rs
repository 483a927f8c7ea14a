//! The pressure tables shared by sound, touch and firmware.
//!
//! The tables have 3601 entries over one turn of the knob, one entry every tenth of a degree. Entry `i` belongs to the
//! pressure difference `x = i / 3600`, where 1 is the closing pressure. The flow law `u = H x_a - x_b / k` needs
//! `x_a = sqrt(x)` and `x_b = x^1.5`. The grid is `i * (1/3600)` with the last entry set to 1, as numpy's `linspace`
//! computes it in the notebook; `i / 3600` would differ in the last bit of 29 entries.
//!
//! ```
//! use chalumeau_core::reed::ReedTables;
//!
//! let tables = ReedTables::reference();
//! assert_eq!((tables.x[900], tables.x_a[900], tables.x_b[900]), (0.25, 0.5, 0.125));
//! // Between two entries the tables are interpolated.
//! let (root, _) = tables.at(0.3);
//! assert!((root - 0.3_f64.sqrt()).abs() < 3.0e-4);
//! ```

use std::sync::LazyLock;

/// Index of the last table entry.
pub const LAST: usize = 3600;

/// Pressure tables over 0..=1 of the reference closing pressure. All values are dimensionless.
#[derive(Clone, Debug, PartialEq)]
pub struct ReedTables {
    /// Pressure difference, 0..=1.
    pub x: Box<[f64; LAST + 1]>,
    /// Square root of the pressure difference.
    pub x_a: Box<[f64; LAST + 1]>,
    /// Pressure difference to the power 1.5.
    pub x_b: Box<[f64; LAST + 1]>,
    /// Sign of the pressure difference: 0 at index 0, 1 elsewhere.
    pub sgn: Box<[i8; LAST + 1]>,
}

static REFERENCE: LazyLock<ReedTables> = LazyLock::new(ReedTables::build);

impl ReedTables {
    /// The reference tables, which sound, torque and firmware share. The first call allocates; make it before audio starts.
    pub fn reference() -> &'static Self {
        &REFERENCE
    }

    fn build() -> Self {
        let step = 1.0 / LAST as f64;
        let (mut x, mut sgn) = (Box::new([0.0; LAST + 1]), Box::new([1; LAST + 1]));
        for (i, x) in x.iter_mut().enumerate() {
            *x = i as f64 * step;
        }
        x[LAST] = 1.0;
        sgn[0] = 0;
        let x_a = Box::new(x.map(f64::sqrt));
        let mut x_b = x.clone();
        for (x_b, x_a) in x_b.iter_mut().zip(x_a.iter()) {
            *x_b *= x_a;
        }
        Self { x, x_a, x_b, sgn }
    }

    /// `(x_a, x_b)` at any pressure difference `p >= 0`, in units of the reference closing pressure. Real-time safe.
    ///
    /// Between entries linear; in the first cell, where a square root starts vertically, the first entry scaled by
    /// the law's own shape (exact for the unperturbed tables); beyond the last entry the same formula goes on.
    /// Error of `x_a` at most 3.0e-4 (in the second cell, falling as p^-1.5), of `x_b` at most 7e-7: both tested.
    #[inline(always)]
    pub fn at(&self, p: f64) -> (f64, f64) {
        let position = p * LAST as f64;
        let cell = position as u32;
        let i = cell as usize;
        if i == 0 {
            let root = position.max(0.0).sqrt();
            return (self.x_a[1] * root, self.x_b[1] * position.max(0.0) * root);
        }
        if i >= LAST {
            let root = p.sqrt();
            return (self.x_a[LAST] * root, self.x_b[LAST] * p * root);
        }
        let t = position - f64::from(cell);
        (self.x_a[i] + t * (self.x_a[i + 1] - self.x_a[i]), self.x_b[i] + t * (self.x_b[i + 1] - self.x_b[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_is_linspace_to_the_bit() {
        let tables = ReedTables::reference();
        let differing = (0..=LAST).filter(|&i| tables.x[i] != i as f64 / LAST as f64).count();
        assert_eq!(differing, 29, "i * (1/3600) differs from i/3600 in 29 entries");
        assert_eq!(tables.x[LAST], 1.0);
        // Printed by the notebook.
        assert_eq!(format!("{:.8e}", tables.x_a[1]), "1.66666667e-2");
        assert_eq!(format!("{:.8e}", tables.x_b[2]), "1.30945700e-5");
        assert_eq!(format!("{:.8e}", tables.x_a[LAST - 2]), "9.99722184e-1");
        assert_eq!(format!("{:.8e}", tables.x_b[LAST - 2]), "9.99166782e-1");
        assert_eq!((tables.sgn[0], tables.sgn[1], tables.sgn[LAST]), (0, 1, 1));
    }

    #[test]
    fn interpolation_error_is_bounded_from_the_root_to_beyond_the_table() {
        let tables = ReedTables::reference();
        let (mut worst_a, mut worst_b, mut worst_first) = (0.0_f64, 0.0_f64, 0.0_f64);
        for n in 0..400_000 {
            let p = f64::from(n) / 200_000.0; // 0..2
            let (a, b) = tables.at(p);
            let (error_a, error_b) = ((a - p.sqrt()).abs(), (b - p * p.sqrt()).abs());
            if p < 1.0 / LAST as f64 {
                worst_first = worst_first.max(error_a);
            }
            (worst_a, worst_b) = (worst_a.max(error_a), worst_b.max(error_b));
        }
        assert!(worst_first < 1e-15, "{worst_first:e}");
        assert!(worst_a < 3.0e-4, "{worst_a:e}");
        assert!(worst_b < 7e-7, "{worst_b:e}");
    }
}
