//! An instrument that another replaces falls silent first; what a key presses blows.

use chalumeau_core::bore::bundled::Bundled;
use chalumeau_web::playing::{MOST_FRAMES, Playing};

const RATE_HZ: f64 = 48_000.0;
/// Sounding B flat 3, its key pressed down.
const NOTE: u8 = 58;

fn heard(playing: &mut Playing, blocks: usize) -> Vec<f32> {
    let mut sound = Vec::new();
    for _ in 0..blocks {
        let frames = playing.process(128);
        sound.extend_from_slice(&playing.channel(0)[..frames]);
    }
    sound
}

fn peak(sound: &[f32]) -> f32 {
    sound.iter().fold(0.0, |peak, sample| peak.max(sample.abs()))
}

/// Largest step from sample to sample.
fn edge(sound: &[f32]) -> f32 {
    sound.windows(2).fold(0.0, |edge, pair| edge.max((pair[1] - pair[0]).abs()))
}

#[test]
fn it_falls_silent_before_another_takes_over_and_sounds_again_if_none_does() {
    let mut playing = Playing::new(RATE_HZ, Bundled::BFlat).unwrap();
    assert!(!playing.has_left());
    playing.leave();
    assert!(playing.has_left(), "nothing sounds");
    playing.stay();
    playing.midi(0x90, NOTE, 100);
    let steady = heard(&mut playing, 200).split_off(12_800);
    playing.leave();
    let mut leaving = vec![*steady.last().unwrap()];
    leaving.extend(heard(&mut playing, 2));
    assert!(playing.has_left() && edge(&leaving) < 1.05 * edge(&steady));
    assert_eq!(peak(&heard(&mut playing, 10)), 0.0);
    playing.stay();
    assert!(!playing.has_left());
    let again = heard(&mut playing, 100);
    assert!(edge(&again) < 1.1 * edge(&steady) && peak(&again[9_600..]) > 0.7 * peak(&steady));
    playing.leave();
    heard(&mut playing, 2);
    let mut other = Playing::new(RATE_HZ, Bundled::A).unwrap();
    other.carry_on(playing);
    assert!(!other.has_left());
    let taken = heard(&mut other, 200);
    assert!(taken[0].abs() < 1e-3 && edge(&taken[..2_400]) < edge(&steady), "it comes without a step");
    assert!(peak(&taken[MOST_FRAMES..]) > 0.5 * peak(&steady), "the key is still held");
}

#[test]
fn the_pressure_of_a_key_is_the_breath_of_its_note() {
    let level = |pressure: Option<u8>| {
        let mut playing = Playing::new(RATE_HZ, Bundled::BFlat).unwrap();
        playing.midi(0x90, NOTE, 100);
        if let Some(pressure) = pressure {
            playing.midi(0xa0, NOTE, pressure);
        }
        peak(&heard(&mut playing, 200)[12_800..])
    };
    let [struck, soft, loud] = [None, Some(20), Some(127)].map(level);
    assert!(soft < 0.4 * struck && loud > 1.3 * struck, "{soft} {struck} {loud}");
}
