//! `chalumeau haptic`: the torque of a force-feedback knob for each note.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named, number};
use crate::cli::feel_args::{FeelArgs, refused_in_flags};
use crate::cli::plot_args::{Plot, PlotArgs};
use crate::cli::shared_args::{AirArg, InstrumentArg, NotesArg, within, within_f32};
use crate::feel_flags::{in_flags, law_name};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::feel_parameters::HARD_CEILING_MNM;
use chalumeau_core::haptics::torque_law;
use chalumeau_core::haptics::{
    FeelTable, NoteFeel, NoteRequirement, PlayedReed, RequirementSolver, TorqueLimits,
};
use chalumeau_core::instrument::Settings;
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::instrument::feel_inputs::played_reed;
use chalumeau_core::reed::ReedTables;
use chalumeau_core::reed::physical::ZETA_REFERENCE;
use chalumeau_core::units::WrittenNote;
use chalumeau_figure::felt::{AtContrast, Torque, few, torques};
use clap::Args;

/// Step of the curve, degrees: one of the knob's encoder.
const STEP_DEG: f64 = 0.1;
/// The curve begins in the slap region, degrees.
const FROM_DEG: f64 = -150.0;
/// The curve ends this far behind the wall, degrees.
const BEHIND_WALL_DEG: f64 = 5.0;

const EXAMPLES: &str = "\
Examples:
  chalumeau haptic --all --zeta 0.3 --contrast 1 --csv -
  chalumeau haptic --written 52 --law flow --curve --csv e3.csv
  chalumeau haptic --written E3 --contrast 1 --plot e3.png
  chalumeau haptic --all --H 3 --k 0.3849          a wider reed, as stiff as before
  chalumeau haptic --all --H 3 --equal-travel      the same as a study has it
  chalumeau haptic --all --order covered-holes --contrast 2";

/// Calculate the torque of a force-feedback knob for each note
///
/// Every note has its own pressure requirement p_req_pa = p_M gamma_on (see `threshold`), above which it sounds, and an
/// extinction gamma_off above which the shut reed is silent. On the knob they lie at a_on_deg and a_off_deg; at
/// a_close_deg a reed that does not vibrate would be shut on a straight facing. Contrast above 1 exaggerates how the torque differs between notes, Place above 1
/// how their angles differ; the requirement itself does not change. At a_on_deg the knob blows with gamma_sounding, where the
/// reed as it moves begins to sound. At wall_deg a wall begins, a stiff spring; where a_off_deg lies beyond it, the hand meets the wall before the note falls silent. All pressures are those of the transfer-matrix model; `knob`, `report` and the plugin take those of
/// the waveguide that is played, up to 2 % apart.
///
/// Columns: written,written_midi,gamma_on,gamma_off,p_req_pa,a_on_deg,a_off_deg,a_close_deg,scale_mnm,h,k,gamma_sounding,wall_deg,most_mnm; a note
/// for which the theory finds no pressures has nan for them. A note that does not speak in tune and stays silent, such as C#7, has numbers. scale_mnm is the torque at the peak of the flow law with H = sqrt(27)/2, without the mark (--detent) that is added at the threshold; most_mnm is the most torque up to the wall, with the mark and the friction: what --ceiling must allow. h and k are those of the law. With --curve: angle_deg,torque_mnm in steps of 0.1 degrees, at rest, positive
/// against the breath. --plot draws torque against angle: of the note that is asked for, or of the easiest, the lowest, the
/// reference and the hardest.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct HapticCommand {
    #[command(flatten)]
    notes: NotesArg,
    /// The torque curve of one note instead of the table
    #[arg(long)]
    curve: bool,
    #[command(flatten)]
    felt: FeltReedArgs,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
}

/// What is felt: the torque's law, the reed and the air.
#[derive(Args)]
pub struct FeltReedArgs {
    #[command(flatten)]
    feel: FeelArgs,
    /// Most torque allowed, mNm, 0..450
    #[arg(long, value_name = "MNM", default_value = "100", value_parser = |s: &str| within(s, 0.0, f64::from(HARD_CEILING_MNM)))]
    ceiling: f64,
    #[command(flatten)]
    played: ReedInAirArgs,
}

/// The reed and the air that are played.
#[derive(Args)]
pub struct ReedInAirArgs {
    #[command(flatten)]
    reed: ReedArgs,
    #[command(flatten)]
    air: AirArg,
}

/// The reed that is played.
#[derive(Args)]
pub struct ReedArgs {
    /// Embouchure: flow strength of the reference reed, 0.05..0.9
    #[arg(long, value_name = "ZETA", default_value_t = ZETA_REFERENCE as f32, value_parser = |s: &str| within_f32(s, 0.05, 0.9))]
    zeta: f32,
    /// Reed strength as on the box, 1.5..5; 2.5 closes at 6 kPa [default: 2.5]
    #[arg(long, value_name = "N", value_parser = |s: &str| within_f32(s, 1.5, 5.0))]
    strength: Option<f32>,
    /// Lip: tip opening over the reference, 0.6 (bites) ..1.4 [default: 1]
    #[arg(long, value_name = "X", value_parser = |s: &str| within_f32(s, 0.6, 1.4))]
    lip: Option<f32>,
    /// Rest opening H of the dimensionless law, 1..5 [default: sqrt(27)/2]
    #[arg(long = "H", value_name = "H", value_parser = |s: &str| within_f32(s, 1.0, 5.0))]
    h: Option<f32>,
    /// Stiffness k of the dimensionless law, 0.1..2 [default: 27/(4 H^3), following H]
    #[arg(long = "k", value_name = "K", value_parser = |s: &str| within_f32(s, 0.1, 2.0))]
    k: Option<f32>,
}

impl ReedArgs {
    /// The standard settings with this reed.
    pub fn settings(&self) -> Settings {
        let standard = Settings::default();
        Settings {
            zeta: self.zeta,
            strength: self.strength.unwrap_or(standard.strength),
            lip: self.lip.unwrap_or(standard.lip),
            reed_h: self.h.unwrap_or(standard.reed_h),
            reed_k: self.k.unwrap_or(standard.reed_k),
            coupled: self.k.is_none(),
            ..standard
        }
    }

    /// In words: zeta, and H and k of its law.
    fn in_words(&self) -> String {
        let law = self.settings().reed_law();
        format!("zeta {}, H {:.4}, k {:.4}", self.zeta, law.h(), law.k())
    }
}

impl ReedInAirArgs {
    /// The bore in this air, and the reed as it is played on it.
    pub fn bore_and_reed(&self, file: &InstrumentFile) -> Result<(RequirementSolver, PlayedReed), Failure> {
        let bore = RequirementSolver::new(file, self.air.air(), A4_HZ)
            .map_err(|error| Failure::Usage(error.to_string()))?;
        Ok((bore, played_reed(file, A4_HZ, &self.reed.settings())))
    }
}

impl FeltReedArgs {
    /// The bore in this air, and the reed as it is played on it.
    pub fn bore_and_reed(&self, file: &InstrumentFile) -> Result<(RequirementSolver, PlayedReed), Failure> {
        self.played.bore_and_reed(file)
    }

    /// The feel of every note, where the limits allow that of all of them, or of the one `note` that is asked for.
    pub fn feel(&self, file: &InstrumentFile, note: Option<WrittenNote>) -> Result<FeelTable, Failure> {
        let design = self.feel.design(file)?;
        let limits = TorqueLimits { ceiling_mnm: self.ceiling, ..TorqueLimits::default() };
        let (bore, reed) = self.bore_and_reed(file)?;
        let fingering = note.and_then(|note| bore.written().position(|written| written == note));
        let feel = match fingering {
            Some(fingering) => FeelTable::unlimited(&bore, &design, &reed)
                .and_then(|table| table.accepts(fingering, &design, &limits).map(|()| table)),
            None => FeelTable::new(&bore, &design, &reed, &limits),
        };
        feel.map_err(|refused| refused_in_flags(refused, "--ceiling"))
    }
}

impl HapticCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.file()], &[self.plot.path()])?;
        let file = self.instrument.load()?;
        let notes = self.notes.notes(&file)?;
        if self.curve && self.notes.one().is_none() {
            let right = "choose a note with --written, or leave --curve out for the table of all notes";
            return Err(Failure::Usage(format!("--curve is for one note; {right}")));
        }
        let feel = self.felt.feel(&file, self.notes.one())?;
        let plot = self.plot.open(self.table.force())?;
        let wanted = |feel: &&NoteFeel| notes.contains(&feel.written);
        if self.curve {
            feel.notes().iter().filter(wanted).try_for_each(|note| self.curve(note, &plot))?;
            return self.draw(plot, &file, &feel);
        }
        let mut table = self.table.open_beside(
            &plot,
            "written,written_midi,gamma_on,gamma_off,p_req_pa,a_on_deg,a_off_deg,a_close_deg,scale_mnm,h,k,gamma_sounding,wall_deg,most_mnm",
        )?;
        table.comment(format_args!(
            "{}; {}; {:.1} C, {} about {}",
            file.name,
            self.felt.played.reed.in_words(),
            self.felt.played.air.air().temperature_c,
            self.felt.feel.exaggeration(),
            feel.reference().written
        ))?;
        let design = self.felt.feel.design(&file)?;
        table.comment(format_args!("feel {}; ceiling {} mNm", in_flags(&design), self.felt.ceiling))?;
        for note in feel.notes().iter().filter(wanted) {
            let asked = note.requirement;
            let pressure = |of: fn(&NoteRequirement) -> f64| asked.as_ref().map_or(f64::NAN, of);
            let (gamma_on, gamma_off) = (pressure(|asked| asked.gamma_on), pressure(|asked| asked.gamma_off));
            let (p_req, sounding) =
                (pressure(|asked| asked.p_req_pa), pressure(|asked| asked.gamma_sounding));
            let (a, feel, most_mnm) = (note.landmarks, note.feel, note.most_mnm());
            table.line(format_args!(
                "{},{},{},{},{},{:.4},{:.4},{:.4},{:.4},{},{},{},{:.2},{:.2}",
                named(note.written),
                note.written.0,
                number(gamma_on, 6),
                number(gamma_off, 4),
                number(p_req, 2),
                a.a_on_deg,
                a.a_off_deg,
                a.a_close_deg,
                feel.scale_mnm,
                feel.h,
                feel.k,
                number(sounding, 6),
                feel.wall_deg,
                most_mnm
            ))?;
        }
        table.finish()?;
        self.draw(plot, &file, &feel)
    }

    /// Draws the note that is asked for, or those that stand for all.
    fn draw(&self, plot: Plot, file: &InstrumentFile, feel: &FeelTable) -> Result<(), Failure> {
        let design = self.felt.feel.design(file)?;
        let one = |written| feel.notes().iter().filter(|note| note.written == written).collect();
        let notes: Vec<&NoteFeel> = self.notes.one().map_or_else(|| few(feel), one);
        let (reed, exaggeration) = (self.felt.played.reed.in_words(), self.felt.feel.exaggeration());
        let travel = if design.equal_travel { ", equal travel" } else { "" };
        let remark = format!(
            "{}; {reed}; {exaggeration}{travel}, {} mNm. A disc stands where the note speaks, a ring where a resting reed is shut.",
            file.name, design.strength_mnm
        );
        plot.draw(|| {
            let notes = Ok(notes.into_iter().map(Torque::of).collect());
            let panel = AtContrast { contrast: design.contrast, notes };
            torques(law_name(design.law), &remark, self.felt.ceiling, &[panel])
        })
    }

    fn curve(&self, note: &NoteFeel, plot: &Plot) -> Result<(), Failure> {
        let mut table = self.table.open_beside(plot, "angle_deg,torque_mnm")?;
        let a = note.landmarks;
        table.comment(format_args!(
            "written {} ({}): threshold {:.2}, beating {:.2}, closure {:.2}, extinction {:.2}, wall {:.2} degrees",
            note.written.0,
            note.written,
            a.a_on_deg,
            a.a_beat_deg,
            a.a_close_deg,
            a.a_off_deg,
            note.feel.wall_deg
        ))?;
        let steps = ((f64::from(note.feel.wall_deg) + BEHIND_WALL_DEG - FROM_DEG) / STEP_DEG) as i32;
        let first = (FROM_DEG / STEP_DEG) as i32;
        for step in first..=first + steps {
            let angle = f64::from(step) / 10.0;
            let torque = torque_law::torque_mnm(&note.feel, ReedTables::reference(), angle);
            table.line(format_args!("{angle:.1},{torque:.5}"))?;
        }
        table.finish()
    }
}
