//! The feel of each note of an instrument, and the mouth pressure that each knob angle gives.

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::{
    AngleMap, FeelDesign, FeelRefused, FeelTable, PlayedReed, RequirementSolver, TorqueLimits,
};
use chalumeau_core::instrument::feel_inputs::{played_reed, requirements};
use chalumeau_core::instrument::player::response::ONSET;
use chalumeau_core::instrument::{BreathResponse, BuildError, Model, Settings};
use chalumeau_core::units::SoundingNote;
use std::sync::{Arc, LazyLock};

use crate::wire::{Decoder, Feel, Message, encode};

/// MIDI pitches.
const PITCHES: usize = 128;

/// Limits that allow any feel, for replays and knobs without a motor.
pub const NO_MOTOR: TorqueLimits = TorqueLimits {
    ceiling_mnm: f64::INFINITY,
    stiffness_nm_per_rad: f64::INFINITY,
    push_nm_per_rad: f64::INFINITY,
};

/// The built-in clarinet, computed once for all users.
static BUILT_IN: LazyLock<Result<Arc<InstrumentFeel>, BuildError>> =
    LazyLock::new(|| Model::built_in(48_000.0).map(|model| Arc::new(InstrumentFeel::new(&model))));

/// An instrument with what its bore requires for every note. Building one takes about a second.
#[derive(Clone, Debug)]
pub struct InstrumentFeel {
    requirements: RequirementSolver,
    file: InstrumentFile,
    a4_hz: f64,
    /// Index of the fingering for each sounding pitch.
    fingerings: [Option<u8>; PITCHES],
}

impl InstrumentFeel {
    /// The built-in clarinet. The first call takes about a second; an error says why the model cannot be built.
    pub fn built_in() -> Result<Arc<Self>, &'static BuildError> {
        BUILT_IN.as_ref().map(Arc::clone)
    }

    /// Analyses every note of a model with its waveguide. Allocates; takes about a second.
    pub fn new(model: &Model) -> Self {
        let file = &model.file;
        let mut fingerings = [None; PITCHES];
        for (index, fingering) in file.fingerings.iter().enumerate() {
            let sounding = file.sounding(fingering.written);
            if let Some(place) = fingerings.get_mut(usize::from(sounding.0)) {
                *place = u8::try_from(index).ok();
            }
        }
        Self { requirements: requirements(model), file: file.clone(), a4_hz: model.a4_hz, fingerings }
    }

    /// What the bore requires for each note.
    pub fn requirements(&self) -> &RequirementSolver {
        &self.requirements
    }

    /// The reed under these settings, as the sound has it. Allocates.
    pub fn reed(&self, settings: &Settings) -> PlayedReed {
        played_reed(&self.file, self.a4_hz, settings)
    }

    /// The feel of every note, or why the limits refuse it. Allocates; takes up to 50 ms.
    pub fn table(
        &self,
        settings: &Settings,
        design: &FeelDesign,
        limits: &TorqueLimits,
    ) -> Result<FeelTable, FeelRefused> {
        FeelTable::new(&self.requirements, design, &self.reed(settings), limits)
    }

    /// The same, weakened as far as the ceiling asks for: the table, and the design whose strength it has. Another limit still refuses
    /// it, and so does a ceiling that leaves nothing beside mark and friction. Allocates; takes up to 0.2 s.
    pub fn strongest(
        &self,
        settings: &Settings,
        design: &FeelDesign,
        limits: &TorqueLimits,
    ) -> Result<(FeelTable, FeelDesign), FeelRefused> {
        let mut design = *design;
        loop {
            match self.table(settings, &design, limits) {
                Ok(table) => return Ok((table, design)),
                Err(FeelRefused::Ceiling { strength_mnm, .. })
                    if strength_mnm > 0.0 && strength_mnm < design.strength_mnm =>
                {
                    design.strength_mnm = strength_mnm;
                }
                Err(refused) => return Err(refused),
            }
        }
    }

    /// Index of the fingering for a sounding pitch. Real-time safe.
    pub fn fingering(&self, note: SoundingNote) -> Option<usize> {
        self.fingerings.get(usize::from(note.0)).copied().flatten().map(usize::from)
    }

    /// The same table by sounding pitch, for the audio thread: the mouth pressure that each angle asks for. Where the breath is
    /// played, a share of full breath that is written as a pressure: sound begins at the angle where it is felt to begin.
    pub fn maps_for(&self, table: &FeelTable, settings: &Settings) -> PitchMaps {
        let maps = self.maps(table);
        match settings.breath_response {
            BreathResponse::Physical => maps,
            BreathResponse::Played => {
                let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
                let played = |map: AngleMap| map.with_onset(ONSET * full_pa, full_pa);
                PitchMaps {
                    by_pitch: maps.by_pitch.map(|map| map.map(played)),
                    otherwise: maps.otherwise.map(played),
                }
            }
        }
    }

    /// Feel and maps by sounding pitch, for a player of these settings. Allocates.
    pub fn played(&self, table: &FeelTable, settings: &Settings) -> PlayedFeel {
        let of = |index: u8| table.note(usize::from(index)).map(|note| note.feel);
        PlayedFeel {
            maps: self.maps_for(table, settings),
            feels: self.fingerings.iter().map(|fingering| fingering.and_then(of)).collect(),
            reference: table.reference().feel,
        }
    }

    /// The same table by sounding pitch: the mouth pressure that each angle asks for.
    pub fn maps(&self, table: &FeelTable) -> PitchMaps {
        let of = |index: u8| table.note(usize::from(index)).map(|note| note.map);
        PitchMaps {
            by_pitch: self.fingerings.map(|fingering| fingering.and_then(of)),
            otherwise: Some(table.reference().map),
        }
    }
}

/// What plays a knob, by sounding pitch: the feel that it is sent, and the pressure that its angle gives. As bytes it goes from
/// the thread that computes it to the one that plays, where threads share no memory.
#[derive(Clone, Debug, Default)]
pub struct PlayedFeel {
    /// The maps from angle to mouth pressure.
    pub maps: PitchMaps,
    feels: Vec<Option<Feel>>,
    reference: Feel,
}

impl PlayedFeel {
    /// The feel of a fingered note (none, or one that the instrument lacks: of the reference note).
    pub fn feel(&self, note: Option<SoundingNote>) -> Feel {
        let own = note.and_then(|note| self.feels.get(usize::from(note.0)).copied().flatten());
        own.unwrap_or(self.reference)
    }

    /// For [`from_bytes`](Self::from_bytes) of the same build. Allocates.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let pitches = self.maps.by_pitch.iter().zip(&self.feels).map(|(map, feel)| Some((*map)?).zip(*feel));
        for entry in pitches.chain([self.maps.otherwise.map(|map| (map, self.reference))]) {
            let Some((map, feel)) = entry else {
                bytes.push(0);
                continue;
            };
            let frame = encode(&Message::Feel(feel), 0);
            bytes.push(frame.len() as u8);
            bytes.extend_from_slice(&frame);
            for (angle_deg, pressure_pa) in map.landmarks() {
                bytes.extend(angle_deg.to_le_bytes().into_iter().chain(pressure_pa.to_le_bytes()));
            }
        }
        bytes
    }

    /// What [`to_bytes`](Self::to_bytes) has made; `None` for anything else. Allocates.
    pub fn from_bytes(mut bytes: &[u8]) -> Option<Self> {
        let mut entry = || {
            let (&length, rest) = bytes.split_first()?;
            bytes = rest;
            if length == 0 {
                return Some(None);
            }
            let (frame, rest) = bytes.split_at_checked(usize::from(length))?;
            let Some(Ok((_, Message::Feel(feel)))) = Decoder::new().feed(frame).next() else { return None };
            let (numbers, rest) = rest.split_at_checked(48)?;
            bytes = rest;
            let mut numbers =
                numbers.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap_or_default()));
            let mut pair = || Some((numbers.next()?, numbers.next()?));
            Some(Some((AngleMap::new([pair()?, pair()?, pair()?]), feel)))
        };
        let mut played = Self { feels: vec![None; PITCHES], ..Self::default() };
        for (map, feel) in played.maps.by_pitch.iter_mut().zip(&mut played.feels) {
            (*map, *feel) = entry()?.unzip();
        }
        let (map, reference) = entry()??;
        (played.maps.otherwise, played.reference) = (Some(map), reference);
        bytes.is_empty().then_some(played)
    }
}

/// For each sounding pitch, the map from knob angle to mouth pressure. Plain numbers, which threads may copy.
#[derive(Clone, Copy, Debug)]
pub struct PitchMaps {
    by_pitch: [Option<AngleMap>; PITCHES],
    otherwise: Option<AngleMap>,
}

impl Default for PitchMaps {
    /// No pitch has a map; every angle gives 0 Pa.
    fn default() -> Self {
        Self { by_pitch: [None; PITCHES], otherwise: None }
    }
}

impl PitchMaps {
    /// Mouth pressure, Pa, with a note fingered (none: as on the reference note) and the knob turned so far from rest.
    /// Real-time safe.
    pub fn pressure_pa(&self, note: Option<SoundingNote>, angle_deg: f64) -> f64 {
        self.map(note).map_or(0.0, |map| map.pressure_pa(angle_deg))
    }

    /// Angle from rest, degrees, at which a fingered note (none: the reference note) is blown with `pressure_pa`. Real-time
    /// safe.
    pub fn angle_deg(&self, note: Option<SoundingNote>, pressure_pa: f64) -> f64 {
        self.map(note).map_or(0.0, |map| map.angle_deg(pressure_pa))
    }

    fn map(&self, note: Option<SoundingNote>) -> Option<AngleMap> {
        let own = note.and_then(|note| self.by_pitch.get(usize::from(note.0)).copied().flatten());
        own.or(self.otherwise)
    }

    /// Whether any map is there.
    pub fn is_ready(&self) -> bool {
        self.otherwise.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::haptics::TorqueLimits;

    #[test]
    fn a_weakened_feel_is_the_strongest_that_the_ceiling_allows() {
        let feels = InstrumentFeel::built_in().unwrap();
        let (settings, design) = (Settings::default(), FeelDesign::default());
        let under = |ceiling_mnm: f64| {
            feels.strongest(&settings, &design, &TorqueLimits { ceiling_mnm, ..TorqueLimits::default() })
        };
        assert_eq!(under(100.0).unwrap().1, design);
        let (_, weak) = under(40.0).unwrap();
        assert!(weak.strength_mnm < design.strength_mnm, "{weak:?}");
        let more = FeelDesign { strength_mnm: weak.strength_mnm + 2.0, ..weak };
        let limits = TorqueLimits { ceiling_mnm: 40.0, ..TorqueLimits::default() };
        assert!(matches!(feels.table(&settings, &more, &limits), Err(FeelRefused::Ceiling { .. })));
        assert!(matches!(under(10.0), Err(FeelRefused::Ceiling { .. })), "mark and friction alone");
    }

    #[test]
    fn bytes_give_the_same_feel_and_nothing_else_does() {
        let feels = InstrumentFeel::built_in().unwrap();
        let settings = Settings::default();
        let table = feels.table(&settings, &FeelDesign::default(), &TorqueLimits::default()).unwrap();
        let played = feels.played(&table, &settings);
        let bytes = played.to_bytes();
        let again = PlayedFeel::from_bytes(&bytes).unwrap();
        for note in (0..=255).map(|pitch| Some(SoundingNote(pitch))).chain([None]) {
            assert_eq!(again.feel(note), played.feel(note), "{note:?}");
            for angle_deg in [-5.0, 40.0, 130.0, 300.0, 900.0] {
                let both = [&again, &played].map(|feel| feel.maps.pressure_pa(note, angle_deg));
                assert_eq!(both[0], both[1], "{note:?} at {angle_deg}");
            }
        }
        assert_eq!(
            again.feel(Some(SoundingNote(60))).scale_mnm,
            table.note(feels.fingering(SoundingNote(60)).unwrap()).unwrap().feel.scale_mnm
        );
        for cut in (0..bytes.len()).step_by(37) {
            assert!(PlayedFeel::from_bytes(&bytes[..cut]).is_none(), "{cut} bytes");
        }
        assert!(PlayedFeel::from_bytes(&[&bytes[..], &[0]].concat()).is_none());
    }
}
