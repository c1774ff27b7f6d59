//! An original and as many marks of it as are asked for.

use crate::marked::read;
use nalgebra::Point3;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use sombrero::Detector;
use sombrero::extraction::{Extractor, extract};
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::watermark::{Identity, Key, OriginalDigest, Parameters, Preset, Secret, embed};
use std::path::Path;

/// A model of the paper with the basis of its marks.
pub(crate) struct Subject {
    pub(crate) document: Document,
    pub(crate) parameters: Parameters,
    /// With the key of an all-zero secret.
    pub(crate) detector: Detector,
}

impl Subject {
    pub(crate) fn read(folder: &Path, file: &str, preset: Preset) -> anyhow::Result<Self> {
        Self::new(read(folder, file)?, preset.parameters())
    }

    pub(crate) fn new(document: Document, parameters: Parameters) -> anyhow::Result<Self> {
        let basis = sombrero::Model::new(&document.soup()).basis(&parameters.basis)?;
        let secret = Secret([0; 32]);
        let key =
            Key::new(&OriginalDigest::of(document.bytes()), Identity::default(), secret, &parameters, &basis);
        let detector = Detector::new(&document, key)?;
        Ok(Self { document, parameters, detector })
    }

    /// The key of a random secret.
    pub(crate) fn key(&self, rng: &mut ChaCha8Rng) -> anyhow::Result<Detector> {
        let mut secret = Secret([0; 32]);
        rng.fill_bytes(&mut secret.0);
        let original = OriginalDigest::of(self.document.bytes());
        let key = Key::new(&original, Identity::default(), secret, &self.parameters, self.detector.basis());
        Ok(self.detector.for_key(&self.document, key)?)
    }

    pub(crate) fn soup(&self) -> &Soup {
        self.detector.model().soup()
    }

    /// The model with the mark of a random secret.
    pub(crate) fn marked(&self, rng: &mut ChaCha8Rng) -> anyhow::Result<(Detector, Soup)> {
        let detector = self.key(rng)?;
        let Soup { points, triangles } = self.soup();
        let marked = embed(points, detector.basis(), &detector.key().watermark, self.parameters.epsilon);
        Ok((detector, Soup::new(marked, triangles.clone())))
    }

    /// The robust extraction for this model.
    pub(crate) fn extractor(&self) -> anyhow::Result<Extractor> {
        Ok(Extractor::new(self.detector.basis(), self.parameters.epsilon, self.soup())?)
    }

    /// w* by the paper's extraction, from where the model's points were found.
    pub(crate) fn extract(&self, found: &[Option<Point3<f64>>]) -> anyhow::Result<Vec<Option<f64>>> {
        let basis = self.detector.basis();
        Ok(extract(basis, self.parameters.epsilon, &self.soup().points, found)?.coefficients)
    }
}
