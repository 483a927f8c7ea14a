use super::*;
use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::instrument::Articulation;
use chalumeau_core::instrument::player::Attack;
use chalumeau_core::instrument::player::vibrato::Vibrato;
use chalumeau_core::instrument::techniques::{GrowlPitch, Techniques, Tract};
use chalumeau_core::instrument::{
    Beyond, BreathResponse, Listening, ListeningMode, Players, Reach, Room, Split, Tuning,
};

/// Id, group, name, default, and whether a host can automate it, in the order of hosts. A frozen copy: saved projects and
/// automation lanes depend on it. Append only.
const FROZEN: &[(&str, &str, &str, &str, bool)] = &[
    ("breath", "Breath", "Breath", "0.0 %", true),
    ("full", "Breath", "Full breath", "6.00 kPa", true),
    ("tongue", "Breath", "Tongue", "2.0 ms", true),
    ("legato", "Breath", "Legato", "8.0 ms", true),
    ("resp", "Breath", "Breath response", "Played", true),
    ("bcurve", "Breath", "Breath curve", "1.00", true),
    ("bsoft", "Breath", "Softest breath", "3.1 %", true),
    ("bloud", "Breath", "Loudest breath", "100.0 %", true),
    ("bfrom", "Breath", "Breath from", "Any", true),
    ("bdead", "Breath", "Breath deadband", "0.0 %", true),
    ("stren", "Embouchure", "Reed strength", "2.50", true),
    ("lip", "Embouchure", "Lip opening", "1.000 x", true),
    ("zeta", "Embouchure", "Embouchure", "0.300", true),
    ("damp", "Embouchure", "Lip damping", "1.00 x", true),
    ("reedh", "Reed", "Reed H", "2.5981", true),
    ("reedk", "Reed", "Reed k", "0.3849", true),
    ("reedc", "Reed", "Reed coupled", "Coupled", true),
    ("reeda", "Reed", "Reed A", "1.000", true),
    ("lay", "Reed", "Facing", "0.400", true),
    ("a4", "Tuning", "A4", "440.0 Hz", true),
    ("tune", "Tuning", "Tuning", "Tempered", true),
    ("temp", "Tuning", "Temperature", "25.0 °C", true),
    ("vent", "Tuning", "Vent loss", "2.00", true),
    ("transp", "Tuning", "Transpose", "0 st", true),
    ("beyond", "Tuning", "Beyond the range", "Silent", true),
    ("noise", "Noise", "Breath noise", "30.0 %", true),
    ("gain", "Output", "Gain", "-2.5 dB", true),
    ("panic", "Output", "Panic", "Off", true),
    ("knob", "Knob", "Knob", "Off", false),
    ("arm", "Knob", "Arm knob", "Off", false),
    ("ceil", "Knob", "Torque ceiling", "100 mNm", false),
    ("takeov", "Knob", "Take over knob", "Off", false),
    ("rest", "Knob", "Rest here", "Off", false),
    ("blow", "Knob", "Blow hard here", "Off", false),
    ("law", "Knob", "Feel", "Flow", false),
    ("contr", "Knob", "Feel contrast", "3.00 x", false),
    ("order", "Knob", "Feel order", "Physical", false),
    ("refnot", "Knob", "Feel reference", "72", false),
    ("torque", "Knob", "Feel torque", "55 mNm", false),
    ("kdamp", "Knob", "Feel damping", "1.00 mNm s", false),
    ("kfric", "Knob", "Feel friction", "1.0 mNm", false),
    ("detent", "Knob", "Feel step", "6.0 mNm", false),
    ("curve", "Knob", "Knob curve", "1.00", false),
    ("oscprt", "Knob", "OSC port", "8000", false),
    ("oscany", "Knob", "OSC from network", "Off", false),
    ("oscfl", "Knob", "Feel OSC port", "0", false),
    ("rec", "Knob", "Record take", "Off", false),
    ("replay", "Knob", "Replay take", "Off", false),
    ("study", "Knob", "Study", "Off", false),
    ("part", "Knob", "Participant", "1", false),
    ("seed", "Knob", "Study seed", "1", false),
    ("trial", "Knob", "Trial", "1", false),
    ("side", "Knob", "Study side", "A", true),
    ("hsrc", "Knob", "H from", "Parameter", false),
    ("ksrc", "Knob", "k from", "Parameter", false),
    ("kstat", "Knob", "Knob status", "off", false),
    ("place", "Knob", "Feel place", "1.00 x", false),
    ("mark", "Knob", "Feel mark", "9.0 mNm", false),
    ("instr", "Instrument", "Instrument", "B flat clarinet", false),
    ("qual", "Instrument", "Offline quality", "Same as live", false),
    ("bendr", "Instrument", "Bend range", "2 st", false),
    ("istat", "Instrument", "Instrument status", "not playing", false),
    ("rface", "Reed, physical", "Reed description", "Dimensionless", false),
    ("rstiff", "Reed, physical", "Reed stiffness", "1218.1 N/m", true),
    ("rarea", "Reed, physical", "Reed area", "101.50 mm²", true),
    ("rwidth", "Reed, physical", "Reed width", "15.21 mm", true),
    ("ropen", "Reed, physical", "Reed opening", "0.500 mm", true),
    ("heard", "Listening", "Heard from", "Everywhere", true),
    ("ldist", "Listening", "Listening distance", "1.00 m", true),
    ("langle", "Listening", "Listening angle", "30 °", true),
    ("lheigh", "Listening", "Listening height", "0.00 m", true),
    ("lwidth", "Listening", "Listening width", "60 °", true),
    ("room", "Room", "Room", "0.0 %", true),
    ("rsize", "Room", "Room size", "12.0 m", true),
    ("rdecay", "Room", "Room decay", "1.20 s", true),
    ("rtone", "Room", "Room tone", "50.0 %", true),
    ("life", "Expression", "Life", "100.0 %", true),
    ("vib", "Expression", "Vibrato", "0.0 %", true),
    ("vibhz", "Expression", "Vibrato rate", "5.20 Hz", true),
    ("vibon", "Expression", "Vibrato onset", "0.40 s", true),
    ("vibun", "Expression", "Vibrato unevenness", "30.0 %", true),
    ("attack", "Expression", "Attack", "Normal", true),
    ("gliss", "Expression", "Glissando", "0.00 s", true),
    ("wheel", "Expression", "Mod wheel", "Vibrato", false),
    ("scoop", "Expression", "Scoop", "0 cents", true),
    ("scoops", "Expression", "Scoop time", "0.15 s", true),
    ("fall", "Expression", "Fall", "0 cents", true),
    ("falls", "Expression", "Fall time", "0.40 s", true),
    ("bin", "Expression", "Breath in", "0.0 %", true),
    ("ksound", "Expression", "Key sounds", "0.0 %", true),
    ("slap", "Expression", "Slap", "0.0 %", true),
    ("altf", "Expression", "Alternate fingerings", "Chart", true),
    ("keysw", "Expression", "Key switches", "Off", false),
    ("growl", "Techniques", "Growl", "0.0 %", true),
    ("growlp", "Techniques", "Growl pitch", "Follows the note", true),
    ("growli", "Techniques", "Growl interval", "-12.0 st", true),
    ("growlf", "Techniques", "Growl frequency", "110 Hz", true),
    ("flut", "Techniques", "Flutter", "0.0 %", true),
    ("fluthz", "Techniques", "Flutter rate", "25.0 Hz", true),
    ("subt", "Techniques", "Subtone", "0.0 %", true),
    ("tract", "Techniques", "Vocal tract", "0.0 %", true),
    ("tractp", "Techniques", "Tract interval", "0.0 st", true),
    ("player", "Players", "Players", "1", true),
    ("split", "Players", "Split", "Chords", true),
    ("spread", "Players", "Tuning spread", "6.0 cents", true),
    ("late", "Players", "Onset spread", "25.0 ms", true),
    ("seats", "Players", "Seats", "70.0 %", true),
    ("mic", "Microphone", "Microphone", "Off", false),
    ("miccal", "Microphone", "Calibrate microphone", "Off", false),
];

/// Ids of choices in saved states. Append only.
const FROZEN_CHOICES: &[(&str, &[&str])] = &[
    ("resp", &["play", "phys"]),
    ("bfrom", &["any", "cc2", "cc11", "press", "keys"]),
    ("tune", &["nat", "temp"]),
    ("beyond", &["silent", "octave"]),
    ("knob", &["off", "serial", "midi", "osc"]),
    ("law", &["flow", "press", "free"]),
    ("order", &["phys", "cover", "open"]),
    ("hsrc", &["param", "cc1", "cc16", "cc17", "cc74", "press"]),
    ("ksrc", &["param", "cc1", "cc16", "cc17", "cc74", "press"]),
    ("instr", &["bflat", "a", "eflat", "c", "bass", "user"]),
    ("qual", &["live", "high"]),
    ("rface", &["seed", "phys"]),
    ("heard", &["all", "place", "point"]),
    ("attack", &["soft", "normal", "hard"]),
    ("wheel", &["vib", "growl", "flut", "subt", "none"]),
    ("keysw", &["off", "c1", "c2"]),
    ("growlp", &["int", "fixed"]),
    ("split", &["chords", "unison"]),
];

fn numbers() -> impl Iterator<Item = (&'static Parameter, Number)> {
    PARAMETERS.iter().filter_map(|parameter| match parameter.kind {
        Kind::Number(number) => Some((parameter, number)),
        _ => None,
    })
}

#[test]
fn the_table_is_as_saved_projects_know_it() {
    let found: Vec<_> =
        PARAMETERS.iter().map(|p| (p.id, p.group, p.name, p.default_text(), p.is_automatable)).collect();
    let frozen: Vec<_> = FROZEN
        .iter()
        .map(|&(id, group, name, default, auto)| (id, group, name, default.to_owned(), auto))
        .collect();
    assert_eq!(found, frozen);
    let choices: Vec<(&str, Vec<&str>)> = PARAMETERS
        .iter()
        .filter_map(|p| match p.kind {
            Kind::Choice(choice) => Some((p.id, choice.all.iter().map(|(id, _)| *id).collect())),
            _ => None,
        })
        .collect();
    let frozen: Vec<(&str, Vec<&str>)> = FROZEN_CHOICES.iter().map(|(id, all)| (*id, all.to_vec())).collect();
    assert_eq!(choices, frozen);
}

#[test]
fn ids_are_short_and_stand_once_and_every_parameter_is_explained() {
    for (at, parameter) in PARAMETERS.iter().enumerate() {
        assert!((1..=6).contains(&parameter.id.len()), "{}", parameter.id);
        assert!(!parameter.meaning.is_empty(), "{}", parameter.id);
        assert!(PARAMETERS[..at].iter().all(|other| other.id != parameter.id), "{}", parameter.id);
    }
}

#[test]
fn nothing_that_moves_a_motor_or_plays_travels_with_undo_or_is_automated() {
    for id in ["arm", "ceil", "takeov", "rest", "blow", "rec", "replay", "knob", "instr"] {
        let parameter = find(id).unwrap();
        assert!(!parameter.is_undoable && !parameter.is_automatable, "{id}");
    }
    // The comparison takes the instrument along, and nothing else of these.
    for id in ["arm", "ceil", "takeov", "rest", "blow", "rec", "replay", "knob", "breath", "panic", "side"] {
        assert!(!find(id).unwrap().is_compared(), "{id}");
    }
    assert!(find("instr").unwrap().is_compared() && find("lip").unwrap().is_compared());
    assert!(!find("breath").unwrap().is_undoable && !find("panic").unwrap().is_undoable);
    for id in ["arm", "takeov", "rest", "blow", "rec", "miccal"] {
        assert!(!find(id).unwrap().is_restored, "{id} is never on in a loaded state");
    }
    assert!(find("no such").is_none());
}

/// What the window refuses is outside the range, not an end of it that lost its last bit on the way through its text.
#[test]
fn the_ends_of_every_range_are_read_back() {
    for (parameter, number) in numbers() {
        for end in [number.min, number.max, number.default] {
            let text = parameter.text(Value::Number(end));
            assert!(parameter.read(&text).is_ok(), "{}: {text}", parameter.id);
        }
        let beyond = parameter.text(Value::Number(number.max + (number.max - number.min)));
        assert!(parameter.read(&beyond).is_err(), "{}: {beyond}", parameter.id);
    }
}

#[test]
fn defaults_and_ranges_are_those_of_the_instrument() {
    let d = Settings::default();
    let mut filled = Settings {
        coupled: !d.coupled,
        tuning: Tuning::Natural,
        breath_response: BreathResponse::Physical,
        listening: Listening { mode: ListeningMode::Point, ..d.listening },
        reach: Reach { transpose: -2, beyond: Beyond::Octave, key_switches: KeySwitches::C2 },
        attack: Attack::Hard,
        alternates: true,
        techniques: Techniques { growl_pitch: GrowlPitch::Fixed, ..d.techniques },
        players: Players { count: 3, split: Split::Unison, ..d.players },
        ..d
    };
    let mut fields = 12;
    for (parameter, number) in numbers() {
        let Some(Sets::Number(which)) = parameter.sets else { continue };
        fields += 1;
        let mut copy = d;
        assert_eq!(*copy.number(which), number.default, "{}", parameter.id);
        // The k of a coupled reed, which a controller may open, goes further than what a user sets.
        let (least, most) = if parameter.id == "reedk" { (0.05, 7.0) } else { (number.min, number.max) };
        for (value, end) in [(-1e9, least), (1e9, most)] {
            let mut settings = d;
            parameter.set(&mut settings, Value::Number(value));
            assert_eq!(*settings.clamped().number(which), end, "{}", parameter.id);
        }
        *filled.number(which) = f32::NAN;
        parameter.set(&mut filled, Value::Number(number.default));
    }
    find("reedc").unwrap().set(&mut filled, Value::Switch(true));
    find("altf").unwrap().set(&mut filled, Value::Switch(false));
    find("tune").unwrap().set(&mut filled, Value::Choice(1));
    find("resp").unwrap().set(&mut filled, Value::Choice(0));
    find("heard").unwrap().set(&mut filled, Value::Choice(0));
    find("transp").unwrap().set(&mut filled, Value::Whole(0));
    find("beyond").unwrap().set(&mut filled, Value::Choice(0));
    find("keysw").unwrap().set(&mut filled, Value::Choice(0));
    find("attack").unwrap().set(&mut filled, Value::Choice(1));
    find("growlp").unwrap().set(&mut filled, Value::Choice(0));
    find("player").unwrap().set(&mut filled, Value::Whole(1));
    find("split").unwrap().set(&mut filled, Value::Choice(0));
    assert_eq!(filled, d, "the table reaches every field");
    // All fields of the settings, each by one parameter.
    let Settings {
        breath_response: _,
        breath_curve: _,
        breath_softest: _,
        breath_loudest: _,
        breath_deadband: _,
        breath_full_kpa: _,
        noise: _,
        tongue_ms: _,
        legato_ms: _,
        strength: _,
        lip: _,
        zeta: _,
        damping: _,
        lay: _,
        reed_h: _,
        reed_k: _,
        coupled: _,
        reed_a: _,
        a4_hz: _,
        tuning: _,
        temperature_c: _,
        vent_loss: _,
        gain_db: _,
        listening: Listening { mode: _, distance_m: _, angle_deg: _, height_m: _, width_deg: _ },
        reach: Reach { transpose: _, beyond: _, key_switches: _ },
        room: Room { amount: _, size_m: _, decay_s: _, tone: _ },
        life: _,
        vibrato: Vibrato { depth: _, rate_hz: _, onset_s: _, unevenness: _ },
        attack: _,
        glissando_s: _,
        articulation:
            Articulation {
                scoop_cents: _,
                scoop_s: _,
                fall_cents: _,
                fall_s: _,
                breath_in: _,
                key_sounds: _,
                slap: _,
            },
        alternates: _,
        techniques:
            Techniques {
                growl: _,
                growl_pitch: _,
                growl_semitones: _,
                growl_hz: _,
                flutter: _,
                flutter_hz: _,
                subtone: _,
            },
        tract: Tract { amount: _, interval_semitones: _ },
        players: Players { count: _, split: _, spread_cents: _, onset_spread_ms: _, width: _ },
    } = d;
    assert_eq!(fields, 64);
}

#[test]
fn defaults_of_the_measured_reed_are_the_reference_reed() {
    let mut reference = PhysicalReed::reference();
    let mut count = 0;
    for (parameter, number) in numbers() {
        if let Some(Sets::Reed(field, per_si)) = parameter.sets {
            assert_eq!(number.default, (*field(&mut reference) * per_si) as f32, "{}", parameter.id);
            count += 1;
        }
    }
    assert_eq!(count, 4);
}

#[test]
fn numbers_read_both_ways() {
    for (parameter, number) in numbers() {
        let id = parameter.id;
        for step in 0..=200 {
            let value = number.min + (number.max - number.min) * step as f32 / 200.0;
            for unit in ["", number.unit] {
                let text = number.text(value);
                let back = number.parse(&format!("{text}{unit}")).unwrap_or_else(|| panic!("{id}: {text}"));
                assert!(
                    (back - value).abs() < 0.006 * (number.max - number.min),
                    "{id}: {text} read as {back}"
                );
                assert_eq!(number.text(back), text, "{id}");
            }
        }
        for nonsense in ["", "loud", "1e99", "nan", "1.2.3", "°", "%%"] {
            assert_eq!(number.parse(nonsense), None, "{id}: {nonsense}");
        }
        assert!(number.contains(number.default), "{id}");
    }
    let read = |id: &str, text: &str| find(id).unwrap().read(text);
    assert_eq!(read("full", "6,5 KPA"), Ok(Value::Number(6.5)));
    assert_eq!(read("gain", " -3 "), Ok(Value::Number(-3.0)));
    assert_eq!(read("temp", "20 °C"), Ok(Value::Number(20.0)));
    assert_eq!(read("noise", "30 %"), Ok(Value::Number(0.3)));
    let [full, noise] = [("full", 1), ("noise", 120)].map(|(id, n)| read(id, &n.to_string()).unwrap_err());
    assert_eq!(full, "full (Full breath) must lie in 2..20 kPa, got 1");
    assert_eq!(noise, "noise (Breath noise) must lie in 0..100 %, got 120");
    let Kind::Number(gain) = find("gain").unwrap().kind else { panic!("a number") };
    assert_eq!(gain.text(-0.04), "0.0", "no negative zero");
}

#[test]
fn switches_and_choices_read_both_ways() {
    for parameter in PARAMETERS {
        match parameter.kind {
            Kind::Switch(switch) => {
                for on in [true, false] {
                    assert_eq!(parameter.read(switch.text(on)), Ok(Value::Switch(on)), "{}", parameter.id);
                }
            }
            Kind::Choice(choice) => {
                for (at, (id, text)) in choice.all.iter().enumerate() {
                    for word in [id.to_string(), text.to_uppercase()] {
                        assert_eq!(parameter.read(&word), Ok(Value::Choice(at)), "{}", parameter.id);
                    }
                }
            }
            _ => continue,
        }
        assert!(parameter.read("perhaps").unwrap_err().contains(&parameter.range()), "{}", parameter.id);
    }
    assert_eq!(find("reedc").unwrap().read("on"), Ok(Value::Switch(true)));
}
