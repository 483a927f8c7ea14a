//! Whether a microphone blows, and the room that it stands in.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use nice_plug::params::persist::PersistentField;
use nice_plug::prelude::*;

use super::entry::switch_from;
use super::moment::{self, Moment, Moments};
use crate::plugin::launch_options::LaunchOptions;
use chalumeau_core::control::wind::WindDesign;

/// The microphone at the plugin's audio input.
#[derive(Params)]
pub struct MicrophoneParams {
    /// Whether it blows.
    #[id = "mic"]
    pub on: BoolParam,
    /// Measures the room.
    #[id = "miccal"]
    pub calibrate: BoolParam,
}

impl MicrophoneParams {
    /// The table's parameters. The standalone switches the microphone on and measures the room where the user has named one.
    pub(super) fn new(moments: &Arc<Moments>) -> Self {
        let is_named = LaunchOptions::get().is_some_and(|options| options.microphone.load(Ordering::Relaxed));
        if is_named {
            moments.press(Moment::Calibrate);
        }
        Self {
            on: switch_from("mic", |default| default || is_named),
            calibrate: moment::switch(Moment::Calibrate, moments),
        }
    }
}

/// The level of the room as it was measured last, the bits of an f32, dBFS. A project saves it. Real-time safe.
#[derive(Debug)]
pub struct RoomFloor(AtomicU32);

impl Default for RoomFloor {
    fn default() -> Self {
        Self(AtomicU32::new(WindDesign::default().floor_dbfs.to_bits()))
    }
}

impl RoomFloor {
    /// A saved level as it may be.
    pub fn mended(floor_dbfs: f32) -> f32 {
        WindDesign { floor_dbfs }.clamped().floor_dbfs
    }

    /// The room.
    pub fn design(&self) -> WindDesign {
        WindDesign { floor_dbfs: f32::from_bits(self.0.load(Ordering::Relaxed)) }
    }

    /// Takes a room; whether it is another.
    pub fn replace(&self, room: WindDesign) -> bool {
        let bits = Self::mended(room.floor_dbfs).to_bits();
        self.0.swap(bits, Ordering::Relaxed) != bits
    }
}

impl PersistentField<'_, f32> for RoomFloor {
    fn set(&self, floor_dbfs: f32) {
        self.replace(WindDesign { floor_dbfs });
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&f32) -> R,
    {
        f(&self.design().floor_dbfs)
    }
}
