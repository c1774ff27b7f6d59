//! Several inputs: every one is handled, one line each, and a summary tells how many came to what.

use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use serde_json::json;
use std::path::{Path, PathBuf};

/// An input file, as it was given or found in a folder.
pub(crate) struct Input {
    pub(crate) path: PathBuf,
    /// What it is called among the inputs: its name, with the folders below the one that was given.
    pub(crate) name: PathBuf,
}

/// Input files, as they were given and those of folders.
pub(crate) struct Inputs {
    pub(crate) files: Vec<Input>,
    /// Whether one file was given, whose answer is the whole answer.
    pub(crate) one: bool,
}

impl Inputs {
    /// The files that were given and those below folders; not those in the folder `without`, where outputs go.
    pub(crate) fn new(given: &[PathBuf], without: Option<&Path>) -> Result<Self, Failure> {
        let mut files = Vec::new();
        for path in given {
            if path.is_dir() {
                let found = files::meshes_in(path, without)?.into_iter();
                files.extend(found.map(|file| {
                    let name = file.strip_prefix(path).unwrap_or(&file).to_owned();
                    Input { path: file, name }
                }));
            } else {
                let name = path.file_name().map_or_else(|| path.clone(), PathBuf::from);
                files.push(Input { path: path.clone(), name });
            }
        }
        Ok(Self { files, one: matches!(given, [only] if !only.is_dir()) })
    }
}

/// What became of several inputs.
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct Counts {
    pub(crate) done: usize,
    /// Done before, and kept.
    pub(crate) kept: usize,
    /// Looked at, and nothing was found.
    pub(crate) not_found: usize,
    pub(crate) failed: usize,
}

/// What a command calls them.
pub(crate) struct Words {
    /// What an input is in JSON.
    pub(crate) role: &'static str,
    /// What `done`, `kept` and `not_found` are called; those without a name are left out.
    pub(crate) outcomes: [Option<&'static str>; 3],
    pub(crate) failed: &'static str,
}

impl Counts {
    fn total(&self) -> usize {
        self.done + self.kept + self.not_found + self.failed
    }

    /// The exit status: failures first, then whether anything was done or found.
    fn status(&self) -> u8 {
        match self {
            Self { failed: 1.., .. } => 2,
            Self { done: 0, kept: 0, .. } => 1,
            _ => 0,
        }
    }

    fn summary(&self, words: &Words) -> Answer {
        let named = words.outcomes.into_iter().zip([self.done, self.kept, self.not_found]);
        let all: Vec<(&str, usize)> = named
            .filter_map(|(name, count)| Some((name?, count)))
            .chain([(words.failed, self.failed)])
            .collect();
        let mut summary = json!({ "files": self.total() });
        for (name, count) in &all {
            summary[name.replace(' ', "_")] = (*count).into();
        }
        let counts: Vec<String> = all.iter().map(|(name, count)| format!("{count} {name}")).collect();
        let text = Table::new(format!("{} files: {}", self.total(), counts.join(", ")));
        Answer { text, json: json!({ "summary": summary }), status: self.status() }
    }
}

/// Does the work for each input, given what belongs to it, and prints what came of it as soon as it is there; then, unless it
/// was one, a summary. The answer of an input says in JSON under `kept` whether it was kept.
pub(crate) fn each<T>(
    inputs: &[(PathBuf, T)],
    words: &Words,
    context: &Context,
    mut work: impl FnMut(&Path, &T) -> Result<Answer, Failure>,
) -> Result<Outcome, Failure> {
    let mut counts = Counts::default();
    for (input, its) in inputs {
        match work(input, its) {
            Ok(answer) => {
                let status = context.print(&answer, false)?;
                let count = match (status, answer.json["kept"].as_bool()) {
                    (0, Some(true)) => &mut counts.kept,
                    (0, _) => &mut counts.done,
                    _ => &mut counts.not_found,
                };
                *count += 1;
            }
            Err(failure) => {
                context.report(&failure, words.role, input);
                counts.failed += 1;
            }
        }
    }
    if inputs.len() != 1 {
        context.print(&counts.summary(words), false)?;
    }
    Ok(Outcome::Printed(counts.status()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_status_tells_some_from_none() {
        let status = |done, kept, not_found, failed| Counts { done, kept, not_found, failed }.status();
        assert_eq!([status(2, 0, 0, 0), status(1, 0, 5, 0), status(0, 3, 0, 0)], [0; 3]);
        assert_eq!([status(0, 0, 4, 0), status(0, 0, 0, 0)], [1; 2]);
        assert_eq!([status(0, 0, 1, 1), status(3, 0, 0, 1)], [2; 2]);
    }

    #[test]
    fn a_summary_names_what_the_command_does() {
        let words =
            Words { role: "suspect", outcomes: [Some("found"), None, Some("not found")], failed: "refused" };
        let answer = Counts { done: 2, kept: 0, not_found: 1, failed: 1 }.summary(&words);
        assert_eq!(answer.text.to_string(), "4 files: 2 found, 1 not found, 1 refused");
        assert_eq!(answer.json, json!({"summary": {"files": 4, "found": 2, "not_found": 1, "refused": 1}}));
        assert_eq!(answer.status, 2);
    }
}
