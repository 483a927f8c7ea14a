//! The instrument loader: what the main thread builds at activation, and the thread that follows the parameters.
//!
//! Fitting and tuning run on a thread of their own. If the user chooses another instrument meanwhile, that one comes at
//! once, and the old work ends at its next progress report.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nice_plug::prelude::nice_log;

use super::instrument_request::InstrumentRequest;
use super::{Activation, CurrentInstrument, InstrumentSwap, Readiness, SharedInstrument, SwapCandidate};
use crate::cache::Cache;
use crate::plugin::mts_esp::MtsClient;
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::instrument::prepare::Progress;
use chalumeau_core::instrument::{BuildError, Ensemble, Model};

/// How often the thread looks at the parameters.
const POLL: Duration = Duration::from_millis(20);
/// How long A4 must stay unchanged before an instrument is built for it.
const SETTLE: Duration = Duration::from_millis(500);
/// How often an instrument follows a hole that the user drags.
const DRAG: Duration = Duration::from_millis(150);
/// Instruments that may be on their way to the audio thread at once.
const IN_FLIGHT: usize = 4;

/// The loader of one plugin instance. Dropping it ends its thread.
pub struct InstrumentLoader {
    params: Arc<ChalumeauParams>,
    shared: Arc<SharedInstrument>,
    thread: Option<JoinHandle<()>>,
    cache: Option<Cache>,
    tuning_program: Option<Arc<MtsClient>>,
    activations: u64,
    /// The audio thread's ends of the rings, until an [`InstrumentSwap`] takes them.
    ends: Option<(rtrb::Consumer<SwapCandidate>, rtrb::Producer<Box<Ensemble>>)>,
}

impl InstrumentLoader {
    /// Starts the thread. Allocates.
    pub fn start(params: Arc<ChalumeauParams>, shared: Arc<SharedInstrument>) -> Self {
        let (to_audio, incoming) = rtrb::RingBuffer::new(IN_FLIGHT);
        let (outgoing, from_audio) = rtrb::RingBuffer::new(2 * IN_FLIGHT);
        let cache = Cache::system();
        let tuning_program = MtsClient::register().map(Arc::new);
        let thread = LoaderThread {
            params: params.clone(),
            shared: shared.clone(),
            cache: cache.clone(),
            tuning_program: tuning_program.clone(),
            to_audio,
            from_audio,
            waiting: None,
            request: None,
            since: Instant::now(),
            since_handed: Instant::now(),
            refused: None,
            job: None,
            ending: Vec::new(),
        };
        let thread =
            std::thread::Builder::new().name("InstrumentLoader".to_owned()).spawn(move || thread.run());
        // Without a thread the plugin still gets an instrument at each activation.
        let ends = Some((incoming, outgoing));
        Self { params, shared, thread: thread.ok(), cache, tuning_program, activations: 0, ends }
    }

    /// Puts the instrument that the parameters ask for into `swap`: the best one available at once, or, for an offline
    /// render, the tuned one, however long that takes. If that fails the previous instrument stays. [main thread]
    pub fn activate(
        &mut self,
        swap: &mut Option<InstrumentSwap>,
        host_rate_hz: f64,
        offline: bool,
    ) -> Result<(), String> {
        self.activations += 1;
        let number = self.activations;
        // The thread drops its work when it sees the new activation.
        let before =
            std::mem::replace(&mut *self.shared.activation(), Activation { number, ..Activation::default() });
        receive_tuning(self.tuning_program.as_deref(), &self.params);
        let request = InstrumentRequest::from_params(&self.params, host_rate_hz, offline);
        let at_rate = before.current.filter(|current| current.request.host_rate_hz == host_rate_hz);
        let current = match self.best(&request, at_rate.as_ref(), offline) {
            Ok(current) => {
                report(&self.params, &status_text(current.readiness, &current));
                current
            }
            Err(reason) => {
                let current = fallback(host_rate_hz, at_rate)?;
                report(&self.params, &refusal_text(&reason, &current));
                current
            }
        };
        let same = swap.as_ref().is_some_and(|swap| {
            Arc::ptr_eq(swap.clarinet().model(), &current.model) && swap.rate_hz() == host_rate_hz
        });
        let ensemble = (!same).then(|| Box::new(Ensemble::new(current.model.clone(), host_rate_hz)));
        match (swap.as_mut(), ensemble) {
            (Some(swap), ensemble) => swap.activate(ensemble, host_rate_hz, number),
            (None, Some(ensemble)) => {
                if let Some((incoming, outgoing)) = self.ends.take() {
                    let mut new = InstrumentSwap::new(self.shared.clone(), ensemble, incoming, outgoing);
                    new.activate(None, host_rate_hz, number);
                    *swap = Some(new);
                }
            }
            (None, None) => {}
        }
        let asked_before = self.shared.asked.load(Ordering::Acquire);
        *self.shared.activation() = Activation {
            host_rate_hz: Some(host_rate_hz),
            offline,
            current: Some(current),
            number,
            asked_before,
        };
        Ok(())
    }

    fn best(
        &self,
        request: &InstrumentRequest,
        before: Option<&CurrentInstrument>,
        offline: bool,
    ) -> Result<CurrentInstrument, String> {
        if let Some(before) = before
            && before.request == *request
            && (before.readiness == Readiness::Tuned || !offline)
        {
            return Ok(before.clone());
        }
        let cache = Cache::store(self.cache.as_ref());
        let (mut model, mut readiness) = request.available_now(cache)?;
        if offline && readiness < Readiness::Tuned {
            let made = request.made(request.file()?, cache, &mut |progress| {
                report(&self.params, &progress_text(progress));
                ControlFlow::Continue(())
            });
            (model, readiness) = (made.map_err(|reason| reason.to_string())?, Readiness::Tuned);
        }
        let model = request.with_keys(Arc::new(model));
        Ok(CurrentInstrument { request: request.clone(), readiness, model })
    }
}

/// Plays in place of an instrument that failed to load: the previous one, else the built-in one.
fn fallback(host_rate_hz: f64, before: Option<CurrentInstrument>) -> Result<CurrentInstrument, String> {
    if let Some(before) = before {
        return Ok(before);
    }
    let model = Model::built_in(host_rate_hz).map_err(|reason| reason.to_string())?;
    Ok(CurrentInstrument {
        request: InstrumentRequest::built_in(host_rate_hz),
        readiness: Readiness::Tuned,
        model: Arc::new(model),
    })
}

impl Drop for InstrumentLoader {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The panic of a thread was reported when it happened.
            let _ = thread.join();
        }
    }
}

/// The state of the loader's thread.
struct LoaderThread {
    params: Arc<ChalumeauParams>,
    shared: Arc<SharedInstrument>,
    cache: Option<Cache>,
    tuning_program: Option<Arc<MtsClient>>,
    to_audio: rtrb::Producer<SwapCandidate>,
    from_audio: rtrb::Consumer<Box<Ensemble>>,
    /// An instrument that the ring had no room for, because the audio thread does not run.
    waiting: Option<SwapCandidate>,
    /// The latest request, and the time when it came.
    request: Option<InstrumentRequest>,
    since: Instant,
    /// When an instrument was handed over last.
    since_handed: Instant,
    /// A request that failed; it is not tried again until the request changes.
    refused: Option<InstrumentRequest>,
    job: Option<FittingJob>,
    /// Threads of cancelled jobs that have not ended yet.
    ending: Vec<JoinHandle<()>>,
}

/// An instrument that is being fitted and tuned.
struct FittingJob {
    request: InstrumentRequest,
    activation: u64,
    cancelled: Arc<AtomicBool>,
    news: mpsc::Receiver<FittingNews>,
    thread: JoinHandle<()>,
}

enum FittingNews {
    Progress(String),
    Fitted(Arc<Model>),
    Made(Result<Arc<Model>, BuildError>),
}

/// Why a step of the loader ended early.
enum Interrupted {
    /// The work is no longer wanted.
    Obsolete,
    /// The request failed; a message for the user.
    Failed(String),
}

/// However the thread ends, and if it never began, the audio thread must not wait for it.
impl Drop for LoaderThread {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl LoaderThread {
    fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            self.poll();
            std::thread::sleep(POLL);
        }
        self.cancel_job();
        for thread in self.ending.drain(..) {
            // The panic of a thread was reported when it happened.
            let _ = thread.join();
        }
    }

    /// Compares the request with the current instrument, and takes the next step towards it.
    fn poll(&mut self) {
        while self.from_audio.pop().is_ok() {}
        self.push();
        self.ending.retain(|thread| !thread.is_finished());
        // Before the parameters: what is asked later may ask for others.
        let asked = self.shared.asked.load(Ordering::Acquire);
        let answered = self.shared.answered.load(Ordering::Relaxed);
        let activation = self.shared.activation().clone();
        let (Some(host_rate_hz), Some(current)) = (activation.host_rate_hz, &activation.current) else {
            return self.cancel_job();
        };
        receive_tuning(self.tuning_program.as_deref(), &self.params);
        let mut request = InstrumentRequest::from_params(&self.params, host_rate_hz, activation.offline);
        if activation.offline && asked > activation.asked_before && asked == answered {
            // Once an offline render has begun, only a new choice exchanges the instrument; the player follows A4.
            let known = self.job.iter().map(|job| &job.request).chain([&current.request]);
            if let Some(known) = known.into_iter().find(|known| known.choice == request.choice) {
                request = known.clone();
            }
        }
        if self.request.as_ref() != Some(&request) {
            (self.request, self.since) = (Some(request.clone()), Instant::now());
            self.refused = None;
            self.shared.is_refused.store(false, Ordering::Relaxed);
        }
        match &mut self.job {
            Some(job)
                if job.activation == activation.number && job.request.differs_in_keys_at_most(&request) =>
            {
                // A fit does not depend on them.
                job.request.keys = request.keys.clone();
            }
            _ => self.cancel_job(),
        }
        let same_instrument = request.source == current.request.source
            && request.quality == current.request.quality
            && request.alterations == current.request.alterations;
        let is_awaited = asked != answered;
        if request.alterations != current.request.alterations
            && self.since_handed.elapsed() < DRAG
            && !is_awaited
        {
            return;
        }
        let differs_in_keys = current.request.differs_in_keys_at_most(&request) && current.request != request;
        if differs_in_keys {
            // The same instrument, with other keys.
            let (model, readiness) = (current.model.clone(), current.readiness);
            // Activated anew meanwhile, the host has these keys already.
            let _ = self.hand_over(&request, activation.number, model, readiness);
            return;
        }
        if same_instrument && request != current.request && self.since.elapsed() < SETTLE && !is_awaited {
            return;
        }
        if request == current.request && current.readiness == Readiness::Tuned {
            self.refused = None;
            self.shared.is_refused.store(false, Ordering::Relaxed);
            report(&self.params, &status_text(Readiness::Tuned, current));
            self.answer(asked);
        } else if self.refused.as_ref() == Some(&request) {
            self.answer(asked);
        } else if let Err(Interrupted::Failed(reason)) = self.advance(&request, &activation, current) {
            report(&self.params, &refusal_text(&reason, current));
            self.shared.is_refused.store(true, Ordering::Relaxed);
            self.refused = Some(request);
        }
    }

    /// Tells the audio thread that no better instrument will come for the parameters as they were when it asked.
    fn answer(&self, asked: u64) {
        if self.waiting.is_none() {
            self.shared.answered.store(asked, Ordering::Release);
        }
    }

    /// Takes the next step for a request: follow the running job, hand over what is available now, or start a job.
    fn advance(
        &mut self,
        request: &InstrumentRequest,
        activation: &Activation,
        current: &CurrentInstrument,
    ) -> Result<(), Interrupted> {
        if let Some(job) = self.job.take() {
            return self.follow(job, activation, current);
        }
        let mut readiness = (current.request == *request).then_some(current.readiness);
        // The current instrument plays in tune at another A4, because the player corrects the difference.
        let is_bridged = current.request.source == request.source
            && current.request.alterations == request.alterations
            && current.readiness >= Readiness::OtherA4;
        if is_bridged && !self.ending.is_empty() {
            return Ok(());
        }
        if readiness.is_none() {
            let (model, available) =
                request.available_now(Cache::store(self.cache.as_ref())).map_err(Interrupted::Failed)?;
            if available == Readiness::Tuned || !(is_bridged || activation.offline) {
                let model = Arc::new(model);
                let sent = CurrentInstrument {
                    request: request.clone(),
                    readiness: available,
                    model: model.clone(),
                };
                self.hand_over(request, activation.number, model, available)?;
                report(&self.params, &status_text(available, &sent));
                readiness = Some(available);
            }
        }
        // One job at a time: each uses all cores.
        if readiness != Some(Readiness::Tuned) && self.ending.is_empty() {
            self.start_job(request, activation.number)?;
        }
        Ok(())
    }

    fn start_job(&mut self, request: &InstrumentRequest, activation: u64) -> Result<(), Interrupted> {
        let (wanted, file) = (request.clone(), request.file().map_err(Interrupted::Failed)?);
        let (cache, cancelled) = (self.cache.clone(), Arc::new(AtomicBool::new(false)));
        let (send, news) = mpsc::channel();
        let stop = cancelled.clone();
        let work = move || {
            let made = wanted.made(file, Cache::store(cache.as_ref()), &mut |progress| {
                let sent = match progress {
                    Progress::Fitted(model) => send.send(FittingNews::Fitted(model.clone())),
                    shares => send.send(FittingNews::Progress(progress_text(shares))),
                };
                let go_on = sent.is_ok() && !stop.load(Ordering::Relaxed);
                if go_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            });
            // Nobody receives the result of a cancelled job.
            let _ = send.send(FittingNews::Made(made.map(Arc::new)));
        };
        let thread = std::thread::Builder::new()
            .name("InstrumentFit".to_owned())
            .spawn(work)
            .map_err(|reason| Interrupted::Failed(format!("cannot start a thread: {reason}")))?;
        self.job = Some(FittingJob { request: request.clone(), activation, cancelled, news, thread });
        Ok(())
    }

    /// Reads the news of a job, hands over what it has built, and keeps the job if it is not done.
    fn follow(
        &mut self,
        job: FittingJob,
        activation: &Activation,
        current: &CurrentInstrument,
    ) -> Result<(), Interrupted> {
        loop {
            match job.news.try_recv() {
                Ok(FittingNews::Progress(text)) => report(&self.params, &text),
                Ok(FittingNews::Fitted(model)) => {
                    // The current instrument may be better already: tuned, for another A4.
                    let is_better = current.request == job.request && current.readiness < Readiness::Fitted;
                    if is_better
                        && !activation.offline
                        && let Err(interrupted) =
                            self.hand_over(&job.request, job.activation, model, Readiness::Fitted)
                    {
                        job.cancelled.store(true, Ordering::Relaxed);
                        self.ending.push(job.thread);
                        return Err(interrupted);
                    }
                }
                Ok(FittingNews::Made(made)) => {
                    // The result was its last act, so this does not wait long.
                    let _ = job.thread.join();
                    return match made {
                        Ok(model) => self.hand_over(&job.request, job.activation, model, Readiness::Tuned),
                        Err(BuildError::Cancelled) => Err(Interrupted::Obsolete),
                        Err(reason) => Err(Interrupted::Failed(reason.to_string())),
                    };
                }
                Err(mpsc::TryRecvError::Empty) => {
                    self.job = Some(job);
                    return Ok(());
                }
                Err(mpsc::TryRecvError::Disconnected) => {
                    return Err(Interrupted::Failed("a fault of the program ended the fit".to_owned()));
                }
            }
        }
    }

    fn cancel_job(&mut self) {
        if let Some(FittingJob { cancelled, thread, .. }) = self.job.take() {
            cancelled.store(true, Ordering::Relaxed);
            self.ending.push(thread);
        }
    }

    /// Sends an instrument to the audio thread, unless the host has activated the plugin anew.
    fn hand_over(
        &mut self,
        request: &InstrumentRequest,
        number: u64,
        model: Arc<Model>,
        readiness: Readiness,
    ) -> Result<(), Interrupted> {
        let model = request.with_keys(model);
        let ensemble = Box::new(Ensemble::new(model.clone(), request.host_rate_hz));
        {
            let mut activation = self.shared.activation();
            if activation.number != number {
                return Err(Interrupted::Obsolete);
            }
            activation.current = Some(CurrentInstrument { request: request.clone(), readiness, model });
        }
        // Its keys may have other names.
        self.params.host.tell();
        // This replaces an instrument that still waits for room: that one is worse.
        self.waiting = Some(SwapCandidate { activation: number, ensemble });
        self.since_handed = Instant::now();
        self.push();
        Ok(())
    }

    fn push(&mut self) {
        if let Some(prepared) = self.waiting.take()
            && let Err(rtrb::PushError::Full(prepared)) = self.to_audio.push(prepared)
        {
            self.waiting = Some(prepared);
        }
    }
}

/// Looks at what a tuning program says.
fn receive_tuning(program: Option<&MtsClient>, params: &ChalumeauParams) {
    if let Some(program) = program {
        params.scale.receive(program.tuning(f64::from(params.settings().a4_hz)));
    }
}

fn status_text(readiness: Readiness, current: &CurrentInstrument) -> String {
    match readiness {
        Readiness::Tuned => format!("ready: {}", current.model.file.name),
        Readiness::OtherA4 | Readiness::Fitted => "waiting to be tuned".to_owned(),
        Readiness::Rough => "waiting to be fitted".to_owned(),
    }
}

fn refusal_text(reason: &str, current: &CurrentInstrument) -> String {
    format!("{reason}; still playing {}", current.model.file.name)
}

fn progress_text(progress: Progress<'_>) -> String {
    let percent = |share: f64| (100.0 * share.clamp(0.0, 1.0)).round();
    match progress {
        Progress::Fitting(share) => format!("fitting {} %", percent(share)),
        Progress::Fitted(_) => "fitted".to_owned(),
        Progress::Tuning(share) => format!("tuning {} %", percent(share)),
    }
}

/// Shows a text as *Instrument status*, and logs it if it is new.
fn report(params: &ChalumeauParams, text: &str) {
    if let Ok(mut status) = params.instrument_status.write()
        && *status != text
    {
        nice_log!("instrument: {text}");
        text.clone_into(&mut status);
        drop(status);
        params.host.text_changed();
    }
}
