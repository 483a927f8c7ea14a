//! What a tool tip says of a parameter, and what undo carries: both are the table's.

use crate::parameters;
use crate::parameters::Parameter;

/// The explanation of a parameter.
pub fn of(id: &str) -> Option<&'static Parameter> {
    parameters::find(id)
}

/// Whether undo and A/B carry it. What is unknown does not go.
pub fn is_setting(id: &str) -> bool {
    of(id).is_some_and(|parameter| parameter.is_undoable)
}
