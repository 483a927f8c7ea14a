//! The whole instrument at the host's sample rate: events in, samples out.
//!
//! The voice runs at its internal rate on a fixed control grid; host samples are pulled from it, so output does not
//! depend on how the host cuts its blocks. What bends a note beyond the lip is the speed of the internal clock, see
//! [`bend`](super::bend).

use std::sync::Arc;

use crate::dsp::limiter::Limiter;
use crate::dsp::resampler::Resampler;
use crate::event::{Event, Timed};
use crate::instrument::embouchure::embouchure;
use crate::instrument::model::{BuildError, Model};
use crate::instrument::player::Player;
use crate::instrument::settings::Settings;
use crate::instrument::voice::{Probe, Voice};
use crate::instrument::watch::{Now, Watch};
use crate::reed::ReedCoeffs;
use crate::reed::ReedLaw;
use crate::reed::ReedTables;
use crate::reed::motion::TONGUE_FORCE;
use crate::units::REFERENCE_RADIUS_M;

/// Full scale per pascal at 1 m from a B flat clarinet: 1 Pa is -6 dBFS. A larger instrument is heard from further away, in
/// proportion to its nominal bore: two that differ only in size are equally loud, and a bass does not live in the limiter.
const FULL_SCALE_PER_PA: f64 = 0.501_187_233_627_272_2;
/// Silence: -120 dBFS.
const SILENCE: f32 = 1e-6;
/// Samples of silence after which a resting instrument counts as silent.
const QUIET_SAMPLES: u32 = 4_096;
/// Host samples between two looks at level and limiter.
const CHUNK: usize = 64;

/// Up to this rate of the lattice, Hz, single precision is enough. What rounding leaves between the harmonics grows with
/// the rate over the note: at twice the live rate a bass clarinet had -78 dB, with double precision it has -126 and less
/// (`docs/findings.md`).
const SINGLE_BELOW_HZ: f64 = 100_000.0;

/// The voice in the precision that its rate asks for.
enum Sounding {
    Single(Box<Voice<f32>>),
    Double(Box<Voice<f64>>),
}

/// The same with the voice, whatever its precision.
macro_rules! of {
    ($sounding:expr, $voice:ident => $body:expr) => {
        match $sounding {
            Sounding::Single($voice) => $body,
            Sounding::Double($voice) => $body,
        }
    };
}

/// A playable clarinet.
pub struct Clarinet {
    model: Arc<Model>,
    player: Player,
    voice: Sounding,
    resampler: Resampler,
    limiter: Limiter,
    /// The inside, while somebody looks.
    watch: Watch,
    watched: bool,
    full_scale_per_pa: f64,
    gain: f32,
    gain_wanted: f32,
    gain_step: f32,
    /// Samples of silence put out since the player came to rest.
    quiet: u32,
    resets: u64,
}

impl Clarinet {
    /// The built-in B flat clarinet at a host rate of 22.05..=384 kHz. Allocates.
    pub fn built_in(host_rate_hz: f64) -> Result<Self, BuildError> {
        Ok(Self::new(Arc::new(Model::built_in(host_rate_hz)?), host_rate_hz))
    }

    /// Any instrument, made ready for this host rate by [`Model`]. Allocates.
    pub fn new(model: Arc<Model>, host_rate_hz: f64) -> Self {
        let lip = embouchure(model.lowest_hz, model.lowest_hz);
        let (swept, rate) = (model.swept_s, model.coeffs.rate_hz);
        let reed = ReedCoeffs::new(ReedLaw::default(), 0.3, 0.4, lip.resonance_hz, lip.damping, swept, rate);
        let tables = ReedTables::seed();
        let mut voice = if rate > SINGLE_BELOW_HZ {
            Sounding::Double(Box::new(Voice::new(&model.coeffs, &model.air, tables, reed)))
        } else {
            Sounding::Single(Box::new(Voice::new(&model.coeffs, &model.air, tables, reed)))
        };
        of!(&mut voice, voice => voice.hold_reed(TONGUE_FORCE));
        let resampler = Resampler::new(rate, host_rate_hz);
        let full_scale_per_pa = FULL_SCALE_PER_PA * (REFERENCE_RADIUS_M / model.file.nominal_radius_m);
        let gain = gain_of(&Settings::default(), full_scale_per_pa);
        let watch = Watch::new(rate, model.lowest_hz);
        Self {
            model,
            player: Player::default(),
            voice,
            resampler,
            limiter: Limiter::new(host_rate_hz),
            watch,
            watched: false,
            full_scale_per_pa,
            gain,
            gain_wanted: gain,
            // A change of gain takes 20 ms per factor of one.
            gain_step: (1.0 / (0.02 * host_rate_hz)) as f32,
            quiet: 0,
            resets: 0,
        }
    }

    /// Takes new settings; heard from the next control tick on. Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.player.set_settings(settings);
        self.gain_wanted = gain_of(self.player.settings(), self.full_scale_per_pa);
    }

    /// What the player does now. Real-time safe.
    pub fn apply(&mut self, event: Event) {
        of!(&mut self.voice, voice => self.player.apply(event, &self.model, voice));
        self.quiet = 0;
    }

    /// Goes on where the player of another instrument is: keys, breath, bend. For a new instrument. Real-time safe.
    pub fn carry_on(&mut self, from: &Self) {
        of!(&mut self.voice, voice => self.player.carry_on(&from.player, &self.model, voice));
        self.gain = self.gain_wanted;
    }

    /// Overwrites `out` with the next samples, mono. Real-time safe.
    pub fn render(&mut self, out: &mut [f32]) {
        self.render_with(out, &mut None);
    }

    /// Renders one block with its events, which must be in order of time. Real-time safe.
    pub fn render_events(&mut self, events: impl IntoIterator<Item = Timed<Event>>, out: &mut [f32]) {
        let mut done = 0;
        for Timed { at, event } in events {
            let at = at.clamp(done, out.len());
            self.render(&mut out[done..at]);
            self.apply(event);
            done = at;
        }
        self.render(&mut out[done..]);
    }

    /// As [`render`](Self::render), calling `probe` once per internal sample, in order of time.
    pub fn render_probed(&mut self, out: &mut [f32], probe: &mut dyn FnMut(Probe)) {
        of!(&mut self.voice, voice => voice.set_probing(true));
        self.render_with(out, &mut Some(probe));
        of!(&mut self.voice, voice => voice.set_probing(false));
    }

    /// Keeps moments inside for a screen, or no longer. Real-time safe.
    pub fn set_watched(&mut self, on: bool) {
        if self.watched != on {
            self.watched = on;
            self.watch.restart();
            of!(&mut self.voice, voice => voice.set_probing(on));
        }
    }

    /// Moments inside; see [`set_watched`](Self::set_watched).
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// What the player is at. Real-time safe.
    pub fn now(&self) -> Now {
        self.player.now()
    }

    fn render_with(&mut self, out: &mut [f32], probe: &mut Option<&mut dyn FnMut(Probe)>) {
        for out in out.chunks_mut(CHUNK) {
            let mut made = self.resampler.pull(out);
            while made < out.len() {
                of!(&mut self.voice, voice => {
                    let drive = self.player.tick(&self.model, voice);
                    let samples = voice.tick(&drive);
                    self.resampler.push(samples, self.player.speed());
                    if let Some(probes) = voice.probes() {
                        if let Some(probe) = probe.as_mut() {
                            probes.iter().for_each(|&moment| probe(moment));
                        }
                        if self.watched && self.watch.take(probes) {
                            voice.set_probing(probe.is_some());
                        }
                    } else if self.watched && self.watch.rest() {
                        voice.set_probing(true);
                    }
                });
                made += self.resampler.pull(&mut out[made..]);
            }
            for sample in &mut *out {
                if self.gain != self.gain_wanted {
                    let step = (self.gain_wanted - self.gain) * self.gain_step;
                    self.gain = if step.abs() < 1e-9 { self.gain_wanted } else { self.gain + step };
                }
                *sample *= self.gain;
            }
            if out.iter().sum::<f32>().is_finite() {
                // The loudest altissimo comes within 1 dB of full scale; only more than that is turned down.
                self.limiter.process(out);
                let audible = out.iter().any(|sample| sample.abs() > SILENCE);
                self.quiet = if audible || !self.player.is_resting() {
                    0
                } else {
                    self.quiet.saturating_add(out.len() as u32)
                };
            } else {
                out.fill(0.0);
                of!(&mut self.voice, voice => voice.reset());
                self.resampler.reset();
                self.limiter.reset();
                self.resets += 1;
            }
        }
    }

    /// Silence, and every state as new; settings stay. Real-time safe.
    pub fn reset(&mut self) {
        self.player.reset();
        of!(&mut self.voice, voice => {
            voice.reset();
            voice.hold_reed(TONGUE_FORCE);
            voice.lattice_mut().glide_delay(0.0, 0);
            for hole in 0..self.model.coeffs.holes() {
                voice.lattice_mut().set_opening(hole, 0.0);
            }
        });
        self.resampler.reset();
        self.limiter.reset();
        self.gain = self.gain_wanted;
        self.quiet = 0;
    }

    /// Delay of the output filter, host samples. Bends leave it; only downwards and by more than the host's rate leaves
    /// room for (an octave at 48 kHz, nothing at 96 kHz) it grows by their ratio.
    pub fn latency_samples(&self) -> u32 {
        self.resampler.latency_out_samples().round() as u32
    }

    /// Sample rate of the lattice while its clock runs at speed 1, Hz: 96 000, or 88 200 for hosts of the 44.1 kHz family;
    /// twice that in high quality.
    pub fn internal_rate_hz(&self) -> f64 {
        self.model.coeffs.rate_hz
    }

    /// The instrument that is played.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// True when nothing moves any more and no breath comes: the host may sleep.
    pub fn is_silent(&self) -> bool {
        self.quiet > QUIET_SAMPLES
    }

    /// How often a non-finite state had to be reset since the start.
    pub fn resets(&self) -> u64 {
        self.resets + of!(&self.voice, voice => voice.resets())
    }

    /// Keeps the plain code path, see [`Lattice::without_avx2`](crate::bore::lattice::Lattice::without_avx2).
    #[doc(hidden)]
    pub fn without_avx2(mut self) -> Self {
        self.voice = match self.voice {
            Sounding::Single(voice) => Sounding::Single(Box::new(voice.without_avx2())),
            Sounding::Double(voice) => Sounding::Double(Box::new(voice.without_avx2())),
        };
        self
    }

    /// The voice inside, to be disturbed by tests. Not at twice the rate.
    #[doc(hidden)]
    pub fn voice_mut(&mut self) -> &mut Voice<f32> {
        match &mut self.voice {
            Sounding::Single(voice) => voice,
            // PANIC: for tests, which ask for no other rate.
            Sounding::Double(_) => unreachable!("single precision at live rates only"),
        }
    }
}

fn gain_of(settings: &Settings, full_scale_per_pa: f64) -> f32 {
    (full_scale_per_pa * 10.0_f64.powf(f64::from(settings.gain_db) / 20.0)) as f32
}
