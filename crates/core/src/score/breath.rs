//! Mouth pressure over time: gamma, mouth pressure over closing pressure, with straight lines between points.
//!
//! A curve is a constant, a ramp, a crescendo over the whole score, a player's dynamics over the whole score, or a CSV file `t_s,gamma`. The pressure is constant
//! before the first point and after the last one. While the curve moves, it reaches the instrument as one breath event per
//! millisecond, finer than any controller; the instrument smooths between them.

use crate::event::{Event, Timed};
use crate::instrument::player::response::breath_of_dynamic;
use crate::instrument::{BreathResponse, Settings};
use crate::score::samples::samples_in;
use std::io;
use std::io::{BufRead, BufReader};

/// Largest gamma of a breath curve. The instrument is tested up to here.
pub const GAMMA_MAX: f32 = 3.0;

/// Most points of a breath file: one hour at one point per millisecond.
const POINTS_MAX: usize = 3_600_000;

/// Time between breath events while the curve moves, s.
const STEP_S: f64 = 0.001;
/// Longest ramp: a day, s.
const LONGEST_S: f64 = 86_400.0;
/// Most characters of a file that an error shows.
const SHOWN: usize = 60;

/// Why a breath curve was refused. Lines are counted from 1; the messages say what would be right.
#[derive(Debug, thiserror::Error)]
pub enum BreathError {
    /// A gamma outside 0 to 3.
    #[error("gamma must lie in 0..3 (mouth pressure over closing pressure), got {0}")]
    Gamma(f32),
    /// A text that is no ramp.
    #[error("breath {0:?} is neither a CSV file nor ramp:FROM:TO:SECONDS, for example ramp:0:1:4")]
    Shape(String),
    /// A text that is no crescendo.
    #[error("crescendo must be FROM:TO, for example 0.4:0.9, got {0:?}")]
    Crescendo(String),
    /// A duration outside 0 s to a day.
    #[error("a ramp lasts more than 0 s and at most a day, got {0:?}")]
    Seconds(String),
    /// The file cannot be read.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// A line that has not two columns.
    #[error("line {line}: expected two columns t_s,gamma, got {given:?}")]
    Columns {
        /// Line in the file.
        line: u64,
        /// The line as it stands.
        given: String,
    },
    /// A field that is not a finite number.
    #[error("line {line}: {column} must be a number, got {given:?}")]
    Number {
        /// Line in the file.
        line: u64,
        /// Column name.
        column: &'static str,
        /// The field as it stands.
        given: String,
    },
    /// A first line of two words that are not the columns.
    #[error("line {line}: the header must be t_s,gamma, got {given:?}")]
    Header {
        /// Line in the file.
        line: u64,
        /// The line as it stands.
        given: String,
    },
    /// A time that is not later than that of the line before.
    #[error("line {line}: t_s must grow from line to line, got {given} after {before}")]
    Time {
        /// Line in the file.
        line: u64,
        /// Time of this line, s.
        given: f64,
        /// Time of the line before, s.
        before: f64,
    },
    /// A first time that is negative.
    #[error("line {line}: t_s must be at least 0, got {given}")]
    Negative {
        /// Line in the file.
        line: u64,
        /// Time of this line, s.
        given: f64,
    },
    /// A gamma outside 0 to 3 in a file.
    #[error("line {line}: gamma must lie in 0..3 (mouth pressure over closing pressure), got {given}")]
    LineGamma {
        /// Line in the file.
        line: u64,
        /// The gamma as it stands.
        given: f32,
    },
    /// A file without points.
    #[error("no data: expected lines t_s,gamma, for example 0.0,0.5")]
    Empty,
    /// A file with too many points.
    #[error("more than {POINTS_MAX} points; one per millisecond is enough")]
    TooLong,
}

/// Gamma over time: mouth pressure over closing pressure, 0 to 3.
#[derive(Clone, Debug, PartialEq)]
pub struct BreathCurve {
    /// Time in s, strictly growing, and gamma 0..=3. Never empty.
    points: Vec<(f64, f32)>,
    /// Whether time is a fraction of the score instead of seconds.
    relative: bool,
}

/// The nearest gamma that a curve may have; 0 for NaN.
fn clamped(gamma: f32) -> f32 {
    if gamma.is_nan() { 0.0 } else { gamma.clamp(0.0, GAMMA_MAX) }
}

fn gamma(gamma: f32) -> Result<f32, BreathError> {
    if (0.0..=GAMMA_MAX).contains(&gamma) { Ok(gamma) } else { Err(BreathError::Gamma(gamma)) }
}

/// The value of [`Event::Breath`] that gives a mouth pressure of `gamma` times the closing pressure, where the breath is
/// [physical](BreathResponse::Physical). It exceeds 1 if full breath does not reach that pressure. Where the breath is played,
/// `gamma` is itself a share of full breath.
pub fn breath_of_gamma(gamma: f32, settings: &Settings) -> f32 {
    match settings.breath_response {
        BreathResponse::Physical => gamma * closing_kpa(settings) / settings.breath_full_kpa,
        BreathResponse::Played => gamma,
    }
}

/// Closing pressure of the reed with these settings, kPa.
pub fn closing_kpa(settings: &Settings) -> f32 {
    (1e-3 * settings.closing_pa()) as f32
}

impl BreathCurve {
    /// The same gamma all the time, clamped to 0..=3; NaN counts as 0.
    pub fn constant(gamma: f32) -> Self {
        Self { points: vec![(0.0, clamped(gamma))], relative: false }
    }

    /// From 0 to `gamma` and back, `seconds` each way; gamma clamped to 0..=3, seconds to a millisecond..=a day. NaN counts as the least.
    pub fn swell(gamma: f32, seconds: f64) -> Self {
        let seconds = if seconds.is_nan() { STEP_S } else { seconds.clamp(STEP_S, LONGEST_S) };
        let top = (seconds, clamped(gamma));
        Self { points: vec![(0.0, 0.0), top, (2.0 * seconds, 0.0)], relative: false }
    }

    /// The same so many seconds later, and until then what it begins with. Not for a curve over the whole score.
    pub(crate) fn after(mut self, seconds: f64) -> Self {
        self.points.iter_mut().for_each(|point| point.0 += seconds);
        self
    }

    /// A crescendo or diminuendo `FROM:TO` in gamma, over the whole score.
    ///
    /// # Errors
    ///
    /// [`BreathError::Crescendo`] for any other text, [`BreathError::Gamma`] for a value outside 0..=3.
    pub fn parse_crescendo(text: &str) -> Result<Self, BreathError> {
        let bad = || BreathError::Crescendo(text.to_owned());
        let (from, to) = text.split_once(':').ok_or_else(bad)?;
        let number = |s: &str| s.trim().parse::<f32>().map_err(|_| bad());
        Ok(Self { points: vec![(0.0, gamma(number(from)?)?), (1.0, gamma(number(to)?)?)], relative: true })
    }

    /// A player's dynamics, 0..=1, from one to another over the whole score, where the breath is [played](BreathResponse::Played).
    pub fn dynamics(from: f64, to: f64, settings: &Settings) -> Self {
        // The curve between breath and dynamic may be bent; with as many straight pieces nobody hears them.
        const PIECES: u32 = 64;
        let point = |piece: u32| {
            let way = f64::from(piece) / f64::from(PIECES);
            (way, breath_of_dynamic(from + way * (to - from), settings) as f32)
        };
        Self { points: (0..=PIECES).map(point).collect(), relative: true }
    }

    /// A ramp `ramp:FROM:TO:SECONDS` in gamma, then constant. An `s` after the seconds is allowed.
    ///
    /// # Errors
    ///
    /// [`BreathError::Shape`] for any other text, [`BreathError::Seconds`] for a duration outside 0 s to a day,
    /// [`BreathError::Gamma`] for a value outside 0..=3.
    pub fn parse_ramp(text: &str) -> Result<Self, BreathError> {
        let bad = || BreathError::Shape(text.to_owned());
        let fields: Vec<&str> =
            text.strip_prefix("ramp:").ok_or_else(bad)?.split(':').map(str::trim).collect();
        let &[from, to, duration] = fields.as_slice() else { return Err(bad()) };
        let number = |s: &str| s.parse::<f32>().map_err(|_| bad());
        let seconds = duration
            .trim_end_matches('s')
            .parse::<f64>()
            .ok()
            .filter(|s| *s > 0.0 && *s <= LONGEST_S)
            .ok_or_else(|| BreathError::Seconds(duration.to_owned()))?;
        Ok(Self {
            points: vec![(0.0, gamma(number(from)?)?), (seconds, gamma(number(to)?)?)],
            relative: false,
        })
    }

    /// Reads lines `t_s,gamma`. A header line `t_s,gamma` may come first; `#` begins a comment line.
    ///
    /// # Errors
    ///
    /// [`BreathError`] with the number of the first line that is wrong, or what the reader reports.
    pub fn read_csv(from: impl io::Read) -> Result<Self, BreathError> {
        let mut points: Vec<(f64, f32)> = Vec::new();
        let mut first = true;
        // Two plain numbers need no quoting. Counted here, line numbers include empty lines and comments.
        for (text, line) in BufReader::new(from).split(b'\n').zip(1..) {
            let text = text?;
            let text = String::from_utf8_lossy(&text);
            let text = text.trim_start_matches('\u{feff}').trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let fields: Vec<&str> = text.split(',').map(str::trim).collect();
            let &[t, g] = fields.as_slice() else {
                return Err(BreathError::Columns { line, given: shown(text) });
            };
            if std::mem::take(&mut first) {
                if (t, g) == ("t_s", "gamma") {
                    continue;
                }
                if [t, g].iter().all(|field| field.parse::<f64>().is_err()) {
                    return Err(BreathError::Header { line, given: shown(text) });
                }
            }
            let number = |given: &str, column| {
                let refused = || BreathError::Number { line, column, given: shown(given) };
                given.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(refused)
            };
            let (t, g) = (number(t, "t_s")?, number(g, "gamma")? as f32);
            match points.last() {
                None if t < 0.0 => return Err(BreathError::Negative { line, given: t }),
                Some(&(before, _)) if t <= before => {
                    return Err(BreathError::Time { line, given: t, before });
                }
                _ => {}
            }
            if !(0.0..=GAMMA_MAX).contains(&g) {
                return Err(BreathError::LineGamma { line, given: g });
            }
            if points.len() == POINTS_MAX {
                return Err(BreathError::TooLong);
            }
            points.push((t, g));
        }
        if points.is_empty() { Err(BreathError::Empty) } else { Ok(Self { points, relative: false }) }
    }

    /// When the curve has its last value, s; 0 for one that stays as it is, `None` for one over the whole score.
    ///
    /// ```
    /// use chalumeau_core::score::breath::BreathCurve;
    ///
    /// assert_eq!(BreathCurve::parse_ramp("ramp:0:0.8:4")?.ends_s(), Some(4.0));
    /// assert_eq!(BreathCurve::constant(0.5).ends_s(), Some(0.0));
    /// assert_eq!(BreathCurve::parse_crescendo("0.4:0.8")?.ends_s(), None);
    /// # Ok::<(), chalumeau_core::score::breath::BreathError>(())
    /// ```
    pub fn ends_s(&self) -> Option<f64> {
        let (end, _) = self.points[self.points.len() - 1];
        (!self.relative).then_some(if self.points.len() > 1 { end } else { 0.0 })
    }

    /// The largest gamma of the curve.
    pub fn gamma_max(&self) -> f32 {
        self.points.iter().fold(0.0, |max, p| max.max(p.1))
    }

    /// Gamma at `t`, in seconds or as a fraction of the score.
    fn at(&self, t: f64) -> f32 {
        let after = self.points.partition_point(|p| p.0 <= t);
        match (after.checked_sub(1).map(|i| self.points[i]), self.points.get(after)) {
            (Some((t0, g0)), Some(&(t1, g1))) => {
                (f64::from(g0) + (t - t0) / (t1 - t0) * f64::from(g1 - g0)) as f32
            }
            (Some((_, g)), None) | (None, Some(&(_, g))) => g,
            (None, None) => 0.0,
        }
    }

    /// Breath events for a score that lasts `samples`.
    pub(super) fn events(&self, samples: usize, rate: u32, settings: &Settings) -> Vec<Timed<Event>> {
        let rate = rate.max(1);
        let unit = if self.relative { (samples as f64 / f64::from(rate)).max(STEP_S) } else { 1.0 };
        let mut events: Vec<Timed<Event>> = Vec::new();
        let mut last = None;
        for step in 0.. {
            let at = samples_in(f64::from(step) * STEP_S, rate);
            if step > 0 && at >= samples {
                break;
            }
            let gamma = self.at(at as f64 / f64::from(rate) / unit);
            if last.replace(gamma) != Some(gamma) {
                events.push(Timed { at, event: Event::Breath(breath_of_gamma(gamma, settings)) });
            }
        }
        events
    }
}

/// A text as an error shows it: of a long one, such as that of a file that is no table, the beginning.
fn shown(text: &str) -> String {
    let kept: String = text.chars().take(SHOWN).collect();
    if kept.len() < text.len() { kept + "..." } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instrument::player::response::dynamic;

    #[test]
    fn reference_breath_is_gamma() {
        let settings = Settings::physical();
        assert!((breath_of_gamma(0.5, &settings) - 0.5).abs() < 1e-6);
        let wide = Settings { breath_full_kpa: 12.0, ..settings };
        assert!((breath_of_gamma(1.5, &wide) - 0.75).abs() < 1e-6);
        let hard = Settings { strength: 3.5, ..settings };
        assert!((closing_kpa(&hard) - 6.0 * 1.44).abs() < 1e-4);
        assert_eq!(breath_of_gamma(0.5, &Settings { strength: 3.5, ..Settings::default() }), 0.5, "a share");
    }

    #[test]
    fn dynamics_are_straight_whatever_the_curve_of_the_breath() {
        let settings = Settings { breath_curve: 0.5, breath_softest: 0.1, ..Settings::default() };
        let curve = BreathCurve::dynamics(0.2, 0.8, &settings);
        for way in [0.0, 0.13, 0.5, 0.99, 1.0] {
            let played = dynamic(f64::from(curve.at(way)), &settings).0;
            assert!((played - (0.2 + 0.6 * way)).abs() < 1e-3, "{way}: {played}");
        }
        let one = BreathCurve::dynamics(0.6, 0.6, &settings);
        assert_eq!(one.events(48_000, 48_000, &settings).len(), 1);
    }

    #[test]
    fn what_is_no_number_blows_nothing() {
        assert_eq!(BreathCurve::constant(f32::NAN), BreathCurve::constant(0.0));
        assert_eq!(BreathCurve::constant(f32::INFINITY).gamma_max(), GAMMA_MAX);
        assert_eq!(BreathCurve::swell(f32::NAN, 1.0).gamma_max(), 0.0);
        for seconds in [f64::NAN, 0.0, -1.0, f64::INFINITY, 1e300] {
            let swell = BreathCurve::swell(0.5, seconds);
            assert!(swell.points.windows(2).all(|pair| pair[0].0 < pair[1].0), "{swell:?}");
            assert!((0..3).all(|t| (0.0..=0.5).contains(&swell.at(f64::from(t)))), "{swell:?}");
        }
    }

    fn refusal(text: &str) -> String {
        BreathCurve::read_csv(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn lines_between_points_and_held_ends() {
        let curve = BreathCurve::read_csv("# my breath\nt_s,gamma\n1, 0.2\n2, 0.6\n".as_bytes()).unwrap();
        assert_eq!(curve.at(0.0), 0.2);
        assert!((curve.at(1.5) - 0.4).abs() < 1e-6);
        assert_eq!(curve.at(9.0), 0.6);
        assert_eq!(curve.gamma_max(), 0.6);
    }

    #[test]
    fn constant_is_one_event_and_a_ramp_one_per_millisecond() {
        let settings = Settings::physical();
        assert_eq!(BreathCurve::constant(0.5).events(48_000, 48_000, &settings).len(), 1);
        let ramp = BreathCurve::parse_ramp("ramp:0:1:0.5s").unwrap().events(48_000, 48_000, &settings);
        assert_eq!(ramp.len(), 501);
        assert!(matches!(ramp[500], Timed { at: 24_000, event: Event::Breath(b) } if (b - 1.0).abs() < 1e-6));
        let swell = BreathCurve::parse_crescendo("0.4:0.8").unwrap().events(48_000, 48_000, &settings);
        assert_eq!(swell.len(), 1000);
        assert!(matches!(swell[500].event, Event::Breath(b) if (b - 0.6).abs() < 1e-6));
    }

    #[test]
    fn refusals_name_the_line_and_what_would_be_right() {
        assert!(
            refusal("t_s,gamma\n0,0.1\n1,loud\n").starts_with("line 3: gamma must be a number, got \"loud\"")
        );
        assert!(refusal("0,0.1\n\n0,0.2\n").starts_with("line 3: t_s must grow"));
        assert!(refusal("0,0.1,7\n").starts_with("line 1: expected two columns t_s,gamma, got \"0,0.1,7\""));
        assert!(refusal("0,3.5\n").starts_with("line 1: gamma must lie in 0..3"));
        assert!(refusal("-1,0.5\n").starts_with("line 1: t_s must be at least 0, got -1"));
        assert!(refusal("0,0.5\n-1,0.5\n").starts_with("line 2: t_s must grow"));
        let header = refusal("time,pressure\n0,0.5\n");
        assert!(
            header.starts_with("line 1: the header must be t_s,gamma, got \"time,pressure\""),
            "{header}"
        );
        assert!(refusal("0,nan\n").starts_with("line 1: gamma must be a number"));
        assert!(refusal("# nothing\n").starts_with("no data"));
    }

    #[test]
    fn shapes_that_are_none_are_refused() {
        for text in ["ramp:0:1", "ramp:a:1:2", "ramp:0:1:0", "ramp:0:4:1", "rampe:0:1:2"] {
            assert!(BreathCurve::parse_ramp(text).is_err(), "{text}");
        }
        for text in ["0.4", "0.4:x", "0.4:-1", "0.4:0.9:1", "nan:1"] {
            assert!(BreathCurve::parse_crescendo(text).is_err(), "{text}");
        }
    }
}
