//! The sounds of keys and fingers: the air that they move at their holes, which the bore answers with a pop.
//!
//! A pad or finger that comes down pushes air into its hole, one that rises draws air out. Most of what
//! lies between it and the rim goes aside, a little through the hole. As it lands its cushion gives way, and that little more is pushed in at once. The flows enter at the
//! chimneys of the holes, so that the bore rings with them, with and without breath. How far and how fast a pad moves is what
//! the lattice does with its hole, whoever moves it.
//!
//! Left out: what the key's own metal radiates.

use std::f64::consts::PI;

use crate::bore::lattice::{Lattice, LatticeCoeffs, Real};
use crate::maths;

/// Way of a pad over the radius of its hole: 2 to 3 mm, as repairers set it.
const LIFT: f64 = 0.6;
/// Share of the moved air that goes through the hole; the rest goes aside. By level: the loudest slur is 37 dB below a mezzo-forte.
const THROUGH: f64 = 0.05;
/// How far the cushion gives way as it lands, over the radius of the hole: 0.01 mm (by level, as above).
const CUSHION: f64 = 0.0025;
/// A pad does not start or stop at once: time constants of two lags, s. Together a felt cushion's contact of a millisecond (by
/// judgement).
const SOFT_S: f64 = 0.3e-3;
/// Flows below this share of a unit have ended: -120 dB of a played note's.
const NOTHING: f64 = 1e-9;

/// Pads and fingers of one instrument. Flows are over those of the lattice.
pub(super) struct Pads {
    /// 0..=1; 0 for none.
    amount: f64,
    holes: Box<[Pad]>,
    /// Share of the way that a lag goes in a sample.
    share: f64,
    /// Pads move, or their flows have not ended.
    busy: bool,
}

#[derive(Clone, Copy, Default)]
struct Pad {
    /// Flow for a way of its whole lift in one sample, and that of its cushion.
    stroke: f64,
    cushion: f64,
    /// Opening of the hole in the sample before.
    opening: f64,
    /// Flow into the hole behind the first and the second lag.
    flow: [f64; 2],
}

impl Pads {
    /// Silent ones for a lattice; `flow_unit` is its unit of flow, m3/s. Allocates.
    pub fn new(coeffs: &LatticeCoeffs, flow_unit: f64) -> Self {
        let pads = coeffs.hole_areas_m2().map(|area_m2| {
            let flow = area_m2 * (area_m2 / PI).sqrt() * coeffs.rate_hz / flow_unit;
            Pad { stroke: THROUGH * LIFT * flow, cushion: CUSHION * flow, ..Pad::default() }
        });
        Self {
            amount: 0.0,
            holes: pads.collect(),
            share: 1.0 - maths::exp(-1.0 / (SOFT_S * coeffs.rate_hz)),
            busy: false,
        }
    }

    /// How much is heard of them, 0..=1. Real-time safe.
    pub fn set_amount(&mut self, amount: f64) {
        self.amount = amount;
        if amount == 0.0 && self.busy {
            self.silence();
        }
    }

    /// Ends all flows. Real-time safe.
    pub fn silence(&mut self) {
        self.busy = false;
        self.holes.iter_mut().for_each(|pad| pad.flow = [0.0; 2]);
    }

    /// Whether [`step`](Self::step) must be called before each sample of this tick. Real-time safe.
    #[inline(always)]
    pub fn attend<F: Real>(&mut self, lattice: &Lattice<F>) -> bool {
        if self.amount != 0.0 {
            self.look(lattice);
        }
        self.busy
    }

    #[inline(never)]
    fn look<F: Real>(&mut self, lattice: &Lattice<F>) {
        let moves = lattice.is_moving() && (0..self.holes.len()).any(|hole| lattice.is_gliding(hole));
        if moves && !self.busy {
            for (hole, pad) in self.holes.iter_mut().enumerate() {
                pad.opening = lattice.opening(hole);
            }
        }
        self.busy = moves || self.holes.iter().any(|pad| pad.flow.iter().any(|flow| flow.abs() > NOTHING));
        if !self.busy {
            self.silence();
        }
    }

    /// The flows of the next sample. Real-time safe.
    pub fn step<F: Real>(&mut self, lattice: &mut Lattice<F>) {
        for (hole, pad) in self.holes.iter_mut().enumerate() {
            let opening = lattice.opening(hole);
            let closed = pad.opening - opening;
            let landed = opening == 0.0 && closed > 0.0;
            let moved = self.amount * (pad.stroke * closed + if landed { pad.cushion } else { 0.0 });
            pad.opening = opening;
            let [first, second] = &mut pad.flow;
            let before = *second;
            *first += (moved - *first) * self.share;
            *second += (*first - *second) * self.share;
            if *second != 0.0 {
                lattice.push(hole, 0.5 * (before + *second));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use crate::event::Event;
    use crate::instrument::{Articulation, Clarinet, Model, Settings};
    use crate::units::{SoundingNote, WrittenNote};

    const RATE_HZ: f64 = 48_000.0;
    static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

    fn sounding(written: u8) -> SoundingNote {
        WrittenNote(written).sounding(2).unwrap()
    }

    fn render(clarinet: &mut Clarinet, seconds: f64) -> Vec<f64> {
        let mut out = vec![0.0; (seconds * RATE_HZ) as usize];
        clarinet.render(&mut out);
        out.into_iter().map(f64::from).collect()
    }

    fn peak_db(samples: &[f64]) -> f64 {
        20.0 * samples.iter().fold(1e-9_f64, |peak, x| peak.max(x.abs())).log10()
    }

    /// A clarinet without breath whose fingers are on a note.
    fn fingered(key_sounds: f32, written: u8, plain: bool) -> Clarinet {
        let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        if plain {
            clarinet = clarinet.without_avx2();
        }
        let articulation = Articulation { key_sounds, ..Articulation::default() };
        clarinet.set_settings(&Settings { articulation, ..Settings::default() });
        clarinet.reset();
        clarinet.apply(Event::Breath(0.0));
        clarinet.apply(Event::NoteOn { note: sounding(written), velocity: 0.5 });
        render(&mut clarinet, 1.0);
        clarinet
    }

    /// What moving the fingers sounds like, for 0.5 s from the event on.
    fn moved(clarinet: &mut Clarinet, written: u8) -> Vec<f64> {
        assert!(clarinet.is_silent());
        clarinet.apply(Event::NoteOn { note: sounding(written), velocity: 0.5 });
        render(clarinet, 0.5)
    }

    fn mezzo_forte_db(written: u8) -> f64 {
        let mut clarinet = Clarinet::new(Arc::clone(&MODEL), RATE_HZ);
        clarinet.set_settings(&Settings { life: 0.0, ..Settings::default() });
        clarinet.apply(Event::Breath(0.5));
        clarinet.apply(Event::NoteOn { note: sounding(written), velocity: 0.5 });
        peak_db(&render(&mut clarinet, 1.0)[24_000..])
    }

    #[test]
    fn fingers_are_heard_without_breath_well_below_a_note() {
        let slurs = [
            (52, 64),
            (64, 52),
            (60, 67),
            (67, 60),
            (69, 71),
            (71, 69),
            (76, 84),
            (84, 76),
            (65, 64),
            (52, 84),
        ];
        let measured = slurs.map(|(from, to)| {
            // A lip that moves with the fingers is heard as well, very softly.
            let [none, half, full] = [0.0, 0.5, 1.0].map(|amount| moved(&mut fingered(amount, from, false), to));
            let air = |with: &[f64]| -> Vec<f64> { with.iter().zip(&none).map(|(a, b)| a - b).collect() };
            let (air, half) = (air(&full), peak_db(&air(&half)[..1_440]));
            // The fingers take 8 ms; the output filter 1 ms.
            let (early, pop, late) = (peak_db(&air[..24]), peak_db(&air[..1_440]), peak_db(&air[19_200..]));
            let below = peak_db(&full[..1_440]) - mezzo_forte_db(to);
            println!(
                "{from} to {to}: {pop:.1} dBFS, {below:.1} dB re mf, half {half:.1}, none {:.1}, before {early:.1}, \
                 later {late:.1}",
                peak_db(&none)
            );
            (below, pop, half, early, late)
        });
        for (below, pop, half, early, late) in measured {
            assert!((-60.0..=-35.0).contains(&below), "{below} dB re mf");
            // Less than in proportion: strong flows lose more in jets.
            assert!((3.0..6.1).contains(&(pop - half)), "{pop}, {half}");
            assert!(early < pop - 20.0 && late < pop - 40.0, "{early}, {pop}, {late} dBFS");
        }
    }

    #[test]
    fn closing_a_hole_is_louder_than_opening_it() {
        let [down, up] =
            [(65, 64), (64, 65)].map(|(from, to)| peak_db(&moved(&mut fingered(1.0, from, false), to)));
        assert!(down > up + 1.0, "{down} {up}");
    }

    #[test]
    fn with_and_without_avx2_they_are_the_same() {
        let [vector, plain] = [false, true].map(|plain| moved(&mut fingered(1.0, 67, plain), 60));
        assert_eq!(vector, plain);
    }
}
