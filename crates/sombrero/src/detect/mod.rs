//! Looks for the mark of one key in a suspect file.

mod detection;
mod detector;
mod error;
mod glancer;
mod options;
mod paper;
pub(crate) mod robust;

pub(crate) use detection::positions;
pub use detection::{Alignment, Detection, Measured, Part, Variant};
pub use detector::Detector;
pub use error::DetectError;
pub use glancer::{FirstLook, Glancer};
pub use options::{DetectOptions, Method};

use sombrero_io::Document;
use sombrero_search::Stages;
use sombrero_watermark::Key;

/// Looks for the mark of `key` in `suspect`, given the `original` that was marked.
///
/// For many suspects of one original make a [`Detector`] once.
///
/// # Errors
/// [`DetectError`] when the three do not belong together or the question cannot be answered.
pub fn detect(
    suspect: &Document,
    original: &Document,
    key: &Key,
    options: &DetectOptions,
) -> Result<Detection, DetectError> {
    let mut seconds = Stages::default();
    let detector = seconds.time("preparation", || Detector::new(original, key.clone()))?;
    let mut detection = detector.detect(&detector.suspect(suspect), options)?;
    seconds.0.append(&mut detection.seconds.0);
    detection.seconds = seconds;
    Ok(detection)
}
