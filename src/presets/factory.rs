//! The presets that come with the program.
//!
//! Their order is that of MIDI program changes, 0 to 127, and stands in songs: presets are only ever added, at the end, and
//! never renamed.

use std::sync::LazyLock;

use super::Preset;

/// Reads the files of `presets/` into the program.
macro_rules! texts {
    ($($file:literal),* $(,)?) => {
        &[$(($file, include_str!(concat!("../../presets/", $file, ".toml")))),*]
    };
}

/// Names of the files, and their texts, in the order of programs.
const TEXTS: &[(&str, &str)] = texts![
    "b_flat_clarinet",
    "first_desk",
    "slow_movement_in_a",
    "e_flat_above_the_band",
    "clarinet_in_c",
    "bass_in_the_section",
    "legato_line",
    "solo_from_the_balcony",
    "tutti_fortissimo",
    "concerto_soloist",
    "subtone_ballad",
    "late_at_the_bar",
    "subtone_bass",
    "swing_section",
    "new_orleans_street",
    "cool_school",
    "bebop_lines",
    "big_band_lead",
    "klezmer_dance",
    "doina",
    "krekhts_on_e_flat",
    "wedding_march",
    "balkan_brass_partner",
    "anatolian_low_clarinet",
    "alpine_dance",
    "epirus_lament",
    "breton_square",
    "village_band",
    "mannheim_a_430",
    "boxwood_b_flat_a_430",
    "quintet_in_a_a_432",
    "salon_a_435",
    "harmonie_a_430",
    "bass_pulse",
    "bass_pedal",
    "bass_with_teeth",
    "bass_close_up",
    "mostly_air",
    "untamed_reed",
    "overblown",
    "glass_facing",
    "paper_reed",
    "wide_reed",
    "cold_church",
    "ear_at_the_keys",
    "behind_the_player",
    "as_wide_as_the_hands",
    "breath_controller",
    "wind_controller_wide",
    "wind_controller_light",
    "blowing_machine",
    "keys_even",
    "keys_bright_tongue",
    "keys_staccato",
    "keys_soft_pad",
    "mpe_slide_opens_the_reed",
    "mpe_slide_stiffens_the_reed",
    "mpe_pressure_opens_the_reed",
    "mpe_bass_slides",
    "knob_what_the_bore_needs",
    "knob_clear_thresholds",
    "knob_spring",
    "knob_light_hand",
    "growling_street",
    "growl_in_fifths",
    "flutter_cabaret",
    "rising_glissando",
    "section_of_six",
    "quartet_for_two_hands",
    "scoops_and_falls",
    "close_to_the_keys",
];

static PRESETS: LazyLock<Vec<Preset>> =
    LazyLock::new(|| TEXTS.iter().filter_map(|(_, text)| Preset::parse(text).ok()).collect());

/// All of them, in the order of MIDI programs. The first call reads them, which takes about a millisecond.
pub fn all() -> &'static [Preset] {
    &PRESETS
}

/// The one with this name.
pub fn find(name: &str) -> Option<&'static Preset> {
    all().iter().find(|preset| preset.name == name)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_file_is_a_preset_and_every_preset_has_a_program() {
        for (file, text) in TEXTS {
            let preset = Preset::parse(text).unwrap_or_else(|reason| panic!("presets/{file}.toml: {reason}"));
            assert_eq!(&preset.to_text(), text, "presets/{file}.toml is not as the program writes it");
            assert!(
                !preset.shows.is_empty() && !preset.tags.is_empty() && !preset.author.is_empty(),
                "{file}"
            );
            assert!(
                preset.shows.ends_with('.') && preset.shows.matches(". ").count() == 0,
                "{file}: one sentence"
            );
        }
        let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/presets")).unwrap();
        let files: BTreeSet<_> = folder
            .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(files, TEXTS.iter().map(|(file, _)| (*file).to_owned()).collect());
        assert!((48..=128).contains(&all().len()), "{}", all().len());
        assert_eq!(all().iter().map(|preset| &preset.name).collect::<BTreeSet<_>>().len(), TEXTS.len());
    }

    #[test]
    fn all_instruments_and_styles_are_there() {
        for tag in [
            "orchestral",
            "jazz",
            "subtone",
            "klezmer",
            "folk",
            "early",
            "bass",
            "effects",
            "breath",
            "keys",
            "MPE",
            "knob",
            "soft",
            "loud",
        ] {
            let count = all().iter().filter(|preset| preset.has_tag(tag)).count();
            assert!(count >= 3, "{tag}: {count}");
        }
        let instrument = crate::parameters::find("instr").unwrap();
        for index in 0..5 {
            let value = crate::parameters::Value::Choice(index);
            assert!(
                all().iter().any(|preset| preset.value(instrument) == value),
                "{}",
                instrument.text(value)
            );
        }
    }

    #[test]
    fn no_two_presets_set_the_same() {
        for (at, preset) in all().iter().enumerate() {
            let mut values: Vec<_> =
                preset.changes().iter().filter(|(parameter, _)| parameter.id != "gain").collect();
            for other in &all()[..at] {
                values.sort_by_key(|(parameter, _)| parameter.id);
                let mut others: Vec<_> =
                    other.changes().iter().filter(|(parameter, _)| parameter.id != "gain").collect();
                others.sort_by_key(|(parameter, _)| parameter.id);
                let same = values.len() == others.len()
                    && values.iter().zip(&others).all(|(a, b)| a.0.id == b.0.id && a.1 == b.1);
                assert!(!same, "{} and {}", preset.name, other.name);
            }
        }
    }
}
