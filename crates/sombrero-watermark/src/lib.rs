#![doc = include_str!("../README.md")]

mod embedding;
mod key;
mod sequence;

pub use embedding::{Distortion, embed};
pub use key::{Key, KeyError, Mismatch, Parameters};
pub use sequence::{Identity, Secret, SecretError, watermark};
