//! `chalumeau presets`: what presets there are, and what one of them sets.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, quoted};
use crate::parameters::spelling::nearest;
use crate::presets::user_folder::UserPresets;
use crate::presets::{self, Preset, factory};
use clap::{Args, Subcommand};
use std::collections::BTreeSet;
use std::io::Write;

const EXAMPLES: &str = "\
Examples:
  chalumeau presets list
  chalumeau presets list --tag jazz
  chalumeau presets show \"Subtone ballad\"
  chalumeau render examples/melody.mid --preset \"Subtone ballad\" --set noise=50 --out melody.wav";

/// List presets, or show what one of them sets
///
/// Factory presets come with the program. Yours are in the folder chalumeau/presets of the system's folder for data
/// (on Linux ~/.local/share), or of the one that CHALUMEAU_DATA_DIR names. The plugin saves them there.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct PresetsCommand {
    #[command(subcommand)]
    command: PresetsSubcommand,
}

#[derive(Subcommand)]
enum PresetsSubcommand {
    List(ListCommand),
    Show(ShowCommand),
}

/// List all presets: name, tags, who made it, and what it shows
///
/// `program` is the number of the MIDI program change that selects a factory preset, from 0.
#[derive(Args)]
struct ListCommand {
    /// Only those with this tag; may be repeated, then a preset needs all of them
    #[arg(long, value_name = "TAG")]
    tag: Vec<String>,
    #[command(flatten)]
    table: TableArgs,
}

/// Print a preset in the form of a preset file
#[derive(Args)]
struct ShowCommand {
    /// Its name
    name: String,
}

impl PresetsCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let user = presets::user();
        for broken in &user.broken {
            say!("warning: {broken}");
        }
        let hides = |own: &&Preset| factory::all().iter().any(|other| other.name == own.name);
        for Preset { name, .. } in user.presets.iter().filter(hides) {
            say!(
                "warning: your preset {name:?} hides the factory preset of that name; change its name to have both"
            );
        }
        match &self.command {
            PresetsSubcommand::List(command) => command.run(&user),
            PresetsSubcommand::Show(command) => {
                let preset = presets::find(&command.name, &user).map_err(Failure::Usage)?;
                write!(std::io::stdout().lock(), "{}", preset.to_text())?;
                Ok(())
            }
        }
    }
}

impl ListCommand {
    fn run(&self, user: &UserPresets) -> Result<(), Failure> {
        let all = || factory::all().iter().chain(&user.presets);
        let tags: BTreeSet<&str> = all().flat_map(|preset| &preset.tags).map(String::as_str).collect();
        for wanted in &self.tag {
            if !tags.iter().any(|tag| tag.eq_ignore_ascii_case(wanted)) {
                let meant = nearest(wanted, tags.iter().copied());
                let meant = meant.map_or_else(String::new, |near| format!(" did you mean {near}?"));
                let known: Vec<_> = tags.iter().copied().collect();
                let what =
                    format!("no preset has the tag {wanted:?};{meant} the tags are {}", known.join(", "));
                return Err(Failure::Usage(what));
            }
        }
        let mut table = self.table.open("program,name,tags,author,shows")?;
        let is_wanted = |preset: &Preset| self.tag.iter().all(|tag| preset.has_tag(tag));
        let programs = (0..factory::all().len()).map(|number| number.to_string());
        let programs = programs.chain(std::iter::repeat(String::new()));
        for (program, preset) in programs.zip(all()).filter(|(_, preset)| is_wanted(preset)) {
            table.line(format_args!(
                "{program},{},{},{},{}",
                quoted(&preset.name),
                quoted(&preset.tags.join(" ")),
                quoted(&preset.author),
                quoted(&preset.shows)
            ))?;
        }
        table.finish()
    }
}
