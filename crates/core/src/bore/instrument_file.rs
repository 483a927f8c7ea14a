//! The instrument as a file: bore, tone holes and fingering chart as a maker measures them and a player reads them.
//!
//! The file is TOML in millimetres and diameters (`docs/instrument-file.md`); here everything is metres and radii. The
//! bore is a chain of straight cones from the reed tip, holes are circular, and a fingering is a set of open holes, one
//! fingering a note. Pads above open holes, undercutting and the shape of the mouthpiece chamber are left out.
//! Reading never panics. An error names the place, the value given and what would be right. The built-in clarinet and its credits are in `data/b_flat_clarinet.toml`.

use std::collections::HashMap;

use serde::Deserialize;

use crate::units::midi_of_name;
use crate::units::{REFERENCE_RADIUS_M, SoundingNote, WrittenNote};

mod by_hand;
mod csv;
mod error;
mod limits;
mod raw;
mod text;
mod words;

pub use csv::{ImportDetails, ImportError, Sheet};
pub use error::InstrumentError;
use limits::*;
pub use limits::{HOLE_RADIUS_M, LEAST_HOLE_X_M, LONGEST_M, MAX_HOLES, MAX_SEGMENTS};
use raw::{Lined, RawFile, RawFingering, RawHole, RawSegment};
use words::{Place, Word, Words};

/// The registers a fingering may name, low to high.
pub const REGISTERS: [&str; 4] = ["chalumeau", "throat", "clarion", "altissimo"];

/// Cones that meet within this distance are taken as touching, m.
const CONTACT_M: f64 = 1e-6;
/// Shortest cone, mm: what is shorter is a mistake in one of its ends.
const SHORTEST_MM: f64 = 0.01;
/// What lengths may lose by being written with few digits, m.
const ROUNDING_M: f64 = 2e-9;

/// One instrument: its bore, tone holes and fingering chart, in SI units. [`parse`](Self::parse) gives one that is whole; of one that is
/// made or changed by hand, [`check`](Self::check) says whether it is.
///
/// ```
/// use chalumeau_core::bore::instrument_file::InstrumentFile;
///
/// let clarinet = InstrumentFile::built_in();
/// assert_eq!((clarinet.holes.len(), clarinet.fingerings.len()), (24, 46));
/// // A bass clarinet is about twice as large; text and instrument convert both ways.
/// let bass = clarinet.scaled(2.0);
/// assert!((bass.length_m() - 1.335).abs() < 1e-3);
/// assert_eq!(InstrumentFile::parse(&bass.to_toml()).unwrap().holes.len(), 24);
/// assert!(InstrumentFile::parse("name = 3").is_err());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct InstrumentFile {
    /// What a player calls it.
    pub name: String,
    /// Where the measurements come from.
    pub source: String,
    /// Semitones it sounds below what is written, -12..=36 (B flat clarinet: 2).
    pub transposition: i8,
    /// Volume of air that moves with the reed, in parallel with the bore at the tip, m3, 0..=2e-5 (clarinet: 1.2e-6).
    pub reed_volume_m3: f64,
    /// Radius of the bore that zeta, Zc and the size of the reed refer to, m: that of the cylindrical part, by default
    /// [`REFERENCE_RADIUS_M`]. Admittances inside are over that of a tube of this radius.
    pub nominal_radius_m: f64,
    /// Semitones that a longer lower joint adds below the notes of an ordinary clarinet, 0..=12 (bass clarinet to low C: 4).
    pub extension_semitones: u8,
    /// The main bore from the reed tip (x = 0) to the end of the bell; contiguous.
    pub bore: Vec<BoreSegment>,
    /// Tone holes, ordered from the reed to the bell, at most [`MAX_HOLES`].
    pub holes: Vec<ToneHole>,
    /// Fingerings, ordered from the lowest note to the highest, at least one, one a note.
    pub fingerings: Vec<Fingering>,
}

/// A straight cone of the main bore. `x` is measured from the reed tip.
#[derive(Clone, Debug, PartialEq)]
pub struct BoreSegment {
    /// Part of the instrument it belongs to, e.g. `barrel`.
    pub part: String,
    /// Upstream end, m.
    pub x_start_m: f64,
    /// Downstream end, m, above `x_start_m`.
    pub x_end_m: f64,
    /// Radius at the upstream end, m, 0.0005..=0.1.
    pub r_start_m: f64,
    /// Radius at the downstream end, m, 0.0005..=0.1.
    pub r_end_m: f64,
}

/// How a hole is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HoleKind {
    /// Covered by a finger.
    Finger,
    /// Covered by a pad at rest; a key opens it.
    KeyClosed,
    /// Covered by a pad that stands open at rest; a key or ring closes it.
    PadOpen,
}

impl HoleKind {
    /// What files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finger => "finger",
            Self::KeyClosed => "key-closed",
            Self::PadOpen => "pad-open",
        }
    }
}

/// A circular tone hole or vent.
#[derive(Clone, Debug, PartialEq)]
pub struct ToneHole {
    /// Unique name without spaces, as fingerings use it.
    pub name: String,
    /// How it is closed.
    pub kind: HoleKind,
    /// Position of its centre, m from the reed tip, inside the bore.
    pub x_m: f64,
    /// Radius of the hole, m, at most that of the bore there.
    pub radius_m: f64,
    /// Chimney height from the wall of the bore to the outside, m, above 0.
    pub chimney_m: f64,
    /// Whether it is a register hole (speaker vent).
    pub register: bool,
    /// Free text.
    pub description: String,
}

/// How one note is fingered.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingering {
    /// The note it plays.
    pub written: WrittenNote,
    /// One of [`REGISTERS`].
    pub register: String,
    /// Which impedance peak sounds, 1 for the lowest, 1..=12.
    pub mode: usize,
    /// Whether each hole is open, `[hole]` in the order of [`InstrumentFile::holes`].
    pub open: Vec<bool>,
    /// The same of the fingering in the maker's chart, where the note is played with another one. The
    /// [fit](super::fit) compares it in place of [`open`](Self::open); nothing else uses it.
    pub maker_open: Option<Vec<bool>>,
    /// What the fingers do, for a reader.
    pub fingers: String,
}

impl Fingering {
    /// Whether each hole is open in the maker's chart.
    pub fn of_maker(&self) -> &[bool] {
        self.maker_open.as_deref().unwrap_or(&self.open)
    }
}

impl Fingering {
    /// Opening of each hole, in the order of the file: 1 open, 0 closed. Allocates.
    pub fn opening(&self) -> Vec<f64> {
        self.open.iter().map(|&is_open| f64::from(u8::from(is_open))).collect()
    }
}

impl InstrumentFile {
    /// Reads and checks the text of an instrument file. Never panics. Allocates.
    pub fn parse(text: &str) -> Result<Self, InstrumentError> {
        Self::from_raw(RawFile::from_toml(text)?, &Words::toml())
    }

    /// Checks what was read; messages are in the words of the file it was read from.
    fn from_raw(raw: RawFile, words: &Words) -> Result<Self, InstrumentError> {
        let place = Place { file: None, line: None, what: "the file".to_owned() };
        within(&place, &words.transposition, raw.transposition_semitones as f64, &TRANSPOSITION)?;
        within(&place, &words.reed_volume, raw.reed_volume_mm3, &REED_VOLUME)?;
        if let Some(diameter_mm) = raw.nominal_diameter_mm {
            within(&place, &words.nominal, diameter_mm, &NOMINAL_DIAMETER)?;
        }
        within(&place, &words.extension, raw.extension_semitones as f64, &EXTENSION)?;
        if raw.name.trim().is_empty() {
            return Err(word(&place, &Word::plain("name"), &raw.name, "the name of the instrument"));
        }
        count("bore", raw.bore.len(), 1, MAX_SEGMENTS)?;
        count("hole", raw.hole.len(), 0, MAX_HOLES)?;
        count("fingering", raw.fingering.len(), 1, 128)?;
        let mut file = Self {
            name: raw.name,
            source: raw.source,
            transposition: raw.transposition_semitones as i8,
            reed_volume_m3: raw.reed_volume_mm3 / 1e9,
            nominal_radius_m: raw
                .nominal_diameter_mm
                .map_or(REFERENCE_RADIUS_M, |diameter_mm| diameter_mm / 2e3),
            extension_semitones: raw.extension_semitones as u8,
            bore: segments(raw.bore, words)?,
            holes: Vec::new(),
            fingerings: Vec::new(),
        };
        file.holes = file.tone_holes(raw.hole, words)?;
        file.fingerings = file.chart(raw.fingering, words)?;
        Ok(file)
    }

    /// The text of the built-in B flat clarinet, a template for others.
    pub fn built_in_text() -> &'static str {
        include_str!("../../data/b_flat_clarinet.toml")
    }

    /// The built-in B flat clarinet: 24 holes, written E3 to C#7.
    pub fn built_in() -> Self {
        // PANIC: the text is a constant of this program and a test below parses it.
        Self::parse(Self::built_in_text()).expect("the built-in instrument is valid")
    }

    /// The same instrument `factor` times as large in every direction: bore, holes, chimneys, nominal bore, and the air
    /// moving with the reed by the cube. Without losses all its resonances are those of the original divided by `factor`;
    /// wall losses are a little smaller in a larger bore. Names, chart and transposition stay: what the notes are called
    /// is the caller's to say. `factor` is finite and above 0; 1 gives the same instrument bit by bit. What other factors give, or factors
    /// that lead out of the ranges of a file, [`check`](Self::check) refuses.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut file = self.clone();
        for segment in &mut file.bore {
            for length in
                [&mut segment.x_start_m, &mut segment.x_end_m, &mut segment.r_start_m, &mut segment.r_end_m]
            {
                *length *= factor;
            }
        }
        for hole in &mut file.holes {
            for length in [&mut hole.x_m, &mut hole.radius_m, &mut hole.chimney_m] {
                *length *= factor;
            }
        }
        file.nominal_radius_m *= factor;
        file.reed_volume_m3 *= factor.powi(3);
        file
    }

    /// Length of the bore from reed tip to bell, m.
    pub fn length_m(&self) -> f64 {
        self.bore.last().map_or(0.0, |segment| segment.x_end_m)
    }

    /// Radius of the bore at `x_m` from the reed tip, m. At a step: that of the upstream side. Beyond the ends: that of
    /// the nearest end. 0 for an instrument without a bore.
    pub fn radius_at(&self, x_m: f64) -> f64 {
        let segment = self.bore.iter().find(|segment| x_m <= segment.x_end_m).or(self.bore.last());
        segment.map_or(0.0, |segment| {
            let along = (x_m - segment.x_start_m) / (segment.x_end_m - segment.x_start_m);
            segment.r_start_m + (segment.r_end_m - segment.r_start_m) * along.clamp(0.0, 1.0)
        })
    }

    /// How a note is fingered, if the chart has it.
    pub fn fingering(&self, written: WrittenNote) -> Option<&Fingering> {
        self.fingerings.iter().find(|fingering| fingering.written == written)
    }

    /// Index of a hole by name.
    pub fn hole(&self, name: &str) -> Option<usize> {
        self.holes.iter().position(|hole| hole.name == name)
    }

    /// The pitch at which a written note sounds. Every note of a chart that was read sounds within MIDI's range: reading refuses one
    /// that does not. Of an instrument made by hand, such a note counts as the nearest that MIDI has.
    pub fn sounding(&self, written: WrittenNote) -> SoundingNote {
        let nearest = (i16::from(written.0) - i16::from(self.transposition)).clamp(0, 127);
        SoundingNote(nearest as u8)
    }

    /// The lowest note without the [extension](Self::extension_semitones), which tells how large the instrument is: a longer lower
    /// joint changes neither its reed nor how a player blows the other notes.
    pub fn lowest_unextended(&self) -> WrittenNote {
        WrittenNote(self.lowest().0.saturating_add(self.extension_semitones))
    }

    /// Equal-tempered frequency of the [lowest note without the extension](Self::lowest_unextended), A4 = 440 Hz.
    pub fn size_hz(&self) -> f64 {
        self.sounding(self.lowest_unextended()).frequency_hz(440.0)
    }

    /// The lowest note of the chart; MIDI note 0 for an instrument made by hand without one.
    pub fn lowest(&self) -> WrittenNote {
        self.fingerings.iter().map(|fingering| fingering.written).min().unwrap_or(WrittenNote(0))
    }

    /// The highest note of the chart; MIDI note 0 for an instrument made by hand without one.
    pub fn highest(&self) -> WrittenNote {
        self.fingerings.iter().map(|fingering| fingering.written).max().unwrap_or(WrittenNote(0))
    }

    fn tone_holes(&self, raw: Vec<Lined<RawHole>>, words: &Words) -> Result<Vec<ToneHole>, InstrumentError> {
        let mut holes: Vec<ToneHole> = Vec::with_capacity(raw.len());
        for (index, Lined { line, value: hole }) in raw.into_iter().enumerate() {
            let what = format!("hole {} ({})", index + 1, hole.name);
            let place = Place { file: words.hole.clone(), line, what };
            if hole.name.is_empty() || hole.name.contains(char::is_whitespace) {
                let expected = "one word, as the fingerings use it";
                return Err(word(&place, &words.hole_name, &hole.name, expected));
            }
            if holes.iter().any(|other| other.name == hole.name) {
                let place = place.to_string();
                return Err(InstrumentError::Duplicate { place, what: "hole".to_owned(), name: hole.name });
            }
            let length_m = self.length_m();
            // First, because then the length of the bore shows which unit was meant.
            if hole.x_mm / 1e3 >= length_m - CONTACT_M {
                let (unit, end) = (words.x.unit(), words.x.given(length_m * 1e3));
                let guess = words.x.guess(hole.x_mm, |x_mm| (0.05..0.99).contains(&(x_mm / 1e3 / length_m)));
                return Err(InstrumentError::Value {
                    place: place.to_string(),
                    field: words.x.name.clone(),
                    given: words.x.given(hole.x_mm),
                    expected: format!("inside the bore, which runs from 0 to {end} {unit}{guess}"),
                });
            }
            within(&place, &words.x, hole.x_mm, &HOLE_POSITION)?;
            within(&place, &words.hole_width, hole.diameter_mm, &HOLE_DIAMETER)?;
            within(&place, &words.chimney, hole.chimney_mm, &CHIMNEY)?;
            let x_m = hole.x_mm / 1e3;
            let (radius_m, bore_radius_m) = (hole.diameter_mm / 2e3, self.radius_at(x_m));
            // A hole as wide as the bore stays so when both are rounded to what a file holds.
            if radius_m > bore_radius_m + ROUNDING_M {
                let wide = &words.hole_width;
                return Err(InstrumentError::Value {
                    place: place.to_string(),
                    field: wide.name.clone(),
                    given: wide.given(hole.diameter_mm),
                    expected: format!(
                        "at most {} {}, the {} of the bore there",
                        wide.given(2e3 * bore_radius_m),
                        wide.unit(),
                        wide.width()
                    ),
                });
            }
            holes.push(ToneHole {
                name: hole.name,
                kind: hole.kind,
                x_m,
                radius_m,
                chimney_m: hole.chimney_mm / 1e3,
                register: hole.register,
                description: hole.description,
            });
        }
        holes.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        Ok(holes)
    }

    fn chart(&self, raw: Vec<Lined<RawFingering>>, words: &Words) -> Result<Vec<Fingering>, InstrumentError> {
        let index: HashMap<&str, usize> =
            self.holes.iter().enumerate().map(|(hole, design)| (design.name.as_str(), hole)).collect();
        let mut chart: Vec<Fingering> = Vec::with_capacity(raw.len());
        for (number, Lined { line, value: fingering }) in raw.into_iter().enumerate() {
            let what = format!("fingering {} ({})", number + 1, fingering.written);
            let place = Place { file: words.fingering.clone(), line, what };
            let Some(written) = midi_of_name(&fingering.written).map(WrittenNote) else {
                let expected = "a note like E3, F#4 or Bb4, from C-1 to G9";
                return Err(word(&place, &words.written, &fingering.written, expected));
            };
            if written.sounding(self.transposition).is_none() {
                let expected = "a note that sounds between C-1 and G9 after transposition";
                return Err(word(&place, &words.written, &fingering.written, expected));
            }
            if chart.iter().any(|other| other.written == written) {
                let (place, what) = (place.to_string(), words.written.name.clone());
                return Err(InstrumentError::Duplicate { place, what, name: written.to_string() });
            }
            if !REGISTERS.contains(&fingering.register.as_str()) {
                let expected = format!("one of {}", REGISTERS.join(", "));
                return Err(word(&place, &words.register, &fingering.register, expected));
            }
            within(&place, &words.mode, f64::from(fingering.mode), &MODE)?;
            let open = self.open_holes(&fingering.open, &index, &place, &words.open)?;
            let maker_open = fingering
                .maker_open
                .map(|names| self.open_holes(&names, &index, &place, &words.maker_open))
                .transpose()?;
            let mode = fingering.mode as usize;
            chart.push(Fingering {
                written,
                register: fingering.register,
                mode,
                open,
                maker_open,
                fingers: fingering.fingers,
            });
        }
        chart.sort_by_key(|fingering| fingering.written);
        Ok(chart)
    }

    /// Whether each hole is open, from the names of those that are.
    fn open_holes(
        &self,
        names: &str,
        index: &HashMap<&str, usize>,
        place: &Place,
        key: &Word,
    ) -> Result<Vec<bool>, InstrumentError> {
        let mut open = vec![false; self.holes.len()];
        for name in names.split_whitespace() {
            let Some(&hole) = index.get(name) else {
                let known: Vec<&str> = self.holes.iter().map(|hole| hole.name.as_str()).collect();
                let expected = format!("names of holes out of: {}", known.join(" "));
                return Err(word(place, key, name, expected));
            };
            if std::mem::replace(&mut open[hole], true) {
                let (place, what) = (place.to_string(), "hole".to_owned());
                return Err(InstrumentError::Duplicate { place, what, name: name.to_owned() });
            }
        }
        Ok(open)
    }
}

fn segments(raw: Vec<Lined<RawSegment>>, words: &Words) -> Result<Vec<BoreSegment>, InstrumentError> {
    let place = |index: usize, segment: &Lined<RawSegment>| {
        let what = format!("bore segment {} ({})", index + 1, segment.value.part);
        Place { file: words.bore.clone(), line: segment.line, what }
    };
    // First, because a whole bore in the wrong unit shows best in its length.
    if let Some(last) = raw.last() {
        within(&place(raw.len() - 1, last), &words.x_end, last.value.x_end_mm, &BORE_LENGTH)?;
    }
    let mut bore: Vec<BoreSegment> = Vec::with_capacity(raw.len());
    let mut end_mm = 0.0;
    for (index, segment) in raw.into_iter().enumerate() {
        let place = place(index, &segment);
        let segment = segment.value;
        within(&place, &words.x_start, segment.x_start_mm, &POSITION)?;
        within(&place, &words.x_end, segment.x_end_mm, &POSITION)?;
        within(&place, &words.width_start, segment.diameter_start_mm, &BORE_DIAMETER)?;
        within(&place, &words.width_end, segment.diameter_end_mm, &BORE_DIAMETER)?;
        if (segment.x_start_mm - end_mm).abs() > CONTACT_M * 1e3 {
            return Err(InstrumentError::NotContiguous {
                place: place.to_string(),
                field: words.x_start.name.clone(),
                given: words.x_start.given(segment.x_start_mm),
                expected: words.x_start.given(end_mm),
            });
        }
        // The ends of a cone of just this length may differ by a little less in their last bits.
        if segment.x_end_mm - end_mm < SHORTEST_MM - 1e-6 {
            return Err(InstrumentError::Value {
                place: place.to_string(),
                field: words.x_end.name.clone(),
                given: words.x_end.given(segment.x_end_mm),
                expected: format!(
                    "at least {} {} beyond {}",
                    words.x_end.given(SHORTEST_MM),
                    words.x_end.unit(),
                    words.x_start.name
                ),
            });
        }
        bore.push(BoreSegment {
            part: segment.part,
            x_start_m: end_mm / 1e3,
            x_end_m: segment.x_end_mm / 1e3,
            r_start_m: segment.diameter_start_mm / 2e3,
            r_end_m: segment.diameter_end_mm / 2e3,
        });
        end_mm = segment.x_end_mm;
    }
    Ok(bore)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_of_just_the_shortest_length_is_taken() {
        for start_mm in [0.0, 123.45, 641.2, 700.3] {
            let cones = |end_mm: f64| {
                let cone = |from: f64, to: f64| {
                    format!(
                        "{{ part = \"x\", x_start_mm = {from}, x_end_mm = {to}, diameter_start_mm = 15.0, diameter_end_mm = 15.0 }}"
                    )
                };
                let before = if start_mm > 0.0 { cone(0.0, start_mm) + ", " } else { String::new() };
                let bore = format!("bore = [{before}{}, {}]\n", cone(start_mm, end_mm), cone(end_mm, 750.0));
                InstrumentFile::parse(&format!(
                    "name = \"x\"\ntransposition_semitones = 0\nreed_volume_mm3 = 0\n{bore}[[fingering]]\nwritten = \"E3\"\nregister = \"chalumeau\"\nmode = 1\nopen = \"\"\n"
                ))
            };
            // As a user writes it: two decimals.
            let end_mm = ((start_mm + 0.01) * 100.0_f64).round() / 100.0;
            assert!(cones(end_mm).is_ok(), "{start_mm}: {}", cones(end_mm).unwrap_err());
            let said = cones(start_mm + 0.009).unwrap_err().to_string();
            assert!(said.contains("at least 0.01 mm"), "{said}");
        }
    }

    #[test]
    fn built_in_clarinet_is_a_whole_chart() {
        let file = InstrumentFile::built_in();
        assert_eq!((file.bore.len(), file.holes.len(), file.fingerings.len()), (63, 24, 46));
        assert_eq!((file.lowest().to_string(), file.highest().to_string()), ("E3".into(), "C#7".into()));
        let modes: Vec<usize> =
            [52, 70, 71, 84, 85].map(|midi| file.fingering(WrittenNote(midi)).unwrap().mode).into();
        assert_eq!(modes, [1, 1, 2, 2, 3]);
        assert_eq!(file.holes.iter().filter(|hole| hole.register).count(), 1);
        assert_eq!((file.transposition, file.reed_volume_m3), (2, 1.2e-6));
        assert!(file.fingering(WrittenNote(51)).is_none());
    }

    #[test]
    fn a_note_sounds_where_the_transposition_puts_it_or_at_the_end_of_midi() {
        let mut file = InstrumentFile::built_in();
        for written in file.fingerings.iter().map(|fingering| fingering.written) {
            assert_eq!(Some(file.sounding(written)), written.sounding(file.transposition));
        }
        file.transposition = 60;
        assert_eq!(file.sounding(WrittenNote(52)), SoundingNote(0), "by hand");
    }

    #[test]
    fn nominal_bore_is_that_of_a_b_flat_clarinet_unless_given() {
        let text = InstrumentFile::built_in_text();
        assert_eq!(InstrumentFile::built_in().nominal_radius_m.to_bits(), REFERENCE_RADIUS_M.to_bits());
        let given = |text: &str| {
            InstrumentFile::parse(&text.replacen("reed_volume", "nominal_diameter_mm = 23.0\nreed_volume", 1))
        };
        assert_eq!(given(text).unwrap().nominal_radius_m, 0.0115);
        let wrong = text.replacen("reed_volume", "nominal_diameter_mm = 0.023\nreed_volume", 1);
        let message = InstrumentFile::parse(&wrong).unwrap_err().to_string();
        assert!(
            message.contains("nominal_diameter_mm") && message.contains("this looks like metres"),
            "{message}"
        );
    }

    #[test]
    fn scaling_is_isotropic_and_by_one_nothing() {
        let file = InstrumentFile::built_in();
        assert_eq!(file.scaled(1.0), file);
        let twice = file.scaled(2.0);
        assert_eq!((twice.length_m(), twice.nominal_radius_m), (2.0 * file.length_m(), 0.0149));
        assert_eq!(twice.radius_at(0.4), 2.0 * file.radius_at(0.2));
        assert_eq!(twice.reed_volume_m3, 8.0 * file.reed_volume_m3);
        assert_eq!(twice.holes[3].chimney_m, 2.0 * file.holes[3].chimney_m);
        assert_eq!((twice.transposition, &twice.fingerings), (file.transposition, &file.fingerings));
        assert_eq!(twice.scaled(0.5), file);
    }

    #[test]
    fn radius_at_a_step_is_that_of_the_upstream_side() {
        let file = InstrumentFile::built_in();
        assert!((file.radius_at(0.118_687) - 0.007_505_1).abs() < 1e-12);
        assert!((file.radius_at(0.118_687 + 1e-9) - 0.007_605_1).abs() < 1e-9);
        assert_eq!((file.radius_at(-1.0), file.radius_at(9.0)), (0.0052, 0.0295));
    }

    /// Each fault, planted in the built-in file, is refused with its place and a remedy.
    #[test]
    fn messages_say_where_what_and_how() {
        let cases = [
            ("name = \"B", "nome = \"B", "line 14"),
            (
                "reed_volume_mm3 = 1200.0",
                "reed_volume_mm3 = 1.2",
                "the file: reed_volume_mm3 is 1.2; it must be 0, or 20 to 20000 mm3 (clarinet: 1200 mm3); this looks like cubic centimetres: 1.2 cm3 = 1200 mm3",
            ),
            ("transposition_semitones = 2", "transposition_semitones = 200", "-12 to 36 semitones"),
            (
                "x_start_mm = 39.787",
                "x_start_mm = 40",
                "bore segment 2 (mouthpiece): x_start_mm is 40, leaving a gap after the cone before it; it must be 39.787",
            ),
            ("x_start_mm = 39.787", "x_start_mm = 39", "overlapping the cone before it; it must be 39.787"),
            (
                "diameter_start_mm = 13.8,",
                "diameter_start_mm = 0.0138,",
                "line 29: bore segment 2 (mouthpiece): diameter_start_mm is 0.0138; it must be 1 to 200 mm; this looks like metres: 0.0138 m = 13.8 mm",
            ),
            (
                "x_mm = 155.787",
                "x_mm = 0.155787",
                "x_mm is 0.155787; it must be 1 to 3000 mm; this looks like metres",
            ),
            ("diameter_start_mm = 13.8,", "diameter_start_mm = nan,", "diameter_start_mm is NaN"),
            ("x_end_mm = 667.587", "x_end_mm = 0.667", "looks like metres"),
            (
                "x_mm = 155.787",
                "x_mm = 855.787",
                "hole 1 (REG): x_mm is 855.787; it must be inside the bore, which runs from 0 to 667.587 mm",
            ),
            (
                "diameter_mm = 3.167",
                "diameter_mm = 31.67",
                "hole 1 (REG): diameter_mm is 31.67; it must be at most 14.9366 mm, the diameter of the bore there",
            ),
            ("chimney_mm = 12.6", "chimney_mm = 0.0126", "this looks like metres: 0.0126 m = 12.6 mm"),
            ("name = \"TRILL4_B\"", "name = \"REG\"", "hole 2 (REG): hole REG appears twice"),
            (
                "open = \"E_PAD\"",
                "open = \"E_PAT\"",
                "fingering 2 (F3): open is \"E_PAT\"; it must be names of holes out of: REG TRILL4_B",
            ),
            ("open = \"E_PAD\"", "open = \"E_PAD E_PAD\"", "fingering 2 (F3): hole E_PAD appears twice"),
            ("written = \"F3\"", "written = \"E3\"", "fingering 2 (E3): written E3 appears twice"),
            ("written = \"F3\"", "written = \"H3\"", "a note like E3"),
            (
                "register = \"chalumeau\"",
                "register = \"low\"",
                "one of chalumeau, throat, clarion, altissimo",
            ),
            ("mode = 1", "mode = 0", "fingering 1 (E3): mode is 0; it must be 1 to 12"),
            (
                "open = \"\"",
                "open = \"\"\nmaker_open = \"X\"",
                "fingering 1 (E3): maker_open is \"X\"; it must be names of holes",
            ),
        ];
        for (from, to, expected) in cases {
            let text = InstrumentFile::built_in_text().replacen(from, to, 1);
            assert_ne!(text, InstrumentFile::built_in_text(), "{from} is not in the file");
            let message = InstrumentFile::parse(&text).unwrap_err().to_string();
            assert!(message.contains(expected), "{from} -> {to}: {message}");
        }
    }

    #[test]
    fn holes_and_fingerings_may_come_in_any_order() {
        let text = "name='tube'\ntransposition_semitones=0\nreed_volume_mm3=0\n\
            bore=[{x_start_mm=0,x_end_mm=500,diameter_start_mm=15,diameter_end_mm=15}]\n\
            hole=[{name='b',kind='finger',x_mm=400,diameter_mm=8,chimney_mm=7},{name='a',kind='pad-open',x_mm=300,diameter_mm=8,chimney_mm=7}]\n\
            fingering=[{written='G4',register='throat',mode=1,open='b'},{written='C4',register='throat',mode=1,open=''}]\n";
        let file = InstrumentFile::parse(text).unwrap();
        assert_eq!((file.hole("a"), file.hole("b")), (Some(0), Some(1)));
        assert_eq!(file.fingering(WrittenNote(67)).unwrap().open, [false, true]);
        assert_eq!(file.lowest(), WrittenNote(60));
    }
}
