//! Which bend wheel acts on the sounding note: channels and MPE zones of an instrument with one voice.
//!
//! A note follows the wheel of its own channel and that of its zone's manager. A wheel that is turned while its note is
//! held but silent is remembered, and heard when the note sounds again. Without a zone, the wheel of a channel that has
//! never played a note (that of a split keyboard) counts as a manager's. When the last key has come up its note keeps its
//! bend while it fades.
//!
//! Left out: only the instrument knows its range, so a note outside it still selects a wheel.
//! Source: MIDI Polyphonic Expression 1.0 (RP-053, 2018): MPE Configuration Message, pitch bend sensitivity of zones.

/// The bend wheel at rest.
const CENTRE: u16 = 8192;
/// Bend range of a channel and of a zone's manager, semitones, unless the usual one is set otherwise.
const RANGE: u8 = 2;
/// Bend range of a zone's members until they are told otherwise, semitones.
const MEMBER_RANGE: u8 = 48;
/// The lower zone's manager and the upper's.
const MANAGERS: [usize; 2] = [0, 15];

#[derive(Clone, Copy, Debug)]
struct Wheel {
    at: u16,
    /// Bend range; the usual one until it is told.
    semitones: Option<u8>,
    cents: u8,
    /// Whether the channel has ever played a note.
    played: bool,
}

impl Wheel {
    const NEW: Self = Self { at: CENTRE, semitones: None, cents: 0, played: false };

    /// The wheel has one step less above its centre than below; both ends reach the full range.
    fn bend_cents(self, usual: u8) -> f32 {
        let offset = f32::from(self.at) - f32::from(CENTRE);
        let steps = if offset < 0.0 { 8192.0 } else { 8191.0 };
        offset / steps * (100.0 * f32::from(self.semitones.unwrap_or(usual)) + f32::from(self.cents))
    }
}

/// Wheels and zones. Everything is real-time safe; channels are 0..=15.
///
/// `heard` is the channel of the note that sounds or sounded last, if there was one.
#[derive(Clone, Copy, Debug)]
pub struct Bends {
    wheels: [Wheel; 16],
    /// Bend range of the wheels that were not told one, semitones.
    usual: u8,
    /// Members of the lower zone (channels 1..) and of the upper (..=14).
    members: [usize; 2],
    /// Channel without notes whose wheel moved last.
    common: Option<usize>,
}

impl Default for Bends {
    fn default() -> Self {
        Self { wheels: [Wheel::NEW; 16], usual: RANGE, members: [0; 2], common: None }
    }
}

impl Bends {
    /// All wheels at rest, before any note, and the usual range. Zones and the ranges that were told stay: a controller tells them once, when it is
    /// switched on.
    #[must_use]
    pub fn at_rest(mut self) -> Self {
        for wheel in &mut self.wheels {
            (wheel.at, wheel.played) = (CENTRE, false);
        }
        Self { usual: RANGE, common: None, ..self }
    }

    /// What the wheels bend the heard note by, cents.
    pub fn cents(&self, heard: Option<usize>) -> f32 {
        let common_cents = self.common.map_or(0.0, |at| self.bend_cents(at));
        let Some(channel) = heard else { return common_cents };
        let manager_cents = match self.zone_of(channel) {
            Some(zone) if MANAGERS[zone] == channel => 0.0,
            Some(zone) => self.bend_cents(MANAGERS[zone]),
            None if self.is_common(channel) => common_cents,
            None => 0.0,
        };
        self.bend_cents(channel) + manager_cents
    }

    fn bend_cents(&self, channel: usize) -> f32 {
        self.wheels[channel].bend_cents(self.usual)
    }

    /// Whether the common wheel bends the notes of a channel outside the zones: it is another one's, and no zone's.
    fn is_common(&self, channel: usize) -> bool {
        self.common.is_some_and(|common| common != channel && self.zone_of(common).is_none())
    }

    /// The zone a channel manages or is a member of.
    fn zone_of(&self, channel: usize) -> Option<usize> {
        let [lower, upper] = self.members;
        if lower > 0 && channel <= lower {
            Some(0)
        } else {
            (upper > 0 && channel >= 15 - upper).then_some(1)
        }
    }

    /// Whether a channel is a member of a zone.
    pub fn is_member(&self, channel: usize) -> bool {
        self.zone_of(channel).is_some_and(|zone| MANAGERS[zone] != channel)
    }

    /// Whether what happens to this channel's wheel is heard now.
    pub fn is_heard(&self, channel: usize, heard: Option<usize>) -> bool {
        let Some(heard) = heard else { return self.common == Some(channel) };
        heard == channel
            || match self.zone_of(heard) {
                Some(zone) => MANAGERS[zone] == channel,
                None => self.common == Some(channel) && self.is_common(heard),
            }
    }

    /// A wheel moves, 0..=16383.
    pub fn turn(&mut self, channel: usize, at: u16) {
        self.wheels[channel].at = at.min(16383);
        if !self.wheels[channel].played && self.zone_of(channel).is_none_or(|zone| MANAGERS[zone] == channel)
        {
            self.common = Some(channel);
        }
    }

    /// Takes the zones and ranges that were told back to where they were; wheels stay.
    pub fn take_back_ranges(&mut self, before: &Self) {
        self.members = before.members;
        for (wheel, before) in self.wheels.iter_mut().zip(&before.wheels) {
            (wheel.semitones, wheel.cents) = (before.semitones, before.cents);
        }
    }

    /// A wheel goes back to rest, and with a manager's its members'.
    pub fn rest(&mut self, channel: usize) {
        self.wheels[channel].at = CENTRE;
        if let Some(zone) = self.zone_of(channel).filter(|&zone| MANAGERS[zone] == channel) {
            self.members_of(zone).for_each(|member| self.wheels[member].at = CENTRE);
        }
    }

    /// Bend range of a channel: semitones, cents, or the one left as it is. That of a zone's member is all members'.
    pub fn set_range(&mut self, channel: usize, semitones: Option<u8>, cents: Option<u8>) {
        let mut set = |channel: usize| {
            let wheel = &mut self.wheels[channel];
            wheel.semitones = semitones.or(wheel.semitones);
            wheel.cents = cents.unwrap_or(wheel.cents);
        };
        set(channel);
        if let Some(zone) = self.zone_of(channel).filter(|&zone| MANAGERS[zone] != channel) {
            self.members_of(zone).for_each(|member| {
                self.wheels[member].semitones = self.wheels[channel].semitones;
                self.wheels[member].cents = self.wheels[channel].cents;
            });
        }
    }

    /// Bend range of every channel that is not told another, and is no member of a zone, semitones.
    pub fn set_usual_range(&mut self, semitones: u8) {
        self.usual = semitones;
    }

    /// A zone is made, changed or, with no members, taken away; only the first and the last channel can manage one. The
    /// other zone gives way, and wheels of the new zone begin at rest with their default ranges.
    pub fn set_zone(&mut self, manager: usize, members: u8) {
        let Some(zone) = MANAGERS.iter().position(|&channel| channel == manager) else { return };
        for channel in std::iter::once(manager).chain(self.members_of(zone)) {
            self.wheels[channel] = Wheel { played: self.wheels[channel].played, ..Wheel::NEW };
        }
        let members = usize::from(members.min(15));
        self.members[zone] = members;
        self.members[1 - zone] = self.members[1 - zone].min(14_usize.saturating_sub(members));
        for member in self.members_of(zone) {
            let played = self.wheels[member].played;
            self.wheels[member] = Wheel { semitones: Some(MEMBER_RANGE), played, ..Wheel::NEW };
        }
        self.common = None;
    }

    fn members_of(&self, zone: usize) -> std::ops::Range<usize> {
        let members = self.members[zone];
        if zone == 0 { 1..1 + members } else { 15 - members..15 }
    }

    /// A channel plays a note: its wheel is its own from now on.
    pub fn play(&mut self, channel: usize) {
        self.wheels[channel].played = true;
        self.common = self.common.filter(|&common| common != channel);
    }
}
