//! The C functions of `ffi/ffi.cpp`, and the one owner of the memory a device lives in.
#![allow(unsafe_code)]

use crate::{Counts, FeelBytes, Reading, Refused, Setup};

#[repr(C)]
struct RawSetup {
    serial: u64,
    name: [u8; 16],
    knob_damping_nms: f32,
    counts_per_turn: u32,
    ceiling_mnm: u16,
    midi: u8,
    major: u8,
    epoch: u16,
    mnm_per_count: f32,
    board_clips_mnm: f32,
    probes: u8,
    calibrated: u8,
}

#[repr(C)]
struct RawReading {
    counts: i64,
    velocity_rpm: f32,
    bus_ok: u8,
    supply_ok: u8,
    button: u8,
    stop: u8,
    tells_velocity: u8,
}

#[repr(C)]
struct RawVerdict {
    code: u8,
    value: f32,
}

unsafe extern "C" {
    fn fw_size() -> usize;
    fn fw_init(memory: *mut u64, setup: *const RawSetup);
    fn fw_receive(device: *mut u64, bytes: *const u8, length: usize);
    fn fw_receive_midi(device: *mut u64, bytes: *const u8, length: usize);
    fn fw_transmit(device: *mut u64, out: *mut u8, room: usize) -> usize;
    fn fw_tick(device: *mut u64, t_us: u64, reading: *const RawReading) -> f32;
    fn fw_command(device: *mut u64, torque_mnm: f32) -> f32;
    fn fw_armed(device: *const u64) -> u8;
    fn fw_fault(device: *const u64) -> u8;
    fn fw_dropped(device: *const u64) -> u32;
    fn fw_state(device: *const u64, payload: *mut u8);
    fn fw_info(device: *const u64, payload: *mut u8);
    fn fw_counts(device: *const u64) -> Counts;
    fn fw_law(feel: *const u8, angle_deg: f32) -> f32;
    fn fw_check(feel: *const u8, knob_damping_nms: f32, ceiling_mnm: u16) -> RawVerdict;
    fn fw_decode(bytes: *const u8, length: usize) -> Counts;
    fn fw_seed_flow(index: u16, h: f32, k: f32) -> f32;
    fn fw_physical_flow(index: f32, h: f32, k: f32) -> f32;
}

/// A C++ `Device` in memory that Rust owns. It holds no pointer and needs no destructor, so it may move with its box and
/// between threads.
pub struct RawDevice {
    // u64 words: the C++ side asserts that no more alignment is needed.
    memory: Box<[u64]>,
}

impl RawDevice {
    pub fn new(setup: &Setup) -> Self {
        let mut name = [0; 16];
        let mut cut = setup.name.len().min(name.len());
        while !setup.name.is_char_boundary(cut) {
            cut -= 1;
        }
        name[..cut].copy_from_slice(&setup.name.as_bytes()[..cut]);
        let raw = RawSetup {
            serial: setup.serial.max(1),
            name,
            knob_damping_nms: setup.knob_damping_nms,
            counts_per_turn: setup.counts_per_turn.max(1),
            ceiling_mnm: setup.ceiling_mnm,
            midi: u8::from(setup.midi),
            major: setup.major,
            epoch: setup.epoch,
            mnm_per_count: setup.mnm_per_count,
            board_clips_mnm: setup.board_clips_mnm,
            probes: u8::from(setup.probes),
            calibrated: u8::from(setup.calibrated),
        };
        // SAFETY: takes nothing, returns a constant.
        let words = unsafe { fw_size() }.div_ceil(8);
        let mut memory = vec![0; words].into_boxed_slice();
        // SAFETY: the memory is as large and as aligned as the C++ side says it needs.
        unsafe { fw_init(memory.as_mut_ptr(), &raw) };
        Self { memory }
    }

    pub fn receive(&mut self, bytes: &[u8]) {
        // SAFETY: a device initialised in `new`; pointer and length are one slice's.
        unsafe { fw_receive(self.memory.as_mut_ptr(), bytes.as_ptr(), bytes.len()) }
    }

    pub fn receive_midi(&mut self, bytes: &[u8]) {
        // SAFETY: as above.
        unsafe { fw_receive_midi(self.memory.as_mut_ptr(), bytes.as_ptr(), bytes.len()) }
    }

    pub fn transmit(&mut self, out: &mut [u8]) -> usize {
        // SAFETY: as above; it writes at most `out.len()` bytes.
        unsafe { fw_transmit(self.memory.as_mut_ptr(), out.as_mut_ptr(), out.len()) }
    }

    pub fn tick(&mut self, t_us: u64, reading: &Reading) -> f32 {
        let raw = RawReading {
            counts: reading.counts,
            velocity_rpm: reading.velocity_rpm,
            bus_ok: u8::from(reading.bus_ok),
            supply_ok: u8::from(reading.supply_ok),
            button: u8::from(reading.button),
            stop: u8::from(reading.stop),
            tells_velocity: u8::from(reading.tells_velocity),
        };
        // SAFETY: a device initialised in `new`; the reading lives through the call.
        unsafe { fw_tick(self.memory.as_mut_ptr(), t_us, &raw) }
    }

    pub fn command(&mut self, torque_mnm: f32) -> f32 {
        // SAFETY: as above.
        unsafe { fw_command(self.memory.as_mut_ptr(), torque_mnm) }
    }

    pub fn armed(&self) -> bool {
        // SAFETY: a device initialised in `new`, read only.
        unsafe { fw_armed(self.memory.as_ptr()) != 0 }
    }

    pub fn fault(&self) -> u8 {
        // SAFETY: as above.
        unsafe { fw_fault(self.memory.as_ptr()) }
    }

    pub fn dropped(&self) -> u32 {
        // SAFETY: as above.
        unsafe { fw_dropped(self.memory.as_ptr()) }
    }

    pub fn counts(&self) -> Counts {
        // SAFETY: as above.
        unsafe { fw_counts(self.memory.as_ptr()) }
    }

    pub fn state(&self) -> [u8; 20] {
        let mut payload = [0; 20];
        // SAFETY: as above; it writes the 20 bytes of a STATE.
        unsafe { fw_state(self.memory.as_ptr(), payload.as_mut_ptr()) };
        payload
    }

    pub fn info(&self) -> [u8; 56] {
        let mut payload = [0; 56];
        // SAFETY: as above; it writes the 56 bytes of an INFO.
        unsafe { fw_info(self.memory.as_ptr(), payload.as_mut_ptr()) };
        payload
    }
}

pub fn law(feel: &FeelBytes, angle_deg: f32) -> f32 {
    // SAFETY: reads the 56 bytes of a FEEL.
    unsafe { fw_law(feel.as_ptr(), angle_deg) }
}

pub fn check(feel: &FeelBytes, knob_damping_nms: f32, ceiling_mnm: u16) -> Refused {
    // SAFETY: as above.
    let verdict = unsafe { fw_check(feel.as_ptr(), knob_damping_nms, ceiling_mnm) };
    Refused { code: verdict.code, value: verdict.value }
}

pub fn decode(bytes: &[u8]) -> Counts {
    // SAFETY: pointer and length are one slice's.
    unsafe { fw_decode(bytes.as_ptr(), bytes.len()) }
}

pub fn seed_flow(index: u16, h: f32, k: f32) -> f32 {
    // SAFETY: numbers only; the C++ side clips the index to its table.
    unsafe { fw_seed_flow(index, h, k) }
}

pub fn physical_flow(index: f32, h: f32, k: f32) -> f32 {
    // SAFETY: numbers only; the C++ side bounds what it reads.
    unsafe { fw_physical_flow(index, h, k) }
}
