//! Arguments that several commands share, and the functions that read them.

use crate::cache::{Cache, VARIABLE};
use crate::cli::Failure;
use crate::cli::files::MaybeFile;
use crate::cli::progress_bar;
use crate::instrument_path::{self, LoadError};
use crate::presets::Preset;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::instrument::player::dynamics::NAMED;
use chalumeau_core::instrument::prepare::{Preparation, Progress};
use chalumeau_core::instrument::store::{Key, Store};
use chalumeau_core::instrument::tuning_table::NoteTuning;
use chalumeau_core::instrument::{BuildError, Model, Quality, Wanted};
use chalumeau_core::score::ScoreError;
use chalumeau_core::units::{Air, SoundingNote, WrittenNote, midi_of_name};
use clap::{Args, ValueEnum};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Once};

/// Which instrument.
#[derive(Args)]
pub struct InstrumentArg {
    /// Instrument: b-flat, a, e-flat, c, bass, or a file (TOML: bore, tone holes, fingerings) [default: b-flat]
    #[arg(long, value_name = "NAME|FILE")]
    instrument: Option<PathBuf>,
    /// Measurements that a caller has in memory, in place of the file.
    #[arg(skip)]
    pub given: Option<InstrumentFile>,
    /// Asked now and then while it is prepared: whether the caller gives it up.
    #[arg(skip)]
    pub stop: Option<Stop>,
}

/// Whether a caller gives up what takes long.
pub type Stop = fn() -> bool;

impl InstrumentArg {
    /// As if it were given by its flag.
    pub fn named(path: PathBuf) -> Self {
        Self { instrument: Some(path), given: None, stop: None }
    }

    /// As it was given: a name or a file.
    pub fn path(&self) -> Option<&PathBuf> {
        self.instrument.as_ref()
    }

    /// The file that is read; a bundled instrument has none.
    pub fn file(&self) -> MaybeFile<'_> {
        let is_bundled = |path: &Path| path.to_str().and_then(Bundled::named).is_some();
        self.instrument.as_deref().filter(|path| self.given.is_none() && !is_bundled(path))
    }

    /// Its measurements.
    pub fn load(&self) -> Result<InstrumentFile, Failure> {
        self.load_or(Bundled::BFlat)
    }

    /// Its measurements; those of `usual` if none was chosen.
    fn load_or(&self, usual: Bundled) -> Result<InstrumentFile, Failure> {
        if let Some(file) = &self.given {
            return Ok(file.clone());
        }
        let Some(path) = &self.instrument else { return Ok(usual.file()) };
        if let Some(bundled) = path.to_str().and_then(Bundled::named) {
            return Ok(bundled.file());
        }
        instrument_path::load(path).map_err(|source| match source {
            // What is no path may have been meant for a name.
            LoadError::Read { path, error } if path.components().count() == 1 => {
                let ids = Bundled::ALL.map(Bundled::id).join(", ");
                Failure::Usage(format!(
                    "cannot read {}: {error}; --instrument is a file or one of {ids}",
                    path.display()
                ))
            }
            LoadError::Read { path, error } => Failure::Read { path, source: error },
            LoadError::Instrument(source) => Failure::InstrumentFile { path: path.clone(), source },
        })
    }

    /// The bore as it is measured, fitted to the lattice for a host rate. Takes seconds the first time.
    pub fn bore(
        &self,
        file: &InstrumentFile,
        host_rate_hz: u32,
        quality: QualityArg,
    ) -> Result<Arc<Model>, Failure> {
        let wanted = Wanted { quality: quality.into(), ..Wanted::new(file.clone(), f64::from(host_rate_hz)) };
        self.made(|cache, on| Preparation::new(&wanted, cache).as_built(on))
    }

    /// The instrument ready to play: from the program's own data or the cache, else fitted and tuned now.
    pub fn tuned(&self, wanted: &Wanted) -> Result<Arc<Model>, Failure> {
        if let Some(model) = kept(wanted) {
            return Ok(model);
        }
        let mut fresh = false;
        let model = self.made(|cache, on| {
            Preparation::new(wanted, cache).tuned(&mut |progress| {
                fresh = true;
                on(progress)
            })
        })?;
        say_how_it_is_scaled(&model, wanted);
        if fresh {
            say_what_tuning_found(&model);
        }
        keep(wanted, &model);
        Ok(model)
    }

    /// With a cache and a bar.
    fn made(
        &self,
        make: impl FnOnce(
            Option<&dyn Store>,
            &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
        ) -> Result<Model, BuildError>,
    ) -> Result<Arc<Model>, Failure> {
        let mut bar = None;
        let cache = Cache::system().map(WarningCache);
        let made = make(cache.as_ref().map(|cache| cache as &dyn Store), &mut |progress| {
            let bar = bar
                .get_or_insert_with(|| progress_bar::bar(1_000, "{msg} {bar:40} {percent:>3} %  {elapsed}"));
            let (doing, share) = match progress {
                Progress::Fitting(share) => ("fitting the bore", share),
                Progress::Fitted(_) => ("fitting the bore", 1.0),
                Progress::Tuning(share) => ("tuning its notes", share),
            };
            bar.set_message(doing);
            bar.set_position((1_000.0 * share) as u64);
            if self.stop.is_some_and(|stop| stop()) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        if let Some(bar) = bar {
            bar.finish_and_clear();
        }
        match (made, &self.instrument) {
            (Ok(model), _) => Ok(Arc::new(model)),
            (Err(source), Some(path)) => Err(Failure::Instrument { path: path.clone(), source }),
            (Err(source), None) => Err(source.into()),
        }
    }
}

/// The cache; where it cannot be written, a warning says so once.
struct WarningCache(Cache);

impl Store for WarningCache {
    fn get(&self, key: &Key) -> Option<String> {
        self.0.get(key)
    }

    fn put(&self, key: &Key, body: &str) {
        static WARNED: Once = Once::new();
        if self.0.keep(key, body).is_err() {
            let folder = self.0.folder().display();
            WARNED.call_once(|| {
                say!(
                    "warning: {folder} cannot be written, so the prepared instrument is not kept, and the next command prepares it again; \
                     {VARIABLE} names another folder"
                );
            });
        }
    }
}

/// Instruments that this program has prepared, the last used at the end: a data set plays one thousands of times, and a short
/// note takes less time than its preparation, 15 ms.
static PREPARED: Mutex<Vec<(Wanted, Arc<Model>)>> = Mutex::new(Vec::new());
/// Most of them: the five bundled instruments at one rate, and some of the user's own.
const PREPARED_MOST: usize = 8;

fn kept(wanted: &Wanted) -> Option<Arc<Model>> {
    let mut all = PREPARED.lock().ok()?;
    let at = all.iter().position(|(of, _)| of == wanted)?;
    let found = all.remove(at);
    let model = found.1.clone();
    all.push(found);
    Some(model)
}

fn keep(wanted: &Wanted, model: &Arc<Model>) {
    if let Ok(mut all) = PREPARED.lock() {
        if all.len() == PREPARED_MOST {
            all.remove(0);
        }
        all.push((wanted.clone(), model.clone()));
    }
}

/// Resolution of the lattice.
#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum QualityArg {
    /// As the plugin plays: 96 or 88.2 kHz internally
    #[default]
    Live,
    /// Twice that, with its own fit and tuning
    High,
}

impl From<QualityArg> for Quality {
    fn from(quality: QualityArg) -> Self {
        match quality {
            QualityArg::Live => Self::Live,
            QualityArg::High => Self::High,
        }
    }
}

/// The instrument that is played, and how well it is prepared.
#[derive(Args)]
pub struct PlayedArgs {
    #[command(flatten)]
    pub instrument: InstrumentArg,
    /// Resolution of the lattice
    #[arg(long, value_enum, default_value_t = QualityArg::Live)]
    quality: QualityArg,
    /// Play the bore as it is built: otherwise a small delay for each note corrects its pitch. Finding the delays of an
    /// instrument file, or with --a4 outside 430..450 Hz, takes up to a minute the first time
    #[arg(long)]
    untuned: bool,
}

impl PlayedArgs {
    /// Its measurements.
    pub fn load(&self) -> Result<InstrumentFile, Failure> {
        self.instrument.load()
    }

    /// Its measurements; those of the instrument of a preset if none was chosen.
    pub fn load_for(&self, preset: Option<&Preset>) -> Result<InstrumentFile, Failure> {
        let Some(preset) = preset else { return self.load() };
        if self.instrument.instrument.is_some() || self.instrument.given.is_some() {
            return self.load();
        }
        let usual = preset.bundled().ok_or_else(|| {
            Failure::Usage(format!(
                "the preset {:?} plays the user's own instrument; add --instrument with its file",
                preset.name
            ))
        })?;
        self.instrument.load_or(usual)
    }

    /// Whether anything but the usual is given.
    pub fn is_given(&self) -> bool {
        self.instrument.instrument.is_some() || self.untuned || self.quality != QualityArg::default()
    }

    /// Whether it plays as it is built, without the tuning of its notes.
    pub fn is_as_built(&self) -> bool {
        self.untuned
    }

    /// The instrument as it is built.
    pub fn as_built(&self, file: &InstrumentFile, host_rate_hz: u32) -> Result<Arc<Model>, Failure> {
        self.instrument.bore(file, host_rate_hz, self.quality)
    }

    /// The instrument ready to play, tuned unless that was not wanted.
    pub fn model(&self, file: InstrumentFile, host_rate_hz: u32, a4_hz: f32) -> Result<Arc<Model>, Failure> {
        if self.untuned {
            return self.as_built(&file, host_rate_hz);
        }
        let (a4_hz, quality) = (f64::from(a4_hz), self.quality.into());
        self.instrument.tuned(&Wanted { a4_hz, quality, ..Wanted::new(file, f64::from(host_rate_hz)) })
    }
}

/// A maker who has measured well is not so far away, percent of the size: half a semitone.
const MUCH_PERCENT: f64 = 3.0;

/// Says whether the instrument is played in another size than measured: every measurement of it depends on that.
fn say_how_it_is_scaled(model: &Model, wanted: &Wanted) {
    let own_scale = A4_HZ / wanted.tuned_a4_hz();
    let longer = 100.0 * (model.scale / own_scale - 1.0);
    if longer != 0.0 {
        let (by, how) = (longer.abs(), if longer > 0.0 { "larger" } else { "smaller" });
        let (weight, advice) = match by > MUCH_PERCENT {
            true => (
                "warning",
                ". That is much: `chalumeau instrument check` tells whether transposition, octaves or lengths are wrong",
            ),
            false => ("note", ""),
        };
        say!(
            "{weight}: the whole instrument is played {by:.2} % {how} than measured, to be in tune (--untuned plays it as measured){advice}"
        );
    }
}

/// Tells the maker of an instrument once what the tuning found.
fn say_what_tuning_found(model: &Model) {
    let names = |which: fn(&NoteTuning) -> bool| -> Vec<String> {
        let notes = model.tuning.notes.iter().filter(|note| which(note));
        notes.map(|note| WrittenNote(note.written).to_string()).collect()
    };
    for (one, several, notes) in [
        (
            "does not speak: of five pressures, it sounds in its register at one at most. Its key is silent",
            "do not speak: of five pressures, they sound in their register at one at most. Their keys are silent",
            names(|n| n.silent),
        ),
        (
            "cannot be tuned by the delay alone",
            "cannot be tuned by the delay alone",
            names(|n| !n.silent && n.off_cents != 0.0),
        ),
    ] {
        match notes.as_slice() {
            [] => {}
            [note] => say!("note: {note} {one}"),
            notes => say!("note: {} {several}", notes.join(" ")),
        }
    }
}

/// Which air.
#[derive(Args)]
pub struct AirArg {
    /// Air temperature, Celsius, 10..40
    #[arg(long, value_name = "C", default_value = "25", value_parser = |s: &str| within(s, 10.0, 40.0))]
    temperature: f64,
}

impl AirArg {
    pub fn air(&self) -> Air {
        Air::at(self.temperature)
    }

    /// Whether it is the air the lattice is made for.
    pub fn is_reference(&self) -> bool {
        self.air() == Air::default()
    }
}

/// Which notes: the whole fingering chart or one of it.
#[derive(Args)]
#[group(id = "notes", multiple = false)]
pub struct NotesArg {
    /// Every note of the fingering chart: the default, except where one note is needed, as for a curve
    #[arg(long)]
    all: bool,
    /// One written note: a MIDI number (65) or a name (F4)
    #[arg(long, aliases = ["note", "fingering"], value_name = "NOTE", value_parser = note)]
    written: Option<u8>,
}

impl NotesArg {
    /// The notes asked for, low to high.
    pub fn notes(&self, file: &InstrumentFile) -> Result<Vec<WrittenNote>, Failure> {
        match self.written.map(WrittenNote) {
            Some(written) => check_fingering(file, written).map(|()| vec![written]),
            None => Ok(file.fingerings.iter().map(|f| f.written).collect()),
        }
    }

    /// The one note asked for.
    pub fn one(&self) -> Option<WrittenNote> {
        self.written.map(WrittenNote)
    }
}

/// Refuses a note the instrument cannot finger.
pub fn check_fingering(file: &InstrumentFile, written: WrittenNote) -> Result<(), Failure> {
    if file.fingering(written).is_some() {
        return Ok(());
    }
    let (low, high) = (file.lowest(), file.highest());
    Err(Failure::Usage(format!(
        "written {} ({written}) has no fingering; this instrument has {} ({low}) to {} ({high})",
        written.0, low.0, high.0
    )))
}

/// What a fingered note sounds, or why it cannot be played.
pub fn sounding(file: &InstrumentFile, written: WrittenNote) -> Result<SoundingNote, Failure> {
    check_fingering(file, written)?;
    Ok(written.sounding(file.transposition).ok_or(ScoreError::OutsideMidi(written))?)
}

/// A number of things, each with this name: 1 file, 2 files.
pub fn counted(count: usize, name: &str) -> String {
    format!("{count} {name}{}", if count == 1 { "" } else { "s" })
}

/// A number inside a range, or what would be right.
pub fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (low..=high).contains(&x) => Ok(x),
        Ok(_) => Err(format!("must lie in {low}..{high}")),
        Err(_) => Err(format!("must be a number in {low}..{high}")),
    }
}

/// A player's dynamic, 0..=1: a name or a number.
pub fn dynamic(text: &str) -> Result<f64, String> {
    match NAMED.iter().find(|(name, _)| *name == text) {
        Some((_, dynamic)) => Ok(*dynamic),
        None => within(text, 0.0, 1.0)
            .map_err(|wrong| format!("{wrong}, or one of {}", NAMED.map(|(name, _)| name).join(", "))),
    }
}

/// One dynamic, or two with a colon between them.
pub fn dynamics(text: &str) -> Result<(f64, f64), String> {
    match text.split_once(':') {
        Some((from, to)) => Ok((dynamic(from)?, dynamic(to)?)),
        None => dynamic(text).map(|held| (held, held)),
    }
}

/// A whole number inside a range, or what would be right.
pub fn whole<T: TryFrom<i64>>(text: &str, low: i64, high: i64) -> Result<T, String> {
    let number = text.parse::<i64>().ok().filter(|number| (low..=high).contains(number));
    let number = number.and_then(|number| T::try_from(number).ok());
    number.ok_or_else(|| format!("must be a whole number in {low}..{high}"))
}

/// A sample rate, Hz, or what would be right.
pub fn rate(text: &str) -> Result<u32, String> {
    whole(text, 1_000, 1_536_000).map_err(|_| "must be a whole number of Hz in 1000..1536000".to_owned())
}

/// As [`within`], for what is stored in single precision.
pub fn within_f32(text: &str, low: f64, high: f64) -> Result<f32, String> {
    within(text, low, high).map(|x| x as f32)
}

/// A MIDI number or a note name.
pub fn note(text: &str) -> Result<u8, String> {
    let number = text.parse::<u8>().ok().filter(|&midi| midi < 128);
    number
        .or_else(|| midi_of_name(text))
        .ok_or_else(|| "must be a MIDI number in 0..127 or a name like E3, F#4 or Bb5".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dynamics_have_names_and_numbers() {
        let read = ["pp", "p", "mf", "ff", "0.25"].map(|text| dynamic(text).unwrap());
        assert_eq!(read, [0.0, 0.2, 0.6, 1.0, 0.25]);
        assert_eq!(dynamics("pp:ff").unwrap(), (0.0, 1.0));
        assert_eq!(dynamics("0.5").unwrap(), (0.5, 0.5));
        assert_eq!(dynamic("fff").unwrap_err(), "must be a number in 0..1, or one of pp, p, mp, mf, f, ff");
        assert!(dynamics("pp:2").unwrap_err().starts_with("must lie in 0..1"));
    }

    #[test]
    fn notes_have_numbers_and_names() {
        for (text, midi) in
            [("60", 60), ("C4", 60), ("f#5", 78), ("Bb3", 58), ("b3", 59), ("C-1", 0), ("G9", 127)]
        {
            assert_eq!(note(text), Ok(midi), "{text}");
        }
        for text in ["", "H4", "C", "128", "-1", "C10", "G#9", "Cb-1", "C#", "Cé4", "é", "C+"] {
            assert!(note(text).is_err(), "{text}");
        }
    }

    #[test]
    fn ranges_refuse_what_is_no_number() {
        assert_eq!(within("0.5", 0.0, 3.0), Ok(0.5));
        assert_eq!(within("nan", 0.0, 3.0), Err("must lie in 0..3".to_owned()));
        assert_eq!(within("loud", 0.0, 3.0), Err("must be a number in 0..3".to_owned()));
    }
}
