//! `chalumeau knob`: uses a knob without a DAW: watch it, feel a note on it, record a take.

use crate::cli::feel_args::{FeelArgs, refused_in_flags};
use crate::cli::files;
use crate::cli::haptic::ReedArgs;
use crate::cli::shared_args::{InstrumentArg, check_fingering, note, within};
use crate::cli::{Failure, INTERRUPTED};
use crate::feel_flags;
use crate::identity::VERSION;
use crate::output::{NewFile, OutputError, remove_unfinished_and_exit};
use crate::take_file::{TakeFile, knob_in_words};
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::haptics::{FeelDesign, NoteFeel, TorqueLimits};
use chalumeau_core::instrument::{Settings, Wanted};
use chalumeau_core::units::WrittenNote;
use chalumeau_knob::device::{
    FIRST_CEILING_MNM, HARD_CEILING_MNM, Hooks, KnobChoice, KnobLink, LinkStats, LinkStatus,
    OFFERED_CEILING_MNM, Phase, Release, StateSample, serial_text,
};
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::feel::{InstrumentFeel, NO_MOTOR};
use chalumeau_knob::touch::take::{TakeEmbouchure, TakeHand, TakeHead, TakeMarks, TakeRow};
use chalumeau_knob::wire::Info;
use clap::{ArgGroup, Args};
use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Time between two updates of the line on the screen.
const SHOWN_EVERY: Duration = Duration::from_millis(100);
/// After Ctrl-C the program ends within this time even if it waits for its terminal.
const END_BY_FORCE: Duration = Duration::from_millis(300);
/// How long to look for a knob before giving up.
const PATIENCE: Duration = Duration::from_secs(10);
/// The command arms a knob that is there within this time. One that comes later is armed after Enter: the user may have turned to
/// something else, such as plugging it in.
const PROMPTLY: Duration = Duration::from_millis(1500);

const EXAMPLES: &str = "\
Examples:
  chalumeau knob
      Finds a knob behind a known serial board, real or simulated, and shows angle, gamma, threshold and whether it is armed.
  chalumeau knob --zero --written E3 --arm 60
      The resistance of the lowest note, with at most 60 mNm. Ctrl-C ends the torque at once.
  chalumeau knob --zero --arm 300 --law pressure --torque 260
      Above 250 mNm the program asks you to type the number. A knob let go from such a spring disarms itself: hold it until it is back.
  chalumeau knob --zero --written E3 --law pressure --arm 60
  chalumeau knob --osc 8000
      A TorqueTuner with its stock firmware.
  chalumeau knob --seconds 20 --record take.csv
  chalumeau render melody.mid --replay take.csv --out again.wav";

/// Watch a knob, feel a note on it, record a take
///
/// The knob makes torque only with --arm, and never more than --arm and its own limits allow. If the knob answers within
/// 1.5 s, the program arms it. If it answers later, the program arms it after you press Enter. A knob that another program
/// uses is not armed. When the program ends, for whatever reason, the torque ends. If the program hangs, for example after
/// Ctrl-S in its terminal, the torque ends within 630 ms (880 ms over MIDI). Without --arm, the knob turns freely and is
/// only read.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
#[command(group = ArgGroup::new("which").args(["serial", "path", "midi", "osc"]))]
pub struct KnobCommand {
    /// The knob with this serial number (hexadecimal) [default: the first that answers]
    #[arg(long, value_name = "HEX", value_parser = |s: &str| chalumeau_knob::device::serial_number(s).ok_or("must be a serial number such as 5100000000000001"))]
    serial: Option<u64>,
    /// The device at this port
    #[arg(long, value_name = "PORT")]
    path: Option<PathBuf>,
    /// A knob at a MIDI port whose name contains this
    #[arg(long, value_name = "NAME", num_args = 0..=1, default_missing_value = "")]
    midi: Option<String>,
    /// Stock firmware sending OSC to this UDP port
    #[arg(long, value_name = "PORT")]
    osc: Option<u16>,
    /// Accept OSC from other machines too
    #[arg(long, requires = "osc")]
    network: bool,
    /// Written note whose resistance is felt
    #[arg(long, value_name = "NOTE", default_value = "C5", value_parser = note)]
    written: u8,
    /// Let the knob make torque, at most this many mNm, 10..450; above 250 the program asks you to type the number
    #[arg(long, value_name = "MNM", value_parser = |s: &str| within(s, 10.0, f64::from(HARD_CEILING_MNM)))]
    arm: Option<f64>,
    /// First make the present position zero; it arms once the knob has shown an angle near zero
    #[arg(long)]
    zero: bool,
    /// End this long after the knob has answered, s; one that does not answer ends the command after 10 s
    #[arg(long, value_name = "S", value_parser = |s: &str| within(s, 0.1, 86_400.0))]
    seconds: Option<f64>,
    /// Write the take to this CSV file when done; needs --seconds
    #[arg(long, value_name = "FILE", requires = "seconds")]
    record: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    instrument: InstrumentArg,
    #[command(flatten)]
    feel: FeelArgs,
    #[command(flatten)]
    reed: ReedArgs,
}

/// The feel that was asked for.
struct WantedFeel {
    feels: InstrumentFeel,
    settings: Settings,
    design: FeelDesign,
    fingering: usize,
    may_weaken: bool,
}

/// What a knob that is there gets.
struct Settled {
    note: NoteFeel,
    /// What a take says of it.
    remarks: Vec<String>,
}

impl WantedFeel {
    /// The feel of the note, and its design, weakened as far as the limits ask for and the user allows: as far as the hardest note
    /// of the chart needs, so that the notes of several commands can be compared.
    fn under(&self, limits: &TorqueLimits) -> Result<(NoteFeel, FeelDesign), Failure> {
        let ceiling_mnm = if self.may_weaken { limits.ceiling_mnm } else { f64::INFINITY };
        let hardest = TorqueLimits { ceiling_mnm, ..NO_MOTOR };
        let refused = |refused| refused_in_flags(refused, "--arm");
        let (table, design) =
            self.feels.strongest(&self.settings, &self.design, &hardest).map_err(refused)?;
        // All other limits are this note's alone: the knob gets no other.
        table.accepts(self.fingering, &design, limits).map_err(refused)?;
        Ok((table.note(self.fingering).copied().unwrap_or(*table.reference()), design))
    }
}

impl KnobCommand {
    pub fn run(&self) -> Result<(), Failure> {
        files::check(files::READ, &[self.instrument.file()], &[self.record.as_deref()], self.force)?;
        let file = self.instrument.load()?;
        let written = WrittenNote(self.written);
        check_fingering(&file, written)?;
        let feels = InstrumentFeel::new(&*self.instrument.tuned(&Wanted::new(file.clone(), 48_000.0))?);
        let fingering = feels.requirements().written().position(|note| note == written).unwrap_or(0);
        let design = self.feel.design(&file)?;
        let settings = self.reed.settings();
        let wanted = WantedFeel { feels, settings, design, fingering, may_weaken: self.feel.may_weaken() };
        let ceiling_mnm = self.arm.unwrap_or(f64::from(FIRST_CEILING_MNM));
        // What is refused on any knob is refused before one is looked for.
        let (note, _) = wanted.under(&TorqueLimits { ceiling_mnm, ..TorqueLimits::default() })?;
        self.ask_again()?;
        let take = self.record.as_ref().map(|path| NewFile::create(path, self.force)).transpose()?;

        let (rows, heard) = channel();
        // None until the knob has told its limits.
        let feel = Arc::new(Mutex::new(None));
        let sent = feel.clone();
        let hooks = Hooks {
            feel: Box::new(move || sent.lock().map_or(None, |feel| *feel)),
            on_state: Box::new(move |state: &StateSample| {
                let _ = rows.send(*state);
            }),
        };
        let (link, _reader) = KnobLink::spawn("chalumeau knob", hooks);
        link.choose(self.choice());
        let settle = |status: &LinkStatus| {
            let remarks = |design: &FeelDesign| self.remarks(written, &file, design, status.info.as_ref());
            let as_asked = || Settled { note, remarks: remarks(&wanted.design) };
            let Some(info) = &status.info else { return Ok(as_asked()) };
            let limits = info.torque_limits(ceiling_mnm.round() as u16);
            let (note, design) = match wanted.under(&limits) {
                // It is only watched.
                Err(_) if self.arm.is_none() => return Ok(as_asked()),
                settled => settled?,
            };
            let mut remarks = remarks(&design);
            let (asked_mnm, strength_mnm) = (wanted.design.strength_mnm, design.strength_mnm);
            if strength_mnm < asked_mnm && self.arm.is_some() {
                let weakened = format!(
                    "the feel is weakened from {asked_mnm:.0} to {strength_mnm:.0} mNm: then no note needs more than {:.0} mNm, which --arm and this knob allow",
                    limits.ceiling_mnm
                );
                say!("{weakened}");
                remarks.push(weakened);
            }
            if let Ok(mut feel) = feel.lock() {
                *feel = Some(note.feel);
            }
            Ok(Settled { note, remarks })
        };
        self.watch(&link, &heard, note, &settle, take)
    }

    /// What a take says above its columns.
    fn remarks(
        &self,
        written: WrittenNote,
        file: &InstrumentFile,
        design: &FeelDesign,
        knob: Option<&Info>,
    ) -> Vec<String> {
        let usual = KnobDesign { full_deg: design.travel_deg, ..KnobDesign::default() };
        let knob = match knob {
            None => "a knob that does not say what torque it makes".to_owned(),
            Some(info) => {
                let armed = match self.arm {
                    Some(mnm) => format!("may be armed with at most {mnm} mNm"),
                    None => "never armed: it turned freely".to_owned(),
                };
                format!("{}, {armed}", knob_in_words(info))
            }
        };
        let head = TakeHead {
            instrument: Some(file.name.clone()),
            feel: Some(feel_flags::in_flags(design)),
            hand: Some(TakeHand { design: usual, feels: true }),
            embouchure: Some(TakeEmbouchure::of(&self.reed.settings())),
        };
        let mut remarks = vec![
            format!(
                "Chalumeau {VERSION} take; t_us counts from the start of the link, angle from the knob's zero"
            ),
            format!("{written} (written {})", written.0),
            knob,
        ];
        remarks.extend(head.remarks());
        remarks
    }

    /// The further act that more than the usual ceiling needs.
    fn ask_again(&self) -> Result<(), Failure> {
        let Some(mnm) = self.arm.filter(|&mnm| mnm > f64::from(OFFERED_CEILING_MNM)) else { return Ok(()) };
        let number = format!("{mnm:.0}");
        write!(
            std::io::stderr(),
            "{number} mNm is as much as opening a tight jar lid. Nothing on the knob may catch a finger, a ring or a cable.\n\
             Type {number} and Enter to allow it: "
        )?;
        std::io::stderr().flush()?;
        let mut answer = String::new();
        std::io::stdin().lock().read_line(&mut answer)?;
        if answer.trim() == number {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "not armed: {number} was not typed. Up to {OFFERED_CEILING_MNM} mNm needs no second question"
        )))
    }

    fn choice(&self) -> KnobChoice {
        if let Some(path) = &self.path {
            return KnobChoice::Path(path.clone());
        }
        if let Some(name) = &self.midi {
            return KnobChoice::Midi { name: (!name.is_empty()).then(|| name.clone()) };
        }
        match self.osc {
            Some(port) => KnobChoice::Osc { port, any_address: self.network },
            None => KnobChoice::Serial { serial: self.serial },
        }
    }

    /// What the command asks of a knob that is there.
    fn begin(&self, link: &KnobLink) {
        if self.zero {
            link.zero();
        }
        match self.arm.map(|mnm| mnm.round() as u16) {
            Some(mnm) if mnm > OFFERED_CEILING_MNM => link.arm_beyond_offer(mnm),
            Some(mnm) => link.arm(mnm),
            None => {}
        }
    }

    /// Fails where the knob that has not answered until now is not going to.
    fn give_up(&self, status: &LinkStatus, waited: Duration) -> Result<(), Failure> {
        let refused = match (&status.phase, self.serial) {
            (Phase::HeldBy(holder), _) if self.arm.is_some() => format!(
                "not armed: the knob is in use by {holder}: end that program, then start this command again"
            ),
            (Phase::Busy(text), _) if self.arm.is_some() => {
                format!("not armed: {text}, then start this command again")
            }
            _ if waited <= PATIENCE => return Ok(()),
            (Phase::Searching, Some(serial)) => format!(
                "no knob after {} s: none with the serial number {} is there; without --serial, the first that answers is used",
                PATIENCE.as_secs(),
                serial_text(serial)
            ),
            _ => format!("no knob after {} s: {}", PATIENCE.as_secs(), status.text),
        };
        Err(Failure::Usage(refused))
    }

    fn watch(
        &self,
        link: &KnobLink,
        heard: &Receiver<StateSample>,
        mut note: NoteFeel,
        settle: &dyn Fn(&LinkStatus) -> Result<Settled, Failure>,
        mut file: Option<NewFile>,
    ) -> Result<(), Failure> {
        let closing_pa = self.reed.settings().closing_pa();
        let began = Instant::now();
        let mut live_since = None;
        let mut enter: Option<Arc<AtomicBool>> = None;
        let mut shown = Instant::now();
        let mut said = String::new();
        // The latest of a connected knob, whether it is lost now, and when it was.
        let (mut stats, mut is_lost, mut lost_s) = (LinkStats::default(), false, 0.0);
        let mut was_armed = false;
        // When it let go by itself, s.
        let mut let_go = None;
        // Begins with the remarks on the feel, which the knob's limits decide.
        let mut take = None;
        // Positions from before the zero would be a breath that nobody blew.
        let mut is_zeroed = !self.zero;
        let mut torque_mnm = None;
        // This thread obeys the user: what it prints is what the user sees. When it waits for its terminal, it beats no more.
        let heart = link.heartbeat("this program");
        let [stop, ends] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let (stopped, ending, hand) = (stop.clone(), ends.clone(), heart.clone());
        ctrlc::set_handler(move || {
            hand.let_go(Release::Interrupted);
            stopped.store(true, Ordering::Relaxed);
            std::thread::sleep(END_BY_FORCE);
            if !ending.load(Ordering::Relaxed) {
                remove_unfinished_and_exit(INTERRUPTED);
            }
        })
        .map_err(|e| Failure::Usage(format!("cannot listen for Ctrl-C: {e}")))?;
        loop {
            std::thread::sleep(Duration::from_millis(5));
            heart.beat();
            if stop.load(Ordering::Relaxed) {
                ends.store(true, Ordering::Relaxed);
                break;
            }
            let status = link.status();
            let is_watched = status.phase == Phase::VersionMismatch && self.arm.is_none();
            let is_connected = is_watched || matches!(status.phase, Phase::Live | Phase::ReadOnly);
            was_armed |= status.armed;
            if was_armed && !status.armed && let_go.is_none() {
                let_go = Some(began.elapsed().as_secs_f64());
            }
            if is_connected {
                (stats, is_lost) = (status.stats, false);
            } else if live_since.is_some() && !is_lost {
                (lost_s, is_lost) = (began.elapsed().as_secs_f64(), true);
            }
            // Where it stands decides whether it may be armed.
            if is_connected && live_since.is_none() && (self.arm.is_none() || status.angle_deg.is_some()) {
                live_since = Some(Instant::now());
                let settled = settle(&status)?;
                note = settled.note;
                take = file.take().map(|file| TakeFile::begin(file, settled.remarks.clone())).transpose()?;
                let stray_deg = status.stray_deg.filter(|_| !self.zero);
                match (self.arm.is_some(), stray_deg) {
                    (true, Some(stray_deg)) => enter = Some(ask_for_enter(&Doubt::Stray(stray_deg))?),
                    (true, None) if began.elapsed() > PROMPTLY => enter = Some(ask_for_enter(&Doubt::Late)?),
                    _ => self.begin(link),
                }
            }
            if enter.take_if(|pressed| pressed.load(Ordering::Relaxed)).is_some() {
                self.begin(link);
            }
            if live_since.is_none() {
                self.give_up(&status, began.elapsed())?;
            }
            let is_at_zero = || status.zeros > 0 || status.angle_deg.is_some_and(is_near_zero);
            if !is_zeroed && live_since.is_some() && is_at_zero() {
                is_zeroed = true;
                heard.try_iter().for_each(drop);
            }
            for state in heard.try_iter().filter(|_| is_zeroed) {
                torque_mnm = state.torque_mnm;
                let gamma = note.map.pressure_pa(f64::from(state.angle_deg)) / closing_pa;
                if let (Some(take), true) = (&mut take, live_since.is_some()) {
                    write(take, &state, &note, gamma)?;
                }
            }
            if shown.elapsed() >= SHOWN_EVERY {
                shown = Instant::now();
                show(&status, &note, closing_pa, torque_mnm, &mut said);
            }
            if let (Some(limit), Some(since)) = (self.seconds, live_since)
                && since.elapsed().as_secs_f64() >= limit
            {
                break;
            }
        }
        if std::io::stderr().is_terminal() {
            say!("");
        }
        say!(
            "{} positions, {:.0} a second; {} lost, {} damaged, {} duplicated; jitter p50 {:.2} ms, p99 {:.2} ms",
            stats.states,
            stats.rate_hz,
            stats.wire.lost,
            stats.wire.crc_errors + stats.wire.length_errors + stats.wire.range_errors,
            stats.wire.duplicates,
            1e-3 * f64::from(stats.jitter_p50_us),
            1e-3 * f64::from(stats.jitter_p99_us),
        );
        if !is_zeroed && take.is_some() {
            return Err(Failure::Usage(
                "the knob never showed its zero, so nothing was recorded; let it go where blowing should begin, and start again"
                    .to_owned(),
            ));
        }
        if let Some(take) = take {
            take.keep()?;
        }
        if is_lost {
            return Err(Failure::KnobLost { seconds: lost_s, text: link.status().text });
        }
        if self.arm.is_some() && !was_armed {
            return Err(Failure::Usage("the knob was never armed, so it made no torque".to_owned()));
        }
        let status = link.status();
        if let Some(alarm) = status.alarm {
            return Err(Failure::Usage(alarm));
        }
        if let Some(seconds) = let_go {
            let why = status.notice.unwrap_or(status.text);
            return Err(Failure::Usage(format!("the knob was no longer armed after {seconds:.1} s: {why}")));
        }
        Ok(())
    }
}

/// How near to its zero a knob is that has just been told to be there, degrees.
fn is_near_zero(angle_deg: f32) -> bool {
    angle_deg.abs() < 2.0
}

/// Why the user is asked before the knob is armed.
enum Doubt {
    /// It answered when the user may have turned to something else.
    Late,
    /// It stands so far from a zero that nobody has set, degrees.
    Stray(f32),
}

/// Asks for Enter; true once it is pressed. The answer is read elsewhere: this thread goes on obeying the user.
fn ask_for_enter(doubt: &Doubt) -> Result<Arc<AtomicBool>, Failure> {
    let (reason, way_out) = match doubt {
        Doubt::Late => (
            format!("the knob answered only after {} s", PROMPTLY.as_secs_f64()),
            "nobody is at a terminal to say that it may be armed now: start this command again",
        ),
        Doubt::Stray(stray_deg) => (
            format!(
                "the knob stands {stray_deg:.0} degrees from its zero, and may turn back there by itself"
            ),
            "let it go where blowing should begin, and add --zero",
        ),
    };
    if !std::io::stdin().is_terminal() {
        return Err(Failure::Usage(format!("not armed: {reason}; {way_out}")));
    }
    if let Doubt::Stray(_) = doubt {
        say!("Not armed yet: {reason}. Ctrl-C ends; --zero makes the present position zero");
    }
    say!("The knob is here. Let go of it, and press Enter to arm it; Ctrl-C ends");
    let pressed = Arc::new(AtomicBool::new(false));
    let told = pressed.clone();
    std::thread::spawn(move || {
        let mut answer = String::new();
        // A terminal that has gone says nothing.
        if std::io::stdin().lock().read_line(&mut answer).is_ok_and(|length| length > 0) {
            told.store(true, Ordering::Relaxed);
        }
    });
    Ok(pressed)
}

fn write(take: &mut TakeFile, state: &StateSample, note: &NoteFeel, gamma: f64) -> Result<(), OutputError> {
    let moment = TakeRow {
        t_us: u64::try_from(state.host_us).unwrap_or(0),
        angle_deg: f64::from(state.angle_deg),
        velocity_deg_s: f64::from(state.velocity_deg_s),
        torque_mnm: state.torque_mnm.map(f64::from),
        written: Some(note.written.0),
        gamma,
        feel_id: state.feel_id,
        armed: state.armed(),
    };
    let reed = Some((f64::from(note.feel.h), f64::from(note.feel.k)));
    let sounds_from = note.requirement.map(|required| required.gamma_sounding);
    take.write(&moment, &TakeMarks { reed, sounds_from, ..TakeMarks::default() })
        .map_err(|source| OutputError::Write { path: take.path().to_owned(), source })
}

/// On a terminal one line that changes; elsewhere a line for each change of the link.
fn show(status: &LinkStatus, note: &NoteFeel, closing_pa: f64, torque_mnm: Option<f32>, said: &mut String) {
    let mut words = status.text.clone();
    for more in
        [&status.alarm, &status.restriction, &status.last_refusal, &status.notice].into_iter().flatten()
    {
        words = format!("{words}; {more}");
    }
    // There is no second ARM here.
    if status.last_refusal.is_some() {
        words.push_str("; to arm again, end with Ctrl-C and start the same command");
    }
    if words != *said {
        let fresh = if std::io::stderr().is_terminal() { "\r\x1b[K" } else { "" };
        say!("{fresh}{words}");
        *said = words;
    }
    if let (Some(angle), true) = (status.angle_deg, std::io::stderr().is_terminal()) {
        let angle = f64::from(angle);
        let gamma = note.map.pressure_pa(angle) / closing_pa;
        let armed = match torque_mnm.filter(|_| status.armed) {
            Some(torque_mnm) => format!("torque {torque_mnm:4.0} of {} mNm", status.ceiling_mnm),
            None if status.armed => "armed".to_owned(),
            None => "not armed".to_owned(),
        };
        let _ = write!(
            std::io::stderr(),
            "\r\x1b[K{angle:8.1} degrees   gamma {gamma:.3}   threshold at {:.1}   {armed}",
            note.landmarks.a_on_deg
        );
        let _ = std::io::stderr().flush();
    }
}
