//! The keyboard: the range of the instrument; and the key switches at its left, if there are any. The C of each octave has its name,
//! and a held key the name of the note it plays, written or sounding. A press lower on a key is louder.
//! Sliding from key to key slurs: the new note starts before the old one ends. With the keyboard focus, the arrow keys
//! choose a note, and Space plays it while it is held. In a window without a host, [letters](typed_letters) play too.

mod switch_row;
mod typed_letters;

use egui::{
    Align2, Color32, CornerRadius, Event, EventFilter, Key, Pos2, Rect, Role, Sense, Stroke, Ui, WidgetInfo,
    pos2, vec2,
};

use crate::editor::Action;
use crate::editor::note_names::{NoteNames, note_name};
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use chalumeau_core::units::SoundingNote;
use switch_row::SwitchRow;
use typed_letters::TypedLetters;

/// Velocity of a note played with Space, and of a letter at first.
const PLAIN: f32 = 0.75;
/// Velocity of a key that is pressed at its upper edge.
const SOFTEST: f32 = 0.05;

/// Least height at which a key shows both its letter and its name, points. On a lower one the letter has the place of the name.
const ROOM_FOR_BOTH: f32 = 80.0;

/// White keys up to this width have words of the usual size, points; on wider ones they grow.
const USUAL_WHITE: f32 = 42.0;
/// Most that they grow.
const MOST_GROWN: f32 = 1.8;

/// Width of the sign left of the keys that tells how to play them, points.
const HELP_MARK: f32 = 14.0;

const HELP: &str = "A key that is held shows the note it plays, written or sounding as at the top of the window. Press lower on a key to play louder; slide to slur. With the keyboard: Tab to here, choose with the arrow keys, play with Space.";
const LETTERS_HELP: &str = "The letters on the keys play them, too: C softer, V louder. Page Up and Page Down move the letters by an octave.";
const SWITCH_KEY: &str = "This key makes no sound: the notes that follow take these fingerings, until another key of the row is struck. The colour shows which. Key switches in the Breath view moves the row.";
const SILENT_KEY: &str = "The instrument does not play this note in tune, so the key is silent.";

/// What the keys remember.
#[derive(Clone, Debug, Default)]
pub struct Keyboard {
    /// The note this window holds down.
    held: Option<SoundingNote>,
    /// It is held by the Space bar.
    by_key: bool,
    /// The note that the arrow keys have chosen.
    chosen: Option<SoundingNote>,
    /// In a window without a host.
    letters: Option<TypedLetters>,
}

impl Keyboard {
    /// Letters play from now on.
    pub fn take_letters(&mut self) {
        self.letters = Some(TypedLetters::default());
    }

    /// Whether letters play: then no host has the other keys.
    pub fn has_letters(&self) -> bool {
        self.letters.is_some()
    }

    /// Draws the keys, and says what they play. `is_text`: letters are text now.
    pub fn draw(
        &mut self,
        ui: &mut Ui,
        names: NoteNames,
        snapshot: &Snapshot,
        is_text: bool,
        actions: &mut Vec<Action>,
    ) {
        let Some((lowest, highest)) = snapshot.keys() else { return };
        // From a white key to a white key.
        let from = if is_black(lowest.0) { lowest.0.saturating_sub(1) } else { lowest.0 };
        let to = if is_black(highest.0) { highest.0 + 1 } else { highest.0 };
        let all = ui.available_rect_before_wrap();
        let (mark, all) = all.split_left_right_at_x(all.left() + HELP_MARK);
        help_mark(ui, mark, self.letters.is_some());
        let response = ui.allocate_rect(all, Sense::click_and_drag());
        let rect = response.rect;
        let switches = snapshot.settings.reach.key_switches;
        let (row, rect) = SwitchRow::beside(switches, rect);
        let keys = Keys::new(rect, from, to);
        let at = |point: Pos2| row.as_ref().and_then(|row| row.at(point)).or_else(|| keys.at(point));
        let chooses = |key: u8| switches.chosen(key);
        let playable = |key: u8| chooses(key).is_some() || snapshot.plays(SoundingNote(key)).is_some();
        let transposition = snapshot.instrument.transposition;

        let pointer = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on());
        let wanted = pointer.and_then(at).filter(|(note, _)| playable(*note));
        if !self.by_key {
            self.hold(wanted.map(|(note, velocity)| (SoundingNote(note), velocity)), actions);
        }
        let chosen =
            self.chosen.or(snapshot.key).map_or((from + to) / 2, |note| note.0).clamp(lowest.0, highest.0);
        if response.has_focus() {
            self.keys_pressed(ui, response.id, chosen, (lowest.0, highest.0), actions);
        } else if self.by_key {
            self.by_key = false;
            self.hold(None, actions);
        }

        if let Some(letters) = &mut self.letters {
            let plays = |note: SoundingNote| playable(note.0);
            letters.play(ui, (lowest.0, highest.0), is_text, plays, actions);
        }

        let c = Colours::here(ui);
        let focus = response.has_focus().then_some(chosen);
        let named = |key: u8| names.of_sounding(snapshot.plays(SoundingNote(key))?, transposition);
        let is_down = |key: u8| {
            [snapshot.key, self.held].contains(&Some(SoundingNote(key)))
                || self.letters.as_ref().is_some_and(|letters| letters.holds(key))
        };
        keys.paint(ui, c, is_down, focus, named, |key| self.letters.as_ref()?.letter(key));
        if let Some(row) = &row {
            row.paint(ui, c, snapshot.next_fingerings());
        }
        response.widget_info(|| {
            let name = named(chosen).map_or_else(|| "silent key".to_owned(), note_name);
            WidgetInfo::labeled(Role::Group, true, format!("Keyboard, {name}"))
        });
        // A user who plays needs no tool tip.
        if self.held.is_none() {
            let pointed = response.hover_pos().and_then(at).map(|(note, _)| note);
            match pointed.map(|note| (chooses(note), playable(note))) {
                Some((Some(fingerings), _)) => {
                    response.on_hover_text_at_pointer(format!("Key switch, {fingerings}. {SWITCH_KEY}"));
                }
                Some((None, false)) => {
                    response.on_hover_text_at_pointer(SILENT_KEY);
                }
                _ => {}
            }
        }
    }

    /// Lets go of what is held: the window closes, or another view takes the pointer.
    pub fn release(&mut self, actions: &mut Vec<Action>) {
        self.by_key = false;
        self.hold(None, actions);
        if let Some(letters) = &mut self.letters {
            letters.release(actions);
        }
    }

    fn hold(&mut self, wanted: Option<(SoundingNote, f32)>, actions: &mut Vec<Action>) {
        let note = wanted.map(|(note, _)| note);
        if note == self.held {
            return;
        }
        if let Some((note, velocity)) = wanted {
            actions.push(Action::NoteOn { note, velocity });
            self.chosen = Some(note);
        }
        if let Some(old) = std::mem::replace(&mut self.held, note) {
            actions.push(Action::NoteOff { note: old });
        }
    }

    fn keys_pressed(
        &mut self,
        ui: &Ui,
        id: egui::Id,
        chosen: u8,
        (low, high): (u8, u8),
        actions: &mut Vec<Action>,
    ) {
        let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
        let (steps, space) = ui.input(|input| {
            let presses = |key| input.num_presses(key) as i32;
            let space = input.events.iter().rev().find_map(|event| match event {
                Event::Key { key: Key::Space, pressed, .. } => Some(*pressed),
                _ => None,
            });
            (presses(Key::ArrowRight) - presses(Key::ArrowLeft), space)
        });
        let note = (i32::from(chosen) + steps).clamp(i32::from(low), i32::from(high)) as u8;
        self.chosen = Some(SoundingNote(note));
        if let Some(is_down) = space {
            self.by_key = is_down;
        }
        if self.by_key {
            self.hold(Some((SoundingNote(note), PLAIN)), actions);
        } else if space == Some(false) {
            self.hold(None, actions);
        }
    }
}

/// The sign left of the keys that tells how to play them.
fn help_mark(ui: &Ui, rect: Rect, has_letters: bool) {
    let c = Colours::here(ui);
    let response = ui.interact(rect, ui.scope_id().with("help"), Sense::hover());
    let ink = if response.hovered() { c.ink } else { c.quiet };
    ui.painter().text(rect.left_center(), Align2::LEFT_CENTER, "?", theme::body(), ink);
    let about = if has_letters { format!("{HELP} {LETTERS_HELP}") } else { HELP.to_owned() };
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &about));
    response.on_hover_text(&about);
}

/// Names and letters on white keys.
const ON_IVORY: Color32 = Color32::from_gray(80);

/// The colour of a key that makes no sound, for the colour of one that does.
fn silent(plain: Color32) -> Color32 {
    plain.lerp_to_gamma(Color32::from_gray(96), 0.6)
}

fn is_black(note: u8) -> bool {
    matches!(note % 12, 1 | 3 | 6 | 8 | 10)
}

/// Where the keys are.
struct Keys {
    rect: Rect,
    from: u8,
    to: u8,
    white: f32,
}

impl Keys {
    fn new(rect: Rect, from: u8, to: u8) -> Self {
        let whites = (from..=to).filter(|&note| !is_black(note)).count().max(1);
        Self { rect, from, to, white: rect.width() / whites as f32 }
    }

    /// The place of a key.
    fn key(&self, note: u8) -> Rect {
        let whites = (self.from..note).filter(|&below| !is_black(below)).count() as f32;
        let left = self.rect.left() + whites * self.white;
        if is_black(note) {
            let width = 0.62 * self.white;
            Rect::from_min_size(
                pos2(left - 0.5 * width, self.rect.top()),
                vec2(width, 0.62 * self.rect.height()),
            )
        } else {
            Rect::from_min_size(pos2(left, self.rect.top()), vec2(self.white, self.rect.height()))
        }
    }

    /// The key under a point, and how far down it: 0..=1.
    fn at(&self, point: Pos2) -> Option<(u8, f32)> {
        let notes = || self.from..=self.to;
        let hit = |note: &u8| self.key(*note).contains(point);
        let note = notes()
            .filter(|&note| is_black(note))
            .find(hit)
            .or_else(|| notes().find(|note| !is_black(*note) && hit(note)))?;
        let key = self.key(note);
        let down = ((point.y - key.top()) / key.height()).clamp(0.0, 1.0);
        Some((note, SOFTEST + (1.0 - SOFTEST) * down))
    }

    /// Paints them; `named` gives the note that a held key is named by, `None` for a silent one; `letter` what is typed to play it.
    fn paint(
        &self,
        ui: &Ui,
        c: &Colours,
        is_down: impl Fn(u8) -> bool,
        focus: Option<u8>,
        named: impl Fn(u8) -> Option<u8>,
        letter: impl Fn(u8) -> Option<&'static str>,
    ) {
        let painter = ui.painter_at(self.rect);
        for black in [false, true] {
            for note in (self.from..=self.to).filter(|&note| is_black(note) == black) {
                let key = self.key(note);
                let plain = if black { c.ebony } else { c.ivory };
                let (is_down, name) = (is_down(note), named(note));
                let fill = if is_down {
                    c.breath
                } else if name.is_some() {
                    plain
                } else {
                    silent(plain)
                };
                let round = CornerRadius { nw: 0, ne: 0, sw: 3, se: 3 };
                painter.rect(
                    key.shrink2(vec2(0.5, 0.0)),
                    round,
                    fill,
                    Stroke::new(1.0, c.line),
                    egui::StrokeKind::Inside,
                );
                if focus == Some(note) {
                    painter.rect_stroke(
                        key.shrink(2.0),
                        round,
                        Stroke::new(2.0, c.accent),
                        egui::StrokeKind::Inside,
                    );
                }
            }
        }
        let is_low = self.rect.height() < ROOM_FOR_BOTH;
        let grown = (self.white / USUAL_WHITE).clamp(1.0, MOST_GROWN);
        let font = theme::small_grown(grown);
        let letter = |note: u8| letter(note).filter(|_| named(note).is_some());
        for note in self.from..=self.to {
            let (key, is_down) = (self.key(note), is_down(note));
            let Some(letter) = letter(note).filter(|_| !(is_low && is_down)) else { continue };
            let ink = match (is_down, is_black(note)) {
                (true, _) => c.on_accent,
                (_, true) => c.ivory,
                (_, false) => ON_IVORY,
            };
            let words = painter.layout_no_wrap(letter.to_owned(), font.clone(), ink);
            // Clear of the names below, and on a white key of the black ones above.
            let low = match is_black(note) && !is_down {
                true => 4.0,
                false if is_low => 3.0,
                false => 18.0 * grown,
            };
            let place = pos2(key.center().x - 0.5 * words.size().x, key.bottom() - low - words.size().y);
            painter.galley(place, words, ink);
        }
        // A C has the name that every keyboard gives it; a key that is held has the name of the note it plays. While one is held whose
        // name is not its own, the others have none: two keys would be C4.
        let is_renamed = |note: u8| is_down(note) && named(note).is_some_and(|name| name != note);
        let holds_renamed = (self.from..=self.to).any(is_renamed);
        for note in self.from..=self.to {
            let (key, is_down) = (self.key(note), is_down(note));
            let name = match is_down {
                true => named(note),
                false if holds_renamed => None,
                false if is_low && letter(note).is_some() => None,
                false => (note % 12 == 0).then_some(note),
            };
            let Some(name) = name else { continue };
            let ink = if is_down { c.on_accent } else { ON_IVORY };
            let words = painter.layout_no_wrap(note_name(name), font.clone(), ink);
            let left = (key.center().x - 0.5 * words.size().x)
                .clamp(self.rect.left(), self.rect.right() - words.size().x);
            let place = Rect::from_min_size(pos2(left, key.bottom() - 3.0 - words.size().y), words.size());
            if is_down && place.width() > key.width() {
                painter.rect_filled(place.expand2(vec2(2.0, 0.0)), CornerRadius::same(3), c.breath);
            }
            painter.galley(place.min, words, ink);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_on_white_keys_and_silent_keys_look_silent() {
        for theme in [egui::Theme::Light, egui::Theme::Dark] {
            let c = Colours::of(theme);
            assert!(theme::contrast(ON_IVORY, c.ivory) > 4.5, "{theme:?}");
            for plain in [c.ivory, c.ebony] {
                let contrast = theme::contrast(plain, silent(plain));
                assert!(contrast > 1.5, "{theme:?} {plain:?} {contrast}");
            }
            assert!(theme::contrast(silent(c.ivory), silent(c.ebony)) > 1.5, "white from black, {theme:?}");
        }
    }

    #[test]
    fn every_key_is_where_it_is_drawn() {
        let keys = Keys::new(Rect::from_min_size(pos2(10.0, 20.0), vec2(800.0, 80.0)), 50, 96);
        for note in 50..=96 {
            let key = keys.key(note);
            // The lower part of a white key, clear of the black ones.
            let point = if is_black(note) { key.center() } else { key.center_bottom() - vec2(0.0, 4.0) };
            assert_eq!(keys.at(point).map(|(note, _)| note), Some(note));
        }
        assert!((keys.key(96).right() - 810.0).abs() < 1.0);
        assert_eq!(keys.at(pos2(0.0, 0.0)), None);
    }

    #[test]
    fn sliding_slurs_and_letting_go_ends() {
        let mut keyboard = Keyboard::default();
        let mut actions = Vec::new();
        for wanted in [
            Some((SoundingNote(60), 0.5)),
            Some((SoundingNote(62), 0.5)),
            Some((SoundingNote(62), 0.9)),
            None,
        ] {
            keyboard.hold(wanted, &mut actions);
        }
        let note = SoundingNote;
        assert_eq!(
            actions,
            [
                Action::NoteOn { note: note(60), velocity: 0.5 },
                Action::NoteOn { note: note(62), velocity: 0.5 },
                Action::NoteOff { note: note(60) },
                Action::NoteOff { note: note(62) },
            ]
        );
    }
}
