//! What a link shows of itself.

use crate::device::runtime_dir::serial_text;
use crate::device::stats::LinkStats;
use crate::wire::Info;
use crate::wire::plain_text::plain;

/// Where a link stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Phase {
    /// No knob is chosen.
    #[default]
    Off,
    /// Nothing to open yet.
    Searching,
    /// A port is open and nothing has answered yet.
    Waiting,
    /// A knob with this library's firmware: position, feel, everything.
    Live,
    /// Positions without an answer to HELLO: unmodified firmware over OSC, or plain MIDI.
    ReadOnly,
    /// It was there and is not any more; looked for.
    Lost {
        /// How long ago, seconds.
        seconds: f32,
    },
    /// Another instance has it: who.
    HeldBy(String),
    /// The system does not let this user open the port: what to do.
    NoPermission(String),
    /// Another program has the port: what to do.
    Busy(String),
    /// The knob speaks another major version: the program reads its position and never arms it.
    VersionMismatch,
    /// Unmodified firmware answers at the serial port, where it can do no more than that: its name.
    StockSerial(String),
    /// The port opens and nothing that is known answers.
    NoAnswer(String),
    /// Anything else that keeps the port from opening.
    Failed(String),
}

impl Phase {
    /// Of several problems, the screen shows the one with the highest rank.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Self::HeldBy(_) => 6,
            Self::NoPermission(_) => 5,
            Self::Busy(_) => 4,
            Self::StockSerial(_) => 3,
            Self::Failed(_) => 2,
            Self::NoAnswer(_) => 1,
            _ => 0,
        }
    }

    /// The status in one line for people.
    pub(super) fn text(&self, port: &str, info: Option<&Info>) -> String {
        // A MIDI device names its port.
        let port = plain(port);
        let knob = || {
            let Some(info) = info else { return "the knob".into() };
            let (major, minor, patch) = info.firmware;
            format!("{} {} (firmware {major}.{minor}.{patch})", info.name_text(), serial_text(info.serial))
        };
        match self {
            Self::Off => "no knob chosen".into(),
            Self::Searching => "no knob found: plug one in, or start `chalumeau knob-sim`".into(),
            Self::Waiting => format!("waiting for an answer at {port}"),
            Self::Live => format!("{} at {port}", knob()),
            Self::ReadOnly => format!("{port}: {}", crate::device::stock::LABEL),
            Self::Lost { seconds } => {
                format!("connection lost {seconds:.0} s ago; the knob will be disarmed when it returns")
            }
            Self::HeldBy(holder) => format!("in use by {holder}"),
            Self::NoPermission(text) | Self::Busy(text) | Self::NoAnswer(text) | Self::Failed(text) => {
                text.clone()
            }
            Self::VersionMismatch => {
                let version = info.map_or((0, 0), |info| (info.major, info.minor));
                format!(
                    "{} speaks TTLink {}.{}, this program {}.{}: the program reads its position and never arms it",
                    knob(),
                    version.0,
                    version.1,
                    crate::wire::MAJOR,
                    crate::wire::MINOR
                )
            }
            Self::StockSerial(name) => format!(
                "{name} at {port} has its stock firmware, which sends no position over USB: choose OSC, port 8000, to \
                 play it without feel, or flash the firmware in firmware/ (docs/touch.md)"
            ),
        }
    }
}

/// A link as screens show it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkStatus {
    /// Where it stands.
    pub phase: Phase,
    /// The same in one line for people.
    pub text: String,
    /// 2 with this library's firmware, else 0.
    pub tier: u8,
    /// What the knob says of itself.
    pub info: Option<Info>,
    /// The knob's serial number, of the knob that is held by another too.
    pub serial: Option<u64>,
    /// Port in use, or last in use.
    pub port: String,
    /// True while the knob is armed.
    pub armed: bool,
    /// True while the knob has been told to arm and has not done so yet: it may turn, to test its signs.
    pub arming: bool,
    /// How often the knob has shown in this connection that it has heard ZERO.
    pub zeros: u32,
    /// How far it stands from a zero that nobody has set or armed at since it was connected or has restarted, degrees, if
    /// that is more than 5: armed there, it may turn back by itself.
    pub stray_deg: Option<f32>,
    /// Most torque allowed, mNm, as the last ARM set it.
    pub ceiling_mnm: u16,
    /// Why something that was wanted did not happen; the latest.
    pub last_refusal: Option<String>,
    /// What the knob reported last of faults and of disarming by itself.
    pub notice: Option<String>,
    /// Why the knob is not trusted with torque, and what to do: to be shown before anything else.
    pub alarm: Option<String>,
    /// Why this knob is asked for less torque than the user allows.
    pub restriction: Option<String>,
    /// Position as it came last, degrees.
    pub angle_deg: Option<f32>,
    /// Torque that it reports after all its limits, mNm, negative against the breath; `None` from a knob that does not tell.
    pub torque_mnm: Option<f32>,
    /// The knob's button is down.
    pub button: bool,
    /// The line runs at 115200 baud.
    pub is_slow: bool,
    /// Counts and times.
    pub stats: LinkStats,
}
