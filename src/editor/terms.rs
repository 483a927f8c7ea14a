//! What every parameter is called, what it does to the sound, and what the hand feels of it. For tool tips that teach.

/// One parameter explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Term {
    /// Stable id.
    pub id: &'static str,
    /// The word, in full.
    pub word: &'static str,
    /// What it does to the sound, or in the plugin.
    pub sound: &'static str,
    /// What the hand feels of it; empty where nothing.
    pub feel: &'static str,
    /// Part of a setting: goes with undo and A/B. What acts, arms or plays does not.
    pub is_setting: bool,
}

const fn term(id: &'static str, word: &'static str, sound: &'static str, feel: &'static str) -> Term {
    Term { id, word, sound, feel, is_setting: true }
}

const fn act(id: &'static str, word: &'static str, sound: &'static str) -> Term {
    Term { id, word, sound, feel: "", is_setting: false }
}

/// All of them.
pub const TERMS: &[Term] = &[
    act(
        "breath",
        "Mouth pressure, percent of full breath",
        "Blows. From the threshold on the reed sounds; harder is louder and brighter, then the reed beats, then closes.",
    ),
    term(
        "full",
        "Mouth pressure at full breath, kPa",
        "How hard a full controller or knob blows. A clarinettist plays between 2 and 6 kPa.",
        "How far the whole way of the knob reaches into the note.",
    ),
    term(
        "tongue",
        "Time for the tongue to let go of the reed, ms",
        "Short: crisp attacks. Long: soft ones.",
        "",
    ),
    term(
        "legato",
        "Time for the fingers to move between slurred notes, ms",
        "Holes open and close over this time; long slurs speak through the notes between.",
        "The torque passes from one note's to the next's.",
    ),
    term(
        "stren",
        "Reed strength as on the box; 2.5 closes at 6 kPa",
        "Stiffer reeds need more breath and stay clear of beating longer; half a number is about 20 % of stiffness.",
        "Threshold and closure move outwards.",
    ),
    term(
        "lip",
        "Lip opening: the tip's opening over that of the reference",
        "Below 1 bites: less air, thinner, closes early. Above 1: open and loud.",
        "Less or more torque, and a nearer or farther closure.",
    ),
    term(
        "zeta",
        "Embouchure \u{3b6}: strength of the flow through the reed",
        "More: notes speak earlier, beat earlier, sound brighter.",
        "The threshold comes nearer.",
    ),
    term(
        "damp",
        "Damping of the reed by the lip",
        "Low values let the reed squeak; high ones are dark and safe.",
        "",
    ),
    term(
        "reedh",
        "H: opening of the reed at rest, dimensionless; \u{221a}27/2 is the reference",
        "Opens the reed: more flow. Coupled, k follows so that the peak of the flow stays the same and closure comes earlier.",
        "Height and width of the torque curve: it is the same curve.",
    ),
    term(
        "reedk",
        "k: stiffness of the reed, dimensionless; 27/(4H\u{b3}) is the reference",
        "Stiffer closes later, at H\u{b7}k. Ignored while coupled.",
        "Where the curve ends.",
    ),
    term(
        "reedc",
        "Whether k follows H as 27/(4H\u{b3})",
        "Coupled, the largest flow stays what A says. Free, H and k are moved apart.",
        "As heard.",
    ),
    term(
        "reeda",
        "A: amplitude of the flow",
        "Scales the flow, and with it what a note needs to speak.",
        "Scales the torque.",
    ),
    term(
        "lay",
        "Curve of the lay that the reed closes on",
        "0 shuts like a door, bright. More: it rolls shut, softer.",
        "",
    ),
    term("a4", "Pitch of A4, Hz", "Tunes the whole instrument by its length.", ""),
    term(
        "tune",
        "How notes are held in tune",
        "Natural: right at mezzo-forte, pitch moves with the breath as in a real bore. Tempered: right at every breath.",
        "",
    ),
    term("temp", "Temperature of the air, \u{b0}C", "Warm air is faster: 3 cents sharper a degree.", ""),
    term(
        "vent",
        "Loss of the air jets in open holes",
        "0 removes it, and with it most of the clarion register: the loss is what lets the register key work.",
        "",
    ),
    term("noise", "Noise of the breath in the reed channel", "Air in the sound.", ""),
    term("gain", "Level, dB", "1 Pa at 1 m is -6 dBFS at 0 dB.", ""),
    act("panic", "Everything up, at once", "Silences the instrument."),
    act("knob", "Which kind of knob", "Serial and MIDI can be felt; OSC of unmodified firmware only plays."),
    act(
        "arm",
        "Lets the knob make torque",
        "Off whenever a project is loaded, and after anything that disarms the knob: pull the plug, a fault, silence on the line.",
    ),
    act(
        "ceil",
        "Most torque you allow, mNm",
        "The knob never makes more. 100 is gentle, 250 the most that can be asked for. Takes effect with the next arming; less at once.",
    ),
    act("takeov", "Takes the knob from the instance that has it", "The other window lets go, disarmed."),
    act(
        "rest",
        "The knob is at rest where it stands",
        "Calibrates no breath. Let go of the knob, then press.",
    ),
    act(
        "blow",
        "The knob stands at full breath",
        "Calibrates full breath: the way from rest to here. Turn it as far as you want to blow, then press.",
    ),
    term(
        "law",
        "Law of the torque",
        "",
        "Flow: the reed's own curve, rising to the threshold and falling to closure. Pressure: a spring with a step at the threshold. Free: nothing.",
    ),
    term(
        "contr",
        "Contrast: exaggerates how notes differ",
        "Changes no sound.",
        "1 is what the bore asks, about 15 % over the compass, at the edge of what fingers tell apart. 3 makes it plain.",
    ),
    term(
        "order",
        "What makes one note harder than another",
        "Changes no sound.",
        "Physical: what the bore asks. Covered holes: the more fingers, the harder. Open holes: the reverse.",
    ),
    term(
        "refnot",
        "Written note that is felt the same at every contrast",
        "",
        "Other notes move around this one.",
    ),
    term("torque", "Torque of the reference note, mNm", "", "How strong everything feels."),
    term("kdamp", "Damping beside the knob's own, mNm s/rad", "", "As if the knob turned in honey."),
    term("kfric", "Friction, mNm", "", "Holds the knob where you let go."),
    term(
        "detent",
        "Height of the step at the threshold, mNm",
        "",
        "A click where the note speaks. Under the flow law the peak is there already.",
    ),
    term(
        "curve",
        "Curve of the way from rest to full blow",
        "For knobs without feel: above 1 gives room at the soft end.",
        "",
    ),
    act("oscprt", "UDP port that unmodified firmware sends to", "8000 as it leaves the workshop."),
    act("oscany", "Whether OSC may come from other machines", "Off, only this machine is heard."),
    act(
        "oscfl",
        "UDP port on this machine that the feel is sent to",
        "For other programs that make torque; 0 is none.",
    ),
    act("rec", "Records what the knob does, as a file", "Replays to the same sample."),
    act("replay", "Plays the recorded take instead of the knob", "From when it is switched on."),
    act("study", "H and k come from the trial of a study", "See docs/study.md."),
    act("part", "Number of the participant", ""),
    act("seed", "Decides the order of the trials", ""),
    act("trial", "Which trial", ""),
    act("side", "Side A or B of the trial", ""),
    term("hsrc", "What drives H", "A controller opens the reed in sound and hand alike.", ""),
    term("ksrc", "What drives k", "A controller stiffens the reed; coupling is off meanwhile.", ""),
    act("kstat", "How the link to the knob is", ""),
    act(
        "instr",
        "Which clarinet",
        "Another bore with its own holes, fingerings and reed. The one that plays fades over when the other is ready.",
    ),
    term(
        "qual",
        "How finely the host's offline mode renders",
        "High computes at twice the rate and in double precision: a bounce takes longer than what is heard live.",
        "",
    ),
    term("bendr", "How far the pitch wheel bends, semitones", "What MIDI says by RPN 0 goes before it.", ""),
    act("istat", "How far the instrument is", ""),
    term(
        "rface",
        "How the reed is named: by the dimensionless H, k and zeta, or as a maker measures it",
        "The same reed either way: what rules are the values that are shown.",
        "As heard.",
    ),
    term(
        "rstiff",
        "Stiffness K of the reed, N/m",
        "A stiffer reed closes later: closing pressure is K times opening over area.",
        "Threshold and closure move outwards.",
    ),
    term(
        "rarea",
        "Area that the breath presses on, mm\u{b2}",
        "A larger area closes earlier.",
        "Threshold and closure move inwards.",
    ),
    term(
        "rwidth",
        "Width w of the channel, tip and side slits together, mm",
        "Wider: more flow, notes speak and beat earlier, brighter.",
        "More torque.",
    ),
    term(
        "ropen",
        "Opening at the tip, at rest under the lip, mm",
        "Wider: more flow, and the reed closes later.",
        "More torque, and a farther closure.",
    ),
];

/// The explanation of a parameter.
pub fn of(id: &str) -> Option<&'static Term> {
    TERMS.iter().find(|term| term.id == id)
}

/// Whether undo and A/B carry it. What is unknown does not go.
pub fn is_setting(id: &str) -> bool {
    of(id).is_some_and(|term| term.is_setting)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_moves_a_motor_or_plays_travels_with_undo_or_compare() {
        for id in
            ["arm", "ceil", "takeov", "rest", "blow", "breath", "panic", "rec", "replay", "knob", "instr"]
        {
            assert!(!is_setting(id), "{id}");
        }
        assert!(is_setting("zeta") && !is_setting("no such"));
    }

    #[test]
    fn every_term_stands_once_and_says_something() {
        for (at, term) in TERMS.iter().enumerate() {
            assert!(!term.word.is_empty());
            assert!(TERMS[..at].iter().all(|other| other.id != term.id), "{}", term.id);
        }
    }
}
