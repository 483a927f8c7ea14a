//! When torque is allowed, and how it is taken away.
//!
//! ARM follows an act of the user and nothing else. It is said again while it shows no effect, for 200 ms: that is still
//! the same act. All tries answer the epoch of the first: a knob that counts a disarming in between, or reports one, has been
//! told to let go after the user's act, so the act is over. Once the knob has been armed and no longer is, for whatever reason,
//! a new act is needed. A knob that is armed while nobody wants it so is told FREE until it is not.

use super::{INSIST_US, TRIES};
use crate::wire::Info;
pub use crate::wire::limits::HARD_CEILING_MNM;

/// Ceiling a host begins with, mNm. By judgement: well felt, and no hand is held by it.
pub const FIRST_CEILING_MNM: u16 = 100;
/// Most that is offered without a further act, mNm. By judgement.
pub const OFFERED_CEILING_MNM: u16 = 250;

/// ARM that sets another ceiling of an armed knob. Nothing tells whether it has come, and ALIVE does not raise the ceiling.
const CEILING_TRIES: u32 = 2;

/// What is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmingMessage {
    /// Send ARM.
    Arm,
    /// Send FREE.
    Free,
}

/// How an act of the user has ended by the knob's doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmingEnd {
    /// The knob was armed and has disarmed by itself.
    Disarmed,
    /// The knob has counted a disarming after the first ARM, before it was seen armed.
    Overtaken,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Goal {
    Free,
    /// Told to arm; not seen armed yet.
    Arming {
        tries: u32,
        /// The knob's epoch at the first try; `None` before it, and from a knob that counts none.
        epoch: Option<u16>,
    },
    Armed,
}

/// See the module.
#[derive(Debug)]
pub struct Arming {
    want: Goal,
    ceiling_mnm: u16,
    next_us: i64,
    say_free: bool,
    is_armed: bool,
    /// ARM still due to set another ceiling of an armed knob.
    ceiling_tries: u32,
    /// All tries of an act have had their time, and the knob has not answered.
    is_ignored: bool,
}

impl Default for Arming {
    fn default() -> Self {
        Self {
            want: Goal::Free,
            ceiling_mnm: FIRST_CEILING_MNM,
            next_us: i64::MIN,
            say_free: false,
            is_armed: false,
            ceiling_tries: 0,
            is_ignored: false,
        }
    }
}

impl Arming {
    /// What ARM and ALIVE carry, mNm.
    pub fn ceiling_mnm(&self) -> u16 {
        self.ceiling_mnm
    }

    /// True while the knob is armed and shall be.
    pub fn is_armed(&self) -> bool {
        self.is_armed && self.want == Goal::Armed
    }

    /// True while the user wants torque, whether or not it has come yet.
    pub fn is_wanted(&self) -> bool {
        self.want != Goal::Free
    }

    /// True once after an act that the knob has not answered at all.
    pub fn take_ignored(&mut self) -> bool {
        std::mem::take(&mut self.is_ignored)
    }

    /// The user allows torque. Above [`OFFERED_CEILING_MNM`] only with a `further_act`; the least limit wins, last of all.
    pub fn arm(&mut self, ceiling_mnm: u16, further_act: bool, info: &Info, now_us: i64) {
        let offered = if further_act { HARD_CEILING_MNM } else { OFFERED_CEILING_MNM };
        self.ceiling_mnm = ceiling_mnm.min(offered).min(info.most_mnm()).min(HARD_CEILING_MNM);
        if self.is_armed() {
            self.ceiling_tries = CEILING_TRIES;
        } else {
            self.want = Goal::Arming { tries: 0, epoch: None };
        }
        self.next_us = now_us;
        self.say_free = false;
    }

    /// Lowers the ceiling; never raises it.
    pub fn lower(&mut self, ceiling_mnm: u16) {
        self.ceiling_mnm = self.ceiling_mnm.min(ceiling_mnm);
    }

    /// The user, or whoever runs this, wants no torque.
    pub fn disarm(&mut self, now_us: i64) {
        (self.want, self.ceiling_tries) = (Goal::Free, 0);
        self.say_free = true;
        self.next_us = now_us;
    }

    /// The knob is gone, or has refused: nothing to say, and a new act needed.
    pub fn forget(&mut self) {
        (self.want, self.ceiling_tries) = (Goal::Free, 0);
        self.is_armed = false;
    }

    /// True while the user's act has not been seen to arm the knob.
    pub fn is_arming(&self) -> bool {
        matches!(self.want, Goal::Arming { .. })
    }

    /// The knob reports that it has let go, or cannot be armed: the act of the user is over. True if there was one.
    pub fn give_up(&mut self) -> bool {
        let is_arming = self.is_arming();
        if is_arming {
            (self.want, self.ceiling_tries) = (Goal::Free, 0);
        }
        is_arming
    }

    /// Takes in what a STATE says: whether the knob is armed, whether it probes its signs before, and its epoch, if it counts
    /// one.
    pub fn hear(
        &mut self,
        is_armed: bool,
        is_probing: bool,
        epoch: Option<u16>,
        now_us: i64,
    ) -> Option<ArmingEnd> {
        // A probe that nobody wants any more is told FREE like torque.
        let makes_torque = is_armed || is_probing && self.want == Goal::Free;
        let was_armed = std::mem::replace(&mut self.is_armed, makes_torque);
        match self.want {
            Goal::Arming { epoch: first @ Some(_), .. } if epoch != first => {
                self.give_up();
                return Some(ArmingEnd::Overtaken);
            }
            Goal::Arming { .. } if is_armed => self.want = Goal::Armed,
            // ARM has arrived: it need not be said again. The knob says itself how the probe ends.
            Goal::Arming { epoch, .. } if is_probing => {
                self.want = Goal::Arming { tries: TRIES, epoch };
                self.next_us = now_us + INSIST_US;
            }
            Goal::Armed if was_armed && !is_armed => {
                (self.want, self.ceiling_tries) = (Goal::Free, 0);
                return Some(ArmingEnd::Disarmed);
            }
            _ => {}
        }
        None
    }

    /// What is due now, at the knob's epoch of the last STATE.
    pub fn poll(&mut self, now_us: i64, epoch: Option<u16>) -> Option<ArmingMessage> {
        if now_us < self.next_us {
            return None;
        }
        match self.want {
            Goal::Free if self.say_free || self.is_armed => {
                self.say_free = false;
                self.next_us = now_us + INSIST_US;
                Some(ArmingMessage::Free)
            }
            Goal::Arming { tries, epoch: first } if tries < TRIES => {
                let epoch = if tries == 0 { epoch } else { first };
                self.want = Goal::Arming { tries: tries + 1, epoch };
                self.next_us = now_us + INSIST_US;
                Some(ArmingMessage::Arm)
            }
            // All tries are through and the last has had its time.
            Goal::Arming { .. } => {
                self.want = Goal::Free;
                self.is_ignored = true;
                None
            }
            Goal::Armed if self.ceiling_tries > 0 => {
                self.ceiling_tries -= 1;
                self.next_us = now_us + INSIST_US;
                Some(ArmingMessage::Arm)
            }
            Goal::Free | Goal::Armed => None,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::wire::Capabilities;

    pub fn info(ceiling_mnm: u16) -> Info {
        Info {
            major: 1,
            minor: 1,
            capabilities: Capabilities(Capabilities::FLOW | Capabilities::CALIBRATED),
            firmware: (0, 1, 0),
            name: Info::name_bytes("TorqueTuner"),
            serial: 0xC1A2,
            counts_per_turn: 3600,
            loop_hz: 2000,
            watchdog_ms: 80,
            fade_ms: 50,
            ceiling_mnm,
            session: 7,
            stiffness_limit: 8000,
            push_limit: 500,
            counters: None,
        }
    }

    fn said(arming: &mut Arming, from_ms: i64, to_ms: i64) -> Vec<ArmingMessage> {
        (from_ms..to_ms).filter_map(|ms| arming.poll(ms * 1000, Some(5))).collect()
    }

    #[test]
    fn ceiling_is_the_least_of_all() {
        for (asked, further, device, allowed) in [
            (100, false, 450, 100),
            (900, false, 450, 250),
            (900, true, 450, 450),
            (900, true, 300, 300),
            (80, true, 60, 60),
        ] {
            let mut arming = Arming::default();
            arming.arm(asked, further, &info(device), 0);
            assert_eq!(arming.ceiling_mnm(), allowed, "asked {asked}, device {device}");
            arming.lower(50);
            arming.lower(400);
            assert_eq!(arming.ceiling_mnm(), 50);
        }
    }

    #[test]
    fn one_act_arms_once() {
        let mut arming = Arming::default();
        assert_eq!(said(&mut arming, 0, 100), []);
        arming.arm(100, false, &info(450), 100_000);
        assert_eq!(said(&mut arming, 100, 120), [ArmingMessage::Arm]);
        assert_eq!(arming.hear(true, false, Some(5), 0), None);
        assert!(arming.is_armed());
        assert_eq!(said(&mut arming, 120, 1000), []);
        assert_eq!(
            arming.hear(false, false, Some(6), 0),
            Some(ArmingEnd::Disarmed),
            "the knob disarmed by itself"
        );
        assert_eq!(said(&mut arming, 1000, 3000), [], "and stays so");
    }

    #[test]
    fn another_ceiling_of_an_armed_knob_is_said_twice_and_only_while_it_is_armed() {
        let mut arming = Arming::default();
        arming.arm(100, false, &info(450), 0);
        assert_eq!(said(&mut arming, 0, 10), [ArmingMessage::Arm]);
        arming.hear(true, false, Some(5), 10_000);
        arming.arm(200, false, &info(450), 100_000);
        assert!(arming.is_armed());
        assert_eq!(said(&mut arming, 100, 1000), [ArmingMessage::Arm; 2]);
        arming.arm(150, false, &info(450), 1_000_000);
        assert_eq!(said(&mut arming, 1000, 1020), [ArmingMessage::Arm]);
        assert_eq!(arming.hear(false, false, Some(6), 1_020_000), Some(ArmingEnd::Disarmed));
        assert_eq!(said(&mut arming, 1020, 2000), [], "it has let go by itself");
    }

    #[test]
    fn an_act_without_effect_ends() {
        let mut arming = Arming::default();
        arming.arm(100, false, &info(450), 0);
        assert_eq!(said(&mut arming, 0, 3000), [ArmingMessage::Arm; 4]);
        arming.hear(true, false, Some(5), 0);
        assert_eq!(
            said(&mut arming, 3000, 3001),
            [ArmingMessage::Free],
            "too late: nobody wants it any more"
        );
    }

    #[test]
    fn an_armed_knob_nobody_wants_is_freed_until_it_is() {
        let mut arming = Arming::default();
        arming.hear(true, false, Some(5), 0);
        assert_eq!(said(&mut arming, 0, 200), [ArmingMessage::Free; 4]);
        arming.hear(false, false, Some(5), 0);
        assert_eq!(said(&mut arming, 200, 400), []);
        arming.disarm(400_000);
        assert_eq!(said(&mut arming, 400, 600), [ArmingMessage::Free], "said even if the knob seems free");
    }

    #[test]
    fn a_knob_that_still_probes_is_freed_until_it_ends_where_nobody_wants_it_any_more() {
        let mut arming = Arming::default();
        arming.arm(100, false, &info(450), 0);
        assert_eq!(said(&mut arming, 0, 10), [ArmingMessage::Arm]);
        assert_eq!(arming.hear(false, true, Some(5), 10_000), None);
        arming.disarm(20_000);
        for ms in [20, 70, 120] {
            // The FREE before was lost.
            assert_eq!(arming.hear(false, true, Some(5), 1_000 * ms), None);
            assert_eq!(said(&mut arming, ms, ms + 50), [ArmingMessage::Free], "{ms}");
        }
        assert_eq!(arming.hear(false, false, Some(6), 170_000), None);
        assert_eq!(said(&mut arming, 170, 400), []);
    }

    #[test]
    fn a_disarming_between_two_tries_ends_the_act() {
        let mut arming = Arming::default();
        arming.arm(100, false, &info(450), 0);
        assert_eq!(said(&mut arming, 0, 40), [ArmingMessage::Arm]);
        assert_eq!(arming.hear(false, false, Some(5), 40_000), None);
        // The first ARM had arrived, and the user has pressed the knob's own button since; the STATE between them is lost.
        assert_eq!(arming.hear(false, false, Some(6), 45_000), Some(ArmingEnd::Overtaken));
        assert_eq!(said(&mut arming, 45, 3000), []);
        assert!(!arming.is_wanted() && !arming.take_ignored(), "the knob has answered");
    }

    #[test]
    fn a_probe_that_ends_in_a_disarming_raises_no_doubt() {
        for tells_epoch in [true, false] {
            let mut arming = Arming::default();
            arming.arm(100, false, &info(450), 0);
            assert_eq!(said(&mut arming, 0, 10), [ArmingMessage::Arm]);
            assert_eq!(arming.hear(false, true, Some(5), 10_000), None);
            if tells_epoch {
                assert_eq!(arming.hear(false, false, Some(6), 20_000), Some(ArmingEnd::Overtaken));
            } else {
                assert!(arming.give_up());
            }
            assert_eq!(said(&mut arming, 20, 3000), []);
            assert!(!arming.take_ignored());
        }
        assert!(!Arming::default().give_up());
    }
}
