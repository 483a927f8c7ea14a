//! The part of the window that a project keeps, and how large the window may be on a screen.

use serde::{Deserialize, Serialize};

use crate::editor::Tab;
use crate::editor::note_names::NoteNames;
use chalumeau_core::units::clamped_or;

/// Size the window opens with, points.
pub const SIZE: (f32, f32) = (1100.0, 720.0);
/// Least size that still shows everything, points.
pub const LEAST_SIZE: (f32, f32) = (700.0, 480.0);
/// Least and most zoom.
pub const ZOOM: (f32, f32) = (0.5, 3.0);

/// The steps of zoom offered.
pub const ZOOMS: [f32; 8] = [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0];

/// Whether a zoom is offered: the screen has room for the least window at that zoom. 100 % and less always are. `room`: see
/// [`WindowState::fitted_size`].
pub fn has_room(zoom: f32, room: Option<(f32, f32)>) -> bool {
    let fits = |(width, height)| LEAST_SIZE.0 * zoom <= width && LEAST_SIZE.1 * zoom <= height;
    zoom <= 1.0 || room.is_none_or(fits)
}

/// The state of the window that is saved with a project. [`WindowState::mended`] limits values from a file to their ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WindowState {
    /// Width and height, points.
    pub size: (f32, f32),
    /// Zoom, 0.5..=3.
    pub zoom: f32,
    /// Dark theme.
    pub is_dark: bool,
    /// The view in front.
    pub tab: Tab,
    /// The views of a laboratory are offered too.
    pub is_lab: bool,
    /// Which pitch the names of notes say.
    pub names: NoteNames,
}

impl Default for WindowState {
    fn default() -> Self {
        Self {
            size: SIZE,
            zoom: 1.0,
            is_dark: true,
            tab: Tab::Play,
            is_lab: false,
            names: NoteNames::Written,
        }
    }
}

impl WindowState {
    /// The same, with every value inside its range.
    pub fn mended(self) -> Self {
        let d = Self::default();
        let fix = |x: f32, (low, high): (f32, f32), default| clamped_or(x, low, high, default);
        Self {
            size: (
                fix(self.size.0, (LEAST_SIZE.0, 8_000.0), d.size.0),
                fix(self.size.1, (LEAST_SIZE.1, 8_000.0), d.size.1),
            ),
            zoom: fix(self.zoom, ZOOM, d.zoom),
            // A project from before the choice may show the reed.
            is_lab: self.is_lab || self.tab == Tab::Reed,
            ..self
        }
    }

    /// From the laboratory to the views that make music, and out of a view that is not one of them. `has_knob`: a knob is
    /// connected or chosen.
    pub fn leave_lab(&mut self, has_knob: bool) {
        self.is_lab = false;
        if self.tab == Tab::Reed || self.tab == Tab::Knob && !has_knob {
            self.tab = Tab::Play;
        }
    }

    /// Whether a view is offered. A view in front stays there when its knob is unplugged: its list of devices leads back to it.
    pub fn offers(&self, tab: Tab, has_knob: bool) -> bool {
        match tab {
            Tab::Reed => self.is_lab,
            Tab::Knob => self.is_lab || has_knob || self.tab == Tab::Knob,
            _ => true,
        }
    }

    /// The size that the window takes at its zoom, points, which is not larger than the screen. `room`: the largest window that
    /// the screen has room for, points at 100 %; `None` if that is not known.
    pub fn fitted_size(&self, room: Option<(f32, f32)>) -> (f32, f32) {
        let Some((width, height)) = room else { return self.size };
        (self.size.0.min(width / self.zoom), self.size.1.min(height / self.zoom))
    }

    /// The zoom, or the largest one offered at which the screen has room for the least window.
    pub fn fitted_zoom(&self, room: Option<(f32, f32)>) -> f32 {
        let fitting = ZOOMS.into_iter().rev().find(|&zoom| has_room(zoom, room));
        if has_room(self.zoom, room) { self.zoom } else { fitting.unwrap_or(1.0).min(self.zoom) }
    }

    /// The user has dragged the window to this size, points. What the screen has forced upon it is no size of the user's, and a
    /// difference from rounding to whole pixels is no change, so a project that is opened and not edited stays as it was saved.
    /// `room`: see [`fitted_size`](Self::fitted_size).
    pub fn resized(&mut self, width: f32, height: f32, room: Option<(f32, f32)>) {
        let known = self.fitted_size(room);
        let is_near = |a: f32, b: f32| (a - b).abs() <= 2.0;
        if !(is_near(known.0, width) && is_near(known.1, height)) {
            self.size = (width, height);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_project_keeps_survives_rubbish() {
        let kept = WindowState {
            size: (f32::NAN, 1e9),
            zoom: -3.0,
            is_dark: false,
            tab: Tab::Sound,
            ..WindowState::default()
        }
        .mended();
        assert_eq!(
            kept,
            WindowState {
                size: (SIZE.0, 8_000.0),
                zoom: 0.5,
                is_dark: false,
                tab: Tab::Sound,
                ..WindowState::default()
            }
        );
        let text = toml::to_string(&kept).unwrap();
        assert_eq!(toml::from_str::<WindowState>(&text).unwrap(), kept);
        assert_eq!(toml::from_str::<WindowState>("").unwrap(), WindowState::default());
    }

    #[test]
    fn a_musician_sees_no_laboratory_until_asked_and_old_projects_keep_their_view() {
        let musician = WindowState::default();
        assert!(musician.offers(Tab::Play, false) && !musician.offers(Tab::Reed, true));
        assert!(!musician.offers(Tab::Knob, false) && musician.offers(Tab::Knob, true));
        for (tab, has_knob, left_for) in [
            (Tab::Reed, true, Tab::Play),
            (Tab::Knob, false, Tab::Play),
            (Tab::Knob, true, Tab::Knob),
            (Tab::Sound, false, Tab::Sound),
        ] {
            let mut kept = WindowState { is_lab: true, tab, ..WindowState::default() };
            kept.leave_lab(has_knob);
            assert_eq!((kept.is_lab, kept.tab), (false, left_for), "{tab:?}, {has_knob}");
        }
        let old = toml::from_str::<WindowState>("tab = \"reed\"").unwrap().mended();
        assert!(old.is_lab && Tab::ALL.iter().all(|&tab| old.offers(tab, false)));
    }

    #[test]
    fn rounding_to_pixels_is_no_new_size() {
        let mut kept = WindowState::default();
        for zoom in [0.5, 0.75, 1.25, 1.5, 2.5, 3.0] {
            let points = |size: f32| (size * zoom).round() / zoom;
            kept.resized(points(SIZE.0), points(SIZE.1), None);
            assert_eq!(kept, WindowState::default());
        }
        kept.resized(SIZE.0 + 20.0, SIZE.1, None);
        assert_eq!(kept.size, (SIZE.0 + 20.0, SIZE.1));
    }

    /// A full-HD screen: the window keeps inside, and what the user has dragged it to comes back with a smaller zoom.
    #[test]
    fn a_zoom_never_leads_past_the_screen() {
        let room = Some((1_900.0, 990.0));
        let at = |zoom| WindowState { zoom, ..WindowState::default() };
        assert_eq!(at(1.0).fitted_size(room), SIZE);
        for zoom in ZOOMS {
            let (width, height) = at(zoom).fitted_size(room);
            assert!(width * zoom <= 1_900.1 && height * zoom <= 990.1, "{zoom}: {width} {height}");
            assert_eq!(at(zoom).fitted_size(None), SIZE);
        }
        let offered: Vec<f32> = ZOOMS.into_iter().filter(|&zoom| has_room(zoom, room)).collect();
        assert_eq!(offered, [0.5, 0.75, 1.0, 1.25, 1.5, 2.0]);
        assert_eq!(
            (at(3.0).fitted_zoom(room), at(1.5).fitted_zoom(room), at(3.0).fitted_zoom(None)),
            (2.0, 1.5, 3.0)
        );
        assert_eq!(at(1.25).fitted_zoom(Some((640.0, 400.0))), 1.0, "a tiny screen");
        let mut kept = at(1.5);
        let (width, height) = kept.fitted_size(room);
        kept.resized(width, height, room);
        assert_eq!(kept, at(1.5), "the screen's doing");
        kept.resized(900.0, height, room);
        assert_eq!(kept.size, (900.0, height));
    }
}
