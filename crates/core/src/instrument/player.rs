//! The player: turns notes, breath and settings into holes, lip, tongue and mouth pressure, tick by tick.
//!
//! `breath` follows a breath source or key velocity, and [`response`] makes a mouth pressure of it: directly, or by the rule in
//! [`dynamics`] that moves breath and lip together; there the [`ear`] pushes what is too soft. `tongue` articulates: overlapping
//! notes are slurred (the holes move and the tongue stays away); after a gap the tongue holds the reed while the breath rises
//! behind it, and lets go. `fingers` moves the holes, `tuning` the pitch, and `posture` holds what settings, fingering and bend
//! ask for. `life` and [`vibrato`] sway all of it, `attack` shapes how a note begins, `slur` helps difficult ones, `inflection`
//! scoops and falls, and `inhalation` is the breath in after a phrase.
//!
//! `technique` growls, flutters and covers the reed, `voicing` moves the vocal tract, `glissando` slides the fingers, and
//! `level_keeper` blows so that the level stays where they lead. `known` keeps what follows from numbers that rest.

mod attack;
mod breath;
mod carry_on;
pub mod dynamics;
pub mod ear;
mod fingers;
pub(crate) mod fitted;
mod glissando;
mod inflection;
mod inhalation;
mod known;
mod level_keeper;
mod life;
mod lip_glide;
mod other_reed;
mod pitch_ear;
mod posture;
mod push;
mod reed_at_note;
mod reed_glide;
mod reed_smoothing;
pub mod response;
mod retongued;
mod slur;
mod sway;
mod technique;
mod tongue;
mod tuning;
mod velocities;
pub mod vibrato;
mod voicing;

use crate::bore::lattice::Real;
use crate::control::keys::Keys;
use crate::event::{Event, Fingerings};
use crate::instrument::bend;
use crate::instrument::breath_noise::Jet;
use crate::instrument::model::Model;
use crate::instrument::person::Person;
use crate::instrument::settings::{BreathResponse, Settings};
use crate::instrument::voice::{Drive, TICK, Voice};
use crate::maths;
use crate::reed::physical::P_REF_PA;
use crate::units::{SoundingNote, cents, clamped_or};
pub use attack::Attack;
use attack::Onset;
use breath::Breath;
use dynamics::LipShape;
use ear::{Begun, Ear};
use fingers::Fingers;
use glissando::Slide;
use inflection::Inflection;
use inhalation::Inhalation;
use level_keeper::{Led, LevelKeeper};
use lip_glide::LipGlide;
use posture::{Fingered, Lags, Posture};
use push::Pushing;
use reed_glide::ReedGlide;
use reed_smoothing::ReedSmoothing;
use response::{Bodily, Response};
use slur::Slur;
use sway::Swaying;
use technique::PlayedTechniques;
use tongue::Tongue;
use tuning::PlayedTuning;
use velocities::Velocities;
use voicing::{Voiced, Voicing};

/// Time the fingers take behind the tongue, periods of the lowest note: 5 ms on a B flat clarinet, 13 on a bass, whose keys are heavier
/// (by judgement). Slurred they take the setting's time.
const TONGUED_FINGERS_PERIODS: f64 = 0.75;

/// What the parts of a player need to know in one control tick.
struct TickContext<'a> {
    /// Length of the tick, s.
    tick_s: f64,
    settings: &'a Settings,
    posture: &'a Posture,
}

/// Share of the way that a first-order lag with the time constant `time_s` covers in `tick_s`, 0..1.
fn step_towards(tick_s: f64, time_s: f64) -> f64 {
    1.0 - maths::exp(-tick_s / time_s)
}

/// Mean square of what was heard in the last tick, Pa^2; of two channels the mean.
fn heard_power<F: Real>(voice: &Voice<F>) -> f64 {
    let power = |channel: &[f32; TICK]| {
        channel.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>() / TICK as f64
    };
    let (left, right) = voice.heard();
    right.map_or(power(left), |right| 0.5 * (power(left) + power(right)))
}

/// What the player does now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerState {
    /// The key that is held, if any.
    pub key: Option<SoundingNote>,
    /// The note that it plays.
    pub sounding: Option<SoundingNote>,
    /// Index of the fingering in place.
    pub fingering: usize,
    /// Mouth pressure, kPa.
    pub mouth_kpa: f32,
    /// How a player's lip shapes the reed; `None` where the breath is physical.
    pub lip: Option<LipShape>,
    /// The dynamic that is played, 0 (pianissimo) to 1 (fortissimo); `None` where the breath is physical or before the first note.
    pub dynamic: Option<f32>,
    /// The fingerings that a key switch has chosen, if one has.
    pub chosen: Option<Fingerings>,
}

/// One player of one instrument.
#[derive(Clone, Debug, Default)]
pub struct Player {
    person: Person,
    settings: Settings,
    /// The same with the reed on its way and under its controllers, as of when `posture` was worked out.
    now: Settings,
    /// `None` until the next tick works it out.
    posture: Option<Posture>,
    /// Closing pressure of the reed in the last tick, over the reference.
    closing: f64,
    keys: Keys,
    velocities: Velocities,
    breath: Breath,
    response: Response,
    ear: Ear,
    tongue: Tongue,
    fingers: Fingers,
    /// What a key switch has chosen; `None` leaves it to the settings.
    chosen: Option<Fingerings>,
    tuning: PlayedTuning,
    reed: ReedSmoothing,
    glide: ReedGlide,
    techniques: PlayedTechniques,
    voicing: Voicing,
    slide: Option<Slide>,
    keeper: LevelKeeper,
    bend_cents: f64,
    /// Pitch of the key over that of its note, cents.
    key_cents: f64,
    /// How far the note that was fingered last lies from the pitch of its fingering in the chart, cents: by its key and its alternate.
    fingered_cents: f64,
    lip_glide: LipGlide,
    pushing: Pushing,
    onset: Onset,
    swaying: Swaying,
    inflection: Inflection,
    inhalation: Inhalation,
    /// The reed was changed while nothing sounded: it must not move, which would be heard.
    has_other_reed: bool,
}

impl Player {
    /// One of several players, at rest.
    pub fn new(person: Person) -> Self {
        Self {
            person,
            closing: 1.0,
            swaying: Swaying::of(&person),
            techniques: PlayedTechniques::of(&person),
            // The voice at its beginning knows the reference reed alone.
            has_other_reed: true,
            ..Self::default()
        }
    }

    /// Takes new settings, clamped to their ranges; they are heard from the next tick on. A sounding reed glides to them.
    /// Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        let settings = settings.clamped();
        if settings != self.settings {
            if self.is_idle() {
                self.glide.settle();
                self.has_other_reed = true;
            } else {
                // A lip that a player has shaped is where another way of blowing begins.
                let is_other = settings.breath_response != self.settings.breath_response;
                let lip = self.posture.as_ref().and_then(Posture::lip).filter(|_| is_other);
                self.glide.begin(&self.settings.under_lip(lip), &settings);
            }
            // What has been chosen last counts.
            let is_chosen_anew = settings.alternates != self.settings.alternates;
            let is_other_row = settings.reach.key_switches != self.settings.reach.key_switches;
            if is_chosen_anew || is_other_row {
                self.chosen = None;
            }
            self.settings = settings;
            self.posture = None;
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The key that sounds, if one is held.
    pub fn key(&self) -> Option<SoundingNote> {
        self.keys.last()
    }

    /// Speed of the instrument's clock at the end of the last tick; 1 is the model's rate.
    pub fn speed(&self) -> f64 {
        self.tuning.speed()
    }

    /// Length of a control tick, s.
    fn tick_s(&self, model: &Model) -> f64 {
        TICK as f64 / (model.coeffs.rate_hz * self.tuning.speed())
    }

    /// Held note, fingering and mouth pressure now.
    pub fn state(&self, model: &Model) -> PlayerState {
        let (key, fingering) = (self.keys.last(), self.fingers.fingering().unwrap_or(0));
        let written = model.file.fingerings.get(fingering).map(|fingering| fingering.written);
        PlayerState {
            key,
            sounding: key.and(written).and_then(|written| written.sounding(model.file.transposition)),
            fingering,
            mouth_kpa: (1e-3 * P_REF_PA * self.closing * self.breath.gamma()) as f32,
            lip: self.posture.as_ref().and_then(Posture::lip),
            dynamic: self.response.dynamic().map(|dynamic| dynamic as f32),
            chosen: self.chosen,
        }
    }

    /// Puts player, reed and bore back to the beginning; settings stay. The one way to end everything: a player who forgot
    /// while the bore went on would leave fingers under way. Real-time safe.
    pub fn reset<F: Real>(&mut self, voice: &mut Voice<F>) {
        *self = Self { settings: self.settings, ..Self::new(self.person) };
        voice.reset();
    }

    /// Handles an event. Numbers out of range are clamped. Real-time safe.
    pub fn apply<F: Real>(&mut self, event: Event, model: &Model, voice: &mut Voice<F>) {
        match event {
            Event::NoteOn { note, velocity } => self.note_on(note, velocity, model, voice),
            Event::NoteOff { note } => self.note_off(note, model, voice),
            Event::Choke { note } => self.choke(note, model, voice),
            Event::Breath(level) => self.breath.set_level(level, &self.settings),
            Event::KeyPressure(pressure) => self.breath.press(pressure),
            Event::BreathFromKeys => self.breath.forget_source(),
            Event::Bend { cents } => {
                let most = bend::MOST_CENTS as f32;
                self.bend_cents = f64::from(clamped_or(cents, -most, most, 0.0));
                self.posture = None;
            }
            Event::Reed { h, k } => self.reed.set(h, k),
            Event::Vibrato(depth) => self.swaying.swing.set_controller(depth),
            Event::TongueSlap { strength } => self.tongue_slap(strength, model, voice),
            Event::TryHoles(tried) => {
                self.fingers.try_holes(tried);
                if let Some(fingering) = self.fingers.fingering() {
                    self.move_holes(fingering, 1e-3 * f64::from(self.settings.legato_ms), model, voice);
                }
            }
            Event::Hole { hole, opening } => {
                let ticks = self.legato_ticks(model);
                self.fingers.hold_hole(usize::from(hole), opening, ticks, model, voice.lattice_mut());
            }
            Event::Technique { which, amount } => self.techniques.set(which, amount),
            Event::Fingerings(chosen) => self.chosen = Some(chosen),
            // They act after the instrument; settings are set from outside.
            Event::Volume { .. } | Event::Pan { .. } | Event::Set(..) => {}
            Event::Panic => {
                let silenced = self.silenced();
                self.reset(voice);
                *self = silenced;
            }
        }
    }

    /// The fingering that a key plays; its pitch is that of the key from now on.
    fn take_up(&mut self, key: SoundingNote, model: &Model) -> Option<usize> {
        let find = |note| model.fingering_for(note);
        let (pitch, fingering) = self.settings.reach.find(key, &model.keys, find)?;
        self.key_cents = pitch.cents;
        Some(fingering)
    }

    /// The fingering of the key that sounds now. Held keys that have lost theirs, by another transposition or row of key switches, are
    /// released: under them the tongue would stay on the reed of the next note. Real-time safe.
    fn take_up_last(&mut self, model: &Model) -> Option<usize> {
        while let Some(last) = self.keys.last() {
            match self.take_up(last, model) {
                None => self.keys.release(last),
                fingering => {
                    self.breath.set_velocity(self.velocities.of(last));
                    return fingering;
                }
            }
        }
        None
    }

    fn note_on<F: Real>(&mut self, note: SoundingNote, velocity: f32, model: &Model, voice: &mut Voice<F>) {
        // Who plays without a decoder has the key switches too.
        if let Some(chosen) = self.settings.reach.key_switches.chosen(note.0) {
            self.chosen = Some(chosen);
            return;
        }
        // A note that the instrument does not have is ignored.
        let Some(fingering) = self.take_up(note, model) else { return };
        let slurred = !self.keys.is_empty();
        self.keys.press(note);
        self.velocities.strike(note, velocity);
        self.breath.set_velocity(velocity);
        if !slurred {
            self.prepare(fingering, model);
            self.swaying.swing.begin_note();
        }
        self.finger(fingering, slurred, model, voice);
        let slap = self.settings.articulation.slap;
        if !slurred && slap > 0.0 {
            self.tongue_slap(slap * velocity, model, voice);
        }
    }

    fn note_off<F: Real>(&mut self, note: SoundingNote, model: &Model, voice: &mut Voice<F>) {
        let sounding = self.keys.last() == Some(note);
        self.keys.release(note);
        if !sounding {
            return;
        }
        match self.take_up_last(model) {
            Some(fingering) => self.finger(fingering, true, model, voice),
            None => {
                let may_fall = !self.tongue.is_holding() && !self.tongue.is_slapping();
                if !(may_fall && self.inflection.fall(&self.settings.articulation, self.breath.gamma())) {
                    // Without breath there is nothing to play first.
                    if self.breath.is_at_rest() { self.tongue.land() } else { self.tongue.stop() }
                }
            }
        }
    }

    /// The tongue holds the reed before a note, and the lip makes ready for it.
    fn prepare(&mut self, fingering: usize, model: &Model) {
        let is_in_time =
            self.settings.breath_response == BreathResponse::Played && retongued::rings(self.ear.amplitude());
        self.tongue.hold(is_in_time);
        self.inflection.begin(&self.settings.articulation);
        let place = model.place(fingering);
        let high = attack::lip_help(place, model.notes_hz[fingering]);
        self.lip_glide.help(high.or_else(|| retongued::lip_help(self.ear.amplitude(), place)));
    }

    /// Whether a choke of this note silences something: it sounds, or no key is down and it may fade.
    pub fn is_heard(&self, note: SoundingNote) -> bool {
        self.keys.last().is_none_or(|last| last == note)
    }

    /// A key comes up and its note is about to be cut; the note held before it begins anew behind the tongue.
    fn choke<F: Real>(&mut self, note: SoundingNote, model: &Model, voice: &mut Voice<F>) {
        let sounding = self.keys.last() == Some(note);
        self.keys.release(note);
        if !sounding {
            return;
        }
        match self.take_up_last(model) {
            Some(fingering) => {
                self.prepare(fingering, model);
                self.finger(fingering, false, model, voice);
            }
            None => self.tongue.stop(),
        }
    }

    /// The choked note has been cut: the breath begins again from nothing, and the tongue is on the reed.
    pub fn end_choke(&mut self) {
        self.breath = self.breath.carried();
        self.inflection.cut();
        if self.keys.is_empty() || !self.tongue.is_holding() {
            self.tongue = Tongue::default();
        }
    }

    /// Slaps the fingering in place, or the first one before any note.
    fn tongue_slap<F: Real>(&mut self, strength: f32, model: &Model, voice: &mut Voice<F>) {
        let closing = self.posture.as_ref().map_or(1.0, |posture| posture.free_closing);
        let begun = self.tongue.slap(strength, closing, !self.keys.is_empty(), self.breath.gamma());
        if begun && self.fingers.fingering().is_none() {
            self.finger(0, false, model, voice);
        }
    }

    /// Moves the fingers to a note: slurred within the setting's time, behind the tongue quickly. A player's lip, or a dip of a
    /// machine's breath, helps difficult slurs.
    fn finger<F: Real>(&mut self, fingering: usize, slurred: bool, model: &Model, voice: &mut Voice<F>) {
        let glissando_s = f64::from(self.settings.glissando_s);
        let from = self.fingers.fingering().filter(|_| slurred);
        let alternate = match self.settings.fingerings(self.chosen) {
            Fingerings::Chart => None,
            Fingerings::Alternate(nth) => model.alternates.nth(fingering, nth),
            Fingerings::ByContext => {
                from.and_then(|from| model.alternates.taken(from, self.fingers.alternate(), fingering))
            }
        };
        let reached_cents = self.fingered_cents + self.slide.as_ref().map_or(0.0, Slide::beside_cents);
        self.fingered_cents = self.key_cents;
        if let Some(from) = from.filter(|_| glissando_s > 0.0)
            && self.slide_to(fingering, from, reached_cents, model, voice)
        {
            return;
        }
        self.slide = None;
        self.fingers.choose(alternate);
        let alternate = alternate.and_then(|at| model.alternates.get(at));
        self.fingered_cents += alternate.map_or(0.0, |alternate| alternate.cents);
        self.ear.begin(if slurred { Begun::Slurred } else { Begun::Tongued });
        if !slurred {
            self.pushing = Pushing::default();
            let ticks = (TONGUED_FINGERS_PERIODS / model.size_hz / self.tick_s(model)).round() as u32;
            return self.walk(fingering, ticks, slur::TONGUED, model, voice);
        }
        let legato_s = 1e-3 * f64::from(self.settings.legato_ms);
        let slur = self.fingers.fingering().map(|from| Slur {
            interval_cents: cents(model.notes_hz[fingering], model.notes_hz[from]),
            registers: (model.registers[from], model.registers[fingering]),
            place: model.place(fingering),
            note_hz: model.notes_hz[fingering],
            over_lowest: model.notes_hz[fingering] / model.size_hz,
            lay: f64::from(self.settings.lay),
            damping: f64::from(self.settings.damping),
        });
        match (slur, self.settings.breath_response) {
            (Some(slur), BreathResponse::Played) => {
                let gamma = self.breath.gamma();
                self.lip_glide.help(slur.lip_help(gamma));
                let (ticks, walk) = (self.legato_ticks(model), slur.walk(gamma));
                self.pushing.begin(slur.push(), walk.time * legato_s, slur.note_hz);
                if slur.is_within_a_register() {
                    self.ear.begin(Begun::SlurredWithin);
                }
                self.walk(fingering, ticks, walk, model, voice);
            }
            (slur, _) => {
                if let Some(Slur { interval_cents, registers: (from, to), .. }) = slur {
                    self.breath.slur(interval_cents, from, to);
                }
                self.move_holes(fingering, legato_s, model, voice);
            }
        }
    }

    /// Begins a slide from a fingering, or turns the one that is under way; false if there is no way to go. `reached_cents`: how
    /// far the pitch now lies beside that of the fingerings.
    #[inline(never)]
    fn slide_to<F: Real>(
        &mut self,
        to: usize,
        from: usize,
        reached_cents: f64,
        model: &Model,
        voice: &mut Voice<F>,
    ) -> bool {
        let length_s = f64::from(self.settings.glissando_s);
        let open = self.fingers.open_holes(model, voice.lattice_mut());
        let slide = match self.slide {
            Some(slide) => slide.turned_to(to, open, length_s, model),
            None if from == to && reached_cents == self.key_cents => return false,
            None => Slide::new(from, open, to, length_s, model),
        };
        let slide = slide.beginning_beside(reached_cents - self.key_cents);
        let settles = ((slide.finger_s() / self.tick_s(model)).round() as u32).max(self.legato_ticks(model));
        self.fingers.begin_slide(slide.fingers(), settles, model, voice.lattice_mut());
        self.fingers.aim(slide.lip(model));
        self.slide = Some(slide);
        self.posture = None;
        true
    }

    /// Control ticks that the fingers take between slurred notes.
    fn legato_ticks(&self, model: &Model) -> u32 {
        (1e-3 * f64::from(self.settings.legato_ms) / self.tick_s(model)).round() as u32
    }

    /// Moves the fingers one after another within `ticks` control ticks, as a walk has them.
    fn walk<F: Real>(
        &mut self,
        fingering: usize,
        ticks: u32,
        walk: slur::Walk,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        self.fingers.walk_to(fingering, ticks, walk, model, voice.lattice_mut());
        self.posture = None;
    }

    fn move_holes<F: Real>(&mut self, fingering: usize, time_s: f64, model: &Model, voice: &mut Voice<F>) {
        let ticks = (time_s / self.tick_s(model)).round() as u32;
        self.fingers.move_to(fingering, ticks, model, voice.lattice_mut());
        self.posture = None;
    }

    /// True while no slap sounds, the breath has gone and none is asked for, and none has to come in.
    pub fn is_resting(&self) -> bool {
        self.is_idle() && !self.inflection.is_falling() && !self.inhalation.is_due()
    }

    /// The same, whether the player breathes in or not.
    fn is_idle(&self) -> bool {
        !self.tongue.is_slapping()
            && self.breath.is_resting(holds_note(&self.keys, &self.inflection, &self.tongue))
    }

    /// The breath that comes in during this tick, Pa at 1 m, if any.
    pub fn inhaled(&self) -> Option<&[f32; TICK]> {
        self.inhalation.heard()
    }

    /// One tick of a glissando; what the vocal tract does for it. Apart, so that who does not slide pays nothing.
    #[inline(never)]
    fn slide_on<F: Real>(&mut self, tick_s: f64, model: &Model, voice: &mut Voice<F>) -> Option<Voiced> {
        let slide = self.slide.as_mut()?;
        self.fingers.slide(slide.fingers(), model, voice.lattice_mut());
        let bent = slide.tract();
        let lip = slide.lip(model);
        if self.fingers.fingering() != Some(lip) {
            self.fingers.aim(lip);
            self.posture = None;
        }
        let target = slide.target;
        let period_s = TICK as f64 / model.coeffs.rate_hz;
        if !slide.tick(voice.p_mouthpiece(), (tick_s, period_s)) {
            self.slide = None;
            self.move_holes(target, tick_s, model, voice);
        }
        bent
    }

    /// Advances one control tick: moves holes and delay, and returns how the reed is driven. Real-time safe.
    pub fn tick<F: Real>(&mut self, model: &Model, voice: &mut Voice<F>) -> Drive {
        let (tick_s, is_idle) = (self.tick_s(model), self.is_idle());
        let covers = self.techniques.tick(&self.settings, tick_s);
        if self.reed.tick(tick_s) | self.glide.tick(&self.settings, tick_s) | covers {
            self.posture = None;
        }
        let slides = self.slide.is_some();
        let bent = if slides { self.slide_on(tick_s, model, voice) } else { None };
        let fingering = self.fingers.fingering();
        if self.posture.is_none() {
            self.now = self.glide.over(self.settings).with_reed_factors(self.reed.factors());
        }
        let settings = &self.now;
        let posture = self.posture.get_or_insert_with(|| {
            voice.lattice_mut().set_jet_loss(f64::from(settings.vent_loss));
            voice.set_key_sounds(f64::from(settings.articulation.key_sounds));
            voice.set_jet(match settings.breath_response {
                BreathResponse::Physical => Jet::Steady,
                BreathResponse::Played => Jet::Pulsed,
            });
            let own_cents = self.person.detune_cents(self.settings.players.spread_cents);
            let bend_cents = self.bend_cents + self.key_cents + own_cents;
            let alternate = self.fingers.alternate().and_then(|at| model.alternates.get(at));
            let fingered = Fingered {
                fingering: fingering.unwrap_or(0),
                alternate_cents: alternate.map_or(0.0, |alternate| alternate.cents),
                bend_cents,
                subtone: self.techniques.subtone(),
                follows: self.glide.follows(),
            };
            Posture::new(settings, &fingered, tick_s, model)
        });
        if self.has_other_reed {
            // A tongue on its way to the reed takes the other one when it is there.
            let force = if is_idle { self.tongue.rest_on(posture.free_closing) } else { None };
            self.has_other_reed = is_idle && force.is_none();
            if let Some(force) = force {
                voice.hold_reed(force);
            }
        }
        let (articulation, gamma) = (&settings.articulation, self.breath.gamma());
        self.inhalation.tick(articulation.breath_in, is_idle, gamma, tick_s);
        let has_fallen = self.inflection.tick(self.tongue.is_holding(), gamma, articulation, tick_s);
        if has_fallen || (self.tongue.is_due() && self.breath.is_at_rest()) {
            self.tongue.land();
        }
        let key_down = holds_note(&self.keys, &self.inflection, &self.tongue);
        let tongue_holds = self.tongue.is_holding();
        let asked = self.breath.asked(key_down);
        // A posture that has just been worked out has yet to get the lip of the dynamic.
        self.ear.hear(voice.p_mouthpiece() / self.closing, posture.lags.ear);
        let led = Led::new(self.voicing.lead(), slides);
        let ear = (led == Led::default() && self.tongue.is_away() && !self.breath.is_dipping())
            .then_some(&self.ear);
        self.onset.tick(tongue_holds, self.tongue.interval_s(), tick_s);
        let sway = self.swaying.tick(is_idle, settings, &posture.lags.life, tick_s, model.player.range_db);
        let in_place = tongue_holds || !key_down;
        let note_lip = self.lip_glide.tick(
            posture.note_lip(),
            in_place,
            (posture.lags.fingers, posture.lags.shape),
            tick_s,
        );
        let bodily = Bodily {
            note_lip,
            onset: &self.onset,
            sway: &sway,
            settles: tongue_holds,
            fade: self.inflection.fade(),
        };
        let mut target = self.response.tick(asked, ear, &bodily, settings, posture);
        if self.response.is_below() && self.tongue.is_away() {
            // What begins now begins without the tongue.
            self.ear.begin(Begun::Breathed);
        }
        if let Some(dynamic) = self.response.dynamic() {
            let level_db = model.player.level_db(dynamic);
            let kept = self.keeper.tick(heard_power(voice), target, level_db, led, &posture.lags.level);
            posture.loosen_lip(kept.lip);
            target = kept.gamma;
        }
        self.closing = posture.closing;
        let context = TickContext { tick_s, settings, posture };
        let note_hz = model.notes_hz[fingering.unwrap_or(0)];
        voice.set_tract(self.voicing.tick(settings, note_hz, bent, posture.lags.tract, model.coeffs.rate_hz));
        let lattice = voice.lattice_mut();
        self.fingers.tick(model, lattice);

        self.breath.tick(target, key_down, tongue_holds, &context);
        let gamma = self.breath.gamma();
        let shaken = self.techniques.shake(gamma, note_hz * self.tuning.speed(), settings, tick_s)
            * self.pushing.tick(tick_s);
        let hardness =
            self.breath.attack_hardness() * self.response.haste(settings.attack) / self.response.release();
        let speaks = self.tongue.is_due() && self.response.hears(&self.ear);
        let (p_mouth, tongue) = self.tongue.tick(shaken, hardness, (&self.ear, speaks), &context);
        let beside_cents = self.slide.as_ref().map_or(0.0, Slide::beside_cents);
        let added_cents = (sway.cents, self.inflection.cents() + beside_cents);
        let has_other_speed = self.tuning.tick(fingering, gamma, added_cents, &context, model, lattice);
        let drive = Drive { p_mouth, tongue, noise: f64::from(settings.noise), reed: posture.reed };
        if has_other_speed {
            // The clock's speed has changed, and with it the length of a tick.
            let lags = Lags::new(&self.now, self.tick_s(model), model.size_hz);
            if let Some(posture) = &mut self.posture {
                posture.lags = lags;
            }
        }
        drive
    }
}

/// Whether a note is to sound: a key is down, or the note of the last one falls or has yet to speak.
fn holds_note(keys: &Keys, inflection: &Inflection, tongue: &Tongue) -> bool {
    !keys.is_empty() || inflection.is_falling() || tongue.is_due()
}
