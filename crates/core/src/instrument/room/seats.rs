//! Several players in the room: what the left channel has sounds from the left end of their seats, what the right one has from
//! the right end. So who sits between them sounds from both, in the shares of the pan, and the room costs the same for two
//! players as for sixteen.

use super::delay_line::{DelayLine, PIECE};
use super::room_coeffs::RoomCoeffs;
use crate::dsp::glide::Glide;

/// Time in which several players sit down or one stays, s.
const SIT_S: f64 = 0.02;
/// Of two channels that have nothing in common: together they are as loud in the room as a lone player.
const SHARE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// The sounds of both ends. Real-time safe, but for `new`.
#[derive(Clone, Debug)]
pub struct Seats {
    /// From one place, 0, to two, 1.
    apart: Glide,
    ends: [DelayLine; 2],
    walls: [f32; 2],
    /// Samples until nothing of them can be heard.
    emptying: usize,
    /// The most of them.
    longest: usize,
}

impl Seats {
    /// All in one place, for delays up to `longest` samples. Allocates.
    pub fn new(longest: usize, rate_hz: f64) -> Self {
        Self {
            apart: Glide::new(0.0, SIT_S, rate_hz),
            ends: std::array::from_fn(|_| DelayLine::new(longest)),
            walls: [0.0; 2],
            emptying: 0,
            longest,
        }
    }

    /// Whether several players sit apart; `at_once` without a glide.
    pub fn set(&mut self, apart: bool, at_once: bool) {
        let apart = f32::from(u8::from(apart));
        if at_once { self.apart.set(apart) } else { self.apart.go_to(apart) }
    }

    /// Whether any sound comes from the ends.
    pub fn are_heard(&self) -> bool {
        self.emptying > 0 || !self.apart.rests_at(0.0)
    }

    /// Silence; the seats stay.
    pub fn clear(&mut self) {
        if self.emptying > 0 {
            self.ends.iter_mut().for_each(DelayLine::clear);
        }
        self.apart.set(self.apart.target());
        (self.walls, self.emptying) = ([0.0; 2], 0);
    }

    /// Takes the next samples, at most a piece, through walls with these poles, and leaves in `source` what sounds from one
    /// place.
    pub fn write(
        &mut self,
        left: &[f32],
        right: &[f32],
        source: &mut [f32],
        poles: &[f32; PIECE],
        mut door: Glide,
    ) {
        let mut ends = [[0.0; PIECE]; 2];
        let samples = source.len();
        self.emptying = match self.apart.rests_at(0.0) {
            true => self.emptying.saturating_sub(samples),
            false => self.longest,
        };
        for n in 0..samples {
            let apart = self.apart.next();
            if apart == 0.0 {
                // What the walls still hold is a thousandth of the glide's last step.
                self.walls = [0.0; 2];
                continue;
            }
            source[n] *= 1.0 - apart;
            let share = SHARE * apart * door.next();
            for ((end, wall), sound) in ends.iter_mut().zip(&mut self.walls).zip([left[n], right[n]]) {
                let x = share * sound;
                *wall = x + poles[n] * (*wall - x);
                end[n] = *wall;
            }
        }
        for (line, end) in self.ends.iter_mut().zip(&ends) {
            line.write(&end[..samples]);
        }
    }

    /// Adds what the ears hear of the images of both ends.
    pub fn hear(&self, coeffs: &RoomCoeffs, ears: &mut [[f32; PIECE]; 2], samples: usize) {
        for (line, images) in self.ends.iter().zip(&coeffs.ends) {
            for (ear, taps) in ears.iter_mut().zip(images) {
                super::room_sound::hear(line, taps, &mut ear[..samples]);
            }
        }
    }

    /// What enters the lines of the tail from each end.
    pub fn enter(&self, coeffs: &RoomCoeffs, samples: usize) -> [&[f32]; 2] {
        self.ends.each_ref().map(|line| line.read_written(coeffs.into_lines, samples))
    }
}
