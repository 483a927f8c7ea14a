use super::*;
use crate::bore::alternate_fingerings::fingering_choices;
use crate::bore::bundled::Bundled;
use std::sync::LazyLock;

static FILE: LazyLock<InstrumentFile> = LazyLock::new(InstrumentFile::built_in);
static FINDER: LazyLock<FingeringFinder> = LazyLock::new(|| {
    FingeringFinder::new(&FILE, Air::default(), 440.0, &mut |_| ControlFlow::Continue(())).unwrap()
});

/// Botros et al. (2006) looked through 39744 of a flute.
#[test]
fn no_usual_fingering_is_missed() {
    assert!(FINDER.len() > 39_744, "{}", FINDER.len());
    for choice in fingering_choices(&FILE) {
        let open = bits(&choice.open);
        assert!(FINDER.grips.iter().any(|grip| grip.open == open), "{}: {}", choice.written, choice.fingers);
    }
    assert!(FINDER.grips.is_sorted_by_key(|grip| grip.open));
}

/// Its lowest notes lie below what a B flat clarinet is looked through for, and everything is 101 cents lower.
#[test]
fn a_bass_clarinet_at_415_hz_is_found_where_its_chart_plays() {
    let file = Bundled::Bass.file().scaled(440.0 / 415.0);
    let finder =
        FingeringFinder::new(&file, Air::default(), 415.0, &mut |_| ControlFlow::Continue(())).unwrap();
    for note in (52..=90).map(WrittenNote) {
        let found = finder.played_by_chart(note).unwrap();
        assert!(found.cents.abs() < 80.0, "{note}: {} cents", found.cents);
    }
    assert!(!finder.best(WrittenNote(52), 3).is_empty());
}

/// Up to G#6 players agree on fingerings; above, charts differ.
#[test]
fn what_players_do_is_found_among_the_first_five() {
    let notes: Vec<WrittenNote> = (52..=92).map(WrittenNote).collect();
    let known = |note: &&WrittenNote| {
        let chart = FINDER.of_chart(**note).unwrap();
        FINDER.best(**note, 5).iter().any(|found| found.grip.open == chart.open)
    };
    let found = notes.iter().filter(known).count();
    assert!(notes.len() == 41 && found >= 38, "{found} of {}", notes.len());
}

#[test]
fn the_highest_notes_have_fingerings_in_tune_that_speak() {
    for note in [95, 97] {
        let best = FINDER.best(WrittenNote(note), 5);
        let good = |found: &&Found| found.cents.abs() < 10.0 && found.gamma_on < 0.45;
        assert!(best.iter().any(|found| good(&found)), "{note}: {best:?}");
    }
}

#[test]
fn trills_move_few_fingers() {
    // B5 and C6: one finger.
    let (from, to) = FINDER.trills(WrittenNote(83), WrittenNote(84), 1).remove(0);
    assert_eq!(from.grip.moves(&to.grip), 1, "{} to {}", from.fingers, to.fingers);
    for note in 52..90 {
        let trills = FINDER.trills(WrittenNote(note), WrittenNote(note + 2), 3);
        assert!(!trills.is_empty(), "{note}");
    }
}

#[test]
fn multiphonics_are_of_no_one_harmonic_series() {
    let found = FINDER.multiphonics(30);
    assert_eq!(found.len(), 30);
    for one in &found {
        let ratio = one.f_hz[1] / one.f_hz[0];
        assert!(cents(ratio, ratio.round()).abs() >= INHARMONIC_CENTS && one.uneven_db >= 0.0, "{one:?}");
    }
}

#[test]
fn unknown_keys_are_left_as_they_are_at_rest_and_unknown_finger_holes_have_fingers() {
    let mut file = FILE.clone();
    file.holes.iter_mut().for_each(|hole| hole.name.insert(0, 'x'));
    assert_eq!(Mechanism::boehm().grips(&file).len(), 1);
    let fingers = file.holes.iter().filter(|hole| hole.kind == HoleKind::Finger).count();
    let mechanism = Mechanism::of(&file);
    let grips = mechanism.grips(&file);
    assert!(fingers == 7 && grips.len() == 1 << fingers, "{fingers}: {}", grips.len());
    assert_eq!(mechanism.words(&grips[0]).split(' ').count(), fingers, "all covered");
    assert_eq!(mechanism.unmoved(&file).len(), file.holes.len() - fingers);
    // Of its own holes a Boehm clarinet has as many fingers as ever.
    assert_eq!(Mechanism::of(&FILE).grips(&FILE), Mechanism::boehm().grips(&FILE));
}

#[test]
fn a_hole_whose_kind_contradicts_its_name_is_told() {
    assert!(Mechanism::boehm().contrary(&FILE).is_empty());
    let mut file = FILE.clone();
    let of = |file: &InstrumentFile, name| file.hole(name).unwrap();
    let (key, finger) = (of(&file, "A_KEY"), of(&file, "L2"));
    (file.holes[key].kind, file.holes[finger].kind) = (HoleKind::Finger, HoleKind::KeyClosed);
    let told = Mechanism::boehm().contrary(&file);
    assert!(
        told.contains(&("A_KEY".to_owned(), true)) && told.contains(&("L2".to_owned(), false)),
        "{told:?}"
    );
    assert_eq!(told.len(), 2);
}
