//! The clarinet in a browser: `chalumeau-core` as a WebAssembly module without imports.
//!
//! - [`playing`]: the instrument as the page plays it, raw MIDI and breath in, blocks of two channels out
//! - [`values`]: the settings as a list of numbers, which the page's presets and controls hold
//! - `exports`: the C interface of the module
//!
//! One module holds one instrument at a time, so that the interface passes no pointer in. The page's audio worklet plays one
//! (`web/page/worklet.js`). `cargo xtask web` builds both.

mod exports;
pub mod playing;
pub mod values;
