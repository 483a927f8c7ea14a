//! The switches that act at the moment they are switched on: *Arm*, *Take over*, *Rest here*, *Blow hard here*.
//!
//! See [`moment`](crate::plugin::params::moment): the commands are presses, and *Arm* stays on only where this module says
//! that it may: beside a live knob that is armed, or that would be armed by it.

use std::net::{Ipv4Addr, SocketAddr};
use std::time::{Duration, Instant};

use super::calibrator::Calibrator;
use super::feel_design::knob_design;
use crate::plugin::params::KnobParams;
use crate::plugin::params::moment::{Moment, Moments};
use chalumeau_knob::device::{KnobLink, LinkStatus, Phase};

/// How long *Arm* must have been off beside a live knob before switching it on arms. A project or a host that sets
/// switches while it loads is not an act of the user.
const ARM_AFTER: Duration = Duration::from_millis(500);
/// How long a knob may take to arm. The link repeats the message for 0.2 s (`device/session/arming.rs`).
const ARM_WITHIN: Duration = Duration::from_secs(2);

/// The switches as they were last seen, and what arming needs to know.
#[derive(Default)]
pub struct KnobSwitches {
    before: Positions,
    /// Since when *Arm* has been off beside a live knob.
    off_since: Option<Instant>,
    /// When the knob was told to arm.
    asked: Option<Instant>,
    was_armed: bool,
    /// What the user must do next.
    hint: Option<String>,
}

#[derive(Clone, Copy, Default)]
struct Positions {
    arm: bool,
    ceiling_mnm: u16,
    feel_port: u16,
}

impl KnobSwitches {
    /// What the user should know about the last action.
    pub fn hint(&self) -> Option<&String> {
        self.hint.as_ref()
    }

    /// Shows a text to the user instead of the last hint.
    pub fn set_hint(&mut self, text: String) {
        self.hint = Some(text);
    }

    /// Before the first knob nothing is possible: what was pressed is forgotten.
    pub fn without_knob(moments: &Moments) {
        moments.set_possible(Moment::Arm, false);
        for control in [Moment::Arm, Moment::TakeOver, Moment::Rest, Moment::Blow] {
            moments.take(control);
        }
    }

    /// Acts on every switch that has changed.
    pub fn apply(
        &mut self,
        moments: &Moments,
        knob: &KnobParams,
        status: &LinkStatus,
        link: &KnobLink,
        calibrator: &mut Calibrator,
    ) {
        let now = Positions {
            arm: knob.arm.value(),
            ceiling_mnm: knob.ceiling.value().round() as u16,
            feel_port: u16::try_from(knob.feel_port.value()).unwrap_or(0),
        };
        let before = std::mem::replace(&mut self.before, now);
        self.apply_arm(moments.take(Moment::Arm), now, before, status, link);
        moments.set_possible(Moment::Arm, self.may_arm(status));
        if now.feel_port != before.feel_port {
            let port = now.feel_port;
            link.feel_osc((port > 0).then(|| SocketAddr::from((Ipv4Addr::LOCALHOST, port))));
        }
        if self.was_armed && !status.armed && now.arm {
            self.set_hint("disarmed: switch Arm on again".to_owned());
        }
        self.was_armed = status.armed;
        if moments.take(Moment::TakeOver) {
            link.take_over();
        }
        if moments.take(Moment::Rest) {
            if status.armed {
                self.set_hint("Rest here: switch Arm off first".to_owned());
            } else {
                calibrator.rest();
            }
        }
        if moments.take(Moment::Blow) {
            calibrator.blow(&knob_design(knob));
        }
    }

    /// Whether *Arm* may be on: the knob is armed, has just been told to arm, or would be told now.
    fn may_arm(&self, status: &LinkStatus) -> bool {
        is_live(status) && (status.armed || self.asked.is_some() || self.is_due())
    }

    /// Whether *Arm* has been off for long enough.
    fn is_due(&self) -> bool {
        self.off_since.is_some_and(|since| since.elapsed() >= ARM_AFTER)
    }

    fn apply_arm(
        &mut self,
        is_pressed: bool,
        now: Positions,
        before: Positions,
        status: &LinkStatus,
        link: &KnobLink,
    ) {
        if status.armed || !is_live(status) {
            self.asked = None;
        } else if self.asked.is_some_and(|asked| asked.elapsed() > ARM_WITHIN) {
            self.asked = None;
            self.set_hint("the knob did not arm: switch Arm on again".to_owned());
        }
        if !is_live(status) {
            self.off_since = None;
        } else if !now.arm {
            self.off_since.get_or_insert_with(Instant::now);
        }
        if is_pressed && before.arm {
            // Off and on again since the last look.
            link.disarm();
        } else if is_pressed && now.arm && self.is_due() {
            link.arm(now.ceiling_mnm);
            (self.asked, self.off_since) = (Some(Instant::now()), None);
            self.hint = None;
        } else if is_pressed {
            self.set_hint("not armed: wait for the knob, then switch Arm on".to_owned());
        } else if !now.arm && before.arm {
            link.disarm();
            if status.armed {
                self.hint = None;
            }
        } else if status.armed && now.ceiling_mnm < before.ceiling_mnm {
            link.lower_ceiling(now.ceiling_mnm);
        } else if status.armed && now.ceiling_mnm > before.ceiling_mnm {
            self.set_hint("to allow more torque, switch Arm off and on again".to_owned());
        }
    }
}

/// Whether a knob sends angles.
pub fn is_live(status: &LinkStatus) -> bool {
    matches!(status.phase, Phase::Live | Phase::ReadOnly)
}
