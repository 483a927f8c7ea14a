//! The instruments that come with the program, each a file in `data/`.

use crate::bore::instrument_file::InstrumentFile;
use crate::bore::low_c;
use crate::maths;
use std::sync::OnceLock;

/// One of them. All but the B flat clarinet are that clarinet larger or smaller, which their files say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bundled {
    /// The B flat clarinet.
    #[default]
    BFlat,
    /// The A clarinet, a semitone below.
    A,
    /// The small clarinet in E flat, a fourth above.
    EFlat,
    /// The clarinet in C.
    C,
    /// The bass clarinet in B flat, an octave below, with a lower joint down to written C3.
    Bass,
}

impl Bundled {
    /// All of them, the B flat clarinet first.
    pub const ALL: [Self; 5] = [Self::BFlat, Self::A, Self::EFlat, Self::C, Self::Bass];

    /// What commands, saved states and file names call it.
    pub fn id(self) -> &'static str {
        match self {
            Self::BFlat => "b-flat",
            Self::A => "a",
            Self::EFlat => "e-flat",
            Self::C => "c",
            Self::Bass => "bass",
        }
    }

    /// The instrument that people call so: by its id, or as players write it.
    ///
    /// ```
    /// use chalumeau_core::bore::bundled::Bundled;
    ///
    /// for name in ["b-flat", "Bb", "B\u{266d} clarinet", "B flat"] {
    ///     assert_eq!(Bundled::named(name), Some(Bundled::BFlat));
    /// }
    /// assert_eq!(Bundled::named("bass clarinet"), Some(Bundled::Bass));
    /// assert_eq!(Bundled::named("oboe"), None);
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        let mut plain = name.to_lowercase().replace('\u{266d}', "b").replace("clarinet", "");
        plain.retain(|letter| !matches!(letter, ' ' | '-' | '_'));
        match plain.as_str() {
            "bflat" | "bb" => Some(Self::BFlat),
            "a" => Some(Self::A),
            "eflat" | "eb" => Some(Self::EFlat),
            "c" => Some(Self::C),
            "bass" => Some(Self::Bass),
            _ => None,
        }
    }

    /// Its files in `data/` begin so.
    pub fn data_name(self) -> &'static str {
        match self {
            Self::BFlat => "b_flat_clarinet",
            Self::A => "a_clarinet",
            Self::EFlat => "e_flat_clarinet",
            Self::C => "c_clarinet",
            Self::Bass => "bass_clarinet",
        }
    }

    /// What the file of a scaled clarinet must be: the B flat clarinet times a factor, or `None` for that one itself.
    pub fn scaled_text(self) -> Option<String> {
        // By equal temperament, so that the trims are nearly the B flat clarinet's. A built bass clarinet is bent, and its
        // bore narrower than this for its length.
        let semitone = |count: f64| maths::exp2(count / 12.0);
        let (name, factor, said, transposition) = match self {
            Self::BFlat => return None,
            Self::A => ("A clarinet", semitone(1.0), "2^(1/12)", 3),
            Self::EFlat => ("E flat clarinet", semitone(-5.0), "2^(-5/12)", -3),
            Self::C => ("C clarinet", semitone(-2.0), "2^(-2/12)", 0),
            Self::Bass => ("B flat bass clarinet to low C", 2.0, "2", 14),
        };
        let longer = if self == Self::Bass {
            ", and a longer lower joint with four more pads, down to written C3"
        } else {
            ""
        };
        let source = format!(
            "The built-in B flat clarinet (data/b_flat_clarinet.toml, with its sources), every length times {said}{longer}; not a \
             measured instrument."
        );
        let name = format!("{name}, Boehm system");
        let file = InstrumentFile { name, source, transposition, ..Self::BFlat.file().scaled(factor) };
        Some(if self == Self::Bass { low_c::extended(file) } else { file }.to_toml())
    }

    /// The text of its file.
    pub fn text(self) -> &'static str {
        match self {
            Self::BFlat => InstrumentFile::built_in_text(),
            Self::A => include_str!("../../data/a_clarinet.toml"),
            Self::EFlat => include_str!("../../data/e_flat_clarinet.toml"),
            Self::C => include_str!("../../data/c_clarinet.toml"),
            Self::Bass => include_str!("../../data/bass_clarinet.toml"),
        }
    }

    /// Its measurements.
    pub fn file(self) -> InstrumentFile {
        static PARSED: [OnceLock<InstrumentFile>; Bundled::ALL.len()] =
            [const { OnceLock::new() }; Bundled::ALL.len()];
        // PANIC: the texts are constants of this program and a test below parses them.
        let parse = || InstrumentFile::parse(self.text()).expect("bundled instruments are valid");
        // PANIC: an instrument is one of all of them. Parsing takes longer than a short note takes to render.
        PARSED[self as usize].get_or_init(parse).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_a_whole_instrument_with_a_name_of_its_own() {
        let lengths = Bundled::ALL.map(|instrument| {
            assert_eq!(Bundled::named(instrument.id()), Some(instrument));
            let file = instrument.file();
            let low = if instrument == Bundled::Bass { 4 } else { 0 };
            assert_eq!((file.holes.len(), file.fingerings.len()), (24 + low, 46 + low), "{}", file.name);
            assert!(file.source.len() > 20, "{}: where it comes from", file.name);
            (file.transposition, file.length_m())
        });
        // The lower it sounds, the longer it is.
        let mut sorted = lengths;
        sorted.sort_by_key(|(transposition, _)| *transposition);
        assert!(sorted.windows(2).all(|pair| pair[0].1 < pair[1].1), "{lengths:?}");
        for file in ["a.toml", "./a", "c/bass", ""] {
            assert_eq!(Bundled::named(file), None, "{file:?}");
        }
    }
}
