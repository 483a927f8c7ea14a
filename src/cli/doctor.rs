//! `chalumeau doctor`: lists knobs, says why one does not answer, and measures the connection.

use crate::cli::Failure;
use crate::cli::shared_args::{counted, within};
use crate::identity::VERSION;
use chalumeau_knob::device::discover::{PortKind, candidates, chip, ports};
use chalumeau_knob::device::{
    Hooks, KnobChoice, KnobLink, LinkStats, LinkStatus, Phase, RuntimeDir, serial_text,
};
use chalumeau_knob::device::{midi, osc};
use chalumeau_knob::wire::plain_text::plain;
use chalumeau_knob::wire::{Capabilities, Feel, Info, MAJOR, MINOR};
use clap::Args;
use serialport::SerialPortType;
use std::io;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  chalumeau doctor                            every port that may have a knob
  chalumeau doctor --path /dev/ttyUSB1        this port only; on Windows --path COM3
  chalumeau doctor --osc --network            stock firmware, over Wi-Fi
  chalumeau doctor --seconds 60               a longer look at rate and jitter";

/// Longest wait for an answer; a board that restarts when its port is opened takes 5 s.
const ANSWER: Duration = Duration::from_secs(7);

/// Time between two changes of FEEL while its round trip is measured.
const FEEL_EVERY: Duration = Duration::from_millis(50);

/// List knobs, say why one does not answer, and measure the connection
///
/// Lists serial and MIDI ports, opens those that may have a knob (known USB identities and simulated knobs, others only
/// with --path), and reports the firmware, rate, jitter and round trip of each knob. It arms no knob: there is no torque.
/// If no knob answers, it says what to do next, and the exit code is 1.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct DoctorCommand {
    /// Ask this serial port only, even if its USB identity is not known
    #[arg(long, value_name = "PORT", conflicts_with = "osc")]
    path: Option<PathBuf>,
    /// Listen only for OSC from unmodified firmware, at this UDP port
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "8000")]
    osc: Option<u16>,
    /// With --osc: listen to the whole network instead of this machine alone
    // Its name was --any-address.
    #[arg(long, alias = "any-address", requires = "osc")]
    network: bool,
    /// How long each knob is watched once it answers, s, 1..3600
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = |s: &str| within(s, 1.0, 3600.0))]
    seconds: f64,
}

impl DoctorCommand {
    pub fn run(&self) -> Result<ExitCode, Failure> {
        Ok(if self.found()? { ExitCode::SUCCESS } else { ExitCode::from(1) })
    }

    /// Whether a knob answers.
    fn found(&self) -> Result<bool, Failure> {
        let mut out = io::stdout().lock();
        writeln!(out, "Chalumeau {VERSION}, TTLink {MAJOR}.{MINOR}")?;
        if let Some(port) = self.osc {
            return Ok(self.ask_osc(&mut out, port)?);
        }
        if let Some(path) = &self.path {
            let answer = self.ask(&mut out, KnobChoice::Path(path.clone()))?;
            match answer {
                Answer::Live => {}
                Answer::InUse => tell_who_has_it(&mut out)?,
                Answer::None => {
                    list_serial(&mut out, &RuntimeDir::default())?;
                    tell_what_next(&mut out)?;
                }
            }
            return Ok(answer == Answer::Live);
        }
        let places = RuntimeDir::default();
        list_serial(&mut out, &places)?;
        let midi = list_midi(&mut out)?;
        let serial = candidates(&places).into_iter().map(|candidate| KnobChoice::Path(candidate.path));
        let midi = midi.into_iter().map(|name| KnobChoice::Midi { name: Some(name) });
        let mut answers = Vec::new();
        for choice in serial.chain(midi) {
            answers.push(self.ask(&mut out, choice)?);
        }
        if answers.contains(&Answer::Live) {
            return Ok(true);
        }
        if answers.contains(&Answer::InUse) {
            tell_who_has_it(&mut out)?;
        } else {
            tell_what_next(&mut out)?;
        }
        Ok(false)
    }

    /// Links to `choice`, watches it and reports.
    fn ask(&self, out: &mut impl Write, choice: KnobChoice) -> io::Result<Answer> {
        let name = match &choice {
            KnobChoice::Path(path) => path.display().to_string(),
            KnobChoice::Midi { name } => name.clone().unwrap_or_default(),
            KnobChoice::Off | KnobChoice::Serial { .. } | KnobChoice::Osc { .. } => String::new(),
        };
        writeln!(out, "\n{}", plain(&name))?;
        out.flush()?;
        // Law free: whatever these numbers are, they make no torque, and nothing is armed.
        let (mut feel, mut changed) = (Feel::default(), Instant::now());
        let changing = move || {
            if changed.elapsed() > FEEL_EVERY {
                changed = Instant::now();
                feel.a_on_deg = if feel.a_on_deg == 120.0 { 121.0 } else { 120.0 };
            }
            Some(feel)
        };
        let hooks = Hooks { feel: Box::new(changing), ..Hooks::default() };
        let (link, _reader) = KnobLink::spawn("chalumeau doctor", hooks);
        link.choose(choice);
        let status =
            wait(&link, ANSWER, |phase| !matches!(phase, Phase::Off | Phase::Searching | Phase::Waiting));
        if !matches!(status.phase, Phase::Live | Phase::VersionMismatch | Phase::ReadOnly) {
            let words = [Some(&status.text), status.notice.as_ref()];
            for line in words.into_iter().flatten().flat_map(|text| text.split(". ")) {
                writeln!(out, "  {line}")?;
            }
            let is_used = matches!(status.phase, Phase::HeldBy(_) | Phase::Busy(_));
            return Ok(if is_used { Answer::InUse } else { Answer::None });
        }
        thread::sleep(Duration::from_secs_f64(self.seconds));
        let status = link.status();
        match &status.info {
            Some(info) => tell_info(out, info)?,
            None => writeln!(
                out,
                "  control changes, no answer to HELLO: tier 0, {}",
                chalumeau_knob::device::stock::LABEL
            )?,
        }
        tell_link(out, &status)?;
        let is_ours = matches!(status.phase, Phase::Live | Phase::VersionMismatch);
        Ok(if is_ours { Answer::Live } else { Answer::None })
    }

    fn ask_osc(&self, out: &mut impl Write, port: u16) -> io::Result<bool> {
        let from = if self.network { "the whole network" } else { "this machine alone" };
        writeln!(out, "\nOSC at UDP port {port}, from {from}")?;
        out.flush()?;
        let (link, _reader) = KnobLink::spawn("chalumeau doctor", Hooks::default());
        link.choose(KnobChoice::Osc { port, any_address: self.network });
        let is_told = |phase: &Phase| !matches!(phase, Phase::Off | Phase::Searching | Phase::Waiting);
        let status = wait(&link, ANSWER.min(Duration::from_secs_f64(self.seconds + 1.0)), is_told);
        match &status.phase {
            Phase::ReadOnly => {
                thread::sleep(Duration::from_secs_f64(self.seconds));
                let status = link.status();
                writeln!(
                    out,
                    "  a TorqueTuner's stock firmware: tier 0, {}",
                    chalumeau_knob::device::stock::LABEL
                )?;
                writeln!(out, "  angle: {:.1} degrees", status.angle_deg.unwrap_or(0.0))?;
                writeln!(out, "  rate: {:.0} angles a second (25 are sent)", status.stats.rate_hz)?;
                writeln!(out, "  ignored: {} messages", status.stats.ignored)?;
                return Ok(true);
            }
            Phase::Busy(text) | Phase::HeldBy(text) | Phase::Failed(text) => writeln!(out, "  {text}")?,
            _ => {
                writeln!(
                    out,
                    "  nothing received ({} packets did not come from a knob)",
                    link.status().stats.ignored
                )?;
                writeln!(
                    out,
                    "  Join the knob's Wi-Fi (TorqueTuner_001) and give this computer the address"
                )?;
                writeln!(
                    out,
                    "  192.168.4.2, or set the address of this computer in the knob's configuration,"
                )?;
                writeln!(
                    out,
                    "  and listen with --network. The port is {} as the firmware comes.",
                    osc::PORT
                )?;
            }
        }
        Ok(false)
    }
}

/// Where a system has no pseudo-terminals, a simulated knob needs a pair of ports.
const SIMULATOR: &str = if cfg!(unix) {
    "run chalumeau knob-sim in another terminal"
} else {
    "run chalumeau knob-sim --path PORT at one end of a pair of ports (com0com), then --path"
};

/// What a port has answered.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Answer {
    /// A knob with this project's firmware, of whatever version.
    Live,
    /// Another program has it.
    InUse,
    /// Nothing, or another device.
    None,
}

fn tell_who_has_it(out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "
A port is in use, so that this program cannot ask what is there. What to do next:
  Close the program that is named above, and run this again
  Or, to play with the knob in another instance of the plugin, press Take over knob there"
    )
}

fn tell_what_next(out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "
No knob answers. What to do next:
  A knob with a cable   plug it in and run this again; if its port is listed but not known, --path PORT
  Stock firmware        chalumeau doctor --osc --network
  No knob at all        {SIMULATOR}
All steps: docs/touch.md"
    )
}

fn wait(link: &KnobLink, most: Duration, until: impl Fn(&Phase) -> bool) -> LinkStatus {
    let begun = Instant::now();
    loop {
        let status = link.status();
        if until(&status.phase) || begun.elapsed() > most {
            return status;
        }
        thread::sleep(Duration::from_millis(20));
    }
}

fn list_serial(out: &mut impl Write, places: &RuntimeDir) -> io::Result<()> {
    writeln!(out, "\nSerial ports")?;
    let ports = ports();
    for port in &ports {
        let what = match &port.port_type {
            SerialPortType::UsbPort(usb) => {
                let known = chip(usb.vid, usb.pid).map_or("not known: asked only with --path", |chip| chip);
                let product = plain(usb.product.as_deref().unwrap_or(""));
                format!("USB {:04x}:{:04x} {product} ({known})", usb.vid, usb.pid)
            }
            _ => "no USB device: asked only with --path".into(),
        };
        writeln!(out, "  {:<16} {what}", port.port_name)?;
    }
    for candidate in candidates(places) {
        if let PortKind::Simulated { serial, name } = &candidate.kind {
            let path = candidate.path.display().to_string();
            writeln!(out, "  {path:<16} simulated: {}, {}", plain(name), serial_text(*serial))?;
        }
    }
    if ports.is_empty() && candidates(places).is_empty() {
        writeln!(out, "  none")?;
    }
    Ok(())
}

/// The ports to ask.
fn list_midi(out: &mut impl Write) -> io::Result<Vec<String>> {
    writeln!(out, "\nMIDI ports")?;
    let known = midi::ports(false).unwrap_or_default();
    match midi::ports(true) {
        Err(e) => writeln!(out, "  {e}")?,
        Ok(all) if all.is_empty() => writeln!(out, "  none")?,
        Ok(all) => {
            for name in all {
                let is_known =
                    if known.contains(&name) { "" } else { " (not the name of a knob: not asked)" };
                writeln!(out, "  {}{is_known}", plain(&name))?;
            }
        }
    }
    Ok(known)
}

fn tell_info(out: &mut impl Write, info: &Info) -> io::Result<()> {
    let (major, minor, patch) = info.firmware;
    let simulated = if info.capabilities.has(Capabilities::SIMULATED) { ", simulated" } else { "" };
    writeln!(out, "  {}, serial number {}{simulated}", info.name_text(), serial_text(info.serial))?;
    writeln!(out, "  firmware {major}.{minor}.{patch}, TTLink {}.{}", info.major, info.minor)?;
    if info.speaks_our_major() {
        writeln!(out, "  tier 2: position and feel")?;
    } else {
        writeln!(
            out,
            "  another major version than {MAJOR}: position only, never armed; flash the firmware in firmware/"
        )?;
    }
    writeln!(
        out,
        "  haptic loop {} Hz, {} counts a turn, at most {} mNm, no torque {} ms after silence",
        info.loop_hz,
        info.counts_per_turn,
        info.ceiling_mnm,
        u32::from(info.watchdog_ms) + u32::from(info.fade_ms)
    )?;
    if info.speaks_our_major() && info.checks_age() && !info.capabilities.has(Capabilities::CALIBRATED) {
        writeln!(out, "  not calibrated, and therefore weak: firmware/README.md, \"Calibrate it\"")?;
    }
    match info.counters {
        Some(counters) => writeln!(
            out,
            "  since its start: {} late turns of its loop, {} failed exchanges with its motor board",
            counters.overruns, counters.bus_errors
        ),
        None => Ok(()),
    }
}

/// Most lateness of a position that a lab should accept, 99th percentile, us: above what a simulated knob has on a busy machine
/// (docs/touch.md). A judgement.
const MOST_JITTER_US: u32 = 3_000;
/// The same for a feel, there and back, us: its torque should be there soon after its note. A judgement.
const MOST_FEEL_US: u32 = 10_000;

/// Whether the link is as good as measurements need, and if not, what is wrong and what may help.
fn judged(stats: &LinkStats) -> String {
    let wire = &stats.wire;
    let bad = wire.lost + wire.crc_errors + wire.length_errors + wire.range_errors;
    if stats.rate_hz < 1.0 {
        return "no positions arrive".to_owned();
    }
    let late = "take a port without a hub, and close other programs";
    let wrong = [
        (stats.jitter_p99_us > MOST_JITTER_US).then(|| format!("jitter above 3 ms at p99: {late}")),
        (bad > 0).then(|| {
            let frames = counted(bad as usize, "frame");
            format!("{frames} lost or damaged: try another cable, and a port without a hub")
        }),
        stats
            .feel_round_trip_us
            .filter(|us| *us > MOST_FEEL_US)
            .map(|_| format!("a feel takes more than 10 ms: {late}")),
    ];
    let wrong: Vec<_> = wrong.into_iter().flatten().collect();
    if wrong.is_empty() { "good".to_owned() } else { wrong.join("\n  link: ") }
}

fn tell_link(out: &mut impl Write, status: &LinkStatus) -> io::Result<()> {
    let stats = &status.stats;
    let ms = |us: u32| f64::from(us) * 1e-3;
    let slow =
        if status.is_slow { " at 115200 baud: the cable or its driver may not support 921600" } else { "" };
    match status.angle_deg {
        Some(degrees) => writeln!(out, "  angle: {degrees:.2} degrees")?,
        None => writeln!(out, "  angle: none that can be believed")?,
    }
    writeln!(out, "  rate: {:.0} positions a second{slow}", stats.rate_hz)?;
    writeln!(out, "  jitter: {:.2} ms p50, {:.2} ms p99", ms(stats.jitter_p50_us), ms(stats.jitter_p99_us))?;
    let wire = &stats.wire;
    writeln!(
        out,
        "  frames: {} received, {} lost, {} duplicated, {} damaged, {} bytes outside frames",
        wire.frames,
        wire.lost,
        wire.duplicates,
        wire.crc_errors + wire.length_errors + wire.range_errors,
        wire.skipped_bytes
    )?;
    let trip = |us: Option<u32>| us.map_or_else(|| "not seen".into(), |us| format!("{:.1} ms", ms(us)));
    let (hello, feel) = (trip(stats.hello_round_trip_us), trip(stats.feel_round_trip_us));
    writeln!(out, "  round trip: HELLO to INFO {hello}, FEEL to its echo {feel}")?;
    writeln!(out, "  clocks differ by {:.0} ppm", stats.skew_ppm)?;
    writeln!(out, "  link: {}", judged(stats))?;
    let words = [&status.alarm, &status.restriction, &status.last_refusal, &status.notice];
    words.into_iter().flatten().try_for_each(|text| writeln!(out, "  {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_good_until_something_is_wrong() {
        assert_eq!(judged(&LinkStats::default()), "no positions arrive");
        let good = LinkStats {
            rate_hz: 500.0,
            jitter_p99_us: MOST_JITTER_US,
            feel_round_trip_us: Some(MOST_FEEL_US),
            ..LinkStats::default()
        };
        assert_eq!(judged(&good), "good");
        let late = LinkStats { jitter_p99_us: MOST_JITTER_US + 1, ..good };
        assert!(judged(&late).starts_with("jitter above 3 ms at p99: take"), "{}", judged(&late));
        let mut lossy = LinkStats { feel_round_trip_us: Some(MOST_FEEL_US + 1), ..good };
        (lossy.wire.lost, lossy.wire.crc_errors) = (1, 2);
        let said = judged(&lossy);
        let lines: Vec<_> = said.split("\n  link: ").collect();
        assert_eq!(lines.len(), 2, "{said}");
        assert!(lines[0].starts_with("3 frames lost or damaged: try another cable"), "{said}");
        assert!(lines[1].starts_with("a feel takes more than 10 ms: take"), "{said}");
    }
}
