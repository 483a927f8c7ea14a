//! One reed on one bore, at the internal rate: it makes the sound. It knows pressures and holes, not notes.

use std::sync::Arc;

use crate::bore::lattice::{Lattice, LatticeCoeffs, Real, Tip};
use crate::reed::ReedCoeffs;
use crate::reed::ReedState;
use crate::reed::ReedTables;
use crate::reed::physical::P_REF_PA;
use crate::units::Air;

/// Samples of one control tick. Everything a player moves, moves on this grid, counted from the last reset.
pub const TICK: usize = 16;
/// Ticks between two flushes of states that are too small to hear.
const FLUSH_TICKS: u32 = 64;
/// Breath noise at `noise` = 1: rms of the noise flow over the mean flow it rides on (by level: -40 dB under
/// a mezzo-forte fundamental at the default 0.3).
const NOISE_FLOW: f64 = 0.018;
/// Below this flow the jet is laminar and quiet: a Reynolds number of 25 in a channel 13 mm wide, about a hundredth of
/// the flow in a soft note. After the breath has ended, the flow in the bore decays only as 1 / t; it must not hiss.
const LAMINAR_FLOW: f64 = 0.002;
/// Corners of the noise band, Hz: turbulence in the channel is broad around a few kHz (physics notes, by judgement).
const NOISE_BAND_HZ: (f64, f64) = (600.0, 5_000.0);

/// One sample of the inside of the instrument, at the internal rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// Mouth pressure over the closing pressure of the reed as it is set.
    pub gamma: f64,
    /// Reed opening over the rest opening, 0 closed, 1 at rest.
    pub opening: f64,
    /// Volume flow through the reed channel, m3/s.
    pub flow_m3s: f64,
    /// Pressure in the mouthpiece, Pa.
    pub p_mouthpiece_pa: f64,
    /// Radiated pressure at 1 m, Pa.
    pub p_radiated_pa: f64,
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
    mouth: Mouth,
    ticks: u32,
    resets: u64,
}

/// Everything at the reed end, and the listener outside.
struct Mouth {
    tables: &'static ReedTables,
    reed: ReedCoeffs,
    state: ReedState,
    kappa: f64,
    p_mouth: f64,
    p_mouth_glide: f64,
    tongue: f64,
    tongue_glide: f64,
    noise: f64,
    random: u64,
    noise_low: f64,
    noise_band: f64,
    noise_corners: (f64, f64),
    hiss: [f64; TICK],
    flows: [f64; TICK],
    last_flow: f64,
    /// Radiated pressure at 1 m per change of flow, Pa.
    loudness: f64,
    out: [f32; TICK],
    probes: Option<[Probe; TICK]>,
    at: usize,
    flow_unit: f64,
}

/// Seed of the breath noise: any constant does; with a constant, renders repeat.
const NOISE_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

impl Mouth {
    /// Turbulence for the next tick: white noise between two corners. Computed outside the loop over samples, which has no
    /// registers to spare.
    ///
    /// The white noise comes from a linear congruential generator (Knuth, The Art of Computer Programming 2, 3.3.4: MMIX);
    /// its upper bits are heard, uniform with unit variance.
    fn breathe(&mut self) {
        if self.noise == 0.0 {
            return;
        }
        let (low, high) = self.noise_corners;
        let unit = high * 1.732_050_807_568_877_2 / (1_u64 << 63) as f64;
        let (mut random, mut smooth, mut drift) = (self.random, self.noise_low, self.noise_band);
        for hiss in &mut self.hiss {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            smooth += unit * (random as i64) as f64 - high * smooth;
            drift += low * (smooth - drift);
            *hiss = smooth - drift;
        }
        (self.random, self.noise_low, self.noise_band) = (random, smooth, drift);
    }

    /// Radiates a tick's flows: the pressure of a small source is proportional to the change of its flow.
    fn radiate(&mut self) {
        let mut before = self.last_flow;
        for (out, &flow) in self.out.iter_mut().zip(&self.flows) {
            *out = ((flow - before) * self.loudness) as f32;
            before = flow;
        }
        self.last_flow = before;
        if let Some(probes) = &mut self.probes {
            for (probe, &pressure) in probes.iter_mut().zip(&self.out) {
                probe.p_radiated_pa = f64::from(pressure);
            }
        }
    }
}

impl<F: Real> Tip<F> for Mouth {
    #[inline(always)]
    fn reflect(&mut self, p_minus: F) -> F {
        self.p_mouth += self.p_mouth_glide;
        self.tongue += self.tongue_glide;
        // Turbulence rides on the jet: no flow, no noise.
        let turbulent = (self.state.flow.abs() - LAMINAR_FLOW).max(0.0);
        let noise = self.noise * turbulent * self.hiss[self.at & (TICK - 1)];
        let p_plus = self.state.tick(
            &self.reed,
            self.tables,
            self.kappa,
            self.p_mouth,
            p_minus.wide(),
            noise,
            self.tongue,
        );
        F::of(p_plus)
    }

    #[inline(always)]
    fn radiated(&mut self, flow: F) {
        let at = self.at & (TICK - 1);
        self.flows[at] = flow.wide();
        if let Some(probes) = &mut self.probes {
            probes[at] = Probe {
                gamma: self.p_mouth / self.reed.closing_pressure(),
                opening: self.state.opening,
                flow_m3s: self.state.flow * self.flow_unit,
                p_mouthpiece_pa: self.state.p_mouthpiece * P_REF_PA,
                p_radiated_pa: 0.0,
            };
        }
        self.at += 1;
    }
}

impl<F: Real> Voice<F> {
    /// A silent voice with closed holes. Allocates.
    pub fn new(
        coeffs: &Arc<LatticeCoeffs>,
        air: &Air,
        tables: &'static ReedTables,
        reed: ReedCoeffs,
    ) -> Self {
        let rate = coeffs.rate_hz;
        let flow_unit = P_REF_PA / air.z_c(coeffs.nominal_radius_m);
        let corner = |hz: f64| 1.0 - (-std::f64::consts::TAU * hz / rate).exp();
        Self {
            lattice: Lattice::new(coeffs),
            mouth: Mouth {
                tables,
                reed,
                state: ReedState::default(),
                kappa: 1.0 / coeffs.tip_admittance(),
                p_mouth: 0.0,
                p_mouth_glide: 0.0,
                tongue: 0.0,
                tongue_glide: 0.0,
                noise: 0.0,
                random: NOISE_SEED,
                noise_low: 0.0,
                noise_band: 0.0,
                noise_corners: (corner(NOISE_BAND_HZ.0), corner(NOISE_BAND_HZ.1)),
                hiss: [0.0; TICK],
                flows: [0.0; TICK],
                last_flow: 0.0,
                loudness: air.rho / (4.0 * std::f64::consts::PI) * flow_unit * rate,
                out: [0.0; TICK],
                probes: None,
                at: 0,
                flow_unit,
            },
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

    /// Advances one control tick and returns the radiated pressure at 1 m, Pa. Real-time safe. [audio thread]
    ///
    /// A state that is no longer finite is reset to silence and counted; nothing else can fail.
    pub fn tick(&mut self, drive: &Drive) -> &[f32; TICK] {
        let mouth = &mut self.mouth;
        mouth.reed = drive.reed;
        mouth.p_mouth_glide = (drive.p_mouth - mouth.p_mouth) / TICK as f64;
        mouth.tongue_glide = (drive.tongue - mouth.tongue) / TICK as f64;
        mouth.noise = drive.noise * NOISE_FLOW;
        mouth.at = 0;
        mouth.breathe();
        self.lattice.run(TICK, mouth);
        mouth.radiate();
        (mouth.p_mouth, mouth.tongue) = (drive.p_mouth, drive.tongue);
        self.ticks = self.ticks.wrapping_add(1);
        if self.ticks.is_multiple_of(FLUSH_TICKS) {
            self.lattice.flush();
        }
        let state = self.mouth.state;
        if !(self.mouth.out.iter().sum::<f32>() + (state.closing + state.speed + state.p_mouthpiece) as f32)
            .is_finite()
        {
            self.reset();
            self.resets += 1;
        }
        &self.mouth.out
    }

    /// Puts the reed where a tongue of this force (over the reference closing pressure) holds it, without the thump of the
    /// movement. Real-time safe.
    pub fn hold_reed(&mut self, tongue: f64) {
        self.mouth.state = ReedState { closing: tongue, ..ReedState::default() };
        self.mouth.tongue = tongue;
    }

    /// Resets to silence, with the noise generator and the tick counter; openings and delay stay. Real-time safe.
    pub fn reset(&mut self) {
        self.lattice.reset();
        let mouth = &mut self.mouth;
        mouth.state = ReedState::default();
        (mouth.p_mouth, mouth.p_mouth_glide, mouth.tongue, mouth.tongue_glide) = (0.0, 0.0, 0.0, 0.0);
        (mouth.noise_low, mouth.noise_band, mouth.last_flow) = (0.0, 0.0, 0.0);
        mouth.random = NOISE_SEED;
        mouth.out = [0.0; TICK];
        self.ticks = 0;
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
