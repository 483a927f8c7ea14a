//! What all modules share: the air in the bore, and notes as they sound and as they are written.
//!
//! Everything inside the instrument is in SI units. Files, MIDI and hosts speak *sounding* pitch; fingering charts
//! are *written*. The two are different types so that they cannot be mixed up: on a B flat clarinet a written C4
//! sounds B flat 3, two semitones lower.
//!
//! ```
//! use chalumeau_core::units::{Air, SoundingNote, WrittenNote, cents};
//!
//! let written = WrittenNote(60);
//! assert_eq!(written.to_string(), "C4");
//! assert_eq!(written.sounding(2), Some(SoundingNote(58)));
//! assert_eq!(SoundingNote(69).frequency_hz(442.0), 442.0);
//! // Sound is faster in warm air: a clarinet rises by 3 cents a kelvin.
//! let rise = cents(Air::at(26.0).c, Air::at(25.0).c);
//! assert!((rise - 2.9).abs() < 0.1);
//! ```

use crate::maths;
use std::fmt;

/// The state of the air in the bore at one temperature (50 % relative humidity at 25 C, 400 ppm CO2).
///
/// Values at 25 C follow Ernoult, Inria report RR-9500 (2023), as used by openwind 0.12.4. Away from 25 C the speed of
/// sound follows the square root of absolute temperature, density its inverse, viscosity and conductivity the power
/// laws T^0.76 and T^0.85 (fits to dry air near room temperature). So the air keeps the water content of 25 C and 50 %. Against air of
/// 50 % humidity at each temperature, from 0 to 40 C, density is up to 0.8 % off and the speed of sound up to 0.3 %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Temperature, degrees Celsius.
    pub temperature_c: f64,
    /// Speed of sound, m/s.
    pub c: f64,
    /// Density, kg/m3.
    pub rho: f64,
    /// Dynamic viscosity, Pa s.
    pub mu: f64,
    /// Thermal conductivity, W/(m K).
    pub kappa: f64,
    /// Specific heat at constant pressure, J/(kg K).
    pub cp: f64,
    /// Ratio of specific heats.
    pub gamma: f64,
}

impl Air {
    /// Air at a temperature in degrees Celsius, from 0 to 40, with the water content of 25 C and 50 % humidity.
    pub fn at(temperature_c: f64) -> Self {
        let ratio = (temperature_c + 273.15) / 298.15;
        Self {
            temperature_c,
            c: 347.132_409_179_073_4 * ratio.sqrt(),
            rho: 1.177_296_156_486_458 / ratio,
            mu: 1.844_514_355_756_439e-5 * maths::pow(ratio, 0.76),
            kappa: 0.025_932_154_153_163_91 * maths::pow(ratio, 0.85),
            cp: 1_014.699_561_359_552_6,
            gamma: 1.400_530_054_789_436_2,
        }
    }

    /// Characteristic impedance `rho c / (pi r^2)` of a tube of radius `radius_m`, Pa s/m3.
    pub fn z_c(&self, radius_m: f64) -> f64 {
        self.rho * self.c / (std::f64::consts::PI * radius_m * radius_m)
    }
}

impl Default for Air {
    fn default() -> Self {
        Self::at(25.0)
    }
}

/// Lowest and highest host rate, Hz: the widest range that a validator of plugins was seen to ask for. A low rate cannot
/// carry high notes.
pub const HOST_RATES_HZ: (f64, f64) = (1_000.0, 1_536_000.0);

/// The rate that is taken where none can be: the nearest within [`HOST_RATES_HZ`], and 48 kHz for NaN, Hz.
pub(crate) fn nearest_rate_hz(host_rate_hz: f64) -> f64 {
    if host_rate_hz.is_nan() { 48_000.0 } else { host_rate_hz.clamp(HOST_RATES_HZ.0, HOST_RATES_HZ.1) }
}

/// Range of A4 that calculations without sound accept, Hz. What sounds is made for a narrower one,
/// [`A4_RANGE_HZ`](crate::instrument::concert_pitch::A4_RANGE_HZ).
pub const A4_OF_THEORY_HZ: (f64, f64) = (100.0, 1_000.0);

/// Radius of the bore that dimensionless figures (zeta, |Z|/Zc) refer to, m: that of a B flat clarinet. An instrument file
/// may name another (`nominal_diameter_mm`).
pub const REFERENCE_RADIUS_M: f64 = 7.45e-3;

/// Length of the built-in B flat clarinet from the tip of the reed to the end of the bell, m. What was fitted to that instrument goes with
/// the length of another over it.
pub const REFERENCE_LENGTH_M: f64 = 0.667_587;

/// A note as MIDI, files and hosts know it: MIDI number of the pitch that sounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SoundingNote(pub u8);

/// A note as the player reads it and the fingering chart names it: MIDI number of the written pitch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WrittenNote(pub u8);

impl SoundingNote {
    /// Equal-tempered frequency, Hz, for the given A4.
    pub fn frequency_hz(self, a4_hz: f64) -> f64 {
        a4_hz * maths::exp2((f64::from(self.0) - 69.0) / 12.0)
    }

    /// The note to read for this pitch on an instrument that sounds `transposition` semitones below what is written
    /// (B flat clarinet: 2), or `None` outside MIDI's 0..=127.
    pub fn written(self, transposition: i8) -> Option<WrittenNote> {
        let midi = i16::from(self.0) + i16::from(transposition);
        u8::try_from(midi).ok().filter(|&midi| midi < 128).map(WrittenNote)
    }
}

impl WrittenNote {
    /// The pitch that sounds, `transposition` semitones below, or `None` outside MIDI's 0..=127.
    pub fn sounding(self, transposition: i8) -> Option<SoundingNote> {
        let midi = i16::from(self.0) - i16::from(transposition);
        u8::try_from(midi).ok().filter(|&midi| midi < 128).map(SoundingNote)
    }
}

fn name(midi: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    const NAMES: [&str; 12] = ["C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B"];
    write!(f, "{}{}", NAMES[usize::from(midi % 12)], i16::from(midi / 12) - 1)
}

impl fmt::Display for SoundingNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        name(self.0, f)
    }
}

impl fmt::Display for WrittenNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        name(self.0, f)
    }
}

/// MIDI number of a note by name: letter, `#` or `b`, octave with middle C as C4 (60); `None` if it is no such name.
pub fn midi_of_name(name: &str) -> Option<u8> {
    let mut rest = name.chars();
    let letter = match rest.next()?.to_ascii_uppercase() {
        'C' => 0,
        'D' => 2,
        'E' => 4,
        'F' => 5,
        'G' => 7,
        'A' => 9,
        'B' => 11,
        _ => return None,
    };
    let rest = rest.as_str();
    let (accidental, octave) = match (rest.strip_prefix('#'), rest.strip_prefix('b')) {
        (Some(octave), _) => (1, octave),
        (_, Some(octave)) => (-1, octave),
        _ => (0, rest),
    };
    let octave: i8 = octave.parse().ok().filter(|octave| (-1..=9).contains(octave))?;
    u8::try_from(12 * (i16::from(octave) + 1) + letter + accidental).ok().filter(|&midi| midi < 128)
}

/// Interval from `from_hz` up to `to_hz`, cents; negative if `to_hz` is the lower. Both are above 0.
pub fn cents(to_hz: f64, from_hz: f64) -> f64 {
    1200.0 * maths::log2(to_hz / from_hz)
}

/// A number inside its range; one that is not finite becomes the default. Real-time safe.
pub fn clamped_or(x: f32, low: f32, high: f32, default: f32) -> f32 {
    if x.is_finite() { x.clamp(low, high) } else { default }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_is_two_above_sounding_on_a_b_flat_clarinet() {
        assert_eq!(SoundingNote(69).written(2), Some(WrittenNote(71)));
        assert_eq!(WrittenNote(60).sounding(2), Some(SoundingNote(58)));
        assert_eq!(SoundingNote(127).written(2), None);
        assert_eq!(WrittenNote(1).sounding(2), None);
        assert_eq!(WrittenNote(60).to_string(), "C4");
    }

    #[test]
    fn names_and_numbers_agree() {
        for midi in 0..128 {
            assert_eq!(midi_of_name(&WrittenNote(midi).to_string()), Some(midi));
        }
        assert_eq!(
            (midi_of_name("Bb3"), midi_of_name("c4"), midi_of_name("Cb4")),
            (Some(58), Some(60), Some(59))
        );
        for wrong in ["", "H4", "C", "C#", "C10", "G#9", "Cb-1", "C##4", "C400", "C4 ", "é4"] {
            assert_eq!(midi_of_name(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn a4_is_a4() {
        assert_eq!(SoundingNote(69).frequency_hz(442.0), 442.0);
        assert!((cents(SoundingNote(70).frequency_hz(440.0), 440.0) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn air_warms_three_cents_a_kelvin() {
        let rise = cents(Air::at(26.0).c, Air::at(25.0).c);
        assert!((2.8..3.0).contains(&rise), "{rise}");
    }
}
