//! The secret half of a key pair of age, as its text says it.

use crate::error::VaultError;
use crate::seal;
use age::secrecy::{ExposeSecret, SecretString};
use age::{scrypt, x25519};
use std::io::{self, Read};

/// scrypt works through 2^18 blocks of 1 KiB, 256 MB, in about a second: what `age -p` takes too (RFC 7914).
const WORK: u8 = 18;

/// The most work that somebody else's file may ask for: 4 GB.
const MOST_WORK: u8 = 22;

/// What every file of age that is not armoured begins with.
const ENCRYPTED: &[u8] = b"age-encryption.org/";

/// An identity file of age as it was read: lines with secret keys, or those lines encrypted with a passphrase.
pub struct IdentityText {
    place: String,
    bytes: Vec<u8>,
}

impl std::fmt::Debug for IdentityText {
    /// Without the text, which may be secret.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "IdentityText({:?})", self.place)
    }
}

impl IdentityText {
    /// The text of a file; `place` is what messages call it.
    pub fn new(place: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { place: place.into(), bytes }
    }

    /// What messages call it.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Whether a passphrase is needed to read it.
    pub fn is_encrypted(&self) -> bool {
        self.bytes.starts_with(ENCRYPTED)
    }

    /// The identities in it.
    pub(crate) fn identities(
        &self,
        passphrase: Option<&SecretString>,
    ) -> Result<Vec<x25519::Identity>, VaultError> {
        if !self.is_encrypted() {
            return self.parse(&self.bytes);
        }
        let passphrase =
            passphrase.filter(|p| !p.expose_secret().is_empty()).ok_or(VaultError::NoPassphrase)?;
        let mut with = scrypt::Identity::new(passphrase.clone());
        with.set_max_work_factor(MOST_WORK);
        let mut text = Vec::new();
        match seal::unsealed(&self.bytes, &[with]) {
            Ok(mut stream) => {
                stream.read_to_end(&mut text).map_err(|_| self.wrong("is damaged"))?;
                self.parse(&text)
            }
            Err(age::DecryptError::DecryptionFailed | age::DecryptError::KeyDecryptionFailed) => {
                Err(VaultError::Passphrase { place: self.place.clone() })
            }
            Err(age::DecryptError::NoMatchingKeys) => {
                Err(self.wrong("is encrypted, and not with a passphrase"))
            }
            Err(age::DecryptError::ExcessiveWork { .. }) => Err(self.wrong("asks for too much work")),
            Err(_) => Err(self.wrong("is damaged")),
        }
    }

    fn parse(&self, text: &[u8]) -> Result<Vec<x25519::Identity>, VaultError> {
        let text = std::str::from_utf8(text).map_err(|_| self.wrong("holds no identity of age"))?;
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        let parsed: Result<Vec<_>, _> = lines.map(str::parse).collect();
        let identities = parsed.map_err(|_| self.wrong("has a line that is no identity of age"))?;
        if identities.is_empty() { Err(self.wrong("holds no identity of age")) } else { Ok(identities) }
    }

    fn wrong(&self, problem: &'static str) -> VaultError {
        VaultError::Identity { place: self.place.clone(), problem }
    }
}

/// The text of an identity file that holds `identity`, encrypted with a passphrase.
pub(crate) fn encrypted(
    identity: &x25519::Identity,
    passphrase: &SecretString,
) -> Result<Vec<u8>, VaultError> {
    if passphrase.expose_secret().is_empty() {
        return Err(VaultError::NoPassphrase);
    }
    let mut recipient = scrypt::Recipient::new(passphrase.clone());
    recipient.set_work_factor(WORK);
    let text = identity.to_string();
    let sealed = seal::sealed(&[recipient], |stream| {
        stream.write_all(text.expose_secret().as_bytes())?;
        stream.write_all(b"\n")
    });
    sealed.map_err(|e: io::Error| VaultError::Damaged { path: "the identity".into(), problem: e.to_string() })
}
