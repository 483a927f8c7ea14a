//! The whole loop in simulated time: hand, knob, firmware, wire, host, breath, clarinet. What the hand feels against what
//! is heard, and what the loop refuses. Figures are printed (`--nocapture`) to be quoted in docs/feel.md.

#[path = "closed_loop/felt.rs"]
mod felt;
#[path = "closed_loop/heard.rs"]
mod heard;
#[path = "support/parallel.rs"]
mod parallel;
#[path = "closed_loop/player.rs"]
mod player;
#[path = "closed_loop/slurs.rs"]
mod slurs;
#[path = "../crates/core/tests/support/some.rs"]
mod some;

use chalumeau_core::haptics::{FeelDesign, FeelRefused, FeelTable, NoteFeel, TorqueLimits};
use chalumeau_core::instrument::{Model, Settings};
use chalumeau_core::units::{WrittenNote, cents};
use chalumeau_knob::simulator::hand::HandDesign;
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::simulator::script::{Aim, Script};
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::wire::{RefusedCode, TorqueLaw};
use felt::{FeltThreshold, Fingers};
use heard::{Ear, SoundOnset, least_squares};
use parallel::each;
use player::LoopPlayer;
use some::some;
use std::sync::{Arc, LazyLock};

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(48_000.0).unwrap()));
static FEELS: LazyLock<InstrumentFeel> = LazyLock::new(|| InstrumentFeel::new(&MODEL));

/// The highest note whose key sounds, written C7.
const HIGHEST: u8 = 96;
const LAWS: [TorqueLaw; 2] = [TorqueLaw::Flow, TorqueLaw::Pressure];
const CONTRASTS: [f64; 3] = [1.0, 3.0, 5.0];
/// Full breath of a player who goes beyond closure: the standard full breath *is* the closing pressure, so that no angle
/// blows more.
const BEYOND_CLOSURE_KPA: f32 = 9.0;

/// The same exaggeration of torques and of places, which is the hardest case.
fn design(law: TorqueLaw, contrast: f64) -> FeelDesign {
    FeelDesign { law, contrast, place: contrast, ..FeelDesign::default() }
}

fn table(law: TorqueLaw, contrast: f64) -> FeelTable {
    FEELS.table(&Settings::physical(), &design(law, contrast), &TorqueLimits::default()).unwrap()
}

fn note(table: &FeelTable, written: u8) -> &NoteFeel {
    table.notes().iter().find(|note| note.written == WrittenNote(written)).unwrap()
}

/// A listening player with one note's feel, armed.
fn seated(table: &FeelTable, note: &NoteFeel, settings: &Settings, hand: HandDesign) -> LoopPlayer {
    let mut player =
        LoopPlayer::new(&MODEL, settings, FEELS.maps(table), note.feel, hand, PlantDesign::default());
    player.arm(100);
    player
}

fn finger(player: &mut LoopPlayer, note: &NoteFeel) {
    player.finger(note.written.sounding(MODEL.file.transposition).unwrap());
}

/// A hand that takes hold for two seconds, then turns from one angle to another at a constant speed.
fn crescendo(from_deg: f64, to_deg: f64, deg_per_s: f64) -> Script {
    let end_s = 2.0 + (to_deg - from_deg) / deg_per_s;
    let rows = format!("t_s,angle_deg\n0,0\n2,{from_deg}\n{end_s},{to_deg}\n");
    Script::read_csv(rows.as_bytes()).unwrap()
}

/// What one crescendo showed.
struct Passage {
    felt: FeltThreshold,
    /// `None`: nothing began between shortly before the threshold and well above it.
    heard: Option<SoundOnset>,
    /// Largest distance between what the map makes of the shaft's angle and what the reed got, over the latter.
    lag: f64,
    /// Largest distance of the shaft from where the hand wanted it, degrees.
    astray_deg: f64,
}

/// Turns from 0.4 to 1.8 of the felt threshold, one hundredth of it a second. The clarinet is rendered from shortly before
/// the threshold, where nothing sounds yet, until it is well above.
fn passage(table: &FeelTable, note: &NoteFeel) -> Passage {
    const PER_S: f64 = 0.01;
    const STEP_S: f64 = 0.2;
    let (a_on, settings) = (note.landmarks.a_on_deg, Settings::physical());
    let closing_pa = settings.closing_pa();
    let gamma_felt = note.map.pressure_pa(a_on) / closing_pa;
    let mut player = seated(table, note, &settings, HandDesign::listening());
    let (mut fingers, mut ear) = (Fingers::default(), Ear::default());
    let script = crescendo(0.4 * a_on, 1.8 * a_on, PER_S * a_on);
    let begun_s = player.knob.t_s();
    player.knob.hand().follow(script.clone());
    player.run(3.0, |_| {}, |_| {});
    let (mut lag, mut astray_deg) = (0.0_f64, 0.0_f64);
    let (mut is_fingered, mut is_over) = (false, false);
    while player.knob.t_s() - begun_s < script.length_s() {
        let (mut sum_deg, mut periods) = (0.0, 0.0);
        let tick = |knob: &chalumeau_knob::simulator::knob::SimulatedKnob| {
            fingers.feel(knob);
            (sum_deg, periods) = (sum_deg + knob.angle_deg(), periods + 1.0);
            if let Aim::Angle(wanted_deg) = script.at(knob.t_s() - begun_s).aim {
                astray_deg = astray_deg.max((knob.angle_deg() - wanted_deg).abs());
            }
        };
        player.run(STEP_S, tick, |probe| {
            if !is_over {
                ear.hear(probe, closing_pa)
            }
        });
        let angle_deg = sum_deg / periods;
        if !is_fingered && angle_deg > 0.94 * a_on {
            finger(&mut player, note);
            is_fingered = true;
        } else if is_fingered && !is_over {
            let (got, wanted) = (ear.gamma(STEP_S), note.map.pressure_pa(angle_deg) / closing_pa);
            // Not while the breath comes behind the tongue.
            if angle_deg > 0.96 * a_on {
                lag = lag.max((got / wanted - 1.0).abs());
            }
            if got > 1.07 * gamma_felt {
                is_over = true;
                player.rest();
            }
        }
    }
    let felt = match note.feel.law {
        TorqueLaw::Flow => fingers.bump(),
        TorqueLaw::Pressure | TorqueLaw::Free => fingers.step(),
    };
    Passage { felt: felt.expect("a threshold in the torque"), heard: ear.onset(), lag, astray_deg }
}

/// Largest difference between felt and sounding onset, %; 1.25 was measured.
const ONSET_PERCENT: f64 = 1.4;

/// Acceptance of the touch: in a slow crescendo, felt and sounding onset agree within 1.4 % in angle and in pressure, for
/// every note, Contrast and Place 1, 3 and 5, both laws; and every note begins as itself.
#[test]
fn in_a_slow_crescendo_the_sound_begins_where_the_hand_feels_the_threshold() {
    let conditions: Vec<(TorqueLaw, f64, FeelTable)> = LAWS
        .iter()
        .flat_map(|&law| CONTRASTS.map(|contrast| (law, contrast, table(law, contrast))))
        .collect();
    let runs: Vec<(usize, usize)> = (0..conditions.len())
        .flat_map(|condition| (0..conditions[condition].2.notes().len()).map(move |note| (condition, note)))
        .filter(|&(_, note)| MODEL.speaks(note))
        .collect();
    let runs = some(runs, 10);
    let passages = each(&runs, |&(condition, note)| {
        let table = &conditions[condition].2;
        passage(table, &table.notes()[note])
    });
    let closing_pa = Settings::physical().closing_pa();
    let (mut missed, mut worst) = (Vec::new(), [0.0_f64; 7]);
    for (at, (&(condition, index), passage)) in runs.iter().zip(&passages).enumerate() {
        let (law, contrast, ref table) = conditions[condition];
        let (note, felt) = (&table.notes()[index], passage.felt);
        let Some(heard) = passage.heard else {
            println!("{law:?} {contrast} {}: nothing began near {:.1} degrees", note.written, felt.made_deg);
            missed.push(at);
            continue;
        };
        let (heard_deg, noticed_deg) =
            (note.map.angle_deg(heard.gamma * closing_pa), note.map.angle_deg(heard.noticed * closing_pa));
        let in_deg = |felt_deg: f64| 100.0 * (heard_deg / felt_deg - 1.0);
        let in_pa = |felt_deg: f64| 100.0 * (heard.gamma * closing_pa / note.map.pressure_pa(felt_deg) - 1.0);
        let own_hz = MODEL.notes_hz[index];
        let (soft, loud) = (cents(heard.soft_hz, own_hz), cents(heard.loud_hz, own_hz));
        println!(
            "{law:?} {contrast} {}: felt {:.1} (motor {:.1}, plain {:.1}) degrees, heard {heard_deg:.1} = gamma {:.4}: \
             {:+.2} % ({:+.2}) in degrees, {:+.2} % ({:+.2}) in pascals; noticed {:+.1} %; soft {soft:+.0} cents, loud {loud:+.0}; \
             rest {:.2} %",
            note.written,
            felt.commanded_deg,
            felt.made_deg,
            felt.plain_deg,
            heard.gamma,
            in_deg(felt.commanded_deg),
            in_deg(felt.made_deg),
            in_pa(felt.commanded_deg),
            in_pa(felt.made_deg),
            100.0 * (noticed_deg / felt.made_deg - 1.0),
            100.0 * heard.rest,
        );
        let off = [felt.commanded_deg, felt.made_deg].map(|deg| in_deg(deg).abs().max(in_pa(deg).abs()));
        if !(off[0] < ONSET_PERCENT && off[1] < ONSET_PERCENT) {
            missed.push(at);
        }
        // C#4 is known to be 25 cents sharp so softly.
        assert!(soft.abs() < 50.0 && loud.abs() < 50.0, "{}: {soft} {loud}", note.written);
        assert!(passage.lag < 0.003, "{law:?} {contrast} {}: the reed got {}", note.written, passage.lag);
        let plain = in_deg(felt.plain_deg).abs();
        let noticed = 100.0 * (noticed_deg / felt.made_deg - 1.0);
        let pressure_plain = if law == TorqueLaw::Pressure { plain } else { 0.0 };
        let astray = passage.astray_deg;
        let here = [off[0], off[1], pressure_plain, noticed, 100.0 * passage.lag, astray, heard.rest];
        worst.iter_mut().zip(here).for_each(|(worst, here)| *worst = worst.max(here));
    }
    let [commanded, made, plain, late, lag, astray_deg, rest] = worst;
    println!(
        "{} crescendos: heard against felt, worst {commanded:.2} % (commanded), {made:.2} % (motor), {plain:.2} % (pressure \
         law, the motor's steepest rise as it is); noticed up to {late:.1} % late; \
         angle to reed {lag:.2} %, hand astray by {astray_deg:.2} degrees, formula {:.2} %",
        runs.len(),
        100.0 * rest
    );
    assert!(missed.is_empty(), "{} of {} beyond {ONSET_PERCENT} %", missed.len(), runs.len());
    assert!(astray_deg < 2.0, "the hand holds the falling branch, too: {astray_deg}");
}

/// Acceptance: a simulated hand holds gamma 0.5 within 0.02 under both laws, measured at the reed.
#[test]
fn a_hand_holds_gamma_one_half_at_the_reed_under_both_laws() {
    let settings = Settings::physical();
    let closing_pa = settings.closing_pa();
    let mut runs = Vec::new();
    for law in LAWS {
        for contrast in CONTRASTS {
            runs.extend(
                [52, 60, 72, 84, HIGHEST].map(|written| (law, contrast, written, HandDesign::listening())),
            );
        }
        // Softer and stiffer hands, and one that does not listen.
        let soft = [0.1, 0.2, 1.0]
            .map(|stiffness_nm_per_rad| HandDesign { stiffness_nm_per_rad, ..HandDesign::listening() });
        runs.extend(soft.into_iter().chain([HandDesign::default()]).map(|hand| (law, 5.0, HIGHEST, hand)));
    }
    let found = each(&runs, |&(law, contrast, written, hand)| {
        let table = table(law, contrast);
        let note = note(&table, written);
        let mut player = seated(&table, note, &settings, hand);
        let wanted_deg = note.map.angle_deg(0.5 * closing_pa);
        player.knob.hand().aim(Aim::Angle(wanted_deg));
        player.run(6.0, |_| {}, |_| {});
        finger(&mut player, note);
        player.run(0.3, |_| {}, |_| {}); // until the breath has come behind the tongue
        let (mut low, mut high, mut torque, mut angle) = (f64::INFINITY, 0.0_f64, 0.0, 0.0);
        player.run(
            4.0,
            |knob| (torque, angle) = (knob.motor_mnm(), knob.angle_deg()),
            |probe| (low, high) = (low.min(probe.gamma), high.max(probe.gamma)),
        );
        (low, high, torque, angle, wanted_deg)
    });
    let mut worst = 0.0_f64;
    for (&(law, contrast, written, hand), (low, high, torque, angle, wanted_deg)) in runs.iter().zip(found) {
        let listens = hand.correction_per_s > 0.0;
        println!(
            "{law:?} {contrast} {}: gamma {low:.4}..{high:.4} at {angle:.1} degrees ({wanted_deg:.1} wanted) against \
             {:.0} mNm; hand of {} N m/rad, listening: {listens}",
            WrittenNote(written),
            -torque,
            hand.stiffness_nm_per_rad
        );
        assert!(-torque > 20.0, "the knob resists: {torque}");
        if listens {
            worst = worst.max((low - 0.5).abs()).max((high - 0.5).abs());
        } else {
            assert!(high < 0.5, "a deaf hand sags");
        }
    }
    println!("gamma 0.5 +- {worst:.4}");
    assert!(worst <= 0.02, "{worst}");
}

/// What would push the hand or shake is refused before it is sent; sent all the same, the firmware refuses it, says why,
/// and keeps what it had.
#[test]
fn what_would_push_or_shake_is_refused_before_the_wire_and_behind_it() {
    let settings = Settings::physical();
    let table = table(TorqueLaw::Flow, 3.0);
    let note = note(&table, 72);
    let (flow, pressure) = (design(TorqueLaw::Flow, 1.0), design(TorqueLaw::Pressure, 1.0));
    let usual = PlantDesign::default();
    let [thin, thick] = [4e-4, 1e-2].map(|viscous_nms| PlantDesign { viscous_nms, ..usual });
    let (push, shake) = (RefusedCode::WouldPush, RefusedCode::TooStiff);
    for (what, plant, wanted, code) in [
        ("pushes", thick, FeelDesign { strength_mnm: 400.0, travel_deg: 200.0, ..flow }, push),
        ("stiff wall", usual, FeelDesign { wall_mnm_per_deg: 90.0, ..flow }, shake),
        ("stiff origin", usual, FeelDesign { strength_mnm: 200.0, travel_deg: 120.0, ..flow }, shake),
        ("stiff step", thin, FeelDesign { detent_mnm: Some(100.0), travel_deg: 120.0, ..pressure }, shake),
    ] {
        let hand = HandDesign::listening();
        let mut player = LoopPlayer::new(&MODEL, &settings, FEELS.maps(&table), note.feel, hand, plant);
        player.arm(100);
        player.knob.hand().aim(Aim::Angle(2.0 * note.landmarks.a_on_deg));
        player.run(4.0, |_| {}, |_| {});
        let mean_mnm = |player: &mut LoopPlayer| {
            let (mut sum, mut periods) = (0.0, 0.0);
            player.run(2.0, |knob| (sum, periods) = (sum + knob.command_mnm(), periods + 1.0), |_| {});
            sum / periods
        };
        let (before, torque) = (player.knob.feel().0, mean_mnm(&mut player));
        let limits =
            TorqueLimits { ceiling_mnm: f64::INFINITY, ..player.session.info().unwrap().torque_limits(450) };
        let here = FEELS.table(&settings, &wanted, &limits).expect_err(what);
        let is_right = match here {
            FeelRefused::Push { .. } => code == push,
            FeelRefused::Stiffness { .. } => code == shake,
            _ => false,
        };
        assert!(is_right, "{what}: {here}");
        // Somebody sends it all the same.
        player.session.want_feel(FEELS.table(&settings, &wanted, &NO_MOTOR).unwrap().reference().feel);
        player.run(0.5, |_| {}, |_| {});
        let there = player.session.refusal().unwrap_or_default().to_owned();
        println!("{what}: here: {here}; there: {there}");
        assert!(there.contains(code.text()), "{what}: {there}");
        assert_eq!(player.knob.feel(), (before, Some(TorqueLaw::Flow)), "{what}: the feel before stays");
        let now = mean_mnm(&mut player);
        assert!(player.knob.is_armed() && torque < -30.0 && (now - torque).abs() < 1.0, "{torque} {now}");
    }
}

/// Mouth pressure over the closing pressure, and how far the static reed is open, as the hand turns on through closure.
/// A reed of flow A = 0 lets no air through: nothing sounds, and nothing but the pressure moves it.
fn static_reed(
    table: &FeelTable,
    note: &NoteFeel,
    lay: f32,
    from: f64,
    to: f64,
) -> (Fingers, Vec<(f64, f64)>) {
    let settings = Settings {
        reed_a: 0.0,
        noise: 0.0,
        lay,
        breath_full_kpa: BEYOND_CLOSURE_KPA,
        ..Settings::physical()
    };
    let a_close = note.landmarks.a_close_deg;
    let mut player = seated(table, note, &settings, HandDesign::listening());
    let script = crescendo(from * a_close, to * a_close, 0.01 * a_close);
    let seconds = script.length_s();
    player.knob.hand().follow(script);
    player.run(2.5, |_| {}, |_| {});
    finger(&mut player, note);
    player.run(0.5, |_| {}, |_| {});
    let (mut fingers, mut opening, mut every) = (Fingers::default(), Vec::new(), 0_u32);
    player.run(
        seconds - 3.0,
        |knob| fingers.feel(knob),
        |probe| {
            every += 1;
            if every.is_multiple_of(960) {
                opening.push((probe.gamma, probe.opening));
            }
        },
    );
    (fingers, opening)
}

/// Under flow the motor's torque is gone where the resting reed shuts; on the curved lay, which shuts later, a tenth of
/// the opening is left there, as `docs/model.md` says.
#[test]
fn felt_closure_is_where_the_resting_reed_shuts() {
    for (contrast, written) in [(1.0, 52), (3.0, 72), (5.0, 84)] {
        let table = table(TorqueLaw::Flow, contrast);
        let note = note(&table, written);
        let a_close = note.landmarks.a_close_deg;
        let (fingers, opening) = static_reed(&table, note, 0.0, 0.9, 1.12);
        let (commanded, made) = (fingers.commanded(), fingers.made());
        let mean = |from: f64, to: f64| {
            let within: Vec<f64> =
                commanded.iter().filter(|x| (from..to).contains(&(x.0 / a_close))).map(|x| x.1).collect();
            within.iter().sum::<f64>() / within.len() as f64
        };
        // What is left beyond closure is friction against the turning; before it torque falls on a line.
        let friction = mean(1.02, 1.10);
        let falling: Vec<&(f64, f64)> =
            commanded.iter().filter(|x| (0.93..0.99).contains(&(x.0 / a_close))).collect();
        let rows: Vec<[f64; 3]> =
            falling.iter().map(|x| x.0 / a_close - 1.0).map(|e| [1.0, e, e * e]).collect();
        let torques: Vec<f64> = falling.iter().map(|x| x.1 - friction).collect();
        let ([t0, t1, _], _) = least_squares(&rows, &torques).unwrap();
        let felt_close = a_close * (1.0 - t0 / t1);
        let shut = opening.iter().find(|x| x.1 <= 0.0).unwrap().0;
        let closing_pa = Settings::physical().closing_pa();
        let shut_deg = note.map.angle_deg(shut * closing_pa);
        println!(
            "Contrast {contrast} {}: torque gone at {felt_close:.1} degrees, reed shut at {shut_deg:.1} (gamma {shut:.4}); \
             friction {friction:.2} mNm",
            note.written
        );
        assert!((felt_close / shut_deg - 1.0).abs() < 0.01, "{felt_close} {shut_deg}");
        assert!(opening.iter().all(|x| if x.0 < 0.995 { x.1 > 0.0 } else { x.0 < 1.005 || x.1 == 0.0 }));
        assert!(friction.abs() < 1.5, "friction alone: {friction}");
        // The motor rests, but for that friction, of which it makes whole counts now and then.
        let beyond: Vec<f64> = made.iter().filter(|x| x.0 > 1.02 * a_close).map(|x| x.1).collect();
        let rest = beyond.iter().sum::<f64>() / beyond.len() as f64;
        assert!((rest - friction).abs() < 0.1, "the motor makes {rest} mNm");
        // The curved lay of the standard clarinet.
        let lay = Settings::physical().lay;
        let (_, curved) = static_reed(&table, note, lay, 0.98, 1.14);
        let at = curved.iter().min_by(|a, b| (a.0 - 1.0).abs().total_cmp(&(b.0 - 1.0).abs())).unwrap();
        println!("  lay {lay}: open by {:.3} at gamma {:.3}", at.1, at.0);
        assert!((at.1 - f64::from(lay) / 4.0).abs() < 0.01, "{at:?}");
    }
}

/// A tongue lets go of a reed that the breath holds shut: nothing sounds, nothing is felt.
#[test]
fn tongued_beyond_closure_a_reed_on_a_sharp_lay_stays_shut_and_the_motor_at_rest() {
    let settings = Settings { lay: 0.0, breath_full_kpa: BEYOND_CLOSURE_KPA, ..Settings::physical() };
    let table = table(TorqueLaw::Flow, 3.0);
    for written in [52, 72, 84] {
        let note = note(&table, written);
        let mut player = seated(&table, note, &settings, HandDesign::listening());
        player.knob.hand().aim(Aim::Angle(1.07 * note.landmarks.a_close_deg));
        player.run(5.0, |_| {}, |_| {});
        finger(&mut player, note);
        player.run(0.3, |_| {}, |_| {});
        let (mut widest, mut loudest, mut torque, mut gamma) = (0.0_f64, 0.0_f64, Vec::new(), 0.0);
        player.run(
            2.0,
            |knob| torque.push(knob.motor_mnm()),
            |probe| {
                (widest, loudest) = (widest.max(probe.opening), loudest.max(probe.p_radiated_pa.abs()));
                gamma = probe.gamma;
            },
        );
        println!("{}: gamma {gamma:.3}, opening {widest}, {loudest:.1e} Pa at 1 m", note.written);
        assert!(gamma > 1.02 && widest == 0.0, "{gamma} {widest}");
        // Damping against the tremor, in whole counts now and then.
        let mean = torque.iter().sum::<f64>() / torque.len() as f64;
        assert!(mean.abs() < 0.1 && torque.iter().all(|mnm| mnm.abs() < 5.0), "{mean} mNm");
        assert!(loudest < 1e-3, "{loudest}");
    }
}
