//! The list of devices, and choosing from it.

use std::sync::PoisonError;

use crate::editor::snapshot::Device;
use crate::plugin::Beside;
use crate::plugin::params::knob::KnobKind;
use chalumeau_knob::device::discover::Kind;
use chalumeau_knob::device::{LinkStatus, Phase, Places, candidates, lock, midi, serial_number, serial_text};

/// Kinds of device the parameter chooses from.
pub const KINDS: usize = 4;
/// Key of what sends OSC.
const OSC: &str = "osc";
/// Before the key of a MIDI port and of a serial number.
const MIDI: &str = "midi:";
const SERIAL: &str = "serial:";
/// Key of a board whose serial number is not known before it is asked.
const BOARD: &str = "board";

/// Everything that may be a knob, the one in use first. Asks the system, which takes milliseconds; for MIDI no more once
/// there was none, because some systems complain each time.
pub fn list(
    places: &Places,
    kind: KnobKind,
    status: Option<&LinkStatus>,
    has_midi: &mut bool,
) -> Vec<Device> {
    let mut devices = Vec::new();
    let in_use = status.filter(|status| status.phase != Phase::Off && kind != KnobKind::Off);
    let linked = in_use.and_then(|status| Some((status, status.serial?)));
    if let Some((status, serial)) = linked.filter(|_| kind == KnobKind::Serial) {
        let is_live = status.phase == Phase::Live;
        devices.push(Device {
            key: format!("{SERIAL}{}", serial_text(serial)),
            name: status.info.as_ref().map_or_else(
                || serial_text(serial),
                |info| format!("{}, {}", info.name_text(), serial_text(serial)),
            ),
            state: if is_live { format!("in use, {}", status.port) } else { status.text.clone() },
            is_chosen: true,
            is_free: is_live,
        });
    }
    for candidate in candidates(places) {
        let port = candidate.path.display();
        let device = match (&candidate.kind, candidate.serial_hint()) {
            (_, Some(serial)) if linked.is_some_and(|(_, chosen)| chosen == serial) => continue,
            (Kind::Simulated { serial, name }, _) => {
                let holder = lock::holder(places, *serial);
                Device {
                    key: format!("{SERIAL}{}", serial_text(*serial)),
                    name: format!("{name}, {}", serial_text(*serial)),
                    state: holder
                        .as_ref()
                        .map_or_else(|| format!("simulated, {port}"), |who| format!("held by {who}")),
                    is_chosen: false,
                    is_free: holder.is_none(),
                }
            }
            (Kind::Usb { chip, .. }, hint) => Device {
                key: hint.map_or_else(|| BOARD.into(), |serial| format!("{SERIAL}{}", serial_text(serial))),
                name: format!("{chip} board"),
                state: format!("{port}: asked when chosen"),
                is_chosen: false,
                is_free: true,
            },
        };
        // The port in hand, whose board has told another serial number than USB.
        if in_use.is_none_or(|status| status.port != candidate.path.to_string_lossy()) {
            devices.push(device);
        }
    }
    let ports = if *has_midi { midi::ports(false) } else { Ok(Vec::new()) };
    *has_midi &= ports.is_ok();
    for name in ports.unwrap_or_default() {
        let is_chosen = kind == KnobKind::Midi && in_use.is_some_and(|status| status.port == name);
        let state = if is_chosen { "in use" } else { "MIDI port" };
        let key = format!("{MIDI}{name}");
        devices.push(Device { key, name, state: state.into(), is_chosen, is_free: true });
    }
    devices.push(Device {
        key: OSC.into(),
        name: "TorqueTuner with stock firmware, by OSC".into(),
        state: "read only: angle to breath, no feel".into(),
        is_chosen: kind == KnobKind::Osc,
        is_free: true,
    });
    devices
}

/// Makes a device of the list the wanted one; the place of its kind in the parameter, which the caller sets.
pub fn choose(beside: &Beside, key: &str) -> Option<usize> {
    let knob = &beside.params.knob;
    let put = |text: &std::sync::RwLock<String>, word: &str| {
        let mut text = text.write().unwrap_or_else(PoisonError::into_inner);
        word.clone_into(&mut text);
    };
    let kind = if let Some(name) = key.strip_prefix(MIDI) {
        put(&knob.midi_port, name);
        KnobKind::Midi
    } else if key == OSC {
        KnobKind::Osc
    } else {
        let serial = key.strip_prefix(SERIAL).filter(|text| serial_number(text).is_some());
        put(&knob.serial, serial.unwrap_or_default());
        KnobKind::Serial
    };
    beside.knob.choose_anew();
    Some(kind as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_knob::device::Advert;
    use chalumeau_knob::device::lock::Ownership;

    #[test]
    fn a_simulated_knob_is_listed_with_who_holds_it() {
        let directory = tempfile::tempdir().unwrap();
        let places = Places::within(directory.path());
        let port = directory.path().join("port");
        let _advert = Advert::publish(&places, 0x51, "Desk knob", &port).unwrap();
        let listed = || list(&places, KnobKind::Off, None, &mut false);
        let knob = listed().into_iter().find(|device| device.key == "serial:0000000000000051").unwrap();
        assert!(knob.name.starts_with("Desk knob") && knob.is_free && !knob.is_chosen, "{knob:?}");
        let _mine = Ownership::take(&places, 0x51, "Track 1", "").unwrap();
        let knob = listed().into_iter().find(|device| device.key == "serial:0000000000000051").unwrap();
        assert!(!knob.is_free && knob.state.contains("held by Track 1"), "{knob:?}");
    }

    #[test]
    fn stock_firmware_is_always_there_to_choose() {
        let directory = tempfile::tempdir().unwrap();
        let places = Places::within(directory.path());
        for (kind, is_chosen) in [(KnobKind::Off, false), (KnobKind::Osc, true)] {
            let devices = list(&places, kind, None, &mut false);
            let osc = devices.iter().find(|device| device.key == OSC).unwrap();
            assert_eq!(osc.is_chosen, is_chosen);
        }
    }
}
