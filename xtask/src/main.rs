use std::process::ExitCode;

use anyhow::{Result, bail};

const HELP: &str = "\
Chores of Chalumeau: cargo xtask <command>

  demo        build the plugin, play the example melody through it, write sound, picture and a table of cents
  ci          everything that must pass before a change is kept
  bundle      build Chalumeau.clap and Chalumeau.vst3 into target/bundled; takes cargo build's options

demo and ci install the system packages they need with apt-get, or name them where there is none.
";

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    match run(&command, args.collect()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{command}: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: &str, args: Vec<String>) -> Result<()> {
    xtask::machine::enter_workspace()?;
    match command {
        "" | "help" | "-h" | "--help" => print!("{HELP}"),
        "bundle" => xtask::bundle::run(&args)?,
        "ci" => xtask::ci::run(&args)?,
        "demo" => xtask::demo::run(&args)?,
        unknown => bail!("no such command; choose one of these:\n\n{HELP}given: {unknown}"),
    }
    Ok(())
}
