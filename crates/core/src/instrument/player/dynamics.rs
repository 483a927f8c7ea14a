//! The player's rule: what lip and breath do together at a dynamic.
//!
//! A player does not think of pressures. A *dynamic* from 0 (pianissimo, at the threshold of the note) to 1 (fortissimo)
//! moves the mouth pressure, the opening of the reed under the lip and the strength of its flow together. Equal steps of
//! dynamic are equal steps of level: the rule says how loud a note is at each dynamic, and preparing an instrument finds, by
//! playing, the mouth pressure that makes it so ([`PlayedNote`](crate::instrument::played_note::PlayedNote)). So the rule knows no note and no instrument. Its
//! functions depend on the dynamic `d` and on the place `x` of a note over the lowest note of the instrument:
//!
//! | quantity | function |
//! |---|---|
//! | level re that at `d` = 1, dB | `-range (1 - d)` |
//! | mouth over closing pressure at `d` = 1 | `g0 + g1 x + g2 x^2`, with `x` held at -1 and 1 |
//! | flow strength zeta of the reed under the lip | `exp(z0 + z1 x + (z2 + z3 x) d)` |
//! | closing pressure over the reed's own | `c0 c1^(d^3) exp(4 d (1 - d) (m1 x + m2 x^2 + t exp(-((x - x0) / w)^2 / 2) + h s(x)) + v u(x))`, `s` and `u` from 0 to 1 above C6 and G6 |
//! | half-width of the knee of the lay over the rest opening | `lay f / closing` |
//!
//! The closing pressure rises because the jaw opens: the rest opening grows and the stiffness stays. So the air that the
//! reed displaces stays the same, and with it the modes of the bore: a *stiffer* reed of the same closing pressure lost
//! written A5 to another register. The knee of the lay is a length on the mouthpiece: measured with various lip forces, a reed on
//! its lay has one characteristic, which the lip only shifts (Gazengel, Dalmont, Gaillard, Brasseur and Taillard, *Characterization of single
//! reed mouthpiece interaction in quasi-static regime*). So the further the lip lets the reed open, the smaller a share of the opening the
//! knee is, and the sharper the reed closes. From the top of the clarion up the flow strength goes over to
//! [`PlayerModel::altissimo_zeta`], at which soft notes keep their register, and the knee to that of the settings. `cargo xtask fit-player`
//! fits the numbers to recorded notes; `docs/tone.md` tells how and what they bought.

use crate::dsp::smooth::smooth;
use crate::maths;
use crate::reed::ReedLaw;
use crate::reed::physical::ZETA_REFERENCE;

/// The dynamic of mezzo-forte. By the level of the recorded notes it would be 0.54, by their colour 0.62; both steps from
/// here are within 2.4 dB of the recorded ones.
pub const MEZZO_FORTE: f64 = 0.6;
/// The names that musicians give to dynamics, at equal steps of level.
pub const NAMED: [(&str, f64); 6] =
    [("pp", 0.0), ("p", 0.2), ("mp", 0.4), ("mf", MEZZO_FORTE), ("f", 0.8), ("ff", 1.0)];
/// Mouth over closing pressure below the onset of any note: 1/3 for a reed without mass, less near its resonance.
pub const LOWEST_ONSET: f64 = 0.25;
/// Number of dynamics at which a note's pressure and trim are known.
pub const NODES: usize = 8;
/// These dynamics: closer together where the reed begins to beat, and the pitch bends most.
pub const NODE_DYNAMICS: [f64; NODES] = [0.0, 0.2, 0.4, 0.56, 0.7, 0.82, 0.92, 1.0];
/// Distance in octaves from the lowest note to the middle of the compass, and from there to its end: 20.5 semitones, half the
/// compass of a B flat clarinet up to sounding G6.
const HALF_COMPASS_OCTAVES: f64 = 20.5 / 12.0;
/// Places between which the flow strength goes over to that of the altissimo: written A5 and E flat 6 of a B flat clarinet.
const ALTISSIMO: (f64, f64) = (0.42, 0.7);
/// Places between which the lip comes to open the reed further, and notes to begin as those of the altissimo: written C6 and E flat 6.
const HIGH: (f64, f64) = (0.57, 0.7);
/// Places between which the lip comes to close the reed at every dynamic: written G6 and G#6.
const TOP: (f64, f64) = (0.905, 0.955);
/// Flow strengths that the rule may ask for below the altissimo: those at which recorded notes were compared and registers hold.
const ZETAS: (f64, f64) = (0.14, 0.5);
/// The place of a note far outside the compass counts as this.
const FARTHEST: f64 = 1.25;

/// How far a place lies on the way to the highest notes, 0..=1.
pub(super) fn high(place: f64) -> f64 {
    on_the_way(place, HIGH)
}

/// How far a place lies on the way from one to the other, 0..=1, smoothly.
fn on_the_way(place: f64, (from, to): (f64, f64)) -> f64 {
    smooth((place - from) / (to - from))
}

/// The numbers of the player's rule; see the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayerModel {
    /// Level at dynamic 1 over that at 0, dB.
    pub range_db: f64,
    /// Mouth over closing pressure at dynamic 1: in the middle of the compass, slope and curvature over the place.
    pub loudest_gamma: [f64; 3],
    /// Logarithm of zeta: in the middle at dynamic 0, its slope over the place, growth over the dynamic, slope of the growth.
    pub zeta: [f64; 4],
    /// Closing pressure at dynamic 0 over the reed's own, and growth from dynamic 0 to 1 as a factor.
    pub closing: [f64; 2],
    /// What is added to the logarithm of the closing pressure between the softest and the loudest dynamic, most at 1/2: slope and curvature
    /// over the place.
    pub closing_between: [f64; 2],
    /// The same around the throat notes: how much, place of the middle, and standard deviation of the bell over the place.
    pub throat: [f64; 3],
    /// The same on the highest notes. Modes of their fingerings lie as far below a note as above, as on written E flat 6 at 0.70 and 1.30 of it. What
    /// the reed mixes of the note and one of them feeds the other; a reed that opens further, and is blown as much harder as keeps the level, mixes less.
    pub high: f64,
    /// What is added to the logarithm of the closing pressure on the topmost notes, at every dynamic: opened as far as below, they are some 8 dB
    /// louder than their neighbours.
    pub top: f64,
    /// Flow strength in the altissimo, at every dynamic.
    pub altissimo_zeta: f64,
    /// Half-width of the knee of the lay over that of the settings, where the closing pressure is the reed's own.
    pub knee: f64,
}

/// The reed as a player's lip shapes it: factors on a reed's own numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipShape {
    /// On the rest opening.
    pub opening: f64,
    /// On the embouchure parameter zeta of the channel, so that the flow strength is the rule's.
    pub channel: f64,
    /// On the half-width of the knee of the lay, over the rest opening.
    pub knee: f64,
}

impl PlayerModel {
    /// The rule that comes with the program.
    pub const FITTED: Self = super::fitted::FITTED;

    /// Place of a note: -1 at the lowest note of its instrument, 1 three octaves and a fourth above.
    pub fn place(note_hz: f64, lowest_hz: f64) -> f64 {
        (maths::log2(note_hz / lowest_hz) / HALF_COMPASS_OCTAVES - 1.0).clamp(-FARTHEST, FARTHEST)
    }

    /// Mouth over closing pressure at dynamic 1.
    pub fn loudest_gamma(&self, place: f64) -> f64 {
        let [middle, slope, curvature] = self.loudest_gamma;
        // The curve is fitted to notes of the compass. Continued above it, it asks for so much that written C7 begins as another note.
        let place = place.clamp(-1.0, 1.0);
        // Below, some note would be nearly silent; above, the reed of a low note may stay shut.
        (middle + (slope + curvature * place) * place).clamp(0.45, 1.05)
    }

    /// Level at a dynamic re that at dynamic 1, dB.
    pub fn level_db(&self, dynamic: f64) -> f64 {
        -self.range_db * (1.0 - dynamic)
    }

    /// The rule for the notes at a place. Real-time safe.
    pub fn at(&self, place: f64) -> PlacedRule {
        let ([soft, growth], [slope, curvature], [throat, middle, width]) =
            (self.closing, self.closing_between, self.throat);
        let [zeta, zeta_slope, zeta_growth, zeta_growth_slope] = self.zeta;
        let away = (place - middle) / width;
        let (lowest, highest) = ZETAS;
        PlacedRule {
            closing: [maths::ln(soft), maths::ln(growth)],
            zetas: [maths::ln(lowest), maths::ln(highest)],
            altissimo_zeta: maths::ln(self.altissimo_zeta),
            knee: maths::ln(self.knee),
            at: [
                (1.0 - on_the_way(place, ALTISSIMO)) * (slope + curvature * place) * place
                    + throat * maths::exp(-0.5 * away * away)
                    + self.high * on_the_way(place, HIGH),
                self.top * on_the_way(place, TOP),
                zeta + zeta_slope * place,
                zeta_growth + zeta_growth_slope * place,
                on_the_way(place, ALTISSIMO),
            ],
        }
    }

    /// Flow strength of the reference reed under the lip.
    pub fn zeta(&self, place: f64, dynamic: f64) -> f64 {
        maths::exp(self.at(place).log_zeta(dynamic))
    }

    /// Closing pressure of the reference reed under the lip, over its own.
    pub fn closing(&self, place: f64, dynamic: f64) -> f64 {
        maths::exp(self.at(place).log_closing(dynamic))
    }

    /// Half-width of the knee of the lay over the rest opening, over that of the settings, under a lip that opens the reed by this factor.
    pub fn knee_at(&self, place: f64, opening: f64) -> f64 {
        maths::exp(self.at(place).log_knee(maths::ln(opening)))
    }

    /// The lip at a dynamic. Real-time safe.
    pub fn lip(&self, place: f64, dynamic: f64) -> LipShape {
        self.at(place).lip(dynamic)
    }
}

/// The numbers of the rule that go with the place of a note: what is added to the logarithm of the closing pressure over `4 d (1 - d)`, and
/// what at every dynamic; logarithm of the flow strength below the altissimo at dynamic 0, and its growth; and how far the place lies on the way into the
/// altissimo, 0..=1. A lip on its way from note to note has numbers between theirs, and not those of the places between: a slur over the
/// throat does not ask for a throat note's lip.
pub type AtPlace = [f64; 5];

/// The rule for the notes at one place. All numbers are logarithms but the last of `at`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedRule {
    /// Closing pressure at dynamic 0, and its growth over `d^3`.
    closing: [f64; 2],
    /// Limits of the flow strength below the altissimo.
    zetas: [f64; 2],
    altissimo_zeta: f64,
    knee: f64,
    /// What goes with the place.
    pub at: AtPlace,
}

/// What the place adds to the logarithm of the closing pressure at a dynamic.
fn closing_at([between, always, ..]: &AtPlace, dynamic: f64) -> f64 {
    4.0 * dynamic * (1.0 - dynamic) * between + always
}

impl PlacedRule {
    fn log_zeta(&self, dynamic: f64) -> f64 {
        let ([_, _, soft, growth, altissimo], [lowest, highest]) = (self.at, self.zetas);
        let below = (soft + growth * dynamic).clamp(lowest, highest);
        below + altissimo * (self.altissimo_zeta - below)
    }

    fn log_closing(&self, dynamic: f64) -> f64 {
        let [soft, growth] = self.closing;
        soft + growth * dynamic * dynamic * dynamic + closing_at(&self.at, dynamic)
    }

    /// Closing pressure where the lip goes, over that here. Real-time safe.
    pub fn closing_ahead(&self, to: &AtPlace, dynamic: f64) -> f64 {
        let further = closing_at(to, dynamic) - closing_at(&self.at, dynamic);
        if further == 0.0 { 1.0 } else { maths::exp(further) }
    }

    fn log_knee(&self, log_opening: f64) -> f64 {
        let [.., altissimo] = self.at;
        (1.0 - altissimo) * (self.knee - log_opening)
    }

    /// The lip at a dynamic. Real-time safe.
    pub fn lip(&self, dynamic: f64) -> LipShape {
        // Closing pressure and opening go together; the flow strength goes with the opening over the root of the pressure.
        let opening = self.log_closing(dynamic);
        LipShape {
            opening: maths::exp(opening),
            channel: maths::exp(self.log_zeta(dynamic) - 0.5 * opening) / ZETA_REFERENCE,
            knee: maths::exp(self.log_knee(opening)),
        }
    }
}

impl LipShape {
    /// The lip on its way to this one from that of the free reed, in logarithms: 0 there, 1 here. Real-time safe.
    pub fn of_the_way(self, way: f64) -> Self {
        if way == 1.0 {
            return self;
        }
        let Self { opening, channel, knee } = self;
        Self {
            opening: maths::pow(opening, way),
            channel: maths::pow(channel, way),
            knee: maths::pow(knee, way),
        }
    }

    /// The law of a reed under this lip. Real-time safe.
    pub fn law(&self, reed: ReedLaw) -> ReedLaw {
        let h = (reed.h() * self.opening).clamp(0.5, 10.0);
        ReedLaw::free(h, reed.k(), reed.a()).unwrap_or(reed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lip_gives_the_rules_closing_pressure_and_flow_at_every_place() {
        let rule = PlayerModel::FITTED;
        for place in [-1.0, 0.0, 0.7, 1.0] {
            for dynamic in [0.0, 0.3, 1.0] {
                let lip = rule.lip(place, dynamic);
                let law = lip.law(ReedLaw::default());
                assert!((law.closing() / rule.closing(place, dynamic) - 1.0).abs() < 1e-9);
                let zeta = law.flow_strength(ZETA_REFERENCE * lip.channel);
                assert!((zeta / rule.zeta(place, dynamic) - 1.0).abs() < 1e-9, "{place} {dynamic}: {zeta}");
            }
        }
    }

    #[test]
    fn closing_pressure_and_level_rise_and_the_flow_stays_within_its_limits() {
        let rule = PlayerModel::FITTED;
        for place in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            let steps = || (0..=100).map(|step| f64::from(step) / 100.0);
            assert!(rule.closing(place, 0.0) < rule.closing(place, 1.0));
            assert!(steps().map(|d| rule.level_db(d)).is_sorted_by(|soft, loud| soft < loud));
            assert!(steps().all(|d| (ZETAS.0 - 1e-9..=ZETAS.1 + 1e-9).contains(&rule.zeta(place, d))));
            assert!((rule.zeta(1.0, 0.5) - rule.altissimo_zeta).abs() < 1e-12);
            assert!(rule.loudest_gamma(place) < 1.1);
        }
    }

    #[test]
    fn the_place_is_relative_to_the_instrument() {
        let semitones = |count: f64| 100.0 * (count / 12.0).exp2();
        assert!((PlayerModel::place(100.0, 100.0) + 1.0).abs() < 1e-12);
        assert!((PlayerModel::place(semitones(41.0), 100.0) - 1.0).abs() < 1e-12);
        assert_eq!(PlayerModel::place(1e9, 100.0), FARTHEST);
    }
}
