//! What the standalone and the plugin in hosts show under Wine: a picture of each window is kept, and the window is closed.

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use chalumeau_test_host::screen::Screen;

use super::{CARGO, Wine};
use crate::cross::folder;
use crate::machine;

/// How long a window is looked at after something is seen, until it has drawn all.
const LOOK: Duration = Duration::from_secs(3);
/// A note that sounds changes at least so many of a window's 792,000 pixels: meter, breath, holes and the line of the last
/// 10 s. It was 60,000.
const PIXELS_OF_A_NOTE: usize = 10_000;
/// How long a program may take to end once its window is closed.
const PATIENCE: Duration = Duration::from_secs(30);
/// A window that has drawn itself has more colours than its background, its frame and a line of text.
const DRAWN_COLOURS: usize = 200;

/// Opens each window and keeps its picture.
pub fn look(wine: &Wine) -> Result<()> {
    let screen = Screen::open(Some(wine.display.name()))?;
    let built = wine.runner.built;
    let mut alone = wine.runner.command(built.file("chalumeau-standalone")?)?;
    window(&screen, alone.args(["--backend", "dummy"]), "Chalumeau", "standalone", false)?;
    for (test, title, name) in [("the_clap", "The CLAP", "clap"), ("the_vst3", "The VST3", "vst3")] {
        let mut host = wine.runner.command(built.file("window_on_windows")?)?;
        host.args(["--ignored", "--exact", test, "--test-threads=1", "--nocapture"]);
        window(&screen, &mut host, title, name, true)?;
    }
    Ok(())
}

/// Starts a program, keeps a picture of its window as `NAME.png`, closes the window and waits for the program's end. Where a
/// note sounds, the window must show it.
fn window(screen: &Screen, command: &mut Command, title: &str, name: &str, sounds: bool) -> Result<()> {
    let described = machine::described(command);
    let mut running = command.spawn().with_context(|| format!("cannot start `{described}`"))?;
    let seen = screen.titled(title).and_then(|window| {
        let first = screen.drawn(window)?;
        if sounds {
            screen.wait("a picture of the note that sounds", || {
                Ok((screen.picture(window)?.differing(&first) >= PIXELS_OF_A_NOTE).then_some(()))
            })?;
        }
        thread::sleep(LOOK);
        let picture = screen.picture(window)?;
        screen.ask_to_close(window)?;
        Ok(picture)
    });
    let began = Instant::now();
    while seen.is_ok() && running.try_wait()?.is_none() && began.elapsed() < PATIENCE {
        thread::sleep(Duration::from_millis(20));
    }
    let ended = running.try_wait()?;
    if ended.is_none() {
        machine::terminate(&mut running)?;
    }
    let picture = seen.with_context(|| format!("no window of `{described}` is seen"))?;
    let path = folder(CARGO.system).join("pictures").join(format!("{name}.png"));
    picture.write(Path::new(&path))?;
    let (width, height, colours) = (picture.width, picture.height, picture.colours());
    println!("{}: {width} x {height}, {colours} colours", path.display());
    ensure!(colours >= DRAWN_COLOURS, "the window of `{described}` has only {colours} colours");
    let ended = ended.with_context(|| format!("`{described}` did not end with its window"))?;
    ensure!(ended.success(), "`{described}` ended with {ended}");
    Ok(())
}
