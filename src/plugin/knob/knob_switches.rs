//! The switches that act at the moment they are switched on: *Arm*, *Take over*, *Rest here*, *Blow hard here*.

use std::net::{Ipv4Addr, SocketAddr};
use std::time::{Duration, Instant};

use super::calibrator::Calibrator;
use super::feel_design::knob_design;
use crate::plugin::params::KnobParams;
use chalumeau_knob::device::{KnobLink, LinkStatus, Phase};

/// How long *Arm* must have been off beside a live knob before switching it on arms. A project or a host that sets
/// switches while it loads is not an act of the user.
const ARM_AFTER: Duration = Duration::from_millis(500);

/// The switches as they were last seen, and what arming needs to know.
#[derive(Default)]
pub struct KnobSwitches {
    before: Positions,
    /// Since when *Arm* has been off beside a live knob.
    off_since: Option<Instant>,
    was_armed: bool,
    /// What the user must do next.
    hint: Option<String>,
}

#[derive(Clone, Copy, Default)]
struct Positions {
    arm: bool,
    take_over: bool,
    rest: bool,
    blow: bool,
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

    /// Acts on every switch that has changed.
    pub fn apply(
        &mut self,
        knob: &KnobParams,
        status: &LinkStatus,
        link: &KnobLink,
        calibrator: &mut Calibrator,
    ) {
        let now = Positions {
            arm: knob.arm.value(),
            take_over: knob.take_over.value(),
            rest: knob.rest.value(),
            blow: knob.blow.value(),
            ceiling_mnm: knob.ceiling.value().round() as u16,
            feel_port: u16::try_from(knob.feel_port.value()).unwrap_or(0),
        };
        let before = std::mem::replace(&mut self.before, now);
        self.apply_arm(now, before, status, link);
        if now.feel_port != before.feel_port {
            let port = now.feel_port;
            link.feel_osc((port > 0).then(|| SocketAddr::from((Ipv4Addr::LOCALHOST, port))));
        }
        if self.was_armed && !status.armed && now.arm {
            self.set_hint("disarmed: switch Arm off and on again".to_owned());
        }
        self.was_armed = status.armed;
        if now.take_over && !before.take_over {
            link.take_over();
        }
        if now.rest && !before.rest {
            if status.armed {
                self.set_hint("Rest here: switch Arm off first".to_owned());
            } else {
                calibrator.rest();
            }
        }
        if now.blow && !before.blow {
            calibrator.blow(&knob_design(knob));
        }
    }

    fn apply_arm(&mut self, now: Positions, before: Positions, status: &LinkStatus, link: &KnobLink) {
        if !is_live(status) {
            self.off_since = None;
        } else if !now.arm {
            self.off_since.get_or_insert_with(Instant::now);
        }
        if now.arm && !before.arm {
            if self.off_since.is_some_and(|since| since.elapsed() >= ARM_AFTER) {
                link.arm(now.ceiling_mnm);
                self.hint = None;
            } else {
                self.set_hint("not armed: switch Arm off, wait for the knob, then switch Arm on".to_owned());
            }
            self.off_since = None;
        } else if !now.arm && before.arm {
            link.disarm();
            self.hint = None;
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
