//! Compares what the hand feels with what the instrument does. With `--nocapture` the tests print the figures of docs/feel.md.

#[path = "support/memoryless.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod memoryless;
#[path = "support/parallel.rs"]
mod parallel;
#[path = "support/reference.rs"]
mod reference;

use std::sync::LazyLock;

use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::torque_law;
use chalumeau_core::haptics::{
    FeelDesign, FeelRefused, FeelTable, NoteFeel, NoteOrder, NoteRequirement, PlayedReed, RequirementSolver,
    TorqueLimits,
};
use chalumeau_core::instrument::feel_inputs::{played_reed, requirements};
use chalumeau_core::instrument::trial_note::TrialNote;
use chalumeau_core::instrument::voice::{Drive, TICK, Voice};
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::reed::physical::P_REF_PA;
use chalumeau_core::reed::{MovingReed, ReedCoeffs, ReedTables};
use chalumeau_core::units::{Air, WrittenNote};
use chalumeau_knob::wire::message::TorqueLaw;
use parallel::each;

static MODEL: LazyLock<Model> = LazyLock::new(|| Model::built_in(48_000.0).unwrap());
static BORE: LazyLock<RequirementSolver> = LazyLock::new(|| requirements(&MODEL));

/// The same exaggeration of torques and of places.
fn design(law: TorqueLaw, exponent: f64) -> FeelDesign {
    FeelDesign { law, contrast: exponent, place: exponent, ..FeelDesign::default() }
}

fn table(design: &FeelDesign, settings: &Settings) -> Result<FeelTable, FeelRefused> {
    FeelTable::new(&BORE, design, &played_reed(&MODEL.file, MODEL.a4_hz, settings), &TorqueLimits::default())
}

fn written(fingering: usize) -> u8 {
    MODEL.file.fingerings[fingering].written.0
}

#[test]
fn physical_feel_is_the_reference_table() {
    let expected = reference::by_written("thresholds_tuned.csv", "gamma_th_zeta0.3");
    let mut worst = 0.0_f64;
    for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
        let table = table(&design(law, 1.0), &Settings::default()).unwrap();
        let standard = table.reference();
        assert_eq!((table.notes().len(), standard.written), (46, WrittenNote(72)));
        // The reference was computed for the maker's chart.
        let known = MODEL.file.fingerings.iter().map(|fingering| fingering.maker_open.is_none());
        for note in table.notes().iter().zip(known).filter(|(_, known)| *known).map(|(note, _)| note) {
            let (asked, expected) = (note.requirement.unwrap(), expected[&note.written.0]);
            // The angle of the threshold and the torque are proportional to the pressure.
            let pressure = note.landmarks.a_on_deg / standard.landmarks.a_on_deg;
            let torque = f64::from(note.feel.scale_mnm / standard.feel.scale_mnm);
            for found in [asked.gamma_on, asked.p_req_pa / P_REF_PA, pressure * 0.3905, torque * 0.3905] {
                let off = found / expected - 1.0;
                assert!(off.abs() < 0.0035, "{law:?} {}: {found} against {expected}", note.written);
                worst = worst.max(off.abs());
            }
            assert_eq!(note.feel.a_on_deg, note.landmarks.a_on_deg as f32);
        }
    }
    println!("worst {:.2} %", 100.0 * worst);
}

#[test]
fn default_travel_is_kept_on_the_reference_note() {
    let flow = table(&design(TorqueLaw::Flow, 3.0), &Settings::default()).unwrap();
    let a = flow.reference().landmarks;
    assert!((a.a_on_deg - 120.0).abs() < 1e-4 && (a.a_close_deg - 360.0).abs() < 1e-3);
    assert!((flow.reference().feel.stretch - 1.0).abs() < 1e-6);
    let pressure = table(&design(TorqueLaw::Pressure, 3.0), &Settings::default()).unwrap();
    for note in pressure.notes() {
        assert!((note.landmarks.a_close_deg - 360.0).abs() < 1e-3, "closure does not depend on the note");
    }
}

/// The peak of the torque, the landmarks and the pressures agree at any Contrast.
#[test]
fn landmarks_torque_and_pressure_agree_at_any_contrast() {
    let tables = ReedTables::reference();
    for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
        for contrast in [1.0, 3.0, 5.0] {
            let table = table(&design(law, contrast), &Settings::default()).unwrap();
            for note in table.notes() {
                let (a, asked) = (note.landmarks, note.requirement.unwrap());
                let p_close = P_REF_PA;
                for (angle, gamma) in [
                    (a.a_on_deg, asked.gamma_sounding),
                    (a.a_beat_deg, asked.gamma_beat),
                    (a.a_close_deg, 1.0),
                    (a.a_off_deg, asked.gamma_off),
                ] {
                    assert!((note.map.pressure_pa(angle) / p_close - gamma).abs() < 1e-6, "{}", note.written);
                }
                assert!(0.0 < a.a_on_deg && a.a_on_deg <= a.a_beat_deg && a.a_beat_deg < a.a_close_deg);
                assert!((torque_law::closure_deg(&note.feel) - a.a_close_deg).abs() < 1e-3);
                if law == TorqueLaw::Flow {
                    // The torque is lower a twentieth before and after the threshold than at it.
                    let torque = |share: f64| torque_law::torque_mnm(&note.feel, tables, share * a.a_on_deg);
                    assert!(torque(1.0) > torque(0.95) && torque(1.0) > torque(1.05));
                    let law_mnm = torque(1.0) - 0.1 * f64::from(note.feel.detent);
                    assert!((law_mnm / f64::from(note.feel.scale_mnm) - 1.0).abs() < 2e-3);
                }
                note.feel.check().unwrap();
            }
        }
    }
}

fn spread_of(table: &FeelTable, value: impl Fn(&NoteFeel) -> f64) -> f64 {
    let all = || table.notes().iter().map(&value);
    all().fold(0.0, f64::max) / all().fold(f64::INFINITY, f64::min)
}

fn spread(table: &FeelTable) -> f64 {
    spread_of(table, |note| note.landmarks.a_on_deg)
}

#[test]
fn contrast_and_place_are_powers_of_the_physical_spread_about_the_reference() {
    let at = |contrast: f64, place: f64| {
        let design = FeelDesign { contrast, place, ..FeelDesign::default() };
        table(&design, &Settings::default()).unwrap()
    };
    let torque = |note: &NoteFeel| f64::from(note.feel.scale_mnm);
    let physical = spread(&at(1.0, 1.0));
    println!("spread: physical {physical:.3}, 3 {:.3}, 5 {:.3}", physical.powi(3), physical.powi(5));
    for (contrast, place) in [(1.0, 2.0), (2.0, 1.0), (3.0, 1.0), (3.0, 5.0), (5.0, 3.0)] {
        let table = at(contrast, place);
        assert!((spread(&table) / physical.powf(place) - 1.0).abs() < 1e-9, "{contrast} {place}");
        assert!(
            (spread_of(&table, torque) / physical.powf(contrast) - 1.0).abs() < 1e-6,
            "{contrast} {place}"
        );
        let reference = table.reference();
        assert!((reference.landmarks.a_on_deg - 120.0).abs() < 1e-4);
        assert!((torque(reference) / FeelDesign::default().strength_mnm - 1.0).abs() < 1e-6);
    }
    // Contrast changes no pressure.
    for (a, b) in at(1.0, 1.0).notes().iter().zip(at(5.0, 1.0).notes()) {
        assert_eq!((a.map, a.landmarks), (b.map, b.landmarks), "{}", a.written);
    }
}

/// Smallest difference between torques that hands tell apart, relative (Jandura and Srinivasan 1994).
const TORQUE_JND: f64 = 0.127;

/// Without its mark the flow law has no place that a hand could find: its torque stays within one just noticeable
/// difference of the peak over more than a third of the travel. The mark is that large, for every note up to Contrast 3 and
/// for all up to G6 at 5, and the torque falls off on both sides of it.
#[test]
fn a_hand_can_find_the_threshold_of_the_flow_law_by_its_mark() {
    let tables = ReedTables::reference();
    let about = |note: &NoteFeel| {
        let torque = |deg: f64| torque_law::torque_mnm(&note.feel, tables, deg);
        let top = torque(note.landmarks.a_on_deg);
        // Beyond closure is the wall.
        let within: Vec<f64> = (0..=4_000)
            .map(|step| 0.25e-3 * f64::from(step) * note.landmarks.a_close_deg)
            .filter(|&deg| torque(deg) >= top / (1.0 + TORQUE_JND))
            .collect();
        (within[0], within[within.len() - 1])
    };
    let bare = FeelDesign { detent_mnm: Some(0.0), ..design(TorqueLaw::Flow, 1.0) };
    let (from_deg, to_deg) = about(table(&bare, &Settings::default()).unwrap().reference());
    println!(
        "reference note without a mark: within one JND of the peak from {from_deg:.0} to {to_deg:.0} degrees"
    );
    // As `docs/feel.md` says.
    assert!((from_deg - 61.0).abs() < 1.0 && (to_deg - 191.0).abs() < 1.0, "{from_deg} {to_deg}");
    for contrast in [1.0, 3.0, 5.0] {
        let table = table(&design(TorqueLaw::Flow, contrast), &Settings::default()).unwrap();
        let (mut least, mut widest) = (f64::INFINITY, 0.0_f64);
        for note in table.notes().iter().filter(|note| contrast < 5.0 || note.written.0 <= 91) {
            let share = 0.1 * f64::from(note.feel.detent) / f64::from(note.feel.scale_mnm);
            assert!(share >= TORQUE_JND, "Contrast {contrast} {}: {share}", note.written);
            let (from_deg, to_deg) = about(note);
            (least, widest) = (least.min(share), widest.max(to_deg - from_deg));
            assert!(
                torque_law::extremes(&note.feel).push_nm_per_rad
                    < 0.75 * TorqueLimits::default().push_nm_per_rad
            );
        }
        println!(
            "Contrast {contrast}: mark at least {:.1} %, found within {widest:.0} degrees",
            100.0 * least
        );
        assert!(widest < 12.0, "{widest}");
    }
}

/// With equal travel, notes lie where the reference reed puts them, under both laws; pressures and law are the reed's.
#[test]
fn equal_travel_moves_the_map_and_not_the_knob() {
    for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
        let design = FeelDesign { law, equal_travel: true, strength_mnm: 30.0, ..FeelDesign::default() };
        let standard = FeelTable::new(
            &BORE,
            &FeelDesign { equal_travel: false, ..design },
            &PlayedReed::quasi_static(0.3).unwrap(),
            &TorqueLimits::default(),
        )
        .unwrap();
        for (h, k) in [(2.0, 0.843_75), (2.0, 0.384_9), (3.3, 0.187_8), (3.3, 0.384_9)] {
            let settings = Settings { reed_h: h, reed_k: k, coupled: false, ..Settings::default() };
            let table = table(&design, &settings).unwrap();
            for (note, standard) in table.notes().iter().zip(standard.notes()) {
                let (a, required) = (note.landmarks, note.requirement.unwrap());
                assert!((a.a_on_deg / standard.landmarks.a_on_deg - 1.0).abs() < 1e-9, "{law:?} H {h}");
                assert!((a.a_close_deg / standard.landmarks.a_close_deg - 1.0).abs() < 1e-9, "{law:?} H {h}");
                assert_eq!(note.feel.scale_mnm, standard.feel.scale_mnm);
                let gamma = |deg: f64| note.map.pressure_pa(deg) / settings.closing_pa();
                assert!((gamma(a.a_on_deg) - required.gamma_sounding).abs() < 1e-6);
                assert!((gamma(a.a_close_deg) - 1.0).abs() < 1e-6);
                assert!((torque_law::closure_deg(&note.feel) - a.a_close_deg).abs() < 1e-3);
            }
        }
    }
}

#[test]
fn covered_holes_order_notes_by_their_fingers_either_way() {
    let with = |order: NoteOrder| {
        let design = FeelDesign { order, ..design(TorqueLaw::Flow, 1.0) };
        table(&design, &Settings::default()).unwrap()
    };
    let (covered, reversed, physical) =
        (with(NoteOrder::CoveredHoles), with(NoteOrder::CoveredHolesReversed), with(NoteOrder::Physical));
    let lengths: Vec<f64> = BORE.closed_tube_m().collect();
    for (a, (long, felt)) in lengths.iter().zip(covered.notes()).enumerate() {
        for (b, (short, other)) in lengths.iter().zip(covered.notes()).enumerate() {
            if long > short {
                assert!(felt.landmarks.a_on_deg > other.landmarks.a_on_deg);
                let back = |note: usize| reversed.notes()[note].landmarks.a_on_deg;
                assert!(back(a) < back(b));
            }
        }
    }
    // E3 covers every hole; B4, a twelfth above, has the same fingering but for the register key, and feels the same.
    let angle =
        |midi: u8| covered.notes().iter().find(|note| note.written.0 == midi).unwrap().landmarks.a_on_deg;
    assert_eq!(angle(52), angle(71));
    assert!(angle(52) > angle(55) && angle(55) > angle(60) && angle(60) > angle(67));
    for other in [&covered, &reversed] {
        assert!((spread(other) / spread(&physical) - 1.0).abs() < 1e-9);
    }
    // The requirement does not depend on the order.
    assert_eq!(covered.notes()[0].requirement, physical.notes()[0].requirement);
}

/// How fast a small oscillation at `f_hz` grows in the whole instrument under a steady breath, 1/s.
fn growth(fingering: usize, settings: &Settings, gamma: f64, f_hz: f64) -> f64 {
    let played = played_reed(&MODEL.file, MODEL.a4_hz, settings);
    let (lip, rate) = (played.lips[fingering], MODEL.coeffs.rate_hz);
    let reed = ReedCoeffs::new(
        MovingReed {
            law: played.law,
            zeta: played.zeta,
            lay: played.lay,
            resonance_hz: lip.resonance_hz,
            damping: lip.damping,
            swept_s: MODEL.swept_s,
        },
        rate,
    );
    // Without jets: half a second after the breath began, the rest of the steady flow in the holes would still damp.
    let held = TrialNote { jet_loss: 0.0, ..TrialNote::new(&MODEL, fingering, gamma) };
    let mut voice: Voice<f64> = held.voice(&MODEL);
    let closing = played.law.closing();
    let tick = |voice: &mut Voice<f64>, gamma: f64| {
        voice.tick(&Drive { p_mouth: gamma * closing, tongue: 0.0, noise: 0.0, reed });
    };
    let ticks = |seconds: f64| (seconds * rate / TICK as f64) as usize;
    // The breath rises so smoothly that it hardly excites any mode. Then the reed is touched.
    for n in 0..ticks(0.15) {
        let x = (n + 1) as f64 / ticks(0.15) as f64;
        tick(&mut voice, gamma * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x));
    }
    (0..ticks(0.05)).for_each(|_| tick(&mut voice, gamma));
    voice.reed_mut().speed += 1e-3;
    (0..ticks(0.03)).for_each(|_| tick(&mut voice, gamma));
    voice.set_probing(true);
    let mut sound = Vec::new();
    for _ in 0..ticks(0.5) {
        tick(&mut voice, gamma);
        sound.extend(voice.probes().unwrap().iter().map(|probe| probe.p_mouthpiece_pa / P_REF_PA));
    }
    let mean = sound.iter().sum::<f64>() / sound.len() as f64;
    let small = sound.iter().position(|p| (p - mean).abs() > 0.01).unwrap_or(sound.len());
    assert!(small as f64 > 0.15 * rate, "another mode is loud at once");
    let sound: Vec<f64> = sound[..small].iter().map(|p| p - mean).collect();
    let len = (0.08 * rate) as usize;
    let level = |from: usize| memoryless::amplitude_at(&sound[from..from + len], f_hz, rate).ln();
    (level(sound.len() - len) - level(0)) / ((sound.len() - len) as f64 / rate)
}

#[test]
fn linear_stability_of_the_moving_reed_is_the_instruments_own() {
    let standard = Settings::default();
    let reeds = [
        standard,
        Settings { strength: 4.0, ..standard },
        Settings { lip: 0.7, ..standard },
        Settings { reed_h: 3.5, coupled: false, reed_k: 0.385, ..standard },
        Settings { reed_a: 1.5, ..standard },
        Settings { damping: 0.6, ..standard },
        Settings { zeta: 0.2, ..standard },
        Settings { zeta: 0.7, ..standard },
    ];
    let runs: Vec<(usize, usize)> =
        (0..reeds.len()).flat_map(|reed| [0, 8, 16, 20, 27, 33, 36].map(|note| (reed, note))).collect();
    let asked: Vec<Vec<Option<NoteRequirement>>> =
        reeds.iter().map(|settings| BORE.with(&played_reed(&MODEL.file, MODEL.a4_hz, settings))).collect();
    let found = each(&runs, |&(reed, note)| {
        let asked = asked[reed][note].unwrap();
        let gamma = asked.gamma_own.unwrap();
        let f_hz = if gamma == asked.gamma_sounding { asked.sounding_hz } else { MODEL.notes_hz[note] };
        let [below, above] = [0.99, 1.01].map(|share| growth(note, &reeds[reed], share * gamma, f_hz));
        assert!(below < 0.0 && above > 0.0, "reed {reed}, written {}: {below}, {above}", written(note));
        0.99 - 0.02 * below / (above - below)
    });
    let mut worst = 0.0_f64;
    for (&(reed, note), measured) in runs.iter().zip(found) {
        let asked = asked[reed][note].unwrap();
        println!(
            "reed {reed} written {}: without inertia {:.4}, moving {:.4}, played {:+.2} %",
            written(note),
            asked.gamma_on,
            asked.gamma_own.unwrap(),
            100.0 * (measured - 1.0)
        );
        worst = worst.max((measured - 1.0).abs());
    }
    println!("worst {:.2} %", 100.0 * worst);
    assert!(worst < 0.0015, "{worst}");
}

/// Gamma at which a note is heard to begin in a slow crescendo: steps of 0.5 %, 1.2 s each, with jets and breath noise.
///
/// In an even slower crescendo it would be lower: 1 % above its threshold, a low note takes a second to grow by a factor of 8.
fn heard_onset(fingering: usize, expected: f64) -> f64 {
    /// Rms over the closing pressure: ten times that of the breath noise in the mouthpiece before the note.
    const SOUND: f64 = 0.005;
    let held = TrialNote::new(&MODEL, fingering, 0.0);
    let (reed, rate) = (held.reed(&MODEL), MODEL.coeffs.rate_hz);
    let mut voice: Voice<f32> = held.voice(&MODEL);
    voice.set_probing(true);
    let ticks = |seconds: f64| (seconds * rate / TICK as f64) as usize;
    let mut gamma = 0.0;
    for step in 0..16 {
        let (from, to) = (gamma, expected * (0.96 + 0.005 * f64::from(step)));
        let mut sound = Vec::new();
        for tick in 0..ticks(1.2) {
            gamma = from + (to - from) * ((tick + 1) as f64 / ticks(0.3) as f64).min(1.0);
            voice.tick(&Drive { p_mouth: gamma, tongue: 0.0, noise: 0.3, reed });
            if tick > ticks(0.95) {
                sound.extend(voice.probes().unwrap().iter().map(|probe| probe.p_mouthpiece_pa / P_REF_PA));
            }
        }
        let mean = sound.iter().sum::<f64>() / sound.len() as f64;
        sound.iter_mut().for_each(|p| *p -= mean);
        let rms = (sound.iter().map(|p| p * p).sum::<f64>() / sound.len() as f64).sqrt();
        if rms > SOUND {
            return gamma;
        }
    }
    f64::NAN
}

/// In a slow crescendo the sound begins where the hand feels the threshold.
#[test]
fn what_is_felt_is_what_sounds() {
    let asked = BORE.with(&played_reed(&MODEL.file, MODEL.a4_hz, &Settings::default()));
    let notes: Vec<usize> = (0..asked.len()).collect();
    let heard = each(&notes, |&note| heard_onset(note, asked[note].unwrap().gamma_sounding));
    for (&note, &gamma) in notes.iter().zip(&heard) {
        let asked = asked[note].unwrap();
        println!(
            "written {}: quasi-static {:.4}, moving reed {:.4}, heard at {gamma:.4} ({:+.1} %)",
            written(note),
            asked.gamma_on,
            asked.gamma_sounding,
            100.0 * (gamma / asked.gamma_sounding - 1.0),
        );
    }
    let mut worst = 0.0_f64;
    for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
        for contrast in [1.0, 3.0, 5.0] {
            let table = table(&design(law, contrast), &Settings::default()).unwrap();
            for (note, &gamma) in table.notes().iter().zip(&heard) {
                let felt_deg = note.landmarks.a_on_deg;
                let heard_deg = note.map.angle_deg(gamma * P_REF_PA);
                let off = heard_deg / felt_deg - 1.0;
                assert!(
                    off.abs() < 0.021,
                    "{law:?} Contrast {contrast}, {}: felt at {felt_deg:.1} degrees, heard at {heard_deg:.1}",
                    note.written
                );
                worst = worst.max(off.abs());
            }
        }
    }
    println!("worst {:.2} % of the angle", 100.0 * worst);
}

/// Only F5 starts on another mode than its own, by a hair.
#[test]
fn every_note_starts_itself() {
    let mut elsewhere = Vec::new();
    for (note, asked) in
        BORE.with(&played_reed(&MODEL.file, MODEL.a4_hz, &Settings::default())).into_iter().enumerate()
    {
        let asked = asked.unwrap();
        if asked.gamma_own != Some(asked.gamma_sounding) {
            let own = asked.gamma_own.unwrap();
            println!(
                "written {}: {:.0} Hz from {:.4}, its own {:.0} Hz from {own:.4} ({:+.1} %)",
                written(note),
                asked.sounding_hz,
                asked.gamma_sounding,
                MODEL.notes_hz[note],
                100.0 * (own / asked.gamma_sounding - 1.0)
            );
            assert!(own < 1.001 * asked.gamma_sounding);
            elsewhere.push(written(note));
        }
    }
    assert_eq!(elsewhere, [77]);
}

/// Gamma above which a loud note is silent, in a slow crescendo.
fn heard_extinction(fingering: usize, zeta: f64, expected: f64) -> f64 {
    let held = TrialNote { zeta, ..TrialNote::new(&MODEL, fingering, 0.0) };
    let (reed, rate) = (held.reed(&MODEL), MODEL.coeffs.rate_hz);
    let mut voice: Voice<f32> = held.voice(&MODEL);
    voice.set_probing(true);
    let ticks = |seconds: f64| (seconds * rate / TICK as f64) as usize;
    let (from, to) = (0.7, 1.3 * expected);
    let (mut last, mut sound) = (0.0, Vec::new());
    for tick in 0..ticks(9.0) {
        let t = tick as f64 / ticks(1.0) as f64;
        let gamma = if t < 1.0 { from * (2.0 * t).min(1.0) } else { from + (to - from) * (t - 1.0) / 8.0 };
        voice.tick(&Drive { p_mouth: gamma, tongue: 0.0, noise: 0.3, reed });
        sound.extend(voice.probes().unwrap().iter().map(|probe| probe.p_mouthpiece_pa / P_REF_PA));
        if sound.len() as f64 > 0.02 * rate {
            let mean = sound.iter().sum::<f64>() / sound.len() as f64;
            let square = sound.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / sound.len() as f64;
            if square.sqrt() > 0.02 {
                last = gamma;
            }
            sound.clear();
        }
    }
    last
}

#[test]
fn extinction_is_within_a_tenth_of_the_instruments() {
    let runs: Vec<(usize, f64)> = [0, 6, 12, 18, 21, 24, 30, 36]
        .into_iter()
        .flat_map(|note| [0.2, 0.3, 0.4].map(|zeta| (note, zeta)))
        .collect();
    let found = each(&runs, |&(note, zeta)| {
        let settings = Settings { zeta: zeta as f32, ..Settings::default() };
        let expected = BORE.note(note, &played_reed(&MODEL.file, MODEL.a4_hz, &settings)).unwrap().gamma_off;
        (expected, heard_extinction(note, zeta, expected))
    });
    let mut worst = 0.0_f64;
    for ((note, zeta), (expected, heard)) in runs.into_iter().zip(found) {
        let off = expected / heard - 1.0;
        println!(
            "written {} zeta {zeta}: {expected:.3}, heard to {heard:.3} ({:+.1} %)",
            written(note),
            100.0 * off
        );
        worst = worst.max(off.abs());
    }
    println!("worst {:.1} %", 100.0 * worst);
    // Measured 0.078.
    assert!(worst < 0.08, "{worst}");
}

#[test]
fn a_reed_in_use_moves_angles_and_keeps_its_own_closure() {
    let standard = table(&design(TorqueLaw::Flow, 1.0), &Settings::default()).unwrap();
    let hard =
        table(&design(TorqueLaw::Flow, 1.0), &Settings { strength: 4.0, ..Settings::default() }).unwrap();
    let (soft, hard) = (standard.reference(), hard.reference());
    let closing = Settings { strength: 4.0, ..Settings::default() }.reed_law().closing();
    assert!(hard.landmarks.a_on_deg > 1.6 * soft.landmarks.a_on_deg);
    assert!((hard.map.pressure_pa(hard.landmarks.a_close_deg) - closing * P_REF_PA).abs() < 1e-6);
    assert!(
        (f64::from(hard.feel.k)
            - played_reed(&MODEL.file, MODEL.a4_hz, &Settings { strength: 4.0, ..Settings::default() })
                .law
                .k())
        .abs()
            < 1e-6
    );
    // A larger zeta lowers the requirement.
    let firm = table(&design(TorqueLaw::Flow, 1.0), &Settings { zeta: 0.45, ..Settings::default() }).unwrap();
    assert!(
        firm.notes().iter().zip(standard.notes()).all(|(a, b)| a.landmarks.a_on_deg < b.landmarks.a_on_deg)
    );
}

#[test]
fn requests_a_knob_cannot_take_are_refused_with_numbers() {
    let standard = Settings::default();
    let says = |design: FeelDesign, settings: Settings, words: &[&str]| {
        let message = table(&design, &settings).expect_err("refused").to_string();
        for word in words {
            assert!(message.contains(word), "{message}");
        }
    };
    let default = FeelDesign::default();
    says(
        FeelDesign { strength_mnm: 120.0, ..default },
        standard,
        &["ceiling is 100", "lower Feel torque to"],
    );
    says(FeelDesign { contrast: 6.0, ..default }, standard, &["Contrast must lie in 1..5, got 6"]);
    says(FeelDesign { contrast: f64::NAN, ..default }, standard, &["Contrast", "NaN"]);
    says(FeelDesign { place: 0.5, ..default }, standard, &["Place must lie in 1..5, got 0.5"]);
    says(FeelDesign { detent_mnm: Some(15.0), ..default }, standard, &["push the hand", "lower the mark"]);
    says(FeelDesign { wall_mnm_per_deg: 60.0, ..default }, standard, &["N m/rad", "soften the wall"]);
    says(FeelDesign { reference: Some(WrittenNote(20)), ..default }, standard, &["does not sound"]);
    says(default, Settings { reed_a: 0.1, ..standard }, &["too weak"]);
    says(
        FeelDesign { law: TorqueLaw::Pressure, place: 5.0, ..default },
        Settings { zeta: 0.1, ..standard },
        &["too near closure", "lower Feel place"],
    );
    // Every note closes at the same angle, which is too near for this reed.
    says(
        FeelDesign { equal_travel: true, travel_deg: 120.0, strength_mnm: 1.0, ..default },
        Settings { reed_h: 5.0, reed_k: 2.0, coupled: false, ..standard },
        &["stretch", "0.1..30", "lengthen the travel"],
    );
    // No strength fits below the mark.
    let weak = TorqueLimits { ceiling_mnm: 5.0, ..TorqueLimits::default() };
    let refused = FeelTable::new(&BORE, &default, &played_reed(&MODEL.file, MODEL.a4_hz, &standard), &weak);
    let message = refused.expect_err("a ceiling").to_string();
    assert!(message.contains("lower the mark") && !message.contains("strength"), "{message}");
    let slip = Settings { reed_h: 3.674_234_6, ..standard };
    says(default, slip, &["sqrt(27/2)", "2.598"]);
    // The strength that the message advises is accepted.
    let Err(FeelRefused::Ceiling { strength_mnm, .. }) =
        table(&FeelDesign { strength_mnm: 120.0, ..default }, &standard)
    else {
        panic!("a ceiling");
    };
    assert!(strength_mnm > 50.0);
    table(&FeelDesign { strength_mnm, ..default }, &standard).unwrap();
    // A low push limit refuses the falling branch of the flow law, but not the spring of the pressure law.
    let gentle = TorqueLimits { push_nm_per_rad: 0.02, ..TorqueLimits::default() };
    let reed = played_reed(&MODEL.file, MODEL.a4_hz, &standard);
    let flow = FeelTable::new(&BORE, &default, &reed, &gentle);
    assert!(matches!(flow, Err(FeelRefused::Push { .. })));
    FeelTable::new(&BORE, &design(TorqueLaw::Pressure, 3.0), &reed, &gentle).unwrap();
}

/// A knob that gets a single note is checked against the torque of that note, not of the hardest one.
#[test]
fn one_note_may_keep_to_a_ceiling_that_another_passes() {
    let (design, limits) =
        (design(TorqueLaw::Flow, 3.0), TorqueLimits { ceiling_mnm: 60.0, ..TorqueLimits::default() });
    let settings = Settings::default();
    let table = table(&design, &settings).unwrap();
    let hardest = table.notes().len() - 1;
    assert_eq!(table.accepts(0, &design, &limits), Ok(()));
    let refused = table.accepts(hardest, &design, &limits);
    assert!(
        matches!(refused, Err(FeelRefused::Ceiling { wanted_mnm, .. }) if wanted_mnm > 70.0),
        "{refused:?}"
    );
}

#[test]
fn every_allowed_setting_gives_a_feel_or_a_reason() {
    let mut seed = 7_u64;
    let mut random = move |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut made, mut refused) = (0, 0);
    for run in 0..400 {
        let settings = Settings {
            strength: random(1.5, 5.0) as f32,
            lip: random(0.6, 1.4) as f32,
            zeta: random(0.05, 0.9) as f32,
            damping: random(0.2, 2.0) as f32,
            lay: random(0.0, 0.5) as f32,
            reed_h: random(1.0, 5.0) as f32,
            reed_k: random(0.1, 2.0) as f32,
            coupled: run % 2 == 0,
            reed_a: random(0.0, 2.0) as f32,
            vent_loss: random(0.0, 4.0) as f32,
            ..Settings::default()
        };
        let design = FeelDesign {
            law: [TorqueLaw::Free, TorqueLaw::Flow, TorqueLaw::Pressure][run % 3],
            contrast: random(1.0, 5.0),
            place: random(1.0, 5.0),
            equal_travel: run % 5 == 0,
            strength_mnm: random(0.0, 150.0),
            travel_deg: random(120.0, 1_080.0),
            wall_share: random(0.5, 4.0),
            ..FeelDesign::default()
        };
        let Ok(table) = table(&design, &settings) else {
            refused += 1;
            continue;
        };
        made += 1;
        for note in table.notes() {
            note.feel.check().unwrap_or_else(|error| panic!("{error}: {settings:?} {design:?}"));
            let mut before = 0.0;
            for step in 1..400 {
                let angle = 0.01 * f64::from(step) * note.landmarks.a_close_deg;
                let pressure = note.map.pressure_pa(angle);
                assert!(pressure.is_finite() && pressure > before, "{settings:?}");
                assert!((note.map.angle_deg(pressure) / angle - 1.0).abs() < 1e-6);
                before = pressure;
            }
        }
    }
    println!("{made} made, {refused} refused");
    assert!(made > 50 && refused > 20);
}

#[test]
fn another_instrument_without_c5_takes_the_middle_of_its_chart() {
    let mut file = MODEL.file.clone();
    file.fingerings.retain(|fingering| fingering.written != WrittenNote(72));
    let bore = RequirementSolver::new(&file, Air::default(), 440.0).unwrap();
    let table = FeelTable::new(
        &bore,
        &FeelDesign::default(),
        &PlayedReed::quasi_static(0.3).unwrap(),
        &TorqueLimits::default(),
    )
    .unwrap();
    let (middle, all) = (table.reference().landmarks.a_on_deg, table.notes());
    let harder = all.iter().filter(|note| note.landmarks.a_on_deg > middle).count();
    assert!((harder as f64 / all.len() as f64 - 0.5).abs() < 0.05, "{harder} of {}", all.len());
}

/// A clarinet built for another A4 has shorter or longer bores, and notes and lip that go with them: what a note requires of
/// the breath hardly changes.
#[test]
fn notes_require_the_same_at_another_a4() {
    let file = InstrumentFile::built_in();
    let required = |a4_hz: f64| {
        let built = file.scaled(440.0 / a4_hz);
        let reed = played_reed(&built, a4_hz, &Settings::default());
        RequirementSolver::new(&built, Air::default(), a4_hz).unwrap().with(&reed)
    };
    let standard = required(440.0);
    for a4_hz in [392.0, 415.0, 466.0] {
        let notes = required(a4_hz);
        assert_eq!(notes.len(), standard.len());
        let mut worst: f64 = 0.0;
        for (note, standard) in notes.iter().zip(&standard) {
            let (Some(note), Some(standard)) = (note, standard) else {
                assert_eq!(note.is_some(), standard.is_some());
                continue;
            };
            assert_eq!(note.gamma_own.is_some(), standard.gamma_own.is_some());
            worst = worst.max((note.gamma_sounding / standard.gamma_sounding - 1.0).abs());
        }
        println!("A4 = {a4_hz} Hz: {worst:.4}");
        assert!(worst < 0.02, "{worst}");
    }
}

#[cfg(feature = "simulator")]
mod firmware {
    //! The torque law of the host and that of the firmware.

    use super::*;
    use chalumeau_firmware::{FeelBytes, check_feel, law_torque_mnm};
    use chalumeau_knob::wire::frame::encode;
    use chalumeau_knob::wire::message::{Feel, Message};

    /// The payload of a FEEL frame.
    fn bytes(feel: &Feel) -> FeelBytes {
        let frame = encode(&Message::Feel(*feel), 0);
        let mut plain = [0_u8; 80];
        let wire: &[u8] = frame.as_ref();
        cobs::decode(&wire[1..wire.len() - 1], &mut plain).unwrap();
        plain[2..58].try_into().unwrap()
    }

    #[test]
    fn both_laws_are_the_knobs_at_every_index_of_the_table() {
        let standard = *table(&FeelDesign::default(), &Settings::default()).unwrap().reference();
        let (mut worst, mut count) = (0.0_f64, 0);
        for law in [TorqueLaw::Free, TorqueLaw::Flow, TorqueLaw::Pressure] {
            for h in [0.5, 1.0, 2.0, 2.598_076, 3.0, 5.0_f32] {
                for k in [0.05, 0.2, 0.384_900_2, 0.8, 2.0_f32] {
                    for (offset_deg, detent) in [(0.0, 0), (-40.0, 60), (15.0, 100_u16)] {
                        let feel = Feel { law, h, k, offset_deg, detent, wall_deg: 330.0, ..standard.feel };
                        let there = bytes(&feel);
                        for index in -1_500..=4_200 {
                            let angle = 0.1 * f64::from(index);
                            let here = torque_law::torque_mnm(&feel, ReedTables::reference(), angle);
                            let off = here + f64::from(law_torque_mnm(&there, angle as f32));
                            assert!(off.abs() <= 0.2, "{feel:?} at {angle}: {here}, {off}");
                            (worst, count) = (worst.max(off.abs()), count + 1);
                        }
                    }
                }
            }
        }
        println!("worst {worst:.4} mNm in {count}");
    }

    /// Default damping of the firmware, N m s/rad, with which the default limit is b / (2 T).
    const DAMPING_NMS: f32 = 5e-4;

    /// The host refuses what the knob would refuse, and nothing else.
    #[test]
    fn slopes_the_knob_refuses_are_refused_before_they_are_sent() {
        let standard = *table(&FeelDesign::default(), &Settings::default()).unwrap().reference();
        let limits = TorqueLimits::default();
        let (mut taken, mut refused) = (0, 0);
        for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
            for scale_mnm in [5.0, 40.0, 100.0, 300.0, 450.0_f32] {
                for stretch in [0.3, 1.0, 3.0, 8.0, 25.0_f32] {
                    for wall_mnm_per_deg in [0.0, 5.0, 13.0, 16.0_f32] {
                        for detent in [0, 50, 400] {
                            let (a_on_deg, wall_deg) = (120.0 / stretch, 414.0 / stretch);
                            let feel = Feel {
                                law,
                                scale_mnm,
                                stretch,
                                wall_mnm_per_deg,
                                detent,
                                a_on_deg,
                                wall_deg,
                                ..standard.feel
                            };
                            let extremes = torque_law::extremes(&feel);
                            let share = (extremes.stiffness_nm_per_rad / limits.stiffness_nm_per_rad)
                                .max(extremes.push_nm_per_rad / limits.push_nm_per_rad);
                            if (share - 1.0).abs() < 1e-3 || feel.check().is_err() {
                                continue;
                            }
                            let verdict = check_feel(&bytes(&feel), DAMPING_NMS);
                            assert_eq!(verdict.is_ok(), share < 1.0, "{feel:?} {extremes:?} {verdict:?}");
                            if share < 1.0 { taken += 1 } else { refused += 1 }
                        }
                    }
                }
            }
        }
        println!("{taken} taken, {refused} refused, by both");
        assert!(taken > 30 && refused > 30);
    }

    #[test]
    fn every_note_at_every_contrast_is_accepted_by_the_knob() {
        for law in [TorqueLaw::Flow, TorqueLaw::Pressure] {
            for contrast in [1.0, 3.0, 5.0] {
                for note in table(&design(law, contrast), &Settings::default()).unwrap().notes() {
                    check_feel(&bytes(&note.feel), DAMPING_NMS).unwrap();
                }
            }
        }
    }
}

#[cfg(feature = "cli")]
mod command {
    //! The output and the errors of `chalumeau haptic`.

    use std::process::Command;

    fn run(line: &str) -> (Option<i32>, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_chalumeau")).args(line.split(' ')).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    }

    fn rows(line: &str, header: &str) -> Vec<Vec<f64>> {
        let (code, out, error) = run(line);
        assert_eq!(code, Some(0), "{error}");
        assert_eq!(out.lines().next(), Some(header));
        out.lines()
            .skip(1)
            .filter(|line| !line.starts_with('#'))
            .map(|line| {
                let fields = line.split(',').skip(usize::from(header == TABLE));
                fields.map(|field| field.parse().unwrap()).collect()
            })
            .collect()
    }

    const TABLE: &str = "written,written_midi,gamma_on,gamma_off,p_req_pa,a_on_deg,a_off_deg,a_close_deg,scale_mnm,h,k,gamma_sounding,wall_deg,most_mnm";

    #[test]
    fn table_of_all_notes_and_curve_of_one() {
        let all = rows("haptic --all --zeta 0.3 --contrast 1 --csv -", TABLE);
        assert_eq!((all.len(), all[0].len(), all[0][0]), (46, 13, 52.0));
        for row in &all {
            // The wall stands behind the closure.
            assert!(row[6] < row[11]);
            assert!((row[3] / (6_000.0 * row[1]) - 1.0).abs() < 1e-5);
            assert!(row[4] < row[6] && row[6] <= row[5] && (row[6] / row[4] - 3.0).abs() < 1e-3);
        }
        let one = rows("haptic --written E3 --law pressure", TABLE);
        assert_eq!((one.len(), one[0][0]), (1, 52.0));
        let curve = rows("haptic --written 52 --law flow --curve", "angle_deg,torque_mnm");
        assert!(curve.windows(2).all(|pair| (pair[1][0] - pair[0][0] - 0.1).abs() < 1e-9));
        assert!(curve.iter().any(|row| row[0] == 0.0 && row[1] == 0.0));
        let most = curve.iter().filter(|row| row[0] < 300.0).max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        let table = rows("haptic --written 52", TABLE);
        // The peak of the law with its mark.
        assert!((most[0] - table[0][4]).abs() < 1.0 && (most[1] / (table[0][7] + 9.0) - 1.0).abs() < 2e-3);
        // The table tells it, friction included.
        assert!((table[0][12] - 1.0 - most[1]).abs() < 0.2, "{table:?} {most:?}");
    }

    #[test]
    fn mistakes_end_with_code_2_and_a_way_out() {
        for (line, word) in [
            ("haptic --all --curve", "choose a note with --written"),
            ("haptic --written 20", "has no fingering"),
            ("haptic --all --reference 20", "has no fingering"),
            ("haptic --all --torque 300", "lower --torque"),
            ("haptic --all --contrast 9", "must lie in 1..5"),
            ("haptic --all --law round", "possible values"),
        ] {
            let (code, out, error) = run(line);
            assert_eq!(code, Some(2), "{line}: {error}");
            assert!(error.contains(word) && out.is_empty(), "{line}: {error}");
        }
    }
}
