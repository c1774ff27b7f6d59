//! A model with one seed's mark, and suspects made from it.

use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{Attack, Attacked, apply_all};
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::watermark::{Distortion, Identity, Key, OriginalDigest, Parameters, Secret, embed};
use sombrero::{DetectOptions, Detector, Suspect};
use std::path::Path;

/// One of the models, as its file has it.
pub(crate) fn read(folder: &Path, file: &str) -> anyhow::Result<Document> {
    Document::read(&folder.join(file)).context("run `cargo xtask models` first")
}

/// An original and its marked copy.
pub(crate) struct Marked {
    pub(crate) detector: Detector,
    pub(crate) copy: Soup,
    /// Displacements in largest sides.
    pub(crate) relative_max: f64,
    pub(crate) relative_rms: f64,
}

impl Marked {
    /// Seed s has the secret of 32 bytes s.
    pub(crate) fn new(document: &Document, parameters: &Parameters, seed: u64) -> anyhow::Result<Self> {
        let surface = sombrero::Model::new(&document.soup());
        let basis = surface.basis(&parameters.basis)?;
        let secret = Secret([u8::try_from(seed).context("at most 256 seeds")?; 32]);
        let original = OriginalDigest::of(document.bytes());
        let key = Key::new(&original, Identity::default(), secret, parameters, &basis);
        let Soup { points, triangles } = surface.soup();
        let marked = embed(points, &basis, &key.watermark, parameters.epsilon);
        let Distortion { max, rms } = Distortion::between(points, &marked);
        let side = surface.largest_side();
        Ok(Self {
            detector: Detector::new(document, key)?,
            copy: Soup::new(marked, triangles.clone()),
            relative_max: max / side,
            relative_rms: rms / side,
        })
    }

    /// The copy after the attacks of a spec, separated by spaces.
    pub(crate) fn attacked(&self, specs: &str, seed: u64) -> anyhow::Result<Attacked> {
        let attacks: Vec<Attack> = specs.split(' ').map(str::parse).collect::<Result<_, _>>()?;
        Ok(apply_all(&attacks, &self.copy, &mut ChaCha8Rng::seed_from_u64(seed))?)
    }

    /// log10 of the corrected p of a suspect. One that cannot be registered is one in which nothing was found.
    ///
    /// `corresponds`: which vertex is which is known, as in the paper's rows without resampling. Otherwise it is known
    /// only where triangles are those of the original, as in a file.
    pub(crate) fn look(&self, attacked: Attacked, corresponds: bool, options: &DetectOptions) -> f64 {
        let same = attacked.soup.triangles == self.copy.triangles;
        let correspondence = (corresponds || same).then(|| attacked.correspondence(self.copy.points.len()));
        let suspect = Suspect { soup: attacked.soup, correspondence };
        self.detector.detect(&suspect, options).map_or(0.0, |detection| detection.log10_p)
    }
}
