//! Signs of life of the threads that obey the user.
//!
//! A link runs on a thread of its own, which goes on when a host stops calling the plugin, when a window hangs, and when a
//! terminal holds the program's output. A knob must not: whoever could switch it off is no longer there. So each thread that
//! obeys the user has a [`Heartbeat`], and the link keeps a knob armed only while all of them beat.

use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A knob is let go when a thread that obeys the user has been silent for this long, us. By judgement: longer than any
/// audio block and any redraw of a window, shorter than the time in which a user would pull the plug.
pub const OBEDIENCE_US: i64 = 500_000;

/// Why a thread wants the knob to be let go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Release {
    /// The host silences everything.
    Panic,
    /// The host deactivates or resets the plugin.
    Deactivated,
    /// The host's transport stops.
    TransportStopped,
    /// The user presses stop, or Escape.
    Stop,
    /// The user interrupts the program.
    Interrupted,
    /// The user switches off what armed it.
    SwitchedOff,
}

impl Release {
    const ALL: [Self; 6] = [
        Self::Panic,
        Self::Deactivated,
        Self::TransportStopped,
        Self::Stop,
        Self::Interrupted,
        Self::SwitchedOff,
    ];

    /// The reason for people, as it follows "disarmed: ".
    pub fn text(self) -> &'static str {
        match self {
            Self::Panic => "Panic",
            Self::Deactivated => "the host has deactivated or reset the plugin",
            Self::TransportStopped => "the host has stopped",
            Self::Stop => "stop was pressed",
            Self::Interrupted => "the program was interrupted",
            Self::SwitchedOff => "Arm was switched off",
        }
    }
}

#[derive(Debug)]
struct Source {
    name: &'static str,
    beats: AtomicU32,
    releases: AtomicU32,
    reason: AtomicU8,
}

/// The sign of life of one thread. When the last clone of it is dropped, the link no longer waits for that thread.
#[derive(Clone, Debug)]
pub struct Heartbeat(Arc<Source>);

impl Heartbeat {
    /// This thread lives and obeys the user. Call it many times a second. Real-time safe.
    pub fn beat(&self) {
        self.0.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// Torque off, now. Real-time safe; takes effect within a few milliseconds, even if this thread never runs again.
    pub fn let_go(&self, reason: Release) {
        self.0.reason.store(reason as u8, Ordering::Relaxed);
        self.0.releases.fetch_add(1, Ordering::Release);
    }
}

/// All heartbeats of a link.
#[derive(Clone, Debug, Default)]
pub struct Heartbeats(Arc<Mutex<Vec<Arc<Source>>>>);

impl Heartbeats {
    /// A heartbeat for the thread of this name, which completes the sentence "... has stood still".
    pub fn register(&self, name: &'static str) -> Heartbeat {
        let source = Arc::new(Source {
            name,
            beats: AtomicU32::new(0),
            releases: AtomicU32::new(0),
            reason: AtomicU8::new(0),
        });
        let mut sources = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        sources.push(source.clone());
        Heartbeat(source)
    }
}

/// What the heartbeats say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// When the last of them was heard that was heard longest ago, us, and whose it is; `None` if there is none.
    pub oldest: Option<(i64, &'static str)>,
    /// Why the knob shall be let go, if somebody has said so since the last look.
    pub released: Option<Release>,
}

#[derive(Debug)]
struct Watched {
    source: Arc<Source>,
    beats: u32,
    releases: u32,
    heard_us: i64,
}

/// The link's side: notices which heartbeats have moved.
#[derive(Debug)]
pub struct Monitor {
    heartbeats: Heartbeats,
    watched: Vec<Watched>,
}

impl Monitor {
    /// Watches these.
    pub fn new(heartbeats: Heartbeats) -> Self {
        Self { heartbeats, watched: Vec::new() }
    }

    /// Looks at all of them. Call it more often than they may be silent.
    pub fn look(&mut self, now_us: i64) -> Pulse {
        // Whoever registers lives. From here on this holds the source, so that a last word is heard though its thread has ended.
        let registered =
            std::mem::take(&mut *self.heartbeats.0.lock().unwrap_or_else(PoisonError::into_inner));
        let new =
            registered.into_iter().map(|source| Watched { source, beats: 0, releases: 0, heard_us: now_us });
        self.watched.extend(new);
        let mut pulse = Pulse { oldest: None, released: None };
        self.watched.retain_mut(|known| {
            let source = &known.source;
            // Before the last word is read: none comes after it.
            let is_dropped = Arc::strong_count(source) == 1;
            let releases = source.releases.load(Ordering::Acquire);
            if std::mem::replace(&mut known.releases, releases) != releases {
                let reason = usize::from(source.reason.load(Ordering::Relaxed));
                pulse.released = Release::ALL.get(reason).copied();
            }
            if is_dropped {
                return false;
            }
            let beats = source.beats.load(Ordering::Relaxed);
            if std::mem::replace(&mut known.beats, beats) != beats {
                known.heard_us = now_us;
            }
            if pulse.oldest.is_none_or(|(at, _)| known.heard_us < at) {
                pulse.oldest = Some((known.heard_us, source.name));
            }
            true
        });
        pulse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_of_all_heartbeats_counts_and_a_dropped_one_no_longer() {
        let heartbeats = Heartbeats::default();
        let mut monitor = Monitor::new(heartbeats.clone());
        assert_eq!(monitor.look(0), Pulse { oldest: None, released: None });
        let (audio, window) = (heartbeats.register("audio"), heartbeats.register("window"));
        monitor.look(10);
        audio.beat();
        assert_eq!(monitor.look(20).oldest, Some((10, "window")));
        window.beat();
        assert_eq!(monitor.look(30).oldest, Some((20, "audio")));
        drop(window);
        audio.clone().beat();
        assert_eq!(monitor.look(40).oldest, Some((40, "audio")));
        drop(audio);
        assert_eq!(monitor.look(50).oldest, None, "nobody obeys the user any more");
    }

    #[test]
    fn a_release_is_told_once_though_its_thread_never_runs_again() {
        let heartbeats = Heartbeats::default();
        let mut monitor = Monitor::new(heartbeats.clone());
        let audio = heartbeats.register("audio");
        monitor.look(0);
        audio.let_go(Release::Stop);
        assert_eq!(monitor.look(1).released, Some(Release::Stop));
        assert_eq!(monitor.look(2).released, None);
        // Nor does the thread have to live until the next look.
        let (brief, _other) = (heartbeats.register("brief"), heartbeats.register("other"));
        brief.let_go(Release::Panic);
        drop(brief);
        assert_eq!(monitor.look(3).released, Some(Release::Panic));
        audio.let_go(Release::Stop);
        drop(audio);
        let Pulse { oldest, released } = monitor.look(4);
        assert_eq!((oldest.map(|(_, name)| name), released), (Some("other"), Some(Release::Stop)));
        assert_eq!(monitor.look(5).released, None);
    }
}
