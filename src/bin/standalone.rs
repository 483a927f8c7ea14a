//! The standalone program: the plugin without a host.

use std::process::ExitCode;

fn main() -> ExitCode {
    chalumeau::standalone::main()
}
