//! One original and one key before the basis is there.

use super::detection::Detection;
use super::detector::{Detector, check, outline};
use super::error::DetectError;
use super::options::{DetectOptions, Method};
use crate::prepared_basis::PreparedBasis;
use sombrero_io::Document;
use sombrero_search::{Glance, Model, Outline, Suspect};
use sombrero_watermark::Key;

/// An original and a key before the basis is computed, which takes longer than all else: enough to tell suspects that are other
/// shapes.
#[derive(Debug)]
pub struct Glancer {
    outline: Outline,
    key: Key,
}

/// What a first look at a suspect gave.
#[derive(Debug)]
pub enum FirstLook {
    /// The suspect is another shape, and this is the answer, the same that [`Detector::detect`] gives.
    AnotherShape(Box<Detection>),
    /// The mark has to be looked for, by [`Glancer::detector`] and [`Detector::detect_after`].
    Open(Option<Box<Glance>>),
}

impl Glancer {
    /// The glancer of `key`, which must be genuine and belong to `original`, as far as that shows without the basis.
    ///
    /// # Errors
    /// [`DetectError::Key`] when they do not belong together, [`DetectError::NoFaces`] of an original without a surface.
    pub fn new(original: &Document, key: Key) -> Result<Self, DetectError> {
        check(original, &key, false)?;
        Ok(Self { outline: outline(original)?, key })
    }

    /// As [`Detector::suspect`].
    pub fn suspect(&self, file: &Document) -> Suspect {
        self.outline.suspect(&file.soup_like(self.outline.triangles()))
    }

    /// Whether the suspect is another shape. With the paper's method nothing tells that, nor where the suspect may not be moved.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn look(&self, suspect: &Suspect, options: &DetectOptions) -> Result<FirstLook, DetectError> {
        options.check(suspect)?;
        if options.method != Method::Robust {
            return Ok(FirstLook::Open(None));
        }
        let glance = self.outline.glance(suspect, &options.search())?;
        if !glance.is_another_shape() {
            return Ok(FirstLook::Open(Some(Box::new(glance))));
        }
        let (coefficients, points) = (self.key.watermark.len(), self.outline.model().soup().points.len());
        let answer = Detection::of_another_shape(coefficients, points, options.threshold, glance.seconds);
        Ok(FirstLook::AnotherShape(Box::new(answer)))
    }

    /// The detector, with the basis computed or as it was stored.
    ///
    /// # Errors
    /// As [`Detector::new`] and [`Detector::with_prepared_basis`].
    pub fn detector(self, stored: Option<PreparedBasis>) -> Result<Detector, DetectError> {
        Detector::of_outline(self.outline, self.key, stored, false)
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        self.outline.model()
    }

    /// The key.
    pub fn key(&self) -> &Key {
        &self.key
    }
}
