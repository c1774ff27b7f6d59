//! Spheres: every face of an icosahedron cut into a triangular grid.

use nalgebra::Point3;

use super::icosahedron;
use sombrero_mesh::Soup;

/// Finest grid: 10 1024² + 2, about ten million vertices.
const MAX_FREQUENCY: usize = 1024;

/// A unit sphere about the origin with 10 4^s + 2 vertices: 12, 42, 162, 642, 2 562, 10 242, ...
///
/// `subdivisions` above 10 count as 10.
///
/// ```
/// let sphere = sombrero_shapes::sphere(3);
/// assert_eq!(sphere.points.len(), 642);
/// assert!(sphere.points.iter().all(|p| (p.coords.norm() - 1.0).abs() < 1e-12));
/// ```
pub fn sphere(subdivisions: usize) -> Soup {
    geodesic(1 << subdivisions.min(10))
}

/// The unit sphere with each icosahedron edge cut into `frequency` (1 to 1024) pieces: 10 f² + 2 vertices.
pub(super) fn geodesic(frequency: usize) -> Soup {
    let grid = Grid::new(frequency.clamp(1, MAX_FREQUENCY));
    Soup::new(grid.points(), grid.triangles())
}

/// The frequency whose vertex count 10 f² + 2 is nearest to `vertices`.
pub(super) fn frequency_for(vertices: usize) -> usize {
    let ideal = (vertices as f64 / 10.0).sqrt().round();
    (ideal as usize).clamp(1, MAX_FREQUENCY)
}

/// Vertex numbering of the subdivided icosahedron: corners, then edges, then insides of faces.
struct Grid {
    frequency: usize,
    solid: Soup,
    /// The 30 edges as pairs of corners, smaller corner first.
    edges: Vec<[u32; 2]>,
}

impl Grid {
    fn new(frequency: usize) -> Self {
        let solid = icosahedron();
        // Each edge is seen from both sides; the side that runs upwards stands for it.
        let around = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        let edges = solid.triangles.iter().flat_map(around).filter(|[from, to]| from < to).collect();
        Self { frequency, solid, edges }
    }

    /// The vertex `step` pieces along the edge from corner `from` to corner `to`.
    fn on_edge(&self, from: u32, to: u32, step: usize) -> usize {
        let (low, high) = (from.min(to), from.max(to));
        let edge = self.edges.iter().position(|e| *e == [low, high]).unwrap_or_default();
        let step = if from == low { step } else { self.frequency - step };
        match step {
            0 => low as usize,
            s if s == self.frequency => high as usize,
            s => 12 + edge * (self.frequency - 1) + s - 1,
        }
    }

    /// Vertex `place` of row `row` of a face; row 0 is the face's first corner.
    fn on_face(&self, face: usize, row: usize, place: usize) -> usize {
        let [a, b, c] = self.solid.triangles[face];
        if place == 0 {
            self.on_edge(a, b, row)
        } else if place == row {
            self.on_edge(a, c, row)
        } else if row == self.frequency {
            self.on_edge(b, c, place)
        } else {
            let pieces = self.frequency - 1;
            let first = 12 + 30 * pieces + face * (pieces * pieces.saturating_sub(1) / 2);
            first + (row - 1) * (row - 2) / 2 + place - 1
        }
    }

    fn points(&self) -> Vec<Point3<f64>> {
        let n = self.frequency;
        let mut points = self.solid.points.clone();
        points.reserve(10 * n * n);
        for &[low, high] in &self.edges {
            let (from, to) = (points[low as usize], points[high as usize]);
            points.extend((1..n).map(|step| along_arc(&from, &to, step, n)));
        }
        for face in 0..20 {
            for row in 2..n {
                let (from, to) = (points[self.on_face(face, row, 0)], points[self.on_face(face, row, row)]);
                points.extend((1..row).map(|place| along_arc(&from, &to, place, row)));
            }
        }
        points
    }

    fn triangles(&self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(20 * self.frequency * self.frequency);
        for face in 0..20 {
            let at = |row, place| self.on_face(face, row, place) as u32;
            for row in 0..self.frequency {
                for place in 0..=row {
                    triangles.push([at(row, place), at(row + 1, place), at(row + 1, place + 1)]);
                    if place < row {
                        triangles.push([at(row, place), at(row + 1, place + 1), at(row, place + 1)]);
                    }
                }
            }
        }
        triangles
    }
}

/// The unit vector `step` of `steps` equal angles along the great circle from `from` to `to`.
fn along_arc(from: &Point3<f64>, to: &Point3<f64>, step: usize, steps: usize) -> Point3<f64> {
    let angle = libm::acos(from.coords.dot(&to.coords).clamp(-1.0, 1.0));
    let part = step as f64 / steps as f64;
    let mix = from.coords * libm::sin((1.0 - part) * angle) + to.coords * libm::sin(part * angle);
    Point3::from(mix / mix.norm())
}
