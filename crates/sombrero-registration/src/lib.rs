#![doc = include_str!("../README.md")]

mod align;
mod candidate;
mod error;
mod likeness;
mod options;
mod procrustes;
mod reference;
mod refinement;
mod register;
mod register_affine;
mod result;
mod search;
mod starts;
mod surface;
mod symmetry;
mod verdict;

pub use align::{align, refine_affine};
pub use error::{RegistrationError, Side};
pub use likeness::likeness;
/// The crate whose points, similarities and affine maps stand in the signatures here.
pub use nalgebra;
pub use options::{IcpOptions, RegisterOptions, Starts};
pub use procrustes::similarity_of_pairs;
pub use reference::Reference;
pub use register::register;
pub use register_affine::register_affine;
pub use result::{Pose, Registration};
