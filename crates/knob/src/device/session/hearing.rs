//! What the host makes of the device's messages: the receiving half of [`HostSession`].

use super::arming::ArmingEnd;
use super::trust::Expected;
use super::{
    HostSession, Incoming, LONGEST_PERIOD_US, Notice, PLAIN_GAP_US, PLAIN_PERIOD_US, SessionEvent,
    StateSample, ZERO_IS_LOST,
};
use crate::device::clock::DeviceClock;
use crate::device::session::slaps::Slaps;
use crate::device::transport::Binding;
use crate::wire;
use crate::wire::midi::{BREATH_MAX, FromKnob};
use crate::wire::{DeviceEvent, DeviceState, EventKind, Info, Message, RefusedCode};

/// Degrees a second of one step of a velocity: 0.1 rpm.
const VELOCITY_DEG_S: f64 = 0.6;
/// Age that stands for a permission of another epoch, ms: none that a line can have.
const AGELESS_MS: f32 = 1e6;

impl HostSession {
    pub(super) fn hear_midi(&mut self, bytes: &[u8], now_us: i64, tell: &mut dyn FnMut(SessionEvent)) {
        let Incoming::Midi(receiver) = &mut self.ears else { return };
        // A block of bytes holds few values; those of one call are taken in after it.
        let mut heard = Vec::new();
        if bytes.is_empty() {
            receiver.poll(now_us as u64, |what| heard.push(what));
        } else {
            receiver.feed(bytes, now_us as u64, |what| heard.push(what));
        }
        for what in heard {
            match what {
                FromKnob::Frame(Ok((_, message))) => self.hear(&message, now_us, tell),
                FromKnob::Frame(Err(_)) => {}
                // STATE says it all and better.
                _ if self.state.is_some() => {}
                FromKnob::Button(down) => tell(SessionEvent::Button(down)),
                FromKnob::Angle(tenths) => {
                    self.has_plain_angle = true;
                    self.hear_plain(0.1 * tenths as f32, now_us, tell);
                }
                // The same position a second time, and only half of it.
                FromKnob::Breath(_) if self.has_plain_angle => {}
                FromKnob::Breath(breath) => {
                    let wall_deg = self.feeling.wanted().unwrap_or_default().wall_deg;
                    self.hear_plain(f32::from(breath) / f32::from(BREATH_MAX) * wall_deg, now_us, tell);
                }
            }
        }
    }

    /// An angle without a clock.
    fn hear_plain(&mut self, angle_deg: f32, now_us: i64, tell: &mut dyn FnMut(SessionEvent)) {
        let velocity_deg_s = match self.plain {
            Some(before) if (1..PLAIN_GAP_US).contains(&(now_us - before.host_us)) => {
                (angle_deg - before.angle_deg) / ((now_us - before.host_us) as f32 * 1e-6)
            }
            _ => 0.0,
        };
        let sample = StateSample {
            host_us: now_us,
            t_us: now_us as u32,
            angle_deg,
            velocity_deg_s,
            period_us: PLAIN_PERIOD_US,
            ..StateSample::default()
        };
        self.plain = Some(sample);
        self.meter.state(0);
        tell(SessionEvent::State(sample));
    }

    pub(super) fn hear(&mut self, message: &Message, now_us: i64, tell: &mut dyn FnMut(SessionEvent)) {
        match message {
            Message::Info(info) => self.hear_info(info, now_us),
            Message::State(state) => self.hear_state(state, now_us, tell),
            Message::Event(event) => self.hear_event(event, tell),
            // What a host says: an echo of our own, or two hosts wired together.
            _ => {}
        }
    }

    fn hear_info(&mut self, info: &Info, now_us: i64) {
        if info.session != self.number {
            self.notice = Some(Notice::AnswersAnother);
            return;
        }
        self.meter.hello_round_trip_us = u32::try_from(now_us - self.hello_us).ok();
        self.info_us = Some(now_us);
        if info.speaks_our_major()
            && let Some(doubt) = self.trust.info(info)
        {
            self.distrust(doubt, now_us);
        }
        // Answered again: it was silent, not gone.
        if self.info.replace(*info).is_none() {
            self.notice = self.notice.take().filter(|notice| !matches!(notice, Notice::AnswersAnother));
            self.rate_due = self.binding == Binding::Serial;
            self.is_dated = false;
            self.feeling.forget();
            // What had piled up on the line before anybody read it is no loss of this session, tells no rate, and is too old to
            // compare clocks by: the positions after it would look like those of a knob that has restarted.
            // Until the next position, the knob has said nothing, and cannot be armed.
            self.clock = DeviceClock::default();
            self.state = None;
            self.meter.begin(now_us);
            match &mut self.ears {
                Incoming::Midi(receiver) => receiver.forget_counts(),
                Incoming::Stream(decoder) => decoder.forget_counts(),
            }
        }
    }

    fn hear_state(&mut self, state: &DeviceState, now_us: i64, tell: &mut dyn FnMut(SessionEvent)) {
        if self.clock.observe(state.t_us, now_us) && self.info.is_some() {
            self.notice =
                Some(Notice::Told(format!("the knob has restarted and is disarmed; {ZERO_IS_LOST}")));
            self.take_away(now_us);
            self.is_zero_known = false;
            self.trust.restart();
            self.feeling.forget();
            self.slaps = Slaps::default();
            self.last_event = None;
            self.info = None;
            self.greeting.again(now_us);
        }
        if let Some((before, _)) = &self.state {
            let step_us = state.t_us.wrapping_sub(before.t_us);
            if (1..LONGEST_PERIOD_US).contains(&step_us) {
                self.mean_step_us += (step_us as f32 - self.mean_step_us) / 64.0;
            }
        }
        let host_us = self.clock.host_us(state.t_us).unwrap_or(now_us);
        self.meter.state(now_us - host_us);
        self.state = Some((*state, now_us));
        self.is_dated = self.info.is_some();
        self.slaps.state(state.slaps, now_us);
        let is_played = self.judge(state, now_us);
        if self.zeroing.hear(state.angle_deg(), VELOCITY_DEG_S * f64::from(state.velocity), now_us) {
            self.zeros = self.zeros.wrapping_add(1);
            self.is_zero_known = true;
        }
        let is_probing = state.flags.has(wire::Flags::PROBING);
        let end = self.arming.hear(state.flags.armed(), is_probing, state.epoch, now_us);
        if let Some(end) = end {
            self.zeroing.forget();
            // Its EVENT says it better, before or after this.
            if self.notice.is_none() {
                let why = state.fault_code().map_or("the knob has disarmed itself", |code| code.text());
                let so = if end == ArmingEnd::Disarmed { "disarmed" } else { "not armed" };
                self.notice = Some(Notice::Told(format!("{so}: {why}")));
            }
        }
        if self.arming.is_armed() {
            self.is_zero_known = true;
            self.zeroing.forget();
        }
        if let Some(round_trip_us) = self.feeling.echoed(state.feel_id, now_us) {
            self.meter.feel_echoed(round_trip_us);
        }
        if !is_played {
            return; // the knob may be anywhere
        }
        tell(SessionEvent::State(StateSample {
            host_us,
            t_us: state.t_us,
            angle_deg: state.angle_deg() as f32,
            velocity_deg_s: VELOCITY_DEG_S as f32 * f32::from(state.velocity),
            torque_mnm: Some(f32::from(state.torque)),
            feel_id: state.feel_id,
            flags: state.flags.0,
            period_us: self.period_us(),
        }));
    }

    /// Whether the knob says what it may. False: its angle is not to be played.
    fn judge(&mut self, state: &DeviceState, now_us: i64) -> bool {
        if !self.info.is_some_and(|info| info.speaks_our_major()) {
            return true;
        }
        let expected = Expected {
            armed: self.arming.is_wanted(),
            ceiling_mnm: self.arming.ceiling_mnm(),
            zero_us: self.zero_us,
            feel_unechoed_us: self.feeling.unechoed_us(now_us),
        };
        let (doubt, is_played) = self.trust.state(state, expected, now_us);
        if let Some(doubt) = doubt {
            self.distrust(doubt, now_us);
        }
        is_played
    }

    /// Time between two STATE as a rule. In steps, so that one that is lost does not move the breath.
    fn period_us(&self) -> u32 {
        (self.mean_step_us / 500.0).round().max(1.0) as u32 * 500
    }

    /// The knob tells why it makes no torque. An ARM that is said again would answer what came before.
    fn gives_up(&mut self, why: String) {
        if self.arming.give_up() {
            self.zeroing.forget();
        }
        self.notice = Some(Notice::Told(why));
    }

    fn hear_event(&mut self, event: &DeviceEvent, tell: &mut dyn FnMut(SessionEvent)) {
        if self.last_event.replace(event.counter) == Some(event.counter) {
            return;
        }
        let text = event.code_text().unwrap_or_default();
        match event.kind {
            EventKind::Slap => {
                self.slaps.event();
                tell(SessionEvent::Slap(event.value));
            }
            EventKind::Button => tell(SessionEvent::Button(event.value > 0.5)),
            EventKind::Limit => {}
            EventKind::Fault => self.gives_up(format!("fault: {text}")),
            // Of FREE this side knows the reason better.
            EventKind::Disarmed if event.code == wire::FaultCode::Free as u8 => {}
            EventKind::Disarmed => self.gives_up(format!("disarmed: {text}")),
            // The codes up to 7 are about FEEL, of which the one refused is named.
            EventKind::Refused if event.code <= RefusedCode::LawUnknown as u8 => {
                if self.feeling.refused(event.feel_id) {
                    self.refusal = Some(format!("{text} ({})", event.value));
                }
            }
            // The next try answers a newer STATE. Of an armed knob it is an ALIVE that came late.
            EventKind::Refused if event.code == RefusedCode::Stale as u8 => {
                let age = (event.value < AGELESS_MS).then(|| format!(" ({:.0} ms)", event.value));
                self.refusal = Some(format!("{text}{}", age.unwrap_or_default()));
            }
            EventKind::Refused => {
                // Of the rest only this one is not about ARM.
                if event.code != RefusedCode::ZeroWhileArmed as u8 {
                    self.arming.forget();
                }
                self.refusal = Some(text.into());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::session::arming;
    use crate::wire::FaultCode;

    /// What a session says after these messages.
    fn notice(messages: &[Message]) -> Option<String> {
        let mut session = HostSession::new(Binding::Serial, 7, 0);
        messages.iter().for_each(|message| session.hear(message, 0, &mut |_| {}));
        session.notice().map(str::to_owned)
    }

    #[test]
    fn only_an_answer_to_another_program_is_settled_by_an_answer_to_this_one() {
        let own = Message::Info(arming::tests::info(450));
        let other = Message::Info(Info { session: 8, ..arming::tests::info(450) });
        let answers_another = Some("the knob answers another program".to_owned());
        assert_eq!(notice(&[other]), answers_another);
        assert_eq!(notice(&[other, own]), None);
        let taken = Message::Event(DeviceEvent {
            kind: EventKind::Disarmed,
            counter: 1,
            code: FaultCode::NewSession as u8,
            feel_id: 0,
            t_us: 0,
            value: 0.0,
        });
        let text = format!("disarmed: {}", FaultCode::NewSession.text());
        assert_eq!(notice(&[taken, own]), Some(text));
    }
}
