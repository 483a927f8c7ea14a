//! The editor's tests play parameters from a table. This test checks the table against the plugin: id, name, steps,
//! default and texts.

use nice_plug::prelude::Params;

use crate::plugin::params::ChalumeauParams;

const TABLE: &str = include_str!("../../../tests/support/parameters.tsv");
/// For parameters with more steps, the table has only the texts of both ends.
const STEPS_MOST: usize = 8;

#[test]
#[allow(unsafe_code)] // the framework's pointers to parameters
fn the_editors_tests_play_the_parameters_of_the_plugin() {
    let params = ChalumeauParams::default();
    let actual: Vec<(String, f32)> = params
        .param_map()
        .into_iter()
        .map(|(id, param, _)| {
            // SAFETY: `params` keeps the parameter alive.
            let (name, steps, default) =
                unsafe { (param.name(), param.step_count(), param.default_normalized_value()) };
            // SAFETY: as above.
            let text = |value: f32| unsafe { param.normalized_value_to_string(value, true) };
            let texts = match steps {
                Some(steps) if steps <= STEPS_MOST => {
                    let each = (0..=steps).map(|step| text(step as f32 / steps as f32));
                    each.collect::<Vec<_>>().join("|")
                }
                _ => format!("{}..{}", text(0.0), text(1.0)),
            };
            let steps = steps.map_or_else(String::new, |steps| steps.to_string());
            (format!("{id}\t{name}\t{steps}\t{texts}"), default)
        })
        .collect();
    let listed: Vec<(String, f32)> = TABLE
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let words: Vec<&str> = line.split('\t').collect();
            (format!("{}\t{}\t{}\t{}", words[0], words[1], words[2], words[4]), words[3].parse().unwrap())
        })
        .collect();
    // The table's defaults are rounded.
    let is_same = |(a, b): &(&(String, f32), &(String, f32))| a.0 == b.0 && (a.1 - b.1).abs() < 1e-4;
    let wrong: Vec<_> = actual.iter().zip(&listed).filter(|pair| !is_same(pair)).collect();
    assert!(wrong.is_empty(), "plugin, table: {wrong:#?}");
    assert_eq!(actual.len(), listed.len());
}
