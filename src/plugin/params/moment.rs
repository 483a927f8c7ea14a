//! Controls of the moment: switches that act when they are switched on, and are no state.
//!
//! *Panic*, *Take over knob*, *Rest here*, *Blow hard here* and *Calibrate microphone* are commands. Switching one on is remembered as a press until
//! the plugin carries it out; the switch itself is Off again at the end of the block. *Arm knob* and *Record take* stay on
//! as long as a knob makes that possible, and are otherwise Off again at once, as a command is. So a host that saves what it
//! reads and loads what it saved finds the same values.
//!
//! A press is an atomic flag, set where the host moves the switch and taken where it is carried out.

use std::sync::Arc;
#[cfg(feature = "devices")]
use std::sync::OnceLock;
#[cfg(feature = "devices")]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(feature = "devices")]
use chalumeau_knob::device::{Heartbeat, Release};
use nice_plug::params::InternalParamMut;
use nice_plug::prelude::*;

use super::ChalumeauParams;

/// One of the controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// *Panic*.
    Panic,
    /// *Take over knob*.
    TakeOver,
    /// *Rest here*.
    Rest,
    /// *Blow hard here*.
    Blow,
    /// *Arm knob*.
    Arm,
    /// *Record take*.
    Record,
    /// *Calibrate microphone*.
    Calibrate,
}

impl Moment {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Panic, Self::TakeOver, Self::Rest, Self::Blow, Self::Arm, Self::Record, Self::Calibrate];

    /// Its id in the table of parameters.
    pub const fn id(self) -> &'static str {
        match self {
            Self::Panic => "panic",
            Self::TakeOver => "takeov",
            Self::Rest => "rest",
            Self::Blow => "blow",
            Self::Arm => "arm",
            Self::Record => "rec",
            Self::Calibrate => "miccal",
        }
    }

    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// What has happened to the controls of one plugin instance. Real-time safe.
#[derive(Debug, Default)]
pub struct Moments {
    /// Switched on, and not carried out yet.
    pressed: AtomicU32,
    /// May stay on.
    possible: AtomicU32,
    /// Off again since the host was last told.
    fallen: AtomicU32,
    /// *Arm knob* was on when it was last moved.
    #[cfg(feature = "devices")]
    is_arm_on: AtomicBool,
    /// Takes the torque away, once there is a link to a knob.
    #[cfg(feature = "devices")]
    arm_heart: OnceLock<Heartbeat>,
}

impl Moments {
    /// The control was switched on.
    pub fn press(&self, control: Moment) {
        self.pressed.fetch_or(control.bit(), Ordering::AcqRel);
    }

    /// Who takes the torque away when *Arm knob* is switched off.
    #[cfg(feature = "devices")]
    pub fn set_arm_heart(&self, heart: Heartbeat) {
        let _ = self.arm_heart.set(heart);
    }

    /// Takes the torque of the knob away: the user ends the program. Waits for nothing.
    #[cfg(feature = "standalone")]
    pub fn interrupt(&self) {
        #[cfg(feature = "devices")]
        if let Some(heart) = self.arm_heart.get() {
            heart.let_go(Release::Interrupted);
        }
    }

    /// The control was moved. *Arm knob* lets go at once when it goes off, and waits for no other thread.
    fn moved(&self, control: Moment, is_on: bool) {
        if is_on {
            self.press(control);
        }
        #[cfg(feature = "devices")]
        if control == Moment::Arm
            && self.is_arm_on.swap(is_on, Ordering::AcqRel)
            && !is_on
            && let Some(heart) = self.arm_heart.get()
        {
            heart.let_go(Release::SwitchedOff);
        }
    }

    /// Whether the control was switched on since this was last asked. Whoever asks carries it out.
    pub fn take(&self, control: Moment) -> bool {
        self.pressed.fetch_and(!control.bit(), Ordering::AcqRel) & control.bit() != 0
    }

    /// Says whether the control may stay on: only *Arm knob* and *Record take* ever may.
    pub fn set_possible(&self, control: Moment, is_possible: bool) {
        if is_possible {
            self.possible.fetch_or(control.bit(), Ordering::AcqRel);
        } else {
            self.possible.fetch_and(!control.bit(), Ordering::AcqRel);
        }
    }

    /// The controls that are Off again since this was last asked.
    pub fn take_fallen(&self) -> impl Iterator<Item = Moment> {
        let fallen = self.fallen.swap(0, Ordering::AcqRel);
        Moment::ALL.into_iter().filter(move |control| fallen & control.bit() != 0)
    }
}

/// A switch of the table that is a control of the moment.
pub(super) fn switch(control: Moment, moments: &Arc<Moments>) -> BoolParam {
    let moments = moments.clone();
    super::entry::switch(control.id()).with_callback(Arc::new(move |on| moments.moved(control, on)))
}

impl ChalumeauParams {
    /// Puts the controls back to Off that may not stay on. Call it at the end of a block, and wherever else a host has
    /// moved parameters. Real-time safe.
    pub fn fall_back(&self) {
        let possible = self.moments.possible.load(Ordering::Acquire);
        for control in Moment::ALL {
            let switch = self.control(control);
            if switch.unmodulated_plain_value() && possible & control.bit() == 0 {
                set_off(switch);
                self.moments.fallen.fetch_or(control.bit(), Ordering::AcqRel);
            }
        }
    }

    fn control(&self, control: Moment) -> &BoolParam {
        match control {
            Moment::Panic => &self.output.panic,
            Moment::TakeOver => &self.knob.take_over,
            Moment::Rest => &self.knob.rest,
            Moment::Blow => &self.knob.blow,
            Moment::Arm => &self.knob.arm,
            Moment::Record => &self.knob.record,
            Moment::Calibrate => &self.microphone.calibrate,
        }
    }
}

#[allow(unsafe_code)] // the framework's setter
fn set_off(switch: &BoolParam) {
    // SAFETY: the setter stores atomics and calls the callback above. The framework keeps it for its wrappers because a
    // host would not be told; `take_fallen` is how the host is told.
    unsafe { switch._internal_set_plain_value(false) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters;

    #[allow(unsafe_code)]
    fn set_on(params: &ChalumeauParams, control: Moment) {
        // SAFETY: as above.
        unsafe { params.control(control)._internal_set_plain_value(true) };
    }

    fn is_on(params: &ChalumeauParams, control: Moment) -> bool {
        params.control(control).value()
    }

    #[test]
    fn each_falls_back_at_once_and_is_carried_out_once() {
        let params = ChalumeauParams::default();
        for control in Moment::ALL {
            assert!(!params.moments.take(control), "{control:?}");
            set_on(&params, control);
            assert!(is_on(&params, control));
            params.fall_back();
            assert!(!is_on(&params, control), "{control:?}");
            assert!(params.moments.take_fallen().eq([control]), "the host is told of {control:?}");
            assert!(params.moments.take(control) && !params.moments.take(control), "{control:?}");
            params.fall_back();
            assert_eq!(params.moments.take_fallen().count(), 0);
        }
    }

    #[test]
    fn what_is_possible_stays_on_until_it_is_not() {
        let params = ChalumeauParams::default();
        params.moments.set_possible(Moment::Arm, true);
        set_on(&params, Moment::Arm);
        set_on(&params, Moment::Record);
        params.fall_back();
        assert!(is_on(&params, Moment::Arm) && !is_on(&params, Moment::Record));
        params.moments.set_possible(Moment::Arm, false);
        params.fall_back();
        assert!(!is_on(&params, Moment::Arm));
        assert!(params.moments.take_fallen().eq([Moment::Arm, Moment::Record]));
    }

    #[cfg(feature = "devices")]
    #[test]
    fn arm_lets_go_at_the_moment_it_goes_off_and_only_then() {
        use chalumeau_knob::device::Heartbeats;
        use chalumeau_knob::device::heartbeat::Monitor;

        let params = ChalumeauParams::default();
        params.moments.set_possible(Moment::Arm, true);
        set_on(&params, Moment::Arm);
        set_off(params.control(Moment::Arm));
        let heartbeats = Heartbeats::default();
        let mut monitor = Monitor::new(heartbeats.clone());
        params.moments.set_arm_heart(heartbeats.register("the test"));
        let mut released = || monitor.look(0).released;
        assert_eq!(released(), None);
        for _ in 0..2 {
            set_off(params.control(Moment::Arm));
            assert_eq!(released(), None, "it was off");
            set_on(&params, Moment::Arm);
            assert_eq!(released(), None);
            set_off(params.control(Moment::Arm));
            assert_eq!(released(), Some(Release::SwitchedOff));
        }
        set_on(&params, Moment::Rest);
        params.fall_back();
        assert_eq!(released(), None, "another control");
    }

    #[test]
    fn a_saved_state_brings_none_of_them_back() {
        for control in Moment::ALL {
            let parameter = parameters::find(control.id()).unwrap();
            assert!(!parameter.is_restored && !parameter.is_undoable, "{}", control.id());
        }
    }
}
