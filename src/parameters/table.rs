//! The parameters themselves, in the order of hosts. Groups, order and ids are fixed for ever; tests hold a frozen copy.

use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::event::SettingNumber;
use chalumeau_core::instrument::concert_pitch::A4_RANGE_HZ;
use chalumeau_core::instrument::player::Attack;
use chalumeau_core::instrument::player::response::ONSET;
use chalumeau_core::instrument::techniques::GrowlPitch;
use chalumeau_core::instrument::{Beyond, BreathResponse, ListeningMode, Split, Tuning};
use chalumeau_core::reed::law::{H_INIT, K_INIT};
use chalumeau_knob::device::{FIRST_CEILING_MNM, OFFERED_CEILING_MNM};
use chalumeau_knob::touch::study::TRIALS;

use crate::parameters::{Choice, InUse, Kind, Number, Parameter, Sets, Switch, Whole};

const BREATH: &str = "Breath";
const EMBOUCHURE: &str = "Embouchure";
const REED: &str = "Reed";
const TUNING: &str = "Tuning";
const NOISE: &str = "Noise";
const OUTPUT: &str = "Output";
const KNOB: &str = "Knob";
const INSTRUMENT: &str = "Instrument";
const PHYSICAL_REED: &str = "Reed, physical";
const LISTENING: &str = "Listening";
const ROOM: &str = "Room";
const EXPRESSION: &str = "Expression";
const TECHNIQUES: &str = "Techniques";
const PLAYERS: &str = "Players";
const MICROPHONE: &str = "Microphone";

/// Largest torque that plugin and page offer, mNm; the command line goes further after a second question.
const MOST_TORQUE_MNM: f32 = OFFERED_CEILING_MNM as f32;

/// Controllers that can drive H and k.
const REED_MIDI: &str = "CC1, CC16, CC17, CC74 or pressure, as *H from* and *k from* select";

const REED_SOURCES: &[(&str, &str)] = &[
    ("param", "Parameter"),
    ("cc1", "CC1 (wheel)"),
    ("cc16", "CC16"),
    ("cc17", "CC17"),
    ("cc74", "CC74 (MPE y)"),
    ("press", "Pressure (MPE z)"),
];

const fn entry(id: &'static str, group: &'static str, name: &'static str, kind: Kind) -> Parameter {
    Parameter {
        id,
        group,
        name,
        kind,
        meaning: "",
        sound: "",
        feel: "",
        sets: None,
        flag: "",
        midi: "",
        is_automatable: true,
        is_undoable: true,
        is_restored: true,
        in_use: InUse::Always,
    }
}

const fn number([min, max]: [f32; 2], default: f32, digits: usize, unit: &'static str) -> Kind {
    Kind::Number(Number { min, max, default, digits, unit, scale: 1.0 })
}

/// Part of 1, shown in percent.
const fn share([min, max]: [f32; 2], default: f32) -> Kind {
    Kind::Number(Number { min, max, default, digits: 1, unit: " %", scale: 100.0 })
}

/// 0 to 1, shown as 0 to 100 %.
const fn percent(default: f32) -> Kind {
    share([0.0, 1.0], default)
}

const fn whole([min, max]: [i32; 2], default: i32, unit: &'static str) -> Kind {
    Kind::Whole(Whole { min, max, default, unit })
}

/// The first is the default.
const fn choice(all: &'static [(&'static str, &'static str)]) -> Kind {
    choice_of(all, 0)
}

const fn choice_of(all: &'static [(&'static str, &'static str)], default: usize) -> Kind {
    Kind::Choice(Choice { all, default })
}

const fn switch(default: bool, [off, on]: [&'static str; 2]) -> Kind {
    Kind::Switch(Switch { default, on, off })
}

/// The choice at a place of the list; the first for a place that is not there.
fn nth<T: Copy, const N: usize>(at: usize, all: [T; N]) -> T {
    all[if at < N { at } else { 0 }]
}

const OFF: Kind = switch(false, ["Off", "On"]);

impl Parameter {
    const fn help(self, meaning: &'static str, sound: &'static str, feel: &'static str) -> Self {
        Self { meaning, sound, feel, ..self }
    }

    const fn sets(self, sets: Sets) -> Self {
        Self { sets: Some(sets), ..self }
    }

    const fn flag(self, flag: &'static str) -> Self {
        Self { flag, ..self }
    }

    const fn midi(self, midi: &'static str) -> Self {
        Self { midi, ..self }
    }

    /// A host cannot automate it.
    const fn setup(self) -> Self {
        Self { is_automatable: false, ..self }
    }

    /// It acts, arms or plays: undo and A/B leave it alone.
    const fn act(self) -> Self {
        Self { is_undoable: false, ..self }
    }

    /// A loaded state has it at its default.
    const fn never_restored(self) -> Self {
        Self { is_restored: false, ..self }
    }

    /// It has an effect only then.
    const fn only(self, in_use: InUse) -> Self {
        Self { in_use, ..self }
    }
}

/// All parameters, in the order in which hosts list them.
pub static PARAMETERS: &[Parameter] = &[
    entry("breath", BREATH, "Breath", percent(0.0))
        .help(
            "How hard the player blows, in percent",
            "Moving it sets the breath. Played: the dynamic, from where notes begin to fortissimo. Physical: the mouth pressure in percent of *Full breath*. The note starts at the threshold of the reed. More pressure is louder and brighter; then the reed beats, and at last it closes.",
            "",
        )
        .midi("CC2 (fine CC34), CC11 (fine CC43), channel pressure")
        .act(),
    entry("full", BREATH, "Full breath", number([2.0, 20.0], 6.0, 2, " kPa"))
        .help(
            "Mouth pressure at full breath, where the breath response is physical",
            "Sets how hard a controller or the knob blows at its end. A clarinettist plays between 2 and 6 kPa.",
            "Sets how far the knob's whole travel reaches into the note.",
        )
        .sets(Sets::Number(SettingNumber::BreathFullKpa))
        .flag("--breath-full"),
    entry("tongue", BREATH, "Tongue", number([1.0, 20.0], 2.0, 1, " ms"))
        .help(
            "Time in which the tongue releases a reed that is blown",
            "A short time gives a crisp attack, a long time a soft one.",
            "",
        )
        .sets(Sets::Number(SettingNumber::TongueMs))
        .flag("--tongue-ms"),
    entry("legato", BREATH, "Legato", number([5.0, 15.0], 8.0, 1, " ms"))
        .help(
            "Time in which the fingers move between slurred notes",
            "Holes open and close over this time. In a long slur the notes between speak as well. Where the breath response is Played, slurs up into a higher register take half of this time, and slurs down over the break three to four times as long; leaps of more than an octave into the low chalumeau take just this time.",
            "The torque changes from one note's curve to the next note's.",
        )
        .sets(Sets::Number(SettingNumber::LegatoMs))
        .flag("--legato-ms"),
    entry("resp", BREATH, "Breath response", choice(&[("play", "Played"), ("phys", "Physical")]))
        .help(
            "What a breath source sets",
            "Played: the breath sets the loudness, in even steps, and every note begins at a breath of 4 of 127; the lip moves as a player's does. Physical: the breath sets the mouth pressure, in a straight line, and the lip does not move. Projects from before this choice are physical.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.breath_response = nth(at, BreathResponse::ALL)))
        .flag("--breath-response"),
    entry("bcurve", BREATH, "Breath curve", number([0.5, 2.0], 1.0, 2, ""))
        .help(
            "Curve from a controller's breath to the dynamic, with the breath response *Played*",
            "Above 1, soft notes get more of the controller's range; below 1, loud notes do. It does not change the velocity of keys.",
            "",
        )
        .sets(Sets::Number(SettingNumber::BreathCurve))
        .flag("--breath-curve"),
    entry("bsoft", BREATH, "Softest breath", share([0.0, 0.5], ONSET as f32))
        .help(
            "Breath at which notes begin, where the breath response is played",
            "Set it to what your controller sends when you blow as softly as you can. *Calibrate* does so.",
            "",
        )
        .sets(Sets::Number(SettingNumber::BreathSoftest))
        .flag("--breath-softest"),
    entry("bloud", BREATH, "Loudest breath", share([0.1, 1.0], 1.0))
        .help(
            "Breath that plays fortissimo, where the breath response is played",
            "Set it to what your controller sends when you blow as hard as you like to. *Calibrate* does so.",
            "",
        )
        .sets(Sets::Number(SettingNumber::BreathLoudest))
        .flag("--breath-loudest"),
    entry(
        "bfrom",
        BREATH,
        "Breath from",
        choice(&[("any", "Any"), ("cc2", "CC2"), ("cc11", "CC11"), ("press", "Pressure"), ("keys", "Keys")]),
    )
    .help(
        "Which source sets the breath",
        "Any: whichever moves; CC2 overrides CC11, and CC11 overrides channel pressure. Pressure under a held key adds to its velocity; with Pressure it sets the breath. Keys: the velocity, whatever controllers do. Automation of *Breath*, note expressions, linked controllers and the knob set the breath in any case.",
        "",
    ),
    entry("bdead", BREATH, "Breath deadband", share([0.0, 0.1], 0.0))
        .help(
            "Width of the band of breath within which a restless controller moves nothing",
            "Widen it if a held note trembles although you blow steadily.",
            "",
        )
        .sets(Sets::Number(SettingNumber::BreathDeadband))
        .flag("--breath-deadband"),
    entry("stren", EMBOUCHURE, "Reed strength", number([1.5, 5.0], 2.5, 2, ""))
        .help(
            "Reed strength as printed on the box; 2.5 closes at 6 kPa",
            "A stiffer reed needs more breath and beats later. Half a number is about 20 % more stiffness.",
            "The threshold and the closure move outwards.",
        )
        .sets(Sets::Number(SettingNumber::Strength))
        .flag("--strength"),
    entry("lip", EMBOUCHURE, "Lip opening", number([0.6, 1.4], 1.0, 3, " x"))
        .help(
            "Opening of the reed's tip under the lip, relative to the reference",
            "Below 1 the player bites: less air, a thinner sound, and the reed closes early. Above 1 the sound is open and loud.",
            "Changes the torque, and how far away the closure is.",
        )
        .sets(Sets::Number(SettingNumber::Lip))
        .flag("--lip"),
    entry("zeta", EMBOUCHURE, "Embouchure", number([0.05, 0.9], 0.3, 3, ""))
        .help(
            "Embouchure parameter \u{3b6}: strength of the flow through the reed",
            "At higher values notes speak earlier, beat earlier and sound brighter.",
            "At higher values the threshold is nearer.",
        )
        .sets(Sets::Number(SettingNumber::Zeta))
        .flag("--zeta"),
    entry("damp", EMBOUCHURE, "Lip damping", number([0.2, 2.0], 1.0, 2, " x"))
        .help(
            "Damping of the reed by the lip, relative to a normal embouchure",
            "At low values the reed squeaks. At high values the sound is dark and the reed does not squeak easily. Between written C6 and E flat 6 its effect fades: a damped reed cannot hold higher notes.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Damping))
        .flag("--damping"),
    entry("reedh", REED, "Reed H", number([1.0, 5.0], H_INIT as f32, 4, ""))
        .help(
            "H: opening of the reed at rest, dimensionless; the reference is \u{221a}27/2",
            "A wider opening gives more flow. While k is coupled to H, the peak of the flow stays the same and the reed closes earlier.",
            "Changes height and width of the torque curve, which is the same curve as the flow's.",
        )
        .sets(Sets::Number(SettingNumber::ReedH))
        .flag("--H")
        .midi(REED_MIDI),
    entry("reedk", REED, "Reed k", number([0.1, 2.0], K_INIT as f32, 4, ""))
        .help(
            "k: stiffness of the reed, dimensionless; the reference is 27/(4H\u{b3})",
            "A stiffer reed closes later, at H\u{b7}k. Has no effect while k is coupled to H.",
            "Moves the end of the torque curve.",
        )
        .sets(Sets::Number(SettingNumber::ReedK))
        .flag("--k")
        .midi(REED_MIDI),
    entry("reedc", REED, "Reed coupled", switch(true, ["Free", "Coupled"]))
        .help(
            "Whether k follows H as 27/(4H\u{b3})",
            "Coupled: the largest flow stays at A. Free: H and k are set separately.",
            "The torque curve changes as the sound does.",
        )
        .sets(Sets::Switch(|settings| &mut settings.coupled)),
    entry("reeda", REED, "Reed A", number([0.0, 2.0], 1.0, 3, ""))
        .help(
            "A: amplitude of the flow",
            "Scales the flow, and with it what a note needs to speak.",
            "Scales the torque.",
        )
        .sets(Sets::Number(SettingNumber::ReedA))
        .flag("--A"),
    entry("lay", REED, "Facing", number([0.0, 0.5], 0.4, 3, ""))
        .help(
            "Curve of the mouthpiece's facing (its lay), on which the reed closes",
            "At 0 the reed closes all at once and sounds bright. At higher values it rolls onto the facing and sounds softer.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Lay))
        .flag("--lay"),
    entry("a4", TUNING, "A4", number([A4_RANGE_HZ.0 as f32, A4_RANGE_HZ.1 as f32], 440.0, 1, " Hz"))
        .help("Pitch of A4", "Tunes the whole instrument by changing its length.", "")
        .sets(Sets::Number(SettingNumber::A4Hz))
        .flag("--a4"),
    entry(
        "tune",
        TUNING,
        "Tuning",
        choice_of(&[("nat", "Natural"), ("temp", "Tempered")], 1),
    )
        .help(
            "How notes are held in tune",
            "Natural: in tune at mezzo-forte; the pitch moves with the breath, as in a real bore. Tempered: in tune at every breath. Where the breath response is Played, the player also corrects what another reed, embouchure or lip does to the pitch. Where it is Physical, nobody corrects this, and notes are up to some 20 cents off.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.tuning = nth(at, Tuning::ALL)))
        .flag("--tempered"),
    entry("temp", TUNING, "Temperature", number([10.0, 40.0], 25.0, 1, " \u{b0}C"))
        .help(
            "Temperature of the air",
            "Sound travels faster in warm air: the pitch rises by 3 cents per degree.",
            "",
        )
        .sets(Sets::Number(SettingNumber::TemperatureC))
        .flag("--temperature"),
    entry("vent", TUNING, "Vent loss", number([0.0, 4.0], 2.0, 2, ""))
        .help(
            "Loss of the air jets in open holes",
            "At 0 there is no loss, and most of the clarion register does not speak: the register key needs this loss to work.",
            "",
        )
        .sets(Sets::Number(SettingNumber::VentLoss))
        .flag("--vent-loss"),
    entry("transp", TUNING, "Transpose", whole([-24, 24], 0, " st"))
        .help(
            "Semitones from the key to the note that sounds",
            "With -2 a B flat clarinet plays what its player reads: written C sounds B flat.",
            "",
        )
        .sets(Sets::Whole(|settings| &mut settings.reach.transpose)),
    entry("beyond", TUNING, "Beyond the range", choice(&[("silent", "Silent"), ("octave", "Nearest octave")]))
        .help(
            "What keys below, above and between the notes of the instrument play",
            "Silent: nothing. Nearest octave: the same note in the nearest octave that the instrument has.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.reach.beyond = nth(at, Beyond::ALL))),
    entry("noise", NOISE, "Breath noise", percent(0.3))
        .help("Noise of the breath in the reed channel", "Adds the sound of air.", "")
        .sets(Sets::Number(SettingNumber::Noise))
        .flag("--noise"),
    entry("gain", OUTPUT, "Gain", number([-60.0, 24.0], -2.5, 1, " dB"))
        .help("Output level", "At 0 dB, 1 Pa at a distance of 1 m is -6 dBFS.", "")
        .sets(Sets::Number(SettingNumber::GainDb))
        .flag("--gain-db"),
    entry("panic", OUTPUT, "Panic", OFF)
        .help(
            "Ends all notes at once",
            "All notes stop, and the keys set the breath again; a room rings on. As a parameter it acts when it is switched on, and is Off again.",
            "",
        )
        .midi("CC120")
        .act()
        .never_restored(),
    entry(
        "knob",
        KNOB,
        "Knob",
        choice(&[("off", "Off"), ("serial", "Serial"), ("midi", "MIDI port"), ("osc", "OSC (stock firmware)")]),
    )
    .help(
        "Kind of knob",
        "Serial and MIDI port: each note has its own feel. OSC: the knob plays, but the plugin cannot change its feel.",
        "",
    )
    .setup()
    .act(),
    entry("arm", KNOB, "Arm knob", OFF)
        .help(
            "Lets the knob make torque",
            "It is off when a project is loaded, beside no connected knob, and after anything that disarms the knob: a pulled plug, a fault, silence on the line. Then switch it on again.",
            "",
        )
        .setup()
        .act()
        .never_restored()
        .only(InUse::WithKnob),
    entry("ceil", KNOB, "Torque ceiling", number([10.0, MOST_TORQUE_MNM], FIRST_CEILING_MNM as f32, 0, " mNm"))
        .help(
            "Largest torque that you allow",
            "The knob never makes more. 100 is gentle, and 250 is the most you can ask for. A higher value takes effect at the next arming, a lower value at once.",
            "",
        )
        .flag("--ceiling")
        .setup()
        .act()
        .only(InUse::WithKnob),
    entry("takeov", KNOB, "Take over knob", OFF)
        .help(
            "Takes the knob from the instance that has it",
            "The other instance lets go of it, and the knob is disarmed. The switch is then Off again.",
            "",
        )
        .setup()
        .act()
        .never_restored()
        .only(InUse::WithKnob),
    entry("rest", KNOB, "Rest here", OFF)
        .help(
            "Makes the knob's present angle its rest",
            "This angle then means no breath. Let go of the knob, then press. The switch is then Off again.",
            "",
        )
        .setup()
        .act()
        .never_restored()
        .only(InUse::WithKnob),
    entry("blow", KNOB, "Blow hard here", OFF)
        .help(
            "Learns how far you turn the knob for full breath",
            "Press, then turn the knob within three seconds as far as you want to blow. The travel from rest to there then means full breath. The switch is then Off again.",
            "",
        )
        .setup()
        .act()
        .never_restored()
        .only(InUse::WithKnob),
    entry("law", KNOB, "Feel", choice(&[("flow", "Flow"), ("press", "Pressure"), ("free", "Free")]))
        .help(
            "Law of the torque",
            "",
            "Flow: the reed's own curve, which rises to the threshold, with a mark there, and falls to closure. Pressure: a spring with a step at the threshold. Free: no torque.",
        )
        .flag("--law")
        .setup(),
    entry("contr", KNOB, "Feel contrast", number([1.0, 5.0], 3.0, 2, " x"))
        .help(
            "Exaggerates how the torque differs between notes",
            "Does not change the sound.",
            "A hand tells two torques apart if they differ by about 13 %. At 1, which is what the bore needs, it tells only the hardest notes from the easiest. At 3 and 5 it tells about half of all pairs of notes apart, mostly across the break. Below A6 it never tells neighbouring semitones of one register apart.",
        )
        .flag("--contrast")
        .setup(),
    entry(
        "order",
        KNOB,
        "Feel order",
        choice(&[("phys", "Physical"), ("cover", "Covered holes"), ("open", "Open holes")]),
    )
    .help(
        "What makes one note harder than another",
        "Does not change the sound.",
        "Physical: the pressure that the bore needs. Covered holes: more covered holes are harder. Open holes: more covered holes are easier.",
    )
    .flag("--order")
    .setup(),
    entry("refnot", KNOB, "Feel reference", whole([52, 97], 72, ""))
        .help(
            "Written note that feels the same at every contrast, as a MIDI number",
            "",
            "Contrast and place move the other notes away from this one.",
        )
        .flag("--reference")
        .setup(),
    entry("torque", KNOB, "Feel torque", number([0.0, MOST_TORQUE_MNM], 55.0, 0, " mNm"))
        .help("Torque of the reference note", "", "Sets how strong everything feels.")
        .flag("--torque")
        .setup(),
    entry("kdamp", KNOB, "Feel damping", number([0.0, 20.0], 1.0, 2, " mNm s"))
        .help(
            "Damping added to the knob's own, per radian",
            "",
            "The knob turns as if in a thick liquid.",
        )
        .setup(),
    entry("kfric", KNOB, "Feel friction", number([0.0, 20.0], 1.0, 1, " mNm"))
        .help("Friction", "", "Holds the knob where you let go of it.")
        .setup(),
    entry("detent", KNOB, "Feel step", number([0.0, 30.0], 6.0, 1, " mNm"))
        .help(
            "Height of the step at the threshold, under the pressure law",
            "",
            "You feel a step where the note speaks. *Feel mark* is its counterpart under the flow law.",
        )
        .flag("--detent")
        .setup(),
    entry("curve", KNOB, "Knob curve", number([0.25, 4.0], 1.0, 2, ""))
        .help(
            "Exponent of the travel from rest to full breath",
            "Only for a knob on OSC. Values above 1 give soft breath more of the travel.",
            "",
        )
        .setup()
        .only(InUse::WithKnob),
    entry("oscprt", KNOB, "OSC port", whole([1_024, 65_535], 8_000, ""))
        .help("UDP port that stock firmware sends to", "Stock firmware is set to 8000.", "")
        .setup()
        .act()
        .only(InUse::WithOscKnob),
    entry("oscany", KNOB, "OSC from network", OFF)
        .help(
            "Whether OSC from other machines is accepted",
            "While it is off, only this machine is heard.",
            "",
        )
        .setup()
        .act()
        .only(InUse::WithOscKnob),
    entry("oscfl", KNOB, "Feel OSC port", whole([0, 65_535], 0, ""))
        .help(
            "UDP port on this machine that the feel is sent to, as OSC",
            "For other programs that make torque, such as the bridge to libmapper. Nothing is sent while Arm knob is off. 0 sends nothing.",
            "",
        )
        .setup()
        .act()
        .only(InUse::WithKnob),
    entry("rec", KNOB, "Record take", OFF)
        .help(
            "Records what the knob does in a file",
            "The recording replays to the same sample. Without a knob it is off.",
            "",
        )
        .setup()
        .act()
        .never_restored()
        .only(InUse::WithKnob),
    entry("replay", KNOB, "Replay take", OFF)
        .help(
            "Plays the recorded take instead of the knob",
            "Starts when it is switched on, or when the host starts again.",
            "",
        )
        .flag("--replay")
        .setup()
        .act(),
    entry("study", KNOB, "Study", OFF)
        .help("Takes H and k from the trial of a study", "See docs/study.md.", "")
        .setup()
        .act(),
    entry("part", KNOB, "Participant", whole([1, 9_999], 1, ""))
        .help("Number of the participant", "", "")
        .setup()
        .act()
        .only(InUse::InStudy),
    entry("seed", KNOB, "Study seed", whole([1, 9_999], 1, ""))
        .help("Random seed of the study", "Participant and seed fix the order of the trials.", "")
        .setup()
        .act()
        .only(InUse::InStudy),
    entry("trial", KNOB, "Trial", whole([1, TRIALS as i32], 1, ""))
        .help("Number of the trial", "", "")
        .setup()
        .act()
        .only(InUse::InStudy),
    entry("side", KNOB, "Study side", switch(false, ["A", "B"])).help("Side A or B of the trial", "", "").act(),
    entry("hsrc", KNOB, "H from", choice(REED_SOURCES))
        .help("What drives H", "A controller opens the reed, in the sound and under the hand. Its stiffness k stays.", "")
        .setup(),
    entry("ksrc", KNOB, "k from", choice(REED_SOURCES))
        .help("What drives k", "A controller stiffens the reed. Meanwhile k is not coupled to H.", "")
        .setup(),
    entry("kstat", KNOB, "Knob status", Kind::Status("off"))
        .help("State of the link to the knob", "", "")
        .setup()
        .act()
        .never_restored(),
    entry("place", KNOB, "Feel place", number([1.0, 5.0], 1.0, 2, " x"))
        .help(
            "Exaggerates how the angle at which notes speak differs between notes",
            "A new note keeps the pressure of a hand that does not move.",
            "1 is what the bore needs. Above 1 hard notes speak farther from rest, so the hand has to follow the notes.",
        )
        .flag("--place")
        .setup(),
    entry("mark", KNOB, "Feel mark", number([0.0, 12.0], 9.0, 1, " mNm"))
        .help(
            "Height of the mark at the threshold, under the flow law",
            "",
            "A mark where the note speaks. Without it the torque there is so flat that a hand cannot find the place.",
        )
        .flag("--detent")
        .setup(),
    entry(
        "instr",
        INSTRUMENT,
        "Instrument",
        choice(&[
            ("bflat", "B flat clarinet"),
            ("a", "A clarinet"),
            ("eflat", "E flat clarinet"),
            ("c", "C clarinet"),
            ("bass", "Bass clarinet"),
            ("user", "User file"),
        ]),
    )
    .help(
        "Which clarinet",
        "Each has its own bore, holes, fingerings and reed. The old one fades over to the new one when that is ready.",
        "",
    )
    .flag("--instrument")
    .setup()
    .act(),
    entry("qual", INSTRUMENT, "Offline quality", choice(&[("live", "Same as live"), ("high", "High")]))
        .help(
            "How finely the host's offline mode renders",
            "High computes at twice the rate and in double precision. A bounce then takes longer.",
            "",
        )
        .flag("--quality")
        .setup(),
    entry("bendr", INSTRUMENT, "Bend range", whole([0, 48], 2, " st"))
        .help("How far the pitch wheel bends", "A range set over MIDI takes precedence.", "")
        .midi("RPN 0")
        .setup(),
    entry("istat", INSTRUMENT, "Instrument status", Kind::Status("not playing"))
        .help("State of the instrument", "", "")
        .setup()
        .act()
        .never_restored(),
    entry("rface", PHYSICAL_REED, "Reed description", choice(&[("seed", "Dimensionless"), ("phys", "Measured")]))
        .help(
            "How the reed is given: as dimensionless H, k and zeta, or as a maker measures it",
            "Both describe the same reed. The values that are shown are in use.",
            "The torque curve changes as the sound does.",
        )
        .sets(Sets::ReedDescription)
        .setup(),
    entry("rstiff", PHYSICAL_REED, "Reed stiffness", number([300.0, 6_000.0], 1_218.057_3, 1, " N/m"))
        .help(
            "Stiffness K of the reed",
            "A stiffer reed closes later: the closing pressure is K times the opening over the area.",
            "The threshold and the closure move outwards.",
        )
        .sets(Sets::Reed(|reed| &mut reed.stiffness_n_m, 1.0))
        .flag("--reed-stiffness"),
    entry("rarea", PHYSICAL_REED, "Reed area", number([40.0, 250.0], 101.504_77, 2, " mm\u{b2}"))
        .help(
            "Area of the reed that the breath presses on",
            "A larger area closes earlier.",
            "The threshold and the closure move inwards.",
        )
        .sets(Sets::Reed(|reed| &mut reed.area_m2, 1e6))
        .flag("--reed-area"),
    entry("rwidth", PHYSICAL_REED, "Reed width", number([3.0, 40.0], 15.213_75, 2, " mm"))
        .help(
            "Width w of the channel, tip and side slits together",
            "A wider channel lets more air flow: notes speak and beat earlier and sound brighter.",
            "A wider channel gives more torque.",
        )
        .sets(Sets::Reed(|reed| &mut reed.width_m, 1e3))
        .flag("--reed-width"),
    entry("ropen", PHYSICAL_REED, "Reed opening", number([0.2, 0.95], 0.5, 3, " mm"))
        .help(
            "Opening at the tip of the reed, at rest under the lip",
            "A wider opening lets more air flow, and the reed closes later.",
            "A wider opening gives more torque and a farther closure.",
        )
        .sets(Sets::Reed(|reed| &mut reed.tip_opening_m, 1e3))
        .flag("--reed-opening"),
    entry(
        "heard",
        LISTENING,
        "Heard from",
        choice(&[("all", "Everywhere"), ("place", "Position"), ("point", "One point")]),
    )
    .help(
        "Where the instrument is heard from",
        "Bell and open holes each send out sound. Everywhere is the mean over all directions, the same in both channels. Position is one place or two. One point is as if all sound came from one hole: above 1 kHz too soft.",
        "",
    )
    .sets(Sets::Choice(|settings, at| settings.listening.mode = nth(at, ListeningMode::ALL))),
    entry("ldist", LISTENING, "Listening distance", number([0.2, 10.0], 1.0, 2, " m"))
        .help(
            "Distance from the middle of the instrument, for Position",
            "From near, the holes next to the listener are louder. The level as a whole stays.",
            "",
        )
        .sets(Sets::Number(SettingNumber::ListeningDistanceM))
        .flag("--listening-distance"),
    entry("langle", LISTENING, "Listening angle", number([-180.0, 180.0], 30.0, 0, " \u{b0}"))
        .help(
            "Angle around the player, for Position: 0 in front, 90 at the player's right",
            "In front of the bell the sound is brighter than beside or behind it.",
            "",
        )
        .sets(Sets::Number(SettingNumber::ListeningAngleDeg))
        .flag("--listening-angle"),
    entry("lheigh", LISTENING, "Listening height", number([-1.0, 2.0], 0.0, 2, " m"))
        .help(
            "Height above the middle of the instrument, for Position",
            "Low places are in front of the bell, high ones in front of the holes.",
            "",
        )
        .sets(Sets::Number(SettingNumber::ListeningHeightM))
        .flag("--listening-height"),
    entry("lwidth", LISTENING, "Listening width", number([0.0, 180.0], 60.0, 0, " \u{b0}"))
        .help(
            "Angle between the left and the right place, as the player sees them, for Position",
            "Wider is more spacious. At 0 both channels are the same, and so is a render in mono, which hears the place between.",
            "",
        )
        .sets(Sets::Number(SettingNumber::ListeningWidthDeg))
        .flag("--listening-width"),
    entry("room", ROOM, "Room", percent(0.0))
        .help(
            "How much of a room is heard around the instrument, in stereo",
            "At 0 the sound is dry. 20 to 50 % is a near microphone, 100 % a seat in the room.",
            "",
        )
        .sets(Sets::Number(SettingNumber::RoomAmount))
        .flag("--room"),
    entry("rsize", ROOM, "Room size", number([3.0, 40.0], 12.0, 1, " m"))
        .help(
            "Length of the room; width and height follow",
            "A small room answers at once, a large one later.",
            "",
        )
        .sets(Sets::Number(SettingNumber::RoomSizeM))
        .flag("--room-size"),
    entry("rdecay", ROOM, "Room decay", number([0.2, 4.0], 1.2, 2, " s"))
        .help(
            "Time in which the room's sound falls by 60 dB",
            "A living room has half a second, a concert hall two, a church four.",
            "",
        )
        .sets(Sets::Number(SettingNumber::RoomDecayS))
        .flag("--room-decay"),
    entry("rtone", ROOM, "Room tone", percent(0.5))
        .help(
            "From a dark room, where high tones die away sooner than low ones, to a bright one",
            "Low is dark, as with curtains and people. High is bright, as with bare stone.",
            "",
        )
        .sets(Sets::Number(SettingNumber::RoomTone))
        .flag("--room-tone"),
    entry("life", EXPRESSION, "Life", percent(1.0))
        .help(
            "How much a held note wanders, as breath, lip and fingers of a player do",
            "At 100 % pitch, level and colour move as in recordings of held notes. At 0 the note stands still.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Life))
        .flag("--life"),
    entry("vib", EXPRESSION, "Vibrato", percent(0.0))
        .help(
            "Depth of the vibrato",
            "Lip and breath swing together, at 100 % by 25 cents and 3 dB either way. The mod wheel adds to it.",
            "",
        )
        .sets(Sets::Number(SettingNumber::VibratoDepth))
        .flag("--vibrato")
        .midi("CC1, as *Mod wheel* selects"),
    entry("vibhz", EXPRESSION, "Vibrato rate", number([3.0, 8.0], 5.2, 2, " Hz"))
        .help("Swings a second", "4 is slow, 5 to 6 usual, 7 nervous.", "")
        .sets(Sets::Number(SettingNumber::VibratoRateHz))
        .flag("--vibrato-rate"),
    entry("vibon", EXPRESSION, "Vibrato onset", number([0.0, 2.0], 0.4, 2, " s"))
        .help(
            "Time after the beginning of a tongued note until the vibrato has its depth",
            "A long onset leaves short notes straight.",
            "",
        )
        .sets(Sets::Number(SettingNumber::VibratoOnsetS))
        .flag("--vibrato-onset"),
    entry("vibun", EXPRESSION, "Vibrato unevenness", percent(0.3))
        .help(
            "How much one swing differs from the next",
            "At 0 the vibrato is a machine's.",
            "",
        )
        .sets(Sets::Number(SettingNumber::VibratoUnevenness))
        .flag("--vibrato-unevenness"),
    entry(
        "attack",
        EXPRESSION,
        "Attack",
        choice_of(&[("soft", "Soft"), ("normal", "Normal"), ("hard", "Hard")], 1),
    )
    .help(
        "How breath and lip begin a note",
        "Soft: the partials come one after another, the high ones last. Normal: as the tongue lets go. Hard: with an accent.",
        "",
    )
    .sets(Sets::Choice(|settings, at| settings.attack = nth(at, Attack::ALL))),
    entry("gliss", EXPRESSION, "Glissando", number([0.0, 3.0], 0.0, 2, " s"))
        .help(
            "Time that a slur slides from note to note; at 0 the fingers move at once",
            "The fingers slide off the holes one after another, and across the break the vocal tract sets the pitch.",
            "",
        )
        .sets(Sets::Number(SettingNumber::GlissandoS))
        .flag("--glissando"),
    entry(
        "wheel",
        EXPRESSION,
        "Mod wheel",
        choice(&[
            ("vib", "Vibrato"),
            ("growl", "Growl"),
            ("flut", "Flutter"),
            ("subt", "Subtone"),
            ("none", "Nothing"),
        ]),
    )
    .help(
        "What the mod wheel (CC1) does",
        "It does nothing else while *H from* or *k from* is CC1. Projects from before vibrato have Nothing.",
        "",
    )
    .setup(),
    entry("scoop", EXPRESSION, "Scoop", number([0.0, 300.0], 0.0, 0, " cents"))
        .help(
            "How far below its pitch a tongued note begins",
            "The note rises to its pitch, as in jazz. A slurred note has none.",
            "",
        )
        .sets(Sets::Number(SettingNumber::ScoopCents))
        .flag("--scoop"),
    entry("scoops", EXPRESSION, "Scoop time", number([0.02, 1.0], 0.15, 2, " s"))
        .help("Time from the beginning of a note until it has its pitch, while *Scoop* is on", "", "")
        .sets(Sets::Number(SettingNumber::ScoopS))
        .flag("--scoop-time"),
    entry("fall", EXPRESSION, "Fall", number([0.0, 1_200.0], 0.0, 0, " cents"))
        .help(
            "How far the pitch falls when the last key comes up; at 0 the note ends at once",
            "The note goes on while it falls, and fades.",
            "",
        )
        .sets(Sets::Number(SettingNumber::FallCents))
        .flag("--fall"),
    entry("falls", EXPRESSION, "Fall time", number([0.05, 2.0], 0.4, 2, " s"))
        .help("Time in which a note falls and fades, while *Fall* is on", "", "")
        .sets(Sets::Number(SettingNumber::FallS))
        .flag("--fall-time"),
    entry("bin", EXPRESSION, "Breath in", percent(0.0))
        .help(
            "How loud the player breathes in after a phrase",
            "A quarter of a second after the last note, air rushes in at the mouth. At 100 % it is 40 dB below a mezzo-forte.",
            "",
        )
        .sets(Sets::Number(SettingNumber::BreathIn))
        .flag("--breath-in"),
    entry("ksound", EXPRESSION, "Key sounds", percent(0.0))
        .help(
            "How loud pads and fingers are",
            "Each moves air at its hole, and the bore answers with a pop, with and without breath. At 100 % the loudest is 37 dB below a mezzo-forte.",
            "",
        )
        .sets(Sets::Number(SettingNumber::KeySounds))
        .flag("--key-sounds"),
    entry("slap", EXPRESSION, "Slap", percent(0.0))
        .help(
            "How hard the tongue slaps the reed at the beginning of a note, times the velocity",
            "The tongue sucks at the reed and lets it slam: a pop with the pitch of the fingering, also without breath. Slurred notes have none.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Slap))
        .flag("--slap"),
    entry("altf", EXPRESSION, "Alternate fingerings", switch(false, ["Chart", "By context"]))
        .help(
            "Whether slurs by a semitone or a tone take the fingering that moves the fewest fingers",
            "As in chromatic runs and trills. An alternate fingering is within 15 cents of the chart's, and corrected.",
            "",
        )
        .sets(Sets::Switch(|settings| &mut settings.alternates)),
    entry("keysw", EXPRESSION, "Key switches", choice(&[("off", "Off"), ("c1", "C1 to E1"), ("c2", "C2 to E2")]))
        .help(
            "Five keys that make no sound and choose the fingerings of the notes that follow",
            "From the lowest: chart, 1st, 2nd, 3rd alternate, by context. A choice stays until the next. C1 is MIDI key 24, C2 is 36.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.reach.key_switches = nth(at, KeySwitches::ALL)))
        .setup(),
    entry("growl", TECHNIQUES, "Growl", percent(0.0))
        .help(
            "How much the player sings into the instrument",
            "The voice's pulses in the mouth make the tone rough, with sums and differences of both pitches.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Growl))
        .flag("--growl")
        .midi("CC18"),
    entry("growlp", TECHNIQUES, "Growl pitch", choice(&[("int", "Follows the note"), ("fixed", "Fixed")]))
        .help(
            "What the voice sings",
            "Follows the note: an interval to it, *Growl interval*. Fixed: *Growl frequency*.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.techniques.growl_pitch = nth(at, GrowlPitch::ALL))),
    entry("growli", TECHNIQUES, "Growl interval", number([-24.0, 12.0], -12.0, 1, " st"))
        .help(
            "Interval of the voice from the note",
            "An octave below is rough and in tune; a fifth or a third makes chords.",
            "",
        )
        .sets(Sets::Number(SettingNumber::GrowlSemitones))
        .flag("--growl-interval"),
    entry("growlf", TECHNIQUES, "Growl frequency", number([60.0, 400.0], 110.0, 0, " Hz"))
        .help("Pitch of the voice, where it is fixed", "", "")
        .sets(Sets::Number(SettingNumber::GrowlHz))
        .flag("--growl-frequency"),
    entry("flut", TECHNIQUES, "Flutter", percent(0.0))
        .help(
            "How far the rolling tongue blocks the air",
            "The note trembles, as with a rolled R.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Flutter))
        .flag("--flutter")
        .midi("CC19"),
    entry("fluthz", TECHNIQUES, "Flutter rate", number([15.0, 35.0], 25.0, 1, " Hz"))
        .help("Strokes of the tongue a second", "Players reach 20 to 30.", "")
        .sets(Sets::Number(SettingNumber::FlutterHz))
        .flag("--flutter-rate"),
    entry("subt", TECHNIQUES, "Subtone", percent(0.0))
        .help(
            "How much the lower lip covers and damps the reed",
            "Low notes lose their high partials and become soft and round.",
            "",
        )
        .sets(Sets::Number(SettingNumber::Subtone))
        .flag("--subtone")
        .midi("CC20"),
    entry("tract", TECHNIQUES, "Vocal tract", percent(0.0))
        .help(
            "How strongly the player tunes the vocal tract: from an open throat to a tuned one",
            "The further it is tuned, the more it pulls the note to its own resonance, which *Tract interval* sets: bends, scoops, throat colour.",
            "",
        )
        .sets(Sets::Number(SettingNumber::TractAmount))
        .flag("--tract"),
    entry("tractp", TECHNIQUES, "Tract interval", number([-24.0, 24.0], 0.0, 1, " st"))
        .help(
            "Where the vocal tract resonates, from the note",
            "Move it down from 0 while a clarion note sounds, and the pitch follows, by an octave and more.",
            "",
        )
        .sets(Sets::Number(SettingNumber::TractIntervalSemitones))
        .flag("--tract-interval"),
    entry("player", PLAYERS, "Players", whole([1, 16], 1, ""))
        .help(
            "How many players play the instrument",
            "Each has a wander, a tuning and a seat of its own, and in unison its own moment. The output stays about as loud when all play. Eight cost some five times as much as one.",
            "",
        )
        .sets(Sets::Whole(|settings| &mut settings.players.count))
        .flag("--players"),
    entry("split", PLAYERS, "Split", choice(&[("chords", "Chords"), ("unison", "Unison")]))
        .help(
            "What several players do with the notes",
            "Chords: keys that are held together are played by different players. Unison: all play every note.",
            "",
        )
        .sets(Sets::Choice(|settings, at| settings.players.split = nth(at, Split::ALL))),
    entry("spread", PLAYERS, "Tuning spread", number([0.0, 25.0], 6.0, 1, " cents"))
        .help(
            "How far the players are out of tune with the first, at most, either way",
            "They beat with each other; more is a street band.",
            "",
        )
        .sets(Sets::Number(SettingNumber::PlayersSpreadCents))
        .flag("--spread"),
    entry("late", PLAYERS, "Onset spread", number([0.0, 60.0], 25.0, 1, " ms"))
        .help(
            "In unison: how much later than the first player the others begin their notes, at most",
            "Each note differs. At 0, all begin at the same moment, with an accent that no section has.",
            "",
        )
        .sets(Sets::Number(SettingNumber::PlayersOnsetSpreadMs))
        .flag("--onset-spread"),
    entry("seats", PLAYERS, "Seats", percent(0.7))
        .help(
            "How far apart the players sit, on two channels",
            "At 0 all sit in the middle, at 100 % from side to side.",
            "",
        )
        .sets(Sets::Number(SettingNumber::PlayersWidth))
        .flag("--seats"),
    entry("mic", MICROPHONE, "Microphone", OFF)
        .help(
            "Whether wind at a microphone sets the breath: the side-chain of the CLAP, the input of *Chalumeau (microphone)* (VST3), or that of the program",
            "Blow at the microphone while you hold keys. Speech, singing, music and the room do not. Meanwhile, no other source sets the breath but the knob. An input that nothing is connected to changes nothing.",
            "",
        )
        .setup()
        .act(),
    entry("miccal", MICROPHONE, "Calibrate microphone", OFF)
        .help(
            "Measures the room for two seconds, for *Microphone*",
            "Keep quiet until it has been. Wind must be 12 dB louder than the room. The project keeps the level.",
            "",
        )
        .setup()
        .act()
        .never_restored(),
];
