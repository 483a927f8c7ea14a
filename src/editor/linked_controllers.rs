//! Controllers that the user links to parameters: learnt from a control's menu, named beside it, listed as a table.

use egui::{Align2, DragValue, Pos2, Response, RichText, Role, Ui, WidgetInfo, vec2};

use crate::controllers::{ControllerLinks, ParameterLink, factory, linkable, source_name};
use crate::editor::controls::{Hands, heading};
use crate::editor::host_marks;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::parameters::{self, Kind};

/// Whether the user may link a controller to a parameter here.
pub fn can_link(hands: &Hands, id: &str) -> bool {
    hands.controls.links().is_some() && linkable().any(|parameter| parameter.id == id)
}

/// The menu of a control: learn, forget, and the host's own menu. `clicked`: where, if it has just been asked for.
pub fn offer(ui: &Ui, hands: &Hands, id: &'static str, response: &Response, clicked: Option<Pos2>) {
    let Some(links) = hands.controls.links() else { return };
    let place = response.id.with("menu at");
    if let Some(at) = clicked {
        ui.data_mut(|data| data.insert_temp(place, at));
    }
    response.context_menu(|ui| {
        let learning = links.learning().is_some_and(|parameter| parameter.id == id);
        if learning {
            if ui.button("Stop waiting for a controller").clicked() {
                links.learn(None);
            }
        } else if ui.button("Learn a controller").clicked() {
            links.learn(parameters::find(id));
        }
        let all = links.all();
        for (link, _) in all.iter().filter(|(link, _)| link.parameter.id == id) {
            if ui.button(format!("Forget {}", source_name(link.source))).clicked() {
                let others: Vec<ParameterLink> =
                    all.iter().map(|(other, _)| *other).filter(|other| other != link).collect();
                links.replace(&others);
            }
        }
        if ui.button("Menu of the host").clicked() {
            let at = ui.data(|data| data.get_temp::<Pos2>(place)).unwrap_or_default();
            host_marks::open_host_menu(ui, hands, id, at);
        }
    });
}

/// Names the controllers of a parameter at the right of `after`, or asks for one; nothing where there is none.
pub fn name(ui: &Ui, hands: &Hands, id: &str, after: Pos2) {
    let Some(links) = hands.controls.links() else { return };
    let c = Colours::here(ui);
    let (text, ink) = if links.learning().is_some_and(|parameter| parameter.id == id) {
        ("move a controller".to_owned(), c.accent)
    } else {
        let names: Vec<String> = of(links, id).map(|(link, _)| source_name(link.source)).collect();
        (names.join(", "), c.quiet)
    };
    ui.painter().text(after + vec2(6.0, 0.0), Align2::LEFT_CENTER, text, theme::small(), ink);
}

/// Where the controllers of a parameter have put it, 0..=1 of its range, if they were the last to move it.
pub fn values(hands: &Hands, id: &str) -> Vec<f32> {
    let Some(links) = hands.controls.links() else { return Vec::new() };
    let share = |(link, raw): (ParameterLink, Option<u8>)| {
        let Kind::Number(number) = link.parameter.kind else { return None };
        Some((link.value(raw?) - number.min) / (number.max - number.min))
    };
    of(links, id).filter_map(share).collect()
}

fn of(links: &ControllerLinks, id: &str) -> impl Iterator<Item = (ParameterLink, Option<u8>)> {
    links.all().into_iter().filter(move |(link, _)| link.parameter.id == id)
}

/// A list of devices; the one that is chosen replaces all links, and sets what devices need.
fn choose_device(ui: &mut Ui, hands: &mut Hands) {
    let list = egui::ComboBox::from_id_salt("controllers of a device").width(ui.available_width() - 8.0);
    let mut chosen = None;
    let response = list.selected_text("Choose a device").show_ui(ui, |ui| {
        for map in factory::all() {
            if ui.selectable_label(false, &map.name).on_hover_text(&map.shows).clicked() {
                chosen = Some(map);
            }
        }
    });
    response.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "Choose a device"));
    let (Some(map), Some(links)) = (chosen, hands.controls.links()) else { return };
    links.learn(None);
    links.replace(&map.links);
    let values = factory::values(map).into_iter();
    let values: Vec<_> =
        values.map(|(parameter, value)| (parameter.id, parameter.normalized(value))).collect();
    hands.put_all(&values);
}

/// All links, with their ranges and curves.
pub fn table(ui: &mut Ui, hands: &mut Hands) {
    if hands.controls.links().is_none() {
        return;
    }
    let c = Colours::here(ui);
    heading(ui, "Linked controllers");
    choose_device(ui, hands);
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
