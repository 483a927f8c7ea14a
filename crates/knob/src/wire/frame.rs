//! Frames of TTLink 1: type, sequence number, payload and checksum, COBS between zeros.
//!
//! The decoder accepts any bytes at any time. After damage it still receives every frame whose own bytes and both zeros
//! around them are intact, whatever came before. Source of the algorithms: Cheshire & Baker, COBS
//! (1999), by crate `cobs`; CRC-32/ISO-HDLC by crate `crc`.

use std::ops::Deref;

use crc::{CRC_32_ISO_HDLC, Crc};

use crate::wire::limits::OutOfRange;
use crate::wire::message::Message;
use crate::wire::payload;

/// Longest frame between the zeros once decoded, bytes.
pub const MAX_DECODED: usize = 64;
/// Type, sequence number and checksum.
pub const OVERHEAD: usize = 6;
/// Longest payload, bytes.
pub const MAX_PAYLOAD: usize = MAX_DECODED - OVERHEAD;
/// Longest frame on the wire between its zeros: COBS adds one byte.
pub const MAX_RUN: usize = MAX_DECODED + 1;
/// Longest frame on the wire with both zeros.
pub const MAX_ENCODED: usize = MAX_RUN + 2;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Why the bytes between two zeros are not a message, in the order of the checks.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// More bytes than a frame can have: noise, or a zero that was lost.
    #[error("{given} bytes in a row; no frame is that long")]
    TooLong {
        /// Bytes that came.
        given: usize,
    },
    /// COBS, or the packing of SysEx, announces more bytes than came.
    #[error("a frame that was cut short after {given} bytes")]
    CutShort {
        /// Bytes that came.
        given: usize,
    },
    /// Shorter than a message without payload.
    #[error("a frame of {given} bytes; the shortest has {OVERHEAD}")]
    TooShort {
        /// Bytes once decoded.
        given: usize,
    },
    /// The checksum is wrong.
    #[error("checksum {given:08x} received, {computed:08x} computed")]
    Checksum {
        /// As received.
        given: u32,
        /// As the bytes give it.
        computed: u32,
    },
    /// A type of a later version; receivers ignore it.
    #[error("message of unknown type {kind:#04x}")]
    UnknownType {
        /// Type byte.
        kind: u8,
        /// Sequence number.
        seq: u8,
    },
    /// A payload shorter than its type has.
    #[error("{message} with a payload of {given} bytes; it needs at least {least}")]
    ShortPayload {
        /// Name of the type.
        message: &'static str,
        /// Sequence number.
        seq: u8,
        /// Bytes of payload.
        given: usize,
        /// Bytes it should have.
        least: usize,
    },
    /// HELLO without its magic word.
    #[error("HELLO with the magic bytes {given:02x?} instead of `TTLK`")]
    Magic {
        /// Sequence number.
        seq: u8,
        /// As received.
        given: [u8; 4],
    },
    /// A field outside its range.
    #[error("{message}: {reason}")]
    Range {
        /// Type byte.
        kind: u8,
        /// Name of the type.
        message: &'static str,
        /// Sequence number.
        seq: u8,
        /// Field, value and range.
        reason: OutOfRange,
    },
}

impl FrameError {
    /// The word that the golden vectors and statistics use: `length`, `crc`, `unknown` or `range`.
    pub fn verdict(&self) -> &'static str {
        match self {
            Self::TooLong { .. }
            | Self::CutShort { .. }
            | Self::TooShort { .. }
            | Self::ShortPayload { .. } => "length",
            Self::Checksum { .. } => "crc",
            Self::UnknownType { .. } => "unknown",
            Self::Magic { .. } | Self::Range { .. } => "range",
        }
    }
}

/// Counts of one direction since its decoder was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WireStats {
    /// Messages received.
    pub frames: u64,
    /// Frames whose checksum did not fit.
    pub crc_errors: u64,
    /// Runs of bytes too long, too short or cut, and payloads too short.
    pub length_errors: u64,
    /// Frames refused because of a field.
    pub range_errors: u64,
    /// Frames of unknown type.
    pub unknown_types: u64,
    /// Times that the sequence number jumped.
    pub gaps: u64,
    /// Frames that those gaps amount to.
    pub lost: u64,
    /// Frames with the sequence number of the one before.
    pub duplicates: u64,
    /// Bytes, zeros aside, that were not part of a frame with a good checksum.
    pub skipped_bytes: u64,
}

/// Reads and counts frames after COBS or SysEx has been undone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Receiver {
    pub(super) stats: WireStats,
    last_seq: Option<u8>,
}

impl Receiver {
    /// Reads type..checksum. `on_wire` is how many bytes were spent on it.
    pub(super) fn receive(&mut self, frame: &[u8], on_wire: usize) -> Result<(u8, Message), FrameError> {
        let (kind, seq, payload) = open(frame).inspect_err(|error| self.count(error, on_wire))?;
        if let Some(last) = self.last_seq {
            match seq.wrapping_sub(last) {
                0 => self.stats.duplicates += 1,
                1 => {}
                step => {
                    self.stats.gaps += 1;
                    self.stats.lost += u64::from(step) - 1;
                }
            }
        }
        self.last_seq = Some(seq);
        let message = payload::read(kind, seq, payload).inspect_err(|error| self.count(error, 0))?;
        self.stats.frames += 1;
        Ok((seq, message))
    }

    pub(super) fn count(&mut self, error: &FrameError, skipped_bytes: usize) {
        match error.verdict() {
            "crc" => self.stats.crc_errors += 1,
            "range" => self.stats.range_errors += 1,
            "unknown" => self.stats.unknown_types += 1,
            _ => self.stats.length_errors += 1,
        }
        self.stats.skipped_bytes += skipped_bytes as u64;
    }
}

/// Type, sequence number and payload of type..checksum.
fn open(frame: &[u8]) -> Result<(u8, u8, &[u8]), FrameError> {
    let given = frame.len();
    let (body, checksum) = frame.split_last_chunk::<4>().ok_or(FrameError::TooShort { given })?;
    let [kind, seq, payload @ ..] = body else { return Err(FrameError::TooShort { given }) };
    let (given, computed) = (u32::from_le_bytes(*checksum), CRC.checksum(body));
    if given != computed {
        return Err(FrameError::Checksum { given, computed });
    }
    Ok((*kind, *seq, payload))
}

/// A frame before COBS or SysEx packing: type, sequence number, payload and checksum.
#[derive(Clone, Copy, Debug)]
pub struct FrameBody {
    bytes: [u8; MAX_DECODED],
    length: usize,
}

impl FrameBody {
    /// The body of `message`. Fields outside their range are written as they are. Real-time safe.
    pub fn new(message: &Message, seq: u8) -> Self {
        let mut bytes = [0; MAX_PAYLOAD];
        let length = payload::write(message, &mut bytes);
        Self::from_parts(message.kind(), seq, &bytes[..length])
    }

    /// A body of any type and payload, as a later version of the protocol might send it; for tests. Only the first
    /// [`MAX_PAYLOAD`] bytes of the payload are used. Real-time safe.
    pub fn from_parts(kind: u8, seq: u8, payload: &[u8]) -> Self {
        let payload = &payload[..payload.len().min(MAX_PAYLOAD)];
        let mut bytes = [0; MAX_DECODED];
        let end = 2 + payload.len();
        bytes[0] = kind;
        bytes[1] = seq;
        bytes[2..end].copy_from_slice(payload);
        let checksum = CRC.checksum(&bytes[..end]);
        bytes[end..end + 4].copy_from_slice(&checksum.to_le_bytes());
        Self { bytes, length: end + 4 }
    }

    /// The payload without type, sequence number and checksum.
    pub fn payload(&self) -> &[u8] {
        &self.bytes[2..self.length - 4]
    }

    /// With COBS and both zeros, as the serial line carries it. Real-time safe.
    pub fn framed(&self) -> EncodedFrame {
        let mut bytes = [0; MAX_ENCODED];
        // PANIC: COBS adds one byte to the first 254, so 64 bytes fit the 65 between the zeros.
        let length = cobs::encode(self, &mut bytes[1..=MAX_RUN]);
        EncodedFrame { bytes, length: length + 2 }
    }
}

impl Deref for FrameBody {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// A frame as it goes over the line, with the zeros before and behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodedFrame {
    bytes: [u8; MAX_ENCODED],
    length: usize,
}

impl Deref for EncodedFrame {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

/// Encodes any message. Fields outside their range are written as they are, and the receiver refuses them: call
/// [`Message::check`] first. Real-time safe.
pub fn encode(message: &Message, seq: u8) -> EncodedFrame {
    FrameBody::new(message, seq).framed()
}

/// Finds messages in a stream of bytes. Real-time safe.
#[derive(Clone, Debug)]
pub struct Decoder {
    run: [u8; MAX_RUN],
    /// Bytes since the last zero; may exceed what `run` holds.
    length: usize,
    receiver: Receiver,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A new decoder. It takes bytes before the first zero for the end of a damaged frame.
    pub fn new() -> Self {
        Self { run: [0; MAX_RUN], length: 0, receiver: Receiver::default() }
    }

    /// Takes one byte. A zero at the end of a frame returns the sequence number and the message, or the error.
    pub fn push(&mut self, byte: u8) -> Option<Result<(u8, Message), FrameError>> {
        if byte != 0 {
            if let Some(free) = self.run.get_mut(self.length) {
                *free = byte;
            }
            self.length = self.length.saturating_add(1);
            return None;
        }
        let given = std::mem::take(&mut self.length);
        if given == 0 {
            return None;
        }
        let Some(run) = self.run.get(..given) else {
            return Some(self.refuse(FrameError::TooLong { given }, given));
        };
        let mut decoded = [0; MAX_RUN];
        Some(match cobs::decode(run, &mut decoded) {
            Ok(report) => self.receiver.receive(&decoded[..report.frame_size()], given),
            Err(_) => self.refuse(FrameError::CutShort { given }, given),
        })
    }

    fn refuse(&mut self, error: FrameError, given: usize) -> Result<(u8, Message), FrameError> {
        self.receiver.count(&error, given);
        Err(error)
    }

    /// Sequence numbers and messages of all frames that `bytes` complete, or their errors, in order.
    pub fn feed<'a>(
        &'a mut self,
        bytes: &'a [u8],
    ) -> impl Iterator<Item = Result<(u8, Message), FrameError>> + 'a {
        bytes.iter().filter_map(|&byte| self.push(byte))
    }

    /// The counts since the decoder was made, or since [`Decoder::forget_counts`].
    pub fn stats(&self) -> WireStats {
        self.receiver.stats
    }

    /// Sets the counts to zero. The frame being read and the last sequence number are kept.
    pub fn forget_counts(&mut self) {
        self.receiver.stats = WireStats::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_the_one_the_protocol_names() {
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn free_is_the_frame_worked_out_by_hand() {
        // 05 07, its CRC-32 A2CA7319 by another program (zlib), little-endian; no zero inside, so COBS says 7.
        let frame = encode(&Message::Free, 7);
        assert_eq!(frame[..], [0, 7, 5, 7, 0x19, 0x73, 0xca, 0xa2, 0]);
        let mut decoder = Decoder::new();
        assert_eq!(decoder.feed(&frame).collect::<Vec<_>>(), [Ok((7, Message::Free))]);
    }

    #[test]
    fn sequence_numbers_tell_what_was_lost() {
        let mut decoder = Decoder::new();
        for seq in [254, 255, 0, 0, 4] {
            assert_eq!(decoder.feed(&encode(&Message::Free, seq)).count(), 1);
        }
        let WireStats { frames, gaps, lost, duplicates, .. } = decoder.stats();
        assert_eq!((frames, gaps, lost, duplicates), (5, 1, 3, 1));
    }

    #[test]
    fn boot_message_is_skipped_and_counted() {
        let mut decoder = Decoder::new();
        let noise =
            b"ets Jul 29 2019 12:21:46\r\n\r\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\n";
        assert_eq!(decoder.feed(noise).count(), 0);
        let found: Vec<_> = decoder.feed(&encode(&Message::Free, 1)).collect();
        assert_eq!(found, [Err(FrameError::TooLong { given: noise.len() }), Ok((1, Message::Free))]);
        assert_eq!(decoder.stats().skipped_bytes, noise.len() as u64);
    }
}
