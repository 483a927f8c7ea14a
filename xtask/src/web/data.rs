//! What the page knows of instruments, presets and controls, as one JSON text.
//!
//! Geometry, fingerings and standing waves come from the core's instruments, presets and controls from the tables of the
//! plugin. The presets' settings are the module's list of values (`chalumeau_web::values`), as far as they differ from the
//! defaults.

use anyhow::{Context, Result};
use chalumeau::parameters::{self, Kind, Sets};
use chalumeau::presets::{Preset, factory};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::HoleKind;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::instrument::player::dynamics::MEZZO_FORTE;
use chalumeau_core::instrument::{Preparation, Settings, Wanted};
use chalumeau_core::units::Air;
use chalumeau_web::values;
use serde_json::{Value, json};

/// The parameters that have a control on the page.
const CONTROLS: [&str; 9] = ["lip", "stren", "tongue", "lay", "noise", "vib", "growl", "subt", "room"];
/// Presets with these tags are for devices that the page does not play.
const NOT_HERE: [&str; 2] = ["knob", "MPE"];
/// Places of a standing wave on its way from the reed to the bell.
const PLACES: usize = 64;

/// All of it.
pub fn text() -> Result<String> {
    let instruments = Bundled::ALL.into_iter().map(instrument).collect::<Result<Vec<_>>>()?;
    let presets: Vec<_> = factory::all()
        .iter()
        .filter(|preset| NOT_HERE.iter().all(|tag| !preset.has_tag(tag)))
        .map(preset)
        .collect();
    let controls = CONTROLS.into_iter().map(control).collect::<Result<Vec<_>>>()?;
    let all = json!({
        "mezzoForte": MEZZO_FORTE,
        "defaults": values::list(&Settings::default()).to_vec(),
        "instruments": instruments,
        "presets": presets,
        "controls": controls,
    });
    Ok(all.to_string())
}

/// To a tenth of a millimetre.
fn metres(length_m: f64) -> f64 {
    (length_m * 1e4).round() / 1e4
}

fn instrument(of: Bundled) -> Result<Value> {
    let file = of.file();
    let model = Preparation::new(&Wanted::new(file.clone(), 48_000.0), None).ready()?;
    let model = model.with_context(|| format!("{} is not prepared", of.id()))?;
    let bore = TransferMatrix::new(&file, Air::default());
    let bores: Vec<_> = file
        .bore
        .iter()
        .map(|s| json!([s.part, metres(s.x_start_m), metres(s.x_end_m), s.r_start_m, s.r_end_m]))
        .collect();
    let holes: Vec<_> = file
        .holes
        .iter()
        .map(|hole| {
            let kind = match hole.kind {
                HoleKind::Finger => "finger",
                HoleKind::PadOpen => "pad",
                HoleKind::KeyClosed => "key",
            };
            json!({
                "name": hole.name, "kind": kind, "x": metres(hole.x_m), "r": hole.radius_m, "chimney": hole.chimney_m,
            })
        })
        .collect();
    let fingerings: Vec<_> = file
        .fingerings
        .iter()
        .enumerate()
        .map(|(at, fingering)| {
            let wave = bore.standing_pressure(model.notes_hz[at], &fingering.open);
            let open: String =
                fingering.open.iter().map(|&is_open| if is_open { '1' } else { '0' }).collect();
            json!({
                "written": fingering.written.0,
                "speaks": model.speaks(at),
                "open": open,
                "wave": resampled(&wave, file.length_m()),
            })
        })
        .collect();
    Ok(json!({
        "id": of.id(),
        "name": file.name.split(',').next(),
        "transposition": file.transposition,
        "length": file.length_m(),
        "radius": file.nominal_radius_m,
        "bore": bores,
        "holes": holes,
        "fingerings": fingerings,
    }))
}

/// A wave at equal steps along the bore, as two hexadecimal digits each; ff is its largest value.
fn resampled(wave: &[(f64, f64)], length_m: f64) -> String {
    let most = wave.iter().map(|&(_, magnitude)| magnitude).fold(1e-9, f64::max);
    let at = |x_m: f64| {
        let above = wave.partition_point(|&(place_m, _)| place_m < x_m).clamp(1, wave.len() - 1);
        let ((x0, p0), (x1, p1)) = (wave[above - 1], wave[above]);
        let share = if x1 > x0 { ((x_m - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 0.0 };
        p0 + share * (p1 - p0)
    };
    (0..PLACES)
        .map(|place| length_m * place as f64 / (PLACES - 1) as f64)
        .map(|x_m| format!("{:02x}", (255.0 * at(x_m) / most).round() as u8))
        .collect()
}

fn preset(preset: &Preset) -> Value {
    let (own, default) = (values::list(&preset.settings()), values::list(&Settings::default()));
    let changes: serde_json::Map<_, _> = (0..values::COUNT)
        .filter(|&at| own[at] != default[at])
        .map(|at| (at.to_string(), json!(own[at])))
        .collect();
    let place = |found: Option<usize>| found.unwrap_or_default();
    json!({
        "name": preset.name,
        "tags": preset.tags,
        "shows": preset.shows,
        "instrument": place(Bundled::ALL.iter().position(|of| Some(*of) == preset.bundled())),
        "wheel": place(Wheel::ALL.iter().position(|of| *of == preset.wheel())),
        "bend": preset.bend_range(),
        "breathFrom": place(BreathFrom::ALL.iter().position(|of| *of == preset.breath_from())),
        "values": changes,
    })
}

fn control(id: &str) -> Result<Value> {
    let parameter = parameters::find(id).with_context(|| format!("no parameter {id}"))?;
    let (Kind::Number(number), Some(Sets::Number(which))) = (parameter.kind, parameter.sets) else {
        anyhow::bail!("{id} is not a number of the instrument");
    };
    let place = values::NUMBERS.iter().position(|&other| other == which);
    Ok(json!({
        "id": id,
        "place": place.with_context(|| format!("{id} is not among the module's values"))?,
        "min": number.min,
        "max": number.max,
        "default": number.default,
        "digits": number.digits,
        "unit": number.unit,
        "scale": number.scale,
        "meaning": parameter.meaning,
        "sound": parameter.sound,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_gets_every_instrument_and_most_presets() {
        let all: Value = serde_json::from_str(&text().unwrap()).unwrap();
        let instruments = all["instruments"].as_array().unwrap();
        assert_eq!(instruments.len(), Bundled::ALL.len());
        for instrument in instruments {
            let fingerings = instrument["fingerings"].as_array().unwrap();
            assert!(fingerings.len() > 40 && instrument["holes"].as_array().unwrap().len() == 24);
            for fingering in fingerings {
                assert_eq!(fingering["wave"].as_str().unwrap().len(), 2 * PLACES);
                assert_eq!(fingering["open"].as_str().unwrap().len(), 24);
            }
        }
        let presets = all["presets"].as_array().unwrap();
        assert!(presets.len() > 60 && presets.len() < factory::all().len(), "{}", presets.len());
        assert_eq!(presets[0]["values"], json!({}), "the first is the default");
        assert_eq!(all["controls"].as_array().unwrap().len(), CONTROLS.len());
    }

    #[test]
    fn a_wave_keeps_its_shape() {
        assert_eq!(&resampled(&[(0.0, 1.0), (1.0, 0.0)], 1.0)[..4], "fffb");
        assert!(resampled(&[(0.0, 2.0), (0.5, 2.0), (0.5, 1.0), (1.0, 1.0)], 1.0).ends_with("8080"));
    }
}
