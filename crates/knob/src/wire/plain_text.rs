//! Text that a device sends, made safe to show: a terminal obeys control characters, and some of Unicode reorder the line.

/// `text` without control characters and without characters that change the direction of writing. Allocates.
pub fn plain(text: &str) -> String {
    text.chars().filter(|&c| !c.is_control() && !turns_text(c)).collect()
}

/// Marks, embeddings, overrides and isolates of direction, and line and paragraph separators.
fn turns_text(c: char) -> bool {
    matches!(c, '\u{200e}' | '\u{200f}' | '\u{061c}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_gone_and_the_rest_stays() {
        assert_eq!(plain("Knob \u{1b}[2J\u{1b}]0;title\u{7}ok\r\n\u{9b}31m"), "Knob [2J]0;titleok31m");
        assert_eq!(plain("\u{202e}bonK\u{2066}"), "bonK");
        assert_eq!(plain("Tuner \u{e9}\u{4e2d} 1"), "Tuner \u{e9}\u{4e2d} 1");
    }
}
