//! Which instrument is wanted, at which pitch, rate and quality; and the key under which the result is kept.

use super::prepared_file;
use crate::bore::instrument_file::{BoreSegment, Fingering, HoleKind, InstrumentFile, ToneHole};
use crate::instrument::concert_pitch::{A4_BY_DELAY_HZ, A4_HZ, A4_RANGE_HZ};
use crate::instrument::internal_rate::checked_rate_hz;
use crate::instrument::model::BuildError;
use crate::instrument::store::Key;

/// Part of every key. Raise it when fitting or tuning give other numbers for the same instrument. A change that moves the
/// data of the built-in clarinet changes the keys without it.
const VERSION: u32 = 3;

/// How finely the bore is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// The lattice runs at 96 or 88.2 kHz.
    #[default]
    Live,
    /// The lattice runs at twice that rate, in double precision, with its own fit and trims: for rendering.
    High,
}

impl Quality {
    /// The lattice's rate over that of [`Live`](Self::Live).
    pub fn factor(self) -> f64 {
        match self {
            Self::Live => 1.0,
            Self::High => 2.0,
        }
    }
}

/// An instrument to prepare: the input of [`Preparation`](super::Preparation).
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The instrument's measurements and fingerings.
    pub file: InstrumentFile,
    /// Pitch of A4, Hz, within [`A4_RANGE_HZ`].
    pub a4_hz: f64,
    /// The host's sample rate, Hz, 1000..=1536000.
    pub host_rate_hz: f64,
    /// How finely the bore is cut.
    pub quality: Quality,
}

/// How far a stored instrument was prepared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stored {
    /// Scaled, fitted and tuned.
    Tuned,
    /// Fitted exactly as the file has it, not tuned.
    #[cfg(feature = "fit")]
    AsBuilt,
}

impl Stored {
    /// The word in the key. Changing it makes every stored instrument unknown.
    fn word(self) -> &'static str {
        match self {
            Self::Tuned => "tuned",
            #[cfg(feature = "fit")]
            Self::AsBuilt => "as built",
        }
    }
}

impl Wanted {
    /// At A4 = 440 Hz in [`Quality::Live`].
    pub fn new(file: InstrumentFile, host_rate_hz: f64) -> Self {
        Self { file, a4_hz: A4_HZ, host_rate_hz, quality: Quality::Live }
    }

    /// Pitch of A4 that the instrument is tuned for, Hz: 440 inside [`A4_BY_DELAY_HZ`], elsewhere as wanted.
    pub fn tuned_a4_hz(&self) -> f64 {
        let (low, high) = A4_BY_DELAY_HZ;
        if (low..=high).contains(&self.a4_hz) { A4_HZ } else { self.a4_hz }
    }

    /// The lattice's rate, Hz.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the host's rate is out of range.
    pub fn internal_rate_hz(&self) -> Result<f64, BuildError> {
        Ok(checked_rate_hz(self.host_rate_hz)? * self.quality.factor())
    }

    /// Hash of everything the tuned instrument depends on, the version of the preparation included.
    ///
    /// # Errors
    /// [`BuildError::Rate`] if the host's rate is out of range.
    pub fn key(&self) -> Result<Key, BuildError> {
        self.key_of(Stored::Tuned)
    }

    pub(super) fn key_of(&self, stored: Stored) -> Result<Key, BuildError> {
        self.key_with(stored, VERSION, prepared_file::BUILT_IN)
    }

    /// `built_in` is what fitting and tuning make of the built-in clarinet: when it changes, everything they made before
    /// is out of date.
    fn key_with(&self, stored: Stored, version: u32, built_in: &str) -> Result<Key, BuildError> {
        let mut all = Vec::with_capacity(65_536);
        all.extend(stored.word().as_bytes());
        all.extend(version.to_le_bytes());
        all.extend(built_in.as_bytes());
        append(&mut all, &[self.internal_rate_hz()?, self.tuned_a4_hz()]);
        describe(&mut all, &self.file);
        Ok(Key::of(&all))
    }

    /// The lattice's rate and the pitch of A4 to tune for, Hz, if both are in range and the instrument is one.
    pub(super) fn checked(&self) -> Result<(f64, f64), BuildError> {
        let rate_hz = self.internal_rate_hz()?;
        if !(A4_RANGE_HZ.0..=A4_RANGE_HZ.1).contains(&self.a4_hz) {
            return Err(BuildError::A4(self.a4_hz));
        }
        self.file.check()?;
        Ok((rate_hz, self.tuned_a4_hz()))
    }
}

/// Hash of everything in a file that can be heard.
pub(super) fn content(file: &InstrumentFile) -> Key {
    let mut all = Vec::with_capacity(8_192);
    describe(&mut all, file);
    Key::of(&all)
}

fn append(all: &mut Vec<u8>, numbers: &[f64]) {
    all.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

/// Everything in a file that can be heard, as bytes for a hash. Names and remarks are left out. The patterns name every
/// field, so that a new field does not compile until someone decides about it.
fn describe(all: &mut Vec<u8>, file: &InstrumentFile) {
    let InstrumentFile {
        name: _,
        source: _,
        transposition,
        reed_volume_m3,
        nominal_radius_m,
        extension_semitones,
        bore,
        holes,
        fingerings,
    } = file;
    all.extend(transposition.to_le_bytes());
    append(all, &[*reed_volume_m3, *nominal_radius_m]);
    // Without one, the hash is what it was before there were extensions: tables that users keep stay valid.
    if *extension_semitones > 0 {
        all.push(*extension_semitones);
    }
    append(all, &[bore.len() as f64, holes.len() as f64, fingerings.len() as f64]);
    for BoreSegment { part: _, x_start_m, x_end_m, r_start_m, r_end_m } in bore {
        append(all, &[*x_start_m, *x_end_m, *r_start_m, *r_end_m]);
    }
    for ToneHole { name: _, kind, x_m, radius_m, chimney_m, register, description: _ } in holes {
        let kind = match kind {
            HoleKind::Finger => 0.0,
            HoleKind::KeyClosed => 1.0,
            HoleKind::PadOpen => 2.0,
        };
        append(all, &[*x_m, *radius_m, *chimney_m, kind, f64::from(u8::from(*register))]);
    }
    for Fingering { written, register, mode, open, maker_open, fingers: _ } in fingerings {
        append(all, &[f64::from(written.0), *mode as f64, register.len() as f64]);
        all.extend(register.as_bytes());
        let maker_open = maker_open.as_deref().unwrap_or(open);
        all.extend(open.iter().chain(maker_open).map(|&open| u8::from(open)));
    }
}

#[cfg(all(test, feature = "fit"))]
mod tests {
    use super::*;

    fn pipe() -> InstrumentFile {
        InstrumentFile::parse(include_str!("../../../tests/data/pipe.toml")).unwrap()
    }

    #[test]
    fn everything_that_matters_is_in_the_key() {
        let wanted = Wanted::new(pipe(), 48_000.0);
        let same = |other: Wanted| other.key().unwrap() == wanted.key().unwrap();
        assert!(same(Wanted { host_rate_hz: 96_000.0, a4_hz: 442.0, ..wanted.clone() }));
        assert!(!same(Wanted { host_rate_hz: 44_100.0, ..wanted.clone() }));
        assert!(!same(Wanted { a4_hz: 415.0, ..wanted.clone() }));
        assert!(!same(Wanted { quality: Quality::High, ..wanted.clone() }));
        // Other algorithms change the version, or what they make of the built-in clarinet.
        let keys = [
            (Stored::Tuned, VERSION, prepared_file::BUILT_IN),
            (Stored::AsBuilt, VERSION, prepared_file::BUILT_IN),
            (Stored::Tuned, VERSION + 1, prepared_file::BUILT_IN),
        ]
        .map(|(stored, version, built_in)| wanted.key_with(stored, version, built_in).unwrap());
        assert_eq!(keys[0], wanted.key().unwrap());
        let other = prepared_file::BUILT_IN.replacen('4', "5", 1);
        let other = wanted.key_with(Stored::Tuned, VERSION, &other).unwrap();
        assert!(keys[1..].iter().chain([&other]).all(|key| *key != keys[0]));
        let changed = |change: fn(&mut InstrumentFile)| {
            let mut file = pipe();
            change(&mut file);
            !same(Wanted { file, ..wanted.clone() })
        };
        assert!(!changed(|file| file.source.push('.')));
        assert!(changed(|file| file.transposition += 1));
        assert!(changed(|file| file.reed_volume_m3 *= 1.001));
        assert!(changed(|file| file.nominal_radius_m *= 1.001));
        assert!(changed(|file| file.extension_semitones = 1));
        assert!(changed(|file| file.bore[0].r_end_m *= 1.001));
        assert!(changed(|file| file.holes[1].register = true));
        assert!(changed(|file| file.holes[1].chimney_m *= 1.001));
        assert!(changed(|file| file.fingerings[1].open[0] = true));
        assert!(changed(|file| file.fingerings[1].maker_open = Some(vec![true; file.holes.len()])));
        assert!(changed(|file| file.fingerings[1].mode = 2));
    }
}
