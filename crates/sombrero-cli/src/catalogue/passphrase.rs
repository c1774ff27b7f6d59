//! Where a passphrase comes from: a file, the environment, or whoever sits at the terminal. Never the command line, which
//! others can read.

use crate::failure::Failure;
use crate::files;
use sombrero_vault::SecretString;
use std::path::Path;

/// The environment variable that may hold a passphrase.
const PASSPHRASE: &str = "SOMBRERO_PASSPHRASE";

/// Longer than anybody types.
const LONGEST: u64 = 4096;

/// Whether a passphrase comes without anybody being asked.
pub(super) fn is_given(file: Option<&Path>) -> bool {
    file.is_some() || std::env::var_os(PASSPHRASE).is_some()
}

/// The passphrase that opens `whose`.
pub(super) fn asked(file: Option<&Path>, whose: &str) -> Result<SecretString, Failure> {
    match given(file)? {
        Some(given) => Ok(given),
        None => typed(&format!("passphrase of {whose}: ")),
    }
}

/// A new passphrase for `whose`; typed twice, since a slip would lock the owner out.
pub(super) fn chosen(file: Option<&Path>, whose: &str) -> Result<SecretString, Failure> {
    if let Some(given) = given(file)? {
        return Ok(given);
    }
    let first = typed(&format!("new passphrase for {whose} (write it down; nothing is read without it): "))?;
    let second = typed("the same again: ")?;
    use_same(first, &second)
}

fn use_same(first: SecretString, second: &SecretString) -> Result<SecretString, Failure> {
    use sombrero_vault::ExposeSecret;
    if first.expose_secret() == second.expose_secret() {
        return Ok(first);
    }
    Err(Failure::new("passphrase", "the two passphrases differ; try again"))
}

/// The first line of the file, or the environment's.
fn given(file: Option<&Path>) -> Result<Option<SecretString>, Failure> {
    let unreadable = |place: &str| {
        Failure::new("passphrase", format!("{place}: the passphrase is not in UTF-8; write it in UTF-8"))
    };
    if let Some(path) = file {
        let bytes = files::read_small(path, LONGEST, "a file with the passphrase in its first line")?;
        let text = String::from_utf8(bytes).map_err(|_| unreadable(&path.display().to_string()))?;
        return Ok(Some(SecretString::from(text.lines().next().unwrap_or_default().to_owned())));
    }
    let Some(value) = std::env::var_os(PASSPHRASE) else { return Ok(None) };
    value.into_string().map(|text| Some(SecretString::from(text))).map_err(|_| unreadable(PASSPHRASE))
}

fn typed(prompt: &str) -> Result<SecretString, Failure> {
    let typed = rpassword::prompt_password(prompt).map_err(|e| {
        let message = format!(
            "the passphrase cannot be asked for ({e}); run it in a terminal, give --passphrase-file FILE or set {PASSPHRASE}"
        );
        Failure::new("passphrase", message)
    })?;
    Ok(SecretString::from(typed))
}
