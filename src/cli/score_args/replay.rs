//! The replay of a recorded take: with which feel, how it differs from what was recorded, and what it plays.

use crate::cli::Failure;
use crate::cli::feel_args::FeelArgs;
use crate::feel_flags;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::event::{PartEvent, Timed};
use chalumeau_core::haptics::FeelDesign;
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::score::Score;
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::touch::take::{Take, TakeEmbouchure};

/// By so much a take may be shorter than the piece without a word, s: the last note fades.
const SHORT_TAKE_S: f64 = 1.0;
/// Reeds whose H and k differ by less are the same: takes have five decimals.
const SAME_REED: f64 = 2e-5;

/// The feel with which a take was recorded, if it says so.
fn recorded_feel(take: &Take) -> Result<Option<FeelDesign>, Failure> {
    let Some(flags) = &take.head().feel else { return Ok(None) };
    let read = feel_flags::read(flags).map_err(|reason| {
        Failure::Usage(format!(
            "--replay: the take's line \"# feel {flags}\": {reason}; correct that line, or remove it"
        ))
    });
    read.map(Some)
}

/// The feel of a replay: that of the take, which given flags replace.
pub fn feel(given: &FeelArgs, take: Option<&Take>, file: &InstrumentFile) -> Result<FeelDesign, Failure> {
    match take.map(recorded_feel).transpose()?.flatten() {
        Some(recorded) => given.over(&recorded, file),
        None => given.design(file),
    }
}

/// Says that a take ends before the piece.
pub fn too_short(take: &Take, score: &Score<PartEvent>, rate: u32) -> Option<String> {
    let piece_s = score.samples as f64 / f64::from(rate);
    (take.seconds() + SHORT_TAKE_S < piece_s).then(|| {
        format!(
            "the take ends after {:.1} s, and the piece after {piece_s:.1} s: the knob stays where the take leaves it",
            take.seconds()
        )
    })
}

/// Says in what a replay differs from what was recorded. `feel` is the one that is replayed, and whether the user has given any of it.
pub fn differences(
    take: &Take,
    (design, is_given): (&FeelDesign, bool),
    model: &Model,
    settings: &Settings,
) -> Result<Vec<String>, Failure> {
    let mut said = Vec::new();
    match recorded_feel(take)? {
        Some(recorded) if !feel_flags::map_alike(&recorded, design) => said.push(format!(
            "the take was recorded with {}; the feel that you give turns its angles into other pressures",
            feel_flags::in_flags(&recorded)
        )),
        None if !is_given => said.push(format!(
            "the take does not say its feel; it is replayed with {}",
            feel_flags::in_flags(design)
        )),
        _ => {}
    }
    if let Some(name) = take.head().instrument.as_ref().filter(|name| **name != model.file.name) {
        said.push(format!("the take was played on another instrument: {name}"));
    }
    let lip = TakeEmbouchure::of(settings);
    if let Some(played) = take.head().embouchure.filter(|played| *played != lip) {
        said.push(format!(
            "the take was played with --zeta {} --strength {} --lip {}; it is replayed with {}, {} and {}",
            played.zeta, played.strength, played.lip, lip.zeta, lip.strength, lip.lip
        ));
    }
    let law = settings.reed_law();
    if let Some(((h, k), is_one)) = take.reed()
        && ((h - law.h()).abs().max((k - law.k()).abs()) > SAME_REED || !is_one)
    {
        let more = if is_one { "" } else { " at first, and with others" };
        said.push(format!(
            "the take was played with H {h}, k {k}{more}; it is replayed with H {:.5}, k {:.5}",
            law.h(),
            law.k()
        ));
    }
    Ok(said)
}

/// The events of a score with the breath of a take.
pub fn events(
    take: &Take,
    design: &FeelDesign,
    model: &Model,
    settings: &Settings,
    score: &Score<PartEvent>,
    rate: u32,
) -> Result<Vec<Timed<PartEvent>>, Failure> {
    let feels = InstrumentFeel::new(model);
    let table = feels.table(settings, design, &NO_MOTOR)?;
    let knob = KnobDesign { full_deg: design.travel_deg, ..KnobDesign::default() };
    let hand = take.mapping(feels.maps_for(&table, settings), knob);
    let rate_hz = f64::from(rate);
    let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
    let mut blower = Blower::default();
    blower.set_notes(settings.reach.key_notes(model));
    let events = BlownEvents::new(
        score.events.iter().copied(),
        &mut blower,
        &hand,
        full_pa,
        score.samples,
        |at| Some(take.angle_deg(at as f64 / rate_hz)),
        &mut |_, _| {},
    )
    .collect();
    Ok(events)
}
