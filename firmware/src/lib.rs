//! The knob's firmware, compiled for this machine.
