//! What the plugin remembers of the host's events, and what it makes of them. Real-time safe.

use std::collections::VecDeque;

use nice_plug::prelude::*;

use super::breath_sources::BreathSources;
use super::params::knob::ReedSource;
use super::part_reeds::PartReeds;
use super::reed_controllers::ReedControllers;
use super::translate_events::{EventTranslator, WINDOW_NOTE, raw7, untangled};
use crate::controllers::ControllerLinks;
use crate::controllers::breath_input::BreathInput;
use crate::controllers::source_curves::CurvesNow;
use chalumeau_core::control::key_switches::KeySwitches;
use chalumeau_core::control::midi::breath::BreathFrom;
use chalumeau_core::control::midi::links::{Link, MOST, Source};
use chalumeau_core::control::midi::techniques::Wheel;
use chalumeau_core::control::notes::Note;
use chalumeau_core::control::parts;
use chalumeau_core::event::{Event, PartEvent, Timed, To};
use chalumeau_core::instrument::Settings;

/// Events that wait at most: what one event of the host can become, and what a block begins with. Of each part: a note with the
/// breath that waited for it, or a panic with what controllers keep up, and every link.
const EVENTS: usize = (64 + MOST) * parts::MOST;
/// Ends of notes that one block can hold: each event that the wrapper keeps room for begins at most one note, and 17 notes
/// of each part may be there before. Later ones are lost to the host, which only loses a hint.
const ENDS: usize = 4_096 + 17 * parts::MOST;

/// Events that a block can begin with: all that the wrapper keeps room for.
const WAITING: usize = 4_096;

/// Everything that is remembered of the host's events between two blocks.
pub struct HostInputs {
    translator: EventTranslator,
    reeds: PartReeds,
    breath_sources: BreathSources,
    curves: CurvesNow,
    /// Events that the block begins with or that the host's latest event has become, their sample, and how many have been
    /// handed out.
    events: Vec<PartEvent>,
    at: usize,
    handed: usize,
    /// Notes that have ended in this block, in order of time.
    ended: Vec<(u32, Note)>,
    /// The latest MIDI program change that nobody has taken yet.
    program: Option<u8>,
    /// The host's events that were looked at before their turn.
    waiting: VecDeque<NoteEvent<()>>,
}

impl Default for HostInputs {
    /// Allocates.
    fn default() -> Self {
        Self {
            translator: EventTranslator::default(),
            reeds: PartReeds::default(),
            breath_sources: BreathSources::default(),
            curves: CurvesNow::default(),
            events: Vec::with_capacity(EVENTS),
            at: 0,
            handed: 0,
            ended: Vec::with_capacity(ENDS),
            program: None,
            waiting: VecDeque::with_capacity(WAITING),
        }
    }
}

impl HostInputs {
    /// Forgets everything but MPE zones and bend ranges, see [`Parts::reset`](chalumeau_core::control::parts::Parts::reset).
    pub fn reset(&mut self) {
        self.translator.reset();
        self.reeds = PartReeds::default();
        self.breath_sources = BreathSources::default();
        (self.handed, self.program) = (0, None);
        self.events.clear();
        self.ended.clear();
        self.waiting.clear();
    }

    /// See [`Parts::forget_repeats`](chalumeau_core::control::parts::Parts::forget_repeats).
    pub fn forget_repeats(&mut self) {
        self.translator.forget_repeats();
    }

    /// Begins a block, whose notes are split into so many parts.
    pub fn begin_block(&mut self, parts: usize) {
        self.ended.clear();
        self.events.clear();
        (self.at, self.handed) = (0, 0);
        let before = self.translator.parts();
        if self.translator.set_parts(parts) {
            self.note_ends(0);
            self.reeds.follow_first(before.min(parts));
        }
    }

    /// Adds an event at the beginning of the block.
    pub fn say(&mut self, event: PartEvent) {
        push(&mut self.events, event);
    }

    /// What the window says. Its keys play as the host's do; all else is for the first player, which it shows.
    pub fn window_key(&mut self, event: Event) {
        match event {
            Event::Breath(unit) => self.breath_sources().blow(BreathInput::Parameter, unit),
            Event::NoteOn { velocity, .. } => self.breath_sources().key(velocity),
            _ => {}
        }
        let from = self.events.len();
        match self.translator.window_note(&event) {
            Some(said) => said.iter().for_each(|&event| push(&mut self.events, event)),
            None => return self.say(PartEvent { to: To::Player(0), event }),
        }
        self.shape_breath(from);
        self.note_ends(0);
    }

    /// The latest MIDI program change, 0..=127, once.
    pub fn take_program(&mut self) -> Option<u8> {
        self.program.take()
    }

    /// Looks among the host's events of the block's first sample for a program change, and takes the latest. All others wait for
    /// [`next`](Self::next).
    pub fn first_program(&mut self, mut next: impl FnMut() -> Option<NoteEvent<()>>) -> Option<u8> {
        self.waiting.clear();
        let mut found = None;
        while self.waiting.len() < self.waiting.capacity()
            && let Some(event) = next()
        {
            match event {
                NoteEvent::MidiProgramChange { timing: 0, program, .. } => found = Some(program & 0x7f),
                event => {
                    self.waiting.push_back(event);
                    if event.timing() > 0 {
                        break;
                    }
                }
            }
        }
        found
    }

    /// Ties controllers to settings, and says whether they were tied in another way.
    pub fn set_links(&mut self, links: &[Option<Link>; MOST]) -> bool {
        self.translator.set_links(links)
    }

    /// Gives sources their own curves.
    pub fn set_curves(&mut self, curves: CurvesNow) {
        self.curves = curves;
    }

    /// Adds at the beginning of the block what linked controllers have said to single players. Call it where all have got the
    /// settings of the first.
    pub fn say_links(&mut self) {
        for part in 1..self.translator.parts() {
            let to = To::Player(part as u8);
            for (number, value) in self.translator.links_of(part).beside(self.translator.links()) {
                push(&mut self.events, PartEvent { to, event: Event::Set(number, value) });
            }
        }
    }

    /// Settings with the numbers of linked controllers that have spoken to the first player.
    pub fn linked(&self, mut settings: Settings) -> Settings {
        for (number, value) in self.translator.links().numbers() {
            *settings.number(number) = value;
        }
        settings
    }

    /// Which input each breath value came from.
    pub fn breath_sources(&mut self) -> &mut BreathSources {
        &mut self.breath_sources
    }

    /// The factors that controllers and notes put on H and k of the first player, which the knob feels.
    #[cfg(any(feature = "devices", test))]
    pub fn reed_factors(&self, drives: [ReedSource; 2]) -> [f32; 2] {
        self.reeds.factors(drives)
    }

    /// The next event of the instrument; `next` gives the host's. Events of what `drives` H or k change the reed and nothing
    /// else.
    pub fn next(
        &mut self,
        mut next: impl FnMut() -> Option<NoteEvent<()>>,
        api: PluginApi,
        drives: [ReedSource; 2],
        links: &ControllerLinks,
    ) -> Option<Timed<PartEvent>> {
        loop {
            if let Some(&event) = self.events.get(self.handed) {
                self.handed += 1;
                return Some(Timed { at: self.at, event });
            }
            let event = match self.waiting.pop_front() {
                Some(event) => event,
                None => next()?,
            };
            let event = untangled(event, api);
            learn(&event, links);
            self.take(event, drives);
        }
    }

    fn take(&mut self, event: NoteEvent<()>, drives: [ReedSource; 2]) {
        (self.at, self.handed) = (event.timing() as usize, 0);
        self.events.clear();
        if let NoteEvent::MidiProgramChange { program, .. } = event {
            self.program = Some(program & 0x7f);
        }
        let channel = match event {
            NoteEvent::MidiCC { channel, .. } | NoteEvent::MidiChannelPressure { channel, .. } => {
                Some(channel)
            }
            _ => None,
        };
        let was_snapshot = channel.is_some_and(|channel| self.translator.is_snapshot(channel));
        let reeds = ReedControllers::of(&event, drives);
        self.breath_sources.record(&event);
        for &event in self.translator.translate(&event, reeds.is_some()) {
            push(&mut self.events, event);
        }
        self.shape_breath(0);
        self.note_ends(event.timing());
        let is_snapshot = channel.is_some_and(|channel| self.translator.is_snapshot(channel));
        match reeds {
            _ if is_snapshot && !was_snapshot => self.reeds.go_back(),
            Some(moved) if !is_snapshot => self.reeds.set(&event, moved, &self.translator),
            _ => {}
        }
        self.reeds.follow(matches!(event, NoteEvent::NoteOn { .. }), &self.translator);
        for event in self.reeds.changed(drives, self.translator.parts()) {
            push(&mut self.events, event);
        }
    }

    /// Names the source of what blows, from this event on, and gives it the curve of its source.
    fn shape_breath(&mut self, from: usize) {
        let Some(origin) = self.translator.breath_origin() else { return };
        for event in &mut self.events[from..] {
            if let Event::Breath(unit) = event.event {
                self.breath_sources.blow(origin.into(), unit);
                event.event = Event::Breath(self.curves.breath(origin, unit));
            }
        }
    }

    /// Sets how far the wheel bends until RPN 0 says otherwise, semitones, from the beginning of the block on.
    pub fn bend_range(&mut self, semitones: i32) {
        for &event in self.translator.bend_range(semitones) {
            push(&mut self.events, event);
        }
    }

    /// Says which controller blows from the beginning of the block on.
    pub fn breath_from(&mut self, from: BreathFrom) {
        let said = self.translator.breath_from(from);
        if !said.is_empty() {
            self.breath_sources.forget();
        }
        for &event in said {
            push(&mut self.events, event);
        }
    }

    /// Says what the mod wheel does from the beginning of the block on: nothing where it `drives` the reed.
    pub fn wheel(&mut self, wheel: Wheel, drives: [ReedSource; 2]) {
        let is_reeds = drives.contains(&ReedSource::Wheel);
        for &event in self.translator.wheel(if is_reeds { Wheel::Nothing } else { wheel }) {
            push(&mut self.events, event);
        }
    }

    /// Lets what `drives` H and k now act from the beginning of the block on.
    pub fn reed_sources(&mut self, drives: [ReedSource; 2]) {
        for event in self.reeds.changed(drives, self.translator.parts()) {
            push(&mut self.events, event);
        }
    }

    /// Says which keys choose fingerings.
    pub fn key_switches(&mut self, key_switches: KeySwitches) {
        self.translator.set_key_switches(key_switches);
    }

    /// Says which keys play a note, one bit each.
    pub fn playing_keys(&mut self, playing: u128) {
        self.translator.set_playing_keys(playing);
    }

    /// Ends all notes at the beginning of the block.
    pub fn silence(&mut self) {
        for &event in self.translator.silence() {
            push(&mut self.events, event);
        }
        self.note_ends(0);
    }

    /// After sample `at`, `is_silent` tells which players are silent: what faded there has ended.
    pub fn fall_silent(&mut self, at: u32, is_silent: impl Fn(usize) -> bool) {
        for part in (0..self.translator.parts()).filter(|&part| is_silent(part)) {
            if let Some(note) = self.translator.take_faded(part) {
                end(&mut self.ended, at, note);
            }
        }
    }

    /// The notes that have ended in this block, in order of time, for the host.
    pub fn ended(&self) -> &[(u32, Note)] {
        &self.ended
    }

    fn note_ends(&mut self, at: u32) {
        for &note in self.translator.over() {
            end(&mut self.ended, at, note);
        }
    }
}

/// Tells the links what a controller says.
fn learn(event: &NoteEvent<()>, links: &ControllerLinks) {
    match *event {
        NoteEvent::MidiCC { cc, value, .. } => links.hear(Source::Controller(cc.min(127)), raw7(value)),
        NoteEvent::MidiChannelPressure { pressure, .. } => links.hear(Source::Pressure, raw7(pressure)),
        _ => {}
    }
}

/// Adds an event, without allocating.
fn push(events: &mut Vec<PartEvent>, event: PartEvent) {
    debug_assert!(events.len() < events.capacity(), "a block has more events than it can");
    if events.len() < events.capacity() {
        events.push(event);
    }
}

/// Adds the end of a note, without allocating.
fn end(ended: &mut Vec<(u32, Note)>, at: u32, note: Note) {
    // The host has not begun what the window plays.
    if note.id != WINDOW_NOTE && ended.len() < ended.capacity() {
        ended.push((at, note));
    }
}

#[cfg(test)]
mod tests {
    use nice_plug::midi::{Channel, Key, VoiceID};

    use super::*;
    use crate::controllers::ParameterLink;
    use crate::controllers::source_curves::{CurveSource, SourceCurve, SourceCurves};
    use chalumeau_core::units::SoundingNote;

    const NO_REED: [ReedSource; 2] = [ReedSource::Parameter; 2];

    fn midi(inputs: &mut HostInputs, drives: [ReedSource; 2], said: &[[u8; 3]]) -> Vec<Event> {
        let mut said = said.iter().map(|bytes| NoteEvent::from_midi(5, bytes).unwrap());
        let links = ControllerLinks::default();
        let mut next = || inputs.next(|| said.next(), PluginApi::Clap, drives, &links);
        std::iter::from_fn(|| next().map(|timed| timed.event.event)).collect()
    }

    fn all_controllers(value: u8) -> Vec<[u8; 3]> {
        let of_channel = |channel: u8| {
            let controllers = (0..128_u8).map(move |cc| [0xB0 | channel, cc, value]);
            controllers.chain([[0xD0 | channel, value, 0]])
        };
        (0..16).flat_map(of_channel).collect()
    }

    #[test]
    fn a_start_that_sends_every_controller_names_no_source_and_leaves_velocity_and_reed() {
        let reeds = [ReedSource::Wheel, ReedSource::Pressure];
        for value in [0, 1, 64, 127] {
            let mut inputs = HostInputs::default();
            for _ in 0..2 {
                let events = midi(&mut inputs, reeds, &all_controllers(value));
                assert!(!events.iter().any(|event| matches!(event, Event::Breath(_))), "{value}");
            }
            let named = |inputs: &mut HostInputs| {
                let sources = inputs.breath_sources();
                BreathInput::ALL.into_iter().find(|&input| sources.is_live(input))
            };
            assert_eq!(named(&mut inputs), None, "{value}");
            assert_eq!(inputs.reed_factors(reeds), [1.0, 1.0], "{value}");
            let note_on = Event::NoteOn { note: SoundingNote(60), velocity: 100.0 / 127.0 };
            assert_eq!(midi(&mut inputs, reeds, &[[0x90, 60, 100]]), [note_on], "{value}");
            assert_eq!(named(&mut inputs), Some(BreathInput::Keys));
            // A player who blows now is named.
            midi(&mut inputs, reeds, &[[0xB0, 2, 40], [0xB0, 2, 45]]);
            assert_eq!(named(&mut inputs), Some(BreathInput::Breath));
            midi(&mut inputs, reeds, &[[0xB0, 1, 127]]);
            assert!(inputs.reed_factors(reeds)[0] > 1.5, "and a wheel that moves is a wheel");
        }
    }

    #[test]
    fn keys_of_the_window_play_chords_whose_ends_no_host_hears_of() {
        let mut inputs = HostInputs::default();
        inputs.begin_block(3);
        let keys = [60, 64, 67].map(SoundingNote);
        for note in keys {
            inputs.window_key(Event::NoteOn { note, velocity: 0.5 });
        }
        let links = ControllerLinks::default();
        let mut begun = Vec::new();
        while let Some(timed) = inputs.next(|| None, PluginApi::Clap, NO_REED, &links) {
            if let PartEvent { to, event: Event::NoteOn { note, .. } } = timed.event {
                begun.push((to, note));
            }
        }
        assert_eq!(begun, [0, 1, 2].map(|part| (To::Player(part), keys[usize::from(part)])));
        inputs.begin_block(3);
        for note in keys {
            inputs.window_key(Event::NoteOff { note });
        }
        inputs.fall_silent(0, |_| true);
        assert_eq!(inputs.ended(), []);
    }

    #[test]
    fn a_key_of_the_window_comes_up_whatever_becomes_of_the_players_meanwhile() {
        let note = SoundingNote(60);
        for (at_first, then) in [(1, 3), (3, 1), (1, 1)] {
            let mut inputs = HostInputs::default();
            inputs.begin_block(at_first);
            inputs.window_key(Event::NoteOn { note, velocity: 0.5 });
            inputs.begin_block(then);
            inputs.window_key(Event::NoteOff { note });
            let said: Vec<Event> = inputs.events.iter().map(|event| event.event).collect();
            assert_eq!(said, [Event::NoteOff { note }], "{at_first} players, then {then}");
        }
    }

    #[test]
    fn a_value_that_the_key_makes_breath_is_named_with_the_key() {
        let mut inputs = HostInputs::default();
        midi(&mut inputs, NO_REED, &[[0xB0, 11, 90]]);
        assert!(!inputs.breath_sources().is_live(BreathInput::Expression));
        midi(&mut inputs, NO_REED, &[[0x90, 60, 100]]);
        assert!(inputs.breath_sources().is_live(BreathInput::Expression));
    }

    #[test]
    fn a_source_with_its_own_curve_is_shown_as_it_is_and_heard_by_its_curve() {
        let (curves, settings) = (SourceCurves::default(), Settings::default());
        curves.put(CurveSource::Breath, Some(SourceCurve { softest: 0.1, loudest: 0.6, curve: 1.0 }));
        let said = [[0xB0, 2, 30], [0xB0, 2, 80], [0xB0, 2, 90]];
        let breaths = |curves: &SourceCurves, said: &[[u8; 3]]| -> Vec<f32> {
            let mut inputs = HostInputs::default();
            inputs.set_curves(curves.now(&settings));
            midi(&mut inputs, NO_REED, &[[0x90, 60, 100]]);
            let breath = |event| if let Event::Breath(unit) = event { Some(unit) } else { None };
            let heard = midi(&mut inputs, NO_REED, said).into_iter().filter_map(breath).collect();
            let shown = BreathInput::ALL.into_iter().find(|&input| inputs.breath_sources().is_live(input));
            let last = f32::from(said[said.len() - 1][2]) / 127.0;
            assert!((inputs.breath_sources().value(shown.unwrap()).unwrap() - last).abs() < 1e-6);
            heard
        };
        let (own, common) = (breaths(&curves, &said), breaths(&SourceCurves::default(), &said));
        assert_eq!(own.len(), common.len());
        assert!(
            own.len() >= 2 && own.iter().zip(&common).all(|(own, common)| own > common),
            "{own:?} {common:?}"
        );
        assert_eq!(own.last(), Some(&1.0), "above its loudest breath");
        let expression = said.map(|[status, _, value]| [status, 11, value]);
        assert_eq!(breaths(&curves, &expression), breaths(&SourceCurves::default(), &expression));
    }

    #[test]
    fn a_linked_controller_sets_its_parameter_until_a_hand_moves_it() {
        let links = ControllerLinks::default();
        let growl = crate::parameters::find("growl").unwrap();
        let whole = ParameterLink::whole(Source::Controller(21), growl).unwrap();
        links.replace(&[whole]);
        let (mut inputs, mut own) = (HostInputs::default(), Settings::default());
        inputs.set_links(&links.links(&own));
        assert_eq!(inputs.linked(own).techniques.growl, 0.0, "nothing has moved");
        let events = midi(&mut inputs, NO_REED, &[[0xB0, 21, 127]]);
        assert!(matches!(events[..], [Event::Set(_, 1.0)]), "{events:?}");
        inputs.set_links(&links.links(&own));
        assert_eq!(inputs.linked(own).techniques.growl, 1.0, "in the next block too");
        own.techniques.growl = 0.4;
        inputs.set_links(&links.links(&own));
        assert_eq!(inputs.linked(own).techniques.growl, 0.4, "moved by hand");
        midi(&mut inputs, NO_REED, &[[0xB0, 21, 0]]);
        assert_eq!(inputs.linked(own).techniques.growl, 0.0);
    }

    #[test]
    fn a_link_that_goes_says_so_though_only_another_player_had_its_value() {
        let links = ControllerLinks::default();
        let growl = crate::parameters::find("growl").unwrap();
        links.replace(&[ParameterLink::whole(Source::Controller(21), growl).unwrap()]);
        let (mut inputs, own) = (HostInputs::default(), Settings::default());
        inputs.begin_block(2);
        assert!(inputs.set_links(&links.links(&own)));
        parted(&mut inputs, NO_REED, &MPE);
        let said = parted(&mut inputs, NO_REED, &[[0x91, 60, 100], [0x92, 64, 100], [0xB2, 21, 127]]);
        assert!(matches!(said[..], [.., (To::Player(1), Event::Set(_, 1.0))]), "{said:?}");
        assert!(!inputs.set_links(&links.links(&own)));
        assert_eq!(inputs.linked(own), own, "the first player has heard nothing");
        links.replace(&[]);
        assert!(inputs.set_links(&links.links(&own)));
    }

    #[test]
    fn a_reed_that_no_controller_drives_any_more_goes_back_at_once() {
        let driven = [ReedSource::Wheel, ReedSource::Parameter];
        let mut inputs = HostInputs::default();
        midi(&mut inputs, driven, &[[0x90, 60, 100], [0xB0, 1, 127]]);
        inputs.begin_block(1);
        inputs.reed_sources(driven);
        assert_eq!(midi(&mut inputs, driven, &[]), [], "nothing has changed");
        inputs.begin_block(1);
        inputs.reed_sources(NO_REED);
        assert_eq!(midi(&mut inputs, NO_REED, &[]), [Event::Reed { h: 1.0, k: 1.0 }]);
    }

    #[test]
    fn the_reed_follows_the_heard_note_only() {
        let drives = [ReedSource::Slide, ReedSource::Pressure];
        let mut inputs = HostInputs::default();
        let bright = |id, brightness| NoteEvent::PolyBrightness {
            timing: 0,
            voice_id: VoiceID::ID(id),
            channel: Channel::Wildcard,
            key: Key::Wildcard,
            brightness,
        };
        let on = |id, key| NoteEvent::NoteOn {
            timing: 0,
            voice_id: VoiceID::ID(id),
            channel: Channel::Number(0),
            key: Key::Number(key),
            velocity: 0.8,
        };
        let mut say = |event: NoteEvent<()>| {
            let mut event = Some(event);
            let links = ControllerLinks::default();
            while inputs.next(|| event.take(), PluginApi::Clap, drives, &links).is_some() {}
            inputs.reed_factors(drives)[0]
        };
        say(on(1, 60));
        say(on(2, 64));
        assert_eq!(say(bright(1, 1.0)), 1.0, "unheard");
        assert!((say(bright(2, 0.0)) - 1.0 / 1.6).abs() < 1e-3);
        let off = NoteEvent::NoteOff {
            timing: 0,
            voice_id: VoiceID::ID(2),
            channel: Channel::Wildcard,
            key: Key::Wildcard,
            velocity: 0.0,
        };
        assert!((say(off) - 1.6).abs() < 1e-3, "its own, now that it is heard");
    }

    /// Says of MIDI messages who does what.
    fn parted(inputs: &mut HostInputs, drives: [ReedSource; 2], said: &[[u8; 3]]) -> Vec<(To, Event)> {
        let mut said = said.iter().map(|bytes| NoteEvent::from_midi(5, bytes).unwrap());
        let links = ControllerLinks::default();
        let mut next = || inputs.next(|| said.next(), PluginApi::Clap, drives, &links);
        std::iter::from_fn(|| next().map(|timed| (timed.event.to, timed.event.event))).collect()
    }

    /// RPN 6 on channel 1: all other channels are members.
    const MPE: [[u8; 3]; 3] = [[0xB0, 101, 0], [0xB0, 100, 6], [0xB0, 6, 15]];

    fn of_reeds(events: Vec<(To, Event)>) -> Vec<(To, bool)> {
        let reed = |(to, event)| match event {
            Event::Reed { h, .. } => Some((to, h > 1.0)),
            _ => None,
        };
        events.into_iter().filter_map(reed).collect()
    }

    #[test]
    fn each_finger_of_a_chord_moves_the_reed_of_its_player() {
        let drives = [ReedSource::Slide, ReedSource::Parameter];
        let mut inputs = HostInputs::default();
        inputs.begin_block(2);
        parted(&mut inputs, drives, &MPE);
        parted(&mut inputs, drives, &[[0x91, 60, 100], [0x92, 64, 100]]);
        let [first, second] = [0, 1].map(To::Player);
        assert_eq!(of_reeds(parted(&mut inputs, drives, &[[0xB1, 74, 127]])), [(first, true)]);
        assert_eq!(of_reeds(parted(&mut inputs, drives, &[[0xB2, 74, 0]])), [(second, false)]);
        assert!(inputs.reed_factors(drives)[0] > 1.5, "the knob feels the first");
        let all = parted(&mut inputs, drives, &[[0xB0, 74, 0]]);
        assert_eq!(
            of_reeds(all),
            [(first, false)],
            "the manager's is everybody's; the second has it already"
        );
        // What a channel said before its note is the note's.
        parted(&mut inputs, drives, &[[0x82, 64, 0], [0xB3, 74, 127]]);
        assert_eq!(of_reeds(parted(&mut inputs, drives, &[[0x93, 66, 100]])), [(second, true)]);
        // Without an MPE zone a controller is everybody's.
        let mut inputs = HostInputs::default();
        inputs.begin_block(2);
        parted(&mut inputs, drives, &[[0x90, 60, 100], [0x90, 64, 100]]);
        assert_eq!(
            of_reeds(parted(&mut inputs, drives, &[[0xB0, 74, 127]])),
            [(first, true), (second, true)]
        );
    }

    #[test]
    fn a_linked_controller_of_one_player_outlives_new_settings() {
        let links = ControllerLinks::default();
        let growl = crate::parameters::find("growl").unwrap();
        links.replace(&[ParameterLink::whole(Source::Controller(21), growl).unwrap()]);
        let (mut inputs, own) = (HostInputs::default(), Settings::default());
        inputs.begin_block(2);
        inputs.set_links(&links.links(&own));
        parted(&mut inputs, NO_REED, &MPE);
        parted(&mut inputs, NO_REED, &[[0x91, 60, 100], [0x92, 64, 100]]);
        let second = To::Player(1);
        let growls = |events: Vec<(To, Event)>| -> Vec<(To, f32)> {
            let set = |(to, event)| match event {
                Event::Set(_, value) => Some((to, value)),
                _ => None,
            };
            events.into_iter().filter_map(set).collect()
        };
        assert_eq!(growls(parted(&mut inputs, NO_REED, &[[0xB2, 21, 127]])), [(second, 1.0)]);
        assert_eq!(inputs.linked(own).techniques.growl, 0.0, "the first was told nothing");
        inputs.begin_block(2);
        inputs.say_links();
        assert_eq!(growls(parted(&mut inputs, NO_REED, &[])), [(second, 1.0)]);
    }

    #[test]
    fn a_program_at_the_beginning_is_found_behind_its_bank_and_nothing_else_is_lost() {
        let cc = |timing, cc| {
            let value = timing as f32 / 10.0;
            NoteEvent::MidiCC { timing, channel: 0, cc, value }
        };
        let program = |timing, program| NoteEvent::MidiProgramChange { timing, channel: 0, program };
        let said = [cc(0, 0), program(0, 3), cc(0, 32), program(0, 4), cc(5, 7), program(5, 6), cc(6, 7)];
        let mut inputs = HostInputs::default();
        let mut left = said.into_iter();
        assert_eq!(inputs.first_program(|| left.next()), Some(4));
        assert_eq!(left.len(), 2, "what comes after the first sample is not looked at");
        let links = ControllerLinks::default();
        let mut next = || inputs.next(|| left.next(), PluginApi::Clap, NO_REED, &links);
        let heard: Vec<_> = std::iter::from_fn(|| next().map(|timed| timed.at)).collect();
        assert_eq!(heard, [5, 6], "both volumes; bank numbers are no events");
        assert_eq!((inputs.take_program(), left.len()), (Some(6), 0));
    }

    #[test]
    fn each_note_ends_once() {
        let mut inputs = HostInputs::default();
        midi(&mut inputs, NO_REED, &[[0x90, 60, 100], [0x90, 64, 100], [0x80, 64, 0], [0x80, 60, 0]]);
        let key = |inputs: &HostInputs| inputs.ended().iter().map(|(_, note)| note.key).collect::<Vec<_>>();
        assert_eq!(key(&inputs), [64]);
        inputs.begin_block(1);
        inputs.fall_silent(63, |_| true);
        inputs.fall_silent(63, |_| true);
        assert_eq!((key(&inputs), inputs.ended()[0].0), (vec![60], 63));
        inputs.begin_block(1);
        midi(&mut inputs, NO_REED, &[[0x90, 60, 100], [0xB0, 120, 0]]);
        assert_eq!(key(&inputs), [60]);
    }

    #[test]
    fn a_chord_is_split_and_each_of_its_notes_ends_with_its_player() {
        let mut inputs = HostInputs::default();
        inputs.begin_block(2);
        let said = [[0x90, 60, 100], [0x90, 64, 100], [0x80, 60, 0], [0x80, 64, 0]];
        let mut said = said.iter().map(|bytes| NoteEvent::from_midi(5, bytes).unwrap());
        let links = ControllerLinks::default();
        let mut next = || inputs.next(|| said.next(), PluginApi::Clap, NO_REED, &links);
        let players: Vec<To> = std::iter::from_fn(|| next().map(|timed| timed.event.to)).collect();
        assert_eq!(players, [0, 1, 0, 1].map(To::Player));
        assert_eq!(inputs.ended(), []);
        inputs.fall_silent(7, |part| part == 1);
        assert_eq!(inputs.ended(), [(7, Note { id: None, channel: 0, key: 64 })]);
        // Players who go take their notes along.
        midi(&mut inputs, NO_REED, &[[0x90, 60, 100], [0x90, 64, 100]]);
        inputs.begin_block(1);
        assert_eq!(inputs.ended(), [(0, Note { id: None, channel: 0, key: 64 })]);
    }
}
