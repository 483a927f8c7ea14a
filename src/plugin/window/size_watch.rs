//! Which sizes of the window are the user's. Those that follow from a zoom, from opening and from a host that refuses a size are
//! not: a project must not keep them.

use std::time::{Duration, Instant};

/// How long after it has opened, or has got another zoom, a window may come to its size. A host may answer late, or never.
const SETTLES_WITHIN: Duration = Duration::from_secs(1);
/// Sizes that are nearer than this are one, points: pixels are whole.
const SAME: f32 = 2.0;

/// What a frame has seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// The zoom is another than in the frame before: the window now needs its size.
    Zoomed,
    /// The window comes to a size that was asked for.
    Settling,
    /// Nothing has changed.
    Still,
    /// The user has dragged the window to this size.
    Dragged,
}

/// Watches zoom and size.
#[derive(Clone, Copy, Debug, Default)]
pub struct SizeWatch {
    zoom: f32,
    size: (f32, f32),
    /// It has come to the size that was asked for.
    has_come: bool,
    /// When a size was asked for; `None` before the first frame, which may come long after the window was asked for.
    since: Option<Instant>,
}

impl SizeWatch {
    /// A size has been asked for.
    pub fn settle(&mut self, now: Instant) {
        (self.since, self.has_come) = (Some(now), false);
    }

    /// Sees the zoom and the size of a frame, which was asked to be `asked`, points.
    pub fn look(&mut self, zoom: f32, size: (f32, f32), asked: (f32, f32), now: Instant) -> Seen {
        let before = std::mem::replace(&mut self.size, size);
        let zoom_before = std::mem::replace(&mut self.zoom, zoom);
        let Some(since) = self.since else {
            self.settle(now);
            return Seen::Settling;
        };
        if zoom_before != zoom {
            self.settle(now);
            return Seen::Zoomed;
        }
        let is_size =
            |other: (f32, f32)| (other.0 - size.0).abs() <= SAME && (other.1 - size.1).abs() <= SAME;
        let had_come = self.has_come;
        self.has_come |= is_size(asked);
        if !had_come && now.duration_since(since) < SETTLES_WITHIN {
            Seen::Settling
        } else if is_size(before) {
            // Slow drags add up.
            self.size = before;
            Seen::Still
        } else {
            Seen::Dragged
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (f32, f32) = (1_100.0, 720.0);

    /// A system that lets no window be smaller than 700 by 480 pixels: at 50 % it is larger than asked.
    #[test]
    fn a_zoom_brings_sizes_that_are_not_the_users() {
        let began = Instant::now();
        let at = |ms: u64| began + Duration::from_millis(ms);
        let mut watch = SizeWatch::default();
        // The library draws its first frame without knowing the size.
        assert_eq!(watch.look(1.0, (10_000.0, 10_000.0), SIZE, at(0)), Seen::Settling);
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(10)), Seen::Settling, "as it has opened");
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(2_000)), Seen::Still);
        assert_eq!(watch.look(0.5, (2_200.0, 1_440.0), SIZE, at(2_010)), Seen::Zoomed);
        assert_eq!(watch.look(0.5, (1_400.0, 960.0), SIZE, at(2_050)), Seen::Settling);
        assert_eq!(watch.look(0.5, (1_400.0, 960.0), SIZE, at(4_000)), Seen::Still);
        assert_eq!(watch.look(1.0, (700.0, 480.0), SIZE, at(4_010)), Seen::Zoomed);
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(4_050)), Seen::Settling);
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(6_000)), Seen::Still);
    }

    #[test]
    fn what_the_user_drags_is_the_users_however_slowly() {
        let began = Instant::now();
        let mut watch = SizeWatch::default();
        watch.look(1.0, SIZE, SIZE, began);
        let later = began + 2 * SETTLES_WITHIN;
        let drag = |watch: &mut SizeWatch, by: f32| watch.look(1.0, (SIZE.0 + by, SIZE.1), SIZE, later);
        assert_eq!(drag(&mut watch, 1.5), Seen::Still, "rounding to pixels");
        assert_eq!(drag(&mut watch, 3.0), Seen::Dragged);
        watch.settle(later);
        assert_eq!(drag(&mut watch, 300.0), Seen::Settling, "a project was loaded");
    }

    #[test]
    fn a_window_that_has_come_to_its_size_may_be_dragged_at_once() {
        let began = Instant::now();
        let at = |ms: u64| began + Duration::from_millis(ms);
        let mut watch = SizeWatch::default();
        watch.look(1.0, (10_000.0, 10_000.0), SIZE, at(0));
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(20)), Seen::Settling);
        assert_eq!(watch.look(1.0, SIZE, SIZE, at(40)), Seen::Still);
        assert_eq!(watch.look(1.0, (1_220.0, 780.0), SIZE, at(60)), Seen::Dragged);
    }
}
