#![doc = include_str!("../README.md")]

mod evidence;
mod page;
mod record;
mod replay;
mod report;

pub use evidence::{Evidence, FileHash, Files, PROGRAM};
pub use page::{PageError, page};
pub use record::{Record, record};
pub use replay::{Difference, Replay, replay};
pub use report::Report;
