//! The simulated knob as a program of its own, started and stopped by whoever plays with it.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::{Context, Result, bail};

use crate::{artefacts, machine};

/// A running simulator; it ends when dropped.
pub struct Simulator {
    child: Child,
    /// Its first line: `serial /dev/pts/7` and the like.
    pub greeting: String,
}

impl Simulator {
    /// Starts it with arguments of `chalumeau knob-sim`, and waits until it is there.
    pub fn start(args: &[&str]) -> Result<Self> {
        let mut child = Command::new(artefacts::program()?)
            .arg("knob-sim")
            .arg("--quiet")
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start the simulated knob")?;
        let mut greeting = String::new();
        let out = child.stdout.take().context("no output of the simulated knob")?;
        BufReader::new(out).read_line(&mut greeting)?;
        let simulator = Self { child, greeting: greeting.trim().to_owned() };
        if simulator.greeting.is_empty() {
            bail!("the simulated knob ended at once: knob-sim {}", args.join(" "));
        }
        Ok(simulator)
    }

    /// Pulls the plug: its port goes, and then the program.
    ///
    /// The program is asked to end. A killed one leaves its MIDI client to JACK, whose server may then run no other.
    pub fn unplug(&mut self) -> Result<()> {
        machine::terminate(&mut self.child)
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        // It may be gone already, which is as good.
        let _ = self.unplug();
    }
}

/// A serial number no other simulator on this machine has, so that tests do not take each other's knobs.
pub fn serial_number() -> u64 {
    static NEXT: AtomicU32 = AtomicU32::new(1);
    0x5100_0000_0000_0000
        | u64::from(std::process::id()) << 16
        | u64::from(NEXT.fetch_add(1, Ordering::Relaxed))
}
