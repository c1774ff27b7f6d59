//! `sombrero catalogue export`.

use crate::answer::{Answer, Context, Outcome};
use crate::catalogue::{self, Originals, UnlockArgs};
use crate::failure::Failure;
use crate::files;
use crate::table::Table;
use serde_json::json;
use sombrero::io::{Access, Output, is_plain_path};
use sombrero_catalogue::Entry;
use std::path::{Path, PathBuf};

// What is typed after `sombrero catalogue export`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the catalogue.
    catalogue: PathBuf,
    /// The original, by the name that `catalogue list` prints.
    name: String,
    /// The file to write; what belongs to it goes beside it. Default: as it was called, in this folder.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// A folder to write its keys to.
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
    #[command(flatten)]
    unlock: UnlockArgs,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    let catalogue = args.catalogue.display();
    if let Some(output) = &args.output {
        files::check_standard_output(output, context)?;
    }
    let Some(entry) = catalogue::open(&args.catalogue)?.entry(&args.name)? else {
        let name = &args.name;
        let message =
            format!("{name}: no original of {catalogue}; `sombrero catalogue list` prints their names");
        return Err(Failure::new("catalogue", message));
    };
    let kept = catalogue::vault(&args.catalogue)?.filter(|vault| vault.has_original(&entry.digest));
    let Some(vault) = kept else {
        let message = format!(
            "{}: {catalogue} does not keep this original, only its shape; look for it in {}",
            entry.name, entry.place
        );
        return Err(Failure::new("catalogue", message));
    };
    let opened = args.unlock.unlock(&vault)?;
    let originals = Originals::new(&args.catalogue, Some(opened), None, context)?;
    let original = export(args, &originals, &entry)?;
    let keys = match &args.keys {
        Some(folder) => export_keys(args, &originals, &entry, folder)?,
        None => Vec::new(),
    };
    let shown = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    let (original, keys) = (shown(&original), shown(&keys));
    let text = Table::new(format!("exported {} → {}", entry.name, original.join(", ")));
    let text =
        text.rows("keys", args.keys.as_ref().map(|folder| format!("{} in {}", keys.len(), folder.display())));
    let json = json!({ "original": entry.name, "sha256": hex::encode(entry.digest), "files": original, "keys": keys });
    let answer = Answer::new(text, &json)?;
    Ok(match &args.output {
        Some(output) => files::answered(output, answer),
        None => Outcome::Answer(answer),
    })
}

/// Writes the original and what belongs to it; gives the files.
fn export(args: &Args, originals: &Originals, entry: &Entry) -> Result<Vec<PathBuf>, Failure> {
    let kept = originals.files(entry)?;
    // What comes out is what went in.
    originals.parsed(entry, kept.clone())?;
    let first = match &args.output {
        Some(output) => output.clone(),
        None => plain(&kept[0].name)?.to_owned(),
    };
    let mut paths = vec![first.clone()];
    for file in &kept[1..] {
        if files::is_standard(&first) {
            let message =
                format!("{}: has files beside it, so it needs a name; give --output FILE", entry.name);
            return Err(Failure::new("usage", message));
        }
        paths.push(first.with_file_name(plain(&file.name)?));
    }
    files::check_outputs(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &[], args.force)?;
    for path in &paths[1..] {
        path.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or(Ok(()), files::make_folder)?;
    }
    write(paths.iter().zip(&kept).map(|(path, file)| (path, &file.bytes)), args.force)?;
    Ok(paths)
}

fn export_keys(
    args: &Args,
    originals: &Originals,
    entry: &Entry,
    folder: &Path,
) -> Result<Vec<PathBuf>, Failure> {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        folder.join(name.strip_suffix(".age").unwrap_or(&name))
    };
    let kept = originals.keys(entry)?;
    let paths: Vec<PathBuf> = kept.iter().map(|key| name(&key.path)).collect();
    files::check_outputs(&paths.iter().map(PathBuf::as_path).collect::<Vec<_>>(), &[], args.force)?;
    files::make_private_folder(folder)?;
    write(paths.iter().zip(&kept).map(|(path, key)| (path, &key.bytes)), args.force)?;
    Ok(paths)
}

/// Writes files for the owner alone, all or none.
fn write<'a>(contents: impl Iterator<Item = (&'a PathBuf, &'a Vec<u8>)>, force: bool) -> Result<(), Failure> {
    let outputs: Vec<Output<'_>> =
        contents.map(|(path, bytes)| Output { path, bytes, access: Access::Private }).collect();
    files::write_all(&outputs, force)
}

/// A name that leads downwards only: whoever can write to the vault could have put another one in.
fn plain(name: &str) -> Result<&Path, Failure> {
    if is_plain_path(name) {
        return Ok(Path::new(name));
    }
    Err(Failure::new(
        "vault",
        format!("{name}: a file of this name leads out of the folder; it was not written"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_downwards() {
        for name in ["vase.obj", "textures/wood.png", "./scene.bin"] {
            assert_eq!(plain(name).ok(), Some(Path::new(name)));
        }
        for name in ["../vase.obj", "a/../../b", "/etc/passwd", "C:\\vase.obj", "..\\vase.obj"] {
            assert!(plain(name).is_err(), "{name}");
        }
    }
}
