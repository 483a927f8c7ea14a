//! MIDI controllers that the user links to parameters: a hardware knob that turns *Growl*, a pedal that blows.
//!
//! `map` is their text, `factory` the devices that the program knows, `links` what the audio thread and the window share.
//! `breath_input` names the inputs of breath, `source_curves` gives an input a curve of its own. What a link does is the core's:
//! [`chalumeau_core::control::midi::links`].

pub mod breath_input;
pub mod factory;
mod links;
mod map;
pub mod source_curves;

pub use links::{ControllerLinks, mended};
pub use map::{ControllerMap, MapError, ParameterLink, as_links, linkable, source_name};
