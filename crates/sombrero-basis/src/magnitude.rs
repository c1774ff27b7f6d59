//! How much each vertex split changes the shape (the paper, section 3).
//!
//! With c the centroid of the new vertex's neighbours at its level and d the unit normal of their ring,
//!
//!   h = d · (v - c):
//!
//! the height of the new vertex over the coarser surface. The m splits of largest |h| carry the mark, and
//! d is the direction in which coefficient i moves the vertices of its support.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{Mesh, VertexId};
use sombrero_progress::Progress;
use sombrero_progressive::ProgressiveMesh;

/// Height and direction of one vertex split.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Magnitude {
    /// h, in model units; its sign is that of the new vertex's side of its ring.
    pub(crate) height: f64,
    /// d, of unit length; zero where the ring has no normal, and then h is zero too.
    pub(crate) direction: Vector3<f64>,
}

/// The magnitude of the split that introduced `v`, from the mesh right after it.
///
/// The ring's normal is that of its polygon (half the sum of cross products of consecutive corners). At a
/// boundary the ring is a path and the polygon is closed by its chord.
pub(crate) fn magnitude(mesh: &Mesh, points: &[Point3<f64>], v: VertexId) -> Magnitude {
    let centre = points[v.index()];
    // Relative to v, so that models far from the origin keep their digits.
    let ring = || mesh.vertices_around_vertex(v).map(|w| points[w.index()] - centre);
    let (mut sum, mut area, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    let mut before = ring().last().unwrap_or_default();
    for p in ring() {
        sum += p;
        area += before.cross(&p);
        count += 1.0;
        before = p;
    }
    let direction = area.try_normalize(0.0).unwrap_or_default();
    Magnitude { height: -direction.dot(&sum) / count, direction }
}

/// Magnitudes of all splits of `progressive`, in order of refinement, with a step of `progress` for each. Leaves it at the
/// full mesh.
pub(crate) fn magnitudes(
    progressive: &mut ProgressiveMesh,
    points: &[Point3<f64>],
    progress: &Progress,
) -> Vec<Magnitude> {
    progressive.go_to(0);
    let mut all = Vec::with_capacity(progressive.split_count());
    while let Some(split) = progressive.refine() {
        all.push(magnitude(progressive.mesh(), points, split.vertex));
        progress.advance(1);
    }
    all
}

/// The `count` splits of largest |h| among those from `first` on, largest first; ties go to the coarser one.
///
/// The paper takes the largest of all. Splits below the [shape
/// level](sombrero_progressive::ProgressiveMesh::shape_level) are left out here: their heights are a large
/// part of the model's size, so a mark on them is visible and says little about the surface.
///
/// Splits whose height is no more than `least` are never taken, so there may be fewer than `count`: they are rounding
/// errors of a flat surface, or so little relief that a mark on them is none.
pub(crate) fn most_significant(
    magnitudes: &[Magnitude],
    first: usize,
    count: usize,
    least: f64,
) -> Vec<usize> {
    let usable = |m: &Magnitude| m.height.is_finite() && m.height.abs() > least;
    let mut order: Vec<usize> = (first..magnitudes.len()).filter(|&i| usable(&magnitudes[i])).collect();
    order.sort_by(|&i, &j| magnitudes[j].height.abs().total_cmp(&magnitudes[i].height.abs()).then(i.cmp(&j)));
    order.truncate(count);
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_apex_has_its_height_over_the_rim() {
        let faces: Vec<_> = (0..4).map(|i| [0, i + 1, (i + 1) % 4 + 1]).collect();
        let mesh = Mesh::from_triangles(5, &faces).unwrap();
        let rim = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)];
        let mut points = vec![Point3::new(5.0, 5.0, 5.75)];
        points.extend(rim.map(|(x, y)| Point3::new(5.0 + x, 5.0 + y, 5.0)));
        let m = magnitude(&mesh, &points, VertexId::new(0));
        assert_eq!(m.direction, Vector3::z());
        assert!((m.height - 0.75).abs() < 1e-15);
    }

    #[test]
    fn the_largest_heights_come_first_and_flat_ones_never() {
        let of = |height: f64| Magnitude { height, direction: Vector3::z() };
        let all = [of(0.1), of(-2.0), of(0.0), of(0.5), of(2.0), of(1e-12)];
        assert_eq!(most_significant(&all, 0, 3, 1e-9), [1, 4, 3]);
        assert_eq!(most_significant(&all, 0, 9, 1e-9), [1, 4, 3, 0]);
        assert_eq!(most_significant(&all, 2, 9, 1e-9), [4, 3]);
        assert_eq!(most_significant(&all, 0, 9, 0.5), [1, 4]);
    }
}
