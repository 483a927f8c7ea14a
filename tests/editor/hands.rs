//! Every control drags, types and resets; switches switch, choices choose; handles in pictures are taken by the hand.

use chalumeau::editor::controls;
use chalumeau::editor::controls::{Controls, Mark};
use chalumeau::editor::{Action, Tab, terms};
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::Window;
use crate::some::some;
use crate::support::{Told, whole};

/// What stands where.
const SLIDERS: &[(Tab, &[&str])] = &[
    (Tab::Reed, &["stren", "lip", "zeta", "damp", "reedh", "reeda", "lay"]),
    (
        Tab::Breath,
        &[
            "breath", "bcurve", "bsoft", "bloud", "bdead", "full", "curve", "tongue", "legato", "gliss",
            "scoop", "scoops", "fall", "falls", "slap", "bin", "ksound", "noise", "life", "vib", "vibhz",
            "vibon", "vibun", "growl", "growli", "growlf", "flut", "fluthz", "subt", "tract", "tractp",
        ],
    ),
    (
        Tab::Sound,
        &[
            "a4", "noise", "zeta", "lay", "vent", "gain", "room", "rsize", "rdecay", "rtone", "player",
            "spread", "seats",
        ],
    ),
    (
        Tab::Knob,
        &["ceil", "contr", "place", "torque", "mark", "kdamp", "kfric", "refnot", "curve", "oscprt", "oscfl"],
    ),
    (Tab::Instrument, &["a4", "transp", "temp", "vent", "tongue", "legato", "noise", "bendr", "gain"]),
];
/// Where the reed is named as its maker measures it.
const MAKER_SLIDERS: &[&str] = &["rstiff", "rarea", "rwidth", "ropen"];
/// While the instrument is heard from a position.
const LISTENING_SLIDERS: &[&str] = &["ldist", "langle", "lheigh", "lwidth"];
/// While several players play in unison.
const UNISON_SLIDERS: &[&str] = &["late"];
/// On the last page of the knob's panel.
const STUDY_SLIDERS: &[&str] = &["part", "seed", "trial"];
const SWITCHES: &[(Tab, &[&str])] =
    &[(Tab::Reed, &["reedc"]), (Tab::Breath, &["altf", "mic"]), (Tab::Knob, &["oscany"])];
const STUDY_SWITCHES: &[&str] = &["rec", "replay", "study"];
const STUDY_CHOICES: &[&str] = &["side"];
const CHOICES: &[(Tab, &[&str])] = &[
    (Tab::Reed, &["rface", "hsrc", "ksrc"]),
    (Tab::Breath, &["bfrom", "resp", "attack", "keysw", "wheel", "growlp"]),
    (Tab::Sound, &["tune", "heard", "split"]),
    (Tab::Knob, &["knob", "law", "order"]),
    (Tab::Instrument, &["tune", "beyond", "qual"]),
];
/// Parameters that no widget of that kind moves, and how they are reached; each has a test.
const OTHERWISE: &[(&str, &str)] = &[
    ("reedk", "a slider while the reed is not coupled"),
    ("arm", "the large button"),
    ("detent", "a slider under the pressure law"),
    ("instr", "the cards of the instrument view, as an action: the plugin tells the host"),
    ("kstat", "its value means nothing; its text is the line of the knob's panel"),
    ("istat", "its value means nothing; its text is the line below the cards"),
];
const MOMENTARY: &[(Tab, &str, &str)] = &[
    (Tab::Reed, "panic", "Panic"),
    (Tab::Breath, "rest", "Rest here"),
    (Tab::Breath, "blow", "Blow hard here"),
    (Tab::Breath, "miccal", "Measure the room"),
    (Tab::Knob, "takeov", "Take over"),
    (Tab::Knob, "rest", "Rest here"),
    (Tab::Knob, "blow", "Blow hard here"),
];

/// The fake host has the plugin's parameters, to which a test of the plugin holds it; each of them is drawn by a view, and
/// moved there by a test of this file.
#[test]
fn every_parameter_has_a_place() {
    let host = crate::support::Fake::default();
    assert_eq!(host.ids().len(), 109);
    let lists = [SLIDERS, SWITCHES, CHOICES].into_iter().flatten().flat_map(|(_, ids)| ids.iter());
    let placed: Vec<&str> = lists
        .chain([STUDY_SLIDERS, STUDY_SWITCHES, STUDY_CHOICES].into_iter().flatten())
        .chain([MAKER_SLIDERS, LISTENING_SLIDERS, UNISON_SLIDERS].into_iter().flatten())
        .chain(MOMENTARY.iter().map(|(_, id, _)| id))
        .chain(OTHERWISE.iter().map(|(id, _)| id))
        .copied()
        .collect();
    for id in host.ids() {
        assert!(placed.contains(id), "{id} stands nowhere");
        assert!(terms::of(id).is_some(), "{id} has no tool tip");
    }
    assert!(placed.iter().all(|id| host.ids().contains(id)));
}

#[test]
fn what_a_status_parameter_says_is_read_in_its_view() {
    let mut window = Window::tall(Tab::Instrument);
    window.harness.get_by_label("ready: B flat clarinet");
    window.harness.state_mut().kept.tab = Tab::Knob;
    // A plugin without devices has no knob to tell of but the parameter.
    window.snapshot.borrow_mut().knob = Default::default();
    window.harness.run();
    window.harness.get_by_label("no knob chosen");
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

/// The main controls of the first view: what they are called, and what they move.
const MACROS: &[(&str, &str)] = &[
    ("Curve", "bcurve"),
    ("Lip", "lip"),
    ("Reed", "stren"),
    ("Tongue", "tongue"),
    ("Facing", "lay"),
    ("Vibrato", "vib"),
    ("Growl", "growl"),
    ("Tract", "tract"),
    ("Noise", "noise"),
    ("Room", "room"),
    ("Gain", "gain"),
];

#[test]
fn every_main_control_drags_resets_and_takes_keys() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    for (name, id) in MACROS {
        let look = |window: &Window| window.host.look(id).unwrap();
        let centre = window.harness.get_by_role_and_label(Role::Slider, name).rect().center();
        window.host.told();
        let before = look(&window).value;
        let way = if before < 0.5 { -40.0 } else { 40.0 };
        window.drag(centre, vec2(0.0, way));
        assert!((look(&window).value - before) * way < 0.0, "{name} does not drag");
        let told = window.host.told();
        assert!(
            matches!(&told[0], Told::Begin(of) if of == id)
                && matches!(told.last(), Some(Told::End(of)) if of == id)
        );
        window.double_click(centre);
        assert_eq!(look(&window).value, look(&window).default, "{name} does not reset");
        window.drag(centre, vec2(0.0, way));
        let before = look(&window).value;
        window.harness.get_by_role_and_label(Role::Slider, name).focus();
        window.harness.run();
        window.harness.key_press(if way < 0.0 { Key::ArrowDown } else { Key::ArrowUp });
        window.harness.run();
        assert!((look(&window).value - before) * way > 0.0, "{name} does not move by keys");
        window.harness.key_press(Key::Delete);
        window.harness.run();
        assert_eq!(look(&window).value, look(&window).default, "{name} does not reset by keys");
        window.drag(centre, vec2(0.0, way));
        let before = look(&window).value;
        let down = if way < 0.0 { -1.0 } else { 1.0 };
        window.host.told();
        window.wheel(centre, down);
        assert!((look(&window).value - before) * way > 0.0, "{name} does not move by the wheel");
        assert!(matches!(window.host.told()[..], [Told::Begin(_), Told::Set(..), Told::End(_)]));
        window.wheel(vec2(4.0, 4.0).to_pos2(), down);
        assert!(window.host.told().is_empty(), "{name} heeds the wheel elsewhere");
        window.double_click(centre);
    }
}

#[test]
fn a_hole_on_the_stage_is_tried_and_given_back() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let open = window.snapshot.borrow().openings.clone();
    assert_eq!(window.snapshot.borrow().instrument.holes[0].name, "REG");
    window.harness.get_by_label("Hole Reg, closed").click();
    window.harness.run_steps(30);
    let mut tried: Vec<bool> = open.iter().map(|&opening| opening > 0.5).collect();
    tried[0] = true;
    assert_eq!(window.actions(), [Action::TryFingering(tried)]);
    window.harness.get_by_label("Hole Reg, open");
    window.harness.get_by_label("Back to the note").click();
    window.harness.run_steps(30);
    assert_eq!(window.actions(), [Action::EndTry]);
}

#[test]
fn every_slider_drags_types_and_resets() {
    for (tab, ids) in SLIDERS {
        let mut window = Window::tall(*tab);
        some(ids.iter().collect(), 2).into_iter().for_each(|id| drags_types_and_resets(&mut window, id));
    }
    let mut window = study();
    STUDY_SLIDERS.iter().for_each(|id| drags_types_and_resets(&mut window, id));
    let mut window = Window::tall(Tab::Reed);
    window.harness.get_by_label("Reed coupled").click();
    window.harness.run();
    drags_types_and_resets(&mut window, "reedk");
    let mut window = Window::tall(Tab::Knob);
    window.harness.get_by_label("Feel: Pressure").click();
    window.harness.run();
    drags_types_and_resets(&mut window, "detent");
    let mut window = Window::tall(Tab::Reed);
    window.harness.get_by_label("Reed description: Measured").click();
    window.harness.run();
    MAKER_SLIDERS.iter().for_each(|id| drags_types_and_resets(&mut window, id));
    let mut window = Window::tall(Tab::Sound);
    window.host.automate("heard", 0.5);
    window.harness.run();
    LISTENING_SLIDERS.iter().for_each(|id| drags_types_and_resets(&mut window, id));
    window.host.automate("split", 1.0);
    window.harness.run();
    UNISON_SLIDERS.iter().for_each(|id| drags_types_and_resets(&mut window, id));
}

fn study() -> Window {
    let mut window = Window::tall(Tab::Knob);
    window.harness.get_by_label_contains("Connection, takes").click();
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

fn chooses(window: &mut Window, id: &str) {
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
            // A slider of the same name is none of the list.
            let is_item = |node: &egui_kittest::Node<'_>| node.accesskit_node().role() != Role::Slider;
            let items = window.harness.get_all_by_label(&text).filter(is_item).collect::<Vec<_>>();
            items.last().unwrap().click();
        }
        window.harness.run();
        assert_eq!(window.host.value(id), value, "{id}: {text}");
    }
}

#[test]
fn every_choice_chooses() {
    for (tab, ids) in CHOICES {
        let mut window = Window::tall(*tab);
        ids.iter().for_each(|id| chooses(&mut window, id));
    }
    let mut window = study();
    STUDY_CHOICES.iter().for_each(|id| chooses(&mut window, id));
}

/// Frames of the tests' clock in the least time of a press.
const LEAST_FRAMES: usize = (controls::LEAST_PRESS_S * 60.0) as usize;

/// The plugin looks at its parameters once a block: what is on for one frame only may never be seen.
#[test]
fn a_button_that_acts_is_on_while_it_is_held_and_a_tenth_of_a_second_at_least() {
    for (tab, id, label) in MOMENTARY {
        let id = || (*id).to_owned();
        let press = || [Told::Begin(id()), Told::Set(id(), 1.0)];
        let release = || [Told::Set(id(), 0.0), Told::End(id())];
        let mut window = Window::tall(*tab);
        // The room is measured with a microphone.
        window.host.automate("mic", 1.0);
        window.harness.run();
        window.host.told();
        let at = window.harness.get_by_label(label).rect().center();

        // Held for a second by the mouse.
        window.harness.hover_at(at);
        window.harness.drag_at(at);
        window.harness.run_steps(60);
        assert_eq!(window.host.told(), press(), "{label} is down");
        window.harness.drop_at(at);
        window.harness.run_steps(2);
        assert_eq!(window.host.told(), release(), "{label} is up");

        // A quick click, both ends of it in one frame.
        window.harness.hover_at(at);
        window.harness.step();
        for pressed in [true, false] {
            let (button, modifiers) = (egui::PointerButton::Primary, Modifiers::NONE);
            window.harness.input_mut().events.push(egui::Event::PointerButton {
                pos: at,
                button,
                pressed,
                modifiers,
            });
        }
        window.harness.run_steps(LEAST_FRAMES - 2);
        assert_eq!(window.host.told(), press(), "{label} is on for a while");
        window.harness.run_steps(4);
        assert_eq!(window.host.told(), release(), "{label} goes off by itself");

        // Held by a key.
        window.harness.get_by_label(label).focus();
        window.harness.run();
        window.harness.key_down(Key::Space);
        window.harness.run_steps(30);
        assert_eq!(window.host.told(), press(), "{label} by the Space bar");
        window.harness.key_up(Key::Space);
        window.harness.run_steps(2);
        assert_eq!(window.host.told(), release(), "{label} by the Space bar");

        // Nothing of it is a step to take back.
        assert!(window.harness.get_by_label("Undo").accesskit_node().is_disabled());
    }
}

#[test]
fn a_button_that_vanishes_or_closes_while_it_is_down_lets_go() {
    let mut window = Window::tall(Tab::Breath);
    let at = window.harness.get_by_label("Rest here").rect().center();
    for is_closed in [false, true] {
        window.harness.state_mut().kept.tab = Tab::Breath;
        window.harness.run();
        window.harness.hover_at(at);
        window.harness.drag_at(at);
        window.harness.run_steps(3);
        assert_eq!(window.host.value("rest"), 1.0);
        if is_closed {
            let host = window.host.clone();
            window.harness.state_mut().close(&*host);
        } else {
            window.harness.state_mut().kept.tab = Tab::Sound;
            window.harness.run_steps(LEAST_FRAMES + 2);
        }
        assert_eq!(window.host.value("rest"), 0.0);
        assert!(matches!(window.host.told().last(), Some(Told::End(id)) if id == "rest"));
        window.harness.drop_at(at);
        window.harness.run();
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
fn a_makers_reed_is_taken_by_the_hand() {
    let mut window = Window::tall(Tab::Reed);
    window.harness.get_by_label("Reed description: Measured").click();
    window.harness.run();
    let (peak, closure) = ("Peak of the flow: w", "Closure of the reed: K");
    let at = |window: &Window, name: &str| window.harness.get_by_label(name).rect().center();
    for (name, id, by) in [(peak, "rwidth", vec2(0.0, -30.0)), (closure, "rstiff", vec2(25.0, 0.0))] {
        let (from, before) = (at(&window, name), window.host.plain(id));
        window.drag(from, by);
        assert!(window.host.plain(id) > 1.03 * before, "{id}");
        let moved = at(&window, name) - from - by;
        // Sideways the peak stays at a third of closure.
        assert!((moved * by.normalized()).length() < 3.0, "{name} leaves the hand by {moved:?}");
        window.harness.get_by_label("Undo").click();
        window.harness.run();
        assert!((window.host.plain(id) / before - 1.0).abs() < 1e-5);
    }
}

#[test]
fn wrong_text_is_kept_until_it_is_right_and_leaving_it_changes_nothing() {
    let mut window = Window::tall(Tab::Reed);
    // Escape would stop an armed knob, too.
    window.host.automate("arm", 0.0);
    window.snapshot.borrow_mut().knob.is_armed = false;
    let open = |window: &mut Window| {
        let at = window.harness.get_by_role_and_label(Role::Slider, "Lip opening").rect().right_top()
            + vec2(-8.0, 9.0);
        window.harness.drag_at(at);
        window.harness.drop_at(at);
        window.harness.run();
    };
    open(&mut window);
    let range = terms::of("lip").unwrap().range();
    assert!(window.harness.query_by_label(&range).is_none());
    // No number, and one that hosts would take for the end of the range.
    for text in ["much", "5555"] {
        window.harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.harness.get_by_label("Lip opening, value").type_text(text);
        window.harness.key_press(Key::Enter);
        window.harness.run();
        assert!(window.harness.query_by_label("Lip opening, value").is_some(), "{text}");
        window.harness.get_by_label(&range);
        assert_eq!(window.host.plain("lip"), 1.0, "{text}");
    }
    window.harness.key_press(Key::Escape);
    window.harness.run();
    assert!(window.harness.query_by_label("Lip opening, value").is_none());
    assert_eq!(window.host.plain("lip"), 1.0);
    assert!(window.host.told().is_empty());
}

#[test]
fn a_round_control_takes_a_typed_value() {
    let mut window = Window::new(Tab::Play, chalumeau::editor::SIZE);
    window.harness.get_by_role_and_label(Role::Slider, "Reed").focus();
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    window.harness.get_by_label("Reed strength, value").type_text("3.5");
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    assert_eq!(window.host.plain("stren"), 3.5);
    assert!(window.harness.query_by_label("Reed strength, value").is_none());
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

#[test]
fn a_right_click_asks_for_the_hosts_menu_and_moves_nothing() {
    let mut window = Window::tall(Tab::Knob);
    window.host.told();
    let contrast = window.harness.get_by_role_and_label(Role::Slider, "Feel contrast").rect().center();
    window.harness.get_by_role_and_label(Role::Slider, "Feel contrast").click_secondary();
    window.harness.run();
    let at = (contrast.x.round() as i32, contrast.y.round() as i32);
    assert_eq!(window.host.menus(), [("contr".to_owned(), at)]);
    for (role, name, id) in
        [(Role::ComboBox, "Feel order", "order"), (Role::Switch, "OSC from network", "oscany")]
    {
        window.harness.get_by_role_and_label(role, name).click_secondary();
        window.harness.run();
        let asked: Vec<_> = window.host.menus().into_iter().map(|(asked, _)| asked).collect();
        assert_eq!(asked, [id]);
    }
    assert!(window.host.told().is_empty());
}

#[test]
fn what_a_host_has_tied_to_a_parameter_is_a_dot_of_its_colour() {
    let dots = |window: &mut Window| {
        let picture = whole(&window.harness);
        picture.pixels().filter(|pixel| pixel.0 == [255, 0, 254, 255]).count()
    };
    let mut window = Window::tall(Tab::Knob);
    assert_eq!(dots(&mut window), 0);
    for id in ["contr", "order"] {
        let before = dots(&mut window);
        window.host.mark(id, Mark { colour: Some([255, 0, 254]), text: "Mapped: Knob 3".to_owned() });
        window.harness.run();
        assert!(dots(&mut window) > before + 10, "{id}");
    }
}
