#![doc = include_str!("../README.md")]

mod comparison;
mod evidence;
mod page;
mod record;
mod remark;
mod repeated;
mod replay;
mod report;

pub use comparison::Difference;
pub use evidence::{Evidence, FileHash, Files, PROGRAM};
pub use page::{PageError, Sheet, SheetCandidate, page, sheet, view};
pub use record::{MEASURED, Record, record};
pub use remark::Remark;
pub use repeated::RepeatedField;
pub use replay::{Replay, ReplayError, replay};
pub use report::Report;
