//! The program as `cargo xtask` starts it.

use std::process::{Command, Output};

fn chore(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask-instrument")).args(args).output().unwrap()
}

#[test]
fn a_chore_passes_or_says_what_it_takes() {
    let header = chore(&["firmware-header", "--check"]);
    assert!(header.status.success(), "{header:?}");
    for (args, said) in [
        (&["firmware-header", "--chek"][..], "takes nothing or --check"),
        (&["web-data"], "takes a folder"),
        (&["tunes"], "no such chore: \"tunes\""),
    ] {
        let refused = chore(args);
        assert!(!refused.status.success(), "{args:?}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains(said), "{refused:?}");
    }
}
