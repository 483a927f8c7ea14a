//! The instrument as the page plays it: MIDI messages and breath in, blocks of two channels out.
//!
//! MIDI is decoded by the core, as in the plugin. Everything here is real-time safe, but for [`Playing::new`].

use std::sync::Arc;

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::control::midi::BreathOrigin;
use chalumeau_core::control::midi::breath::{BreathController, BreathFrom};
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::control::notes::{NoteAddress, NoteExpression};
use chalumeau_core::control::parts::Parts;
use chalumeau_core::control::wind::{WindCoeffs, WindDesign, WindMeter};
use chalumeau_core::dsp::smooth::smooth_single;
use chalumeau_core::event::{Event, PartEvent, Timed};
use chalumeau_core::instrument::stereo::Stereo;
use chalumeau_core::instrument::{BuildError, Channels, Ensemble, Preparation, Settings, Wanted};
use chalumeau_core::maths;

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::event::{Played, To};
use chalumeau_core::instrument::Model;
use chalumeau_core::instrument::prepare::PreparedInstrument;
use chalumeau_knob::touch::angle::{KnobDesign, slap_strength};
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, BreathMapping};

use crate::held_knob::HeldKnob;
use crate::values;

/// Most samples of one block: eight of an audio worklet's.
pub const MOST_FRAMES: usize = 1_024;
/// The numbers of a [picture](Playing::picture) in their order, by the names that the page knows them by. -1 where there is none:
/// held key, sounding note and index of the fingering; mouth pressure in kPa, and the same over the closing pressure; dynamic
/// 0..=1; peak and root mean square of the samples since the last picture; place in [`ORIGINS`]; players awake; and how often the
/// voice was reset.
pub const PICTURE_NAMES: [&str; 11] = [
    "key",
    "sounding",
    "fingering",
    "mouth",
    "gamma",
    "dynamic",
    "peak",
    "level",
    "origin",
    "awake",
    "resets",
];
/// How many there are.
pub const PICTURE: usize = PICTURE_NAMES.len();
/// Where breath can come from, as the page says it; the first is the keys.
pub const ORIGINS: [&str; 6] = ["", "CC2", "CC11", "channel pressure", "the note", "the knob"];

/// Numbers of [what the page shows of the microphone](Playing::wind).
pub const WIND_PICTURE: usize = 4;

/// One instrument with its players, at one sample rate.
pub struct Playing {
    ensemble: Ensemble,
    parts: Parts,
    stereo: Stereo,
    settings: Settings,
    channels: [[f32; MOST_FRAMES]; 2],
    picture: [f32; PICTURE],
    peak: f32,
    /// Sum of squares since the last picture, and of how many samples.
    energy: (f32, u32),
    rate_hz: f64,
    knob: Option<Box<HeldKnob>>,
    blower: Blower,
    /// How the knob's angles become breath, copied from its feel.
    hand: BreathMapping,
    /// The knob made the breath of the last block.
    is_blown: bool,
    /// The microphone, whether it blows, what it gives next, and what the page shows of it.
    wind: WindMeter,
    is_heard: bool,
    input: [f32; MOST_FRAMES],
    wind_picture: [f32; WIND_PICTURE],
    /// The last samples of the instrument, before pan and room.
    last: [f32; 2],
    takeover: Takeover,
}

/// Time in which a new instrument becomes as loud as it is, s. Its bore begins empty under the full breath, which is a pop.
const FADE_IN_S: f64 = 0.025;
/// Time constant with which the last sample of the one before goes to 0, s.
const FADE_OUT_S: f64 = 0.001;

/// Time in which an instrument falls silent before another is made, s: making it takes some ten blocks, and what sounded until then would break off.
const LEAVE_S: f64 = 0.005;

/// One instrument takes over from another without a click.
struct Takeover {
    /// Samples since then, and in which the new one fades in.
    played: usize,
    fade: usize,
    /// What is left of the last samples of the one before, and its share after each sample.
    rest: [f32; 2],
    share: f32,
    /// Samples in which the old one falls silent, and how many are left; `None` while it stays.
    leave: usize,
    leaving: Option<usize>,
}

impl Takeover {
    fn done(rate_hz: f64) -> Self {
        let fade = (FADE_IN_S * rate_hz) as usize;
        let share = maths::exp(-1.0 / (FADE_OUT_S * rate_hz)) as f32;
        let leave = ((LEAVE_S * rate_hz) as usize).max(1);
        Self { played: fade, fade, rest: [0.0; 2], share, leave, leaving: None }
    }

    fn begin(&mut self, last: [f32; 2]) {
        (self.played, self.rest, self.leaving) = (0, last, None);
    }

    fn leave(&mut self, samples: usize) {
        self.leaving.get_or_insert(samples);
    }

    fn has_left(&self) -> bool {
        self.leaving == Some(0)
    }

    fn fall_silent(&mut self, left: &mut [f32], right: &mut [f32]) {
        let Some(samples) = &mut self.leaving else { return };
        for (left, right) in left.iter_mut().zip(right) {
            *samples = samples.saturating_sub(1);
            let gain = smooth_single(*samples as f32 / self.leave as f32);
            (*left, *right) = (gain * *left, gain * *right);
        }
    }

    fn fade(&mut self, left: &mut [f32], right: &mut [f32]) {
        for (left, right) in left.iter_mut().zip(right) {
            if self.played >= self.fade {
                return;
            }
            // Flat at both ends, and near nothing in the first 5 ms.
            let gain = smooth_single(self.played as f32 / self.fade as f32).powi(2);
            for (sample, rest) in [left, right].into_iter().zip(&mut self.rest) {
                *rest *= self.share;
                *sample = gain * *sample + *rest;
            }
            self.played += 1;
        }
    }
}

/// Applies what a message became, in its order.
fn play(ensemble: &mut Ensemble, stereo: &mut Stereo, said: &[PartEvent]) {
    for &event in said {
        if ensemble.is_lone() {
            stereo.heed(&Timed { at: 0, event: event.event });
        }
        ensemble.apply(event);
    }
}

impl Playing {
    /// An instrument at rest, at a host rate in Hz. Allocates.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the rate lies outside 1000..=1536000.
    pub fn new(rate_hz: f64, instrument: Bundled) -> Result<Self, BuildError> {
        let wanted = Wanted::new(instrument.file(), rate_hz);
        let ready = Preparation::new(&wanted, None).ready()?;
        let model = ready.ok_or_else(|| BuildError::Data(format!("nothing for {rate_hz} Hz")))?;
        Ok(Self::of(model, rate_hz))
    }

    /// The instrument of a file, as a worker of the page has prepared it; `None` if a text is damaged, or the two do not belong
    /// together. Allocates.
    pub fn prepared(rate_hz: f64, file: &str, prepared: &str) -> Option<Self> {
        let file = InstrumentFile::parse(file).ok()?;
        let wanted_hz = Wanted::new(file.clone(), rate_hz).internal_rate_hz().ok()?;
        let model = PreparedInstrument::from_text(prepared)?.model(&file)?;
        (model.cells.rate_hz == wanted_hz).then(|| Self::of(model, rate_hz))
    }

    fn of(model: Model, rate_hz: f64) -> Self {
        Self {
            ensemble: Ensemble::new(Arc::new(model), rate_hz),
            parts: Parts::new(1),
            stereo: Stereo::new(rate_hz),
            settings: Settings::default(),
            channels: [[0.0; MOST_FRAMES]; 2],
            picture: [0.0; PICTURE],
            peak: 0.0,
            energy: (0.0, 0),
            rate_hz,
            knob: None,
            blower: Blower::default(),
            hand: BreathMapping { design: KnobDesign::default(), feels: true, ..BreathMapping::default() },
            is_blown: false,
            wind: WindMeter::new(WindCoeffs::new(rate_hz), WindDesign::default()),
            is_heard: false,
            input: [0.0; MOST_FRAMES],
            wind_picture: [0.0; WIND_PICTURE],
            last: [0.0; 2],
            takeover: Takeover::done(rate_hz),
        }
    }

    /// A MIDI channel message. Other messages are ignored; data bytes above 127 are read as 127.
    pub fn midi(&mut self, status: u8, first: u8, second: u8) {
        let (channel, parts) = (status & 0x0f, &mut self.parts);
        let said = match status & 0xf0 {
            0x80 => parts.note_off(channel, first),
            0x90 => parts.note_on(channel, first, second),
            0xb0 => parts.controller(channel, first, second),
            0xa0 => {
                let breath = NoteExpression::Breath(f32::from(second.min(127)) / 127.0);
                parts.express(NoteAddress::of_key(channel, first.min(127)), breath)
            }
            0xd0 => parts.pressure(channel, first),
            0xe0 => {
                let [low, high] = [first, second].map(|byte| u16::from(byte.min(127)));
                parts.bend(channel, high << 7 | low)
            }
            _ => &[],
        };
        for &event in said {
            if let Some(event) = event.of_first() {
                self.blower.heed(&Timed { at: 0, event });
            }
            // While the knob blows, nothing else does.
            if self.is_blown && matches!(event.event, Event::Breath(_) | Event::BreathFromKeys) {
                continue;
            }
            play(&mut self.ensemble, &mut self.stereo, &[event]);
        }
    }

    /// Breath of all players, 0..=1; `None`, or what is not a number, gives the breath back to the keys.
    pub fn breath(&mut self, unit: Option<f32>) {
        if self.is_blown {
            return;
        }
        let event = match unit {
            Some(unit) if !unit.is_nan() => Event::Breath(unit.clamp(0.0, 1.0)),
            _ => Event::BreathFromKeys,
        };
        self.ensemble.apply(event.into());
    }

    /// Whether a microphone blows. Off, the breath goes back to the keys.
    pub fn set_microphone(&mut self, is_on: bool) {
        if self.is_heard && !is_on {
            self.breath(None);
        }
        self.is_heard = is_on;
    }

    /// Measures the room, see [`WindMeter::calibrate`].
    pub fn calibrate(&mut self) {
        self.wind.calibrate();
    }

    /// Where the page writes what the microphone gives.
    pub fn input(&mut self) -> &mut [f32; MOST_FRAMES] {
        &mut self.input
    }

    /// Hears the first samples of the [input](Self::input); its breath counts from the next block on. Whether somebody blows.
    pub fn hear(&mut self, frames: usize) -> bool {
        if !self.is_heard {
            return false;
        }
        for &sample in &self.input[..frames.min(MOST_FRAMES)] {
            self.wind.tick(sample);
        }
        // Nobody blows while the room is measured, or before the device is open.
        // A microphone that has gone sends nothing.
        self.breath(Some(if frames == 0 { 0.0 } else { self.wind.breath() }));
        self.wind.is_open()
    }

    /// What the page shows of the microphone: level and floor, dBFS, breath, and 1 while the room is measured.
    pub fn wind(&mut self) -> &[f32; WIND_PICTURE] {
        let wind = &self.wind;
        self.wind_picture = [
            wind.level_dbfs() as f32,
            wind.design().floor_dbfs,
            wind.breath(),
            f32::from(u8::from(wind.is_calibrating())),
        ];
        &self.wind_picture
    }

    /// Ends everything that sounds, at once.
    pub fn silence(&mut self) {
        self.blower.heed(&Timed { at: 0, event: Event::Panic });
        play(&mut self.ensemble, &mut self.stereo, self.parts.silence());
    }

    /// A serial port with a knob has been opened, or closed.
    pub fn set_knob(&mut self, knob: Option<Box<HeldKnob>>) {
        self.knob = knob;
    }

    /// The knob, if its port is open.
    pub fn knob(&mut self) -> Option<&mut HeldKnob> {
        self.knob.as_deref_mut()
    }

    /// Lets the knob's time pass before a block of so many samples.
    pub fn turn_knob(&mut self, now_ms: f64, frames: usize) {
        let (note, rate_hz) = (self.blower.fingered(), self.rate_hz);
        if let Some(knob) = &mut self.knob {
            knob.turn(now_ms, frames, rate_hz, note);
        }
    }

    /// What the knob should feel like and what its angles blow, see [`HeldKnob::set_feel`].
    pub fn set_feel(&mut self, bytes: &[u8]) {
        if let Some(knob) = &mut self.knob {
            knob.set_feel(bytes);
            self.hand.maps = knob.played().maps;
        }
    }

    /// Changes one of the [values]; [`settle`](Self::settle) brings it to the instrument.
    pub fn set(&mut self, at: usize, value: f32) {
        values::set(&mut self.settings, at, value);
    }

    /// Takes the settings as they have been set.
    pub fn settle(&mut self) {
        let was_lone = self.ensemble.is_lone();
        self.ensemble.set_settings(&self.settings);
        if self.ensemble.is_lone() != was_lone {
            self.stereo.hand_over_pan(was_lone, self.ensemble.pan());
        }
        self.settings = *self.ensemble.first().settings();
        self.stereo.set_space(&self.settings);
        self.parts.set_count(self.settings.players.parts());
        self.parts.set_key_switches(self.settings.reach.key_switches);
        let notes = self.settings.reach.key_notes(self.ensemble.first().model());
        self.parts.set_playing_keys(notes.playing());
        self.blower.set_notes(notes);
    }

    /// What the mod wheel does, by its place in [`Wheel::ALL`].
    pub fn wheel(&mut self, at: usize) {
        let said = self.parts.set_wheel(Wheel::ALL.get(at).copied().unwrap_or_default());
        play(&mut self.ensemble, &mut self.stereo, said);
    }

    /// How far the bend wheel bends, semitones.
    pub fn bend_range(&mut self, semitones: u8) {
        play(&mut self.ensemble, &mut self.stereo, self.parts.usual_bend_range(semitones.min(127)));
    }

    /// Which controllers may blow, by the place in [`BreathFrom::ALL`].
    pub fn breath_from(&mut self, at: usize) {
        let said = self.parts.set_breath_from(BreathFrom::ALL.get(at).copied().unwrap_or_default());
        play(&mut self.ensemble, &mut self.stereo, said);
    }

    /// Takes over keys, breath and bend from another instrument, which this one replaces.
    pub fn carry_on(&mut self, from: Self) {
        self.parts = from.parts;
        self.settings = from.settings;
        // Pan, volume and the sound that is still in the room.
        self.stereo = from.stereo;
        (self.knob, self.blower, self.hand, self.is_blown) =
            (from.knob, from.blower, from.hand, from.is_blown);
        self.settle();
        self.ensemble.carry_on(&from.ensemble);
        (self.wind, self.is_heard) = (from.wind, from.is_heard);
        self.takeover.begin(from.last);
    }

    /// Falls silent within 5 ms, or is so already, for another instrument to [carry on](Self::carry_on).
    pub fn leave(&mut self) {
        // What sounds is never exactly 0.
        self.takeover.leave(if self.last == [0.0; 2] { 0 } else { self.takeover.leave });
    }

    /// Whether it has fallen silent.
    pub fn has_left(&self) -> bool {
        self.takeover.has_left()
    }

    /// There is no other instrument: it sounds again.
    pub fn stay(&mut self) {
        self.takeover.begin(self.last);
    }

    /// Makes the next samples, [`MOST_FRAMES`] at most; returns how many.
    pub fn process(&mut self, frames: usize) -> usize {
        let frames = frames.min(MOST_FRAMES);
        let [left, right] = &mut self.channels;
        let (left, right) = (&mut left[..frames], &mut right[..frames]);
        // A slap is of its moment, whether the knob blows or not.
        let slap = self.knob.as_mut().and_then(|knob| knob.take_slap());
        let mut knob = self.knob.as_deref_mut().filter(|knob| knob.angle_deg(0).is_some());
        if knob.is_none() && std::mem::take(&mut self.is_blown) {
            // Breath that nobody holds any more goes back to the keys.
            if self.blower.fall_silent().is_some() {
                self.ensemble.apply(Event::Breath(0.0).into());
            }
            self.ensemble.apply(Event::BreathFromKeys.into());
        }
        match &mut knob {
            Some(knob) => {
                self.is_blown = true;
                if let Some(speed) = slap {
                    let event = Event::TongueSlap { strength: slap_strength(speed) };
                    self.ensemble.apply(PartEvent { to: To::Player(0), event });
                }
                let full_pa = 1e3 * f64::from(self.settings.breath_full_kpa);
                let (nobody, angle) = (std::iter::empty::<Timed<PartEvent>>(), |at| knob.angle_deg(at));
                let mut unheard = |_, _| {};
                let events = BlownEvents::new(
                    nobody,
                    &mut self.blower,
                    &self.hand,
                    full_pa,
                    frames,
                    angle,
                    &mut unheard,
                );
                self.ensemble.render_events_channels(events, Channels::two(left, right));
            }
            None => self.ensemble.render_channels(Channels::two(left, right)),
        }
        self.blower.advance(frames);
        self.takeover.fade(left, right);
        self.takeover.fall_silent(left, right);
        if let (Some(&left), Some(&right)) = (left.last(), right.last()) {
            self.last = [left, right];
        }
        self.stereo.pan(left, right);
        for channel in [left, right] {
            for sample in channel {
                self.peak = self.peak.max(sample.abs());
                self.energy.0 += *sample * *sample;
            }
        }
        self.energy.1 = self.energy.1.saturating_add(2 * frames as u32);
        frames
    }

    /// The samples of the last block; the left channel is 0.
    pub fn channel(&self, at: usize) -> &[f32; MOST_FRAMES] {
        &self.channels[usize::from(at == 1)]
    }

    /// What the page draws: the numbers of [`PICTURE_NAMES`].
    pub fn picture(&mut self) -> &[f32; PICTURE] {
        let state = self.ensemble.first().player_state();
        // By their places in `ORIGINS`.
        let origin = match self.parts.breath_origin() {
            _ if self.is_blown => 5.0,
            None => 0.0,
            Some(BreathOrigin::Controller(BreathController::Breath)) => 1.0,
            Some(BreathOrigin::Controller(BreathController::Expression)) => 2.0,
            Some(BreathOrigin::Controller(BreathController::Pressure)) => 3.0,
            Some(_) => 4.0,
        };
        let (energy, samples) = std::mem::take(&mut self.energy);
        let closing_kpa = (1e-3 * self.settings.under_lip(state.lip).closing_pa()) as f32;
        self.picture = [
            state.key.map_or(-1.0, |note| f32::from(note.0)),
            state.sounding.map_or(-1.0, |note| f32::from(note.0)),
            state.fingering as f32,
            state.mouth_kpa,
            state.mouth_kpa / closing_kpa,
            state.dynamic.unwrap_or(-1.0),
            std::mem::take(&mut self.peak),
            (energy / samples.max(1) as f32).sqrt(),
            origin,
            self.ensemble.awake() as f32,
            self.ensemble.resets() as f32,
        ];
        &self.picture
    }
}
