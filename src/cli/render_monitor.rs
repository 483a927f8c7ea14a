//! Analyses a rendering while it runs, for figures and reports. Memory does not grow with the length of the sound.

use crate::cli::Failure;
use crate::cli::render_job::RenderJob;
use chalumeau_core::analysis::overview::{Envelope, Overview, Watcher};
use chalumeau_core::instrument::{Probe, Settings};
use chalumeau_core::measure::notes::{MeasuredNote, NoteMeter};
use chalumeau_core::score::NoteSpan;
use chalumeau_figure::Figure;
use chalumeau_figure::performance::{Note, PerformanceFigure, ReedCloseUp, performance};

/// Columns of a picture: as many as a drawing of usual size has pixels for.
pub const COLUMNS: usize = 1_300;
/// Periods of the note in the reed's close-up.
const PERIODS: f64 = 5.0;
/// Least and greatest length of the close-up, s: short enough to see the reed shut, long enough to see it twice.
const MOMENT_S: (f64, f64) = (0.004, 0.05);
/// Period where there is no note, s.
const PERIOD_S: f64 = 0.004;

/// Collects what the figure and the report need, block by block.
pub struct RenderMonitor {
    watcher: Watcher,
    listener: NoteMeter,
    gamma: Envelope,
    moment: ReedCloseUp,
    /// First and last internal sample of the close-up.
    near: (u64, u64),
    seen: u64,
    soundings: Vec<NoteSpan>,
    rate_hz: f64,
    a4_hz: f64,
    closing_pa: f64,
}

/// Analysis of a whole rendering.
pub struct RenderSummary {
    overview: Overview,
    gamma: Envelope,
    moment: ReedCloseUp,
    score: Vec<Note>,
    /// Each note's pitch and level.
    pub heard: Vec<MeasuredNote>,
    a4_hz: f64,
    closing_pa: f64,
}

impl RenderMonitor {
    /// For a rendering that is about to begin. The close-up is at `near_s`, or in the middle of the longest note.
    pub fn new(prepared: &RenderJob, near_s: Option<f64>) -> Result<Self, Failure> {
        let (score, rate_hz) = (&prepared.score, f64::from(prepared.rate));
        let notes = prepared.settings.reach.key_notes(&prepared.model);
        let (seconds, soundings) = (score.seconds(prepared.rate), score.note_spans(&notes));
        if let Some(near_s) = near_s.filter(|&near_s| near_s >= seconds) {
            return Err(Failure::Usage(format!(
                "--plot-at {near_s} is after the end; the sound is {seconds:.3} s long"
            )));
        }
        let longest = soundings.iter().max_by_key(|sounding| sounding.to - sounding.from);
        let middle_s = |sounding: &NoteSpan| 0.5 * (sounding.from + sounding.to) as f64 / rate_hz;
        let near_s = near_s.or(longest.map(middle_s)).unwrap_or(0.5 * seconds);
        let within = |sounding: &&NoteSpan| {
            let at = near_s * rate_hz;
            (sounding.from as f64..sounding.to as f64).contains(&at)
        };
        let a4_hz = f64::from(prepared.settings.a4_hz);
        let gain_db = f64::from(prepared.settings.gain_db - Settings::default().gain_db);
        let period_s = soundings
            .iter()
            .find(within)
            .map_or(PERIOD_S, |sounding| 1.0 / sounding.note.frequency_hz(a4_hz));
        let length_s = (PERIODS * period_s).clamp(MOMENT_S.0, MOMENT_S.1);
        let pitches = soundings.iter().map(|sounding| sounding.note.frequency_hz(a4_hz));
        let lowest_hz = pitches.fold(f64::INFINITY, f64::min);
        let internal_hz = prepared.model.coeffs.rate_hz;
        let near = ((near_s * internal_hz) as u64, ((near_s + length_s) * internal_hz) as u64);
        let internal = (seconds * internal_hz).ceil() as usize;
        Ok(Self {
            watcher: Watcher::new(score.samples, rate_hz, COLUMNS).with_notes_from(lowest_hz),
            listener: NoteMeter::new(soundings.clone(), rate_hz, a4_hz, gain_db),
            gamma: Envelope::new(internal, COLUMNS),
            moment: ReedCloseUp {
                from_s: near.0 as f64 / internal_hz,
                step_s: 1.0 / internal_hz,
                probes: Vec::new(),
            },
            near,
            seen: 0,
            soundings,
            rate_hz,
            a4_hz,
            closing_pa: prepared.settings.closing_pa(),
        })
    }

    /// Takes the next internal sample.
    pub fn inside(&mut self, probe: Probe) {
        let probe = probe.over(self.closing_pa);
        self.gamma.push(probe.gamma as f32);
        if (self.near.0..self.near.1).contains(&self.seen) {
            self.moment.probes.push(probe);
        }
        self.seen += 1;
    }

    /// Takes the next block of sound.
    pub fn hear(&mut self, block: &[f32]) {
        self.watcher.see(block);
        self.listener.hear(block);
    }

    /// The analysis of the whole rendering.
    pub fn finish(self) -> RenderSummary {
        let note = |sounding: &NoteSpan| Note {
            note: sounding.note,
            from_s: sounding.from as f64 / self.rate_hz,
            to_s: sounding.to as f64 / self.rate_hz,
        };
        RenderSummary {
            overview: self.watcher.finish(),
            gamma: self.gamma,
            moment: self.moment,
            score: self.soundings.iter().map(note).collect(),
            heard: self.listener.finish(),
            a4_hz: self.a4_hz,
            closing_pa: self.closing_pa,
        }
    }
}

impl RenderSummary {
    /// The figure of the rendering.
    pub fn figure(&self, title: &str, notes: Vec<String>) -> Figure {
        performance(&PerformanceFigure {
            title,
            notes,
            overview: &self.overview,
            score: &self.score,
            a4_hz: self.a4_hz,
            gamma: &self.gamma,
            closing_pa: self.closing_pa,
            moment: Some(&self.moment),
        })
    }
}
