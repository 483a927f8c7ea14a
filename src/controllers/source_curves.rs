//! A curve of its own for a source of breath. A source without one follows the parameters *Softest breath*, *Loudest breath* and
//! *Breath curve*, which all sources share. Linked controllers have a range and a curve in their table, and the knob has *Knob
//! curve*; both then follow the common one.
//!
//! The instrument knows the common curve alone: a source with its own sends the breath with which the common curve gives the
//! dynamic of the own.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use serde::{Deserialize, Serialize};

use chalumeau_core::control::midi::BreathOrigin;
use chalumeau_core::instrument::player::response::dynamic;
use chalumeau_core::instrument::{BreathResponse, Settings};
use chalumeau_core::maths;

use crate::controllers::breath_input::BreathInput;

/// A source that may have a curve of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveSource {
    /// Breath controller, CC2.
    Breath,
    /// Expression, CC11.
    Expression,
    /// Channel pressure.
    Pressure,
    /// Pressure or expression of a note.
    Note,
}

impl CurveSource {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Breath, Self::Expression, Self::Pressure, Self::Note];

    /// Its name in a saved state.
    fn id(self) -> &'static str {
        match self {
            Self::Breath => "cc2",
            Self::Expression => "cc11",
            Self::Pressure => "pressure",
            Self::Note => "note",
        }
    }

    /// That of an input; `None` if the input has no curve of its own here.
    pub fn of(input: BreathInput) -> Option<Self> {
        Some(match input {
            BreathInput::Breath => Self::Breath,
            BreathInput::Expression => Self::Expression,
            BreathInput::Pressure => Self::Pressure,
            BreathInput::Note => Self::Note,
            _ => return None,
        })
    }
}

/// The way from what a source sends, 0..=1, to the dynamic; see the settings of these names.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceCurve {
    /// [`Settings::breath_softest`].
    pub softest: f32,
    /// [`Settings::breath_loudest`].
    pub loudest: f32,
    /// [`Settings::breath_curve`].
    pub curve: f32,
}

impl SourceCurve {
    /// The common curve.
    pub fn common(settings: &Settings) -> Self {
        let Settings { breath_softest: softest, breath_loudest: loudest, breath_curve: curve, .. } =
            settings.clamped();
        Self { softest, loudest, curve }
    }

    /// The settings with this curve as the common one, every number inside its range.
    pub fn over(self, settings: &Settings) -> Settings {
        let Self { softest: breath_softest, loudest: breath_loudest, curve: breath_curve } = self;
        Settings { breath_softest, breath_loudest, breath_curve, ..*settings }.clamped()
    }

    fn mended(self) -> Self {
        Self::common(&self.over(&Settings::default()))
    }

    /// What the source sends as the breath with which the common curve gives the same. Real-time safe.
    fn as_common(self, breath: f32, settings: &Settings) -> f32 {
        if settings.breath_response == BreathResponse::Physical || breath <= 0.0 {
            return breath;
        }
        let (above, below) = dynamic(f64::from(breath), &self.over(settings));
        let [softest, loudest, curve] = {
            let Self { softest, loudest, curve } = Self::common(settings);
            [softest, loudest, curve].map(f64::from)
        };
        let common = if below < 1.0 {
            below * softest
        } else {
            softest + (loudest - softest) * maths::pow(above, curve.recip())
        };
        common as f32
    }
}

/// The own curves at one moment, and the settings that have the common one.
#[derive(Clone, Debug, Default)]
pub struct CurvesNow {
    own: [Option<SourceCurve>; CurveSource::ALL.len()],
    settings: Settings,
}

impl CurvesNow {
    /// The breath that a source sends, for the instrument. Real-time safe.
    pub fn breath(&self, origin: BreathOrigin, breath: f32) -> f32 {
        let own = CurveSource::of(origin.into()).and_then(|source| self.own[source as usize]);
        own.map_or(breath, |own| own.as_common(breath, &self.settings))
    }
}

/// The own curves of one plugin instance, shared without a lock between the audio thread, which follows them, and the window.
#[derive(Debug, Default)]
pub struct SourceCurves {
    places: [Place; CurveSource::ALL.len()],
    changes: AtomicU32,
}

/// A curve, or none. Its numbers may be of two moments for as long as one is being written.
#[derive(Debug, Default)]
struct Place {
    is_own: AtomicBool,
    numbers: [AtomicU32; 3],
}

/// What a project saves: the curves by their sources.
pub type SavedCurves = BTreeMap<String, SourceCurve>;

impl SourceCurves {
    /// The curve of a source; `None` where it follows the common one. Real-time safe.
    pub fn get(&self, source: CurveSource) -> Option<SourceCurve> {
        let Place { is_own, numbers } = &self.places[source as usize];
        // The flag first: who sees it sees the numbers that were written before it.
        is_own.load(Ordering::Acquire).then(|| {
            let [softest, loudest, curve] =
                numbers.each_ref().map(|bits| f32::from_bits(bits.load(Ordering::Relaxed)));
            SourceCurve { softest, loudest, curve }
        })
    }

    /// Gives a source its own curve, or the common one again.
    pub fn put(&self, source: CurveSource, own: Option<SourceCurve>) {
        if self.set(source, own) {
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The same without counting; whether anything has changed.
    fn set(&self, source: CurveSource, own: Option<SourceCurve>) -> bool {
        let own = own.map(SourceCurve::mended);
        if self.get(source) == own {
            return false;
        }
        let place = &self.places[source as usize];
        if let Some(SourceCurve { softest, loudest, curve }) = own {
            for (bits, number) in place.numbers.iter().zip([softest, loudest, curve]) {
                bits.store(number.to_bits(), Ordering::Relaxed);
            }
        }
        place.is_own.store(own.is_some(), Ordering::Release);
        true
    }

    /// How often a hand has changed a curve; the number wraps around.
    pub fn changes(&self) -> u32 {
        self.changes.load(Ordering::Relaxed)
    }

    /// All of them now, beside these settings. Real-time safe.
    pub fn now(&self, settings: &Settings) -> CurvesNow {
        CurvesNow { own: CurveSource::ALL.map(|source| self.get(source)), settings: *settings }
    }

    /// What a project saves.
    pub fn saved(&self) -> SavedCurves {
        let own = |source: CurveSource| Some((source.id().to_owned(), self.get(source)?));
        CurveSource::ALL.into_iter().filter_map(own).collect()
    }

    /// Takes what a project has saved, and nothing else.
    pub fn take(&self, saved: &SavedCurves) {
        for source in CurveSource::ALL {
            self.set(source, saved.get(source.id()).copied());
        }
    }

    /// Saved curves as they may be: of known sources, every number inside its range.
    pub fn mended(saved: SavedCurves) -> SavedCurves {
        let curves = Self::default();
        curves.take(&saved);
        curves.saved()
    }
}

#[cfg(test)]
mod tests {
    use chalumeau_core::control::midi::breath::BreathController;

    use super::*;

    const CC2: BreathOrigin = BreathOrigin::Controller(BreathController::Breath);
    const OWN: SourceCurve = SourceCurve { softest: 0.1, loudest: 0.7, curve: 2.0 };

    #[test]
    fn a_source_with_its_own_curve_plays_the_dynamics_of_it_whatever_the_common_one_is() {
        let curves = SourceCurves::default();
        curves.put(CurveSource::Breath, Some(OWN));
        for common in [SourceCurve { softest: 0.3, loudest: 0.9, curve: 0.6 }, OWN] {
            let settings = common.over(&Settings::default());
            let (own, now) = (OWN.over(&settings), curves.now(&settings));
            for step in 0..=50 {
                let breath = step as f32 / 50.0;
                let wanted = dynamic(f64::from(breath), &own);
                let got = dynamic(f64::from(now.breath(CC2, breath)), &settings);
                assert!(
                    (wanted.0 - got.0).abs() < 1e-5 && (wanted.1 - got.1).abs() < 1e-5,
                    "{breath}: {wanted:?} {got:?}"
                );
                // All others keep their bits.
                assert_eq!(now.breath(BreathOrigin::Note, breath), breath);
                assert_eq!(now.breath(BreathOrigin::Link, breath), breath);
            }
        }
        let physical = curves.now(&Settings::physical());
        assert_eq!(physical.breath(CC2, 0.4), 0.4, "a pressure is a pressure");
        curves.put(CurveSource::Breath, None);
        assert_eq!(curves.now(&Settings::default()).breath(CC2, 0.4), 0.4);
    }

    #[test]
    fn a_project_keeps_the_curves_and_only_what_may_be_one() {
        let curves = SourceCurves::default();
        assert!(curves.saved().is_empty() && curves.changes() == 0);
        curves.put(CurveSource::Pressure, Some(OWN));
        curves.put(CurveSource::Pressure, Some(OWN));
        assert_eq!(curves.changes(), 1);
        let other = SourceCurves::default();
        other.take(&curves.saved());
        assert_eq!(CurveSource::ALL.map(|source| other.get(source)), [None, None, Some(OWN), None]);
        let wild = SourceCurve { softest: f32::NAN, loudest: 9.0, curve: 0.0 };
        let saved = [("cc2".to_owned(), wild), ("cc3".to_owned(), OWN)].into();
        let mended = SourceCurves::mended(saved);
        assert_eq!(mended.len(), 1);
        assert_eq!(mended["cc2"].mended(), mended["cc2"]);
        assert_eq!((mended["cc2"].loudest, mended["cc2"].curve), (1.0, 0.5));
    }
}
