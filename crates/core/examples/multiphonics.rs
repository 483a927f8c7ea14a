//! Finds multiphonics of the built-in clarinet by playing the finder's candidates, and prints `data/multiphonics.toml`. Minutes.
//!
//! `cargo run --release -p chalumeau-core --features threads --example multiphonics > new.toml`

use std::ops::ControlFlow;
use std::sync::Arc;

use chalumeau_core::bore::fingering_finder::FingeringFinder;
use chalumeau_core::instrument::Model;
use chalumeau_core::measure::multiphonics::{built_in, is_multiphonic, play};
use chalumeau_core::parallel;
use chalumeau_core::units::{Air, SoundingNote};

/// Candidates that are played.
const CANDIDATES: usize = 2_000;
/// Breaths at which each is tried, from soft to loud.
const BREATHS: [f32; 9] = [0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.8, 0.9];
/// Sounding notes whose lips are tried lie here, up to written E flat 6: above, the lip favours one mode.
const HELD: [u8; 2] = [50, 85];

/// Open holes, the note that is held, and the breaths to try.
struct Try {
    fingers: String,
    open: u64,
    held: u8,
    breaths: Vec<f32>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Arc::new(Model::built_in(48_000.0)?);
    let holes = &model.file.holes;
    let go_on = &mut |_| ControlFlow::Continue(());
    // Those that are known, then the finder's.
    let bits = |names: &str| {
        let known = names.split_whitespace().filter_map(|name| model.file.hole(name));
        known.fold(0_u64, |bits, hole| bits | 1 << hole)
    };
    let known = built_in().iter().map(|one| Try {
        fingers: one.fingers.clone(),
        open: bits(&one.open),
        held: one.held.min(HELD[1]),
        breaths: [one.breath].into_iter().chain(BREATHS).collect(),
    });
    let finder = FingeringFinder::new(&model.file, Air::default(), 440.0, go_on).ok_or("ended")?;
    let new = finder.multiphonics(CANDIDATES).into_iter().flat_map(|one| {
        // The lips of the two notes that may sound.
        one.f_hz.map(|hz| {
            let held = (69.0 + 12.0 * (hz / 440.0).log2()).round() as u8;
            let held = held.clamp(HELD[0], HELD[1]);
            Try { fingers: one.fingers.clone(), open: one.grip.open, held, breaths: BREATHS.to_vec() }
        })
    });
    let tries: Vec<Try> = known.chain(new).collect();
    // Each breath from silence, as the test plays it.
    let heard = |at: usize| {
        let Try { open, held, breaths, .. } = &tries[at];
        let mut each = breaths.iter().map(|&breath| {
            let partials = play(&model, SoundingNote(*held), *open, &[breath]).pop().unwrap_or_default();
            (breath, partials)
        });
        each.find(|(_, partials)| is_multiphonic(partials))
    };
    let heard = parallel::each(tries.len(), heard, go_on).ok_or("ended")?;
    println!(
        "# Multiphonics of the built-in B flat clarinet: fingerings on which the voice sounds two notes at once."
    );
    println!("# Made by: cargo run --release -p chalumeau-core --features threads --example multiphonics");
    println!(
        "# It plays those that stand here and the finder's candidates, and keeps what sounds (measure/multiphonics.rs)."
    );
    let mut done = Vec::new();
    for (one, heard) in tries.iter().zip(heard) {
        // The first way in which a fingering sounds is enough.
        let Some((breath, partials)) = heard.filter(|_| !done.contains(&one.open)) else { continue };
        done.push(one.open);
        let open = holes.iter().enumerate().filter(|(hole, _)| one.open >> hole & 1 == 1);
        let open: Vec<&str> = open.map(|(_, hole)| hole.name.as_str()).collect();
        let hz: Vec<String> = partials.iter().map(|partial| format!("{:.1}", partial.hz)).collect();
        println!("\n[[multiphonic]]\nfingers = {:?}\nopen = {:?}", one.fingers, open.join(" "));
        println!("held = {}\nbreath = {breath}\npartials_hz = [{}]", one.held, hz.join(", "));
    }
    Ok(())
}
