//! A folder of copies with the keys in its subfolder `keys`: making it, and what is there from an earlier run.

use super::copy::Place;
use crate::answer::Context;
use crate::failure::Failure;
use crate::files;
use crate::terminal::complain;
use sombrero::EmbedOptions;
use sombrero::basis::{BasisFunction, BasisOptions};
use sombrero::watermark::{Identity, Key, OriginalDigest, Parameters, Preset, Secret};
use std::path::{Path, PathBuf};

/// The folder and its `keys`, which is given back. Only the owner may look into that one.
pub(super) fn make_folders(folder: &Path, context: &Context) -> Result<PathBuf, Failure> {
    let keys = folder.join("keys");
    files::make_folder(folder)?;
    if files::make_private_folder(&keys)? && !context.quiet {
        complain(&format!(
            "{}: others could look into this folder of keys; now only you can",
            keys.display()
        ));
    }
    Ok(keys)
}

/// What an earlier run left of a copy.
pub(super) enum Before {
    Nothing,
    /// The key, which gets its name first: the copy can be made again from it.
    Key(Box<Key>),
    /// The copy and its key.
    All,
}

/// What is there of a copy of this original for this identity with these parameters. Other files by these names are an
/// error.
pub(super) fn before(
    options: &EmbedOptions,
    place: &Place<'_>,
    identity: &Identity,
    original: &OriginalDigest,
) -> Result<Before, Failure> {
    if !place.key.exists() {
        return Ok(Before::Nothing);
    }
    let key = files::read_key(place.key)?;
    if key.identity != *identity || key.check_original(original).is_err() || !was_asked_for(options, &key) {
        return Err(other_key(place.key));
    }
    Ok(if place.output.exists() { Before::All } else { Before::Key(Box::new(key)) })
}

/// Two keys in one place.
pub(super) fn other_key(path: &Path) -> Failure {
    let message = format!(
        "{}: was made for another file, owner or recipient, or with other parameters; choose another folder or give --force",
        path.display()
    );
    Failure::new("write", message)
}

/// A small mesh may have got fewer coefficients, and any mesh fewer fields, and a limited displacement a smaller ε.
fn was_asked_for(options: &EmbedOptions, key: &Key) -> bool {
    let Parameters { preset, basis, epsilon } = options.parameters;
    let robust = Preset::Robust.parameters();
    let made = key.parameters;
    let may_be_fewer = options.fewer_if_small || basis.function == BasisFunction::Field;
    let coefficients = match may_be_fewer {
        false => made.basis.coefficients == basis.coefficients,
        true => made.basis.coefficients <= basis.coefficients,
    };
    let strength =
        if options.max_displacement.is_some() { made.epsilon <= epsilon } else { made.epsilon == epsilon };
    // What nothing of moves unseen was marked with the preset robust.
    let made_do = options.fewer_if_small
        && preset == Some(Preset::Faithful)
        && made
            == Parameters {
                basis: BasisOptions { coefficients: made.basis.coefficients, ..robust.basis },
                ..robust
            };
    made_do
        || coefficients
            && strength
            && made.preset == preset
            && made.basis.function == basis.function
            && made.basis.amplitudes == basis.amplitudes
}

/// A copy's own secret: a new one, or one that follows from the given one, so that the key of one copy tells nothing about
/// those of others.
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
