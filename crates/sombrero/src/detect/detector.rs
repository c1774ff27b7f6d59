//! One original and one key, ready for any number of suspects.

use super::detection::Detection;
use super::error::DetectError;
use super::options::{DetectOptions, Method};
use super::{paper, robust};
use crate::prepared_basis::{self, PreparedBasis};
use sombrero_basis::Basis;
use sombrero_io::Document;
use sombrero_search::{Glance, Model, Original, Outline, Suspect};
use sombrero_watermark::{Key, OriginalDigest, Parameters};
use std::sync::Arc;

/// An original that is ready for any number of suspects.
#[derive(Debug, Clone)]
pub struct Detector {
    original: Arc<Original>,
    key: Key,
    /// Whether the key was taken at its word.
    trusting: bool,
}

impl Detector {
    /// The detector of `key`, which must be genuine and belong to `original`. Computes the basis.
    ///
    /// # Errors
    /// [`DetectError::Key`] or [`DetectError::Basis`] when they do not belong together.
    pub fn new(original: &Document, key: Key) -> Result<Self, DetectError> {
        Self::with_basis(original, key, None, false)
    }

    /// The detector of a key whose watermark is taken at its word, whatever it cost: for experiments with thousands of keys
    /// ([`Derivation::stub_for_experiments`](sombrero_watermark::Derivation::stub_for_experiments)). What it finds proves
    /// nothing to anybody.
    ///
    /// # Errors
    /// As [`Detector::new`].
    pub fn trusting(original: &Document, key: Key) -> Result<Self, DetectError> {
        Self::with_basis(original, key, None, true)
    }

    /// [`Detector::new`] with a basis that was stored, which takes a fraction of the time. What is found is the same, to
    /// the bit; but see [`Detector::confirm`].
    ///
    /// # Errors
    /// [`DetectError::Key`] when key, original and basis do not belong together.
    pub fn with_prepared_basis(
        original: &Document,
        key: Key,
        stored: PreparedBasis,
    ) -> Result<Self, DetectError> {
        Self::with_basis(original, key, Some(stored), false)
    }

    fn with_basis(
        original: &Document,
        key: Key,
        stored: Option<PreparedBasis>,
        trusting: bool,
    ) -> Result<Self, DetectError> {
        check(original, &key, trusting)?;
        Self::of_outline(outline(original)?, key, stored, trusting)
    }

    pub(super) fn of_outline(
        outline: Outline,
        key: Key,
        stored: Option<PreparedBasis>,
        trusting: bool,
    ) -> Result<Self, DetectError> {
        let Parameters { basis, epsilon, .. } = &key.parameters;
        let original = match stored {
            Some(PreparedBasis(stored)) => Original::with_basis(outline, stored, *epsilon)?,
            None => Original::of_outline(outline, basis, *epsilon)?,
        };
        key.check_basis(original.basis_digest())?;
        Ok(Self { original: Arc::new(original), key, trusting })
    }

    /// The file that [`PreparedBasis::parse`] reads, as bytes. It holds the basis, which follows from the original: it is
    /// as private as that.
    pub fn prepared_basis(&self) -> Vec<u8> {
        prepared_basis::write(self.basis(), &self.key)
    }

    /// Derives the basis anew and compares. After [`Detector::new`] there is nothing to confirm.
    ///
    /// A forger can make up a key, and a prepared basis in whose coefficients any suspect carries the key's mark. So
    /// what is found with somebody else's prepared basis is worth nothing until this has been asked.
    ///
    /// # Errors
    /// [`DetectError::Key`] when the basis is not that of the original, [`DetectError::Basis`] when the original has
    /// none like it.
    pub fn confirm(&self) -> Result<(), DetectError> {
        let Parameters { basis, epsilon, .. } = &self.key.parameters;
        let model = self.original.model();
        let basis = model.basis_for(model.converted(), basis, *epsilon)?;
        Ok(self.key.check_basis(&basis.digest())?)
    }

    /// A detector for another key of the same original. It costs no more than checking the key when its parameters are the same.
    ///
    /// # Errors
    /// As [`Detector::new`], or [`Detector::trusting`] if this one was made by that.
    pub fn for_key(&self, original: &Document, key: Key) -> Result<Self, DetectError> {
        let trusting = self.trusting;
        if key.parameters != self.key.parameters {
            return Self::with_basis(original, key, None, trusting);
        }
        check(original, &key, trusting)?;
        key.check_basis(self.original.basis_digest())?;
        Ok(Self { original: Arc::clone(&self.original), key, trusting })
    }

    /// A file as a suspect of this original. Polygons that both have are split as the original's.
    pub fn suspect(&self, file: &Document) -> Suspect {
        self.original.suspect(&file.soup_like(self.original.triangles()))
    }

    /// Looks for the mark in `suspect` in several ways, as far as options and suspect permit, and the best counts. Its
    /// p is multiplied by the number of ways. Further ones are left out once one is certain, but are still
    /// counted.
    ///
    /// # Errors
    /// [`DetectError`] when the question makes no sense.
    pub fn detect(&self, suspect: &Suspect, options: &DetectOptions) -> Result<Detection, DetectError> {
        self.detect_after(None, suspect, options)
    }

    /// [`Detector::detect`] after a first look at this suspect with these options, where one was taken.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    pub fn detect_after(
        &self,
        glance: Option<Box<Glance>>,
        suspect: &Suspect,
        options: &DetectOptions,
    ) -> Result<Detection, DetectError> {
        options.check(suspect)?;
        match options.method {
            Method::Robust => robust::detect(&self.original, &self.key.watermark, suspect, options, glance),
            Method::Paper => paper::detect(&self.original, &self.key.watermark, suspect, options),
        }
    }

    /// The original as the method sees it.
    pub fn model(&self) -> &Model {
        self.original.model()
    }

    /// The basis that the mark uses.
    pub fn basis(&self) -> &Basis {
        self.original.basis()
    }

    /// The key.
    pub fn key(&self) -> &Key {
        &self.key
    }
}

pub(super) fn outline(original: &Document) -> Result<Outline, DetectError> {
    Ok(Outline::new(original.soup(), &original.scene())?)
}

/// Whether the key was made for this original and, unless it is taken at its word, is genuine.
pub(super) fn check(original: &Document, key: &Key, trusting: bool) -> Result<(), DetectError> {
    key.check_original(&OriginalDigest::of(original.parts()))?;
    if !trusting {
        key.check_watermark()?;
    }
    Ok(())
}
