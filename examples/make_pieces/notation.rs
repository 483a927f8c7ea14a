//! Music as a player reads it: written pitches, lengths, slurs, techniques, and phrases under one breath.
//!
//! Lengths are in ticks of the MIDI file. Pitches are MIDI numbers of written notes: written C4 is 60 on every instrument.

pub const TICKS_PER_QUARTER: u16 = 480;
pub const QUARTER: u32 = TICKS_PER_QUARTER as u32;
pub const SIXTEENTH: u32 = QUARTER / 4;
pub const EIGHTH: u32 = QUARTER / 2;
pub const DOTTED_EIGHTH: u32 = EIGHTH + SIXTEENTH;
pub const DOTTED_QUARTER: u32 = QUARTER + EIGHTH;
pub const HALF: u32 = 2 * QUARTER;

/// Written pitches. S is sharp.
pub mod pitch {
    pub const E3: u8 = 52;
    pub const FS3: u8 = 54;
    pub const G3: u8 = 55;
    pub const GS3: u8 = 56;
    pub const A3: u8 = 57;
    pub const AS3: u8 = 58;
    pub const B3: u8 = 59;
    pub const C4: u8 = 60;
    pub const CS4: u8 = 61;
    pub const D4: u8 = 62;
    pub const DS4: u8 = 63;
    pub const E4: u8 = 64;
    pub const F4: u8 = 65;
    pub const FS4: u8 = 66;
    pub const G4: u8 = 67;
    pub const GS4: u8 = 68;
    pub const A4: u8 = 69;
    pub const B4: u8 = 71;
    pub const C5: u8 = 72;
    pub const D5: u8 = 74;
    pub const E5: u8 = 76;
    pub const FS5: u8 = 78;
    pub const G5: u8 = 79;
    pub const A5: u8 = 81;
    pub const AS5: u8 = 82;
    pub const B5: u8 = 83;
    pub const C6: u8 = 84;
    pub const D6: u8 = 86;
    pub const DS6: u8 = 87;
    pub const E6: u8 = 88;
    pub const F6: u8 = 89;
    pub const FS6: u8 = 90;
    pub const G6: u8 = 91;
}

/// How a note meets the next one.
#[derive(Clone, Copy, PartialEq)]
pub enum Joint {
    /// The next note follows without the tongue.
    Slurred,
    /// The next note is tongued.
    Tongued,
    /// The tongue ends this note after a share of its length.
    Staccato(f64),
}

/// What a player does with a note, as controller values. 0 is nothing.
#[derive(Clone, Copy, Default)]
pub struct Techniques {
    pub vibrato: u8,
    pub growl: u8,
    /// The fingers slide into this note; it is slurred from the note before.
    pub glissando: u8,
    /// The note begins below its pitch; it is tongued.
    pub scoop: u8,
    /// The note falls when its key comes up; it is the last of its phrase.
    pub fall: u8,
}

#[derive(Clone, Copy)]
pub struct Note {
    pub written: u8,
    pub ticks: u32,
    pub joint: Joint,
    /// Breath of this note over the breath of its phrase there.
    pub weight: f64,
    pub techniques: Techniques,
}

/// A note with a slur to the next.
pub fn slurred(written: u8, ticks: u32) -> Note {
    Note { written, ticks, joint: Joint::Slurred, weight: 1.0, techniques: Techniques::default() }
}

/// A note whose successor is tongued.
pub fn tongued(written: u8, ticks: u32) -> Note {
    Note { joint: Joint::Tongued, ..slurred(written, ticks) }
}

/// A note that ends after a share of its length.
pub fn staccato(written: u8, ticks: u32, share: f64) -> Note {
    Note { joint: Joint::Staccato(share), ..slurred(written, ticks) }
}

impl Note {
    pub fn weight(self, weight: f64) -> Self {
        Self { weight, ..self }
    }

    pub fn vibrato(mut self, value: u8) -> Self {
        self.techniques.vibrato = value;
        self
    }

    pub fn growl(mut self, value: u8) -> Self {
        self.techniques.growl = value;
        self
    }

    pub fn glissando(mut self, value: u8) -> Self {
        self.techniques.glissando = value;
        self
    }

    pub fn scoop(mut self, value: u8) -> Self {
        self.techniques.scoop = value;
        self
    }

    pub fn fall(mut self, value: u8) -> Self {
        self.techniques.fall = value;
        self
    }
}

/// Notes under one breath.
pub struct Phrase {
    /// Rest before the first note.
    pub rest: u32,
    pub notes: Vec<Note>,
    /// From the first note to the first beat with weight.
    pub upbeat: u32,
    /// Breath over full breath at the beginning, the height and the end.
    pub swell: [f64; 3],
    /// Where on the way (0..1) the height lies.
    pub height_at: f64,
}

impl Phrase {
    pub fn ticks(&self) -> u32 {
        self.notes.iter().map(|note| note.ticks).sum()
    }
}
