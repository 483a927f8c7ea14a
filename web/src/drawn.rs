//! What the page draws of an instrument, as JSON: bore, holes, fingerings, and the standing wave of each.

use chalumeau_core::bore::instrument_file::{HoleKind, InstrumentFile};
use chalumeau_core::bore::transfer_matrix::TransferMatrix;
use chalumeau_core::instrument::Model;
use chalumeau_core::units::Air;
use serde_json::{Value, json};

/// Places of a standing wave on its way from the reed to the bell.
pub const PLACES: usize = 64;

/// `file` as it is written, before the scaling of its `model`. Takes a tenth of a second. Allocates.
pub fn drawn(file: &InstrumentFile, model: &Model) -> Value {
    let bore = TransferMatrix::new(file, Air::default());
    let bores: Vec<_> =
        file.bore.iter().map(|s| json!([s.part, s.x_start_m, s.x_end_m, s.r_start_m, s.r_end_m])).collect();
    let fingerings: Vec<_> = file
        .fingerings
        .iter()
        .enumerate()
        .map(|(at, fingering)| {
            let wave = bore.standing_pressure(model.notes_hz[at], &fingering.open);
            let open: String =
                fingering.open.iter().map(|&is_open| if is_open { '1' } else { '0' }).collect();
            json!({
                "written": fingering.written.0,
                "speaks": model.speaks(at),
                "open": open,
                "wave": resampled(&wave, file.length_m()),
            })
        })
        .collect();
    json!({
        "name": file.name.split(',').next(),
        "transposition": file.transposition,
        "length": file.length_m(),
        "radius": file.nominal_radius_m,
        "bore": bores,
        "holes": holes(file),
        "fingerings": fingerings,
    })
}

/// The holes alone, with where each can be drilled while all others stay.
pub fn holes(file: &InstrumentFile) -> Vec<Value> {
    let hole = |(at, hole): (usize, &chalumeau_core::bore::instrument_file::ToneHole)| {
        let kind = match hole.kind {
            HoleKind::Finger => "finger",
            HoleKind::PadOpen => "pad",
            HoleKind::KeyClosed => "key",
        };
        let room = file.room_of_hole(at).map(|room| [room.x_m.0, room.x_m.1]);
        json!({
            "name": hole.name, "kind": kind, "x": hole.x_m, "r": hole.radius_m, "chimney": hole.chimney_m, "room": room,
        })
    };
    file.holes.iter().enumerate().map(hole).collect()
}

/// A wave at equal steps along the bore, as two hexadecimal digits each; ff is its largest value.
fn resampled(wave: &[(f64, f64)], length_m: f64) -> String {
    let most = wave.iter().map(|&(_, magnitude)| magnitude).fold(1e-9, f64::max);
    let at = |x_m: f64| {
        let above = wave.partition_point(|&(place_m, _)| place_m < x_m).clamp(1, wave.len() - 1);
        let ((x0, p0), (x1, p1)) = (wave[above - 1], wave[above]);
        let share = if x1 > x0 { ((x_m - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 0.0 };
        p0 + share * (p1 - p0)
    };
    (0..PLACES)
        .map(|place| length_m * place as f64 / (PLACES - 1) as f64)
        .map(|x_m| format!("{:02x}", (255.0 * at(x_m) / most).round() as u8))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_keeps_its_shape() {
        assert_eq!(&resampled(&[(0.0, 1.0), (1.0, 0.0)], 1.0)[..4], "fffb");
        assert!(resampled(&[(0.0, 2.0), (0.5, 2.0), (0.5, 1.0), (1.0, 1.0)], 1.0).ends_with("8080"));
    }
}
