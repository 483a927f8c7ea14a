//! The plugin's parameters as the editor may see them.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nice_plug::context::gui::GuiContext;
use nice_plug::prelude::{ParamPtr, Params};

use crate::controllers::ControllerLinks;
use crate::controllers::source_curves::SourceCurves;
use crate::editor::controls::{Mark, SAME};
use crate::editor::{Controls, Look};
use crate::parameters;
use crate::plugin::host_link::MenuRequest;
use crate::plugin::params::ChalumeauParams;

/// How long a value counts that was set and has not arrived. Hosts pass it on with the next block: two blocks of 8192 samples at
/// 44.1 kHz are 0.4 s. One that never arrives was refused.
const ARRIVES_WITHIN: Duration = Duration::from_millis(500);

/// All parameters by their ids. `params` keeps the pointers valid.
pub struct HostControls {
    ids: Vec<&'static str>,
    pointers: HashMap<&'static str, ParamPtr>,
    params: Arc<ChalumeauParams>,
    on_the_way: RefCell<OnTheWay>,
}

/// Values that the window has set and the host has not passed on yet. What looks at a parameter must see them: undo, a
/// comparison, the choice of another preset.
#[derive(Default)]
struct OnTheWay(HashMap<&'static str, (f32, Instant)>);

impl OnTheWay {
    /// A value was set, as the parameter will have it.
    fn set(&mut self, id: &'static str, value: f32, now: Instant) {
        self.0.insert(id, (value, now));
    }

    /// The value that counts where the parameter has `there`.
    fn value(&mut self, id: &str, there: f32, now: Instant) -> f32 {
        let Some(&(value, since)) = self.0.get(id) else { return there };
        if (value - there).abs() < SAME || now.duration_since(since) > ARRIVES_WITHIN {
            self.0.remove(id);
            return there;
        }
        value
    }
}

/// The parameters together with the host's context, which is told of changes.
pub struct WithHost<'a> {
    controls: &'a HostControls,
    gui: &'a GuiContext,
}

impl HostControls {
    /// Lists these parameters.
    pub fn new(params: Arc<ChalumeauParams>) -> Self {
        let all: Vec<(&'static str, ParamPtr)> = params
            .param_map()
            .into_iter()
            .filter_map(|(id, pointer, _)| Some((parameters::find(&id)?.id, pointer)))
            .collect();
        Self {
            ids: all.iter().map(|(id, _)| *id).collect(),
            pointers: all.into_iter().collect(),
            params,
            on_the_way: RefCell::default(),
        }
    }

    /// The controls for one frame.
    pub fn with<'a>(&'a self, gui: &'a GuiContext) -> WithHost<'a> {
        WithHost { controls: self, gui }
    }
}

// The framework's parameter pointers are raw; they point into `params`.
#[allow(unsafe_code)]
mod raw {
    use super::*;

    // SAFETY: the parameters behind the pointers are atomics, shared between threads by design, and outlive `self`.
    unsafe impl Send for HostControls {}

    impl Controls for WithHost<'_> {
        fn ids(&self) -> &[&'static str] {
            &self.controls.ids
        }

        fn look(&self, id: &str) -> Option<Look> {
            let param = *self.controls.pointers.get(id)?;
            // SAFETY: `params` keeps the parameter alive.
            unsafe {
                let there = param.unmodulated_normalized_value();
                Some(Look {
                    name: param.name().to_owned(),
                    value: self.controls.on_the_way.borrow_mut().value(id, there, Instant::now()),
                    default: param.default_normalized_value(),
                    steps: param.step_count(),
                })
            }
        }

        fn text(&self, id: &str, value: f32) -> String {
            // SAFETY: as above.
            self.controls
                .pointers
                .get(id)
                .map_or_else(String::new, |param| unsafe { param.normalized_value_to_string(value, true) })
        }

        fn parse(&self, id: &str, text: &str) -> Option<f32> {
            // SAFETY: as above.
            unsafe { self.controls.pointers.get(id)?.string_to_normalized_value(text) }
        }

        fn begin(&self, id: &str) {
            if let Some(&param) = self.controls.pointers.get(id) {
                // SAFETY: as above.
                unsafe { self.gui.raw_begin_set_parameter(param) }
            }
        }

        fn set(&self, id: &str, value: f32) {
            if let Some((&id, &param)) = self.controls.pointers.get_key_value(id) {
                // SAFETY: as above. A choice rounds the value to one of its steps.
                let rounded = unsafe {
                    self.gui.raw_set_parameter_normalized(param, value);
                    param.preview_normalized(param.preview_plain(value))
                };
                self.controls.on_the_way.borrow_mut().set(id, rounded, Instant::now());
            }
        }

        fn end(&self, id: &str) {
            if let Some(&param) = self.controls.pointers.get(id) {
                // SAFETY: as above.
                unsafe { self.gui.raw_end_set_parameter(param) }
            }
        }

        fn marks(&self, id: &str) -> Vec<Mark> {
            self.controls.params.host.marks(id)
        }

        fn links(&self) -> Option<&ControllerLinks> {
            Some(&self.controls.params.links)
        }

        fn curves(&self) -> Option<&SourceCurves> {
            Some(&self.controls.params.curves)
        }

        fn has_menu(&self) -> bool {
            self.controls.params.host.has_menu()
        }

        fn menu(&self, id: &str, at: (i32, i32)) {
            if let Some(&id) = self.controls.ids.iter().find(|known| **known == id) {
                self.controls.params.host.ask_menu(MenuRequest { id, at });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_counts_from_when_it_was_set_until_it_arrives_or_is_refused() {
        let (mut on_the_way, began) = (OnTheWay::default(), Instant::now());
        assert_eq!(on_the_way.value("growl", 0.2, began), 0.2);
        on_the_way.set("growl", 0.7, began);
        assert_eq!(on_the_way.value("growl", 0.2, began), 0.7);
        assert_eq!(on_the_way.value("lip", 0.5, began), 0.5);
        // It has arrived: from then on the host's changes count at once.
        assert_eq!(on_the_way.value("growl", 0.7, began), 0.7);
        assert_eq!(on_the_way.value("growl", 0.3, began), 0.3);
        on_the_way.set("growl", 0.9, began);
        assert_eq!(on_the_way.value("growl", 0.3, began + ARRIVES_WITHIN), 0.9);
        assert_eq!(
            on_the_way.value("growl", 0.3, began + 2 * ARRIVES_WITHIN),
            0.3,
            "the host has refused it"
        );
    }
}
