//! Clarinets of others, measured in the same way where they are installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;
use chalumeau_figure::report::TableCell;

use super::playing::{COUNTED_S, Cost, Player};
use chalumeau_test_host::machine;

/// Programs of others that play a note.
struct Peers {
    found: Vec<(String, Player)>,
    /// What is not installed.
    missing: Vec<String>,
}

fn peers(folder: &Path) -> Result<Peers> {
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    let stk = folder.join("stk");
    let build = Command::new("c++")
        .args(["-std=c++17", "-O3", "benches/peers/stk.cpp", "-lstk", "-o"])
        .arg(&stk)
        .output();
    if build.is_ok_and(|build| build.status.success()) {
        for (name, title) in [("blowhole", "STK BlowHole"), ("clarinet", "STK Clarinet")] {
            let arguments = [name, "SECONDS", "48000"].map(str::to_owned).into();
            found.push((title.to_owned(), Player { program: stk.clone(), arguments, rate_hz: 48_000.0 }));
        }
    } else {
        missing.push("STK's BlowHole and Clarinet (Debian package libstk-dev)".to_owned());
    }
    if machine::works("csound", &["--version"]) {
        let score = folder.join("wgclar.csd");
        fs::write(&score, CSOUND)?;
        let mut arguments = ["-n", "-d", "-m0", "--smacro:LENGTH=SECONDS"].map(str::to_owned).to_vec();
        arguments.push(score.to_string_lossy().into_owned());
        let player = Player { program: "csound".into(), arguments, rate_hz: 48_000.0 };
        found.push(("Csound wgclar".to_owned(), player));
    } else {
        missing.push("Csound's wgclar (Debian package csound)".to_owned());
    }
    Ok(Peers { found, missing })
}

/// Sounding B flat 3, as the other peers play it; blocks of 64.
const CSOUND: &str = "\
<CsoundSynthesizer>
<CsInstruments>
sr = 48000
ksmps = 64
nchnls = 1
0dbfs = 1
instr 1
  asig wgclar 0.8, 233.08, -0.3, 0.02, 0.05, 0.1, 0, 0.1, -1, 100
  out asig
endin
</CsInstruments>
<CsScore>
i1 0 $LENGTH
</CsScore>
</CsoundSynthesizer>
";

/// A row for each that is installed, and what is missing.
pub(super) fn peer_rows(folder: &Path, one: Cost) -> Result<(Vec<Vec<TableCell>>, Vec<String>)> {
    let Peers { found, missing } = peers(folder)?;
    let mut rows = Vec::new();
    for (name, player) in found {
        let ratio = player.instructions(COUNTED_S)? / one.instructions;
        println!("{name}: {ratio:.3} of the instructions of one voice here");
        rows.push(vec![TableCell::Word(name), TableCell::Number(format!("{ratio:.3}"))]);
    }
    Ok((rows, missing))
}
