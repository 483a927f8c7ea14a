//! Settings that can have no effect, because what they belong to is off.

use crate::cli::settings::SettingsArgs;
use crate::cli::{Failure, score_args::BreathSource};
use chalumeau_core::instrument::listening::ListeningMode;
use chalumeau_core::instrument::techniques::GrowlPitch;
use chalumeau_core::instrument::{BreathResponse, Settings, Split};

/// A setting that was given and has no effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Idle {
    /// As it was typed.
    pub typed: String,
    /// Why it has none, and what would be right.
    pub why: &'static str,
}

/// What must be on for some parameters to have an effect.
struct Need {
    /// Ids of the parameters.
    ids: &'static [&'static str],
    is_met: fn(&Settings, BreathSource) -> bool,
    /// Whether a controller of a MIDI file may switch it on.
    may_be_played: bool,
    why: &'static str,
}

const NEEDS: [Need; 14] = [
    Need {
        ids: &["bcurve", "bsoft", "bloud"],
        is_met: |settings, _| settings.breath_response == BreathResponse::Played,
        may_be_played: false,
        why: "is for a breath that is played, and here it is a pressure; blow with --dynamic, or add --breath-response played",
    },
    Need {
        ids: &["full"],
        is_met: |settings, source| {
            settings.breath_response == BreathResponse::Physical || source == BreathSource::Take
        },
        may_be_played: false,
        why: "is for a breath that is a pressure, and here it is played; blow with --gamma, or add --breath-response physical",
    },
    Need {
        ids: &["vibhz", "vibon", "vibun"],
        is_met: |settings, _| settings.vibrato.depth > 0.0,
        may_be_played: true,
        why: "is for a vibrato, and there is none; add --vibrato",
    },
    Need {
        ids: &["growlp", "growli", "growlf"],
        is_met: |settings, _| settings.techniques.growl > 0.0,
        may_be_played: true,
        why: "is for a growl, and there is none; add --growl",
    },
    Need {
        ids: &["growlf"],
        is_met: |settings, _| settings.techniques.growl_pitch == GrowlPitch::Fixed,
        may_be_played: false,
        why: "is for a growl at a pitch of its own, and this one follows the note; add --set growlp=fixed",
    },
    Need {
        ids: &["growli"],
        is_met: |settings, _| settings.techniques.growl_pitch == GrowlPitch::Interval,
        may_be_played: false,
        why: "is for a growl that follows the note, and this one has a pitch of its own; leave --set growlp=fixed out",
    },
    Need {
        ids: &["fluthz"],
        is_met: |settings, _| settings.techniques.flutter > 0.0,
        may_be_played: true,
        why: "is for a flutter, and there is none; add --flutter",
    },
    Need {
        ids: &["tractp"],
        is_met: |settings, _| settings.tract.amount > 0.0,
        may_be_played: true,
        why: "is for a tuned vocal tract, and there is none; add --tract",
    },
    Need {
        ids: &["scoops"],
        is_met: |settings, _| settings.articulation.scoop_cents > 0.0,
        may_be_played: false,
        why: "is for a scoop, and there is none; add --scoop",
    },
    Need {
        ids: &["falls"],
        is_met: |settings, _| settings.articulation.fall_cents > 0.0,
        may_be_played: false,
        why: "is for a fall, and there is none; add --fall",
    },
    Need {
        ids: &["ldist", "langle", "lheigh", "lwidth"],
        is_met: |settings, _| settings.listening.mode == ListeningMode::Position,
        may_be_played: false,
        why: "is for a listener at a place, and there is none; add --set heard=position",
    },
    Need {
        ids: &["rsize", "rdecay", "rtone"],
        is_met: |settings, _| settings.room.amount > 0.0,
        may_be_played: false,
        why: "is for a room, and there is none; add --room",
    },
    Need {
        ids: &["late"],
        is_met: |settings, _| settings.players.count > 1 && settings.players.split == Split::Unison,
        may_be_played: false,
        why: "is for several players in unison; add --unison",
    },
    Need {
        ids: &["spread", "seats"],
        is_met: |settings, _| settings.players.count > 1,
        may_be_played: false,
        why: "is for several players, and one plays; add --players",
    },
];

impl SettingsArgs {
    /// What was given and has no effect on a rendering with these settings. `has_controllers` says that a MIDI file is played.
    pub fn idle(
        &self,
        settings: &Settings,
        source: BreathSource,
        has_controllers: bool,
    ) -> Result<Vec<Idle>, Failure> {
        let given = self.typed()?;
        let need = |id: &str| NEEDS.iter().find(|need| need.ids.contains(&id));
        let idle = given.into_iter().filter_map(|(id, typed)| {
            let need = need(id)?;
            let is_met = (need.is_met)(settings, source) || (need.may_be_played && has_controllers);
            (!is_met).then_some(Idle { typed, why: need.why })
        });
        Ok(idle.collect())
    }
}

/// One sentence about all of them; `None` if there is none.
pub fn in_words(idle: &[Idle]) -> Option<String> {
    let each = idle.iter().map(|Idle { typed, why }| format!("{typed} has no effect: it {why}"));
    let words = each.collect::<Vec<_>>().join(". ");
    (!words.is_empty()).then_some(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters;

    #[test]
    fn every_need_is_of_parameters_and_is_not_met_by_default() {
        let ids = || NEEDS.iter().flat_map(|need| need.ids);
        assert!(ids().all(|id| parameters::find(id).is_some_and(|parameter| parameter.sets.is_some())));
        let (played, physical) = (Settings::default(), Settings::physical());
        // A growl follows the note unless it is told not to.
        for need in NEEDS.iter().filter(|need| need.ids != ["growli"]) {
            let is_met = |settings| (need.is_met)(settings, BreathSource::Other);
            assert!(!is_met(&played) || !is_met(&physical), "{:?}", need.ids);
        }
    }
}
