//! What the documents point to is there, and what they tell a reader to type is understood.

use chalumeau::cli::understands;
use chalumeau_core::bore::bundled::Bundled;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Markdown of the repository, but what is built, fetched or copied from others.
fn documents() -> Vec<(PathBuf, String)> {
    fn gather(folder: &Path, all: &mut Vec<PathBuf>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                if !name.starts_with('.') && name != "target" && name != "nice-plug" {
                    gather(&path, all);
                }
            } else if name.ends_with(".md") {
                all.push(path);
            }
        }
    }
    let mut all = Vec::new();
    gather(root(), &mut all);
    all.sort();
    assert!(all.len() > 20, "{}", all.len());
    all.into_iter().map(|path| (path.clone(), fs::read_to_string(path).unwrap())).collect()
}

/// Lines of prose, and lines of code blocks with the language of each.
fn parts(text: &str) -> (Vec<&str>, Vec<(&str, &str)>) {
    let (mut prose, mut code, mut language) = (Vec::new(), Vec::new(), None);
    for line in text.lines() {
        match (line.trim_start().strip_prefix("```"), language) {
            (Some(name), None) => language = Some(name.trim()),
            (Some(_), Some(_)) => language = None,
            (None, Some(name)) => code.push((name, line.trim())),
            (None, None) => prose.push(line),
        }
    }
    (prose, code)
}

/// What stands between `](` and `)` outside of code.
fn links(text: &str) -> Vec<String> {
    let prose = parts(text).0.join("\n");
    let without_code: String = prose.split('`').step_by(2).collect();
    let ends = without_code.split("](").skip(1);
    ends.filter_map(|rest| rest.split_once(')')).map(|(target, _)| target.to_owned()).collect()
}

/// The name GitHub gives a heading.
fn anchor(heading: &str) -> String {
    let kept = heading
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
        .collect::<String>();
    kept.trim().replace(' ', "-")
}

#[test]
fn every_link_leads_somewhere() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for (path, text) in documents() {
        for link in links(&text) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            let has_heading = || {
                let text = fs::read_to_string(&target).unwrap_or_default();
                parts(&text)
                    .0
                    .iter()
                    .any(|line| line.starts_with('#') && anchor(line.trim_start_matches('#')) == heading)
            };
            if !target.exists() || (!heading.is_empty() && !has_heading()) {
                wrong.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(count > 60 && wrong.is_empty(), "{count} links\n{}", wrong.join("\n"));
}

/// A path of the repository that stands in a document: what begins with the name of one of its folders.
fn repository_paths(text: &str) -> Vec<&str> {
    const FOLDERS: [&str; 10] = [
        "benches/",
        "crates/",
        "docs/",
        "examples/",
        "firmware/",
        "packaging/",
        "src/",
        "tests/",
        "web/",
        "xtask/",
    ];
    let is_part = |c: char| c.is_alphanumeric() || "_-./*".contains(c);
    let words = text.split(|c: char| !is_part(c));
    words
        .map(|word| word.trim_end_matches(['.', '/']))
        .filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder)))
        .collect()
}

/// Whether a path, in which `*` stands for any part of a name, leads to something below `folder`.
fn leads_somewhere(folder: &Path, path: &str) -> bool {
    let (name, rest) = path.split_once('/').unwrap_or((path, ""));
    let parts: Vec<&str> = name.split('*').collect();
    let fits = |file: &str| match parts.as_slice() {
        [whole] => file == *whole,
        [start, middle @ .., end] => {
            file.len() >= start.len() + end.len()
                && file.starts_with(start)
                && file.ends_with(end)
                && middle.iter().all(|part| file.contains(part))
        }
        [] => false,
    };
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.map(|entry| entry.unwrap()).any(|entry| {
        fits(&entry.file_name().to_string_lossy())
            && (rest.is_empty() || leads_somewhere(&entry.path(), rest))
    })
}

#[test]
fn every_path_of_the_repository_named_in_a_document_exists() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    // The change log tells of files that have gone since.
    for (path, text) in documents().into_iter().filter(|(path, _)| !path.ends_with("CHANGELOG.md")) {
        for named in repository_paths(&text) {
            count += 1;
            // A page may name its neighbours, too.
            if ![root(), path.parent().unwrap()].iter().any(|from| leads_somewhere(from, named)) {
                wrong.push(format!("{}: {named}", path.display()));
            }
        }
    }
    assert!(count > 60 && wrong.is_empty(), "{count} paths\n{}", wrong.join("\n"));
}

#[test]
fn a_path_in_a_document_is_found_and_a_wrong_one_is_not() {
    assert_eq!(repository_paths("see `src/cli.rs`, (docs/*.md)."), ["src/cli.rs", "docs/*.md"]);
    assert_eq!(repository_paths("https://host.example/src/cli.rs and x-src/y"), Vec::<&str>::new());
    for (path, exists) in [
        ("src/cli.rs", true),
        ("crates/*/src", true),
        ("crates/core/data/*_clarinet.toml", true),
        ("src/no_such.rs", false),
        ("crates/*/no_such", false),
        ("docs/*.nothing", false),
    ] {
        assert_eq!(leads_somewhere(root(), path), exists, "{path}");
    }
}

/// What a reader types: without the remark behind it, and without what a shell does with the output.
fn typed(line: &str) -> Option<Vec<String>> {
    let (mut words, mut word, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.split(" #").next()?.chars().chain([' ']) {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.extend(Some(std::mem::take(&mut word)).filter(|word| !word.is_empty())),
            c => word.push(c),
        }
    }
    let ends = |word: &String| [">", "|", "&", "&&", "2>"].contains(&word.as_str());
    words.truncate(words.iter().position(ends).unwrap_or(words.len()));
    (words.len() > 1 && words[0] == "chalumeau").then(|| words.split_off(1))
}

#[test]
fn every_command_shown_is_understood() {
    // Commands of builds with devices are looked at where those are built in.
    let (devices, simulator) = (cfg!(feature = "devices"), cfg!(feature = "simulator"));
    let known = |words: &[String]| {
        (devices || !["knob", "doctor"].contains(&words[0].as_str())) && (simulator || words[0] != "knob-sim")
    };
    // Prose may name a command, or only part of one.
    let in_part = ["required arguments were not provided", "a value is required"];
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (path, text) in documents().into_iter().filter(|(path, _)| !path.ends_with("CHANGELOG.md")) {
        let text = text.replace("\\\n", " ");
        let (prose, code) = parts(&text);
        let prose = prose.join(" ");
        let inline = prose.split('`').skip(1).step_by(2);
        // Words to be filled in are none to type.
        let inline = inline.filter(|line| !line.contains(" N") && !line.contains(".."));
        let whole = code.iter().filter(|(language, _)| *language == "sh").map(|(_, line)| *line);
        for (line, is_whole) in inline.map(|line| (line, false)).chain(whole.map(|line| (line, true))) {
            let Some(words) = typed(line).filter(|words| known(words)) else { continue };
            count += 1;
            let is_name = !is_whole && words.iter().all(|word| !word.starts_with('-') && !word.contains('.'));
            let said = match is_name {
                true => understands([words[0].as_str(), "--help"]),
                false => understands(words.iter().map(String::as_str)),
            };
            let Err(reason) = said else { continue };
            if is_whole || !in_part.iter().any(|part| reason.contains(part)) {
                wrong.push(format!("{}: {line}\n{reason}", path.display()));
            }
        }
    }
    assert!(count > 60 && wrong.is_empty(), "{count} commands\n{}", wrong.join("\n"));
}

#[test]
fn pictures_of_the_guide_are_used_and_light() {
    let folder = root().join("docs/guide/pictures");
    let shown: String = documents().into_iter().map(|(_, text)| text).collect();
    let mut bytes = 0;
    for picture in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap()) {
        let name = picture.file_name().to_string_lossy().into_owned();
        assert!(shown.contains(&format!("pictures/{name}")), "{name} is shown nowhere");
        bytes += picture.metadata().unwrap().len();
    }
    assert!((1..900_000).contains(&bytes), "{bytes}");
}

#[test]
fn what_is_typed_is_found_in_a_line() {
    let joined = |line| typed(line).map(|words| words.join(","));
    assert_eq!(joined("chalumeau tune --gamma 0.5   # a remark").unwrap(), "tune,--gamma,0.5");
    assert_eq!(joined("chalumeau reed --table --csv - | head").unwrap(), "reed,--table,--csv,-");
    assert_eq!(joined("chalumeau instrument new --name \"My own\"").unwrap(), "instrument,new,--name,My own");
    assert_eq!((typed("cargo build"), typed("chalumeau")), (None, None));
    assert!(understands(["threshold", "--zeta", "7"]).is_err());
    assert!(understands(["tune", "--no-such"]).is_err());
    assert_eq!(anchor(" Play it in five minutes"), "play-it-in-five-minutes");
}

/// The guide's table of presets is the list that the program gives.
#[test]
fn the_guide_lists_every_preset() {
    let text = std::fs::read_to_string(root().join("docs/guide/presets.md")).unwrap();
    let (_, table) = text.split_once("## All presets").unwrap();
    let rows: Vec<&str> = table.lines().filter(|line| line.starts_with("| ")).skip(1).collect();
    let presets = chalumeau::presets::factory::all();
    for (at, preset) in presets.iter().enumerate() {
        let clarinet = preset.bundled().map_or("", |bundled| match bundled {
            Bundled::BFlat => "B flat",
            Bundled::A => "A",
            Bundled::EFlat => "E flat",
            Bundled::C => "C",
            Bundled::Bass => "bass",
        });
        let row = format!("| {} | {clarinet} | {} | {} |", preset.name, preset.tags.join(", "), preset.shows);
        assert_eq!(rows.get(at), Some(&row.as_str()), "row {}", at + 1);
    }
    assert_eq!(rows.len(), presets.len());
}
