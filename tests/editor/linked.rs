//! Controllers that the user links: learnt from a menu, listed, changed and forgotten.

use chalumeau::controllers::ParameterLink;
use chalumeau::controllers::breath_input::BreathInput;
use chalumeau::controllers::source_curves::{CurveSource, SourceCurve};
use chalumeau::editor::Tab;
use chalumeau::editor::controls::Controls;
use chalumeau_core::control::midi::links::Source;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

use crate::Window;
use crate::support::Fake;

const KNOB: Source = Source::Controller(21);

fn linking(tab: Tab) -> Window {
    Window::with_host(tab, (1100.0, 2650.0), Fake::linking())
}

fn links(window: &Window) -> Vec<ParameterLink> {
    let links = window.host.links.as_ref().unwrap();
    links.all().into_iter().map(|(link, _)| link).collect()
}

fn choose(window: &mut Window, control: &str, item: &str) {
    window.harness.get_by_role_and_label(Role::Slider, control).click_secondary();
    window.harness.run();
    window.harness.get_by_label(item).click();
    window.harness.run();
}

#[test]
fn a_controller_is_learnt_from_the_menu_of_a_slider_and_forgotten_there() {
    let mut window = linking(Tab::Breath);
    choose(&mut window, "Growl", "Learn a controller");
    let board =
        |window: &Window| window.host.links.as_ref().unwrap().learning().map(|parameter| parameter.id);
    assert_eq!(board(&window), Some("growl"));
    for raw in [3, 64] {
        window.host.links.as_ref().unwrap().hear(KNOB, raw);
    }
    window.harness.run();
    let linked = links(&window);
    assert_eq!((linked.len(), linked[0].source, linked[0].parameter.id), (1, KNOB, "growl"));
    window.harness.get_by_label("CC21 moves Growl");
    choose(&mut window, "Growl", "Forget CC21");
    assert!(links(&window).is_empty());
    choose(&mut window, "Growl", "Learn a controller");
    window.harness.get_by_label("Stop waiting").click();
    window.harness.run();
    assert_eq!(board(&window), None);
    assert!(window.host.told().is_empty(), "no parameter has moved");
}

#[test]
fn the_menu_leads_to_the_hosts_own() {
    let mut window = linking(Tab::Breath);
    choose(&mut window, "Growl", "Menu of the host");
    let asked: Vec<_> = window.host.menus().into_iter().map(|(asked, _)| asked).collect();
    assert_eq!(asked, ["growl"]);
    // What no controller may move has only the host's.
    window.harness.get_by_role_and_label(Role::Slider, "Knob curve").click_secondary();
    window.harness.run();
    assert_eq!(window.host.menus().len(), 1);
}

#[test]
fn a_device_brings_its_links_and_values_and_the_next_takes_them_back() {
    let mut window = linking(Tab::Breath);
    assert!(
        window.harness.query_by_label_contains("As in a new instance").is_some(),
        "nobody has chosen one"
    );
    let softest = |window: &Window| window.host.text("bsoft", window.host.value("bsoft"));
    for (device, links_now, wheel) in [
        ("EWI", 1, "Nothing"),
        ("Aerophone", 0, "Growl"),
        ("Breath controller", 0, "Vibrato"),
        // Needs what a new instance has.
        ("WARBL", 0, "Vibrato"),
    ] {
        window.harness.get_by_role_and_label(Role::ComboBox, "Choose a device").click();
        window.harness.run();
        window.harness.get_by_label(device).click();
        window.harness.run();
        assert_eq!(links(&window).len(), links_now, "{device}");
        assert_eq!(window.host.text("wheel", window.host.value("wheel")), wheel, "{device}");
        let map = chalumeau::controllers::factory::find(device).unwrap();
        window.harness.get_by_label(&map.shows);
        assert_eq!(window.host.links.as_ref().unwrap().device(), Some(map));
        let least = match device {
            "Aerophone" => "4.0 %",
            "Breath controller" => "5.0 %",
            _ => "3.1 %",
        };
        assert_eq!(softest(&window), least, "{device}");
    }
    // What Calibrate has found is the player's.
    window.host.automate("bsoft", 0.11);
    let found = softest(&window);
    window.harness.run();
    window.harness.get_by_role_and_label(Role::ComboBox, "Choose a device").click();
    window.harness.run();
    window.harness.get_by_label("Any keyboard or controller").click();
    window.harness.run();
    window.harness.get_by_label_contains("As in a new instance");
    assert_eq!(softest(&window), found);
}

#[test]
fn undo_takes_a_device_back_with_its_links_and_leaves_what_came_after() {
    let mut window = linking(Tab::Breath);
    let choose = |window: &mut Window, device: &str| {
        window.harness.get_by_role_and_label(Role::ComboBox, "Choose a device").click();
        window.harness.run();
        window.harness.get_by_label(device).click();
        window.harness.run();
    };
    let press = |window: &mut Window, arrow: &str| {
        window.harness.get_by_role_and_label(Role::Button, arrow).click();
        window.harness.run();
    };
    let state = |window: &Window| {
        let device = window.host.links.as_ref().unwrap().device().map(|map| map.name.as_str());
        (device, links(window).len(), window.host.text("wheel", window.host.value("wheel")))
    };
    choose(&mut window, "WARBL");
    choose(&mut window, "EWI");
    let ewi = (Some("EWI"), 1, "Nothing".to_owned());
    assert_eq!(state(&window), ewi);
    press(&mut window, "Undo");
    assert_eq!(state(&window), (Some("WARBL"), 0, "Vibrato".to_owned()));
    press(&mut window, "Redo");
    assert_eq!(state(&window), ewi);
    // WARBL needs what a new instance has: only its links and its name change.
    press(&mut window, "Undo");
    press(&mut window, "Undo");
    assert_eq!(state(&window), (None, 0, "Vibrato".to_owned()));
    press(&mut window, "Redo");
    press(&mut window, "Redo");
    // A link that was learnt since is not lost.
    let links_now = window.host.links.as_ref().unwrap();
    let learnt = ParameterLink::whole(KNOB, chalumeau::parameters::find("growl").unwrap()).unwrap();
    links_now.replace(&[learnt]);
    press(&mut window, "Undo");
    assert_eq!(links(&window), [learnt]);
    assert_eq!(window.host.text("wheel", window.host.value("wheel")), "Vibrato");
}

#[test]
fn a_row_of_the_table_forgets_its_own_link() {
    let mut window = linking(Tab::Breath);
    let of = |id: &str| ParameterLink::whole(KNOB, chalumeau::parameters::find(id).unwrap()).unwrap();
    window.host.links.as_ref().unwrap().replace(&[of("growl"), of("vib")]);
    window.harness.run();
    window.harness.get_by_label("CC21 moves Vibrato");
    let forget = window.harness.get_all_by_label("Forget").next().unwrap();
    forget.click();
    window.harness.run();
    assert_eq!(links(&window), [of("vib")]);
}

/// CC11 blows instead of the knob.
fn blown_by_expression() -> Window {
    let mut window = Window::tall(Tab::Breath);
    for source in &mut window.snapshot.borrow_mut().sources {
        source.is_live = source.input == BreathInput::Expression;
    }
    window.harness.run();
    window
}

#[test]
fn a_source_gets_its_own_curve_and_leaves_that_of_all_others() {
    const OWN: &str = "Own curve for CC11 expression";
    let mut window = blown_by_expression();
    let common = SourceCurve::common(&window.host.settings());
    let own = |window: &Window| window.host.curves.get(CurveSource::Expression);
    assert_eq!(own(&window), None);
    window.harness.get_by_label(OWN).click();
    window.harness.run();
    assert_eq!(own(&window), Some(common), "at first nothing sounds otherwise");
    window.harness.get_by_label("CC11 expression has its own curve, in the picture.");

    let bow = window.harness.get_by_label("Curve: how it bends").rect().center();
    window.drag(bow, egui::vec2(0.0, 40.0));
    let end = window.harness.get_by_label("Curve: where it is loudest").rect().center();
    window.drag(end, egui::vec2(-60.0, 0.0));
    let bent = own(&window).unwrap();
    assert!(
        bent.curve > common.curve + 0.1 && bent.loudest < 0.95 && bent.softest == common.softest,
        "{bent:?}"
    );
    assert!(window.host.told().is_empty(), "no parameter has moved");
    window.double_click(end + egui::vec2(-60.0, 0.0));
    assert_eq!(own(&window).unwrap().loudest, 1.0);

    // Its ends are measured for it alone.
    window.harness.get_by_label("Calibrate").click();
    window.harness.run();
    for value in [0.2, 0.7] {
        window.snapshot.borrow_mut().sources[3].value = value;
        window.harness.run();
    }
    window.harness.get_by_label("Done").click();
    window.harness.run();
    let measured = own(&window).unwrap();
    assert!(
        (measured.softest, measured.loudest) == (0.2, 0.7) && window.host.told().is_empty(),
        "{measured:?}"
    );

    window.harness.get_by_label(OWN).click();
    window.harness.run();
    assert_eq!(own(&window), None);
}
