//! The devices to choose from, and the table of controllers that the user has linked to parameters.

use std::sync::LazyLock;

use egui::{DragValue, RichText, Role, Ui, WidgetInfo};

use crate::controllers::{ControllerMap, ParameterLink, factory, source_name};
use crate::editor::controls::{Hands, heading};
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::parameters::{Kind, Parameter, Value};

/// Of the list of devices, points: all of them at once.
const LIST_HEIGHT: f32 = 360.0;

/// What [`ANY_DEVICE`] does.
const ANY_SHOWS: &str = "As in a new instance: keys blow by their velocity; CC2, CC11 or pressure takes over as soon as it moves.";

/// What the list offers first. Some devices need nothing else, so that their names would stand where nobody has chosen one.
static ANY_DEVICE: LazyLock<ControllerMap> = LazyLock::new(|| ControllerMap {
    name: "Any keyboard or controller".to_owned(),
    shows: ANY_SHOWS.to_owned(),
    links: Vec::new(),
    values: Vec::new(),
});

/// Whether parameters and these links are as a device needs them.
fn is_set(hands: &Hands, links: &[ParameterLink], map: &ControllerMap) -> bool {
    links == map.links
        && factory::values(map)
            .into_iter()
            .all(|(parameter, value)| is_at(hands, parameter, value) || is_players(hands, parameter))
}

/// Whether the player has found a value, as by Calibrate: it fits better than what fits most players.
fn is_players(hands: &Hands, parameter: &Parameter) -> bool {
    factory::is_players(parameter, |value| is_at(hands, parameter, value))
}

fn is_at(hands: &Hands, parameter: &Parameter, value: Value) -> bool {
    let look = hands.controls.look(parameter.id);
    look.is_none_or(|look| (look.value - parameter.normalized(value)).abs() < 1e-4)
}

/// A list of devices; the one that is chosen replaces all links, and sets what devices need.
pub fn choose_device(ui: &mut Ui, hands: &mut Hands) {
    let Some(links) = hands.controls.links() else { return };
    let all: Vec<ParameterLink> = links.all().into_iter().map(|(link, _)| link).collect();
    let c = Colours::here(ui);
    heading(ui, "Device");
    let list = egui::ComboBox::from_id_salt("controllers of a device").width(ui.available_width());
    let maps = || std::iter::once(&*ANY_DEVICE).chain(factory::all());
    // Older projects do not say which one was chosen.
    let fitting = || maps().find(|map| is_set(hands, &all, map));
    // Where nothing is linked, any keyboard or controller plays, whatever a preset has moved since.
    let any = || all.is_empty().then_some(&*ANY_DEVICE);
    let now = links.device().filter(|map| map.links == all).or_else(fitting).or_else(any);
    let mut chosen = None;
    let text = now.map_or("Choose a device", |map| map.name.as_str());
    let response = list.height(LIST_HEIGHT).selected_text(text).show_ui(ui, |ui| {
        for map in maps() {
            let is_here = now == Some(map);
            if ui.selectable_label(is_here, &map.name).on_hover_text(&map.shows).clicked() {
                chosen = Some(map);
            }
        }
    });
    response.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "Choose a device"));
    if let Some(map) = now {
        ui.label(RichText::new(&map.shows).font(theme::small()).color(c.quiet));
    }
    let Some(map) = chosen else { return };
    let values = factory::values(map).into_iter().filter(|(parameter, _)| !is_players(hands, parameter));
    let values: Vec<_> =
        values.map(|(parameter, value)| (parameter.id, parameter.normalized(value))).collect();
    hands.put_device(map, &values);
}

/// All links, with their ranges and curves.
pub fn draw(ui: &mut Ui, hands: &mut Hands) {
    if hands.controls.links().is_none() {
        return;
    }
    let c = Colours::here(ui);
    heading(ui, "Linked controllers");
    let Some(links) = hands.controls.links() else { return };
    let all = links.all();
    let quiet = |text: String| RichText::new(text).font(theme::small()).color(c.quiet);
    if let Some(parameter) = links.learning() {
        ui.label(format!("Move the controller for {}.", parameter.name));
        if ui.button("Stop waiting").clicked() {
            links.learn(None);
        }
    } else if all.is_empty() {
        ui.label(quiet("Right-click a control, choose Learn a controller, and move one.".to_owned()));
    }
    let before: Vec<ParameterLink> = all.iter().map(|(link, _)| *link).collect();
    let mut edited = before.clone();
    let mut gone = None;
    for (at, link) in edited.iter_mut().enumerate() {
        let Kind::Number(number) = link.parameter.kind else { continue };
        ui.push_id(("link", at), |ui| {
            ui.horizontal(|ui| {
                ui.label(format!("{} moves {}", source_name(link.source), link.parameter.name));
                if ui.small_button("Forget").clicked() {
                    gone = Some(at);
                }
            });
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                for (word, value) in [("from", &mut link.low), ("to", &mut link.high)] {
                    let word = ui.label(quiet(word.to_owned()));
                    ui.add(
                        DragValue::new(value)
                            .range(number.min..=number.max)
                            .speed((number.max - number.min) / 200.0)
                            .custom_formatter(move |value, _| {
                                format!("{}{}", number.text(value as f32), number.unit)
                            })
                            .custom_parser(move |text| number.parse(text).map(f64::from)),
                    )
                    .labelled_by(word.id);
                }
            });
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                let word = ui.label(quiet("curve".to_owned()));
                ui.add(DragValue::new(&mut link.curve).range(0.2..=5.0).speed(0.02).fixed_decimals(2))
                    .labelled_by(word.id);
            });
        });
    }
    if let Some(at) = gone {
        edited.remove(at);
    }
    // Only what a hand has changed: meanwhile a controller may have been learnt.
    if edited != before {
        links.replace(&edited);
    }
    if !all.is_empty() && ui.button("Copy as text").clicked() {
        ui.ctx().copy_text(links.to_text());
    }
}
