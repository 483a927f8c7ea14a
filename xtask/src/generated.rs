//! Files the repository carries that are made from others: how to make them, and how to see that they still fit.

use std::fs;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use chalumeau::bore::instrument_file::InstrumentFile;
use chalumeau::instrument::Wanted;
use chalumeau::instrument::held::HeldNote;
use chalumeau::instrument::model::{INTERNAL_RATES_HZ, Model};
use chalumeau::instrument::prepare::{self, Prepared};
use chalumeau::instrument::tuner;
use chalumeau::instrument::tuning::{GAMMA_NODES, NATURAL_GAMMA};
use chalumeau::reed::{ReedTables, header};
use chalumeau::units::cents;

const HEADER: &str = "firmware/include/pressure_table_values.h";
const PREPARED: &str = "data/b_flat_clarinet.prepared.toml";
/// A refit may differ by this share of a radius: rounding of another processor, not another bore.
const RADIUS_TOLERANCE: f64 = 2e-3;
/// How far a played note may be from its pitch when a committed trim is checked, cents.
const CENTS_TOLERANCE: f64 = 0.5;
/// Highest written note that is tuned and checked; above it fingerings are unreliable.
const HIGHEST_WRITTEN: u8 = 92;

fn checking(args: &[String]) -> Result<bool> {
    match args {
        [] => Ok(false),
        [flag] if flag == "--check" => Ok(true),
        _ => bail!("takes nothing or --check, got {args:?}"),
    }
}

fn write(path: &str, text: &str) -> Result<()> {
    if let Some(folder) = Path::new(path).parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    fs::write(path, text).with_context(|| format!("cannot write {path}"))?;
    println!("wrote {path}");
    Ok(())
}

fn read(path: &str) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {path}"))
}

/// The reed tables as the firmware's header; checked byte for byte.
pub fn firmware_header(args: &[String]) -> Result<()> {
    let text = header::pressure_table_values(ReedTables::seed());
    if !checking(args)? {
        return write(HEADER, &text);
    }
    ensure!(read(HEADER)? == text, "{HEADER} is not what the tables give; run `cargo xtask firmware-header`");
    println!("{HEADER} is what the tables give");
    Ok(())
}

/// The built-in bore's cells at both internal rates, still untuned; checked by fitting again.
pub fn fit_bore(args: &[String]) -> Result<()> {
    let check = checking(args)?;
    let fitted = INTERNAL_RATES_HZ
        .iter()
        .map(|&rate_hz| {
            prepare::fitted(&Wanted::new(InstrumentFile::built_in(), rate_hz), &mut |_| {
                ControlFlow::Continue(())
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    if !check {
        return write(PREPARED, &prepare::format_shipped(fitted.iter().map(Prepared::of).collect())?);
    }
    let kept = prepare::parse_shipped(&read(PREPARED)?)?;
    ensure!(kept.len() == fitted.len(), "{PREPARED} holds {} rates, not {}", kept.len(), fitted.len());
    for (kept, fitted) in kept.iter().map(|kept| &kept.cells).zip(fitted.iter().map(|model| &model.cells)) {
        let ticks =
            |cells: &chalumeau::bore::cells::Cells| cells.cells.iter().map(|c| c.ticks).collect::<Vec<_>>();
        ensure!(ticks(kept) == ticks(fitted), "{PREPARED}: the grid at {} Hz has moved", kept.rate_hz);
        let radii = kept.cells.iter().zip(&fitted.cells).map(|(a, b)| (a.radius_m, b.radius_m));
        let worst = radii
            .chain([(kept.end_radius_m, fitted.end_radius_m)])
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold(0.0, f64::max);
        println!("{} Hz: a new fit differs by {worst:.1e} of a radius at most", kept.rate_hz);
        ensure!(
            worst < RADIUS_TOLERANCE,
            "{PREPARED} at {} Hz no longer fits; run `cargo xtask fit-bore`",
            kept.rate_hz
        );
    }
    Ok(())
}

/// Delay trims of every note at both internal rates; checked by playing each note with its trims.
pub fn tune(args: &[String]) -> Result<()> {
    let check = checking(args)?;
    let mut tuned = Vec::new();
    for rate_hz in INTERNAL_RATES_HZ {
        let model = Model::built_in(rate_hz)?;
        if check {
            check_tuning(&model)?;
        } else {
            let terminal = std::io::stderr().is_terminal();
            let offsets =
                tuner::offsets(&model, &mut |_| ControlFlow::Continue(())).context("not cancelled")?;
            let tuning = tuner::tune(&model, &offsets, &mut |share| {
                if terminal {
                    eprint!("\r{rate_hz} Hz: {:3.0} %{}", 100.0 * share, if share < 1.0 { "" } else { "\n" });
                }
                ControlFlow::Continue(())
            });
            let tuning = tuning.context("not cancelled")?;
            tuned.push(Prepared::of(&Model { tuning, ..model }));
        }
    }
    if check { Ok(()) } else { write(PREPARED, &prepare::format_shipped(tuned)?) }
}

fn check_tuning(model: &Model) -> Result<()> {
    let mut worst = (0.0_f64, String::new());
    for (index, fingering) in model.file.fingerings.iter().enumerate() {
        if fingering.written.0 > HIGHEST_WRITTEN {
            continue;
        }
        let note = model.tuning.notes[index];
        let trims = GAMMA_NODES.into_iter().zip(note.tempered).chain([(NATURAL_GAMMA, note.natural)]);
        for (gamma, rows) in trims {
            let held = HeldNote { rows, ..HeldNote::new(model, index, gamma) };
            let name = || format!("written {} at gamma {gamma}", fingering.written);
            let hz = tuner::heard_hz(model, &held, model.notes_hz[index])
                .with_context(|| format!("{PREPARED}: {} does not sound in its register", name()))?;
            let off = cents(hz, model.notes_hz[index]);
            if off.abs() > worst.0.abs() {
                worst = (off, name());
            }
        }
    }
    println!("{} Hz: worst trim {:+.2} cents ({})", model.coeffs.rate_hz, worst.0, worst.1);
    ensure!(worst.0.abs() < CENTS_TOLERANCE, "{PREPARED} is out of tune; run `cargo xtask tune`");
    Ok(())
}
