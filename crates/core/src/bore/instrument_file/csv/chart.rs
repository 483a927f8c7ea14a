//! The fingering chart as a table: one line a note, one column a hole.

use csv::StringRecord;

use super::{ImportError, Sheet, Table};
use crate::bore::instrument_file::raw::{Lined, RawFingering};
use crate::bore::instrument_file::words::{Word, Words};
use crate::units::{WrittenNote, midi_of_name};

const CHART_EXAMPLE: &str = "written_note,register,mode,L1,L2,L3,fingers";

/// Columns of a chart that are no holes.
const CHART_COLUMNS: [&str; 9] = [
    "written_note",
    "written_midi",
    "sounding_note",
    "sounding_midi",
    "f_et440_hz",
    "register",
    "mode",
    "register_mode",
    "fingers",
];

pub(super) struct Chart {
    pub(super) notes: Vec<Lined<RawFingering>>,
    /// What the sounding notes show, if there are any.
    pub(super) transposition: Option<i64>,
    /// Whether a column says which peaks sound.
    pub(super) has_modes: bool,
}

/// Which columns of a chart hold what.
struct ChartColumns<'a> {
    note: Option<usize>,
    midi: Option<usize>,
    /// The one of the two above that messages name.
    written: usize,
    sounding_note: Option<usize>,
    sounding_midi: Option<usize>,
    register: Option<usize>,
    mode: Option<usize>,
    fingers: Option<usize>,
    /// Name and column of each hole.
    holes: Vec<(&'a str, usize)>,
}

impl<'a> ChartColumns<'a> {
    fn of(table: &Table, holes: &[&'a str]) -> Result<Self, ImportError> {
        let (note, midi) = (table.optional(&["written_note"])?, table.optional(&["written_midi"])?);
        let written = match note.or(midi) {
            Some(index) => index,
            None => table.required(&["written_note", "written_midi"])?,
        };
        let (sounding_note, sounding_midi) =
            (table.optional(&["sounding_note"])?, table.optional(&["sounding_midi"])?);
        let register = table.optional(&["register"])?;
        let mode = table.optional(&["mode", "register_mode"])?;
        let fingers = table.optional(&["fingers"])?;
        let mut known = CHART_COLUMNS.to_vec();
        known.extend(holes);
        table.only(&known, || format!("{} and the holes {}", CHART_COLUMNS.join(", "), holes.join(" ")))?;
        let mut columns = Vec::with_capacity(holes.len());
        for &hole in holes {
            // A hole called like a column of the chart cannot be told from it.
            if CHART_COLUMNS.contains(&hole) {
                let (first, second) = (hole.to_owned(), format!("a hole called {hole}"));
                return Err(ImportError::TwoColumns { file: table.file.clone(), first, second });
            }
            columns.push((hole, table.required(&[hole])?));
        }
        let holes = columns;
        Ok(Self { note, midi, written, sounding_note, sounding_midi, register, mode, fingers, holes })
    }
}

/// One line of a chart.
struct ChartRow<'a> {
    table: &'a Table,
    line: u64,
    row: &'a StringRecord,
}

impl ChartRow<'_> {
    fn text(&self, index: usize) -> &str {
        self.row.get(index).unwrap_or_default()
    }

    /// The error of a field that is not as `expected`.
    fn wrong(&self, index: usize, expected: impl Into<String>) -> ImportError {
        self.table.field(self.line, index, self.text(index), expected)
    }

    /// A note by name or by number; where both are given they must agree.
    fn pitch(&self, name: Option<usize>, number: Option<usize>) -> Result<Option<u8>, ImportError> {
        let by_name = match name {
            Some(index) => Some(
                midi_of_name(self.text(index))
                    .ok_or_else(|| self.wrong(index, "a note like E3, F#4 or Bb4, from C-1 to G9"))?,
            ),
            None => None,
        };
        let by_number = match number {
            Some(index) => {
                let midi = self.text(index).parse::<u8>().ok().filter(|&midi| midi < 128);
                Some(midi.ok_or_else(|| self.wrong(index, "a MIDI number, 0 to 127"))?)
            }
            None => None,
        };
        match (by_name, by_number, number) {
            (Some(named), Some(numbered), Some(index)) if named != numbered => {
                Err(self.wrong(index, format!("{named}, the number of {}", WrittenNote(named))))
            }
            (named, numbered, _) => Ok(named.or(numbered)),
        }
    }

    /// Semitones the note sounds below what is written, if the line says how it sounds. `wanted` is the transposition asked
    /// for, `found` that of the lines before; the line must agree with them.
    fn transposition(
        &self,
        columns: &ChartColumns<'_>,
        plays: u8,
        wanted: Option<i8>,
        found: Option<i64>,
    ) -> Result<Option<i64>, ImportError> {
        let Some(sounds) = self.pitch(columns.sounding_note, columns.sounding_midi)? else { return Ok(None) };
        let lower = i64::from(plays) - i64::from(sounds);
        let right = wanted.map(i64::from).or(found);
        if let (Some(right), Some(index)) = (right, columns.sounding_midi.or(columns.sounding_note))
            && right != lower
        {
            let why = if wanted.is_some() { "asked for" } else { "of the lines before" };
            let s = if right == 1 { "" } else { "s" };
            let lower = format!("{right} semitone{s} below the written note as {why}");
            let note = u8::try_from(i64::from(plays) - right).ok().filter(|&midi| midi < 128);
            let expected = match note {
                Some(midi) => format!("{} ({midi}), {lower}", WrittenNote(midi)),
                None => lower,
            };
            return Err(self.wrong(index, expected));
        }
        Ok(Some(lower))
    }

    /// The impedance peak that sounds. Without a column it follows from the register, as a clarinet overblows; the peak of an
    /// altissimo note is found when the bore is known.
    fn mode(&self, columns: &ChartColumns<'_>) -> Result<u32, ImportError> {
        match columns.mode {
            Some(index) => self
                .text(index)
                .parse::<u32>()
                .map_err(|_| self.wrong(index, "1 to 12, the number of the impedance peak that sounds")),
            None => Ok(match columns.register.map(|index| self.text(index)) {
                Some("clarion") => 2,
                Some("altissimo") => 3,
                _ => 1,
            }),
        }
    }

    /// The register. Without a column it follows from the peak that sounds.
    fn register(&self, columns: &ChartColumns<'_>, mode: u32) -> &str {
        match (columns.register, mode) {
            (Some(index), _) => self.text(index),
            (None, 0 | 1) => "chalumeau",
            (None, 2) => "clarion",
            (None, _) => "altissimo",
        }
    }

    /// Names of the open holes.
    fn open(&self, columns: &ChartColumns<'_>) -> Result<String, ImportError> {
        let mut open: Vec<&str> = Vec::new();
        for &(hole, index) in &columns.holes {
            match self.text(index) {
                "1" => open.push(hole),
                "0" => {}
                _ => return Err(self.wrong(index, "1 for an open hole, 0 for a closed one")),
            }
        }
        Ok(open.join(" "))
    }
}

/// Reads the chart of an instrument with these holes; `wanted` is the transposition asked for, if any.
pub(super) fn read_chart(
    sheet: Sheet<'_>,
    holes: &[&str],
    wanted: Option<i8>,
    words: &mut Words,
) -> Result<Chart, ImportError> {
    let table = Table::read(sheet, CHART_EXAMPLE)?;
    let columns = ChartColumns::of(&table, holes)?;
    let mut notes = Vec::with_capacity(table.rows.len());
    let mut transposition: Option<i64> = None;
    for &(line, ref row) in &table.rows {
        let row = ChartRow { table: &table, line, row };
        let Some(plays) = row.pitch(columns.note, columns.midi)? else { continue };
        transposition = row.transposition(&columns, plays, wanted, transposition)?.or(transposition);
        let mode = row.mode(&columns)?;
        let value = RawFingering {
            written: WrittenNote(plays).to_string(),
            register: row.register(&columns, mode).to_owned(),
            mode,
            open: row.open(&columns)?,
            maker_open: None,
            fingers: columns.fingers.map(|index| row.text(index)).unwrap_or_default().to_owned(),
        };
        notes.push(Lined { line: Some(line), value });
    }
    words.written = Word::plain(&table.columns[columns.written]);
    Ok(Chart { notes, transposition, has_modes: columns.mode.is_some() })
}
