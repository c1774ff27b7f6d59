#![doc = include_str!("../README.md")]

mod build;
mod magnitude;
mod progressive;
mod quadric;
mod queue;
mod simplify;

pub use nalgebra;

pub use magnitude::{Magnitude, magnitude};
pub use progressive::{CompactMesh, PointsError, ProgressiveMesh, VertexSplit};
pub use simplify::simplify;
