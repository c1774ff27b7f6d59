//! A mesh before and after its vertices moved, with what several measures ask of it.

use crate::dihedral::angle;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{BoundingBox, Facets, Hinge, hinges};
use sombrero_spatial::Surface;

/// Largest coordinate that takes part, in model units: products of four lengths do not overflow.
const LARGEST: f64 = 1e70;

/// Positions before and after, over the same triangles.
///
/// Triangles with a corner that is not there, is not finite or lies beyond 1e70 on one of both sides, and such with a corner
/// twice, are left out.
#[derive(Debug, Clone)]
pub struct Change<'a> {
    pub(crate) before: &'a [Point3<f64>],
    pub(crate) after: &'a [Point3<f64>],
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Before and after.
    pub(crate) facets: [Facets; 2],
    /// Before and after.
    pub(crate) surfaces: [Surface; 2],
    pub(crate) hinges: Vec<Hinge>,
    /// The dihedral angle at each hinge, before and after.
    pub(crate) angles: [Vec<Option<f64>>; 2],
    /// The bounding box before; that of a point without triangles.
    pub(crate) bounds: BoundingBox,
}

impl<'a> Change<'a> {
    /// Prepares the measures, in O(n log n).
    pub fn new(before: &'a [Point3<f64>], after: &'a [Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let usable = |p: &Point3<f64>| p.iter().all(|x| x.abs() <= LARGEST);
        let there = |v: u32| [before, after].iter().all(|side| side.get(v as usize).is_some_and(usable));
        let whole = |&&[a, b, c]: &&[u32; 3]| a != b && b != c && c != a && [a, b, c].into_iter().all(there);
        let triangles: Vec<[u32; 3]> = triangles.iter().filter(whole).copied().collect();
        let surfaces = || {
            let surface = Surface::new(before, &triangles);
            let mut moved = surface.clone();
            moved.refit(after);
            [surface, moved]
        };
        let bends = || {
            let hinges = hinges(before.len().min(after.len()), &triangles);
            let facets = [before, after].map(|points| Facets::new(points, &triangles));
            let angles = [(before, &facets[0]), (after, &facets[1])].map(|(points, facets)| {
                hinges.par_iter().map(|hinge| angle(points, &facets.normals, hinge)).collect()
            });
            (hinges, facets, angles)
        };
        let (surfaces, (hinges, facets, angles)) = rayon::join(surfaces, bends);
        let origin = BoundingBox { min: Point3::origin(), max: Point3::origin() };
        let corners = triangles.iter().flatten().map(|&v| &before[v as usize]);
        Self {
            before,
            after,
            facets,
            surfaces,
            hinges,
            angles,
            bounds: BoundingBox::of(corners).unwrap_or(origin),
            triangles,
        }
    }

    /// Positions before and after.
    pub(crate) fn sides(&self) -> [&'a [Point3<f64>]; 2] {
        [self.before, self.after]
    }

    pub(crate) fn corners(&self, side: usize, face: u32) -> [Point3<f64>; 3] {
        self.triangles[face as usize].map(|v| self.sides()[side][v as usize])
    }

    /// How many vertices there are on both sides, used or not.
    pub(crate) fn vertices(&self) -> usize {
        self.before.len().min(self.after.len())
    }

    /// Unit normals of the vertices, faces weighted by area; zero where there are none.
    pub(crate) fn vertex_normals(&self, side: usize) -> Vec<Vector3<f64>> {
        let Facets { normals, areas, .. } = &self.facets[side];
        let mut sums = vec![Vector3::zeros(); self.vertices()];
        for (corners, (normal, area)) in self.triangles.iter().zip(normals.iter().zip(areas)) {
            corners.iter().for_each(|&v| sums[v as usize] += normal * *area);
        }
        sums.iter().map(|n: &Vector3<f64>| n.try_normalize(0.0).unwrap_or_default()).collect()
    }
}
