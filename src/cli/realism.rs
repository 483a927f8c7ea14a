//! `chalumeau realism`: plays the recorded notes and measures how near they come to the recordings.

use crate::cli::Failure;
use crate::cli::csv_table::{CsvTable, TableArgs, number};
use crate::cli::plot_args::PlotArgs;
use crate::cli::progress_bar::progress;
use crate::cli::score_args::preset_called;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::{PlayedArgs, dynamic, within};
use crate::cli::tune::with_preset;
use crate::presets::Preset;
use chalumeau_core::analysis::noise_bands::{BANDS_HZ, noise_db};
use chalumeau_core::analysis::partials::{Partial, Wander};
use chalumeau_core::analysis::pitch;
use chalumeau_core::analysis::spectrum::steady_segment;
use chalumeau_core::analysis::steady_note::{RATE_HZ, SteadyNote};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::player::response::breath_of_dynamic;
use chalumeau_core::instrument::{Model, Reach, Settings};
use chalumeau_core::measure::realism::{
    CENTROID_RATIOS, Dynamic, HEADROOM_DB, NoteScore, REGISTERS, RecordedNote, Summary, louder_is_brighter,
    mean, median, register, render,
};
use chalumeau_core::measure::shelf::Shelf;
use chalumeau_core::parallel;
use chalumeau_core::score::breath::{BreathCurve, GAMMA_MAX};
use chalumeau_core::units::SoundingNote;
use chalumeau_figure::realism::{ComparedDynamic, ComparedNote, figure};
use clap::Args;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Harmonics of which the beginning is timed.
const TIMED: [usize; 3] = [1, 3, 5];

const EXAMPLES: &str = "\
Examples:
  chalumeau realism --csv realism.csv --plot realism.png
  chalumeau realism --gamma 0.42,0.56,0.78 --zeta 0.25
      One pressure for each dynamic, on a lip that stays.
  chalumeau realism --noise 0 --csv -
  chalumeau realism --shelf 4000,2
      As a microphone in front may hear it.

The recordings are TinySOL's (Cella, Ghisi, Lostanlen, Levy, Fineberg, Maresz 2020, CC BY 4.0): one player, one take \
for each note. A recorded note differs from its recorded neighbours by 2.7, 6.8 and 4.8 dB at pp, mf and ff.";

/// Play the recorded notes and measure how near they come to the recordings
///
/// Plays every other note from sounding D#3 to G6 for 4 s at pp, mf and ff, four takes of each, and measures them as the
/// recordings were measured (tests/reference/clarinet_spectra_method.md). error_db is the mean distance of harmonics 2 to 10, each spectrum against its
/// strongest harmonic and clipped at -60 dB; notes that the instrument does not have are left out; a take that does not sound, or sounds in another register, counts 20 dB. d1 to
/// d10 are the differences, played less recorded. Noise is that between the harmonics, by bands, against the whole tone; t90 is
/// the time in which a harmonic reaches 90 % of its level, nan where it does not stand 10 dB above the noise beside it; wander is that of the steady part. Comments sum up.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct RealismCommand {
    /// The player's dynamic at pp, mf and ff, each 0..1 or pp, p, mp, mf, f, ff [default: 0,0.6,1]
    #[arg(long, value_name = "D,D,D", value_delimiter = ',', num_args = 1, conflicts_with = "gamma", value_parser = dynamic)]
    dynamic: Vec<f64>,
    /// Instead: constant mouth pressure over closing pressure at pp, mf and ff, each 0..3
    #[arg(long, value_name = "G,G,G", value_delimiter = ',', num_args = 1, value_parser = |s: &str| within(s, 0.0, f64::from(GAMMA_MAX)))]
    gamma: Vec<f64>,
    /// Hear the notes behind a shelf of first order: frequency where half of the lift is reached, Hz, and lift of the highs, dB
    #[arg(long, value_name = "HZ,DB", value_parser = shelf)]
    shelf: Option<Shelf>,
    /// How often to play each note, 1..16: takes differ in breath noise and Life, as those of a player do
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = |s: &str| s.parse::<u8>().ok().filter(|takes| (1..=16).contains(takes)).ok_or("must be a whole number in 1..16"))]
    takes: u8,
    /// Play a preset; other flags and --set change it
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

/// A note that was played for a recording.
struct Heard {
    /// Number of the take, from 1.
    take: usize,
    score: NoteScore,
    /// Level of the noise in [`BANDS_HZ`] re the tone, dB.
    noise_db: Vec<f64>,
    /// Time to 90 % of the harmonics [`TIMED`], s.
    t90_s: [Option<f64>; 3],
    wander: Option<Wander>,
}

impl RealismCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.table.check_files(&[self.instrument.instrument.file()], &[self.plot.path()])?;
        self.settings.refuse_room_players_and_keys()?;
        let file = self.instrument.load_for(self.preset.as_ref())?;
        let (breaths, mut settings, blown) = self.blown(&file)?;
        settings.gain_db -= HEADROOM_DB as f32;
        settings.reach = Reach::default();
        let plot = self.plot.open(self.table.force())?;
        let mut table = self.table.open_beside(&plot, &header())?;
        let name = with_preset(&file.name, self.preset.as_ref());
        if file.transposition != Bundled::BFlat.file().transposition {
            say!("warning: the recordings are of a B flat clarinet");
        }
        let (recorded, left_out) = recorded_notes_of(&file);
        if let Some(left_out) = &left_out {
            say!("warning: {left_out}; the others are left out");
        }
        if recorded.is_empty() {
            return Err(Failure::Usage(format!("{} has none of the recorded notes", file.name)));
        }
        let model = self.instrument.model(file, RATE_HZ as u32, settings.a4_hz)?;
        let heard = self.play_all(&recorded, &model, &settings, &breaths);
        let shelf = self.shelf.map_or_else(String::new, |shelf| {
            format!("; behind a shelf of {} dB at {} Hz", shelf.lift_db, shelf.middle_hz)
        });
        let about = vec![
            format!(
                "{name}; {blown} at pp, mf, ff; zeta {}, strength {}, breath noise {}{shelf}",
                settings.zeta, settings.strength, settings.noise
            ),
            "recordings of a B flat clarinet: TinySOL (Cella, Ghisi, Lostanlen, Levy, Fineberg, Maresz 2020), CC BY 4.0, one take for each note"
                .to_owned(),
        ];
        // A mean of nothing.
        let summary: Vec<_> = summary(&heard).iter().map(|line| line.replace("NaN", "none")).collect();
        for line in about.iter().chain(&left_out).chain(&summary) {
            table.comment(format_args!("{line}"))?;
        }
        for note in &heard {
            write(&mut table, note)?;
        }
        table.finish()?;
        plot.draw(|| figure("Realism", &about, CENTROID_RATIOS, &compared(&heard)))
    }
}

/// The recorded notes that the chart of an instrument has, and how many of them these are if they are not all.
fn recorded_notes_of(file: &InstrumentFile) -> (Vec<RecordedNote>, Option<String>) {
    let all = RecordedNote::all();
    let pitches = |notes: &[RecordedNote]| notes.iter().map(|note| note.midi).collect::<BTreeSet<_>>().len();
    let many = pitches(&all);
    let is_fingered = |note: &RecordedNote| {
        let written = SoundingNote(note.midi).written(file.transposition);
        written.is_some_and(|written| file.fingering(written).is_some())
    };
    let recorded: Vec<_> = all.into_iter().filter(is_fingered).collect();
    let count = pitches(&recorded);
    (recorded, (count < many).then(|| format!("{count} of {many} recorded notes are in this chart")))
}

/// A shelf as it is written: 4000,2.
fn shelf(text: &str) -> Result<Shelf, String> {
    let numbers = text.split_once(',').and_then(|(hz, db)| Some((hz.parse().ok()?, db.parse().ok()?)));
    let (middle_hz, lift_db) =
        numbers.ok_or("write a frequency in Hz and a lift in dB, for example 4000,2")?;
    if !(20.0..=20_000.0).contains(&middle_hz) || !(-24.0..=24.0).contains(&lift_db) {
        return Err(format!("{middle_hz} Hz, {lift_db} dB: from 20 to 20000 Hz, from -24 to 24 dB"));
    }
    Ok(Shelf { middle_hz, lift_db })
}

/// Three numbers of a flag.
fn three(flag: &str, given: &[f64], default: [f64; 3]) -> Result<[f64; 3], Failure> {
    match *given {
        [] => Ok(default),
        [pp, mf, ff] => Ok([pp, mf, ff]),
        _ => Err(Failure::Usage(format!(
            "{flag} takes three numbers, for pp, mf and ff, got {}; for example {flag} {}",
            given.len(),
            words(&default)
        ))),
    }
}

impl RealismCommand {
    /// Values of a breath curve at pp, mf and ff, the settings under which they are played, and both in words.
    fn blown(&self, file: &InstrumentFile) -> Result<([f32; 3], Settings, String), Failure> {
        let base = self.preset.as_ref().map(Preset::settings);
        if self.gamma.is_empty() {
            let dynamics = three("--dynamic", &self.dynamic, Dynamic::ALL.map(Dynamic::played))?;
            let settings = self.settings.with_dynamics(base.as_ref(), file)?;
            let breaths = dynamics.map(|dynamic| breath_of_dynamic(dynamic, &settings) as f32);
            return Ok((breaths, settings, format!("dynamic {}", words(&dynamics))));
        }
        let gammas = three("--gamma", &self.gamma, [0.42, 0.56, 0.78])?;
        let highest = gammas.into_iter().fold(0.0, f64::max);
        let settings = self.settings.blown_by(base.as_ref(), &BreathCurve::constant(highest as f32), file)?;
        Ok((gammas.map(|gamma| gamma as f32), settings, format!("gamma {}", words(&gammas))))
    }

    /// Plays all takes of a note for every recording, on all cores.
    fn play_all(
        &self,
        recorded: &[RecordedNote],
        model: &Arc<Model>,
        settings: &Settings,
        breaths: &[f32; 3],
    ) -> Vec<Heard> {
        let takes = usize::from(self.takes);
        let bar = progress(recorded.len() * takes);
        let play = |at: usize| {
            let note = &recorded[at / takes];
            let breath = breaths[note.dynamic as usize];
            let mut samples = render(model, settings, SoundingNote(note.midi), breath, at);
            if let Some(shelf) = self.shelf {
                shelf.apply(&mut samples, RATE_HZ);
            }
            listen(note, &samples, 1 + at % takes)
        };
        // Nothing ends it early, so there is always an answer.
        let heard = parallel::each(recorded.len() * takes, play, &mut |_| {
            bar.inc(1);
            ControlFlow::Continue(())
        });
        bar.finish_and_clear();
        heard.unwrap_or_default()
    }
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

fn listen(recorded: &RecordedNote, samples: &[f64], take: usize) -> Heard {
    let played =
        SteadyNote::measure(samples).map(|note| SteadyNote { rms_dbfs: note.rms_dbfs + HEADROOM_DB, ..note });
    let score = NoteScore::new(recorded.clone(), played);
    let segment = steady_segment(samples, RATE_HZ).map_or(&[][..], |range| &samples[range]);
    let near_hz = score.played.as_ref().map(|played| played.f0_hz);
    let f0_hz = near_hz.and_then(|hz| pitch::refine_hz(segment, RATE_HZ, hz));
    Heard {
        take,
        noise_db: f0_hz.map_or_else(Vec::new, |hz| noise_db(segment, RATE_HZ, hz, &BANDS_HZ)),
        t90_s: TIMED.map(|harmonic| Partial::clear_t90_s(samples, RATE_HZ, f0_hz?, harmonic)),
        wander: f0_hz.and_then(|hz| Wander::measure(segment, RATE_HZ, hz)),
        score,
    }
}

/// The end of a band as it is written: 300, 1k.
fn hertz(hz: f64) -> String {
    if hz < 1_000.0 { hz.to_string() } else { format!("{}k", hz / 1_000.0) }
}

fn band((low_hz, high_hz): (f64, f64)) -> String {
    format!("{}_{}", hertz(low_hz), hertz(high_hz))
}

fn header() -> String {
    let mut columns: Vec<String> =
        "sounding_midi,register,dynamic,take,cents,error_db,centroid_hz,centroid_ratio,h3_h2_db,\
         recorded_h3_h2_db,level_db,recorded_level_db"
            .split(',')
            .map(str::to_owned)
            .collect();
    columns.extend((1..=10).map(|harmonic| format!("d{harmonic}_db")));
    columns.extend(BANDS_HZ.map(|range| format!("noise_{}_db", band(range))));
    columns.extend(TIMED.map(|harmonic| format!("t90_h{harmonic}_ms")));
    columns.extend(
        ["range_cents", "slow_cents", "fast_cents", "level_wander_db", "h3_wander_db", "h5_wander_db"]
            .map(str::to_owned),
    );
    columns.join(",")
}

/// A number with so many digits; "nan" where there is none.
fn digits(value: Option<f64>, digits: usize) -> String {
    number(value.unwrap_or(f64::NAN), digits)
}

fn write(table: &mut CsvTable, note: &Heard) -> Result<(), Failure> {
    let (score, recorded) = (&note.score, &note.score.recorded);
    let played = score.played.as_ref();
    let wanted_hz = SoundingNote(recorded.midi).frequency_hz(440.0);
    let (third, recorded_third) = score.third_over_second_db();
    let mut fields = vec![
        recorded.midi.to_string(),
        register(recorded.midi).to_owned(),
        recorded.dynamic.name().to_owned(),
        note.take.to_string(),
        digits(played.map(|played| chalumeau_core::units::cents(played.f0_hz, wanted_hz)), 1),
        digits(Some(score.error_db), 2),
        digits(played.map(|played| played.centroid_hz), 1),
        digits(score.centroid_ratio(), 3),
        digits(third, 1),
        digits(Some(recorded_third), 1),
        digits(played.map(|played| played.rms_dbfs), 1),
        digits(Some(recorded.rms_dbfs), 1),
    ];
    fields.extend((0..10).map(|harmonic| digits(score.differences_db.get(harmonic).copied(), 1)));
    fields.extend((0..BANDS_HZ.len()).map(|band| digits(note.noise_db.get(band).copied(), 1)));
    fields.extend(note.t90_s.map(|t90_s| digits(t90_s.map(|s| 1e3 * s), 0)));
    let wander = |value: fn(&Wander) -> f64, places: usize| digits(note.wander.as_ref().map(value), places);
    fields.extend([
        wander(|wander| wander.range_cents, 2),
        wander(|wander| wander.slow_cents, 3),
        wander(|wander| wander.fast_cents, 3),
        wander(|wander| wander.level_db, 3),
        wander(|wander| wander.harmonics_db[1], 3),
        wander(|wander| wander.harmonics_db[2], 3),
    ]);
    table.line(format_args!("{}", fields.join(",")))
}

fn of(heard: &[Heard], dynamic: Dynamic) -> impl Iterator<Item = &Heard> {
    heard.iter().filter(move |note| note.score.recorded.dynamic == dynamic)
}

/// What the comments say.
fn summary(heard: &[Heard]) -> Vec<String> {
    let summaries =
        Dynamic::ALL.map(|dynamic| (dynamic, Summary::of(of(heard, dynamic).map(|note| &note.score))));
    let mut lines: Vec<String> =
        summaries.iter().map(|(dynamic, summary)| line(*dynamic, summary, heard)).collect();
    let [(_, pp), (_, mf), (_, ff)] = &summaries;
    let step = |from: &Summary, to: &Summary| {
        format!("{:.1} ({:.1})", to.level_db.0 - from.level_db.0, to.level_db.1 - from.level_db.1)
    };
    lines.push(format!(
        "level, dB (recorded): pp to mf {}, mf to ff {}, pp to ff {}",
        step(pp, mf),
        step(mf, ff),
        step(pp, ff)
    ));
    let takes = heard.iter().map(|note| note.take).max().unwrap_or(1);
    let brighter = mean((1..=takes).map(|take| {
        let own = heard.iter().filter(|note| note.take == take);
        louder_is_brighter(&own.map(|note| note.score.clone()).collect::<Vec<_>>())
    }));
    lines.push(format!("louder is brighter on {:.0} % of steps", 100.0 * brighter));
    let noise: Vec<String> = BANDS_HZ
        .iter()
        .enumerate()
        .map(|(at, &range)| {
            let levels = of(heard, Dynamic::Mf).filter_map(|note| note.noise_db.get(at).copied());
            format!("{} {:.0}", band(range).replace('_', "-"), median(levels))
        })
        .collect();
    lines.push(format!("noise at mf, median dB re the tone, by Hz: {}", noise.join(", ")));
    let t90: Vec<String> = TIMED
        .iter()
        .enumerate()
        .map(|(at, harmonic)| {
            let times = heard.iter().filter_map(|note| note.t90_s[at]);
            format!("h{harmonic} {:.0}", 1e3 * median(times))
        })
        .collect();
    lines.push(format!("t90, median ms: {}", t90.join(", ")));
    let wander =
        |value: fn(&Wander) -> f64| median(heard.iter().filter_map(|note| note.wander.as_ref()).map(value));
    lines.push(format!(
        "wander, medians: range {:.2} cents, {:.3} cents slow, {:.3} fast; level {:.3} dB, h3 {:.3}, h5 {:.3}",
        wander(|w| w.range_cents),
        wander(|w| w.slow_cents),
        wander(|w| w.fast_cents),
        wander(|w| w.level_db),
        wander(|w| w.harmonics_db[1]),
        wander(|w| w.harmonics_db[2])
    ));
    lines
}

/// The line of one dynamic.
fn line(dynamic: Dynamic, summary: &Summary, heard: &[Heard]) -> String {
    let registers: Vec<String> = REGISTERS
        .iter()
        .filter_map(|(name, low, high)| {
            let own = of(heard, dynamic).filter(|note| (*low..=*high).contains(&note.score.recorded.midi));
            let error_db = mean(own.map(|note| note.score.error_db));
            // An instrument may have no note of a register.
            error_db.is_finite().then(|| format!("{name} {error_db:.1}"))
        })
        .collect();
    let (third, recorded_third) = summary.third_over_second_db;
    format!(
        "{}: error {:.2} dB (odd takes out {:.2}; {}), centroid right on {:.0} % of {} takes, median ratio {:.2}, h3 over h2 up to B3 \
         {third:.1} dB (recorded {recorded_third:.1}), {} failed",
        dynamic.name(),
        summary.error_db,
        summary.clean_error_db,
        registers.join(", "),
        100.0 * summary.centroid_share,
        summary.notes,
        summary.centroid_ratio,
        summary.failed
    )
}

/// For the figure.
fn compared(heard: &[Heard]) -> Vec<ComparedDynamic> {
    Dynamic::ALL
        .into_iter()
        .map(|dynamic| {
            let scores: Vec<&NoteScore> = of(heard, dynamic).map(|note| &note.score).collect();
            let note = |score: &&NoteScore| ComparedNote {
                midi: score.recorded.midi,
                error_db: score.error_db,
                centroid_ratio: score.centroid_ratio(),
                level_db: score.played.as_ref().map(|played| played.rms_dbfs),
                recorded_level_db: score.recorded.rms_dbfs,
            };
            let difference =
                |at: usize| mean(scores.iter().filter_map(|score| score.differences_db.get(at).copied()));
            ComparedDynamic {
                name: dynamic.name().to_owned(),
                notes: scores.iter().map(note).collect(),
                error_db: mean(scores.iter().map(|score| score.error_db)),
                differences_db: (0..10).map(difference).collect(),
            }
        })
        .collect()
}
