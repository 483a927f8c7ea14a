//! Why a file that was rendered may not be what was asked for.

use crate::wav::Levels;
use chalumeau_core::dsp::limiter::CEILING;

/// A peak from here on was turned down: the limiter lets none past its ceiling, and hardly any by chance come as near.
const LIMITED: f32 = 0.999 * CEILING;

/// One reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Doubt {
    /// Samples were beyond full scale.
    Clipped,
    /// The limiter was at work.
    Limited,
    /// The calculation broke down.
    Reset,
}

impl Doubt {
    /// All of a file with these levels, whose calculation broke down so often.
    pub fn all(level: Levels, resets: u64) -> impl Iterator<Item = Self> {
        let all = [
            (Self::Clipped, level.clipped > 0),
            (Self::Limited, level.peak >= LIMITED),
            (Self::Reset, resets > 0),
        ];
        all.into_iter().filter_map(|(doubt, is_so)| is_so.then_some(doubt))
    }

    /// For the user.
    pub fn text(self) -> &'static str {
        match self {
            Self::Clipped => "samples clipped; lower gain-db, or set bits to 32f",
            Self::Limited => "the limiter turned peaks down; lower gain-db for levels as played",
            Self::Reset => "the calculation broke down and the instrument was reset; please report this",
        }
    }
}
