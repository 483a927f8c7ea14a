//! The standing wave: how large the sound pressure is at each place of the bore.
//!
//! The chain of elements is walked from the bell up, as [`impedance`](TransferMatrix::impedance) walks it, and looked at
//! after every element instead of at the end only. Linear, one frequency; what is below the open holes is what the
//! lattice of holes lets through.

use crate::maths;
use num_complex::Complex64;

use super::{J, Losses, Matrix, Piece, TransferMatrix, losses};
use std::f64::consts::TAU;

impl TransferMatrix {
    /// Magnitude of the pressure along the bore over that at the reed tip: pairs of the place, m from the tip, and the
    /// magnitude, from the tip down. `f_hz` is taken into 0.1 Hz..100 kHz; `open[hole]` as the file orders them, missing
    /// ones closed. Some 0.1 ms for each distinct radius. Allocates.
    pub fn standing_pressure(&self, f_hz: f64, open: &[bool]) -> Vec<(f64, f64)> {
        let f_hz = if f_hz > 0.1 { f_hz.min(1e5) } else { 0.1 };
        let omega = TAU * f_hz;
        let at = self.keep(f_hz);
        let losses: Vec<Losses> =
            self.radii_m.iter().map(|&radius_m| losses(omega, radius_m, &self.air)).collect();
        let (mut pressure, mut flow) = (at.bell, Complex64::ONE);
        let mut above_bell_m = 0.0;
        let mut found = vec![(above_bell_m, maths::complex::norm(pressure))];
        for span in (0..self.spans.len()).rev() {
            let series = |hole: Option<usize>| {
                let mass = hole.and_then(|hole| self.holes.get(hole)).map_or(0.0, |hole| hole.series_mass);
                Matrix::series(J * omega * mass)
            };
            (pressure, flow) = series(Some(span)).apply(pressure, flow);
            for piece in self.spans[span].iter().rev() {
                let (matrix, length_m) = match *piece {
                    Piece::Cylinder { radius, length_m } => (losses[radius].cylinder(length_m), length_m),
                    Piece::Step { mass } => (Matrix::series(J * omega * mass), 0.0),
                };
                (pressure, flow) = matrix.apply(pressure, flow);
                above_bell_m += length_m;
                found.push((above_bell_m, maths::complex::norm(pressure)));
            }
            if let Some(hole) = span.checked_sub(1) {
                (pressure, flow) = series(Some(hole)).apply(pressure, flow);
                let is_open = open.get(hole).copied().unwrap_or(false);
                flow += pressure * at.shunts[hole][usize::from(is_open)];
            }
        }
        let tip = maths::complex::norm(pressure).max(f64::MIN_POSITIVE);
        found.iter().rev().map(|&(up_m, magnitude)| (above_bell_m - up_m, magnitude / tip)).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::bore::instrument_file::InstrumentFile;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::units::{Air, WrittenNote};

    fn matrix() -> (InstrumentFile, TransferMatrix) {
        let file = InstrumentFile::built_in();
        let matrix = TransferMatrix::new(&file, Air::default());
        (file, matrix)
    }

    #[test]
    fn the_lowest_note_has_one_belly_and_its_twelfth_has_a_node() {
        let (file, matrix) = matrix();
        for (midi, nodes) in [(52, 0), (71, 1)] {
            let fingering = file.fingering(WrittenNote(midi)).unwrap();
            let near_hz = 440.0 * ((f64::from(midi) - 2.0 - 69.0) / 12.0).exp2();
            let (f_hz, _) = matrix.playing_frequency(&fingering.open, file.reed_volume_m3, near_hz).unwrap();
            let wave = matrix.standing_pressure(f_hz, &fingering.open);
            assert!(wave.iter().all(|&(x_m, _)| (-1e-9..=file.length_m() + 1e-9).contains(&x_m)));
            assert!(wave[0].0.abs() < 1e-12 && (wave[0].1 - 1.0).abs() < 1e-12);
            // Minima well inside the bore, away from the open end.
            let inside: Vec<_> = wave.iter().filter(|&&(x_m, _)| x_m < 0.8 * file.length_m()).collect();
            let minima =
                inside.windows(3).filter(|w| w[1].1 < w[0].1 && w[1].1 < w[2].1 && w[1].1 < 0.3).count();
            assert_eq!(minima, nodes, "{midi}");
            assert!(wave.last().unwrap().1 < 0.3, "{midi}: little pressure at the bell");
        }
    }

    #[test]
    fn open_holes_keep_the_sound_from_the_bell() {
        let (file, matrix) = matrix();
        let fingering = file.fingering(WrittenNote(67)).unwrap();
        let bell = |open: &[bool]| matrix.standing_pressure(300.0, open).last().unwrap().1;
        let closed = vec![false; file.holes.len()];
        assert!(bell(&fingering.open) < 0.3 * bell(&closed));
    }
}
