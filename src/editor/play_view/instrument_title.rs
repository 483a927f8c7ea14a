//! The name of the loaded instrument, its key and its size, for who has several.

use egui::{FontId, Rect, Role, Sense, Ui, WidgetInfo, pos2};

use crate::editor::theme::Colours;
use crate::editor::widgets::one_line;
use chalumeau_core::bore::instrument_file::InstrumentFile;

/// Keys of instruments, by the semitones that they sound below what is written.
const KEYS: [&str; 12] =
    ["C", "B", "B flat", "A", "A flat", "G", "F sharp", "F", "E", "E flat", "D", "D flat"];

/// The most of the width that it takes: beside it stands what the wave is, and what is done with moved holes.
const SHARE: f32 = 0.4;

/// Key of an instrument that sounds so many semitones below what is written.
fn key(transposition: i8) -> &'static str {
    KEYS[usize::from(transposition.rem_euclid(12).unsigned_abs())]
}

/// Its name, and what else there is to know.
fn title(file: &InstrumentFile) -> [String; 2] {
    let (name, more) = file.name.split_once(',').unwrap_or((&file.name, ""));
    let more = Some(more.trim())
        .filter(|more| !more.is_empty())
        .map_or_else(String::new, |more| format!("{more}, "));
    let size = format!("{more}in {}, {:.0} cm long", key(file.transposition), 1e2 * file.length_m());
    [name.trim().to_owned(), size]
}

/// Draws it at the upper right of `rect`, `grown` times as large as in a window of the usual size. Returns its place.
pub fn draw(ui: &Ui, rect: Rect, file: &InstrumentFile, grown: f32) -> Rect {
    let c = Colours::here(ui);
    let [name, size] = title(file);
    let told = format!("{name}, {size}");
    let right = rect.right() - 10.0;
    let mut place = Rect::from_min_max(pos2(right, rect.top() + 2.0), pos2(right, rect.top() + 2.0));
    for (words, font, ink) in [(name, 16.0, c.ink), (size, 12.0, c.quiet)] {
        let line = one_line(ui, &words, FontId::proportional(font * grown), ink, SHARE * rect.width());
        let at = Rect::from_min_size(pos2(right - line.size().x, place.bottom()), line.size());
        ui.painter_at(rect).galley(at.min, line, ink);
        place = place.union(at);
    }
    let response = ui.interact(place, ui.scope_id().with("instrument"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &told));
    response.on_hover_text(format!("{}. Choose another in the Instrument view.", file.name));
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use chalumeau_core::bore::bundled::Bundled;

    #[test]
    fn every_instrument_says_its_name_its_key_and_its_length() {
        let of_bundled = |of: Bundled| title(&of.file());
        assert_eq!(of_bundled(Bundled::BFlat), ["B flat clarinet", "Boehm system, in B flat, 67 cm long"]);
        let keys = [
            (Bundled::A, "in A,"),
            (Bundled::EFlat, "in E flat,"),
            (Bundled::C, "in C,"),
            (Bundled::Bass, "in B flat,"),
        ];
        for (of, key) in keys {
            assert!(of_bundled(of)[1].contains(key), "{:?}", of_bundled(of));
        }
        let mut own = InstrumentFile::built_in();
        (own.name, own.transposition) = ("Basset horn".to_owned(), 7);
        assert_eq!(title(&own), ["Basset horn", "in F, 67 cm long"]);
        own.transposition = -8;
        assert_eq!(title(&own)[1], "in A flat, 67 cm long");
    }
}
