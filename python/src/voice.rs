//! A clarinet that is played event by event.

use crate::instrument::Instrument;
use crate::mistakes::{signals, watched, wrong};
use crate::render::memory;
use chalumeau::cli::offline;
use chalumeau_core::event::Event;
use chalumeau_core::instrument::Clarinet;
use chalumeau_core::units::SoundingNote;
use numpy::{PyArray1, PyReadwriteArray1};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The instrument at one sample rate. Threads take turns.
#[pyclass(frozen, module = "chalumeau._native")]
pub struct Voice {
    clarinet: Mutex<Clarinet>,
    rate_hz: u32,
}

impl Voice {
    /// A thread that panicked with it would have left a clarinet that can still be played.
    fn lock(&self) -> MutexGuard<'_, Clarinet> {
        self.clarinet.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Fills an array with the next samples. Between seconds of sound it asks whether the user wants to stop (Ctrl-C).
    fn play(&self, out: &mut [f32]) -> PyResult<()> {
        for part in out.chunks_mut(self.rate_hz as usize) {
            self.lock().render(part);
            signals()?;
        }
        Ok(())
    }

    /// Waits without Python's lock: another thread may be rendering.
    fn apply(&self, py: Python<'_>, event: Event) {
        py.detach(|| self.lock().apply(event));
    }
}

#[pymethods]
impl Voice {
    /// Ready to be played, with the settings that names and values say.
    #[new]
    fn new(py: Python<'_>, pairs: Vec<(String, String)>, instrument: &Instrument) -> PyResult<Self> {
        let file = instrument.file.clone();
        let job = py.detach(|| watched(|stop| offline::live(&pairs, Some(file), Some(stop))))?;
        Ok(Self { clarinet: Mutex::new(job.clarinet()), rate_hz: job.rate })
    }

    /// Takes other settings; all that are not named are at their defaults.
    fn set(&self, py: Python<'_>, pairs: Vec<(String, String)>, instrument: &Instrument) -> PyResult<()> {
        let file = &instrument.file;
        let settings = py.detach(|| offline::settings(&pairs, file)).map_err(wrong)?;
        py.detach(|| self.lock().set_settings(&settings));
        Ok(())
    }

    /// Fails if `set` would refuse these settings.
    #[staticmethod]
    fn check(py: Python<'_>, pairs: Vec<(String, String)>, instrument: &Instrument) -> PyResult<()> {
        let file = &instrument.file;
        py.detach(|| offline::settings(&pairs, file)).map(drop).map_err(wrong)
    }

    fn note_on(&self, py: Python<'_>, note: u8, velocity: f32) {
        self.apply(py, Event::NoteOn { note: SoundingNote(note), velocity });
    }

    /// What the user should know of a key: that it stays silent.
    fn silent(&self, py: Python<'_>, note: u8) -> Vec<String> {
        py.detach(|| {
            let clarinet = self.lock();
            offline::silent(SoundingNote(note), clarinet.model(), clarinet.settings())
        })
    }

    fn note_off(&self, py: Python<'_>, note: u8) {
        self.apply(py, Event::NoteOff { note: SoundingNote(note) });
    }

    fn breath(&self, py: Python<'_>, breath: f32) {
        self.apply(py, Event::Breath(breath));
    }

    fn bend(&self, py: Python<'_>, cents: f32) {
        self.apply(py, Event::Bend { cents });
    }

    fn slap(&self, py: Python<'_>, strength: f32) {
        self.apply(py, Event::TongueSlap { strength });
    }

    /// Opens one hole, by its place from the reed; `None` goes back to the fingering.
    fn hole(&self, py: Python<'_>, hole: u8, opening: Option<f32>) {
        self.apply(py, Event::Hole { hole, opening });
    }

    fn panic(&self, py: Python<'_>) {
        self.apply(py, Event::Panic);
    }

    /// Silence, as before the first note.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| self.lock().reset());
    }

    /// The next samples, in a new array.
    fn render<'py>(&self, py: Python<'py>, samples: usize) -> PyResult<Bound<'py, PyArray1<f32>>> {
        // Two hours at the highest rate would not fit into memory either.
        const MOST: u64 = 1 << 32;
        if samples as u64 > MOST {
            return Err(wrong(format_args!(
                "at most {MOST} samples at once, got {samples}; render in parts"
            )));
        }
        let out = py.detach(|| {
            let mut out = memory(samples, true)?;
            self.play(&mut out)?;
            Ok::<_, PyErr>(out)
        })?;
        Ok(PyArray1::from_vec(py, out))
    }

    /// The next samples, into an array that is there.
    fn render_into(&self, py: Python<'_>, mut out: PyReadwriteArray1<'_, f32>) -> PyResult<()> {
        let out = out
            .as_slice_mut()
            .map_err(|_| wrong("the array must be contiguous; take numpy.empty(n, numpy.float32)"))?;
        py.detach(|| self.play(out))
    }

    #[getter]
    fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    #[getter]
    fn is_silent(&self, py: Python<'_>) -> bool {
        py.detach(|| self.lock().is_silent())
    }
}
