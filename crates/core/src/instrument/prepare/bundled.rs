//! Instruments that come prepared with the program: one generated file each.

use std::sync::LazyLock;

use super::prepared_file::{BUILT_IN, parse_generated};
use super::wanted::content;
use crate::bore::bundled::Bundled;
use crate::bore::instrument_file::InstrumentFile;
use crate::instrument::model::{BuildError, Model};
use crate::instrument::store::Key;

/// The generated file of each instrument.
fn generated(instrument: Bundled) -> &'static str {
    match instrument {
        Bundled::BFlat => BUILT_IN,
        Bundled::A => include_str!("../../../data/a_clarinet.prepared.toml"),
        Bundled::EFlat => include_str!("../../../data/e_flat_clarinet.prepared.toml"),
        Bundled::C => include_str!("../../../data/c_clarinet.prepared.toml"),
        Bundled::Bass => include_str!("../../../data/bass_clarinet.prepared.toml"),
    }
}

static CONTENTS: LazyLock<[(Key, Bundled); 5]> =
    LazyLock::new(|| Bundled::ALL.map(|instrument| (content(&instrument.file()), instrument)));

/// The bundled instrument that sounds like `file`, for a rate of the lattice and a pitch of A4, both Hz.
pub fn find(file: &InstrumentFile, rate_hz: f64, a4_hz: f64) -> Result<Option<Model>, BuildError> {
    let own = content(file);
    let Some((_, instrument)) = CONTENTS.iter().find(|(key, _)| *key == own) else { return Ok(None) };
    let mut prepared = parse_generated(generated(*instrument))?.into_iter();
    let found = prepared.find(|prepared| prepared.cells.rate_hz == rate_hz && prepared.a4_hz == a4_hz);
    Ok(found.and_then(|prepared| prepared.model(file)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tuner decides it for each rate anew; a player must find the same keys at all of them.
    #[test]
    fn the_same_keys_are_silent_on_every_instrument_at_every_rate() {
        for instrument in Bundled::ALL {
            let file = instrument.file();
            let models = parse_generated(generated(instrument)).unwrap();
            assert_eq!(models.len(), 4, "live and high quality, two families of rates");
            for prepared in models {
                let model = prepared.model(&file).unwrap();
                let silent = (0..file.fingerings.len()).filter(|&fingering| !model.speaks(fingering));
                let written: Vec<_> = silent.map(|at| file.fingerings[at].written.to_string()).collect();
                assert_eq!(written, ["C#7"], "{}, {} Hz", file.name, model.coeffs.rate_hz);
            }
        }
    }
}
