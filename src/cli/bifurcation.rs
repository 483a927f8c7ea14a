//! `chalumeau bifurcation`: one note with slowly rising and falling breath.

use crate::cli::Failure;
use crate::cli::csv_table::TableArgs;
use crate::cli::plot_args::PlotArgs;
use crate::cli::progress_bar::progress;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{PlayedArgs, note, rate, sounding, within};
use crate::cli::silent_keys::silent_keys;
use crate::cli::threshold::linear_threshold;
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::measure::bifurcation;
use chalumeau_core::measure::bifurcation::{BifurcationDiagram, Transitions};
use chalumeau_core::score::breath::{BreathCurve, GAMMA_MAX};
use chalumeau_core::units::{SoundingNote, WrittenNote};
use chalumeau_figure::bifurcation::Ramp;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  chalumeau bifurcation --written F3 --plot f3.png
  chalumeau bifurcation --written G4 --zeta 0.2 --seconds 60 --csv g4.csv";

/// Measure how loud a note is while the breath slowly rises and falls
///
/// Gamma (mouth pressure over closing pressure) runs from 0 to --to and back, --seconds each way. direction is 1 (rising)
/// or -1 (falling), rms is the pressure in the mouthpiece over the closing pressure, shut is the fraction of time the reed
/// is shut, own the share of power at the note's frequency, near 0 where another register sounds in its place. Comments say where the
/// note begins, the reed shuts for a part of each period, the note chokes (or gives way to another register), returns and ends. Up and down differ because a moving breath
/// passes a threshold before the note has grown or died. If the difference does not shrink with more --seconds, it is true
/// hysteresis. Where the reed beats, by `report` and the plugin, is calculated for a
/// straight facing (--lay 0). On a curved one it shuts only at a higher pressure.
///
/// The linear threshold among the comments is that of `chalumeau threshold`: the theory of a reed without inertia. As the reed has inertia,
/// some high notes, such as C6, begin below it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct BifurcationCommand {
    /// Written note: a MIDI number (65) or a name (F4)
    #[arg(long, value_name = "NOTE", value_parser = note)]
    written: u8,
    /// Largest mouth pressure over closing pressure, 0.2..3
    #[arg(long, value_name = "G", default_value = "2", value_parser = |s: &str| within(s, 0.2, f64::from(GAMMA_MAX)))]
    to: f64,
    /// Time of the rise, and again of the fall, s, 0.5..600
    #[arg(long, value_name = "S", default_value = "20", value_parser = |s: &str| within(s, 0.5, 600.0))]
    seconds: f64,
    /// Sample rate, Hz, 1000..1536000
    #[arg(long, alias = "sr", value_name = "HZ", default_value = "48000", value_parser = rate)]
    rate: u32,
    #[command(flatten)]
    instrument: PlayedArgs,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
    #[command(flatten)]
    settings: SettingsArgs,
}

impl BifurcationCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.instrument.file()], &[self.plot.path()])?;
        self.settings.refuse_room_players_and_keys()?;
        let file = self.instrument.load()?;
        let written = WrittenNote(self.written);
        let sounding = sounding(&file, written)?;
        let curve = BreathCurve::swell(self.to as f32, self.seconds);
        let settings = self.settings.blown_by(None, &curve, &file)?;
        let plot = self.plot.open(self.table.force())?;
        let mut table = self.table.open_beside(&plot, "direction,gamma,rms,shut,own")?;
        let threshold = linear_threshold(&file, written, &settings);
        let name = file.name.clone();
        let model = self.instrument.model(file, self.rate, settings.a4_hz)?;
        refuse_silent(written, sounding, &model, &settings)?;
        let bar = progress((2.0 * self.seconds * f64::from(self.rate)) as usize);
        let found = bifurcation::measure(
            &model,
            &settings,
            sounding,
            self.to as f32,
            self.seconds,
            self.rate,
            |samples| bar.inc(samples as u64),
        );
        bar.finish_and_clear();

        let note = format!(
            "zeta {}, strength {}, lay {}, breath noise {}; gamma 0 to {} in {} s and back{}",
            settings.zeta,
            settings.strength,
            settings.lay,
            settings.noise,
            self.to,
            self.seconds,
            self.settings.given_in_words()?
        );
        table.comment(format_args!("{name}; written {written}; {note}"))?;
        let changes = found.transitions();
        table.comment(format_args!("gamma: {}", changes_in_words(threshold, &changes, self.to)))?;
        if let Some((way, gamma)) = found.other_register() {
            let way = if way > 0 { "rising" } else { "falling" };
            say!(
                "warning: another register than that of {written} sounds, first at gamma {gamma:.2} ({way}): a ramp that is slower, --seconds, keeps more notes"
            );
        }
        for (direction, way) in [(1, &found.up), (-1, &found.down)] {
            for point in way {
                table.line(format_args!(
                    "{direction},{:.6},{:.6e},{:.4},{:.4}",
                    point.gamma, point.rms, point.shut, point.own
                ))?;
            }
        }
        table.finish()?;
        let way = |way: &[bifurcation::RampPoint]| way.iter().map(|p| [p.gamma, p.rms, p.shut]).collect();
        plot.draw(|| {
            Ramp {
                title: format!("{name}, written {written}"),
                note,
                closing_kpa: 1e-3 * settings.closing_pa(),
                up: way(&found.up),
                down: way(&found.down),
                threshold,
                begins: changes.begins,
                shuts: changes.shuts,
                chokes: changes.chokes,
                gives_way: gives_way(&found, &changes),
                returns: changes.returns,
                ends: changes.ends,
            }
            .figure()
        })
    }
}

/// Whether the note of a growing breath ends because another register takes over, not because the reed stays shut.
fn gives_way(found: &BifurcationDiagram, changes: &Transitions) -> bool {
    // The two are told by windows of time, which may be one apart.
    let step = found.up.windows(2).map(|pair| pair[1].gamma - pair[0].gamma).fold(0.0, f64::max);
    let (Some((1, gamma)), Some(begins), Some(chokes)) =
        (found.other_register(), changes.begins, changes.chokes)
    else {
        return false;
    };
    (begins..=chokes + 2.0 * step).contains(&gamma)
}

/// Refuses a note whose key stays silent: a table of zeros would look as if it had been measured.
pub(super) fn refuse_silent(
    written: WrittenNote,
    sounding: SoundingNote,
    model: &Model,
    settings: &Settings,
) -> Result<(), Failure> {
    if silent_keys(&[sounding], model, settings.reach).is_empty() {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "the key of {written} is silent on this instrument: its fingering does not speak in tune, so there is nothing to measure"
    )))
}

/// Gamma of every change of the note on a ramp up to `to`, for the comment in the table. What cannot be, such as the end of a
/// note that has not begun, is not told.
fn changes_in_words(threshold: Option<f64>, changes: &Transitions, to: f64) -> String {
    let Transitions { begins, shuts, chokes, returns, opens, ends } = *changes;
    let up_to = |what: &str| Some(format!("does not {what} up to gamma {to}"));
    let not = |what: &str, of: Option<f64>| of.map(|_| format!("does not {what}"));
    let all = [
        ("linear threshold", threshold, Some("no linear threshold".to_owned())),
        ("begins", begins, up_to("begin")),
        ("shuts in each period", shuts, up_to("shut in each period")),
        ("chokes", chokes, up_to("choke")),
        ("returns", returns, not("return", chokes)),
        ("shuts no more", opens, not("open for good", shuts)),
        ("ends", ends, not("end", begins)),
    ];
    let words = all.into_iter().filter_map(|(what, at, otherwise)| match at {
        Some(at) => Some(format!("{what} {at:.4}")),
        None => otherwise,
    });
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_happen_on_the_ramp_is_not_called_never() {
        let changes = Transitions { begins: Some(0.4), ..Transitions::default() };
        assert_eq!(
            changes_in_words(Some(0.35), &changes, 0.5),
            "linear threshold 0.3500, begins 0.4000, does not shut in each period up to gamma 0.5, does not choke up to gamma 0.5, does not end"
        );
    }
}
