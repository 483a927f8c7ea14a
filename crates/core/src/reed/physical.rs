//! The reed as a maker measures it, and its translation to the notebook's dimensionless numbers.
//!
//! A reed has two descriptions. A maker measures stiffness K (N/m), effective area A_r, channel width w and rest opening
//! H_m. The notebook has the dimensionless H, k and A, and the embouchure parameter zeta measures the flow. The two are
//! related by a reference reed, whose H is sqrt(27)/2, k 27/(4 H^3) and zeta 0.3:
//!
//! | notebook | maker |
//! |---|---|
//! | `H / H_init` | `H_m / H_m,ref` |
//! | `k / k_init` | `(K / A_r) / (K_ref / A_ref)` |
//! | `zeta A / 0.3` | `w / w_ref` |
//! | `area` | `A_r / A_ref`: enters the closing pressure, and the air that the reed's motion displaces; the sound takes that air from the instrument file |
//!
//! The closing pressure is `p_M = K H_m / A_r = P_ref H k` in both. [`DimensionlessReed`] keeps A apart from zeta and also
//! keeps the area, so that nothing is lost in either direction. Settings store and play the dimensionless numbers; the
//! maker's are computed from them.
//!
//! ```
//! use chalumeau_core::reed::physical::{DimensionlessReed, PhysicalReed};
//!
//! let reference = PhysicalReed::reference();
//! let stiff = PhysicalReed { stiffness_n_m: 1.5 * reference.stiffness_n_m, ..reference };
//! let numbers = stiff.dimensionless(&reference, 1.0);
//! assert!((numbers.k / DimensionlessReed::reference().k - 1.5).abs() < 1e-12);
//! assert!((stiff.closing_pa() - 9_000.0).abs() < 1e-6);
//! ```

use crate::reed::law::{H_INIT, K_INIT};
use crate::units::{Air, REFERENCE_RADIUS_M};

/// Closing pressure of the reference reed, Pa. All pressures in the model are relative to it.
pub const P_REF_PA: f64 = 6_000.0;

/// Equivalent volume of the reference reed, m3: 1.2 cm3, as on a B flat clarinet.
pub const REFERENCE_VOLUME_M3: f64 = 1.2e-6;

/// Embouchure parameter of the reference reed.
pub const ZETA_REFERENCE: f64 = 0.3;

/// Half-width of the knee of the reference reed's lay: how gradually the reed closes on a curved facing (`docs/tone.md`, *The knee of the
/// lay*).
pub const LAY_REFERENCE: f64 = 0.4;

/// A reed in the notebook's dimensionless numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DimensionlessReed {
    /// Rest opening, reference sqrt(27)/2.
    pub h: f64,
    /// Stiffness, reference 27/(4 H^3).
    pub k: f64,
    /// Amplitude of the flow, reference 1; above 0.
    pub a: f64,
    /// Embouchure parameter of the reference reed, reference 0.3.
    pub zeta: f64,
    /// Effective area over the reference's.
    pub area: f64,
}

impl DimensionlessReed {
    /// The reference reed.
    pub fn reference() -> Self {
        Self { h: H_INIT, k: K_INIT, a: 1.0, zeta: ZETA_REFERENCE, area: 1.0 }
    }
}

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
    /// These three are the values with which the geometry of the built-in clarinet was tuned. The tip opening of 0.5 mm is a
    /// common one; width, area and stiffness follow. The width is large because it includes tip and side slits.
    pub fn reference() -> Self {
        let (air, closing_pa, zeta, volume_m3, tip_opening_m) =
            (Air::default(), P_REF_PA, ZETA_REFERENCE, REFERENCE_VOLUME_M3, 0.5e-3);
        let area_m2 = volume_m3 * closing_pa / (air.rho * air.c * air.c * tip_opening_m);
        let stiffness_n_m = closing_pa * area_m2 / tip_opening_m;
        let speed = (2.0 / (air.rho * closing_pa)).sqrt();
        let width_m = zeta / (air.z_c(REFERENCE_RADIUS_M) * tip_opening_m * speed);
        Self { width_m, area_m2, stiffness_n_m, tip_opening_m }
    }

    /// The reed of an instrument `factor` times as large: same closing pressure, same zeta on a bore that much wider.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            width_m: self.width_m * factor,
            area_m2: self.area_m2 * factor * factor,
            stiffness_n_m: self.stiffness_n_m * factor,
            tip_opening_m: self.tip_opening_m * factor,
        }
    }

    /// The reference reed for a nominal bore, m.
    pub fn reference_on(nominal_radius_m: f64) -> Self {
        Self::reference().scaled(nominal_radius_m / REFERENCE_RADIUS_M)
    }

    /// The dimensionless numbers of this reed, relative to a reference reed. The measurements fix only the product zeta A;
    /// `a`, above 0, says how much of it is A. Real-time safe.
    pub fn dimensionless(&self, reference: &Self, a: f64) -> DimensionlessReed {
        let area = self.area_m2 / reference.area_m2;
        DimensionlessReed {
            h: H_INIT * (self.tip_opening_m / reference.tip_opening_m),
            k: K_INIT * (self.stiffness_n_m / reference.stiffness_n_m / area),
            a,
            zeta: ZETA_REFERENCE * (self.width_m / reference.width_m) / a,
            area,
        }
    }

    /// The maker's measurements of a reed given in dimensionless numbers, relative to the same reference. Real-time safe.
    pub fn from_dimensionless(numbers: &DimensionlessReed, reference: &Self) -> Self {
        Self {
            width_m: reference.width_m * (numbers.zeta * numbers.a / ZETA_REFERENCE),
            area_m2: reference.area_m2 * numbers.area,
            stiffness_n_m: reference.stiffness_n_m * (numbers.k / K_INIT * numbers.area),
            tip_opening_m: reference.tip_opening_m * (numbers.h / H_INIT),
        }
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

    /// Volume of air with the same compliance as the reed, m3: `rho c^2 A_r^2 / K`.
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

    /// Both ways for reeds from soft and wide to hard and close, on bores from E flat to bass: nothing is lost.
    #[test]
    fn the_two_descriptions_are_one_reed() {
        let air = Air::default();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        for factor in [0.75, 1.0, 1.5, 2.0] {
            let nominal_m = factor * REFERENCE_RADIUS_M;
            let reference = PhysicalReed::reference_on(nominal_m);
            assert_eq!(
                PhysicalReed::from_dimensionless(&DimensionlessReed::reference(), &reference),
                reference
            );
            near(reference.closing_pa(), P_REF_PA);
            near(reference.zeta(&air, nominal_m), ZETA_REFERENCE);
            near(reference.equivalent_volume_m3(&air), REFERENCE_VOLUME_M3 * factor.powi(3));
            for n in 0..1_000_u32 {
                let step = |prime: u32| f64::from(n * prime % 101) / 100.0;
                let numbers = DimensionlessReed {
                    h: 1.0 + 4.0 * step(7),
                    k: 0.1 + 1.9 * step(13),
                    a: 0.05 + 1.95 * step(29),
                    zeta: 0.05 + 0.85 * step(41),
                    area: 0.3 + 2.0 * step(53),
                };
                let reed = PhysicalReed::from_dimensionless(&numbers, &reference);
                let back = reed.dimensionless(&reference, numbers.a);
                near(back.h, numbers.h);
                near(back.k, numbers.k);
                near(back.zeta, numbers.zeta);
                near(back.area, numbers.area);
                let again = PhysicalReed::from_dimensionless(&back, &reference);
                near(again.stiffness_n_m, reed.stiffness_n_m);
                near(again.area_m2, reed.area_m2);
                near(again.width_m, reed.width_m);
                near(again.tip_opening_m, reed.tip_opening_m);
                // The physics is the same in both descriptions.
                near(reed.closing_pa(), P_REF_PA * numbers.h * numbers.k);
                let peak = (4.0 * numbers.h.powi(3) * numbers.k / 27.0).sqrt() * numbers.a * numbers.zeta;
                // Peak flow of the Bernoulli valve, 2 w H_m / 3 sqrt(2 p_M / (3 rho)), over that of the reference at zeta 1.
                let flow = 2.0 / 3.0 * reed.beta(&air) * (reed.closing_pa() / 3.0).sqrt();
                let unit = 2.0 / 3.0 * reference.beta(&air) * (P_REF_PA / 3.0).sqrt() / ZETA_REFERENCE;
                near(flow / unit, peak);
            }
        }
    }
}
