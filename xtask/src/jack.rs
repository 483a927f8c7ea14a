//! MIDI between programs without a sound card: plugin and programs whose midir speaks to JACK, a JACK server with a
//! dummy driver, the tests that play a simulated knob's MIDI port through both, and the standalone's.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::programs::{Programs, STANDALONE, programs};
use crate::{machine, simulator};

/// Frames of a JACK period at 48 kHz: a message takes up to two of them, 11 ms.
const PERIOD_FRAMES: &str = "256";

/// Part of the name of the test that kills a client of the server.
const KILLS: &str = "when_its_host_is_killed";

/// midir 0.11 unregisters a JACK port while its client still runs, and the client, or the next one, may die of that when a
/// knob is unplugged. ALSA and the other systems know no such thing. The price: a fault of ours that
/// shows only now and then may pass here; the knob's other steps, without JACK, are run once.
const ATTEMPTS: usize = 3;

/// A server that cannot run has ended by then.
const SETTLED: Duration = Duration::from_millis(500);

/// How long the server may take to answer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Starts the server and runs `xtask/tests/knob_midi.rs` and the ignored test of `standalone.rs`.
pub fn test() -> Result<()> {
    let Programs { plugin, program, standalone } = programs()?;
    // Killed clients leave a server in a state in which it may run no new ones: the test that kills comes last, alone.
    for which in [["--skip", KILLS].as_slice(), &[KILLS]] {
        let mut left = ATTEMPTS;
        loop {
            let server = Server::start()?;
            let mut command = machine::cargo();
            command
                .args(["test", "-p", "xtask", "--test", "knob_midi", "--", "--ignored", "--nocapture"])
                .arg("--test-threads=1")
                .args(which)
                .env("CHALUMEAU_CLAP", plugin)
                .env(simulator::PROGRAM, program);
            left -= 1;
            match machine::run(server.for_clients(&mut command)) {
                Err(reason) if left > 0 => println!("again, with a new server: {reason:#}"),
                result => break result?,
            }
        }
    }
    let server = Server::start()?;
    let mut command = machine::cargo();
    command
        .args(["test", "-p", "xtask", "--test", "standalone", "--", "--ignored", "it_plays_to_jack"])
        .env(STANDALONE, standalone);
    machine::run(server.for_clients(&mut command))
}

/// Names for the server; another checkout may be testing at the same time. They are few and always the same, because a
/// server that ends while clients are dying leaves its entry in JACK's list of eight, which the next one of that name takes.
const NAMES: [&str; 3] = ["chalumeau-1", "chalumeau-2", "chalumeau-3"];

/// A JACK server with neither sound card nor real-time priority; ends when dropped.
pub(crate) struct Server {
    name: &'static str,
    child: Child,
}

impl Server {
    pub(crate) fn start() -> Result<Self> {
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
    pub(crate) fn for_clients<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.env("JACK_DEFAULT_SERVER", self.name).env("JACK_NO_START_SERVER", "1")
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Asked, it removes its shared memory.
        let _ = machine::terminate(&mut self.child);
    }
}
