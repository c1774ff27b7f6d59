//! Reading keys and secrets, and care with outputs.

use crate::failure::Failure;
use sombrero::StoredBasis;
use sombrero::io::{Limits, Overwrite, read_bytes};
use sombrero::watermark::{Key, Secret};
use std::path::{Path, PathBuf};

/// A key of a million coefficients has about 20 MB.
pub(crate) const LARGEST_KEY: u64 = 64 << 20;

pub(crate) fn read_key(path: &Path) -> Result<Key, Failure> {
    let bytes = read_small(path, LARGEST_KEY)?;
    Key::from_json(&bytes).map_err(|e| Failure::about("key", path, &e))
}

/// Where `prepare` writes and `detect` looks unless told otherwise: KEY.prepared.
pub(crate) fn beside_key(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".prepared");
    name.into()
}

pub(crate) fn read_prepared(path: &Path, key: &Key, limits: Limits) -> Result<StoredBasis, Failure> {
    let bytes = read_bytes(path, limits)?;
    StoredBasis::parse(&bytes, key).map_err(|e| Failure::about("prepared", path, &e))
}

/// The secret in a file of 64 hexadecimal digits, or a new one from the operating system.
pub(crate) fn secret(path: Option<&Path>) -> Result<Secret, Failure> {
    let Some(path) = path else {
        let mut bytes = [0; 32];
        return match getrandom::fill(&mut bytes) {
            Ok(()) => Ok(Secret(bytes)),
            Err(e) => Err(Failure::new(
                "secret",
                format!("the operating system gives no randomness ({e}); use --secret-file"),
            )),
        };
    };
    let bytes = read_small(path, 4096)?;
    let text = String::from_utf8_lossy(&bytes);
    Secret::from_hex(&text).map_err(|e| Failure::about("secret", path, &e))
}

/// The whole of a regular file that is no larger than `most` bytes.
pub(crate) fn read_small(path: &Path, most: u64) -> Result<Vec<u8>, Failure> {
    Ok(read_bytes(path, Limits::default().with_max_bytes(most))?)
}

pub(crate) fn overwrite(force: bool) -> Overwrite {
    if force { Overwrite::Allow } else { Overwrite::Refuse }
}

/// Where a path leads, however it is spelled; for a file that is not there, its folder decides.
fn place(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
}

/// Refuses outputs that exist before any work is done, unless `force`; and always those that are an input
/// or each other.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path], force: bool) -> Result<(), Failure> {
    let same = |a: &Path, b: &Path| a == b || matches!((place(a), place(b)), (Some(a), Some(b)) if a == b);
    for (i, output) in outputs.iter().enumerate() {
        if inputs.iter().any(|input| same(output, input)) {
            let message =
                format!("{}: the output would replace an input; choose another name", output.display());
            return Err(Failure::new("write", message));
        }
        if outputs[..i].iter().any(|other| same(output, other)) {
            let message = format!("{}: two outputs have the same name; choose another one", output.display());
            return Err(Failure::new("write", message));
        }
        if !force && output.symlink_metadata().is_ok() {
            let message =
                format!("{}: already exists; choose another name or give --force", output.display());
            return Err(Failure::new("write", message));
        }
    }
    Ok(())
}
