//! What a search may do.

use serde::{Deserialize, Serialize};

/// The condition under which a step is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum When {
    /// The search takes it as the suspect asks for; the paper's method tries with and without, and the better one counts.
    #[default]
    Auto,
    /// Only with it.
    Always,
    /// Only without it.
    Never,
}

impl When {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Always => "always",
            Self::Never => "never",
        }
    }
}

/// The routes that a search may take, and when it may end early.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Whether the suspect is aligned to the original first. Default [`When::Auto`].
    pub registration: When,
    /// Whether surfaces are compared: `Never` forbids it, and `Always` forbids to use vertices that correspond. Default
    /// [`When::Auto`].
    pub resampling: When,
    /// The largest probability of a chance match that still counts as found, above 0 and at most 1; the search ends when
    /// the best is far below. Default 1e-6.
    pub threshold: f64,
    /// CPU seconds of this process after which the search ends with what it has; `None` for as long as it takes. Default `None`.
    pub budget: Option<f64>,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { registration: When::Auto, resampling: When::Auto, threshold: 1e-6, budget: None }
    }
}
