//! Arguments for the figure that a command draws.

use crate::cli::Failure;
use crate::cli::files::MaybeFile;
use crate::picture_file::PictureFile;
use chalumeau_figure::Figure;
use chalumeau_figure::draw::Size;
use clap::Args;
use std::path::PathBuf;

/// Whether a figure is drawn, and into which file. The command's `--force` decides about existing files.
#[derive(Args)]
pub struct PlotArgs {
    /// Draw a figure: a new .png or .svg file, or .json for its data
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Size of the figure, pixels, 400..4000 each way, for example 1600x1000 [default: depends on the figure]. In a smaller figure,
    /// its text is smaller, too
    #[arg(long, value_name = "WxH", requires = "plot")]
    plot_size: Option<Size>,
}

impl PlotArgs {
    /// The file of the figure.
    pub fn path(&self) -> MaybeFile<'_> {
        self.plot.as_deref()
    }

    /// Whether a figure is wanted.
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

/// The file of a figure, if one is wanted.
pub struct Plot {
    sheet: Option<PictureFile>,
}

impl Plot {
    /// Whether a figure will be drawn.
    pub fn wanted(&self) -> bool {
        self.sheet.is_some()
    }

    /// Draws what `figure` returns, if a figure is wanted.
    pub fn draw(self, figure: impl FnOnce() -> Figure) -> Result<(), Failure> {
        match self.sheet {
            Some(sheet) => {
                let figure = figure();
                if let Some(warning) = sheet.too_small_for(&figure) {
                    say!("warning: {warning}");
                }
                let path = sheet.path().to_owned();
                sheet.draw(&figure)?;
                say!("{}: drawn", path.display());
                Ok(())
            }
            None => Ok(()),
        }
    }
}
