//! A player at a knob, whole: hand, knob, firmware, wire, host, breath, clarinet. Everything is what a user runs, but for
//! the port between the two and the clock: time is simulated.

use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::{Clarinet, Model, Probe, Settings};
use chalumeau_core::units::SoundingNote;
use chalumeau_firmware::Setup;
use chalumeau_knob::device::reader::{KnobReader, KnobWriter, ring};
use chalumeau_knob::device::session::{HostSession, SessionEvent, SessionOutput};
use chalumeau_knob::device::transport::Binding;
use chalumeau_knob::simulator::hand::{HandDesign, SimulatedHand};
use chalumeau_knob::simulator::knob::{PERIOD_US, SimulatedKnob};
use chalumeau_knob::simulator::plant::PlantDesign;
use chalumeau_knob::touch::angle::KnobDesign;
use chalumeau_knob::touch::breath_from_angle::{Blower, BlownEvents, Breath14, BreathMapping, GRID};
use chalumeau_knob::touch::feel::PitchMaps;
use chalumeau_knob::wire::Feel;
use std::sync::Arc;
use std::time::Instant;

/// Samples a second of the host.
const RATE_HZ: f64 = 48_000.0;

pub struct LoopPlayer {
    pub knob: SimulatedKnob,
    pub session: HostSession,
    pub clarinet: Clarinet,
    writer: KnobWriter,
    reader: KnobReader,
    blower: Blower,
    hand: BreathMapping,
    full_pa: f64,
    /// The latest breath, over full breath.
    breath_unit: f64,
    rendered: u64,
    is_sounding: bool,
    /// What happens with the next block.
    due: Vec<Event>,
}

impl LoopPlayer {
    /// Sits down: the knob has been found and feels, nothing is armed, the hand lies on the knob.
    pub fn new(
        model: &Arc<Model>,
        settings: &Settings,
        maps: PitchMaps,
        feel: Feel,
        hand: HandDesign,
        plant: PlantDesign,
    ) -> Self {
        let setup = Setup { knob_damping_nms: plant.viscous_nms as f32, ..Setup::default() };
        let (writer, reader) = ring(Instant::now());
        let mut clarinet = Clarinet::new(model.clone(), RATE_HZ);
        clarinet.set_settings(settings);
        let mut player = Self {
            knob: SimulatedKnob::new(setup, plant, SimulatedHand::new(hand, 1), 1),
            session: HostSession::new(Binding::Serial, 0x0C10_5ED0, 0),
            clarinet,
            writer,
            reader,
            blower: Blower::default(),
            hand: BreathMapping { maps, design: KnobDesign::default(), feels: true },
            full_pa: 1e3 * f64::from(settings.breath_full_kpa),
            breath_unit: 0.0,
            rendered: 0,
            is_sounding: false,
            due: Vec::new(),
        };
        player.session.want_feel(feel);
        player.run(0.5, |_| {}, |_| {});
        player
    }

    /// The user's act.
    pub fn arm(&mut self, ceiling_mnm: u16) {
        self.session.arm(ceiling_mnm, false, self.now_us());
        self.run(0.5, |_| {}, |_| {});
        assert!(self.session.is_armed() && self.knob.is_armed(), "{:?}", self.session.refusal());
    }

    /// Fingers a note; the clarinet is rendered from here on.
    pub fn finger(&mut self, note: SoundingNote) {
        self.play(Event::NoteOn { note, velocity: 0.8 });
    }

    /// Plays an event with the next block; the clarinet is rendered from here on.
    pub fn play(&mut self, event: Event) {
        self.due.push(event);
        self.is_sounding = true;
    }

    /// The mouth pressure that the hand makes, Pa, whether or not a key lets it into the reed.
    pub fn blown_pa(&self) -> f64 {
        self.breath_unit * self.full_pa
    }

    /// What the link does when another note is fingered.
    pub fn want_feel(&mut self, feel: Feel) {
        self.session.want_feel(feel);
    }

    /// The clarinet is not rendered any more.
    pub fn rest(&mut self) {
        self.is_sounding = false;
    }

    fn now_us(&self) -> i64 {
        self.knob.t_us() as i64
    }

    /// Lets time pass; `tick` sees the knob after every period, `probe` the inside of the clarinet while it is rendered.
    pub fn run(&mut self, seconds: f64, mut tick: impl FnMut(&SimulatedKnob), mut probe: impl FnMut(Probe)) {
        let until_us = self.now_us() + (1e6 * seconds).round() as i64;
        while self.now_us() < until_us {
            let block_us = (1e6 * self.rendered as f64 / RATE_HZ) as i64;
            while self.now_us() < block_us {
                self.period();
                tick(&self.knob);
            }
            self.block(block_us, &mut probe);
        }
    }

    /// One turn of the knob's loop, and what the link's thread does meanwhile.
    fn period(&mut self) {
        self.knob.step();
        let (now_us, mut bytes) = (self.now_us(), Vec::new());
        self.session.obeyed(now_us, "the player");
        self.knob.receive(&mut bytes);
        let writer = &mut self.writer;
        let mut tell = |happening: SessionEvent| {
            if let SessionEvent::State(state) = happening {
                writer.push((&state).into());
            }
        };
        self.session.receive(now_us, &bytes, &mut tell);
        let knob = &mut self.knob;
        let mut send = |wish: SessionOutput| {
            if let SessionOutput::Send(bytes) = wish {
                knob.send(bytes);
            }
        };
        // The link's thread wakes every millisecond.
        if (now_us as u64).is_multiple_of(2 * PERIOD_US) {
            self.session.poll(now_us, &mut send, &mut tell);
        }
    }

    /// One callback of the audio thread.
    fn block(&mut self, now_us: i64, probe: &mut dyn FnMut(Probe)) {
        const SAMPLES: usize = GRID as usize;
        self.reader.begin_block_at(now_us, SAMPLES, RATE_HZ);
        let due: Vec<_> = self.due.drain(..).map(|event| Timed { at: 0, event }).collect();
        let reader = &self.reader;
        let angle = |at: usize| reader.pose(at).map(|pose| f64::from(pose.angle_deg));
        let breath_unit = &mut self.breath_unit;
        let mut heard = |_, breath: Breath14| *breath_unit = f64::from(breath.unit());
        let events = BlownEvents::new(
            due.into_iter(),
            &mut self.blower,
            &self.hand,
            self.full_pa,
            SAMPLES,
            angle,
            &mut heard,
        );
        // A block is one step of the breath's grid: everything happens at its first sample.
        for event in events {
            assert_eq!(event.at, 0);
            self.clarinet.apply(event.event);
        }
        if self.is_sounding {
            self.clarinet.render_probed(&mut [0.0; SAMPLES], probe);
        }
        self.blower.advance(SAMPLES);
        self.rendered += GRID;
    }
}
