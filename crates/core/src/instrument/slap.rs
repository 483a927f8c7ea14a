//! A tongue slap: the tongue sucks at the reed, bends it away from the mouthpiece and lets go; the reed slams on the lay.
//!
//! Two things drive the bore: the volume that the reed sweeps as it flies back, and the suction in the mouthpiece, which
//! ends when the tongue comes off. Meanwhile the tongue seals the tip, so a breath behind it is heard only afterwards.
//! Without breath the tongue follows the reed and keeps it shut, so that the bore rings with a closed end; an open reed
//! would absorb the sound within milliseconds. The model leaves out the tongue's own noise and the bounce of the reed on a
//! hard lay. Its numbers are by judgement, because no measured slap was at hand: at full strength a loud pop, no louder
//! than a loud note.

use crate::dsp::smooth::smooth;

/// How long the tongue pulls, s.
const PULL_S: f64 = 0.008;
/// Force of the strongest pull, over the closing pressure. It bends the reed away by as many rest openings.
const PULL: f64 = 1.5;
/// Suction of the strongest pull, over the closing pressure.
const SUCTION: f64 = 0.3;
/// Mouth pressure over the closing pressure from which the tongue stays away after a slap, so that the note goes on. Soft
/// notes begin above it.
pub const BREATH_GAMMA: f64 = 0.3;

/// A slap while the tongue pulls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slap {
    age_s: f64,
    strength: f64,
    /// Force of the tongue when the pull began, over the closing pressure.
    from: f64,
}

/// Effect of the pulling tongue on the reed, over its closing pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TonguePull {
    /// Force on the reed; it goes from what it was before to negative, away from the mouthpiece.
    pub force: f64,
    /// Suction at the tip, 0 or less.
    pub suction: f64,
    /// Share of the breath that the tongue keeps away from the reed, 0..=1.
    pub seal: f64,
}

impl Slap {
    /// Begins a slap of a strength in 0..=1 (more counts as 1); `None` for 0, less, or not a number. A second slap during
    /// the pull counts if it is stronger. `force` is that of the tongue so far, over the closing pressure.
    pub fn begin(strength: f32, force: f64, before: Option<Self>) -> Option<Self> {
        let strength = f64::from(strength);
        let slap = before.unwrap_or(Self { age_s: 0.0, strength: 0.0, from: force });
        (strength > 0.0).then(|| Self { strength: strength.min(1.0).max(slap.strength), ..slap })
    }

    /// Advances by a control tick; `None` when the tongue has let go.
    pub fn tick(&mut self, tick_s: f64) -> Option<TonguePull> {
        self.age_s += tick_s;
        if self.age_s >= PULL_S {
            return None;
        }
        // Slow at both ends, so that little is heard before the tongue lets go.
        let seal = smooth(self.age_s / PULL_S);
        let share = self.strength * seal;
        Some(TonguePull { force: self.from * (1.0 - seal) - PULL * share, suction: -SUCTION * share, seal })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use crate::analysis::spectrum::power_spectrum_db;
    use crate::bore::transfer_matrix::TransferMatrix;
    use crate::event::Event;
    use crate::instrument::listening::Listening;
    use crate::instrument::{Clarinet, Model, Settings};
    use crate::units::WrittenNote;

    const RATE_HZ: f64 = 48_000.0;

    static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

    /// A silent clarinet with the fingering of a note in place.
    fn fingered(written: u8) -> Clarinet {
        let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        let note = WrittenNote(written).sounding(2).unwrap();
        clarinet.apply(Event::NoteOn { note, velocity: 0.5 });
        render(&mut clarinet, 0.001);
        clarinet.apply(Event::NoteOff { note });
        render(&mut clarinet, 1.0);
        assert!(clarinet.is_silent());
        clarinet
    }

    fn render(clarinet: &mut Clarinet, seconds: f64) -> Vec<f32> {
        let mut out = vec![0.0; (seconds * RATE_HZ) as usize];
        clarinet.render(&mut out);
        out
    }

    fn slap(clarinet: &mut Clarinet, strength: f32, seconds: f64) -> Vec<f32> {
        clarinet.apply(Event::TongueSlap { strength });
        render(clarinet, seconds)
    }

    fn peak_db(samples: &[f32]) -> f32 {
        20.0 * samples.iter().fold(1e-9_f32, |peak, sample| peak.max(sample.abs())).log10()
    }

    #[test]
    fn slap_bursts_out_of_silence_and_dies_away() {
        for written in [52, 60, 67, 76, 84] {
            let mut clarinet = fingered(written);
            let out = slap(&mut clarinet, 1.0, 1.0);
            let (pulling, burst) = (peak_db(&out[..380]), peak_db(&out[380..1_440]));
            assert!((-16.0..-1.0).contains(&burst), "written {written}: {burst} dBFS");
            assert!(pulling < burst - 20.0, "written {written}: {pulling} dBFS while the tongue pulls");
            assert!(peak_db(&out[24_000..]) < -80.0, "written {written}: half a second later");
            assert!(clarinet.is_silent(), "written {written}");
        }
    }

    #[test]
    fn slap_needs_no_note_before_it() {
        let mut new = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        assert!(peak_db(&slap(&mut new, 1.0, 0.1)) > -16.0);
    }

    #[test]
    fn stronger_slaps_are_louder() {
        let levels = [0.05, 0.1, 0.2, 0.4, 0.7, 1.0].map(|s| peak_db(&slap(&mut fingered(60), s, 0.1)));
        assert!(levels.is_sorted_by(|a, b| a + 1.0 < *b), "{levels:?}");
        for nothing in [0.0, -1.0, f32::NAN] {
            assert!(peak_db(&slap(&mut fingered(60), nothing, 0.1)) < -100.0);
        }
        assert_eq!(slap(&mut fingered(60), 5.0, 0.1), slap(&mut fingered(60), 1.0, 0.1));
    }

    /// The loudest within a quarter of each of the first three resonances is that resonance, of the bore with a rigid end:
    /// the reed is shut. Heard in one point, because presence lifts what lies above the third.
    #[test]
    fn slap_rings_at_the_resonances_of_the_fingering() {
        let matrices = TransferMatrix::new(&MODEL.file, MODEL.air);
        for written in [52, 55, 58, 62] {
            let mut clarinet = fingered(written);
            clarinet.set_settings(&Settings { listening: Listening::point(), ..Settings::default() });
            let out = slap(&mut clarinet, 0.6, 0.5);
            let ringing: Vec<f64> = out[480..].iter().map(|&sample| f64::from(sample)).collect();
            let spectrum = power_spectrum_db(&[vec![0.0; ringing.len()], ringing].concat(), RATE_HZ);
            let highest = |low_hz: f64, high_hz: f64| {
                let bins = (low_hz / spectrum.bin_hz) as usize..=(high_hz / spectrum.bin_hz) as usize;
                let bin =
                    bins.max_by(|&a, &b| spectrum.level_db[a].total_cmp(&spectrum.level_db[b])).unwrap();
                bin as f64 * spectrum.bin_hz
            };
            let fingering = MODEL.file.fingering(WrittenNote(written)).unwrap();
            let peaks = matrices.peaks(&fingering.open, 0.0, 3);
            for (mode, peak) in peaks.iter().enumerate() {
                let hz = highest(0.75 * peak.f_hz, 1.25 * peak.f_hz);
                let off = hz / peak.f_hz - 1.0;
                assert!(off.abs() < 0.04, "written {written} mode {mode}: {hz} Hz, bore {} Hz", peak.f_hz);
            }
        }
    }

    #[test]
    fn note_under_breath_goes_on_after_a_slap() {
        let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        clarinet.apply(Event::NoteOn { note: WrittenNote(60).sounding(2).unwrap(), velocity: 0.5 });
        let before = peak_db(&render(&mut clarinet, 0.5)[12_000..]);
        let out = slap(&mut clarinet, 1.0, 1.0);
        let after = peak_db(&out[24_000..]);
        assert!((after - before).abs() < 1.0, "{before} dBFS before, {after} after");
    }

    #[test]
    fn key_without_breath_is_slapped_and_speaks_when_breath_comes() {
        let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        clarinet.apply(Event::Breath(0.0));
        clarinet.apply(Event::NoteOn { note: WrittenNote(60).sounding(2).unwrap(), velocity: 0.5 });
        render(&mut clarinet, 0.1);
        let out = slap(&mut clarinet, 1.0, 1.0);
        assert!(peak_db(&out[..1_440]) > -16.0 && peak_db(&out[24_000..]) < -80.0);
        clarinet.apply(Event::Breath(0.6));
        assert!(peak_db(&render(&mut clarinet, 0.5)[12_000..]) > -25.0);
    }

    #[test]
    fn slaps_stay_within_full_scale_at_every_setting() {
        for (zeta, damping, strength, lip) in
            [(0.9, 0.2, 5.0, 1.4), (0.05, 2.0, 1.5, 0.6), (0.9, 0.2, 1.5, 0.6)]
        {
            let mut clarinet = fingered(52);
            clarinet.set_settings(&Settings { zeta, damping, strength, lip, ..Settings::default() });
            for i in 0..40 {
                let out = slap(&mut clarinet, 1.0, 0.003 * f64::from(i));
                assert!(out.iter().all(|sample| sample.abs() <= 1.0), "zeta {zeta}, damping {damping}");
            }
            assert!(peak_db(&render(&mut clarinet, 1.0)[24_000..]) < -80.0);
            assert_eq!(clarinet.resets(), 0);
        }
    }
}
