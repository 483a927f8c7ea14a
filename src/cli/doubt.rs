//! Why a file that was rendered may not be what was asked for.

use crate::wav::Levels;
use chalumeau_core::dsp::limiter::CEILING;

/// A peak from here on was turned down: the limiter lets none past its ceiling, and hardly any by chance come as near.
const LIMITED: f32 = 0.999 * CEILING;

/// What is softer than both is no tone after the tongue's puff: the level over the peak, and the level over full scale. The air of written
/// C4, C5 and E5 a little below their thresholds lies 28 to 34 dB under the puff and 55 to 58 under full scale; the softest notes
/// lie 5 to 8 under it and 37 under full scale.
const NO_TONE: [f32; 2] = [0.08, 4e-3];

/// One reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Doubt {
    /// Samples were beyond full scale.
    Clipped,
    /// The limiter was at work.
    Limited,
    /// The calculation broke down.
    Reset,
    /// After the beginning there is hardly any sound.
    NoTone,
}

impl Doubt {
    /// All of a file with these levels, whose calculation broke down so often. `is_long`: a note is held beyond [`BEGINNING_S`](crate::wav::BEGINNING_S).
    pub fn all(level: Levels, resets: u64, is_long: bool) -> impl Iterator<Item = Self> {
        let all = [
            (Self::Clipped, level.clipped > 0),
            (Self::Limited, level.peak >= LIMITED),
            (Self::Reset, resets > 0),
            (
                Self::NoTone,
                level.peak == 0.0
                    || is_long
                        && level
                            .after_beginning
                            .is_some_and(|rms| rms <= (NO_TONE[0] * level.peak).min(NO_TONE[1])),
            ),
        ];
        all.into_iter().filter_map(|(doubt, is_so)| is_so.then_some(doubt))
    }

    /// Every one.
    pub const EACH: [Self; 4] = [Self::Clipped, Self::Limited, Self::Reset, Self::NoTone];

    /// In tables.
    pub fn id(self) -> &'static str {
        match self {
            Self::Clipped => "clipped",
            Self::Limited => "limited",
            Self::Reset => "reset",
            Self::NoTone => "no_tone",
        }
    }

    /// For the user.
    pub fn text(self) -> &'static str {
        match self {
            Self::Clipped => "samples clipped: lower the gain, or write floats of 32 bits, which do not clip",
            Self::Limited => "the limiter turned peaks down; for levels as played, lower the gain (gain-db)",
            Self::Reset => "the calculation broke down and the instrument was reset; please report this",
            Self::NoTone => {
                "no tone is heard, or none after 0.5 s: the breath is too weak for the note, or so strong that the reed stays shut, or the key is silent, or the volume is 0"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_with_nothing_but_the_tongues_puff_has_no_tone() {
        let has_tone = |peak: f32, after_beginning: Option<f32>| {
            let level = Levels { peak, after_beginning, ..Levels::default() };
            !Doubt::all(level, 0, true).any(|doubt| doubt == Doubt::NoTone)
        };
        // Measured: C4 at gamma 1.8, C4 at 0.34, E5 at gamma 0.4 and zeta 0.2; E3 and C6 at pianissimo.
        for (peak_db, after_db) in [(-26.4, -220.0), (-26.7, -54.9), (-27.5, -57.6)] {
            assert!(!has_tone(gain(peak_db), Some(gain(after_db))), "{peak_db}, {after_db}");
        }
        for (peak_db, after_db) in [(-29.0, -36.8), (-30.6, -35.6)] {
            assert!(has_tone(gain(peak_db), Some(gain(after_db))), "{peak_db}, {after_db}");
            assert!(has_tone(gain(peak_db - 40.0), Some(gain(after_db - 40.0))), "with less gain");
        }
        assert!(has_tone(0.5, Some(gain(-45.0))), "a loud beginning, then pianissimo");
        assert!(has_tone(0.5, None), "a short file");
        assert!(!has_tone(0.0, Some(0.0)), "a silent file");
        let short = Levels { peak: 0.1, after_beginning: Some(0.0), ..Levels::default() };
        assert_eq!(Doubt::all(short, 0, false).count(), 0, "nothing is held after the beginning");
        assert_eq!(Doubt::all(Levels::default(), 0, false).count(), 1, "a silent file");
    }

    fn gain(db: f32) -> f32 {
        10_f32.powf(db / 20.0)
    }
}
