//! Writes WAV files: 16 or 24 bit integers, rounded to nearest without dither, or unchanged 32 bit floats. Reads those of
//! others.

mod riff;

use hound::{SampleFormat, WavSpec, WavWriter};
use std::io::{BufWriter, Seek, Write};
use std::ops::Range;
use std::path::Path;

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 16 bit integer.
    Int16,
    /// 24 bit integer.
    Int24,
    /// 32 bit float; nothing is rounded or clipped.
    Float32,
}

/// Why a WAV file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WavError {
    /// The file would be larger than 4 GB; its header has 32 bits for sizes.
    #[error(
        "{seconds:.0} s at this rate and depth need {gigabytes:.1} GB, a WAV file holds 4; render less, at a lower rate or fewer bits"
    )]
    TooLong {
        /// Requested length, s.
        seconds: f64,
        /// The size of the file, GB.
        gigabytes: f64,
    },
    /// The system reports an error.
    #[error("cannot write the WAV file: {0}")]
    Write(#[from] hound::Error),
}

/// Level of the samples in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Levels {
    /// Largest magnitude, full scale 1.
    pub peak: f32,
    /// Root mean square over the whole file and all channels, full scale 1.
    pub rms: f32,
    /// Number of samples clipped at full scale, of all channels; 0 for floats.
    pub clipped: u64,
    /// Root mean square of the loudest 0.05 s after [`BEGINNING_S`], full scale 1; `None` if the file ends before.
    pub after_beginning: Option<f32>,
}

/// Time that the tongue's puff and what rings after it may take, s.
pub const BEGINNING_S: f64 = 0.5;

/// Time over which the level after the beginning is averaged, s: several periods of the lowest note.
const WINDOW_S: f64 = 0.05;

/// Measures the level of samples on their way.
pub struct LevelMeter {
    level: Levels,
    /// Sum of the squares, and how many.
    power: (f64, u64),
    /// The same for the window that goes on, which begins after the beginning.
    window: (f64, u64),
    /// Samples of all channels in a second.
    in_one_s: f64,
}

impl LevelMeter {
    /// For `channels` channels at `rate` Hz.
    pub fn new(rate: u32, channels: u16) -> Self {
        let in_one_s = f64::from(rate) * f64::from(channels);
        Self { level: Levels::default(), power: (0.0, 0), window: (0.0, 0), in_one_s }
    }

    /// Hears the next sample: of each moment that of every channel.
    pub fn hear(&mut self, sample: f32) {
        self.level.peak = self.level.peak.max(sample.abs());
        let square = f64::from(sample).powi(2);
        self.power = (self.power.0 + square, self.power.1 + 1);
        if (self.power.1 as f64) <= BEGINNING_S * self.in_one_s {
            return;
        }
        self.window = (self.window.0 + square, self.window.1 + 1);
        if self.window.1 as f64 >= WINDOW_S * self.in_one_s {
            let rms = (self.window.0 / self.window.1 as f64).sqrt() as f32;
            self.level.after_beginning =
                Some(self.level.after_beginning.map_or(rms, |loudest| loudest.max(rms)));
            self.window = (0.0, 0);
        }
    }

    /// Levels until now.
    pub fn levels(&self) -> Levels {
        Levels { rms: (self.power.0 / self.power.1.max(1) as f64).sqrt() as f32, ..self.level }
    }
}

/// A WAV file that is being written.
pub struct WavFile<W: Write + Seek> {
    writer: WavWriter<BufWriter<W>>,
    depth: Depth,
    channels: u16,
    meter: LevelMeter,
    /// Samples clipped.
    clipped: u64,
}

impl<W: Write + Seek> WavFile<W> {
    /// Writes the header of a file at `rate` Hz. Fails if `samples` samples per channel would not fit.
    pub fn new(file: W, rate: u32, depth: Depth, channels: u16, samples: usize) -> Result<Self, WavError> {
        let (bits_per_sample, sample_format) = match depth {
            Depth::Int16 => (16, SampleFormat::Int),
            Depth::Int24 => (24, SampleFormat::Int),
            Depth::Float32 => (32, SampleFormat::Float),
        };
        let bytes = samples as f64 * f64::from(channels) * f64::from(bits_per_sample / 8);
        if bytes > f64::from(u32::MAX) - 4096.0 {
            return Err(WavError::TooLong {
                seconds: samples as f64 / f64::from(rate),
                gigabytes: bytes / 1e9,
            });
        }
        let spec = WavSpec { channels, sample_rate: rate, bits_per_sample, sample_format };
        let writer = WavWriter::new(BufWriter::new(file), spec)?;
        Ok(Self { writer, depth, channels, meter: LevelMeter::new(rate, channels), clipped: 0 })
    }

    /// Appends one block: a mono sound, which goes to every channel, or the channels.
    pub fn write(&mut self, block: &[&[f32]]) -> Result<(), WavError> {
        for (at, &first) in block.first().into_iter().flat_map(|first| first.iter()).enumerate() {
            for channel in 0..usize::from(self.channels) {
                let sample = block.get(channel).map_or(first, |samples| samples[at]);
                self.meter.hear(sample);
                match self.depth {
                    Depth::Int16 => self.writer.write_sample(round(sample, 32_767.0))?,
                    Depth::Int24 => self.writer.write_sample(round(sample, 8_388_607.0))?,
                    Depth::Float32 => self.writer.write_sample(sample)?,
                }
                self.clipped += u64::from(self.depth != Depth::Float32 && sample.abs() > 1.0);
            }
        }
        Ok(())
    }

    /// Completes the header.
    pub fn finish(self) -> Result<Levels, WavError> {
        self.writer.finalize()?;
        Ok(Levels { clipped: self.clipped, ..self.meter.levels() })
    }
}

/// Whether a file is a sound of this length, s, at `rate` Hz that can be read to its last sample. The length may be off by a tenth of a
/// millisecond, as tables have it.
pub fn is_whole(path: &Path, seconds: f64, rate: u32) -> bool {
    let Ok(mut reader) = hound::WavReader::open(path) else { return false };
    let (spec, length) = (reader.spec(), reader.duration());
    let is_long = (f64::from(length) / f64::from(rate) - seconds).abs() < 1e-4;
    if spec.sample_rate != rate || !is_long {
        return false;
    }
    let Some(last) = length.checked_sub(1) else { return true };
    reader.seek(last).is_ok()
        && match spec.sample_format {
            SampleFormat::Int => reader.samples::<i32>().all(|sample| sample.is_ok()),
            SampleFormat::Float => reader.samples::<f32>().all(|sample| sample.is_ok()),
        }
}

/// A recording that was read.
pub struct Recording {
    /// Sample rate, Hz.
    pub rate: u32,
    /// Channels of the file.
    pub channels: u16,
    /// Length of the file, s.
    pub seconds: f64,
    /// One channel, or the mean of all; full scale 1.
    pub samples: Vec<f64>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// It is damaged, or of another format.
    #[error(
        "not a WAV file that can be read ({0}): it is damaged, cut short, or of another format, which has to be converted first, for example with ffmpeg -i FILE sound.wav"
    )]
    Format(hound::Error),
    /// The system reports an error.
    #[error("cannot be read: {0}")]
    Read(std::io::Error),
    /// Nothing is played that slowly.
    #[error("the file has a sample rate of {0} Hz; from 1000 Hz on it can be measured")]
    Rate(u32),
    /// There is no such channel.
    #[error("the file has {has} channel{}, and channel {wanted} is asked for", if *has == 1 { "" } else { "s" })]
    Channel {
        /// Counted from 1.
        wanted: u16,
        /// As many as there are.
        has: u16,
    },
    /// Nothing lies between the times.
    #[error("the file has {seconds:.2} s, and nothing of it lies between {from_s} s and {to_s} s")]
    Nothing {
        /// Length of the file, s.
        seconds: f64,
        /// Asked for, s.
        from_s: f64,
        /// Asked for, s.
        to_s: f64,
    },
    /// A sample is NaN or infinite.
    #[error("the sample at {at_s:.3} s is no number; measure a part without it")]
    NotANumber {
        /// Where, s.
        at_s: f64,
    },
}

impl From<hound::Error> for Unreadable {
    fn from(error: hound::Error) -> Self {
        match error {
            // The system's own errors have a number; that a file ends too soon is the reader's.
            hound::Error::IoError(error) if error.raw_os_error().is_some() => Self::Read(error),
            error => Self::Format(error),
        }
    }
}

/// Reads one channel (counted from 1), or the mean of all, from one time to another, s: integers of 8, 16, 24 or 32 bits, or floats
/// of 32.
pub fn read(path: &Path, channel: Option<u16>, from_s: f64, to_s: f64) -> Result<Recording, Unreadable> {
    let mut reader = riff::open(path)?;
    let WavSpec { channels, sample_rate: rate, bits_per_sample, sample_format } = reader.spec();
    if rate < 1_000 {
        return Err(Unreadable::Rate(rate));
    }
    if let Some(wanted) = channel.filter(|channel| !(1..=channels).contains(channel)) {
        return Err(Unreadable::Channel { wanted, has: channels });
    }
    let (length, per_s) = (reader.duration(), f64::from(rate));
    let seconds = f64::from(length) / per_s;
    let at = |s: f64| (s * per_s).round().clamp(0.0, f64::from(length)) as usize;
    let frames = at(from_s)..at(to_s);
    if frames.is_empty() {
        return Err(Unreadable::Nothing { seconds, from_s, to_s });
    }
    let samples = match sample_format {
        SampleFormat::Float => one_channel(
            reader.samples::<f32>().map(|sample| sample.map(f64::from)),
            &frames,
            channels,
            channel,
        ),
        SampleFormat::Int => {
            let full = f64::from(bits_per_sample.saturating_sub(1)).exp2();
            let scaled = reader.samples::<i32>().map(|sample| sample.map(|sample| f64::from(sample) / full));
            one_channel(scaled, &frames, channels, channel)
        }
    }?;
    match samples.iter().position(|sample| !sample.is_finite()) {
        Some(at) => Err(Unreadable::NotANumber { at_s: (frames.start + at) as f64 / per_s }),
        None => Ok(Recording { rate, channels, seconds, samples }),
    }
}

/// A channel, or the mean of all, of these frames. What lies before them is read and dropped: the reader seeks wrongly where samples
/// have more bytes than bits.
fn one_channel(
    samples: impl Iterator<Item = hound::Result<f64>>,
    frames: &Range<usize>,
    channels: u16,
    channel: Option<u16>,
) -> hound::Result<Vec<f64>> {
    let of_a_frame = usize::from(channels);
    let mut frame_values = Vec::with_capacity(frames.len());
    let mut samples = samples.skip(frames.start * of_a_frame);
    for _ in frames.clone() {
        let mut value = 0.0;
        for (number, sample) in (1..=channels).zip(samples.by_ref()) {
            let sample = sample?;
            match channel {
                None => value += sample / f64::from(channels),
                Some(channel) if channel == number => value = sample,
                Some(_) => {}
            }
        }
        frame_values.push(value);
    }
    Ok(frame_values)
}

/// Scales -1..=1 to integer full scale, rounds to nearest and clips.
fn round(sample: f32, full_scale: f64) -> i32 {
    (f64::from(sample).clamp(-1.0, 1.0) * full_scale).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::NewFile;

    fn written(depth: Depth, channels: u16) -> (Levels, hound::WavReader<std::io::BufReader<std::fs::File>>) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.wav");
        let mut file = NewFile::create(&path, false).unwrap();
        let mut wav = WavFile::new(&mut file, 48_000, depth, channels, 4).unwrap();
        wav.write(&[&[0.5, -1.0]]).unwrap();
        wav.write(&[&[1.5, 0.0]]).unwrap();
        let level = wav.finish().unwrap();
        file.keep().unwrap();
        (level, hound::WavReader::open(&path).unwrap())
    }

    #[test]
    fn integers_round_and_clipping_is_counted() {
        let (level, mut reader) = written(Depth::Int16, 2);
        assert_eq!((level.peak, level.clipped), (1.5, 2));
        let samples: Vec<i32> = reader.samples().map(Result::unwrap).collect();
        assert_eq!(samples, [16_384, 16_384, -32_767, -32_767, 32_767, 32_767, 0, 0]);
        let (_, mut reader) = written(Depth::Int24, 1);
        let samples: Vec<i32> = reader.samples().map(Result::unwrap).collect();
        assert_eq!(samples, [4_194_304, -8_388_607, 8_388_607, 0]);
    }

    #[test]
    fn two_channels_have_their_own_samples() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.wav");
        let mut file = NewFile::create(&path, false).unwrap();
        let mut wav = WavFile::new(&mut file, 48_000, Depth::Float32, 2, 2).unwrap();
        wav.write(&[&[0.1, 0.2], &[0.3, -0.4]]).unwrap();
        let levels = wav.finish().unwrap();
        assert_eq!(levels.peak, 0.4);
        assert!((levels.rms - (0.3_f32 / 4.0).sqrt()).abs() < 1e-6, "{levels:?}");
        file.keep().unwrap();
        let mut reader = hound::WavReader::open(&path).unwrap();
        let samples: Vec<f32> = reader.samples().map(Result::unwrap).collect();
        assert_eq!(samples, [0.1, 0.3, 0.2, -0.4]);
    }

    #[test]
    fn the_level_after_the_beginning_is_that_of_its_loudest_part() {
        let directory = tempfile::tempdir().unwrap();
        let levels = |seconds: f64, sound: &dyn Fn(f64) -> f32| {
            let mut file = NewFile::create(&directory.path().join("x.wav"), true).unwrap();
            let samples: Vec<f32> =
                (0..(1e3 * seconds) as u32).map(|ms| sound(f64::from(ms) / 1e3)).collect();
            let mut wav = WavFile::new(&mut file, 1_000, Depth::Float32, 2, samples.len()).unwrap();
            wav.write(&[&samples]).unwrap();
            wav.finish().unwrap().after_beginning
        };
        assert_eq!(levels(0.5, &|_| 0.5), None);
        assert_eq!(levels(2.0, &|s| if s < BEGINNING_S { 0.5 } else { 0.0 }), Some(0.0));
        assert_eq!(levels(2.0, &|s| if s < 1.0 { 0.5 } else { 0.25 }), Some(0.5));
    }

    #[test]
    fn floats_stay_as_they_are() {
        let (level, mut reader) = written(Depth::Float32, 1);
        assert_eq!((level.peak, level.clipped), (1.5, 0));
        let samples: Vec<f32> = reader.samples().map(Result::unwrap).collect();
        assert_eq!(samples, [0.5, -1.0, 1.5, 0.0]);
    }

    #[test]
    fn a_sound_that_is_cut_off_is_not_whole() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.wav");
        for depth in [Depth::Int16, Depth::Int24, Depth::Float32] {
            let mut file = NewFile::create(&path, true).unwrap();
            let mut wav = WavFile::new(&mut file, 48_000, depth, 2, 480).unwrap();
            wav.write(&[&[0.25; 480]]).unwrap();
            wav.finish().unwrap();
            file.keep().unwrap();
            assert!(is_whole(&path, 0.01, 48_000), "{depth:?}");
            assert!(!is_whole(&path, 0.011, 48_000) && !is_whole(&path, 0.01, 44_100), "{depth:?}");
            let bytes = std::fs::read(&path).unwrap();
            for length in [bytes.len() - 1, 100, 0] {
                std::fs::write(&path, &bytes[..length]).unwrap();
                assert!(!is_whole(&path, 0.01, 48_000), "{depth:?}, {length} bytes");
            }
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("x.wav");
        for (depth, step) in [(Depth::Int16, 3.1e-5), (Depth::Int24, 1.3e-7), (Depth::Float32, 1e-9)] {
            let mut file = NewFile::create(&path, true).unwrap();
            let mut wav = WavFile::new(&mut file, 48_000, depth, 2, 480).unwrap();
            let left: Vec<f32> = (0..480).map(|n| n as f32 / 960.0).collect();
            wav.write(&[&left, &[-0.25; 480]]).unwrap();
            wav.finish().unwrap();
            file.keep().unwrap();
            let right = read(&path, Some(2), 0.0, 1.0).unwrap();
            assert_eq!((right.rate, right.channels, right.samples.len()), (48_000, 2, 480));
            assert!(right.samples.iter().all(|sample| (sample + 0.25).abs() < step), "{depth:?}");
            let part = read(&path, None, 0.005, 0.006).unwrap();
            assert_eq!(part.samples.len(), 48);
            assert!((part.samples[0] - 0.5 * (0.25 - 0.25)).abs() < step, "{depth:?}");
            assert!((part.samples[47] - 0.5 * (287.0 / 960.0 - 0.25)).abs() < step, "{depth:?}");
            assert!(matches!(read(&path, Some(3), 0.0, 1.0), Err(Unreadable::Channel { wanted: 3, has: 2 })));
            assert!(matches!(read(&path, None, 1.0, 2.0), Err(Unreadable::Nothing { .. })));
            let bytes = std::fs::read(&path).unwrap();
            for length in [bytes.len() - 1, 30, 0] {
                std::fs::write(&path, &bytes[..length]).unwrap();
                assert!(
                    matches!(read(&path, None, 0.0, 1.0), Err(Unreadable::Format(_))),
                    "{depth:?}, {length} bytes"
                );
            }
        }
        // 24 bits in four bytes, mono, extensible: 0.5, then -0.25.
        let mut bytes = b"RIFF\x9c\0\0\0WAVEfmt \x28\0\0\0\xfe\xff\x01\0\x80\xbb\0\0\0\xee\x02\0\x04\0\x20\0\x16\0\x18\0\x04\0\0\0".to_vec();
        bytes.extend(b"\x01\0\0\0\0\0\x10\0\x80\0\0\xaa\0\x38\x9b\x71data\x60\0\0\0");
        let sample = |n: i32| if n < 12 { 0x40_0000 } else { -0x20_0000_i32 };
        bytes.extend((0..24).flat_map(|n| sample(n).to_le_bytes()));
        std::fs::write(&path, bytes).unwrap();
        let part = read(&path, None, 10.0 / 48_000.0, 1.0).unwrap();
        assert_eq!(part.samples, [[0.5; 2].as_slice(), &[-0.25; 12]].concat());
        let mut file = NewFile::create(&path, true).unwrap();
        let mut wav = WavFile::new(&mut file, 48_000, Depth::Float32, 1, 3).unwrap();
        wav.write(&[&[0.0, f32::NAN, 0.0]]).unwrap();
        wav.finish().unwrap();
        file.keep().unwrap();
        assert!(matches!(read(&path, None, 0.0, 1.0), Err(Unreadable::NotANumber { .. })));
        std::fs::write(&path, "ID3 and not a WAV file at all, as one sees").unwrap();
        assert!(matches!(read(&path, None, 0.0, 1.0), Err(Unreadable::Format(_))));
        assert!(matches!(read(&directory.path().join("no.wav"), None, 0.0, 1.0), Err(Unreadable::Read(_))));
    }

    #[test]
    fn four_gigabytes_are_too_much() {
        let directory = tempfile::tempdir().unwrap();
        let mut file = NewFile::create(&directory.path().join("x.wav"), false).unwrap();
        let refused = WavFile::new(&mut file, 48_000, Depth::Float32, 2, 600_000_000).map(|_| ());
        assert!(matches!(refused, Err(WavError::TooLong { .. })));
    }
}
