//! Reads and writes takes as CSV files, with the columns of the study log.
//!
//! The first line names the columns; lines that begin with `#` are comments. `t_us` and `angle_deg` are required, at any
//! place; the other columns may be missing or empty. Unknown columns are ignored. Time may start anywhere but must not
//! go back; a replay starts at the first row. Above the columns, comments say what was played and felt ([`TakeHead`]).

use crate::touch::angle::KnobDesign;
use crate::touch::study::StudySide;
use crate::touch::take::{Take, TakeEmbouchure, TakeHand, TakeHead, TakeMarks, TakeRow};
use std::io::{self, BufRead, BufReader, Read, Write};

/// Column names in the order they are written.
pub const HEADER: &str = "t_us,angle_deg,velocity_deg_s,torque_mnm,written_midi,gamma,feel_id,h,k,\
                          participant,trial,side,condition,gamma_sounding,level_db,f0_hz,heard_us,armed";
/// Rows a file may have: ten hours at 500 a second.
const MOST_ROWS: usize = 18_000_000;
/// Largest angle that makes sense, degrees: a hundred turns.
const MOST_DEG: f64 = 36_000.0;
/// Largest magnitude of any other number; only keeps out what no knob measures.
const MOST_MEASURED: f64 = 1e9;

/// How the comments begin that are read; all others are for people.
const HAND: &str = "hand zero_deg=";
const INSTRUMENT: &str = "instrument ";
const FEEL: &str = "feel --";
const REED: &str = "reed zeta=";
/// Most bytes of the comments above the columns that are read as such.
const HEAD_MOST: u64 = 65_536;

/// Why a file cannot be read as a take. Lines count from 1.
#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    /// A required column is missing.
    #[error("the first line has no column `{0}`; a take begins with a line such as `{HEADER}`")]
    Column(&'static str),
    /// A cell does not hold a number of the right kind.
    #[error("line {line}: {column} is `{text}`; it must be {wanted}")]
    Cell {
        /// Line of the file, from 1.
        line: u64,
        /// Column's name.
        column: &'static str,
        /// Its text.
        text: String,
        /// What it should hold.
        wanted: &'static str,
    },
    /// Time runs backwards.
    #[error("line {line}: t_us goes back from {before} to {now}; a take runs forward")]
    Backwards {
        /// Line of the file.
        line: u64,
        /// Time of the row before, us.
        before: u64,
        /// Time of this row, us.
        now: u64,
    },
    /// One of the comments that are read.
    #[error("`{0}` cannot be read; correct that line, or remove it")]
    Comment(String),
    /// No rows.
    #[error("the take has no rows")]
    Empty,
    /// Too many rows.
    #[error("the take has more than {MOST_ROWS} rows; cut it into pieces")]
    TooLong,
    /// Not a CSV table.
    #[error("not a CSV table: {0}")]
    Csv(#[from] csv::Error),
}

impl Take {
    /// Reads a take from a CSV file. The first error ends the reading; its text names the line.
    pub fn read(from: impl Read) -> Result<Self, TakeError> {
        let mut from = BufReader::new(from);
        let mut above = Vec::new();
        let broken = csv::Error::from;
        while (above.len() as u64) < HEAD_MOST && from.fill_buf().map_err(broken)?.first() == Some(&b'#') {
            from.by_ref().take(HEAD_MOST).read_until(b'\n', &mut above).map_err(broken)?;
        }
        let comments = String::from_utf8_lossy(&above).into_owned();
        let head = TakeHead::read(&comments)?;
        // The reader counts the lines.
        let from = above.chain(from);
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(from);
        let columns = Columns::find(reader.headers()?)?;
        let mut rows: Vec<TakeRow> = Vec::new();
        let (mut reed, mut has_one_reed) = (None, true);
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record)? {
            if rows.len() == MOST_ROWS {
                return Err(TakeError::TooLong);
            }
            let row = columns.row(&record)?;
            if let Some(before) = rows.last().map(|last| last.t_us).filter(|&before| before > row.t_us) {
                return Err(TakeError::Backwards { line: line(&record), before, now: row.t_us });
            }
            if let Some(own) = columns.reed(&record)? {
                has_one_reed &= *reed.get_or_insert(own) == own;
            }
            rows.push(row);
        }
        if rows.is_empty() { Err(TakeError::Empty) } else { Ok(Self { rows, head, reed, has_one_reed }) }
    }
}

/// The value of `name=value` among words.
fn value<'a>(words: &'a str, name: &str) -> Option<&'a str> {
    words.split(' ').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))
}

impl TakeHead {
    /// The comments that say it, without their `#`.
    pub fn remarks(&self) -> Vec<String> {
        let Self { instrument, feel, hand, embouchure } = self;
        [
            instrument.as_ref().map(|name| format!("{INSTRUMENT}{name}")),
            feel.as_ref().map(|flags| format!("feel {flags}")),
            hand.as_ref().map(TakeHand::remark),
            embouchure.as_ref().map(TakeEmbouchure::remark),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Reads the comments above the columns. The error names the first that is wrong.
    fn read(comments: &str) -> Result<Self, TakeError> {
        let mut head = Self::default();
        for line in comments.lines() {
            let Some(said) = line.strip_prefix('#').map(str::trim) else { continue };
            let wrong = || TakeError::Comment(line.to_owned());
            if let Some(name) = said.strip_prefix(INSTRUMENT) {
                head.instrument = Some(name.to_owned());
            } else if said.starts_with(FEEL) {
                head.feel = said.strip_prefix("feel ").map(str::to_owned);
            } else if said.starts_with(HAND) {
                head.hand = Some(TakeHand::read(said).ok_or_else(wrong)?);
            } else if said.starts_with(REED) {
                head.embouchure = Some(TakeEmbouchure::read(said).ok_or_else(wrong)?);
            }
        }
        Ok(head)
    }
}

impl TakeHand {
    fn remark(&self) -> String {
        let KnobDesign { zero_deg, full_deg, curve, dead_on_deg, dead_off_deg } = self.design;
        let feels = self.feels;
        format!(
            "{HAND}{zero_deg} full_deg={full_deg} curve={curve} dead_on_deg={dead_on_deg} \
             dead_off_deg={dead_off_deg} feels={feels}"
        )
    }

    fn read(said: &str) -> Option<Self> {
        let number = |name| value(said, name)?.parse::<f64>().ok();
        let design = KnobDesign {
            zero_deg: number("zero_deg")?,
            full_deg: number("full_deg")?,
            curve: number("curve")?,
            dead_on_deg: number("dead_on_deg")?,
            dead_off_deg: number("dead_off_deg")?,
        };
        design.check().ok()?;
        Some(Self { design, feels: value(said, "feels")?.parse().ok()? })
    }
}

impl TakeEmbouchure {
    fn remark(&self) -> String {
        let Self { zeta, strength, lip } = self;
        format!("{REED}{zeta} strength={strength} lip={lip}")
    }

    fn read(said: &str) -> Option<Self> {
        let number = |name| value(said, name)?.parse::<f32>().ok().filter(|number| number.is_finite());
        Some(Self { zeta: number("zeta")?, strength: number("strength")?, lip: number("lip")? })
    }
}

/// A column's name, and its place in the file if the file has it.
type Column = (&'static str, Option<usize>);

/// Where a file has each column.
struct Columns {
    t_us: Column,
    angle_deg: Column,
    velocity_deg_s: Column,
    torque_mnm: Column,
    written: Column,
    gamma: Column,
    feel_id: Column,
    h: Column,
    k: Column,
    armed: Column,
}

impl Columns {
    fn find(header: &csv::StringRecord) -> Result<Self, TakeError> {
        let column = |name: &'static str| -> Column {
            (name, header.iter().position(|column| column.eq_ignore_ascii_case(name)))
        };
        let required = |name| match column(name) {
            (_, None) => Err(TakeError::Column(name)),
            found => Ok(found),
        };
        Ok(Self {
            t_us: required("t_us")?,
            angle_deg: required("angle_deg")?,
            velocity_deg_s: column("velocity_deg_s"),
            torque_mnm: column("torque_mnm"),
            written: column("written_midi"),
            gamma: column("gamma"),
            feel_id: column("feel_id"),
            h: column("h"),
            k: column("k"),
            armed: column("armed"),
        })
    }

    /// H and k of a row, if it tells both.
    fn reed(&self, record: &csv::StringRecord) -> Result<Option<(f64, f64)>, TakeError> {
        if [self.h, self.k].iter().any(|&column| cell(record, column).is_empty()) {
            return Ok(None);
        }
        let value = |column| number(record, column, MOST_MEASURED, "a number, or empty");
        Ok(Some((value(self.h)?, value(self.k)?)))
    }

    fn row(&self, record: &csv::StringRecord) -> Result<TakeRow, TakeError> {
        let measured = |column| match cell(record, column) {
            "" => Ok(0.0),
            _ => number(record, column, MOST_MEASURED, "a number, or empty"),
        };
        let small = |column| match cell(record, column) {
            "" => Ok(None),
            text => text
                .parse::<u8>()
                .map(Some)
                .map_err(|_| refuse(record, column, "a whole number in 0..255, or empty")),
        };
        let t_us = cell(record, self.t_us).parse();
        Ok(TakeRow {
            t_us: t_us.map_err(|_| refuse(record, self.t_us, "a whole number of microseconds"))?,
            angle_deg: number(record, self.angle_deg, MOST_DEG, "degrees within 100 turns")?,
            velocity_deg_s: measured(self.velocity_deg_s)?,
            torque_mnm: match cell(record, self.torque_mnm) {
                "" => None,
                _ => Some(measured(self.torque_mnm)?),
            },
            written: small(self.written)?,
            gamma: measured(self.gamma)?,
            feel_id: small(self.feel_id)?.unwrap_or(0),
            armed: match cell(record, self.armed) {
                "" => None,
                "0" => Some(false),
                "1" => Some(true),
                _ => return Err(refuse(record, self.armed, "0 or 1, or empty")),
            },
        })
    }
}

/// Line of a record in its file, from 1.
fn line(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

fn cell(record: &csv::StringRecord, (_, at): Column) -> &str {
    at.and_then(|at| record.get(at)).unwrap_or("")
}

fn number(
    record: &csv::StringRecord,
    column: Column,
    limit: f64,
    wanted: &'static str,
) -> Result<f64, TakeError> {
    match cell(record, column).parse::<f64>() {
        Ok(value) if value.abs() <= limit => Ok(value),
        _ => Err(refuse(record, column, wanted)),
    }
}

fn refuse(record: &csv::StringRecord, column: Column, wanted: &'static str) -> TakeError {
    let text = cell(record, column).to_owned();
    TakeError::Cell { line: line(record), column: column.0, text, wanted }
}

/// Writes a take as a CSV file.
pub struct TakeWriter<W> {
    out: W,
}

impl<W: Write> TakeWriter<W> {
    /// Begins with comments (one a line) and the names of the columns. Errors are those of `out`.
    pub fn new(mut out: W, comments: &[String]) -> io::Result<Self> {
        for comment in comments {
            writeln!(out, "# {}", comment.replace(['\r', '\n'], " "))?;
        }
        writeln!(out, "{HEADER}")?;
        Ok(Self { out })
    }

    /// Writes one row. Errors are those of the output.
    pub fn write(&mut self, row: &TakeRow, marks: &TakeMarks) -> io::Result<()> {
        let TakeRow { t_us, angle_deg, velocity_deg_s, torque_mnm, written, gamma, feel_id, armed } = *row;
        let written = written.map_or_else(String::new, |written| written.to_string());
        let torque_mnm = torque_mnm.map_or_else(String::new, |mnm| format!("{mnm:.0}"));
        write!(
            self.out,
            "{t_us},{angle_deg:.2},{velocity_deg_s:.1},{torque_mnm},{written},{gamma:.5},{feel_id},"
        )?;
        match marks.reed {
            Some((h, k)) => write!(self.out, "{h:.5},{k:.5},")?,
            None => write!(self.out, ",,")?,
        }
        match marks.study {
            Some((participant, trial, side, condition)) => {
                let side = match side {
                    StudySide::A => "A",
                    StudySide::B => "B",
                };
                write!(self.out, "{participant},{trial},{side},{},", condition.name())?;
            }
            None => write!(self.out, ",,,,")?,
        }
        let cell = |value: Option<f64>, digits: usize| {
            value.map_or_else(String::new, |value| format!("{value:.digits$}"))
        };
        let onset_us = marks.heard.onset_us.map_or_else(String::new, |t_us| t_us.to_string());
        writeln!(
            self.out,
            "{},{},{},{onset_us},{}",
            cell(marks.sounds_from, 5),
            cell(marks.heard.level_db, 1),
            cell(marks.heard.f0_hz, 2),
            armed.map_or("", |armed| if armed { "1" } else { "0" })
        )
    }

    /// The output.
    pub fn get_ref(&self) -> &W {
        &self.out
    }

    /// Gives the output back.
    pub fn into_inner(self) -> W {
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::heard::Heard;
    use crate::touch::study::Condition;

    fn read(text: &str) -> Result<Take, TakeError> {
        Take::read(text.as_bytes())
    }

    #[test]
    fn what_is_written_is_read_again() {
        let rows: Vec<TakeRow> = (0..50)
            .map(|n| TakeRow {
                t_us: 1_000_000 + 2_000 * n,
                angle_deg: -3.25 + n as f64,
                velocity_deg_s: 500.0,
                torque_mnm: (n > 20).then_some(-17.0),
                written: (n > 10).then_some(60),
                gamma: 0.5,
                feel_id: n as u8,
                armed: (n > 5).then_some(n > 20),
            })
            .collect();
        let mut writer = TakeWriter::new(Vec::new(), &["participant\n7".to_owned()]).unwrap();
        for row in &rows {
            writer.write(row, &TakeMarks::default()).unwrap();
        }
        let take = Take::read(&*writer.into_inner()).unwrap();
        assert_eq!(take.rows(), rows);
        assert!((take.seconds() - 0.098).abs() < 1e-12);
    }

    #[test]
    fn marks_stand_in_their_columns_and_are_empty_where_nothing_is_known() {
        let heard = Heard { level_db: Some(-23.46), f0_hz: Some(233.082), onset_us: Some(1_234_567) };
        let study = Some((7, 3, StudySide::B, Condition::Free));
        let known = TakeMarks { reed: Some((2.0, 0.3849)), study, sounds_from: Some(0.371_234), heard };
        let mut writer = TakeWriter::new(Vec::new(), &[]).unwrap();
        for marks in [known, TakeMarks::default()] {
            writer.write(&TakeRow::default(), &marks).unwrap();
        }
        let text = String::from_utf8(writer.into_inner()).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{text}");
        let cell =
            |row: usize, name: &str| rows[row][rows[0].iter().position(|column| *column == name).unwrap()];
        for (name, text) in [
            ("h", "2.00000"),
            ("side", "B"),
            ("condition", "free"),
            ("gamma_sounding", "0.37123"),
            ("level_db", "-23.5"),
            ("f0_hz", "233.08"),
            ("heard_us", "1234567"),
        ] {
            assert_eq!((cell(1, name), cell(2, name)), (text, ""), "{name}");
        }
    }

    #[test]
    fn a_take_says_what_was_played_and_felt() {
        let usual = KnobDesign::default();
        let design = KnobDesign { zero_deg: 40.5, full_deg: 400.0, curve: 2.0, ..usual };
        let head = TakeHead {
            instrument: Some("my #1".to_owned()),
            feel: Some("--law pressure --place 2".to_owned()),
            hand: Some(TakeHand { design, feels: false }),
            embouchure: Some(TakeEmbouchure { zeta: 0.3, strength: 2.5, lip: 1.1 }),
        };
        let mut writer = TakeWriter::new(Vec::new(), &head.remarks()).unwrap();
        for reed in [None, Some((2.0, 0.5)), Some((2.0, 0.5))] {
            writer.write(&TakeRow::default(), &TakeMarks { reed, ..TakeMarks::default() }).unwrap();
        }
        let take = Take::read(&*writer.into_inner()).unwrap();
        assert_eq!((take.head(), take.reed()), (&head, Some(((2.0, 0.5), true))));
        let two = read("t_us,angle_deg,h,k\n0,1,2,0.5\n1,1,3,0.5\n2,1,,\n").unwrap();
        assert_eq!(
            (two.reed(), two.hand(design)),
            (Some(((2.0, 0.5), false)), TakeHand { design, feels: true })
        );
        // What people write, and what the plugin wrote before.
        let words = "# feel FeelDesign { law: Flow }\n# hand over the knob\n# feel was odd\n";
        assert_eq!(read(&format!("{words}t_us,angle_deg\n0,1\n")).unwrap().head(), &TakeHead::default());
        let [hand, reed] = [&head.remarks()[2], &head.remarks()[3]];
        for wrong in [hand.replace("curve=2", "curve=9"), reed.replace("lip=1.1", "lip=loose")] {
            let error = read(&format!("# {wrong}\nt_us,angle_deg\n0,1\n")).unwrap_err().to_string();
            assert!(error.contains(&wrong), "{error}");
        }
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
            ("# a\n# b\nt_us,angle_deg\n1,1e9\n", "line 4"),
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
