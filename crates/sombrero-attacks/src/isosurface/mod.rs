//! Remeshing through a distance field: the zero set of the signed distance to the mesh, sampled on a grid, by
//! marching cubes (Lorensen, Cline 1987).
//!
//! Nothing of the old connectivity is left, and details smaller than a cell go. Between two grid corners with
//! distances f < 0 ≤ g along an edge the surface is taken to cross at the part f / (f - g) of the edge.
//!
//! Only cells that a triangle touches are looked at, for a true crossing cannot be elsewhere; so work and memory
//! grow with the area, not with the volume. On a grid edge of length 1 that a triangle crosses, |f| + |g| ≤ 1;
//! where the sign changes with |f| + |g| > 1 it jumps between two sheets, and no surface is made. The same
//! holds where the points closest to both ends lie on a rim of the mesh: behind a rim there is no inside,
//! so holes stay open, to within about a cell.

mod band;
mod cases;
mod signed;

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use band::Band;
use cases::{Crossing, polygons};
use nalgebra::{Point3, Vector3};
use rand::Rng;
use signed::{Sample, SignedDistance};
use sombrero_mesh::{BoundingBox, Soup, repair};

/// Cells between the bounding box and the first grid plane. Its fraction is irrational (the golden ratio's), so that
/// planes at simple fractions of the box, which parts are made of, do not coincide with grid planes.
const MARGIN: f64 = 2.618_033_988_749_895;

/// Crossings keep this distance, in cells, from grid corners, and so from each other.
const APART: f64 = 1e-3;

/// A vertex that has not been made.
const NONE: u32 = u32::MAX;

/// The surface again, from distances on a grid of `resolution` cells along the largest side of the bounding box.
///
/// Its vertices are new: none has a source. It is a manifold, oriented as `soup` is.
///
/// # Errors
/// [`AttackError::Parameter`] unless there are 2 to 1024 cells, [`AttackError::NothingLeft`] when no face
/// is usable or all of them fall through the grid, [`AttackError::NoExtent`] for a mesh of no size, and
/// [`AttackError::TooManyFaces`] when it touches too many cells.
pub fn isosurface(soup: &Soup, resolution: u32) -> Result<Attacked, AttackError> {
    in_range("resolution", f64::from(resolution), (2.0, 1024.0), "between 2 and 1024")?;
    let made = repair(soup);
    let bounds = BoundingBox::of(&made.points).ok_or(AttackError::NothingLeft)?;
    let grid = Grid::new(bounds, resolution)?;
    // Over the vertices as they were given: where repair parted sheets there is no rim.
    let triangles: Vec<[u32; 3]> =
        made.mesh.triangles().iter().map(|corners| corners.map(|v| made.source[v as usize])).collect();
    let points: Vec<Point3<f64>> = soup.points.iter().map(|p| grid.in_cells(p)).collect();
    let band = Band::new(&points, &triangles, grid.corners)?;
    let samples = SignedDistance::new(&points, triangles).at(&band.corner_points());
    let mut surface = march(&band, &samples);
    surface.points.iter_mut().for_each(|p| *p = grid.in_model(p));
    // Where cells were left out, the rest may touch itself at a vertex.
    let manifold = repair(&surface);
    if manifold.mesh.face_count() == 0 {
        return Err(AttackError::NothingLeft);
    }
    Ok(Attacked::anew(Soup::new(manifold.points, manifold.mesh.triangles())))
}

/// Where the cells are.
struct Grid {
    bounds: BoundingBox,
    /// Cells per unit of length are `resolution / side`.
    side: f64,
    resolution: f64,
    /// Corners along each axis.
    corners: [u32; 3],
}

impl Grid {
    fn new(bounds: BoundingBox, resolution: u32) -> Result<Self, AttackError> {
        let (side, resolution) = (bounds.largest_side(), f64::from(resolution));
        let cells = (bounds.sides() / side * resolution).add_scalar(2.0 * MARGIN);
        // Not a number without a size, or with one beyond all numbers.
        if !cells.iter().all(|x| x.is_finite()) {
            return Err(AttackError::NoExtent);
        }
        Ok(Self { bounds, side, resolution, corners: [0, 1, 2].map(|k| cells[k].ceil() as u32 + 1) })
    }

    fn in_cells(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from(((p - self.bounds.min) / self.side * self.resolution).add_scalar(MARGIN))
    }

    fn in_model(&self, p: &Point3<f64>) -> Point3<f64> {
        self.bounds.min + p.coords.add_scalar(-MARGIN) / self.resolution * self.side
    }
}

/// Marching cubes over the cells of the band, in their order.
fn march(band: &Band, samples: &[Sample]) -> Soup {
    let cases: Vec<_> = (0..=255u8).map(polygons).collect();
    let mut made = Made { band, samples, surface: Soup::default(), numbers: vec![NONE; 3 * samples.len()] };
    band.each_cell(|corners| {
        let inside = |i: usize| u8::from(samples[corners[i]].distance < 0.0) << i;
        let case: u8 = (0..8).map(inside).sum();
        for polygon in &cases[case as usize] {
            made.polygon(&corners, polygon);
        }
    });
    made.surface
}

/// What has been made so far.
struct Made<'a> {
    band: &'a Band,
    samples: &'a [Sample],
    surface: Soup,
    /// The vertex on the grid edge that leaves each corner along each axis, or `NONE`.
    numbers: Vec<u32>,
}

impl Made<'_> {
    fn polygon(&mut self, corners: &[usize; 8], polygon: &[Crossing]) {
        let ends = |c: &Crossing| [corners[c.corner], corners[c.corner | 1 << c.axis]];
        if !polygon.iter().all(|c| self.is_crossed(ends(c))) {
            return;
        }
        let numbers: Vec<u32> = polygon.iter().map(|c| self.vertex(ends(c), c.axis)).collect();
        let fan = numbers.windows(2).skip(1).map(|w| [numbers[0], w[0], w[1]]);
        self.surface.triangles.extend(fan);
    }

    /// Whether the sign changes at the surface rather than between sheets or behind a rim.
    fn is_crossed(&self, ends: [usize; 2]) -> bool {
        let [a, b] = ends.map(|i| &self.samples[i]);
        a.distance.abs() + b.distance.abs() <= 1.0 + 1e-6 && !(a.on_rim && b.on_rim)
    }

    fn vertex(&mut self, [from, to]: [usize; 2], axis: usize) -> u32 {
        let slot = 3 * from + axis;
        if self.numbers[slot] == NONE {
            self.numbers[slot] = self.surface.points.len() as u32;
            let [f, g] = [from, to].map(|i| self.samples[i].distance);
            let part = (f / (f - g)).clamp(APART, 1.0 - APART);
            self.surface.points.push(self.band.corner_point(from) + Vector3::ith(axis, part));
        }
        self.numbers[slot]
    }
}

/// Marching cubes of the signed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Isosurface {
    /// Cells along the largest side, between 2 and 1024.
    pub resolution: u32,
}

impl Operation for Isosurface {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let resolution = given.whole("resolution")?;
        Ok(Self { resolution: given.needed("resolution", resolution)? })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("resolution", self.resolution.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        isosurface(soup, self.resolution)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_mesh::{geometry, topology};
    use sombrero_shapes as shapes;
    use sombrero_spatial::{DistanceOptions, compare};

    fn made(soup: &Soup, resolution: u32) -> (Soup, sombrero_mesh::repair::Repaired) {
        let attacked = isosurface(soup, resolution).unwrap();
        assert!(attacked.source.iter().all(Option::is_none));
        let repaired = repair(&attacked.soup);
        assert!(repaired.report.is_clean(), "{:?}", repaired.report);
        (attacked.soup, repaired)
    }

    fn hausdorff(a: &Soup, b: &Soup) -> f64 {
        compare(a, b, &DistanceOptions { samples: 5000 }).unwrap().hausdorff
    }

    #[test]
    fn closed_surfaces_stay_closed() {
        let shapes = [
            (shapes::sphere(4), Some(0)),
            (shapes::torus(40, 24, 1.0, 0.4), Some(1)),
            (shapes::genus(2, 3), Some(2)),
            (shapes::part(6), topology::genus(&repair(&shapes::part(6)).mesh)),
        ];
        for (soup, genus) in shapes {
            let side = soup.bounding_box().unwrap().largest_side();
            let (fine, repaired) = made(&soup, 48);
            assert_eq!(topology::genus(&repaired.mesh), genus);
            assert!(topology::boundary_loops(&repaired.mesh).is_empty());
            assert!(hausdorff(&soup, &fine) < side / 48.0);
            let volume = |r: &sombrero_mesh::repair::Repaired| geometry::volume(&r.mesh, &r.points);
            assert!((volume(&repaired) / volume(&repair(&soup)) - 1.0).abs() < 0.05, "outside stays outside");
        }
    }

    #[test]
    fn a_sphere_becomes_rounder_with_every_cell() {
        let soup = shapes::sphere(5);
        let errors = [16, 32, 64].map(|n| {
            let (fine, _) = made(&soup, n);
            fine.points.iter().map(|p| (p.coords.norm() - 1.0).abs()).fold(0.0, f64::max)
        });
        assert!(errors[2] < 1e-3 && errors[2] < errors[1] && errors[1] < errors[0], "{errors:?}");
    }

    #[test]
    fn a_sheet_stays_open_and_keeps_its_hole() {
        for (soup, loops) in [(shapes::open_sheet(20, 20), 1), (shapes::sheet_with_hole(24, 24), 2)] {
            let (fine, repaired) = made(&soup, 40);
            assert_eq!(topology::components(&repaired.mesh).1, 1);
            assert_eq!(topology::boundary_loops(&repaired.mesh).len(), loops);
            let cell = soup.bounding_box().unwrap().largest_side() / 40.0;
            assert!(hausdorff(&soup, &fine) < 1.5 * cell);
        }
    }

    #[test]
    fn planes_on_grid_planes_are_no_trouble() {
        for n in 2..12 {
            let (fine, repaired) = made(&shapes::cube(), n);
            assert_eq!(topology::genus(&repaired.mesh), Some(0));
            assert!(topology::boundary_loops(&repaired.mesh).is_empty());
            let side = shapes::cube().bounding_box().unwrap().largest_side();
            assert!(hausdorff(&shapes::cube(), &fine) < side / f64::from(n));
        }
    }

    #[test]
    fn inside_out_stays_inside_out() {
        let mut soup = shapes::sphere(3);
        soup.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let (_, repaired) = made(&soup, 20);
        assert!(geometry::volume(&repaired.mesh, &repaired.points) < 0.0);
    }

    #[test]
    fn meshes_without_size_or_faces_are_refused() {
        let point = Soup::new(vec![Point3::new(1.0, 2.0, 3.0); 3], vec![[0, 1, 2]]);
        assert_eq!(isosurface(&point, 32), Err(AttackError::NoExtent));
        let far = Soup::new(
            vec![Point3::origin(), Point3::new(1e308, 0., 0.), Point3::new(-1e308, 1., 0.)],
            vec![[0, 1, 2]],
        );
        assert_eq!(isosurface(&far, 32), Err(AttackError::NoExtent));
        assert_eq!(isosurface(&Soup::new(point.points, vec![[0, 0, 7]]), 32), Err(AttackError::NothingLeft));
        assert!(isosurface(&shapes::sphere(1), 1).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn any_soup_gives_a_manifold_or_an_error(
            points in prop::collection::vec([-2i32..3, -2..3, -2..3], 3..10),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..10), 1..20),
            resolution in 2u32..20,
        ) {
            let points = points.into_iter().map(|p| Point3::from(p.map(f64::from))).collect();
            let soup = Soup::new(points, triangles);
            if let Ok(fine) = isosurface(&soup, resolution) {
                prop_assert!(repair(&fine.soup).report.is_clean());
                prop_assert!(fine.soup.points.iter().all(|p| p.iter().all(|x| x.abs() < 3.0)));
            }
        }
    }
}
