#![doc = include_str!("../README.md")]

mod accusation;
mod correlation;
mod ellipsoid;
mod log_probability;
mod quadratic_form;
mod selection;
mod student;
mod summary;
mod watermark_test;

pub use accusation::accuse;
pub use correlation::{Correlation, CorrelationError, Side};
pub use ellipsoid::{Ellipsoid, EllipsoidError, EllipsoidTest};
pub use log_probability::LogProbability;
pub use selection::{Selection, best_of, select};
pub use student::{StudentError, correlation_tail, student_tail};
pub use summary::{Interval, median, wilson_interval};
pub use watermark_test::{WatermarkTest, WatermarkTestError, WatermarkTestOptions, watermark_test};
