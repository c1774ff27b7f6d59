#![doc = include_str!("../README.md")]

mod attributes;
mod coordinate;
mod decimals;
mod document;
mod error;
mod family;
mod format;
mod gltf;
mod input;
mod lock;
mod normals;
mod notes;
mod obj;
mod off;
mod output;
mod parsed;
mod placement;
mod ply;
mod polygon;
#[cfg(test)]
mod properties;
mod registry;
mod splice;
mod stl;
mod text;
mod threemf;
mod unplaced;

#[cfg(test)]
mod testing;

pub use decimals::{Decimals, Filling};
pub use document::Document;
pub use error::{ParseError, Place, ReadError, WriteError};
pub use format::Format;
pub use input::{Limits, is_plain_path, read_bytes};
pub use output::{
    Access, Output, Overwrite, check_file_name, check_output, replace_each, write_atomically, write_together,
};
pub use parsed::{Companion, Rewrite, Rewritten};
pub use registry::encode;

pub use nalgebra;
pub use sombrero_mesh::Soup;
