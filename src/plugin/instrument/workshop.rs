//! Where instruments are made: a thread that follows the parameters, and what the main thread does before it.
//!
//! Fitting and tuning are a thread of their own: whoever chooses another instrument meanwhile has that at once, and the
//! old work ends when it next looks up.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nice_plug::prelude::nice_log;

use super::choice::Order;
use super::{Bench, Job, NOBODY, Parcel, Placed, Shared, Stage};
use crate::cache::Cache;
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::instrument::prepare::{Progress, make};
use chalumeau_core::instrument::{BuildError, Clarinet, Model};

/// How often the thread looks up.
const TURN: Duration = Duration::from_millis(20);
/// How long A4 must stand still before an instrument is made for it.
const STILL: Duration = Duration::from_millis(500);
/// Instruments that may be on their way at once.
const ON_THE_WAY: usize = 4;

/// The main thread's end; the thread ends with it.
pub struct Workshop {
    params: Arc<ChalumeauParams>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    cache: Option<Cache>,
    turn: u64,
    /// Ends of the rings, until there is a bench.
    ends: Option<(rtrb::Consumer<Parcel>, rtrb::Producer<Box<Clarinet>>)>,
}

impl Workshop {
    /// Starts the thread. Allocates.
    pub fn start(params: Arc<ChalumeauParams>) -> Self {
        let shared = Arc::new(Shared::new());
        let (to_bench, incoming) = rtrb::RingBuffer::new(ON_THE_WAY);
        let (outgoing, from_bench) = rtrb::RingBuffer::new(2 * ON_THE_WAY);
        let cache = Cache::system();
        let maker = Maker {
            params: params.clone(),
            shared: shared.clone(),
            cache: cache.clone(),
            to_bench,
            from_bench,
            waiting: None,
            order: None,
            since: Instant::now(),
            refused: None,
            work: None,
            ending: Vec::new(),
        };
        let thread =
            std::thread::Builder::new().name("chalumeau maker".to_owned()).spawn(move || maker.run());
        // Without a thread the instrument stays what it is at each activation.
        Self { params, shared, thread: thread.ok(), cache, turn: 0, ends: Some((incoming, outgoing)) }
    }

    /// What the desk looks at.
    pub fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// The instrument the parameters ask for, on the bench, as good as it can be had at once; where a file is rendered, as
    /// good as it gets, however long it takes. The instrument before stays if the new one cannot be had. [main thread]
    pub fn activate(
        &mut self,
        bench: &mut Option<Bench>,
        host_rate_hz: f64,
        offline: bool,
    ) -> Result<(), String> {
        self.turn += 1;
        let before = {
            let mut job = self.shared.job();
            let placed = job.placed.take();
            // The thread lets go of what it is at.
            *job = Job { turn: self.turn, ..Job::default() };
            placed
        };
        self.shared.served.store(NOBODY, Ordering::Release);
        let order = Order::of(&self.params, host_rate_hz, offline);
        let at_rate = before.filter(|placed| placed.order.host_rate_hz == host_rate_hz);
        let (placed, trouble) = match self.best(&order, at_rate.as_ref(), offline) {
            Ok(placed) => (placed, None),
            Err(reason) => (self.instead(&order, at_rate)?, Some(reason)),
        };
        match (&trouble, placed.stage) {
            (Some(reason), _) => say(&self.params, &refusal(reason, &placed)),
            (None, stage) => say(&self.params, &words(stage, &placed)),
        }
        let same = bench.as_ref().is_some_and(|bench| Arc::ptr_eq(bench.clarinet().model(), &placed.model))
            && bench.as_ref().is_some_and(|bench| bench.rate_hz() == host_rate_hz);
        let clarinet = (!same).then(|| Box::new(Clarinet::new(placed.model.clone(), host_rate_hz)));
        match (bench.as_mut(), clarinet) {
            (Some(bench), clarinet) => bench.place(clarinet, host_rate_hz, self.turn, order.choice),
            (None, Some(clarinet)) => {
                if let Some((incoming, outgoing)) = self.ends.take() {
                    let mut new = Bench::new(self.shared.clone(), clarinet, incoming, outgoing);
                    new.place(None, host_rate_hz, self.turn, order.choice);
                    *bench = Some(new);
                }
            }
            (None, None) => {}
        }
        let mut job = self.shared.job();
        *job = Job { rate_hz: Some(host_rate_hz), offline, placed: Some(placed), turn: self.turn };
        Ok(())
    }

    fn best(&self, order: &Order, before: Option<&Placed>, offline: bool) -> Result<Placed, String> {
        if let Some(placed) = before
            && placed.order == *order
            && (placed.stage == Stage::Tuned || !offline)
        {
            return Ok(placed.clone());
        }
        let cache = Cache::store(self.cache.as_ref());
        let (model, stage) = order.at_once(cache)?;
        let (model, stage) = if offline && stage < Stage::Tuned {
            let wanted = order.wanted(order.file()?);
            let made = make(&wanted, cache, &mut |progress| {
                say(&self.params, &progress_words(progress));
                ControlFlow::Continue(())
            });
            (made.map_err(|reason| reason.to_string())?, Stage::Tuned)
        } else {
            (model, stage)
        };
        Ok(Placed { order: order.clone(), stage, model: Arc::new(model) })
    }

    /// What plays where the instrument asked for cannot be had: the one before, else the built-in one.
    fn instead(&self, order: &Order, before: Option<Placed>) -> Result<Placed, String> {
        if let Some(placed) = before {
            return Ok(placed);
        }
        let built_in = Model::built_in(order.host_rate_hz).map_err(|reason| reason.to_string())?;
        let order = Order::of(&ChalumeauParams::default(), order.host_rate_hz, false);
        Ok(Placed { order, stage: Stage::Tuned, model: Arc::new(built_in) })
    }
}

impl Drop for Workshop {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has been reported already.
            let _ = thread.join();
        }
    }
}

/// The thread.
struct Maker {
    params: Arc<ChalumeauParams>,
    shared: Arc<Shared>,
    cache: Option<Cache>,
    to_bench: rtrb::Producer<Parcel>,
    from_bench: rtrb::Consumer<Box<Clarinet>>,
    /// What the ring had no room for, because nobody plays.
    waiting: Option<Parcel>,
    /// What was asked for last, and since when.
    order: Option<Order>,
    since: Instant,
    /// What cannot be had; not tried again until something else is asked for.
    refused: Option<Order>,
    work: Option<Work>,
    /// Work that nobody wants any more, and that has not noticed yet.
    ending: Vec<JoinHandle<()>>,
}

/// An instrument being fitted and tuned.
struct Work {
    order: Order,
    turn: u64,
    cancelled: Arc<AtomicBool>,
    news: mpsc::Receiver<News>,
    thread: JoinHandle<()>,
}

enum News {
    Progress(String),
    Fitted(Arc<Model>),
    Made(Result<Arc<Model>, BuildError>),
}

impl Maker {
    fn run(mut self) {
        while !self.shared.stop.load(Ordering::Relaxed) {
            self.turn();
            std::thread::sleep(TURN);
        }
        self.stop_work();
        for thread in self.ending.drain(..) {
            // One that has panicked has been reported already.
            let _ = thread.join();
        }
    }

    /// Everything once.
    fn turn(&mut self) {
        while self.from_bench.pop().is_ok() {}
        self.push();
        self.ending.retain(|thread| !thread.is_finished());
        let job = self.shared.job().clone();
        let (Some(rate_hz), Some(placed)) = (job.rate_hz, &job.placed) else { return self.stop_work() };
        let mut order = Order::of(&self.params, rate_hz, job.offline);
        if job.offline {
            // While a file is rendered only another instrument is another instrument: A4 is the player's.
            let known = self.work.iter().map(|work| &work.order).chain([&placed.order]);
            if let Some(known) = known.into_iter().find(|known| known.choice == order.choice) {
                order = known.clone();
            }
        }
        if self.order.as_ref() != Some(&order) {
            (self.order, self.since) = (Some(order.clone()), Instant::now());
        }
        if self.work.as_ref().is_some_and(|work| work.order != order || work.turn != job.turn) {
            self.stop_work();
        }
        let same = order.source == placed.order.source && order.quality == placed.order.quality;
        if same && order != placed.order && self.since.elapsed() < STILL {
            return;
        }
        if order == placed.order && placed.stage == Stage::Tuned {
            self.refused = None;
            say(&self.params, &words(Stage::Tuned, placed));
            self.serve(&order);
        } else if self.refused.as_ref() == Some(&order) {
            self.serve(&order);
        } else if let Err(Some(reason)) = self.go_on(&order, &job, placed) {
            say(&self.params, &refusal(&reason, placed));
            self.refused = Some(order);
        }
    }

    /// Nothing more will come for this choice.
    fn serve(&self, order: &Order) {
        if self.waiting.is_none() {
            self.shared.served.store(order.choice, Ordering::Release);
        }
    }

    /// The next thing to be done for an order. `Err(None)`: nobody wants it any more.
    fn go_on(&mut self, order: &Order, job: &Job, placed: &Placed) -> Result<(), Option<String>> {
        if let Some(work) = self.work.take() {
            return self.listen(work, job, placed);
        }
        let mut stage = (placed.order == *order).then_some(placed.stage);
        // The same instrument at another pitch is played in tune by the one that is there.
        let bridged = placed.order.source == order.source && placed.stage >= Stage::Near;
        if bridged && !self.ending.is_empty() {
            return Ok(());
        }
        if stage.is_none() {
            let (model, now) = order.at_once(Cache::store(self.cache.as_ref())).map_err(Some)?;
            if now == Stage::Tuned || !(bridged || job.offline) {
                let model = Arc::new(model);
                let sent = Placed { order: order.clone(), stage: now, model: model.clone() };
                self.hand_over(order, job.turn, model, now)?;
                say(&self.params, &words(now, &sent));
                stage = Some(now);
            }
        }
        // One at a time: each takes all the cores there are.
        if stage != Some(Stage::Tuned) && self.ending.is_empty() {
            self.begin(order, job.turn)?;
        }
        Ok(())
    }

    fn begin(&mut self, order: &Order, turn: u64) -> Result<(), Option<String>> {
        let wanted = order.wanted(order.file().map_err(Some)?);
        let (cache, cancelled) = (self.cache.clone(), Arc::new(AtomicBool::new(false)));
        let (send, news) = mpsc::channel();
        let stop = cancelled.clone();
        let make = move || {
            let made = make(&wanted, Cache::store(cache.as_ref()), &mut |progress| {
                let sent = match progress {
                    Progress::Fitted(model) => send.send(News::Fitted(model.clone())),
                    shares => send.send(News::Progress(progress_words(shares))),
                };
                let go_on = sent.is_ok() && !stop.load(Ordering::Relaxed);
                if go_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            });
            // Nobody listens to what is cancelled.
            let _ = send.send(News::Made(made.map(Arc::new)));
        };
        let thread = std::thread::Builder::new()
            .name("chalumeau fit".to_owned())
            .spawn(make)
            .map_err(|reason| Some(format!("cannot start a thread: {reason}")))?;
        self.work = Some(Work { order: order.clone(), turn, cancelled, news, thread });
        Ok(())
    }

    /// What the work has to say.
    fn listen(&mut self, work: Work, job: &Job, placed: &Placed) -> Result<(), Option<String>> {
        loop {
            match work.news.try_recv() {
                Ok(News::Progress(text)) => say(&self.params, &text),
                Ok(News::Fitted(model)) => {
                    // What plays may be tuned already, for another pitch.
                    let better = placed.order == work.order && placed.stage < Stage::Fitted;
                    if better
                        && !job.offline
                        && let Err(gone) = self.hand_over(&work.order, work.turn, model, Stage::Fitted)
                    {
                        work.cancelled.store(true, Ordering::Relaxed);
                        self.ending.push(work.thread);
                        return Err(gone);
                    }
                }
                Ok(News::Made(made)) => {
                    // It has nothing left to do.
                    let _ = work.thread.join();
                    return match made {
                        Ok(model) => self.hand_over(&work.order, work.turn, model, Stage::Tuned),
                        Err(BuildError::Cancelled) => Err(None),
                        Err(reason) => Err(Some(reason.to_string())),
                    };
                }
                Err(mpsc::TryRecvError::Empty) => {
                    self.work = Some(work);
                    return Ok(());
                }
                Err(mpsc::TryRecvError::Disconnected) => {
                    return Err(Some("fitting it ended in a fault of the program".to_owned()));
                }
            }
        }
    }

    fn stop_work(&mut self) {
        if let Some(Work { cancelled, thread, .. }) = self.work.take() {
            cancelled.store(true, Ordering::Relaxed);
            self.ending.push(thread);
        }
    }

    /// Sends an instrument on its way, unless the host has begun anew meanwhile.
    fn hand_over(
        &mut self,
        order: &Order,
        turn: u64,
        model: Arc<Model>,
        stage: Stage,
    ) -> Result<(), Option<String>> {
        let clarinet = Box::new(Clarinet::new(model.clone(), order.host_rate_hz));
        {
            let mut job = self.shared.job();
            if job.turn != turn {
                return Err(None);
            }
            job.placed = Some(Placed { order: order.clone(), stage, model });
        }
        // What still waits for room is worse than this.
        self.waiting = Some(Parcel { turn, clarinet });
        self.push();
        Ok(())
    }

    fn push(&mut self) {
        if let Some(parcel) = self.waiting.take()
            && let Err(rtrb::PushError::Full(parcel)) = self.to_bench.push(parcel)
        {
            self.waiting = Some(parcel);
        }
    }
}

fn words(stage: Stage, placed: &Placed) -> String {
    match stage {
        Stage::Tuned => format!("ready: {}", placed.model.file.name),
        Stage::Near | Stage::Fitted => "to be tuned".to_owned(),
        Stage::Rough => "to be fitted".to_owned(),
    }
}

fn refusal(reason: &str, placed: &Placed) -> String {
    format!("{reason}; still {}", placed.model.file.name)
}

fn progress_words(progress: Progress<'_>) -> String {
    let percent = |share: f64| (100.0 * share.clamp(0.0, 1.0)).round();
    match progress {
        Progress::Fitting(share) => format!("fitting {} %", percent(share)),
        Progress::Fitted(_) => "fitted".to_owned(),
        Progress::Tuning(share) => format!("tuning {} %", percent(share)),
    }
}

fn say(params: &ChalumeauParams, text: &str) {
    if let Ok(mut said) = params.instrument_status.write()
        && *said != text
    {
        nice_log!("instrument: {text}");
        text.clone_into(&mut said);
    }
}
