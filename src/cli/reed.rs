//! `chalumeau reed`: the tables and the flow law that sound, knob and firmware share.

use crate::cli::Failure;
use crate::cli::args::within;
use crate::cli::reed_physical::{self, PhysicalReedArgs};
use crate::cli::table::TableArgs;
use crate::instrument::Settings;
use crate::reed::PhysicalReed;
use crate::reed::ReedLaw;
use crate::reed::ReedTables;
use crate::reed::physical::{SeedReed, ZETA_REFERENCE};
use crate::units::REFERENCE_RADIUS_M;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau reed --table --csv tables.csv
  chalumeau reed --law                        the reference reed
  chalumeau reed --law --H 3                  wider; k follows so that the peak flow stays 1
  chalumeau reed --law --H 3 --k 0.3849       wider, as stiff as before
  chalumeau reed --physical --H 3             the same reed in N/m and mm
  chalumeau reed --physical --reed-stiffness 1500 --reed-opening 0.6";

/// The reed's pressure tables, or flow against pressure
///
/// The flow through a reed grows with the root of the pressure difference until the pressure closes the slit faster than
/// it drives the air: u = A (H sqrt(p) - p^1.5 / k), zero from p = H k on. p is the pressure difference over the closing
/// pressure of the reference reed.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[group(id = "what", required = true, multiple = false, args = ["table", "law", "physical"])]
pub struct Reed {
    /// The 3601 table entries: i,p,x_a,x_b,sgn with x_a = sqrt(p), x_b = p^1.5
    #[arg(long)]
    table: bool,
    /// The flow law: p,u from p = -1 to beyond closure
    #[arg(long)]
    law: bool,
    /// Both faces of the reed: H, k, A and zeta, and stiffness, area, width and opening, whichever were given
    #[arg(long)]
    physical: bool,
    /// Rest opening H, dimensionless, 0.5..10 [default: sqrt(27)/2]
    #[arg(long = "H", value_name = "H", conflicts_with = "table", value_parser = |s: &str| within(s, 0.5, 10.0))]
    h: Option<f64>,
    /// Stiffness k, dimensionless, 0.01..20 [default: 27/(4 H^3), which makes the peak flow A]
    #[arg(long = "k", value_name = "K", conflicts_with = "table", value_parser = |s: &str| within(s, 0.01, 20.0))]
    k: Option<f64>,
    /// Amplitude A of the flow, 0..10 [default: 1]
    #[arg(long = "A", value_name = "A", conflicts_with = "table", value_parser = |s: &str| within(s, 0.0, 10.0))]
    a: Option<f64>,
    /// Embouchure parameter zeta of the reference reed, 0.05..0.9 [default: 0.3]
    #[arg(long, value_name = "ZETA", requires = "physical", value_parser = |s: &str| within(s, 0.05, 0.9))]
    zeta: Option<f64>,
    #[command(flatten)]
    measured: PhysicalReedArgs,
    #[command(flatten)]
    table_args: TableArgs,
}

impl Reed {
    pub fn run(&self) -> Result<(), Failure> {
        let tables = ReedTables::seed();
        if self.table {
            let mut table = self.table_args.open("i,p,x_a,x_b,sgn")?;
            let columns =
                tables.x.iter().zip(tables.x_a.iter()).zip(tables.x_b.iter()).zip(tables.sgn.iter());
            for (i, (((p, x_a), x_b), sgn)) in columns.enumerate() {
                table.line(format_args!("{i},{p},{x_a},{x_b},{sgn}"))?;
            }
            return table.finish();
        }
        let reference = PhysicalReed::reference();
        let measured =
            self.measured.reed(REFERENCE_RADIUS_M).map(|reed| reed.seed(&reference, self.a.unwrap_or(1.0)));
        let (h, a) =
            (measured.map(|seed| seed.h).or(self.h).unwrap_or(ReedLaw::default().h()), self.a.unwrap_or(1.0));
        let law = match measured.map(|seed| seed.k).or(self.k) {
            Some(k) => ReedLaw::free(h, k, a)?,
            None => ReedLaw::coupled(h, a)?,
        };
        if self.physical {
            let zeta = self.zeta.unwrap_or(ZETA_REFERENCE);
            let seed = measured.unwrap_or(SeedReed { h, k: law.k(), a, zeta, area: 1.0 });
            let reed = PhysicalReed::from_seed(&seed, &reference);
            let lay = f64::from(Settings::default().lay);
            return reed_physical::both_faces(&seed, &reed, lay, &self.table_args);
        }
        let mut table = self.table_args.open("p,u")?;
        table.comment(format_args!(
            "H = {}, k = {}, A = {}: peak flow {:.6} at p = {:.6}, closed from p = {:.6}",
            law.h(),
            law.k(),
            law.a(),
            law.peak_flow(),
            law.peak_at(),
            law.closing()
        ))?;
        // From the blown-open side to a fifth beyond closure, fine enough to plot.
        let steps = (1000.0 * (1.0 + 1.2 * law.closing())).ceil() as i32;
        for step in 0..=steps {
            let p = f64::from(step - 1000) / 1000.0;
            table.line(format_args!("{p},{}", law.flow(tables, p)))?;
        }
        table.finish()
    }
}
