//! The messages of TTLink 1 as values. Offsets, units and ranges: `docs/protocol.md`.

/// Which torque law the knob follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Law {
    /// No torque but friction and damping.
    #[default]
    Free = 0,
    /// The seed's flow: rises to the threshold, falls to nothing at closure.
    Flow = 1,
    /// A spring with a step at the threshold: easy to hold.
    Pressure = 2,
}

/// The whole state of the feel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feel {
    /// Echoed by STATE once accepted.
    pub feel_id: u8,
    /// Torque law.
    pub law: Law,
    /// Time in which the old torque gives way to the new, ms, 20..=1000.
    pub morph_ms: u16,
    /// The seed's H, rest opening, 0.5..=10.
    pub h: f32,
    /// The seed's k, stiffness, 0.01..=20.
    pub k: f32,
    /// Torque per unit of flow (flow law) or at closure (pressure law), mNm, 0..=450.
    pub scale_mnm: f32,
    /// Closure of H k = 1 lies at 360 / stretch degrees; 0.1..=30.
    pub stretch: f32,
    /// Where the law's origin lies, degrees, -360..=360.
    pub offset_deg: f32,
    /// Felt threshold, degrees, 0..=3600.
    pub a_on_deg: f32,
    /// Felt extinction, degrees, 0..=36000.
    pub a_off_deg: f32,
    /// Where the reed begins to beat, degrees, 0..=3600.
    pub a_beat_deg: f32,
    /// End wall, degrees, 10..=36000.
    pub wall_deg: f32,
    /// Stiffness of the end wall, mNm per degree, 0..=100.
    pub wall_mnm_per_deg: f32,
    /// Spring of the slap region below -100 degrees, mNm per degree, 0..=20.
    pub slap_mnm_per_deg: f32,
    /// Damping on top of the knob's own, mNm s/rad, 0..=20.
    pub damping_mnms: f32,
    /// Smooth Coulomb friction, 0.1 mNm, 0..=1000.
    pub friction: u16,
    /// Height of the mark at `a_on` (flow) or of the step there (pressure), 0.1 mNm, 0..=1000.
    pub detent: u16,
}

/// ARM and ALIVE.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arm {
    /// Session of HELLO.
    pub session: u32,
    /// Most torque the user allows, mNm, 0..=450.
    pub ceiling_mnm: u16,
}

/// What a device can do, see INFO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capabilities(pub u16);

/// What a device says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Info {
    /// Version of the protocol.
    pub major: u8,
    /// Version of the protocol.
    pub minor: u8,
    /// What it can do.
    pub capabilities: Capabilities,
    /// Version of the firmware: major, minor, patch.
    pub firmware: (u8, u8, u16),
    /// UTF-8, padded with zeros.
    pub name: [u8; 16],
    /// Identity of the device, never 0.
    pub serial: u64,
    /// Counts per turn of its encoder.
    pub counts_per_turn: u32,
    /// Rate of the haptic loop, Hz.
    pub loop_hz: u16,
    /// Silence after which torque begins to fade, ms.
    pub watchdog_ms: u16,
    /// Length of the fade, ms.
    pub fade_ms: u16,
    /// Most torque it will ever make, mNm.
    pub ceiling_mnm: u16,
    /// Session of the HELLO answered.
    pub session: u32,
    /// Steepest restoring slope it accepts, 0.001 N m/rad.
    pub stiffness_limit: u16,
    /// Steepest positive-feedback slope it accepts, 0.001 N m/rad.
    pub push_limit: u16,
}

/// Flags of STATE.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u16);

/// Where the knob is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Device clock, microseconds; wraps.
    pub t_us: u32,
    /// 0.01 degrees since zero.
    pub angle: i32,
    /// 0.1 rpm.
    pub velocity: i16,
    /// Command after all limits, mNm.
    pub torque: i16,
    /// See [`Flags`].
    pub flags: Flags,
    /// Last FEEL accepted.
    pub feel_id: u8,
    /// Counter of slaps.
    pub slaps: u8,
    /// Counter of the last EVENT.
    pub events: u8,
    /// Standing fault, 0 none.
    pub fault: u8,
}

/// Kinds of EVENT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum EventKind {
    /// The knob went through the slap region; value: peak speed, rad/s.
    Slap = 1,
    /// Value: 1 down, 0 up.
    Button = 2,
    /// Torque was limited; value: torque wanted, mNm.
    Limit = 3,
    /// A fault.
    Fault = 4,
    /// A request was refused; value: the number refused.
    Refused = 5,
    /// The knob disarmed.
    Disarmed = 6,
}

/// Something that happened on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// What.
    pub kind: EventKind,
    /// Counts events, so that a lost one shows.
    pub counter: u8,
    /// See the protocol.
    pub code: u8,
    /// Of the FEEL refused, else the one in force.
    pub feel_id: u8,
    /// Device clock, microseconds.
    pub t_us: u32,
    /// See [`EventKind`].
    pub value: f32,
}

/// A message of either direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message {
    /// The host has opened the line.
    Hello {
        /// Version of the protocol.
        major: u8,
        /// Version of the protocol.
        minor: u8,
        /// Chosen at random for this opening.
        session: u32,
    },
    /// The whole state of the feel.
    Feel(Feel),
    /// The user allows torque.
    Arm(Arm),
    /// The host is there.
    Alive(Arm),
    /// Torque off.
    Free,
    /// What the present position shall be called, 0.01 degrees.
    Zero(i32),
    /// How often STATE comes, Hz.
    Rate(u16),
    /// The host leaves.
    Bye {
        /// Session of HELLO.
        session: u32,
    },
    /// Answer to HELLO.
    Info(Info),
    /// Where the knob is.
    State(State),
    /// Something happened.
    Event(Event),
}
