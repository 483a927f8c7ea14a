//! `steinberg-tests BUNDLE.vst3`: runs the tests of Steinberg's VST3 SDK on every class of a plugin.
//!
//! They are the tests of Steinberg's own program *validator*. That program is not in any package registry; its tests are.

use std::ffi::{CString, c_char, c_int};
use std::process::ExitCode;

unsafe extern "C" {
    /// Runs all tests on the plugin at `path` and prints them. 0 if all pass, 1 if one fails, 2 if there is nothing to test.
    fn run_steinberg_tests(path: *const c_char) -> c_int;
}

fn main() -> ExitCode {
    let (Some(path), None) = (std::env::args().nth(1), std::env::args().nth(2)) else {
        eprintln!("usage: steinberg-tests BUNDLE.vst3");
        return ExitCode::from(2);
    };
    let Ok(path) = CString::new(path) else {
        eprintln!("steinberg-tests: the path has a NUL in it");
        return ExitCode::from(2);
    };
    // SAFETY: `path` ends with NUL and outlives the call.
    let code = unsafe { run_steinberg_tests(path.as_ptr()) };
    ExitCode::from(u8::try_from(code).unwrap_or(2))
}
