//! The list of knobs in the window, and the choice from it.

use std::sync::PoisonError;

use crate::editor::snapshot::KnobDevice;
use crate::plugin::SharedHandles;
use crate::plugin::params::knob::KnobKind;
use chalumeau_knob::device::discover::PortKind;
use chalumeau_knob::device::{
    Candidate, LinkStatus, Phase, RuntimeDir, candidates, lock, midi, serial_number, serial_text,
};

/// Key of the entry for OSC.
const OSC: &str = "osc";
/// Prefix of the key of a MIDI port.
const MIDI: &str = "midi:";
/// Prefix of the key of a serial number.
const SERIAL: &str = "serial:";
/// Key of a board whose serial number is not known yet.
const BOARD: &str = "board";

/// Lists everything that may be a knob, the one in use first. Asks the system, which takes milliseconds. If the system
/// has no MIDI, `has_midi` becomes false and later calls do not ask again, because some systems print an error each time.
pub fn list(
    places: &RuntimeDir,
    kind: KnobKind,
    status: Option<&LinkStatus>,
    has_midi: &mut bool,
) -> Vec<KnobDevice> {
    let in_use = status.filter(|status| status.phase != Phase::Off && kind != KnobKind::Off);
    let linked = in_use.filter(|_| kind == KnobKind::Serial);
    let linked = linked.and_then(|status| Some((status, status.serial?)));
    let mut devices: Vec<KnobDevice> =
        linked.map(|(status, serial)| linked_device(status, serial)).into_iter().collect();
    // A knob of any kind has told its serial number; the list has that knob already.
    let known_serial = in_use.and_then(|status| status.serial);
    for candidate in candidates(places) {
        if candidate.serial_hint().is_some_and(|serial| known_serial == Some(serial)) {
            continue;
        }
        // This skips a linked board that has told a serial number other than that of its USB chip.
        if in_use.is_none_or(|status| status.port != candidate.path.to_string_lossy()) {
            devices.push(found_device(places, &candidate));
        }
    }
    let ports = if *has_midi { midi::ports(false) } else { Ok(Vec::new()) };
    *has_midi &= ports.is_ok();
    for name in ports.unwrap_or_default() {
        let is_chosen = kind == KnobKind::Midi && in_use.is_some_and(|status| status.port == name);
        let state = if is_chosen { "in use" } else { "MIDI port" };
        let key = format!("{MIDI}{name}");
        devices.push(KnobDevice {
            key,
            name,
            state: state.into(),
            is_chosen,
            is_free: true,
            is_knob: is_chosen,
        });
    }
    devices.push(KnobDevice {
        key: OSC.into(),
        name: "TorqueTuner with stock firmware, by OSC".into(),
        state: "read only: its angle sets the breath; its feel cannot change".into(),
        is_chosen: kind == KnobKind::Osc,
        is_free: true,
        is_knob: kind == KnobKind::Osc,
    });
    devices
}

/// The serial knob that the link uses.
fn linked_device(status: &LinkStatus, serial: u64) -> KnobDevice {
    let is_live = status.phase == Phase::Live;
    let serial = serial_text(serial);
    KnobDevice {
        key: format!("{SERIAL}{serial}"),
        name: status
            .info
            .as_ref()
            .map_or_else(|| serial.clone(), |info| format!("{}, {serial}", info.name_text())),
        state: if is_live { format!("in use, {}", status.port) } else { status.text.clone() },
        is_chosen: true,
        is_free: is_live,
        is_knob: true,
    }
}

/// A simulated knob or a USB board that the link does not use.
fn found_device(places: &RuntimeDir, candidate: &Candidate) -> KnobDevice {
    let port = candidate.path.display();
    match (&candidate.kind, candidate.serial_hint()) {
        (PortKind::Simulated { serial, name }, _) => {
            let holder = lock::holder(places, *serial);
            KnobDevice {
                key: format!("{SERIAL}{}", serial_text(*serial)),
                name: format!("{name}, {}", serial_text(*serial)),
                state: holder
                    .as_ref()
                    .map_or_else(|| format!("simulated, {port}"), |who| format!("held by {who}")),
                is_chosen: false,
                is_free: holder.is_none(),
                is_knob: true,
            }
        }
        (PortKind::Usb { chip, .. }, hint) => KnobDevice {
            key: hint.map_or_else(|| BOARD.into(), |serial| format!("{SERIAL}{}", serial_text(serial))),
            name: format!("{chip} board"),
            state: format!("{port}: asked when chosen"),
            is_chosen: false,
            is_free: true,
            is_knob: false,
        },
    }
}

/// Stores the choice of a device in the parameters. Returns the value of *Knob*, which the caller must set.
pub fn choose(handles: &SharedHandles, key: &str) -> KnobKind {
    let knob = &handles.params.knob;
    let store = |text: &std::sync::RwLock<String>, word: &str| {
        let mut text = text.write().unwrap_or_else(PoisonError::into_inner);
        word.clone_into(&mut text);
    };
    let kind = if let Some(name) = key.strip_prefix(MIDI) {
        store(&knob.midi_port, name);
        KnobKind::Midi
    } else if key == OSC {
        KnobKind::Osc
    } else {
        let serial = key.strip_prefix(SERIAL).filter(|text| serial_number(text).is_some());
        store(&knob.serial, serial.unwrap_or_default());
        KnobKind::Serial
    };
    handles.knob.choose_device_again();
    kind
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_knob::device::Announcement;
    use chalumeau_knob::device::lock::Ownership;

    #[test]
    fn a_simulated_knob_is_listed_with_who_holds_it() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        let port = directory.path().join("port");
        let _advert = Announcement::publish(&places, 0x51, "KnobController knob", &port).unwrap();
        let listed = || list(&places, KnobKind::Off, None, &mut false);
        let knob = listed().into_iter().find(|device| device.key == "serial:0000000000000051").unwrap();
        assert!(
            knob.name.starts_with("KnobController knob") && knob.is_free && !knob.is_chosen && knob.is_knob,
            "{knob:?}"
        );
        let _mine = Ownership::take(&places, 0x51, "Track 1", "").unwrap();
        let knob = listed().into_iter().find(|device| device.key == "serial:0000000000000051").unwrap();
        assert!(!knob.is_free && knob.state.contains("held by Track 1"), "{knob:?}");
    }

    #[test]
    fn stock_firmware_is_always_listed() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        for (kind, is_chosen) in [(KnobKind::Off, false), (KnobKind::Osc, true)] {
            let devices = list(&places, kind, None, &mut false);
            let osc = devices.iter().find(|device| device.key == OSC).unwrap();
            assert_eq!((osc.is_chosen, osc.is_knob), (is_chosen, is_chosen));
        }
    }
}
