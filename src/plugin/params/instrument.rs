//! Parameters of the instrument itself: which one, how finely a file is rendered, how far the wheel bends.
//!
//! What is exchanged as a whole is not automated: that takes from a moment (what comes with the program) to a minute
//! (a file of one's own, the first time), and sounds meanwhile as the status says.

use std::sync::{Arc, RwLock};

use nice_plug::prelude::*;

use super::entry::{choice, choice_from, status, whole};
use crate::plugin::launch_options::LaunchOptions;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::instrument::prepare::Quality;

/// Most characters of a path; longer ones are no paths.
pub const PATH_MOST: usize = 4_096;

/// Which instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum InstrumentChoice {
    /// [`Bundled::BFlat`].
    #[id = "bflat"]
    #[name = "B flat clarinet"]
    BFlat,
    /// [`Bundled::A`].
    #[id = "a"]
    #[name = "A clarinet"]
    A,
    /// [`Bundled::EFlat`].
    #[id = "eflat"]
    #[name = "E flat clarinet"]
    EFlat,
    /// [`Bundled::C`].
    #[id = "c"]
    #[name = "C clarinet"]
    C,
    /// [`Bundled::Bass`].
    #[id = "bass"]
    #[name = "Bass clarinet"]
    Bass,
    /// The user's own file.
    #[id = "user"]
    #[name = "User file"]
    User,
}

impl InstrumentChoice {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::BFlat, Self::A, Self::EFlat, Self::C, Self::Bass, Self::User];

    /// As lists show it.
    pub fn title(self) -> &'static str {
        Self::variants()[self.to_index()]
    }

    /// In a saved state.
    pub fn id(self) -> &'static str {
        Self::ids().and_then(|ids| ids.get(self.to_index()).copied()).unwrap_or_default()
    }

    /// The one that comes with the program, if it does.
    pub fn bundled(self) -> Option<Bundled> {
        match self {
            Self::BFlat => Some(Bundled::BFlat),
            Self::A => Some(Bundled::A),
            Self::EFlat => Some(Bundled::EFlat),
            Self::C => Some(Bundled::C),
            Self::Bass => Some(Bundled::Bass),
            Self::User => None,
        }
    }
}

/// How finely the host's offline mode renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum QualityChoice {
    /// A bounce is what was heard.
    #[id = "live"]
    #[name = "Same as live"]
    Live,
    /// [`Quality::High`].
    #[id = "high"]
    #[name = "High"]
    High,
}

impl From<QualityChoice> for Quality {
    fn from(choice: QualityChoice) -> Self {
        match choice {
            QualityChoice::Live => Self::Live,
            QualityChoice::High => Self::High,
        }
    }
}

/// Which instrument, and how it is played.
#[derive(Params)]
pub struct InstrumentParams {
    /// The user's own file, empty for the usual place
    /// ([`user_file`](crate::plugin::instrument_loading::instrument_request::user_file)).
    #[persist = "instrumentfile"]
    pub file: RwLock<String>,
    /// Which. Default B flat clarinet.
    #[id = "instr"]
    pub choice: EnumParam<InstrumentChoice>,
    /// How finely the host's offline mode renders. Default same as live.
    #[id = "qual"]
    pub quality: EnumParam<QualityChoice>,
    /// How far the wheel bends unless RPN 0 says otherwise, semitones. Default 2.
    #[id = "bendr"]
    pub bend_range: IntParam,
    /// Says how far the instrument is; its value means nothing.
    #[id = "istat"]
    pub status: BoolParam,
}

impl InstrumentParams {
    /// What names the chosen instrument in a saved project: its identifier, or the path of the user's file.
    pub fn key(&self) -> String {
        match self.choice.value() {
            InstrumentChoice::User => {
                format!("user:{}", self.file.read().map_or_else(|_| String::new(), |path| path.clone()))
            }
            bundled => bundled.id().to_owned(),
        }
    }

    /// Defaults; whoever loads the instrument writes its state to `state`.
    pub fn new(state: Arc<RwLock<String>>) -> Self {
        let named = LaunchOptions::get().and_then(|options| options.instrument.clone());
        let (first, file) = named.map_or_else(Default::default, |(first, file)| (Some(first), file));
        Self {
            file: RwLock::new(file),
            choice: choice_from("instr", |default| first.unwrap_or(default)),
            quality: choice("qual"),
            bend_range: whole("bendr"),
            status: status("istat", state),
        }
    }
}
