//! Who can open what a catalogue keeps.

use super::{passphrase, vault_of};
use crate::failure::Failure;
use crate::files;
use sombrero_vault::{IdentityText, Lock, Opened, Vault};
use std::path::{Path, PathBuf};

/// Identity files are a few lines.
const LARGEST_IDENTITY: u64 = 1 << 20;

// Options of commands that put something into a vault. Only the first of them asks for anything.
#[derive(Debug, clap::Args)]
pub(crate) struct LockArgs {
    /// Encrypt what is kept to this public key of age, instead of with a passphrase; given again, to several. Where
    /// something is kept already, its lock stays.
    #[arg(long, value_name = "AGE1...", conflicts_with = "passphrase_file")]
    encrypt_to: Vec<String>,
    /// A file whose first line is the passphrase; `-` is standard input. Default: the environment's
    /// SOMBRERO_PASSPHRASE, else you are asked for it when it is needed.
    #[arg(long, value_name = "FILE")]
    passphrase_file: Option<PathBuf>,
}

impl LockArgs {
    /// Whether anything was typed.
    pub(crate) fn is_given(&self) -> bool {
        !self.encrypt_to.is_empty() || self.passphrase_file.is_some()
    }

    /// The vault of a catalogue, made with this lock if there is none.
    pub(crate) fn vault(&self, catalogue: &Path) -> Result<Vault, Failure> {
        let folder = vault_of(catalogue);
        if Vault::is_at(&folder) {
            let vault = Vault::open(&folder)?;
            vault.check_recipients(&self.encrypt_to)?;
            return Ok(vault);
        }
        Ok(Vault::create(&folder, &self.lock(catalogue)?)?)
    }

    fn lock(&self, catalogue: &Path) -> Result<Lock, Failure> {
        if self.encrypt_to.is_empty() {
            let whose = catalogue.display().to_string();
            Ok(Lock::Passphrase(passphrase::chosen(self.passphrase_file.as_deref(), &whose)?))
        } else {
            Ok(Lock::Recipients(self.encrypt_to.clone()))
        }
    }
}

// Options of commands that read what is kept.
#[derive(Debug, clap::Args)]
pub(crate) struct UnlockArgs {
    /// The identity file of age that opens what is kept, where no passphrase does.
    #[arg(long, value_name = "FILE")]
    identity: Option<PathBuf>,
    /// A file whose first line is the passphrase; `-` is standard input. Default: the environment's
    /// SOMBRERO_PASSPHRASE, else you are asked for it when it is needed.
    #[arg(long, value_name = "FILE")]
    passphrase_file: Option<PathBuf>,
}

impl UnlockArgs {
    /// Whether something was given that opens a vault without anybody being asked.
    pub(crate) fn is_given(&self) -> bool {
        self.identity.is_some() || passphrase::is_given(self.passphrase_file.as_deref())
    }

    /// The vault opened.
    pub(crate) fn unlock(&self, vault: &Vault) -> Result<Opened, Failure> {
        let identity = match &self.identity {
            Some(path) => {
                let bytes = files::read_small(path, LARGEST_IDENTITY, "an identity file of age")?;
                IdentityText::new(path.display().to_string(), bytes)
            }
            None => vault.identity()?,
        };
        let passphrase = match identity.is_encrypted() {
            true => Some(passphrase::asked(self.passphrase_file.as_deref(), identity.place())?),
            false => None,
        };
        Ok(vault.unlock(&identity, passphrase.as_ref())?)
    }
}
