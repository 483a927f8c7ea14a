//! OSC from unmodified firmware, over UDP.
//!
//! The stock reed firmware sends 25 times a second and can receive nothing. Names are matched by their end, without
//! regard to case, because the firmware's own documents spell them in several ways. Bundles are walked here, to a depth
//! and a size: the crate that reads messages would follow them as deep as a datagram can nest, which is deeper than a
//! thread's stack.

use crate::device::transport::{Binding, Transport};
use rosc::{OscPacket, OscType};
use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

/// Port that TorqueTuners send to.
pub const PORT: u16 = 8000;

/// Datagrams in one poll: a hundred thousand a second come a hundred at a time.
const BUDGET: usize = 512;

/// Time in one poll.
const BUDGET_TIME: Duration = Duration::from_micros(1500);

/// Longest datagram that is looked at, bytes; the firmware's have below 500.
const DATAGRAM: usize = 4096;

/// Longest message, bytes; the firmware's have below 64.
const MESSAGE: usize = 512;

/// Bundles within bundles.
const DEPTH: usize = 4;

/// Messages of one datagram.
const MESSAGES: usize = 64;

/// What unmodified firmware says. Ranges in `docs/touch.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StockMessage {
    /// `angle_out`: 0.1 degrees since it was switched on.
    Angle(f64),
    /// `velocity`: rpm.
    Velocity(f64),
    /// `pluck`: 1 beyond -100 degrees.
    Pluck(bool),
    /// `st`: depth of the slap, -1..0.
    Slap(f64),
    /// `button`: running count.
    Button(f64),
    /// Known, of no use here: `trigger`, `angle_discrete`, `flow`, `torque`, `speed`, `accl`.
    Other,
}

/// A port for OSC.
pub struct OscTransport {
    socket: UdpSocket,
    address: SocketAddr,
    buffer: Box<[u8]>,
}

impl OscTransport {
    /// Listens at `port`, to this machine alone unless `any_address`.
    pub fn open(port: u16, any_address: bool) -> io::Result<Self> {
        let host = if any_address { Ipv4Addr::UNSPECIFIED } else { Ipv4Addr::LOCALHOST };
        let socket = UdpSocket::bind((host, port))?;
        socket.set_nonblocking(true)?;
        // One byte more than is looked at shows that a datagram is longer.
        Ok(Self { address: socket.local_addr()?, socket, buffer: vec![0; DATAGRAM + 1].into() })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Transport for OscTransport {
    fn binding(&self) -> Binding {
        Binding::Osc
    }

    fn poll(&mut self, wait: Duration, sink: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        let begun = Instant::now();
        for n in 0..BUDGET {
            match self.socket.recv(&mut self.buffer) {
                Ok(length) => sink(&self.buffer[..length]),
                // A time limit on the socket would be rounded up to the kernel's ticks.
                Err(e) if e.kind() == io::ErrorKind::WouldBlock => {
                    if n == 0 {
                        thread::sleep(wait);
                    }
                    break;
                }
                // Windows reports that somebody we never wrote to is not there.
                Err(e) if e.kind() == io::ErrorKind::ConnectionReset => {}
                // Windows reports a datagram longer than the buffer.
                Err(e) if e.raw_os_error() == Some(10040) => sink(&self.buffer),
                Err(e) => return Err(e),
            }
            if begun.elapsed() > BUDGET_TIME {
                break;
            }
        }
        Ok(())
    }

    fn send(&mut self, _bytes: &[u8]) -> io::Result<()> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "unmodified firmware receives nothing"))
    }

    fn describe(&self) -> String {
        format!("OSC at {}", self.address)
    }
}

/// Reads a datagram; returns how many of its messages were none of a TorqueTuner's, one for a datagram that is no OSC.
pub fn read(datagram: &[u8], mut sink: impl FnMut(StockMessage)) -> u64 {
    if datagram.len() > DATAGRAM {
        return 1;
    }
    let mut left = MESSAGES;
    let mut ignored = 0;
    walk(datagram, DEPTH, &mut left, &mut |message| match word(message) {
        Some(word) => sink(word),
        None => ignored += 1,
    });
    ignored
}

/// Hands over the messages of a packet.
fn walk(packet: &[u8], depth: usize, left: &mut usize, sink: &mut dyn FnMut(&[u8])) {
    let Some(mut elements) = packet.strip_prefix(b"#bundle\0") else {
        if *left > 0 {
            *left -= 1;
            sink(packet);
        }
        return;
    };
    // After the time tag each element is preceded by its length.
    elements = elements.get(8..).unwrap_or_default();
    while let Some((length, rest)) = elements.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let Some(element) = rest.get(..length).filter(|_| depth > 0 && *left > 0) else {
            return sink(&[]); // counts as one that was ignored
        };
        walk(element, depth - 1, left, sink);
        elements = &rest[length..];
    }
}

fn word(message: &[u8]) -> Option<StockMessage> {
    if message.len() > MESSAGE {
        return None;
    }
    // An address without its slash is known from the firmware's documents and no OSC to the crate.
    let mut slashed;
    let message = if message.first().is_some_and(u8::is_ascii_alphabetic) {
        let end = message.iter().position(|byte| *byte == 0)?;
        slashed = Vec::with_capacity(MESSAGE + 4);
        slashed.push(b'/');
        slashed.extend_from_slice(&message[..end]);
        slashed.resize(slashed.len() / 4 * 4 + 4, 0);
        slashed.extend_from_slice(message.get(end / 4 * 4 + 4..)?);
        &slashed[..]
    } else {
        message
    };
    let Ok((_, OscPacket::Message(message))) = rosc::decoder::decode_udp(message) else { return None };
    let address = message.addr.to_ascii_lowercase();
    let (rest, name) = address.rsplit_once('/')?;
    if rest.rsplit('/').next() != Some("instrument") {
        return None;
    }
    let value = match message.args.first()? {
        OscType::Int(value) => f64::from(*value),
        OscType::Float(value) => f64::from(*value),
        OscType::Double(value) => *value,
        OscType::Long(value) => *value as f64,
        OscType::Bool(value) => f64::from(u8::from(*value)),
        _ => return None,
    };
    if !value.is_finite() {
        return None;
    }
    // The firmware's documents put a comma into one name.
    Some(match name.replace(',', "").as_str() {
        "angle_out" => StockMessage::Angle(value),
        "velocity" => StockMessage::Velocity(value),
        "pluck" => StockMessage::Pluck(value != 0.0),
        "st" => StockMessage::Slap(value),
        "button" => StockMessage::Button(value),
        "trigger" | "angle_discrete" | "flow" | "torque" | "speed" | "accl" => StockMessage::Other,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rosc::{OscBundle, OscMessage, OscTime, encoder};

    fn message(addr: &str, arg: OscType) -> OscPacket {
        OscPacket::Message(OscMessage { addr: addr.into(), args: vec![arg] })
    }

    fn words(datagram: &[u8]) -> (Vec<StockMessage>, u64) {
        let mut words = Vec::new();
        let ignored = read(datagram, |word| words.push(word));
        (words, ignored)
    }

    fn heard(addr: &str, arg: OscType) -> Option<StockMessage> {
        words(&encoder::encode(&message(addr, arg)).unwrap()).0.first().copied()
    }

    #[test]
    fn every_name_of_the_stock_firmware_is_known_however_it_is_spelt() {
        let at = |name: &str| format!("/TorqueTuner_001/instrument/{name}");
        assert_eq!(heard(&at("angle_out"), OscType::Int(-1234)), Some(StockMessage::Angle(-1234.0)));
        assert_eq!(heard(&at("velocity"), OscType::Float(-2.5)), Some(StockMessage::Velocity(-2.5)));
        assert_eq!(heard(&at("pluck"), OscType::Int(1)), Some(StockMessage::Pluck(true)));
        assert_eq!(heard(&at("st"), OscType::Float(-0.5)), Some(StockMessage::Slap(-0.5)));
        assert_eq!(heard(&at("button"), OscType::Int(3)), Some(StockMessage::Button(3.0)));
        for name in ["trigger", "angle_discrete", "angle_d,iscrete", "flow", "torque", "speed", "accl"] {
            assert_eq!(heard(&at(name), OscType::Int(0)), Some(StockMessage::Other), "{name}");
        }
        for addr in
            ["/Torquetuner_042/Instrument/Angle_Out", "/a/b/c/instrument/angle_out", "/instrument/angle_out"]
        {
            assert_eq!(heard(addr, OscType::Int(5)), Some(StockMessage::Angle(5.0)), "{addr}");
        }
        for addr in
            ["/TorqueTuner_001/angle_out", "/x/instruments/angle_out", "/x/instrument/angle_out2", "/"]
        {
            assert_eq!(heard(addr, OscType::Int(5)), None, "{addr}");
        }
        assert_eq!(heard(&at("velocity"), OscType::Float(f32::NAN)), None);
    }

    #[test]
    fn an_address_without_slash_is_understood_at_every_length() {
        for device in ["Torquetuner_1", "Torquetuner_12", "Torquetuner_123", "Torquetuner_1234"] {
            // The crate encodes any address, but pads it as it is.
            let datagram =
                encoder::encode(&message(&format!("{device}/instrument/velocity"), OscType::Float(7.5)));
            assert_eq!(words(&datagram.unwrap()), (vec![StockMessage::Velocity(7.5)], 0), "{device}");
        }
    }

    fn bundle(content: Vec<OscPacket>) -> OscPacket {
        OscPacket::Bundle(OscBundle { timetag: OscTime { seconds: 0, fractional: 1 }, content })
    }

    #[test]
    fn bundles_are_read_to_a_depth_and_no_deeper() {
        let mut packet = message("/x/instrument/angle_out", OscType::Int(9));
        for depth in 1..=DEPTH + 1 {
            packet = bundle(vec![packet]);
            let (words, ignored) = words(&encoder::encode(&packet).unwrap());
            let expected = if depth <= DEPTH { (vec![StockMessage::Angle(9.0)], 0) } else { (vec![], 1) };
            assert_eq!((words, ignored), expected, "depth {depth}");
        }
    }

    #[test]
    fn giant_and_damaged_packets_are_counted_and_do_no_harm() {
        // As deep as a datagram goes: 16 bytes of bundle and 4 of length each.
        let mut deep = Vec::new();
        for level in 0..3000u32 {
            deep.splice(..0, [&b"#bundle\0\0\0\0\0\0\0\0\x01"[..], &(20 * level).to_be_bytes()].concat());
        }
        assert_eq!(words(&deep), (vec![], 1));
        assert_eq!(words(&deep[..4000]), (vec![], 1));
        let arrays = [b"/x/instrument/angle_out\0,".as_slice(), &[b'['; 400], b"\0\0\0"].concat();
        assert_eq!(words(&arrays), (vec![], 1));
        let many = bundle(vec![message("/x/instrument/angle_out", OscType::Int(1)); 200]);
        let (heard, ignored) = words(&encoder::encode(&many).unwrap()[..4000]);
        assert!(heard.len() <= MESSAGES && ignored >= 1, "{} and {ignored}", heard.len());
        let good =
            encoder::encode(&bundle(vec![message("/x/instrument/st", OscType::Float(-1.0)); 3])).unwrap();
        for cut in 0..good.len() {
            read(&good[..cut], |_| {});
            let mut damaged = good.clone();
            damaged[cut] ^= 0xFF;
            read(&damaged, |_| {});
        }
        for length in [u32::MAX, 1 << 31, 0] {
            read(
                &[b"#bundle\0\0\0\0\0\0\0\0\x01".as_slice(), &length.to_be_bytes(), b"/x\0\0"].concat(),
                |_| {},
            );
        }
    }
}
