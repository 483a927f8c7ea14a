//! The instrument that the audio thread plays, and its exchange for the next one. Real-time safe throughout.
//! [audio thread]

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::{SharedInstrument, SwapCandidate};
use chalumeau_core::event::{Event, PartEvent, Timed};
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::instrument::{Channels, Clarinet, Ensemble, Settings};
use chalumeau_core::maths;

/// Time for which a new instrument plays unheard, s. The lowest notes of a B flat clarinet speak after 50 ms, those of a
/// bass clarinet after 100 ms.
const WARM_UP_S: f64 = 0.12;
/// Length of the crossfade, s.
const FADE_S: f64 = 0.02;
/// Samples mixed at a time.
const CHUNK: usize = 64;
/// Longest time for which an offline render waits for an instrument before it continues with the one it has.
const LONGEST_WAIT: Duration = Duration::from_secs(600);

/// The instrument that plays, and the next one while they change over.
pub struct InstrumentSwap {
    shared: Arc<SharedInstrument>,
    playing: Box<Ensemble>,
    next: Option<NextInstrument>,
    /// An old instrument that the ring back had no room for.
    old: Option<Box<Ensemble>>,
    incoming: rtrb::Consumer<SwapCandidate>,
    outgoing: rtrb::Producer<Box<Ensemble>>,
    settings: Settings,
    stereo: Stereo,
    activation: u64,
    /// Nothing was rendered since the activation or a reset.
    is_unheard: bool,
    /// The value of *Instrument* that was waited for last in this activation.
    awaited_choice: Option<u32>,
    rate_hz: f64,
    warm_up: usize,
    fade: usize,
}

/// A new instrument beside the old one.
struct NextInstrument {
    ensemble: Box<Ensemble>,
    /// Samples it has played.
    played: usize,
}

impl InstrumentSwap {
    pub(super) fn new(
        shared: Arc<SharedInstrument>,
        playing: Box<Ensemble>,
        incoming: rtrb::Consumer<SwapCandidate>,
        outgoing: rtrb::Producer<Box<Ensemble>>,
    ) -> Self {
        Self {
            shared,
            playing,
            next: None,
            old: None,
            incoming,
            outgoing,
            settings: Settings::default(),
            stereo: Stereo::new(48_000.0),
            activation: 0,
            is_unheard: true,
            awaited_choice: None,
            rate_hz: 0.0,
            warm_up: 0,
            fade: 1,
        }
    }

    /// Begins a new activation. `ensemble` replaces the instrument if the old one does not fit. [main thread]
    pub(super) fn activate(&mut self, ensemble: Option<Box<Ensemble>>, rate_hz: f64, activation: u64) {
        self.next = None;
        if let Some(ensemble) = ensemble {
            self.playing = ensemble;
        }
        (self.activation, self.awaited_choice) = (activation, None);
        self.is_unheard = true;
        self.rate_hz = rate_hz;
        self.stereo = Stereo::new(rate_hz);
        self.stereo.set_space(&self.settings);
        self.warm_up = (WARM_UP_S * rate_hz) as usize;
        self.fade = (FADE_S * rate_hz) as usize;
    }

    /// The instrument of the first player.
    pub fn clarinet(&self) -> &Clarinet {
        self.playing.first()
    }

    /// Those who play.
    pub fn ensemble(&self) -> &Ensemble {
        &self.playing
    }

    /// Those who will play, if others fade in, else those who play.
    pub fn newest(&self) -> &Ensemble {
        self.next.as_ref().map_or(&self.playing, |next| &next.ensemble)
    }

    /// Whether neither the instrument nor its room sounds, and no other instrument is on its way: the host may stop calling. If it stopped
    /// in the middle of an exchange, the next note would begin on the old instrument.
    pub fn is_silent(&self) -> bool {
        self.next.is_none() && self.playing.is_silent() && self.stereo.room().is_silent()
    }

    /// Longest time from rest to silence, s.
    pub fn tail_s(&self) -> f64 {
        let articulation = self.ensemble().first().settings().articulation;
        Clarinet::TAIL_S + articulation.tail_s() + self.stereo.room().tail_s()
    }

    /// Switches on or off that the instrument keeps its last moments for the window.
    pub fn set_scope_on(&mut self, on: bool) {
        self.playing.set_scope_on(on);
    }

    /// The host's sample rate, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Applies settings to both instruments.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.settings = *settings;
        self.stereo.set_space(settings);
        let was_lone = self.playing.is_lone();
        let is_other_group = self.playing.first().settings().players != settings.players;
        self.playing.set_settings(settings);
        if self.is_unheard && is_other_group {
            // Players who came before anything was heard begin like the others: two bounces are alike.
            self.playing.reset();
        }
        if self.playing.is_lone() != was_lone {
            self.stereo.hand_over_pan(was_lone, self.playing.pan());
        }
        if let Some(next) = &mut self.next {
            next.ensemble.set_settings(settings);
        }
    }

    /// Waits until the loader has done all that the parameters ask for: in the first block of an activation, because a
    /// host may send it parameters that come after the activation, and when `choice`, the value of *Instrument*, changes.
    /// Only for an offline render, which waits here and for presets, and nowhere else.
    pub fn wait_for(&mut self, choice: u32) {
        if self.awaited_choice.replace(choice) == Some(choice) {
            return;
        }
        let asked = self.shared.asked.fetch_add(1, Ordering::Release) + 1;
        let began = Instant::now();
        while self.shared.answered.load(Ordering::Acquire) < asked
            && !self.shared.stop.load(Ordering::Relaxed)
            && began.elapsed() < LONGEST_WAIT
        {
            // The loader answers once it has handed over everything, and for that it needs room.
            self.receive();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Receives instruments from the loader, and sends old ones back. Call it once a block.
    pub fn receive(&mut self) {
        self.send_back();
        while self.next.is_none() && self.old.is_none() {
            let Ok(SwapCandidate { activation, mut ensemble }) = self.incoming.pop() else { return };
            if activation != self.activation {
                self.old = Some(ensemble);
            } else {
                ensemble.set_settings(&self.settings);
                ensemble.carry_on(&self.playing);
                // Silence needs no fade.
                let is_silent = self.is_unheard || self.playing.is_silent();
                let played = if is_silent { self.warm_up + self.fade } else { 0 };
                self.next = Some(NextInstrument { ensemble, played });
                self.finish_swap();
            }
            self.send_back();
        }
    }

    fn send_back(&mut self) {
        if let Some(old) = self.old.take()
            && let Err(rtrb::PushError::Full(old)) = self.outgoing.push(old)
        {
            self.old = Some(old);
        }
    }

    /// Replaces the old instrument if the new one has faded in and there is a place for the old one.
    fn finish_swap(&mut self) {
        let done = self.next.as_ref().is_some_and(|next| next.played >= self.warm_up + self.fade);
        if done
            && self.old.is_none()
            && let Some(next) = self.next.take()
        {
            self.old = Some(std::mem::replace(&mut self.playing, next.ensemble));
        }
    }

    /// Silences everything and clears every state. A new instrument that had arrived now plays.
    pub fn reset(&mut self) {
        if let Some(next) = &mut self.next {
            next.played = self.warm_up + self.fade;
        }
        self.finish_swap();
        self.is_unheard = true;
        self.stereo.reset();
        self.playing.reset();
        if let Some(next) = &mut self.next {
            next.ensemble.reset();
        }
    }

    /// See [`Ensemble::render_events_channels`]; both instruments receive the events.
    pub fn render_events(&mut self, events: impl IntoIterator<Item = Timed<PartEvent>>, mut out: Channels) {
        self.is_unheard = false;
        let is_lone = self.playing.is_lone();
        if self.next.is_none() {
            let stereo = &mut self.stereo;
            let events = events.into_iter().inspect(|event| heed(stereo, event, is_lone));
            return self.playing.render_events_channels(events, out);
        }
        let (mut done, end) = (0, out.len());
        for Timed { at, event } in events {
            heed(&mut self.stereo, &Timed { at, event }, is_lone);
            let at = at.clamp(done, end);
            self.render(out.part(done..at));
            self.playing.apply(event);
            if let Some(next) = &mut self.next {
                next.ensemble.apply(event);
            }
            done = at;
        }
        self.render(out.part(done..end));
    }

    /// Room and pan of the two channels of the block that was rendered last. See [`Stereo`].
    pub fn pan(&mut self, left: &mut [f32], right: &mut [f32]) {
        self.stereo.pan(left, right);
    }

    fn render(&mut self, mut out: Channels) {
        let (mut new_left, mut new_right) = ([0.0; CHUNK], [0.0; CHUNK]);
        let end = out.len();
        for begin in (0..end).step_by(CHUNK) {
            let mut out = out.part(begin..end.min(begin + CHUNK));
            self.playing.render_channels(out.part(0..out.len()));
            let Some(next) = &mut self.next else { continue };
            let (new_left, new_right) = (&mut new_left[..out.len()], &mut new_right[..out.len()]);
            next.ensemble.render_channels(if out.is_stereo() {
                Channels::two(new_left, new_right)
            } else {
                Channels::one(new_left)
            });
            let (warm_up, fade) = (self.warm_up, self.fade);
            let mix = |old: &mut [f32], new: &[f32]| {
                for (played, (old, new)) in (next.played..).zip(old.iter_mut().zip(new)) {
                    let faded = played.saturating_sub(warm_up);
                    // Equal power, because the two have different phases. At the end the output is the new one to the bit.
                    *old = if faded < fade {
                        let angle = std::f32::consts::FRAC_PI_2 * faded as f32 / fade as f32;
                        let (new_share, old_share) = maths::single::sin_cos(angle);
                        *old * old_share + *new * new_share
                    } else {
                        *new
                    };
                }
            };
            mix(out.left(), new_left);
            if let Some(right) = out.right() {
                mix(right, new_right);
            }
            next.played += out.len();
            self.finish_swap();
        }
    }
}

/// Room and pan of the whole instrument; several players are panned one by one.
fn heed(stereo: &mut Stereo, &Timed { at, event }: &Timed<PartEvent>, is_lone: bool) {
    if is_lone || !matches!(event.event, Event::Pan { .. }) {
        stereo.heed(&Timed { at, event: event.event });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::bundled::Bundled;
    use chalumeau_core::instrument::Model;
    use chalumeau_core::instrument::prepare::{Preparation, Wanted};
    use chalumeau_core::units::SoundingNote;

    const RATE: f64 = 48_000.0;
    const AT: usize = 24_000;

    struct SwapEnds {
        swap: InstrumentSwap,
        send: rtrb::Producer<SwapCandidate>,
        back: rtrb::Consumer<Box<Ensemble>>,
    }

    fn swap_ends() -> SwapEnds {
        let built_in = || Box::new(Ensemble::built_in(RATE).unwrap());
        let (send, incoming) = rtrb::RingBuffer::new(4);
        let (outgoing, back) = rtrb::RingBuffer::new(8);
        let mut swap = InstrumentSwap::new(Arc::default(), built_in(), incoming, outgoing);
        swap.activate(None, RATE, 1);
        swap.set_settings(&Settings::default());
        SwapEnds { swap, send, back }
    }

    fn held() -> [Timed<PartEvent>; 2] {
        let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 0.8 };
        [Event::Breath(0.6), note_on].map(|event| Timed { at: 0, event: event.into() })
    }

    /// Plays a held note, with another instrument after half a second, in blocks of `block` samples.
    fn exchanged(model: Model, block: usize) -> (Vec<f32>, SwapEnds) {
        let mut ends = swap_ends();
        let mut out = vec![0.0; 2 * RATE as usize];
        let mut said = Some(held());
        for (number, out) in out.chunks_mut(block).enumerate() {
            if number * block == AT {
                let ensemble = Box::new(Ensemble::new(Arc::new(model.clone()), RATE));
                assert!(ends.send.push(SwapCandidate { activation: 1, ensemble }).is_ok());
            }
            ends.swap.receive();
            ends.swap.render_events(said.take().into_iter().flatten(), Channels::one(out));
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
        let another = Preparation::new(&Wanted::new(Bundled::A.file(), RATE), None).rough().unwrap();
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
    fn held_keys_stay_held() {
        let mut ends = swap_ends();
        let mut out = vec![0.0; AT];
        ends.swap.render_events(held(), Channels::one(&mut out));
        let ensemble = Box::new(Ensemble::built_in(RATE).unwrap());
        assert!(ends.send.push(SwapCandidate { activation: 1, ensemble }).is_ok());
        ends.swap.receive();
        ends.swap.render_events([], Channels::one(&mut out));
        let loud = rms(&out[AT / 2..]);
        assert!(loud > 1e-3, "the key is still down");
        // The release reaches the new instrument.
        let off = Timed { at: 0, event: Event::NoteOff { note: SoundingNote(60) }.into() };
        ends.swap.render_events([off], Channels::one(&mut out));
        assert!(rms(&out[AT / 2..]) < 1e-3 * loud, "{} of {loud}", rms(&out[AT / 2..]));
    }

    #[test]
    fn a_host_goes_on_calling_until_an_exchange_has_ended() {
        let mut ends = swap_ends();
        let mut out = vec![0.0; AT];
        ends.swap.render_events(held(), Channels::one(&mut out));
        let off = Timed { at: 0, event: Event::NoteOff { note: SoundingNote(60) }.into() };
        ends.swap.render_events([off], Channels::one(&mut out[..2_400]));
        // The note fades while the other instrument comes.
        let ensemble = Box::new(Ensemble::built_in(RATE).unwrap());
        assert!(ends.send.push(SwapCandidate { activation: 1, ensemble }).is_ok());
        ends.swap.receive();
        for _ in 0..100 {
            ends.swap.render_events([], Channels::one(&mut out[..480]));
            ends.swap.receive();
            assert!(!ends.swap.is_silent() || ends.back.pop().is_ok());
            if ends.swap.is_silent() {
                return;
            }
        }
        panic!("it never falls silent");
    }

    #[test]
    fn a_silent_instrument_is_exchanged_at_once_and_one_of_another_activation_never() {
        let mut ends = swap_ends();
        let mut out = vec![0.0; AT];
        ends.swap.render_events([], Channels::one(&mut out));
        let ensemble = || Box::new(Ensemble::built_in(RATE).unwrap());
        let model = ensemble();
        let model = model.first().model();
        assert!(!Arc::ptr_eq(ends.swap.clarinet().model(), model));
        assert!(ends.send.push(SwapCandidate { activation: 7, ensemble: ensemble() }).is_ok());
        let new = Box::new(Ensemble::new(model.clone(), RATE));
        assert!(ends.send.push(SwapCandidate { activation: 1, ensemble: new }).is_ok());
        ends.swap.receive();
        assert!(Arc::ptr_eq(ends.swap.clarinet().model(), model));
        assert!(ends.back.pop().is_ok() && ends.back.pop().is_ok() && ends.back.pop().is_err());
    }
}
