//! Without breath everything dies away: the energy of bore and reed together falls from one control tick to the next.
//!
//! It does so by construction (`reed::motion` and the lattice), so it must hold for everything that the product can be set
//! to, from any state: every bundled instrument at every rate, in single and double precision; every note's fingering and
//! lip, also under the lip of another note; every setting, or a reed as its maker measures it; any volume of air that an
//! instrument file may give the reed; any delay; fingers that rest or move for ever.

use std::sync::LazyLock;

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::lattice::Real;
use chalumeau_core::bore::sound_sources::SoundSources;
use chalumeau_core::instrument::internal_rate::INTERNAL_RATES_HZ;
use chalumeau_core::instrument::lip::embouchure;
use chalumeau_core::instrument::prepare::Preparation;
use chalumeau_core::instrument::voice::{Drive, TICK, Voice};
use chalumeau_core::instrument::{Model, Quality, Settings, Wanted};
use chalumeau_core::reed::{MovingReed, PhysicalReed, ReedCoeffs, ReedTables};

use super::{Random, any_settings, cases, parallel, random_of};

/// Time over which the fall of the energy is measured, s.
const WINDOW_S: f64 = 0.05;
/// Windows that a start is followed for.
const WINDOWS: usize = 6;
/// What may be left at the end. 20,000 starts left 0.041 at most: a steady flow through open holes and back through the
/// bore, which is not heard and which only friction ends.
const LEFT: f64 = 0.05;
/// Volumes of air that an instrument file may give the reed, mm3; 0 is allowed as well.
const REED_VOLUMES_MM3: (f64, f64) = (20.0, 20_000.0);

/// Every bundled instrument, live and in high quality, at both families of rates.
static MODELS: LazyLock<Vec<Model>> = LazyLock::new(|| {
    let mut models = Vec::new();
    for instrument in Bundled::ALL {
        for quality in [Quality::Live, Quality::High] {
            for rate_hz in INTERNAL_RATES_HZ {
                let wanted = Wanted { quality, ..Wanted::new(instrument.file(), rate_hz) };
                models.push(Preparation::new(&wanted, None).ready().unwrap().expect("bundled"));
            }
        }
    }
    models
});

impl Random {
    fn wide(&mut self, low: f64, high: f64) -> f64 {
        f64::from(self.between(low as f32, high as f32))
    }

    /// Equally likely in each octave.
    fn octaves(&mut self, low: f64, high: f64) -> f64 {
        self.wide(low.ln(), high.ln()).exp()
    }
}

/// A reed as its maker measures it: softer and stiffer, smaller and larger than the settings take.
fn any_makers_reed(random: &mut Random) -> PhysicalReed {
    let reference = PhysicalReed::reference();
    PhysicalReed {
        width_m: reference.width_m * random.octaves(0.1, 4.0),
        area_m2: reference.area_m2 * random.octaves(0.3, 3.0),
        stiffness_n_m: reference.stiffness_n_m * random.octaves(0.1, 10.0),
        tip_opening_m: reference.tip_opening_m * random.octaves(0.3, 3.0),
    }
}

/// The reed under the lip of any note of the instrument, tuned to any A4.
fn any_reed(random: &mut Random, settings: &Settings, model: &Model, fingering: usize) -> MovingReed {
    let lip_of = if random.below(2) == 0 { fingering } else { random.below(model.notes_hz.len()) };
    let pitch = f64::from(settings.a4_hz) / model.a4_hz;
    let lip = embouchure(pitch * model.notes_hz[lip_of], pitch * model.size_hz);
    let settings = match random.below(2) {
        0 => *settings,
        _ => settings.with_physical_reed(&any_makers_reed(random), &PhysicalReed::reference()),
    };
    let own_volume_mm3 = 1e9 * model.file.reed_volume_m3;
    let volume_mm3 = match random.below(8) {
        0 => 0.0,
        1..4 => random.octaves(REED_VOLUMES_MM3.0, REED_VOLUMES_MM3.1),
        _ => own_volume_mm3,
    };
    let settings = settings.clamped();
    MovingReed {
        law: settings.reed_law(),
        zeta: f64::from(settings.zeta),
        lay: f64::from(settings.lay),
        resonance_hz: lip.resonance_hz,
        damping: lip.damping * f64::from(settings.damping),
        swept_s: model.swept_s * volume_mm3 / own_volume_mm3,
    }
}

/// What is left of the energy.
#[derive(Clone, Copy, Default)]
struct Left {
    /// Largest change in a control tick, over the energy before: below 0 if it fell in each.
    growth: f64,
    /// Most that was left of a window's energy at its end.
    after_window: f64,
    /// What was left at the end.
    at_end: f64,
}

fn follow<F: Real>(case: usize, model: &Model, random: &mut Random) -> Left {
    let settings = any_settings(random);
    let fingering = random.below(model.file.fingerings.len());
    let reed = ReedCoeffs::new(any_reed(random, &settings, model, fingering), model.coeffs.rate_hz);
    let sources = SoundSources::of(&model.file);
    let mut voice: Voice<F> = Voice::new(&model.coeffs, sources, &model.air, ReedTables::reference(), reed);
    let holes = model.coeffs.holes();
    for (hole, &open) in model.file.fingerings[fingering].open.iter().enumerate() {
        voice.lattice_mut().set_opening(hole, f64::from(u8::from(open)));
    }
    let (low, high) = model.coeffs.tuning_range();
    voice.lattice_mut().glide_delay(random.wide(low, high), 0);
    voice.lattice_mut().set_jet_loss(f64::from(settings.vent_loss));
    // From whispers to waves that slam the reed, over the closing pressure.
    let strength = random.octaves(1e-4, 2.0);
    voice.lattice_mut().scatter(|| random.wide(-strength, strength));
    voice.reed_mut().closing = strength * random.wide(-1.0, 2.0);
    voice.reed_mut().speed = strength * random.wide(-1e4, 1e4);
    let fingers_rest = random.below(2) == 0;

    let drive = Drive { p_mouth: 0.0, tongue: 0.0, noise: 0.0, reed };
    let energy_of = |voice: &Voice<F>| {
        voice.lattice().stored_energy(&model.coeffs) + voice.reed().stored_energy(&drive.reed)
    };
    let ticks = (WINDOW_S * model.coeffs.rate_hz / TICK as f64) as usize;
    let first = energy_of(&voice);
    let mut left = Left { growth: f64::NEG_INFINITY, ..Left::default() };
    let mut before = first;
    for window in 0..WINDOWS {
        let at_start = before;
        for tick in 0..ticks {
            // Movements begin at any time, last any time, and are never ended by hand.
            if !fingers_rest && tick % 50 == 0 {
                for hole in 0..holes {
                    let samples = random.below(4_000);
                    let opening = random.wide(-0.5, 1.5);
                    voice.lattice_mut().glide_opening(hole, opening, samples);
                }
            }
            voice.tick(&drive);
            let energy = energy_of(&voice);
            left.growth = left.growth.max(energy / before - 1.0);
            before = energy;
        }
        for hole in 0..holes {
            let opening = voice.lattice().opening(hole);
            assert!((0.0..=1.0).contains(&opening), "start {case}, window {window}, hole {hole}: {opening}");
        }
        left.after_window = left.after_window.max(before / at_start);
    }
    left.at_end = before / first;
    assert_eq!(voice.resets(), 0, "start {case}");
    left
}

#[test]
fn without_breath_the_energy_falls() {
    let numbers: Vec<usize> = (0..cases(200)).collect();
    let found = parallel::each(&numbers, |&case| {
        let mut random = random_of(0x0e_ae_2b, case);
        let model = &MODELS[random.below(MODELS.len())];
        let rate_hz = model.coeffs.rate_hz;
        // Live plays in single precision, high quality in double; double precision is the proof for both.
        let single = rate_hz <= INTERNAL_RATES_HZ[0] && random.below(2) == 0;
        let left = if single {
            follow::<f32>(case, model, &mut random)
        } else {
            follow::<f64>(case, model, &mut random)
        };
        let bits = if single { 32 } else { 64 };
        let what = format!("start {case}: {}, {rate_hz} Hz, {bits} bits", model.file.name);
        assert!(left.growth < 0.0, "{what}: a control tick added {:e} of the energy", left.growth);
        assert!(left.at_end < LEFT, "{what}: {:.3} of the energy is left", left.at_end);
        (left, what)
    });
    let tell = |what: &str, get: fn(&Left) -> f64| {
        let most = found.iter().max_by(|a, b| get(&a.0).total_cmp(&get(&b.0)));
        let (left, start) = most.expect("CHALUMEAU_CASES must be 1 or more");
        println!("{what}: {:.3e} ({start})", get(left));
    };
    println!("{} starts; the most in any of them:", found.len());
    tell("change of the energy in a control tick, over the energy", |left| left.growth);
    tell("left after 50 ms, less all of it", |left| left.after_window - 1.0);
    tell("left after 300 ms", |left| left.at_end);
}
