//! `chalumeau knob-sim`: simulates a TorqueTuner and the hand that turns it.

use crate::cli::Failure;
use crate::cli::files;
use crate::cli::shared_args::within;
use chalumeau_firmware::Setup;
use chalumeau_knob::device::runtime_dir::RuntimeDir;
use chalumeau_knob::device::serial::SerialTransport;
use chalumeau_knob::simulator::fault::Fault;
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::SimulatedKnob;
#[cfg(unix)]
use chalumeau_knob::simulator::midi::VirtualMidi;
use chalumeau_knob::simulator::osc::{OscSender, Spelling};
use chalumeau_knob::simulator::plant::PlantDesign;
#[cfg(unix)]
use chalumeau_knob::simulator::pty::Pty;
use chalumeau_knob::simulator::script::Script;
use chalumeau_knob::simulator::serve::{Port, Server};
use chalumeau_knob::wire::TorqueLaw;
use clap::Args;
use std::fs::File;
use std::hash::{BuildHasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  chalumeau knob-sim                                    a knob nobody holds, at a serial port
  chalumeau knob-sim --crescendo 0:200:6 --wait-armed   a hand that blows once it is armed
  chalumeau knob-sim --script examples/hands/swell.csv --loop --wait-armed --log knob.csv
  chalumeau knob-sim --hold 120 --fault unplug@5:2 --fault corrupt@10:3
  chalumeau knob-sim --osc 127.0.0.1:8000 --slap --loop the stock firmware
  chalumeau knob-sim --path COM6                        one end of a pair of ports, as com0com makes on Windows

The first line of standard output says where the knob is: `serial /dev/pts/7`, `midi NAME` or `osc HOST:PORT`; a new \
`serial` line follows when an unplugged cable is put back. Faults are KIND@AT[:SECONDS[=STRENGTH]]: drop, corrupt, \
duplicate, delay, reboot, stall, unplug, i2c, brownout, overspeed.";

/// What the knob calls itself.
const NAME: &str = "TorqueTuner sim";

/// Simulate a TorqueTuner that runs the real firmware, at its own serial port
///
/// Simulates knob, friction, encoder, motor board and a hand, 2,000 times a second. Like a real knob, it arms only when a
/// host asks.
/// The simulation has not been compared with hardware.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct KnobSimCommand {
    /// A fault at a time in seconds; may be given more than once
    #[arg(long = "fault", value_name = "KIND@AT[:SECONDS]")]
    faults: Vec<Fault>,
    /// Seed of tremor, noise and faults
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End after this time, s
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.0, 1e6))]
    seconds: Option<f64>,
    /// Write t_us,angle_deg,velocity_rpm,torque_mnm,hand_mnm,armed,feel_id, 500 lines a second
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long, requires = "log")]
    force: bool,
    /// Print no status lines
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    hand: HandArgs,
    #[command(flatten)]
    port: PortArgs,
}

/// The hand's motion; without one, nobody holds the knob.
#[derive(Args)]
#[group(id = "deed", multiple = false)]
struct DeedArgs {
    /// CSV: t_s,angle_deg or t_s,force_mnm, then grip (0..1) and button (0 or 1) if wanted
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Turn to this angle and hold it, degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, value_parser = |s: &str| within(s, -3600.0, 3600.0))]
    hold: Option<f64>,
    /// Turn from one angle to another, degrees and seconds
    #[arg(long, value_name = "FROM:TO:SECONDS", allow_hyphen_values = true)]
    crescendo: Option<String>,
    /// Press with a constant torque, mNm
    #[arg(long, value_name = "MNM", allow_hyphen_values = true, value_parser = |s: &str| within(s, -1000.0, 1000.0))]
    press: Option<f64>,
    /// Slap: turn beyond -150 degrees and back
    #[arg(long)]
    slap: bool,
}

/// The hand.
#[derive(Args)]
#[command(next_help_heading = "Simulated hand")]
struct HandArgs {
    #[command(flatten)]
    deed: DeedArgs,
    /// Repeat the hand's motion
    #[arg(long = "loop", requires = "deed")]
    is_loop: bool,
    /// Wait until the host has armed the knob; a hand that does not wait lets the test of the motor fail
    #[arg(long, requires = "deed")]
    wait_armed: bool,
    /// Spring between fingers and knob, N m/rad [default: 0.5, a pinch grip]
    #[arg(long, value_name = "K", value_parser = |s: &str| within(s, 0.01, 10.0))]
    stiffness: Option<f64>,
    /// Tremor of the hand at 8..12 Hz, degrees rms [default: 0.1]
    #[arg(long, value_name = "DEG", value_parser = |s: &str| within(s, 0.0, 10.0))]
    tremor: Option<f64>,
    /// The hand corrects its angle against the torque, as a player corrects by ear
    #[arg(long)]
    listen: bool,
}

/// How a host reaches the knob; by default through a serial port.
#[derive(Args)]
#[command(next_help_heading = "Port")]
struct PortArgs {
    /// Run the stock firmware instead of this project's: OSC to this address, 25 times a second, with a fixed feel
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["midi", "serial_number"])]
    osc: Option<String>,
    /// Name of the device in OSC addresses
    #[arg(long, value_name = "NAME", default_value = "TorqueTuner_001", requires = "osc")]
    osc_name: String,
    /// Spell the OSC addresses as the stock firmware's documentation does
    #[arg(long, requires = "osc")]
    misspelt: bool,
    /// A virtual MIDI port instead of a serial one
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = NAME)]
    midi: Option<String>,
    /// An existing serial port: one end of a pair, whose other end the host opens. It cannot be unplugged
    #[arg(long, value_name = "PORT", conflicts_with_all = ["osc", "midi"])]
    path: Option<PathBuf>,
    /// Serial number of the device, hexadecimal
    #[arg(long, value_name = "HEX", default_value = "5100000000000001", value_parser = serial_number)]
    serial_number: u64,
}

fn serial_number(text: &str) -> Result<u64, String> {
    let digits = text.trim_start_matches("0x");
    let number = u64::from_str_radix(digits, 16).ok().filter(|number| *number != 0);
    number.ok_or_else(|| "must be 1 to 16 hexadecimal digits, not all 0".to_owned())
}

impl HandArgs {
    fn script(&self) -> Result<Option<Script>, Failure> {
        let script = if let Some(path) = &self.deed.script {
            let file = File::open(path).map_err(|source| Failure::Read { path: path.clone(), source })?;
            let script = Script::read_csv(file);
            Some(script.map_err(|source| Failure::HandScript { path: path.clone(), source })?)
        } else if let Some(text) = &self.deed.crescendo {
            let script = Script::parse_crescendo(text).map_err(|e| Failure::Usage(e.to_string()))?;
            Some(if self.is_loop { script.returning() } else { script })
        } else {
            let deeds = [self.deed.hold.map(Script::hold), self.deed.press.map(Script::press)];
            deeds.into_iter().flatten().next().or_else(|| self.deed.slap.then(Script::slap))
        };
        Ok(script.map(|script| if self.is_loop { script.repeated() } else { script }))
    }

    fn hand(&self, seed: u64) -> Result<SimulatedHand, Failure> {
        let mut design = if self.listen { HandDesign::listening() } else { HandDesign::default() };
        if let Some(stiffness) = self.stiffness {
            // A firmer grip damps more: the same damping ratio.
            design.damping_nms *= (stiffness / design.stiffness_nm_per_rad).sqrt();
            design.stiffness_nm_per_rad = stiffness;
        }
        design.tremor_deg = self.tremor.unwrap_or(design.tremor_deg);
        let mut hand = SimulatedHand::new(design, seed);
        match self.script()? {
            Some(script) if self.wait_armed => hand.follow_once_armed(script),
            Some(script) => hand.follow(script),
            None => {}
        }
        Ok(hand)
    }
}

impl KnobSimCommand {
    pub fn run(&self) -> Result<(), Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        ctrlc::set_handler(move || stopped.store(true, Ordering::Relaxed))
            .map_err(|e| Failure::Knob(io::Error::other(e)))?;
        files::check(files::READ, &[self.hand.deed.script.as_deref()], &[self.log.as_deref()], self.force)?;
        let mut server = self.server()?;
        if let Some(path) = &self.log {
            server.log_to(path).map_err(|source| Failure::Write { path: path.clone(), source })?;
        }
        self.say_fixed_port()?;
        let (start, mut second) = (Instant::now(), 0);
        let mut shown: Option<PathBuf> = None;
        let mut complaint = None;
        let ran = server.run(|server| {
            if server.path() != shown.as_deref() {
                shown = server.path().map(Path::to_owned);
                if let Err(e) = shown.as_deref().map_or(Ok(()), say_serial) {
                    complaint = Some(e);
                }
            }
            if start.elapsed() >= Duration::from_secs(second) {
                second += 1;
                if !self.quiet {
                    say!("{}", status(server));
                }
            }
            let is_over = self.seconds.is_some_and(|seconds| start.elapsed().as_secs_f64() >= seconds);
            complaint.is_none() && !is_over && !stop.load(Ordering::Relaxed)
        });
        ran.map_err(Failure::Knob)?;
        complaint.map_or(Ok(()), |e| Err(Failure::Table(e)))
    }

    fn server(&self) -> Result<Server, Failure> {
        let hand = self.hand.hand(self.seed)?;
        let plant = PlantDesign::default();
        let (mut knob, port) = if let Some(to) = &self.port.osc {
            let spelling = if self.port.misspelt { Spelling::Document } else { Spelling::Firmware };
            let sender = OscSender::new(to, &self.port.osc_name, spelling);
            let sender = sender.map_err(|e| Failure::Usage(e.to_string()))?;
            (SimulatedKnob::stock(plant, hand, self.seed), Port::Osc(sender))
        } else {
            let setup = Setup {
                serial: self.port.serial_number,
                name: NAME.to_owned(),
                midi: self.port.midi.is_some(),
                knob_damping_nms: plant.viscous_nms as f32,
                counts_per_turn: plant.counts_per_turn,
                // Whatever the seed: a recorded permission must not fit the next start.
                epoch: RandomState::new().hash_one(()) as u16,
                ..Setup::default()
            };
            (SimulatedKnob::new(setup, plant, hand, self.seed), self.port.open()?)
        };
        self.faults.iter().for_each(|fault| knob.inject(*fault));
        let mut server = Server::new(knob, port);
        if server.path().is_some() {
            let announced = server.announce(RuntimeDir::default(), self.port.serial_number, NAME);
            announced.map_err(|e| Failure::Usage(format!("cannot announce the knob: {e}")))?;
        }
        Ok(server)
    }

    fn say_fixed_port(&self) -> Result<(), Failure> {
        let mut out = io::stdout();
        if let Some(to) = &self.port.osc {
            writeln!(out, "osc {to}")?;
        } else if let Some(name) = &self.port.midi {
            writeln!(out, "midi {name}")?;
        } else if let Some(path) = &self.port.path {
            writeln!(out, "serial {}", path.display())?;
        }
        Ok(out.flush()?)
    }
}

impl PortArgs {
    fn open(&self) -> Result<Port, Failure> {
        match &self.path {
            Some(path) => {
                let port = SerialTransport::open(path).map_err(|e| Failure::Usage(e.to_string()))?;
                Ok(Port::Wire(Box::new(port)))
            }
            None => self.make(),
        }
    }

    #[cfg(unix)]
    fn make(&self) -> Result<Port, Failure> {
        match &self.midi {
            Some(name) => {
                let midi = VirtualMidi::open(name).map_err(|e| Failure::Usage(e.to_string()))?;
                Ok(Port::Midi(midi))
            }
            None => Ok(Port::Serial(Some(Pty::open().map_err(Failure::Knob)?))),
        }
    }

    #[cfg(not(unix))]
    fn make(&self) -> Result<Port, Failure> {
        let missing = "this system has neither pseudo-terminals nor virtual MIDI ports. Give --path PORT, one end of a \
                       pair of serial ports (com0com makes such pairs on Windows), or --osc HOST:PORT";
        Err(Failure::Usage(missing.to_owned()))
    }
}

fn say_serial(path: &Path) -> io::Result<()> {
    let mut out = io::stdout();
    writeln!(out, "serial {}", path.display())?;
    out.flush()
}

fn status(server: &Server) -> String {
    let knob = &server.knob;
    let (feel_id, law) = knob.feel();
    let law = match law {
        None => "none yet",
        Some(TorqueLaw::Free) => "free",
        Some(TorqueLaw::Flow) => "flow",
        Some(TorqueLaw::Pressure) => "pressure",
    };
    let lost = match server.slipped() {
        0 => String::new(),
        periods => format!(", {:.0} ms lost to a busy machine", periods as f64 / 2.0),
    };
    format!(
        "{:7.1} s  {:8.1} deg  motor {:6.1} mNm  hand {:6.1} mNm  {}  feel {feel_id} ({law}){lost}",
        knob.t_s(),
        knob.angle_deg(),
        knob.motor_mnm(),
        knob.hand_mnm(),
        if knob.is_armed() { "armed" } else { "not armed" },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serial_numbers_are_hexadecimal_and_never_zero() {
        assert_eq!(serial_number("0x51AD"), Ok(0x51AD));
        for bad in ["", "0", "xyz", "11112222333344445", "-1"] {
            assert!(serial_number(bad).unwrap_err().contains("hexadecimal"), "{bad}");
        }
    }
}
