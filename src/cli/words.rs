//! Names and values as the words of a command: the rows of a batch, and the arguments of a caller that is a program.
//!
//! A name is a flag of the command without its dashes, or the id of a parameter. So a command line, a plan, a table and
//! Python name the same things in the same way.

use crate::cli::shared_args;
use crate::parameters::{self, PARAMETERS, Parameter};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, ArgAction, Args, Command};

/// A command as it is typed in a shell.
pub fn typed<W: AsRef<str>>(words: impl IntoIterator<Item = W>) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=,+@".contains(c);
    let word = |word: W| {
        let word = word.as_ref();
        if !word.is_empty() && word.chars().all(is_plain) {
            word.to_owned()
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    words.into_iter().map(word).collect::<Vec<_>>().join(" ")
}

/// Names as alternatives: reed-stiffness, reed-area or reed-width.
fn one_of(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The error about a flag that `command` lacks, with advice if its name is that of a parameter: the flag that sets it, or
/// `--set`. clap knows only names that look alike.
pub fn advised(mut error: clap::Error, command: &Command) -> clap::Error {
    let has = |flag: &str| command.get_arguments().any(|arg| arg.get_long() == Some(flag));
    let unknown = error.get(ContextKind::InvalidArg).map(ToString::to_string);
    let name = unknown.as_deref().and_then(|flag| flag.strip_prefix("--")).map(|flag| flag.replace('-', " "));
    let parameter =
        name.filter(|_| error.kind() == ErrorKind::UnknownArgument && has("set")).and_then(|name| {
            let mut of_sound = PARAMETERS.iter().filter(|parameter| parameter.sets.is_some());
            of_sound.find(|parameter| parameter.name.eq_ignore_ascii_case(&name) || parameter.id == name)
        });
    if let Some(Parameter { id, name, flag, .. }) = parameter {
        let how = match flag.strip_prefix("--").filter(|flag| has(flag)) {
            Some(flag) => format!("'--{flag}'"),
            None => format!("'--set {id}=<VALUE>'"),
        };
        let advice = format!("{how} sets {name}; `chalumeau parameters` lists what can be set");
        error.remove(ContextKind::SuggestedArg);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![advice.into()]));
    } else if let Some(flag) = unknown.filter(|_| error.kind() == ErrorKind::UnknownArgument) {
        let wanted = flag.trim_start_matches('-');
        let of_note = ["written", "note"].into_iter().find(|name| has(name));
        let meant = match of_note.filter(|_| shared_args::note(&flag).is_ok()) {
            Some(name) => Some(format!("a note follows its flag: --{name} {flag}")),
            None => {
                let meant = MEANT.iter().find(|(word, known, _)| *word == wanted && has(known));
                meant.map(|(_, _, advice)| (*advice).to_owned())
            }
        };
        let is_far = |near: &str| {
            let near = near.trim_start_matches('-');
            !near.starts_with(wanted) && !is_like(near, wanted)
        };
        match (meant, error.get(ContextKind::SuggestedArg)) {
            (Some(advice), _) => {
                error.remove(ContextKind::SuggestedArg);
                error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![advice.into()]));
            }
            (None, Some(ContextValue::String(near))) if is_far(near) => {
                error.remove(ContextKind::SuggestedArg);
            }
            _ => {}
        }
    }
    error
}

/// Whether `name` may be a slip for a known one. Farther away, it is another word.
fn is_like(known: &str, name: &str) -> bool {
    3 * strsim::osa_distance(known, name) <= name.chars().count()
}

/// Words that others use: for which flag, and what to say.
const MEANT: [(&str, &str, &str); 4] = [
    ("note", "written", "'--written' takes a note as the player reads it, '--sounding' as it sounds"),
    ("velocity", "dynamic", "'--dynamic' sets how loud a note is"),
    ("plot", "figure", "'--figure <FIGURE> --out <FILE>' draws"),
    ("reverb", "set", "'--set room=<VALUE>' sets Room"),
];

/// The names that a command knows.
pub struct Names {
    command: Command,
    /// Whether the command has `--set`, for the ids of parameters.
    sets: bool,
}

impl Names {
    /// Those of a command with these arguments.
    pub fn of<A: Args>() -> Self {
        let command = A::augment_args(Command::new("chalumeau"));
        let sets = command.get_arguments().any(|arg| arg.get_long() == Some("set"));
        Self { command, sets }
    }

    /// Fails if the command knows no such name, and says the nearest that it knows.
    pub fn check(&self, name: &str) -> Result<(), String> {
        if self.takes_value(name).is_some() || self.is_midi(name) || self.is_id(name) {
            return Ok(());
        }
        let flags = self.command.get_arguments().filter_map(Arg::get_long);
        let ids = PARAMETERS.iter().map(|parameter| parameter.id).filter(|_| self.sets);
        let known: Vec<_> = flags.chain(ids).collect();
        let all = known.join(", ");
        let begin: Vec<_> = known.iter().copied().filter(|known| known.starts_with(name)).collect();
        let near = if name.is_empty() || begin.is_empty() {
            let nearest = known.into_iter().min_by_key(|known| strsim::osa_distance(known, name));
            nearest.filter(|near| is_like(near, name)).map(str::to_owned)
        } else {
            Some(one_of(&begin))
        };
        let what = if self.sets { "no flag here and no parameter" } else { "no argument" };
        Err(match near {
            Some(near) => format!("{what} is called {name:?}; do you mean {near}?"),
            None if self.sets => format!(
                "{what} is called {name:?}; `chalumeau render --help` and `chalumeau parameters` list them"
            ),
            None => format!("{what} is called {name:?}; there are {all}"),
        })
    }

    /// The words of these names and values. An empty value leaves its name out.
    pub fn words<'a>(
        &self,
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Vec<String>, String> {
        let mut words = Vec::new();
        for (name, value) in pairs {
            match (self.takes_value(name), value) {
                (_, "") => {}
                (None, _) if self.is_midi(name) => words.push(value.to_owned()),
                (Some(false), "true") => words.push(format!("--{name}")),
                (Some(false), "false") => {}
                (Some(false), other) => return Err(format!("{name} must be true or false, got {other}")),
                // With a = a value may begin with a minus.
                (Some(true), _) => words.push(format!("--{name}={value}")),
                (None, _) => words.extend(["--set".to_owned(), format!("{name}={value}")]),
            }
        }
        Ok(words)
    }

    /// Whether the flag of this name takes a value; `None` if there is no such flag.
    fn takes_value(&self, name: &str) -> Option<bool> {
        let arg = self.command.get_arguments().find(|arg| arg.get_long() == Some(name))?;
        Some(matches!(arg.get_action(), ArgAction::Set | ArgAction::Append))
    }

    /// The MIDI file has no dashes.
    fn is_midi(&self, name: &str) -> bool {
        name == "midi" && self.command.get_arguments().any(|arg| arg.get_id() == "midi")
    }

    fn is_id(&self, name: &str) -> bool {
        self.sets && parameters::find(name).is_some()
    }

    /// The words of names and values from a program. There a name may have underscores for hyphens, and may be that under
    /// which hosts list a parameter. A flag takes plain numbers; a value with a unit is set by the id of the same parameter.
    pub fn words_of_program(&self, pairs: &[(String, String)]) -> Result<Vec<String>, String> {
        let mut words = Vec::new();
        for (name, value) in pairs {
            let find = |same: &dyn Fn(&Parameter) -> bool| {
                let mut of_sound =
                    PARAMETERS.iter().filter(|parameter| self.sets && parameter.sets.is_some());
                of_sound.find(|parameter| same(parameter)).map(|parameter| parameter.id)
            };
            let hyphens = name.replace('_', "-");
            let flag = [name, &hyphens].into_iter().find(|name| self.takes_value(name).is_some());
            let id = match flag {
                Some(flag) if self.takes_value(flag) == Some(true) && value.parse::<f64>().is_err() => {
                    find(&|parameter| parameter.flag.strip_prefix("--") == Some(flag))
                }
                Some(_) => None,
                None => find(&|parameter| parameter.name.eq_ignore_ascii_case(name.trim())),
            };
            match id {
                Some(_) if value.is_empty() => {}
                Some(id) => words.extend(["--set".to_owned(), format!("{id}={value}")]),
                None => {
                    let name = flag.unwrap_or(name);
                    self.check(name)?;
                    words.extend(self.words([(name.as_str(), value.as_str())])?);
                }
            }
        }
        Ok(words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::render::RenderCommand;

    #[test]
    fn commands_are_quoted_for_a_shell() {
        let words = ["render", "--noise=50 %", "--preset=Player's own", ""];
        assert_eq!(typed(words), r"render '--noise=50 %' '--preset=Player'\''s own' ''");
    }

    #[test]
    fn names_that_begin_so_are_meant_before_those_that_look_alike() {
        let said = |name: &str| Names::of::<RenderCommand>().check(name).unwrap_err();
        let reed = said("reed");
        assert!(reed.contains("reed-stiffness") && reed.ends_with("?"), "{reed}");
        assert!(said("gama").ends_with("do you mean gamma?"), "{}", said("gama"));
        let none = said("qqq");
        assert!(!none.contains("do you mean") && none.contains("render --help"), "{none}");
    }
}
