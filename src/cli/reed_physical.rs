//! The reed as its maker measures it, as arguments and as a table of both its descriptions.

use crate::cli::Failure;
use crate::cli::csv_table::TableArgs;
use crate::cli::shared_args::within;
use chalumeau_core::instrument::Settings;
use chalumeau_core::reed::PhysicalReed;
use chalumeau_core::reed::physical::DimensionlessReed;
use chalumeau_core::units::{Air, REFERENCE_RADIUS_M};
use clap::Args;

/// A reed in newtons and millimetres; what is not given is the reference reed's.
#[derive(Args, Clone, Copy)]
#[command(
    next_help_heading = "Reed as measured, instead of H, k and zeta; --strength multiplies its stiffness, --lip its opening"
)]
pub struct PhysicalReedArgs {
    /// Stiffness K, N/m, 100..20000 [default: the reference reed's; 1218 on a B flat clarinet]
    #[arg(long, value_name = "N_PER_M", conflicts_with_all = ["h", "k", "zeta"], value_parser = |s: &str| within(s, 100.0, 20_000.0))]
    reed_stiffness: Option<f64>,
    /// Effective area A_r, mm2, 10..1000 [default: 101.5 on a B flat clarinet]
    #[arg(long, value_name = "MM2", conflicts_with_all = ["h", "k", "zeta"], value_parser = |s: &str| within(s, 10.0, 1_000.0))]
    reed_area: Option<f64>,
    /// Width w of the channel, tip and side slits together, mm, 1..100 [default: 15.2 on a B flat clarinet]
    #[arg(long, value_name = "MM", conflicts_with_all = ["h", "k", "zeta"], value_parser = |s: &str| within(s, 1.0, 100.0))]
    reed_width: Option<f64>,
    /// Opening at the tip at rest, mm, 0.1..4 [default: 0.5 on a B flat clarinet]
    #[arg(long, value_name = "MM", conflicts_with_all = ["h", "k", "zeta"], value_parser = |s: &str| within(s, 0.1, 4.0))]
    reed_opening: Option<f64>,
    /// A reed as measured is in use, even if nothing of it is given.
    #[arg(skip)]
    pub is_used: bool,
}

impl PhysicalReedArgs {
    /// Sets what the parameter `id` of the table is, in its unit, as on a B flat clarinet; what was given before.
    pub fn replace(&mut self, id: &str, value: f64, nominal_radius_m: f64) -> Option<f64> {
        let (here, there) = (PhysicalReed::reference_on(nominal_radius_m), PhysicalReed::reference());
        let (field, scale) = match id {
            "rstiff" => (&mut self.reed_stiffness, here.stiffness_n_m / there.stiffness_n_m),
            "rarea" => (&mut self.reed_area, here.area_m2 / there.area_m2),
            "rwidth" => (&mut self.reed_width, here.width_m / there.width_m),
            "ropen" => (&mut self.reed_opening, here.tip_opening_m / there.tip_opening_m),
            _ => return None,
        };
        field.replace(value * scale)
    }

    /// The reed, if anything of it is given, on a nominal bore whose reference reed fills in the rest.
    pub fn reed(&self, nominal_radius_m: f64) -> Option<PhysicalReed> {
        let given = [self.reed_stiffness, self.reed_area, self.reed_width, self.reed_opening];
        (self.is_used || given.iter().any(Option::is_some)).then(|| {
            let d = PhysicalReed::reference_on(nominal_radius_m);
            PhysicalReed {
                stiffness_n_m: self.reed_stiffness.unwrap_or(d.stiffness_n_m),
                area_m2: self.reed_area.map_or(d.area_m2, |mm2| mm2 / 1e6),
                width_m: self.reed_width.map_or(d.width_m, |mm| mm / 1e3),
                tip_opening_m: self.reed_opening.map_or(d.tip_opening_m, |mm| mm / 1e3),
            }
        })
    }

    /// Settings that play this reed, or those given if nothing of it is.
    pub fn over(&self, settings: Settings, nominal_radius_m: f64) -> Result<Settings, Failure> {
        let Some(reed) = self.reed(nominal_radius_m) else { return Ok(settings) };
        let reference = PhysicalReed::reference_on(nominal_radius_m);
        if let Some((symbol, value, [low, high])) = settings.refused_reed(&reed, &reference) {
            let (what, measure, low, high) = match symbol {
                "H" => {
                    let unit = 1e3 * reed.tip_opening_m / value;
                    ("--reed-opening", "mm", low * unit, high * unit)
                }
                "k" => {
                    let unit = reed.stiffness_n_m / value;
                    ("--reed-stiffness", "N/m with this area", low * unit, high * unit)
                }
                _ => {
                    let unit = 1e3 * reed.width_m / value;
                    ("--reed-width", "mm", low * unit, high * unit)
                }
            };
            // Inwards, so that a limit that is told is allowed.
            let (low, high) = ((1e2 * low).ceil() / 1e2, (1e2 * high).floor() / 1e2);
            return Err(Failure::Usage(format!(
                "this reed has {symbol} = {value:.3}, which cannot be played; {what} must lie in {low:.2}..{high:.2} {measure}"
            )));
        }
        Ok(settings.with_physical_reed(&reed, &reference))
    }
}

/// Both descriptions of a reed, one quantity a line.
pub fn both_faces(
    seed: &DimensionlessReed,
    reed: &PhysicalReed,
    lay: f64,
    table: &TableArgs,
) -> Result<(), Failure> {
    let air = Air::default();
    let reference = PhysicalReed::reference();
    let mut table = table.open("quantity,symbol,value,unit")?;
    table.comment(format_args!(
        "one reed, two descriptions; strength as on the box is of the stiffness, 2.5 being {:.0} N/m; a 14.9 mm bore",
        reference.stiffness_n_m
    ))?;
    let closing_pa = reed.closing_pa();
    let lines: [(&str, &str, f64, &str); 15] = [
        ("rest opening", "H", seed.h, ""),
        ("stiffness", "k", seed.k, ""),
        ("amplitude", "A", seed.a, ""),
        ("embouchure parameter of the reference", "zeta", seed.zeta, ""),
        ("closing pressure", "H k", seed.h * seed.k, ""),
        ("peak flow", "A sqrt(4 H^3 k / 27)", seed.a * (4.0 * seed.h.powi(3) * seed.k / 27.0).sqrt(), ""),
        ("stiffness", "K", reed.stiffness_n_m, "N/m"),
        ("effective area", "A_r", 1e6 * reed.area_m2, "mm2"),
        ("width of the channel", "w", 1e3 * reed.width_m, "mm"),
        ("rest opening at the tip", "H", 1e3 * reed.tip_opening_m, "mm"),
        ("closing pressure", "p_M", closing_pa / 1e3, "kPa"),
        ("embouchure parameter of this reed", "zeta", reed.zeta(&air, REFERENCE_RADIUS_M), ""),
        (
            "air that yields as this reed; played is that of the instrument file",
            "V",
            1e9 * reed.equivalent_volume_m3(&air),
            "mm3",
        ),
        ("half-width of the curved closure", "lay", 1e3 * lay * reed.tip_opening_m, "mm"),
        (
            "strength as on the box",
            "strength",
            chalumeau_core::reed::strength::of_stiffness(reed.stiffness_n_m / reference.stiffness_n_m),
            "",
        ),
    ];
    for (quantity, symbol, value, unit) in lines {
        table.line(format_args!("{quantity},{symbol},{value:.9},{unit}"))?;
    }
    table.finish()
}
