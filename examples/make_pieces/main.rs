//! Writes the pieces in `examples/`, each a MIDI file. All are traditional or in the public domain; own transcriptions.
//!
//! `cargo run --no-default-features --features cli --example make_pieces [FOLDER]`
//!
//! Each piece has a file with its notes as a clarinettist reads them. [`playing`] makes keys, breath and techniques of
//! them, and [`midi_file`] the tracks, with sounding pitch.

mod canon;
mod greensleeves;
mod midi_file;
mod mountain_king;
mod notation;
mod playing;
mod saints;

use midly::Smf;
use std::path::Path;
use std::process::ExitCode;

/// The name of a file, and what makes its content.
type Piece = (&'static str, fn() -> Smf<'static>);

/// All pieces.
pub const PIECES: [Piece; 4] = [
    ("melody.mid", greensleeves::file),
    ("saints.mid", saints::file),
    ("mountain-king.mid", mountain_king::file),
    ("canon.mid", canon::file),
];

#[allow(
    dead_code,
    reason = "tests use this file as a module, to compare what it writes with what is committed"
)]
fn main() -> ExitCode {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "examples".to_owned());
    for (name, piece) in PIECES {
        let path = Path::new(&folder).join(name);
        if let Err(error) = piece().save(&path) {
            eprintln!("error: cannot write {}: {error}", path.display());
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}
