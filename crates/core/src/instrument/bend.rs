//! Pitch bends: the lip bends a note a little; beyond that the whole instrument becomes smaller or larger.
//!
//! The lip is the tuning delay behind the mouthpiece. It moves a note by up to [`LIP_CENTS`], less where the bore cannot
//! be made short enough. The rest of a bend scales the whole instrument: one that is `s` times as small, with its reed and
//! the player's habits, is by similarity the same instrument with its clock running `s` times as fast. So the clock runs
//! faster, and no bend can lose the register. A knee joins the two: both shares change smoothly with their sum.
//!
//! Similarity leaves out two things. A bore that is really smaller has relatively larger wall losses. And its level at the
//! same distance would be `1/s`; here the level stays, as if one listened from `s` times as near, so that a bend changes
//! the pitch alone. Times of the player (tongue, fingers, breath) stay in seconds. A faster clock costs `s` times the
//! instrument's processor time.

use crate::instrument::model::Model;
use crate::instrument::settings::BreathResponse;
use crate::maths;

/// Farthest that the lip bends a note, either way, cents. Players go further down than up; this is what the delay can do
/// in every register while the same mode speaks.
pub const LIP_CENTS: f64 = 40.0;
/// Half the width of the knee over the lip's limit.
const KNEE: f64 = 0.25;
/// Largest offset from the fingering's note, cents: two octaves.
pub const MOST_CENTS: f64 = 2_400.0;
/// Share of the delay's room that the lip may use; the tempered trims need the rest between their nodes.
const ROOM_SHARE: f64 = 0.9;

/// A bend, divided between lip and bore.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BendSplit {
    /// Share of the lip (the tuning delay), cents.
    pub lip_cents: f64,
    /// Share of the bore's size (the speed of the clock), cents.
    pub bore_cents: f64,
}

impl BendSplit {
    /// Divides `offset_cents`, clamped to +-[`MOST_CENTS`], for a lip that reaches `limit_cents`. Real-time safe.
    pub fn new(offset_cents: f64, limit_cents: f64) -> Self {
        let offset = offset_cents.clamp(-MOST_CENTS, MOST_CENTS);
        let (from, width) = ((1.0 - KNEE) * limit_cents, 2.0 * KNEE * limit_cents);
        let over = offset.abs() - from;
        let bore = if over <= 0.0 {
            0.0
        } else if over < width {
            over * over / (2.0 * width)
        } else {
            over - width / 2.0
        };
        let bore_cents = bore.copysign(offset);
        Self { lip_cents: offset - bore_cents, bore_cents }
    }
}

/// How far the lip may bend a fingering's note towards `offset_cents` (up if positive, else down), cents, 0 or more, beside the
/// trims of this response to breath. Real-time safe.
pub fn lip_limit_cents(model: &Model, fingering: usize, offset_cents: f64, response: BreathResponse) -> f64 {
    let Some(note) = model.tuning.notes.get(fingering) else { return 0.0 };
    let (shortest, longest) = model.coeffs.tuning_range();
    let follows: &[f64] = match response {
        BreathResponse::Physical => &note.tempered,
        BreathResponse::Played => &note.played.rows,
    };
    let trims = follows.iter().copied().chain([note.natural]);
    let room = if offset_cents > 0.0 {
        trims.fold(f64::INFINITY, f64::min) - shortest
    } else {
        longest - trims.fold(f64::NEG_INFINITY, f64::max)
    };
    let needed = note.sensitivity * model.rows_for_cents(fingering, LIP_CENTS.copysign(offset_cents)).abs();
    LIP_CENTS * (ROOM_SHARE * room / needed).clamp(0.0, 1.0)
}

/// Speed of the clock for the bore's share of a bend, cents; 1 is the model's rate. Real-time safe.
pub fn speed(bore_cents: f64) -> f64 {
    maths::exp2(bore_cents / 1_200.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_have_no_kink() {
        for limit in [0.0, 10.0, LIP_CENTS] {
            let at = |tenth: i32| BendSplit::new(f64::from(tenth) / 10.0, limit);
            let (mut steepest, mut kink) = (0.0_f64, 0.0_f64);
            for tenth in -5_000..5_000 {
                let (before, split, after) = (at(tenth - 1), at(tenth), at(tenth + 1));
                assert!((split.lip_cents + split.bore_cents - f64::from(tenth) / 10.0).abs() < 1e-9);
                assert!(split.lip_cents.abs() <= limit + 1e-9);
                assert_eq!(split.lip_cents, -at(-tenth).lip_cents);
                steepest = steepest.max((after.bore_cents - split.bore_cents).abs());
                kink = kink.max((after.bore_cents - 2.0 * split.bore_cents + before.bore_cents).abs());
            }
            assert!(steepest <= 0.1 + 1e-9);
            // A slope of one over the knee's width.
            let smooth = if limit > 0.0 { 0.01 / (2.0 * KNEE * limit) } else { 0.1 };
            assert!(kink <= smooth + 1e-9, "limit {limit}: {kink}");
        }
    }

    #[test]
    fn small_offsets_are_the_lips_alone_and_no_offset_is_none() {
        assert_eq!(BendSplit::new(25.0, LIP_CENTS), BendSplit { lip_cents: 25.0, bore_cents: 0.0 });
        assert_eq!(BendSplit::new(0.0, 0.0), BendSplit::default());
        assert_eq!(BendSplit::new(f64::INFINITY, LIP_CENTS).bore_cents, MOST_CENTS - LIP_CENTS);
    }

    #[test]
    fn lip_reaches_its_limit_where_the_bore_allows_it() {
        let model = Model::built_in(48_000.0).unwrap();
        for response in [BreathResponse::Physical, BreathResponse::Played] {
            let limits = |side: f64| -> Vec<f64> {
                (0..model.notes_hz.len()).map(|note| lip_limit_cents(&model, note, side, response)).collect()
            };
            let (up, down) = (limits(1.0), limits(-1.0));
            println!("{response:?}: up {up:.0?}\ndown {down:.0?}");
            assert!(up.iter().chain(&down).all(|limit| (8.0..=LIP_CENTS).contains(limit)));
            for (note, limit) in up.into_iter().enumerate() {
                let trim = model.tuning.notes[note];
                let rows = trim.natural + trim.sensitivity * model.rows_for_cents(note, limit);
                assert!(rows > model.coeffs.tuning_range().0, "note {note}");
            }
        }
    }
}
