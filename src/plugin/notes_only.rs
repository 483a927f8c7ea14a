//! The plugin as a VST3 without MIDI controllers.
//!
//! VST3 has no MIDI controllers, so a plugin that wants them offers one parameter for each controller of each channel. Some
//! hosts ask for a thousand texts of every parameter: pedalboard then loads for half a minute. This class has no such
//! parameters. It receives notes, their pressure and their expressions, and the plugin's own parameters. Everything else is
//! the same, and each of the two classes reads the other's saved state.

use std::sync::Arc;

use nice_plug::context::gui::AsyncExecutor;
use nice_plug::prelude::*;

use super::{Chalumeau, executor_of};
use crate::identity;

/// The plugin without MIDI controllers.
#[derive(Default)]
pub struct NotesOnly(Chalumeau);

impl Plugin for NotesOnly {
    const NAME: &'static str = identity::NOTES_ONLY_NAME;
    const VENDOR: &'static str = Chalumeau::VENDOR;
    const URL: &'static str = Chalumeau::URL;
    const EMAIL: &'static str = Chalumeau::EMAIL;
    const VERSION: &'static str = Chalumeau::VERSION;
    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] = Chalumeau::AUDIO_IO_LAYOUTS;
    const MIDI_INPUT: MidiConfig = MidiConfig::Basic;
    const MIDI_OUTPUT: MidiConfig = Chalumeau::MIDI_OUTPUT;
    const SAMPLE_ACCURATE_AUTOMATION: bool = Chalumeau::SAMPLE_ACCURATE_AUTOMATION;
    const INPUT_EVENT_CAPACITY: usize = Chalumeau::INPUT_EVENT_CAPACITY;

    type Editor = <Chalumeau as Plugin>::Editor;
    type SysExMessage = ();
    type BackgroundTask = <Chalumeau as Plugin>::BackgroundTask;

    fn task_executor(&mut self) -> TaskExecutor<Self> {
        self.0.task_executor()
    }

    fn params(&self) -> Arc<dyn Params> {
        self.0.params()
    }

    fn editor(&mut self, executor: AsyncExecutor<Self>) -> Option<Self::Editor> {
        self.0.editor(executor_of(executor))
    }

    fn filter_state(state: &mut PluginState) {
        Chalumeau::filter_state(state);
    }

    fn activate(
        &mut self,
        _layout: &AudioIOLayout,
        config: &BufferConfig,
        context: &mut impl ActivateContext<Self>,
    ) -> bool {
        self.0.start(config, context)
    }

    fn reset(&mut self) {
        self.0.forget();
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        _aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        self.0.play(buffer.as_slice(), context)
    }

    fn deactivate(&mut self) {
        self.0.forget();
    }
}

impl Vst3Plugin for NotesOnly {
    const VST3_CLASS_ID: [u8; 16] = identity::NOTES_ONLY_VST3_CLASS_ID;
    const VST3_SUBCATEGORIES: &'static [Vst3SubCategory] = Chalumeau::VST3_SUBCATEGORIES;
}
