//! What all experiments share: a model with the basis of its marks, any number of marked copies of it, and suspects
//! made of these.

use anyhow::Context;
use nalgebra::Point3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{Attacked, apply_all, parse_list};
use sombrero::basis::Basis;
use sombrero::extraction::{Extractor, extract};
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::watermark::{
    Derivation, Distortion, Identity, Key, OriginalDigest, Parameters, Preset, Secret, embed,
};
use sombrero::{DetectOptions, Detector, Suspect};
use sombrero_tests::recorded_watermark;
use std::path::Path;

/// One of the models, as its file has it.
pub(crate) fn read(folder: &Path, file: &str) -> anyhow::Result<Document> {
    Document::read(&folder.join(file)).context("run `cargo xtask models` first")
}

/// The secret of seed s: 32 bytes s.
pub(crate) fn secret_of_seed(seed: u64) -> anyhow::Result<Secret> {
    Ok(Secret([u8::try_from(seed).context("at most 256 seeds")?; 32]))
}

/// A secret that nobody chose.
pub(crate) fn random_secret(rng: &mut ChaCha8Rng) -> Secret {
    let mut secret = Secret([0; 32]);
    rng.fill_bytes(&mut secret.0);
    secret
}

/// A key that costs nothing, since experiments need thousands, with the watermark that the recorded tables have.
fn key(document: &Document, secret: Secret, parameters: Parameters, basis: &Basis) -> Key {
    let digest = OriginalDigest::of(document.parts());
    let stub = Derivation::stub_for_experiments();
    let watermark = recorded_watermark(document.bytes(), &secret, parameters.basis.coefficients);
    let key = Key::new(&digest, Identity::default(), secret, parameters, &basis.digest(), stub);
    Key { watermark, ..key }
}

/// A model and the basis of its marks.
pub(crate) struct Case {
    pub(crate) document: Document,
    pub(crate) parameters: Parameters,
    /// With the key of an all-zero secret.
    pub(crate) detector: Detector,
}

impl Case {
    pub(crate) fn read(folder: &Path, file: &str, preset: Preset) -> anyhow::Result<Self> {
        Self::new(read(folder, file)?, preset.parameters())
    }

    pub(crate) fn new(document: Document, parameters: Parameters) -> anyhow::Result<Self> {
        let model = sombrero::Model::new(document.soup());
        let basis = model.basis_for(model.progressive(), &parameters.basis, parameters.epsilon)?;
        let mut parameters = parameters;
        parameters.basis.coefficients = basis.functions().len();
        let key = key(&document, Secret([0; 32]), parameters, &basis);
        let detector = Detector::trusting(&document, key)?;
        Ok(Self { document, parameters, detector })
    }

    pub(crate) fn soup(&self) -> &Soup {
        self.detector.model().soup()
    }

    /// Looks for the mark of a secret.
    pub(crate) fn detector(&self, secret: Secret) -> anyhow::Result<Detector> {
        let key = key(&self.document, secret, self.parameters, self.detector.basis());
        Ok(self.detector.for_key(&self.document, key)?)
    }

    /// The model with the mark of a secret.
    pub(crate) fn marked(&self, secret: Secret) -> anyhow::Result<Marked> {
        let detector = self.detector(secret)?;
        let Soup { points, triangles } = self.soup();
        let marked = embed(points, detector.basis(), &detector.key().watermark, self.parameters.epsilon);
        Ok(Marked { detector, copy: Soup::new(marked, triangles.clone()) })
    }

    /// A marked copy for each seed below `runs`.
    pub(crate) fn marked_by_seeds(&self, runs: u64) -> anyhow::Result<Vec<Marked>> {
        (0..runs).map(|seed| self.marked(secret_of_seed(seed)?)).collect()
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

/// A marked copy and who finds its mark.
pub(crate) struct Marked {
    pub(crate) detector: Detector,
    pub(crate) copy: Soup,
}

impl Marked {
    /// Displacements in largest sides.
    pub(crate) fn distortion(&self) -> Distortion {
        let model = self.detector.model();
        let Distortion { max, rms } = Distortion::between(&model.soup().points, &self.copy.points);
        let side = model.largest_side();
        Distortion { max: max / side, rms: rms / side }
    }

    /// The copy after the attacks of a spec.
    pub(crate) fn attacked(&self, specs: &str, seed: u64) -> anyhow::Result<Attacked> {
        Ok(apply_all(&parse_list(specs)?, &self.copy, &mut ChaCha8Rng::seed_from_u64(seed))?)
    }

    /// log10 of the corrected p of a suspect. One that cannot be registered is one in which nothing was found.
    ///
    /// `corresponds`: which vertex is which is known, as in the paper's rows without resampling. Otherwise it is known
    /// only where triangles are those of the original, as in a file.
    pub(crate) fn look(&self, attacked: Attacked, corresponds: bool, options: &DetectOptions) -> f64 {
        let same = attacked.soup.triangles == self.copy.triangles;
        let correspondence = (corresponds || same).then(|| attacked.correspondence(self.copy.points.len()));
        let suspect = Suspect { soup: attacked.soup, correspondence, cloud: false };
        self.detector.detect(&suspect, options).map_or(0.0, |detection| detection.log10_p)
    }
}
