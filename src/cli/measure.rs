//! `chalumeau measure`: the notes of a recording.

use crate::cli::Failure;
use crate::cli::csv_table::{TableArgs, named, number};
use crate::cli::plot_args::PlotArgs;
use crate::cli::progress_bar::waiting;
use crate::cli::shared_args::{counted, within};
use crate::wav;
use chalumeau_core::analysis::pitch::HIGHEST_HZ;
use chalumeau_core::analysis::recording::{self, Note};
use chalumeau_core::analysis::spectrum::HARMONICS;
use chalumeau_core::units::{SoundingNote, cents};
use clap::Args;
use std::path::PathBuf;

/// The longest part that is measured, s: ten minutes need 1 GB at 48 kHz, and half a minute.
const LONGEST_S: f64 = 600.0;

/// A note without odd harmonics: all of them lie below this, dB re the strongest. A clarinet's are never so weak.
const NO_ODD_DB: f64 = -60.0;

/// Whether it is a note above the highest pitch, found an octave too low: twice its period is within the range, and it has no odd
/// harmonics then.
fn is_beyond(note: &Note) -> bool {
    2.0 * note.f0_hz > HIGHEST_HZ
        && note.levels_db.iter().step_by(2).all(|level| level.is_nan() || *level <= NO_ODD_DB)
}

/// A note whose lowest harmonics all lie below this is the common period of several, dB re the strongest (by judgement; a clarinet's
/// first lies within some 20 dB).
const HOLLOW_DB: f64 = -30.0;
const LOWEST_HARMONICS: usize = 2;

const EXAMPLES: &str = "\
Examples:
  chalumeau measure recording.wav --plot recording.png
  chalumeau measure recording.wav --from 12 --to 20 --a4 442 --csv notes.csv
  chalumeau render examples/melody.mid --out melody.wav && chalumeau measure melody.wav";

/// Find the notes of a recording: pitch, level, attack, harmonics
///
/// For any WAV file with one voice: a clarinet before a microphone, or what `chalumeau render` wrote. Each line of the table is a
/// note as it sounds; a B flat clarinet reads it two semitones higher. Cents are against equal temperament at --a4. The level is that of the
/// steady part, dB re full scale, where a sine of full scale has -3.0; t90_s is the time from the beginning until 90 % of the steady level, short in a slur. The centroid is
/// the power-weighted mean frequency, noise included. h1_db to h12_db are the harmonics, dB re the strongest. Of a long note the first
/// four seconds are measured.
///
/// A note lasts some 0.05 s or more, lies between 50 and 2500 Hz, and is at most 45 dB softer than the loudest moment. Glides are no notes. A
/// flutter tongue counts as tonguing. Chords, and voices with accompaniment, give wrong notes or none.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct MeasureCommand {
    /// The recording, a WAV file
    #[arg(value_name = "FILE")]
    recording: PathBuf,
    /// Measure from here on, s
    #[arg(long, value_name = "S", default_value = "0", value_parser = |s: &str| within(s, 0.0, 86_400.0))]
    from: f64,
    /// Measure up to here, s [default: the end, or 600 s after --from, which is the most]
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.0, 86_400.0))]
    to: Option<f64>,
    /// Measure one channel, from 1 on [default: the mean of all]
    #[arg(long, value_name = "N")]
    channel: Option<u16>,
    /// Pitch of A4, Hz, 380..500
    #[arg(long, value_name = "HZ", default_value = "440", value_parser = |s: &str| within(s, 380.0, 500.0))]
    a4: f64,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    plot: PlotArgs,
}

impl MeasureCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let path = &self.recording;
        self.table.check_files(&[Some(path)], &[self.plot.path()])?;
        let to_s = self.to.unwrap_or(self.from + LONGEST_S);
        if !(self.from < to_s && to_s <= self.from + LONGEST_S) {
            return Err(Failure::Usage(format!(
                "--to {to_s} must lie after --from {}, by at most {LONGEST_S} s",
                self.from
            )));
        }
        let read = wav::read(path, self.channel, self.from, to_s);
        let sound = read.map_err(|source| Failure::WavFile { path: path.clone(), source })?;
        if self.to.is_none() && sound.seconds > to_s {
            say!(
                "note: of {:.0} s only the {LONGEST_S} s from {} s on are measured; --from and --to choose others",
                sound.seconds,
                self.from
            );
        }
        let plot = self.plot.open(self.table.force())?;
        let harmonics: Vec<_> = (1..=HARMONICS).map(|n| format!("h{n}_db")).collect();
        let columns = "start_s,end_s,sounding_midi,name,f_hz,cents,level_dbfs,t90_s,centroid_hz";
        let mut table = self.table.open_beside(&plot, &format!("{columns},{}", harmonics.join(",")))?;
        let spinner = waiting("finding the notes");
        let (notes, track) = recording::notes(&sound.samples, f64::from(sound.rate));
        spinner.finish_and_clear();
        let (high, notes): (Vec<Note>, Vec<Note>) = notes.into_iter().partition(is_beyond);
        if !high.is_empty() {
            say!("note: {} above {HIGHEST_HZ} Hz left out", counted(high.len(), "note"));
        }
        let channel = match self.channel {
            Some(channel) => format!("channel {channel} of {}", sound.channels),
            None if sound.channels == 1 => "mono".to_owned(),
            None => format!("mean of {} channels", sound.channels),
        };
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let remark =
            format!("{channel}, {} Hz, A4 = {} Hz; {}", sound.rate, self.a4, counted(notes.len(), "note"));
        table.comment(format_args!("{name}: {remark}, as they sound"))?;
        let mut names = Vec::new();
        for note in &notes {
            let (sounding, off_cents) = self.nearest(note);
            names.push(sounding.to_string());
            let levels =
                (0..HARMONICS).map(|n| number(note.levels_db.get(n).copied().unwrap_or(f64::NAN), 1));
            table.line(format_args!(
                "{:.3},{:.3},{},{},{:.3},{},{:.2},{:.3},{:.1},{}",
                self.from + note.start_s,
                self.from + note.end_s,
                sounding.0,
                named(sounding),
                note.f0_hz,
                number(off_cents, 2),
                note.level_dbfs,
                note.t90_s,
                note.centroid_hz,
                levels.collect::<Vec<_>>().join(",")
            ))?;
        }
        table.finish()?;
        if notes.is_empty() {
            say!("note: no note was found; `chalumeau help measure` says what is one");
        }
        let is_hollow =
            |note: &&Note| note.levels_db.iter().take(LOWEST_HARMONICS).all(|level| *level < HOLLOW_DB);
        match notes.iter().filter(is_hollow).count() {
            0 => {}
            count => say!(
                "note: {} next to nothing at the fundamental; is there more than one voice? Such notes are wrong",
                if count == 1 { "1 note has".to_owned() } else { format!("{count} notes have") }
            ),
        }
        plot.draw(|| {
            chalumeau_figure::recording::figure(&name, &remark, &notes, &names, &track, self.a4, self.from)
        })
    }

    /// The note of equal temperament that is nearest, and how far above it the sound is, cents.
    fn nearest(&self, note: &Note) -> (SoundingNote, f64) {
        let above_a4 = cents(note.f0_hz, self.a4);
        let steps = (above_a4 / 100.0).round();
        (SoundingNote((69.0 + steps).clamp(0.0, 127.0) as u8), above_a4 - 100.0 * steps)
    }
}
