//! Choosing a file, in place of a view: the folders and files of one kind in a folder, and a field for its path.
//!
//! Reading a folder leaves as an [`Action`]; the snapshot brings what is in it.

use std::path::{Path, PathBuf};

use egui::{Key, RichText, Role, ScrollArea, TextEdit, Ui, WidgetInfo};

use crate::editor::Action;
use crate::editor::theme::{Colours, GAP, panel};
use crate::folder_listing::{ENTRIES_MOST, FolderListing, Place};

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// An instrument file.
    Instrument,
    /// A scale or a keyboard mapping.
    Scale,
}

impl FileKind {
    fn title(self) -> &'static str {
        match self {
            Self::Instrument => "Open an instrument file (.toml)",
            Self::Scale => "Open a scale (.scl) or a keyboard mapping (.kbm)",
        }
    }

    /// Where its files are looked for first.
    fn place(self) -> Place {
        match self {
            Self::Instrument => Place::Instruments,
            Self::Scale => Place::Home,
        }
    }

    fn ends(self) -> &'static [&'static str] {
        match self {
            Self::Instrument => &["toml"],
            Self::Scale => &["scl", "kbm"],
        }
    }

    fn fits(self, name: &str) -> bool {
        let end = Path::new(name).extension();
        end.is_some_and(|end| self.ends().iter().any(|known| end.eq_ignore_ascii_case(known)))
    }

    fn open(self, path: PathBuf) -> Action {
        match self {
            Self::Instrument => Action::OpenInstrument(path),
            Self::Scale => Action::OpenScale(path),
        }
    }
}

/// What the browser remembers.
#[derive(Clone, Debug, Default)]
pub struct FileBrowser {
    wanted: Option<FileKind>,
    typed: String,
    /// The folder that `typed` began with.
    shown: PathBuf,
    /// The folders in which files were chosen.
    last: Vec<(FileKind, PathBuf)>,
}

impl FileBrowser {
    /// Opens it.
    pub fn open(&mut self, kind: FileKind, actions: &mut Vec<Action>) {
        (self.wanted, self.shown) = (Some(kind), PathBuf::new());
        let last = self.last.iter().find(|(of, _)| *of == kind);
        let place = last.map_or_else(|| kind.place(), |(_, folder)| Place::Folder(folder.clone()));
        actions.push(Action::ReadFolder(place));
    }

    /// Whether it is in front.
    pub fn is_open(&self) -> bool {
        self.wanted.is_some()
    }

    /// Closes it.
    pub fn close(&mut self) {
        self.wanted = None;
    }

    /// Draws it.
    pub fn draw(&mut self, ui: &mut Ui, listing: &FolderListing, actions: &mut Vec<Action>) {
        let Some(kind) = self.wanted else { return };
        if ui.input(|input| input.key_pressed(Key::Escape)) && !ui.ctx().text_edit_focused() {
            return self.close();
        }
        let c = Colours::here(ui);
        if self.shown != listing.folder {
            self.shown.clone_from(&listing.folder);
            self.typed = listing.folder.display().to_string();
        }
        panel(c).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.set_height(ui.available_height());
            ui.spacing_mut().item_spacing.y = 0.5 * GAP;
            ui.horizontal(|ui| {
                ui.label(RichText::new(kind.title()).strong());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.button("Cancel").clicked() {
                        self.close();
                    }
                });
            });
            self.path_row(ui, kind, listing, actions);
            if let Some(refused) = &listing.refused {
                ui.label(RichText::new(refused).color(c.danger));
            }
            if listing.is_cut {
                ui.label(format!(
                    "This folder has more than {ENTRIES_MOST} entries. If yours is not listed, type its path."
                ));
            }
            let area = ScrollArea::vertical().id_salt("files").auto_shrink([false, false]);
            area.show(ui, |ui| self.names(ui, kind, listing, actions));
        });
    }

    /// Up, home, and the path.
    fn path_row(&mut self, ui: &mut Ui, kind: FileKind, listing: &FolderListing, actions: &mut Vec<Action>) {
        ui.horizontal(|ui| {
            let above = listing.folder.parent();
            let up = ui.add_enabled(above.is_some(), egui::Button::new("Up"));
            if let Some(above) = above.filter(|_| up.clicked()) {
                actions.push(Action::ReadFolder(Place::Folder(above.to_owned())));
            }
            if ui.button("Home").clicked() {
                actions.push(Action::ReadFolder(Place::Home));
            }
            let about = "Instruments that you have saved in this program";
            if kind == FileKind::Instrument && ui.button("Yours").on_hover_text(about).clicked() {
                actions.push(Action::ReadFolder(Place::Instruments));
            }
            let field = TextEdit::singleline(&mut self.typed).desired_width(ui.available_width() - 62.0);
            let field = ui.add(field.hint_text("path of a folder or file"));
            field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Path of a folder or file"));
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            if ui.button("Go").clicked() || is_entered {
                let path = PathBuf::from(self.typed.trim());
                if kind.fits(&self.typed) {
                    self.choose(kind, path, actions);
                } else {
                    actions.push(Action::ReadFolder(Place::Folder(path)));
                }
            }
        });
    }

    fn names(&mut self, ui: &mut Ui, kind: FileKind, listing: &FolderListing, actions: &mut Vec<Action>) {
        let c = Colours::here(ui);
        for name in &listing.folders {
            if ui.selectable_label(false, format!("{name}/")).clicked() {
                actions.push(Action::ReadFolder(Place::Folder(listing.folder.join(name))));
            }
        }
        let mut count = 0;
        for name in listing.files.iter().filter(|name| kind.fits(name)) {
            count += 1;
            if ui.selectable_label(false, RichText::new(name).strong()).clicked() {
                self.choose(kind, listing.folder.join(name), actions);
            }
        }
        if count == 0 && listing.refused.is_none() {
            let ends: Vec<_> = kind.ends().iter().map(|end| format!(".{end}")).collect();
            let none = format!("No file that ends in {} is in this folder.", ends.join(" or "));
            ui.label(RichText::new(none).color(c.quiet));
        }
    }

    fn choose(&mut self, kind: FileKind, path: PathBuf, actions: &mut Vec<Action>) {
        // A project keeps it, and may be opened from another folder.
        let path = std::path::absolute(&path).unwrap_or(path);
        if let Some(folder) = path.parent() {
            self.last.retain(|(of, _)| *of != kind);
            self.last.push((kind, folder.to_owned()));
        }
        actions.push(kind.open(path));
        self.close();
    }
}
