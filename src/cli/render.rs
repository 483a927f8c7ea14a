//! `chalumeau render`: plays a MIDI file, a note or a scale into a WAV file; writes internal signals and a figure too.

use crate::cli::Failure;
use crate::cli::csv_table::CsvTable;
use crate::cli::doubt::Doubt;
use crate::cli::files::{self, MaybeFile};
use crate::cli::idle_settings::Idle;
use crate::cli::plot_args::PlotArgs;
use crate::cli::progress_bar::progress;
use crate::cli::render_job::RenderJob;
use crate::cli::render_monitor::RenderMonitor;
use crate::cli::score_args::ScoreArgs;
use crate::cli::shared_args::{whole, within};
use crate::output::NewFile;
use crate::wav::{BEGINNING_S, Depth, Levels, WavFile};
use chalumeau_core::instrument::side_by_side::{self, Stand};
use chalumeau_core::instrument::{BreathResponse, Probe};
use chalumeau_core::reed::physical::P_REF_PA;
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use std::cell::RefCell;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  chalumeau render melody.mid --out melody.wav
      Notes are sounding pitch; breath from CC2, else CC11, else channel pressure, else velocity; volume from CC7.
      Program changes choose no preset: --preset does.
  chalumeau render --written C4 --dynamic pp:ff --seconds 4 --out swell.wav
      As a player plays, from pianissimo to fortissimo.
  chalumeau render --written C4 --gamma 0.5 --seconds 1.5 --no-noise --out c4.wav
      Blown by a machine, at a constant pressure.
  chalumeau render --scale E3:C6 --slurred --seconds 0.4 --out scale.wav
  chalumeau render --written G4 --breath ramp:0:1.6:4 --seconds 5 --probe g4.csv --out g4.wav
      From silence over the threshold to a reed held shut, with pressures, flow and opening.
  chalumeau render melody.mid --out melody.wav --plot melody.png
      Waveform, spectrogram, pitch against the score, breath, and the reed in close-up.
  chalumeau render chorale.mid --players 4 --out chorale.wav
      Keys that are held together are played by different players; with --unison all play every note.
  chalumeau render quintet.mid --tracks --room 0.3 --out quintet.wav
      A player and a seat for each track.
  chalumeau render melody.mid --replay take.csv --out again.wav
  chalumeau render melody.mid --crescendo 0.4:0.9 --bits 16 --rate 44100 --out loud.wav";

/// Endings of names for sound in other formats, and for what sound is made of.
const NO_WAV: [&str; 13] =
    ["aac", "aif", "aiff", "caf", "flac", "m4a", "mid", "midi", "mp3", "oga", "ogg", "opus", "wma"];

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
/// Renders offline what the plugin would play, sample for sample. The same command gives the same file: the breath noise has a fixed seed.
/// The WAV file appears only when it is complete.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderCommand {
    #[command(flatten)]
    play: ScoreArgs,

    /// WAV file to write
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    out: PathBuf,
    /// Bits per sample: integers rounded without dither, or floats as computed
    #[arg(long, value_enum, default_value_t = Bits::Float32, help_heading = "Output")]
    bits: Bits,
    /// Channels: 1 or 2 [default: 2 in a room (--room), for several players, and from two places (--set heard=place), else 1]. Two channels also follow pan (CC10)
    #[arg(long, value_name = "N", help_heading = "Output", value_parser = |s: &str| whole::<u16>(s, 1, 2))]
    channels: Option<u16>,
    /// CSV file of internal signals over time: mouth pressure, reed opening, flow, mouthpiece and radiated pressure
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    probe: Option<PathBuf>,
    /// Write every Nth internal sample to the probe file; 96 or 88.2 thousand a second, twice that with --quality high
    #[arg(long, value_name = "N", default_value = "1", requires = "probe", help_heading = "Output", value_parser = |s: &str| whole::<u32>(s, 1, 1_000_000))]
    probe_every: u32,
    /// Replace existing files
    #[arg(long, help_heading = "Output")]
    force: bool,
    #[command(flatten)]
    plot: PlotArgs,
    /// Time of the reed's close-up in the figure, s [default: the middle of the longest note]
    #[arg(long, value_name = "S", requires = "plot", help_heading = "Output", value_parser = |s: &str| within(s, 0.0, 1e6))]
    plot_at: Option<f64>,
}

/// What a rendering has made.
pub struct Rendered {
    /// Length, s.
    pub seconds: f64,
    /// Sample rate, Hz.
    pub rate: u32,
    /// Channels, 1 or 2.
    pub channels: u16,
    /// Levels of the file.
    pub level: Levels,
    /// How often the calculation broke down.
    pub resets: u64,
    /// Which given settings have no effect.
    pub idle: Option<String>,
    /// Whether a note is held beyond [`BEGINNING_S`].
    pub is_long: bool,
}

impl Rendered {
    /// Why it may not be what was asked for.
    pub fn doubts(&self) -> impl Iterator<Item = Doubt> {
        Doubt::all(self.level, self.resets, self.is_long)
    }
}

impl RenderCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let rendered = self.render(progress)?;
        self.report(&rendered);
        if let Some(idle) = &rendered.idle {
            say!("warning: {idle}");
        }
        if let Some(late) = self.play.too_little_breath() {
            say!("warning: {late}");
        }
        Ok(())
    }

    /// Writes the files. `bar` makes a progress bar for so many samples.
    pub fn render(&self, bar: impl FnOnce(usize) -> ProgressBar) -> Result<Rendered, Failure> {
        side_by_side::alone(async |stand| self.render_beside(stand, bar).await)
    }

    /// As [`render`](Self::render), beside other renderings: the same bits.
    pub async fn render_beside(
        &self,
        stand: &Stand,
        bar: impl FnOnce(usize) -> ProgressBar,
    ) -> Result<Rendered, Failure> {
        self.refuse_names()?;
        self.written().into_iter().flatten().try_for_each(|path| match path == Path::new("-") {
            true => Ok(()),
            false => NewFile::check(path, self.force).map(drop),
        })?;
        let prepared = self.play.prepare()?;
        let RenderJob { score, rate, .. } = &prepared;
        prepared.warn();
        let several = prepared.has_several_players();
        let channels = self.channels.unwrap_or_else(|| prepared.usual_channels());
        if several && (self.probe.is_some() || self.plot.wanted()) {
            let inside =
                "--probe and --plot look inside one instrument; leave them out, or --players and --tracks";
            return Err(Failure::Usage(inside.to_owned()));
        }
        if channels == 1 && prepared.settings.room.amount > 0.0 {
            say!("warning: with --channels 1 no room is heard");
        }
        let mut out = NewFile::create(&self.out, self.force)?;
        let mut probe =
            self.probe.as_deref().map(|path| ProbeTable::open(path, self, &prepared)).transpose()?;
        let plot = self.plot.open(self.force)?;
        let watch = plot.wanted().then(|| RenderMonitor::new(&prepared, self.plot_at)).transpose()?;
        let depth = match self.bits {
            Bits::Int16 => Depth::Int16,
            Bits::Int24 => Depth::Int24,
            Bits::Float32 => Depth::Float32,
        };
        let mut wav = WavFile::new(&mut out, *rate, depth, channels, score.samples)?;
        let bar = bar(score.samples);
        // Who looks gets samples and insides in turn, hence the cell.
        let watch = watch.map(RefCell::new);
        let looks_inside = probe.is_some() || watch.is_some();
        let mut inside = |moment| {
            if let Some(probe) = &mut probe {
                probe.write(moment);
            }
            if let Some(watch) = &watch {
                watch.borrow_mut().inside(moment);
            }
        };
        let inside: Option<&mut dyn FnMut(Probe)> = if looks_inside { Some(&mut inside) } else { None };
        let write = |sent: &[f32], heard: &[&[f32]]| {
            bar.inc(sent.len() as u64);
            if let Some(watch) = &watch {
                watch.borrow_mut().hear(sent);
            }
            wav.write(heard).map_err(Failure::from)
        };
        let resets = match inside {
            None => prepared.play_beside(stand, channels, write).await?,
            inside => prepared.play(channels, inside, write)?,
        };
        let level = wav.finish()?;
        bar.finish_and_clear();
        if let Some(probe) = probe {
            probe.finish()?;
        }
        if let Some(watch) = watch {
            let (watched, about) = (watch.into_inner().finish(), about(&prepared));
            plot.draw(|| watched.figure(&self.play.title(), about))?;
        }
        out.keep()?;
        let (seconds, rate) = (score.seconds(*rate), *rate);
        let is_long = is_held_beyond(&prepared, BEGINNING_S);
        Ok(Rendered { seconds, rate, channels, level, resets, idle: prepared.idle, is_long })
    }

    /// Whether all that can be known without preparing the instrument is in order. Gives back the settings that have no effect.
    pub fn check(&self) -> Result<Vec<Idle>, Failure> {
        self.refuse_names()?;
        self.play.check()
    }

    /// The files that it is made of.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.play.read_files().into_iter().flatten()
    }

    /// The text of its preset.
    pub fn preset_text(&self) -> Option<String> {
        self.play.preset_text()
    }

    /// Refuses names of files that cannot be meant.
    fn refuse_names(&self) -> Result<(), Failure> {
        let is = |path: &Path| path == Path::new("-");
        if is(&self.out) {
            let right = "give the name of a file, for example --out note.wav";
            return Err(Failure::Usage(format!("a WAV file cannot go to standard output; {right}")));
        }
        self.play.refuse_idle_feel()?;
        files::keep_apart("is what is played", &self.play.read_files(), &self.written())?;
        let ending = self.out.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase();
        if NO_WAV.contains(&ending.as_str()) {
            return Err(Failure::Usage(format!(
                "{} would hold a WAV file, whatever its name says; give --out {}",
                self.out.display(),
                self.out.with_extension("wav").display()
            )));
        }
        Ok(())
    }

    /// The files that are written.
    fn written(&self) -> [MaybeFile<'_>; 3] {
        [Some(&self.out), self.probe.as_deref(), self.plot.path()]
    }

    fn report(&self, rendered: &Rendered) {
        let Rendered { seconds, rate, channels, level, .. } = *rendered;
        let bits = match self.bits {
            Bits::Int16 => "16 bit",
            Bits::Int24 => "24 bit",
            Bits::Float32 => "32 bit float",
        };
        let channels = if channels == 1 { "mono" } else { "two channels" };
        let peak = match level.peak {
            0.0 => "silent".to_owned(),
            peak => format!("peak {:.1} dBFS", 20.0 * peak.log10()),
        };
        let out = self.out.display();
        say!("{out}: {seconds:.3} s, {} Hz, {bits}, {channels}, {peak}", rate);
        rendered.doubts().for_each(|doubt| say!("warning: {}", doubt.text()));
    }
}

/// Whether a note is held for a tenth of a second or more after `seconds`.
pub fn is_held_beyond(job: &RenderJob, seconds: f64) -> bool {
    let least = ((seconds + 0.1) * f64::from(job.rate)) as usize;
    let notes = job.settings.reach.key_notes(&job.model);
    job.score.note_spans(&notes).iter().any(|span| span.to >= least)
}

/// How it was played, for the lines under a figure's title.
pub fn about(prepared: &RenderJob) -> Vec<String> {
    let RenderJob { model, settings, score, rate, .. } = prepared;
    let by_the_lip = match settings.breath_response {
        BreathResponse::Played => "; the lip changes both with the dynamic",
        BreathResponse::Physical => "",
    };
    vec![format!(
        "{}; {:.2} s at {rate} Hz, A4 = {} Hz, zeta {}, the reed shuts at {:.2} kPa{by_the_lip}",
        model.file.name,
        score.seconds(*rate),
        settings.a4_hz,
        settings.zeta,
        1e-3 * settings.closing_pa()
    )]
}

/// The table of internal signals.
struct ProbeTable {
    table: CsvTable,
    every: u64,
    rate_hz: f64,
    seen: u64,
    failed: Option<Failure>,
    /// Closing pressure that gamma is over, Pa.
    closing_pa: f64,
}

impl ProbeTable {
    fn open(path: &Path, render: &RenderCommand, prepared: &RenderJob) -> Result<Self, Failure> {
        let header = "t_s,gamma,opening_unit,flow_m3s,p_mouthpiece_pa,p_radiated_pa";
        let mut table = CsvTable::open(path, render.force, header)?;
        let rate_hz = prepared.model.coeffs.rate_hz;
        table.comment(format_args!(
            "s, mouth over closing pressure, opening over rest opening, m3/s, Pa, Pa at 1 m; {rate_hz} Hz / {}",
            render.probe_every
        ))?;
        // With these a reader puts the columns on the axes of the reed law.
        table.comment(format_args!(
            "closing pressure {:.2} Pa, reference pressure {P_REF_PA} Pa, zeta {}, Zc {:.6e} Pa s/m3",
            prepared.settings.closing_pa(),
            prepared.settings.zeta,
            prepared.model.air.z_c(prepared.model.file.nominal_radius_m)
        ))?;
        if prepared.settings.breath_response == BreathResponse::Played {
            table.comment(format_args!(
                "these are the reed's own; the player's lip changes closing pressure and zeta with the dynamic. gamma is over the pressure above"
            ))?;
        }
        Ok(Self {
            table,
            every: u64::from(render.probe_every),
            rate_hz,
            seen: 0,
            failed: None,
            closing_pa: prepared.settings.closing_pa(),
        })
    }

    fn write(&mut self, inside: Probe) {
        if self.seen.is_multiple_of(self.every) && self.failed.is_none() {
            let t_s = self.seen as f64 / self.rate_hz;
            let Probe { gamma, opening, flow_m3s, p_mouthpiece_pa, p_radiated_pa, .. } =
                inside.over(self.closing_pa);
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
