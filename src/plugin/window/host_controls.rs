//! The plugin's parameters as the editor may see them.

use std::collections::HashMap;
use std::sync::Arc;

use nice_plug::context::gui::GuiContext;
use nice_plug::prelude::{ParamPtr, Params};

use crate::controllers::ControllerLinks;
use crate::controllers::source_curves::SourceCurves;
use crate::editor::controls::Mark;
use crate::editor::{Controls, Look};
use crate::plugin::host_link::MenuRequest;
use crate::plugin::params::ChalumeauParams;

/// All parameters by their ids. `params` keeps the pointers valid.
pub struct HostControls {
    ids: Vec<&'static str>,
    pointers: HashMap<&'static str, ParamPtr>,
    params: Arc<ChalumeauParams>,
}

/// The parameters together with the host's context, which is told of changes.
pub struct WithHost<'a> {
    controls: &'a HostControls,
    gui: &'a GuiContext,
}

impl HostControls {
    /// Lists these parameters.
    pub fn new(params: Arc<ChalumeauParams>) -> Self {
        // The editor wants ids that live forever. They are a few bytes, leaked once a plugin instance.
        let all: Vec<(&'static str, ParamPtr)> = params
            .param_map()
            .into_iter()
            .map(|(id, pointer, _)| (&*Box::leak(id.into_boxed_str()), pointer))
            .collect();
        Self { ids: all.iter().map(|(id, _)| *id).collect(), pointers: all.into_iter().collect(), params }
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
                Some(Look {
                    name: param.name().to_owned(),
                    value: param.unmodulated_normalized_value(),
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
            if let Some(&param) = self.controls.pointers.get(id) {
                // SAFETY: as above.
                unsafe { self.gui.raw_set_parameter_normalized(param, value) }
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
