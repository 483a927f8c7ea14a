//! Which FEEL goes out when: the latest wanted, never more than a hundred a second, again when it was lost.

use crate::wire::Feel;

/// Least time between two FEEL, us.
pub(crate) const LEAST_US: i64 = 10_000;

/// FEEL is sent again after this much, us, so that a knob that missed or forgot one has it.
pub(crate) const AGAIN_US: i64 = 1_000_000;

/// A FEEL that is not echoed within this much was lost, us: twenty round trips of a USB line.
const LOST_US: i64 = 100_000;

#[derive(Clone, Copy, Debug)]
struct Sent {
    feel: Feel,
    first_us: i64,
    latest_us: i64,
    is_echoed: bool,
    is_refused: bool,
}

/// See the module.
#[derive(Debug, Default)]
pub struct Feeling {
    wanted: Option<Feel>,
    sent: Option<Sent>,
    last_us: Option<i64>,
    feel_id: u8,
    /// Since when the device has echoed none of what it was sent, us.
    unechoed_us: Option<i64>,
    /// Number that STATE told last.
    echo: Option<u8>,
    /// The last one refused on this side, and why.
    unsendable: Option<(Feel, String)>,
}

/// Without the number that only the wire knows.
fn same(a: &Feel, b: &Feel) -> bool {
    Feel { feel_id: 0, ..*a } == Feel { feel_id: 0, ..*b }
}

impl Feeling {
    /// The feel wanted from now on; an error, once, if it cannot be sent, and the one before stays.
    pub fn want(&mut self, feel: Feel) -> Result<(), String> {
        if let Some((refused, _)) = &self.unsendable
            && same(refused, &feel)
        {
            return Ok(());
        }
        if let Err(reason) = feel.check() {
            let text = format!("feel not sent: {reason}");
            self.unsendable = Some((feel, text.clone()));
            return Err(text);
        }
        self.unsendable = None;
        self.wanted = Some(feel);
        Ok(())
    }

    /// The feel wanted last.
    pub fn wanted(&self) -> Option<Feel> {
        self.wanted
    }

    /// The device knows nothing any more.
    pub fn forget(&mut self) {
        (self.sent, self.unechoed_us) = (None, None);
    }

    /// How long the device has echoed none of what it was sent, us; 0 if it echoes.
    pub fn unechoed_us(&self, now_us: i64) -> i64 {
        self.unechoed_us.map_or(0, |since_us| now_us - since_us)
    }

    /// The FEEL to send now. `hears_echo`: STATE comes, so that a FEEL without an echo was lost.
    pub fn poll(&mut self, now_us: i64, hears_echo: bool) -> Option<Feel> {
        let wanted = self.wanted?;
        if self.last_us.is_some_and(|at| now_us - at < LEAST_US) {
            return None;
        }
        match &mut self.sent {
            Some(sent) if same(&sent.feel, &wanted) => {
                let waits_us = if sent.is_echoed || !hears_echo { AGAIN_US } else { LOST_US };
                if now_us - sent.latest_us < waits_us || sent.is_refused {
                    return None;
                }
                sent.latest_us = now_us;
                self.last_us = Some(now_us);
                Some(sent.feel)
            }
            _ => {
                self.feel_id = self.feel_id.wrapping_add(1);
                let feel = Feel { feel_id: self.feel_id, ..wanted };
                self.sent = Some(Sent {
                    feel,
                    first_us: now_us,
                    latest_us: now_us,
                    is_echoed: false,
                    is_refused: false,
                });
                self.last_us = Some(now_us);
                self.unechoed_us.get_or_insert(now_us);
                Some(feel)
            }
        }
    }

    /// Takes in the number STATE echoes; gives the way there and back in us when it is new.
    pub fn echoed(&mut self, feel_id: u8, now_us: i64) -> Option<i64> {
        // While notes follow each other faster than the line answers, a new number is news enough.
        if self.echo.replace(feel_id) != Some(feel_id) && self.unechoed_us.is_some() {
            self.unechoed_us = Some(now_us);
        }
        let sent = self.sent.as_mut()?;
        if sent.feel.feel_id != feel_id {
            if std::mem::take(&mut sent.is_echoed) {
                self.unechoed_us = Some(now_us); // it has forgotten what it had
            }
            return None;
        }
        self.unechoed_us = None;
        let is_news = !std::mem::replace(&mut sent.is_echoed, true);
        is_news.then(|| now_us - sent.first_us)
    }

    /// The device refused the FEEL of this number; true if that is the one it should have now.
    pub fn refused(&mut self, feel_id: u8) -> bool {
        match self.sent.as_mut().filter(|sent| sent.feel.feel_id == feel_id) {
            Some(sent) => {
                sent.is_refused = true;
                self.unechoed_us = None;
                true
            }
            None => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feel(scale_mnm: f32) -> Feel {
        Feel { scale_mnm, ..Feel::default() }
    }

    #[test]
    fn a_change_goes_out_at_once_and_the_latest_wins_at_a_hundred_a_second() {
        let mut feeling = Feeling::default();
        let mut sent = Vec::new();
        for ms in 0..1000 {
            feeling.want(feel(ms as f32 * 0.1)).unwrap();
            sent.extend(feeling.poll(ms * 1000, true).map(|feel| (ms, feel.scale_mnm)));
        }
        assert_eq!(sent.len(), 100);
        assert!(sent.iter().all(|&(ms, scale)| scale == ms as f32 * 0.1), "none is older than it need be");
    }

    #[test]
    fn what_is_echoed_comes_again_once_a_second_and_what_is_lost_sooner() {
        let mut feeling = Feeling::default();
        feeling.want(feel(1.0)).unwrap();
        let mut sent = Vec::new();
        for ms in 0..3000 {
            feeling.want(feel(1.0)).unwrap();
            if let Some(feel) = feeling.poll(ms * 1000, true) {
                sent.push((ms, feel.feel_id));
            }
            if ms == 250 {
                assert_eq!(feeling.echoed(1, ms * 1000), Some(250_000));
                assert_eq!(feeling.echoed(1, ms * 1000), None);
            }
        }
        assert_eq!(sent, [(0, 1), (100, 1), (200, 1), (1200, 1), (2200, 1)]);
    }

    #[test]
    fn what_is_refused_is_not_repeated_and_what_cannot_be_sent_is_said_once() {
        let mut feeling = Feeling::default();
        feeling.want(feel(1.0)).unwrap();
        let id = feeling.poll(0, true).unwrap().feel_id;
        assert!(feeling.refused(id) && !feeling.refused(id.wrapping_add(1)));
        assert_eq!((1..5000).filter_map(|ms| feeling.poll(ms * 1000, true)).count(), 0);
        let reason = feeling.want(feel(451.0)).unwrap_err();
        assert!(reason.contains("scale_mnm") && reason.contains("451"), "{reason}");
        assert_eq!(feeling.want(feel(451.0)), Ok(()), "once");
        feeling.want(feel(2.0)).unwrap();
        assert_eq!(feeling.poll(6_000_000, true).unwrap().scale_mnm, 2.0);
    }
}
