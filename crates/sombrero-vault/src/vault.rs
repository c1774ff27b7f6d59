//! A folder in which originals and keys are kept.
//!
//! ```text
//! recipients                        the public keys to which all is encrypted, one a line
//! PUBLIC-KEY.identity.age           the secret half, encrypted with the passphrase; absent where it is kept elsewhere
//! originals/DIGEST.tar.gz.age       an original and the files that belong to it
//! keys/DIGEST/SHA-256.key.age       a key of that original, by the hash of its file
//! ```
//!
//! Whoever adds needs no secret. Every file is written under another name and then named, so that it is whole or not
//! there; none is ever changed.

use crate::error::VaultError;
use crate::identity::{self, IdentityText};
use crate::opened::Opened;
use crate::{pack, seal};
use age::secrecy::SecretString;
use age::x25519;
use sha2::{Digest, Sha256};
use sombrero_io::{Access, Limits, Output, Overwrite, WriteError, read_bytes, write_together};
use std::fs::{self, DirBuilder, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The file of the public keys.
const RECIPIENTS: &str = "recipients";

/// Identity files and lists of public keys are a few lines.
const SMALL: u64 = 1 << 20;

/// Files that are kept, encrypted, for an original that is known by its digest of 32 bytes.
#[derive(Debug, Clone)]
pub struct Vault {
    folder: PathBuf,
    recipients: Vec<x25519::Recipient>,
}

/// Who can open what is kept.
pub enum Lock {
    /// Whoever knows the passphrase, which is asked for when something is read.
    Passphrase(SecretString),
    /// Whoever has the identity of one of these public keys (`age1...`).
    Recipients(Vec<String>),
}

impl Vault {
    /// Whether there is a vault in this folder.
    pub fn is_at(folder: &Path) -> bool {
        folder.join(RECIPIENTS).symlink_metadata().is_ok()
    }

    /// The vault of this folder.
    ///
    /// # Errors
    /// [`VaultError::Read`] where there is none, [`VaultError::NoRecipients`] where its list is damaged.
    pub fn open(folder: &Path) -> Result<Self, VaultError> {
        let path = folder.join(RECIPIENTS);
        let bytes = read_bytes(&path, Limits::default().with_max_bytes(SMALL))?;
        let text = String::from_utf8_lossy(&bytes);
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        let recipients: Vec<_> = lines.filter_map(|line| line.parse().ok()).collect();
        if recipients.is_empty() {
            return Err(VaultError::NoRecipients { path });
        }
        Ok(Self { folder: folder.to_owned(), recipients })
    }

    /// A new vault in this folder, which is made if it is not there. Where another run made one in the meantime, with
    /// whatever lock, that one is given.
    ///
    /// # Errors
    /// [`VaultError::Recipient`] of a public key that is none, [`VaultError::NoPassphrase`] of an empty passphrase, and
    /// those of writing.
    pub fn create(folder: &Path, lock: &Lock) -> Result<Self, VaultError> {
        let recipients = match lock {
            Lock::Recipients(texts) => parsed(texts)?,
            Lock::Passphrase(passphrase) => {
                let identity = x25519::Identity::generate();
                let bytes = identity::encrypted(&identity, passphrase)?;
                make_private(folder)?;
                // Under a name of its own: of two runs that begin at the same moment, neither takes the other's away.
                write(&identity_path(folder, &identity.to_public()), &bytes)?;
                vec![identity.to_public()]
            }
        };
        make_private(folder)?;
        let lines: String = recipients.iter().map(|recipient| format!("{recipient}\n")).collect();
        write(&folder.join(RECIPIENTS), lines.as_bytes())?;
        Self::open(folder)
    }

    /// Refuses public keys that are not this vault's.
    ///
    /// # Errors
    /// [`VaultError::OtherLock`], or [`VaultError::Recipient`] of a text that is none.
    pub fn check_recipients(&self, texts: &[String]) -> Result<(), VaultError> {
        let known = |given: &x25519::Recipient| self.recipients.iter().any(|own| same(own, given));
        if parsed(texts)?.iter().all(known) {
            return Ok(());
        }
        Err(VaultError::OtherLock { path: self.folder.clone(), recipients: self.recipients() })
    }

    /// The public keys, separated by commas.
    pub fn recipients(&self) -> String {
        let texts: Vec<String> = self.recipients.iter().map(ToString::to_string).collect();
        texts.join(", ")
    }

    /// The identity that is kept in the vault itself, encrypted with its passphrase.
    ///
    /// # Errors
    /// [`VaultError::NoIdentity`] where it is kept elsewhere, or lost.
    pub fn identity(&self) -> Result<IdentityText, VaultError> {
        let mut paths = self.recipients.iter().map(|recipient| identity_path(&self.folder, recipient));
        let Some(path) = paths.find(|path| path.is_file()) else {
            return Err(VaultError::NoIdentity { path: self.folder.clone(), recipients: self.recipients() });
        };
        let bytes = read_bytes(&path, Limits::default().with_max_bytes(SMALL))?;
        Ok(IdentityText::new(self.folder.display().to_string(), bytes))
    }

    /// The vault opened, to read what is kept.
    ///
    /// # Errors
    /// [`VaultError::Passphrase`], [`VaultError::Identity`], or [`VaultError::OtherIdentity`] when it is not the one that
    /// all is encrypted to.
    pub fn unlock(
        &self,
        identity: &IdentityText,
        passphrase: Option<&SecretString>,
    ) -> Result<Opened, VaultError> {
        let identities = identity.identities(passphrase)?;
        let public: Vec<x25519::Recipient> = identities.iter().map(x25519::Identity::to_public).collect();
        if !public.iter().any(|given| self.recipients.iter().any(|own| same(own, given))) {
            let given: Vec<String> = public.iter().map(ToString::to_string).collect();
            let (path, recipients) = (self.folder.clone(), self.recipients());
            return Err(VaultError::OtherIdentity { path, given: given.join(", "), recipients });
        }
        Ok(Opened::new(self.clone(), identities))
    }

    /// Keeps an original: its own file first, then those that belong to it, as name and content. Gives whether it was not
    /// kept before.
    ///
    /// # Errors
    /// Those of writing; then nothing of it is kept.
    pub fn keep_original(&self, original: &[u8; 32], files: &[(&str, &[u8])]) -> Result<bool, VaultError> {
        let path = self.original_path(original);
        self.keep(&path, |to| pack::pack(files, to))
    }

    /// Keeps the content of a key file. Gives whether it was not kept before.
    ///
    /// # Errors
    /// Those of writing; then nothing of it is kept.
    pub fn keep_key(&self, original: &[u8; 32], key: &[u8]) -> Result<bool, VaultError> {
        let name = format!("{}.key.age", hex::encode(Sha256::digest(key)));
        let path = self.keys_path(original).join(name);
        self.keep(&path, |to| to.write_all(key))
    }

    /// Whether this original is kept.
    pub fn has_original(&self, original: &[u8; 32]) -> bool {
        self.original_path(original).is_file()
    }

    /// Whether any key is kept.
    pub fn has_keys(&self) -> bool {
        fs::read_dir(self.folder.join("keys")).is_ok_and(|mut originals| originals.next().is_some())
    }

    /// The files of the keys that are kept of this original, in the order of their names.
    ///
    /// # Errors
    /// [`VaultError::Folder`] when the folder cannot be looked into.
    pub fn keys(&self, original: &[u8; 32]) -> Result<Vec<PathBuf>, VaultError> {
        let folder = self.keys_path(original);
        if !folder.is_dir() {
            return Ok(Vec::new());
        }
        let failed = |source| VaultError::Folder { path: folder.clone(), what: "cannot be read", source };
        let entries = fs::read_dir(&folder).map_err(failed)?;
        let mut paths = Vec::new();
        for entry in entries {
            let path = entry.map_err(failed)?.path();
            if path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(".key.age")) {
                paths.push(path);
            }
        }
        paths.sort();
        Ok(paths)
    }

    /// Takes away an original and its keys for good.
    ///
    /// # Errors
    /// [`VaultError::Folder`] when the operating system refuses.
    pub fn forget(&self, original: &[u8; 32]) -> Result<(), VaultError> {
        let gone = |path: PathBuf, removed: io::Result<()>| match removed {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(VaultError::Folder { path, what: "cannot be removed", source })
            }
            _ => Ok(()),
        };
        let (keys, file) = (self.keys_path(original), self.original_path(original));
        let removed = fs::remove_dir_all(&keys);
        gone(keys, removed)?;
        let removed = fs::remove_file(&file);
        gone(file, removed)
    }

    pub(crate) fn original_path(&self, original: &[u8; 32]) -> PathBuf {
        self.folder.join("originals").join(format!("{}.tar.gz.age", hex::encode(original)))
    }

    fn keys_path(&self, original: &[u8; 32]) -> PathBuf {
        self.folder.join("keys").join(hex::encode(original))
    }

    fn keep(
        &self,
        path: &Path,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<bool, VaultError> {
        if path.is_file() {
            return Ok(false);
        }
        path.parent().map_or(Ok(()), make_private)?;
        let failed = |source| VaultError::Write(WriteError::Io { path: path.to_owned(), source });
        let bytes = seal::sealed(&self.recipients, content).map_err(failed)?;
        write(path, &bytes)
    }
}

/// Writes a file for its owner alone, and waits until the disk has it: its owner may delete his own copy then. Gives whether it
/// was not there before.
fn write(path: &Path, bytes: &[u8]) -> Result<bool, VaultError> {
    match write_together(&[Output { path, bytes, access: Access::Private }], Overwrite::Refuse) {
        Ok(()) => {}
        Err(WriteError::Exists { .. }) => return Ok(false),
        Err(error) => return Err(error.into()),
    }
    let failed = |source| WriteError::Io { path: path.to_owned(), source };
    File::open(path).and_then(|file| file.sync_all()).map_err(failed)?;
    #[cfg(unix)]
    if let Some(folder) = path.parent() {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed)?;
    }
    Ok(true)
}

/// Makes a folder that only its owner may look into, and those above it that are missing.
fn make_private(folder: &Path) -> Result<(), VaultError> {
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    let failed = |source| VaultError::Folder { path: folder.to_owned(), what: "cannot be made", source };
    builder.create(folder).map_err(failed)
}

fn identity_path(folder: &Path, recipient: &x25519::Recipient) -> PathBuf {
    folder.join(format!("{recipient}.identity.age"))
}

fn parsed(texts: &[String]) -> Result<Vec<x25519::Recipient>, VaultError> {
    let parse = |text: &String| text.trim().parse().map_err(|_| VaultError::Recipient { text: text.clone() });
    texts.iter().map(parse).collect()
}

fn same(a: &x25519::Recipient, b: &x25519::Recipient) -> bool {
    a.to_string() == b.to_string()
}
