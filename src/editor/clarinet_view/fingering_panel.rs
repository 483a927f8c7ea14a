//! The search for fingerings in the clarinet view: for the note that is played or chosen, alone or in a trill. A click on a
//! fingering tries it.

use egui::{
    Align, Align2, CornerRadius, Label, Layout, ProgressBar, Rect, RichText, Role, ScrollArea, Sense, Ui,
    WidgetInfo, pos2, vec2,
};

use super::fingering_rows::{draw_row, head};
use crate::editor::Action;
use crate::editor::fingering_search::{FingeringAnswer, FingeringQuestion, FingeringSearch};
use crate::editor::note_names::{NoteNames, note_name};
use crate::editor::preset_bar::arrow;
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::widgets::segments;
use chalumeau_core::bore::fingering_finder::FARTHEST_CENTS;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::units::{SoundingNote, WrittenNote};

/// Intervals of a trill, semitones.
const TRILLS: [u8; 2] = [1, 2];

/// What the panel remembers.
#[derive(Clone, Debug, Default)]
pub struct FingeringPanel {
    question: Option<FingeringQuestion>,
    /// The note that was played when the question was put last.
    played: Option<SoundingNote>,
}

/// What the user did in the panel.
pub enum Chosen {
    /// These holes are to be tried.
    Try(Vec<bool>),
    /// The trial ends.
    EndTry,
}

impl FingeringPanel {
    /// Whether it is shown in place of the picker.
    pub fn is_open(&self) -> bool {
        self.question.is_some()
    }

    /// Opens it for the note that is played, or was played last.
    pub fn open(&mut self, snapshot: &Snapshot, actions: &mut Vec<Action>) {
        let note = snapshot.written().unwrap_or_else(|| snapshot.instrument.lowest());
        self.played = snapshot.sounding;
        self.ask(Some(FingeringQuestion { note, trill_to: None }), actions);
    }

    fn ask(&mut self, question: Option<FingeringQuestion>, actions: &mut Vec<Action>) {
        if self.question != question {
            self.question = question;
            actions.push(Action::FindFingerings(question));
        }
    }

    /// Draws it. `tried` are the holes of a trial.
    pub fn draw(
        &mut self,
        ui: &mut Ui,
        names: NoteNames,
        snapshot: &Snapshot,
        tried: Option<&[bool]>,
        actions: &mut Vec<Action>,
    ) -> Option<Chosen> {
        let mut question = self.question?;
        if snapshot.sounding != self.played {
            self.played = snapshot.sounding;
            if let (Some(_), Some(note)) = (snapshot.sounding, snapshot.written()) {
                question = question.moved_to(note);
            }
        }
        let (mut chosen, mut is_done) = (None, false);
        ui.horizontal(|ui| {
            ui.set_height(24.0);
            note_arrows(ui, names, snapshot, &mut question);
            trill_choice(ui, names, snapshot, &mut question);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                is_done = ui.button("Done").on_hover_text("Back to the fingerings of the chart").clicked();
                if tried.is_some() {
                    let back = ui.button("Back to the note");
                    if back.on_hover_text("Ends the trial; the played note sets the holes again").clicked() {
                        chosen = Some(Chosen::EndTry);
                    }
                }
            });
        });
        match &snapshot.fingerings {
            FingeringSearch::Found(answer) if answer.question == question => {
                if let Some(open) = answer_list(ui, names, answer, &snapshot.instrument, tried) {
                    chosen = Some(Chosen::Try(open));
                }
            }
            FingeringSearch::Found(_) | FingeringSearch::Resting => {}
            FingeringSearch::Looking(share) => progress(ui, *share),
        }
        self.ask((!is_done).then_some(question), actions);
        chosen
    }
}

impl FingeringQuestion {
    /// The same for another note, with the trill as wide as it was.
    fn moved_to(self, note: WrittenNote) -> Self {
        let by = self.trill_to.map(|to| to.0.saturating_sub(self.note.0));
        Self { note, trill_to: by.map(|by| WrittenNote(note.0.saturating_add(by).min(127))) }
    }
}

/// As the user reads it.
fn title(names: NoteNames, note: WrittenNote, transposition: i8) -> String {
    names.of_written(note, transposition).map_or_else(|| note.to_string(), note_name)
}

/// The note between two arrows.
fn note_arrows(ui: &mut Ui, names: NoteNames, snapshot: &Snapshot, question: &mut FingeringQuestion) {
    let c = Colours::here(ui);
    let (rect, whole) = ui.allocate_exact_size(vec2(84.0, 24.0), Sense::hover());
    ui.painter().rect_filled(rect, CornerRadius::same(theme::SMALL_RADIUS), c.raised);
    for (side, word) in [(-1_i8, "A semitone down"), (1, "A semitone up")] {
        let x = if side < 0 { rect.left() } else { rect.right() - 22.0 };
        let place = Rect::from_min_size(pos2(x, rect.top()), vec2(22.0, rect.height()));
        let is_clicked = arrow(ui, place, f32::from(side), word).on_hover_text(word).clicked();
        if let Some(note) = question.note.0.checked_add_signed(side).filter(|&note| is_clicked && note < 128)
        {
            *question = question.moved_to(WrittenNote(note));
        }
    }
    let name = title(names, question.note, snapshot.instrument.transposition);
    ui.painter().text(rect.center(), Align2::CENTER_CENTER, &name, theme::body(), c.ink);
    let about = "The note that you look for fingerings of. Play another, or click the arrows.";
    whole.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("Fingerings of {name}")));
    whole.on_hover_text(about);
}

/// One note, or a trill.
fn trill_choice(ui: &mut Ui, names: NoteNames, snapshot: &Snapshot, question: &mut FingeringQuestion) {
    let note = question.note;
    let notes: Vec<Option<WrittenNote>> = std::iter::once(None)
        .chain(TRILLS.map(|by| Some(WrittenNote(note.0.saturating_add(by).min(127)))))
        .collect();
    let text = |to: &Option<WrittenNote>| match to {
        None => "One note".to_owned(),
        Some(to) => format!("Trill to {}", title(names, *to, snapshot.instrument.transposition)),
    };
    let texts: Vec<String> = notes.iter().map(text).collect();
    let mut chosen = notes.iter().position(|to| *to == question.trill_to).unwrap_or(0);
    ui.scope(|ui| {
        ui.set_width(264.0);
        segments(ui, "Fingerings for", &texts, &mut chosen);
    });
    question.trill_to = notes[chosen];
}

fn progress(ui: &mut Ui, share: f32) {
    ui.add_space(6.0);
    let text = format!("Working out every fingering that the fingers can make: {:.0} %", 100.0 * share);
    ui.label(text);
    let bar = ui.add(ProgressBar::new(share).desired_height(6.0).desired_width(300.0));
    bar.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, "Search for fingerings"));
}

/// The list, and the holes of the fingering that was clicked.
fn answer_list(
    ui: &mut Ui,
    names: NoteNames,
    answer: &FingeringAnswer,
    file: &InstrumentFile,
    tried: Option<&[bool]>,
) -> Option<Vec<bool>> {
    if answer.rows.is_empty() {
        let c = Colours::here(ui);
        ui.add(Label::new(RichText::new(none_found(names, answer, file)).color(c.quiet)).wrap());
        return None;
    }
    let is_trill = answer.question.trill_to.is_some();
    head(ui, is_trill, answer.looked_through);
    let mut chosen = None;
    ScrollArea::vertical().id_salt("fingerings").auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        for (nth, row) in answer.rows.iter().enumerate() {
            if let Some(found) = draw_row(ui, nth + 1, row, file, tried) {
                chosen = Some(found.grip.holes(file));
            }
        }
    });
    chosen
}

/// Why the list is empty.
fn none_found(names: NoteNames, answer: &FingeringAnswer, file: &InstrumentFile) -> String {
    if answer.looked_through <= 1 {
        return "This search knows the keys of the Boehm clarinet, and the holes of this instrument have other names."
            .to_owned();
    }
    let title = |note| title(names, note, file.transposition);
    let FingeringQuestion { note, trill_to } = answer.question;
    let notes = match trill_to {
        None => title(note),
        Some(to) => format!("{}, or none plays {},", title(note), title(to)),
    };
    format!(
        "None of the {} fingerings plays {notes} within {FARTHEST_CENTS:.0} cents. The chart of this instrument goes from {} \
         to {}.",
        answer.looked_through,
        title(file.lowest()),
        title(file.highest())
    )
}
