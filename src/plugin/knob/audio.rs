//! What the audio thread does with a knob. Real-time safe throughout. [audio thread]

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::{NO_NOTE, Shared, desk, felt, takes};
use crate::plugin::instrument::{self, Bench};
use crate::plugin::params::ChalumeauParams;
use chalumeau_core::control::knob::slap_strength;
use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::Settings;
use chalumeau_knob::device::KnobReader;
use chalumeau_knob::touch::blower::{Blower, Blown, Breath14, GRID, Hand};
use chalumeau_knob::touch::feel::NO_MOTOR;
use chalumeau_knob::touch::take::Take;

/// Breath values of one block that are also sent to the host: a block of 8192 samples has 128.
const MOST_SENT: usize = 8_192 / GRID as usize;

/// Where this block's breath comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Whatever the host sends.
    Host,
    /// A knob in somebody's hand.
    Knob,
    /// A take.
    Take,
}

/// The audio thread's end.
pub struct Audio {
    shared: Arc<Shared>,
    readers: rtrb::Consumer<KnobReader>,
    reader: Option<KnobReader>,
    hand: triple_buffer::Output<Hand>,
    take: triple_buffer::Output<Option<Arc<Take>>>,
    blower: Blower,
    source: Source,
    sent: [(usize, Breath14); MOST_SENT],
    sent_count: usize,
    /// Samples of a take already played.
    replayed: u64,
    /// Hand and take as they were loaded before playing began; what the desk has come by since is newer.
    prepared: Option<Prepared>,
}

/// What a render needs from its first sample, when there is no time to wait for the desk.
struct Prepared {
    hand: Hand,
    take: Arc<Take>,
}

/// What of the parameters matters to a block.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// A live device is ignored when a file is rendered.
    pub offline: bool,
    /// A take plays instead of a device.
    pub replay: bool,
}

impl Audio {
    pub(super) fn new(
        shared: Arc<Shared>,
        readers: rtrb::Consumer<KnobReader>,
        hand: triple_buffer::Output<Hand>,
        take: triple_buffer::Output<Option<Arc<Take>>>,
    ) -> Self {
        Self {
            shared,
            readers,
            reader: None,
            hand,
            take,
            blower: Blower::default(),
            source: Source::Host,
            sent: [(0, Breath14(0)); MOST_SENT],
            sent_count: 0,
            replayed: 0,
            prepared: None,
        }
    }

    /// Before playing: a take that shall be replayed is there from the first sample, so that every render of a file is
    /// the same. Allocates; takes half a second. [main thread]
    pub fn prepare(&mut self, params: &ChalumeauParams, instruments: &instrument::Shared) {
        self.shared.plays.store(true, Ordering::Relaxed);
        self.prepared = None;
        if !params.knob.replay.value() {
            return;
        }
        let Ok(path) = params.knob.take.read().map(|path| path.clone()) else { return };
        // A take or feel that cannot be had is worded by the desk; nothing is replayed then.
        let Ok(take) = takes::load(&path) else { return };
        let Some(feels) = felt::Felt::default().of(instruments) else { return };
        let Ok(table) = feels.table(&params.settings(), &desk::design(&params.knob), &NO_MOTOR) else {
            return;
        };
        let hand = Hand { maps: feels.maps(&table), design: desk::calibrated(&params.knob), feels: true };
        self.prepared = Some(Prepared { hand, take });
    }

    /// Tells the feel what controllers make of H and k.
    pub fn reed(&self, factors: [f32; 2]) {
        for (place, factor) in self.shared.reed.iter().zip(factors) {
            place.store(factor.to_bits(), Ordering::Relaxed);
        }
    }

    /// Forgets notes and breath; the link stays.
    pub fn reset(&mut self) {
        self.blower.reset();
        self.source = Source::Host;
        self.replayed = 0;
        self.shared.note.store(NO_NOTE, Ordering::Relaxed);
    }

    /// Renders one block: the host's events, and the breath of knob or take between them.
    pub fn render(
        &mut self,
        bench: &mut Bench,
        settings: &Settings,
        host: impl Iterator<Item = Timed<Event>>,
        stage: Stage,
        out: &mut [f32],
    ) {
        if self.reader.is_none() {
            self.reader = self.readers.pop().ok();
        }
        self.sent_count = 0;
        let samples = out.len();
        let (hand, take) = (self.hand.read(), self.take.read());
        let (hand, take) = match &self.prepared {
            Some(Prepared { hand, take }) if stage.replay => (hand, Some(&**take)),
            _ => (hand, take.as_deref().filter(|_| stage.replay)),
        };
        // The ring is emptied even when nobody listens.
        let mut reader = self.reader.as_mut();
        if let Some(reader) = &mut reader {
            reader.begin_block(samples, stage.rate_hz);
        }
        let source = match (&take, &reader) {
            _ if !hand.maps.is_ready() => Source::Host,
            (Some(_), _) => Source::Take,
            (None, Some(reader)) if !stage.offline && reader.pose(0).is_some() => Source::Knob,
            _ => Source::Host,
        };
        let gone = (source == Source::Host && self.source != Source::Host)
            .then(|| self.blower.fall_silent())
            .flatten();
        self.source = source;
        let full_pa = 1e3 * f64::from(settings.breath_full_kpa);
        let (sent, sent_count) = (&mut self.sent, &mut self.sent_count);
        let shared = &self.shared;
        let closing_pa = settings.closing_pa();
        let mut heard = |at: usize, breath: Breath14| {
            let gamma = f64::from(breath.unit()) * full_pa / closing_pa;
            shared.gamma.store((gamma as f32).to_bits(), Ordering::Relaxed);
            if let Some(place) = sent.get_mut(*sent_count) {
                *place = (at, breath);
                *sent_count += 1;
            }
        };
        match (source, take, reader) {
            (Source::Take, Some(take), _) => {
                let begun = self.replayed;
                let angle = |at: usize| Some(take.angle_deg((begun + at as u64) as f64 / stage.rate_hz));
                let events = Blown::new(host, &mut self.blower, hand, full_pa, samples, angle, &mut heard);
                bench.render_events(events, out);
                self.replayed += samples as u64;
            }
            (Source::Knob, _, Some(reader)) => {
                let slap = reader.take_slap().map(|speed| Timed {
                    at: 0,
                    event: Event::TongueSlap { strength: slap_strength(speed) },
                });
                let angle = |at: usize| reader.pose(at).map(|pose| f64::from(pose.angle_deg));
                let events = Blown::new(host, &mut self.blower, hand, full_pa, samples, angle, &mut heard);
                bench.render_events(slap.into_iter().chain(events), out);
            }
            _ => {
                let blower = &mut self.blower;
                let host = host.inspect(|event| blower.heed(event));
                let gone = gone.map(|breath| {
                    heard(0, breath);
                    Timed { at: 0, event: Event::Breath(breath.unit()) }
                });
                bench.render_events(gone.into_iter().chain(host), out);
            }
        }
        self.blower.advance(samples);
        let note = self.blower.fingered().map_or(NO_NOTE, |note| note.0);
        self.shared.note.store(note, Ordering::Relaxed);
    }

    /// The knob's breath of the last block, in order of time, for the host to record.
    pub fn sent(&self) -> &[(usize, Breath14)] {
        &self.sent[..self.sent_count]
    }
}
