//! Bytes encrypted in the age format (age-encryption.org/v1), and back.

use age::{DecryptError, Decryptor, Encryptor, Identity, Recipient};
use std::io::{self, Read, Write};

/// What `write` says, encrypted to all of `recipients`, each of whom can read it alone.
pub(crate) fn sealed(
    recipients: &[impl Recipient],
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<Vec<u8>> {
    let to = recipients.iter().map(|recipient| recipient as &dyn Recipient);
    let encryptor = Encryptor::with_recipients(to).map_err(io::Error::other)?;
    let mut bytes = Vec::new();
    let mut stream = encryptor.wrap_output(&mut bytes)?;
    write(&mut stream)?;
    stream.finish()?;
    Ok(bytes)
}

/// What was encrypted, as a stream whose every 64 KiB are authenticated before they are given out.
pub(crate) fn unsealed<'a>(
    bytes: &'a [u8],
    identities: &'a [impl Identity],
) -> Result<impl Read + 'a, DecryptError> {
    let with = identities.iter().map(|identity| identity as &dyn Identity);
    Decryptor::new_buffered(bytes)?.decrypt(with)
}

/// Why not, in words for the end of a sentence.
pub(crate) fn problem(error: &DecryptError) -> String {
    match error {
        DecryptError::NoMatchingKeys => "it was encrypted to somebody else".into(),
        DecryptError::UnknownFormat => "it is of an age version that is not known".into(),
        DecryptError::Io(error) => error.to_string(),
        _ => "it cannot be decrypted".into(),
    }
}
