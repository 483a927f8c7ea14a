//! What the breath does when the note changes under a hand: slurs over the break, and a whole melody.

use crate::parallel::each;
use crate::player::LoopPlayer;
use crate::{CONTRASTS, FEELS, LAWS, MODEL, note, seated};
use chalumeau_core::event::Event;
use chalumeau_core::haptics::{FeelDesign, FeelTable, NoteFeel, TorqueLimits};
use chalumeau_core::instrument::Settings;
use chalumeau_core::score::midi_file;
use chalumeau_core::units::{SoundingNote, WrittenNote};
use chalumeau_knob::simulator::hand::HandDesign;
use chalumeau_knob::simulator::script::Aim;
use chalumeau_knob::wire::TorqueLaw;

/// Written notes on both sides of the break, and within a register.
const SLURS: [(u8, u8); 4] = [(69, 71), (70, 71), (71, 70), (60, 67)];
/// Largest change of gamma under a still hand from 30 ms after the new note on.
const STILL: f64 = 0.03;
/// Largest leap of gamma in the melody.
const LEAP: f64 = 0.05;

/// Contrast and Place: each Contrast with the default Place, and both alike.
fn exaggerations() -> Vec<(f64, f64)> {
    CONTRASTS.into_iter().flat_map(|contrast| [(contrast, 1.0), (contrast, contrast)]).collect()
}

fn table(law: TorqueLaw, (contrast, place): (f64, f64)) -> FeelTable {
    let design = FeelDesign { law, contrast, place, ..FeelDesign::default() };
    FEELS.table(&Settings::physical(), &design, &TorqueLimits::default()).unwrap()
}

/// Largest change of gamma after a slur, in the first 30 ms and afterwards, over a second.
fn slur(table: &FeelTable, (first, second): (u8, u8), gamma: f64, hand: HandDesign) -> [f64; 2] {
    let settings = Settings::physical();
    let (first, second) = (note(table, first), note(table, second));
    let sounding = |written: WrittenNote| written.sounding(MODEL.file.transposition).unwrap();
    let mut player = seated(table, first, &settings, hand);
    player.knob.hand().aim(Aim::Angle(first.map.angle_deg(gamma * settings.closing_pa())));
    player.run(4.0, |_| {}, |_| {});
    player.finger(sounding(first.written));
    player.run(1.0, |_| {}, |_| {});
    let (mut sum, mut count) = (0.0, 0.0);
    player.run(0.3, |_| {}, |probe| (sum, count) = (sum + probe.gamma, count + 1.0));
    let before = sum / count;
    player.finger(sounding(second.written));
    player.want_feel(second.feel);
    let changes = [0.03, 1.0].map(|seconds| {
        let mut most = 0.0_f64;
        player.run(seconds, |_| {}, |probe| most = most.max((probe.gamma - before).abs()));
        most
    });
    assert_eq!(player.knob.feel().1, Some(first.feel.law));
    changes
}

/// Acceptance: where the breath is physical, over the break and elsewhere, gamma changes by at most 0.03 under a hand that stays where it is, at Contrast
/// 1, 3 and 5, whatever the Place. What is left is the hand giving way to the other torque.
#[test]
fn in_a_slur_a_still_hand_keeps_its_pressure() {
    let mut runs = Vec::new();
    for law in LAWS {
        for exaggeration in exaggerations() {
            for pair in SLURS {
                for (gamma, hand) in [
                    (0.5, HandDesign::default()),
                    (0.8, HandDesign::default()),
                    (0.5, HandDesign::listening()),
                ] {
                    runs.push((law, exaggeration, pair, gamma, hand));
                }
            }
        }
    }
    let found = each(&runs, |&(law, exaggeration, pair, gamma, hand)| {
        slur(&table(law, exaggeration), pair, gamma, hand)
    });
    let mut worst = 0.0_f64;
    for (&(law, (contrast, place), (first, second), gamma, hand), [at_once, later]) in runs.iter().zip(found)
    {
        println!(
            "{law:?} Contrast {contrast} Place {place} {} {}: gamma {gamma} changes by {at_once:.4} within 30 ms, {later:.4} later; \
             listening: {}",
            WrittenNote(first),
            WrittenNote(second),
            hand.correction_per_s > 0.0
        );
        worst = worst.max(later).max(at_once);
    }
    println!("{} slurs under a still hand: worst change of gamma {worst:.4}", runs.len());
    assert!(worst <= STILL, "{worst}");
}

/// One event of the melody and when it happens, s.
type Played = (f64, Event);

/// The notes of the example melody, and its breath as gamma at every time.
fn melody() -> (Vec<Played>, Vec<(f64, f64)>) {
    const RATE: u32 = 48_000;
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/melody.mid");
    let score = midi_file::read(&std::fs::read(path).unwrap(), RATE).unwrap();
    let settings = Settings::physical();
    let full = 1e3 * f64::from(settings.breath_full_kpa) / settings.closing_pa();
    let (mut notes, mut breath) = (Vec::new(), vec![(0.0, 0.0)]);
    for timed in &score.events {
        let t_s = timed.at as f64 / f64::from(RATE);
        match timed.event {
            Event::Breath(unit) => breath.push((t_s, full * f64::from(unit))),
            Event::NoteOn { .. } | Event::NoteOff { .. } => notes.push((t_s, timed.event)),
            _ => {}
        }
    }
    (notes, breath)
}

/// How the hand follows the melody.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Follows {
    /// The swell only: it turns as if the reference note were played all the time.
    Swell,
    /// The swell, to where each note has its pressure.
    Notes,
}

/// Plays the melody; the largest leap of the gamma that the hand blows within 0.1 s after a change of note, against what the breath of the melody does
/// meanwhile, and how many changes were looked at.
fn melody_through_the_knob(table: &FeelTable, follows: Follows) -> (f64, usize) {
    const STEP_S: f64 = 0.004;
    const LEAP_S: f64 = 0.1;
    const ARRIVED_DEG: f64 = 5.0;
    const STEADY: f64 = 0.05;
    let settings = Settings::physical();
    let closing_pa = settings.closing_pa();
    let (notes, breath) = melody();
    let wanted = |t_s: f64| {
        let next = breath.partition_point(|point| point.0 <= t_s);
        breath[next.saturating_sub(1)].1
    };
    let of = |sounding: SoundingNote| {
        let written = sounding.written(MODEL.file.transposition);
        table.notes().iter().find(|note| Some(note.written) == written).unwrap()
    };
    let mut player: LoopPlayer = seated(table, table.reference(), &settings, HandDesign::listening());
    player.knob.hand().aim(Aim::Angle(0.0));
    player.run(0.5, |_| {}, |_| {});
    let (mut due, mut t_s, mut fingered) = (notes.iter().peekable(), 0.0, table.reference());
    let (mut off, mut changed): (f64, Option<(f64, f64)>) = (0.0, None);
    let (mut worst, mut changes) = (0.0_f64, 0);
    let end_s = notes.last().unwrap().0;
    // Where the hand wants to be.
    let aim_deg = |fingered: &NoteFeel, t_s: f64| {
        let map = if follows == Follows::Notes { fingered.map } else { table.reference().map };
        map.angle_deg(wanted(t_s) * closing_pa)
    };
    while t_s < end_s {
        while let Some((_, event)) = due.next_if(|(at_s, _)| *at_s <= t_s) {
            player.play(*event);
            if let Event::NoteOn { note, .. } = *event {
                // A hand that is still on its way, as at the beginning of a phrase, shows nothing, and no more does a breath
                // that ends.
                let has_arrived = (player.knob.angle_deg() - aim_deg(fingered, t_s)).abs() < ARRIVED_DEG;
                let is_steady = (wanted(t_s + LEAP_S) - wanted(t_s)).abs() < STEADY;
                changed = (has_arrived && is_steady).then_some((t_s, off));
                changes += usize::from(changed.is_some());
                fingered = of(note);
                player.want_feel(fingered.feel);
            }
        }
        player.knob.hand().aim(Aim::Angle(aim_deg(fingered, t_s)));
        player.run(STEP_S, |_| {}, |_| {});
        t_s += STEP_S;
        off = player.blown_pa() / closing_pa - wanted(t_s);
        if let Some((since_s, before)) = changed.filter(|(since_s, _)| t_s - since_s <= LEAP_S) {
            let leap = (off - before).abs();
            if leap > worst {
                worst = leap;
                if leap > LEAP {
                    println!(
                        "  {follows:?} {}: {leap:.3} at {t_s:.2} s, {:.0} ms after the note",
                        fingered.written,
                        1e3 * (t_s - since_s)
                    );
                }
            }
        }
    }
    (worst, changes)
}

/// Acceptance: the melody played through the knob, with both kinds of hands, has no spike of gamma above 0.05 where a note
/// changes.
#[test]
fn the_melody_through_the_knob_has_no_spikes() {
    let mut runs = Vec::new();
    for exaggeration in exaggerations() {
        runs.extend([Follows::Swell, Follows::Notes].map(|follows| (exaggeration, follows)));
    }
    let found = each(&runs, |&(exaggeration, follows)| {
        melody_through_the_knob(&table(TorqueLaw::Flow, exaggeration), follows)
    });
    let mut most = 0.0_f64;
    for (&((contrast, place), follows), (leap, changes)) in runs.iter().zip(found) {
        println!(
            "Contrast {contrast} Place {place}, the hand follows {follows:?}: {leap:.4} over {changes} changes of note"
        );
        assert!(changes > 30, "{changes} changes are too few to judge by");
        most = most.max(leap);
    }
    println!("melody: largest leap of gamma {most:.4}");
    assert!(most <= LEAP, "{most}");
}
