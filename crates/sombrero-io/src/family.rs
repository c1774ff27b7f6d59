//! The row of a format: its names, how it is recognised, read and written.

use sombrero_mesh::Soup;

use crate::error::{ParseError, WriteError};
use crate::format::Format;
use crate::input::Source;
use crate::parsed::Parsed;

/// A format with all its variants, which share a reader.
#[derive(Debug)]
pub(crate) struct Family {
    /// The name in messages.
    pub(crate) name: &'static str,
    /// The variants. Of those with the same extension the first is the one that new files get.
    pub(crate) variants: &'static [&'static Variant],
    /// How much the bytes of a file speak for this format.
    pub(crate) recognise: fn(&[u8]) -> Evidence,
    /// The reader.
    pub(crate) parse: fn(Source<'_>) -> Result<Parsed, ParseError>,
    /// Why a file that is well-formed has no vertices.
    pub(crate) empty: ParseError,
}

/// One way to write a format.
#[derive(Debug)]
pub(crate) struct Variant {
    pub(crate) format: Format,
    /// The name for people.
    pub(crate) name: &'static str,
    /// What the name of a file ends with, without the dot, in small letters.
    pub(crate) extension: &'static str,
    /// Whether there is no file without triangles.
    pub(crate) needs_triangles: bool,
    /// A plain new file. The mesh was checked: finite points, and triangles within them.
    pub(crate) encode: fn(&Soup) -> Result<Vec<u8>, WriteError>,
}

/// How much the bytes of a file speak for a format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Evidence {
    /// Nothing speaks for it.
    None,
    /// Nothing speaks against it: enough when the file's name says so and no other format is certain.
    Possible,
    /// Words or a length as the format has them.
    Likely,
    /// A signature that other formats do not begin with.
    Certain,
}

impl Evidence {
    /// `self` where it is true, else none.
    pub(crate) fn when(self, there: bool) -> Self {
        if there { self } else { Self::None }
    }
}
