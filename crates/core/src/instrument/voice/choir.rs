//! Voices of one instrument side by side: what each does in every sample is done for all of them at once, a voice to a lane.
//!
//! A voice in a lane gives the bits that it gives alone: reed, noise and bore do the same in the same order. What is done once a
//! tick each voice does itself. A voice is in a lane for one tick after another and can leave after each: its waves
//! alone stay in the lane, until it takes them back.

use super::{FLUSH_TICKS, Probe, TICK, Voice};
use crate::bore::lattice::LatticeCoeffs;
use crate::bore::lattice::choir::{LatticeChoir, Tips};
use crate::instrument::breath_noise::NoiseLanes;
use crate::reed::ReedTables;
use crate::reed::motion::choir::ReedChoir;
use crate::reed::physical::P_REF_PA;

/// Up to `N` voices.
pub(in crate::instrument) struct Choir<const N: usize> {
    bores: LatticeChoir<N>,
    mouths: Mouths<N>,
}

/// The reed ends of all lanes.
struct Mouths<const N: usize> {
    tables: &'static ReedTables,
    reeds: ReedChoir<N>,
    p_mouth: [f64; N],
    p_mouth_glide: [f64; N],
    tongue: [f64; N],
    tongue_glide: [f64; N],
    noise: NoiseLanes<N>,
}

/// Voices in their lanes; a lane may be empty.
pub(in crate::instrument) type Lanes<'a, const N: usize> = [Option<&'a mut Voice<f32>>; N];

/// The reed ends while they play.
struct Playing<'a, 'v, const N: usize> {
    mouths: &'a mut Mouths<N>,
    voices: &'a mut Lanes<'v, N>,
    /// Some throat is not open, or somebody records the inside.
    is_special: bool,
    /// The turbulence of all voices is filled in at once.
    hiss_together: bool,
}

impl<const N: usize> Tips<N> for Playing<'_, '_, N> {
    #[inline(always)]
    fn begin(&mut self) {
        if self.hiss_together {
            self.mouths.noise.fill();
        }
    }

    #[inline(always)]
    fn reflect(&mut self, at: usize, p_minus: &[f32; N]) -> [f32; N] {
        let mouths = &mut *self.mouths;
        for k in 0..N {
            mouths.p_mouth[k] += mouths.p_mouth_glide[k];
            mouths.tongue[k] += mouths.tongue_glide[k];
        }
        let noise = mouths.noise.flow(mouths.reeds.flows(), at);
        let p_minus = p_minus.map(f64::from);
        let mut p_mouth = mouths.p_mouth;
        if self.is_special {
            lead(self.voices, &mut p_mouth);
        }
        let mut p_plus = mouths.reeds.tick(mouths.tables, &p_mouth, &p_minus, &noise, &mouths.tongue);
        if self.is_special {
            follow(self.voices, mouths, at, &p_minus, &mut p_plus);
        }
        p_plus.map(|p_plus| p_plus as f32)
    }

    #[inline(always)]
    fn ended(&mut self, bores: &LatticeChoir<N>) {
        for (lane, voice) in self.voices.iter_mut().enumerate() {
            if let Some(voice) = voice {
                voice.mouth.outside.radiate_lane(lane, bores);
            }
        }
    }
}

/// See [`ThroughTract`](super::ThroughTract): the part of the pressure that this sample's flow does not change. Not inlined: few
/// throats are not open.
#[inline(never)]
fn lead<const N: usize>(voices: &Lanes<'_, N>, p_mouth: &mut [f64; N]) {
    for (voice, p_mouth) in voices.iter().zip(p_mouth) {
        if let Some(Voice { mouth, .. }) = voice
            && let Some(tract) = &mouth.tract
        {
            *p_mouth -= mouth.tract_state.pressure(tract);
        }
    }
}

/// The part of the tract's impedance that acts at once; and what is recorded of the inside.
#[inline(never)]
fn follow<const N: usize>(
    voices: &mut Lanes<'_, N>,
    mouths: &mut Mouths<N>,
    at: usize,
    p_minus: &[f64; N],
    p_plus: &mut [f64; N],
) {
    for (lane, voice) in voices.iter_mut().enumerate() {
        let Some(Voice { mouth, .. }) = voice else { continue };
        if let Some(tract) = &mouth.tract {
            let flow = (p_plus[lane] - p_minus[lane]) / mouth.load.kappa();
            p_plus[lane] -= tract.at_once() * flow;
            *mouths.reeds.p_mouthpiece_mut(lane) -= tract.at_once() * flow;
            mouth.tract_state.tick(tract, flow);
        }
        if let Some(probes) = &mut mouth.probes {
            let state = mouths.reeds.state(lane);
            probes[at & (TICK - 1)] = Probe {
                gamma: mouths.p_mouth[lane] / mouth.reed.closing_pressure(),
                closing_pa: mouth.reed.closing_pressure() * P_REF_PA,
                opening: state.opening,
                flow_m3s: state.flow * mouth.flow_unit,
                p_mouthpiece_pa: state.p_mouthpiece * P_REF_PA,
                p_radiated_pa: 0.0,
            };
        }
    }
}

impl<const N: usize> Choir<N> {
    /// Empty lanes. Allocates.
    pub fn new(coeffs: &LatticeCoeffs) -> Self {
        let none = [0.0; N];
        Self {
            bores: LatticeChoir::new(coeffs),
            mouths: Mouths {
                tables: ReedTables::reference(),
                reeds: ReedChoir::default(),
                p_mouth: none,
                p_mouth_glide: none,
                tongue: none,
                tongue_glide: none,
                noise: NoiseLanes::new(),
            },
        }
    }

    /// Keeps to the code path without AVX2.
    pub fn without_avx2(self) -> Self {
        Self { bores: self.bores.without_avx2(), ..self }
    }

    /// Whether a lane can play the next tick of a voice that has begun it. Real-time safe.
    pub fn can_play(voice: &mut Voice<f32>) -> bool {
        // Pads push air into the holes sample by sample; and the lanes of a choir know a delay's glide for whole ticks.
        !voice.pads.attend(&voice.lattice) && !voice.lattice.delay_arrives_within(TICK)
    }

    /// Plays a tick that all voices have begun and that lanes [can play](Self::can_play). Real-time safe. [audio thread]
    pub fn run(&mut self, mut voices: Lanes<'_, N>) {
        self.bores.clear();
        let mut is_special = false;
        let hiss_together = voices.iter().flatten().all(|voice| voice.mouth.noise.is_turbulent());
        for (lane, voice) in voices.iter_mut().enumerate() {
            let Some(voice) = voice else { continue };
            self.bores.begin(lane, &mut voice.lattice);
            let (mouth, mouths) = (&mut voice.mouth, &mut self.mouths);
            mouths.reeds.take(lane, &mouth.reed, &mouth.load, &mouth.state);
            (mouths.p_mouth[lane], mouths.p_mouth_glide[lane]) = (mouth.p_mouth, mouth.p_mouth_glide);
            (mouths.tongue[lane], mouths.tongue_glide[lane]) = (mouth.tongue, mouth.tongue_glide);
            mouths.noise.take(lane, &mut mouth.noise, hiss_together);
            is_special |= mouth.tract.is_some() || mouth.probes.is_some();
        }
        let mouths = &mut self.mouths;
        self.bores.run(&mut Playing { mouths, voices: &mut voices, is_special, hiss_together });
        // An empty lane is flushed with others: what it holds is of no account, but may not grow too small to compute with.
        let (mut flushed, mut playing, mut any) = ([true; N], [false; N], false);
        for (lane, voice) in voices.iter_mut().enumerate() {
            let Some(voice) = voice else { continue };
            voice.mouth.state = self.mouths.reeds.state(lane);
            self.mouths.noise.give_back(lane, &mut voice.mouth.noise, hiss_together);
            self.bores.end(lane, &mut voice.lattice);
            flushed[lane] = voice.ticks.wrapping_add(1).is_multiple_of(FLUSH_TICKS);
            playing[lane] = true;
            any |= flushed[lane];
        }
        if any {
            self.bores.flush(flushed, playing);
            self.mouths.noise.flush();
        }
    }

    /// A voice takes its waves back. Real-time safe.
    pub fn leave(&self, lane: usize, voice: &mut Voice<f32>) {
        self.bores.give_back(lane, &mut voice.lattice);
    }
}
