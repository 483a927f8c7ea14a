//! A force-feedback knob as a clarinet's breath: the wire protocol, links to knobs, feel and breath, and a simulated knob.

#[cfg(feature = "devices")]
pub mod device;
#[cfg(feature = "simulator")]
pub mod simulator;
pub mod touch;
pub mod wire;
