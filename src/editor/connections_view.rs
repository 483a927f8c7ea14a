//! Where sound and MIDI go and come from, in a program without a host, and lists to choose others.

use egui::{RichText, Ui};

use crate::editor::Action;
use crate::editor::connections::{BLOCKS, Connections, DeviceChoice, OutputChoice, RATES_HZ};
use crate::editor::controls::heading;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::widgets::list;

/// What the user has chosen and not yet used, and whether the program has been asked for the devices.
#[derive(Clone, Default)]
struct Draft {
    choice: Option<DeviceChoice>,
    has_asked: bool,
}

/// Draws them.
pub fn draw(ui: &mut Ui, connections: &Connections, actions: &mut Vec<Action>) {
    let c = Colours::here(ui);
    let id = ui.scope_id().with("devices");
    let mut draft: Draft = ui.data(|data| data.get_temp(id)).unwrap_or_default();
    if !std::mem::replace(&mut draft.has_asked, true) {
        actions.push(Action::LookForDevices);
    }
    heading(ui, concat!("Chalumeau ", env!("CARGO_PKG_VERSION")));
    let chosen = &connections.chosen;
    let devices = &connections.devices;
    let mut choice = draft.choice.take().unwrap_or_else(|| chosen.clone());
    let quiet = |text: &str| RichText::new(text).color(c.quiet);
    let named = |ui: &mut Ui, name: &str, now: &str| {
        ui.label(quiet(name));
        ui.label(now);
    };

    named(ui, "Sound output", &connections.sound);
    let mut outputs = vec![OutputChoice::Auto, OutputChoice::System];
    // On other systems hardly anyone has it.
    if cfg!(target_os = "linux") || chosen.output == OutputChoice::Jack {
        outputs.insert(1, OutputChoice::Jack);
    }
    outputs.extend(devices.outputs.iter().cloned().map(OutputChoice::Device));
    let tip = "Automatic is JACK if a server runs, and otherwise the system's output.";
    choose(ui, "Play to", &mut choice.output, outputs, |output| output.title().to_owned(), tip);
    let is_jack = choice.output == OutputChoice::Jack;
    if !is_jack {
        ui.horizontal(|ui| {
            let half = 0.5 * (ui.available_width() - ui.spacing().item_spacing.x);
            let tip = "Samples in a second. JACK sets its own.";
            ui.scope(|ui| {
                ui.set_max_width(half);
                choose(ui, "Sample rate", &mut choice.rate_hz, RATES_HZ, |rate_hz| format!("{rate_hz} Hz"), tip);
            });
            // WASAPI has a block length of its own.
            if !cfg!(windows) {
                let tip = "Samples in a block, and how long it takes. Small blocks respond faster, but the sound may drop out. JACK sets its own.";
                let rate_hz = f64::from(choice.rate_hz);
                let text = |block: &u32| format!("{block} \u{b7} {:.0} ms", 1e3 * f64::from(*block) / rate_hz);
                choose(ui, "Samples per block", &mut choice.block, BLOCKS, text, tip);
            }
        });
    }
    named(ui, "MIDI inputs", &connections.midi_line());
    if !is_jack {
        let inputs = std::iter::once(None).chain(devices.midi_inputs.iter().cloned().map(Some));
        let text = |input: &Option<String>| input.clone().unwrap_or_else(|| "All MIDI inputs".to_owned());
        choose(ui, "MIDI from", &mut choice.midi_input, inputs, text, "With JACK, all inputs play.");
        ui.label(quiet("Microphone to blow at"));
        let inputs = std::iter::once(None).chain(devices.inputs.iter().cloned().map(Some));
        let text = |input: &Option<String>| input.clone().unwrap_or_else(|| "None".to_owned());
        let tip = "With JACK, connect the port \"microphone\" in a patchbay.";
        choose(ui, "Microphone", &mut choice.microphone, inputs, text, tip);
    }
    if let Some(problem) = &connections.problem {
        ui.label(RichText::new(problem).color(ui.visuals().warn_fg_color));
    }
    if choice == *chosen {
        if ui.button("Look for devices again").clicked() {
            actions.push(Action::LookForDevices);
        }
        // It may be plugged in by now.
        if connections.problem.is_some() && ui.button("Try these again").clicked() {
            actions.push(Action::UseDevices(choice.clone()));
        }
    } else {
        ui.horizontal(|ui| {
            let about =
                "The program starts again, with your settings and these devices, and without the arguments of its command line. Later starts use these devices, too.";
            let button =
                egui::Button::new(RichText::new("Restart with these").color(c.on_accent)).fill(c.accent);
            if ui.add(button).on_hover_text(about).clicked() {
                actions.push(Action::UseDevices(choice.clone()));
            }
            if ui.button("Cancel").clicked() {
                choice = chosen.clone();
            }
        });
    }
    if !connections.how.is_empty() {
        ui.label(quiet(&connections.how).font(theme::small()));
    }
    draft.choice = (choice != *chosen).then_some(choice);
    ui.data_mut(|data| data.insert_temp(id, draft));
}

/// A list of values to open. What is chosen stands in it, even if it is not there now.
fn choose<T: Clone + PartialEq>(
    ui: &mut Ui,
    name: &str,
    chosen: &mut T,
    options: impl IntoIterator<Item = T>,
    text: impl Fn(&T) -> String,
    tip: &str,
) {
    let mut options: Vec<T> = options.into_iter().collect();
    if !options.contains(chosen) {
        options.push(chosen.clone());
    }
    let texts: Vec<String> = options.iter().map(text).collect();
    let mut index = options.iter().position(|option| option == chosen).unwrap_or(0);
    list(ui, name, &texts, &mut index).on_hover_text(tip);
    *chosen = options.swap_remove(index);
}
