//! The example melody through the bundled plugin: sound, a picture, a table, and whether it is the renderer's sound.

use std::convert::Infallible;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use chalumeau_core::instrument::concert_pitch::A4_HZ;
use chalumeau_core::instrument::{Clarinet, KeyNotes};
use chalumeau_core::measure::notes::{MeasuredNote, NoteMeter, Spread, spread};
use chalumeau_core::score;
use chalumeau_core::score::NoteSpan;
use chalumeau_core::score::Score;

use chalumeau_test_host::clap::{At, Plugin};
use chalumeau_test_host::{artefacts, machine, midi};

use crate::{picture, touch_demo};

const RATE: u32 = 48_000;
const BLOCK: usize = 512;
/// Time for the last note to die away, s.
const TAIL_S: f64 = 1.0;
/// A B flat clarinet sounds two semitones lower than written.
const TRANSPOSITION: i8 = 2;

/// `cargo xtask demo`, with plugin and simulated knob built.
pub fn run(_: &[String]) -> Result<()> {
    let file = machine::root().join("examples/melody.mid");
    let bytes = std::fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
    let score = score::midi_file::read(&bytes, RATE)?.with_tail(TAIL_S, RATE);
    let said = midi::messages(&bytes, RATE)?;

    let clap = artefacts::clap()?;
    println!("\nplaying {} through {}", shown(&file), shown(&clap));
    let started = Instant::now();
    let mut plugin = Plugin::load(&clap)?;
    let [left, right] = plugin.play(f64::from(RATE), BLOCK, &said, score.samples)?;
    let took = started.elapsed().as_secs_f64();
    let seconds = score.seconds(RATE);
    println!("{seconds:.1} s of music in {took:.2} s, {:.0} times real time on one core", seconds / took);

    let rendered = rendered(&score)?;
    println!("{}", comparison(&left, &right, &rendered));

    let folder = machine::target().join("demo");
    std::fs::create_dir_all(&folder)?;
    let (wav, png) = (folder.join("melody.wav"), folder.join("melody.png"));
    write_wav(&wav, &left, &right)?;

    println!("\n{}", table(&left, &score));
    picture::write(&png, &left, f64::from(RATE), &score, A4_HZ)?;

    println!("sound    {}\npicture  {}\n", shown(&wav), shown(&png));
    by_knob(&clap, &folder, &score, &said)?;
    let page = folder.join("tour.html");
    let mut tour = Command::new(artefacts::program()?);
    machine::run(tour.args(["report", "--tour", "--force", "--out"]).arg(&page))?;
    println!("page to listen to    {}\n", shown(&page));
    Ok(())
}

/// The same melody once more, its breath from a hand on the simulated knob.
fn by_knob(clap: &Path, folder: &Path, score: &Score, said: &[At]) -> Result<()> {
    println!("playing it again, {:.0} s, blown by a simulated hand on a simulated knob", score.seconds(RATE));
    let performance = touch_demo::play(clap, folder, score, said, RATE)?;
    let (wav, png) = (folder.join("touch.wav"), folder.join("touch.png"));
    write_wav(&wav, &performance.left, &performance.left)?;
    println!("\n{}", table(&performance.left, score));
    picture::write_touch(&png, &performance, f64::from(RATE))?;
    println!("sound    {}\npicture  {}\n", shown(&wav), shown(&png));
    Ok(())
}

fn rendered(score: &Score) -> Result<Vec<f32>> {
    let mut clarinet = Clarinet::built_in(f64::from(RATE)).map_err(|reason| anyhow::anyhow!("{reason}"))?;
    let mut all = Vec::with_capacity(score.samples);
    let done = score::play(&mut clarinet, score, BLOCK, |block| {
        all.extend_from_slice(block);
        Ok::<_, Infallible>(())
    });
    match done {
        Ok(()) => Ok(all),
    }
}

fn comparison(left: &[f32], right: &[f32], rendered: &[f32]) -> String {
    let equal =
        |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    if equal(left, rendered) && equal(right, rendered) {
        return format!("the offline renderer makes the same {} samples, bit for bit", rendered.len());
    }
    let apart = left.iter().zip(rendered).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let first = left.iter().zip(rendered).position(|(a, b)| a.to_bits() != b.to_bits());
    format!("NOT the offline renderer's samples: first difference at {first:?}, largest {apart:e}")
}

fn table(samples: &[f32], score: &Score) -> String {
    let mut listener = NoteMeter::new(score.note_spans(&KeyNotes::default()), f64::from(RATE), A4_HZ, 0.0);
    listener.hear(samples);
    let heard = listener.finish();
    let mut text = "   at   sounds  written   length       Hz    cents   level\n".to_owned();
    for MeasuredNote { span: NoteSpan { note, from, to }, hz, cents, level_dbfs } in &heard {
        let written = note.written(TRANSPOSITION).map_or_else(String::new, |written| written.to_string());
        let (at_s, length_s) = (*from as f64 / f64::from(RATE), (to - from) as f64 / f64::from(RATE));
        text += &format!("{at_s:5.2}   {:>6}  {written:>7}  {length_s:5.2} s", note.to_string());
        match hz.zip(*cents) {
            Some((hz, cents)) => text += &format!("  {hz:7.2}  {cents:+7.1}"),
            None => text += "   no pitch        ",
        }
        text += &format!("  {level_dbfs:6.1}\n");
    }
    let Some(Spread { count, own, others }) = spread(&heard) else {
        return text + "no note has a pitch\n";
    };
    text += &format!("{count} of {} notes have a pitch", heard.len());
    if let Some((mean, largest)) = own {
        text += &format!(
            "; from equal temperament at A4 = {A4_HZ} Hz: mean {mean:.1} cents, largest {largest:+.1}"
        );
    }
    if let Some((others, off)) = others {
        text += &format!("; other notes than written: {others}, up to {off:+.1} cents off");
    }
    text + "\n"
}

fn write_wav(path: &Path, left: &[f32], right: &[f32]) -> Result<()> {
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: RATE,
        bits_per_sample: 32,
        sample_format: hound::SampleFormat::Float,
    };
    let mut wav = hound::WavWriter::create(path, spec)?;
    for (&l, &r) in left.iter().zip(right) {
        wav.write_sample(l)?;
        wav.write_sample(r)?;
    }
    Ok(wav.finalize()?)
}

/// A path as one would type it from here.
fn shown(path: &Path) -> String {
    path.strip_prefix(machine::root()).unwrap_or(path).display().to_string()
}
