//! Looks for fingerings for the window. All fingerings of an instrument are worked out once, on a thread of their own: about a
//! second of one core, and some twenty megabytes until another instrument is asked.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;

use crate::editor::fingering_search::{FingeringAnswer, FingeringQuestion, FingeringSearch};
use chalumeau_core::bore::fingering_finder::FingeringFinder;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::units::Air;

/// The finder of the latest instrument, and the thread that makes it. Dropping it ends the thread.
#[derive(Default)]
pub struct FingeringSearcher {
    of: Option<(Arc<InstrumentFile>, Air, f64)>,
    finder: Option<FingeringFinder>,
    running: Option<Running>,
    answer: Option<Arc<FingeringAnswer>>,
}

struct Running {
    thread: JoinHandle<Option<FingeringFinder>>,
    stop: Arc<AtomicBool>,
    /// The share done, the bits of a number.
    done: Arc<AtomicU32>,
}

impl FingeringSearcher {
    /// The answer for an instrument as far as it is known, without waiting for the rest. Without a question the search ends.
    pub fn look(
        &mut self,
        question: Option<FingeringQuestion>,
        file: &Arc<InstrumentFile>,
        air: Air,
        a4_hz: f64,
    ) -> FingeringSearch {
        let Some(question) = question else {
            self.end();
            return FingeringSearch::Resting;
        };
        let is_known = |(of, in_air, at_hz): &(Arc<InstrumentFile>, Air, f64)| {
            *in_air == air && *at_hz == a4_hz && (Arc::ptr_eq(of, file) || of == file)
        };
        if !self.of.as_ref().is_some_and(is_known) {
            self.end();
            (self.of, self.finder, self.answer) = (Some((file.clone(), air, a4_hz)), None, None);
        }
        if let Some(done) = self.running.take_if(|running| running.thread.is_finished()) {
            // The panic of a thread was reported when it happened.
            self.finder = done.thread.join().ok().flatten();
        }
        let Some(finder) = &self.finder else {
            if self.running.is_none() {
                self.running = Running::start(file.clone(), air, a4_hz);
            }
            let done = self.running.as_ref().map_or(0, |running| running.done.load(Ordering::Relaxed));
            return FingeringSearch::Looking(f32::from_bits(done));
        };
        let known = self.answer.take().filter(|answer| answer.question == question);
        let answer = known.unwrap_or_else(|| Arc::new(FingeringAnswer::new(finder, question)));
        self.answer = Some(answer.clone());
        FingeringSearch::Found(answer)
    }

    /// Ends a search that runs. It hears within some milliseconds.
    fn end(&mut self) {
        if let Some(running) = self.running.take() {
            running.stop.store(true, Ordering::Relaxed);
            let _ = running.thread.join();
        }
    }
}

impl Drop for FingeringSearcher {
    /// No thread may outlive the plugin's library.
    fn drop(&mut self) {
        self.end();
    }
}

impl Running {
    fn start(file: Arc<InstrumentFile>, air: Air, a4_hz: f64) -> Option<Self> {
        let (stop, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU32::new(0)));
        let (ends, tells) = (stop.clone(), done.clone());
        let search = move || {
            FingeringFinder::new(&file, air, a4_hz, &mut |share| {
                tells.store((share as f32).to_bits(), Ordering::Relaxed);
                if ends.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })
        };
        let thread = std::thread::Builder::new().name("FingeringSearch".to_owned());
        Some(Self { thread: thread.spawn(search).ok()?, stop, done })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::window::editor_app::try_holes;
    use chalumeau_core::analysis::pitch::fundamental_hz;
    use chalumeau_core::event::Event;
    use chalumeau_core::instrument::Clarinet;
    use chalumeau_core::units::{SoundingNote, WrittenNote, cents};
    use std::time::{Duration, Instant};

    const RATE_HZ: f64 = 48_000.0;

    /// The answer once it is there, and the shares that were told before.
    fn wait(
        searcher: &mut FingeringSearcher,
        question: FingeringQuestion,
        file: &Arc<InstrumentFile>,
    ) -> (Arc<FingeringAnswer>, Vec<f32>) {
        let (began, mut shares) = (Instant::now(), Vec::new());
        loop {
            match searcher.look(Some(question), file, Air::default(), 440.0) {
                FingeringSearch::Found(answer) => return (answer, shares),
                FingeringSearch::Looking(share) => shares.push(share),
                FingeringSearch::Resting => panic!("a question was put"),
            }
            assert!(began.elapsed() < Duration::from_secs(60), "no answer");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// The chart's own fingering of C6 is among the first five; another of the list reaches the voice, which then sounds as that
    /// fingering does and no longer as the key that is held.
    #[test]
    fn a_fingering_that_is_found_is_played() {
        let file = Arc::new(InstrumentFile::built_in());
        let mut searcher = FingeringSearcher::default();
        let question = |note| FingeringQuestion { note: WrittenNote(note), trill_to: None };
        let (c6, shares) = wait(&mut searcher, question(84), &file);
        assert!(
            shares.len() > 3 && shares.is_sorted() && shares.iter().any(|&share| share > 0.0),
            "{shares:?}"
        );
        assert!(c6.looked_through > 39_744 && c6.rows.iter().take(5).any(|row| row.is_of_chart));
        // Nothing is worked out again for another note.
        assert!(matches!(
            searcher.look(Some(question(79)), &file, Air::default(), 440.0),
            FingeringSearch::Found(answer) if answer.question == question(79)
        ));

        // G4 of the chart, on the key of E4.
        let (g4, _) = wait(&mut searcher, question(67), &file);
        let chosen = &g4.rows[0].note;
        let open = chosen.grip.holes(&file);
        let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
        let mut heard_hz = |event| {
            clarinet.apply(event);
            let mut sound = vec![0.0; RATE_HZ as usize / 2];
            clarinet.render(&mut sound);
            let last: Vec<f64> = sound[sound.len() / 2..].iter().map(|&sample| f64::from(sample)).collect();
            fundamental_hz(&last, RATE_HZ).expect("a pitch")
        };
        let held = heard_hz(Event::NoteOn { note: SoundingNote(62), velocity: 0.8 });
        let tried = heard_hz(try_holes(&open));
        let off = (cents(held, 293.66), cents(tried, 349.23));
        assert!(off.0.abs() < 15.0 && off.1.abs() < 50.0, "{off:?}");
    }

    #[test]
    fn without_a_question_the_search_ends() {
        let file = Arc::new(InstrumentFile::built_in());
        let mut searcher = FingeringSearcher::default();
        let question = FingeringQuestion { note: WrittenNote(60), trill_to: None };
        assert!(matches!(
            searcher.look(Some(question), &file, Air::default(), 440.0),
            FingeringSearch::Looking(_)
        ));
        assert_eq!(searcher.look(None, &file, Air::default(), 440.0), FingeringSearch::Resting);
        assert!(searcher.running.is_none() && searcher.finder.is_none());
    }
}
