//! The plugin as VST3 classes, which differ in what comes in. All else is the same, and each reads the other's saved state.
//!
//! - [`Whole`]: notes and MIDI controllers, no audio.
//! - [`NotesOnly`]: VST3 has no MIDI controllers, so a plugin that wants them offers one parameter for each controller of each
//!   channel. Some hosts ask for a thousand texts of every parameter: pedalboard then loads for half a minute. This class has no
//!   such parameters. It receives notes, their pressure and their expressions, and the plugin's own parameters.
//! - [`Blown`]: an effect on the track of a microphone, which takes notes too. An instrument with a side-chain would do,
//!   but hosts that know no side-chain of an instrument take it for an effect, and the framework (nice-plug 0.4.2) reads behind the
//!   host's list of arrangements where a side-chain is the only input.

use std::marker::PhantomData;
use std::sync::Arc;

use nice_plug::context::gui::AsyncExecutor;
use nice_plug::prelude::*;
use nice_plug::wrapper::vst3::HostRequests;

use super::host_link::HostCalls;
use super::{Chalumeau, executor_of, layout};
use crate::identity;

/// What tells a class from another.
pub trait Kind: Send + 'static {
    /// Name in the host's list.
    const NAME: &'static str;
    /// The class.
    const CLASS_ID: [u8; 16];
    /// What it receives.
    const MIDI_INPUT: MidiConfig;
    /// Its channels.
    const LAYOUTS: &'static [AudioIOLayout];
    /// Where hosts list it.
    const CATEGORIES: &'static [Vst3SubCategory];
}

const INSTRUMENT: &[Vst3SubCategory] =
    &[Vst3SubCategory::Instrument, Vst3SubCategory::Synth, Vst3SubCategory::Stereo];

/// The plugin with MIDI controllers.
pub struct Whole;

impl Kind for Whole {
    const NAME: &'static str = identity::NAME;
    const CLASS_ID: [u8; 16] = identity::VST3_CLASS_ID;
    const MIDI_INPUT: MidiConfig = MidiConfig::MidiCCs;
    const LAYOUTS: &'static [AudioIOLayout] = &[layout(None)];
    const CATEGORIES: &'static [Vst3SubCategory] = INSTRUMENT;
}

/// The plugin without MIDI controllers.
pub struct NotesOnly;

impl Kind for NotesOnly {
    const NAME: &'static str = identity::NOTES_ONLY_NAME;
    const CLASS_ID: [u8; 16] = identity::NOTES_ONLY_VST3_CLASS_ID;
    const MIDI_INPUT: MidiConfig = MidiConfig::Basic;
    const LAYOUTS: &'static [AudioIOLayout] = &[layout(None)];
    const CATEGORIES: &'static [Vst3SubCategory] = INSTRUMENT;
}

/// The plugin with a microphone.
pub struct Blown;

impl Kind for Blown {
    const NAME: &'static str = identity::BLOWN_NAME;
    const CLASS_ID: [u8; 16] = identity::BLOWN_VST3_CLASS_ID;
    const MIDI_INPUT: MidiConfig = MidiConfig::MidiCCs;
    const LAYOUTS: &'static [AudioIOLayout] = &[layout(NonZeroU32::new(2)), layout(NonZeroU32::new(1))];
    const CATEGORIES: &'static [Vst3SubCategory] = &[Vst3SubCategory::Fx, Vst3SubCategory::Stereo];
}

/// A class.
pub struct Vst3<K> {
    plugin: Chalumeau,
    /// Channels that come in.
    inputs: usize,
    kind: PhantomData<K>,
}

impl<K> Default for Vst3<K> {
    fn default() -> Self {
        Self { plugin: Chalumeau::default(), inputs: 0, kind: PhantomData }
    }
}

impl<K: Kind> Plugin for Vst3<K> {
    const NAME: &'static str = K::NAME;
    const VENDOR: &'static str = Chalumeau::VENDOR;
    const URL: &'static str = Chalumeau::URL;
    const EMAIL: &'static str = Chalumeau::EMAIL;
    const VERSION: &'static str = Chalumeau::VERSION;
    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] = K::LAYOUTS;
    const MIDI_INPUT: MidiConfig = K::MIDI_INPUT;
    const MIDI_OUTPUT: MidiConfig = Chalumeau::MIDI_OUTPUT;
    const SAMPLE_ACCURATE_AUTOMATION: bool = Chalumeau::SAMPLE_ACCURATE_AUTOMATION;
    const INPUT_EVENT_CAPACITY: usize = Chalumeau::INPUT_EVENT_CAPACITY;

    type Editor = <Chalumeau as Plugin>::Editor;
    type SysExMessage = ();
    type BackgroundTask = <Chalumeau as Plugin>::BackgroundTask;

    fn task_executor(&mut self) -> TaskExecutor<Self> {
        self.plugin.task_executor()
    }

    fn params(&self) -> Arc<dyn Params> {
        self.plugin.params()
    }

    fn editor(&mut self, executor: AsyncExecutor<Self>) -> Option<Self::Editor> {
        self.plugin.editor(executor_of(executor))
    }

    fn filter_state(state: &mut PluginState) {
        Chalumeau::filter_state(state);
    }

    fn activate(
        &mut self,
        layout: &AudioIOLayout,
        config: &BufferConfig,
        context: &mut impl ActivateContext<Self>,
    ) -> bool {
        self.inputs = layout.main_input_channels.map_or(0, |channels| channels.get() as usize);
        self.plugin.start(config, context)
    }

    fn reset(&mut self) {
        self.plugin.forget();
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        _aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let channels = buffer.as_slice();
        // The framework has put what comes in where the sound goes out.
        self.plugin.hear(&channels[..self.inputs.min(channels.len())]);
        self.plugin.play(channels, context)
    }

    fn deactivate(&mut self) {
        self.plugin.forget();
    }
}

impl<K: Kind> Vst3Plugin for Vst3<K> {
    const VST3_CLASS_ID: [u8; 16] = K::CLASS_ID;
    const VST3_SUBCATEGORIES: &'static [Vst3SubCategory] = K::CATEGORIES;

    fn connect(&mut self, host: HostRequests) {
        self.plugin.params.host.connect(Box::new(Calls(host)));
    }

    fn take_output_parameters(&mut self, tell: &mut dyn FnMut(&str, f32)) {
        for control in self.plugin.params.moments.take_fallen() {
            tell(control.id(), 0.0);
        }
    }
}

/// What a VST3 host can be told.
struct Calls(HostRequests);

impl HostCalls for Calls {
    fn request_process(&self) {
        // VST3 hosts always process.
    }

    fn request_callback(&self) {
        // There is nothing that the host would be told in it.
    }

    fn mark_dirty(&self) {
        self.0.mark_dirty();
    }
}

mod export {
    // The entry points are C functions, which the macro below defines.
    #![allow(unsafe_code)]

    use super::{Blown, NotesOnly, Vst3, Whole};

    nice_plug::nice_export_vst3!(Vst3<Whole>, Vst3<NotesOnly>, Vst3<Blown>);
}
