//! The preset keeper: a thread that reads and writes the user's presets, and puts the preset of a MIDI program change on the
//! parameters.
//!
//! A program change is an event of the audio thread, which may neither lock nor allocate. It leaves the number in an atomic;
//! the thread finds it within [`POLL`]. While a host renders a file, the sample of the program change waits for it, so that every
//! render of the same events is the same.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::plugin::params::ChalumeauParams;
use crate::presets::user_folder::UserFolder;
use crate::presets::{Preset, PresetShelf, factory};

/// How often the thread looks for a program change.
const POLL: Duration = Duration::from_millis(10);
/// Longest time that a render waits for a program change: far more than it takes, should the thread be gone.
const LONGEST_WAIT: Duration = Duration::from_secs(2);
/// No program change is waiting.
const NONE: u32 = u32::MAX;

/// Work on files.
#[derive(Debug)]
pub enum PresetTask {
    /// Look again.
    Read,
    /// Save, and choose it.
    Save(Preset),
    /// Give it another name.
    Rename {
        /// Its name now.
        old: String,
        /// Its new name.
        new: String,
    },
    /// Delete it.
    Delete(String),
    /// The user likes it, or no longer.
    Like {
        /// Its name.
        name: String,
        /// Whether it is liked from now on.
        is_liked: bool,
    },
}

/// What the threads share.
struct Shared {
    /// The program that was asked for, or [`NONE`].
    program: AtomicU32,
    shelf: Mutex<Arc<PresetShelf>>,
    stop: AtomicBool,
}

/// The way to the keeper of one plugin instance.
#[derive(Clone)]
pub struct PresetHandle {
    shared: Arc<Shared>,
    tasks: mpsc::Sender<PresetTask>,
}

/// The keeper of one plugin instance. Dropping it ends its thread.
pub struct PresetKeeper {
    handle: PresetHandle,
    thread: Option<JoinHandle<()>>,
}

impl PresetHandle {
    /// Asks for the factory preset of a MIDI program. Real-time safe.
    pub fn ask(&self, program: u8) {
        self.shared.program.store(u32::from(program), Ordering::Release);
    }

    /// Waits until the program that was asked for is on the parameters. Only for renders of files.
    pub fn wait(&self) {
        let began = Instant::now();
        loop {
            let asked = self.shared.program.load(Ordering::Acquire);
            if asked == NONE {
                return;
            }
            if began.elapsed() >= LONGEST_WAIT {
                // Nobody will: the next blocks must not wait again.
                let forgotten = (Ordering::AcqRel, Ordering::Relaxed);
                let _ = self.shared.program.compare_exchange(asked, NONE, forgotten.0, forgotten.1);
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// All presets as they were read last.
    pub fn shelf(&self) -> Arc<PresetShelf> {
        self.shared.shelf.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Hands work to the thread.
    pub fn send(&self, task: PresetTask) {
        // The thread is gone only when the plugin is.
        let _ = self.tasks.send(task);
    }
}

impl PresetKeeper {
    /// Starts the thread, which reads the user's presets. Allocates.
    pub fn start(params: Arc<ChalumeauParams>) -> Self {
        Self::with_folder(params, UserFolder::system())
    }

    fn with_folder(params: Arc<ChalumeauParams>, folder: Option<UserFolder>) -> Self {
        let shared = Arc::new(Shared {
            program: AtomicU32::new(NONE),
            shelf: Mutex::default(),
            stop: AtomicBool::new(false),
        });
        let (send, tasks) = mpsc::channel();
        let keeper = KeeperThread { params, folder, shared: shared.clone() };
        let thread =
            std::thread::Builder::new().name("PresetKeeper".to_owned()).spawn(move || keeper.run(&tasks));
        // Without a thread the factory presets still work in the window.
        Self { handle: PresetHandle { shared, tasks: send }, thread: thread.ok() }
    }

    /// The way to it.
    pub fn handle(&self) -> &PresetHandle {
        &self.handle
    }
}

impl Drop for PresetKeeper {
    fn drop(&mut self) {
        self.handle.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The panic of a thread was reported when it happened.
            let _ = thread.join();
        }
    }
}

/// The state of the thread.
struct KeeperThread {
    params: Arc<ChalumeauParams>,
    folder: Option<UserFolder>,
    shared: Arc<Shared>,
}

impl KeeperThread {
    fn run(self, tasks: &mpsc::Receiver<PresetTask>) {
        self.publish(None);
        while !self.shared.stop.load(Ordering::Relaxed) {
            self.follow_program();
            match tasks.recv_timeout(POLL) {
                Ok(task) => self.publish(self.carry_out(task).err()),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Reads everything again, for the window.
    fn publish(&self, notice: Option<String>) {
        let user = self.folder.as_ref().map(UserFolder::read).unwrap_or_default();
        let shelf = Arc::new(PresetShelf { user, notice });
        *self.shared.shelf.lock().unwrap_or_else(PoisonError::into_inner) = shelf;
    }

    /// Puts the preset of a program change on the parameters. A number without a preset changes nothing.
    fn follow_program(&self) {
        let wanted = self.shared.program.load(Ordering::Acquire);
        if wanted == NONE {
            return;
        }
        if let Some(preset) = factory::all().get(wanted as usize) {
            self.params.put(preset);
        }
        // Another one may have come meanwhile.
        let _ = self.shared.program.compare_exchange(wanted, NONE, Ordering::AcqRel, Ordering::Acquire);
    }

    /// The error is a message for the user.
    fn carry_out(&self, task: PresetTask) -> Result<(), String> {
        let Some(folder) = &self.folder else {
            let variable = crate::data_folder::VARIABLE;
            return Err(format!("this system has no folder for presets; set {variable} to a path"));
        };
        let is_chosen = |name: &str| self.params.preset_name() == name;
        match task {
            PresetTask::Read => {}
            PresetTask::Save(preset) => {
                // What the user saw who pressed *Replace*.
                let shelf = self.shared.shelf.lock().unwrap_or_else(PoisonError::into_inner).clone();
                let shown = shelf.user.presets.iter().find(|known| known.name == preset.name.trim());
                folder.save(&preset, shown)?;
                self.params.set_preset_name(&preset.name);
            }
            PresetTask::Rename { old, new } => {
                folder.rename(&old, &new)?;
                if is_chosen(&old) {
                    self.params.set_preset_name(&new);
                }
            }
            PresetTask::Delete(name) => {
                folder.delete(&name)?;
                if is_chosen(&name) {
                    self.params.set_preset_name("");
                }
            }
            PresetTask::Like { name, is_liked } => folder.set_favourite(&name, is_liked)?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::instrument_loading::{InstrumentLoader, SharedInstrument};
    use crate::plugin::params::instrument::InstrumentChoice;
    use chalumeau_core::bore::bundled::Bundled;
    use chalumeau_core::event::{Event, Timed};
    use chalumeau_core::instrument::{Channels, Settings};
    use chalumeau_core::units::SoundingNote;

    fn keeper() -> (tempfile::TempDir, Arc<ChalumeauParams>, PresetKeeper) {
        let root = tempfile::tempdir().unwrap();
        let params = Arc::<ChalumeauParams>::default();
        let keeper = PresetKeeper::with_folder(params.clone(), Some(UserFolder::within(root.path())));
        (root, params, keeper)
    }

    /// Waits until the shelf is so, at most two seconds.
    fn until(handle: &PresetHandle, is: impl Fn(&PresetShelf) -> bool) -> Arc<PresetShelf> {
        let began = Instant::now();
        while !is(&handle.shelf()) && began.elapsed() < LONGEST_WAIT {
            std::thread::sleep(Duration::from_millis(1));
        }
        handle.shelf()
    }

    #[test]
    fn a_program_change_puts_every_parameter_where_the_preset_has_it() {
        let (_root, params, keeper) = keeper();
        let before = params.host.values();
        for program in [12_u8, 47, 0, 29] {
            let preset = &factory::all()[usize::from(program)];
            keeper.handle().ask(program);
            keeper.handle().wait();
            assert_eq!(params.preset_name(), preset.name);
            assert_eq!(params.settings(), preset.settings(), "{}", preset.name);
            assert_eq!(params.instrument.choice.value().bundled(), preset.bundled());
        }
        assert_eq!(params.host.values() - before, 4, "the host is told each time");
        keeper.handle().ask(127);
        keeper.handle().wait();
        assert_eq!(params.preset_name(), factory::all()[29].name, "there is no such preset");
    }

    #[test]
    fn a_program_that_nobody_puts_is_waited_for_once() {
        let shared = Arc::new(Shared {
            program: AtomicU32::new(NONE),
            shelf: Mutex::default(),
            stop: AtomicBool::new(false),
        });
        let handle = PresetHandle { shared, tasks: mpsc::channel().0 };
        handle.ask(3);
        handle.wait();
        assert_eq!(handle.shared.program.load(Ordering::Relaxed), NONE);
    }

    #[test]
    fn a_preset_leaves_the_transposition_of_the_player() {
        let params = ChalumeauParams::default();
        let mine =
            Preset::parse("format = 1\nname = \"Mine\"\n\n[parameters]\ntransp = \"-2 st\"\nlip = \"0.9\"\n")
                .unwrap();
        params.put(&mine);
        params.put(&factory::all()[5]);
        let settings = params.settings();
        let expected = factory::all()[5].settings();
        assert_eq!(settings.reach.transpose, -2);
        assert_eq!(settings.lip, expected.lip);
    }

    #[test]
    fn every_factory_preset_is_the_same_in_plugin_and_command_line() {
        let params = ChalumeauParams::default();
        assert_eq!(params.preset_name(), factory::all()[0].name, "a new instance is the first preset");
        assert_eq!(params.settings(), Settings::default());
        for preset in factory::all() {
            params.put(preset);
            assert_eq!(params.settings(), preset.settings(), "{}", preset.name);
            assert_eq!(params.instrument.bend_range.value(), i32::from(preset.bend_range()));
        }
    }

    #[test]
    fn the_users_presets_are_kept_and_failures_are_told() {
        let (_root, params, keeper) = keeper();
        let (handle, mine) = (keeper.handle(), Preset::of("Mine", None, |_| None));
        handle.send(PresetTask::Save(mine.clone()));
        let shelf = until(handle, |shelf| shelf.is_users("Mine"));
        assert!(shelf.is_users("Mine") && shelf.notice.is_none());
        assert_eq!(params.preset_name(), "Mine");
        handle.send(PresetTask::Like { name: "Mine".to_owned(), is_liked: true });
        handle.send(PresetTask::Rename { old: "Mine".to_owned(), new: "Best".to_owned() });
        assert!(until(handle, |shelf| shelf.is_users("Best")).is_liked("Best"));
        assert_eq!(params.preset_name(), "Best");
        handle.send(PresetTask::Delete("Mine".to_owned()));
        let told = until(handle, |shelf| shelf.notice.is_some()).notice.clone();
        assert!(told.unwrap().contains("no preset \"Mine\""));
        handle.send(PresetTask::Delete("Best".to_owned()));
        assert!(!until(handle, |shelf| !shelf.is_users("Best")).is_users("Best"));
        assert_eq!(params.preset_name(), "");
    }

    #[test]
    fn what_another_window_has_saved_is_replaced_only_by_who_has_seen_it() {
        let (root, _, keeper) = keeper();
        let folder = UserFolder::within(root.path());
        let (handle, mine) = (keeper.handle(), Preset::of("Mine", None, |_| None));
        let with = |shows: &str| {
            let mut preset = mine.clone();
            preset.shows = shows.to_owned();
            preset
        };
        // By then it has read the empty folder.
        handle.send(PresetTask::Like { name: "Any".to_owned(), is_liked: true });
        until(handle, |shelf| shelf.is_liked("Any"));
        folder.save(&with("Theirs."), None).unwrap();
        handle.send(PresetTask::Save(with("Ours.")));
        let shelf = until(handle, |shelf| shelf.notice.is_some());
        assert!(shelf.notice.as_ref().unwrap().contains("there is a preset \"Mine\" already"));
        assert_eq!(shelf.find("Mine").unwrap().shows, "Theirs.", "the list shows it from now on");
        assert_eq!(folder.read().presets[0].shows, "Theirs.");
        handle.send(PresetTask::Save(with("Ours.")));
        let shelf = until(handle, |shelf| shelf.notice.is_none());
        assert!(shelf.notice.is_none() && shelf.find("Mine").unwrap().shows == "Ours.");
        folder.save(&with("Theirs again."), shelf.find("Mine")).unwrap();
        handle.send(PresetTask::Save(with("Ours again.")));
        until(handle, |shelf| shelf.notice.is_some());
        assert_eq!(folder.read().presets[0].shows, "Theirs again.", "as they left it");
    }

    #[test]
    fn a_program_change_brings_another_instrument_while_a_note_sounds() {
        const RATE_HZ: f64 = 48_000.0;
        const BLOCK: usize = 240;
        let (_root, params, keeper) = keeper();
        let (shared, mut swap) = (Arc::<SharedInstrument>::default(), None);
        let mut loader = InstrumentLoader::start(params.clone(), shared);
        loader.activate(&mut swap, RATE_HZ, false).unwrap();
        let swap = swap.as_mut().unwrap();
        let note_on = Event::NoteOn { note: SoundingNote(58), velocity: 0.6 };
        let mut said = Some(Timed { at: 0, event: note_on.into() });
        let program = factory::all().iter().position(|preset| preset.bundled() == Some(Bundled::A)).unwrap();
        for (round, program) in [program, 0, program, 0].into_iter().enumerate() {
            let file = factory::all()[program].bundled().unwrap().file();
            keeper.handle().ask(program as u8);
            let began = Instant::now();
            while swap.clarinet().model().file != file && began.elapsed() < Duration::from_secs(10) {
                let mut out = [0.0; BLOCK];
                swap.set_settings(&params.settings());
                swap.receive();
                swap.render_events(said.take(), Channels::one(&mut out));
                // As a host calls it: in real time.
                std::thread::sleep(Duration::from_micros(4_000));
            }
            // For people: some 200 ms in a debug build. How long a busy machine takes proves nothing.
            println!("round {round}: {:?}", began.elapsed());
            assert!(swap.clarinet().model().file == file, "round {round}");
        }
        assert_eq!(params.instrument.choice.value(), InstrumentChoice::BFlat);
    }
}
