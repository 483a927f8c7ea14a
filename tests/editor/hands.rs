//! Every control drags, types and resets; switches switch, choices choose; handles in pictures are taken by the hand.

use chalumeau::editor::controls::Controls;
use chalumeau::editor::{Action, Tab, terms};
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable;

use crate::Window;
use crate::support::Told;

/// What stands where.
const SLIDERS: &[(Tab, &[&str])] = &[
    (Tab::Reed, &["stren", "lip", "zeta", "damp", "reedh", "reeda", "lay"]),
    (Tab::Breath, &["breath", "full", "curve", "tongue", "legato", "noise"]),
    (Tab::Sound, &["a4", "noise", "zeta", "lay", "vent", "gain"]),
    (
        Tab::Knob,
        &["ceil", "contr", "torque", "detent", "kdamp", "kfric", "refnot", "curve", "oscprt", "oscfl"],
    ),
    (Tab::Instrument, &["a4", "temp", "vent", "tongue", "legato", "noise", "gain"]),
];
/// On the last page of the knob's panel.
const STUDY_SLIDERS: &[&str] = &["part", "seed", "trial"];
const SWITCHES: &[(Tab, &[&str])] = &[(Tab::Reed, &["reedc"]), (Tab::Knob, &["oscany"])];
const STUDY_SWITCHES: &[&str] = &["rec", "replay", "study", "side"];
const CHOICES: &[(Tab, &[&str])] = &[
    (Tab::Reed, &["hsrc", "ksrc"]),
    (Tab::Sound, &["tune"]),
    (Tab::Knob, &["knob", "law", "order"]),
    (Tab::Instrument, &["tune"]),
];
const MOMENTARY: &[(Tab, &str, &str)] = &[
    (Tab::Reed, "panic", "Panic"),
    (Tab::Breath, "rest", "Rest here"),
    (Tab::Breath, "blow", "Blow hard here"),
    (Tab::Knob, "takeov", "Take over the knob"),
];

#[test]
fn every_parameter_has_a_place() {
    let host = crate::support::Fake::default();
    let lists = [SLIDERS, SWITCHES, CHOICES].into_iter().flatten().flat_map(|(_, ids)| ids.iter());
    let placed: Vec<&str> = lists
        .chain([STUDY_SLIDERS, STUDY_SWITCHES].into_iter().flatten())
        .chain(MOMENTARY.iter().map(|(_, id, _)| id))
        // k while free, below; the large button, below; and a parameter whose text alone says something.
        .chain(&["reedk", "arm", "kstat"])
        .copied()
        .collect();
    for id in host.ids() {
        assert!(placed.contains(id), "{id} stands nowhere");
        assert!(terms::of(id).is_some(), "{id} has no tool tip");
    }
    assert!(placed.iter().all(|id| host.ids().contains(id)));
}

fn drags_types_and_resets(window: &mut Window, id: &str) {
    let look = |window: &Window| window.host.look(id).unwrap();
    let name = look(window).name;
    let rect = |window: &Window| window.harness.get_by_role_and_label(Role::Slider, &name).rect();
    window.host.told();

    // By the hand.
    let before = look(window).value;
    let way = if before < 0.5 { 60.0 } else { -60.0 };
    let centre = rect(window).center();
    window.drag(centre, vec2(way, 0.0));
    let dragged = look(window).value;
    assert!((dragged - before) * way > 0.0, "{id} does not drag: {before} {dragged}");
    let told = window.host.told();
    assert!(
        matches!(&told[0], Told::Begin(of) if of == id)
            && matches!(told.last(), Some(Told::End(of)) if of == id)
    );

    // To its default, both ways.
    window.harness.get_by_role_and_label(Role::Slider, &name).click_modifiers(Modifiers::COMMAND);
    window.harness.run();
    assert_eq!(look(window).value, look(window).default, "{id} does not reset by Ctrl-click");
    window.drag(centre, vec2(way, 0.0));
    window.double_click(centre);
    assert_eq!(look(window).value, look(window).default, "{id} does not reset by a double click");

    // By text: what stands at three quarters of the way.
    let text = window.host.text(id, 0.75);
    let value_at = rect(window).right_top() + vec2(-8.0, 9.0);
    window.harness.drag_at(value_at);
    window.harness.drop_at(value_at);
    window.harness.run();
    let field = format!("{name}, value");
    window.harness.get_by_label(&field).type_text(&text);
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    assert!(window.harness.query_by_label(&field).is_none(), "{id} does not take {text}");
    assert_eq!(window.host.text(id, look(window).value), text, "{id} types");

    // By keys.
    let before = look(window).value;
    window.harness.get_by_role_and_label(Role::Slider, &name).focus();
    window.harness.run();
    window.harness.key_press(Key::ArrowLeft);
    window.harness.run();
    assert!(look(window).value < before, "{id} does not move by keys");
    window.harness.key_press(Key::Delete);
    window.harness.run();
    assert_eq!(look(window).value, look(window).default, "{id} does not reset by keys");
}

#[test]
fn every_slider_drags_types_and_resets() {
    for (tab, ids) in SLIDERS {
        let mut window = Window::tall(*tab);
        ids.iter().for_each(|id| drags_types_and_resets(&mut window, id));
    }
    let mut window = study();
    STUDY_SLIDERS.iter().for_each(|id| drags_types_and_resets(&mut window, id));
    let mut window = Window::tall(Tab::Reed);
    window.harness.get_by_label("Reed coupled").click();
    window.harness.run();
    drags_types_and_resets(&mut window, "reedk");
}

fn study() -> Window {
    let mut window = Window::tall(Tab::Knob);
    window.harness.get_by_label_contains("Line, takes, studies").click();
    window.harness.run();
    window
}

fn switches(window: &mut Window, id: &str) {
    let name = window.host.look(id).unwrap().name;
    let before = window.host.value(id);
    for wanted in [1.0 - before, before] {
        window.harness.get_by_role_and_label(Role::Switch, &name).click();
        window.harness.run();
        assert_eq!(window.host.value(id), wanted, "{id}");
    }
    window.harness.get_by_role_and_label(Role::Switch, &name).focus();
    window.harness.run();
    window.harness.key_press(Key::Space);
    window.harness.run();
    assert_eq!(window.host.value(id), 1.0 - before, "{id} by the Space bar");
}

#[test]
fn every_switch_switches() {
    for (tab, ids) in SWITCHES {
        let mut window = Window::tall(*tab);
        ids.iter().for_each(|id| switches(&mut window, id));
    }
    let mut window = study();
    STUDY_SWITCHES.iter().for_each(|id| switches(&mut window, id));
}

#[test]
fn every_choice_chooses() {
    for (tab, ids) in CHOICES {
        let mut window = Window::tall(*tab);
        for id in *ids {
            let look = window.host.look(id).unwrap();
            let steps = look.steps.unwrap();
            for step in (0..=steps).rev() {
                let value = step as f32 / steps as f32;
                let text = window.host.text(id, value);
                let side_by_side = format!("{}: {text}", look.name);
                if window.harness.query_by_label(&side_by_side).is_some() {
                    window.harness.get_by_label(&side_by_side).click();
                } else {
                    window.harness.get_by_role_and_label(Role::ComboBox, &look.name).click();
                    window.harness.run();
                    let items = window.harness.get_all_by_label(&text).collect::<Vec<_>>();
                    items.last().unwrap().click();
                }
                window.harness.run();
                assert_eq!(window.host.value(id), value, "{id}: {text}");
            }
        }
    }
}

#[test]
fn what_acts_acts_once() {
    for (tab, id, label) in MOMENTARY {
        let mut window = Window::tall(*tab);
        window.host.told();
        window.harness.get_by_label(label).click();
        window.harness.run();
        let id = || (*id).to_owned();
        let told = window.host.told();
        assert_eq!(told, [Told::Begin(id()), Told::Set(id(), 1.0), Told::Set(id(), 0.0), Told::End(id())]);
    }
}

#[test]
fn h_and_k_are_taken_by_the_hand() {
    let peak = "Peak of the flow: H";
    let closure = "Closure of the reed: k";
    let at = |window: &Window, name: &str| window.harness.get_by_label(name).rect().center();

    // Coupled: closure to the right is a smaller H, and the handle stays under the hand.
    let mut window = Window::tall(Tab::Reed);
    let (from, h) = (at(&window, closure), window.host.plain("reedh"));
    window.drag(from, vec2(30.0, 0.0));
    assert!(window.host.plain("reedh") < h - 0.05);
    assert!((at(&window, closure) - from - vec2(30.0, 0.0)).length() < 3.0);
    let (from, a) = (at(&window, peak), window.host.plain("reeda"));
    window.drag(from, vec2(0.0, -40.0));
    assert!(window.host.plain("reeda") > a + 0.05);

    // One step each: back to where it was.
    for _ in 0..2 {
        window.harness.get_by_label("Undo").click();
        window.harness.run();
    }
    assert_eq!((window.host.plain("reedh"), window.host.plain("reeda")), (h, a));

    // Free: the peak is H, closure is k.
    window.harness.get_by_label("Reed coupled").click();
    window.harness.run();
    let k = window.host.plain("reedk");
    let from = at(&window, closure);
    window.drag(from, vec2(25.0, 10.0));
    assert!(window.host.plain("reedk") > k + 0.02);
    assert_eq!(window.host.plain("reedh"), h);
    let from = at(&window, peak);
    window.drag(from, vec2(0.0, -30.0));
    assert!(window.host.plain("reedh") > h + 0.02);

    // By keys, and to the default by a double click.
    window.harness.get_by_label(peak).focus();
    window.harness.run();
    let before = window.host.plain("reedh");
    window.harness.key_press(Key::ArrowDown);
    window.harness.run();
    assert!(window.host.plain("reedh") < before);
    let place = at(&window, peak);
    window.double_click(place);
    assert_eq!(window.host.value("reedh"), window.host.look("reedh").unwrap().default);
}

#[test]
fn wrong_text_is_kept_until_it_is_right_and_leaving_it_changes_nothing() {
    let mut window = Window::tall(Tab::Reed);
    let open = |window: &mut Window| {
        let at = window.harness.get_by_role_and_label(Role::Slider, "Lip opening").rect().right_top()
            + vec2(-8.0, 9.0);
        window.harness.drag_at(at);
        window.harness.drop_at(at);
        window.harness.run();
    };
    open(&mut window);
    window.harness.get_by_label("Lip opening, value").type_text("much");
    window.harness.key_press(Key::Enter);
    window.harness.run();
    assert!(window.harness.query_by_label("Lip opening, value").is_some());
    window.harness.key_press(Key::Escape);
    window.harness.run();
    assert!(window.harness.query_by_label("Lip opening, value").is_none());
    assert_eq!(window.host.plain("lip"), 1.0);
    assert!(window.host.told().is_empty());
}

#[test]
fn automation_shows_at_once() {
    let mut window = Window::tall(Tab::Reed);
    window.host.automate("lip", 0.9);
    window.harness.run();
    let text = window.host.text("lip", 0.9);
    assert_eq!(window.harness.get_by_role_and_label(Role::Slider, "Lip opening").value(), Some(text));
    assert_eq!(window.actions(), Vec::<Action>::new());
}
