//! A knob's feel as flags of the command line, as takes and tables keep it.

use chalumeau_core::haptics::{FeelDesign, NoteOrder};
use chalumeau_core::units::{WrittenNote, midi_of_name};
use chalumeau_knob::wire::message::TorqueLaw;

/// Laws as flags and figures name them.
const LAWS: [(TorqueLaw, &str); 3] =
    [(TorqueLaw::Flow, "flow"), (TorqueLaw::Pressure, "pressure"), (TorqueLaw::Free, "free")];
/// Orders as flags name them.
const ORDERS: [(NoteOrder, &str); 3] = [
    (NoteOrder::Physical, "physical"),
    (NoteOrder::CoveredHoles, "covered-holes"),
    (NoteOrder::CoveredHolesReversed, "covered-holes-reversed"),
];

fn name_in<T: PartialEq>(all: &[(T, &'static str)], one: &T) -> &'static str {
    all.iter().find(|(each, _)| each == one).map_or("", |(_, name)| name)
}

fn named_in<T: Copy>(all: &[(T, &str)], name: &str) -> Option<T> {
    all.iter().find(|(_, each)| *each == name).map(|(one, _)| *one)
}

/// A law as flags and figures name it.
pub fn law_name(law: TorqueLaw) -> &'static str {
    name_in(&LAWS, &law)
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
        name_in(&ORDERS, &design.order),
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

/// Reads flags as [`in_flags`] writes them; those that are missing are at their defaults. The error says which one is wrong.
pub fn read(flags: &str) -> Result<FeelDesign, String> {
    let mut design = FeelDesign::default();
    let mut words = flags.split_whitespace();
    while let Some(flag) = words.next() {
        if flag == "--equal-travel" {
            design.equal_travel = true;
            continue;
        }
        let value = words.next().unwrap_or_default();
        let wrong = || format!("{flag} {value} is none of its flags");
        let number = || value.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
        match flag {
            "--law" => design.law = named_in(&LAWS, value).ok_or_else(wrong)?,
            "--order" => design.order = named_in(&ORDERS, value).ok_or_else(wrong)?,
            "--contrast" => design.contrast = number()?,
            "--place" => design.place = number()?,
            "--torque" => design.strength_mnm = number()?,
            "--travel" => design.travel_deg = number()?,
            "--detent" => design.detent_mnm = Some(number()?),
            "--reference" => {
                let midi = value.parse().ok().or_else(|| midi_of_name(value));
                design.reference = Some(WrittenNote(midi.ok_or_else(wrong)?));
            }
            _ => return Err(wrong()),
        }
    }
    Ok(design)
}

/// Whether two feels turn angles into the same pressures: what changes the torque alone does not matter.
pub fn map_alike(a: &FeelDesign, b: &FeelDesign) -> bool {
    let of_the_map = |design: &FeelDesign| {
        (design.law, design.place, design.equal_travel, design.order, design.reference, design.travel_deg)
    };
    of_the_map(a) == of_the_map(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_moves_a_pressure_makes_another_map() {
        let usual = FeelDesign::default();
        for alike in [
            usual,
            FeelDesign { contrast: 5.0, ..usual },
            FeelDesign { strength_mnm: 20.0, detent_mnm: Some(0.0), ..usual },
            read("--law flow --place 1.0").unwrap(),
        ] {
            assert!(map_alike(&usual, &alike), "{alike:?}");
        }
        for other in [
            FeelDesign { law: TorqueLaw::Pressure, ..usual },
            FeelDesign { place: 2.0, ..usual },
            FeelDesign { travel_deg: 300.0, ..usual },
            FeelDesign { equal_travel: true, ..usual },
        ] {
            assert!(!map_alike(&usual, &other), "{other:?}");
        }
    }

    #[test]
    fn a_feel_as_flags_is_that_feel() {
        let usual = "--law flow --contrast 3 --place 1 --order physical --torque 55 --travel 360 --detent 9";
        assert_eq!(in_flags(&FeelDesign::default()), usual);
        for flags in [
            usual,
            "--law pressure --contrast 2.3 --place 5 --order covered-holes --torque 260 --travel 120 --detent 0 --reference A#4",
            "--law flow --contrast 1 --place 1 --order covered-holes-reversed --torque 0 --travel 360.5 --detent 9 --equal-travel",
        ] {
            assert_eq!(in_flags(&read(flags).unwrap()), flags);
        }
        for wrong in ["--loudness 3", "--place far", "out.wav", "--law"] {
            let said = read(wrong).unwrap_err();
            assert!(said.starts_with(wrong), "{said}");
        }
    }

    #[test]
    fn the_law_without_torque_is_a_spring_without_strength() {
        let free = FeelDesign { law: TorqueLaw::Free, contrast: f64::from(2.3_f32), ..FeelDesign::default() };
        let flags =
            "--law pressure --contrast 2.3 --place 1 --order physical --torque 0 --travel 360 --detent 0";
        assert_eq!(in_flags(&free), flags);
    }
}
