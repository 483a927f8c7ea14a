//! Making any instrument file playable: from what the program carries, from the cache, or by fitting and tuning it.
//!
//! [`ready`] looks, [`rough`] cuts without fitting so that something sounds at once, [`make`] fits the cells to the
//! bore's own transfer matrices and then plays every note until its trims are right. Where the trims would be more than
//! the tuning delay can give, or A4 lies far from 440 Hz, the whole bore is made a little longer or shorter first, and
//! fitted again: a maker's remedy, which keeps all notes' relations. Hz, seconds; results do not depend on the number of
//! cores.

use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

use serde::{Deserialize, Serialize};

use crate::bore::bundled::Bundled;
use crate::bore::cells::Cells;
use crate::bore::fit;
use crate::bore::instrument_file::{BoreSegment, Fingering, HoleKind, InstrumentFile, ToneHole};
use crate::instrument::model::{A4_HZ, BuildError, Model, checked_rate_hz};
use crate::instrument::scale;
use crate::instrument::store::{Key, Store};
use crate::instrument::tuner;
use crate::instrument::tuning::{NoteTuning, TuningTable};
use crate::units::Air;

/// Range of the pitch of A4, Hz: from baroque pitch to the high pitch of the 19th century.
pub const A4_RANGE_HZ: (f64, f64) = (415.0, 466.0);
/// Inside this range of A4 the player's delay does the rest and the instrument is the one for 440 Hz, Hz.
pub const A4_BY_DELAY_HZ: (f64, f64) = (430.0, 450.0);
/// Counts up when fitting or tuning give other numbers for the same instrument. A change that moves the built-in
/// clarinet's own data is seen without it.
const VERSION: u32 = 1;

/// How finely the bore is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// 96 or 88.2 kHz.
    #[default]
    Live,
    /// Twice that, with a fit and trims of its own, in double precision: for rendering.
    High,
}

impl Quality {
    /// The lattice's rate over that of [`Live`](Self::Live).
    pub fn factor(self) -> f64 {
        match self {
            Self::Live => 1.0,
            Self::High => 2.0,
        }
    }
}

/// An instrument as it is to be played.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Which.
    pub file: InstrumentFile,
    /// Pitch of A4, Hz, 415..=466.
    pub a4_hz: f64,
    /// The host's sample rate, Hz, 22050..=384000.
    pub host_rate_hz: f64,
    /// How finely.
    pub quality: Quality,
}

/// What [`make`] is at: fitting, fitted, tuning; from the beginning once more where tuning finds that the bore has to be
/// scaled.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// Fitting; share done, 0..=1.
    Fitting(f64),
    /// Fitted: can be played, but is not in tune.
    Fitted(&'a Arc<Model>),
    /// Tuning; share done, 0..=1.
    Tuning(f64),
}

impl Wanted {
    /// At A4 = 440 Hz, as fine as live playing can be.
    pub fn new(file: InstrumentFile, host_rate_hz: f64) -> Self {
        Self { file, a4_hz: A4_HZ, host_rate_hz, quality: Quality::Live }
    }

    /// Pitch of A4 that the instrument is tuned for: near 440 Hz the player's delay does the rest.
    pub fn tuned_a4_hz(&self) -> f64 {
        let (low, high) = A4_BY_DELAY_HZ;
        if (low..=high).contains(&self.a4_hz) { A4_HZ } else { self.a4_hz }
    }

    /// The lattice's rate, Hz.
    pub fn internal_rate_hz(&self) -> Result<f64, BuildError> {
        Ok(checked_rate_hz(self.host_rate_hz)? * self.quality.factor())
    }

    /// Everything the prepared instrument depends on, and the version of what prepares it.
    pub fn key(&self) -> Result<Key, BuildError> {
        self.key_of("tuned", VERSION, OWN_NUMBERS)
    }

    fn key_of(&self, what: &str, version: u32, own_numbers: &str) -> Result<Key, BuildError> {
        let mut all = Vec::with_capacity(65_536);
        all.extend(what.as_bytes());
        all.extend(version.to_le_bytes());
        all.extend(own_numbers.as_bytes());
        numbers(&mut all, &[self.internal_rate_hz()?, self.tuned_a4_hz()]);
        describe(&mut all, &self.file);
        Ok(Key::of(&all))
    }

    fn checked(&self) -> Result<(f64, f64), BuildError> {
        let rate_hz = self.internal_rate_hz()?;
        if !(A4_RANGE_HZ.0..=A4_RANGE_HZ.1).contains(&self.a4_hz) {
            return Err(BuildError::A4(self.a4_hz));
        }
        Ok((rate_hz, self.tuned_a4_hz()))
    }
}

fn numbers(all: &mut Vec<u8>, numbers: &[f64]) {
    all.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

/// All of a file that can be heard, for a hash. Names and remarks are left out; a new field must be decided about here.
fn describe(all: &mut Vec<u8>, file: &InstrumentFile) {
    let InstrumentFile {
        name: _,
        source: _,
        transposition,
        reed_volume_m3,
        nominal_radius_m,
        bore,
        holes,
        fingerings,
    } = file;
    all.extend(transposition.to_le_bytes());
    numbers(all, &[*reed_volume_m3, *nominal_radius_m]);
    numbers(all, &[bore.len() as f64, holes.len() as f64, fingerings.len() as f64]);
    for BoreSegment { part: _, x_start_m, x_end_m, r_start_m, r_end_m } in bore {
        numbers(all, &[*x_start_m, *x_end_m, *r_start_m, *r_end_m]);
    }
    for ToneHole { name: _, kind, x_m, radius_m, chimney_m, register, description: _ } in holes {
        let kind = match kind {
            HoleKind::Finger => 0.0,
            HoleKind::KeyClosed => 1.0,
            HoleKind::PadOpen => 2.0,
        };
        numbers(all, &[*x_m, *radius_m, *chimney_m, kind, f64::from(u8::from(*register))]);
    }
    for Fingering { written, register, mode, open, fingers: _ } in fingerings {
        numbers(all, &[f64::from(written.0), *mode as f64, register.len() as f64]);
        all.extend(register.as_bytes());
        all.extend(open.iter().map(|&open| u8::from(open)));
    }
}

/// A prepared instrument as files keep it; the measurements are elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prepared {
    /// Pitch of A4 it is tuned for, Hz.
    pub a4_hz: f64,
    /// See [`Model::scale`].
    pub scale: f64,
    /// The fitted cells.
    pub cells: Cells,
    /// Trims, in the order of the fingerings.
    pub note: Vec<NoteTuning>,
}

impl Prepared {
    /// What of a model cannot be had at once from its file.
    pub fn of(model: &Model) -> Self {
        let (cells, note) = (model.cells.clone(), model.tuning.notes.clone());
        Self { a4_hz: model.a4_hz, scale: model.scale, cells, note }
    }

    /// The instrument again, if it is one of this file.
    pub fn model(self, file: &InstrumentFile) -> Option<Model> {
        let fits = self.note.len() == file.fingerings.len()
            && file.fingerings.iter().zip(&self.note).all(|(is, note)| is.written.0 == note.written)
            && self.cells.hole_junctions.len() == file.holes.len();
        let tuning = TuningTable { notes: self.note };
        fits.then(|| Model::assemble(file.scaled(self.scale), self.cells, tuning, self.a4_hz, self.scale))
    }
}

/// The generated file of one bundled instrument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Shipment {
    #[serde(default)]
    prepared: Vec<Prepared>,
}

/// Reads the generated file of a bundled instrument.
pub fn parse_shipped(text: &str) -> Result<Vec<Prepared>, BuildError> {
    toml::from_str::<Shipment>(text)
        .map(|shipment| shipment.prepared)
        .map_err(|error| BuildError::Data(error.to_string()))
}

/// Writes the generated file of a bundled instrument.
pub fn format_shipped(prepared: Vec<Prepared>) -> Result<String, BuildError> {
    toml::to_string(&Shipment { prepared })
        .map(|text| {
            format!("# Generated by `cargo xtask fit-bore` and `cargo xtask tune`; do not edit.\n{text}")
        })
        .map_err(|error| BuildError::Data(error.to_string()))
}

/// What fitting and tuning make of the built-in clarinet: when it changes, whatever they made before is void.
const OWN_NUMBERS: &str = include_str!("../../data/b_flat_clarinet.prepared.toml");

/// What comes with the program: the generated file of each instrument.
fn shipped(instrument: Bundled) -> &'static str {
    match instrument {
        Bundled::BFlat => OWN_NUMBERS,
        Bundled::A => include_str!("../../data/a_clarinet.prepared.toml"),
        Bundled::EFlat => include_str!("../../data/e_flat_clarinet.prepared.toml"),
        Bundled::C => include_str!("../../data/c_clarinet.prepared.toml"),
        Bundled::Bass => include_str!("../../data/bass_clarinet.prepared.toml"),
    }
}

fn content(file: &InstrumentFile) -> Key {
    let mut all = Vec::with_capacity(8_192);
    describe(&mut all, file);
    Key::of(&all)
}

static BUNDLED: LazyLock<[(Key, Bundled); 5]> =
    LazyLock::new(|| Bundled::ALL.map(|instrument| (content(&instrument.file()), instrument)));

/// The instrument if it need not be made: from the data that comes with the program, or from the cache. Takes some
/// milliseconds. Allocates.
pub fn ready(wanted: &Wanted, cache: Option<&dyn Store>) -> Result<Option<Model>, BuildError> {
    let (rate_hz, a4_hz) = wanted.checked()?;
    let own = content(&wanted.file);
    if let Some((_, bundled)) = BUNDLED.iter().find(|(key, _)| *key == own) {
        let mut prepared = parse_shipped(shipped(*bundled))?.into_iter();
        let found = prepared.find(|prepared| prepared.cells.rate_hz == rate_hz && prepared.a4_hz == a4_hz);
        if let Some(model) = found.and_then(|prepared| prepared.model(&wanted.file)) {
            return Ok(Some(model));
        }
    }
    let Some(cache) = cache else { return Ok(None) };
    Ok(kept(cache, &wanted.key()?, &wanted.file))
}

/// The instrument at once: cut, not fitted, untuned. Allocates.
pub fn rough(wanted: &Wanted) -> Result<Model, BuildError> {
    let (rate_hz, a4_hz) = wanted.checked()?;
    let scale = A4_HZ / a4_hz;
    let file = wanted.file.scaled(scale);
    let cells = Cells::cut(&file, &Air::default(), rate_hz)?;
    Ok(untuned(file, cells, a4_hz, scale))
}

/// The bore exactly as the file has it, fitted, for A4 = 440 Hz: to look at, and to play untuned. Takes seconds the first
/// time. Allocates.
pub fn bore(
    file: &InstrumentFile,
    host_rate_hz: f64,
    quality: Quality,
    cache: Option<&dyn Store>,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Model, BuildError> {
    let wanted = Wanted { quality, ..Wanted::new(file.clone(), host_rate_hz) };
    if let Some(model) = ready(&wanted, cache)?.filter(|model| model.scale == 1.0) {
        let tuning = TuningTable::untuned(file);
        return Ok(Model { tuning, ..model });
    }
    let (rate_hz, a4_hz) = wanted.checked()?;
    let key = wanted.key_of("as built", VERSION, OWN_NUMBERS)?;
    if let Some(model) = cache.and_then(|cache| kept(cache, &key, file)) {
        return Ok(model);
    }
    let model = fitted_at(file, 1.0, rate_hz, a4_hz, on)?;
    keep(cache, &key, &model);
    Ok(model)
}

/// The instrument fitted but not tuned, its bore scaled for its pitch as far as theory can tell. Takes seconds; no cache.
pub fn fitted(
    wanted: &Wanted,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Model, BuildError> {
    let (rate_hz, a4_hz) = wanted.checked()?;
    on_or_cancelled(on, Progress::Fitting(0.0))?;
    let scale = scale::by_theory(&wanted.file, &Air::default(), a4_hz);
    fitted_at(&wanted.file, scale, rate_hz, a4_hz, on)
}

fn kept(cache: &dyn Store, key: &Key, file: &InstrumentFile) -> Option<Model> {
    toml::from_str::<Prepared>(&cache.get(key)?).ok()?.model(file)
}

fn keep(cache: Option<&dyn Store>, key: &Key, model: &Model) {
    if let (Some(cache), Ok(text)) = (cache, toml::to_string(&Prepared::of(model))) {
        cache.put(key, &text);
    }
}

fn fitted_at(
    file: &InstrumentFile,
    scale: f64,
    rate_hz: f64,
    a4_hz: f64,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Model, BuildError> {
    let scaled = file.scaled(scale);
    let cells = fit::fit(&scaled, &Air::default(), rate_hz, &mut |share| on(Progress::Fitting(share)))?
        .ok_or(BuildError::Cancelled)?;
    Ok(untuned(scaled, cells, a4_hz, scale))
}

fn on_or_cancelled(
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
    progress: Progress<'_>,
) -> Result<(), BuildError> {
    match on(progress) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(BuildError::Cancelled),
    }
}

/// The instrument as good as it can be: what is [`ready`], or fitted and tuned now, and kept in the cache. Takes up to
/// a minute on two cores; `on` may end it. Allocates.
pub fn make(
    wanted: &Wanted,
    cache: Option<&dyn Store>,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Model, BuildError> {
    if let Some(model) = ready(wanted, cache)? {
        return Ok(model);
    }
    let model = anew(wanted, on)?;
    keep(cache, &wanted.key()?, &model);
    Ok(model)
}

/// As [`make`], whatever is ready.
pub fn anew(
    wanted: &Wanted,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Model, BuildError> {
    let mut model = Arc::new(fitted(wanted, on)?);
    let mut offsets = heard_offsets(&model, on)?;
    if let Some(factor) = scale::by_playing(&model, &offsets) {
        let scale = model.scale * factor;
        model = Arc::new(fitted_at(&wanted.file, scale, model.coeffs.rate_hz, model.a4_hz, on)?);
        offsets = heard_offsets(&model, on)?;
    }
    let tuning =
        tuner::tune(&model, &offsets, &mut |share| on(Progress::Tuning(HEARD + (1.0 - HEARD) * share)));
    Ok(Model { tuning: tuning.ok_or(BuildError::Cancelled)?, ..Model::clone(&model) })
}

/// Share of the work of tuning that is done when every note has been heard once.
const HEARD: f64 = 0.05;

/// How far off the notes are without trims; says that the instrument can be played.
fn heard_offsets(
    model: &Arc<Model>,
    on: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Vec<Option<f64>>, BuildError> {
    on_or_cancelled(on, Progress::Fitted(model))?;
    tuner::offsets(model, &mut |share| on(Progress::Tuning(HEARD * share))).ok_or(BuildError::Cancelled)
}

fn untuned(file: InstrumentFile, cells: Cells, a4_hz: f64, scale: f64) -> Model {
    let tuning = TuningTable::untuned(&file);
    Model::assemble(file, cells, tuning, a4_hz, scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instrument::store::MemoryStore;

    fn go(_: Progress<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// A pipe of three notes: quickly fitted.
    fn pipe() -> InstrumentFile {
        InstrumentFile::parse(include_str!("../../tests/data/pipe.toml")).unwrap()
    }

    #[test]
    fn the_built_in_clarinet_is_ready() {
        for rate_hz in [44_100.0, 48_000.0] {
            let wanted = Wanted::new(InstrumentFile::built_in(), rate_hz);
            let model = ready(&wanted, None).unwrap().unwrap();
            assert_eq!((model.coeffs.rate_hz, model.a4_hz, model.scale), (2.0 * rate_hz, 440.0, 1.0));
            assert!(model.tuning.notes[..41].iter().all(|note| note.natural != 0.0));
            // Names are nothing to the ear.
            let renamed = InstrumentFile { name: "mine".to_owned(), ..InstrumentFile::built_in() };
            assert!(ready(&Wanted::new(renamed, rate_hz), None).unwrap().is_some());
        }
    }

    #[test]
    fn everything_that_matters_is_in_the_key() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        let same = |other: Wanted| other.key().unwrap() == wanted.key().unwrap();
        assert!(same(Wanted { host_rate_hz: 96_000.0, a4_hz: 442.0, ..wanted.clone() }));
        assert!(!same(Wanted { host_rate_hz: 44_100.0, ..wanted.clone() }));
        assert!(!same(Wanted { a4_hz: 415.0, ..wanted.clone() }));
        assert!(!same(Wanted { quality: Quality::High, ..wanted.clone() }));
        // Other algorithms: counted, or seen in what they make of the built-in clarinet.
        let keys = [
            ("tuned", VERSION, OWN_NUMBERS),
            ("as built", VERSION, OWN_NUMBERS),
            ("tuned", VERSION + 1, OWN_NUMBERS),
        ]
        .map(|(what, version, numbers)| wanted.key_of(what, version, numbers).unwrap());
        assert_eq!(keys[0], wanted.key().unwrap());
        let other = wanted.key_of("tuned", VERSION, &OWN_NUMBERS.replacen('4', "5", 1)).unwrap();
        assert!(keys[1..].iter().chain([&other]).all(|key| *key != keys[0]));
        let changed = |change: fn(&mut InstrumentFile)| {
            let mut file = pipe();
            change(&mut file);
            !same(Wanted { file, ..wanted.clone() })
        };
        assert!(!changed(|file| file.source.push('.')));
        assert!(changed(|file| file.transposition += 1));
        assert!(changed(|file| file.reed_volume_m3 *= 1.001));
        assert!(changed(|file| file.nominal_radius_m *= 1.001));
        assert!(changed(|file| file.bore[0].r_end_m *= 1.001));
        assert!(changed(|file| file.holes[1].register = true));
        assert!(changed(|file| file.holes[1].chimney_m *= 1.001));
        assert!(changed(|file| file.fingerings[1].open[0] = true));
        assert!(changed(|file| file.fingerings[1].mode = 2));
    }

    #[test]
    fn a_made_instrument_comes_back_from_the_cache() {
        let cache = MemoryStore::default();
        let wanted = Wanted::new(pipe(), 48_000.0);
        assert!(ready(&wanted, Some(&cache)).unwrap().is_none());
        let mut seen = Vec::new();
        let made = make(&wanted, Some(&cache), &mut |progress| {
            seen.push(match progress {
                Progress::Fitting(share) => (1, share),
                Progress::Fitted(model) => {
                    assert!(model.tuning.notes.iter().all(|note| note.natural == 0.0));
                    (2, 1.0)
                }
                Progress::Tuning(share) => (3, share),
            });
            ControlFlow::Continue(())
        })
        .unwrap();
        assert!(seen.is_sorted() && *seen.last().unwrap() == (3, 1.0), "{seen:?}");
        let kept = ready(&wanted, Some(&cache)).unwrap().unwrap();
        assert_eq!(Prepared::of(&kept), Prepared::of(&made));
        // Damaged: made again.
        cache.put(&wanted.key().unwrap(), "nonsense");
        assert!(ready(&wanted, Some(&cache)).unwrap().is_none());
        let again = make(&wanted, Some(&cache), &mut go).unwrap();
        assert_eq!(Prepared::of(&again), Prepared::of(&made), "whatever order the cores worked in");
        assert!(ready(&wanted, Some(&cache)).unwrap().is_some());
    }

    #[test]
    fn it_can_be_cancelled_anywhere() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        for end in 0..5 {
            let mut calls = 0;
            let cancelled = make(&wanted, None, &mut |_| {
                calls += 1;
                if calls > end { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            assert!(matches!(cancelled, Err(BuildError::Cancelled)));
            assert_eq!(calls, end + 1);
        }
    }

    #[test]
    fn rough_is_playable_at_once() {
        let model = rough(&Wanted::new(pipe(), 48_000.0)).unwrap();
        assert_eq!((model.coeffs.holes(), model.tuning.notes.len()), (2, 3));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        let a4 = Wanted { a4_hz: 414.9, ..wanted.clone() };
        assert_eq!(rough(&a4).unwrap_err().to_string(), "A4 must lie in 415..466 Hz, got 414.9");
        let slow = Wanted { host_rate_hz: 8_000.0, ..wanted };
        assert!(matches!(ready(&slow, None), Err(BuildError::Rate(_))));
    }
}
