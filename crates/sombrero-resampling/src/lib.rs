#![doc = include_str!("../README.md")]

mod deform;
mod distance;
mod energy;
mod error;
mod field;
mod flip;
mod frame;
mod minimise;
mod missing;
mod options;
mod projection;
mod resample;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use energy::EnergyTerms;
pub use error::ResampleError;
/// The crate whose points stand in the signatures here.
pub use nalgebra;
pub use options::ResampleOptions;
pub use resample::{Resampled, resample};
