#![doc = include_str!("../README.md")]

mod build;
mod progressive;
mod quadric;

pub use progressive::{ProgressiveMesh, VertexSplit};
pub use quadric::{Quadric, vertex_quadrics};
