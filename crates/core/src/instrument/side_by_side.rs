//! Independent work with one voice each, several of them at once: their voices are computed side by side, in the lanes of a
//! `Choir`, although each goes its own way and takes its own time.
//!
//! A piece of work is an `async` function with a [`Stand`]. Wherever it needs a tick of its voice it waits; when all have got
//! there, one tick of the choir serves them. A voice gives the bits that it gives alone, so results depend neither on who stands
//! beside nor on the number of cores. Nothing here is for the audio thread.

use std::cell::{Cell, RefCell, RefMut};
use std::future::{Future, poll_fn};
use std::ops::ControlFlow;
use std::pin::{Pin, pin};
use std::rc::Rc;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use crate::bore::lattice::LatticeCoeffs;
use crate::dsp::lanes::has_avx2;
use crate::event::{Event, Timed};
use crate::instrument::channels::Channels;
use crate::instrument::clarinet::{Clarinet, Progress};
use crate::instrument::ensemble::section::{NARROW, WIDE, least};
#[cfg(feature = "fit")]
use crate::instrument::model::Model;
#[cfg(feature = "fit")]
use crate::instrument::voice::Drive;
use crate::instrument::voice::Voice;
use crate::instrument::voice::choir::{Choir, Lanes};
use crate::parallel::{self, Queue};

/// What has a voice, and can do its own part of a tick.
trait Ticking {
    /// Before the voice's samples.
    fn begin(&mut self);
    /// Bore of the voice: voices of one bore share a choir.
    fn coeffs(&self) -> &Arc<LatticeCoeffs>;
    /// The voice, if a lane may play it: double precision has no lanes.
    fn voice(&mut self) -> Option<&mut Voice<f32>>;
    /// The voice's samples, without a choir.
    fn run_alone(&mut self);
    /// After the voice's samples.
    fn end(&mut self);
}

impl Ticking for Clarinet {
    fn begin(&mut self) {
        self.begin_tick();
    }

    fn coeffs(&self) -> &Arc<LatticeCoeffs> {
        &self.model().coeffs
    }

    fn voice(&mut self) -> Option<&mut Voice<f32>> {
        self.single_voice()
    }

    fn run_alone(&mut self) {
        Clarinet::run_alone(self);
    }

    fn end(&mut self) {
        self.end_tick();
    }
}

type Shared = Rc<RefCell<dyn Ticking>>;

/// Where a piece of work waits for the ticks of its voice.
#[derive(Default)]
pub struct Stand {
    asked: Cell<Option<Shared>>,
}

impl Stand {
    /// Waits for a tick.
    async fn tick(&self, who: Shared) {
        self.asked.set(Some(who));
        let mut waited = false;
        poll_fn(|_| if std::mem::replace(&mut waited, true) { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}

/// A clarinet that plays beside others.
///
/// ```
/// use chalumeau_core::event::{Event, Timed};
/// use chalumeau_core::instrument::{Channels, Clarinet, Model};
/// use chalumeau_core::instrument::side_by_side::{self, PlayedBeside};
/// use chalumeau_core::units::SoundingNote;
/// use std::ops::ControlFlow;
/// use std::sync::Arc;
///
/// let model = Arc::new(Model::built_in(48_000.0)?);
/// let notes = side_by_side::each(
///     12,
///     async |stand, at| {
///         let clarinet = PlayedBeside::new(Clarinet::new(model.clone(), 48_000.0));
///         let event = Event::NoteOn { note: SoundingNote(55 + at as u8), velocity: 0.8 };
///         let mut samples = vec![0.0; 4_800];
///         let out = Channels::one(&mut samples);
///         clarinet.render_events_channels(stand, [Timed { at: 0, event }], out).await;
///         samples
///     },
///     &mut |_| ControlFlow::Continue(()),
/// );
/// assert!(notes.is_some_and(|notes| notes.len() == 12));
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
pub struct PlayedBeside(Rc<RefCell<Clarinet>>);

impl PlayedBeside {
    /// Takes a clarinet, of which each sample is then made beside others.
    pub fn new(clarinet: Clarinet) -> Self {
        Self(Rc::new(RefCell::new(clarinet)))
    }

    /// See [`Clarinet::render_channels`]: the same bits.
    pub async fn render_channels(&self, stand: &Stand, mut out: Channels<'_>) {
        let mut progress = Progress::default();
        loop {
            let needs_tick = self.0.borrow_mut().advance(&mut out, &mut progress);
            if !needs_tick {
                return;
            }
            stand.tick(self.0.clone()).await;
        }
    }

    /// See [`Clarinet::render_events_channels`]: the same bits.
    pub async fn render_events_channels(
        &self,
        stand: &Stand,
        events: impl IntoIterator<Item = Timed<Event>>,
        mut out: Channels<'_>,
    ) {
        let (mut done, end) = (0, out.len());
        for Timed { at, event } in events {
            let at = at.clamp(done, end);
            self.render_channels(stand, out.part(done..at)).await;
            self.0.borrow_mut().apply(event);
            done = at;
        }
        self.render_channels(stand, out.part(done..end)).await;
    }

    /// See [`Clarinet::resets`].
    pub fn resets(&self) -> u64 {
        self.0.borrow().resets()
    }
}

/// A voice that is blown beside others, without a player.
#[cfg(feature = "fit")]
pub(super) struct BlownBeside(Rc<RefCell<Blown>>);

#[cfg(feature = "fit")]
struct Blown {
    coeffs: Arc<LatticeCoeffs>,
    voice: Voice<f32>,
    drive: Drive,
}

#[cfg(feature = "fit")]
impl Ticking for Blown {
    fn begin(&mut self) {
        self.voice.begin(&self.drive);
    }

    fn coeffs(&self) -> &Arc<LatticeCoeffs> {
        &self.coeffs
    }

    fn voice(&mut self) -> Option<&mut Voice<f32>> {
        Some(&mut self.voice)
    }

    fn run_alone(&mut self) {
        self.voice.run();
    }

    fn end(&mut self) {
        self.voice.end();
    }
}

#[cfg(feature = "fit")]
impl BlownBeside {
    /// Takes a voice of this model.
    pub fn new(model: &Model, voice: Voice<f32>, drive: Drive) -> Self {
        Self(Rc::new(RefCell::new(Blown { coeffs: model.coeffs.clone(), voice, drive })))
    }

    /// See [`Voice::tick`]: the same bits. What was heard is asked of the [voice](Self::with).
    pub async fn tick(&self, stand: &Stand, drive: Drive) {
        self.0.borrow_mut().drive = drive;
        stand.tick(self.0.clone()).await;
    }

    /// Looks at the voice, or changes it.
    pub fn with<R>(&self, look: impl FnOnce(&mut Voice<f32>) -> R) -> R {
        look(&mut self.0.borrow_mut().voice)
    }
}

/// Does `work` for each of `0..count`, on all cores and side by side on each, and returns the results in that order.
///
/// `on` gets the share that is done, 0..=1, after each item. If it breaks, what has begun is dropped and the answer is `None`.
pub fn each<T: Send>(
    count: usize,
    work: impl AsyncFn(&Stand, usize) -> T + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    let work = &work;
    parallel::workers(
        count,
        |queue| {
            if has_avx2() { go_through::<WIDE, T>(queue, work) } else { go_through::<NARROW, T>(queue, work) }
        },
        on,
    )
}

/// As [`each`], but the last come first: where the last take longest, they are not left alone in the end.
#[cfg(feature = "fit")]
pub(super) fn each_from_last<T: Send>(
    count: usize,
    work: impl AsyncFn(&Stand, usize) -> T + Sync,
    on: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Option<Vec<T>> {
    let work = &work;
    let mut results = each(count, async |stand: &Stand, at: usize| work(stand, count - 1 - at).await, on)?;
    results.reverse();
    Some(results)
}

/// Does one piece of work, with its voice alone.
pub fn alone<T>(work: impl AsyncFnOnce(&Stand) -> T) -> T {
    let stand = Stand::default();
    let mut task = pin!(work(&stand));
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(result) = task.as_mut().poll(&mut context) {
            return result;
        }
        if let Some(who) = stand.asked.take() {
            let mut who = who.borrow_mut();
            who.begin();
            who.run_alone();
            who.end();
        }
    }
}

/// An item of a queue, and the work on it.
type Task<'w, T> = (usize, Pin<Box<dyn Future<Output = T> + 'w>>);

/// Works through a queue on this core.
fn go_through<const N: usize, T: Send>(queue: &Queue<'_, T>, work: &impl AsyncFn(&Stand, usize) -> T) {
    let stands: [Stand; N] = std::array::from_fn(|_| Stand::default());
    let mut tasks: [Option<Task<'_, T>>; N] = [const { None }; N];
    let mut together = Together::<N>::default();
    let mut context = Context::from_waker(Waker::noop());
    while !queue.is_stopped() {
        for (stand, task) in stands.iter().zip(&mut tasks).take(queue.share) {
            loop {
                if task.is_none() {
                    *task = queue.take().map(|at| (at, Box::pin(work(stand, at)) as _));
                }
                let Some((at, begun)) = task else { break };
                let Poll::Ready(result) = begun.as_mut().poll(&mut context) else { break };
                queue.give(*at, result);
                *task = None;
            }
        }
        if tasks.iter().all(Option::is_none) {
            return;
        }
        together.tick(std::array::from_fn(|stand| stands[stand].asked.take()));
    }
}

/// Choirs of all bores that play, and who is in which lane: the lane of a stand has its number.
struct Together<const N: usize> {
    choirs: Vec<(Arc<LatticeCoeffs>, Choir<N>)>,
    lanes: [Option<Shared>; N],
}

impl<const N: usize> Default for Together<N> {
    fn default() -> Self {
        Self { choirs: Vec::new(), lanes: [const { None }; N] }
    }
}

impl<const N: usize> Together<N> {
    /// The choir of a bore. Bores that nobody plays any more lose theirs.
    fn choir_of(&mut self, coeffs: &Arc<LatticeCoeffs>, playing: &[Option<Arc<LatticeCoeffs>>; N]) -> usize {
        let is_of = |(of, _): &(Arc<LatticeCoeffs>, _)| Arc::ptr_eq(of, coeffs);
        if let Some(at) = self.choirs.iter().position(is_of) {
            return at;
        }
        self.choirs.retain(|(of, _)| playing.iter().flatten().any(|other| Arc::ptr_eq(of, other)));
        self.choirs.push((coeffs.clone(), Choir::new(coeffs)));
        self.choirs.len() - 1
    }

    /// A voice takes its waves back, if it has lent them.
    fn leave(&self, lane: usize, who: &Shared) {
        let who = &mut *who.borrow_mut();
        let own = self.choirs.iter().find(|(of, _)| Arc::ptr_eq(of, who.coeffs()));
        if let Some((_, choir)) = own
            && let Some(voice) = who.voice()
        {
            choir.leave(lane, voice);
        }
    }

    /// A tick of all who ask for one.
    fn tick(&mut self, asked: [Option<Shared>; N]) {
        for (lane, who) in asked.iter().enumerate() {
            let Some(who) = who else { continue };
            if let Some(before) = self.lanes[lane].replace(who.clone())
                && !Rc::ptr_eq(&before, who)
            {
                self.leave(lane, &before);
            }
        }
        asked.iter().flatten().for_each(|who| who.borrow_mut().begin());
        let playing = asked.each_ref().map(|who| who.as_ref().map(|who| Arc::clone(who.borrow().coeffs())));
        let can_play = |who: &Shared| who.borrow_mut().voice().is_some_and(Choir::<N>::can_play);
        let fits = asked.each_ref().map(|who| who.as_ref().is_some_and(can_play));
        // Before the choirs play on: who does not play with them takes its waves back.
        for (lane, who) in asked.iter().enumerate() {
            if let Some(who) = who.as_ref().filter(|_| !fits[lane]) {
                self.leave(lane, who);
            }
        }
        let mut left: [bool; N] = asked.each_ref().map(Option::is_some);
        for lane in 0..N {
            let Some(coeffs) = playing[lane].as_ref().filter(|_| left[lane]) else { continue };
            let has_bore = |own: &Arc<LatticeCoeffs>| Arc::ptr_eq(own, coeffs);
            let beside: [bool; N] = std::array::from_fn(|other| {
                left[other] && fits[other] && playing[other].as_ref().is_some_and(has_bore)
            });
            if beside[lane] && beside.iter().filter(|beside| **beside).count() >= least(N) {
                let choir = self.choir_of(coeffs, &playing);
                let mut voices: [Option<RefMut<'_, dyn Ticking>>; N] = std::array::from_fn(|other| {
                    asked[other].as_ref().filter(|_| beside[other]).map(|who| who.borrow_mut())
                });
                let lanes: Lanes<'_, N> =
                    voices.each_mut().map(|who| who.as_mut().and_then(|who| who.voice()));
                self.choirs[choir].1.run(lanes);
                left.iter_mut().zip(beside).for_each(|(left, beside)| *left &= !beside);
            } else if let Some(who) = &asked[lane] {
                self.leave(lane, who);
                who.borrow_mut().run_alone();
                left[lane] = false;
            }
        }
        asked.iter().flatten().for_each(|who| who.borrow_mut().end());
    }
}

#[cfg(test)]
mod tests;
