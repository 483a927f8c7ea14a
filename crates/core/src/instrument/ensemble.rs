//! Several players of one instrument, each with a voice of its own, and their sum.
//!
//! Every player gets the events that are for it, and no other. So a player in an ensemble gives the samples that it gives
//! alone, to the bit, and voice, player and events stay apart. The players differ as [`Person`]s do; in unison each is late
//! in its own way, see [`lateness`]. They sit side by
//! side: each is panned with constant power, in addition to the pan of its events; from two places each is heard from its
//! [`Chair`].
//!
//! With `n` players each is `1 / sqrt(n)` as loud as a lone one, whatever they play: all of them at once are about as loud as
//! one. A limiter after the sum catches what comes together by chance. One player alone is a [`Clarinet`] to the bit.
//!
//! A player who is silent and at rest sleeps: nothing of it is computed, and it stands still until a note, a slap or a
//! breath wakes it. Those who are awake play side by side, see [`Choir`](super::voice::choir::Choir). Whether it sleeps is decided on a fixed grid of samples, never on the host's blocks.

mod lateness;
pub(super) mod section;

use std::sync::Arc;

use crate::dsp::glide::Glide;
use crate::dsp::lanes::any_above;
use crate::dsp::limiter::Limiter;
use crate::event::{Event, PartEvent, SettingNumber, Timed, To};
use crate::instrument::channels::Channels;
use crate::instrument::clarinet::{Clarinet, Progress, QUIET_S};
use crate::instrument::listening::ListeningMode;
use crate::instrument::model::{BuildError, Model};
use crate::instrument::person::Person;
use crate::instrument::players::{MOST_PLAYERS, Players, Split};
use crate::instrument::settings::Settings;
use crate::instrument::stage::Chair;
use crate::instrument::stereo::gains;
use crate::units::{clamped_or, nearest_rate_hz};
use lateness::Lateness;
use section::Section;

/// Samples of the host between two decisions whether a player sleeps.
const CELL: usize = 64;
/// Time that a change of seat, pan or number takes, s.
const MOVE_S: f64 = 0.010;

/// One player at its seat.
struct Seat {
    clarinet: Clarinet,
    lateness: Lateness,
    /// Gains of left and right.
    sides: [Glide; 2],
    /// Pan of the player's events, -1..=1.
    pan: f32,
    /// Samples since the last decision about sleep.
    at: usize,
    /// Whether any of them is heard.
    is_heard: bool,
    /// Cells of silence and rest until now, and how many send it to sleep.
    quiet: u32,
    sleeps_from: u32,
    sleeps: bool,
    /// A lone player does not sleep: its host stops calling.
    may_sleep: bool,
    /// What it plays in a cell, left and right.
    sound: [[f32; CELL]; 2],
}

impl Seat {
    fn new(clarinet: Clarinet, rate_hz: f64, number: u8) -> Self {
        Self {
            clarinet,
            lateness: Lateness::new(|lone| Person::new(number).seed(lone)),
            sides: [Glide::new(1.0, MOVE_S, rate_hz); 2],
            pan: 0.0,
            at: 0,
            is_heard: false,
            quiet: 0,
            sleeps_from: (QUIET_S * rate_hz / CELL as f64).ceil() as u32,
            sleeps: true,
            may_sleep: true,
            sound: [[0.0; CELL]; 2],
        }
    }

    /// Goes to a seat between left and right, from which its pan moves it; who sleeps is there at once.
    fn sit(&mut self, seat: f32, pan: f32) {
        let chair = Chair::new(seat);
        self.clarinet.sit(chair);
        let listening = self.clarinet.settings().listening;
        let sides = if listening.mode == ListeningMode::Position {
            let ([left, right], [left_pan, right_pan]) = (chair.gains(&listening), gains(pan));
            [left * left_pan, right * right_pan]
        } else {
            gains((seat + pan).clamp(-1.0, 1.0))
        };
        for (side, gain) in self.sides.iter_mut().zip(sides) {
            if self.sleeps { side.set(gain) } else { side.go_to(gain) }
        }
    }

    fn set_settings(&mut self, settings: &Settings) {
        self.clarinet.set_settings(settings);
        if self.sleeps {
            // Otherwise the next note would begin as loud as before, and go to the new level meanwhile.
            self.clarinet.settle_level();
        }
    }

    fn apply(&mut self, event: Event) {
        self.clarinet.apply(event);
        if self.sleeps && matches!(event, Event::Choke { .. }) {
            // The key comes up; a fade that waited for the next note would cut that one.
            self.clarinet.forget_choke();
        }
        let begins = matches!(event, Event::NoteOn { .. } | Event::TongueSlap { .. });
        if self.sleeps && (begins || !self.clarinet.is_resting()) {
            self.wake();
        }
    }

    /// Takes an event now, or up to so many samples later if it is a note or comes with one: a bend that overtook its note would bend
    /// the note before.
    fn apply_late(&mut self, event: Event, most: f64) {
        let now = match event {
            Event::NoteOn { .. }
            | Event::NoteOff { .. }
            | Event::TongueSlap { .. }
            | Event::Bend { .. }
            | Event::Fingerings(_)
            | Event::TryHoles(_)
            | Event::Hole { .. } => self.lateness.take(event, most),
            Event::Panic => {
                self.drop_keys();
                Some(event)
            }
            // What is cut has begun.
            Event::Choke { .. } => {
                while let Some(event) = self.lateness.next() {
                    self.apply(event);
                }
                Some(event)
            }
            _ => Some(event),
        };
        if let Some(event) = now {
            self.apply(event);
        }
    }

    /// Takes what is due.
    fn apply_due(&mut self) {
        while let Some(event) = self.lateness.due() {
            self.apply(event);
        }
    }

    /// No key goes down or comes up that waited. What a wheel or a key switch has said stays, in every player.
    fn drop_keys(&mut self) {
        while let Some(event) = self.lateness.next() {
            if !is_of_key(event) {
                self.apply(event);
            }
        }
    }

    /// All keys come up, and none goes down that waited.
    fn let_go(&mut self) {
        self.drop_keys();
        self.clarinet.let_go();
    }

    fn wake(&mut self) {
        (self.sleeps, self.quiet, self.is_heard) = (false, 0, false);
    }

    /// Samples until the next decision about sleep, or the next event that is late.
    fn reach(&self) -> usize {
        self.lateness.reach().min(CELL - self.at)
    }

    /// Where so many samples of one or two channels go, and who plays them.
    fn playing(&mut self, samples: usize, is_stereo: bool) -> (Channels<'_>, &mut Clarinet) {
        let [left, right] = &mut self.sound;
        let (left, right) = (&mut left[..samples], &mut right[..samples]);
        let own = if is_stereo { Channels::two(left, right) } else { Channels::one(left) };
        (own, &mut self.clarinet)
    }

    /// Fills so many samples as far as they can be; whether a tick is needed before it goes on.
    fn advance(&mut self, samples: usize, is_stereo: bool, progress: &mut Progress) -> bool {
        let (mut own, clarinet) = self.playing(samples, is_stereo);
        clarinet.advance(&mut own, progress)
    }

    /// So many samples have passed, [`reach`](Self::reach) at most: decides about sleep.
    fn pass(&mut self, samples: usize, is_stereo: bool) {
        if !self.sleeps {
            let (mut own, clarinet) = self.playing(samples, is_stereo);
            let (silence, mut is_heard) = (clarinet.silence(), false);
            own.each(|channel| is_heard |= any_above(channel, silence));
            self.is_heard |= is_heard;
        }
        self.lateness.pass(samples);
        self.at += samples;
        if self.at == CELL {
            self.at = 0;
            let is_quiet = !std::mem::take(&mut self.is_heard) && self.clarinet.is_resting();
            self.quiet = if is_quiet { self.quiet.saturating_add(1) } else { 0 };
            self.sleeps |= self.may_sleep && self.quiet >= self.sleeps_from;
        }
    }

    fn is_silent(&self) -> bool {
        self.lateness.is_empty() && (self.sleeps || self.clarinet.is_silent())
    }

    fn is_resting(&self) -> bool {
        self.lateness.is_empty() && (self.sleeps || self.clarinet.is_resting())
    }

    fn reset(&mut self) {
        self.clarinet.reset();
        self.lateness.reset();
        (self.pan, self.is_heard, self.quiet) = (0.0, false, 0);
        self.sleeps = self.may_sleep;
    }
}

/// Whether a key or a tongue makes the event.
fn is_of_key(event: Event) -> bool {
    matches!(event, Event::NoteOn { .. } | Event::NoteOff { .. } | Event::TongueSlap { .. })
}

/// Adds a player's samples to the sum; the first one's take its place, so that a zero keeps its sign.
fn add(sum: &mut [f32], own: &[f32], gain: &[f32], side: &mut Glide, is_first: bool) {
    if side.reach() < usize::MAX {
        return add_with(sum, own, gain, || side.next(), is_first);
    }
    // At rest it is the same for all samples.
    let side = side.next();
    add_with(sum, own, gain, || side, is_first);
}

#[inline(always)]
fn add_with(sum: &mut [f32], own: &[f32], gain: &[f32], mut side: impl FnMut() -> f32, is_first: bool) {
    for ((sum, own), gain) in sum.iter_mut().zip(own).zip(gain) {
        let own = own * (gain * side());
        *sum = if is_first { own } else { *sum + own };
    }
}

/// One or more players of one instrument: events in, samples out.
///
/// ```
/// use chalumeau_core::event::{Event, PartEvent, To};
/// use chalumeau_core::instrument::{Ensemble, Players, Settings};
/// use chalumeau_core::units::SoundingNote;
///
/// let mut duet = Ensemble::built_in(48_000.0)?;
/// let players = Players { count: 2, ..Players::default() };
/// duet.set_settings(&Settings { players, ..Settings::default() });
/// for (player, key) in [(0, 60), (1, 64)] {
///     let event = Event::NoteOn { note: SoundingNote(key), velocity: 0.8 };
///     duet.apply(PartEvent { to: To::Player(player), event });
/// }
/// let mut samples = vec![0.0; 4_800];
/// duet.render(&mut samples);
/// assert!(samples.iter().any(|sample| sample.abs() > 0.01));
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
pub struct Ensemble {
    /// All there can be, so that a change of their number allocates nothing.
    seats: Vec<Seat>,
    rate_hz: f64,
    players: Players,
    /// Loudness of each.
    gain: Glide,
    limiter: Limiter,
    section: Section,
}

impl Ensemble {
    /// The built-in B flat clarinet at a host rate in Hz, 1000..=1536000, with one player. Allocates.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the host rate is out of range.
    pub fn built_in(host_rate_hz: f64) -> Result<Self, BuildError> {
        Ok(Self::new(Arc::new(Model::built_in(host_rate_hz)?), host_rate_hz))
    }

    /// Any instrument, from a model that was prepared for this host rate, Hz, with one player; rates are taken as in
    /// [`Clarinet::new`]. Allocates the voices of all players that there can be.
    pub fn new(model: Arc<Model>, host_rate_hz: f64) -> Self {
        let host_rate_hz = nearest_rate_hz(host_rate_hz);
        let mut clarinets = vec![Clarinet::new(model, host_rate_hz)];
        for number in 1..MOST_PLAYERS as u8 {
            clarinets.push(clarinets[0].beside(host_rate_hz, number));
        }
        let section = Section::new(clarinets[0].model());
        let mut ensemble = Self {
            seats: (0..)
                .zip(clarinets)
                .map(|(number, clarinet)| Seat::new(clarinet, host_rate_hz, number))
                .collect(),
            rate_hz: host_rate_hz,
            players: Players::default(),
            gain: Glide::new(1.0, MOVE_S, host_rate_hz),
            limiter: Limiter::new(host_rate_hz),
            section,
        };
        ensemble.arrange();
        ensemble
    }

    /// See [`Clarinet::without_avx2`].
    #[doc(hidden)]
    pub fn without_avx2(mut self) -> Self {
        let plain = |seat: Seat| Seat { clarinet: seat.clarinet.without_avx2(), ..seat };
        self.seats = self.seats.into_iter().map(plain).collect();
        self.section = self.section.without_avx2(self.seats[0].clarinet.model());
        self
    }

    fn count(&self) -> usize {
        self.players.number()
    }

    /// Takes new settings, clamped to their ranges. Players who go stop and fade; players who come play from the next note on.
    /// Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        let players = settings.players.clamped();
        let before = std::mem::replace(&mut self.players, players);
        let listening = self.seats[0].clarinet.settings().listening;
        for seat in &mut self.seats[..players.number()] {
            seat.set_settings(settings);
        }
        if before == players {
            if listening != self.seats[0].clarinet.settings().listening {
                self.arrange();
            }
            return;
        }
        let stay = if before.split == players.split { before.number().min(players.number()) } else { 1 };
        let (first, others) = self.seats.split_at_mut(stay);
        for seat in others {
            seat.let_go();
            seat.clarinet.follow(&first[0].clarinet);
            seat.pan = first[0].pan;
        }
        self.arrange();
    }

    /// Everybody goes to the seat and the loudness that the number of players asks for.
    fn arrange(&mut self) {
        let (count, width) = (self.count(), self.players.width);
        self.gain.go_to(1.0 / (count as f32).sqrt());
        for (number, seat) in self.seats.iter_mut().enumerate() {
            seat.may_sleep = count > 1 || number > 0;
            if !seat.may_sleep && seat.sleeps {
                seat.wake();
            }
            // The pan of a lone player belongs to who calls.
            let pan = if count > 1 { seat.pan } else { 0.0 };
            seat.sit(Person::seat(number, count, width), pan);
        }
    }

    /// A number of the settings of one player, or of all.
    fn set_number(&mut self, number: SettingNumber, value: f32, player: Option<usize>) {
        let (count, before) = (self.count(), (self.players, self.seats[0].clarinet.settings().listening));
        for (_, seat) in self.seats[..count]
            .iter_mut()
            .enumerate()
            .filter(|(at, _)| player.is_none_or(|player| player == *at))
        {
            let mut settings = *seat.clarinet.settings();
            *settings.number(number) = value;
            seat.set_settings(&settings);
        }
        // The number of players and what they do with the notes are no such numbers: only seats and places can have moved.
        let settings = self.seats[0].clarinet.settings();
        self.players = settings.players;
        if before != (settings.players, settings.listening) {
            self.arrange();
        }
    }

    /// Handles an event now. Events for a player who does not play are ignored; in unison all play every event. Real-time
    /// safe.
    pub fn apply(&mut self, PartEvent { to, event }: PartEvent) {
        let all = to == To::All || self.players.split == Split::Unison;
        let (count, width) = (self.count(), self.players.width);
        if let Event::Set(number, value) = event {
            let player = match to {
                To::Player(player) if !all && number.is_of_player() => Some(usize::from(player)),
                _ => None,
            };
            return self.set_number(number, value, player);
        }
        // The first one is in time for the hands that play.
        let late = |number: usize| match self.players.split {
            Split::Unison if number > 0 => 1e-3 * f64::from(self.players.onset_spread_ms) * self.rate_hz,
            _ => 0.0,
        };
        for (number, seat) in self.seats.iter_mut().enumerate() {
            let is_meant = match number < count {
                true => all || to == To::Player(number as u8),
                // Who has gone and still sounds is to be silenced too.
                false => event == Event::Panic && !seat.sleeps,
            };
            if !is_meant {
                continue;
            }
            seat.apply_late(event, late(number));
            if let Event::Pan { position } = event {
                seat.pan = clamped_or(position, -1.0, 1.0, 0.0);
                if count > 1 {
                    seat.sit(Person::seat(number, count, width), seat.pan);
                }
            }
        }
    }

    /// Takes over keys, breath, bend and what single players have set from another ensemble, which this new one with the same
    /// settings replaces. Real-time safe.
    pub fn carry_on(&mut self, from: &Self) {
        let count = self.count();
        for (number, (seat, before)) in self.seats.iter_mut().zip(&from.seats).enumerate() {
            if number < count {
                seat.clarinet.set_settings(before.clarinet.settings());
            }
            seat.clarinet.carry_on(&before.clarinet);
            seat.lateness.carry_on(&before.lateness);
            (seat.pan, seat.sides) = (before.pan, before.sides);
            if !before.sleeps {
                seat.wake();
            }
        }
        self.gain = from.gain;
    }

    /// Overwrites `out` with the next samples, mono: without seats. Real-time safe.
    pub fn render(&mut self, out: &mut [f32]) {
        self.render_channels(Channels::one(out));
    }

    /// Overwrites one or two channels with the next samples. Real-time safe.
    pub fn render_channels(&mut self, mut out: Channels) {
        if self.is_alone() {
            self.section.arrange(&mut self.seats);
            // Who joins later finds the same cells, however the host cuts its blocks.
            let at = (self.seats[0].at + out.len()) % CELL;
            self.seats.iter_mut().for_each(|seat| seat.at = at);
            return self.seats[0].clarinet.render_channels(out);
        }
        let (mut begin, samples) = (0, out.len());
        while begin < samples {
            self.seats.iter_mut().for_each(Seat::apply_due);
            let reach = self.seats.iter().map(Seat::reach).min().unwrap_or(CELL);
            let end = samples.min(begin + reach);
            self.mix(out.part(begin..end));
            begin = end;
        }
    }

    /// Renders one block with its events, which must be in order of time. An event at or after the end of the block is
    /// applied at its end. Real-time safe.
    pub fn render_events_channels(
        &mut self,
        events: impl IntoIterator<Item = Timed<PartEvent>>,
        out: Channels,
    ) {
        out.cut_at(events, self, Self::render_channels, Self::apply);
    }

    /// Whether the first player is heard as it is, and nobody else.
    fn is_alone(&self) -> bool {
        let is_lone = self.count() == 1 && self.seats[1..].iter().all(|seat| seat.sleeps);
        is_lone && self.gain.rests_at(1.0) && self.seats[0].sides.iter().all(|side| side.rests_at(1.0))
    }

    /// The sum of all players, of one cell at most.
    fn mix(&mut self, mut out: Channels) {
        let (samples, is_stereo) = (out.len(), out.is_stereo());
        let mut gain = [0.0; CELL];
        let gain = &mut gain[..samples];
        gain.iter_mut().for_each(|gain| *gain = self.gain.next());
        self.play(samples, is_stereo);
        let mut is_first = true;
        for seat in &mut self.seats {
            let is_awake = !seat.sleeps;
            seat.pass(samples, is_stereo);
            if !is_awake {
                continue;
            }
            let [left, right] = &seat.sound;
            let [left_side, right_side] = &mut seat.sides;
            if let Some(sum) = out.right() {
                add(sum, right, gain, right_side, is_first);
                add(out.left(), left, gain, left_side, is_first);
            } else {
                // Without two channels there are no sides; they move on all the same.
                for side in [left_side, right_side] {
                    if side.reach() < usize::MAX {
                        (0..samples).for_each(|_| _ = side.next());
                    }
                }
                add_with(out.left(), left, gain, || 1.0, is_first);
            }
            is_first = false;
        }
        if is_first {
            out.each(|channel| channel.fill(0.0));
        }
        match &mut out.right {
            None => self.limiter.process(out.left),
            Some(right) => self.limiter.process_two(out.left, right),
        }
    }

    /// All who are awake play so many samples, each into its own.
    fn play(&mut self, samples: usize, is_stereo: bool) {
        self.section.arrange(&mut self.seats);
        let mut progress = [Progress::default(); MOST_PLAYERS];
        let mut playing: u32 =
            (0..).zip(&self.seats).map(|(number, seat)| u32::from(!seat.sleeps) << number).sum();
        loop {
            let mut waiting = 0;
            for (number, (seat, progress)) in self.seats.iter_mut().zip(&mut progress).enumerate() {
                if playing >> number & 1 == 1 && seat.advance(samples, is_stereo, progress) {
                    waiting |= 1 << number;
                }
            }
            if waiting == 0 {
                return;
            }
            self.section.tick(&mut self.seats, waiting);
            playing = waiting;
        }
    }

    /// Silences and resets everything; settings stay. Real-time safe.
    pub fn reset(&mut self) {
        self.seats.iter_mut().for_each(Seat::reset);
        self.limiter.reset();
        self.arrange();
        self.gain.set(self.gain.target());
        for seat in &mut self.seats {
            seat.sides.iter_mut().for_each(|side| side.set(side.target()));
            seat.at = 0;
        }
    }

    /// The first player: what a window shows, and whose inside a scope sees.
    pub fn first(&self) -> &Clarinet {
        &self.seats[0].clarinet
    }

    /// See [`Clarinet::set_scope_on`], of the first player.
    pub fn set_scope_on(&mut self, on: bool) {
        self.seats[0].clarinet.set_scope_on(on);
    }

    /// Whether one player is all there is: then who calls pans.
    pub fn is_lone(&self) -> bool {
        self.count() == 1
    }

    /// Pan of the first player's events, -1 left..=1 right.
    pub fn pan(&self) -> f32 {
        self.seats[0].pan
    }

    /// Whether players who can be heard finger different notes.
    pub fn plays_chord(&self) -> bool {
        // In unison, those who are late finger the note before.
        if self.players.split == Split::Unison {
            return false;
        }
        let heard = self.seats.iter().filter(|seat| !seat.is_silent());
        let mut notes = heard.map(|seat| seat.clarinet.player_state().fingering);
        notes.next().is_some_and(|first| notes.any(|note| note != first))
    }

    /// Whether one player is silent and at rest. In unison all are, for every player.
    pub fn is_silent_player(&self, number: usize) -> bool {
        match self.players.split {
            Split::Unison => self.is_silent(),
            Split::Chords => self.seats.get(number).is_none_or(Seat::is_silent),
        }
    }

    /// True while no key sounds and nobody blows; the instruments may still ring.
    pub fn is_resting(&self) -> bool {
        self.seats.iter().all(Seat::is_resting)
    }

    /// True when the output is silent and all players rest: the host may stop calling.
    pub fn is_silent(&self) -> bool {
        self.seats.iter().all(Seat::is_silent)
    }

    /// Players who are awake: those that cost time.
    pub fn awake(&self) -> usize {
        self.seats.iter().filter(|seat| !seat.sleeps).count()
    }

    /// How often a state that was not finite had to be reset since the start.
    pub fn resets(&self) -> u64 {
        self.seats.iter().map(|seat| seat.clarinet.resets()).sum()
    }
}

#[cfg(test)]
mod tests;
