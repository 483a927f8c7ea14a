//! `cargo xtask perf`: how the cost of playing grows, as a page in `target/perf`. Too long for `ci`.
//!
//! All costs are ratios to one voice at 48 kHz in the same run: instructions, counted by callgrind as the difference of two run lengths,
//! and thread time. Peers are measured in the same way where they are installed. `benches/programs/src/bin/growth.rs` plays.

mod limits;
mod peers;
mod playing;
mod series;

use std::fmt::Write;
use std::fs::{self, File};

use anyhow::{Result, bail};
use chalumeau_figure::draw;
use chalumeau_figure::report::{Report, ReportTable, write};
use chalumeau_test_host::artefacts;

use self::limits::{blocks, memory, notes, plugin};
use self::peers::peer_rows;
use self::playing::measure;
use self::series::{SERIES, series};
use chalumeau_test_host::machine;

/// Blocks of random playing by default, and with `--full`.
const BLOCKS: (usize, usize) = (10_000, 1_000_000);

/// `cargo xtask perf [--full]`.
pub fn run(args: &[String]) -> Result<()> {
    let full = match args {
        [] => false,
        [word] if word == "--full" => true,
        _ => bail!("takes --full (more points, and a million blocks instead of {}), got {args:?}", BLOCKS.0),
    };
    machine::provide(&[&machine::VALGRIND])?;
    machine::run(machine::cargo().args([
        "build",
        "--profile=plugin",
        "--package=chalumeau-benches",
        "--bin=growth",
    ]))?;
    let folder = machine::target().join("perf");
    fs::create_dir_all(&folder)?;
    let one = measure(&[])?;
    println!("one voice: {:.0} instructions and {:.1} ns for a sample at 48 kHz", one.instructions, one.ns);
    let mut about = vec![format!(
        "One voice of a B flat clarinet takes {:.0} instructions and {:.1} ns for a sample at 48 kHz: one core computes it {:.0} times as fast as it sounds. All other costs are ratios to it, measured in the same run. Counts of instructions repeat on a busy machine; times do not.",
        one.instructions,
        one.ns,
        1e9 / 48_000.0 / one.ns
    )];
    let (note_plate, note_row) = notes()?;
    let mut limits = vec![note_row];
    limits.extend(blocks(if full { BLOCKS.1 } else { BLOCKS.0 })?);
    limits.push(memory()?);
    let mut missing = String::new();
    match artefacts::clap().and_then(|path| plugin(&path)) {
        Ok(rows) => limits.extend(rows),
        Err(error) => write!(missing, "The plugin is not measured: {error:#}. ")?,
    }
    let (peer_rows, absent) = peer_rows(&folder, one)?;
    for peer in absent {
        write!(missing, "Not installed, so not measured: {peer}. ")?;
    }
    if !missing.is_empty() {
        println!("{missing}");
        about.push(missing);
    }
    let mut tables = vec![ReportTable {
        title: "Limits".to_owned(),
        about: "Blocks: the same random notes and automation three times, by thread time. The least time of each block counts, since other programs only add.".to_owned(),
        head: ["what", "measured", "wanted"].map(str::to_owned).into(),
        rows: limits,
    }];
    if !peer_rows.is_empty() {
        tables.push(ReportTable {
            title: "Other clarinets".to_owned(),
            about: "A held B flat 3 at 48 kHz. Their bores have no tone holes; that of BlowHole has one, and a register hole."
                .to_owned(),
            head: ["what", "instructions over one voice here"].map(str::to_owned).into(),
            rows: peer_rows,
        });
    }
    let mut plates = Vec::new();
    for of in &SERIES {
        let (plate, table) = series(of, one, full)?;
        plates.push(plate);
        tables.push(table);
    }
    plates.push(note_plate);
    for (plate, name) in plates.iter().zip(SERIES.iter().map(|of| of.word).chain(["notes"])) {
        fs::write(folder.join(format!("{name}.png")), draw::png(&plate.figure, None)?)?;
    }
    let report = Report {
        title: "How the cost of playing grows".to_owned(),
        about,
        sound: None,
        plates,
        chapters: Vec::new(),
        tables,
        made_by: if full { "cargo xtask perf --full" } else { "cargo xtask perf" }.to_owned(),
    };
    let page = folder.join("index.html");
    write(&report, &mut File::create(&page)?)?;
    println!("{}", page.display());
    Ok(())
}
