//! The line between host and knob, with what faults do to its bytes. Has no baud rate: a real line takes 11 us a byte.

use crate::simulator::fault::{Fault, FaultKind};
use fastrand::Rng;
use std::collections::VecDeque;

/// Most bytes waiting in one direction; beyond it the newest are lost, as in the buffers of a serial driver.
const WAITING_MAX: usize = 65_536;

/// One direction.
#[derive(Debug)]
pub struct SimulatedLine {
    rng: Rng,
    /// When a piece arrives, s, and its bytes.
    waiting: VecDeque<(f64, Vec<u8>)>,
    waiting_bytes: usize,
}

impl SimulatedLine {
    /// An empty line; the seed decides which bytes a fault hits.
    pub fn new(seed: u64) -> Self {
        Self { rng: Rng::with_seed(seed), waiting: VecDeque::new(), waiting_bytes: 0 }
    }

    /// Sends a piece at a time, s.
    pub fn push(&mut self, t_s: f64, faults: &[Fault], bytes: &[u8]) {
        let mut piece = bytes.to_vec();
        let mut arrives_s = t_s;
        let mut times = 1;
        for fault in faults.iter().filter(|fault| fault.is_active(t_s)) {
            match fault.kind {
                FaultKind::Drop => piece.retain(|_| self.rng.f64() >= fault.strength),
                FaultKind::Corrupt => {
                    for byte in &mut piece {
                        if self.rng.f64() < fault.strength {
                            *byte ^= 1 << self.rng.u8(0..8);
                        }
                    }
                }
                FaultKind::Duplicate if self.rng.f64() < fault.strength => times = 2,
                FaultKind::Delay => arrives_s += fault.strength / 1000.0,
                FaultKind::Stall => arrives_s = arrives_s.max(fault.at_s + fault.seconds),
                FaultKind::Unplug => return,
                _ => {}
            }
        }
        // A serial line never overtakes itself.
        arrives_s = self.waiting.back().map_or(arrives_s, |(last_s, _)| arrives_s.max(*last_s));
        for _ in 0..times {
            if !piece.is_empty() && self.waiting_bytes + piece.len() <= WAITING_MAX {
                self.waiting_bytes += piece.len();
                self.waiting.push_back((arrives_s, piece.clone()));
            }
        }
    }

    /// Appends what has arrived by a time, s.
    pub fn take(&mut self, t_s: f64, faults: &[Fault], into: &mut Vec<u8>) {
        if faults.iter().any(|fault| fault.kind == FaultKind::Unplug && fault.is_active(t_s)) {
            self.clear();
        }
        while self.waiting.front().is_some_and(|(arrives_s, _)| *arrives_s <= t_s)
            && let Some((_, piece)) = self.waiting.pop_front()
        {
            self.waiting_bytes -= piece.len();
            into.extend(piece);
        }
    }

    /// Forgets what is on its way.
    pub fn clear(&mut self) {
        self.waiting.clear();
        self.waiting_bytes = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends 1000 pieces of ten bytes, one per ms, and returns what arrives with the times, ms.
    fn through(faults: &[Fault]) -> (Vec<u8>, Vec<(u32, usize)>) {
        let mut line = SimulatedLine::new(1);
        let (mut all, mut arrivals) = (Vec::new(), Vec::new());
        for ms in 0..1000 {
            let t_s = f64::from(ms) / 1000.0;
            line.push(t_s, faults, &[ms as u8; 10]);
            let before = all.len();
            line.take(t_s, faults, &mut all);
            arrivals.push((ms, all.len() - before));
        }
        (all, arrivals)
    }

    fn fault(kind: FaultKind) -> Fault {
        Fault::new(kind, 0.2).lasting(0.5)
    }

    #[test]
    fn sound_line_changes_nothing() {
        let (all, arrivals) = through(&[]);
        assert!(arrivals.iter().all(|(_, bytes)| *bytes == 10));
        assert!(all.chunks(10).zip(0..).all(|(piece, ms)| piece == [ms as u8; 10]));
    }

    #[test]
    fn each_fault_does_what_it_says() {
        let (sound, _) = through(&[]);
        let (dropped, _) = through(&[fault(FaultKind::Drop)]);
        let lost = 10_000 - dropped.len();
        assert!((150..350).contains(&lost), "5 % of 5000 bytes: {lost}");
        let (corrupt, _) = through(&[fault(FaultKind::Corrupt)]);
        let bits: u32 = corrupt.iter().zip(&sound).map(|(a, b)| (a ^ b).count_ones()).sum();
        assert!(corrupt.len() == 10_000 && (150..350).contains(&bits), "{bits}");
        let (twice, _) = through(&[fault(FaultKind::Duplicate)]);
        assert!((12_000..13_000).contains(&twice.len()), "{}", twice.len());
        let (late, arrivals) = through(&[fault(FaultKind::Delay)]);
        assert!(arrivals[200..250].iter().all(|(_, bytes)| *bytes == 0) && arrivals[250].1 == 10);
        assert!(late[..] == sound[..late.len()], "order is kept");
        let (stalled, arrivals) = through(&[fault(FaultKind::Stall)]);
        assert!(arrivals[200..700].iter().all(|(_, bytes)| *bytes == 0) && arrivals[700].1 == 5010);
        assert_eq!(stalled, sound);
        let (unplugged, _) = through(&[fault(FaultKind::Unplug)]);
        assert_eq!(unplugged.len(), 5000);
    }

    #[test]
    fn flood_is_bounded() {
        let stall = Fault::new(FaultKind::Stall, 0.0).lasting(10.0);
        let mut line = SimulatedLine::new(1);
        for _ in 0..10_000 {
            line.push(1.0, &[stall], &[0; 64]);
        }
        let mut all = Vec::new();
        line.take(10.0, &[stall], &mut all);
        assert_eq!(all.len(), WAITING_MAX);
    }
}
