//! The audio thread's part of the knob. Real-time safe throughout. [audio thread]

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::feel_design::{feel_design, knob_design};
use super::feels_cache::FeelsCache;
use super::heard_sound::SoundSender;
use super::slow_work::recorded_feel;
use super::take_recorder::load_take;
use super::{NO_NOTE, SharedKnob};
use crate::plugin::instrument_loading::{InstrumentSwap, SharedInstrument};
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::event::{Event, PartEvent, Played, Timed, To};
use chalumeau_core::instrument::{Channels, KeyNotes, Settings};
use chalumeau_knob::device::{KnobReader, Release};
use chalumeau_knob::touch::angle::slap_strength;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, Breath14, BreathMapping, GRID};
use chalumeau_knob::touch::feel::NO_MOTOR;
use chalumeau_knob::touch::take::Take;

/// Where a block's breath comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BlockBreath {
    /// The host's events.
    Host,
    /// A live knob.
    Knob,
    /// A recorded take.
    Take,
}

/// The audio thread's part of the knob.
pub struct KnobAudio {
    shared: Arc<SharedKnob>,
    readers: rtrb::Consumer<KnobReader>,
    reader: Option<KnobReader>,
    hand: triple_buffer::Output<BreathMapping>,
    take: triple_buffer::Output<Option<Arc<Take>>>,
    blower: Blower,
    breath_from: BlockBreath,
    /// The breath values of one block that go to the host. It never grows while it plays.
    sent: Vec<(usize, Breath14)>,
    sound: SoundSender,
    /// Samples of a take that have been played.
    replayed: u64,
    /// A replay that was loaded before playing began. Until the first replay ends, it takes precedence over what the slow
    /// work has loaded since.
    prepared: Option<PreparedReplay>,
    /// The last block replayed a take.
    replays: bool,
    /// A replay has ended since playing began.
    has_replayed: bool,
}

/// What a replay needs from its first sample.
struct PreparedReplay {
    hand: BreathMapping,
    take: Arc<Take>,
}

/// What a block depends on, besides its events.
#[derive(Clone, Copy, Debug)]
pub struct BlockContext {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// The host renders a file, so a live knob has no effect.
    pub offline: bool,
    /// A take replaces the knob.
    pub replay: bool,
}

impl KnobAudio {
    pub(super) fn new(
        shared: Arc<SharedKnob>,
        readers: rtrb::Consumer<KnobReader>,
        hand: triple_buffer::Output<BreathMapping>,
        take: triple_buffer::Output<Option<Arc<Take>>>,
        sound: SoundSender,
    ) -> Self {
        Self {
            shared,
            readers,
            reader: None,
            hand,
            take,
            blower: Blower::default(),
            breath_from: BlockBreath::Host,
            sent: Vec::new(),
            sound,
            replayed: 0,
            prepared: None,
            replays: false,
            has_replayed: false,
        }
    }

    /// Which notes the keys play. Real-time safe.
    pub fn set_notes(&mut self, notes: KeyNotes) {
        self.blower.set_notes(notes);
    }

    /// Loads the take to replay before playing begins, so that it plays from the first sample and every render of a file
    /// is the same. Blocks have at most `longest` samples. Allocates; takes about half a second. [main thread]
    pub fn prepare(&mut self, params: &ChalumeauParams, instrument: &SharedInstrument, longest: usize) {
        // One for each point of the grid, and one where the knob falls silent.
        self.sent = Vec::with_capacity(longest / GRID as usize + 2);
        self.shared.is_active.store(true, Ordering::Relaxed);
        (self.prepared, self.has_replayed) = (None, false);
        if !params.knob.replay.value() {
            return;
        }
        let Ok(path) = params.knob.take.read().map(|path| path.clone()) else { return };
        // If the take or the feel fails to load, nothing is replayed; the slow work reports why.
        let Ok(take) = load_take(&path) else { return };
        let Some(feels) = FeelsCache::default().of(instrument) else { return };
        let design = recorded_feel(&take).unwrap_or_else(|| feel_design(&params.knob));
        let Ok(table) = feels.table(&params.settings(), &design, &NO_MOTOR) else { return };
        let maps = feels.maps_for(&table, &params.settings());
        let hand = take.mapping(maps, knob_design(&params.knob).from_zero());
        self.prepared = Some(PreparedReplay { hand, take });
    }

    /// Tells the slow work which factors the reed's MIDI controllers put on H and k.
    pub fn set_reed_factors(&self, factors: [f32; 2]) {
        for (place, factor) in self.shared.reed_factors.iter().zip(factors) {
            place.store(factor.to_bits(), Ordering::Relaxed);
        }
    }

    /// Torque off, now.
    pub fn let_go(&self, reason: Release) {
        self.shared.let_go(reason);
    }

    /// Forgets notes and breath, and lets go of the knob; the link stays.
    pub fn reset(&mut self) {
        self.let_go(Release::Deactivated);
        self.blower.reset();
        self.breath_from = BlockBreath::Host;
        self.replayed = 0;
        self.shared.note.store(NO_NOTE, Ordering::Relaxed);
        self.shared.breath.store(0.0_f32.to_bits(), Ordering::Relaxed);
        if let Some(reader) = &mut self.reader {
            reader.take_slap();
        }
    }

    /// Renders one block: the host's events, and between them the breath of the knob or the take.
    pub fn render(
        &mut self,
        instrument: &mut InstrumentSwap,
        settings: &Settings,
        host: impl Iterator<Item = Timed<PartEvent>>,
        context: BlockContext,
        out: Channels,
    ) {
        if self.reader.is_none() {
            self.reader = self.readers.pop().ok();
        }
        if let Some(heart) = self.shared.audio_heart.get().filter(|_| !context.offline) {
            heart.beat();
        }
        let shared = &self.shared;
        let host = host.inspect(|event| {
            if matches!(event.event.event, Event::Panic) {
                shared.let_go(Release::Panic);
            }
        });
        self.sent.clear();
        let samples = out.len();
        match (std::mem::replace(&mut self.replays, context.replay), context.replay) {
            (false, true) => self.replayed = 0,
            // What was prepared stays in memory: nothing is freed on this thread.
            (true, false) => self.has_replayed = true,
            _ => {}
        }
        let is_prepared = !self.has_replayed;
        let (hand, take) = (self.hand.read(), self.take.read());
        let (hand, take) = match &self.prepared {
            Some(PreparedReplay { hand, take }) if context.replay && is_prepared => (hand, Some(&**take)),
            _ => (hand, take.as_deref().filter(|_| context.replay)),
        };
        // The rings are emptied even if nothing uses angles and slaps.
        let mut reader = self.reader.as_mut();
        let slap = reader.as_mut().and_then(|reader| {
            reader.begin_block(samples, context.rate_hz);
            reader.take_slap()
        });
        let breath_from = match (&take, &reader) {
            _ if !hand.maps.is_ready() => BlockBreath::Host,
            (Some(_), _) => BlockBreath::Take,
            (None, Some(reader)) if !context.offline && reader.pose(0).is_some() => BlockBreath::Knob,
            _ => BlockBreath::Host,
        };
        let has_left = breath_from == BlockBreath::Host && self.breath_from != BlockBreath::Host;
        let last_breath = has_left.then(|| self.blower.fall_silent()).flatten();
        self.breath_from = breath_from;
        let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
        let (shared, sent) = (&self.shared, &mut self.sent);
        let mut on_breath = |at: usize, breath: Breath14| {
            shared.breath.store(breath.unit().to_bits(), Ordering::Relaxed);
            if sent.len() < sent.capacity() {
                sent.push((at, breath));
            }
        };
        let blower = &mut self.blower;
        match (breath_from, take, reader) {
            (BlockBreath::Take, Some(take), _) => {
                let begun = self.replayed;
                let angle = |at: usize| Some(take.angle_deg((begun + at as u64) as f64 / context.rate_hz));
                let events = BlownEvents::new(host, blower, hand, full_pa, samples, angle, &mut on_breath);
                instrument.render_events(events, out);
                self.replayed += samples as u64;
            }
            (BlockBreath::Knob, _, Some(reader)) => {
                let slap = slap.map(|speed| {
                    let event = Event::TongueSlap { strength: slap_strength(speed) };
                    Timed { at: 0, event: PartEvent { to: To::Player(0), event } }
                });
                let angle = |at: usize| reader.pose(at).map(|pose| f64::from(pose.angle_deg));
                let events = BlownEvents::new(host, blower, hand, full_pa, samples, angle, &mut on_breath);
                instrument.render_events(slap.into_iter().chain(events), out);
            }
            _ => {
                let host = host.inspect(|&Timed { at, event }| {
                    if let Some(event) = event.of_first() {
                        blower.heed(&Timed { at, event });
                    }
                });
                let last_breath = last_breath.map(|breath| {
                    on_breath(0, breath);
                    Timed { at: 0, event: Event::Breath(breath.unit()).into() }
                });
                instrument.render_events(last_breath.into_iter().chain(host), out);
            }
        }
        self.blower.advance(samples);
        let note = self.blower.fingered().map_or(NO_NOTE, |note| note.0);
        self.shared.note.store(note, Ordering::Relaxed);
    }

    /// Sends the sound of the last block to the take that is recorded, if one is.
    pub fn send_sound(&mut self, rate_hz: f64, sound: &[f32]) {
        if let Some(reader) = &self.reader {
            self.sound.send(reader.due_us(), rate_hz, sound);
        }
    }

    /// The breath values of the last block and their sample positions, in order of time, for the host to record.
    pub fn sent(&self) -> &[(usize, Breath14)] {
        &self.sent
    }
}
