//! What controllers and channel pressure mean to the decoder: who they belong to, and what they ask of the player.

use super::breath::{BreathController, Heard, Part};
use super::links::{Raws, Source};
use super::mix::MixControllers;
use super::snapshot::{PRESSURE, Place, Run};
use super::techniques::TechniqueControllers;
use super::{BreathOrigin, MidiDecoder};
use crate::control::bends::Bends;
use crate::event::Event;

const BREATH: u8 = 2;
const DATA_ENTRY: u8 = 6;
const VOLUME: u8 = 7;
const PAN: u8 = 10;
const EXPRESSION: u8 = 11;
const BREATH_FINE: u8 = BREATH + 32;
const DATA_ENTRY_FINE: u8 = DATA_ENTRY + 32;
const EXPRESSION_FINE: u8 = EXPRESSION + 32;
const SUSTAIN: u8 = 64;
const NRPN_FINE: u8 = 98;
const NRPN: u8 = 99;
const RPN_FINE: u8 = 100;
const RPN: u8 = 101;
const ALL_SOUND_OFF: u8 = 120;
const RESET_CONTROLLERS: u8 = 121;
const ALL_NOTES_OFF: u8 = 123;

/// Controllers that breath can come from.
pub const BREATH_LIKE: [u8; 4] = [BREATH, BREATH_FINE, EXPRESSION, EXPRESSION_FINE];

/// Controllers that end all notes.
pub const ENDS_ALL: [u8; 2] = [ALL_SOUND_OFF, ALL_NOTES_OFF];

/// From this value on the pedal is down.
const PEDAL_DOWN: u8 = 64;

/// Registered parameter "none selected".
const RPN_NONE: [u8; 2] = [127, 127];
const RPN_BEND_RANGE: [u8; 2] = [0, 0];
const RPN_MPE_ZONE: [u8; 2] = [0, 6];

/// Where controllers, bend ranges and pedal were before a run.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    mix: MixControllers,
    techniques: TechniqueControllers,
    links: Raws,
    bends: Bends,
    pedal: bool,
}

/// What the decoder knows of one channel.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Registered parameter that data entry would set, coarse then fine.
    rpn: [u8; 2],
    /// Its controllers since the last note.
    pub run: Run,
    before: Before,
}

impl Default for Channel {
    fn default() -> Self {
        Self { rpn: RPN_NONE, run: Run::default(), before: Before::default() }
    }
}

impl MidiDecoder {
    /// A control change. Real-time safe.
    pub fn controller(&mut self, channel: u8, cc: u8, value: u8) -> &[Event] {
        self.begin();
        let (at, cc, value) = (usize::from(channel % 16), cc.min(127), value.min(127));
        let place = self.place(at, cc);
        match cc {
            // The fine part of a linked controller belongs to it, and a link has 128 steps.
            BREATH_FINE | EXPRESSION_FINE if self.links.has(Source::Controller(cc - 32)) => {}
            _ if self.links.has(Source::Controller(cc)) => self.follow(Source::Controller(cc), value, place),
            BREATH => self.hear(BreathController::Breath, at, Part::Coarse(value), place, false),
            BREATH_FINE => self.hear(BreathController::Breath, at, Part::Fine(value), place, false),
            EXPRESSION => self.hear(BreathController::Expression, at, Part::Coarse(value), place, false),
            EXPRESSION_FINE => self.hear(BreathController::Expression, at, Part::Fine(value), place, false),
            // A host that stops behind a snapshot means it.
            ALL_SOUND_OFF => self.cut_all(),
            // Notes that the pedal holds end, too: a host that stops leaves none. The pedal itself stays where it is.
            ALL_NOTES_OFF => self.lift_all(),
            _ if matches!(place, Place::Recognised | Place::Within) => {}
            _ => self.control(at, cc, value),
        }
        self.said.events()
    }

    /// A controller that is not breath.
    fn control(&mut self, at: usize, cc: u8, value: u8) {
        if self.techniques.controllers.set(cc, value) {
            self.say_techniques();
            return;
        }
        let state = &mut self.channels[at];
        match cc {
            VOLUME => {
                self.mix.controllers.volume = value;
                self.remix();
            }
            PAN => {
                self.mix.controllers.pan = value;
                self.remix();
            }
            SUSTAIN => self.set_pedal(value >= PEDAL_DOWN),
            RPN | RPN_FINE => state.rpn[usize::from(cc == RPN_FINE)] = value,
            NRPN | NRPN_FINE => state.rpn = RPN_NONE,
            DATA_ENTRY | DATA_ENTRY_FINE => {
                match (state.rpn, cc) {
                    (RPN_BEND_RANGE, DATA_ENTRY) => self.bends.set_range(at, Some(value), None),
                    (RPN_BEND_RANGE, _) => self.bends.set_range(at, None, Some(value)),
                    (RPN_MPE_ZONE, DATA_ENTRY) => self.bends.set_zone(at, value),
                    _ => {}
                }
                self.rebend();
            }
            RESET_CONTROLLERS => {
                // RP-015 also puts expression to full, which on a wind instrument would be a blast: breath stays. Volume
                // and pan stay, as it says.
                state.rpn = RPN_NONE;
                self.bends.rest(at);
                if self.bends.is_heard(at, self.heard_channel()) {
                    self.bend_anew();
                }
                self.set_pedal(false);
                self.ease_keys();
                self.techniques.controllers = TechniqueControllers::default();
                self.say_techniques();
            }
            _ => {}
        }
    }

    /// Channel pressure (aftertouch). Real-time safe.
    pub fn pressure(&mut self, channel: u8, value: u8) -> &[Event] {
        self.pressure_beside(channel, value, false)
    }

    /// The same where other decoders follow the same keyboard; `is_key_down`: one of them holds a key.
    pub(in crate::control) fn pressure_beside(
        &mut self,
        channel: u8,
        value: u8,
        is_key_down: bool,
    ) -> &[Event] {
        self.begin();
        let at = usize::from(channel % 16);
        let place = self.place(at, PRESSURE);
        if self.links.has(Source::Pressure) {
            self.ease_keys();
            self.follow(Source::Pressure, value.min(127), place);
        } else {
            let is_key_down = is_key_down || self.sounding().is_some();
            // Without a key no hand presses; and a finger of MPE blows.
            let may_be_of_keys = (is_key_down || value == 0) && !self.bends.is_member(at);
            self.hear(BreathController::Pressure, at, Part::Coarse(value.min(127)), place, may_be_of_keys);
        }
        self.said.events()
    }

    /// Channel pressure that is used for something other than breath; it only counts among the channel's controllers.
    /// Real-time safe.
    pub fn other_pressure(&mut self, channel: u8) -> &[Event] {
        self.begin();
        self.place(usize::from(channel % 16), PRESSURE);
        self.ease_keys();
        self.said.events()
    }

    /// The place of a message in its channel's run of controllers. If it shows that the run is a snapshot, volume, pan,
    /// techniques and pedal go back to where they were before it.
    fn place(&mut self, at: usize, controller: u8) -> Place {
        let channel = &mut self.channels[at];
        if channel.run.is_empty() || channel.run.has(controller) {
            channel.before = Before {
                mix: self.mix.controllers,
                techniques: self.techniques.controllers,
                links: self.links.raws(),
                bends: self.bends,
                pedal: self.pedal,
            };
        }
        let place = channel.run.place(controller);
        if place == Place::Recognised {
            channel.rpn = RPN_NONE;
            let Before { mix, techniques, links, bends, pedal } = channel.before;
            self.breath.forget_waiting(at);
            (self.mix.controllers, self.techniques.controllers) = (mix, techniques);
            self.remix();
            self.say_techniques();
            self.linked_breath = None;
            let taken_back = self.links.go_back(&links).filter(|event| !matches!(event, Event::Breath(_)));
            taken_back.for_each(|event| self.said.push(event));
            // A registered parameter may have been selected before.
            self.bends.take_back_ranges(&bends);
            self.rebend();
            self.set_pedal(pedal);
        }
        place
    }

    fn hear(
        &mut self,
        controller: BreathController,
        at: usize,
        part: Part,
        place: Place,
        may_be_of_keys: bool,
    ) {
        let is_held = self.sounding().is_some();
        match self.breath.hear(controller, at, part, place, is_held, may_be_of_keys) {
            // In MPE, each finger blows its own note.
            Some(Heard::Breath(_)) if self.is_unheard_member(at) => {}
            Some(Heard::Breath(unit)) => self.blow(BreathOrigin::Controller(controller), unit),
            Some(Heard::Keys(unit)) if std::mem::replace(&mut self.key_pressure, unit) != unit => {
                self.said.push(Event::KeyPressure(unit));
            }
            _ => {}
        }
    }

    /// Whether a channel belongs to a finger whose note is not heard.
    fn is_unheard_member(&self, at: usize) -> bool {
        self.bends.is_member(at) && self.heard_channel().is_some_and(|heard| heard != at)
    }

    /// A linked controller speaks.
    fn follow(&mut self, source: Source, value: u8, place: Place) {
        if matches!(place, Place::Recognised | Place::Within) {
            return;
        }
        // As any breath source: what has come once may be the beginning of a snapshot.
        let waits = place == Place::First && self.sounding().is_none();
        for event in self.links.hear(source, value) {
            if let Event::Breath(unit) = event {
                // A single 0 does not count: hosts send one when they begin.
                self.linked_breath = (waits && unit > 0.0).then_some(unit);
                if waits {
                    continue;
                }
                self.origin = Some(BreathOrigin::Link);
            }
            self.said.push(event);
        }
    }
}
