//! A catalogue as commands use it: the index of shapes, and beside it the vault with what is kept.

mod adding;
mod lock;
mod originals;
mod passphrase;

pub(crate) use adding::{Added, Adding, Described};
pub(crate) use lock::{LockArgs, UnlockArgs};
pub(crate) use originals::{KeptKey, Originals};

use crate::failure::Failure;
use sombrero_catalogue::{Catalogue, CatalogueError};
use sombrero_vault::{Vault, VaultError};
use std::path::{Path, PathBuf};

/// Where a catalogue has its vault.
pub(crate) fn vault_of(catalogue: &Path) -> PathBuf {
    catalogue.join("vault")
}

/// The vault of a catalogue, where something is kept in it.
pub(crate) fn vault(catalogue: &Path) -> Result<Option<Vault>, Failure> {
    let folder = vault_of(catalogue);
    Ok(if Vault::is_at(&folder) { Some(Vault::open(&folder)?) } else { None })
}

/// A catalogue to be asked.
pub(crate) fn open(folder: &Path) -> Result<Catalogue, Failure> {
    Ok(Catalogue::open(folder)?)
}

impl From<CatalogueError> for Failure {
    fn from(error: CatalogueError) -> Self {
        let cure = match &error {
            CatalogueError::NotACatalogue { .. } => "; give the folder that `sombrero catalogue add` made",
            CatalogueError::Io { .. } => "; check the folder, its permissions and the free space",
            _ => "",
        };
        Self::new("catalogue", format!("{error}{cure}"))
    }
}

impl From<VaultError> for Failure {
    fn from(error: VaultError) -> Self {
        match error {
            VaultError::Write(error) => error.into(),
            VaultError::Read(error) => error.into(),
            // The library does not know what its options are called here.
            error => {
                let message =
                    error.to_string().replace("give the identity", "give --identity with the identity");
                Self::new("vault", message.replace("leave the public key out", "leave --encrypt-to out"))
            }
        }
    }
}
