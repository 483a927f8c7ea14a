//! A note held by a blowing machine: constant fingering and lip, breath from a ramp or behind a tongue.
//!
//! Tuning, thresholds and the tests of physics play it; a musician plays through the [`player`](super::player).

use crate::bore::lattice::JET_LOSS_REFERENCE;
use crate::bore::sound_sources::SoundSources;
use crate::instrument::lip::embouchure;
use crate::instrument::listening::Listening;
use crate::instrument::model::Model;
#[cfg(feature = "fit")]
use crate::instrument::side_by_side::{BlownBeside, Stand};
use crate::instrument::voice::{Drive, TICK, Voice};
use crate::reed::ReedLaw;
use crate::reed::ReedTables;
use crate::reed::motion::TONGUE_FORCE;
use crate::reed::physical::{LAY_REFERENCE, ZETA_REFERENCE};
use crate::reed::{MovingReed, ReedCoeffs};

/// How a held note begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// The mouth pressure rises in so many ms.
    Ramp(f64),
    /// The tongue holds the reed for [`TONGUE_HOLD_S`] while the breath rises, and lets go in so many ms.
    Tongued(f64),
}

/// How long the machine's tongue holds the reed before it lets go, s.
pub const TONGUE_HOLD_S: f64 = 0.020;

/// A held note. [`new`](Self::new) gives the reference clarinet's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialNote {
    /// Index of the fingering in the instrument file.
    pub fingering: usize,
    /// Mouth pressure over the closing pressure.
    pub gamma: f64,
    /// Law of the reed.
    pub law: ReedLaw,
    /// Embouchure parameter zeta, the flow strength of the reed.
    pub zeta: f64,
    /// Half-width of the knee of the lay, 0 (sharp)..=0.5.
    pub lay: f64,
    /// Damping of the reed over that of the [lip rule](embouchure).
    pub damping: f64,
    /// Loss factor K of the jets in open holes.
    pub jet_loss: f64,
    /// Breath noise, 0..=1.
    pub noise: f64,
    /// Tuning delay, rows of round trip.
    pub rows: f64,
    /// How the note begins.
    pub start: Start,
    /// From where it is heard.
    pub listening: Listening,
}

impl TrialNote {
    /// A fingering (index in the file) at a mouth pressure over the closing pressure; everything else as on the reference
    /// clarinet, with the natural trim and without noise.
    ///
    /// # Panics
    /// If the model's tuning has no such fingering.
    pub fn new(model: &Model, fingering: usize, gamma: f64) -> Self {
        Self {
            fingering,
            gamma,
            law: ReedLaw::default(),
            zeta: ZETA_REFERENCE,
            lay: LAY_REFERENCE,
            damping: 1.0,
            jet_loss: JET_LOSS_REFERENCE,
            noise: 0.0,
            rows: model.tuning.notes[fingering].natural,
            start: Start::Ramp(20.0),
            listening: Listening::point(),
        }
    }

    /// A fingering under the lip that a player has at a dynamic, 0..=1, heard as by default.
    pub fn played(model: &Model, fingering: usize, dynamic: f64, gamma: f64) -> Self {
        let lip = model.player.lip(model.place(fingering), dynamic);
        let law = lip.law(ReedLaw::default());
        let listening = Listening::default();
        let new = Self::new(model, fingering, gamma);
        Self { law, zeta: new.zeta * lip.channel, lay: new.lay * lip.knee, listening, ..new }
    }

    /// The reed under the lip of this note.
    pub fn reed(&self, model: &Model) -> ReedCoeffs {
        let lip = embouchure(model.notes_hz[self.fingering], model.size_hz);
        let damping = lip.damping * self.damping;
        ReedCoeffs::new(
            MovingReed {
                law: self.law,
                zeta: self.zeta,
                lay: self.lay,
                resonance_hz: lip.resonance_hz,
                damping,
                swept_s: model.swept_s,
            },
            model.coeffs.rate_hz,
        )
    }

    /// A silent voice with the fingering, delay and reed of this note. Allocates.
    pub fn voice<F: crate::bore::lattice::Real>(&self, model: &Model) -> Voice<F> {
        let sources = SoundSources::of(&model.file);
        let mut voice =
            Voice::new(&model.coeffs, sources, &model.air, ReedTables::reference(), self.reed(model));
        for (hole, opening) in model.file.fingerings[self.fingering].opening().into_iter().enumerate() {
            voice.lattice_mut().set_opening(hole, opening);
        }
        voice.lattice_mut().set_jet_loss(self.jet_loss);
        voice.lattice_mut().glide_delay(self.rows, 0);
        voice.listen(&self.listening, false);
        voice
    }

    /// Mouth pressure and tongue force at `t` seconds, over the closing pressure of this reed.
    pub fn breath(&self, t: f64) -> (f64, f64) {
        match self.start {
            Start::Ramp(ms) => (self.gamma * (t / (1e-3 * ms)).min(1.0), 0.0),
            Start::Tongued(ms) => {
                let let_go = ((t - TONGUE_HOLD_S) / (1e-3 * ms)).clamp(0.0, 1.0);
                (self.gamma * (t / (0.5 * TONGUE_HOLD_S)).min(1.0), TONGUE_FORCE * (1.0 - let_go))
            }
        }
    }

    /// Plays for `seconds`; calls `heard` after each control tick with the radiated pressure (Pa at 1 m) and the voice.
    pub fn play(&self, model: &Model, seconds: f64, mut heard: impl FnMut(&[f32; TICK], &Voice<f32>)) {
        let mut voice: Voice<f32> = self.voice(model);
        let reed = self.reed(model);
        let rate_hz = model.coeffs.rate_hz;
        for tick in 0..ticks(seconds, rate_hz) {
            let out = *voice.tick(&self.drive(&reed, tick, rate_hz));
            heard(&out, &voice);
        }
    }

    /// What breath and tongue do in a tick.
    fn drive(&self, reed: &ReedCoeffs, tick: usize, rate_hz: f64) -> Drive {
        let (p_mouth, tongue) = self.breath((tick + 1) as f64 * TICK as f64 / rate_hz);
        let closing = reed.closing_pressure();
        let (p_mouth, tongue) = (p_mouth * closing, tongue * closing);
        Drive { p_mouth, tongue, noise: self.noise, reed: *reed }
    }

    /// The radiated pressure (Pa at 1 m) from `from_s` to `to_s`, at the internal rate. Allocates.
    pub fn radiated(&self, model: &Model, from_s: f64, to_s: f64) -> Vec<f64> {
        let mut all = Vec::with_capacity((to_s * model.coeffs.rate_hz) as usize + TICK);
        self.play(model, to_s, |out, _| all.extend(out.iter().map(|&x| f64::from(x))));
        all.split_off(((from_s * model.coeffs.rate_hz) as usize).min(all.len()))
    }

    /// As [`radiated`](Self::radiated), beside other notes: the same bits.
    #[cfg(feature = "fit")]
    pub(super) async fn radiated_beside(
        &self,
        stand: &Stand,
        model: &Model,
        from_s: f64,
        to_s: f64,
    ) -> Vec<f64> {
        let (reed, rate_hz) = (self.reed(model), model.coeffs.rate_hz);
        let voice = BlownBeside::new(model, self.voice(model), self.drive(&reed, 0, rate_hz));
        let begin = (from_s * rate_hz) as usize;
        let mut all = Vec::with_capacity(((to_s - from_s) * rate_hz) as usize + 2 * TICK);
        for tick in 0..ticks(to_s, rate_hz) {
            voice.tick(stand, self.drive(&reed, tick, rate_hz)).await;
            let skipped = begin.saturating_sub(tick * TICK).min(TICK);
            voice.with(|voice| all.extend(voice.heard().0[skipped..].iter().map(|&x| f64::from(x))));
        }
        all
    }
}

/// Ticks in so many seconds.
fn ticks(seconds: f64, rate_hz: f64) -> usize {
    (seconds * rate_hz / TICK as f64).round() as usize
}
