//! What can go wrong, each in one sentence that names the file and the cure.

use sombrero_io::{ReadError, WriteError};
use std::path::PathBuf;
use thiserror::Error;

/// Why something cannot be kept, or not be got out again.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum VaultError {
    /// A file of the vault cannot be written, on a full disk for instance.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A file of the vault cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A folder of the vault cannot be made, looked into or emptied.
    #[error("{}: {what} ({source}); check the permissions and the free space", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What cannot be done with it.
        what: &'static str,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The text is no public key.
    #[error("`{text}` is no public key of age; give one that begins with age1, as `age-keygen` prints it")]
    Recipient {
        /// The text.
        text: String,
    },
    /// There is a vault already, with another lock.
    #[error("{}: what is kept is encrypted to {recipients} already; leave the public key out", path.display())]
    OtherLock {
        /// The vault.
        path: PathBuf,
        /// Its public keys.
        recipients: String,
    },
    /// The file that names the public keys is damaged.
    #[error("{}: names no public key of age; restore it from a backup", path.display())]
    NoRecipients {
        /// The file.
        path: PathBuf,
    },
    /// The identity that opens what is kept is not in the vault, or was lost.
    #[error(
        "{}: what is kept is encrypted to {recipients}, whose identity is not kept beside it; give the identity file of one of them",
        path.display()
    )]
    NoIdentity {
        /// The vault.
        path: PathBuf,
        /// Its public keys.
        recipients: String,
    },
    /// The identity is another one.
    #[error(
        "{}: the identity that was given belongs to {given}, and what is kept is encrypted to {recipients}; give the identity file of one of them",
        path.display()
    )]
    OtherIdentity {
        /// The vault.
        path: PathBuf,
        /// The public keys of what was given.
        given: String,
        /// The vault's public keys.
        recipients: String,
    },
    /// The file holds no identity.
    #[error(
        "{place}: {problem}; give a file with a line that begins with AGE-SECRET-KEY-1, as `age-keygen` writes it"
    )]
    Identity {
        /// Where it came from.
        place: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The passphrase is another one.
    #[error("{place}: the passphrase is not the one that this identity was encrypted with; try again")]
    Passphrase {
        /// Whose passphrase was asked for.
        place: String,
    },
    /// A passphrase of no sign.
    #[error("the passphrase is empty; choose one that nobody guesses, such as six words drawn by lot")]
    NoPassphrase,
    /// Nothing of the kind is kept.
    #[error("{}: the file is not kept; add it with its original", path.display())]
    NotKept {
        /// Where it would be.
        path: PathBuf,
    },
    /// What is kept cannot be decrypted or unpacked.
    #[error("{}: is damaged ({problem}); restore it from a backup", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// What is kept unpacks to more than is allowed.
    #[error("{}: unpacks to more than {limit} bytes; raise the limit if you kept such a file", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// How many bytes are allowed.
        limit: u64,
    },
}
