//! The host's list of output events, as the framework gets it.
//!
//! The framework writes values of stepped parameters a little beside the whole number, and parameter events of a block's
//! start after other events of later samples. On their way to the host, values become whole and times never go back.

use std::collections::HashMap;
use std::ffi::c_void;

use clap_sys::events::{
    CLAP_CORE_EVENT_SPACE_ID, CLAP_EVENT_IS_LIVE, CLAP_EVENT_PARAM_VALUE, clap_event_header,
    clap_event_param_value, clap_output_events,
};
use clap_sys::id::clap_id;

use super::instance::Entry;
use crate::plugin::params::ChalumeauParams;

/// The list of one call. Real-time safe.
pub struct OutEvents<'a> {
    host: *const clap_output_events,
    entries: &'a HashMap<clap_id, Entry>,
    /// Time of the latest event.
    latest: u32,
    /// Time of the block's last sample.
    last: u32,
    list: clap_output_events,
}

impl<'a> OutEvents<'a> {
    /// # Safety
    /// `host` is null or valid as long as this is used.
    pub unsafe fn new(
        host: *const clap_output_events,
        entries: &'a HashMap<clap_id, Entry>,
        last: u32,
    ) -> Self {
        let list = clap_output_events { ctx: std::ptr::null_mut(), try_push: Some(try_push) };
        Self { host, entries, latest: 0, last, list }
    }

    /// The list for the framework, valid until this moves; null if the host has none.
    pub fn as_host(&mut self) -> *const clap_output_events {
        if self.host.is_null() {
            return std::ptr::null();
        }
        let this = &raw mut *self;
        // SAFETY: `this` is `self`; both pointers come from it, so that either may be used.
        unsafe {
            (*this).list.ctx = this.cast::<c_void>();
            &raw const (*this).list
        }
    }

    /// Tells the host of the controls that are Off again.
    pub fn push_off(&mut self, params: &ChalumeauParams, at: u32) {
        for control in params.moments.take_fallen() {
            let Some((&param_id, _)) =
                self.entries.iter().find(|(_, entry)| entry.parameter.id == control.id())
            else {
                continue;
            };
            let header = header::<clap_event_param_value>(CLAP_EVENT_PARAM_VALUE, at);
            let (note_id, port_index, channel, key) = (-1, -1, -1, -1);
            let cookie = std::ptr::null_mut();
            let event = clap_event_param_value {
                header,
                param_id,
                cookie,
                note_id,
                port_index,
                channel,
                key,
                value: 0.0,
            };
            // SAFETY: the event is whole.
            let _ = unsafe { self.push((&raw const event).cast()) };
        }
    }

    /// # Safety
    /// `event` is null or a whole event of the type that its header names.
    unsafe fn push(&mut self, event: *const clap_event_header) -> bool {
        // SAFETY: `host` is valid while this is used.
        let Some(try_push) = (unsafe { self.host.as_ref() }).and_then(|host| host.try_push) else {
            return false;
        };
        // SAFETY: as above.
        let Some(header) = (unsafe { event.as_ref() }) else { return false };
        let size = header.size as usize;
        if size > size_of::<Copied>() || size < size_of::<clap_event_header>() {
            // SAFETY: as above.
            return unsafe { try_push(self.host, event) };
        }
        let mut copied: Copied = [0; 16];
        let copy = copied.as_mut_ptr();
        // SAFETY: `size` bytes are the whole event, and `copied` has room for them.
        unsafe { event.cast::<u8>().copy_to_nonoverlapping(copy.cast(), size) };
        let copy = copy.cast::<clap_event_header>();
        self.latest = self.latest.max(header.time.min(self.last));
        // SAFETY: every event begins with a header, and a parameter's value is of the type that the header names.
        unsafe {
            (*copy).time = self.latest;
            if (header.space_id, header.type_) == (CLAP_CORE_EVENT_SPACE_ID, CLAP_EVENT_PARAM_VALUE) {
                let moved = copy.cast::<clap_event_param_value>();
                if self.entries.get(&(*moved).param_id).is_some_and(|entry| entry.steps.is_some()) {
                    (*moved).value = (*moved).value.round();
                }
            }
            try_push(self.host, copy)
        }
    }
}

/// Room for a copy of any event that the plugin sends: the largest, a parameter's value, has 56 bytes.
type Copied = [u64; 16];

fn header<T>(type_: u16, time: u32) -> clap_event_header {
    let size = size_of::<T>() as u32;
    clap_event_header { size, time, space_id: CLAP_CORE_EVENT_SPACE_ID, type_, flags: CLAP_EVENT_IS_LIVE }
}

unsafe extern "C" fn try_push(list: *const clap_output_events, event: *const clap_event_header) -> bool {
    // SAFETY: the framework got the list from `as_host`, whose context is the `OutEvents` of this call; nothing else uses it
    // meanwhile.
    unsafe {
        list.as_ref()
            .and_then(|list| list.ctx.cast::<OutEvents>().as_mut())
            .is_some_and(|out| out.push(event))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap_sys::events::{
        CLAP_EVENT_MIDI, CLAP_EVENT_PARAM_GESTURE_BEGIN, clap_event_midi, clap_event_param_gesture,
    };
    use nice_plug::prelude::Params;

    unsafe extern "C" fn keep(list: *const clap_output_events, event: *const clap_event_header) -> bool {
        // SAFETY: the test's own list and events.
        unsafe {
            let kept = (*list).ctx.cast::<Vec<(u16, u32, f64)>>();
            let value = match (*event).type_ {
                CLAP_EVENT_PARAM_VALUE => (*event.cast::<clap_event_param_value>()).value,
                _ => 0.0,
            };
            (*kept).push(((*event).type_, (*event).time, value));
        }
        true
    }

    #[test]
    fn values_become_whole_and_times_never_go_back() {
        let params = ChalumeauParams::default();
        let entries: HashMap<clap_id, Entry> = params
            .param_map()
            .into_iter()
            .zip(0..)
            .filter_map(|((id, pointer, _), at)| {
                let parameter = crate::parameters::find(&id)?;
                Some((at, Entry { parameter, pointer, steps: parameter.steps().map(|steps| steps as f64) }))
            })
            .collect();
        let id_of = |name: &str| *entries.iter().find(|(_, entry)| entry.parameter.id == name).unwrap().0;
        let mut kept = Vec::<(u16, u32, f64)>::new();
        let host = clap_output_events { ctx: (&raw mut kept).cast(), try_push: Some(keep) };
        // SAFETY: `host` outlives `out`.
        let mut out = unsafe { OutEvents::new(&raw const host, &entries, 63) };
        let list = out.as_host();
        let send = |header: *const clap_event_header| {
            // SAFETY: `list` is the one of `out`, which is not used meanwhile; the events are whole.
            assert!(unsafe { (*list).try_push.unwrap()(list, header) });
        };
        let value = |param_id, value, time| clap_event_param_value {
            header: header::<clap_event_param_value>(CLAP_EVENT_PARAM_VALUE, time),
            param_id,
            cookie: std::ptr::null_mut(),
            note_id: -1,
            port_index: -1,
            channel: -1,
            key: -1,
            value,
        };
        let midi = clap_event_midi {
            header: header::<clap_event_midi>(CLAP_EVENT_MIDI, 40),
            port_index: 0,
            data: [0xB0, 2, 9],
        };
        let gesture = clap_event_param_gesture {
            header: header::<clap_event_param_gesture>(CLAP_EVENT_PARAM_GESTURE_BEGIN, 0),
            param_id: 0,
        };
        let moved = [
            value(id_of("bendr"), 4.999_999_88, 0),
            value(id_of("gain"), 0.7, 0),
            value(id_of("oscprt"), 6_975.999_8, 99),
        ];
        send((&raw const moved[0]).cast());
        send((&raw const midi).cast());
        send((&raw const gesture).cast());
        send((&raw const moved[1]).cast());
        send((&raw const moved[2]).cast());
        params.moments.press(crate::plugin::params::moment::Moment::Rest);
        out.push_off(&params, 63);
        let (set, begin) = (CLAP_EVENT_PARAM_VALUE, CLAP_EVENT_PARAM_GESTURE_BEGIN);
        let expected =
            [(set, 0, 5.0), (CLAP_EVENT_MIDI, 40, 0.0), (begin, 40, 0.0), (set, 40, 0.7), (set, 63, 6_976.0)];
        assert_eq!(kept, expected, "a press that has not fallen back is not told");
    }
}
