//! One golden frame, and its line in the list.

use chalumeau_knob::wire::Message;

/// The first line of a list: names of its columns.
pub const COLUMNS: &str = "file\tverdict\ttype\tseq\tfields\twrites\thex";

/// Bytes, and what a receiver must make of them.
#[derive(Clone, Debug)]
pub struct GoldenFrame {
    /// File it is kept in.
    pub file: String,
    /// What goes over the line.
    pub bytes: Vec<u8>,
    /// `ok`, or what is wrong: see `FrameError::verdict`.
    pub verdict: &'static str,
    /// Type and sequence number, where the checksum is good.
    pub head: Option<(u8, u8)>,
    /// The message, where the verdict is `ok`.
    pub message: Option<Message>,
    /// Name of the field refused, where the verdict is `range`.
    pub field: Option<&'static str>,
    /// Whether encoding the message gives the same bytes: not so where a later version appended fields.
    pub writes: bool,
}

impl GoldenFrame {
    /// Its line in the list; columns that do not apply hold `-`.
    pub fn line(&self) -> String {
        let dash = || "-".to_owned();
        let kind = self.head.map_or_else(dash, |(kind, _)| format!("0x{kind:02x}"));
        let seq = self.head.map_or_else(dash, |(_, seq)| seq.to_string());
        let said = self.message.as_ref().map(fields).filter(|text| !text.is_empty());
        let fields = said.or(self.field.map(str::to_owned)).unwrap_or_else(dash);
        let writes = if self.writes { "yes" } else { "no" };
        let hex: String = self.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        [&self.file, self.verdict, &kind, &seq, &fields, writes, &hex].join("\t")
    }
}

/// A list as it is kept: the columns' names and a line for each.
pub fn list(frames: &[GoldenFrame]) -> String {
    let lines = frames.iter().map(GoldenFrame::line);
    std::iter::once(COLUMNS.to_owned()).chain(lines).map(|line| line + "\n").collect()
}

/// Fields as `name=value`, separated by spaces, in the order of `docs/protocol.md`; floats in as many digits as give
/// them back exactly, enumerations as numbers, INFO's name in hex.
fn fields(message: &Message) -> String {
    match message {
        Message::Hello { major, minor, session } => format!("major={major} minor={minor} session={session}"),
        Message::Feel(f) => format!(
            "feel_id={} law={} morph_ms={} h={} k={} scale_mnm={} stretch={} offset_deg={} a_on_deg={} a_off_deg={} \
             a_beat_deg={} wall_deg={} wall_mnm_per_deg={} slap_mnm_per_deg={} damping_mnms={} friction={} detent={}",
            f.feel_id,
            f.law as u8,
            f.morph_ms,
            f.h,
            f.k,
            f.scale_mnm,
            f.stretch,
            f.offset_deg,
            f.a_on_deg,
            f.a_off_deg,
            f.a_beat_deg,
            f.wall_deg,
            f.wall_mnm_per_deg,
            f.slap_mnm_per_deg,
            f.damping_mnms,
            f.friction,
            f.detent
        ),
        Message::Arm(arm) | Message::Alive(arm) => {
            let stamp = arm.stamp.map(|stamp| format!(" epoch={} heard_us={}", stamp.epoch, stamp.heard_us));
            format!("session={} ceiling_mnm={}{}", arm.session, arm.ceiling_mnm, stamp.unwrap_or_default())
        }
        Message::Free => String::new(),
        Message::Zero(angle) => format!("angle={angle}"),
        Message::Rate(hz) => format!("hz={hz}"),
        Message::Bye { session } => format!("session={session}"),
        Message::Info(i) => format!(
            "major={} minor={} capabilities={} firmware_major={} firmware_minor={} firmware_patch={} name={} serial={} \
             counts_per_turn={} loop_hz={} watchdog_ms={} fade_ms={} ceiling_mnm={} session={} stiffness_limit={} \
             push_limit={}{}",
            i.major,
            i.minor,
            i.capabilities.0,
            i.firmware.0,
            i.firmware.1,
            i.firmware.2,
            i.name.iter().map(|byte| format!("{byte:02x}")).collect::<String>(),
            i.serial,
            i.counts_per_turn,
            i.loop_hz,
            i.watchdog_ms,
            i.fade_ms,
            i.ceiling_mnm,
            i.session,
            i.stiffness_limit,
            i.push_limit,
            i.counters.map_or_else(String::new, |counters| format!(
                " overruns={} bus_errors={}",
                counters.overruns, counters.bus_errors
            ))
        ),
        Message::State(s) => format!(
            "t_us={} angle={} velocity={} torque={} flags={} feel_id={} slaps={} events={} fault={}{}",
            s.t_us,
            s.angle,
            s.velocity,
            s.torque,
            s.flags.0,
            s.feel_id,
            s.slaps,
            s.events,
            s.fault,
            s.epoch.map_or_else(String::new, |epoch| format!(" epoch={epoch}"))
        ),
        Message::Event(e) => format!(
            "kind={} counter={} code={} feel_id={} t_us={} value={}",
            e.kind as u8, e.counter, e.code, e.feel_id, e.t_us, e.value
        ),
    }
}
