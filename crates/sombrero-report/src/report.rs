//! What a report is about.

use crate::evidence::Evidence;
use sombrero::mesh::Soup;
use sombrero::watermark::Key;
use sombrero::{Claim, Detection, Model};

/// A detection and all that is said of it. Lengths are in model units.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// The answer of the detection.
    pub detection: &'a Detection,
    /// Whom that convinces.
    pub claim: &'a Claim,
    /// The key that was looked for. Its secret does not appear, but the page shows its coefficients.
    pub key: &'a Key,
    /// The original, in whose coordinates [`Detection::found`] tells where its points are.
    pub original: &'a Model,
    /// The suspect in its own coordinates; the page moves it by [`Detection::registration`] before it is drawn.
    pub suspect: &'a Soup,
    /// Whether the basis came from a prepared file.
    pub prepared: bool,
    /// Files, settings and program.
    pub evidence: &'a Evidence,
}
