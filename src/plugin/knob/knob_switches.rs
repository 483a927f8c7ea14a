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
/// The same after the knob was disarmed, or a press was refused: a second press at once wants no torque.
const ARM_AFTER_STOP: Duration = Duration::from_secs(1);
/// How long a knob may take to arm. The link repeats the message for 0.2 s (`device/session/arming.rs`).
const ARM_WITHIN: Duration = Duration::from_secs(2);

/// The switches as they were last seen, and what arming needs to know.
#[derive(Default)]
pub struct KnobSwitches {
    before: Positions,
    /// From when on *Arm*, which is off beside a live knob, arms it.
    due: Option<Instant>,
    /// Before this moment it does not.
    not_before: Option<Instant>,
    /// When the knob was told to arm.
    asked: Option<Instant>,
    was_armed: bool,
    /// The user has been told that the knob stands away from a zero that nobody has set.
    is_warned: bool,
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
        let is_pressed = moments.take(Moment::Arm);
        // Whatever the knob does: one that is arming must not make more either.
        if now.ceiling_mnm < before.ceiling_mnm {
            link.lower_ceiling(now.ceiling_mnm);
        }
        self.apply_arm(is_pressed, now, before, status, link, calibrator);
        moments.set_possible(Moment::Arm, self.may_arm(status));
        if now.feel_port != before.feel_port {
            let port = now.feel_port;
            link.feel_osc((port > 0).then(|| SocketAddr::from((Ipv4Addr::LOCALHOST, port))));
        }
        if self.was_armed && !status.armed {
            self.wait_after_stop();
            if now.arm {
                self.set_hint("disarmed: press ARM again".to_owned());
            }
        }
        self.was_armed = status.armed;
        if moments.take(Moment::TakeOver) {
            link.take_over();
        }
        if moments.take(Moment::Rest) {
            if status.armed || status.arming || self.asked.is_some() {
                self.set_hint("Rest here: press STOP first".to_owned());
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
        let now = Instant::now();
        self.due.is_some_and(|due| now >= due) && self.not_before.is_none_or(|moment| now >= moment)
    }

    /// The knob was disarmed, or a press was refused.
    fn wait_after_stop(&mut self) {
        self.not_before = Some(Instant::now() + ARM_AFTER_STOP);
    }

    fn apply_arm(
        &mut self,
        is_pressed: bool,
        now: Positions,
        before: Positions,
        status: &LinkStatus,
        link: &KnobLink,
        calibrator: &Calibrator,
    ) {
        // A connection that is new, and a zero that was set, are asked about anew.
        self.is_warned &= is_live(status) && status.stray_deg.is_some();
        if status.armed || !is_live(status) {
            self.asked = None;
        } else if self.asked.is_some_and(|asked| asked.elapsed() > ARM_WITHIN) {
            self.asked = None;
            self.set_hint("the knob did not arm: press ARM again".to_owned());
        }
        if !is_live(status) {
            self.due = None;
        } else if !now.arm {
            self.due.get_or_insert_with(|| Instant::now() + ARM_AFTER);
        }
        if is_pressed && before.arm {
            // Off and on again since the last look.
            link.disarm();
            self.asked = None;
            self.wait_after_stop();
        } else if is_pressed && now.arm && self.is_due() {
            self.due = None;
            if calibrator.is_busy() {
                self.set_hint("not armed: wait until the knob is calibrated, then press ARM".to_owned());
            } else if let Some(stray_deg) = status.stray_deg.filter(|_| !self.is_warned) {
                self.is_warned = true;
                self.set_hint(format!(
                    "not armed: the knob stands {stray_deg:.0} degrees from its zero, and may turn back there by itself. Let \
                     go of it and press Rest here, or press ARM again"
                ));
            } else {
                link.arm(now.ceiling_mnm);
                self.asked = Some(Instant::now());
                self.hint = None;
            }
        } else if is_pressed {
            self.wait_after_stop();
            self.set_hint("not armed: wait a second, then press ARM".to_owned());
        } else if !now.arm && before.arm {
            link.disarm();
            self.asked = None;
            self.wait_after_stop();
            if status.armed {
                self.hint = None;
            }
        } else if status.armed && now.ceiling_mnm > before.ceiling_mnm {
            self.set_hint("to allow more torque, press STOP, then ARM".to_owned());
        }
    }
}

/// Whether a knob sends angles.
pub fn is_live(status: &LinkStatus) -> bool {
    matches!(status.phase, Phase::Live | Phase::ReadOnly)
}

#[cfg(all(test, feature = "simulator"))]
mod tests {
    use super::*;
    use crate::plugin::params::ChalumeauParams;
    use chalumeau_firmware::{Firmware, Reading, Setup};
    use chalumeau_knob::device::Hooks;
    use chalumeau_knob::device::memory::{MemoryPort, pair};
    use chalumeau_knob::device::transport::{Binding, Transport};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
    use std::thread;

    /// The firmware at the other end of a link, in real time, and a shaft that nothing but the test turns.
    struct Desk {
        params: ChalumeauParams,
        link: KnobLink,
        switches: KnobSwitches,
        calibrator: Calibrator,
        counts: Arc<AtomicI64>,
        stop: Arc<AtomicBool>,
        knob: Option<thread::JoinHandle<()>>,
    }

    fn live(mut port: MemoryPort, setup: &Setup, counts: &AtomicI64, stop: &AtomicBool) {
        let (mut firmware, born, mut ticks, mut at) = (Firmware::new(setup), Instant::now(), 0, 0);
        while !stop.load(Ordering::Relaxed) {
            let _ = port.poll(Duration::from_millis(1), &mut |bytes| firmware.receive(bytes));
            while 500 * ticks <= born.elapsed().as_micros() as u64 {
                at += (counts.load(Ordering::Relaxed) - at).clamp(-10, 10);
                let reading = Reading { counts: at, tells_velocity: false, ..Reading::default() };
                firmware.tick(500 * ticks, &reading);
                ticks += 1;
            }
            let mut bytes = [0; 1024];
            let length = firmware.transmit(&mut bytes);
            let _ = port.send(&bytes[..length]);
        }
    }

    impl Desk {
        fn new() -> Self {
            let (link, _reader) = KnobLink::spawn("test", Hooks::default());
            let (ours, theirs) = pair(Binding::Serial, "a wire");
            let (counts, stop) = (Arc::new(AtomicI64::new(0)), Arc::new(AtomicBool::new(false)));
            let (turned, stopped) = (counts.clone(), stop.clone());
            // Each desk has a knob of its own: only one host may have one.
            static DESKS: AtomicU64 = AtomicU64::new(0x00DE_5C00);
            let setup = Setup { serial: DESKS.fetch_add(1, Ordering::Relaxed), ..Setup::default() };
            let knob = thread::spawn(move || live(theirs, &setup, &turned, &stopped));
            link.attach(Box::new(ours));
            let mut desk = Self {
                params: ChalumeauParams::default(),
                link,
                switches: KnobSwitches::default(),
                calibrator: Calibrator::new(),
                counts,
                stop,
                knob: Some(knob),
            };
            desk.until("live", |desk| desk.link.status().phase == Phase::Live);
            desk.until("due", |desk| desk.switches.is_due());
            desk
        }

        /// One cycle of the controller.
        fn cycle(&mut self) {
            let status = self.link.status();
            let Self { params, link, switches, calibrator, .. } = self;
            switches.apply(&params.moments, &params.knob, &status, link, calibrator);
            params.fall_back();
        }

        #[track_caller]
        fn until(&mut self, what: &str, holds: impl Fn(&mut Self) -> bool) {
            let begun = Instant::now();
            while !holds(self) {
                assert!(begun.elapsed() < Duration::from_secs(20), "{what}: {:?}", self.link.status());
                self.cycle();
                thread::sleep(Duration::from_millis(2));
            }
        }

        #[allow(unsafe_code)]
        fn set(&self, param: &impl nice_plug::params::InternalParamMut<Plain = f32>, value: f32) {
            // SAFETY: the setter stores atomics and calls a callback of this crate.
            unsafe { param._internal_set_plain_value(value) };
        }

        fn press_arm(&self) {
            self.switch_arm(true);
        }

        #[allow(unsafe_code)]
        fn switch_arm(&self, on: bool) {
            // SAFETY: as above.
            unsafe {
                nice_plug::params::InternalParamMut::_internal_set_plain_value(&self.params.knob.arm, on)
            };
        }

        fn hint(&self) -> String {
            self.switches.hint().cloned().unwrap_or_default()
        }
    }

    impl Drop for Desk {
        fn drop(&mut self) {
            self.stop.store(true, Ordering::Relaxed);
            if let Some(knob) = self.knob.take() {
                let _ = knob.join();
            }
        }
    }

    #[test]
    fn a_ceiling_that_is_lowered_while_the_knob_is_arming_holds() {
        let mut desk = Desk::new();
        let heart = desk.link.heartbeat("the test");
        desk.set(&desk.params.knob.ceiling, 100.0);
        desk.cycle();
        desk.press_arm();
        desk.cycle();
        desk.set(&desk.params.knob.ceiling, 60.0);
        assert!(!desk.link.status().armed, "it is not armed yet");
        desk.cycle();
        heart.beat();
        desk.until("the lower ceiling", |desk| desk.link.status().ceiling_mnm == 60);
    }

    #[test]
    fn a_second_press_at_once_after_a_stop_arms_nothing() {
        let mut desk = Desk::new();
        let heart = desk.link.heartbeat("the test");
        heart.beat();
        // The switch learns that it may be on.
        desk.cycle();
        desk.switch_arm(true);
        desk.cycle();
        assert!(desk.switches.asked.is_some(), "{}", desk.hint());
        desk.switch_arm(false);
        desk.cycle();
        let stopped = Instant::now();
        // The guard against loading is over, that after a stop is not.
        while stopped.elapsed() < ARM_AFTER + Duration::from_millis(50) {
            desk.cycle();
            thread::sleep(Duration::from_millis(2));
        }
        desk.switch_arm(true);
        desk.cycle();
        if stopped.elapsed() < ARM_AFTER_STOP {
            assert!(desk.hint().contains("wait a second"), "{}", desk.hint());
            assert!(desk.switches.asked.is_none());
        }
        // That press counts as another.
        let refused = Instant::now();
        desk.until("due", |desk| desk.switches.is_due());
        assert!(refused.elapsed() > Duration::from_millis(900), "{:?}", refused.elapsed());
    }

    #[test]
    fn arming_away_from_an_unknown_zero_is_asked_about_once_and_refused_during_a_calibration() {
        let mut desk = Desk::new();
        desk.counts.store(900, Ordering::Relaxed);
        desk.until("stray", |desk| desk.link.status().stray_deg.is_some_and(|deg| deg > 80.0));
        desk.press_arm();
        desk.cycle();
        assert!(desk.hint().contains("degrees from its zero"), "{}", desk.hint());
        assert!(!desk.link.status().arming);
        desk.calibrator.rest();
        desk.until("due", |desk| desk.switches.is_due());
        desk.press_arm();
        desk.cycle();
        assert!(desk.hint().contains("calibrated"), "{}", desk.hint());
        desk.calibrator = Calibrator::new();
        desk.until("due", |desk| desk.switches.is_due());
        let heart = desk.link.heartbeat("the test");
        desk.press_arm();
        desk.cycle();
        desk.until("asked", |desk| {
            heart.beat();
            let status = desk.link.status();
            status.arming || status.armed || status.last_refusal.is_some()
        });
        assert_eq!(desk.hint(), "");
    }
}
