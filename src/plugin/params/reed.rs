//! The physical reed's face: the same reed as a maker measures it.

use nice_plug::prelude::*;

use super::number;
use crate::reed::PhysicalReed;

/// Which of the reed's two faces rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum ReedFace {
    /// The seed's H, k and A, and zeta.
    #[id = "seed"]
    #[name = "Dimensionless"]
    Dimensionless,
    /// Stiffness, area, width and opening.
    #[id = "phys"]
    #[name = "Physical"]
    Physical,
}

/// The reed in newtons and millimetres. Lip and strength act on top, as on the other face.
#[derive(Params)]
pub struct PhysicalReedParams {
    /// Which face rules. Default dimensionless.
    #[id = "rface"]
    pub face: EnumParam<ReedFace>,
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
        let d = PhysicalReed::reference();
        let at = |si: f64, unit: f64| (si * unit) as f32;
        Self {
            face: EnumParam::new("Reed face", ReedFace::Dimensionless).non_automatable(),
            stiffness: number("Reed stiffness", at(d.stiffness_n_m, 1.0), 300.0, 6_000.0, 1, " N/m"),
            area: number("Reed area", at(d.area_m2, 1e6), 40.0, 250.0, 2, " mm²"),
            width: number("Reed width", at(d.width_m, 1e3), 3.0, 40.0, 2, " mm"),
            opening: number("Reed opening", at(d.tip_opening_m, 1e3), 0.2, 0.95, 3, " mm"),
        }
    }
}

impl PhysicalReedParams {
    pub(super) const CHOICES: [(&'static str, &'static str, &'static [&'static str]); 1] =
        [("rface", "seed", &["seed", "phys"])];

    pub(super) fn numbers(&self) -> [(&'static str, &FloatParam); 4] {
        [
            ("rstiff", &self.stiffness),
            ("rarea", &self.area),
            ("rwidth", &self.width),
            ("ropen", &self.opening),
        ]
    }
}
