//! A JACK server without a sound card or real-time priority, so that programs under test can exchange MIDI and sound.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::machine;

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
    name: &'static str,
    child: Child,
}

impl JackServer {
    /// Starts a server and waits until it answers.
    pub fn start() -> Result<Self> {
        let mut complaints = String::new();
        for name in NAMES {
            match Self::named(name) {
                Ok(server) => return Ok(server),
                Err(reason) => complaints += &format!("\n{name}: {reason:#}"),
            }
        }
        bail!("jackd does not run here:{complaints}")
    }

    fn named(name: &'static str) -> Result<Self> {
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
                "48000",
                "-p",
                PERIOD_FRAMES,
            ])
            .env("JACK_NO_AUDIO_RESERVATION", "1")
            .stdin(Stdio::null())
            .stderr(out.try_clone()?)
            .stdout(out)
            .spawn()
            .context("cannot start jackd")?;
        let mut server = Self { name, child };
        server.wait(&log)?;
        Ok(server)
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
        command.env("JACK_DEFAULT_SERVER", self.name).env("JACK_NO_START_SERVER", "1")
    }
}

impl Drop for JackServer {
    fn drop(&mut self) {
        // Asked, it removes its shared memory.
        let _ = machine::terminate(&mut self.child);
    }
}
