//! One note on a grid of opening, flow strength and mouth pressure, and what lies between the points.
//!
//! The opening belongs to the grid because not everything goes with the closing pressure: jets in the open holes take more from a loud note,
//! and the knee of the lay is a smaller share of a wider opening.

use chalumeau_core::analysis::{pitch, spectrum};
use chalumeau_core::instrument::held_note::{HeldNote, Start};
use chalumeau_core::instrument::player::dynamics::{LipShape, PlayerModel};
use chalumeau_core::instrument::{Listening, Model};
use chalumeau_core::reed::ReedLaw;
use chalumeau_core::reed::physical::ZETA_REFERENCE;
use chalumeau_core::units::{SoundingNote, cents};

/// Harmonics of a spectrum.
pub const HARMONICS: usize = 12;
/// Flow strengths of the grid.
const ZETAS: [f64; 6] = [0.14, 0.2, 0.28, 0.38, 0.5, 0.66];
/// Openings of the grid over the rest opening of the reed: of a lip at mezzo-forte and at fortissimo; with the lowest mouth pressure that
/// is played with each.
const OPENINGS: [(f64, f64); 2] = [(0.87, 0.0), (1.63, 0.5)];
/// Time until a note is steady, and time that it is heard, s.
const HEARD_S: (f64, f64) = (1.0, 1.3);
/// A note further off than this is another one, cents.
const OTHER_CENTS: f64 = 150.0;
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
    /// Level of the radiated pressure, dB re 1 Pa at the reference closing pressure, as all levels here.
    pub level_db: f64,
    /// Levels of harmonics 1.., dB.
    pub harmonics_db: [f64; HARMONICS],
}

/// One note on the grid.
pub struct NoteSpectra {
    /// Sounding note, MIDI.
    pub midi: u8,
    /// Fundamental in equal temperament, Hz.
    pub f0_hz: f64,
    /// Place over the lowest note, as the player's rule has it.
    pub place: f64,
    /// For each of [`OPENINGS`] and [`ZETAS`]: mouth pressures at which the note sounds, rising, and its spectrum.
    rows: Vec<Vec<Vec<(f64, PlayedSpectrum)>>>,
}

impl PlayedSpectrum {
    fn mixed(&self, other: &Self, way: f64) -> Self {
        let mix = |a: f64, b: f64| a + way * (b - a);
        let harmonics_db = std::array::from_fn(|h| mix(self.harmonics_db[h], other.harmonics_db[h]));
        Self { level_db: mix(self.level_db, other.level_db), harmonics_db }
    }

    /// Power-weighted mean frequency of the harmonics, Hz.
    pub fn centroid_hz(&self, f0_hz: f64) -> f64 {
        let powers = self.harmonics_db.iter().map(|level| 10.0_f64.powf(0.1 * level));
        let (sum, moment) = powers.zip(1..).fold((0.0, 0.0), |(sum, moment), (power, h)| {
            (sum + power, moment + power * f64::from(h) * f0_hz)
        });
        moment / sum
    }

    fn hear(model: &Model, held: &HeldNote, opening: f64, wanted_hz: f64) -> Option<Self> {
        let rate_hz = model.coeffs.rate_hz;
        let sound = held.radiated(model, HEARD_S.0, HEARD_S.1);
        let hz = pitch::fundamental_hz(&sound, rate_hz)?;
        let is_own =
            cents(hz, wanted_hz).abs() < OTHER_CENTS && pitch::periodicity(&sound, rate_hz, hz) > 0.98;
        let relative = spectrum::harmonic_levels_db(&sound, rate_hz, hz);
        if !is_own || relative.len() < HARMONICS {
            return None;
        }
        let level_db = spectrum::rms_dbfs(&sound) - 20.0 * opening.log10();
        // The levels are relative to the strongest: their powers add up to that of the whole.
        let sum: f64 = relative.iter().map(|level| 10.0_f64.powf(0.1 * level)).sum();
        let strongest_db = level_db - 10.0 * sum.log10();
        let harmonics_db = std::array::from_fn(|h| relative[h] + strongest_db);
        (level_db > -60.0).then_some(Self { level_db, harmonics_db })
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
                let new = HeldNote::new(model, fingering, gamma);
                let held = HeldNote {
                    law: lip.law(ReedLaw::default()),
                    zeta: ZETA_REFERENCE * lip.channel,
                    lay: new.lay * lip.knee,
                    start: Start::Tongued(2.0),
                    listening: Listening::default(),
                    ..new
                };
                Some((gamma, PlayedSpectrum::hear(model, &held, opening, f0_hz)?))
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
        in_row: impl Fn(&[(f64, PlayedSpectrum)]) -> Option<PlayedSpectrum>,
    ) -> Option<PlayedSpectrum> {
        let [(narrow, _), (wide, _)] = OPENINGS;
        let way = ((opening / narrow).ln() / (wide / narrow).ln()).clamp(0.0, 1.0);
        let narrow = || Self::in_layer(self.rows.first()?, zeta, &in_row);
        let wide = || Self::in_layer(self.rows.last()?, zeta, &in_row);
        match way {
            0.0 => narrow(),
            1.0 => wide(),
            way => Some(narrow()?.mixed(&wide()?, way)),
        }
    }

    /// At a flow strength, by lines in its logarithm between two rows.
    fn in_layer(
        rows: &[Vec<(f64, PlayedSpectrum)>],
        zeta: f64,
        in_row: impl Fn(&[(f64, PlayedSpectrum)]) -> Option<PlayedSpectrum>,
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
            let right = row.partition_point(|(at, _)| *at < gamma).min(row.len().checked_sub(1)?).max(1);
            let ((low, below), (high, above)) = (row.get(right - 1)?, row.get(right)?);
            let way = (gamma - low) / (high - low);
            (way > -0.5).then(|| below.mixed(above, way.clamp(0.0, 1.0)))
        })
    }

    /// At a level, on the way up; below the softest point the harmonics fall as near a threshold, the n-th n times as fast.
    pub fn at_level(&self, zeta: f64, opening: f64, level_db: f64) -> Option<PlayedSpectrum> {
        self.at(zeta, opening, |row| {
            let (_, softest) = row.first()?;
            if level_db < softest.level_db {
                let fall = level_db - softest.level_db;
                let harmonics_db = std::array::from_fn(|h| softest.harmonics_db[h] + fall * (h + 1) as f64);
                return Some(PlayedSpectrum { level_db, harmonics_db });
            }
            let right = row.iter().position(|(_, point)| point.level_db >= level_db);
            let Some(right) = right else {
                let (_, last) = row.iter().max_by(|a, b| a.1.level_db.total_cmp(&b.1.level_db))?;
                return (level_db < last.level_db + OVER_DB).then_some(*last);
            };
            let ((_, below), (_, above)) = (row[right.max(1) - 1], row[right.max(1)]);
            let way = (level_db - below.level_db) / (above.level_db - below.level_db);
            Some(below.mixed(&above, way.clamp(0.0, 1.0)))
        })
    }
}
