//! A folder of copies, one of each input, with their keys in its subfolder `keys`. What is there already is kept, so that
//! a run which was broken off goes on where it was.

use super::Place;
use crate::args::Embed;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, Outcome, batch, files};
use serde_json::json;
use sombrero::watermark::{Identity, Key, OriginalDigest, Parameters, Secret};
use std::path::{Path, PathBuf};

pub(super) fn run(args: &Embed, folder: &Path, context: &Context) -> Result<Outcome, Failure> {
    let inputs = batch::expand(&args.inputs)?;
    let given = files::given_secret(args.secret_file.as_deref())?;
    let keys = folder.join("keys");
    let mut taken: Vec<PathBuf> = Vec::new();
    batch::each(&inputs, "input", context, |input| {
        let name = input.file_name().filter(|_| !files::is_standard(input));
        let name =
            name.ok_or_else(|| Failure::new("usage", "a copy of standard input has no name; give a file"))?;
        let output = folder.join(name);
        if taken.contains(&output) {
            let message =
                format!("{}: two inputs have this name; mark them into different folders", output.display());
            return Err(Failure::new("write", message));
        }
        taken.push(output.clone());
        let key = keys.join(name).with_added_extension("key");
        copy(args, folder, &Place { input, output: &output, key: &key }, given, context)
    })
}

fn copy(
    args: &Embed,
    folder: &Path,
    place: &Place<'_>,
    given: Option<Secret>,
    context: &Context,
) -> Result<Answer, Failure> {
    let Place { input, output, key } = *place;
    let _progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context.limits)?;
    let identity = Identity { owner: args.owner.clone(), recipient: args.recipient.clone() };
    let digest = OriginalDigest::of(&original.content());
    if !args.force && is_done(args, place, &identity, &digest)? {
        let [input, output, key] = [input, output, key].map(|path| path.display().to_string());
        let text = format!("kept {output}, which was marked before");
        return Answer::new(text, &json!({ "input": input, "output": output, "key": key, "kept": true }));
    }
    files::check_outputs(&[output, key], &[input], args.force)?;
    let secret = own_secret(given, &digest, &identity)?;
    let marked = super::mark(args, &original, input, output, secret)?;
    make_folders(folder)?;
    super::write(&marked, &original, place, &[input], args.force, context.limits)?;
    let mut answer = super::answer(place, &marked.report)?;
    answer.json["input"] = input.display().to_string().into();
    answer.json["kept"] = false.into();
    Ok(answer)
}

/// The folder and its `keys`, which is given back. Only the owner may look into a new one.
pub(super) fn make_folders(folder: &Path) -> Result<PathBuf, Failure> {
    let keys = folder.join("keys");
    let is_new = !keys.exists();
    files::make_folder(folder)?;
    files::make_folder(&keys)?;
    if is_new {
        make_private(&keys)?;
    }
    Ok(keys)
}

#[cfg(unix)]
fn make_private(folder: &Path) -> Result<(), Failure> {
    use std::os::unix::fs::PermissionsExt;
    let private = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder, private).map_err(|e| Failure::about("write", folder, &e))
}

#[cfg(not(unix))]
fn make_private(_: &Path) -> Result<(), Failure> {
    Ok(())
}

/// Whether this copy was made before: its key is there and was made for this original, identity and these parameters.
/// A key gets its name after the copy is whole. Other files by these names are an error.
pub(super) fn is_done(
    args: &Embed,
    place: &Place<'_>,
    identity: &Identity,
    original: &OriginalDigest,
) -> Result<bool, Failure> {
    if !(place.key.exists() && place.output.exists()) {
        return Ok(false);
    }
    let key = files::read_key(place.key)?;
    if key.identity == *identity && key.check_watermark(original).is_ok() && was_asked_for(args, &key) {
        return Ok(true);
    }
    let message = format!(
        "{}: was made for another file, owner or recipient, or with other parameters; choose another folder or give --force",
        place.key.display()
    );
    Err(Failure::new("write", message))
}

/// A small mesh may have got fewer coefficients, and a limited displacement a smaller ε.
fn was_asked_for(args: &Embed, key: &Key) -> bool {
    let Parameters { basis, epsilon } = super::parameters(args);
    let made = key.parameters;
    let coefficients = match args.coefficients {
        Some(asked) => made.basis.coefficients == asked,
        None => made.basis.coefficients <= basis.coefficients,
    };
    let strength =
        if args.max_displacement.is_some() { made.epsilon <= epsilon } else { made.epsilon == epsilon };
    coefficients
        && strength
        && made.basis.function == basis.function
        && made.basis.amplitudes == basis.amplitudes
}

/// A copy's own secret: a new one, or one that follows from the given one, original and texts, so that the
/// key of one copy tells nothing about those of others.
pub(super) fn own_secret(
    given: Option<Secret>,
    original: &OriginalDigest,
    identity: &Identity,
) -> Result<Secret, Failure> {
    match given {
        Some(given) => Ok(given.for_copy(original, identity)),
        None => files::new_secret(),
    }
}
