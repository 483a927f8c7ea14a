//! The settings as a list of numbers.
//!
//! First the numbers of [`Settings`], in the order of [`NUMBERS`] and in their own units, then switches as 0 or 1, choices by
//! their place, and whole numbers. The list lives as long as one build of the page: its order may change with every version.

use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::event::SettingNumber as N;
use chalumeau_core::instrument::{
    Attack, Beyond, BreathResponse, GrowlPitch, ListeningMode, Settings, Split, Tuning,
};

/// The numbers, in the order of the list.
pub const NUMBERS: [N; 52] = [
    N::BreathFullKpa,
    N::TongueMs,
    N::LegatoMs,
    N::BreathCurve,
    N::BreathSoftest,
    N::BreathLoudest,
    N::BreathDeadband,
    N::Strength,
    N::Lip,
    N::Zeta,
    N::Damping,
    N::ReedH,
    N::ReedK,
    N::ReedA,
    N::Lay,
    N::A4Hz,
    N::TemperatureC,
    N::VentLoss,
    N::Noise,
    N::GainDb,
    N::ListeningDistanceM,
    N::ListeningAngleDeg,
    N::ListeningHeightM,
    N::ListeningWidthDeg,
    N::RoomAmount,
    N::RoomSizeM,
    N::RoomDecayS,
    N::RoomTone,
    N::Life,
    N::VibratoDepth,
    N::VibratoRateHz,
    N::VibratoOnsetS,
    N::VibratoUnevenness,
    N::GlissandoS,
    N::ScoopCents,
    N::ScoopS,
    N::FallCents,
    N::FallS,
    N::BreathIn,
    N::KeySounds,
    N::Slap,
    N::Growl,
    N::GrowlSemitones,
    N::GrowlHz,
    N::Flutter,
    N::FlutterHz,
    N::Subtone,
    N::TractAmount,
    N::TractIntervalSemitones,
    N::PlayersSpreadCents,
    N::PlayersOnsetSpreadMs,
    N::PlayersWidth,
];
/// Switches, choices and whole numbers.
const OTHERS: usize = 12;
/// Place of the breath response: 0 as played, 1 physical.
pub const BREATH_RESPONSE: usize = NUMBERS.len();
/// Length of the list.
pub const COUNT: usize = NUMBERS.len() + OTHERS;

/// The list of these settings.
pub fn list(settings: &Settings) -> [f32; COUNT] {
    let mut copy = *settings;
    let others: [f32; OTHERS] = [
        f32::from(settings.breath_response as u8),
        f32::from(settings.attack as u8),
        f32::from(u8::from(settings.coupled)),
        f32::from(settings.tuning as u8),
        f32::from(settings.listening.mode as u8),
        settings.reach.transpose as f32,
        f32::from(settings.reach.beyond as u8),
        f32::from(settings.techniques.growl_pitch as u8),
        settings.players.count as f32,
        f32::from(settings.players.split as u8),
        f32::from(u8::from(settings.alternates)),
        f32::from(settings.reach.key_switches as u8),
    ];
    std::array::from_fn(|at| match NUMBERS.get(at) {
        Some(&number) => *copy.number(number),
        None => others[at - NUMBERS.len()],
    })
}

/// The choice whose place is `value`; the first for a place that is not there.
fn nth<T: Copy, const COUNT: usize>(all: [T; COUNT], value: f32) -> T {
    // A number that is not one, or below 0, becomes 0.
    let at = value as usize;
    all[if at < COUNT { at } else { 0 }]
}

/// Puts a value into its place of the list; a place that is not there takes none. [`Settings`] clamp it where they are used.
/// Real-time safe.
pub fn set(settings: &mut Settings, at: usize, value: f32) {
    if let Some(&number) = NUMBERS.get(at) {
        *settings.number(number) = value;
        return;
    }
    match at - NUMBERS.len() {
        0 => settings.breath_response = nth(BreathResponse::ALL, value),
        1 => settings.attack = nth(Attack::ALL, value),
        2 => settings.coupled = value > 0.5,
        3 => settings.tuning = nth(Tuning::ALL, value),
        4 => settings.listening.mode = nth(ListeningMode::ALL, value),
        5 => settings.reach.transpose = value as i32,
        6 => settings.reach.beyond = nth(Beyond::ALL, value),
        7 => settings.techniques.growl_pitch = nth(GrowlPitch::ALL, value),
        8 => settings.players.count = value as i32,
        9 => settings.players.split = nth(Split::ALL, value),
        10 => settings.alternates = value > 0.5,
        11 => settings.reach.key_switches = nth(KeySwitches::ALL, value),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use chalumeau_core::instrument::{Listening, Players, Reach};

    use super::*;

    fn settings(values: &[f32]) -> Settings {
        let mut settings = Settings::default();
        values.iter().enumerate().for_each(|(at, &value)| set(&mut settings, at, value));
        settings
    }

    #[test]
    fn every_setting_has_a_place_of_its_own() {
        // Each place alone moves the settings, and the list tells the same place.
        let default = list(&Settings::default());
        for at in 0..COUNT {
            let mut values = default;
            values[at] = if values[at] == 1.0 { 0.0 } else { 1.0 };
            let changed = settings(&values);
            assert_ne!(changed, Settings::default(), "{at}");
            assert_eq!(list(&changed), values, "{at}");
        }
        // Nothing of the settings is without a place: those of a machine come back whole, and so does each choice.
        for wanted in [Settings::physical(), Settings::default()] {
            assert_eq!(settings(&list(&wanted)), wanted);
        }
        let default = Settings::default();
        let wanted = Settings {
            attack: Attack::Hard,
            listening: Listening { mode: ListeningMode::Point, ..default.listening },
            players: Players { count: 7, ..default.players },
            reach: Reach { transpose: -12, ..default.reach },
            ..default
        };
        assert_eq!(settings(&list(&wanted)), wanted);
    }

    #[test]
    fn wrong_values_and_places_choose_nothing() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30] {
            for at in 0..COUNT + 3 {
                let mut settings = Settings::default();
                set(&mut settings, at, value);
                assert!(at < COUNT || settings == Settings::default(), "{at}: {value}");
                // A choice has as many places as before, and a number comes back as it went in, to be clamped in use.
                let back = list(&settings);
                assert!(at >= NUMBERS.len() || back[at].to_bits() == value.to_bits(), "{at}: {value}");
                let others = [0, 1, 3, 4, 7, 9, 11].map(|place| back[NUMBERS.len() + place]);
                assert!(
                    others.iter().all(|place| (0.0..KeySwitches::ALL.len() as f32).contains(place)),
                    "{at}: {value}"
                );
            }
        }
    }
}
