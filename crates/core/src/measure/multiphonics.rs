//! Multiphonics: fingerings on which the voice sounds two notes at once, found by playing.
//!
//! The candidates come from [`FingeringFinder::multiphonics`](crate::bore::fingering_finder::FingeringFinder::multiphonics). A
//! blowing machine plays each with the lip of a held note. It is a multiphonic if its strong partials are multiples of no one
//! fundamental. `data/multiphonics.toml` keeps what was found on the built-in clarinet.

use std::sync::{Arc, LazyLock};

use serde::Deserialize;

use crate::analysis::spectrum::power_spectrum_db;
use crate::event::{Event, Timed};
use crate::instrument::{Clarinet, Model, Settings};
use crate::maths;
use crate::units::SoundingNote;

/// How far below the strongest partial another one counts, dB.
pub const STRONG_DB: f64 = 15.0;
const RATE_HZ: f64 = 48_000.0;
/// Samples that are played at each breath, and of these the last ones that are looked at.
const PLAYED: usize = 46_000;
const LOOKED_AT: usize = 32_768;
/// Where partials are looked for, Hz.
const PARTIALS_HZ: [f64; 2] = [60.0, 5_000.0];
/// Softer is silence, dBFS of the strongest partial.
const SILENT_DB: f64 = -50.0;
/// How far a partial may be off a multiple of a fundamental, in fundamentals, and the lowest fundamental that counts as heard, Hz.
const OFF: f64 = 0.04;
const LOWEST_HZ: f64 = 70.0;

/// A multiphonic of the built-in clarinet.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlayedMultiphonic {
    /// What the fingers press.
    pub fingers: String,
    /// Names of the open holes, separated by spaces.
    pub open: String,
    /// The sounding note that is held meanwhile: its lip and delay play.
    pub held: u8,
    /// Mouth pressure over full breath of [`Settings::physical`].
    pub breath: f32,
    /// Its partials within [`STRONG_DB`] of the strongest, Hz.
    pub partials_hz: Vec<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MultiphonicsFile {
    #[serde(default)]
    multiphonic: Vec<PlayedMultiphonic>,
}

static BUILT_IN: LazyLock<Vec<PlayedMultiphonic>> = LazyLock::new(|| {
    let text = include_str!("../../data/multiphonics.toml");
    // PANIC: the text is a constant of this program and a test reads it.
    toml::from_str::<MultiphonicsFile>(text).expect("the multiphonics are valid").multiphonic
});

/// Those of the built-in clarinet, made by `cargo run --release -p chalumeau-core --features threads --example multiphonics`.
pub fn built_in() -> &'static [PlayedMultiphonic] {
    &BUILT_IN
}

/// A partial of a sound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partial {
    /// Frequency, Hz.
    pub hz: f64,
    /// Level, dBFS.
    pub level_db: f64,
}

/// Plays these open holes (one bit each) while a note is held, without breath noise, and returns the strong partials at each breath,
/// lowest first; none where it is silent or its level moves. Allocates.
pub fn play(model: &Arc<Model>, held: SoundingNote, open: u64, breaths: &[f32]) -> Vec<Vec<Partial>> {
    let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
    clarinet.set_settings(&Settings { noise: 0.0, ..Settings::physical() });
    let first = [Event::NoteOn { note: held, velocity: 1.0 }, Event::TryHoles(Some(open))];
    first.into_iter().for_each(|event| clarinet.apply(event));
    let mut block = vec![0.0; PLAYED];
    breaths
        .iter()
        .map(|&breath| {
            let blow = Timed { at: 0, event: Event::Breath(breath) };
            clarinet.render_events([blow], &mut block);
            let sound: Vec<f64> = block[PLAYED - LOOKED_AT..].iter().map(|&x| f64::from(x)).collect();
            let (early, late) = sound.split_at(LOOKED_AT / 2);
            let power = |part: &[f64]| part.iter().map(|x| x * x).sum::<f64>();
            let steady = (10.0 * maths::log10(power(early) / power(late))).abs() < 1.0;
            if steady { strong_partials(&sound) } else { Vec::new() }
        })
        .collect()
}

/// Maxima of the spectrum within [`STRONG_DB`] of the highest.
fn strong_partials(sound: &[f64]) -> Vec<Partial> {
    let spectrum = power_spectrum_db(sound, RATE_HZ);
    let level = &spectrum.level_db;
    let [first, last] = PARTIALS_HZ.map(|hz| (hz / spectrum.bin_hz) as usize);
    let highest = level[first..last].iter().copied().fold(SILENT_DB, f64::max);
    (first..last)
        // The window spreads a partial over four bins to each side.
        .filter(|&k| level[k] > highest - STRONG_DB && (k - 4..=k + 4).all(|other| level[other] <= level[k]))
        .filter(|&k| level[k] > SILENT_DB)
        .map(|k| {
            let (a, b, c) = (level[k - 1], level[k], level[k + 1]);
            let beside = if a + c < 2.0 * b { 0.5 * (a - c) / (a - 2.0 * b + c) } else { 0.0 };
            Partial { hz: (k as f64 + beside) * spectrum.bin_hz, level_db: b }
        })
        .collect()
}

/// Whether there are two or more partials, and they are multiples of no one fundamental.
pub fn is_multiphonic(partials: &[Partial]) -> bool {
    let [lowest, _, ..] = partials else { return false };
    let fits = |f0_hz: f64| {
        partials.iter().all(|partial| {
            let order = partial.hz / f0_hz;
            (order - order.round()).abs() < OFF
        })
    };
    let fundamentals = (1..).map(|n| lowest.hz / f64::from(n)).take_while(|&hz| hz >= LOWEST_HZ);
    // The lowest partial itself may be off a little.
    !fundamentals.into_iter().any(|hz| (-3..=3).any(|step| fits(hz * (1.0 + 0.002 * f64::from(step)))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bore::instrument_file::InstrumentFile;

    fn partials(all_hz: &[f64]) -> Vec<Partial> {
        all_hz.iter().map(|&hz| Partial { hz, level_db: -10.0 }).collect()
    }

    #[test]
    fn a_note_is_no_multiphonic() {
        assert!(!is_multiphonic(&partials(&[200.0, 600.0, 1_000.0])));
        assert!(!is_multiphonic(&partials(&[600.0, 1_000.0])), "all of one fundamental of 200 Hz");
        assert!(!is_multiphonic(&partials(&[440.0])) && !is_multiphonic(&[]));
        assert!(is_multiphonic(&partials(&[286.7, 738.8, 1_025.5])));
        let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
        let low = &model.file.fingerings[0];
        let open = crate::bore::fingering_finder::bits(&low.open);
        let held = low.written.sounding(model.file.transposition).unwrap();
        let [heard] = &play(&model, held, open, &[0.5])[..] else { panic!() };
        assert!(heard.len() > 2 && !is_multiphonic(heard), "{} {held:?} {open:b} {heard:?}", low.written);
    }

    #[test]
    fn those_that_are_kept_sound_on_the_voice() {
        let file = InstrumentFile::built_in();
        let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
        assert!(built_in().len() >= 12);
        for kept in built_in() {
            let open =
                kept.open.split_whitespace().fold(0, |bits, name| bits | 1 << file.hole(name).unwrap());
            let [heard] = &play(&model, SoundingNote(kept.held), open, &[kept.breath])[..] else { panic!() };
            assert!(is_multiphonic(heard), "{}: {heard:?}", kept.fingers);
            for (heard, kept_hz) in heard.iter().zip(&kept.partials_hz) {
                assert!((heard.hz - kept_hz).abs() < 2.0, "{}: {heard:?} {kept_hz}", kept.fingers);
            }
        }
    }
}
