//! What is written from the table of parameters: `docs/parameters.md` for readers, and the parameters that the editor's
//! tests play.

use std::fmt::Write as _;

use anyhow::{Result, bail, ensure};
use chalumeau::parameters::{Kind, PARAMETERS, Parameter};

use crate::generated::{read, write};

const DOCUMENT: &str = "docs/parameters.md";
const PLAYED: &str = "tests/support/parameters.tsv";

const PREFACE: &str = "\
# Parameters

This page is written by `cargo xtask parameter-reference` from the table in `src/parameters/table.rs`. Plugin, editor and
command line use the same table. `chalumeau parameters` prints it as CSV.

Ids are stable: saved projects and `--set` use them. *MIDI* is what drives a parameter over MIDI. *Auto* says whether a host
can automate it. *Flag* is the command line's flag for the same quantity; a flag takes a number without its unit. It takes
a percentage as 0..1, or with its sign: `--growl 0.4` is `--growl 40%`. Some flags of the knob and of the measured reed have a wider range than the plugin.

`--set` takes any parameter of the sound by its id, with the text that a host would show. A percentage from 0 to 1 needs its sign there:

```sh
chalumeau render --written C4 --set vent=2 --set tune=tempered --set \"temp=20 \u{b0}C\" --out c4.wav
```

Parameters that `--set` takes are marked with * after their id.
";

/// Text that stands in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// What it does, to the sound and to the hand.
fn explained(parameter: &Parameter) -> String {
    let mut text = format!("{}.", parameter.meaning);
    if !parameter.sound.is_empty() {
        text += &format!(" {}", parameter.sound);
    }
    if !parameter.feel.is_empty() {
        text += &format!(" *At the knob:* {}", parameter.feel);
    }
    cell(&text)
}

fn document() -> String {
    let mut text = PREFACE.to_owned();
    let mut group = "";
    for parameter in PARAMETERS {
        if parameter.group != group {
            group = parameter.group;
            let _ = write!(
                text,
                "\n## {group}\n\n| id | name | what it does | range | default | MIDI | auto | flag |\n\
                 |---|---|---|---|---|---|---|---|\n"
            );
        }
        let _ = writeln!(
            text,
            "| `{}`{} | {} | {} | {} | {} | {} | {} | {} |",
            parameter.id,
            if parameter.sets.is_some() { " *" } else { "" },
            cell(parameter.name),
            explained(parameter),
            cell(&parameter.range()),
            cell(&parameter.default_text()),
            parameter.midi,
            if parameter.is_automatable { "yes" } else { "no" },
            if parameter.flag.is_empty() { String::new() } else { format!("`{}`", parameter.flag) },
        );
    }
    text
}

/// Texts of all steps joined by bars, or of both ends joined by dots.
fn texts(parameter: &Parameter) -> String {
    let all: Vec<&str> = match parameter.kind {
        Kind::Number(n) => return format!("{}{u}..{}{u}", n.text(n.min), n.text(n.max), u = n.unit),
        Kind::Whole(w) => return format!("{}{u}..{}{u}", w.text(w.min), w.text(w.max), u = w.unit),
        Kind::Choice(choice) => choice.all.iter().map(|(_, text)| *text).collect(),
        Kind::Switch(switch) => vec![switch.off, switch.on],
        Kind::Status(first) => vec![first; 2],
    };
    all.join("|")
}

fn played() -> String {
    let mut text = "\
# The plugin's parameters in the order of hosts, as the editor's tests play them: id, name, steps (none: continuous),
# default (0..=1), texts of all steps, or of both ends joined by dots. Written by `cargo xtask parameter-reference`; a test
# of the plugin holds this to the parameters.
"
    .to_owned();
    for parameter in PARAMETERS {
        let steps = parameter.steps().map_or_else(String::new, |steps| steps.to_string());
        let _ = writeln!(
            text,
            "{}\t{}\t{steps}\t{}\t{}",
            parameter.id,
            parameter.name,
            parameter.default_normalized(),
            texts(parameter)
        );
    }
    text
}

/// Writes both, or compares byte for byte.
pub fn parameter_reference(args: &[String]) -> Result<()> {
    let check = match args {
        [] => false,
        [flag] if flag == "--check" => true,
        _ => bail!("takes nothing or --check, got {args:?}"),
    };
    for (path, text) in [(DOCUMENT, document()), (PLAYED, played())] {
        if check {
            ensure!(
                read(path)? == text,
                "{path} is not what the table of parameters gives; run `cargo xtask parameter-reference`"
            );
            println!("{path} is what the table of parameters gives");
        } else {
            write(path, &text)?;
        }
    }
    Ok(())
}
