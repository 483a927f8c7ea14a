//! How a device is found out: HELLO until INFO comes, at either speed of a serial line, and one question to unmodified
//! firmware.
//!
//! The question is `whatareyou`, and nothing else is ever asked: `readconfig` would print the password of the network.

use crate::device::transport::{BAUD, Binding, SLOW_BAUD};

/// Time between two HELLO, us.
const HELLO_US: i64 = 250_000;

/// Without INFO for this long the other speed is tried and the question asked, us.
const OTHER_SPEED_US: i64 = 600_000;

/// Time at each speed after that, us: two HELLO and an answer.
const SPEED_US: i64 = 700_000;

/// HELLO is held back so long after the question, us: unmodified firmware reads lines of text.
const QUIET_US: i64 = 150_000;

/// The question, on a line of its own after whatever HELLO left in the firmware's buffer.
pub const QUESTION: &[u8] = b"\nwhatareyou\n";

/// Longest text kept to look for a name.
const TEXT: usize = 256;

/// What is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GreetingStep {
    /// Send HELLO.
    Hello,
    /// Set the line to this speed.
    Baud(u32),
    /// Send [`QUESTION`].
    Question,
}

/// The time before INFO.
#[derive(Debug)]
pub struct Greeting {
    is_serial: bool,
    is_slow: bool,
    next_hello_us: i64,
    next_speed_us: i64,
    has_asked: bool,
    question_due: bool,
    text: Vec<u8>,
    stock_name: Option<String>,
}

impl Greeting {
    /// A port opened at `now_us`.
    pub fn new(binding: Binding, now_us: i64) -> Self {
        Self {
            is_serial: binding == Binding::Serial,
            is_slow: false,
            next_hello_us: now_us,
            next_speed_us: now_us + OTHER_SPEED_US,
            has_asked: false,
            question_due: false,
            text: Vec::new(),
            stock_name: None,
        }
    }

    /// True at the slower speed.
    pub fn is_slow(&self) -> bool {
        self.is_slow
    }

    /// Name that unmodified firmware gave.
    pub fn stock_name(&self) -> Option<&str> {
        self.stock_name.as_deref()
    }

    /// Begins again with a device that has answered before, at the speed it answered at.
    pub fn again(&mut self, now_us: i64) {
        self.next_hello_us = now_us;
        self.has_asked = true;
    }

    /// The next thing due, until `None`. `is_framed`: valid frames arrive, so the speed is right.
    pub fn poll(&mut self, now_us: i64, is_framed: bool) -> Option<GreetingStep> {
        if self.is_serial && now_us >= self.next_speed_us && !is_framed {
            self.next_speed_us = now_us + SPEED_US;
            self.is_slow = !self.is_slow;
            // A board that speaks at once has just been reset by the opening and would not hear the question yet.
            self.question_due = self.is_slow && !self.has_asked && self.text.is_empty();
            if self.is_slow {
                self.text.clear();
            }
            self.next_hello_us = now_us;
            return Some(GreetingStep::Baud(if self.is_slow { SLOW_BAUD } else { BAUD }));
        }
        if std::mem::take(&mut self.question_due) {
            self.has_asked = true;
            self.next_hello_us = now_us + QUIET_US;
            return Some(GreetingStep::Question);
        }
        if now_us >= self.next_hello_us {
            self.next_hello_us = now_us + HELLO_US;
            return Some(GreetingStep::Hello);
        }
        None
    }

    /// Takes in bytes as they came, to look for the answer to the question.
    pub fn hear(&mut self, bytes: &[u8]) {
        if !self.is_serial || self.stock_name.is_some() {
            return;
        }
        let from = bytes.len().saturating_sub(TEXT);
        self.text.extend_from_slice(&bytes[from..]);
        let surplus = self.text.len().saturating_sub(TEXT);
        self.text.drain(..surplus);
        if self.has_asked {
            self.stock_name = name_in(&self.text);
        }
    }
}

/// The name in `<<<name>>>`.
fn name_in(text: &[u8]) -> Option<String> {
    let find = |from: usize, mark: &[u8]| {
        text[from..].windows(mark.len()).position(|window| window == mark).map(|at| from + at)
    };
    let start = find(0, b"<<<")? + 3;
    let end = find(start, b">>>")?;
    let name = std::str::from_utf8(&text[start..end]).ok()?.trim();
    let is_plain =
        !name.is_empty() && name.len() <= 40 && name.chars().all(|c| c.is_ascii_graphic() || c == ' ');
    is_plain.then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything due within `seconds` of silence, with its time in ms.
    fn log(seconds: i64, greeting: &mut Greeting) -> Vec<(i64, GreetingStep)> {
        let mut log = Vec::new();
        for ms in 0..seconds * 1000 {
            while let Some(due) = greeting.poll(ms * 1000, false) {
                log.push((ms, due));
            }
        }
        log
    }

    #[test]
    fn both_speeds_are_tried_and_the_question_asked_once() {
        let log = log(5, &mut Greeting::new(Binding::Serial, 0));
        let hello: Vec<i64> =
            log.iter().filter(|(_, due)| *due == GreetingStep::Hello).map(|(ms, _)| *ms).collect();
        assert_eq!(hello[..3], [0, 250, 500]);
        assert!(
            hello.windows(6).all(|six| six[5] - six[0] >= 1000),
            "four a second, and one with each change of speed"
        );
        let bauds: Vec<(i64, GreetingStep)> =
            log.iter().filter(|(_, due)| matches!(due, GreetingStep::Baud(_))).copied().collect();
        assert_eq!(bauds[..2], [(600, GreetingStep::Baud(115_200)), (1300, GreetingStep::Baud(921_600))]);
        let asked: Vec<i64> =
            log.iter().filter(|(_, due)| *due == GreetingStep::Question).map(|(ms, _)| *ms).collect();
        assert_eq!(asked, [600]);
    }

    #[test]
    fn question_waits_until_a_board_that_was_reset_has_started() {
        let mut greeting = Greeting::new(Binding::Serial, 0);
        greeting.hear(b"rst:0x1 (POWERON_RESET)");
        let asked: Vec<i64> = log(5, &mut greeting)
            .iter()
            .filter(|(_, due)| *due == GreetingStep::Question)
            .map(|(ms, _)| *ms)
            .collect();
        assert_eq!(asked, [2000]);
    }

    #[test]
    fn midi_knows_no_speed_and_no_question() {
        let log = log(3, &mut Greeting::new(Binding::Midi, 0));
        assert_eq!(log.len(), 12);
        assert!(log.iter().all(|(_, due)| *due == GreetingStep::Hello));
    }

    #[test]
    fn answer_of_unmodified_firmware_is_found_in_pieces_and_noise() {
        let mut greeting = Greeting::new(Binding::Serial, 0);
        log(1, &mut greeting);
        for piece in ["\u{fffd}? <<", "<Torque", "Tuner_001>", ">>\r\n"] {
            assert_eq!(greeting.stock_name(), None);
            greeting.hear(piece.as_bytes());
        }
        assert_eq!(greeting.stock_name(), Some("TorqueTuner_001"));
        for odd in ["<<<>>>", "<<<\u{1}\u{2}>>>", "<<< no end"] {
            assert_eq!(name_in(odd.as_bytes()), None, "{odd:?}");
        }
    }
}
