#![doc = include_str!("../README.md")]

mod extractor;
mod least_squares;
mod nuisance;
mod robust;
mod smoothing;
mod surface;
mod system;
mod vertices;

pub use extractor::{Estimate, EstimateError, Extractor};
pub use least_squares::{ExtractError, Extraction, extract};
pub use nuisance::{Deformation, Nuisance};
