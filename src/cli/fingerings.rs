//! `chalumeau fingerings`: every fingering that fingers and keys can make, for a note, a trill or two notes at once.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, quoted};
use crate::cli::shared_args::{AirArg, InstrumentArg, counted, note, whole};
use chalumeau_core::bore::fingering_finder::mechanism::{Grip, Mechanism};
use chalumeau_core::bore::fingering_finder::{FingeringFinder, Found};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::units::WrittenNote;
use clap::Args;
use std::ops::ControlFlow;

const EXAMPLES: &str = "\
Examples:
  chalumeau fingerings --note B6
  chalumeau fingerings --note B5 --trill-to C6
  chalumeau fingerings --multiphonic --count 30 --csv multiphonics.csv";

/// Find fingerings: for a note, for a trill, or for two notes at once
///
/// Looks through every combination of holes that the fingers of a Boehm clarinet can make, by the frequency-domain model. Best first.
/// Holes are known by the names they have in the bundled instruments; those with other names are not moved, and a warning names them. The fingering
/// of the chart is always listed, last if it is not among the best.
///
/// Columns of a note:
/// fingers: keys and holes that the hands press, T thumb, L1 to L3 and R1 to R3 the fingers of the left and the right hand, R alone the
/// register key, A the A key; empty where only the chart knows how;
/// hz, cents: its resonance with the air that moves with the reed, and how far that is from the note. A played note lies some 20 to 60
/// cents lower; the difference from the fingering of the chart is what one hears;
/// gamma_on: the mouth pressure at which it begins, over the closing pressure of the reed;
/// mode: which peak of the impedance it plays, 1 the lowest, as in an instrument file;
/// evenness_db: how far that resonance stands above the next lower one, 6 at most; below 0 the lower one may sound instead;
/// empty for the lowest;
/// cost: what the ranking goes by, less is better: cents, gamma_on, evenness and awkward grips together;
/// open: holes that are open;
/// chart: whether the instrument's file has this fingering for the note.
///
/// --trill-to has these columns for both notes, and moves: how many fingers move. --multiphonic has low_hz and high_hz, the two
/// resonances, and uneven_db, the difference of their heights.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[group(id = "sought", required = true, multiple = false, args = ["note", "multiphonic"])]
pub struct FingeringsCommand {
    /// Written note: a MIDI number (95) or a name (B6)
    #[arg(long, visible_alias = "written", value_name = "NOTE", value_parser = note)]
    note: Option<u8>,
    /// Two fingerings for a trill to this written note
    #[arg(long, value_name = "NOTE", value_parser = note, requires = "note")]
    trill_to: Option<u8>,
    /// Fingerings with two strong resonances that belong to no one note
    #[arg(long, conflicts_with = "trill_to")]
    multiphonic: bool,
    /// How many of the best, 1..1000
    #[arg(long, value_name = "COUNT", default_value = "10", value_parser = |s: &str| whole::<u16>(s, 1, 1_000))]
    count: u16,
    #[command(flatten)]
    air: AirArg,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
}

/// Warns of holes that the search can never move, because their kind does not fit their name.
pub(super) fn say_contrary(file: &InstrumentFile) {
    for (name, is_open) in Mechanism::boehm().contrary(file) {
        let (kind, right) = if is_open {
            ("open at rest", "a key opens the hole of this name, so it is key-closed")
        } else {
            ("closed at rest", "a finger or a pad closes the hole of this name, so it is finger or pad-open")
        };
        say!(
            "warning: {name} is {kind}; on a Boehm clarinet {right}. As it is, the search for fingerings never moves it"
        );
    }
}

impl FingeringsCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[])?;
        if let Some(note) = self.trill_to.filter(|_| self.trill_to == self.note).map(WrittenNote) {
            return Err(Failure::Usage(format!(
                "--trill-to {note}: a trill needs two notes; give another one"
            )));
        }
        let file = self.instrument.load()?;
        let count = usize::from(self.count);
        // It is never ended early.
        let finder = FingeringFinder::new(&file, self.air.air(), A4_HZ, &mut |_| ControlFlow::Continue(()))
            .ok_or_else(|| Failure::Usage("the search was ended".to_owned()))?;
        if !finder.unmoved().is_empty() {
            say!(
                "warning: {} cannot be moved: the search knows no key or finger of such a name. It stays as at rest: key-closed is closed, all others are open. The names that the search knows: docs/instrument-file.md",
                finder.unmoved().join(" ")
            );
        }
        say_contrary(&file);
        let looked = format!(
            "{}; {} looked through; {:.1} C",
            file.name,
            counted(finder.len(), "fingering"),
            self.air.air().temperature_c
        );
        let Some(note) = self.note.map(WrittenNote) else {
            let mut table = self.table.open("fingers,low_hz,high_hz,uneven_db,gamma_on,cost,open")?;
            table.comment(format_args!("{looked}"))?;
            let found = finder.multiphonics(count);
            if found.is_empty() {
                say!("note: none of the {} has two pitches", counted(finder.len(), "fingering"));
            }
            for one in found {
                let [low, high] = one.f_hz;
                table.line(format_args!(
                    "{},{low:.1},{high:.1},{:.1},{:.3},{:.2},{}",
                    quoted(&one.fingers),
                    one.uneven_db,
                    one.gamma_on,
                    one.cost,
                    quoted(&open(&one.grip, &file))
                ))?;
            }
            return table.finish();
        };
        let model = TransferMatrix::new(&file, self.air.air());
        let one = |found: &Found| {
            let mode = found.mode_of_file(&file, &model);
            format!(
                "{},{:.1},{:+.1},{:.3},{},{},{:.2},{}",
                quoted(&found.fingers),
                found.f_hz,
                found.cents,
                found.gamma_on,
                mode.map_or_else(String::new, |mode| mode.to_string()),
                evenness(found),
                found.cost,
                quoted(&open(&found.grip, &file))
            )
        };
        if let Some(to) = self.trill_to.map(WrittenNote) {
            let columns = ["fingers", "hz", "cents", "gamma_on", "mode", "evenness_db", "cost", "open"];
            let columns = |of: &str| columns.map(|column| format!("{of}_{column}")).join(",");
            let mut table = self.table.open(&format!("{},{},moves", columns("from"), columns("to")))?;
            table.comment(format_args!("{looked}; {note} to {to}"))?;
            for (from, to) in finder.trills(note, to, count) {
                table.line(format_args!("{},{},{}", one(&from), one(&to), from.grip.moves(&to.grip)))?;
            }
            return table.finish();
        }
        let mut table = self.table.open("fingers,hz,cents,gamma_on,mode,evenness_db,cost,open,chart")?;
        table.comment(format_args!("{looked}; {note}"))?;
        let mut found = finder.best(note, count);
        let chart = finder.played_by_chart(note);
        let is_of_chart = |found: &Found| chart.as_ref().is_some_and(|of| of.grip.open == found.grip.open);
        if let Some(chart) = chart.as_ref().filter(|_| !found.iter().any(is_of_chart)) {
            found.push(chart.clone());
        }
        if found.is_empty() {
            let (low, high) = (file.lowest(), file.highest());
            say!(
                "warning: no fingering sounds near {note}; the chart of this instrument goes from {low} to {high}"
            );
        }
        for found in found {
            table.line(format_args!("{},{}", one(&found), if is_of_chart(&found) { "yes" } else { "" }))?;
        }
        table.finish()
    }
}

/// How far the resonance that plays stands above the next lower one, dB; the lowest one stands above none.
fn evenness(found: &Found) -> String {
    if found.mode > 1 { format!("{:.1}", found.evenness_db) } else { String::new() }
}

/// Names of the open holes.
fn open(grip: &Grip, file: &InstrumentFile) -> String {
    grip.open_names(file).collect::<Vec<_>>().join(" ")
}
