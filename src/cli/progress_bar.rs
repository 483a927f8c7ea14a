//! Progress bars. They show on a terminal only.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// A bar of this length, drawn as the template says.
pub fn bar(length: usize, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// What is done and since when, for work whose end is not known.
pub fn waiting(doing: &'static str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(doing);
    spinner.enable_steady_tick(Duration::from_millis(100));
    match ProgressStyle::with_template("{spinner} {msg}  {elapsed}") {
        Ok(style) => spinner.with_style(style),
        Err(_) => spinner,
    }
}

/// A bar of how much is done, and how long the rest takes.
pub fn progress(length: usize) -> ProgressBar {
    bar(length, "{bar:40} {percent:>3} %  {elapsed} (left: {eta})")
}
