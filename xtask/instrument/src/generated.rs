//! Files the repository carries that are made from others: how to make them, and how to see that they still fit.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use chalumeau_core::reed::{ReedTables, firmware_header as header};

const HEADER: &str = "firmware/include/pressure_table_values.h";

fn checking(args: &[String]) -> Result<bool> {
    match args {
        [] => Ok(false),
        [flag] if flag == "--check" => Ok(true),
        _ => bail!("takes nothing or --check, got {args:?}"),
    }
}

/// Writes a generated file and says so.
pub fn write(path: &str, text: &str) -> Result<()> {
    if let Some(folder) = Path::new(path).parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    fs::write(path, text).with_context(|| format!("cannot write {path}"))?;
    println!("wrote {path}");
    Ok(())
}

/// Reads a generated file.
pub fn read(path: &str) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {path}"))
}

/// The reed tables as the firmware's header; checked byte for byte.
pub fn firmware_header(args: &[String]) -> Result<()> {
    let text = header::pressure_table_values(ReedTables::reference());
    if !checking(args)? {
        return write(HEADER, &text);
    }
    ensure!(read(HEADER)? == text, "{HEADER} is not what the tables give; run `cargo xtask firmware-header`");
    println!("{HEADER} is what the tables give");
    Ok(())
}
