//! The clarinet as a web page: a static folder, `target/web`, that works from any host and below any path.
//!
//! - `toolchain`: builds the WebAssembly modules, with the target's library from wherever it can be had
//! - [`instrument`] writes instruments, presets and controls for the page, from the same tables as the plugin's
//! - `serve`: a server for this machine
//! - `browser`: the tests in a browser

mod browser;
mod serve;
mod toolchain;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use sha2::{Digest, Sha256};

use crate::{instrument, licences, machine};

pub use browser::{test, test_module};

/// The port of `--serve` without a number.
const PORT: u16 = 8_000;
/// What the service worker's version stands for until the page is built.
const VERSION: &str = "VERSION";
/// Likewise its list of files.
const FILES: &str = "[/* FILES */]";
/// Large, and fetched when first needed. Its name in the page tells its contents, so that a page of another version never gets it.
const LATER: &str = "workshop.wasm";
/// Who names it.
const NAMES_LATER: [&str; 2] = ["sw.js", "workshop-worker.js"];

/// `cargo xtask web [--serve [port]]`.
pub fn run(args: &[String]) -> Result<()> {
    let words: Vec<_> = args.iter().map(String::as_str).collect();
    let port = match words.as_slice() {
        [] => None,
        ["--serve"] => Some(PORT),
        ["--serve", port] => Some(port.parse().with_context(|| format!("{port:?} is no port, 1 to 65535"))?),
        _ => bail!("takes nothing, or --serve and a port, got {words:?}"),
    };
    let folder = build()?;
    port.map_or(Ok(()), |port| serve::run(&folder, port))
}

/// Makes the folder anew.
pub fn build() -> Result<PathBuf> {
    let folder = machine::target().join("web");
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| format!("cannot empty {}", folder.display()))?;
    }
    fs::create_dir_all(&folder)?;
    let mut names = Vec::new();
    for entry in fs::read_dir(machine::root().join("web/page")).context("cannot list web/page")? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        copy(&path, &folder.join(&name))?;
        names.push(name);
    }
    names.extend(toolchain::build(&folder)?);
    instrument::run("web-data", &[folder.display().to_string()])?;
    names.extend(["data.json", "tour.json"].map(str::to_owned));
    let later = name_by_contents(&folder)?;
    names.iter_mut().filter(|name| *name == LATER).for_each(|name| name.clone_from(&later));
    names.retain(|name| name != "sw.js");
    names.sort();
    seal(&folder, &names, &later)?;
    // For those who host it; the page does not need it.
    licences::beside_page(&folder)?;
    let size: u64 =
        names.iter().map(|name| fs::metadata(folder.join(name)).map_or(0, |data| data.len())).sum();
    println!("{}: {} files, {} kB", folder.display(), names.len() + 1, size / 1_000);
    Ok(folder)
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::copy(from, to).with_context(|| format!("cannot copy {} to {}", from.display(), to.display()))?;
    Ok(())
}

fn hexadecimal(hasher: Sha256) -> String {
    hasher.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}

/// Gives the large file a name that changes with its contents, and returns it.
fn name_by_contents(folder: &Path) -> Result<String> {
    let path = folder.join(LATER);
    let contents = fs::read(&path).with_context(|| format!("the page has no {LATER}"))?;
    let hash = hexadecimal(Sha256::new().chain_update(contents));
    let name = LATER.replace('.', &format!("-{hash}."));
    fs::rename(&path, folder.join(&name))?;
    for user in NAMES_LATER {
        let path = folder.join(user);
        let text = fs::read_to_string(&path).with_context(|| format!("the page has no {user}"))?;
        let quoted = format!("'{LATER}'");
        ensure!(text.contains(&quoted), "{user} does not name {quoted}");
        fs::write(path, text.replace(&quoted, &format!("'{name}'")))?;
    }
    Ok(name)
}

/// Tells the service worker the files, and a version that changes with any of them.
fn seal(folder: &Path, names: &[String], later: &str) -> Result<()> {
    let mut hasher = Sha256::new();
    for name in names {
        hasher.update(name.as_bytes());
        hasher.update(fs::read(folder.join(name))?);
    }
    let version = hexadecimal(hasher);
    let path = folder.join("sw.js");
    let text = fs::read_to_string(&path).context("the page has no sw.js")?;
    let at_once: Vec<_> = names.iter().filter(|name| *name != later).collect();
    let list = serde_json::to_string(&at_once)?;
    fs::write(path, text.replacen(VERSION, &version, 1).replacen(FILES, &list, 1))?;
    Ok(())
}
