//! The player: turns notes, breath and settings into holes, lip, tongue and mouth pressure, tick by tick.
//!
//! `breath` follows a breath source or key velocity, and [`response`] makes a mouth pressure of it: directly, or by the rule in
//! [`dynamics`] that moves breath and lip together; there the [`ear`] pushes what is too soft. `tongue` articulates: overlapping notes are slurred (the holes move and
//! the tongue stays away); after a gap the tongue holds the reed while the breath rises behind it, and lets go. `fingers`
//! moves the holes, `tuning` the pitch, and `posture` holds what settings, fingering and bend ask for.

mod breath;
mod carry_on;
pub mod dynamics;
pub mod ear;
mod fingers;
mod fitted;
mod onset_shift;
mod posture;
mod reed_glide;
mod reed_smoothing;
pub mod response;
mod tongue;
mod tuning;

use crate::bore::lattice::Real;
use crate::control::keys::Keys;
use crate::event::Event;
use crate::instrument::breath_noise::Jet;
use crate::instrument::model::Model;
use crate::instrument::settings::{BreathResponse, Settings};
use crate::instrument::voice::{Drive, TICK, Voice};
use crate::reed::physical::P_REF_PA;
use crate::units::{SoundingNote, cents};
use breath::Breath;
use dynamics::LipShape;
use ear::Ear;
use fingers::Fingers;
use posture::{Lags, Posture};
use reed_glide::ReedGlide;
use reed_smoothing::ReedSmoothing;
use response::Response;
use tongue::Tongue;
use tuning::PlayedTuning;

/// Time the fingers take behind the tongue, ms; slurred they take the setting's time.
const TONGUED_FINGERS_MS: f64 = 5.0;
/// Widest bend an event may ask for, cents either way: 48 semitones, the range of an MPE note.
const BEND_CENTS: f32 = 4_800.0;

/// What the parts of a player need to know in one control tick.
struct TickContext<'a> {
    /// Length of the tick, s.
    tick_s: f64,
    settings: &'a Settings,
    posture: &'a Posture,
}

/// Share of the way that a first-order lag with the time constant `time_s` covers in `tick_s`, 0..1.
fn step_towards(tick_s: f64, time_s: f64) -> f64 {
    1.0 - (-tick_s / time_s).exp()
}

/// What the player does now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerState {
    /// The note that is held, if any.
    pub sounding: Option<SoundingNote>,
    /// Index of the fingering in place.
    pub fingering: usize,
    /// Mouth pressure, kPa.
    pub mouth_kpa: f32,
    /// How a player's lip shapes the reed; `None` where the breath is physical.
    pub lip: Option<LipShape>,
    /// The dynamic that is played, 0 (pianissimo) to 1 (fortissimo); `None` where the breath is physical or before the first note.
    pub dynamic: Option<f32>,
}

/// One player of one instrument.
#[derive(Clone, Debug, Default)]
pub struct Player {
    settings: Settings,
    /// `None` until the next tick works it out.
    posture: Option<Posture>,
    keys: Keys,
    breath: Breath,
    response: Response,
    ear: Ear,
    tongue: Tongue,
    fingers: Fingers,
    tuning: PlayedTuning,
    reed: ReedSmoothing,
    glide: ReedGlide,
    bend_cents: f64,
}

impl Player {
    /// Takes new settings, clamped to their ranges; they are heard from the next tick on. A sounding reed glides to them.
    /// Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        let settings = settings.clamped();
        if settings != self.settings {
            if self.is_resting() {
                self.glide.settle();
            } else {
                self.glide.begin(&self.settings, &settings);
            }
            self.settings = settings;
            self.posture = None;
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Speed of the instrument's clock at the end of the last tick; 1 is the model's rate.
    pub fn speed(&self) -> f64 {
        self.tuning.speed()
    }

    /// Length of a control tick, s.
    fn tick_s(&self, model: &Model) -> f64 {
        TICK as f64 / (model.coeffs.rate_hz * self.tuning.speed())
    }

    /// Closing pressure of the reed over the reference.
    fn closing(&self) -> f64 {
        self.posture.as_ref().map_or(1.0, |posture| posture.closing)
    }

    /// Held note, fingering and mouth pressure now.
    pub fn state(&self) -> PlayerState {
        PlayerState {
            sounding: self.keys.last(),
            fingering: self.fingers.fingering().unwrap_or(0),
            mouth_kpa: (1e-3 * P_REF_PA * self.closing() * self.breath.gamma()) as f32,
            lip: self.posture.as_ref().and_then(Posture::lip),
            dynamic: self.response.dynamic().map(|dynamic| dynamic as f32),
        }
    }

    /// Puts player, reed and bore back to the beginning; settings stay. The one way to end everything: a player who forgot
    /// while the bore went on would leave fingers under way. Real-time safe.
    pub fn reset<F: Real>(&mut self, voice: &mut Voice<F>) {
        *self = Self { settings: self.settings, ..Self::default() };
        voice.reset();
    }

    /// Handles an event. Numbers out of range are clamped. Real-time safe.
    pub fn apply<F: Real>(&mut self, event: Event, model: &Model, voice: &mut Voice<F>) {
        match event {
            Event::NoteOn { note, velocity } => self.note_on(note, velocity, model, voice),
            Event::NoteOff { note } => self.note_off(note, model, voice),
            Event::Choke { note } => self.choke(note, model, voice),
            Event::Breath(level) => self.breath.set_level(level),
            Event::Bend { cents } => {
                self.bend_cents =
                    f64::from(if cents.is_finite() { cents.clamp(-BEND_CENTS, BEND_CENTS) } else { 0.0 });
                self.posture = None;
            }
            Event::Reed { h, k } => self.reed.set(h, k),
            Event::TongueSlap { strength } => self.tongue_slap(strength, model, voice),
            Event::TryHoles(tried) => {
                self.fingers.try_holes(tried);
                if let Some(fingering) = self.fingers.fingering() {
                    self.move_holes(fingering, 1e-3 * f64::from(self.settings.legato_ms), model, voice);
                }
            }
            // They act after the instrument.
            Event::Volume { .. } | Event::Pan { .. } => {}
            Event::Panic => self.reset(voice),
        }
    }

    fn note_on<F: Real>(&mut self, note: SoundingNote, velocity: f32, model: &Model, voice: &mut Voice<F>) {
        // A note that the instrument does not have is ignored.
        let Some(fingering) = model.fingering_for(note) else { return };
        let slurred = !self.keys.is_empty();
        self.keys.press(note);
        self.breath.set_velocity(velocity);
        if !slurred {
            self.tongue.hold();
        }
        self.finger(fingering, slurred, model, voice);
    }

    fn note_off<F: Real>(&mut self, note: SoundingNote, model: &Model, voice: &mut Voice<F>) {
        let sounding = self.keys.last() == Some(note);
        self.keys.release(note);
        if !sounding {
            return;
        }
        match self.keys.last().and_then(|last| model.fingering_for(last)) {
            Some(fingering) => self.finger(fingering, true, model, voice),
            None => self.tongue.stop(),
        }
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
        match self.keys.last().and_then(|last| model.fingering_for(last)) {
            Some(fingering) => {
                self.tongue.hold();
                self.finger(fingering, false, model, voice);
            }
            None => self.tongue.stop(),
        }
    }

    /// The choked note has been cut: the breath begins again from nothing, and the tongue is on the reed.
    pub fn end_choke(&mut self) {
        self.breath = self.breath.carried();
        if !self.tongue.is_holding() {
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

    /// Moves the fingers to a note: slurred within the setting's time, behind the tongue quickly. A slur over a wide
    /// leap, or into or out of the altissimo, gets a dip of the breath.
    fn finger<F: Real>(&mut self, fingering: usize, slurred: bool, model: &Model, voice: &mut Voice<F>) {
        if let (true, Some(from)) = (slurred, self.fingers.fingering()) {
            let interval = cents(model.notes_hz[fingering], model.notes_hz[from]);
            self.breath.slur(interval, model.registers[from], model.registers[fingering]);
        }
        let ms = if slurred { f64::from(self.settings.legato_ms) } else { TONGUED_FINGERS_MS };
        self.move_holes(fingering, 1e-3 * ms, model, voice);
    }

    fn move_holes<F: Real>(&mut self, fingering: usize, time_s: f64, model: &Model, voice: &mut Voice<F>) {
        let ticks = (time_s / self.tick_s(model)).round() as u32;
        self.fingers.move_to(fingering, ticks, model, voice.lattice_mut());
        self.posture = None;
    }

    /// True while no slap sounds, the breath has gone and none is asked for.
    pub fn is_resting(&self) -> bool {
        !self.tongue.is_slapping() && self.breath.is_resting(!self.keys.is_empty())
    }

    /// Advances one control tick: moves holes and delay, and returns how the reed is driven. Real-time safe.
    pub fn tick<F: Real>(&mut self, model: &Model, voice: &mut Voice<F>) -> Drive {
        let tick_s = self.tick_s(model);
        if self.reed.tick(tick_s) | self.glide.tick(&self.settings, tick_s) {
            self.posture = None;
        }
        let settings = self.glide.over(self.settings).with_reed_factors(self.reed.factors());
        let fingering = self.fingers.fingering();
        let posture = self.posture.get_or_insert_with(|| {
            voice.lattice_mut().set_jet_loss(f64::from(settings.vent_loss));
            voice.set_jet(match settings.breath_response {
                BreathResponse::Physical => Jet::Steady,
                BreathResponse::Played => Jet::Pulsed,
            });
            Posture::new(&settings, fingering.unwrap_or(0), self.bend_cents, tick_s, model)
        });
        let (key_down, tongue_holds) = (!self.keys.is_empty(), self.tongue.is_holding());
        let asked = self.breath.asked(key_down);
        self.ear.hear(voice.p_mouthpiece() / posture.closing, posture.lags.ear);
        let ear = (self.tongue.is_away() && !self.breath.is_dipping()).then_some(&self.ear);
        let target = self.response.tick(asked, ear, tongue_holds, &settings, posture);
        let posture = *posture;
        let context = TickContext { tick_s, settings: &settings, posture: &posture };
        let lattice = voice.lattice_mut();

        self.breath.tick(target, key_down, tongue_holds, &context);
        let gamma = self.breath.gamma();
        let hardness = self.breath.attack_hardness() / self.response.release();
        let (p_mouth, tongue) = self.tongue.tick(gamma, hardness, &context);
        if self.tuning.tick(fingering, gamma, &context, model, lattice) {
            // The clock's speed has changed, and with it the length of a tick.
            let lags = Lags::new(&settings, self.tick_s(model), model.lowest_hz);
            self.posture = Some(posture.with_lags(lags));
        }
        Drive { p_mouth, tongue, noise: f64::from(settings.noise), reed: posture.reed }
    }
}
