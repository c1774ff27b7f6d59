//! Whose copy a suspect is.

use crate::detect::Alignment;
use serde::Serialize;
use sombrero_search::Stages;
use sombrero_watermark::Mismatch;

/// A key that takes no part.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Rejected {
    /// Its place among the keys that were given.
    pub index: usize,
    /// The reason.
    pub reason: Mismatch,
}

/// The answer of a trace: whose copies a suspect was made of.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Trace {
    /// Whether anybody is named: p of the first is at most the threshold.
    pub found: bool,
    /// Every key with its p, best first; equal ones in the order in which they were given.
    pub recipients: Vec<Named>,
    /// The threshold for p.
    pub threshold: f64,
    /// The number of tests that p was corrected for: of all keys, in all variants, those left out because one was certain too.
    pub variants_counted: usize,
    /// Share of the original's area that was found on the suspect, 0 to 1.
    pub coverage: f64,
    /// The map that brought the suspect onto the original; `None` when it was taken as it is.
    pub registration: Option<Alignment>,
    /// Keys that turned out not to be genuine when they were about to be named. They are not among the recipients.
    #[serde(skip)]
    pub rejected: Vec<Rejected>,
    /// Whether the budget ran out before all was looked at.
    pub budget_spent: bool,
    /// Seconds by stage.
    pub seconds: Stages,
    /// What the user should know, in sentences.
    pub warnings: Vec<String>,
}

impl Trace {
    /// The answer before anything was looked at.
    pub(super) fn of_nobody(threshold: f64, variants_counted: usize) -> Self {
        Self {
            found: false,
            recipients: Vec::new(),
            threshold,
            variants_counted,
            coverage: 0.0,
            registration: None,
            rejected: Vec::new(),
            budget_spent: false,
            seconds: Stages::default(),
            warnings: Vec::new(),
        }
    }
}

/// One key's part in a suspect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Named {
    /// Its place among the keys that were given to [`Tracer::new`](crate::Tracer::new).
    pub index: usize,
    /// Whether p is at most the threshold.
    pub named: bool,
    /// log10 of the probability that anybody without a part would be named as surely; corrected for the number of
    /// keys and variants, finite.
    pub log10_p: f64,
    /// Correlation of inserted and extracted coefficients, about 1/√c for one of c averaged copies.
    pub correlation: f64,
    /// Whether it shows best beside other keys that were found too.
    pub beside_others: bool,
}
