//! The rows of a search for fingerings: what the fingers press, how far off the note is, how easily it speaks, and the place in
//! the order. Numbers are those of `chalumeau fingerings`.

use egui::{
    Align2, Color32, CornerRadius, Painter, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    pos2, vec2,
};

use crate::editor::fingering_search::FingeringRow;
use crate::editor::hole_names::{fingers_title, hole_title};
use crate::editor::theme;
use crate::editor::theme::Colours;
use crate::editor::widgets::one_line;
use chalumeau_core::bore::fingering_finder::{Found, SURE_DB, bits};
use chalumeau_core::bore::instrument_file::InstrumentFile;

/// Height of a row, points.
const ROW: f32 = 20.0;
/// Space at the sides of a cell.
const PAD: f32 = 6.0;
/// Width of the column of cents, and of the bar that scrolls.
const CENTS: f32 = 52.0;
const SCROLLED: f32 = 10.0;

/// A column at the right end of a row.
struct Column {
    width: f32,
    name: &'static str,
    about: &'static str,
}

/// Those of a note: the numbers of the fingering.
const OF_NOTE: [Column; 4] = [
    Column {
        width: CENTS,
        name: "Cents",
        about: "How far it sounds from the note. The lip lets a note down by 12 cents without effort, and pushes it up by 5.",
    },
    Column {
        width: 66.0,
        name: "Speaks at",
        about: "The mouth pressure at which it begins, as a share of the one that closes the reed.",
    },
    Column {
        width: 46.0,
        name: "Cost",
        about: "What the order goes by, less is better: pitch, ease of speaking, a lower note that could sound instead, \
                and awkward fingers, together.",
    },
    Column { width: 46.0, name: "", about: "" },
];

/// That of a trill.
const OF_TRILL: [Column; 1] =
    [Column { width: 54.0, name: "Moves", about: "How many fingers move from the one to the other." }];

/// The names of the columns. `looked_through`: number of fingerings.
pub fn head(ui: &mut Ui, is_trill: bool, looked_through: usize) {
    let c = Colours::here(ui);
    let (rect, whole) = ui.allocate_exact_size(vec2(ui.available_width(), 15.0), Sense::hover());
    let columns: &[Column] = if is_trill { &OF_TRILL } else { &OF_NOTE };
    let mut right = rect.right() - SCROLLED;
    for (nth, column) in columns.iter().enumerate().rev() {
        let place = Rect::from_x_y_ranges(right - column.width..=right, rect.y_range());
        write(ui.painter(), place, column.name, c.quiet);
        if !column.about.is_empty() {
            ui.interact(place, whole.id.with(nth), Sense::hover()).on_hover_text(column.about);
        }
        right -= column.width;
    }
    let words = format!("Best of {looked_through} fingerings");
    let words = one_line(ui, &words, theme::small(), c.quiet, right - rect.left() - PAD);
    ui.painter().galley(rect.left_top() + vec2(PAD, 0.0), words, c.quiet);
}

/// One row; the fingering in it that was clicked.
pub fn draw_row<'a>(
    ui: &mut Ui,
    nth: usize,
    row: &'a FingeringRow,
    file: &InstrumentFile,
    tried: Option<&[bool]>,
) -> Option<&'a Found> {
    let (rect, whole) = ui.allocate_exact_size(vec2(ui.available_width() - SCROLLED, ROW), Sense::hover());
    let c = Colours::here(ui);
    let Some((to, moves)) = &row.trill else {
        let response = cell(ui, rect, &whole, &format!("Fingering {nth}"), &row.note, file, tried);
        let ink = ink(c, is_tried(&row.note, file, tried));
        let chart = if row.is_of_chart { "chart" } else { "" };
        let texts = [
            // Without the sign of a small negative number.
            format!("{:+.0}", row.note.cents.round() + 0.0),
            format!("{:.0} %", 100.0 * row.note.gamma_on),
            format!("{:.1}", row.note.cost),
            chart.to_owned(),
        ];
        let mut right = rect.right();
        for (column, text) in OF_NOTE.iter().zip(&texts).rev() {
            write(
                ui.painter(),
                Rect::from_x_y_ranges(right - column.width..=right, rect.y_range()),
                text,
                ink,
            );
            right -= column.width;
        }
        fingers(ui, rect.with_max_x(right), &row.note, ink);
        return response.clicked().then_some(&row.note);
    };
    let half = 0.5 * (rect.width() - OF_TRILL[0].width);
    let mut chosen = None;
    for (side, (name, found)) in [("First", &row.note), ("Second", to)].into_iter().enumerate() {
        let left = rect.left() + side as f32 * half;
        let place = Rect::from_x_y_ranges(left..=left + half - 3.0, rect.y_range());
        let response =
            cell(ui, place, &whole, &format!("{name} fingering of trill {nth}"), found, file, tried);
        let ink = ink(c, is_tried(found, file, tried));
        let cents = place.with_min_x(place.right() - CENTS);
        write(ui.painter(), cents, &format!("{:+.0} c", found.cents), ink);
        fingers(ui, place.with_max_x(cents.left()), found, ink);
        if response.clicked() {
            chosen = Some(found);
        }
    }
    let last = rect.with_min_x(rect.right() - OF_TRILL[0].width);
    write(ui.painter(), last, &moves.to_string(), c.ink);
    chosen
}

fn is_tried(found: &Found, file: &InstrumentFile, tried: Option<&[bool]>) -> bool {
    tried.is_some_and(|tried| tried.len() == file.holes.len() && bits(tried) == found.grip.open)
}

fn ink(c: &Colours, is_here: bool) -> Color32 {
    if is_here { c.on_accent } else { c.ink }
}

/// A number at the right end of its column.
fn write(painter: &Painter, place: Rect, text: &str, ink: Color32) {
    painter.text(place.right_center() - vec2(PAD, 0.0), Align2::RIGHT_CENTER, text, theme::small(), ink);
}

/// What the fingers press, cut where it is too long.
fn fingers(ui: &Ui, place: Rect, found: &Found, ink: Color32) {
    let words = one_line(ui, &fingers_title(&found.fingers), theme::small(), ink, place.width() - 2.0 * PAD);
    let y = place.center().y - 0.5 * words.size().y;
    ui.painter().galley(pos2(place.left() + PAD, y), words, ink);
}

/// The ground of a fingering that can be clicked.
fn cell(
    ui: &Ui,
    place: Rect,
    whole: &Response,
    name: &str,
    found: &Found,
    file: &InstrumentFile,
    tried: Option<&[bool]>,
) -> Response {
    let c = Colours::here(ui);
    let response = ui.interact(place, whole.id.with(name), Sense::click());
    let is_here = is_tried(found, file, tried);
    let fill = match (is_here, response.hovered()) {
        (true, _) => c.accent,
        (false, true) => c.hovered,
        (false, false) => c.raised,
    };
    let round = CornerRadius::same(theme::SMALL_RADIUS);
    ui.painter().rect_filled(place, round, fill);
    if response.has_focus() {
        ui.painter().rect_stroke(place, round, Stroke::new(1.5, c.ink), StrokeKind::Inside);
    }
    let label = format!("{name}: {}", fingers_title(&found.fingers));
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, is_here, &label));
    response.on_hover_ui(|ui| {
        ui.set_max_width(300.0);
        ui.strong(fingers_title(&found.fingers));
        let open: Vec<String> = found.grip.open_names(file).map(hole_title).collect();
        ui.label(format!("Open: {}", if open.is_empty() { "none".to_owned() } else { open.join(", ") }));
        let over = match (found.mode, found.evenness_db) {
            (1, _) => "the lowest".to_owned(),
            (_, db) if db >= SURE_DB => format!("{SURE_DB:.0} dB or more over the next lower one"),
            (_, db) => format!("{db:+.1} dB over the next lower one"),
        };
        ui.label(format!("{:.1} Hz, resonance {} of the bore, {over}", found.f_hz, found.mode));
        ui.label(egui::RichText::new("Click to try it").font(theme::small()).color(c.quiet));
    })
}
