#![doc = include_str!("../README.md")]

mod correlation;
mod log_probability;
mod selection;
mod student;
mod summary;
mod watermark_test;

pub use correlation::{Correlation, CorrelationError, Side};
pub use log_probability::LogProbability;
pub use selection::{Selection, best_of, select};
pub use student::{StudentError, correlation_tail, student_tail};
pub use summary::{Interval, median, wilson_interval};
pub use watermark_test::{WatermarkTest, WatermarkTestError, WatermarkTestOptions, watermark_test};
