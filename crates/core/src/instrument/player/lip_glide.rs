//! The lip goes from note to note: resonance and damping that it gives the reed, and the numbers of the player's rule for the place of the note.
//!
//! Slurred, they move while the fingers do; a step of them is a step of the flow, which clicks. Behind the tongue they are in
//! place at once. A difficult [`slur`](super::slur), and a note that the tongue begins again while it still rings, let the lip damp the reed for a moment.

/// These count as arrived when each is this near to its target, as a share of it.
const ARRIVED: f64 = 1e-4;

use super::dynamics::AtPlace;

/// Where the lip is for a note.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoteLip {
    /// Resonance of the reed, Hz.
    pub resonance_hz: f64,
    /// Its damping.
    pub damping: f64,
    /// Place of the note.
    pub place: f64,
    /// What goes with the place.
    pub at: AtPlace,
    /// How far the resonance moves for a cent, as a share of itself.
    pub resonance_per_cent: f64,
}

/// Of the numbers of a [`NoteLip`], what is added to the closing pressure between the softest and the loudest dynamic.
const AT_BETWEEN: usize = 3;
/// Of these, what is added to the closing pressure at every dynamic.
const AT_ALWAYS: usize = 4;

impl NoteLip {
    fn numbers(self) -> [f64; 9] {
        let Self { resonance_hz, damping, place, at: [between, always, zeta, growth, altissimo], .. } = self;
        [resonance_hz, damping, place, between, always, zeta, growth, altissimo, self.resonance_per_cent]
    }

    fn of([resonance_hz, damping, place, at @ .., resonance_per_cent]: [f64; 9]) -> Self {
        Self { resonance_hz, damping, place, at, resonance_per_cent }
    }
}

/// The lip damps the reed for a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipHelp {
    /// Factor on the damping of the reed.
    pub damping: f64,
    /// For how long, s.
    pub length_s: f64,
}

/// The lip on its way.
#[derive(Clone, Copy, Debug, Default)]
pub struct LipGlide {
    now: Option<NoteLip>,
    /// Where its closing goes, [`AT_BETWEEN`] and [`AT_ALWAYS`]: it gathers speed.
    ahead: [f64; 2],
    /// Its help, for as long as is left.
    help: Option<LipHelp>,
}

impl LipGlide {
    /// The lip helps a slur, or a note behind the tongue from now until so long after the tongue; `None` ends any help.
    pub fn help(&mut self, help: Option<LipHelp>) {
        self.help = help;
    }

    /// Moves towards a note by a `share` of the way in a tick of `tick_s` seconds, or is there `at_once`. Real-time safe.
    pub fn tick(
        &mut self,
        mut target: NoteLip,
        at_once: bool,
        (share, slow): (f64, f64),
        tick_s: f64,
    ) -> NoteLip {
        if let Some(help) = self.help.as_mut().filter(|help| help.length_s > 0.0) {
            if !at_once {
                help.length_s -= tick_s;
            }
            target.damping *= help.damping;
        }
        let now = match self.now {
            Some(now) if !at_once && now != target => {
                let mut next = now.numbers();
                let mut arrived = true;
                for (n, (next, target)) in next.iter_mut().zip(target.numbers()).enumerate() {
                    // A lip that closes for the topmost notes is there as soon as the fingers: half of the slurs to these have holes of 13 dB and more
                    // if it takes its time, and of 4.5 dB so. Back from there, holes are shallower if it does.
                    if n == AT_BETWEEN || (n == AT_ALWAYS && target > *next) {
                        let ahead = &mut self.ahead[n - AT_BETWEEN];
                        *ahead += (target - *ahead) * slow;
                        *next += (*ahead - *next) * slow;
                    } else {
                        *next += (target - *next) * share;
                        if n == AT_ALWAYS {
                            self.ahead[n - AT_BETWEEN] = *next;
                        }
                    }
                    arrived &= (target - *next).abs() <= ARRIVED * target.abs().max(1.0);
                }
                if arrived { target } else { NoteLip::of(next) }
            }
            _ => {
                let [between, always, ..] = target.at;
                self.ahead = [between, always];
                target
            }
        };
        self.now = Some(now);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_damps_the_reed_for_a_while_and_then_leaves_it_as_it_was() {
        const TICK_S: f64 = 1.0 / 6_000.0;
        let target = NoteLip::of([1_500.0, 0.8, -0.5, -0.1, 0.0, -1.3, 0.1, 0.0, 0.03]);
        assert_eq!(NoteLip::of(target.numbers()), target);
        let mut lip = LipGlide::default();
        assert_eq!(lip.tick(target, true, (0.05, 0.05), TICK_S), target);
        lip.help(Some(LipHelp { damping: 1.5, length_s: 0.02 }));
        let helped: Vec<f64> =
            (0..600).map(|_| lip.tick(target, false, (0.05, 0.05), TICK_S).damping).collect();
        let most = helped.iter().copied().fold(0.0, f64::max);
        assert!((1.19..=1.2).contains(&most), "{most}");
        assert!(helped[119] > 1.19 && helped[123] < helped[119], "20 ms");
        assert_eq!(helped[599], 0.8);
        lip.help(Some(LipHelp { damping: 1.5, length_s: 0.02 }));
        (0..600).for_each(|_| assert_eq!(lip.tick(target, true, (0.05, 0.05), TICK_S).damping, 0.8 * 1.5));
        assert_eq!(
            lip.tick(target, false, (0.05, 0.05), TICK_S).damping,
            0.8 * 1.5,
            "it lasts until after the tongue"
        );
        lip.help(None);
        assert_eq!(lip.tick(target, true, (0.05, 0.05), TICK_S), target);
    }
}
