//! When notes speak, in which register, and when they stop. The tests print their figures (`--nocapture`).

#[path = "support/memoryless.rs"]
mod memoryless;
#[path = "support/parallel.rs"]
mod parallel;
#[path = "support/reference.rs"]
mod reference;
#[path = "../crates/core/tests/support/some.rs"]
mod some;

use std::sync::LazyLock;

use chalumeau_core::analysis::pitch;
use chalumeau_core::bore::transfer_matrix::threshold_gamma;
use chalumeau_core::instrument::Model;
use chalumeau_core::instrument::trial_note::Start;
use chalumeau_core::instrument::trial_note::TrialNote;
use chalumeau_core::units::WrittenNote;
use chalumeau_core::units::cents;
use memoryless::MemorylessVoice;
use parallel::each;
use some::some;

static MODEL: LazyLock<Model> = LazyLock::new(|| Model::built_in(48_000.0).unwrap());

fn fingering(written: u8) -> usize {
    MODEL.file.fingerings.iter().position(|fingering| fingering.written == WrittenNote(written)).unwrap()
}

fn written(fingering: usize) -> u8 {
    MODEL.file.fingerings[fingering].written.0
}

/// Mouth pressures at which a note starts: by the lattice's own impedance, and by playing.
fn thresholds(written: u8, zeta: f64) -> (f64, f64) {
    let note = fingering(written);
    let (f_hz, height) = MemorylessVoice::new(&MODEL, note, zeta).playing_frequency(MODEL.notes_hz[note]);
    let theory = threshold_gamma(height, zeta);
    (theory, memoryless::threshold_by_growth(&MODEL, note, zeta, f_hz, theory))
}

#[test]
fn memoryless_reed_starts_where_theory_and_reference_say() {
    let runs: Vec<(u8, f64)> = [52, 57, 60, 65, 71, 79, 84]
        .into_iter()
        .flat_map(|note| [0.2, 0.3, 0.4].map(|zeta| (note, zeta)))
        .collect();
    let found = each(&runs, |&(note, zeta)| thresholds(note, zeta));
    let (mut worst, mut worst_reference) = (0.0_f64, 0.0_f64);
    for ((note, zeta), (theory, played)) in runs.into_iter().zip(found) {
        let reference = reference::by_written("thresholds_tuned.csv", &format!("gamma_th_zeta{zeta}"))[&note];
        let (off, off_reference) = (played / theory - 1.0, played / reference - 1.0);
        println!(
            "written {note} zeta {zeta}: played {played:.4}, theory {theory:.4} ({:+.2} %), reference {reference:.4} ({:+.2} %)",
            100.0 * off,
            100.0 * off_reference
        );
        assert!(off.abs() < 0.02, "written {note} zeta {zeta}: {played} against {theory}");
        assert!(zeta != 0.3 || off_reference.abs() < 0.02, "written {note}: {played} against {reference}");
        worst = worst.max(off.abs());
        worst_reference = worst_reference.max(off_reference.abs());
    }
    println!(
        "worst against theory {:.2} %, against reference {:.2} %",
        100.0 * worst,
        100.0 * worst_reference
    );
}

#[test]
fn low_notes_and_the_clarion_need_more_breath() {
    let played = each(&[52, 60, 67, 70, 71], |&note| thresholds(note, 0.3).1);
    let &[e3, c4, g4, b_flat4, b4] = &played[..] else { unreachable!() };
    println!("E3 {e3:.4} C4 {c4:.4} G4 {g4:.4}: E3/G4 {:.4}; B4/Bb4 {:.4}", e3 / g4, b4 / b_flat4);
    assert!(e3 > c4 && c4 > g4);
    assert!((e3 / g4 - 1.04).abs() < 0.015);
    assert!((b4 / b_flat4 - 1.09).abs() < 0.03);
}

/// Near the threshold the n-th harmonic grows as the n-th power of the first (Worman 1971).
#[test]
fn harmonics_grow_as_powers_of_the_first_near_threshold() {
    for note in [52, 60] {
        let (theory, played) = thresholds(note, 0.3);
        assert!(played.is_finite(), "{theory}");
        let rises = [1.005, 1.01, 1.02, 1.03];
        let levels_db: Vec<[f64; 3]> = each(&rises, |rise| {
            let rate = MODEL.coeffs.rate_hz;
            let mut blown = MemorylessVoice::new(&MODEL, fingering(note), 0.3);
            blown.blow(played * rise, 0.02, 0.0);
            // Growth is slow so near the threshold, so the note begins near its final level.
            blown.blow(played * rise, 12.0, 0.05);
            let sound = blown.blow(played * rise, 1.0, 0.0);
            let hz = pitch::fundamental_hz(&sound, rate).unwrap();
            [1.0, 2.0, 3.0].map(|n| 20.0 * memoryless::amplitude_at(&sound, n * hz, rate).log10())
        });
        let slope = |n: usize| {
            let (first, last) = (levels_db[0], levels_db[rises.len() - 1]);
            (last[n - 1] - first[n - 1]) / (last[0] - first[0])
        };
        println!(
            "written {note}: H1 H2 H3 {levels_db:.1?} dB; slopes H2 {:.2}, H3 {:.2}",
            slope(2),
            slope(3)
        );
        assert!((slope(2) - 2.0).abs() <= 0.5 && (slope(3) - 3.0).abs() <= 0.5);
    }
}

/// Share of the time that a steady held note spends at or beyond the extrapolated closing, and fully shut.
fn closed_shares(note: &TrialNote) -> (f64, f64) {
    let (mut all, mut beating, mut shut) = (0.0, 0.0, 0.0);
    let mut ticks = 0;
    note.play(&MODEL, 1.5, |_, voice| {
        ticks += 1;
        if f64::from(ticks) * 16.0 > 1.0 * MODEL.coeffs.rate_hz {
            all += 1.0;
            beating += f64::from(u8::from(voice.reed().closing >= 1.0));
            shut += f64::from(u8::from(voice.reed().opening <= 0.0));
        }
    });
    (beating / all, shut / all)
}

/// Beating is the displacement past the extrapolated closing: at lay 0 it is then shut; a curved lay shuts
/// fully only at 1 + lay, beyond what low dynamics reach.
#[test]
fn reed_beats_from_mezzoforte_on() {
    let gammas = [0.40, 0.42, 0.44, 0.46, 0.48, 0.50, 0.55, 0.6, 0.7, 0.8];
    let runs: Vec<(f64, u8, f64)> = [0.0, 0.4]
        .into_iter()
        .flat_map(|lay| [52, 60, 65].map(|note| (lay, note)))
        .flat_map(|(lay, note)| gammas.map(|gamma| (lay, note, gamma)))
        .collect();
    let found = each(&runs, |&(lay, note, gamma)| {
        closed_shares(&TrialNote { lay, ..TrialNote::new(&MODEL, fingering(note), gamma) })
    });
    for (&(lay, note, gamma), &(beating, shut)) in runs.iter().zip(&found) {
        println!("lay {lay} written {note} gamma {gamma:.2}: beating {beating:.3} shut {shut:.3}");
    }
    for ((lay, note, gamma), (beating, shut)) in runs.into_iter().zip(found) {
        assert!(gamma > 0.44 || beating == 0.0, "lay {lay} written {note} gamma {gamma}: {beating}");
        assert!(gamma < 0.55 || beating > 0.0, "lay {lay} written {note} gamma {gamma}: {beating}");
        assert!(lay > 0.0 || (beating - shut).abs() < 0.02, "a sharp lay is shut where it beats");
    }
}

#[test]
fn lossless_cylinder_sounds_as_loud_as_raman_says() {
    for zeta in [0.2, 0.3, 0.4] {
        for gamma in [0.40, 0.45, 0.50, 0.6, 0.8_f64] {
            let raman = if gamma <= 0.5 { ((3.0 * gamma - 1.0) * (1.0 - gamma)).sqrt() } else { gamma };
            let rms = memoryless::raman_rms(gamma, zeta);
            println!(
                "zeta {zeta} gamma {gamma}: rms {rms:.4}, Raman {raman:.4} ({:+.2} %)",
                100.0 * (rms / raman - 1.0)
            );
            assert!((rms / raman - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn too_much_breath_shuts_the_reed_until_it_is_much_less() {
    const STEP_S: f64 = 0.02;
    const TOP: f64 = 3.0;
    let steps = (10.0 / STEP_S) as usize;
    let mut note = MemorylessVoice::new(&MODEL, fingering(52), 0.3);
    // A trace of noise lets an instability show at once, as breath does.
    let mut swing = |gamma: f64| {
        let sound = note.blow(gamma, STEP_S, 1e-5);
        let mean = sound.iter().sum::<f64>() / sound.len() as f64;
        (sound.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / sound.len() as f64).sqrt()
    };
    let gamma = |step: usize| TOP * (step + 1) as f64 / steps as f64;
    let (mut extinction, mut restart) = (0.0, 0.0);
    for step in 0..steps {
        if swing(gamma(step)) > 0.1 {
            extinction = gamma(step);
        }
    }
    for step in (0..steps).rev() {
        if swing(gamma(step)) > 0.1 {
            restart = gamma(step);
            break;
        }
    }
    println!("written 52, zeta 0.3: extinction at gamma {extinction:.3}, restart at {restart:.3}");
    assert!((1.6..=2.7).contains(&extinction), "extinction {extinction}");
    assert!((0.88..=1.02).contains(&restart), "restart {restart}");
    assert!(extinction - restart >= 0.4);
}

/// Fundamental of a held note, if there is a periodic one. Listens from 0.55 to 0.8 s.
fn heard_hz(note: &TrialNote) -> Option<f64> {
    let sound = note.radiated(&MODEL, 0.55, 0.8);
    let hz = pitch::fundamental_hz(&sound, MODEL.coeffs.rate_hz)?;
    (pitch::periodicity(&sound, MODEL.coeffs.rate_hz, hz) > 0.9).then_some(hz)
}

fn in_register(note: &TrialNote) -> bool {
    heard_hz(note).is_some_and(|hz| cents(hz, MODEL.notes_hz[note.fingering]).abs() < 150.0)
}

#[test]
fn every_note_up_to_g_sharp_6_holds_its_register() {
    let mut runs = Vec::new();
    for note in 52..=92 {
        for gamma in [0.45, 0.5, 0.6, 0.8, 0.9] {
            for zeta in [0.25, 0.3, 0.4] {
                for start in [Start::Ramp(20.0), Start::Tongued(2.0)] {
                    runs.push(TrialNote { zeta, start, ..TrialNote::new(&MODEL, fingering(note), gamma) });
                }
            }
        }
    }
    assert_eq!(runs.len(), 1_230);
    let runs = some(runs, 4);
    let right = each(&runs, in_register);
    let wrong: Vec<String> = runs
        .iter()
        .zip(&right)
        .filter(|&(_, &right)| !right)
        .map(|(note, _)| {
            format!(
                "written {} gamma {} zeta {} {:?}",
                written(note.fingering),
                note.gamma,
                note.zeta,
                note.start
            )
        })
        .collect();
    println!("{} of {} in their register", runs.len() - wrong.len(), runs.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// C#7 has no fingering with a resonance in the right place.
#[test]
fn above_g_sharp_6_all_but_c_sharp_7_hold_their_register() {
    let runs: Vec<TrialNote> = (93..=97)
        .flat_map(|note| {
            [0.45, 0.5, 0.6, 0.8, 0.9].map(|gamma| TrialNote::new(&MODEL, fingering(note), gamma))
        })
        .collect();
    let right = each(&runs, in_register);
    for (notes, right) in runs.chunks(5).zip(right.chunks(5)) {
        println!("written {}: {right:?} at gamma .45 .5 .6 .8 .9", written(notes[0].fingering));
    }
    assert_eq!(right, [[true; 5]; 4].concat().into_iter().chain([false; 5]).collect::<Vec<_>>());
}

#[test]
fn without_vent_loss_fewer_clarion_and_altissimo_notes_hold() {
    let notes: Vec<u8> = (71..=92).collect();
    for gamma in [0.5, 0.6] {
        let runs: Vec<TrialNote> = [2.0, 0.0]
            .into_iter()
            .flat_map(|jet_loss| {
                notes.iter().map(move |&note| TrialNote {
                    jet_loss,
                    ..TrialNote::new(&MODEL, fingering(note), gamma)
                })
            })
            .collect();
        let right = each(&runs, in_register);
        let (with, without) = right.split_at(notes.len());
        let count = |right: &[bool]| right.iter().filter(|&&right| right).count();
        let lost: Vec<u8> =
            notes.iter().zip(without).filter(|&(_, &right)| !right).map(|(&note, _)| note).collect();
        println!(
            "gamma {gamma}: {} of {} with vent loss, {} without; lost {lost:?}",
            count(with),
            notes.len(),
            count(without)
        );
        assert_eq!(count(with), notes.len());
        assert!(count(without) + 3 <= count(with), "gamma {gamma}");
    }
}

/// A fundamental above this that is not the wanted note is a squeak, Hz.
const SQUEAK_HZ: f64 = 1_050.0;

fn squeaks(note: &TrialNote) -> bool {
    let wanted = MODEL.notes_hz[note.fingering];
    heard_hz(note).is_some_and(|hz| hz > SQUEAK_HZ && cents(hz, wanted).abs() > 150.0)
}

#[test]
fn nothing_squeaks_under_a_proper_lip() {
    let mut runs = Vec::new();
    for note in 52..=84 {
        for step in 0..=10 {
            for zeta in [0.2, 0.3, 0.4] {
                let gamma = 0.4 + 0.05 * f64::from(step);
                runs.push(TrialNote { zeta, ..TrialNote::new(&MODEL, fingering(note), gamma) });
            }
        }
    }
    let runs = some(runs, 4);
    let heard = each(&runs, squeaks);
    let squeaking: Vec<_> = runs
        .iter()
        .zip(&heard)
        .filter(|&(_, &squeaks)| squeaks)
        .map(|(note, _)| (written(note.fingering), note.gamma, note.zeta))
        .collect();
    println!("{} squeaks in {} runs", squeaking.len(), runs.len());
    assert!(squeaking.is_empty(), "{squeaking:?}");
}

#[test]
fn a_reed_without_lip_damping_squeaks() {
    let runs: Vec<TrialNote> = (60..=84)
        .flat_map(|note| [0.45, 0.6, 0.8].map(|gamma| TrialNote::new(&MODEL, fingering(note), gamma)))
        .map(|note| {
            let rule =
                chalumeau_core::instrument::lip::embouchure(MODEL.notes_hz[note.fingering], MODEL.size_hz);
            TrialNote { damping: 0.3 / rule.damping, ..note }
        })
        .collect();
    let heard = each(&runs, squeaks);
    let notes: Vec<_> = runs
        .iter()
        .zip(&heard)
        .filter(|&(_, &squeaks)| squeaks)
        .map(|(note, _)| (written(note.fingering), note.gamma))
        .collect();
    println!("{} of {} runs squeak at q = 0.3: {notes:?}", notes.len(), runs.len());
    assert!(!notes.is_empty());
}
