//! The player: turns notes, breath and settings into holes, lip, tongue and mouth pressure, tick by tick.
//!
//! Keys without a breath source are blown by their velocity. As soon as any breath arrives, breath alone makes the
//! loudness and velocity only hardens the tongue. Notes that overlap are slurred (the holes move, the tongue stays
//! away); a note after a gap is tongued: the tongue holds the reed while the breath rises behind it, and lets go.

mod carry;

use crate::control::keys::Keys;
use crate::event::Event;
use crate::instrument::bend::{self, Split};
use crate::instrument::embouchure::embouchure;
use crate::instrument::model::Model;
use crate::instrument::settings::Settings;
use crate::instrument::slap::{BREATH_GAMMA, Slap};
use crate::instrument::voice::{Drive, TICK, Voice};
use crate::instrument::watch::Now;
use crate::reed::ReedCoeffs;
use crate::reed::motion::TONGUE_FORCE;
use crate::reed::physical::P_REF_PA;
use crate::units::{Air, SoundingNote, cents};

/// How long the tongue holds the reed before a tongued note, s: long enough for the breath to rise behind it.
const TONGUE_HOLD_S: f64 = 0.008;
/// How fast the tongue reaches the reed to stop a note, and how softly it lands, s.
const TONGUE_STOP_S: f64 = 0.005;
const TONGUE_PRESS_S: f64 = 0.001;
/// Time constants of the breath, s: rising behind the tongue, following a controller, ending.
const BREATH_RISE_S: f64 = 0.002;
const BREATH_FOLLOW_S: f64 = 0.005;
const BREATH_END_S: f64 = 0.012;
/// Breath by velocity, gamma: just above the threshold .. loud (by ear).
const VELOCITY_GAMMA: (f64, f64) = (0.43, 0.85);
/// A slur of an octave or more, or into the altissimo, is helped by a dip of the breath, as players do: depth, length.
const DIP: (f64, f64) = (0.3, 0.025);
/// The clock is where it should be when this near, cents.
const ARRIVED_CENTS: f64 = 0.01;
/// A note is over when its breath is below this share of the closing pressure.
const NO_BREATH: f64 = 1e-6;

/// Where the tongue is. Between notes it rests on the reed, so that nothing slams shut when the next one is prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Tongue {
    /// On the reed.
    Resting,
    /// Away from the reed.
    Away,
    /// Holding the reed for so many more seconds before a note.
    Holding(f64),
    /// Letting go, share 1 .. 0.
    Leaving(f64),
    /// Pressing to stop a note, share 0 .. 1.
    Stopping(f64),
    /// Back on the reed after a slap under a key, until there is breath.
    Damming,
}

/// What settings, fingering and bend amount to: worked out when one of them changes, not at every tick.
#[derive(Clone, Copy, Debug)]
struct Stance {
    /// Closing pressure of the reed over the reference.
    closing: f64,
    reed: ReedCoeffs,
    /// Delay on top of the note's trim, rows.
    rows: f64,
    /// What the size of the bore adds, cents.
    bore_cents: f64,
    steps: Steps,
}

/// How far delay, clock and breath come towards what is wanted in one tick, 0..1.
#[derive(Clone, Copy, Debug)]
struct Steps {
    tuning: f64,
    breath_rise: f64,
    breath_follow: f64,
    breath_end: f64,
}

impl Steps {
    fn new(settings: &Settings, tick_s: f64) -> Self {
        let step = |time_s: f64| step_towards(tick_s, time_s);
        Self {
            tuning: step(0.5e-3 * f64::from(settings.legato_ms)),
            breath_rise: step(BREATH_RISE_S),
            breath_follow: step(BREATH_FOLLOW_S),
            breath_end: step(BREATH_END_S),
        }
    }
}

impl Stance {
    fn new(settings: &Settings, fingering: usize, bend_cents: f64, tick_s: f64, model: &Model) -> Self {
        let law = settings.reed_law();
        let lip = embouchure(model.notes_hz[fingering], model.lowest_hz);
        let reed = ReedCoeffs::new(
            law,
            f64::from(settings.zeta),
            f64::from(settings.lay),
            lip.resonance_hz,
            lip.damping * f64::from(settings.damping),
            model.swept_s,
            model.coeffs.rate_hz,
        );
        let offset = bend_cents
            + cents(f64::from(settings.a4_hz), model.a4_hz)
            + cents(Air::at(f64::from(settings.temperature_c)).c, model.air.c);
        let sensitivity = model.tuning.notes.get(fingering).map_or(1.0, |note| note.sensitivity);
        let split = Split::new(offset, bend::lip_limit_cents(model, fingering, offset));
        Self {
            closing: law.closing(),
            reed,
            rows: sensitivity * model.rows_for_cents(fingering, split.lip_cents),
            bore_cents: split.bore_cents,
            steps: Steps::new(settings, tick_s),
        }
    }
}

/// How far a first-order lag of `time_s` comes in `tick_s`, 0..1.
fn step_towards(tick_s: f64, time_s: f64) -> f64 {
    1.0 - (-tick_s / time_s).exp()
}

/// What the player is doing.
#[derive(Clone, Debug)]
pub struct Player {
    settings: Settings,
    /// `None` until the next tick works it out.
    stance: Option<Stance>,
    keys: Keys,
    velocity: f64,
    /// Fingering in place, if any note was ever played.
    fingering: Option<usize>,
    /// Open holes that are tried instead of the fingering's, a bit each.
    tried: Option<u64>,
    /// Control ticks until the holes have arrived.
    gliding: u32,
    breath_live: bool,
    breath: f64,
    gamma: f64,
    tongue: Tongue,
    /// A slap that pulls at the reed, whatever else the tongue would do.
    slap: Option<Slap>,
    bend_cents: f64,
    /// Factors on H and k: as they are, and where they go.
    reed: [f32; 2],
    reed_wanted: [f32; 2],
    dip: f64,
    rows: f64,
    rows_set: bool,
    /// What the clock adds to the pitch, and how fast it therefore runs.
    bore_cents: f64,
    speed: f64,
    /// Force of the tongue, smoothed so that it never slaps by accident; negative while it pulls for a slap.
    tongue_force: f64,
}

impl Default for Player {
    fn default() -> Self {
        Self {
            settings: Settings::default(),
            stance: None,
            keys: Keys::default(),
            velocity: 0.0,
            fingering: None,
            tried: None,
            gliding: 0,
            breath_live: false,
            breath: 0.0,
            gamma: 0.0,
            tongue: Tongue::Resting,
            slap: None,
            bend_cents: 0.0,
            reed: [1.0; 2],
            reed_wanted: [1.0; 2],
            dip: 0.0,
            rows: 0.0,
            rows_set: false,
            bore_cents: 0.0,
            speed: 1.0,
            tongue_force: TONGUE_FORCE,
        }
    }
}

impl Player {
    /// New settings; heard from the next tick on.
    pub fn set_settings(&mut self, settings: &Settings) {
        let settings = settings.clamped();
        if settings != self.settings {
            self.settings = settings;
            self.stance = None;
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Speed of the instrument's clock at the end of the last tick; 1 is the model's rate.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Length of a control tick, s.
    fn tick_s(&self, model: &Model) -> f64 {
        TICK as f64 / (model.coeffs.rate_hz * self.speed)
    }

    /// What the player is at.
    pub fn now(&self) -> Now {
        let closing = self.stance.as_ref().map_or(1.0, |stance| stance.closing);
        Now {
            sounding: self.keys.last(),
            fingering: self.fingering.unwrap_or(0),
            mouth_kpa: (1e-3 * P_REF_PA * closing * self.gamma) as f32,
        }
    }

    /// As new; settings stay.
    pub fn reset(&mut self) {
        *self = Self { settings: self.settings, ..Self::default() };
    }

    /// What the player is told. Real-time safe.
    pub fn apply<F: crate::bore::lattice::Real>(
        &mut self,
        event: Event,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        match event {
            Event::NoteOn { note, velocity } => self.note_on(note, velocity, model, voice),
            Event::NoteOff { note } => self.note_off(note, model, voice),
            Event::Breath(breath) => {
                self.breath_live = true;
                self.breath = f64::from(if breath.is_finite() { breath.clamp(0.0, 1.0) } else { 0.0 });
            }
            Event::Bend { cents } => {
                self.bend_cents =
                    f64::from(if cents.is_finite() { cents.clamp(-4_800.0, 4_800.0) } else { 0.0 });
                self.stance = None;
            }
            Event::Reed { h, k } => {
                let fix = |x: f32| if x.is_finite() { x.clamp(0.1, 10.0) } else { 1.0 };
                self.reed_wanted = [fix(h), fix(k)];
            }
            Event::TongueSlap { strength } => self.tongue_slap(strength, model, voice),
            Event::TryHoles(tried) => {
                self.tried = tried;
                if let Some(fingering) = self.fingering {
                    self.move_holes(fingering, 1e-3 * f64::from(self.settings.legato_ms), model, voice);
                }
            }
            Event::Panic => {
                self.reset();
                voice.reset();
                voice.hold_reed(TONGUE_FORCE);
            }
        }
    }

    fn note_on<F: crate::bore::lattice::Real>(
        &mut self,
        note: SoundingNote,
        velocity: f32,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        // A note the instrument does not have is no note.
        let Some(fingering) = model.fingering_for(note) else { return };
        let slurred = !self.keys.is_empty();
        self.keys.press(note);
        self.velocity = f64::from(if velocity.is_finite() { velocity.clamp(0.0, 1.0) } else { 0.5 });
        if !slurred {
            self.tongue = Tongue::Holding(TONGUE_HOLD_S);
        }
        self.finger(fingering, slurred, model, voice);
    }

    fn note_off<F: crate::bore::lattice::Real>(
        &mut self,
        note: SoundingNote,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        let sounding = self.keys.last() == Some(note);
        self.keys.release(note);
        if !sounding {
            return;
        }
        match self.keys.last().and_then(|last| model.fingering_for(last)) {
            Some(fingering) => self.finger(fingering, true, model, voice),
            None => self.tongue = Tongue::Stopping(0.0),
        }
    }

    /// Slaps the fingering in place, or the first one before any note.
    fn tongue_slap<F: crate::bore::lattice::Real>(
        &mut self,
        strength: f32,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        let closing = self.stance.map_or(1.0, |stance| stance.closing);
        let Some(slap) = Slap::begin(strength, self.tongue_force / closing, self.slap) else { return };
        self.slap = Some(slap);
        if self.fingering.is_none() {
            self.finger(0, false, model, voice);
        }
        self.tongue = match self.keys.is_empty() {
            true => Tongue::Resting,
            false if self.gamma < BREATH_GAMMA => Tongue::Damming,
            false => Tongue::Away,
        };
    }

    /// Moves the fingers; slurred they take their time, behind the tongue they are quick.
    fn finger<F: crate::bore::lattice::Real>(
        &mut self,
        fingering: usize,
        slurred: bool,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        if let (true, Some(from)) = (slurred, self.fingering) {
            let leap = cents(model.notes_hz[fingering], model.notes_hz[from]).abs() > 1_150.0;
            let (old, new) = (model.registers[from], model.registers[fingering]);
            if leap || (old != new && old.max(new) > 2) {
                self.dip = DIP.1;
            }
        }
        let ms = if slurred { f64::from(self.settings.legato_ms) } else { 5.0 };
        self.move_holes(fingering, 1e-3 * ms, model, voice);
    }

    /// Fingers on their way to a fingering, or to the holes that are being tried; the first of all are there at once.
    fn move_holes<F: crate::bore::lattice::Real>(
        &mut self,
        fingering: usize,
        time_s: f64,
        model: &Model,
        voice: &mut Voice<F>,
    ) {
        let ticks = ((time_s / self.tick_s(model)).round() as u32).max(1);
        // One more than the way takes: they are put in place when they have arrived, not a step before.
        self.gliding = if self.fingering.is_some() { ticks + 1 } else { 0 };
        self.fingering = Some(fingering);
        self.stance = None;
        for hole in 0..model.coeffs.holes() {
            let opening = self.opening(fingering, hole, model);
            if self.gliding == 0 {
                voice.lattice_mut().set_opening(hole, opening);
            } else {
                voice.lattice_mut().glide_opening(hole, opening, ticks as usize * TICK);
            }
        }
    }

    /// How far a hole shall be open.
    fn opening(&self, fingering: usize, hole: usize, model: &Model) -> f64 {
        let open = match self.tried {
            Some(tried) => tried >> hole & 1 == 1,
            None => model.file.fingerings[fingering].open[hole],
        };
        f64::from(u8::from(open))
    }

    /// True while nothing is held and the breath has gone.
    pub fn is_resting(&self) -> bool {
        self.slap.is_none()
            && self.gamma < NO_BREATH
            && (self.keys.is_empty() || (self.breath_live && self.breath == 0.0))
    }

    /// The reed follows its controllers within some milliseconds, so that their steps are not heard.
    fn follow_reed(&mut self, tick_s: f64) {
        let step = step_towards(tick_s, BREATH_FOLLOW_S) as f32;
        for (now, wanted) in self.reed.iter_mut().zip(self.reed_wanted) {
            *now += (wanted - *now) * step;
            if (*now - wanted).abs() < 1e-4 {
                *now = wanted;
            }
        }
        self.stance = None;
    }

    /// The bore's size follows as the delay does; the first note has it at once.
    fn follow_bore(&mut self, at_once: bool, settings: &Settings, stance: &Stance, model: &Model) {
        let away = stance.bore_cents - self.bore_cents;
        self.bore_cents = if at_once || away.abs() < ARRIVED_CENTS {
            stance.bore_cents
        } else {
            self.bore_cents + away * stance.steps.tuning
        };
        self.speed = bend::speed(self.bore_cents);
        // Ticks have another length now.
        self.stance = Some(Stance { steps: Steps::new(settings, self.tick_s(model)), ..*stance });
    }

    /// Advances one control tick: moves holes and delay, and says how the reed is driven. Real-time safe.
    pub fn tick<F: crate::bore::lattice::Real>(&mut self, model: &Model, voice: &mut Voice<F>) -> Drive {
        let tick_s = self.tick_s(model);
        if self.reed != self.reed_wanted {
            self.follow_reed(tick_s);
        }
        let settings = self.settings.with_reed_factors(self.reed);
        let fingering = self.fingering.unwrap_or(0);
        let stance = *self.stance.get_or_insert_with(|| {
            voice.lattice_mut().set_jet_loss(f64::from(settings.vent_loss));
            Stance::new(&settings, fingering, self.bend_cents, tick_s, model)
        });
        let closing = stance.closing;

        if self.gliding > 0 {
            self.gliding -= 1;
            if self.gliding == 0 {
                for hole in 0..model.coeffs.holes() {
                    voice.lattice_mut().set_opening(hole, self.opening(fingering, hole, model));
                }
            }
        }

        // Breath.
        let playing = !self.keys.is_empty();
        let wanted = match (playing, self.breath_live) {
            (false, _) => 0.0,
            (true, true) => self.breath * 1e3 * f64::from(settings.breath_full_kpa) / (P_REF_PA * closing),
            (true, false) => {
                let (soft, loud) = VELOCITY_GAMMA;
                soft + (loud - soft) * self.velocity
            }
        };
        let (wanted, dipping) = if self.dip > 0.0 { (wanted * DIP.0, true) } else { (wanted, false) };
        self.dip -= tick_s;
        let step = if !playing {
            stance.steps.breath_end
        } else if matches!(self.tongue, Tongue::Holding(_)) || dipping {
            stance.steps.breath_rise
        } else {
            stance.steps.breath_follow
        };
        self.gamma += (wanted - self.gamma) * step;
        if wanted == 0.0 && self.gamma < NO_BREATH {
            self.gamma = 0.0;
        }

        // Tongue.
        let (tongue, share) = match self.tongue {
            Tongue::Resting => (Tongue::Resting, 1.0),
            Tongue::Away => (Tongue::Away, 0.0),
            Tongue::Holding(left) if left > tick_s => (Tongue::Holding(left - tick_s), 1.0),
            Tongue::Holding(_) => (Tongue::Leaving(1.0), 1.0),
            Tongue::Leaving(share) => {
                // Velocity hardens the tongue when the breath is live: half to one and a half times as quick as set.
                let hard = if self.breath_live { 0.5 + self.velocity } else { 1.0 };
                let share = share - tick_s * hard / (1e-3 * f64::from(settings.tongue_ms));
                if share > 0.0 { (Tongue::Leaving(share), share) } else { (Tongue::Away, 0.0) }
            }
            Tongue::Stopping(share) => {
                let share = (share + tick_s / TONGUE_STOP_S).min(1.0);
                (if share < 1.0 { Tongue::Stopping(share) } else { Tongue::Resting }, share)
            }
            Tongue::Damming if self.gamma < BREATH_GAMMA => (Tongue::Damming, 1.0),
            Tongue::Damming => (Tongue::Leaving(1.0), 1.0),
        };
        self.tongue = tongue;
        let mut p_mouth = self.gamma * closing;
        let force = TONGUE_FORCE * closing * share;
        let pull = self.slap.as_mut().map(|slap| slap.tick(tick_s));
        self.tongue_force = match pull {
            Some(Some(pull)) => {
                p_mouth = p_mouth * (1.0 - pull.seal) + pull.suction * closing;
                pull.force * closing
            }
            // Off it comes, within one tick: whatever the tongue does next begins at the free reed.
            Some(None) => {
                self.slap = None;
                0.0
            }
            // Letting go is as quick as asked; pressing takes a moment.
            None if force <= self.tongue_force => force,
            None => self.tongue_force + step_towards(tick_s, TONGUE_PRESS_S) * (force - self.tongue_force),
        };

        // Tuning.
        let rows = model.tuning.rows(fingering, settings.tuning, self.gamma) + stance.rows;
        // The delay follows within the time the fingers take; the first note has it at once.
        let at_once = !self.rows_set;
        if self.rows_set {
            self.rows += (rows - self.rows) * stance.steps.tuning;
            voice.lattice_mut().glide_delay(self.rows, TICK);
        } else {
            self.rows = rows;
            self.rows_set = self.fingering.is_some();
            voice.lattice_mut().glide_delay(self.rows, 0);
        }
        if stance.bore_cents != self.bore_cents {
            self.follow_bore(at_once, &settings, &stance, model);
        }

        Drive { p_mouth, tongue: self.tongue_force, noise: f64::from(settings.noise), reed: stance.reed }
    }
}
