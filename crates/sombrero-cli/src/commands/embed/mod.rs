//! `sombrero embed`: one copy, a copy of each of several files, or a copy for each buyer.

pub(crate) mod args;
mod copies;
mod copy;
mod folder;
mod recipients;

use crate::answer::{Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use args::{Args, Order, Plan, Target};
use copy::{Place, answer, mark, write};
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    let Plan { inputs, target, order } = Plan::new(args)?;
    match target {
        Target::Recipients { folder, list } => recipients::run(inputs, folder, list, &order, context),
        Target::Folder(folder) => copies::run(inputs, folder, &order, context),
        Target::Files { output, key } => one(inputs, output, key, &order, context),
    }
}

/// One copy of one file.
fn one(
    inputs: &[PathBuf],
    output: &Path,
    key: &Path,
    order: &Order<'_>,
    context: &Context,
) -> Result<Outcome, Failure> {
    let input = check_one(inputs)?;
    files::check_standard_output(output, context)?;
    if files::is_standard(key) {
        return Err(Failure::new("usage", "a key is not printed, it is secret; give it the name of a file"));
    }
    let inputs: Vec<&Path> = [input].into_iter().chain(order.secret_file()).collect();
    files::check_outputs(&[output, key], &inputs, order.force)?;
    let secret = match order.secret()? {
        Some(secret) => secret,
        None => files::new_secret()?,
    };
    let _progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context.limits)?;
    let place = Place { input, output, key };
    let marked = mark(order, &original, &place, secret)?;
    write(&marked, &original, &place, &inputs, None, order.force, context.limits)?;
    Ok(files::answered(output, answer(&place, &marked.report)?))
}

/// The one input, a file, whose copy the output shall be.
fn check_one(inputs: &[PathBuf]) -> Result<&Path, Failure> {
    let input = &inputs[0];
    if let Some(second) = inputs.get(1) {
        let message = format!(
            "{}: a second input cannot share the output; give --out-dir instead of -o and --key",
            second.display()
        );
        return Err(Failure::new("usage", message));
    }
    if input.is_dir() {
        let message = format!(
            "{}: a folder, not a regular file; give --out-dir instead of -o and --key",
            input.display()
        );
        return Err(Failure::new("read", message));
    }
    Ok(input)
}
