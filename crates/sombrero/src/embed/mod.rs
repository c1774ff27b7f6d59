//! Marks a file.

mod choice;
mod embedder;
mod error;
mod limit;
mod marked;
mod options;
mod self_test;

pub use embedder::Embedder;
pub use error::EmbedError;
pub use marked::{DistortionReport, EmbedReport, Marked};
pub use options::EmbedOptions;

use sombrero_io::Document;
use sombrero_watermark::Secret;

/// Marks `original` with a watermark that follows from its bytes, the identity and `secret`, and checks
/// that the marked file gives the mark back.
///
/// What became of the model is measured too ([`EmbedReport::fidelity`]). For many copies of one original make an [`Embedder`]
/// once, which measures when it is asked to.
///
/// # Errors
/// [`EmbedError`] when the mesh cannot carry the mark or the format cannot store it.
///
/// # Example
/// ```
/// use sombrero::{EmbedOptions, embed, io::{Document, Format, encode}, shapes, watermark::Secret};
///
/// let file = encode(Format::Obj, &shapes::bumpy_sphere(2000))?;
/// let original = Document::parse(file, None)?;
/// let marked = embed(&original, Secret([1; 32]), &EmbedOptions::default())?;
/// assert!(marked.report.fidelity.is_some_and(|fidelity| fidelity.normals_rms < 0.3));
/// assert!(marked.report.log10_p < -100.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn embed(original: &Document, secret: Secret, options: &EmbedOptions) -> Result<Marked, EmbedError> {
    let EmbedOptions { parameters, fewer_if_small, max_displacement, .. } = *options;
    let embedder = Embedder::within(original, parameters, fewer_if_small, max_displacement)?;
    let marked = embedder.mark(options.identity.clone(), secret, &options.rewrite)?;
    Ok(embedder.finished(marked))
}
