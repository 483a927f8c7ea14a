//! Whether an instrument that was made or changed by hand is one: what reading a file refuses is refused here.

use super::limits::{MAX_HOLES, MAX_SEGMENTS, count};
use super::raw::{Lined, RawFile, RawFingering, RawHole, RawSegment};
use super::words::{Words, tidy};
use super::{Fingering, InstrumentError, InstrumentFile};

impl InstrumentFile {
    /// Refuses what [`parse`](Self::parse) refuses, in the same words, of an instrument that was made or changed by hand: numbers out of
    /// range or that are none, too many holes, no fingering, and fingerings that do not say of every hole whether it is open. Allocates.
    ///
    /// # Errors
    /// [`InstrumentError`] with the place, what was given and what would be right, in millimetres and diameters as in a file.
    ///
    /// ```
    /// use chalumeau_core::bore::instrument_file::InstrumentFile;
    ///
    /// let mut clarinet = InstrumentFile::built_in();
    /// assert!(clarinet.check().is_ok() && clarinet.scaled(100.0).check().is_err());
    /// clarinet.holes[0].radius_m = f64::NAN;
    /// assert!(clarinet.check().unwrap_err().to_string().contains("diameter_mm is NaN"));
    /// ```
    pub fn check(&self) -> Result<(), InstrumentError> {
        // First, so that nothing large is written down.
        count("bore", self.bore.len(), 1, MAX_SEGMENTS)?;
        count("hole", self.holes.len(), 0, MAX_HOLES)?;
        count("fingering", self.fingerings.len(), 1, 128)?;
        self.check_lengths()?;
        let read = Self::from_raw(self.to_raw(), &Words::toml())?;
        self.check_order(&read)
    }

    fn check_lengths(&self) -> Result<(), InstrumentError> {
        let holes = self.holes.len();
        for (index, fingering) in self.fingerings.iter().enumerate() {
            let all = [("open", Some(&fingering.open)), ("maker_open", fingering.maker_open.as_ref())];
            let wrong = all.into_iter().find(|(_, open)| open.is_some_and(|open| open.len() != holes));
            if let Some((field, Some(open))) = wrong {
                return Err(InstrumentError::Value {
                    place: place(index, fingering),
                    field: format!("the length of {field}"),
                    given: open.len() as f64,
                    expected: format!("{holes}, one for each hole"),
                });
            }
        }
        Ok(())
    }

    /// Reading sorts holes and fingerings; by hand they must stand in their order.
    fn check_order(&self, read: &Self) -> Result<(), InstrumentError> {
        let wrong = |place: String, field: &str, given: f64, expected: &str| {
            Err(InstrumentError::Value {
                place,
                field: field.to_owned(),
                given,
                expected: expected.to_owned(),
            })
        };
        let moved = self.holes.iter().zip(&read.holes).position(|(hole, read)| hole.name != read.name);
        if let Some(index) = moved {
            let hole = &self.holes[index];
            let place = format!("hole {} ({})", index + 1, hole.name);
            return wrong(place, "x_mm", tidy(1e3 * hole.x_m), "in the order from the reed to the bell");
        }
        let moved =
            self.fingerings.iter().zip(&read.fingerings).position(|(own, read)| own.written != read.written);
        if let Some(index) = moved {
            let fingering = &self.fingerings[index];
            let given = f64::from(fingering.written.0);
            return wrong(place(index, fingering), "written", given, "in the order from the lowest note up");
        }
        Ok(())
    }

    fn to_raw(&self) -> RawFile {
        RawFile {
            name: self.name.clone(),
            source: String::new(),
            transposition_semitones: i64::from(self.transposition),
            reed_volume_mm3: tidy(1e9 * self.reed_volume_m3),
            nominal_diameter_mm: Some(tidy(2e3 * self.nominal_radius_m)),
            extension_semitones: i64::from(self.extension_semitones),
            bore: by_hand(self.bore.iter().map(|segment| RawSegment {
                part: segment.part.clone(),
                x_start_mm: tidy(1e3 * segment.x_start_m),
                x_end_mm: tidy(1e3 * segment.x_end_m),
                diameter_start_mm: tidy(2e3 * segment.r_start_m),
                diameter_end_mm: tidy(2e3 * segment.r_end_m),
            })),
            hole: by_hand(self.holes.iter().map(|hole| RawHole {
                name: hole.name.clone(),
                kind: hole.kind,
                x_mm: tidy(1e3 * hole.x_m),
                diameter_mm: tidy(2e3 * hole.radius_m),
                chimney_mm: tidy(1e3 * hole.chimney_m),
                register: hole.register,
                description: String::new(),
            })),
            fingering: by_hand(self.fingerings.iter().map(|fingering| RawFingering {
                written: fingering.written.to_string(),
                register: fingering.register.clone(),
                mode: u32::try_from(fingering.mode).unwrap_or(u32::MAX),
                open: self.names(&fingering.open),
                maker_open: fingering.maker_open.as_deref().map(|open| self.names(open)),
                fingers: String::new(),
            })),
        }
    }

    /// The names of the open holes, as a file has them.
    pub(super) fn names(&self, open: &[bool]) -> String {
        let open = self.holes.iter().zip(open).filter(|(_, open)| **open);
        open.map(|(hole, _)| hole.name.as_str()).collect::<Vec<_>>().join(" ")
    }
}

fn by_hand<T>(values: impl Iterator<Item = T>) -> Vec<Lined<T>> {
    values.map(|value| Lined { line: None, value }).collect()
}

fn place(index: usize, fingering: &Fingering) -> String {
    format!("fingering {} ({})", index + 1, fingering.written)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::bundled::Bundled;
    use crate::units::WrittenNote;

    #[test]
    fn what_comes_with_the_program_is_whole() {
        for bundled in Bundled::ALL {
            let file = bundled.file();
            assert!(file.check().is_ok(), "{bundled:?}: {:?}", file.check());
            for factor in [0.9, 1.0 / 3.0 + 0.7, 1.1] {
                assert!(file.scaled(factor).check().is_ok(), "{bundled:?} x {factor}");
            }
        }
    }

    #[test]
    fn what_a_hand_can_spoil_is_refused_with_its_place() {
        type Spoil = fn(&mut InstrumentFile);
        let spoils: [(Spoil, &str); 18] = [
            (|file| file.fingerings.clear(), "0 fingering entries"),
            (|file| file.bore.clear(), "0 bore entries"),
            (|file| file.holes = vec![file.holes[0].clone(); 124], "124 hole entries"),
            (|file| file.fingerings[3].open.clear(), "the length of open is 0; it must be 24"),
            (|file| file.fingerings[3].maker_open = Some(vec![true]), "the length of maker_open is 1"),
            (|file| file.holes[2].x_m = f64::NAN, "x_mm is NaN"),
            (|file| file.holes[2].chimney_m = 0.0, "chimney_mm is 0"),
            (|file| file.bore[5].r_end_m = -1.0, "diameter_end_mm is -2000"),
            (|file| file.bore[5].x_end_m = f64::INFINITY, "x_end_mm is inf"),
            (|file| file.nominal_radius_m = 0.0, "nominal_diameter_mm is 0"),
            (|file| file.reed_volume_m3 = f64::NAN, "reed_volume_mm3 is NaN"),
            (|file| file.fingerings[0].mode = usize::MAX, "mode"),
            (|file| file.fingerings[0].written = WrittenNote(200), "written"),
            (|file| file.holes.swap(3, 4), "from the reed to the bell"),
            (|file| file.fingerings.swap(3, 4), "from the lowest note up"),
            (|file| *file = file.scaled(1e9), "must be"),
            (|file| *file = file.scaled(-1.0), "must be"),
            (|file| *file = file.scaled(f64::NAN), "must be"),
        ];
        for (spoil, says) in spoils {
            let mut file = InstrumentFile::built_in();
            spoil(&mut file);
            let said = file.check().map_or_else(|error| error.to_string(), |()| "taken".to_owned());
            assert!(said.contains(says), "{said}, and not {says}");
        }
    }
}
