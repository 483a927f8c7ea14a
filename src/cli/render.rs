//! `chalumeau render`: a MIDI file, a note or a scale as a WAV file, with a look inside if wanted.

use crate::bore::instrument_file::InstrumentFile;
use crate::cli::Failure;
use crate::cli::args::{InstrumentArg, check_fingering, note, within};
use crate::cli::feel::FeelArgs;
use crate::cli::settings::SettingsArgs;
use crate::cli::table::Table;
use crate::control::knob::KnobDesign;
use crate::event::{Event, Timed};
use crate::instrument::model::internal_rate_hz;
use crate::instrument::{Clarinet, Model, Probe, Settings};
use crate::output::NewFile;
use crate::reed::physical::P_REF_PA;
use crate::render as player;
use crate::render::breath::BreathCurve;
use crate::render::breath::GAMMA_MAX;
use crate::render::midi_file;
use crate::render::score::Score;
use crate::render::wav::{Depth, Level, WavFile};
use crate::touch::blower::{Blower, Blown, Hand};
use crate::touch::feel::{Feels, NO_MOTOR};
use crate::touch::take::Take;
use crate::units::{REFERENCE_RADIUS_M, SoundingNote, WrittenNote};

use clap::{ArgGroup, Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use std::fs;
use std::path::{Path, PathBuf};

/// Samples per block; any number gives the same sound.
const BLOCK: usize = 512;

/// Gamma where nothing else is said: a full, easy tone.
const GAMMA_DEFAULT: f32 = 0.5;

const EXAMPLES: &str = "\
Examples:
  chalumeau render melody.mid --out melody.wav
      Notes are sounding pitch; breath from CC2, else CC11, else channel pressure, else velocity.
  chalumeau render --written C4 --gamma 0.5 --seconds 1.5 --no-noise --out c4.wav
  chalumeau render --scale E3:C6 --slurred --seconds 0.4 --out scale.wav
  chalumeau render --written G4 --breath ramp:0:1.2:4 --seconds 5 --probe g4.csv --out g4.wav
      From silence over the threshold to a reed held shut, with pressures, flow and opening.
  chalumeau render melody.mid --replay take.csv --out again.wav
  chalumeau render melody.mid --crescendo 0.4:0.9 --bits 16 --rate 44100 --out loud.wav";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bits {
    #[value(name = "16")]
    Int16,
    #[value(name = "24")]
    Int24,
    #[value(name = "32f")]
    Float32,
}

/// Play a MIDI file, a note or a scale into a WAV file
///
/// Renders offline what the plugin would play, sample for sample. Two renders are identical: the breath noise is seeded.
/// The WAV file appears only when it is complete.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[command(group = ArgGroup::new("what").required(true).args(["midi", "written", "sounding", "scale"]))]
#[command(group = ArgGroup::new("note").args(["written", "sounding", "scale"]))]
#[command(group = ArgGroup::new("blown").args(["gamma", "breath", "crescendo", "replay"]))]
pub struct Render {
    /// Standard MIDI file, format 0 or 1
    #[arg(value_name = "MIDI")]
    midi: Option<PathBuf>,
    /// One note as a clarinettist reads it: MIDI number (60) or name (C4)
    #[arg(long, value_name = "NOTE", value_parser = note)]
    written: Option<u8>,
    /// One note as it sounds
    #[arg(long, value_name = "NOTE", value_parser = note)]
    sounding: Option<u8>,
    /// Chromatic scale between two written notes, up or down, for example E3:C6
    #[arg(long, value_name = "FROM:TO", value_parser = interval)]
    scale: Option<(u8, u8)>,
    /// Slur the scale instead of tonguing each note
    #[arg(long, requires = "scale")]
    slurred: bool,
    /// Length of the note, or of each note of the scale, s, 0.01..3600 [default: 2, scale 0.5]
    #[arg(long, value_name = "S", conflicts_with = "midi", value_parser = |s: &str| within(s, 0.01, 3600.0))]
    seconds: Option<f64>,
    /// Time to fade after the last event, s, 0..60 [default: 1, one note 0]
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.0, 60.0))]
    tail: Option<f64>,

    /// Constant mouth pressure over closing pressure, 0..3 [default: 0.5 unless a MIDI file plays]
    #[arg(long, value_name = "G", help_heading = "Breath (replaces that of a MIDI file)", value_parser = |s: &str| within(s, 0.0, f64::from(GAMMA_MAX)))]
    gamma: Option<f64>,
    /// Mouth pressure over time: a CSV file t_s,gamma, or ramp:FROM:TO:SECONDS, then held
    #[arg(long, value_name = "FILE|RAMP", help_heading = "Breath (replaces that of a MIDI file)")]
    breath: Option<String>,
    /// Mouth pressure from one gamma to another over the whole length, for example 0.4:0.9
    #[arg(long, value_name = "FROM:TO", help_heading = "Breath (replaces that of a MIDI file)")]
    crescendo: Option<String>,
    /// Breath from a knob's take: a CSV file with t_us and angle_deg, as the plugin or `chalumeau knob` records it; each
    /// note makes its own pressure of the angle
    #[arg(long, value_name = "FILE", help_heading = "Breath (replaces that of a MIDI file)")]
    replay: Option<PathBuf>,

    /// WAV file to write
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    out: PathBuf,
    /// Sample rate, Hz, 22050..384000
    #[arg(long, value_name = "HZ", default_value = "48000", help_heading = "Output", value_parser = clap::value_parser!(u32).range(22_050..=384_000))]
    rate: u32,
    /// Bits per sample: integers rounded without dither, or floats as computed
    #[arg(long, value_enum, default_value_t = Bits::Float32, help_heading = "Output")]
    bits: Bits,
    /// 1, or 2 with the same sound in both
    #[arg(long, value_name = "N", default_value = "1", help_heading = "Output", value_parser = clap::value_parser!(u16).range(1..=2))]
    channels: u16,
    /// CSV file with the inside of the instrument over time: mouth pressure, reed opening, flow, mouthpiece and radiated pressure
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    probe: Option<PathBuf>,
    /// Write every Nth internal sample (96 or 88.2 thousand a second) to the probe file
    #[arg(long, value_name = "N", default_value = "1", requires = "probe", help_heading = "Output", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    probe_every: u32,
    /// Replace existing files
    #[arg(long, help_heading = "Output")]
    force: bool,

    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    feel: FeelArgs,
}

/// Two notes with a colon between them.
fn interval(text: &str) -> Result<(u8, u8), String> {
    let (from, to) = text.split_once(':').ok_or("must be two notes, for example E3:C6 or 52:84")?;
    Ok((note(from)?, note(to)?))
}

impl Render {
    pub fn run(&self) -> Result<(), Failure> {
        let file = self.instrument.load()?;
        let curve = self.curve()?;
        let settings = self.settings.blown_by(curve.as_ref())?;
        let mut score = self.score(&file)?;
        if let Some(curve) = &curve {
            score = score.blown(curve, &settings, self.rate);
        }
        let model = self.instrument.model(file, self.rate)?;
        if let Some(take) = &self.replay {
            score.events = self.replayed(take, &model, &settings, &score)?;
        }
        // A single note lasts as long as was asked; a melody gets time to fade.
        let one_note = self.written.is_some() || self.sounding.is_some();
        score = score.with_tail(self.tail.unwrap_or(if one_note { 0.0 } else { 1.0 }), self.rate);
        self.refuse_same_file()?;
        let mut out = NewFile::create(&self.out, self.force)?;
        let mut probe =
            self.probe.as_deref().map(|path| ProbeTable::open(path, self, &settings, &model)).transpose()?;

        let mut clarinet = Clarinet::new(model, f64::from(self.rate));
        clarinet.set_settings(&settings);
        // As a host does before it plays: the settings are in place from the first sample.
        clarinet.reset();
        let depth = match self.bits {
            Bits::Int16 => Depth::Int16,
            Bits::Int24 => Depth::Int24,
            Bits::Float32 => Depth::Float32,
        };
        let mut wav = WavFile::new(&mut out, self.rate, depth, self.channels, score.samples)?;
        let bar = progress(score.samples);
        let mut write = |block: &[f32]| {
            bar.inc(block.len() as u64);
            wav.write(block).map_err(Failure::from)
        };
        match &mut probe {
            Some(probe) => {
                player::play_probed(
                    &mut clarinet,
                    &score,
                    BLOCK,
                    &mut |inside| probe.write(inside),
                    &mut write,
                )?;
            }
            None => player::play(&mut clarinet, &score, BLOCK, &mut write)?,
        }
        let level = wav.finish()?;
        bar.finish_and_clear();
        if let Some(probe) = probe {
            probe.finish()?;
        }
        out.keep()?;
        self.report(&score, level, clarinet.resets());
        Ok(())
    }

    /// The events of a score, blown by a take.
    fn replayed(
        &self,
        path: &Path,
        model: &Model,
        settings: &Settings,
        score: &Score,
    ) -> Result<Vec<Timed<Event>>, Failure> {
        let from = fs::File::open(path).map_err(|source| Failure::Read { path: path.to_owned(), source })?;
        let take = Take::read(from).map_err(|source| Failure::TakeFile { path: path.to_owned(), source })?;
        let feels = Feels::new(model);
        let design = self.feel.design(&model.file)?;
        let table = feels.table(settings, &design, &NO_MOTOR)?;
        let knob = KnobDesign { full_deg: design.travel_deg, ..KnobDesign::default() };
        let hand = Hand { maps: feels.maps(&table), design: knob, feels: true };
        let rate_hz = f64::from(self.rate);
        let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
        let events = Blown::new(
            score.events.iter().copied(),
            &mut Blower::default(),
            &hand,
            full_pa,
            score.samples,
            |at| Some(take.angle_deg(at as f64 / rate_hz)),
            &mut |_, _| {},
        )
        .collect();
        Ok(events)
    }

    fn curve(&self) -> Result<Option<BreathCurve>, Failure> {
        if self.replay.is_some() {
            return Ok(None);
        }
        if let Some(text) = &self.crescendo {
            return Ok(Some(BreathCurve::parse_crescendo(text)?));
        }
        if let Some(gamma) = self.gamma {
            return Ok(Some(BreathCurve::constant(gamma as f32)));
        }
        let Some(text) = &self.breath else {
            return Ok(self.midi.is_none().then(|| BreathCurve::constant(GAMMA_DEFAULT)));
        };
        if text.starts_with("ramp:") {
            return Ok(Some(BreathCurve::parse_ramp(text)?));
        }
        let path = PathBuf::from(text);
        let from = fs::File::open(&path).map_err(|source| Failure::Read { path: path.clone(), source })?;
        match BreathCurve::read_csv(from) {
            Ok(curve) => Ok(Some(curve)),
            Err(source) => Err(Failure::BreathFile { path, source }),
        }
    }

    fn score(&self, file: &InstrumentFile) -> Result<Score, Failure> {
        let transposition = file.transposition;
        if let Some(path) = &self.midi {
            let bytes = fs::read(path).map_err(|source| Failure::Read { path: path.clone(), source })?;
            let score = midi_file::read(&bytes, self.rate)
                .map_err(|source| Failure::MidiFile { path: path.clone(), source })?;
            warn_of_missing_fingerings(&score.events, file);
            return Ok(score);
        }
        if let Some((from, to)) = self.scale {
            let (from, to) = (WrittenNote(from), WrittenNote(to));
            for written in from.0.min(to.0)..=from.0.max(to.0) {
                check_fingering(file, WrittenNote(written))?;
            }
            let seconds = self.seconds.unwrap_or(0.5);
            return Ok(Score::scale(from, to, transposition, seconds, self.slurred, self.rate)?);
        }
        let seconds = self.seconds.unwrap_or(2.0);
        let sounding = match (self.written.map(WrittenNote), self.sounding.map(SoundingNote)) {
            (Some(written), _) => {
                check_fingering(file, written)?;
                written.sounding(transposition)
            }
            (None, sounding) => sounding,
        };
        let written = sounding.and_then(|note| note.written(transposition));
        match (sounding, written) {
            (Some(sounding), Some(written)) => {
                check_fingering(file, written)?;
                Ok(Score::note(sounding, seconds, self.rate))
            }
            _ => Err(Failure::Usage(
                "this note lies outside what MIDI can name after transposition".to_owned(),
            )),
        }
    }

    fn refuse_same_file(&self) -> Result<(), Failure> {
        let is = |path: &Path| path == Path::new("-");
        if is(&self.out) {
            let right = "give the name of a file, for example --out note.wav";
            return Err(Failure::Usage(format!("a WAV file cannot go to standard output; {right}")));
        }
        if self.probe.as_ref().is_some_and(|probe| *probe == self.out) {
            return Err(Failure::Usage(format!(
                "--out and --probe are both {}; give them different names",
                self.out.display()
            )));
        }
        Ok(())
    }

    fn report(&self, score: &Score, level: Level, resets: u64) {
        let bits = match self.bits {
            Bits::Int16 => "16 bit",
            Bits::Int24 => "24 bit",
            Bits::Float32 => "32 bit float",
        };
        let channels = if self.channels == 1 { "mono" } else { "two channels" };
        let peak = match level.peak {
            0.0 => "silent".to_owned(),
            peak => format!("peak {:.1} dBFS", 20.0 * peak.log10()),
        };
        let (out, seconds) = (self.out.display(), score.seconds(self.rate));
        eprintln!("{out}: {seconds:.3} s, {} Hz, {bits}, {channels}, {peak}", self.rate);
        if level.clipped > 0 {
            eprintln!("warning: {} samples clipped; lower --gain-db or use --bits 32f", level.clipped);
        }
        if resets > 0 {
            eprintln!(
                "warning: the instrument lost its numbers and was reset {resets} times; please report this"
            );
        }
    }
}

/// Notes no fingering can play stay silent, but not unsaid.
fn warn_of_missing_fingerings(events: &[Timed<Event>], file: &InstrumentFile) {
    let missing = |event: &Timed<Event>| match event.event {
        Event::NoteOn { note, .. } => {
            note.written(file.transposition).and_then(|written| file.fingering(written)).is_none()
        }
        _ => false,
    };
    let count = events.iter().filter(|event| missing(event)).count();
    if count > 0 {
        let (low, high) = (file.lowest(), file.highest());
        let sounds =
            |note: WrittenNote| note.sounding(file.transposition).map(|n| n.to_string()).unwrap_or_default();
        eprintln!(
            "warning: {count} notes have no fingering and stay silent; this instrument sounds {} to {} (written {low} to {high})",
            sounds(low),
            sounds(high)
        );
    }
}

/// Seen on a terminal only.
pub fn progress(samples: usize) -> ProgressBar {
    let bar = ProgressBar::new(samples as u64);
    match ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} (left: {eta})") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// The inside of the instrument as a table.
struct ProbeTable {
    table: Table,
    every: u64,
    rate_hz: f64,
    seen: u64,
    failed: Option<Failure>,
}

impl ProbeTable {
    fn open(path: &Path, render: &Render, settings: &Settings, model: &Model) -> Result<Self, Failure> {
        let header = "t_s,gamma,opening_unit,flow_m3s,p_mouthpiece_pa,p_radiated_pa";
        let mut table = Table::open(path, render.force, header)?;
        let rate_hz = internal_rate_hz(f64::from(render.rate));
        table.comment(format_args!(
            "s, mouth over closing pressure, opening over rest opening, m3/s, Pa, Pa at 1 m; {rate_hz} Hz / {}",
            render.probe_every
        ))?;
        // With these a reader puts the columns on the axes of the reed law.
        table.comment(format_args!(
            "closing pressure {} Pa, reference pressure {P_REF_PA} Pa, zeta {}, Zc {:.6e} Pa s/m3",
            settings.closing_pa(),
            settings.zeta,
            model.air.z_c(REFERENCE_RADIUS_M)
        ))?;
        Ok(Self { table, every: u64::from(render.probe_every), rate_hz, seen: 0, failed: None })
    }

    fn write(&mut self, inside: Probe) {
        if self.seen.is_multiple_of(self.every) && self.failed.is_none() {
            let t_s = self.seen as f64 / self.rate_hz;
            let Probe { gamma, opening, flow_m3s, p_mouthpiece_pa, p_radiated_pa } = inside;
            let line = self.table.line(format_args!(
                "{t_s:.8},{gamma:.7},{opening:.7},{flow_m3s:.7e},{p_mouthpiece_pa:.5},{p_radiated_pa:.7e}"
            ));
            self.failed = line.err();
        }
        self.seen += 1;
    }

    fn finish(self) -> Result<(), Failure> {
        match self.failed {
            Some(failure) => Err(failure),
            None => self.table.finish(),
        }
    }
}
