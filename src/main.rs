//! The command line of Chalumeau.

use std::process::ExitCode;

fn main() -> ExitCode {
    chalumeau::cli::main()
}
