//! The plugin as a program of its own: JACK or ALSA in and out, no window yet.

use std::process::ExitCode;

fn main() -> ExitCode {
    let played = nice_plug::prelude::nice_export_standalone::<chalumeau::plugin::Chalumeau>();
    if played { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
