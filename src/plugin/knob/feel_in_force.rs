//! The feel that the knob has now, and what its angles and the breath that they make mean to a musician's reed.

use std::sync::Arc;

use chalumeau_core::haptics::{FeelDesign, FeelTable};
use chalumeau_core::instrument::Settings;
use chalumeau_core::units::{SoundingNote, WrittenNote};
use chalumeau_knob::touch::feel::{InstrumentFeel, PitchMaps};
use chalumeau_knob::wire::message::Feel;

/// The feel of each note under the present settings, design and limits.
#[derive(Debug)]
pub struct FeelInForce {
    feels: Arc<InstrumentFeel>,
    design: FeelDesign,
    table: FeelTable,
    /// Angle to breath, as it blows, and to the pressure that is felt there.
    blown: PitchMaps,
    felt: PitchMaps,
    full_pa: f64,
    closing_pa: f64,
}

impl FeelInForce {
    /// Of a table that was worked out for `settings` and `design`. Allocates.
    pub fn new(
        feels: Arc<InstrumentFeel>,
        design: FeelDesign,
        table: FeelTable,
        settings: &Settings,
    ) -> Self {
        Self {
            design,
            blown: feels.maps_for(&table, settings),
            felt: feels.maps(&table),
            full_pa: 1e3 * f64::from(settings.breath_full_kpa),
            closing_pa: settings.closing_pa(),
            feels,
            table,
        }
    }

    /// The design that it follows.
    pub fn design(&self) -> &FeelDesign {
        &self.design
    }

    /// What the knob's angles blow.
    pub fn maps(&self) -> PitchMaps {
        self.blown
    }

    /// The feel of a fingered note; without one that of the reference note.
    pub fn feel(&self, note: Option<SoundingNote>) -> Feel {
        let index = note.and_then(|note| self.feels.fingering(note));
        index.and_then(|index| self.table.note(index)).unwrap_or(self.table.reference()).feel
    }

    /// Gamma at which a note begins to sound.
    pub fn sounds_from(&self, written: WrittenNote) -> Option<f64> {
        let note = self.table.notes().iter().find(|note| note.written == written)?;
        note.requirement.map(|required| required.gamma_sounding)
    }

    /// The mouth pressure over the closing pressure that is felt where the knob blows `breath`, a share of full breath. Where the
    /// breath is played, a share is no pressure: the note begins at its threshold all the same.
    pub fn gamma(&self, note: Option<SoundingNote>, breath: f32) -> f64 {
        let angle_deg = self.blown.angle_deg(note, f64::from(breath) * self.full_pa);
        self.felt.pressure_pa(note, angle_deg) / self.closing_pa
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::instrument::BreathResponse;
    use chalumeau_core::instrument::player::response::ONSET;
    use chalumeau_knob::touch::feel::NO_MOTOR;

    #[test]
    fn a_logged_gamma_is_a_pressure_whatever_breath_sets() {
        let feels = InstrumentFeel::built_in().unwrap();
        let played = Settings::default();
        assert_eq!(played.breath_response, BreathResponse::Played);
        let physical = Settings { breath_response: BreathResponse::Physical, ..played };
        for (settings, begins) in [(played, Some(ONSET as f32)), (physical, None)] {
            let design = FeelDesign::default();
            let table = feels.table(&settings, &design, &NO_MOTOR).unwrap();
            let force = FeelInForce::new(feels.clone(), design, table, &settings);
            for note in [50, 60, 70, 80].map(SoundingNote) {
                let sounds = force.sounds_from(note.written(2).unwrap()).unwrap();
                let full_gamma = f64::from(settings.breath_full_kpa) * 1e3 / settings.closing_pa();
                let breath = begins.unwrap_or((sounds / full_gamma) as f32);
                let gamma = force.gamma(Some(note), breath);
                assert!((gamma - sounds).abs() < 1e-5, "{note:?}: {gamma}, begins at {sounds}");
                assert!((force.gamma(Some(note), 1.0) - full_gamma).abs() < 1e-5, "{note:?}");
                assert_eq!(force.gamma(Some(note), 0.0), 0.0);
            }
        }
    }
}
