//! Writes the golden frames of the knob's protocol to `firmware/golden`: frames that every implementation must read
//! alike, good ones, and bad ones with what is wrong with them. The Rust and the C++ tests read them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::wire_vectors::frames::{frames, sysex};
use crate::wire_vectors::golden_frame::list;

mod frames;
mod golden_frame;
mod messages;

const FOLDER: &str = "firmware/golden";

/// Every file that belongs into the folder, by name.
fn files() -> BTreeMap<String, Vec<u8>> {
    let (frames, sysex) = (frames(), sysex());
    let lists = [("list.tsv", list(&frames)), ("midi.tsv", list(&sysex))];
    let lists = lists.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    frames.into_iter().chain(sysex).map(|frame| (frame.file, frame.bytes)).chain(lists).collect()
}

/// Writes the files, or with `--check` compares them byte for byte. With `--check` an additional file is an error too.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire_vectors::golden_frame::{COLUMNS, GoldenFrame};
    use chalumeau_knob::wire::frame::{Decoder, FrameError, MAX_ENCODED};
    use chalumeau_knob::wire::midi::{FromKnob, MidiReceiver};
    use chalumeau_knob::wire::{Message, encode};

    /// Compares a golden frame with what a decoder made of it.
    fn judge(golden: &GoldenFrame, found: &[Result<(u8, Message), FrameError>]) {
        let file = &golden.file;
        assert_eq!(found.len(), 1, "{file}: {found:?}");
        match (&found[0], golden.head) {
            (Ok((seq, message)), Some(head)) => {
                assert_eq!((golden.verdict, head), ("ok", (message.kind(), *seq)), "{file}");
                assert_eq!(golden.message, Some(*message), "{file}");
            }
            (Ok(_), None) => panic!("{file} was read"),
            (Err(error), _) => {
                assert_eq!(error.verdict(), golden.verdict, "{file}: {error}");
                let (head, field) = match *error {
                    FrameError::Range { kind, seq, reason, .. } => (Some((kind, seq)), Some(reason.field)),
                    FrameError::Magic { seq, .. } => (Some((0x01, seq)), Some("magic")),
                    FrameError::UnknownType { kind, seq } => (Some((kind, seq)), None),
                    FrameError::ShortPayload { seq, .. } => (golden.head.map(|(kind, _)| (kind, seq)), None),
                    _ => (None, None),
                };
                assert_eq!((golden.head, golden.field), (head, field), "{file}: {error}");
            }
        }
    }

    #[test]
    fn every_frame_gets_its_verdict() {
        for golden in frames() {
            judge(&golden, &Decoder::new().feed(&golden.bytes).collect::<Vec<_>>());
        }
    }

    #[test]
    fn every_exclusive_message_gets_its_verdict() {
        for golden in sysex() {
            let mut found = Vec::new();
            MidiReceiver::new().feed(&golden.bytes, 0, |said| match said {
                FromKnob::Frame(frame) => found.push(frame),
                other => panic!("{}: {other:?}", golden.file),
            });
            judge(&golden, &found);
        }
    }

    #[test]
    fn the_codec_writes_every_golden_message_byte_for_byte() {
        for golden in frames().iter().filter(|golden| golden.writes) {
            let (Some((_, seq)), Some(message)) = (golden.head, golden.message) else {
                panic!("{}", golden.file)
            };
            assert_eq!(encode(&message, seq)[..], golden.bytes[..], "{}", golden.file);
            assert_eq!(message.check(), Ok(()), "{}", golden.file);
        }
    }

    #[test]
    fn names_are_unique_and_lines_have_all_columns() {
        for golden in [frames(), sysex()] {
            let mut names: Vec<_> = golden.iter().map(|one| one.file.clone()).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), golden.len());
            for line in list(&golden).lines() {
                assert_eq!(line.split('\t').count(), COLUMNS.split('\t').count(), "{line}");
            }
        }
    }

    #[test]
    fn golden_frames_include_every_type_and_the_longest_frame() {
        let golden = frames();
        for kind in [1, 2, 3, 4, 5, 6, 7, 8, 0x81, 0x82, 0x83] {
            assert!(golden.iter().any(|v| v.verdict == "ok" && v.head.is_some_and(|head| head.0 == kind)));
        }
        let longest = golden.iter().filter(|v| v.verdict == "ok").map(|v| v.bytes.len()).max();
        assert_eq!(longest, Some(MAX_ENCODED));
    }
}
