//! The options of a detection.

use super::error::DetectError;
use serde::{Deserialize, Serialize};
use sombrero_search::{SearchOptions, Suspect, When};

/// A way to read and compare the coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The default: what else was done to the shape is solved for too, with robust weights and standard errors;
    /// suspects of another connectivity are compared surface to surface; several tests.
    #[default]
    Robust,
    /// The paper's: resampling, least squares, correlation and t test.
    Paper,
}

impl Method {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Robust => "robust",
            Self::Paper => "paper",
        }
    }
}

/// The options of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DetectOptions {
    /// The method. Default [`Method::Robust`].
    pub method: Method,
    /// Whether the suspect is aligned to the original first. Default [`When::Auto`].
    pub registration: When,
    /// Whether the suspect is resampled to the original's connectivity. The robust method does not resample, but
    /// compares surfaces; `Never` forbids that, and `Always` forbids it to use vertices that correspond.
    pub resampling: When,
    /// The mark counts as found when the probability of a chance match is at most this. Default 1e-6.
    pub threshold: f64,
    /// Seed of the points that resampling draws on the suspect. Default 0. The best of several seeds has p times their
    /// number.
    pub seed: u64,
    /// CPU seconds of this process after which the robust method ends with what it has; `None` for as long as it takes, which
    /// comes out the same on every machine. Default `None`.
    #[serde(default)]
    pub budget: Option<f64>,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self {
            method: Method::Robust,
            registration: When::Auto,
            resampling: When::Auto,
            threshold: 1e-6,
            seed: 0,
            budget: None,
        }
    }
}

impl DetectOptions {
    /// Refuses a question that makes no sense.
    pub(crate) fn check(&self, suspect: &Suspect) -> Result<(), DetectError> {
        if !(self.threshold > 0.0 && self.threshold <= 1.0) {
            return Err(DetectError::Threshold { threshold: self.threshold });
        }
        if suspect.soup.triangles.is_empty() {
            return Err(DetectError::NoFaces { which: "suspect" });
        }
        Ok(())
    }

    /// What the robust method's search takes of them.
    pub(crate) fn search(&self) -> SearchOptions {
        let Self { registration, resampling, threshold, budget, .. } = *self;
        SearchOptions { registration, resampling, threshold, budget }
    }
}
