//! Scales a bore so that the tuning delay can do the rest.
//!
//! One factor multiplies all lengths, as a maker would build the instrument for another pitch: without losses every
//! resonance moves by the same interval. Theory gives a first factor, so that hardly any instrument has to be fitted twice;
//! the played notes give a second one where it is needed. Factors above 1 make the bore longer and the pitch lower.

use std::ops::ControlFlow;

use crate::analysis::upper_median;
use crate::bore::instrument_file::{Fingering, InstrumentFile};
use crate::bore::transfer_matrix::TransferMatrix;
use crate::instrument::concert_pitch::A4_HZ;
use crate::instrument::model::Model;
use crate::maths;
use crate::parallel;
use crate::units::{Air, cents};

/// Error of the theory (a reed without inertia or damping), cents: notes of the built-in clarinet play 20 to 70 cents
/// below it. Smaller offsets are corrected only after the notes have been heard.
const THEORY_CENTS: f64 = 50.0;
/// An instrument further off than this, cents, is not out of tune but has the wrong note names; it is left as it is. A note
/// that is further than this from the median of all has the wrong name, and does not count.
const MOST_CENTS: f64 = 300.0;
/// Room that the delay keeps on both sides, cents, for changes of breath and temperature.
const ROOM_CENTS: f64 = 10.0;

fn factor(down_cents: f64) -> f64 {
    maths::exp2(down_cents / 1_200.0)
}

/// Leaves out the notes with wrong names, by their offsets in cents; the others keep their order.
fn leave_out_wrong_names<T>(notes: &mut Vec<T>, off: impl Fn(&T) -> f64) {
    if let Some(median) = upper_median(notes.iter().map(&off)) {
        notes.retain(|note| (off(note) - median).abs() <= MOST_CENTS);
    }
}

/// Factor for a pitch of A4, Hz; also corrects an instrument whose notes lie elsewhere than its chart says.
pub fn by_theory(file: &InstrumentFile, air: &Air, a4_hz: f64) -> f64 {
    let model = TransferMatrix::new(file, *air);
    let low: Vec<&Fingering> = file.fingerings.iter().filter(|fingering| fingering.mode <= 2).collect();
    let off_cents = |at: usize| {
        let wanted = low[at].written.sounding(file.transposition)?.frequency_hz(A4_HZ);
        let (hz, _) = model.playing_frequency(&low[at].open, file.reed_volume_m3, wanted)?;
        Some(cents(hz, wanted))
    };
    let heard = parallel::each(low.len(), off_cents, &mut |_| ControlFlow::Continue(()));
    let mut offsets: Vec<f64> = heard.into_iter().flatten().flatten().collect();
    leave_out_wrong_names(&mut offsets, |&off| off);
    let mean = offsets.iter().sum::<f64>() / offsets.len().max(1) as f64;
    let sharp = if (THEORY_CENTS..MOST_CENTS).contains(&mean.abs()) { mean } else { 0.0 };
    A4_HZ / a4_hz * factor(sharp)
}

/// Factor for notes that lie `offsets` cents above their pitch without a trim (`None`: not heard); `None` if the delay
/// can correct all of them.
pub fn by_playing(model: &Model, offsets: &[Option<f64>]) -> Option<f64> {
    let (low_rows, high_rows) = model.coeffs.tuning_range();
    // For each note the least and the most that scaling may move it, cents up, so that its delay can do the rest; and the
    // offset that needs no delay.
    let mut heard: Vec<(usize, f64)> =
        offsets.iter().enumerate().filter_map(|(note, off)| Some((note, (*off)?))).collect();
    leave_out_wrong_names(&mut heard, |&(_, off)| off);
    let bounds: Vec<(f64, f64, f64)> = heard
        .into_iter()
        .map(|(note, off)| {
            let up = low_rows / model.rows_for_cents(note, 1.0);
            let down = high_rows / model.rows_for_cents(note, -1.0);
            (-off - up, -off + down, -off)
        })
        .collect();
    let least = bounds.iter().map(|bound| bound.0).fold(f64::NEG_INFINITY, f64::max);
    let most = bounds.iter().map(|bound| bound.1).fold(f64::INFINITY, f64::min);
    if bounds.is_empty() || (least <= 0.0 && most >= 0.0) {
        return None;
    }
    let mean = bounds.iter().map(|bound| bound.2).sum::<f64>() / bounds.len() as f64;
    let (least, most) = (least + ROOM_CENTS, most - ROOM_CENTS);
    // Where no scale serves all notes, the lowest and the highest offset stay out of tune by the same amount.
    let up = if least <= most { mean.clamp(least, most) } else { 0.5 * (least + most) };
    (up.abs() < MOST_CENTS).then(|| factor(-up))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::WrittenNote;

    #[test]
    fn one_wrong_note_name_scales_nothing() {
        let good = InstrumentFile::built_in();
        let factor = |file: &InstrumentFile| by_theory(file, &Air::default(), A4_HZ);
        assert_eq!(factor(&good), 1.0);
        let mut wrong = good.clone();
        // The lowest note is called two octaves lower: 60 cents in the mean of all.
        wrong.fingerings[0].written = WrittenNote(28);
        assert_eq!(factor(&wrong), 1.0);
        // The others are still corrected together, and as if it were not there.
        let without = InstrumentFile { fingerings: good.fingerings[1..].to_vec(), ..good.clone() };
        assert_eq!(factor(&wrong.scaled(1.05)), factor(&without.scaled(1.05)));
        assert!((factor(&wrong.scaled(1.05)) - 1.0 / 1.05).abs() < 0.01);
    }

    #[test]
    fn one_wrong_note_name_is_not_played_into_tune() {
        let model = Model::built_in(48_000.0).unwrap();
        let mut offsets = vec![Some(5.0); model.notes_hz.len()];
        assert_eq!(by_playing(&model, &offsets), None);
        offsets[3] = Some(-400.0);
        assert_eq!(by_playing(&model, &offsets), None);
        offsets.fill(Some(150.0));
        let all = by_playing(&model, &offsets);
        assert!(all.is_some());
        offsets[3] = Some(-400.0);
        assert_eq!(by_playing(&model, &offsets), all);
    }
}
