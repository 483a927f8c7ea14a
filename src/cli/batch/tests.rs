//! Whole batches, in folders of their own.

use super::*;
use crate::wav::{Depth, WavFile};
use std::path::Path;

/// The last columns of a table.
const REST: &str = "length_s,rate_hz,peak_dbfs,rms_dbfs,warnings";

fn batch(directory: &Path, plan: &str, text: &str, force: bool) -> (BatchCommand, PathBuf) {
    let path = directory.join(plan);
    fs::write(&path, text).unwrap();
    let into = directory.join("set");
    (BatchCommand { plan: path, into: into.clone(), force, dry_run: false }, into)
}

#[test]
fn a_plan_is_rendered_once_and_goes_on_where_it_was() {
    let directory = tempfile::tempdir().unwrap();
    let plan = "[same]\nseconds = 0.05\nno-noise = true\n[vary]\nwritten = [\"E3\", \"C4\"]\ngamma = { from = 0.4, to = 0.5, steps = 2 }\n";
    let (command, into) = batch(directory.path(), "plan.toml", plan, false);
    command.run().unwrap();
    let manifest = fs::read_to_string(into.join(MANIFEST)).unwrap();
    let lines: Vec<_> = manifest.lines().collect();
    assert_eq!(lines[0], "file,no-noise,seconds,gamma,written,length_s,rate_hz,peak_dbfs,rms_dbfs,warnings");
    assert_eq!(lines.len(), 5);
    assert!(lines[2].starts_with("0002.wav,true,0.05,0.4,C4,0.0500,48000,"), "{}", lines[2]);
    assert!(!into.join(GROWING).exists());
    // One file is lost, and two were cut off: only these are rendered again.
    let file = |name: &str| into.join(name);
    let mut marked = fs::read(file("0001.wav")).unwrap();
    *marked.last_mut().unwrap() ^= 1;
    fs::write(file("0001.wav"), &marked).unwrap();
    let whole = fs::read(file("0002.wav")).unwrap();
    fs::write(file("0002.wav"), &whole[..whole.len() / 2]).unwrap();
    fs::remove_file(file("0003.wav")).unwrap();
    fs::write(file("0004.wav"), "").unwrap();
    command.run().unwrap();
    assert_eq!(fs::read(file("0001.wav")).unwrap(), marked);
    assert_eq!(fs::read(file("0002.wav")).unwrap(), whole);
    assert!(["0003.wav", "0004.wav"].iter().all(|name| fs::metadata(file(name)).unwrap().len() > 1_000));
    assert_eq!(fs::read_to_string(file(MANIFEST)).unwrap(), manifest);
}

#[test]
fn what_this_plan_has_not_made_is_kept_unless_forced() {
    let directory = tempfile::tempdir().unwrap();
    let plan = "[same]\nseconds = 0.05\n[vary]\nwritten = [\"E3\", \"C4\", \"G4\"]\n";
    let (command, into) = batch(directory.path(), "plan.toml", plan, false);
    let file = |name: &str| into.join(name);
    let first = "0001.wav,0.05,E3,0.0500,48000,-1.00,-2.00,";
    let with_header = |line: &str| format!("file,seconds,written,{REST}\n{line}\n");
    // A file without a table, one that a finished table does not list, one with other arguments, and other columns.
    for (manifest, growing, says) in [
        (None, None, "0001.wav is there and is not of this plan; choose another folder, or add --force"),
        (Some(with_header(&first.replace("0001", "0009"))), None, "0001.wav is there and is not"),
        (Some(with_header(&first.replace("E3", "F3"))), None, "0001.wav is of another plan"),
        (None, Some(with_header(&first.replace("E3", "F3"))), "0001.wav is of another plan"),
        (Some(format!("file,written,{REST}\n")), None, "manifest.csv is of another plan"),
        (None, Some(format!("file,written,{REST}\n")), "manifest.part.csv is of another plan"),
    ] {
        let _ = fs::remove_dir_all(&into);
        fs::create_dir(&into).unwrap();
        fs::write(file("0001.wav"), "mine").unwrap();
        for (name, text) in [(MANIFEST, &manifest), (GROWING, &growing)] {
            if let Some(text) = text {
                fs::write(file(name), text).unwrap();
            }
        }
        let said = command.run().unwrap_err().to_string();
        assert!(said.contains(says), "{said}");
        assert_eq!(fs::read(file("0001.wav")).unwrap(), b"mine");
        assert!(!file("0002.wav").exists());
        assert_eq!(fs::read_to_string(file(GROWING)).ok(), growing);
    }
    // A stopped run goes on: its last line is cut off, and a file is not listed yet.
    let mut mine = fs::File::create(file("0001.wav")).unwrap();
    let mut wav = WavFile::new(&mut mine, 48_000, Depth::Float32, 1, 2_400).unwrap();
    wav.write(&[&[0.25; 2_400]]).unwrap();
    wav.finish().unwrap();
    let mine = fs::read(file("0001.wav")).unwrap();
    fs::write(file(GROWING), with_header(&format!("{first}\n0002.wav,0.0")).trim_end()).unwrap();
    fs::write(file("0002.wav"), "not listed").unwrap();
    command.run().unwrap();
    assert_eq!(fs::read(file("0001.wav")).unwrap(), mine);
    assert!(["0002.wav", "0003.wav"].iter().all(|name| fs::metadata(file(name)).unwrap().len() > 1_000));
    // By force, a shorter plan replaces its own files and names the others.
    let shorter = plan.replace("\"E3\", ", "");
    let (forced, _) = batch(directory.path(), "plan.toml", &shorter, true);
    let jobs = forced.jobs(&Plan::read(&forced.plan).unwrap()).unwrap();
    let left_over = Earlier::read(&into).unwrap().left_over(&into, &jobs).unwrap();
    assert!(left_over.contains("holds 1 file of an earlier plan"), "{left_over}");
    assert!(left_over.ends_with("manifest.csv does not list: 0003.wav"), "{left_over}");
    forced.run().unwrap();
    assert!(fs::metadata(file("0001.wav")).unwrap().len() > 1_000);
    assert_eq!(fs::read_to_string(file(MANIFEST)).unwrap().lines().count(), 3);
    assert!(file("0003.wav").exists());
}

#[test]
fn a_plan_that_is_corrected_before_any_file_was_made_is_the_same_plan() {
    let directory = tempfile::tempdir().unwrap();
    let plan = "[vary]\nwritten = [\"E3\"]\n[same]\nseconds = 0.02\n";
    let (command, into) = batch(directory.path(), "plan.toml", plan, false);
    fs::create_dir(&into).unwrap();
    fs::write(into.join(GROWING), "file,written,growl,length_s,rate_hz,peak_dbfs,rms_dbfs,warnings\n")
        .unwrap();
    command.run().unwrap();
    assert!(into.join("0001.wav").exists() && !into.join(GROWING).exists());
    // With a file that may be of that plan it is refused.
    fs::rename(into.join(MANIFEST), into.join(GROWING)).unwrap();
    fs::write(into.join(GROWING), "file,written,growl,length_s,rate_hz,peak_dbfs,rms_dbfs,warnings\n")
        .unwrap();
    let said = command.run().unwrap_err().to_string();
    assert!(said.contains("is of another plan"), "{said}");
}

/// What has changed under the same name is heard.
#[test]
fn a_file_whose_breath_has_changed_is_rendered_again() {
    let directory = tempfile::tempdir().unwrap();
    let breath = directory.path().join("breath.csv");
    let curve = |gamma: &str| fs::write(&breath, format!("t_s,gamma\n0,{gamma}\n")).unwrap();
    let plan = format!(
        "[same]\nseconds = 0.05\nno-noise = true\nwritten = \"C4\"\n[vary]\nbreath = [\"0.5\", {breath:?}]\n"
    );
    let (command, into) = batch(directory.path(), "plan.toml", &plan, false);
    curve("0.5");
    command.run().unwrap();
    let sounds = || ["0001.wav", "0002.wav"].map(|name| fs::read(into.join(name)).unwrap());
    let first = sounds();
    assert_eq!(first[0], first[1]);
    let marked = |at: usize| {
        let mut sound = first[at].clone();
        *sound.last_mut().unwrap() ^= 1;
        sound
    };
    // Nothing has changed: nothing is rendered.
    fs::write(into.join("0002.wav"), marked(1)).unwrap();
    command.run().unwrap();
    assert_eq!(sounds()[1], marked(1));
    curve("0.7");
    fs::write(into.join("0001.wav"), marked(0)).unwrap();
    command.run().unwrap();
    let second = sounds();
    assert_eq!(second[0], marked(0));
    assert!(second[1] != marked(1) && second[1] != first[1]);
    // Without the hashes nobody knows what it was made of.
    fs::remove_file(into.join(INPUTS)).unwrap();
    fs::write(into.join("0002.wav"), marked(1)).unwrap();
    command.run().unwrap();
    assert_eq!(sounds(), second);
}

/// A table, a list or a single line that only has the name is not replaced.
#[test]
fn what_is_called_as_the_table_and_is_another_is_kept() {
    let directory = tempfile::tempdir().unwrap();
    let (command, into) = batch(directory.path(), "plan.toml", "[vary]\nwritten = [\"E3\"]\n", false);
    fs::create_dir(&into).unwrap();
    for (name, text) in [
        (MANIFEST, "subject,age\n"),
        (MANIFEST, "subject,age"),
        (MANIFEST, "subject,age\n1,2\n"),
        (GROWING, "subject,age\n"),
        (INPUTS, "mine"),
    ] {
        fs::write(into.join(name), text).unwrap();
        let said = command.run().unwrap_err().to_string();
        assert!(said.contains("not the table of a batch") || said.contains("not of a batch"), "{said}");
        assert_eq!(fs::read_to_string(into.join(name)).unwrap(), text);
        fs::remove_file(into.join(name)).unwrap();
    }
}

/// A file without a tone is named in the table, and so by every run of the command.
#[test]
fn a_file_without_a_tone_is_marked() {
    let directory = tempfile::tempdir().unwrap();
    let plan = "[same]\nseconds = 1\nwritten = \"C4\"\n[vary]\ngamma = [0.2, 0.5]\n";
    let (command, into) = batch(directory.path(), "plan.toml", plan, false);
    for _ in 0..2 {
        command.run().unwrap();
        let manifest = fs::read_to_string(into.join(MANIFEST)).unwrap();
        let lines: Vec<_> = manifest.lines().skip(1).collect();
        assert!(lines[0].ends_with(",no_tone") && lines[1].ends_with(','), "{manifest}");
        let jobs = command.jobs(&Plan::read(&command.plan).unwrap()).unwrap();
        let told =
            Doubtful::read(&jobs, &lines.iter().map(|line| Some((*line).to_owned())).collect::<Vec<_>>());
        assert_eq!(told.0.into_iter().collect::<Vec<_>>(), [(Doubt::NoTone, vec!["0001.wav".to_owned()])]);
    }
}

#[test]
fn mistakes_are_told_before_anything_is_rendered() {
    let directory = tempfile::tempdir().unwrap();
    for (name, text, says) in [
        ("p.toml", "[vary]\nwritten = [\"H9\"]\n", "file 1"),
        ("p.toml", "[vary]\nwritten = [\"C4\", \"C9\"]\n", "file 2: written 120 (C9) has no fingering"),
        (
            "p.toml",
            "[vary]\nbreath = [\"none.csv\"]\n[same]\nwritten = \"C4\"\n",
            "file 1: cannot read none.csv",
        ),
        ("p.toml", "[vary]\nwriten = [\"C4\"]\n", "written"),
        ("p.toml", "[vary]\nout = [\"x.wav\"]\n", "out"),
        ("p.toml", "[vary]\n", "nothing varies"),
        ("p.toml", "[same]\nzeta = 0.3\n[vary]\nzeta = [0.2]\nwritten = [\"C4\"]\n", "zeta stands twice"),
        ("r.csv", "written,zeta,zeta\nC4,0.2,0.3\n", "zeta stands twice"),
        ("p.toml", "[vary]\ngamma = [-1]\n", "0..3"),
        ("p.toml", "vary = 3", "invalid type"),
        ("r.csv", "written,gamma\nC4\n", "line 2"),
        ("r.csv", "written,gamma\nC4,0.5\n\nC9,0.5\n", "line 4: written 120 (C9) has no fingering"),
        ("r.csv", "gamma\n0.5\n0.6\n", "line 2: the following required arguments were not provided: <MIDI|"),
        ("r.csv", "", "names"),
    ] {
        let (command, into) = batch(directory.path(), name, text, false);
        let said = command.run().unwrap_err().to_string();
        assert!(said.contains(says), "{text}: {said}");
        assert!(!into.exists());
    }
}
