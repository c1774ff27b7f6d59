//! A triangle mesh with what the quadratic forms ask of it: normals, areas, and pairs of faces that share an edge.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::BoundingBox;

/// Points and triangles, with normals and areas beside the triangles.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Of unit length; zero where there is no area.
    pub(crate) normals: Vec<Vector3<f64>>,
    /// Areas of the triangles.
    pub(crate) areas: Vec<f64>,
    pub(crate) hinges: Vec<Hinge>,
    /// The largest side of the bounding box.
    pub(crate) side: f64,
    /// The sum of all areas.
    pub(crate) area: f64,
}

/// An edge with the two faces beside it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hinge {
    /// The edge's ends; the first face runs from the first to the second.
    pub(crate) ends: [u32; 2],
    /// The faces' other corners.
    pub(crate) opposite: [u32; 2],
    pub(crate) faces: [u32; 2],
}

impl Surface {
    pub(crate) fn new(points: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Self {
        let cross = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|v| points[v as usize]);
            (b - a).cross(&(c - a)) / 2.0
        };
        let vectors: Vec<Vector3<f64>> = triangles.iter().map(cross).collect();
        let areas: Vec<f64> = vectors.iter().map(Vector3::norm).collect();
        let largest = areas.iter().fold(0.0, |a: f64, b| a.max(*b));
        let unit = |(v, area): (&Vector3<f64>, &f64)| {
            if *area > 1e-12 * largest { v / *area } else { Vector3::zeros() }
        };
        let normals = vectors.iter().zip(&areas).map(unit).collect();
        let hinges = hinges(&triangles);
        let side = BoundingBox::of(&points).map_or(0.0, |b| b.largest_side());
        let area = areas.iter().sum();
        Self { points, triangles, normals, areas, hinges, side, area }
    }

    pub(crate) fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        self.triangles[face].map(|v| self.points[v as usize])
    }

    /// A third of the area of the faces around each vertex.
    pub(crate) fn vertex_areas(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.points.len()];
        for (corners, area) in self.triangles.iter().zip(&self.areas) {
            corners.iter().for_each(|&v| sums[v as usize] += area / 3.0);
        }
        sums
    }

    /// Normals of the vertices, by area; zero where there are none.
    pub(crate) fn vertex_normals(&self) -> Vec<Vector3<f64>> {
        let mut sums = vec![Vector3::zeros(); self.points.len()];
        for (corners, (n, area)) in self.triangles.iter().zip(self.normals.iter().zip(&self.areas)) {
            corners.iter().for_each(|&v| sums[v as usize] += n * *area);
        }
        sums.iter().map(|n| n.try_normalize(0.0).unwrap_or_default()).collect()
    }

    /// The vertices joined to each vertex by an edge, in order.
    pub(crate) fn neighbours(&self) -> Rings {
        let both = |&[a, b, c]: &[u32; 3]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)];
        let mut pairs: Vec<(u32, u32)> = self.triangles.iter().flat_map(both).collect();
        pairs.sort_unstable();
        pairs.dedup();
        Rings::of_sorted(self.points.len(), pairs)
    }
}

/// Lists of vertices, one for each vertex.
#[derive(Debug, Clone)]
pub(crate) struct Rings {
    starts: Vec<usize>,
    all: Vec<u32>,
}

impl Rings {
    fn of_sorted(count: usize, pairs: Vec<(u32, u32)>) -> Self {
        let mut starts = vec![0; count + 1];
        pairs.iter().for_each(|&(v, _)| starts[v as usize + 1] += 1);
        (0..count).for_each(|v| starts[v + 1] += starts[v]);
        Self { starts, all: pairs.into_iter().map(|(_, w)| w).collect() }
    }

    pub(crate) fn of(&self, vertex: u32) -> &[u32] {
        &self.all[self.starts[vertex as usize]..self.starts[vertex as usize + 1]]
    }
}

/// Edges that have exactly two faces, which run along them in opposite directions.
fn hinges(triangles: &[[u32; 3]]) -> Vec<Hinge> {
    let mut sides: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(3 * triangles.len());
    for (f, corners) in (0..).zip(triangles) {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            sides.push(([a.min(b), a.max(b)], f, corners[(k + 2) % 3]));
        }
    }
    sides.sort_unstable();
    let pairs = sides.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 2);
    let hinge = |pair: &[([u32; 2], u32, u32)]| {
        let [a, b] = pair[0].0;
        let runs = |face: u32| {
            let corners = triangles[face as usize];
            (0..3).any(|k| corners[k] == a && corners[(k + 1) % 3] == b)
        };
        let [first, second] = if runs(pair[0].1) { [0, 1] } else { [1, 0] };
        Hinge {
            ends: [a, b],
            opposite: [pair[first].2, pair[second].2],
            faces: [pair[first].1, pair[second].1],
        }
    };
    pairs.map(hinge).collect()
}
