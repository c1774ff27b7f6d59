//! What both ways to write STL have in common.

use nalgebra::Point3;

/// One triangle for each three points.
pub(super) fn triangles(facets: usize) -> Vec<[u32; 3]> {
    let facets = u32::try_from(facets).unwrap_or(u32::MAX).min(u32::MAX / 3);
    (0..facets).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect()
}

/// The unit normal of a triangle by the right-hand rule; zero if it has no area.
pub(super) fn normal([a, b, c]: [Point3<f64>; 3]) -> [f64; 3] {
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
