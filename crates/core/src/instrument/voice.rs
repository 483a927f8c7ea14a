//! One reed on one bore, at the internal rate: it makes the sound. It knows pressures and holes, not notes.

pub(super) mod choir;

use std::sync::Arc;

use crate::bore::lattice::{HoleFlows, Lattice, LatticeCoeffs, Real, Tip};
use crate::bore::sound_sources::SoundSources;
use crate::dsp::lanes::sum;
use crate::instrument::breath_noise::{BreathNoise, Jet};
pub use crate::instrument::control_tick::TICK;
use crate::instrument::listening::Listening;
use crate::instrument::outside::Outside;
use crate::instrument::pads::Pads;
use crate::instrument::person::Person;
use crate::instrument::vocal_tract::{TractCoeffs, TractState};
use crate::reed::ReedCoeffs;
use crate::reed::ReedLoad;
use crate::reed::ReedState;
use crate::reed::ReedTables;
use crate::reed::motion::TONGUE_FORCE;
use crate::reed::physical::P_REF_PA;
use crate::units::Air;

/// Ticks between two flushes of states that are too small to hear.
const FLUSH_TICKS: u32 = 256;

/// One sample of the inside of the instrument, at the internal rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// Mouth pressure over the closing pressure of the reed as the lip has it.
    pub gamma: f64,
    /// That closing pressure, Pa.
    pub closing_pa: f64,
    /// Reed opening over the rest opening, 0 closed, 1 at rest.
    pub opening: f64,
    /// Volume flow through the reed channel, m3/s.
    pub flow_m3s: f64,
    /// Pressure in the mouthpiece, Pa.
    pub p_mouthpiece_pa: f64,
    /// Radiated pressure as it is heard, in the left channel of two, Pa.
    pub p_radiated_pa: f64,
}

impl Probe {
    /// The same with `gamma` over another closing pressure, Pa: one that a moving lip does not change.
    pub fn over(self, closing_pa: f64) -> Self {
        if self.closing_pa == closing_pa || self.closing_pa == 0.0 {
            return self;
        }
        Self { gamma: self.gamma * self.closing_pa / closing_pa, closing_pa, ..self }
    }
}

/// What breath, lip and tongue do during one control tick. Pressures are over the reference closing pressure.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// Mouth pressure at the end of the tick.
    pub p_mouth: f64,
    /// Force of the tongue on the reed at the end of the tick; negative pulls.
    pub tongue: f64,
    /// Breath noise, 0..=1.
    pub noise: f64,
    /// The reed under the lip.
    pub reed: ReedCoeffs,
}

/// A sounding reed and bore. `F` is `f32` for playing live, `f64` for high quality and for proofs.
pub struct Voice<F = f32> {
    lattice: Lattice<F>,
    mouth: Mouth<F>,
    pads: Pads,
    ticks: u32,
    resets: u64,
}

/// Everything at the reed end, and the listener outside.
struct Mouth<F> {
    tables: &'static ReedTables,
    reed: ReedCoeffs,
    state: ReedState,
    /// 1 over the admittance of the first bore cell.
    kappa: f64,
    /// The reed before the bore, and before the tract's impedance that acts at once.
    load: ReedLoad,
    p_mouth: f64,
    p_mouth_glide: f64,
    tongue: f64,
    tongue_glide: f64,
    /// Mouth pressure and force of the tongue at the end of the tick.
    wanted: (f64, f64),
    noise: BreathNoise,
    /// The vocal tract, unless the throat is open.
    tract: Option<TractCoeffs>,
    tract_state: TractState,
    outside: Outside<F>,
    probes: Option<[Probe; TICK]>,
    at: usize,
    flow_unit: f64,
}

impl<F: Real> Mouth<F> {
    /// No pressure, no motion, no tongue, and the noise from its beginning.
    fn silence(&mut self) {
        self.state = ReedState::default();
        self.tract_state = TractState::default();
        (self.p_mouth, self.p_mouth_glide, self.tongue, self.tongue_glide) = (0.0, 0.0, 0.0, 0.0);
        self.outside.silence();
        self.noise.reset();
    }

    /// Pressure and tongue move on by a sample; the noise of the jet.
    #[inline(always)]
    fn blow(&mut self) -> f64 {
        self.p_mouth += self.p_mouth_glide;
        self.tongue += self.tongue_glide;
        self.noise.flow(self.state.flow, self.at)
    }

    /// The reed is where the tongue holds it with this force: no movement, no thump.
    fn hold_reed(&mut self, force: f64) {
        (self.state.closing, self.state.speed) = (force, 0.0);
        (self.tongue, self.tongue_glide) = (force, 0.0);
    }
}

impl<F: Real> Tip<F> for Mouth<F> {
    #[inline(always)]
    fn reflect(&mut self, p_minus: F) -> F {
        let noise = self.blow();
        let (load, p_mouth) = (&self.load, self.p_mouth);
        F::of(self.state.tick(&self.reed, self.tables, load, p_mouth, p_minus.wide(), noise, self.tongue))
    }

    #[inline(always)]
    fn radiated(&mut self, bell: F) {
        if let Some(probes) = &mut self.probes {
            probes[self.at & (TICK - 1)] = Probe {
                gamma: self.p_mouth / self.reed.closing_pressure(),
                closing_pa: self.reed.closing_pressure() * P_REF_PA,
                opening: self.state.opening,
                flow_m3s: self.state.flow * self.flow_unit,
                p_mouthpiece_pa: self.state.p_mouthpiece * P_REF_PA,
                p_radiated_pa: 0.0,
            };
        }
        self.outside.bell(self.at, bell);
        self.at += 1;
    }

    #[inline(always)]
    fn holes(&mut self, before: usize) -> Option<&mut HoleFlows<F>> {
        Some(self.outside.holes(self.at.wrapping_sub(before + 1)))
    }

    #[inline(always)]
    fn ended(&mut self, holes: &[(usize, usize)]) {
        // A run may end within a tick, where a delay arrives.
        if self.at == TICK {
            self.outside.radiate(holes);
        }
    }
}

/// The reed end of a player whose throat is not open. A kind of its own, so that an open throat costs nothing.
struct ThroughTract<'a, F> {
    mouth: &'a mut Mouth<F>,
    tract: TractCoeffs,
}

impl<F: Real> Tip<F> for ThroughTract<'_, F> {
    #[inline(always)]
    fn reflect(&mut self, p_minus: F) -> F {
        let Self { mouth, tract } = self;
        let (noise, p_minus) = (mouth.blow(), p_minus.wide());
        // The part of the tract's impedance that acts at once is in series with the bore's.
        let p_mouth = mouth.p_mouth - mouth.tract_state.pressure(tract);
        let (reed, load) = (&mouth.reed, &mouth.load);
        let mut p_plus = mouth.state.tick(reed, mouth.tables, load, p_mouth, p_minus, noise, mouth.tongue);
        // All that flows into the bore, reed's motion and noise included.
        let flow = (p_plus - p_minus) / load.kappa();
        p_plus -= tract.at_once() * flow;
        mouth.state.p_mouthpiece -= tract.at_once() * flow;
        mouth.tract_state.tick(tract, flow);
        F::of(p_plus)
    }

    #[inline(always)]
    fn radiated(&mut self, bell: F) {
        self.mouth.radiated(bell);
    }

    #[inline(always)]
    fn holes(&mut self, before: usize) -> Option<&mut HoleFlows<F>> {
        self.mouth.holes(before)
    }

    #[inline(always)]
    fn ended(&mut self, holes: &[(usize, usize)]) {
        self.mouth.ended(holes);
    }
}

/// Runs a tick; sample by sample while pads push air into the holes, so that the loop over samples need not know of them.
#[inline(always)]
fn run<F: Real, T: Tip<F>>(lattice: &mut Lattice<F>, pads: &mut Pads, tip: &mut T) {
    if !pads.attend(lattice) {
        return lattice.run(TICK, tip);
    }
    for _ in 0..TICK {
        pads.step(lattice);
        lattice.run(1, tip);
    }
}

impl<F: Real> Voice<F> {
    /// A silent voice with closed holes, whose `sources` are heard in one point. Allocates.
    pub fn new(
        coeffs: &Arc<LatticeCoeffs>,
        sources: SoundSources,
        air: &Air,
        tables: &'static ReedTables,
        reed: ReedCoeffs,
    ) -> Self {
        let rate = coeffs.rate_hz;
        let flow_unit = P_REF_PA / air.z_c(coeffs.nominal_radius_m);
        // Pressure at 1 m per change of flow in one sample, Pa.
        let loudness = air.rho / (4.0 * std::f64::consts::PI) * flow_unit * rate;
        Self {
            lattice: Lattice::new(coeffs),
            mouth: Mouth {
                tables,
                reed,
                state: ReedState::default(),
                kappa: 1.0 / coeffs.tip_admittance(),
                load: ReedLoad::default(),
                p_mouth: 0.0,
                p_mouth_glide: 0.0,
                tongue: 0.0,
                tongue_glide: 0.0,
                wanted: (0.0, 0.0),
                noise: BreathNoise::new(rate),
                tract: None,
                tract_state: TractState::default(),
                outside: Outside::new(coeffs, sources, air, loudness),
                probes: None,
                at: 0,
                flow_unit,
            },
            pads: Pads::new(coeffs, flow_unit),
            ticks: 0,
            resets: 0,
        }
    }

    /// The bore, for openings and delay.
    pub fn lattice_mut(&mut self) -> &mut Lattice<F> {
        &mut self.lattice
    }

    /// The bore.
    pub fn lattice(&self) -> &Lattice<F> {
        &self.lattice
    }

    /// Keeps to the code path without AVX2, see [`Lattice::without_avx2`].
    pub fn without_avx2(mut self) -> Self {
        self.lattice = self.lattice.without_avx2();
        self
    }

    /// Starts or stops recording [`Probe`]s. Real-time safe.
    pub fn set_probing(&mut self, on: bool) {
        self.mouth.probes = on.then(|| [Probe::default(); TICK]);
    }

    /// The probes of the last tick, if they are recorded.
    pub fn probes(&self) -> Option<&[Probe; TICK]> {
        self.mouth.probes.as_ref()
    }

    /// Moves the vocal tract's resonance; `None` opens the throat. Real-time safe.
    pub fn set_tract(&mut self, tract: Option<TractCoeffs>) {
        if tract.is_none() {
            self.mouth.tract_state = TractState::default();
        }
        self.mouth.tract = tract;
    }

    /// Makes the breath noise of one of several players, from its beginning.
    pub fn play_as(&mut self, person: &Person) {
        self.mouth.noise.play_as(person);
    }

    /// Chooses how the jet through the reed channel makes noise; steady at first. Real-time safe.
    pub fn set_jet(&mut self, jet: Jet) {
        self.mouth.noise.set_jet(jet);
    }

    /// How much is heard of pads and fingers, 0 at first ..= 1. Real-time safe.
    pub fn set_key_sounds(&mut self, amount: f64) {
        self.pads.set_amount(amount);
    }

    /// Listens in another way from the next tick on, with a right channel if `stereo`. Real-time safe.
    pub fn listen(&mut self, listening: &Listening, stereo: bool) {
        self.mouth.outside.listen(listening, stereo);
    }

    /// What the last tick sounded like, Pa: in the left or only channel, and in the right one where that is not the same.
    pub fn heard(&self) -> (&[f32; TICK], Option<&[f32; TICK]>) {
        self.mouth.outside.heard()
    }

    /// Advances one control tick and returns the radiated pressure, Pa, as it is heard in the left or only channel: at 1 m,
    /// or as if at 1 m. Real-time safe. [audio thread]
    ///
    /// A state that is no longer finite is reset to silence and counted; nothing else can fail.
    pub fn tick(&mut self, drive: &Drive) -> &[f32; TICK] {
        self.begin(drive);
        self.run();
        self.end();
        self.heard().0
    }

    /// What a tick needs to know.
    pub(super) fn begin(&mut self, drive: &Drive) {
        let mouth = &mut self.mouth;
        let rest_flow = mouth.reed.rest_flow(mouth.p_mouth, mouth.tongue);
        mouth.noise.begin(drive.noise, mouth.state.flow, rest_flow);
        mouth.reed = drive.reed;
        mouth.load = drive.reed.before(mouth.kappa + mouth.tract.map_or(0.0, |tract| tract.at_once()));
        mouth.p_mouth_glide = (drive.p_mouth - mouth.p_mouth) / TICK as f64;
        mouth.tongue_glide = (drive.tongue - mouth.tongue) / TICK as f64;
        mouth.wanted = (drive.p_mouth, drive.tongue);
        mouth.at = 0;
        let lattice = &self.lattice;
        mouth.outside.heed(lattice.is_moving(), |hole| lattice.is_open(hole));
    }

    /// The samples of a tick.
    #[inline(never)] // Compiled here for both numbers, so that who uses a voice need not compile it again.
    pub(super) fn run(&mut self) {
        let mouth = &mut self.mouth;
        mouth.noise.fill();
        match mouth.tract {
            None => run(&mut self.lattice, &mut self.pads, mouth),
            Some(tract) => run(&mut self.lattice, &mut self.pads, &mut ThroughTract { mouth, tract }),
        }
    }

    /// What comes after the samples of a tick.
    pub(super) fn end(&mut self) {
        let mouth = &mut self.mouth;
        if let Some(probes) = &mut mouth.probes {
            for (probe, &pressure) in probes.iter_mut().zip(mouth.outside.heard().0) {
                probe.p_radiated_pa = f64::from(pressure);
            }
        }
        (mouth.p_mouth, mouth.tongue) = mouth.wanted;
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks.is_multiple_of(FLUSH_TICKS) {
            self.lattice.flush();
        }
        let state = self.mouth.state;
        let (heard, right) = self.heard();
        let sum = sum(heard) + right.map_or(0.0, |right| sum(right));
        if !(sum + (state.closing + state.speed + state.p_mouthpiece) as f32).is_finite() {
            self.silence();
            self.resets += 1;
        }
    }

    /// Back to the beginning: silence, all holes closed, the tongue on the reed. Real-time safe.
    pub fn reset(&mut self) {
        self.lattice.reset();
        self.pads.silence();
        self.mouth.silence();
        self.mouth.hold_reed(TONGUE_FORCE);
        self.ticks = 0;
    }

    /// Cuts a note off: [`silence`](Self::silence), with the tongue on the reed. Real-time safe.
    pub fn cut(&mut self) {
        self.silence();
        self.mouth.hold_reed(TONGUE_FORCE);
    }

    /// Takes away all waves and all motion of the reed; openings and delay stay. Real-time safe.
    pub fn silence(&mut self) {
        self.lattice.silence();
        self.pads.silence();
        self.mouth.silence();
        self.ticks = 0;
    }

    /// Puts the reed where the tongue holds it with a force over the reference closing pressure, without a sound. Real-time safe.
    pub fn hold_reed(&mut self, force: f64) {
        self.mouth.hold_reed(force);
    }

    /// How often a state that was not finite was reset.
    pub fn resets(&self) -> u64 {
        self.resets
    }

    /// Pressure in the mouthpiece in the last sample, over the reference closing pressure.
    pub fn p_mouthpiece(&self) -> f64 {
        self.mouth.state.p_mouthpiece
    }

    /// Displacement, speed, flow and pressure of the reed now.
    pub fn reed(&self) -> ReedState {
        self.mouth.state
    }

    /// The state of the reed, for tests that disturb it.
    pub fn reed_mut(&mut self) -> &mut ReedState {
        &mut self.mouth.state
    }
}
