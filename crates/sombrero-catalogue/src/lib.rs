#![doc = include_str!("../README.md")]

mod bytes;
mod candidate;
mod catalogue;
mod describe;
mod editor;
mod entry;
mod error;
mod fate;
mod features;
mod lists;
mod log;
mod manifest;
mod matching;
mod merge;
mod pieces;
mod portrait;
mod positioned;
mod question;
mod rim;
mod search;
mod segment;
mod settle;
mod vote;

pub use candidate::Candidate;
pub use catalogue::Catalogue;
pub use editor::Editor;
pub use entry::Entry;
pub use error::{CatalogueError, Damage, ShapeError};
pub use fate::Fate;
/// The crate whose points and similarities stand in the signatures here.
pub use nalgebra;
pub use portrait::Portrait;
pub use question::Question;
pub use search::SearchOptions;
