//! `chalumeau tune`: plays every note and measures its pitch.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named, number};
use crate::cli::plot_args::PlotArgs;
use crate::cli::progress_bar::progress;
use crate::cli::score_args::{GAMMA_DEFAULT, preset_called};
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{NotesArg, PlayedArgs, dynamic, rate, within};
use crate::presets::Preset;
use chalumeau_core::analysis::pitch::{self, OTHER_CENTS};
use chalumeau_core::analysis::spectrum::rms_dbfs;
use chalumeau_core::instrument::player::dynamics::MEZZO_FORTE;
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::{Clarinet, Model, Reach, Settings, Tuning};
use chalumeau_core::parallel;
use chalumeau_core::score;
use chalumeau_core::score::Score;
use chalumeau_core::score::breath::{BreathCurve, GAMMA_MAX};
use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
use chalumeau_figure::tune::{self, Round, TunedNote};
use clap::Args;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Time for a note to become steady, then to be measured, s.
const SETTLE_S: f64 = 0.8;
const MEASURE_S: f64 = 0.6;

/// Quieter than this is silence, dBFS without the user's gain. The softest note of pianissimo that was met has -42 dBFS; a reed
/// through which no air flows (--A 0) moves at most as loud as -71 dBFS.
const SILENT_DBFS: f64 = -65.0;

/// Share of the sample rate below which a rendered note is heard: the resampler lets nothing beyond half of it pass (by judgement).
const ROOM: f64 = 0.45;

/// A note that is so far off beside the others has the name of another octave. A squeak is nearer: that of C#7 lies 734 cents off.
const MISNAMED_CENTS: f64 = 900.0;

const EXAMPLES: &str = "\
Examples:
  chalumeau tune --rate 48000 --gamma 0.5
  chalumeau tune --gamma 0.8 --tempered --csv loud.csv
  chalumeau tune --dynamic pp --csv soft.csv
  chalumeau tune --preset \"Big band lead\" --dynamic ff
  chalumeau tune --written G5 --strength 3.5
  chalumeau tune --gamma 0.7 --plot tune.png    natural and tempered, and as built, as a figure
  chalumeau tune --instrument mine.toml --untuned";

/// Play every note steadily and measure its pitch
///
/// Each note is tongued, held (without breath noise unless --noise is given) and measured when steady. Cents are against equal temperament at --a4.
/// register_ok is 1 when the note asked for sounds, within 150 cents, 0 when another does (a clarion note that falls down a twelfth, a
/// squeak) or none; a note that does not sound has nan. A small delay for each note corrects what bore and reed leave out of
/// tune; as_built_cents is where the bore plays the note without it, as it does for all with --untuned. If you move a hole, read this column.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct TuneCommand {
    #[command(flatten)]
    notes: NotesArg,
    /// Mouth pressure over closing pressure, 0..3 [default: 0.5]
    #[arg(long, value_name = "G", conflicts_with = "dynamic", value_parser = |s: &str| within(s, 0.0, f64::from(GAMMA_MAX)))]
    gamma: Option<f64>,
    /// Instead: the player's dynamic, 0..1 or pp, p, mp, mf, f, ff
    #[arg(long, value_name = "D", value_parser = dynamic)]
    dynamic: Option<f64>,
    /// Sample rate, Hz, 1000..1536000
    #[arg(long, alias = "sr", value_name = "HZ", default_value = "48000", value_parser = rate)]
    rate: u32,
    /// Play a preset, at mezzo-forte unless --dynamic or --gamma is given; other flags and --set change it
    #[arg(long, value_name = "NAME", value_parser = preset_called)]
    preset: Option<Preset>,
    #[command(flatten)]
    instrument: PlayedArgs,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
    #[command(flatten)]
    settings: SettingsArgs,
}

impl TuneCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.instrument.file()], &[self.plot.path()])?;
        self.settings.refuse_room_players_and_keys()?;
        let file = self.instrument.load_for(self.preset.as_ref())?;
        let base = self.preset.as_ref().map(Preset::settings);
        let notes = self.notes.notes(&file)?;
        let of_preset = base.filter(|_| self.gamma.is_none()).map(|_| MEZZO_FORTE);
        let (curve, mut settings, blown) = match self.dynamic.or(of_preset) {
            Some(dynamic) => {
                let settings = self.settings.with_dynamics(base.as_ref(), &file)?;
                let curve = BreathCurve::constant(breath_of_dynamic(dynamic, &settings) as f32);
                (curve, settings, format!("dynamic {dynamic}"))
            }
            None => {
                let gamma = self.gamma.unwrap_or(f64::from(GAMMA_DEFAULT));
                let curve = BreathCurve::constant(gamma as f32);
                let settings = self.settings.blown_by(base.as_ref(), &curve, &file)?;
                (curve, settings, format!("gamma {gamma}"))
            }
        };
        // Written notes are measured, whichever keys a preset moves.
        settings.reach = Reach::default();
        if !self.settings.noise_given() {
            settings.noise = 0.0;
        }
        let rate = self.rate;
        let name = with_preset(&file.name, self.preset.as_ref());
        let transposition = file.transposition;
        let plot = self.plot.open(self.table.force())?;
        let mut table =
            self.table.open_beside(&plot, "written,written_midi,f_hz,cents,register_ok,as_built_cents")?;
        let tuning = if self.instrument.is_as_built() { "as built" } else { name_of(settings.tuning) };
        table.comment(format_args!(
            "{name}, {tuning}; {blown}, {rate} Hz, A4 = {} Hz; tongued, measured from {SETTLE_S} s on{}",
            settings.a4_hz,
            self.settings.given_in_words()?
        ))?;
        let built = self.instrument.as_built(&file, rate)?;
        let as_built = measure_all(&notes, &built, &curve, &settings, rate);
        let tuned = match self.instrument.is_as_built() {
            true => None,
            false => Some(self.instrument.model(file, rate, settings.a4_hz)?),
        };
        let heard = match &tuned {
            Some(model) => measure_all(&notes, model, &curve, &settings, rate),
            None => as_built.clone(),
        };
        for ((note, heard), as_built) in notes.iter().zip(&heard).zip(&as_built) {
            let (name, WrittenNote(written)) = (named(note), note);
            let as_built = number(as_built.map_or(f64::NAN, |(_, cents)| cents), 3);
            match heard {
                Some((f_hz, cents)) => {
                    let register_ok = u8::from(cents.abs() <= OTHER_CENTS);
                    let cents = number(*cents, 3);
                    table
                        .line(format_args!("{name},{written},{f_hz:.5},{cents},{register_ok},{as_built}"))?;
                }
                None => table.line(format_args!("{name},{written},nan,nan,0,{as_built}"))?,
            }
        }
        table.finish()?;
        // What all notes are off by is no mistake in the chart.
        let mut offs: Vec<f64> = as_built.iter().flatten().map(|(_, cents)| *cents).collect();
        offs.sort_by(f64::total_cmp);
        let usual = offs.get(offs.len() / 2).copied().unwrap_or_default();
        for (note, (_, cents)) in
            notes.iter().zip(&as_built).filter_map(|(note, heard)| Some((note, heard.as_ref()?)))
        {
            let off = cents - usual;
            if off.abs() > MISNAMED_CENTS {
                let how = if off > 0.0 { "above" } else { "below" };
                say!(
                    "warning: beside the other notes, {note} sounds {:.0} cents {how} its name: look at its name and its holes in the chart",
                    off.abs()
                );
            }
        }
        let silent = notes.iter().zip(&heard).filter(|(_, heard)| heard.is_none());
        let silent: Vec<_> = silent.map(|(note, _)| note.to_string()).collect();
        if !silent.is_empty() {
            say!("note: with {blown} there is no tone on {}", silent.join(" "));
        }
        let beyond = |note: &WrittenNote| {
            let sounding = note.sounding(transposition);
            sounding.is_some_and(|note| note.frequency_hz(f64::from(settings.a4_hz)) > ROOM * f64::from(rate))
        };
        if notes.iter().any(beyond) {
            say!("note: a rate of {rate} Hz has no room for the highest of these notes; --rate 48000 has");
        }
        plot.draw(|| {
            let mut rounds = Vec::new();
            if let Some(model) = &tuned {
                // The other way of tuning beside it.
                let other = match settings.tuning {
                    Tuning::Natural => Tuning::Tempered,
                    Tuning::Tempered => Tuning::Natural,
                };
                let beside = Settings { tuning: other, ..settings };
                let beside = (other, measure_all(&notes, model, &curve, &beside, rate));
                let both = [(settings.tuning, heard), beside];
                rounds.extend(both.map(|(tuning, heard)| round(name_of(tuning), &notes, &heard)));
                rounds.sort_by(|a, b| a.name.cmp(&b.name));
            }
            let note = format!(
                "{blown}, A4 = {} Hz, strength {}, zeta {}, {} Celsius; each note tongued, measured from {SETTLE_S} s on",
                settings.a4_hz, settings.strength, settings.zeta, settings.temperature_c
            );
            tune::figure(&name, &note, &rounds, &round("as built", &notes, &as_built))
        })
    }
}

/// An instrument and its preset, in words.
pub fn with_preset(instrument: &str, preset: Option<&Preset>) -> String {
    preset.map_or_else(|| instrument.to_owned(), |preset| format!("{instrument}, {}", preset.name))
}

fn name_of(tuning: Tuning) -> &'static str {
    match tuning {
        Tuning::Natural => "natural",
        Tuning::Tempered => "tempered",
    }
}

/// One round for the figure.
fn round(name: &str, notes: &[WrittenNote], heard: &[Option<(f64, f64)>]) -> Round {
    let heard = heard.iter().map(|heard| match *heard {
        Some((_, cents)) if cents.abs() <= OTHER_CENTS => TunedNote::Own(cents),
        Some((_, cents)) => TunedNote::Other(cents),
        None => TunedNote::Silence,
    });
    Round { name: name.to_owned(), notes: notes.iter().map(|written| written.0).zip(heard).collect() }
}

/// Frequency and cents of every note, on all cores, with progress.
fn measure_all(
    notes: &[WrittenNote],
    model: &Arc<Model>,
    curve: &BreathCurve,
    settings: &Settings,
    rate: u32,
) -> Vec<Option<(f64, f64)>> {
    let bar = progress(notes.len());
    let measured = |note: usize| measure(notes[note], model, curve, settings, rate);
    // Nothing ends it early, so there is always an answer.
    let heard = parallel::each(notes.len(), measured, &mut |_| {
        bar.inc(1);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    heard.unwrap_or_default()
}

/// Frequency of a note, Hz, and its distance from where it should be, cents; `None` if it does not sound.
fn measure(
    written: WrittenNote,
    model: &Arc<Model>,
    curve: &BreathCurve,
    settings: &Settings,
    rate: u32,
) -> Option<(f64, f64)> {
    let sounding = written.sounding(model.file.transposition).unwrap_or(SoundingNote(written.0));
    let mut clarinet = Clarinet::new(model.clone(), f64::from(rate));
    clarinet.set_settings(settings);
    clarinet.reset();
    let score = Score::note(sounding, SETTLE_S + MEASURE_S, rate).blown(curve, settings, rate);
    let mut samples: Vec<f64> = Vec::with_capacity(score.samples);
    let Ok(()) = score::play(&mut clarinet, &score, 4096, |block| {
        samples.extend(block.iter().map(|&sample| f64::from(sample)));
        Ok::<_, Infallible>(())
    });
    let steady = &samples[samples.len().min((SETTLE_S * f64::from(rate)) as usize)..];
    if rms_dbfs(steady) < SILENT_DBFS + f64::from(settings.gain_db) {
        return None;
    }
    let wanted_hz = sounding.frequency_hz(f64::from(settings.a4_hz));
    let heard = pitch::fundamental_near_hz(steady, f64::from(rate), wanted_hz);
    heard.map(|f_hz| (f_hz, cents(f_hz, wanted_hz)))
}
