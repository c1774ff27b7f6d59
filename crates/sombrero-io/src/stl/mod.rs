//! STL: facets, each with a normal and three corners of its own, as text or in 50-byte records.
//!
//! Kept: the header, solid names, attribute bytes, whatever follows the last facet. Positions are rewritten,
//! and with them the normals of facets whose corners moved. Refused: a binary file shorter than its facets
//! need, a text that ends before `endsolid`.

mod ascii;
mod binary;

use nalgebra::Point3;

use crate::document::Parsed;
use crate::error::{ParseError, WriteError};
use crate::input::Limits;

pub(crate) use ascii::{encode as encode_ascii, is_ascii};
pub(crate) use binary::{encode as encode_binary, is_binary, may_be_binary};

/// Where the facets stand.
#[derive(Debug, Clone)]
pub(crate) enum Layout {
    Ascii(ascii::Layout),
    /// Records follow each other, so their number, known from the points, says all.
    Binary,
}

impl Layout {
    pub(crate) fn rewrite(
        &self,
        source: &[u8],
        old: &[Point3<f64>],
        new: &[Point3<f64>],
    ) -> Result<Vec<u8>, WriteError> {
        match self {
            Self::Ascii(layout) => Ok(layout.rewrite(source, old, new)),
            Self::Binary => binary::rewrite(source, new),
        }
    }
}

/// Reads the whole file.
pub(crate) fn parse(bytes: &[u8], limits: Limits) -> Result<Parsed, ParseError> {
    // Many binary headers begin with `solid` too: only the length tells, or a zero in the count. Neither changes when
    // positions do.
    if !binary::has_exact_length(bytes) && !has_nul(bytes) {
        ascii::parse(bytes, limits)
    } else {
        binary::parse(bytes, limits)
    }
}

/// Whether the first bytes hold a zero, as the count of a binary file always does.
fn has_nul(bytes: &[u8]) -> bool {
    memchr::memchr(0, &bytes[..bytes.len().min(84)]).is_some()
}

/// One triangle for each three points.
fn triangles(facets: usize) -> Vec<[u32; 3]> {
    let facets = u32::try_from(facets).unwrap_or(u32::MAX).min(u32::MAX / 3);
    (0..facets).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect()
}

/// The unit normal of a triangle by the right-hand rule; zero if it has no area.
fn normal([a, b, c]: [Point3<f64>; 3]) -> [f64; 3] {
    let (u, v) = (b - a, c - a);
    // Scaled first, so that squares of huge or tiny sides neither overflow nor vanish.
    let (along, across) = (u.amax(), v.amax());
    if !(along > 0.0 && across > 0.0 && along.is_finite() && across.is_finite()) {
        return [0.0; 3];
    }
    let cross = (u / along).cross(&(v / across));
    cross.try_normalize(0.0).map_or([0.0; 3], Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_any_size() {
        for size in [1e-200, 1e-3, 1.0, 1e200] {
            let corner = |x, y| Point3::new(x, y, 0.0);
            assert_eq!(normal([corner(0.0, 0.0), corner(size, 0.0), corner(0.0, size)]), [0.0, 0.0, 1.0]);
            assert_eq!(normal([corner(0.0, 0.0), corner(size, 0.0), corner(size, 0.0)]), [0.0; 3]);
        }
    }
}
