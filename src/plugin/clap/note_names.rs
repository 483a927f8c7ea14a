//! Names of the keys that do something: the note that a clarinettist reads for each that sounds, and what a key switch chooses.
//!
//! A host shows them beside its keys, which are sounding pitch. They follow the instrument and its transposition.

use std::fmt;
use std::sync::PoisonError;

use clap_sys::ext::note_name::{clap_note_name, clap_plugin_note_name};
use clap_sys::plugin::clap_plugin;

use super::instance::Instance;
use super::{Introduced, text};
use crate::plugin::instrument_loading::instrument_request::InstrumentRequest;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::event::Fingerings;
use chalumeau_core::instrument::{KeyPitches, Reach};
use chalumeau_core::units::{SoundingNote, WrittenNote};

pub static NOTE_NAME: clap_plugin_note_name = clap_plugin_note_name { count: Some(count), get: Some(get) };

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Does {
    Plays(WrittenNote),
    Chooses(Fingerings),
}

impl fmt::Display for Does {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plays(written) => write!(f, "{written} written"),
            Self::Chooses(fingerings) => write!(f, "{fingerings}"),
        }
    }
}

/// The keys that do something, in order of pitch.
#[derive(Default)]
pub struct NoteNames(Vec<(SoundingNote, Does)>);

impl NoteNames {
    /// Takes them from the instrument that plays, or before the first activation from the chosen one. Says whether they have
    /// changed.
    pub fn renew(&mut self, introduced: &Introduced) -> bool {
        let reach = introduced.params.settings().reach;
        let names = match introduced.instrument.current() {
            Some(current) => named(&current.model.file, reach, &current.model.keys, |fingering| {
                current.model.speaks(fingering)
            }),
            None => {
                // The rate is no matter for a file. Without a readable file nothing is known to sound.
                let request = InstrumentRequest::from_params(&introduced.params, 48_000.0, false);
                request
                    .file()
                    .map_or_else(|_| Vec::new(), |file| named(&file, reach, &KeyPitches::default(), |_| true))
            }
        };
        let has_changed = self.0 != names;
        self.0 = names;
        has_changed
    }
}

/// The keys that play a fingering of an instrument, without those that do not speak in tune and are silent; and the key
/// switches.
fn named(
    file: &InstrumentFile,
    reach: Reach,
    keys: &KeyPitches,
    speaks: impl Fn(usize) -> bool,
) -> Vec<(SoundingNote, Does)> {
    let plays = |note: SoundingNote| {
        let written = note.written(file.transposition)?;
        let fingering = file.fingerings.iter().position(|fingering| fingering.written == written)?;
        speaks(fingering).then_some(written)
    };
    let does = |key: SoundingNote| match reach.key_switches.chosen(key.0) {
        Some(fingerings) => Some(Does::Chooses(fingerings)),
        None => reach.find(key, keys, plays).map(|(_, written)| Does::Plays(written)),
    };
    (0..128).map(SoundingNote).filter_map(|key| Some((key, does(key)?))).collect()
}

unsafe extern "C" fn count(plugin: *const clap_plugin) -> u32 {
    // SAFETY: the host's pointer is ours.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return 0 };
    let mut names = this.note_names.lock().unwrap_or_else(PoisonError::into_inner);
    let _ = names.renew(&this.introduced);
    names.0.len() as u32
}

unsafe extern "C" fn get(plugin: *const clap_plugin, index: u32, note_name: *mut clap_note_name) -> bool {
    // SAFETY: as above.
    let Some(this) = (unsafe { Instance::of(plugin) }) else { return false };
    let names = this.note_names.lock().unwrap_or_else(PoisonError::into_inner);
    let Some((sounding, does)) = names.0.get(index as usize).filter(|_| !note_name.is_null()) else {
        return false;
    };
    let mut name = [0; _];
    text::write(&does.to_string(), &mut name);
    // Every port, every channel.
    let named = clap_note_name { name, port: -1, key: i16::from(sounding.0), channel: -1 };
    // SAFETY: `note_name` has room for one.
    unsafe { *note_name = named };
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::bundled::Bundled;
    use chalumeau_core::control::key_switches::KeySwitches;
    use chalumeau_core::instrument::Beyond;

    #[test]
    fn keys_have_the_names_that_the_player_reads() {
        for (instrument, count, lowest) in
            [(Bundled::BFlat, 46, (50, "E3")), (Bundled::A, 46, (49, "E3")), (Bundled::Bass, 50, (34, "C3"))]
        {
            let all = |reach: Reach, speaks: fn(usize) -> bool| {
                named(&instrument.file(), reach, &KeyPitches::default(), speaks)
            };
            let names = all(Reach::default(), |_| true);
            assert_eq!(names.len(), count, "{instrument:?}");
            assert_eq!(all(Reach::default(), |fingering| fingering > 0).len(), count - 1);
            let (sounding, does) = names[0];
            assert_eq!((sounding.0, does.to_string()), (lowest.0, format!("{} written", lowest.1)));
            let up = all(Reach { transpose: 12, ..Reach::default() }, |_| true);
            assert_eq!(up[0], (SoundingNote(sounding.0 - 12), does));
            let folded = all(Reach { beyond: Beyond::Octave, ..Reach::default() }, |_| true);
            assert_eq!(folded.len(), 128, "every key plays");
            let switched = all(Reach { key_switches: KeySwitches::C1, ..Reach::default() }, |_| true);
            let texts: Vec<_> = switched[..6].iter().map(|(key, does)| (key.0, does.to_string())).collect();
            let said = ["chart fingerings", "1st alternate", "2nd alternate", "3rd alternate", "by context"];
            assert!((24..).zip(said).eq(texts[..5].iter().map(|(key, text)| (*key, text.as_str()))));
            assert_eq!(texts[5].0, lowest.0);
        }
    }
}
