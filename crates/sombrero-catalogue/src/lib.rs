#![doc = include_str!("../README.md")]

mod bytes;
mod candidate;
mod catalogue;
mod describe;
mod editor;
mod entry;
mod error;
mod features;
mod log;
mod matching;
mod pieces;
mod portrait;
mod question;
mod search;

pub use candidate::Candidate;
pub use catalogue::Catalogue;
pub use editor::Editor;
pub use entry::Entry;
pub use error::{CatalogueError, Damage, ShapeError};
/// The crate whose points and similarities stand in the signatures here.
pub use nalgebra;
pub use portrait::Portrait;
pub use question::Question;
pub use search::SearchOptions;
