//! The room as a box: its measures, who stands where, the images of the player, and the level of the reverberant field.
//!
//! Sources: Allen & Berkley (1979) for the images; Kuttruff, Room Acoustics, for the laws of Sabine and Eyring and the
//! critical distance `sqrt(A / 16 pi)`.

use std::f64::consts::{LN_10, PI};

use super::Room;
use crate::maths;
use crate::units::Air;

/// Images of order 1 (6) and 2 (18).
pub const IMAGES: usize = 24;
/// Width over length. Rooms in which music is played have 0.4 (shoebox halls) to 0.9 (chambers).
const WIDTH: f64 = 0.7;
/// Height: `HEIGHT_M + RISE * length`, so that one can stand in the smallest and the largest is a hall.
const HEIGHT_M: f64 = 2.0;
const RISE: f64 = 0.25;
/// Where player and listener are, over length and width; not in the middle, where images coincide.
const PLAYER: [f64; 2] = [0.25, 0.45];
const LISTENER: [f64; 2] = [0.5, 0.55];
/// How far to either side of the player several players sit at most, over the width: nobody sits in a wall, and from where the
/// listener is the outermost are 45 degrees to the side, as the pan has them.
const SEATS: f64 = 0.35;
/// Heights of the middle of a clarinet and of ears, of people who sit, m.
const PLAYER_M: f64 = 0.9;
const LISTENER_M: f64 = 1.2;
/// Half the distance between two ears, m.
const EAR_M: f64 = 0.09;

/// A box with player and listener.
#[derive(Clone, Copy, Debug)]
pub struct Shoebox {
    /// Length, width and height, m.
    size_m: [f64; 3],
    decay_s: f64,
    sound_m_s: f64,
}

/// An image of the player, as one ear hears it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Image {
    /// Time after the direct sound, s.
    pub delay_s: f64,
    /// Amplitude over that of the direct sound.
    pub gain: f64,
}

impl Shoebox {
    /// The room of these settings, which must be clamped.
    pub fn new(room: &Room) -> Self {
        let length = f64::from(room.size_m);
        Self {
            size_m: [length, WIDTH * length, HEIGHT_M + RISE * length],
            decay_s: f64::from(room.decay_s),
            sound_m_s: Air::default().c,
        }
    }

    fn volume_m3(&self) -> f64 {
        self.size_m.iter().product()
    }

    fn surface_m2(&self) -> f64 {
        let [x, y, z] = self.size_m;
        2.0 * (x * y + y * z + z * x)
    }

    /// Mean time between two reflections in a diffuse field, s: `4 V / (S c)`.
    pub fn mean_free_s(&self) -> f64 {
        4.0 * self.volume_m3() / (self.surface_m2() * self.sound_m_s)
    }

    /// Absorption area that makes a decay so long, m2 (Sabine).
    fn absorption_m2(&self, decay_s: f64) -> f64 {
        24.0 * LN_10 * self.volume_m3() / (self.sound_m_s * decay_s)
    }

    /// Amplitude that a wall reflects where the decay is so long (Eyring).
    pub fn reflection(&self, decay_s: f64) -> f64 {
        maths::exp(-0.5 * self.absorption_m2(decay_s) / self.surface_m2())
    }

    /// Energy of all reflections over that of the direct sound: the square of the distance over the critical distance.
    pub fn reverberant_energy(&self) -> f64 {
        let distance = self.distance_m(self.player(), self.listener());
        16.0 * PI * distance * distance / self.absorption_m2(self.decay_s)
    }

    fn player(&self) -> [f64; 3] {
        [PLAYER[0] * self.size_m[0], PLAYER[1] * self.size_m[1], PLAYER_M]
    }

    fn listener(&self) -> [f64; 3] {
        [LISTENER[0] * self.size_m[0], LISTENER[1] * self.size_m[1], LISTENER_M]
    }

    fn distance_m(&self, from: [f64; 3], to: [f64; 3]) -> f64 {
        (0..3).map(|axis| (from[axis] - to[axis]).powi(2)).sum::<f64>().sqrt()
    }

    /// All images up to order 2 at the left (`side` -1) or right (1) ear of a listener who looks at the player.
    pub fn images(&self, side: f64) -> [Image; IMAGES] {
        self.images_of(self.player(), side)
    }

    /// The same for who sits at the left (`end` -1) or right (1) end of several players.
    pub fn images_of_end(&self, end: f64, side: f64) -> [Image; IMAGES] {
        let [along, across, up] = self.player();
        self.images_of([along, across + end * SEATS * self.size_m[1], up], side)
    }

    fn images_of(&self, player: [f64; 3], side: f64) -> [Image; IMAGES] {
        let mut ear = self.listener();
        let direct = self.distance_m(player, ear);
        // All are as loud, wherever they sit.
        let usual = self.distance_m(self.player(), ear);
        // The listener looks along the length, towards smaller x.
        ear[1] += side * EAR_M;
        let reflection = self.reflection(self.decay_s);
        let mut images = [Image::default(); IMAGES];
        let cells = (-2..=2).flat_map(|x| (-2..=2).flat_map(move |y| (-2..=2).map(move |z| [x, y, z])));
        let near = cells.filter(|cell: &[i32; 3]| (1..=2).contains(&order(cell)));
        for (image, cell) in images.iter_mut().zip(near) {
            let place = std::array::from_fn(|axis| mirrored(player[axis], self.size_m[axis], cell[axis]));
            let way = self.distance_m(place, ear);
            // An ear may be nearer than the middle of the head, but no reflection comes before the direct sound.
            image.delay_s = (way - direct).max(0.0) / self.sound_m_s;
            image.gain = usual / way * reflection.powi(order(&cell));
        }
        images
    }
}

/// Reflections on the way from an image.
fn order(cell: &[i32; 3]) -> i32 {
    cell.iter().map(|n| n.abs()).sum()
}

/// Where a point is after `n` reflections in one direction.
fn mirrored(x: f64, size: f64, n: i32) -> f64 {
    f64::from(n) * size + if n % 2 == 0 { x } else { size - x }
}
