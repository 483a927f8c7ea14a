//! A part of many cases.

/// Where this variable is set, tests play every case. It takes three times as long.
const ALL: &str = "CHALUMEAU_ALL_CASES";

/// One of so many cases, spread over all of them and over each of the things that cases combine; all where
/// `CHALUMEAU_ALL_CASES` is set.
pub fn some<T>(cases: Vec<T>, one_of: u32) -> Vec<T> {
    if std::env::var_os(ALL).is_some() {
        return cases;
    }
    // Multiples of the golden ratio, which fill the circle evenly and never repeat.
    let turns = |at: usize| (at as f64 * 0.618_033_988_749_894_9).fract();
    let chosen = |(at, case)| (turns(at) < 1.0 / f64::from(one_of)).then_some(case);
    cases.into_iter().enumerate().filter_map(chosen).collect()
}
