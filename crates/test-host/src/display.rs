//! A display that nobody sees: an X server without a screen, drawn to by the processor alone.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::machine;

/// Pixels of the display, and bits of a pixel.
const SCREEN: &str = "2400x1600x24";

/// Threads that Mesa may draw with; as many as cores would starve what is measured beside it.
const DRAWING_THREADS: &str = "1";

/// A running server; ends when dropped.
pub struct Display {
    name: String,
    child: Child,
}

impl Display {
    /// Starts a server on the first number that is free.
    pub fn start() -> Result<Self> {
        // It writes the number it took to the file descriptor it is given, here its standard output.
        let mut child = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", SCREEN, "-nolisten", "tcp", "-noreset"])
            .args(["+extension", "GLX", "+extension", "DAMAGE", "+extension", "XTEST"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("cannot start Xvfb")?;
        let mut number = String::new();
        if let Some(out) = child.stdout.take() {
            BufReader::new(out).read_line(&mut number)?;
        }
        let display = Self { name: format!(":{}", number.trim()), child };
        if number.trim().is_empty() {
            bail!("Xvfb does not run here");
        }
        Ok(display)
    }

    /// As `DISPLAY` has it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Makes a program, and those it starts, draw on this display and with the processor.
    pub fn for_clients<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command
            .env("DISPLAY", &self.name)
            .env_remove("WAYLAND_DISPLAY")
            .env("LIBGL_ALWAYS_SOFTWARE", "1")
            .env("LP_NUM_THREADS", DRAWING_THREADS)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Asked, it removes its lock and its socket.
        let _ = machine::terminate(&mut self.child);
    }
}
