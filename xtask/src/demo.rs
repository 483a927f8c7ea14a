//! The example melody through the plugin, from nothing: builds what it plays through, and says what to do next.

use anyhow::Result;

use crate::{bundle, instrument, machine, simulator};

/// `cargo xtask demo`.
pub fn run(args: &[String]) -> Result<()> {
    machine::provide(if cfg!(target_os = "linux") {
        &[&machine::CC, &machine::CXX, &machine::PKG_CONFIG, &machine::ALSA]
    } else {
        &[&machine::CC, &machine::CXX]
    })?;
    println!("building the plugin and the simulated knob");
    bundle::run(&[])?;
    simulator::build()?;
    instrument::run("demo", args)?;
    println!("To play it in a DAW, copy the bundles from target/bundled:\n{}", bundle::HOMES);
    Ok(())
}
