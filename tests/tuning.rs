//! How well in tune the radiated sound is, and how soon it speaks. Figures are printed (`--nocapture`) to be quoted.

#[path = "support/parallel.rs"]
mod parallel;

use std::sync::Arc;

use chalumeau::analysis::onset;
use chalumeau::analysis::pitch;
use chalumeau::analysis::to_f64;
use chalumeau::event::Event;
use chalumeau::instrument::Clarinet;
use chalumeau::instrument::Model;
use chalumeau::instrument::Settings;
use chalumeau::instrument::held::HeldNote;
use chalumeau::instrument::held::Start;
use chalumeau::instrument::held::TONGUE_HOLD_S;
use chalumeau::instrument::voice::Drive;
use chalumeau::instrument::voice::TICK;
use chalumeau::units::WrittenNote;
use chalumeau::units::cents;
use parallel::each;

fn model(host_rate_hz: f64) -> Arc<Model> {
    Arc::new(Model::built_in(host_rate_hz).unwrap())
}

fn fingering(model: &Model, written: u8) -> usize {
    model.file.fingerings.iter().position(|fingering| fingering.written == WrittenNote(written)).unwrap()
}

/// A note as a host plays it: settings, breath, key.
struct Keyed {
    written: u8,
    gamma: f32,
    settings: Settings,
}

impl Keyed {
    fn new(written: u8, gamma: f32) -> Self {
        Self { written, gamma, settings: Settings { noise: 0.0, ..Settings::default() } }
    }

    fn start(&self, model: &Arc<Model>, host_rate_hz: f64) -> Clarinet {
        let mut clarinet = Clarinet::new(model.clone(), host_rate_hz);
        clarinet.set_settings(&self.settings);
        clarinet.apply(Event::Breath(self.gamma * 6.0 / self.settings.breath_full_kpa));
        let note = WrittenNote(self.written).sounding(model.file.transposition).unwrap();
        clarinet.apply(Event::NoteOn { note, velocity: 0.7 });
        clarinet
    }

    /// Cents above equal temperament at A4 = 440 Hz of the steady radiated sound; NaN for none.
    fn cents(&self, model: &Arc<Model>, host_rate_hz: f64) -> f64 {
        let mut clarinet = self.start(model, host_rate_hz);
        let mut sound = vec![0.0; (1.1 * host_rate_hz) as usize];
        clarinet.render(&mut sound);
        let steady = to_f64(&sound[(0.7 * host_rate_hz) as usize..]);
        let wanted_hz = model.notes_hz[fingering(model, self.written)];
        pitch::fundamental_hz(&steady, host_rate_hz).map_or(f64::NAN, |hz| cents(hz, wanted_hz))
    }
}

/// Largest and mean magnitude; a NaN makes both NaN.
fn spread(off: &[f64]) -> (f64, f64) {
    let max = off.iter().fold(0.0, |max: f64, off| if off.abs() <= max { max } else { off.abs() });
    (max, off.iter().map(|off| off.abs()).sum::<f64>() / off.len() as f64)
}

#[test]
fn radiated_notes_are_in_tune_at_every_host_rate() {
    for rate_hz in [44_100.0, 48_000.0, 88_200.0, 96_000.0, 192_000.0] {
        let model = model(rate_hz);
        let notes: Vec<u8> = (52..=91).collect();
        let off = each(&notes, |&written| Keyed::new(written, 0.5).cents(&model, rate_hz));
        let (low, high) = off.split_at(84 - 52 + 1);
        let ((max, mean), (max_high, mean_high)) = (spread(low), spread(high));
        println!(
            "{rate_hz} Hz: E3..C6 max {max:.3} mean {mean:.3} cents; C#6..G6 max {max_high:.3} mean {mean_high:.3}"
        );
        assert!(max <= 2.0, "{rate_hz} Hz: {low:?}");
        assert!(max_high <= 5.0, "{rate_hz} Hz: {high:?}");
    }
}

/// Mouthpiece pressure of a held note, sample by sample.
fn mouthpiece(model: &Model, note: &HeldNote, seconds: f64) -> Vec<f64> {
    let mut voice = note.voice::<f32>(model);
    voice.set_probing(true);
    let (rate, reed) = (model.coeffs.rate_hz, note.reed(model));
    let mut pressure = Vec::new();
    for tick in 0..(seconds * rate / TICK as f64) as usize {
        let (p_mouth, tongue) = note.breath((tick + 1) as f64 * TICK as f64 / rate);
        voice.tick(&Drive { p_mouth, tongue, noise: 0.0, reed });
        pressure.extend(voice.probes().unwrap().iter().map(|probe| probe.p_mouthpiece_pa));
    }
    pressure
}

#[test]
fn tongued_notes_speak_at_once() {
    let model = model(48_000.0);
    let rate = model.coeffs.rate_hz;
    let notes: Vec<u8> = (52..=84).collect();
    let t90_ms = each(&notes, |&written| {
        let note =
            HeldNote { start: Start::Tongued(2.0), ..HeldNote::new(&model, fingering(&model, written), 0.5) };
        1e3 * onset::t90_s(&mouthpiece(&model, &note, 1.0), rate, TONGUE_HOLD_S).unwrap()
    });
    // From the key: what the tongue's hold and the breath's rise add.
    let key_ms = each(&notes, |&written| {
        let mut clarinet = Keyed::new(written, 0.5).start(&model, 48_000.0);
        let mut pressure = Vec::new();
        clarinet.render_probed(&mut vec![0.0; 48_000], &mut |probe| pressure.push(probe.p_mouthpiece_pa));
        1e3 * onset::t90_s(&pressure, rate, 0.0).unwrap()
    });
    for ((written, t90), key) in notes.iter().zip(&t90_ms).zip(&key_ms) {
        println!("written {written}: t90 {t90:.1} ms from the tongue, {key:.1} ms from the key");
    }
    let at = |written: u8| t90_ms[usize::from(written - 52)];
    assert!(at(60) <= 45.0, "C4 {}", at(60));
    assert!(at(52) <= 60.0, "E3 {}", at(52));
}
