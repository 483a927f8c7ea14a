//! `chalumeau report --tour`: the [tour](crate::tour) as a page with its sounds in it.

use crate::cli::Failure;
use crate::cli::render_job::RenderJob;
use crate::identity;
use crate::tour;
use crate::wav::{Depth, WavFile};
use chalumeau_core::instrument::Settings;
use chalumeau_core::score::Score;
use chalumeau_figure::report::{Chapter, Report as Page, Sound, Track};
use indicatif::ProgressBar;
use std::io::Cursor;

/// Plays everything; `bar` makes a progress bar for so many samples.
pub fn page(
    job: &RenderJob,
    command: String,
    bar: impl FnOnce(usize) -> ProgressBar,
) -> Result<Page, Failure> {
    let (model, rate) = (&job.model, job.rate);
    let chapters = tour::chapters(model, job.settings, rate);
    let samples = chapters.iter().flat_map(|(_, stops)| stops).map(|stop| stop.score.samples).sum();
    let bar = bar(samples);
    let mut pages = Vec::new();
    for (title, stops) in chapters {
        let mut tracks = Vec::new();
        for stop in stops {
            let wav = sound(job, stop.settings, &stop.score)?;
            bar.inc(stop.score.samples as u64);
            tracks.push(Track {
                title: stop.title.to_owned(),
                words: stop.words.to_owned(),
                sound: Sound::Inside(wav),
            });
        }
        pages.push(Chapter { title: title.to_owned(), tracks, ..Chapter::default() });
    }
    bar.finish_and_clear();
    let file = &model.file;
    Ok(Page {
        title: format!("A tour of the {}", file.name),
        about: vec![
            "Every sound on this page is computed: a reed, a bore with its tone holes, and a player who blows and fingers."
                .to_owned(),
            "Use headphones. The loudest scale is some 22 dB louder than the softest: set the volume by the scale in ff.".to_owned(),
        ],
        sound: None,
        plates: Vec::new(),
        chapters: pages,
        tables: Vec::new(),
        made_by: format!("Made by {} {}: {command}", identity::NAME, identity::VERSION),
    })
}

/// One score as a WAV file of 16 bits: mono, or stereo in a room.
fn sound(job: &RenderJob, settings: Settings, score: &Score) -> Result<Vec<u8>, Failure> {
    let channels = if settings.room.amount > 0.0 { 2 } else { 1 };
    let mut bytes = Cursor::new(Vec::new());
    let mut wav = WavFile::new(&mut bytes, job.rate, Depth::Int16, channels, score.samples)?;
    let stop = RenderJob::to_play_later(job.model.clone(), settings, job.rate);
    let stop = RenderJob { score: score.clone(), ..stop };
    stop.play(channels, None, |_, heard| wav.write(heard).map_err(Failure::from))?;
    wav.finish()?;
    Ok(bytes.into_inner())
}
