//! The chunks of a WAV file of others, as hound reads them: it takes no chunk of odd length before the samples, and believes the
//! length that a recorder wrote before it was interrupted.

use std::fs::File;
use std::io::{BufReader, Chain, Cursor, Read, Seek, SeekFrom, Take};
use std::path::Path;

use hound::WavReader;

use super::Unreadable;

/// A header that hound understands, and the samples.
type Source = Chain<Cursor<Vec<u8>>, Take<BufReader<File>>>;

/// Longest description of the format, bytes; the largest in use has 40.
const FORMAT_MOST: u32 = 1_024;
/// From here on a length that the file does not have stands for one that the program did not know: some write this into a pipe, some
/// the largest number.
const UNKNOWN: u32 = 0x7FFF_0000;

/// A reader of the samples. What is no WAV file is hound's to refuse.
pub fn open(path: &Path) -> Result<WavReader<Source>, Unreadable> {
    let mut file = BufReader::new(File::open(path).map_err(Unreadable::Read)?);
    let about = file.get_ref().metadata().map_err(Unreadable::Read)?;
    // In a pipe nobody can go back.
    let found = if about.is_file() { samples(&mut file, about.len()) } else { None };
    let (header, length) = match found {
        Some(found) => found,
        None => {
            if about.is_file() {
                file.seek(SeekFrom::Start(0)).map_err(Unreadable::Read)?;
            }
            (Vec::new(), u64::MAX)
        }
    };
    Ok(WavReader::new(Cursor::new(header).chain(file.take(length)))?)
}

/// Goes to the samples: a short header for them, and how many bytes there are; `None` where the chunks lead nowhere.
fn samples(file: &mut BufReader<File>, size: u64) -> Option<(Vec<u8>, u64)> {
    let mut head = [0; 12];
    file.read_exact(&mut head).ok()?;
    if !(head.starts_with(b"RIFF") && head.ends_with(b"WAVE")) {
        return None;
    }
    let whole = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    let mut format: Option<Vec<u8>> = None;
    loop {
        let mut chunk = [0; 8];
        file.read_exact(&mut chunk).ok()?;
        let [a, b, c, d, length @ ..] = chunk;
        let length = u32::from_le_bytes(length);
        match (&[a, b, c, d], &format) {
            (b"fmt ", _) if length <= FORMAT_MOST => {
                let mut text = vec![0; length as usize];
                file.read_exact(&mut text).ok()?;
                file.seek_relative(i64::from(length & 1)).ok()?;
                format = Some(text);
            }
            (b"data", Some(format)) => {
                let left = size.saturating_sub(file.stream_position().ok()?);
                let frame = u64::from(u16::from_le_bytes([*format.get(12)?, *format.get(13)?])).max(1);
                // A recorder that was interrupted wrote no lengths yet: not that of the whole file either.
                let is_interrupted = length == 0 && u64::from(whole) <= size - left;
                let is_unknown = length >= UNKNOWN && u64::from(length) > left;
                let length = match is_interrupted || is_unknown {
                    true => u32::try_from(left - left % frame).ok()?,
                    false => length,
                };
                let mut header = [&head[..], b"fmt ", &(format.len() as u32).to_le_bytes(), format].concat();
                header.extend([&b"data"[..], &length.to_le_bytes()].concat());
                return Some((header, u64::from(length)));
            }
            // A chunk of odd length has a byte after it that does not count.
            _ => file.seek_relative(i64::from(length) + i64::from(length & 1)).ok()?,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
        let pad: &[u8] = if content.len() % 2 == 1 { &[0] } else { &[] };
        [&name[..], &(content.len() as u32).to_le_bytes(), content, pad].concat()
    }

    /// A file of three samples of 16 bits, with other chunks before them, and this length written before them.
    fn file(before: &[u8], length: u32) -> Vec<u8> {
        let format = [1_u16, 1, 48_000, 0, 30_464, 1, 2, 16].map(u16::to_le_bytes).concat();
        let samples = [100_i16, -200, 300].map(i16::to_le_bytes).concat();
        let data = [&b"data"[..], &length.to_le_bytes(), &samples].concat();
        let chunks = [before.to_vec(), chunk(b"fmt ", &format), data].concat();
        // Who is interrupted has not come to the length of the whole file.
        let whole = if length == 0 { 0 } else { 4 + chunks.len() as u32 };
        [b"RIFF".to_vec(), whole.to_le_bytes().to_vec(), b"WAVE".to_vec(), chunks].concat()
    }

    #[test]
    fn chunks_of_odd_length_and_unknown_lengths_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.wav");
        let odd = [chunk(b"bext", &[7; 603]), chunk(b"JUNK", &[1]), chunk(b"LIST", b"INFO!")].concat();
        for (before, length) in [(&odd[..], 6), (&[], 6), (&odd, 0), (&[], UNKNOWN), (&odd, u32::MAX)] {
            fs::write(&path, file(before, length)).unwrap();
            let mut reader = open(&path).unwrap_or_else(|error| panic!("{}: {error}", before.len()));
            assert_eq!((reader.spec().sample_rate, reader.duration()), (48_000, 3), "{length}");
            let samples: Vec<i16> = reader.samples().map(Result::unwrap).collect();
            assert_eq!(samples, [100, -200, 300]);
        }
        // A file without samples has none, whatever follows.
        let mut empty = file(&odd, 0);
        empty.truncate(empty.len() - 6);
        empty.extend(chunk(b"LIST", b"INFO"));
        let whole = (empty.len() as u32 - 8).to_le_bytes();
        empty[4..8].copy_from_slice(&whole);
        fs::write(&path, &empty).unwrap();
        assert_eq!(open(&path).unwrap().duration(), 0);
        // Cut short, it is refused as before.
        fs::write(&path, file(&odd, 600)).unwrap();
        assert!(open(&path).unwrap().samples::<i16>().any(|sample| sample.is_err()));
        for wrong in [&b""[..], b"RIFF", b"RIFFxxxxWAVEdata\x06\0\0\0", b"RIFFxxxxWAVEfmt \xff\xff\xff\xff"] {
            fs::write(&path, wrong).unwrap();
            assert!(open(&path).is_err(), "{wrong:?}");
        }
    }
}
