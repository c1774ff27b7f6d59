//! A vault that was opened.

use crate::error::VaultError;
use crate::pack::{self, KeptFile, UnpackError};
use crate::seal;
use crate::vault::Vault;
use age::x25519;
use sombrero_io::{Limits, read_bytes};
use std::io::Read;
use std::path::{Path, PathBuf};

/// A vault with the identity that opens it: what is kept can be read.
pub struct Opened {
    vault: Vault,
    identities: Vec<x25519::Identity>,
}

impl std::fmt::Debug for Opened {
    /// Without the identity, which is secret.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Opened").field(&self.vault).finish()
    }
}

impl Opened {
    pub(crate) fn new(vault: Vault, identities: Vec<x25519::Identity>) -> Self {
        Self { vault, identities }
    }

    /// The files of an original, its own first, of `limits.max_bytes` in all at most.
    ///
    /// # Errors
    /// [`VaultError::NotKept`], [`VaultError::Damaged`], [`VaultError::TooLarge`], and those of reading.
    pub fn original(&self, original: &[u8; 32], limits: Limits) -> Result<Vec<KeptFile>, VaultError> {
        let path = self.vault.original_path(original);
        if !path.is_file() {
            return Err(VaultError::NotKept { path });
        }
        let limit = limits.max_bytes;
        let bytes = read_bytes(&path, limits)?;
        let files = pack::unpack(self.unsealed(&path, &bytes)?, limit).map_err(|error| match error {
            UnpackError::TooLarge => VaultError::TooLarge { path: path.clone(), limit },
            UnpackError::Io(error) => damaged(&path, error.to_string()),
        })?;
        if files.is_empty() { Err(damaged(&path, "there is no file in it".into())) } else { Ok(files) }
    }

    /// The contents of the key files that are kept of an original, each with the file that holds it.
    ///
    /// # Errors
    /// As [`Opened::original`].
    pub fn keys(&self, original: &[u8; 32], limits: Limits) -> Result<Vec<(PathBuf, Vec<u8>)>, VaultError> {
        let read = |path: PathBuf| {
            let bytes = read_bytes(&path, limits)?;
            let mut key = Vec::new();
            let read = self.unsealed(&path, &bytes)?.read_to_end(&mut key);
            read.map_err(|e| damaged(&path, e.to_string()))?;
            Ok((path, key))
        };
        self.vault.keys(original)?.into_iter().map(read).collect()
    }

    fn unsealed<'a>(&'a self, path: &Path, bytes: &'a [u8]) -> Result<impl Read + 'a, VaultError> {
        seal::unsealed(bytes, &self.identities).map_err(|e| damaged(path, seal::problem(&e)))
    }
}

fn damaged(path: &Path, problem: String) -> VaultError {
    VaultError::Damaged { path: path.to_owned(), problem }
}
