//! A force-feedback knob as the breath of a clarinet: its protocol, links to it, and how its angle becomes breath.
//!
//! The knob is a TorqueTuner or a compatible device. The player turns it, and its angle sets the mouth pressure. The host
//! sends parameters of a torque law (a *feel*), and the knob's firmware computes the torque itself, 2,000 times a second.
//! The host never sends torque.
//!
//! # Example
//!
//! Sends the feel of one note to the knob, and receives a measurement from it:
//!
//! ```
//! use chalumeau_knob::wire::{Decoder, DeviceState, Feel, Message, TorqueLaw, encode};
//!
//! // Host to knob: a flow law with 90 mNm per unit of flow. These bytes go to the serial port.
//! let feel = Message::Feel(Feel { law: TorqueLaw::Flow, scale_mnm: 90.0, ..Feel::default() });
//! feel.check()?;
//! let frame = encode(&feel, 7);
//! assert_eq!((frame[0], frame[frame.len() - 1]), (0, 0));
//!
//! // The knob decodes them; the sequence number comes back too.
//! let mut decoder = Decoder::new();
//! assert_eq!(decoder.feed(&frame).next(), Some(Ok((7, feel))));
//!
//! // Knob to host: the angle is in steps of 0.01 degrees.
//! let state = Message::State(DeviceState { angle: 9_000, ..DeviceState::default() });
//! let received = decoder.feed(&encode(&state, 8)).next();
//! let Some(Ok((_, Message::State(state)))) = received else { panic!("no STATE in {received:?}") };
//! assert_eq!(state.angle_deg(), 90.0);
//! # Ok::<(), chalumeau_knob::wire::OutOfRange>(())
//! ```
//!
//! # Modules
//!
//! - [`wire`]: the protocol TTLink 1, bytes to messages and back. Needs no port, clock or thread.
//! - [`touch`]: the angle becomes breath, note by note; takes (recordings of the knob) and the plan of a study.
//! - [`device`]: the host's side of a session, without port, thread or clock; with the feature `devices`, links to knobs over
//!   serial, MIDI and OSC, for which `device::KnobLink` is the entry point.
#![cfg_attr(
    feature = "simulator",
    doc = "- [`simulator`]: a simulated knob that runs the real firmware, with a simulated hand."
)]
#![cfg_attr(
    not(feature = "simulator"),
    doc = "- `simulator` (feature `simulator`): a simulated knob that runs the real firmware."
)]
//!
//! # Features
//!
//! - `devices`: links to knobs. On Linux it needs `libasound2-dev` and `pkg-config`.
//! - `midi-jack`: MIDI over JACK instead of ALSA.
//! - `simulator`: the simulated knob. It needs a C++17 compiler.
//!
//! No feature is on by default. Not yet tested on hardware; `docs/touch.md` says what was tested in the simulator.

pub mod device;
#[cfg(feature = "simulator")]
pub mod simulator;
pub mod touch;
pub mod wire;
