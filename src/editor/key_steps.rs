//! Keys that move a control which has the focus: arrows (Shift: ten times finer), Home and End, Delete for the default; and
//! the steps that a screen reader asks for. The wheel of a mouse over a control moves it as the arrow keys do.

use egui::accesskit::Action as AccessAction;
use egui::{Event, EventFilter, Key, MouseWheelSource, MouseWheelUnit, Response, Ui, Vec2};

use crate::editor::controls::{Hands, Look};

/// Scrolling by so many points, as touch pads tell it, is one notch of a wheel: what egui scrolls for one.
const POINTS_A_NOTCH: f32 = 40.0;

/// How the keys move a kind of control.
pub struct KeySteps {
    /// Share of the way that an arrow key moves a control without steps.
    pub share: f32,
    /// Whether the arrows up and down move it too; else they go to the next control.
    pub has_vertical: bool,
}

impl KeySteps {
    /// Moves a control as the keys ask; its new value, if it moves.
    pub fn moved(
        &self,
        ui: &Ui,
        hands: &mut Hands,
        id: &'static str,
        look: &Look,
        response: &Response,
    ) -> Option<f32> {
        let filter = EventFilter {
            horizontal_arrows: true,
            vertical_arrows: self.has_vertical,
            ..EventFilter::default()
        };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let unit = look.steps.map_or(self.share, |steps| 1.0 / steps.max(1) as f32);
        let (mut by, mut to) = (0.0, None);
        ui.input(|input| {
            let fine = if input.modifiers.shift && look.steps.is_none() { 0.1 } else { 1.0 };
            let presses = |key| input.num_presses(key) as f32;
            by += unit * fine * (presses(Key::ArrowRight) - presses(Key::ArrowLeft));
            if self.has_vertical {
                by += unit * fine * (presses(Key::ArrowUp) - presses(Key::ArrowDown));
            }
            by += unit * input.num_accesskit_action_requests(response.id, AccessAction::Increment) as f32;
            by -= unit * input.num_accesskit_action_requests(response.id, AccessAction::Decrement) as f32;
            if input.key_pressed(Key::Home) {
                to = Some(0.0);
            } else if input.key_pressed(Key::End) {
                to = Some(1.0);
            } else if input.key_pressed(Key::Delete) || input.key_pressed(Key::Backspace) {
                to = Some(look.default);
            }
        });
        let value = to.or((by != 0.0).then(|| (look.value + by).clamp(0.0, 1.0)))?;
        hands.put(id, value);
        Some(value)
    }

    /// Moves a control without steps as the wheel asks while the pointer is over it; its new value, if it moves.
    pub fn wheeled(
        &self,
        ui: &Ui,
        hands: &mut Hands,
        id: &'static str,
        look: &Look,
        response: &Response,
    ) -> Option<f32> {
        // While it is dragged a hand is on it.
        if !response.hovered() || response.dragged() {
            return None;
        }
        let by = ui.input_mut(|input| {
            // What all of a small window lies in would scroll, too.
            input.smooth_scroll_delta = Vec2::ZERO;
            let fine = if input.modifiers.shift { 0.1 } else { 1.0 };
            let notches = input.events.iter().map(|event| match event {
                // A flick that rolls on is not meant for what the pointer comes to meanwhile.
                Event::MouseWheel { source: MouseWheelSource::Momentum, .. } => 0.0,
                // With Shift, some systems turn the wheel sideways.
                Event::MouseWheel { unit, delta, .. } if !input.modifiers.command => {
                    let turned = if delta.y == 0.0 && input.modifiers.shift { delta.x } else { delta.y };
                    match unit {
                        MouseWheelUnit::Point => turned / POINTS_A_NOTCH,
                        MouseWheelUnit::Line | MouseWheelUnit::Page => turned,
                    }
                }
                _ => 0.0,
            });
            self.share * fine * notches.sum::<f32>()
        });
        let value = (by != 0.0).then(|| (look.value + by).clamp(0.0, 1.0))?;
        hands.nudge(id, value);
        Some(value)
    }
}
