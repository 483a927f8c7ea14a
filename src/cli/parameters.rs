//! `chalumeau parameters`: the table of parameters.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, quoted};
use crate::parameters::{PARAMETERS, plain};
use clap::Args;

/// List all parameters: ids, names, ranges, units, defaults, and what can drive them
///
/// Ids with `settable` yes can be given to --set of render, report, tune, realism and bifurcation.
#[derive(Args)]
pub struct ParametersCommand {
    #[command(flatten)]
    table: TableArgs,
}

impl ParametersCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let mut table =
            self.table.open("id,name,group,unit,range,default,automatable,midi,flag,settable,meaning")?;
        let yes = |is: bool| if is { "yes" } else { "no" };
        for parameter in PARAMETERS {
            let (range, default) = (parameter.range(), parameter.default_text());
            table.line(format_args!(
                "{},{},{},{},{},{},{},{},{},{},{}",
                parameter.id,
                quoted(parameter.name),
                quoted(parameter.group),
                parameter.unit(),
                quoted(&range),
                quoted(&default),
                yes(parameter.is_automatable),
                quoted(parameter.midi),
                parameter.flag,
                yes(parameter.sets.is_some()),
                quoted(&plain(parameter.meaning)),
            ))?;
        }
        table.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_flag_of_the_table_is_one_of_the_command_line() {
        let program = crate::cli::Cli::command();
        for parameter in PARAMETERS.iter().filter(|parameter| !parameter.flag.is_empty()) {
            let long = parameter.flag.trim_start_matches('-');
            let has =
                |command: &clap::Command| command.get_arguments().any(|arg| arg.get_long() == Some(long));
            assert!(program.get_subcommands().any(has), "{}", parameter.flag);
        }
    }
}
