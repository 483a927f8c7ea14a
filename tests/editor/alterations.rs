//! Holes and joints that the user drags, gives in millimetres, puts back and saves.

use chalumeau::editor::{Action, Tab};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::bore::moved_hole::MovedHole;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::Window;

const HOLE: &str = "Hole R2 in the bore";

fn built() -> MovedHole {
    let file = InstrumentFile::built_in();
    let hole = &file.holes[file.hole("R2").unwrap()];
    MovedHole { name: hole.name.clone(), x_m: hole.x_m, radius_m: hole.radius_m }
}

/// The moved holes as the plugin would have them now.
fn moved(window: &Window) -> Vec<MovedHole> {
    window.snapshot.borrow().alterations.holes.clone()
}

fn click(window: &mut Window, label: &str) {
    window.harness.get_by_label(label).click();
    window.harness.run();
}

/// Drags the hole by so many points and returns where it was in the window.
fn drag(window: &mut Window, by: egui::Vec2, modifiers: Modifiers) {
    let centre = window.harness.get_by_label(HOLE).rect().center();
    window.harness.event(egui::Event::ModifiersChanged(modifiers));
    window.drag(centre, by);
    window.harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
}

#[test]
fn a_hole_is_dragged_undone_and_put_back() {
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    let before = window.harness.get_by_label(HOLE).rect().center().x;
    drag(&mut window, vec2(-12.0, 3.0), Modifiers::NONE);
    let [first] = &moved(&window)[..] else { panic!("{:?}", moved(&window)) };
    assert_eq!((first.name.as_str(), first.radius_m), ("R2", built().radius_m));
    let drawn = window.harness.get_by_label(HOLE).rect().center().x;
    assert!((drawn - before + 12.0).abs() < 0.5, "it is drawn where it was let go: {before} {drawn}");
    // No trial of a fingering.
    assert!(window.actions().iter().all(|action| matches!(action, Action::Alter(_))));

    drag(&mut window, vec2(0.0, -20.0), Modifiers::SHIFT);
    let [wider] = &moved(&window)[..] else { panic!("{:?}", moved(&window)) };
    assert_eq!(wider.x_m, first.x_m);
    assert!((wider.radius_m - first.radius_m - 1e-3).abs() < 1e-5, "{wider:?}");

    click(&mut window, "Undo");
    assert_eq!(moved(&window), std::slice::from_ref(first));
    click(&mut window, "Undo");
    assert!(moved(&window).is_empty());
    drag(&mut window, vec2(8.0, 0.0), Modifiers::NONE);
    click(&mut window, "Put back");
    assert!(moved(&window).is_empty());
    // Putting back can be undone too.
    click(&mut window, "Undo");
    assert_eq!(moved(&window).len(), 1);
    click(&mut window, "Done");
    window.harness.get_by_label("1 alteration");
}

#[test]
fn a_hole_of_the_play_view_is_dragged_and_undone() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let place = |window: &Window| window.harness.get_by_label_contains("Hole R2, ").rect().center();
    let before = place(&window);
    window.drag(before, vec2(-12.0, 3.0));
    assert!((place(&window).x - before.x + 12.0).abs() < 0.5, "it is drawn where it was let go");
    let [first] = &moved(&window)[..] else { panic!("{:?}", moved(&window)) };
    assert_eq!((first.name.as_str(), first.radius_m), ("R2", built().radius_m));
    assert!(first.x_m < built().x_m);
    assert!(window.actions().iter().all(|action| matches!(action, Action::Alter(_))), "no trial");
    click(&mut window, "Undo");
    assert!(moved(&window).is_empty());
    assert!(window.harness.get_by_label("Undo").accesskit_node().is_disabled(), "nothing is left to undo");
    assert!(window.harness.query_by_label("Put back").is_none(), "nothing is altered");
    click(&mut window, "Redo");
    assert_eq!(moved(&window), std::slice::from_ref(first));
}

/// One row of steps: a control, a hole, and a joint come back in turn, whichever view is shown.
#[test]
fn undo_takes_back_controls_and_moves_in_turn() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let lip = window.harness.get_by_label("Lip").rect().center();
    window.drag(lip, vec2(0.0, -20.0));
    let hole = window.harness.get_by_label_contains("Hole R2, ").rect().center();
    window.drag(hole, vec2(-12.0, 0.0));
    window.drag(lip, vec2(0.0, -20.0));
    let (first, second) = (moved(&window), window.host.value("lip"));
    click(&mut window, "Undo");
    assert!(window.host.value("lip") < second && moved(&window) == first);
    click(&mut window, "Sound");
    window.harness.get_by_label("Undo").hover();
    window.harness.run_steps(60);
    window.harness.get_by_label("Undo the alteration of R2");
    click(&mut window, "Undo");
    assert!(moved(&window).is_empty());
    click(&mut window, "Undo");
    assert_eq!(window.host.plain("lip"), 1.0);
    assert!(window.harness.get_by_label("Undo").accesskit_node().is_disabled());
    for _ in 0..3 {
        click(&mut window, "Redo");
    }
    assert_eq!((window.host.value("lip"), moved(&window)), (second, first));
}

#[test]
fn saving_is_answered_in_both_views() {
    for tab in [Tab::Play, Tab::Clarinet] {
        let mut window = Window::new(tab, (700.0, 480.0));
        let hole = if tab == Tab::Play { "Hole R2, " } else { HOLE };
        let at = window.harness.get_by_label_contains(hole).rect().center();
        window.drag(at, vec2(-12.0, 0.0));
        let rows =
            |window: &Window| window.harness.query_by_label("Fingering E3").map(|fingering| fingering.rect());
        let before = rows(&window);
        window.snapshot.borrow_mut().saved = Some(Ok("/home/music/mine_1.toml".into()));
        window.harness.run();
        window.harness.get_by_label("Saved as mine_1.toml");
        assert_eq!(rows(&window), before, "the fingerings stay where they are");
        window.snapshot.borrow_mut().saved = Some(Err("the folder is read only".to_owned()));
        window.harness.run();
        window.harness.get_by_label("the folder is read only");
    }
}

#[test]
fn a_hole_stays_between_its_neighbours() {
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    let file = InstrumentFile::built_in();
    let room = file.room_of_hole(file.hole("R2").unwrap()).unwrap();
    drag(&mut window, vec2(400.0, 0.0), Modifiers::NONE);
    assert_eq!(moved(&window)[0].x_m, room.x_m.1);
    click(&mut window, "Put back");
    drag(&mut window, vec2(-400.0, 0.0), Modifiers::NONE);
    assert_eq!(moved(&window)[0].x_m, room.x_m.0);
}

#[test]
fn a_hole_is_given_in_millimetres_and_saved() {
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    click(&mut window, "Alter the bore");
    window.harness.get_by_label(
        "Drag a hole along the bore; with Shift, up makes it wider. Drag a ring to pull the joint.",
    );
    drag(&mut window, vec2(-8.0, 0.0), Modifiers::NONE);
    let width = window.harness.get_by_label("Width of the hole R2, mm wide");
    width.click();
    window.harness.run();
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.harness.get_by_label("Width of the hole R2, mm wide").type_text("6.5");
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    let now = moved(&window);
    assert!((now[0].radius_m - 3.25e-3).abs() < 1e-9, "{now:?}");

    window.actions();
    click(&mut window, "Save");
    let [Action::SaveInstrument(file)] = &window.actions()[..] else { panic!("not saved") };
    let hole = &file.holes[file.hole("R2").unwrap()];
    assert_eq!((hole.x_m, hole.radius_m), (now[0].x_m, now[0].radius_m));
    assert!(file.name.ends_with("altered") && file.source.ends_with("Altered by hand: R2."));
    let path = std::path::PathBuf::from("/home/music/mine_1.toml");
    window.snapshot.borrow_mut().saved = Some(Ok(path.clone()));
    window.harness.run();
    window.harness.get_by_label("Saved as mine_1.toml");
    click(&mut window, "Open it");
    assert_eq!(window.actions(), [Action::OpenInstrument(path)]);
    // Of another instrument nothing can be undone here, though it has the same name.
    window.snapshot.borrow_mut().instrument_key = "user:/home/music/other.toml".to_owned();
    window.harness.run();
    click(&mut window, "Undo");
    let undone = window.actions();
    assert!(
        undone.contains(&Action::NameInstrumentFile(String::new())),
        "the file that was opened: {undone:?}"
    );
    click(&mut window, "Undo");
    assert!(window.actions().is_empty());
}

/// The barrel is pulled out by its ring: all below it follows in the picture, a hole that is moved then keeps its place on its
/// joint, and the number says how far.
#[test]
fn a_joint_is_pulled_by_its_ring() {
    const RING: &str = "Joint below the barrel";
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    let pulled = |window: &Window| window.snapshot.borrow().alterations.joints.clone();
    let file = InstrumentFile::built_in();
    let x = |part: &str| window.harness.get_by_label(&format!("Joint below the {part}")).rect().center().x;
    let between_m = file.joint_x_m("lower joint").unwrap() - file.joint_x_m("barrel").unwrap();
    let points_a_metre = f64::from(x("lower joint") - x("barrel")) / between_m;
    let ring = window.harness.get_by_label(RING).rect().center();
    window.drag(ring, vec2(4.0, 0.0));
    let [joint] = &pulled(&window)[..] else { panic!("{:?}", pulled(&window)) };
    assert_eq!(joint.part, "barrel");
    assert!((joint.by_m - 4.0 / points_a_metre).abs() < 2e-4, "{joint:?}");

    let length = "How much longer the barrel is, mm";
    window.harness.get_by_label(length).click();
    window.harness.run();
    window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.harness.get_by_label(length).type_text("-2.5");
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    let now = pulled(&window);
    assert!((now[0].by_m + 2.5e-3).abs() < 1e-9, "{now:?}");
    // Far out it stops where a joint ends.
    let ring = window.harness.get_by_label(RING).rect().center();
    window.drag(ring, vec2(300.0, 0.0));
    assert_eq!(pulled(&window)[0].by_m, file.room_of_joint("barrel").unwrap().1);

    // A hole is drawn where its joint is, and dragged from there.
    drag(&mut window, vec2(-12.0, 0.0), Modifiers::NONE);
    assert!((built().x_m - moved(&window)[0].x_m - 12.0 / points_a_metre).abs() < 4e-4);
    window.harness.get_by_label("Place of the hole R2, mm from the reed");
    click(&mut window, "Undo");
    assert!(moved(&window).is_empty() && !pulled(&window).is_empty());
    window.actions();
    click(&mut window, "Save");
    let [Action::SaveInstrument(saved)] = &window.actions()[..] else { panic!("not saved") };
    assert!((saved.length_m() - file.length_m() - 15e-3).abs() < 1e-9);
    assert!(saved.source.ends_with("Altered by hand: barrel."));
    click(&mut window, "Put back");
    assert!(pulled(&window).is_empty());
}
