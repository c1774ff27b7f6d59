#![doc = include_str!("../README.md")]

mod answer;
mod deformation;
mod extractor;
mod fields;
mod least_squares;
mod nuisance;
mod pooled;
mod robust;
mod square_root;
mod sums;
mod surface;
mod system;
mod vertices;
mod warp;

pub use deformation::Deformation;
pub use extractor::{Estimate, EstimateError, Extractor};
pub use least_squares::{ExtractError, Extraction, Whole, extract};
pub use nuisance::{Modes, Nuisance};

/// The linear algebra of this crate's signatures.
pub use nalgebra;
