//! A knob's feel as flags of the command line, as takes and tables keep it.

use chalumeau_core::haptics::{FeelDesign, NoteOrder};
use chalumeau_knob::wire::message::TorqueLaw;

/// What stands in a take before the flags of the feel it was recorded with.
const FEEL: &str = "feel ";

/// These flags change the torque alone.
const OF_THE_TORQUE: [&str; 3] = ["contrast ", "torque ", "detent "];

/// A law as flags and figures name it.
pub fn law_name(law: TorqueLaw) -> &'static str {
    match law {
        TorqueLaw::Flow => "flow",
        TorqueLaw::Pressure => "pressure",
        TorqueLaw::Free => "free",
    }
}

/// An order as flags name it.
fn order_name(order: NoteOrder) -> &'static str {
    match order {
        NoteOrder::Physical => "physical",
        NoteOrder::CoveredHoles => "covered-holes",
        NoteOrder::CoveredHolesReversed => "covered-holes-reversed",
    }
}

/// This feel as flags.
pub fn in_flags(design: &FeelDesign) -> String {
    // The law `free` is no flag: it has no torque, and turns angles into pressures as `pressure` does.
    let (law, torque_mnm) = match design.law {
        TorqueLaw::Free => (TorqueLaw::Pressure, 0.0),
        law => (law, design.strength_mnm),
    };
    // Parameters of the plugin have 32 bits: as 64, 2.3 would be 2.299999952316284.
    let number = |value: f64| value as f32;
    let mut flags = format!(
        "--law {} --contrast {} --place {} --order {} --torque {} --travel {} --detent {}",
        law_name(law),
        number(design.contrast),
        number(design.place),
        order_name(design.order),
        number(torque_mnm),
        number(design.travel_deg),
        number(design.mark_mnm()),
    );
    if let Some(reference) = design.reference {
        flags += &format!(" --reference {reference}");
    }
    if design.equal_travel {
        flags += " --equal-travel";
    }
    flags
}

/// A remark for a take: the feel it is recorded with.
pub fn remark(design: &FeelDesign) -> String {
    format!("{FEEL}{}", in_flags(design))
}

/// The flags in a line of a take, if it is that [`remark`].
pub fn in_remark(line: &str) -> Option<&str> {
    line.strip_prefix('#')?.trim_start().strip_prefix(FEEL)
}

/// Whether these flags turn angles into pressures as this feel does.
pub fn map_alike(flags: &str, design: &FeelDesign) -> bool {
    let is_of_torque = |flag: &str| OF_THE_TORQUE.iter().any(|name| flag.starts_with(name));
    let of_the_map = |flags: &str| -> Vec<String> {
        let flags = flags.split("--").map(str::trim).filter(|flag| !is_of_torque(flag));
        flags.map(str::to_owned).collect()
    };
    of_the_map(flags) == of_the_map(&in_flags(design))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_moves_a_pressure_makes_another_map() {
        let usual = FeelDesign::default();
        let remark = format!("# {}", remark(&usual));
        let flags = in_remark(&remark).unwrap();
        for alike in [
            usual,
            FeelDesign { contrast: 5.0, ..usual },
            FeelDesign { strength_mnm: 20.0, detent_mnm: Some(0.0), ..usual },
        ] {
            assert!(map_alike(flags, &alike), "{alike:?}");
        }
        for other in [
            FeelDesign { law: TorqueLaw::Pressure, ..usual },
            FeelDesign { place: 2.0, ..usual },
            FeelDesign { travel_deg: 300.0, ..usual },
            FeelDesign { equal_travel: true, ..usual },
        ] {
            assert!(!map_alike(flags, &other), "{other:?}");
        }
        assert_eq!(in_remark("# C4 (written 60) of B flat clarinet"), None);
    }

    #[test]
    fn the_law_without_torque_is_a_spring_without_strength() {
        let free = FeelDesign { law: TorqueLaw::Free, contrast: f64::from(2.3_f32), ..FeelDesign::default() };
        let flags =
            "--law pressure --contrast 2.3 --place 1 --order physical --torque 0 --travel 360 --detent 0";
        assert_eq!(in_flags(&free), flags);
    }
}
