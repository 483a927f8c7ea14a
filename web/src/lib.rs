//! The clarinet in a browser: `chalumeau-core` as a WebAssembly module without imports.
//!
//! - [`playing`]: the instrument as the page plays it, raw MIDI and breath in, blocks of two channels out
//! - [`values`]: the settings as a list of numbers, which the page's presets and controls hold
//! - [`held_knob`]: a knob at the browser's serial port, by the native link's session
//! - `workshop` (feature `workshop`): what takes long, for the page's workers: moved holes, instrument files, the knob's feel
//! - `drawn`: what the page draws of an instrument (feature `workshop`)
//! - `exports`: the C interface of the module
//!
//! One module holds one instrument at a time. What is longer than a number is written to the module's inbox, so that the interface
//! passes no pointer in. The page's audio worklet plays one (`web/page/worklet.js`). `cargo xtask web` builds both.

#[cfg(feature = "workshop")]
pub mod drawn;
mod exports;
pub mod held_knob;
pub mod playing;
pub mod values;
#[cfg(feature = "workshop")]
pub mod workshop;
