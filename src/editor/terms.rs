//! What a tool tip says of a parameter, and what undo and A/B carry: all of it is the table's.

use crate::parameters;
use crate::parameters::Parameter;

/// The explanation of a parameter.
pub fn of(id: &str) -> Option<&'static Parameter> {
    parameters::find(id)
}

/// Whether undo carries it. What is unknown does not go.
pub fn is_setting(id: &str) -> bool {
    of(id).is_some_and(|parameter| parameter.is_undoable)
}

/// Whether A and B carry it: what undo carries, and the instrument.
pub fn is_compared(id: &str) -> bool {
    of(id).is_some_and(Parameter::is_compared)
}
