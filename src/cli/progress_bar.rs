//! Progress bars. They show on a terminal only.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of this length, drawn as the template says.
pub fn bar(length: usize, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// A bar of how much is done, and how long the rest takes.
pub fn progress(length: usize) -> ProgressBar {
    bar(length, "{bar:40} {percent:>3} %  {elapsed} (left: {eta})")
}
