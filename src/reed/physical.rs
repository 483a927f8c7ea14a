//! The reed as a maker measures it, and what follows for the law.

use crate::units::{Air, REFERENCE_RADIUS_M};

/// Closing pressure of the reference reed, Pa: what everything inside is relative to.
pub const P_REF_PA: f64 = 6_000.0;

/// Equivalent volume of the reference reed, m3: that of a B flat clarinet's.
pub const REFERENCE_VOLUME_M3: f64 = 1.2e-6;

/// A reed on its mouthpiece under the player's lip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhysicalReed {
    /// Effective width of the channel, m (tip and side slits, contraction included).
    pub width_m: f64,
    /// Area the pressure acts on, m2 (A_r).
    pub area_m2: f64,
    /// Stiffness, N/m (K).
    pub stiffness_n_m: f64,
    /// Rest opening at the tip under the lip, m.
    pub tip_opening_m: f64,
}

impl PhysicalReed {
    /// The reference reed: closing pressure 6 kPa, zeta 0.3, equivalent volume 1.2 cm3 at 25 C.
    ///
    /// Those three follow physics of the instrument the geometry was tuned with; the tip opening of 0.5 mm is a common
    /// one, and width, area and stiffness then follow. The width is large because it stands for tip and side slits.
    pub fn reference() -> Self {
        let (air, closing_pa, zeta, volume_m3, tip_opening_m) =
            (Air::default(), P_REF_PA, 0.3, REFERENCE_VOLUME_M3, 0.5e-3);
        let area_m2 = volume_m3 * closing_pa / (air.rho * air.c * air.c * tip_opening_m);
        let stiffness_n_m = closing_pa * area_m2 / tip_opening_m;
        let speed = (2.0 / (air.rho * closing_pa)).sqrt();
        let width_m = zeta / (air.z_c(REFERENCE_RADIUS_M) * tip_opening_m * speed);
        Self { width_m, area_m2, stiffness_n_m, tip_opening_m }
    }

    /// Pressure that closes the reed, Pa: `p_M = K H / A_r`. With a curved lay this is the extrapolated one.
    pub fn closing_pa(&self) -> f64 {
        self.stiffness_n_m * self.tip_opening_m / self.area_m2
    }

    /// `beta = w H sqrt(2 / rho)`: flow per root of pressure at rest, m3/s/Pa^0.5.
    pub fn beta(&self, air: &Air) -> f64 {
        self.width_m * self.tip_opening_m * (2.0 / air.rho).sqrt()
    }

    /// Embouchure parameter `zeta = Zc w H sqrt(2 / (rho p_M))`, Zc of the instrument's nominal bore.
    pub fn zeta(&self, air: &Air, nominal_radius_m: f64) -> f64 {
        air.z_c(nominal_radius_m) * self.beta(air) / self.closing_pa().sqrt()
    }

    /// Air volume that yields as much as the reed does, m3: `rho c^2 A_r^2 / K`.
    pub fn equivalent_volume_m3(&self, air: &Air) -> f64 {
        air.rho * air.c * air.c * self.area_m2 * self.area_m2 / self.stiffness_n_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_reed_is_what_it_claims() {
        let (reed, air) = (PhysicalReed::reference(), Air::default());
        assert!((reed.closing_pa() - 6_000.0).abs() < 1e-6);
        assert!((reed.zeta(&air, REFERENCE_RADIUS_M) - 0.3).abs() < 1e-12);
        assert!((reed.equivalent_volume_m3(&air) - 1.2e-6).abs() < 1e-18);
        assert!((500.0..3_000.0).contains(&reed.stiffness_n_m), "{reed:?}");
        assert!((0.8e-4..1.6e-4).contains(&reed.area_m2), "{reed:?}");
    }

    #[test]
    fn biting_lowers_closing_pressure_and_zeta() {
        let (reed, air) = (PhysicalReed::reference(), Air::default());
        let bitten = PhysicalReed { tip_opening_m: 0.8 * reed.tip_opening_m, ..reed };
        assert!((bitten.closing_pa() / reed.closing_pa() - 0.8).abs() < 1e-12);
        assert!((bitten.zeta(&air, 0.007) / reed.zeta(&air, 0.007) - 0.8_f64.sqrt()).abs() < 1e-12);
    }
}
