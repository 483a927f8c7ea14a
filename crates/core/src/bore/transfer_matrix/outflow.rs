//! What leaves the bore: the flow out of the bell and out of each open hole.

use num_complex::Complex64;

use super::TransferMatrix;

impl TransferMatrix {
    /// Flows out of each hole, as the file orders them, and last out of the bell, into `flows`, for a flow of 1 into the bore
    /// at the tip, at `f_hz`, 0.1 Hz..100 kHz. `open[hole]` as the file orders them, missing ones closed. A hole's flow is
    /// the one outside its chimney. `flows` has a place for each hole and one for the bell; more stay as they are.
    pub fn outflows(&self, f_hz: f64, open: &[bool], flows: &mut [Complex64]) {
        let at = self.keep(f_hz);
        let (mut pressure, mut flow) = (at.bell, Complex64::ONE);
        for hole in (0..at.shunts.len()).rev() {
            (pressure, flow) = at.spans[hole + 1].apply(pressure, flow);
            let is_open = open.get(hole).copied().unwrap_or(false);
            let into = pressure * at.shunts[hole][usize::from(is_open)];
            if let Some(out) = flows.get_mut(hole) {
                *out = if is_open { into * at.chimneys[hole] } else { Complex64::ZERO };
            }
            flow += into;
        }
        if let Some(out) = flows.get_mut(at.shunts.len()) {
            *out = Complex64::ONE;
        }
        (_, flow) = at.spans[0].apply(pressure, flow);
        flows.iter_mut().take(at.shunts.len() + 1).for_each(|out| *out /= flow);
    }
}

#[cfg(test)]
mod tests {
    use crate::bore::instrument_file::InstrumentFile;
    use crate::bore::radiation;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::units::{Air, WrittenNote};
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    /// In air that takes nothing at the walls, all the power that goes in comes out; in real air less does.
    #[test]
    fn the_power_that_enters_leaves_by_the_sources() {
        let file = InstrumentFile::built_in();
        let real = Air::default();
        let thin = Air { mu: 1e-9 * real.mu, kappa: 1e-9 * real.kappa, ..real };
        let mut flows = vec![Complex64::ZERO; file.holes.len() + 1];
        let mut share = |air: Air, midi: u8, f_hz: f64| {
            let matrix = TransferMatrix::new(&file, air);
            let open = &file.fingering(WrittenNote(midi)).unwrap().open;
            matrix.outflows(f_hz, open, &mut flows);
            let radii = file.holes.iter().map(|hole| hole.radius_m);
            let radii = radii.chain(file.bore.last().map(|segment| segment.r_end_m));
            let resistance = |radius_m: f64| radiation::impedance(TAU * f_hz, radius_m, &air).re;
            let out: f64 =
                flows.iter().zip(radii).map(|(flow, radius_m)| flow.norm_sqr() * resistance(radius_m)).sum();
            out / (matrix.impedance(f_hz, open, 0.0).re * air.z_c(file.nominal_radius_m))
        };
        for midi in [52, 60, 67, 79] {
            for f_hz in [900.0, 1_500.0, 2_500.0, 5_000.0] {
                let all = share(thin, midi, f_hz);
                assert!((all - 1.0).abs() < 0.02, "{midi} at {f_hz} Hz: {all}");
                let most = share(real, midi, f_hz);
                assert!((0.0..1.0).contains(&most), "{midi} at {f_hz} Hz: {most}");
            }
        }
    }

    /// Where all is short against the wave, what flows in flows out.
    #[test]
    fn slow_flows_are_conserved() {
        let file = InstrumentFile::built_in();
        let matrix = TransferMatrix::new(&file, Air::default());
        let mut flows = vec![Complex64::ZERO; file.holes.len() + 1];
        matrix.outflows(2.0, &file.fingering(WrittenNote(67)).unwrap().open, &mut flows);
        let sum: Complex64 = flows.iter().sum();
        assert!((sum - 1.0).norm() < 1e-3, "{sum}");
    }
}
