#![doc = include_str!("../README.md")]

mod clearance;
mod coupled;
mod error;
mod examiner;
mod limits;
mod matched;
mod model;
mod nuisances;
mod options;
mod original;
mod pairs;
mod poses;
mod search;
mod stages;
mod surfaces;
mod suspect;
mod tally;
#[cfg(test)]
mod tests;
mod vertices;

pub use error::{OriginalError, SearchError};
pub use examiner::{Examiner, Hypothesis};
pub use model::Model;
pub use options::{SearchOptions, When};
pub use original::Original;
pub use search::{SearchOutcome, search};
pub use stages::Stages;
pub use suspect::Suspect;

pub use nalgebra;
pub use sombrero_extraction::Estimate;
