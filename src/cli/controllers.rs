//! `chalumeau controllers`: the devices that the program knows, and what their controllers do.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, quoted};
use crate::controllers::{ControllerMap, factory};
use crate::parameters::spelling::nearest;
use crate::parameters::{Parameter, Sets, Value};
use chalumeau_core::control::midi::MidiDecoder;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::techniques::Wheel;
use clap::{Args, Subcommand};
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  chalumeau controllers list
  chalumeau controllers show EWI
  chalumeau render melody.mid --controllers EWI --out melody.wav";

/// List the controllers of devices, or show what those of one device do
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct ControllersCommand {
    #[command(subcommand)]
    command: ControllersSubcommand,
}

#[derive(Subcommand)]
enum ControllersSubcommand {
    /// List all devices, and how to set them
    List(TableArgs),
    /// Print the text of one device, to change and to use with --controllers
    Show {
        /// Its name
        name: String,
    },
}

impl ControllersCommand {
    pub fn run(&self) -> Result<(), Failure> {
        match &self.command {
            ControllersSubcommand::List(table) => {
                let mut table = table.open("name,links,shows")?;
                for map in factory::all() {
                    let (name, shows) = (quoted(&map.name), quoted(&map.shows));
                    table.line(format_args!("{name},{},{shows}", map.links.len()))?;
                }
                table.finish()
            }
            ControllersSubcommand::Show { name } => {
                write!(std::io::stdout().lock(), "{}", find(name).map_err(Failure::Usage)?.to_text())?;
                Ok(())
            }
        }
    }
}

/// Controllers that a user has chosen.
#[derive(Clone, Default)]
pub struct GivenMap {
    /// The links.
    pub map: ControllerMap,
    /// The file they are from, if it is not a device that the program knows.
    pub path: Option<PathBuf>,
}

/// The controllers of a device by its name, or of a file.
pub fn named_or_file(text: &str) -> Result<GivenMap, String> {
    if Path::new(text).extension().is_some() {
        let path = PathBuf::from(text);
        Ok(GivenMap { map: ControllerMap::load(&path)?, path: Some(path) })
    } else {
        Ok(GivenMap { map: find(text)?.clone(), path: None })
    }
}

fn find(name: &str) -> Result<&'static ControllerMap, String> {
    factory::find(name).ok_or_else(|| {
        let meant = nearest(name, factory::all().iter().map(|map| map.name.as_str()));
        let meant = meant.map_or_else(String::new, |near| format!("did you mean {near:?}? "));
        format!("no controllers are called {name:?}; {meant}`chalumeau controllers list` lists them; a file ends in .toml")
    })
}

/// Values of a map that the decoder of MIDI takes, and no instrument.
pub const OF_THE_DECODER: [&str; 3] = ["wheel", "bfrom", "bendr"];

/// Sets what a map says of the wheel, of the controller that blows, and of the bend range. Nothing sounds yet, so this bends nothing.
pub fn set_by_map(decoder: &mut MidiDecoder, map: &ControllerMap) {
    for &(parameter, value) in &map.values {
        match (parameter.id, value) {
            ("wheel", Value::Choice(at)) => {
                decoder.set_wheel(Wheel::ALL.get(at).copied().unwrap_or_default());
            }
            ("bfrom", Value::Choice(at)) => {
                decoder.set_breath_from(BreathFrom::ALL.get(at).copied().unwrap_or_default());
            }
            ("bendr", Value::Whole(semitones)) => {
                decoder.usual_bend_range(semitones.clamp(0, 127) as u8);
            }
            _ => {}
        }
    }
}

/// Says which values of a map have no effect offline.
pub fn only_in_the_plugin(map: &ControllerMap) -> Option<String> {
    let ids = map.values.iter().map(|(parameter, _)| *parameter);
    let is_reed = |of: &Parameter| matches!(of.sets, Some(Sets::Reed(..) | Sets::ReedDescription));
    let idle = ids.filter(|of| is_reed(of) || (of.sets.is_none() && !OF_THE_DECODER.contains(&of.id)));
    let names: Vec<_> = idle.map(|of| format!("{} ({})", of.name, of.id)).collect();
    (!names.is_empty()).then(|| {
        format!("--controllers sets {}, which only the plugin has: no effect here", names.join(", "))
    })
}
