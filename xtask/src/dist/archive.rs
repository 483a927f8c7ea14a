//! Archives whose bytes depend on their content alone: entries in the given order, one time, no owner.

use std::fs::File;
use std::io::{Cursor, Write};
use std::path::Path;

use anyhow::{Context, Result};
use flate2::{Compression, GzBuilder};
use tar::{EntryType, Header};
use time::PrimitiveDateTime;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::contents::Entry;
use super::{Release, System};

/// The name of a system's archive: Windows opens zip files by itself.
pub fn name(system: System, release: &Release) -> String {
    format!("{}.{}", folder(system, release), if zipped(system) { "zip" } else { "tar.gz" })
}

/// The one folder in the archive.
pub fn folder(system: System, release: &Release) -> String {
    format!("chalumeau-{}-{}", release.version, system.name)
}

fn zipped(system: System) -> bool {
    system.name.starts_with("windows")
}

/// Writes the entries as the kind of archive that the path's name tells.
pub fn write(path: &Path, entries: &[Entry], release: &Release) -> Result<()> {
    let zipped = path.extension().is_some_and(|extension| extension == "zip");
    let bytes = if zipped { zip(entries, release)? } else { tar(entries, release)? };
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()));
    Ok(file?.write_all(&bytes)?)
}

/// gzip without a name and without a time; as hard as it can.
pub fn gzip(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut gzip = GzBuilder::new().write(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(gzip.finish()?)
}

fn tar(entries: &[Entry], release: &Release) -> Result<Vec<u8>> {
    let mut archive = tar::Builder::new(Vec::new());
    for entry in entries {
        let mut header = Header::new_gnu();
        header.set_entry_type(EntryType::Regular);
        header.set_size(entry.bytes.len() as u64);
        header.set_mode(entry.mode());
        header.set_mtime(release.epoch);
        header.set_uid(0);
        header.set_gid(0);
        archive.append_data(&mut header, &entry.path, entry.bytes.as_slice())?;
    }
    gzip(&archive.into_inner()?)
}

fn zip(entries: &[Entry], release: &Release) -> Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let time = dos_time(release)?;
    for entry in entries {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(time)
            .unix_permissions(entry.mode());
        archive.start_file(&entry.path, options)?;
        archive.write_all(&entry.bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

/// The time as zip has it: years from 1980 to 2107, in steps of two seconds, in no zone.
fn dos_time(release: &Release) -> Result<DateTime> {
    let time = release.time()?;
    Ok(DateTime::try_from(PrimitiveDateTime::new(time.date(), time.time()))?)
}
