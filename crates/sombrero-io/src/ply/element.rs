//! Elements and their properties, as the header declares them.

use super::scalar::Scalar;

/// The names of three properties that make a vector.
pub(super) type Axes = [&'static str; 3];
/// A position.
pub(super) const AXES: Axes = ["x", "y", "z"];
/// A normal.
pub(super) const NORMAL: Axes = ["nx", "ny", "nz"];

/// What a property holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Debug, Clone)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Whether the rows are polygons or strips.
    pub(super) fn is_faces(&self) -> bool {
        matches!(self.name.as_str(), "face" | "tristrips")
    }

    /// Bytes of a binary row, if all rows have the same.
    pub(super) fn row_size(&self) -> Option<usize> {
        self.properties
            .iter()
            .map(|p| match p.kind {
                Kind::One(scalar) => Some(scalar.size()),
                Kind::List { .. } => None,
            })
            .sum()
    }
}

/// Whether a property is the list of a face's corners.
pub(super) fn is_corners(property: &Property) -> bool {
    matches!(property.kind, Kind::List { .. })
        && matches!(property.name.as_str(), "vertex_indices" | "vertex_index")
}
