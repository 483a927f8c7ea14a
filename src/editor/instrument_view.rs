//! The instrument view: which clarinet, the scale of its keys, its tuning, articulation and level.

use egui::{Align2, CornerRadius, RichText, Role, Sense, Stroke, Ui, WidgetInfo, vec2};

use crate::editor::Action;
use crate::editor::chart;
use crate::editor::clarinet_drawing::{ClarinetDrawing, ruler};
use crate::editor::connections::OutputChoice;
use crate::editor::connections_view;
use crate::editor::controls::{Hands, choice, heading, segments, slider, teach};
use crate::editor::file_browser::{FileBrowser, FileKind};
use crate::editor::note_names::{NoteNames, note_name};
use crate::editor::snapshot::Snapshot;
use crate::editor::theme;
use crate::editor::theme::{Colours, GAP, panel};
use chalumeau_core::instrument::KeyPitches;

/// Draws the view.
pub fn draw(
    ui: &mut Ui,
    hands: &mut Hands,
    snapshot: &Snapshot,
    names: &mut NoteNames,
    files: &mut FileBrowser,
    actions: &mut Vec<Action>,
) {
    let mut with = (hands, files, actions);
    crate::editor::beside(
        ui,
        "instrument",
        &mut with,
        |ui, (hands, files, actions)| left(ui, hands, snapshot, files, actions),
        |ui, (hands, _, actions)| column(ui, hands, snapshot, names, actions),
    );
}

fn left(
    ui: &mut Ui,
    hands: &mut Hands,
    snapshot: &Snapshot,
    files: &mut FileBrowser,
    actions: &mut Vec<Action>,
) {
    let c = Colours::here(ui);
    ui.spacing_mut().item_spacing.y = GAP;
    let height = ui.available_height();
    panel(c).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.set_height((0.34 * height - 24.0).max(168.0));
        egui::ScrollArea::vertical().id_salt("instruments").auto_shrink([false, false]).show(ui, |ui| {
            list(ui, hands, snapshot, files, actions);
            scale(ui, snapshot, files, actions);
        });
    });
    panel(c).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.set_height(ui.available_height());
        let all = ui.available_height();
        // The height that the words leave.
        let drawn = if all < 260.0 { 0.0 } else { (all - 180.0).min(220.0) };
        egui::ScrollArea::vertical()
            .id_salt("facts")
            .max_height(all - drawn)
            .auto_shrink([false, false])
            .show(ui, |ui| facts(ui, snapshot));
        if drawn > 0.0 {
            portrait(ui, snapshot);
        }
    });
}

fn list(
    ui: &mut Ui,
    hands: &mut Hands,
    snapshot: &Snapshot,
    files: &mut FileBrowser,
    actions: &mut Vec<Action>,
) {
    let c = Colours::here(ui);
    ui.horizontal(|ui| {
        heading(ui, "Instrument");
        if let Some(look) = hands.controls.look("istat") {
            let told = hands.controls.text("istat", look.value);
            let told = egui::Label::new(RichText::new(told).color(c.quiet)).truncate();
            ui.add(told).on_hover_ui(|ui| teach(ui, "istat", ""));
        }
    });
    ui.horizontal_wrapped(|ui| {
        for (index, name) in snapshot.instruments.iter().enumerate() {
            let is_here = snapshot.chosen == Some(index);
            if card(ui, c, name, is_here).clicked() && !is_here {
                actions.push(Action::ChooseInstrument(index));
                hands.record_choice("instr", index, snapshot.instruments.len());
            }
        }
    });
    ui.horizontal(|ui| {
        let about = "A text file with the bore, the tone holes and the fingerings of a clarinet. Alter the bore in the Clarinet view saves one to begin with, and so does chalumeau instrument new on the command line.";
        if ui.button("Open an instrument file").on_hover_text(about).clicked() {
            files.open(FileKind::Instrument, actions);
        }
    });
}

/// The scale that the keys play.
fn scale(ui: &mut Ui, snapshot: &Snapshot, files: &mut FileBrowser, actions: &mut Vec<Action>) {
    let c = Colours::here(ui);
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        heading(ui, "Scale");
        ui.add(egui::Label::new(RichText::new(&snapshot.scale).color(c.quiet)).truncate());
    });
    ui.horizontal(|ui| {
        let about = "A scale in Scala's format (.scl), and if you like a keyboard mapping (.kbm). The project keeps both.";
        if ui.button("Open a scale").on_hover_text(about).clicked() {
            files.open(FileKind::Scale, actions);
        }
        if let Some(follows) = snapshot.follows_tuning_program {
            let mut now = follows;
            let about = "A tuning program runs (MTS-ESP). Keys follow it unless a scale is opened here.";
            if ui.checkbox(&mut now, "Follow MTS-ESP").on_hover_text(about).changed() {
                actions.push(Action::FollowTuningProgram(now));
            }
        }
        let is_equal = snapshot.key_pitches == KeyPitches::default();
        if ui.add_enabled(!is_equal, egui::Button::new("Equal temperament")).clicked() {
            actions.push(Action::EqualTemperament);
        }
    });
    if let Some(refused) = &snapshot.scale_refused {
        ui.label(RichText::new(refused).color(c.danger));
    }
}

/// How far the note that is fingered lies above its pitch in the scale.
fn trim(ui: &mut Ui, snapshot: &Snapshot, names: NoteNames, actions: &mut Vec<Action>) {
    let c = Colours::here(ui);
    let transposition = snapshot.instrument.transposition;
    let Some(written) = snapshot.fingering().map(|fingering| fingering.written) else { return };
    let Some(sounding) = written.sounding(transposition) else { return };
    let name = names.of_written(written, transposition).map_or_else(String::new, note_name);
    ui.horizontal(|ui| {
        let about = "Moves this note alone, whichever key plays it. Play another note to trim that one. The project keeps all trims.";
        ui.label(RichText::new(format!("Trim of {name}")).color(c.quiet)).on_hover_text(about);
        let tenths = snapshot.trims.get(&sounding.0).copied().unwrap_or(0);
        let mut cents = 0.1 * f64::from(tenths);
        let value = egui::DragValue::new(&mut cents).range(-50.0..=50.0).speed(0.1).fixed_decimals(1).suffix(" cents");
        let response = ui.add(value).on_hover_text(about);
        let label = format!("Trim of {name}, cents");
        response.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, label.clone()));
        let mut trims = snapshot.trims.clone();
        if response.changed() {
            trims.insert(sounding.0, (10.0 * cents).round() as i16);
            trims.retain(|_, trim| *trim != 0);
        }
        let others = snapshot.trims.len();
        if others > 0 && ui.button("No trims").on_hover_text(format!("Takes back all trims; there are {others}")).clicked() {
            trims.clear();
        }
        if trims != snapshot.trims {
            actions.push(Action::TrimNotes(trims));
        }
    });
}

fn card(ui: &mut Ui, c: &Colours, name: &str, is_here: bool) -> egui::Response {
    let galley = ui.painter().layout_no_wrap(name.to_owned(), theme::body(), c.ink);
    let size = vec2((galley.size().x + 28.0).max(96.0), 34.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let painter = ui.painter();
    let round = CornerRadius::same(theme::SMALL_RADIUS + 2);
    let fill = if is_here {
        c.accent
    } else if response.hovered() {
        c.hovered
    } else {
        c.raised
    };
    painter.rect_filled(rect, round, fill);
    if response.has_focus() {
        painter.rect_stroke(rect, round, Stroke::new(2.0, c.ink), egui::StrokeKind::Inside);
    }
    let ink = if is_here { c.on_accent } else { c.ink };
    painter.text(rect.center(), Align2::CENTER_CENTER, name, theme::body(), ink);
    response
        .widget_info(|| WidgetInfo::selected(Role::RadioButton, true, is_here, format!("Instrument {name}")));
    response
}

/// The instrument to scale, with its fingers where they are.
fn portrait(ui: &Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let area = ui.available_rect_before_wrap();
    let painter = ui.painter_at(area);
    let body = ClarinetDrawing::new(&snapshot.instrument, area);
    ruler(&painter, c, area, body.scale);
    body.paint(&painter, c, &[]);
    for (index, hole) in snapshot.instrument.holes.iter().enumerate() {
        let opening = chart::share(snapshot.openings.get(index).copied().unwrap_or(0.0));
        body.paint_hole(&painter, c, hole, opening, false);
    }
}

fn facts(ui: &mut Ui, snapshot: &Snapshot) {
    let c = Colours::here(ui);
    let file = &*snapshot.instrument;
    heading(ui, &file.name);
    let down = match file.transposition {
        0 => "as written".to_owned(),
        n if n > 0 => format!("{n} semitones below what is written"),
        n => format!("{} semitones above what is written", -n),
    };
    let name = |note: Option<chalumeau_core::units::SoundingNote>| {
        note.map_or_else(|| "?".into(), |note| note_name(note.0))
    };
    let transposition = file.transposition;
    let rows = [
        ("Sounds", down),
        ("Range, written", format!("{} to {}", note_name(file.lowest().0), note_name(file.highest().0))),
        (
            "Range, sounding",
            format!(
                "{} to {}",
                name(file.lowest().sounding(transposition)),
                name(file.highest().sounding(transposition))
            ),
        ),
        ("Length", format!("{:.1} mm", 1e3 * file.length_m())),
        ("Holes", file.holes.len().to_string()),
        ("Fingerings", file.fingerings.len().to_string()),
        ("Latency", latency(snapshot)),
    ];
    let beside = if ui.available_width() > 520.0 { 2 } else { 1 };
    let grid = egui::Grid::new("facts").num_columns(2 * beside).spacing([18.0, 3.0]).min_row_height(20.0);
    grid.show(ui, |ui| {
        for row in rows.chunks(beside) {
            for (name, value) in row {
                ui.label(RichText::new(*name).color(c.quiet));
                ui.label(value);
            }
            ui.end_row();
        }
    });
    ui.add_space(4.0);
    ui.label(RichText::new(&file.source).font(theme::small()).color(c.quiet));
}

/// Of the instrument, and in a program without a host of the sound card's block.
fn latency(snapshot: &Snapshot) -> String {
    let own = format!("{:.1} ms", snapshot.latency_ms);
    let card = snapshot.connections.as_ref().map(|connections| &connections.chosen);
    // JACK and WASAPI have blocks of their own.
    match card.filter(|chosen| !cfg!(windows) && chosen.output != OutputChoice::Jack) {
        Some(chosen) => {
            let block_ms = 1e3 * f64::from(chosen.block) / f64::from(chosen.rate_hz);
            format!("{own}, and a block of {block_ms:.1} ms")
        }
        None => own,
    }
}

fn column(
    ui: &mut Ui,
    hands: &mut Hands,
    snapshot: &Snapshot,
    names: &mut NoteNames,
    actions: &mut Vec<Action>,
) {
    let c = Colours::here(ui);
    // Who hears nothing looks for it first.
    if let Some(connections) = &snapshot.connections {
        connections_view::draw(ui, connections, actions);
        ui.add_space(8.0);
    }
    ui.label(RichText::new("Names of notes").color(c.quiet));
    let mut chosen = usize::from(*names == NoteNames::Sounding);
    let about = "As they are written for this instrument, or as they sound; in every view and on the keys.";
    segments(ui, "Names of notes", &NoteNames::ALL.map(|names| names.title().to_owned()), &mut chosen)
        .on_hover_text(about);
    *names = NoteNames::ALL[chosen];
    heading(ui, "Pitch");
    slider(ui, hands, "a4");
    choice(ui, hands, "tune");
    choice(ui, hands, "beyond");
    for id in ["transp", "temp", "vent"] {
        slider(ui, hands, id);
    }
    trim(ui, snapshot, *names, actions);
    heading(ui, "Playing");
    for id in ["tongue", "legato", "noise", "bendr"] {
        slider(ui, hands, id);
    }
    heading(ui, "Output");
    slider(ui, hands, "gain");
    // Of a host's exports.
    if snapshot.connections.is_none() {
        choice(ui, hands, "qual");
    }
}
