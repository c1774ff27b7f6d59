#![doc = include_str!("../README.md")]

mod commitment;
mod copy_secret;
mod embedding;
mod key;
mod parameters;
mod sequence;

pub use embedding::{Distortion, embed, normal_change};
pub use key::{Key, KeyError, Mismatch};
pub use parameters::{Parameters, Preset, UnknownPreset};
pub use sequence::{Identity, OriginalDigest, Secret, SecretError, watermark};
