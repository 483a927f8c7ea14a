//! What the user looks fingerings for, how far the search is, and what it has found. The window's owner searches.

use std::sync::Arc;

use chalumeau_core::bore::fingering_finder::{FingeringFinder, Found};
use chalumeau_core::units::WrittenNote;

/// Most fingerings, or pairs of them, in a list.
const LISTED: usize = 20;

/// A note, alone or with the other note of a trill.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FingeringQuestion {
    /// The note.
    pub note: WrittenNote,
    /// The other note of the trill.
    pub trill_to: Option<WrittenNote>,
}

/// How far the search is.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum FingeringSearch {
    /// Nothing is looked for.
    #[default]
    Resting,
    /// So much of all fingerings is worked out, 0..=1.
    Looking(f32),
    /// The answer.
    Found(Arc<FingeringAnswer>),
}

/// The fingerings for a question, best first.
#[derive(Clone, Debug, PartialEq)]
pub struct FingeringAnswer {
    /// The question.
    pub question: FingeringQuestion,
    /// Number of different fingerings that were looked through.
    pub looked_through: usize,
    /// What was found.
    pub rows: Vec<FingeringRow>,
}

/// A fingering, or two for a trill.
#[derive(Clone, Debug, PartialEq)]
pub struct FingeringRow {
    /// That of the note.
    pub note: Found,
    /// That of the other note of a trill, and the fingers that move.
    pub trill: Option<(Found, usize)>,
    /// The instrument's chart has that of the note.
    pub is_of_chart: bool,
}

impl FingeringAnswer {
    /// Asks the finder. Some ten milliseconds.
    pub fn new(finder: &FingeringFinder, question: FingeringQuestion) -> Self {
        let FingeringQuestion { note, trill_to } = question;
        let chart = finder.of_chart(note).map(|grip| grip.open);
        let row =
            |note: Found, trill| FingeringRow { is_of_chart: chart == Some(note.grip.open), note, trill };
        let rows = match trill_to {
            None => finder.best(note, LISTED).into_iter().map(|found| row(found, None)).collect(),
            Some(to) => {
                let pairs = finder.trills(note, to, LISTED).into_iter();
                pairs
                    .map(|(from, to)| {
                        let moves = from.grip.moves(&to.grip);
                        row(from, Some((to, moves)))
                    })
                    .collect()
            }
        };
        Self { question, looked_through: finder.len(), rows }
    }
}
