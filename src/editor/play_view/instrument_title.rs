//! The name of the loaded instrument, its key and its size, for who has several.

use egui::{Align2, FontId, Rect, Role, Sense, Ui, WidgetInfo, vec2};

use crate::editor::theme::Colours;
use chalumeau_core::bore::instrument_file::InstrumentFile;

/// Keys of instruments, by the semitones that they sound below what is written.
const KEYS: [&str; 12] =
    ["C", "B", "B flat", "A", "A flat", "G", "F sharp", "F", "E", "E flat", "D", "D flat"];

/// Key of an instrument that sounds so many semitones below what is written.
fn key(transposition: i8) -> &'static str {
    KEYS[usize::from(transposition.rem_euclid(12).unsigned_abs())]
}

/// Whether a name has these words.
fn has_words(name: &str, words: &str) -> bool {
    let spaced = |text: &str| format!(" {} ", text.to_lowercase().replace([',', '-', '(', ')'], " "));
    spaced(name).contains(&spaced(words))
}

/// Name with its key, and what else there is to know.
fn title(file: &InstrumentFile) -> [String; 2] {
    let (name, more) = file.name.split_once(',').unwrap_or((&file.name, ""));
    let key = key(file.transposition);
    let name = match has_words(name, key) {
        true => name.trim().to_owned(),
        false => format!("{} in {key}", name.trim()),
    };
    let length = format!("{:.0} cm long", 1e2 * file.length_m());
    let more = more.trim();
    [name, if more.is_empty() { length } else { format!("{more}, {length}") }]
}

/// Draws it at the upper right of `rect`, `grown` times as large as in a window of the usual size. Returns its place.
pub fn draw(ui: &Ui, rect: Rect, file: &InstrumentFile, grown: f32) -> Rect {
    let c = Colours::here(ui);
    let [name, more] = title(file);
    let painter = ui.painter_at(rect);
    let font = |size: f32| FontId::proportional(size * grown);
    let at = rect.right_top() + vec2(-10.0, 2.0);
    let first = painter.text(at, Align2::RIGHT_TOP, &name, font(16.0), c.ink);
    let second = painter.text(first.right_bottom(), Align2::RIGHT_TOP, &more, font(12.0), c.quiet);
    let place = first.union(second);
    let response = ui.interact(place, ui.scope_id().with("instrument"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{name}, {more}")));
    response.on_hover_text(format!("{}. Choose another in the Instrument view.", file.name));
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::bundled::Bundled;

    #[test]
    fn every_instrument_says_its_name_its_key_and_its_length() {
        let title_of = |of: Bundled| title(&of.file());
        assert_eq!(title_of(Bundled::BFlat), ["B flat clarinet", "Boehm system, 67 cm long"]);
        for (of, name) in [
            (Bundled::A, "A clarinet"),
            (Bundled::EFlat, "E flat clarinet"),
            (Bundled::C, "C clarinet"),
            (Bundled::Bass, "B flat bass clarinet"),
        ] {
            assert_eq!(title_of(of)[0], name);
        }
        let mut own = InstrumentFile::built_in();
        (own.name, own.transposition) = ("Basset horn".to_owned(), 7);
        assert_eq!(title(&own), ["Basset horn in F", "67 cm long"]);
        (own.name, own.transposition) = ("Sopranino".to_owned(), -8);
        assert_eq!(title(&own)[0], "Sopranino in A flat");
    }
}
