#![doc = include_str!("../README.md")]

mod commitment;
mod copy_secret;
mod derivation;
mod embedding;
mod hash_tree;
mod key;
mod key_file;
mod original;
mod parameters;
mod sequence;

pub use derivation::Derivation;
pub use embedding::{Distortion, embed};
pub use hash_tree::{Path, Sibling, hash_tree};
pub use key::{Key, Mismatch};
pub use key_file::{KEY_VERSION, KeyError};
pub use original::OriginalDigest;
pub use parameters::{COEFFICIENTS, EPSILONS, Parameters, Preset, UnknownPreset};
pub use sequence::{Identity, Secret, SecretError, gaussians};
