//! The instrument under the audio thread's hands, and the one that takes its place. Real-time safe throughout.
//! [audio thread]

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{Parcel, Shared};
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::{Clarinet, Settings};

/// How long a new instrument speaks unheard, s: the lowest notes are there after 50 ms, a bass clarinet's after 100.
const WARM_S: f64 = 0.12;
/// How long one gives way to the other, s.
const FADE_S: f64 = 0.02;
/// Samples mixed in one go.
const CHUNK: usize = 64;
/// How long an offline render waits for an instrument before it goes on with the one it has.
const PATIENCE: Duration = Duration::from_secs(600);

/// The audio thread's end.
pub struct Bench {
    shared: Arc<Shared>,
    playing: Box<Clarinet>,
    coming: Option<Coming>,
    /// What is to be sent back, when there was no room.
    gone: Option<Box<Clarinet>>,
    incoming: rtrb::Consumer<Parcel>,
    outgoing: rtrb::Producer<Box<Clarinet>>,
    settings: Settings,
    turn: u64,
    /// *Instrument* that was waited for last.
    choice: u32,
    rate_hz: f64,
    warm: usize,
    fade: usize,
}

/// A new instrument beside the old one.
struct Coming {
    clarinet: Box<Clarinet>,
    /// Samples it has played.
    played: usize,
}

impl Bench {
    pub(super) fn new(
        shared: Arc<Shared>,
        playing: Box<Clarinet>,
        incoming: rtrb::Consumer<Parcel>,
        outgoing: rtrb::Producer<Box<Clarinet>>,
    ) -> Self {
        Self {
            shared,
            playing,
            coming: None,
            gone: None,
            incoming,
            outgoing,
            settings: Settings::default(),
            turn: 0,
            choice: 0,
            rate_hz: 0.0,
            warm: 0,
            fade: 1,
        }
    }

    /// A new activation, with an instrument of its own if the old one does not serve. [main thread]
    pub(super) fn place(&mut self, clarinet: Option<Box<Clarinet>>, rate_hz: f64, turn: u64, choice: u32) {
        self.coming = None;
        if let Some(clarinet) = clarinet {
            self.playing = clarinet;
        }
        (self.turn, self.choice) = (turn, choice);
        self.rate_hz = rate_hz;
        self.warm = (WARM_S * rate_hz) as usize;
        self.fade = (FADE_S * rate_hz) as usize;
    }

    /// The instrument that plays.
    pub fn clarinet(&self) -> &Clarinet {
        &self.playing
    }

    /// Keeps the last moments inside for a screen, or no longer.
    pub fn set_watched(&mut self, on: bool) {
        self.playing.set_watched(on);
    }

    /// The host rate it plays at, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// New settings, for both.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.settings = *settings;
        self.playing.set_settings(settings);
        if let Some(coming) = &mut self.coming {
            coming.clarinet.set_settings(settings);
        }
    }

    /// Where a file is rendered, waits until the instrument chosen is here or cannot be had. The one place where this
    /// thread waits, and never where anybody listens.
    pub fn wait_for(&mut self, choice: u32) {
        if std::mem::replace(&mut self.choice, choice) == choice {
            return;
        }
        let began = Instant::now();
        while self.shared.served.load(Ordering::Acquire) != choice && began.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Takes what the workshop has sent, and sends back what is no longer played. Once a block.
    pub fn tidy(&mut self) {
        self.send_back();
        while self.coming.is_none() && self.gone.is_none() {
            let Ok(Parcel { turn, mut clarinet }) = self.incoming.pop() else { return };
            if turn != self.turn {
                self.gone = Some(clarinet);
            } else {
                clarinet.set_settings(&self.settings);
                clarinet.carry_on(&self.playing);
                // Where nothing sounds there is nothing to fade.
                let played = if self.playing.is_silent() { self.warm + self.fade } else { 0 };
                self.coming = Some(Coming { clarinet, played });
                self.arrive();
            }
            self.send_back();
        }
    }

    fn send_back(&mut self) {
        if let Some(gone) = self.gone.take()
            && let Err(rtrb::PushError::Full(gone)) = self.outgoing.push(gone)
        {
            self.gone = Some(gone);
        }
    }

    /// The new one takes its place when it has faded in, and there is a place for the old one.
    fn arrive(&mut self) {
        let done = self.coming.as_ref().is_some_and(|coming| coming.played >= self.warm + self.fade);
        if done
            && self.gone.is_none()
            && let Some(coming) = self.coming.take()
        {
            self.gone = Some(std::mem::replace(&mut self.playing, coming.clarinet));
        }
    }

    /// Silence, and every state as new; a new instrument that was on its way is in place.
    pub fn reset(&mut self) {
        if let Some(coming) = &mut self.coming {
            coming.played = self.warm + self.fade;
        }
        self.arrive();
        self.playing.reset();
        if let Some(coming) = &mut self.coming {
            coming.clarinet.reset();
        }
    }

    /// As [`Clarinet::render_events`].
    pub fn render_events(&mut self, events: impl IntoIterator<Item = Timed<Event>>, out: &mut [f32]) {
        if self.coming.is_none() {
            return self.playing.render_events(events, out);
        }
        let mut done = 0;
        for Timed { at, event } in events {
            let at = at.clamp(done, out.len());
            self.render(&mut out[done..at]);
            self.playing.apply(event);
            if let Some(coming) = &mut self.coming {
                coming.clarinet.apply(event);
            }
            done = at;
        }
        self.render(&mut out[done..]);
    }

    fn render(&mut self, out: &mut [f32]) {
        let mut beside = [0.0; CHUNK];
        for out in out.chunks_mut(CHUNK) {
            self.playing.render(out);
            let Some(coming) = &mut self.coming else { continue };
            let beside = &mut beside[..out.len()];
            coming.clarinet.render(beside);
            for (old, new) in out.iter_mut().zip(beside) {
                let way = coming.played.saturating_sub(self.warm);
                // Equal power: the two have their own phases. The end is the new one to the bit.
                *old = if way < self.fade {
                    let angle = std::f32::consts::FRAC_PI_2 * way as f32 / self.fade as f32;
                    *old * angle.cos() + *new * angle.sin()
                } else {
                    *new
                };
                coming.played += 1;
            }
            self.arrive();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::bundled::Bundled;
    use chalumeau_core::instrument::Model;
    use chalumeau_core::instrument::prepare::{Wanted, rough};
    use chalumeau_core::units::SoundingNote;

    const RATE: f64 = 48_000.0;
    const AT: usize = 24_000;

    struct Ends {
        bench: Bench,
        send: rtrb::Producer<Parcel>,
        back: rtrb::Consumer<Box<Clarinet>>,
    }

    fn bench() -> Ends {
        let built_in = || Box::new(Clarinet::built_in(RATE).unwrap());
        let (send, incoming) = rtrb::RingBuffer::new(4);
        let (outgoing, back) = rtrb::RingBuffer::new(8);
        let mut bench = Bench::new(Arc::new(Shared::new()), built_in(), incoming, outgoing);
        bench.place(None, RATE, 1, 0);
        bench.set_settings(&Settings::default());
        Ends { bench, send, back }
    }

    fn held() -> [Timed<Event>; 2] {
        let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 0.8 };
        [Event::Breath(0.6), note_on].map(|event| Timed { at: 0, event })
    }

    /// A held note with another instrument from a second's half on, in blocks of so many samples.
    fn exchanged(model: Model, block: usize) -> (Vec<f32>, Ends) {
        let mut ends = bench();
        let mut out = vec![0.0; 2 * RATE as usize];
        let mut said = Some(held());
        for (number, out) in out.chunks_mut(block).enumerate() {
            if number * block == AT {
                let clarinet = Box::new(Clarinet::new(Arc::new(model.clone()), RATE));
                assert!(ends.send.push(Parcel { turn: 1, clarinet }).is_ok());
            }
            ends.bench.tidy();
            ends.bench.render_events(said.take().into_iter().flatten(), out);
        }
        (out, ends)
    }

    fn largest_step(sound: &[f32]) -> f32 {
        sound.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
    }

    fn rms(sound: &[f32]) -> f32 {
        (sound.iter().map(|x| x * x).sum::<f32>() / sound.len() as f32).sqrt()
    }

    #[test]
    fn a_note_goes_on_over_an_exchange_without_a_click_or_a_gap() {
        let another = rough(&Wanted::new(Bundled::A.file(), RATE)).unwrap();
        for model in [Model::built_in(RATE).unwrap(), another] {
            let (sound, mut ends) = exchanged(model, 240);
            let own = largest_step(&sound[AT / 2..AT]).max(largest_step(&sound[3 * AT..]));
            let over = largest_step(&sound[AT..2 * AT]);
            assert!(over <= 1.5 * own, "{over} over the exchange, {own} before and after");
            let loud = rms(&sound[AT / 2..AT]);
            for (at, window) in sound[AT..].chunks(960).enumerate() {
                assert!(rms(window) > 0.5 * loud, "{} ms after: {} of {loud}", 20 * at, rms(window));
            }
            assert!(ends.back.pop().is_ok(), "the old one was sent back");
        }
    }

    #[test]
    fn where_the_exchange_begins_does_not_depend_on_blocks() {
        let model = Model::built_in(RATE).unwrap();
        let whole = exchanged(model.clone(), 24_000).0;
        for block in [16, 240, 4_000] {
            assert!(exchanged(model.clone(), block).0 == whole, "blocks of {block}");
        }
    }

    #[test]
    fn hands_stay_where_they_are() {
        let mut ends = bench();
        let mut out = vec![0.0; AT];
        ends.bench.render_events(held(), &mut out);
        let clarinet = Box::new(Clarinet::built_in(RATE).unwrap());
        assert!(ends.send.push(Parcel { turn: 1, clarinet }).is_ok());
        ends.bench.tidy();
        ends.bench.render_events([], &mut out);
        let loud = rms(&out[AT / 2..]);
        assert!(loud > 1e-3, "the key is still down");
        // Its release and the end of the breath reach the new one.
        let off = Timed { at: 0, event: Event::NoteOff { note: SoundingNote(60) } };
        ends.bench.render_events([off], &mut out);
        assert!(rms(&out[AT / 2..]) < 1e-3 * loud, "{} of {loud}", rms(&out[AT / 2..]));
    }

    #[test]
    fn a_silent_instrument_is_exchanged_at_once_and_one_of_another_time_never() {
        let mut ends = bench();
        let mut out = vec![0.0; AT];
        ends.bench.render_events([], &mut out);
        let clarinet = || Box::new(Clarinet::built_in(RATE).unwrap());
        let model = clarinet();
        let model = model.model();
        assert!(!Arc::ptr_eq(ends.bench.clarinet().model(), model));
        assert!(ends.send.push(Parcel { turn: 7, clarinet: clarinet() }).is_ok());
        let new = Box::new(Clarinet::new(model.clone(), RATE));
        assert!(ends.send.push(Parcel { turn: 1, clarinet: new }).is_ok());
        ends.bench.tidy();
        assert!(Arc::ptr_eq(ends.bench.clarinet().model(), model));
        assert!(ends.back.pop().is_ok() && ends.back.pop().is_ok() && ends.back.pop().is_err());
    }
}
