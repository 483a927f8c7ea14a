//! A pitch that moves, as a line over keys.

/// A line breaks where it jumps by more than this: from note to note, cents.
const JUMP_CENTS: f64 = 60.0;

/// The key of a pitch, with its fraction; MIDI, A4 = 69.
pub fn key(hz: f64, a4_hz: f64) -> f64 {
    69.0 + 12.0 * (hz / a4_hz).log2()
}

/// The points of moments with their keys, and NaN where the line breaks.
pub fn points(moments: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<(f64, f64)> {
    let (mut line, mut last) = (Vec::new(), None);
    for (t_s, here) in moments {
        if let (Some(a), Some(b)) = (here, last)
            && f64::abs(a - b) > JUMP_CENTS / 100.0
        {
            line.push((t_s, f64::NAN));
        }
        line.push((t_s, here.unwrap_or(f64::NAN)));
        last = here;
    }
    line
}
