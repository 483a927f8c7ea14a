//! Breath from a microphone: how hard somebody blows at it, while speech and the room stay silent.
//!
//! Air that hits a microphone makes noise: strong at low frequencies, and without a period. A voice has a period. A hissed
//! consonant has hardly anything below 500 Hz. A plosive is wind, but short. So the gate opens after wind alone for
//! `ONSET_S`, and closes where a period is found or the wind ends. The clarinet's own sound, which comes back from a
//! loudspeaker, has a period too, but nothing below 90 Hz, where wind is strong and speech weak: that keeps an open gate open, and
//! bounds the breath. Otherwise a loud clarinet would blow itself.
//!
//! Two seconds of quiet set the floor ([`WindMeter::calibrate`]). The loudest blow so far is fortissimo. A microphone that has given
//! nothing but exact zeros is not there.
//!
//! It decides every 5 ms of samples, so it does not depend on blocks. It leaves out the direction of the wind: who draws air in
//! near the microphone plays, too.

use crate::maths;

mod bands;
mod period;

use bands::{BandCoeffs, Bands};
use period::PeriodFinder;

/// Time that [`WindMeter::calibrate`] listens to the room, s.
pub const CALIBRATION_S: f64 = 2.0;
/// The room is not believed to be quieter than this, dBFS: the breath of an h is softer than wind.
pub const LEAST_FLOOR_DBFS: f32 = -50.0;
/// Nor louder: from there on nothing could be blown.
pub const MOST_FLOOR_DBFS: f32 = -20.0;

/// Time between two decisions, s.
const STEP_S: f64 = 0.005;
/// Time of wind alone before the gate opens, s: longer than the puff of a plosive.
const ONSET_S: f64 = 0.07;
/// Time without a gap in which no voice may have been heard before the gate opens, s.
const UNVOICED_S: f64 = 0.25;
/// Time without wind after which the gate closes, s.
const CLOSE_S: f64 = 0.06;
/// From here on a period counts. Synthetic wind stays below 0.41; the middle of the speech in `web/tests/wind.mjs` has 0.4 to
/// 0.7.
const VOICED: f64 = 0.45;
/// Least share of a wind's power below 500 Hz, of all above 40 Hz. Wind has 0.2 and more, a hissed s 0.02.
const WIND_SHARE: f64 = 0.2;
/// From this share below 90 Hz on it is wind, whatever has a period. Speech stays below 0.045, most wind is above.
const DEEP_SHARE: f64 = 0.035;
/// Times over which powers are taken together, s: of all, and of what is below 90 Hz, of which there is less.
const MEAN_S: f64 = 0.015;
const DEEP_S: f64 = 0.06;
/// The breath may be so much louder than the wind below 90 Hz makes likely, dB: its power wanders.
const SLACK_DB: f64 = 5.0;
/// Level of the softest blow over the room, dB; the least distance of the loudest from it is as large.
pub const OVER_ROOM_DB: f64 = 12.0;
/// See [`OVER_ROOM_DB`].
const LEAST_RANGE_DB: f64 = 12.0;
/// What plays fortissimo until somebody has blown harder, dBFS.
const LOUD_DBFS: f64 = -16.0;
/// The breath of the softest wind.
const SOFTEST: f64 = 0.05;
/// Time constants of the breath upwards and downwards, s.
const UP_S: f64 = 0.012;
const DOWN_S: f64 = 0.04;
/// Below this the breath is over.
const OVER: f64 = 1e-3;

/// Decisions that a calibration takes.
const LEVELS: usize = (CALIBRATION_S / STEP_S) as usize;

/// What is known of the room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindDesign {
    /// Level of the room's noise above 40 Hz, dBFS.
    pub floor_dbfs: f32,
}

impl Default for WindDesign {
    /// A quiet room.
    fn default() -> Self {
        Self { floor_dbfs: LEAST_FLOOR_DBFS }
    }
}

impl WindDesign {
    /// The same, with a floor that leaves room for wind. What is not a number is a quiet room.
    pub fn clamped(self) -> Self {
        let given = self.floor_dbfs;
        let floor_dbfs = if given.is_nan() { LEAST_FLOOR_DBFS } else { given };
        Self { floor_dbfs: floor_dbfs.clamp(LEAST_FLOOR_DBFS, MOST_FLOOR_DBFS) }
    }
}

/// A meter at one sample rate.
#[derive(Clone, Copy, Debug)]
pub struct WindCoeffs {
    bands: BandCoeffs,
    /// Samples between two decisions.
    step: u32,
}

impl WindCoeffs {
    /// For a sample rate in Hz, 1000 and more.
    pub fn new(rate_hz: f64) -> Self {
        let rate_hz = rate_hz.max(1_000.0);
        Self { bands: BandCoeffs::new(rate_hz), step: (STEP_S * rate_hz).round() as u32 }
    }
}

/// Hears a microphone. Real-time safe.
#[derive(Clone, Debug)]
pub struct WindMeter {
    coeffs: WindCoeffs,
    design: WindDesign,
    bands: Bands,
    period: PeriodFinder,
    count: u32,
    /// Mean power of all, below 500 Hz and below 90 Hz.
    mean: [f64; 3],
    deep_mean: f64,
    /// How much more there is above 90 Hz, dB.
    over_deep_db: f64,
    level_dbfs: f64,
    loud_dbfs: f64,
    breath: f64,
    /// Times of wind, without a voice, without wind, s.
    wind_s: f64,
    unvoiced_s: f64,
    calm_s: f64,
    is_open: bool,
    is_there: bool,
    /// Levels of the room, and how many of them a calibration has taken.
    levels: [f64; LEVELS],
    taken: Option<usize>,
}

impl WindMeter {
    /// A meter that has heard nothing.
    pub fn new(coeffs: WindCoeffs, design: WindDesign) -> Self {
        Self {
            coeffs,
            design: design.clamped(),
            bands: Bands::default(),
            period: PeriodFinder::default(),
            count: 0,
            mean: [0.0; 3],
            deep_mean: 0.0,
            over_deep_db: 0.0,
            level_dbfs: db(0.0),
            loud_dbfs: LOUD_DBFS,
            breath: 0.0,
            wind_s: 0.0,
            unvoiced_s: 0.0,
            calm_s: 0.0,
            is_open: false,
            is_there: false,
            levels: [0.0; LEVELS],
            taken: None,
        }
    }

    /// Forgets all but the room.
    pub fn reset(&mut self) {
        *self = Self::new(self.coeffs, self.design);
    }

    /// Takes a room that was measured before.
    pub fn set_design(&mut self, design: WindDesign) {
        self.design = design.clamped();
    }

    /// The room as it is known.
    pub fn design(&self) -> WindDesign {
        self.design
    }

    /// Measures the room for [`CALIBRATION_S`]; nothing plays meanwhile.
    pub fn calibrate(&mut self) {
        self.taken = Some(0);
        (self.is_open, self.breath, self.loud_dbfs) = (false, 0.0, LOUD_DBFS);
        // Who blew before has stopped.
        (self.wind_s, self.unvoiced_s, self.calm_s) = (0.0, 0.0, 0.0);
    }

    /// Whether the room is being measured.
    pub fn is_calibrating(&self) -> bool {
        self.taken.is_some()
    }

    /// How long the room is still measured, s; `None` if it is not.
    pub fn calibration_left_s(&self) -> Option<f64> {
        self.taken.map(|taken| (LEVELS - taken) as f64 * STEP_S)
    }

    /// Whether the microphone has given anything but exact zeros.
    pub fn is_there(&self) -> bool {
        self.is_there
    }

    /// Whether somebody blows.
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// The breath now, 0..=1.
    pub fn breath(&self) -> f32 {
        self.breath as f32
    }

    /// What the microphone hears above 40 Hz, dBFS.
    pub fn level_dbfs(&self) -> f64 {
        self.level_dbfs
    }

    /// Takes a sample; full scale is 1. Gives the breath, 0..=1, where it decides.
    pub fn tick(&mut self, sample: f32) -> Option<f32> {
        self.is_there |= sample != 0.0;
        // A damaged sample must not live on in the filters; no microphone exceeds full scale by 12 dB.
        let sample = if sample.is_finite() { f64::from(sample.clamp(-4.0, 4.0)) } else { 0.0 };
        let slow = self.bands.tick(&self.coeffs.bands, sample);
        if let Some(slow) = slow {
            self.period.push(slow);
        }
        self.count += 1;
        if self.count < self.coeffs.step {
            return None;
        }
        self.count = 0;
        let powers = self.bands.take_powers(self.coeffs.step);
        self.decide(powers);
        Some(self.breath())
    }

    fn decide(&mut self, powers: [f64; 3]) {
        let share = 1.0 - maths::exp(-STEP_S / MEAN_S);
        for (mean, power) in self.mean.iter_mut().zip(powers) {
            *mean += share * (power - *mean);
        }
        let [all, low, deep] = self.mean;
        let level = db(all);
        self.level_dbfs = level;
        self.deep_mean += (1.0 - maths::exp(-STEP_S / DEEP_S)) * (deep - self.deep_mean);
        if !self.is_open {
            // How much of this wind lies below 90 Hz is learned before the clarinet sounds.
            self.over_deep_db = level - db(self.deep_mean);
        }
        let likely = db(self.deep_mean) + self.over_deep_db + SLACK_DB;
        let blown = if self.is_open { level.min(likely) } else { level };
        if let Some(taken) = self.taken {
            self.listen_to_room(taken, level);
            return;
        }
        let softest = f64::from(self.design.floor_dbfs) + OVER_ROOM_DB;
        let is_loud = level > softest;
        let is_voiced = is_loud && self.period.periodicity() > VOICED;
        let is_heard_through = self.is_open && deep > DEEP_SHARE * all;
        let is_wind = is_loud && (!is_voiced || is_heard_through) && low > WIND_SHARE * all;
        self.unvoiced_s = if is_voiced { 0.0 } else { self.unvoiced_s + STEP_S };
        self.wind_s = if is_wind { self.wind_s + STEP_S } else { (self.wind_s - 2.0 * STEP_S).max(0.0) };
        self.calm_s = if is_wind { 0.0 } else { self.calm_s + STEP_S };
        if !self.is_open && self.wind_s >= ONSET_S && self.unvoiced_s >= UNVOICED_S {
            self.is_open = true;
        }
        if self.is_open && self.calm_s >= CLOSE_S {
            (self.is_open, self.wind_s) = (false, 0.0);
        }
        let mut wanted = 0.0;
        if self.is_open {
            self.loud_dbfs = self.loud_dbfs.max(blown);
            let loudest = self.loud_dbfs.max(softest + LEAST_RANGE_DB);
            wanted = ((blown - softest) / (loudest - softest)).clamp(SOFTEST, 1.0);
        }
        let time_s = if wanted > self.breath { UP_S } else { DOWN_S };
        self.breath += (1.0 - maths::exp(-STEP_S / time_s)) * (wanted - self.breath);
        if self.breath < OVER {
            self.breath = 0.0;
        }
    }

    /// The floor is what the room exceeds a tenth of the time.
    fn listen_to_room(&mut self, taken: usize, level: f64) {
        self.levels[taken] = level;
        let taken = taken + 1;
        self.taken = Some(taken).filter(|&taken| taken < LEVELS);
        if self.taken.is_none() {
            let (_, floor, _) = self.levels.select_nth_unstable_by(9 * LEVELS / 10, f64::total_cmp);
            self.design = WindDesign { floor_dbfs: *floor as f32 }.clamped();
        }
    }
}

fn db(power: f64) -> f64 {
    10.0 * maths::log10(power + 1e-12)
}

#[cfg(test)]
mod tests;
