//! What another reed, or another lip, does to a note that was learnt with the reference: the player adapts the breath to it, and the pitch.
//!
//! **Breath.** The note begins where the reed's conductance equals what the bore takes, and that follows from the onset that was found by playing
//! with the reference. What this leaves out: that the other reed also moves the frequency a little.
//!
//! **Pitch.** The reed takes a susceptance from the bore. By as much as this reed takes more than the reference, over the slope of the
//! whole susceptance, its note is lower. Softly this is all. Loudly, two things are added. A reed that is shut does not lag, so the damping
//! counts less ([`ReedAtNote::lag_of`]). And what moves the pitch of the reference while it becomes louder, upper partials on modes that are
//! not harmonic and jets in the holes, comes sooner with a reed that closes at a higher pressure or lets more air through, by the share
//! [`SOONER`]. What is left, over all notes of the bundled instruments and 24 reeds, is in `docs/tone.md`.

use super::dynamics::MEZZO_FORTE;
use super::posture::CENTS_PER_SHARE;
use super::reed_at_note::ReedAtNote;
use crate::instrument::played_note::PlayedNote;
use crate::maths;

/// Dynamics at which the pitch is worked out, from the softest to the loudest; straight lines between.
const DYNAMICS: [f64; 4] = [0.0, 0.4, 0.7, 1.0];
/// How much sooner the pitch of a loud note moves, over the logarithm of closing pressure times flow strength: in nepers of level. Measured, by least
/// squares over all notes of the B flat clarinet, with 24 reeds, it is 0.45..0.65 for the closing pressure and 0.4..0.6 for the flow strength.
const SOONER: f64 = 0.5;
/// The player corrects no more than this, cents: what the law was measured up to. A reed of the notebook can be so soft that its notes are no longer the bore's.
const MOST_CENTS: f64 = 100.0;
/// A reed that lets hardly any air through counts as one with this share of the reference's flow.
const LEAST_FLOW: f64 = 0.01;
/// A millionth of a cent: fewer digits than differ between one system's logarithm and another's.
const PER_CENT: f64 = 1e6;
/// Half the distance of dynamics over which the pitch of the reference moves.
const NEAR: f64 = 0.05;

/// A reed at a note, as a function of the dynamic.
pub type AtDynamic<'a> = &'a dyn Fn(f64) -> ReedAtNote;

/// What this reed changes of a note.
#[derive(Clone, Copy, Debug, Default)]
pub struct OtherReed {
    /// Added to the mouth over closing pressure, at dynamics 0 and 1.
    gammas: [f64; 2],
    /// How much lower the note is at [`DYNAMICS`], cents.
    flat_cents: [f64; DYNAMICS.len()],
}

/// The note that was learnt.
#[derive(Clone, Copy, Debug)]
pub struct Learnt<'a> {
    /// What it asks of the player.
    pub note: &'a PlayedNote,
    /// How fast the susceptance of the bore rises at its frequency, over the logarithm of the frequency.
    pub bore_slope: f64,
    /// Rows of the trims for one cent up.
    pub rows_per_cent: f64,
    /// Level of dynamic 1 over that of dynamic 0, nepers.
    pub range: f64,
}

impl OtherReed {
    /// The reed `own` where the note was learnt with `reference`. Closing pressures are over the reference's: `closing` of the reed before the lip shapes it.
    /// Real-time safe.
    pub fn new(own: AtDynamic<'_>, reference: AtDynamic<'_>, closing: f64, learnt: &Learnt<'_>) -> Self {
        let note = learnt.note;
        let reeds = DYNAMICS.map(|dynamic| (own(dynamic), reference(dynamic)));
        let [softest, .., loudest] = &reeds;
        let gammas = [softest, loudest].map(|(own, reference)| own.shift_from(reference, note.onset));
        let shifted = Self { gammas, ..Self::default() };
        let slope = |reed: ReedAtNote, gamma: f64| 0.5 * reed.susceptance_slope(gamma);
        let gamma = note.gamma(MEZZO_FORTE);
        let slope = learnt.bore_slope
            + slope(own(MEZZO_FORTE), gamma + shifted.gamma(MEZZO_FORTE))
            + slope(reference(MEZZO_FORTE), gamma);
        let flat_cents = std::array::from_fn(|at| {
            let (dynamic, (own, reference)) = (DYNAMICS[at], reeds[at]);
            let (gamma, amplitude) = (note.gamma(dynamic), note.amplitude(dynamic));
            let own_gamma = gamma + shifted.gamma(dynamic);
            let as_damped = ReedAtNote { damping: reference.damping, ..own };
            let taken = own.swept_susceptance() - reference.swept_susceptance()
                + as_damped.flow_susceptance(own_gamma)
                - reference.flow_susceptance(gamma)
                + as_damped.lag_of(&own, own_gamma, amplitude);
            let (softer, louder) = ((dynamic - NEAR).max(0.0), (dynamic + NEAR).min(1.0));
            let per_neper = (note.rows(louder) - note.rows(softer))
                / ((louder - softer) * learnt.range * learnt.rows_per_cent);
            let sooner = SOONER * maths::ln((closing * own.zeta / reference.zeta).max(LEAST_FLOW));
            let flat = CENTS_PER_SHARE * taken / slope + sooner * per_neper;
            (PER_CENT * flat.clamp(-MOST_CENTS, MOST_CENTS)).round() / PER_CENT
        });
        Self { flat_cents, ..shifted }
    }

    /// What it adds to the mouth over closing pressure at a dynamic. Real-time safe.
    pub fn gamma(&self, dynamic: f64) -> f64 {
        let [soft, loud] = self.gammas;
        soft + (loud - soft) * dynamic
    }

    /// How much lower the note is at a dynamic, 0..=1, cents. Real-time safe.
    pub fn flat_cents(&self, dynamic: f64) -> f64 {
        let right = DYNAMICS[1..DYNAMICS.len() - 1].partition_point(|&known| known < dynamic) + 1;
        let way = (dynamic - DYNAMICS[right - 1]) / (DYNAMICS[right] - DYNAMICS[right - 1]);
        self.flat_cents[right - 1] + way * (self.flat_cents[right] - self.flat_cents[right - 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: ReedAtNote = ReedAtNote { zeta: 0.3, lay: 0.4, ratio: 0.2, damping: 0.8, swept: 0.03 };

    /// A throat note's: its trims move by 8 rows from soft to loud.
    fn changed(own: ReedAtNote, closing: f64) -> OtherReed {
        let note =
            PlayedNote { rows: [0.0, -1.0, -2.0, -3.5, -5.0, -6.0, -7.0, -8.0], ..PlayedNote::default() };
        let learnt = Learnt { note: &note, bore_slope: 2.0, rows_per_cent: -0.1, range: 3.0 };
        OtherReed::new(&|_| own, &|_| REFERENCE, closing, &learnt)
    }

    #[test]
    fn the_reference_changes_nothing() {
        let same = changed(REFERENCE, 1.0);
        assert!([0.0, 0.3, 1.0].iter().all(|&dynamic| same.flat_cents(dynamic).abs() < 1e-3));
        assert!(same.gamma(0.5).abs() < 2e-6);
    }

    #[test]
    fn soft_reeds_more_flow_and_more_damping_are_flat_and_the_damping_less_so_when_loud() {
        let soft = changed(ReedAtNote { swept: 0.04, ..REFERENCE }, 1.0);
        // The displaced air alone: its share of the slope, which is the bore's for nearly all.
        let wanted = CENTS_PER_SHARE * 0.01 / (1.0 - 0.04) / 2.0;
        assert!((soft.flat_cents(0.0) / wanted - 1.0).abs() < 0.1, "{} {wanted}", soft.flat_cents(0.0));
        assert!(changed(ReedAtNote { zeta: 0.4, ..REFERENCE }, 1.0).flat_cents(0.0) > 1.0);
        let damped = changed(ReedAtNote { damping: 1.2, ..REFERENCE }, 1.0);
        assert!(damped.flat_cents(0.0) > 1.0 && damped.flat_cents(1.0) < 0.8 * damped.flat_cents(0.0));
    }

    #[test]
    fn a_higher_closing_pressure_takes_the_pitch_where_the_reference_goes_when_it_is_louder() {
        let closing = changed(REFERENCE, 1.44);
        let later = SOONER * 1.44_f64.ln() * 80.0 / 3.0;
        assert!((closing.flat_cents(0.7) / later - 1.0).abs() < 0.3, "{} {later}", closing.flat_cents(0.7));
    }

    #[test]
    fn a_reed_without_flow_has_a_pitch() {
        for own in [ReedAtNote { zeta: 0.0, ..REFERENCE }, ReedAtNote { swept: 3.0, lay: 1e-9, ..REFERENCE }]
        {
            let other = changed(own, 1e-3);
            for dynamic in [0.0, 0.2, 0.5, 0.9, 1.0] {
                assert!(other.flat_cents(dynamic).abs() <= MOST_CENTS && other.gamma(dynamic).is_finite());
            }
        }
    }
}
