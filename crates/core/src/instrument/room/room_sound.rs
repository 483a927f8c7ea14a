//! The sound in the room. Everything is done in pieces, line by line, in plain loops that vectorise; each sample comes from
//! the same sums whatever the pieces are.

use super::Room;
use super::delay_line::{DelayLine, PIECE};
use super::room_coeffs::{LINES, LONGEST_EARLY_S, RoomCoeffs, Tap};
use super::seats::Seats;
use crate::dsp::glide::Glide;
use crate::dsp::smooth::smooth_single;

/// Time that a change of the amount takes, s.
const AMOUNT_S: f64 = 0.02;
/// Time in which one room fades into another, s: longer than the period of the lowest notes.
const FADE_S: f64 = 0.05;
/// Samples up to this magnitude are silence, as for the instrument: -120 dBFS.
const SILENCE: f32 = 1e-6;
/// Decibels by which the tail decays until it is silence: from full scale, and a room can be 20 dB louder than the direct sound.
const TAIL_DB: f64 = 140.0;

type Piece = [f32; PIECE];

/// A room with what sounds in it. Real-time safe, but for `new`.
///
/// ```
/// use chalumeau_core::instrument::room::{Room, RoomSound};
///
/// let mut room = RoomSound::new(48_000.0);
/// room.set(&Room { amount: 0.5, ..Room::default() });
/// let (mut left, mut right) = (vec![0.0; 9_600], vec![0.0; 9_600]);
/// (left[0], right[0]) = (1.0, 1.0);
/// room.add(&mut left, &mut right);
/// assert_eq!(left[0], 1.0);
/// assert!(left[4_800..].iter().any(|sample| *sample != 0.0));
/// ```
#[derive(Clone, Debug)]
pub struct RoomSound {
    rate_hz: f64,
    wanted: Room,
    chosen: Room,
    amount: Glide,
    /// How far the door to the instrument is open: a room that is switched on during a note hears it fade in.
    door: Glide,
    /// Nothing has passed since the start.
    fresh: bool,
    now: Listener,
    before: Listener,
    /// Samples until the former room is gone.
    fading: usize,
    fade: usize,
    /// What has left the instrument, less what a wall takes.
    source: DelayLine,
    wall: f32,
    /// The same from the seats of several players.
    seats: Seats,
    lines: [DelayLine; LINES],
    heard: Box<Heard>,
    heard_before: Box<Heard>,
    /// Samples of silence so far.
    quiet: usize,
    /// Nothing sounds, and the delays are empty.
    asleep: bool,
}

/// What hears the delays in the way of one room.
#[derive(Clone, Debug)]
struct Listener {
    coeffs: RoomCoeffs,
    /// States of the lines' filters.
    filters: [f32; LINES],
}

/// What is heard in one piece: the images at the ears, what comes out of the lines, and what goes in.
#[derive(Clone, Debug)]
struct Heard {
    ears: [Piece; 2],
    lines: [Piece; LINES],
    into: Piece,
    /// What goes in from the left and from the right end of several players, into every other line.
    ends_into: [Piece; 2],
}

impl Default for Heard {
    fn default() -> Self {
        Self {
            ears: [[0.0; PIECE]; 2],
            lines: [[0.0; PIECE]; LINES],
            into: [0.0; PIECE],
            ends_into: [[0.0; PIECE]; 2],
        }
    }
}

impl RoomSound {
    /// No room, at a sample rate. Allocates.
    pub fn new(rate_hz: f64) -> Self {
        let room = Room::default();
        let listener = Listener { coeffs: RoomCoeffs::new(&room, rate_hz), filters: [0.0; LINES] };
        let early = (LONGEST_EARLY_S * rate_hz) as usize + PIECE;
        Self {
            rate_hz,
            wanted: room,
            chosen: room,
            amount: Glide::new(0.0, AMOUNT_S, rate_hz),
            door: Glide::new(1.0, AMOUNT_S, rate_hz),
            fresh: true,
            before: listener.clone(),
            now: listener,
            fading: 0,
            fade: ((FADE_S * rate_hz) as usize).max(1),
            source: DelayLine::new(early),
            wall: 0.0,
            seats: Seats::new(early, rate_hz),
            lines: std::array::from_fn(|_| DelayLine::new(RoomCoeffs::longest_line(rate_hz))),
            heard: Box::default(),
            heard_before: Box::default(),
            quiet: 0,
            asleep: true,
        }
    }

    /// Another room from the next sample on, clamped. What sounds goes on in it.
    pub fn set(&mut self, room: &Room) {
        let was_on = self.is_on();
        self.wanted = room.clamped();
        if !was_on && !self.fresh {
            self.door.set(0.0);
            self.door.go_to(1.0);
        }
        if self.asleep {
            self.amount.set(self.wanted.amount);
        } else {
            self.amount.go_to(self.wanted.amount);
        }
    }

    /// Whether the two channels sound from two places, as several players do who sit apart, or together from one.
    pub fn set_apart(&mut self, apart: bool) {
        self.seats.set(apart, self.asleep);
    }

    /// Whether anything is added: otherwise [`add`](Self::add) costs nothing.
    pub fn is_on(&self) -> bool {
        !self.amount.rests_at(0.0)
    }

    /// Whether nothing sounds in the room.
    pub fn is_silent(&self) -> bool {
        self.asleep
    }

    /// Longest time for which the room sounds after the instrument, s.
    pub fn tail_s(&self) -> f64 {
        if !self.is_on() {
            return 0.0;
        }
        f64::from(self.wanted.decay_s) * TAIL_DB / 60.0 + 2.0 * LONGEST_EARLY_S
    }

    /// Empties the room; the settings stay.
    pub fn reset(&mut self) {
        self.amount.set(self.wanted.amount);
        self.door.set(1.0);
        self.fresh = true;
        self.sleep();
    }

    fn sleep(&mut self) {
        if !self.asleep {
            self.source.clear();
            self.lines.iter_mut().for_each(DelayLine::clear);
            self.seats.clear();
            self.now.filters = [0.0; LINES];
            self.before.filters = [0.0; LINES];
        }
        (self.wall, self.quiet, self.fading, self.asleep) = (0.0, 0, 0, true);
    }

    /// Adds the room's sound to two channels of the same length, which sound in it together. Returns for how many samples
    /// the room was on.
    pub fn add(&mut self, left: &mut [f32], right: &mut [f32]) -> usize {
        self.fresh &= left.is_empty();
        let mut done = 0;
        while done < left.len() {
            if !self.is_on() {
                self.sleep();
                return done;
            }
            if self.asleep {
                let is_loud = |(l, r): (&f32, &f32)| l.abs() > SILENCE || r.abs() > SILENCE;
                let Some(from) = left[done..].iter().zip(&right[done..]).position(is_loud) else {
                    return left.len();
                };
                done += from;
            }
            self.change();
            let shortest = self.now.coeffs.delays[0].min(self.before.coeffs.delays[0]);
            let mut samples = PIECE.min(left.len() - done).min(shortest);
            if self.fading > 0 {
                samples = samples.min(self.fading);
            }
            // The amount may arrive at 0, and the silence be long enough, within a piece: each ends one.
            samples = samples.min(self.patience().saturating_sub(self.quiet).max(1)).min(self.amount.reach());
            self.piece(&mut left[done..done + samples], &mut right[done..done + samples]);
            done += samples;
        }
        done
    }

    /// Samples of silence after which all delays are silent.
    fn patience(&self) -> usize {
        self.now.coeffs.reach.max(self.before.coeffs.reach) + 1
    }

    /// Begins to fade into the room that is wanted.
    fn change(&mut self) {
        let same = Room { amount: self.wanted.amount, ..self.chosen } == self.wanted;
        if self.fading > 0 || same {
            return;
        }
        self.chosen = self.wanted;
        self.before = self.now.clone();
        self.now.coeffs = RoomCoeffs::new(&self.wanted, self.rate_hz);
        if self.asleep {
            self.before.coeffs = self.now.coeffs;
        } else {
            self.fading = self.fade;
        }
        self.quiet = 0;
    }

    /// At most [`PIECE`] samples, at most as many as the shortest line has.
    fn piece(&mut self, left: &mut [f32], right: &mut [f32]) {
        self.asleep = false;
        let samples = left.len();
        let weights = if self.fading > 0 { self.weights() } else { [1.0; PIECE] };
        let mut source: Piece = [0.0; PIECE];
        for n in 0..samples {
            source[n] = 0.5 * (left[n] + right[n]);
        }
        let door = self.door;
        if !self.door.rests_at(1.0) {
            source[..samples].iter_mut().for_each(|x| *x *= self.door.next());
        }
        let (new, old) = (self.now.coeffs.wall_pole, self.before.coeffs.wall_pole);
        let poles = weights.map(|weight| old + weight * (new - old));
        let has_seats = self.seats.are_heard();
        if has_seats {
            self.seats.write(left, right, &mut source[..samples], &poles, door);
        }
        let mut y = self.wall;
        for (x, pole) in source[..samples].iter_mut().zip(&poles) {
            y = *x + pole * (y - *x);
            *x = y;
        }
        self.wall = y;
        self.source.write(&source[..samples]);
        let seats = has_seats.then_some(&self.seats);

        let heard = &mut *self.heard;
        self.now.hear(&self.source, seats, &self.lines, samples, heard);
        let mut gains = [self.now.coeffs.late; PIECE];
        if self.fading > 0 {
            let before = &mut *self.heard_before;
            self.before.hear(&self.source, seats, &self.lines, samples, before);
            mix(&mut heard.into, &before.into, &weights);
            heard.ends_into.iter_mut().zip(&before.ends_into).for_each(|(new, old)| mix(new, old, &weights));
            heard.ears.iter_mut().zip(&before.ears).for_each(|(new, old)| mix(new, old, &weights));
            heard.lines.iter_mut().zip(&before.lines).for_each(|(new, old)| mix(new, old, &weights));
            mix(&mut gains, &[self.before.coeffs.late; PIECE], &weights);
            self.fading -= samples;
            if self.fading == 0 {
                self.before.coeffs = self.now.coeffs;
            }
        }

        scatter(heard, &gains);
        if has_seats {
            enter_from_seats(heard);
        }
        for (line, row) in self.lines.iter_mut().zip(&heard.lines) {
            line.write(&row[..samples]);
        }
        self.finish(left, right);
    }

    /// How much of the new room there is, sample by sample, without a kink at either end.
    fn weights(&self) -> Piece {
        let done = self.fade - self.fading;
        std::array::from_fn(|n| smooth_single((done + n + 1) as f32 / self.fade as f32))
    }

    /// Adds what the ears hear, and counts the silence.
    fn finish(&mut self, left: &mut [f32], right: &mut [f32]) {
        let samples = left.len();
        let [ear_left, ear_right] = &self.heard.ears;
        let (ear_left, ear_right) = (&ear_left[..samples], &ear_right[..samples]);
        let loud = |sound: &[f32]| sound.iter().rposition(|x| x.abs() > SILENCE);
        let last = [&*left, &*right, ear_left, ear_right].into_iter().find_map(|sound| {
            // Usually the last sample already is loud.
            sound.last().is_some_and(|x| x.abs() > SILENCE).then_some(samples - 1)
        });
        let last = last.or_else(|| [&*left, &*right, ear_left, ear_right].into_iter().filter_map(loud).max());
        self.quiet = last.map_or(self.quiet + samples, |last| samples - 1 - last);
        if self.amount.reach() == usize::MAX {
            let amount = self.amount.next();
            left.iter_mut().zip(ear_left).for_each(|(out, ear)| *out += amount * ear);
            right.iter_mut().zip(ear_right).for_each(|(out, ear)| *out += amount * ear);
        } else {
            for n in 0..samples {
                let amount = self.amount.next();
                left[n] += amount * ear_left[n];
                right[n] += amount * ear_right[n];
            }
        }
        if self.quiet >= self.patience() {
            self.sleep();
        }
    }
}

impl Listener {
    /// What the ears hear of the images, what comes out of the lines, and what goes in. Beyond `samples` it has no meaning.
    fn hear(
        &mut self,
        source: &DelayLine,
        seats: Option<&Seats>,
        lines: &[DelayLine; LINES],
        samples: usize,
        heard: &mut Heard,
    ) {
        let Self { coeffs, filters } = self;
        for (ear, taps) in heard.ears.iter_mut().zip(&coeffs.early) {
            // To -0 anything may be added without a change, even -0.
            ear[..samples].fill(-0.0);
            hear(source, taps, &mut ear[..samples]);
        }
        heard.into[..samples].copy_from_slice(source.read_written(coeffs.into_lines, samples));
        if let Some(seats) = seats {
            seats.hear(coeffs, &mut heard.ears, samples);
            for (own, entering) in heard.ends_into.iter_mut().zip(seats.enter(coeffs, samples)) {
                own[..samples].copy_from_slice(entering);
            }
        }
        for (line, row) in heard.lines.iter_mut().enumerate() {
            let (loss, mut y) = (coeffs.losses[line], filters[line]);
            let arriving = lines[line].read(coeffs.delays[line], samples);
            // What does not wait for the sample before it vectorises in a loop of its own.
            let row = &mut row[..samples];
            row.iter_mut().zip(arriving).for_each(|(out, x)| *out = loss.gain * x);
            let (chunks, rest) = row.as_chunks_mut::<8>();
            let mut pass = |x: &mut f32| {
                y = loss.pole * y + *x;
                *x = y;
            };
            for chunk in chunks {
                chunk.iter_mut().for_each(&mut pass);
            }
            rest.iter_mut().for_each(pass);
            filters[line] = y;
        }
    }
}

/// Adds what an ear hears of images.
#[inline(always)]
pub(super) fn hear(source: &DelayLine, taps: &[Tap], ear: &mut [f32]) {
    let samples = ear.len();
    for taps in taps.as_chunks::<8>().0 {
        let [a, b, c, d, e, f, g, h] = taps.map(|tap| source.read_written(tap.delay, samples));
        let [p, q, r, s, t, u, v, w] = taps.map(|tap| tap.gain);
        let first = a.iter().zip(b).zip(c.iter().zip(d));
        let second = e.iter().zip(f).zip(g.iter().zip(h));
        for (ear, (((a, b), (c, d)), ((e, f), (g, h)))) in ear.iter_mut().zip(first.zip(second)) {
            // In two sums of four.
            *ear = *ear + (p * a + q * b + r * c + s * d) + (t * e + u * f + v * g + w * h);
        }
    }
}

/// Where `weights` is 1 it is the new sound, where it is 0 the old one.
fn mix(new: &mut Piece, old: &Piece, weights: &Piece) {
    for n in 0..PIECE {
        new[n] = old[n] + weights[n] * (new[n] - old[n]);
    }
}

/// What comes from the left and the right end of the seats joins every other line: as much energy as joins all lines from one
/// place.
fn enter_from_seats(heard: &mut Heard) {
    for (row, line) in heard.lines.iter_mut().enumerate() {
        for (line, into) in line.iter_mut().zip(&heard.ends_into[row % 2]) {
            *line += 0.25 * std::f32::consts::SQRT_2 * into;
        }
    }
}

/// The Hadamard matrix: each line goes into all, with equal power. What comes out of its rows 5 and 10 is heard by the ears,
/// any two rows but the first, which is all in phase; then the new sound joins all of them. Two stages at a time.
fn scatter(heard: &mut Heard, gains: &Piece) {
    let Heard { ears: [left, right], lines, into, .. } = heard;
    for quad in lines.as_chunks_mut::<4>().0 {
        let [a, b, c, d] = quad;
        for n in 0..PIECE {
            let (e, f, g, h) = (a[n] + b[n], a[n] - b[n], c[n] + d[n], c[n] - d[n]);
            (a[n], b[n], c[n], d[n]) = (e + g, f + h, e - g, f - h);
        }
    }
    for n in 0..PIECE {
        left[n] += gains[n] * ((lines[1][n] - lines[5][n]) + (lines[9][n] - lines[13][n]));
        right[n] += gains[n] * ((lines[2][n] + lines[6][n]) - (lines[10][n] + lines[14][n]));
    }
    // 1 / sqrt(LINES), so that the matrix keeps the energy, and the sound enters with energy 1.
    let joined = |row: f32, into: f32| 0.25 * (row + into);
    for first in 0..4 {
        let Ok([a, b, c, d]) = lines.get_disjoint_mut([first, first + 4, first + 8, first + 12]) else {
            continue;
        };
        for n in 0..PIECE {
            let (e, f, g, h) = (a[n] + b[n], a[n] - b[n], c[n] + d[n], c[n] - d[n]);
            (a[n], b[n]) = (joined(e + g, into[n]), joined(f + h, into[n]));
            (c[n], d[n]) = (joined(e - g, into[n]), joined(f - h, into[n]));
        }
    }
}
