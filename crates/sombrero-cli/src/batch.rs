//! Several inputs: every one is handled, one line each, and the worst exit status counts.

use crate::failure::Failure;
use crate::{Answer, Context, Outcome, files};
use std::path::{Path, PathBuf};

/// Files as they were given, and those of folders.
pub(crate) fn expand(given: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let lists =
        given.iter().map(|path| if path.is_dir() { files::meshes_in(path) } else { Ok(vec![path.clone()]) });
    Ok(lists.collect::<Result<Vec<_>, _>>()?.concat())
}

/// Whether these stand for one file, whose answer is the whole answer.
pub(crate) fn is_one(given: &[PathBuf]) -> bool {
    matches!(given, [only] if !only.is_dir())
}

/// Does the work for each input and prints what came of it as soon as it is there. `role` names the input in JSON.
pub(crate) fn each(
    inputs: &[PathBuf],
    role: &str,
    context: &Context,
    mut work: impl FnMut(&Path) -> Result<Answer, Failure>,
) -> Result<Outcome, Failure> {
    let mut worst = 0;
    for input in inputs {
        let status = match work(input) {
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
