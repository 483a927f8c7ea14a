//! What settings, fingering and bend amount to: reed, delay and clock of the note, and how fast they are reached.

use super::breath::{BREATH_END_S, BREATH_FOLLOW_S, BREATH_RISE_S};
use super::dynamics::{AtPlace, LipShape, MEZZO_FORTE, PlacedRule};
use super::ear;
use super::level_keeper::KeeperLags;
use super::life::LifeLags;
use super::lip_glide::NoteLip;
use super::other_reed::{Learnt, OtherReed};
use super::reed_at_note::ReedAtNote;
use super::response::LIP_S;
use super::step_towards;
use super::technique::subtone::{at_place, covered};
use super::voicing;
use crate::instrument::bend::{self, BendSplit};
use crate::instrument::lip::{embouchure, held};
use crate::instrument::model::Model;
use crate::instrument::played_note::PlayedNote;
use crate::instrument::settings::{BreathResponse, Settings, Tuning};
use crate::maths;
use crate::reed::physical::ZETA_REFERENCE;
use crate::reed::{MovingReed, ReedCoeffs, ReedLaw};
use crate::units::{Air, cents};

/// Each of two time constants with which the lip goes to the closing pressure that a note has between the softest and the loudest dynamic, s:
/// a quicker lip clicks. Measured at 8, 10, 12 and 17 ms: nine tenths of the clicks of all slurs are below 3.5, 3.1, 2.7 and 2.5 dB.
const SHAPE_S: f64 = 0.012;
/// Cents of a small rise of the frequency, as a share of it.
pub const CENTS_PER_SHARE: f64 = 1_200.0 / std::f64::consts::LN_2;
/// Most that the resonance moves for a cent, as a share of itself: hardly more than on the lowest note of a B flat clarinet, which takes 0.045. A
/// note whose pitch hardly goes with the resonance leaves the lip alone.
const MOST_RESONANCE_PER_CENT: f64 = 0.06;
/// Time constant of the lip from note to note over the time of the fingers.
const LIP_SHARE: f64 = 0.4;

/// Targets of the note in the fingers. The player works them out when a setting, the fingering or the bend changes, not
/// at every tick.
#[derive(Clone, Copy, Debug)]
pub struct Posture {
    /// Closing pressure of the reed over the reference.
    pub closing: f64,
    /// The same before a player's lip shapes the reed: the tongue's force goes with it. A force that followed the lip would move
    /// the shut reed, and the volume that this sweeps is heard.
    pub free_closing: f64,
    /// The reed under the lip.
    pub reed: ReedCoeffs,
    /// Delay on top of the note's trim, rows of round trip.
    pub rows: f64,
    /// Delay for a rise of the pitch by one cent, rows of round trip.
    pub rows_per_cent: f64,
    /// Share of the bend that the clock makes, cents.
    pub bore_cents: f64,
    /// The bend.
    offset_cents: f64,
    /// How much higher the alternate sounds that is fingered, cents.
    alternate_cents: f64,
    fingering: usize,
    response: BreathResponse,
    /// How fast delay, clock and breath follow.
    pub lags: Lags,
    /// The reed as set and fingered, before a player's lip shapes it.
    free: MovingReed,
    /// How much the lip covers the reed, 0..=1.
    subtone: f64,
    /// How far the lip follows the player's rule, 0..=1.
    follows: f64,
    rate_hz: f64,
    /// Place of the note, and what goes with it. A lip whose breath is physical keeps them for one that is played.
    place: f64,
    at: AtPlace,
    /// What a player needs; `None` where the breath is physical.
    played: Option<Played>,
}

/// What the player's rule needs of a note.
#[derive(Clone, Copy, Debug)]
struct Played {
    /// The rule where the lip is, which goes from note to note.
    placed: PlacedRule,
    note: PlayedNote,
    /// How far the resonance of the reed moves for a cent, as a share of itself.
    resonance_per_cent: f64,
    /// What these settings change of it.
    other_reed: OtherReed,
    /// Dynamic of the lip in `Posture::reed`.
    lip: f64,
    /// Trim of the note at that dynamic, rows.
    rows: f64,
    /// The note that the lip in `Posture::reed` is for.
    note_lip: NoteLip,
    /// The last dynamic that was asked for, and what it asks of the breath.
    asked: (f64, PlayedBreath),
}

/// What a dynamic asks of the breath.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlayedBreath {
    /// Mouth over closing pressure that holds the note.
    pub gamma: f64,
    /// Amplitude that the note then has, rms in the mouthpiece over the closing pressure.
    pub amplitude: f64,
}

/// Share of the way to the target that delay, clock and breath cover in one tick, 0..1.
#[derive(Clone, Copy, Debug)]
pub struct Lags {
    /// Delay and clock.
    pub tuning: f64,
    /// Breath that rises behind the tongue.
    pub breath_rise: f64,
    /// Breath that follows a breath source.
    pub breath_follow: f64,
    /// Breath that ends.
    pub breath_end: f64,
    /// The lip.
    pub lip: f64,
    /// The lip from note to note.
    pub fingers: f64,
    /// What the lip does for the place of a note.
    pub shape: f64,
    /// The ear.
    pub ear: f64,
    /// The vocal tract.
    pub tract: f64,
    /// Life.
    pub life: LifeLags,
    /// The ear for level.
    pub level: KeeperLags,
}

impl Lags {
    /// For ticks of `tick_s` seconds.
    pub fn new(settings: &Settings, tick_s: f64, lowest_hz: f64) -> Self {
        let step = |time_s: f64| step_towards(tick_s, time_s);
        Self {
            tuning: step(0.5e-3 * f64::from(settings.legato_ms)),
            breath_rise: step(BREATH_RISE_S),
            breath_follow: step(BREATH_FOLLOW_S),
            breath_end: step(BREATH_END_S),
            lip: step(LIP_S),
            shape: step(SHAPE_S),
            fingers: step(LIP_SHARE * 1e-3 * f64::from(settings.legato_ms)),
            ear: ear::share(tick_s, lowest_hz),
            tract: step(voicing::MOVE_S),
            life: LifeLags::new(tick_s),
            level: KeeperLags::new(tick_s),
        }
    }
}

/// What fingers and lip do.
#[derive(Clone, Copy, Debug)]
pub struct Fingered {
    /// Index of the fingering in the chart.
    pub fingering: usize,
    /// How much higher the alternate sounds that is in place of it, cents; the lip corrects it.
    pub alternate_cents: f64,
    /// The bend that is asked for, cents.
    pub bend_cents: f64,
    /// How much the lip covers the reed, 0..=1.
    pub subtone: f64,
    /// How far the lip follows the player's rule, 0..=1, where the breath is played.
    pub follows: f64,
}

impl Posture {
    /// For what is fingered, with ticks of `tick_s` seconds.
    pub fn new(settings: &Settings, fingered: &Fingered, tick_s: f64, model: &Model) -> Self {
        let Fingered { fingering, alternate_cents, bend_cents, subtone, follows } = *fingered;
        let (note_hz, lowest_hz) = (model.notes_hz[fingering], model.size_hz);
        let held = held(note_hz, lowest_hz, settings.hold());
        let free = MovingReed {
            law: settings.reed_law(),
            zeta: f64::from(settings.zeta),
            lay: f64::from(settings.lay),
            resonance_hz: held.resonance_hz,
            damping: held.damping,
            swept_s: model.swept_s,
        };
        let place = model.place(fingering);
        let subtone = at_place(subtone, place);
        let free = covered(free, subtone);
        let sensitivity = model.tuning.notes.get(fingering).map_or(1.0, |note| note.sensitivity);
        let rows_per_cent = sensitivity * model.rows_for_cents(fingering, 1.0);
        let response = settings.breath_response;
        let placed = model.player.at(place);
        let played = match response {
            BreathResponse::Physical => None,
            BreathResponse::Played => {
                Some(Played::new(settings, &free, subtone, (fingering, placed, rows_per_cent), model))
            }
        };
        // The trims know the reference reed; with another, the player corrects what it takes off.
        let flat_cents = match (settings.tuning, &played) {
            (Tuning::Tempered, Some(played)) => played.other_reed.flat_cents(MEZZO_FORTE),
            _ => 0.0,
        };
        let offset = bend_cents
            + flat_cents
            + cents(f64::from(settings.a4_hz), model.a4_hz)
            + cents(Air::at(f64::from(settings.temperature_c)).c, model.air.c);
        let split = BendSplit::new(offset, bend::lip_limit_cents(model, fingering, offset, response));
        let rate_hz = model.coeffs.rate_hz;
        let mut posture = Self {
            closing: free.law.closing(),
            free_closing: free.law.closing(),
            reed: ReedCoeffs::new(free, rate_hz),
            rows: sensitivity * model.rows_for_cents(fingering, split.lip_cents - alternate_cents),
            rows_per_cent,
            bore_cents: split.bore_cents,
            offset_cents: offset,
            alternate_cents,
            fingering,
            response,
            lags: Lags::new(settings, tick_s, model.size_hz),
            free,
            subtone,
            follows,
            rate_hz,
            place,
            at: placed.at,
            played,
        };
        posture.shape_lip(0.0, posture.note_lip());
        posture
    }

    /// Delay on top of the note's trim, rows of round trip, and the share of the clock, cents, where the player bends the note by so
    /// many cents more.
    pub fn bent(&self, cents: f64, model: &Model) -> (f64, f64) {
        if cents == 0.0 {
            return (self.rows, self.bore_cents);
        }
        let offset = self.offset_cents + cents;
        let split =
            BendSplit::new(offset, bend::lip_limit_cents(model, self.fingering, offset, self.response));
        let rows = self.rows_per_cent / model.rows_for_cents(self.fingering, 1.0)
            * model.rows_for_cents(self.fingering, split.lip_cents - self.alternate_cents);
        (rows, split.bore_cents)
    }

    /// Closing pressure to which the lip goes for this note, over that which it gives now.
    pub fn closing_ahead(&self) -> f64 {
        self.played.as_ref().map_or(1.0, |played| played.placed.closing_ahead(&self.at, played.lip))
    }

    /// Where the lip goes for this note.
    pub fn note_lip(&self) -> NoteLip {
        let resonance_per_cent = self.played.as_ref().map_or(0.0, |played| played.resonance_per_cent);
        let MovingReed { resonance_hz, damping, .. } = self.free;
        NoteLip { resonance_hz, damping, place: self.place, at: self.at, resonance_per_cent }
    }

    /// Gives the reed the lip of a dynamic, 0..=1, on its way to the note; nothing where the breath is physical.
    pub fn shape_lip(&mut self, dynamic: f64, note_lip: NoteLip) {
        let Some(played) = &mut self.played else { return };
        if played.lip == dynamic && played.note_lip == note_lip {
            return;
        }
        (played.lip, played.note_lip) = (dynamic, note_lip);
        let other = &played.other_reed;
        played.rows = played.note.rows(dynamic)
            + self.rows_per_cent * (other.flat_cents(dynamic) - other.flat_cents(MEZZO_FORTE));
        let NoteLip { resonance_hz, damping, at, .. } = note_lip;
        let free = MovingReed { resonance_hz, damping, ..self.free };
        played.placed.at = at;
        let reed = shaped(&free, self.subtone, played.placed.lip(dynamic).of_the_way(self.follows));
        self.closing = reed.law.closing();
        self.reed = ReedCoeffs::new(reed, self.rate_hz);
    }

    /// Moves the lip on towards the loudest, by a share of the way.
    pub fn loosen_lip(&mut self, share: f64) {
        if let Some(Played { lip, note_lip, .. }) = self.played.as_ref().filter(|_| share > 0.0) {
            self.shape_lip(lip + (1.0 - lip) * share, *note_lip);
        }
    }

    /// How the lip shapes the reed at this dynamic, once it has arrived at the note; `None` where the breath is physical.
    pub fn lip(&self) -> Option<LipShape> {
        let Played { mut placed, lip, .. } = self.played?;
        placed.at = self.at;
        Some(placed.lip(lip))
    }

    /// What a dynamic, 0..=1, asks of the breath; nothing where the breath is physical.
    #[inline]
    pub fn played_breath(&mut self, dynamic: f64) -> PlayedBreath {
        let Some(played) = &mut self.played else { return PlayedBreath::default() };
        if played.asked.0 != dynamic {
            let gamma = (played.note.gamma(dynamic) + played.other_reed.gamma(dynamic)).max(0.0);
            played.asked = (dynamic, PlayedBreath { gamma, amplitude: played.note.amplitude(dynamic) });
        }
        played.asked.1
    }

    /// Trim of the note at the dynamic of the lip, rows; `None` where the breath is physical.
    pub fn played_rows(&self) -> Option<f64> {
        self.played.as_ref().map(|played| played.rows)
    }
}

/// A reed under the lip of a dynamic. A lip that covers the reed holds it to the curve of the lay, however far it opens.
fn shaped(free: &MovingReed, subtone: f64, lip: LipShape) -> MovingReed {
    let knee = if subtone == 0.0 { lip.knee } else { maths::pow(lip.knee, 1.0 - subtone) };
    MovingReed { law: lip.law(free.law), zeta: free.zeta * lip.channel, lay: free.lay * knee, ..*free }
}

impl Played {
    fn new(
        settings: &Settings,
        free: &MovingReed,
        subtone: f64,
        (fingering, placed, rows_per_cent): (usize, PlacedRule, f64),
        model: &Model,
    ) -> Self {
        let note = model.tuning.notes.get(fingering).map_or_else(PlayedNote::default, |note| note.played);
        let note_hz = model.notes_hz[fingering];
        // The reed that the note was played with.
        let lip = embouchure(note_hz, model.size_hz);
        let reference = Settings::default();
        let known = MovingReed {
            law: ReedLaw::default(),
            zeta: ZETA_REFERENCE,
            lay: f64::from(reference.lay),
            resonance_hz: lip.resonance_hz,
            damping: lip.damping * f64::from(reference.damping),
            swept_s: model.swept_s,
        };
        let is_known = subtone == 0.0
            && settings.reed_law() == reference.reed_law()
            && [settings.zeta, settings.lay, settings.damping]
                == [reference.zeta, reference.lay, reference.damping];
        let bore_slope = model.susceptance_slopes[fingering];
        let [own, reference] = [(free, subtone), (&known, 0.0)].map(|(reed, subtone)| {
            move |dynamic: f64| reed_at_note(&shaped(reed, subtone, placed.lip(dynamic)), note_hz)
        });
        let other_reed = if is_known {
            OtherReed::default()
        } else {
            let range = model.player.range_db * std::f64::consts::LN_10 / 20.0;
            let learnt = Learnt { note: &note, bore_slope, rows_per_cent, range };
            OtherReed::new(&own, &reference, free.law.closing(), &learnt)
        };
        let gamma = note.gamma(MEZZO_FORTE) + other_reed.gamma(MEZZO_FORTE);
        // Of a small oscillation, at mezzo-forte: a reed that beats goes up to 1.5 times less far or farther.
        let pull = own(MEZZO_FORTE).pull(gamma);
        Self {
            placed,
            note,
            resonance_per_cent: if pull > 0.0 && bore_slope > 0.0 {
                (bore_slope / (CENTS_PER_SHARE * pull)).min(MOST_RESONANCE_PER_CENT)
            } else {
                MOST_RESONANCE_PER_CENT
            },
            other_reed,
            lip: f64::NAN,
            rows: 0.0,
            note_lip: NoteLip::default(),
            asked: (f64::NAN, PlayedBreath::default()),
        }
    }
}

/// A reed at the frequency of a note, for its onset.
fn reed_at_note(reed: &MovingReed, note_hz: f64) -> ReedAtNote {
    ReedAtNote {
        zeta: reed.law.flow_strength(reed.zeta),
        // A sharp corner is a very short curve.
        lay: reed.lay.max(1e-9),
        ratio: note_hz / reed.resonance_hz,
        damping: reed.damping,
        swept: std::f64::consts::TAU * note_hz * reed.swept_s * reed.law.compliance(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_begins_and_ends_where_the_alternate_is_in_tune() {
        let model = Model::built_in(48_000.0).unwrap();
        for alternate_cents in [0.0, 30.0] {
            let fingered =
                Fingered { fingering: 12, alternate_cents, bend_cents: 0.0, subtone: 0.0, follows: 1.0 };
            let posture = Posture::new(&Settings::default(), &fingered, 1e-3, &model);
            let steps = [-1e-6, 1e-6].map(|cents| (posture.bent(cents, &model).0 - posture.rows).abs());
            assert!(steps.iter().all(|rows| *rows < 1e-6), "{steps:?} rows beside {alternate_cents} cents");
        }
    }
}
