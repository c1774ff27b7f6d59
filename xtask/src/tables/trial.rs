//! One trial: a model, a basis, a seed and a row of Table 1.

use super::paper::{Model, Row};
use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use sombrero::attacks::{Attack, apply_all};
use sombrero::basis::{BasisFunction, BasisOptions};
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::watermark::{Distortion, Identity, Key, Parameters, Preset, Secret, embed};
use sombrero::{DetectOptions, Prepared, Step, Suspect};
use std::path::Path;
use std::time::Instant;

/// An original, marked with one seed's watermark.
pub(crate) struct Marked {
    pub(crate) model: &'static str,
    pub(crate) function: BasisFunction,
    pub(crate) seed: u64,
    prepared: Prepared,
    soup: Soup,
    relative_max: f64,
    relative_rms: f64,
}

/// What one trial gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Trial {
    pub(crate) model: String,
    pub(crate) basis: String,
    pub(crate) row: String,
    pub(crate) seed: u64,
    pub(crate) log10_p: f64,
    pub(crate) relative_max: f64,
    pub(crate) relative_rms: f64,
    pub(crate) seconds: f64,
}

impl Marked {
    pub(crate) fn new(
        folder: &Path,
        model: &Model,
        function: BasisFunction,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let document = Document::read(&folder.join(model.file)).context("run `cargo xtask models` first")?;
        let surface = sombrero::Model::new(&document.soup());
        let Parameters { basis: usual, epsilon } = Preset::Paper.parameters();
        let parameters = Parameters { basis: BasisOptions { function, ..usual }, epsilon };
        let basis = surface.basis(&parameters.basis)?;
        let secret = Secret([u8::try_from(seed).context("at most 256 seeds")?; 32]);
        let key = Key::new(document.bytes(), Identity::default(), secret, &parameters, &basis);
        let Soup { points, triangles } = surface.soup();
        let marked = embed(points, &basis, &key.watermark, epsilon);
        let Distortion { max, rms } = Distortion::between(points, &marked);
        let side = surface.largest_side();
        Ok(Self {
            model: model.name,
            function,
            seed,
            prepared: Prepared::new(&document, key)?,
            soup: Soup::new(marked, triangles.clone()),
            relative_max: max / side,
            relative_rms: rms / side,
        })
    }

    /// Attacks the marked mesh and looks for the mark, with the steps that the paper's row took.
    pub(crate) fn trial(&self, row: &Row) -> anyhow::Result<Trial> {
        let start = Instant::now();
        let attacks: Vec<Attack> = row.attack.split(' ').map(str::parse).collect::<Result<_, _>>()?;
        let attacked = apply_all(&attacks, &self.soup, &mut ChaCha8Rng::seed_from_u64(self.seed))?;
        let correspondence = (!row.resampling).then(|| attacked.correspondence(self.soup.points.len()));
        let step = |taken: bool| if taken { Step::Always } else { Step::Never };
        let options = DetectOptions {
            registration: step(row.registration),
            resampling: step(row.resampling),
            seed: self.seed,
            ..DetectOptions::default()
        };
        let suspect = Suspect { soup: attacked.soup, correspondence };
        // A suspect that cannot be registered is one in which nothing was found.
        let log10_p = self.prepared.detect(&suspect, &options).map_or(0.0, |detection| detection.log10_p);
        Ok(Trial {
            model: self.model.into(),
            basis: self.function.to_string(),
            row: row.letter.into(),
            seed: self.seed,
            log10_p,
            relative_max: self.relative_max,
            relative_rms: self.relative_rms,
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}
