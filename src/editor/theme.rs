//! The editor's theme: two sets of colours with the same meanings, font sizes and distances.
//!
//! The curves' colours are those of the figures ([`palette`](chalumeau_figure::palette): Okabe and Ito, told apart by readers
//! with any kind of colour vision), darkened a little on paper, where they are also text, and lightened on the dark
//! ground. Each has one meaning in every view: blue is breath,
//! green where a note speaks, orange where the reed beats, vermilion where it closes, purple what the hand feels.

use std::sync::{Arc, LazyLock};

use egui::{
    Color32, Context, CornerRadius, FontFamily, FontId, Margin, Shadow, Stroke, Style, TextStyle, Theme, Ui,
};

use chalumeau_figure::palette::{Colour, Rgb};

/// Colours by meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Colours {
    /// Behind everything.
    pub ground: Color32,
    /// Behind pictures and groups of controls.
    pub panel: Color32,
    /// Buttons and tracks.
    pub raised: Color32,
    /// Buttons under the pointer.
    pub hovered: Color32,
    /// Frames and rules.
    pub line: Color32,
    /// Lines of a grid.
    pub grid: Color32,
    /// Text.
    pub ink: Color32,
    /// Text of less weight; 4.5 to 1 and more on `panel`.
    pub quiet: Color32,
    /// What is chosen, and what a slider holds: cane.
    pub accent: Color32,
    /// Text on `accent`.
    pub on_accent: Color32,
    /// Breath and pressure.
    pub breath: Color32,
    /// Where a note speaks; what is well.
    pub speaks: Color32,
    /// Where the reed beats.
    pub beats: Color32,
    /// Where the reed closes.
    pub closes: Color32,
    /// Torque.
    pub felt: Color32,
    /// Where nothing sounds any more.
    pub chokes: Color32,
    /// Odd harmonics; the colour of breath.
    pub odd_harmonic: Color32,
    /// Even harmonics.
    pub even_harmonic: Color32,
    /// What needs attention at once.
    pub danger: Color32,
    /// Body of the clarinet, and its edge.
    pub wood: Color32,
    /// Pads and keys.
    pub metal: Color32,
    /// Inside of the bore.
    pub air: Color32,
    /// White keys.
    pub ivory: Color32,
    /// Black keys, and the mouthpiece.
    pub ebony: Color32,
    /// The reed.
    pub cane: Color32,
    /// Tips of fingers.
    pub skin: Color32,
}

const fn rgb(hex: u32) -> Color32 {
    Color32::from_rgb((hex >> 16) as u8, (hex >> 8) as u8, hex as u8)
}

/// A colour of the figures between black (-1), itself (0) and white (1).
fn toned(colour: Colour, tone: f32) -> Color32 {
    let Rgb(r, g, b) = colour.rgb();
    let end = if tone < 0.0 { 0.0 } else { 255.0 };
    let mix = |x: u8| (f32::from(x) + tone.abs() * (end - f32::from(x))).round() as u8;
    Color32::from_rgb(mix(r), mix(g), mix(b))
}

static COLOURS: LazyLock<[Colours; 2]> = LazyLock::new(|| [light(), dark()]);

/// Paper. Curves are also text here, so the lighter ones are darkened until small words read.
fn light() -> Colours {
    Colours {
        ground: rgb(0xf3_f0ea),
        panel: rgb(0xfd_fcfa),
        raised: rgb(0xe9_e4db),
        hovered: rgb(0xdf_d8cc),
        line: rgb(0xd5_cec2),
        grid: rgb(0xea_e6df),
        ink: toned(Colour::Ink, 0.0),
        quiet: rgb(0x5e_6068),
        accent: rgb(0x9a_6a12),
        on_accent: rgb(0xff_ffff),
        breath: toned(Colour::Blue, 0.0),
        speaks: toned(Colour::Green, -0.12),
        beats: toned(Colour::Orange, -0.20),
        closes: toned(Colour::Vermilion, -0.10),
        felt: toned(Colour::Purple, -0.12),
        chokes: toned(Colour::Grey, 0.0),
        odd_harmonic: toned(Colour::Blue, 0.0),
        even_harmonic: toned(Colour::Orange, 0.0),
        danger: rgb(0xb3_2318),
        wood: rgb(0x4a_3a32),
        metal: rgb(0xa9_adb4),
        air: rgb(0xfb_f6ea),
        ivory: rgb(0xff_fefb),
        ebony: rgb(0x2b_2725),
        cane: rgb(0xd2_bf8c),
        skin: rgb(0xd9_a283),
    }
}

/// Grenadilla.
fn dark() -> Colours {
    Colours {
        ground: rgb(0x15_1618),
        panel: rgb(0x1d_1e21),
        raised: rgb(0x2c_2d31),
        hovered: rgb(0x39_3a3f),
        line: rgb(0x3a_3b40),
        grid: rgb(0x2a_2b2f),
        ink: rgb(0xec_e9e3),
        quiet: rgb(0xa6_a39d),
        accent: rgb(0xe0_b060),
        on_accent: rgb(0x1c_160a),
        breath: toned(Colour::Sky, 0.22),
        speaks: toned(Colour::Green, 0.32),
        beats: toned(Colour::Orange, 0.25),
        closes: toned(Colour::Vermilion, 0.28),
        felt: toned(Colour::Purple, 0.38),
        chokes: toned(Colour::Grey, 0.25),
        odd_harmonic: toned(Colour::Sky, 0.22),
        even_harmonic: toned(Colour::Orange, 0.30),
        danger: rgb(0xff_6a5a),
        wood: rgb(0x7d_6454),
        metal: rgb(0xb4_b8c0),
        air: rgb(0x24_2320),
        ivory: rgb(0xd8_d3c9),
        ebony: rgb(0x26_2422),
        cane: rgb(0xd6_c596),
        skin: rgb(0xd8_a082),
    }
}

impl Colours {
    /// Those of a theme.
    pub fn of(theme: Theme) -> &'static Self {
        &COLOURS[usize::from(theme == Theme::Dark)]
    }

    /// Those in force where `ui` draws.
    pub fn here(ui: &Ui) -> &'static Self {
        Self::of(if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light })
    }
}

/// Rounding of panels, and of the small things inside them.
pub const PANEL_RADIUS: u8 = 8;
/// See [`PANEL_RADIUS`].
pub const SMALL_RADIUS: u8 = 4;
/// Distance between panels.
pub const GAP: f32 = 8.0;

/// Ordinary text.
pub fn body() -> FontId {
    FontId::proportional(13.0)
}

/// Names of axes, marks and units.
pub fn small() -> FontId {
    small_grown(1.0)
}

/// The same in a view whose words are `grown` times as large as in a window of the usual size.
pub fn small_grown(grown: f32) -> FontId {
    FontId::proportional(12.0 * grown)
}

/// Headings inside a view.
pub fn heading() -> FontId {
    FontId::proportional(15.0)
}

static STYLES: LazyLock<[Arc<Style>; 2]> =
    LazyLock::new(|| [Arc::new(style(Theme::Light)), Arc::new(style(Theme::Dark))]);

fn style(theme: Theme) -> Style {
    let c = Colours::of(theme);
    let mut style = theme.default_style();
    style.text_styles = [
        (TextStyle::Small, small()),
        (TextStyle::Body, body()),
        (TextStyle::Button, body()),
        (TextStyle::Heading, heading()),
        (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
    ]
    .into();
    let v = &mut style.visuals;
    v.override_text_color = None;
    v.weak_text_color = Some(c.quiet);
    v.panel_fill = c.ground;
    v.window_fill = c.panel;
    v.window_stroke = Stroke::new(1.0, c.line);
    v.window_corner_radius = CornerRadius::same(PANEL_RADIUS);
    v.menu_corner_radius = CornerRadius::same(PANEL_RADIUS);
    v.popup_shadow = Shadow { offset: [0, 4], blur: 14, spread: 0, color: Color32::from_black_alpha(50) };
    v.extreme_bg_color = c.panel;
    v.faint_bg_color = c.raised;
    v.text_edit_bg_color = Some(c.ground);
    v.warn_fg_color = c.beats;
    v.error_fg_color = c.danger;
    v.hyperlink_color = c.breath;
    v.selection.bg_fill = c.accent;
    v.selection.stroke = Stroke::new(1.0, c.on_accent);
    let round = CornerRadius::same(SMALL_RADIUS + 1);
    for (widget, fill, stroke) in [
        (&mut v.widgets.noninteractive, c.panel, Stroke::new(1.0, c.line)),
        (&mut v.widgets.inactive, c.raised, Stroke::NONE),
        (&mut v.widgets.hovered, c.hovered, Stroke::new(1.0, c.line)),
        (&mut v.widgets.active, c.hovered, Stroke::new(1.0, c.accent)),
        (&mut v.widgets.open, c.hovered, Stroke::new(1.0, c.line)),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = stroke;
        widget.fg_stroke = Stroke::new(1.0, c.ink);
        widget.corner_radius = round;
        widget.expansion = 0.0;
    }
    style.spacing.item_spacing = egui::vec2(8.0, 6.0);
    style.spacing.button_padding = egui::vec2(10.0, 4.0);
    style.spacing.interact_size.y = 24.0;
    style.spacing.window_margin = Margin::same(10);
    style.spacing.menu_margin = Margin::same(8);
    style.spacing.tooltip_width = 320.0;
    style.spacing.combo_width = 120.0;
    style.interaction.tooltip_delay = 0.4;
    style.interaction.selectable_labels = false;
    style.animation_time = 0.0;
    style
}

/// Puts the looks of `theme` into force, here and in popups.
pub fn apply(ui: &mut Ui, theme: Theme) {
    let ctx: Context = ui.ctx().clone();
    let id = egui::Id::unique("chalumeau looks");
    if ctx.data(|data| data.get_temp::<bool>(id)) != Some(true) {
        ctx.set_style_of(Theme::Light, STYLES[0].clone());
        ctx.set_style_of(Theme::Dark, STYLES[1].clone());
        // Ctrl and plus belong to the host; the zoom has a list of its own.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        ctx.data_mut(|data| data.insert_temp(id, true));
    }
    if ctx.theme() != theme {
        ctx.set_theme(theme);
    }
    ui.set_style(STYLES[usize::from(theme == Theme::Dark)].clone());
}

/// A frame that groups what belongs together.
pub fn panel(c: &Colours) -> egui::Frame {
    egui::Frame::new()
        .fill(c.panel)
        .stroke(Stroke::new(1.0, c.line))
        .corner_radius(CornerRadius::same(PANEL_RADIUS))
        .inner_margin(Margin::same(10))
}

/// Contrast of WCAG 2.
#[cfg(test)]
pub(crate) fn contrast(a: Color32, b: Color32) -> f64 {
    let luminance = |c: Color32| {
        let linear = |x: u8| {
            let x = f64::from(x) / 255.0;
            if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(c.r()) + 0.7152 * linear(c.g()) + 0.0722 * linear(c.b())
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_reads_and_curves_stand_out_on_both_grounds() {
        for theme in [Theme::Light, Theme::Dark] {
            let c = Colours::of(theme);
            for ground in [c.ground, c.panel] {
                assert!(contrast(c.ink, ground) > 7.0, "{theme:?}");
                assert!(contrast(c.quiet, ground) > 4.5, "{theme:?} {}", contrast(c.quiet, ground));
            }
            assert!(contrast(c.on_accent, c.accent) > 4.5, "{theme:?} {}", contrast(c.on_accent, c.accent));
            assert!(contrast(c.ink, c.raised) > 7.0);
            for curve in [c.accent, c.breath, c.speaks, c.beats, c.closes, c.felt, c.chokes, c.danger] {
                assert!(contrast(curve, c.panel) > 3.0, "{theme:?} {curve:?} {}", contrast(curve, c.panel));
            }
        }
    }
}
