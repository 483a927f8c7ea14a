use super::shoebox::Shoebox;
use super::*;

const ALL_SIZES_M: [f32; 3] = [3.0, 12.0, 40.0];

fn room(size_m: f32, decay_s: f32, tone: f32) -> Room {
    Room { amount: 1.0, size_m, decay_s, tone }
}

/// Noise from a fixed seed.
fn noise(samples: usize) -> Vec<f32> {
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    (0..samples).map(|_| 0.3 * next()).collect()
}

/// What a room adds to a sound.
fn wet(room: &Room, rate_hz: f64, dry: &[f32]) -> [Vec<f32>; 2] {
    let mut sound = RoomSound::new(rate_hz);
    sound.set(room);
    let (mut left, mut right) = (dry.to_vec(), dry.to_vec());
    sound.add(&mut left, &mut right);
    [left, right].map(|heard| heard.iter().zip(dry).map(|(wet, dry)| wet - dry).collect())
}

fn impulse_response(room: &Room, rate_hz: f64, seconds: f64) -> [Vec<f32>; 2] {
    let mut dry = vec![0.0; (seconds * rate_hz) as usize];
    dry[0] = 1.0;
    wet(room, rate_hz, &dry)
}

fn energy(sound: &[f32]) -> f64 {
    sound.iter().map(|&x| f64::from(x).powi(2)).sum()
}

/// Decay time by Schroeder's integral, from -5 to -35 dB, s.
fn decay_s(response: &[f32], rate_hz: f64) -> f64 {
    let mut left: Vec<f64> = response.iter().map(|&x| f64::from(x).powi(2)).collect();
    for n in (0..left.len() - 1).rev() {
        left[n] += left[n + 1];
    }
    let at = |db: f64| {
        let share = left[0] * 10.0_f64.powf(db / 10.0);
        left.iter().position(|&rest| rest < share).unwrap() as f64
    };
    2.0 * (at(-35.0) - at(-5.0)) / rate_hz
}

/// Two poles at `hz` and above: what lies below.
fn below(sound: &[f32], hz: f64, rate_hz: f64) -> Vec<f32> {
    let pole = (-std::f64::consts::TAU * hz / rate_hz).exp() as f32;
    let mut state = [0.0; 4];
    sound
        .iter()
        .map(|&x| {
            let mut x = x;
            for y in &mut state {
                *y += (1.0 - pole) * (x - *y);
                x = *y;
            }
            x
        })
        .collect()
}

#[test]
fn the_tail_decays_in_the_time_that_is_asked_for() {
    for rate_hz in [44_100.0, 96_000.0] {
        for size_m in ALL_SIZES_M {
            for asked_s in [0.3, 1.2, 4.0] {
                let flat = room(size_m, asked_s, 1.0);
                for response in impulse_response(&flat, rate_hz, 1.2 * f64::from(asked_s)) {
                    let off = decay_s(&response, rate_hz) / f64::from(asked_s) - 1.0;
                    assert!(off.abs() < 0.1, "{size_m} m, {asked_s} s at {rate_hz} Hz: {off:+.3}");
                }
            }
        }
    }
}

#[test]
fn darkness_shortens_high_tones_and_spares_low_ones() {
    let rate_hz = 48_000.0;
    for (tone, ratio) in [(0.0, 0.25), (0.5, 0.5), (1.0, 1.0)] {
        let [response, _] = impulse_response(&room(12.0, 1.2, tone), rate_hz, 2.0);
        let low = decay_s(&below(&response, 500.0, rate_hz), rate_hz);
        assert!((low / 1.2 - 1.0).abs() < 0.1, "tone {tone}: {low:.3} s");
        // The line spectrum at 5 kHz, in two windows.
        let at = |from: f64| {
            let begin = (from * rate_hz) as usize;
            let part = &response[begin..begin + 4_800];
            let mut power = 0.0;
            for hz in (4_600..5_400).step_by(10) {
                let w = std::f64::consts::TAU * f64::from(hz) / rate_hz;
                let (mut re, mut im) = (0.0, 0.0);
                for (n, &x) in part.iter().enumerate() {
                    re += f64::from(x) * (w * n as f64).cos();
                    im += f64::from(x) * (w * n as f64).sin();
                }
                power += re * re + im * im;
            }
            10.0 * power.log10()
        };
        let high = 60.0 * 0.2 / (at(0.12) - at(0.32));
        assert!((high / (ratio * 1.2) - 1.0).abs() < 0.2, "tone {tone}: {high:.3} s at 5 kHz");
    }
}

#[test]
fn the_first_reflection_comes_on_its_sample() {
    for rate_hz in [44_100.0, 48_000.0, 192_000.0] {
        for size_m in ALL_SIZES_M {
            let here = room(size_m, 1.2, 0.5);
            let responses = impulse_response(&here, rate_hz, 0.2);
            for (response, side) in responses.iter().zip([-1.0, 1.0]) {
                let images = Shoebox::new(&here).images(side);
                let first_s = images.iter().map(|image| image.delay_s).fold(1.0, f64::min);
                let at = response.iter().position(|&x| x != 0.0).unwrap();
                assert_eq!(at, (first_s * rate_hz).round() as usize, "{size_m} m at {rate_hz} Hz");
            }
        }
    }
    // In the room of 12 m it is the floor: 3 m along, 0.84 m - 0.09 m across, 0.9 m down and 1.2 m up again.
    let way = |across: f64, up: f64| (3.0 * 3.0 + across * across + up * up).sqrt();
    let late_s = (way(0.84 - 0.09, 2.1) - way(0.84, 0.3)) / crate::units::Air::default().c;
    let first_s =
        Shoebox::new(&Room::default()).images(-1.0).iter().map(|image| image.delay_s).fold(1.0, f64::min);
    assert!((first_s - late_s).abs() < 1e-6, "{first_s} {late_s}");
}

#[test]
fn the_room_is_as_loud_as_its_critical_distance_says() {
    for size_m in ALL_SIZES_M {
        for asked_s in [0.3, 1.2, 4.0] {
            let length = f64::from(size_m);
            let (across, height) = (0.07 * length, 2.0 + 0.25 * length);
            let distance_m = (0.0625 * length * length + across * across + 0.09).sqrt();
            let critical_m = 0.057 * (length * 0.7 * length * height / f64::from(asked_s)).sqrt();
            let expected_db = 20.0 * (distance_m / critical_m).log10();
            for response in impulse_response(&room(size_m, asked_s, 1.0), 48_000.0, 1.5 * f64::from(asked_s))
            {
                let off_db = 10.0 * energy(&response).log10() - expected_db;
                assert!(off_db.abs() < 1.5, "{size_m} m, {asked_s} s: {off_db:+.2} dB");
            }
        }
    }
}

#[test]
fn left_and_right_are_different_and_the_same_loudness() {
    for size_m in ALL_SIZES_M {
        let [left, right] = impulse_response(&room(size_m, 1.2, 0.5), 48_000.0, 1.5);
        let (l, r) = (energy(&left[4_800..]), energy(&right[4_800..]));
        assert!((10.0 * (l / r).log10()).abs() < 1.0);
        let both: f64 = left[4_800..].iter().zip(&right[4_800..]).map(|(l, r)| f64::from(l * r)).sum();
        assert!((both / (l * r).sqrt()).abs() < 0.15, "{size_m} m");
    }
}

#[test]
fn off_is_the_input_to_the_bit_and_amount_scales_the_rest() {
    let dry = noise(48_000);
    let mut sound = RoomSound::new(48_000.0);
    sound.set(&Room { amount: 0.0, ..room(5.0, 3.0, 0.2) });
    let (mut left, mut right) = (dry.clone(), dry.clone());
    assert_eq!(sound.add(&mut left, &mut right), 0);
    assert!(left == dry && right == dry && !sound.is_on() && sound.is_silent() && sound.tail_s() == 0.0);
    let [whole, _] = wet(&room(5.0, 1.0, 0.5), 48_000.0, &dry);
    let [half, _] = wet(&Room { amount: 0.5, ..room(5.0, 1.0, 0.5) }, 48_000.0, &dry);
    assert!((energy(&whole) / energy(&half) - 4.0).abs() < 1e-3);
}

/// Noise for a second, with changes on the way, then silence, in blocks of so many samples.
fn with_changes(block: usize) -> [Vec<f32>; 2] {
    let changes = [
        (3_000, Room { amount: 0.7, ..Room::default() }),
        (9_000, room(4.0, 0.5, 0.0)),
        (9_600, room(40.0, 0.2, 1.0)),
        (24_000, room(6.0, 0.4, 0.3)),
        (36_000, Room::default()),
        (40_000, room(8.0, 0.3, 0.5)),
    ];
    let mut sound = RoomSound::new(48_000.0);
    let mut left = noise(48_000);
    left.resize(144_000, 0.0);
    let mut right = left.clone();
    let mut done = 0;
    for end in changes.iter().map(|change| change.0).chain([left.len()]) {
        while done < end {
            let to = end.min(done + block);
            sound.add(&mut left[done..to], &mut right[done..to]);
            done = to;
        }
        if let Some((_, room)) = changes.iter().find(|change| change.0 == end) {
            sound.set(room);
        }
    }
    assert!(sound.is_silent());
    [left, right]
}

#[test]
fn blocks_make_no_difference() {
    let whole = with_changes(144_000);
    for block in [1, 17, 64, 1_000] {
        assert!(with_changes(block) == whole, "blocks of {block}");
    }
}

#[test]
fn silence_becomes_exactly_zero_within_the_tail() {
    for size_m in ALL_SIZES_M {
        let rate_hz = 48_000.0;
        let mut sound = RoomSound::new(rate_hz);
        sound.set(&room(size_m, 0.6, 0.5));
        let mut left = noise(24_000);
        let tail = (sound.tail_s() * rate_hz) as usize;
        left.resize(24_000 + tail + 48_000, 0.0);
        let mut right = left.clone();
        sound.add(&mut left, &mut right);
        assert!(sound.is_silent());
        assert!(left[24_000 + tail..].iter().chain(&right[24_000 + tail..]).all(|&x| x == 0.0));
        assert!(left.iter().all(|x| *x == 0.0 || x.abs() >= f32::MIN_POSITIVE), "no subnormal numbers");
        // The next sound is heard as the first one was.
        let again = {
            let mut left = noise(24_000);
            let mut right = left.clone();
            sound.add(&mut left, &mut right);
            left
        };
        assert!(again == left[..24_000]);
    }
}

#[test]
fn what_goes_in_comes_out_and_no_more() {
    // The energy of any sound in the room is at most that of the loudest resonance; a tail never grows.
    let mut sound = RoomSound::new(48_000.0);
    sound.set(&room(3.0, 4.0, 1.0));
    let mut left = noise(48_000);
    left.resize(480_000, 0.0);
    let mut right = left.clone();
    for (n, (left, right)) in left.chunks_mut(500).zip(right.chunks_mut(500)).enumerate() {
        // A knob that never rests, until the sound has ended for a while.
        if n < 192 {
            let turn = (n % 37) as f32 / 36.0;
            sound.set(&room(3.0 + 37.0 * turn, 4.0, 1.0 - turn));
        }
        sound.add(left, right);
    }
    let power: Vec<f64> = left.chunks(4_800).map(|part| energy(part) / 4_800.0).collect();
    let loudest = power.iter().fold(0.0_f64, |a, &b| a.max(b));
    assert!(loudest < 0.03 * 400.0, "{loudest}");
    for n in 20..99 {
        assert!(power[n + 1] <= 1.5 * power[n], "window {n}: {} after {}", power[n + 1], power[n]);
    }
    assert!(power[99] < 1e-4 * power[9], "{} {}", power[99], power[9]);
}

#[test]
fn changes_do_not_click() {
    // A low tone: a click stands out as a step of the second difference.
    let tone: Vec<f32> = (0..96_000).map(|n| 0.3 * (n as f32 * 0.01).sin()).collect();
    let roughest = |change: &dyn Fn(usize) -> Option<Room>| {
        let mut sound = RoomSound::new(48_000.0);
        let (mut left, mut right) = (tone.clone(), tone.clone());
        for (n, (left, right)) in left.chunks_mut(480).zip(right.chunks_mut(480)).enumerate() {
            if let Some(room) = change(n) {
                sound.set(&room);
            }
            sound.add(left, right);
        }
        left[48_000..].windows(3).map(|x| (x[2] - 2.0 * x[1] + x[0]).abs()).fold(0.0, f32::max)
    };
    let still = roughest(&|n| (n == 0).then(|| room(12.0, 1.2, 0.5)));
    let changes: [(&str, Room, Room); 5] = [
        ("on", Room::default(), room(12.0, 1.2, 0.5)),
        ("off", room(12.0, 1.2, 0.5), Room::default()),
        ("size", room(12.0, 1.2, 0.5), room(5.0, 1.2, 0.5)),
        ("decay", room(12.0, 1.2, 0.5), room(12.0, 0.3, 0.5)),
        ("tone", room(12.0, 1.2, 0.5), room(12.0, 1.2, 0.0)),
    ];
    for (what, from, to) in changes {
        let moved = roughest(&|n| match n {
            0 => Some(from),
            120 => Some(to),
            _ => None,
        });
        assert!(moved < 3.0 * still + 1e-4, "{what}: {moved} against {still}");
    }
}

/// The answers of a room to an impulse between left (-1) and right (1), of several players.
fn answer_at(room: &Room, position: f32, seconds: f64) -> [Vec<f32>; 2] {
    let mut sound = RoomSound::new(48_000.0);
    sound.set(room);
    sound.set_apart(true);
    let dry = crate::instrument::stereo::gains(position).map(|gain| {
        let mut dry = vec![0.0; (seconds * 48_000.0) as usize];
        dry[0] = gain;
        dry
    });
    let [mut left, mut right] = dry.clone();
    sound.add(&mut left, &mut right);
    let less = |heard: Vec<f32>, dry: &[f32]| heard.iter().zip(dry).map(|(wet, dry)| wet - dry).collect();
    [less(left, &dry[0]), less(right, &dry[1])]
}

#[test]
fn each_seat_has_its_own_reflections_and_the_same_loudness() {
    for size_m in ALL_SIZES_M {
        let here = room(size_m, 1.2, 0.5);
        let [lone, _] = impulse_response(&here, 48_000.0, 1.8);
        let heard = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|position| answer_at(&here, position, 1.8));
        for [left, right] in &heard {
            let level = 10.0 * (0.5 * (energy(left) + energy(right)) / energy(&lone)).log10();
            assert!(level.abs() < 1.0, "{size_m} m: {level:+.2} dB");
        }
        // The first reflections of who sits at an end come from there: nearer to that ear, by the way between the ears.
        let images = |end: f64, side: f64| Shoebox::new(&here).images_of_end(end, side);
        for (answer, end) in [(&heard[0], -1.0), (&heard[4], 1.0)] {
            for (ear, side) in answer.iter().zip([-1.0, 1.0]) {
                let first_s = images(end, side).iter().map(|image| image.delay_s).fold(1.0, f64::min);
                let at = ear.iter().position(|&x| x.abs() > 1e-4).unwrap();
                assert_eq!(at, (first_s * 48_000.0).round() as usize, "{size_m} m, {end}");
            }
        }
        // Two ends have little in common.
        let both: f64 = heard[0][0].iter().zip(&heard[4][0]).map(|(a, b)| f64::from(a * b)).sum();
        let apart = (both / (energy(&heard[0][0]) * energy(&heard[4][0])).sqrt()).abs();
        assert!(apart < 0.2, "{size_m} m: {apart}");
    }
}

/// Noise on both channels for a second, and silence: players sit down and one stays, in blocks of so many samples.
fn with_seats(block: usize) -> [Vec<f32>; 2] {
    let mut sound = RoomSound::new(48_000.0);
    sound.set(&room(6.0, 0.4, 0.3));
    let mut left = noise(48_000);
    let mut right: Vec<f32> = left.iter().rev().copied().collect();
    for channel in [&mut left, &mut right] {
        channel.resize(144_000, 0.0);
    }
    let mut done = 0;
    for (end, apart) in [(9_000, true), (9_500, false), (20_000, true), (45_000, false), (144_000, false)] {
        while done < end {
            let to = end.min(done + block);
            sound.add(&mut left[done..to], &mut right[done..to]);
            done = to;
        }
        sound.set_apart(apart);
    }
    assert!(sound.is_silent());
    [left, right]
}

#[test]
fn seats_do_not_depend_on_blocks_and_leave_silence() {
    let whole = with_seats(144_000);
    for block in [1, 17, 64, 1_000] {
        assert!(with_seats(block) == whole, "blocks of {block}");
    }
    assert!(whole.iter().all(|channel| channel[140_000..].iter().all(|&x| x == 0.0)));
}

#[test]
fn to_sit_down_during_a_note_does_not_click() {
    let tone: Vec<f32> = (0..96_000).map(|n| 0.3 * (n as f32 * 0.01).sin()).collect();
    let roughest = |seats: &[(usize, bool)]| {
        let mut sound = RoomSound::new(48_000.0);
        sound.set(&room(12.0, 1.2, 0.5));
        let (mut left, mut right) = (tone.clone(), tone.clone());
        for (n, (left, right)) in left.chunks_mut(480).zip(right.chunks_mut(480)).enumerate() {
            for &(_, apart) in seats.iter().filter(|(at, _)| *at == n) {
                sound.set_apart(apart);
            }
            sound.add(left, right);
        }
        left[48_000..].windows(3).map(|x| (x[2] - 2.0 * x[1] + x[0]).abs()).fold(0.0, f32::max)
    };
    let still = roughest(&[]);
    for seats in [&[(120, true)][..], &[(10, true), (120, false)]] {
        let moved = roughest(seats);
        assert!(moved < 3.0 * still + 1e-4, "{seats:?}: {moved} against {still}");
    }
}
