//! The instrument as a CLAP and VST3 plugin.
//!
//! This module only translates: parameters to settings, host events to the instrument's, one voice to two equal
//! channels. Notes are sounding pitch, as everywhere outside the instrument. What is heard depends on the events and
//! their sample positions alone, not on the host's blocks, and is what the offline renderer writes; except that another
//! instrument, chosen while somebody listens, comes when it is made.

mod breaths;
pub mod instrument;
#[cfg(feature = "devices")]
mod knob;
mod params;
mod reed_sources;
#[cfg(feature = "standalone")]
pub mod standalone;
mod translate;
mod window;

use std::sync::Arc;

use nice_plug::context::gui::AsyncExecutor;
use nice_plug::prelude::*;

pub use params::{BreathParams, ChalumeauParams, EmbouchureParams, KnobParams, NoiseParams};
pub use params::{InstrumentParams, OutputParams, PhysicalReedParams, ReedParams};
pub use params::{SCHEMA, TuningChoice, TuningParams};

use crate::identity;
use breaths::{Breaths, Way};
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::Settings;
use instrument::{Bench, Workshop};
use reed_sources::ReedSources;
use translate::Translator;
use window::Window;

/// The plugin: parameters, and from the first `activate` on a clarinet.
#[derive(Default)]
pub struct Chalumeau {
    params: Arc<ChalumeauParams>,
    /// The clarinet that plays.
    bench: Option<Bench>,
    workshop: Option<Workshop>,
    /// What the clarinet has been given.
    settings: Settings,
    translator: Translator,
    reed_sources: ReedSources,
    #[cfg(feature = "devices")]
    knob: Option<(knob::Knob, knob::Audio)>,
    window: Option<(Window, window::Audio)>,
    /// Where breath has come from.
    breaths: Breaths,
    /// Whether a file is rendered: nobody holds a knob then.
    offline: bool,
    /// Where *Breath* was last; at rest until it moves.
    breath: f32,
    panic: bool,
}

impl Plugin for Chalumeau {
    const NAME: &'static str = identity::NAME;
    const VENDOR: &'static str = identity::VENDOR;
    const URL: &'static str = identity::URL;
    const EMAIL: &'static str = identity::EMAIL;
    const VERSION: &'static str = identity::VERSION;
    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] =
        &[AudioIOLayout { main_output_channels: NonZeroU32::new(2), ..AudioIOLayout::const_default() }];
    const MIDI_INPUT: MidiConfig = MidiConfig::MidiCCs;
    /// A knob's breath, as CC2 and CC34, so that a host can record it.
    const MIDI_OUTPUT: MidiConfig = MidiConfig::MidiCCs;
    const SAMPLE_ACCURATE_AUTOMATION: bool = true;
    /// Some hosts send every MIDI controller of every channel (2080) at once; beyond the capacity the wrapper allocates.
    const INPUT_EVENT_CAPACITY: usize = 4096;

    type Editor = window::Frame;
    type SysExMessage = ();
    type BackgroundTask = ();

    fn params(&self) -> Arc<dyn Params> {
        self.params.clone()
    }

    fn editor(&mut self, _: AsyncExecutor<Self>) -> Option<Self::Editor> {
        self.open_shop();
        self.window.as_mut()?.0.frame()
    }

    fn filter_state(state: &mut PluginState) {
        params::mend(state);
    }

    fn activate(
        &mut self,
        _layout: &AudioIOLayout,
        config: &BufferConfig,
        context: &mut impl ActivateContext<Self>,
    ) -> bool {
        self.offline = config.process_mode == ProcessMode::Offline;
        self.open_shop();
        let Some(workshop) = &mut self.workshop else { return false };
        if let Err(reason) = workshop.activate(&mut self.bench, f64::from(config.sample_rate), self.offline) {
            nice_error!("cannot play: {reason}");
            return false;
        }
        #[cfg(feature = "devices")]
        {
            let shared = workshop.shared();
            if let Some((_, audio)) = &mut self.knob {
                audio.prepare(&self.params, shared);
            }
        }
        self.settings = self.params.settings();
        if let Some(bench) = &mut self.bench {
            bench.set_settings(&self.settings);
            context.set_latency_samples(bench.clarinet().latency_samples());
        }
        self.reset();
        true
    }

    fn reset(&mut self) {
        self.translator.reset();
        self.reed_sources.reset();
        self.breaths = Breaths::default();
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            audio.reset();
        }
        self.breath = 0.0;
        self.panic = self.params.output.panic.value();
        if let Some(bench) = &mut self.bench {
            bench.reset();
        }
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        _aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let [out, copies @ ..] = buffer.as_slice() else { return ProcessStatus::Normal };
        let Some(bench) = &mut self.bench else {
            return ProcessStatus::Error("not activated");
        };

        let settings = self.params.settings();
        if settings != self.settings {
            bench.set_settings(&settings);
            self.settings = settings;
        }
        if self.offline {
            bench.wait_for(self.params.instrument.choice.value() as u32);
        }
        bench.tidy();
        let moved = moved(&self.params, &mut self.panic, &mut self.breath);
        let api = context.plugin_api();
        let translator = &mut self.translator;
        let bent = translator.bend_range(self.params.instrument.bend_range.value());
        let reed_sources = &mut self.reed_sources;
        let breaths = &mut self.breaths;
        if let Some(Timed { event: Event::Breath(unit), .. }) = moved[1] {
            breaths.blow(Way::Parameter, unit);
        }
        let pressed = self.window.as_mut().map(|(_, window)| window.keys()).unwrap_or_default();
        for timed in pressed.iter().flatten() {
            if let Event::NoteOn { velocity, .. } = timed.event {
                breaths.press(velocity);
            }
        }
        let sources = [self.params.knob.h_source.value(), self.params.knob.k_source.value()];
        let played = std::iter::from_fn(|| context.next_event()).flat_map(|event| {
            if reed_sources.take(&event, sources) {
                let at = event.timing() as usize;
                [None, reed_sources.changed(sources).map(|event| Timed { at, event })]
            } else {
                let events = translator.translate(event, api);
                let blew = events.iter().flatten().any(|timed| matches!(timed.event, Event::Breath(_)));
                breaths.hear(&event, blew);
                events
            }
            .into_iter()
            .flatten()
        });
        let events =
            moved.into_iter().flatten().chain(bent).chain(pressed.into_iter().flatten()).chain(played);
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            let replay = self.params.knob.replay.value();
            let stage = knob::Stage { rate_hz: bench.rate_hz(), offline: self.offline, replay };
            audio.render(bench, &settings, events, stage, out);
            audio.reed(self.reed_sources.factors(sources));
            for &(at, breath) in audio.sent() {
                self.breaths.blow(Way::Knob, breath.unit());
                let (coarse, fine) = breath.bytes();
                for (cc, byte) in [(2, coarse), (34, fine)] {
                    let value = f32::from(byte) / 127.0;
                    // A host that takes no events loses a recording, not the sound.
                    let _ = context.try_send_event(NoteEvent::MidiCC {
                        timing: at as u32,
                        channel: 0,
                        cc,
                        value,
                    });
                }
            }
        }
        #[cfg(not(feature = "devices"))]
        bench.render_events(events, out);

        if let Some((_, window)) = &mut self.window {
            window.show(bench, &self.breaths, out);
        }
        for copy in copies {
            copy.copy_from_slice(out);
        }
        if bench.clarinet().is_silent() { ProcessStatus::Normal } else { ProcessStatus::KeepAlive }
    }

    fn deactivate(&mut self) {
        self.reset();
    }
}

impl Chalumeau {
    /// Starts the threads beside audio, once.
    fn open_shop(&mut self) {
        let params = &self.params;
        let workshop = self.workshop.get_or_insert_with(|| Workshop::start(params.clone()));
        let instruments = workshop.shared();
        #[cfg(feature = "devices")]
        let (knob, _) =
            self.knob.get_or_insert_with(|| knob::Knob::start(params.clone(), instruments.clone()));
        let beside = || Beside {
            params: params.clone(),
            instruments: instruments.clone(),
            #[cfg(feature = "devices")]
            knob: knob.shared().clone(),
        };
        self.window.get_or_insert_with(|| Window::start(&beside()));
    }
}

/// What the threads beside audio share.
#[derive(Clone)]
struct Beside {
    params: Arc<ChalumeauParams>,
    instruments: Arc<instrument::Shared>,
    #[cfg(feature = "devices")]
    knob: Arc<knob::Shared>,
}

/// What the parameters that act by moving have done since the last block. Real-time safe.
fn moved(params: &ChalumeauParams, panic: &mut bool, breath: &mut f32) -> [Option<Timed<Event>>; 2] {
    let pressed = params.output.panic.value();
    let panicked = !std::mem::replace(panic, pressed) && pressed;
    let blown = params.breath.breath.value();
    let breathed = std::mem::replace(breath, blown) != blown;
    [panicked.then_some(Event::Panic), breathed.then_some(Event::Breath(blown))]
        .map(|event| event.map(|event| Timed { at: 0, event }))
}

impl ClapPlugin for Chalumeau {
    const CLAP_ID: &'static str = identity::CLAP_ID;
    const CLAP_DESCRIPTION: Option<&'static str> = Some(identity::DESCRIPTION);
    const CLAP_MANUAL_URL: Option<&'static str> = None;
    const CLAP_SUPPORT_URL: Option<&'static str> = None;
    const CLAP_FEATURES: &'static [ClapFeature] =
        &[ClapFeature::Instrument, ClapFeature::Synthesizer, ClapFeature::Stereo];
}

impl Vst3Plugin for Chalumeau {
    const VST3_CLASS_ID: [u8; 16] = identity::VST3_CLASS_ID;
    const VST3_SUBCATEGORIES: &'static [Vst3SubCategory] =
        &[Vst3SubCategory::Instrument, Vst3SubCategory::Synth, Vst3SubCategory::Stereo];
}

mod export {
    // A plugin's entry points are C functions: the macros below are the one place for that.
    #![allow(unsafe_code)]

    use super::Chalumeau;

    nice_plug::nice_export_clap!(Chalumeau);
    nice_plug::nice_export_vst3!(Chalumeau);
}
