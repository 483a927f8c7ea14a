//! FEEL as OSC floats, for firmware that is reached by a bridge (libmapper) and not by TTLink.
//!
//! Each field goes to `/chalumeau/feel/<field>`, named as in `docs/protocol.md` but for `H` and `k`, which keep the seed's
//! letters, and TorqueTuner's own words `scale`, `stretch`, `offset`, `damping`. All fields are one bundle: on change, at
//! most 100 a second, and once a second. The end is a bundle without torque and then silence, in which the bridge takes the
//! torque away by itself. Whoever sends decides when ([`link`](crate::device::link)); the bridge's other end keeps its own limits.

use crate::device::session::feeling::{AGAIN_US, LEAST_US};
use crate::wire::Feel;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType, encoder};
use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

/// Bundles without torque at the end, for UDP may lose one.
const RESTS: u8 = 3;

/// Sends the feel to one address. Dropped, it takes the torque away.
pub struct FeelSender {
    socket: UdpSocket,
    to: SocketAddr,
    last: Option<(Feel, i64)>,
    /// The end that is still to be said again: so often, the last time then, us.
    rests: Option<(Feel, u8, i64)>,
}

impl FeelSender {
    /// Prepares to send to `to`.
    pub fn new(to: SocketAddr) -> io::Result<Self> {
        let any = if to.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
        let socket = UdpSocket::bind(SocketAddr::new(any, 0))?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, to, last: None, rests: None })
    }

    /// Sends `feel` if it is new or due again; what the network refuses is lost, as all of UDP may be.
    pub fn poll(&mut self, feel: &Feel, now_us: i64) {
        let feel = Feel { feel_id: 0, ..*feel };
        let is_due = self.last.is_none_or(|(last, at)| {
            let since_us = now_us - at;
            since_us >= AGAIN_US || (last != feel && since_us >= LEAST_US)
        });
        if is_due {
            (self.last, self.rests) = (Some((feel, now_us)), None);
            self.say(&feel);
        }
    }

    /// No torque, and then silence. A bridge that was told nothing hears nothing.
    pub fn rest(&mut self, now_us: i64) {
        if let Some((last, _)) = self.last.take() {
            self.rests = Some((limp(last), RESTS, i64::MIN));
        }
        if let Some((feel, left, at_us)) = self.rests
            && now_us >= at_us.saturating_add(LEAST_US)
        {
            self.rests = (left > 1).then_some((feel, left - 1, now_us));
            self.say(&feel);
        }
    }

    fn say(&self, feel: &Feel) {
        if let Ok(datagram) = encoder::encode(&bundle(feel)) {
            let _ = self.socket.send_to(&datagram, self.to);
        }
    }
}

impl Drop for FeelSender {
    fn drop(&mut self) {
        if let Some((last, _)) = self.last {
            self.say(&limp(last));
        }
    }
}

/// The same without anything that makes torque.
fn limp(feel: Feel) -> Feel {
    Feel {
        scale_mnm: 0.0,
        wall_mnm_per_deg: 0.0,
        slap_mnm_per_deg: 0.0,
        damping_mnms: 0.0,
        friction: 0,
        detent: 0,
        ..feel
    }
}

/// The fields as they are named on the wire of OSC.
pub fn fields(feel: &Feel) -> [(&'static str, f32); 16] {
    [
        ("law", f32::from(feel.law as u8)),
        ("morph_ms", f32::from(feel.morph_ms)),
        ("H", feel.h),
        ("k", feel.k),
        ("scale", feel.scale_mnm),
        ("stretch", feel.stretch),
        ("offset", feel.offset_deg),
        ("a_on", feel.a_on_deg),
        ("a_off", feel.a_off_deg),
        ("a_beat", feel.a_beat_deg),
        ("wall", feel.wall_deg),
        ("wall_mnm_per_deg", feel.wall_mnm_per_deg),
        ("slap_mnm_per_deg", feel.slap_mnm_per_deg),
        ("damping", feel.damping_mnms),
        // mNm here: a float needs no tenths
        ("friction", 0.1 * f32::from(feel.friction)),
        ("detent", 0.1 * f32::from(feel.detent)),
    ]
}

fn bundle(feel: &Feel) -> OscPacket {
    let message = |(name, value): (&str, f32)| {
        let addr = format!("/chalumeau/feel/{name}");
        OscPacket::Message(OscMessage { addr, args: vec![OscType::Float(value)] })
    };
    // The time tag 0, 1 means: at once.
    let timetag = OscTime { seconds: 0, fractional: 1 };
    OscPacket::Bundle(OscBundle { timetag, content: fields(feel).into_iter().map(message).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn feel_arrives_as_floats_when_it_changes() {
        let bridge = UdpSocket::bind("127.0.0.1:0").unwrap();
        bridge.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let mut sender = FeelSender::new(bridge.local_addr().unwrap()).unwrap();
        let mut feel = Feel { scale_mnm: 90.0, detent: 25, ..Feel::default() };
        for ms in 0..1500 {
            if ms == 505 {
                feel.h = 3.0;
            }
            sender.poll(&feel, ms * 1000);
        }
        let mut buffer = [0; 2048];
        let mut bundles = Vec::new();
        for _ in 0..2 {
            let length = bridge.recv(&mut buffer).unwrap();
            let (_, OscPacket::Bundle(bundle)) = rosc::decoder::decode_udp(&buffer[..length]).unwrap() else {
                panic!("no bundle")
            };
            bundles.push(bundle.content);
        }
        let value = |bundle: &[OscPacket], field: &str| {
            bundle.iter().find_map(|packet| match packet {
                OscPacket::Message(m) if m.addr == format!("/chalumeau/feel/{field}") => {
                    m.args[0].clone().float()
                }
                _ => None,
            })
        };
        assert_eq!(value(&bundles[0], "scale"), Some(90.0));
        assert_eq!(value(&bundles[0], "detent"), Some(2.5));
        assert_eq!((value(&bundles[0], "H"), value(&bundles[1], "H")), (Some(Feel::default().h), Some(3.0)));
        bridge.set_nonblocking(true).unwrap();
        assert!(bridge.recv(&mut buffer).is_err(), "twice and no more: at first and on change");
    }
}
