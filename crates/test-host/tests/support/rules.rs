//! What the tests of a CLAP's rules share: a plugin, random values, and the parameters that a host may move.

use chalumeau_test_host::clap::{Param, ParamInfoFlags, Plugin};

pub fn plugin() -> Plugin {
    Plugin::load(&chalumeau_test_host::artefacts::clap().unwrap()).unwrap()
}

/// Switches that act when they are switched on, and are Off again.
#[allow(dead_code, reason = "each user takes what it needs")]
pub const MOMENTS: [&str; 7] = [
    "Panic",
    "Take over knob",
    "Rest here",
    "Blow hard here",
    "Arm knob",
    "Record take",
    "Calibrate microphone",
];

/// All parameters but those that only say something.
#[allow(dead_code, reason = "each user takes what it needs")]
pub fn movable(plugin: &mut Plugin) -> Vec<Param> {
    let all = plugin.params().unwrap();
    all.into_iter().filter(|param| !param.flags.contains(ParamInfoFlags::IS_READONLY)).collect()
}

/// A value that a host could set: whole for a stepped parameter.
#[allow(dead_code, reason = "each user takes what it needs")]
pub fn random_value(random: &mut fastrand::Rng, param: &Param) -> f64 {
    let value = param.min + random.f64() * (param.max - param.min);
    if param.flags.contains(ParamInfoFlags::IS_STEPPED) { value.round() } else { value }
}
