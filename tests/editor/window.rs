//! The window as a whole: tabs, undo, A/B, keys, holes, knob; whose the keyboard is; when it repaints.

use std::collections::BTreeSet;
use std::path::PathBuf;

use chalumeau::controllers::breath_input::BreathInput;
use chalumeau::editor::connections::{Connections, DeviceChoice, DeviceLists, OutputChoice};
use chalumeau::editor::controls::Controls;
use chalumeau::editor::note_names::NoteNames;
use chalumeau::editor::{Action, FeelTest, Tab};
use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::units::SoundingNote;
use egui::accesskit::Role;
use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::{NodeT, Queryable};

use crate::Window;
use crate::support::{Told, whole};

fn click(window: &mut Window, label: &str) {
    window.harness.get_by_label(label).click();
    window.harness.run();
}

/// The row is drawn at the left of the keys; the keys that play move aside.
#[test]
fn key_switches_stand_beside_the_keys_and_are_struck_like_them() {
    let mut window = Window::new(Tab::Breath, (1100.0, 720.0));
    let rect = window.harness.get_by_label_contains("Keyboard").rect();
    let corner = rect.left_bottom() + vec2(8.0, -6.0);
    let struck = |window: &mut Window, at: egui::Pos2| {
        window.drag(at, vec2(0.0, -1.0));
        let first = window.actions().first().cloned();
        let Some(Action::NoteOn { note, .. }) = first else { panic!("{first:?}") };
        note.0
    };
    assert_eq!(struck(&mut window, corner), 50);
    for (switches, lowest) in [(0.5, 24), (1.0, 36)] {
        window.host.automate("keysw", switches);
        window.harness.run();
        // Three white keys, and a black one between the first two.
        for (x, key) in [(8.0, 0), (60.0, 2), (112.0, 4)] {
            assert_eq!(struck(&mut window, rect.left_bottom() + vec2(x, -6.0)), lowest + key);
        }
        assert_eq!(struck(&mut window, rect.left_top() + vec2(52.0, 8.0)), lowest + 1);
        assert_eq!(struck(&mut window, corner + vec2(170.0, 0.0)), 50, "the keys that play");
    }
}

#[test]
fn tabs_lead_to_views_and_are_kept() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    for (tab, shows) in [
        (Tab::Clarinet, "Fingering C4"),
        (Tab::Breath, "Rest here"),
        (Tab::Sound, "Spectrum of the sound"),
        (Tab::Knob, "Stop the knob"),
        (Tab::Instrument, "Instrument Bass clarinet"),
        (Tab::Reed, "Peak of the flow: H"),
    ] {
        window.harness.get_by_role_and_label(Role::Tab, tab.name()).click();
        window.harness.run();
        window.harness.get_by_label(shows);
        assert_eq!(window.harness.state().kept.tab, tab);
    }
}

#[test]
fn undo_and_redo_walk_through_gestures() {
    let mut window = Window::tall(Tab::Reed);
    for name in ["Lip opening", "Facing"] {
        let at = window.harness.get_by_role_and_label(Role::Slider, name).rect().center();
        window.drag(at, vec2(-50.0, 0.0));
    }
    let (lip, lay) = (window.host.value("lip"), window.host.value("lay"));
    click(&mut window, "Undo");
    assert_eq!((window.host.plain("lay"), window.host.value("lip")), (0.4, lip));
    click(&mut window, "Undo");
    assert_eq!(window.host.plain("lip"), 1.0);
    click(&mut window, "Redo");
    click(&mut window, "Redo");
    assert_eq!((window.host.value("lip"), window.host.value("lay")), (lip, lay));
}

#[test]
fn keys_play_slur_and_let_go() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    let keys = window.harness.get_by_label_contains("Keyboard").rect();
    let (first, second) = (keys.left_bottom() + vec2(8.0, -6.0), keys.left_bottom() + vec2(60.0, -6.0));
    window.drag(first, second - first);
    let done = window.actions();
    let notes = |on: bool| -> Vec<SoundingNote> {
        done.iter()
            .filter_map(|action| match action {
                Action::NoteOn { note, .. } if on => Some(*note),
                Action::NoteOff { note } if !on => Some(*note),
                _ => None,
            })
            .collect()
    };
    assert_eq!(notes(true), [SoundingNote(50), SoundingNote(52)]);
    assert_eq!(notes(false), notes(true));
    assert!(
        matches!(done[1], Action::NoteOn { .. }),
        "a slur: the new note before the old one ends: {done:?}"
    );

    window.harness.get_by_label_contains("Keyboard").focus();
    window.harness.run();
    window.harness.key_down(Key::Space);
    window.harness.run();
    assert!(matches!(window.actions()[..], [Action::NoteOn { .. }]));
    let left = {
        let host = window.host.clone();
        window.harness.state_mut().close(&*host)
    };
    assert!(matches!(left[..], [Action::NoteOff { .. }]), "a window that closes lets go: {left:?}");
}

#[test]
fn letters_play_in_a_window_without_a_host_only() {
    let type_key = |window: &mut Window, keys: &[(Key, bool)]| {
        for &(key, pressed) in keys {
            let modifiers = egui::Modifiers::NONE;
            window.harness.event(egui::Event::Key {
                key,
                physical_key: None,
                pressed,
                repeat: false,
                modifiers,
            });
        }
        window.harness.run();
        window.actions()
    };
    let on = |note: u8| Action::NoteOn { note: SoundingNote(note), velocity: 0.75 };
    let off = |note: u8| Action::NoteOff { note: SoundingNote(note) };
    let mut window = Window::new(Tab::Play, chalumeau::editor::SIZE);
    assert_eq!(type_key(&mut window, &[(Key::A, true), (Key::A, false)]), [], "a host has the letters");

    let state = std::mem::take(window.harness.state_mut());
    *window.harness.state_mut() = state.with_letters();
    assert_eq!(type_key(&mut window, &[(Key::A, true)]), [on(60)]);
    assert_eq!(type_key(&mut window, &[(Key::W, true)]), [on(61)]);
    assert_eq!(type_key(&mut window, &[(Key::A, false)]), [off(60)]);
    assert_eq!(type_key(&mut window, &[(Key::W, false), (Key::W, true)]), [], "a repeat is no new stroke");
    assert_eq!(type_key(&mut window, &[(Key::PageUp, true), (Key::PageUp, false)]), []);
    assert_eq!(type_key(&mut window, &[(Key::W, false), (Key::S, true)]), [off(61), on(74)]);
    // C and V make what follows softer and louder.
    for _ in 0..3 {
        assert_eq!(type_key(&mut window, &[(Key::C, true), (Key::C, false)]), []);
    }
    let [Action::NoteOn { velocity, .. }] = type_key(&mut window, &[(Key::D, true)])[..] else {
        panic!("no note")
    };
    assert_eq!(velocity, 0.375);
    for _ in 0..3 {
        type_key(&mut window, &[(Key::V, true), (Key::V, false)]);
    }
    assert_eq!(type_key(&mut window, &[(Key::D, false)]), [off(76)]);
    window.harness.event(egui::Event::WindowFocused(false));
    window.harness.run();
    assert_eq!(window.actions(), [off(74)], "who leaves the window lets go");
    assert_eq!(type_key(&mut window, &[(Key::S, false)]), []);
    // Below the lowest key and above the highest there is nothing.
    for (key, note) in [(Key::PageUp, 84), (Key::PageDown, 48)] {
        for _ in 0..9 {
            type_key(&mut window, &[(key, true), (key, false)]);
        }
        let note = if key == Key::PageDown { note + 4 } else { note };
        let letter = if key == Key::PageDown { Key::D } else { Key::A };
        assert_eq!(type_key(&mut window, &[(letter, true)]), [on(note)]);
        assert_eq!(type_key(&mut window, &[(letter, false)]), [off(note)]);
    }
    assert_eq!(type_key(&mut window, &[(Key::A, true)]), [], "C3 is below the clarinet");
    type_key(&mut window, &[(Key::A, false)]);

    window.harness.state_mut().kept.tab = Tab::Reed;
    window.harness.run();
    let name = window.host.look("stren").unwrap().name;
    let value =
        window.harness.get_by_role_and_label(Role::Slider, &name).rect().right_top() + vec2(-8.0, 9.0);
    window.harness.drag_at(value);
    window.harness.drop_at(value);
    window.harness.run();
    window.actions();
    assert_eq!(type_key(&mut window, &[(Key::D, true), (Key::D, false)]), [], "text is text");
}

#[test]
fn a_multiphonic_is_tried_like_any_fingering() {
    let mut window = Window::tall(Tab::Clarinet);
    click(&mut window, "Fingering M3");
    let done = window.actions();
    let [Action::TryFingering(open)] = &done[..] else { panic!("{done:?}") };
    let file = window.snapshot.borrow().instrument.clone();
    let names: Vec<&str> =
        file.holes.iter().zip(open).filter(|(_, open)| **open).map(|(hole, _)| hole.name.as_str()).collect();
    let known = &chalumeau_core::measure::multiphonics::built_in()[2];
    assert_eq!(names.len(), known.open.split_whitespace().count(), "{names:?}");
    assert!(known.open.split_whitespace().all(|name| names.contains(&name)), "{names:?}");
    let tones: Vec<String> = known.partials_hz.iter().map(|hz| format!("{hz:.0}")).collect();
    window.harness.get_by_label_contains(&format!("Tones at {} Hz", tones.join(", ")));
}

#[test]
fn what_vanishes_under_the_hand_is_let_go() {
    let mut window = Window::tall(Tab::Reed);
    window.host.told();
    let at = window.harness.get_by_role_and_label(Role::Slider, "Lip opening").rect().center();
    for hold in [at, at + vec2(30.0, 0.0)] {
        window.harness.hover_at(hold);
        if hold == at {
            window.harness.drag_at(at);
        }
        window.harness.step();
    }
    window.harness.state_mut().kept.tab = Tab::Sound;
    window.harness.step();
    window.harness.drop_at(at);
    window.harness.run_steps(3);
    assert!(matches!(window.host.told().last(), Some(Told::End(id)) if id == "lip"));
    // And it is one step to take back.
    click(&mut window, "Undo");
    assert_eq!(window.host.plain("lip"), 1.0);

    // So is a window that closes.
    window.harness.state_mut().kept.tab = Tab::Reed;
    window.harness.run();
    window.harness.hover_at(at);
    window.harness.drag_at(at);
    window.harness.step();
    window.harness.hover_at(at + vec2(30.0, 0.0));
    window.harness.step();
    let host = window.host.clone();
    window.harness.state_mut().close(&*host);
    assert!(matches!(host.told().last(), Some(Told::End(id)) if id == "lip"));
}

/// Pages that no tab shows by itself, for people: `EDITOR_PICTURES=FOLDER`.
#[test]
#[ignore = "writes pictures for people"]
fn pictures_of_pages() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let folder =
        folder.join(std::env::var("EDITOR_PICTURES").unwrap_or_else(|_| "target/editor-pages".into()));
    std::fs::create_dir_all(&folder).unwrap();
    let save = |window: &mut Window, name: &str| {
        let picture = whole(&window.harness);
        picture.save(folder.join(format!("{name}.png"))).unwrap();
    };
    let mut window = Window::new(Tab::Knob, (1100.0, 720.0));
    click(&mut window, "Page: Feel test");
    click(&mut window, "Feel test: Threshold");
    save(&mut window, "feel-test");
    click(&mut window, "Page: Connection, takes");
    save(&mut window, "line");
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    click(&mut window, "Hole L3, closed");
    window.harness.get_by_label("Hole L3, open").hover();
    window.harness.run_steps(60);
    save(&mut window, "trying");
    let mut window = Window::new(Tab::Breath, (1100.0, 720.0));
    for source in &mut window.snapshot.borrow_mut().sources {
        source.is_live = source.input == BreathInput::Expression;
    }
    window.host.automate("keysw", 0.5);
    window.harness.run();
    click(&mut window, "Own curve for CC11 expression");
    save(&mut window, "own-curve");
    let mut window = Window::new(Tab::Sound, (1100.0, 900.0));
    window.host.automate("heard", 0.5);
    window.harness.run();
    save(&mut window, "listening");
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    window.harness.get_by_role_and_label(Role::Slider, "Embouchure").hover();
    window.harness.run_steps(60);
    save(&mut window, "tool-tip");
    click(&mut window, "Setting B");
    window.host.automate("lip", 0.9);
    window.harness.run();
    let at = window.harness.get_by_role_and_label(Role::Slider, "Reed strength").rect();
    let value = at.right_top() + vec2(-8.0, 9.0);
    window.harness.drag_at(value);
    window.harness.drop_at(value);
    window.harness.run();
    save(&mut window, "typing");
    window.harness.key_press(Key::Escape);
    window.harness.run();
    click(&mut window, "Blind");
    click(&mut window, "Side Y");
    save(&mut window, "blind");
    click(&mut window, "Reveal");
    save(&mut window, "revealed");
    for (size, name) in [((1100.0, 720.0), "play"), ((700.0, 480.0), "play-small")] {
        let mut window = Window::new(Tab::Play, size);
        window.snapshot.borrow_mut().sounding = None;
        click(&mut window, "Hole L3, closed");
        save(&mut window, &format!("{name}-trying"));
        let at = window.harness.get_by_label_contains("Hole R2, ").rect().center();
        window.drag(at, vec2(-12.0, 0.0));
        window.snapshot.borrow_mut().saved = Some(Ok("/home/music/mine_1.toml".into()));
        window.harness.run();
        save(&mut window, &format!("{name}-altered"));
    }
    for of in [Bundled::EFlat, Bundled::Bass] {
        let mut window = Window::new(Tab::Play, (1100.0, 720.0));
        let file = of.file();
        let larger = (file.length_m() / window.snapshot.borrow().instrument.length_m()) as f32;
        {
            let mut snapshot = window.snapshot.borrow_mut();
            snapshot.standing.iter_mut().for_each(|(x_m, _)| *x_m *= larger);
            snapshot.as_built = file.clone().into();
            snapshot.instrument = file.into();
        }
        window.harness.run();
        save(&mut window, &format!("play-{}", of.id()));
    }
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    *window.snapshot.borrow_mut() = chalumeau::editor::Snapshot::default();
    window.harness.run();
    save(&mut window, "nothing");
}

#[test]
fn holes_are_tried_and_given_back() {
    let mut window = Window::new(Tab::Clarinet, (1100.0, 720.0));
    let file = window.snapshot.borrow().instrument.clone();
    let open: Vec<bool> = window.snapshot.borrow().openings.iter().map(|&opening| opening > 0.5).collect();
    let l3 = file.hole("L3").unwrap();
    window.harness.get_by_label("Hole L3, closed").click();
    window.harness.run();
    let mut wanted = open;
    wanted[l3] = true;
    assert_eq!(window.actions(), [Action::TryFingering(wanted)]);
    window.harness.get_by_label("Hole L3, open");
    click(&mut window, "Fingering G4");
    let g4 = &file.fingering(chalumeau_core::units::WrittenNote(67)).unwrap().open;
    assert_eq!(window.actions(), [Action::TryFingering(g4.clone())]);
    // The trial is the same in every view.
    click(&mut window, "Play");
    window.harness.get_by_label("Trying G4");
    click(&mut window, "Back to the note");
    assert_eq!(window.actions(), [Action::EndTry]);
    click(&mut window, "Clarinet");
    assert!(window.harness.query_by_label("trying").is_none());

    // Alternates stand behind the note they play.
    click(&mut window, "Fingering Eb4''");
    window.harness.get_by_label("trying");
    window.harness.get_by_label("Eb4'' chalumeau, alternate fingering: T L1 R1 (fork)");
    let [Action::TryFingering(fork)] = &window.actions()[..] else { panic!("no fingering is tried") };
    assert!(!fork[file.hole("R1").unwrap()] && fork[file.hole("L2").unwrap()]);
}

#[test]
fn the_knob_is_armed_and_stopped_by_large_buttons_that_stand_apart() {
    let mut window = Window::tall(Tab::Knob);
    window.snapshot.borrow_mut().knob.is_armed = false;
    window.harness.run();
    click(&mut window, "Arm the knob");
    assert_eq!(window.host.value("arm"), 1.0);
    assert!(window.harness.get_by_label("Arm the knob").accesskit_node().is_disabled());
    window.snapshot.borrow_mut().knob.is_armed = true;
    window.harness.run();
    let stops = |actions: Vec<Action>| !actions.is_empty() && actions.iter().all(|a| *a == Action::StopKnob);
    click(&mut window, "Stop the knob");
    assert_eq!(window.host.value("arm"), 0.0);
    assert!(stops(window.actions()));
    // Another press stops once more, and arms nothing.
    window.snapshot.borrow_mut().knob.is_armed = false;
    window.harness.run();
    click(&mut window, "Stop the knob");
    assert_eq!(window.host.value("arm"), 0.0);
    assert!(stops(window.actions()));
    // Undo takes back no arming.
    assert!(window.harness.get_by_label("Undo").accesskit_node().is_disabled());
    // A knob that let go by itself: a press takes the wish back.
    window.host.automate("arm", 1.0);
    window.harness.run();
    click(&mut window, "Stop the knob");
    assert_eq!(window.host.value("arm"), 0.0);
}

#[test]
fn stop_acts_when_it_is_pressed_even_if_the_pointer_slips_and_while_the_knob_is_still_arming() {
    for is_arming in [false, true] {
        let mut window = Window::tall(Tab::Knob);
        window.host.automate("arm", 1.0);
        let knob = (!is_arming, is_arming);
        (window.snapshot.borrow_mut().knob.is_armed, window.snapshot.borrow_mut().knob.is_arming) = knob;
        window.harness.run();
        window.actions();
        let at = window.harness.get_by_label("Stop the knob").rect().center();
        let press = |pressed, pos| egui::Event::PointerButton {
            pos,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        };
        window.harness.event(egui::Event::PointerMoved(at));
        window.harness.event(press(true, at));
        window.harness.step();
        assert_eq!(window.host.value("arm"), 0.0);
        assert!(window.actions().contains(&Action::StopKnob), "arming: {is_arming}");
        let slipped = at + egui::vec2(40.0, 30.0);
        window.harness.event(egui::Event::PointerMoved(slipped));
        window.harness.event(press(false, slipped));
        window.harness.run();
        assert_eq!(window.host.value("arm"), 0.0);
    }
}

#[test]
fn escape_stops_the_knob_in_every_view_and_the_large_button_takes_keys() {
    for tab in Tab::ALL {
        let mut window = Window::tall(tab);
        window.host.automate("arm", 1.0);
        window.snapshot.borrow_mut().knob.is_armed = true;
        window.harness.run();
        window.actions();
        window.harness.key_press(Key::Escape);
        window.harness.run();
        assert_eq!(window.actions(), [Action::StopKnob], "{}", tab.name());
        assert_eq!(window.host.value("arm"), 0.0, "{}", tab.name());
        // Of a knob that is limp Escape wants nothing.
        window.snapshot.borrow_mut().knob.is_armed = false;
        window.harness.run();
        window.harness.key_press(Key::Escape);
        window.harness.run();
        assert_eq!(window.actions(), [], "{}", tab.name());
    }
    let mut window = Window::tall(Tab::Knob);
    window.host.automate("arm", 1.0);
    window.snapshot.borrow_mut().knob.is_armed = true;
    window.harness.run();
    window.harness.get_by_label("Stop the knob").focus();
    window.harness.run();
    window.harness.key_press(Key::Space);
    window.harness.run();
    assert_eq!(window.actions(), [Action::StopKnob]);
    assert_eq!(window.host.value("arm"), 0.0);
}

#[test]
fn devices_tests_and_files_are_asked_for() {
    let mut window = Window::tall(Tab::Knob);
    window.harness.get_by_label_contains("Device Simulated knob").click();
    window.harness.run();
    assert_eq!(window.actions(), [Action::ChooseDevice("sim".into())]);
    click(&mut window, "Page: Feel test");
    for test in FeelTest::ALL {
        click(&mut window, &format!("Feel test: {}", test.name()));
        assert_eq!(window.actions(), [Action::FeelTest(Some(test.feel()))]);
    }
    click(&mut window, "Page: Feel");
    assert_eq!(window.actions(), [Action::FeelTest(None)], "leaving the page ends the test");
    let spring = Action::FeelTest(Some(FeelTest::Spring.feel()));
    click(&mut window, "Page: Feel test");
    click(&mut window, "Feel test: Spring");
    click(&mut window, "Sound");
    assert_eq!(window.actions(), [spring.clone(), Action::FeelTest(None)], "and so does leaving the view");
    click(&mut window, "Knob");
    click(&mut window, "Feel test: Spring");
    assert_eq!(window.actions(), [spring]);
    let actions = window.harness.state_mut().forget_settings();
    assert_eq!(actions, [Action::FeelTest(None)], "and another project");

    let mut window = Window::tall(Tab::Instrument);
    click(&mut window, "Instrument Bass clarinet");
    assert_eq!(window.actions(), [Action::ChooseInstrument(4)]);
    window.host.told();
    click(&mut window, "Undo");
    assert!(window.host.told().contains(&Told::Begin("instr".into())), "the choice is a step");
}

#[test]
fn keys_belong_to_the_host_unless_text_is_typed() {
    let mut window = Window::tall(Tab::Reed);
    let wants = |window: &Window| window.harness.state().wants_keyboard(&window.harness.ctx);
    assert!(!wants(&window));
    let at = window.harness.get_by_role_and_label(Role::Slider, "Lip opening").rect();
    window.drag(at.center(), vec2(20.0, 0.0));
    assert!(!wants(&window), "a slider in the hand takes no keys");
    let value = at.right_top() + vec2(-8.0, 9.0);
    window.harness.drag_at(value);
    window.harness.drop_at(value);
    window.harness.run();
    assert!(wants(&window));
    window.harness.key_press(Key::Enter);
    window.harness.run();
    assert!(!wants(&window), "and gives them back");
}

#[test]
fn every_control_is_reached_by_the_tab_key() {
    for tab in Tab::ALL {
        let mut window = Window::tall(tab);
        let is_control = |role: Role| {
            matches!(
                role,
                Role::Slider | Role::Switch | Role::RadioButton | Role::Button | Role::ComboBox | Role::Tab
            )
        };
        let nodes = window.harness.root().children_recursive();
        let wanted: BTreeSet<String> = nodes
            .map(|node| node.accesskit_node())
            .filter(|node| is_control(node.role()) && !node.is_disabled())
            .filter_map(|node| node.label())
            .collect();
        let mut reached = BTreeSet::new();
        for _ in 0..3 * wanted.len() + 20 {
            if wanted.is_subset(&reached) {
                break;
            }
            window.harness.key_press(Key::Tab);
            window.harness.run();
            let nodes = window.harness.root().children_recursive();
            let focused =
                nodes.filter(|node| node.is_focused()).filter_map(|node| node.accesskit_node().label());
            reached.extend(focused);
        }
        let missed: Vec<_> = wanted.difference(&reached).collect();
        assert!(missed.is_empty(), "{tab:?}: {missed:?}");
    }
}

#[test]
fn before_the_first_note_no_note_is_named() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    *window.snapshot.borrow_mut() = chalumeau::editor::Snapshot::default();
    let kept = window.harness.state().kept.clone();
    *window.harness.state_mut() = chalumeau::editor::EditorState::new(kept);
    window.harness.ctx.data_mut(|data| data.clear());
    window.harness.run();
    window.harness.get_by_label("Written, no note yet");
    assert!(window.harness.query_by_label_contains("sounds").is_none());
    *window.snapshot.borrow_mut() = crate::c4();
    window.harness.run();
    window.snapshot.borrow_mut().sounding = None;
    window.snapshot.borrow_mut().heard.f0_hz = None;
    window.harness.run();
    window.harness.get_by_label("Written C4, sounds Bb3, no sound");
}

/// As the eye goes: along the line of tools, from the left to the right.
#[test]
fn the_tab_key_goes_through_the_tools_from_left_to_right() {
    for size in [(1100.0, 720.0), (700.0, 480.0)] {
        let mut window = Window::new(Tab::Play, size);
        let mut passed = Vec::new();
        loop {
            window.harness.key_press(Key::Tab);
            window.harness.run();
            let focused = window.harness.root().children_recursive().find(|node| node.is_focused()).unwrap();
            if focused.rect().center().y > 44.0 {
                break;
            }
            passed.push((focused.rect().center().x, focused.accesskit_node().label().unwrap_or_default()));
        }
        assert!(passed.len() > 6 && passed.is_sorted_by(|a, b| a.0 < b.0), "{size:?}: {passed:?}");
    }
}

/// Frames that an idle window asks for in `seconds`, after two to settle: a clock that runs only when it is asked for.
fn frames_asked_for(window: &mut Window, seconds: f64) -> usize {
    let mut count = 0;
    let mut time = window.harness.ctx.input(|input| input.time);
    let settled = time + 2.0;
    while time < settled + seconds {
        window.harness.input_mut().time = Some(time);
        window.harness.step();
        let output = window.harness.output();
        let delay = output.viewport_output.values().map(|output| output.repaint_delay).min().unwrap();
        count += usize::from(time >= settled);
        // A host draws no faster than the screen, and in a test a second is long enough to wait.
        time += delay.as_secs_f64().clamp(1.0 / 60.0, 1.0);
    }
    window.harness.input_mut().time = None;
    count
}

/// What moves is told by the snapshot's owner, who asks for frames; the window itself asks for few: a blinking cursor, a
/// tool tip that is due.
#[test]
fn an_idle_window_asks_for_five_frames_a_second_at_most() {
    const SECONDS: f64 = 3.0;
    for tab in Tab::ALL {
        let mut window = Window::new(tab, (1100.0, 720.0));
        let plain = frames_asked_for(&mut window, SECONDS);
        let mut told = vec![("plain", plain)];

        // Under the pointer: a button with its tool tip, a picture, a slider.
        for at in [egui::pos2(1070.0, 26.0), egui::pos2(300.0, 300.0), egui::pos2(850.0, 190.0)] {
            window.harness.hover_at(at);
            told.push(("under the pointer", frames_asked_for(&mut window, SECONDS)));
        }
        window.harness.remove_cursor();

        // Text being typed: its cursor blinks.
        if tab == Tab::Reed {
            let slider = window.harness.get_by_role_and_label(Role::Slider, "Lip opening").rect();
            let value = slider.right_top() + vec2(-8.0, 9.0);
            window.harness.drag_at(value);
            window.harness.drop_at(value);
            window.harness.step();
            told.push(("a text field", frames_asked_for(&mut window, SECONDS)));
            window.harness.get_by_label("Lip opening, value");
        }
        println!("{:<11} frames in {SECONDS} s: {told:?}", tab.name());
        assert!(told.iter().all(|(_, count)| *count as f64 <= 5.0 * SECONDS), "{tab:?} {told:?}");
    }
}

#[test]
fn the_laboratory_is_offered_when_asked_for() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let has_reed = |window: &Window| window.harness.query_by_role_and_label(Role::Tab, "Reed").is_some();
    assert!(!has_reed(&window));
    click(&mut window, "Views: Lab");
    assert!(has_reed(&window));
    window.harness.state_mut().kept.tab = Tab::Reed;
    click(&mut window, "Views: Musician");
    assert!(!has_reed(&window));
    assert_eq!(window.harness.state().kept.tab, Tab::Play, "a hidden view is not in front");
}

/// MIDI ports and the entry for OSC are in the list of every system.
#[test]
fn what_may_be_a_knob_does_not_offer_a_musician_its_view() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    window.host.automate("knob", 0.0);
    let has_tab = |window: &mut Window| {
        window.harness.run();
        window.harness.query_by_role_and_label(Role::Tab, "Knob").is_some()
    };
    assert!(has_tab(&mut window));
    window.snapshot.borrow_mut().knob.is_live = false;
    assert!(has_tab(&mut window), "a simulated knob is one");
    window.snapshot.borrow_mut().knob.devices.iter_mut().for_each(|device| device.is_knob = false);
    assert!(!has_tab(&mut window));
}

#[test]
fn a_long_status_line_has_one_tip() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let text = "Chalumeau sim 5eed0001 at /dev/pts/3, ".repeat(6);
    window.snapshot.borrow_mut().status[0].text = text.clone();
    window.harness.run();
    window.harness.get_by_label(&text).hover();
    window.harness.run_steps(60);
    // The line itself, and the tip.
    assert_eq!(window.harness.get_all_by_label(&text).count(), 2);
}

#[test]
fn sizes_that_the_screen_has_no_room_for_are_not_offered() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    for (room, has_large) in [(None, true), (Some((1_900.0, 990.0)), false)] {
        window.snapshot.borrow_mut().room = room;
        window.harness.run();
        window.harness.get_by_role_and_label(Role::ComboBox, "Zoom").click();
        window.harness.run();
        window.harness.get_by_label("200 %");
        assert_eq!(window.harness.query_by_label("300 %").is_some(), has_large);
        window.harness.key_press(Key::Escape);
        window.harness.run();
    }
}

#[test]
fn control_and_0_bring_the_size_back_in_a_window_without_a_host() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    for (has_letters, zoom) in [(false, 3.0), (true, 1.0)] {
        window.harness.state_mut().kept.zoom = 3.0;
        if has_letters {
            let state = std::mem::take(window.harness.state_mut());
            *window.harness.state_mut() = state.with_letters();
        }
        window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::Num0);
        window.harness.run();
        assert_eq!(window.harness.state().kept.zoom, zoom);
    }
}

#[test]
fn a_program_without_a_host_says_where_its_sound_and_midi_are() {
    let mut window = Window::tall(Tab::Instrument);
    assert!(window.harness.query_by_label("Sound output").is_none(), "a host has its own windows for it");
    window.snapshot.borrow_mut().connections = Some(Connections {
        sound: "JACK, 48000 Hz: system:playback_1".to_owned(),
        midi: Vec::new(),
        no_midi: "none; a keyboard plays as soon as you plug it in".to_owned(),
        how: "A patchbay connects others.".to_owned(),
        ..Connections::default()
    });
    window.harness.run();
    window.harness.get_by_label("JACK, 48000 Hz: system:playback_1");
    window.harness.get_by_label("none; a keyboard plays as soon as you plug it in");
    window.harness.get_by_label("A patchbay connects others.");
    window.snapshot.borrow_mut().connections.as_mut().unwrap().midi = vec!["KeyStep".to_owned()];
    window.harness.run();
    window.harness.get_by_label("KeyStep");
}

#[test]
fn a_program_without_a_host_lists_devices_and_starts_again_with_those_that_are_chosen() {
    let mut window = Window::tall(Tab::Instrument);
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    let devices = DeviceLists {
        outputs: names(&["Card", "HDMI"]),
        inputs: names(&["Mic"]),
        midi_inputs: names(&["KeyStep", "EWI"]),
    };
    window.snapshot.borrow_mut().connections =
        Some(Connections { devices: devices.into(), ..Connections::default() });
    window.harness.run();
    assert!(window.actions().contains(&Action::LookForDevices), "it looks by itself when it is first seen");
    let choose = |window: &mut Window, list: &str, option: &str| {
        window.harness.get_by_role_and_label(Role::ComboBox, list).click();
        window.harness.run();
        window.harness.get_by_role_and_label(Role::Button, option).click();
        window.harness.run();
    };
    assert!(window.harness.query_by_label("Restart with these").is_none(), "nothing else is chosen");
    choose(&mut window, "Play to", "Card");
    choose(&mut window, "Sample rate", "44100 Hz");
    choose(&mut window, "Samples per block", "128 \u{b7} 3 ms");
    choose(&mut window, "MIDI from", "EWI");
    choose(&mut window, "Microphone", "Mic");
    assert!(!window.actions().iter().any(|action| matches!(action, Action::UseDevices(_))), "not yet");
    click(&mut window, "Restart with these");
    let wanted = DeviceChoice {
        output: OutputChoice::Device("Card".to_owned()),
        rate_hz: 44_100,
        block: 128,
        microphone: Some("Mic".to_owned()),
        midi_input: Some("EWI".to_owned()),
    };
    assert!(window.actions().contains(&Action::UseDevices(wanted)));
    click(&mut window, "Cancel");
    assert!(window.harness.query_by_label("Restart with these").is_none());
    click(&mut window, "Look for devices again");
    assert!(window.actions().contains(&Action::LookForDevices));
    // A device that is not there now still stands in its list.
    let chosen = DeviceChoice { output: OutputChoice::Device("Gone".to_owned()), ..DeviceChoice::default() };
    window.snapshot.borrow_mut().connections.as_mut().unwrap().chosen = chosen;
    window.harness.run();
    let list = window.harness.get_by_role_and_label(Role::ComboBox, "Play to");
    assert_eq!(list.accesskit_node().value().as_deref(), Some("Gone"));
    assert!(window.harness.query_by_label("Try these again").is_none());
    let problem = "No sound: Gone does not open.";
    window.snapshot.borrow_mut().connections.as_mut().unwrap().problem = Some(problem.to_owned());
    window.harness.run();
    window.harness.get_by_label(problem);
    click(&mut window, "Try these again");
    let again = DeviceChoice { output: OutputChoice::Device("Gone".to_owned()), ..DeviceChoice::default() };
    assert!(window.actions().contains(&Action::UseDevices(again)), "it may be there by now");
    // JACK has rates and connections of its own.
    choose(&mut window, "Play to", "The system's output");
    window.harness.get_by_role_and_label(Role::ComboBox, "Sample rate");
    let jack = DeviceChoice { output: OutputChoice::Jack, ..DeviceChoice::default() };
    click(&mut window, "Cancel");
    window.snapshot.borrow_mut().connections.as_mut().unwrap().chosen = jack;
    window.harness.run();
    assert!(window.harness.query_by_label("Sample rate").is_none());
}

#[test]
fn control_and_z_undo_in_a_window_without_a_host() {
    let mut window = Window::new(Tab::Play, (1100.0, 720.0));
    let lip = window.harness.get_by_label("Lip").rect().center();
    window.drag(lip, vec2(0.0, -20.0));
    let moved = window.host.value("lip");
    let press = |window: &mut Window, modifiers| {
        window.harness.key_press_modifiers(modifiers, Key::Z);
        window.harness.run();
    };
    press(&mut window, Modifiers::COMMAND);
    assert_eq!(window.host.value("lip"), moved, "in a host, the keys are the host's");
    let state = std::mem::take(window.harness.state_mut());
    *window.harness.state_mut() = state.with_letters();
    press(&mut window, Modifiers::COMMAND);
    assert_eq!(window.host.plain("lip"), 1.0);
    press(&mut window, Modifiers::COMMAND | Modifiers::SHIFT);
    assert_eq!(window.host.value("lip"), moved);
    assert!(window.actions().iter().all(|action| !matches!(action, Action::NoteOn { .. })), "no note");
}

#[test]
fn the_play_view_says_which_instrument_is_loaded() {
    let mut window = Window::new(Tab::Play, (700.0, 480.0));
    window.harness.get_by_label("B flat clarinet, Boehm system, in B flat, 67 cm long");
    window.snapshot.borrow_mut().instrument = Bundled::Bass.file().into();
    window.harness.run();
    window.harness.get_by_label("B flat bass clarinet to low C, Boehm system, in B flat, 163 cm long");
}

#[test]
fn looking_changes_nothing_that_a_project_keeps() {
    for tab in Tab::ALL {
        for (size, zoom) in [((1100.0, 720.0), 1.0), ((703.0, 481.0), 1.25), ((1601.0, 999.0), 3.0)] {
            let mut window = Window::new(tab, size);
            window.harness.state_mut().kept.zoom = zoom;
            let before = window.harness.state().kept.clone();
            window.harness.run_steps(10);
            window.harness.hover_at(egui::pos2(300.0, 300.0));
            window.harness.run_steps(10);
            assert_eq!(window.harness.state().kept, before);
            assert!(window.host.told().is_empty(), "nor any parameter");
        }
    }
    // And the user does.
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    click(&mut window, "Light theme");
    window.harness.get_by_role_and_label(Role::ComboBox, "Zoom").click();
    window.harness.run();
    click(&mut window, "300 %");
    assert_eq!((window.harness.state().kept.is_dark, window.harness.state().kept.zoom), (false, 3.0));
}

#[test]
fn breath_sources_tell_what_they_say_and_how_far_they_went() {
    let mut window = Window::tall(Tab::Breath);
    for value in [0.1, 0.7, 0.4] {
        window.snapshot.borrow_mut().sources[3].value = value;
        window.harness.run();
    }
    let told = |text: &str| window.harness.query_by_label(text).is_some();
    // It stood at 62 % when the window opened.
    assert!(told("CC11 expression: 40 %, from 10 to 70 %"));
    assert!(told("CC2 breath: not seen"));
    assert!(told("Knob: 50 %, from 50 to 50 %, sets the breath"));
    // The knob is calibrated where it stands in the list.
    let below = |name: &str| window.harness.get_by_label_contains(name).rect().bottom();
    let button = window.harness.get_by_label("Rest here").rect();
    assert!(button.top() >= below("Knob: 50 %") && button.top() < below("Knob: 50 %") + 12.0);
}

#[test]
fn nothing_to_show_is_shown_as_such() {
    for tab in Tab::ALL {
        let mut window = Window::new(tab, (700.0, 480.0));
        *window.snapshot.borrow_mut() = chalumeau::editor::Snapshot::default();
        window.harness.run();
        window.harness.get_by_label_contains("at rest");
    }
}

/// At 300 % in a window that a host keeps at 1100 by 720 pixels.
#[test]
fn less_room_than_the_least_scrolls() {
    for tab in Tab::ALL {
        let mut window = Window::new(tab, (366.0, 240.0));
        let below = |window: &Window| window.harness.get_by_label_contains("Keyboard").rect().bottom();
        assert!(below(&window) > 470.0, "{tab:?}: all of it is there");
        window.harness.hover_at(egui::pos2(100.0, 40.0));
        let delta = vec2(0.0, -2_000.0);
        window.harness.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta,
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: egui::Modifiers::NONE,
        });
        window.harness.run_steps(30);
        assert!(below(&window) < 260.0, "{tab:?}: {} points down", below(&window));
    }
}

#[test]
fn rubbish_in_a_snapshot_does_no_harm() {
    for tab in Tab::ALL {
        let mut window = Window::new(tab, (900.0, 600.0));
        for value in [f32::NAN, f32::INFINITY, -1e30] {
            {
                let mut snapshot = window.snapshot.borrow_mut();
                snapshot.mouth_kpa = value;
                snapshot.history.kpa.fill(value);
                // Some have all marks, some lack some, and the last are missing.
                snapshot.history.marks.pop();
                for (n, marks) in snapshot.history.marks.iter_mut().enumerate() {
                    marks.speaks_kpa = (n % 3 > 0).then_some(value);
                    marks.chokes_kpa = (n > 50).then_some(6.0);
                }
                snapshot.scope.flow_cm3s.fill(value);
                snapshot.scope.mouthpiece_kpa.fill(value);
                snapshot.heard.cents = Some(value);
                snapshot.heard.level_db.fill(value);
                snapshot.openings.fill(value);
                snapshot.openings.pop();
                snapshot.standing.iter_mut().for_each(|place| place.1 = value);
                snapshot.knob.angle_deg = Some(value);
                snapshot.fingering = 10_000;
            }
            window.harness.run();
        }
    }
}

#[test]
fn notes_are_named_as_written_or_as_they_sound_in_every_view() {
    let mut window = Window::tall(Tab::Clarinet);
    let label = |window: &Window, contains: &str| window.harness.query_by_label_contains(contains).is_some();
    assert!(label(&window, "Written C4, sounds Bb3") && label(&window, "Keyboard, "));
    assert!(label(&window, "Fingering E3") && !label(&window, "Fingering D3"));
    window.harness.get_by_label_contains("Written C4").click();
    window.harness.run();
    assert!(label(&window, "Sounding Bb3, written C4"));
    assert!(label(&window, "Fingering D3"), "the lowest fingering has its sounding name");
    assert_eq!(window.harness.state().kept.names, NoteNames::Sounding);
    // The instrument's view has the same choice.
    let mut window = Window::tall(Tab::Instrument);
    click(&mut window, "Names of notes: Sounding");
    assert_eq!(window.harness.state().kept.names, NoteNames::Sounding);
    assert!(label(&window, "Sounding Bb3, written C4"));
}
