//! The bundled VST3's window in Ardour, a host of musicians. Ardour's own Lua writes a session with the plugin on a track;
//! told to show its window, Ardour opens it on a display that nobody sees and sounds through a JACK without a sound card.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::artefacts;
use crate::display::Display;
use crate::jack::JackServer;
use crate::machine::{self, ARDOUR, JACKD};
use crate::screen::Screen;

/// As Ardour titles a plugin's window: track, plugin, maker, format.
const TITLE: &str = "Clarinet: Chalumeau (by Chalumeau) [VST3]";
/// As baseview titles the window within.
const INSIDE: &str = "Chalumeau";

/// The engine Ardour is to start, without asking.
const CONFIG: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Ardour>
  <Config>
    <Option name="try-autostart-engine" value="1"/>
  </Config>
  <Extra>
    <AudioMIDISetup>
      <EngineStates>
        <State backend="JACK" driver="" device="" input-device="" output-device="" sample-rate="48000" buffer-size="1024" n-periods="2" input-latency="0" output-latency="0" lm-input="" lm-output="" active="1" use-buffered-io="0" midi-option="" lru="1"/>
      </EngineStates>
    </AudioMIDISetup>
  </Extra>
</Ardour>
"#;

/// A session with the plugin on a track.
const SESSION: &str = r#"
AudioEngine:set_backend("None (Dummy)", "check", "")
local session = create_session("SESSION", "s", 48000)
assert(session, "no session")
local plugin = ARDOUR.LuaAPI.new_plugin_info("Chalumeau", ARDOUR.PluginType.VST3)
assert(not plugin:isnil(), "Ardour does not know the plugin")
local midi = ARDOUR.ChanCount(ARDOUR.DataType("midi"), 1)
local stereo = ARDOUR.ChanCount(ARDOUR.DataType("audio"), 2)
local order, mode = ARDOUR.PresentationInfo.max_order, ARDOUR.TrackMode.Normal
session:new_midi_track(midi, stereo, true, plugin, nil, nil, 1, "Clarinet", order, mode, true)
session:save_state("")
close_session()
quit()
"#;

/// Opens the plugin's window in Ardour and plays a key of it; keeps pictures in `target/screenshots`.
pub fn test() -> Result<()> {
    machine::provide(&[&ARDOUR, &JACKD])?;
    let ardour = Ardour::new(artefacts::vst3()?)?;
    let session = ardour.session()?;
    let (display, server) = (Display::start()?, JackServer::start()?);
    let mut command = ardour.command(Path::new("ardour"));
    let log = ardour.home.join("ardour.log");
    let out = fs::File::create(&log)?;
    command.stderr(out.try_clone()?).stdout(out);
    server.for_clients(display.for_clients(&mut command)).arg(session);
    let mut running = Running(command.spawn().context("cannot start Ardour")?);
    let screen = Screen::open(Some(display.name()))?;
    let whole = screen.titled(TITLE).with_context(|| format!("Ardour's words are in {}", log.display()))?;
    let inside = screen.titled(INSIDE)?;
    let keep = |name: &str| {
        let picture = screen.picture(whole)?;
        picture.write(&machine::target().join("screenshots").join(name))?;
        Ok::<_, anyhow::Error>(picture)
    };
    screen.point_away()?;
    let still = screen.settled(inside, Duration::from_millis(1_000))?;
    keep("ardour.png")?;
    // A key of the keyboard along the lower edge, held.
    let (width, height) = screen.size(inside)?;
    screen.point(inside, (i16::try_from(width / 2)?, i16::try_from(height - 16)?))?;
    screen.press(true)?;
    std::thread::sleep(Duration::from_millis(1_500));
    let playing = screen.picture(inside)?;
    keep("ardour-playing.png")?;
    screen.press(false)?;
    let moved = playing.differing(&still);
    println!("a key pressed in Ardour: {moved} pixels changed");
    ensure!(moved > 1_000, "a key pressed in Ardour changes nothing in the window");
    ensure!(running.0.try_wait()?.is_none(), "Ardour has ended by itself");
    Ok(())
}

/// An installed Ardour with a home of its own.
struct Ardour {
    /// "ardour7".
    name: String,
    /// Its libraries and helpers.
    library: PathBuf,
    home: PathBuf,
    plugin: PathBuf,
}

impl Ardour {
    fn new(plugin: PathBuf) -> Result<Self> {
        let library = library().context("no ardour-vst3-scanner in /usr/lib/ardour*")?;
        let name = library.file_name().context("a folder without a name")?.to_string_lossy().into_owned();
        let home = machine::target().join("ardour");
        if home.exists() {
            fs::remove_dir_all(&home)?;
        }
        let config = home.join(".config").join(&name);
        fs::create_dir_all(&config)?;
        fs::create_dir_all(home.join(".local/share"))?;
        fs::write(config.join("config"), CONFIG)?;
        // Ardour takes this file for a sign that it has welcomed its user already.
        fs::write(config.join(format!(".a{}", name.trim_start_matches("ardour"))), "")?;
        Ok(Self { name, library, home, plugin })
    }

    /// A program of it, at home here.
    fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command
            .env("HOME", &self.home)
            .env("XDG_RUNTIME_DIR", &self.home)
            .env_remove("XDG_CONFIG_HOME")
            .env_remove("XDG_DATA_HOME")
            .env_remove("XDG_CACHE_HOME")
            .env("VST3_PATH", self.plugin.parent().unwrap_or(Path::new(".")))
            .env(artefacts::CACHE, machine::target().join("cache"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    }

    /// Has a session written whose plugin shows its window; its file.
    fn session(&self) -> Result<PathBuf> {
        let mut scanner = self.command(&self.library.join("ardour-vst3-scanner"));
        scanner.env("LD_LIBRARY_PATH", &self.library).args(["-f", "-q"]).arg(&self.plugin);
        machine::run(&mut scanner)?;
        let folder = self.home.join("session");
        let script = self.home.join("session.lua");
        fs::write(&script, SESSION.replace("SESSION", &folder.to_string_lossy()))?;
        let lua = format!("{}-lua", self.name);
        let said = self.command(Path::new(&lua)).arg(&script).stdout(Stdio::piped()).output()?;
        let file = folder.join("s.ardour");
        let Ok(text) = fs::read_to_string(&file) else {
            bail!("{lua} wrote no session: {}", String::from_utf8_lossy(&said.stdout));
        };
        let shown = shown(&text).context("the session has no track with the plugin")?;
        fs::write(&file, shown)?;
        Ok(file)
    }
}

/// The folder of the newest Ardour.
fn library() -> Option<PathBuf> {
    let found = fs::read_dir("/usr/lib").ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    found.filter(|folder| folder.join("ardour-vst3-scanner").exists()).max()
}

/// A session that shows the plugin's window, and does not mind that its engine was another.
fn shown(session: &str) -> Option<String> {
    let id = |element: &str, name: &str| {
        let name = format!(" name=\"{name}\"");
        let line = session.lines().find(|line| line.contains(element) && line.contains(&name))?;
        line.split_once(" id=\"")?.1.split('"').next()
    };
    let (track, plugin) = (id("<Route ", "Clarinet")?, id("<Processor ", "Chalumeau")?);
    let window = format!(
        "  <Extra>\n    <UI>\n      <Window name=\"P-{track}-{plugin}\" visible=\"1\" x-off=\"20\" y-off=\"40\" \
         x-size=\"1100\" y-size=\"760\" custom-ui=\"1\"/>\n    </UI>\n  </Extra>\n</Session>"
    );
    let kept: Vec<&str> = session.lines().filter(|line| !line.contains("<EngineHints ")).collect();
    let (rest, _) = kept.join("\n").rsplit_once("</Session>").map(|(a, b)| (a.to_owned(), b.to_owned()))?;
    Some(rest + &window + "\n")
}

/// Ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = machine::terminate(&mut self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_is_told_to_show_the_window() {
        let session = "<Session>\n  <EngineHints backend=\"Dummy\"/>\n  <Routes>\n    \
                       <Route version=\"7002\" id=\"28\" name=\"Master\">\n    <Route version=\"7002\" id=\"121\" \
                       name=\"Clarinet\">\n      <Processor id=\"208\" name=\"Chalumeau\" active=\"1\">\n</Session>\n";
        let shown = shown(session).unwrap();
        assert!(
            shown.contains("name=\"P-121-208\" visible=\"1\"") && !shown.contains("EngineHints"),
            "{shown}"
        );
        assert!(super::shown("<Session>\n</Session>").is_none());
    }
}
