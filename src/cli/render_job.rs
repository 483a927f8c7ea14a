//! A checked rendering: instrument, settings and score; and its playing, into whatever takes the samples.

use crate::cli::Failure;
use crate::cli::settings::SettingsArgs;
use crate::cli::shared_args::PlayedArgs;
use chalumeau_core::event::{Event, PartEvent, SettingNumber};
use chalumeau_core::instrument::listening::ListeningMode;
use chalumeau_core::instrument::side_by_side::{PlayedBeside, Stand};
use chalumeau_core::instrument::{Clarinet, Ensemble, Model, Probe, Settings};
use chalumeau_core::score::{self, Score, StereoBlocks};
use std::sync::Arc;

/// Samples per block; any number gives the same sound.
const BLOCK: usize = 512;

/// Everything a rendering needs.
pub struct RenderJob {
    /// The instrument at this rate.
    pub model: Arc<Model>,
    /// What the player has set.
    pub settings: Settings,
    /// What is played, with its tail.
    pub score: Score,
    /// The same, with who of several players plays it.
    pub parts: Score<PartEvent>,
    /// Sample rate, Hz.
    pub rate: u32,
    /// What the user should know before it plays: notes that stay silent.
    pub warnings: Vec<String>,
    /// Which given settings have no effect.
    pub idle: Option<String>,
}

impl RenderJob {
    /// The instrument and the player's settings, with nothing to play.
    pub(super) fn without_score(
        instrument: &PlayedArgs,
        settings: &SettingsArgs,
        rate: u32,
    ) -> Result<Self, Failure> {
        let file = instrument.load()?;
        let settings = settings.played(&file)?;
        let model = instrument.model(file, rate, settings.a4_hz)?;
        Ok(Self::to_play_later(model, settings, rate))
    }

    /// An instrument that is ready, with nothing to play.
    pub(super) fn to_play_later(model: Arc<Model>, settings: Settings, rate: u32) -> Self {
        Self {
            model,
            settings,
            score: Score::default(),
            parts: Score::default(),
            rate,
            warnings: Vec::new(),
            idle: None,
        }
    }

    /// Whether a growl is heard somewhere.
    pub(super) fn growls(&self) -> bool {
        let is_growl = |event: Event| match event {
            Event::Set(SettingNumber::Growl, amount) => amount > 0.0,
            _ => false,
        };
        self.settings.techniques.growl > 0.0 || self.score.events.iter().any(|event| is_growl(event.event))
    }

    /// The instrument as a host has it before it plays: the settings are in place from the first sample.
    pub fn clarinet(&self) -> Clarinet {
        let mut clarinet = Clarinet::new(self.model.clone(), f64::from(self.rate));
        clarinet.set_settings(&self.settings);
        clarinet.reset();
        clarinet
    }

    /// The same for several players.
    pub fn ensemble(&self) -> Ensemble {
        let mut ensemble = Ensemble::new(self.model.clone(), f64::from(self.rate));
        ensemble.set_settings(&self.settings);
        ensemble.reset();
        ensemble
    }

    /// Channels where nobody says how many: two in a room, for several players and from two places, else one.
    pub fn usual_channels(&self) -> u16 {
        let is_wide = self.has_several_players()
            || self.settings.room.amount > 0.0
            || self.settings.listening.mode == ListeningMode::Position;
        if is_wide { 2 } else { 1 }
    }

    /// Prints the warnings.
    pub(super) fn warn(&self) {
        self.warnings.iter().for_each(|warning| say!("warning: {warning}"));
    }

    /// Whether several players play.
    pub fn has_several_players(&self) -> bool {
        self.settings.players.count > 1
    }

    /// As [`play`](Self::play) without a look inside, beside other renderings: the same bits, in less time.
    ///
    /// # Errors
    ///
    /// The first error that `each` returns; it ends the playing.
    pub async fn play_beside<E>(
        &self,
        stand: &Stand,
        channels: u16,
        mut each: impl FnMut(&[f32], &[&[f32]]) -> Result<(), E>,
    ) -> Result<u64, E> {
        if self.has_several_players() {
            return self.play(channels, None, each);
        }
        let in_room = || StereoBlocks::new(&self.score, self.rate).in_room(&self.settings);
        let mut stereo = (channels == 2).then(in_room);
        let clarinet = PlayedBeside::new(self.clarinet());
        let is_stereo = stereo.is_some();
        score::play_beside(
            stand,
            &clarinet,
            &self.score,
            BLOCK,
            is_stereo,
            |left, right| match &mut stereo {
                Some(stereo) => each(left, &stereo.pan(left, right)),
                None => each(left, &[left]),
            },
        )
        .await?;
        Ok(clarinet.resets())
    }

    /// Plays on one or two channels. `each` gets blocks: what the instrument sends before its place between two channels,
    /// and what is heard, one channel or left and right. `inside` is called for each sample of the internal rate of a lone
    /// player. Returns how often the calculation broke down.
    ///
    /// # Errors
    ///
    /// The first error that `each` returns; it ends the playing.
    pub fn play<E>(
        &self,
        channels: u16,
        inside: Option<&mut dyn FnMut(Probe)>,
        mut each: impl FnMut(&[f32], &[&[f32]]) -> Result<(), E>,
    ) -> Result<u64, E> {
        let several = self.has_several_players();
        // One channel is the instrument itself; pan (CC10) places it between two.
        let unpanned = several.then(|| without_pan(&self.score));
        let score_of_room = unpanned.as_ref().unwrap_or(&self.score);
        let in_room = || StereoBlocks::new(score_of_room, self.rate).in_room(&self.settings);
        let stereo = (channels == 2).then(in_room);
        if several {
            let mut ensemble = self.ensemble();
            match stereo {
                Some(mut stereo) => {
                    score::play_ensemble_stereo(&mut ensemble, &self.parts, BLOCK, |left, right| {
                        each(left, &stereo.pan(left, right))
                    })?;
                }
                None => {
                    score::play_ensemble(&mut ensemble, &self.parts, BLOCK, |block| each(block, &[block]))?
                }
            }
            return Ok(ensemble.resets());
        }
        let mut clarinet = self.clarinet();
        match (stereo, inside) {
            (Some(mut stereo), inside) => {
                let inside: &mut dyn FnMut(Probe) = match inside {
                    Some(inside) => inside,
                    None => &mut |_| (),
                };
                score::play_stereo(&mut clarinet, &self.score, BLOCK, inside, |left, right| {
                    each(left, &stereo.pan(left, right))
                })?;
            }
            (None, Some(inside)) => {
                score::play_probed(&mut clarinet, &self.score, BLOCK, inside, |block| each(block, &[block]))?;
            }
            (None, None) => score::play(&mut clarinet, &self.score, BLOCK, |block| each(block, &[block]))?,
        }
        Ok(clarinet.resets())
    }
}

/// The same score without pan: several players are panned one by one.
fn without_pan(score: &Score) -> Score {
    let mut score = score.clone();
    score.events.retain(|timed| !matches!(timed.event, Event::Pan { .. }));
    score
}
