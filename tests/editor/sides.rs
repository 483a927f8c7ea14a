//! A and B: what each side keeps, undoes and is called, and the blind comparison.

use std::collections::BTreeSet;

use chalumeau::editor::{Action, Tab};
use egui::accesskit::{Role, Toggled};
use egui::vec2;
use egui_kittest::kittest::{NodeT, Queryable};

use crate::Window;

fn click(window: &mut Window, label: &str) {
    window.harness.get_by_label(label).click();
    window.harness.run();
}

/// Moves a slider of the view.
fn move_slider(window: &mut Window, name: &str) {
    let at = window.harness.get_by_role_and_label(Role::Slider, name).rect().center();
    window.drag(at, vec2(-50.0, 0.0));
}

/// What the plugin does with the window's actions: the names of presets.
fn obey(window: &mut Window) -> Vec<Action> {
    let actions = window.actions();
    for action in &actions {
        if let Action::ChosePreset(name) = action {
            window.snapshot.borrow_mut().preset = name.clone();
        }
    }
    window.harness.run();
    actions
}

#[test]
fn a_and_b_keep_their_settings_and_blind_hides_them() {
    let mut window = Window::tall(Tab::Reed);
    click(&mut window, "Setting B");
    window.host.automate("lip", 0.9);
    window.host.automate("arm", 1.0);
    window.harness.run();
    click(&mut window, "Setting A");
    assert_eq!((window.host.value("lip"), window.host.value("arm")), (0.5, 1.0), "arming is no setting");
    click(&mut window, "Blind");
    // Nothing tells: no slider, no curve.
    assert!(window.harness.query_by_label("Lip opening").is_none());
    assert!(window.harness.query_by_label("Undo").is_none());
    assert!(window.harness.query_by_label_contains("Hz").is_none());
    assert!(window.harness.query_by_label_contains("Pitch").is_none());
    let tells = |window: &Window, part: &str| window.harness.query_by_label_contains(part).is_some();
    assert!(
        !tells(&window, "Mouth pressure") && !tells(&window, "kPa"),
        "pressures differ between the sides"
    );
    assert!(!tells(&window, "Output"), "levels differ between the sides");
    let heard: BTreeSet<String> = ["Side X", "Side Y"]
        .into_iter()
        .map(|side| {
            click(&mut window, side);
            window.host.value("lip").to_string()
        })
        .collect();
    assert_eq!(heard.len(), 2, "X and Y are not the same");
    let tab = |window: &Window| {
        window.harness.get_by_role_and_label(Role::Tab, "Sound").accesskit_node().is_disabled()
    };
    assert!(tab(&window), "no view can be chosen");
    click(&mut window, "Reveal");
    let side_of_x =
        if window.harness.query_by_label_contains("X was A, Y was B.").is_some() { "A" } else { "B" };
    let side_of_y = if side_of_x == "A" { "B" } else { "A" };
    // Y was chosen last.
    let told = format!(
        "X was {side_of_x}, Y was {side_of_y}. Done ends the comparison and goes on with {side_of_y}, which you hear."
    );
    window.harness.get_by_label(&told);
    assert!(!tells(&window, "Reveal"));
    click(&mut window, "Done");
    window.harness.get_by_label("Lip opening");
    assert!(!tab(&window));
}

/// On A, whichever side played: the letter at the top would tell.
#[test]
fn a_cancelled_comparison_tells_nothing() {
    let mut window = Window::tall(Tab::Reed);
    click(&mut window, "Setting B");
    window.host.automate("lip", 0.9);
    window.harness.run();
    for side in ["Side X", "Side Y"] {
        click(&mut window, "Blind");
        click(&mut window, side);
        click(&mut window, "Cancel");
        assert!(window.harness.query_by_label_contains("X was").is_none());
        assert_eq!(window.host.value("lip"), 0.5, "A, after {side}");
    }
}

/// The lot falls anew each time: a side that stayed would be named X half of the time only.
#[test]
fn a_blind_comparison_begins_on_x_whatever_side_was_in_force() {
    let mut window = Window::tall(Tab::Reed);
    click(&mut window, "Setting B");
    window.host.automate("lip", 0.9);
    window.harness.run();
    for side in ["Setting A", "Setting B"].into_iter().cycle().take(16) {
        click(&mut window, side);
        click(&mut window, "Blind");
        let toggled = |window: &Window, name: &str| {
            window.harness.get_by_role_and_label(Role::RadioButton, name).accesskit_node().toggled()
        };
        assert_eq!(toggled(&window, "Side X"), Some(Toggled::True), "from {side}");
        assert_eq!(toggled(&window, "Side Y"), Some(Toggled::False), "from {side}");
        let on_x = window.host.value("lip");
        click(&mut window, "Side Y");
        assert_ne!(window.host.value("lip"), on_x, "its setting, too");
        click(&mut window, "Reveal");
        click(&mut window, "Done");
    }
}

#[test]
fn undo_stays_on_its_side() {
    let mut window = Window::tall(Tab::Reed);
    move_slider(&mut window, "Lip opening");
    let lip = window.host.value("lip");
    click(&mut window, "Setting B");
    assert!(window.harness.get_by_label("Undo").accesskit_node().is_disabled(), "B has no step yet");
    move_slider(&mut window, "Facing");
    let lay = window.host.value("lay");
    click(&mut window, "Setting A");
    click(&mut window, "Undo");
    assert_eq!((window.host.plain("lip"), window.host.plain("lay")), (1.0, 0.4));
    click(&mut window, "Setting B");
    assert_eq!((window.host.value("lip"), window.host.value("lay")), (lip, lay), "B is as it was left");
    click(&mut window, "Undo");
    assert_eq!((window.host.value("lip"), window.host.plain("lay")), (lip, 0.4));
    click(&mut window, "Redo");
    click(&mut window, "Setting A");
    click(&mut window, "Redo");
    assert_eq!((window.host.value("lip"), window.host.plain("lay")), (lip, 0.4));
}

#[test]
fn each_side_has_its_presets_name_and_a_copy_takes_it_along() {
    let mut window = Window::tall(Tab::Reed);
    let chose = |name: &str| vec![Action::ChosePreset(name.to_owned())];
    let (first, second) = ("B flat clarinet", "First desk");
    click(&mut window, "Setting B");
    assert_eq!(obey(&mut window), [], "B begins as A");
    window.harness.state_mut().show_presets(true);
    window.harness.run();
    click(&mut window, second);
    window.harness.state_mut().show_presets(false);
    assert_eq!(obey(&mut window), chose(second));
    click(&mut window, "Setting A");
    assert_eq!(obey(&mut window), chose(first));
    window.harness.get_by_label(&format!("Preset {first}"));
    click(&mut window, "Setting B");
    assert_eq!(obey(&mut window), chose(second));
    window.harness.get_by_label(&format!("Preset {second}"));
    click(&mut window, "Copy to A");
    click(&mut window, "Setting A");
    assert_eq!(obey(&mut window), [], "A has the name of B now");
    window.harness.get_by_label(&format!("Preset {second}"));
    // The copy is a step of the side that it was made for.
    click(&mut window, "Undo");
    assert_eq!(obey(&mut window), chose(first));
    window.harness.get_by_label(&format!("Preset {first}"));
}

#[test]
fn a_side_has_its_instrument() {
    let mut window = Window::tall(Tab::Reed);
    click(&mut window, "Setting B");
    window.host.automate("instr", 0.2);
    window.harness.run();
    // The compass of the keys would tell.
    assert!(window.harness.get_by_label("Blind").accesskit_node().is_disabled());
    click(&mut window, "Setting A");
    assert_eq!(window.host.value("instr"), 0.0);
    click(&mut window, "Setting B");
    assert_eq!(window.host.value("instr"), 0.2);
}
