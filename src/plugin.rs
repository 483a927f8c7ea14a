//! The instrument as a CLAP and VST3 plugin.
//!
//! This module only translates: parameters to settings, the host's events to the instrument's events, one voice to two
//! channels. Notes are sounding pitch, as everywhere outside the instrument. The sound depends on the events and
//! their sample positions alone, not on the host's blocks, and it is what the offline renderer writes. There is one
//! exception: during live playing, another instrument and the preset of a MIDI program come as soon as they are ready.
//!
//! - `host_inputs`: what is remembered of the host's events; `translate_events`: what they mean; `breath_sources` and
//!   `reed_controllers`, `part_reeds`: where breath and reed changes come from
//! - `instrument_loading`: loads and exchanges instruments
//! - `knob`: the force-feedback knob (feature `devices`)
//! - `params`: what hosts automate and projects save
//! - `preset_keeper`: the user's presets, and MIDI program changes
//! - `window`: the editor in the host's window
//! - `host_link`: what the plugin's threads tell the host; `clap`: what the framework's CLAP lacks
//! - `launch_options`: what the standalone program sets
//! - `microphone`: breath from the audio input
//! - `vst3`: the classes of the VST3

mod breath_sources;
mod clap;
mod host_inputs;
mod host_link;
pub mod instrument_loading;
#[cfg(feature = "devices")]
mod knob;
pub mod launch_options;
mod microphone;
pub mod mts_esp;
mod params;
mod part_reeds;
mod preset_keeper;
mod reed_controllers;
mod translate_events;
mod vst3;
mod window;

use std::sync::Arc;

use nice_plug::context::gui::AsyncExecutor;
use nice_plug::midi::{Channel, Key, VoiceID};
use nice_plug::prelude::*;

pub use params::ChalumeauParams;
pub use params::instrument::InstrumentChoice;

use crate::controllers::breath_input::BreathInput;
use crate::identity;
use crate::parameters::InUse;
use chalumeau_core::control::notes::Note;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::{Channels, MOST_PLAYERS, Reach, Settings};
#[cfg(feature = "devices")]
use chalumeau_knob::device::Release;
use host_inputs::HostInputs;
use instrument_loading::{InstrumentLoader, InstrumentSwap, SharedInstrument};
use microphone::Microphone;
use params::knob::ReedSource;
use params::moment::Moment;
use preset_keeper::{PresetHandle, PresetKeeper};
use window::{HostWindow, PluginWindow, WindowAudio};

/// What the framework hands on to a plugin instance.
pub enum Task {
    /// The CLAP's layer asks who it is.
    Introduce(clap::Introduction),
    /// The knob's controller asks whether the main thread lives.
    #[cfg(feature = "devices")]
    Pulse,
}

/// The plugin. It has parameters from the start, and a clarinet from the first activation.
#[derive(Default)]
pub struct Chalumeau {
    params: Arc<ChalumeauParams>,
    shared_instrument: Arc<SharedInstrument>,
    instrument: Option<InstrumentSwap>,
    loader: Option<InstrumentLoader>,
    presets: Option<PresetKeeper>,
    /// The settings that the instrument has.
    settings: Settings,
    inputs: HostInputs,
    /// The settings and the instrument, by its address, of which inputs and knob know what the keys play.
    keys_of: Option<(Reach, usize)>,
    microphone: Microphone,
    moved: MovedParameters,
    #[cfg(feature = "devices")]
    knob: Option<(knob::PluginKnob, knob::KnobAudio)>,
    window: Option<(PluginWindow, WindowAudio)>,
    /// Answers for the host's main thread, and how to ask it.
    #[cfg(feature = "devices")]
    main_pulse: Arc<knob::MainPulse>,
    #[cfg(feature = "devices")]
    executor: Option<AsyncExecutor<Self>>,
    /// Whether the host's transport ran in the last block.
    transport_ran: bool,
    /// Whether the host renders a file, in which a live knob has no effect.
    offline: bool,
}

/// Two channels of sound, and these of a microphone: how the plugin stands where it has no side-chain.
pub const fn layout(inputs: Option<NonZeroU32>) -> AudioIOLayout {
    AudioIOLayout {
        main_input_channels: inputs,
        main_output_channels: NonZeroU32::new(2),
        ..AudioIOLayout::const_default()
    }
}

impl Plugin for Chalumeau {
    const NAME: &'static str = identity::NAME;
    const VENDOR: &'static str = identity::VENDOR;
    const URL: &'static str = identity::URL;
    const EMAIL: &'static str = identity::EMAIL;
    const VERSION: &'static str = identity::VERSION;
    /// The CLAP's: a side-chain for a microphone, and two channels of sound.
    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] = &[AudioIOLayout {
        main_output_channels: NonZeroU32::new(2),
        aux_input_ports: &[new_nonzero_u32(1)],
        names: PortNames { aux_inputs: &[identity::MICROPHONE_NAME], ..PortNames::const_default() },
        ..AudioIOLayout::const_default()
    }];
    const MIDI_INPUT: MidiConfig = MidiConfig::MidiCCs;
    /// The plugin sends the knob's breath as CC2 and CC34, so that a host can record it.
    const MIDI_OUTPUT: MidiConfig = MidiConfig::MidiCCs;
    const SAMPLE_ACCURATE_AUTOMATION: bool = true;
    /// Some hosts send every MIDI controller of every channel (2080 events) at once. Beyond this capacity the wrapper
    /// allocates.
    const INPUT_EVENT_CAPACITY: usize = 4096;

    type Editor = HostWindow;
    type SysExMessage = ();
    type BackgroundTask = Task;

    fn task_executor(&mut self) -> TaskExecutor<Self> {
        let (params, instrument) = (self.params.clone(), self.shared_instrument.clone());
        #[cfg(feature = "devices")]
        let pulse = self.main_pulse.clone();
        Box::new(move |task| match task {
            Task::Introduce(clap::Introduction(tell)) => {
                let (params, instrument) = (params.clone(), instrument.clone());
                // Who asks waits for the answer.
                let _ = tell.send(clap::Introduced { params, instrument });
            }
            #[cfg(feature = "devices")]
            Task::Pulse => pulse.answer(),
        })
    }

    fn params(&self) -> Arc<dyn Params> {
        self.params.clone()
    }

    fn editor(&mut self, executor: AsyncExecutor<Self>) -> Option<Self::Editor> {
        #[cfg(feature = "devices")]
        {
            self.executor = Some(executor);
            self.main_pulse.begin_here();
        }
        #[cfg(not(feature = "devices"))]
        drop(executor);
        self.start_threads();
        self.window.as_mut()?.0.host_window()
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
        self.start(config, context)
    }

    fn reset(&mut self) {
        self.forget();
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        if let Some(side_chain) = aux.inputs.first_mut() {
            self.hear(side_chain.as_slice());
        }
        self.play(buffer.as_slice(), context)
    }

    fn deactivate(&mut self) {
        self.forget();
    }
}

/// What every kind of the plugin does: this one, and those that contain it.
impl Chalumeau {
    /// Makes the plugin ready to play. `false` if there is no instrument for this rate. [main thread]
    pub fn start<P: Plugin<SysExMessage = ()>>(
        &mut self,
        config: &BufferConfig,
        context: &mut impl ActivateContext<P>,
    ) -> bool {
        self.offline = config.process_mode == ProcessMode::Offline;
        // Another instrument may come to lie where one was.
        self.keys_of = None;
        self.start_threads();
        let Some(loader) = &mut self.loader else { return false };
        let activated = loader.activate(&mut self.instrument, f64::from(config.sample_rate), self.offline);
        if let Err(reason) = activated {
            nice_error!("cannot play: {reason}");
            return false;
        }
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            audio.prepare(&self.params, &self.shared_instrument, config.max_buffer_size as usize);
        }
        self.microphone.prepare(f64::from(config.sample_rate), config.max_buffer_size);
        self.settings = self.params.settings();
        if let Some(instrument) = &mut self.instrument {
            instrument.set_settings(&self.settings);
            // Nobody asks the standalone program for its latency, and the framework would print that it cannot tell.
            if context.plugin_api() != PluginApi::Standalone {
                context.set_latency_samples(instrument.clarinet().latency_samples());
            }
            context.set_current_voice_capacity(self.settings.players.parts() as u32);
        }
        self.forget();
        true
    }

    /// Ends the link to the knob, and waits until the take that is open is complete. For a program that ends without dropping the
    /// plugin.
    #[cfg(feature = "standalone")]
    pub fn leave_knob(&mut self) {
        #[cfg(feature = "devices")]
        drop(self.knob.take());
    }

    /// Silences everything, and forgets notes and breath. Real-time safe.
    pub fn forget(&mut self) {
        self.inputs.reset();
        self.microphone.reset();
        self.moved.reset(&self.params);
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            audio.reset();
        }
        if let Some((_, window)) = &mut self.window {
            window.forget_keys();
        }
        if let Some(instrument) = &mut self.instrument {
            // What linked controllers have said to single players is forgotten, too, and no player is on the way from it.
            instrument.set_settings(&self.settings);
            instrument.reset();
        }
    }

    /// Takes what a microphone has heard of the block that is played next, in as many channels. Real-time safe.
    pub fn hear<C: AsRef<[f32]>>(&mut self, channels: &[C]) {
        if self.params.microphone.on.value() {
            self.microphone.hear(channels);
        }
    }

    /// Renders one block into all `channels`, which are of the same length. Real-time safe.
    pub fn play<P: Plugin<SysExMessage = ()>>(
        &mut self,
        channels: &mut [&mut [f32]],
        context: &mut impl ProcessContext<P>,
    ) -> ProcessStatus {
        let [left, others @ ..] = channels else { return ProcessStatus::Normal };
        let samples = left.len();
        let out = match others {
            [right, ..] => Channels::two(left, right),
            [] => Channels::one(left),
        };
        // In a render a program acts from its sample on: the framework begins a block there.
        if self.offline
            && let Some(presets) = &self.presets
            && let Some(program) = self.inputs.first_program(|| context.next_event())
        {
            presets.handle().ask(program);
        }
        let Some((settings, has_changed)) = self.follow_settings(context) else {
            return ProcessStatus::Error("not activated");
        };
        self.heed_transport(context.transport().playing);
        let drives = self.begin_inputs(&settings, has_changed);
        let Some(instrument) = &mut self.instrument else {
            return ProcessStatus::Error("not activated");
        };
        let inputs = &mut self.inputs;
        let api = context.plugin_api();
        let links = &self.params.links;
        let events = std::iter::from_fn(|| inputs.next(|| context.next_event(), api, drives, links));
        let events = self.microphone.with(events, samples);
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            let replay = self.params.knob.replay.value();
            let block = knob::BlockContext { rate_hz: instrument.rate_hz(), offline: self.offline, replay };
            audio.render(instrument, &settings, events, block, out);
            audio.set_reed_factors(self.inputs.reed_factors(drives));
        }
        #[cfg(not(feature = "devices"))]
        instrument.render_events(events, out);

        if self.microphone.end_block(samples, &self.params) {
            // A project that was saved has another room.
            self.params.host.state_changed();
        }
        if self.microphone.is_blown() {
            self.inputs.breath_sources().blow(BreathInput::Microphone, self.microphone.breath());
        }
        if let (Some(program), Some(presets)) = (self.inputs.take_program(), &self.presets) {
            presets.handle().ask(program);
        }
        let ensemble = instrument.ensemble();
        let last = samples.saturating_sub(1) as u32;
        self.inputs.fall_silent(last, |player| ensemble.is_silent_player(player));
        #[cfg(feature = "devices")]
        for &(_, breath) in self.knob.iter().flat_map(|(_, audio)| audio.sent()) {
            self.inputs.breath_sources().blow(BreathInput::Knob, breath.unit());
        }
        #[cfg(feature = "devices")]
        let blown =
            self.knob.iter().flat_map(|(_, audio)| audio.sent()).map(|(at, breath)| (*at, breath.bytes()));
        #[cfg(not(feature = "devices"))]
        let blown = std::iter::empty();
        answer(context, self.inputs.ended(), blown);
        #[cfg(feature = "devices")]
        if let Some((_, audio)) = &mut self.knob {
            audio.send_sound(instrument.rate_hz(), left);
        }
        if let Some((_, window)) = &mut self.window {
            window.send(instrument, self.inputs.breath_sources(), left);
        }
        if let Some(right) = others.first_mut() {
            instrument.pan(left, right);
        }
        if let Some((_, window)) = &self.window {
            window.send_output([left, others.first().map_or(left, |right| right)]);
            window.send_microphone(self.microphone.state());
        }
        let is_watched = self.window.as_ref().is_some_and(|(_, window)| window.is_open());
        self.params.fall_back();
        rest_status(&self.params, instrument, is_watched)
    }

    /// Gives the instrument the settings of this block, and says whether they are others than before; `None` without an instrument.
    /// Real-time safe, unless a host renders offline.
    fn follow_settings<P: Plugin<SysExMessage = ()>>(
        &mut self,
        context: &mut impl ProcessContext<P>,
    ) -> Option<(Settings, bool)> {
        let instrument = self.instrument.as_mut()?;
        if let Some(presets) = self.presets.as_ref().filter(|_| self.offline) {
            presets.handle().wait();
        }
        let own = self.params.settings();
        let are_retied = self.inputs.set_links(&self.params.links.links(&own));
        // Where a linked controller has spoken last, its value counts.
        let settings = self.inputs.linked(own);
        self.inputs.set_curves(self.params.curves.now(&settings));
        // A link that is gone may have left its value with a player who is not the first.
        let has_changed = are_retied || settings != self.settings;
        if has_changed {
            instrument.set_settings(&settings);
            if settings.players != self.settings.players {
                context.set_current_voice_capacity(settings.players.parts() as u32);
            }
            self.settings = settings;
        }
        if self.offline {
            instrument.wait_for(self.params.instrument.choice.value() as u32);
        }
        instrument.receive();
        // The new instrument's keys count while the old one fades: what it cannot play, it leaves out.
        let model = instrument.newest().first().model();
        let of = Some((settings.reach, Arc::as_ptr(model).addr()));
        if std::mem::replace(&mut self.keys_of, of) != of {
            let notes = settings.reach.key_notes(model);
            self.inputs.playing_keys(notes.playing());
            #[cfg(feature = "devices")]
            if let Some((_, audio)) = &mut self.knob {
                audio.set_notes(notes);
            }
        }
        Some((settings, has_changed))
    }

    /// A knob lets go where the host's transport stops. Real-time safe.
    fn heed_transport(&mut self, runs: bool) {
        let ran = std::mem::replace(&mut self.transport_ran, runs);
        if ran && !runs {
            // A host may end overlapping notes of one key with one message when it stops.
            self.inputs.forget_repeats();
            #[cfg(feature = "devices")]
            if let Some((_, audio)) = &self.knob {
                audio.let_go(Release::TransportStopped);
            }
        }
    }

    /// Begins the block of the inputs, and takes in what parameters, microphone and the keys of the window say at its start. Gives
    /// what drives H and k. Real-time safe.
    fn begin_inputs(&mut self, settings: &Settings, has_changed: bool) -> [ReedSource; 2] {
        let inputs = &mut self.inputs;
        inputs.begin_block(settings.players.parts());
        if has_changed {
            inputs.say_links();
        }
        if self.params.moments.take(Moment::Panic) {
            inputs.silence();
            // A breath source that hangs is why one presses it.
            inputs.breath_sources().forget();
            inputs.say(Event::BreathFromKeys.into());
        }
        let drives = [self.params.knob.h_source.value(), self.params.knob.k_source.value()];
        inputs.breath_from(self.params.breath.from.value().into());
        if let Some(unit) = self.moved.breath(&self.params) {
            inputs.breath_sources().blow(BreathInput::Parameter, unit);
            inputs.say(Event::Breath(unit).into());
        }
        if let Some(event) = self.microphone.begin_block(&self.params) {
            inputs.breath_sources().forget();
            inputs.say(event.into());
        }
        inputs.bend_range(self.params.instrument.bend_range.value());
        inputs.wheel(self.params.expression.wheel.value().into(), drives);
        inputs.reed_sources(drives);
        inputs.key_switches(settings.reach.key_switches);
        let keys = self.window.as_mut().map(|(_, window)| window.keys()).unwrap_or_default();
        keys.into_iter().flatten().for_each(|event| inputs.window_key(event));
        drives
    }

    /// Starts the threads of loader, presets, knob and window, once.
    fn start_threads(&mut self) {
        let (params, instrument) = (&self.params, &self.shared_instrument);
        self.loader.get_or_insert_with(|| InstrumentLoader::start(params.clone(), instrument.clone()));
        let presets = self.presets.get_or_insert_with(|| PresetKeeper::start(params.clone()));
        #[cfg(feature = "devices")]
        let (knob, _) = self.knob.get_or_insert_with(|| {
            let executor = self.executor.take();
            let ask_main =
                executor.map(|main| Box::new(move || main.execute_gui(Task::Pulse)) as Box<dyn Fn() + Send>);
            knob::PluginKnob::start(params.clone(), instrument.clone(), self.main_pulse.clone(), ask_main)
        });
        let handles = || SharedHandles {
            params: params.clone(),
            instrument: instrument.clone(),
            presets: presets.handle().clone(),
            #[cfg(feature = "devices")]
            knob: knob.shared().clone(),
        };
        self.window.get_or_insert_with(|| PluginWindow::start(&handles()));
    }
}

#[cfg(feature = "standalone")]
impl Chalumeau {
    /// Its parameters, for who keeps them without a host.
    pub fn shared_params(&self) -> Arc<ChalumeauParams> {
        self.params.clone()
    }
}

/// Hands tasks of the plugin on through the framework's wrapper of a plugin that contains it.
pub fn executor_of<P>(outer: AsyncExecutor<P>) -> AsyncExecutor<Chalumeau>
where
    P: Plugin<BackgroundTask = <Chalumeau as Plugin>::BackgroundTask>,
{
    let background = outer.clone();
    AsyncExecutor::new(
        Arc::new(move |task| background.execute_background(task)),
        Arc::new(move |task| outer.execute_gui(task)),
    )
}

/// Handles to what the threads of one plugin instance share.
#[derive(Clone)]
struct SharedHandles {
    params: Arc<ChalumeauParams>,
    instrument: Arc<SharedInstrument>,
    presets: PresetHandle,
    #[cfg(feature = "devices")]
    knob: Arc<knob::SharedKnob>,
}

/// What the host may do after a block: at rest the sound lasts for the tail, and in silence the host may stop until the next
/// event. A knob blows without events, and an open window shows what happens. Real-time safe.
fn rest_status(params: &ChalumeauParams, instrument: &InstrumentSwap, is_watched: bool) -> ProcessStatus {
    let is_heard = params.microphone.on.value();
    let may_sleep = instrument.is_silent() && !is_watched && !is_heard && !params.is_in_use(InUse::WithKnob);
    params.host.set_may_sleep(may_sleep);
    if instrument.ensemble().is_resting() && !is_heard {
        ProcessStatus::Tail((instrument.tail_s() * instrument.rate_hz()) as u32)
    } else {
        ProcessStatus::KeepAlive
    }
}

/// The parameter that acts when it moves: *Breath*. Real-time safe.
#[derive(Default)]
struct MovedParameters {
    /// The value of *Breath* in the last block.
    breath: f32,
}

impl MovedParameters {
    fn reset(&mut self, params: &ChalumeauParams) {
        // Breath counts as moved if it is not at rest.
        *self = Self::default();
        params.moments.take(Moment::Panic);
    }

    /// Where *Breath* has moved since the last block.
    fn breath(&mut self, params: &ChalumeauParams) -> Option<f32> {
        let breath = params.breath.breath.value();
        let has_moved = std::mem::replace(&mut self.breath, breath) != breath;
        has_moved.then_some(breath)
    }
}

/// Sends the host what a block has made, in order of time: notes that have ended, which only CLAP knows, and breath of the
/// knob at a sample, as CC2 and CC34.
fn answer<P: Plugin<SysExMessage = ()>>(
    context: &mut impl ProcessContext<P>,
    ended: &[(u32, Note)],
    blown: impl Iterator<Item = (usize, (u8, u8))>,
) {
    let is_clap = context.plugin_api() == PluginApi::Clap;
    let mut ended = ended.iter().filter(|_| is_clap).peekable();
    for (at, bytes) in blown {
        while let Some(&(when, note)) = ended.next_if(|(when, _)| *when as usize <= at) {
            send_end(context, when, note);
        }
        send_breath(context, at, bytes);
    }
    ended.for_each(|&(when, note)| send_end(context, when, note));
}

/// Tells the host that a note has ended.
fn send_end<P: Plugin<SysExMessage = ()>>(context: &mut impl ProcessContext<P>, timing: u32, note: Note) {
    let Note { id, channel, key } = note;
    let voice_id = id.map_or(VoiceID::Wildcard, VoiceID::ID);
    let (channel, key) = (Channel::Number(channel), Key::Number(key));
    // If the host takes no events, it only loses a hint.
    let _ = context.try_send_event(NoteEvent::VoiceTerminated { timing, voice_id, channel, key });
}

/// Sends one breath value of the knob to the host.
fn send_breath<P: Plugin<SysExMessage = ()>>(
    context: &mut impl ProcessContext<P>,
    at: usize,
    (coarse, fine): (u8, u8),
) {
    for (cc, byte) in [(2, coarse), (34, fine)] {
        let (timing, value) = (at as u32, f32::from(byte) / 127.0);
        // If the host takes no events, it only loses the recording.
        let _ = context.try_send_event(NoteEvent::MidiCC { timing, channel: 0, cc, value });
    }
}

impl ClapPlugin for Chalumeau {
    const CLAP_ID: &'static str = identity::CLAP_ID;
    const CLAP_DESCRIPTION: Option<&'static str> = Some(identity::DESCRIPTION);
    const CLAP_MANUAL_URL: Option<&'static str> = identity::MANUAL_URL;
    const CLAP_SUPPORT_URL: Option<&'static str> = identity::SUPPORT_URL;
    /// As many notes as players, told apart by their ids.
    const CLAP_POLY_MODULATION_CONFIG: Option<PolyModulationConfig> = Some(PolyModulationConfig {
        max_voice_capacity: MOST_PLAYERS as u32,
        supports_overlapping_voices: true,
    });
    const CLAP_FEATURES: &'static [ClapFeature] =
        &[ClapFeature::Instrument, ClapFeature::Synthesizer, ClapFeature::Stereo];

    fn remote_controls(&self, context: &mut impl RemoteControlsContext) {
        clap::define_remote_pages(&self.params, context);
    }
}
