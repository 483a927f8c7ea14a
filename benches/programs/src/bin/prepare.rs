//! Prepares an instrument from scratch and prints what that took: the program to measure the fit and the tuner with.
//!
//! `cargo run --release -p chalumeau-benches --bin prepare -- [FILE.toml|b-flat] [RATE] [all|fit|plays]`
//!
//! CPU time is that of all threads, where Linux tells it. The checksum is of the prepared instrument: equal sums are equal bits. `plays`
//! takes the instrument that comes with the program, untuned, and tunes its lowest eight notes: short enough to count instructions of.

use std::error::Error;
use std::ops::ControlFlow;
use std::time::Instant;

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::prepare::auto_tune::{self, Accuracy};
use chalumeau_core::instrument::prepare::{
    Preparation, PreparedInstrument, Progress, format_generated, play_dynamics,
};
use chalumeau_core::instrument::{Model, Wanted};

/// CPU time of this process so far, s.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = text
        .rsplit(") ")
        .next()
        .unwrap_or_default()
        .split(' ')
        .filter_map(|field| field.parse().ok())
        .collect();
    // User and system time, in ticks of 10 ms: fields 14 and 15, of which this list leaves out the first three.
    fields.get(10..12).map_or(f64::NAN, |times| 0.01 * (times[0] + times[1]))
}

fn sum(model: &Model) -> Result<u64, Box<dyn Error>> {
    let text = format_generated(vec![PreparedInstrument::of(model)])?;
    Ok(text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "b-flat".to_owned());
    let rate_hz: f64 = arguments.next().as_deref().unwrap_or("48000").parse()?;
    let what = arguments.next().unwrap_or_default();
    let file = match Bundled::named(&name) {
        Some(bundled) => bundled.file(),
        None => InstrumentFile::parse(&std::fs::read_to_string(&name)?)?,
    };
    let wanted = Wanted::new(file, rate_hz);
    let (begun, cpu) = (Instant::now(), cpu_s());
    if what == "plays" {
        let model = Preparation::new(&wanted, None).ready()?.ok_or("comes not with the program")?;
        let notes: Vec<usize> = (0..8).collect();
        let on = &mut |_| ControlFlow::Continue(());
        let tuning = auto_tune::tune_again(&model, &notes, Accuracy::QUICK, on).ok_or("ended")?;
        let model = Model { tuning, ..model };
        let tuning = play_dynamics::learn_again(&model, &notes, Accuracy::QUICK, on).ok_or("ended")?;
        println!(
            "{name} {rate_hz} tuned cpu_s {:.2} sum {:016x}",
            cpu_s() - cpu,
            sum(&Model { tuning, ..model })?
        );
        return Ok(());
    }
    let (mut fitted_s, mut shares) = (Vec::new(), Vec::new());
    let model = Preparation::from_scratch(&wanted).tuned(&mut |progress| {
        match progress {
            Progress::Fitted(_) => fitted_s.push((cpu_s() - cpu, begun.elapsed().as_secs_f64())),
            Progress::Tuning(share) => shares.push((share, cpu_s() - cpu)),
            Progress::Fitting(_) => {}
        }
        if what == "fit" && !fitted_s.is_empty() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    for (cpu_s, real_s) in &fitted_s {
        println!("{name} {rate_hz} fitted cpu_s {cpu_s:.2} real_s {real_s:.2}");
    }
    if what == "fit" {
        return Ok(());
    }
    for least in [0.05, 0.6] {
        let at =
            shares.iter().filter(|(share, _)| *share <= least).map(|(_, cpu_s)| *cpu_s).fold(0.0, f64::max);
        println!("{name} {rate_hz} share {least} cpu_s {at:.2}");
    }
    let sum = sum(&model?)?;
    println!(
        "{name} {rate_hz} tuned cpu_s {:.2} real_s {:.2} sum {sum:016x}",
        cpu_s() - cpu,
        begun.elapsed().as_secs_f64()
    );
    Ok(())
}
