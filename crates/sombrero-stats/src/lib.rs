#![doc = include_str!("../README.md")]

mod accusation;
mod axes;
mod correlation;
mod ellipsoid;
mod ellipsoid_error;
mod key_tests;
mod log_probability;
mod quadratic_form;
mod saddlepoint;
mod selection;
mod student;
mod summary;
mod watermark_test;

pub use accusation::accuse;
pub use correlation::{Correlation, CorrelationError, Side};
pub use ellipsoid::{Ellipsoid, EllipsoidTest};
pub use ellipsoid_error::EllipsoidError;
pub use key_tests::{Comparison, KeyTest, KeyTestError, KeyTests, STATISTICS, Statistic};
pub use log_probability::LogProbability;
pub use selection::{Selection, best_of, select};
pub use student::{StudentError, correlation_tail, student_tail};
pub use summary::{Interval, median, wilson_interval};
pub use watermark_test::{WatermarkTest, WatermarkTestError, WatermarkTestOptions, watermark_test};

/// The linear algebra of this crate's signatures.
pub use nalgebra;
