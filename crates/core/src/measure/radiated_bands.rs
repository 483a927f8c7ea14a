//! Ways of listening against the power average, in third octaves.
//!
//! The transfer matrices give the flows out of all holes and the bell for a flow of 1 at the tip, at [`LINES`] frequencies
//! a band. Each way of listening adds them up as it does when it plays; the levels of a band are means of squares over its
//! frequencies. What this leaves out: the reed, jets in the holes, and that a note has only its harmonics.

use num_complex::Complex64;

use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::bore::sound_sources::SoundSources;
use crate::bore::transfer_matrix::TransferMatrix;
use crate::instrument::listening::Paths;
use crate::maths;
use crate::units::Air;

/// Bands, as third octaves from 1 kHz: 100 Hz to 10 kHz.
const BANDS: std::ops::RangeInclusive<i32> = -10..=10;
/// Frequencies in each band.
pub const LINES: u32 = 12;
/// Highest centre that [`rms_and_worst`] counts, Hz: above it recordings of clarinets are breath and little else.
pub const COUNTED_HZ: f64 = 6_500.0;

/// One third octave of one fingering. Decibels are over what one point would give that sends out all flows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiatedBand {
    /// Centre, Hz.
    pub centre_hz: f64,
    /// The power average over all directions, dB.
    pub average_db: f64,
    /// What is heard along the paths, dB.
    pub heard_db: f64,
}

/// Compares what is heard along paths with the average.
pub struct RadiatedBands<'a> {
    matrix: TransferMatrix,
    file: &'a InstrumentFile,
    sources: SoundSources,
    air: Air,
}

impl<'a> RadiatedBands<'a> {
    /// Of an instrument. Allocates.
    pub fn new(file: &'a InstrumentFile, air: Air) -> Self {
        Self { matrix: TransferMatrix::new(file, air), file, sources: SoundSources::of(file), air }
    }

    /// The sources.
    pub fn sources(&self) -> &SoundSources {
        &self.sources
    }

    /// The bands of one fingering, from that of its note up, heard along `paths`: each way of listening has one or two, and
    /// of two the mean power counts. Allocates.
    pub fn of(&self, fingering: &Fingering, paths: &[Paths]) -> Vec<RadiatedBand> {
        let lowest_hz = self.lowest_hz(fingering);
        let centres = BANDS.map(|band| 1_000.0 * maths::exp2(f64::from(band) / 3.0));
        centres
            .filter(|centre_hz| centre_hz * maths::exp2(1.0_f64 / 6.0) > lowest_hz)
            .map(|centre_hz| {
                let part = |line: u32| (f64::from(line) + 0.5) / f64::from(LINES) - 0.5;
                let at_hz = (0..LINES).map(|line| centre_hz * maths::exp2(part(line) / 3.0));
                self.levels(fingering, centre_hz, at_hz, paths)
            })
            .collect()
    }

    /// As [`of`](Self::of), at each harmonic of the note up to [`COUNTED_HZ`] instead. Allocates.
    pub fn harmonics(&self, fingering: &Fingering, paths: &[Paths]) -> Vec<RadiatedBand> {
        let lowest_hz = self.lowest_hz(fingering);
        let harmonics = (1..).map(|n: u32| f64::from(n) * lowest_hz).take_while(|&f_hz| f_hz < COUNTED_HZ);
        harmonics.map(|f_hz| self.levels(fingering, f_hz, [f_hz], paths)).collect()
    }

    /// Pitch of a fingering's note at A4 = 440 Hz, Hz.
    fn lowest_hz(&self, fingering: &Fingering) -> f64 {
        self.file.sounding(fingering.written).frequency_hz(440.0)
    }

    fn levels(
        &self,
        fingering: &Fingering,
        centre_hz: f64,
        at_hz: impl IntoIterator<Item = f64>,
        paths: &[Paths],
    ) -> RadiatedBand {
        let mut flows = vec![Complex64::ZERO; self.sources.places_m.len()];
        let (mut point, mut average, mut heard) = (0.0, 0.0, 0.0);
        for f_hz in at_hz {
            self.matrix.outflows(f_hz, &fingering.open, &mut flows);
            point += flows.iter().sum::<Complex64>().norm_sqr();
            average += self.sources.power_average(f_hz, &flows, &self.air);
            let powers: f64 = paths.iter().map(|paths| paths.heard(f_hz, &flows).norm_sqr()).sum();
            heard += powers / paths.len() as f64;
        }
        let over_point = |power: f64| 10.0 * maths::log10(power / point);
        RadiatedBand { centre_hz, average_db: over_point(average), heard_db: over_point(heard) }
    }
}

/// Root mean square and largest magnitude of what differs from the average, dB, over the bands up to [`COUNTED_HZ`]: of
/// `heard_db`, or of the point.
pub fn rms_and_worst<'a>(
    bands: impl IntoIterator<Item = &'a RadiatedBand>,
    of: impl Fn(&RadiatedBand) -> f64,
) -> (f64, f64) {
    let off = |band: &RadiatedBand| of(band) - band.average_db;
    let counted = bands.into_iter().filter(|band| band.centre_hz < COUNTED_HZ);
    let (count, squares, worst) = counted.map(off).fold((0, 0.0, 0.0_f64), |(count, squares, worst), off| {
        (count + 1, squares + off * off, worst.max(off.abs()))
    });
    ((squares / f64::from(count.max(1))).sqrt(), worst)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instrument::listening::{Listening, ListeningMode};

    fn all(bands: &RadiatedBands, paths: &[Paths]) -> Vec<RadiatedBand> {
        let played = bands.file.fingerings.iter().filter(|fingering| fingering.written.0 <= 92);
        played.flat_map(|fingering| bands.of(fingering, paths)).collect()
    }

    /// The figures that `docs/tone.md` gives, for the 41 fingerings from E3 to G#6.
    #[test]
    fn everywhere_comes_closer_to_the_power_average_than_a_point_or_a_place() {
        let file = InstrumentFile::built_in();
        let bands = RadiatedBands::new(&file, Air::default());
        let everywhere = all(&bands, &[Listening::everywhere(bands.sources(), &Air::default())]);
        let (rms_db, worst_db) = rms_and_worst(&everywhere, |band| band.heard_db);
        let (point_db, point_worst_db) = rms_and_worst(&everywhere, |_| 0.0);
        println!(
            "everywhere {rms_db:.2} dB, at most {worst_db:.1}; point {point_db:.2}, {point_worst_db:.1}"
        );
        assert!(rms_db < 1.25 && worst_db < 5.2, "{rms_db} {worst_db}");
        assert!(point_db > 2.0 * rms_db, "{point_db}");
        for angle_deg in [0.0, 30.0, 60.0, 90.0, 180.0] {
            let here = Listening { mode: ListeningMode::Position, angle_deg, ..Listening::default() };
            let place = all(&bands, &[here.position(0.0, bands.sources(), &Air::default())]);
            let (place_db, place_worst_db) = rms_and_worst(&place, |band| band.heard_db);
            println!("at {angle_deg} degrees: {place_db:.2} dB, at most {place_worst_db:.1}");
            assert!(place_db > rms_db, "{angle_deg}: {place_db}");
        }
    }

    /// Above the cut-off the flows of one fingering go against each other: the point loses what the directions still hear.
    #[test]
    fn a_point_is_too_soft_above_the_cut_off() {
        let file = InstrumentFile::built_in();
        let bands = RadiatedBands::new(&file, Air::default());
        let paths = [Listening::everywhere(bands.sources(), &Air::default())];
        let missing = |register: &str, low_hz: f64, high_hz: f64| {
            let all: Vec<f64> = (file.fingerings.iter())
                .filter(|fingering| fingering.register == register)
                .flat_map(|fingering| bands.of(fingering, &paths))
                .filter(|band| (low_hz..high_hz).contains(&band.centre_hz))
                .map(|band| band.average_db)
                .collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let chalumeau_db = missing("chalumeau", 1_200.0, 2_000.0);
        println!("chalumeau, 1.26 to 2 kHz: a point lacks {chalumeau_db:.1} dB");
        assert!((2.0..9.0).contains(&chalumeau_db), "{chalumeau_db}");
        let low_db = missing("chalumeau", 100.0, 500.0);
        assert!(low_db.abs() < 0.3, "{low_db}");
    }
}
