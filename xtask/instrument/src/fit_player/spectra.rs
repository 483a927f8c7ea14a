//! One note on a grid of opening, flow strength and mouth pressure, and what lies between the points.
//!
//! The opening belongs to the grid because not everything goes with the closing pressure: jets in the open holes take more from a loud note,
//! and the knee of the lay is a smaller share of a wider opening.

use chalumeau_core::analysis::pitch::OTHER_CENTS;
use chalumeau_core::analysis::{pitch, spectrum};
use chalumeau_core::instrument::player::dynamics::{LipShape, PlayerModel};
use chalumeau_core::instrument::presence::Presence;
use chalumeau_core::instrument::trial_note::{Start, TrialNote};
use chalumeau_core::instrument::{Listening, Model};
use chalumeau_core::reed::ReedLaw;
use chalumeau_core::reed::physical::ZETA_REFERENCE;
use chalumeau_core::units::{SoundingNote, cents};

/// Harmonics of a spectrum: of low notes, those above the twelfth move the centroid.
pub const HARMONICS: usize = 24;
/// Flow strengths of the grid.
const ZETAS: [f64; 6] = [0.14, 0.2, 0.28, 0.38, 0.5, 0.66];
/// Openings of the grid over the rest opening of the reed: from a lip that holds the reed of a throat note nearly shut to one at
/// fortissimo; with the lowest mouth pressure that is played with each.
const OPENINGS: [(f64, f64); 6] =
    [(0.45, 0.0), (0.62, 0.0), (0.85, 0.0), (1.17, 0.4), (1.63, 0.5), (2.2, 0.5)];
/// Time until a note is steady, and time that it is heard, s.
const HEARD_S: (f64, f64) = (1.0, 1.3);
/// What counts as nothing, dB under the strongest harmonic.
const SILENT_DB: f64 = -200.0;
/// How far above the loudest point of the grid a level may be asked for, dB.
const OVER_DB: f64 = 0.7;

/// Mouth pressures of the grid over the closing pressure: close together near the thresholds.
fn gammas() -> impl Iterator<Item = f64> {
    let fine = (0..12).map(|n| 0.36 + 0.008 * f64::from(n));
    let middle = (0..6).map(|n| 0.46 + 0.025 * f64::from(n));
    fine.chain(middle).chain((0..8).map(|n| 0.62 + 0.06 * f64::from(n)))
}

/// A steady note.
#[derive(Clone, Copy, Debug)]
pub struct PlayedSpectrum {
    /// Levels of harmonics 1.. of the radiated pressure, dB re 1 Pa at the reference closing pressure, as all levels here.
    pub harmonics_db: [f64; HARMONICS],
}

/// What presence adds to the harmonics of a note.
pub struct Gains {
    db: [f64; HARMONICS],
    powers: [f64; HARMONICS],
}

/// A steady note on the grid, without presence.
#[derive(Clone, Copy)]
struct Point {
    /// Mouth over closing pressure.
    gamma: f64,
    spectrum: PlayedSpectrum,
    /// Powers of the harmonics, Pa^2.
    powers: [f64; HARMONICS],
}

/// One note on the grid.
pub struct NoteSpectra {
    /// Sounding note, MIDI.
    pub midi: u8,
    /// Fundamental in equal temperament, Hz.
    pub f0_hz: f64,
    /// Place over the lowest note, as the player's rule has it.
    pub place: f64,
    /// For each of [`OPENINGS`] and [`ZETAS`]: where the note sounds, at rising mouth pressures.
    rows: Vec<Vec<Vec<Point>>>,
}

impl Gains {
    /// Of a note with this fundamental, Hz.
    pub fn of(presence: &Presence, f0_hz: f64) -> Self {
        let db = std::array::from_fn(|h| presence.gain_db((h + 1) as f64 * f0_hz));
        Self { db, powers: db.map(power) }
    }
}

/// Power of a level.
fn power(level_db: f64) -> f64 {
    10.0_f64.powf(0.1 * level_db)
}

impl Point {
    fn new(gamma: f64, spectrum: PlayedSpectrum) -> Self {
        Self { gamma, spectrum, powers: spectrum.harmonics_db.map(power) }
    }

    /// Level with presence, dB.
    fn level_db(&self, gains: &Gains) -> f64 {
        let powers = self.powers.iter().zip(&gains.powers);
        10.0 * powers.map(|(power, gain)| power * gain).sum::<f64>().log10()
    }

    fn mixed(&self, other: &Self, way: f64) -> PlayedSpectrum {
        self.spectrum.mixed(&other.spectrum, way)
    }
}

impl PlayedSpectrum {
    fn mixed(&self, other: &Self, way: f64) -> Self {
        let mix = |a: f64, b: f64| a + way * (b - a);
        Self { harmonics_db: std::array::from_fn(|h| mix(self.harmonics_db[h], other.harmonics_db[h])) }
    }

    /// With presence.
    pub fn heard(&self, gains: &Gains) -> Self {
        Self { harmonics_db: std::array::from_fn(|h| self.harmonics_db[h] + gains.db[h]) }
    }

    /// Level of the whole, dB.
    pub fn level_db(&self) -> f64 {
        10.0 * self.harmonics_db.map(power).iter().sum::<f64>().log10()
    }

    /// Power-weighted mean frequency of the harmonics, Hz.
    pub fn centroid_hz(&self, f0_hz: f64) -> f64 {
        let powers = self.harmonics_db.map(power).into_iter().zip(1..);
        let (sum, moment) = powers.fold((0.0, 0.0), |(sum, moment), (power, h)| {
            (sum + power, moment + power * f64::from(h) * f0_hz)
        });
        moment / sum
    }

    fn hear(model: &Model, held: &TrialNote, opening: f64, wanted_hz: f64) -> Option<Self> {
        let rate_hz = model.coeffs.rate_hz;
        let sound = held.radiated(model, HEARD_S.0, HEARD_S.1);
        let hz = pitch::fundamental_hz(&sound, rate_hz)?;
        let is_own =
            cents(hz, wanted_hz).abs() < OTHER_CENTS && pitch::periodicity(&sound, rate_hz, hz) > 0.98;
        let mut relative = spectrum::levels_of_harmonics_db(&sound, rate_hz, hz, HARMONICS);
        if !is_own || relative.is_empty() {
            return None;
        }
        // Above the band nothing is heard.
        relative.resize(HARMONICS, SILENT_DB);
        // The levels are relative: their powers add up to that of the whole.
        let sum_db = 10.0 * relative.iter().copied().map(power).sum::<f64>().log10();
        let strongest_db = spectrum::rms_dbfs(&sound) - sum_db - 20.0 * opening.log10();
        // Without presence: it is fitted, too.
        let plain = |h: usize| relative[h] + strongest_db - Presence::FITTED.gain_db((h + 1) as f64 * hz);
        let heard = Self { harmonics_db: std::array::from_fn(plain) };
        (heard.level_db() > -60.0).then_some(heard)
    }
}

impl NoteSpectra {
    /// Plays a note on the grid; `None` if it has no fingering. Takes some ten seconds.
    pub fn play(model: &Model, midi: u8) -> Option<Self> {
        let fingering = model.fingering_for(SoundingNote(midi))?;
        let (place, f0_hz) = (model.place(fingering), model.notes_hz[fingering]);
        let row = |zeta: f64, (opening, lowest): (f64, f64)| {
            let channel = zeta / ZETA_REFERENCE / opening.sqrt();
            let lip = LipShape { opening, channel, knee: PlayerModel::FITTED.knee_at(place, opening) };
            let point = |gamma: f64| {
                let new = TrialNote::new(model, fingering, gamma);
                let held = TrialNote {
                    law: lip.law(ReedLaw::default()),
                    zeta: ZETA_REFERENCE * lip.channel,
                    lay: new.lay * lip.knee,
                    start: Start::Tongued(2.0),
                    listening: Listening::default(),
                    ..new
                };
                Some(Point::new(gamma, PlayedSpectrum::hear(model, &held, opening, f0_hz)?))
            };
            gammas().filter(|&gamma| gamma >= lowest).filter_map(point).collect()
        };
        let layer = |opening| ZETAS.into_iter().map(|zeta| row(zeta, opening)).collect();
        Some(Self { midi, f0_hz, place, rows: OPENINGS.into_iter().map(layer).collect() })
    }

    /// At a flow strength and an opening, by lines in their logarithms.
    fn at(
        &self,
        zeta: f64,
        opening: f64,
        in_row: impl Fn(&[Point]) -> Option<PlayedSpectrum>,
    ) -> Option<PlayedSpectrum> {
        let right = OPENINGS.partition_point(|(at, _)| *at < opening).clamp(1, OPENINGS.len() - 1);
        let (narrow, wide) = (OPENINGS[right - 1].0, OPENINGS[right].0);
        let way = ((opening / narrow).ln() / (wide / narrow).ln()).clamp(0.0, 1.0);
        let layer = |at: usize| Self::in_layer(&self.rows[at], zeta, &in_row);
        match way {
            0.0 => layer(right - 1),
            1.0 => layer(right),
            way => Some(layer(right - 1)?.mixed(&layer(right)?, way)),
        }
    }

    /// At a flow strength, by lines in its logarithm between two rows.
    fn in_layer(
        rows: &[Vec<Point>],
        zeta: f64,
        in_row: impl Fn(&[Point]) -> Option<PlayedSpectrum>,
    ) -> Option<PlayedSpectrum> {
        let right = ZETAS.partition_point(|&at| at < zeta).clamp(1, ZETAS.len() - 1);
        let (low, high) = (ZETAS[right - 1].ln(), ZETAS[right].ln());
        let way = ((zeta.ln() - low) / (high - low)).clamp(0.0, 1.0);
        let low = in_row(&rows[right - 1])?;
        Some(if way == 0.0 { low } else { low.mixed(&in_row(&rows[right])?, way) })
    }

    /// At a mouth pressure; `None` if the note does not sound there.
    pub fn at_gamma(&self, zeta: f64, opening: f64, gamma: f64) -> Option<PlayedSpectrum> {
        self.at(zeta, opening, |row| {
            let right =
                row.partition_point(|point| point.gamma < gamma).min(row.len().checked_sub(1)?).max(1);
            let (below, above) = (row.get(right - 1)?, row.get(right)?);
            let way = (gamma - below.gamma) / (above.gamma - below.gamma);
            (way > -0.5).then(|| below.mixed(above, way.clamp(0.0, 1.0)))
        })
    }

    /// At a level with presence, on the way up; below the softest point the harmonics fall as near a threshold, the n-th n times as fast.
    pub fn at_level(&self, zeta: f64, opening: f64, level_db: f64, gains: &Gains) -> Option<PlayedSpectrum> {
        self.at(zeta, opening, |row| {
            let softest = row.first()?;
            let fall = level_db - softest.level_db(gains);
            if fall < 0.0 {
                let fallen = |h: usize| softest.spectrum.harmonics_db[h] + fall * (h + 1) as f64;
                return Some(PlayedSpectrum { harmonics_db: std::array::from_fn(fallen) });
            }
            let levels = row.iter().map(|point| (point.level_db(gains), point));
            let (mut below, mut loudest) = (None, (f64::NEG_INFINITY, softest));
            for (level, point) in levels {
                if level >= level_db {
                    let Some((lower, below)): Option<(f64, &Point)> = below else {
                        return Some(point.spectrum);
                    };
                    return Some(below.mixed(point, (level_db - lower) / (level - lower)));
                }
                below = Some((level, point));
                if level > loudest.0 {
                    loudest = (level, point);
                }
            }
            (level_db < loudest.0 + OVER_DB).then_some(loudest.1.spectrum)
        })
    }
}
