//! `chalumeau radiation`: what ways of listening hear of a fingering, beside the power average over all directions.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named};
use crate::cli::shared_args::{AirArg, InstrumentArg, NotesArg, within_f32};
use chalumeau_core::instrument::listening::{Listening, ListeningMode};
use chalumeau_core::measure::radiated_bands::{COUNTED_HZ, RadiatedBand, RadiatedBands, rms_and_worst};

use clap::{Args, ValueEnum};

const EXAMPLES: &str = "\
Examples:
  chalumeau radiation                              every fingering, heard from everywhere
  chalumeau radiation --written F4 --csv f4.csv
  chalumeau radiation --heard position --angle 60 --distance 0.5
  chalumeau radiation --heard position --width 70  the mean of two places";

/// How one listens.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Heard {
    /// From all directions at once
    Everywhere,
    /// From one place, or from two with --width
    Position,
    /// As if bell and holes were in one place
    Point,
}

/// Compare what is heard of bell and open holes with the power average over all directions
///
/// Bell and open holes send out sound from different places. Above the cut-off of the open holes their flows
/// differ in phase, and what is heard depends on where one listens. The flows are those of the transfer matrices, for the same flow through the reed at all
/// frequencies.
///
/// Columns: written,written_midi,register,f_hz,average_db,heard_db. Frequencies are the centres of third octaves from that of the note up, or harmonics of the note; decibels are over one
/// point that sends out the sum of all flows.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct RadiationCommand {
    #[command(flatten)]
    notes: NotesArg,
    /// How one listens
    #[arg(long, value_enum, default_value_t = Heard::Everywhere)]
    heard: Heard,
    /// Distance from the instrument, m, 0.2..10 [default: 1]
    #[arg(long, value_name = "M", value_parser = |s: &str| within_f32(s, 0.2, 10.0))]
    distance: Option<f32>,
    /// Angle around the player, degrees, -180..180: 0 in front, 90 at the right [default: 30]
    #[arg(long, value_name = "DEG", value_parser = |s: &str| within_f32(s, -180.0, 180.0))]
    angle: Option<f32>,
    /// Height above the middle of the instrument, m, -1..2 [default: 0]
    #[arg(long, value_name = "M", value_parser = |s: &str| within_f32(s, -1.0, 2.0))]
    height: Option<f32>,
    /// Angle between the left and the right place, degrees, 0..180; 0 is one place [default: 0]
    #[arg(long, value_name = "DEG", value_parser = |s: &str| within_f32(s, 0.0, 180.0))]
    width: Option<f32>,
    /// At each harmonic of the note instead of in third octaves
    #[arg(long)]
    harmonics: bool,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
}

impl RadiationCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[])?;
        let place = self.distance.or(self.angle).or(self.height).or(self.width);
        if place.is_some() && self.heard != Heard::Position {
            return Err(Failure::Usage(
                "--distance, --angle, --height and --width are for one who listens from a place; add --heard position"
                    .to_owned(),
            ));
        }
        let width_deg = self.width.unwrap_or(0.0);
        let file = self.instrument.load()?;
        let notes = self.notes.notes(&file)?;
        let air = self.air.air();
        let mut table = self.table.open("written,written_midi,register,f_hz,average_db,heard_db")?;
        let bands = RadiatedBands::new(&file, air);
        let listening = Listening {
            mode: ListeningMode::Position,
            distance_m: self.distance.unwrap_or(1.0),
            angle_deg: self.angle.unwrap_or(30.0),
            height_m: self.height.unwrap_or(0.0),
            width_deg,
        };
        let paths = match self.heard {
            Heard::Everywhere => vec![Listening::everywhere(bands.sources(), &air)],
            Heard::Position if width_deg > 0.0 => {
                [-1.0, 1.0].map(|side| listening.position(side, bands.sources(), &air)).into()
            }
            Heard::Position => vec![listening.position(0.0, bands.sources(), &air)],
            Heard::Point => vec![Listening::in_one_point()],
        };
        let fingerings: Vec<_> = notes.iter().filter_map(|&written| file.fingering(written)).collect();
        let heard: Vec<Vec<RadiatedBand>> = fingerings
            .iter()
            .map(|fingering| {
                if self.harmonics { bands.harmonics(fingering, &paths) } else { bands.of(fingering, &paths) }
            })
            .collect();
        table.comment(format_args!("{}; {} C, dB over one point", file.name, air.temperature_c))?;
        for (name, of) in
            [("heard", (|band| band.heard_db) as fn(&RadiatedBand) -> f64), ("one point", |_| 0.0)]
        {
            let (rms_db, worst_db) = rms_and_worst(heard.iter().flatten(), of);
            table.comment(format_args!(
                "{name} against the average, up to {COUNTED_HZ} Hz: rms {rms_db:.2} dB, at most {worst_db:.1} dB"
            ))?;
        }
        for (fingering, bands) in fingerings.iter().zip(&heard) {
            for RadiatedBand { centre_hz, average_db, heard_db } in bands {
                let (name, written, register) =
                    (named(fingering.written), fingering.written.0, &fingering.register);
                table.line(format_args!(
                    "{name},{written},{register},{centre_hz:.1},{average_db:.2},{heard_db:.2}"
                ))?;
            }
        }
        table.finish()
    }
}
