//! The chores that need the clarinet itself, one file each. `cargo xtask` lists them with the others, and starts this
//! program for them.

mod demo;
mod fit_player;
mod generated;
mod parameter_reference;
#[cfg(target_os = "linux")]
mod perf;
mod picture;
mod prepared;
mod touch_demo;
mod web_data;
mod wire_vectors;

use std::process::ExitCode;

use anyhow::{Result, bail};
use chalumeau_test_host::machine;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_default();
    match run(&name, &args.collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{name}: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(name: &str, args: &[String]) -> Result<()> {
    machine::enter_workspace()?;
    match name {
        "demo" => demo::run(args),
        "firmware-header" => generated::firmware_header(args),
        "fit-bore" => prepared::fit_bore(args),
        "fit-player" => fit_player::run(args),
        "parameter-reference" => parameter_reference::parameter_reference(args),
        #[cfg(target_os = "linux")]
        "perf" => perf::run(args),
        "play-dynamics" => prepared::play_dynamics(args),
        "scale-bores" => prepared::scale_bores(args),
        "tune" => prepared::tune(args),
        "web-data" => web_data::write(args),
        "wire-vectors" => wire_vectors::wire_vectors(args),
        _ => bail!("no such chore: {name:?}; `cargo xtask` lists them all"),
    }
}
