//! An instrument that plays events and is heard.

use chalumeau_core::event::{Event, Timed};
use chalumeau_core::instrument::{Clarinet, Model, Settings};
use chalumeau_core::score::{Score, play};
use std::convert::Infallible;
use std::sync::Arc;

/// Samples of a block.
const BLOCK: usize = 512;

/// What a new player makes of events, at times in s.
pub fn rendered(
    model: &Arc<Model>,
    rate_hz: f64,
    settings: &Settings,
    events: &[(f64, Event)],
    seconds: f64,
) -> Vec<f64> {
    let sample = |s: f64| (s * rate_hz) as usize;
    let mut clarinet = Clarinet::new(model.clone(), rate_hz);
    clarinet.set_settings(settings);
    clarinet.reset();
    let events = events.iter().map(|&(s, event)| Timed { at: sample(s), event }).collect();
    let mut out = Vec::with_capacity(sample(seconds));
    let Ok(()) = play(&mut clarinet, &Score { events, samples: sample(seconds) }, BLOCK, |block| {
        out.extend(block.iter().map(|&x| f64::from(x)));
        Ok::<_, Infallible>(())
    });
    out
}
