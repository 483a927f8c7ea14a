//! The reed as a maker measures it, and what follows for the law.
//!
//! One reed has two faces. The maker's: stiffness K (N/m), effective area A_r, channel width w, rest opening H_m. The
//! seed's: H, k, A, with the embouchure parameter zeta as the measure of flow. Over a reference reed, whose H is
//! sqrt(27)/2, k 27/(4 H^3) and zeta 0.3:
//!
//! | seed | maker |
//! |---|---|
//! | `H / H_init` | `H_m / H_m,ref` |
//! | `k / k_init` | `(K / A_r) / (K_ref / A_ref)` |
//! | `zeta A / 0.3` | `w / w_ref` |
//! | `area` | `A_r / A_ref`: besides the closing pressure, only the air the reed's own motion moves |
//!
//! so that `p_M = K H_m / A_r = P_ref H k` on both. [`SeedReed`] keeps A apart from zeta and the area beside them, and nothing
//! is lost either way. The seed's face is the one that is stored and played; the maker's is worked out from it.

use crate::reed::law::{H_INIT, K_INIT};
use crate::units::{Air, REFERENCE_RADIUS_M};

/// Closing pressure of the reference reed, Pa: what everything inside is relative to.
pub const P_REF_PA: f64 = 6_000.0;

/// Equivalent volume of the reference reed, m3: that of a B flat clarinet's.
pub const REFERENCE_VOLUME_M3: f64 = 1.2e-6;

/// Embouchure parameter of the reference reed.
pub const ZETA_REFERENCE: f64 = 0.3;

/// The seed's face of a reed: dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeedReed {
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

impl SeedReed {
    /// The reference reed's.
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
    /// Those three follow physics of the instrument the geometry was tuned with; the tip opening of 0.5 mm is a common
    /// one, and width, area and stiffness then follow. The width is large because it stands for tip and side slits.
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

    /// The seed's face, over a reference reed. How much of the flow is A's and how much zeta's is for the seed to say: `a`,
    /// above 0. Real-time safe.
    pub fn seed(&self, reference: &Self, a: f64) -> SeedReed {
        let area = self.area_m2 / reference.area_m2;
        SeedReed {
            h: H_INIT * (self.tip_opening_m / reference.tip_opening_m),
            k: K_INIT * (self.stiffness_n_m / reference.stiffness_n_m / area),
            a,
            zeta: ZETA_REFERENCE * (self.width_m / reference.width_m) / a,
            area,
        }
    }

    /// The maker's face of a seed's reed, over the same reference. Real-time safe.
    pub fn from_seed(seed: &SeedReed, reference: &Self) -> Self {
        Self {
            width_m: reference.width_m * (seed.zeta * seed.a / ZETA_REFERENCE),
            area_m2: reference.area_m2 * seed.area,
            stiffness_n_m: reference.stiffness_n_m * (seed.k / K_INIT * seed.area),
            tip_opening_m: reference.tip_opening_m * (seed.h / H_INIT),
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

    /// Both ways for reeds from soft and wide to hard and close, on bores from E flat to bass: nothing is lost.
    #[test]
    fn the_two_faces_are_one_reed() {
        let air = Air::default();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        for factor in [0.75, 1.0, 1.5, 2.0] {
            let nominal_m = factor * REFERENCE_RADIUS_M;
            let reference = PhysicalReed::reference_on(nominal_m);
            assert_eq!(PhysicalReed::from_seed(&SeedReed::reference(), &reference), reference);
            near(reference.closing_pa(), P_REF_PA);
            near(reference.zeta(&air, nominal_m), ZETA_REFERENCE);
            near(reference.equivalent_volume_m3(&air), REFERENCE_VOLUME_M3 * factor.powi(3));
            for n in 0..1_000_u32 {
                let step = |prime: u32| f64::from(n * prime % 101) / 100.0;
                let seed = SeedReed {
                    h: 1.0 + 4.0 * step(7),
                    k: 0.1 + 1.9 * step(13),
                    a: 0.05 + 1.95 * step(29),
                    zeta: 0.05 + 0.85 * step(41),
                    area: 0.3 + 2.0 * step(53),
                };
                let reed = PhysicalReed::from_seed(&seed, &reference);
                let back = reed.seed(&reference, seed.a);
                near(back.h, seed.h);
                near(back.k, seed.k);
                near(back.zeta, seed.zeta);
                near(back.area, seed.area);
                let again = PhysicalReed::from_seed(&back, &reference);
                near(again.stiffness_n_m, reed.stiffness_n_m);
                near(again.area_m2, reed.area_m2);
                near(again.width_m, reed.width_m);
                near(again.tip_opening_m, reed.tip_opening_m);
                // The physics is the same on both faces.
                near(reed.closing_pa(), P_REF_PA * seed.h * seed.k);
                let peak = (4.0 * seed.h.powi(3) * seed.k / 27.0).sqrt() * seed.a * seed.zeta;
                // Peak flow of the Bernoulli valve, 2 w H_m / 3 sqrt(2 p_M / (3 rho)), over that of the reference at zeta 1.
                let flow = 2.0 / 3.0 * reed.beta(&air) * (reed.closing_pa() / 3.0).sqrt();
                let unit = 2.0 / 3.0 * reference.beta(&air) * (P_REF_PA / 3.0).sqrt() / ZETA_REFERENCE;
                near(flow / unit, peak);
            }
        }
    }
}
