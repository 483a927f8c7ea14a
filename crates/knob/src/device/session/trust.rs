//! What a host does not believe. A knob that contradicts itself or does not obey is let go, and people are told why.
//!
//! Pure bookkeeping: INFO and STATE go in, a [`Doubt`] comes out. Most doubts stand until the connection ends, because a
//! knob that has lied once cannot be asked whether it has stopped.

use crate::wire::limits::HARD_CEILING_MNM;
use crate::wire::{Capabilities, DeviceState, Flags, Info};
use std::fmt;

/// Longest time in which a knob may let go after this computer falls silent, ms: what a hand can bear.
pub const LETS_GO_MOST_MS: u32 = 500;
/// Shortest watchdog that ALIVE at 50 a second can feed, ms: two of them.
const WATCHDOG_LEAST_MS: u16 = 40;
/// Slowest haptic loop that is armed, Hz: below, its own limits of stiffness mean nothing.
const LOOP_LEAST_HZ: u16 = 1_000;
/// Stiffest slope that a knob can honestly accept, 0.001 N m/rad: 20 needs a damping of 0.02 N m s/rad at 2 kHz, ten times
/// that of any knob.
const STIFFNESS_MOST: u16 = 20_000;
/// Torque that a whole number of mNm and one lost ALIVE explain.
const TORQUE_SLACK_MNM: u16 = 1;
/// A lower ceiling has reached the knob by then, us.
const CEILING_US: i64 = 300_000;
/// FREE, or a fade, has had its effect by then, us: ten FREE.
const FREE_US: i64 = 500_000;
/// A clock that does not move for this long does not move at all, us.
const CLOCK_US: i64 = 200_000;
/// A probe of the signs has ended by then, us: five of the longest.
const PROBE_US: i64 = 2_000_000;
/// FEEL is echoed by then, us: ten of them.
const FEEL_US: i64 = 1_000_000;
/// Fastest motion of a knob, degrees a second (100 rad/s), and the way for which a lost STATE may stand, degrees.
const FASTEST_DEG_S: f64 = 5_730.0;
const FASTEST_SLACK_DEG: f64 = 30.0;
/// How long a jump after ZERO is the host's own, us.
const ZERO_US: i64 = 1_000_000;
/// Readings in a row at a new place before that place is believed, and how many such places a knob may have.
const SETTLED: u32 = 25;
const JUMPS_MOST: u32 = 3;
/// Window in which angle and speed are compared, us, and by how much they may differ: degrees, and a share.
const COMPARED_US: u32 = 250_000;
const COMPARED_DEG: f64 = 20.0;
const COMPARED_SHARE: f64 = 0.4;
/// Two STATE further apart say nothing of the way between them, us.
const GAP_US: u32 = 20_000;

/// Why a host does not trust a knob. As text: what the knob did, and what to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// INFO: watchdog and fade take too long together, ms.
    LetsGoLate(u32),
    /// INFO: a watchdog that no host can feed, ms.
    WatchdogTooShort(u16),
    /// INFO: no torque at all.
    NoCeiling,
    /// INFO: more torque than any knob may make, mNm.
    CeilingTooHigh(u16),
    /// INFO: no motor.
    NoMotor,
    /// INFO: its loop, Hz.
    LoopTooSlow(u16),
    /// INFO: an encoder without counts.
    NoEncoder,
    /// INFO: accepts any slope, 0.001 N m/rad.
    TooStiff(u16),
    /// INFO: another serial number than before.
    OtherKnob {
        /// Of the first INFO.
        before: u64,
        /// Of this one.
        now: u64,
    },
    /// STATE: a 1.1 device without an epoch.
    Undated,
    /// STATE: the epoch has not changed at a disarming.
    EpochStands,
    /// STATE: more torque than allowed, mNm.
    TorqueTooHigh {
        /// What the knob says.
        torque_mnm: i16,
        /// What it may.
        ceiling_mnm: u16,
    },
    /// STATE: torque without being armed, mNm.
    TorqueUnarmed(i16),
    /// STATE: armed though FREE was sent for half a second.
    DeafToFree,
    /// STATE: armed while a fault stands.
    ArmedWithFault,
    /// STATE: its clock stands still.
    ClockStands,
    /// STATE: angle and speed contradict each other, degrees over the window by angle and by speed.
    Contradiction {
        /// By the angle.
        angle_deg: f64,
        /// By the speed.
        speed_deg: f64,
    },
    /// STATE: the angle jumped, degrees.
    Jump(f64),
    /// STATE: the angle has jumped too often: no place is believed any more.
    Jumps(u32),
    /// ARM had no effect.
    DeafToArm,
    /// FEEL is not echoed.
    DeafToFeel,
}

impl Doubt {
    /// Whether it stands until the connection ends.
    fn is_final(self) -> bool {
        !matches!(self, Self::Jump(_) | Self::DeafToArm | Self::DeafToFeel)
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LetsGoLate(ms) => {
                write!(
                    f,
                    "the knob would hold its torque for {ms} ms after this computer falls silent, which is more than {LETS_GO_MOST_MS}"
                )
            }
            Self::WatchdogTooShort(ms) => {
                write!(f, "the knob's watchdog of {ms} ms is too short for any host")
            }
            Self::NoCeiling => {
                f.write_str("the knob declares a torque ceiling of 0 mNm, so that it cannot be felt")
            }
            Self::CeilingTooHigh(mnm) => {
                write!(
                    f,
                    "the knob declares a torque ceiling of {mnm} mNm, more than the {HARD_CEILING_MNM} that any knob may make"
                )
            }
            Self::NoMotor => f.write_str("the knob says that it has no motor"),
            Self::LoopTooSlow(hz) => {
                write!(f, "the knob's haptic loop runs at {hz} Hz, which is too slow to be stable")
            }
            Self::NoEncoder => f.write_str("the knob's encoder has 0 counts a turn"),
            Self::TooStiff(thousandths) => write!(
                f,
                "the knob claims to be stable at {:.1} N m/rad, which no knob is",
                1e-3 * f64::from(*thousandths)
            ),
            Self::OtherKnob { before, now } => {
                write!(f, "the knob's serial number changed from {before:016x} to {now:016x}")
            }
            Self::Undated => f.write_str("the knob speaks TTLink 1.1 but counts no disarmings"),
            Self::EpochStands => f.write_str("the knob disarmed and did not count it"),
            Self::TorqueTooHigh { torque_mnm, ceiling_mnm } => {
                write!(f, "the knob makes {torque_mnm} mNm, more than the {ceiling_mnm} that are allowed")
            }
            Self::TorqueUnarmed(mnm) => write!(f, "the knob makes {mnm} mNm without being armed"),
            Self::DeafToFree => {
                f.write_str("the knob stays armed though it is told to let go: switch off its supply")
            }
            Self::ArmedWithFault => f.write_str("the knob stays armed in spite of a fault"),
            Self::ClockStands => f.write_str("the knob's clock stands still"),
            Self::Contradiction { angle_deg, speed_deg } => write!(
                f,
                "the knob's angle changed by {angle_deg:.0} degrees and its speed says {speed_deg:.0}"
            ),
            Self::Jump(degrees) => write!(f, "the knob's angle jumped by {degrees:.0} degrees"),
            Self::Jumps(times) => {
                write!(f, "the knob's angle has jumped {times} times, so it does not blow any more")
            }
            Self::DeafToArm => f.write_str("the knob does not arm and gives no reason"),
            Self::DeafToFeel => f.write_str("the knob does not take over the feel that it is sent"),
        }
    }
}

/// What the session wants of the knob when a STATE arrives.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The user wants it armed.
    pub armed: bool,
    /// What ARM and ALIVE carry, mNm.
    pub ceiling_mnm: u16,
    /// When ZERO was sent last, us.
    pub zero_us: Option<i64>,
    /// How long FEEL has not been echoed, us.
    pub feel_unechoed_us: i64,
}

/// See the module.
#[derive(Debug, Default)]
pub struct Trust {
    /// The doubt that stands.
    doubt: Option<Doubt>,
    serial: Option<u64>,
    dates: bool,
    most_mnm: u16,
    /// Ceilings before the present one: the highest, and until when it counts.
    earlier: Option<(u16, i64)>,
    ceiling_mnm: u16,
    before: Option<DeviceState>,
    moved_us: i64,
    unwanted_us: Option<i64>,
    torque_us: Option<i64>,
    fault_us: Option<i64>,
    probing_us: Option<i64>,
    settling: u32,
    jumps: u32,
    compared: Compared,
}

/// The way over a window, by angle and by speed.
#[derive(Debug, Default)]
struct Compared {
    passed_us: u32,
    angle_deg: f64,
    speed_deg: f64,
}

impl Trust {
    /// The doubt that stands, the gravest first.
    pub fn doubt(&self) -> Option<Doubt> {
        self.doubt
    }

    /// Whether torque is out of the question until the connection ends.
    pub fn is_lost(&self) -> bool {
        self.doubt.is_some_and(Doubt::is_final)
    }

    /// Takes note of a doubt. True if it is new.
    pub fn doubts(&mut self, doubt: Doubt) -> bool {
        let is_new = match self.doubt {
            None => true,
            Some(known) => !known.is_final() && known != doubt,
        };
        if is_new {
            self.doubt = Some(doubt);
        }
        is_new
    }

    /// A new act of the user: doubts that are not final are forgotten.
    pub fn forgive(&mut self) {
        if !self.is_lost() {
            self.doubt = None;
        }
    }

    /// The device has started anew: what it did before proves nothing.
    pub fn restart(&mut self) {
        (self.before, self.unwanted_us, self.torque_us) = (None, None, None);
        (self.fault_us, self.probing_us) = (None, None);
        self.compared = Compared::default();
    }

    /// Looks at INFO.
    pub fn info(&mut self, info: &Info) -> Option<Doubt> {
        let before = *self.serial.get_or_insert(info.serial);
        (self.dates, self.most_mnm) = (info.checks_age(), info.most_mnm());
        let lets_go_ms = u32::from(info.watchdog_ms) + u32::from(info.fade_ms);
        if before != info.serial {
            Some(Doubt::OtherKnob { before, now: info.serial })
        } else if lets_go_ms > LETS_GO_MOST_MS {
            Some(Doubt::LetsGoLate(lets_go_ms))
        } else if info.watchdog_ms < WATCHDOG_LEAST_MS {
            Some(Doubt::WatchdogTooShort(info.watchdog_ms))
        } else if info.ceiling_mnm == 0 {
            Some(Doubt::NoCeiling)
        } else if info.ceiling_mnm > HARD_CEILING_MNM {
            Some(Doubt::CeilingTooHigh(info.ceiling_mnm))
        } else if !info.capabilities.has(Capabilities::MOTOR) {
            Some(Doubt::NoMotor)
        } else if info.loop_hz < LOOP_LEAST_HZ {
            Some(Doubt::LoopTooSlow(info.loop_hz))
        } else if info.counts_per_turn == 0 {
            Some(Doubt::NoEncoder)
        } else if info.stiffness_limit > STIFFNESS_MOST {
            Some(Doubt::TooStiff(info.stiffness_limit))
        } else {
            None
        }
    }

    /// Looks at a STATE; the doubt that it raises, and whether its angle can be played.
    pub fn state(&mut self, state: &DeviceState, expected: Expected, now_us: i64) -> (Option<Doubt>, bool) {
        let jump = self.jump(state, expected, now_us);
        let doubt = self.of_state(state, expected, now_us).or(jump);
        self.before = Some(*state);
        (doubt, self.settling == 0 && self.jumps <= JUMPS_MOST)
    }

    fn of_state(&mut self, state: &DeviceState, expected: Expected, now_us: i64) -> Option<Doubt> {
        let armed = state.flags.armed();
        let before = self.before;
        if self.dates && state.epoch.is_none() {
            return Some(Doubt::Undated);
        }
        if self.dates && before.is_some_and(|b| b.flags.armed() && !armed && b.epoch == state.epoch) {
            return Some(Doubt::EpochStands);
        }
        if before.is_none_or(|before| before.t_us != state.t_us) {
            self.moved_us = now_us;
        } else if now_us - self.moved_us > CLOCK_US {
            return Some(Doubt::ClockStands);
        }
        self.follow_ceiling(expected.ceiling_mnm, now_us);
        let ceiling_mnm = self.earlier.map_or(self.ceiling_mnm, |(mnm, _)| mnm.max(self.ceiling_mnm));
        let ceiling_mnm = ceiling_mnm.min(self.most_mnm);
        let acts = armed || state.flags.has(Flags::FADING) || state.flags.has(Flags::PROBING);
        if acts
            && expected.armed
            && state.torque.unsigned_abs() > ceiling_mnm.saturating_add(TORQUE_SLACK_MNM)
        {
            return Some(Doubt::TorqueTooHigh { torque_mnm: state.torque, ceiling_mnm });
        }
        // A fade is torque of a knob that is no longer armed, for a while.
        let is_torque = state.torque.unsigned_abs() > TORQUE_SLACK_MNM;
        if is_torque && !acts {
            return Some(Doubt::TorqueUnarmed(state.torque));
        }
        if lasts(&mut self.torque_us, is_torque && !armed, now_us, FREE_US) {
            return Some(Doubt::TorqueUnarmed(state.torque));
        }
        if lasts(&mut self.unwanted_us, armed && !expected.armed, now_us, FREE_US) {
            return Some(Doubt::DeafToFree);
        }
        if lasts(&mut self.fault_us, armed && state.flags.fault(), now_us, FREE_US) {
            return Some(Doubt::ArmedWithFault);
        }
        if lasts(&mut self.probing_us, state.flags.has(Flags::PROBING), now_us, PROBE_US) {
            return Some(Doubt::DeafToArm);
        }
        if expected.feel_unechoed_us > FEEL_US {
            return Some(Doubt::DeafToFeel);
        }
        if self.doubt == Some(Doubt::DeafToFeel) {
            self.doubt = None; // it has taken it over after all
        }
        None
    }

    /// A ceiling that was lowered counts for as long as ALIVE needs to tell the knob.
    fn follow_ceiling(&mut self, ceiling_mnm: u16, now_us: i64) {
        if ceiling_mnm < self.ceiling_mnm {
            let earlier = self.earlier.map_or(0, |(mnm, _)| mnm);
            self.earlier = Some((earlier.max(self.ceiling_mnm), now_us + CEILING_US));
        }
        self.ceiling_mnm = ceiling_mnm;
        self.earlier = self.earlier.filter(|&(_, until_us)| now_us < until_us);
    }

    /// A place that no motion leads to; and the way since the last STATE, by angle and by speed.
    fn jump(&mut self, state: &DeviceState, expected: Expected, now_us: i64) -> Option<Doubt> {
        let before = self.before?;
        let passed_us = state.t_us.wrapping_sub(before.t_us);
        let way_deg = state.angle_deg() - before.angle_deg();
        let longest_deg = FASTEST_SLACK_DEG + FASTEST_DEG_S * 1e-6 * f64::from(passed_us.min(1_000_000));
        let is_ours = expected.zero_us.is_some_and(|at| now_us - at < ZERO_US);
        if way_deg.abs() > longest_deg && !is_ours {
            self.settling = SETTLED;
            self.jumps = self.jumps.saturating_add(1);
            self.compared = Compared::default();
            let is_believed = self.jumps <= JUMPS_MOST;
            return Some(if is_believed { Doubt::Jump(way_deg) } else { Doubt::Jumps(self.jumps) });
        }
        self.settling = self.settling.saturating_sub(1);
        let compared = &mut self.compared;
        if passed_us > GAP_US || way_deg.abs() > longest_deg {
            *compared = Compared::default();
            return None;
        }
        compared.passed_us += passed_us;
        compared.angle_deg += way_deg;
        // 0.1 rpm are 0.6 degrees a second; the speed in the middle of the two.
        let speed_deg_s = 0.3 * (f64::from(state.velocity) + f64::from(before.velocity));
        compared.speed_deg += 1e-6 * f64::from(passed_us) * speed_deg_s;
        if compared.passed_us < COMPARED_US {
            return None;
        }
        let Compared { angle_deg, speed_deg, .. } = std::mem::take(compared);
        let slack_deg = COMPARED_DEG + COMPARED_SHARE * angle_deg.abs().max(speed_deg.abs());
        let apart = (angle_deg - speed_deg).abs() > slack_deg;
        apart.then_some(Doubt::Contradiction { angle_deg, speed_deg })
    }
}

/// Whether something has lasted for longer than `most_us`.
fn lasts(since_us: &mut Option<i64>, is_so: bool, now_us: i64, most_us: i64) -> bool {
    if !is_so {
        *since_us = None;
        return false;
    }
    now_us - *since_us.get_or_insert(now_us) > most_us
}
