//! A preset and the controls: putting one on, making one of them, and whether they differ.

use crate::controllers::{ControllerLinks, ControllerMap};
use crate::editor::Action;
use crate::editor::controls::{Controls, Hands, SAME};
use crate::presets::Preset;

/// Puts a preset on the controls in place of the one called `before`, as one step of undo, and says so.
pub fn choose(preset: &Preset, before: &str, hands: &mut Hands, actions: &mut Vec<Action>) {
    let values = preset.all_values(device(hands.controls));
    let wanted = values.map(|(parameter, value)| (parameter.id, parameter.normalized(value)));
    let is_moved = |&(id, value): &(&'static str, f32)| {
        hands.controls.look(id).is_some_and(|look| (look.value - value).abs() > SAME)
    };
    let values: Vec<(&'static str, f32)> = wanted.filter(is_moved).collect();
    hands.put_step(&values, [before.to_owned(), preset.name.clone()]);
    actions.push(Action::ChosePreset(preset.name.clone()));
}

/// The device whose controllers the player has.
fn device(controls: &dyn Controls) -> Option<&'static ControllerMap> {
    controls.links().and_then(ControllerLinks::device)
}

/// A preset of the controls as they are, without what is the player's own and what the device needs: it is for other players, too.
pub fn capture(name: &str, controls: &dyn Controls) -> Preset {
    Preset::of(name, device(controls), |parameter| {
        let look = controls.look(parameter.id).filter(|_| !parameter.is_players_own())?;
        parameter.read(&controls.text(parameter.id, look.value)).ok()
    })
}

/// Whether a control no longer says what the preset set.
pub fn is_changed(preset: &Preset, controls: &dyn Controls) -> bool {
    preset.all_values(device(controls)).any(|(parameter, value)| {
        controls.look(parameter.id).is_some_and(|look| {
            (look.value - parameter.normalized(value)).abs() > SAME
                && controls.text(parameter.id, look.value) != parameter.text(value)
        })
    })
}
