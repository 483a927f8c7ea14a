//! The knob's firmware, compiled for this machine: the very C++ a knob runs (`firmware/include/chalumeau`), so that the
//! simulator and every test meet the real thing. This crate only wraps it; `ffi/ffi.cpp` is the other side.
//!
//! Angles are degrees since zero, torques mNm, positive is blowing. Payloads are those of `docs/protocol.md`, as bytes:
//! the crate knows nothing of the instrument.

mod core;

use std::fmt;

/// Rate of the haptic loop, Hz: how often [`Firmware::tick`] wants to be called.
pub const LOOP_HZ: u32 = 2000;

/// What is built in, and what was measured on the knob.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// Identity of the device, never 0.
    pub serial: u64,
    /// Name it gives, UTF-8; what exceeds 16 bytes is cut.
    pub name: String,
    /// Speaks the MIDI binding (and waits 330 ms for its host) instead of serial (80 ms).
    pub midi: bool,
    /// Major version of the protocol; anything but 1 is a mismatch to test.
    pub major: u8,
    /// The knob's own damping, N m s/rad; bounds the slopes it accepts.
    pub knob_damping_nms: f32,
    /// Most torque the device will ever make, mNm; 450 is compiled in as the most.
    pub ceiling_mnm: u16,
    /// Counts per turn of its encoder.
    pub counts_per_turn: u32,
    /// Where its count of disarmings begins; a real knob draws it at random at each start.
    pub epoch: u16,
    /// It moves the motor to and fro before the first arming of a session, to see its signs. `false`: for a shaft that
    /// obeys no motor.
    pub probes: bool,
    /// Its damping, signs and torque per count were measured; without, its ceiling is 50 mNm.
    pub calibrated: bool,
    /// Smallest step of torque that its motor board takes, mNm; 0: any torque.
    pub mnm_per_count: f32,
    /// Most that its motor board takes, mNm.
    pub board_clips_mnm: f32,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            serial: 0x5EED_0001,
            name: "Chalumeau sim".to_owned(),
            midi: false,
            major: 1,
            knob_damping_nms: 5e-4,
            ceiling_mnm: 450,
            counts_per_turn: 3600,
            epoch: 0,
            probes: true,
            calibrated: true,
            mnm_per_count: 0.0,
            board_clips_mnm: 450.0,
        }
    }
}

/// What the firmware senses in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Encoder, counts over all turns; the firmware sees the low 32 bits. The first reading is where zero lies until
    /// the host says ZERO.
    pub counts: i64,
    /// Speed as the motor board tells it, rpm.
    pub velocity_rpm: f32,
    /// The last exchange with the motor board succeeded.
    pub bus_ok: bool,
    /// The supply holds.
    pub supply_ok: bool,
    /// The button is down.
    pub button: bool,
    /// The local stop is pressed.
    pub stop: bool,
    /// The board tells a speed; otherwise the counts do.
    pub tells_velocity: bool,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            counts: 0,
            velocity_rpm: 0.0,
            bus_ok: true,
            supply_ok: true,
            button: false,
            stop: false,
            tells_velocity: true,
        }
    }
}

/// What a decoder has seen.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Good frames.
    pub frames: u32,
    /// Stretches that were no frame.
    pub junk: u32,
    /// Frames with a wrong checksum.
    pub crc_errors: u32,
    /// Frames missing, by their numbers.
    pub gaps: u32,
    /// Frames with the number of the one before.
    pub duplicates: u32,
}

/// Why a FEEL is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refused {
    /// Code as in EVENT refused.
    pub code: u8,
    /// The number to blame.
    pub value: f32,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the firmware refuses the feel: code {}, {}", self.code, self.value)
    }
}

impl std::error::Error for Refused {}

/// Payload of FEEL, as in `docs/protocol.md`.
pub type FeelBytes = [u8; 56];

/// One knob's firmware. It keeps no time of its own and starts no thread: it lives by [`Firmware::tick`].
pub struct Firmware {
    device: core::RawDevice,
}

impl fmt::Debug for Firmware {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Firmware")
            .field("armed", &self.is_armed())
            .field("fault", &self.fault())
            .finish_non_exhaustive()
    }
}

impl Firmware {
    /// Powers up. Allocates, and nothing after does.
    pub fn new(setup: &Setup) -> Self {
        Self { device: core::RawDevice::new(setup) }
    }

    /// Serial bytes from the host, any number of any.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.device.receive(bytes);
    }

    /// MIDI bytes from the host, any number of any.
    pub fn receive_midi(&mut self, bytes: &[u8]) {
        self.device.receive_midi(bytes);
    }

    /// One turn of the haptic loop; torque to command, mNm. Real-time safe.
    pub fn tick(&mut self, t_us: u64, reading: &Reading) -> f32 {
        self.device.tick(t_us, reading)
    }

    /// The torque of the last tick as the motor board is told it, mNm: in whole counts, whose rounding errors cancel over
    /// the ticks. Call it once a tick. Real-time safe.
    pub fn command(&mut self, torque_mnm: f32) -> f32 {
        self.device.command(torque_mnm)
    }

    /// Bytes for the host; the number written. A device that speaks MIDI writes SysEx and controllers, whole messages one
    /// after the other. Call often: what does not fit 1024 bytes is dropped and counted.
    pub fn transmit(&mut self, out: &mut [u8]) -> usize {
        self.device.transmit(out)
    }

    /// Torque may come.
    pub fn is_armed(&self) -> bool {
        self.device.armed()
    }

    /// What STATE says as `fault`: the fault that stands, else the one that disarmed last, 0 none.
    pub fn fault(&self) -> u8 {
        self.device.fault()
    }

    /// What its decoder has seen.
    pub fn counts(&self) -> Counts {
        self.device.counts()
    }

    /// Messages dropped because nobody took them.
    pub fn dropped(&self) -> u32 {
        self.device.dropped()
    }

    /// The STATE it would send now, payload only.
    pub fn state(&self) -> [u8; 20] {
        self.device.state()
    }

    /// The INFO it would send now, payload only.
    pub fn info(&self) -> [u8; 56] {
        self.device.info()
    }
}

/// Torque of a feel's law at rest, mNm: no limit, no morph, no check.
pub fn law_torque_mnm(feel: &FeelBytes, angle_deg: f32) -> f32 {
    core::law(feel, angle_deg)
}

/// Whether a device with this damping of its own (N m s/rad) and the default ceiling accepts a feel.
pub fn check_feel(feel: &FeelBytes, knob_damping_nms: f32) -> Result<(), Refused> {
    match core::check(feel, knob_damping_nms, Setup::default().ceiling_mnm) {
        Refused { code: 0, .. } => Ok(()),
        refused => Err(refused),
    }
}

/// What the C++ serial decoder makes of these bytes.
pub fn decode_counts(bytes: &[u8]) -> Counts {
    core::decode(bytes)
}

/// The reference flow at an index 0..=3600 of its table: the formula, not closed past H k.
pub fn seed_flow(index: u16, h: f32, k: f32) -> f32 {
    core::seed_flow(index, h, k)
}

/// The physical flow at an index of either sign, closed past H k.
pub fn physical_flow(index: f32, h: f32, k: f32) -> f32 {
    core::physical_flow(index, h, k)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a zero, so that it can be seen through the stuffing.
    const SESSION: u32 = 0x1234_5678;

    /// A frame on the serial line, written out by hand: the crate has no codec but the C++ one it tests.
    fn framed(kind: u8, seq: u8, payload: &[u8]) -> Vec<u8> {
        let mut frame = vec![kind, seq];
        frame.extend_from_slice(payload);
        let mut crc = !0_u32;
        for byte in &frame {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
            }
        }
        frame.extend_from_slice(&(!crc).to_le_bytes());
        let mut wire = vec![0];
        for run in frame.split(|byte| *byte == 0) {
            wire.push(u8::try_from(run.len() + 1).unwrap());
            wire.extend_from_slice(run);
        }
        wire.push(0);
        wire
    }

    /// ARM or ALIVE of a host that has just heard the knob.
    fn arm(session: u32, ceiling_mnm: u16, knob: &Firmware) -> Vec<u8> {
        let state = knob.state();
        let mut payload = session.to_le_bytes().to_vec();
        payload.extend_from_slice(&ceiling_mnm.to_le_bytes());
        payload.extend_from_slice(&state[18..20]); // epoch
        payload.extend_from_slice(&state[0..4]); // the knob's time
        payload
    }

    fn hello(session: u32) -> Vec<u8> {
        let mut payload = b"TTLK\x01\x01\x00\x00".to_vec();
        payload.extend_from_slice(&session.to_le_bytes());
        payload
    }

    fn flow(scale_mnm: f32) -> FeelBytes {
        let mut payload = vec![7, 1, 50, 0];
        for field in
            [2.598_076_f32, 0.384_900_18, scale_mnm, 1.0, 0.0, 120.0, 900.0, 180.0, 400.0, 20.0, 1.0, 0.5]
        {
            payload.extend_from_slice(&field.to_le_bytes());
        }
        payload.extend_from_slice(&[0, 0, 0, 0]);
        payload.try_into().unwrap()
    }

    #[test]
    fn says_hello_arms_pushes_and_lets_go_when_the_host_falls_silent() {
        // Damped enough for the wall of the feel below.
        let setup = Setup { knob_damping_nms: 2e-3, probes: false, ..Setup::default() };
        let mut knob = Firmware::new(&setup);
        let held = Reading { counts: 1200, tells_velocity: false, ..Reading::default() };
        // Zero is where the knob stood at power-up.
        knob.tick(0, &Reading { counts: 0, ..held });
        let mut t_us = 0;
        for tick in 1..=400 {
            t_us += 500;
            knob.tick(t_us, &Reading { counts: held.counts.min(10 * tick), ..held });
        }
        knob.transmit(&mut [0; 1024]);
        knob.receive(&framed(1, 0, &hello(SESSION)));
        let mut wire = [0; 256];
        let sent = knob.transmit(&mut wire);
        assert!(sent > 52 && wire.windows(4).any(|w| w == SESSION.to_le_bytes()), "INFO names the session");
        knob.receive(&framed(2, 1, &flow(80.0)));
        knob.receive(&framed(3, 2, &arm(SESSION, 100, &knob)));
        assert!(knob.is_armed());
        let mut seq = 3;
        for tick in 0..1000 {
            if tick % 40 == 0 {
                knob.receive(&framed(4, seq, &arm(SESSION, 100, &knob)));
                seq += 1;
            }
            t_us += 500;
            knob.tick(t_us, &held);
        }
        let torque = knob.tick(t_us + 500, &held);
        assert!((torque + 80.0).abs() < 0.01, "the peak of the flow law at a third of the way: {torque}");
        for _ in 0..2 * (80 + 50 + 10) {
            t_us += 500;
            knob.tick(t_us, &held);
        }
        assert_eq!((knob.tick(t_us + 500, &held), knob.is_armed(), knob.fault()), (0.0, false, 1));
        assert_eq!(knob.counts().crc_errors, 0);
    }

    #[test]
    fn the_law_alone_and_its_check_answer_without_a_device() {
        assert_eq!(law_torque_mnm(&flow(90.0), -50.0), 0.0);
        assert!((law_torque_mnm(&flow(90.0), 120.0) + 90.0).abs() < 1e-3);
        assert_eq!(law_torque_mnm(&flow(90.0), 380.0), 0.0);
        assert_eq!(check_feel(&flow(90.0), 2e-3), Ok(()));
        assert_eq!(
            check_feel(&flow(90.0), 5e-5).unwrap_err().code,
            2,
            "a knob that damps less takes less stiffness"
        );
        assert!((seed_flow(1200, 2.598_076, 0.384_900_18) - 1.0).abs() < 1e-6);
        assert!((physical_flow(-3600.0, 1.0, 0.5) + 3.0).abs() < 1e-5);
    }

    #[test]
    fn counts_what_was_no_frame() {
        let mut wire = b"ets Jul 29 2019 12:21:46\r\n".to_vec();
        let bye = SESSION.to_le_bytes();
        wire.extend(framed(8, 5, &bye));
        wire.extend(framed(8, 8, &bye));
        let mut broken = framed(8, 9, &bye);
        let at = broken.len() - 2;
        broken[at] ^= 0x10;
        wire.extend(broken);
        let counts = decode_counts(&wire);
        assert_eq!((counts.frames, counts.junk, counts.gaps, counts.crc_errors), (2, 1, 2, 1));
    }
}
