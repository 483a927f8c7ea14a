//! The search for fingerings in the clarinet view.

use std::ops::ControlFlow;
use std::sync::{Arc, LazyLock};

use chalumeau::editor::fingering_search::{FingeringAnswer, FingeringQuestion, FingeringSearch};
use chalumeau::editor::{Action, Tab};
use chalumeau_core::bore::fingering_finder::{FingeringFinder, bits};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::units::{Air, SoundingNote, WrittenNote};
use egui_kittest::kittest::Queryable;

use crate::Window;

/// All fingerings of the B flat clarinet: a second of one core.
static FINDER: LazyLock<(InstrumentFile, FingeringFinder)> = LazyLock::new(|| {
    let file = InstrumentFile::built_in();
    let finder =
        FingeringFinder::new(&file, Air::default(), 440.0, &mut |_| ControlFlow::Continue(())).unwrap();
    (file, finder)
});

/// The answer to a question, as the plugin finds it.
pub fn found(of: u8, trill_to: Option<u8>) -> FingeringSearch {
    FingeringSearch::Found(Arc::new(FingeringAnswer::new(&FINDER.1, note(of, trill_to))))
}

/// Answers the question that the window has put last, as the plugin does.
fn answer(window: &mut Window) -> FingeringQuestion {
    let asked = window.actions().into_iter().rev().find_map(|action| match action {
        Action::FindFingerings(question) => question,
        _ => None,
    });
    let question = asked.expect("a question");
    window.snapshot.borrow_mut().fingerings = found(question.note.0, question.trill_to.map(|note| note.0));
    window.harness.run();
    question
}

fn click(window: &mut Window, label: &str) {
    window.harness.get_by_label(label).click();
    window.harness.run();
}

fn click_containing(window: &mut Window, label: &str) {
    window.harness.get_by_label_contains(label).click();
    window.harness.run();
}

fn note(note: u8, trill_to: Option<u8>) -> FingeringQuestion {
    FingeringQuestion { note: WrittenNote(note), trill_to: trill_to.map(WrittenNote) }
}

#[test]
fn the_played_note_is_looked_for_and_a_fingering_is_tried() {
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    click(&mut window, "Find fingerings");
    window.snapshot.borrow_mut().fingerings = FingeringSearch::Looking(0.42);
    window.harness.run();
    window.harness.get_by_label("Working out every fingering that the fingers can make: 42 %");
    assert_eq!(answer(&mut window), note(60, None));
    window.harness.get_by_label("Fingerings of C4");

    // The chart's own is among the first five, is shown on the instrument and tried.
    let chart = FINDER.0.fingering(WrittenNote(60)).unwrap().open.clone();
    let search = window.snapshot.borrow().fingerings.clone();
    let FingeringSearch::Found(found) = search else { panic!("no answer") };
    let nth = found.rows.iter().position(|row| row.note.grip.open == bits(&chart)).unwrap();
    assert!(nth < 5 && found.rows[nth].is_of_chart, "{nth}");
    let other = usize::from(nth == 0);
    let tried: Vec<bool> =
        (0..chart.len()).map(|hole| found.rows[other].note.grip.open >> hole & 1 == 1).collect();
    let label = format!("Fingering {}: ", other + 1);
    click_containing(&mut window, &label);
    assert_eq!(window.actions(), [Action::TryFingering(tried.clone())]);
    let opened = window.harness.get_all_by_label_contains(", open").count();
    assert_eq!(opened, tried.iter().filter(|&&open| open).count(), "the instrument shows it");
    click(&mut window, "Back to the note");
    assert_eq!(window.actions(), [Action::EndTry]);

    // Another note is played: its fingerings are looked for. The arrows lead to its neighbours.
    {
        let mut snapshot = window.snapshot.borrow_mut();
        (snapshot.key, snapshot.sounding) = (Some(SoundingNote(60)), Some(SoundingNote(60)));
    }
    window.harness.run();
    assert_eq!(answer(&mut window), note(62, None));
    click(&mut window, "A semitone up");
    assert_eq!(answer(&mut window), note(63, None));
    click(&mut window, "Done");
    assert_eq!(window.actions(), [Action::FindFingerings(None)]);
    window.harness.get_by_label("Find fingerings");
}

#[test]
fn a_trill_is_looked_for_and_nothing_is_said_clearly() {
    let mut window = Window::new(Tab::Clarinet, (700.0, 480.0));
    click(&mut window, "Find fingerings");
    answer(&mut window);
    click(&mut window, "Fingerings for: Trill to D4");
    assert_eq!(answer(&mut window), note(60, Some(62)));
    click_containing(&mut window, "Second fingering of trill 1: ");
    let FingeringSearch::Found(found) = window.snapshot.borrow().fingerings.clone() else {
        panic!("no answer")
    };
    let (second, moves) = found.rows[0].trill.clone().unwrap();
    assert!(moves >= 1 && second.grip.open != found.rows[0].note.grip.open);
    let [Action::TryFingering(tried)] = &window.actions()[..] else { panic!("not tried") };
    assert_eq!(bits(tried), second.grip.open);
    // The trill goes on from the next note.
    click(&mut window, "A semitone down");
    assert_eq!(answer(&mut window), note(59, Some(61)));

    // Far above the instrument there is none.
    window.snapshot.borrow_mut().sounding = Some(SoundingNote(108));
    window.harness.run();
    assert_eq!(answer(&mut window), note(110, Some(112)));
    let none = "None of the 80640 fingerings plays D8, or none plays E8, within 40 cents. \
                The chart of this instrument goes from E3 to C#7.";
    window.harness.get_by_label(none);
}
