//! A simulated knob in real time, at a port where a host finds it.
//!
//! Periods are counted from one start, so nothing drifts: whoever wakes late makes up for it. Only after a stop of more than
//! 50 ms (a suspended machine) is time lost instead, lest the firmware's watchdog take our sleep for the host's.

use crate::device::discover::Announcement;
use crate::device::runtime_dir::RuntimeDir;
use crate::device::transport::{Binding, Transport};
use crate::simulator::fault::Fault;
use crate::simulator::knob::{PERIOD_US, SimulatedKnob};
use crate::simulator::midi::MidiSplitter;
#[cfg(unix)]
use crate::simulator::midi::VirtualMidi;
use crate::simulator::osc::OscSender;
#[cfg(unix)]
use crate::simulator::pty::Pty;
use crate::simulator::script::Aim;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Most periods made up for at once: 50 ms, less than the watchdog of 80 by more than the host's ALIVE takes.
const CATCH_UP_MAX: u64 = 100;

/// Time between two looks at the clock.
const NAP: Duration = Duration::from_micros(500);

/// Periods between two lines of the log: 2 ms, the rate of STATE.
const LOG_EVERY: u64 = 4;

/// Periods between two looks after the port: a second.
const CARE_EVERY: u64 = 2000;

/// Columns of the log.
pub const LOG_HEADER: &str = "t_us,angle_deg,velocity_rpm,torque_mnm,hand_mnm,armed,feel_id";

/// Where the host is.
pub enum Port {
    /// A pseudo-terminal; opened anew after the cable was out.
    #[cfg(unix)]
    Serial(Option<Pty>),
    /// A virtual MIDI port; opened anew after the cable was out.
    #[cfg(unix)]
    Midi(VirtualMidi),
    /// OSC reports of the stock firmware.
    Osc(OscSender),
    /// One end of a wire that others hold: within the program, or a serial port.
    Wire(Box<dyn Transport>),
}

/// Real time in periods.
#[derive(Debug)]
struct Pace {
    start: Instant,
    done: u64,
    slipped: u64,
}

impl Pace {
    fn due(&mut self, now: Instant) -> u64 {
        let passed = now.saturating_duration_since(self.start).as_micros() as u64 / PERIOD_US;
        let due = passed - self.done - self.slipped;
        let late = due.saturating_sub(CATCH_UP_MAX);
        self.slipped += late;
        self.done += due - late;
        due - late
    }
}

/// What a program may tell a knob that runs.
#[derive(Clone, Copy, Debug)]
pub enum Control {
    /// The hand takes hold and wants this.
    Aim(Aim),
    /// The hand lets go.
    Release,
    /// The button goes down or up.
    Button(bool),
    /// A fault from now on; its `at_s` counts from now.
    Fault(Fault),
}

/// Where hosts look for knobs, and what they find there while there is a path.
struct Announcer {
    places: RuntimeDir,
    serial: u64,
    name: String,
    advert: Option<Announcement>,
}

impl Announcer {
    fn update(&mut self, path: Option<&Path>) -> io::Result<()> {
        // The old one first: a serial number can be announced once at a time.
        self.advert = None;
        self.advert = path
            .map(|path| Announcement::publish(&self.places, self.serial, &self.name, path))
            .transpose()?;
        Ok(())
    }
}

/// A knob at a port.
pub struct Server {
    /// The knob.
    pub knob: SimulatedKnob,
    port: Port,
    pace: Pace,
    log: Option<BufWriter<File>>,
    announcement: Option<Announcer>,
    splitter: MidiSplitter,
    buffer: Vec<u8>,
}

impl Server {
    /// Starts the clock.
    pub fn new(knob: SimulatedKnob, port: Port) -> Self {
        let pace = Pace { start: Instant::now(), done: 0, slipped: 0 };
        Self {
            knob,
            port,
            pace,
            log: None,
            announcement: None,
            splitter: MidiSplitter::default(),
            buffer: Vec::new(),
        }
    }

    /// Writes the course of things to a CSV file, 500 lines a second.
    pub fn log_to(&mut self, path: &Path) -> io::Result<()> {
        let mut log = BufWriter::new(File::create(path)?);
        writeln!(log, "{LOG_HEADER}")?;
        self.log = Some(log);
        Ok(())
    }

    /// Lets hosts that look for this serial number find the port, as long as the server lives and the cable is in.
    pub fn announce(&mut self, places: RuntimeDir, serial: u64, name: &str) -> io::Result<()> {
        let mut announcement = Announcer { places, serial, name: name.to_owned(), advert: None };
        announcement.update(path_of(&self.port))?;
        self.announcement = Some(announcement);
        Ok(())
    }

    /// What the host opens; none while the cable is out or where there is no path.
    pub fn path(&self) -> Option<&Path> {
        path_of(&self.port)
    }

    /// Periods lost because the machine stood still.
    pub fn slipped(&self) -> u64 {
        self.pace.slipped
    }

    /// Does what is due. Call it about every half millisecond.
    pub fn turn(&mut self) -> io::Result<()> {
        let due = self.pace.due(Instant::now());
        for period in 0..due {
            if period == 0 {
                self.read()?;
            }
            self.knob.step();
            self.write()?;
            if (self.knob.t_us() / PERIOD_US).is_multiple_of(CARE_EVERY) {
                self.care()?;
            }
            self.write_log()?;
        }
        Ok(())
    }

    fn read(&mut self) -> io::Result<()> {
        self.buffer.clear();
        match &mut self.port {
            #[cfg(unix)]
            Port::Serial(Some(pty)) => pty.read(&mut self.buffer)?,
            #[cfg(unix)]
            Port::Midi(midi) => midi.read(&mut self.buffer),
            Port::Wire(transport) => {
                let buffer = &mut self.buffer;
                // The other end is gone: a knob does not mind.
                let _ = transport.poll(Duration::ZERO, &mut |chunk| buffer.extend_from_slice(chunk));
            }
            _ => {}
        }
        self.knob.send(&self.buffer);
        Ok(())
    }

    fn write(&mut self) -> io::Result<()> {
        if let Port::Osc(sender) = &mut self.port {
            if let Some(report) = self.knob.take_report() {
                sender.send(&report);
            }
            return Ok(());
        }
        self.buffer.clear();
        self.knob.receive(&mut self.buffer);
        match &mut self.port {
            #[cfg(unix)]
            Port::Serial(Some(pty)) => pty.write(&self.buffer)?,
            #[cfg(unix)]
            Port::Midi(midi) => self.splitter.split(&self.buffer, |message| midi.write(message)),
            Port::Wire(transport) if transport.binding() == Binding::Midi => {
                self.splitter.split(&self.buffer, |message| _ = transport.send(message));
            }
            Port::Wire(transport) if !self.buffer.is_empty() => _ = transport.send(&self.buffer),
            _ => {}
        }
        #[cfg(unix)]
        if let Port::Midi(midi) = &mut self.port {
            midi.plug(!self.knob.is_unplugged()).map_err(io::Error::other)?;
        }
        #[cfg(unix)]
        if let Port::Serial(pty) = &mut self.port {
            let is_unplugged = self.knob.is_unplugged();
            if is_unplugged == pty.is_some() {
                *pty = if is_unplugged { None } else { Some(Pty::open()?) };
                if let Some(announcement) = &mut self.announcement {
                    announcement.update(path_of(&self.port))?;
                }
            }
        }
        Ok(())
    }

    fn care(&mut self) -> io::Result<()> {
        #[cfg(unix)]
        if let Port::Serial(Some(pty)) = &self.port {
            pty.forgive()?;
        }
        self.log.as_mut().map_or(Ok(()), Write::flush)
    }

    fn write_log(&mut self) -> io::Result<()> {
        let knob = &self.knob;
        let Some(log) = self.log.as_mut().filter(|_| (knob.t_us() / PERIOD_US).is_multiple_of(LOG_EVERY))
        else {
            return Ok(());
        };
        writeln!(
            log,
            "{},{:.3},{:.2},{:.2},{:.2},{},{}",
            knob.t_us(),
            knob.angle_deg(),
            knob.velocity_rpm(),
            knob.motor_mnm(),
            knob.hand_mnm(),
            u8::from(knob.is_armed()),
            knob.feel().0
        )
    }

    fn obey(&mut self, control: Control) {
        match control {
            Control::Aim(aim) => self.knob.hand().aim(aim),
            Control::Release => self.knob.hand().release(),
            Control::Button(is_down) => self.knob.press_button(is_down),
            Control::Fault(fault) => {
                self.knob.inject(Fault { at_s: fault.at_s + self.knob.t_s(), ..fault });
            }
        }
    }

    /// Runs in a thread of its own until dropped.
    pub fn spawn(mut self) -> io::Result<RunningKnob> {
        let (control, orders): (Sender<Control>, Receiver<Control>) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let path = self.path().map(Path::to_owned);
        let worker = thread::Builder::new().name("simulated knob".into()).spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                orders.try_iter().for_each(|order| self.obey(order));
                self.turn()?;
                thread::sleep(NAP);
            }
            Ok(self.knob)
        })?;
        Ok(RunningKnob { stop, worker: Some(worker), control, path })
    }

    /// The knob that is served.
    pub fn knob(&self) -> &SimulatedKnob {
        &self.knob
    }

    /// Runs until told to stop, asking `watch` after every nap whether to go on.
    pub fn run(&mut self, mut watch: impl FnMut(&Self) -> bool) -> io::Result<()> {
        while watch(self) {
            self.turn()?;
            thread::sleep(NAP);
        }
        self.log.as_mut().map_or(Ok(()), Write::flush)
    }
}

fn path_of(port: &Port) -> Option<&Path> {
    match port {
        #[cfg(unix)]
        Port::Serial(pty) => pty.as_ref().map(Pty::path),
        _ => None,
    }
}

/// A knob that runs in its own thread; ends when dropped.
pub struct RunningKnob {
    stop: Arc<AtomicBool>,
    worker: Option<JoinHandle<io::Result<SimulatedKnob>>>,
    control: Sender<Control>,
    path: Option<PathBuf>,
}

impl RunningKnob {
    /// What the host opens, if it is a serial port.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Tells the knob something; lost if it has ended.
    pub fn tell(&self, control: Control) {
        let _ = self.control.send(control);
    }

    /// Stops it and says how it ended.
    pub fn finish(mut self) -> io::Result<SimulatedKnob> {
        self.stop.store(true, Ordering::Relaxed);
        let worker = self.worker.take().ok_or(io::ErrorKind::NotFound)?;
        worker.join().unwrap_or_else(|_| Err(io::Error::other("the simulated knob panicked")))
    }
}

impl Drop for RunningKnob {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(worker) = self.worker.take() {
            let _ = worker.join(); // a panicked worker has already been reported
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pace_neither_drifts_nor_bursts() {
        let start = Instant::now();
        let mut pace = Pace { start, done: 0, slipped: 0 };
        let mut done = 0;
        for step in 1..=1000u64 {
            done += pace.due(start + Duration::from_micros(step * 1_370));
        }
        assert_eq!(done, 1_370_000 / PERIOD_US);
        let resumed = pace.due(start + Duration::from_micros(1_370_000 + 3_000_000));
        assert_eq!((resumed, pace.slipped), (CATCH_UP_MAX, 6000 - CATCH_UP_MAX));
        assert_eq!(pace.due(start + Duration::from_micros(4_370_000 + 1_000)), 2);
    }
}
