//! `sombrero embed`: one copy, a copy of each of several files, or a copy for each buyer.

pub(crate) mod args;
mod copies;
mod copy;
mod folder;
mod keeping;
mod recipients;

use crate::answer::{Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use args::{Args, Order, Plan, Target};
use copy::{Place, answer, mark, write};
use keeping::Keeping;
use sombrero::io::{Document, Format};
use std::ffi::OsStr;
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
    output: Option<&Path>,
    key: Option<&Path>,
    order: &Order<'_>,
    context: &Context,
) -> Result<Outcome, Failure> {
    let input = check_one(inputs)?;
    if files::is_standard(input) && (output.is_none() || key.is_none()) {
        let message = "a copy of standard input and its key need names; give --output and --key";
        return Err(Failure::new("usage", message));
    }
    if let Some(output) = output {
        files::check_standard_output(output, context)?;
    }
    let key = key.map_or_else(|| input.with_extension("key"), Path::to_owned);
    if files::is_standard(&key) {
        return Err(Failure::new("usage", "a key is not printed, it is secret; give it the name of a file"));
    }
    let inputs: Vec<&Path> = [input].into_iter().chain(order.secret_file()).collect();
    // As much as can be is found out before any work is done.
    let named: Vec<&Path> = output.into_iter().chain([key.as_path()]).collect();
    files::check_outputs(&context.desk.on_disk(&named), &inputs, order.force)?;
    let secret = match order.secret(context.desk)? {
        Some(secret) => secret,
        None => files::new_secret()?,
    };
    let mut keeping = Keeping::new(order)?;
    let _progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context)?;
    let output = output.map_or_else(|| beside(input, &original), Path::to_owned);
    files::check_format(&output, &original)?;
    files::check_outputs(&context.desk.on_disk(&[&output, &key]), &inputs, order.force)?;
    let place = Place { input, output: &output, key: &key };
    let marked = mark(order, &original, &place, secret)?;
    write(&marked, &original, &place, &inputs, None, order.force, context)?;
    let answer = answer(&place, &marked.report)?;
    let name = Path::new(input.file_name().unwrap_or_default());
    Ok(files::answered(&output, keeping.keep(original, input, name, &[key], answer)?))
}

/// INPUT-marked, with the extension of the input, or, where that is of another format, with one that is not.
fn beside(input: &Path, original: &Document) -> PathBuf {
    let mut name = input.file_stem().unwrap_or_default().to_owned();
    name.push("-marked");
    let own = input.extension().and_then(OsStr::to_str);
    let fits = own.and_then(Format::from_extension).is_none_or(|f| f.extension() == original.extension());
    let extension = own.filter(|_| fits).unwrap_or(original.extension());
    input.with_file_name(name).with_added_extension(extension)
}

/// The one input, a file, whose copy the output shall be.
fn check_one(inputs: &[PathBuf]) -> Result<&Path, Failure> {
    let input = &inputs[0];
    if let Some(second) = inputs.get(1) {
        let message = format!("{}: a second input; give --out-dir for copies of several", second.display());
        return Err(Failure::new("usage", message));
    }
    if input.is_dir() {
        let message = format!(
            "{}: a folder, not a regular file; give --out-dir for the copies of what is in it",
            input.display()
        );
        return Err(Failure::new("read", message));
    }
    Ok(input)
}
