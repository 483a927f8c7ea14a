//! What the page knows of instruments, presets and controls, as one JSON text.
//!
//! Geometry, fingerings and standing waves come from the core's instruments, presets and controls from the tables of the
//! plugin. The presets' settings are the module's list of values (`chalumeau_web::values`), as far as they differ from the
//! defaults.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use chalumeau::parameters::{self, Kind, Sets};
use chalumeau::presets::{Preset, factory};
use chalumeau::tour;
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::{HOLE_RADIUS_M, LEAST_HOLE_X_M};
use chalumeau_core::bore::moved_hole::LEAST_GAP_M;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::player::dynamics::NAMED;
use chalumeau_core::instrument::player::response::{VELOCITY_DYNAMIC, VELOCITY_GAMMA};
use chalumeau_core::instrument::{Preparation, Settings, Wanted};
use chalumeau_web::drawn::drawn;
use chalumeau_web::playing::{ORIGINS, PICTURE_NAMES};
use chalumeau_web::values;
use serde_json::{Value, json};

/// Rate at which the listening page plays, Hz.
const LISTEN_HZ: u32 = 48_000;
/// The parameters that have a control on the page.
const CONTROLS: [&str; 9] = ["lip", "stren", "tongue", "lay", "noise", "vib", "growl", "subt", "room"];
/// Presets with these tags are for devices that the page does not play.
const NOT_HERE: [&str; 2] = ["knob", "MPE"];

/// `web-data FOLDER`: writes data.json and tour.json.
pub fn write(args: &[String]) -> Result<()> {
    let [folder] = args else { bail!("takes a folder, got {args:?}") };
    for (name, text) in [("data.json", text()?), ("tour.json", tour()?)] {
        let path = Path::new(folder).join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

/// All of it.
fn text() -> Result<String> {
    let instruments = Bundled::ALL.into_iter().map(instrument).collect::<Result<Vec<_>>>()?;
    let presets: Vec<_> = factory::all()
        .iter()
        .filter(|preset| NOT_HERE.iter().all(|tag| !preset.has_tag(tag)))
        .map(preset)
        .collect();
    let controls = CONTROLS.into_iter().map(control).collect::<Result<Vec<_>>>()?;
    let all = json!({
        "dynamics": NAMED,
        // Of a key that is struck with 0 and with 1.
        "struck": { "dynamic": VELOCITY_DYNAMIC, "gamma": VELOCITY_GAMMA },
        "breathResponse": values::BREATH_RESPONSE,
        "defaults": values::list(&Settings::default()).to_vec(),
        "instruments": instruments,
        "presets": presets,
        "controls": controls,
        // What a hole may be, m; not wider than the bore at its place either.
        "holes": { "least_x": LEAST_HOLE_X_M, "gap": LEAST_GAP_M, "radius": [HOLE_RADIUS_M.0, HOLE_RADIUS_M.1] },
        "breathFromKeys": place(&BreathFrom::ALL, |from| *from == BreathFrom::Keys)?,
        "picture": PICTURE_NAMES,
        "origins": ORIGINS,
    });
    Ok(all.to_string())
}

fn place<T>(all: &[T], is_it: impl Fn(&T) -> bool) -> Result<usize> {
    all.iter().position(is_it).context("a list of the page lacks something")
}

/// The sounds of the listening page: the [tour](mod@tour), as the module's values and messages.
fn tour() -> Result<String> {
    let wanted = Wanted::new(Bundled::BFlat.file(), f64::from(LISTEN_HZ));
    let model = Preparation::new(&wanted, None).ready()?.context("the clarinet is not prepared")?;
    let chapters: Vec<_> = tour::chapters(&model, Settings::default(), LISTEN_HZ)
        .into_iter()
        .map(|(title, stops)| {
            let stops: Vec<_> = stops.iter().map(heard).collect::<Result<_>>()?;
            Ok(json!({ "title": title, "stops": stops }))
        })
        .collect::<Result<_>>()?;
    Ok(json!({ "rate": LISTEN_HZ, "chapters": chapters }).to_string())
}

fn heard(stop: &tour::Stop) -> Result<Value> {
    let events = stop.score.events.iter().map(|&Timed { at, event }| {
        Ok(match event {
            Event::Breath(unit) => json!([at, "breath", unit]),
            Event::NoteOn { note, velocity } => json!([at, 0x90, note.0, (127.0 * velocity).round()]),
            Event::NoteOff { note } => json!([at, 0x80, note.0, 0]),
            Event::Set(number, value) => {
                let place = values::NUMBERS.iter().position(|&other| other == number);
                json!([at, "set", place.context("a setting is not among the module's values")?, value])
            }
            other => anyhow::bail!("the page cannot play {other:?}"),
        })
    });
    let settings = changes(&stop.settings).into_iter().map(|(place, value)| json!([0, "set", place, value]));
    let messages = settings.map(Ok).chain(events).collect::<Result<Vec<_>>>()?;
    Ok(
        json!({ "title": stop.title, "words": stop.words, "samples": stop.score.samples, "messages": messages }),
    )
}

/// The values that differ from the defaults, by their places.
fn changes(settings: &Settings) -> Vec<(usize, f32)> {
    let (own, default) = (values::list(settings), values::list(&Settings::default()));
    (0..values::COUNT).filter(|&at| own[at] != default[at]).map(|at| (at, own[at])).collect()
}

fn instrument(of: Bundled) -> Result<Value> {
    let file = of.file();
    let model = Preparation::new(&Wanted::new(file.clone(), 48_000.0), None).ready()?;
    let model = model.with_context(|| format!("{} is not prepared", of.id()))?;
    let mut drawn = drawn(&file, &model);
    drawn["id"] = json!(of.id());
    for (at, hole) in file.holes.iter().enumerate() {
        let says = hole.description.split([',', ';', '(']).next().unwrap_or_default().trim();
        drawn["holes"][at]["says"] = json!(says);
    }
    Ok(drawn)
}

fn preset(preset: &Preset) -> Value {
    let changes = changes(&preset.settings()).into_iter().map(|(at, value)| (at.to_string(), json!(value)));
    let changes: serde_json::Map<_, _> = changes.collect();
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
    use chalumeau_web::drawn::PLACES;

    #[test]
    fn the_page_gets_every_instrument_and_most_presets() {
        let all: Value = serde_json::from_str(&text().unwrap()).unwrap();
        let instruments = all["instruments"].as_array().unwrap();
        assert_eq!(instruments.len(), Bundled::ALL.len());
        for instrument in instruments {
            let fingerings = instrument["fingerings"].as_array().unwrap();
            let holes = instrument["holes"].as_array().unwrap().len();
            assert!(fingerings.len() > 40 && holes >= 24);
            for fingering in fingerings {
                assert_eq!(fingering["wave"].as_str().unwrap().len(), 2 * PLACES);
                assert_eq!(fingering["open"].as_str().unwrap().len(), holes);
            }
        }
        let presets = all["presets"].as_array().unwrap();
        assert!(presets.len() > 60 && presets.len() < factory::all().len(), "{}", presets.len());
        assert_eq!(presets[0]["values"], json!({}), "the first is the default");
        assert_eq!(all["struck"]["dynamic"], json!(VELOCITY_DYNAMIC), "the meter marks how a key is struck");
        assert_eq!(all["controls"].as_array().unwrap().len(), CONTROLS.len());
    }

    #[test]
    fn the_page_can_play_the_whole_tour() {
        let all: Value = serde_json::from_str(&tour().unwrap()).unwrap();
        let chapters = all["chapters"].as_array().unwrap();
        let stops: usize = chapters.iter().map(|chapter| chapter["stops"].as_array().unwrap().len()).sum();
        assert!(chapters.len() == 5 && stops > 20, "{stops}");
    }
}
