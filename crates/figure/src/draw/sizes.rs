//! Sizes of words and gaps in every figure, in pixels of the nominal size.

pub(super) const MARGIN: f64 = 26.0;
pub(super) const TITLE: f64 = 33.0;
pub(super) const PANEL_TITLE: f64 = 25.0;
pub(super) const WORDS: f64 = 22.0;
pub(super) const SMALL: f64 = 20.0;
pub(super) const LINE: f64 = 28.0;
pub(super) const GAP: f64 = 26.0;
/// Length of a stroke beside its name in a legend.
pub(super) const SAMPLE: f64 = 34.0;
pub(super) const BAR: f64 = 20.0;
/// Opacity of a band across a panel.
pub(super) const SPAN_OPACITY: f64 = 0.18;
