//! Typed 32-bit indices of mesh elements.
//!
//! An index of one kind cannot be used for another, and there is no magic null: absence is `Option`.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $letter:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(u32);

        impl $name {
            /// The element with this index.
            ///
            /// # Panics
            /// When `index` does not fit into 32 bits.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("meshes have fewer than 2^32 elements of a kind"))
            }

            /// From an index that is known to be 32-bit.
            #[inline]
            #[allow(dead_code, reason = "not every kind of index comes from a list")]
            pub(crate) fn from_u32(index: u32) -> Self {
                Self(index)
            }

            /// The index in the width that triangles use.
            #[inline]
            pub fn to_u32(self) -> u32 {
                self.0
            }

            /// The index, for use with slices.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($letter, "{}"), self.0)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Debug::fmt(self, f)
            }
        }
    };
}

id!(
    /// A vertex; prints as `v3`.
    VertexId,
    "v"
);
id!(
    /// A halfedge; prints as `h7`. Twins differ in the lowest bit.
    HalfedgeId,
    "h"
);
id!(
    /// An edge; prints as `e3`. Its halfedges are `h6` and `h7`.
    EdgeId,
    "e"
);
id!(
    /// A face; prints as `f1`.
    FaceId,
    "f"
);

impl HalfedgeId {
    /// Larger than any halfedge in use; never leaves the construction of a mesh.
    pub(crate) const MAX: Self = Self(u32::MAX);

    /// The other halfedge of the same edge.
    #[inline]
    pub fn twin(self) -> Self {
        Self(self.0 ^ 1)
    }

    /// The edge that this halfedge is a side of.
    #[inline]
    pub fn edge(self) -> EdgeId {
        EdgeId(self.0 >> 1)
    }
}

impl EdgeId {
    /// The first of the edge's two halfedges; the other is its twin.
    #[inline]
    pub fn halfedge(self) -> HalfedgeId {
        HalfedgeId(self.0 << 1)
    }
}
