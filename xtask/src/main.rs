use std::process::ExitCode;

use anyhow::{Context, Result};
use xtask::COMMANDS;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let command = args.next().unwrap_or_default();
    match run(&command, &args.collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask {command}: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(name: &str, args: &[String]) -> Result<()> {
    if matches!(name, "" | "help" | "-h" | "--help") {
        print!("{}", help());
        return Ok(());
    }
    let command = COMMANDS.iter().find(|command| command.name == name);
    let command = command.with_context(|| format!("no such chore\n\n{}", help()))?;
    xtask::machine::enter_workspace()?;
    command.run(args)
}

fn help() -> String {
    let mut text = "Chores of Chalumeau: cargo xtask <chore> [arguments]\n\n".to_owned();
    for command in COMMANDS {
        let check = if command.checks { " [--check]" } else { "" };
        text += &format!("  {:<26}{}\n", format!("{}{check}", command.name), command.about);
    }
    text + "\ndemo and ci install the system packages they need with apt-get, or name them where there is none.\n"
}
