//! `chalumeau reed`: the tables and the flow law that sound, knob and firmware share.

use crate::cli::Failure;
use crate::cli::args::within;
use crate::cli::table::TableArgs;
use crate::reed::ReedLaw;
use crate::reed::ReedTables;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau reed --table --csv tables.csv
  chalumeau reed --law                        the reference reed
  chalumeau reed --law --H 3                  wider; k follows so that the peak flow stays 1
  chalumeau reed --law --H 3 --k 0.3849       wider, as stiff as before";

/// The reed's pressure tables, or flow against pressure
///
/// The flow through a reed grows with the root of the pressure difference until the pressure closes the slit faster than
/// it drives the air: u = A (H sqrt(p) - p^1.5 / k), zero from p = H k on. p is the pressure difference over the closing
/// pressure of the reference reed.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[group(id = "what", required = true, multiple = false, args = ["table", "law"])]
pub struct Reed {
    /// The 3601 table entries: i,p,x_a,x_b,sgn with x_a = sqrt(p), x_b = p^1.5
    #[arg(long)]
    table: bool,
    /// The flow law: p,u from p = -1 to beyond closure
    #[arg(long)]
    law: bool,
    /// Rest opening H, dimensionless, 0.5..10 [default: sqrt(27)/2]
    #[arg(long = "H", value_name = "H", requires = "law", value_parser = |s: &str| within(s, 0.5, 10.0))]
    h: Option<f64>,
    /// Stiffness k, dimensionless, 0.01..20 [default: 27/(4 H^3), which makes the peak flow A]
    #[arg(long = "k", value_name = "K", requires = "law", value_parser = |s: &str| within(s, 0.01, 20.0))]
    k: Option<f64>,
    /// Amplitude A of the flow, 0..10 [default: 1]
    #[arg(long = "A", value_name = "A", requires = "law", value_parser = |s: &str| within(s, 0.0, 10.0))]
    a: Option<f64>,
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
        let (h, a) = (self.h.unwrap_or(ReedLaw::default().h()), self.a.unwrap_or(1.0));
        let law = match self.k {
            Some(k) => ReedLaw::free(h, k, a)?,
            None => ReedLaw::coupled(h, a)?,
        };
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
