//! Files that the user chooses: folders are walked through, an instrument file or a scale is opened.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use chalumeau::editor::{Action, Tab};
use chalumeau::folder_listing::{FolderListing, Place};
use egui::Key;
use egui_kittest::kittest::Queryable;

use crate::Window;

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// The instrument view after a click on a button, with a folder to choose from.
fn browsing(button: &str, first: Place) -> Window {
    let mut window = Window::tall(Tab::Instrument);
    window.harness.get_by_label(button).click();
    window.harness.run();
    assert_eq!(window.actions(), [Action::ReadFolder(first)]);
    window.snapshot.borrow_mut().folder = Arc::new(FolderListing {
        folder: PathBuf::from("/home/music"),
        folders: names(&["scales"]),
        files: names(&["fifths.SCL", "from_a.kbm", "mine.toml", "notes.txt"]),
        refused: None,
        is_cut: false,
    });
    window.harness.run();
    window
}

fn click(window: &mut Window, label: &str) -> Vec<Action> {
    window.harness.get_by_label(label).click();
    window.harness.run();
    window.actions()
}

#[test]
fn an_instrument_file_is_found_by_its_folders() {
    let mut window = browsing("Open an instrument file", Place::Instruments);
    // A file that was opened before, while another clarinet plays.
    window.snapshot.borrow_mut().instrument_file = "/home/music/other.toml".to_owned();
    for hidden in ["fifths.SCL", "notes.txt"] {
        assert!(window.harness.query_by_label(hidden).is_none(), "{hidden} is no instrument");
    }
    assert_eq!(click(&mut window, "Up"), [Action::ReadFolder(Place::Folder(PathBuf::from("/home")))]);
    assert_eq!(
        click(&mut window, "scales/"),
        [Action::ReadFolder(Place::Folder(PathBuf::from("/home/music/scales")))]
    );
    assert_eq!(
        click(&mut window, "mine.toml"),
        [Action::OpenInstrument(PathBuf::from("/home/music/mine.toml"))]
    );
    // The next time it begins where the last file was, and undo brings back what played before.
    let opened = click(&mut window, "Open an instrument file");
    assert_eq!(opened, [Action::ReadFolder(Place::Folder(PathBuf::from("/home/music")))]);
    assert_eq!(click(&mut window, "Yours"), [Action::ReadFolder(Place::Instruments)]);
    click(&mut window, "Cancel");
    window.harness.get_by_label("Open a scale");
    let named = |path: &str| Action::NameInstrumentFile(path.to_owned());
    let user = window.snapshot.borrow().instruments.len() - 1;
    assert_eq!(click(&mut window, "Undo"), [named("/home/music/other.toml"), Action::ChooseInstrument(0)]);
    assert_eq!(click(&mut window, "Redo"), [named("/home/music/mine.toml"), Action::ChooseInstrument(user)]);
}

#[test]
fn a_scale_and_a_mapping_are_offered_and_equal_temperament_comes_back() {
    let mut window = browsing("Open a scale", Place::Home);
    window.harness.get_by_label("from_a.kbm");
    assert!(window.harness.query_by_label("mine.toml").is_none());
    assert_eq!(
        click(&mut window, "fifths.SCL"),
        [Action::OpenScale(PathBuf::from("/home/music/fifths.SCL"))]
    );
    {
        let mut snapshot = window.snapshot.borrow_mut();
        snapshot.scale = "fifths.SCL".to_owned();
        snapshot.key_pitches = chalumeau::scale_file::key_pitches("fifths\n1\n3/2\n", None).unwrap();
    }
    window.harness.run();
    window.harness.get_by_label("fifths.SCL");
    assert_eq!(click(&mut window, "Equal temperament"), [Action::EqualTemperament]);
}

#[test]
fn a_typed_path_opens_a_file_or_a_folder_and_escape_leaves() {
    let mut window = browsing("Open an instrument file", Place::Instruments);
    for (typed, wanted) in [
        ("/tmp", Action::ReadFolder(Place::Folder(PathBuf::from("/tmp")))),
        // A project keeps it, and may be opened from another folder.
        ("mine.toml", Action::OpenInstrument(std::path::absolute("mine.toml").unwrap())),
    ] {
        let field = window.harness.get_by_label("Path of a folder or file");
        field.focus();
        window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::A);
        window.harness.get_by_label("Path of a folder or file").type_text(typed);
        window.harness.run();
        window.harness.key_press(Key::Enter);
        window.harness.run();
        assert_eq!(window.actions(), [wanted]);
    }
    let mut window = browsing("Open a scale", Place::Home);
    window.harness.key_press(Key::Escape);
    window.harness.run();
    window.harness.get_by_label("Open a scale");
    let mut window = browsing("Open a scale", Place::Home);
    window.snapshot.borrow_mut().folder = Arc::new(FolderListing {
        refused: Some("cannot read /root: Permission denied".to_owned()),
        ..FolderListing::default()
    });
    window.harness.run();
    window.harness.get_by_label("cannot read /root: Permission denied");
    assert!(click(&mut window, "Cancel").is_empty());
    window.harness.get_by_label("Open a scale");
}

#[test]
fn the_fingered_note_is_trimmed_and_all_trims_go_back() {
    let mut window = Window::tall(Tab::Instrument);
    window.harness.get_by_label("Trim of C4, cents").click();
    window.harness.run();
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::A);
    window.harness.get_by_label("Trim of C4, cents").type_text("-7.5");
    window.harness.run();
    window.harness.key_press(Key::Enter);
    window.harness.run();
    // Written C4 sounds two semitones lower.
    let trims = BTreeMap::from([(58, -75)]);
    assert_eq!(window.actions().last(), Some(&Action::TrimNotes(trims.clone())));
    window.snapshot.borrow_mut().trims = trims;
    window.harness.run();
    assert_eq!(click(&mut window, "No trims"), [Action::TrimNotes(BTreeMap::new())]);
}
