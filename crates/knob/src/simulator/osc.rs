//! The stock firmware's reports as OSC over UDP, in its spelling or in that of its document.

use crate::simulator::stock::OscValue;
use rosc::{OscMessage, OscPacket, OscType, encoder};
use std::io;
use std::net::{ToSocketAddrs, UdpSocket};

/// Why reports cannot be sent.
#[derive(Debug, thiserror::Error)]
pub enum OscError {
    /// Not an address.
    #[error("{given:?} is no HOST:PORT to send OSC to, for example 127.0.0.1:8000: {source}")]
    Address {
        /// The address as it stands.
        given: String,
        /// What the system said.
        source: io::Error,
    },
    /// No socket.
    #[error("cannot open a UDP socket: {0}")]
    Socket(#[from] io::Error),
}

/// Whose spelling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spelling {
    /// `/TorqueTuner_001/instrument/angle_out`, as the firmware sends it.
    Firmware,
    /// `Torquetuner_001/instrument/angle_d,iscrete`, as its document has it.
    Document,
}

/// The address of an output.
pub fn address(device: &str, name: &str, spelling: Spelling) -> String {
    match spelling {
        Spelling::Firmware => format!("/{device}/instrument/{name}"),
        Spelling::Document => {
            let device = device.replace("TorqueTuner", "Torquetuner");
            let name = if name == "angle_discrete" { "angle_d,iscrete" } else { name };
            format!("{device}/instrument/{name}")
        }
    }
}

/// Sends reports.
#[derive(Debug)]
pub struct OscSender {
    socket: UdpSocket,
    device: String,
    spelling: Spelling,
    /// Reports that could not be sent; nobody listening is no error of ours.
    pub unsent: u64,
}

impl OscSender {
    /// Sends to `HOST:PORT` in the name of a device such as `TorqueTuner_001`.
    pub fn new(to: &str, device: &str, spelling: Spelling) -> Result<Self, OscError> {
        let wrong = |source| OscError::Address { given: to.to_owned(), source };
        let first = to.to_socket_addrs().map_err(wrong)?.next();
        let address = first.ok_or_else(|| wrong(io::ErrorKind::AddrNotAvailable.into()))?;
        let socket = UdpSocket::bind(if address.is_ipv6() { "[::]:0" } else { "0.0.0.0:0" })?;
        socket.connect(address).map_err(wrong)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, device: device.to_owned(), spelling, unsent: 0 })
    }

    /// Sends one report, a packet for each output as the firmware does.
    pub fn send(&mut self, report: &[(&'static str, OscValue)]) {
        for (name, value) in report {
            let argument = match *value {
                OscValue::Int(i) => OscType::Int(i),
                OscValue::Float(f) => OscType::Float(f),
            };
            let addr = address(&self.device, name, self.spelling);
            let packet = OscPacket::Message(OscMessage { addr, args: vec![argument] });
            let sent = encoder::encode(&packet).map(|bytes| self.socket.send(&bytes).is_ok());
            self.unsent += u64::from(!sent.unwrap_or(false));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn heard(spelling: Spelling) -> Vec<OscMessage> {
        let ear = UdpSocket::bind("127.0.0.1:0").unwrap();
        ear.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let to = ear.local_addr().unwrap().to_string();
        let mut sender = OscSender::new(&to, "TorqueTuner_001", spelling).unwrap();
        sender.send(&[("angle_discrete", OscValue::Int(-7)), ("velocity", OscValue::Float(1.5))]);
        assert_eq!(sender.unsent, 0);
        let mut buffer = [0; 1500];
        (0..2)
            .map(|_| {
                let length = ear.recv(&mut buffer).unwrap();
                match rosc::decoder::decode_udp(&buffer[..length]).unwrap().1 {
                    OscPacket::Message(message) => message,
                    OscPacket::Bundle(_) => panic!("the firmware sends no bundles"),
                }
            })
            .collect()
    }

    #[test]
    fn firmware_and_document_spell_differently() {
        let [angle, velocity] = &heard(Spelling::Firmware)[..] else { panic!() };
        assert_eq!(angle.addr, "/TorqueTuner_001/instrument/angle_discrete");
        assert_eq!(angle.args, [OscType::Int(-7)]);
        assert_eq!(velocity.addr, "/TorqueTuner_001/instrument/velocity");
        assert_eq!(velocity.args, [OscType::Float(1.5)]);
    }

    #[test]
    fn document_spelling_is_made_by_hand_where_osc_libraries_refuse_it() {
        assert_eq!(
            address("TorqueTuner_001", "angle_discrete", Spelling::Document),
            "Torquetuner_001/instrument/angle_d,iscrete"
        );
    }

    #[test]
    fn address_that_is_none_is_explained() {
        let said = OscSender::new("localhost", "x", Spelling::Firmware).unwrap_err().to_string();
        assert!(said.contains("\"localhost\" is no HOST:PORT"), "{said}");
    }
}
