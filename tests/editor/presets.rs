//! Presets in the window: the bar in the header, the browser, and the forms for one's own.

use std::collections::BTreeSet;
use std::sync::Arc;

use chalumeau::editor::controls::Controls;
use chalumeau::editor::{Action, Tab};
use chalumeau::presets::user_folder::UserPresets;
use chalumeau::presets::{Preset, PresetShelf, factory};
use egui::Key;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

use crate::Window;
use crate::support::Told;

fn click(window: &mut Window, label: &str) {
    window.harness.get_by_label(label).click();
    window.harness.run();
}

/// With a preset of the user's own, which is liked, and one file that is none.
fn shelf() -> Arc<PresetShelf> {
    let mine =
        Preset::parse("format = 1\nname = \"Mine\"\ntags = [\"own\"]\n[parameters]\nlip = 0.9\n").unwrap();
    let user = UserPresets {
        presets: vec![mine],
        favourites: BTreeSet::from(["Mine".to_owned()]),
        broken: vec!["bad.toml: line 4: there is no parameter \"lipp\"; did you mean lip?".to_owned()],
        ..UserPresets::default()
    };
    Arc::new(PresetShelf { user, notice: None })
}

/// What the plugin does with the window's actions.
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

/// Whether the host's parameters are those of a preset, by the texts that it shows.
fn has(window: &Window, preset: &Preset) -> bool {
    let host = &window.host;
    let device = host.links.as_ref().and_then(|links| links.device());
    preset.all_values(device).all(|(parameter, value)| {
        let look = host.look(parameter.id).unwrap();
        let text = host.text(parameter.id, look.value);
        parameter.read(&text).map(|read| parameter.text(read)) == Ok(parameter.text(value))
    })
}

#[test]
fn arrows_walk_through_the_presets_with_gestures_and_undo() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    let all = factory::all();
    window.harness.get_by_label("Preset B flat clarinet");
    window.host.told();
    for preset in &all[1..=3] {
        click(&mut window, "Next preset");
        assert_eq!(obey(&mut window), [Action::ChosePreset(preset.name.clone())]);
        assert!(has(&window, preset), "{}", preset.name);
        window.harness.get_by_label(&format!("Preset {}", preset.name));
    }
    // The fake host refuses a value outside a gesture; each gesture ends.
    let told = window.host.told();
    let count = |is: fn(&Told) -> bool| told.iter().filter(|told| is(told)).count();
    assert_eq!(count(|told| matches!(told, Told::Begin(_))), count(|told| matches!(told, Told::End(_))));
    assert!(window.host.value("instr") > 0.0, "the third is another clarinet");
    for preset in all[..3].iter().rev() {
        click(&mut window, "Undo");
        assert!(has(&window, preset), "one step back to {}, its instrument too", preset.name);
        assert_eq!(obey(&mut window), [Action::ChosePreset(preset.name.clone())], "its name, too");
    }
    click(&mut window, "Previous preset");
    assert_eq!(obey(&mut window), [Action::ChosePreset(all.last().unwrap().name.clone())], "round and round");
}

#[test]
fn what_was_moved_since_is_marked() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    window.harness.get_by_label("Preset B flat clarinet");
    window.host.automate("lip", 0.7);
    window.harness.run();
    window.harness.get_by_label("Preset B flat clarinet, changed");
    // Neither what plays nor what arms is of a preset.
    window.host.automate("lip", 0.5);
    window.host.automate("breath", 0.5);
    window.host.automate("knob", 1.0);
    window.harness.run();
    window.harness.get_by_label("Preset B flat clarinet");
}

#[test]
fn the_browser_searches_and_a_click_plays() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    window.snapshot.borrow_mut().presets = shelf();
    click(&mut window, "Preset B flat clarinet");
    assert_eq!(window.actions(), [Action::ReadPresets]);
    window.harness.get_by_label("First desk");
    click(&mut window, "klezmer");
    window.harness.get_by_label("Doina");
    assert!(window.harness.query_by_label("First desk").is_none());
    click(&mut window, "Doina");
    assert_eq!(obey(&mut window), [Action::ChosePreset("Doina".to_owned())]);
    assert!(has(&window, factory::find("Doina").unwrap()));
    click(&mut window, "Favourite Doina");
    assert_eq!(window.actions(), [Action::LikePreset { name: "Doina".to_owned(), is_liked: true }]);
    click(&mut window, "klezmer");
    click(&mut window, "Favourites");
    window.harness.get_by_label("Mine");
    assert!(window.harness.query_by_label("First desk").is_none());
    click(&mut window, "Favourites");
    window.harness.get_by_role_and_label(Role::TextInput, "Search presets").focus();
    window.harness.run();
    window.harness.get_by_role_and_label(Role::TextInput, "Search presets").type_text("conductor");
    window.harness.run();
    window.harness.get_by_label("First desk");
    assert!(window.harness.query_by_label("Clarinet in C").is_none());
    // A tab leads back to its view, and so does the key.
    window.harness.get_by_role_and_label(Role::Tab, "Reed").click();
    window.harness.run();
    window.harness.get_by_label("Peak of the flow: H");
    click(&mut window, "Preset Doina");
    window.harness.key_press(Key::Escape);
    window.harness.run();
    window.harness.get_by_label("Peak of the flow: H");
}

fn fill(window: &mut Window, field: &str, text: &str) {
    window.harness.get_by_role_and_label(Role::TextInput, field).focus();
    window.harness.run();
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::A);
    window.harness.get_by_role_and_label(Role::TextInput, field).type_text(text);
    window.harness.run();
}

#[test]
fn ones_own_are_saved_renamed_and_deleted_as_actions() {
    let mut window = Window::new(Tab::Reed, (1100.0, 900.0));
    window.snapshot.borrow_mut().presets = shelf();
    window.harness.get_by_label_contains("Preset B flat").click();
    window.harness.run();
    window.host.automate("lip", 0.25);
    window.harness.run();
    window.harness.get_by_label_contains("bad.toml: line 4");
    click(&mut window, "Save as");
    window.actions();
    fill(&mut window, "Name of the preset", "First desk");
    window.harness.get_by_label_contains("this is a factory preset");
    click(&mut window, "Save");
    assert_eq!(window.actions(), [], "the button is off");
    fill(&mut window, "Name of the preset", "Evening");
    fill(&mut window, "Tags, with commas", "jazz, mine");
    click(&mut window, "Save");
    let actions = window.actions();
    let [Action::SavePreset(saved)] = actions.as_slice() else { panic!("{actions:?}") };
    assert_eq!((saved.name.as_str(), saved.tags.join("+").as_str()), ("Evening", "jazz+mine"));
    assert!(has(&window, saved) && saved.changes().len() == 1, "{saved:?}");

    window.snapshot.borrow_mut().preset = "Mine".to_owned();
    window.harness.run();
    click(&mut window, "Rename");
    fill(&mut window, "New name", "Doina");
    window.harness.get_by_label("another preset has this name");
    fill(&mut window, "New name", "Ours");
    window.harness.get_by_role_and_label(Role::Button, "Rename").click();
    window.harness.run();
    assert_eq!(window.actions(), [Action::RenamePreset { old: "Mine".to_owned(), new: "Ours".to_owned() }]);
    click(&mut window, "Delete");
    assert_eq!(window.actions(), []);
    click(&mut window, "Delete it");
    assert_eq!(window.actions(), [Action::DeletePreset("Mine".to_owned())]);
}

#[test]
fn the_browser_opens_at_the_chosen_preset_and_shows_what_was_saved() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    window.snapshot.borrow_mut().presets = shelf();
    let last = factory::all().last().unwrap().name.clone();
    let first = factory::all()[0].name.clone();
    let is_listed = |window: &Window, name: &str| window.harness.query_by_label(name).is_some();
    window.snapshot.borrow_mut().preset = last.clone();
    window.harness.run();
    click(&mut window, &format!("Preset {last}, changed"));
    assert!(
        is_listed(&window, &format!("Favourite {last}"))
            && !is_listed(&window, &format!("Favourite {first}"))
    );
    // What is looked for stays, and is told beside the name; the arrows go through it alone.
    for chip in ["klezmer", "Favourites", "Yours"] {
        click(&mut window, chip);
    }
    assert!(!is_listed(&window, &format!("Favourite {last}")));
    for _ in 0..2 {
        click(&mut window, &format!("Preset {last}, changed"));
    }
    assert!(!is_listed(&window, &format!("Favourite {last}")));
    click(&mut window, "All");
    assert!(is_listed(&window, &format!("Favourite {last}")));
    // The key goes on from there, round and round; in a host, the keys are the host's.
    window.actions();
    window.harness.key_press(Key::ArrowDown);
    window.harness.run();
    assert!(obey(&mut window).is_empty());
    let state = std::mem::take(window.harness.state_mut());
    *window.harness.state_mut() = state.with_letters();
    window.harness.key_press(Key::ArrowDown);
    window.harness.run();
    assert_eq!(obey(&mut window)[..1], [Action::ChosePreset("Mine".to_owned())], "the user's own follow");
    window.harness.key_press(Key::ArrowDown);
    window.harness.run();
    assert_eq!(obey(&mut window)[..1], [Action::ChosePreset(first.clone())]);
    assert!(is_listed(&window, &format!("Favourite {first}")), "it comes into sight");
    click(&mut window, "klezmer");
    click(&mut window, "Next preset");
    let [Action::ChosePreset(chosen)] = &obey(&mut window)[..] else { panic!("no preset") };
    assert!(factory::find(chosen).unwrap().has_tag("klezmer"), "{chosen}");
    click(&mut window, "All");
    window.snapshot.borrow_mut().preset = last.clone();
    window.harness.run();

    // A preset that is saved comes to the list later, far from where the list is.
    let mut user = shelf().user.clone();
    click(&mut window, "Save as");
    fill(&mut window, "Name of the preset", "Aaa");
    click(&mut window, "Yours");
    click(&mut window, "Save");
    let saved = window.actions().into_iter().find_map(|action| match action {
        Action::SavePreset(preset) => Some(preset),
        _ => None,
    });
    user.presets.push(saved.expect("saved"));
    user.presets.extend((0..40).map(|n| {
        Preset::parse(&format!("format = 1\nname = \"Z {n}\"\n[parameters]\nlip = 0.9\n")).unwrap()
    }));
    window.snapshot.borrow_mut().presets = Arc::new(PresetShelf { user, notice: None });
    window.snapshot.borrow_mut().preset = "Aaa".to_owned();
    window.harness.run();
    assert!(is_listed(&window, "Favourite Aaa"));
}

#[test]
fn a_blind_comparison_hides_the_preset() {
    let mut window = Window::new(Tab::Reed, (1100.0, 720.0));
    click(&mut window, "Setting B");
    window.host.automate("lip", 0.9);
    window.harness.run();
    click(&mut window, "Blind");
    assert!(window.harness.query_by_label_contains("Preset ").is_none());
}
