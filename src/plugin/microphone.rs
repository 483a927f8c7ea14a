//! A microphone as a source of breath: what comes in at the plugin's audio input, and the breath that it becomes.
//!
//! It hears nothing until the user switches it on. While it blows, other breath is dropped, but for a knob's, which
//! goes before. An input that nothing is connected to gives exact zeros: then everything is as without a microphone.

use std::iter::Peekable;

use super::params::ChalumeauParams;
use super::params::moment::Moment;
use crate::editor::snapshot::MicrophoneState;
use chalumeau_core::control::wind::{WindCoeffs, WindDesign, WindMeter};
use chalumeau_core::event::{Event, PartEvent, Timed};

/// The plugin's ear. Real-time safe, but for [`prepare`](Self::prepare).
#[derive(Default)]
pub struct Microphone {
    meter: Option<WindMeter>,
    /// What was heard of this block, one channel.
    heard: Vec<f32>,
    /// Samples of this block that the meter has taken.
    at: usize,
    is_on: bool,
    /// Breath has come from it since it was switched on.
    has_blown: bool,
    /// The room is being measured for the project.
    measures: bool,
}

impl Microphone {
    /// Makes it ready for a rate in Hz and blocks of so many samples. Allocates.
    pub fn prepare(&mut self, rate_hz: f64, most_samples: u32) {
        self.meter = Some(WindMeter::new(WindCoeffs::new(rate_hz), WindDesign::default()));
        self.heard = Vec::with_capacity(most_samples as usize);
    }

    /// Forgets what it has heard.
    pub fn reset(&mut self) {
        if let Some(meter) = &mut self.meter {
            meter.reset();
        }
        self.heard.clear();
        (self.at, self.has_blown) = (0, false);
    }

    /// Takes what came in, the mean of all channels, before the block is played.
    pub fn hear<C: AsRef<[f32]>>(&mut self, channels: &[C]) {
        self.heard.clear();
        let share = 1.0 / channels.len().max(1) as f32;
        let samples = channels.iter().map(|channel| channel.as_ref().len()).min().unwrap_or(0);
        let mean = |at: usize| share * channels.iter().map(|channel| channel.as_ref()[at]).sum::<f32>();
        // A host keeps to the length that it has announced.
        self.heard.extend((0..samples.min(self.heard.capacity())).map(mean));
    }

    /// Begins a block with what the user wants; the event that it begins with, if any.
    pub fn begin_block(&mut self, params: &ChalumeauParams) -> Option<Event> {
        self.at = 0;
        self.is_on = params.microphone.on.value();
        let meter = self.meter.as_mut().filter(|_| self.is_on);
        let Some(meter) = meter else {
            // Not to be carried out some day.
            params.moments.take(Moment::Calibrate);
            if std::mem::take(&mut self.has_blown) {
                self.reset();
                return Some(Event::BreathFromKeys);
            }
            return None;
        };
        if params.moments.take(Moment::Calibrate) {
            meter.calibrate();
            self.measures = true;
        }
        if !meter.is_calibrating() {
            meter.set_design(params.room_floor.design());
        }
        None
    }

    /// Whether it blows, or would if somebody did.
    pub fn is_blown(&self) -> bool {
        self.is_on && self.meter.as_ref().is_some_and(WindMeter::is_there)
    }

    /// What the window tells of it.
    pub fn state(&self) -> MicrophoneState {
        let Some(meter) = self.meter.as_ref().filter(|_| self.is_on) else { return MicrophoneState::Off };
        match meter.calibration_left_s() {
            _ if !meter.is_there() => MicrophoneState::Unconnected,
            Some(left_s) => MicrophoneState::Measuring { left_s: left_s as f32 },
            None => MicrophoneState::Listening { floor_dbfs: meter.design().floor_dbfs },
        }
    }

    /// The breath now, 0..=1.
    pub fn breath(&self) -> f32 {
        self.meter.as_ref().map_or(0.0, WindMeter::breath)
    }

    /// The events of a block of so many samples, with its breath between them, in order of time.
    pub fn with<E>(&mut self, events: E, samples: usize) -> WithBreath<'_, E>
    where
        E: Iterator<Item = Timed<PartEvent>>,
    {
        WithBreath { microphone: self, events: events.peekable(), samples }
    }

    /// Hears the block to its end, and keeps a room that has been measured. Whether it is a new one.
    pub fn end_block(&mut self, samples: usize, params: &ChalumeauParams) -> bool {
        while self.at < samples && self.is_on {
            self.next_breath();
        }
        self.heard.clear();
        let Some(meter) = self.meter.as_ref().filter(|meter| self.is_on && !meter.is_calibrating()) else {
            return false;
        };
        // Only what was measured: a project that is being loaded brings a room of its own.
        std::mem::take(&mut self.measures) && params.room_floor.replace(meter.design())
    }

    /// Hears one sample; the breath, if it decides there.
    fn next_breath(&mut self) -> Option<f32> {
        let sample = self.heard.get(self.at).copied().unwrap_or(0.0);
        self.at += 1;
        let meter = self.meter.as_mut()?;
        let breath = meter.tick(sample)?;
        if !meter.is_there() {
            return None;
        }
        self.has_blown = true;
        Some(breath)
    }
}

/// The host's events and the microphone's breath.
pub struct WithBreath<'a, E: Iterator<Item = Timed<PartEvent>>> {
    microphone: &'a mut Microphone,
    events: Peekable<E>,
    samples: usize,
}

impl<E: Iterator<Item = Timed<PartEvent>>> Iterator for WithBreath<'_, E> {
    type Item = Timed<PartEvent>;

    fn next(&mut self) -> Option<Self::Item> {
        if !self.microphone.is_on {
            return self.events.next();
        }
        loop {
            let until = self.events.peek().map_or(self.samples, |event| event.at.min(self.samples));
            while self.microphone.at < until {
                let at = self.microphone.at;
                if let Some(unit) = self.microphone.next_breath() {
                    return Some(Timed { at, event: Event::Breath(unit).into() });
                }
            }
            let event = self.events.next()?;
            let is_breath = matches!(event.event.event, Event::Breath(_) | Event::BreathFromKeys);
            if !(is_breath && self.microphone.is_blown()) {
                return Some(event);
            }
        }
    }
}
