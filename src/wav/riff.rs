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
/// What programs write as the length of samples whose number they do not know.
const UNKNOWN: u32 = u32::MAX;

/// A reader of the samples. What is no WAV file is hound's to refuse.
pub fn open(path: &Path) -> Result<WavReader<Source>, Unreadable> {
    let mut file = BufReader::new(File::open(path).map_err(Unreadable::Read)?);
    let size = file.get_ref().metadata().map_err(Unreadable::Read)?.len();
    let (header, length) = match samples(&mut file, size) {
        Some(found) => found,
        None => {
            file.seek(SeekFrom::Start(0)).map_err(Unreadable::Read)?;
            (Vec::new(), size)
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
                let length = match length {
                    // An interrupted recorder, or one that wrote into a pipe.
                    0 | UNKNOWN => u32::try_from(left - left % frame).ok()?,
                    length => length,
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
        [b"RIFF".to_vec(), (4 + chunks.len() as u32).to_le_bytes().to_vec(), b"WAVE".to_vec(), chunks]
            .concat()
    }

    #[test]
    fn chunks_of_odd_length_and_unknown_lengths_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.wav");
        let odd = [chunk(b"bext", &[7; 603]), chunk(b"JUNK", &[1]), chunk(b"LIST", b"INFO!")].concat();
        for (before, length) in [(&odd[..], 6), (&[], 6), (&odd, 0), (&[], UNKNOWN), (&odd, UNKNOWN)] {
            fs::write(&path, file(before, length)).unwrap();
            let mut reader = open(&path).unwrap_or_else(|error| panic!("{}: {error}", before.len()));
            assert_eq!((reader.spec().sample_rate, reader.duration()), (48_000, 3), "{length}");
            let samples: Vec<i16> = reader.samples().map(Result::unwrap).collect();
            assert_eq!(samples, [100, -200, 300]);
        }
        // Cut short, it is refused as before.
        fs::write(&path, file(&odd, 600)).unwrap();
        assert!(open(&path).unwrap().samples::<i16>().any(|sample| sample.is_err()));
        for wrong in [&b""[..], b"RIFF", b"RIFFxxxxWAVEdata\x06\0\0\0", b"RIFFxxxxWAVEfmt \xff\xff\xff\xff"] {
            fs::write(&path, wrong).unwrap();
            assert!(open(&path).is_err(), "{wrong:?}");
        }
    }
}
