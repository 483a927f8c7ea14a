//! Which players play side by side, in the lanes of a choir, and which alone.
//!
//! It makes no difference to what is heard, only to what it costs: a tick of a choir costs the same whether one of its lanes
//! plays or all do. So choirs are as few and as full as can be. The clocks of players who are bent or out of tune run at
//! different speeds: now and then some need a tick that the others do not need yet.

use std::cmp::Reverse;

use crate::dsp::lanes::has_avx2;
use crate::instrument::ensemble::Seat;
use crate::instrument::model::Model;
use crate::instrument::players::MOST_PLAYERS;
use crate::instrument::voice::choir::{Choir, Lanes};

/// Lanes of a choir where the processor has vectors of eight numbers, and elsewhere.
pub(in crate::instrument) const WIDE: usize = 8;
/// See [`WIDE`].
pub(in crate::instrument) const NARROW: usize = 4;

/// Fewest voices for which a choir of so many lanes is less work than as many voices alone. Counted (`docs/performance.md`): four
/// voices are as much work as a wide choir of four, and more than two as a narrow one.
pub(in crate::instrument) const fn least(lanes: usize) -> usize {
    lanes / 2 + 1
}

/// The choirs of an ensemble.
pub(super) enum Section {
    Wide(Choirs<WIDE>),
    Narrow(Choirs<NARROW>),
}

/// Evaluates an expression with the choirs, whatever their width.
macro_rules! with_choirs {
    ($section:expr, $choirs:ident => $body:expr) => {
        match $section {
            Section::Wide($choirs) => $body,
            Section::Narrow($choirs) => $body,
        }
    };
}

impl Section {
    /// Empty choirs for all players of a model. Allocates.
    pub fn new(model: &Model) -> Self {
        if has_avx2() { Self::Wide(Choirs::new(model)) } else { Self::Narrow(Choirs::new(model)) }
    }

    /// Keeps to the code path without AVX2.
    pub fn without_avx2(self, model: &Model) -> Self {
        let mut choirs = Choirs::new(model);
        choirs.choirs = choirs.choirs.into_iter().map(Choir::without_avx2).collect();
        Self::Narrow(choirs)
    }

    /// Everybody plays alone from now on.
    #[cfg(test)]
    fn disband(&mut self) {
        with_choirs!(self, choirs => choirs.choirs.clear());
    }

    /// Choir and lane of each player.
    #[cfg(test)]
    fn places(&self) -> [Option<(usize, usize)>; MOST_PLAYERS] {
        with_choirs!(self, choirs => choirs.places)
    }

    /// Gives players who have woken a lane where that saves work, and takes it from those who sleep. Real-time safe.
    pub fn arrange(&mut self, seats: &mut [Seat]) {
        with_choirs!(self, choirs => choirs.arrange(seats));
    }

    /// Plays a tick of those whose bits are set in `waiting`. Real-time safe.
    pub fn tick(&mut self, seats: &mut [Seat], waiting: u32) {
        with_choirs!(self, choirs => choirs.tick(seats, waiting));
    }
}

/// Choirs of one width.
pub(super) struct Choirs<const N: usize> {
    choirs: Vec<Choir<N>>,
    /// Choir and lane of each player.
    places: [Option<(usize, usize)>; MOST_PLAYERS],
    /// The players of each choir, as bits.
    members: [u32; MOST_PLAYERS],
    /// Who was awake when they were given, as bits.
    awake: u32,
}

/// The numbers of the bits that are set.
fn each(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let number = bits.trailing_zeros() as usize;
        // The lowest one goes.
        bits &= bits.checked_sub(1)?;
        Some(number)
    })
}

impl<const N: usize> Choirs<N> {
    /// What a tick of a choir costs over what a tick of a voice alone costs, counted in the same way.
    const CHOIR_COST: f64 = 0.5 * N as f64;
    /// What it costs over the same that a lane takes up or gives back its waves: some 600 numbers.
    const LANE_COST: f64 = 0.3;

    fn new(model: &Model) -> Self {
        let count = if model.is_single() { MOST_PLAYERS.div_ceil(N) } else { 0 };
        Self {
            choirs: (0..count).map(|_| Choir::new(&model.coeffs)).collect(),
            places: [None; MOST_PLAYERS],
            members: [0; MOST_PLAYERS],
            awake: 0,
        }
    }

    /// A lane of a choir that nobody has.
    fn free_lane(&self, choir: usize) -> Option<usize> {
        (0..N).find(|&lane| !self.places.contains(&Some((choir, lane))))
    }

    #[inline(never)] // Seldom played and slow to compile: once is enough.
    fn leave(&mut self, number: usize, seat: &mut Seat) {
        let Some((choir, lane)) = self.places[number].take() else { return };
        self.members[choir] &= !(1 << number);
        if let Some(voice) = seat.clarinet.single_voice() {
            self.choirs[choir].leave(lane, voice);
        }
    }

    fn arrange(&mut self, seats: &mut [Seat]) {
        let bits: u32 = (0..).zip(&*seats).map(|(number, seat)| u32::from(!seat.sleeps) << number).sum();
        if std::mem::replace(&mut self.awake, bits) == bits || self.choirs.is_empty() {
            return;
        }
        for (number, seat) in seats.iter_mut().enumerate().filter(|(_, seat)| seat.sleeps) {
            self.leave(number, seat);
        }
        let awake = bits.count_ones() as usize;
        let wanted = awake / N + usize::from(awake % N >= least(N));
        // The emptiest are given up.
        let mut members: [(usize, usize); MOST_PLAYERS] = [(0, 0); MOST_PLAYERS];
        let members = &mut members[..self.choirs.len()];
        for (choir, members) in members.iter_mut().enumerate() {
            *members = (self.members[choir].count_ones() as usize, choir);
        }
        members.sort_unstable_by_key(|&(members, choir)| (Reverse(members), choir));
        for &mut (_, given_up) in &mut members[wanted..] {
            for (number, seat) in seats.iter_mut().enumerate() {
                if self.places[number].is_some_and(|place| place.0 == given_up) {
                    self.leave(number, seat);
                }
            }
        }
        for (number, seat) in seats.iter().enumerate() {
            if !seat.sleeps && self.places[number].is_none() {
                let mut choirs = members[..wanted].iter();
                let place = choirs.find_map(|&(_, choir)| self.free_lane(choir).map(|lane| (choir, lane)));
                self.places[number] = place;
                if let Some((choir, _)) = place {
                    self.members[choir] |= 1 << number;
                }
            }
        }
    }

    fn tick(&mut self, seats: &mut [Seat], waiting: u32) {
        // Who plays in a lane, as bits.
        let mut side_by_side = 0_u32;
        for number in each(waiting) {
            let Some(seat) = seats.get_mut(number) else { continue };
            seat.clarinet.begin_tick();
            let fits = self.places[number].is_some()
                && seat.clarinet.single_voice().is_some_and(Choir::<N>::can_play);
            side_by_side |= u32::from(fits) << number;
        }
        for choir in 0..self.choirs.len() {
            side_by_side &= !self.tick_choir(choir, seats, side_by_side);
        }
        for number in each(waiting) {
            let Some(seat) = seats.get_mut(number) else { continue };
            if side_by_side >> number & 1 == 0 {
                if let (Some((choir, lane)), Some(voice)) =
                    (self.places[number], seat.clarinet.single_voice())
                {
                    self.choirs[choir].leave(lane, voice);
                }
                seat.clarinet.run_alone();
            }
            seat.clarinet.end_tick();
        }
    }

    /// Plays a tick of those in a choir whose bits are set, unless it is less work if they play alone; who is to play alone, as
    /// bits.
    fn tick_choir(&mut self, choir: usize, seats: &mut [Seat], wanted: u32) -> u32 {
        let members = self.members[choir];
        let playing = wanted & members;
        if playing == 0 {
            return 0;
        }
        let [count, idle] = [playing, members & !playing].map(|bits| f64::from(bits.count_ones()));
        // Who does not play takes its waves back meanwhile; who plays alone takes them back and brings them again.
        if count * (1.0 + 2.0 * Self::LANE_COST) < Self::CHOIR_COST + 2.0 * idle * Self::LANE_COST {
            return playing;
        }
        let mut lanes: Lanes<'_, N> = [const { None }; N];
        for (number, seat) in seats.iter_mut().enumerate().filter(|(number, _)| members >> number & 1 == 1) {
            let (Some((_, lane)), Some(voice)) = (self.places[number], seat.clarinet.single_voice()) else {
                continue;
            };
            if playing >> number & 1 == 1 {
                lanes[lane] = Some(voice);
            } else {
                self.choirs[choir].leave(lane, voice);
            }
        }
        self.choirs[choir].run(lanes);
        0
    }
}

#[cfg(test)]
mod tests;
