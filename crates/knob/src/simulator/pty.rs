//! A serial port that is none: the master of a pseudo-terminal. The host opens the other end by its path.
//!
//! Bytes go through unchanged, nobody ever waits, and a host may close, crash and come back. What a host does not read is
//! lost once the terminal is full, as with a UART.

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, ioctl_tiocnxcl, tcgetattr, tcsetattr};
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// The device's end.
#[derive(Debug)]
pub struct Pty {
    master: File,
    /// Our own hold on the host's end: without it the master says end-of-file whenever no host is there.
    hold: File,
    path: PathBuf,
    /// Bytes the host did not read in time.
    pub lost: u64,
}

impl Pty {
    /// Opens the next free pseudo-terminal.
    pub fn open() -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(name.into_string().map_err(|_| io::Error::from(ErrorKind::InvalidData))?);
        // Opening it must not make it the terminal of this program: Ctrl-C would then come from there.
        let hold = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(OFlags::NOCTTY.bits() as i32)
            .open(&path)?;
        let mut settings = tcgetattr(&hold)?;
        settings.make_raw();
        tcsetattr(&hold, OptionalActions::Now, &settings)?;
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        Ok(Self { master: File::from(master), hold, path, lost: 0 })
    }

    /// What the host opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends what the host has sent.
    pub fn read(&mut self, into: &mut Vec<u8>) -> io::Result<()> {
        let mut buffer = [0; 4096];
        // A few times is enough for any rate a line has, and bounds the work a flood can make.
        for _ in 0..8 {
            match self.master.read(&mut buffer) {
                Ok(0) => break,
                Ok(length) => into.extend_from_slice(&buffer[..length]),
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.raw_os_error() == Some(Errno::IO.raw_os_error()) => break,
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    /// Sends to the host what fits.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut rest = bytes;
        while !rest.is_empty() {
            match self.master.write(rest) {
                Ok(written) => rest = &rest[written..],
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        self.lost += rest.len() as u64;
        Ok(())
    }

    /// Undoes what a host that was killed left behind: it had the port for itself alone, and the mark outlives it for as
    /// long as our own hold. Living hosts lose nothing, their file locks stay. Call it now and then.
    pub fn forgive(&self) -> io::Result<()> {
        Ok(ioctl_tiocnxcl(&self.hold)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn patiently(pty: &mut Pty, wanted: usize) -> Vec<u8> {
        let (mut got, end) = (Vec::new(), Instant::now() + Duration::from_secs(20));
        while got.len() < wanted && Instant::now() < end {
            pty.read(&mut got).unwrap();
        }
        got
    }

    fn host(pty: &Pty) -> Box<dyn serialport::SerialPort> {
        let path = pty.path().to_str().unwrap();
        serialport::new(path, 921_600).timeout(Duration::from_secs(20)).open().unwrap()
    }

    #[test]
    fn all_bytes_pass_both_ways_and_the_host_may_come_again() {
        let mut pty = Pty::open().unwrap();
        let all: Vec<u8> = (0..=255).collect();
        for _ in 0..3 {
            let mut port = host(&pty);
            port.write_all(&all).unwrap();
            assert_eq!(patiently(&mut pty, 256), all);
            pty.write(&all).unwrap();
            let mut got = [0; 256];
            port.read_exact(&mut got).unwrap();
            assert_eq!(got[..], all);
        }
    }

    #[test]
    fn host_that_does_not_read_stops_nothing() {
        let mut pty = Pty::open().unwrap();
        let _port = host(&pty);
        for _ in 0..10_000 {
            pty.write(&[0x55; 28]).unwrap();
        }
        assert!(pty.lost > 0);
    }

    #[test]
    fn host_that_was_killed_does_not_lock_its_successor_out() {
        let pty = Pty::open().unwrap();
        let port = OpenOptions::new().read(true).write(true).open(pty.path()).unwrap();
        rustix::termios::ioctl_tiocexcl(&port).unwrap();
        drop(port); // closed without clearing the mark, as the system does for the dead
        pty.forgive().unwrap();
        host(&pty);
    }
}
