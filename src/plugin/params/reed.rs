//! The physical reed's description: the same reed as a maker measures it.

use nice_plug::prelude::*;

use super::entry::{choice, number};
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::PhysicalReed;

/// Which of the reed's two descriptions rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum ReedDescription {
    /// The seed's H, k and A, and zeta.
    #[id = "seed"]
    #[name = "Dimensionless"]
    Dimensionless,
    /// Stiffness, area, width and opening.
    #[id = "phys"]
    #[name = "Measured"]
    Measured,
}

/// The reed in newtons and millimetres. Lip and strength act on top, as on the other description.
#[derive(Params)]
pub struct PhysicalReedParams {
    /// Which description rules. Default dimensionless.
    #[id = "rface"]
    pub description: EnumParam<ReedDescription>,
    /// K, N/m. Default the reference reed's.
    #[id = "rstiff"]
    pub stiffness: FloatParam,
    /// A_r, mm2.
    #[id = "rarea"]
    pub area: FloatParam,
    /// w, mm: tip and side slits together.
    #[id = "rwidth"]
    pub width: FloatParam,
    /// H, mm: opening at the tip, at rest under the lip.
    #[id = "ropen"]
    pub opening: FloatParam,
}

impl Default for PhysicalReedParams {
    fn default() -> Self {
        Self {
            description: choice("rface"),
            stiffness: number("rstiff"),
            area: number("rarea"),
            width: number("rwidth"),
            opening: number("ropen"),
        }
    }
}

impl PhysicalReedParams {
    /// The reed as it is set.
    pub fn reed(&self) -> PhysicalReed {
        let si = |param: &FloatParam, unit: f64| f64::from(super::settled(param)) / unit;
        PhysicalReed {
            width_m: si(&self.width, 1e3),
            area_m2: si(&self.area, 1e6),
            stiffness_n_m: si(&self.stiffness, 1.0),
            tip_opening_m: si(&self.opening, 1e3),
        }
    }

    /// Settings whose reed is this one, if this description rules, as on a B flat clarinet: a larger instrument has a reed as much
    /// larger. Lip, strength and A act on top. Real-time safe.
    pub fn over(&self, settings: Settings) -> Settings {
        if !self.rules() {
            return settings;
        }
        settings.with_physical_reed(&self.reed(), &PhysicalReed::reference())
    }

    /// Whether it rules. Real-time safe.
    pub fn rules(&self) -> bool {
        self.description.value() == ReedDescription::Measured
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::reed::law::H_INIT;
    use chalumeau_core::reed::physical::P_REF_PA;
    use chalumeau_core::units::{Air, REFERENCE_RADIUS_M};

    fn description(description: ReedDescription, change: impl Fn(&mut PhysicalReed)) -> PhysicalReedParams {
        let mut reed = PhysicalReed::reference();
        change(&mut reed);
        let fixed = |value: f64, unit: f64| {
            FloatParam::new("", (value * unit) as f32, FloatRange::Linear { min: 0.0, max: 1e4 })
        };
        PhysicalReedParams {
            description: EnumParam::new("Reed description", description),
            stiffness: fixed(reed.stiffness_n_m, 1.0),
            area: fixed(reed.area_m2, 1e6),
            width: fixed(reed.width_m, 1e3),
            opening: fixed(reed.tip_opening_m, 1e3),
        }
    }

    #[test]
    fn the_other_description_says_nothing() {
        let params = description(ReedDescription::Dimensionless, |reed| reed.stiffness_n_m *= 2.0);
        assert_eq!(params.over(Settings::default()), Settings::default());
    }

    #[test]
    fn both_descriptions_of_the_reference_reed_are_one_reed() {
        let (seed, physical) =
            (Settings::default(), description(ReedDescription::Measured, |_| {}).over(Settings::default()));
        let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-6;
        assert!(near(seed.reed_h, physical.reed_h) && near(seed.reed_k, physical.reed_k), "{physical:?}");
        assert!(near(seed.zeta, physical.zeta), "{physical:?}");
    }

    #[test]
    fn closing_pressure_and_flow_are_those_of_the_reed() {
        let air = Air::default();
        for change in [
            |reed: &mut PhysicalReed| reed.stiffness_n_m *= 1.5,
            |reed: &mut PhysicalReed| reed.area_m2 *= 1.3,
            |reed: &mut PhysicalReed| reed.tip_opening_m *= 0.7,
            |reed: &mut PhysicalReed| reed.width_m *= 0.6,
        ] {
            let params = description(ReedDescription::Measured, change);
            let (reed, settings) = (params.reed(), params.over(Settings::default()));
            assert!((settings.closing_pa() / reed.closing_pa() - 1.0).abs() < 1e-5, "{reed:?}");
            // Zeta is flow at rest over the root of the closing pressure: zeta_ref (H / H_ref) over the root of p_M / P.
            let closing = reed.closing_pa() / P_REF_PA;
            let zeta = f64::from(settings.zeta) * f64::from(settings.reed_h) / H_INIT / closing.sqrt();
            assert!((zeta / reed.zeta(&air, REFERENCE_RADIUS_M) - 1.0).abs() < 1e-5, "{reed:?}: {zeta}");
        }
    }
}
