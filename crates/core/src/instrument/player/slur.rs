//! Slurs: how quickly the fingers move, and where lip and breath help.
//!
//! The fingers begin at the bell, and overlap within a register. Over the break up they are quicker: nothing sounds well on the way, and
//! the new mode has to grow from little. Down over the break they take their time.
//!
//! So nearly all slurs arrive. Where the reed beats, leaps from the low clarion into the low chalumeau would not: hole by hole, the
//! column would grow shorter and take the second mode along. There the lip damps the reed, the more the lower the new note is: what a damped reed takes
//! from a mode grows with the square of its frequency, and what the bore takes with the root. The breath goes on: a dip of it did the same, but left a
//! hole of 30 dB. Fingers that began at the mouth did it with less of a lip, but what left the bore by the first hole that opened was up to
//! 15 dB louder than the notes on a bass.
//!
//! From the altissimo down into the clarion the old mode would go on too, for a tenth of a second and more: a third or a fifth above the new
//! note. There the fingers are quick, and the lip damps the reed a little. Into the altissimo it lets the reed swing more freely, so that
//! the new note grows sooner. Within the altissimo neighbours have fingerings of their own, so the fingers move as where the register changes.
//!
//! Down out of a register the new note grows from little, and the old one has gone before it is heard. There the breath pushes for a moment, as
//! steeply as a part of the period, so that the new mode begins at once.
//!
//! Leaps down into the low chalumeau by more than an octave keep the twelfth even in soft playing. There the lip damps the reed a little more.
//!
//! Down into the throat the old mode dies in the lengthening column, and the new one grows from little. There the fingers take more time,
//! and the lip lets the reed swing a little more freely. Where the reed beats it does not, and into the lowest of these notes, which hold
//! on to their twelfth as the low chalumeau does, it damps the reed.

use super::lip_glide::LipHelp;
use super::push::Push;
use crate::maths;
use crate::reed::physical::LAY_REFERENCE;

/// Notes below this place of the compass (between written D#4 and E4 of a B flat clarinet) hold on to their second mode.
pub(super) const LOW_PLACE: f64 = -0.43;
/// Slurs down over at least so many cents from clarion to low chalumeau.
const LEAP_CENTS: f64 = 650.0;
/// The least mouth over closing pressure at which such a slur needs help, on a B flat clarinet and the reference facing: near where the reed beats.
const BEATING: f64 = 0.42;
/// By how much less a larger instrument needs, for each octave that it is lower: on a bass softer slurs hold on to their twelfth as well. Of 624
/// slurs down over the break at velocities of 8 to 127, 18 were lost with 0.02.
const SOONER_LARGE: f64 = 0.06;
/// Lowest note of a B flat clarinet, sounding D3, Hz.
const B_FLAT_LOWEST_HZ: f64 = 146.8;
/// By how much less mouth over closing pressure a slur needs help, for each unit of a straighter facing, on which the reed beats sooner. Of 56
/// slurs from written B4..F5 to B3..F#4 at velocities of 40 and 60, with the presets *Glass facing* (0), *Bass with teeth* (0.1), *Wedding march*
/// (0.12), *Swing section* (0.28) and *Keys, bright tongue* (0.3), 169 of 560 were wrong after 0.13 s and 53 after 0.55 s; with this and
/// [`FIRMER`], 4 and 2.
const SOONER: f64 = 0.5;
/// The same for each unit by which the settings damp the reed less. With it and [`FIRMER_FREE`], of 280 slurs of the preset *Doina* (0.9) at five
/// velocities none is wrong after 0.13 s, where 23 were.
const SOONER_FREE: f64 = 1.0;
/// With less damping than this below the usual factor nothing more is added. Of 224 slurs as in the test of `crates/core/tests/player.rs` on a
/// reed with a factor of 0.8, none is lost; one with less squeaks on purpose.
const FREEST: f64 = 0.2;
/// What the lip adds to the factor on the reed's damping in such slurs, for each unit of a straighter facing.
const FIRMER: f64 = 3.0;
/// The same for each unit by which the settings damp the reed less; see [`SOONER_FREE`].
const FIRMER_FREE: f64 = 10.0;
/// What the lip adds to the factor on the reed's damping in such a leap into the lowest note, and for how many periods of the new note. Of 780 slurs down
/// over the break, at ten velocities from 8 to 127, none is lost on each of the clarinets in B flat, A and E flat, and one on the bass. With 1.25 three are lost on
/// the B flat clarinet, and with 12 periods two on the A clarinet; with 2.5 the deepest hole is 24 dB instead of 15.
const LEAP_DAMPING: f64 = 1.5;
/// See [`LEAP_DAMPING`].
const LEAP_PERIODS: f64 = 20.0;
/// Leaps down into the low chalumeau over more than so many cents: more than an octave. Above it they arrive by themselves; with so much
/// damping they fall silent for 0.1 s.
const WIDE_CENTS: f64 = 1_250.0;
/// These are notes below this place, between written E4 and F4: on a bass, 8 of 830 slurs down by more than an octave were lost into E4.
const WIDE_PLACE: f64 = -0.38;
/// What the lip adds to the factor on the reed's damping in these, into the lowest note. Of 1216 at eight velocities none is lost with it, nor of 1328
/// on the bass; with 1.5 for 20 periods, 5 and 2. Six times the damping on every note made holes of 25 dB in the median (`docs/tone.md`).
const WIDE_DAMPING: f64 = 2.5;
/// What the breath does in these. Nine tenths of them have holes of less than 7 dB; without it, and with the damping of 3.5 that they then need, of 22.
const WIDE_PUSH: Push = Push { after: 0.75, amount: 0.5, fade_s: 0.015 };
/// How long the lip helps in these and into the throat, periods of the new note: from 0.1 s into written E3 to 0.035 s into A#4 on a B flat
/// clarinet. In 0.1 s at most on every note, 2 of 459 slurs on the bass are lost with twice this damping.
const PERIODS: f64 = 15.0;
/// Factor on the legato time in these. At 1.8, nine tenths of the holes are 3 dB deeper, and as many slurs arrive.
const WIDE_TIME: f64 = 1.0;
/// What the lip does from the altissimo into the clarion, and the factor on the legato time. Of 630 slurs from written C#6..A6 to B4..C6 at CC 20
/// to 127, nine tenths have arrived after 145 ms without it and 85 ms with it, and one is lost without it. At a factor of 1.6 the holes are 7 dB
/// deeper; the peaks on the way are 1.7 dB higher at this time than at [`DOWN_TIME`] (`docs/tone.md`).
const FROM_ALTISSIMO_DAMPED: LipHelp = LipHelp { damping: 1.3, length_s: 0.03 };
/// See [`FROM_ALTISSIMO_DAMPED`].
const FROM_ALTISSIMO_TIME: f64 = 0.8;
/// What the breath does there. Of 216 slurs at velocities of 45, 75 and 110, half have holes of more than 15 dB without it and 7 with it, and they click
/// 1 dB less. Halfway through the fingers' time they would click 2 dB more.
const FROM_ALTISSIMO_PUSH: Push = Push { after: 1.0, amount: 0.5, fade_s: 0.015 };
/// The same from the altissimo into the throat, where the old mode dies sooner. Of 162, half have holes of more than 19 dB without it, and 8
/// with it; 12 at 0.5.
const INTO_CHALUMEAU_PUSH: Push = Push { after: 0.3, ..FROM_ALTISSIMO_PUSH };
/// What the breath does in other slurs down over the break. Of 312 at velocities of 20 to 110, nine tenths have holes of less than 13 dB without it and
/// 7 with it. The stronger, the shallower the holes: at 0.25 one of 1908 slurs is more than 2 dB louder on the way than either note.
const DOWN_PUSH: Push = Push { after: 0.5, amount: 0.2, fade_s: 0.008 };
/// Share of the time of the slur that each finger takes there. With 0.55 a tenth more take longer than 0.1 s.
const FROM_ALTISSIMO_SHARE: f64 = 0.4;
/// What the lip takes from the factor on the reed's damping in soft slurs down over the break into the throat. With 0.2 holes are 2 dB
/// shallower, and at CC 45 bumps up to 1 dB louder (`docs/tone.md`).
const THROAT_FREEDOM: f64 = 0.15;
/// What it adds to the factor in loud ones into the lowest notes of the throat, wholly at [`LOW_PLACE`]. Without it written E4 stays on its
/// twelfth for up to 0.6 s at full breath, with 0.8 holes are 5 dB deeper (`docs/tone.md`).
const THROAT_DAMPING: f64 = 0.5;
/// Notes from this place on, written G4, leave their second mode by themselves.
const THROAT_HOLDS: f64 = -0.27;
/// Mouth over closing pressures between which a slur goes over from soft to loud, as the reed comes to beat. With the freedom of soft ones
/// a beating reed squeaks: at CC 108 and 127 there are bumps of 3 dB and clicks of 12.
const THROAT_LOUD: (f64, f64) = (0.45, 0.6);
/// Factor on the legato time in these. Measured with this lip, at 2.9, 3.5 and 4: nine tenths of the holes are 12.8, 11.3 and 10.3 dB deep.
const THROAT_TIME: f64 = 4.0;
/// What the lip does up into the altissimo. Of 208 slurs from C5..C6 to F#6..A6, nine tenths have arrived after 235 ms without it, 175 with
/// it, and 115 with a factor of 0.5 for 60 ms, which makes them 7 dB louder on the way than either note.
const INTO_ALTISSIMO_DAMPED: LipHelp = LipHelp { damping: 0.7, length_s: 0.05 };
/// Factor on the legato time of slurs down within the altissimo; up it is [`UP_TIME`]. Of 264 at this time and with overlapping fingers, nine
/// tenths have arrived after 85 ms; with [`ACROSS_SHARE`], after 55.
const ALTISSIMO_DOWN_TIME: f64 = 0.8;
/// Factor on the legato time of a slur up over the break or into the altissimo: the shorter, the shallower the hole and the louder the click. Measured at 0.6 and
/// 0.4: nine tenths of the holes of octaves are 10.5 and 8.6 dB deep, of all clicks 2.8 and 3.7 dB loud. Without breath nobody hurries: the
/// keys would be heard. 294 slurs into written C#6..A6 at three velocities: nine tenths have arrived after 125 ms at 1.1, 55 at 0.4.
const UP_TIME: f64 = 0.46;
/// Factor on the legato time of any other slur down over the break, or from the altissimo into the chalumeau: the old note goes on in the lengthening column, and is heard through the
/// holes that open. Measured at 1, 1.5 and 2.4: nine tenths of the clicks of all slurs are 3.6, 2.9 and 2.7 dB loud, and 78, 51 and 12 of 1908
/// slurs are more than 2 dB louder on the way than either note. With a firmer throat, 10 at 2.4 and 6 at 2.8.
const DOWN_TIME: f64 = 2.9;
/// Factor on the legato time of slurs that do not cross the break. Measured at 1 and 1.2: slurs up within the clarion have bumps of 2.2 and 1.9
/// dB at CC 58, and nine tenths of the holes of octaves are 9.0 and 10.3 dB deep.
const OTHER_TIME: f64 = 1.1;
/// Share of the time of the slur that each finger takes where the register changes, and in the altissimo: the air column then nearly always has one clear length.
/// Measured: clicks are 0.4 dB softer than with 0.5.
const ACROSS_SHARE: f64 = 0.55;
/// The same within another register: the fingers overlap, which clicks less.
const WITHIN_SHARE: f64 = 0.8;

/// How the fingers move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walk {
    /// Factor on the time that is set for slurs.
    pub time: f64,
    /// Share of that time that each finger takes.
    pub finger_share: f64,
}

/// Behind the tongue. What still rings of the note before leaves by the holes near the bell first. Of 736 pairs of notes on a bass, at two
/// velocities and 30 ms apart, 48 began more than 3 dB louder than either note, up to 16 dB, where all fingers moved at once and in 5 ms; with
/// this and the time of the player 7, up to 7 dB.
pub(super) const TONGUED: Walk = Walk { time: 1.0, finger_share: 0.5 };

/// A slur: the way from note to note.
#[derive(Clone, Copy, Debug)]
pub struct Slur {
    /// Up if positive, cents.
    pub interval_cents: f64,
    /// Register from where, and to where.
    pub registers: (u8, u8),
    /// [Place](super::dynamics::PlayerModel::place) of the new note.
    pub place: f64,
    /// Frequency of the new note, Hz.
    pub note_hz: f64,
    /// The same over that of the lowest note of the instrument.
    pub over_lowest: f64,
    /// Curve of the facing.
    pub lay: f64,
    /// Factor of the settings on the reed's damping.
    pub damping: f64,
}

impl Slur {
    /// By how much less mouth over closing pressure the reed holds on to the old mode than the reed for which this was measured.
    fn sooner(&self) -> f64 {
        SOONER * self.straighter() + SOONER_FREE * self.freer() + SOONER_LARGE * self.larger()
    }

    /// By how much less the settings damp the reed, up to what was tried.
    fn freer(&self) -> f64 {
        (1.0 - self.damping).clamp(0.0, FREEST)
    }

    /// By how many octaves the instrument is lower than a B flat clarinet.
    fn larger(&self) -> f64 {
        maths::log2(B_FLAT_LOWEST_HZ * self.over_lowest / self.note_hz).max(0.0)
    }

    /// By how much straighter the facing is than the one for which this was measured.
    fn straighter(&self) -> f64 {
        (LAY_REFERENCE - self.lay).max(0.0)
    }

    /// Whether the fingers alone, from the bell, would take the old mode along at a mouth over closing pressure.
    fn is_hard(&self, gamma: f64) -> bool {
        let leaps = self.registers == (2, 1) && self.place < LOW_PLACE && -self.interval_cents > LEAP_CENTS;
        leaps && gamma >= BEATING - self.sooner()
    }

    /// Whether it comes down over the break.
    fn is_down_over_the_break(&self) -> bool {
        self.registers.0 > 1 && self.registers.1 == 1
    }

    /// Whether it leaps down into the low chalumeau by more than an octave.
    fn is_wide(&self) -> bool {
        self.is_down_over_the_break() && self.place < WIDE_PLACE && -self.interval_cents > WIDE_CENTS
    }

    /// Whether it comes down over the break into the throat.
    fn is_into_the_throat(&self) -> bool {
        self.is_down_over_the_break() && self.place >= LOW_PLACE
    }

    /// A lip that damps the reed the more, the lower the note is; `most` is added into the lowest note.
    fn low_help(&self, most: f64, periods: f64) -> LipHelp {
        let ratio = self.over_lowest;
        LipHelp { damping: 1.0 + most / (ratio * ratio.sqrt()), length_s: periods / self.note_hz }
    }

    /// What the lip adds to the factor on the reed's damping for such a reed.
    fn firmer(&self) -> f64 {
        FIRMER * self.straighter() + FIRMER_FREE * self.freer()
    }

    /// What the lip does in a leap from the low clarion into the low chalumeau.
    fn leap_help(&self) -> LipHelp {
        let LipHelp { damping, length_s } = self.low_help(LEAP_DAMPING, LEAP_PERIODS);
        LipHelp { damping: (damping + self.firmer()) / (1.0 - self.freer()), length_s }
    }

    /// What the lip does down into the throat at a mouth over closing pressure.
    fn throat_help(&self, gamma: f64) -> LipHelp {
        let (soft, loud) = THROAT_LOUD;
        let loudness = ((gamma + self.sooner() - soft) / (loud - soft)).clamp(0.0, 1.0);
        let holds = ((THROAT_HOLDS - self.place) / (THROAT_HOLDS - LOW_PLACE)).clamp(0.0, 1.0);
        let held = THROAT_DAMPING + self.firmer();
        let damping = 1.0 - THROAT_FREEDOM * (1.0 - loudness) + held * loudness * holds;
        LipHelp { damping, length_s: PERIODS / self.note_hz }
    }

    /// Whether both notes lie in one register, so that the air column goes on as it swings.
    pub fn is_within_a_register(&self) -> bool {
        self.registers.0 == self.registers.1
    }

    /// What a player's lip does at a mouth over closing pressure; `None` where the fingers are enough.
    pub fn lip_help(&self, gamma: f64) -> Option<LipHelp> {
        if self.is_wide() {
            return Some(self.low_help(WIDE_DAMPING, PERIODS));
        }
        if self.is_into_the_throat() {
            return Some(self.throat_help(gamma));
        }
        match self.registers {
            (3, 2) => Some(FROM_ALTISSIMO_DAMPED),
            (1 | 2, 3) => Some(INTO_ALTISSIMO_DAMPED),
            _ => self.is_hard(gamma).then_some(self.leap_help()),
        }
    }

    /// What a player's breath adds; `None` where the new note is there soon enough.
    pub fn push(&self) -> Option<Push> {
        match self.registers {
            _ if self.is_wide() => Some(WIDE_PUSH),
            (3, 2) => Some(FROM_ALTISSIMO_PUSH),
            (3, 1) => Some(INTO_CHALUMEAU_PUSH),
            (2, 1) => Some(DOWN_PUSH),
            _ => None,
        }
    }

    /// What a player's fingers do at a mouth over closing pressure.
    pub fn walk(&self, gamma: f64) -> Walk {
        Walk {
            time: match self.registers {
                _ if self.is_wide() => WIDE_TIME,
                (1, 2) | (1 | 2, 3) if gamma > 0.0 => UP_TIME,
                (3, 3) if self.interval_cents > 0.0 && gamma > 0.0 => UP_TIME,
                (3, 3) => ALTISSIMO_DOWN_TIME,
                (3, 2) => FROM_ALTISSIMO_TIME,
                _ if self.is_into_the_throat() => THROAT_TIME,
                _ if self.is_down_over_the_break() => DOWN_TIME,
                _ => OTHER_TIME,
            },
            finger_share: match self.registers {
                (3, 2) => FROM_ALTISSIMO_SHARE,
                (from, to) if from == to && to < 3 => WITHIN_SHARE,
                _ => ACROSS_SHARE,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straighter_facing_and_a_freer_reed_need_help_sooner_and_more() {
        let usual = slur(-12.0, (2, 1), -0.6);
        for other in [Slur { lay: 0.1, ..usual }, Slur { damping: 0.8, ..usual }] {
            assert!(usual.lip_help(0.4).is_none() && other.lip_help(0.4).is_some());
            let damping = |slur: Slur| slur.lip_help(0.6).unwrap().damping;
            assert!(damping(other) > damping(usual));
        }
        // A rounder facing, or a reed that is damped more, needs no more than the one for which all was measured.
        for other in [Slur { lay: 0.5, ..usual }, Slur { damping: 1.3, ..usual }] {
            assert_eq!(other.lip_help(0.6), usual.lip_help(0.6));
            assert_eq!(other.lip_help(0.41), None);
        }
        let bass = Slur { note_hz: 0.4 * usual.note_hz, ..usual };
        assert!(bass.lip_help(0.36).is_some(), "a larger instrument holds on sooner");
    }

    fn slur(semitones: f64, registers: (u8, u8), place: f64) -> Slur {
        let over_lowest = (20.5 / 12.0 * (place + 1.0)).exp2();
        Slur {
            interval_cents: 100.0 * semitones,
            registers,
            place,
            note_hz: 147.0 * over_lowest,
            over_lowest,
            lay: LAY_REFERENCE,
            damping: 1.0,
        }
    }

    #[test]
    fn only_loud_leaps_down_into_the_low_chalumeau_need_the_lip() {
        let leap = slur(-12.0, (2, 1), -0.6);
        let others = [
            (leap, 0.41),
            (slur(-6.0, (2, 1), -0.6), 0.9),
            (slur(12.0, (1, 2), 0.1), 0.9),
            (slur(-2.0, (2, 1), -0.5), 0.9),
            (slur(-11.0, (2, 2), 0.0), 0.9),
            (slur(-2.0, (3, 3), 0.8), 0.9),
        ];
        assert!(leap.lip_help(0.43).is_some());
        for (other, gamma) in others {
            assert_eq!(other.lip_help(gamma), None, "{other:?}");
        }
    }

    #[test]
    fn leaps_down_by_more_than_an_octave_always_need_the_lip() {
        for registers in [(2, 1), (3, 1)] {
            let leap = slur(-13.0, registers, -0.5);
            assert!(leap.lip_help(0.1).is_some_and(|lip| lip.damping > 2.0));
            assert_eq!(leap.walk(0.1).time, WIDE_TIME);
            let lower = slur(-13.0, registers, -0.9).lip_help(0.1);
            assert!(lower.zip(leap.lip_help(0.1)).is_some_and(|(lower, lip)| {
                lower.damping > lip.damping && lower.length_s > lip.length_s
            }));
            let into_the_throat = slur(-13.0, registers, -0.37);
            assert!(into_the_throat.lip_help(0.4).is_some_and(|lip| lip.damping < 1.0));
            assert!(
                into_the_throat.lip_help(0.9).is_some_and(|lip| lip.damping > 1.0),
                "it holds on to the old mode"
            );
            let higher = slur(-13.0, registers, -0.2).lip_help(0.9);
            assert!(higher.is_some_and(|lip| lip.damping == 1.0));
            assert_eq!(into_the_throat.walk(0.9).time, THROAT_TIME);
        }
    }

    #[test]
    fn the_breath_pushes_where_a_register_ends_downwards() {
        let registers = [(2, 1), (3, 1), (3, 2)];
        assert!(registers.iter().all(|&registers| slur(-5.0, registers, 0.1).push().is_some()));
        assert_eq!(slur(-15.0, (2, 1), -0.9).push(), Some(WIDE_PUSH));
        let registers = [(1, 1), (1, 2), (2, 2), (2, 3), (3, 3)];
        assert!(registers.iter().all(|&registers| slur(5.0, registers, 0.1).push().is_none()));
    }

    #[test]
    fn the_lip_lets_the_reed_swing_into_the_altissimo_and_damps_it_on_the_way_back() {
        let [up, back] = [(2, 3), (3, 2)].map(|registers| slur(5.0, registers, 0.5).lip_help(0.6));
        assert!(up.is_some_and(|lip| lip.damping < 1.0) && back.is_some_and(|lip| lip.damping > 1.0));
    }

    #[test]
    fn fingers_are_quicker_up_over_the_break_slower_down_and_overlap_within_a_register() {
        let walks = [(1, 1), (1, 2), (2, 1), (2, 2)].map(|registers| slur(2.0, registers, -0.5).walk(0.6));
        assert_eq!(walks.map(|walk| walk.time), [OTHER_TIME, UP_TIME, DOWN_TIME, OTHER_TIME]);
        let [within, up, down, _] = walks.map(|walk| walk.finger_share);
        assert!(within > up && up == down);
    }
}
