//! Walls and gaps: places that face each other, and how far apart they are.
//!
//! From the centre of every face and from every vertex a ray goes along the normal, outwards for a gap and inwards for a
//! wall, to the first face that is nearly parallel: its normal n' has |n · n'| at least cos 30°. Faces of walls look away from
//! each other, those of a layer above a body look the same way.

use crate::Assembly;
use crate::sites::Sites;
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{Edges, geometry};
use sombrero_spatial::{Crossing, Line, Surface};

/// cos 30°: where two smooth surfaces are nearest they are parallel, and creases that are wider are no walls.
const PARALLEL: f64 = 0.866_025_403_784_438_6;

/// Places that one task looks from.
const CHUNK: usize = 256;

/// Two places of the surface that face each other.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Facing {
    /// How far apart they are, in model units.
    pub distance: f64,
    /// The unit vector from one to the other, seen where the first of the points stands first.
    pub direction: Vector3<f64>,
    /// Points, and maps of their displacements whose sum is what the two come apart by.
    pub terms: Vec<(u32, Matrix3<f64>)>,
}

/// Pairs of places that face each other at less than `farthest`, as far as a place can come near, and of which `counts` holds:
/// `farthest` is told for each point, and a face has that of its farthest-reaching corner. What is within
/// [`reach`](crate::reach()) is in contact and no pair. O(n log n) as a rule; the same for any number of threads.
///
/// # Panics
/// When a corner or a point of a place is not below the number of points, or a slice is shorter.
pub fn facing(
    assembly: &Assembly<'_>,
    farthest: &[f64],
    counts: impl Fn(&Facing) -> bool + Sync + Send,
) -> Vec<Facing> {
    // Edges face nothing.
    let sites = Sites::new(assembly, &Edges::new(0, &[]));
    let normals: Vec<Vector3<f64>> =
        sites.triangles.iter().map(|corners| normal(&sites.at, corners)).collect();
    let search = Search {
        surface: Surface::new(&sites.at, &sites.triangles),
        around: around(&sites, &normals),
        normals,
        sites: &sites,
        assembly,
        farthest,
    };
    let (faces, vertices) = (sites.triangles.len(), sites.at.len());
    let look = |place: usize| match place.checked_sub(faces) {
        None => search.of_face(place as u32),
        Some(site) => search.of_vertex(site as u32),
    };
    let pairs = (0..faces + vertices).into_par_iter().with_min_len(CHUNK).flat_map_iter(look);
    pairs.filter(counts).collect()
}

/// Twice the area times the normal.
fn normal(points: &[Point3<f64>], corners: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = corners.map(|v| &points[v as usize]);
    geometry::area_vector(a, b, c)
}

/// The sum of the normals around each site, by area.
fn around(sites: &Sites, normals: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let mut around = vec![Vector3::zeros(); sites.at.len()];
    for (corners, normal) in sites.triangles.iter().zip(normals) {
        corners.iter().for_each(|&v| around[v as usize] += normal);
    }
    around
}

struct Search<'a> {
    surface: Surface,
    normals: Vec<Vector3<f64>>,
    around: Vec<Vector3<f64>>,
    sites: &'a Sites,
    assembly: &'a Assembly<'a>,
    farthest: &'a [f64],
}

impl Search<'_> {
    fn of_face(&self, face: u32) -> Vec<Facing> {
        let corners = self.sites.triangles[face as usize];
        let centre = corners.iter().map(|&v| self.sites.at[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        self.look(&Point3::from(centre), &self.normals[face as usize], &corners, 1.0 / 3.0)
    }

    fn of_vertex(&self, site: u32) -> Vec<Facing> {
        self.look(&self.sites.at[site as usize], &self.around[site as usize], &[site], 1.0)
    }

    /// What is seen inwards and outwards from `origin`, where each of `own` has this weight.
    fn look(&self, origin: &Point3<f64>, normal: &Vector3<f64>, own: &[u32], weight: f64) -> Vec<Facing> {
        let points = own.iter().map(|&site| self.sites.point[site as usize] as usize);
        let (farthest, contact) = points.fold((0.0_f64, 0.0_f64), |(far, contact), v| {
            (far.max(self.farthest[v]), contact.max(self.assembly.reach[v]))
        });
        let Some(normal) = normal.try_normalize(0.0).filter(|_| farthest > 0.0) else { return Vec::new() };
        let counts = |face: u32| {
            let back = self.normals[face as usize];
            let its = self.sites.triangles[face as usize];
            back.norm_squared() > 0.0
                && back.dot(&normal).abs() >= PARALLEL * back.norm()
                && !its.iter().any(|v| own.contains(v))
        };
        let line = Line { origin: *origin, direction: normal };
        let [behind, ahead] = self.surface.nearest_each_way(&line, farthest, counts);
        let seen = |(direction, hit): (Vector3<f64>, Option<Crossing>)| {
            let hit = hit?;
            let distance = hit.distance.abs();
            (distance > contact).then(|| Facing {
                distance,
                direction: self.sites.linear(own[0]).transpose() * direction,
                terms: self.terms(own, weight, hit.face, &(origin + direction * distance)),
            })
        };
        [(normal, ahead), (-normal, behind)].into_iter().filter_map(seen).collect()
    }

    /// The displacement of `own`, less that of the point `at` of a face, seen where the first of `own` is.
    fn terms(&self, own: &[u32], weight: f64, face: u32, at: &Point3<f64>) -> Vec<(u32, Matrix3<f64>)> {
        let corners = self.sites.triangles[face as usize];
        let [a, b, c] = corners.map(|v| self.sites.at[v as usize]);
        let whole = self.normals[face as usize];
        let part = |p: &Point3<f64>, q: &Point3<f64>| {
            (geometry::area_vector(p, q, at).dot(&whole) / whole.norm_squared()).clamp(0.0, 1.0)
        };
        let shares = [part(&b, &c), part(&c, &a), part(&a, &b)];
        let sum: f64 = shares.iter().sum();
        let near = own.iter().map(|&site| (site, weight));
        let far = corners.into_iter().zip(shares).map(|(site, share)| (site, -share / sum));
        let term = |(site, weight): (u32, f64)| {
            (self.sites.point[site as usize], self.sites.carried(site, own[0]) * weight)
        };
        near.chain(far).filter(|(_, weight)| *weight != 0.0).map(term).collect()
    }
}
