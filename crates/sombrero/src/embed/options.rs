//! The options of an embedding.

use sombrero_io::Rewrite;
use sombrero_watermark::{Identity, Parameters};

/// The options of an embedding: what the mark says and how strong it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EmbedOptions {
    /// Coefficients, basis function and ε.
    pub parameters: Parameters,
    /// Make do with what the mesh can carry: fewer coefficients, 16 at least, or the preset robust where nothing moves
    /// unseen. Otherwise that is an error. Default: no.
    pub fewer_if_small: bool,
    /// Lower ε so far that no vertex moves by more than this many model units; see
    /// [`Embedder::within`](crate::Embedder::within). Default: `None`.
    pub max_displacement: Option<f64>,
    /// The texts that tell whose mark it is and which copy.
    pub identity: Identity,
    /// Whether stored normals turn with the surface, the name that the copy will have, and how the coordinates of a text
    /// file are spelled. With [`Decimals::Own`](sombrero_io::Decimals) no digit tells which vertices are marked.
    pub rewrite: Rewrite,
}
