//! What a hand is to do over time: rows of angle or torque, drawn as straight lines between them.
//!
//! A script is a CSV file with a header: `t_s`, then `angle_deg` (the fingers go there) or `force_mnm` (they press), and if
//! wanted `grip` (0 no hand, 1 a firm one) and `button` (0 or 1). Before the first row and after the last, values hold.
//! The shapes of the command line (`--hold`, `--crescendo`, `--press`, `--slap`) are short scripts.

use std::io;

/// Largest angle of a script, degrees: a hundred turns.
const ANGLE_MAX_DEG: f64 = 36_000.0;

/// Largest torque of a script, mNm: more than fingers have on a knob of this size.
const FORCE_MAX_MNM: f64 = 1000.0;

/// Longest script, rows.
const ROWS_MAX: usize = 1_000_000;

/// How fast `--hold` turns to its angle, degrees per second. Judgement: an unhurried hand.
const REACH_DEG_PER_S: f64 = 180.0;

/// Why a script was refused. Lines are counted from 1.
#[derive(Debug, thiserror::Error)]
pub enum ScriptError {
    /// The file cannot be read, or is no CSV.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// Not the columns of a script.
    #[error(
        "the header must be t_s,angle_deg or t_s,force_mnm, then grip and button if wanted; got {given:?}"
    )]
    Header {
        /// The header as it stands.
        given: String,
    },
    /// Another number of fields than the header has.
    #[error("line {line}: expected {wanted} fields as in the header, got {given}")]
    Fields {
        /// Line in the file.
        line: u64,
        /// Columns of the header.
        wanted: usize,
        /// Fields there are.
        given: usize,
    },
    /// Not a number, or outside its range.
    #[error("line {line}: {column} must be a number in {low}..{high}, got {given:?}")]
    Number {
        /// Line in the file.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Least.
        low: f64,
        /// Most.
        high: f64,
        /// The field as it stands.
        given: String,
    },
    /// Time stands still or goes back.
    #[error("line {line}: t_s must grow from row to row, got {given} after {before}")]
    Time {
        /// Line in the file.
        line: u64,
        /// Time of this row, s.
        given: f64,
        /// Time of the row before, s.
        before: f64,
    },
    /// Nothing to do.
    #[error("no rows: expected lines such as 0.0,90")]
    Empty,
    /// Longer than anyone turns.
    #[error("more than {ROWS_MAX} rows; a few per second are enough")]
    TooLong,
    /// A crescendo in words that is none.
    #[error("a crescendo is FROM:TO:SECONDS in degrees and seconds, for example 0:200:6; got {0:?}")]
    Crescendo(String),
}

/// What the fingers want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aim {
    /// The knob at this angle, degrees.
    Angle(f64),
    /// This torque on the knob, mNm.
    Force(f64),
}

/// One moment of a script.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScriptPoint {
    /// What the fingers want.
    pub aim: Aim,
    /// 0 no hand ..1 a firm one.
    pub grip_unit: f64,
    /// Whether the button is held down.
    pub button: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    t_s: f64,
    value: f64,
    grip_unit: f64,
    button: bool,
}

/// Aim over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    /// Time grows strictly. Never empty.
    rows: Vec<Row>,
    is_force: bool,
    is_loop: bool,
}

fn row(t_s: f64, value: f64) -> Row {
    Row { t_s, value, grip_unit: 1.0, button: false }
}

impl Script {
    fn angles(rows: &[(f64, f64)]) -> Self {
        let rows = rows.iter().map(|&(t_s, deg)| row(t_s, deg)).collect();
        Self { rows, is_force: false, is_loop: false }
    }

    /// Turns to an angle, degrees, and stays.
    pub fn hold(deg: f64) -> Self {
        let reach_s = (deg.abs() / REACH_DEG_PER_S).max(0.1);
        Self::angles(&[(0.0, 0.0), (reach_s, deg)])
    }

    /// Presses with a constant torque, mNm, after half a second of taking hold.
    pub fn press(mnm: f64) -> Self {
        Self { rows: vec![row(0.0, 0.0), row(0.5, mnm)], is_force: true, is_loop: false }
    }

    /// A tongue slap: out beyond -150 degrees and back, within the time a tongue takes, then a second of rest.
    pub fn slap() -> Self {
        // By judgement: 170 degrees in 0.12 s is 25 rad/s, a flick; 60 rad/s would trip the over-speed limit.
        Self::angles(&[(0.0, 0.0), (1.0, 0.0), (1.12, -170.0), (1.24, 0.0), (2.24, 0.0)])
    }

    /// `FROM:TO:SECONDS`: from one angle to another at constant speed.
    pub fn parse_crescendo(text: &str) -> Result<Self, ScriptError> {
        let bad = || ScriptError::Crescendo(text.to_owned());
        let numbers: Option<Vec<f64>> = text.split(':').map(|field| field.trim().parse().ok()).collect();
        let numbers = numbers.ok_or_else(bad)?;
        let &[from, to, seconds] = numbers.as_slice() else { return Err(bad()) };
        let is_angle = |deg: f64| deg.abs() <= ANGLE_MAX_DEG;
        if !(is_angle(from) && is_angle(to) && seconds > 0.0 && seconds <= 86_400.0) {
            return Err(bad());
        }
        // The way to the beginning is a hold, so that the crescendo itself starts at rest.
        let reach_s = (from.abs() / REACH_DEG_PER_S).max(0.1);
        Ok(Self::angles(&[(0.0, 0.0), (reach_s, from), (reach_s + seconds, to)]))
    }

    /// Reads the CSV form. `#` begins a comment line.
    pub fn read_csv(from: impl io::Read) -> Result<Self, ScriptError> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(from);
        let header: Vec<String> = reader.headers()?.iter().map(|name| name.to_lowercase()).collect();
        let bad = || ScriptError::Header { given: header.join(",") };
        let is_force =
            match header.iter().map(|name| name.trim_start_matches('\u{feff}')).collect::<Vec<_>>()[..] {
                ["t_s", "angle_deg", ..] => false,
                ["t_s", "force_mnm", ..] => true,
                _ => return Err(bad()),
            };
        let column = |name| header.iter().position(|other| other == name);
        let (grip, button) = (column("grip"), column("button"));
        if 2 + usize::from(grip.is_some()) + usize::from(button.is_some()) != header.len() {
            return Err(bad());
        }
        let (value_name, value_max) =
            if is_force { ("force_mnm", FORCE_MAX_MNM) } else { ("angle_deg", ANGLE_MAX_DEG) };
        let mut rows: Vec<Row> = Vec::new();
        for record in reader.records() {
            let record = record?;
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != header.len() {
                return Err(ScriptError::Fields { line, wanted: header.len(), given: record.len() });
            }
            let number = |at: usize, column, low: f64, high: f64| {
                let number = record[at].parse::<f64>().ok().filter(|x| (low..=high).contains(x));
                let given = record[at].to_owned();
                number.ok_or(ScriptError::Number { line, column, low, high, given })
            };
            let t_s = number(0, "t_s", 0.0, 86_400.0)?;
            let value = number(1, value_name, -value_max, value_max)?;
            let grip_unit = grip.map_or(Ok(1.0), |at| number(at, "grip", 0.0, 1.0))?;
            let button = button.map_or(Ok(0.0), |at| number(at, "button", 0.0, 1.0))? >= 0.5;
            if let Some(before) = rows.last().map(|row| row.t_s).filter(|before| t_s <= *before) {
                return Err(ScriptError::Time { line, given: t_s, before });
            }
            if rows.len() == ROWS_MAX {
                return Err(ScriptError::TooLong);
            }
            rows.push(Row { t_s, value, grip_unit, button });
        }
        if rows.is_empty() { Err(ScriptError::Empty) } else { Ok(Self { rows, is_force, is_loop: false }) }
    }

    /// And back to where it began: before it is repeated, for a jump would trip the knob's over-speed limit.
    pub fn returning(mut self) -> Self {
        let (first, last) = (self.rows[0], self.rows[self.rows.len() - 1]);
        let way_deg = (last.value - first.value).abs();
        if !self.is_force && way_deg > 0.0 {
            self.rows.push(Row { t_s: last.t_s + way_deg / REACH_DEG_PER_S, ..first });
        }
        self
    }

    /// The same again and again.
    pub fn repeated(mut self) -> Self {
        self.is_loop = true;
        self
    }

    /// Time of the last row, s.
    pub fn length_s(&self) -> f64 {
        self.rows[self.rows.len() - 1].t_s
    }

    /// What to do at a time, s.
    pub fn at(&self, t_s: f64) -> ScriptPoint {
        let length_s = self.length_s();
        let t_s = if self.is_loop && length_s > 0.0 { t_s.rem_euclid(length_s) } else { t_s };
        let next = self.rows.partition_point(|row| row.t_s <= t_s);
        let before = self.rows[next.saturating_sub(1)];
        let (value, grip_unit) = match self.rows.get(next) {
            Some(after) if next > 0 => {
                let part = (t_s - before.t_s) / (after.t_s - before.t_s);
                let between = |a: f64, b: f64| a + part * (b - a);
                (between(before.value, after.value), between(before.grip_unit, after.grip_unit))
            }
            _ => (before.value, before.grip_unit),
        };
        let aim = if self.is_force { Aim::Force(value) } else { Aim::Angle(value) };
        ScriptPoint { aim, grip_unit, button: before.button && next > 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        Script::read_csv(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn rows_are_joined_by_lines() {
        let text = "# made by hand\nt_s, angle_deg, grip, button\n1, 0, 1, 0\n2, 90, 0.5, 1\n\n4, 80, 1, 0\n";
        let script = Script::read_csv(text.as_bytes()).unwrap();
        let moment = |deg, grip_unit, button| ScriptPoint { aim: Aim::Angle(deg), grip_unit, button };
        assert_eq!(script.at(0.0), moment(0.0, 1.0, false));
        assert_eq!(script.at(1.5), moment(45.0, 0.75, false));
        assert_eq!(script.at(3.0), moment(85.0, 0.75, true));
        assert_eq!(script.at(99.0), moment(80.0, 1.0, false));
        assert_eq!(script.repeated().at(5.5), moment(45.0, 0.75, false));
    }

    #[test]
    fn force_is_told_from_angle_by_its_header() {
        let script = Script::read_csv("t_s,force_mnm\n0,20\n1,40\n".as_bytes()).unwrap();
        assert_eq!(script.at(0.5).aim, Aim::Force(30.0));
    }

    #[test]
    fn errors_say_where_and_what() {
        for (text, says) in [
            ("", "t_s,angle_deg"),
            ("0,1\n1,2\n", "got \"0,1\""),
            ("t_s,angle_deg,colour\n0,1,2\n", "colour"),
            ("t_s,angle_deg\n", "no rows"),
            ("t_s,angle_deg\n0,1,2\n", "line 2: expected 2 fields as in the header, got 3"),
            (
                "t_s,angle_deg\n0,1\n1,much\n",
                "line 3: angle_deg must be a number in -36000..36000, got \"much\"",
            ),
            ("t_s,angle_deg\n0,nan\n", "line 2: angle_deg"),
            ("t_s,force_mnm\n0,1001\n", "force_mnm must be a number in -1000..1000"),
            ("t_s,angle_deg,grip\n0,1,2\n", "grip must be a number in 0..1"),
            ("t_s,angle_deg\n0,1\n2,1\n2,1\n", "line 4: t_s must grow from row to row, got 2 after 2"),
            ("t_s,angle_deg\n-1,1\n", "line 2: t_s"),
        ] {
            let said = refused(text);
            assert!(said.contains(says), "{text:?}: {said}");
        }
    }

    #[test]
    fn crescendo_is_read_or_explained() {
        let script = Script::parse_crescendo("90:270:4").unwrap();
        assert_eq!(script.at(script.length_s() - 2.0).aim, Aim::Angle(180.0));
        assert_eq!(script.length_s(), 4.5);
        for bad in ["", "1:2", "1:2:0", "1:2:-3", "a:2:3", "1:2:3:4", "1:inf:3", "1:2:nan"] {
            assert!(
                Script::parse_crescendo(bad).unwrap_err().to_string().contains("FROM:TO:SECONDS"),
                "{bad}"
            );
        }
    }

    #[test]
    fn a_crescendo_is_repeated_without_a_jump() {
        let script = Script::parse_crescendo("60:220:4").unwrap().returning().repeated();
        let deg = |t: f64| match script.at(t).aim {
            Aim::Angle(deg) => deg,
            Aim::Force(_) => unreachable!(),
        };
        let steps: Vec<f64> = (0..15_000).map(|ms| deg(f64::from(ms) / 1000.0)).collect();
        assert!(steps.iter().any(|deg| *deg > 219.0));
        let fastest = steps.windows(2).map(|w| (w[1] - w[0]).abs() * 1000.0).fold(0.0, f64::max);
        assert!(fastest < 1.1 * REACH_DEG_PER_S, "{fastest} degrees a second");
    }

    #[test]
    fn slap_reaches_its_region_below_over_speed() {
        let script = Script::slap();
        let deg = |t: f64| match script.at(t).aim {
            Aim::Angle(deg) => deg,
            Aim::Force(_) => unreachable!(),
        };
        let steps: Vec<f64> = (0..3000).map(|ms| deg(f64::from(ms) / 1000.0)).collect();
        assert!(steps.iter().any(|deg| *deg < -150.0));
        let fastest = steps.windows(2).map(|w| (w[1] - w[0]).abs() * 1000.0).fold(0.0, f64::max);
        assert!(fastest.to_radians() < 60.0, "{fastest} degrees a second");
    }
}
