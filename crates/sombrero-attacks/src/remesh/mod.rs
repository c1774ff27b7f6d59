//! Isotropic remeshing (Botsch, Kobbelt, "A Remeshing Approach to Multiresolution Modeling", 2004): other
//! vertices and other faces on the same surface, all edges about equally long. With the wanted length l, each
//! iteration
//!
//! 1. splits edges longer than 4/3 l in the middle,
//! 2. collapses edges shorter than 4/5 l,
//! 3. flips edges where that brings numbers of neighbours closer to 6 (4 at a rim),
//! 4. moves vertices towards the means of their neighbours, along the surface, and back onto the original.
//!
//! After a split at 4/3 l or a collapse at 4/5 l the new edges are closer to l than the old ones were. Edges at which
//! the surface turns by more than 53 degrees, and rims, are creases: they are not flipped, and their vertices
//! stay on the original creases.

mod collapse;
mod creases;
mod flip;
mod relax;
mod split;

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::{Point3, Vector3};
use rand::Rng;
use relax::Original;
use sombrero_mesh::geometry::{area_vector, mean_edge_length};
use sombrero_mesh::{BoundingBox, Soup, repair};

/// How to remesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remeshing {
    /// The wanted length of edges as a multiple of their mean length, between 0.01 and 100.
    pub length: f64,
    /// How many times to split, collapse, flip and relax, at most 100. Default 5.
    pub iterations: u32,
}

/// Remeshes.
///
/// Its vertices are new: none has a source. It is a manifold of the same topology as the repaired `soup`.
///
/// # Errors
/// [`AttackError::Parameter`] when a parameter is out of range, [`AttackError::NothingLeft`] when no face is usable,
/// [`AttackError::NoExtent`] for a mesh of no size and [`AttackError::TooManyFaces`] for edges too short.
pub fn remesh(soup: &Soup, remeshing: &Remeshing) -> Result<Attacked, AttackError> {
    in_range("length", remeshing.length, (0.01, 100.0), "between 0.01 and 100")?;
    in_range("iterations", f64::from(remeshing.iterations), (0.0, 100.0), "between 0 and 100")?;
    let made = repair(soup);
    let bounds = BoundingBox::of(&made.points).ok_or(AttackError::NothingLeft)?;
    // Lengths of order 1 keep squares and cross products in range.
    let side = bounds.largest_side();
    let points: Vec<Point3<f64>> =
        made.points.iter().map(|p| Point3::from((p - bounds.min) / side)).collect();
    let length = remeshing.length * mean_edge_length(&made.mesh, &points);
    // Not a number without a size, or with one beyond all numbers.
    if !(length > 0.0 && length.is_finite()) {
        return Err(AttackError::NoExtent);
    }
    let original = Original::new(&points, &made.mesh.triangles());
    let mut fine = Soup::new(points, made.mesh.triangles());
    for _ in 0..remeshing.iterations {
        split::split(&mut fine, 4.0 / 3.0 * length)?;
        collapse::collapse(&mut fine, 4.0 / 5.0 * length, 4.0 / 3.0 * length);
        flip::flip(&mut fine);
        relax::relax(&mut fine, &original, length);
    }
    fine.points.iter_mut().for_each(|p| *p = bounds.min + p.coords * side);
    Ok(Attacked::anew(fine))
}

/// Cosine of the largest angle by which an operation may turn a face.
const LARGEST_TURN: f64 = 0.5;

/// Whether a face with this area vector is turned too far by the move to `after`. Without an area it faces nowhere.
fn turns(before: &Vector3<f64>, after: &Vector3<f64>) -> bool {
    before.dot(after) < LARGEST_TURN * before.norm() * after.norm()
        || (after.norm() == 0.0 && before.norm() > 0.0)
}

/// The area vector of a face.
fn facing(points: &[Point3<f64>], corners: [u32; 3]) -> Vector3<f64> {
    let [a, b, c] = corners.map(|v| &points[v as usize]);
    area_vector(a, b, c)
}

impl Operation for Remeshing {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self {
            length: given.needed_number("length")?,
            iterations: given.whole("iterations")?.unwrap_or(5),
        })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("length", self.length.to_string()), ("iterations", self.iterations.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        remesh(soup, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_mesh::repair::Repaired;
    use sombrero_mesh::{geometry, topology};
    use sombrero_shapes as shapes;
    use sombrero_spatial::{DistanceOptions, compare};

    const ONCE: Remeshing = Remeshing { length: 1.0, iterations: 5 };

    fn made(soup: &Soup, remeshing: &Remeshing) -> (Soup, Repaired) {
        let attacked = remesh(soup, remeshing).unwrap();
        assert!(attacked.source.iter().all(Option::is_none));
        let repaired = repair(&attacked.soup);
        assert!(repaired.report.is_clean(), "{:?}", repaired.report);
        assert_eq!(repaired.report.unused_vertices, 0);
        (attacked.soup, repaired)
    }

    fn surfaces() -> Vec<Soup> {
        vec![
            shapes::sphere(3),
            shapes::torus(30, 18, 1.0, 0.4),
            shapes::genus(2, 2),
            shapes::bust(10),
            shapes::part(6),
            shapes::open_sheet(16, 16),
            shapes::sheet_with_hole(15, 15),
        ]
    }

    /// The part of the edges whose length is between 0.5 and 1.6 times the wanted one.
    fn part_near(soup: &Soup, fine: &Repaired, factor: f64) -> f64 {
        let before = repair(soup);
        let length = factor * geometry::mean_edge_length(&before.mesh, &before.points);
        let near = |l: f64| (0.5 * length..1.6 * length).contains(&l);
        let lengths = fine.mesh.edges().map(|e| geometry::edge_length(&fine.mesh, &fine.points, e));
        lengths.filter(|l| near(*l)).count() as f64 / fine.mesh.edge_count() as f64
    }

    #[test]
    fn surfaces_keep_their_shape_and_topology() {
        for (i, soup) in surfaces().iter().enumerate() {
            let side = soup.bounding_box().unwrap().largest_side();
            for (length, limit) in [(0.6, 0.02), (1.0, 0.04), (1.7, 0.09)] {
                let (fine, repaired) = made(soup, &Remeshing { length, ..ONCE });
                let before = repair(soup);
                let genus = topology::genus(&before.mesh);
                assert_eq!(topology::genus(&repaired.mesh), genus);
                let loops = |r: &Repaired| topology::boundary_loops(&r.mesh).len();
                assert_eq!(loops(&repaired), loops(&before));
                let apart = compare(soup, &fine, &DistanceOptions { samples: 5000 }).unwrap();
                assert!(apart.hausdorff < limit * side, "shape {i}, {length}: {}", apart.hausdorff / side);
                let near = part_near(soup, &repaired, length);
                assert!(near > 0.9, "shape {i}, {length}: {near}");
            }
        }
    }

    #[test]
    fn a_part_keeps_its_edges() {
        let part = shapes::part(8);
        let (fine, _) = made(&part, &ONCE);
        let (a, b) = (part.bounding_box().unwrap(), fine.bounding_box().unwrap());
        assert!((a.min - b.min).amax().max((a.max - b.max).amax()) < 3e-3 * a.largest_side());
        let apart = compare(&part, &fine, &DistanceOptions { samples: 20_000 }).unwrap();
        assert!(apart.rms < 2e-3 * a.largest_side(), "{apart:?}");
    }

    #[test]
    fn the_corners_of_a_sheet_stay() {
        let sheet = shapes::open_sheet(12, 12);
        let (fine, _) = made(&sheet, &ONCE);
        let (a, b) = (sheet.bounding_box().unwrap(), fine.bounding_box().unwrap());
        assert!((a.sides() - b.sides()).amax() < 0.01 * a.largest_side());
    }

    #[test]
    fn neighbours_become_six() {
        let soup = shapes::bust(12);
        let (_, fine) = made(&soup, &Remeshing { length: 1.0, iterations: 10 });
        let six = fine.mesh.vertices().filter(|&v| (5..=7).contains(&fine.mesh.valence(v))).count();
        assert!(six as f64 > 0.97 * fine.mesh.vertex_count() as f64, "{six} of {}", fine.mesh.vertex_count());
    }

    #[test]
    fn senseless_meshes_are_refused() {
        let point = Soup::new(vec![Point3::new(1.0, 2.0, 3.0); 3], vec![[0, 1, 2]]);
        assert_eq!(remesh(&point, &ONCE), Err(AttackError::NoExtent));
        assert_eq!(remesh(&Soup::new(point.points, vec![[0, 0, 7]]), &ONCE), Err(AttackError::NothingLeft));
        let finest = Remeshing { length: 0.01, iterations: 1 };
        assert_eq!(remesh(&shapes::sphere(6), &finest), Err(AttackError::TooManyFaces));
        assert!(remesh(&shapes::sphere(1), &Remeshing { length: 0.0, ..ONCE }).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn any_soup_gives_a_manifold_or_an_error(
            points in prop::collection::vec([-2i32..3, -2..3, -2..3], 3..10),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..10), 1..20),
            length in 0.2..4.0,
        ) {
            let points = points.into_iter().map(|p| Point3::from(p.map(f64::from))).collect();
            let soup = Soup::new(points, triangles);
            if let Ok(fine) = remesh(&soup, &Remeshing { length, iterations: 3 }) {
                prop_assert!(repair(&fine.soup).report.is_clean());
                prop_assert!(fine.soup.points.iter().all(|p| p.iter().all(|x| x.abs() < 3.0)));
            }
        }
    }
}
