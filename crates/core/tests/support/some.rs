//! A part of many cases.

/// Whether tests play every case: `CHALUMEAU_ALL_CASES` is set.
pub fn all_cases() -> bool {
    std::env::var_os("CHALUMEAU_ALL_CASES").is_some()
}

/// One of so many cases, spread over all of them and over each of the things that cases combine; or all.
pub fn some<T>(cases: Vec<T>, one_of: u32) -> Vec<T> {
    if all_cases() {
        return cases;
    }
    // Multiples of the golden ratio, which fill the circle evenly and never repeat.
    let turns = |at: usize| (at as f64 * 0.618_033_988_749_894_9).fract();
    let chosen = |(at, case)| (turns(at) < 1.0 / f64::from(one_of)).then_some(case);
    cases.into_iter().enumerate().filter_map(chosen).collect()
}
