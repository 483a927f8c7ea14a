//! Writes figures as files: PNG, SVG, animated GIF, or the figure's data as JSON. The file's extension decides which.
//!
//! A file appears complete or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use chalumeau_figure::Figure;
use chalumeau_figure::draw::{self, DrawError, Size};

use crate::output::{NewFile, OutputError};

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The extension names no format.
    #[error("{}: the name of a picture must end in {}", path.display(), wanted)]
    Extension {
        /// The name as given.
        path: PathBuf,
        /// The extensions allowed.
        wanted: &'static str,
    },
    /// The figure cannot be drawn.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PictureFormat {
    Png,
    Svg,
    Gif,
    Json,
}

impl PictureFormat {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "png" => Some(Self::Png),
            "svg" => Some(Self::Svg),
            "gif" => Some(Self::Gif),
            "json" => Some(Self::Json),
            _ => None,
        }
    }
}

/// A picture file, opened before any measurement, so that a bad path fails early.
pub struct PictureFile {
    file: NewFile,
    format: PictureFormat,
    size: Option<Size>,
}

impl PictureFile {
    /// Opens a `.png`, an `.svg`, or a `.json` for one figure. Without `size`, the figure has its own size.
    pub fn still(path: &Path, force: bool, size: Option<Size>) -> Result<Self, PictureError> {
        match PictureFormat::of(path) {
            Some(format @ (PictureFormat::Png | PictureFormat::Svg | PictureFormat::Json)) => {
                Ok(Self { file: NewFile::create(path, force)?, format, size })
            }
            _ => Err(PictureError::Extension {
                path: path.to_owned(),
                wanted: ".png or .svg (or .json for its data)",
            }),
        }
    }

    /// Opens a `.gif` for a sequence of figures.
    pub fn moving(path: &Path, force: bool, size: Option<Size>) -> Result<Self, PictureError> {
        match PictureFormat::of(path) {
            Some(PictureFormat::Gif) => {
                Ok(Self { file: NewFile::create(path, force)?, format: PictureFormat::Gif, size })
            }
            _ => Err(PictureError::Extension { path: path.to_owned(), wanted: ".gif" }),
        }
    }

    /// What to say of a bitmap in which the words of a figure are too small to read.
    pub fn too_small_for(&self, figure: &Figure) -> Option<String> {
        let bitmap = matches!(self.format, PictureFormat::Png | PictureFormat::Gif);
        let size = self.size.filter(|_| bitmap)?;
        let least = size.too_small_for(figure)?;
        Some(format!(
            "at {size} the words of this figure are too small to read; they can be read from {least} on"
        ))
    }

    /// The name of the file.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Draws the figure and gives the file its name.
    pub fn draw(self, figure: &Figure) -> Result<(), PictureError> {
        let bytes = match self.format {
            PictureFormat::Svg => draw::svg(figure, self.size)?.into_bytes(),
            PictureFormat::Json => draw::json(figure)?,
            PictureFormat::Png | PictureFormat::Gif => draw::png(figure, self.size)?,
        };
        self.keep(&bytes)
    }

    /// Draws a sequence that repeats forever, with `frame_s` seconds per frame, and gives the file its name. Calls `drawn`
    /// after each frame.
    pub fn animate(self, frames: &[Figure], frame_s: f64, drawn: impl FnMut()) -> Result<(), PictureError> {
        let bytes = draw::gif(frames, self.size, frame_s, drawn)?;
        self.keep(&bytes)
    }

    fn keep(mut self, bytes: &[u8]) -> Result<(), PictureError> {
        let path = self.file.path().to_owned();
        self.file.write_all(bytes).map_err(|source| OutputError::Write { path, source })?;
        Ok(self.file.keep()?)
    }
}

/// Draws `figure` into a new file: `.png`, `.svg` or `.json`. `force` replaces an existing file.
pub fn write(figure: &Figure, path: &Path, size: Option<Size>, force: bool) -> Result<(), PictureError> {
    PictureFile::still(path, force, size)?.draw(figure)
}
