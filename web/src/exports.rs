//! The C interface of the module. Each function says nothing to, and asks nothing of, a module without an instrument.
//!
//! Every number is checked, so that no call can trap. A pointer leaves the module and none comes in: the worklet reads the
//! samples and the picture where they lie.

// PROOF: `no_mangle` counts as unsafe because two functions of one name would be taken for each other. The prefix keeps these
// names from others.
#![allow(unsafe_code)]

use std::sync::{Mutex, MutexGuard, PoisonError};

use chalumeau_core::bore::bundled::Bundled;

use crate::held_knob::HeldKnob;
use crate::playing::{MOST_FRAMES, PICTURE, Playing};

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

/// A made instrument takes over from the one before; 1, for the page.
fn take_over(mut made: Playing) -> u32 {
    let mut playing = locked();
    if let Some(before) = playing.take() {
        made.carry_on(*before);
    }
    *playing = Some(Box::new(made));
    1
}

/// Makes an instrument for a sample rate in Hz, by its place among the bundled ones (the first for a place that is not there). It
/// takes over from the one before. 1, or 0 if the rate is out of range. Allocates.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_begin(rate_hz: f64, instrument: u32) -> u32 {
    let instrument = Bundled::ALL.get(instrument as usize).copied().unwrap_or_default();
    let Ok(made) = Playing::new(rate_hz, instrument) else { return stay() };
    take_over(made)
}

/// What was to take over does not.
fn stay() -> u32 {
    with(Playing::stay);
    0
}

/// Lets the instrument fall silent, for another to begin: making one takes some ten blocks.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_leave() {
    with(Playing::leave);
}

/// 1 once it has, also where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_has_left() -> u32 {
    locked().as_deref().is_none_or(Playing::has_left).into()
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

/// See [`Playing::set_microphone`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_microphone(is_on: u32) {
    with(|playing| playing.set_microphone(is_on != 0));
}

/// See [`Playing::calibrate`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_calibrate() {
    with(Playing::calibrate);
}

/// Where the page writes what the microphone gives, as many samples as a block has at most; null without an instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_input() -> *mut f32 {
    locked().as_deref_mut().map_or(std::ptr::null_mut(), |playing| playing.input().as_mut_ptr())
}

/// See [`Playing::hear`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_hear(frames: u32) -> u32 {
    locked().as_deref_mut().map_or(0, |playing| u32::from(playing.hear(frames as usize)))
}

/// Where the numbers of [`Playing::wind`] lie; null without an instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_wind() -> *const f32 {
    locked().as_deref_mut().map_or(std::ptr::null(), |playing| playing.wind().as_ptr())
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

/// How many numbers [`chalumeau_picture`] gives.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_picture_numbers() -> u32 {
    PICTURE as u32
}

/// Where the numbers of [`Playing::picture`] lie; null without an instrument.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_picture() -> *const f32 {
    locked().as_deref_mut().map_or(std::ptr::null(), |playing| playing.picture().as_ptr())
}

/// What the page writes for the next call that takes bytes, and what it reads after one that gives some.
static INBOX: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static OUTBOX: Mutex<Vec<u8>> = Mutex::new(Vec::new());
/// Most bytes of the inbox: an instrument with its preparation, and as much again.
const MOST_BYTES: usize = 1 << 20;

fn inbox() -> MutexGuard<'static, Vec<u8>> {
    INBOX.lock().unwrap_or_else(PoisonError::into_inner)
}

fn outbox() -> MutexGuard<'static, Vec<u8>> {
    OUTBOX.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls `give` with the knob and the outbox; returns how many bytes are in it then.
fn given(give: impl FnOnce(&mut HeldKnob, &mut Vec<u8>)) -> u32 {
    let mut out = outbox();
    out.clear();
    if let Some(knob) = locked().as_deref_mut().and_then(Playing::knob) {
        give(knob, &mut out);
    }
    out.len() as u32
}

fn with_knob(change: impl FnOnce(&mut HeldKnob)) {
    with(|playing| {
        if let Some(knob) = playing.knob() {
            change(knob);
        }
    });
}

/// Where so many bytes can be written for the next call that takes bytes; null for more than a megabyte. Allocates.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_inbox(bytes: u32) -> *mut u8 {
    if bytes as usize > MOST_BYTES {
        return std::ptr::null_mut();
    }
    let mut inbox = inbox();
    inbox.resize(bytes as usize, 0);
    inbox.as_mut_ptr()
}

/// Where the bytes of the last call that gave some lie.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_outbox() -> *const u8 {
    outbox().as_ptr()
}

/// [`chalumeau_begin`] with a prepared instrument in the inbox: the text of its file, `file` bytes, and the rest its preparation. 1,
/// or 0 if they are not what a workshop has made, and then nothing changes. Allocates.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_begin_prepared(rate_hz: f64, file: u32) -> u32 {
    let inbox = inbox();
    let texts = std::str::from_utf8(&inbox).ok().and_then(|text| text.split_at_checked(file as usize));
    let Some(made) = texts.and_then(|(file, prepared)| Playing::prepared(rate_hz, file, prepared)) else {
        return stay();
    };
    take_over(made)
}

/// A port with a knob has been opened; `number` is random. Gives the bytes that the page may write at any time to end torque.
/// Times are milliseconds of one clock. Allocates.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_open(number: u32, now_ms: f64) -> u32 {
    with(|playing| playing.set_knob(Some(Box::new(HeldKnob::new(number, now_ms)))));
    given(|_, out| HeldKnob::farewell(number, out))
}

/// The port has been closed, or is gone.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_close() {
    with(|playing| playing.set_knob(None));
}

/// The inbox came from the port at this time.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_receive(now_ms: f64) {
    with_knob(|knob| knob.receive(now_ms, &inbox()));
}

/// Lets time pass before a block of samples. Gives the bytes to write.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_turn(now_ms: f64, frames: u32) -> u32 {
    with(|playing| playing.turn_knob(now_ms, (frames as usize).min(MOST_FRAMES)));
    given(HeldKnob::take_out)
}

/// See [`HeldKnob::take_baud`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_baud() -> u32 {
    locked().as_deref_mut().and_then(Playing::knob).map_or(0, HeldKnob::take_baud)
}

/// See [`HeldKnob::beat`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_beat(now_ms: f64) {
    with_knob(|knob| knob.beat(now_ms));
}

/// See [`HeldKnob::arm`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_arm(ceiling_mnm: u32) {
    with_knob(|knob| knob.arm(ceiling_mnm.min(u32::from(u16::MAX)) as u16));
}

/// See [`HeldKnob::lower_ceiling`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_lower(ceiling_mnm: u32) {
    with_knob(|knob| knob.lower_ceiling(ceiling_mnm.min(u32::from(u16::MAX)) as u16));
}

/// See [`HeldKnob::let_go`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_let_go(reason: u32) {
    with_knob(|knob| knob.let_go(reason as usize));
}

/// See [`HeldKnob::zero`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_zero() {
    with_knob(HeldKnob::zero);
}

/// The inbox is a feel, as a workshop has made it.
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_feel() {
    with(|playing| playing.set_feel(&inbox()));
}

/// Gives the text of [`HeldKnob::status`].
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_knob_status() -> u32 {
    given(|knob, out| out.extend_from_slice(knob.status().as_bytes()))
}

/// The inbox is a question to the workshop; gives the answer. See [`crate::workshop`]. Takes up to minutes.
#[cfg(feature = "workshop")]
#[unsafe(no_mangle)]
pub extern "C" fn chalumeau_workshop() -> u32 {
    let question = inbox().clone();
    let answer = crate::workshop::answer(&question);
    let mut out = outbox();
    *out = answer;
    out.len() as u32
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
                chalumeau_inbox(a);
                chalumeau_microphone(a);
                chalumeau_hear(a);
                chalumeau_calibrate();
                chalumeau_input();
                chalumeau_wind();
                let now_ms = 10.0 * f64::from(a % 1_000);
                for byte in [0, a as u8, 255] {
                    inbox().fill(byte);
                    chalumeau_knob_receive(now_ms);
                    chalumeau_knob_feel();
                    assert_eq!(chalumeau_begin_prepared(48_000.0, a), 0);
                }
                chalumeau_knob_turn(now_ms, a);
                chalumeau_knob_baud();
                chalumeau_knob_arm(a);
                chalumeau_knob_lower(a);
                chalumeau_knob_let_go(a);
                chalumeau_knob_beat(f64::NAN);
                chalumeau_knob_zero();
                chalumeau_knob_status();
                chalumeau_outbox();
                chalumeau_leave();
                chalumeau_has_left();
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
        assert!(chalumeau_knob_open(7, 0.0) > 0, "a farewell");
        every_call();
        chalumeau_knob_close();
        assert!(!chalumeau_picture().is_null() && chalumeau_process(128) == 128);
        let channel = |at| locked().as_deref().map(|playing| *playing.channel(at)).unwrap();
        assert!(channel(0).iter().chain(&channel(1)).all(|sample| sample.abs() <= 1.0));
    }
}
