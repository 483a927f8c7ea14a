//! Bends: whether the pitch arrives, in the register it began in, without a click, and what folds back when the whole
//! instrument is an octave higher. Figures are printed (`--nocapture`) to be quoted.

#[path = "support/parallel.rs"]
mod parallel;

use std::sync::{Arc, LazyLock};

use chalumeau::analysis::pitch;
use chalumeau::analysis::spectrum;
use chalumeau::analysis::to_f64;
use chalumeau::event::Event;
use chalumeau::instrument::bend::LIP_CENTS;
use chalumeau::instrument::{Clarinet, Model, Settings};
use chalumeau::units::WrittenNote;
use chalumeau::units::cents;
use parallel::each;

const RATE_HZ: f64 = 48_000.0;

static MODEL: LazyLock<Arc<Model>> = LazyLock::new(|| Arc::new(Model::built_in(RATE_HZ).unwrap()));

/// A note blown at a constant gamma, without noise.
fn blown(written: u8, gamma: f32) -> Clarinet {
    blown_at(RATE_HZ, &MODEL, written, gamma, &Settings { noise: 0.0, ..Settings::default() })
}

fn blown_at(rate_hz: f64, model: &Arc<Model>, written: u8, gamma: f32, settings: &Settings) -> Clarinet {
    let mut clarinet = Clarinet::new(model.clone(), rate_hz);
    clarinet.set_settings(settings);
    clarinet.apply(Event::Breath(gamma * 6.0 / settings.breath_full_kpa));
    let note = WrittenNote(written).sounding(model.file.transposition).unwrap();
    clarinet.apply(Event::NoteOn { note, velocity: 0.7 });
    clarinet
}

fn render(clarinet: &mut Clarinet, seconds: f64) -> Vec<f64> {
    let mut out = vec![0.0; (seconds * RATE_HZ) as usize];
    clarinet.render(&mut out);
    to_f64(&out)
}

/// Turns the wheel from one offset to another within `seconds` (0 at once), a message every 32 samples.
fn turn(clarinet: &mut Clarinet, from_cents: f64, to_cents: f64, seconds: f64) -> Vec<f64> {
    let messages = (seconds * RATE_HZ / 32.0) as usize;
    let mut sound = Vec::new();
    for message in 1..=messages {
        let way = message as f64 / messages as f64;
        clarinet.apply(Event::Bend { cents: (from_cents + way * (to_cents - from_cents)) as f32 });
        sound.extend(render(clarinet, 32.5 / RATE_HZ));
    }
    clarinet.apply(Event::Bend { cents: to_cents as f32 });
    sound
}

fn hz(sound: &[f64]) -> f64 {
    pitch::fundamental_hz(sound, RATE_HZ).unwrap_or(f64::NAN)
}

/// Largest step between two samples, and largest change of that step.
fn edges(sound: &[f64]) -> [f64; 2] {
    let largest = |edges: &mut dyn Iterator<Item = f64>| edges.fold(0.0, |most: f64, edge| most.max(edge.abs()));
    [
        largest(&mut sound.windows(2).map(|pair| pair[1] - pair[0])),
        largest(&mut sound.windows(3).map(|three| three[2] - 2.0 * three[1] + three[0])),
    ]
}

/// What became of one sweep up or down and back.
#[derive(Debug)]
struct Swept {
    written: u8,
    gamma: f32,
    bend_cents: f64,
    seconds: f64,
    /// Where the bent note is from where it should be, cents; NaN for none.
    off_cents: f64,
    /// The same after the way back.
    back_cents: f64,
    /// Largest edge on the way over the largest of the two steady notes, steps and their changes.
    edges: [f64; 2],
}

fn sweep(&(written, gamma, bend_cents, seconds): &(u8, f32, f64, f64)) -> Swept {
    let mut clarinet = blown(written, gamma);
    render(&mut clarinet, 0.6);
    let before = render(&mut clarinet, 0.2);
    let mut up = before[before.len() - 2..].to_vec();
    up.extend(turn(&mut clarinet, 0.0, bend_cents, seconds));
    up.extend(render(&mut clarinet, 0.15));
    let bent = render(&mut clarinet, 0.2);
    let mut down = bent[bent.len() - 2..].to_vec();
    down.extend(turn(&mut clarinet, bend_cents, 0.0, seconds));
    down.extend(render(&mut clarinet, 0.25));
    let after = render(&mut clarinet, 0.2);
    assert_eq!(clarinet.resets(), 0);
    let steady = [&before, &bent, &after].map(|sound| edges(sound));
    let largest = |kind: usize| steady.iter().fold(0.0, |most: f64, edges| most.max(edges[kind]));
    let moving = [edges(&up), edges(&down)];
    let edges = [0, 1].map(|kind| moving[0][kind].max(moving[1][kind]) / largest(kind));
    Swept {
        written,
        gamma,
        bend_cents,
        seconds,
        off_cents: cents(hz(&bent), hz(&before)) - bend_cents,
        back_cents: cents(hz(&after), hz(&before)),
        edges,
    }
}

fn sweeps(bends: &[f64], seconds: &[f64]) -> Vec<Swept> {
    let mut runs = Vec::new();
    for written in 52..=91 {
        for gamma in [0.5, 0.7] {
            for &bend in bends {
                runs.extend(seconds.iter().map(|&seconds| (written, gamma, bend, seconds)));
            }
        }
    }
    each(&runs, sweep)
}

/// A note that is more than this from where it should be has changed its register.
const LOST_CENTS: f64 = 60.0;

/// Prints what is to be known of some sweeps; asserts that none clicks. Gives the notes lost.
fn judge(what: &str, swept: &[Swept]) -> Vec<u8> {
    let lost = |s: &&Swept| !(s.off_cents.abs() < LOST_CENTS && s.back_cents.abs() < LOST_CENTS);
    let mut notes: Vec<u8> = swept.iter().filter(lost).map(|s| s.written).collect();
    notes.dedup();
    for s in swept.iter().filter(lost) {
        println!("{what}: lost {s:.1?}");
    }
    let kept = || swept.iter().filter(|s| !lost(s));
    let most = |of: &dyn Fn(&Swept) -> f64| kept().map(of).fold(0.0, f64::max);
    let mean = kept().map(|s| s.off_cents.abs()).sum::<f64>() / kept().count() as f64;
    println!(
        "{what}: {} sweeps, notes lost {notes:?}; off by {:.2} cents at most, {mean:.2} in the mean; back {:.2}; \
         steps {:.2}, their changes {:.2} of the steady notes'",
        swept.len(),
        most(&|s| s.off_cents.abs()),
        most(&|s| s.back_cents.abs()),
        most(&|s| s.edges[0]),
        most(&|s| s.edges[1]),
    );
    let clicks: Vec<_> = swept.iter().filter(|s| !lost(s) && s.edges[0].max(s.edges[1]) > 1.5).collect();
    for s in &clicks {
        println!("{what}: click {s:.2?}");
    }
    assert!(clicks.is_empty(), "{} clicks", clicks.len());
    notes
}

#[test]
fn two_semitones_arrive_in_their_register_without_a_click() {
    for seconds in [0.0, 0.1, 1.0] {
        let lost = judge(&format!("+-200 cents in {seconds} s"), &sweeps(&[200.0, -200.0], &[seconds]));
        assert!(lost.len() <= 2, "at least 95 % of 40 notes keep their register: {lost:?}");
    }
}

#[test]
fn an_octave_arrives_in_its_register_without_a_click() {
    for seconds in [0.0, 0.1, 1.0] {
        let lost = judge(&format!("+-1200 cents in {seconds} s"), &sweeps(&[1200.0, -1200.0], &[seconds]));
        assert!(lost.len() <= 2, "at least 95 % of 40 notes keep their register: {lost:?}");
    }
}
