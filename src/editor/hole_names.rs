//! Names of holes as musicians write them. Instrument files write `GS_KEY` for the G# key.

/// The words of a hole's name: "GS_KEY" is "G#" and "key".
pub fn hole_words(name: &str) -> Vec<String> {
    name.split('_').enumerate().map(|(index, word)| word_of(word, index == 0)).collect()
}

/// The same on one line.
pub fn hole_title(name: &str) -> String {
    hole_words(name).join(" ")
}

/// What the fingers of a fingering press, as a reader says it. Instrument files write `low Ckey`, and nothing where no finger does.
pub fn fingers_title(fingers: &str) -> String {
    if fingers.trim().is_empty() {
        return "no finger".to_owned();
    }
    fingers.replace("key", " key").replace("sliver", "sliver ").replace("side", "side ")
}

/// Whether the thumb covers this hole, which is at the back. Instrument files write `THUMB`.
pub fn is_thumb(name: &str) -> bool {
    name.eq_ignore_ascii_case("thumb")
}

fn word_of(word: &str, is_first: bool) -> String {
    match word.as_bytes() {
        [b'A'..=b'G'] => word.to_owned(),
        &[note @ b'A'..=b'G', b'S' | b's'] => format!("{}#", char::from(note)),
        &[note @ b'A'..=b'G', b'B' | b'b'] => format!("{}b", char::from(note)),
        _ => {
            let mut letters = word.chars();
            let first = letters.next().map_or_else(String::new, |first| {
                if is_first { first.to_uppercase().to_string() } else { first.to_lowercase().to_string() }
            });
            first + &letters.as_str().to_lowercase()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_words_of_their_own() {
        assert_eq!(fingers_title("R T L1 sliverB Ebkey"), "R T L1 sliver B Eb key");
        assert_eq!(fingers_title(" "), "no finger");
    }

    #[test]
    fn sharps_and_flats_have_their_signs() {
        for (name, title) in [
            ("GS_KEY", "G# key"),
            ("EB_KEY", "Eb key"),
            ("SIDE2_Fs", "Side2 F#"),
            ("TRILL3_Bb", "Trill3 Bb"),
            ("SLIVER_B", "Sliver B"),
            ("L2_VENT", "L2 vent"),
            ("REG", "Reg"),
            ("R1", "R1"),
            ("", ""),
        ] {
            assert_eq!(hole_title(name), title, "{name}");
        }
    }
}
