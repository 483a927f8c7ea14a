//! Torque by way of a bridge (tier 1): when the feel leaves as OSC, and when it ends.
//!
//! A bridge has no session: it passes on what it gets. So the rules that a session keeps for a knob of tier 2 are kept here for
//! one that only sends its position: nothing leaves before the user has armed it; a release, a thread that no longer obeys the
//! user, a knob that falls silent and the end of the connection take the torque away; and only another act brings it back.
//! Beside a knob of tier 2, which has its own session, the feel leaves while that knob is armed.

use crate::device::feel_osc::FeelSender;
use crate::device::heartbeat::{OBEDIENCE_US, Pulse};
use crate::device::session::arming::{HARD_CEILING_MNM, OFFERED_CEILING_MNM};
use crate::wire::Feel;
use chalumeau_core::haptics::torque_law;

/// What people must know while torque goes this way.
const WARNING: &str = "the torque goes through the bridge: if this program ends, the bridge takes it away after 3 s; if the \
                       bridge ends or the network fails, the knob keeps it: have the motor's switch within reach";

/// Why a knob that only sends its position is not armed without a bridge.
const NO_BRIDGE: &str = "this knob's firmware can only be read. Only a bridge to libmapper gives it a feel: Feel OSC port, docs/touch.md";

/// See the module.
#[derive(Default)]
pub struct BridgedFeel {
    sender: Option<FeelSender>,
    /// Most torque that the user allows, mNm; `None` while disarmed.
    ceiling_mnm: Option<u16>,
    notice: Option<String>,
}

impl BridgedFeel {
    /// Sends to another bridge, or to none. What the one before was told ends.
    pub fn send_to(&mut self, sender: Option<FeelSender>) {
        self.disarm();
        self.sender = sender;
    }

    /// Most torque allowed, mNm; `None` while disarmed.
    pub fn ceiling_mnm(&self) -> Option<u16> {
        self.ceiling_mnm
    }

    /// Why it was disarmed.
    pub fn notice(&self) -> Option<&str> {
        self.notice.as_deref()
    }

    /// What to know while it is armed.
    pub fn warning(&self) -> Option<&'static str> {
        self.ceiling_mnm.map(|_| WARNING)
    }

    /// The user allows torque: only ever call it for an act of the user. An error, with the reason, where there is no bridge, nobody
    /// obeys or the knob is silent.
    pub fn arm(
        &mut self,
        ceiling_mnm: u16,
        further_act: bool,
        pulse: &Pulse,
        is_heard: bool,
        now_us: i64,
    ) -> Result<(), String> {
        let no_bridge = self.sender.is_none().then(|| NO_BRIDGE.to_owned());
        if let Some(why) = no_bridge.or_else(|| reason(pulse, is_heard, now_us)) {
            // A stop that came meanwhile holds for what was armed before, too.
            self.ceiling_mnm = None;
            return Err(format!("not armed: {why}"));
        }
        let most_mnm = if further_act { HARD_CEILING_MNM } else { OFFERED_CEILING_MNM };
        (self.ceiling_mnm, self.notice) = (Some(ceiling_mnm.min(most_mnm)), None);
        Ok(())
    }

    /// Lowers the ceiling; never raises it.
    pub fn lower(&mut self, ceiling_mnm: u16) {
        self.ceiling_mnm = self.ceiling_mnm.map(|mnm| mnm.min(ceiling_mnm));
    }

    /// Torque off.
    pub fn disarm(&mut self) {
        (self.ceiling_mnm, self.notice) = (None, None);
    }

    /// Takes it away if somebody wants that, or if an end is silent.
    pub fn watch(&mut self, pulse: &Pulse, is_heard: bool, now_us: i64) {
        if self.ceiling_mnm.is_some()
            && let Some(why) = reason(pulse, is_heard, now_us)
        {
            (self.ceiling_mnm, self.notice) = (None, Some(format!("disarmed: {why}")));
        }
    }

    /// Sends what is due. `session_mnm` is the ceiling of a knob of tier 2 while it is armed.
    pub fn poll(&mut self, feel: Option<&Feel>, session_mnm: Option<u16>, now_us: i64) {
        let Some(sender) = &mut self.sender else { return };
        match (feel, self.ceiling_mnm.or(session_mnm)) {
            (Some(feel), Some(ceiling_mnm)) => {
                // Together they stay under the ceiling. Wall and slap are stiffnesses: only the knob can limit their torque.
                let friction = feel.friction.min(ceiling_mnm.saturating_mul(10));
                let detent = feel.detent.min(ceiling_mnm.saturating_mul(10) - friction);
                let left_mnm = f32::from(ceiling_mnm) - 0.1 * f32::from(friction + detent);
                let scale_mnm = feel.scale_mnm.min(left_mnm / peak(feel));
                sender.poll(&Feel { scale_mnm, friction, detent, ..*feel }, now_us);
            }
            _ => sender.rest(now_us),
        }
    }
}

/// Largest torque of a law, over its scale; 1 or more. Firmware that does not know H and k has 1.
fn peak(feel: &Feel) -> f32 {
    let law = Feel { scale_mnm: 1.0, detent: 0, ..*feel };
    torque_law::extremes(&law).torque_mnm.max(1.0) as f32
}

/// Why there must be no torque.
fn reason(pulse: &Pulse, is_heard: bool, now_us: i64) -> Option<String> {
    if let Some(release) = pulse.released {
        return Some(release.text().into());
    }
    match pulse.oldest {
        None => Some("nobody is there to obey you".into()),
        Some((at_us, who)) if now_us - at_us > OBEDIENCE_US => Some(format!("{who} has stood still")),
        Some(_) if !is_heard => Some("the knob sends nothing".into()),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::heartbeat::Release;
    use chalumeau_core::haptics::feel_parameters::TorqueLaw;
    use rosc::OscPacket;
    use std::net::UdpSocket;
    use std::time::Duration;

    /// A bridge that remembers the scale of each bundle.
    struct Bridge(UdpSocket);

    impl Bridge {
        fn new() -> (Self, BridgedFeel) {
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
            let sender = FeelSender::new(socket.local_addr().unwrap()).unwrap();
            (Self(socket), BridgedFeel { sender: Some(sender), ..BridgedFeel::default() })
        }

        /// Scale and the sum of everything else that makes torque, of the bundles that have come.
        fn heard(&self) -> Vec<(f32, f32)> {
            let (mut all, mut buffer) = (Vec::new(), [0; 2048]);
            while let Ok(length) = self.0.recv(&mut buffer) {
                let (_, OscPacket::Bundle(bundle)) = rosc::decoder::decode_udp(&buffer[..length]).unwrap()
                else {
                    panic!("no bundle")
                };
                let (mut scale, mut others) = (f32::NAN, 0.0);
                for packet in bundle.content {
                    let OscPacket::Message(mut message) = packet else { panic!("no message") };
                    let value = message.args.remove(0).float().unwrap();
                    match message.addr.trim_start_matches("/chalumeau/feel/") {
                        "scale" => scale = value,
                        "damping" | "friction" | "detent" | "wall_mnm_per_deg" | "slap_mnm_per_deg" => {
                            others += value;
                        }
                        _ => {}
                    }
                }
                all.push((scale, others));
            }
            all
        }
    }

    fn pulse(at_us: i64) -> Pulse {
        Pulse { oldest: Some((at_us, "the host")), released: None }
    }

    fn feel() -> Feel {
        Feel { scale_mnm: 90.0, damping_mnms: 1.0, friction: 20, detent: 10, ..Feel::default() }
    }

    /// Armed with 60 mNm, and the first feel heard.
    fn armed() -> (Bridge, BridgedFeel) {
        let (bridge, mut feels) = Bridge::new();
        feels.poll(Some(&feel()), None, 0);
        assert_eq!(bridge.heard(), [], "nothing leaves before an act of the user");
        feels.arm(60, false, &pulse(0), true, 0).unwrap();
        feels.poll(Some(&feel()), None, 1_000);
        let heard = bridge.heard();
        assert_eq!(heard.len(), 1);
        assert!(heard[0].0 == 57.0 && heard[0].1 > 0.0, "the ceiling holds: {heard:?}");
        (bridge, feels)
    }

    #[test]
    fn a_flow_law_that_exceeds_its_scale_stays_under_the_ceiling() {
        let (bridge, mut feels) = armed();
        let bare = Feel { damping_mnms: 0.0, wall_mnm_per_deg: 0.0, slap_mnm_per_deg: 0.0, ..feel() };
        let wide = Feel { law: TorqueLaw::Flow, h: 4.2, k: 0.3849, ..bare };
        feels.poll(Some(&wide), None, 1_000_000);
        let heard = bridge.heard();
        let most = torque_law::extremes(&Feel { scale_mnm: heard[0].0, ..wide }).torque_mnm + 2.0;
        assert!((59.0..=60.0).contains(&most), "{heard:?}: {most}");
    }

    #[test]
    fn a_stop_that_comes_with_another_arm_ends_the_torque() {
        let (bridge, mut feels) = armed();
        let stopped = Pulse { released: Some(Release::Stop), ..pulse(1_000_000) };
        assert!(feels.arm(60, false, &stopped, true, 1_000_000).is_err());
        assert_eq!(feels.ceiling_mnm(), None);
        feels.poll(Some(&feel()), None, 1_010_000);
        assert_eq!(bridge.heard(), [(0.0, 0.0)]);
    }

    #[test]
    fn a_lower_ceiling_holds_for_friction_and_mark_too() {
        let (bridge, mut feels) = armed();
        feels.lower(3);
        let bare = Feel { damping_mnms: 0.0, wall_mnm_per_deg: 0.0, slap_mnm_per_deg: 0.0, ..feel() };
        feels.poll(Some(&bare), None, 1_000_000);
        assert_eq!(bridge.heard(), [(0.0, 3.0)], "friction 2 mNm, mark 1 mNm");
    }

    #[test]
    fn every_end_takes_all_torque_away_and_then_nothing_more_is_said() {
        type End = fn(&mut BridgedFeel);
        let ends: [(&str, End); 6] = [
            ("disarmed", |feels| feels.disarm()),
            ("stop", |feels| {
                feels.watch(&Pulse { released: Some(Release::Stop), ..pulse(2_000) }, true, 2_000);
                assert_eq!(feels.notice(), Some("disarmed: stop was pressed"));
            }),
            ("a thread stands", |feels| {
                feels.watch(&pulse(0), true, OBEDIENCE_US);
                assert!(feels.ceiling_mnm().is_some());
                feels.watch(&pulse(0), true, OBEDIENCE_US + 1);
                assert_eq!(feels.notice(), Some("disarmed: the host has stood still"));
            }),
            ("nobody", |feels| feels.watch(&Pulse { oldest: None, released: None }, true, 2_000)),
            ("the knob is silent", |feels| feels.watch(&pulse(2_000), false, 2_000)),
            ("no feel", |_| {}),
        ];
        for (name, end) in ends {
            let (bridge, mut feels) = armed();
            end(&mut feels);
            let wanted = (name != "no feel").then(feel);
            for ms in 600..4_000 {
                feels.poll(wanted.as_ref(), None, 1_000 * ms);
            }
            let heard = bridge.heard();
            assert!(
                !heard.is_empty() && heard.iter().all(|torque| *torque == (0.0, 0.0)),
                "{name}: {heard:?}"
            );
            assert!(heard.len() <= 3, "{name}: {heard:?}");
        }
    }

    #[test]
    fn the_end_of_the_sender_takes_the_torque_away_too() {
        for drops in [true, false] {
            let (bridge, mut feels) = armed();
            if drops {
                drop(feels);
            } else {
                feels.send_to(None);
            }
            assert_eq!(bridge.heard(), [(0.0, 0.0)]);
        }
        let (bridge, mut feels) = Bridge::new();
        feels.send_to(None);
        assert_eq!(bridge.heard(), [], "a bridge that was told nothing has nothing to end");
    }

    #[test]
    fn beside_a_knob_of_tier_2_the_feel_leaves_while_that_is_armed() {
        let (bridge, mut feels) = Bridge::new();
        for (ms, ceiling) in [(0, None), (10, Some(50)), (20, Some(50)), (30, None)] {
            feels.poll(Some(&feel()), ceiling, 1_000 * ms);
        }
        let scales: Vec<f32> = bridge.heard().iter().map(|(scale, _)| *scale).collect();
        assert_eq!(scales, [47.0, 0.0], "beside friction and mark");
    }

    #[test]
    fn it_is_not_armed_where_nobody_obeys() {
        let (_bridge, mut feels) = Bridge::new();
        for (pulse, is_heard) in [
            (pulse(0), true),
            (Pulse { oldest: None, released: None }, true),
            (pulse(1_000_000), false),
            (Pulse { released: Some(Release::Stop), ..pulse(1_000_000) }, true),
        ] {
            assert!(feels.arm(60, false, &pulse, is_heard, 1_000_000).is_err(), "{pulse:?}");
            assert_eq!(feels.ceiling_mnm(), None);
        }
        feels.arm(900, false, &pulse(0), true, 0).unwrap();
        assert_eq!(feels.ceiling_mnm(), Some(OFFERED_CEILING_MNM));
        feels.lower(40);
        feels.lower(80);
        assert_eq!(feels.ceiling_mnm(), Some(40));
    }
}
