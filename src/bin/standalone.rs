//! The plugin as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    chalumeau::plugin::standalone::main()
}
