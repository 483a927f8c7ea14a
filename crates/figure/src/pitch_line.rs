//! A pitch that moves, as a line over keys.

/// A line breaks where it jumps by more than this: from note to note, cents.
const JUMP_CENTS: f64 = 60.0;
/// A shorter piece of the line may be a mistake, s: a window of the track and half as much.
const DOUBTFUL_S: f64 = 0.09;
/// Keys from a pitch up to those whose period is a half and a third of its own.
const SHORTER_PERIODS: [f64; 2] = [12.0, 19.02];

/// The key of a pitch, with its fraction; MIDI, A4 = 69.
pub fn key(hz: f64, a4_hz: f64) -> f64 {
    69.0 + 12.0 * (hz / a4_hz).log2()
}

/// The points of moments with their keys, and NaN where the line breaks.
///
/// Where one note dies away in the next, a track finds for a moment twice or three times the period. So a short piece an octave or a
/// twelfth below the one beside it is left out.
pub fn points(moments: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<(f64, f64)> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut last = None;
    for (t_s, here) in moments {
        if let Some(key) = here {
            match (last, pieces.last_mut()) {
                (Some(last), Some(piece)) if is_near(key, last) => piece.push((t_s, key)),
                _ => pieces.push(vec![(t_s, key)]),
            }
        }
        last = here;
    }
    let kept = |at: &usize| {
        let beside = [at.checked_sub(1).and_then(|before| pieces.get(before)), pieces.get(at + 1)];
        !beside.into_iter().flatten().any(|other| is_longer_period(&pieces[*at], other))
    };
    let broken = |at: usize| pieces[at].iter().copied().chain([(pieces[at][0].0, f64::NAN)]);
    (0..pieces.len()).filter(kept).flat_map(broken).collect()
}

/// Whether a piece is short and beside the other, and its period twice or three times as long.
fn is_longer_period(piece: &[(f64, f64)], other: &[(f64, f64)]) -> bool {
    let ends = |piece: &[(f64, f64)]| Some((*piece.first()?, *piece.last()?));
    let (Some((first, last)), Some((other_first, other_last))) = (ends(piece), ends(other)) else {
        return false;
    };
    let (here, there) = if other_first.0 > last.0 { (last, other_first) } else { (first, other_last) };
    last.0 - first.0 < DOUBTFUL_S
        && (there.0 - here.0).abs() < DOUBTFUL_S
        && SHORTER_PERIODS.iter().any(|keys| is_near(here.1 + keys, there.1))
}

fn is_near(key: f64, other: f64) -> bool {
    f64::abs(key - other) <= JUMP_CENTS / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The line of keys that follow each other every 10 ms.
    fn line(keys: &[(usize, Option<f64>)]) -> Vec<(f64, f64)> {
        let keys = keys.iter().flat_map(|&(count, key)| std::iter::repeat_n(key, count));
        points(keys.enumerate().map(|(at, key)| (0.01 * at as f64, key)))
    }

    fn drawn(line: &[(f64, f64)]) -> Vec<f64> {
        line.split(|(_, key)| key.is_nan()).filter_map(|piece| Some(piece.first()?.1)).collect()
    }

    #[test]
    fn a_short_piece_of_a_longer_period_is_left_out() {
        let beside = |key, count| drawn(&line(&[(20, Some(69.0)), (count, Some(key)), (20, Some(71.0))]));
        assert_eq!(beside(57.1, 4), [69.0, 71.0]);
        assert_eq!(beside(71.0 - 19.0, 4), [69.0, 71.0]);
        // What lasts is played, and so is another interval.
        assert_eq!(beside(57.1, 15), [69.0, 57.1, 71.0]);
        assert_eq!(beside(62.0, 4), [69.0, 62.0, 71.0]);
        assert_eq!(beside(81.0, 4), [69.0, 81.0, 71.0]);
        let apart = [(20, Some(69.0)), (20, None), (4, Some(57.0)), (20, None), (20, Some(69.0))];
        assert_eq!(drawn(&line(&apart)), [69.0, 57.0, 69.0]);
    }
}
