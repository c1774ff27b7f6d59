//! Points at all the places where a scene shows them.

use crate::Assembly;
use nalgebra::{Matrix3, Point3};
use sombrero_mesh::Edges;

/// Entries of two maps that differ by less are the same map, rounded.
const SAME: f64 = 1e-9;

/// Every point where it stands first, in order, and then where it is shown besides.
#[derive(Debug)]
pub(crate) struct Sites {
    pub(crate) at: Vec<Point3<f64>>,
    pub(crate) point: Vec<u32>,
    /// The place of each site: 0 where points stand first.
    pub(crate) place: Vec<u32>,
    /// Linear parts of places, and their inverses.
    linear: Vec<[Matrix3<f64>; 2]>,
    /// Corners of all triangles at all places, as sites, and which triangle of the surface each is.
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) face: Vec<u32>,
    /// Ends of all edges at all places, as sites, and which edge each is.
    pub(crate) segments: Vec<[u32; 2]>,
    pub(crate) edge: Vec<u32>,
}

impl Sites {
    pub(crate) fn new(assembly: &Assembly<'_>, edges: &Edges) -> Self {
        let count = assembly.points.len();
        let mut sites = Self {
            at: shown(assembly),
            point: (0..count as u32).collect(),
            place: vec![0; count],
            linear: vec![[Matrix3::identity(); 2]],
            triangles: assembly.triangles.to_vec(),
            face: (0..assembly.triangles.len() as u32).collect(),
            segments: edges.ends.clone(),
            edge: (0..edges.len() as u32).collect(),
        };
        for place in assembly.places {
            // One that flattens shows nothing that could meet.
            let Some(inverse) = place.linear.try_inverse() else { continue };
            let first = sites.at.len() as u32;
            let site = |v: u32| place.points.binary_search(&v).ok().map(|i| first + i as u32);
            let at: Vec<Point3<f64>> =
                place.points.iter().map(|&v| place.at(&sites.at[v as usize])).collect();
            sites.at.extend(at);
            sites.point.extend_from_slice(&place.points);
            sites.place.resize(sites.at.len(), sites.linear.len() as u32);
            for (face, corners) in (0..).zip(assembly.triangles) {
                if let [Some(a), Some(b), Some(c)] = corners.map(site) {
                    sites.triangles.push([a, b, c]);
                    sites.face.push(face);
                }
            }
            for (edge, ends) in (0..).zip(&edges.ends) {
                if let [Some(a), Some(b)] = ends.map(site) {
                    sites.segments.push([a, b]);
                    sites.edge.push(edge);
                }
            }
            sites.linear.push([place.linear, inverse]);
        }
        sites
    }

    /// The linear part of a site's place.
    pub(crate) fn linear(&self, site: u32) -> &Matrix3<f64> {
        &self.linear[self.place[site as usize] as usize][0]
    }

    /// What the displacement of the point at site `to` is when it is to be seen as that at site `from`:
    /// A⁻¹ B with A, B the linear parts of their places.
    pub(crate) fn carried(&self, from: u32, to: u32) -> Matrix3<f64> {
        let [from, to] = [from, to].map(|site| self.place[site as usize] as usize);
        if from == to { Matrix3::identity() } else { tidied(self.linear[to][1] * self.linear[from][0]) }
    }
}

/// Where points are; those that nothing shows are nowhere.
fn shown(assembly: &Assembly<'_>) -> Vec<Point3<f64>> {
    let mut used = vec![assembly.draws_loose; assembly.points.len()];
    assembly.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let at = |(p, used): (&Point3<f64>, bool)| if used { *p } else { Point3::from([f64::NAN; 3]) };
    assembly.points.iter().zip(used).map(at).collect()
}

/// The same without rounding, where it is the identity.
pub(crate) fn tidied(map: Matrix3<f64>) -> Matrix3<f64> {
    if same(&map, &Matrix3::identity()) { Matrix3::identity() } else { map }
}

/// Whether two maps are the same but for rounding.
pub(crate) fn same(a: &Matrix3<f64>, b: &Matrix3<f64>) -> bool {
    (a - b).iter().all(|x| x.abs() <= SAME * (1.0 + b.amax()))
}
