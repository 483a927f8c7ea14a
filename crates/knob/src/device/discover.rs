//! Which ports may have a knob behind them. Only these are ever opened unasked.

use crate::device::lock::try_lock_patiently;
use crate::device::runtime_dir::{RuntimeDir, serial_number, serial_text};
use serde::{Deserialize, Serialize};
use serialport::SerialPortType;
use std::fs;
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// USB identities of the boards that TorqueTuners and their like are built on; `None`: any product of the vendor.
pub const KNOWN: &[(u16, Option<u16>, &str)] =
    &[(0x10C4, Some(0xEA60), "CP210x"), (0x1A86, Some(0x55D4), "CH9102"), (0x303A, None, "Espressif")];

/// What stands behind a port as far as the system tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortKind {
    /// A USB device of a known identity.
    Usb {
        /// Vendor and product.
        id: (u16, u16),
        /// Name of the chip or its maker.
        chip: &'static str,
        /// Serial number that USB tells; often the same for all boards.
        usb_serial: Option<String>,
    },
    /// A simulated knob that has announced itself.
    Simulated {
        /// Its serial number.
        serial: u64,
        /// Its name.
        name: String,
    },
}

/// A port to try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// Path or name to open.
    pub path: PathBuf,
    /// What is known of it.
    pub kind: PortKind,
}

impl Candidate {
    /// The device's serial number where it is known without asking. Of USB it is a hint only.
    pub fn serial_hint(&self) -> Option<u64> {
        match &self.kind {
            PortKind::Simulated { serial, .. } => Some(*serial),
            PortKind::Usb { usb_serial, .. } => usb_serial.as_deref().and_then(serial_number),
        }
    }

    /// True when the hint cannot be wrong.
    pub fn is_certain(&self) -> bool {
        matches!(self.kind, PortKind::Simulated { .. })
    }
}

/// Every port that may have a knob behind it. Simulated knobs come first: they were started on purpose, and answer at
/// once, where a board that is no knob costs seconds.
pub fn candidates(places: &RuntimeDir) -> Vec<Candidate> {
    let mut found = simulated(places);
    found.extend(boards());
    found
}

/// All serial ports with what USB tells of them, known or not, for a list to choose from.
pub fn ports() -> Vec<serialport::SerialPortInfo> {
    // Without it serialport panics.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Vec::new();
    }
    let mut ports = serialport::available_ports().unwrap_or_default();
    // macOS lists each port twice; the `tty` one waits for a carrier.
    ports.retain(|port| !port.port_name.starts_with("/dev/tty.") || !cfg!(target_os = "macos"));
    ports.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    ports
}

/// The chip behind a USB identity, if it is one of [`KNOWN`].
pub fn chip(vid: u16, pid: u16) -> Option<&'static str> {
    KNOWN.iter().find(|(v, p, _)| *v == vid && p.is_none_or(|p| p == pid)).map(|(_, _, name)| *name)
}

fn boards() -> Vec<Candidate> {
    let board = |port: serialport::SerialPortInfo| {
        let SerialPortType::UsbPort(usb) = port.port_type else { return None };
        let kind = PortKind::Usb {
            id: (usb.vid, usb.pid),
            chip: chip(usb.vid, usb.pid)?,
            usb_serial: usb.serial_number,
        };
        Some(Candidate { path: port.port_name.into(), kind })
    };
    ports().into_iter().filter_map(board).collect()
}

/// What a simulated knob leaves in `knobs/<serial>.toml`.
#[derive(Debug, Serialize, Deserialize)]
struct AnnouncementFile {
    path: PathBuf,
    name: String,
    pid: u32,
}

/// A simulated knob's announcement; withdrawn when dropped, and void when its program ends in any other way.
#[derive(Debug)]
pub struct Announcement {
    card: PathBuf,
    /// Locked as long as the program lives: what a process number cannot promise.
    _alive: File,
}

impl Announcement {
    /// Announces that the knob `serial` can be reached at `path`. One serial number can be announced once at a time.
    pub fn publish(places: &RuntimeDir, serial: u64, name: &str, path: &Path) -> io::Result<Self> {
        let directory = places.knobs()?;
        let alive = File::create(directory.join(serial_text(serial) + ".alive"))?;
        try_lock_patiently(&alive).map_err(|e| match e {
            TryLockError::WouldBlock => {
                let text =
                    format!("a simulated knob with serial number {} is running already", serial_text(serial));
                io::Error::new(io::ErrorKind::AddrInUse, text)
            }
            TryLockError::Error(e) => e,
        })?;
        let card = directory.join(serial_text(serial) + ".toml");
        let text = toml::to_string(&AnnouncementFile {
            path: path.into(),
            name: name.into(),
            pid: std::process::id(),
        })
        .map_err(io::Error::other)?;
        // Whole or not at all: others read it at any time.
        let draft = card.with_extension("new");
        fs::write(&draft, text)?;
        fs::rename(&draft, &card)?;
        Ok(Self { card, _alive: alive })
    }
}

impl Drop for Announcement {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.card);
    }
}

/// Simulated knobs whose programs are running, by serial number.
pub fn simulated(places: &RuntimeDir) -> Vec<Candidate> {
    let Ok(entries) = places.knobs().and_then(fs::read_dir) else { return Vec::new() };
    let mut found: Vec<Candidate> = entries.flatten().filter_map(|entry| read_card(&entry.path())).collect();
    found.sort_by_key(Candidate::serial_hint);
    found
}

fn read_card(card: &Path) -> Option<Candidate> {
    if card.extension()? != "toml" {
        return None;
    }
    let serial = serial_number(card.file_stem()?.to_str()?)?;
    let alive = File::open(card.with_extension("alive")).ok()?;
    if alive.try_lock_shared().is_ok() {
        return None; // its program has ended without withdrawing it
    }
    let AnnouncementFile { path, name, .. } = toml::from_str(&fs::read_to_string(card).ok()?).ok()?;
    Some(Candidate { path, kind: PortKind::Simulated { serial, name } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_boards_are_known_and_others_are_not() {
        assert_eq!(chip(0x10C4, 0xEA60), Some("CP210x"));
        assert_eq!(chip(0x303A, 0x1001), Some("Espressif"));
        assert_eq!(chip(0x10C4, 0xEA61), None);
        assert_eq!(chip(0x0403, 0x6001), None);
    }

    #[test]
    fn udev_rule_names_the_same_boards() {
        let rules = include_str!("../../../../packaging/70-chalumeau.rules");
        let lines: Vec<&str> = rules.lines().filter(|line| line.starts_with("SUBSYSTEM")).collect();
        assert_eq!(lines.len(), KNOWN.len());
        for (line, (vid, pid, _)) in lines.iter().zip(KNOWN) {
            assert!(line.contains(&format!("ATTRS{{idVendor}}==\"{vid:04x}\"")), "{line}");
            let product = pid.map(|pid| format!("ATTRS{{idProduct}}==\"{pid:04x}\""));
            assert_eq!(line.contains("idProduct"), product.is_some());
            assert!(line.contains(&product.unwrap_or_default()), "{line}");
        }
    }

    #[test]
    fn a_simulated_knob_is_found_while_it_lives() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        assert_eq!(simulated(&places), []);
        let advert = Announcement::publish(&places, 0xC1A2, "simulated", Path::new("/dev/pts/9")).unwrap();
        let kind = PortKind::Simulated { serial: 0xC1A2, name: "simulated".into() };
        assert_eq!(simulated(&places), [Candidate { path: "/dev/pts/9".into(), kind }]);
        let twice = Announcement::publish(&places, 0xC1A2, "again", Path::new("/dev/pts/10")).unwrap_err();
        assert!(twice.to_string().contains("000000000000c1a2 is running already"), "{twice}");
        drop(advert);
        assert_eq!(simulated(&places), []);
    }

    #[test]
    fn cards_of_dead_programs_and_nonsense_are_ignored() {
        let directory = tempfile::tempdir().unwrap();
        let places = RuntimeDir::within(directory.path());
        let knobs = places.knobs().unwrap();
        fs::write(knobs.join("000000000000c1a2.toml"), "path = '/dev/pts/9'\nname = 'dead'\npid = 1\n")
            .unwrap();
        fs::write(knobs.join("000000000000c1a2.alive"), "").unwrap();
        fs::write(knobs.join("no-number.toml"), "").unwrap();
        assert_eq!(simulated(&places), []);
        // Alive, but what it wrote is no card.
        let alive = File::open(knobs.join("000000000000c1a2.alive")).unwrap();
        alive.try_lock().unwrap();
        fs::write(knobs.join("000000000000c1a2.toml"), "path = 7").unwrap();
        assert_eq!(simulated(&places), []);
    }
}
