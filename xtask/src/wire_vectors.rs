//! Golden frames of the knob's protocol in `firmware/golden`, read by the Rust and the C++ tests alike.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use chalumeau_knob::wire::golden;

const FOLDER: &str = "firmware/golden";

/// Every file there should be, by name.
fn files() -> BTreeMap<String, Vec<u8>> {
    let (frames, sysex) = (golden::frames(), golden::sysex());
    let lists = [("list.tsv", golden::list(&frames)), ("midi.tsv", golden::list(&sysex))];
    let lists = lists.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    frames.into_iter().chain(sysex).map(|vector| (vector.file, vector.bytes)).chain(lists).collect()
}

/// Writes them, or compares byte for byte; a file too many is wrong as well.
pub fn wire_vectors(args: &[String]) -> Result<()> {
    let check = match args {
        [] => false,
        [flag] if flag == "--check" => true,
        _ => bail!("takes nothing or --check, got {args:?}"),
    };
    let wanted = files();
    if !check {
        fs::create_dir_all(FOLDER).with_context(|| format!("cannot make {FOLDER}"))?;
    }
    for entry in fs::read_dir(FOLDER).with_context(|| format!("cannot list {FOLDER}"))? {
        let path = entry?.path();
        if path.file_name().is_some_and(|name| wanted.contains_key(&*name.to_string_lossy())) {
            continue;
        }
        ensure!(!check, "{} is no golden frame; run `cargo xtask wire-vectors`", path.display());
        fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
    }
    for (name, bytes) in &wanted {
        let path = Path::new(FOLDER).join(name);
        if check {
            let kept = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            ensure!(
                kept == *bytes,
                "{} is not what the codec gives; run `cargo xtask wire-vectors`",
                path.display()
            );
        } else {
            fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        }
    }
    println!(
        "{} files in {FOLDER} {}",
        wanted.len(),
        if check { "are what the codec gives" } else { "written" }
    );
    Ok(())
}
