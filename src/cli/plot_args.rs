//! Pictures of what a command measures.

use crate::cli::Failure;
use crate::picture_file::PictureFile;
use chalumeau_figure::Figure;
use chalumeau_figure::draw::Size;
use clap::Args;
use std::path::PathBuf;

/// Whether and where a picture goes. Existing files stay or go as the command's `--force` says.
#[derive(Args)]
pub struct PlotArgs {
    /// Draw a figure too: a new .png or .svg file, or .json for what it shows
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Size of the figure, pixels, 400..4000 each way, as 1600x1000 [default: what it needs]
    #[arg(long, value_name = "WxH", requires = "plot")]
    plot_size: Option<Size>,
}

impl PlotArgs {
    /// Whether one was asked for.
    pub fn wanted(&self) -> bool {
        self.plot.is_some()
    }

    /// Opens the file, so that a wrong name is refused before anything is measured.
    pub fn open(&self, force: bool) -> Result<Plot, Failure> {
        let sheet =
            self.plot.as_ref().map(|path| PictureFile::still(path, force, self.plot_size)).transpose()?;
        Ok(Plot { sheet })
    }
}

/// A picture to be, or none.
pub struct Plot {
    sheet: Option<PictureFile>,
}

impl Plot {
    /// Whether there will be one.
    pub fn wanted(&self) -> bool {
        self.sheet.is_some()
    }

    /// Draws what `figure` returns, if a picture is wanted.
    pub fn draw(self, figure: impl FnOnce() -> Figure) -> Result<(), Failure> {
        match self.sheet {
            Some(sheet) => Ok(sheet.draw(&figure())?),
            None => Ok(()),
        }
    }
}
