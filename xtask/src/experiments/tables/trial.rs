//! One trial: a model, a basis, a seed and a row of Table 1.

use super::Method;
use super::paper::{Model, Row};
use crate::experiments::case::{Case, Marked, read, secret_of_seed};
use serde::{Deserialize, Serialize};
use sombrero::basis::{BasisFunction, BasisOptions};
use sombrero::watermark::{Distortion, Parameters};
use sombrero::{DetectOptions, When};
use std::path::Path;
use std::time::Instant;

/// What one trial gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Trial {
    pub(crate) method: String,
    pub(crate) model: String,
    pub(crate) basis: String,
    pub(crate) row: String,
    pub(crate) seed: u64,
    pub(crate) log10_p: f64,
    pub(crate) relative_max: f64,
    pub(crate) relative_rms: f64,
    pub(crate) seconds: f64,
}

/// The preset that goes with a method, with this basis function.
fn parameters(method: Method, function: BasisFunction) -> Parameters {
    let parameters = method.preset().parameters();
    Parameters { basis: BasisOptions { function, ..parameters.basis }, ..parameters }
}

/// A marked model and how it is looked at.
pub(crate) struct Subject {
    method: Method,
    model: &'static str,
    function: BasisFunction,
    seed: u64,
    marked: Marked,
    /// In largest sides.
    distortion: Distortion,
}

impl Subject {
    pub(crate) fn new(
        folder: &Path,
        method: Method,
        model: &Model,
        function: BasisFunction,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let case = Case::new(read(folder, model.file)?, parameters(method, function))?;
        let marked = case.marked(secret_of_seed(seed)?)?;
        let distortion = marked.distortion();
        Ok(Self { method, model: model.name, function, seed, marked, distortion })
    }

    /// Attacks the marked mesh and looks for the mark: the paper's method with the steps that the paper's row
    /// took, the robust one without being told anything but the correspondence where the paper knew it.
    pub(crate) fn trial(&self, row: &Row) -> anyhow::Result<Trial> {
        let start = Instant::now();
        let attacked = self.marked.attacked(row.attack, self.seed)?;
        let step = |taken: bool| if taken { When::Always } else { When::Never };
        let usual = DetectOptions { method: self.method.into(), seed: self.seed, ..DetectOptions::default() };
        let options = match self.method {
            Method::Paper => DetectOptions {
                registration: step(row.registration),
                resampling: step(row.resampling),
                ..usual
            },
            Method::Robust | Method::Faithful => usual,
        };
        let log10_p = self.marked.look(attacked, !row.resampling, &options);
        Ok(Trial {
            method: self.method.name().into(),
            model: self.model.into(),
            basis: self.function.to_string(),
            row: row.letter.into(),
            seed: self.seed,
            log10_p,
            relative_max: self.distortion.max,
            relative_rms: self.distortion.rms,
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}
