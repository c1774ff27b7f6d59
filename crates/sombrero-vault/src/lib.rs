#![doc = include_str!("../README.md")]

mod error;
mod identity;
mod opened;
mod pack;
mod seal;
#[cfg(test)]
mod tests;
mod vault;

pub use age::secrecy::{ExposeSecret, SecretString};
pub use error::VaultError;
pub use identity::IdentityText;
pub use opened::Opened;
pub use pack::KeptFile;
pub use vault::{Lock, Vault};
