//! The messages that every implementation must write byte for byte.

use chalumeau_knob::wire::{
    Arm, Capabilities, Counters, DeviceEvent, DeviceState, EventKind, Feel, Flags, Info, Message, Stamp,
    TorqueLaw,
};

/// The reference reed at TorqueTuner's own scale, with everything switched on.
pub fn reference_feel() -> Feel {
    Feel {
        feel_id: 17,
        law: TorqueLaw::Flow,
        scale_mnm: 90.0,
        wall_mnm_per_deg: 4.0,
        slap_mnm_per_deg: 0.5,
        damping_mnms: 0.4,
        friction: 15,
        detent: 30,
        ..Feel::default()
    }
}

/// A TorqueTuner as it describes itself.
pub fn device_info() -> Info {
    Info {
        major: 1,
        minor: 1,
        capabilities: Capabilities(
            Capabilities::FLOW
                | Capabilities::PRESSURE
                | Capabilities::SLAP
                | Capabilities::DETENT
                | Capabilities::MOTOR
                | Capabilities::CALIBRATED,
        ),
        firmware: (0, 2, 345),
        name: Info::name_bytes("TorqueTuner"),
        serial: 0x0011_2233_4455_6677,
        counts_per_turn: 3_600,
        loop_hz: 2_000,
        watchdog_ms: 80,
        fade_ms: 50,
        ceiling_mnm: 450,
        session: 0xDEAD_BEEF,
        stiffness_limit: 2_000,
        push_limit: 60,
        counters: Some(Counters { overruns: 3, bus_errors: 260 }),
    }
}

/// The same of TTLink 1.0.
fn older_info() -> Info {
    Info { minor: 0, counters: None, ..device_info() }
}

/// A message, the name of its file without the ending, and its sequence number.
type Named = (&'static str, u8, Message);

/// The messages every implementation must write byte for byte.
pub fn messages() -> Vec<Named> {
    [host_messages(), feels(), infos(), states(), events()].concat()
}

/// What a host sends, FEEL aside.
fn host_messages() -> Vec<Named> {
    let older = |session, ceiling_mnm| Arm { session, ceiling_mnm, stamp: None };
    let arm = |session, ceiling_mnm, epoch, heard_us| Arm {
        session,
        ceiling_mnm,
        stamp: Some(Stamp { epoch, heard_us }),
    };
    vec![
        ("hello", 0, Message::Hello { major: 1, minor: 1, session: 0xDEAD_BEEF }),
        ("hello_zeros", 1, Message::Hello { major: 0, minor: 0, session: 0 }),
        ("hello_most", 255, Message::Hello { major: 255, minor: 255, session: u32::MAX }),
        ("arm", 6, Message::Arm(arm(0xDEAD_BEEF, 100, 0x1234, 1_234_567))),
        ("arm_zeros", 0, Message::Arm(arm(0, 0, 0, 0))),
        ("arm_most", 7, Message::Arm(arm(u32::MAX, 450, u16::MAX, u32::MAX))),
        ("arm_1_0", 6, Message::Arm(older(0xDEAD_BEEF, 100))),
        ("alive", 8, Message::Alive(arm(0xDEAD_BEEF, 250, 7, 0x8000_0000))),
        ("alive_zeros", 0, Message::Alive(arm(0, 0, 0, 0))),
        ("alive_1_0", 8, Message::Alive(older(0xDEAD_BEEF, 250))),
        ("free", 9, Message::Free),
        ("free_seq_0", 0, Message::Free),
        ("zero", 10, Message::Zero(0)),
        ("zero_least", 11, Message::Zero(-360_000)),
        ("zero_most", 12, Message::Zero(360_000)),
        ("rate_least", 13, Message::Rate(10)),
        ("rate", 14, Message::Rate(500)),
        ("rate_most", 15, Message::Rate(1_000)),
        ("bye", 16, Message::Bye { session: 0xDEAD_BEEF }),
    ]
}

fn feels() -> Vec<Named> {
    let least = Feel {
        feel_id: 0,
        law: TorqueLaw::Free,
        morph_ms: 20,
        h: 0.5,
        k: 0.01,
        scale_mnm: 0.0,
        stretch: 0.1,
        offset_deg: -360.0,
        a_on_deg: 0.0,
        a_off_deg: 0.0,
        a_beat_deg: 0.0,
        wall_deg: 10.0,
        wall_mnm_per_deg: 0.0,
        slap_mnm_per_deg: 0.0,
        damping_mnms: 0.0,
        friction: 0,
        detent: 0,
    };
    let most = Feel {
        feel_id: 255,
        law: TorqueLaw::Pressure,
        morph_ms: 1_000,
        h: 10.0,
        k: 1.0,
        scale_mnm: 450.0,
        stretch: 30.0,
        offset_deg: 360.0,
        a_on_deg: 3_600.0,
        a_off_deg: 36_000.0,
        a_beat_deg: 3_600.0,
        wall_deg: 36_000.0,
        wall_mnm_per_deg: 100.0,
        slap_mnm_per_deg: 20.0,
        damping_mnms: 20.0,
        friction: 1_000,
        detent: 1_000,
    };
    vec![
        ("feel_rest", 2, Message::Feel(Feel::default())),
        ("feel_reference", 3, Message::Feel(reference_feel())),
        ("feel_least", 0, Message::Feel(least)),
        ("feel_most", 255, Message::Feel(most)),
        ("feel_stiff_thin", 4, Message::Feel(Feel { h: 0.5, k: 20.0, ..reference_feel() })),
        ("feel_minus_zero", 5, Message::Feel(Feel { offset_deg: -0.0, scale_mnm: -0.0, ..reference_feel() })),
    ]
}

fn infos() -> Vec<Named> {
    let most = Info {
        major: 255,
        minor: 255,
        capabilities: Capabilities(u16::MAX),
        firmware: (255, 255, u16::MAX),
        name: [0xFF; 16],
        serial: u64::MAX,
        counts_per_turn: u32::MAX,
        loop_hz: u16::MAX,
        watchdog_ms: u16::MAX,
        fade_ms: u16::MAX,
        ceiling_mnm: u16::MAX,
        session: u32::MAX,
        stiffness_limit: u16::MAX,
        push_limit: u16::MAX,
        counters: Some(Counters { overruns: u16::MAX, bus_errors: u16::MAX }),
    };
    let least = Info {
        major: 0,
        minor: 0,
        capabilities: Capabilities(0),
        firmware: (0, 0, 0),
        name: [0; 16],
        serial: 1,
        counts_per_turn: 0,
        loop_hz: 0,
        watchdog_ms: 0,
        fade_ms: 0,
        ceiling_mnm: 0,
        session: 0,
        stiffness_limit: 0,
        push_limit: 0,
        counters: Some(Counters::default()),
    };
    vec![
        ("info", 0, Message::Info(device_info())),
        ("info_least", 1, Message::Info(least)),
        ("info_most", 2, Message::Info(most)),
        ("info_1_0", 0, Message::Info(older_info())),
    ]
}

fn states() -> Vec<Named> {
    let state = DeviceState {
        t_us: 1_234_567,
        angle: -10_050,
        velocity: -123,
        torque: 45,
        flags: Flags(Flags::ARMED | Flags::SLAP),
        feel_id: 17,
        slaps: 3,
        events: 9,
        fault: 0,
        epoch: Some(0x1234),
    };
    let least = DeviceState {
        t_us: 0,
        angle: i32::MIN,
        velocity: i16::MIN,
        torque: i16::MIN,
        epoch: Some(0),
        ..DeviceState::default()
    };
    let most = DeviceState {
        t_us: u32::MAX,
        angle: i32::MAX,
        velocity: i16::MAX,
        torque: i16::MAX,
        flags: Flags(u16::MAX),
        feel_id: 255,
        slaps: 255,
        events: 255,
        fault: 255,
        epoch: Some(u16::MAX),
    };
    vec![
        ("state", 3, Message::State(state)),
        ("state_zeros", 0, Message::State(DeviceState { epoch: Some(0), ..DeviceState::default() })),
        ("state_1_0", 3, Message::State(DeviceState { epoch: None, ..state })),
        ("state_least", 4, Message::State(least)),
        ("state_most", 255, Message::State(most)),
    ]
}

fn events() -> Vec<Named> {
    let event = |kind, counter, code, value| {
        Message::Event(DeviceEvent { kind, counter, code, feel_id: 17, t_us: 7_654_321, value })
    };
    vec![
        ("event_slap", 5, event(EventKind::Slap, 1, 0, 23.5)),
        ("event_button", 6, event(EventKind::Button, 2, 0, 1.0)),
        ("event_limit", 7, event(EventKind::Limit, 3, 0, 512.25)),
        ("event_fault", 8, event(EventKind::Fault, 4, 2, 61.5)),
        ("event_refused", 9, event(EventKind::Refused, 255, 6, f32::MIN)),
        ("event_disarmed", 10, event(EventKind::Disarmed, 0, 1, 0.0)),
        ("event_code_of_a_later_version", 11, event(EventKind::Refused, 1, 200, f32::MIN_POSITIVE)),
    ]
}
