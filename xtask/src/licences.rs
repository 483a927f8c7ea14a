//! Lists the licences of all crates inside the plugin and the programs, with their texts, for those who hand them on.
//!
//! The texts are the licence files in the crates' own packages. Some packages hold none; for them `xtask/licences` has
//! the standard texts. Crates that only run while building are not in the list, and neither are system libraries.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::machine;

/// What is handed on in binary form: a package of ours, and its features.
struct Product {
    package: &'static str,
    features: &'static [&'static str],
}

/// The plugin and the programs, with every feature that may be handed on.
const PROGRAMS: Product = Product {
    package: "chalumeau",
    features: &["--no-default-features", "--features", "standalone,devices,cli,simulator"],
};
/// The modules of the web page.
const PAGE: Product = Product { package: "chalumeau-web", features: &["--features", "workshop"] };
const PAGE_TARGET: &str = "wasm32-unknown-unknown";
/// The systems that the plugin is bundled for.
const TARGETS: &[&str] = &["x86_64-unknown-linux-gnu", "aarch64-apple-darwin", "x86_64-pc-windows-msvc"];
/// Cargo's name for the system it runs on.
const HOST: &str = "host-tuple";
/// The name of the list, beside the bundles.
pub const FILE: &str = "THIRD-PARTY-LICENSES.txt";
/// Texts for packages without a licence file, in the order of preference.
const STANDARD: &[(&str, &str)] = &[
    ("Apache-2.0", include_str!("../../LICENSE-APACHE")),
    ("MIT", include_str!("../licences/MIT.txt")),
    ("ISC", include_str!("../licences/ISC.txt")),
    ("BSL-1.0", include_str!("../licences/BSL-1.0.txt")),
    ("Unlicense", include_str!("../licences/Unlicense.txt")),
];

struct Package {
    /// Name and version, separated by a space.
    title: String,
    /// SPDX expression.
    licence: String,
    authors: String,
    source: String,
    folder: PathBuf,
}

/// `cargo xtask licences [target..]`: for all systems unless targets are named. Fetches crates that other systems need.
pub fn run(args: &[String]) -> Result<()> {
    let named: Vec<_> = args.iter().map(String::as_str).collect();
    write(&PROGRAMS, if named.is_empty() { TARGETS } else { &named }, &bundled())
}

/// The list for the targets of a build with these options: the host unless they name one.
pub fn beside_bundles(options: &[String]) -> Result<()> {
    let mut words =
        options.iter().flat_map(|option| option.split('=')).skip_while(|word| *word != "--target");
    let target = words.nth(1);
    write(&PROGRAMS, &[target.unwrap_or(HOST)], &bundled())
}

/// The list for the web page, in its folder.
pub fn beside_page(folder: &Path) -> Result<()> {
    write(&PAGE, &[PAGE_TARGET], folder)
}

fn bundled() -> PathBuf {
    machine::target().join("bundled")
}

/// The list for the plugin and the programs on one target.
pub fn list(target: &str) -> Result<String> {
    text(&PROGRAMS, &[target])
}

/// The crates inside the plugin and the programs of one target: name and version, and licence.
pub fn inside(target: &str) -> Result<Vec<(String, String)>> {
    let packages = shipped(&PROGRAMS, target)?.into_iter().map(|package| (package.title, package.licence));
    let mut packages: Vec<_> = packages.collect();
    packages.sort();
    Ok(packages)
}

fn write(product: &Product, targets: &[&str], folder: &Path) -> Result<()> {
    let text = text(product, targets)?;
    fs::create_dir_all(folder)?;
    let path = folder.join(FILE);
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    println!("Created the list of licences at '{}'", path.display());
    Ok(())
}

fn text(product: &Product, targets: &[&str]) -> Result<String> {
    let allowed = allowed(&fs::read_to_string(machine::root().join("deny.toml"))?)?;
    let mut packages = BTreeMap::new();
    for target in targets {
        packages
            .extend(shipped(product, target)?.into_iter().map(|package| (package.title.clone(), package)));
    }
    let refused: Vec<_> = packages
        .values()
        .filter(|package| !accepts(&package.licence, &|id| allowed.contains(id)))
        .map(|package| format!("{} ({})", package.title, package.licence))
        .collect();
    ensure!(refused.is_empty(), "licences that deny.toml does not allow: {}", refused.join(", "));
    let packages = packages.into_values().map(|package| Ok((texts(&package)?, package)));
    Ok(document(&packages.collect::<Result<Vec<_>>>()?))
}

/// The licences that deny.toml allows.
fn allowed(deny: &str) -> Result<BTreeSet<String>> {
    let table: toml::Table = deny.parse().context("deny.toml")?;
    let list = table.get("licenses").and_then(|licences| licences.get("allow")?.as_array());
    let list = list.context("deny.toml has no list licenses.allow")?;
    Ok(list.iter().filter_map(|id| id.as_str().map(str::to_owned)).collect())
}

/// The packages inside the binaries of one target; our own are not among them.
fn shipped(product: &Product, target: &str) -> Result<Vec<Package>> {
    let tree = ["tree", "-p", product.package, "-e", "normal,no-proc-macro", "--prefix", "none", "-f", "{p}"];
    let tree = output(&[&tree[..], product.features, &["--target", target]].concat())?;
    let inside: BTreeSet<_> = tree.lines().filter_map(title).collect();
    let metadata = ["metadata", "--format-version", "1", "--filter-platform", target];
    let metadata = output(&[&metadata[..], product.features].concat())?;
    let metadata: Value = serde_json::from_str(&metadata)?;
    let packages = metadata["packages"].as_array().context("cargo metadata names no packages")?;
    let packages: Vec<_> = packages.iter().map(package).collect::<Option<_>>().context("cargo metadata")?;
    let found = packages.iter().filter(|(package, _)| inside.contains(&package.title)).count();
    ensure!(
        found == inside.len(),
        "cargo metadata has {found} of the {} packages in cargo tree",
        inside.len()
    );
    let outside =
        |(package, ours): (Package, bool)| (!ours && inside.contains(&package.title)).then_some(package);
    Ok(packages.into_iter().filter_map(outside).collect())
}

/// Name and version from a line `name v1.2.3 (path) (*)`.
fn title(line: &str) -> Option<String> {
    let (name, version) = line.split_once(" v")?;
    Some(format!("{name} {}", version.split(' ').next()?))
}

/// The folder of copies of crates that others wrote, at the root of the workspace.
const COPIES: &str = "vendor";

/// A package of `cargo metadata`, and whether it is one of ours.
fn package(value: &Value) -> Option<(Package, bool)> {
    let (name, version) = (value["name"].as_str()?, value["version"].as_str()?);
    let authors: Vec<_> = value["authors"].as_array()?.iter().filter_map(Value::as_str).collect();
    let package = Package {
        title: format!("{name} {version}"),
        licence: value["license"].as_str().unwrap_or("none").to_owned(),
        authors: authors.join(", "),
        source: format!("https://crates.io/crates/{name}/{version}"),
        folder: Path::new(value["manifest_path"].as_str()?).parent()?.to_owned(),
    };
    let ours = value["source"].is_null() && !package.folder.starts_with(machine::root().join(COPIES));
    Some((package, ours))
}

fn output(args: &[&str]) -> Result<String> {
    let mut command = machine::cargo();
    command.args(args).arg("--locked").stdin(Stdio::null()).stderr(Stdio::inherit());
    let name = machine::described(&command);
    let output = command.output().with_context(|| format!("cannot start `{name}`"))?;
    ensure!(output.status.success(), "`{name}` failed");
    Ok(String::from_utf8(output.stdout)?)
}

/// Whether an SPDX expression is met by licences that `holds` is true for. `/` is the old way to write OR.
fn accepts(expression: &str, holds: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<_> = spaced.split_whitespace().collect();
    any_of(&mut words.as_slice(), holds)
}

fn any_of(words: &mut &[&str], holds: &dyn Fn(&str) -> bool) -> bool {
    let mut met = all_of(words, holds);
    while let ["OR", rest @ ..] = *words {
        *words = rest;
        met |= all_of(words, holds);
    }
    met
}

fn all_of(words: &mut &[&str], holds: &dyn Fn(&str) -> bool) -> bool {
    let mut met = one(words, holds);
    while let ["AND", rest @ ..] = *words {
        *words = rest;
        met &= one(words, holds);
    }
    met
}

fn one(words: &mut &[&str], holds: &dyn Fn(&str) -> bool) -> bool {
    let (met, rest) = match *words {
        ["(", inner @ ..] => {
            *words = inner;
            let met = any_of(words, holds);
            // What is left begins with the closing bracket.
            (met, (*words).get(1..).unwrap_or(&[]))
        }
        // An exception only adds rights, but it has to be allowed by its full name.
        [id, "WITH", exception, rest @ ..] => (holds(&format!("{id} WITH {exception}")), rest),
        [id, rest @ ..] => (holds(id), rest),
        [] => (false, &[][..]),
    };
    *words = rest;
    met
}

/// The licence texts of a package: its own files, or the standard text.
fn texts(package: &Package) -> Result<Vec<String>> {
    let mut texts = Vec::new();
    for path in licence_files(&package.folder, "")? {
        let text = String::from_utf8_lossy(&fs::read(path)?).into_owned();
        texts.push(
            text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n").trim_matches('\n').to_owned(),
        );
    }
    if texts.is_empty() {
        let known = STANDARD.iter().find(|(known, _)| accepts(&package.licence, &|id| id == *known));
        let (name, text) = known.with_context(|| {
            format!(
                "{} holds no licence file; add the text of {} to STANDARD",
                package.title, package.licence
            )
        })?;
        texts.push(format!("{name} (standard text: the package holds none)\n\n{}", text.trim_matches('\n')));
    }
    Ok(texts)
}

/// Files in a package that hold licences or notices. In `parent` "licenses" all files do, in "fonts" all text files.
fn licence_files(folder: &Path, parent: &str) -> Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))?;
    let mut entries: Vec<_> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    entries.sort();
    let mut files = Vec::new();
    for path in entries {
        let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
        let words = ["licen", "unlicen", "copying", "copyright", "notice"];
        let named = words.iter().any(|word| name.starts_with(word));
        if path.is_dir() {
            match name.as_str() {
                "fonts" => files.extend(licence_files(&path, "fonts")?),
                _ if named => files.extend(licence_files(&path, "licenses")?),
                _ => {}
            }
        } else if named || parent == "licenses" || (parent == "fonts" && name.ends_with(".txt")) {
            files.push(path);
        }
    }
    Ok(files)
}

/// The list: all packages first, then every text once, with the packages it belongs to.
fn document(packages: &[(Vec<String>, Package)]) -> String {
    let mut list = "This program contains the Rust standard library (MIT OR Apache-2.0, the Rust project's contributors,\n\
        https://github.com/rust-lang/rust) and the packages below. Their licence texts follow the list.\n\n"
        .to_owned();
    let mut grouped: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (texts, Package { title, licence, authors, source, .. }) in packages {
        list += &format!("{title}: {licence}");
        list += &if authors.is_empty() { "\n".to_owned() } else { format!("; {authors}\n") };
        if !accepts(licence, &|id| id != "MPL-2.0") {
            list += &format!("    Its source code, unchanged, is at {source} under the MPL-2.0.\n");
        }
        texts.iter().for_each(|text| grouped.entry(text).or_default().push(title));
    }
    let mut grouped: Vec<_> = grouped.into_iter().collect();
    grouped.sort_by(|one, other| one.1.cmp(&other.1));
    for (text, titles) in grouped {
        list += &format!("\n{}\n{}\n\n{text}\n", "=".repeat(80), titles.join(", "));
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_met_by_the_licences_they_name() {
        let met = |expression: &str, held: &[&str]| accepts(expression, &|id| held.contains(&id));
        assert!(met("MIT/Apache-2.0", &["MIT"]));
        assert!(met("Apache-2.0 WITH LLVM-exception OR MIT", &["MIT"]));
        assert!(!met("Apache-2.0 WITH LLVM-exception", &["Apache-2.0"]));
        assert!(met("(MIT OR Apache-2.0) AND OFL-1.1", &["MIT", "OFL-1.1"]));
        assert!(!met("(MIT OR Apache-2.0) AND OFL-1.1", &["MIT"]));
        assert!(met("MIT OR GPL-3.0-only AND Zlib", &["MIT"]), "AND binds closer than OR");
        assert!(met("MIT AND (ISC AND (Zlib OR GPL-3.0-only))", &["MIT", "ISC", "Zlib"]));
        assert!(!met("none", &["MIT"]));
    }

    #[test]
    fn deny_toml_allows_the_permissive_and_no_gpl() {
        let allowed = allowed(include_str!("../../deny.toml")).unwrap();
        assert!(allowed.contains("MIT") && allowed.contains("MPL-2.0"));
        assert!(!allowed.iter().any(|id| id.contains("GPL")), "{allowed:?}");
    }

    #[test]
    fn cargo_trees_lines_give_name_and_version() {
        assert_eq!(title("nice-vst v1.2.3 (proc-macro) (*)").as_deref(), Some("nice-vst 1.2.3"));
        assert_eq!(title(""), None);
    }

    #[test]
    fn a_copy_of_a_crate_is_not_ours() {
        let at = |folder: &str| {
            let manifest = machine::root().join(folder).join("Cargo.toml");
            let value = serde_json::json!({
                "name": "nice-plug", "version": "0.4.2", "authors": [], "source": null, "manifest_path": manifest
            });
            package(&value).unwrap().1
        };
        assert!(at("crates/core"));
        assert!(!at("vendor/nice-plug"));
    }

    fn in_folder(licence: &str, files: &[(&str, &str)]) -> (tempfile::TempDir, Package) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let (title, authors, source) = ("reed 1.0.0".into(), "A. Maker".into(), "https://example.org".into());
        let package =
            Package { title, licence: licence.into(), authors, source, folder: folder.path().into() };
        (folder, package)
    }

    #[test]
    fn texts_come_from_the_package_and_else_from_the_standard() {
        let files = [
            ("LICENSE-MIT", "one\r\n"),
            ("src/license.rs", "code"),
            ("fonts/OFL.txt", "two"),
            ("fonts/a.ttf", ""),
        ];
        let (_kept, package) = in_folder("MIT", &files);
        assert_eq!(texts(&package).unwrap(), ["one", "two"]);
        let (_kept, package) = in_folder("ISC OR GPL-2.0-only", &[("README.md", "")]);
        assert!(texts(&package).unwrap()[0].contains("THE SOFTWARE IS PROVIDED"));
        let (_kept, package) = in_folder("GPL-2.0-only", &[]);
        assert!(texts(&package).unwrap_err().to_string().contains("reed 1.0.0"));
    }

    #[test]
    fn the_list_groups_equal_texts_and_tells_where_mpl_sources_are() {
        let (_kept, mpl) = in_folder("MPL-2.0", &[]);
        let (_kept, either) = in_folder("MPL-2.0 OR MIT", &[]);
        let list = document(&[(vec!["same".into()], mpl), (vec!["same".into()], either)]);
        assert_eq!(list.matches("same").count(), 1);
        assert_eq!(list.matches("https://example.org under the MPL-2.0").count(), 1);
    }
}
