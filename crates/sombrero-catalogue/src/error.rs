//! What can go wrong, and the cure.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a surface cannot be described.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// No triangles.
    #[error("there are no triangles; a catalogue holds and finds surfaces, not sets of points")]
    Empty,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {vertices}")]
    MissingVertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A vertex in use is NaN or infinite, or so large that areas overflow.
    #[error("vertex {vertex} has a coordinate that is not finite or too large; remove or repair it")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// All triangles shrink to points or lines.
    #[error("the surface has no area; all its triangles have collapsed")]
    NoArea,
}

/// Why a catalogue cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CatalogueError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is something else already.
    #[error("{} exists and is not empty; name another folder for a new catalogue", path.display())]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// Not a catalogue, or one of a later version.
    #[error("{} is no catalogue that this version can read", path.display())]
    NotACatalogue {
        /// The file or folder.
        path: PathBuf,
    },
    /// Another process writes.
    #[error("another process is changing the catalogue {}; wait until it ends", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The name is taken.
    #[error("the catalogue has an entry `{name}` already; remove it first or choose another name")]
    Taken {
        /// The name.
        name: String,
    },
    /// A name that cannot be one, or a text that is too long.
    #[error(
        "`{name}` cannot be added: a name must not be empty, and name, place and note have at most 65535 bytes"
    )]
    Text {
        /// The name.
        name: String,
    },
    /// Bytes are not what was written.
    #[error("{0}; rebuild the catalogue")]
    Damaged(Damage),
}

impl CatalogueError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_owned(), source }
    }
}

/// A place in a catalogue where bytes are not what was written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{} is damaged at byte {offset}{}", file.display(), entry.as_ref().map_or(String::new(), |name| format!(" (entry `{name}`)")))]
#[non_exhaustive]
pub struct Damage {
    /// The file.
    pub file: PathBuf,
    /// Where the damaged piece starts.
    pub offset: u64,
    /// The entry whose portrait it is; `None` when it is none, or the name is damaged too.
    pub entry: Option<String>,
}
