//! Where an axis has ticks, and what they are called.

use crate::{Axis, Scale, Tick};
use chalumeau_core::units::WrittenNote;

/// Places on an axis.
pub struct Ticks {
    /// Named ones.
    pub named: Vec<Tick>,
    /// Finer lines between.
    pub fine: Vec<f64>,
}

/// Ticks of `axis` between `low` and `high`, about `wanted` of them, at most twice as many.
pub fn of(axis: &Axis, low: f64, high: f64, wanted: usize) -> Ticks {
    if !axis.ticks.is_empty() {
        let inside = |tick: &&Tick| (low..=high).contains(&tick.at);
        return Ticks { named: axis.ticks.iter().filter(inside).cloned().collect(), fine: Vec::new() };
    }
    match axis.scale {
        Scale::Linear => linear(low, high, wanted),
        Scale::Log => log(low, high, wanted),
        Scale::Notes => notes(low, high, wanted),
    }
}

/// Round numbers, 1, 2 or 5 times a power of ten apart.
pub fn linear(low: f64, high: f64, wanted: usize) -> Ticks {
    let rough = (high - low) / wanted.max(1) as f64;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough * 0.999).unwrap_or(10.0);
    let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
    let count = (low / step).ceil() as i64..=(high / step + 1e-9).floor() as i64;
    let tiny = low.abs().max(high.abs()) < 1e-3 || high.abs() >= 1e7;
    let named = count.map(|n| {
        let at = n as f64 * step;
        let text = match tiny {
            true if n == 0 => "0".to_owned(),
            true => format!("{at:.1e}").replace(".0e", "e"),
            false => format!("{at:.decimals$}"),
        };
        Tick { at, text: minus(text) }
    });
    Ticks { named: named.collect(), fine: Vec::new() }
}

/// 1, 2 and 5 of every decade, or tens alone if there are many.
fn log(low: f64, high: f64, wanted: usize) -> Ticks {
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let inside = |at: &f64| (low * 0.999_999..=high * 1.000_001).contains(at);
    let places = |digits: &'static [u32]| {
        let decades = decades.clone();
        decades
            .flat_map(|decade| digits.iter().map(move |&d| f64::from(d) * 10.0_f64.powi(decade)))
            .filter(inside)
    };
    let all: &[u32] = &[1, 2, 3, 4, 5, 6, 7, 8, 9];
    let fine: Vec<f64> = places(all).collect();
    let chosen = [all, &[1, 2, 3, 5, 7], &[1, 2, 5], &[1]];
    let chosen = chosen.into_iter().map(|digits| places(digits).collect::<Vec<f64>>());
    let chosen = chosen.into_iter().find(|places| places.len() <= wanted.max(2));
    match chosen {
        Some(places) if places.len() >= 3 => {
            Ticks { named: places.into_iter().map(|at| Tick { at, text: plain(at) }).collect(), fine }
        }
        // Less than a decade: round numbers as on a linear axis, laid out by ratios.
        _ if high / low < 10.0 => linear(low, high, wanted),
        _ => Ticks { named: places(&[1]).map(|at| Tick { at, text: plain(at) }).collect(), fine: Vec::new() },
    }
}

/// Names of notes, so many semitones apart that they find room.
fn notes(low: f64, high: f64, wanted: usize) -> Ticks {
    let keys = low.ceil().clamp(0.0, 127.0) as u8..=high.floor().clamp(0.0, 127.0) as u8;
    let step = [1, 2, 3, 4, 6, 12].into_iter().find(|step| keys.len() <= wanted.max(1) * step).unwrap_or(12);
    // Counted from C, so that octaves keep their names.
    let named = keys.clone().filter(|key| usize::from(*key) % step == 0);
    Ticks {
        named: named.map(|key| Tick { at: f64::from(key), text: WrittenNote(key).to_string() }).collect(),
        fine: keys.map(f64::from).collect(),
    }
}

fn plain(at: f64) -> String {
    if (0.999e-3..1e7).contains(&at.abs()) {
        let decimals = (-at.abs().log10().floor()).max(0.0) as usize;
        minus(format!("{at:.decimals$}"))
    } else {
        minus(format!("{at:e}"))
    }
}

/// A minus as long as a plus.
fn minus(text: String) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(ticks: &Ticks) -> Vec<&str> {
        ticks.named.iter().map(|tick| tick.text.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(names(&linear(-0.1, 1.0, 6)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(names(&linear(-10.0, 10.0, 5)), ["\u{2212}10", "\u{2212}5", "0", "5", "10"]);
        assert_eq!(names(&linear(0.0, 360.0, 8)), ["0", "50", "100", "150", "200", "250", "300", "350"]);
        assert_eq!(
            names(&linear(0.0, 4e-4, 4)),
            ["0", "1e\u{2212}4", "2e\u{2212}4", "3e\u{2212}4", "4e\u{2212}4"]
        );
    }

    #[test]
    fn log_ticks_thin_out() {
        assert_eq!(names(&log(20.0, 5_000.0, 9)), ["20", "50", "100", "200", "500", "1000", "2000", "5000"]);
        assert_eq!(names(&log(0.01, 10_000.0, 8)), ["0.01", "0.1", "1", "10", "100", "1000", "10000"]);
        assert!(log(300.0, 420.0, 6).named.len() >= 3);
        assert!(log(1e-12, 1e12, 4).named.len() >= 2);
    }

    #[test]
    fn notes_keep_their_octaves() {
        assert_eq!(names(&notes(51.5, 92.0, 8)), ["F#3", "C4", "F#4", "C5", "F#5", "C6", "F#6"]);
        assert_eq!(names(&notes(60.0, 62.0, 8)), ["C4", "C#4", "D4"]);
    }
}
