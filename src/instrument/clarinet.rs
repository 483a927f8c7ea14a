//! The whole instrument at the host's sample rate. (Interface first: the voice behind it is still a sine.)

use crate::event::{Event, Timed};
use crate::instrument::Settings;

/// One moment of the inside of the instrument, at the internal rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// Mouth pressure over the closing pressure.
    pub gamma: f64,
    /// Reed opening over the rest opening, 0 closed, 1 at rest.
    pub opening: f64,
    /// Volume flow into the bore, m3/s.
    pub flow_m3s: f64,
    /// Pressure in the mouthpiece, Pa.
    pub p_mouthpiece_pa: f64,
    /// Radiated pressure at 1 m, Pa.
    pub p_radiated_pa: f64,
}

/// A playable clarinet: events in, samples out.
pub struct Clarinet {
    host_rate: f64,
    phase: f64,
    hz: f64,
    gate: f64,
    settings: Settings,
}

impl Clarinet {
    /// The built-in B flat clarinet at a host rate of 22.05..=384 kHz. Allocates.
    pub fn built_in(host_rate_hz: f64) -> Result<Self, String> {
        if !(22_050.0..=384_000.0).contains(&host_rate_hz) {
            return Err(format!("sample rate must lie in 22050..384000 Hz, got {host_rate_hz}"));
        }
        Ok(Self { host_rate: host_rate_hz, phase: 0.0, hz: 440.0, gate: 0.0, settings: Settings::default() })
    }

    /// Takes new settings; heard from the next control tick on. Real-time safe.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.settings = settings.clamped();
    }

    /// What the player does now. Real-time safe.
    pub fn apply(&mut self, event: Event) {
        match event {
            Event::NoteOn { note, velocity } => {
                self.hz = note.frequency_hz(f64::from(self.settings.a4_hz));
                self.gate = f64::from(velocity);
            }
            Event::NoteOff { .. } | Event::Panic => self.gate = 0.0,
            Event::Breath(_) | Event::Bend { .. } => {}
        }
    }

    /// Overwrites `out` with the next samples, mono. Real-time safe.
    pub fn render(&mut self, out: &mut [f32]) {
        for sample in out {
            self.phase = (self.phase + self.hz / self.host_rate).fract();
            *sample = (0.1 * self.gate * (self.phase * std::f64::consts::TAU).sin()) as f32;
        }
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
        self.render(out);
        out.iter().for_each(|_| probe(Probe::default()));
    }

    /// Silence, and every state as new; settings stay. Real-time safe.
    pub fn reset(&mut self) {
        self.gate = 0.0;
        self.phase = 0.0;
    }

    /// Delay of the output filter, host samples.
    pub fn latency_samples(&self) -> u32 {
        0
    }

    /// Sample rate of the lattice, Hz: 96 000, or 88 200 for hosts of the 44.1 kHz family.
    pub fn internal_rate_hz(&self) -> f64 {
        96_000.0
    }

    /// True when nothing moves any more and no breath comes: the host may sleep.
    pub fn is_silent(&self) -> bool {
        self.gate == 0.0
    }

    /// How often a non-finite state had to be reset since the start.
    pub fn resets(&self) -> u64 {
        0
    }
}
