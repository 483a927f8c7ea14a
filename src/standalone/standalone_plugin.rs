//! The plugin as the framework runs it here. A JACK server plays it directly.
//!
//! The framework's own JACK backend waits forever for a server that has died. So with JACK, the framework only keeps the
//! window and the parameters: it runs its backend without sound, and [`JackLink`] plays the plugin.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nice_plug::context::gui::AsyncExecutor;
use nice_plug::prelude::*;

use super::devices;
use super::jack::JackLink;
use super::keyboards::WithKeyboards;
use super::session::Session;
use crate::plugin::{Chalumeau, executor_of, layout};

/// The plugin that plays, for [`StandalonePlugin::end`]. The framework keeps the plugin to itself.
static PLAYING: Mutex<Option<StandalonePlugin>> = Mutex::new(None);

/// The plugin in the standalone program. Clones are the same plugin.
#[derive(Clone)]
pub struct StandalonePlugin {
    plugin: Arc<Mutex<Chalumeau>>,
    /// The link to the JACK server, while JACK plays the plugin.
    jack: Arc<Mutex<Option<JackLink>>>,
    /// JACK plays the plugin, not the framework.
    uses_jack: bool,
    /// Channels of the microphone that the framework has opened.
    inputs: usize,
    /// `None` on a system without a folder for it.
    session: Option<Session>,
}

impl Default for StandalonePlugin {
    /// The framework makes the plugin, and passes nothing to it. The JACK client waits in a global.
    fn default() -> Self {
        let plugin = Arc::<Mutex<Chalumeau>>::default();
        let session = Session::begin(locked(&plugin).shared_params());
        let jack = JackLink::claim(&plugin);
        let uses_jack = jack.is_some();
        let this = Self { plugin, jack: Arc::new(Mutex::new(jack)), uses_jack, inputs: 0, session };
        *locked(&PLAYING) = Some(this.clone());
        this
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Plugin for StandalonePlugin {
    const NAME: &'static str = Chalumeau::NAME;
    const VENDOR: &'static str = Chalumeau::VENDOR;
    const URL: &'static str = Chalumeau::URL;
    const EMAIL: &'static str = Chalumeau::EMAIL;
    const VERSION: &'static str = Chalumeau::VERSION;
    const AUDIO_IO_LAYOUTS: &'static [AudioIOLayout] =
        &[layout(None), layout(NonZeroU32::new(1)), layout(NonZeroU32::new(2))];
    const MIDI_INPUT: MidiConfig = Chalumeau::MIDI_INPUT;
    const MIDI_OUTPUT: MidiConfig = Chalumeau::MIDI_OUTPUT;
    const SAMPLE_ACCURATE_AUTOMATION: bool = Chalumeau::SAMPLE_ACCURATE_AUTOMATION;
    const INPUT_EVENT_CAPACITY: usize = Chalumeau::INPUT_EVENT_CAPACITY;

    type Editor = <Chalumeau as Plugin>::Editor;
    type SysExMessage = ();
    type BackgroundTask = <Chalumeau as Plugin>::BackgroundTask;

    fn task_executor(&mut self) -> TaskExecutor<Self> {
        locked(&self.plugin).task_executor()
    }

    fn params(&self) -> Arc<dyn Params> {
        locked(&self.plugin).params()
    }

    fn editor(&mut self, executor: AsyncExecutor<Self>) -> Option<Self::Editor> {
        locked(&self.plugin).editor(executor_of(executor))
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
        match &*locked(&self.jack) {
            Some(jack) => jack.start(),
            None => locked(&self.plugin).start(config, context),
        }
    }

    fn reset(&mut self) {
        locked(&self.plugin).forget();
    }

    fn process(
        &mut self,
        buffer: &mut Buffer,
        _aux: &mut AuxiliaryBuffers,
        context: &mut impl ProcessContext<Self>,
    ) -> ProcessStatus {
        let channels = buffer.as_slice();
        // Before the lock, which the JACK thread may want in this moment.
        let status = if self.uses_jack {
            ProcessStatus::Error("JACK plays")
        } else {
            devices::count_block();
            // It is held elsewhere only while the program ends.
            match self.plugin.try_lock() {
                Ok(mut plugin) => {
                    plugin.hear(&channels[..self.inputs.min(channels.len())]);
                    plugin.play::<Self>(channels, &mut WithKeyboards::new(context))
                }
                Err(_) => ProcessStatus::Error("not playing"),
            }
        };
        match status {
            ProcessStatus::Error(_) => {
                // The framework has put what comes in where the sound goes out: a microphone.
                channels.iter_mut().for_each(|channel| channel.fill(0.0));
                ProcessStatus::KeepAlive
            }
            played => played,
        }
    }

    fn deactivate(&mut self) {
        self.silence();
    }
}

impl StandalonePlugin {
    /// Silences the plugin that plays, leaves the JACK server, and completes the take that is open, before the program ends.
    pub fn end() {
        // In a statement of its own: the framework may be about to do the same.
        let playing = locked(&PLAYING).take();
        if let Some(playing) = playing {
            playing.silence();
            locked(&playing.plugin).leave_knob();
        }
    }

    /// Takes the torque of the knob away. Neither the sound nor a disk holds this up.
    pub fn interrupt() {
        if let Some(Self { session: Some(session), .. }) = &*locked(&PLAYING) {
            session.params().moments.interrupt();
        }
    }

    /// Ends the link to the knob and completes the take that is open.
    pub fn leave_knob() {
        // Not under the lock: others look for the plugin meanwhile.
        let playing = locked(&PLAYING).clone();
        if let Some(Self { plugin, .. }) = playing {
            locked(&plugin).leave_knob();
        }
    }

    /// Writes the session of the plugin that plays.
    pub fn save() {
        if let Some(Self { session: Some(session), .. }) = &*locked(&PLAYING) {
            session.save();
        }
    }

    fn silence(&self) {
        // Closes the client. The lock is free again before that.
        let jack = locked(&self.jack).take();
        let mut plugin = locked(&self.plugin);
        plugin.forget();
        drop((plugin, jack));
        // Last: neither sound nor torque waits for a disk.
        if let Some(session) = &self.session {
            session.save();
        }
    }
}
