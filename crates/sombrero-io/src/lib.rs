#![doc = include_str!("../README.md")]

mod attributes;
mod document;
mod error;
mod format;
mod gltf;
mod input;
mod normals;
mod obj;
mod off;
mod output;
mod placement;
mod ply;
mod polygon;
#[cfg(test)]
mod properties;
mod splice;
mod stl;
mod text;
mod threemf;

#[cfg(test)]
mod testing;

pub use document::{Companion, Document, Rewrite, Rewritten, encode};
pub use error::{ParseError, Place, ReadError, WriteError};
pub use format::Format;
pub use input::{Limits, read_bytes};
pub use output::{Access, Output, Overwrite, write_atomically, write_together};
