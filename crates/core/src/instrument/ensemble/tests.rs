use super::*;
use crate::analysis::pitch;
use crate::dsp::white::White;
use crate::instrument::listening::Listening;
use crate::units::SoundingNote;

const RATE_HZ: f64 = 48_000.0;

fn ensemble(players: Players) -> Ensemble {
    let mut ensemble = Ensemble::built_in(RATE_HZ).unwrap();
    ensemble.set_settings(&Settings { players, ..Settings::default() });
    ensemble.reset();
    ensemble
}

impl Seat {
    /// The next samples of a player alone, as many as [`reach`](Self::reach) at most; whether the player is awake and has made any.
    fn render(&mut self, mut out: Channels) -> bool {
        let (samples, is_stereo, is_awake) = (out.len(), out.is_stereo(), !self.sleeps);
        if is_awake {
            self.clarinet.render_channels(out.part(0..samples));
            self.sound[0][..samples].copy_from_slice(out.left());
            if let Some(right) = out.right() {
                self.sound[1][..samples].copy_from_slice(right);
            }
        }
        self.pass(samples, is_stereo);
        is_awake
    }
}

fn on(key: u8) -> Event {
    Event::NoteOn { note: SoundingNote(key), velocity: 0.7 }
}

fn off(key: u8) -> Event {
    Event::NoteOff { note: SoundingNote(key) }
}

fn to(player: u8, event: Event) -> PartEvent {
    PartEvent { to: To::Player(player), event }
}

/// Random events of so many players, on average one in `every` samples.
fn random(seed: u64, players: u8, count: usize, every: f64) -> Vec<Timed<PartEvent>> {
    let mut white = White::new(seed);
    let mut unit = || white.next() / 3.0_f64.sqrt() * 0.5 + 0.5;
    let mut at = 0.0;
    let one = |_| {
        at += 2.0 * every * unit();
        let key = 50 + (30.0 * unit()) as u8;
        let event = match (12.0 * unit()) as u8 {
            0..=3 => on(key),
            4..=6 => off(key),
            7 => Event::Breath(unit() as f32),
            8 => Event::Bend { cents: (200.0 * unit() - 100.0) as f32 },
            9 => Event::Volume { gain: unit() as f32 },
            10 => Event::Choke { note: SoundingNote(key) },
            _ => Event::TongueSlap { strength: unit() as f32 },
        };
        Timed { at: at as usize, event: to((f64::from(players) * unit()) as u8, event) }
    };
    (0..count).map(one).collect()
}

/// Plays events in blocks of `block` samples, in two channels.
fn play(ensemble: &mut Ensemble, events: &[Timed<PartEvent>], samples: usize, block: usize) -> [Vec<f32>; 2] {
    let [mut left, mut right] = [(); 2].map(|()| vec![0.0; samples]);
    for begun in (0..samples).step_by(block) {
        let end = samples.min(begun + block);
        let now = events.iter().filter(|event| (begun..end).contains(&event.at));
        let now = now.map(|event| Timed { at: event.at - begun, event: event.event });
        ensemble.render_events_channels(now, Channels::two(&mut left[begun..end], &mut right[begun..end]));
    }
    [left, right]
}

fn power(sound: &[f32]) -> f64 {
    sound.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>() / sound.len() as f64
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

#[test]
fn one_player_is_a_clarinet_to_the_bit() {
    let events = random(1, 1, 1_000, 100.0);
    let mut clarinet = Clarinet::built_in(RATE_HZ).unwrap();
    let [mut left, mut right] = [(); 2].map(|()| vec![0.0; 100_000]);
    let plain = events.iter().map(|event| Timed { at: event.at, event: event.event.event });
    clarinet.render_events_channels(plain, Channels::two(&mut left, &mut right));
    assert!(play(&mut ensemble(Players::default()), &events, 100_000, 333) == [left, right]);
}

#[test]
fn a_player_among_others_gives_the_bits_that_it_gives_alone() {
    const PLAYERS: u8 = 8;
    let events = random(2, PLAYERS, 10_000, 24.0);
    let samples = 240_000;
    let players = Players { count: PLAYERS.into(), ..Players::default() };
    let [left, right] = play(&mut ensemble(players), &events, samples, 480);
    let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
    let (mut sums, gain) = ([(); 2].map(|()| vec![0.0_f32; samples]), 1.0 / f32::from(PLAYERS).sqrt());
    let mut slept = 0;
    for number in 0..PLAYERS {
        let mut seat = Seat::new(Clarinet::of_player(model.clone(), RATE_HZ, number), RATE_HZ, number);
        seat.clarinet.set_settings(&Settings { players, ..Settings::default() });
        seat.clarinet.reset();
        let [mut left, mut right] = [(); 2].map(|()| vec![0.0; samples]);
        let mut own = events.iter().filter(|event| event.event.to == To::Player(number)).peekable();
        let mut at = 0;
        while at < samples {
            while let Some(event) = own.next_if(|event| event.at <= at) {
                seat.apply(event.event.event);
            }
            // In pieces of another length than the ensemble's.
            let next = own.peek().map_or(samples, |event| event.at).min(samples).min(at + 37);
            let end = next.min(at + seat.reach());
            let out = Channels::two(&mut left[at..end], &mut right[at..end]);
            slept += usize::from(!seat.render(out));
            at = end;
        }
        for (sum, (own, side)) in
            sums.iter_mut().zip([left, right].iter().zip(gains(Person::seat(number.into(), 8, 0.7))))
        {
            for (sum, own) in sum.iter_mut().zip(own) {
                *sum += own * (gain * side);
            }
        }
    }
    let [sum_left, sum_right] = &mut sums;
    Limiter::new(RATE_HZ).process_two(sum_left, sum_right);
    assert!(power(&left) > 1e-4 && slept > 0);
    assert!(sums[0] == left && sums[1] == right);
}

#[test]
fn who_does_not_sleep_is_a_clarinet() {
    let model = Arc::new(Model::built_in(RATE_HZ).unwrap());
    let mut seat = Seat::new(Clarinet::of_player(model.clone(), RATE_HZ, 5), RATE_HZ, 5);
    let mut clarinet = Clarinet::of_player(model, RATE_HZ, 5);
    let ([mut a, mut b], mut heard) = ([[0.0; CELL]; 2], 0.0);
    for cell in 0..400 {
        if cell % 40 == 0 {
            let key = 55 + (cell / 20) as u8;
            for event in [off(key - 2), on(key)] {
                seat.apply(event);
                clarinet.apply(event);
            }
        }
        assert!(seat.render(Channels::one(&mut a)));
        clarinet.render(&mut b);
        assert!(a == b, "cell {cell}");
        heard += power(&a);
    }
    assert!(heard > 1.0);
}

#[test]
fn blocks_make_no_difference() {
    let players = Players { count: 4, ..Players::default() };
    // Rests, in which players fall asleep and wake.
    let events = random(3, 4, 60, 1_500.0);
    let whole = play(&mut ensemble(players), &events, 100_000, 100_000);
    for block in [17, 64, 1_000] {
        assert!(play(&mut ensemble(players), &events, 100_000, block) == whole, "blocks of {block}");
    }
}

#[test]
fn who_rests_sleeps_and_wakes() {
    let mut trio = ensemble(Players { count: 3, ..Players::default() });
    assert_eq!((trio.awake(), trio.is_silent()), (0, true));
    let mut out = [0.0; 4_800];
    trio.apply(to(1, on(60)));
    trio.render(&mut out);
    assert_eq!((trio.awake(), trio.is_silent_player(1), trio.is_silent_player(0)), (1, false, true));
    assert!(power(&out) > 1e-6);
    trio.apply(to(1, off(60)));
    // A breath wakes nobody who has no key.
    trio.apply(Event::Breath(0.5).into());
    let mut fell_asleep = None;
    for block in 0..20 {
        trio.render(&mut out);
        fell_asleep = fell_asleep.or((trio.awake() == 0).then_some(block));
    }
    assert!(matches!(fell_asleep, Some(2..)), "{fell_asleep:?}");
    assert!(out == [0.0; 4_800]);
    trio.apply(Event::Breath(0.0).into());
    trio.apply(to(2, on(64)));
    for _ in 0..20 {
        trio.render(&mut out);
    }
    assert_eq!(trio.awake(), 0, "a key without breath");
    trio.apply(Event::Breath(0.5).into());
    assert_eq!(trio.awake(), 1);
    trio.render(&mut out);
    assert!(power(&out[2_400..]) > 1e-6);
}

/// The sound of one player's note alone, after its start.
fn heard(player: u8, players: Players, settings: &Settings) -> [Vec<f32>; 2] {
    let mut all = ensemble(players);
    all.set_settings(&Settings { players, ..*settings });
    all.apply(to(player, on(65)));
    let [mut left, mut right] = [(); 2].map(|()| vec![0.0; 72_000]);
    all.render_channels(Channels::two(&mut left, &mut right));
    [left.split_off(24_000), right.split_off(24_000)]
}

#[test]
fn every_player_is_out_of_tune_by_its_share_of_the_spread() {
    let still = Settings { life: 0.0, noise: 0.0, ..Settings::default() };
    let players = Players { count: 4, spread_cents: 20.0, width: 0.0, ..Players::default() };
    let hz = |player: u8, players| {
        let sound: Vec<f64> = heard(player, players, &still)[0].iter().map(|&x| f64::from(x)).collect();
        pitch::refine_hz(&sound, RATE_HZ, 349.2).unwrap()
    };
    let first = hz(0, players);
    for player in 1..4 {
        let cents = 1_200.0 * (hz(player, players) / first).log2();
        let wanted = Person::new(player).detune_cents(20.0);
        assert!((cents - wanted).abs() < 1.5, "{player}: {cents} for {wanted}");
        let in_tune = Players { spread_cents: 0.0, ..players };
        let cents = 1_200.0 * (hz(player, in_tune) / first).log2();
        assert!(cents.abs() < 0.1, "{player}: {cents}");
    }
}

#[test]
fn a_number_of_one_player_leaves_the_others_alone() {
    let duet = |to: To| {
        let mut duet = ensemble(Players { count: 2, ..Players::default() });
        duet.apply(PartEvent { to, event: Event::Set(SettingNumber::Lip, 0.8) });
        duet
    };
    let lips = |duet: &Ensemble| [0, 1].map(|player| duet.seats[player].clarinet.settings().lip);
    let usual = Settings::default().lip;
    assert_eq!(lips(&duet(To::Player(1))), [usual, 0.8]);
    assert_eq!(lips(&duet(To::All)), [0.8, 0.8]);
    // What belongs to all is set for all, and leaves each its own.
    let mut one = duet(To::Player(0));
    one.apply(to(1, Event::Set(SettingNumber::PlayersWidth, 0.1)));
    assert_eq!((lips(&one), one.players.width), ([0.8, usual], 0.1));
    // Another instrument goes on so; settings are for all.
    let mut next = ensemble(one.players);
    next.carry_on(&one);
    assert_eq!(lips(&next), [0.8, usual]);
    one.set_settings(&Settings { players: one.players, ..Settings::default() });
    assert_eq!(lips(&one), [usual; 2]);
}

#[test]
fn from_two_places_the_nearer_player_is_louder_and_the_first_is_as_alone() {
    let listening = Listening { mode: ListeningMode::Position, angle_deg: 0.0, ..Listening::default() };
    let still = Settings { life: 0.0, noise: 0.0, listening, ..Settings::default() };
    let players = Players { count: 3, spread_cents: 0.0, width: 0.7, ..Players::default() };
    let powers = [0, 1, 2].map(|player| heard(player, players, &still).map(|side| power(&side)));
    // Distances by hand: the right player is at 0.572 m, 1.4 m; the places at 0.866 m, 0.5 m to either side.
    let wanted = 20.0 * (0.294_f64.hypot(1.9) / 0.294_f64.hypot(0.9)).log10();
    let [_, right, left] = powers.map(|[left, right]| db(right / left));
    // Each is also heard from other angles at the two places: some decibels.
    assert!(
        (right - wanted).abs() < 3.0 && (left + wanted).abs() < 3.0,
        "{right} and {left} dB for {wanted}"
    );
    let alone = heard(0, Players::default(), &still);
    let [left, right] = heard(0, players, &still);
    let gain = 3.0_f32.sqrt();
    for (a, b) in alone.iter().flatten().zip(left.iter().chain(&right)) {
        assert!((a - gain * b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn a_pan_moves_who_is_heard_from_two_places() {
    let listening = Listening { mode: ListeningMode::Position, ..Listening::default() };
    let still = Settings { life: 0.0, noise: 0.0, listening, ..Settings::default() };
    let players = Players { count: 3, spread_cents: 0.0, width: 0.7, ..Players::default() };
    for (position, silent, heard) in [(1.0, 0, 1), (-1.0, 1, 0)] {
        let mut section = Ensemble::built_in(RATE_HZ).unwrap();
        section.set_settings(&Settings { players, ..still });
        section.reset();
        section.apply(to(1, Event::Pan { position }));
        let sides = play(&mut section, &[Timed { at: 0, event: to(1, on(62)) }], 24_000, 512)
            .map(|side| power(&side));
        assert!(db(sides[heard] / sides[silent]) > 60.0, "{position}: {sides:?}");
    }
}

#[test]
fn a_pan_goes_on_where_one_becomes_several_and_where_another_ensemble_takes_over() {
    let players =
        |count| Players { count, spread_cents: 0.0, onset_spread_ms: 0.0, width: 0.0, split: Split::Unison };
    let settings = |count| Settings { life: 0.0, noise: 0.0, players: players(count), ..Settings::default() };
    let right = |section: &mut Ensemble| {
        let [left, right] = play(section, &[], 24_000, 512).map(|side| power(&side));
        db(right / left)
    };
    let mut section = ensemble(players(1));
    section.set_settings(&settings(1));
    section.apply(Event::Pan { position: 0.5 }.into());
    section.apply(on(62).into());
    assert!(right(&mut section).abs() < 1e-6, "a lone player's pan belongs to who calls");
    assert_eq!(section.pan(), 0.5);
    section.set_settings(&settings(3));
    right(&mut section);
    let several = right(&mut section);
    assert!(several > 3.0, "{several} dB");
    let mut next = ensemble(players(3));
    next.set_settings(&settings(3));
    next.carry_on(&section);
    let taken = right(&mut next);
    assert!((taken - several).abs() < 0.1, "{taken} dB, {several} before");
    next.set_settings(&settings(1));
    assert_eq!(next.pan(), 0.5);
}

#[test]
fn who_has_gone_and_still_sounds_is_silenced_by_panic() {
    let mut section = ensemble(Players { count: 4, split: Split::Unison, ..Players::default() });
    section.apply(on(62).into());
    play(&mut section, &[], 24_000, 512);
    section.set_settings(&Settings {
        players: Players { count: 1, ..Players::default() },
        ..Settings::default()
    });
    section.apply(Event::Panic.into());
    let [left, _] = play(&mut section, &[], 4_800, 512);
    assert!(db(power(&left[2_400..])) < -90.0, "{} dBFS", db(power(&left[2_400..])));
}

#[test]
fn a_chord_is_of_players_who_are_heard_with_different_keys() {
    let mut section = ensemble(Players { count: 3, ..Players::default() });
    let mut after = |events: &[PartEvent]| {
        events.iter().for_each(|event| section.apply(*event));
        play(&mut section, &[], 24_000, 512);
        section.plays_chord()
    };
    assert!(!after(&[to(0, on(62))]), "one is heard");
    assert!(!after(&[to(1, on(62))]), "in unison");
    assert!(after(&[to(2, on(69))]));
    // Half a second for the note to end, and another for silence to be noticed.
    after(&[to(2, off(69))]);
    after(&[]);
    assert!(!after(&[]), "who is silent again");
}

#[test]
fn players_sit_side_by_side_with_constant_power() {
    let still = Settings { life: 0.0, noise: 0.0, ..Settings::default() };
    let players = Players { count: 3, width: 1.0, spread_cents: 0.0, ..Players::default() };
    let powers = [0, 1, 2].map(|player| heard(player, players, &still).map(|side| power(&side)));
    let [left, right] = [0, 1].map(|side| powers.map(|powers| powers[side]));
    assert!(db(left[0] / right[0]).abs() < 1e-6, "the first in the middle");
    assert!(db(right[1] / left[1]) > 60.0 && db(left[2] / right[2]) > 60.0, "the others at the sides");
    for player in 1..3 {
        let ratio = db((left[player] + right[player]) / (left[0] + right[0]));
        assert!(ratio.abs() < 0.2, "{player}: {ratio} dB");
    }
}

#[test]
fn a_section_is_as_loud_as_one_and_no_two_of_it_are_the_same() {
    // A wide spread, so that a second holds some of its beats.
    let unison = |count| Players { count, split: Split::Unison, spread_cents: 25.0, ..Players::default() };
    let alone = power(&heard(0, unison(1), &Settings::default())[0]);
    for count in [4, 16] {
        let [left, right] = heard(0, unison(count), &Settings::default());
        let level = db(0.5 * (power(&left) + power(&right)) / alone);
        assert!(level.abs() < 2.5, "{count}: {level} dB");
        assert!(left.iter().chain(&right).all(|x| x.abs() <= 1.0));
    }
    // Their wander alone, without a spread of the tuning, makes them differ.
    let players = Players { count: 4, width: 0.0, spread_cents: 0.0, ..Players::default() };
    let sounds = [0, 1, 2].map(|player| heard(player, players, &Settings::default())[0].clone());
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        assert!(sounds[a] != sounds[b]);
    }
}

#[test]
fn swings_begin_apart() {
    use crate::instrument::Vibrato;
    let vibrato = Vibrato { depth: 1.0, onset_s: 0.0, unevenness: 0.0, ..Vibrato::default() };
    let settings = Settings { life: 0.0, noise: 0.0, vibrato, ..Settings::default() };
    let players = Players { count: 4, width: 0.0, spread_cents: 0.0, ..Players::default() };
    // The level swings by 3 dB: where in its turn, from the first Fourier coefficient of the power.
    let turn = |player: u8| {
        let sound = &heard(player, players, &settings)[0];
        let hz = f64::from(vibrato.rate_hz);
        let (mut s, mut c) = (0.0, 0.0);
        let turns = (sound.len() as f64 / RATE_HZ * hz).floor() / hz * RATE_HZ;
        for (n, &x) in sound.iter().enumerate().take(turns as usize) {
            let angle = std::f64::consts::TAU * hz * n as f64 / RATE_HZ;
            s += f64::from(x * x) * angle.sin();
            c += f64::from(x * x) * angle.cos();
        }
        c.atan2(s) / std::f64::consts::TAU
    };
    let first = turn(0);
    for player in 1..4 {
        let wanted = Person::new(player).phase();
        let away = (turn(player) - first - wanted).rem_euclid(1.0);
        assert!(away.min(1.0 - away) < 0.05, "{player}: {away}");
    }
}

#[test]
fn players_who_come_and_go_leave_no_note_and_no_step() {
    let mut section = ensemble(Players { count: 4, split: Split::Unison, ..Players::default() });
    let settings = |count, split| Settings {
        players: Players { count, split, ..Players::default() },
        ..Settings::default()
    };
    let mut sound = Vec::new();
    let mut go_on = |section: &mut Ensemble| {
        let [mut left, mut right] = [[0.0; 24_000]; 2];
        section.render_channels(Channels::two(&mut left, &mut right));
        sound.extend_from_slice(&left);
        section.awake()
    };
    section.apply(on(62).into());
    assert_eq!(go_on(&mut section), 4);
    section.set_settings(&settings(1, Split::Unison));
    go_on(&mut section);
    assert_eq!(go_on(&mut section), 1, "three have gone");
    section.apply(Event::Bend { cents: 50.0 }.into());
    section.set_settings(&settings(3, Split::Chords));
    assert_eq!(go_on(&mut section), 1);
    section.apply(to(2, on(69)));
    assert_eq!(go_on(&mut section), 2);
    section.set_settings(&settings(3, Split::Unison));
    go_on(&mut section);
    assert_eq!(go_on(&mut section), 1, "the chord's note is over");
    section.apply(off(62).into());
    section.set_settings(&settings(1, Split::Chords));
    for _ in 0..6 {
        go_on(&mut section);
    }
    assert!(section.is_silent());
    let steps = |begin: usize, end: usize| {
        let sound = &sound[24_000 * begin..24_000 * end];
        sound.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
    };
    // No larger than those of the notes themselves.
    let (low, both) = (steps(0, 1).max(steps(2, 3)), steps(4, 5));
    assert!(steps(1, 4) < 1.2 * low, "{} of {low}", steps(1, 4));
    assert!(steps(5, 7) < 1.2 * both, "{} of {both}", steps(5, 7));
}

#[test]
fn a_choke_of_who_sleeps_does_not_cut_the_next_note() {
    let duet = |choke: Option<Event>| {
        let mut duet = ensemble(Players { count: 2, ..Players::default() });
        choke.into_iter().for_each(|choke| duet.apply(to(1, choke)));
        let mut out = vec![0.0; 4_800];
        duet.render(&mut out);
        // A breath that is there at once, and a slap, which no tongue holds back.
        duet.apply(Event::TongueSlap { strength: 1.0 }.into());
        duet.render(&mut out);
        out
    };
    assert!(duet(Some(Event::Choke { note: SoundingNote(60) })) == duet(None));
}

fn section_of(count: i32, onset_spread_ms: f32) -> Ensemble {
    ensemble(Players { count, split: Split::Unison, onset_spread_ms, ..Players::default() })
}

#[test]
fn a_section_begins_without_an_accent() {
    // Greatest power of 10 ms within the first 0.2 s, over that of the second half second.
    let accent_db = |onset_spread_ms: f32, key: u8| {
        let mut section = section_of(8, onset_spread_ms);
        let note = [Timed { at: 4_800, event: on(key).into() }];
        let [left, _] = play(&mut section, &note, 52_800, 512);
        let begun = left[4_800..14_400].windows(480).step_by(48).map(power).fold(0.0, f64::max);
        db(begun / power(&left[28_800..]))
    };
    let accents: Vec<[f64; 2]> =
        (50..=80).step_by(5).map(|key| [0.0, 25.0].map(|spread_ms| accent_db(spread_ms, key))).collect();
    let mean = |of: usize| accents.iter().map(|accent| accent[of]).sum::<f64>() / accents.len() as f64;
    assert!(mean(0) > 8.0 && mean(1) < 3.0, "together, spread: {accents:.1?} dB");
    assert!(accents.iter().all(|[together, spread]| *spread < together - 3.0), "{accents:.1?} dB");
}

#[test]
fn the_first_of_a_section_is_in_time_and_the_others_are_late_in_their_own_ways() {
    let mut section = section_of(6, 40.0);
    section.apply(on(60).into());
    assert!(!section.is_resting() && !section.is_silent());
    let mut begun = [None; 6];
    let mut one = [0.0];
    for at in 0..1_921 {
        section.render(&mut one);
        for (begun, seat) in begun.iter_mut().zip(&section.seats) {
            if seat.clarinet.player_state().key.is_some() {
                begun.get_or_insert(at);
            }
        }
    }
    let begun = begun.map(|at| at.expect("it begins within 40 ms"));
    assert_eq!(begun[0], 0);
    let mut apart = begun;
    apart.sort_unstable();
    assert!(apart.windows(2).all(|pair| pair[1] - pair[0] > 24), "{begun:?}");
}

#[test]
fn a_section_sounds_the_same_in_any_blocks_and_after_a_reset() {
    let notes: Vec<Timed<PartEvent>> = random(9, 1, 400, 240.0)
        .into_iter()
        .map(|event| Timed { at: event.at, event: event.event.event.into() })
        .collect();
    let mut section = section_of(4, 25.0);
    let whole = play(&mut section, &notes, 96_000, 96_000);
    section.reset();
    assert!(play(&mut section, &notes, 96_000, 1) == whole);
    assert!(play(&mut section_of(4, 25.0), &notes, 96_000, 77) == whole);
}

#[test]
fn panic_and_choke_leave_no_note_that_waits() {
    for cut in [Event::Panic, Event::Choke { note: SoundingNote(60) }] {
        // While some have begun and others have not, and while some have ended.
        for end in [None, Some(4_800)] {
            let mut section = section_of(6, 60.0);
            section.apply(on(60).into());
            if let Some(samples) = end {
                section.render(&mut vec![0.0; samples]);
                section.apply(off(60).into());
            }
            section.render(&mut [0.0; 480]);
            assert!(section.seats.iter().any(|seat| !seat.lateness.is_empty()));
            section.apply(cut.into());
            assert!(section.seats.iter().all(|seat| seat.lateness.is_empty()), "{cut:?}");
            let mut sound = vec![0.0; 48_000];
            section.render(&mut sound);
            assert!(power(&sound[24_000..]) < 1e-12 && section.is_silent(), "{cut:?}");
        }
    }
}

#[test]
fn a_wheel_that_waits_is_not_lost_when_a_host_stops() {
    let mut section = section_of(6, 60.0);
    section.apply(Event::Bend { cents: 200.0 }.into());
    section.apply(on(60).into());
    section.render(&mut vec![0.0; 4_800]);
    section.apply(Event::Bend { cents: 0.0 }.into());
    section.apply(Event::Panic.into());
    section.apply(on(60).into());
    section.render(&mut vec![0.0; 24_000]);
    for seat in &mut section.seats[..6] {
        let mut sound = vec![0.0; 9_600];
        seat.clarinet.render(&mut sound);
        let sound: Vec<f64> = sound.into_iter().map(f64::from).collect();
        let cents = 1_200.0 * (pitch::refine_hz(&sound, RATE_HZ, 261.6).unwrap() / 261.626).log2();
        assert!(cents.abs() < 40.0, "{cents}");
    }
}

#[test]
fn who_sleeps_begins_the_next_note_as_loud_as_it_is_to_be() {
    let players = Players { count: 4, ..Players::default() };
    let gain = |gain_db| Settings { gain_db, players, ..Settings::default() };
    let begun = |first_db, then_db| {
        let mut quartet = Ensemble::built_in(RATE_HZ).unwrap();
        quartet.set_settings(&gain(first_db));
        quartet.apply(to(1, on(60)));
        quartet.render(&mut vec![0.0; 9_600]);
        quartet.apply(to(1, off(60)));
        quartet.render(&mut vec![0.0; 240_000]);
        assert!(quartet.seats[1].sleeps);
        quartet.set_settings(&gain(then_db));
        quartet.apply(to(1, on(60)));
        let mut sound = vec![0.0; 2_400];
        quartet.render(&mut sound);
        sound
    };
    let (changed, always) = (begun(-2.5, -20.0), begun(-20.0, -20.0));
    let louder = power(&changed) / power(&always);
    // Without it, the first 50 ms are 4.5 times as strong.
    assert!((louder - 1.0).abs() < 0.05, "{louder}");
}

#[test]
fn what_waits_goes_on_in_another_ensemble_and_is_dropped_where_players_go() {
    let waits = |section: &Ensemble| section.seats.iter().filter(|seat| !seat.lateness.is_empty()).count();
    let mut section = section_of(6, 60.0);
    section.apply(on(60).into());
    let mut next = section_of(6, 60.0);
    next.carry_on(&section);
    assert_eq!((waits(&section), waits(&next)), (5, 5));
    next.render(&mut vec![0.0; 2_881]);
    assert!(next.seats[..6].iter().all(|seat| seat.clarinet.player_state().key.is_some()));
    let players = Players { count: 2, split: Split::Unison, onset_spread_ms: 60.0, ..Players::default() };
    section.set_settings(&Settings { players, ..Settings::default() });
    assert_eq!(waits(&section), 1);
    assert!(!section.plays_chord(), "a section plays one note, however late some of it are");
}
