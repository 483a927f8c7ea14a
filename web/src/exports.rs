//! The C interface of the module. Each function says nothing to, and asks nothing of, a module without an instrument.
//!
//! Every number is checked, so that no call can trap. A pointer leaves the module and none comes in: the worklet reads the
//! samples and the picture where they lie.

// PROOF: `no_mangle` counts as unsafe because two functions of one name would be taken for each other. The prefix keeps these
// names from others.
#![allow(unsafe_code)]

use std::sync::{Mutex, MutexGuard, PoisonError};

use chalumeau_core::bore::bundled::Bundled;

use crate::playing::{MOST_FRAMES, Playing};

/// A module in a worklet has one thread: the lock is never waited for.
static PLAYING: Mutex<Option<Box<Playing>>> = Mutex::new(None);

fn locked() -> MutexGuard<'static, Option<Box<Playing>>> {
    PLAYING.lock().unwrap_or_else(PoisonError::into_inner)
}

fn with(change: impl FnOnce(&mut Playing)) {
    if let Some(playing) = locked().as_deref_mut() {
        change(playing);
    }
}

/// Makes an instrument for a sample rate in Hz, by its place among the bundled ones (the first for a place that is not there). It
/// takes over from the one before. 1, or 0 if the rate is out of range. Allocates.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_begin(rate_hz: f64, instrument: u32) -> u32 {
    let instrument = Bundled::ALL.get(instrument as usize).copied().unwrap_or_default();
    let Ok(mut made) = Playing::new(rate_hz, instrument) else { return 0 };
    let mut playing = locked();
    if let Some(before) = playing.take() {
        made.carry_on(*before);
    }
    *playing = Some(Box::new(made));
    1
}

/// Most samples of one block.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_most_frames() -> u32 {
    MOST_FRAMES as u32
}

/// Where the samples of a channel lie after [`chalumeau_process`]; null without an instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_channel(at: u32) -> *const f32 {
    locked().as_deref().map_or(std::ptr::null(), |playing| playing.channel(at as usize).as_ptr())
}

/// Makes the next samples; returns how many.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_process(frames: u32) -> u32 {
    locked().as_deref_mut().map_or(0, |playing| playing.process(frames as usize) as u32)
}

/// A MIDI channel message.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_midi(status: u32, first: u32, second: u32) {
    let byte = |number: u32| number.min(255) as u8;
    with(|playing| playing.midi(byte(status), byte(first), byte(second)));
}

/// Breath, 0..=1; below 0, or what is not a number, gives it back to the keys.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_breath(unit: f32) {
    with(|playing| playing.breath((unit >= 0.0).then_some(unit)));
}

/// Ends everything that sounds.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_silence() {
    with(Playing::silence);
}

/// Changes a value; [`chalumeau_settle`] brings it to the instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_set(at: u32, value: f32) {
    with(|playing| playing.set(at as usize, value));
}

/// See [`Playing::settle`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_settle() {
    with(Playing::settle);
}

/// See [`Playing::wheel`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_wheel(at: u32) {
    with(|playing| playing.wheel(at as usize));
}

/// See [`Playing::bend_range`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_bend_range(semitones: u32) {
    with(|playing| playing.bend_range(semitones.min(127) as u8));
}

/// See [`Playing::breath_from`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_breath_from(at: u32) {
    with(|playing| playing.breath_from(at as usize));
}

/// Where the numbers of [`Playing::picture`] lie; null without an instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_picture() -> *const f32 {
    locked().as_deref_mut().map_or(std::ptr::null(), |playing| playing.picture().as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One test, because the module's instrument is one.
    #[test]
    fn no_call_is_wrong_with_or_without_an_instrument() {
        let numbers = [0, 1, 5, 60, 127, 128, 255, 256, u32::MAX];
        let every_call = || {
            for a in numbers {
                for b in numbers {
                    for status in [0x80, 0x90, 0xa0, 0xb0, 0xc0, 0xd0, 0xe3, 0xf0, a] {
                        chalumeau_midi(status, a, b);
                    }
                    for value in [f32::NAN, f32::INFINITY, -1.0, 0.5, 1e30] {
                        chalumeau_set(a, value);
                        chalumeau_breath(value);
                    }
                    chalumeau_settle();
                }
                chalumeau_wheel(a);
                chalumeau_bend_range(a);
                chalumeau_breath_from(a);
                chalumeau_channel(a);
                let frames = chalumeau_process(a);
                assert!(frames <= chalumeau_most_frames() && frames <= a);
                chalumeau_picture();
            }
            chalumeau_silence();
        };
        every_call();
        assert!(chalumeau_picture().is_null() && chalumeau_process(128) == 0);
        for rate_hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
            assert_eq!(chalumeau_begin(rate_hz, 0), 0, "{rate_hz}");
        }
        assert_eq!(chalumeau_begin(48_000.0, 99), 1);
        every_call();
        assert!(!chalumeau_picture().is_null() && chalumeau_process(128) == 128);
        let channel = |at| locked().as_deref().map(|playing| *playing.channel(at)).unwrap();
        assert!(channel(0).iter().chain(&channel(1)).all(|sample| sample.abs() <= 1.0));
    }
}
