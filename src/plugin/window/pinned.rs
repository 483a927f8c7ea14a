//! The parameters that the editor's tests play are the plugin's: id, name, steps, default and texts.

use nice_plug::prelude::Params;

use crate::plugin::params::ChalumeauParams;

const PLAYED: &str = include_str!("../../../tests/support/parameters.tsv");
/// Parameters with more steps are numbers there: their ends are told.
const MOST_TOLD: usize = 8;

#[test]
#[allow(unsafe_code)] // the framework's pointers to parameters
fn the_editors_tests_play_these_parameters() {
    let params = ChalumeauParams::default();
    let of: Vec<(String, f32)> = params
        .param_map()
        .into_iter()
        .map(|(id, param, _)| {
            // SAFETY: `params` keeps what the pointer points to.
            let (name, steps, default) =
                unsafe { (param.name(), param.step_count(), param.default_normalized_value()) };
            // SAFETY: as above.
            let text = |value: f32| unsafe { param.normalized_value_to_string(value, true) };
            let texts = match steps {
                Some(steps) if steps <= MOST_TOLD => {
                    let each = (0..=steps).map(|step| text(step as f32 / steps as f32));
                    each.collect::<Vec<_>>().join("|")
                }
                _ => format!("{}..{}", text(0.0), text(1.0)),
            };
            let steps = steps.map_or_else(String::new, |steps| steps.to_string());
            (format!("{id}\t{name}\t{steps}\t{texts}"), default)
        })
        .collect();
    let played: Vec<(String, f32)> = PLAYED
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let words: Vec<&str> = line.split('\t').collect();
            (format!("{}\t{}\t{}\t{}", words[0], words[1], words[2], words[4]), words[3].parse().unwrap())
        })
        .collect();
    // The file's defaults are as exact as their texts.
    let is_same = |(a, b): &(&(String, f32), &(String, f32))| a.0 == b.0 && (a.1 - b.1).abs() < 1e-4;
    let wrong: Vec<_> = of.iter().zip(&played).filter(|pair| !is_same(pair)).collect();
    assert!(wrong.is_empty(), "plugin, played: {wrong:#?}");
    assert_eq!(of.len(), played.len());
}
