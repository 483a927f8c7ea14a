//! The key switches: a row of their own at the left of the keyboard, in the colours of buttons, each with a word for what it chooses. What is
//! chosen now has the colour of what is chosen everywhere.

use egui::{CornerRadius, Pos2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};

use super::{Keys, is_black};
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::control::key_switches::{KeySwitches, ROW};
use chalumeau_core::event::Fingerings;

/// Width of a white key of the row: the longest word fits.
const WHITE: f32 = 52.0;
/// Distance from the keys that play.
const GAP: f32 = 10.0;

/// The row and its place.
pub struct SwitchRow {
    lowest: u8,
    keys: Keys,
}

impl SwitchRow {
    /// The row, if there is one, and what it leaves of the keyboard.
    pub fn beside(switches: KeySwitches, rect: Rect) -> (Option<Self>, Rect) {
        let Some(lowest) = switches.lowest() else { return (None, rect) };
        let highest = lowest + ROW.len() as u8 - 1;
        let whites = (lowest..=highest).filter(|&key| !is_black(key)).count() as f32;
        let (row, rest) = rect.split_left_right_at_x(rect.left() + whites * WHITE + GAP);
        let row = row.with_max_x(row.right() - GAP);
        (Some(Self { lowest, keys: Keys::new(row, lowest, highest) }), rest)
    }

    /// The key under a point, and how far down it.
    pub fn at(&self, point: Pos2) -> Option<(u8, f32)> {
        self.keys.at(point)
    }

    /// Paints it; `now` is what the next note takes.
    pub fn paint(&self, ui: &Ui, c: &Colours, now: Fingerings) {
        let painter = ui.painter_at(self.keys.rect);
        let all = (self.lowest..).zip(ROW);
        for black in [false, true] {
            for (key, fingerings) in all.clone().filter(|&(key, _)| is_black(key) == black) {
                let rect = self.keys.key(key);
                let is_now = now == fingerings;
                let (fill, ink) = match (is_now, black) {
                    (true, _) => (c.accent, c.on_accent),
                    (false, true) => (c.hovered, c.ink),
                    (false, false) => (c.raised, c.ink),
                };
                let round = CornerRadius { nw: 0, ne: 0, sw: 3, se: 3 };
                let line = Stroke::new(1.0, c.line);
                painter.rect(rect.shrink2(vec2(0.5, 0.0)), round, fill, line, StrokeKind::Inside);
                let words = painter.layout_no_wrap(word(fingerings).to_owned(), theme::small(), ink);
                let size = words.size();
                painter.galley(
                    pos2(rect.center().x - 0.5 * size.x, rect.bottom() - 3.0 - size.y),
                    words,
                    ink,
                );
            }
        }
    }
}

/// A word that fits on a key.
fn word(fingerings: Fingerings) -> &'static str {
    match fingerings {
        Fingerings::Chart => "Chart",
        Fingerings::Alternate(1) => "1st",
        Fingerings::Alternate(2) => "2nd",
        Fingerings::Alternate(_) => "3rd",
        Fingerings::ByContext => "Context",
    }
}
