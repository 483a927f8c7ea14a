//! Takes: what a hand did on a knob, as a table that can be played again and analysed.
//!
//! A CSV file whose first line names the columns; lines beginning with `#` are remarks. `t_us` and `angle_deg` are
//! needed, in any place; the others are what the study log has beside them and may be missing or empty. Unknown columns
//! are left alone. Time starts anywhere and may not go back; a take is replayed from its first row.

use crate::touch::study::{Condition, Side};
use std::io::{self, Read, Write};

/// Column names in the order they are written.
pub const HEADER: &str = "t_us,angle_deg,velocity_deg_s,torque_mnm,written_midi,gamma,feel_id,h,k,\
                          participant,trial,side,condition";
/// Rows a file may have: ten hours at 500 a second.
const MOST_ROWS: usize = 18_000_000;
/// Largest angle that makes sense, degrees: a hundred turns.
const MOST_DEG: f64 = 36_000.0;

/// One moment of a take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Time, microseconds.
    pub t_us: u64,
    /// Angle of the knob, degrees.
    pub angle_deg: f64,
    /// Its speed, degrees/s.
    pub velocity_deg_s: f64,
    /// Torque of the motor, mNm.
    pub torque_mnm: f64,
    /// Written note that is fingered, if any.
    pub written: Option<u8>,
    /// Mouth pressure over closing pressure.
    pub gamma: f64,
    /// Feel in force.
    pub feel_id: u8,
}

/// What a moment belongs to, for the analysis; a replay does without.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Marks {
    /// H and k of reed and feel, if known.
    pub reed: Option<(f64, f64)>,
    /// Participant, trial, side and condition, during a study.
    pub study: Option<(u32, u32, Side, Condition)>,
}

/// Why a file is no take.
#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    /// A needed column is missing.
    #[error("the first line has no column `{0}`; a take begins with a line such as `{HEADER}`")]
    Column(&'static str),
    /// A cell that is no number of the kind.
    #[error("line {line}: {column} is `{text}`; it must be {wanted}")]
    Cell {
        /// Line of the file, from 1.
        line: u64,
        /// Column's name.
        column: &'static str,
        /// What stands there.
        text: String,
        /// What should.
        wanted: &'static str,
    },
    /// Time runs backwards.
    #[error("line {line}: t_us goes back from {before} to {now}; a take runs forward")]
    Backwards {
        /// Line of the file.
        line: u64,
        /// The row before.
        before: u64,
        /// This row.
        now: u64,
    },
    /// No rows.
    #[error("the take has no rows")]
    Empty,
    /// Far too many.
    #[error("the take has more than {MOST_ROWS} rows; cut it into pieces")]
    TooLong,
    /// Not a table.
    #[error("not a CSV table: {0}")]
    Csv(#[from] csv::Error),
}

/// A take in memory, never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Take {
    moments: Vec<Moment>,
}

impl Take {
    /// Reads a take; the first mistake ends the reading and is named with its line.
    pub fn read(from: impl Read) -> Result<Self, TakeError> {
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(from);
        let header = reader.headers()?.clone();
        let place = |name: &str| header.iter().position(|column| column.eq_ignore_ascii_case(name));
        let t_at = place("t_us").ok_or(TakeError::Column("t_us"))?;
        let angle_at = place("angle_deg").ok_or(TakeError::Column("angle_deg"))?;
        let others = ["velocity_deg_s", "torque_mnm", "gamma"].map(|name| (name, place(name)));
        let (written_at, feel_at) = (place("written_midi"), place("feel_id"));
        let mut moments: Vec<Moment> = Vec::new();
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row)? {
            let line = row.position().map_or(0, csv::Position::line);
            if moments.len() == MOST_ROWS {
                return Err(TakeError::TooLong);
            }
            let text = |at: Option<usize>| at.and_then(|at| row.get(at)).unwrap_or("");
            let cell =
                |column, text: &str, wanted| TakeError::Cell { line, column, text: text.to_owned(), wanted };
            let t_us = text(Some(t_at));
            let t_us = t_us.parse().map_err(|_| cell("t_us", t_us, "a whole number of microseconds"))?;
            let number = |column, at, limit: f64, wanted| {
                let text = text(at);
                match text.parse::<f64>() {
                    Ok(x) if x.abs() <= limit => Ok(x),
                    _ => Err(cell(column, text, wanted)),
                }
            };
            let angle_deg = number("angle_deg", Some(angle_at), MOST_DEG, "degrees within 100 turns")?;
            let [velocity_deg_s, torque_mnm, gamma] = {
                let mut found = [0.0; 3];
                for (found, (column, at)) in found.iter_mut().zip(others) {
                    if !text(at).is_empty() {
                        *found = number(column, at, 1e9, "a number, or empty")?;
                    }
                }
                found
            };
            let small = |column, at| match text(at) {
                "" => Ok(None),
                text => text
                    .parse::<u8>()
                    .map(Some)
                    .map_err(|_| cell(column, text, "a whole number in 0..255, or empty")),
            };
            if let Some(before) = moments.last().map(|moment| moment.t_us).filter(|&before| before > t_us) {
                return Err(TakeError::Backwards { line, before, now: t_us });
            }
            moments.push(Moment {
                t_us,
                angle_deg,
                velocity_deg_s,
                torque_mnm,
                written: small("written_midi", written_at)?,
                gamma,
                feel_id: small("feel_id", feel_at)?.unwrap_or(0),
            });
        }
        if moments.is_empty() { Err(TakeError::Empty) } else { Ok(Self { moments }) }
    }

    /// All moments, in order of time.
    pub fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// Length, s.
    pub fn seconds(&self) -> f64 {
        1e-6 * (self.moments[self.moments.len() - 1].t_us - self.moments[0].t_us) as f64
    }

    /// The angle `t_s` seconds after the first row, linear between rows; before and after, that of the end.
    pub fn angle_deg(&self, t_s: f64) -> f64 {
        let t_us = self.moments[0].t_us as f64 + 1e6 * t_s;
        let next = self.moments.partition_point(|moment| (moment.t_us as f64) <= t_us);
        let Some(from) = next.checked_sub(1) else { return self.moments[0].angle_deg };
        let a = self.moments[from];
        let Some(b) = self.moments.get(next) else { return a.angle_deg };
        a.angle_deg + (b.angle_deg - a.angle_deg) * (t_us - a.t_us as f64) / (b.t_us - a.t_us) as f64
    }
}

/// Writes a take as a table.
pub struct TakeWriter<W> {
    out: W,
}

impl<W: Write> TakeWriter<W> {
    /// Begins with remarks (one a line) and the columns' names.
    pub fn new(mut out: W, remarks: &[String]) -> io::Result<Self> {
        for remark in remarks {
            writeln!(out, "# {}", remark.replace(['\r', '\n'], " "))?;
        }
        writeln!(out, "{HEADER}")?;
        Ok(Self { out })
    }

    /// One row.
    pub fn write(&mut self, moment: &Moment, marks: &Marks) -> io::Result<()> {
        let Moment { t_us, angle_deg, velocity_deg_s, torque_mnm, written, gamma, feel_id } = *moment;
        let written = written.map_or_else(String::new, |written| written.to_string());
        write!(
            self.out,
            "{t_us},{angle_deg:.2},{velocity_deg_s:.1},{torque_mnm:.0},{written},{gamma:.5},{feel_id},"
        )?;
        match marks.reed {
            Some((h, k)) => write!(self.out, "{h:.5},{k:.5},")?,
            None => write!(self.out, ",,")?,
        }
        match marks.study {
            Some((participant, trial, side, condition)) => {
                let side = match side {
                    Side::A => "A",
                    Side::B => "B",
                };
                writeln!(self.out, "{participant},{trial},{side},{}", condition.name())
            }
            None => writeln!(self.out, ",,,"),
        }
    }

    /// Where the take is written.
    pub fn get_ref(&self) -> &W {
        &self.out
    }

    /// Where the take was written.
    pub fn into_inner(self) -> W {
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Take, TakeError> {
        Take::read(text.as_bytes())
    }

    #[test]
    fn what_is_written_is_read_again() {
        let moments: Vec<Moment> = (0..50)
            .map(|n| Moment {
                t_us: 1_000_000 + 2_000 * n,
                angle_deg: -3.25 + n as f64,
                velocity_deg_s: 500.0,
                torque_mnm: -17.0,
                written: (n > 10).then_some(60),
                gamma: 0.5,
                feel_id: n as u8,
            })
            .collect();
        let mut writer = TakeWriter::new(Vec::new(), &["participant\n7".to_owned()]).unwrap();
        for moment in &moments {
            writer.write(moment, &Marks::default()).unwrap();
        }
        let take = Take::read(&*writer.into_inner()).unwrap();
        assert_eq!(take.moments(), moments);
        assert!((take.seconds() - 0.098).abs() < 1e-12);
    }

    #[test]
    fn two_columns_are_enough_and_the_angle_runs_between_rows() {
        let take = read("# by hand\nangle_deg, t_us\n0,0\n10,1000\n10,1000\n30,3000\n").unwrap();
        for (t_s, angle_deg) in [(-1.0, 0.0), (0.0, 0.0), (0.0005, 5.0), (0.002, 20.0), (9.0, 30.0)] {
            assert!((take.angle_deg(t_s) - angle_deg).abs() < 1e-9, "{t_s}");
        }
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, said) in [
            ("", "no column `t_us`"),
            ("t_us,angle\n", "no column `angle_deg`"),
            ("t_us,angle_deg\n", "no rows"),
            ("t_us,angle_deg\n1,2\nx,3\n", "line 3: t_us is `x`"),
            ("t_us,angle_deg\n1,nan\n", "line 2: angle_deg is `nan`"),
            ("t_us,angle_deg\n1,1e9\n", "within 100 turns"),
            ("t_us,angle_deg\n5,1\n4,1\n", "line 3: t_us goes back from 5 to 4"),
            ("t_us,angle_deg,written_midi\n5,1,300\n", "written_midi is `300`"),
            ("t_us,angle_deg,gamma\n5,1,loud\n", "gamma is `loud`"),
            ("t_us,angle_deg\n5\n", "angle_deg is ``"),
            ("t_us,angle_deg\n5,\u{0}\n", "angle_deg"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text:?}: {error}");
        }
        assert!(Take::read(&b"t_us,angle_deg\n\xff,1\n"[..]).is_err());
    }
}
