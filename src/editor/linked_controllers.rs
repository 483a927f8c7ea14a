//! Controllers that the user links to parameters: learnt from a control's menu, named beside it.

use egui::{Align2, Button, Pos2, Response, Ui, vec2};

use crate::controllers::{ControllerLinks, ParameterLink, linkable, source_name};
use crate::editor::controls::Hands;
use crate::editor::host_marks;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::parameters::{self, Kind};
use chalumeau_core::control::midi::links::MOST as MOST_LINKS;

/// Where a control is clicked with the right button: the menu of its controllers, or the host's where none can be linked.
pub fn offer_menu(ui: &Ui, hands: &Hands, id: &'static str, response: &Response) {
    let at = response.interact_pointer_pos().filter(|_| response.secondary_clicked());
    if can_link(hands, id) {
        offer(ui, hands, id, response, at);
    } else if let Some(at) = at {
        host_marks::open_menu(ui, hands, id, at);
    }
}

/// Whether the user may link a controller to a parameter here.
fn can_link(hands: &Hands, id: &str) -> bool {
    hands.controls.links().is_some() && linkable().any(|parameter| parameter.id == id)
}

/// The menu of a control: learn, forget, and the host's own menu. `clicked`: where, if it has just been asked for.
fn offer(ui: &Ui, hands: &Hands, id: &'static str, response: &Response, clicked: Option<Pos2>) {
    let Some(links) = hands.controls.links() else { return };
    let place = response.id.with("menu at");
    if let Some(at) = clicked {
        ui.data_mut(|data| data.insert_temp(place, at));
    }
    response.context_menu(|ui| {
        if is_learning(hands, id) {
            if ui.button("Stop waiting for a controller").clicked() {
                links.learn(None);
            }
        } else if let Some(parameter) = parameters::find(id) {
            let learn = ui.add_enabled(links.can_learn(parameter), Button::new("Learn a controller"));
            let full = format!("There are {MOST_LINKS} links already. Forget one of them first.");
            if learn.on_disabled_hover_text(full).clicked() {
                links.learn(Some(parameter));
            }
        }
        let all = links.all();
        for (link, _) in all.iter().filter(|(link, _)| link.parameter.id == id) {
            if ui.button(format!("Forget {}", source_name(link.source))).clicked() {
                let others: Vec<ParameterLink> =
                    all.iter().map(|(other, _)| *other).filter(|other| other != link).collect();
                links.replace(&others);
            }
        }
        if hands.controls.has_menu() && ui.button("Menu of the host").clicked() {
            let at = ui.data(|data| data.get_temp::<Pos2>(place)).unwrap_or_default();
            host_marks::open_menu(ui, hands, id, at);
        }
    });
}

/// What a control says whose controller is about to be learnt.
pub const ASKS: &str = "move a controller";

/// Whether a controller is about to be learnt for this parameter.
pub fn is_learning(hands: &Hands, id: &str) -> bool {
    let learning = hands.controls.links().and_then(ControllerLinks::learning);
    learning.is_some_and(|parameter| parameter.id == id)
}

/// No longer waits for a controller.
pub fn end_learning(hands: &Hands) {
    if let Some(links) = hands.controls.links().filter(|links| links.learning().is_some()) {
        links.learn(None);
    }
}

/// Names the controllers of a parameter at the right of `after`, or asks for one; nothing where there is none.
pub fn name(ui: &Ui, hands: &Hands, id: &str, after: Pos2) {
    let Some(links) = hands.controls.links() else { return };
    let c = Colours::here(ui);
    let (text, ink) = if is_learning(hands, id) {
        (ASKS.to_owned(), c.accent)
    } else {
        let names: Vec<String> = of(links, id).map(|(link, _)| source_name(link.source)).collect();
        (names.join(", "), c.quiet)
    };
    ui.painter().text(after + vec2(6.0, 0.0), Align2::LEFT_CENTER, text, theme::small(), ink);
}

/// Where the controllers of a parameter stand, as shares of its range, 0..=1.
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
