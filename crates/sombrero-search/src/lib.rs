#![doc = include_str!("../README.md")]

mod budget;
mod by_parts;
mod clearance;
mod coupled;
mod error;
mod examiner;
mod glance;
mod limits;
mod matched;
mod model;
mod nuisances;
mod options;
mod original;
mod outline;
mod pairs;
mod parts;
mod placement;
mod placements;
mod poses;
mod search;
mod stages;
mod surfaces;
mod suspect;
mod tally;
#[cfg(test)]
mod tests;
mod vertices;

pub use by_parts::FoundPart;
pub use error::{OriginalError, SearchError};
pub use examiner::{Examiner, Hypothesis, Look};
pub use glance::Glance;
pub use model::Model;
pub use options::{SearchOptions, When};
pub use original::Original;
pub use outline::Outline;
pub use search::{Looked, SearchOutcome, search, search_from};
pub use stages::Stages;
pub use suspect::Suspect;

pub use nalgebra;
pub use sombrero_extraction::Estimate;
