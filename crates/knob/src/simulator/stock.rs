//! The reed firmware a TorqueTuner comes with, restated: its law, its outputs 25 times a second, nothing it can be told.
//!
//! From the public firmware (Maxw3llGM/TorqueTuner_Reed-Model_DMI), facts only. Its quirks are kept, because they are
//! what a host meets: the index follows rounded steps, `angle_out` has no bounds
//! but those of sixteen bits, the slap's value vanishes in the tick the
//! pluck ends, the velocity is rpm, torque is a count of the motor board. The board of the moteus branch takes 208 counts
//! for a newton metre and was left clipping at 0.1 N m; that too is kept.

use chalumeau_core::reed::ReedTables;

/// Default scale of the stock law, counts: half of its largest torque.
const SCALE: f64 = 90.0;

/// Counts for a newton metre on the moteus board.
const COUNTS_PER_NM: f64 = 208.0;

/// Where the moteus branch clips, N m.
const BOARD_MAX_NM: f64 = 0.1;

/// Encoder counts of a turn.
const TURN: i64 = 3600;

/// Where the tongue slap begins, 0.1 degrees.
const PLUCK_AT: i64 = -1000;

/// Time between two reports, ticks of the 2 kHz loop: 40 ms.
const REPORT_TICKS: u64 = 80;

/// An argument of a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OscValue {
    /// OSC `i`.
    Int(i32),
    /// OSC `f`.
    Float(f32),
}

/// The stock firmware at work.
#[derive(Debug)]
pub struct StockFirmware {
    tables: &'static ReedTables,
    tick: u64,
    last_counts: i64,
    angle_out: i16,
    state: i16,
    torque_counts: i32,
    rpm: f64,
    trigger: i32,
    slap: f32,
    was_button: bool,
    presses: i32,
}

impl Default for StockFirmware {
    fn default() -> Self {
        Self {
            tables: ReedTables::reference(),
            tick: 0,
            last_counts: 0,
            angle_out: 0,
            state: 0,
            torque_counts: 0,
            rpm: 0.0,
            trigger: 0,
            slap: 0.0,
            was_button: false,
            presses: 0,
        }
    }
}

impl StockFirmware {
    /// One period of its loop: what encoder, board and button say, and the torque the board then makes, N m.
    pub fn tick(&mut self, counts: i64, rpm: f64, button: bool) -> f64 {
        let mut delta = counts - self.last_counts;
        if delta.abs() > TURN / 2 {
            delta -= TURN * delta.signum();
        }
        self.last_counts = counts;
        let before = i64::from(self.angle_out);
        // Sixteen bits, as there: they overflow after 9.1 turns.
        self.angle_out = self.angle_out.wrapping_add(delta as i16);
        self.state = self.state.wrapping_add(delta as i16);
        let angle_out = i64::from(self.angle_out);
        self.rpm = rpm;
        let at = i64::from(self.state).clamp(0, TURN) as usize;
        let t = self.tables;
        let (h, k) = (27.0f64.sqrt() / 2.0, 2.0 / 27.0f64.sqrt());
        let flow = (h * t.x_a[at] - t.x_b[at] / k) * f64::from(t.sgn[at]);
        self.torque_counts = (-SCALE * flow).round() as i32;
        if angle_out < PLUCK_AT {
            let value = (angle_out - PLUCK_AT) as f32 / 1500.0;
            let value = if angle_out < -1500 { -1.0 } else { value };
            self.slap = self.slap.min(value);
        } else {
            self.slap = 0.0;
        }
        self.presses += i32::from(button && !self.was_button);
        self.was_button = button;
        // A detent every ten degrees, told apart by the side it was crossed to.
        self.trigger = match angle_out.div_euclid(100) - before.div_euclid(100) {
            0 => self.trigger,
            step => step.signum() as i32,
        };
        self.tick += 1;
        (f64::from(self.torque_counts) / COUNTS_PER_NM).clamp(-BOARD_MAX_NM, BOARD_MAX_NM)
    }

    /// The report due after this tick, in the order it is sent; none in most ticks.
    pub fn report(&self) -> Option<[(&'static str, OscValue); 8]> {
        let is_plucked = i64::from(self.angle_out) < PLUCK_AT;
        self.tick.is_multiple_of(REPORT_TICKS).then_some([
            ("angle_out", OscValue::Int(self.angle_out.into())),
            ("velocity", OscValue::Float(self.rpm as f32)),
            ("trigger", OscValue::Int(self.trigger)),
            ("angle_discrete", OscValue::Int((self.angle_out / 100).into())),
            ("flow", OscValue::Int(self.torque_counts)),
            ("pluck", OscValue::Int(is_plucked.into())),
            ("st", OscValue::Float(self.slap)),
            ("button", OscValue::Int(self.presses)),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns slowly to an angle in 0.1 degrees; torque of every tick, counts.
    fn turn(firmware: &mut StockFirmware, from: i64, to: i64) -> Vec<i32> {
        let step = (to - from).signum();
        let mut torques = Vec::new();
        let mut at = from;
        while at != to {
            at += step;
            firmware.tick(at, 0.0, false);
            torques.push(firmware.torque_counts);
        }
        torques
    }

    #[test]
    fn resistance_rises_to_a_third_and_is_gone_at_closure() {
        let mut firmware = StockFirmware::default();
        let torques = turn(&mut firmware, 0, 3600);
        let strongest = torques.iter().min().unwrap();
        assert_eq!(*strongest, -90);
        let first = torques.iter().position(|t| t == strongest).unwrap() as i64;
        let last = torques.iter().rposition(|t| t == strongest).unwrap() as i64;
        assert!((first + last - 2 * 1200).abs() < 120, "{first} {last}: about a third of 3600");
        assert_eq!(torques[3599], 0);
        assert!(turn(&mut firmware, 3600, 7200).iter().all(|t| *t == 0));
        assert_eq!(firmware.report().unwrap()[0], ("angle_out", OscValue::Int(7200)), "no bounds");
        turn(&mut firmware, 7200, 32_768 + 32);
        assert_eq!(
            firmware.report().unwrap()[0],
            ("angle_out", OscValue::Int(32 - 32_768)),
            "but an overflow"
        );
    }

    #[test]
    fn board_clips_where_it_was_left_clipping() {
        let mut firmware = StockFirmware::default();
        turn(&mut firmware, 0, 1200);
        assert_eq!(firmware.tick(1200, 0.0, false), -0.1);
    }

    #[test]
    fn slap_is_told_while_it_lasts() {
        let mut firmware = StockFirmware::default();
        let at = |firmware: &StockFirmware| (i64::from(firmware.angle_out) < PLUCK_AT, firmware.slap);
        turn(&mut firmware, 0, -1000);
        assert_eq!(at(&firmware), (false, 0.0));
        turn(&mut firmware, -1000, -1500);
        assert_eq!(at(&firmware), (true, -500.0 / 1500.0));
        turn(&mut firmware, -1500, -1501);
        assert_eq!(at(&firmware), (true, -1.0), "the jump of the stock law");
        turn(&mut firmware, -1501, -1100);
        assert_eq!(at(&firmware), (true, -1.0), "its most negative value stays");
        turn(&mut firmware, -1100, -1000);
        assert_eq!(at(&firmware), (false, 0.0));
    }

    #[test]
    fn reports_come_every_40_ms() {
        let mut firmware = StockFirmware::default();
        let reports: Vec<u32> = (1..=2000)
            .filter(|tick| {
                firmware.tick(i64::from(*tick), 0.0, false);
                firmware.report().is_some()
            })
            .collect();
        assert_eq!(reports.len(), 25);
        assert!(reports.windows(2).all(|w| w[1] - w[0] == 80));
    }

    #[test]
    fn presses_are_counted() {
        let mut firmware = StockFirmware::default();
        for tick in 0..400u64 {
            firmware.tick(0, 0.0, (tick / 50) % 2 == 1);
        }
        assert_eq!(firmware.report().unwrap()[7], ("button", OscValue::Int(4)));
    }
}
