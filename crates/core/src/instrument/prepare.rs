//! From an instrument file to a playable model: [`Wanted`] in, [`Model`] out.
//!
//! [`Preparation`] is the only way. It looks for the instrument among those that come with the program (`bundled`) and
//! in a [`Store`]; else it scales the bore by theory (`scale`), cuts it into cells and fits them to the bore's transfer
//! matrices (`cut_and_fit`), and plays every note until its trim is right ([`auto_tune`]), and at every dynamic of a player ([`play_dynamics`]). Where the trims would need
//! more than the tuning delay can give, it makes the whole bore a little longer or shorter first and fits it again: a
//! maker's remedy, which keeps the relations between the notes. Callers that cannot wait, or want the bore as it was
//! built, stop half-way: see the methods of [`Preparation`]. [`altered`] makes an instrument with other holes from a tuned one. All that makes an instrument needs the feature `fit`. Results do not depend on the number of cores.
//!
//! ```
//! use chalumeau_core::bore::bundled::Bundled;
//! use chalumeau_core::instrument::{Preparation, Wanted};
//!
//! let wanted = Wanted::new(Bundled::A.file(), 48_000.0);
//! // No store: this instrument comes with the program.
//! let model = Preparation::new(&wanted, None).ready()?.expect("bundled");
//! assert_eq!((model.coeffs.rate_hz, model.a4_hz), (96_000.0, 440.0));
//! # Ok::<(), chalumeau_core::instrument::BuildError>(())
//! ```

pub mod altered;
#[cfg(feature = "fit")]
pub mod auto_tune;
mod bundled;
mod cut_and_fit;
#[cfg(feature = "fit")]
pub mod play_dynamics;
mod prepared_file;
#[cfg(feature = "fit")]
mod scale;
#[cfg(feature = "fit")]
mod trial_pitch;
mod wanted;

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::bore::bundled::Bundled;
use crate::instrument::concert_pitch::A4_HZ;
use crate::instrument::model::{BuildError, Model};
#[cfg(feature = "fit")]
use crate::instrument::prepare::auto_tune::Accuracy;
use crate::instrument::store::Store;
#[cfg(feature = "fit")]
use crate::instrument::tuning_table::TuningTable;
#[cfg(feature = "fit")]
use crate::units::Air;
pub use prepared_file::{PreparedInstrument, format_generated, parse_generated};
use wanted::Stored;
pub use wanted::{Quality, Wanted};

/// What a preparation does now: it fits, has fitted, tunes. It begins again once if tuning finds that the bore has to be
/// scaled.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// Fitting; share done, 0..=1.
    Fitting(f64),
    /// Fitted: the model can be played, but is not in tune.
    Fitted(&'a Arc<Model>),
    /// Tuning; share done, 0..=1.
    Tuning(f64),
}

/// Receives the [`Progress`], and may end the preparation with [`BuildError::Cancelled`].
pub type OnProgress<'a> = &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>;

/// Share of the work of tuning that is done when every note has been heard once.
#[cfg(feature = "fit")]
const HEARD: f64 = 0.05;
/// And when every note has its trim.
#[cfg(feature = "fit")]
const TUNED: f64 = 0.6;

/// Prepares one instrument. Every method allocates, and refuses a host rate or an A4 out of range with
/// [`BuildError::Rate`] or [`BuildError::A4`], and an instrument that [`InstrumentFile::check`] refuses with [`BuildError::Instrument`].
///
/// [`InstrumentFile::check`]: crate::bore::instrument_file::InstrumentFile::check
#[derive(Clone, Copy)]
pub struct Preparation<'a> {
    wanted: &'a Wanted,
    store: Option<&'a dyn Store>,
    /// Neither bundled nor stored instruments count.
    anew: bool,
}

impl<'a> Preparation<'a> {
    /// Uses what comes with the program and what `store` holds, and keeps in `store` what it makes.
    pub fn new(wanted: &'a Wanted, store: Option<&'a dyn Store>) -> Self {
        Self { wanted, store, anew: false }
    }

    /// Makes everything again, whatever is bundled, and keeps nothing.
    pub fn from_scratch(wanted: &'a Wanted) -> Self {
        Self { wanted, store: None, anew: true }
    }

    /// The tuned instrument if it need not be made, because it is bundled or stored. Takes some milliseconds.
    pub fn ready(&self) -> Result<Option<Model>, BuildError> {
        let (rate_hz, a4_hz) = self.wanted.checked()?;
        if self.anew {
            return Ok(None);
        }
        match bundled::find(&self.wanted.file, rate_hz, a4_hz)? {
            Some(model) => Ok(Some(model)),
            None => self.stored(Stored::Tuned),
        }
    }

    /// The instrument at once: cut, neither fitted nor tuned, so that something sounds while the rest is done.
    pub fn rough(&self) -> Result<Model, BuildError> {
        let (rate_hz, a4_hz) = self.wanted.checked()?;
        cut_and_fit::cut(&self.wanted.file, A4_HZ / a4_hz, rate_hz, a4_hz)
    }

    fn stored(&self, stored: Stored) -> Result<Option<Model>, BuildError> {
        let Some(store) = self.store else { return Ok(None) };
        let text = store.get(&self.wanted.key_of(stored)?);
        let prepared = text.and_then(|text| PreparedInstrument::from_text(&text));
        Ok(prepared.and_then(|prepared| prepared.model(&self.wanted.file)))
    }
}

/// What is neither bundled nor stored is made.
#[cfg(feature = "fit")]
impl Preparation<'_> {
    /// The bore exactly as the file has it, fitted but not tuned, for A4 = 440 Hz whatever pitch is wanted: to measure,
    /// and to play untuned. Takes seconds, unless it is bundled or stored.
    pub fn as_built(&self, on: OnProgress<'_>) -> Result<Model, BuildError> {
        let wanted = Wanted { a4_hz: A4_HZ, ..self.wanted.clone() };
        let preparation = Preparation { wanted: &wanted, ..*self };
        if let Some(model) = preparation.ready()?.filter(|model| model.scale == 1.0) {
            return Ok(Model { tuning: TuningTable::untuned(&wanted.file), ..model });
        }
        if let Some(model) = preparation.stored(Stored::AsBuilt)? {
            return Ok(model);
        }
        let (rate_hz, a4_hz) = wanted.checked()?;
        let model = cut_and_fit::fit(&wanted.file, 1.0, rate_hz, a4_hz, on)?;
        preparation.keep(Stored::AsBuilt, &model)?;
        Ok(model)
    }

    /// Fitted but not tuned, the bore scaled for its pitch as far as theory can tell. Takes seconds; always made anew.
    pub fn fitted(&self, on: OnProgress<'_>) -> Result<Model, BuildError> {
        let (rate_hz, a4_hz) = self.wanted.checked()?;
        go_on(on, Progress::Fitting(0.0))?;
        let scale = scale::by_theory(&self.wanted.file, &Air::default(), a4_hz);
        cut_and_fit::fit(&self.wanted.file, scale, rate_hz, a4_hz, on)
    }

    /// The whole pipeline: the instrument in tune. Takes up to a minute on two cores, unless it is bundled or stored.
    pub fn tuned(&self, on: OnProgress<'_>) -> Result<Model, BuildError> {
        if let Some(model) = self.ready()? {
            return Ok(model);
        }
        let mut model = Arc::new(self.fitted(on)?);
        let mut offsets = heard_offsets(&model, on)?;
        if let Some(factor) = scale::by_playing(&model, &offsets) {
            let (scale, rate_hz, a4_hz) = (model.scale * factor, model.coeffs.rate_hz, model.a4_hz);
            model = Arc::new(cut_and_fit::fit(&self.wanted.file, scale, rate_hz, a4_hz, on)?);
            offsets = heard_offsets(&model, on)?;
        }
        let mut tuning_share = |share| on(Progress::Tuning(HEARD + (TUNED - HEARD) * share));
        let tuning = auto_tune::tune(&model, &offsets, Accuracy::QUICK, &mut tuning_share)
            .ok_or(BuildError::Cancelled)?;
        let model = Model { tuning, ..Model::clone(&model) };
        let mut playing_share = |share| on(Progress::Tuning(TUNED + (1.0 - TUNED) * share));
        let tuning =
            play_dynamics::learn(&model, Accuracy::QUICK, &mut playing_share).ok_or(BuildError::Cancelled)?;
        let model = Model { tuning, ..model };
        self.keep(Stored::Tuned, &model)?;
        Ok(model)
    }

    fn keep(&self, stored: Stored, model: &Model) -> Result<(), BuildError> {
        let Some(store) = self.store else { return Ok(()) };
        if let Some(text) = PreparedInstrument::of(model).to_text() {
            store.put(&self.wanted.key_of(stored)?, &text);
        }
        Ok(())
    }
}

impl Model {
    /// The built-in B flat clarinet, from the generated data that comes with the program. Takes some milliseconds.
    /// Allocates.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the host's rate lies outside [`HOST_RATES_HZ`](super::internal_rate::HOST_RATES_HZ).
    pub fn built_in(host_rate_hz: f64) -> Result<Self, BuildError> {
        let wanted = Wanted::new(Bundled::BFlat.file(), host_rate_hz);
        Preparation::new(&wanted, None)
            .ready()?
            .ok_or_else(|| BuildError::Data(format!("nothing for {host_rate_hz} Hz")))
    }
}

#[cfg(feature = "fit")]
fn go_on(on: OnProgress<'_>, progress: Progress<'_>) -> Result<(), BuildError> {
    match on(progress) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(BuildError::Cancelled),
    }
}

/// How far off the notes are without trims; first reports that the instrument can be played.
#[cfg(feature = "fit")]
fn heard_offsets(model: &Arc<Model>, on: OnProgress<'_>) -> Result<Vec<Option<f64>>, BuildError> {
    go_on(on, Progress::Fitted(model))?;
    auto_tune::offsets(model, &mut |share| on(Progress::Tuning(HEARD * share))).ok_or(BuildError::Cancelled)
}

#[cfg(all(test, feature = "fit"))]
mod tests {
    use super::*;
    use crate::bore::instrument_file::InstrumentFile;
    use crate::instrument::store::MemoryStore;

    fn no_stop(_: Progress<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn ready(wanted: &Wanted, store: Option<&dyn Store>) -> Option<Model> {
        Preparation::new(wanted, store).ready().unwrap()
    }

    /// A pipe of three notes: quickly fitted.
    fn pipe() -> InstrumentFile {
        InstrumentFile::parse(include_str!("../../tests/data/pipe.toml")).unwrap()
    }

    #[test]
    fn the_built_in_clarinet_is_ready() {
        for rate_hz in [44_100.0, 48_000.0] {
            let wanted = Wanted::new(InstrumentFile::built_in(), rate_hz);
            let model = ready(&wanted, None).unwrap();
            assert_eq!((model.coeffs.rate_hz, model.a4_hz, model.scale), (2.0 * rate_hz, 440.0, 1.0));
            assert!(model.tuning.notes[..41].iter().all(|note| note.natural != 0.0));
            // The name cannot be heard.
            let renamed = InstrumentFile { name: "mine".to_owned(), ..InstrumentFile::built_in() };
            assert!(ready(&Wanted::new(renamed, rate_hz), None).is_some());
            assert!(Preparation::from_scratch(&wanted).ready().unwrap().is_none());
        }
    }

    #[test]
    fn a_made_instrument_comes_back_from_the_store() {
        let store = MemoryStore::default();
        let wanted = Wanted::new(pipe(), 48_000.0);
        assert!(ready(&wanted, Some(&store)).is_none());
        let mut seen = Vec::new();
        let made = Preparation::new(&wanted, Some(&store))
            .tuned(&mut |progress| {
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
        let kept = ready(&wanted, Some(&store)).unwrap();
        assert_eq!(PreparedInstrument::of(&kept), PreparedInstrument::of(&made));
        // Damaged: made again.
        store.put(&wanted.key().unwrap(), "nonsense");
        assert!(ready(&wanted, Some(&store)).is_none());
        let again = Preparation::new(&wanted, Some(&store)).tuned(&mut no_stop).unwrap();
        assert_eq!(
            PreparedInstrument::of(&again),
            PreparedInstrument::of(&made),
            "whatever order the cores worked in"
        );
        assert!(ready(&wanted, Some(&store)).is_some());
    }

    #[test]
    fn the_bore_as_built_is_untuned_unscaled_and_stored_by_itself() {
        let store = MemoryStore::default();
        let wanted = Wanted { a4_hz: 466.0, ..Wanted::new(pipe(), 48_000.0) };
        let built = Preparation::new(&wanted, Some(&store)).as_built(&mut no_stop).unwrap();
        assert_eq!((built.a4_hz, built.scale), (440.0, 1.0));
        assert_eq!(built.tuning, TuningTable::untuned(&wanted.file));
        let at_440 = Wanted::new(pipe(), 48_000.0);
        assert!(ready(&at_440, Some(&store)).is_none(), "it is not tuned");
        let mut calls = 0;
        let again = Preparation::new(&at_440, Some(&store)).as_built(&mut |_| {
            calls += 1;
            ControlFlow::Continue(())
        });
        assert_eq!(PreparedInstrument::of(&again.unwrap()), PreparedInstrument::of(&built));
        assert_eq!(calls, 0, "from the store");
    }

    #[test]
    fn it_can_be_cancelled_anywhere() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        for end in 0..5 {
            let mut calls = 0;
            let cancelled = Preparation::new(&wanted, None).tuned(&mut |_| {
                calls += 1;
                if calls > end { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            assert!(matches!(cancelled, Err(BuildError::Cancelled)));
            assert_eq!(calls, end + 1);
        }
    }

    #[test]
    fn rough_is_playable_at_once() {
        let model = Preparation::new(&Wanted::new(pipe(), 48_000.0), None).rough().unwrap();
        assert_eq!((model.coeffs.holes(), model.tuning.notes.len()), (2, 3));
    }

    #[test]
    fn rates_and_pitches_out_of_range_are_refused() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        let a4 = Wanted { a4_hz: 414.9, ..wanted.clone() };
        let refused = Preparation::new(&a4, None).rough().unwrap_err();
        assert_eq!(refused.to_string(), "A4 must lie in 415..466 Hz, got 414.9");
        let slow = Wanted { host_rate_hz: 800.0, ..wanted };
        assert!(matches!(Preparation::new(&slow, None).ready(), Err(BuildError::Rate(_))));
    }
}
