//! `chalumeau report`: a rendering as one HTML page with its sound, figures and tables.

mod breath_and_haptics;
mod tour;

use crate::cli::Failure;
use crate::cli::doubt::Doubt;
use crate::cli::files;
use crate::cli::progress_bar::progress;
use crate::cli::render::{about, is_held_beyond};
use crate::cli::render_job::RenderJob;
use crate::cli::render_monitor::{RenderMonitor, RenderSummary};
use crate::cli::report::breath_and_haptics::BreathAndHaptics;
use crate::cli::score_args::ScoreArgs;
use crate::cli::shared_args::within;
use crate::cli::words::typed;

use crate::identity;
use crate::output::{NewFile, resolved};
use crate::parameters::{PARAMETERS, Parameter, Sets, Value};
use crate::wav::{BEGINNING_S, Depth, WavFile};
use chalumeau_core::instrument::Settings;
use chalumeau_core::measure::notes::{MeasuredNote, Spread, spread};
use chalumeau_figure::report::{Plate, Report as Page, ReportTable, Sound, TableCell, write};
use clap::Args;
use std::cell::RefCell;
use std::io::{Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// Longest sound inside a page, s: 77 MB of text at 48 kHz, about what browsers still open easily.
const INSIDE_MAX_S: f64 = 600.0;

const EXAMPLES: &str = "\
Examples:
  chalumeau report melody.mid --out melody.html
  chalumeau report --scale E3:C6 --gamma 0.5 --no-noise --out scale.html
  chalumeau report --tour --out tour.html
      A page to listen to.
  chalumeau report long.mid --wav long.wav --out long.html
      The sound is a separate file beside the page.";

/// Play like `render`, and write one HTML page about it
///
/// The page has the sound to listen to, waveform, spectrogram, pitch against the score, breath and reed as figures, the
/// instrument to scale, the mouth pressures at which notes speak, beat and choke, what a knob would feel and what it would
/// refuse, the cents of every note, and all settings. It needs no other file and no network, unless the sound is put
/// beside it with --wav.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct ReportCommand {
    #[command(flatten)]
    play: ScoreArgs,
    /// A page to listen to, instead: scales from pp to ff, slurs, attacks, techniques and rooms, each with what to listen for,
    /// on any instrument
    #[arg(long, group = "what", conflicts_with_all = ["blown", "wav", "plot_at", "preset", "scl", "seconds", "tail", "trim"])]
    tour: bool,
    /// HTML file to write
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    out: PathBuf,
    /// Write the sound to this WAV file, in the same directory as the page, instead of into the page
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    wav: Option<PathBuf>,
    /// Time of the reed's close-up, s [default: the middle of the longest note]
    #[arg(long, value_name = "S", help_heading = "Output", value_parser = |s: &str| within(s, 0.0, 1e6))]
    plot_at: Option<f64>,
    /// Replace existing files
    #[arg(long, help_heading = "Output")]
    force: bool,
}

impl ReportCommand {
    pub fn run(&self) -> Result<(), Failure> {
        self.refuse_names()?;
        self.play.refuse_open_holes()?;
        if self.tour {
            return self.write_tour();
        }
        let prepared = self.play.prepare()?;
        refuse_several_players(&prepared)?;
        prepared.warn();
        if let Some(late) = self.play.too_little_breath() {
            say!("warning: {late}");
        }
        if prepared.settings.room.amount > 0.0 {
            say!("warning: a report has one channel, on which no room is heard");
        }
        let seconds = prepared.score.seconds(prepared.rate);
        if self.wav.is_none() && seconds > INSIDE_MAX_S {
            return Err(Failure::Usage(format!(
                "{seconds:.0} s of sound are too long for a page, which holds {INSIDE_MAX_S} s; put the sound beside the page with --wav FILE"
            )));
        }
        let watch = RenderMonitor::new(&prepared, self.plot_at)?;
        let mut page = NewFile::create(&self.out, self.force)?;
        let (sound, wav, (watched, doubts)) = match &self.wav {
            Some(path) => {
                let mut wav = NewFile::create(path, self.force)?;
                let watched = played(&prepared, watch, &mut wav)?;
                (Sound::Beside(name(path)), Some(wav), watched)
            }
            None => {
                let mut bytes = Cursor::new(Vec::new());
                let watched = played(&prepared, watch, &mut bytes)?;
                (Sound::Inside(bytes.into_inner()), None, watched)
            }
        };
        let report = self.page(&prepared, &watched, sound)?;
        write(&report, &mut page).map_err(|source| Failure::Report { path: self.out.clone(), source })?;
        page.keep()?;
        if let Some(wav) = wav {
            wav.keep()?;
        }
        say!("{}: written; open it in a browser", self.out.display());
        doubts.iter().for_each(|doubt| say!("warning: {}", doubt.text()));
        if let Some(idle) = &prepared.idle {
            say!("warning: {idle}");
        }
        Ok(())
    }

    fn write_tour(&self) -> Result<(), Failure> {
        self.play.refuse_feel("a tour is played without a knob")?;
        let job = self.play.without_score()?;
        refuse_several_players(&job)?;
        let mut page = NewFile::create(&self.out, self.force)?;
        let report = tour::page(&job, command(), progress)?;
        write(&report, &mut page).map_err(|source| Failure::Report { path: self.out.clone(), source })?;
        page.keep()?;
        say!("{}: written; open it in a browser", self.out.display());
        Ok(())
    }

    fn refuse_names(&self) -> Result<(), Failure> {
        let html = self
            .out
            .extension()
            .is_some_and(|end| ["html", "htm"].iter().any(|e| end.eq_ignore_ascii_case(e)));
        if !html {
            let right = "give it a name that ends in .html";
            return Err(Failure::Usage(format!("{}: a report is a page; {right}", self.out.display())));
        }
        let written = [Some(self.out.as_path()), self.wav.as_deref()];
        files::keep_apart(files::READ, &self.play.read_files(), &written)?;
        let Some(wav) = &self.wav else {
            return NewFile::check(&self.out, self.force).map(drop).map_err(Failure::from);
        };
        if !wav.extension().is_some_and(|end| end.eq_ignore_ascii_case("wav")) {
            return Err(Failure::Usage(format!("--wav {}: the name must end in .wav", wav.display())));
        }
        // A page that is moved takes what lies beside it along.
        let folder = |path: &Path| resolved(path).and_then(|path| path.parent().map(Path::to_owned));
        if folder(wav) != folder(&self.out) {
            return Err(Failure::Usage(format!(
                "--wav {} is not in the directory of the page {}; put both into one directory",
                wav.display(),
                self.out.display()
            )));
        }
        Ok(written.into_iter().flatten().try_for_each(|path| NewFile::check(path, self.force).map(drop))?)
    }

    fn page(&self, prepared: &RenderJob, watched: &RenderSummary, sound: Sound) -> Result<Page, Failure> {
        let (file, title) = (&prepared.model.file, self.play.title());
        let mut lines = about(prepared);
        let outcome = pitches_in_words(&watched.heard, prepared.growls());
        lines.push(outcome.clone());
        let longest = watched.heard.iter().max_by_key(|heard| heard.span.to - heard.span.from);
        let longest = longest.and_then(|heard| heard.span.note.written(file.transposition));
        let fingering = longest.and_then(|written| file.fingering(written));
        let fingered = fingering.map_or(String::new(), |fingering| {
            format!(", fingered for written {}, the longest note", fingering.written)
        });
        let touch = BreathAndHaptics::new(prepared, self.play.feel(file)?, longest);
        Ok(Page {
            about: lines,
            sound: Some(sound),
            plates: vec![
                Plate {
                    figure: watched.figure(&title, about(prepared)),
                    caption: "Waveform, spectrogram, measured pitch over the notes of the score, mouth pressure, and the reed in close-up."
                        .to_owned(),
                    alternative: format!(
                        "Five panels over the time of {title}, {:.1} seconds: waveform, spectrogram up to 6 kHz, pitch \
                         over the notes of the score, mouth pressure over the pressure that shuts the reed, and reed \
                         opening with mouthpiece pressure over a few milliseconds. {outcome}",
                        prepared.score.seconds(prepared.rate)
                    ),
                },
                Plate {
                    figure: chalumeau_figure::bore::profile(file, fingering),
                    caption: format!("The instrument from the side, to scale{fingered}."),
                    alternative: format!(
                        "Bore of {} from mouthpiece to bell, {:.0} mm, with its {} tone holes{fingered}.",
                        file.name,
                        1e3 * file.length_m(),
                        file.holes.len()
                    ),
                },
            ],
            chapters: vec![touch.breath(), touch.haptics()],
            tables: vec![
                notes(prepared, &watched.heard, &outcome),
                reed(&prepared.settings),
                settings(&prepared.settings),
                instrument(prepared),
            ],
            made_by: format!("Made by {} {}: {}", identity::NAME, identity::VERSION, command()),
            title,
        })
    }
}

fn refuse_several_players(prepared: &RenderJob) -> Result<(), Failure> {
    if prepared.has_several_players() {
        let inside = "a report looks inside one instrument; leave --players and --tracks out";
        return Err(Failure::Usage(inside.to_owned()));
    }
    Ok(())
}

/// Plays and analyses; the sound goes to `out` in 16 bits.
fn played(
    prepared: &RenderJob,
    watch: RenderMonitor,
    out: &mut (impl Write + Seek),
) -> Result<(RenderSummary, Vec<Doubt>), Failure> {
    let samples = prepared.score.samples;
    let mut wav = WavFile::new(out, prepared.rate, Depth::Int16, 1, samples)?;
    let bar = progress(samples);
    // Samples and insides come in turn.
    let watch = RefCell::new(watch);
    let resets = prepared.play(1, Some(&mut |inside| watch.borrow_mut().inside(inside)), |sent, heard| {
        bar.inc(sent.len() as u64);
        watch.borrow_mut().hear(sent);
        wav.write(heard).map_err(Failure::from)
    })?;
    let level = wav.finish()?;
    bar.finish_and_clear();
    let doubts = Doubt::all(level, resets, is_held_beyond(prepared, BEGINNING_S)).collect();
    Ok((watch.into_inner().finish(), doubts))
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The command as typed, so that a reader can repeat it.
fn command() -> String {
    typed(
        std::iter::once("chalumeau".to_owned())
            .chain(std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned())),
    )
}

/// Rounded to a tenth, with its sign unless it is 0.
fn signed(cents: f64) -> String {
    let tenths = (10.0 * cents).round();
    if tenths == 0.0 { "0.0".to_owned() } else { format!("{:+.1}", tenths / 10.0) }
}

/// How many notes have a pitch, and how far they lie from equal temperament.
fn pitches_in_words(heard: &[MeasuredNote], growls: bool) -> String {
    let Some(Spread { count, own, others }) = spread(heard) else { return "No note has a pitch.".to_owned() };
    let mut words = format!("{count} of {} notes have a pitch", heard.len());
    if let Some((mean, largest)) = own {
        words +=
            &format!("; from equal temperament: mean {mean:.1} cents, largest {} cents", signed(largest));
    }
    words += &match others {
        Some((1, off)) => format!("; 1 sounds another note, {} cents off", signed(off)),
        Some((several, off)) => format!("; {several} sound other notes, up to {} cents off", signed(off)),
        None => String::new(),
    };
    if growls && others.is_some() {
        words += " (a growl may have the period of the voice)";
    }
    words + "."
}

fn word(text: impl Into<String>) -> TableCell {
    TableCell::Word(text.into())
}

fn number(text: impl Into<String>) -> TableCell {
    TableCell::Number(text.into())
}

fn notes(prepared: &RenderJob, heard: &[MeasuredNote], outcome: &str) -> ReportTable {
    let rate_hz = f64::from(prepared.rate);
    let head = ["at, s", "sounds", "written", "length, s", "pitch, Hz", "cents", "level, dBFS"];
    let row = |heard: &MeasuredNote| {
        let (from, to) = (heard.span.from as f64 / rate_hz, heard.span.to as f64 / rate_hz);
        let written = heard.span.note.written(prepared.model.file.transposition);
        // A note without a pitch says "none".
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
        vec![
            number(format!("{from:.2}")),
            word(heard.span.note.to_string()),
            word(written.map_or(String::new(), |written| written.to_string())),
            number(format!("{:.2}", to - from)),
            number(or_none(heard.hz.map(|hz| format!("{hz:.2}")))),
            number(or_none(heard.cents.map(signed))),
            number(if heard.level_dbfs.is_finite() {
                format!("{:.1}", heard.level_dbfs)
            } else {
                "silent".to_owned()
            }),
        ]
    };
    ReportTable {
        title: "Notes".to_owned(),
        about: format!(
            "{outcome} Cents are from equal temperament at A4 = {} Hz, measured between attack and release.",
            prepared.settings.a4_hz
        ),
        head: head.map(str::to_owned).to_vec(),
        rows: heard.iter().map(row).collect(),
    }
}

/// What the settings make of the reed.
fn reed(settings: &Settings) -> ReportTable {
    let law = settings.reed_law();
    let rows = [
        ("Closing pressure", format!("{:.3}", 1e-3 * settings.closing_pa()), "kPa"),
        ("Reed law H", format!("{:.6}", law.h()), ""),
        ("Reed law k", format!("{:.6}", law.k()), if settings.coupled { "follows H" } else { "free" }),
        ("Reed law A", format!("{}", law.a()), ""),
    ];
    let row = |(name, value, unit): (&str, String, &str)| vec![word(name), number(value), word(unit)];
    ReportTable {
        title: "Reed as it is played".to_owned(),
        about: String::new(),
        head: ["quantity", "value", "unit"].map(str::to_owned).to_vec(),
        rows: rows.into_iter().map(row).collect(),
    }
}

/// The value of a parameter in these settings; `None` for one that they do not hold, such as another description of the reed.
fn value(parameter: &Parameter, settings: &Settings) -> Option<Value> {
    let mut of = *settings;
    match parameter.sets? {
        Sets::Number(which) => Some(Value::Number(*of.number(which))),
        Sets::Switch(field) => Some(Value::Switch(*field(&mut of))),
        Sets::Whole(field) => Some(Value::Whole(*field(&mut of))),
        // What leaves the settings as they are is what they are.
        Sets::Choice(choose) => {
            let is = |&at: &usize| {
                let mut chosen = *settings;
                choose(&mut chosen, at);
                chosen == *settings
            };
            (0..=parameter.steps()?).find(is).map(Value::Choice)
        }
        Sets::Reed(..) | Sets::ReedDescription => None,
    }
}

/// All settings of the sound; where one is not the default, the default stands beside it.
fn settings(settings: &Settings) -> ReportTable {
    let row = |parameter: &'static Parameter| {
        let value = parameter.text(value(parameter, settings)?);
        let default = parameter.default_text();
        let default = if value == default { String::new() } else { default };
        Some(vec![
            word(parameter.group),
            word(parameter.name),
            word(parameter.id),
            number(value),
            number(default),
        ])
    };
    ReportTable {
        title: "Settings".to_owned(),
        about: "The last column has the default of each setting that was played with another value."
            .to_owned(),
        head: ["group", "setting", "id", "value", "default"].map(str::to_owned).to_vec(),
        rows: PARAMETERS.iter().filter_map(row).collect(),
    }
}

fn instrument(prepared: &RenderJob) -> ReportTable {
    let file = &prepared.model.file;
    let sounds = |note: chalumeau_core::units::WrittenNote| {
        note.sounding(file.transposition).map_or(String::new(), |note| format!(" (sounds {note})"))
    };
    let (low, high) = (file.lowest(), file.highest());
    let rows = [
        ("Name", file.name.clone()),
        ("Source", file.source.clone()),
        ("Range", format!("written {low}{} to {high}{}", sounds(low), sounds(high))),
        (
            "Bore",
            format!(
                "{:.1} mm long, nominally {:.2} mm wide",
                1e3 * file.length_m(),
                2e3 * file.nominal_radius_m
            ),
        ),
        ("Tone holes", file.holes.len().to_string()),
        ("Computed at", format!("{} Hz, put out at {} Hz", prepared.model.coeffs.rate_hz, prepared.rate)),
    ];
    ReportTable {
        title: "Instrument".to_owned(),
        about: String::new(),
        head: ["property", "value"].map(str::to_owned).to_vec(),
        rows: rows.into_iter().map(|(name, value)| vec![word(name), word(value)]).collect(),
    }
}
