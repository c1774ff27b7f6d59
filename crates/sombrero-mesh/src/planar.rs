//! Planar regions: what a designer would call a flat face.
//!
//! Faces join across edges where they hardly turn. What joins is planar when its corners stay within a slab about its mean
//! normal, and is worth keeping so when it is a good part of the surface, or a smaller part with vertices of its own.

use crate::{Facets, Hinge, connected, hinges};
use nalgebra::{Point3, Vector3};

/// Faces that turn by less than this across an edge are one plane, in radians (0.05 degrees).
const FLAT: f64 = 8.7e-4;
/// How far a planar region's vertices may be from its plane, in largest sides.
const DEVIATION: f64 = 2e-4;
/// The least share of the area that makes a region worth keeping planar, and with three vertices inside.
const LEAST_AREA: f64 = 0.01;
const LEAST_AREA_INSIDE: f64 = 0.0005;
const INSIDE: usize = 3;

/// The planar regions of a surface.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PlanarRegions {
    /// Regions, each by its unit normal.
    pub normals: Vec<Vector3<f64>>,
    /// The region of each face.
    pub of_face: Vec<Option<u32>>,
    /// The share of the area that is planar.
    pub share: f64,
}

impl PlanarRegions {
    /// Finds those of `triangles`, in O(n log n). `side` is the largest side of the bounding box.
    ///
    /// ```
    /// let cube = sombrero_shapes::cube();
    /// let planar = sombrero_mesh::PlanarRegions::find(&cube.points, &cube.triangles, 2.0);
    /// assert_eq!(planar.normals.len(), 6);
    /// ```
    ///
    /// # Panics
    /// When a corner is not a point.
    pub fn find(points: &[Point3<f64>], triangles: &[[u32; 3]], side: f64) -> Self {
        let (facets, hinges) = (Facets::new(points, triangles), hinges(points.len(), triangles));
        Self::of(points, triangles, side, &facets, &hinges)
    }

    /// [`find`](Self::find), given the triangles' facets and hinges.
    ///
    /// # Panics
    /// As [`find`](Self::find), and when there are fewer facets than triangles.
    pub fn of(
        points: &[Point3<f64>],
        triangles: &[[u32; 3]],
        side: f64,
        facets: &Facets,
        hinges: &[Hinge],
    ) -> Self {
        let (labels, count) = flat_components(triangles.len(), facets, hinges);
        let mut area = vec![0.0; count];
        let mut normal = vec![Vector3::zeros(); count];
        for (f, &label) in labels.iter().enumerate() {
            area[label as usize] += facets.areas[f];
            normal[label as usize] += facets.normals[f] * facets.areas[f];
        }
        let total: f64 = facets.areas.iter().sum();
        let inside = inner_vertices(points.len(), triangles, &labels, count);
        let large = |r: usize| {
            area[r] >= LEAST_AREA * total || (inside[r] >= INSIDE && area[r] >= LEAST_AREA_INSIDE * total)
        };
        let normal: Vec<Vector3<f64>> =
            normal.into_iter().map(|n| n.try_normalize(0.0).unwrap_or_default()).collect();
        let bounds = heights(points, triangles, &labels, &normal);
        let mut region = vec![None; count];
        let mut normals = Vec::new();
        // Coordinates beyond all numbers have no planes.
        for r in (0..count).filter(|&r| total.is_finite() && large(r)) {
            if normal[r] != Vector3::zeros() && bounds[r][1] - bounds[r][0] < 2.0 * DEVIATION * side {
                region[r] = Some(normals.len() as u32);
                normals.push(normal[r]);
            }
        }
        let area = (0..count).filter(|&r| region[r].is_some()).map(|r| area[r]).sum::<f64>();
        let share = if normals.is_empty() { 0.0 } else { area / total };
        Self { normals, share, of_face: labels.iter().map(|&l| region[l as usize]).collect() }
    }
}

/// Which component each face belongs to, when faces join across edges where they hardly turn.
fn flat_components(faces: usize, facets: &Facets, hinges: &[Hinge]) -> (Vec<u32>, usize) {
    let flat = |hinge: &&Hinge| {
        let [a, b] = hinge.faces.map(|f| facets.normals[f as usize]);
        a.cross(&b).norm() < FLAT && a.dot(&b) > 0.0
    };
    let first = connected(faces, hinges.iter().filter(flat).map(|hinge| hinge.faces));
    // The first face of a component comes before its others.
    let mut number = vec![0; faces];
    let mut count = 0;
    for (face, &first) in first.iter().enumerate() {
        if face == first as usize {
            number[face] = count;
            count += 1;
        }
    }
    (first.into_iter().map(|first| number[first as usize]).collect(), count as usize)
}

/// How many vertices each component has inside: those all of whose faces belong to it.
fn inner_vertices(vertices: usize, triangles: &[[u32; 3]], labels: &[u32], count: usize) -> Vec<usize> {
    const NONE: u32 = u32::MAX;
    const SEVERAL: u32 = u32::MAX - 1;
    let mut of = vec![NONE; vertices];
    for (corners, &label) in triangles.iter().zip(labels) {
        for &v in corners {
            let of = &mut of[v as usize];
            *of = if *of == NONE || *of == label { label } else { SEVERAL };
        }
    }
    let mut inside = vec![0; count];
    of.into_iter().filter(|l| (*l as usize) < count).for_each(|l| inside[l as usize] += 1);
    inside
}

/// Least and largest height of each component's corners along its normal.
fn heights(
    points: &[Point3<f64>],
    triangles: &[[u32; 3]],
    labels: &[u32],
    normals: &[Vector3<f64>],
) -> Vec<[f64; 2]> {
    let mut bounds = vec![[f64::INFINITY, f64::NEG_INFINITY]; normals.len()];
    for (corners, &label) in triangles.iter().zip(labels) {
        for &v in corners {
            let height = normals[label as usize].dot(&points[v as usize].coords);
            let [low, high] = &mut bounds[label as usize];
            (*low, *high) = (low.min(height), high.max(height));
        }
    }
    bounds
}
