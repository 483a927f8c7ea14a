//! The bore in the frequency domain, what each note needs to sound, and what a hand feels of it.

use crate::instrument::{Instrument, OpenHoles};
use crate::mistakes::{signals, watched, wrong};
use chalumeau::cli::offline;
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::haptics::{NoteFeel, TorqueLaw, torque_law};
use chalumeau_core::instrument::{Preparation, Wanted};
use chalumeau_core::measure::bifurcation as ramp;
use chalumeau_core::reed::ReedTables;
use chalumeau_core::units::{Air, WrittenNote};
use numpy::{Complex64, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// The range in which the models hold, Hz, as of `chalumeau impedance`.
const FREQUENCIES_HZ: (f64, f64) = (1.0, 20_000.0);

/// Air of a temperature, °C.
pub fn air(temperature_c: f64) -> PyResult<Air> {
    if (10.0..=40.0).contains(&temperature_c) {
        return Ok(Air::at(temperature_c));
    }
    Err(wrong(format_args!("temperature must lie in 10..40 °C, got {temperature_c}")))
}

/// Z/Zc at each frequency. Ctrl-C ends it.
fn at_each(frequencies_hz: &[f64], z: impl Fn(f64) -> Complex64) -> PyResult<Vec<Complex64>> {
    let mut all = Vec::with_capacity(frequencies_hz.len());
    // Some ten milliseconds each.
    for part in frequencies_hz.chunks(256) {
        signals()?;
        all.extend(part.iter().map(|&f_hz| z(f_hz)));
    }
    Ok(all)
}

/// Z/Zc of a fingering at each frequency.
#[pyfunction]
pub fn impedance<'py>(
    py: Python<'py>,
    instrument: &Instrument,
    fingering: OpenHoles,
    frequencies_hz: PyReadonlyArray1<'py, f64>,
    lattice: bool,
    reed_volume: bool,
    temperature_c: f64,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    let open = instrument.open(&fingering)?;
    let air = air(temperature_c)?;
    let (low, high) = FREQUENCIES_HZ;
    let frequencies = frequencies_hz.as_array();
    if let Some(other) = frequencies.iter().find(|f_hz| !(low..=high).contains(*f_hz)) {
        return Err(wrong(format_args!("frequencies must lie in {low}..{high} Hz, got {other}")));
    }
    let file = &instrument.file;
    if lattice && (reed_volume || air != Air::default()) {
        return Err(wrong(
            "the lattice is of air of 25 °C, without the reed's volume; leave reed_volume and temperature out, or take model=\"tmm\"",
        ));
    }
    let frequencies: Vec<f64> = frequencies.to_vec();
    let z = py.detach(|| {
        if lattice {
            // As the command: the bore as it was built, at 48 kHz.
            let wanted = Wanted::new(file.clone(), 48_000.0);
            let model = watched(|stop| {
                Preparation::new(&wanted, None).as_built(&mut |_| {
                    if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
            })?;
            let opening: Vec<f64> = open.iter().map(|&open| f64::from(u8::from(open))).collect();
            return at_each(&frequencies, |f_hz| model.coeffs.impedance(f_hz, &opening));
        }
        let matrix = TransferMatrix::new(file, air);
        let volume_m3 = if reed_volume { file.reed_volume_m3 } else { 0.0 };
        at_each(&frequencies, |f_hz| matrix.impedance(f_hz, &open, volume_m3))
    })?;
    Ok(PyArray1::from_vec(py, z))
}

/// The first peaks of |Z|/Zc of a fingering: frequencies, heights, qualities.
#[pyfunction]
pub fn impedance_peaks<'py>(
    py: Python<'py>,
    instrument: &Instrument,
    fingering: OpenHoles,
    count: usize,
    reed_volume: bool,
    temperature_c: f64,
) -> PyResult<Bound<'py, PyDict>> {
    if !(1..=30).contains(&count) {
        return Err(wrong(format_args!("count must lie in 1..30, got {count}")));
    }
    let (open, air, file) = (instrument.open(&fingering)?, air(temperature_c)?, &instrument.file);
    let volume_m3 = if reed_volume { file.reed_volume_m3 } else { 0.0 };
    let peaks = py.detach(|| TransferMatrix::new(file, air).peaks(&open, volume_m3, count));
    let columns = PyDict::new(py);
    columns.set_item("f_hz", PyArray1::from_iter(py, peaks.iter().map(|peak| peak.f_hz)))?;
    columns.set_item("mag_over_zc", PyArray1::from_iter(py, peaks.iter().map(|peak| peak.mag_over_zc)))?;
    columns.set_item("q", PyArray1::from_iter(py, peaks.iter().map(|peak| peak.q)))?;
    Ok(columns)
}

/// The mouth pressures that every note of the chart needs.
#[pyfunction]
pub fn thresholds<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: &Instrument,
) -> PyResult<Bound<'py, PyDict>> {
    let file = &instrument.file;
    let (bore, reed) = py.detach(|| offline::bore_and_reed(&pairs, file)).map_err(wrong)?;
    let notes: Vec<_> = py.detach(|| {
        let each = 0..bore.written().len();
        each.map(|note| signals().map(|()| bore.note(note, &reed))).collect::<PyResult<_>>()
    })?;
    let column = |of: fn(&chalumeau_core::haptics::NoteRequirement) -> f64| {
        PyArray1::from_iter(py, notes.iter().map(move |note| note.as_ref().map_or(f64::NAN, of)))
    };
    let columns = PyDict::new(py);
    columns.set_item(
        "written_midi",
        PyArray1::from_iter(py, bore.written().map(|written| i64::from(written.0))),
    )?;
    columns.set_item("gamma_on", column(|note| note.gamma_on))?;
    columns.set_item("gamma_sounding", column(|note| note.gamma_sounding))?;
    columns.set_item("gamma_own", column(|note| note.gamma_own.unwrap_or(f64::NAN)))?;
    columns.set_item("gamma_beat", column(|note| note.gamma_beat))?;
    columns.set_item("gamma_off", column(|note| note.gamma_off))?;
    columns.set_item("p_req_pa", column(|note| note.p_req_pa))?;
    columns.set_item("sounding_hz", column(|note| note.sounding_hz))?;
    columns.set_item("p_closing_pa", reed.closing_pa())?;
    Ok(columns)
}

/// A note whose breath slowly rises to `to` and falls again.
#[pyfunction]
pub fn bifurcation<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: &Instrument,
    written: u8,
    to: f64,
    seconds: f64,
) -> PyResult<Bound<'py, PyDict>> {
    for (name, value, (low, high)) in [("to", to, (0.2, 3.0)), ("seconds", seconds, (0.5, 600.0))] {
        if !(low..=high).contains(&value) {
            return Err(wrong(format_args!("{name} must lie in {low}..{high}, got {value}")));
        }
    }
    instrument.fingering(written)?;
    let file = instrument.file.clone();
    let sounding = WrittenNote(written).sounding(file.transposition).ok_or_else(|| {
        wrong(format_args!("written {} sounds outside MIDI's 0..127", WrittenNote(written)))
    })?;
    let found = py.detach(|| {
        let job = watched(|stop| offline::blown(&pairs, file, WrittenNote(written), to, Some(stop)))?;
        // The ramp tells of its progress and cannot be asked to stop, so Ctrl-C unwinds it; it owns all that it changes.
        let each = |_| signals().unwrap_or_else(|error| resume_unwind(Box::new(error)));
        let play = || ramp::measure(&job.model, &job.settings, sounding, to as f32, seconds, job.rate, each);
        catch_unwind(AssertUnwindSafe(play)).map_err(|thrown| match thrown.downcast::<PyErr>() {
            Ok(error) => *error,
            Err(other) => resume_unwind(other),
        })
    })?;
    let all = || found.up.iter().chain(&found.down);
    let changes = found.transitions();
    let columns = PyDict::new(py);
    let ways = std::iter::repeat_n(1_i64, found.up.len()).chain(std::iter::repeat_n(-1, found.down.len()));
    columns.set_item("direction", PyArray1::from_iter(py, ways))?;
    columns.set_item("gamma", PyArray1::from_iter(py, all().map(|point| point.gamma)))?;
    columns.set_item("rms", PyArray1::from_iter(py, all().map(|point| point.rms)))?;
    columns.set_item("shut", PyArray1::from_iter(py, all().map(|point| point.shut)))?;
    columns.set_item("own", PyArray1::from_iter(py, all().map(|point| point.own)))?;
    columns.set_item("begins", changes.begins)?;
    columns.set_item("shuts", changes.shuts)?;
    columns.set_item("chokes", changes.chokes)?;
    columns.set_item("returns", changes.returns)?;
    columns.set_item("opens", changes.opens)?;
    columns.set_item("ends", changes.ends)?;
    Ok(columns)
}

/// The feel of one written note.
fn feel_of(
    py: Python<'_>,
    pairs: &offline::Pairs,
    instrument: &Instrument,
    written: u8,
) -> PyResult<NoteFeel> {
    instrument.fingering(written)?;
    let table = py.detach(|| offline::feel(pairs, instrument.file.clone())).map_err(wrong)?;
    let note = table.notes().iter().find(|note| note.written == WrittenNote(written));
    note.copied().ok_or_else(|| wrong(format_args!("written {} has no feel", WrittenNote(written))))
}

/// What a knob is sent for a note, and the note's places on it.
#[pyfunction]
pub fn feel<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: &Instrument,
    written: u8,
) -> PyResult<Bound<'py, PyDict>> {
    let found = feel_of(py, &pairs, instrument, written)?;
    let NoteFeel { feel, landmarks, .. } = found;
    let dict = PyDict::new(py);
    let law = match feel.law {
        TorqueLaw::Free => "free",
        TorqueLaw::Flow => "flow",
        TorqueLaw::Pressure => "pressure",
    };
    dict.set_item("law", law)?;
    dict.set_item("morph_ms", feel.morph_ms)?;
    for (name, value) in [
        ("h", feel.h),
        ("k", feel.k),
        ("scale_mnm", feel.scale_mnm),
        ("stretch", feel.stretch),
        ("offset_deg", feel.offset_deg),
        ("wall_deg", feel.wall_deg),
        ("wall_mnm_per_deg", feel.wall_mnm_per_deg),
        ("slap_mnm_per_deg", feel.slap_mnm_per_deg),
        ("damping_mnms", feel.damping_mnms),
        ("friction_mnm", f32::from(feel.friction) / 10.0),
        ("detent_mnm", f32::from(feel.detent) / 10.0),
    ] {
        dict.set_item(name, value)?;
    }
    dict.set_item("most_mnm", found.most_mnm())?;
    dict.set_item("a_on_deg", landmarks.a_on_deg)?;
    dict.set_item("a_beat_deg", landmarks.a_beat_deg)?;
    dict.set_item("a_close_deg", landmarks.a_close_deg)?;
    dict.set_item("a_off_deg", landmarks.a_off_deg)?;
    Ok(dict)
}

/// The torque of a note at rest at each angle, mNm, positive against the breath.
#[pyfunction]
pub fn torque<'py>(
    py: Python<'py>,
    pairs: Vec<(String, String)>,
    instrument: &Instrument,
    written: u8,
    angles_deg: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let note = feel_of(py, &pairs, instrument, written)?;
    let tables = ReedTables::reference();
    let mut torques = angles_deg.as_array().to_vec();
    py.detach(|| {
        let angles = torques.iter_mut().filter(|angle| !angle.is_nan());
        angles.for_each(|angle| *angle = torque_law::torque_mnm(&note.feel, tables, *angle));
    });
    Ok(PyArray1::from_vec(py, torques))
}
