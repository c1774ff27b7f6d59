//! What the page cannot do, each in one sentence that names the file and the cure.

use crate::file::{LARGEST_FILE, MOST_TRIANGLES};
use sombrero::io::ParseError;
use sombrero::watermark::KeyError;
use sombrero::{DetectError, EmbedError};
use sombrero_report::PageError;
use thiserror::Error;

/// The reason why there is no answer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// A file is larger than browsers bear.
    #[error("{name}: larger than {} MB, and a browser gives a page little memory; use the command `sombrero` for it", LARGEST_FILE >> 20)]
    TooLarge {
        /// The file.
        name: String,
    },
    /// A model has more triangles than browsers bear.
    #[error(
        "{name}: {triangles} triangles, and a browser gives a page memory for {}; use the command `sombrero` for it",
        MOST_TRIANGLES
    )]
    TooMany {
        /// The file.
        name: String,
        /// Its triangles.
        triangles: u64,
    },
    /// A file is no model that can be read.
    // The library does not know that there is nothing to raise here.
    #[error("{name}: {}", source.to_string().replace("raise the limit", "use the command `sombrero`"))]
    Model {
        /// The file.
        name: String,
        /// What is wrong.
        source: ParseError,
    },
    /// A model cannot be marked.
    #[error("{name}: {source}")]
    Mark {
        /// The file.
        name: String,
        /// Why not.
        source: EmbedError,
    },
    /// A file is no key.
    #[error("{name}: {source}")]
    Key {
        /// The file.
        name: String,
        /// What is wrong.
        source: KeyError,
    },
    /// Suspect, original and key do not belong together, or there is nothing to compare.
    #[error("{name}: {source}")]
    Look {
        /// The file that the error is about.
        name: String,
        /// Why there is no verdict.
        source: DetectError,
    },
    /// The report cannot be made.
    #[error(transparent)]
    Page(#[from] PageError),
    /// A secret of another length.
    #[error("a secret has 32 bytes, and this one has {length}; draw it with crypto.getRandomValues")]
    Secret {
        /// Its bytes.
        length: usize,
    },
    /// A model without a surface.
    #[error("{name}: it has no surface to draw; choose a file with triangles")]
    Nothing {
        /// The file.
        name: String,
    },
}
