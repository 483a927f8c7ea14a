//! The report's chapters "Breath" and "Haptics", for the instrument and the reed that were played.

use crate::cli::render_job::RenderJob;
use crate::cli::report::{number, word};
use crate::feel_flags::law_name;
use crate::parameters::{self, Kind};
use chalumeau_core::haptics::torque_law::torque_mnm;
use chalumeau_core::haptics::{FeelDesign, FeelRefused, FeelTable, NoteFeel, NoteRequirement, TorqueLimits};
use chalumeau_core::instrument::{KeyPitches, Model, Reach, Settings};
use chalumeau_core::measure::bifurcation;
use chalumeau_core::measure::bifurcation::SOUNDING_RMS;
use chalumeau_core::reed::ReedTables;
use chalumeau_core::score::breath::GAMMA_MAX;
use chalumeau_core::units::WrittenNote;
use chalumeau_figure::breath::{NotePressures, Swell, Turn, pressures, turns};
use chalumeau_figure::felt::{AtContrast, FeltThresholds, Torque, few, thresholds, torques};
use chalumeau_figure::report::{Chapter, Plate, ReportTable, TableCell};
use chalumeau_knob::touch::feel::InstrumentFeel;
use chalumeau_knob::wire::message::TorqueLaw;
use std::sync::Arc;

/// Contrasts, and Places, shown.
const EXPONENTS: [f64; 3] = [1.0, 3.0, 5.0];
/// Both laws that push.
const LAWS: [TorqueLaw; 2] = [TorqueLaw::Flow, TorqueLaw::Pressure];
/// The crescendo goes to this many times the pressure at which the note chokes.
const BEYOND: f64 = 1.06;
/// Time of the crescendo, and again of the diminuendo, s: a long breath.
const SWELL_S: f64 = 6.0;
/// Points along a curve.
const POINTS: usize = 400;
/// A mode that starts at this many times the pressure of the first belongs to another register.
const LATER: f64 = 1.01;

/// Greatest mouth pressure of the instrument, kPa: the upper end of *Full breath*.
fn most_kpa() -> f64 {
    match parameters::find("full").map(|parameter| parameter.kind) {
        Some(Kind::Number(number)) => f64::from(number.max),
        _ => f64::INFINITY,
    }
}

/// The pressures that the notes need, and the feel made from them.
pub struct BreathAndHaptics<'a> {
    prepared: &'a RenderJob,
    feels: InstrumentFeel,
    asked: Vec<Option<NoteRequirement>>,
    /// As the command says.
    design: FeelDesign,
    limits: TorqueLimits,
    /// Index of the fingering for the crescendo.
    near: Option<usize>,
}

impl<'a> BreathAndHaptics<'a> {
    /// Analyses the instrument (about 1 s). `near` is the written note to swell.
    pub fn new(prepared: &'a RenderJob, design: FeelDesign, near: Option<WrittenNote>) -> Self {
        let feels = InstrumentFeel::new(&prepared.model);
        let (model, reach) = (&prepared.model, prepared.settings.reach);
        let plays = |written: WrittenNote| {
            let sounding = written.sounding(model.file.transposition);
            sounding.is_some_and(|note| reach.fingering(note, model).is_some())
        };
        // A key that is silent because its note is out of tune does not speak.
        let asked = feels.requirements().with(&feels.reed(&prepared.settings));
        let asked = feels.requirements().written().zip(asked);
        let asked: Vec<_> = asked.map(|(written, asked)| asked.filter(|_| plays(written))).collect();
        let near = near.and_then(|near| feels.requirements().written().position(|written| written == near));
        let first = asked.iter().position(Option::is_some);
        let near = near.filter(|&near| asked[near].is_some()).or(first);
        Self { prepared, feels, asked, design, limits: TorqueLimits::default(), near }
    }

    fn closing_kpa(&self) -> f64 {
        1e-3 * self.prepared.settings.closing_pa()
    }

    fn notes(&self) -> impl Iterator<Item = (WrittenNote, Option<NoteRequirement>)> + '_ {
        self.feels.requirements().written().zip(self.asked.iter().copied())
    }

    fn table(&self, design: &FeelDesign) -> Result<FeelTable, FeelRefused> {
        self.feels.table(&self.prepared.settings, design, &self.limits)
    }

    fn reed(&self) -> String {
        let settings = &self.prepared.settings;
        format!(
            "zeta {}, strength {}, lip {}, lay {}",
            settings.zeta, settings.strength, settings.lip, settings.lay
        )
    }

    fn changes(&self, (written, asked): (WrittenNote, Option<NoteRequirement>)) -> NotePressures {
        let of = |gamma: fn(&NoteRequirement) -> f64| {
            asked.as_ref().map_or(f64::NAN, |asked| self.closing_kpa() * gamma(asked))
        };
        NotePressures {
            written: written.0,
            speaks_kpa: of(|asked| asked.gamma_sounding),
            beats_kpa: of(|asked| asked.gamma_beat),
            chokes_kpa: of(|asked| asked.gamma_off),
        }
    }

    /// Pressures of all notes, a crescendo of one note, and pressure over the knob's angle.
    pub fn breath(&self) -> Chapter {
        let closing_kpa = self.closing_kpa();
        let changes: Vec<NotePressures> = self.notes().map(|note| self.changes(note)).collect();
        let instrument = &self.prepared.model.file.name;
        let mut words = vec![format!(
            "A note speaks from a mouth pressure on, beats from where the reed touches the facing in each cycle, and chokes \
             where the reed stays shut; these are worked out from the bore and from the reed as it moves under the lip. It \
             closes, at {closing_kpa:.2} kPa for every note, where the resting reed would be shut. On a curved facing \
             the reed rolls up from where it beats and is shut only at more."
        )];
        let mut plates = vec![Plate {
            figure: pressures(instrument, &self.reed(), closing_kpa, &changes),
            caption: "Every note: green it sounds, orange the reed beats as well.".to_owned(),
            alternative: format!(
                "Mouth pressure in kilopascals over the written notes of {instrument}: where each begins, where its reed \
                 begins to beat, and where it chokes, beside the closing pressure of {closing_kpa:.2} kPa. {}",
                range(&changes)
            ),
        }];
        if let Some((plate, said)) = self.near.and_then(|near| self.swell(near, changes[near])) {
            plates.push(plate);
            words.push(said);
        }
        match self.table(&self.design) {
            Ok(table) => plates.push(self.turns(&table)),
            Err(reason) => words.push(format!("No knob would take this feel: {reason}.")),
        }
        Chapter {
            title: "Breath".to_owned(),
            words,
            plates,
            tables: vec![self.pressures()],
            ..Chapter::default()
        }
    }

    /// One note from silence to closure and back.
    fn swell(&self, near: usize, changes: NotePressures) -> Option<(Plate, String)> {
        let (written, asked) = self.notes().nth(near)?;
        let closing_kpa = self.closing_kpa();
        let file = &self.prepared.model.file;
        let sounding = written.sounding(file.transposition)?;
        let most = f64::from(GAMMA_MAX).min(most_kpa() / closing_kpa);
        let gamma = (BEYOND * asked?.gamma_off).min(most);
        let settings = Settings {
            breath_full_kpa: (gamma * closing_kpa).max(1.0) as f32,
            reach: Reach::default(),
            ..self.prepared.settings
        };
        let rate = self.prepared.rate;
        // The note itself, whichever key plays it in the score.
        let model = Arc::new(Model { keys: KeyPitches::default(), ..(*self.prepared.model).clone() });
        let played = bifurcation::measure(&model, &settings, sounding, gamma as f32, SWELL_S, rate, |_| {});
        let at = |share: f64| share * SWELL_S;
        let moment = |t_s: f64, point: &bifurcation::RampPoint| {
            [t_s, closing_kpa * point.gamma, closing_kpa * point.rms, point.shut]
        };
        let up = played.up.iter().map(|point| moment(at(point.gamma / gamma), point));
        let down = played.down.iter().map(|point| moment(at(2.0 - point.gamma / gamma), point));
        let found = played.transitions();
        let said = |gamma: Option<f64>, what: &str| {
            gamma.map(|gamma| format!("{what} {:.2} kPa", closing_kpa * gamma))
        };
        let told = [
            said(found.begins, "begins at"),
            said(found.shuts, "is shut for a part of each period from"),
            said(found.chokes, "chokes, while the breath rises, at"),
            said(found.returns, "sounds again, when the breath falls, from"),
            said(found.ends, "ends at"),
        ];
        let told: Vec<String> = told.into_iter().flatten().collect();
        let outcome = match told.is_empty() {
            true => format!("Written {written} does not sound on the way."),
            false => format!("Written {written} {}.", told.join(", ")),
        };
        let plate = Plate {
            figure: Swell {
                title: format!("written {written}"),
                note: format!("{}; {SWELL_S} s up and {SWELL_S} s down", self.reed()),
                closing_kpa,
                changes: Some(changes),
                course: up.chain(down).collect(),
                sounds_kpa: SOUNDING_RMS * closing_kpa,
            }
            .figure(),
            caption: format!("Written {written}, blown from nothing to beyond closure and back."),
            alternative: format!(
                "Two panels over {} seconds: mouth pressure rising and falling with bands where the note sounds, beats \
                 and is blown shut; and the amplitude in the mouthpiece. {outcome}",
                2.0 * SWELL_S
            ),
        };
        let why = "A breath that moves overtakes a threshold before the note has grown or died, so it begins late and ends \
                   early; the slower the breath, the less.";
        Some((plate, format!("{outcome} {why}")))
    }

    fn turns(&self, table: &FeelTable) -> Plate {
        let few = few(table);
        let most_deg = few.iter().map(|note| f64::from(note.feel.wall_deg)).fold(0.0, f64::max);
        let turn = |note: &&NoteFeel| {
            let kpa = |deg: f64| 1e-3 * note.map.pressure_pa(deg);
            let landmark = |deg: f64| (deg, kpa(deg));
            Turn {
                name: note.written.to_string(),
                map: (0..=POINTS).map(|n| landmark(most_deg * n as f64 / POINTS as f64)).collect(),
                speaks: landmark(note.landmarks.a_on_deg),
                closes: landmark(note.landmarks.a_close_deg),
            }
        };
        let all: Vec<Turn> = few.iter().map(turn).collect();
        let design = format!("{} law, Place {}", law_name(self.design.law), self.design.place);
        Plate {
            figure: turns(&format!("{design}; {}", self.reed()), self.closing_kpa(), &all),
            caption: "The mouth pressure of an angle, for each note: the sound begins (disc) at the mark of the torque, and the reed \
                      closes (ring) where the torque ends."
                .to_owned(),
            alternative: format!(
                "Mouth pressure against the angle of the knob, {design}, for written {}.",
                names(&few)
            ),
        }
    }

    fn pressures(&self) -> ReportTable {
        let head = [
            "written",
            "sounds",
            "speaks, kPa",
            "of closing",
            "own pitch from, kPa",
            "beats, kPa",
            "chokes, kPa",
        ];
        let file = &self.prepared.model.file;
        let closing_kpa = self.closing_kpa();
        let row = |(written, asked): (WrittenNote, Option<NoteRequirement>)| {
            let mut row = vec![
                word(written.to_string()),
                word(written.sounding(file.transposition).map_or(String::new(), |note| note.to_string())),
            ];
            let Some(asked) = asked else {
                row.push(number("never"));
                row.resize_with(head.len(), || number(""));
                return row;
            };
            let kpa = |gamma: f64| number(format!("{:.2}", closing_kpa * gamma));
            row.push(kpa(asked.gamma_sounding));
            row.push(number(format!("{:.3}", asked.gamma_sounding)));
            row.push(match asked.gamma_own {
                None => number("never"),
                Some(own) if own > LATER * asked.gamma_sounding => {
                    number(format!("{:.2}, first {:.0} Hz", closing_kpa * own, asked.sounding_hz))
                }
                Some(_) => number("at once"),
            });
            row.extend([kpa(asked.gamma_beat), kpa(asked.gamma_off)]);
            row
        };
        ReportTable {
            title: "Mouth pressures".to_owned(),
            about: String::new(),
            head: head.map(str::to_owned).to_vec(),
            rows: self.notes().map(row).collect(),
        }
    }

    /// Torque, thresholds, what goes to the knob, and what a knob would refuse.
    pub fn haptics(&self) -> Chapter {
        let ceiling_mnm = self.limits.ceiling_mnm;
        let mut words = vec![format!(
            "The feel of a force-feedback knob for these notes, at {} mNm. Contrast 1 follows the bore; a larger contrast \
             exaggerates how the torque of notes differs, Place where they speak. Hands tell two torques apart if they differ \
             by about 13 % (Jandura and Srinivasan 1994). The figures show the torque that the knob's firmware calculates, at \
             rest and without friction. It must not pass {ceiling_mnm:.0} mNm, must not be steeper than {:.2} N m/rad, up to \
             which a sampled knob stays passive, and must not push the hand along with more than {:.1} N m/rad.",
            self.design.strength_mnm, self.limits.stiffness_nm_per_rad, self.limits.push_nm_per_rad
        )];
        let mut plates = Vec::new();
        let mut felt = Vec::new();
        let mut refusals = Vec::new();
        for law in LAWS {
            let mut on_deg = Vec::new();
            let mut at_kpa = Vec::new();
            let mut panels = Vec::new();
            for place in EXPONENTS {
                // Contrast moves no threshold, and at 1 the torque is least likely to be refused.
                let design = FeelDesign { law, place, contrast: 1.0, ..self.design };
                let Ok(table) = self.table(&design) else { continue };
                let sounding = || table.notes().iter().filter(|note| note.requirement.is_some());
                let on = sounding().map(|note| (note.written.0, note.landmarks.a_on_deg));
                on_deg.push((place, on.collect()));
                if at_kpa.is_empty() {
                    at_kpa = sounding().map(|note| (note.written.0, marked_kpa(note))).collect();
                }
            }
            for contrast in EXPONENTS {
                let design = FeelDesign { law, contrast, ..self.design };
                let table = self.table(&design);
                refusals.push(self.refusal(&design, table.as_ref().err()));
                let notes = table.map(|table| few(&table).into_iter().map(Torque::of).collect());
                panels.push(AtContrast { contrast, notes: notes.map_err(|reason| reason.to_string()) });
            }
            plates.push(self.torques(law, &panels));
            felt.push(FeltThresholds { law: law_name(law).to_owned(), at_kpa, on_deg });
        }
        plates.push(self.thresholds(&felt));
        let mut tables = vec![refused(refusals)];
        match self.table(&self.design) {
            Ok(table) => tables.push(self.feel(&table)),
            Err(reason) => words.push(format!("The feel asked for is refused: {reason}.")),
        }
        Chapter { title: "Haptics".to_owned(), words, plates, tables, ..Chapter::default() }
    }

    fn torques(&self, law: TorqueLaw, panels: &[AtContrast]) -> Plate {
        let name = law_name(law);
        let said: Vec<String> = panels
            .iter()
            .filter_map(|at| at.notes.as_ref().err().map(|why| format!("Contrast {}: {why}.", at.contrast)))
            .collect();
        let shape = match law {
            TorqueLaw::Flow => {
                "It rises to the mark at the threshold and falls to nothing where the reed shuts."
            }
            _ => "A spring with a step at the threshold.",
        };
        Plate {
            figure: torques(name, &self.reed(), self.limits.ceiling_mnm, panels),
            caption: format!("The {name} law. {shape} The last rise is the end wall. {}", said.join(" "))
                .trim_end()
                .to_owned(),
            alternative: format!(
                "Torque in millinewton metres against the angle of the knob under the {name} law, a panel for each of \
                 Contrast 1, 3 and 5, for the easiest, the lowest, the reference and the hardest note. {}",
                said.join(" ")
            ),
        }
    }

    fn thresholds(&self, felt: &[FeltThresholds]) -> Plate {
        let closing_kpa = self.closing_kpa();
        let sounds: Vec<(u8, f64)> = self
            .notes()
            .map(|(note, asked)| (note.0, asked.map_or(f64::NAN, |asked| closing_kpa * asked.gamma_sounding)))
            .collect();
        let farthest = felt
            .iter()
            .flat_map(|felt| &felt.at_kpa)
            .filter_map(|(written, kpa)| {
                let (_, sounds) = sounds.iter().find(|(note, _)| note == written)?;
                Some((kpa / sounds - 1.0).abs())
            })
            .fold(0.0, f64::max);
        let outcome = format!(
            "The mark of the torque lies within {:.1} % of where the sound begins by theory, for every note and both laws.",
            100.0 * farthest
        );
        Plate {
            figure: thresholds(&self.reed(), &sounds, felt),
            caption: format!("{outcome} Place moves both on the knob."),
            alternative: format!(
                "Over the written notes: mouth pressure where each begins to sound and where the torque has its mark, and \
                 the angle of the felt threshold at Place 1, 3 and 5 under both laws. {outcome}"
            ),
        }
    }

    fn feel(&self, table: &FeelTable) -> ReportTable {
        let head = [
            "written",
            "A_on, degrees",
            "A_beat, degrees",
            "closure, degrees",
            "A_off, degrees",
            "torque at A_on, mNm",
            "scale, mNm",
        ];
        let row = |note: &NoteFeel| {
            let at = note.landmarks;
            let degrees = [at.a_on_deg, at.a_beat_deg, at.a_close_deg, at.a_off_deg];
            let mut row = vec![word(note.written.to_string())];
            row.extend(degrees.map(|deg| number(format!("{deg:.1}"))));
            row.push(number(format!("{:.1}", torque_mnm(&note.feel, ReedTables::reference(), at.a_on_deg))));
            row.push(number(format!("{:.1}", note.feel.scale_mnm)));
            row
        };
        ReportTable {
            title: "Feel sent to the knob".to_owned(),
            about: format!(
                "FEEL of every note, {} law, Contrast {}, Place {} about {}: where it is felt to start, beats, closes and chokes.",
                law_name(self.design.law),
                self.design.contrast,
                self.design.place,
                table.reference().written
            ),
            head: head.map(str::to_owned).to_vec(),
            rows: table.notes().iter().map(row).collect(),
        }
    }

    /// Whether a feel is accepted, up to which torque, and what limits the torque.
    fn refusal(&self, design: &FeelDesign, reason: Option<&FeelRefused>) -> Vec<TableCell> {
        let taken = reason.map_or("accepted".to_owned(), |reason| format!("refused: {reason}"));
        let (mut low, mut high) = (0.0, 450.0);
        let mut bound = None;
        // To a millinewton metre.
        while high - low > 1.0 {
            let strength_mnm = (0.5_f64 * (low + high)).round();
            match self.table(&FeelDesign { strength_mnm, ..*design }) {
                Ok(_) => low = strength_mnm,
                Err(reason) => (high, bound) = (strength_mnm, Some(reason)),
            }
        }
        let bound = match bound {
            Some(FeelRefused::Ceiling { .. }) => "the ceiling",
            Some(FeelRefused::Stiffness { .. }) => "the slope up to which the knob is passive",
            Some(FeelRefused::Push { .. }) => "the slope that would push the hand along",
            Some(_) => "the reed, at any torque",
            None => "nothing",
        };
        vec![
            word(law_name(design.law)),
            number(format!("{}", design.contrast)),
            word(taken),
            number(format!("{low:.0}")),
            word(bound),
        ]
    }
}

fn refused(rows: Vec<Vec<TableCell>>) -> ReportTable {
    let head = ["law", "Contrast", "at the torque asked for", "accepted up to, mNm", "limited by"];
    ReportTable {
        title: "What a knob would refuse".to_owned(),
        about: "A feel is refused as a whole if a knob could not hold it stable or if it passes the ceiling; it is never clipped."
            .to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows,
    }
}

fn names(few: &[&NoteFeel]) -> String {
    few.iter().map(|note| note.written.to_string()).collect::<Vec<_>>().join(", ")
}

/// From the easiest to the hardest note, in words.
fn range(changes: &[NotePressures]) -> String {
    let speaks = || changes.iter().filter(|note| note.speaks_kpa.is_finite());
    let by = |a: &&NotePressures, b: &&NotePressures| a.speaks_kpa.total_cmp(&b.speaks_kpa);
    match (speaks().min_by(by), speaks().max_by(by)) {
        (Some(easy), Some(hard)) => format!(
            "The easiest is {} at {:.2} kPa, the hardest {} at {:.2} kPa.",
            WrittenNote(easy.written),
            easy.speaks_kpa,
            WrittenNote(hard.written),
            hard.speaks_kpa
        ),
        _ => "No note sounds with this reed.".to_owned(),
    }
}

/// Mouth pressure at the mark of a note's torque, found on its curve: the top under flow, else its steepest rise.
fn marked_kpa(note: &NoteFeel) -> f64 {
    const STEP_DEG: f64 = 0.25;
    let tables = ReedTables::reference();
    let mnm = |deg: f64| torque_mnm(&note.feel, tables, deg);
    let rise = |deg: f64| mnm(deg + STEP_DEG) - mnm(deg - STEP_DEG);
    let value = |deg: f64| if note.feel.law == TorqueLaw::Flow { mnm(deg) } else { rise(deg) };
    let steps = (note.landmarks.a_close_deg / STEP_DEG) as usize;
    let degrees = (4..steps).map(|step| STEP_DEG * step as f64);
    let mark = degrees.max_by(|&a, &b| value(a).total_cmp(&value(b))).unwrap_or(0.0);
    1e-3 * note.map.pressure_pa(mark)
}
