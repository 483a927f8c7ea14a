//! A JACK server without a sound card or real-time priority, so that programs under test can exchange MIDI and sound.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::machine;

/// Rate of a server whose rate does not matter, Hz.
const RATE_HZ: u32 = 48_000;

/// Frames of a JACK period at 48 kHz: a message takes up to two of them, 11 ms.
const PERIOD_FRAMES: &str = "256";

/// A server that cannot run has ended by then.
const SETTLED: Duration = Duration::from_millis(500);

/// How long the server may take to answer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Names for the server; another checkout may be testing at the same time. They are few and always the same, because a
/// server that ends while clients are dying leaves its entry in JACK's list of eight, which the next one of that name takes.
const NAMES: [&str; 3] = ["chalumeau-1", "chalumeau-2", "chalumeau-3"];

/// A JACK server with neither sound card nor real-time priority; ends when dropped.
pub struct JackServer {
    name: String,
    child: Child,
}

impl JackServer {
    /// Starts a server and waits until it answers.
    pub fn start() -> Result<Self> {
        let mut complaints = String::new();
        for name in NAMES {
            match Self::named(name, RATE_HZ) {
                Ok(server) => return Ok(server),
                Err(reason) => complaints += &format!("\n{name}: {reason:#}"),
            }
        }
        bail!("jackd does not run here:{complaints}")
    }

    /// Starts a server of this name at this rate, Hz, and waits until it answers.
    pub fn named(name: &str, rate_hz: u32) -> Result<Self> {
        let (mut server, log) = Self::spawn(name, rate_hz)?;
        server.wait(&log)?;
        Ok(server)
    }

    /// As [`named`](Self::named), but does not wait.
    pub fn beginning(name: &str, rate_hz: u32) -> Result<Self> {
        Ok(Self::spawn(name, rate_hz)?.0)
    }

    fn spawn(name: &str, rate_hz: u32) -> Result<(Self, PathBuf)> {
        let folder = machine::target().join("jack");
        fs::create_dir_all(&folder)?;
        let log = folder.join(format!("{name}.log"));
        let out = fs::File::create(&log)?;
        let child = Command::new("jackd")
            .args([
                "-n",
                name,
                "--no-realtime",
                "--no-mlock",
                "-d",
                "dummy",
                "-r",
                &rate_hz.to_string(),
                "-p",
                PERIOD_FRAMES,
            ])
            .env("JACK_NO_AUDIO_RESERVATION", "1")
            .stdin(Stdio::null())
            .stderr(out.try_clone()?)
            .stdout(out)
            .spawn()
            .context("cannot start jackd")?;
        Ok((Self { name: name.to_owned(), child }, log))
    }

    /// Kills the server as a crash would.
    pub fn kill(mut self) -> Result<()> {
        self.child.kill()?;
        self.child.wait()?;
        Ok(())
    }

    /// Stops the server, which then answers nobody, or lets it go on.
    pub fn freeze(&self, frozen: bool) -> Result<()> {
        let signal = if frozen { "STOP" } else { "CONT" };
        let command = format!("kill -{signal} {}", self.child.id());
        machine::run(Command::new("sh").args(["-c", &command]))
    }

    /// Until it answers.
    fn wait(&mut self, log: &Path) -> Result<()> {
        let began = Instant::now();
        loop {
            // First, because one of the same name may answer in place of ours.
            if self.child.try_wait()?.is_some() || began.elapsed() > PATIENCE {
                bail!("{}", fs::read_to_string(log).unwrap_or_default().trim());
            }
            let mut list = Command::new("jack_lsp");
            let list = self.for_clients(&mut list).stdout(Stdio::null()).stderr(Stdio::null());
            if began.elapsed() > SETTLED && list.status().context("cannot start jack_lsp")?.success() {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Makes a program, and those it starts, clients of this server and of no other.
    pub fn for_clients<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("JACK_DEFAULT_SERVER", &self.name).env("JACK_NO_START_SERVER", "1")
    }
}

impl Drop for JackServer {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            // A frozen one hears nothing. Asked, it removes its shared memory.
            let _ = self.freeze(false);
            let _ = machine::terminate(&mut self.child);
        }
    }
}
