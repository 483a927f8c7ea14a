//! Plays a simulated knob's MIDI port and the standalone through a JACK server without a sound card.

use anyhow::Result;
use chalumeau_test_host::artefacts;
use chalumeau_test_host::jack::JackServer;

use crate::machine;
use crate::programs::{Programs, TESTS, programs};

/// Part of the name of the test that kills a client of the server.
const KILLS: &str = "when_its_host_is_killed";

/// midir 0.11 unregisters a JACK port while its client still runs, and the client, or the next one, may die of that when a
/// knob is unplugged. ALSA and the other systems know no such thing. The price: a fault of ours that
/// shows only now and then may pass here; the knob's other steps, without JACK, are run once.
const ATTEMPTS: usize = 3;

/// Of the server that the tests start and kill by themselves.
const MORTAL: &str = "chalumeau-mortal";

/// Starts the server and runs `crates/test-host/tests/knob_midi.rs` and those tests of `standalone.rs` that need it; then
/// `jack_death.rs`, which starts servers and kills them.
pub fn test() -> Result<()> {
    let Programs { plugin, program, standalone, .. } = programs()?;
    // Killed clients leave a server in a state in which it may run no new ones: the test that kills comes last, alone.
    for which in [["--skip", KILLS].as_slice(), &[KILLS]] {
        let mut left = ATTEMPTS;
        loop {
            let server = JackServer::start()?;
            let mut command = machine::cargo();
            command
                .args(TESTS)
                .args(["--test", "knob_midi", "--", "--ignored", "--nocapture"])
                .arg("--test-threads=1")
                .args(which)
                .env(artefacts::CLAP, plugin)
                .env(artefacts::PROGRAM, program);
            left -= 1;
            match machine::run(server.for_clients(&mut command)) {
                Err(reason) if left > 0 => println!("again, with a new server: {reason:#}"),
                result => break result?,
            }
        }
    }
    let server = JackServer::start()?;
    let mut command = machine::cargo();
    command
        .args(TESTS)
        .args(["--test", "standalone", "--", "--ignored", "jack", "--test-threads=1"])
        .env(artefacts::STANDALONE, standalone);
    machine::run(server.for_clients(&mut command))?;
    drop(server);
    let mut command = machine::cargo();
    command
        .args(TESTS)
        .args(["--test", "jack_death", "--", "--ignored", "--nocapture", "--test-threads=1"])
        .env(artefacts::STANDALONE, standalone)
        .env("JACK_DEFAULT_SERVER", MORTAL)
        .env("JACK_NO_START_SERVER", "1");
    machine::run(&mut command)
}
