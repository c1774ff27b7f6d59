#![doc = include_str!("../README.md")]

mod build;
mod progressive;
mod quadric;
mod queue;

pub use progressive::{ProgressiveMesh, VertexSplit};
pub use quadric::{Quadric, vertex_quadrics};
