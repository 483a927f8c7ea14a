use crate::dsp::white::White;
use crate::event::{Event, PartEvent, SettingNumber, Technique, To};
use crate::instrument::{
    BreathResponse, Channels, Ensemble, Listening, ListeningMode, Players, Settings, Split,
};
use crate::units::SoundingNote;

const RATE_HZ: f64 = 48_000.0;
/// Most samples between two events.
const MOST: usize = 16;

/// Numbers in 0..1, of which each seed gives others.
struct Chance(White);

impl Chance {
    fn unit(&mut self) -> f32 {
        (self.0.next() / 3.0_f64.sqrt() * 0.5 + 0.5) as f32
    }

    fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f32) as usize % count
    }
}

fn settings(chance: &mut Chance) -> Settings {
    let mut settings = Settings::default();
    let counts = [1, 2, 4, 6, 8, 8, 9, 13, 14, 16, 16, 16];
    settings.players = Players {
        count: counts[chance.below(counts.len())],
        split: if chance.below(2) == 0 { Split::Unison } else { Split::Chords },
        spread_cents: 25.0 * chance.unit(),
        onset_spread_ms: (90.0 * chance.unit() - 30.0).max(0.0),
        width: chance.unit(),
    };
    settings.listening = Listening {
        mode: [ListeningMode::Everywhere, ListeningMode::Position, ListeningMode::Point][chance.below(3)],
        distance_m: 0.3 + 3.0 * chance.unit(),
        width_deg: 120.0 * chance.unit(),
        ..Listening::default()
    };
    if chance.below(4) == 0 {
        settings.breath_response = BreathResponse::Physical;
    }
    settings.noise = chance.unit();
    settings.lay = chance.unit();
    settings.articulation.key_sounds = (chance.unit() - 0.5).max(0.0);
    settings.tract.amount = (2.0 * chance.unit() - 1.0).max(0.0);
    settings.glissando_s = (chance.unit() - 0.7).max(0.0);
    settings
}

fn event(chance: &mut Chance) -> PartEvent {
    let key = SoundingNote(50 + chance.below(40) as u8);
    let numbers = [
        SettingNumber::Zeta,
        SettingNumber::Damping,
        SettingNumber::Noise,
        SettingNumber::Lip,
        SettingNumber::VentLoss,
        SettingNumber::ListeningAngleDeg,
        SettingNumber::Flutter,
    ];
    let event = match chance.below(40) {
        0..=13 => Event::NoteOn { note: key, velocity: chance.unit() },
        14..=22 => Event::NoteOff { note: key },
        23..=25 => Event::Breath(chance.unit()),
        26 if chance.below(2) == 0 => Event::KeyPressure(chance.unit()),
        26 => Event::BreathFromKeys,
        27 => Event::Bend { cents: 200.0 * chance.unit() - 100.0 },
        28 if chance.below(8) == 0 => Event::Bend { cents: 2_400.0 * chance.unit() - 1_200.0 },
        28 => Event::Bend { cents: 0.0 },
        29 => Event::TongueSlap { strength: chance.unit() },
        30 => Event::Choke { note: key },
        31 => Event::Technique { which: Technique::Growl, amount: chance.unit() },
        32 => Event::Technique { which: Technique::Subtone, amount: chance.unit() },
        33 => Event::Hole { hole: chance.below(30) as u8, opening: Some(2.0 * chance.unit() - 0.5) },
        34 => Event::Hole { hole: chance.below(30) as u8, opening: None },
        35 => Event::Reed { h: 0.8 + 0.4 * chance.unit(), k: 0.8 + 0.4 * chance.unit() },
        36 => Event::Vibrato(chance.unit()),
        37 => Event::Volume { gain: chance.unit() },
        38 if chance.below(16) == 0 => Event::Panic,
        38 => Event::Pan { position: 2.0 * chance.unit() - 1.0 },
        _ => Event::Set(numbers[chance.below(numbers.len())], chance.unit()),
    };
    let to = if chance.below(8) == 0 { To::All } else { To::Player(chance.below(16) as u8) };
    PartEvent { to, event }
}

/// Plays the same random events in choirs and alone, and compares all bits. How many players have joined a choir and left one.
fn compare(seed: u64, events: usize, mut choirs: Ensemble) -> usize {
    let mut alone = Ensemble::built_in(RATE_HZ).unwrap();
    alone.section.disband();
    let mut chance = Chance(White::new(seed));
    let (mut changes, mut heard) = (0, 0.0);
    let mut places = choirs.section.places();
    let mut play = |choirs: &mut Ensemble, alone: &mut Ensemble, samples: usize, is_stereo: bool| {
        let [mut a, mut b, mut c, mut d] = [[0.0_f32; 4_096]; 4];
        let (a, b, c, d) = (&mut a[..samples], &mut b[..samples], &mut c[..samples], &mut d[..samples]);
        if is_stereo {
            choirs.render_channels(Channels::two(a, b));
            alone.render_channels(Channels::two(c, d));
        } else {
            choirs.render(a);
            alone.render(c);
        }
        let same = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        let now = choirs.section.places();
        changes += now.iter().zip(&places).filter(|(now, before)| now != before).count();
        places = now;
        heard += a.iter().map(|x| f64::from(x * x)).sum::<f64>();
        same(a, c) && same(b, d) && choirs.awake() == alone.awake()
    };
    let mut is_stereo = true;
    for number in 0..events {
        if number % 500 == 0 {
            let settings = settings(&mut chance);
            choirs.set_settings(&settings);
            alone.set_settings(&settings);
            is_stereo = chance.below(4) > 0;
        }
        let event = event(&mut chance);
        choirs.apply(event);
        alone.apply(event);
        let samples = chance.below(MOST);
        assert!(play(&mut choirs, &mut alone, samples, is_stereo), "seed {seed}, event {number}: {event:?}");
        if number % 1_000 == 999 {
            // A rest, in which players fall asleep.
            for event in [Event::Breath(0.0), Event::Panic, Event::BreathFromKeys] {
                choirs.apply(event.into());
                alone.apply(event.into());
                for _ in 0..2 {
                    assert!(
                        play(&mut choirs, &mut alone, 2_200, is_stereo),
                        "seed {seed}, rest after {number}"
                    );
                }
            }
        }
    }
    assert!(heard > 1.0 && choirs.resets() == 0 && alone.resets() == 0);
    changes
}

/// Who plays side by side gives the bits that all give alone, whatever happens: thirty thousand events, or with
/// `CHALUMEAU_ALL_CASES` a hundred thousand.
#[test]
fn a_choir_gives_the_bits_of_voices_alone() {
    let events = if option_env!("CHALUMEAU_ALL_CASES").is_some() { 100_000 } else { 30_000 };
    let changes = compare(1, events, Ensemble::built_in(RATE_HZ).unwrap());
    assert!(changes > events / 1_000, "{changes} changes of place");
}

#[test]
fn a_narrow_choir_gives_the_same_bits() {
    let changes = compare(2, 10_000, Ensemble::built_in(RATE_HZ).unwrap().without_avx2());
    assert!(changes > 10, "{changes} changes of place");
}

#[test]
fn choirs_are_few_and_full() {
    let mut ensemble = Ensemble::built_in(RATE_HZ).unwrap().without_avx2();
    let players = Players { count: 16, split: Split::Chords, ..Players::default() };
    ensemble.set_settings(&Settings { players, ..Settings::default() });
    ensemble.reset();
    let mut wake = |players: std::ops::Range<u8>| {
        for player in players {
            let event = Event::NoteOn { note: SoundingNote(60), velocity: 0.7 };
            ensemble.apply(PartEvent { to: To::Player(player), event });
        }
        ensemble.render(&mut [0.0; 64]);
        let mut members = [0; 4];
        ensemble.section.places().iter().flatten().for_each(|place| members[place.0] += 1);
        members
    };
    assert_eq!(wake(0..2), [0; 4], "too few");
    assert_eq!(wake(2..6), [4, 0, 0, 0], "and two alone");
    assert_eq!(wake(6..11), [4, 4, 3, 0]);
    assert_eq!(wake(11..16), [4; 4]);
}
