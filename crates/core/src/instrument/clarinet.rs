//! The whole instrument at the host's sample rate: events in, samples out.
//!
//! The voice runs at its internal rate on a fixed control grid, and host samples are pulled from it. So the output does
//! not depend on the host's block size. Beyond the lip, a note is bent by the speed of the internal clock, see
//! [`bend`](super::bend).

use std::sync::Arc;

use crate::bore::sound_sources::SoundSources;
use crate::dsp::lanes::sum;
use crate::dsp::limiter::Limiter;
use crate::dsp::resampler::Resampler;
use crate::event::{Event, Timed};
use crate::instrument::channels::Channels;
use crate::instrument::choke::Choke;
use crate::instrument::lip::embouchure;
use crate::instrument::listening::Listening;
use crate::instrument::model::{BuildError, Model};
use crate::instrument::output_level::OutputLevel;
use crate::instrument::person::Person;
use crate::instrument::player::{Player, PlayerState};
use crate::instrument::scope::Scope;
use crate::instrument::settings::Settings;
use crate::instrument::stage::Chair;
use crate::instrument::voice::{Probe, TICK, Voice};
use crate::reed::ReedLaw;
use crate::reed::ReedTables;
use crate::reed::physical::{LAY_REFERENCE, ZETA_REFERENCE};
use crate::reed::{MovingReed, ReedCoeffs};
use crate::units::nearest_rate_hz;

/// Samples up to this magnitude count as silence: -120 dBFS. A gain that raises them raises it as well: single precision may
/// leave a bore ringing at -140 dBFS for ever.
const SILENCE: f32 = 1e-6;
/// Time of silence after which a resting instrument counts as silent, s: 4096 samples at 48 kHz, five periods of the bass
/// clarinet's lowest note.
pub(super) const QUIET_S: f64 = 4_096.0 / 48_000.0;
/// Host samples between two checks of level and limiter.
const CHUNK: usize = 64;

/// The voice in the precision that its rate needs.
enum AnyVoice {
    Single(Box<Voice<f32>>),
    Double(Box<Voice<f64>>),
}

/// Evaluates an expression with the voice, whatever its precision.
macro_rules! with_voice {
    ($any:expr, $voice:ident => $body:expr) => {
        match $any {
            AnyVoice::Single($voice) => $body,
            AnyVoice::Double($voice) => $body,
        }
    };
}

/// A playable clarinet: events in, samples out.
///
/// ```
/// use chalumeau_core::event::{Event, Timed};
/// use chalumeau_core::instrument::Clarinet;
/// use chalumeau_core::units::SoundingNote;
///
/// let mut clarinet = Clarinet::built_in(44_100.0)?;
/// let note = SoundingNote(62);
/// let score = [
///     Timed { at: 0, event: Event::NoteOn { note, velocity: 0.7 } },
///     Timed { at: 6_000, event: Event::NoteOff { note } },
/// ];
/// let mut block = vec![0.0; 8_192];
/// clarinet.render_events(score, &mut block);
/// assert!(block.iter().all(|sample| sample.abs() <= 1.0));
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
pub struct Clarinet {
    model: Arc<Model>,
    player: Player,
    voice: AnyVoice,
    resampler: Resampler,
    /// The right channel's, while it is not the same as the left.
    right: Resampler,
    /// Ticks for which the right channel may still differ: those that its filter hears.
    apart: u32,
    /// The last block had a right channel.
    stereo: bool,
    limiter: Limiter,
    scope: Scope,
    scope_on: bool,
    level: OutputLevel,
    /// Where it is heard from depends on where its player sits among several.
    chair: Chair,
    choke: Choke,
    /// Samples of silence since the player came to rest, and how many count as silence.
    quiet: u32,
    silent_from: u32,
    resets: u64,
}

/// How far a block has been filled.
#[derive(Clone, Copy, Default)]
pub(super) struct Progress {
    /// Where the present piece begins, and how many of its samples there are.
    begin: usize,
    made: usize,
}

impl Clarinet {
    /// Longest time from rest to silence, s: what a host must still play when breath and keys have ended. The bass clarinet
    /// takes 1.56 s (`tests/silence.rs`).
    pub const TAIL_S: f64 = 2.0;

    /// The built-in B flat clarinet at a host rate in Hz, 1000..=1536000. Allocates.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the host rate is out of range.
    pub fn built_in(host_rate_hz: f64) -> Result<Self, BuildError> {
        Ok(Self::new(Arc::new(Model::built_in(host_rate_hz)?), host_rate_hz))
    }

    /// Any instrument, from a model that was prepared for this host rate, Hz, 1000..=1536000. A rate outside counts as the nearest that is
    /// inside, NaN as 48000: pitch and time are then others. Allocates.
    pub fn new(model: Arc<Model>, host_rate_hz: f64) -> Self {
        Self::of_player(model, host_rate_hz, 0)
    }

    /// As [`new`](Self::new), played by one of several players, by number: with breath noise, wander and swing of its own,
    /// and out of tune by its share of [`Players::spread_cents`](super::Players::spread_cents). Number 0 is the lone player.
    pub fn of_player(model: Arc<Model>, host_rate_hz: f64, number: u8) -> Self {
        let host_rate_hz = nearest_rate_hz(host_rate_hz);
        let resampler = Resampler::new(model.coeffs.rate_hz, host_rate_hz);
        Self::with_resampler(model, host_rate_hz, number, resampler)
    }

    /// Another player beside this one, at the same rate, at rest. Most of its making is shared. Allocates.
    pub(super) fn beside(&self, host_rate_hz: f64, number: u8) -> Self {
        let mut resampler = self.resampler.clone();
        resampler.reset();
        Self::with_resampler(self.model.clone(), host_rate_hz, number, resampler)
    }

    fn with_resampler(model: Arc<Model>, host_rate_hz: f64, number: u8, resampler: Resampler) -> Self {
        let person = Person::new(number);
        let lip = embouchure(model.size_hz, model.size_hz);
        let (swept, rate) = (model.swept_s, model.coeffs.rate_hz);
        let reed = ReedCoeffs::new(
            MovingReed {
                law: ReedLaw::default(),
                zeta: ZETA_REFERENCE,
                lay: LAY_REFERENCE,
                resonance_hz: lip.resonance_hz,
                damping: lip.damping,
                swept_s: swept,
            },
            rate,
        );
        let tables = ReedTables::reference();
        let sources = SoundSources::of(&model.file);
        let mut voice = if !model.is_single() {
            AnyVoice::Double(Box::new(Voice::new(&model.coeffs, sources, &model.air, tables, reed)))
        } else {
            AnyVoice::Single(Box::new(Voice::new(&model.coeffs, sources, &model.air, tables, reed)))
        };
        with_voice!(&mut voice, voice => {
            voice.listen(&Listening::default(), false);
            voice.play_as(&person);
            voice.reset();
        });
        let level = OutputLevel::new(model.file.nominal_radius_m, host_rate_hz);
        let scope = Scope::new(rate, model.size_hz);
        Self {
            model,
            player: Player::new(person),
            voice,
            right: resampler.clone(),
            resampler,
            apart: 0,
            stereo: false,
            limiter: Limiter::new(host_rate_hz),
            scope,
            scope_on: false,
            level,
            chair: Chair::default(),
            choke: Choke::new(host_rate_hz),
            quiet: 0,
            silent_from: (QUIET_S * host_rate_hz).ceil() as u32,
            resets: 0,
        }
    }

    /// Takes new settings, clamped to their ranges; they are heard from the next control tick on. Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.player.set_settings(settings);
        self.level.set(self.player.settings());
        if self.is_silent() {
            self.level.settle();
        }
        self.listen();
    }

    /// The gain of the settings is there at once: nobody hears this one. Real-time safe.
    pub(super) fn settle_level(&mut self) {
        self.level.settle();
    }

    /// Sits down on a chair. Real-time safe.
    pub(super) fn sit(&mut self, chair: Chair) {
        if self.chair != chair {
            self.chair = chair;
            self.listen();
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        self.player.settings()
    }

    fn listen(&mut self) {
        let listening = self.chair.listening(&self.player.settings().listening);
        with_voice!(&mut self.voice, voice => voice.listen(&listening, self.stereo));
    }

    /// Handles an event now. Real-time safe.
    pub fn apply(&mut self, event: Event) {
        match event {
            Event::Volume { gain } => self.level.set_volume(gain),
            Event::Choke { note } if self.player.is_heard(note) => self.choke.begin(),
            Event::Set(number, value) => {
                let mut settings = *self.player.settings();
                *settings.number(number) = value;
                self.set_settings(&settings);
            }
            _ => {}
        }
        with_voice!(&mut self.voice, voice => self.player.apply(event, &self.model, voice));
        self.quiet = 0;
    }

    /// Takes over keys, breath and bend from another instrument, which this new one replaces. Real-time safe.
    pub fn carry_on(&mut self, from: &Self) {
        with_voice!(&mut self.voice, voice => self.player.carry_on(&from.player, &from.model, &self.model, voice));
        self.level.carry_on(&from.level);
    }

    /// Takes over breath, bend, volume and controllers from another player, without keys. Real-time safe.
    pub(super) fn follow(&mut self, from: &Self) {
        self.player.follow(&from.player);
        self.level.follow(&from.level);
    }

    /// Nothing sounds that a choke could cut. Real-time safe.
    pub(super) fn forget_choke(&mut self) {
        self.choke.reset();
    }

    /// All keys come up. Real-time safe.
    pub(super) fn let_go(&mut self) {
        while let Some(note) = self.player.key() {
            self.apply(Event::NoteOff { note });
        }
    }

    /// Samples up to this magnitude count as silence.
    pub(super) fn silence(&self) -> f32 {
        SILENCE * self.level.boost()
    }

    /// Overwrites `out` with the next samples, mono. Real-time safe.
    pub fn render(&mut self, out: &mut [f32]) {
        self.render_with(Channels::one(out), &mut None);
    }

    /// Overwrites one or two channels with the next samples. Real-time safe.
    pub fn render_channels(&mut self, out: Channels) {
        self.render_with(out, &mut None);
    }

    /// Renders one block with its events, which must be in order of time. An event at or after the end of the block is
    /// applied at its end. Real-time safe.
    pub fn render_events(&mut self, events: impl IntoIterator<Item = Timed<Event>>, out: &mut [f32]) {
        self.render_events_channels(events, Channels::one(out));
    }

    /// As [`render_events`](Self::render_events), into one or two channels. Real-time safe.
    pub fn render_events_channels(&mut self, events: impl IntoIterator<Item = Timed<Event>>, out: Channels) {
        out.cut_at(events, self, Self::render_channels, Self::apply);
    }

    /// As [`render`](Self::render), and calls `probe` once for each internal sample, in order of time.
    pub fn render_probed(&mut self, out: &mut [f32], probe: &mut dyn FnMut(Probe)) {
        self.render_probed_channels(Channels::one(out), probe);
    }

    /// As [`render_probed`](Self::render_probed), into one or two channels.
    pub fn render_probed_channels(&mut self, out: Channels, probe: &mut dyn FnMut(Probe)) {
        with_voice!(&mut self.voice, voice => voice.set_probing(true));
        self.render_with(out, &mut Some(probe));
        with_voice!(&mut self.voice, voice => voice.set_probing(false));
    }

    /// Switches the scope on or off. Real-time safe.
    pub fn set_scope_on(&mut self, on: bool) {
        if self.scope_on != on {
            self.scope_on = on;
            self.scope.restart();
            with_voice!(&mut self.voice, voice => voice.set_probing(on));
        }
    }

    /// Captures of the inside, while [`set_scope_on`](Self::set_scope_on) is on.
    pub fn scope(&self) -> &Scope {
        &self.scope
    }

    /// Held note, fingering and mouth pressure now. Real-time safe.
    pub fn player_state(&self) -> PlayerState {
        self.player.state(&self.model)
    }

    fn render_with(&mut self, mut out: Channels, probe: &mut Option<&mut dyn FnMut(Probe)>) {
        let mut progress = Progress::default();
        while self.advance(&mut out, &mut progress) {
            self.tick(probe);
        }
    }

    /// Fills `out` as far as it can be; whether another tick is needed before it goes on.
    pub(super) fn advance(&mut self, out: &mut Channels, progress: &mut Progress) -> bool {
        if self.stereo != out.is_stereo() {
            (self.stereo, self.apart) = (out.is_stereo(), 0);
            self.listen();
        }
        let samples = out.len();
        while progress.begin < samples {
            // A choke ends at its sample, not at the end of a chunk.
            let left = samples - progress.begin;
            let end = progress.begin + self.choke.reach(CHUNK.min(left));
            let mut piece = out.part(progress.begin..end);
            progress.made += self.pull(&mut piece, progress.made);
            if progress.made < piece.len() {
                return true;
            }
            self.finish(piece);
            *progress = Progress { begin: end, made: 0 };
        }
        false
    }

    /// Fills both channels from sample `from` on, as far as they can be; returns how far that is.
    fn pull(&mut self, out: &mut Channels, from: usize) -> usize {
        let made = self.resampler.pull(&mut out.left[from..]);
        let range = from..from + made;
        if let Some(right) = &mut out.right {
            if self.apart > 0 {
                // Both have heard as many samples, so both make as many.
                self.right.pull(&mut right[range]);
            } else {
                right[range.clone()].copy_from_slice(&out.left[range]);
            }
        }
        made
    }

    /// One control tick of player and voice.
    fn tick(&mut self, probe: &mut Option<&mut dyn FnMut(Probe)>) {
        with_voice!(&mut self.voice, voice => {
            let drive = self.player.tick(&self.model, voice);
            voice.tick(&drive);
        });
        self.hear(probe);
    }

    /// The player's part of a tick; the voice's must be run, in a lane of a choir or [alone](Self::run_alone), and
    /// [ended](Self::end_tick).
    pub(super) fn begin_tick(&mut self) {
        with_voice!(&mut self.voice, voice => {
            let drive = self.player.tick(&self.model, voice);
            voice.begin(&drive);
        });
    }

    /// The voice, if a lane of a choir may play it: double precision has no lanes.
    pub(super) fn single_voice(&mut self) -> Option<&mut Voice<f32>> {
        match &mut self.voice {
            AnyVoice::Single(voice) => Some(voice),
            AnyVoice::Double(_) => None,
        }
    }

    /// The voice's part of a tick that has begun.
    pub(super) fn run_alone(&mut self) {
        with_voice!(&mut self.voice, voice => voice.run());
    }

    /// Ends a tick that has been run.
    pub(super) fn end_tick(&mut self) {
        with_voice!(&mut self.voice, voice => voice.end());
        self.hear(&mut None);
    }

    /// What comes after a tick of the voice: what was heard goes on its way.
    fn hear(&mut self, probe: &mut Option<&mut dyn FnMut(Probe)>) {
        let speed = self.player.speed();
        with_voice!(&mut self.voice, voice => {
            let (left, right) = voice.heard();
            let right = right.filter(|_| self.stereo);
            let breathed = self.player.inhaled().map(|breath| {
                let with_breath = |channel: &[f32; TICK]| std::array::from_fn(|n| channel[n] + breath[n]);
                (with_breath(left), right.map(with_breath))
            });
            let (left, right) = match &breathed {
                Some((left, right)) => (left, right.as_ref()),
                None => (left, right),
            };
            if right.is_some() {
                if self.apart == 0 {
                    self.right.follow(&self.resampler);
                }
                self.apart = (self.resampler.reach() / TICK) as u32 + 2;
            }
            if self.apart > 0 {
                self.right.push(right.unwrap_or(left), speed);
                self.apart -= 1;
            }
            self.resampler.push(left, speed);
            if let Some(probes) = voice.probes() {
                if let Some(probe) = probe.as_mut() {
                    probes.iter().for_each(|&moment| probe(moment));
                }
                if self.scope_on && self.scope.record(probes) {
                    voice.set_probing(probe.is_some());
                }
            } else if self.scope_on && self.scope.rest() {
                voice.set_probing(true);
            }
        });
    }

    /// From pascals to samples: level, limiter, and whether anything is heard.
    fn finish(&mut self, mut out: Channels) {
        self.level.apply(out.part(0..out.len()));
        let right = out.right().map_or(0.0, |right| sum(right));
        if !(sum(out.left) + right).is_finite() {
            out.each(|channel| channel.fill(0.0));
            with_voice!(&mut self.voice, voice => voice.silence());
            self.forget_sound();
            self.resets += 1;
            return;
        }
        // The loudest altissimo comes within 1 dB of full scale; the limiter acts only above that.
        match &mut out.right {
            None => self.limiter.process(out.left),
            Some(right) => self.limiter.process_two(out.left, right),
        }
        if self.choke.fade(out.part(0..out.len())) {
            self.cut();
        }
        let (silence, mut audible) = (self.silence(), false);
        // Where the sound begins or ends, subnormal numbers would slow whatever comes after; a zero keeps its sign.
        out.each(|channel| {
            let is_quiet = |sample: Option<&f32>| sample.is_some_and(|x| x.abs() <= silence);
            if is_quiet(channel.first()) || is_quiet(channel.last()) {
                channel.iter_mut().filter(|x| x.abs() < f32::MIN_POSITIVE).for_each(|x| *x *= 0.0);
            }
        });
        out.each(|channel| audible |= channel.iter().any(|sample| sample.abs() > silence));
        self.quiet = if audible || !self.player.is_resting() {
            0
        } else {
            self.quiet.saturating_add(out.len() as u32)
        };
    }

    /// Silences what has left the voice.
    fn forget_sound(&mut self) {
        self.resampler.reset();
        self.apart = 0;
        self.limiter.reset();
    }

    /// Takes away what is left of a choked note, in the bore and in the output filter. The fingers stay.
    fn cut(&mut self) {
        with_voice!(&mut self.voice, voice => voice.cut());
        self.player.end_choke();
        self.resampler.reset();
        self.apart = 0;
    }

    /// Silences and resets everything; settings stay. Real-time safe.
    pub fn reset(&mut self) {
        with_voice!(&mut self.voice, voice => self.player.reset(voice));
        self.forget_sound();
        self.level.reset();
        self.choke.reset();
        self.quiet = 0;
    }

    /// Delay of the output filter, host samples. Bends do not change it, except bends downwards beyond the room that the
    /// host's rate leaves (an octave at 48 kHz, none at 96 kHz): there it grows by the ratio of the bend.
    pub fn latency_samples(&self) -> u32 {
        self.resampler.latency_out_samples().round() as u32
    }

    /// Sample rate of the lattice without a bend, Hz: 96000, or 88200 for hosts of the 44.1 kHz family; twice that in
    /// [`Quality::High`](super::Quality::High).
    pub fn internal_rate_hz(&self) -> f64 {
        self.model.coeffs.rate_hz
    }

    /// The instrument that is played.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// True while no key sounds and nobody blows; the instrument may still ring.
    pub fn is_resting(&self) -> bool {
        self.player.is_resting()
    }

    /// True when the output is silent and the player rests: the host may stop calling.
    pub fn is_silent(&self) -> bool {
        self.quiet > self.silent_from
    }

    /// How often a state that was not finite had to be reset since the start.
    pub fn resets(&self) -> u64 {
        self.resets + with_voice!(&self.voice, voice => voice.resets())
    }

    /// Keeps the plain code path, see [`Lattice::without_avx2`](crate::bore::lattice::Lattice::without_avx2).
    #[doc(hidden)]
    pub fn without_avx2(mut self) -> Self {
        self.resampler = self.resampler.without_avx2();
        self.right = self.right.without_avx2();
        self.voice = match self.voice {
            AnyVoice::Single(voice) => AnyVoice::Single(Box::new(voice.without_avx2())),
            AnyVoice::Double(voice) => AnyVoice::Double(Box::new(voice.without_avx2())),
        };
        self
    }

    /// The voice inside, for tests that disturb it. Panics in double precision, that is at twice the live rate.
    #[doc(hidden)]
    pub fn voice_mut(&mut self) -> &mut Voice<f32> {
        match &mut self.voice {
            AnyVoice::Single(voice) => voice,
            // PANIC: for tests, which ask for no other rate.
            AnyVoice::Double(_) => unreachable!("single precision at live rates only"),
        }
    }
}
