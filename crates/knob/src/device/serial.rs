//! Serial ports, and pseudo-terminals that stand in for them.
//!
//! An ESP32 board resets whenever RTS and DTR differ in the one way and sits in its boot loader when they differ in the
//! other: both are raised on opening, DTR first, and on closing RTS falls first. A pseudo-terminal has no such lines, and
//! no speed; what it says about them is ignored.

use crate::device::transport::{BAUD, Binding, Transport};
use serialport::{ErrorKind, SerialPort};
use std::io;
use std::io::{Read, Write};
use std::path::Path;
use std::time::Duration;

/// Bytes of one read; a millisecond at full speed is 92.
const READ: usize = 1024;

/// Reads in one poll, so that a flood returns to the caller.
const READS: usize = 16;

/// Longest wait for room to send, ms. With less room than a frame needs the frame is dropped.
const SEND_WAIT_MS: u64 = 2;

#[cfg(unix)]
type Port = serialport::TTYPort;
#[cfg(windows)]
type Port = serialport::COMPort;

/// Why a port does not open, in words that help.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OpenError {
    /// The system does not let this user.
    #[error("{0}")]
    Permission(String),
    /// Somebody else has it open.
    #[error("{0}")]
    Busy(String),
    /// There is no such port.
    #[error("{0}")]
    Missing(String),
    /// Anything else.
    #[error("{0}")]
    Other(String),
}

/// A serial port, open.
pub struct SerialTransport {
    port: Port,
    path: String,
    /// The end of a frame that the driver has not taken yet.
    rest: Vec<u8>,
}

impl SerialTransport {
    /// Opens `path` for itself alone.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let path = path.to_string_lossy().into_owned();
        if let Some(call_out) = call_out_device(&path, cfg!(target_os = "macos")) {
            return Err(OpenError::Other(format!(
                "{path} waits for a carrier that a knob never raises; use {call_out}"
            )));
        }
        // A pseudo-terminal on macOS refuses any speed.
        let baud = if cfg!(target_os = "macos") && path.starts_with("/dev/ttys") { 0 } else { BAUD };
        let builder = serialport::new(&path, baud).timeout(Duration::from_millis(1)).dtr_on_open(true);
        let mut port = builder.open_native().map_err(|e| explain(&e, &path))?;
        // A pseudo-terminal has no lines; a board that lacks them cannot be reset by them.
        let _ = port.write_request_to_send(true);
        set_nonblocking(&port).map_err(|e| OpenError::Other(format!("{path}: {e}")))?;
        Ok(Self { port, path, rest: Vec::new() })
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.port.write(bytes) {
            Err(e) if is_full(e.kind()) => Ok(0),
            written => written,
        }
    }
}

impl Transport for SerialTransport {
    fn binding(&self) -> Binding {
        Binding::Serial
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        let mut buffer = [0; READ];
        for read in 0..READS {
            let wait = if read == 0 { wait } else { Duration::ZERO };
            self.port.set_timeout(wait)?;
            match self.port.read(&mut buffer) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(n) => {
                    sink(&buffer[..n]);
                    if n < READ {
                        break;
                    }
                }
                Err(e) if is_full(e.kind()) => break,
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(Duration::from_millis(SEND_WAIT_MS))?;
        if !self.rest.is_empty() {
            let written = self.write(&self.rest.clone())?;
            self.rest.drain(..written);
            if !self.rest.is_empty() {
                return Err(io::ErrorKind::WouldBlock.into());
            }
        }
        let written = self.write(bytes)?;
        if written == 0 {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        self.rest.extend_from_slice(&bytes[written..]);
        Ok(())
    }

    fn set_baud(&mut self, baud: u32) -> io::Result<()> {
        // A pseudo-terminal may refuse; it carries the bytes all the same.
        let _ = self.port.set_baud_rate(baud);
        let _ = self.port.clear(serialport::ClearBuffer::Input);
        Ok(())
    }

    fn describe(&self) -> String {
        self.path.clone()
    }
}

impl Drop for SerialTransport {
    fn drop(&mut self) {
        // RTS first: the other order would reset the board.
        let _ = self.port.write_request_to_send(false);
        let _ = self.port.write_data_terminal_ready(false);
    }
}

fn is_full(kind: io::ErrorKind) -> bool {
    matches!(kind, io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted)
}

/// A blocking write would wait for ever on a device that has stalled.
#[cfg(unix)]
fn set_nonblocking(port: &Port) -> io::Result<()> {
    use std::os::fd::AsRawFd;
    nix::fcntl::fcntl(port.as_raw_fd(), nix::fcntl::FcntlArg::F_SETFL(nix::fcntl::OFlag::O_NONBLOCK))?;
    Ok(())
}

/// Windows ports have their time limits set instead.
#[cfg(windows)]
fn set_nonblocking(_port: &Port) -> io::Result<()> {
    Ok(())
}

/// The port to use instead where `path` is one that macOS keeps for incoming calls.
fn call_out_device(path: &str, is_macos: bool) -> Option<String> {
    let name = path.strip_prefix("/dev/tty.").filter(|_| is_macos)?;
    Some(format!("/dev/cu.{name}"))
}

/// Says why `path` does not open, and what the user can do.
fn explain(error: &serialport::Error, path: &str) -> OpenError {
    let said = error.description.to_lowercase();
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => OpenError::Permission(permission_text(path)),
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            OpenError::Missing(format!("{path} is not there: is the knob plugged in?"))
        }
        // Both a locked terminal and a missing one are `NoDevice` on one system or another.
        // Windows says why in the user's language: a port that is there and does not open belongs to somebody else.
        ErrorKind::NoDevice
            if ["busy", "lock", "denied"].iter().any(|word| said.contains(word))
                || cfg!(windows) && is_listed(path) =>
        {
            OpenError::Busy(format!(
                "{path} is in use by another program (a serial monitor, another instance of Chalumeau?): close that program"
            ))
        }
        ErrorKind::NoDevice => OpenError::Missing(format!("{path} is not there: is the knob plugged in?")),
        _ => OpenError::Other(format!("{path} does not open: {}", error.description)),
    }
}

#[cfg(target_os = "linux")]
fn permission_text(path: &str) -> String {
    use std::os::unix::fs::MetadataExt;
    let group = std::fs::metadata(path).ok().and_then(|m| group_name(m.gid()));
    let group = group.unwrap_or_else(|| "dialout".into());
    format!(
        "no permission to open {path}. Either, for all knobs: `sudo cp packaging/70-chalumeau.rules \
         /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger`, then plug it in again. Or, for \
         your user: `sudo usermod -a -G {group} $USER`, then log out and in"
    )
}

/// Windows has no such refusal: whoever may not open a port finds it in use.
#[cfg(not(target_os = "linux"))]
fn permission_text(path: &str) -> String {
    format!("no permission to open {path}: `ls -l {path}` shows which users may open it")
}

/// Whether the system has a port of this name.
fn is_listed(path: &str) -> bool {
    let name = path.trim_start_matches(r"\\.\");
    let ports = serialport::available_ports().unwrap_or_default();
    ports.iter().any(|port| port.port_name.eq_ignore_ascii_case(name))
}

#[cfg(target_os = "linux")]
fn group_name(gid: u32) -> Option<String> {
    let groups = std::fs::read_to_string("/etc/group").ok()?;
    groups.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        let _password = fields.next()?;
        (fields.next()?.parse() == Ok(gid)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(kind: ErrorKind, text: &str) -> OpenError {
        explain(&serialport::Error::new(kind, text), "/dev/ttyUSB0")
    }

    #[test]
    fn each_refusal_has_its_own_words() {
        let permission = said(ErrorKind::Io(io::ErrorKind::PermissionDenied), "Permission denied");
        let busy = said(ErrorKind::NoDevice, "Device or resource busy");
        let locked = said(ErrorKind::NoDevice, "Unable to acquire exclusive lock on serial port");
        let missing = said(ErrorKind::Io(io::ErrorKind::NotFound), "No such file or directory");
        assert!(matches!(&permission, OpenError::Permission(text) if text.contains("/dev/ttyUSB0")));
        assert!(matches!(&busy, OpenError::Busy(text) if text.contains("another program")));
        assert_eq!(busy, locked);
        assert!(matches!(&missing, OpenError::Missing(text) if text.contains("plugged in")));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn permission_is_explained_with_commands_to_paste() {
        let text = permission_text("/dev/null");
        assert!(text.contains("usermod -a -G root $USER"), "the group is the port's own: {text}");
        assert!(text.contains("70-chalumeau.rules"), "{text}");
        assert!(permission_text("/dev/not-there").contains("dialout"));
    }

    #[test]
    fn mac_ports_for_incoming_calls_are_not_opened() {
        assert_eq!(call_out_device("/dev/tty.usbserial-1", true).as_deref(), Some("/dev/cu.usbserial-1"));
        assert_eq!(call_out_device("/dev/cu.usbserial-1", true), None);
        assert_eq!(call_out_device("/dev/tty.usbserial-1", false), None);
    }

    #[test]
    #[cfg(unix)]
    fn a_pseudo_terminal_carries_bytes_both_ways_and_belongs_to_one() {
        let (mut knob, host_end) = serialport::TTYPort::pair().unwrap();
        let path = host_end.name().unwrap();
        drop(host_end);
        let mut host = SerialTransport::open(Path::new(&path)).unwrap();
        host.send(b"hello").unwrap();
        let mut heard = [0; 5];
        knob.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"hello");
        knob.write_all(b"\0\x01\0").unwrap();
        let mut got = Vec::new();
        host.poll(Duration::from_secs(1), &mut |chunk| got.extend_from_slice(chunk)).unwrap();
        assert_eq!(got, b"\0\x01\0", "raw, nothing translated");
        assert!(matches!(SerialTransport::open(Path::new(&path)), Err(OpenError::Busy(_))));
        drop(knob);
        let gone = (0..100).any(|_| host.poll(Duration::from_millis(10), &mut |_| {}).is_err());
        assert!(gone, "a pulled cable is an error");
    }

    #[test]
    #[cfg(unix)]
    fn a_device_that_stops_reading_holds_nobody() {
        let (_knob, host_end) = serialport::TTYPort::pair().unwrap();
        let path = host_end.name().unwrap();
        drop(host_end);
        let mut host = SerialTransport::open(Path::new(&path)).unwrap();
        let full = (0..100_000).find_map(|_| host.send(&[7; 67]).err());
        assert_eq!(full.map(|e| e.kind()), Some(io::ErrorKind::WouldBlock));
    }
}
