//! Several inputs: every one is handled, one line each, and the worst exit status counts.

use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use std::path::{Path, PathBuf};

/// Input files, as they were given and those of folders.
pub(crate) struct Inputs {
    pub(crate) paths: Vec<PathBuf>,
    /// Whether one file was given, whose answer is the whole answer.
    pub(crate) one: bool,
}

impl Inputs {
    pub(crate) fn new(given: &[PathBuf]) -> Result<Self, Failure> {
        let files =
            |path: &PathBuf| if path.is_dir() { files::meshes_in(path) } else { Ok(vec![path.clone()]) };
        let paths = given.iter().map(files).collect::<Result<Vec<_>, _>>()?.concat();
        Ok(Self { paths, one: matches!(given, [only] if !only.is_dir()) })
    }
}

/// Does the work for each input, given what belongs to it, and prints what came of it as soon as it is there. `role` names
/// the input in JSON.
pub(crate) fn each<T>(
    inputs: &[(PathBuf, T)],
    role: &str,
    context: &Context,
    mut work: impl FnMut(&Path, &T) -> Result<Answer, Failure>,
) -> Result<Outcome, Failure> {
    let mut worst = 0;
    for (input, its) in inputs {
        let status = match work(input, its) {
            Ok(answer) => context.print(&answer, false)?,
            Err(failure) => {
                failure.report_for(role, input, context.json);
                2
            }
        };
        worst = worst.max(status);
    }
    Ok(Outcome::Printed(worst))
}
